//!import common/object_bounds
//!import common/raster_box
//!import common/pyramid
// hiz_test: every object of the frustum against a depth pyramid: its screen rectangle is compared at the level where
// four texels cover it.

@group(0) @binding(1) var<storage, read> object_bounds: array<ObjectBounds>;
@group(0) @binding(2) var<storage, read_write> found: array<u32>;
@group(0) @binding(3) var<storage, read> levels: array<PyramidLevel>;
@group(0) @binding(4) var<storage, read> pyramid: array<f32>;

// Bounding spheres of the boxes, and not the boxes.
override SPHERES: bool = false;

var<workgroup> words: array<atomic<u32>, 2>;

// A rectangle of the image and the nearest parameter (view depth) of what it stands for.
struct Extent {
    // In [0, 1], y down.
    lo: vec2f,
    hi: vec2f,
    nearest: f32,
    // No rectangle can be told: it touches the near plane or reaches far out.
    is_open: bool,
}

fn box_extent(box: Box) -> Extent {
    let outer = rasterized(box);
    let nearest = nearest_entry(box);
    if (rasterized_area(box) < 0.0) {
        return Extent(vec2f(0.0), vec2f(1.0), nearest, true);
    }
    var lo = vec2f(LARGEST_NDC);
    var hi = vec2f(-LARGEST_NDC);
    for (var corner = 0u; corner < 8u; corner++) {
        let p = select(outer.min, outer.max, vec3<bool>((corner & 1u) != 0u, (corner & 2u) != 0u, (corner & 4u) != 0u));
        let clip = frame.clip_from_relative * vec4f(p, 1.0);
        let ndc = clip.xy / clip.w;
        lo = min(lo, ndc);
        hi = max(hi, ndc);
    }
    return Extent(vec2f(lo.x, -hi.y) * 0.5 + 0.5, vec2f(hi.x, -lo.y) * 0.5 + 0.5, nearest, false);
}

// Of the sphere round the box: bounds of its perspective projection after Mara and McGuire (2013), per axis from
// the two tangents through the eye.
fn sphere_extent(box: Box) -> Extent {
    let outer = rasterized(box);
    let center = (outer.min + outer.max) * 0.5;
    let radius = length(outer.max - center);
    let distance = dot(frame.forward.xyz, center) + frame.forward.w;
    let nearest = max(distance - radius - rounding(outer), frame.near);
    if (distance - radius <= frame.near) {
        return Extent(vec2f(0.0), vec2f(1.0), nearest, true);
    }
    // Clip x and w are linear in the place: of a sphere, x - k w = 0 is tangent where the distance of the center
    // from that plane is the radius. With a = |row_x|^2 and so on this is a quadratic in k.
    let clip = frame.clip_from_relative * vec4f(center, 1.0);
    let m = transpose(frame.clip_from_relative);
    let rr = radius * radius;
    let ww = clip.w * clip.w - rr * dot(m[3].xyz, m[3].xyz);
    var lo = vec2f(0.0);
    var hi = vec2f(0.0);
    for (var axis = 0u; axis < 2u; axis++) {
        let xw = clip[axis] * clip.w - rr * dot(m[axis].xyz, m[3].xyz);
        let xx = clip[axis] * clip[axis] - rr * dot(m[axis].xyz, m[axis].xyz);
        let root = sqrt(max(xw * xw - ww * xx, 0.0));
        lo[axis] = (xw - root) / ww;
        hi[axis] = (xw + root) / ww;
    }
    return Extent(vec2f(lo.x, -hi.y) * 0.5 + 0.5, vec2f(hi.x, -lo.y) * 0.5 + 0.5, nearest, false);
}

fn passes(bounds: ObjectBounds) -> bool {
    let box = padded_bounds(bounds);
    if (!in_frustum(box)) {
        return false;
    }
    var extent = box_extent(box);
    if (SPHERES) {
        extent = sphere_extent(box);
    }
    if (extent.is_open) {
        return true;
    }
    let base = levels[0];
    let size = vec2f(f32(base.width), f32(base.height));
    let last = vec2u(base.width, base.height) - 1u;
    let lo = min(vec2u(max(extent.lo * size, vec2f(0.0))), last);
    let hi = min(vec2u(max(extent.hi * size, vec2f(0.0))), last);
    // The finest level at which the rectangle lies in two by two texels: where the ends, shifted, differ by at
    // most one. Going by the rectangle's length alone picks one level or finds it one too fine.
    let span = max(hi.x - lo.x, hi.y - lo.y);
    var number = 0u;
    if (span > 1u) {
        number = firstLeadingBit(span - 1u);
    }
    let coarsest = arrayLength(&levels) - 1u;
    while (number < coarsest && any((hi >> vec2u(number)) - (lo >> vec2u(number)) > vec2u(1u))) {
        number++;
    }
    let level = levels[number];
    let a = lo >> vec2u(number);
    let b = hi >> vec2u(number);
    let row_0 = level.first + a.y * level.width;
    let row_1 = level.first + b.y * level.width;
    let farthest = farther(
        farther(pyramid[row_0 + a.x], pyramid[row_0 + b.x]),
        farther(pyramid[row_1 + a.x], pyramid[row_1 + b.x]),
    );
    return may_show(box, extent.nearest, farthest);
}

// One invocation per object; a workgroup writes two whole words.
@compute @workgroup_size(64)
fn hiz_test(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) grid: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let block = workgroup.x + workgroup.y * grid.x;
    let object = block * 64u + lane;
    if (object < frame.object_count) {
        let bounds = object_bounds[object];
        if (!is_empty(bounds) && passes(bounds)) {
            atomicOr(&words[lane >> 5u], 1u << (lane & 31u));
        }
    }
    workgroupBarrier();
    let word = block * 2u + lane;
    if (lane < 2u && word < arrayLength(&found)) {
        found[word] = atomicLoad(&words[lane]);
    }
}
