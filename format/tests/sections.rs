//! Optional sections: known or not, they are found where the directory says, or the file is refused.

mod support;

use hroc_format::*;
use support::{file, file_with, open, reseal_header, scene, sections, walk};
use xxhash_rust::xxh3::xxh3_64;

const LEVELS: SectionName = SectionName::new("levels");
const MASKS: SectionName = SectionName::new("masks");
const ENTRY_LEN: usize = 32;

/// Where the directory of a file begins.
fn directory(file: &[u8]) -> usize {
    let payload_len = u64::from_le_bytes(file[24..32].try_into().unwrap());
    (HEADER_LEN + payload_len as usize).next_multiple_of(16)
}

/// Writes a number into a field of an entry of the directory and corrects the checksums of directory and header.
fn forge(file: &mut [u8], entry: usize, field: usize, number: u64) {
    let at = directory(file) + entry * ENTRY_LEN + field;
    file[at..at + 8].copy_from_slice(&number.to_le_bytes());
    reseal(file);
}

fn reseal(file: &mut [u8]) {
    let start = directory(file);
    let count = u32::from_le_bytes(file[48..52].try_into().unwrap()) as usize;
    if let Some(directory) = file.get(start..start + count * ENTRY_LEN) {
        let checksum = xxh3_64(directory) as u32;
        file[52..56].copy_from_slice(&checksum.to_le_bytes());
    }
    reseal_header(file);
}

#[track_caller]
fn assert_refused(file: &[u8], expected: &str) {
    for depth in [Check::Ranges, Check::Objects, Check::Everything] {
        let error = open(file, depth).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(expected), "{text}");
        assert!(text.contains("copy or bake it again") && text.lines().count() == 1);
    }
}

#[test]
fn sections_are_found_by_name_and_others_are_skipped() {
    let bytes = file_with(&scene(5), &sections());
    let baked = open(&bytes, Check::Everything).unwrap();
    walk(baked.scene());
    let levels = baked.section(LEVELS).unwrap().unwrap();
    assert_eq!(levels, (0..37).collect::<Vec<u8>>());
    assert_eq!(levels.as_ptr() as usize % 16, 0);
    assert_eq!(baked.section(MASKS).unwrap(), Some(&[][..]));
    assert!(baked.section(SectionName::new("remap")).unwrap().is_none());
    let names: Vec<_> = baked
        .sections()
        .iter()
        .map(|s| s.name.to_string())
        .collect();
    assert_eq!(names, ["levels", "masks"]);

    let plain = open(&file(&scene(5)), Check::Everything).unwrap();
    assert!(plain.sections().is_empty() && plain.section(LEVELS).unwrap().is_none());
}

/// What the README says about the bytes.
#[test]
fn layout() {
    let plain = file(&scene(5));
    let bytes = file_with(&scene(5), &sections());
    let start = directory(&bytes);
    assert_eq!(start, plain.len().next_multiple_of(16));
    assert_eq!(&bytes[start..start + 8], b"levels  ");
    let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    let levels = start + 2 * ENTRY_LEN;
    assert_eq!(number(start + 8), levels as u64);
    assert_eq!(number(start + 16), 37);
    assert_eq!(number(start + 24), xxh3_64(&bytes[levels..levels + 37]));
    assert_eq!(&bytes[start + 32..start + 40], b"masks   ");
    assert_eq!(number(start + 40), levels as u64 + 48);
    assert_eq!(bytes.len(), levels + 48);
    assert!(bytes[levels + 37..].iter().all(|&byte| byte == 0));
}

/// A section is not read when a file is opened, and is checked when somebody asks for it.
#[test]
fn a_damaged_section_is_refused_when_it_is_asked_for() {
    let mut bytes = file_with(&scene(5), &sections());
    let levels = directory(&bytes) + 2 * ENTRY_LEN;
    bytes[levels + 9] ^= 4;
    let baked = open(&bytes, Check::Objects).unwrap();
    let error = baked.section(LEVELS).unwrap_err();
    assert!(
        error.to_string().contains("section levels is damaged"),
        "{error}"
    );
    assert_eq!(baked.section(MASKS).unwrap(), Some(&[][..]));
    let error = open(&bytes, Check::Everything).unwrap_err();
    assert!(matches!(error, OpenError::Section { name, .. } if name == LEVELS));
}

