//! glTF cameras as camera paths: at rest, moved by each interpolation, by several nodes at once; files of
//! others, where there are some; and what cannot be a path.

use glam::{DQuat, DVec3};
use hroc_preprocess::camera_path::{CameraPath, ProjectionKind};
use hroc_preprocess::import::{CameraChoice, ImportError, camera_path};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::PathBuf;

/// A file in the making: a camera at node 1, below node 0, and animations.
struct File {
    root: Value,
    bin: Vec<u8>,
}

impl File {
    fn new() -> Self {
        let root = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [
                { "name": "dolly", "children": [1], "translation": [10.0, 0.0, 0.0] },
                { "name": "eye", "camera": 0, "translation": [0.0, 2.0, 0.0] },
            ],
            "cameras": [{ "name": "lens", "type": "perspective",
                "perspective": { "yfov": 0.8, "znear": 0.25 } }],
            "accessors": [], "bufferViews": [], "animations": [],
        });
        Self {
            root,
            bin: Vec::new(),
        }
    }

    fn list(&mut self, name: &str) -> &mut Vec<Value> {
        self.root[name].as_array_mut().unwrap()
    }

    fn floats(&mut self, shape: &str, lanes: usize, values: &[f32]) -> usize {
        let offset = self.bin.len();
        self.bin.extend(values.iter().flat_map(|x| x.to_le_bytes()));
        let bytes = self.bin.len() - offset;
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes });
        self.list("bufferViews").push(view);
        let view = self.list("bufferViews").len() - 1;
        self.list("accessors").push(json!({
            "bufferView": view, "componentType": 5126, "count": values.len() / lanes, "type": shape,
        }));
        self.list("accessors").len() - 1
    }

    /// Adds a channel to the one animation.
    fn channel(
        &mut self,
        node: usize,
        path: &str,
        interpolation: &str,
        times: &[f32],
        values: &[f32],
    ) {
        let (shape, lanes) = if path == "rotation" {
            ("VEC4", 4)
        } else {
            ("VEC3", 3)
        };
        let input = self.floats("SCALAR", 1, times);
        let output = self.floats(shape, lanes, values);
        if self.list("animations").is_empty() {
            let empty = json!({ "name": "take", "channels": [], "samplers": [] });
            self.list("animations").push(empty);
        }
        let animation = &mut self.root["animations"][0];
        let samplers = animation["samplers"].as_array_mut().unwrap();
        samplers.push(json!({ "input": input, "output": output, "interpolation": interpolation }));
        let sampler = samplers.len() - 1;
        let target = json!({ "node": node, "path": path });
        let channels = animation["channels"].as_array_mut().unwrap();
        channels.push(json!({ "sampler": sampler, "target": target }));
    }

    fn path_of(&self, choice: CameraChoice<'_>) -> Result<CameraPath, ImportError> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("film.bin"), &self.bin).unwrap();
        let mut root = self.root.clone();
        root["buffers"] = json!([{ "uri": "film.bin", "byteLength": self.bin.len().max(1) }]);
        let file = folder.path().join("film.gltf");
        std::fs::write(&file, root.to_string()).unwrap();
        camera_path(&file, choice).map(|camera| camera.path)
    }

    fn path(&self) -> CameraPath {
        self.path_of(CameraChoice::default())
            .unwrap_or_else(|error| panic!("{error}"))
    }

    fn error(&self) -> String {
        self.path_of(CameraChoice::default())
            .unwrap_err()
            .to_string()
    }
}

fn position(path: &CameraPath, t: f64) -> DVec3 {
    path.pose_at(t).position
}

#[track_caller]
fn assert_near(a: DVec3, b: DVec3, tolerance: f64) {
    assert!(a.abs_diff_eq(b, tolerance), "{a} is not {b}");
}

#[test]
fn a_camera_at_rest_has_one_key() {
    let path = File::new().path();
    assert_eq!(path.keys().len(), 1);
    assert_eq!(path.duration_s(), 0.0);
    assert_eq!(path.projection(), ProjectionKind::Perspective);
    assert_eq!((path.near(), path.far()), (0.25, None));
    assert_eq!(path.keys()[0].fov_y_rad, Some(f64::from(0.8_f32)));
    assert_eq!(position(&path, 3.0), DVec3::new(10.0, 2.0, 0.0));
}

