//! The shader of extract_groups against its twin and an f64 oracle, on random trees, cameras and sets.

use bytemuck::Zeroable;
use hroc_format::{ArchivedObjectBounds, Bvh, NO_OBJECT, ObjectBounds};
use hroc_preprocess::tree;
use hroc_runtime::twin::bounds::{footprint, padded, rasterized, relative};
use hroc_runtime::twin::extract_groups::{Groups, TreeView, extract_groups};
use hroc_runtime::twin::{contains, insert};
use hroc_runtime::{DepthConvention, FrameUniform, readback};
use hroc_study::hard_cases::builder::Rng;
use hroc_tests::compute::{Kernel, storage, uniform};
use hroc_tests::group_oracle::{Asked, Decided, and, ask, not, or};
use hroc_tests::{Gpu, gpu, random_trees};

const TREES: u64 = 1000;
const FRAMES: usize = 6;
const SIZES: [[u32; 2]; 5] = [[640, 360], [64, 48], [1, 1], [4096, 16], [1920, 1080]];

/// A tree, the bounds of what moves, and what a frame asks of them.
struct Trial<'a> {
    bvh: &'a Bvh,
    frame: FrameUniform,
    moving: Vec<ObjectBounds>,
    v: Vec<u32>,
    o: Vec<u32>,
    largest_group_px: f32,
}

#[derive(Debug, Default)]
struct Counts {
    /// Nodes and objects that move.
    decisions: usize,
    /// Of them, those that no effective occluder is below: they take more than a look at the set.
    unknown: usize,
    /// Of them, those that f64 leaves to rounding.
    undecided: usize,
    /// Decided differently by shader and twin.
    contested: usize,
    groups: usize,
    untested: usize,
    /// Leaves whose bare bounds are in the frustum and that no effective occluder is.
    covered: usize,
    /// Leaves below two groups, as rounding made a node larger than one around it.
    twice: usize,
}

/// A set in which about `of_8` of 8 are members.
fn random_set(rng: &mut Rng, count: u32, of_8: u64) -> Vec<u32> {
    let mut set = vec![0; count.div_ceil(32) as usize];
    for id in 0..count {
        if rng.bits() % 8 < of_8 {
            insert(&mut set, id);
        }
    }
    set
}

/// None, all, or something between; of about 64, so that small trees are not always visible as a whole.
fn few(rng: &mut Rng, count: u32) -> Vec<u32> {
    let mut set = random_set(rng, count, 4);
    let other = random_set(rng, count, 1);
    for (a, b) in set.iter_mut().zip(other) {
        *a &= b;
    }
    set
}

/// V, and an O that is part of it or, as the shader need not care, is not.
fn sets(rng: &mut Rng, count: u32) -> [Vec<u32>; 2] {
    let v = match rng.bits() % 5 {
        0 => vec![0; count.div_ceil(32) as usize],
        1 => random_set(rng, count, 8),
        2 => random_set(rng, count, 4),
        _ => few(rng, count),
    };
    let mut o = match rng.bits() % 4 {
        0 => random_set(rng, count, 4),
        1 => random_set(rng, count, 0),
        _ => few(rng, count),
    };
    if !rng.bits().is_multiple_of(4) {
        for (o, v) in o.iter_mut().zip(&v) {
            *o &= v;
        }
    }
    [v, o]
}

/// The threshold: published, tiny, anything, or the area of some node, exactly or just below.
fn threshold(rng: &mut Rng, frame: &FrameUniform, bvh: &Bvh) -> f32 {
    match rng.bits() % 5 {
        0 => 1e9,
        1 => 16.0,
        2 => {
            let node = &bvh.nodes[(rng.bits() % bvh.nodes.len() as u64) as usize];
            let outer = rasterized(frame, padded(frame, relative(frame, 0, node.min, node.max)));
            let below = [0.0, rng.magnitude(1e-6, 1e-2) as f32][(rng.bits() % 2) as usize];
            footprint(frame, outer).area_px.max(0.0) * (1.0 - below)
        }
        _ => rng.magnitude(0.5, 2e6) as f32,
    }
}

/// The passes.
struct Shader {
    climb: Kernel,
    collect: Kernel,
}

