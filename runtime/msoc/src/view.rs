//! What triangle setup knows of the view, and how far `inner` moves things.

use crate::geometry::{Aabb, ClipError, IDENTITY, Matrix4, clip_error};
use crate::options::{Depth, Mode, Options};
use crate::simd::Simd;

/// Roundoff unit of f32: half a unit in the last place of 1.
pub(crate) const U: f32 = 1.0 / (1 << 24) as f32;
/// Share of a triangle's largest nearness by which a GPU's interpolation may err.
pub(crate) const INTERPOLATION: f32 = 4.0 * U;
/// Vertices farther from the centre than this many half images are clipped to it, so that pixel coordinates
/// stay within 4 images and f32 resolves them finely.
pub(crate) const GUARD: f32 = 7.0;
/// Edges whose height is below this many pixels are horizontal: they bound no row.
pub(crate) const HORIZONTAL_PX: f32 = 1.0 / 4096.0;
/// Least w of a vertex in front of the eye.
pub(crate) const LEAST_W: f32 = 1e-30;

/// The image, and how clip space gets there. Pixel coordinates are shifted so that the centre of pixel
/// (i, j) has x = i + 1 and y = j: rounding down the place where an edge meets a row gives the first pixel
/// right of it, and rounding down a y the last row above it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    pub size: [u32; 2],
    pub size_px: [f32; 2],
    /// The greatest coordinates that are less than the size.
    pub within_px: [f32; 2],
    /// Coordinates of the last column and row.
    pub last_px: [f32; 2],
    pub half: [f32; 2],
    pub centre: [f32; 2],
    pub depth: Depth,
    /// Greatest nearness: what is nearer is clipped.
    pub near: f32,
    pub cull_back_faces: bool,
    pub inner: Option<Inner>,
}

/// The margins of [`Mode::Inner`]; see there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inner {
    pub step_px: f32,
    pub depth_tolerance: f32,
    /// Bound of the error of each clip-space component, ours and the GPU's together.
    pub clip_error: f32,
    /// The same of z and w alone.
    pub depth_error: f32,
}

impl View {
    pub fn new(size: [u32; 2], options: &Options) -> Self {
        let size_px = size.map(|size| size as f32);
        let half = size_px.map(|size| 0.5 * size);
        Self {
            size,
            size_px,
            within_px: size_px.map(f32::next_down),
            last_px: size_px.map(|size| size - 1.0),
            half,
            centre: [half[0] + 0.5, half[1] - 0.5],
            depth: options.depth,
            near: match options.depth {
                Depth::InverseW => options.near,
                Depth::Reversed | Depth::Standard => 1.0,
            },
            cull_back_faces: options.cull_back_faces,
            inner: match options.mode {
                Mode::Paper => None,
                Mode::Inner {
                    subpixel_bits,
                    depth_tolerance,
                } => Some(Inner {
                    step_px: 0.5_f32.powi(i32::from(subpixel_bits)),
                    depth_tolerance,
                    clip_error: 0.0,
                    depth_error: 0.0,
                }),
            },
        }
    }

    /// The same view for geometry whose clip-space components may err by that much.
    pub fn with_clip_error(mut self, error: ClipError) -> Self {
        if let Some(inner) = &mut self.inner {
            inner.clip_error = error.any;
            inner.depth_error = error.depth;
        }
        self
    }

    /// The same view for bounds in world space.
    pub fn of_bounds(&self, clip_from_world: &Matrix4, bounds: &Aabb) -> Self {
        match self.inner {
            None => *self,
            Some(_) => self.with_clip_error(clip_error(clip_from_world, &IDENTITY, bounds.reach())),
        }
    }

    /// What is divided by w to give nearness.
    #[inline(always)]
    pub fn numerator(&self, [_, _, z, w]: [f32; 4]) -> f32 {
        match self.depth {
            Depth::InverseW => 1.0,
            Depth::Reversed => z,
            Depth::Standard => w - z,
        }
    }

    /// Longer side of the image, pixels.
    #[inline(always)]
    pub fn longer_px(&self) -> f32 {
        self.size_px[0].max(self.size_px[1])
    }
}

impl Inner {
    /// How far, in pixels along each axis, a GPU's vertex may be from ours: the step; what projection and
    /// viewport transform round, theirs and ours, at coordinates up to `extent_px`; and the error of clip
    /// space over the least w.
    #[inline(always)]
    pub fn displacement_px(&self, extent_px: f32, inverse_w: f32) -> f32 {
        self.step_px + extent_px * (8.0 * U + 2.0 * self.clip_error * inverse_w)
    }

    /// The factor and the subtrahend that take a nearness to the least that GPU arithmetic may find.
    #[inline(always)]
    pub fn depth_margin(&self, depth: Depth, inverse_w: f32) -> [f32; 2] {
        let transform = 2.0 * self.clip_error * inverse_w;
        let absolute = match depth {
            Depth::InverseW => self.depth_tolerance * (16.0 + self.depth_error / U * inverse_w),
            Depth::Reversed | Depth::Standard => self.depth_tolerance + 8.0 * U + transform,
        };
        [1.0 - (24.0 * U + transform), absolute]
    }

    /// [`Self::displacement_px`] of each lane.
    #[inline(always)]
    pub fn displacements_px<S: Simd>(&self, s: S, extent_px: S::F, inverse_w: S::F) -> S::F {
        let transform = s.mul(s.splat(2.0 * self.clip_error), inverse_w);
        let relative = s.add(s.splat(8.0 * U), transform);
        s.add(s.splat(self.step_px), s.mul(extent_px, relative))
    }

    /// [`Self::depth_margin`] of each lane.
    #[inline(always)]
    pub fn depth_margins<S: Simd>(&self, s: S, depth: Depth, inverse_w: S::F) -> [S::F; 2] {
        let transform = s.mul(s.splat(2.0 * self.clip_error), inverse_w);
        let absolute = match depth {
            Depth::InverseW => {
                let transform = s.mul(s.splat(self.depth_error / U), inverse_w);
                let roundings = s.add(s.splat(16.0), transform);
                s.mul(s.splat(self.depth_tolerance), roundings)
            }
            Depth::Reversed | Depth::Standard => {
                s.add(s.splat(self.depth_tolerance + 8.0 * U), transform)
            }
        };
        let factor = s.sub(s.splat(1.0), s.add(s.splat(24.0 * U), transform));
        [factor, absolute]
    }
}
