//! What rasterizing one more box costs, in ray-box tests: the constant of adaptive grouping.
//!
//! The batch occlusion test itself is timed by the host's clock on two made-up frames over the same boxes: many
//! small boxes that the map hides, which cost their rasterization alone, and one group whose rays test
//! all the boxes.

use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use hroc_format::{ArchivedBvhNode, BvhNode};

use super::DeviceProfile;
use crate::batch_occlusion_test::{BatchOcclusionTest, TestBuffers, TestOptions};
use crate::box_pass::BOX_VERTICES;
use crate::camera::{Camera, DepthConvention, Projection};
use crate::draw::Targets;
use crate::frame_uniform::FrameUniform;
use crate::gpu;
use crate::mutant::Mutant;
use crate::scene::{SceneShape, Tree, bytes_of};

/// Boxes; a row of so many leaves, each a pixel or so in the image.
const BOXES: u32 = 8192;
/// Boxes that each ray meets.
const TESTED: u32 = 64;
const SIDE_PX: u32 = 128;
const REPEATS: usize = 5;
/// Believed at least and at most.
const SANE: [f32; 2] = [4.0, 16384.0];

/// Cost of a box in ray-box tests. Takes tens of milliseconds; submits and waits.
pub(super) fn box_cost(device: &wgpu::Device, queue: &wgpu::Queue, profile: &DeviceProfile) -> f32 {
    let profile = &DeviceProfile {
        mutant: Mutant::None,
        ..profile.clone()
    };
    // Orthographic, a unit square from 1 before to 1 behind the origin.
    let camera = Camera {
        position: DVec3::new(0.0, 0.0, 1.0),
        orientation: DQuat::IDENTITY,
        projection: Projection::Orthographic { half_height: 1.0 },
        near: 0.01,
        far: Some(3.0),
        jitter_px: [0.0; 2],
    };
    let many = Frame::new(device, queue, profile, &camera, BOXES, true);
    let one = Frame::new(device, queue, profile, &camera, TESTED, false);
    let empty = Frame::new(device, queue, profile, &camera, 1, true);
    // Interleaved, the fastest of each: the rest is disturbance.
    let mut best = [Duration::MAX; 3];
    for _ in 0..REPEATS {
        for (frame, best) in [&many, &one, &empty].into_iter().zip(&mut best) {
            *best = frame.run(device, queue).min(*best);
        }
    }
    let beyond = |time: Duration| time.saturating_sub(best[2]).as_secs_f64();
    let per_box = beyond(best[0]) / f64::from(BOXES);
    let tests = f64::from((2 * TESTED - 1) * SIDE_PX * SIDE_PX);
    let per_test = beyond(best[1]) / tests;
    if per_box > 0.0 && per_test > 0.0 {
        ((per_box / per_test) as f32).clamp(SANE[0], SANE[1])
    } else {
        super::ASSUMED_BOX_COST
    }
}

struct Frame {
    test: BatchOcclusionTest,
    depth: wgpu::TextureView,
    item: wgpu::TextureView,
    group_draw: wgpu::Buffer,
}

impl Frame {
    /// `hidden`: every leaf is a group and a small box, behind the map; else the root is the only one, and all its
    /// boxes fill the image in front of it.
    fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        profile: &DeviceProfile,
        camera: &Camera,
        leaves: u32,
        hidden: bool,
    ) -> Self {
        let none = wgpu::BufferUsages::empty();
        let shape = SceneShape {
            origin: DVec3::ZERO,
            cells: [DVec3::ZERO].into(),
            radius: 2.0,
            reach: 3.0,
            object_count: leaves,
            static_count: leaves,
            subpixel_step_px: super::COARSEST_SUBPIXEL_STEP_PX,
        };
        let size = [SIDE_PX; 2];
        let convention = DepthConvention::Reversed;
        let uniform =
            FrameUniform::new(camera, convention, size, &shape).expect("the camera above is sound");
        let frame = gpu::uniform(device, "frame", bytes_of(&uniform));
        // The nodes in depth-first order, every right child a leaf.
        let count = 2 * leaves - 1;
        let nodes = (0..count)
            .map(|n| {
                let is_leaf = n % 2 == 1 || n + 1 == count;
                let (min, max) = if hidden {
                    let at = |k: u32| k as f32 / 64.0 - 0.99;
                    let (x, y) = (at(n / 2 % 126), at(n / 2 / 126 % 126));
                    ([x, y, -0.5], [x + 0.015, y + 0.015, -0.4])
                } else {
                    ([-1.0, -1.0, 0.4], [1.0, 1.0, 0.5])
                };
                ArchivedBvhNode {
                    min: min.map(Into::into),
                    skip: (if is_leaf { n + 1 } else { count }).into(),
                    max: max.map(Into::into),
                    cell_and_object: BvhNode::pack(
                        0,
                        is_leaf.then(|| n.div_ceil(2).min(leaves - 1)),
                    )
                    .into(),
                }
            })
            .collect::<Vec<_>>();
        let storage = |label, bytes: &[u8]| {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
            gpu::buffer_with(device, label, bytes, (bytes.len() as u64).max(64), usage)
        };
        let tree = Tree {
            split: String::new(),
            nodes: storage("nodes", hroc_format::bytes_of(&nodes)),
            parents: storage("parents", &[]),
            leaf_of_object: storage("leaves", &[]),
        };
        let groups = if hidden {
            (0..count)
                .filter(|n| n % 2 == 1 || n + 1 == count)
                .collect()
        } else {
            vec![0]
        };
        let words = |label, words: u32| gpu::storage(device, label, u64::from(words) * 4, none);
        let set = || words("set", leaves.div_ceil(32));
        let buffers = TestBuffers {
            frame: &frame,
            tree: &tree,
            groups: &storage("groups", bytemuck::cast_slice(&groups)),
            potential_occluders: &set(),
            potentially_visible: &set(),
            work: &words("work", 4),
            grouping: &words("grouping", 4),
            flagged_nodes: &words("flagged", count.div_ceil(32)),
            object_bounds: &words("bounds", 8),
        };
        let options = TestOptions {
            depth: convention,
            prune: false,
            count_work: false,
        };
        let texture = |format| {
            let usage =
                wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("box cost"),
                size: wgpu::Extent3d {
                    width: SIDE_PX,
                    height: SIDE_PX,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let (depth, item) = (
            texture(Targets::DEPTH_FORMAT),
            texture(Targets::ITEM_FORMAT),
        );
        // The map, everywhere at the depth of z = 0.
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("box cost"),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(2.0 / 3.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        }));
        queue.submit([encoder.finish()]);
        Self {
            test: BatchOcclusionTest::new(device, profile, options, &buffers),
            depth,
            item,
            group_draw: gpu::buffer_with(
                device,
                "group_draw",
                bytes_of(&[BOX_VERTICES, groups.len() as u32, 0, 0]),
                16,
                wgpu::BufferUsages::INDIRECT,
            ),
        }
    }

    fn run(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Duration {
        let targets = Targets {
            depth: &self.depth,
            item_buffer: &self.item,
            size: [SIDE_PX; 2],
        };
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.test
            .record(device, &mut encoder, &targets, &self.group_draw);
        let commands = encoder.finish();
        let began = Instant::now();
        queue.submit([commands]);
        // A lost device shows elsewhere.
        let _ = device.poll(wgpu::PollType::wait_indefinitely());
        began.elapsed()
    }
}
