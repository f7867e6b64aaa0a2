//! `hroc-bake`: bakes scenes for hroc, and looks at baked files.

use std::process::ExitCode;

fn main() -> ExitCode {
    hroc_preprocess::cli::main()
}
