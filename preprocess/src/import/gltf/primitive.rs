//! Mesh primitives (section 3.7.2): which of them make meshes, in the file's order; [`decode`](super::decode) then
//! reads those side by side.

use super::accessor::{Accessors, Elements};
use super::decode::Opened;
use super::document::known;
use super::skin::{Joints, Weights};
use super::{ImportError, ImportErrorKind, Result};
use crate::import::ImportOptions;
use crate::scene::SourceMesh;
use gltf::json::accessor::Type;
use gltf::json::mesh::{MorphTarget, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

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
    pub(super) skin: Option<(usize, &'a Arc<Joints>)>,
}

/// Where the file uses a primitive first.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) node: usize,
    pub(super) mesh: usize,
    pub(super) primitive: usize,
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

/// Finds the primitives that make meshes, each once.
pub(super) struct Primitives<'a> {
    accessors: Accessors<'a>,
    normals: bool,
    uvs: bool,
    read: HashMap<Key, usize>,
    opened: Vec<(Place, Opened<'a>)>,
    /// Bytes that those take.
    opened_bytes: u64,
}

/// What the meshes may take.
struct Budget {
    limit: u64,
    spent: AtomicU64,
}

impl Budget {
    fn spend(&self, bytes: u64) -> Result<()> {
        let spent = self.spent.fetch_add(bytes, Ordering::Relaxed) + bytes;
        (spent <= self.limit).then_some(()).ok_or_else(too_large)
    }
}

fn too_large() -> ImportError {
    let what = format!("the meshes take more than {MAX_EXPANSION} times the file's buffers");
    ImportError::new(ImportErrorKind::TooLarge, what)
}

impl<'a> Primitives<'a> {
    pub(super) fn new(accessors: Accessors<'a>, options: &ImportOptions) -> Self {
        Self {
            accessors,
            normals: options.normals,
            uvs: options.uvs,
            read: HashMap::new(),
            opened: Vec::new(),
            opened_bytes: 0,
        }
    }

    pub(super) fn accessors(&self) -> &Accessors<'a> {
        &self.accessors
    }

    /// The number of a primitive's mesh among those that [`decode`](Self::decode) gives; `None` if it has no triangle.
    pub(super) fn read(
        &mut self,
        primitive: &Primitive,
        place: Place,
        deform: Deform<'_>,
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
        let opened = self.open(&key, &targets, skin, primitive)?;
        let elements = opened.element_count();
        if elements < 3 {
            skipped.empty += 1;
            return Ok(None);
        }
        skipped.cut_short += usize::from(mode == 4 && elements % 3 != 0);
        self.opened_bytes += opened.owned_bytes();
        if self.opened_bytes > self.limit() {
            return Err(too_large());
        }
        let mesh = self.opened.len();
        self.opened.push((place, opened));
        self.read.insert(key, mesh);
        Ok(Some(mesh))
    }

    /// Reads all meshes, on the current rayon pool. `within` names the place of an error.
    pub(super) fn decode(
        self,
        within: impl Fn(Place, ImportError) -> ImportError + Sync,
    ) -> Result<Vec<SourceMesh>> {
        let budget = Budget {
            limit: self.limit(),
            spent: AtomicU64::new(self.opened_bytes),
        };
        let decode = |(place, opened): (Place, Opened<'_>)| {
            // Nothing more is read once too much was.
            budget.spend(0)?;
            let mesh = opened.decode().map_err(|error| within(place, error))?;
            budget.spend(mesh.byte_count())?;
            Ok(mesh)
        };
        // All results first: of several errors it is always the first one that is told.
        let meshes: Vec<Result<_>> = self.opened.into_par_iter().map(decode).collect();
        meshes.into_iter().collect()
    }

    /// How many bytes the file's meshes may take.
    fn limit(&self) -> u64 {
        FREE_BYTES + MAX_EXPANSION * self.accessors.source_bytes()
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

    /// Opens all accessors of a primitive.
    fn open(
        &self,
        key: &Key,
        targets: &[(f32, &MorphTarget)],
        skin: Option<(usize, &Arc<Joints>)>,
        primitive: &Primitive,
    ) -> Result<Opened<'a>> {
        let positions = self.accessors.open(key.position, Type::Vec3)?;
        let vertex_count = positions.count();
        let indices = key
            .indices
            .map(|accessor| Ok((accessor, self.accessors.open(accessor, Type::Scalar)?)))
            .transpose()?;
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
        let vectors = |accessor: Option<Index<Accessor>>| {
            let elements = accessor.map(|accessor| parallel(accessor, Type::Vec3));
            elements.transpose()
        };
        let target = |&(weight, target): &(f32, &MorphTarget)| {
            let normals = target.normals.filter(|_| key.normal.is_some());
            Ok((weight, vectors(target.positions)?, vectors(normals)?))
        };
        let skin = skin.map(|(_, joints)| Ok((joints.clone(), weights(primitive, &parallel)?)));
        Ok(Opened {
            position: key.position,
            mode: key.mode,
            indices,
            normals: vectors(key.normal)?,
            uvs: key.uv.map(|uv| parallel(uv, Type::Vec2)).transpose()?,
            targets: targets.iter().map(target).collect::<Result<_>>()?,
            skin: skin.transpose()?,
            positions,
        })
    }
}

/// The sets of joints and weights of a skinned primitive.
fn weights<'a>(
    primitive: &Primitive,
    open: &impl Fn(Index<Accessor>, Type) -> Result<Elements<'a>>,
) -> Result<Vec<Weights<'a>>> {
    let mut sets = Vec::new();
    for set in 0.. {
        let (Some(joint), Some(weight)) = (
            attribute(primitive, Semantic::Joints(set)),
            attribute(primitive, Semantic::Weights(set)),
        ) else {
            break;
        };
        sets.push(Weights {
            joints: open(joint, Type::Vec4)?,
            weights: open(weight, Type::Vec4)?,
        });
    }
    Ok(sets)
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
