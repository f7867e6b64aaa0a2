//! Shader against CPU twin against f64, on random and adversarial input.

use glam::{DVec3, Vec2};
use hroc_format::{ArchivedMesh, ArchivedObject};
use hroc_runtime::twin::{bounds, pack};
use hroc_runtime::{DepthConvention, FrameUniform, SceneShape, readback};
use hroc_study::hard_cases::builder::{Rng, turning};
use hroc_study::hard_cases::{Scale, case};
use hroc_tests::compute::{Kernel, buffer};
use hroc_tests::{Gpu, gpu};

/// Evaluates the functions of common/bounds.wgsl on arrays.
const PROBE: &str = "//!import common/bounds
struct Case { min: vec3f, x: f32, max: vec3f, y: f32, depth: f32, a: f32, b: f32, c: f32 }
struct Found { min: vec3f, entry: f32, max: vec3f, bits: u32 }
@group(0) @binding(1) var<storage, read> cases: array<Case>;
@group(0) @binding(2) var<storage, read_write> found: array<Found>;
@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= arrayLength(&cases)) { return; }
    let c = cases[id.x];
    let box = padded(Box(c.min, c.max));
    let t = entry(pixel_ray(vec2f(c.x, c.y)), box, frame.near);
    let shows = t >= 0.0 && may_show(box, t, c.depth);
    let bits = select(0u, 1u, in_frustum(box)) | select(0u, 2u, touches_near(box)) | select(0u, 4u, shows)
        | select(0u, 8u, is_kept(Box(c.min, c.max), vec4f(c.x, c.y, c.depth, 1.0)));
    found[id.x] = Found(box.min, t, box.max, bits);
}";

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Case {
    min: [f32; 3],
    x: f32,
    max: [f32; 3],
    y: f32,
    depth: f32,
    unused: [f32; 3],
}

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Found {
    min: [f32; 3],
    entry: f32,
    max: [f32; 3],
    bits: u32,
}

fn run(
    gpu: &Gpu,
    wgsl: &str,
    entry: &str,
    constants: &[(&str, f64)],
    buffers: &[(u32, &wgpu::Buffer)],
    workgroups: u32,
) {
    Kernel::new(gpu, wgsl, entry, constants).run_on(gpu, buffers, workgroups);
}

/// Boxes around the eye, flat and edge-on ones, ones the pixel's ray just touches.
fn cases(rng: &mut Rng, frame: &FrameUniform, count: usize) -> Vec<Case> {
    (0..count)
        .map(|i| {
            let [width, height] = frame.size.map(f64::from);
            let (x, y) = (
                rng.within(0.0, width).floor() + 0.5,
                rng.within(0.0, height).floor() + 0.5,
            );
            let scale = 10f64.powf(rng.within(-3.0, 1.0));
            let mut half = rng.point(scale).abs();
            if i % 3 == 0 {
                half[i / 3 % 3] = 0.0;
            }
            // Half of the boxes are put so that the ray passes exactly through a corner or a face.
            let at = |origin: [f32; 3], dx: [f32; 3], dy: [f32; 3]| {
                let v = |a: [f32; 3]| DVec3::from_array(a.map(f64::from));
                v(origin) + x * v(dx) + y * v(dy)
            };
            let eye = at(frame.ray_origin, frame.ray_origin_dx, frame.ray_origin_dy);
            let direction = at(
                frame.ray_direction,
                frame.ray_direction_dx,
                frame.ray_direction_dy,
            );
            let on_ray = eye + direction * 10f64.powf(rng.within(-1.5, 1.5));
            let center = match i % 4 {
                0 => on_ray + half,
                1 => on_ray + half * DVec3::new(1.0, -1.0, 0.3),
                2 => on_ray,
                _ => eye + rng.point(10.0 * scale),
            };
            Case {
                min: (center - half).as_vec3().to_array(),
                x: x as f32,
                max: (center + half)
                    .as_vec3()
                    .max((center - half).as_vec3())
                    .to_array(),
                y: y as f32,
                depth: rng.within(0.0, 1.0).powi(if i % 2 == 0 { 1 } else { 6 }) as f32,
                unused: [0.0; 3],
            }
        })
        .collect()
}

