// The same, where fragments are counted: each that is kept adds one to its pixel.

@fragment
fn fragment_count(surface: Surface) -> Pixel {
    return Pixel(vec4f(1.0), shade(surface).object);
}
