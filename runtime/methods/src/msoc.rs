//! MSOC: masked software occlusion culling (Hasselgren, Andersson, Akenine-Möller 2016) by the crate hroc-msoc. The CPU
//! walks the tree from front to back, asks about each node, rasterizes occluders as it finds them, and hands the GPU
//! the objects that are not hidden.
//!
//! Which objects are occluders is chosen per frame among those that were not hidden in the last one: those that
//! cover most pixels per triangle, up to a number of triangles. What is blended or has holes hides nothing.
//!
//! Departures: the paper's occluders are meshes made by hand; here they are the objects themselves. Objects that the
//! host moves are unknown to the CPU: from the first change of objects on, nothing is rasterized, and what moves is
//! drawn untested.

use hroc_format::{ArchivedScene, ObjectBounds, object_flags};
use hroc_msoc::hiz::SoftwareHiZ;
use hroc_msoc::{
    Aabb, Affine3, Candidate, Depth, Hierarchy, Matrix4, Mode, Msoc, Node, Occluder,
    OccluderChoice, OccluderMesh, Options, Visibility,
};
use hroc_runtime::twin::bounds::{Box3, relative};
use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FrameContext, FrameUniform, HostSync,
    Projection, Scene, Sets, Stage,
};

use crate::drawn_once::DrawnOnce;
use crate::host_tree::{HostTree, position};
use crate::view::View;

const MASKED_TEST: Stage = Stage::new("masked_test");

/// What the CPU rasterizes with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MsocMode {
    /// Edges moved inward and depths away, so that nothing is hidden that the GPU would show. Exact.
    #[default]
    Inner,
    /// As published. Approximate.
    Paper,
    /// The paper's reference: a software depth buffer of full resolution with a hierarchy of one level. All occluders
    /// first, then every object. Approximate.
    FullResolution,
}

/// A tree as it lies about the eye of a frame.
struct SeenTree<'a> {
    tree: &'a HostTree,
    frame: &'a FrameUniform,
}

impl Hierarchy for SeenTree<'_> {
    fn root(&self) -> Option<u32> {
        (!self.tree.nodes.is_empty()).then_some(0)
    }

    fn node(&self, node: u32) -> Node {
        match self.tree.nodes[node as usize].object {
            Some(object) => Node::Object(object),
            None => Node::Children(self.tree.children(node)),
        }
    }

    fn bounds(&self, node: u32) -> Aabb {
        aabb(self.tree.bounds(self.frame, node))
    }
}

fn aabb(b: Box3) -> Aabb {
    Aabb {
        min: b.min.to_array(),
        max: b.max.to_array(),
    }
}

/// A mesh that objects may be drawn from.
#[derive(Debug, Default)]
struct CpuMesh {
    positions: Vec<[f32; 3]>,
    indices: Vec<[u32; 3]>,
}

#[derive(Clone, Copy, Debug)]
struct CpuObject {
    /// In the space of its cell, as are the rows of the matrix.
    bounds: ObjectBounds,
    cell_from_object: Affine3,
    /// `None`: it hides nothing.
    mesh: Option<u32>,
}

/// What the CPU knows of a scene.
#[derive(Debug)]
struct CpuScene {
    tree: HostTree,
    objects: Vec<CpuObject>,
    meshes: Vec<CpuMesh>,
}

impl CpuScene {
    /// Copies what can hide: meshes of no more than `most_triangles`.
    fn new(baked: &ArchivedScene, split: &str, most_triangles: u64) -> Self {
        let mut used = vec![false; baked.meshes.len()];
        let triangles = |mesh: usize| u64::from(baked.meshes[mesh].index_count.to_native() / 3);
        let objects = baked.objects.iter().zip(baked.object_bounds.iter());
        let objects = objects.map(|(object, bounds)| {
            let solid =
                object.flags.to_native() & (object_flags::MASKED | object_flags::BLENDED) == 0;
            let mesh = object.mesh.to_native();
            let hides = solid && triangles(mesh as usize) <= most_triangles;
            used[mesh as usize] |= hides;
            CpuObject {
                bounds: bounds.to_native(),
                cell_from_object: object
                    .world_from_object
                    .map(|row| row.map(|x| x.to_native())),
                mesh: hides.then_some(mesh),
            }
        });
        let objects = objects.collect();
        let meshes = baked.meshes.iter().zip(used).map(|(mesh, used)| {
            let range = |first: rend::u32_le, count: rend::u32_le| {
                let first = first.to_native() as usize;
                first..first + count.to_native() as usize
            };
            if !used {
                return CpuMesh::default();
            }
            let vertices = range(mesh.first_vertex, mesh.vertex_count);
            let indices = &baked.indices[range(mesh.first_index, mesh.index_count)];
            CpuMesh {
                positions: vertices.map(|vertex| position(baked, vertex)).collect(),
                indices: (indices.chunks_exact(3))
                    .map(|corner| [0, 1, 2].map(|i| corner[i].to_native()))
                    .collect(),
            }
        });
        Self {
            tree: HostTree::new(baked, split),
            meshes: meshes.collect(),
            objects,
        }
    }

