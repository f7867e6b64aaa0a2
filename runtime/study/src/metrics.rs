//! Numbers that stand for a run: over its steady frames, one definition for every report.

use crate::results::{Frame, RunResults};
use crate::statistics::{mean, median, median_absolute_deviation, percentile, quartiles};

/// A clock that times frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameClock {
    /// The host's, from the first command recorded to the last one done.
    Wall,
    /// The device's, from the first stage's begin to the last one's end.
    Gpu,
}

/// Frame times of a run, milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTimes {
    /// Median over the frames.
    pub median: f64,
    /// Half the distance between the quartiles over the frames.
    pub spread: f64,
    /// 99th percentile of all samples.
    pub p99: f64,
    /// Median over the frames of the relative median absolute deviation of a frame's samples: what the machine adds,
    /// as a share; `None` where a frame was timed once.
    pub noise: Option<f64>,
}

/// Times of the steady frames, in their order; `None` where the clock was not used.
pub fn frame_times(run: &RunResults, clock: FrameClock) -> Option<Vec<f64>> {
    let frames = run.steady_frames().iter();
    match clock {
        FrameClock::Wall if run.repeats == 0 => None,
        FrameClock::Wall => Some(frames.map(|frame| frame.frame_ms).collect()),
        FrameClock::Gpu => frames.map(|frame| frame.gpu_ms).collect(),
    }
}

/// How many of the steady frames each window has, in their order; empty without windows.
pub fn window_lengths(run: &RunResults) -> Vec<usize> {
    let frames = run.steady_frames();
    if frames.iter().any(|frame| frame.window.is_none()) {
        return Vec::new();
    }
    let windows = frames.chunk_by(|a, b| a.window == b.window);
    windows.map(<[Frame]>::len).collect()
}

/// Means of the times of the steady frames, in their order; `None` where none were taken. Unlike the medians they have
/// all that a method did in one replay and not in another.
pub fn mean_frame_times(run: &RunResults) -> Option<Vec<f64>> {
    let mean = |frame: &Frame| match &frame.frame_samples_ms[..] {
        [] => frame.frame_ms,
        samples => samples.iter().sum::<f64>() / samples.len() as f64,
    };
    (run.repeats > 0).then(|| run.steady_frames().iter().map(mean).collect())
}

/// The frame times in four numbers.
pub fn summary(run: &RunResults, clock: FrameClock) -> Option<FrameTimes> {
    let times = frame_times(run, clock)?;
    let samples_of = |frame: &Frame| match clock {
        FrameClock::Wall => frame.frame_samples_ms.clone(),
        FrameClock::Gpu => frame.gpu_samples_ms.clone(),
    };
    let samples = run
        .steady_frames()
        .iter()
        .map(samples_of)
        .collect::<Vec<_>>();
    let all = samples.concat();
    let noise = samples
        .iter()
        .filter(|samples| samples.len() > 1)
        .filter_map(|samples| ratio(median_absolute_deviation(samples)?, median(samples)?));
    let [low, high] = quartiles(&times)?;
    Some(FrameTimes {
        median: median(&times)?,
        spread: 0.5 * (high - low),
        p99: percentile(if all.is_empty() { &times } else { &all }, 0.99)?,
        noise: median(&noise.collect::<Vec<_>>()),
    })
}

/// Mean over the steady frames that have a value; `None` if none has.
pub fn mean_over(run: &RunResults, value: impl Fn(&Frame) -> Option<f64>) -> Option<f64> {
    mean(
        &run.steady_frames()
            .iter()
            .filter_map(value)
            .collect::<Vec<_>>(),
    )
}

/// Mean number of pixels with wrong depth bits, per frame of the whole run: errors hide nowhere.
pub fn wrong_pixels(run: &RunResults) -> Option<f64> {
    Some(run.errors()?[0] as f64 / run.per_frame.len() as f64)
}

/// Mean number of visible objects that were not drawn, likewise.
pub fn false_negatives(run: &RunResults) -> Option<f64> {
    Some(run.errors()?[1] as f64 / run.per_frame.len() as f64)
}

/// Mean number of pixels where no culling shows something else without `hroc_keeps`, likewise; `None` where there are
/// none, which is the rule.
pub fn removed(run: &RunResults) -> Option<f64> {
    let removed = run.no_culling?.removed.all();
    (removed > 0).then(|| removed as f64 / run.per_frame.len() as f64)
}

/// Mean number of pixels that show strays where nothing is discarded, likewise.
pub fn strays(run: &RunResults) -> Option<f64> {
    let strays = run.no_culling?.strays;
    (strays > 0).then(|| strays as f64 / run.per_frame.len() as f64)
}

/// C/N: culled objects, of all.
pub fn culled_of_all(run: &RunResults) -> Option<f64> {
    let objects = run.scene.objects as f64;
    mean_over(run, |frame| ratio(objects - frame.pvs? as f64, objects))
}

/// C/R: culled objects, of those that do not show. Frames that show nothing are left out, as every object outside the
/// view volume counts as culled; `None` if there is no other frame.
pub fn culled_of_hidden(run: &RunResults) -> Option<f64> {
    let objects = run.scene.objects as f64;
    mean_over(run, |frame| {
        let visible = frame.visible.filter(|&visible| visible > 0)? as f64;
        ratio(objects - frame.pvs? as f64, objects - visible)
    })
}

/// Culled objects, of those that do not show, both among those in the view volume.
pub fn cull_rate_in_frustum(run: &RunResults) -> Option<f64> {
    mean_over(run, |frame| frame.cull_rate)
}

/// `a / b`, if that is a number.
pub fn ratio(a: f64, b: f64) -> Option<f64> {
    (b > 0.0).then(|| a / b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::NoCulling;
    use crate::results::tests::sample;

    #[test]
    fn the_numbers_of_a_small_run() {
        let mut run = sample();
        let times = summary(&run, FrameClock::Wall).unwrap();
        assert_eq!(
            (times.median, times.spread, times.p99, times.noise),
            (3.0, 0.5, 4.0, None)
        );
        assert_eq!(summary(&run, FrameClock::Gpu), None);
        assert_eq!(culled_of_all(&run), Some(0.5));
        assert_eq!(culled_of_hidden(&run), Some(5.0 / 6.0));
        assert_eq!(cull_rate_in_frustum(&run), Some(0.75));
        let mut empty = run.clone();
        (empty.per_frame[5].visible, empty.per_frame[5].pvs) = (Some(0), Some(0));
        assert_eq!(culled_of_hidden(&empty), Some(5.0 / 6.0));
        empty.per_frame[4].visible = Some(0);
        assert_eq!(culled_of_hidden(&empty), None);
        assert_eq!((removed(&run), strays(&run)), (Some(2.0), Some(3.0)));
        run.no_culling = Some(NoCulling::default());
        assert_eq!((removed(&run), strays(&run)), (None, None));
        run.per_frame[0].wrong_pixels = Some(3);
        assert_eq!(
            (wrong_pixels(&run), false_negatives(&run)),
            (Some(0.5), Some(0.0))
        );
        run.per_frame[5].frame_samples_ms = vec![3.0, 4.0, 9.0];
        let times = summary(&run, FrameClock::Wall).unwrap();
        assert_eq!((times.p99, times.noise), (9.0, Some(0.25)));
        run.repeats = 0;
        assert_eq!(summary(&run, FrameClock::Wall), None);
    }
}
