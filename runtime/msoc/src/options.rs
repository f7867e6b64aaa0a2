//! What a caller may choose.

use crate::simd::Isa;

/// How occluders are rasterized.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// As published: a pixel is covered if its centre is, up to the rounding of f32 edges. Approximate.
    Paper,
    /// Never hides what a GPU would show: see [`crate::inner`].
    Inner {
        /// The rasterizer snaps vertices to a grid of `2^-subpixel_bits` pixels. 8 in Direct3D, Metal and
        /// desktop Vulkan; Vulkan promises no more than 4.
        subpixel_bits: u8,
        /// Half the spacing of f32 depths just below 1, as nearness ([`Depth`]). 0 for reversed depth in perspective, which
        /// is as precise as 1/w; for standard depth `a + b / w`, `2^-24 / |b|`; for orthographic cameras
        /// `4 * 2^-24`.
        depth_tolerance: f32,
    },
}

impl Mode {
    /// [`Mode::Inner`] for 8 subpixel bits and a reversed infinite projection.
    pub const INNER: Self = Self::Inner {
        subpixel_bits: 8,
        depth_tolerance: 0.0,
    };
}

/// What is compared: a *nearness*, larger is nearer, 0 is as far as can be, affine in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// 1/w. For every perspective projection; z of clip space is not read.
    InverseW,
    /// z/w of a reversed projection (near is 1). For orthographic cameras, whose w is constant.
    Reversed,
    /// 1 - z/w of a standard projection (near is 0). For orthographic cameras.
    Standard,
}

/// Options of a [`crate::Msoc`].
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Default: [`Mode::Paper`].
    pub mode: Mode,
    /// Default: [`Depth::InverseW`].
    pub depth: Depth,
    /// View depth (w) of the near plane, above 0; no smaller than the GPU's. Not read where `depth` is not
    /// [`Depth::InverseW`]: there the near plane is that of clip space. Default: 0.1.
    pub near: f32,
    /// Leave out triangles that are clockwise in y-up NDC. Default: no.
    pub cull_back_faces: bool,
    /// Rasterize large batches on the threads of the current rayon pool; the result is the same. Default: no.
    pub parallel: bool,
    /// Default: the widest that this CPU has.
    pub isa: Option<Isa>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            mode: Mode::Paper,
            depth: Depth::InverseW,
            near: 0.1,
            cull_back_faces: false,
            parallel: false,
            isa: None,
        }
    }
}

/// Options that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OptionsError {
    /// Too small or too large.
    #[error("a depth buffer of {}x{} pixels; each side must be 1 to {MAX_SIDE}", .0[0], .0[1])]
    Size([u32; 2]),
    /// Not a distance.
    #[error("near plane at {0}; it must be at least 1e-30 and finite")]
    Near(f32),
    /// No such grid.
    #[error("{0} subpixel bits; 0 to 16 are possible")]
    SubpixelBits(u8),
    /// Not a tolerance.
    #[error("depth tolerance {0}; it must be finite and not negative")]
    DepthTolerance(f32),
}

/// Greatest width and height, pixels.
pub const MAX_SIDE: u32 = 16384;

impl Options {
    pub(crate) fn check(&self, size: [u32; 2]) -> Result<(), OptionsError> {
        if size.iter().any(|side| !(1..=MAX_SIDE).contains(side)) {
            return Err(OptionsError::Size(size));
        }
        if !(self.near.is_finite() && self.near >= crate::view::LEAST_W) {
            return Err(OptionsError::Near(self.near));
        }
        if let Mode::Inner {
            subpixel_bits,
            depth_tolerance,
        } = self.mode
        {
            if subpixel_bits > 16 {
                return Err(OptionsError::SubpixelBits(subpixel_bits));
            }
            if !(depth_tolerance.is_finite() && depth_tolerance >= 0.0) {
                return Err(OptionsError::DepthTolerance(depth_tolerance));
            }
        }
        Ok(())
    }
}
