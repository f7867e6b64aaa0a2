//! Wavefront OBJ. An `o` line begins an object, whatever its name. Within it an object of the scene is all
//! faces of one `g` and one `usemtl`, wherever they stand.
//!
//! `tobj` reads a cleaned copy of the file ([`mod@clean`]), in f64. Vertices are stored in f32 relative to an
//! origin of their object ([`mod@origin`]).

mod clean;
mod lines;
mod mtl;
mod origin;
mod polygon;
mod sweep;

use super::Import;
use super::error::{ImportError, ImportErrorKind, Result};
use crate::scene::{SourceMesh, SourceObject};
use clean::{Cleaned, Part, clean};
use glam::{DAffine3, DVec3, Vec3};
use lines::{Lines, keyword, without_bom};
use mtl::Libraries;
use origin::{Extent, bounds, origins};
use polygon::Cutter;
use std::collections::HashMap;
use std::path::Path;

/// What reads OBJ. A test compares the version with the one in use.
pub(super) const LOADER: &str = "tobj 4.0.5";
/// More libraries than this are left out: every `mtllib` line may name one that is large.
const MAX_LIBRARIES: usize = 1000;

/// Boxes of the runs of a group lie far apart if the box around all has more than this many times the area
/// of all of them.
const SPREAD: f64 = 4.0;

/// OBJ has no magic number: the name says so, or a first line that can be nothing else.
pub(super) fn is_obj(path: &Path, bytes: &[u8]) -> bool {
    let named = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    let text = !bytes.is_empty() && !bytes.iter().take(4096).any(|&byte| byte == 0);
    let mut lines = Lines::new(without_bom(bytes)).map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"));
    let known = |line| matches!(keyword(line).0, b"v" | b"mtllib" | b"o" | b"g");
    text && (named || first.is_some_and(known))
}

pub(super) fn import(import: &mut Import<'_>) -> Result<()> {
    let cleaned = clean(import.bytes, import.options)?;
    let mut libraries = Libraries::default();
    for library in cleaned.libraries.iter().take(MAX_LIBRARIES) {
        read_library(import, library, &mut libraries);
    }
    let materials = libraries.materials();
    let models = load(&cleaned)?;
    let origins = {
        let mut parts = vec![Vec::new(); cleaned.groups.len()];
        for (part, model) in cleaned.parts.iter().zip(&models) {
            parts[part.group].push(&model.mesh);
        }
        let extent = |parts: &Vec<_>| Extent::new(parts.clone().into_iter().flat_map(positions));
        origins(&parts.iter().map(extent).collect::<Vec<_>>())
    };
    let scattered = scattered_groups(&cleaned, &models);

    let mut without_normals = 0;
    let mut without_uvs = 0;
    let mut unknown_materials = 0;
    let mut invisible = 0;
    let mut material_numbers = HashMap::new();
    let mut cutter = Cutter::default();
    // The cleaned copy lists the parts one after the other; without any, one empty model comes back.
    for (part, model) in cleaned.parts.iter().zip(models) {
        let group = &cleaned.groups[part.group];
        let origin = origins[part.group];
        let position_error = rounding(&model.mesh, origin);
        let mesh = mesh(&model.mesh, part, origin, &mut cutter)
            .map_err(|error| error.within(format_args!("object {:?}", group.name)))?;
        without_normals += usize::from(mesh.normals.is_empty() && !model.mesh.normals.is_empty());
        without_uvs += usize::from(mesh.uvs.is_empty() && !model.mesh.texcoords.is_empty());
        let name = &cleaned.names[part.material];
        let material = materials.get(name);
        unknown_materials +=
            usize::from(material.is_none() && !materials.is_empty() && !name.is_empty());
        let (base_color, alpha) = mtl::look(material);
        invisible += usize::from(base_color[3] == 0.0);
        let scene = &mut import.scene;
        if !name.is_empty() {
            let names = &mut scene.materials.names;
            let number = *material_numbers.entry(part.material).or_insert_with(|| {
                names.push(String::from_utf8_lossy(name).into_owned());
                names.len() as u32 - 1
            });
            scene.materials.set(scene.objects.len(), number);
        }
        scene.objects.push(SourceObject {
            mesh: scene.meshes.len(),
            world_from_object: DAffine3::from_translation(origin),
            base_color,
            alpha,
            double_sided: false,
            name: group.name.clone(),
            file: import.file,
            node: part.group,
            primitive: part.number,
        });
        scene.position_errors.resize(scene.meshes.len(), 0.0);
        scene.position_errors.push(position_error);
        scene.meshes.push(mesh);
    }
    let left_out = cleaned.libraries.len().saturating_sub(MAX_LIBRARIES);
    let counts = [
        (cleaned.points, "points skipped"),
        (cleaned.lines, "lines skipped"),
        (cleaned.curves, "free-form curves and surfaces skipped"),
        (
            cleaned.bad_normals,
            "normals that are not three numbers; objects that use them get computed normals",
        ),
        (
            cleaned.bad_uvs,
            "texture coordinates that are not numbers; objects that use them get none",
        ),
        (
            without_normals,
            "objects with normals on some corners only, dropped",
        ),
        (
            without_uvs,
            "objects with texture coordinates on some corners only, dropped",
        ),
        (cleaned.cut_names, "object names cut after 255 bytes"),
        (
            scattered,
            "groups whose name is used again far away, so that they are culled badly; write an `o` line before \
             each object",
        ),
        (
            libraries.contradictions,
            "materials whose `d` and `Tr` contradict each other; `d` is used",
        ),
        (
            invisible,
            "objects whose material has opacity 0; they hide nothing",
        ),
        (
            unknown_materials,
            "objects whose material is in no library, left white",
        ),
        (left_out, "material libraries beyond the first 1000 skipped"),
    ];
    for (count, what) in counts.iter().filter(|(count, _)| *count > 0) {
        import.warn(format_args!("{what}: {count}"));
    }
    for warning in cutter.warnings() {
        import.warn(warning);
    }
    Ok(())
}

