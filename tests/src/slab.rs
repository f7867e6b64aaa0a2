//! The shader's slab test against exact arithmetic.
//!
//! Rays and boxes have small dyadic coordinates, so that f64 decides exactly whether the closed box is met: products of
//! differences instead of quotients. Rays are aimed at corners, edges and faces, where rounding decides.

use hroc_runtime::{Mutant, readback};
use hroc_study::gpu::Gpu;
use hroc_study::hard_cases::builder::Rng;

/// Boxes that are tested.
pub const CASES: usize = 400_000;

const PROBE: &str = "//!import common/bounds
struct SlabCase { min: vec3f, pad_0: f32, max: vec3f, pad_1: f32, origin: vec3f, pad_2: f32, direction: vec3f, pad_3: f32 }
@group(0) @binding(1) var<storage, read> cases: array<SlabCase>;
@group(0) @binding(2) var<storage, read_write> entries: array<f32>;
@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) grid: vec3u) {
    let i = id.x + id.y * grid.x * 64u;
    if (i >= arrayLength(&cases)) { return; }
    let c = cases[i];
    let guarded = select(c.direction, vec3f(SMALLEST_DIRECTION), abs(c.direction) < vec3f(SMALLEST_DIRECTION));
    entries[i] = entry(Ray(c.origin, 1.0 / guarded), Box(c.min, c.max), 0.0) + 0.0 * frame.near;
}";

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct SlabCase {
    min: [f32; 3],
    pad_0: f32,
    max: [f32; 3],
    pad_1: f32,
    origin: [f32; 3],
    pad_2: f32,
    direction: [f32; 3],
    pad_3: f32,
}

/// Boxes that the ray meets and the shader, with a safeguard left out, says it misses.
///
/// # Panics
/// If the device fails.
pub fn misses(gpu: &Gpu, mutant: Mutant) -> usize {
    let cases = cases();
    let entries = entries(gpu, mutant, &cases);
    let hit = cases.iter().filter(|case| meets(case)).count();
    assert!(hit > CASES / 2, "most rays are aimed at their boxes: {hit}");
    cases
        .iter()
        .zip(entries)
        .filter(|(case, entry)| *entry < 0.0 && meets(case))
        .count()
}

fn cases() -> Vec<SlabCase> {
    let mut rng = Rng(41);
    // Multiples of 1/64 below 16: 10 bits, so that differences have 11 and their products 22.
    let mut dyadic = move || (rng.bits() % 2048) as f64 / 64.0 - 16.0;
    (0..CASES)
        .map(|i| {
            let mut point = || [dyadic(), dyadic(), dyadic()];
            let (a, b, origin) = (point(), point(), point());
            let min: [f64; 3] = std::array::from_fn(|k| a[k].min(b[k]));
            let mut max: [f64; 3] = std::array::from_fn(|k| a[k].max(b[k]));
            if i % 3 == 0 {
                max[i / 3 % 3] = min[i / 3 % 3];
            }
            // At a corner, or the middle of an edge, a face, the box.
            let target: [f64; 3] = std::array::from_fn(|k| match i >> (2 * k) & 3 {
                0 => min[k],
                1 => max[k],
                _ => 0.5 * (min[k] + max[k]),
            });
            let f32s = |v: [f64; 3]| v.map(|x| x as f32);
            SlabCase {
                min: f32s(min),
                max: f32s(max),
                origin: f32s(origin),
                direction: f32s(std::array::from_fn(|k| target[k] - origin[k])),
                ..bytemuck::Zeroable::zeroed()
            }
        })
        .collect()
}

/// Whether the ray from the origin on meets the closed box: exactly, as every product here has at most 50 bits. Rays
/// within the plane of a face are left to chance: no geometry lies there, as every box that is tested was padded.
fn meets(case: &SlabCase) -> bool {
    // The parameters of entry and exit as fractions with positive denominators.
    let mut first = (0.0, 1.0);
    let mut last = (1.0, 0.0);
    for k in 0..3 {
        let [lo, hi, o, d] =
            [case.min[k], case.max[k], case.origin[k], case.direction[k]].map(f64::from);
        if d == 0.0 {
            if o <= lo || o >= hi {
                return false;
            }
            continue;
        }
        let (near, far) = if d > 0.0 { (lo, hi) } else { (hi, lo) };
        let enter = ((near - o) * d.signum(), d.abs());
        let leave = ((far - o) * d.signum(), d.abs());
        if enter.0 * first.1 > first.0 * enter.1 {
            first = enter;
        }
        if leave.0 * last.1 < last.0 * leave.1 {
            last = leave;
        }
    }
    first.0 * last.1 <= last.0 * first.1
}

fn entries(gpu: &Gpu, mutant: Mutant, cases: &[SlabCase]) -> Vec<f32> {
    use wgpu::util::{BufferInitDescriptor, DeviceExt};
    let device = &gpu.device;
    let buffer = |contents: &[u8], usage| {
        device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents,
            usage: usage | wgpu::BufferUsages::COPY_SRC,
        })
    };
    let frame = buffer(
        &[0; size_of::<hroc_runtime::FrameUniform>()],
        wgpu::BufferUsages::UNIFORM,
    );
    let storage = wgpu::BufferUsages::STORAGE;
    let input = buffer(bytemuck::cast_slice(cases), storage);
    let output = buffer(&vec![0; 4 * cases.len()], storage);
    let wgsl = hroc_shaders::resolve(PROBE).unwrap();
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("slab"),
        source: wgpu::ShaderSource::Wgsl(wgsl.into()),
    });
    let constants = [mutant.constant()];
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("slab"),
        layout: None,
        module: &module,
        entry_point: Some("probe"),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants: &constants,
            ..Default::default()
        },
        cache: None,
    });
    let entries = [&frame, &input, &output].into_iter().zip(0..);
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("slab"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries
            .map(|(buffer, binding)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect::<Vec<_>>(),
    });
    let mut encoder = gpu.encoder();
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(cases.len().div_ceil(64) as u32, 1, 1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    let bytes = readback::buffer(device, &gpu.queue, &output);
    gpu.check().unwrap();
    bytemuck::pod_collect_to_vec(&bytes)
}