impl Shader {
    fn new(gpu: &Gpu, depth: DepthConvention) -> Self {
        let wgsl = hroc_shaders::source("extract_groups").unwrap();
        let kernel = |entry| Kernel::new(gpu, &wgsl, entry, &depth.constants());
        Self {
            climb: kernel("climb"),
            collect: kernel("collect"),
        }
    }

    /// What the stage finds; the groups as they come.
    fn run(&self, gpu: &Gpu, trial: &Trial<'_>) -> Groups {
        let (bvh, nodes) = (trial.bvh, trial.bvh.nodes.len());
        let static_count = trial.frame.static_count as usize;
        let mut bounds = vec![ArchivedObjectBounds::zeroed(); static_count];
        bounds.extend(trial.moving.iter().map(random_trees::stored_bounds));
        let frame = uniform(gpu, &trial.frame);
        let node_buffer = storage(gpu, &random_trees::stored(&bvh.nodes));
        let parents = storage(gpu, &bvh.parents);
        let leaves = storage(gpu, &bvh.leaf_of_object);
        let [v, o] = [&trial.v, &trial.o].map(|set| storage(gpu, set));
        let visible = storage(gpu, &vec![0u32; nodes.div_ceil(32)]);
        let u = storage(gpu, &vec![0u32; trial.v.len()]);
        let groups = storage(gpu, &vec![u32::MAX; nodes + trial.moving.len()]);
        let draw = storage(gpu, &[14u32, 0, 0, 0]);
        let grouping = storage(gpu, &[trial.largest_group_px.to_bits(), 0, 0, 0]);
        let object_bounds = storage(gpu, &bounds);
        let bound = [
            (0, &frame),
            (1, &node_buffer),
            (2, &parents),
            (3, &leaves),
            (4, &v),
            (5, &o),
            (6, &visible),
            (7, &u),
            (8, &groups),
            (9, &draw),
            (10, &grouping),
            (11, &object_bounds),
        ];
        let some = |used: &[usize]| used.iter().map(|&i| bound[i]).collect::<Vec<_>>();
        let objects = trial.frame.static_count.div_ceil(64);
        self.climb.run_on(gpu, &some(&[0, 2, 3, 5, 6]), objects);
        let all = (nodes + trial.moving.len()).div_ceil(64) as u32;
        let used = some(&[0, 1, 2, 4, 6, 7, 8, 9, 10, 11]);
        self.collect.run_on(gpu, &used, all);
        let [visible_nodes, untested, mut groups, draw] =
            [&visible, &u, &groups, &draw].map(|b| readback::words(&gpu.device, &gpu.queue, b));
        groups.truncate(draw[1] as usize);
        groups.sort_unstable();
        Groups {
            visible_nodes,
            groups,
            untested,
        }
    }
}

