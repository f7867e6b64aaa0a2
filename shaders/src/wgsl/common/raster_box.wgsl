//!import common/bounds
// The padded bounds of something as a box to rasterize, for stages that ask which of its pixels the occlusion
// map does not hide. Only boxes that `rasterized_area` has an area for may come here.

struct BoxVertex {
    @builtin(position) position: vec4f,
    // What the box stands for.
    @location(0) @interpolate(flat, either) subject: u32,
    // The depth of the box's nearest point, rounded toward visible: `shows` tells whether anything in it may.
    @location(1) @interpolate(flat, either) earliest: f32,
}

// Pixels that the rasterized box of a padded one covers; negative where no rasterized box can stand for it.
fn rasterized_area(box: Box) -> f32 {
    let outer = rasterized(box);
    if (touches_near(outer)) {
        return -1.0;
    }
    let footprint = footprint(outer);
    return select(footprint.area_px, -1.0, footprint.farthest_ndc > LARGEST_NDC);
}

fn earliest_in(box: Box) -> f32 {
    let nearest = nearest_entry(box);
    return earliest_depth(nearest, depth_tolerance(box, nearest));
}

// The padded box as one strip of 14 vertices; each mask holds one coordinate of the corners. Front faces wind
// counter-clockwise in y-up clip space.
fn raster_box(box: Box, vertex: u32, subject: u32) -> BoxVertex {
    let outer = rasterized(box);
    let bit = 1u << vertex;
    let corner = select(outer.min, outer.max, vec3<bool>((0x287au & bit) != 0u, (0x02afu & bit) != 0u, (0x31e3u & bit) != 0u));
    let clip = frame.clip_from_relative * vec4f(corner, 1.0);
    let earliest = earliest_in(box);
    // No box touches the near plane, so w > 0, and the division is made here: with w = 1 all vertices have
    // the same depth in every bit, and nothing is left to interpolate. The margin is for what
    // `shows` adds for the map's depth, and as much for a rasterizer that clips or weighs equal depths with rounding.
    let margin = 2.0 * DEPTH_TOLERANCE_RELATIVE;
    let depth = earliest * select(1.0 - margin, 1.0 + margin, REVERSED_DEPTH);
    return BoxVertex(vec4f(clip.xy / clip.w, clamp(depth, 0.0, 1.0), 1.0), subject, earliest);
}
