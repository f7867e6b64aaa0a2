//! The structs that Rust and WGSL share: the same names, offsets and sizes, by reflection; and the constants.

use std::mem::offset_of;

use hroc_format::{
    ArchivedBvhNode, ArchivedMesh, ArchivedObject, ArchivedObjectBounds, BvhNode, NO_OBJECT,
};
use hroc_runtime::FrameUniform;
use hroc_runtime::twin::bounds;

fn module(name: &str) -> naga::Module {
    naga::front::wgsl::parse_str(&hroc_shaders::source(name).unwrap()).unwrap()
}

/// Members of a WGSL struct with their offsets, and its size.
fn members(module: &naga::Module, wanted: &str) -> (Vec<(String, usize)>, usize) {
    let found = module
        .types
        .iter()
        .find(|(_, ty)| ty.name.as_deref() == Some(wanted));
    let naga::TypeInner::Struct { members, span } = &found
        .unwrap_or_else(|| panic!("no struct {wanted}"))
        .1
        .inner
    else {
        panic!("{wanted} is no struct")
    };
    let list = members
        .iter()
        .map(|m| (m.name.clone().unwrap(), m.offset as usize))
        .collect();
    (list, *span as usize)
}

macro_rules! check {
    ($wgsl:ident . $name:literal == $rust:ty { $($field:ident),* $(,)? }) => {
        let expected = (vec![$((stringify!($field).to_owned(), offset_of!($rust, $field))),*], size_of::<$rust>());
        assert_eq!(members(&$wgsl, $name), expected, "{}", $name);
    };
}

#[test]
fn shared_structs_have_one_layout() {
    let bounds = module("extract_groups");
    check!(bounds."BvhNode" == ArchivedBvhNode { min, skip, max, cell_and_object });
    check!(bounds."ObjectBounds" == ArchivedObjectBounds { min, cell, max, reserved });
    check!(bounds."Frame" == FrameUniform {
        clip_from_relative, planes, forward, ray_origin, padding_everywhere, ray_origin_dx, padding_per_depth, ray_origin_dy,
        near, ray_direction, object_count, ray_direction_dx, node_count, ray_direction_dy, depth_tolerance,
        depth_along_ray, depth_tolerance_over_w, depth_tolerance_over_nearest, size,
        box_padding_everywhere, box_padding_per_depth, static_count, depth_tolerance_reach_over_w,
        eye_high, padding_per_reach, eye_low, box_padding_per_reach, cells,
    });
    let pack = module("pack");
    check!(pack."DrawCommand" == wgpu::util::DrawIndexedIndirectArgs { index_count, instance_count, first_index, base_vertex, first_instance });

    // WGSL has no array of rows with the same layout as a matrix, nor padding: these members go by parts.
    let (object, size) = members(&pack, "Object");
    let rows = offset_of!(ArchivedObject, world_from_object);
    let expected = [
        ("world_from_object_x", rows),
        ("world_from_object_y", rows + 16),
        ("world_from_object_z", rows + 32),
        ("mesh", offset_of!(ArchivedObject, mesh)),
        ("base_color", offset_of!(ArchivedObject, base_color)),
        ("flags", offset_of!(ArchivedObject, flags)),
        ("cell", offset_of!(ArchivedObject, cell)),
    ];
    assert_eq!(
        object,
        expected.map(|(name, offset)| (name.to_owned(), offset))
    );
    assert_eq!(size, size_of::<ArchivedObject>());
    let (mesh, size) = members(&pack, "Mesh");
    let expected = [
        ("min", offset_of!(ArchivedMesh, min)),
        ("first_index", offset_of!(ArchivedMesh, first_index)),
        ("max", offset_of!(ArchivedMesh, max)),
        ("index_count", offset_of!(ArchivedMesh, index_count)),
        ("first_vertex", offset_of!(ArchivedMesh, first_vertex)),
        ("vertex_count", offset_of!(ArchivedMesh, vertex_count)),
        ("reserved_0", offset_of!(ArchivedMesh, reserved)),
        ("reserved_1", offset_of!(ArchivedMesh, reserved) + 4),
    ];
    assert_eq!(
        mesh,
        expected.map(|(name, offset)| (name.to_owned(), offset))
    );
    assert_eq!(size, size_of::<ArchivedMesh>());
}

#[test]
fn shared_constants_agree() {
    let module = module("extract_groups");
    let constant = |wanted: &str| {
        let (_, constant) = module
            .constants
            .iter()
            .find(|(_, c)| c.name.as_deref() == Some(wanted))
            .unwrap();
        match module.global_expressions[constant.init] {
            naga::Expression::Literal(naga::Literal::U32(x)) => f64::from(x),
            naga::Expression::Literal(naga::Literal::F32(x)) => f64::from(x),
            ref other => panic!("{wanted}: {other:?}"),
        }
    };
    assert_eq!(constant("NO_OBJECT"), f64::from(NO_OBJECT));
    assert_eq!(constant("INTERIOR_NODE"), f64::from(BvhNode::INTERIOR));
    for (name, twin) in [
        ("SLAB_WIDENING", bounds::SLAB_WIDENING),
        ("DEPTH_TOLERANCE_RELATIVE", bounds::DEPTH_TOLERANCE_RELATIVE),
        ("KEPT_PADDING", bounds::KEPT_PADDING),
        ("KEPT_TOLERANCE", bounds::KEPT_TOLERANCE),
        ("LARGEST_NDC", bounds::LARGEST_NDC),
    ] {
        assert_eq!(constant(name), f64::from(twin), "{name}");
    }
    // Units in the last place of 1.
    assert_eq!(bounds::SLAB_WIDENING, 1.0 + 24.0 * f32::EPSILON);
    assert_eq!(bounds::DEPTH_TOLERANCE_RELATIVE, 24.0 * f32::EPSILON);
}
