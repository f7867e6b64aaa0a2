//! Objects in the world: its zero, the f32 matrices, the bounds.

use super::BakeError;
use crate::progress::Progress;
use crate::scene::{AlphaMode, SourceMesh, SourceObject};
use crate::world_bounds::{Points, round_to_f32};
use glam::{DAffine3, DVec3};
use hroc_format::{Bounds, Mesh, Object, object_flags};
use rayon::prelude::*;

/// World's zero: the centre of the scene, on a grid of 1/256 to 1/512 of its size, so that
/// translations on a grid stay exact.
pub(super) fn origin(objects: &[SourceObject], meshes: &[Mesh]) -> DVec3 {
    let (min, max) = objects
        .par_iter()
        .map(|object| {
            let mesh = &meshes[object.mesh];
            let (min, max) = (mesh.min.map(f64::from), mesh.max.map(f64::from));
            box_under(&object.world_from_object, min.into(), max.into())
        })
        .reduce(
            || (DVec3::INFINITY, DVec3::NEG_INFINITY),
            |a, b| (a.0.min(b.0), a.1.max(b.1)),
        );
    let centre = min + (max - min) * 0.5;
    if !centre.is_finite() {
        return DVec3::ZERO;
    }
    let size = (max - min).max_element();
    let step = (size.log2().floor() - 8.0).exp2();
    let snapped = (centre / step).round() * step;
    if snapped.is_finite() { snapped } else { centre }
}

/// Bounds of a box under an affine map, to f64 rounding.
fn box_under(map: &DAffine3, min: DVec3, max: DVec3) -> (DVec3, DVec3) {
    let centre = map.transform_point3(min + (max - min) * 0.5);
    let half = (max - min) * 0.5;
    let axes = map.matrix3;
    let reach =
        axes.x_axis.abs() * half.x + axes.y_axis.abs() * half.y + axes.z_axis.abs() * half.z;
    (centre - reach, centre + reach)
}

/// The stored objects and their world bounds.
pub(super) fn place(
    sources: &[SourceObject],
    meshes: &[SourceMesh],
    origin: DVec3,
    quantized: bool,
    progress: &dyn Progress,
) -> Result<(Vec<Object>, Vec<Bounds>), BakeError> {
    let points: Vec<Points> = meshes
        .par_iter()
        .map(|mesh| match quantized {
            true => Points::quantized(&mesh.positions),
            false => Points::new(&mesh.positions),
        })
        .collect();
    let place = |(id, source): (usize, &SourceObject)| {
        let world_from_object = round_to_f32(&source.world_from_object, origin);
        let bounds = points[source.mesh].world_bounds(&world_from_object);
        let bounds = bounds.ok_or_else(|| BakeError::TooFar {
            object: id,
            name: source.name.clone(),
        })?;
        let object = Object {
            world_from_object,
            mesh: source.mesh as u32,
            base_color: pack_color(source),
            flags: flags(source),
            reserved: 0,
        };
        progress.advance(1);
        Ok((object, bounds))
    };
    sources
        .par_iter()
        .enumerate()
        .map(place)
        .collect::<Result<(Vec<_>, Vec<_>), _>>()
}

fn pack_color(source: &SourceObject) -> u32 {
    let [r, g, b, a] = source.base_color;
    let alpha = if source.alpha == AlphaMode::Opaque {
        1.0
    } else {
        a
    };
    u32::from_le_bytes(
        [r, g, b, alpha].map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8),
    )
}

fn flags(source: &SourceObject) -> u32 {
    let alpha = match source.alpha {
        AlphaMode::Opaque => 0,
        AlphaMode::Masked => object_flags::MASKED,
        AlphaMode::Blended => object_flags::BLENDED,
    };
    alpha
        | if source.double_sided {
            object_flags::DOUBLE_SIDED
        } else {
            0
        }
}