#[test]
fn the_way_is_that_of_the_camera_in_the_baked_scene() {
    let mut file = File::new();
    file.channel(
        1,
        "translation",
        "LINEAR",
        &[0.0, 1.0],
        &[0.0, 2.0, 0.0, 4.0, 2.0, 0.0],
    );
    // The scene is moved; the center is in the axes of the globe.
    file.root["extensions"] = json!({ "CESIUM_RTC": { "center": [4e6, 3.0, 5e6] } });
    let start = DVec3::new(4e6 + 10.0, 5e6 + 2.0, -3.0);
    assert_eq!(position(&file.path(), 0.0), start);
    assert_eq!(position(&file.path(), 1.0), start + 4.0 * DVec3::X);
    // Integers of animations too may be written as floats, and a byte-order mark may come first.
    for (plain, float) in [
        ("\"node\":1", "\"node\":1.0"),
        ("\"input\":0", "\"input\":0e0"),
    ] {
        let text = file.root.to_string();
        assert!(text.contains(plain), "{text}");
        file.root = serde_json::from_str(&text.replace(plain, float)).unwrap();
    }
    assert_eq!(position(&file.path(), 1.0), start + 4.0 * DVec3::X);
    // A parent outside the scene moves nothing.
    file.root["scenes"][0]["nodes"] = json!([1]);
    assert_eq!(position(&file.path(), 0.0), start - 10.0 * DVec3::X);
    let json = format!("\u{feff}{}", file.path().to_json());
    let path = CameraPath::parse(json.as_bytes(), "film.path.json".as_ref()).unwrap();
    assert_eq!(position(&path, 0.0), start - 10.0 * DVec3::X);
}

#[test]
fn an_orthographic_camera_with_near_zero_gets_a_near_plane() {
    let mut file = File::new();
    file.root["cameras"][0] = json!({ "type": "orthographic",
        "orthographic": { "xmag": 4.0, "ymag": 3.0, "znear": 0.0, "zfar": 100.0 } });
    let path = file.path();
    assert_eq!(path.projection(), ProjectionKind::Orthographic);
    assert_eq!(path.keys()[0].half_height, Some(3.0));
    assert!(path.near() > 0.0 && path.near() < 1e-3);
    assert_eq!(path.far(), Some(100.0));
}

#[test]
fn linear_channels_need_no_keys_of_their_own() {
    let mut file = File::new();
    // The parent moves; it starts late and is the path's beginning.
    let values = [0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 4.0, 0.0, 8.0];
    file.channel(0, "translation", "LINEAR", &[1.0, 2.0, 4.0], &values);
    let path = file.path();
    assert_eq!(path.keys().len(), 3);
    assert_eq!(path.duration_s(), 3.0);
    assert_near(position(&path, 0.5), DVec3::new(2.0, 2.0, 0.0), 1e-12);
    assert_near(position(&path, 2.0), DVec3::new(4.0, 2.0, 4.0), 1e-12);
}

#[test]
fn linear_rotations_take_the_short_way() {
    let mut file = File::new();
    let quarter = DQuat::from_rotation_y(FRAC_PI_2).as_quat();
    let [x, y, z, w] = (-quarter).to_array();
    let values = [0.0, 0.0, 0.0, 1.0, x, y, z, w];
    file.channel(1, "rotation", "LINEAR", &[0.0, 2.0], &values);
    let path = file.path();
    let forward = path.pose_at(1.0).orientation * DVec3::NEG_Z;
    let expected = DQuat::from_rotation_y(0.5 * FRAC_PI_2) * DVec3::NEG_Z;
    assert_near(forward, expected, 1e-6);
}

#[test]
fn a_step_jumps_between_two_frames() {
    let mut file = File::new();
    let values = [0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 9.0, 0.0, 0.0];
    file.channel(0, "translation", "STEP", &[0.0, 1.0, 3.0], &values);
    let path = file.path();
    for (t, x) in [
        (0.0, 0.0),
        (0.999_999, 0.0),
        (1.0, 5.0),
        (2.999_999, 5.0),
        (3.0, 9.0),
    ] {
        assert_eq!(position(&path, t).x, x, "at {t}");
    }
}