fn load(cleaned: &Cleaned) -> Result<Vec<tobj::Model>> {
    let options = tobj::LoadOptions {
        single_index: true,
        // Cut here, in full knowledge of the positions: tobj makes fans of concave polygons too.
        triangulate: false,
        ..Default::default()
    };
    let mut unread = cleaned.text.as_bytes();
    let no_library = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut unread, &options, no_library).map_err(|error| {
        // tobj stops behind the line it refuses, which has the number it has in the file.
        let read = cleaned.text.len() - unread.len();
        let number = cleaned.text[..read].lines().count();
        ImportError::malformed(error.to_string()).within(format_args!("line {number}"))
    })?;
    Ok(models)
}

/// Reads what stands behind `mtllib`: one name, which may hold spaces, or several names. A missing library
/// costs colours only.
fn read_library(import: &mut Import<'_>, names: &[u8], libraries: &mut Libraries) {
    // The name as it stands comes first: in some encodings `\` is half of a character.
    let read = |name: &[u8]| {
        let found = import.folder.read_named(name);
        if found.is_ok() || !name.contains(&b'\\') {
            return found;
        }
        let slashes: Vec<u8> = name
            .iter()
            .map(|&byte| if byte == b'\\' { b'/' } else { byte })
            .collect();
        import.folder.read_named(&slashes)
    };
    let mut found = vec![read(names)];
    if found[0].is_err() && names.iter().any(u8::is_ascii_whitespace) {
        found = lines::words(names).take(MAX_LIBRARIES).map(read).collect();
    }
    for library in found {
        match library {
            Ok(bytes) => libraries.add(&bytes),
            Err(error) => import.warn(format_args!(
                "material library: {}; objects stay white",
                error.what
            )),
        }
    }
}

