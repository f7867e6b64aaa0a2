//! What one fragment of batch_occlusion_test decides: the shader's own traversal against its twin and an f64 oracle.
//!
//! Every pixel has a small tree of its own, with a word of U to itself, so that what each fragment flags can be told
//! apart. The boxes crowd where the pixel's ray touches corners, edges and faces, within a few paddings; the map's
//! depth crowds where the ray enters them, within a few ulps.

use bytemuck::Zeroable;
use glam::{DVec2, DVec3, Vec2};
use hroc_format::{ArchivedBvhNode, ArchivedObjectBounds, Bounds, BvhNode, ObjectBounds};
use hroc_preprocess::tree;
use hroc_runtime::twin::batch_occlusion_test::Tested;
use hroc_runtime::twin::bounds::DEPTH_TOLERANCE_RELATIVE;
use hroc_runtime::twin::{contains, insert};
use hroc_runtime::{Camera, DepthConvention, FrameUniform, readback};
use hroc_study::hard_cases::builder::Rng;
use hroc_tests::compute::{Kernel, storage, uniform};
use hroc_tests::depth_map::DepthMaps;
use hroc_tests::oracle::{RayOracle, Standing};
use hroc_tests::{Gpu, gpu, random_trees};

const PROBE: &str = "//!import batch_occlusion_test
@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= arrayLength(&groups)) { return; }
    let group = groups[id.x];
    let position = vec2f(f32(id.x % frame.size.x), f32(id.x / frame.size.x)) + 0.5;
    test_fragment(BoxVertex(vec4f(position, 0.0, 1.0), group, earliest_in(group_box(group))));
}";

/// Pixels, each with its tree.
const PIXELS: u32 = 1 << 14;
const SIZES: [[u32; 2]; 3] = [[128, 128], [256, 64], [32, 512]];
/// Objects of a tree; their ids fill a word of U.
const LEAVES: u32 = 32;
/// Every eighth pixel has an object that moves, too.
const MOVING: u32 = PIXELS / 8;
const FORESTS: u64 = 12;
/// Maps and groups that a forest is tested with.
const ROUNDS: usize = 9;
/// With pruning, rounds that share U and the nodes that are flagged.
const SHARED: usize = 3;
/// Boxes that are flagged are met by the ray within this many paddings.
const MARGIN: f64 = 2.0;

/// The trees of all pixels, one after the other.
struct Forest {
    nodes: Vec<ArchivedBvhNode>,
    parents: Vec<u32>,
    /// The root of each pixel's tree, and where the last one ends.
    roots: Vec<u32>,
    moving: Vec<ObjectBounds>,
    frame: FrameUniform,
    depth: DepthConvention,
}

/// A box at the ray of `position`, in the space of a cell whose zero is at `zero`, eye-relative.
fn box_at_ray(
    rng: &mut Rng,
    rays: &RayOracle<'_>,
    position: DVec2,
    reach: f64,
    padding: f64,
    zero: DVec3,
) -> Bounds {
    let t = rng.magnitude(1e-3, 2.0 * reach);
    let on_ray = rays.point(position, t);
    let largest = t.max(0.01) * rng.magnitude(1e-5, 0.5);
    let mut half = rng.point(largest).abs();
    if rng.bits().is_multiple_of(4) {
        half[(rng.bits() % 3) as usize] = 0.0;
    }
    // The point of the box that is put on the ray: a corner, on an edge, on a face, within.
    let axes = rng.bits() % 4;
    let at = DVec3::from_array(std::array::from_fn(|axis| {
        let inside = rng.within(-1.0, 1.0);
        if (axis as u64) < axes {
            inside.signum()
        } else {
            inside
        }
    }));
    let mut center = on_ray - half * at;
    match rng.bits() % 8 {
        // Nudged by up to a few paddings, or by ulps.
        0..3 => center += rng.point(3.0) * padding * (1.0 + t),
        3 => center += rng.point(1e-6) * center.abs().max_element(),
        4 => center += rng.point(reach),
        _ => {}
    }
    random_trees::bounds(center - zero, half)
}

/// From the zero of eye-relative positions to that of the first cell.
fn zero(frame: &FrameUniform) -> DVec3 {
    let [x, y, z, _] = frame.cells[0].map(f64::from);
    DVec3::new(x, y, z)
}

