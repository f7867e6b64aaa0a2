//! `hroc run`.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use hroc_runtime::{DeviceProfile, EarlyZ, Grouping, Submission, readback};
use indicatif::{ProgressBar, ProgressStyle};

use super::{Depth, Destination, JsonOutput, camera_path, open_scene, path_name, to_stdout};
use crate::error::{StudyError, exit};
use crate::gpu::{Gpu, GpuError, GpuOptions};
use crate::gpu_clock::ClockChoice;
use crate::npy;
use crate::output::{self, OutputFile};
use crate::registry::{self, Exactness};
use crate::results::RunResults;
use crate::run::{Contender, Course, FrameView, run as run_contender};
use crate::summary::markdown_summary;
use crate::truth::TruthCache;

/// Options of `hroc run`.
#[derive(Debug, Args)]
pub(super) struct RunArguments {
    /// A baked scene.
    scene: PathBuf,
    /// The culling method (see hroc methods).
    #[arg(long, default_value = "hroc")]
    method: String,
    /// The method's mode; its first one if left out.
    #[arg(long)]
    mode: Option<String>,
    /// Turns one of the method's knobs (see hroc methods); may be given several times.
    #[arg(long, value_name = "NAME=VALUE")]
    knob: Vec<String>,
    /// How coarse the groups of bounds are that hroc tests at once.
    #[arg(long, value_enum, default_value_t = GroupingName::Adaptive)]
    grouping: GroupingName,
    /// The tree to use, by the split rule that built it: sah, middle, equal-count, or what was baked.
    #[arg(long, default_value = "sah")]
    split: String,
    /// Camera path: walk-in, orbit, or a file.
    #[arg(long, default_value = "walk-in", value_name = "PATH")]
    path: PathBuf,
    /// Frames, spread evenly over the path.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Width and height of the image, pixels.
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = parse_size)]
    size: [u32; 2],
    /// How depth is stored.
    #[arg(long, value_enum, default_value_t = Depth::Reversed)]
    depth: Depth,
    /// What times the stages.
    #[arg(long, value_enum, default_value_t = Clock::Auto)]
    clock: Clock,
    /// How draw lists are submitted; the best the device can do if left out.
    #[arg(long, value_enum)]
    submission: Option<SubmissionName>,
    /// How hidden fragments of bounds are turned away; the best the device can do if left out.
    #[arg(long, value_enum)]
    early_z: Option<EarlyZName>,
    /// Compare every frame with the one where everything is drawn; exit with 1 if an exact method differs.
    #[arg(long)]
    check: bool,
    /// Leave out the replays that time and count work, for a check alone. Times are then 0, counts null.
    #[arg(long)]
    untimed: bool,
    /// Write the results as JSON; `-` for the standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<Destination>,
    /// Write a frame as an image.
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Which frame to write, from 0; the last one if left out.
    #[arg(long, value_name = "FRAME", requires = "png")]
    png_frame: Option<u32>,
    /// Write depth and item buffer of every frame as NumPy arrays into this folder.
    #[arg(long, value_name = "DIR")]
    dump: Option<PathBuf>,
    /// Part of the name of the adapter to use; also read from WGPU_ADAPTER_NAME. A GPU, if there is one,
    /// where neither is given.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Let the driver and wgpu check every call. Slow.
    #[arg(long)]
    validation: bool,
    /// Where the images of no culling are kept for later checks; the user's cache folder if left out.
    #[arg(long, value_name = "DIR", conflicts_with = "no_truth_cache")]
    truth_cache: Option<PathBuf>,
    /// Keep no images for later checks.
    #[arg(long)]
    no_truth_cache: bool,
}

/// `--grouping`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum GroupingName {
    /// The largest nodes of unknown visibility, as published.
    Published,
    /// Nodes that cover more of the screen than pays are replaced by their children.
    Adaptive,
}

/// `--submission`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum SubmissionName {
    /// One multi-draw whose count the GPU reads.
    IndirectCount,
    /// One multi-draw over all commands, most of them empty.
    ZeroedTail,
    /// A draw for each command.
    DrawLoop,
}

