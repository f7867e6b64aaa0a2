//! Occluders into the depth buffer: on one thread triangle by triangle, on several by bands of the image.

use std::ops::Range;

use rayon::prelude::*;

use crate::buffer::MaskedDepth;
use crate::clip::{Polygon, clip};
use crate::raster::{Band, Target, polygon, triangle};
use crate::setup::{Triangle, set_up};
use crate::simd::{Isa, Kernel, Simd, lanes_in};
use crate::view::View;

/// Triangles of which each thread sets some up before bands are rasterized; bounds the memory for them.
const ROUND: usize = 1 << 16;
/// Triangles that one thread sets up at a time.
const CHUNK: usize = 1 << 10;
/// Fewer triangles than this are not worth waking threads for.
const WORTH_THREADS: usize = 2 * CHUNK;

/// Clip-space triangles in the order in which they are rasterized.
pub(crate) trait Triangles: Sync {
    fn count(&self) -> usize;
    fn vertex(&self, triangle: usize, corner: usize) -> &[f32; 4];
}

/// Three vertices each.
impl Triangles for &[[[f32; 4]; 3]] {
    #[inline(always)]
    fn count(&self) -> usize {
        self.len()
    }
    #[inline(always)]
    fn vertex(&self, triangle: usize, corner: usize) -> &[f32; 4] {
        &self[triangle][corner]
    }
}

/// Indices into vertices.
pub(crate) struct Indexed<'a> {
    pub vertices: &'a [[f32; 4]],
    pub indices: &'a [[u32; 3]],
}

impl Triangles for Indexed<'_> {
    #[inline(always)]
    fn count(&self) -> usize {
        self.indices.len()
    }
    #[inline(always)]
    fn vertex(&self, triangle: usize, corner: usize) -> &[f32; 4] {
        &self.vertices[self.indices[triangle][corner] as usize]
    }
}

/// Rasterizes all triangles, on the threads of the current rayon pool if `parallel`. The result is the same.
pub(crate) fn rasterize<T: Triangles>(
    isa: Isa,
    view: &View,
    buffer: &mut MaskedDepth,
    triangles: &T,
    parallel: bool,
) {
    let rows = buffer.tiles[1] as usize;
    let threads = rayon::current_num_threads();
    if !parallel || threads == 1 || triangles.count() < WORTH_THREADS || rows == 1 {
        let band = whole(buffer);
        return isa.run(Serial {
            view,
            band,
            triangles,
        });
    }
    // More bands than threads, so that a crowded one does not keep the others waiting.
    let rows_per_band = rows.div_ceil(4 * threads).max(1);
    let band_height = rows_per_band * isa.lanes();
    let (columns, size) = (buffer.tiles[0] as usize, buffer.size);
    let band_words = rows_per_band * buffer.row_words();
    for from in (0..triangles.count()).step_by(ROUND) {
        let to = triangles.count().min(from + ROUND);
        let chunks = (from..to).into_par_iter().step_by(CHUNK).map(|from| {
            isa.run(SetUp {
                view,
                triangles,
                range: from..to.min(from + CHUNK),
                band_height,
                bands: rows.div_ceil(rows_per_band),
            })
        });
        let chunks = chunks.collect::<Vec<_>>();
        let bands = buffer.words_mut().par_chunks_mut(band_words).enumerate();
        bands.for_each(|(index, words)| {
            let band = Band {
                words,
                columns,
                first_row: index * rows_per_band,
                size,
            };
            isa.run(Banded {
                band,
                index,
                chunks: &chunks,
            });
        });
    }
}

fn whole(buffer: &mut MaskedDepth) -> Band<'_> {
    Band {
        columns: buffer.tiles[0] as usize,
        first_row: 0,
        size: buffer.size,
        words: buffer.words_mut(),
    }
}

/// What is done with the visible triangles.
pub(crate) trait Visit<S: Simd> {
    fn triangle(&mut self, s: S, triangle: &Triangle);
    fn polygon(&mut self, s: S, polygon: &Polygon);
}

