//! What a baked file holds. The archived form of every `Pod` struct here is, byte for byte, the
//! struct that the shaders read: arrays of them go from the mapped file to the GPU unchanged.
//!
//! Spaces: *object space* is the mesh's own. *Cell space* has the axes of the source's world and its zero at the
//! origin of a cell ([`Scene::cells`]), so that f32 coordinates keep their precision wherever an object lies.
//! *World* is the space of cell 0, whose origin is [`Scene::origin`]. Lengths are in the source's units.

use crate::schema::schema;

/// "No object": the background of an item buffer.
pub const NO_OBJECT: u32 = u32::MAX;

/// The most cells that a file may have: the cell of a node takes 8 bits, and the last 16 numbers are left for the
/// cells of objects that a host adds.
pub const MAX_CELLS: usize = 240;

/// The most objects that a file may have: the object of a leaf takes 24 bits, and all ones stand for none.
pub const MAX_OBJECTS: usize = 0x00ff_ffff - 1;

schema! {
    /// One drawable: a mesh under one transform. Its id is its index. 64 bytes.
    #[derive(Copy)]
    pod struct Object {
        /// Rows of the 3x4 matrix that takes object space to the space of the object's cell.
        pub world_from_object: [[f32; 4]; 3],
        /// Index into [`Scene::meshes`].
        pub mesh: u32,
        /// Linear RGBA, 8 bits each, red in the lowest byte.
        pub base_color: u32,
        /// [`object_flags`](crate::object_flags).
        pub flags: u32,
        /// Index into [`Scene::cells`].
        pub cell: u32,
    }
}

schema! {
    /// The bounds of an object. `min <= max` in every component. 32 bytes.
    #[derive(Copy)]
    pod struct ObjectBounds {
        /// Smallest corner, in the space of the cell.
        pub min: [f32; 3],
        /// Index into [`Scene::cells`]; the same as the object's.
        pub cell: u32,
        /// Largest corner, in the space of the cell.
        pub max: [f32; 3],
        /// Zero.
        pub reserved: u32,
    }
}

schema! {
    /// An axis-aligned box in world. `min <= max` in every component. 24 bytes.
    #[derive(Copy)]
    pod struct Bounds {
        /// Smallest corner.
        pub min: [f32; 3],
        /// Largest corner.
        pub max: [f32; 3],
    }
}

schema! {
    /// A run of vertices and of triangle indices, shared by the objects that draw it. Meshes cover both
    /// arrays in order, without gaps or overlap. 48 bytes.
    #[derive(Copy)]
    pod struct Mesh {
        /// Smallest corner of the vertices, object space.
        pub min: [f32; 3],
        /// First entry in [`Scene::indices`].
        pub first_index: u32,
        /// Largest corner of the vertices, object space.
        pub max: [f32; 3],
        /// Number of indices: three times the triangles, at least 3.
        pub index_count: u32,
        /// First entry in [`Scene::positions`]; indices count from here.
        pub first_vertex: u32,
        /// Number of vertices; every index of the mesh is below it.
        pub vertex_count: u32,
        /// Zero.
        pub reserved: [u32; 2],
    }
}

schema! {
    /// A node of an object-level BVH, in depth-first order: the left child of interior node `i` is
    /// `i + 1`, the right child is the `skip` of the left one. The subtree of `i` is `i..skip`, which
    /// makes a traversal without a stack. 32 bytes.
    #[derive(Copy)]
    pod struct BvhNode {
        /// Smallest corner, in the space of the node's cell.
        pub min: [f32; 3],
        /// One past the last node of this subtree.
        pub skip: u32,
        /// Largest corner, in the space of the node's cell.
        pub max: [f32; 3],
        /// The cell in the upper 8 bits, the object in the lower 24: see [`BvhNode::cell`] and
        /// [`BvhNode::object`]. This is the leaf-to-object map.
        pub cell_and_object: u32,
    }
}

impl BvhNode {
    /// The lower 24 bits of an interior node.
    pub const INTERIOR: u32 = 0x00ff_ffff;

    /// [`BvhNode::cell_and_object`] of a node of `cell`, which is below 256; a leaf has an `object`.
    pub const fn pack(cell: u32, object: Option<u32>) -> u32 {
        let object = match object {
            Some(object) => object,
            None => Self::INTERIOR,
        };
        cell << 24 | object
    }

    /// Index into [`Scene::cells`]: the cell in whose space the corners are.
    pub const fn cell(&self) -> u32 {
        self.cell_and_object >> 24
    }

    /// The object of a leaf; `None` for an interior node.
    pub const fn object(&self) -> Option<u32> {
        match self.cell_and_object & Self::INTERIOR {
            Self::INTERIOR => None,
            object => Some(object),
        }
    }
}

impl ArchivedBvhNode {
    /// Index into [`Scene::cells`]: the cell in whose space the corners are.
    pub fn cell(&self) -> u32 {
        self.to_native().cell()
    }

    /// The object of a leaf; `None` for an interior node.
    pub fn object(&self) -> Option<u32> {
        self.to_native().object()
    }
}

