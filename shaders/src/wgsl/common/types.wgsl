// The structs that Rust and WGSL share. The baked file holds the first three byte for byte; a test
// compares all of them with their Rust twins by reflection.

// NO_OBJECT: the object of an interior node, and the background of the item buffer.
const NO_OBJECT: u32 = 0xffffffffu;

// hroc_format::object_flags::MASKED: an alpha test cuts holes into the object.
const OBJECT_MASKED: u32 = 1u;

// hroc_format::Object. Rows of the 3x4 matrix that takes object space to world.
struct Object {
    world_from_object_x: vec4f,
    world_from_object_y: vec4f,
    world_from_object_z: vec4f,
    mesh: u32,
    base_color: u32,
    flags: u32,
    reserved: u32,
}

// hroc_format::Mesh.
struct Mesh {
    min: vec3f,
    first_index: u32,
    max: vec3f,
    index_count: u32,
    first_vertex: u32,
    vertex_count: u32,
    reserved_0: u32,
    reserved_1: u32,
}

// hroc_format::Bounds of one object, world.
struct Bounds {
    min: array<f32, 3>,
    max: array<f32, 3>,
}

// hroc_format::BvhNode, in depth-first order: the subtree of node i is i .. skip.
struct BvhNode {
    min: vec3f,
    skip: u32,
    max: vec3f,
    object: u32,
}

// The arguments of one indexed indirect draw.
struct DrawCommand {
    index_count: u32,
    instance_count: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}
