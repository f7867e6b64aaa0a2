//! Objects and all that is stored per object, the scene's bounds and its cameras.

use super::{CellBox, Result, ensure, is_box, mesh_box, same_count};
use crate::object_flags;
use crate::types::{ArchivedScene, Bounds, MAX_CELLS, MAX_OBJECTS};

pub(super) fn check(scene: &ArchivedScene) -> Result {
    let count = scene.objects.len();
    ensure(
        count <= MAX_OBJECTS,
        || "objects".into(),
        || format!("{count}, too many"),
    )?;
    same_count("object bounds", scene.object_bounds.len(), count)?;
    same_count("object sources", scene.object_sources.len(), count)?;
    same_count("name ends", scene.name_ends.len(), count)?;
    ensure(
        scene.origin.iter().all(|v| v.to_native().is_finite()),
        || "scene".into(),
        || "the origin is not finite".into(),
    )?;
    cells(scene)?;
    for (i, mesh) in scene.meshes.iter().enumerate() {
        let (min, max) = mesh_box(mesh);
        ensure(
            is_box(min, max),
            || format!("mesh {i}"),
            || format!("bounds {min:?} to {max:?}"),
        )?;
    }
    for (i, referenced) in scene.referenced_files.iter().enumerate() {
        let (by, files) = (referenced.by.to_native(), scene.source_files.len());
        ensure(
            (by as usize) < files,
            || format!("referenced file {i}"),
            || format!("source file {by} of {files}"),
        )?;
    }
    objects(scene)?;
    bounds(scene)?;
    names(scene)?;
    cameras(scene)
}

/// A scene with objects has cells; the first one's origin is the scene's.
fn cells(scene: &ArchivedScene) -> Result {
    let count = scene.cells.len();
    let at = || "cells".into();
    ensure(count <= MAX_CELLS, at, || {
        format!("{count}, more than {MAX_CELLS}")
    })?;
    ensure(count > 0 || scene.objects.is_empty(), at, || {
        "none, although there are objects".into()
    })?;
    for (i, origin) in scene.cells.iter().enumerate() {
        let origin = origin.map(|v| v.to_native());
        let at = || format!("cell {i}");
        ensure(origin.iter().all(|v| v.is_finite()), at, || {
            format!("its origin {origin:?} is not finite")
        })?;
        let scenes = scene.origin.map(|v| v.to_native());
        ensure(i > 0 || origin == scenes, at, || {
            format!("its origin {origin:?} is not the scene's, {scenes:?}")
        })?;
    }
    Ok(())
}

fn objects(scene: &ArchivedScene) -> Result {
    let (meshes, files) = (scene.meshes.len(), scene.source_files.len());
    for (i, (object, source)) in scene
        .objects
        .iter()
        .zip(scene.object_sources.iter())
        .enumerate()
    {
        let at = || format!("object {i}");
        let (mesh, flags, file) = (
            object.mesh.to_native(),
            object.flags.to_native(),
            source.file.to_native(),
        );
        ensure((mesh as usize) < meshes, at, || {
            format!("mesh {mesh} of {meshes}")
        })?;
        ensure(flags & !object_flags::ALL == 0, at, || {
            format!("unknown flags {flags:#x}")
        })?;
        let (cell, cells) = (object.cell.to_native(), scene.cells.len());
        ensure((cell as usize) < cells, at, || {
            format!("cell {cell} of {cells}")
        })?;
        let matrix = object.world_from_object.as_flattened();
        ensure(matrix.iter().all(|v| v.to_native().is_finite()), at, || {
            "its transform is not finite".into()
        })?;
        ensure((file as usize) < files, at, || {
            format!("source file {file} of {files}")
        })?;
    }
    Ok(())
}

/// The bounds are boxes, in the cells of their objects, and the scene's contain them.
fn bounds(scene: &ArchivedScene) -> Result {
    let whole = scene.bounds.to_native();
    ensure(
        is_box(whole.min, whole.max),
        || "scene".into(),
        || format!("bounds {:?} to {:?}", whole.min, whole.max),
    )?;
    let empty = scene.objects.is_empty() && whole != Bounds::default();
    ensure(
        !empty,
        || "scene".into(),
        || format!("bounds {:?} to {:?} without objects", whole.min, whole.max),
    )?;
    let whole = CellBox {
        cell: 0,
        min: whole.min,
        max: whole.max,
    };
    let origins = scene.cell_origins();
    for (i, (stored, object)) in scene
        .object_bounds
        .iter()
        .zip(scene.objects.iter())
        .enumerate()
    {
        let at = || format!("object {i}");
        let bounds = stored.to_native();
        ensure(is_box(bounds.min, bounds.max), at, || {
            format!("bounds {:?} to {:?}", bounds.min, bounds.max)
        })?;
        ensure(bounds.reserved == 0, at, || "reserved bytes in use".into())?;
        let cell = object.cell.to_native();
        ensure(bounds.cell == cell, at, || {
            format!("its bounds are in cell {}, it is in {cell}", bounds.cell)
        })?;
        let inside = CellBox {
            cell,
            min: bounds.min,
            max: bounds.max,
        };
        ensure(whole.contains(&inside, &origins), at, || {
            "its bounds reach beyond the scene's".into()
        })?;
    }
    Ok(())
}

fn names(scene: &ArchivedScene) -> Result {
    let names = std::str::from_utf8(scene.names.as_slice()).map_err(|error| {
        super::failure(
            || "object names".into(),
            || format!("not UTF-8 at byte {}", error.valid_up_to()),
        )
    })?;
    let mut start = 0;
    for (i, end) in scene.name_ends.iter().enumerate() {
        let end = end.to_native() as usize;
        ensure(
            start <= end && names.is_char_boundary(end),
            || format!("object {i}"),
            || format!("its name is at bytes {start} to {end} of {}", names.len()),
        )?;
        start = end;
    }
    same_count("object names", names.len(), start)
}

fn cameras(scene: &ArchivedScene) -> Result {
    for (i, camera) in scene.cameras.iter().enumerate() {
        let at = || format!("camera {i}");
        let [fov_y, half_height, near, far] = [
            camera.fov_y_rad,
            camera.half_height,
            camera.near,
            camera.far,
        ]
        .map(|v| v.to_native());
        let position = camera.position.map(|v| v.to_native());
        ensure(position.iter().all(|v| v.is_finite()), at, || {
            format!("position {position:?}")
        })?;
        let orientation = camera.orientation.map(|v| v.to_native());
        let length_squared: f64 = orientation.iter().map(|v| v * v).sum();
        // Wide enough for a quaternion that was normalized in f32.
        ensure((length_squared - 1.0).abs() < 1e-5, at, || {
            format!("orientation {orientation:?}")
        })?;
        ensure((0.0..std::f32::consts::PI).contains(&fov_y), at, || {
            format!("field of view {fov_y}")
        })?;
        ensure(half_height.is_finite() && half_height >= 0.0, at, || {
            format!("half height {half_height}")
        })?;
        let one_projection = (fov_y > 0.0) != (half_height > 0.0);
        ensure(one_projection, at, || {
            "neither perspective nor orthographic, or both".into()
        })?;
        ensure(near.is_finite() && far > near, at, || {
            format!("near {near}, far {far}")
        })?;
    }
    Ok(())
}
