//! A comparison: many contenders over scenes and camera paths, as data. Reports are renderings of it.

mod contenders;
mod host;
mod trees;

use std::collections::BTreeSet;
use std::path::Path;

use hroc_format::BakedScene;
use indicatif::ProgressBar;
use serde::{Deserialize, Serialize};

pub use contenders::{Selection, Splits};
pub use host::Host;
pub use trees::{SceneTrees, TreeStatistics};

use crate::error::StudyError;
use crate::gpu::{Gpu, GpuError};
use crate::hash;
use crate::results::{AdapterInfo, RunResults};
use crate::run::{Contender, Course, run_all};

/// The version of `results.json`.
pub const SCHEMA: u32 = 1;

/// What a comparison is after.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Methods against each other.
    Compare,
    /// The split rules of HROC's tree against each other.
    Study,
}

/// Everything a comparison found: `results.json`. README.md lists the fields with their units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Comparison {
    pub schema: u32,
    pub kind: Kind,
    /// The command line.
    pub command: String,
    pub host: Host,
    /// Contenders without results.
    pub skipped: Vec<Skipped>,
    /// Statistics of the trees that were used.
    pub trees: Vec<SceneTrees>,
    pub runs: Vec<RunResults>,
}

/// A contender that could not run or failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Skipped {
    pub scene: String,
    pub path: String,
    /// See [`RunResults::label`].
    pub contender: String,
    pub reason: String,
}

/// The runs over one camera path through one scene.
#[derive(Clone, Debug)]
pub struct CourseRuns<'a> {
    /// Name of the scene.
    pub scene: &'a str,
    /// Name of the camera path.
    pub path: &'a str,
    /// In the order of the contenders; never empty.
    pub runs: Vec<&'a RunResults>,
}

impl CourseRuns<'_> {
    /// Scene and path.
    pub fn title(&self) -> String {
        format!("{}, {}", self.scene, self.path)
    }
}

impl Comparison {
    /// One without runs.
    pub fn new(kind: Kind, command: String) -> Self {
        Self {
            schema: SCHEMA,
            kind,
            command,
            host: Host::here(),
            skipped: Vec::new(),
            trees: Vec::new(),
            runs: Vec::new(),
        }
    }

    /// The runs by scene and path, in the order they were made.
    pub fn courses(&self) -> Vec<CourseRuns<'_>> {
        let mut courses: Vec<CourseRuns<'_>> = Vec::new();
        for run in &self.runs {
            let (scene, path) = (run.scene.name.as_str(), run.path.as_str());
            match (courses.iter_mut()).find(|course| (course.scene, course.path) == (scene, path)) {
                Some(course) => course.runs.push(run),
                None => courses.push(CourseRuns {
                    scene,
                    path,
                    runs: vec![run],
                }),
            }
        }
        courses
    }

    /// Every [`RunResults::series`], in the order of the contenders.
    pub fn series(&self) -> Vec<String> {
        unique(self.runs.iter().map(RunResults::series))
    }

    /// Every [`RunResults::label`], in the order of the contenders.
    pub fn labels(&self) -> Vec<String> {
        unique(self.runs.iter().map(RunResults::label))
    }

    /// Whether a contender that claims to be exact is not.
    pub fn failed(&self) -> bool {
        let exact = self.runs.iter().filter(|run| run.is_exact());
        exact
            .filter_map(RunResults::errors)
            .any(|errors| errors != [0, 0])
    }

    /// The data of `results.json`.
    ///
    /// # Errors
    /// If the file cannot be read, or is no comparison.
    pub fn load(path: &Path) -> Result<Self, StudyError> {
        let refused = |reason: String| StudyError::Results {
            path: path.into(),
            reason,
        };
        let text = std::fs::read_to_string(path).map_err(|error| refused(error.to_string()))?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        // Before the rest, so that another version is told as such.
        #[derive(Deserialize)]
        struct Version {
            schema: u32,
        }
        let version = serde_json::from_str::<Version>(text);
        match version.map_err(|error| refused(error.to_string()))? {
            Version { schema: SCHEMA } => {
                serde_json::from_str(text).map_err(|error| refused(error.to_string()))
            }
            Version { schema } => Err(refused(format!(
                "it has schema {schema}, this command reads schema {SCHEMA}"
            ))),
        }
    }

    /// Adds what another comparison found, on the same machine: its commands stand beside these.
    pub fn join(&mut self, other: Self) {
        self.command = format!("{}; {}", self.command, other.command);
        self.skipped.extend(other.skipped);
        for trees in other.trees {
            if !self.trees.contains(&trees) {
                self.trees.push(trees);
            }
        }
        self.runs.extend(other.runs);
    }

    /// Runs `contenders` over `course` and adds what they found. A course that nobody can run is noted as skipped; the
    /// exit code that the first one's reason calls for is returned, if nobody could.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn run(
        &mut self,
        gpu: &Gpu,
        baked: &BakedScene,
        course: &Course,
        contenders: &[Contender],
        progress: &ProgressBar,
    ) -> Result<Option<u8>, StudyError> {
        let all = run_all(gpu, baked, course, contenders, progress, &mut |_| Ok(()));
        let outcomes = match all {
            Ok(outcomes) => outcomes,
            Err(error) => {
                // Lost or not, and free of this course's failure.
                gpu.recover()
                    .map_err(|lost: GpuError| StudyError::Gpu(lost))?;
                let reason = error.to_string();
                for contender in contenders {
                    self.skip(course, contender, reason.clone());
                }
                return Ok(Some(error.exit_code()));
            }
        };
        let errors = outcomes.iter().map(|outcome| outcome.as_ref().err());
        let codes = errors.map(|error| Some(error?.exit_code()));
        let code = codes
            .collect::<Option<Vec<_>>>()
            .and_then(|codes| codes.first().copied());
        for (contender, outcome) in contenders.iter().zip(outcomes) {
            match outcome {
                Ok(run) => self.runs.push(run),
                Err(error) => self.skip(course, contender, error.to_string()),
            }
        }
        Ok(code)
    }

    /// Takes over from `earlier` what it found of `course`, if that is what would be found now: by the same contenders
    /// over the same frames of the same scene on the same machine with the same program.
    pub fn take_over(
        &mut self,
        earlier: &Self,
        gpu: &Gpu,
        baked: &BakedScene,
        course: &Course,
        contenders: &[Contender],
    ) -> bool {
        let here =
            |scene: &str, path: &str| (scene, path) == (&course.scene_name, &course.path_name);
        let runs = (earlier.runs.iter())
            .filter(|run| here(&run.scene.name, &run.path))
            .collect::<Vec<_>>();
        let skipped = (earlier.skipped.iter())
            .filter(|skipped| here(&skipped.scene, &skipped.path))
            .collect::<Vec<_>>();
        let labels = contenders.iter().map(Contender::label);
        let ran = runs.iter().map(|run| run.label());
        let all = ran.chain(skipped.iter().map(|skipped| skipped.contender.clone()));
        // The scene's hash takes longest to find out.
        let scene_hash = std::cell::LazyCell::new(|| hash::text(hash::scene(baked)));
        let path_hash = hash::text(hash::path(&course.path));
        let adapter = AdapterInfo::of(&gpu.info);
        let same = |run: &&RunResults| {
            run.scene.file_bytes == baked.file_bytes().len() as u64
                && run.adapter == adapter
                && run.path_hash.as_ref() == Some(&path_hash)
                && (run.frames, run.repeats, run.size)
                    == (course.frames, course.repeats, course.size)
                && run.depth == course.depth.name()
                && run.errors().is_some() == course.check
                && run.scene.hash.as_ref() == Some(&*scene_hash)
        };
        let is_same = self.host == earlier.host
            && !runs.is_empty()
            && runs.iter().all(same)
            && all.collect::<BTreeSet<_>>() == labels.collect::<BTreeSet<_>>();
        if is_same {
            self.runs.extend(runs.into_iter().cloned());
            self.skipped.extend(skipped.into_iter().cloned());
        }
        is_same
    }

    fn skip(&mut self, course: &Course, contender: &Contender, reason: String) {
        self.skipped.push(Skipped {
            scene: course.scene_name.clone(),
            path: course.path_name.clone(),
            contender: contender.label(),
            reason,
        });
    }
}

