//! Objects in their cells: the f32 matrices and the bounds.

use super::BakeError;
use super::cells::{self, Cells};
use super::pack::Packed;
use crate::progress::Progress;
use crate::scene::{AlphaMode, SourceObject};
use crate::world_bounds::round_to_f32;
use glam::{DAffine3, DVec3};
use hroc_format::{Bounds, Mesh, Object, ObjectBounds, object_flags};
use rayon::prelude::*;

/// What the bake stores of objects and their places.
pub(super) struct Placed {
    /// In the source's coordinates; the first is the scene's.
    pub(super) origins: Vec<DVec3>,
    pub(super) objects: Vec<Object>,
    pub(super) bounds: Vec<ObjectBounds>,
}

/// For each object a number that it shares with its neighbours in the list that have the same source and transform:
/// the parts of one mesh.
pub(super) fn shared_places(objects: &[SourceObject]) -> Vec<u32> {
    let mut place = 0;
    let next = |i: usize| {
        if let Some(before) = i.checked_sub(1) {
            let [a, b] = [before, i].map(|i| {
                let object = &objects[i];
                (object.file, object.node, object.world_from_object)
            });
            place += u32::from(a != b);
        }
        place
    };
    (0..objects.len()).map(next).collect()
}

/// World's zero: the centre of the scene, on a grid of 1/256 to 1/512 of its size, so that
/// translations on a grid stay exact.
fn origin(boxes: &[[DVec3; 2]]) -> DVec3 {
    let [min, max] = boxes
        .iter()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[min, max], b| {
            [min.min(b[0]), max.max(b[1])]
        });
    let centre = min + (max - min) * 0.5;
    if !centre.is_finite() {
        return DVec3::ZERO;
    }
    let size = (max - min).max_element();
    let step = (size.log2().floor() - 8.0).exp2();
    let snapped = (centre / step).round() * step;
    if snapped.is_finite() { snapped } else { centre }
}

/// Bounds of a mesh's box under an affine map, to f64 rounding.
fn box_under(map: &DAffine3, mesh: &Mesh) -> [DVec3; 2] {
    let [min, max] = [mesh.min, mesh.max].map(|corner| DVec3::from(corner.map(f64::from)));
    let centre = map.transform_point3(min + (max - min) * 0.5);
    let half = (max - min) * 0.5;
    let axes = map.matrix3;
    let reach =
        axes.x_axis.abs() * half.x + axes.y_axis.abs() * half.y + axes.z_axis.abs() * half.z;
    [centre - reach, centre + reach]
}

/// The stored objects and their bounds. `places` is of [`shared_places`].
pub(super) fn place(
    sources: &[SourceObject],
    packed: &Packed,
    places: &[u32],
    progress: &dyn Progress,
) -> Result<Placed, BakeError> {
    let boxes: Vec<[DVec3; 2]> = sources
        .par_iter()
        .map(|source| box_under(&source.world_from_object, &packed.meshes[source.mesh]))
        .collect();
    let Cells { origins, of_object } = cells::choose(&boxes, places, origin(&boxes));
    let object = |(source, &cell): (&SourceObject, &u32)| Object {
        world_from_object: round_to_f32(&source.world_from_object, origins[cell as usize]),
        mesh: source.mesh as u32,
        base_color: pack_color(source),
        flags: flags(source),
        cell,
    };
    let objects: Vec<Object> = sources.par_iter().zip(&of_object).map(object).collect();
    let by_mesh = ObjectsOfMeshes::new(&objects, packed.meshes.len());
    // Mesh by mesh, so that its vertices are laid out once and only while they are in use.
    let of_mesh = |mesh: usize| {
        let ids = by_mesh.of(mesh);
        let points = packed.points(mesh);
        let bounds = |&id: &u32| points.world_bounds(&objects[id as usize].world_from_object);
        let found: Vec<Option<Bounds>> = ids.par_iter().map(bounds).collect();
        progress.advance(ids.len() as u64);
        found
    };
    let found: Vec<Vec<_>> = (0..packed.meshes.len())
        .into_par_iter()
        .map(of_mesh)
        .collect();
    let mut bounds = vec![None; objects.len()];
    for (&id, found) in by_mesh.ids.iter().zip(found.into_iter().flatten()) {
        bounds[id as usize] = found;
    }
    let bounds = bounds.into_iter().enumerate().map(|(object, bounds)| {
        let cell = of_object[object];
        // Beyond this a sum of the cell's place and a corner could overflow in f32.
        let far = (origins[cell as usize] - origins[0]).abs().max_element();
        match bounds.filter(|_| far <= crate::world_bounds::LARGEST) {
            Some(Bounds { min, max }) => Ok(ObjectBounds {
                min,
                cell,
                max,
                reserved: 0,
            }),
            None => Err(BakeError::TooFar {
                object,
                name: sources[object].name.clone(),
            }),
        }
    });
    Ok(Placed {
        bounds: bounds.collect::<Result<_, _>>()?,
        origins,
        objects,
    })
}

/// Ids of objects, mesh by mesh, ascending.
struct ObjectsOfMeshes {
    ids: Vec<u32>,
    /// End of each mesh's ids; they start where those before end.
    ends: Vec<usize>,
}

impl ObjectsOfMeshes {
    fn new(objects: &[Object], meshes: usize) -> Self {
        let mut ends = vec![0; meshes];
        objects
            .iter()
            .for_each(|object| ends[object.mesh as usize] += 1);
        let mut next = 0;
        for end in &mut ends {
            // The start for now; placing the ids moves it to the end.
            next += std::mem::replace(end, next);
        }
        let mut ids = vec![0; objects.len()];
        for (id, object) in (0..).zip(objects) {
            let at = &mut ends[object.mesh as usize];
            ids[*at] = id;
            *at += 1;
        }
        Self { ids, ends }
    }

    fn of(&self, mesh: usize) -> &[u32] {
        let start = mesh.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.ids[start..self.ends[mesh]]
    }
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
