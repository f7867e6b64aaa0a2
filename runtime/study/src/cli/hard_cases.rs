//! `hroc hard-cases`.

use std::io::{self, Write};

use clap::Args;

use super::run::{parse_size, progress_bar};
use super::sampling::SamplingArguments;
use super::{Destination, JsonOutput, to_stdout};
use crate::error::{StudyError, exit};
use crate::gpu::{Gpu, GpuOptions};
use crate::hard_cases::run::{HardCaseOptions, run};
use crate::hard_cases::{self, CASES, Scale};
use crate::registry::{self, METHODS};

/// Options of `hroc hard-cases`.
#[derive(Debug, Args)]
pub(super) struct HardCasesArguments {
    /// Only this case; may be given several times (see --list).
    #[arg(long, value_name = "NAME")]
    case: Vec<String>,
    /// Only this method; may be given several times (see hroc methods).
    #[arg(long, value_name = "NAME")]
    method: Vec<String>,
    /// As many objects and frames as the difficulty needs, not as few as show it. Takes minutes.
    #[arg(long)]
    full: bool,
    /// Both groupings, and every device path that this device can be made to take: the full product with modes and
    /// trees. Takes an hour on a software rasterizer.
    #[arg(long)]
    all_paths: bool,
    /// Width and height of frames whose case does not decide it; 128x72, with --full 640x360 if left out.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    #[command(flatten)]
    sampling: SamplingArguments,
    /// Write the results as JSON; `-` for the standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<Destination>,
    /// Only list the cases and what went wrong with them elsewhere.
    #[arg(long)]
    list: bool,
    /// Part of the name of the adapter to use; also read from WGPU_ADAPTER_NAME.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Let the driver and wgpu check every call. Slow.
    #[arg(long)]
    validation: bool,
}

pub(super) fn hard_cases(arguments: &HardCasesArguments) -> Result<u8, StudyError> {
    if arguments.list {
        return to_stdout(&hard_cases::table()).map(|()| exit::GOOD);
    }
    let chosen = |names: &[String]| names.iter().map(|name| hard_cases::case(name)).collect();
    let cases = match arguments.case.as_slice() {
        [] => Ok(CASES.iter().collect()),
        names => chosen(names),
    };
    let methods = match arguments.method.as_slice() {
        [] => Ok(METHODS.iter().collect::<Vec<_>>()),
        names => names.iter().map(|name| registry::method(name)).collect(),
    };
    let scale = if arguments.full {
        Scale::Full
    } else {
        Scale::Small
    };
    let mut options = HardCaseOptions {
        cases: cases.map_err(StudyError::Usage)?,
        methods: methods.map_err(StudyError::Usage)?,
        scale,
        size: arguments.size.unwrap_or(scale.size()),
        sampling: arguments.sampling.resolve_for_cases()?,
        paths: Vec::new(),
    };
    let json = arguments.json.as_ref().map(JsonOutput::open).transpose()?;
    let features = options.methods.iter().map(|method| method.features);
    let gpu = Gpu::open(&GpuOptions {
        adapter: arguments.adapter.clone(),
        features: features.fold(wgpu::Features::empty(), |all, some| all | some),
        validation: arguments.validation,
    })?;
    if arguments.all_paths {
        options.paths = gpu.profile.every_path(gpu.device.features());
    }
    let progress = progress_bar("cases");
    let results = run(&gpu, &options, &progress);
    progress.finish_and_clear();
    let results = results?;
    match json {
        // The standard output belongs to the data.
        Some(JsonOutput::Stdout) => {
            let _ = io::stderr().write_all(results.markdown().as_bytes());
            to_stdout(&results.to_json())?;
        }
        Some(JsonOutput::File(file)) => {
            file.finish(results.to_json().as_bytes())?;
            to_stdout(&results.markdown())?;
        }
        None => to_stdout(&results.markdown())?,
    }
    Ok(if results.failed() {
        exit::CHECK_FAILED
    } else {
        exit::GOOD
    })
}
