//! What `hroc compare` and `hroc study` have in common.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use hroc_format::BakedScene;
use hroc_runtime::Grouping;

use super::run::{parse_size, progress_bar};
use super::{Depth, camera_path, open_scene, path_name, to_stdout};
use crate::camera_path::CameraPath;
use crate::compare::{Comparison, Kind, SceneTrees, Selection, unique};
use crate::error::{StudyError, exit};
use crate::gpu::{Gpu, GpuOptions};
use crate::gpu_clock::ClockChoice;
use crate::output::keep_inputs_in;
use crate::report;
use crate::run::Course;
use crate::truth::TruthCache;

/// Scenes, paths and what is done with each frame.
#[derive(Debug, Args)]
pub(super) struct CourseArguments {
    /// Baked scenes.
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// Folder for the results and the report; made if it is not there.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Go on in DIR: scenes and paths whose results are there in these settings are not run again.
    #[arg(long)]
    resume: bool,
    /// Camera path: walk-in, orbit, or a file; may be given several times. walk-in if left out.
    #[arg(long, value_name = "PATH")]
    path: Vec<PathBuf>,
    /// Frames, spread evenly over the path.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// How often the path is replayed for its times.
    #[arg(long, default_value_t = 3, value_name = "R", value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeat: u32,
    /// Width and height of the image, pixels.
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = parse_size)]
    size: [u32; 2],
    /// How depth is stored.
    #[arg(long, value_enum, default_value_t = Depth::Reversed)]
    depth: Depth,
    /// Do not compare the frames with those where everything is drawn: nothing is known of errors then.
    #[arg(long)]
    no_check: bool,
    /// Part of the name of the adapter to use; also read from WGPU_ADAPTER_NAME.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Where the images of no culling are kept for later checks; the user's cache folder if left out.
    #[arg(long, value_name = "DIR", conflicts_with = "no_truth_cache")]
    truth_cache: Option<PathBuf>,
    /// Keep no images for later checks.
    #[arg(long)]
    no_truth_cache: bool,
}

/// `--groupings`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum GroupingName {
    /// As published.
    Published,
    /// By the area on the screen.
    Adaptive,
}

/// A scene with its name in reports and the paths through it.
struct Entry {
    name: String,
    baked: BakedScene,
    paths: Vec<(String, CameraPath)>,
}

