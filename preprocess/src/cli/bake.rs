//! `hroc-bake bake`.

use super::{Failure, depfile, progress, say, signals, unchanged};
use crate::bake::{self, BakeOptions, BakeReport, Stage};
use crate::import::{self, ImportOptions};
use crate::outputs;
use crate::tree;
use clap::builder::PossibleValuesParser;
use hroc_format::{file_to_replace, folder_of};
use std::fs;
use std::io::{self, Write};
use std::num::{NonZeroU32, NonZeroUsize};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Bakes scenes into one file.
///
/// An object is a mesh primitive under one transform; ids are dense and in source order.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The scenes: .glb, .gltf or .obj; several become one.
    #[arg(required = true, value_name = "IN")]
    inputs: Vec<PathBuf>,
    /// The baked file to write.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// The trees to build, comma-separated.
    #[arg(long, value_name = "TREES", value_delimiter = ',', value_parser = builders(), default_values_t = default_names())]
    split: Vec<String>,
    /// Threads to use; all cores by default. The file does not depend on it.
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
    /// Cut meshes of more than N triangles into compact objects of at most so many.
    #[arg(long, value_name = "N")]
    split_objects: Option<NonZeroU32>,
    /// Store positions as 16-bit numbers on a grid per mesh: within a 65534th of its longest edge.
    #[arg(long)]
    quantize: bool,
    /// Leave OUT alone where this version baked it from the same bytes with the same options.
    #[arg(long)]
    if_changed: bool,
    /// Write the files that were read to FILE, for make and ninja.
    #[arg(long, value_name = "FILE")]
    depfile: Option<PathBuf>,
    /// Write a report of the bake (counts, trees, times, warnings) to FILE; - for stdout.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Keep vertices and triangles in the order of the source.
    #[arg(long)]
    no_optimize: bool,
    /// The scene of the glTF files, by name or else by number; each file's default scene without it.
    #[arg(long, value_name = "SCENE")]
    scene: Option<String>,
    /// Leave out vertex normals.
    #[arg(long)]
    no_normals: bool,
    /// Keep the first set of texture coordinates.
    #[arg(long)]
    uvs: bool,
}

fn default_names() -> Vec<String> {
    tree::baked_by_default()
        .map(|builder| builder.name().to_owned())
        .collect()
}

fn builders() -> PossibleValuesParser {
    tree::builders()
        .map(|builder| clap::builder::PossibleValue::new(builder.name()).help(builder.describe()))
        .collect::<Vec<_>>()
        .into()
}

/// More threads than this only exhaust the system.
const MAX_JOBS: usize = 1024;

/// The report in JSON; version 1.
#[derive(serde::Serialize)]
struct Report<'a> {
    schema: u32,
    output: String,
    file_bytes: u64,
    seconds: f64,
    /// Nothing was baked: the output is what the bake would write.
    unchanged: bool,
    #[serde(flatten)]
    bake: &'a BakeReport,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    check(arguments)?;
    signals::tidy_up_on_termination();
    let mut pool = rayon::ThreadPoolBuilder::new();
    if let Some(jobs) = arguments.jobs {
        pool = pool.num_threads(jobs.get());
    }
    let pool = pool
        .build()
        .map_err(|error| Failure::usage(format_args!("--jobs: {error}; ask for fewer threads")))?;
    pool.install(|| bake(arguments))
}

