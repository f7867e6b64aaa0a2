//! A baked scene on the GPU. The arrays go from the mapped file into buffers byte for byte.

use std::mem::size_of;
use std::sync::Arc;

use bytemuck::{NoUninit, cast_slice};
use glam::DVec3;
use hroc_format::{
    ArchivedObjectBounds, ArchivedScene, BvhNode, Mesh, Object, ObjectBounds, object_flags,
};

use crate::device::DeviceProfile;
use crate::gpu;
use crate::moving::{NO_BOUNDS, archived_bounds};

/// A scene that does not fit the device, or has no such tree.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UploadError {
    /// A buffer is larger than the device allows.
    #[error(
        "{what} of {bytes} bytes exceed this device's limit of {limit} bytes; request the adapter's own limits, or split the scene"
    )]
    TooLarge {
        /// Which array.
        what: &'static str,
        /// Its size.
        bytes: u64,
        /// The limit it breaks.
        limit: u64,
    },
    /// Ids are 32 bits.
    #[error(
        "{moving_capacity} places for moving objects are more than ids for them; ask for fewer"
    )]
    TooManyObjects {
        /// Places asked for.
        moving_capacity: u32,
    },
    /// No tree of this name was baked.
    #[error("no '{wanted}' tree in this scene (it has: {baked}); bake it with --split {wanted}")]
    NoTree {
        /// The split rule asked for.
        wanted: String,
        /// The split rules in the file.
        baked: String,
    },
}

/// The numbers of a scene that a camera needs.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneShape {
    /// World's zero in the source's coordinates.
    pub origin: DVec3,
    /// The zero of each cell in the source's coordinates; the first is world's.
    pub cells: Arc<[DVec3]>,
    /// Largest Euclidean distance of a point of the scene's bounds from world's zero.
    pub radius: f64,
    /// Largest sum of absolute coordinates of such a point.
    pub reach: f64,
    /// Ids of objects are below this: those of the bake, then the places for objects that move.
    pub object_count: u32,
    /// Objects of the bake; they are the leaves of its trees.
    pub static_count: u32,
    /// The grid that the rasterizer moves vertices to, pixels.
    pub subpixel_step_px: f64,
}

impl SceneShape {
    /// The shape of a baked scene on a device with that subpixel step, without objects that move.
    pub fn of(baked: &ArchivedScene, subpixel_step_px: f64) -> Self {
        let corner = |i: usize| {
            let [lo, hi] = [
                baked.bounds.min[i].to_native(),
                baked.bounds.max[i].to_native(),
            ];
            f64::from(lo.abs().max(hi.abs()))
        };
        let far = DVec3::new(corner(0), corner(1), corner(2));
        Self {
            origin: DVec3::from_array(baked.origin.map(|x| x.to_native())),
            cells: baked.cell_origins().into_iter().map(DVec3::from).collect(),
            radius: far.length(),
            reach: far.element_sum(),
            object_count: baked.objects.len() as u32,
            static_count: baked.objects.len() as u32,
            subpixel_step_px,
        }
    }

    /// Nodes of a tree over the baked objects: 2N-1, or 0.
    pub const fn node_count(&self) -> u32 {
        (2 * self.static_count).saturating_sub(1)
    }

    /// Places for objects that move.
    pub const fn moving_capacity(&self) -> u32 {
        self.object_count - self.static_count
    }

    /// 32-bit words of a set of objects.
    pub const fn object_words(&self) -> u32 {
        self.object_count.div_ceil(32)
    }
}

/// Geometry and objects of a baked scene in GPU buffers. Cheap to clone: clones share the buffers.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Size and place.
    pub shape: SceneShape,
    /// The paths that methods take over this scene.
    pub profile: DeviceProfile,
    /// Vertex buffer: object space. See [`Scene::positions_layout`].
    pub positions: wgpu::Buffer,
    /// Positions are four normalized 16-bit numbers, not three f32; object space is the unit cube.
    pub quantized: bool,
    /// Vertex buffer: octahedral normals, see [`Scene::NORMALS`]; `None` where the bake has none.
    pub normals: Option<wgpu::Buffer>,
    /// Index buffer, u32.
    pub indices: wgpu::Buffer,
    /// Storage: `array<Object>` of common/types.wgsl.
    pub objects: wgpu::Buffer,
    /// Storage: `array<ObjectBounds>`; inside out in places without an object.
    pub object_bounds: wgpu::Buffer,
    /// Storage: `array<Mesh>`.
    pub meshes: wgpu::Buffer,
    /// Storage: the class of opaque and masked objects that are there, one bit per object.
    pub opaque: wgpu::Buffer,
    /// Storage: the class of blended objects that are there, one bit per object.
    pub blended: wgpu::Buffer,
    /// Whether there are or were any blended objects.
    pub has_blended: bool,
    /// Counts the changes of objects; lists made of another revision are stale.
    pub revision: u64,
}

