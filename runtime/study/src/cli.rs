//! The command line of `hroc`.

mod calibrate;
mod compare;
mod course;
mod hard_cases;
mod msoc;
mod path;
mod report;
mod run;
mod study;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use hroc_format::{ArchivedScene, BakedScene};
use hroc_runtime::DepthConvention;

use crate::camera_path::{CameraPath, orbit, walk_in};
use crate::error::{StudyError, exit};
use crate::output::OutputFile;
use crate::registry;

const EXAMPLES: &str = "\
Examples:
  hroc run house.hroc --check                      HROC along the walk-in path, every frame checked
  hroc run house.hroc --method noc --png noc.png   no culling, and its last frame as an image
  hroc run house.hroc --split middle --json -      results as JSON on the standard output
  hroc compare house.hroc town.hroc -o out         every method on the same frames; see out/report.html
  hroc study house.hroc -o out                     whether the split rule of the tree matters
  hroc report out/results.json -o out              the same report once more, from its data
  hroc path house.hroc orbit -o orbit.json         a standard camera path as a file, to edit
  hroc hard-cases                                  every method over the hard cases
  hroc msoc frame.moc --check                      masked software occlusion culling on a recorded frame
  hroc calibrate                                   what draws, boxes and queries cost on this device
  hroc methods                                     the culling methods there are

Baked scenes come from: hroc-bake bake SCENE.glb -o SCENE.hroc

Exit codes: 0 good, 1 a check failed, 2 usage, 3 bad input, 4 the device cannot do it";

/// Runs, checks and measures occlusion culling over baked scenes.
#[derive(Debug, Parser)]
#[command(name = "hroc", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a culling method over the frames of a camera path.
    Run(Box<run::RunArguments>),
    /// Run many methods side by side and write a report.
    Compare(Box<compare::CompareArguments>),
    /// Hold the split rules of hroc's tree against each other and write a report.
    Study(Box<study::StudyArguments>),
    /// Write the report of a comparison again, from its results.
    Report(report::ReportArguments),
    /// Write a standard camera path of a scene as a file.
    Path(path::PathArguments),
    /// Run every method over scenes on which occlusion culling has failed.
    HardCases(hard_cases::HardCasesArguments),
    /// Play a recorded frame through masked software occlusion culling, without a GPU.
    Msoc(msoc::MsocArguments),
    /// Measure what drawing, boxes and occlusion queries cost on this device.
    Calibrate(calibrate::CalibrateArguments),
    /// List the culling methods.
    Methods,
}

/// Parses the process's arguments, obeys them and tells how it went.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version go to stdout and are no failure. A closed pipe is not worth a message.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() {
                exit::USAGE
            } else {
                exit::GOOD
            });
        }
    };
    let result = match &cli.command {
        Command::Run(arguments) => run::run(arguments),
        Command::Compare(arguments) => compare::compare(arguments),
        Command::Study(arguments) => study::study(arguments),
        Command::Report(arguments) => report::report(arguments),
        Command::Path(arguments) => path::path(arguments),
        Command::HardCases(arguments) => hard_cases::hard_cases(arguments),
        Command::Msoc(arguments) => msoc::msoc(arguments),
        Command::Calibrate(arguments) => calibrate::calibrate(arguments),
        Command::Methods => to_stdout(&registry::table()).map(|()| exit::GOOD),
    };
    ExitCode::from(result.unwrap_or_else(|error| {
        let _ = writeln!(io::stderr(), "error: {error}");
        error.exit_code()
    }))
}

/// Writes data to the standard output. A reader that has seen enough is no error.
fn to_stdout(text: &str) -> Result<(), StudyError> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(StudyError::output("standard output")(error))
        }
        _ => Ok(()),
    }
}

fn open_scene(path: &Path) -> Result<BakedScene, StudyError> {
    Ok(BakedScene::open_checked(path)?)
}

/// The path that `name` stands for: a standard one, or a file.
fn camera_path(name: &Path, scene: &ArchivedScene) -> Result<CameraPath, StudyError> {
    match name.to_str() {
        Some("walk-in") => Ok(walk_in(scene)),
        Some("orbit") => Ok(orbit(scene)),
        _ => Ok(CameraPath::load(name)?),
    }
}

/// What reports call the path `name`: a standard path's name, or the file's without its endings.
fn path_name(name: &Path) -> String {
    let file = name.file_name().unwrap_or(name.as_os_str());
    let file = file.to_string_lossy();
    let stem = file.strip_suffix(".json").unwrap_or(&file);
    stem.strip_suffix(".path").unwrap_or(stem).to_owned()
}

/// `--depth`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Depth {
    /// Near 0, far 1.
    Standard,
    /// Near 1, far 0.
    Reversed,
}

impl Depth {
    const fn convention(self) -> DepthConvention {
        match self {
            Self::Standard => DepthConvention::Standard,
            Self::Reversed => DepthConvention::Reversed,
        }
    }
}

/// `-` or a file.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Destination {
    Stdout,
    File(PathBuf),
}

impl From<&str> for Destination {
    fn from(text: &str) -> Self {
        if text == "-" {
            Self::Stdout
        } else {
            Self::File(text.into())
        }
    }
}

impl Destination {
    /// The file, if it is one.
    fn file(&self) -> Option<&Path> {
        match self {
            Self::Stdout => None,
            Self::File(file) => Some(file),
        }
    }
}

/// Where JSON goes, opened before the work begins.
enum JsonOutput {
    Stdout,
    File(OutputFile),
}

impl JsonOutput {
    fn open(destination: &Destination) -> Result<Self, StudyError> {
        Ok(match destination {
            Destination::Stdout => Self::Stdout,
            Destination::File(file) => Self::File(OutputFile::create(file)?),
        })
    }
}
