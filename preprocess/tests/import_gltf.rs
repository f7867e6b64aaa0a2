//! What the glTF importer makes of small files written here, feature by feature.

use glam::{DVec3, Vec3};
use hroc_preprocess::import::{ImportError, ImportErrorKind, ImportOptions, import};
use hroc_preprocess::progress::Silent;
use hroc_preprocess::scene::{AlphaMode, SourceScene};
use serde_json::{Value, json};
use std::f64::consts::FRAC_1_SQRT_2;
use std::path::PathBuf;

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// A glTF file in the making: one buffer, and whatever a test sets in `root`.
struct File {
    root: Value,
    bin: Vec<u8>,
}

impl File {
    /// One scene with node 0, which shows mesh 0.
    fn new() -> Self {
        let root = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [] }],
            "accessors": [], "bufferViews": [], "buffers": [],
        });
        Self {
            root,
            bin: Vec::new(),
        }
    }

    /// A file with one triangle in the xy plane.
    fn triangle() -> Self {
        let mut file = Self::new();
        let position = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        file.primitive(json!({ "attributes": { "POSITION": position } }));
        file
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.root[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    fn primitive(&mut self, primitive: Value) {
        self.root["meshes"][0]["primitives"]
            .as_array_mut()
            .unwrap()
            .push(primitive);
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.push(
            "bufferViews",
            json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }),
        )
    }

    fn accessor(&mut self, component: u32, shape: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.push("accessors", json!({ "bufferView": view, "componentType": component, "type": shape, "count": count }))
    }

    fn floats(&mut self, shape: &str, floats: &[f32]) -> usize {
        let lanes = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(FLOAT, shape, floats.len() / lanes, &bytes)
    }

    fn indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(UNSIGNED_SHORT, "SCALAR", indices.len(), &bytes)
    }

    /// The file as .glb.
    fn glb(&self) -> Vec<u8> {
        let mut root = self.root.clone();
        if root["buffers"].as_array().unwrap().is_empty() {
            root["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        }
        let mut json = root.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend(((28 + json.len() + self.bin.len()) as u32).to_le_bytes());
        glb.extend((json.len() as u32).to_le_bytes());
        glb.extend(b"JSON");
        glb.extend(json);
        glb.extend((self.bin.len() as u32).to_le_bytes());
        glb.extend(b"BIN\0");
        glb.extend(&self.bin);
        glb
    }

    fn import(&self) -> Result<SourceScene, ImportError> {
        import_bytes("scene.glb", &self.glb())
    }

    fn scene(&self) -> SourceScene {
        self.import().unwrap()
    }

    fn error(&self) -> String {
        self.import().unwrap_err().to_string()
    }
}

fn import_bytes(name: &str, bytes: &[u8]) -> Result<SourceScene, ImportError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    import_path(path)
}

fn import_path(path: PathBuf) -> Result<SourceScene, ImportError> {
    import(
        &[path],
        &ImportOptions {
            normals: true,
            uvs: true,
            ..Default::default()
        },
        &Silent,
    )
}

fn counts(scene: &SourceScene) -> (usize, usize) {
    let triangles = |mesh: usize| scene.meshes[mesh].indices.len() / 3;
    (
        scene.objects.len(),
        scene
            .objects
            .iter()
            .map(|object| triangles(object.mesh))
            .sum(),
    )
}

/// Asserts that `text` names all of `parts`, on one line.
fn assert_names(text: &str, parts: &[&str]) {
    assert!(!text.contains('\n'), "{text}");
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in {text:?}");
    }
}

#[test]
fn a_triangle_without_indices() {
    let scene = File::triangle().scene();
    assert_eq!(counts(&scene), (1, 1));
    assert_eq!(
        scene.meshes[0].positions,
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    );
    assert_eq!(scene.meshes[0].indices, [0, 1, 2]);
    assert_eq!(scene.name, "scene");
    assert!(scene.warnings.is_empty());
}

#[test]
fn indices_of_every_width_and_every_triangle_mode() {
    for (component, width) in [(UNSIGNED_BYTE, 1), (UNSIGNED_SHORT, 2), (UNSIGNED_INT, 4)] {
        for (mode, expected) in [
            (4, [0, 1, 2, 1, 2, 3].as_slice()),
            (5, &[0, 1, 2, 1, 1, 2, 2, 1, 2, 1, 3, 2]),
            (6, &[1, 2, 0, 2, 1, 0, 1, 2, 0, 2, 3, 0]),
        ] {
            let mut file = File::new();
            let position = file.floats("VEC3", &[0.0; 12]);
            let bytes: Vec<u8> = [0u32, 1, 2, 1, 2, 3]
                .iter()
                .flat_map(|index| index.to_le_bytes()[..width].to_vec())
                .collect();
            let indices = file.accessor(component, "SCALAR", 6, &bytes);
            file.primitive(
                json!({ "attributes": { "POSITION": position }, "indices": indices, "mode": mode }),
            );
            assert_eq!(
                file.scene().meshes[0].indices,
                expected,
                "mode {mode}, component {component}"
            );
        }
    }
}

#[test]
fn points_and_lines_are_skipped_and_counted() {
    let mut file = File::triangle();
    for mode in 0..4 {
        file.primitive(json!({ "attributes": { "POSITION": 0 }, "mode": mode }));
    }
    let scene = file.scene();
    assert_eq!(counts(&scene), (1, 1));
    assert_eq!(
        scene.warnings,
        [
            "scene.glb: primitives of points skipped: 1",
            "scene.glb: primitives of lines skipped: 3"
        ]
    );
}

