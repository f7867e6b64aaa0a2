//! Turns and powers that are the same bits on every platform: the system's own differ in the last place.
//! What is generated uses these, and glam's f64 types, whose arithmetic is that of the source on all of
//! them (its f32 types go through each platform's SIMD).

use glam::{DQuat, DVec3, Quat};

/// Sine and cosine of an angle in radians.
pub fn sin_cos(angle: f64) -> (f64, f64) {
    libm::sincos(angle)
}

/// `base` to the power `exponent`.
pub fn pow(base: f64, exponent: f64) -> f64 {
    libm::pow(base, exponent)
}

/// Counter-clockwise about an axis of unit length, for someone whom it points at.
pub fn turn(axis: DVec3, angle: f64) -> DQuat {
    let (sin, cos) = sin_cos(0.5 * angle);
    let v = axis * sin;
    DQuat::from_xyzw(v.x, v.y, v.z, cos)
}

/// Counter-clockwise seen from above.
pub fn turn_y(angle: f64) -> DQuat {
    turn(DVec3::Y, angle)
}

/// A point at a distance from the y axis, in a direction: 0 is +x, a quarter turn +z.
pub fn polar(distance: f64, direction: f64) -> DVec3 {
    let (sin, cos) = sin_cos(direction);
    DVec3::new(distance * cos, 0.0, distance * sin)
}

/// [`turn_y`] in f32.
pub fn turn_y_f32(angle: f32) -> Quat {
    rounded(turn_y(f64::from(angle)))
}

/// A rotation in f32.
pub fn rounded(rotation: DQuat) -> Quat {
    let [x, y, z, w] = rotation.to_array().map(|x| x as f32);
    Quat::from_xyzw(x, y, z, w)
}

/// [`sin_cos`] in f32.
pub fn sin_cos_f32(angle: f32) -> (f32, f32) {
    let (sin, cos) = sin_cos(f64::from(angle));
    (sin as f32, cos as f32)
}
