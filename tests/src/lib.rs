//! hroc-tests.
