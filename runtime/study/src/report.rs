//! Reports: tables, plots and one page, all of them renderings of a [`Comparison`].

mod csv;
pub mod figures;
mod heat_map;
mod html;
mod json;
mod markdown;
mod numbers;
pub mod plot;
mod sections;
mod tables;

use std::path::Path;

pub(crate) use numbers::{count, number, signed_share};
pub use sections::{Block, Image, Section, sections};
pub(crate) use sections::{figure as per_course_figure, per_course};
pub(crate) use tables::modes as modes_table;

use crate::compare::{Comparison, Kind};
use crate::error::StudyError;
use crate::output::{OutputFile, create_folder, keep_inputs_in};

/// The data, from which all other files are made.
pub const RESULTS: &str = "results.json";
/// The page.
pub const PAGE: &str = "report.html";
/// Folder of the plots as files.
const FIGURES: &str = "figures";

/// Makes the folder that a report goes to, and makes sure that it can be written and that no rendering takes the place
/// of one of the `inputs`.
///
/// # Errors
/// If it cannot.
pub fn create(folder: &Path, inputs: &[&Path]) -> Result<(), StudyError> {
    keep_inputs_in(folder, inputs, |name| {
        has_ending(name, &["html", "csv", "md"])
    })?;
    keep_inputs_in(&folder.join(FIGURES), inputs, |name| {
        has_ending(name, &["svg", "png"])
    })?;
    create_folder(folder)?;
    for file in [RESULTS, PAGE, "results.csv", "report.md"] {
        OutputFile::create(&folder.join(file))?;
    }
    create_folder(&folder.join(FIGURES))
}

fn has_ending(name: &str, endings: &[&str]) -> bool {
    name.rsplit_once('.')
        .is_some_and(|(_, ending)| endings.contains(&ending))
}

/// The shortest report: a table for a terminal, and who was skipped.
pub fn overview(comparison: &Comparison) -> String {
    let mut text = String::new();
    if comparison.kind == Kind::Study {
        for claim in crate::study::claims(&crate::study::pairs(comparison)) {
            text += &format!("{claim}\n\n");
        }
    }
    for table in [tables::overview(comparison), tables::skipped(comparison)]
        .into_iter()
        .flatten()
    {
        text += &format!("{}\n", table.markdown());
    }
    text
}

/// Writes `results.json`.
///
/// # Errors
/// If that fails.
pub fn write_results(folder: &Path, comparison: &Comparison) -> Result<(), StudyError> {
    OutputFile::create(&folder.join(RESULTS))?.finish(json::json(comparison).as_bytes())
}

/// Writes everything that is rendered from the results.
///
/// # Errors
/// If a file cannot be written.
pub fn write_renderings(folder: &Path, comparison: &Comparison) -> Result<(), StudyError> {
    let write =
        |name: &str, contents: &[u8]| OutputFile::create(&folder.join(name))?.finish(contents);
    let sections = sections(comparison);
    write("results.csv", &csv::csv(comparison))?;
    if comparison.kind == Kind::Study {
        write("verdicts.csv", &crate::study::csv(comparison))?;
    }
    write(
        "report.md",
        markdown::markdown(comparison, &sections).as_bytes(),
    )?;
    for block in sections.iter().flat_map(|section| &section.blocks) {
        match block {
            Block::Figure { name, svg, .. } => {
                write(&format!("{FIGURES}/{name}.svg"), svg.as_bytes())?
            }
            Block::Images(images) => {
                for image in images {
                    write(&format!("{FIGURES}/{}.png", image.name), &image.png)?;
                }
            }
            Block::Text(_) | Block::Table { .. } => {}
        }
    }
    write(PAGE, html::html(comparison, &sections).as_bytes())
}
