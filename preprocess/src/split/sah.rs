//! Surface area heuristic: the cut with the least expected cost, `area(left) * count(left) +
//! area(right) * count(right)` (Goldsmith and Salmon 1987, MacDonald and Booth 1990).
//!
//! Large nodes are binned on all three axes in one pass (Wald, "On fast Construction of SAH-based
//! Bounding Volume Hierarchies", 2007); small ones, which are most of the tree, are swept exactly.

use glam::{Vec4, Vec4Swizzles};

use super::{Cut, NodeObjects, SplitRule};
use crate::bvh::Aabb;

/// Nodes up to this size are swept.
const SWEEP_MAX_OBJECTS: usize = 32;

/// Bins per axis.
const BINS: usize = 32;

/// The cut of least expected cost.
pub struct Sah;

impl SplitRule for Sah {
    fn name(&self) -> &'static str {
        "sah"
    }

    fn describe(&self) -> &'static str {
        "surface area heuristic: least expected cost over cuts on all three axes"
    }

    fn cut(&self, node: &NodeObjects) -> Cut {
        let cut = if node.objects.len() <= SWEEP_MAX_OBJECTS {
            sweep(node)
        } else {
            binned(node)
        };
        cut.unwrap_or_else(|| Cut::halves(node))
    }
}

/// Measures areas relative to a node, so that no product of f32 lengths overflows and only areas
/// that do not matter to the node vanish.
#[derive(Clone, Copy)]
struct Ruler {
    scale: f32,
}

impl Ruler {
    fn new(node: Aabb) -> Self {
        Self {
            scale: node.half_extent().max_element().recip().min(f32::MAX),
        }
    }

    /// Half the surface area of a box in the node, in units of the node's longest edge squared.
    #[inline]
    fn half_area(self, aabb: Aabb) -> f32 {
        let edge = aabb.half_extent() * self.scale;
        let faces = edge * edge.yzxw();
        faces.x + faces.y + faces.z
    }
}

/// The best cut so far.
struct Best<Place> {
    cost: f32,
    imbalance: usize,
    place: Option<Place>,
}

impl<Place> Best<Place> {
    fn new() -> Self {
        Self {
            cost: f32::INFINITY,
            imbalance: 0,
            place: None,
        }
    }

    /// Between equal costs the more even cut wins: where areas are zero it keeps the tree shallow.
    #[inline]
    fn offer(&mut self, cost: f32, left: usize, right: usize, place: Place) {
        let imbalance = left.abs_diff(right);
        if cost < self.cost || (cost == self.cost && imbalance < self.imbalance) {
            *self = Self {
                cost,
                imbalance,
                place: Some(place),
            };
        }
    }
}

/// Tries every plane between two different centroids.
fn sweep(node: &NodeObjects) -> Option<Cut> {
    let count = node.objects.len();
    let ruler = Ruler::new(node.bounds);
    let mut best = Best::new();
    let mut order = [0_u64; SWEEP_MAX_OBJECTS];
    let order = &mut order[..count];
    let mut right_areas = [0.0; SWEEP_MAX_OBJECTS];
    for axis in 0..3 {
        if node.centroid_bounds.min[axis] == node.centroid_bounds.max[axis] {
            continue;
        }
        for (slot, (key, object)) in order.iter_mut().zip(node.objects).enumerate() {
            *key = u64::from(sort_key(object.centroid()[axis])) << 32 | slot as u64;
        }
        order.sort_unstable();
        let object = |rank: usize| &node.objects[order[rank] as u32 as usize];

        let mut right = Aabb::EMPTY;
        for rank in (1..count).rev() {
            right = right.union(object(rank).aabb());
            right_areas[rank] = ruler.half_area(right);
        }
        let mut left = Aabb::EMPTY;
        let mut last = node.centroid_bounds.min[axis];
        for rank in 1..count {
            left = left.union(object(rank - 1).aabb());
            let position = object(rank).centroid()[axis];
            if position > last {
                let cost =
                    ruler.half_area(left) * rank as f32 + right_areas[rank] * (count - rank) as f32;
                best.offer(cost, rank, count - rank, Cut::Plane { axis, position });
            }
            last = position;
        }
    }
    best.place
}

/// Maps floats to integers of the same order.
#[inline]
fn sort_key(x: f32) -> u32 {
    let bits = x.to_bits();
    bits ^ (((bits as i32) >> 31) as u32 | 0x8000_0000)
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: usize,
}

/// Maps centroids to bins, per axis.
#[derive(Clone, Copy)]
struct Binning {
    half_min: Vec4,
    scale: Vec4,
}

impl Binning {
    fn new(centroid_bounds: Aabb) -> Self {
        let scale = BINS as f32 / centroid_bounds.half_extent();
        // Zero times this stays zero, and the shortest edge times this stays within the bins.
        Self {
            half_min: centroid_bounds.min * 0.5,
            scale: scale.min(Vec4::MAX),
        }
    }

    #[inline]
    fn bins(&self, centroid: Vec4) -> [usize; 3] {
        let place = ((centroid * 0.5 - self.half_min) * self.scale).as_uvec4();
        [place.x, place.y, place.z].map(|bin| (bin as usize).min(BINS - 1))
    }
}

/// Tries the planes between the bins of each axis.
fn binned(node: &NodeObjects) -> Option<Cut> {
    let count = node.objects.len();
    let ruler = Ruler::new(node.bounds);
    let binning = Binning::new(node.centroid_bounds);
    let mut bins = [[Bin {
        bounds: Aabb::EMPTY,
        count: 0,
    }; BINS]; 3];
    for object in node.objects {
        let aabb = object.aabb();
        for (axis, bin) in binning.bins(object.centroid()).into_iter().enumerate() {
            let bin = &mut bins[axis][bin];
            bin.bounds = bin.bounds.union(aabb);
            bin.count += 1;
        }
    }

    let mut best = Best::new();
    let mut right_areas = [0.0; BINS];
    for (axis, bins) in bins.iter().enumerate() {
        let mut right = Aabb::EMPTY;
        for (i, bin) in bins.iter().enumerate().skip(1).rev() {
            right = right.union(bin.bounds);
            right_areas[i] = ruler.half_area(right);
        }
        let (mut left, mut left_count) = (Aabb::EMPTY, 0);
        for i in 1..BINS {
            left = left.union(bins[i - 1].bounds);
            left_count += bins[i - 1].count;
            // Past an empty bin lies the same cut again.
            if bins[i - 1].count == 0 || left_count == count {
                continue;
            }
            let right_count = count - left_count;
            let cost =
                ruler.half_area(left) * left_count as f32 + right_areas[i] * right_count as f32;
            best.offer(cost, left_count, right_count, (axis, i));
        }
    }

    // The plane goes through the first centroid on its right, so that the builder's comparison and
    // the bins cannot disagree by a rounding.
    let (axis, first_right) = best.place?;
    let in_right = |c: &Vec4| binning.bins(*c)[axis] >= first_right;
    let position = node
        .objects
        .iter()
        .map(|object| object.centroid())
        .filter(in_right);
    let position = position.fold(f32::INFINITY, |min, c| min.min(c[axis]));
    Some(Cut::Plane { axis, position })
}
