//! Replay files: occluders and queries of one frame, to compare implementations by.
//!
//! Little-endian: u32 magic `0x31434F4D` ("MOC1"), u32 width, u32 height, f32 near; u32 triangles, 12 f32 each (three
//! clip-space vertices x, y, z, w; counter-clockwise front in y-up NDC); u32 kind of query (0 rectangle, 1
//! box), u32 queries, 5 f32 (NDC xmin ymin xmax ymax, and w of the nearest point) or 32 f32 (eight clip-space
//! corners) each. Nothing after that.

use std::io::Write;
use std::path::{Path, PathBuf};

use crate::footprint::Rect;
use crate::generate::{ClipTriangles, rects, triangles};

mod run;

pub use run::{Check, Report, RunError, RunOptions, run};

/// "MOC1".
pub const MAGIC: u32 = 0x3143_4F4D;
const RECT_FLOATS: usize = 5;
const BOX_FLOATS: usize = 32;
const TRIANGLE_FLOATS: usize = 12;

/// One frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// View depth of the near plane.
    pub near: f32,
    /// Occluders in clip space, in the order in which they are drawn.
    pub triangles: ClipTriangles,
    /// What is asked after that.
    pub queries: Queries,
}

/// Queries of one kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Queries {
    /// Rectangles.
    Rects(Vec<Rect>),
    /// Boxes by their corners in clip space.
    Boxes(Vec<[[f32; 4]; 8]>),
}

impl Queries {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Rects(rects) => rects.len(),
            Self::Boxes(boxes) => boxes.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A file that is no replay.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// It cannot be read.
    #[error("{}: cannot read it: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// It says something else than a replay should.
    #[error("{}: byte {at}: {problem}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Offset of what is wrong.
        at: usize,
        /// What that is, and what to do.
        problem: String,
    },
}

/// What is wrong, and where.
type Problem = (usize, String);

/// Reads forward through bytes, never past their end.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn word(&mut self, what: &str) -> Result<[u8; 4], Problem> {
        let word = self.bytes[self.at..]
            .first_chunk()
            .copied()
            .ok_or_else(|| {
                let problem =
                    format!("the file ends where {what} should be; copy or generate it again");
                (self.at, problem)
            })?;
        self.at += 4;
        Ok(word)
    }

    fn u32(&mut self, what: &str) -> Result<u32, Problem> {
        self.word(what).map(u32::from_le_bytes)
    }

    /// Records of `N` floats, as many as the file says and has.
    fn records<const N: usize>(
        &mut self,
        count: u32,
        what: &str,
    ) -> Result<Vec<[f32; N]>, Problem> {
        let rest = &self.bytes[self.at..];
        let (size, has) = (4 * N, rest.len() / (4 * N));
        if has < count as usize {
            let problem = format!(
                "{count} {what} of {size} bytes announced, but the file has room for {has}; copy or generate it again"
            );
            return Err((self.at, problem));
        }
        let bytes = &rest[..count as usize * size];
        self.at += bytes.len();
        let record = |record: &[u8]| -> [f32; N] {
            std::array::from_fn(|i| {
                f32::from_le_bytes([0, 1, 2, 3].map(|byte| record[4 * i + byte]))
            })
        };
        Ok(bytes.chunks_exact(size).map(record).collect())
    }
}

/// `M` vertices of floats.
fn vertices<const N: usize, const M: usize>(floats: [f32; N]) -> [[f32; 4]; M] {
    std::array::from_fn(|vertex| std::array::from_fn(|i| floats[4 * vertex + i]))
}