impl Scene {
    const POSITIONS: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: 12,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3],
    };
    const QUANTIZED_POSITIONS: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: 8,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Unorm16x4],
    };
    /// Layout of [`Scene::positions`] at shader location 0, a `vec3f` in any case.
    pub const fn positions_layout(&self) -> wgpu::VertexBufferLayout<'static> {
        if self.quantized {
            Self::QUANTIZED_POSITIONS
        } else {
            Self::POSITIONS
        }
    }
    /// Layout of [`Scene::normals`] at shader location 1.
    pub const NORMALS: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: 4,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![1 => Snorm16x2],
    };

    /// Copies a baked scene into buffers of `device`.
    ///
    /// # Errors
    /// If an array breaks a limit of the device.
    pub fn upload(
        device: &wgpu::Device,
        profile: &DeviceProfile,
        baked: &ArchivedScene,
    ) -> Result<Self, UploadError> {
        Self::upload_with_moving(device, profile, baked, 0)
    }

    /// The same with places for `moving_capacity` objects that the host moves, see [`crate::moving`].
    ///
    /// # Errors
    /// If an array breaks a limit of the device.
    pub fn upload_with_moving(
        device: &wgpu::Device,
        profile: &DeviceProfile,
        baked: &ArchivedScene,
        moving_capacity: u32,
    ) -> Result<Self, UploadError> {
        use wgpu::BufferUsages as Usage;
        let normals = cast_slice::<_, u8>(baked.normals.as_slice());
        let quantized = !baked.quantized_positions.is_empty();
        let positions = match quantized {
            true => cast_slice(baked.quantized_positions.as_slice()),
            false => cast_slice(baked.positions.as_slice()),
        };
        let mut shape = SceneShape::of(baked, profile.subpixel_step_px);
        shape.object_count = shape
            .static_count
            .checked_add(moving_capacity)
            .filter(|&count| count < hroc_format::NO_OBJECT)
            .ok_or(UploadError::TooManyObjects { moving_capacity })?;
        let [opaque, blended] = classes(baked, shape.object_words());
        let has_blended = blended.iter().any(|word| *word != 0);
        let object_count = shape.object_count;
        Ok(Self {
            shape,
            profile: profile.clone(),
            quantized,
            positions: upload(device, "vertex positions", positions, 0, Usage::VERTEX)?,
            normals: (!normals.is_empty())
                .then(|| upload(device, "vertex normals", normals, 0, Usage::VERTEX))
                .transpose()?,
            indices: upload(
                device,
                "indices",
                cast_slice(baked.indices.as_slice()),
                0,
                Usage::INDEX,
            )?,
            objects: upload(
                device,
                "objects",
                cast_slice(baked.objects.as_slice()),
                u64::from(object_count) * size_of::<Object>() as u64,
                Usage::STORAGE,
            )?,
            object_bounds: upload(
                device,
                "object bounds",
                // After the larger objects: places beyond the device's limits are refused before these are made.
                cast_slice(&bounds_with_places(baked, moving_capacity)),
                0,
                Usage::STORAGE,
            )?,
            meshes: upload(
                device,
                "meshes",
                cast_slice(baked.meshes.as_slice()),
                0,
                Usage::STORAGE,
            )?,
            opaque: gpu::storage_with(device, "opaque objects", &opaque),
            blended: gpu::storage_with(device, "blended objects", &blended),
            has_blended,
            revision: 0,
        })
    }

    /// Binds positions to vertex slot 0, normals to slot 1 where there are any, and the indices.
    pub fn bind_geometry(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_vertex_buffer(0, self.positions.slice(..));
        if let Some(normals) = &self.normals {
            pass.set_vertex_buffer(1, normals.slice(..));
        }
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
    }

    /// GPU memory of the geometry (positions, normals, indices) and of objects, their bounds and meshes, bytes.
    pub fn memory_bytes(&self) -> [u64; 2] {
        let normals = self.normals.as_ref().map_or(0, wgpu::Buffer::size);
        [
            self.positions.size() + normals + self.indices.size(),
            self.objects.size()
                + self.object_bounds.size()
                + self.meshes.size()
                + self.opaque.size()
                + self.blended.size(),
        ]
    }
}

