//! The farthest depth of ever larger squares of a depth buffer, and the test of objects against it.

use hroc_runtime::gpu::{self, Access};
use hroc_runtime::{DepthConvention, FrameContext, Kernel, Scene, Stage};

use crate::view::View;

pub(crate) const DEPTH_PYRAMID: Stage = Stage::new("depth_pyramid");
pub(crate) const HIZ_TEST: Stage = Stage::new("hiz_test");

/// The pyramid over an image of one size, in one buffer.
#[derive(Debug)]
pub(crate) struct DepthPyramid {
    pub size: [u32; 2],
    levels: wgpu::Buffer,
    /// Level 0 comes first: one f32 per pixel, rows from the top.
    pub depths: wgpu::Buffer,
    copy: Kernel,
    reduce: Vec<(Kernel, [u32; 2])>,
}

/// Sizes of the levels, from the image down to one texel; each half of the one before, rounded up.
fn level_sizes(size: [u32; 2]) -> Vec<[u32; 2]> {
    let mut sizes = vec![size];
    let mut last = size;
    while last != [1, 1] {
        last = last.map(|n| n.div_ceil(2));
        sizes.push(last);
    }
    sizes
}

impl DepthPyramid {
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        depth: DepthConvention,
        size: [u32; 2],
    ) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let sizes = level_sizes(size.map(|n| n.max(1)));
        let mut first = 0;
        let mut table = Vec::new();
        for [width, height] in &sizes {
            table.extend([first, *width, *height, 0]);
            first += width * height;
        }
        // No padding at the end: the shader tells the number of levels by the buffer's size.
        let levels = gpu::buffer_with(
            device,
            "pyramid levels",
            bytemuck::cast_slice(&table),
            4 * table.len() as u64,
            wgpu::BufferUsages::STORAGE,
        );
        let none = wgpu::BufferUsages::empty();
        let depths = gpu::storage(device, "pyramid", 4 * u64::from(first), none);
        let pipelines = &scene.profile.pipelines;
        let constants = depth.constants();
        let buffers = [(0, Read, &levels), (1, ReadWrite, &depths)];
        let module = "depth_pyramid";
        let reduce = sizes.iter().zip(0u32..).skip(1).map(|(size, number)| {
            let words = [number, 0, 0, 0];
            let made = gpu::uniform(device, "made level", bytemuck::bytes_of(&words));
            let bindings = [buffers[0], buffers[1], (2, Uniform, &made)];
            let kernel = Kernel::new(device, pipelines, module, "reduce", &constants, &bindings);
            (kernel, size.map(|n| n.div_ceil(8)))
        });
        Self {
            size,
            copy: Kernel::over_depth(device, pipelines, module, "copy_depth", &[], &buffers),
            reduce: reduce.collect(),
            levels,
            depths,
        }
    }

    /// Takes level 0 from a depth texture of the pyramid's size.
    pub fn copy(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        depth: &wgpu::TextureView,
    ) {
        let mut pass = gpu::compute_pass(encoder, "copy_depth");
        let grid = self.size.map(|n| n.div_ceil(8));
        self.copy.dispatch_over(device, &mut pass, depth, grid);
    }

    /// Makes the other levels from level 0.
    pub fn reduce(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = gpu::compute_pass(encoder, "depth_pyramid");
        for (kernel, grid) in &self.reduce {
            kernel.dispatch(&mut pass, *grid);
        }
    }

    pub fn memory_bytes(&self) -> u64 {
        self.levels.size() + self.depths.size()
    }
}

/// What is projected to a screen rectangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Projected {
    /// The object's box.
    #[default]
    Box,
    /// The sphere round it.
    Sphere,
}

/// `hiz_test`: which objects of the frustum a pyramid does not hide.
#[derive(Debug)]
pub(crate) struct HizTest {
    kernel: Kernel,
    object_count: u32,
}

impl HizTest {
    /// Writes to `found`, one bit per object.
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        view: &View,
        pyramid: &DepthPyramid,
        found: &wgpu::Buffer,
        projected: Projected,
    ) -> Self {
        use Access::{Read, ReadWrite, Uniform};
        let bindings = [
            (0, Uniform, &view.frame),
            (1, Read, &scene.object_bounds),
            (2, ReadWrite, found),
            (3, Read, &pyramid.levels),
            (4, Read, &pyramid.depths),
        ];
        let spheres = gpu::flag(projected == Projected::Sphere);
        let constants = [&view.constants(scene)[..], &[("SPHERES", spheres)]].concat();
        let pipelines = &scene.profile.pipelines;
        let (module, entry) = ("hiz_test", "hiz_test");
        Self {
            kernel: Kernel::new(device, pipelines, module, entry, &constants, &bindings),
            object_count: scene.shape.object_count,
        }
    }

    pub fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = gpu::compute_pass(encoder, "hiz_test");
        self.kernel
            .dispatch(&mut pass, gpu::grid(self.object_count, 64));
    }
}

/// The test of every object's box against a pyramid over the whole image, of the size that the targets have.
#[derive(Debug, Default)]
pub(crate) struct FullResolutionTest(Option<(DepthPyramid, HizTest)>);

impl FullResolutionTest {
    /// Makes the pyramid of the depth so far and tests against it. `found` is the same in every frame.
    pub fn record(&mut self, frame: &mut FrameContext<'_>, view: &View, found: &wgpu::Buffer) {
        let (device, targets, scene) = (frame.device, frame.targets, frame.scene);
        self.0.take_if(|(pyramid, _)| pyramid.size != targets.size);
        let (pyramid, test) = self.0.get_or_insert_with(|| {
            let pyramid = DepthPyramid::new(device, scene, view.depth, targets.size);
            let test = HizTest::new(device, scene, view, &pyramid, found, Projected::Box);
            (pyramid, test)
        });
        frame.stage(DEPTH_PYRAMID, |encoder| {
            pyramid.copy(device, encoder, targets.depth);
            pyramid.reduce(encoder);
        });
        frame.stage(HIZ_TEST, |encoder| test.record(encoder));
    }

    pub fn memory_bytes(&self) -> u64 {
        let sized = self.0.as_ref();
        sized.map_or(0, |(pyramid, _)| pyramid.memory_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::level_sizes;

    #[test]
    fn levels_end_at_one_texel_and_cover_the_one_before() {
        assert_eq!(level_sizes([1, 1]), [[1, 1]]);
        assert_eq!(level_sizes([5, 2]), [[5, 2], [3, 1], [2, 1], [1, 1]]);
        for pair in level_sizes([1920, 1080]).windows(2) {
            assert!(
                pair[0]
                    .iter()
                    .zip(pair[1])
                    .all(|(fine, coarse)| coarse * 2 >= *fine)
            );
        }
    }
}
