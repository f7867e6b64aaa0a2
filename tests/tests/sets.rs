//! The sets of every frame are what they claim to be: visible objects lie in V or U, O is what shows of V in
//! the occlusion map, U is what an f64 oracle finds in front of that map, and the next V is what shows.

use hroc_runtime::twin::extract_groups::{TreeView, extract_groups};
use hroc_runtime::{
    CullingMethod, DepthConvention, FrameUniform, Grouping, Hroc, HrocMode, HrocOptions, readback,
};
use hroc_study::hard_cases::{CASES, Scale};
use hroc_tests::gpu;
use hroc_tests::host::{Frame, Host, World};
use hroc_tests::oracle::{Standing, standings};

const SIZE: [u32; 2] = [96, 54];

fn words(ids: &[u32], count: u32) -> Vec<u32> {
    let mut words = vec![0; count.div_ceil(32) as usize];
    for id in ids {
        words[(id / 32) as usize] |= 1 << (id % 32);
    }
    words
}

#[test]
fn the_sets_of_every_frame_hold() {
    let Some(gpu) = gpu() else { return };
    let mut borderline = 0;
    let mut decided = 0;
    for case in CASES {
        let scene = (case.make)(Scale::Small);
        for (i, depth) in (0..3).zip(DepthConvention::ALL.into_iter().cycle()) {
            let mut world = World::of_case(gpu, &scene);
            let count = world.scene.shape.object_count;
            if count == 0 {
                continue;
            }
            let tree = world.trees[i].clone();
            let mut host = Host::new(gpu, &world, SIZE, depth);
            // The middle tree without pruning.
            let prune = i != 1;
            let options = HrocOptions {
                depth,
                prune,
                count_work: true,
                grouping: Grouping::Adaptive { box_cost: 64.0 },
                ..Default::default()
            };
            let make = || Hroc::new(&gpu.device, &world.scene, &tree, options);
            // A method and what it saw last for each view.
            let mut views = (0..scene.view_count())
                .map(|_| (make(), Vec::new()))
                .collect::<Vec<_>>();
            for (number, shown) in scene.frames.iter().enumerate() {
                let at = format!("{} {} {depth:?} frame {number}", case.name, tree.split);
                let (hroc, last_visible) = &mut views[shown.view];
                world.advance(gpu, number);
                host.follow(&world);
                let frame = host.render_frame(hroc, shown);
                let visible = frame.visible();
                let pvs = frame.pvs();
                let opaque = readback::set(&gpu.device, &gpu.queue, &world.scene.opaque);
                let blended = readback::set(&gpu.device, &gpu.queue, &world.scene.blended);
                last_visible.retain(|id| opaque.binary_search(id).is_ok());
                assert_eq!(
                    frame.potential_occluders, *last_visible,
                    "{at}: V is what showed in the last frame and is still there"
                );
                let archived = world.baked.scene();
                let bvh = archived.bvh(&tree.split).unwrap();
                let view = TreeView {
                    nodes: bvh.nodes.as_slice(),
                    parents: bvh.parents(),
                    leaf_of_object: bvh.leaf_of_object(),
                };
                assert!(
                    visible.iter().all(|id| pvs.binary_search(id).is_ok()),
                    "{at}: a visible object was not drawn"
                );
                assert!(
                    frame
                        .effective_occluders
                        .iter()
                        .all(|id| frame.potential_occluders.binary_search(id).is_ok()),
                    "{at}: O within V"
                );
                assert!(
                    frame
                        .potentially_visible
                        .iter()
                        .all(|id| frame.potential_occluders.binary_search(id).is_err()),
                    "{at}: U apart from V"
                );

                let uniform = FrameUniform::new(
                    &shown.camera,
                    depth,
                    shown.size.unwrap_or(SIZE),
                    &world.scene.shape,
                )
                .unwrap();
                let twin = extract_groups(
                    &uniform,
                    view,
                    &world.moving_bounds(gpu),
                    &words(&frame.potential_occluders, count),
                    &words(&frame.effective_occluders, count),
                    frame.largest_group_px,
                );
                assert_eq!(frame.groups, twin.groups, "{at}: groups");
                assert!(
                    frame.work[0] <= frame.work[2] && (prune || frame.work[0] <= frame.work[1]),
                    "{at}: rays <= fragments, rays <= tests unless pruned: {:?}",
                    frame.work
                );

                for (id, standing) in
                    (0u32..).zip(standings(archived, &uniform, depth, &frame.occlusion_map))
                {
                    let is_blended = blended.binary_search(&id).is_ok();
                    if !is_blended && opaque.binary_search(&id).is_err() {
                        continue;
                    }
                    let list = if is_blended {
                        &frame.blended
                    } else {
                        &frame.potentially_visible
                    };
                    let in_u = list.binary_search(&id).is_ok();
                    let in_v = frame.potential_occluders.binary_search(&id).is_ok();
                    match standing {
                        Standing::Hidden => {
                            assert!(!in_u, "{at}: object {id} is hidden but was taken into U")
                        }
                        Standing::Showing => {
                            assert!(in_u || in_v, "{at}: object {id} shows but was left out")
                        }
                        Standing::Between => borderline += 1,
                    }
                    decided += usize::from(standing != Standing::Between);
                }
                *last_visible = visible;
            }
        }
    }
    eprintln!("{decided} objects decided by the oracle, {borderline} within padding and rounding");
    assert!(
        decided > 4 * borderline,
        "the oracle leaves too much open: {decided} decided, {borderline} not"
    );
}

