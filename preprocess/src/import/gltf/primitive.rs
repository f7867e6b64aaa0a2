//! Mesh primitives (section 3.7.2): any triangle mode, indexed or not, becomes a triangle list over
//! the vertices it uses.

use super::accessor::{Accessors, Elements};
use super::document::known;
use super::skin::{Joints, Weights};
use super::{ImportError, ImportErrorKind, Result};
use crate::import::ImportOptions;
use crate::scene::SourceMesh;
use glam::Vec3;
use gltf::json::accessor::Type;
use gltf::json::mesh::{MorphTarget, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};
use std::collections::HashMap;

/// Meshes may take this many bytes, and [`MAX_EXPANSION`] times those of the buffers they come from:
/// accessors may overlap, so without a limit memory could grow with the square of the file.
/// Compression and quantization together stay well below it.
const FREE_BYTES: u64 = 1 << 26;
const MAX_EXPANSION: u64 = 256;

/// What moves vertices of a primitive beside its node's transform.
#[derive(Clone, Copy)]
pub(super) struct Deform<'a> {
    /// Default weights of the morph targets.
    pub(super) weights: Option<&'a Vec<f32>>,
    /// The node and its joints.
    pub(super) skin: Option<(usize, &'a Joints)>,
}

/// Counts of what was left out or read in part.
#[derive(Default)]
pub(super) struct Skipped {
    points: usize,
    lines: usize,
    empty: usize,
    without_positions: usize,
    cut_short: usize,
    morphed: usize,
    skinned: usize,
}

impl Skipped {
    pub(super) fn warnings(&self) -> Vec<String> {
        let counts = [
            (self.points, "primitives of points skipped"),
            (self.lines, "primitives of lines skipped"),
            (self.empty, "primitives without a triangle skipped"),
            (
                self.without_positions,
                "primitives without POSITION skipped",
            ),
            (
                self.cut_short,
                "primitives that end within a triangle, without the rest",
            ),
            (
                self.morphed,
                "primitives with morph targets, taken with their default weights",
            ),
            (
                self.skinned,
                "skinned primitives, taken in the pose of the file's nodes",
            ),
        ];
        counts
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{what}: {count}"))
            .collect()
    }
}

/// Weight bits, POSITION and NORMAL of a morph target.
type Target = (u32, Option<Index<Accessor>>, Option<Index<Accessor>>);

/// What decides a mesh: primitives that agree in it share one, wherever the file lists them.
#[derive(PartialEq, Eq, Hash)]
struct Key {
    position: Index<Accessor>,
    normal: Option<Index<Accessor>>,
    uv: Option<Index<Accessor>>,
    indices: Option<Index<Accessor>>,
    mode: u32,
    /// The morph targets in use.
    targets: Vec<Target>,
    /// The node, for a skinned primitive.
    node: Option<usize>,
}

/// Reads primitives, each once.
pub(super) struct Primitives<'a> {
    accessors: Accessors<'a>,
    normals: bool,
    uvs: bool,
    read: HashMap<Key, usize>,
    /// Bytes of the meshes read so far.
    mesh_bytes: u64,
}

impl<'a> Primitives<'a> {
    pub(super) fn new(accessors: Accessors<'a>, options: &ImportOptions) -> Self {
        Self {
            accessors,
            normals: options.normals,
            uvs: options.uvs,
            read: HashMap::new(),
            mesh_bytes: 0,
        }
    }

