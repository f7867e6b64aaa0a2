//! Parallel locally-ordered clustering (Meister and Bittner 2018): bottom up, each cluster joins the one
//! nearby that makes the smallest box with it, if that one chooses likewise. The clustering is obvhs's.

use glam::{DVec3, Vec3A};
use hroc_format::{Bounds, Bvh};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, DEFAULT_MAX_STACK_DEPTH};
use obvhs::ploc::morton::morton_encode_u64_unorm;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::TreeBuilder;
use crate::bvh::{self, BuildError};
use crate::split::EqualCount;

/// obvhs's settings for its medium preset: 14 neighbours to either side, from the fourth pass on.
const SEARCH: PlocSearchDistance = PlocSearchDistance::Medium;
const SEARCH_FROM_PASS: usize = 3;

/// Of this many neighbouring objects some are clustered on trial.
const STRETCH: usize = 1024;
/// This many of them.
const SAMPLE: usize = 256;
/// More stretches than this in which clustering fails would take seconds.
const MAX_HOPELESS: usize = 4;

/// The clustering as it is.
pub struct Ploc;

impl TreeBuilder for Ploc {
    fn name(&self) -> &'static str {
        "ploc"
    }

    fn describe(&self) -> &'static str {
        "locally-ordered clustering from the leaves up, by obvhs"
    }

    fn build(&self, bounds: &[Bounds]) -> Result<Bvh, BuildError> {
        build(bounds, self.name(), |_| {})
    }
}

/// Clusters, lets `improve` change the tree, and brings it into our layout.
///
/// Where objects offer clustering nothing to choose by - equal boxes, boxes in boxes, even rows - each pass
/// joins but a few, which takes time with the square of their number. Trials on some of the objects show
/// that beforehand; if they are many, the objects are halved by count instead.
pub(super) fn build(
    bounds: &[Bounds],
    name: &str,
    improve: impl FnOnce(&mut Bvh2),
) -> Result<Bvh, BuildError> {
    bvh::check_bounds(bounds)?;
    let boxes = normalized(bounds);
    if is_hopeless(&boxes) {
        let halved = bvh::build(bounds, &EqualCount)?;
        return Ok(Bvh {
            split: name.to_owned(),
            ..halved
        });
    }
    let mut tree = cluster(&boxes);
    improve(&mut tree);
    Ok(bvh::from_depth_first(bounds, name, &depth_first(&tree)))
}

/// The boxes in a cube from -1 to 1: in f32, areas of boxes as large as they come overflow, and those of
/// small ones vanish. Rounding does no harm: the boxes only decide who joins whom.
fn normalized(bounds: &[Bounds]) -> Vec<Aabb> {
    let wide = |corner: [f32; 3]| DVec3::from_array(corner.map(f64::from));
    let min = bounds
        .iter()
        .map(|b| wide(b.min))
        .fold(DVec3::INFINITY, DVec3::min);
    let max = bounds
        .iter()
        .map(|b| wide(b.max))
        .fold(DVec3::NEG_INFINITY, DVec3::max);
    let (centre, half) = (0.5 * (min + max), 0.5 * (max - min).max_element());
    let scale = if half > 0.0 { half.recip() } else { 0.0 };
    let place = |corner: [f32; 3]| ((wide(corner) - centre) * scale).as_vec3a();
    let place = |b: &Bounds| -> [Vec3A; 2] { [place(b.min), place(b.max)] };
    bounds
        .iter()
        .map(|b| {
            let [min, max] = place(b);
            Aabb { min, max }
        })
        .collect()
}

fn cluster(boxes: &[Aabb]) -> Bvh2 {
    PlocBuilder::with_capacity(boxes.len()).build(
        SEARCH,
        boxes,
        (0..boxes.len() as u32).collect(),
        SortPrecision::U64,
        SEARCH_FROM_PASS,
    )
}

/// Whether clustering would take time with the square of the number of objects.
fn is_hopeless(boxes: &[Aabb]) -> bool {
    let middle = |b: &Aabb| 0.25 * (b.min + b.max).as_dvec3() + 0.5;
    let mut order: Vec<(u64, u32)> = (0..)
        .zip(boxes)
        .map(|(i, b)| (morton_encode_u64_unorm(middle(b)), i))
        .collect();
    order.sort_unstable();
    let is_bad = |stretch: &&[(u64, u32)]| {
        let sample = stretch.iter().take(SAMPLE);
        let sample: Vec<_> = sample.map(|&(_, i)| boxes[i as usize]).collect();
        // obvhs states the number of passes where it is above the depth it is made for.
        cluster(&sample).max_depth > DEFAULT_MAX_STACK_DEPTH
    };
    order
        .chunks(STRETCH)
        .filter(is_bad)
        .nth(MAX_HOPELESS)
        .is_some()
}

/// The nodes depth first: the object of a leaf, `None` for an inner node.
fn depth_first(tree: &Bvh2) -> Vec<Option<u32>> {
    let mut sequence = Vec::with_capacity(tree.nodes.len());
    let mut waiting = vec![0];
    while let Some(index) = waiting.pop() {
        let node = &tree.nodes[index];
        if node.is_leaf() {
            sequence.push(Some(tree.primitive_indices[node.first_index as usize]));
        } else {
            sequence.push(None);
            let left = node.first_index as usize;
            waiting.extend([left + 1, left]);
        }
    }
    sequence
}
