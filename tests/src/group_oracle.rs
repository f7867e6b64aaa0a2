//! What extract_groups decides of a node's bounds, in f64 with a bound of what f32 can make of it: yes, no, or undecided.
//!
//! The shader rounds each operation in whatever order its compiler likes, fused or not. Every quantity is therefore
//! computed with a bound of the error of any such order; where a comparison falls within it, nothing is said.

use std::ops::Not;

use glam::{DVec3, DVec4};
use hroc_format::ObjectBounds;
use hroc_runtime::FrameUniform;
use hroc_runtime::twin::bounds::LARGEST_NDC;

/// Vulkan lets an operation return either neighbour.
const U: f64 = 1.0 / (1 << 23) as f64;
/// No value takes more operations than this.
const STEPS: f64 = 12.0;

/// An answer, `None` where rounding decides.
pub type Decided = Option<bool>;

/// Both, or no matter what the other is.
pub fn and(a: Decided, b: Decided) -> Decided {
    not(or(not(a), not(b)))
}

/// One of them.
pub fn or(a: Decided, b: Decided) -> Decided {
    match (a, b) {
        (Some(true), _) | (_, Some(true)) => Some(true),
        (Some(false), Some(false)) => Some(false),
        _ => None,
    }
}

/// The opposite.
pub fn not(a: Decided) -> Decided {
    a.map(Not::not)
}

/// A number somewhere between two.
#[derive(Clone, Copy, Debug)]
struct Range {
    lo: f64,
    hi: f64,
}

impl Range {
    fn new(value: f64, error: f64) -> Self {
        Self {
            lo: value - error,
            hi: value + error,
        }
    }

    fn at_least(self, than: f64) -> Decided {
        match () {
            () if self.lo >= than => Some(true),
            () if self.hi < than => Some(false),
            () => None,
        }
    }
}

/// A box whose corners each err by up to `error`.
#[derive(Clone, Copy, Debug)]
struct Rough {
    lo: DVec3,
    hi: DVec3,
    error: f64,
}

/// What the stage asks of a node's bounds.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// The padded bounds are in the frustum.
    pub in_frustum: Decided,
    /// A rasterized box can stand for them.
    pub rasterizable: Decided,
    /// They are replaced by their children.
    pub refine: Decided,
    /// The bare bounds are in the frustum, as f64 has it.
    pub bare_in_frustum: bool,
}

fn plane(plane: [f32; 4]) -> DVec4 {
    DVec4::from_array(plane.map(f64::from))
}

/// Distance from a plane to the corner farthest along its normal, or nearest.
fn distance(plane: DVec4, b: Rough, farthest: bool) -> Range {
    let normal = plane.truncate();
    let (with, against) = if farthest { (b.hi, b.lo) } else { (b.lo, b.hi) };
    let terms = normal.max(DVec3::ZERO) * with + normal.min(DVec3::ZERO) * against;
    let size = terms.abs().element_sum() + plane.w.abs();
    let error = STEPS * U * size + normal.abs().element_sum() * b.error;
    Range::new(terms.element_sum() + plane.w, error)
}

/// The largest sum of absolute coordinates of a corner.
fn reach(b: Rough) -> f64 {
    b.lo.abs().max(b.hi.abs()).element_sum()
}

/// `padding`: everywhere, per reach, per depth.
fn grown(frame: &FrameUniform, b: Rough, padding: [f32; 3]) -> Rough {
    let [everywhere, per_reach, per_depth] = padding.map(f64::from);
    let farthest = distance(plane(frame.forward), b, true);
    let depth = (0.5 * (farthest.lo + farthest.hi)).max(0.0);
    let padding = everywhere + per_reach * reach(b) + per_depth * depth;
    let corner = b.lo.abs().max(b.hi.abs()).max_element();
    Rough {
        lo: b.lo - padding,
        hi: b.hi + padding,
        error: b.error
            + per_reach * 3.0 * b.error
            + per_depth * 0.5 * (farthest.hi - farthest.lo)
            + STEPS * U * (padding + corner),
    }
}

