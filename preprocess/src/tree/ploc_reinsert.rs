//! PLOC, then reinsertion (Meister and Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy
//! Optimization", 2018): subtrees move to where the tree's cost falls most. Both are obvhs's.

use hroc_format::{Bounds, Bvh};
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;

use super::{TreeBuilder, ploc};
use crate::bvh::BuildError;

/// Shares of the nodes that are candidates in the two runs: those of obvhs's medium preset, which makes
/// its second run twice as large.
const CANDIDATES: [f32; 2] = [0.05, 0.1];

/// The clustering, improved.
pub struct PlocReinsert;

impl TreeBuilder for PlocReinsert {
    fn name(&self) -> &'static str {
        "ploc-reinsert"
    }

    fn describe(&self) -> &'static str {
        "locally-ordered clustering, then reinsertion where the cost falls most, by obvhs"
    }

    fn build(&self, bounds: &[Bounds]) -> Result<Bvh, BuildError> {
        ploc::build(bounds, self.name(), |tree| {
            let mut optimizer = ReinsertionOptimizer::default();
            for share in CANDIDATES {
                optimizer.run(tree, share, None);
            }
        })
    }
}
