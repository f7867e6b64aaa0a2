//! The truth: what no culling draws, and what that says about `hroc_keeps`; computed once per camera and kept on disk.
//!
//! An entry is one file, named by the hash of everything its pixels depend on. A file that is not what was
//! written is computed anew. The cache never fails a run: what goes wrong with it is a warning.

use std::fs::{self, File};
use std::io::Read;
use std::path::PathBuf;
use std::time::SystemTime;

use xxhash_rust::xxh3::{Xxh3Default, xxh3_64};

use crate::image::Image;
use crate::output::OutputFile;
use crate::unculled::{Fault, FaultKind, Judgement, Removed};

/// The cache's files together; beyond it the ones used longest ago go.
pub const MAX_CACHE_BYTES: u64 = 4 << 30;
/// What one run may store before the cache is brought back to its limit.
const EVICT_EVERY_BYTES: u64 = 256 << 20;
/// Its number rises with every change of the format or of what a judgement means.
const MAGIC: [u8; 8] = *b"HROCTRU2";
const EXTENSION: &str = "truth";
/// Magic, key, checksum of the contents.
const HEADER_LEN: usize = 8 + 16 + 8;
/// Words of a judgement.
const JUDGEMENT_WORDS: usize = 10;

/// What all frames of a run have in common and their pixels depend on.
#[derive(Clone)]
pub struct TruthKey {
    hash: Xxh3Default,
    pixels: usize,
}

impl std::fmt::Debug for TruthKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "TruthKey({:032x})", self.hash.digest128())
    }
}

impl TruthKey {
    /// The key of frames of `size` pixels. `dependencies`: the baked file, the shaders, the depth
    /// convention, the adapter and its driver, in a fixed order.
    pub fn new(size: [u32; 2], dependencies: &[&[u8]]) -> Self {
        let mut hash = Xxh3Default::new();
        hash.update(&MAGIC);
        hash.update(bytemuck::bytes_of(&size));
        for dependency in dependencies {
            // The length first, so that no two lists run together.
            hash.update(&(dependency.len() as u64).to_le_bytes());
            hash.update(dependency);
        }
        Self {
            hash,
            pixels: size[0] as usize * size[1] as usize,
        }
    }

    fn of_frame(&self, frame: &[u8]) -> u128 {
        let mut hash = self.hash.clone();
        hash.update(frame);
        hash.digest128()
    }
}

/// A frame as it is without culling.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Depth and item buffer.
    pub image: Image,
    /// What was found wrong with it; `None` where nobody asked.
    pub judgement: Option<Judgement>,
}

/// The folder of entries.
#[derive(Clone, Debug)]
pub struct TruthCache {
    folder: PathBuf,
    max_bytes: u64,
    evict_every_bytes: u64,
}

impl TruthCache {
    /// The cache in `folder`, which is made when the first entry is stored.
    pub fn new(folder: PathBuf) -> Self {
        Self {
            folder,
            max_bytes: MAX_CACHE_BYTES,
            evict_every_bytes: EVICT_EVERY_BYTES,
        }
    }

    /// `$XDG_CACHE_HOME/hroc`, else `$HOME/.cache/hroc`; `None` where neither is set.
    pub fn default_folder() -> Option<PathBuf> {
        let absolute = |name| {
            std::env::var_os(name)
                .map(PathBuf::from)
                .filter(|path| path.is_absolute())
        };
        let base = absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")))?;
        Some(base.join("hroc"))
    }

