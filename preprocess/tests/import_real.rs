//! Real scenes by others, from the folder in `HROC_TEST_SCENES`: object and triangle counts are those
//! of its `MANIFEST.tsv`.

use hroc_preprocess::import::{ImportOptions, import};
use hroc_preprocess::progress::Silent;
use std::collections::HashMap;
use std::path::PathBuf;

/// Needs Draco, which is refused.
const REFUSED: &[&str] = &["features/DracoSparseMesh/DracoSparseMesh.gltf"];

#[test]
fn counts_are_those_of_the_manifest() {
    let Some(folder) = std::env::var_os("HROC_TEST_SCENES").map(PathBuf::from) else {
        eprintln!("skipped: HROC_TEST_SCENES is not set");
        return;
    };
    let manifest = std::fs::read_to_string(folder.join("MANIFEST.tsv")).unwrap();
    let mut rows = manifest.lines().map(|line| line.split('\t'));
    let header: Vec<_> = rows.next().unwrap().collect();
    let rows = rows.map(|row| header.iter().copied().zip(row).collect::<HashMap<_, _>>());
    let rows: Vec<_> = rows
        .filter(|row| !row["file"].starts_with("malformed/"))
        .collect();
    assert!(!rows.is_empty());
    let mut wrong = Vec::new();
    for row in rows {
        let file = row["file"];
        let scene = import(&[folder.join(file)], ImportOptions::default(), &Silent);
        let scene = match scene {
            Err(error) if REFUSED.contains(&file) => {
                assert!(
                    error.to_string().contains("KHR_draco_mesh_compression"),
                    "{error}"
                );
                continue;
            }
            other => other.unwrap(),
        };
        let triangles = scene
            .objects
            .iter()
            .map(|object| scene.meshes[object.mesh].indices.len() / 3);
        let found = (
            scene.objects.len().to_string(),
            triangles.sum::<usize>().to_string(),
        );
        if (found.0.as_str(), found.1.as_str()) != (row["objects"], row["triangles"]) {
            wrong.push(format!(
                "{file}: {found:?}, not {} and {}",
                row["objects"], row["triangles"]
            ));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