impl Forest {
    fn new(rng: &mut Rng, camera: &Camera, depth: DepthConvention, size: [u32; 2]) -> Self {
        let reach = camera.position.abs().max_element().max(1.0);
        let static_count = PIXELS * LEAVES;
        // The rays do not depend on the shape, the paddings do.
        let mut shape = random_trees::shape(&[], MOVING);
        shape.reach = 3.0 * reach;
        shape.radius = 2.0 * reach;
        let rough = FrameUniform::new(camera, depth, size, &shape).unwrap();
        let rays = RayOracle::new(&rough, depth, 1.0);
        let padding = f64::from(rough.padding_per_depth.max(rough.padding_per_reach));
        let zero = zero(&rough);
        let builders = tree::builders().collect::<Vec<_>>();
        let mut forest = Self {
            nodes: Vec::new(),
            parents: Vec::new(),
            roots: vec![0],
            moving: Vec::new(),
            frame: rough,
            depth,
        };
        let mut all = Vec::new();
        for pixel in 0..PIXELS {
            let mut made = |count: u64| {
                let position = center(pixel, size);
                (0..count)
                    .map(|_| box_at_ray(rng, &rays, position, reach, padding, zero))
                    .collect::<Vec<_>>()
            };
            if pixel % 8 == 7 {
                forest
                    .moving
                    .extend(made(1).iter().map(random_trees::placed));
            }
            let leaves = made([1, 2, 5, 9, 3, 14, 7, u64::from(LEAVES)][pixel as usize % 8]);
            let builder = builders[pixel as usize % builders.len()];
            let bvh = builder.build(&leaves).unwrap();
            all.extend(leaves);
            let base = forest.nodes.len() as u32;
            let nodes = bvh.nodes.iter().map(|node| BvhNode {
                skip: base + node.skip,
                cell_and_object: BvhNode::pack(
                    0,
                    node.object().map(|object| pixel * LEAVES + object),
                ),
                ..*node
            });
            let nodes = nodes.collect::<Vec<_>>();
            forest.nodes.extend(random_trees::stored(&nodes));
            forest.parents.extend(bvh.parents.iter().map(|n| base + n));
            forest.roots.push(forest.nodes.len() as u32);
        }
        all.extend(forest.moving.iter().map(|b| Bounds {
            min: b.min,
            max: b.max,
        }));
        let mut shape = random_trees::shape(&all, 0);
        shape.static_count = static_count;
        shape.object_count = static_count + MOVING;
        forest.frame = FrameUniform::new(camera, depth, size, &shape).unwrap();
        // Many trees have fewer nodes than one.
        forest.frame.node_count = forest.nodes.len() as u32;
        forest
    }

    /// The bare bounds of a group, eye-relative.
    fn bare(&self, group: u32) -> [DVec3; 2] {
        let zero = zero(&self.frame);
        let corner = |corner: [f32; 3]| DVec3::from_array(corner.map(f64::from)) + zero;
        match self.nodes.get(group as usize) {
            Some(node) => {
                let node = node.to_native();
                [corner(node.min), corner(node.max)]
            }
            None => {
                let bounds = &self.moving[(group - self.frame.node_count) as usize];
                [corner(bounds.min), corner(bounds.max)]
            }
        }
    }

    /// Objects of a group, with their bare bounds.
    fn objects(&self, group: u32) -> Vec<(u32, [DVec3; 2])> {
        if group >= self.frame.node_count {
            let object = self.frame.static_count + group - self.frame.node_count;
            return vec![(object, self.bare(group))];
        }
        (group..self.nodes[group as usize].skip.to_native())
            .filter_map(|n| Some((self.nodes[n as usize].object()?, self.bare(n))))
            .collect()
    }

    /// A group of the pixel: a root, any node, the object that moves.
    fn group(&self, rng: &mut Rng, pixel: u32) -> u32 {
        let [root, end] = [self.roots[pixel as usize], self.roots[pixel as usize + 1]];
        match rng.bits() % 4 {
            0 if pixel % 8 == 7 => self.frame.node_count + pixel / 8,
            1 => root + (rng.bits() % u64::from(end - root)) as u32,
            _ => root,
        }
    }

