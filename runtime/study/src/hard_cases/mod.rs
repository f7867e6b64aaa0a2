//! Scenes on which occlusion culling has failed: named, generated from a seed, each made for one difficulty.
//!
//! A case is a scene and a sequence of frames. Every method has to draw it like no culling does; `hroc hard-cases`
//! holds all of them against that ([`run`]). A new case is a constant in the file of its theme and a line in
//! [`CASES`].

pub mod builder;
mod degenerate;
mod depth;
mod everyday;
mod extremes;
mod hierarchy;
mod history;
mod materials;
mod motion;
mod near_plane;
pub mod no_culling;
pub mod planet;
mod rays;
pub mod run;
mod sampling;
mod screen;
mod small;
mod transforms;

use std::io;

use hroc_format::{ArchivedScene, BakedScene, Check, OpenError};
use hroc_preprocess::bake::{BakeError, BakeOptions, bake};
use hroc_preprocess::progress::Silent;
use hroc_preprocess::scene::SourceScene;
use hroc_runtime::moving::{MovingError, MovingObjects};
use hroc_runtime::{Camera, Scene};

/// How much of a difficulty to generate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// For every test run: at most 128 pixels a side, about 1000 objects and a dozen frames; more frames where
    /// they have few pixels.
    Small,
    /// As many objects and frames as the difficulty was met with elsewhere, as far as a software rasterizer
    /// finishes all cases in minutes.
    Full,
}

impl Scale {
    /// `small` or `full`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Small => "small",
            Self::Full => "full",
        }
    }

    /// Size of frames that have none of their own, pixels.
    pub const fn size(self) -> [u32; 2] {
        match self {
            Self::Small => [128, 72],
            Self::Full => [640, 360],
        }
    }

    /// One of two, by scale.
    fn pick<T>(self, small: T, full: T) -> T {
        match self {
            Self::Small => small,
            Self::Full => full,
        }
    }
}

/// A case.
#[derive(Clone, Copy, Debug)]
pub struct HardCase {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// What went wrong in other systems.
    pub failure: &'static str,
    /// Generates it; the same every time.
    pub make: fn(Scale) -> CaseScene,
}

/// A generated scene with the frames to draw of it.
#[derive(Clone, Debug)]
pub struct CaseScene {
    /// What is baked.
    pub source: SourceScene,
    /// In order: a method remembers what it saw in the frames before.
    pub frames: Vec<CaseFrame>,
    /// Objects that move, if there are any.
    pub motion: Option<Motion>,
}

/// How objects of a case move.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Places for them.
    pub capacity: u32,
    /// Makes the changes before a frame, given its number.
    pub step: fn(usize, &ArchivedScene, &mut MovingObjects) -> Result<(), MovingError>,
}

impl Motion {
    /// Makes the changes before frame `number` and writes them to the GPU.
    ///
    /// # Panics
    /// If the case asks for what cannot be: it is generated, and a test runs it.
    pub fn advance(
        &self,
        number: usize,
        baked: &ArchivedScene,
        moving: &mut MovingObjects,
        queue: &wgpu::Queue,
        scene: &mut Scene,
    ) {
        (self.step)(number, baked, moving).expect("the case's own objects move");
        moving.flush(queue, scene);
    }
}

/// A frame of a case.
#[derive(Clone, Copy, Debug)]
pub struct CaseFrame {
    /// Where it is seen from.
    pub camera: Camera,
    /// Width and height, pixels; `None`: that of the run.
    pub size: Option<[u32; 2]>,
    /// Number of the view, from 0. Each view has a history of its own, hence a method of its own.
    pub view: usize,
}

impl From<Camera> for CaseFrame {
    fn from(camera: Camera) -> Self {
        Self {
            camera,
            size: None,
            view: 0,
        }
    }
}