#[test]
fn extract_groups_agrees_with_its_twin_and_covers_every_leaf() {
    let Some(gpu) = gpu() else { return };
    let shaders = DepthConvention::ALL.map(|depth| Shader::new(gpu, depth));
    let mut counts = Counts::default();
    for seed in 0..TREES {
        let mut rng = Rng(seed);
        let reach = rng.magnitude(1.0, 1000.0);
        let cameras = (0..FRAMES)
            .map(|i| {
                let size = SIZES[(seed as usize + i) % SIZES.len()];
                let aspect = f64::from(size[0]) / f64::from(size[1]);
                (random_trees::camera(&mut rng, reach), aspect, size)
            })
            .collect::<Vec<_>>();
        let views = cameras.iter().map(|(camera, aspect, _)| (*camera, *aspect));
        let views = views.collect::<Vec<_>>();
        let count = match seed % 10 {
            // A root that is a leaf, or has two.
            0 => 1 + seed as usize / 10 % 3,
            1 => 31 + seed as usize / 10 % 3,
            _ => rng.magnitude(10.0, 3000.0) as usize,
        };
        let huge = seed % 4 == 3;
        let boxes = random_trees::boxes(&mut rng, &views, reach, count, huge);
        let builders = tree::builders().collect::<Vec<_>>();
        let builder = builders[seed as usize % builders.len()];
        let bvh = builder.build(&boxes).unwrap();
        for (i, &(camera, _, size)) in cameras.iter().enumerate() {
            let slots = [0, 5, 70][(seed as usize + i) % 3];
            let moving = random_trees::boxes(&mut rng, &views, reach, slots, false);
            let mut moving = moving.iter().map(random_trees::placed).collect::<Vec<_>>();
            for (i, bounds) in moving.iter_mut().enumerate().step_by(4) {
                // Empty slots: as they are made, and a box that is inside out by an ulp, which padding turns back.
                if i % 8 == 0 {
                    bounds.min = [f32::MAX; 3];
                    bounds.max = [f32::MIN; 3];
                } else {
                    bounds.max[0] = bounds.min[0].next_down();
                }
            }
            let mut shape = random_trees::shape(&boxes, slots as u32);
            if i % 2 == 1 {
                // Of a device that was not probed.
                shape.subpixel_step_px = 1.0 / 16.0;
            }
            let reversed = (seed as usize + i) % 2;
            let depth = DepthConvention::ALL[reversed];
            let frame = FrameUniform::new(&camera, depth, size, &shape).unwrap();
            let [v, o] = sets(&mut rng, shape.object_count);
            let trial = Trial {
                bvh: &bvh,
                largest_group_px: threshold(&mut rng, &frame, &bvh),
                frame,
                moving,
                v,
                o,
            };
            let found = shaders[reversed].run(gpu, &trial);
            let at = format!("seed {seed} frame {i} {} {depth:?}", builder.name());
            check(&trial, &found, &at, &mut counts);
        }
    }
    gpu.check().unwrap();
    eprintln!("{counts:?}");
    let Counts {
        unknown, covered, ..
    } = counts;
    assert!(
        unknown > 2_000_000 && covered > 100_000 && counts.groups > 50_000,
        "{counts:?}"
    );
    assert!(counts.untested > 50_000, "{counts:?}");
    // The oracle leaves little to rounding, and rounding decides little of that differently.
    assert!(counts.undecided * 500 < unknown, "{counts:?}");
    assert!(counts.contested * 5000 < unknown, "{counts:?}");
    assert!(counts.twice * 1000 < covered, "{counts:?}");
}

