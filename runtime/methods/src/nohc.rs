//! NOHC: near optimal hierarchical culling (Guthe, Balázs, Klein, EGSR 2006). A walk like CHC's that asks only where the
//! measured cost of the question is less than what it may be expected to spare.
//!
//! Departures: answers come in batches, as in [`chc`](crate::CoherentCulling), so what is below a node that is asked
//! about without waiting is never taken back; its answer serves the next frame. The surface of an object is that of its
//! mesh times the mean scale of its transform squared. The hardware is measured with made-up geometry, not with the
//! host's materials.

use std::collections::BinaryHeap;

use hroc_format::ArchivedScene;
use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FrameContext, FrameUniform, HostSync,
    QueryCounts, Scene, Sets, Tree,
};

use crate::contents::Contents;
use crate::hardware::HardwareTimes;
use crate::host_tree::{HostTree, Placement, Queued};
use crate::queries::Queries;
use crate::reference::Recorded;
use crate::view::View;
use crate::waves::Waves;

#[derive(Clone, Copy, Debug, Default)]
struct NodeState {
    visible: bool,
    /// Number of the frame; frames count from 2, so that nothing was visited in the frame before the first.
    last_visited: u32,
    last_asked: u32,
}

/// What is estimated of a node in a frame.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    render_ms: f64,
    query_ms: f64,
    /// The chance that it is hidden (p_o).
    occlusion: f64,
    /// C and B of section 4.1.
    benefit_ms: f64,
}

/// NOHC for one view.
#[derive(Debug)]
pub struct NearOptimalCulling {
    view: View,
    tree: HostTree,
    contents: Contents,
    hardware: HardwareTimes,
    queries: Queries,
    waves: Waves,
    /// What shows, where that is known beforehand; the states are not used then.
    recorded: Option<Recorded>,
    states: Vec<NodeState>,
    frame: u32,
    counts: QueryCounts,
}

