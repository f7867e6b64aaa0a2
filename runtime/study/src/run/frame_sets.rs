//! The sets of a frame, read back.

use hroc_format::ArchivedScene;
use hroc_runtime::{CullingMethod, QueryCounts, readback};

use crate::drawn::Drawn;
use crate::gpu::Gpu;
use crate::id_set::IdSet;
use crate::results::{Counters, Frame, SetSizes};

/// The sets of a frame on the host.
pub(super) struct FrameSets {
    pub(super) drawn: Drawn,
    effective_occluders: Option<IdSet>,
    group_count: Option<u32>,
    queries: Option<QueryCounts>,
}

impl FrameSets {
    /// The sets of the frame that `method` drew last, once it is done.
    pub(super) fn read(gpu: &Gpu, method: &dyn CullingMethod) -> Self {
        let words = |buffer: &wgpu::Buffer| readback::words(&gpu.device, &gpu.queue, buffer);
        let sets = method.sets();
        Self {
            drawn: Drawn::read(gpu, method),
            effective_occluders: sets
                .effective_occluders
                .map(|set| IdSet::from_words(words(set))),
            queries: method.queries(),
            // The second of the indirect arguments: the number of instances.
            group_count: sets.group_draw.map(|arguments| words(arguments)[1]),
        }
    }

    /// Fills in the sizes of the sets and the counters that follow from them; `visible` is what shows.
    pub(super) fn describe(&self, scene: &ArchivedScene, visible: &IdSet, frame: &mut Frame) {
        let len = |set: &Option<IdSet>| set.as_ref().map(IdSet::len);
        let groups = self.group_count.map(|count| count as usize);
        frame.sets = SetSizes {
            v: len(&self.drawn.potential_occluders),
            o: len(&self.effective_occluders),
            g: groups,
            u: len(&self.drawn.potentially_visible),
            d: self
                .drawn
                .potentially_visible
                .as_ref()
                .map(|set| set.intersection(visible).len()),
        };
        let drawn = self.drawn.all();
        let triangles = |id: u32| {
            let mesh = scene.objects[id as usize].mesh.to_native();
            u64::from(scene.meshes[mesh as usize].index_count.to_native() / 3)
        };
        frame.pvs = Some(drawn.len());
        frame.counters = Counters {
            draws: Some(drawn.len() as u64),
            triangles: Some(drawn.iter().map(triangles).sum()),
            groups: groups.map(|count| count as u64),
            boxes_rasterized: (groups.map(|count| count as u64))
                .or(self.queries.map(|counts| counts.boxes.into())),
            queries: self.queries.map(|counts| counts.queries.into()),
            wasted_queries: self.queries.map(|counts| counts.wasted.into()),
            waits: self.queries.map(|counts| counts.waits.into()),
            ..Counters::default()
        };
    }
}
