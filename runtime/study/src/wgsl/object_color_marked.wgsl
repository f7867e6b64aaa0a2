//!import mark
// The same, where objects are marked that pass the depth test.

@fragment
fn object_color_marked(surface: Surface) -> Pixel {
    let pixel = shade(surface);
    hroc_mark(surface.object, surface.position);
    return pixel;
}
