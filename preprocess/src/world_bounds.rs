//! Bounds in cell space that contain every vertex *as the GPU computes it*, not as exact arithmetic does.
//!
//! A vertex shader evaluates, per row `m` of the object's f32 matrix, vertex `p` and offset `o` from the eye to
//! the cell's zero, `m.x*p.x + m.y*p.y + m.z*p.z + (m.w + o)`: three products and four sums, in any order, fused or
//! not. Vulkan lets each operation return either neighbour of the exact result, so each is off by a factor
//! `1 + d` with `|d| <= u = 2^-23`. By the standard argument (Higham, *Accuracy and Stability of Numerical
//! Algorithms*, 2nd ed., lemma 3.1 and 3.3), with `L = sum |m_i||p_i|`, the place `q = m.w + o` is off by `u |q|`, and
//!
//! `|computed - exact| <= gamma * (L + |q|)`, `gamma = 5u / (1 - 5u)`.
//!
//! What is computed lies near the point `x` that is meant, in coordinates about the eye: `|q| <= |x| + L`. So the
//! error is at most `gamma * 2L`, which depends on the object alone and is in the bounds, and `gamma * |x|`, which
//! depends on the eye and is in the padding that the runtime adds (`frame_uniform.rs`, "Clip transform").
//!
//! Where the GPU decodes `p` itself, from normalized 16-bit numbers, each coordinate is off by up to two more
//! roundings (one of the division, one of a reciprocal in its place): `2u` more of `L`.
//!
//! `L` is taken at the largest `|p_i|` of the mesh on each axis, so that it costs nothing per vertex.
//! Denormals may be flushed to zero. None reaches the shader ([`round_to_f32`] and
//! [`flush_denormals`] see to that), and each of the 8 operations then adds at most `2^-126`; 16 of
//! them are allowed. The exact value is evaluated in f64 with at most 7 roundings of `2^-53`, which
//! the term `2^-48` of their size covers together with those of this formula itself. The sum is rounded outward.

use glam::DAffine3;
use hroc_format::{Bounds, dequantize};

/// Operations are correct to either neighbour: one unit in the last place of f32.
const UNIT: f64 = 1.0 / (1u64 << 23) as f64;
/// The largest relative error of a product that passes this many operations.
const fn gamma(operations: u32) -> f64 {
    operations as f64 * UNIT / (1.0 - operations as f64 * UNIT)
}
/// Rounding of the f64 evaluation and of the bound.
const F64_SLACK: f64 = 1.0 / (1u64 << 48) as f64;
const FLUSHED: f64 = 16.0 * f32::MIN_POSITIVE as f64;
/// Above this a sum of coordinates could overflow on its way although its result would not.
pub const LARGEST: f64 = f32::MAX as f64 / 16.0;

/// Vertices handled at once; the loops over them become vector instructions.
const LANES: usize = 8;

/// Rows of the 3x4 matrix in f32, as the object stores it.
pub type Rows = [[f32; 4]; 3];

/// Zero for a denormal number, which a GPU may flush anyway.
pub fn flush_denormals(number: f32) -> f32 {
    if number.is_subnormal() { 0.0 } else { number }
}

/// The matrix as the GPU gets it; translations relative to `origin`, subtracted in f64.
pub fn round_to_f32(world_from_object: &DAffine3, origin: glam::DVec3) -> Rows {
    let matrix = world_from_object.matrix3.transpose();
    let translation = world_from_object.translation - origin;
    std::array::from_fn(|row| {
        let axes = matrix.col(row);
        [axes.x, axes.y, axes.z, translation[row]].map(|number| flush_denormals(number as f32))
    })
}

/// The vertices of a mesh, laid out for [`Points::world_bounds`].
pub struct Points {
    /// Per block of vertices: x of all, y of all, z of all. The last block repeats a vertex.
    blocks: Vec<[[f64; LANES]; 3]>,
    /// Largest magnitude on each axis.
    max_abs: [f64; 3],
    gamma: f64,
}

impl Points {
    /// Takes finite vertices without denormals.
    pub fn new(positions: &[[f32; 3]]) -> Self {
        Self::passing(10, positions.len(), |vertex| positions[vertex])
    }

