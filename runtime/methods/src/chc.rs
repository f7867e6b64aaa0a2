//! CHC and CHC++: coherent hierarchical culling with occlusion queries (Bittner, Wimmer, Piringer, Purgathofer 2004;
//! Mattausch, Bittner, Wimmer 2008).
//!
//! The host walks the tree from front to back. Nodes that showed in the last frame are opened, leaves that showed are
//! drawn at once and asked about for the next frame; nodes that did not show are asked about, and what lies below waits
//! for the answer. CHC++ adds, each to be switched: limited batches of questions; questions about several nodes that
//! stay hidden together; leaves that are asked about again only after a random number of frames; bounds of an interior
//! node made of the boxes below it.
//!
//! Departures: wgpu hands results over in buffers, so the walk goes on until it has nothing left to do without
//! answers (or a full batch), and all questions are then asked in one pass, one submit and one wait, after what was
//! found so far is drawn. Where something of several nodes shows, interior ones are opened, and leaves asked about one
//! by one along with what comes next, or drawn if nothing does: a wait more would cost more. For the same reason CHC++
//! opens two levels of a node at once. Questions about leaves that showed go along with others; where there are none,
//! they are asked in the next frame that waits anyhow, and the leaf counts as visible until then. Nodes that touch the
//! near plane are opened without a question. A question compares the depth where the pixel's ray enters the padded
//! bounds.

use std::collections::BinaryHeap;

use hroc_format::ArchivedScene;
use hroc_runtime::{
    CameraError, CullingMethod, DepthConvention, Drawer, FrameContext, FrameUniform, HostSync,
    QueryCounts, Scene, Sets, Tree,
};

use crate::host_tree::{HostTree, Placement, Queued};
use crate::queries::{Boxes, Queries};
use crate::view::View;
use crate::waves::Waves;

/// What CHC++ adds to CHC.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChcOptions {
    /// Ask once so many nodes that did not show are known (b); `None`: as late as possible.
    pub batch: Option<usize>,
    /// Ask about several nodes at once that are likely to stay hidden.
    pub multi_queries: bool,
    /// Leaves that show are asked about again after up to so many frames (n_av); 0: in every frame.
    pub assumed_visible: u32,
    /// Bounds of an interior node are the boxes up to so many levels below (d_max); 0: its own.
    pub tighter_levels: u32,
    /// As long as their surfaces are no more than so many times its own (s_max).
    pub tighter_surface: f32,
    /// Levels below an interior node that are opened at once when it shows, or may; at least 1. Not in the papers, whose
    /// waits are filled with other work: with 2 there are nearly half the waits on the way to the leaves, for a few
    /// questions more.
    pub open_levels: u32,
}

impl ChcOptions {
    /// Plain CHC.
    pub const CHC: Self = Self {
        batch: None,
        multi_queries: false,
        assumed_visible: 0,
        tighter_levels: 0,
        tighter_surface: 1.0,
        open_levels: 1,
    };
    /// CHC++ with the parameters of the HROC paper, and two levels opened at once.
    pub const CHC_PLUS_PLUS: Self = Self {
        batch: Some(4000),
        multi_queries: true,
        assumed_visible: 10,
        tighter_levels: 4,
        tighter_surface: 1.4,
        open_levels: 2,
    };
}

/// What is remembered of a node.
#[derive(Clone, Copy, Debug, Default)]
struct NodeState {
    visible: bool,
    /// Number of the frame; frames count from 1.
    last_visited: u32,
    /// Frames in a row that it was found hidden.
    hidden_frames: u32,
    /// Leaves: the frame to ask about it again.
    ask_again: u32,
}

/// Coherent hierarchical culling, for one view.
#[derive(Debug)]
pub struct CoherentCulling {
    name: &'static str,
    options: ChcOptions,
    view: View,
    tree: HostTree,
    queries: Queries,
    waves: Waves,
    states: Vec<NodeState>,
    frame: u32,
    /// State of the generator of random numbers: the same in every run.
    random: u32,
    /// Leaves that showed and are to be asked about.
    leaf_questions: Vec<u32>,
    /// Leaves that did not show, of a question about several nodes of which something did.
    doubtful: Vec<u32>,
    counts: QueryCounts,
}

/// A question on its way.
#[derive(Debug)]
struct Question {
    nodes: Vec<u32>,
    /// It is about a leaf that was drawn already.
    drawn: bool,
}

impl Question {
    /// Whether a node shows that did not show before.
    fn about(node: u32) -> Self {
        Self {
            nodes: vec![node],
            drawn: false,
        }
    }
}

