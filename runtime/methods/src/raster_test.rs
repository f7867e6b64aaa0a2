//! `raster_test`: which objects show in front of the depth so far, told by rasterizing their bounds.

use hroc_runtime::gpu::{self, Access};
use hroc_runtime::{BOX_VERTICES, BoxPass, BoxShader, FrameContext, Kernel, Scene, Stage};

use crate::view::View;

const SHADER: BoxShader = BoxShader {
    sampled: "roc_test",
    sampled_entry: "raster_test",
    early: "roc_test_early",
    early_entry: "raster_test_early",
};
const RASTER_TEST: Stage = Stage::new("raster_test");

/// Whose bounds are rasterized.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Tested<'a> {
    /// Every object of the frustum.
    All,
    /// The members of one set that another lacks, one bit per object each.
    Undrawn {
        candidates: &'a wgpu::Buffer,
        drawn: &'a wgpu::Buffer,
    },
}

/// The test of one view.
#[derive(Debug)]
pub(crate) struct RasterTest {
    collect_boxes: Kernel,
    pass: BoxPass,
    boxes: wgpu::Buffer,
    box_draw: wgpu::Buffer,
    no_boxes: wgpu::Buffer,
    object_count: u32,
}

impl RasterTest {
    /// Writes to `found`, one bit per object.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        view: &View,
        tested: Tested<'_>,
        found: &wgpu::Buffer,
    ) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let object_count = scene.shape.object_count;
        let none = wgpu::BufferUsages::empty();
        let boxes = gpu::storage(device, "boxes", 4 * u64::from(object_count), none);
        let box_draw = gpu::storage(device, "box_draw", 16, wgpu::BufferUsages::INDIRECT);
        let mut bindings = vec![
            (1, Read, &scene.object_bounds),
            (2, ReadWrite, found),
            (3, ReadWrite, &boxes),
            (4, ReadWrite, &box_draw),
        ];
        let entry = match tested {
            Tested::All => "collect_boxes",
            Tested::Undrawn { candidates, drawn } => {
                bindings.extend([(5, Read, candidates), (6, Read, drawn)]);
                "collect_undrawn_boxes"
            }
        };
        let rasterized = [
            (Uniform, &view.frame),
            (Read, &scene.object_bounds),
            (ReadWrite, found),
            (Read, &boxes),
        ];
        let (profile, depth) = (&scene.profile, view.depth);
        let constants = [profile.mutant.constant()];
        Self {
            collect_boxes: view.kernel(device, scene, "roc", entry, &bindings),
            pass: BoxPass::new(device, profile, SHADER, depth, &constants, &rasterized),
            no_boxes: gpu::storage_with(device, "no boxes", &[BOX_VERTICES, 0, 0, 0]),
            boxes,
            box_draw,
            object_count,
        }
    }

    /// Makes `found` anew.
    pub fn record(&self, frame: &mut FrameContext<'_>, found: &wgpu::Buffer) {
        let (device, targets) = (frame.device, frame.targets);
        frame.stage(RASTER_TEST, |encoder| {
            encoder.clear_buffer(found, 0, None);
            encoder.copy_buffer_to_buffer(&self.no_boxes, 0, &self.box_draw, 0, 16);
            let mut pass = gpu::compute_pass(encoder, "collect_boxes");
            let grid = gpu::grid(self.object_count, 64);
            self.collect_boxes.dispatch(&mut pass, grid);
            drop(pass);
            (self.pass).record(device, encoder, &targets, &self.box_draw, 0);
        });
    }

    /// The indirect arguments of the boxes; the second u32 is their number.
    pub const fn box_draw(&self) -> &wgpu::Buffer {
        &self.box_draw
    }

    pub fn memory_bytes(&self) -> u64 {
        self.boxes.size() + self.box_draw.size()
    }
}
