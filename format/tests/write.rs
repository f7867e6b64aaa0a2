//! Files appear whole or not at all, and the same scene makes the same bytes.

mod support;

use std::fs;

use hroc_format::*;
use support::{file, file_with, scene, sections};

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
fn the_same_sections_make_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.hroc");
    let len = write_with(&path, &scene(7), &sections()).unwrap();
    let bytes = fs::read(&path).unwrap();
    assert_eq!(bytes.len() as u64, len);
    assert_eq!(bytes, file_with(&scene(7), &sections()));
    // Without sections nothing is behind the payload, and with them the payload is the same.
    let plain = file(&scene(7));
    assert_eq!(plain[HEADER_LEN..], bytes[HEADER_LEN..plain.len()]);
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

/// A map of the file would end the process here.
#[test]
fn a_scene_that_was_read_survives_the_truncation_of_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.hroc");
    write(&path, &scene(40)).unwrap();
    let baked = BakedScene::read_with(&path, Check::Everything).unwrap();
    fs::File::create(&path).unwrap();
    support::walk(baked.scene());
    let error = BakedScene::read_with(&path, Check::Ranges).unwrap_err();
    assert!(matches!(error, OpenError::NotHroc { .. }), "{error:?}");
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
        assert!(matches!(error, WriteError::Target { .. }), "{error:?}");
    }
    assert!(names(folder.path()).is_empty());
}

/// Renaming would replace the device itself.
#[cfg(unix)]
#[test]
fn a_target_that_is_a_device() {
    let error = write("/dev/null".as_ref(), &scene(1)).unwrap_err();
    assert!(matches!(error, WriteError::Target { .. }), "{error:?}");
    assert!(!fs::metadata("/dev/null").unwrap().is_file());
}

#[test]
fn a_write_protected_target_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.hroc");
    fs::write(&path, "mine").unwrap();
    let mut permissions = fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).unwrap();
    let error = write(&path, &scene(1)).unwrap_err();
    assert!(matches!(error, WriteError::Target { .. }), "{error:?}");
    assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
    assert_eq!(names(folder.path()), ["scene.hroc"]);
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link() {
    let folder = tempfile::tempdir().unwrap();
    let [link, file] = ["link.hroc", "store/file.hroc"].map(|name| folder.path().join(name));
    fs::create_dir(folder.path().join("store")).unwrap();
    fs::write(&file, "before").unwrap();
    std::os::unix::fs::symlink("store/file.hroc", &link).unwrap();
    write(&link, &scene(3)).unwrap();
    assert!(link.is_symlink());
    assert_eq!(BakedScene::verify(&file).unwrap().scene().objects.len(), 3);
}

/// A dead writer's file has no lock; a living one's has.
#[test]
fn orphans_of_the_same_target_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let prefix = |target: &str| {
        let hash = xxhash_rust::xxh3::xxh3_64(target.as_bytes());
        format!("{TEMPORARY_PREFIX}{hash:016x}-")
    };
    let make = |name: String| fs::File::create(folder.path().join(name)).unwrap();
    let living = make(prefix("a.hroc") + "living.tmp");
    living.lock().unwrap();
    make(prefix("a.hroc") + "dead.tmp");
    make(prefix("b.hroc") + "dead.tmp");
    write(&folder.path().join("a.hroc"), &scene(1)).unwrap();
    let mut left = names(folder.path());
    left.sort();
    let mut expected = [
        prefix("a.hroc") + "living.tmp",
        prefix("b.hroc") + "dead.tmp",
    ];
    expected.sort();
    assert_eq!(left[..2], expected);
    assert_eq!(left[2..], ["a.hroc"]);
}

#[test]
fn nothing_is_left_when_the_last_step_fails() {
    let folder = tempfile::tempdir().unwrap();
    // Longer than a file name may be: the temporary file is written, the renaming fails.
    let error = write(&folder.path().join("n".repeat(300)), &scene(1)).unwrap_err();
    assert!(matches!(error, WriteError::Replace { .. }), "{error:?}");
    assert!(names(folder.path()).is_empty());
}