/// A case that the bake or the format refuses.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The bake refuses it.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// It has no bytes.
    #[error(transparent)]
    Write(#[from] io::Error),
    /// The bytes are refused.
    #[error(transparent)]
    Open(#[from] OpenError),
}

impl CaseScene {
    /// One view that shows `source` from each camera.
    fn new(source: SourceScene, cameras: impl IntoIterator<Item = Camera>) -> Self {
        Self {
            source,
            frames: cameras.into_iter().map(CaseFrame::from).collect(),
            motion: None,
        }
    }

    /// Bakes it in memory, with every tree.
    ///
    /// # Errors
    /// If the bake or the format refuses it.
    pub fn bake(&self) -> Result<BakedScene, CaseError> {
        let (scene, _) = bake(self.source.clone(), &BakeOptions::default(), &Silent)?;
        let bytes = hroc_format::to_bytes(&scene)?;
        Ok(BakedScene::from_aligned(bytes, Check::Objects)?)
    }

    /// Number of views.
    pub fn view_count(&self) -> usize {
        let views = self.frames.iter().map(|frame| frame.view + 1);
        views.max().unwrap_or(0)
    }
}

/// The registry.
pub const CASES: &[HardCase] = &[
    extremes::EMPTY,
    extremes::ONE_OBJECT,
    extremes::TWO_OBJECTS,
    extremes::EVERYTHING_VISIBLE,
    extremes::NOTHING_VISIBLE,
    everyday::CLUTTER,
    everyday::ROOMS,
    near_plane::AROUND_THE_EYE,
    near_plane::THROUGH_A_WALL,
    near_plane::EYE_IN_BOUNDS,
    screen::FOOTPRINTS,
    screen::ODD_SIZES,
    screen::VIEWPORTS,
    screen::PROJECTIONS,
    small::SUB_PIXEL,
    small::FLAT_AND_TINY,
    small::NARROW_GAPS,
    degenerate::DEGENERATE,
    degenerate::NEAR_DEGENERATE,
    degenerate::COLLINEAR,
    degenerate::ONE_PIXEL,
    rays::PARALLEL_RAYS,
    rays::EDGE_RAYS,
    rays::SNAPPED_GRID,
    depth::DEPTH_CONVENTIONS,
    depth::OWN_BOUNDS,
    depth::COPLANAR,
    depth::ULP_LAYERS,
    transforms::FAR_1E3,
    transforms::FAR_1E5,
    transforms::FAR_1E7,
    transforms::WIDE_WORLD,
    planet::BOLTS_ON_A_PLANET,
    planet::ON_A_WIDE_MESH,
    transforms::ODD_TRANSFORMS,
    transforms::CANCELLING,
    hierarchy::IDENTICAL_BOXES,
    hierarchy::COLLINEAR,
    hierarchy::HUGE_BESIDE_TINY,
    history::SUDDEN_CROWD,
    history::STILL_CAMERA,
    history::ABOUT_TURNS,
    history::TELEPORTS,
    history::TWO_VIEWS,
    history::RESIZE,
    history::JITTER,
    materials::GLASS,
    materials::FENCE,
    motion::CROSSING,
    motion::TAKEN_APART,
];

/// The case called `name`.
///
/// # Errors
/// A message that lists the ones there are.
pub fn case(name: &str) -> Result<&'static HardCase, String> {
    CASES.iter().find(|case| case.name == name).ok_or_else(|| {
        let known = CASES.iter().map(|case| case.name).collect::<Vec<_>>();
        format!("no hard case '{name}'; there is: {}", known.join(", "))
    })
}

/// The cases as a Markdown table.
pub fn table() -> String {
    let rows = CASES
        .iter()
        .map(|case| [case.name.to_owned(), case.failure.to_owned()]);
    crate::table::markdown(["case", "what went wrong elsewhere"], rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_found() {
        for (i, entry) in CASES.iter().enumerate() {
            let first = CASES.iter().position(|other| other.name == entry.name);
            assert_eq!(first, Some(i));
            assert_eq!(case(entry.name).unwrap().name, entry.name);
            assert!(table().contains(entry.failure));
        }
        let unknown = case("easy").unwrap_err();
        assert!(CASES.iter().all(|entry| unknown.contains(entry.name)));
    }

    #[test]
    fn small_cases_are_small_and_the_same_every_time() {
        for entry in CASES {
            let (a, b) = ((entry.make)(Scale::Small), (entry.make)(Scale::Small));
            let cameras =
                |case: &CaseScene| case.frames.iter().map(|f| f.camera).collect::<Vec<_>>();
            let places = |case: &CaseScene| {
                let objects = case.source.objects.iter();
                objects
                    .map(|o| (o.mesh, o.world_from_object))
                    .collect::<Vec<_>>()
            };
            assert_eq!(cameras(&a), cameras(&b), "{}", entry.name);
            assert_eq!(places(&a), places(&b), "{}", entry.name);
            assert!(a.source.objects.len() <= 1024, "{}", entry.name);
            assert!(
                !a.frames.is_empty() && a.frames.len() <= 28,
                "{}",
                entry.name
            );
            let sizes = a.frames.iter().filter_map(|frame| frame.size);
            assert!(
                sizes.flatten().all(|side| (1..=128).contains(&side)),
                "{}",
                entry.name
            );
        }
    }
}