impl NearOptimalCulling {
    /// NOHC over `scene`, baked as `baked`, with its hierarchy `tree`, on a device with these `hardware` times.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        baked: &ArchivedScene,
        tree: &Tree,
        depth: DepthConvention,
        hardware: HardwareTimes,
    ) -> Self {
        let view = View::new(device, depth);
        let host_tree = HostTree::new(baked, &tree.split);
        Self {
            contents: Contents::new(baked, &host_tree),
            hardware,
            queries: Queries::new(device, scene, tree, &view),
            waves: Waves::new(device, scene, depth),
            recorded: None,
            states: vec![NodeState::default(); host_tree.nodes.len()],
            tree: host_tree,
            view,
            frame: 1,
            counts: QueryCounts::default(),
        }
    }

    /// The paper's optimum, a bound: knows what shows, and asks only about nodes below which nothing does, where
    /// that costs less than drawing them and than asking about their children. Draws the rest unasked.
    #[must_use]
    pub fn told(self, recorded: Recorded) -> Self {
        Self {
            recorded: Some(recorded),
            ..self
        }
    }

    /// It was not visited in the last frame: it comes into view, or out from behind what hid all of a node above it.
    fn has_entered(&self, n: u32) -> bool {
        self.states[n as usize].last_visited + 1 != self.frame
    }

    /// It was visited in the last frame and did not show.
    fn was_occluded(&self, n: u32) -> bool {
        !self.has_entered(n) && !self.states[n as usize].visible
    }

    /// Times and benefit of a node whose box covers `area_px`, where `covered` of the screen is covered in front.
    fn estimate(&self, n: u32, area_px: f64, covered: f64, pixels: f64) -> Estimate {
        let hardware = &self.hardware;
        let coverage = self.contents.coverage(&self.tree, n).min(1.0);
        let triangles = self.contents.triangles(&self.tree, n);
        let leaves = f64::from(self.tree.leaf_count(n));
        // Two fragments per pixel covered, as the paper presumes.
        let fragments = 2.0 * coverage * area_px;
        let render_ms = (leaves * hardware.draw_ms)
            .max(triangles * hardware.triangle_ms)
            .max(fragments * hardware.fragment_ms);
        let query_ms = hardware.query_ms + area_px * hardware.query_fragment_ms;
        let box_share = (area_px / pixels).min(1.0);
        let covering = if box_share < covered {
            (covered.sqrt() - box_share.sqrt()).powi(2)
        } else {
            0.0
        };
        let occlusion = if self.has_entered(n) {
            covering
        } else if self.states[n as usize].visible {
            0.5 * covering * covering
        } else {
            1.0
        };
        let levels = (self.tree.nodes.len() as f64 + 1.0).log2();
        Estimate {
            render_ms,
            query_ms,
            occlusion,
            benefit_ms: occlusion * (render_ms - query_ms) / levels,
        }
    }

    /// Figure 5. In the optimum, its first test alone, of nodes that are hidden.
    fn is_reasonable(
        &self,
        uniform: &FrameUniform,
        n: u32,
        area_px: f64,
        covered: f64,
        hidden: Option<&[bool]>,
    ) -> bool {
        if hidden.is_some_and(|hidden| !hidden[n as usize]) {
            return false;
        }
        let pixels = f64::from(uniform.size[0]) * f64::from(uniform.size[1]);
        let node = self.estimate(n, area_px, covered, pixels);
        let children = if self.tree.is_leaf(n) {
            Vec::new()
        } else {
            self.tree.children(n).to_vec()
        };
        let below = children.iter().filter_map(|&child| {
            let area_px = match self.tree.placement(uniform, child) {
                Placement::Outside => return None,
                Placement::Open => pixels,
                Placement::Box { area_px } => f64::from(area_px),
            };
            Some(self.estimate(child, area_px, covered, pixels))
        });
        let below = below.collect::<Vec<_>>();
        let sum = |value: fn(&Estimate) -> f64| below.iter().map(value).sum::<f64>();
        if node.render_ms < node.query_ms
            || (!children.is_empty() && sum(|child| child.query_ms) < node.query_ms)
        {
            return false;
        }
        if hidden.is_some() || self.was_occluded(n) {
            return true;
        }
        let pays = if self.has_entered(n) {
            node.query_ms + (1.0 - node.occlusion) * node.render_ms < node.render_ms
        } else {
            let frames = f64::from(self.frame - self.states[n as usize].last_asked);
            node.query_ms <= frames * node.benefit_ms
        };
        if !pays {
            return false;
        }
        if children.is_empty() || below.iter().any(|child| child.render_ms < child.query_ms) {
            return true;
        }
        let leaves = f64::from(self.tree.leaf_count(n));
        node.benefit_ms > sum(|child| child.benefit_ms)
            && self.hardware.query_overhead_ms * leaves > node.query_ms
    }

    /// Of the optimum: below which nodes nothing shows.
    fn hidden(&self) -> Option<Vec<bool>> {
        let recorded = self.recorded.as_ref()?.words();
        let mut hidden = vec![true; self.tree.nodes.len()];
        // Children come after their parents.
        for (n, node) in self.tree.nodes.iter().enumerate().rev() {
            if let Some(object) = node.object {
                let word = recorded.get((object >> 5) as usize);
                // A recording of fewer objects knows nothing of the rest.
                hidden[n] = word.is_some_and(|word| word >> (object & 31) & 1 == 0);
            }
            hidden[node.parent as usize] &= hidden[n];
        }
        Some(hidden)
    }

    /// A leaf shows, and so do all above it.
    fn pull_up(&mut self, leaf: u32) {
        let (frame, states) = (self.frame, &mut self.states);
        self.tree.pull_up(leaf, |n| {
            let state = &mut states[n as usize];
            let was_marked = state.visible && state.last_visited == frame;
            (state.visible, state.last_visited) = (true, frame);
            was_marked
        });
    }

    /// Draws a leaf, or queues what is below a node.
    fn process(&mut self, walk: &mut Walk<'_>, n: u32, area_px: f64) {
        if let Some(object) = self.tree.nodes[n as usize].object {
            self.waves.add(object);
            self.pull_up(n);
            let coverage = self.contents.coverage(&self.tree, n).min(1.0);
            let share = coverage * (area_px / walk.pixels).min(1.0);
            walk.covered += (1.0 - walk.covered) * share;
        } else {
            walk.queue.extend(self.tree.children(n).map(|node| Queued {
                distance: self.tree.distance(walk.uniform, node),
                node,
            }));
        }
    }
}

