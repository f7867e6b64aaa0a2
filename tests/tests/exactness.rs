//! Every method that claims to be exact gives the depth buffer of drawing everything, bit for bit, on every
//! generated scene, with every tree, in both depth conventions.

use hroc_runtime::{CullingMethod, DepthConvention, Hroc, HrocOptions, Noc, Submission};
use hroc_tests::host::{Difference, Host, World, difference};
use hroc_tests::{Gpu, gpu, scenes};

const SIZE: [u32; 2] = [160, 90];

fn methods(
    gpu: &Gpu,
    world: &World,
    depth: DepthConvention,
) -> Vec<(String, Box<dyn CullingMethod>)> {
    let mut methods: Vec<(String, Box<dyn CullingMethod>)> = Vec::new();
    for tree in &world.trees {
        for submission in [
            Submission::of(gpu.device.features()),
            Submission::ZeroedTail,
        ] {
            let options = HrocOptions {
                depth,
                submission: Some(submission),
                ..Default::default()
            };
            let hroc = Hroc::new(&gpu.device, &gpu.queue, &world.scene, tree, options);
            methods.push((
                format!("hroc {} {}", tree.split, submission.name()),
                Box::new(hroc),
            ));
        }
    }
    methods
}

#[test]
fn conservative_methods_give_the_depth_of_drawing_everything() {
    let Some(gpu) = gpu() else { return };
    let mut failures = Vec::new();
    for test in scenes::all() {
        let world = World::new(gpu, test.bake());
        for depth in DepthConvention::ALL {
            let host = Host::new(gpu, &world.scene, SIZE, depth);
            let mut noc = Noc::new(&gpu.device, &world.scene, depth);
            let truths = test
                .cameras
                .iter()
                .map(|camera| host.render(&mut noc, camera))
                .collect::<Vec<_>>();
            for (name, mut method) in methods(gpu, &world, depth) {
                for (number, (camera, truth)) in test.cameras.iter().zip(&truths).enumerate() {
                    let frame = host.render(method.as_mut(), camera);
                    let found = difference(truth, &frame);
                    if found.wrong_pixels + found.false_negatives > 0 {
                        failures.push(format!(
                            "{} {depth:?} frame {number}, {name}: {found:?}",
                            test.name
                        ));
                    }
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

/// The test above must be able to fail: a method that drops one visible object is caught.
#[test]
fn a_dropped_object_is_caught() {
    let Some(gpu) = gpu() else { return };
    let test = scenes::all()
        .into_iter()
        .find(|test| test.name == "rooms")
        .unwrap();
    let world = World::new(gpu, test.bake());
    let host = Host::new(gpu, &world.scene, SIZE, DepthConvention::Reversed);
    let mut noc = Noc::new(&gpu.device, &world.scene, DepthConvention::Reversed);
    let truth = host.render(&mut noc, &test.cameras[0]);
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
    let test = scenes::all()
        .into_iter()
        .find(|test| test.name == "rooms")
        .unwrap();
    let world = World::new(gpu, test.bake());
    let host = Host::new(gpu, &world.scene, SIZE, DepthConvention::Reversed);
    let mut noc = Noc::new(&gpu.device, &world.scene, DepthConvention::Reversed);
    for tree in &world.trees {
        let mut hroc = Hroc::new(
            &gpu.device,
            &gpu.queue,
            &world.scene,
            tree,
            HrocOptions::default(),
        );
        for camera in &test.cameras[..8] {
            let visible = host.render(&mut noc, camera).visible().len();
            let pvs = host.render(&mut hroc, camera).pvs().len();
            eprintln!(
                "{}: {visible} visible, {pvs} drawn of {}",
                tree.split, world.scene.shape.object_count
            );
        }
        // Standing still: V is what was visible, and little more passes the test.
        let camera = &test.cameras[7];
        let visible = host.render(&mut noc, camera).visible().len();
        let pvs = host.render(&mut hroc, camera).pvs().len();
        assert!(
            pvs <= visible + world.scene.shape.object_count as usize / 10,
            "{}: {visible} visible, {pvs} drawn",
            tree.split
        );
    }
}
