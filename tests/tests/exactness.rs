//! Every method that claims to be exact gives the depth buffer of drawing everything, bit for bit, on every
//! hard case, in both depth conventions.

use glam::{DVec3, DVec4};
use hroc_runtime::{Camera, DepthConvention, Hroc, HrocOptions, Noc, Projection};
use hroc_study::hard_cases::builder::{Builder, looking};
use hroc_study::hard_cases::{CASES, CaseFrame, CaseScene, Scale, case};
use hroc_tests::host::{Difference, Host, World, difference};
use hroc_tests::no_culling::{NoCulling, Sums};
use hroc_tests::variants::{each_exact_method, exact_methods};
use hroc_tests::{gpu, own_gpu};

const SIZE: [u32; 2] = Scale::Small.size();

/// Every exact method over every case.
fn assert_exact(depth: DepthConvention) {
    let Some(gpu) = own_gpu() else { return };
    let mut failures = Vec::new();
    // The two conventions do not have the same trees in turn.
    let first = usize::from(depth == DepthConvention::Reversed);
    for (turn, case) in (first..).zip(CASES) {
        let scene = (case.make)(Scale::Small);
        let mut world = World::of_case(&gpu, &scene);
        let mut host = Host::new(&gpu, &world, SIZE, depth);
        let mut noc = Noc::new(&gpu.device, &world.scene, depth);
        let mut views = (0..scene.view_count())
            .map(|_| exact_methods(&gpu, &world, depth, turn))
            .collect::<Vec<_>>();
        for (number, frame) in scene.frames.iter().enumerate() {
            world.advance(&gpu, number);
            host.follow(&world);
            let truth = host.render_frame(&mut noc, frame);
            for (name, method) in &mut views[frame.view] {
                let found = difference(&truth, &host.render_frame(method.as_mut(), frame));
                if found.wrong_pixels + found.false_negatives > 0 {
                    failures.push(format!("{} frame {number}, {name}: {found:?}", case.name));
                }
            }
        }
    }
    assert!(
        failures.is_empty(),
        "{} wrong frames:\n{}",
        failures.len(),
        failures.join("\n")
    );
}

#[test]
fn conservative_methods_give_the_depth_of_drawing_everything() {
    assert_exact(DepthConvention::Standard);
}

#[test]
fn conservative_methods_give_the_reversed_depth_of_drawing_everything() {
    assert_exact(DepthConvention::Reversed);
}

/// The tests above must be able to fail: a method that drops one visible object is caught.
#[test]
fn a_dropped_object_is_caught() {
    let Some(gpu) = gpu() else { return };
    let rooms = (case("rooms").unwrap().make)(Scale::Small);
    let world = World::of_case(gpu, &rooms);
    let host = Host::new(gpu, &world, SIZE, DepthConvention::Reversed);
    let mut noc = Noc::new(&gpu.device, &world.scene, DepthConvention::Reversed);
    let truth = host.render(&mut noc, &rooms.frames[0].camera);
    let mut frame = truth.clone();
    assert_eq!(difference(&truth, &frame), Difference::default());
    let lost = truth.visible()[0];
    frame.potential_occluders.retain(|id| *id != lost);
    for i in 0..frame.item.len() {
        if frame.item[i] == lost {
            frame.depth[i] = 0.0;
        }
    }
    let found = difference(&truth, &frame);
    assert!(
        found.false_negatives == 1 && found.wrong_pixels > 0,
        "{found:?}"
    );
}

#[test]
fn little_is_drawn_where_much_is_hidden() {
    let Some(gpu) = gpu() else { return };
    let rooms = (case("rooms").unwrap().make)(Scale::Small);
    let world = World::of_case(gpu, &rooms);
    let host = Host::new(gpu, &world, SIZE, DepthConvention::Reversed);
    let mut noc = Noc::new(&gpu.device, &world.scene, DepthConvention::Reversed);
    for tree in &world.trees {
        let mut hroc = Hroc::new(&gpu.device, &world.scene, tree, HrocOptions::default());
        for CaseFrame { camera, .. } in &rooms.frames[..6] {
            let visible = host.render(&mut noc, camera).visible().len();
            let pvs = host.render(&mut hroc, camera).pvs().len();
            eprintln!(
                "{}: {visible} visible, {pvs} drawn of {}",
                tree.split, world.scene.shape.object_count
            );
        }
        // Standing still: V is what was visible, and little more passes the test.
        let camera = &rooms.frames[5].camera;
        let visible = host.render(&mut noc, camera).visible().len();
        let pvs = host.render(&mut hroc, camera).pvs().len();
        assert!(
            pvs <= visible + world.scene.shape.object_count as usize / 10,
            "{}: {visible} visible, {pvs} drawn",
            tree.split
        );
    }
}