    /// Takes vertices that the GPU decodes itself.
    pub fn quantized(positions: &[[u16; 4]]) -> Self {
        Self::passing(12, positions.len(), |vertex| dequantize(positions[vertex]))
    }

    /// Takes vertices whose products may err by so many units in the last place.
    fn passing(operations: u32, count: usize, position: impl Fn(usize) -> [f32; 3]) -> Self {
        let mut max_abs = [0.0; 3];
        let mut blocks = vec![[[0.0; LANES]; 3]; count.div_ceil(LANES)];
        for (number, [xs, ys, zs]) in blocks.iter_mut().enumerate() {
            for (lane, ((x, y), z)) in xs.iter_mut().zip(ys).zip(zs).enumerate() {
                let position = position((number * LANES + lane).min(count - 1)).map(f64::from);
                [*x, *y, *z] = position;
                max_abs = std::array::from_fn(|axis| f64::max(max_abs[axis], position[axis].abs()));
            }
        }
        Self {
            blocks,
            max_abs,
            gamma: gamma(operations),
        }
    }

    /// The bounds of the vertices under `rows`, in cell space; `None` if they are too large for f32, or there are no
    /// vertices.
    pub fn world_bounds(&self, rows: &Rows) -> Option<Bounds> {
        let rows = rows.map(|row| row.map(f64::from));
        let mut min = [[f64::INFINITY; LANES]; 3];
        let mut max = [[f64::NEG_INFINITY; LANES]; 3];
        for [x, y, z] in &self.blocks {
            for (axis, row) in rows.iter().enumerate() {
                let (min, max) = (&mut min[axis], &mut max[axis]);
                for lane in 0..LANES {
                    let value = row[0] * x[lane] + row[1] * y[lane] + row[2] * z[lane];
                    // Not f64::min: its rules for NaN keep this from becoming one instruction.
                    min[lane] = if value < min[lane] { value } else { min[lane] };
                    max[lane] = if value > max[lane] { value } else { max[lane] };
                }
            }
        }
        let mut bounds = Bounds {
            min: [0.0; 3],
            max: [0.0; 3],
        };
        for (axis, row) in rows.iter().enumerate() {
            let local = (0..3).map(|i| row[i].abs() * self.max_abs[i]).sum::<f64>();
            let size = local + row[3].abs();
            if self.blocks.is_empty() || size.is_nan() || size > LARGEST {
                return None;
            }
            let error = self.gamma * local + F64_SLACK * size + FLUSHED;
            let least = min[axis].iter().copied().fold(f64::INFINITY, f64::min);
            let most = max[axis].iter().copied().fold(f64::NEG_INFINITY, f64::max);
            bounds.min[axis] = round_down(least + row[3] - error);
            bounds.max[axis] = round_up(most + row[3] + error);
        }
        Some(bounds)
    }
}

/// The largest f32 that is not above `number`.
pub fn round_down(number: f64) -> f32 {
    let nearest = number as f32;
    if f64::from(nearest) > number {
        nearest.next_down()
    } else {
        nearest
    }
}

