//! What the image of no culling says about `hroc_keeps`.
//!
//! Every method discards by `hroc_keeps` (object.wgsl), and so does the truth that it is held against. A fault of
//! `hroc_keeps` itself is in both, so that comparison cannot find it. Here no culling is also drawn without it, and an
//! oracle in f64 judges the fragments that show.
//!
//! Two kinds of pixels are faults, whatever the method:
//! - a *true* fragment was removed: it lies within its object's padded bounds and was refused all the same;
//! - a *stray* was kept: it lies outside them, so no test of bounds is bound to find it.
//!
//! One fragment is judged per pixel and image, the one that shows. A true fragment that was removed behind a stray of
//! another object is seen only once the stray is gone.

use hroc_format::{NO_OBJECT, ObjectBounds};
use hroc_runtime::{DepthConvention, FrameUniform};
use serde::{Deserialize, Serialize};

use crate::fragment_oracle::{FragmentOracle, Standing};
use crate::image::Image;

/// No culling of one frame, drawn by one vertex shader and three fragment shaders.
#[derive(Clone, Copy, Debug)]
pub struct Unculled<'a> {
    /// Discards what `hroc_keeps` refuses: the truth.
    pub kept: &'a Image,
    /// Discards nothing.
    pub plain: &'a Image,
    /// Discards what has no finite depth. It is `plain` where [`needs_finite`] says no.
    pub finite: &'a Image,
}

/// Whether the image without fragments of infinite or NaN depth may differ from `plain` in a way that counts.
///
/// The depth of such a fragment is clamped to 0 or 1 or stays NaN in the buffer, so it shows in one of these values. One
/// that was overdrawn later has changed `plain` only if `plain` and `kept` differ, or if both hold it.
pub fn needs_finite(kept: &Image, plain: &Image) -> bool {
    let is_extreme = |bits: u32| {
        let depth = f32::from_bits(bits);
        !(depth > 0.0 && depth < 1.0)
    };
    kept != plain
        || plain
            .depth_bits
            .iter()
            .zip(&plain.items)
            .any(|(&bits, &item)| item != NO_OBJECT && is_extreme(bits))
}

/// Pixels where no culling shows something else without `hroc_keeps`, by what was removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Removed {
    /// A fragment outside its object's padded bounds.
    pub stray: usize,
    /// A fragment whose depth is infinite or NaN.
    pub not_finite: usize,
    /// A fragment within its object's padded bounds: a fault.
    #[serde(rename = "true")]
    pub true_: usize,
}

impl Removed {
    /// Every pixel.
    pub const fn all(&self) -> usize {
        self.stray + self.not_finite + self.true_
    }
}

impl std::ops::AddAssign for Removed {
    fn add_assign(&mut self, other: Self) {
        self.stray += other.stray;
        self.not_finite += other.not_finite;
        self.true_ += other.true_;
    }
}

/// What is wrong with a fragment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// It lies within its object's padded bounds and was removed.
    TrueRemoved,
    /// It lies outside them, or has no finite depth, and was kept.
    StrayKept,
}

/// A fragment that `hroc_keeps` judged wrongly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// What is wrong.
    pub kind: FaultKind,
    /// Column and row from the top left.
    pub pixel: [u32; 2],
    /// The fragment's object.
    pub object: u32,
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            pixel: [x, y],
            object,
            ..
        } = self;
        write!(f, "pixel ({x}, {y}), object {object}: ")?;
        f.write_str(match self.kind {
            FaultKind::TrueRemoved => {
                "`hroc_keeps` removes a fragment that lies within its object's padded bounds"
            }
            FaultKind::StrayKept => {
                "`hroc_keeps` keeps a fragment that lies outside its object's padded bounds"
            }
        })
    }
}

/// What the images of one frame say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Judgement {
    /// Pixels that `hroc_keeps` changes.
    pub removed: Removed,
    /// Pixels that show a stray where nothing is discarded.
    pub strays: usize,
    /// Pixels that show a stray in spite of `hroc_keeps`: faults.
    pub kept_strays: usize,
    /// The first fault, row by row from the top.
    pub first_fault: Option<Fault>,
}

/// Judges the frame of `uniform`; `bounds` are those of its objects, by id.
///
/// # Panics
/// If the images differ in size, or show an object that has no bounds.
pub fn judge(
    images: Unculled<'_>,
    uniform: &FrameUniform,
    depth: DepthConvention,
    bounds: &[ObjectBounds],
) -> Judgement {
    let oracle = FragmentOracle::new(uniform, depth);
    judge_by(images, uniform.size, |pixel, depth, object| {
        oracle.standing(pixel, depth, &bounds[object as usize])
    })
}

/// What shows in a pixel: bits of the depth, and the object.
type Shown = (u32, u32);

