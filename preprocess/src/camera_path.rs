//! Camera paths: where each frame of a run is seen from.
//!
//! A path is keys in time, linear between positions, spherically linear between orientations. Its file is
//! JSON, version 1, documented in the study's README.md. Positions are in the source scene's coordinates.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::whole_file;

/// The one version of the file that this program reads.
pub const VERSION: u32 = 1;
/// No path needs more; keeps a wrong file name from filling the memory.
const MAX_FILE_BYTES: u64 = 64 << 20;

/// Which view volume all keys of a path have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ProjectionKind {
    /// A pyramid; keys give `fov_y_rad`.
    Perspective,
    /// A box; keys give `half_height`.
    Orthographic,
}

/// A camera at a moment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// Seconds; increases from key to key.
    pub t_s: f64,
    /// In the source scene's coordinates and units.
    pub position: [f64; 3],
    /// Unit quaternion x, y, z, w from camera to world; the camera looks along its -z, y up.
    pub orientation: [f64; 4],
    /// Perspective: full vertical field of view, radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fov_y_rad: Option<f64>,
    /// Orthographic: half the height of the view volume, in the source's units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub half_height: Option<f64>,
}

/// Where a path's camera is between keys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// In the source scene's coordinates.
    pub position: DVec3,
    /// Unit quaternion from camera to world axes.
    pub orientation: DQuat,
    /// Perspective: full vertical field of view, radians. Orthographic: half the view volume's height.
    pub extent: f64,
}

/// A camera path, checked: every camera on it can be drawn with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPath {
    version: u32,
    projection: ProjectionKind,
    near: f64,
    #[serde(default)]
    far: Option<f64>,
    keys: Vec<Key>,
}

/// A path that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PathError {
    /// The file cannot be read.
    #[error("{}: cannot read the camera path: {source}; name a file, walk-in or orbit", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Too long to be a camera path.
    #[error("{}: {bytes} bytes are too many for a camera path (at most {MAX_FILE_BYTES})", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its length.
        bytes: u64,
    },
    /// Not JSON, or not of this shape.
    #[error("{}: not a camera path: {source}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Where and what.
        source: serde_json::Error,
    },
    /// Written for another version.
    #[error("{}: camera path of version {found}, but this program reads version {VERSION}", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// The version in it.
        found: u64,
    },
    /// A value that no camera can have.
    #[error("{}: {problem}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Which value, and what it must be.
        problem: String,
    },
}

impl CameraPath {
    /// A path from its parts.
    ///
    /// # Errors
    /// What is wrong with a value, and where.
    pub fn new(
        projection: ProjectionKind,
        near: f64,
        far: Option<f64>,
        keys: Vec<Key>,
    ) -> Result<Self, String> {
        let path = Self {
            version: VERSION,
            projection,
            near,
            far,
            keys,
        };
        path.check()?;
        Ok(path)
    }

    /// Reads a path's file.
    ///
    /// # Errors
    /// If the file cannot be read, is of another version, or holds a value no camera can have.
    pub fn load(path: &Path) -> Result<Self, PathError> {
        let io = |source| PathError::Io {
            path: path.into(),
            source,
        };
        let metadata = fs::metadata(path).map_err(io)?;
        if !metadata.is_file() {
            return Err(io(std::io::Error::other("not a regular file")));
        }
        if metadata.len() > MAX_FILE_BYTES {
            return Err(PathError::TooLarge {
                path: path.into(),
                bytes: metadata.len(),
            });
        }
        Self::parse(&fs::read(path).map_err(io)?, path)
    }