    pub(super) fn accessors(&self) -> &Accessors<'a> {
        &self.accessors
    }

    /// The mesh of a primitive, appended to `meshes` where it is new; `None` if it has no triangle.
    pub(super) fn read(
        &mut self,
        primitive: &Primitive,
        deform: Deform<'_>,
        meshes: &mut Vec<SourceMesh>,
        skipped: &mut Skipped,
    ) -> Result<Option<usize>> {
        let mode = known(primitive.mode, "mode")?.as_gl_enum();
        match mode {
            0 => skipped.points += 1,
            1..=3 => skipped.lines += 1,
            _ => {}
        }
        if mode < 4 {
            return Ok(None);
        }
        let attribute = |semantic| attribute(primitive, semantic);
        let Some(position) = attribute(Semantic::Positions) else {
            skipped.without_positions += 1;
            return Ok(None);
        };
        self.refuse_draco(primitive, position)?;

        let targets = targets(primitive, deform.weights);
        skipped.morphed += usize::from(
            primitive
                .targets
                .as_ref()
                .is_some_and(|targets| !targets.is_empty()),
        );
        let skin = deform
            .skin
            .filter(|_| attribute(Semantic::Joints(0)).is_some());
        skipped.skinned += usize::from(skin.is_some());
        let key = Key {
            position,
            normal: attribute(Semantic::Normals).filter(|_| self.normals),
            uv: attribute(Semantic::TexCoords(0)).filter(|_| self.uvs),
            indices: primitive.indices,
            mode,
            targets: targets
                .iter()
                .map(|(weight, target)| (weight.to_bits(), target.positions, target.normals))
                .collect(),
            node: skin.map(|(node, _)| node),
        };
        if let Some(&mesh) = self.read.get(&key) {
            return Ok(Some(mesh));
        }
        let Some(mesh) = self.mesh(&key, &targets, skin, primitive, skipped)? else {
            return Ok(None);
        };
        self.mesh_bytes += mesh.byte_count();
        let limit = FREE_BYTES + MAX_EXPANSION * self.accessors.source_bytes();
        if self.mesh_bytes > limit {
            let what =
                format!("the meshes take more than {MAX_EXPANSION} times the file's buffers");
            return Err(ImportError::new(ImportErrorKind::TooLarge, what));
        }
        meshes.push(mesh);
        self.read.insert(key, meshes.len() - 1);
        Ok(Some(meshes.len() - 1))
    }

    /// A primitive may carry plain data beside Draco's; without it nothing can be read.
    fn refuse_draco(&self, primitive: &Primitive, position: Index<Accessor>) -> Result<()> {
        const DRACO: &str = "KHR_draco_mesh_compression";
        let plain = |accessor| {
            let accessor = self.accessors.declared(accessor)?;
            Ok(accessor.buffer_view.is_some() || accessor.sparse.is_some())
        };
        let has_plain = plain(position)? && primitive.indices.map_or(Ok(true), plain)?;
        let extensions = primitive.extensions.as_ref();
        let is_draco = extensions.is_some_and(|extensions| extensions.others.contains_key(DRACO));
        if !is_draco || has_plain {
            return Ok(());
        }
        let what = format!("is compressed with {DRACO}, which is not supported");
        Err(ImportError::new(ImportErrorKind::Unsupported, what)
            .next("decompress it, for instance with `gltf-transform copy IN OUT`"))
    }

    fn mesh(
        &self,
        key: &Key,
        targets: &[(f32, &MorphTarget)],
        skin: Option<(usize, &Joints)>,
        primitive: &Primitive,
        skipped: &mut Skipped,
    ) -> Result<Option<SourceMesh>> {
        let positions = self.accessors.open(key.position, Type::Vec3)?;
        let vertex_count = positions.count();
        let elements = match key.indices {
            Some(accessor) => {
                let indices = self.accessors.open(accessor, Type::Scalar)?;
                indices
                    .indices()
                    .map_err(|error| error.within(format_args!("accessor {accessor}")))?
            }
            None => (0..u32::try_from(vertex_count).unwrap_or(u32::MAX)).collect(),
        };
        if let Some(index) = elements
            .iter()
            .find(|&&index| index as usize >= vertex_count)
        {
            let accessor = key.indices.unwrap_or(key.position);
            let what = format!("index {index} is not below the {vertex_count} vertices");
            return Err(ImportError::malformed(what).within(format_args!("accessor {accessor}")));
        }
        skipped.cut_short +=
            usize::from(key.mode == 4 && elements.len() % 3 != 0 && elements.len() > 3);
        let mut indices = triangle_list(key.mode, elements);
        if indices.is_empty() {
            skipped.empty += 1;
            return Ok(None);
        }
        let used = compact(&mut indices, vertex_count);

        let mut mesh = SourceMesh {
            positions: gather(&positions, &used),
            indices,
            ..Default::default()
        };
        let parallel = |accessor: Index<Accessor>, shape: Type| {
            let elements = self.accessors.open(accessor, shape)?;
            if elements.count() == vertex_count {
                return Ok(elements);
            }
            let what = format!(
                "has {} elements for {vertex_count} positions",
                elements.count()
            );
            Err(ImportError::malformed(what).within(format_args!("accessor {accessor}")))
        };
        if let Some(normal) = key.normal {
            mesh.normals = gather(&parallel(normal, Type::Vec3)?, &used);
        }
        if let Some(uv) = key.uv {
            mesh.uvs = gather(&parallel(uv, Type::Vec2)?, &used);
        }
        for (weight, target) in targets {
            if let Some(accessor) = target.positions {
                let by = parallel(accessor, Type::Vec3)?;
                displace(&mut mesh.positions, &by, &used, *weight);
            }
            if let Some(accessor) = target.normals {
                let by = parallel(accessor, Type::Vec3)?;
                displace(&mut mesh.normals, &by, &used, *weight);
            }
        }
        if let Some((_, joints)) = skin {
            let mut weights = Vec::new();
            for set in 0.. {
                let (Some(joint), Some(weight)) = (
                    attribute(primitive, Semantic::Joints(set)),
                    attribute(primitive, Semantic::Weights(set)),
                ) else {
                    break;
                };
                weights.push(Weights {
                    joints: parallel(joint, Type::Vec4)?,
                    weights: parallel(weight, Type::Vec4)?,
                });
            }
            joints.apply(&mut mesh, &weights, &used)?;
        }
        finish(mesh, key.position).map(Some)
    }
}

