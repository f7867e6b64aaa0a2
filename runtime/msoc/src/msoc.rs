//! The culler: what the crate is used through.

use crate::buffer::MaskedDepth;
use crate::footprint::{Bounds, FindsBounds, FindsHull, Footprint, Rect, Visibility};
use crate::geometry::{
    Aabb, ClipError, Matrix4, Occluder, OccluderMesh, Transform, clip_error, compose,
    sphere_bounds, transform,
};
use crate::options::{Depth, Mode, Options, OptionsError};
use crate::query::{AsksPixels, AsksRect, AsksRects};
use crate::rasterize::{Indexed, rasterize};
use crate::simd::Isa;
use crate::view::View;

/// A depth buffer of occluders that answers whether things are hidden behind them.
///
/// Rasterizing and asking may be interleaved in any order and at no cost.
#[derive(Clone, Debug)]
pub struct Msoc {
    isa: Isa,
    view: View,
    options: Options,
    buffer: MaskedDepth,
    /// Clip-space positions of the mesh at hand.
    vertices: Vec<[f32; 4]>,
}

/// An occluder that cannot be rasterized.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("triangle {triangle} has vertex {index}, but the mesh has {vertices} vertices")]
pub struct MeshError {
    /// Its number in the mesh.
    pub triangle: usize,
    /// The index that is too large.
    pub index: u32,
    /// How many there are.
    pub vertices: usize,
}

impl Msoc {
    /// An empty depth buffer of `size` pixels, which should be that of the frame.
    ///
    /// # Errors
    /// If the size or an option is out of range.
    pub fn new(size: [u32; 2], options: Options) -> Result<Self, OptionsError> {
        options.check(size)?;
        let isa = options.isa.unwrap_or_else(Isa::best);
        Ok(Self {
            isa,
            view: View::new(size, &options),
            options,
            buffer: MaskedDepth::new(size, isa.lanes()),
            vertices: Vec::new(),
        })
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.buffer.size
    }

    /// The instruction set in use.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// The mode in use.
    pub fn mode(&self) -> Mode {
        self.options.mode
    }

    /// Forgets all occluders.
    pub fn clear(&mut self) {
        self.buffer.clear();
    }

    /// Rasterizes occluders, front to back for best results.
    ///
    /// # Errors
    /// If an index is out of range. The occluders before that one have been rasterized.
    pub fn rasterize(
        &mut self,
        clip_from_world: &Matrix4,
        occluders: &[Occluder<'_>],
    ) -> Result<(), MeshError> {
        occluders
            .iter()
            .try_for_each(|occluder| self.rasterize_one(clip_from_world, occluder))
    }

    fn rasterize_one(
        &mut self,
        clip_from_world: &Matrix4,
        occluder: &Occluder<'_>,
    ) -> Result<(), MeshError> {
        let Occluder {
            mesh,
            world_from_object,
        } = occluder;
        check_indices(mesh)?;
        self.isa.run(Transform {
            clip_from_object: compose(clip_from_world, world_from_object),
            positions: mesh.positions,
            out: &mut self.vertices,
        });
        let error = match self.view.inner {
            None => ClipError::default(),
            Some(_) => clip_error(clip_from_world, world_from_object, reach(mesh.positions)),
        };
        let triangles = Indexed {
            vertices: &self.vertices,
            indices: mesh.indices,
        };
        let view = self.view.with_clip_error(error);
        rasterize(
            self.isa,
            &view,
            &mut self.buffer,
            &triangles,
            self.options.parallel,
        );
        Ok(())
    }

    /// Rasterizes triangles whose vertices (x, y, z, w) are in clip space. In [`Mode::Inner`] the GPU is
    /// taken to have the very same clip-space positions.
    pub fn rasterize_clip(&mut self, triangles: &[[[f32; 4]; 3]]) {
        rasterize(
            self.isa,
            &self.view,
            &mut self.buffer,
            &triangles,
            self.options.parallel,
        );
    }

    /// Whether a rectangle of the screen at some depth can be seen.
    #[inline]
    pub fn query_rect(&self, rect: &Rect) -> Visibility {
        let (view, buffer) = (&self.view, &self.buffer);
        match self.isa.run(AsksRect { view, buffer, rect }) {
            Ok(answer) => answer,
            Err(rect) => self.isa.run(AsksPixels { buffer, rect }),
        }
    }

    /// What [`Self::query_rect`] says of each of many rectangles, a vector of them at a time: of small ones in half to two
    /// thirds of the time. `answers` has that afterwards, in their order, and nothing else.
    pub fn query_rects(&self, rects: &[Rect], answers: &mut Vec<Visibility>) {
        answers.clear();
        answers.resize(rects.len(), Visibility::Visible);
        self.isa.run(AsksRects {
            view: &self.view,
            buffer: &self.buffer,
            rects,
            answers,
        });
    }

    /// Whether the hull of eight clip-space corners can be seen.
    #[inline]
    pub fn query_box_clip(&self, corners: &[[f32; 4]; 8]) -> Visibility {
        self.ask(self.hull_footprint(&self.view, corners))
    }

    /// Whether a box in world space can be seen.
    pub fn query_box(&self, clip_from_world: &Matrix4, bounds: &Aabb) -> Visibility {
        self.ask(self.box_footprint(clip_from_world, bounds).1)
    }

    /// The numbers of the boxes that can be seen, in order.
    pub fn visible<'a>(
        &self,
        clip_from_world: &Matrix4,
        bounds: impl IntoIterator<Item = &'a Aabb>,
    ) -> Vec<u32> {
        let numbered = (0..).zip(bounds);
        let seen = numbered
            .filter(|(_, bounds)| self.query_box(clip_from_world, bounds) == Visibility::Visible);
        seen.map(|(number, _)| number).collect()
    }