    /// What the map holds: where the ray enters some object of the group, give or take what rounding and tolerance make
    /// of it; or anything.
    fn map_depth(&self, rng: &mut Rng, rays: &RayOracle<'_>, position: DVec2, group: u32) -> f32 {
        let objects = self.objects(group);
        let (_, bare) = objects[(rng.bits() % objects.len() as u64) as usize];
        let entry = rays
            .entry(position, bare)
            .filter(|_| !rng.bits().is_multiple_of(8));
        let Some(t) = entry else {
            let depth = rng.within(0.0, 1.0);
            return match rng.bits() % 4 {
                0 => self.depth.clear_value(),
                1 => (depth as f32).powi(8),
                _ => depth as f32,
            };
        };
        let depth = rays.depth_at(t);
        let tolerance = rays.tolerance(bare, t);
        let ulps = f64::from(DEPTH_TOLERANCE_RELATIVE) * depth;
        let off = match rng.bits() % 4 {
            0 => rng.within(-2.0, 2.0) * (tolerance + ulps),
            1 => rng.within(-1.0, 1.0) * ulps,
            2 => rng.within(-0.1, 0.1) * depth,
            _ => 0.0,
        };
        (depth + off).clamp(0.0, 1.0) as f32
    }
}

fn center(pixel: u32, [width, _]: [u32; 2]) -> DVec2 {
    DVec2::new(f64::from(pixel % width), f64::from(pixel / width)) + 0.5
}

#[derive(Debug, Default)]
struct Counts {
    fragments: usize,
    /// Objects in the groups of fragments.
    decisions: usize,
    showing: usize,
    hidden: usize,
    /// Of all bits that rounds left behind, those that differ between shader and twin.
    contested: usize,
    flagged: usize,
}

#[test]
fn fragments_flag_what_their_twin_flags_and_what_shows() {
    let Some(gpu) = gpu() else { return };
    let wgsl = hroc_shaders::resolve(PROBE).unwrap();
    let maps = DepthMaps::new(gpu);
    let mut counts = Counts::default();
    for seed in 0..FORESTS {
        let mut rng = Rng(seed);
        let depth = DepthConvention::ALL[seed as usize % 2];
        let size = SIZES[seed as usize % SIZES.len()];
        let reach = rng.magnitude(0.1, 1000.0);
        let camera = random_trees::camera(&mut rng, reach);
        let forest = Forest::new(&mut rng, &camera, depth, size);
        let prune = seed % 4 > 1;
        let constants = [
            depth.constants()[0],
            ("PRUNE", f64::from(u8::from(prune))),
            ("COUNT_WORK", 1.0),
        ];
        let kernel = Kernel::new(gpu, &wgsl, "probe", &constants);
        let at = format!("seed {seed} {depth:?} prune {prune}");
        check(
            gpu,
            &kernel,
            &maps,
            &forest,
            &mut rng,
            prune,
            &at,
            &mut counts,
        );
    }
    gpu.check().unwrap();
    eprintln!("{counts:?}");
    assert!(
        counts.fragments > 1_000_000 && counts.decisions > 10_000_000,
        "{counts:?}"
    );
    // All sides of every comparison are met, and rounding decides few.
    assert!(
        counts.showing * 20 > counts.decisions && counts.hidden * 20 > counts.decisions,
        "{counts:?}"
    );
    assert!(counts.contested * 1000 < counts.flagged, "{counts:?}");
}

