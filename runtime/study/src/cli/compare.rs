//! `hroc compare`.

use clap::Args;

use super::course::{CourseArguments, GroupingName, names};
use crate::compare::{Kind, Selection, Splits, unique};
use crate::error::StudyError;
use crate::registry::{self, METHODS};

/// Options of `hroc compare`.
#[derive(Debug, Args)]
pub(super) struct CompareArguments {
    #[command(flatten)]
    course: CourseArguments,
    /// Only these methods (see hroc methods).
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    methods: Vec<String>,
    /// These modes of the methods that have them, or all; each method's default if left out.
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    modes: Vec<String>,
    /// How coarse the groups of bounds are, for methods that group.
    #[arg(
        long,
        value_enum,
        value_name = "NAME,..",
        value_delimiter = ',',
        default_value = "adaptive"
    )]
    groupings: Vec<GroupingName>,
    /// The trees, by the split rules that built them, for methods that read one: names, or all that were baked.
    #[arg(
        long,
        value_name = "NAME,..",
        value_delimiter = ',',
        default_value = "sah"
    )]
    split: Vec<String>,
    /// Every value that a sweep gives the knobs, one knob at a time.
    #[arg(long)]
    sweep: bool,
    /// The counted frame whose overdraw is mapped, from 0; the one in the middle if left out.
    #[arg(long, value_name = "FRAME")]
    overdraw_frame: Option<u32>,
}

pub(super) fn compare(arguments: &CompareArguments) -> Result<u8, StudyError> {
    let methods = match names("--methods", &arguments.methods)?.as_slice() {
        [] => Ok(METHODS.iter().collect()),
        given => given.iter().map(|name| registry::method(name)).collect(),
    };
    let modes = names("--modes", &arguments.modes)?;
    let all_modes = modes.contains(&"all");
    let splits = names("--split", &arguments.split)?;
    let selection = Selection {
        methods: methods.map_err(StudyError::Usage)?,
        modes: modes
            .into_iter()
            .filter(|&mode| mode != "all")
            .map(str::to_owned)
            .collect(),
        all_modes,
        groupings: Vec::new(),
        splits: match splits.contains(&"all") {
            true => Splits::Baked,
            false => Splits::Named(splits.into_iter().map(str::to_owned).collect()),
        },
        sweep: arguments.sweep,
    };
    selection.check().map_err(StudyError::Usage)?;
    let (_, frames) = arguments.course.sampling()?;
    let overdraw_frame = arguments.overdraw_frame.unwrap_or(frames / 2);
    if overdraw_frame >= frames {
        return Err(StudyError::Usage(format!(
            "--overdraw-frame {overdraw_frame}: there are {frames} frames, from 0"
        )));
    }
    arguments.course.run(
        Kind::Compare,
        selection,
        &unique(arguments.groupings.iter().copied()),
        Some(overdraw_frame),
        |_, _| Ok(()),
    )
}