/// A still camera: the image is the same from the first frame on, the sets reach a fixed point and stay, in every
/// exact mode.
#[test]
fn a_still_camera_settles() {
    let Some(gpu) = gpu() else { return };
    for case in CASES {
        let scene = (case.make)(Scale::Small);
        let world = World::of_case(gpu, &scene);
        let mut host = Host::new(gpu, &world, SIZE, DepthConvention::Reversed);
        let still = &scene.frames[scene.frames.len() / 2];
        for mode in HrocMode::ALL.into_iter().filter(|mode| mode.is_exact()) {
            let options = HrocOptions {
                mode,
                grouping: Grouping::Adaptive { box_cost: 64.0 },
                ..Default::default()
            };
            let mut hroc = Hroc::new(&gpu.device, &world.scene, &world.trees[0], options);
            // Adaptive grouping moves its threshold by a square root a frame until it rests.
            let frames = (0..24)
                .map(|_| host.render_frame(&mut hroc, still))
                .collect::<Vec<_>>();
            let last = &frames[23];
            for (number, frame) in frames.iter().enumerate() {
                let at = format!("{} {} frame {number}", case.name, mode.name());
                assert!(frame.depth == last.depth, "{at}: the depth changed later");
                // Elsewhere what is drawn first, or last, changes at first, and with it the order of equal depths.
                assert!(
                    !matches!(mode, HrocMode::Of | HrocMode::CrOf) || frame.item == last.item,
                    "{at}: the image changed later"
                );
                if number > 15 {
                    let sets = |frame: &Frame| {
                        (
                            frame.potential_occluders.clone(),
                            frame.effective_occluders.clone(),
                            frame.groups.clone(),
                            frame.potentially_visible.clone(),
                            frame.largest_group_px.to_bits(),
                        )
                    };
                    assert!(sets(frame) == sets(last), "{at}: the sets still change");
                    assert!(frame.item == last.item, "{at}: the image still changes");
                }
            }
        }
    }
}

/// Before the first object is inserted, no place for one makes a group.
#[test]
fn places_without_objects_are_in_no_group() {
    let Some(gpu) = gpu() else { return };
    let mut places = 0;
    for case in CASES {
        let scene = (case.make)(Scale::Small);
        let world = World::of_case(gpu, &scene);
        let shape = world.scene.shape.clone();
        for (bounds, place) in world.moving_bounds(gpu).iter().zip(0..) {
            let inside_out = (0..3).all(|axis| bounds.min[axis] > bounds.max[axis]);
            assert!(inside_out, "{} place {place}: {bounds:?}", case.name);
            places += 1;
        }
        if shape.moving_capacity() == 0 {
            continue;
        }
        let mut host = Host::new(gpu, &world, SIZE, DepthConvention::Reversed);
        let options = HrocOptions::default();
        let mut hroc = Hroc::new(&gpu.device, &world.scene, &world.trees[0], options);
        for (number, shown) in scene.frames.iter().enumerate() {
            let groups = host.render_frame(&mut hroc, shown).groups;
            assert!(
                groups.iter().all(|group| *group < shape.node_count()),
                "{} frame {number}: {groups:?}",
                case.name
            );
        }
    }
    assert!(places > 0, "no case has objects that move");
}

/// After a cut V is empty and U holds what V held: no count of before says how much that is, arrived or under way.
#[test]
fn a_reset_forgets_late_counts() {
    let Some(gpu) = gpu() else { return };
    let mut limited = 0;
    for case in CASES {
        let scene = (case.make)(Scale::Small);
        let world = World::of_case(gpu, &scene);
        let capacity = world.scene.shape.object_count;
        let mut host = Host::new(gpu, &world, SIZE, DepthConvention::Reversed);
        let still = &scene.frames[0];
        let options = HrocOptions {
            mode: HrocMode::CrLate,
            ..Default::default()
        };
        let mut hroc = Hroc::new(&gpu.device, &world.scene, &world.trees[0], options);
        // Nothing is counted before the first frame: no limit drops anything.
        let first = host.render_frame(&mut hroc, still);
        let last = (0..3)
            .map(|_| host.render_frame(&mut hroc, still))
            .last()
            .unwrap();
        if last.draw_limits.is_none_or(|[_, u]| u == capacity) {
            continue;
        }
        limited += 1;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        hroc.reset(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        let after = host.render_frame(&mut hroc, still);
        assert_eq!(after.draw_limits, Some([capacity; 2]), "{}", case.name);
        assert!(after.potential_occluders.is_empty(), "{}", case.name);
        assert!(after.depth == first.depth, "{}", case.name);
    }
    assert!(
        limited > 0,
        "no case has more objects than a limit lets pass"
    );
}
