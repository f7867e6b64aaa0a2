//! hroc-runtime.
