//! The `hroc` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    hroc_study::cli::main()
}
