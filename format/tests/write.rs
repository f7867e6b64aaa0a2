//! Files appear whole or not at all, and the same scene makes the same bytes.

mod support;

use std::fs;

use hroc_format::*;
use support::{file, scene};

/// What lies in a folder, hidden files included.
fn names(folder: &std::path::Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect()
}

#[test]
fn the_same_scene_makes_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a.hroc", "b.hroc"].map(|name| folder.path().join(name));
    write(&a, &scene(77)).unwrap();
    // Leaves other bytes where memory is used again.
    let noise: Vec<Vec<u8>> = (1..2000).map(|len| vec![0xA5; len]).collect();
    drop(noise);
    write(&b, &scene(77)).unwrap();
    assert_eq!(fs::read(&a).unwrap(), fs::read(&b).unwrap());
    assert_eq!(fs::read(&a).unwrap(), file(&scene(77)));
    assert_eq!(names(folder.path()).len(), 2, "no temporary file is left");
}

#[test]
fn a_mapped_file_survives_its_replacement() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.hroc");
    write(&path, &scene(40)).unwrap();
    let old = BakedScene::open_checked(&path).unwrap();
    write(&path, &scene(2)).unwrap();
    support::walk(old.scene());
    assert_eq!(old.scene().objects.len(), 40);
    assert_eq!(BakedScene::verify(&path).unwrap().scene().objects.len(), 2);
}

#[cfg(unix)]
#[test]
fn permissions_are_those_of_any_new_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let [baked, other] = ["baked.hroc", "other"].map(|name| folder.path().join(name));
    write(&baked, &scene(1)).unwrap();
    fs::write(&other, b"").unwrap();
    let mode = |path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&baked), mode(&other));
}

#[test]
fn a_folder_that_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing").join("scene.hroc");
    let error = write(&path, &scene(1)).unwrap_err();
    assert!(matches!(error, WriteError::Create { .. }), "{error:?}");
    let text = error.to_string();
    assert!(
        text.contains("cannot create a file in") && text.contains("choose a folder that exists"),
        "{text}"
    );
}

#[test]
fn a_target_that_is_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    for path in [folder.path().to_path_buf(), "..".into(), "".into()] {
        let error = write(&path, &scene(1)).unwrap_err();
        assert!(matches!(error, WriteError::NotAFile { .. }), "{error:?}");
    }
    assert!(names(folder.path()).is_empty());
}

#[test]
fn nothing_is_left_when_the_last_step_fails() {
    let folder = tempfile::tempdir().unwrap();
    // Longer than a file name may be: the temporary file is written, the renaming fails.
    let error = write(&folder.path().join("n".repeat(300)), &scene(1)).unwrap_err();
    assert!(matches!(error, WriteError::Replace { .. }), "{error:?}");
    assert!(names(folder.path()).is_empty());
}
