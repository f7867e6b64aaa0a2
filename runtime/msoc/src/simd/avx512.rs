//! AVX-512: 16 lanes.

use std::arch::asm;
use std::arch::x86_64::*;

use super::{Kernel, Rows, Simd};

/// Exists only where the CPU has AVX-512 F, BW, DQ and VL.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512(());

impl Avx512 {
    pub(super) fn detect() -> Option<Self> {
        (is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl"))
        .then_some(Self(()))
    }

    #[inline]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
        fn with_features<K: Kernel>(simd: Avx512, kernel: K) -> K::Output {
            kernel.run(simd)
        }
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { with_features(self, kernel) }
    }
}

impl Simd for Avx512 {
    const LANES: usize = 16;
    type F = __m512;
    type I = __m512i;
    type M = __mmask16;
    type Words = [u32; 16];
    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_set1_ps(value) }
    }
    #[inline(always)]
    fn splat_i(self, value: i32) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_set1_epi32(value) }
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_add_ps(a, b) }
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_mul_ps(a, b) }
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_div_ps(a, b) }
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_min_ps(a, b) }
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_max_ps(a, b) }
    }
    #[inline(always)]
    fn to_int(self, a: Self::F) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_cvttps_epi32(a) }
    }
    #[inline(always)]
    fn to_float(self, a: Self::I) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_cvtepi32_ps(a) }
    }
    #[inline(always)]
    fn bits(self, a: Self::F) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_castps_si512(a) }
    }
    #[inline(always)]
    fn of_bits(self, a: Self::I) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_castsi512_ps(a) }
    }
    #[inline(always)]
    fn add_i(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_add_epi32(a, b) }
    }
    #[inline(always)]
    fn min_i(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_min_epi32(a, b) }
    }
    #[inline(always)]
    fn min_u(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_min_epu32(a, b) }
    }
    #[inline(always)]
    fn sub_saturating(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_subs_epu16(a, b) }
    }
    #[inline(always)]
    fn and(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_and_si512(a, b) }
    }
    #[inline(always)]
    fn or(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_or_si512(a, b) }
    }
    #[inline(always)]
    fn max_i(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_max_epi32(a, b) }
    }
    #[inline(always)]
    fn and_not(self, a: Self::I, b: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_andnot_si512(b, a) }
    }
    #[inline(always)]
    fn shl(self, a: Self::I, count: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { shift_left(a, count) }
    }
    #[inline(always)]
    fn repeat_four(self, four: &[f32; 4]) -> Self::F {
        // SAFETY: 16 readable bytes, no alignment asked; `self` proves that the CPU has the instructions.
        unsafe { _mm512_broadcast_f32x4(_mm_loadu_ps(four.as_ptr())) }
    }
    #[inline(always)]
    fn lane_index(self) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15) }
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_abs_ps(a) }
    }
    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> Self::M {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b) }
    }
    #[inline(always)]
    fn not_lt(self, a: Self::F, b: Self::F) -> Self::M {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_cmp_ps_mask::<_CMP_NLT_UQ>(a, b) }
    }
    #[inline(always)]
    fn any(self, a: Self::I) -> bool {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_test_epi32_mask(a, a) != 0 }
    }
    #[inline(always)]
    fn eq_i(self, a: Self::I, b: Self::I) -> Self::M {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_cmpeq_epi32_mask(a, b) }
    }
    #[inline(always)]
    fn gt_i(self, a: Self::I, b: Self::I) -> Self::M {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_cmpgt_epi32_mask(a, b) }
    }
    #[inline(always)]
    fn select(self, mask: Self::M, yes: Self::F, no: Self::F) -> Self::F {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_mask_blend_ps(mask, no, yes) }
    }
    #[inline(always)]
    fn select_i(self, mask: Self::M, yes: Self::I, no: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_mask_blend_epi32(mask, no, yes) }
    }

    #[inline(always)]
    fn keep(self, mask: Self::M, a: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_maskz_mov_epi32(mask, a) }
    }
    #[inline(always)]
    fn drop(self, mask: Self::M, a: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_maskz_mov_epi32(!mask, a) }
    }
    #[inline(always)]
    fn fill(self, mask: Self::M, a: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe { _mm512_mask_blend_epi32(mask, a, _mm512_set1_epi32(-1)) }
    }
    #[inline(always)]
    fn both(self, a: Self::M, b: Self::M) -> Self::M {
        a & b
    }

    #[inline(always)]
    fn either(self, a: Self::M, b: Self::M) -> Self::M {
        a | b
    }

    #[inline(always)]
    fn but_not(self, a: Self::M, b: Self::M) -> Self::M {
        a & !b
    }

    #[inline(always)]
    fn mask_bits(self, a: Self::M) -> u32 {
        u32::from(a)
    }

    #[inline(always)]
    fn transpose_bytes(self, a: Self::I) -> Self::I {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe {
            let order = _mm_setr_epi8(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
            _mm512_shuffle_epi8(a, _mm512_broadcast_i32x4(order))
        }
    }

    #[inline(always)]
    fn load(self, from: &[u32]) -> Self::I {
        let from: &[u32; 16] = from[..16].try_into().expect("16 of them");
        // SAFETY: 64 readable bytes, no alignment asked; `self` proves that the CPU has the instructions.
        unsafe { _mm512_loadu_si512(from.as_ptr().cast()) }
    }

    #[inline(always)]
    fn store(self, a: Self::I, to: &mut [u32]) {
        let to: &mut [u32; 16] = (&mut to[..16]).try_into().expect("16 of them");
        // SAFETY: 64 writable bytes, no alignment asked; `self` proves that the CPU has the instructions.
        unsafe { _mm512_storeu_si512(to.as_mut_ptr().cast(), a) }
    }

    #[inline(always)]
    fn transpose_rows(self, rows: &impl Rows) -> [Self::F; 4] {
        // SAFETY: `self` proves that the CPU has the instructions.
        unsafe {
            let (a, b) = (four(rows, 0), four(rows, 1));
            let (c, d) = (four(rows, 2), four(rows, 3));
            let (ab, cd) = (_mm512_unpacklo_ps(a, b), _mm512_unpacklo_ps(c, d));
            let (ab_high, cd_high) = (_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d));
            [
                _mm512_shuffle_ps::<0b01_00_01_00>(ab, cd),
                _mm512_shuffle_ps::<0b11_10_11_10>(ab, cd),
                _mm512_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
                _mm512_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
            ]
        }
    }
}

