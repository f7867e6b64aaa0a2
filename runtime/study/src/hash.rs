//! Hashes by which a run's inputs are known again: XXH3, 128 bits.

use hroc_format::BakedScene;
use xxhash_rust::xxh3::xxh3_128;

use crate::camera_path::CameraPath;

/// Of a scene's baked file, byte by byte.
pub fn scene(baked: &BakedScene) -> u128 {
    xxh3_128(baked.file_bytes())
}

/// Of a camera path, however its file is laid out.
pub fn path(path: &CameraPath) -> u128 {
    xxh3_128(path.to_json().as_bytes())
}

/// A hash as results have it: 32 hexadecimal digits.
pub fn text(hash: u128) -> String {
    format!("{hash:032x}")
}
