//! The sets of a frame, read back.

use hroc_format::ArchivedScene;
use hroc_runtime::{CullingMethod, readback};

use crate::gpu::Gpu;
use crate::id_set::IdSet;
use crate::results::{Counters, Frame, SetSizes};

/// The sets of a frame on the host.
pub(super) struct FrameSets {
    potential_occluders: Option<IdSet>,
    effective_occluders: Option<IdSet>,
    potentially_visible: Option<IdSet>,
    group_count: Option<u32>,
}

impl FrameSets {
    /// The sets of the frame that `method` drew last, once it is done.
    pub(super) fn read(gpu: &Gpu, method: &dyn CullingMethod) -> Self {
        let words = |buffer: &wgpu::Buffer| readback::words(&gpu.device, &gpu.queue, buffer);
        let set =
            |buffer: Option<&wgpu::Buffer>| buffer.map(|buffer| IdSet::from_words(words(buffer)));
        let sets = method.sets();
        Self {
            potential_occluders: set(sets.potential_occluders),
            effective_occluders: set(sets.effective_occluders),
            potentially_visible: set(sets.potentially_visible),
            // The second of the indirect arguments: the number of instances.
            group_count: sets.group_draw.map(|arguments| words(arguments)[1]),
        }
    }

    /// V united with U.
    pub(super) fn drawn(&self) -> IdSet {
        let none = IdSet::default();
        let [v, u] = [&self.potential_occluders, &self.potentially_visible]
            .map(|set| set.as_ref().unwrap_or(&none));
        v.union(u)
    }

    /// Fills in the sizes of the sets and the counters that follow from them; `visible` is what shows.
    pub(super) fn describe(&self, scene: &ArchivedScene, visible: &IdSet, frame: &mut Frame) {
        let len = |set: &Option<IdSet>| set.as_ref().map(IdSet::len);
        let groups = self.group_count.map(|count| count as usize);
        frame.sets = SetSizes {
            v: len(&self.potential_occluders),
            o: len(&self.effective_occluders),
            g: groups,
            u: len(&self.potentially_visible),
            d: self
                .potentially_visible
                .as_ref()
                .map(|set| set.intersection(visible).len()),
        };
        let drawn = self.drawn();
        let triangles = |id: u32| {
            let mesh = scene.objects[id as usize].mesh.to_native();
            u64::from(scene.meshes[mesh as usize].index_count.to_native() / 3)
        };
        frame.pvs = Some(drawn.len());
        frame.counters = Counters {
            draws: Some(drawn.len() as u64),
            triangles: Some(drawn.iter().map(triangles).sum()),
            groups: groups.map(|count| count as u64),
            boxes_rasterized: groups.map(|count| count as u64),
            ..Counters::default()
        };
    }
}
