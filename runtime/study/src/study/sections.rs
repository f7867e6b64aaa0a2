//! The chapters of a study's report.

use super::{CLAIMED, Measure, Pair, Tally, is_claimed, pairs};
use crate::compare::{Comparison, CourseRuns, unique};
use crate::metrics::{self, FrameClock};
use crate::report::figures::{Difference, curves, differences};
use crate::report::{Block, Section, count, number, per_course_figure, signed_share};
use crate::report::{modes_table, per_course};
use crate::results::RunResults;
use crate::statistics::{MARGIN, mean};
use crate::table::{ABSENT, Table};

/// The chapters before memory and machine.
pub fn sections(comparison: &Comparison) -> Vec<Section> {
    let pairs = pairs(comparison);
    let groupings = unique(pairs.iter().map(|pair| pair.grouping.as_str()));
    let section = |title: &str, blocks| Section {
        title: title.into(),
        blocks,
    };
    vec![
        section("Does the split rule matter?", verdict(&pairs, &groupings)),
        section("Mean frame times", thesis_tables(comparison, &groupings)),
        section(
            "Frame time against SAH",
            against_sah(comparison, &pairs, &[Measure::FrameTime, Measure::GpuTime]),
        ),
        section(
            "Work against SAH",
            against_sah(comparison, &pairs, &[Measure::RayBoxTests, Measure::Boxes]),
        ),
        section("Trees", trees(comparison)),
        section("Counters", per_course(comparison, modes_table)),
        section("Frame time over the path", over_path(comparison)),
    ]
}

/// A sentence and a row for each grouping.
fn verdict(pairs: &[Pair], groupings: &[&str]) -> Vec<Block> {
    let margin = 100.0 * MARGIN;
    let mut blocks = vec![Block::Text(format!(
        "Each rule is held against SAH, with the same mode, grouping, scene and camera path, frame by frame. \
         Equivalent: the 90 % interval of the relative difference of means lies within ±{margin} %, the margin that \
         was fixed beforehand. Different: the interval leaves out 0 and reaches beyond the margin. Undecided: \
         neither. Intervals come from 10,000 resamples of whole windows, or of path segments where frames are spread over the path, as neighbouring frames are alike. They are \
         not corrected for the number of pairs. That a rule changes a measure by no more than the margin is \
         confirmed where all pairs are equivalent, and refuted where one lies beyond the margin with its whole \
         interval."
    ))];
    blocks.extend(claims(pairs).into_iter().map(Block::Text));
    let mut table = Table::new([
        "grouping",
        "measure",
        "rules",
        "equivalent",
        "different",
        "beyond the margin",
        "undecided",
        "no more than the margin",
    ]);
    for grouping in groupings {
        for measure in Measure::ALL {
            for (rules, claimed) in [("those of the thesis", true), ("others", false)] {
                let tally = Tally::of(pairs.iter().filter(|pair| {
                    pair.grouping == *grouping
                        && pair.measure == measure
                        && is_claimed(pair) == claimed
                }));
                if tally == Tally::default() {
                    continue;
                }
                table.rows.push(vec![
                    (*grouping).to_owned(),
                    measure.name().to_owned(),
                    rules.to_owned(),
                    tally.equivalent.to_string(),
                    tally.different.to_string(),
                    tally.beyond_margin.to_string(),
                    tally.undecided.to_string(),
                    tally.claim().to_owned(),
                ]);
            }
        }
    }
    if !table.rows.is_empty() {
        blocks.push(Block::Table {
            title: String::new(),
            table,
        });
    }
    blocks
}

/// What became of the thesis' claim, a sentence or two for each grouping.
pub fn claims(pairs: &[Pair]) -> Vec<String> {
    let sentence = |grouping: &&str| {
        let claimed = |pair: &&Pair| {
            pair.grouping == **grouping && pair.measure == Measure::FrameTime && is_claimed(pair)
        };
        let tally = Tally::of(pairs.iter().filter(claimed));
        let size = |pair: &&Pair| pair.found.difference.estimate.abs();
        let largest = pairs.iter().filter(claimed);
        let largest = largest.max_by(|a, b| size(a).total_cmp(&size(b)))?;
        let [middle, equal_count] = CLAIMED;
        Some(format!(
            "With {grouping} grouping, that the split rule changes the frame time by little ({middle} and \
             {equal_count} against SAH) is {}. Of {} pairs {} are equivalent, {} different ({} of them surely beyond the margin), \
             {} undecided; the largest difference is {} ({} against {} ms: {}, {}, {} {}).",
            tally.claim(),
            tally.count(),
            tally.equivalent,
            tally.different,
            tally.beyond_margin,
            tally.undecided,
            signed_share(largest.found.difference.estimate),
            number(largest.other),
            number(largest.base),
            largest.scene,
            largest.path,
            largest.mode,
            largest.split,
        ))
    };
    let groupings = unique(pairs.iter().map(|pair| pair.grouping.as_str()));
    groupings.iter().filter_map(sentence).collect()
}

