//! AVX2: 8 lanes.

use std::arch::asm;
use std::arch::x86_64::*;

use super::{Kernel, Rows, Simd};

/// Exists only where the CPU has AVX2.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

impl Avx2 {
    pub(super) fn detect() -> Option<Self> {
        is_x86_feature_detected!("avx2").then_some(Self(()))
    }

    #[inline]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2")]
        fn with_features<K: Kernel>(simd: Avx2, kernel: K) -> K::Output {
            kernel.run(simd)
        }
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { with_features(self, kernel) }
    }
}

impl Simd for Avx2 {
    const LANES: usize = 8;
    type F = __m256;
    type I = __m256i;
    /// All bits or none.
    type M = __m256i;
    type Words = [u32; 8];
    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_set1_ps(value) }
    }
    #[inline(always)]
    fn splat_i(self, value: i32) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_set1_epi32(value) }
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_add_ps(a, b) }
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_mul_ps(a, b) }
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_div_ps(a, b) }
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_min_ps(a, b) }
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_max_ps(a, b) }
    }
    #[inline(always)]
    fn to_int(self, a: Self::F) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_cvttps_epi32(a) }
    }
    #[inline(always)]
    fn to_float(self, a: Self::I) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_cvtepi32_ps(a) }
    }
    #[inline(always)]
    fn bits(self, a: Self::F) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_castps_si256(a) }
    }
    #[inline(always)]
    fn of_bits(self, a: Self::I) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_castsi256_ps(a) }
    }
    #[inline(always)]
    fn add_i(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_add_epi32(a, b) }
    }
    #[inline(always)]
    fn min_i(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_min_epi32(a, b) }
    }
    #[inline(always)]
    fn min_u(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_min_epu32(a, b) }
    }
    #[inline(always)]
    fn sub_saturating(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_subs_epu16(a, b) }
    }
    #[inline(always)]
    fn and(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_and_si256(a, b) }
    }
    #[inline(always)]
    fn or(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_or_si256(a, b) }
    }
    #[inline(always)]
    fn max_i(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_max_epi32(a, b) }
    }
    #[inline(always)]
    fn and_not(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_andnot_si256(b, a) }
    }
    #[inline(always)]
    fn shl(self, a: Self::I, count: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { shift_left(a, count) }
    }
    #[inline(always)]
    fn repeat_four(self, four: &[f32; 4]) -> Self::F {
        // SAFETY: 16 readable bytes, no alignment asked; `self` proves that the CPU has the instructions.
        unsafe { _mm256_broadcast_ps(&_mm_loadu_ps(four.as_ptr())) }
    }
    #[inline(always)]
    fn lane_index(self) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7) }
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), a) }
    }
    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> Self::M {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) }
    }
    #[inline(always)]
    fn not_lt(self, a: Self::F, b: Self::F) -> Self::M {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_castps_si256(_mm256_cmp_ps::<_CMP_NLT_UQ>(a, b)) }
    }
    #[inline(always)]
    fn any(self, a: Self::I) -> bool {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_testz_si256(a, a) == 0 }
    }
    #[inline(always)]
    fn eq_i(self, a: Self::I, b: Self::I) -> Self::M {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_cmpeq_epi32(a, b) }
    }
    #[inline(always)]
    fn gt_i(self, a: Self::I, b: Self::I) -> Self::M {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_cmpgt_epi32(a, b) }
    }
    #[inline(always)]
    fn select(self, mask: Self::M, yes: Self::F, no: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_blendv_ps(no, yes, _mm256_castsi256_ps(mask)) }
    }
    #[inline(always)]
    fn select_i(self, mask: Self::M, yes: Self::I, no: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_blendv_epi8(no, yes, mask) }
    }
    #[inline(always)]
    fn keep(self, mask: Self::M, a: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_and_si256(mask, a) }
    }
    #[inline(always)]
    fn drop(self, mask: Self::M, a: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_andnot_si256(mask, a) }
    }
    #[inline(always)]
    fn fill(self, mask: Self::M, a: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_or_si256(a, mask) }
    }
    #[inline(always)]
    fn both(self, a: Self::M, b: Self::M) -> Self::M {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_and_si256(a, b) }
    }
    #[inline(always)]
    fn either(self, a: Self::M, b: Self::M) -> Self::M {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_or_si256(a, b) }
    }
    #[inline(always)]
    fn but_not(self, a: Self::M, b: Self::M) -> Self::M {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_andnot_si256(b, a) }
    }
    #[inline(always)]
    fn mask_bits(self, a: Self::M) -> u32 {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm256_movemask_ps(_mm256_castsi256_ps(a)) as u32 }
    }

    #[inline(always)]
    fn transpose_bytes(self, a: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe {
            let order = _mm_setr_epi8(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
            _mm256_shuffle_epi8(a, _mm256_broadcastsi128_si256(order))
        }
    }

    #[inline(always)]
    fn load(self, from: &[u32]) -> Self::I {
        let from: &[u32; 8] = from[..8].try_into().expect("8 of them");
        // SAFETY: 32 readable bytes, no alignment asked; `self` proves that the CPU has the instructions.
        unsafe { _mm256_loadu_si256(from.as_ptr().cast()) }
    }

    #[inline(always)]
    fn store(self, a: Self::I, to: &mut [u32]) {
        let to: &mut [u32; 8] = (&mut to[..8]).try_into().expect("8 of them");
        // SAFETY: 32 writable bytes, no alignment asked; `self` proves that the CPU has the instructions.
        unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), a) }
    }

    #[inline(always)]
    fn transpose_rows(self, rows: &impl Rows) -> [Self::F; 4] {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe {
            let (a, b) = (pair(rows, 0), pair(rows, 1));
            let (c, d) = (pair(rows, 2), pair(rows, 3));
            let (ab, cd) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
            let (ab_high, cd_high) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
            [
                _mm256_shuffle_ps::<0b01_00_01_00>(ab, cd),
                _mm256_shuffle_ps::<0b11_10_11_10>(ab, cd),
                _mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
                _mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
            ]
        }
    }
}

/// Rows `i` and `i + 4`.
///
/// # Safety
/// The CPU has AVX2.
#[inline(always)]
unsafe fn pair(rows: &impl Rows, i: usize) -> __m256 {
    // SAFETY: each load reads the 16 bytes of a row, no alignment asked; the caller sees to the rest.
    unsafe {
        let low = _mm256_castps128_ps256(_mm_loadu_ps(rows.row(i).as_ptr()));
        _mm256_insertf128_ps::<1>(low, _mm_loadu_ps(rows.row(i + 4).as_ptr()))
    }
}

/// [`Simd::shl`]. The intrinsic is a shift, a comparison and a selection to the compiler, which finds its way back to
/// the one instruction only from some expressions.
#[inline]
#[target_feature(enable = "avx2")]
fn shift_left(a: __m256i, count: __m256i) -> __m256i {
    let shifted;
    // SAFETY: registers to a register, nothing else; the CPU has the instruction where this function may be called.
    unsafe {
        asm!(
            "vpsllvd {shifted}, {a}, {count}",
            shifted = lateout(ymm_reg) shifted,
            a = in(ymm_reg) a,
            count = in(ymm_reg) count,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    shifted
}