/// Checks positions and makes normals unit vectors.
fn finish(mut mesh: SourceMesh, position: Index<Accessor>) -> Result<SourceMesh> {
    if let Some(vertex) = mesh
        .positions
        .iter()
        .position(|point| !Vec3::from(*point).is_finite())
    {
        let what = format!("the position {:?} is not finite", mesh.positions[vertex]);
        return Err(ImportError::malformed(what).within(format_args!("accessor {position}")));
    }
    for normal in &mut mesh.normals {
        *normal = Vec3::from(*normal)
            .try_normalize()
            .unwrap_or(Vec3::Z)
            .into();
    }
    for uv in &mut mesh.uvs {
        *uv = uv.map(|lane| if lane.is_finite() { lane } else { 0.0 });
    }
    Ok(mesh)
}

/// The accessor of an attribute.
fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<Index<Accessor>> {
    let semantic = Checked::Valid(semantic);
    primitive.attributes.get(&semantic).copied()
}

/// The morph targets that the default weights put to use.
fn targets<'a>(
    primitive: &'a Primitive,
    weights: Option<&Vec<f32>>,
) -> Vec<(f32, &'a MorphTarget)> {
    let weights = weights.into_iter().flatten().copied();
    let used = weights.zip(primitive.targets.iter().flatten());
    used.filter(|(weight, _)| *weight != 0.0 && weight.is_finite())
        .collect()
}

fn displace(vectors: &mut [[f32; 3]], by: &Elements<'_>, used: &[u32], weight: f32) {
    for (vector, &vertex) in vectors.iter_mut().zip(used) {
        let by: [f32; 3] = by.floats(vertex as usize);
        *vector = std::array::from_fn(|axis| {
            (f64::from(vector[axis]) + f64::from(weight) * f64::from(by[axis])) as f32
        });
    }
}

fn gather<const N: usize>(elements: &Elements<'_>, used: &[u32]) -> Vec<[f32; N]> {
    used.iter()
        .map(|&vertex| elements.floats(vertex as usize))
        .collect()
}

/// Unrolls strips and fans (section 3.7.2.1); a trailing incomplete triangle is left out.
fn triangle_list(mode: u32, mut elements: Vec<u32>) -> Vec<u32> {
    let corners = |w: &[u32]| [w[0], w[1], w[2]];
    let windows = elements.windows(3).map(corners);
    match mode {
        // Every other triangle of a strip is turned round, which swaps its last two corners.
        5 => {
            let turn =
                |(i, [a, b, c]): (usize, [u32; 3])| if i % 2 == 0 { [a, b, c] } else { [a, c, b] };
            windows.enumerate().flat_map(turn).collect()
        }
        6 => windows.flat_map(|[_, b, c]| [b, c, elements[0]]).collect(),
        _ => {
            elements.truncate(elements.len() / 3 * 3);
            elements
        }
    }
}

/// Renumbers the vertices that `indices` use from 0, in ascending order, and returns their old
/// numbers. Many primitives may share one large vertex buffer; none keeps a copy of all of it.
fn compact(indices: &mut [u32], vertex_count: usize) -> Vec<u32> {
    let used: Vec<u32> = if vertex_count / 8 > indices.len() {
        let mut used = indices.to_vec();
        used.sort_unstable();
        used.dedup();
        used
    } else {
        let mut is_used = vec![false; vertex_count];
        indices
            .iter()
            .for_each(|&index| is_used[index as usize] = true);
        (0..)
            .zip(is_used)
            .filter(|(_, is_used)| *is_used)
            .map(|(vertex, _)| vertex)
            .collect()
    };
    if used.len() < vertex_count {
        for index in indices {
            // Every index is in the list made of them.
            *index = used.partition_point(|vertex| vertex < index) as u32;
        }
    }
    used
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_become_lists() {
        assert_eq!(triangle_list(4, vec![0, 1, 2, 3]), [0, 1, 2]);
        assert_eq!(
            triangle_list(5, vec![0, 1, 2, 3, 4]),
            [0, 1, 2, 1, 3, 2, 2, 3, 4]
        );
        assert_eq!(triangle_list(6, vec![0, 1, 2, 3]), [1, 2, 0, 2, 3, 0]);
        for mode in 4..=6 {
            assert!(triangle_list(mode, vec![0, 1]).is_empty());
        }
    }

    #[test]
    fn compacting_keeps_order_and_drops_the_unused() {
        for vertex_count in [10, 1000] {
            let mut indices = [7, 2, 7, 9, 2, 7];
            assert_eq!(compact(&mut indices, vertex_count), [2, 7, 9]);
            assert_eq!(indices, [1, 0, 1, 2, 0, 1]);
        }
    }
}
