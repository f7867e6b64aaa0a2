//!import mark
// The same, where fragments are counted and objects are marked that pass the depth test.

@fragment
fn fragment_count_marked(surface: Surface) -> Pixel {
    let pixel = shade(surface);
    hroc_mark(surface.object, surface.position);
    return Pixel(vec4f(1.0), pixel.object);
}
