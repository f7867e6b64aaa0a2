//! f64 oracles.