#[test]
fn a_spline_is_followed_closely() {
    let mut file = File::new();
    // In x from 0 to 1 with tangents 0 and 0, then on with a turn in z: in-tangent, value, out-tangent.
    #[rustfmt::skip]
    let values = [
        0.0, 0.0, 0.0,  0.0, 0.0, 0.0,  0.0, 0.0, 0.0,
        0.0, 0.0, 0.0,  1.0, 0.0, 0.0,  0.0, 0.0, 3.0,
        0.0, 0.0, 0.0,  1.0, 0.0, 2.0,  0.0, 0.0, 0.0,
    ];
    file.channel(0, "translation", "CUBICSPLINE", &[0.0, 2.0, 3.0], &values);
    let path = file.path();
    for i in 0..=200 {
        let t = 3.0 * f64::from(i) / 200.0;
        let expected = if t <= 2.0 {
            let s = t / 2.0;
            DVec3::new(3.0 * s * s - 2.0 * s * s * s, 2.0, 0.0)
        } else {
            let s = t - 2.0;
            let (s2, s3) = (s * s, s * s * s);
            let z = 3.0 * (s3 - 2.0 * s2 + s) + 2.0 * (3.0 * s2 - 2.0 * s3);
            DVec3::new(1.0, 2.0, z)
        };
        assert_near(position(&path, t), expected, 1e-3);
    }
    assert!(path.keys().len() < 200, "{} keys", path.keys().len());
}

#[test]
fn a_turning_parent_swings_the_camera_round() {
    let mut file = File::new();
    file.root["nodes"][0]["translation"] = json!([0.0, 0.0, 0.0]);
    file.root["nodes"][1]["translation"] = json!([3.0, 0.0, 0.0]);
    let turns = [0.0, 0.5 * PI, PI].map(|turn| DQuat::from_rotation_y(turn).as_quat().to_array());
    let times = [0.0, 1.0, 2.0];
    file.channel(0, "rotation", "LINEAR", &times, turns.as_flattened());
    let path = file.path();
    for i in 0..=100 {
        let t = 2.0 * f64::from(i) / 100.0;
        let turn = DQuat::from_rotation_y(0.5 * PI * t);
        assert_near(position(&path, t), turn * DVec3::new(3.0, 0.0, 0.0), 2e-3);
        let pose = path.pose_at(t);
        assert_near(pose.orientation * DVec3::NEG_Z, turn * DVec3::NEG_Z, 1e-3);
    }
}

#[test]
fn scale_moves_the_camera_and_leaves_its_orientation_alone() {
    let mut file = File::new();
    file.channel(
        0,
        "scale",
        "LINEAR",
        &[0.0, 1.0],
        &[1.0, 1.0, 1.0, 3.0, 3.0, 3.0],
    );
    let path = file.path();
    assert_near(position(&path, 1.0), DVec3::new(10.0, 6.0, 0.0), 1e-6);
    assert!(path.pose_at(0.7).orientation.angle_between(DQuat::IDENTITY) < 1e-6);
}

#[test]
fn what_moves_other_nodes_or_other_things_is_ignored() {
    let mut file = File::new();
    file.root["nodes"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "name": "door" }));
    file.channel(
        2,
        "translation",
        "LINEAR",
        &[0.0, 1.0],
        &[0.0, 0.0, 0.0, 3.0, 3.0, 3.0],
    );
    let pointer = json!({ "sampler": 0, "target": { "path": "pointer" } });
    let channels = file.root["animations"][0]["channels"].as_array_mut();
    channels.unwrap().push(pointer);
    assert_eq!(file.path().keys().len(), 1);
}

#[test]
fn cameras_and_animations_are_chosen_by_name() {
    let mut file = File::new();
    let second = json!({ "name": "drone", "camera": 0, "translation": [0.0, 50.0, 0.0] });
    file.root["nodes"].as_array_mut().unwrap().push(second);
    file.root["scenes"][0]["nodes"] = json!([0, 2]);
    let error = file.error();
    assert!(
        error.contains("has 2 cameras") && error.contains("\"eye\", \"drone\""),
        "{error}"
    );
    let choose = |camera| CameraChoice {
        camera: Some(camera),
        animation: None,
    };
    let path = file.path_of(choose("drone")).unwrap();
    assert_eq!(position(&path, 0.0).y, 50.0);
    let error = file.path_of(choose("nobody")).unwrap_err().to_string();
    assert!(
        error.contains("no camera \"nobody\"; name one of \"eye\", \"drone\""),
        "{error}"
    );

    let mut file = File::new();
    file.channel(0, "translation", "STEP", &[0.0], &[7.0, 0.0, 0.0]);
    let mut other = file.root["animations"][0].clone();
    other["name"] = json!("retake");
    file.list("animations").push(other);
    let error = file.error();
    assert!(error.contains("2 animations move the camera"), "{error}");
    let choose = |animation| CameraChoice {
        camera: None,
        animation: Some(animation),
    };
    assert_eq!(
        position(&file.path_of(choose("retake")).unwrap(), 0.0).x,
        7.0
    );
    let error = file.path_of(choose("outtake")).unwrap_err().to_string();
    assert!(error.contains("no animation \"outtake\""), "{error}");
}