/// What can be found wrong before any work is done.
fn check(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments {
        inputs,
        output,
        split,
        ..
    } = arguments;
    if let Some(name) = split
        .iter()
        .enumerate()
        .find(|(at, name)| split[..*at].contains(name))
    {
        return Err(Failure::usage(format_args!(
            "--split names {} twice; name each tree once",
            name.1
        )));
    }
    if arguments.jobs.is_some_and(|jobs| jobs.get() > MAX_JOBS) {
        return Err(Failure::usage(format_args!(
            "--jobs: at most {MAX_JOBS} threads; ask for fewer"
        )));
    }
    let outputs = outputs(arguments);
    let paths = outputs.iter().map(|(_, path)| *path);
    let inputs = inputs.iter().map(PathBuf::as_path);
    refuse_inputs(arguments, inputs, "is an input")?;
    for target in paths {
        if target.is_dir() {
            let target = target.display();
            return Err(Failure::usage(format_args!(
                "{target}: is a folder; name a file to write"
            )));
        }
        let folder = folder_of(target);
        if !folder.is_dir() {
            let (target, folder) = (target.display(), folder.display());
            return Err(Failure::file(format_args!(
                "{target}: there is no folder {folder}; create it first"
            )));
        }
    }
    if let Err(error) = file_to_replace(output) {
        let output = output.display();
        return Err(Failure::file(format_args!(
            "{output}: cannot be written: {error}; name another file"
        )));
    }
    outputs::refuse_repetitions(&outputs).map_err(Failure::usage)
}

/// The files to write, each with the option that names it.
fn outputs(arguments: &Arguments) -> Vec<(&'static str, &Path)> {
    let json = arguments.json.as_deref();
    let json = json.filter(|path| *path != Path::new("-"));
    [
        ("--output", Some(arguments.output.as_path())),
        ("--depfile", arguments.depfile.as_deref()),
        ("--json", json),
    ]
    .into_iter()
    .filter_map(|(option, path)| Some((option, path?)))
    .collect()
}

/// Refuses to write over a file that is read.
fn refuse_inputs<'a>(
    arguments: &Arguments,
    read: impl IntoIterator<Item = &'a Path>,
    what: &str,
) -> Result<(), Failure> {
    let paths: Vec<&Path> = outputs(arguments).iter().map(|(_, path)| *path).collect();
    outputs::refuse_inputs(&paths, read, what).map_err(Failure::usage)
}

/// What outputs must not be, beside inputs.
const REFERRED_TO: &str = "is a file that an input refers to";

fn bake(arguments: &Arguments) -> Result<(), Failure> {
    let start = Instant::now();
    let progress = progress::for_terminal();
    let options = BakeOptions {
        splits: arguments
            .split
            .iter()
            .filter_map(|name| tree::by_name(name))
            .collect(),
        optimize: !arguments.no_optimize,
        normals: !arguments.no_normals,
        uvs: arguments.uvs,
        split_objects: arguments.split_objects,
        quantize: arguments.quantize,
    };
    let settings = options.settings(arguments.scene.as_deref());
    if arguments.if_changed
        && let Some(baked) = unchanged::open(&arguments.output, &arguments.inputs, &settings)
    {
        say(format_args!(
            "{}: unchanged, {:.2} s",
            arguments.output.display(),
            start.elapsed().as_secs_f64()
        ));
        let file_bytes = baked.file_bytes().len() as u64;
        let referenced: Vec<(PathBuf, bool)> = baked
            .scene()
            .referenced_files
            .iter()
            .filter_map(|file| {
                let by = arguments.inputs.get(file.by.to_native() as usize)?;
                Some((import::beside(by, &file.name), file.hash != 0))
            })
            .collect();
        refuse_inputs(
            arguments,
            referenced.iter().map(|(path, _)| path.as_path()),
            REFERRED_TO,
        )?;
        let was_read = referenced.into_iter().filter(|(_, was_read)| *was_read);
        write_depfile(arguments, was_read.map(|(path, _)| path))?;
        let report = BakeReport::of(&baked);
        return write_report(arguments, &report, file_bytes, start, true);
    }
    let wanted = ImportOptions {
        scene: arguments.scene.clone(),
        normals: options.normals,
        uvs: options.uvs,
    };
    let source = import::import(&arguments.inputs, &wanted, &*progress).map_err(Failure::file)?;
    let import_seconds = start.elapsed().as_secs_f64();
    let referred_to = source.referenced_files.iter().map(|file| &file.path);
    let referred_to = referred_to.chain(&source.unread_files);
    refuse_inputs(arguments, referred_to.map(PathBuf::as_path), REFERRED_TO)?;
    let referenced: Vec<PathBuf> = source
        .referenced_files
        .iter()
        .filter(|file| file.hash != 0)
        .map(|file| file.path.clone())
        .collect();
    let inputs = || {
        let names = arguments.inputs.iter();
        let names: Vec<_> = names.map(|path| path.display().to_string()).collect();
        names.join(", ")
    };
    let (scene, mut report) = bake::bake(source, &options, &*progress)
        .map_err(|error| Failure::file(format_args!("{}: {error}", inputs())))?;
    report.stages.insert(
        0,
        Stage {
            name: "import",
            seconds: import_seconds,
        },
    );
    let write = Instant::now();
    progress.stage("write", 0);
    let file_bytes = hroc_format::write_with(&arguments.output, &scene, &report.sections())
        .map_err(Failure::file)?;
    report.stages.push(Stage {
        name: "write",
        seconds: write.elapsed().as_secs_f64(),
    });
    drop(progress);

    report
        .warnings
        .iter()
        .for_each(|warning| say(format_args!("warning: {warning}")));
    summarize(
        arguments,
        &report,
        file_bytes,
        start.elapsed().as_secs_f64(),
    );
    write_depfile(arguments, referenced.into_iter())?;
    write_report(arguments, &report, file_bytes, start, false)
}

