//! Generated scenes.

mod rng;

pub use rng::Rng;