    /// The frame with the uniform `frame`, if it is here and undamaged.
    pub fn load(&self, key: &TruthKey, frame: &[u8]) -> Option<Truth> {
        let id = key.of_frame(frame);
        let mut file = File::open(self.path(id)).ok()?;
        let expected = (HEADER_LEN + contents_len(key.pixels)) as u64;
        if file.metadata().ok()?.len() != expected {
            return None;
        }
        let mut bytes = Vec::with_capacity(expected as usize);
        // Not a byte more, even if the file grows meanwhile.
        file.by_ref().take(expected).read_to_end(&mut bytes).ok()?;
        let (header, contents) = bytes.split_at_checked(HEADER_LEN)?;
        if contents.len() != contents_len(key.pixels) || *header != entry_header(id, contents) {
            return None;
        }
        let (pixels, judgement) = contents.split_at(8 * key.pixels);
        let (depth, items) = pixels.split_at(4 * key.pixels);
        // For the order of eviction; no harm if it cannot be set.
        let _ = file.set_modified(SystemTime::now());
        Some(Truth {
            image: Image {
                depth_bits: bytemuck::pod_collect_to_vec(depth),
                items: bytemuck::pod_collect_to_vec(items),
            },
            judgement: judgement_of(bytemuck::pod_read_unaligned(judgement)),
        })
    }

    /// Keeps the frame with the uniform `frame`; how many bytes that took.
    ///
    /// # Errors
    /// Why it could not be kept; to warn with.
    fn store(&self, key: &TruthKey, frame: &[u8], truth: &Truth) -> Result<u64, String> {
        let warn = |error: &dyn std::fmt::Display| format!("the truth is not cached: {error}");
        fs::create_dir_all(&self.folder)
            .map_err(|error| warn(&format!("{}: {error}", self.folder.display())))?;
        let id = key.of_frame(frame);
        let Truth { image, judgement } = truth;
        let judgement = words_of(judgement.as_ref());
        let contents = [&image.depth_bits[..], &image.items, &judgement]
            .map(bytemuck::cast_slice::<u32, u8>)
            .concat();
        let entry = [&entry_header(id, &contents)[..], &contents].concat();
        let file = OutputFile::create(&self.path(id)).map_err(|error| warn(&error))?;
        // Entries carry a checksum.
        file.finish_unsynced(&entry).map_err(|error| warn(&error))?;
        Ok(entry.len() as u64)
    }

    /// Removes the entries used longest ago until the rest fits.
    fn evict(&self) {
        let Ok(entries) = fs::read_dir(&self.folder) else {
            return;
        };
        let mut entries = entries
            .flatten()
            .map(|entry| entry.path())
            .filter(|path| {
                path.extension()
                    .is_some_and(|extension| extension == EXTENSION)
            })
            .filter_map(|path| {
                let metadata = fs::metadata(&path).ok()?;
                Some((metadata.modified().ok()?, metadata.len(), path))
            })
            .collect::<Vec<_>>();
        entries.sort();
        let mut total = entries.iter().map(|(_, len, _)| len).sum::<u64>();
        for (_, len, path) in entries {
            if total <= self.max_bytes {
                break;
            }
            if fs::remove_file(path).is_ok() {
                total -= len;
            }
        }
    }

    fn path(&self, id: u128) -> PathBuf {
        self.folder
            .join(format!("{id:032x}"))
            .with_extension(EXTENSION)
    }
}

/// What a run adds to the cache, which stays within its limit meanwhile and thereafter.
#[derive(Debug)]
pub struct TruthStore<'a> {
    cache: &'a TruthCache,
    /// Bytes stored since the last eviction.
    pending_bytes: u64,
}

impl<'a> TruthStore<'a> {
    /// One that has stored nothing.
    pub const fn new(cache: &'a TruthCache) -> Self {
        Self {
            cache,
            pending_bytes: 0,
        }
    }

    /// See [`TruthCache::load`].
    pub fn load(&self, key: &TruthKey, frame: &[u8]) -> Option<Truth> {
        self.cache.load(key, frame)
    }

    /// Keeps the frame with the uniform `frame`. Now and then, and when the store is dropped, the entries used longest
    /// ago make room.
    ///
    /// # Errors
    /// Why it could not be kept; to warn with.
    pub fn store(&mut self, key: &TruthKey, frame: &[u8], truth: &Truth) -> Result<(), String> {
        self.pending_bytes += self.cache.store(key, frame, truth)?;
        if self.pending_bytes >= self.cache.evict_every_bytes {
            self.evict();
        }
        Ok(())
    }

