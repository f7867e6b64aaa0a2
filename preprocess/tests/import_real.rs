//! Scenes by others, from the folder in `HROC_TEST_SCENES`: what bakes has the object and triangle counts of
//! its `MANIFEST.tsv`; what is malformed is refused with a reason, or harmless.

use hroc_format::{BakedScene, Check, to_bytes};
use hroc_preprocess::bake::{BakeOptions, BakeReport, bake};
use hroc_preprocess::import::{ImportOptions, import};
use hroc_preprocess::progress::Silent;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

/// Needs Draco, which is refused.
const DRACO: &str = "features/DracoSparseMesh/DracoSparseMesh.gltf";

/// The standard forbids loading a file that asks for a newer reader (section 3.2); the validator only warns.
const NEEDS_NEWER: &str = "malformed/gltf-validator/test/base/data/asset/min_version_valid.gltf";

/// Where the manifest counts primitives without a triangle, lines or half triangles as objects, or a repeated
/// corner of a polygon as a triangle.
const OTHER_COUNTS: &[&str] = &[
    "malformed/assimp/test/models/glTF2/IncorrectVertexArrays/Cube.gltf",
    "malformed/gltf-validator/test/base/data/mesh_data/joints_no_weights.gltf",
    "malformed/gltf-validator/test/base/data/mesh_data/joints_weights_complex.gltf",
    "malformed/tinyobjloader/models/issue-319-002.obj",
];

/// A hang is a failure too.
const TIME_LIMIT: Duration = Duration::from_secs(10);

type Row = HashMap<String, String>;

/// The manifest's rows whose file lies below one of `suites`; `None`, said aloud, without a folder
/// or a manifest in it.
fn rows(suites: &[&str]) -> Option<(PathBuf, Vec<Row>)> {
    let Some(folder) = std::env::var_os("HROC_TEST_SCENES").map(PathBuf::from) else {
        eprintln!("skipped: HROC_TEST_SCENES is not set");
        return None;
    };
    let Ok(manifest) = std::fs::read_to_string(folder.join("MANIFEST.tsv")) else {
        eprintln!("skipped: {} has no MANIFEST.tsv", folder.display());
        return None;
    };
    let mut lines = manifest
        .lines()
        .map(|line| line.split('\t').map(str::to_owned));
    let header: Vec<String> = lines.next().unwrap().collect();
    let rows = lines.map(|row| header.iter().cloned().zip(row).collect::<Row>());
    let suite = |row: &Row| suites.iter().any(|suite| row["file"].starts_with(suite));
    let rows: Vec<_> = rows.filter(suite).collect();
    assert!(!rows.is_empty());
    Some((folder, rows))
}

/// Bakes a file and opens the result, checked to the last byte.
fn bake_file(path: &Path) -> Result<BakeReport, String> {
    let source = import(&[path.to_owned()], &ImportOptions::default(), &Silent);
    let source = source.map_err(|error| error.to_string())?;
    let baked =
        bake(source, &BakeOptions::default(), &Silent).map_err(|error| error.to_string())?;
    let (scene, report) = baked;
    BakedScene::from_aligned(to_bytes(&scene).unwrap(), Check::Everything)
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Ok(report)
}

/// The manifest counts what the source has: what the bake leaves out is added again. No mesh of which it leaves
/// out triangles is drawn twice.
fn counts_agree(row: &Row, report: &BakeReport) -> bool {
    let objects = report.objects + report.empty_objects;
    let triangles = report.triangles + report.coincident_triangles;
    (row["objects"].as_str(), row["triangles"].as_str())
        == (objects.to_string().as_str(), triangles.to_string().as_str())
}

#[test]
fn features_and_real_scenes_have_the_counts_of_the_manifest() {
    let Some((folder, rows)) = rows(&["features/", "real/"]) else {
        return;
    };
    let mut wrong = Vec::new();
    for row in &rows {
        match (bake_file(&folder.join(&row["file"])), row["file"].as_str()) {
            (Err(error), DRACO) if error.contains("KHR_draco_mesh_compression") => {}
            (Ok(report), _) if counts_agree(row, &report) => {}
            (other, file) => wrong.push(format!("{file}: {other:?}")),
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Every file in at most [`TIME_LIMIT`], none with a panic. An error names the file, is one line and says what to
/// do; what glTF-Validator finds no fault with bakes. Prints the table of accepted and refused files per suite.
#[test]
fn malformed_files_are_refused_with_a_reason_or_harmless() {
    let Some((folder, rows)) = rows(&["malformed/"]) else {
        return;
    };
    let mut suites = BTreeMap::<String, [usize; 3]>::new();
    for row in &rows {
        let file = row["file"].clone();
        let path = folder.join(&file);
        let (sender, receiver) = mpsc::channel();
        let worker = std::thread::spawn({
            let path = path.clone();
            move || drop(sender.send(bake_file(&path)))
        });
        let result = match receiver.recv_timeout(TIME_LIMIT) {
            Ok(result) => result,
            Err(mpsc::RecvTimeoutError::Timeout) => panic!("{file}: longer than {TIME_LIMIT:?}"),
            Err(mpsc::RecvTimeoutError::Disconnected) => {
                panic!("{file}: {:?}", worker.join().unwrap_err())
            }
        };
        let suite = file.split('/').nth(1).unwrap().to_owned();
        let [accepted, empty, refused] = suites.entry(suite).or_default();
        match result {
            Ok(report) => {
                assert!(report.objects > 0 || !report.warnings.is_empty(), "{file}");
                let counted = row["objects"] != "-" && !OTHER_COUNTS.contains(&file.as_str());
                assert!(!counted || counts_agree(row, &report), "{file}: {report:?}");
                *if report.objects > 0 { accepted } else { empty } += 1;
            }
            Err(error) => {
                assert!(error.starts_with(&path.display().to_string()), "{error}");
                assert!(error.contains("; ") && !error.contains('\n'), "{error}");
                let faultless = row["note"].starts_with("validator: 0 err");
                assert!(!faultless || file == NEEDS_NEWER, "{file}: {error}");
                *refused += 1;
            }
        }
    }
    eprintln!("| suite | accepted | accepted, without triangles | refused |\n|---|---|---|---|");
    for (suite, [accepted, empty, refused]) in &suites {
        eprintln!("| {suite} | {accepted} | {empty} | {refused} |");
    }
}