#[test]
fn bounds_agree_with_their_twin_and_never_miss() {
    let Some(gpu) = gpu() else { return };
    let wgsl = hroc_shaders::resolve(PROBE).unwrap();
    let shape = SceneShape {
        origin: DVec3::ZERO,
        cells: [DVec3::ZERO].into(),
        radius: 40.0,
        reach: 70.0,
        object_count: 1,
        static_count: 1,
        subpixel_step_px: 1.0 / 16.0,
    };
    let mut rng = Rng(11);
    let (mut compared, mut contested) = (0usize, 0usize);
    let projections = (case("projections").unwrap().make)(Scale::Small);
    let cameras = projections.frames.iter().map(|frame| frame.camera);
    for camera in &cameras.chain(turning(DVec3::ONE, 4)).collect::<Vec<_>>() {
        for depth in DepthConvention::ALL {
            let reversed = depth == DepthConvention::Reversed;
            let frame = FrameUniform::new(camera, depth, [64, 48], &shape).unwrap();
            let cases = cases(&mut rng, &frame, 50_000);
            let uniform = buffer(gpu, bytemuck::bytes_of(&frame), wgpu::BufferUsages::UNIFORM);
            let input = buffer(
                gpu,
                bytemuck::cast_slice(&cases),
                wgpu::BufferUsages::STORAGE,
            );
            let output = buffer(gpu, &vec![0; cases.len() * 32], wgpu::BufferUsages::STORAGE);
            let constants = [("REVERSED_DEPTH", f64::from(u8::from(reversed)))];
            run(
                gpu,
                &wgsl,
                "probe",
                &constants,
                &[(0, &uniform), (1, &input), (2, &output)],
                cases.len().div_ceil(64) as u32,
            );
            let found: Vec<Found> =
                bytemuck::pod_collect_to_vec(&readback::buffer(&gpu.device, &gpu.queue, &output));
            for (case, found) in cases.iter().zip(&found) {
                let bare = bounds::Box3 {
                    min: case.min.into(),
                    max: case.max.into(),
                };
                let b = bounds::padded(&frame, bare);
                let t = bounds::entry(
                    bounds::pixel_ray(&frame, Vec2::new(case.x, case.y)),
                    b,
                    frame.near,
                );
                let bits = u32::from(bounds::in_frustum(&frame, b))
                    | u32::from(bounds::touches_near(&frame, b)) << 1
                    | u32::from(t >= 0.0 && bounds::may_show(&frame, reversed, b, t, case.depth))
                        << 2
                    | u32::from(bounds::is_kept(
                        &frame,
                        reversed,
                        bare,
                        Vec2::new(case.x, case.y),
                        case.depth,
                    )) << 3;
                for bits in [bits, found.bits] {
                    assert!(bits & 12 != 8, "what a host keeps is found");
                }
                compared += 1;
                contested += usize::from(bits != found.bits || (t < 0.0) != (found.entry < 0.0));
                for axis in 0..3 {
                    // Both contain the bounds they pad.
                    assert!(found.min[axis] <= case.min[axis] && found.max[axis] >= case.max[axis]);
                }
                // In f64: a ray that meets the bare box must be found by shader and twin, no later than it is.
                if let Some(exact) = exact_entry(&frame, case) {
                    assert!(
                        t >= 0.0 && found.entry >= 0.0,
                        "the ray meets the box at {exact}, shader {}, twin {t}",
                        found.entry
                    );
                    assert!(
                        f64::from(found.entry.max(t))
                            <= exact.max(f64::from(frame.near)) * (1.0 + 1e-5)
                    );
                }
            }
        }
    }
    // Decisions may differ only where rounding decides; the cases crowd there on purpose.
    assert!(
        contested * 1000 < compared,
        "{contested} of {compared} decisions differ"
    );
    eprintln!("{compared} cases, {contested} decided differently by shader and twin");
}

