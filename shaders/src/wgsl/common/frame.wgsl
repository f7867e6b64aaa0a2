// What a frame's stages know of the camera; hroc_runtime::FrameUniform. Positions in shaders are eye-relative: they have
// the axes of the source's world and their zero within half a grid step of the eye, at `eye_high + eye_low`. Where the
// numbers come from is derived in runtime/src/frame_uniform.rs.
struct Frame {
    clip_from_relative: mat4x4f,
    // Inward unit normals and offsets: dot(n, p) + d >= 0 inside. Left, right, bottom, top, near, far.
    planes: array<vec4f, 6>,
    // view depth of p = dot(forward.xyz, p) + forward.w, from the eye's plane along the view.
    forward: vec4f,
    // Ray through pixel coordinate (x, y): origin + x * origin_dx + y * origin_dy, and likewise the
    // direction, scaled so that the ray parameter is the view depth.
    ray_origin: vec3f,
    // Half-width by which the bounds that rays are tested against grow, whatever their distance.
    padding_everywhere: f32,
    ray_origin_dx: vec3f,
    // The same per unit of the box's farthest view depth.
    padding_per_depth: f32,
    ray_origin_dy: vec3f,
    // The ray parameter at the near plane.
    near: f32,
    ray_direction: vec3f,
    object_count: u32,
    ray_direction_dx: vec3f,
    node_count: u32,
    ray_direction_dy: vec3f,
    // Tolerance of a depth comparison with a surface in a box that is entered at clip w: tolerance + over_nearest / view
    // depth of the box's nearest point + (over_w + reach_over_w * reach along the view) / w, and a share of the depth.
    depth_tolerance: f32,
    // Clip z and w along a ray are linear in its parameter t: z = x + y * t, w = z + w * t.
    depth_along_ray: vec4f,
    depth_tolerance_over_w: f32,
    depth_tolerance_over_nearest: f32,
    // Render target size in pixels.
    size: vec2u,
    // By how much more the boxes grow that are rasterized: whatever their distance, and per unit of the box's farthest
    // view depth.
    box_padding_everywhere: f32,
    box_padding_per_depth: f32,
    // Objects of the baked scene, the leaves of its trees; those from here on move.
    static_count: u32,
    depth_tolerance_reach_over_w: f32,
    // Where the zero of eye-relative positions lies in the source's coordinates: the f64 number as two f32.
    eye_high: vec3f,
    // Half-width by which bounds grow per unit of their reach, the largest sum of absolute coordinates of a corner.
    padding_per_reach: f32,
    eye_low: vec3f,
    // The same for the boxes that are rasterized.
    box_padding_per_reach: f32,
    // From the zero of eye-relative positions to that of each cell; w unused.
    cells: array<vec4f, 256>,
}

// The one binding that is not declared beside an entry point: every stage that imports this has it here.
@group(0) @binding(0) var<uniform> frame: Frame;
