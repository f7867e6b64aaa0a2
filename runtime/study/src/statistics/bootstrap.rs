//! How sure a difference is between two series over the frames of one path.

use fastrand::Rng;

/// How often the path is put together anew.
pub const RESAMPLES: usize = 10_000;
/// Share of the resamples in an interval.
pub const CONFIDENCE: f64 = 0.9;
const SEED: u64 = 0x4852_4f43;

/// A share of a series' mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// As measured.
    pub estimate: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// By how much the mean of `other` exceeds that of `base`, as a share of the latter, with the interval that holds
/// [`CONFIDENCE`] of the resamples (percentiles). Both series are of the same frames; `None` where they differ in
/// length or `base` sums to nothing.
///
/// Neighbouring frames resemble each other, so what is drawn with replacement are not frames but path segments: runs
/// of ceil(sqrt(n)) of n frames in a row, the path closed to a ring so that every frame is drawn equally often
/// (Politis and Romano 1992, "A circular block-resampling procedure for stationary data"). Both series use the same
/// segments.
pub fn relative_difference(base: &[f64], other: &[f64]) -> Option<Interval> {
    let n = base.len();
    let ratio = |[base, other]: [f64; 2]| other / base - 1.0;
    let sums = [base, other].map(|series| series.iter().sum::<f64>());
    if n != other.len() || sums[0].is_nan() || sums[0] <= 0.0 {
        return None;
    }
    let block = (n as f64).sqrt().ceil() as usize;
    // Sums of the first i frames of the ring, twice round it.
    let [base_sums, other_sums] = [base, other].map(|series| {
        let twice = series.iter().chain(series);
        let sums = twice.scan(0.0, |sum, value| {
            *sum += value;
            Some(*sum)
        });
        std::iter::once(0.0).chain(sums).collect::<Vec<_>>()
    });
    let mut rng = Rng::with_seed(SEED);
    let mut ratios = Vec::with_capacity(RESAMPLES);
    for _ in 0..RESAMPLES {
        let mut sum = [0.0; 2];
        let mut left = n;
        while left > 0 {
            let first = rng.usize(0..n);
            let end = first + block.min(left);
            left -= end - first;
            sum[0] += base_sums[end] - base_sums[first];
            sum[1] += other_sums[end] - other_sums[first];
        }
        // A resample of frames in which `base` has nothing says nothing.
        if sum[0] > 0.0 {
            ratios.push(ratio(sum));
        }
    }
    let tail = 0.5 * (1.0 - CONFIDENCE);
    Some(Interval {
        estimate: ratio(sums),
        low: super::quantile(&ratios, tail)?,
        high: super::quantile(&ratios, 1.0 - tail)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normal numbers (Box and Muller).
    fn normal(rng: &mut Rng) -> f64 {
        let radius = (-2.0 * (1.0 - rng.f64()).ln()).sqrt();
        radius * (std::f64::consts::TAU * rng.f64()).cos()
    }

    /// Differences of two series of `n` frames with a true difference of 0 and noise of which each frame keeps
    /// `memory` of the last one's.
    fn noisy(rng: &mut Rng, n: usize, memory: f64) -> [Vec<f64>; 2] {
        let mut noise = normal(rng);
        let other = (0..n).map(|_| {
            let value = 100.0 + 5.0 * noise;
            noise = memory * noise + (1.0 - memory * memory).sqrt() * normal(rng);
            value
        });
        let other = other.collect();
        [vec![100.0; n], other]
    }

    fn coverage(n: usize, memory: f64) -> f64 {
        let mut rng = Rng::with_seed(1);
        let trials = 200;
        let hits = (0..trials).filter(|_| {
            let [base, other] = noisy(&mut rng, n, memory);
            let interval = relative_difference(&base, &other).unwrap();
            interval.low <= 0.0 && 0.0 <= interval.high
        });
        hits.count() as f64 / f64::from(trials)
    }

    #[test]
    fn the_interval_of_independent_frames_is_the_textbook_one() {
        let mut rng = Rng::with_seed(3);
        let [base, other] = noisy(&mut rng, 400, 0.0);
        let interval = relative_difference(&base, &other).unwrap();
        // 1.645 standard errors each way, 0.05 / sqrt(400) each.
        let width = interval.high - interval.low;
        assert!(
            (width / (2.0 * 1.645 * 0.0025) - 1.0).abs() < 0.2,
            "{width}"
        );
        assert!((interval.low + width / 2.0 - interval.estimate).abs() < 0.1 * width);
        assert!(coverage(100, 0.0) > 0.82);
    }

    #[test]
    fn segments_see_that_neighbouring_frames_are_alike() {
        // Nine tenths of a frame's noise are the last one's: single frames drawn at random would put the truth
        // into less than 40 % of such intervals (they would be 4.4 times too narrow).
        let covered = coverage(400, 0.9);
        assert!(covered > 0.7, "{covered}");
        let mut rng = Rng::with_seed(4);
        let width = |[base, other]: [Vec<f64>; 2]| {
            let interval = relative_difference(&base, &other).unwrap();
            interval.high - interval.low
        };
        let [alike, apart] = [0.9, 0.0].map(|memory| width(noisy(&mut rng, 400, memory)));
        assert!(alike > 2.0 * apart, "{alike} {apart}");
    }

    #[test]
    fn a_constant_factor_is_found_exactly_and_every_time_alike() {
        let base = (0..50).map(|i| f64::from(10 + i % 7)).collect::<Vec<_>>();
        let other = base.iter().map(|value| 1.25 * value).collect::<Vec<_>>();
        let found = relative_difference(&base, &other).unwrap();
        for value in [found.estimate, found.low, found.high] {
            assert!((value - 0.25).abs() < 1e-12);
        }
        let mut rng = Rng::with_seed(5);
        let [base, other] = noisy(&mut rng, 60, 0.5);
        assert_eq!(
            relative_difference(&base, &other),
            relative_difference(&base, &other)
        );
        assert_eq!(relative_difference(&[0.0; 9], &[1.0; 9]), None);
        assert_eq!(relative_difference(&[1.0; 9], &[1.0; 8]), None);
        assert_eq!(relative_difference(&[], &[]), None);
    }
}
