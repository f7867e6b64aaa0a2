//! The generated scenes: right proportions, equal bytes from equal parameters, files that a glTF
//! reader accepts, and no broken geometry.

use std::path::{Path, PathBuf};

use glam::Vec3;
use hroc_preprocess::camera_path::CameraPath;
use hroc_preprocess::generate::{
    self, GENERATORS, GenerateError, Generator, GlbStats, Model, Params, ScenePath, Shape,
};

struct Files {
    stats: GlbStats,
    bytes: Vec<u8>,
    /// File name and text of each camera path.
    paths: Vec<(String, String)>,
}

fn write(generator: &dyn Generator, params: &Params) -> Files {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("scene.glb");
    let written = generator.write(params, &path).unwrap();
    let paths: Vec<_> = written
        .paths
        .iter()
        .map(|path| {
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            (name, std::fs::read_to_string(path).unwrap())
        })
        .collect();
    assert_eq!(
        std::fs::read_dir(&folder).unwrap().count(),
        1 + paths.len(),
        "no temporary file is left"
    );
    Files {
        stats: written.stats,
        bytes: std::fs::read(&path).unwrap(),
        paths,
    }
}

/// Objects, triangles and vertices of the papers' scenes.
fn counts(generator: &dyn Generator) -> [f64; 3] {
    match generator.name() {
        "fantasy" => [7_437.0, 17_879_189.0, 12_292_158.0],
        "factory" => [46_600.0, 5_718_850.0, 10_535_850.0],
        "radial-city" => [73_812.0, 1_272_764.0, 2_384_053.0],
        "satellites" => [120_000.0, 807_172_000.0, 669_111_000.0],
        name => panic!("what does {name} stand in for?"),
    }
}

fn assert_within(share: f64, value: f64, target: f64, what: &str) {
    assert!(
        (value - target).abs() <= share * target,
        "{what}: {value} instead of {target}"
    );
}

fn radial_city() -> &'static dyn Generator {
    generate::by_name("radial-city").unwrap()
}

/// The committed paths are those of the full scenes, to the last digit, on every platform.
#[test]
fn full_scenes_have_the_counts_of_the_papers_and_the_committed_paths() {
    let committed = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/paths");
    for generator in GENERATORS {
        let name = generator.name();
        let files = write(*generator, &Params::default());
        check_counts(&files.stats, *generator);
        if name == "factory" {
            // As large as a real site: every object has a mesh of its own.
            assert_within(0.01, files.bytes.len() as f64, 217e6, "bytes of factory");
        }
        for (file, text) in files.paths {
            let file = committed.join(file.replace("scene", name));
            let expected = std::fs::read_to_string(&file)
                .unwrap_or_else(|error| panic!("{}: {error}", file.display()));
            assert!(text == expected, "{} has changed", file.display());
        }
    }
}

fn check_counts(stats: &GlbStats, generator: &dyn Generator) {
    let [objects, triangles, vertices] = counts(generator);
    let of = |what: &str| format!("{what} of {}", generator.name());
    assert_eq!(stats.objects as f64, objects, "{}", of("objects"));
    assert_within(0.02, stats.triangles as f64, triangles, &of("triangles"));
    assert_within(0.02, stats.vertices as f64, vertices, &of("vertices"));
}

#[test]
fn scale_is_the_share_of_objects_and_detail_that_of_triangles() {
    for generator in GENERATORS {
        let [full, triangles, _] = counts(*generator);
        for (scale, detail) in [(0.05, 1.0), (0.3, 0.6), (0.1, 2.0), (0.03, 4.0), (1.3, 0.6)] {
            let model = generator.model(&Params {
                scale,
                detail,
                seed: 7,
            });
            let name = generator.name();
            let objects = (full * scale).round();
            assert_eq!(
                model.parts().count() as f64,
                objects,
                "{name} scale {scale}"
            );
            let shapes = model.parts().map(|part| &model.meshes[part.mesh].shape);
            let count: usize = shapes.map(Shape::triangle_count).sum();
            let what = format!("triangles of {name} at scale {scale}, detail {detail}");
            assert_within(
                0.02,
                count as f64,
                triangles / full * detail * objects,
                &what,
            );
        }
    }
}

#[test]
fn the_smallest_scenes_have_their_objects() {
    for generator in GENERATORS {
        let [full, ..] = counts(*generator);
        for objects in 1..=60 {
            let params = Params {
                scale: f64::from(objects) / full,
                detail: 0.1,
                ..Params::default()
            };
            let model = generator.model(&params);
            assert_eq!(
                model.parts().count(),
                objects as usize,
                "{}",
                generator.name()
            );
            assert!(!model.paths.is_empty());
        }
    }
}