/// The bounds of a bake's objects, then those of `places` without an object.
fn bounds_with_places(baked: &ArchivedScene, places: u32) -> Vec<ArchivedObjectBounds> {
    let no_bounds = vec![archived_bounds(&NO_BOUNDS); places as usize];
    [baked.object_bounds.as_slice(), &no_bounds].concat()
}

/// The opaque and the blended objects of a bake, one bit per object in `words` words each.
pub(crate) fn classes(baked: &ArchivedScene, words: u32) -> [Vec<u32>; 2] {
    let mut classes = [0, 1].map(|_| vec![0; words as usize]);
    for (object, id) in baked.objects.iter().zip(0u32..) {
        let is_blended = object.flags.to_native() & object_flags::BLENDED != 0;
        classes[usize::from(is_blended)][(id >> 5) as usize] |= 1 << (id & 31);
    }
    classes
}

/// One object-level BVH of a baked scene in GPU buffers. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Name of the split rule that built it.
    pub split: String,
    /// Storage: `array<BvhNode>` of common/types.wgsl.
    pub nodes: wgpu::Buffer,
    /// Storage: parent of each node.
    pub parents: wgpu::Buffer,
    /// Storage: leaf of each object.
    pub leaf_of_object: wgpu::Buffer,
}

impl Tree {
    /// Copies the tree of split rule `split` into buffers of `device`. A scene without objects gives an
    /// empty tree.
    ///
    /// # Errors
    /// If the file has no such tree or an array breaks a limit of the device.
    pub fn upload(
        device: &wgpu::Device,
        baked: &ArchivedScene,
        split: &str,
    ) -> Result<Self, UploadError> {
        let usage = wgpu::BufferUsages::STORAGE;
        let Some(bvh) = baked.bvhs.iter().find(|bvh| bvh.split == split) else {
            if baked.objects.is_empty() {
                let empty = |what| upload(device, what, &[], 0, usage);
                return Ok(Self {
                    split: split.to_owned(),
                    nodes: empty("nodes")?,
                    parents: empty("parents")?,
                    leaf_of_object: empty("leaves")?,
                });
            }
            let baked = baked
                .bvhs
                .iter()
                .map(|bvh| bvh.split.as_str())
                .collect::<Vec<_>>()
                .join(", ");
            return Err(UploadError::NoTree {
                wanted: split.to_owned(),
                baked,
            });
        };
        Ok(Self {
            split: split.to_owned(),
            nodes: upload(
                device,
                "BVH nodes",
                cast_slice(bvh.nodes.as_slice()),
                0,
                usage,
            )?,
            parents: upload(
                device,
                "BVH parents",
                cast_slice(bvh.parents.as_slice()),
                0,
                usage,
            )?,
            leaf_of_object: upload(
                device,
                "BVH leaves",
                cast_slice(bvh.leaf_of_object.as_slice()),
                0,
                usage,
            )?,
        })
    }

    /// GPU memory, bytes.
    pub fn memory_bytes(&self) -> u64 {
        self.nodes.size() + self.parents.size() + self.leaf_of_object.size()
    }
}

const _: () =
    assert!(size_of::<Object>() == 64 && size_of::<Mesh>() == 48 && size_of::<BvhNode>() == 32);
const _: () = assert!(size_of::<ObjectBounds>() == 32);

/// A buffer with `bytes` in it and room for `size` bytes; at least 64, since empty buffers cannot be bound.
fn upload(
    device: &wgpu::Device,
    what: &'static str,
    bytes: &[u8],
    size: u64,
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, UploadError> {
    let size = size.max(bytes.len() as u64).next_multiple_of(4).max(64);
    let limits = device.limits();
    let limit = if usage.contains(wgpu::BufferUsages::STORAGE) {
        limits
            .max_buffer_size
            .min(limits.max_storage_buffer_binding_size)
    } else {
        limits.max_buffer_size
    };
    if size > limit {
        return Err(UploadError::TooLarge {
            what,
            bytes: size,
            limit,
        });
    }
    let usage = usage | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    Ok(gpu::buffer_with(device, what, bytes, size, usage))
}

/// Plain values as an uploadable byte slice.
pub(crate) fn bytes_of<T: NoUninit>(value: &T) -> &[u8] {
    bytemuck::bytes_of(value)
}
