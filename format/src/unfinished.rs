//! The temporary file that a bake is written to until it is complete, and how none is left behind.
//!
//! A writer holds its file locked, and the system lets go of the lock with the process, however it ends. So
//! an unlocked one belongs to nobody: the next writer of the same target removes it.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::NamedTempFile;
use xxhash_rust::xxh3::xxh3_64;

/// What the temporary file's name begins with; it lies beside the target until it is complete.
pub const TEMPORARY_PREFIX: &str = ".hroc-baking-";

/// The temporary files of this process.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes the temporary files of all [`write`](crate::write()) calls in progress, which then fail: for a process
/// that is about to end by a signal. Not to be called *in* a signal handler, but from a thread that waits for
/// signals.
pub fn discard_unfinished() {
    for path in UNFINISHED
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .drain(..)
    {
        // Renamed already, if it is not there.
        let _ = fs::remove_file(path);
    }
}

/// A temporary file, removed when dropped.
pub(crate) struct Unfinished(NamedTempFile);

impl Unfinished {
    /// Makes one for `target` in `folder`, its own, and removes what dead writers of the target left there.
    pub(crate) fn create(folder: &Path, target: &Path) -> io::Result<Self> {
        let name = target.file_name().unwrap_or_default();
        let prefix = format!(
            "{TEMPORARY_PREFIX}{:016x}-",
            xxh3_64(name.as_encoded_bytes())
        );
        remove_orphans(folder, &prefix);
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).suffix(".tmp");
        #[cfg(unix)]
        {
            // What a file gets by default; the system takes the umask off. (Temporary files are private.)
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        loop {
            let mut unfinished = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
            let file = builder.tempfile_in(folder)?;
            unfinished.push(file.path().to_owned());
            drop(unfinished);
            let this = Self(file);
            // Where there are no locks, nobody takes this file for an orphan either.
            let _ = this.0.as_file().lock();
            // Between its creation and its lock another writer may have done so.
            if this.0.path().exists() {
                return Ok(this);
            }
        }
    }

    pub(crate) fn file(&mut self) -> &mut File {
        self.0.as_file_mut()
    }

    /// Puts the file in the place of `target`.
    pub(crate) fn persist(self, target: &Path) -> io::Result<()> {
        fs::rename(self.0.path(), target)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        UNFINISHED
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .retain(|path| path != self.0.path());
    }
}

/// Removes the files in `folder` whose names begin with `prefix` and which nobody has locked. What cannot be
/// looked at or removed stays: this is tidying, and the bake comes first.
fn remove_orphans(folder: &Path, prefix: &str) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_ours = name.as_encoded_bytes().starts_with(prefix.as_bytes());
        if !is_ours || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let Ok(file) = File::open(entry.path()) else {
            continue;
        };
        match file.try_lock() {
            Ok(()) => drop(fs::remove_file(entry.path())),
            Err(TryLockError::WouldBlock | TryLockError::Error(_)) => {}
        }
    }
}
