//!import object
// The study's own rendering: position and item buffer by hroc's functions, colour by a light at the eye and
// a sky above. Both faces of a surface are drawn and lit alike.

@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var<storage, read> object_bounds: array<ObjectBounds>;
// Eye-relative; w unused.
@group(0) @binding(3) var<uniform> eye: vec4f;

struct Surface {
    @builtin(position) position: vec4f,
    // Eye-relative.
    @location(0) place: vec3f,
    // Not of unit length; zero where the scene has no normals.
    @location(1) normal: vec3f,
    @location(2) @interpolate(flat, either) object: u32,
}

struct Pixel {
    @location(0) color: vec4f,
    @location(1) object: u32,
}

fn surface(p: vec3f, normal: vec3f, id: u32) -> Surface {
    let place = hroc_relative_position(objects[id], p);
    return Surface(hroc_clip_position(place), place, normal, id);
}

@vertex
fn object_vertex(@location(0) p: vec3f, @builtin(instance_index) id: u32) -> Surface {
    return surface(p, vec3f(0.0), id);
}

@vertex
fn object_vertex_with_normal(
    @location(0) p: vec3f,
    @location(1) octahedral: vec2f,
    @builtin(instance_index) id: u32,
) -> Surface {
    // Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors", section 3.
    var n = vec3f(octahedral, 1.0 - abs(octahedral.x) - abs(octahedral.y));
    let fold = max(-n.z, 0.0);
    n.x += select(fold, -fold, n.x >= 0.0);
    n.y += select(fold, -fold, n.y >= 0.0);
    // Normals go by the matrix of cofactors, which needs no inverse and survives singular transforms.
    let x = objects[id].world_from_object_x.xyz;
    let y = objects[id].world_from_object_y.xyz;
    let z = objects[id].world_from_object_z.xyz;
    return surface(p, vec3f(dot(cross(y, z), n), dot(cross(z, x), n), dot(cross(x, y), n)), id);
}

// Unit length, or zero for a vector without a direction, whatever its magnitude.
fn direction(v: vec3f) -> vec3f {
    let largest = max(abs(v.x), max(abs(v.y), abs(v.z)));
    if (!(largest > 0.0)) {
        return vec3f(0.0);
    }
    return normalize(v / largest);
}

// Masked objects have holes, whatever their alpha (for tests: textures are not baked).
override HOLES: bool = false;

fn hole(world: vec3f) -> bool {
    return fract(2.0 * dot(world, vec3f(1.0, 0.9, 0.8))) < 0.5;
}

// What else is discarded: 0, what `hroc_keeps` refuses; 1, what has no finite depth; 2, nothing.
override GUARD: u32 = 0;

fn keeps(surface: Surface) -> bool {
    if (GUARD == 1) {
        return is_finite(surface.position.z);
    }
    return GUARD == 2 || hroc_keeps(object_bounds[surface.object], surface.position);
}

fn shade(surface: Surface) -> Pixel {
    // The derivatives first: they need all four fragments of a quad.
    let facet = direction(cross(dpdx(surface.place), dpdy(surface.place)));
    if (HOLES && (objects[surface.object].flags & OBJECT_MASKED) != 0u && hole(hroc_world_position(surface.place))) {
        discard;
    }
    if (!keeps(surface)) {
        discard;
    }
    let smooth_normal = direction(surface.normal);
    let to_eye = direction(eye.xyz - surface.place);
    var n = select(facet, smooth_normal, any(smooth_normal != vec3f(0.0)));
    n = select(n, -n, dot(n, to_eye) < 0.0);

    let head = dot(n, to_eye);
    let sky = mix(vec3f(0.09, 0.085, 0.08), vec3f(0.33, 0.36, 0.41), 0.5 + 0.5 * n.y);
    let base = unpack4x8unorm(objects[surface.object].base_color).rgb;
    // Objects of one colour differ a little, by the bits of Knuth's multiplicative hash.
    let tone = 0.86 + 0.14 * f32((surface.object * 2654435769u) >> 24u) / 255.0;
    return Pixel(vec4f(base * tone * (sky + 0.52 * head), 1.0), surface.object);
}

@fragment
fn object_color(surface: Surface) -> Pixel {
    return shade(surface);
}

// Blended materials, whatever their alpha, are half transparent here.
@fragment
fn object_color_blended(surface: Surface) -> Pixel {
    let pixel = shade(surface);
    return Pixel(vec4f(pixel.color.rgb, 0.5), pixel.object);
}
