//! The real passes against their twins, on the frames of the hard cases.

use glam::Vec2;
use hroc_runtime::twin::batch_occlusion_test::Tested;
use hroc_runtime::twin::extract_groups::{TreeView, extract_groups};
use hroc_runtime::twin::filter_occluders::filter_occluders;
use hroc_runtime::twin::{contains, insert};
use hroc_runtime::{DepthConvention, FrameUniform, Hroc, HrocOptions, readback};
use hroc_study::hard_cases::{CASES, Scale};
use hroc_tests::gpu;
use hroc_tests::host::{Host, World};

const SIZE: [u32; 2] = [96, 54];
/// Frames of a case: the twin walks the tree at every pixel.
const FRAMES: usize = 4;

fn words(ids: &[u32], count: u32) -> Vec<u32> {
    let mut words = vec![0; count.div_ceil(32) as usize];
    for &id in ids {
        insert(&mut words, id);
    }
    words
}

/// U is what the twins find: leaves that touch the near plane, and what the ray of each pixel finds in each group. O
/// and the next V are what the twin finds in the item buffer.
#[test]
fn frames_agree_with_the_twins() {
    let Some(gpu) = gpu() else { return };
    let (mut compared, mut contested) = (0, 0);
    for (case, i) in CASES.iter().zip(0usize..) {
        let scene = (case.make)(Scale::Small);
        let depth = DepthConvention::ALL[i % 2];
        let mut world = World::of_case(gpu, &scene);
        let count = world.scene.shape.object_count;
        if count == 0 {
            continue;
        }
        let tree = world.trees[i % 3].clone();
        let options = HrocOptions {
            depth,
            ..Default::default()
        };
        let mut host = Host::new(gpu, &world, SIZE, depth);
        let mut hroc = Hroc::new(&gpu.device, &world.scene, &tree, options);
        let mut last_shown: Option<Vec<u32>> = None;
        let step = scene.frames.len().div_ceil(FRAMES);
        for (number, shown) in scene.frames.iter().enumerate().step_by(step) {
            let at = format!("{} {} {depth:?} frame {number}", case.name, tree.split);
            world.advance(gpu, number);
            host.follow(&world);
            let frame = host.render_frame(&mut hroc, shown);
            let size = shown.size.unwrap_or(SIZE);
            let uniform =
                FrameUniform::new(&shown.camera, depth, size, &world.scene.shape).unwrap();
            let set = |buffer| words(&readback::set(&gpu.device, &gpu.queue, buffer), count);
            let (opaque, blended) = (set(&world.scene.opaque), set(&world.scene.blended));
            if let Some(shown) = last_shown {
                let next = (0..count).filter(|&id| contains(&shown, id) && contains(&opaque, id));
                assert_eq!(
                    frame.potential_occluders,
                    next.collect::<Vec<_>>(),
                    "{at}: V is what filter_occluders leaves of the last item buffer"
                );
            }
            last_shown = Some(filter_occluders(&frame.item, count));

            let archived = world.baked.scene();
            let bvh = archived.bvh(&tree.split).unwrap();
            let moving_bounds = world.moving_bounds(gpu);
            let occluders = words(&frame.potential_occluders, count);
            let view = TreeView {
                nodes: bvh.nodes.as_slice(),
                parents: bvh.parents(),
                leaf_of_object: bvh.leaf_of_object(),
            };
            let extracted = extract_groups(
                &uniform,
                view,
                &moving_bounds,
                &occluders,
                &words(&frame.effective_occluders, count),
                frame.largest_group_px,
            );
            let mut found = extracted.untested;
            let tested = Tested {
                nodes: view.nodes,
                moving_bounds: &moving_bounds,
            };
            let reversed = depth == DepthConvention::Reversed;
            for (&map, pixel) in frame.occlusion_map.iter().zip(0u32..) {
                let position = Vec2::new((pixel % size[0]) as f32, (pixel / size[0]) as f32) + 0.5;
                for &group in &frame.groups {
                    tested.test_fragment(&uniform, reversed, group, position, map, |object| {
                        insert(&mut found, object);
                    });
                }
            }
            let in_u = [&frame.potentially_visible[..], &frame.blended]
                .concat()
                .into_iter()
                .collect::<std::collections::HashSet<_>>();
            for id in 0..count {
                let here = contains(&found, id) && !contains(&occluders, id);
                let wanted = contains(&opaque, id) || contains(&blended, id);
                compared += 1;
                if wanted && here != in_u.contains(&id) {
                    contested += 1;
                    eprintln!("{at}: object {id}: twin {here}, shader {}", !here);
                }
            }
        }
    }
    eprintln!("{compared} objects, {contested} decided differently");
    assert!(
        contested * 1000 < compared,
        "{contested} of {compared} objects are decided differently by shader and twin"
    );
}
