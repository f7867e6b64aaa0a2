//! What a method drew in a frame, read back.

use hroc_runtime::{CullingMethod, readback};

use crate::gpu::Gpu;
use crate::id_set::IdSet;

/// The objects that a method drew in the last frame, by list; `None`: it has no such list.
#[derive(Clone, Debug, Default)]
pub struct Drawn {
    /// V, as far as it was drawn.
    pub potential_occluders: Option<IdSet>,
    /// U, as far as it was drawn.
    pub potentially_visible: Option<IdSet>,
    /// The blended objects.
    pub blended: Option<IdSet>,
}

impl Drawn {
    /// Of the frame that `method` drew last, once it is done.
    pub fn read(gpu: &Gpu, method: &dyn CullingMethod) -> Self {
        let sets = method.sets();
        let set = |buffer: Option<&wgpu::Buffer>| {
            buffer.map(|buffer| IdSet::from_words(readback::words(&gpu.device, &gpu.queue, buffer)))
        };
        let mut drawn = Self {
            potential_occluders: set(sets.potential_occluders),
            potentially_visible: set(sets.potentially_visible),
            blended: set(sets.blended),
        };
        if let Some(limits) = method.draw_limits() {
            let lists = [
                &mut drawn.potential_occluders,
                &mut drawn.potentially_visible,
            ];
            for (list, limit) in lists.into_iter().zip(limits) {
                *list = list.take().map(|set| set.first(limit));
            }
        }
        drawn
    }

    /// All of them.
    pub fn all(&self) -> IdSet {
        [
            &self.potential_occluders,
            &self.potentially_visible,
            &self.blended,
        ]
        .into_iter()
        .flatten()
        .fold(IdSet::default(), |all, set| all.union(set))
    }
}
