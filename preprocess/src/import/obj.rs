//! Wavefront OBJ. An object is all faces of one `o`, one `g` and one `usemtl`, wherever they stand.
//!
//! Read here rather than by `tobj`, which takes polylines for polygons, joins objects when the
//! material library is missing, and panics on a short `Kd`. Positions are parsed in f64: where the
//! model lies far from its own origin, as surveyed sites do, its centre goes to the objects'
//! transform and the vertices stay exact to f32 of the model's extent.

use super::Import;
use super::error::{ImportError, ImportErrorKind, Result};
use super::folder::Folder;
use super::mtl::{self, Material};
use crate::scene::{SourceMesh, SourceObject};
use glam::{DAffine3, DVec3, Vec3};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

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
    let mut reader = Reader::new(import);
    let bytes = reader.import.bytes;
    let mut lines = bytes.split(|&byte| byte == b'\n').enumerate();
    while let Some((number, line)) = lines.next() {
        let mut line = String::from_utf8_lossy(line);
        // A backslash before the line's end continues it.
        while let Some(start) = line.trim_end().strip_suffix('\\') {
            let Some((_, next)) = lines.next() else { break };
            line = format!("{start} {}", String::from_utf8_lossy(next)).into();
        }
        reader
            .statement(&line)
            .map_err(|error| error.within(format_args!("line {}", number + 1)))?;
    }
    reader.finish()
}

/// The indices of a face's corner: position, texture coordinate, normal.
type Corner = (u32, Option<u32>, Option<u32>);

/// An object in the making: the faces of one `o`, `g` and `usemtl`.
#[derive(Default)]
struct Part {
    name: String,
    material: String,
    corners: HashMap<Corner, u32>,
    order: Vec<Corner>,
    indices: Vec<u32>,
}

struct Reader<'r, 'i> {
    import: &'r mut Import<'i>,
    positions: Vec<DVec3>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    materials: HashMap<String, Material>,
    /// The names in force: `o`, `g`, `usemtl`.
    names: [String; 3],
    parts: Vec<Part>,
    part_of_names: HashMap<[String; 3], usize>,
    /// The part of the names in force, once a face was read under them.
    current: Option<usize>,
    points: usize,
    lines: usize,
    curves: usize,
}

impl<'r, 'i> Reader<'r, 'i> {
    fn new(import: &'r mut Import<'i>) -> Self {
        Self {
            import,
            positions: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            materials: HashMap::new(),
            names: Default::default(),
            parts: Vec::new(),
            part_of_names: HashMap::new(),
            current: None,
            points: 0,
            lines: 0,
            curves: 0,
        }
    }

    fn statement(&mut self, line: &str) -> Result<()> {
        let line = line.trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        match keyword {
            "v" => {
                // What follows, a weight of free-form surfaces or a colour, is nothing to polygons.
                let [x, y, z] = numbers(rest, 3)?;
                self.positions.push(DVec3::new(x, y, z));
            }
            "vt" => {
                let [u, v] = numbers(rest, 1)?;
                self.uvs.push([u as f32, v as f32]);
            }
            "vn" => {
                let [x, y, z] = numbers(rest, 3)?;
                self.normals.push([x as f32, y as f32, z as f32]);
            }
            "f" | "fo" => self.face(rest)?,
            "p" => self.points += 1,
            "l" => self.lines += 1,
            "curv" | "curv2" | "surf" => self.curves += 1,
            "o" | "g" | "usemtl" => {
                let which = ["o", "g", "usemtl"]
                    .iter()
                    .position(|known| *known == keyword);
                self.names[which.unwrap_or(0)] = rest.to_owned();
                self.current = None;
            }
            "mtllib" => self.library(rest),
            _ => {}
        }
        Ok(())
    }

