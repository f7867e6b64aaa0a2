//! From objects to clip space.

use crate::simd::{Kernel, Simd};
use crate::view::U;

/// Columns: `clip = m[0] x + m[1] y + m[2] z + m[3]`.
pub type Matrix4 = [[f32; 4]; 4];
/// Rows: `world[i] = m[i][0] x + m[i][1] y + m[i][2] z + m[i][3]`.
pub type Affine3 = [[f32; 4]; 3];

/// No transform.
pub const IDENTITY: Affine3 = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
];

/// Triangles of an occluder. Indices outside `positions` are refused when it is rasterized.
#[derive(Clone, Copy, Debug)]
pub struct OccluderMesh<'a> {
    /// In object space.
    pub positions: &'a [[f32; 3]],
    /// Three per triangle; counter-clockwise is the front.
    pub indices: &'a [[u32; 3]],
}

/// An occluder in its place.
#[derive(Clone, Copy, Debug)]
pub struct Occluder<'a> {
    /// Its triangles.
    pub mesh: OccluderMesh<'a>,
    /// Where it is.
    pub world_from_object: Affine3,
}

/// An axis-aligned box in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Least coordinates.
    pub min: [f32; 3],
    /// Greatest coordinates.
    pub max: [f32; 3],
}

impl Aabb {
    pub(crate) fn corners(&self) -> [[f32; 3]; 8] {
        std::array::from_fn(|i| {
            std::array::from_fn(|axis| {
                if i >> axis & 1 == 0 {
                    self.min[axis]
                } else {
                    self.max[axis]
                }
            })
        })
    }

    /// Greatest distance of a coordinate from 0, per axis.
    pub(crate) fn reach(&self) -> [f32; 3] {
        std::array::from_fn(|axis| self.min[axis].abs().max(self.max[axis].abs()))
    }
}

/// The product, rounded once.
pub(crate) fn compose(clip_from_world: &Matrix4, world_from_object: &Affine3) -> Matrix4 {
    std::array::from_fn(|column| {
        std::array::from_fn(|row| {
            let term = |k: usize| {
                f64::from(clip_from_world[k][row]) * f64::from(world_from_object[k][column])
            };
            let moved = if column == 3 {
                f64::from(clip_from_world[3][row])
            } else {
                0.0
            };
            (term(0) + term(1) + term(2) + moved) as f32
        })
    })
}

#[inline(always)]
pub(crate) fn transform(m: &Matrix4, [x, y, z]: [f32; 3]) -> [f32; 4] {
    std::array::from_fn(|row| (m[0][row] * x + m[1][row] * y) + (m[2][row] * z + m[3][row]))
}

/// Bounds of the errors of clip-space components, see [`clip_error`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ClipError {
    /// Of each component.
    pub any: f32,
    /// Of z and w.
    pub depth: f32,
}

/// Bound of the difference between a clip-space component computed here and by a GPU that transforms to
/// world first, for points with coordinates up to `reach`. With `S` the sum of absolute products in a
/// component, each of the GPU's two steps errs by `4.5 * 2 U S` (four products, three sums, the entries; a
/// GPU may return either neighbour) and ours by `4.5 * 2 U S` at most: `27 U S`. A translation that is itself a sum,
/// rounded by the GPU and by the caller, adds `3 U S`. For bounds, whose corners are such sums, one step of the GPU
/// remains; that a vertex may lie beyond them by five of its roundings (`10 U S`) takes the place of the other. Twice the
/// bound must also hold the GPU's own errors of z and w (`18 U S` each) where both go into its depth: `66 U S`.
pub(crate) fn clip_error(
    clip_from_world: &Matrix4,
    world_from_object: &Affine3,
    reach: [f32; 3],
) -> ClipError {
    let world = world_from_object.map(|row| {
        let terms = (0..3).map(|k| (row[k] * reach[k]).abs());
        terms.sum::<f32>() + row[3].abs()
    });
    let component = |row: usize| {
        let terms = (0..3).map(|k| (clip_from_world[k][row] * world[k]).abs());
        terms.sum::<f32>() + clip_from_world[3][row].abs()
    };
    let largest = |rows: std::ops::Range<usize>| 36.0 * U * rows.map(component).fold(0.0, f32::max);
    ClipError {
        any: largest(0..4),
        depth: largest(2..4),
    }
}

/// Clip-space positions of a mesh.
pub(crate) struct Transform<'a> {
    pub clip_from_object: Matrix4,
    pub positions: &'a [[f32; 3]],
    pub out: &'a mut Vec<[f32; 4]>,
}

impl Kernel for Transform<'_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        self.out.clear();
        let m = self.clip_from_object;
        self.out.extend(
            self.positions
                .iter()
                .map(|&position| transform(&m, position)),
        );
    }
}

/// The exact bounds of a sphere: NDC, nearness and 1/w. `None` if it touches or crosses the near plane.
///
/// A plane `X - k W = 0` through the eye touches the sphere where its distance to the centre is the radius,
/// `(X - k W)^2 = r^2 |x - k w|^2` with X and W the rows of the matrix at the centre and x and w their normal
/// parts: a quadratic in k, whose roots bound X/W over the sphere.
pub(crate) fn sphere_bounds(
    clip_from_world: &Matrix4,
    numerator: [f64; 4],
    near: f64,
    centre: [f32; 3],
    radius: f32,
) -> Option<([[f64; 2]; 3], f64)> {
    let row = |i: usize| -> [f64; 4] { std::array::from_fn(|k| f64::from(clip_from_world[k][i])) };
    let rows = [row(0), row(1), row(2), row(3)];
    let n: [f64; 4] = std::array::from_fn(|k| {
        let constant = if k == 3 { numerator[3] } else { 0.0 };
        numerator[0] * rows[2][k] + numerator[1] * rows[3][k] + constant
    });
    let centre = centre.map(f64::from);
    let at = |row: &[f64; 4]| row[0] * centre[0] + row[1] * centre[1] + row[2] * centre[2] + row[3];
    let dot = |a: &[f64; 4], b: &[f64; 4]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let r2 = f64::from(radius) * f64::from(radius);
    let w = &rows[3];
    let least_w = at(w) - f64::from(radius) * dot(w, w).sqrt();
    let in_front = least_w > 1e-30;
    if !in_front {
        return None;
    }
    let range = |x: &[f64; 4]| {
        let a = at(w) * at(w) - r2 * dot(w, w);
        let b = at(x) * at(w) - r2 * dot(x, w);
        let c = at(x) * at(x) - r2 * dot(x, x);
        let root = (b * b - a * c).max(0.0).sqrt();
        // f64 rounding, far below what f32 will do to it.
        let slack = 1e-12 * (b.abs() + root) / a;
        [(b - root) / a - slack, (b + root) / a + slack]
    };
    let bounds = [range(&rows[0]), range(&rows[1]), range(&n)];
    (bounds[2][1] * near < 1.0).then_some((bounds, 1.0 / least_w))
}
