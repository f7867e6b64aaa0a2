//! `hroc study`.

use std::path::Path;

use clap::Args;
use hroc_format::BakedScene;

use super::course::{CourseArguments, GroupingName, names};
use crate::compare::{Kind, Selection, Splits, unique};
use crate::error::StudyError;
use crate::registry;
use crate::study::BASE;

/// Options of `hroc study`.
#[derive(Debug, Args)]
pub(super) struct StudyArguments {
    #[command(flatten)]
    course: CourseArguments,
    /// Modes of hroc, or all.
    #[arg(
        long,
        value_name = "NAME,..",
        value_delimiter = ',',
        default_value = "na,cr,of,cr-of"
    )]
    modes: Vec<String>,
    /// How coarse the groups of bounds are.
    #[arg(
        long,
        value_enum,
        value_name = "NAME,..",
        value_delimiter = ',',
        default_value = "published,adaptive"
    )]
    groupings: Vec<GroupingName>,
    /// The trees to hold against sah, by the split rules that built them; all that were baked if left out.
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    split: Vec<String>,
}

pub(super) fn study(arguments: &StudyArguments) -> Result<u8, StudyError> {
    let hroc = registry::method("hroc").map_err(StudyError::Usage)?;
    let modes = names("--modes", &arguments.modes)?;
    let all_modes = modes.contains(&"all");
    let mut splits = vec![BASE];
    splits.extend(names("--split", &arguments.split)?);
    let splits = unique(splits);
    let selection = Selection {
        methods: vec![hroc],
        modes: modes
            .into_iter()
            .filter(|&mode| mode != "all")
            .map(str::to_owned)
            .collect(),
        all_modes,
        groupings: Vec::new(),
        splits: if splits.len() > 1 {
            Splits::Named(splits.into_iter().map(str::to_owned).collect())
        } else {
            Splits::Baked
        },
        sweep: false,
    };
    selection.check().map_err(StudyError::Usage)?;
    let groupings = unique(arguments.groupings.iter().copied());
    arguments
        .course
        .run(Kind::Study, selection, &groupings, None, has_trees)
}

/// A study needs two trees, one of them SAH's.
fn has_trees(file: &Path, baked: &BakedScene) -> Result<(), StudyError> {
    let bvhs = &baked.scene().bvhs;
    let names = bvhs
        .iter()
        .map(|bvh| bvh.split.as_str())
        .collect::<Vec<_>>();
    // Without objects there are no trees, nor anything to find out.
    if (names.contains(&BASE) && names.len() > 1) || baked.scene().objects.is_empty() {
        return Ok(());
    }
    Err(StudyError::FewTrees {
        path: file.into(),
        baked: names.join(", "),
    })
}