/// Where the pixel's ray enters the bare box in front of the near plane.
fn exact_entry(frame: &FrameUniform, case: &Case) -> Option<f64> {
    let v = |a: [f32; 3]| DVec3::from_array(a.map(f64::from));
    let (x, y) = (f64::from(case.x), f64::from(case.y));
    let eye = v(frame.ray_origin) + x * v(frame.ray_origin_dx) + y * v(frame.ray_origin_dy);
    let direction =
        v(frame.ray_direction) + x * v(frame.ray_direction_dx) + y * v(frame.ray_direction_dy);
    let (lo, hi) = (v(case.min), v(case.max));
    let (mut first, mut last) = (f64::from(frame.near), f64::INFINITY);
    for axis in 0..3 {
        let (a, b) = (
            (lo[axis] - eye[axis]) / direction[axis],
            (hi[axis] - eye[axis]) / direction[axis],
        );
        if direction[axis] == 0.0 {
            if eye[axis] < lo[axis] || eye[axis] > hi[axis] {
                return None;
            }
        } else {
            first = first.max(a.min(b));
            last = last.min(a.max(b));
        }
    }
    (first <= last).then_some(first)
}

#[test]
fn pack_agrees_with_its_twin() {
    let Some(gpu) = gpu() else { return };
    let wgsl = hroc_shaders::source("pack").unwrap();
    let mut rng = Rng(12);
    for count in [1u32, 31, 32, 33, 1000, 8192, 8193, 70_001] {
        for density in [0, 1, 8, 32] {
            // Of each 32 objects about `density` are members; 32: all of them.
            let words = (0..count.div_ceil(32))
                .map(|word| {
                    let random = (0..32)
                        .map(|bit| u32::from(rng.bits() % 32 < density) << bit)
                        .sum::<u32>();
                    if (word + 1) * 32 > count {
                        random & ((1u64 << (count - word * 32)) - 1) as u32
                    } else {
                        random
                    }
                })
                .collect::<Vec<_>>();
            // Half of all objects are in the class.
            let class = words.iter().map(|_| rng.bits() as u32).collect::<Vec<_>>();
            let meshes = (0..7u32)
                .map(|i| ArchivedMesh {
                    first_index: (30 * i).into(),
                    index_count: (3 * i + 3).into(),
                    first_vertex: (10 * i).into(),
                    ..bytemuck::Zeroable::zeroed()
                })
                .collect::<Vec<_>>();
            let objects = (0..count)
                .map(|i| ArchivedObject {
                    mesh: (i % 7).into(),
                    ..bytemuck::Zeroable::zeroed()
                })
                .collect::<Vec<_>>();

            let storage = wgpu::BufferUsages::STORAGE;
            let members = buffer(gpu, bytemuck::cast_slice(&words), storage);
            let object_class = buffer(gpu, bytemuck::cast_slice(&class), storage);
            let packed = buffer(gpu, &vec![0; words.len() * 4], storage);
            let bases = buffer(gpu, &vec![0; words.len() * 4], storage);
            let total = buffer(gpu, &[0; 4], storage);
            let commands = buffer(gpu, &vec![0; count as usize * 20], storage);
            let object_buffer = buffer(gpu, hroc_format::bytes_of(&objects), storage);
            let mesh_buffer = buffer(gpu, hroc_format::bytes_of(&meshes), storage);
            let limits = buffer(
                gpu,
                bytemuck::bytes_of(&[words.len() as u32, 0, 0, 0]),
                wgpu::BufferUsages::UNIFORM,
            );
            run(
                gpu,
                &wgsl,
                "pack_scan",
                &[],
                &[
                    (0, &members),
                    (1, &object_class),
                    (2, &packed),
                    (3, &bases),
                    (4, &total),
                    (8, &limits),
                ],
                1,
            );
            let emit = [
                (2, &packed),
                (3, &bases),
                (5, &commands),
                (6, &object_buffer),
                (7, &mesh_buffer),
                (8, &limits),
            ];
            run(
                gpu,
                &wgsl,
                "pack_emit",
                &[],
                &emit,
                (words.len() as u32).div_ceil(64),
            );

            let expected = pack::pack(&words, &class, &objects, &meshes);
            let found = readback::words(&gpu.device, &gpu.queue, &commands);
            assert_eq!(
                readback::words(&gpu.device, &gpu.queue, &total)[0] as usize,
                expected.len(),
                "{count} objects, density {density}"
            );
            assert_eq!(
                &found[..expected.len() * 5],
                expected.as_flattened(),
                "{count} objects, density {density}"
            );
            assert!(
                found[expected.len() * 5..].iter().all(|word| *word == 0),
                "nothing is written past the count"
            );
        }
    }
}
