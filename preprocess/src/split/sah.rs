//! Surface area heuristic: the cut with the least expected cost, `area(left) * count(left) +
//! area(right) * count(right)` (Goldsmith and Salmon 1987, MacDonald and Booth 1990).
//!
//! On each axis the objects are put into slots from left to right, and the cuts between slots are tried.
//! In large nodes a slot is a bin (Wald, "On fast Construction of SAH-based Bounding Volume
//! Hierarchies", 2007); in small ones, which are most of the tree, each object has its own, so that all
//! cuts are tried. The three axes take the first three lanes of a vector.

use glam::{BVec4A, IVec4, Mat4, Vec4};

use super::{Cut, SplitRule};
use crate::bvh::{Aabb, ObjectBox, middle_bounds};

/// The cut of least expected cost.
pub struct Sah;

impl SplitRule for Sah {
    fn name(&self) -> &'static str {
        "sah"
    }

    fn describe(&self) -> &'static str {
        "surface area heuristic: least expected cost over cuts on all three axes"
    }

    fn cut(&self, objects: &[ObjectBox]) -> Cut {
        // More bins find better cuts, but take time per node, and most nodes are small.
        let cut = match objects.len() {
            ..=4 => sweep::<4>(objects),
            5..=8 => sweep::<8>(objects),
            9..=16 => sweep::<16>(objects),
            17..=32 => sweep::<32>(objects),
            33..=1024 => binned::<32>(objects),
            1025.. => binned::<64>(objects),
        };
        cut.unwrap_or_else(|| Cut::halves(objects))
    }
}

/// The axis and the slot on the right of the best cut. `slots` has the bounds of what lies in each slot
/// on each axis, `counts` the number of objects; `may_cut` whether to cut on the left of a slot.
#[inline(always)]
fn best_cut<const SLOTS: usize>(
    objects: usize,
    slot_count: usize,
    slots: impl Fn(usize) -> [Aabb; 3],
    counts: impl Fn(usize) -> Vec4,
    may_cut: impl Fn(usize) -> BVec4A,
) -> Option<(usize, usize)> {
    let slot_count = slot_count.min(SLOTS);
    let mut right_areas = [Vec4::ZERO; SLOTS];
    let mut right = [Aabb::EMPTY; 3];
    for slot in (1..slot_count).rev() {
        right = unions(right, slots(slot));
        right_areas[slot] = half_areas(right);
    }

    let all = Vec4::splat(objects as f32);
    let half = all * 0.5;
    let mut left = [Aabb::EMPTY; 3];
    let mut left_count = Vec4::ZERO;
    let mut best_cost = Vec4::INFINITY;
    let mut best_slot = Vec4::ZERO;
    for (slot, &right_area) in right_areas.iter().enumerate().take(slot_count).skip(1) {
        left = unions(left, slots(slot - 1));
        left_count += counts(slot - 1);
        // Not a number where a side is empty, which is less than nothing.
        let cost = half_areas(left) * left_count + right_area * (all - left_count);
        // Between equal costs the more even cut wins: where areas are zero it keeps the tree shallow.
        let is_better = cost.cmplt(best_cost) | cost.cmpeq(best_cost) & left_count.cmple(half);
        let is_better = is_better & may_cut(slot);
        best_cost = Vec4::select(is_better, cost, best_cost);
        best_slot = Vec4::select(is_better, Vec4::splat(slot as f32), best_slot);
    }
    let mut axis = 0;
    for other in 1..3 {
        if best_cost[other] < best_cost[axis] {
            axis = other;
        }
    }
    best_cost[axis]
        .is_finite()
        .then(|| (axis, best_slot[axis] as usize))
}

#[inline(always)]
fn unions(a: [Aabb; 3], b: [Aabb; 3]) -> [Aabb; 3] {
    std::array::from_fn(|axis| a[axis].union(b[axis]))
}

/// Half the surface areas of three boxes.
#[inline(always)]
fn half_areas(boxes: [Aabb; 3]) -> Vec4 {
    let [a, b, c] = boxes.map(Aabb::extent);
    let Mat4 {
        x_axis: x,
        y_axis: y,
        z_axis: z,
        ..
    } = Mat4::from_cols(a, b, c, Vec4::ZERO).transpose();
    x * y + (x + y) * z
}

/// In this binade the last bit of a float is worth one: adding it rounds, and leaves the integer in
/// the low bits. A cast would check every lane for NaN and range.
const ROUND: f32 = 1.5 * (1 << 23) as f32;

/// Tries every plane between two different middles of at most `MAX` objects.
fn sweep<const MAX: usize>(objects: &[ObjectBox]) -> Option<Cut> {
    let count = objects.len().min(MAX);
    let mut middles = [Vec4::ZERO; MAX];
    // How many come before, equal ones in the order of their index. Counted without a branch on the
    // data, which beats any sort of so few.
    let mut ranks = [Vec4::ZERO; MAX];
    for i in 0..count {
        let middle = objects[i].middle();
        let mut rank = Vec4::splat((count - 1 - i) as f32);
        for j in 0..i {
            let is_after = Vec4::select(middles[j].cmple(middle), Vec4::ONE, Vec4::ZERO);
            rank += is_after;
            ranks[j] -= is_after;
        }
        middles[i] = middle;
        ranks[i] = rank;
    }
    let mut order = [[0_u8; 4]; MAX];
    let mut sorted = [[0.0_f32; 4]; MAX];
    for i in 0..count {
        let rank = ranks[i] + ROUND;
        for axis in 0..3 {
            let rank = rank[axis].to_bits() as usize % MAX;
            order[rank][axis] = i as u8;
            sorted[rank][axis] = middles[i][axis];
        }
    }
    let (axis, first_right) = best_cut::<MAX>(
        count,
        count,
        |slot| std::array::from_fn(|axis| objects[order[slot][axis] as usize].aabb()),
        |_| Vec4::ONE,
        |slot| Vec4::from_array(sorted[slot - 1]).cmplt(Vec4::from_array(sorted[slot])),
    )?;
    Some(Cut::Plane {
        axis,
        position: sorted[first_right][axis],
    })
}

/// Tries the planes between `BINS` bins on each axis.
fn binned<const BINS: usize>(objects: &[ObjectBox]) -> Option<Cut> {
    let bounds = middle_bounds(objects);
    // Bins are centred on multiples of their width, the first on the first middle and the last on the
    // last, so that rounding finds the bin. Zero times the largest scale stays zero.
    let scale = (Vec4::splat((BINS - 1) as f32) / bounds.extent()).min(Vec4::MAX);
    let mut bins = [[Aabb::EMPTY; 3]; BINS];
    let mut counts = [[0_i32; 4]; BINS];
    for object in objects {
        let aabb = object.aabb();
        let place = (object.middle() - bounds.min) * scale + ROUND;
        for axis in 0..3 {
            let bin = place[axis].to_bits() as usize % BINS;
            bins[bin][axis] = bins[bin][axis].union(aabb);
            counts[bin][axis] += 1;
        }
    }
    let (axis, first_right) = best_cut::<BINS>(
        objects.len(),
        BINS,
        |bin| bins[bin],
        |bin| IVec4::from_array(counts[bin]).as_vec4(),
        |_| BVec4A::TRUE,
    )?;
    Some(Cut::Plane {
        axis,
        position: bounds.min[axis] + (first_right as f32 - 0.5) / scale[axis],
    })
}
