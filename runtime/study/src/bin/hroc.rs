//! hroc
fn main() {}