/// Writes the depfile, where one is wanted: the inputs and what they refer to, each once.
fn write_depfile(
    arguments: &Arguments,
    referenced: impl Iterator<Item = PathBuf>,
) -> Result<(), Failure> {
    let Some(path) = &arguments.depfile else {
        return Ok(());
    };
    let mut inputs = Vec::new();
    for path in arguments.inputs.iter().cloned().chain(referenced) {
        if !inputs.contains(&path) {
            inputs.push(path);
        }
    }
    depfile::write(path, &arguments.output, &inputs).map_err(|error| {
        Failure::file(format_args!(
            "{}: cannot be written: {error}; the baked file is complete",
            path.display()
        ))
    })
}

/// Writes the report, where one is wanted.
fn write_report(
    arguments: &Arguments,
    bake: &BakeReport,
    file_bytes: u64,
    start: Instant,
    unchanged: bool,
) -> Result<(), Failure> {
    let Some(path) = &arguments.json else {
        return Ok(());
    };
    let report = Report {
        schema: 1,
        output: arguments.output.display().to_string(),
        file_bytes,
        seconds: start.elapsed().as_secs_f64(),
        unchanged,
        bake,
    };
    write_json(path, &report)
}

fn summarize(arguments: &Arguments, report: &BakeReport, file_bytes: u64, seconds: f64) {
    say(format_args!(
        "{}: {} objects, {} triangles ({} stored in {} meshes), {:.1} MB, {seconds:.2} s",
        arguments.output.display(),
        report.objects,
        report.triangles,
        report.stored_triangles,
        report.meshes,
        file_bytes as f64 / 1e6,
    ));
    if let Some(accuracy) = &report.accuracy {
        accuracy
            .lines()
            .iter()
            .for_each(|line| say(format_args!("  {line}")));
    }
    for tree in &report.trees {
        say(format_args!(
            "  tree {}: depth {}, mean leaf depth {:.1}, SAH cost {:.2}, overlap {:.2}",
            tree.split, tree.depth, tree.mean_leaf_depth, tree.sah_cost, tree.overlap
        ));
    }
}

fn write_json(path: &Path, report: &Report<'_>) -> Result<(), Failure> {
    let mut json = serde_json::to_vec_pretty(report).map_err(Failure::file)?;
    json.push(b'\n');
    if path == Path::new("-") {
        return io::stdout()
            .lock()
            .write_all(&json)
            .map_err(Failure::stdout);
    }
    fs::write(path, json).map_err(|error| {
        Failure::file(format_args!(
            "{}: cannot be written: {error}; the baked file is complete",
            path.display()
        ))
    })
}
