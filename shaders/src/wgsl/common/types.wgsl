// The structs that Rust and WGSL share. The baked file holds the first three byte for byte; a test
// compares all of them with their Rust twins by reflection.

// NO_OBJECT: the background of the item buffer.
const NO_OBJECT: u32 = 0xffffffffu;

// hroc_format::object_flags::MASKED: an alpha test cuts holes into the object.
const OBJECT_MASKED: u32 = 1u;

// hroc_format::Object. Rows of the 3x4 matrix that takes object space to the space of the object's cell.
struct Object {
    world_from_object_x: vec4f,
    world_from_object_y: vec4f,
    world_from_object_z: vec4f,
    mesh: u32,
    base_color: u32,
    flags: u32,
    cell: u32,
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

// hroc_format::ObjectBounds, in the space of the cell.
struct ObjectBounds {
    min: vec3f,
    cell: u32,
    max: vec3f,
    reserved: u32,
}

// hroc_format::BvhNode, in depth-first order: the subtree of node i is i .. skip.
struct BvhNode {
    min: vec3f,
    skip: u32,
    max: vec3f,
    cell_and_object: u32,
}

// hroc_format::BvhNode::INTERIOR: the lower 24 bits of an interior node's cell_and_object.
const INTERIOR_NODE: u32 = 0x00ffffffu;

fn node_cell(node: BvhNode) -> u32 {
    return node.cell_and_object >> 24u;
}

fn is_leaf(node: BvhNode) -> bool {
    return (node.cell_and_object & INTERIOR_NODE) != INTERIOR_NODE;
}

// The object of a leaf.
fn node_object(node: BvhNode) -> u32 {
    return node.cell_and_object & INTERIOR_NODE;
}

// The arguments of one indexed indirect draw.
struct DrawCommand {
    index_count: u32,
    instance_count: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}
