//! Surface area heuristic: the cut with the least expected cost, `area(left) * count(left) +
//! area(right) * count(right)` (Goldsmith and Salmon 1987, MacDonald and Booth 1990).
//!
//! Large nodes are binned on all three axes in one pass (Wald, "On fast Construction of SAH-based
//! Bounding Volume Hierarchies", 2007); small ones, which are most of the tree, are swept exactly.

use glam::{Vec4, Vec4Swizzles};

use super::{Cut, NodeObjects, SplitRule};
use crate::bvh::Aabb;

/// Nodes up to this size are swept.
const SWEEP_MAX_OBJECTS: usize = 8;

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
        // More bins find better cuts, but take time per node, and most nodes are small.
        let count = node.objects.len();
        let cut = if count <= 4 {
            // Half of all nodes: the time of a sweep grows with the square of the room it has.
            sweep::<4>(node)
        } else if count <= SWEEP_MAX_OBJECTS {
            sweep::<SWEEP_MAX_OBJECTS>(node)
        } else if count <= 32 {
            binned::<16>(node)
        } else if count <= 1024 {
            binned::<32>(node)
        } else {
            binned::<64>(node)
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

/// Tries every plane between two different centroids of at most `MAX` objects.
fn sweep<const MAX: usize>(node: &NodeObjects) -> Option<Cut> {
    let count = node.objects.len();
    let ruler = Ruler::new(node.bounds);
    let mut boxes = [Aabb::EMPTY; MAX];
    // Per axis; those past `count` come last in every order.
    let mut centroids = [[f32::INFINITY; MAX]; 3];
    for (i, object) in node.objects.iter().enumerate() {
        boxes[i] = object.aabb();
        let centroid = object.centroid();
        for (axis, centroids) in centroids.iter_mut().enumerate() {
            centroids[i] = centroid[axis];
        }
    }

    let mut best = Best::new();
    for (axis, centroids) in centroids.iter().enumerate() {
        let order = sorted(centroids);
        let mut right_areas = [0.0; MAX];
        let mut right = Aabb::EMPTY;
        for rank in (1..count).rev() {
            right = right.union(boxes[order[rank]]);
            right_areas[rank] = ruler.half_area(right);
        }
        let mut left = Aabb::EMPTY;
        for rank in 1..count {
            let (last, first) = (order[rank - 1], order[rank]);
            left = left.union(boxes[last]);
            let right_count = count - rank;
            let cost = ruler.half_area(left) * rank as f32 + right_areas[rank] * right_count as f32;
            if centroids[last] < centroids[first] {
                best.offer(cost, rank, right_count, (axis, first));
            }
        }
    }
    best.place.map(|(axis, first)| Cut::Plane {
        axis,
        position: centroids[axis][first],
    })
}

/// The order of the values, equal ones by index. Counts for each value how many come before it:
/// without branches on the data that beats any sort of so few.
#[inline]
fn sorted<const N: usize>(values: &[f32; N]) -> [usize; N] {
    let mut order = [0; N];
    for i in 0..N {
        let before = |j: usize| {
            if j < i {
                values[j] <= values[i]
            } else {
                values[j] < values[i]
            }
        };
        let rank: usize = (0..N).map(|j| usize::from(before(j))).sum();
        order[rank] = i;
    }
    order
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: u32,
}

/// In this binade the last bit of a float is worth one: adding it rounds, and leaves the integer in
/// the low bits. A cast would check every lane for NaN and range.
const ROUND: f32 = 1.5 * (1 << 23) as f32;

/// Maps centroids to `BINS` bins per axis.
#[derive(Clone, Copy)]
struct Binning<const BINS: usize> {
    half_min: Vec4,
    scale: Vec4,
}

impl<const BINS: usize> Binning<BINS> {
    const LAST: f32 = (BINS - 1) as f32;

    fn new(centroid_bounds: Aabb) -> Self {
        let scale = BINS as f32 / centroid_bounds.half_extent();
        // Zero times this stays zero, and the shortest edge times this stays within the bins.
        Self {
            half_min: centroid_bounds.min * 0.5,
            scale: scale.min(Vec4::MAX),
        }
    }

    /// The bin on every axis.
    #[inline]
    fn bins(&self, centroid: Vec4) -> [usize; 3] {
        let place = (centroid * 0.5 - self.half_min) * self.scale - 0.5;
        let bins = place.min(Vec4::splat(Self::LAST)) + ROUND;
        std::array::from_fn(|axis| bins[axis].to_bits() as usize % BINS)
    }

    /// The bin on one axis, in the same arithmetic.
    #[inline]
    fn bin(&self, centroid: f32, axis: usize) -> f32 {
        let place = (centroid * 0.5 - self.half_min[axis]) * self.scale[axis] - 0.5;
        place.min(Self::LAST) + ROUND - ROUND
    }
}

/// Tries the planes between the bins of each axis.
fn binned<const BINS: usize>(node: &NodeObjects) -> Option<Cut> {
    let count = node.objects.len();
    let ruler = Ruler::new(node.bounds);
    let binning = Binning::<BINS>::new(node.centroid_bounds);
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
    for (axis, bins) in bins.iter().enumerate() {
        let mut right_areas = [0.0; BINS];
        let mut right = Aabb::EMPTY;
        for i in (1..BINS).rev() {
            right = right.union(bins[i].bounds);
            right_areas[i] = ruler.half_area(right);
        }
        let (mut left, mut left_count) = (Aabb::EMPTY, 0);
        for i in 1..BINS {
            left = left.union(bins[i - 1].bounds);
            left_count += bins[i - 1].count as usize;
            let right_count = count - left_count;
            let cost =
                ruler.half_area(left) * left_count as f32 + right_areas[i] * right_count as f32;
            // Past an empty bin lies the same cut again.
            if bins[i - 1].count > 0 && right_count > 0 {
                best.offer(cost, left_count, right_count, (axis, i));
            }
        }
    }

    // The plane goes through the first centroid on its right, so that the builder's comparison and
    // the bins cannot disagree by a rounding.
    let (axis, first_right) = best.place?;
    let position = node.objects.iter().fold(f32::INFINITY, |position, object| {
        let centroid = object.centroid_on(axis);
        let is_right = binning.bin(centroid, axis) >= first_right as f32;
        position.min(if is_right { centroid } else { f32::INFINITY })
    });
    Some(Cut::Plane { axis, position })
}