    /// Reads a path from the bytes of its file, which may begin with a byte-order mark; `file` is for the error.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn parse(json: &[u8], file: &Path) -> Result<Self, PathError> {
        #[derive(Deserialize)]
        struct Versioned {
            version: u64,
        }
        let not_json = |source| PathError::Json {
            path: file.into(),
            source,
        };
        let json = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
        // First and alone: another version may have other fields.
        let Versioned { version } = serde_json::from_slice(json).map_err(not_json)?;
        if version != u64::from(VERSION) {
            return Err(PathError::Version {
                path: file.into(),
                found: version,
            });
        }
        let path: Self = serde_json::from_slice(json).map_err(not_json)?;
        path.check().map_err(|problem| PathError::Value {
            path: file.into(),
            problem,
        })?;
        Ok(path)
    }

    /// The file's text.
    pub fn to_json(&self) -> String {
        let mut json = serde_json::to_string_pretty(self).expect("numbers and lists become JSON");
        json.push('\n');
        json
    }

    /// Writes the path's file, whole or not at all.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn save(&self, path: &Path) -> std::io::Result<()> {
        whole_file::write(path, |out| out.write_all(self.to_json().as_bytes()))
    }

    /// Seconds from the first key to the last.
    pub fn duration_s(&self) -> f64 {
        self.keys[self.keys.len() - 1].t_s - self.keys[0].t_s
    }

    /// Which view volume all keys have.
    pub fn projection(&self) -> ProjectionKind {
        self.projection
    }

    /// Distance of the near plane; above 0.
    pub fn near(&self) -> f64 {
        self.near
    }

    /// Distance of the far plane; `None` is infinity.
    pub fn far(&self) -> Option<f64> {
        self.far
    }

    /// The keys, at least one, in order of time.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// The pose `t_s` seconds after the first key; before it and after the last one the camera rests.
    pub fn pose_at(&self, t_s: f64) -> Pose {
        let t = self.keys[0].t_s + t_s;
        let after = self.keys.partition_point(|key| key.t_s <= t);
        let [a, b] =
            [after.saturating_sub(1), after.min(self.keys.len() - 1)].map(|i| &self.keys[i]);
        let share = if b.t_s > a.t_s {
            ((t - a.t_s) / (b.t_s - a.t_s)).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let [from, to] = [a, b].map(|key| DQuat::from_array(key.orientation).normalize());
        let (from_extent, to_extent) = (self.extent(a), self.extent(b));
        Pose {
            position: DVec3::from_array(a.position).lerp(DVec3::from_array(b.position), share),
            orientation: from.slerp(to, share).normalize(),
            extent: from_extent + (to_extent - from_extent) * share,
        }
    }

    /// What the projection takes from a key.
    fn extent(&self, key: &Key) -> f64 {
        let extent = match self.projection {
            ProjectionKind::Perspective => key.fov_y_rad,
            ProjectionKind::Orthographic => key.half_height,
        };
        extent.expect("checked with the path")
    }

    fn check(&self) -> Result<(), String> {
        if !(self.near.is_finite() && self.near > 0.0) {
            return Err(format!("near is {}; it must be above 0", self.near));
        }
        if let Some(far) = self.far
            && !(far.is_finite() && far > self.near)
        {
            return Err(format!(
                "far is {far}; it must be above near ({}), or null",
                self.near
            ));
        }
        if self.keys.is_empty() {
            return Err("keys is empty; a path needs at least one".into());
        }
        for (i, key) in self.keys.iter().enumerate() {
            self.check_key(key)
                .map_err(|problem| format!("keys[{i}].{problem}"))?;
            if i > 0 && key.t_s <= self.keys[i - 1].t_s {
                let before = self.keys[i - 1].t_s;
                return Err(format!(
                    "keys[{i}].t_s is {}; it must be above the {before} before it",
                    key.t_s
                ));
            }
        }
        Ok(())
    }

    fn check_key(&self, key: &Key) -> Result<(), String> {
        if !key.t_s.is_finite() {
            return Err("t_s is not finite".into());
        }
        if key.position.iter().any(|x| !x.is_finite()) {
            return Err("position is not finite".into());
        }
        let length = DQuat::from_array(key.orientation).length();
        let is_unit = (length - 1.0).abs() <= 1e-3;
        if !is_unit {
            return Err(format!(
                "orientation has length {length}; a unit quaternion x, y, z, w is needed"
            ));
        }
        match (self.projection, key.fov_y_rad, key.half_height) {
            (ProjectionKind::Perspective, Some(fov), None)
                if fov > 0.0 && fov < std::f64::consts::PI =>
            {
                Ok(())
            }
            (ProjectionKind::Perspective, Some(fov), None) => {
                Err(format!("fov_y_rad is {fov}; it must lie between 0 and pi"))
            }
            (ProjectionKind::Orthographic, None, Some(half)) if half > 0.0 && half.is_finite() => {
                Ok(())
            }
            (ProjectionKind::Orthographic, None, Some(half)) => {
                Err(format!("half_height is {half}; it must be above 0"))
            }
            (ProjectionKind::Perspective, ..) => Err(
                "fov_y_rad must be there, and no half_height, as the projection is perspective"
                    .into(),
            ),
            (ProjectionKind::Orthographic, ..) => Err(
                "half_height must be there, and no fov_y_rad, as the projection is orthographic"
                    .into(),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn key(t_s: f64, x: f64, yaw: f64) -> Key {
        Key {
            t_s,
            position: [x, 0.0, 0.0],
            orientation: DQuat::from_rotation_y(yaw).to_array(),
            fov_y_rad: Some(1.0),
            half_height: None,
        }
    }

    fn path() -> CameraPath {
        let keys = vec![
            key(2.0, 0.0, 0.0),
            key(4.0, 10.0, FRAC_PI_2),
            key(5.0, 10.0, FRAC_PI_2),
        ];
        CameraPath::new(ProjectionKind::Perspective, 0.1, None, keys).unwrap()
    }

    #[test]
    fn between_keys_positions_are_linear_and_orientations_turn_evenly() {
        let pose = path().pose_at(0.5);
        assert!((pose.position.x - 2.5).abs() < 1e-12);
        assert!(
            pose.orientation
                .angle_between(DQuat::from_rotation_y(FRAC_PI_2 / 4.0))
                < 1e-6
        );
        assert_eq!(path().pose_at(-1.0), path().pose_at(0.0));
        assert_eq!(path().pose_at(99.0).position.x, 10.0);
    }

    #[test]
    fn json_round_trip() {
        let json = path().to_json();
        assert_eq!(
            CameraPath::parse(json.as_bytes(), Path::new("p")).unwrap(),
            path()
        );
    }

    #[test]
    fn errors_name_the_place() {
        let message = |json: &str| {
            CameraPath::parse(json.as_bytes(), Path::new("p.json"))
                .unwrap_err()
                .to_string()
        };
        let good = path().to_json();
        for (from, to, expected) in [
            ("\"version\": 1", "\"version\": 7", "version 7"),
            ("\"near\": 0.1", "\"near\": 0", "near is 0"),
            (
                "\"near\": 0.1",
                "\"nearest\": 0.1",
                "unknown field `nearest`",
            ),
            ("\"far\": null", "\"far\": 0.05", "far is 0.05"),
            ("\"t_s\": 4.0", "\"t_s\": 2.0", "keys[1].t_s is 2"),
            (
                "\"fov_y_rad\": 1.0",
                "\"fov_y_rad\": 4.0",
                "keys[0].fov_y_rad is 4",
            ),
            (
                "\"fov_y_rad\": 1.0",
                "\"half_height\": 1.0",
                "keys[0].fov_y_rad must be there",
            ),
            (
                "\"perspective\"",
                "\"fisheye\"",
                "unknown variant `fisheye`",
            ),
            ("{", "", "not a camera path"),
        ] {
            assert!(good.contains(from), "{from}");
            let text = message(&good.replacen(from, to, 1));
            assert!(
                text.starts_with("p.json: ") && text.contains(expected),
                "{text}"
            );
        }
        let empty = r#"{"version":1,"projection":"perspective","near":1,"far":null,"keys":[]}"#;
        assert!(message(empty).contains("keys is empty"));
    }
}
