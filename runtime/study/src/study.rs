//! Whether the split rule of the tree matters: every rule against the surface area heuristic (SAH), in every mode and
//! grouping, frame by frame.
//!
//! The thesis that HROC comes from finds little difference between SAH, middle and equal-count splits (Table 4) and
//! calls the method robust. Here each pair gets a verdict by a test of equivalence whose margin was fixed beforehand.

mod sections;

pub use sections::{claims, sections};

use crate::compare::{Comparison, CourseRuns};
use crate::metrics::{self, FrameClock};
use crate::results::{Counters, RunResults};
use crate::statistics::{self, Verdict, compare, mean};

/// The rule that all others are held against.
pub const BASE: &str = "sah";
/// The rules of the thesis.
const CLAIMED: [&str; 2] = ["middle", "equal-count"];

/// What is compared, frame by frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// By the host's clock.
    FrameTime,
    /// By the device's, where it is right.
    GpuTime,
    /// Ray-box tests of the batch occlusion test.
    RayBoxTests,
    /// Bounds that are rasterized.
    Boxes,
}

impl Measure {
    /// All, times first.
    pub const ALL: [Self; 4] = [
        Self::FrameTime,
        Self::GpuTime,
        Self::RayBoxTests,
        Self::Boxes,
    ];

    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::FrameTime => "frame time",
            Self::GpuTime => "GPU time",
            Self::RayBoxTests => "ray-box tests",
            Self::Boxes => "boxes",
        }
    }

    /// The steady frames' values; `None` where there are none.
    fn of(self, run: &RunResults) -> Option<Vec<f64>> {
        let counter = |pick: fn(&Counters) -> Option<u64>| {
            let frames = run.steady_frames().iter();
            frames
                .map(|frame| Some(pick(&frame.counters)? as f64))
                .collect()
        };
        match self {
            Self::FrameTime => metrics::frame_times(run, FrameClock::Wall),
            Self::GpuTime => metrics::frame_times(run, FrameClock::Gpu),
            Self::RayBoxTests => counter(|counters| counters.ray_box_tests),
            Self::Boxes => counter(|counters| counters.boxes_rasterized),
        }
    }
}

/// A split rule against SAH.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub struct Pair {
    pub scene: String,
    pub path: String,
    pub mode: String,
    pub grouping: String,
    /// The rule that is held against SAH.
    pub split: String,
    pub measure: Measure,
    /// SAH's mean, ms or a count.
    pub base: f64,
    /// The other's mean.
    pub other: f64,
    pub found: statistics::Comparison,
}

/// Every pair of every course: all that HROC ran with a tree other than SAH, each measure that it has.
pub fn pairs(comparison: &Comparison) -> Vec<Pair> {
    comparison.courses().iter().flat_map(of_course).collect()
}

fn of_course(course: &CourseRuns<'_>) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for other in &course.runs {
        let (Some(split), Some(grouping)) = (&other.split, &other.grouping) else {
            continue;
        };
        let same = |run: &&&RunResults| {
            run.split.as_deref() == Some(BASE)
                && (&run.method, &run.mode) == (&other.method, &other.mode)
                && (&run.grouping, &run.knobs) == (&other.grouping, &other.knobs)
        };
        let Some(base) = course.runs.iter().find(same).filter(|_| split != BASE) else {
            continue;
        };
        for measure in Measure::ALL {
            let (Some(ours), Some(theirs)) = (measure.of(base), measure.of(other)) else {
                continue;
            };
            let (Some(found), Some(base), Some(mean)) = (
                compare(&ours, &theirs, &metrics::window_lengths(base)),
                mean(&ours),
                mean(&theirs),
            ) else {
                continue;
            };
            pairs.push(Pair {
                scene: course.scene.to_owned(),
                path: course.path.to_owned(),
                mode: other.mode.clone().unwrap_or_default(),
                grouping: grouping.clone(),
                split: split.clone(),
                measure,
                base,
                other: mean,
                found,
            });
        }
    }
    pairs
}

/// What the pairs of one grouping say of the claim that the split rule changes a measure by no more than the margin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Tally {
    pub equivalent: usize,
    pub different: usize,
    pub undecided: usize,
    /// Of those that are different: whose whole interval lies beyond the margin.
    pub beyond_margin: usize,
}

impl Tally {
    /// Of these pairs.
    pub fn of<'a>(pairs: impl Iterator<Item = &'a Pair>) -> Self {
        let mut tally = Self::default();
        for pair in pairs {
            *match pair.found.verdict {
                Verdict::Equivalent => &mut tally.equivalent,
                Verdict::Different => &mut tally.different,
                Verdict::Undecided => &mut tally.undecided,
            } += 1;
            let surely = pair.found.verdict == Verdict::Different && pair.found.is_beyond_margin();
            tally.beyond_margin += usize::from(surely);
        }
        tally
    }

    /// How many pairs there are.
    pub const fn count(&self) -> usize {
        self.equivalent + self.different + self.undecided
    }

    /// What they say together: one pair beyond the margin refutes the claim, equivalence of all confirms it. A pair
    /// that differs by an amount that may lie on either side of the margin does neither.
    pub const fn claim(&self) -> &'static str {
        if self.beyond_margin > 0 {
            "refuted"
        } else if self.equivalent > 0 && self.equivalent == self.count() {
            "confirmed"
        } else {
            "undecided"
        }
    }
}

