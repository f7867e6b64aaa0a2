//! Camera paths of the generated scenes: a few places and what to look at, with a smooth way between.

use glam::{DQuat, DVec3};

use super::trig::turn;
use crate::camera_path::{CameraPath, Key, ProjectionKind};

/// Every path takes this long.
const DURATION_S: f64 = 10.0;
/// Keys along it: ten a second, between which the way is straight.
const KEYS: u32 = 100;
/// Full vertical field of view, 60 degrees.
const FOV_Y_RAD: f64 = std::f64::consts::FRAC_PI_3;

/// A moment of a route.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// Seconds from the start; the first is 0, the last 10.
    pub t_s: f64,
    /// Where the eye is.
    pub eye: DVec3,
    /// What it looks at; not the eye itself.
    pub target: DVec3,
}

/// A stop.
pub fn stop(t_s: f64, eye: DVec3, target: DVec3) -> Stop {
    Stop { t_s, eye, target }
}

/// The path through the stops, which rest neither eye nor target: both follow a cubic Hermite curve with
/// the tangents of Catmull and Rom for uneven times, limited so that neither overshoots.
pub fn route(near: f64, stops: &[Stop]) -> CameraPath {
    let keys = (0..=KEYS).map(|i| {
        let t_s = DURATION_S * f64::from(i) / f64::from(KEYS);
        let eye = along(stops, t_s, |stop| stop.eye);
        let target = along(stops, t_s, |stop| stop.target);
        key(t_s, eye, looking_along(target - eye))
    });
    CameraPath::new(ProjectionKind::Perspective, near, None, keys.collect())
        .expect("stops are finite and in order")
}

/// The curve through one point of each stop.
fn along(stops: &[Stop], t_s: f64, point: impl Fn(&Stop) -> DVec3) -> DVec3 {
    let after = stops
        .partition_point(|stop| stop.t_s <= t_s)
        .clamp(1, stops.len() - 1);
    let (a, b) = (&stops[after - 1], &stops[after]);
    let slope = |i: usize| {
        let velocity = |a: &Stop, b: &Stop| (point(b) - point(a)) / (b.t_s - a.t_s);
        if i == 0 || i + 1 == stops.len() {
            return DVec3::ZERO;
        }
        let (before, next) = (
            velocity(&stops[i - 1], &stops[i]),
            velocity(&stops[i], &stops[i + 1]),
        );
        // Fritsch and Carlson 1980: the harmonic mean where both have a sign, else none.
        DVec3::from_array(std::array::from_fn(|axis| {
            let (p, q) = (before[axis], next[axis]);
            if p * q > 0.0 {
                2.0 * p * q / (p + q)
            } else {
                0.0
            }
        }))
    };
    let step = b.t_s - a.t_s;
    let s = ((t_s - a.t_s) / step).clamp(0.0, 1.0);
    let (s2, s3) = (s * s, s * s * s);
    point(a) * (2.0 * s3 - 3.0 * s2 + 1.0)
        + slope(after - 1) * (step * (s3 - 2.0 * s2 + s))
        + point(b) * (3.0 * s2 - 2.0 * s3)
        + slope(after) * (step * (s3 - s2))
}

fn key(t_s: f64, eye: DVec3, orientation: DQuat) -> Key {
    Key {
        t_s,
        position: eye.to_array(),
        orientation: orientation.to_array(),
        fov_y_rad: Some(FOV_Y_RAD),
        half_height: None,
    }
}

/// The orientation of a level camera that looks along `direction`.
fn looking_along(direction: DVec3) -> DQuat {
    let level = (direction.x * direction.x + direction.z * direction.z).sqrt();
    let yaw = libm::atan2(-direction.x, -direction.z);
    let pitch = libm::atan2(direction.y, level);
    (turn(DVec3::Y, yaw) * turn(DVec3::X, pitch)).normalize()
}