/// `--early-z`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum EarlyZName {
    /// By the rasterizer.
    Forced,
    /// In the shader.
    Sampled,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Clock {
    /// The device's if it passes a test, else the host's.
    Auto,
    /// The host's, with a wait at each stage.
    Wall,
    /// The device's timestamps, right or wrong.
    Gpu,
}

pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let number = |text: &str| text.parse::<u32>().ok().filter(|&n| n > 0);
    let parsed = text
        .split_once('x')
        .and_then(|(width, height)| Some([number(width)?, number(height)?]));
    parsed.ok_or_else(|| "width and height in pixels, both above 0, as in 1280x720".to_owned())
}

pub(super) fn run(arguments: &RunArguments) -> Result<u8, StudyError> {
    let options_error = StudyError::Usage;
    let method = registry::method(&arguments.method).map_err(options_error)?;
    let mode = method
        .mode(arguments.mode.as_deref())
        .map_err(options_error)?;
    let knobs = method.knobs(&arguments.knob).map_err(options_error)?;
    if let Some(frame) = arguments
        .png_frame
        .filter(|&frame| frame >= arguments.frames)
    {
        let frames = arguments.frames;
        return Err(StudyError::Usage(format!(
            "--png-frame {frame}: there are {frames} frames, from 0"
        )));
    }
    let baked = open_scene(&arguments.scene)?;
    let path = camera_path(&arguments.path, baked.scene())?;
    let mut outputs = Outputs::open(arguments)?;
    let gpu = Gpu::open(&GpuOptions {
        adapter: arguments.adapter.clone(),
        features: method.features,
        validation: arguments.validation,
    })?;

    let profile = profile(arguments, &gpu)?;
    let truth_folder = arguments
        .truth_cache
        .clone()
        .or_else(TruthCache::default_folder);
    let contender = Contender {
        method,
        mode,
        knobs,
        grouping: match arguments.grouping {
            GroupingName::Published => Grouping::Published,
            GroupingName::Adaptive => Grouping::Adaptive {
                box_cost: profile.measure_box_cost(&gpu.device, &gpu.queue),
            },
        },
        split: arguments.split.clone(),
    };
    let course = Course {
        scene_name: baked.scene().name.as_str().to_owned(),
        path_name: path_name(&arguments.path),
        path,
        frames: arguments.frames,
        size: arguments.size,
        depth: arguments.depth.convention(),
        profile,
        clock: match arguments.clock {
            Clock::Auto => ClockChoice::Auto,
            Clock::Wall => ClockChoice::Wall,
            Clock::Gpu => ClockChoice::Gpu,
        },
        check: arguments.check,
        repeats: u32::from(!arguments.untimed),
        overdraw_frame: None,
        truth_cache: truth_folder
            .filter(|_| !arguments.no_truth_cache)
            .map(TruthCache::new),
    };
    let progress = progress_bar("frames");
    let results = run_contender(&gpu, &baked, &course, &contender, &progress, &mut |view| {
        outputs.frame(&gpu, view)
    });
    progress.finish_and_clear();
    let results = results?;
    outputs.finish(&results)?;
    Ok(match results.errors() {
        Some(errors) if errors != [0, 0] && mode.exactness == Exactness::Exact => {
            exit::CHECK_FAILED
        }
        _ => exit::GOOD,
    })
}

/// The device's paths, some of them forced.
fn profile(arguments: &RunArguments, gpu: &Gpu) -> Result<DeviceProfile, StudyError> {
    let mut profile = gpu.profile.clone();
    if let Some(submission) = arguments.submission {
        profile.submission = match submission {
            SubmissionName::IndirectCount => Submission::IndirectCount,
            SubmissionName::ZeroedTail => Submission::ZeroedTail,
            SubmissionName::DrawLoop => Submission::DrawLoop,
        };
    }
    if let Some(early_z) = arguments.early_z {
        profile.early_z = match early_z {
            EarlyZName::Forced => EarlyZ::Forced,
            EarlyZName::Sampled => EarlyZ::Sampled,
        };
    }
    let missing = profile.features() - gpu.device.features();
    if missing.is_empty() {
        Ok(profile)
    } else {
        Err(StudyError::Gpu(GpuError::PathUnfit {
            features: registry::feature_names(missing),
            adapter: gpu.info.name.clone(),
        }))
    }
}

