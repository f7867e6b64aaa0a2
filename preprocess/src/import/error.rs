//! The one error of the importers: file, place, what is wrong, what to do next, on one line.

use std::fmt;
use std::path::{Path, PathBuf};

/// What kind of trouble it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImportErrorKind {
    /// The file or a file it refers to cannot be read.
    Unreadable,
    /// Not a scene in any format known here.
    UnknownFormat,
    /// The content contradicts its own format.
    Malformed,
    /// Legal, but needs something that is not implemented.
    Unsupported,
    /// The file does not hold what was asked for.
    Missing,
    /// More objects, vertices or zero-filled data than the limits allow.
    TooLarge,
}

/// Why a scene was not imported. Displays as `file: place: what; next step`.
#[derive(Clone, Debug, thiserror::Error)]
pub struct ImportError {
    /// The file given to the import.
    pub file: PathBuf,
    /// Where in the file, outermost first; empty for the file as a whole.
    pub place: String,
    /// What kind of trouble it is.
    pub kind: ImportErrorKind,
    /// What is wrong.
    pub what: String,
    /// What the user can do about it.
    pub next: String,
}

impl ImportError {
    pub(crate) fn new(kind: ImportErrorKind, what: impl Into<String>) -> Self {
        let next = match kind {
            ImportErrorKind::Unreadable => "check that it exists and may be read",
            ImportErrorKind::UnknownFormat => "give a .glb, .gltf or .obj file",
            ImportErrorKind::Malformed => {
                "export the scene again, or find the fault with a validator"
            }
            ImportErrorKind::Unsupported => "convert the scene to plain glTF 2.0 geometry",
            ImportErrorKind::Missing => "ask for something else",
            ImportErrorKind::TooLarge => "split the scene into several files",
        };
        Self {
            file: PathBuf::new(),
            place: String::new(),
            kind,
            what: what.into(),
            next: next.into(),
        }
    }

    pub(crate) fn malformed(what: impl Into<String>) -> Self {
        Self::new(ImportErrorKind::Malformed, what)
    }

    /// Replaces the next step.
    pub(crate) fn next(mut self, next: impl Into<String>) -> Self {
        self.next = next.into();
        self
    }

    /// Names the place around the one named so far.
    pub(crate) fn within(mut self, place: impl fmt::Display) -> Self {
        self.place = if self.place.is_empty() {
            place.to_string()
        } else {
            format!("{place}, {}", self.place)
        };
        self
    }

    /// Names the file, unless an inner step did.
    pub(crate) fn in_file(mut self, file: &Path) -> Self {
        if self.file.as_os_str().is_empty() {
            self.file = file.to_owned();
        }
        self
    }
}

impl fmt::Display for ImportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Names and paths come from hostile files: whatever they hold, this stays one line.
        let mut line = format!("{}: ", self.file.display());
        if !self.place.is_empty() {
            line += &format!("{}: ", self.place);
        }
        line += &format!("{}; {}", self.what, self.next);
        line.chars().try_for_each(|c| match c {
            c if c.is_control() => write!(f, "{}", c.escape_default()),
            c => write!(f, "{c}"),
        })
    }
}

pub(crate) type Result<T, E = ImportError> = std::result::Result<T, E>;