impl CourseArguments {
    /// Runs what `selection` selects and writes the report. `selection` gets its groupings here, as one of them is
    /// measured on the device.
    ///
    /// `fits` refuses a scene. `overdraw` picks the frame whose overdraw is mapped.
    pub(super) fn run(
        &self,
        kind: Kind,
        mut selection: Selection,
        groupings: &[GroupingName],
        overdraw_frame: Option<u32>,
        fits: impl Fn(&Path, &BakedScene) -> Result<(), StudyError>,
    ) -> Result<u8, StudyError> {
        let entries = self.entries(fits)?;
        let inputs: Vec<&Path> = self
            .scenes
            .iter()
            .chain(&self.path)
            .map(PathBuf::as_path)
            .collect();
        keep_inputs_in(&self.output, &inputs, |name| name == report::RESULTS)?;
        report::create(&self.output, &inputs)?;
        let earlier = self.output.join(report::RESULTS);
        let earlier = (self.resume && earlier.exists()).then(|| Comparison::load(&earlier));
        let earlier = earlier.transpose()?.filter(|earlier| earlier.kind == kind);
        let features = selection.methods.iter().map(|method| method.features);
        let gpu = Gpu::open(&GpuOptions {
            adapter: self.adapter.clone(),
            features: features.fold(wgpu::Features::empty(), |all, some| all | some),
            validation: false,
        })?;
        gpu.check_size(self.size)?;
        selection.groupings = groupings
            .iter()
            .map(|name| match name {
                GroupingName::Published => Grouping::Published,
                GroupingName::Adaptive => Grouping::Adaptive {
                    box_cost: gpu.profile.measure_box_cost(&gpu.device, &gpu.queue),
                },
            })
            .collect();

        let mut comparison = Comparison::new(kind, command_line());
        let mut to_run = Vec::new();
        for entry in &entries {
            let scene = entry.baked.scene();
            let contenders = selection.contenders(scene);
            if contenders
                .iter()
                .any(|contender| contender.method.uses_tree)
            {
                let splits = selection.splits.of(scene);
                let trees = SceneTrees::of(&entry.name, scene, &splits);
                comparison.trees.push(trees);
            }
            for (path_name, path) in &entry.paths {
                let course = self.course(&gpu, &entry.name, path_name, path, overdraw_frame);
                let taken = earlier.as_ref().is_some_and(|earlier| {
                    comparison.take_over(earlier, &gpu, &entry.baked, &course, &contenders)
                });
                if !taken {
                    to_run.push((entry, course, contenders.clone()));
                }
            }
        }
        let mut failure = None;
        let progress = progress_bar("frames");
        for (entry, course, contenders) in &to_run {
            progress.set_prefix(format!("{}, {}: ", course.scene_name, course.path_name));
            let code = comparison.run(&gpu, &entry.baked, course, contenders, &progress)?;
            failure = failure.or(code);
            // What is done is not lost with the rest.
            report::write_results(&self.output, &comparison)?;
        }
        progress.finish_and_clear();
        report::write_results(&self.output, &comparison)?;
        let code = finish(&self.output, &comparison)?;
        // Each contender has told why.
        Ok(failure
            .filter(|_| comparison.runs.is_empty())
            .unwrap_or(code))
    }

    fn course(
        &self,
        gpu: &Gpu,
        scene_name: &str,
        path_name: &str,
        path: &CameraPath,
        overdraw_frame: Option<u32>,
    ) -> Course {
        let truth_folder = self.truth_cache.clone().or_else(TruthCache::default_folder);
        Course {
            scene_name: scene_name.to_owned(),
            path_name: path_name.to_owned(),
            path: path.clone(),
            frames: self.frames,
            size: self.size,
            depth: self.depth.convention(),
            profile: gpu.profile.clone(),
            clock: ClockChoice::Auto,
            check: !self.no_check,
            repeats: self.repeat,
            overdraw_frame,
            truth_cache: truth_folder
                .filter(|_| !self.no_truth_cache)
                .map(TruthCache::new),
        }
    }

    /// How many frames there are.
    pub(super) const fn frames(&self) -> u32 {
        self.frames
    }

    fn entries(
        &self,
        fits: impl Fn(&Path, &BakedScene) -> Result<(), StudyError>,
    ) -> Result<Vec<Entry>, StudyError> {
        let walk_in = [PathBuf::from("walk-in")];
        let paths = if self.path.is_empty() {
            &walk_in[..]
        } else {
            &self.path
        };
        once("scene", &self.scenes)?;
        once("camera path", paths)?;
        let scene_names = unlike(&self.scenes, scene_name);
        let path_names = unlike(paths, path_name);
        let entry = |(file, name): (&PathBuf, String)| {
            let baked = open_scene(file)?;
            fits(file, &baked)?;
            let path = |(path, name): (&PathBuf, &String)| {
                Ok((name.clone(), camera_path(path, baked.scene())?))
            };
            let paths = paths.iter().zip(&path_names).map(path);
            let paths = paths.collect::<Result<_, StudyError>>()?;
            Ok(Entry { name, baked, paths })
        };
        self.scenes.iter().zip(scene_names).map(entry).collect()
    }
}

/// What reports call the scene in `file`: the file's name without its ending.
fn scene_name(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or(file.as_os_str());
    stem.to_string_lossy().into_owned()
}

