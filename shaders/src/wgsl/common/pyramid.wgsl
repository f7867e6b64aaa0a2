//!import common/depth
// Ever coarser levels over an image, all in one buffer, level after level: each half as large as the one before,
// rounded up. Texel (x, y) of a level covers (2x, 2y) to (2x + 1, 2y + 1) of the one before, as far as that reaches,
// so every pixel is covered whatever the size.

struct PyramidLevel {
    // Where the level begins in the buffer, and its size.
    first: u32,
    width: u32,
    height: u32,
    reserved: u32,
}
