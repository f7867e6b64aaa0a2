//! Whether two series are as good as equal.

use super::bootstrap::{Interval, relative_difference};

/// Difference of means that does not matter, as a share. Fixed before anything was measured.
pub const MARGIN: f64 = 0.05;
/// With fewer frames than four segments of four there is no verdict.
const FEWEST_FRAMES: usize = 16;
/// Nor is there with fewer windows: their resamples are too few for an interval.
const FEWEST_WINDOWS: usize = 4;

/// What the interval of a difference says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The whole interval lies within the margin. With an interval of 90 % these are the two one-sided tests of
    /// Schuirmann (1987) at 5 % each.
    Equivalent,
    /// The interval leaves out 0 and reaches beyond the margin.
    Different,
    /// Neither: the frames do not tell.
    Undecided,
}

impl Verdict {
    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Equivalent => "equivalent",
            Self::Different => "different",
            Self::Undecided => "undecided",
        }
    }

    /// What an interval says at [`MARGIN`].
    pub fn of(interval: &Interval) -> Self {
        let Interval { low, high, .. } = *interval;
        if -MARGIN <= low && high <= MARGIN {
            Self::Equivalent
        } else if low > 0.0 || high < 0.0 {
            Self::Different
        } else {
            Self::Undecided
        }
    }
}

/// Two series, compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// By how much the second's mean exceeds the first's, as a share.
    pub difference: Interval,
    /// What that says.
    pub verdict: Verdict,
}

impl Comparison {
    /// The whole interval lies beyond the margin.
    pub fn is_beyond_margin(&self) -> bool {
        self.difference.low > MARGIN || self.difference.high < -MARGIN
    }
}

/// Compares `other` with `base`, frame by frame; `None` where there is nothing to compare. `windows` has the number of
/// frames of each window, see [`relative_difference`].
pub fn compare(base: &[f64], other: &[f64], windows: &[usize]) -> Option<Comparison> {
    let difference = relative_difference(base, other, windows)?;
    let few_windows = !windows.is_empty() && windows.len() < FEWEST_WINDOWS;
    let verdict = if base.len() < FEWEST_FRAMES || few_windows {
        Verdict::Undecided
    } else {
        Verdict::of(&difference)
    };
    Some(Comparison {
        difference,
        verdict,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_verdicts() {
        let verdict = |low, high| {
            Verdict::of(&Interval {
                estimate: 0.5 * (low + high),
                low,
                high,
            })
        };
        assert_eq!(verdict(-0.01, 0.02), Verdict::Equivalent);
        // Surely different from zero, and surely by too little to matter.
        assert_eq!(verdict(0.01, 0.02), Verdict::Equivalent);
        assert_eq!(verdict(-MARGIN, MARGIN), Verdict::Equivalent);
        assert_eq!(verdict(0.06, 0.2), Verdict::Different);
        assert_eq!(verdict(0.01, 0.2), Verdict::Different);
        assert_eq!(verdict(-0.3, -0.02), Verdict::Different);
        assert_eq!(verdict(-0.01, 0.06), Verdict::Undecided);
        assert_eq!(verdict(-0.2, 0.2), Verdict::Undecided);
    }

    #[test]
    fn verdicts_of_series() {
        let base = (0..64).map(|i| f64::from(10 + i % 5)).collect::<Vec<_>>();
        let times = |factor: f64| base.iter().map(|x| factor * x).collect::<Vec<_>>();
        let verdict = |other: &[f64]| compare(&base, other, &[]).unwrap().verdict;
        assert_eq!(verdict(&times(1.02)), Verdict::Equivalent);
        assert_eq!(verdict(&times(1.1)), Verdict::Different);
        assert!(compare(&base, &times(1.1), &[]).unwrap().is_beyond_margin());
        assert!(
            !compare(&base, &times(1.02), &[])
                .unwrap()
                .is_beyond_margin()
        );
        assert_eq!(verdict(&times(0.9)), Verdict::Different);
        // Half of the path much slower, the other much faster: the mean is the same, the path too short to say so.
        let halves = base.iter().zip(0..);
        let mixed = halves.map(|(x, i)| if i < 32 { 1.3 * x } else { 0.7 * x });
        assert_eq!(verdict(&mixed.collect::<Vec<_>>()), Verdict::Undecided);
        let short = compare(&base[..15], &times(1.5)[..15], &[]).unwrap();
        assert_eq!(short.verdict, Verdict::Undecided);
        for (windows, expected) in [
            (&[16; 4][..], Verdict::Different),
            (&[32; 2], Verdict::Undecided),
            (&[64], Verdict::Undecided),
        ] {
            let found = compare(&base, &times(1.5), windows).unwrap();
            assert_eq!(found.verdict, expected, "{windows:?}");
        }
        assert_eq!(compare(&[0.0; 20], &[0.0; 20], &[]), None);
    }
}