/// Number of groups that several runs of faces make, far from each other.
fn scattered_groups(cleaned: &Cleaned, models: &[tobj::Model]) -> usize {
    type Box = (DVec3, DVec3);
    let around = |a: Box, b: Box| (a.0.min(b.0), a.1.max(b.1));
    let area = |(min, max): Box| {
        let size = max - min;
        size.x * size.y + size.y * size.z + size.z * size.x
    };
    // The box of each run of each group.
    let mut runs: Vec<Vec<Box>> = vec![Vec::new(); cleaned.groups.len()];
    for (part, model) in cleaned.parts.iter().zip(models) {
        let mesh = &model.mesh;
        let points = mesh.positions.as_chunks::<3>().0;
        let mut faces = part.runs.iter().copied().peekable();
        let (mut face, mut first) = (0, 0);
        while let Some((run, _)) = faces.next() {
            let end_face = faces.peek().map_or(usize::MAX, |&(_, face)| face);
            let start = first;
            if mesh.face_arities.is_empty() {
                first = end_face.saturating_mul(3).min(mesh.indices.len());
            } else {
                let end_face = end_face.min(mesh.face_arities.len());
                first += mesh.face_arities[face..end_face].iter().sum::<u32>() as usize;
                face = end_face;
            }
            let corners = mesh.indices[start..first].iter();
            let new = bounds(corners.map(|&corner| DVec3::from(points[corner as usize])));
            let boxes = &mut runs[part.group];
            let run = run as usize - 1;
            boxes.resize(
                boxes.len().max(run + 1),
                (DVec3::INFINITY, DVec3::NEG_INFINITY),
            );
            boxes[run] = around(boxes[run], new);
        }
    }
    let is_scattered = |runs: &&Vec<Box>| {
        let all = runs.iter().copied().reduce(around);
        let apart: f64 = runs.iter().copied().map(area).sum();
        runs.len() > 1 && all.is_some_and(|all| area(all) > SPREAD * apart)
    };
    runs.iter().filter(is_scattered).count()
}

fn positions(mesh: &tobj::Mesh) -> impl Iterator<Item = DVec3> + Clone {
    let (positions, _) = mesh.positions.as_chunks::<3>();
    positions.iter().copied().map(DVec3::from)
}

/// How far rounding to f32 about `origin` moves a position.
fn rounding(mesh: &tobj::Mesh, origin: DVec3) -> f64 {
    let moved = positions(mesh).map(|point| {
        let place = point - origin;
        (place.as_vec3().as_dvec3() - place).length_squared()
    });
    moved.fold(0.0, f64::max).sqrt()
}

fn mesh(mesh: &tobj::Mesh, part: &Part, origin: DVec3, cutter: &mut Cutter) -> Result<SourceMesh> {
    let positions: Vec<Vec3> = positions(mesh)
        .map(|point| (point - origin).as_vec3())
        .collect();
    if !positions.iter().all(|point| point.is_finite()) {
        let what = "a position is too large for f32";
        return Err(ImportError::new(ImportErrorKind::TooLarge, what).next("scale it down"));
    }
    // tobj's lists are shorter than the positions' where a corner lacks the attribute, and then tell
    // nobody which corner that is.
    let normals = mesh.normals.as_chunks::<3>().0;
    let uvs = mesh.texcoords.as_chunks::<2>().0;
    let normal = |&normal: &[f64; 3]| {
        let unit = DVec3::from(normal).as_vec3().try_normalize();
        unit.unwrap_or(Vec3::Z).into()
    };
    let uv = |uv: &[f64; 2]| {
        uv.map(|lane| lane as f32)
            .map(|lane| if lane.is_finite() { lane } else { 0.0 })
    };
    let all = |count| count == positions.len();
    let indices = match mesh.face_arities.as_slice() {
        [] => mesh.indices.clone(),
        arities => {
            let (mut indices, mut rest) = (Vec::new(), mesh.indices.as_slice());
            let mut lines = part.polygon_lines.iter();
            for &arity in arities {
                let (polygon, others) = rest.split_at(arity as usize);
                match polygon {
                    &[a, b, c] => indices.extend([a, b, c]),
                    polygon => {
                        let line = lines.next().copied().unwrap_or_default();
                        cutter.cut(polygon, &positions, line, &mut indices);
                    }
                }
                rest = others;
            }
            indices
        }
    };
    Ok(SourceMesh {
        normals: match all(normals.len()) {
            true => normals.iter().map(normal).collect(),
            false => Vec::new(),
        },
        uvs: match all(uvs.len()) {
            true => uvs.iter().map(uv).collect(),
            false => Vec::new(),
        },
        positions: positions.into_iter().map(Into::into).collect(),
        indices,
    })
}