/// Rows `i`, `i + 4`, `i + 8` and `i + 12`.
///
/// # Safety
/// The CPU has AVX-512 F and DQ.
#[inline(always)]
unsafe fn four(rows: &impl Rows, i: usize) -> __m512 {
    // SAFETY: each load reads the 16 bytes of a row, no alignment asked; the caller sees to the rest.
    unsafe {
        let a = _mm512_castps128_ps512(_mm_loadu_ps(rows.row(i).as_ptr()));
        let a = _mm512_insertf32x4::<1>(a, _mm_loadu_ps(rows.row(i + 4).as_ptr()));
        let a = _mm512_insertf32x4::<2>(a, _mm_loadu_ps(rows.row(i + 8).as_ptr()));
        _mm512_insertf32x4::<3>(a, _mm_loadu_ps(rows.row(i + 12).as_ptr()))
    }
}

/// [`Simd::shl`]. The intrinsic is a shift, a comparison and a selection to the compiler, which finds its way back to
/// the one instruction only from some expressions.
#[inline]
#[target_feature(enable = "avx512f")]
fn shift_left(a: __m512i, count: __m512i) -> __m512i {
    let shifted;
    // SAFETY: registers to a register, nothing else; the CPU has the instruction where this function may be called.
    unsafe {
        asm!(
            "vpsllvd {shifted}, {a}, {count}",
            shifted = lateout(zmm_reg) shifted,
            a = in(zmm_reg) a,
            count = in(zmm_reg) count,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    shifted
}
