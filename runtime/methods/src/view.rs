//! What every method keeps of its view.

use hroc_runtime::gpu::{self, Access};
use hroc_runtime::{
    CameraError, DepthConvention, Draw, DrawList, FrameContext, FrameUniform, Kernel, Scene, Stage,
    Targets,
};

/// A pass over `list`, the first one of a frame if it clears.
pub(crate) fn pass<'a>(
    stage: Stage,
    clear: bool,
    list: DrawList<'a>,
    targets: Targets<'a>,
    depth: DepthConvention,
) -> Draw<'a> {
    Draw {
        stage,
        clear,
        list,
        targets,
        depth,
        marks: None,
    }
}

/// The camera's uniform, and the view's depth convention.
#[derive(Debug)]
pub(crate) struct View {
    pub frame: wgpu::Buffer,
    pub depth: DepthConvention,
}

impl View {
    pub fn new(device: &wgpu::Device, depth: DepthConvention) -> Self {
        Self {
            frame: gpu::uniform(device, "frame", &[0; size_of::<FrameUniform>()]),
            depth,
        }
    }

    /// Writes the uniform for the frame to come.
    pub fn begin(&self, frame: &FrameContext<'_>) -> Result<FrameUniform, CameraError> {
        let shape = &frame.scene.shape;
        let uniform = FrameUniform::new(frame.camera, self.depth, frame.targets.size, shape)?;
        frame
            .queue
            .write_buffer(&self.frame, 0, bytemuck::bytes_of(&uniform));
        Ok(uniform)
    }

    /// A kernel of a module that imports common/bounds; its bindings beside the uniform at 0.
    pub fn kernel(
        &self,
        device: &wgpu::Device,
        scene: &Scene,
        module: &'static str,
        entry: &'static str,
        bindings: &[(u32, Access, &wgpu::Buffer)],
    ) -> Kernel {
        let bindings = [&[(0, Access::Uniform, &self.frame)], bindings].concat();
        let constants = self.constants(scene);
        let pipelines = &scene.profile.pipelines;
        Kernel::new(device, pipelines, module, entry, &constants, &bindings)
    }

    /// The constants of such a module.
    pub fn constants(&self, scene: &Scene) -> [(&'static str, f64); 2] {
        [self.depth.constants()[0], scene.profile.mutant.constant()]
    }
}
