//! Imports point downward: the edges between the workspace's crates are the ones listed here and no others.

use std::collections::BTreeSet;
use std::path::Path;

/// Crate, then the workspace crates its library and binaries may use.
const EDGES: &[(&str, &[&str])] = &[
    ("format", &[]),
    ("shaders", &[]),
    ("preprocess", &["format"]),
    ("runtime", &["format", "shaders"]),
    ("runtime/methods", &["format", "msoc", "runtime"]),
    ("runtime/msoc", &[]),
    (
        "runtime/study",
        &[
            "format",
            "methods",
            "msoc",
            "preprocess",
            "runtime",
            "shaders",
        ],
    ),
    (
        "tests",
        &[
            "format",
            "methods",
            "preprocess",
            "runtime",
            "shaders",
            "study",
        ],
    ),
];

/// Files of the crates that read what others wrote, with the number of their `unsafe` blocks. Each has its proof beside it:
/// clippy sees to that.
const UNSAFE: &[(&str, usize)] = &[
    ("format/src/open.rs", 2),
    ("preprocess/src/import/gltf/meshopt.rs", 2),
];

#[test]
fn unsafe_stands_where_it_is_known() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut found = Vec::new();
    let mut folders = vec![root.join("format/src"), root.join("preprocess/src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let code = text
                .lines()
                .filter(|line| !line.trim_start().starts_with("//"));
            let count = code.filter(|line| line.contains("unsafe")).count();
            if count > 0 {
                let name = path.strip_prefix(root).unwrap().display().to_string();
                found.push((name.replace('\\', "/"), count));
            }
        }
    }
    found.sort();
    let known: Vec<_> = UNSAFE
        .iter()
        .map(|(name, count)| (name.to_string(), *count))
        .collect();
    assert_eq!(found, known);
}

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
