//! Holding a frame against the truth.

use serde::Serialize;

use crate::id_set::IdSet;
use crate::image::Image;

/// How a frame differs from the one where everything was drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FrameCheck {
    /// Objects that show in the truth.
    pub visible: usize,
    /// Pixels whose depth has other bits than the truth's. Depth is the judge, as the nearest depth does
    /// not depend on the order of drawing.
    pub wrong_pixels: usize,
    /// Pixels of right depth that show another object: two surfaces lie at the very same depth.
    pub depth_ties: usize,
    /// Visible objects that the method did not draw.
    pub false_negatives: usize,
}

impl FrameCheck {
    /// Compares a frame that drew the objects `drawn` with the truth; `visible` are the objects that show in
    /// it, blended ones included.
    ///
    /// # Panics
    /// If the images differ in size.
    pub fn new(truth: &Image, found: &Image, visible: &IdSet, drawn: &IdSet) -> Self {
        assert_eq!(truth.items.len(), found.items.len(), "images of one size");
        let pixels = || {
            let depths = truth
                .depth_bits
                .iter()
                .zip(&found.depth_bits)
                .map(|(a, b)| a == b);
            depths.zip(truth.items.iter().zip(&found.items).map(|(a, b)| a == b))
        };
        Self {
            visible: visible.len(),
            wrong_pixels: pixels().filter(|&(same_depth, _)| !same_depth).count(),
            depth_ties: pixels()
                .filter(|&(same_depth, same_item)| same_depth && !same_item)
                .count(),
            false_negatives: visible.minus(drawn).len(),
        }
    }

    /// The frame is the truth.
    pub const fn passed(&self) -> bool {
        self.wrong_pixels == 0 && self.false_negatives == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hroc_format::NO_OBJECT;

    #[test]
    fn each_kind_of_difference_is_counted() {
        let truth = Image {
            depth_bits: [0.5f32, 0.5, 0.25, 0.0].map(f32::to_bits).to_vec(),
            items: vec![3, 3, 7, NO_OBJECT],
        };
        let all: IdSet = [3, 7, 9].into_iter().collect();
        let same = FrameCheck::new(&truth, &truth, &truth.visible(), &all);
        assert_eq!(
            same,
            FrameCheck {
                visible: 2,
                ..Default::default()
            }
        );
        assert!(same.passed());

        let mut tie = truth.clone();
        tie.items[1] = 9;
        let tie = FrameCheck::new(&truth, &tie, &truth.visible(), &all);
        assert_eq!(
            (tie.depth_ties, tie.wrong_pixels, tie.passed()),
            (1, 0, true)
        );

        // One bit of depth, and an object that is missing.
        let mut wrong = truth.clone();
        wrong.depth_bits[0] ^= 1;
        wrong.depth_bits[2] = 0;
        wrong.items[2] = NO_OBJECT;
        let wrong = FrameCheck::new(&truth, &wrong, &truth.visible(), &[3].into_iter().collect());
        assert_eq!(
            (wrong.wrong_pixels, wrong.depth_ties, wrong.false_negatives),
            (2, 0, 1)
        );
        assert!(!wrong.passed());
    }

    #[test]
    fn an_undrawn_visible_object_fails_even_if_the_image_is_right() {
        let image = Image {
            depth_bits: vec![0],
            items: vec![3],
        };
        let check = FrameCheck::new(&image, &image, &image.visible(), &IdSet::default());
        assert_eq!(check.false_negatives, 1);
        assert!(!check.passed());
    }
}