schema! {
    /// What a tree looks like; computed by the bake so that readers need not.
    #[derive(Copy)]
    pod struct BvhStats {
        /// Edges from the root to the deepest leaf.
        pub depth: u32,
        /// Zero.
        pub reserved: u32,
        /// Mean number of edges from the root to a leaf.
        pub mean_leaf_depth: f64,
        /// The surface area heuristic with both constants 1: the surface areas of all 2N-1 nodes over
        /// the root's, summed. It is the number of nodes a random ray that hits the root visits. A
        /// root without area counts every node in full.
        pub sah_cost: f64,
        /// Sum over interior nodes of the surface area of the intersection of the two children's
        /// boxes, over the root's surface area; 0 for a root without area.
        pub overlap: f64,
    }
}

schema! {
    /// One tree over all objects, leaf size 1: N objects make 2N-1 nodes.
    struct Bvh {
        /// Name of the split rule or builder: `sah`, `middle`, `equal-count`, ...
        pub split: String,
        /// The nodes in depth-first order; the root is node 0.
        pub nodes: Vec<BvhNode>,
        /// The parent of each node; the root's is itself.
        pub parents: Vec<u32>,
        /// For each object the index of its leaf.
        pub leaf_of_object: Vec<u32>,
        /// Depth, cost, overlap.
        pub stats: BvhStats,
    }
}

schema! {
    /// Where an object came from. 12 bytes.
    #[derive(Copy)]
    pod struct ObjectSource {
        /// Index into [`Scene::source_files`].
        pub file: u32,
        /// glTF node index, or the running number of the OBJ group.
        pub node: u32,
        /// Primitive within the glTF mesh; 0 for OBJ.
        pub primitive: u32,
    }
}

schema! {
    /// A camera stored in the source scene.
    struct Camera {
        /// The source's name, or empty.
        pub name: String,
        /// In world.
        pub position: [f64; 3],
        /// Unit quaternion x, y, z, w; the camera looks along its -z, y up.
        pub orientation: [f64; 4],
        /// Full vertical field of view in radians; 0 for an orthographic camera.
        pub fov_y_rad: f32,
        /// Half the height of an orthographic view volume; 0 for a perspective camera.
        pub half_height: f32,
        /// Distance of the near plane.
        pub near: f32,
        /// Distance of the far plane; infinity where the source gives none.
        pub far: f32,
    }
}

schema! {
    /// An input of the bake.
    struct SourceFile {
        /// File name without folders: a bake does not depend on where its input lies.
        pub name: String,
        /// xxh3-64 of its bytes.
        pub hash: u64,
    }
}

schema! {
    /// A file that an input refers to and that the bake looked for: a buffer, a material library.
    struct ReferencedFile {
        /// Its path from the input's folder, as the input spells it.
        pub name: String,
        /// xxh3-64 of its bytes; 0 where there was no such file and the bake went on without.
        pub hash: u64,
        /// Index into [`Scene::source_files`].
        pub by: u32,
    }
}

schema! {
    /// The root of a baked file.
    struct Scene {
        /// The scene's name: the first input's file stem.
        pub name: String,
        /// Program and version that wrote the file.
        pub generator: String,
        /// The options of the bake that decide its bytes, as one JSON object.
        pub settings: String,
        /// The inputs, in the order given.
        pub source_files: Vec<SourceFile>,
        /// The files those refer to, in the order the bake looked for them.
        pub referenced_files: Vec<ReferencedFile>,
        /// Where world's zero lies in the source's coordinates; the same as the first of `cells`.
        pub origin: [f64; 3],
        /// Where the zero of each cell lies in the source's coordinates. At least one, at most [`MAX_CELLS`].
        pub cells: Vec<[f64; 3]>,
        /// World; contains all of `object_bounds`. All zero in an empty scene.
        pub bounds: Bounds,
        /// The objects; ids are indices.
        pub objects: Vec<Object>,
        /// Bounds per object; they contain every vertex as the GPU computes it in f32.
        pub object_bounds: Vec<ObjectBounds>,
        /// Source per object.
        pub object_sources: Vec<ObjectSource>,
        /// End of each object's name in `names`; it starts where the one before ends.
        pub name_ends: Vec<u32>,
        /// All object names one after another, UTF-8.
        pub names: Vec<u8>,
        /// The meshes.
        pub meshes: Vec<Mesh>,
        /// Vertex positions, object space; empty where they are quantized.
        pub positions: Vec<[f32; 3]>,
        /// Quantized vertex positions x, y, z, 0: unsigned normalized 16-bit numbers, so that object space is
        /// the unit cube and the object's matrix does the rest. Empty unless asked for.
        pub quantized_positions: Vec<[u16; 4]>,
        /// Triangle list, relative to each mesh's first vertex.
        pub indices: Vec<u32>,
        /// Unit normals per vertex, octahedral, two signed normalized 16-bit numbers; empty where the
        /// source has none or the bake was told to leave them out.
        pub normals: Vec<[i16; 2]>,
        /// Texture coordinates per vertex; empty unless asked for.
        pub uvs: Vec<[f32; 2]>,
        /// The trees; all over the same objects. Empty for a scene without objects.
        pub bvhs: Vec<Bvh>,
        /// The source's cameras.
        pub cameras: Vec<Camera>,
    }
}