    fn occluder(&self, frame: &FrameUniform, object: u32) -> Option<Occluder<'_>> {
        let object = &self.objects[object as usize];
        // As hroc_relative_position does: a single addition, rounded alike.
        let mut rows = object.cell_from_object;
        for (row, zero) in rows
            .iter_mut()
            .zip(frame.cells[object.bounds.cell as usize])
        {
            row[3] += zero;
        }
        let mesh = &self.meshes[object.mesh? as usize];
        Some(Occluder {
            mesh: OccluderMesh {
                positions: &mesh.positions,
                indices: &mesh.indices,
            },
            world_from_object: rows,
        })
    }

    /// The bounds of an object, eye-relative.
    fn bounds(&self, frame: &FrameUniform, object: &CpuObject) -> Aabb {
        let ObjectBounds { min, cell, max, .. } = object.bounds;
        aabb(relative(frame, cell, min, max))
    }

    fn candidate(&self, frame: &FrameUniform, object: u32) -> Option<Candidate> {
        let known = &self.objects[object as usize];
        let mesh = known.mesh;
        Some(Candidate {
            object,
            bounds: self.bounds(frame, known),
            triangles: self.meshes[mesh? as usize].indices.len() as u32,
        })
    }
}

/// What it is made for: another size, near plane or projection needs another.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    size: [u32; 2],
    near: f32,
    depth: Depth,
    mode: Mode,
}

#[derive(Debug)]
enum Software {
    Masked(Msoc),
    /// The second one only measures candidates.
    FullResolution(Box<SoftwareHiZ>, Msoc),
}

/// Masked software occlusion culling, for one view.
#[derive(Debug)]
pub struct MaskedSoftware {
    mode: MsocMode,
    choice: OccluderChoice,
    scene: CpuScene,
    view: View,
    drawn: DrawnOnce,
    software: Option<(Key, Software)>,
    /// Not hidden in the last frame.
    last: Vec<u32>,
    words: Vec<u32>,
    counted: [usize; 2],
}

