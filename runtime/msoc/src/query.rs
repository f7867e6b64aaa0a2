//! Occlusion queries against the masked depth buffer.

use bytemuck::Zeroable;

use crate::asked::{Asked, Batch, Tiles};
use crate::buffer::MaskedDepth;
use crate::footprint::{PixelRect, Rect, Visibility, rect_footprint, rect_footprints};
use crate::simd::{Kernel, MOST_LANES, Simd, lanes_in};
use crate::view::View;

/// Asks about a rectangle given by a caller.
#[derive(Clone, Copy)]
pub(crate) struct AsksRect<'a> {
    pub view: &'a View,
    pub buffer: &'a MaskedDepth,
    pub rect: &'a Rect,
}

impl Kernel for AsksRect<'_> {
    /// Or the pixels, if they are many: what asks about those would cost the others registers.
    type Output = Result<Visibility, PixelRect>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let rect = match rect_footprint(s, self.view, self.rect) {
            Err(known) => return Ok(known),
            Ok(rect) => rect,
        };
        let tiles = Tiles::of(self.buffer);
        let asked = Asked::new(tiles, rect);
        if asked.is_in_few(tiles) {
            Ok(answer(asked.is_hidden_in_few(s, tiles)))
        } else {
            Err(rect)
        }
    }
}

/// Asks about many rectangles.
pub(crate) struct AsksRects<'a> {
    pub view: &'a View,
    pub buffer: &'a MaskedDepth,
    pub rects: &'a [Rect],
    /// As many, [`Visibility::Visible`] all of them.
    pub answers: &'a mut [Visibility],
}

impl Kernel for AsksRects<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let tiles = Tiles::of(self.buffer);
        let mut last = [Rect::zeroed(); MOST_LANES];
        for (rects, answers) in self
            .rects
            .chunks(S::LANES)
            .zip(self.answers.chunks_mut(S::LANES))
        {
            let is_full = rects.len() == S::LANES;
            let rects = if is_full {
                rects
            } else {
                last[..rects.len()].copy_from_slice(rects);
                &last[..S::LANES]
            };
            let footprints = rect_footprints(s, self.view, rects);
            let batch = Batch::new(s, tiles, &footprints);
            let asked = (1 << answers.len()) - 1;
            let has_pixels = footprints.has_pixels & asked;
            for lane in lanes_in(footprints.is_outside & asked) {
                answers[lane] = Visibility::Outside;
            }
            for lane in lanes_in(has_pixels & batch.in_few) {
                answers[lane] = answer(batch.get(lane).is_hidden_in_few(s, tiles));
            }
            for lane in lanes_in(has_pixels & !batch.in_few) {
                answers[lane] = answer(batch.get(lane).is_hidden(s, tiles));
            }
        }
    }
}

/// Asks about pixels.
#[derive(Clone, Copy)]
pub(crate) struct AsksPixels<'a> {
    pub buffer: &'a MaskedDepth,
    pub rect: PixelRect,
}

impl Kernel for AsksPixels<'_> {
    type Output = Visibility;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Visibility {
        let tiles = Tiles::of(self.buffer);
        let asked = Asked::new(tiles, self.rect);
        answer(if asked.is_in_few(tiles) {
            asked.is_hidden_in_few(s, tiles)
        } else {
            asked.is_hidden(s, tiles)
        })
    }
}

#[inline(always)]
fn answer(is_hidden: bool) -> Visibility {
    if is_hidden {
        Visibility::Occluded
    } else {
        Visibility::Visible
    }
}
