//! The two ways through the city: a walk into a street, and one that turns fast and leaves it backward.

use std::f64::consts::TAU;

use glam::DVec3;

use super::{BLOCK_DEPTH, PLAZA_RADIUS, STREET_WIDTH};
use crate::camera_path::CameraPath;
use crate::generate::route::{route, stop};
use crate::generate::trig::polar;

const EYE: f64 = 1.7;
const NEAR: f64 = 0.1;

/// Radius of the middle of the second ring street.
fn street() -> f64 {
    f64::from(PLAZA_RADIUS + BLOCK_DEPTH + 0.5 * STREET_WIDTH)
}

/// At a distance from the centre, in a direction; 0 is that of an avenue.
fn at(distance: f64, direction: f64, height: f64) -> DVec3 {
    polar(distance, direction) + DVec3::Y * height
}

/// From above a corner of the city, of which `radius` is the extent, down into an avenue, and from it into
/// the ring street, whose fronts close the view.
pub fn walk(radius: f64) -> CameraPath {
    let street = street();
    route(
        NEAR,
        &[
            stop(0.0, at(1.25 * radius, 0.6, 0.75 * radius), DVec3::ZERO),
            stop(
                3.0,
                at(0.85 * radius, 0.15, 0.28 * radius),
                at(0.0, 0.0, 12.0),
            ),
            stop(5.2, at(street + 120.0, 0.0, 7.0), at(street, 0.0, 6.0)),
            stop(
                7.4,
                at(street + 7.0, 0.0, EYE),
                at(street - 14.0, 0.03, 2.5),
            ),
            stop(8.2, at(street, 0.05, EYE), at(street - 1.0, 0.4, 3.0)),
            stop(9.1, at(street, 0.22, EYE), at(street - 1.0, 0.6, 3.0)),
            stop(10.0, at(street, 0.40, EYE), at(street - 1.0, 0.8, 3.0)),
        ],
    )
}

/// Along the ring street with two quick turns, then backward down the avenue and up, out of the city, with
/// a quick look to either side.
pub fn fast(radius: f64) -> CameraPath {
    /// Stops per turn.
    const STEPS: u32 = 8;
    let street = street();
    let mut stops = Vec::new();
    for step in 0..=2 * STEPS {
        let share = f64::from(step) / f64::from(2 * STEPS);
        let eye = at(street, 0.5 * (1.0 - share), EYE);
        // Both at the start and at the end it looks at the centre of the city.
        let heading = TAU * (0.5 - 2.0 * share);
        stops.push(stop(3.2 * share, eye, eye + at(10.0, heading, 0.4)));
    }
    let look = |t_s: f64, distance: f64, height: f64, turned: f64| {
        let eye = at(distance, 0.0, height);
        stop(
            t_s,
            eye,
            eye + at(20.0, 0.5 * TAU + turned, -0.12 * (height - EYE)),
        )
    };
    stops.extend([
        look(4.2, street + 16.0, EYE, 0.0),
        look(4.8, street + 30.0, EYE, 1.2),
        look(5.4, street + 44.0, EYE, -1.2),
        look(6.0, street + 58.0, EYE, 0.0),
        look(7.5, street + 0.35 * (radius - street), 12.0, 0.0),
        look(8.2, street + 0.6 * (radius - street), 40.0, 0.9),
        look(8.9, street + 0.8 * (radius - street), 70.0, -0.9),
        look(10.0, 1.15 * radius, 110.0, 0.0),
    ]);
    route(NEAR, &stops)
}