impl CoherentCulling {
    /// CHC or CHC++ over `scene`, baked as `baked`, with its hierarchy `tree`.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        baked: &ArchivedScene,
        tree: &Tree,
        depth: DepthConvention,
        options: ChcOptions,
    ) -> Self {
        let view = View::new(device, depth);
        let host_tree = HostTree::new(baked, &tree.split);
        let plain = options == ChcOptions::CHC;
        Self {
            name: if plain { "chc" } else { "chc++" },
            options,
            queries: Queries::new(device, scene, tree, &view),
            waves: Waves::new(device, scene, depth),
            states: vec![NodeState::default(); host_tree.nodes.len()],
            tree: host_tree,
            view,
            frame: 0,
            random: 1,
            leaf_questions: Vec::new(),
            doubtful: Vec::new(),
            counts: QueryCounts::default(),
        }
    }

    /// A number from 1 to `most` (Marsaglia's xorshift).
    fn random(&mut self, most: u32) -> u32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 17;
        self.random ^= self.random << 5;
        1 + self.random % most
    }

    /// A node shows, and so do all above it.
    fn pull_up(&mut self, node: u32) {
        let (frame, states) = (self.frame, &mut self.states);
        self.tree.pull_up(node, |n| {
            let state = &mut states[n as usize];
            // Above a node that was seen visible in this frame all are.
            let was_marked = state.visible && state.last_visited == frame;
            if !was_marked || n == node {
                (state.visible, state.last_visited, state.hidden_frames) = (true, frame, 0);
            }
            was_marked
        });
    }

    /// Draws a leaf, or queues what is `levels` below a node, and the leaves before.
    fn open(
        &mut self,
        uniform: &FrameUniform,
        n: u32,
        levels: u32,
        queue: &mut BinaryHeap<Queued>,
    ) {
        if let Some(object) = self.tree.nodes[n as usize].object {
            self.waves.add(object);
            return;
        }
        for node in self.tree.children(n) {
            if levels > 1 && !self.tree.is_leaf(node) {
                self.open(uniform, node, levels - 1, queue);
            } else {
                let distance = self.tree.distance(uniform, node);
                queue.push(Queued { distance, node });
            }
        }
    }

    /// Walks on until there is nothing left to do, or a batch of hidden nodes is full.
    fn walk(&mut self, uniform: &FrameUniform, queue: &mut BinaryHeap<Queued>) -> Vec<u32> {
        let batch = self.options.batch.unwrap_or(usize::MAX).max(1);
        let mut hidden = Vec::new();
        while let Some(Queued { node: n, .. }) = queue.pop() {
            let placement = self.tree.placement(uniform, n);
            if placement == Placement::Outside {
                continue;
            }
            let state = &mut self.states[n as usize];
            let was_visible = state.visible && state.last_visited + 1 == self.frame;
            state.visible = false;
            state.last_visited = self.frame;
            let ask_again = state.ask_again;
            if placement == Placement::Open {
                if self.tree.is_leaf(n) {
                    self.pull_up(n);
                }
                self.open(uniform, n, 1, queue);
            } else if was_visible {
                if self.tree.is_leaf(n) {
                    // Until an answer says otherwise.
                    self.pull_up(n);
                    if self.frame >= ask_again {
                        self.leaf_questions.push(n);
                    }
                }
                self.open(uniform, n, 1, queue);
            } else {
                hidden.push(n);
                if hidden.len() >= batch {
                    break;
                }
            }
        }
        hidden
    }

    /// The boxes that stand for a node.
    fn boxes(&self, uniform: &FrameUniform, n: u32) -> Boxes {
        let mut boxes = vec![n];
        let most = self.options.tighter_surface * self.tree.surface(n);
        for _ in 0..self.options.tighter_levels {
            let below = boxes.iter().flat_map(|&n| match self.tree.is_leaf(n) {
                true => vec![n],
                false => self.tree.children(n).to_vec(),
            });
            let below = below.collect::<Vec<_>>();
            let surface = below.iter().map(|&n| self.tree.surface(n)).sum::<f32>();
            if below.len() == boxes.len() || surface > most {
                break;
            }
            boxes = below;
        }
        // A box outside the image has no pixels; one that cannot be rasterized is kept together.
        let placements = boxes.iter().map(|&n| self.tree.placement(uniform, n));
        if placements
            .clone()
            .any(|placement| placement == Placement::Open)
        {
            return vec![n];
        }
        let inside = boxes.iter().zip(placements);
        inside
            .filter(|(_, placement)| *placement != Placement::Outside)
            .map(|(&n, _)| n)
            .collect()
    }

    /// How many questions follow one about several nodes, for this of them, if it fails and opens so many levels.
    fn pieces(&self, n: u32, levels: u32) -> usize {
        if levels == 0 || self.tree.is_leaf(n) {
            return 1;
        }
        let below = self.tree.children(n).into_iter();
        below.map(|node| self.pieces(node, levels - 1)).sum()
    }

    /// Puts nodes that were hidden together, as long as that spares more than it risks.
    fn grouped(&self, mut hidden: Vec<u32>) -> Vec<Question> {
        if !self.options.multi_queries {
            return hidden.into_iter().map(Question::about).collect();
        }
        // The chance that a node stays hidden.
        let keeps = |n: u32| {
            let frames = self.states[n as usize].hidden_frames;
            0.99 - 0.7 * (-f64::from(frames)).exp()
        };
        hidden.sort_by(|&a, &b| keeps(b).total_cmp(&keeps(a)).then(a.cmp(&b)));
        let mut questions = Vec::new();
        let mut rest = hidden.into_iter().peekable();
        while let Some(first) = rest.next() {
            let mut question = Question::about(first);
            let mut all_keep = keeps(first);
            // Benefit over cost: nodes spared per query, and queries when it fails, of what is asked about then.
            let value = |all_keep: f64, count: usize, then: usize| {
                count as f64 / (1.0 + (1.0 - all_keep) * then as f64)
            };
            let levels = self.options.open_levels;
            let mut then = self.pieces(first, levels);
            let mut best = value(all_keep, 1, then);
            while let Some(&next) = rest.peek() {
                let with = all_keep * keeps(next);
                let then_with = then + self.pieces(next, levels);
                let better = value(with, question.nodes.len() + 1, then_with);
                if better <= best {
                    break;
                }
                (all_keep, best, then) = (with, better, then_with);
                question.nodes.push(next);
                rest.next();
            }
            questions.push(question);
        }
        questions
    }

    /// Asks, and queues what shows. Gives the questions that were too many for once.
    fn ask(
        &mut self,
        frame: &mut FrameContext<'_>,
        uniform: &FrameUniform,
        mut questions: Vec<Question>,
        queue: &mut BinaryHeap<Queued>,
    ) -> Vec<Question> {
        let boxes = questions.iter().map(|question| {
            let boxes = question.nodes.iter().map(|&n| self.boxes(uniform, n));
            boxes.collect::<Vec<_>>().concat()
        });
        let boxes = boxes.collect::<Vec<_>>();
        let fitting = self.queries.fitting(&boxes).max(1);
        let answers = self.queries.ask(frame, &boxes[..fitting]);
        self.counts.queries += fitting as u32;
        self.counts.boxes += boxes[..fitting].iter().map(Vec::len).sum::<usize>() as u32;
        self.counts.waits += 1;
        let left = questions.split_off(fitting);
        for (question, shows) in questions.into_iter().zip(answers) {
            match (shows, question.drawn) {
                (true, true) => self.ask_later(question.nodes[0]),
                // It waits for an answer in the next frame.
                (false, true) => self.states[question.nodes[0] as usize].visible = false,
                (true, false) => {
                    self.counts.wasted += 1;
                    match question.nodes[..] {
                        [n] => {
                            self.pull_up(n);
                            if self.tree.is_leaf(n) {
                                self.ask_later(n);
                            }
                            self.open(uniform, n, self.options.open_levels, queue);
                        }
                        _ => {
                            for n in question.nodes {
                                // One of them shows. Half of its record keeps it from failing with the same others
                                // time and again.
                                self.states[n as usize].hidden_frames /= 2;
                                if self.tree.is_leaf(n) {
                                    self.doubtful.push(n);
                                } else {
                                    self.open(uniform, n, self.options.open_levels, queue);
                                }
                            }
                        }
                    }
                }
                (false, false) => {
                    for n in question.nodes {
                        self.states[n as usize].hidden_frames += 1;
                    }
                }
            }
        }
        left
    }

    /// Draws leaves that are not worth a wait of their own. They count as visible until they are asked about in the
    /// next frame.
    fn show_doubtful(&mut self) {
        for n in std::mem::take(&mut self.doubtful) {
            self.pull_up(n);
            let object = self.tree.nodes[n as usize].object;
            object.into_iter().for_each(|object| self.waves.add(object));
            self.leaf_questions.push(n);
        }
    }

    /// A leaf that shows is left alone for a while.
    fn ask_later(&mut self, n: u32) {
        if self.options.assumed_visible > 0 {
            let frames = self.random(self.options.assumed_visible);
            self.states[n as usize].ask_again = self.frame + frames;
        }
    }
}

