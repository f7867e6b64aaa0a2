//! `hroc report`.

use std::path::PathBuf;

use clap::Args;

use super::course::finish;
use crate::compare::Comparison;
use crate::error::StudyError;
use crate::report;

/// Options of `hroc report`.
#[derive(Debug, Args)]
pub(super) struct ReportArguments {
    /// The results.json of hroc compare or hroc study.
    results: PathBuf,
    /// Folder for the report; made if it is not there.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

pub(super) fn report(arguments: &ReportArguments) -> Result<u8, StudyError> {
    let comparison = Comparison::load(&arguments.results)?;
    report::create(&arguments.output)?;
    finish(&arguments.output, &comparison)
}
