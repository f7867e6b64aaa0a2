//! Plain Rust over arrays, for any CPU.

use std::array::from_fn;

use super::{Rows, Simd};

const N: usize = 8;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

#[inline(always)]
fn zip<A: Copy, B: Copy, C>(a: [A; N], b: [B; N], f: impl Fn(A, B) -> C) -> [C; N] {
    from_fn(|i| f(a[i], b[i]))
}

impl Simd for Portable {
    const LANES: usize = N;
    type F = [f32; N];
    type I = [i32; N];
    /// All bits or none.
    type M = [i32; N];
    type Words = [u32; N];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        [value; N]
    }
    #[inline(always)]
    fn splat_i(self, value: i32) -> Self::I {
        [value; N]
    }
    #[inline(always)]
    fn repeat_four(self, four: &[f32; 4]) -> Self::F {
        from_fn(|i| four[i % 4])
    }
    #[inline(always)]
    fn lane_index(self) -> Self::I {
        from_fn(|i| i as i32)
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        a.map(f32::abs)
    }
    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> Self::M {
        zip(a, b, |a, b| -i32::from(a < b))
    }
    #[inline(always)]
    fn not_lt(self, a: Self::F, b: Self::F) -> Self::M {
        zip(a, b, |a, b| i32::from(a < b) - 1)
    }
    #[inline(always)]
    fn to_int(self, a: Self::F) -> Self::I {
        a.map(|a| a as i32)
    }
    #[inline(always)]
    fn to_float(self, a: Self::I) -> Self::F {
        a.map(|a| a as f32)
    }
    #[inline(always)]
    fn bits(self, a: Self::F) -> Self::I {
        a.map(|a| a.to_bits() as i32)
    }
    #[inline(always)]
    fn of_bits(self, a: Self::I) -> Self::F {
        a.map(|a| f32::from_bits(a as u32))
    }
    #[inline(always)]
    fn add_i(self, a: Self::I, b: Self::I) -> Self::I {
        zip(a, b, i32::wrapping_add)
    }
    #[inline(always)]
    fn min_i(self, a: Self::I, b: Self::I) -> Self::I {
        zip(a, b, i32::min)
    }
    #[inline(always)]
    fn max_i(self, a: Self::I, b: Self::I) -> Self::I {
        zip(a, b, i32::max)
    }
    #[inline(always)]
    fn min_u(self, a: Self::I, b: Self::I) -> Self::I {
        zip(a, b, |a, b| (a as u32).min(b as u32) as i32)
    }
    #[inline(always)]
    fn sub_saturating(self, a: Self::I, b: Self::I) -> Self::I {
        zip(a, b, |a, b| (a - b).max(0))
    }
    #[inline(always)]
    fn and(self, a: Self::I, b: Self::I) -> Self::I {
        zip(a, b, |a, b| a & b)
    }
    #[inline(always)]
    fn or(self, a: Self::I, b: Self::I) -> Self::I {
        zip(a, b, |a, b| a | b)
    }
    #[inline(always)]
    fn and_not(self, a: Self::I, b: Self::I) -> Self::I {
        zip(a, b, |a, b| a & !b)
    }
    #[inline(always)]
    fn shl(self, a: Self::I, count: Self::I) -> Self::I {
        // In two steps of at most 16: vector shifts by more than the width of a lane are undefined.
        zip(a, count, |a, count| {
            let first = count.min(16);
            a << first << (count - first).min(16)
        })
    }
    #[inline(always)]
    fn any(self, a: Self::I) -> bool {
        a.into_iter().fold(0, |bits, lane| bits | lane) != 0
    }
    #[inline(always)]
    fn eq_i(self, a: Self::I, b: Self::I) -> Self::M {
        zip(a, b, |a, b| -i32::from(a == b))
    }
    #[inline(always)]
    fn gt_i(self, a: Self::I, b: Self::I) -> Self::M {
        zip(a, b, |a, b| -i32::from(a > b))
    }
    #[inline(always)]
    fn transpose_bytes(self, a: Self::I) -> Self::I {
        from_fn(|i| {
            let (group, byte) = (i & !3, 8 * (i & 3));
            let pick = |j: usize| (a[group + j] >> byte & 0xFF) << (8 * j);
            pick(0) | pick(1) | pick(2) | pick(3)
        })
    }
    #[inline(always)]
    fn select(self, mask: Self::M, yes: Self::F, no: Self::F) -> Self::F {
        self.of_bits(self.select_i(mask, self.bits(yes), self.bits(no)))
    }
    #[inline(always)]
    fn select_i(self, mask: Self::M, yes: Self::I, no: Self::I) -> Self::I {
        from_fn(|i| yes[i] & mask[i] | no[i] & !mask[i])
    }
    #[inline(always)]
    fn keep(self, mask: Self::M, a: Self::I) -> Self::I {
        self.and(a, mask)
    }
    #[inline(always)]
    fn drop(self, mask: Self::M, a: Self::I) -> Self::I {
        self.and_not(a, mask)
    }
    #[inline(always)]
    fn fill(self, mask: Self::M, a: Self::I) -> Self::I {
        self.or(a, mask)
    }
    #[inline(always)]
    fn both(self, a: Self::M, b: Self::M) -> Self::M {
        self.and(a, b)
    }
    #[inline(always)]
    fn either(self, a: Self::M, b: Self::M) -> Self::M {
        self.or(a, b)
    }
    #[inline(always)]
    fn but_not(self, a: Self::M, b: Self::M) -> Self::M {
        self.and_not(a, b)
    }
    #[inline(always)]
    fn mask_bits(self, a: Self::M) -> u32 {
        (0..N).fold(0, |bits, i| bits | (a[i] as u32 & 1) << i)
    }
    #[inline(always)]
    fn load(self, from: &[u32]) -> Self::I {
        let from: &[u32; N] = from[..N].try_into().expect("N of them");
        from.map(|bits| bits as i32)
    }
    #[inline(always)]
    fn store(self, a: Self::I, to: &mut [u32]) {
        to[..N].copy_from_slice(&a.map(|bits| bits as u32));
    }
    #[inline(always)]
    fn transpose_rows(self, rows: &impl Rows) -> [Self::F; 4] {
        let rows: [_; N] = from_fn(|i| rows.row(i));
        from_fn(|k| from_fn(|i| rows[i][k]))
    }
}
