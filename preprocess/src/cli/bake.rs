//! `hroc-bake bake`.

use super::{Failure, progress, say};
use crate::bake::{self, BakeOptions, BakeReport, Stage};
use crate::import::{self, ImportOptions};
use crate::tree;
use clap::builder::PossibleValuesParser;
use std::fs;
use std::io::{self, Write};
use std::num::NonZeroUsize;
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
    #[serde(flatten)]
    bake: &'a BakeReport,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    check(arguments)?;
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
        json,
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
    let json = json.as_deref().filter(|path| *path != Path::new("-"));
    for target in [Some(output.as_path()), json].into_iter().flatten() {
        if inputs.iter().any(|input| same_file(input, target)) {
            let target = target.display();
            return Err(Failure::usage(format_args!(
                "{target}: is an input; name another file to write"
            )));
        }
        if target.is_dir() {
            let target = target.display();
            return Err(Failure::usage(format_args!(
                "{target}: is a folder; name a file to write"
            )));
        }
        let folder = folder(target);
        if !folder.is_dir() {
            let (target, folder) = (target.display(), folder.display());
            return Err(Failure::file(format_args!(
                "{target}: there is no folder {folder}; create it first"
            )));
        }
    }
    if json.is_some_and(|json| json == output || same_file(json, output)) {
        return Err(Failure::usage("--json names the output; name another file"));
    }
    Ok(())
}

fn folder(file: &Path) -> &Path {
    file.parent()
        .filter(|folder| *folder != Path::new(""))
        .unwrap_or(Path::new("."))
}

fn same_file(a: &Path, b: &Path) -> bool {
    let (Ok(a), Ok(b)) = (a.canonicalize(), b.canonicalize()) else {
        return false;
    };
    a == b || is_same_inode(&a, &b)
}

/// Two names of one file.
#[cfg(unix)]
fn is_same_inode(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |path: &Path| fs::metadata(path).map(|data| (data.dev(), data.ino()));
    matches!((id(a), id(b)), (Ok(a), Ok(b)) if a == b)
}

#[cfg(not(unix))]
fn is_same_inode(_: &Path, _: &Path) -> bool {
    false
}

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
    };
    let wanted = ImportOptions {
        scene: arguments.scene.clone(),
        normals: options.normals,
        uvs: options.uvs,
    };
    let source = import::import(&arguments.inputs, &wanted, &*progress).map_err(Failure::file)?;
    let import_seconds = start.elapsed().as_secs_f64();
    let inputs = || {
        arguments
            .inputs
            .iter()
            .map(|path| path.display().to_string())
            .collect::<Vec<_>>()
            .join(", ")
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
    let file_bytes = hroc_format::write(&arguments.output, &scene).map_err(Failure::file)?;
    report.stages.push(Stage {
        name: "write",
        seconds: write.elapsed().as_secs_f64(),
    });
    drop(progress);

    report
        .warnings
        .iter()
        .for_each(|warning| say(format_args!("warning: {warning}")));
    let seconds = start.elapsed().as_secs_f64();
    summarize(arguments, &report, file_bytes, seconds);
    let output = arguments.output.display().to_string();
    let report = Report {
        schema: 1,
        output,
        file_bytes,
        seconds,
        bake: &report,
    };
    arguments
        .json
        .as_deref()
        .map_or(Ok(()), |path| write_json(path, &report))
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