#[test]
fn a_damaged_directory() {
    let whole = file_with(&scene(5), &sections());
    let start = directory(&whole);
    let damaged = |entry, field, number| {
        let mut bytes = whole.clone();
        forge(&mut bytes, entry, field, number);
        bytes
    };
    let levels = (start + 2 * ENTRY_LEN) as u64;
    let name = |name: &[u8; 8]| u64::from_le_bytes(*name);
    for (entry, field, number, expected) in [
        (
            0,
            0,
            name(b"le vels "),
            "a section has the name \"le vels \"",
        ),
        (0, 0, name(b"        "), "a section has the name"),
        (
            0,
            0,
            name(b"l\x80vels  "),
            "a section has the name \"l\\x80vels  \"",
        ),
        (1, 0, name(b"levels  "), "section levels is there twice"),
        (
            1,
            0,
            name(b"curves  "),
            "section curves follows levels, which is not in order",
        ),
        (0, 8, levels + 1, "which is not a multiple of 16"),
        (0, 8, levels - 16, "overlaps what ends at byte"),
        (0, 8, 0, "overlaps what ends at byte"),
        (1, 8, levels + 32, "overlaps what ends at byte"),
        (1, 8, levels + 64, "and should begin at byte"),
        (0, 16, 16, "and should begin at byte"),
        (0, 16, 20, "the padding at byte"),
        (0, 16, u64::MAX, "leads out of the file"),
        (0, 16, u64::MAX - levels, "leads out of the file"),
        (1, 16, 1, "leads out of the file"),
    ] {
        assert_refused(&damaged(entry, field, number), expected);
    }

    let mut bytes = whole.clone();
    bytes[start + 3] ^= 1;
    assert_refused(
        &bytes,
        "the directory of sections is damaged: its checksum is",
    );
    // The padding between two sections, and the bytes between payload and directory.
    let mut bytes = whole.clone();
    bytes[levels as usize + 37] = 1;
    assert_refused(&bytes, "the padding at byte");
    let payload_end = HEADER_LEN + u64::from_le_bytes(whole[24..32].try_into().unwrap()) as usize;
    if payload_end < start {
        let mut bytes = whole.clone();
        bytes[start - 1] = 1;
        assert_refused(&bytes, "the padding at byte");
    }
}

/// The header lies about the number of sections: no allocation goes by it.
#[test]
fn a_wrong_number_of_sections() {
    let whole = file_with(&scene(5), &sections());
    for (count, expected) in [
        (0_u32, "the header is damaged"),
        (1, "section levels begins at byte"),
        (3, "overlaps what ends at byte"),
        (u32::MAX, "4294967295 entries do not fit into the file"),
    ] {
        let mut bytes = whole.clone();
        bytes[48..52].copy_from_slice(&count.to_le_bytes());
        reseal(&mut bytes);
        assert_refused(&bytes, expected);
    }
    // A file without sections ends with its payload.
    let mut bytes = file(&scene(5));
    bytes.extend([0; 16]);
    let len = bytes.len() as u64;
    bytes[40..48].copy_from_slice(&len.to_le_bytes());
    reseal_header(&mut bytes);
    assert_refused(&bytes, "the contents end at byte");
}

/// Cut short under a header that fits what is left.
#[test]
fn every_truncation_is_refused() {
    let whole = file_with(&scene(5), &sections());
    for len in HEADER_LEN..whole.len() {
        let mut bytes = whole[..len].to_vec();
        bytes[40..48].copy_from_slice(&(len as u64).to_le_bytes());
        reseal_header(&mut bytes);
        let error = open(&bytes, Check::Ranges).expect_err("cut short");
        assert!(
            matches!(
                error,
                OpenError::Directory { .. } | OpenError::Header { .. }
            ),
            "{len} bytes: {error}"
        );
    }
}

#[test]
fn names_are_short_and_printable() {
    for name in ["", "ninechars", "a b", "ä", "a\n"] {
        assert!(std::panic::catch_unwind(|| SectionName::new(name)).is_err());
    }
    assert_eq!(SectionName::new("12345678").to_string(), "12345678");
}