/// Whether the thesis speaks of this rule.
fn is_claimed(pair: &Pair) -> bool {
    CLAIMED.contains(&pair.split.as_str())
}

/// `verdicts.csv`: a row for each pair and measure.
pub fn csv(comparison: &Comparison) -> Vec<u8> {
    let in_memory = "a write into memory";
    let mut writer = ::csv::Writer::from_writer(Vec::new());
    let head = [
        "scene",
        "path",
        "mode",
        "grouping",
        "split",
        "measure",
        "sah_mean",
        "mean",
        "difference",
        "low",
        "high",
        "verdict",
    ];
    writer.write_record(head).expect(in_memory);
    for pair in pairs(comparison) {
        let difference = pair.found.difference;
        let numbers = [
            pair.base,
            pair.other,
            difference.estimate,
            difference.low,
            difference.high,
        ];
        let numbers = numbers.map(|number| number.to_string());
        let mut row = vec![
            pair.scene,
            pair.path,
            pair.mode,
            pair.grouping,
            pair.split,
            pair.measure.name().to_owned(),
        ];
        row.extend(numbers);
        row.push(pair.found.verdict.name().to_owned());
        writer.write_record(row).expect(in_memory);
    }
    writer.into_inner().expect(in_memory)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::compare::Kind;
    use crate::results::tests::sample;

    /// HROC with three trees in two groupings: in the published one the middle split is twice as slow.
    pub(crate) fn three_trees() -> Comparison {
        let mut comparison = Comparison::new(Kind::Study, "hroc study".into());
        for grouping in ["published", "adaptive"] {
            for (split, slower) in [("sah", 1.0), ("middle", 2.0), ("equal-count", 1.01)] {
                let mut run = sample();
                run.knobs.clear();
                (run.grouping, run.split) = (Some(grouping.into()), Some(split.into()));
                let frame = run.per_frame[0].clone();
                let factor = if grouping == "published" { slower } else { 1.0 };
                run.per_frame = (0..44)
                    .map(|i| {
                        let mut frame = frame.clone();
                        frame.frame_ms = factor * f64::from(10 + i % 5);
                        frame.counters.ray_box_tests = Some((100.0 * slower) as u64);
                        frame
                    })
                    .collect();
                comparison.runs.push(run);
            }
        }
        comparison
    }

    #[test]
    fn each_rule_is_held_against_sah_in_its_own_grouping() {
        let comparison = three_trees();
        let pairs = pairs(&comparison);
        // Two rules, two groupings, time and tests; there is no GPU time, and there are no boxes.
        assert_eq!(pairs.len(), 2 * 2 * 2);
        let find = |grouping: &str, split: &str, measure| {
            let mut found = pairs.iter().filter(|pair| {
                (pair.grouping.as_str(), pair.split.as_str(), pair.measure)
                    == (grouping, split, measure)
            });
            let pair = found.next().unwrap();
            assert!(found.next().is_none());
            pair
        };
        let middle = find("published", "middle", Measure::FrameTime);
        assert_eq!(middle.found.verdict, Verdict::Different);
        assert!((middle.found.difference.estimate - 1.0).abs() < 1e-12);
        assert_eq!((middle.base, middle.other), (12.0, 24.0));
        let equal = find("published", "equal-count", Measure::FrameTime);
        assert_eq!(equal.found.verdict, Verdict::Equivalent);
        let adaptive = find("adaptive", "middle", Measure::FrameTime);
        assert_eq!(adaptive.found.verdict, Verdict::Equivalent);
        let tests = find("adaptive", "middle", Measure::RayBoxTests);
        assert_eq!(tests.found.verdict, Verdict::Different);
        let rows = csv(&comparison);
        assert_eq!(String::from_utf8(rows).unwrap().lines().count(), 9);
    }

    #[test]
    fn one_difference_refutes_and_only_equivalence_of_all_confirms() {
        let pairs = pairs(&three_trees());
        let claim = |grouping: &str| {
            let of = pairs.iter().filter(|pair| {
                pair.measure == Measure::FrameTime && pair.grouping == grouping && is_claimed(pair)
            });
            Tally::of(of).claim()
        };
        assert_eq!(
            (claim("published"), claim("adaptive")),
            ("refuted", "confirmed")
        );
        let tally = |equivalent, different, undecided| Tally {
            equivalent,
            different,
            undecided,
            beyond_margin: 0,
        };
        assert_eq!(tally(3, 0, 1).claim(), "undecided");
        assert_eq!(tally(3, 1, 0).claim(), "undecided");
        assert_eq!(tally(0, 0, 0).claim(), "undecided");
    }
}