/// A wall 60 m away and boxes whose front is `gap` behind its front; `near` plane as close as for a human eye in a room.
fn behind_a_far_wall(gap: f64) -> CaseScene {
    let mut b = Builder::of_boxes();
    b.span([-40.0, -30.0, -60.1], [40.0, 30.0, -60.0]);
    for i in 0..100 {
        let at = DVec3::new(f64::from(i % 10), f64::from(i / 10), 0.0) * 2.5 - DVec3::splat(11.0);
        b.span(
            [at.x, at.y, -62.0 - gap],
            [at.x + 1.0, at.y + 1.0, -60.0 - gap],
        );
    }
    // Little moves from frame to frame, so that what shows is drawn first.
    let frames = (0..4).map(|i| {
        let eye = DVec3::new(1e-3 * f64::from(i), 0.0, 0.0);
        Camera {
            near: 0.0048,
            ..looking(eye, eye - DVec3::Z)
        }
    });
    CaseScene {
        source: b.build(),
        frames: frames.map(CaseFrame::from).collect(),
        motion: None,
    }
}

/// Objects that each exact method draws of a scene in its last frame, and those that show.
fn drawn_at_last(scene: &CaseScene, depth: DepthConvention) -> (usize, Vec<(String, usize)>) {
    let gpu = gpu().unwrap();
    let world = World::of_case(gpu, scene);
    let mut host = Host::new(gpu, &world, [320, 180], depth);
    let mut noc = Noc::new(&gpu.device, &world.scene, depth);
    let mut methods = each_exact_method(gpu, &world, depth);
    let (mut visible, mut drawn) = (0, Vec::new());
    for frame in &scene.frames {
        let truth = host.render_frame(&mut noc, frame);
        visible = truth.visible().len();
        drawn.clear();
        for (name, method) in &mut methods {
            let image = host.render_frame(method.as_mut(), frame);
            let found = difference(&truth, &image);
            assert_eq!(found.wrong_pixels + found.false_negatives, 0, "{name}");
            drawn.push((name.clone(), image.pvs().len()));
        }
    }
    (visible, drawn)
}

/// No test looks through a wall: what is 20 cm behind one that is 60 m away is hidden with reversed depth. It takes a
/// tolerance that goes by the depth of the object; one of a few ulps of the near plane's would be a third of a metre.
#[test]
fn objects_close_behind_a_far_wall_are_culled() {
    if gpu().is_none() {
        return;
    }
    let hidden = behind_a_far_wall(0.2);
    let (visible, drawn) = drawn_at_last(&hidden, DepthConvention::Reversed);
    assert_eq!(visible, 1, "the wall alone");
    eprintln!("of 101 are drawn, 0.2 m behind the wall, reversed depth: {drawn:?}");
    for (name, count) in drawn {
        assert!(
            ["noc", "vfc"].iter().any(|all| name.starts_with(all)) || count == 1,
            "{name} draws {count}"
        );
    }
    // f32 cannot tell at that distance with standard depth, so all may show.
    let (_, drawn) = drawn_at_last(&hidden, DepthConvention::Standard);
    eprintln!("standard depth: {drawn:?}");
    // In front of the wall all show, by a hand's breadth or by a hair.
    for gap in [-0.1, -0.002] {
        let (visible, _) = drawn_at_last(&behind_a_far_wall(gap), DepthConvention::Reversed);
        assert_eq!(visible, 101);
    }
}