    fn evict(&mut self) {
        self.cache.evict();
        self.pending_bytes = 0;
    }
}

impl Drop for TruthStore<'_> {
    fn drop(&mut self) {
        if self.pending_bytes > 0 {
            self.evict();
        }
    }
}

/// Depth, items and judgement.
const fn contents_len(pixels: usize) -> usize {
    8 * pixels + 4 * JUDGEMENT_WORDS
}

/// Zeros where there is none. Counts of pixels fit: no target has more than 2^32.
fn words_of(judgement: Option<&Judgement>) -> [u32; JUDGEMENT_WORDS] {
    let Some(judgement) = judgement else {
        return [0; JUDGEMENT_WORDS];
    };
    let Removed {
        stray,
        not_finite,
        true_,
    } = judgement.removed;
    let counts = [
        stray,
        not_finite,
        true_,
        judgement.strays,
        judgement.kept_strays,
    ];
    let [stray, not_finite, true_, strays, kept_strays] = counts.map(|count| count as u32);
    let (kind, [x, y], object) = judgement.first_fault.map_or((0, [0; 2], 0), |fault| {
        let kind = match fault.kind {
            FaultKind::TrueRemoved => 1,
            FaultKind::StrayKept => 2,
        };
        (kind, fault.pixel, fault.object)
    });
    [
        1,
        stray,
        not_finite,
        true_,
        strays,
        kept_strays,
        kind,
        x,
        y,
        object,
    ]
}

fn judgement_of(words: [u32; JUDGEMENT_WORDS]) -> Option<Judgement> {
    let [judged, counts @ .., kind, x, y, object] = words;
    let [stray, not_finite, true_, strays, kept_strays] = counts.map(|count| count as usize);
    let kind = match kind {
        1 => Some(FaultKind::TrueRemoved),
        2 => Some(FaultKind::StrayKept),
        _ => None,
    };
    (judged == 1).then(|| Judgement {
        removed: Removed {
            stray,
            not_finite,
            true_,
        },
        strays,
        kept_strays,
        first_fault: kind.map(|kind| Fault {
            kind,
            pixel: [x, y],
            object,
        }),
    })
}