fn check(trial: &Trial<'_>, shader: &Groups, at: &str, counts: &mut Counts) {
    let (bvh, frame) = (trial.bvh, &trial.frame);
    let stored = random_trees::stored(&bvh.nodes);
    let view = TreeView {
        nodes: &stored,
        parents: &bvh.parents,
        leaf_of_object: &bvh.leaf_of_object,
    };
    let px = trial.largest_group_px;
    let twin = extract_groups(frame, view, &trial.moving, &trial.v, &trial.o, px);
    let nodes = bvh.nodes.len() as u32;

    // Visible: an effective occluder stands in the range of the subtree. No rounding.
    let mut drawn_before = vec![0u32];
    for node in &bvh.nodes {
        let drawn = node
            .object()
            .is_some_and(|object| contains(&trial.o, object));
        drawn_before.push(drawn_before[drawn_before.len() - 1] + u32::from(drawn));
    }
    let visible =
        |n: u32| drawn_before[bvh.nodes[n as usize].skip as usize] > drawn_before[n as usize];
    for n in 0..nodes {
        assert_eq!(contains(&shader.visible_nodes, n), visible(n), "{at}: {n}");
    }
    assert_eq!(shader.visible_nodes, twin.visible_nodes, "{at}");

    let asked = bvh.nodes.iter().map(|node| {
        let bounds = ObjectBounds {
            min: node.min,
            cell: node.cell(),
            max: node.max,
            reserved: 0,
        };
        ask(frame, &bounds, px)
    });
    let asked = asked.collect::<Vec<_>>();
    let moving = trial.moving.iter().map(|bounds| ask(frame, bounds, px));
    let moving = moving.collect::<Vec<_>>();
    let mut groups = [&shader.groups, &twin.groups].map(|groups| {
        let mut is_group = vec![false; nodes as usize + moving.len()];
        for &n in groups {
            assert!(!is_group[n as usize], "{at}: node {n} twice");
            is_group[n as usize] = true;
        }
        is_group
    });
    counts.groups += shader.groups.len();
    counts.untested += readback::members_of(&shader.untested).count();
    let mut compare = |n: usize, object: u32, group: Decided, untested: Decided| {
        counts.decisions += 1;
        counts.unknown += usize::from(n >= nodes as usize || !visible(n as u32));
        counts.undecided += usize::from(group.is_none() || untested.is_none());
        let mut answers = groups.iter().zip([shader, &twin]).map(|(is_group, found)| {
            let in_u = object != NO_OBJECT && contains(&found.untested, object);
            (is_group[n], in_u)
        });
        let [by_shader, by_twin] = std::array::from_fn(|_| answers.next().unwrap());
        for (name, (is_group, in_u)) in [("shader", by_shader), ("twin", by_twin)] {
            assert!(
                group.is_none_or(|group| group == is_group)
                    && untested.is_none_or(|untested| untested == in_u),
                "{at}: node {n}, object {object}: {name} group {is_group} untested {in_u}, oracle {group:?} {untested:?}"
            );
        }
        counts.contested += usize::from(by_shader != by_twin);
    };
    for n in 0..nodes {
        let node = &bvh.nodes[n as usize];
        let parent = bvh.parents[n as usize];
        let Asked {
            in_frustum,
            rasterizable,
            refine,
            ..
        } = asked[n as usize];
        let topmost = or(
            Some(n == 0 || visible(parent)),
            asked[parent as usize].refine,
        );
        let reached = and(and(Some(!visible(n)), topmost), in_frustum);
        if let Some(object) = node.object() {
            let drawn = Some(contains(&trial.v, object));
            let untested = and(and(reached, not(rasterizable)), not(drawn));
            compare(n as usize, object, and(reached, rasterizable), untested);
        } else {
            let group = and(reached, not(refine));
            compare(n as usize, NO_OBJECT, group, Some(false));
        }
    }
    for (slot, asked) in moving.iter().enumerate() {
        let object = frame.static_count + slot as u32;
        let bounds = &trial.moving[slot];
        let there = bounds.min[0] <= bounds.max[0] && !contains(&trial.v, object);
        let reached = and(Some(there), asked.in_frustum);
        let untested = and(reached, not(asked.rasterizable));
        let group = and(reached, asked.rasterizable);
        compare(nodes as usize + slot, object, group, untested);
        if there && asked.bare_in_frustum {
            counts.covered += 1;
            let is_group = groups[0][nodes as usize + slot];
            let in_u = contains(&shader.untested, object);
            assert!(is_group != in_u, "{at}: moving object {object}");
        }
    }

    // Whatever rounding decided: each leaf in view that was not drawn as an occluder lies in a group or goes to U or,
    // where no box can stand for it, is in V and was drawn; and in one group only, unless rounding made a node larger
    // than one around it.
    let [shader_groups, _] = &mut groups;
    for (object, &leaf) in (0u32..).zip(&bvh.leaf_of_object) {
        let mut above = Vec::new();
        let mut n = leaf;
        let mut rounded = false;
        loop {
            if shader_groups[n as usize] {
                above.push(n);
            }
            rounded |= asked[n as usize].refine.is_none();
            if n == 0 {
                break;
            }
            n = bvh.parents[n as usize];
        }
        let [in_o, in_u, in_v] =
            [&trial.o, &shader.untested, &trial.v].map(|set| contains(set, object));
        assert!(!(in_u && in_v), "{at}: object {object} in U and V");
        assert!(
            !in_o || above.is_empty(),
            "{at}: {object} drawn and below {above:?}"
        );
        if in_o || !asked[leaf as usize].bare_in_frustum {
            continue;
        }
        counts.covered += 1;
        let untestable = asked[leaf as usize].rasterizable != Some(true);
        assert!(
            !above.is_empty() || in_u || (in_v && untestable),
            "{at}: object {object} in view was left out"
        );
        let times = above.len() + usize::from(in_u);
        assert!(
            times < 2 || rounded,
            "{at}: object {object} below {above:?}, in U {in_u}"
        );
        counts.twice += usize::from(times > 1);
    }
}