/// `hroc_keeps` may drop only what no sample of the object can be: fragments in front of the object's own bounds,
/// by a computation in f64 that knows nothing of the shader's padding. Nor does it judge any fragment wrongly by the
/// f64 oracle, which goes by that padding.
#[test]
fn only_stray_fragments_are_dropped() {
    let Some(gpu) = gpu() else { return };
    let (mut pixels, mut strays) = (0, 0);
    let mut sums = Sums::default();
    for case in CASES {
        let before = strays;
        let scene = (case.make)(Scale::Small);
        for depth in DepthConvention::ALL {
            let mut world = World::of_case(gpu, &scene);
            let mut no_culling = NoCulling::new(gpu, &world, SIZE, depth);
            for (number, frame) in scene.frames.iter().enumerate() {
                let size = frame.size.unwrap_or(SIZE);
                world.advance(gpu, number);
                let moving_bounds = world.moving_bounds(gpu);
                let (judgement, kept, all) = no_culling.judge(&world, frame);
                assert_eq!(
                    judgement.first_fault, None,
                    "{} {depth:?} frame {number}: {judgement:?}",
                    case.name
                );
                sums.add(judgement);
                pixels += kept.depth.len();
                for (i, (a, b)) in kept.depth.iter().zip(&all.depth).enumerate() {
                    if a.to_bits() != b.to_bits() {
                        strays += 1;
                        let pixel = [i as u32 % size[0], i as u32 / size[0]];
                        let id = all.item[i] as usize;
                        let baked = &world.baked.scene().object_bounds;
                        let bounds = baked
                            .get(id)
                            .map_or_else(|| moving_bounds[id - baked.len()], |b| b.to_native());
                        let near = nearest_depth(
                            &world.scene.shape,
                            &frame.camera,
                            depth,
                            size,
                            pixel,
                            &bounds,
                        );
                        let outside = match depth {
                            DepthConvention::Standard => f64::from(*b) < near,
                            DepthConvention::Reversed => f64::from(*b) > near,
                        };
                        assert!(
                            outside,
                            "{} {depth:?} frame {number} pixel {pixel:?}: depth {b} was dropped, bounds begin at {near}",
                            case.name
                        );
                    }
                }
            }
        }
        if strays > before {
            eprintln!("{}: {} stray fragments", case.name, strays - before);
        }
    }
    eprintln!("{strays} stray fragments in {pixels} pixels; {sums:?}");
    // Mesa leaves none in these scenes, SwiftShader one in 5,000: it extrapolates the depth of slivers.
    assert!(
        strays * 2_500 < pixels,
        "{strays} of {pixels} pixels showed stray fragments"
    );
}

/// The depth at which an object's bounds, grown by a subpixel step of the device and by f32's resolution at its distance,
/// begin along a pixel's ray; infinitely far where they are missed.
fn nearest_depth(
    shape: &hroc_runtime::SceneShape,
    camera: &Camera,
    depth: DepthConvention,
    size: [u32; 2],
    pixel: [u32; 2],
    bounds: &hroc_format::ObjectBounds,
) -> f64 {
    let clip = camera
        .clip_from_world(depth, size, shape.origin, shape.radius)
        .unwrap();
    let world = clip.inverse();
    let ndc = |x: f64, side: u32| 2.0 * x / f64::from(side) - 1.0;
    let at = |z: f64| {
        let p = DVec4::new(
            ndc(f64::from(pixel[0]) + 0.5, size[0]),
            -ndc(f64::from(pixel[1]) + 0.5, size[1]),
            z,
            1.0,
        );
        let q = world * p;
        q.truncate() / q.w
    };
    // Two points of the ray, whatever the projection.
    let (a, b) = (at(0.9), at(0.3));
    let direction = (b - a)
        * if depth == DepthConvention::Reversed {
            1.0
        } else {
            -1.0
        };
    let eye = camera.position - shape.origin;
    let zero = shape.cells[bounds.cell as usize] - shape.origin;
    let corner = |corner: [f64; 3]| DVec3::from_array(corner) + zero;
    let lo = corner(bounds.min.map(f64::from));
    let hi = corner(bounds.max.map(f64::from));
    let reach = (lo - eye).abs().max((hi - eye).abs()).length();
    let pixel_size = match camera.projection {
        Projection::Perspective { fov_y_rad } => {
            2.0 * (0.5 * fov_y_rad).tan() * reach / f64::from(size[1])
        }
        Projection::Orthographic { half_height } => 2.0 * half_height / f64::from(size[1]),
    };
    let step_px = shape.subpixel_step_px;
    let grow = pixel_size * step_px + 1e-6 * reach;
    let (lo, hi) = (lo - grow, hi + grow);
    let (mut first, mut last) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let (x, y) = (
            (lo[axis] - a[axis]) / direction[axis],
            (hi[axis] - a[axis]) / direction[axis],
        );
        if x.is_finite() && y.is_finite() {
            first = first.max(x.min(y));
            last = last.min(x.max(y));
        }
    }
    let farthest = f64::from(depth.clear_value());
    // What lies in front of the near plane does not show.
    let on_near_plane = (at(1.0 - farthest) - a).dot(direction) / direction.length_squared();
    let first = first.max(on_near_plane);
    if first > last {
        return farthest;
    }
    let p = clip * (a + first * direction).extend(1.0);
    p.z / p.w
}