impl MaskedSoftware {
    /// MSOC over the baked scene behind `scene`, down its tree `split`; `most_triangles` are rasterized per frame.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        baked: &ArchivedScene,
        split: &str,
        depth: DepthConvention,
        mode: MsocMode,
        most_triangles: u64,
    ) -> Self {
        Self {
            mode,
            choice: OccluderChoice {
                triangles: most_triangles,
                ..OccluderChoice::default()
            },
            scene: CpuScene::new(baked, split, most_triangles),
            view: View::new(device, depth),
            drawn: DrawnOnce::new(device, scene, depth),
            software: None,
            last: Vec::new(),
            words: Vec::new(),
            counted: [0; 2],
        }
    }

    /// Queries and occluders of the last frame.
    pub fn counted(&self) -> [usize; 2] {
        self.counted
    }

    fn key(&self, frame: &FrameContext<'_>, uniform: &FrameUniform) -> Key {
        let perspective = matches!(frame.camera.projection, Projection::Perspective { .. });
        let depth = match (perspective, self.view.depth) {
            (true, _) => Depth::InverseW,
            (false, DepthConvention::Reversed) => Depth::Reversed,
            (false, DepthConvention::Standard) => Depth::Standard,
        };
        // As hroc_msoc::inner asks: depth is z_scale + z_offset / w.
        let [z_offset, ..] = uniform.depth_along_ray;
        let roundoff = 0.5_f32.powi(24);
        let depth_tolerance = match (perspective, self.view.depth) {
            (true, DepthConvention::Reversed) => 0.0,
            (true, DepthConvention::Standard) => roundoff / z_offset.abs(),
            (false, _) => 4.0 * roundoff,
        };
        let step = frame.scene.shape.subpixel_step_px;
        Key {
            size: frame.targets.size,
            near: uniform.near,
            depth,
            mode: match self.mode {
                MsocMode::Inner => Mode::Inner {
                    // The finest grid that is no finer than the device's.
                    subpixel_bits: (-step.log2()).floor().clamp(0.0, 16.0) as u8,
                    depth_tolerance: if depth_tolerance.is_finite() {
                        depth_tolerance
                    } else {
                        f32::MAX
                    },
                },
                MsocMode::Paper | MsocMode::FullResolution => Mode::Paper,
            },
        }
    }

    /// The rasterizer for this frame; `None` if no buffer of this size can be.
    fn software(&mut self, key: Key) -> Option<&mut Software> {
        if self.software.as_ref().is_none_or(|(made, _)| *made != key) {
            let options = Options {
                mode: key.mode,
                depth: key.depth,
                near: key.near,
                ..Options::default()
            };
            let masked = Msoc::new(key.size, options).ok()?;
            let software = match self.mode {
                MsocMode::Inner | MsocMode::Paper => Software::Masked(masked),
                MsocMode::FullResolution => {
                    let full = SoftwareHiZ::new(key.size, &options).ok()?;
                    Software::FullResolution(Box::new(full), masked)
                }
            };
            self.software = Some((key, software));
        }
        self.software.as_mut().map(|(_, software)| software)
    }

    /// Finds the objects that are not hidden. `None`: nothing can be told.
    fn test(&mut self, key: Key, frame: &FrameUniform, changed: bool) -> Option<Vec<u32>> {
        let clip_from_relative: &Matrix4 = &frame.clip_from_relative;
        let last = std::mem::take(&mut self.last);
        let choice = self.choice;
        self.software(key)?;
        let (Some((_, software)), scene) = (&mut self.software, &self.scene) else {
            return None;
        };
        let candidates = last
            .iter()
            .filter_map(|&object| scene.candidate(frame, object));
        let candidates = candidates.take(if changed { 0 } else { usize::MAX });
        match software {
            Software::Masked(masked) => {
                let mut occluders =
                    masked.choose_occluders(clip_from_relative, candidates, &choice);
                occluders.sort_unstable();
                masked.clear();
                let seen = SeenTree {
                    tree: &scene.tree,
                    frame,
                };
                let found = masked.traverse(clip_from_relative, &seen, None, |object| {
                    let chosen = occluders.binary_search(&object).is_ok();
                    chosen.then(|| scene.occluder(frame, object)).flatten()
                });
                let found = found.ok()?;
                self.counted = [found.queries, found.occluders];
                Some(found.visible)
            }
            Software::FullResolution(full, masked) => {
                let occluders = masked.choose_occluders(clip_from_relative, candidates, &choice);
                full.clear();
                for &object in &occluders {
                    if let Some(occluder) = scene.occluder(frame, object) {
                        full.rasterize(clip_from_relative, &[occluder]).ok()?;
                    }
                }
                full.reduce();
                self.counted = [scene.objects.len(), occluders.len()];
                let visible = (0u32..).zip(&scene.objects).filter(|(_, object)| {
                    let bounds = scene.bounds(frame, object);
                    full.query_box(clip_from_relative, &bounds) == Visibility::Visible
                });
                Some(visible.map(|(id, _)| id).collect())
            }
        }
    }
}

impl CullingMethod for MaskedSoftware {
    fn name(&self) -> &'static str {
        "msoc"
    }

    fn host_sync(&self) -> HostSync {
        HostSync::Never
    }

    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError> {
        let uniform = self.view.begin(frame)?;
        let shape = &frame.scene.shape;
        let key = self.key(frame, &uniform);
        let (queue, changed) = (frame.queue, frame.scene.revision != 0);
        // The observer's clock runs while the CPU works.
        frame.stage(MASKED_TEST, |_| {
            self.words.clear();
            match self.test(key, &uniform, changed) {
                Some(visible) => {
                    self.words.resize(shape.object_words() as usize, 0);
                    for &id in &visible {
                        self.words[(id >> 5) as usize] |= 1 << (id & 31);
                    }
                    for id in shape.static_count..shape.object_count {
                        self.words[(id >> 5) as usize] |= 1 << (id & 31);
                    }
                    self.last = visible;
                }
                None => self.words.resize(shape.object_words() as usize, u32::MAX),
            }
            queue.write_buffer(&self.drawn.members, 0, bytemuck::cast_slice(&self.words));
        });
        self.drawn.draw(frame, drawer);
        self.drawn.draw_blended(frame, drawer);
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        self.drawn.sets()
    }

    fn depth(&self) -> DepthConvention {
        self.view.depth
    }

    fn reset(&mut self, _encoder: &mut wgpu::CommandEncoder) {
        self.last.clear();
    }

    fn memory_bytes(&self) -> u64 {
        self.view.frame.size() + self.drawn.memory_bytes()
    }
}