#[test]
fn no_triangles_make_an_empty_scene_and_a_warning() {
    let scene = import_bytes("a.gltf", br#"{ "asset": { "version": "2.0" } }"#).unwrap();
    assert_eq!(counts(&scene), (0, 0));
    assert_eq!(scene.warnings, ["the scene has no triangles"]);
}

#[test]
fn unused_vertices_are_left_out_of_shared_buffers() {
    let mut file = File::new();
    let mut positions = vec![f32::NAN; 300];
    positions[30..39].copy_from_slice(&[0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0]);
    let position = file.floats("VEC3", &positions);
    let indices = file.indices(&[12, 10, 11]);
    file.primitive(json!({ "attributes": { "POSITION": position }, "indices": indices }));
    let scene = file.scene();
    assert_eq!(scene.meshes[0].positions.len(), 3);
    assert_eq!(scene.meshes[0].indices, [2, 0, 1]);
}

#[test]
fn interleaved_attributes() {
    let mut file = File::new();
    let vertices: Vec<u8> = (0..3)
        .flat_map(|v| [v as f32, 0.0, 0.0, 0.0, 0.0, 2.0, 0.5, v as f32])
        .flat_map(f32::to_le_bytes)
        .collect();
    let view = file.view(&vertices);
    file.root["bufferViews"][view]["byteStride"] = json!(32);
    let mut attribute = |offset: usize, shape: &str| {
        file.push("accessors", json!({
            "bufferView": view, "byteOffset": offset, "componentType": FLOAT, "type": shape, "count": 3
        }))
    };
    let (position, normal, uv) = (
        attribute(0, "VEC3"),
        attribute(12, "VEC3"),
        attribute(24, "VEC2"),
    );
    file.primitive(
        json!({ "attributes": { "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv } }),
    );
    let mesh = &file.scene().meshes[0];
    assert_eq!(
        mesh.positions,
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
    );
    assert_eq!(
        mesh.normals,
        [[0.0, 0.0, 1.0]; 3],
        "normals are made unit vectors"
    );
    assert_eq!(mesh.uvs, [[0.5, 0.0], [0.5, 1.0], [0.5, 2.0]]);
}

#[test]
fn sparse_accessors_with_and_without_a_base() {
    for with_base in [true, false] {
        let mut file = File::triangle();
        let indices = file.view(&[2]);
        let values: Vec<u8> = [7.0f32, 8.0, 9.0]
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let values = file.view(&values);
        file.root["accessors"][0]["sparse"] = json!({
            "count": 1,
            "indices": { "bufferView": indices, "componentType": UNSIGNED_BYTE },
            "values": { "bufferView": values },
        });
        if !with_base {
            file.root["accessors"][0]
                .as_object_mut()
                .unwrap()
                .remove("bufferView");
        }
        let positions = file.scene().meshes[0].positions.clone();
        let second = if with_base { [1.0, 0.0, 0.0] } else { [0.0; 3] };
        assert_eq!(positions, [[0.0; 3], second, [7.0, 8.0, 9.0]]);
    }
}

#[test]
fn quantized_positions_in_every_type() {
    let cases: [(u32, bool, [u8; 6], [f32; 3]); 8] = [
        (BYTE, false, [0x81, 0, 127, 0, 0, 0], [-127.0, 0.0, 127.0]),
        (BYTE, true, [0x80, 0, 127, 0, 0, 0], [-1.0, 0.0, 1.0]),
        (
            UNSIGNED_BYTE,
            false,
            [255, 1, 0, 0, 0, 0],
            [255.0, 1.0, 0.0],
        ),
        (UNSIGNED_BYTE, true, [255, 51, 0, 0, 0, 0], [1.0, 0.2, 0.0]),
        (
            SHORT,
            false,
            [0, 0x80, 255, 255, 1, 0],
            [-32768.0, -1.0, 1.0],
        ),
        (SHORT, true, [0, 0x80, 0xFF, 0x7F, 0, 0], [-1.0, 1.0, 0.0]),
        (
            UNSIGNED_SHORT,
            false,
            [255, 255, 1, 0, 0, 0],
            [65535.0, 1.0, 0.0],
        ),
        (
            UNSIGNED_SHORT,
            true,
            [255, 255, 0x33, 0x33, 0, 0],
            [1.0, 0.2, 0.0],
        ),
    ];
    for (component, normalized, bytes, expected) in cases {
        let mut file = File::new();
        let size = if matches!(component, BYTE | UNSIGNED_BYTE) {
            3
        } else {
            6
        };
        // Three vertices, each padded to a stride of 8.
        let vertex = |_| {
            let mut v = bytes[..size].to_vec();
            v.resize(8, 0xEE);
            v
        };
        let data: Vec<u8> = (0..3).flat_map(vertex).collect();
        let position = file.accessor(component, "VEC3", 3, &data);
        file.root["bufferViews"][0]["byteStride"] = json!(8);
        file.root["accessors"][position]["normalized"] = json!(normalized);
        file.root["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        file.primitive(json!({ "attributes": { "POSITION": position } }));
        assert_eq!(
            file.scene().meshes[0].positions,
            [expected; 3],
            "component {component}, {normalized}"
        );
    }
}

#[test]
fn nodes_are_drawn_depth_first_and_share_meshes() {
    let mut file = File::triangle();
    file.primitive(json!({ "attributes": { "POSITION": 0 }, "material": 0 }));
    file.root["materials"] = json!([{ "doubleSided": true, "alphaMode": "MASK",
        "pbrMetallicRoughness": { "baseColorFactor": [0.1, 0.2, 0.3, 0.4] } }]);
    file.root["nodes"] = json!([
        { "children": [2, 1], "translation": [1e9, 0.0, 0.0] },
        { "mesh": 0, "name": "second" },
        { "mesh": 0, "name": "first", "translation": [0.125, 0.0, 0.0], "scale": [2.0, 2.0, -2.0],
          "rotation": [0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2] },
        { "mesh": 0, "name": "outside the scene" },
    ]);
    let scene = file.scene();
    assert_eq!(counts(&scene), (4, 4));
    let ids: Vec<_> = scene
        .objects
        .iter()
        .map(|o| (o.name.as_str(), o.node, o.primitive, o.mesh))
        .collect();
    assert_eq!(
        ids,
        [
            ("first", 2, 0, 0),
            ("first", 2, 1, 0),
            ("second", 1, 0, 0),
            ("second", 1, 1, 0)
        ]
    );
    let first = &scene.objects[0];
    assert_eq!(
        first.world_from_object.translation,
        DVec3::new(1e9 + 0.125, 0.0, 0.0),
        "composed in f64"
    );
    let x = first.world_from_object.transform_vector3(DVec3::X);
    assert!(x.abs_diff_eq(DVec3::Y * 2.0, 1e-12), "{x}");
    assert_eq!(
        (first.base_color, first.alpha, first.double_sided),
        ([1.0; 4], AlphaMode::Opaque, false)
    );
    let look = &scene.objects[1];
    assert_eq!(
        (look.base_color, look.alpha, look.double_sided),
        ([0.1, 0.2, 0.3, 0.4], AlphaMode::Masked, true)
    );
}

#[test]
fn specular_glossiness_gives_its_diffuse_colour() {
    let mut file = File::triangle();
    file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
    file.root["materials"] = json!([{ "alphaMode": "BLEND", "extensions":
        { "KHR_materials_pbrSpecularGlossiness": { "diffuseFactor": [0.5, 0.25, 1.0, 0.75] } } }]);
    let object = &file.scene().objects[0];
    assert_eq!(
        (object.base_color, object.alpha),
        ([0.5, 0.25, 1.0, 0.75], AlphaMode::Blended)
    );
}

#[test]
fn without_a_scene_all_roots_are_taken() {
    let mut file = File::triangle();
    let root = file.root.as_object_mut().unwrap();
    root.remove("scene");
    root.remove("scenes");
    root.insert(
        "nodes".into(),
        json!([{ "mesh": 0 }, { "children": [0] }, { "mesh": 0 }]),
    );
    let scene = file.scene();
    assert_eq!(
        scene
            .objects
            .iter()
            .map(|object| object.node)
            .collect::<Vec<_>>(),
        [0, 2]
    );
    assert_names(&scene.warnings[0], &["no scene"]);
}

#[test]
fn a_scene_is_chosen_by_its_name_or_its_number() {
    let mut file = File::triangle();
    file.root["nodes"] =
        json!([{ "name": "a", "mesh": 0 }, { "name": "b", "mesh": 0 }, { "name": "c", "mesh": 0 }]);
    file.root["scenes"] = json!([{ "nodes": [0] }, { "name": "garden", "nodes": [1, 2] }, { "name": "0", "nodes": [2] }]);
    file.root["scene"] = json!(1);
    let names = |choice: Option<&str>| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.glb");
        std::fs::write(&path, file.glb()).unwrap();
        let options = ImportOptions {
            scene: choice.map(str::to_owned),
            ..Default::default()
        };
        import(&[path], &options, &Silent).map(|scene| {
            let names = scene.objects.iter().map(|object| object.name.clone());
            names.collect::<Vec<_>>().concat()
        })
    };
    assert_eq!(names(None).unwrap(), "bc");
    assert_eq!(names(Some("garden")).unwrap(), "bc");
    assert_eq!(
        names(Some("0")).unwrap(),
        "c",
        "a name comes before a number"
    );
    assert_eq!(names(Some("2")).unwrap(), "c");
    let error = names(Some("attic")).unwrap_err();
    assert_eq!(error.kind, ImportErrorKind::Missing);
    assert_names(
        &error.to_string(),
        &["\"attic\"", "0", "1 \"garden\"", "2 \"0\""],
    );
}

#[test]
fn hidden_nodes_hide_their_children_and_are_counted() {
    let mut file = File::triangle();
    let visible = |visible: bool| json!({ "KHR_node_visibility": { "visible": visible } });
    file.root["extensionsRequired"] = json!(["KHR_node_visibility"]);
    file.root["nodes"] = json!([
        { "children": [1, 2, 3] },
        { "mesh": 0, "name": "shown", "extensions": visible(true) },
        { "mesh": 0, "extensions": visible(false), "children": [4] },
        { "mesh": 0, "name": "plain" },
        { "mesh": 0, "extensions": visible(true) },
    ]);
    let scene = file.scene();
    let names: Vec<_> = scene
        .objects
        .iter()
        .map(|object| object.name.as_str())
        .collect();
    assert_eq!(names, ["shown", "plain"]);
    assert!(
        scene.warnings[0].contains("left out: 2"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn cycles_and_shared_children_are_refused() {
    for (nodes, why) in [
        (
            json!([{ "children": [1] }, { "children": [0] }]),
            "node 0: is its own ancestor",
        ),
        (json!([{ "children": [0] }]), "node 0: is its own ancestor"),
        (
            json!([{ "children": [1] }, { "children": [2] }, { "children": [1] }]),
            "node 1: is its own ancestor",
        ),
        (
            json!([{ "children": [1, 2] }, { "children": [2] }, {}]),
            "node 2: is a child of node 1 and a child of node 0, but",
        ),
    ] {
        let mut file = File::triangle();
        file.root["nodes"] = nodes;
        assert_names(&file.error(), &["scene.glb", why, "; "]);
    }
    // A cycle beside the scene is nobody's business; one that the scene lists is.
    let mut file = File::triangle();
    file.root["nodes"] = json!([{ "mesh": 0 }, { "children": [2] }, { "children": [1] }]);
    assert_eq!(counts(&file.scene()), (1, 1));
    file.root["scenes"][0]["nodes"] = json!([0, 2]);
    assert_names(&file.error(), &["node 2: is its own ancestor"]);
}

#[test]
fn a_node_that_is_listed_again_is_drawn_once_in_its_place() {
    let mut file = File::triangle();
    file.root["nodes"] = json!([
        { "mesh": 0, "translation": [1.0, 0.0, 0.0], "children": [1, 2] },
        { "mesh": 0, "translation": [2.0, 0.0, 0.0] },
        { "mesh": 0, "translation": [4.0, 0.0, 0.0], "children": [3] },
        { "mesh": 0, "translation": [8.0, 0.0, 0.0] },
    ]);
    let places = |scene: &SourceScene| {
        let place = |object: &hroc_preprocess::scene::SourceObject| {
            (object.node, object.world_from_object.translation.x)
        };
        scene.objects.iter().map(place).collect::<Vec<_>>()
    };
    let expected = [(0, 1.0), (1, 3.0), (2, 5.0), (3, 13.0)];
    for (roots, again) in [
        (json!([0]), 0),
        (json!([0, 1, 2, 3]), 3),
        (json!([3, 2, 1, 0]), 3),
        (json!([0, 0]), 1),
        (json!([0, 3, 0, 3]), 3),
    ] {
        file.root["scenes"][0]["nodes"] = roots.clone();
        let scene = file.scene();
        assert_eq!(places(&scene), expected, "{roots}");
        match again {
            0 => assert!(scene.warnings.is_empty()),
            _ => assert_names(&scene.warnings[0], &["listed twice", &format!(": {again}")]),
        }
    }
    file.root["scenes"][0]["nodes"] = json!([0]);
    file.root["nodes"][0]["children"] = json!([1, 1, 2]);
    let scene = file.scene();
    assert_eq!(places(&scene), expected);
    assert_names(&scene.warnings[0], &["listed twice", ": 1"]);

    // A root below a node outside the scene stands alone, which is told.
    file.root["scenes"][0]["nodes"] = json!([2]);
    let scene = file.scene();
    assert_eq!(places(&scene), [(2, 4.0), (3, 12.0)]);
    assert_names(&scene.warnings[0], &["below nodes outside it", ": 1"]);
}

#[test]
fn a_relative_center_is_exact_and_in_the_axes_of_the_file() {
    let mut file = File::triangle();
    file.root["nodes"] = json!([
        { "mesh": 0, "translation": [0.125, 0.25, 0.5], "children": [1] },
        { "camera": 0 },
    ]);
    file.root["cameras"] =
        json!([{ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.5 } }]);
    file.root["extensionsUsed"] = json!(["CESIUM_RTC"]);
    // In the axes of the globe, where z points up; glTF's y is its z, glTF's z its -y.
    file.root["extensions"] =
        json!({ "CESIUM_RTC": { "center": [4000000.001, 600000.002, 4900000.003] } });
    let place = DVec3::new(4000000.001 + 0.125, 4900000.003 + 0.25, -600000.002 + 0.5);
    for required in [json!([]), json!(["CESIUM_RTC"])] {
        file.root["extensionsRequired"] = required;
        let scene = file.scene();
        assert_eq!(scene.objects[0].world_from_object.translation, place);
        assert_eq!(scene.cameras[0].position, place);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
    file.root["extensions"]["CESIUM_RTC"] = json!({ "center": [1, 2] });
    assert_names(&file.error(), &["scene.glb: CESIUM_RTC: "]);
    file.root["extensions"]["CESIUM_RTC"] = json!({ "center": [1e308, 0, 0] });
    file.root["nodes"][0]["translation"] = json!([1e308, 0, 0]);
    assert_names(&file.error(), &["not finite"]);
}

#[test]
fn a_hierarchy_a_hundred_thousand_deep() {
    let depth = 100_000;
    let mut file = File::triangle();
    let mut nodes: Vec<Value> = (1..depth)
        .map(|child| json!({ "children": [child], "translation": [0.001, 0.0, 0.0] }))
        .collect();
    nodes.push(json!({ "mesh": 0 }));
    file.root["nodes"] = nodes.into();
    let scene = file.scene();
    let x = scene.objects[0].world_from_object.translation.x;
    assert!((x - 99.999).abs() < 1e-6, "{x}");
}

#[test]
fn gpu_instances_are_objects_of_one_mesh() {
    let mut file = File::triangle();
    file.primitive(json!({ "attributes": { "POSITION": 0 } }));
    let translation = file.floats("VEC3", &[1.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    // A half turn about z in normalized bytes, then none.
    let rotation = file.accessor(BYTE, "VEC4", 2, &[0, 0, 127, 0, 0, 0, 0, 127]);
    file.root["accessors"][rotation]["normalized"] = json!(true);
    let scale = file.floats("VEC3", &[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]);
    file.root["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    file.root["nodes"][0] = json!({ "mesh": 0, "name": "grass", "translation": [0.0, 10.0, 0.0],
        "extensions": { "EXT_mesh_gpu_instancing":
            { "attributes": { "TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale } } } });
    let scene = file.scene();
    let ids: Vec<_> = scene
        .objects
        .iter()
        .map(|o| (o.name.as_str(), o.primitive, o.mesh))
        .collect();
    assert_eq!(
        ids,
        [
            ("grass[0]", 0, 0),
            ("grass[0]", 1, 0),
            ("grass[1]", 0, 0),
            ("grass[1]", 1, 0)
        ]
    );
    let corner = |object: usize| {
        scene.objects[object]
            .world_from_object
            .transform_point3(DVec3::X)
    };
    assert!(
        corner(0).abs_diff_eq(DVec3::new(0.0, 10.0, 0.0), 1e-12),
        "{}",
        corner(0)
    );
    assert!(
        corner(2).abs_diff_eq(DVec3::new(5.0, 10.0, 0.0), 1e-12),
        "{}",
        corner(2)
    );
}

#[test]
fn meshopt_compression_with_a_fallback_buffer() {
    let positions: [[f32; 4]; 4] = [
        [0.0; 4],
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [1.0, 1.0, 5.0, 0.0],
    ];
    let vertices = meshopt::encode_vertex_buffer(&positions).unwrap();
    let indices = meshopt::encode_index_buffer(&[0, 1, 2, 2, 1, 3], 4).unwrap();
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let mut file = File::new();
        file.bin = [vertices.clone(), indices.clone()].concat();
        file.root["extensionsRequired"] = json!([name]);
        file.root["buffers"] = json!([
            { "byteLength": file.bin.len() },
            { "byteLength": 88, "extensions": { name: { "fallback": true } } },
        ]);
        file.push("bufferViews", json!({ "buffer": 1, "byteLength": 64, "byteStride": 16, "extensions": { name: {
            "buffer": 0, "byteLength": vertices.len(), "byteStride": 16, "count": 4, "mode": "ATTRIBUTES" } } }));
        file.push("bufferViews", json!({ "buffer": 1, "byteOffset": 64, "byteLength": 24, "extensions": { name: {
            "buffer": 0, "byteOffset": vertices.len(), "byteLength": indices.len(), "byteStride": 4, "count": 6,
            "mode": "TRIANGLES" } } }));
        file.push(
            "accessors",
            json!({ "bufferView": 0, "componentType": FLOAT, "type": "VEC3", "count": 4 }),
        );
        file.push(
            "accessors",
            json!({ "bufferView": 1, "componentType": UNSIGNED_INT, "type": "SCALAR", "count": 6 }),
        );
        file.primitive(json!({ "attributes": { "POSITION": 0 }, "indices": 1 }));
        let scene = file.scene();
        assert_eq!(counts(&scene), (1, 2));
        assert_eq!(scene.meshes[0].positions[3], [1.0, 1.0, 5.0]);

        // Damage of every kind ends in an error, not in the decoder.
        let broken = |edit: &dyn Fn(&mut Value)| {
            let mut root = file.root.clone();
            edit(&mut root["bufferViews"][0]["extensions"][name]);
            let error = File {
                root,
                bin: file.bin.clone(),
            }
            .error();
            assert_names(&error, &["accessor 0", "buffer view 0"]);
        };
        broken(&|view| view["byteStride"] = json!(6));
        broken(&|view| view["byteStride"] = json!(260));
        broken(&|view| view["byteStride"] = json!(0));
        broken(&|view| view["count"] = json!(1u64 << 60));
        broken(&|view| view["count"] = json!(3));
        broken(&|view| view["byteLength"] = json!(10));
        broken(&|view| view["byteLength"] = json!(u64::MAX));
        broken(&|view| view["mode"] = json!("TRIANGLES"));
        broken(&|view| view["mode"] = json!("other"));
        broken(&|view| view["filter"] = json!("OCTAHEDRAL"));
        broken(&|view| view["filter"] = json!("other"));
        broken(&|view| view["buffer"] = json!(7));
        broken(&|view| view["buffer"] = json!(1));
    }
}

#[test]
fn draco_is_refused_by_name_unless_plain_data_is_there() {
    let mut file = File::triangle();
    file.root["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    file.root["meshes"][0]["primitives"][0]["extensions"] =
        json!({ "KHR_draco_mesh_compression": { "bufferView": 0 } });
    assert_eq!(counts(&file.scene()), (1, 1));
    file.root["accessors"][0]
        .as_object_mut()
        .unwrap()
        .remove("bufferView");
    assert_names(
        &file.error(),
        &[
            "mesh 0",
            "primitive 0",
            "KHR_draco_mesh_compression",
            "; decompress",
        ],
    );
}

#[test]
fn required_extensions_are_known_harmless_or_refused() {
    let mut file = File::triangle();
    file.root["extensionsRequired"] = json!([
        "KHR_texture_basisu",
        "KHR_materials_variants",
        "EXT_texture_webp"
    ]);
    let scene = file.scene();
    assert_eq!(scene.warnings.len(), 3);
    assert_names(
        &scene.warnings[2],
        &["scene.glb", "KHR_texture_basisu", "ignored"],
    );
    file.root["extensionsRequired"] = json!(["ACME_curved_space"]);
    assert_names(&file.error(), &["ACME_curved_space", "not supported"]);
    assert_eq!(
        file.import().unwrap_err().kind,
        ImportErrorKind::Unsupported
    );
}

#[test]
fn used_extensions_that_may_move_or_add_geometry_are_told() {
    let mut file = File::triangle();
    let warnings = |names: &[&str], file: &mut File| {
        file.root["extensionsUsed"] = json!(names);
        file.scene().warnings
    };
    let harmless = [
        "KHR_materials_clearcoat",
        "EXT_texture_webp",
        "KHR_mesh_quantization",
    ];
    assert_eq!(warnings(&harmless, &mut file), [""; 0]);
    for (name, parts) in [
        ("MSFT_lod", ["MSFT_lod", "most detailed level"]),
        ("AGI_articulations", ["AGI_articulations", "articulation"]),
        ("ACME_curve", ["ACME_curve", "not known"]),
    ] {
        let warnings = warnings(&[name], &mut file);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert_names(&warnings[0], &parts);
    }
    // The file may forget to list what it has.
    file.root["extensions"] = json!({ "ACME_hills": {} });
    let warnings = warnings(&["ACME_curve", "ACME_hills"], &mut file);
    assert_eq!(warnings.len(), 2);
    file.root["extensionsUsed"] = json!([]);
    assert_names(&file.scene().warnings[0], &["ACME_hills"]);
}

#[test]
fn surfaces_that_let_light_through_are_blended() {
    let look = |material: Value| {
        let mut file = File::triangle();
        file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
        file.root["materials"] = json!([material]);
        let scene = file.scene();
        assert!(scene.warnings.is_empty());
        let object = &scene.objects[0];
        (object.alpha, object.base_color[3])
    };
    let one = |name: &str, content: Value| look(json!({ "extensions": { name: content } }));
    for (name, factor, texture) in [
        (
            "KHR_materials_transmission",
            "transmissionFactor",
            "transmissionTexture",
        ),
        (
            "KHR_materials_diffuse_transmission",
            "diffuseTransmissionFactor",
            "diffuseTransmissionTexture",
        ),
        (
            "ADOBE_materials_thin_transparency",
            "transmissionFactor",
            "transmissionTexture",
        ),
        (
            "KHR_materials_translucency",
            "translucencyFactor",
            "translucencyTexture",
        ),
    ] {
        assert_eq!(
            one(name, json!({ factor: 1.0 })),
            (AlphaMode::Blended, 0.25)
        );
        assert_eq!(one(name, json!({ factor: 1 })), (AlphaMode::Blended, 0.25));
        assert_eq!(
            one(name, json!({ factor: 0.5 })),
            (AlphaMode::Blended, 0.625)
        );
        assert_eq!(
            one(name, json!({ factor: 9e9 })),
            (AlphaMode::Blended, 0.25)
        );
        let textured = json!({ factor: 0.001, texture: { "index": 0 } });
        assert_eq!(one(name, textured).0, AlphaMode::Blended);
        let textured = json!({ texture: { "index": 0 } });
        assert_eq!(one(name, textured), (AlphaMode::Blended, 1.0));
        assert_eq!(one(name, json!({ factor: 0.0 })), (AlphaMode::Opaque, 1.0));
        assert_eq!(one(name, json!({})), (AlphaMode::Opaque, 1.0));
    }
    // What happens to light inside or at a surface lets none through.
    for name in [
        "volume",
        "ior",
        "dispersion",
        "specular",
        "clearcoat",
        "iridescence",
    ] {
        let content = json!({ "thicknessFactor": 1.0, "iridescenceFactor": 1.0 });
        let name = format!("KHR_materials_{name}");
        assert_eq!(one(&name, content).0, AlphaMode::Opaque);
    }
    let glass = json!({ "KHR_materials_transmission": { "transmissionFactor": 1.0 } });
    for (mode, alpha) in [("MASK", 0.125), ("BLEND", 0.125), ("OPAQUE", 0.25)] {
        let material = json!({ "alphaMode": mode, "extensions": glass,
            "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.5] } });
        assert_eq!(look(material), (AlphaMode::Blended, alpha), "{mode}");
    }
}

#[test]
fn integers_may_be_written_as_floats_everywhere() {
    /// Writes every integer of the JSON as a float.
    fn floats(value: &mut Value) {
        match value {
            Value::Number(number) => *value = json!(number.as_f64().unwrap()),
            Value::Array(values) => values.iter_mut().for_each(floats),
            Value::Object(members) => members.values_mut().for_each(floats),
            _ => {}
        }
    }
    let mut file = File::triangle();
    let indices = file.indices(&[0, 1, 2]);
    let translation = file.floats("VEC3", &[1.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    let positions: [[f32; 4]; 3] = [[0.0; 4], [5.0, 0.0, 0.0, 0.0], [0.0, 5.0, 0.0, 0.0]];
    let packed = meshopt::encode_vertex_buffer(&positions).unwrap();
    let offset = file.bin.len();
    let view = file.view(&packed);
    file.root["bufferViews"][view] = json!({ "buffer": 0, "byteLength": 48, "byteStride": 16, "extensions": {
        "EXT_meshopt_compression": { "buffer": 0, "byteOffset": offset, "byteLength": packed.len(),
            "byteStride": 16, "count": 3, "mode": "ATTRIBUTES" } } });
    let position = file.push(
        "accessors",
        json!({ "bufferView": view, "componentType": FLOAT, "type": "VEC3", "count": 3 }),
    );
    file.primitive(
        json!({ "attributes": { "POSITION": position }, "indices": indices, "mode": 4 }),
    );
    file.root["nodes"] = json!([
        { "mesh": 0, "children": [1], "scale": [1, 1, 3], "extensions": { "EXT_mesh_gpu_instancing":
            { "attributes": { "TRANSLATION": translation } } } },
        { "camera": 0, "translation": [1, 2, 3] },
    ]);
    file.root["cameras"] =
        json!([{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.5 } }]);
    file.root["extras"] = json!({ "big": 1e300, "zero": -0.0 });
    file.root["buffers"] = json!([{ "byteLength": file.bin.len() }]);
    let plain = file.scene();
    let mut twin = File {
        root: file.root.clone(),
        bin: file.bin.clone(),
    };
    floats(&mut twin.root);
    assert!(twin.root.to_string().contains("\"mesh\":0.0"));
    let scene = twin.scene();
    assert_eq!(counts(&scene), (4, 4));
    for (a, b) in scene.objects.iter().zip(&plain.objects) {
        assert_eq!(a.world_from_object, b.world_from_object);
        assert_eq!(
            scene.meshes[a.mesh].positions,
            plain.meshes[b.mesh].positions
        );
    }
    assert_eq!(scene.cameras[0].position, plain.cameras[0].position);

    // What is no integer, or none that a float holds exactly, is refused.
    for number in ["0.5", "-1.0", "1e300", "9007199254740994.0", "1e-400"] {
        let json = File::triangle().root.to_string();
        let json = json.replacen("\"count\":3", &format!("\"count\":{number}"), 1);
        let result = import_bytes("a.gltf", json.as_bytes());
        assert!(result.is_err(), "{number}");
        let json = json!({ "asset": { "version": "2.0" }, "nodes": [{}] }).to_string();
        let json = json.replace("[{}]", &format!("[{{\"mesh\":{number}}}]"));
        let error = import_bytes("a.gltf", json.as_bytes());
        assert!(error.is_err(), "{number}");
    }
    let json = br#"{ "asset": { "version": "2.0" }, "scene": 0e0, "scenes": [{ "nodes": [10e-1] }], "nodes": [{}, {}] }"#;
    import_bytes("a.gltf", json).unwrap();
}

#[test]
fn a_byte_order_mark_is_skipped_in_both_containers() {
    let bom = b"\xEF\xBB\xBF".as_slice();
    let json = json!({ "asset": { "version": "2.0" } }).to_string();
    let gltf = [bom, json.as_bytes()].concat();
    import_bytes("a.gltf", &gltf).unwrap();

    let mut json = [bom, json.as_bytes()].concat();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = |length: usize| (length as u32).to_le_bytes();
    let glb = [
        b"glTF\x02\0\0\0".as_slice(),
        &length(20 + json.len()),
        &length(json.len()),
        b"JSON",
        &json,
    ]
    .concat();
    import_bytes("a.glb", &glb).unwrap();
}

#[test]
fn morph_targets_take_their_default_weights() {
    let mut file = File::triangle();
    let target = file.floats("VEC3", &[0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    file.root["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": target }]);
    file.root["meshes"][0]["weights"] = json!([0.5]);
    let scene = file.scene();
    assert_eq!(scene.meshes[0].positions[0], [0.0, 0.0, 2.0]);
    assert_names(&scene.warnings[0], &["morph targets"]);
    file.root["nodes"][0]["weights"] = json!([0.25]);
    assert_eq!(
        file.scene().meshes[0].positions[0],
        [0.0, 0.0, 1.0],
        "a node's weights come first"
    );
}

#[test]
fn skinned_meshes_stand_where_their_joints_are() {
    let mut file = File::triangle();
    let joints = file.accessor(
        UNSIGNED_BYTE,
        "VEC4",
        3,
        &[0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0],
    );
    let weights = file.floats(
        "VEC4",
        &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0],
    );
    let inverse_bind: Vec<f32> = [0.0f32, 1.0]
        .iter()
        .flat_map(|&x| glam::Mat4::from_translation(Vec3::X * -x).to_cols_array())
        .collect();
    let inverse_bind = file.floats("MAT4", &inverse_bind);
    let attributes = &mut file.root["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    file.root["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": inverse_bind }]);
    file.root["scenes"][0]["nodes"] = json!([0, 1]);
    // Bound at x = 0 and x = 1; the second joint has since moved up by 3. The node's own place is moot.
    file.root["nodes"] = json!([
        { "mesh": 0, "skin": 0, "translation": [100.0, 0.0, 0.0] },
        { "children": [2] },
        { "translation": [1.0, 3.0, 0.0] },
    ]);
    let scene = file.scene();
    assert_eq!(
        scene.meshes[0].positions,
        [[0.0; 3], [1.0, 3.0, 0.0], [0.0, 2.5, 0.0]]
    );
    assert_eq!(scene.objects[0].world_from_object, glam::DAffine3::IDENTITY);
    assert_names(&scene.warnings[0], &["skinned"]);

    file.root["scenes"][0]["nodes"] = json!([0]);
    let scene = file.scene();
    assert_eq!(
        scene.objects[0].world_from_object.translation.x, 100.0,
        "joints outside the scene"
    );
    file.root["scenes"][0]["nodes"] = json!([0, 1]);
    file.root["skins"][0]["joints"] = json!([1]);
    assert_names(&file.error(), &["joint 1 of 1"]);
}

#[test]
fn instances_of_a_skinned_mesh_are_drawn_and_told() {
    let mut file = File::triangle();
    let joints = file.accessor(UNSIGNED_BYTE, "VEC4", 3, &[0; 12]);
    let weights = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(3));
    let translation = file.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 3.0]);
    let attributes = &mut file.root["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    file.root["skins"] = json!([{ "joints": [1] }]);
    file.root["scenes"][0]["nodes"] = json!([0, 1]);
    // The joint is far away: its place must not cost the vertices their precision.
    let turn = [0.0, FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2];
    let instancing =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": translation } } });
    file.root["nodes"] = json!([
        { "name": "soldier", "mesh": 0, "skin": 0, "rotation": turn, "extensions": instancing },
        { "translation": [6e6, 0.0, 1.0] },
    ]);
    let corner = |scene: &SourceScene, object: usize| {
        let object = &scene.objects[object];
        let position = scene.meshes[object.mesh].positions[1].map(f64::from);
        object.world_from_object.transform_point3(position.into())
    };
    let scene = file.scene();
    assert_eq!(counts(&scene), (2, 2));
    assert_eq!(scene.objects[1].name, "soldier[1]");
    assert_names(
        &scene.warnings[1],
        &["skinned nodes", "EXT_mesh_gpu_instancing", ": 1"],
    );
    // The node turns z to x, so that is where the second instance goes.
    for (object, x) in [(0, 6e6 + 1.0), (1, 6e6 + 4.0)] {
        let found = corner(&scene, object);
        let expected = DVec3::new(x, 0.0, 1.0);
        assert!(found.abs_diff_eq(expected, 1e-8), "{found}");
    }

    file.root["nodes"][0]["scale"] = json!([0.0, 1.0, 1.0]);
    let scene = file.scene();
    assert_eq!(counts(&scene), (1, 1));
    assert_eq!(corner(&scene, 0), DVec3::new(6e6 + 1.0, 0.0, 1.0));
    assert_names(&scene.warnings[2], &["no inverse", "left out: 1"]);
}

#[test]
fn instances_that_lie_nowhere_are_refused() {
    let mut file = File::triangle();
    let translation = file.floats("VEC3", &[0.0, 0.0, 0.0, 1e38, 0.0, 0.0]);
    file.root["nodes"][0]["scale"] = json!([1e300, 1.0, 1.0]);
    file.root["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": translation } } });
    assert_names(
        &file.error(),
        &["node 0: the transform of instance 1 is not finite"],
    );
}

#[test]
fn instances_may_have_attributes_of_the_application_alone() {
    let mut file = File::triangle();
    let id = file.accessor(UNSIGNED_BYTE, "SCALAR", 3, &[0, 1, 2]);
    file.root["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "_ID": id } } });
    assert_eq!(counts(&file.scene()), (3, 3));
    file.root["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": {} } });
    assert_names(&file.error(), &["has no attributes"]);
}

#[test]
fn cameras_keep_their_place_and_lens() {
    let mut file = File::triangle();
    file.root["cameras"] = json!([
        { "type": "perspective", "name": "eye", "perspective": { "yfov": 1.0, "znear": 0.5 } },
        { "type": "orthographic", "orthographic": { "xmag": 2.0, "ymag": 3.0, "znear": 0.0, "zfar": 9.0 } },
        { "type": "perspective", "perspective": { "yfov": -1.0, "znear": 0.5 } },
    ]);
    let turn = [0.0, FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2];
    file.root["nodes"] = json!([
        { "children": [1, 2, 3], "scale": [2.0, 2.0, 2.0], "rotation": turn },
        { "camera": 0, "translation": [0.0, 0.0, 1.0] }, { "camera": 1, "name": "plan" }, { "camera": 2 },
    ]);
    let scene = file.scene();
    let [eye, plan] = scene.cameras.as_slice() else {
        panic!("{:?}", scene.cameras)
    };
    assert!(
        eye.position.abs_diff_eq(DVec3::X * 2.0, 1e-7),
        "{}",
        eye.position
    );
    assert!((eye.orientation * DVec3::NEG_Z).abs_diff_eq(DVec3::NEG_X, 1e-7));
    assert_eq!(
        (eye.name.as_str(), eye.fov_y_rad, eye.near, eye.far),
        ("eye", 1.0, 0.5, f32::INFINITY)
    );
    assert_eq!(
        (plan.name.as_str(), plan.half_height, plan.near, plan.far),
        ("plan", 3.0, 0.0, 9.0)
    );
    assert_names(&scene.warnings[0], &["camera 2", "left out"]);
}

#[test]
fn buffers_come_from_data_uris_and_from_beside_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = folder.path().join("scenes");
    std::fs::create_dir_all(scenes.join("sub")).unwrap();
    let bytes: Vec<u8> = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    std::fs::write(scenes.join("a b.bin"), &bytes).unwrap();
    std::fs::write(scenes.join("sub/c.bin"), &bytes).unwrap();
    std::fs::write(folder.path().join("secret.bin"), &bytes).unwrap();
    let path = scenes.join("scene.gltf");
    let read = |uri: &str| {
        let mut file = File::triangle();
        file.root["buffers"] = json!([{ "byteLength": 36, "uri": uri }]);
        std::fs::write(&path, file.root.to_string()).unwrap();
        import_path(path.clone())
    };
    let base64 = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    for uri in [
        "a%20b.bin",
        "a b.bin",
        "./sub/c.bin",
        &format!("data:application/octet-stream;base64,{base64}"),
    ] {
        assert_eq!(counts(&read(uri).unwrap()), (1, 1), "{uri}");
    }
    let absolute = folder.path().join("secret.bin").display().to_string();
    let file_url = format!("file://{absolute}");
    let outside = [
        ("../secret.bin", "leads out of the scene's folder"),
        ("%2e%2e/secret.bin", "leads out of the scene's folder"),
        ("..\\secret.bin", "cannot read"),
        ("sub/../../secret.bin", "leads out of the scene's folder"),
        (
            "../../../../../../../../x",
            "leads out of the scene's folder",
        ),
        ("../none.bin", "leads out of the scene's folder"),
        (&absolute, "leads out of the scene's folder"),
        (&file_url, "leads out of the scene's folder"),
        ("file://server/c.bin", "another computer"),
        ("http://x.org/a.bin", "network address"),
        ("", "not a file name"),
        ("data:,", "declares 36 bytes"),
        ("data:;base64,*", "not base64"),
        ("none.bin", "cannot read \"none.bin\""),
        ("sub", "not a regular file"),
    ];
    for (uri, why) in outside {
        let error = read(uri).unwrap_err().to_string();
        assert_names(
            &error,
            &[
                "scene.gltf: ",
                "accessor 0, buffer view 0, buffer 0: ",
                why,
                "; ",
            ],
        );
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.bin", scenes.join("link.bin")).unwrap();
        assert_names(
            &read("link.bin").unwrap_err().to_string(),
            &["leads out of the scene's folder"],
        );
    }
    // What was read is told, with the hash of its bytes.
    let referenced = |scene: SourceScene| {
        let files = scene.referenced_files.into_iter();
        files
            .map(|file| (file.name, file.hash, file.by))
            .collect::<Vec<_>>()
    };
    let before = referenced(read("a b.bin").unwrap());
    assert_eq!(
        (before[0].0.as_str(), before.len(), before[0].2),
        ("a b.bin", 1, 0)
    );
    std::fs::write(scenes.join("a b.bin"), vec![0; 36]).unwrap();
    assert_ne!(before, referenced(read("a b.bin").unwrap()));
}

#[test]
fn uris_are_read_as_exporters_write_them() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = folder.path().canonicalize().unwrap().join("the scenes");
    std::fs::create_dir_all(scenes.join("models")).unwrap();
    let path = scenes.join("scene.gltf");
    // Each file holds a triangle of its own size, so that the one that was read is known.
    let mut size = 0.0_f32;
    let mut put = |name: &str| {
        size += 1.0;
        let corners = [0.0, 0.0, 0.0, size, 0.0, 0.0, 0.0, size, 0.0];
        let bytes: Vec<u8> = corners.iter().flat_map(|x: &f32| x.to_le_bytes()).collect();
        std::fs::write(scenes.join(name), bytes).unwrap();
        size
    };
    let read = |uri: &str| {
        let mut file = File::triangle();
        file.root["buffers"] = json!([{ "byteLength": 36, "uri": uri }]);
        std::fs::write(&path, file.root.to_string()).unwrap();
        import_path(path.clone())
    };
    let size_of = |uri: &str| read(uri).unwrap().meshes[0].positions[1][0];
    let here = scenes.display().to_string();
    let encoded = here.replace(' ', "%20");

    // The file on the disk, and the URIs that lead to it.
    for (name, uris) in [
        (
            "box.bin",
            vec![
                "box.bin".to_owned(),
                "./box.bin".into(),
                "models/../box.bin".into(),
                "../the%20scenes/box.bin".into(),
                "box.bin?v=3".into(),
                "box.bin#part".into(),
                "%62ox.bin".into(),
                format!("{here}/box.bin"),
                format!("file://{encoded}/box.bin"),
                format!("FILE://localhost{encoded}/box.bin"),
            ],
        ),
        (
            "models/box.bin",
            vec![
                r"models\box.bin".into(),
                r".\models\box.bin".into(),
                "models%5Cbox.bin".into(),
            ],
        ),
        (
            "big cube.bin",
            vec!["big%20cube.bin".into(), "big cube.bin".into()],
        ),
        (
            "big%20ball.bin",
            vec!["big%20ball.bin".into(), "big%2520ball.bin".into()],
        ),
        (
            "a+b c.bin",
            vec![
                "a+b c.bin".into(),
                "a+b%20c.bin".into(),
                "a%2Bb%20c.bin".into(),
            ],
        ),
        (
            "part#1.bin",
            vec!["part#1.bin".into(), "part%231.bin".into()],
        ),
        ("10%.bin", vec!["10%.bin".into(), "10%25.bin".into()]),
        (
            "S\u{fc}d.bin",
            vec![
                "S\u{fc}d.bin".into(),
                "S%C3%BCd.bin".into(),
                "Su\u{308}d.bin".into(),
                "Su%CC%88d.bin".into(),
            ],
        ),
        (
            "Geba\u{308}ude.bin",
            vec!["Geb\u{e4}ude.bin".into(), "Geb%C3%A4ude.bin".into()],
        ),
    ] {
        let size = put(name);
        for uri in uris {
            assert_eq!(size_of(&uri), size, "{uri} for {name}");
        }
    }

    // What the standard means comes before what somebody else may mean.
    let escaped = put("big ball.bin");
    assert_eq!(size_of("big%20ball.bin"), escaped);
    if cfg!(unix) {
        let literal = put(r"models\box.bin");
        assert_eq!(size_of(r"models\box.bin"), literal);
    }
    // Each name that was tried is told: a file that appears under one of them is a change.
    let scene = read("box.bin?v=3").unwrap();
    let found = |file: &hroc_preprocess::scene::ReferencedFile| (file.name.clone(), file.hash != 0);
    let looked_for: Vec<_> = scene.referenced_files.iter().map(found).collect();
    assert_eq!(
        looked_for,
        [("box.bin?v=3".into(), false), ("box.bin".into(), true)]
    );
    // Of several names that are not there, the one that the standard means is told.
    let error = read(r"models%20x\none.bin").unwrap_err().to_string();
    assert_names(&error, &[r#"cannot read "models x\\none.bin""#]);
}

#[test]
fn faults_are_named_with_their_place() {
    let fault = |edit: &dyn Fn(&mut File), parts: &[&str]| {
        let mut file = File::triangle();
        let indices = file.indices(&[0, 1, 2]);
        file.root["meshes"][0]["primitives"][0]["indices"] = json!(indices);
        file.root["meshes"][0]["name"] = json!("wall\n");
        edit(&mut file);
        assert_names(&file.error(), parts);
    };
    let place = "mesh 0 \"wall\\n\", primitive 0, accessor";
    fault(
        &|file| file.bin[36] = 9,
        &["scene.glb", place, "index 9 is not below the 3 vertices"],
    );
    fault(
        &|file| file.bin[2..4].copy_from_slice(&[0x80, 0x7F]),
        &[place, "is not finite"],
    );
    fault(
        &|file| file.root["accessors"][0]["count"] = json!(4),
        &[place, "do not fit"],
    );
    fault(
        &|file| file.root["accessors"][0]["count"] = json!(u64::MAX),
        &[place, "do not fit"],
    );
    fault(
        &|file| file.root["accessors"][0]["byteOffset"] = json!(u64::MAX),
        &[place, "do not fit"],
    );
    fault(
        &|file| file.root["accessors"][0]["type"] = json!("VEC2"),
        &[place, "VEC2"],
    );
    fault(
        &|file| file.root["accessors"][0]["componentType"] = json!(1),
        &[place, "unknown component type"],
    );
    fault(
        &|file| file.root["accessors"][1]["componentType"] = json!(FLOAT),
        &[place],
    );
    fault(
        &|file| file.root["accessors"][1]["componentType"] = json!(SHORT),
        &[place, "unsigned"],
    );
    fault(
        &|file| file.root["accessors"][0]["bufferView"] = json!(9),
        &[place, "buffer view 9"],
    );
    fault(
        &|file| file.root["bufferViews"][0]["buffer"] = json!(9),
        &[place, "buffer 9"],
    );
    fault(
        &|file| file.root["bufferViews"][0]["byteStride"] = json!(8),
        &[place, "stride"],
    );
    fault(
        &|file| file.root["bufferViews"][0]["byteOffset"] = json!(u64::MAX),
        &[place, "outside"],
    );
    fault(
        &|file| file.root["buffers"] = json!([{ "byteLength": 1000 }]),
        &[place, "declares 1000 bytes"],
    );
    fault(
        &|file| file.root["meshes"][0]["primitives"][0]["mode"] = json!(9),
        &["primitive 0", "unknown mode"],
    );
    fault(
        &|file| file.root["meshes"][0]["primitives"][0]["indices"] = json!(9),
        &["accessor 9"],
    );
    fault(
        &|file| file.root["meshes"][0]["primitives"][0]["material"] = json!(9),
        &["material 9"],
    );
    fault(
        &|file| file.root["nodes"][0]["mesh"] = json!(9),
        &["node 0", "mesh 9"],
    );
    fault(
        &|file| file.root["nodes"][0]["camera"] = json!(9),
        &["node 0", "camera 9"],
    );
    fault(&|file| file.root["scene"] = json!(9), &["scene 9"]);
    fault(
        &|file| {
            file.root["nodes"][0]["matrix"] =
                json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
        },
        &["node 0", "not affine"],
    );
    fault(
        &|file| {
            let child = json!({ "mesh": 0, "scale": [1e10, 1e10, 1e10] });
            file.root["nodes"] = json!([{ "children": [1], "scale": [1e308, 1.0, 1.0] }, child]);
        },
        &["node 1", "not finite"],
    );
    fault(
        &|file| file.root["asset"]["version"] = json!("1.0"),
        &["1.0"],
    );
    fault(
        &|file| file.root["asset"]["minVersion"] = json!("2.1"),
        &["2.1"],
    );
    fault(
        &|file| file.root["accessors"][0]["type"] = json!("VEC5"),
        &[place, "unknown type"],
    );
    fault(
        &|file| {
            file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
            file.root["materials"] = json!([{ "alphaMode": "FOG" }]);
        },
        &["primitive 0, material 0", "unknown alpha mode"],
    );
    fault(
        &|file| file.root["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": 1 }),
        &["node 0", "EXT_mesh_gpu_instancing"],
    );
    // Zeros without data are limited.
    fault(
        &|file| {
            let accessor = file.root["accessors"][0].as_object_mut().unwrap();
            accessor.remove("bufferView");
            accessor.insert("count".into(), json!(1 << 21));
        },
        &[place, "without data"],
    );
}

#[test]
fn every_truncation_and_damaged_byte_of_a_glb_is_survived() {
    let mut file = File::triangle();
    let indices = file.indices(&[0, 1, 2]);
    file.root["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    let glb = file.glb();
    for length in 0..glb.len() {
        import_bytes("a.glb", &glb[..length]).expect_err("a truncated file");
    }
    for at in 0..glb.len() {
        for bit in [1, 0x10, 0x80] {
            let mut glb = glb.clone();
            glb[at] ^= bit;
            // Either answer is right; what counts is that there is one, and that it is sound.
            if let Ok(scene) = import_bytes("a.glb", &glb) {
                for mesh in &scene.meshes {
                    hroc_preprocess::optimize::check(mesh).unwrap();
                }
            }
        }
    }
}

#[test]
fn the_container_may_be_longer_than_it_says_but_not_shorter_than_its_header() {
    let mut glb = File::triangle().glb();
    glb.extend([7; 5]);
    assert_eq!(counts(&import_bytes("a.glb", &glb).unwrap()), (1, 1));
    for length in 0..12u8 {
        glb[8..12].copy_from_slice(&[length, 0, 0, 0]);
        let error = import_bytes("a.glb", &glb).unwrap_err().to_string();
        assert_names(&error, &["a.glb: declares", "less than its header; "]);
    }
}

#[test]
fn overlapping_accessors_cannot_multiply_memory() {
    let mut file = File::new();
    let vertices = 30_000;
    let view = file.view(&vec![0; vertices * 12]);
    for offset in 0..2000 {
        let accessor = json!({
            "bufferView": view, "byteOffset": offset * 4, "componentType": FLOAT, "type": "VEC3",
            "count": vertices - 2001 });
        let position = file.push("accessors", accessor);
        file.primitive(json!({ "attributes": { "POSITION": position } }));
    }
    assert_names(&file.error(), &["scene.glb: ", "times the file's buffers"]);
}
