//! Camera paths as runs use them. The file and its keys are `hroc-preprocess`'s, whose generators and
//! importers write it; here are the cameras along a path and the two paths that every scene has.

mod standard;

use hroc_runtime::{Camera, Projection};

pub use hroc_preprocess::camera_path::{CameraPath, Key, PathError, Pose, ProjectionKind};
pub use standard::{Layout, orbit, walk_in};

/// The cameras along a path.
pub trait Cameras {
    /// The camera `t_s` seconds after the first key; before it and after the last one the camera rests.
    fn camera_at(&self, t_s: f64) -> Camera;

    /// The camera of frame `frame` of `frames`, which are spread evenly from the first key to the last.
    fn frame(&self, frame: u32, frames: u32) -> Camera;
}

impl Cameras for CameraPath {
    fn camera_at(&self, t_s: f64) -> Camera {
        let Pose {
            position,
            orientation,
            extent,
        } = self.pose_at(t_s);
        Camera {
            position,
            orientation,
            projection: match self.projection() {
                ProjectionKind::Perspective => Projection::Perspective { fov_y_rad: extent },
                ProjectionKind::Orthographic => Projection::Orthographic {
                    half_height: extent,
                },
            },
            near: self.near(),
            far: self.far(),
            jitter_px: [0.0; 2],
        }
    }

    fn frame(&self, frame: u32, frames: u32) -> Camera {
        let steps = f64::from(frames.saturating_sub(1).max(1));
        self.camera_at(self.duration_s() * f64::from(frame) / steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_reach_from_the_first_key_to_the_last() {
        let key = |t_s: f64, x: f64| Key {
            t_s,
            position: [x, 0.0, 0.0],
            orientation: [0.0, 0.0, 0.0, 1.0],
            fov_y_rad: Some(1.0),
            half_height: None,
        };
        let keys = vec![key(2.0, 0.0), key(5.0, 6.0)];
        let path = CameraPath::new(ProjectionKind::Perspective, 0.1, None, keys).unwrap();
        assert_eq!(path.frame(0, 5), path.camera_at(0.0));
        assert_eq!(path.frame(4, 5), path.camera_at(3.0));
        assert_eq!(path.frame(0, 1), path.camera_at(0.0));
        assert_eq!(path.frame(1, 4).position.x, 2.0);
    }
}
