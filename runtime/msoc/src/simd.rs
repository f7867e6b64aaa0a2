//! The vector abstraction: what the algorithm asks of a CPU, and the choice of instruction set at run time.
//!
//! There is one algorithm. It is generic over [`Simd`], marked `#[inline(always)]` throughout, and instantiated
//! inside one `#[target_feature]` function per instruction set ([`Isa::run`]). It has no closures where there
//! are vectors: these cannot be marked, and what is not inlined is compiled without the instructions. Equal inputs give bit-equal
//! results on every instruction set: all operations are IEEE single operations in the same order, nothing is
//! fused, and [`Simd::min`] and [`Simd::max`] are defined by a comparison.

use bytemuck::Pod;

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod portable;

#[cfg(target_arch = "x86_64")]
use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
use avx512::Avx512;
pub(crate) use portable::Portable;

/// Vectors of `LANES` lanes of 32 bits. A value of an implementing type is the proof that the CPU has the
/// instructions.
pub(crate) trait Simd: Copy {
    /// Lanes of a vector: rows of a tile, and 8x4-pixel subtiles of a tile.
    const LANES: usize;
    /// f32 lanes.
    type F: Copy;
    /// i32 lanes.
    type I: Copy;
    /// One truth value per lane.
    type M: Copy;
    /// A vector in memory: `[u32; LANES]`.
    type Words: Pod + AsRef<[u32]> + AsMut<[u32]>;

    fn splat(self, value: f32) -> Self::F;
    fn splat_i(self, value: i32) -> Self::I;
    /// Lane `i` is `four[i % 4]`.
    fn repeat_four(self, four: &[f32; 4]) -> Self::F;
    /// 0, 1, 2, ...
    fn lane_index(self) -> Self::I;

    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a < b ? a : b`: the second where either is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a > b ? a : b`: the second where either is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    fn abs(self, a: Self::F) -> Self::F;
    /// False where either is NaN.
    fn lt(self, a: Self::F, b: Self::F) -> Self::M;
    /// True where either is NaN.
    fn not_lt(self, a: Self::F, b: Self::F) -> Self::M;

    /// Rounds toward zero. No lane is NaN or -2^31 or below; what is too large becomes `2^31 - 1` or more as u32.
    fn to_int(self, a: Self::F) -> Self::I;
    fn to_float(self, a: Self::I) -> Self::F;
    /// The same bits.
    fn bits(self, a: Self::F) -> Self::I;
    /// The same bits.
    fn of_bits(self, a: Self::I) -> Self::F;

    fn add_i(self, a: Self::I, b: Self::I) -> Self::I;
    fn min_i(self, a: Self::I, b: Self::I) -> Self::I;
    fn max_i(self, a: Self::I, b: Self::I) -> Self::I;
    /// The least as u32.
    fn min_u(self, a: Self::I, b: Self::I) -> Self::I;
    /// `max(a - b, 0)` as u32, if `b` is within `0..65536`; where `a` is not, anything from 65536.
    fn sub_saturating(self, a: Self::I, b: Self::I) -> Self::I;
    fn and(self, a: Self::I, b: Self::I) -> Self::I;
    fn or(self, a: Self::I, b: Self::I) -> Self::I;
    /// `a & !b`.
    fn and_not(self, a: Self::I, b: Self::I) -> Self::I;
    /// `a << count`, and 0 where `count` is 32 or more as u32.
    fn shl(self, a: Self::I, count: Self::I) -> Self::I;
    /// Whether any bit is 1.
    fn any(self, a: Self::I) -> bool;
    fn eq_i(self, a: Self::I, b: Self::I) -> Self::M;
    fn gt_i(self, a: Self::I, b: Self::I) -> Self::M;
    /// Within each group of four lanes, byte `i` of lane `j` becomes byte `j` of lane `i`.
    fn transpose_bytes(self, a: Self::I) -> Self::I;

