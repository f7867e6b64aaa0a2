//! From a source scene to the baked scene.