/// The smallest f32 that is not below `number`.
pub fn round_up(number: f64) -> f32 {
    -round_down(-number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// An f32 operation that may return either neighbour of the exact result and may flush denormals.
    /// `choice` decides: a bit for the direction, a bit for the flush.
    fn rounded(exact: f64, choice: &mut u32) -> f32 {
        let (up, flush) = (*choice & 1 == 1, *choice & 2 == 2);
        *choice = choice.rotate_right(2);
        let result = if up {
            round_up(exact)
        } else {
            round_down(exact)
        };
        if flush {
            flush_denormals(result)
        } else {
            result
        }
    }

    /// A row on a vertex and the offset of its cell, with the terms in the order of `order`, fused or not. Products of
    /// two f32 are exact in f64; sums of f64 are off by far less than an f32 unit.
    fn on_gpu(
        row: [f32; 4],
        p: [f32; 3],
        offset: f32,
        order: [usize; 4],
        balanced: bool,
        fused: bool,
        mut choice: u32,
    ) -> f32 {
        let place = rounded(f64::from(row[3]) + f64::from(offset), &mut choice);
        let factors: [(f32, f32); 4] =
            std::array::from_fn(|i| if i < 3 { (row[i], p[i]) } else { (place, 1.0) });
        let product = |i: usize| f64::from(factors[order[i]].0) * f64::from(factors[order[i]].1);
        let term = |i: usize, choice: &mut u32| rounded(product(i), choice);
        if balanced {
            let left = f64::from(term(0, &mut choice)) + f64::from(term(1, &mut choice));
            let right = f64::from(term(2, &mut choice)) + f64::from(term(3, &mut choice));
            let (left, right) = (rounded(left, &mut choice), rounded(right, &mut choice));
            return rounded(f64::from(left) + f64::from(right), &mut choice);
        }
        let mut sum = term(0, &mut choice);
        for i in 1..4 {
            let next = if fused {
                product(i)
            } else {
                f64::from(term(i, &mut choice))
            };
            sum = rounded(f64::from(sum) + next, &mut choice);
        }
        sum
    }

    fn number() -> impl Strategy<Value = f32> {
        // Any sign and mantissa, exponents that keep three products and a sum finite; some zeros.
        let spread =
            (any::<bool>(), 0u32..1 << 23, 70u32..180).prop_map(|(sign, mantissa, exponent)| {
                f32::from_bits(u32::from(sign) << 31 | exponent << 23 | mantissa)
            });
        prop_oneof![1 => Just(0.0f32), 4 => -2.0f32..2.0, 4 => spread]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn every_evaluation_lies_inside(
            row in proptest::array::uniform4(number()),
            points in proptest::collection::vec(proptest::array::uniform3(number()), 1..20),
            order in Just([0usize, 1, 2, 3]).prop_shuffle(),
            (balanced, fused, choice) in (any::<bool>(), any::<bool>(), any::<u32>()),
            offset in number(),
        ) {
            let bounds = Points::new(&points).world_bounds(&[row; 3]).unwrap();
            for p in points {
                let value = f64::from(on_gpu(row, p, offset, order, balanced, fused, choice));
                let [min, max] = [bounds.min[0], bounds.max[0]].map(|x| f64::from(x) + f64::from(offset));
                // What the runtime's padding allows: 6 units in the last place of what is farther from the eye.
                let padding = 6.0 * UNIT * min.abs().max(max.abs());
                prop_assert!(min - padding <= value && value <= max + padding, "{value} outside {bounds:?}");
            }
        }
    }

    #[test]
    fn bounds_are_tight() {
        let points: Vec<[f32; 3]> = (0..1000).map(|i| [i as f32, -2.0, 0.5]).collect();
        let rows = [
            [1.0, 0.0, 0.0, 100.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 4.0, -2.0],
        ];
        let bounds = Points::new(&points).world_bounds(&rows).unwrap();
        let expected = [(100.0, 1099.0), (-2.0, -2.0), (0.0, 0.0)];
        for (axis, (least, most)) in expected.into_iter().enumerate() {
            let slack = 1.3e-6 * 1100.0;
            assert!(
                bounds.min[axis] < least && bounds.min[axis] > least - slack,
                "{bounds:?}"
            );
            assert!(
                bounds.max[axis] > most && bounds.max[axis] < most + slack,
                "{bounds:?}"
            );
        }
    }

    #[test]
    fn what_overflows_has_no_bounds() {
        let points = Points::new(&[[1e30, 0.0, 0.0]]);
        assert_eq!(points.world_bounds(&[[1e10, 0.0, 0.0, 0.0]; 3]), None);
        assert_eq!(
            points.world_bounds(&[[f32::INFINITY, 0.0, 0.0, 0.0]; 3]),
            None
        );
        assert_eq!(points.world_bounds(&[[f32::NAN, 0.0, 0.0, 0.0]; 3]), None);
        assert_eq!(Points::new(&[]).world_bounds(&[[0.0; 4]; 3]), None);
    }

    #[test]
    fn matrices_are_relative_to_the_origin_and_hold_no_denormals() {
        let far = DAffine3::from_translation(glam::DVec3::new(1e9 + 0.25, 1e-40, -3.0));
        let rows = round_to_f32(&far, glam::DVec3::new(1e9, 0.0, 0.0));
        assert_eq!(
            rows,
            [
                [1.0, 0.0, 0.0, 0.25],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, -3.0]
            ]
        );
    }
}
