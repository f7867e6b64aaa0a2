//! `hroc msoc`.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use hroc_msoc::replay::{self, Replay, RunError, RunOptions};
use hroc_msoc::{IsaName, Mode};

use super::{Destination, JsonOutput, to_stdout};
use crate::error::{StudyError, exit};
use crate::output::keep_inputs;

const EXAMPLES: &str = "\
Examples:
  hroc msoc frame.moc                              times and answers with the best instructions there are
  hroc msoc frame.moc --mode inner --check         and whether anything is hidden that a GPU would show
  hroc msoc frame.moc --isa avx2 --threads 4 --json=frame.json

The crate hroc-msoc documents the file (module replay); its example random_replay writes one.";

/// Options of `hroc msoc`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct MsocArguments {
    /// A replay file: occluders and queries of one frame.
    file: PathBuf,
    /// Instruction set: avx512, avx2 or portable; the best that this CPU has if left out.
    #[arg(long, value_name = "NAME", value_parser = parse_isa)]
    isa: Option<IsaName>,
    /// How occluders are rasterized.
    #[arg(long, value_enum, default_value = "paper")]
    mode: ModeName,
    /// Mode inner: the rasterizer's grid has 2^-BITS pixels.
    #[arg(long, value_name = "BITS", default_value_t = 8, value_parser = clap::value_parser!(u8).range(0..=16))]
    subpixel_bits: u8,
    /// Threads to rasterize with.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// How often to rasterize and ask; times are medians.
    #[arg(long, value_name = "R", default_value_t = 11, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    repeat: u32,
    /// Compare the answers with a scalar full-resolution reference. Exit code 1 if mode inner hides what that sees.
    #[arg(long)]
    check: bool,
    /// Write the results as JSON; to the standard output if no file is named.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    json: Option<Destination>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ModeName {
    /// As published: fast, approximate.
    Paper,
    /// Never hides what a GPU would show.
    Inner,
}

fn parse_isa(name: &str) -> Result<IsaName, String> {
    IsaName::from_name(name).ok_or_else(|| {
        let known = IsaName::ALL.map(IsaName::name).join(", ");
        format!("there is no such instruction set; there are {known}")
    })
}

pub(super) fn msoc(arguments: &MsocArguments) -> Result<u8, StudyError> {
    let replay = Replay::open(&arguments.file)?;
    if let Some(file) = arguments.json.as_ref().and_then(Destination::file) {
        keep_inputs(&[&arguments.file], &[("--json", file)])?;
    }
    let json = arguments.json.as_ref().map(JsonOutput::open).transpose()?;
    let options = RunOptions {
        mode: match arguments.mode {
            ModeName::Paper => Mode::Paper,
            ModeName::Inner => Mode::Inner {
                subpixel_bits: arguments.subpixel_bits,
                depth_tolerance: 0.0,
            },
        },
        isa: arguments.isa,
        threads: arguments.threads.into(),
        repeat: arguments.repeat as usize,
        check: arguments.check,
    };
    let report = replay::run(&replay, &options).map_err(|error| match error {
        RunError::Isa(_) => StudyError::Cpu(error.to_string()),
        _ => StudyError::Usage(error.to_string()),
    })?;
    match json {
        Some(JsonOutput::Stdout) => {
            // The standard output belongs to the data.
            let _ = io::stderr().write_all(report.text().as_bytes());
            to_stdout(&to_json(&report))?;
        }
        Some(JsonOutput::File(file)) => {
            file.finish(to_json(&report).as_bytes())?;
            to_stdout(&report.text())?;
        }
        None => to_stdout(&report.text())?,
    }
    Ok(if report.failed() {
        exit::CHECK_FAILED
    } else {
        exit::GOOD
    })
}

fn to_json(report: &replay::Report) -> String {
    let mut text = serde_json::to_string_pretty(report).expect("numbers and names");
    text.push('\n');
    text
}