fn judge_by(
    images: Unculled<'_>,
    [width, height]: [u32; 2],
    standing: impl Fn([u32; 2], f32, u32) -> Standing,
) -> Judgement {
    let pixels = width as usize * height as usize;
    for image in [images.kept, images.plain, images.finite] {
        assert_eq!(image.items.len(), pixels, "images of one size");
    }
    let shown = |image: &Image, index: usize| (image.depth_bits[index], image.items[index]);
    let mut judgement = Judgement::default();
    for index in 0..pixels {
        let pixel = [index as u32 % width, index as u32 / width];
        let [kept, plain, finite] =
            [images.kept, images.plain, images.finite].map(|image| shown(image, index));
        // Nothing shows: nothing to judge.
        let standing = |(bits, object): Shown| {
            (object != NO_OBJECT).then(|| standing(pixel, f32::from_bits(bits), object))
        };
        let plain_standing = standing(plain);
        let not_finite = plain != finite;
        let is_stray = plain_standing.is_some_and(Standing::is_stray);
        judgement.strays += usize::from(not_finite || is_stray);
        let mut fault = None;
        if kept != plain {
            let (finite_standing, removed) = (standing(finite), &mut judgement.removed);
            if kept != finite && finite_standing == Some(Standing::Inside) {
                removed.true_ += 1;
                fault = Some((FaultKind::TrueRemoved, finite.1));
            } else if not_finite {
                removed.not_finite += 1;
            } else {
                removed.stray += 1;
            }
        }
        let is_kept_stray = if kept == plain {
            not_finite || plain_standing == Some(Standing::Outside)
        } else {
            standing(kept) == Some(Standing::Outside)
        };
        if is_kept_stray {
            judgement.kept_strays += 1;
            fault = Some((FaultKind::StrayKept, kept.1));
        }
        judgement.first_fault = judgement.first_fault.or(fault.map(|(kind, object)| Fault {
            kind,
            pixel,
            object,
        }));
    }
    judgement
}

#[cfg(test)]
mod tests {
    use super::*;

    const BACKGROUND: (f32, u32) = (0.0, NO_OBJECT);

    fn image(pixels: &[(f32, u32)]) -> Image {
        Image {
            depth_bits: pixels.iter().map(|(depth, _)| depth.to_bits()).collect(),
            items: pixels.iter().map(|&(_, item)| item).collect(),
        }
    }

    /// Judges one row. Object 1 is a stray, object 2 a stray by no more than rounding, all others are true.
    fn judged(kept: &[(f32, u32)], plain: &[(f32, u32)], finite: &[(f32, u32)]) -> Judgement {
        let [kept, plain, finite] = [kept, plain, finite].map(image);
        let images = Unculled {
            kept: &kept,
            plain: &plain,
            finite: &finite,
        };
        judge_by(
            images,
            [kept.items.len() as u32, 1],
            |_, _, object| match object {
                1 => Standing::Outside,
                2 => Standing::JustOutside,
                _ => Standing::Inside,
            },
        )
    }

    #[test]
    fn an_image_of_true_fragments_has_nothing_to_report() {
        let row = [(0.5, 3), BACKGROUND, (0.25, 4)];
        assert_eq!(judged(&row, &row, &row), Judgement::default());
    }

    #[test]
    fn what_was_removed_is_told_by_kind() {
        let kept = [(0.5, 3), (0.5, 3), BACKGROUND, (0.5, 3), (0.5, 3)];
        // A stray, one by a hair, an object that is gone, a NaN alone, and a NaN before a true fragment.
        let plain = [(0.9, 1), (0.6, 2), (0.4, 5), (1.0, 4), (1.0, 4)];
        let finite = [(0.9, 1), (0.6, 2), (0.4, 5), (0.5, 3), (0.7, 6)];
        let judgement = judged(&kept, &plain, &finite);
        let removed = Removed {
            stray: 2,
            not_finite: 1,
            true_: 2,
        };
        assert_eq!(judgement.removed, removed);
        assert_eq!(removed.all(), 5);
        assert_eq!((judgement.strays, judgement.kept_strays), (4, 0));
        let fault = judgement.first_fault.unwrap();
        assert_eq!(
            fault.to_string(),
            "pixel (2, 0), object 5: `hroc_keeps` removes a fragment that lies within its object's padded bounds"
        );
    }

    #[test]
    fn a_stray_that_is_kept_is_a_fault_and_rounding_is_none() {
        // A stray, one by a hair, a NaN that was kept, and a stray behind one that was removed.
        let kept = [(0.9, 1), (0.6, 2), (1.0, 4), (0.8, 1)];
        let plain = [(0.9, 1), (0.6, 2), (1.0, 4), (0.9, 1)];
        let finite = [(0.9, 1), (0.6, 2), (0.5, 3), (0.9, 1)];
        let judgement = judged(&kept, &plain, &finite);
        assert_eq!((judgement.strays, judgement.kept_strays), (4, 3));
        assert_eq!(
            judgement.removed,
            Removed {
                stray: 1,
                ..Default::default()
            }
        );
        let fault = judgement.first_fault.unwrap();
        assert_eq!(
            (fault.kind, fault.pixel, fault.object),
            (FaultKind::StrayKept, [0, 0], 1)
        );
    }

    #[test]
    fn the_third_image_is_drawn_only_where_it_can_differ() {
        let row = image(&[(0.5, 3), BACKGROUND]);
        assert!(!needs_finite(&row, &row));
        assert!(needs_finite(&row, &image(&[(0.5, 3), (0.1, 4)])));
        for extreme in [0.0, 1.0, f32::NAN] {
            let row = image(&[(extreme, 3), BACKGROUND]);
            assert!(needs_finite(&row, &row));
        }
    }
}
