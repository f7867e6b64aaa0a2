//! One file of each version of the format: the present one opens, those of the past are refused by their number.

use std::path::Path;

use hroc_format::{BakedScene, OpenError, VERSION};

#[test]
fn a_file_of_every_version() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/versions");
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