#[expect(clippy::too_many_arguments)]
fn check(
    gpu: &Gpu,
    kernel: &Kernel,
    maps: &DepthMaps,
    forest: &Forest,
    rng: &mut Rng,
    prune: bool,
    at: &str,
    counts: &mut Counts,
) {
    let (frame, depth) = (&forest.frame, forest.depth);
    let reversed = depth == DepthConvention::Reversed;
    let rays = RayOracle::new(frame, depth, MARGIN);
    let tested = Tested {
        nodes: &forest.nodes,
        moving_bounds: &forest.moving,
    };
    let words = frame.object_count.div_ceil(32) as usize;
    let v = (0..words).map(|_| (rng.bits() & rng.bits() & rng.bits()) as u32);
    let v = v.collect::<Vec<_>>();
    let mut bounds = vec![ArchivedObjectBounds::zeroed(); frame.static_count as usize];
    bounds.extend(forest.moving.iter().map(random_trees::stored_bounds));
    let uniform = uniform(gpu, frame);
    let inputs = [
        (1, storage(gpu, &forest.nodes)),
        (3, storage(gpu, &v)),
        (7, storage(gpu, &forest.parents)),
        (9, storage(gpu, &bounds)),
    ];
    let u = storage(gpu, &vec![0u32; words]);
    let flagged_nodes = storage(gpu, &vec![0u32; forest.nodes.len().div_ceil(32)]);
    // What must be in U, what may be, what the twin puts there.
    let mut sets = std::array::from_fn::<_, 3, _>(|_| vec![0u32; words]);
    for round in 0..ROUNDS {
        if !prune || round % SHARED == 0 {
            sets.iter_mut().for_each(|set| set.fill(0));
            gpu.queue.write_buffer(&u, 0, &vec![0; 4 * words]);
            let nodes = flagged_nodes.size() as usize;
            gpu.queue.write_buffer(&flagged_nodes, 0, &vec![0; nodes]);
        }
        let groups = (0..PIXELS).map(|pixel| forest.group(rng, pixel));
        let groups = groups.collect::<Vec<_>>();
        let depths = groups
            .iter()
            .zip(0..)
            .map(|(&group, pixel)| forest.map_depth(rng, &rays, center(pixel, frame.size), group));
        let map = maps.draw(gpu, &depths.collect::<Vec<_>>(), frame.size);
        let group_buffer = storage(gpu, &groups);
        let work = storage(gpu, &[0u32; 4]);
        let grouping = storage(gpu, &[0u32; 4]);
        let mut bound = vec![
            (0, uniform.as_entire_binding()),
            (2, group_buffer.as_entire_binding()),
            (4, u.as_entire_binding()),
            (5, work.as_entire_binding()),
            (6, grouping.as_entire_binding()),
            (8, flagged_nodes.as_entire_binding()),
        ];
        bound.extend(inputs.iter().map(|(i, b)| (*i, b.as_entire_binding())));
        let view = map.create_view(&Default::default());
        let map_bound = [(0, wgpu::BindingResource::TextureView(&view))];
        kernel.run(gpu, &[&bound, &map_bound], [PIXELS.div_ceil(64), 1]);
        let [found, work, grouping] =
            [&u, &work, &grouping].map(|b| readback::words(&gpu.device, &gpu.queue, b));
        let there: Vec<f32> =
            bytemuck::pod_collect_to_vec(&readback::texture(&gpu.device, &gpu.queue, &map));

        let mut sampled = [0u32; 3];
        let [must, may, twin] = &mut sets;
        for (pixel, (&group, &there)) in (0..).zip(groups.iter().zip(&there)) {
            let position = center(pixel, frame.size);
            for (object, bare) in forest.objects(group) {
                counts.decisions += 1;
                match rays.standing(position, bare, f64::from(there)) {
                    Standing::Hidden => counts.hidden += 1,
                    Standing::Between => {
                        insert(may, object);
                    }
                    Standing::Showing => {
                        insert(may, object);
                        insert(must, object);
                        counts.showing += 1;
                    }
                }
            }
            let at_f32 = Vec2::new(position.x as f32, position.y as f32);
            tested.test_fragment(frame, reversed, group, at_f32, there, |object| {
                insert(twin, object);
            });
            // One pixel of each 16x16 tells how its group stands.
            let [x, y] = [pixel % frame.size[0], pixel / frame.size[0]];
            if x % 16 == 5 && y % 16 == 5 {
                let standing = rays.standing(position, forest.bare(group), f64::from(there));
                sampled[0] += 1;
                sampled[1] += u32::from(standing == Standing::Showing);
                sampled[2] += u32::from(standing != Standing::Hidden);
            }
        }
        counts.fragments += groups.len();
        assert_eq!(work[2], PIXELS, "{at} round {round}: fragments");
        assert_eq!(grouping[1], sampled[0], "{at} round {round}: sampled");
        assert!(
            (sampled[1]..=sampled[2]).contains(&grouping[2]),
            "{at} round {round}: {} survivors, {sampled:?}",
            grouping[2]
        );
        for (name, set) in [("shader", &found), ("twin", &*twin)] {
            for word in 0..words {
                let here = if name == "twin" {
                    set[word] & !v[word]
                } else {
                    set[word]
                };
                let left_out = must[word] & !v[word] & !here;
                let too_many = here & (!may[word] | v[word]);
                assert!(
                    left_out == 0 && too_many == 0,
                    "{at} round {round} word {word}: {name} leaves out {left_out:08x}, flags {too_many:08x} for nothing"
                );
            }
        }
        for object in 0..frame.object_count {
            let by_shader = contains(&found, object);
            let by_twin = contains(twin, object) && !contains(&v, object);
            counts.flagged += usize::from(by_shader);
            counts.contested += usize::from(by_shader != by_twin);
        }
    }
}
