//! What a bake tells about itself.

use super::accuracy::Baked;
use super::{ACCURACY, Accuracy, Provenance};
use glam::DVec3;
use hroc_format::{ArchivedBvh, BakedScene, BvhStats, Object, Sections};
use std::time::Instant;

/// What a bake did.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct BakeReport {
    /// Objects of the source, before large ones are cut; 0 where the source was not read.
    pub source_objects: usize,
    /// Number of objects.
    pub objects: usize,
    /// Triangles drawn, instances counted each.
    pub triangles: u64,
    /// Meshes stored.
    pub meshes: usize,
    /// Vertices stored.
    pub vertices: usize,
    /// Vertices of the source's meshes; 0 where the source was not read.
    pub source_vertices: usize,
    /// Triangles stored.
    pub stored_triangles: usize,
    /// How far the baked scene is from its source; `None` for a file that does not say.
    pub accuracy: Option<Accuracy>,
    /// How the sources were read.
    #[serde(skip)]
    pub provenance: Provenance,
    /// Triangles of the source's meshes that were left out: two of their corners coincide.
    pub coincident_triangles: u64,
    /// Triangles stored that f32 cannot tell from a line.
    pub sliver_triangles: u64,
    /// Objects left out because no triangle of theirs was left.
    pub empty_objects: usize,
    /// The trees.
    pub trees: Vec<TreeReport>,
    /// Wall time of each stage, in order.
    pub stages: Vec<Stage>,
    /// What was left out or changed, for the user to read.
    pub warnings: Vec<String>,
}

/// Statistics of a tree; the fields of [`BvhStats`].
#[derive(Clone, Debug, serde::Serialize)]
#[allow(missing_docs)]
pub struct TreeReport {
    pub split: String,
    pub nodes: usize,
    pub depth: u32,
    pub mean_leaf_depth: f64,
    pub sah_cost: f64,
    pub overlap: f64,
}

impl TreeReport {
    /// From the stored statistics.
    pub fn new(split: &str, nodes: usize, stats: &BvhStats) -> Self {
        let BvhStats {
            depth,
            mean_leaf_depth,
            sah_cost,
            overlap,
            ..
        } = *stats;
        Self {
            split: split.to_owned(),
            nodes,
            depth,
            mean_leaf_depth,
            sah_cost,
            overlap,
        }
    }
}

/// Wall time of a stage.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Stage {
    /// Its name.
    pub name: &'static str,
    /// In seconds.
    pub seconds: f64,
}

impl BakeReport {
    /// What can be told of a scene that was baked before.
    pub fn of(baked: &BakedScene) -> Self {
        let scene = baked.scene();
        let tree = |bvh: &ArchivedBvh| {
            TreeReport::new(&bvh.split, bvh.nodes.len(), &bvh.stats.to_native())
        };
        Self {
            source_objects: 0,
            objects: scene.objects.len(),
            triangles: scene.drawn_triangle_count(),
            meshes: scene.meshes.len(),
            vertices: scene.vertex_count(),
            source_vertices: 0,
            stored_triangles: scene.indices.len() / 3,
            accuracy: Accuracy::of(baked).ok().flatten(),
            provenance: Provenance::of(baked).unwrap_or_default(),
            coincident_triangles: 0,
            sliver_triangles: 0,
            empty_objects: 0,
            trees: scene.bvhs.iter().map(tree).collect(),
            stages: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// The optional sections of the baked file.
    pub fn sections(&self) -> Sections {
        let mut sections = Sections::new();
        if let Some(accuracy) = &self.accuracy {
            sections.insert(ACCURACY, accuracy.to_json());
        }
        self.provenance.add_to(&mut sections);
        sections
    }

    /// Measures how far the baked scene is from its source, and warns where that is far. `cleaned`: triangles of the
    /// source that were left out before the rest was measured.
    pub(super) fn measure(
        &mut self,
        baked: &Baked<'_>,
        cell_origin: impl Fn(&Object) -> DVec3 + Sync,
        quantized: bool,
        cleaned: u64,
    ) {
        let mut accuracy = Accuracy::measure(baked, cell_origin);
        accuracy.triangles.source += cleaned;
        accuracy.triangles.dropped_coincident_corners += cleaned;
        self.warnings.extend(accuracy.warnings(quantized));
        self.accuracy = Some(accuracy);
    }

    /// Adds a warning for each kind of triangle that covers nothing.
    pub(super) fn warn_of_degenerate(&mut self) {
        let counts = [
            (
                self.coincident_triangles,
                "triangles left out because two of their corners coincide",
            ),
            (
                self.empty_objects as u64,
                "objects left out because no triangle of theirs covers anything",
            ),
            (
                self.sliver_triangles,
                "triangles kept that are so thin that f32 cannot tell them from a line",
            ),
        ];
        let counts = counts.into_iter().filter(|&(count, _)| count > 0);
        let warnings = counts.map(|(count, what)| format!("{what}: {count}"));
        self.warnings.extend(warnings);
    }

    /// Runs a stage and notes how long it took.
    pub(super) fn timed<T>(&mut self, name: &'static str, stage: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = stage();
        self.stages.push(Stage {
            name,
            seconds: start.elapsed().as_secs_f64(),
        });
        result
    }
}