    /// Whether a sphere in world space can be seen.
    pub fn query_sphere(
        &self,
        clip_from_world: &Matrix4,
        centre: [f32; 3],
        radius: f32,
    ) -> Visibility {
        let bounds = Aabb {
            min: centre.map(|c| c - radius),
            max: centre.map(|c| c + radius),
        };
        let view = self.view.of_bounds(clip_from_world, &bounds);
        let corners = bounds
            .corners()
            .map(|corner| transform(clip_from_world, corner));
        if self.hull_footprint(&view, &corners) == Err(Visibility::Outside) {
            return Visibility::Outside;
        }
        let numerator = match view.depth {
            Depth::InverseW => [0.0, 0.0, 0.0, 1.0],
            Depth::Reversed => [1.0, 0.0, 0.0, 0.0],
            Depth::Standard => [-1.0, 1.0, 0.0, 0.0],
        };
        let near = f64::from(view.near);
        let Some(([x, y, depth], inverse_w)) =
            sphere_bounds(clip_from_world, numerator, near, centre, radius)
        else {
            return Visibility::Visible;
        };
        let bounds = Bounds {
            min: [round_down(x[0]), round_down(y[0])],
            max: [round_up(x[1]), round_up(y[1])],
            nearest: round_up(depth[1]),
            inverse_w: round_up(inverse_w),
        };
        self.ask(self.isa.run(FindsBounds {
            view: &view,
            bounds: &bounds,
        }))
    }

    /// The depth (nearness, see [`Depth`]) that the occluders are known to reach at a pixel at least, 0 where
    /// none does. Row 0 is the top.
    ///
    /// # Panics
    /// Outside the image.
    pub fn depth(&self, pixel: [u32; 2]) -> f32 {
        assert!(
            pixel[0] < self.size()[0] && pixel[1] < self.size()[1],
            "a pixel of the image"
        );
        self.buffer.pixel(pixel)
    }

    /// The nearest corner's nearness, for front-to-back order (infinite if that is unknown), and the pixels.
    pub(crate) fn box_footprint(
        &self,
        clip_from_world: &Matrix4,
        bounds: &Aabb,
    ) -> (f32, Footprint) {
        let corners = bounds
            .corners()
            .map(|corner| transform(clip_from_world, corner));
        let view = self.view.of_bounds(clip_from_world, bounds);
        let footprint = self.hull_footprint(&view, &corners);
        (
            footprint.map_or(f32::INFINITY, |rect| rect.nearest),
            footprint,
        )
    }

    fn hull_footprint(&self, view: &View, corners: &[[f32; 4]; 8]) -> Footprint {
        self.isa.run(FindsHull { view, corners })
    }

    #[inline]
    pub(crate) fn ask(&self, footprint: Footprint) -> Visibility {
        let buffer = &self.buffer;
        match footprint {
            Err(known) => known,
            Ok(rect) => self.isa.run(AsksPixels { buffer, rect }),
        }
    }
}

/// Refuses a mesh with an index that is too large.
pub(crate) fn check_indices(mesh: &OccluderMesh<'_>) -> Result<(), MeshError> {
    let vertices = mesh.positions.len();
    let too_large = |index: u32| index as usize >= vertices;
    for (triangle, indices) in mesh.indices.iter().enumerate() {
        if let Some(&index) = indices.iter().find(|&&index| too_large(index)) {
            return Err(MeshError {
                triangle,
                index,
                vertices,
            });
        }
    }
    Ok(())
}

/// Greatest distance of a coordinate from 0, per axis.
fn reach(positions: &[[f32; 3]]) -> [f32; 3] {
    positions.iter().fold([0.0; 3], |most, position| {
        std::array::from_fn(|axis| f32::max(most[axis], position[axis].abs()))
    })
}

fn round_down(value: f64) -> f32 {
    (value as f32).next_down()
}

fn round_up(value: f64) -> f32 {
    (value as f32).next_up()
}
