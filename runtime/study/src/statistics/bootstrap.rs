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
/// `windows` has the number of frames of each window. Frames of one window are alike, and windows are apart, so whole
/// windows are drawn with replacement, and both series use the same ones. As there are few windows, percentiles alone
/// would give intervals that are too narrow; they are those of `tail`. Frames of a lone window are resampled like
/// those without windows.
///
/// Without windows, neighbouring frames resemble each other, so what is drawn with replacement are not frames but path segments: runs
/// of ceil(sqrt(n)) of n frames in a row, the path closed to a ring so that every frame is drawn equally often
/// (Politis and Romano 1992, "A circular block-resampling procedure for stationary data"). Both series use the same
/// segments.
pub fn relative_difference(base: &[f64], other: &[f64], windows: &[usize]) -> Option<Interval> {
    let n = base.len();
    let ratio = |[base, other]: [f64; 2]| other / base - 1.0;
    let sums = [base, other].map(|series| series.iter().sum::<f64>());
    if n != other.len() || sums[0].is_nan() || sums[0] <= 0.0 {
        return None;
    }
    let by_windows = windows.len() > 1;
    if by_windows && windows.iter().sum::<usize>() != n {
        return None;
    }
    let block = (n as f64).sqrt().ceil() as usize;
    let starts = windows.iter().scan(0, |next, length| {
        let start = *next;
        *next += length;
        Some((start, start + length))
    });
    let starts = starts.collect::<Vec<_>>();
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
        let mut add = |first: usize, end: usize| {
            sum[0] += base_sums[end] - base_sums[first];
            sum[1] += other_sums[end] - other_sums[first];
        };
        if by_windows {
            for _ in 0..starts.len() {
                let (first, end) = starts[rng.usize(0..starts.len())];
                add(first, end);
            }
        } else {
            let mut left = n;
            while left > 0 {
                let first = rng.usize(0..n);
                let end = first + block.min(left);
                left -= end - first;
                add(first, end);
            }
        }
        // A resample of frames in which `base` has nothing says nothing.
        if sum[0] > 0.0 {
            ratios.push(ratio(sum));
        }
    }
    let tail = if by_windows {
        tail(windows.len())
    } else {
        0.5 * (1.0 - CONFIDENCE)
    };
    Some(Interval {
        estimate: ratio(sums),
        low: super::quantile(&ratios, tail)?,
        high: super::quantile(&ratios, 1.0 - tail)?,
    })
}

/// The share of the resamples below an interval and above it, for `n` windows: Phi(-sqrt(n / (n - 1)) t), with t the
/// 95 % point of Student's distribution with n - 1 degrees of freedom (Hesterberg 2015, "What Teachers Should Know
/// About the Bootstrap", expanded percentile interval). It comes down to `0.5 * (1 - CONFIDENCE)` for many windows.
fn tail(n: usize) -> f64 {
    let freedom = n as f64 - 1.0;
    // The 95 % points of Student's distribution for 1 to 4 degrees of freedom; its expansion from there on
    // (Abramowitz and Stegun 26.7.5) is right to 0.001.
    let z: f64 = 1.644_854;
    let t = match n {
        0..=2 => 6.314,
        3 => 2.920,
        4 => 2.353,
        5 => 2.132,
        _ => {
            z + (z.powi(3) + z) / (4.0 * freedom)
                + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * freedom.powi(2))
                + (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z)
                    / (384.0 * freedom.powi(3))
        }
    };
    normal_tail(t * (n as f64 / freedom.max(1.0)).sqrt())
}

