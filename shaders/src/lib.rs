//! The WGSL of hroc as text, with a once-only import: a line `//!import common/types` at the top of a
//! file is replaced by that file, unless it was imported already.
//!
//! ```
//! let wgsl = hroc_shaders::source("pack").unwrap();
//! assert!(wgsl.contains("fn pack_emit"));
//! assert_eq!(wgsl.matches("struct Object {").count(), 1);
//! ```
#![warn(missing_docs)]

macro_rules! modules {
    ($($name:literal,)*) => {
        /// Every module: its name (path without `.wgsl`) and its text with the imports unresolved.
        pub const MODULES: &[(&str, &str)] = &[$(($name, include_str!(concat!("wgsl/", $name, ".wgsl"))),)*];
    };
}

modules! {
    "common/types",
    "common/frame",
    "common/depth",
    "common/pyramid",
    "common/bounds",
    "common/raster_box",
    "common/object_bounds",
    "common/grouping",
    "object",
    "pack",
    "filter_occluders",
    "extract_groups",
    "batch_occlusion_test",
    "batch_occlusion_test_early",
    "mark",
    "minus",
    "vfc",
    "vfc_bvh",
    "roc",
    "roc_test",
    "roc_test_early",
    "ioc",
    "ioc_test",
    "ioc_test_early",
    "depth_pyramid",
    "hiz",
    "hiz_test",
    "woc",
    "query_boxes",
    "hardware",
}

const IMPORT: &str = "//!import ";

/// The text of a module with its imports in place. `None` if there is no such module.
///
/// # Panics
/// If one of this crate's own files imports a module that does not exist; a test rules that out.
pub fn source(name: &str) -> Option<String> {
    let text = module(name)?;
    Some(resolve_into(text, &mut vec![name.to_owned()]))
}

/// Resolves the imports of a host's own WGSL, which may import any of [`MODULES`].
///
/// # Errors
/// The name of the first import that does not exist.
pub fn resolve(text: &str) -> Result<String, String> {
    match text
        .lines()
        .filter_map(|line| line.strip_prefix(IMPORT))
        .find(|name| module(name.trim()).is_none())
    {
        Some(missing) => Err(missing.trim().to_owned()),
        None => Ok(resolve_into(text, &mut Vec::new())),
    }
}

fn module(name: &str) -> Option<&'static str> {
    MODULES
        .iter()
        .find(|(module, _)| *module == name)
        .map(|(_, text)| *text)
}

fn resolve_into(text: &str, imported: &mut Vec<String>) -> String {
    let mut resolved = String::with_capacity(text.len());
    for line in text.lines() {
        let Some(name) = line.strip_prefix(IMPORT).map(str::trim) else {
            resolved.push_str(line);
            resolved.push('\n');
            continue;
        };
        if !imported.iter().any(|done| done == name) {
            imported.push(name.to_owned());
            let text =
                module(name).unwrap_or_else(|| panic!("shader module '{name}' does not exist"));
            resolved.push_str(&resolve_into(text, imported));
        }
    }
    resolved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_module_resolves_and_validates() {
        for (name, _) in MODULES {
            let wgsl = source(name).unwrap();
            let parsed = naga::front::wgsl::parse_str(&wgsl)
                .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&wgsl)));
            naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                naga::valid::Capabilities::default() | naga::valid::Capabilities::EARLY_DEPTH_TEST,
            )
            .validate(&parsed)
            .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&wgsl)));
        }
    }

    #[test]
    fn a_missing_import_is_named() {
        assert_eq!(
            resolve("//!import common/nothing\n"),
            Err("common/nothing".to_owned())
        );
        assert!(source("nothing").is_none());
    }
}