    fn face(&mut self, rest: &str) -> Result<()> {
        let mut fan: [u32; 2] = [0; 2];
        let mut count = 0;
        for word in rest.split_whitespace() {
            let corner = self.corner(word)?;
            let part = self.part();
            let next = part.order.len() as u32;
            let vertex = match part.corners.entry(corner) {
                Entry::Occupied(known) => *known.get(),
                Entry::Vacant(new) => {
                    part.order.push(corner);
                    *new.insert(next)
                }
            };
            match count {
                0 => fan[0] = vertex,
                1 => fan[1] = vertex,
                _ => {
                    part.indices.extend([fan[0], fan[1], vertex]);
                    fan[1] = vertex;
                }
            }
            count += 1;
        }
        match count {
            0 | 1 => self.points += 1,
            2 => self.lines += 1,
            _ => {}
        }
        Ok(())
    }

    fn corner(&self, word: &str) -> Result<Corner> {
        let mut parts = word.split('/');
        let mut index = |what: &str, count: usize| -> Result<Option<u32>> {
            let Some(part) = parts.next().filter(|part| !part.is_empty()) else {
                return Ok(None);
            };
            let fault = |why: &str| {
                ImportError::malformed(format!("{what} index {part:?} of a face {why}"))
            };
            let number: i64 = part.parse().map_err(|_| fault("is not a number"))?;
            // Counted from 1, or backwards from the latest.
            let index = if number < 0 {
                number.saturating_add(count as i64)
            } else {
                number - 1
            };
            match u32::try_from(index) {
                Ok(index) if (index as usize) < count => Ok(Some(index)),
                _ => Err(fault(&format!("is outside the {count} read so far"))),
            }
        };
        let position = index("the position", self.positions.len())?;
        // Wrong ones among the other two cost that attribute only.
        let uv = index("the texture coordinate", self.uvs.len()).unwrap_or_default();
        let normal = index("the normal", self.normals.len()).unwrap_or_default();
        let position =
            position.ok_or_else(|| ImportError::malformed("a face corner has no position"))?;
        let point = self.positions[position as usize];
        if !point.is_finite() {
            let what = format!(
                "a face uses position {}, which is not finite: {point}",
                position + 1
            );
            return Err(ImportError::malformed(what));
        }
        let options = self.import.options;
        Ok((
            position,
            uv.filter(|_| options.uvs),
            normal.filter(|_| options.normals),
        ))
    }

    /// A missing library costs colours only. A name may hold spaces, or be several names.
    fn library(&mut self, names: &str) {
        let folder = Folder::of(self.import.path);
        let read = |name: &str| folder.read(&name.replace('\\', "/"));
        let mut found: Vec<Result<Vec<u8>>> = vec![read(names)];
        if found[0].is_err() && names.contains(char::is_whitespace) {
            found = names.split_whitespace().map(read).collect();
        }
        for library in found {
            match library {
                Ok(bytes) => {
                    self.import.hash.update(&bytes);
                    mtl::parse(&String::from_utf8_lossy(&bytes), &mut self.materials);
                }
                Err(error) => self.import.warn(format_args!(
                    "material library: {}; objects stay white",
                    error.what
                )),
            }
        }
    }

    /// The part that faces go to now.
    fn part(&mut self) -> &mut Part {
        let current = *self.current.get_or_insert_with(|| {
            *self
                .part_of_names
                .entry(self.names.clone())
                .or_insert_with(|| {
                    let [object, group, material] = &self.names;
                    let name = match (object.as_str(), group.as_str()) {
                        (name, "") | ("", name) => name.to_owned(),
                        (object, group) if object == group => object.to_owned(),
                        (object, group) => format!("{object}/{group}"),
                    };
                    self.parts.push(Part {
                        name,
                        material: material.clone(),
                        ..Default::default()
                    });
                    self.parts.len() - 1
                })
        });
        &mut self.parts[current]
    }

