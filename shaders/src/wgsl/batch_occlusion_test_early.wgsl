//!import batch_occlusion_test
// batch_occlusion_test where the device can be told to test depth before the shader runs: fragments of boxes
// that lie behind the map as a whole never come here. The map is attached read-only and sampled as well.
//
// Without the forced test a shader that writes storage would run for every fragment all the same.

@fragment @early_depth_test(force)
fn cast_ray_early(fragment: BoxVertex) {
    test_fragment(fragment);
}
