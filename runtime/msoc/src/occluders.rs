//! Which objects are worth rasterizing.

use std::cmp::Reverse;

use crate::geometry::{Aabb, Matrix4};
use crate::msoc::Msoc;

/// An object that might hide others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The caller's number for it.
    pub object: u32,
    /// In world space.
    pub bounds: Aabb,
    /// Triangles that it would take to rasterize it.
    pub triangles: u32,
}

/// What makes an occluder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OccluderChoice {
    /// Least size of its bounds in the image, pixels.
    pub least_area_px: f32,
    /// Triangles to be rasterized in all, at most.
    pub triangles: u64,
}

impl Default for OccluderChoice {
    /// 32x32 pixels, which is a few tiles; 50,000 triangles, about the paper's occluder mesh.
    fn default() -> Self {
        Self {
            least_area_px: 1024.0,
            triangles: 50_000,
        }
    }
}

impl Msoc {
    /// Chooses the objects that cover most pixels per triangle, as long as there are triangles to spend, and
    /// gives their numbers from front to back. Bounds that cross the near plane count as filling the image
    /// and as nearest.
    pub fn choose_occluders(
        &self,
        clip_from_world: &Matrix4,
        candidates: impl IntoIterator<Item = Candidate>,
        choice: &OccluderChoice,
    ) -> Vec<u32> {
        let whole = self.size().map(|side| side as f32).iter().product::<f32>();
        let mut chosen = Vec::new();
        for candidate in candidates {
            let (nearest, footprint) = self.box_footprint(clip_from_world, &candidate.bounds);
            let area = match footprint {
                Ok(rect) => {
                    let side = |axis: usize| (rect.max[axis] - rect.min[axis] + 1) as f32;
                    side(0) * side(1)
                }
                Err(crate::Visibility::Visible) => whole,
                Err(_) => continue,
            };
            if area >= choice.least_area_px && candidate.triangles > 0 {
                let worth = area / candidate.triangles as f32;
                chosen.push((worth, nearest, candidate));
            }
        }
        // Stable, so that equal ones stay in the caller's order.
        chosen.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut left = choice.triangles;
        chosen.retain(
            |(.., candidate)| match left.checked_sub(u64::from(candidate.triangles)) {
                Some(rest) => {
                    left = rest;
                    true
                }
                None => false,
            },
        );
        // Positive floats sort as their bits.
        chosen.sort_by_key(|&(_, nearest, _)| Reverse(nearest.to_bits()));
        chosen
            .into_iter()
            .map(|(.., candidate)| candidate.object)
            .collect()
    }
}