/// Refuses to have one of `given` twice: the second's runs would count as more of the first's.
fn once(what: &str, given: &[PathBuf]) -> Result<(), StudyError> {
    let twice = |(i, file): &(usize, &PathBuf)| given[..*i].contains(file);
    match given.iter().enumerate().find(twice) {
        Some((_, file)) => Err(StudyError::Usage(format!(
            "{}: this {what} is given twice; give it once",
            file.display()
        ))),
        None => Ok(()),
    }
}

/// The files' names as `name` has them, or as they were given where two would be alike. A standard path is the same
/// either way.
fn unlike(files: &[PathBuf], name: impl Fn(&Path) -> String) -> Vec<String> {
    let alike = |file: &Path| {
        files
            .iter()
            .filter(|other| name(other) == name(file))
            .count()
    };
    let unlike = |file: &PathBuf| match alike(file) {
        1 => name(file),
        _ => file.display().to_string(),
    };
    files.iter().map(unlike).collect()
}

/// The names in the list that `option` was given, without repetitions and empty ones; none if it was left out.
///
/// # Errors
/// If there is no name in it: nothing would run, or all.
pub(super) fn names<'a>(option: &str, list: &'a [String]) -> Result<Vec<&'a str>, StudyError> {
    let names = list.iter().map(String::as_str);
    let names = unique(names.filter(|name| !name.is_empty()));
    match names.is_empty() && !list.is_empty() {
        true => Err(StudyError::Usage(format!(
            "{option}: no name is in the list; give one or leave the option out"
        ))),
        false => Ok(names),
    }
}

/// What was typed, so that it can be typed again.
fn command_line() -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_=./,:+@%".contains(c);
    let quote = |word: String| match word.chars().all(plain) && !word.is_empty() {
        true => word,
        false => format!("'{}'", word.replace('\'', "'\\''")),
    };
    let words = std::env::args_os()
        .skip(1)
        .map(|word| quote(word.to_string_lossy().into_owned()));
    ["hroc".to_owned()]
        .into_iter()
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}

/// Writes the renderings, tells where they are, and says how it went.
pub(super) fn finish(folder: &Path, comparison: &Comparison) -> Result<u8, StudyError> {
    report::write_renderings(folder, comparison)?;
    to_stdout(&report::overview(comparison))?;
    to_stdout(&format!(
        "\nreport: {}\n",
        folder.join(report::PAGE).display()
    ))?;
    Ok(if comparison.failed() {
        exit::CHECK_FAILED
    } else {
        exit::GOOD
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_and_paths_of_one_name_are_told_apart() {
        let files = |files: &[&str]| files.iter().map(PathBuf::from).collect::<Vec<_>>();
        let scenes = |given: &[&str]| unlike(&files(given), scene_name);
        assert_eq!(scenes(&["a/x.hroc", "b/y.hroc"]), ["x", "y"]);
        assert_eq!(scenes(&["a/x.hroc", "b/x.hroc"]), ["a/x.hroc", "b/x.hroc"]);
        let paths = |given: &[&str]| unlike(&files(given), path_name);
        assert_eq!(
            paths(&["orbit", "a/fly.json", "b/fly.path.json", "c/y.json"]),
            ["orbit", "a/fly.json", "b/fly.path.json", "y"]
        );
        assert_eq!(paths(&["orbit", "a/orbit.json"]), ["orbit", "a/orbit.json"]);
        once("scene", &files(&["a/x", "b/x"])).unwrap();
        let twice = once("scene", &files(&["a/x", "b/x", "a/x"])).unwrap_err();
        assert!(twice.to_string().contains("a/x: this scene"), "{twice}");
    }

    #[test]
    fn lists_of_no_names_are_refused() {
        let list = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        assert_eq!(names("--split", &[]).unwrap(), Vec::<&str>::new());
        assert_eq!(names("--split", &list(&["a", "", "a"])).unwrap(), ["a"]);
        let empty = names("--split", &list(&["", ""])).unwrap_err();
        assert!(empty.to_string().contains("--split"), "{empty}");
    }
}
