//!import ioc_test
// iterative_test where the device can be told to test depth before the shader runs.

@fragment @early_depth_test(force)
fn iterative_test_early(fragment: BoxVertex) {
    test_fragment(fragment);
}