/// Scenes and rules by modes, for each grouping: Table 4 of the thesis.
fn thesis_tables(comparison: &Comparison, groupings: &[&str]) -> Vec<Block> {
    let mut blocks = vec![Block::Text(
        "By the host's clock, ms, over the frames that averages include; laid out as Table 4 of the thesis.".into(),
    )];
    let modes = unique(comparison.runs.iter().filter_map(|run| run.mode.as_deref()));
    for grouping in groupings {
        let mut table = Table::new(["scene", "tree"].into_iter().chain(modes.iter().copied()));
        for course in comparison.courses() {
            for split in unique(course.runs.iter().filter_map(|run| run.split.as_deref())) {
                let cell = |mode: &&str| {
                    let run = course.runs.iter().find(|run| {
                        run.mode.as_deref() == Some(*mode)
                            && run.split.as_deref() == Some(split)
                            && run.grouping.as_deref() == Some(grouping)
                    });
                    let times = run.and_then(|run| metrics::frame_times(run, FrameClock::Wall));
                    let mean = times.and_then(|times| mean(&times));
                    mean.map_or_else(|| ABSENT.to_owned(), number)
                };
                let mut row = vec![course.title(), split.to_owned()];
                row.extend(modes.iter().map(cell));
                table.rows.push(row);
            }
        }
        blocks.push(Block::Table {
            title: format!("{grouping} grouping"),
            table,
        });
    }
    blocks
}

/// A plot for each course, grouping and measure, and its numbers.
fn against_sah(comparison: &Comparison, pairs: &[Pair], measures: &[Measure]) -> Vec<Block> {
    let mut blocks = Vec::new();
    for course in comparison.courses() {
        let of_course =
            |pair: &&Pair| (pair.scene.as_str(), pair.path.as_str()) == (course.scene, course.path);
        let of_course = pairs.iter().filter(of_course).collect::<Vec<_>>();
        for &measure in measures {
            for grouping in unique(of_course.iter().map(|pair| pair.grouping.as_str())) {
                let lines = of_course
                    .iter()
                    .filter(|pair| pair.measure == measure && pair.grouping == grouping)
                    .map(|pair| Difference {
                        label: format!("{} {}", pair.mode, pair.split),
                        found: pair.found,
                    })
                    .collect::<Vec<_>>();
                if lines.is_empty() {
                    continue;
                }
                let what = format!("{} against SAH", measure.name());
                let kind = measure.name().replace(' ', "-");
                blocks.extend(per_course_figure(
                    &course,
                    &format!("against-sah-{kind}"),
                    &format!("{grouping} grouping, {}", measure.name()),
                    Some(differences(&lines, &what)),
                ));
            }
        }
    }
    blocks
}

/// The trees as they were baked.
fn trees(comparison: &Comparison) -> Vec<Block> {
    let mut blocks = vec![Block::Text(
        "SAH cost: boxes that a random ray through the scene's bounds meets. Overlap: surface that siblings share, \
         over the root's. Interior boxes: the part of the cost that depends on the tree, as the leaves are the \
         objects in each. Ray-box tests: of such a ray, from the root down. HROC starts its rays in groups, not at \
         the root, so these are a measure of the tree and no forecast."
            .into(),
    )];
    for scene in &comparison.trees {
        let mut table = Table::new([
            "tree",
            "nodes",
            "depth",
            "mean leaf depth",
            "SAH cost",
            "overlap",
            "interior boxes met",
            "ray-box tests",
        ]);
        for tree in &scene.trees {
            table.rows.push(vec![
                tree.split.clone(),
                count(tree.nodes as u64),
                tree.depth.to_string(),
                number(tree.mean_leaf_depth),
                number(tree.sah_cost),
                number(tree.overlap),
                number(tree.expected_boxes),
                number(tree.expected_ray_box_tests),
            ]);
        }
        blocks.push(Block::Table {
            title: scene.scene.clone(),
            table,
        });
    }
    blocks
}

/// For each mode and grouping a line per tree.
fn over_path(comparison: &Comparison) -> Vec<Block> {
    let mut blocks = Vec::new();
    for course in comparison.courses() {
        let setting = |run: &RunResults| {
            let mode = run.mode.as_deref().unwrap_or_default();
            format!("{mode}, {}", run.grouping.as_deref().unwrap_or_default())
        };
        for name in unique(course.runs.iter().map(|run| setting(run))) {
            let runs = course
                .runs
                .iter()
                .copied()
                .filter(|run| setting(run) == name);
            blocks.extend(curve(&course, &name, &runs.collect::<Vec<_>>()));
        }
    }
    blocks
}

fn curve(course: &CourseRuns<'_>, setting: &str, runs: &[&RunResults]) -> Option<Block> {
    let series = runs.iter().map(|run| run.series()).collect::<Vec<_>>();
    per_course_figure(course, "frame-time", setting, curves(runs, &series))
}

#[cfg(test)]
mod tests {
    use super::super::tests::three_trees;
    use crate::report::Block;

    #[test]
    fn the_report_says_what_became_of_the_claim() {
        let sections = super::sections(&three_trees());
        let texts = sections.iter().flat_map(|section| &section.blocks);
        let texts = texts.filter_map(|block| match block {
            Block::Text(text) => Some(text.as_str()),
            _ => None,
        });
        let text = texts.collect::<Vec<_>>().join("\n");
        assert!(
            text.contains("With published grouping")
                && text.contains("SAH) is refuted. Of 2 pairs 1 are"),
            "{text}"
        );
        assert!(text.contains("+100.0 % (24.0 against 12.0 ms"), "{text}");
        assert!(
            text.contains("adaptive grouping")
                && text.contains("SAH) is confirmed. Of 2 pairs 2 are"),
            "{text}"
        );
    }
}
