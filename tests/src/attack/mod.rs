//! An attack on the padding of bounds: what the shaders and the rasterizer compute, with every freedom that the
//! API leaves them in the attacker's hand, and a search for the camera, the box and the roundings that need the
//! most of the padding.

pub mod arithmetic;
pub mod search;
pub mod shaders;
pub mod situation;