    fn finish(mut self) -> Result<()> {
        // Polygons of fewer than three corners leave no triangle.
        self.parts.retain(|part| !part.indices.is_empty());
        let origin = self.origin();
        let mut without_normals = 0;
        let mut without_uvs = 0;
        let mut unknown_materials = 0;
        for (number, part) in std::mem::take(&mut self.parts).into_iter().enumerate() {
            let mesh = self
                .mesh(&part, origin)
                .map_err(|error| error.within(format_args!("object {:?}", part.name)))?;
            let some = |has: fn(&Corner) -> bool| part.order.iter().any(has);
            without_normals +=
                usize::from(mesh.normals.is_empty() && some(|corner| corner.2.is_some()));
            without_uvs += usize::from(mesh.uvs.is_empty() && some(|corner| corner.1.is_some()));
            let look = self.materials.get(&part.material);
            unknown_materials += usize::from(
                look.is_none() && !self.materials.is_empty() && !part.material.is_empty(),
            );
            let look = look.copied().unwrap_or_default();
            let scene = &mut self.import.scene;
            scene.objects.push(SourceObject {
                mesh: scene.meshes.len(),
                world_from_object: DAffine3::from_translation(origin),
                base_color: look.base_color(),
                alpha: look.alpha(),
                double_sided: false,
                name: part.name,
                file: self.import.file,
                node: number,
                primitive: 0,
            });
            scene.meshes.push(mesh);
        }
        let counts = [
            (self.points, "points skipped"),
            (self.lines, "lines skipped"),
            (self.curves, "free-form curves and surfaces skipped"),
            (
                without_normals,
                "objects with normals on some corners only, dropped",
            ),
            (
                without_uvs,
                "objects with texture coordinates on some corners only, dropped",
            ),
            (
                unknown_materials,
                "objects whose material is in no library, left white",
            ),
        ];
        for (count, what) in counts.iter().filter(|(count, _)| *count > 0) {
            self.import.warn(format_args!("{what}: {count}"));
        }
        Ok(())
    }

    /// Zero, unless the model lies farther from it than its own size.
    fn origin(&self) -> DVec3 {
        let used = self.parts.iter().flat_map(|part| &part.order);
        let (min, max) = used.map(|corner| self.positions[corner.0 as usize]).fold(
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

    fn mesh(&self, part: &Part, origin: DVec3) -> Result<SourceMesh> {
        let positions: Vec<Vec3> = part
            .order
            .iter()
            .map(|corner| (self.positions[corner.0 as usize] - origin).as_vec3())
            .collect();
        if !positions.iter().all(|point| point.is_finite()) {
            let what = "a position is too large for f32";
            return Err(ImportError::new(ImportErrorKind::TooLarge, what).next("scale it down"));
        }
        // All corners or none.
        let normals = part.order.iter().map(|corner| {
            let normal = Vec3::from(self.normals[corner.2? as usize]);
            Some(normal.try_normalize().unwrap_or(Vec3::Z).into())
        });
        let uvs = part.order.iter().map(|corner| {
            let uv = self.uvs[corner.1? as usize];
            Some(uv.map(|lane| if lane.is_finite() { lane } else { 0.0 }))
        });
        Ok(SourceMesh {
            normals: normals.collect::<Option<_>>().unwrap_or_default(),
            uvs: uvs.collect::<Option<_>>().unwrap_or_default(),
            positions: positions.into_iter().map(Into::into).collect(),
            indices: part.indices.clone(),
        })
    }
}

/// The first numbers of a statement, missing ones zero; at least `needed` must be there.
fn numbers<const N: usize>(rest: &str, needed: usize) -> Result<[f64; N]> {
    let mut numbers = [0.0; N];
    let mut words = rest.split_whitespace();
    for (at, number) in numbers.iter_mut().enumerate() {
        match words.next().map(str::parse) {
            Some(Ok(value)) => *number = value,
            None | Some(Err(_)) if at >= needed => break,
            None => {
                return Err(ImportError::malformed(format!(
                    "{needed} numbers expected, {at} found"
                )));
            }
            Some(Err(_)) => {
                return Err(ImportError::malformed(format!("{rest:?} are not numbers")));
            }
        }
    }
    Ok(numbers)
}
