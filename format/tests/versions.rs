//! One file of each version of the format: the present one opens, those of the past are refused by their number.

mod support;

use std::path::{Path, PathBuf};

use hroc_format::{BakedScene, OpenError, VERSION};

/// Writes the file of the present version anew: `cargo test -p hroc-format --test versions -- --ignored`. To be
/// used while a version is being developed; a file of a released version is never written again.
#[test]
#[ignore = "writes into the source folder"]
fn write_the_file_of_the_present_version() {
    let mut scene = support::scene(2);
    scene.name_ends.clear();
    scene.names.clear();
    for name in ["floor", "wall"] {
        scene.names.extend(name.bytes());
        scene.name_ends.push(scene.names.len() as u32);
    }
    let path = folder().join(format!("v{VERSION}.hroc"));
    hroc_format::write_with(&path, &scene, &support::sections()).unwrap();
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/versions")
}

#[test]
fn a_file_of_every_version() {
    let folder = folder();
    for version in 1..=VERSION {
        let result = BakedScene::verify(folder.join(format!("v{version}.hroc")));
        if version == VERSION {
            let baked = result.expect("the version of this program");
            assert_eq!(baked.scene().objects.len(), 2);
            assert_eq!(baked.scene().object_name(1), "wall");
            continue;
        }
        let error = result.expect_err("a version of the past");
        assert!(matches!(error, OpenError::Version { found, .. } if found == version));
        assert!(error.to_string().contains("bake it again"), "{error}");
    }
}
