//! Wavefront OBJ. An object is all faces of one `o`, one `g` and one `usemtl`, wherever they stand.
//!
//! `tobj` reads a cleaned copy of the file ([`mod@clean`]), in f64: where the model lies far from its own
//! origin, as surveyed sites do, its centre goes to the objects' transform and the vertices stay exact
//! to f32 of the model's extent.

mod clean;
mod mtl;
mod polygon;

use super::Import;
use super::error::{ImportError, ImportErrorKind, Result};
use crate::scene::{SourceMesh, SourceObject};
use clean::{Cleaned, clean};
use glam::{DAffine3, DVec3, Vec3};
use polygon::Cutter;
use std::cell::RefCell;
use std::collections::HashMap;
use std::path::Path;

/// What reads OBJ. A test compares the version with the one in use.
pub(super) const LOADER: &str = "tobj 4.0.5";

/// OBJ has no magic number: the name says so, or a first line that can be nothing else.
pub(super) fn is_obj(path: &Path, bytes: &[u8]) -> bool {
    let named = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    let text = !bytes.is_empty() && !bytes.iter().take(4096).any(|&byte| byte == 0);
    let starts = [&b"v "[..], b"mtllib ", b"o ", b"g "];
    let mut lines = bytes.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"));
    text && (named || first.is_some_and(|line| starts.iter().any(|start| line.starts_with(start))))
}

pub(super) fn import(import: &mut Import<'_>) -> Result<()> {
    let cleaned = clean(import.bytes, import.options)?;
    let (models, materials) = load(import, &cleaned)?;
    // The last of one name counts.
    let materials: HashMap<&str, &tobj::Material> = materials
        .iter()
        .map(|material| (mtl::name(material), material))
        .collect();

    let origin = origin(&models);
    let mut without_normals = 0;
    let mut without_uvs = 0;
    let mut unknown_materials = 0;
    let mut material_numbers = HashMap::new();
    let mut cutter = Cutter::new();
    // The cleaned copy lists the parts one after the other; without any, one empty model comes back.
    for (number, (part, model)) in cleaned.parts.iter().zip(models).enumerate() {
        let position_error = rounding(&model.mesh, origin);
        let mesh = mesh(&model.mesh, origin, &mut cutter)
            .map_err(|error| error.within(format_args!("object {:?}", part.name)))?;
        without_normals += usize::from(mesh.normals.is_empty() && !model.mesh.normals.is_empty());
        without_uvs += usize::from(mesh.uvs.is_empty() && !model.mesh.texcoords.is_empty());
        let material = materials.get(part.material.as_str()).copied();
        unknown_materials +=
            usize::from(material.is_none() && !materials.is_empty() && !part.material.is_empty());
        let (base_color, alpha) = mtl::look(material);
        let scene = &mut import.scene;
        if !part.material.is_empty() {
            let names = &mut scene.materials.names;
            let number = *material_numbers.entry(&part.material).or_insert_with(|| {
                names.push(part.material.clone());
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
            name: part.name.clone(),
            file: import.file,
            node: number,
            primitive: 0,
        });
        scene.position_errors.resize(scene.meshes.len(), 0.0);
        scene.position_errors.push(position_error);
        scene.meshes.push(mesh);
    }
    let counts = [
        (cleaned.points, "points skipped"),
        (cleaned.lines, "lines skipped"),
        (cleaned.curves, "free-form curves and surfaces skipped"),
        (
            without_normals,
            "objects with normals on some corners only, dropped",
        ),
        (
            without_uvs,
            "objects with texture coordinates on some corners only, dropped",
        ),
        (
            cutter.fans,
            "concave polygons that cross themselves or are too many, cut as fans",
        ),
        (
            unknown_materials,
            "objects whose material is in no library, left white",
        ),
    ];
    for (count, what) in counts.iter().filter(|(count, _)| *count > 0) {
        import.warn(format_args!("{what}: {count}"));
    }
    Ok(())
}

fn load(
    import: &mut Import<'_>,
    cleaned: &Cleaned,
) -> Result<(Vec<tobj::Model>, Vec<tobj::Material>)> {
    let options = tobj::LoadOptions {
        single_index: true,
        // Cut here, in full knowledge of the positions: tobj makes fans of concave polygons too.
        triangulate: false,
        ..Default::default()
    };
    let import = RefCell::new(import);
    let library = |names: &Path| library(&mut import.borrow_mut(), &names.to_string_lossy());
    let mut unread = cleaned.text.as_bytes();
    let (models, materials) =
        tobj::load_obj_buf(&mut unread, &options, library).map_err(|error| {
            // tobj stops behind the line it refuses, which has the number it has in the file.
            let read = cleaned.text.len() - unread.len();
            let number = cleaned.text[..read].lines().count();
            ImportError::malformed(error.to_string()).within(format_args!("line {number}"))
        })?;
    Ok((models, materials.unwrap_or_default()))
}

/// A missing library costs colours only. A name may hold spaces, or be several names.
fn library(import: &mut Import<'_>, names: &str) -> tobj::MTLLoadResult {
    let read = |name: &str| import.folder.read(&name.replace('\\', "/"));
    let mut found = vec![read(names)];
    if found[0].is_err() && names.contains(char::is_whitespace) {
        found = names.split_whitespace().map(read).collect();
    }
    let mut text = String::new();
    for library in found {
        match library {
            Ok(bytes) => {
                mtl::clean(&String::from_utf8_lossy(&bytes), &mut text);
            }
            Err(error) => import.warn(format_args!(
                "material library: {}; objects stay white",
                error.what
            )),
        }
    }
    tobj::load_mtl_buf(&mut text.as_bytes())
}

/// Zero, unless the model lies farther from it than its own size.
fn origin(models: &[tobj::Model]) -> DVec3 {
    let positions = models.iter().flat_map(|model| positions(&model.mesh));
    let (min, max) = positions.fold(
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(min, max), point| (min.min(point), max.max(point)),
    );
    let centre = (min + (max - min) * 0.5).round();
    let far = centre.abs().max_element() > 16.0 * (max - min).max_element();
    if far && centre.is_finite() {
        centre
    } else {
        DVec3::ZERO
    }
}

fn positions(mesh: &tobj::Mesh) -> impl Iterator<Item = DVec3> {
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

fn mesh(mesh: &tobj::Mesh, origin: DVec3, cutter: &mut Cutter) -> Result<SourceMesh> {
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
            for &arity in arities {
                let (polygon, others) = rest.split_at(arity as usize);
                cutter.cut(polygon, &positions, &mut indices);
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