/// The state of a frame's walk.
struct Walk<'a> {
    uniform: &'a FrameUniform,
    queue: BinaryHeap<Queued>,
    /// Share of the screen that is covered by what was drawn (c_scr).
    covered: f64,
    pixels: f64,
}

/// A question: the node, the pixels of its box, and whether what is below waits for the answer.
#[derive(Clone, Copy, Debug)]
struct Question {
    node: u32,
    area_px: f64,
    waits: bool,
}

impl CullingMethod for NearOptimalCulling {
    fn name(&self) -> &'static str {
        if self.recorded.is_some() {
            "nohc-optimum"
        } else {
            "nohc"
        }
    }

    fn host_sync(&self) -> HostSync {
        HostSync::MidFrame
    }

    fn encode(
        &mut self,
        frame: &mut FrameContext<'_>,
        drawer: &mut dyn Drawer,
    ) -> Result<(), CameraError> {
        let uniform = self.view.begin(frame)?;
        self.frame += 1;
        self.counts = QueryCounts::default();
        self.waves.begin(frame.scene);
        let hidden = self.hidden();
        let mut walk = Walk {
            uniform: &uniform,
            queue: BinaryHeap::new(),
            covered: 0.0,
            pixels: f64::from(uniform.size[0]) * f64::from(uniform.size[1]),
        };
        if !self.tree.nodes.is_empty() {
            let distance = self.tree.distance(&uniform, 0);
            walk.queue.push(Queued { distance, node: 0 });
        }
        loop {
            let mut questions = Vec::new();
            while let Some(Queued { node, .. }) = walk.queue.pop() {
                let placement = self.tree.placement(&uniform, node);
                let area_px = match placement {
                    Placement::Outside => continue,
                    Placement::Open => walk.pixels,
                    Placement::Box { area_px } => f64::from(area_px),
                };
                let asks = placement != Placement::Open
                    && self.is_reasonable(&uniform, node, area_px, walk.covered, hidden.as_deref());
                let waits = asks && (hidden.is_some() || self.was_occluded(node));
                let has_entered = self.has_entered(node);
                let state = &mut self.states[node as usize];
                state.last_visited = self.frame;
                state.visible = !asks;
                // What comes into view counts as asked about even if it is not.
                if asks || has_entered {
                    state.last_asked = self.frame;
                }
                if asks {
                    questions.push(Question {
                        node,
                        area_px,
                        waits,
                    });
                }
                if !waits {
                    self.process(&mut walk, node, area_px);
                }
            }
            self.waves.draw(frame, drawer);
            if questions.is_empty() {
                break;
            }
            // Without anything that waits, the answers serve the next frame only; they still have to be had.
            let mut rest = &questions[..];
            while !rest.is_empty() {
                let boxes = rest.iter().map(|question| vec![question.node]);
                let boxes = boxes.collect::<Vec<_>>();
                let fitting = self.queries.fitting(&boxes).max(1);
                let answers = self.queries.ask(frame, &boxes[..fitting]);
                self.counts.queries += fitting as u32;
                self.counts.boxes += fitting as u32;
                self.counts.waits += 1;
                for (question, shows) in rest[..fitting].iter().zip(answers) {
                    let &Question {
                        node,
                        area_px,
                        waits,
                    } = question;
                    self.counts.wasted += u32::from(shows && waits);
                    self.states[node as usize].visible = shows;
                    if shows && self.tree.is_leaf(node) {
                        self.pull_up(node);
                    }
                    if shows && waits {
                        self.process(&mut walk, node, area_px);
                    }
                }
                rest = &rest[fitting..];
            }
        }
        self.waves.end(frame, drawer);
        Ok(())
    }

    fn sets(&self) -> Sets<'_> {
        self.waves.sets()
    }

    fn queries(&self) -> Option<QueryCounts> {
        Some(self.counts)
    }

    fn depth(&self) -> DepthConvention {
        self.view.depth
    }

    fn reset(&mut self, _encoder: &mut wgpu::CommandEncoder) {
        self.states.fill(NodeState::default());
    }

    fn memory_bytes(&self) -> u64 {
        self.view.frame.size() + self.queries.memory_bytes() + self.waves.memory_bytes()
    }
}
