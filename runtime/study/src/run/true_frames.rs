//! The truth of each frame of a run.

use hroc_format::ObjectBounds;
use hroc_runtime::{CullingMethod, FrameContext, FrameUniform, Noc};

use super::bench::{Bench, Output};
use crate::blended_truth::BlendedTruth;
use crate::drawer::{Guard, ObjectDrawer};
use crate::error::StudyError;
use crate::id_set::IdSet;
use crate::image::{Image, ImageCopy};
use crate::results::Warning;
use crate::sampling::Step;
use crate::targets::FrameTargets;
use crate::truth::{Truth, TruthKey, TruthStore};
use crate::unculled::{Judgement, Unculled, judge, needs_finite};

/// A frame as it is without culling.
pub(super) struct TrueFrame {
    pub(super) image: Image,
    /// The objects that show, blended ones included.
    pub(super) visible: IdSet,
    /// What is wrong with the image; `None` in a run without the check.
    pub(super) judgement: Option<Judgement>,
}

/// Draws no culling without `hroc_keeps`, and judges what that changes.
struct Judge {
    noc: Noc,
    plain: ObjectDrawer,
    finite: ObjectDrawer,
    /// Its own, as blended objects are held against the truth's.
    targets: FrameTargets,
    /// Of every object, by id.
    bounds: Vec<ObjectBounds>,
}

impl Judge {
    fn new(bench: &Bench<'_>) -> Self {
        let (device, depth) = (&bench.gpu.device, bench.course.depth);
        let targets = FrameTargets::new(device, bench.course.size);
        let drawer =
            |guard| ObjectDrawer::with_guard(device, &bench.scene, &targets, depth, false, guard);
        let bounds = bench.baked.scene().object_bounds.iter();
        Self {
            noc: Noc::new(device, &bench.scene, depth),
            plain: drawer(Guard::Off),
            finite: drawer(Guard::Finite),
            bounds: bounds.map(|bounds| bounds.to_native()).collect(),
            targets,
        }
    }

    /// Judges the frame of `step`, whose truth is `kept`.
    fn judge(
        &mut self,
        bench: &Bench<'_>,
        step: &Step,
        uniform: &FrameUniform,
        kept: &Image,
    ) -> Result<Judgement, StudyError> {
        let plain = self.draw(bench, step, Guard::Off)?;
        let finite = needs_finite(kept, &plain)
            .then(|| self.draw(bench, step, Guard::Finite))
            .transpose()?;
        let images = Unculled {
            kept,
            plain: &plain,
            finite: finite.as_ref().unwrap_or(&plain),
        };
        Ok(judge(images, uniform, bench.course.depth, &self.bounds))
    }

    fn draw(&mut self, bench: &Bench<'_>, step: &Step, guard: Guard) -> Result<Image, StudyError> {
        let at = |source| StudyError::Camera {
            frame: step.frame,
            source,
        };
        let (gpu, course, camera) = (bench.gpu, bench.course, bench.camera(step));
        let drawer = match guard {
            Guard::Off => &mut self.plain,
            _ => &mut self.finite,
        };
        let shape = &bench.scene.shape;
        drawer
            .set_camera(&gpu.queue, &camera, course.depth, course.size, shape)
            .map_err(at)?;
        let mut encoder = gpu.encoder();
        let mut context = FrameContext {
            device: &gpu.device,
            queue: &gpu.queue,
            encoder: &mut encoder,
            scene: &bench.scene,
            camera: &camera,
            targets: self.targets.targets(),
            observer: None,
        };
        self.noc.encode(&mut context, drawer).map_err(at)?;
        let copy = ImageCopy::record(&gpu.device, &mut encoder, &self.targets);
        gpu.submit_and_wait(encoder)?;
        Ok(copy.wait(&gpu.device))
    }
}

/// Makes or finds the truth of each frame.
pub(super) struct TrueFrames<'a> {
    noc: Noc,
    judge: Option<Judge>,
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
            judge: course.check.then(|| Judge::new(bench)),
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
        let Truth { image, judgement } = self.truth(bench, step)?;
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
        Ok(TrueFrame {
            image,
            visible,
            judgement,
        })
    }

    fn truth(&mut self, bench: &mut Bench<'_>, step: &Step) -> Result<Truth, StudyError> {
        let (gpu, course) = (bench.gpu, bench.course);
        let camera = bench.camera(step);
        let uniform = FrameUniform::new(&camera, course.depth, course.size, &bench.scene.shape)
            .map_err(|source| StudyError::Camera {
                frame: step.frame,
                source,
            })?;
        let frame = bytemuck::bytes_of(&uniform);
        // Frames that only make history are not judged.
        let judged = self.judge.is_some() && step.counted;
        let stored = self
            .store
            .as_ref()
            .and_then(|store| store.load(&self.key, frame))
            .filter(|truth| truth.judgement.is_some() || !judged);
        if let Some(truth) = stored {
            return Ok(truth);
        }
        let mut encoder = gpu.encoder();
        bench.encode(&mut self.noc, step, &mut encoder, Output::Color, None)?;
        let copy = ImageCopy::record(&gpu.device, &mut encoder, &bench.targets);
        gpu.submit_and_wait(encoder)?;
        let image = copy.wait(&gpu.device);
        let judgement = self
            .judge
            .as_mut()
            .filter(|_| judged)
            .map(|judge| judge.judge(bench, step, &uniform, &image))
            .transpose()?;
        let truth = Truth { image, judgement };
        // After the first failure there is no point in trying again for every frame.
        if let (Some(store), None) = (&mut self.store, &self.warning) {
            let stored = store.store(&self.key, frame, &truth);
            self.warning = stored
                .err()
                .map(|reason| Warning::TruthNotCached { reason });
        }
        Ok(truth)
    }

    /// What went wrong with the cache.
    pub(super) fn finish(self) -> Vec<Warning> {
        self.warning.into_iter().collect()
    }
}
