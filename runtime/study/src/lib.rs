//! hroc-study.