    fn select(self, mask: Self::M, yes: Self::F, no: Self::F) -> Self::F;
    fn select_i(self, mask: Self::M, yes: Self::I, no: Self::I) -> Self::I;
    /// `mask ? a : 0`
    fn keep(self, mask: Self::M, a: Self::I) -> Self::I;
    /// `mask ? 0 : a`
    fn drop(self, mask: Self::M, a: Self::I) -> Self::I;
    /// `mask ? !0 : a`
    fn fill(self, mask: Self::M, a: Self::I) -> Self::I;
    fn both(self, a: Self::M, b: Self::M) -> Self::M;
    fn either(self, a: Self::M, b: Self::M) -> Self::M;
    /// `a & !b`.
    fn but_not(self, a: Self::M, b: Self::M) -> Self::M;
    /// Bit `i` is lane `i`.
    fn mask_bits(self, a: Self::M) -> u32;

    /// The first `LANES` of `from`.
    fn load(self, from: &[u32]) -> Self::I;
    /// Into the first `LANES` of `to`.
    fn store(self, a: Self::I, to: &mut [u32]);
    /// Four vectors; lane `i` of vector `k` is `rows.row(i)[k]`.
    fn transpose_rows(self, rows: &impl Rows) -> [Self::F; 4];
}

/// Of any instruction set.
pub(crate) const MOST_LANES: usize = 16;

/// Where the rows of [`Simd::transpose_rows`] come from.
pub(crate) trait Rows {
    fn row(&self, lane: usize) -> &[f32; 4];
}

/// The lanes of which [`Simd::mask_bits`] has a bit, in order.
#[inline(always)]
pub(crate) fn lanes_in(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (bits != 0).then_some(bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        lane
    })
}

/// Work written once, to be instantiated per instruction set. `run` must be `#[inline(always)]`, and so must
/// all that it calls with a [`Simd`].
pub(crate) trait Kernel {
    type Output;
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// An instruction set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum IsaName {
    /// AVX-512 F, BW, DQ and VL: 16 lanes, tiles of 32x16 pixels.
    Avx512,
    /// AVX2: 8 lanes, tiles of 32x8 pixels.
    Avx2,
    /// Plain Rust, for the compiler to vectorize with what the target has (SSE2, NEON): 8 lanes.
    Portable,
}

impl IsaName {
    /// Every one, the widest first.
    pub const ALL: [Self; 3] = [Self::Avx512, Self::Avx2, Self::Portable];

    /// The name on command lines and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Avx512 => "avx512",
            Self::Avx2 => "avx2",
            Self::Portable => "portable",
        }
    }

    /// The one of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|isa| isa.name() == name)
    }
}

/// An instruction set that this CPU has.
#[derive(Clone, Copy, Debug)]
pub struct Isa(Level);

#[derive(Clone, Copy, Debug)]
enum Level {
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    Portable(Portable),
}

impl Isa {
    /// That instruction set, if this CPU has it.
    pub fn new(name: IsaName) -> Option<Self> {
        match name {
            #[cfg(target_arch = "x86_64")]
            IsaName::Avx512 => Avx512::detect().map(|token| Self(Level::Avx512(token))),
            #[cfg(target_arch = "x86_64")]
            IsaName::Avx2 => Avx2::detect().map(|token| Self(Level::Avx2(token))),
            #[cfg(not(target_arch = "x86_64"))]
            IsaName::Avx512 | IsaName::Avx2 => None,
            IsaName::Portable => Some(Self(Level::Portable(Portable))),
        }
    }

    /// The widest that this CPU has.
    pub fn best() -> Self {
        Self::available()[0]
    }

    /// All that this CPU has, the widest first.
    pub fn available() -> Vec<Self> {
        IsaName::ALL.into_iter().filter_map(Self::new).collect()
    }

    /// Its name.
    pub const fn name(self) -> IsaName {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512(_) => IsaName::Avx512,
            #[cfg(target_arch = "x86_64")]
            Level::Avx2(_) => IsaName::Avx2,
            Level::Portable(_) => IsaName::Portable,
        }
    }

    /// Lanes of a vector, which is the height of a tile in pixels.
    pub(crate) const fn lanes(self) -> usize {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512(_) => Avx512::LANES,
            #[cfg(target_arch = "x86_64")]
            Level::Avx2(_) => Avx2::LANES,
            Level::Portable(_) => Portable::LANES,
        }
    }

    /// Runs `kernel` with this instruction set.
    #[inline]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512(token) => token.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2(token) => token.run(kernel),
            Level::Portable(token) => kernel.run(token),
        }
    }
}

#[cfg(test)]
mod tests;