impl Replay {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read or is no replay.
    pub fn open(path: &Path) -> Result<Self, ReplayError> {
        let bytes = std::fs::read(path).map_err(|source| ReplayError::Read {
            path: path.into(),
            source,
        })?;
        Self::from_bytes(&bytes).map_err(|(at, problem)| ReplayError::Format {
            path: path.into(),
            at,
            problem,
        })
    }

    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// The offset of what is wrong, and what that is.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Problem> {
        let mut reader = Reader { bytes, at: 0 };
        let magic = reader.u32("the magic")?;
        if magic != MAGIC {
            let problem = format!(
                "this is no replay of masked occlusion culling: it starts with {magic:#010x}, not {MAGIC:#010x}"
            );
            return Err((0, problem));
        }
        let size = [reader.u32("the width")?, reader.u32("the height")?];
        if size
            .iter()
            .any(|side| !(1..=crate::MAX_SIDE).contains(side))
        {
            let problem = format!(
                "an image of {}x{} pixels; each side must be 1 to {}",
                size[0],
                size[1],
                crate::MAX_SIDE
            );
            return Err((4, problem));
        }
        let near = f32::from_le_bytes(reader.word("the near plane")?);
        if !(near.is_finite() && near >= crate::view::LEAST_W) {
            return Err((
                12,
                format!("a near plane at {near}; it must be positive and finite"),
            ));
        }
        let count = reader.u32("the number of triangles")?;
        let triangles = reader.records::<TRIANGLE_FLOATS>(count, "triangles")?;
        let at = reader.at;
        let kind = reader.u32("the kind of the queries")?;
        let count = reader.u32("the number of queries")?;
        let queries = match kind {
            0 => {
                let records = reader.records::<RECT_FLOATS>(count, "rectangles")?;
                let rect = |[x_min, y_min, x_max, y_max, nearest_w]: [f32; RECT_FLOATS]| Rect {
                    min: [x_min, y_min],
                    max: [x_max, y_max],
                    nearest_w,
                };
                Queries::Rects(records.into_iter().map(rect).collect())
            }
            1 => {
                let records = reader.records::<BOX_FLOATS>(count, "boxes")?;
                Queries::Boxes(records.into_iter().map(vertices).collect())
            }
            _ => {
                return Err((
                    at,
                    format!("queries of kind {kind}; known are 0 (rectangles) and 1 (boxes)"),
                ));
            }
        };
        if reader.at < bytes.len() {
            let problem = format!(
                "{} bytes follow the last query; nothing should",
                bytes.len() - reader.at
            );
            return Err((reader.at, problem));
        }
        Ok(Self {
            size,
            near,
            triangles: triangles.into_iter().map(vertices).collect(),
            queries,
        })
    }

    /// Writes the file.
    ///
    /// # Errors
    /// What the writer says; and if there are more than 2^32 - 1 triangles or queries.
    pub fn write(&self, mut to: impl Write) -> std::io::Result<()> {
        let count = |count: usize| u32::try_from(count).map_err(std::io::Error::other);
        let mut words = vec![
            MAGIC,
            self.size[0],
            self.size[1],
            self.near.to_bits(),
            count(self.triangles.len())?,
        ];
        words.extend(
            self.triangles
                .as_flattened()
                .as_flattened()
                .iter()
                .map(|v| v.to_bits()),
        );
        words.push(u32::from(matches!(self.queries, Queries::Boxes(_))));
        words.push(count(self.queries.len())?);
        match &self.queries {
            Queries::Rects(rects) => {
                let floats = rects
                    .iter()
                    .flat_map(|r| [r.min[0], r.min[1], r.max[0], r.max[1], r.nearest_w]);
                words.extend(floats.map(f32::to_bits));
            }
            Queries::Boxes(boxes) => {
                words.extend(
                    boxes
                        .as_flattened()
                        .as_flattened()
                        .iter()
                        .map(|v| v.to_bits()),
                );
            }
        }
        let bytes = words
            .into_iter()
            .flat_map(u32::to_le_bytes)
            .collect::<Vec<_>>();
        to.write_all(&bytes)
    }

    /// Random triangles of all kinds and random rectangles; equal seeds give equal replays.
    pub fn random(seed: u64, size: [u32; 2], triangle_count: usize, query_count: usize) -> Self {
        let near = 0.5;
        Self {
            size,
            near,
            triangles: triangles(seed, triangle_count, size, near),
            queries: Queries::Rects(rects(seed, query_count, size, near)),
        }
    }

    /// The same with a box about each rectangle's volume, as deep again as it is near.
    pub fn with_boxes(mut self) -> Self {
        if let Queries::Rects(rects) = &self.queries {
            let corners = |rect: &Rect| {
                std::array::from_fn(|corner| {
                    let x = if corner & 1 == 0 {
                        rect.min[0]
                    } else {
                        rect.max[0]
                    };
                    let y = if corner & 2 == 0 {
                        rect.min[1]
                    } else {
                        rect.max[1]
                    };
                    let w = if corner & 4 == 0 {
                        rect.nearest_w
                    } else {
                        2.0 * rect.nearest_w
                    };
                    [x * w, y * w, 0.0, w]
                })
            };
            self.queries = Queries::Boxes(rects.iter().map(corners).collect());
        }
        self
    }
}
