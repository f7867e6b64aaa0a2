//! `hroc report`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::course::finish;
use crate::compare::Comparison;
use crate::error::StudyError;
use crate::report;

/// Options of `hroc report`.
#[derive(Debug, Args)]
pub(super) struct ReportArguments {
    /// The results.json of hroc compare or hroc study. Several of one kind and one machine make one report.
    #[arg(required = true)]
    results: Vec<PathBuf>,
    /// Folder for the report; made if it is not there.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

pub(super) fn report(arguments: &ReportArguments) -> Result<u8, StudyError> {
    let mut loaded = arguments.results.iter().map(|path| Comparison::load(path));
    let mut comparison = loaded.next().expect("clap asks for one")?;
    for (other, path) in loaded.zip(&arguments.results[1..]) {
        let other = other?;
        if (other.kind, &other.host) != (comparison.kind, &comparison.host) {
            return Err(StudyError::Results {
                path: path.clone(),
                reason: "it is of another kind or another machine than the first one; make a report of its own of it"
                    .to_owned(),
            });
        }
        comparison.join(other);
    }
    let inputs: Vec<&Path> = arguments.results.iter().map(PathBuf::as_path).collect();
    report::create(&arguments.output, &inputs)?;
    finish(&arguments.output, &comparison)
}
