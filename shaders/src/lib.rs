//! hroc-shaders.