/// The first path of every scene starts outside, above everything, and ends low and within.
#[test]
fn every_scene_has_a_path_of_ten_seconds_that_walks_in() {
    for generator in GENERATORS {
        let model = generator.model(&Params {
            scale: 0.1,
            detail: 0.05,
            ..Params::default()
        });
        assert_eq!(model.paths[0].name, generate::MAIN_PATH);
        for ScenePath { name, path } in &model.paths {
            let name = format!("{} {name}", generator.name());
            assert_eq!(path.duration_s(), 10.0, "{name}");
            let text = path.to_json();
            let again = CameraPath::parse(text.as_bytes(), Path::new("p")).unwrap();
            // JSON numbers are read to the last digit but one.
            let (a, b) = (again.pose_at(4.321), path.pose_at(4.321));
            assert!(a.position.abs_diff_eq(b.position, 1e-9), "{name}");
        }
        let path = &model.paths[0].path;
        let [start, end] = [0.0, 10.0].map(|t| path.pose_at(t).position);
        assert!(
            start.y > 5.0 * end.y.abs(),
            "{}: {start} {end}",
            generator.name()
        );
        let level = |p: glam::DVec3| p.x.hypot(p.z);
        assert!(
            level(start) > level(end),
            "{}: {start} {end}",
            generator.name()
        );
    }
}

#[test]
fn equal_parameters_give_equal_bytes_and_other_seeds_others() {
    for generator in GENERATORS {
        let params = Params {
            scale: 0.05,
            detail: 1.0,
            seed: 3,
        };
        let first = write(*generator, &params);
        assert!(
            first.bytes == write(*generator, &params).bytes,
            "{}",
            generator.name()
        );
        assert_eq!(first.paths[0].0, "scene.path.json");
        let other = write(*generator, &Params { seed: 4, ..params });
        assert!(first.bytes != other.bytes, "{}", generator.name());
    }
}

#[test]
fn a_gltf_reader_sees_what_was_counted() {
    for generator in GENERATORS {
        for (scale, detail) in [(0.02, 1.0), (0.01, 0.25), (0.01, 4.0)] {
            let Files { stats, bytes, .. } = write(
                *generator,
                &Params {
                    scale,
                    detail,
                    seed: 5,
                },
            );
            assert_eq!(stats.bytes, bytes.len() as u64);
            let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
            let blob = gltf.blob.as_deref();
            let mut seen = (0, 0, 0);
            for mesh in gltf.nodes().filter_map(|node| node.mesh()) {
                for primitive in mesh.primitives() {
                    let reader = primitive.reader(|_| blob);
                    let positions: Vec<_> = reader.read_positions().unwrap().collect();
                    let indices: Vec<_> = reader.read_indices().unwrap().into_u32().collect();
                    assert!(indices.iter().all(|&i| (i as usize) < positions.len()));
                    let bounds = primitive.bounding_box();
                    for axis in 0..3 {
                        let values = || positions.iter().map(|p| p[axis]);
                        assert_eq!(bounds.min[axis], values().fold(f32::INFINITY, f32::min));
                        assert_eq!(bounds.max[axis], values().fold(f32::NEG_INFINITY, f32::max));
                    }
                    seen = (
                        seen.0 + 1,
                        seen.1 + indices.len() / 3,
                        seen.2 + positions.len(),
                    );
                }
            }
            assert_eq!(seen, (stats.objects, stats.triangles, stats.vertices));
            // Every node but the roots is one group's child.
            let scene = gltf.default_scene().unwrap();
            let children = scene
                .nodes()
                .map(|root| root.children().count())
                .sum::<usize>();
            assert_eq!(scene.nodes().count() + children, gltf.nodes().count());
        }
    }
}

#[test]
fn geometry_is_finite_and_no_triangle_is_empty() {
    for generator in GENERATORS {
        for detail in [0.25, 1.0, 4.0] {
            let model = generator.model(&Params {
                scale: 0.1,
                detail,
                seed: 6,
            });
            for mesh in &model.meshes {
                let positions = &mesh.shape.positions;
                assert!(positions.iter().all(|p| p.is_finite()), "{}", mesh.name);
                for triangle in mesh.shape.indices.chunks(3) {
                    let [a, b, c] = [0, 1, 2].map(|i| positions[triangle[i] as usize]);
                    assert!(
                        (b - a).cross(c - a).length() > 1e-9,
                        "{}: {a} {b} {c}",
                        mesh.name
                    );
                }
            }
            for group in &model.groups {
                assert!(group.translation.is_finite() && group.rotation.is_normalized());
            }
            for part in model.parts() {
                assert!(part.translation.is_finite() && part.rotation.is_normalized());
                assert!(part.scale.is_finite() && part.scale.min_element() > 0.0);
            }
        }
    }
}

