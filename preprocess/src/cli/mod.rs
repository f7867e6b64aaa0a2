//! The command line of `hroc-bake`: arguments, messages, exit codes. Every command is one file here.
//!
//! Data goes to stdout or to files, everything else to stderr. Exit codes: 0 good; 2 the command line
//! is wrong; 3 a file cannot be read, written or made sense of. A damaged baked file is bad input to
//! `verify` as to every other command, so `verify` too ends with 3; 1, "a check failed", is for
//! commands that compare pictures and is never used here.

mod bake;
mod camera_path;
mod depfile;
mod generate;
mod inspect;
mod progress;
mod signals;
mod unchanged;
mod verify;

use clap::{Parser, Subcommand};
use std::fmt;
use std::io::{self, Write};
use std::process::ExitCode;

const EXAMPLES: &str = "\
Examples:
  hroc-bake bake town.glb -o town.hroc
  hroc-bake bake walls.obj pipes.obj -o plant.hroc --split sah --json plant.json
  hroc-bake bake town.glb -o town.hroc --if-changed --depfile town.d
  hroc-bake bake plan.glb -o plan.hroc --split-objects 5000 --quantize
  hroc-bake inspect town.hroc
  hroc-bake inspect town.hroc --json | jq '.objects[17]'
  hroc-bake verify town.hroc --source town.glb
  hroc-bake generate radial-city --scale 0.1 -o city.glb
  hroc-bake camera-path film.glb --camera Dolly -o film.path.json

Exit codes: 0 good, 2 wrong command line, 3 a file cannot be read, written or made sense of.";

/// Bakes glTF, GLB and OBJ scenes for hroc: one file with objects, meshes and bounding volume
/// hierarchies, ready to be mapped and drawn.
#[derive(Parser)]
#[command(name = "hroc-bake", version, after_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Bake(bake::Arguments),
    Inspect(inspect::Arguments),
    Verify(verify::Arguments),
    Generate(generate::Arguments),
    CameraPath(camera_path::Arguments),
}

/// Why a command ended early.
enum Failure {
    /// The arguments contradict each other or the world.
    Usage(String),
    /// Something about a file.
    File(String),
    /// Whoever read stdout has had enough; not an error.
    Closed,
}

impl Failure {
    fn usage(message: impl fmt::Display) -> Self {
        Self::Usage(message.to_string())
    }

    fn file(message: impl fmt::Display) -> Self {
        Self::File(message.to_string())
    }

    /// From an error of writing to stdout.
    fn stdout(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::Closed,
            _ => Self::file(format_args!(
                "(stdout): cannot be written: {error}; write to a file instead"
            )),
        }
    }
}

/// Parses the command line and runs it.
pub fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Bake(arguments) => bake::run(&arguments),
        Command::Inspect(arguments) => inspect::run(&arguments),
        Command::Verify(arguments) => verify::run(&arguments),
        Command::Generate(arguments) => generate::run(&arguments),
        Command::CameraPath(arguments) => camera_path::run(&arguments),
    };
    let (message, code) = match result {
        Ok(()) | Err(Failure::Closed) => return ExitCode::SUCCESS,
        Err(Failure::Usage(message)) => (message, 2),
        Err(Failure::File(message)) => (message, 3),
    };
    say(format_args!("error: {message}"));
    ExitCode::from(code)
}

/// Writes a line to stderr; a closed stderr is nobody's loss. Names and paths in it may hold anything:
/// control characters are escaped, so that a line stays one.
fn say(line: impl fmt::Display) {
    let escaped = line
        .to_string()
        .chars()
        .fold(String::new(), |mut escaped, c| {
            if c.is_control() {
                escaped.extend(c.escape_default());
            } else {
                escaped.push(c);
            }
            escaped
        });
    let _ = writeln!(io::stderr(), "{escaped}");
}
