//! Imports point downward: the edges between the workspace's crates are the ones listed here and no others.

use std::collections::BTreeSet;
use std::path::Path;

/// Crate, then the workspace crates its library and binaries may use.
const EDGES: &[(&str, &[&str])] = &[
    ("format", &[]),
    ("shaders", &[]),
    ("preprocess", &["format"]),
    ("runtime", &["format", "shaders"]),
    ("runtime/msoc", &[]),
    (
        "runtime/study",
        &["format", "msoc", "preprocess", "runtime", "shaders"],
    ),
    (
        "tests",
        &["format", "preprocess", "runtime", "shaders", "study"],
    ),
];

#[test]
fn no_other_edge_appears() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let workspace = std::fs::read_to_string(root.join("Cargo.toml")).unwrap();
    for (folder, allowed) in EDGES {
        let manifest = std::fs::read_to_string(root.join(folder).join("Cargo.toml")).unwrap();
        let dependencies = section(&manifest, "[dependencies]");
        let found = dependencies
            .lines()
            .filter_map(|line| line.strip_prefix("hroc-"))
            .map(|line| line.split(['.', ' ', '=']).next().unwrap())
            .collect::<BTreeSet<_>>();
        assert_eq!(found, allowed.iter().copied().collect(), "{folder}");
    }
    let members = section(&workspace, "[workspace]");
    let members = members
        .lines()
        .find(|line| line.starts_with("members"))
        .unwrap();
    let listed = members.matches('"').count() / 2;
    assert_eq!(
        listed,
        EDGES.len(),
        "a crate is missing from this test: {members}"
    );
}

/// The lines of a manifest between a heading and the next.
fn section(manifest: &str, heading: &str) -> String {
    let from = manifest.split_once(heading).map_or("", |(_, rest)| rest);
    from.lines()
        .take_while(|line| !line.starts_with('['))
        .map(|line| format!("{line}\n"))
        .collect()
}