/// The eye is never within a thing, at full scale; seen by the box of each thing in its own frame, or by
/// its sphere for rocks.
#[test]
fn no_path_leads_through_anything() {
    for generator in GENERATORS {
        let model = generator.model(&Params {
            detail: 0.02,
            ..Params::default()
        });
        let bounds: Vec<_> = model
            .meshes
            .iter()
            .map(|mesh| {
                let points = || mesh.shape.positions.iter().copied();
                (
                    points().reduce(Vec3::min).unwrap(),
                    points().reduce(Vec3::max).unwrap(),
                )
            })
            .collect();
        for ScenePath { name, path } in &model.paths {
            let eyes: Vec<Vec3> = path
                .keys()
                .iter()
                .map(|key| glam::DVec3::from_array(key.position).as_vec3())
                .collect();
            for group in &model.groups {
                let group_from_world = group.rotation.inverse();
                let eyes = eyes
                    .iter()
                    .map(|&eye| group_from_world * (eye - group.translation));
                let eyes: Vec<Vec3> = eyes.collect();
                for part in &group.parts {
                    let mesh = &model.meshes[part.mesh];
                    // A height field: its box is empty above the ground.
                    if mesh.name.starts_with("terrain") {
                        continue;
                    }
                    let (min, max) = bounds[part.mesh];
                    let from_group = part.rotation.inverse();
                    let is_within = |eye: &Vec3| {
                        let p = from_group * (*eye - part.translation) / part.scale;
                        let in_box = p.cmpge(min).all() && p.cmple(max).all();
                        let is_rock = generator.name() == "satellites";
                        in_box && (!is_rock || p.length() < 0.5)
                    };
                    let at = eyes.iter().position(is_within);
                    assert!(
                        at.is_none(),
                        "{} {name}: key {at:?} lies in {} of {}",
                        generator.name(),
                        mesh.name,
                        group.name
                    );
                }
            }
        }
    }
}

/// Nothing solid at eye height along the middle of the streets and avenues.
#[test]
fn the_streets_of_the_radial_city_can_be_walked() {
    const EYE_HEIGHT: f32 = 1.7;
    let model = radial_city().model(&Params {
        scale: 0.3,
        ..Params::default()
    });
    let boxes = boxes_at_height(&model, EYE_HEIGHT);
    let blocked = |x: f32, z: f32| {
        boxes
            .iter()
            .any(|b| b[0] < x && x < b[1] && b[2] < z && z < b[3])
    };
    let round = |radius: f32, turn: f32| (radius * turn.cos(), radius * turn.sin());
    for ring in 0..3 {
        let radius = 42.0 + 56.0 * ring as f32;
        let steps = (radius * 2.0) as usize;
        for step in 0..steps {
            let (x, z) = round(radius, std::f32::consts::TAU * step as f32 / steps as f32);
            assert!(!blocked(x, z), "street {ring} is blocked at {x}, {z}");
        }
    }
    for avenue in 0..6 {
        for step in 0..200 {
            let (x, z) = round(
                42.0 + step as f32,
                std::f32::consts::TAU * avenue as f32 / 6.0,
            );
            assert!(!blocked(x, z), "avenue {avenue} is blocked at {x}, {z}");
        }
    }
}

/// World rectangles (x and z ranges) round the objects that stand at this height.
fn boxes_at_height(model: &Model, height: f32) -> Vec<[f32; 4]> {
    let mut boxes = Vec::new();
    for group in &model.groups {
        for part in &group.parts {
            let points = model.meshes[part.mesh].shape.positions.iter().map(|&p| {
                let in_group = part.translation + part.rotation * (part.scale * p);
                group.translation + group.rotation * in_group
            });
            let (min, max) = points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), p| {
                (min.min(p), max.max(p))
            });
            if min.y < height && height < max.y {
                boxes.push([min.x, max.x, min.z, max.z]);
            }
        }
    }
    boxes
}

#[test]
fn parameters_out_of_range_are_refused_by_name() {
    let path = std::env::temp_dir().join("never-written.glb");
    for bad in [0.0, -1.0, 16.1, f64::NAN, f64::INFINITY] {
        let params = Params::default();
        let cases = [
            (
                "scale",
                Params {
                    scale: bad,
                    ..params
                },
            ),
            (
                "detail",
                Params {
                    detail: bad,
                    ..params
                },
            ),
        ];
        for (name, params) in cases {
            let error = radial_city().write(&params, &path).unwrap_err();
            assert!(matches!(error, GenerateError::OutOfRange { .. }), "{error}");
            assert!(error.to_string().starts_with(name), "{error}");
        }
    }
    assert!(!path.exists());
}

#[test]
fn a_folder_that_is_not_there_is_named() {
    let path = std::env::temp_dir().join("no such folder/scene.glb");
    let params = Params {
        scale: 0.001,
        ..Params::default()
    };
    let error = radial_city().write(&params, &path).unwrap_err();
    assert!(error.to_string().contains("no such folder"), "{error}");
}

#[test]
fn generators_have_distinct_names_and_are_found_by_them() {
    for (i, generator) in GENERATORS.iter().enumerate() {
        let found = generate::by_name(generator.name()).map(Generator::name);
        assert_eq!(found, Some(generator.name()));
        assert!(!generator.describe().is_empty());
        assert!(
            GENERATORS[..i]
                .iter()
                .all(|other| other.name() != generator.name())
        );
    }
    assert!(generate::by_name("no such generator").is_none());
}