/// The values without repetitions, in order.
pub(crate) fn unique<T: PartialEq>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::results::tests::sample;

    /// Two scenes, with some contenders each.
    pub(crate) fn two_scenes() -> Comparison {
        let mut comparison = Comparison::new(Kind::Compare, "hroc compare".into());
        for scene in ["house", "town"] {
            for (method, knob) in [("noc", None), ("hroc", None), ("hroc", Some(0.5))] {
                let mut run = sample();
                run.scene.name = scene.into();
                run.method = method.into();
                if method == "noc" {
                    (run.mode, run.grouping, run.split) = (None, None, None);
                }
                run.knobs = knob
                    .map(|value| ("late-margin".to_owned(), value))
                    .into_iter()
                    .collect();
                comparison.runs.push(run);
            }
        }
        comparison
    }

    #[test]
    fn runs_are_grouped_and_named() {
        let mut comparison = two_scenes();
        let courses = comparison.courses();
        assert_eq!(
            courses.iter().map(CourseRuns::title).collect::<Vec<_>>(),
            ["house, walk-in", "town, walk-in"]
        );
        assert!(courses.iter().all(|course| course.runs.len() == 3));
        assert_eq!(comparison.series(), ["noc", "hroc of"]);
        assert_eq!(comparison.labels()[2], "hroc of late-margin=0.5");
        assert!(!comparison.failed());
        comparison.runs[1].per_frame[0].wrong_pixels = Some(1);
        assert!(comparison.failed());
        comparison.runs[1].exactness = "approximate".into();
        assert!(!comparison.failed());
    }

    #[test]
    fn results_read_back_and_wrong_files_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.json");
        let comparison = two_scenes();
        let json = serde_json::to_string(&comparison).unwrap();
        std::fs::write(&path, &json).unwrap();
        assert_eq!(Comparison::load(&path).unwrap(), comparison);
        std::fs::write(&path, format!("\u{feff}{json}")).unwrap();
        assert_eq!(Comparison::load(&path).unwrap(), comparison);
        let refused = |text: &str, part: &str| {
            std::fs::write(&path, text).unwrap();
            let message = Comparison::load(&path).unwrap_err().to_string();
            assert!(
                message.contains("results.json") && message.contains(part),
                "{message}"
            );
        };
        refused("{", "line 1");
        refused(
            &json.replacen("\"schema\":1", "\"schema\":9", 1),
            "schema 9",
        );
        refused(&json.replacen("\"runs\"", "\"walks\"", 1), "runs");
    }
}