/// Sets triangles up and visits those that can be seen, in order.
#[inline(always)]
pub(crate) fn for_each<S: Simd, T: Triangles>(
    s: S,
    view: &View,
    triangles: &T,
    range: Range<usize>,
    visit: &mut impl Visit<S>,
) {
    let mut from = range.start;
    while from < range.end {
        let count = (range.end - from).min(S::LANES);
        let batch = set_up(s, view, triangles, from, count);
        for lane in lanes_in(batch.ready | batch.to_clip) {
            if batch.to_clip >> lane & 1 == 0 {
                visit.triangle(s, &batch.triangle(lane));
            } else if let Some(polygon) = clip(
                view,
                [0, 1, 2].map(|corner| triangles.vertex(from + lane, corner)),
            ) {
                visit.polygon(s, &polygon);
            }
        }
        from += count;
    }
}

/// What is rasterized.
enum Primitive {
    Triangle(Triangle),
    Polygon(Box<Polygon>),
}

/// Set-up and rasterization in one go.
struct Serial<'a, T> {
    view: &'a View,
    band: Band<'a>,
    triangles: &'a T,
}

impl<T: Triangles> Kernel for Serial<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let range = 0..self.triangles.count();
        let mut target = Target::new(s, self.band);
        for_each(s, self.view, self.triangles, range, &mut target);
    }
}

impl<S: Simd> Visit<S> for Target<'_, S> {
    #[inline(always)]
    fn triangle(&mut self, s: S, it: &Triangle) {
        triangle(s, self, it);
    }
    #[inline(always)]
    fn polygon(&mut self, s: S, it: &Polygon) {
        polygon(s, self, it);
    }
}

/// Set-up of some triangles, sorted by band.
struct SetUp<'a, T> {
    view: &'a View,
    triangles: &'a T,
    range: Range<usize>,
    /// Pixels.
    band_height: usize,
    bands: usize,
}

/// What was set up, and per band the indices of what touches it, in order.
struct Chunk {
    primitives: Vec<Primitive>,
    bands: Vec<Vec<u32>>,
    /// Pixels.
    band_height: usize,
}

impl<T: Triangles> Kernel for SetUp<'_, T> {
    type Output = Chunk;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Chunk {
        let mut chunk = Chunk {
            primitives: Vec::with_capacity(self.range.len()),
            bands: vec![Vec::new(); self.bands],
            band_height: self.band_height,
        };
        for_each(s, self.view, self.triangles, self.range, &mut chunk);
        chunk
    }
}

impl Chunk {
    fn push(&mut self, [first, end]: [i32; 2], primitive: Primitive) {
        let bands = first as usize / self.band_height..=(end as usize - 1) / self.band_height;
        for band in &mut self.bands[bands] {
            band.push(self.primitives.len() as u32);
        }
        self.primitives.push(primitive);
    }
}

impl<S: Simd> Visit<S> for Chunk {
    #[inline(always)]
    fn triangle(&mut self, _: S, it: &Triangle) {
        self.push(it.rows, Primitive::Triangle(*it));
    }
    #[inline(always)]
    fn polygon(&mut self, _: S, it: &Polygon) {
        self.push(it.rows, Primitive::Polygon(Box::new(*it)));
    }
}

/// The primitives of all chunks that touch a band.
struct Banded<'a> {
    band: Band<'a>,
    index: usize,
    chunks: &'a [Chunk],
}

impl Kernel for Banded<'_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let mut target = Target::new(s, self.band);
        for chunk in self.chunks {
            for &primitive in &chunk.bands[self.index] {
                match &chunk.primitives[primitive as usize] {
                    Primitive::Triangle(it) => triangle(s, &mut target, it),
                    Primitive::Polygon(it) => polygon(s, &mut target, it),
                }
            }
        }
    }
}
