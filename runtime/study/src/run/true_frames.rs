//! The truth of each frame of a run.

use hroc_runtime::{FrameUniform, Noc};

use super::bench::{Bench, Output};
use crate::blended_truth::BlendedTruth;
use crate::drawer::ObjectDrawer;
use crate::error::StudyError;
use crate::id_set::IdSet;
use crate::image::{Image, ImageCopy};
use crate::results::Warning;
use crate::sampling::Step;
use crate::truth::{TruthKey, TruthStore};

/// A frame as it is without culling.
pub(super) struct TrueFrame {
    pub(super) image: Image,
    /// The objects that show, blended ones included.
    pub(super) visible: IdSet,
}

/// Makes or finds the truth of each frame.
pub(super) struct TrueFrames<'a> {
    noc: Noc,
    blended: Option<BlendedTruth>,
    store: Option<TruthStore<'a>>,
    key: TruthKey,
    warning: Option<Warning>,
}

impl<'a> TrueFrames<'a> {
    /// For the frames of `bench`.
    pub(super) fn new(bench: &Bench<'a>) -> Self {
        let (gpu, course) = (bench.gpu, bench.course);
        let info = &gpu.info;
        let key = TruthKey::new(
            course.size,
            &[
                &bench.scene_hash.to_le_bytes(),
                ObjectDrawer::wgsl().as_bytes(),
                course.depth.name().as_bytes(),
                info.name.as_bytes(),
                info.driver.as_bytes(),
                info.driver_info.as_bytes(),
                info.backend.to_str().as_bytes(),
            ],
        );
        let noc = Noc::new(&gpu.device, &bench.scene, course.depth);
        let blended = BlendedTruth::new(gpu, bench.baked.scene(), &bench.scene, course.depth);
        Self {
            noc,
            // What blended objects are held against is the frame in the targets, which a stored image is not.
            store: (course.truth_cache.as_ref())
                .filter(|_| blended.is_none())
                .map(TruthStore::new),
            blended,
            key,
            warning: None,
        }
    }

    /// The truth of a frame; it may be drawn into the targets.
    pub(super) fn frame(
        &mut self,
        bench: &mut Bench<'_>,
        step: &Step,
    ) -> Result<TrueFrame, StudyError> {
        let image = self.image(bench, step)?;
        let mut visible = image.visible();
        if let Some(blended) = &self.blended {
            let (camera, targets) = (bench.camera(step), bench.targets.targets());
            let at = |source| StudyError::Camera {
                frame: step.frame,
                source,
            };
            let shown = blended.shown(bench.gpu, &bench.scene, &camera, targets);
            visible = visible.union(&shown.map_err(at)?);
        }
        Ok(TrueFrame { image, visible })
    }

    fn image(&mut self, bench: &mut Bench<'_>, step: &Step) -> Result<Image, StudyError> {
        let (gpu, course) = (bench.gpu, bench.course);
        let camera = bench.camera(step);
        let uniform = FrameUniform::new(&camera, course.depth, course.size, &bench.scene.shape)
            .map_err(|source| StudyError::Camera {
                frame: step.frame,
                source,
            })?;
        let frame = bytemuck::bytes_of(&uniform);
        if let Some(image) = self
            .store
            .as_ref()
            .and_then(|store| store.load(&self.key, frame))
        {
            return Ok(image);
        }
        let mut encoder = gpu.encoder();
        bench.encode(&mut self.noc, step, &mut encoder, Output::Color, None)?;
        let copy = ImageCopy::record(&gpu.device, &mut encoder, &bench.targets);
        gpu.submit_and_wait(encoder)?;
        let image = copy.wait(&gpu.device);
        // After the first failure there is no point in trying again for every frame.
        if let (Some(store), None) = (&mut self.store, &self.warning) {
            let stored = store.store(&self.key, frame, &image);
            self.warning = stored
                .err()
                .map(|reason| Warning::TruthNotCached { reason });
        }
        Ok(image)
    }

    /// What went wrong with the cache.
    pub(super) fn finish(self) -> Vec<Warning> {
        self.warning.into_iter().collect()
    }
}
