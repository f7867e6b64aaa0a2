// How coarse the groups are, and what last frame's batch occlusion test says about it.
struct Grouping {
    // Interior nodes whose screen rectangle is larger, in pixels, are replaced by their children.
    largest_group_px: f32,
    // Fragments of last frame's groups on a sample of the pixels, and those of them that the map did not hide.
    fragments: atomic<u32>,
    survivors: atomic<u32>,
    reserved: u32,
}