/// Pixels of the screen rectangle and distance of its farthest corner, of a box in front of the near plane.
fn footprint(frame: &FrameUniform, b: Rough) -> [Range; 2] {
    let columns = frame.clip_from_relative.map(plane);
    let mut lo = [[f64::INFINITY; 2]; 2];
    let mut hi = [[f64::NEG_INFINITY; 2]; 2];
    for corner in 0..8 {
        let pick = |axis: usize| [b.lo[axis], b.hi[axis]][corner >> axis & 1];
        let component = |row: usize| {
            let [x, y, z] = [0, 1, 2].map(|axis| columns[axis][row] * pick(axis));
            // The shader goes from one corner along the edges.
            let reach = (0..3).map(|axis| {
                columns[axis][row].abs() * (b.lo[axis].abs() + 2.0 * b.hi[axis].abs() + b.error)
            });
            let slope = (0..3).map(|axis| columns[axis][row].abs()).sum::<f64>();
            let error =
                STEPS * U * (reach.sum::<f64>() + columns[3][row].abs()) + 3.0 * slope * b.error;
            (x + y + z + columns[3][row], error)
        };
        let (w, w_error) = component(3);
        for axis in 0..2 {
            let (x, x_error) = component(axis);
            let range = if w > 2.0 * w_error {
                let ndc = x / w;
                let error = (x_error + ndc.abs() * w_error) / (w - w_error) + STEPS * U * ndc.abs();
                Range::new(ndc, error)
            } else {
                Range::new(0.0, f64::INFINITY)
            };
            // Smallest and largest of what the corners' smallest may be, and likewise of their largest.
            lo[axis] = [lo[axis][0].min(range.lo), lo[axis][1].min(range.hi)];
            hi[axis] = [hi[axis][0].max(range.lo), hi[axis][1].max(range.hi)];
        }
    }
    let side = |axis: usize, lo: f64, hi: f64| {
        0.5 * (hi.min(1.0) - lo.max(-1.0)).max(0.0) * f64::from(frame.size[axis])
    };
    let area =
        |wide: usize| side(0, lo[0][1 - wide], hi[0][wide]) * side(1, lo[1][1 - wide], hi[1][wide]);
    // Sides of nothing but rounding: an ulp of 1.
    let rounding = |area: f64| {
        let sides = frame.size.map(f64::from);
        STEPS * U * (area + sides[0] * sides[1])
    };
    let far = |at: fn(f64, f64) -> f64, ends: [[f64; 2]; 4]| {
        let distances = ends.map(|[a, b]| at(a, b));
        distances.into_iter().fold(0.0, f64::max)
    };
    let ends = [lo[0], lo[1], hi[0], hi[1]];
    // Of an interval, the distance from zero of what is in it.
    let least = far(
        |a, b| {
            if a <= 0.0 && b >= 0.0 {
                0.0
            } else {
                a.abs().min(b.abs())
            }
        },
        ends,
    );
    let most = far(|a, b| a.abs().max(b.abs()), ends);
    [
        Range {
            lo: area(0) - rounding(area(0)),
            hi: area(1) + rounding(area(1)),
        },
        Range {
            lo: least,
            hi: most,
        },
    ]
}

/// What the stage asks of these bounds, with that threshold of adaptive grouping.
pub fn ask(frame: &FrameUniform, bounds: &ObjectBounds, largest_group_px: f32) -> Asked {
    let zero = plane(frame.cells[bounds.cell as usize]).truncate();
    let corner = |corner: [f32; 3]| DVec3::from_array(corner.map(f64::from)) + zero;
    let (lo, hi) = (corner(bounds.min), corner(bounds.max));
    let bare = Rough {
        lo,
        hi,
        error: U * lo.abs().max(hi.abs()).max_element(),
    };
    let padding = [
        frame.padding_everywhere,
        frame.padding_per_reach,
        frame.padding_per_depth,
    ];
    let padded = grown(frame, bare, padding);
    let box_padding = [
        frame.box_padding_everywhere,
        frame.box_padding_per_reach,
        frame.box_padding_per_depth,
    ];
    let outer = grown(frame, padded, box_padding);
    let planes = frame.planes.map(plane);
    let inside = planes
        .iter()
        .map(|plane| distance(*plane, padded, true).at_least(0.0));
    let in_frustum = inside.reduce(and).flatten();
    let bare_in_frustum = planes.iter().all(|plane| {
        let range = distance(*plane, bare, true);
        range.lo + range.hi >= 0.0
    });
    let near = distance(planes[4], outer, false);
    // The shader's comparison is <=; equality is within the error.
    let margin =
        f64::from(frame.padding_everywhere) + f64::from(frame.padding_per_reach) * reach(outer);
    let margin_error = f64::from(frame.padding_per_reach) * 3.0 * outer.error + STEPS * U * margin;
    let clear = and(
        near.at_least(margin - margin_error),
        near.at_least(margin + margin_error),
    );
    let touches_near = not(match near.at_least(margin - margin_error) == clear {
        true => clear,
        false => None,
    });
    let (rasterizable, larger) = if touches_near == Some(true) {
        (Some(false), None)
    } else {
        let [area, farthest] = footprint(frame, outer);
        let too_far = farthest.at_least(f64::from(LARGEST_NDC));
        let larger = area.at_least(f64::from(largest_group_px));
        (and(not(touches_near), not(too_far)), larger)
    };
    Asked {
        in_frustum,
        rasterizable,
        refine: or(not(rasterizable), larger),
        bare_in_frustum,
    }
}