/// The share of the normal distribution beyond `x`, above 0, to 1e-7 (Abramowitz and Stegun 26.2.17).
fn normal_tail(x: f64) -> f64 {
    let k = 1.0 / (1.0 + 0.231_641_9 * x);
    let factors = [
        1.330_274_429,
        -1.821_255_978,
        1.781_477_937,
        -0.356_563_782,
        0.319_381_530,
    ];
    let sum = factors.iter().fold(0.0, |sum, factor| k * (factor + sum));
    sum * (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt()
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
            let interval = relative_difference(&base, &other, &[]).unwrap();
            interval.low <= 0.0 && 0.0 <= interval.high
        });
        hits.count() as f64 / f64::from(trials)
    }

    #[test]
    fn the_interval_of_independent_frames_is_the_textbook_one() {
        let mut rng = Rng::with_seed(3);
        let [base, other] = noisy(&mut rng, 400, 0.0);
        let interval = relative_difference(&base, &other, &[]).unwrap();
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
            let interval = relative_difference(&base, &other, &[]).unwrap();
            interval.high - interval.low
        };
        let [alike, apart] = [0.9, 0.0].map(|memory| width(noisy(&mut rng, 400, memory)));
        assert!(alike > 2.0 * apart, "{alike} {apart}");
    }

    #[test]
    fn tails_of_few_windows_are_wider_than_those_of_many() {
        // Phi(-1), Phi(-1.644854), Phi(-3).
        for (x, expected) in [(1.0, 0.158_655), (1.644_854, 0.05), (3.0, 0.001_349_9)] {
            assert!((normal_tail(x) - expected).abs() < 1e-6, "{x}");
        }
        // t(5) is 2.015, t(9) is 1.833, t(29) is 1.699.
        for (n, t) in [(6, 2.015_f64), (10, 1.833), (30, 1.699)] {
            let n_f = n as f64;
            let expected = normal_tail(t * (n_f / (n_f - 1.0)).sqrt());
            assert!((tail(n) - expected).abs() < 2e-4, "{n}");
        }
        assert!(tail(2) < tail(4) && tail(4) < tail(6) && tail(6) < tail(100));
        assert!((tail(1_000_000) - 0.05).abs() < 1e-5);
    }

    #[test]
    fn windows_are_resampled_whole() {
        // Windows that differ much, of frames that are nearly the same.
        let mut rng = Rng::with_seed(7);
        let trials = 200;
        let [mut by_windows, mut by_segments] = [0, 0];
        for _ in 0..trials {
            let windows = (0..6).map(|_| 100.0 + 5.0 * normal(&mut rng));
            let other = windows.flat_map(|value| [value; 10]).collect::<Vec<_>>();
            let base = [100.0; 60];
            let hit = |windows: &[usize]| {
                let interval = relative_difference(&base, &other, windows).unwrap();
                i32::from(interval.low <= 0.0 && 0.0 <= interval.high)
            };
            by_windows += hit(&[10; 6]);
            by_segments += hit(&[]);
        }
        assert!(
            by_windows > 165 && by_windows > by_segments,
            "{by_windows} {by_segments}"
        );
        assert_eq!(relative_difference(&[1.0; 9], &[1.0; 9], &[4, 4]), None);
        let lone = relative_difference(&[1.0, 2.0, 3.0], &[2.0, 1.0, 3.0], &[3]);
        assert_eq!(
            lone,
            relative_difference(&[1.0, 2.0, 3.0], &[2.0, 1.0, 3.0], &[])
        );
    }

    #[test]
    fn a_constant_factor_is_found_exactly_and_every_time_alike() {
        let base = (0..50).map(|i| f64::from(10 + i % 7)).collect::<Vec<_>>();
        let other = base.iter().map(|value| 1.25 * value).collect::<Vec<_>>();
        let found = relative_difference(&base, &other, &[]).unwrap();
        for value in [found.estimate, found.low, found.high] {
            assert!((value - 0.25).abs() < 1e-12);
        }
        let mut rng = Rng::with_seed(5);
        let [base, other] = noisy(&mut rng, 60, 0.5);
        assert_eq!(
            relative_difference(&base, &other, &[]),
            relative_difference(&base, &other, &[])
        );
        assert_eq!(relative_difference(&[0.0; 9], &[1.0; 9], &[]), None);
        assert_eq!(relative_difference(&[1.0; 9], &[1.0; 8], &[]), None);
        assert_eq!(relative_difference(&[], &[], &[]), None);
    }
}
