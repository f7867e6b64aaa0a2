//! The origins of objects: what their vertices are stored relative to.
//!
//! Positions are read in f64 and stored in f32. Objects that share an origin and share vertices stay
//! watertight, so a file has a common origin, and an object leaves it only where f32 about the common
//! origin would bend the object.

use glam::DVec3;

/// The displacement of a vertex that is taken for the common origin's sake, as a share of the object's
/// largest extent: 2^-20, a tenth of what a step of 16-bit positions displaces.
const MAX_DISPLACEMENT: f64 = 1.0 / (1 << 20) as f64;

/// The vertices of an object and their box.
pub(super) struct Extent<P> {
    positions: P,
    centre: DVec3,
    size: f64,
}

impl<P: Iterator<Item = DVec3> + Clone> Extent<P> {
    pub(super) fn new(positions: P) -> Self {
        let (min, max) = bounds(positions.clone());
        Self {
            positions,
            centre: min * 0.5 + max * 0.5,
            size: (max - min).max_element(),
        }
    }

    /// Whether f32 about `origin` displaces no vertex by more than [`MAX_DISPLACEMENT`].
    fn is_exact_about(&self, origin: DVec3) -> bool {
        let limit = self.size * MAX_DISPLACEMENT;
        self.positions.clone().all(|position| {
            let local = position - origin;
            (local.as_vec3().as_dvec3() - local).length() <= limit
        })
    }
}

/// The least and the largest coordinates; infinite in the wrong direction where there are no positions.
pub(super) fn bounds(positions: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    positions.fold(
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(min, max), position| (min.min(position), max.max(position)),
    )
}

/// The origin of each object.
///
/// The common origin is zero, as in the file, or the median of the objects' centres: whichever serves more
/// objects. The median is not moved by a few objects that lie elsewhere. An object that neither serves gets
/// the centre of its box. It is snapped to a grid of 1/256 to 1/512 of the object's size, so that
/// coordinates on a grid stay on it.
pub(super) fn origins<P: Iterator<Item = DVec3> + Clone>(objects: &[Extent<P>]) -> Vec<DVec3> {
    let about = |origin: DVec3| -> Vec<bool> {
        let exact = |object: &Extent<P>| object.is_exact_about(origin);
        objects.iter().map(exact).collect()
    };
    let count = |exact: &[bool]| exact.iter().filter(|&&exact| exact).count();
    let mut common = DVec3::ZERO;
    let mut exact = about(common);
    if count(&exact) < objects.len() {
        let median = median(objects);
        let exact_about_median = about(median);
        if count(&exact_about_median) > count(&exact) {
            (common, exact) = (median, exact_about_median);
        }
    }
    let origin = |(object, exact): (&Extent<P>, bool)| match exact {
        true => common,
        false => snapped(object.centre, object.size),
    };
    objects.iter().zip(exact).map(origin).collect()
}

fn median<P>(objects: &[Extent<P>]) -> DVec3 {
    let middle = |mut values: Vec<f64>| {
        let half = values.len() / 2;
        *values.select_nth_unstable_by(half, f64::total_cmp).1
    };
    let centre = [0, 1, 2].map(|axis| middle(objects.iter().map(|o| o.centre[axis]).collect()));
    let size = middle(objects.iter().map(|object| object.size).collect());
    snapped(centre.into(), size)
}

/// A point near `centre` on a power-of-two grid that goes by `size`; zero where neither is finite.
fn snapped(centre: DVec3, size: f64) -> DVec3 {
    let step = (size.log2().floor() - 8.0).exp2();
    let snapped = (centre / step).round() * step;
    let candidates = [snapped, centre];
    let finite = candidates.into_iter().find(|point| point.is_finite());
    finite.unwrap_or(DVec3::ZERO)
}