/// What a test does to a good file.
type Change<'a> = &'a dyn Fn(&mut Value);

#[test]
fn faults_are_named_with_their_place() {
    let values = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    let with = |change: &dyn Fn(&mut Value)| {
        let mut file = File::new();
        file.channel(0, "translation", "LINEAR", &[0.0, 1.0], &values);
        change(&mut file.root);
        file.error()
    };
    let sampler = |root: &mut Value, name: &str, value: Value| {
        root["animations"][0]["samplers"][0][name] = value;
    };
    let cases: [(Change, &str); 8] = [
        (
            &|root| sampler(root, "interpolation", json!("QUINTIC")),
            "unknown interpolation \"QUINTIC\"",
        ),
        (
            &|root| sampler(root, "interpolation", json!("CUBICSPLINE")),
            "2 values for 2 keyframes, not 6",
        ),
        (
            &|root| sampler(root, "output", json!(9)),
            "accessor 9, which does not exist",
        ),
        (
            &|root| sampler(root, "input", json!(1)),
            "is of type VEC3, not SCALAR",
        ),
        (
            &|root| root["accessors"][0]["count"] = json!(0),
            "has 0 keyframes",
        ),
        (
            &|root| root["animations"][0]["channels"][0]["sampler"] = json!(5),
            "refers to sampler 5",
        ),
        (
            &|root| root["cameras"][0]["perspective"]["yfov"] = json!(4.0),
            "fov_y_rad is 4",
        ),
        (
            &|root| root["nodes"][1] = json!({}),
            "no node of the scene has a camera",
        ),
    ];
    for (change, expected) in cases {
        let error = with(change);
        assert!(
            error.contains(expected) && error.contains("film.gltf: "),
            "{error}"
        );
    }
    let mut file = File::new();
    file.channel(0, "translation", "LINEAR", &[1.0, 1.0], &values);
    assert!(
        file.error().contains("times do not ascend"),
        "{}",
        file.error()
    );
    let place = "animation \"take\", sampler 0";
    assert!(file.error().contains(place), "{}", file.error());
}

#[test]
fn only_gltf_has_cameras() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.obj");
    std::fs::write(&file, "v 0 0 0\n").unwrap();
    let error = camera_path(&file, CameraChoice::default()).unwrap_err();
    assert!(error.to_string().contains("is no glTF"), "{error}");
}

/// Every glTF file of others, if there are some: a path, or an error of one line that says why there is none.
#[test]
fn files_of_others_have_a_path_or_say_why_not() {
    let Some(folder) = std::env::var_os("HROC_TEST_SCENES").map(PathBuf::from) else {
        eprintln!("skipped: HROC_TEST_SCENES is not set");
        return;
    };
    let Ok(manifest) = std::fs::read_to_string(folder.join("MANIFEST.tsv")) else {
        eprintln!("skipped: {} has no MANIFEST.tsv", folder.display());
        return;
    };
    let files = manifest
        .lines()
        .skip(1)
        .filter_map(|row| row.split('\t').next());
    let files = files.filter(|file| file.ends_with(".gltf") || file.ends_with(".glb"));
    let mut found = 0;
    for file in files {
        match camera_path(&folder.join(file), CameraChoice::default()) {
            Ok(camera) => {
                assert!(camera.path.pose_at(0.0).position.is_finite(), "{file}");
                found += 1;
            }
            Err(error) => {
                let text = error.to_string();
                assert!(
                    text.lines().count() == 1 && text.contains("; "),
                    "{file}: {text}"
                );
            }
        }
    }
    assert!(found > 0, "no file has a camera");
}
