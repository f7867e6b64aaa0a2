//! Things that are no baked file, or not this version's: each is told apart and says what to do.

mod support;

use std::fs;

use hroc_format::*;
use support::{file, open, reseal_header, scene, seal};

#[track_caller]
fn assert_refused(bytes: &[u8], expected: &str) {
    for depth in [Check::Ranges, Check::Objects, Check::Everything] {
        let text = open(bytes, depth).unwrap_err().to_string();
        assert!(text.contains(expected), "{text}");
        assert_eq!(text.lines().count(), 1, "{text}");
    }
}

/// Opens a file of that name and content.
fn open_named(name: &str, content: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, content).unwrap();
    let text = BakedScene::open_checked(&path).unwrap_err().to_string();
    text.replace(folder.path().to_str().unwrap(), "D")
}

#[test]
fn scenes_that_are_not_baked_yet() {
    assert_eq!(
        open_named("room.glb", b"glTF\x02\0\0\0\x10\0\0\0"),
        "D/room.glb: this is a GLB file; bake it first: hroc-bake bake D/room.glb -o D/room.hroc"
    );
    assert_eq!(
        open_named(
            "room.gltf",
            b"\xEF\xBB\xBF {\"asset\":{\"version\":\"2.0\"}}"
        ),
        "D/room.gltf: this is a JSON file, perhaps a glTF scene; \
         bake it first: hroc-bake bake D/room.gltf -o D/room.hroc"
    );
    assert_eq!(
        open_named("room.obj", b"# Blender\nmtllib room.mtl\nv 0 0 0\n"),
        "D/room.obj: this is a text file, perhaps an OBJ scene; \
         bake it first: hroc-bake bake D/room.obj -o D/room.hroc"
    );
}

#[test]
fn other_files() {
    assert_eq!(
        open_named("empty.hroc", b""),
        "D/empty.hroc: the file is empty; bake the scene again: hroc-bake bake SCENE.glb -o SCENE.hroc"
    );
    assert_refused(b"\x89PNG\r\n\x1A\n\0\0\0\rIHDR", "this is a PNG image");
    assert_refused(b"\xFF\xD8\xFF\xE0", "this is a JPEG image");
    assert_refused(b"PK\x03\x04", "this is a ZIP archive");
    assert_refused(b"\x1F\x8B\x08", "this is a gzip archive");
    assert_refused(b"Dear Sir or Madam,", "this is a text file");
    assert_refused(
        &[0; 200],
        "not a baked scene; baked files come from: hroc-bake bake",
    );
}

#[test]
fn no_file_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let error = BakedScene::open(folder.path()).unwrap_err();
    assert!(matches!(error, OpenError::NotAFile { .. }), "{error:?}");
    assert!(error.to_string().contains("not a regular file"));
    let error = BakedScene::open(folder.path().join("missing.hroc")).unwrap_err();
    assert!(matches!(error, OpenError::Io { .. }), "{error:?}");
    assert!(
        error.to_string().contains("missing.hroc: cannot read it"),
        "{error}"
    );
}

#[test]
fn other_versions() {
    let mut bytes = file(&scene(1));
    for (version, expected) in [
        (0, "; bake it again with this version"),
        (4, "; update hroc, or bake it again"),
    ] {
        bytes[8] = version;
        reseal_header(&mut bytes);
        assert_refused(
            &bytes,
            &format!("format version {version}, but this program reads version 3{expected}"),
        );
        assert!(matches!(
            open(&bytes, Check::Ranges),
            Err(OpenError::Version { .. })
        ));
    }
}

#[test]
fn another_schema() {
    let mut bytes = file(&scene(1));
    bytes[16] ^= 1;
    reseal_header(&mut bytes);
    assert_refused(&bytes, "written by another build of hroc (schema ");
    assert_refused(&bytes, "bake it again with this version");
}

#[test]
fn a_header_of_the_future() {
    for (byte, expected) in [
        (12, "unknown flags"),
        (26, "the payload is longer than the file"),
        (53, "a checksum of a directory without sections"),
    ] {
        let mut bytes = file(&scene(1));
        bytes[byte] = 1;
        assert_refused(&bytes, "the header is damaged (wrong checksum)");
        reseal_header(&mut bytes);
        assert_refused(&bytes, expected);
    }
}

#[test]
fn trailing_bytes_and_missing_ones() {
    let mut bytes = file(&scene(1));
    bytes.push(0);
    assert_refused(&bytes, "has trailing bytes (");
    bytes.truncate(100);
    assert_refused(&bytes, "truncated (100 bytes, should be ");
    bytes[40..48].copy_from_slice(&u64::MAX.to_le_bytes());
    reseal_header(&mut bytes);
    assert_refused(
        &bytes,
        "truncated (100 bytes, should be 18446744073709551615)",
    );
}

#[test]
fn a_payload_that_is_no_archive() {
    for len in [0, 1, 8, 303, 304, 305, 1024] {
        let bytes = seal(&vec![0xFF; len]);
        assert!(
            matches!(
                open(&bytes, Check::Everything),
                Err(OpenError::Archive { .. })
            ),
            "{len} bytes"
        );
        assert_refused(&bytes, "the archive is damaged: ");
    }
}

#[test]
fn a_payload_that_is_not_the_one_written() {
    let mut bytes = file(&scene(3));
    let name = bytes
        .windows(6)
        .position(|window| window == b"sample")
        .unwrap();
    bytes[name] = b'S';
    assert!(
        open(&bytes, Check::Objects).is_ok(),
        "only the checksum can know"
    );
    let error = open(&bytes, Check::Everything).unwrap_err();
    assert!(matches!(error, OpenError::Checksum { .. }), "{error:?}");
    assert!(
        error.to_string().contains("damaged, the checksum is "),
        "{error}"
    );
}
