//! The lengths of V's and U's draw lists on the host: counter read-back (paper, section 4.1).

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// Copies in flight at once; more are not begun.
const SLOTS: usize = 3;

const FREE: u8 = 0;
const RECORDED: u8 = 1;
const MAPPING: u8 = 2;
const MAPPED: u8 = 3;
const FAILED: u8 = 4;

#[derive(Debug)]
struct Slot {
    staging: wgpu::Buffer,
    state: Arc<AtomicU8>,
}

/// Reads back two counters of a view.
#[derive(Debug)]
pub(crate) struct Counters {
    slots: Vec<Slot>,
    next: usize,
    last: Option<[u32; 2]>,
}

/// A copy that was recorded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Recorded(usize);

impl Counters {
    pub fn new(device: &wgpu::Device) -> Self {
        let slot = |_| Slot {
            staging: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("counters"),
                size: 8,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            }),
            state: Arc::new(AtomicU8::new(FREE)),
        };
        Self {
            slots: (0..SLOTS).map(slot).collect(),
            next: 0,
            last: None,
        }
    }

    /// Records a copy of two counters; `None` if too many are under way.
    pub fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        counters: [&wgpu::Buffer; 2],
    ) -> Option<Recorded> {
        let slot = &self.slots[self.next];
        if slot.state.load(Ordering::Acquire) != FREE {
            return None;
        }
        for (counter, offset) in counters.into_iter().zip([0, 4]) {
            encoder.copy_buffer_to_buffer(counter, 0, &slot.staging, offset, 4);
        }
        slot.state.store(RECORDED, Ordering::Release);
        let recorded = Recorded(self.next);
        self.next = (self.next + 1) % SLOTS;
        Some(recorded)
    }

    /// Asks for the copies that were recorded and, by now, submitted.
    pub fn map_submitted(&self) {
        for slot in &self.slots {
            let recorded =
                slot.state
                    .compare_exchange(RECORDED, MAPPING, Ordering::AcqRel, Ordering::Acquire);
            if recorded.is_ok() {
                let state = Arc::clone(&slot.state);
                slot.staging
                    .slice(..)
                    .map_async(wgpu::MapMode::Read, move |result| {
                        let mapped = if result.is_ok() { MAPPED } else { FAILED };
                        state.store(mapped, Ordering::Release);
                    });
            }
        }
    }

    /// The newest counters that have arrived, without waiting; `None` before the first ones.
    pub fn latest(&mut self, device: &wgpu::Device) -> Option<[u32; 2]> {
        // Runs the callbacks of what is done. A lost device shows elsewhere.
        let _ = device.poll(wgpu::PollType::Poll);
        for i in 0..SLOTS {
            // From the oldest on.
            self.take((self.next + i) % SLOTS);
        }
        self.last
    }

    /// Waits for a copy; `None` if the device fails.
    pub fn wait(
        &mut self,
        device: &wgpu::Device,
        recorded: Recorded,
        submitted: wgpu::SubmissionIndex,
    ) -> Option<[u32; 2]> {
        self.map_submitted();
        let waited = device.poll(wgpu::PollType::Wait {
            submission_index: Some(submitted),
            timeout: None,
        });
        waited.ok().and_then(|_| self.take(recorded.0))
    }

    fn take(&mut self, slot: usize) -> Option<[u32; 2]> {
        let slot = &self.slots[slot];
        match slot.state.load(Ordering::Acquire) {
            MAPPED => {
                let counters = slot.staging.slice(..).get_mapped_range().ok().map(|bytes| {
                    let words = bytemuck::pod_collect_to_vec::<u8, u32>(&bytes);
                    [words[0], words[1]]
                });
                slot.staging.unmap();
                slot.state.store(FREE, Ordering::Release);
                if counters.is_some() {
                    self.last = counters;
                }
                counters
            }
            FAILED => {
                slot.state.store(FREE, Ordering::Release);
                None
            }
            _ => None,
        }
    }
}