/// A bar that counts `what`. Draws nothing where the standard error is no terminal.
pub(super) fn progress_bar(what: &str) -> ProgressBar {
    let template =
        format!("{{prefix}}{{msg:18}} {{wide_bar}} {{pos}}/{{len}} {what}, {{eta}} left");
    let style = ProgressStyle::with_template(&template);
    ProgressBar::new(0).with_style(style.expect("the template is sound"))
}

/// Where results go, opened before the run.
struct Outputs {
    json: Option<JsonOutput>,
    png: Option<(OutputFile, u32)>,
    dump: Option<PathBuf>,
}

impl Outputs {
    fn open(arguments: &RunArguments) -> Result<Self, StudyError> {
        let inputs = [arguments.scene.as_path(), &arguments.path];
        let files = [
            (
                "--json",
                arguments.json.as_ref().and_then(Destination::file),
            ),
            ("--png", arguments.png.as_deref()),
        ];
        let files = files
            .into_iter()
            .filter_map(|(option, file)| Some((option, file?)));
        output::keep_inputs(&inputs, &files.collect::<Vec<_>>())?;
        if let Some(folder) = &arguments.dump {
            output::keep_inputs_in(folder, &inputs, |name| name.ends_with(".npy"))?;
            output::create_folder(folder)?;
        }
        let json = arguments.json.as_ref().map(JsonOutput::open).transpose()?;
        let frame = arguments.png_frame.unwrap_or(arguments.frames - 1);
        let png = arguments
            .png
            .as_deref()
            .map(OutputFile::create)
            .transpose()?;
        Ok(Self {
            json,
            png: png.map(|file| (file, frame)),
            dump: arguments.dump.clone(),
        })
    }

    fn frame(&mut self, gpu: &Gpu, view: &FrameView<'_>) -> Result<(), StudyError> {
        let size = view.targets.targets().size;
        if let Some(folder) = &self.dump {
            dump(folder, view, size)?;
        }
        if let Some((file, _)) = self.png.take_if(|(_, frame)| *frame == view.frame) {
            let texels = readback::texture(&gpu.device, &gpu.queue, &view.targets.color);
            file.finish(&output::png(&texels, size))?;
        }
        Ok(())
    }

    fn finish(self, results: &RunResults) -> Result<(), StudyError> {
        let summary = markdown_summary(results);
        match self.json {
            // The standard output belongs to the data.
            Some(JsonOutput::Stdout) => {
                let _ = io::stderr().write_all(summary.as_bytes());
                to_stdout(&results.to_json())
            }
            Some(JsonOutput::File(file)) => {
                file.finish(results.to_json().as_bytes())?;
                to_stdout(&summary)
            }
            None => to_stdout(&summary),
        }
    }
}

fn dump(folder: &Path, view: &FrameView<'_>, size: [u32; 2]) -> Result<(), StudyError> {
    let write = |name: &str, contents: Vec<u8>| {
        OutputFile::create(&folder.join(format!("{:05}_{name}.npy", view.frame)))?.finish(&contents)
    };
    write(
        "depth",
        npy::file(
            bytemuck::cast_slice::<u32, f32>(&view.image.depth_bits),
            size,
        ),
    )?;
    write("item", npy::file(&view.image.items, size))
}

#[cfg(test)]
mod tests {
    use super::parse_size;

    #[test]
    fn sizes_are_two_numbers_above_zero() {
        assert_eq!(parse_size("640x360"), Ok([640, 360]));
        for wrong in [
            "",
            "640",
            "0x0",
            "640x0",
            "0x360",
            "640x360x2",
            "-1x2",
            "axb",
            "640X360",
            "99999999999x1",
        ] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
    }
}