impl CullingMethod for CoherentCulling {
    fn name(&self) -> &'static str {
        self.name
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
        let mut queue = BinaryHeap::new();
        if !self.tree.nodes.is_empty() {
            let distance = self.tree.distance(&uniform, 0);
            queue.push(Queued { distance, node: 0 });
        }
        let mut questions = Vec::new();
        loop {
            let hidden = self.walk(&uniform, &mut queue);
            let is_last = hidden.is_empty() && questions.is_empty();
            if is_last {
                self.show_doubtful();
            }
            self.waves.draw(frame, drawer);
            if is_last {
                // As long as nobody waits they are noted anew in every frame.
                self.leaf_questions.sort_unstable();
                self.leaf_questions.dedup();
                break;
            }
            questions.extend(self.grouped(hidden));
            questions.extend(self.doubtful.drain(..).map(Question::about));
            // Some may be left from an earlier frame, and have moved out of the image or up to the near plane since.
            let mut leaves = std::mem::take(&mut self.leaf_questions);
            leaves.sort_unstable();
            leaves.dedup();
            leaves.retain(|&n| matches!(self.tree.placement(&uniform, n), Placement::Box { .. }));
            questions.extend(leaves.into_iter().map(|n| Question {
                nodes: vec![n],
                drawn: true,
            }));
            questions = self.ask(frame, &uniform, questions, &mut queue);
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
        self.leaf_questions.clear();
    }

    fn memory_bytes(&self) -> u64 {
        self.view.frame.size() + self.queries.memory_bytes() + self.waves.memory_bytes()
    }
}