fn entry_header(id: u128, contents: &[u8]) -> [u8; HEADER_LEN] {
    let mut header = [0; HEADER_LEN];
    header[..8].copy_from_slice(&MAGIC);
    header[8..24].copy_from_slice(&id.to_le_bytes());
    header[24..].copy_from_slice(&xxh3_64(contents).to_le_bytes());
    header
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const FRAME: &[u8] = b"camera";

    /// Every other one was judged.
    fn truth(id: u32) -> Truth {
        let judgement = Judgement {
            removed: Removed {
                stray: 1,
                not_finite: 2,
                true_: 3,
            },
            strays: 4,
            kept_strays: 5,
            first_fault: Some(Fault {
                kind: FaultKind::StrayKept,
                pixel: [1, 0],
                object: id,
            }),
        };
        Truth {
            image: Image {
                depth_bits: vec![0.5f32.to_bits(), 1],
                items: vec![id, u32::MAX],
            },
            judgement: (id % 2 == 1).then_some(judgement),
        }
    }

    #[test]
    fn a_stored_frame_comes_back_for_the_same_key_only() {
        let folder = tempfile::tempdir().unwrap();
        let cache = TruthCache::new(folder.path().join("made/on/demand"));
        let key = TruthKey::new([2, 1], &[b"scene", b"shader"]);
        assert_eq!(cache.load(&key, FRAME), None);
        cache.store(&key, FRAME, &truth(7)).unwrap();
        assert_eq!(cache.load(&key, FRAME), Some(truth(7)));
        assert_eq!(cache.load(&key, b"another camera"), None);
        for other in [
            TruthKey::new([1, 2], &[b"scene", b"shader"]),
            TruthKey::new([2, 1], &[b"sceneshader"]),
        ] {
            assert_eq!(cache.load(&other, FRAME), None);
        }
    }

    #[test]
    fn a_judgement_comes_back_as_it_was() {
        let full = truth(7).judgement.unwrap();
        let mut removed = full;
        removed.first_fault = full.first_fault.map(|fault| Fault {
            kind: FaultKind::TrueRemoved,
            ..fault
        });
        for judgement in [None, Some(Judgement::default()), Some(full), Some(removed)] {
            assert_eq!(judgement_of(words_of(judgement.as_ref())), judgement);
        }
    }

    #[test]
    fn a_damaged_entry_is_not_used() {
        let folder = tempfile::tempdir().unwrap();
        let cache = TruthCache::new(folder.path().into());
        let key = TruthKey::new([2, 1], &[]);
        cache.store(&key, FRAME, &truth(7)).unwrap();
        let path = cache.path(key.of_frame(FRAME));
        let good = fs::read(&path).unwrap();
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 1;
            fs::write(&path, bad).unwrap();
            assert_eq!(cache.load(&key, FRAME), None, "bit flipped in byte {at}");
        }
        for len in [0, 10, HEADER_LEN, good.len() - 1] {
            fs::write(&path, &good[..len]).unwrap();
            assert_eq!(cache.load(&key, FRAME), None, "cut to {len}");
        }
        fs::write(&path, &good).unwrap();
        assert_eq!(cache.load(&key, FRAME), Some(truth(7)));
    }

    /// A cache with room for two entries.
    fn small_cache(folder: &Path, evict_every_entries: u64) -> TruthCache {
        let entry_bytes = (HEADER_LEN + contents_len(2)) as u64;
        TruthCache {
            folder: folder.into(),
            max_bytes: 2 * entry_bytes,
            evict_every_bytes: evict_every_entries * entry_bytes,
        }
    }

    #[test]
    fn the_entries_used_longest_ago_go_first() {
        let folder = tempfile::tempdir().unwrap();
        let key = TruthKey::new([2, 1], &[]);
        let cache = small_cache(folder.path(), 100);
        let frame = u32::to_le_bytes;
        for i in 0..4 {
            cache.store(&key, &frame(i), &truth(i)).unwrap();
            let file = File::options()
                .write(true)
                .open(cache.path(key.of_frame(&frame(i))))
                .unwrap();
            file.set_modified(
                SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(1000 + u64::from(i)),
            )
            .unwrap();
        }
        assert!(cache.load(&key, &frame(0)).is_some());
        fs::write(folder.path().join("foreign.txt"), vec![0; 1000]).unwrap();
        cache.evict();
        let kept = [0, 1, 2, 3].map(|i| cache.load(&key, &frame(i)).is_some());
        assert_eq!(kept, [true, false, false, true]);
        assert!(folder.path().join("foreign.txt").exists());
    }

    #[test]
    fn a_long_run_stays_within_the_limit() {
        let folder = tempfile::tempdir().unwrap();
        let key = TruthKey::new([2, 1], &[]);
        let cache = small_cache(folder.path(), 3);
        let entries = || fs::read_dir(folder.path()).unwrap().count();
        let mut store = TruthStore::new(&cache);
        let mut counts = Vec::new();
        for i in 0..7 {
            store.store(&key, &u32::to_le_bytes(i), &truth(i)).unwrap();
            counts.push(entries());
        }
        assert_eq!(counts, [1, 2, 2, 3, 4, 2, 3]);
        drop(store);
        assert_eq!(entries(), 2);
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, b"").unwrap();
        let cache = TruthCache::new(file.join("cache"));
        let error = cache
            .store(&TruthKey::new([2, 1], &[]), FRAME, &truth(7))
            .unwrap_err();
        assert!(error.contains("not cached"), "{error}");
        cache.evict();
    }
}
