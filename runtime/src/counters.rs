//! Counters of the GPU on the host, frames later or waited for: counter read-back (paper, section 4.1).

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
    /// What [`Counters::generation`] was when the copy was recorded.
    generation: u64,
}

/// Reads back `N` counters of a view, u32 each.
#[derive(Debug)]
pub struct Counters<const N: usize> {
    slots: Vec<Slot>,
    next: usize,
    last: Option<[u32; N]>,
    /// Counts the calls of [`forget`](Self::forget): copies of an earlier one are not taken when they arrive.
    generation: u64,
}

/// A copy that was recorded.
#[derive(Clone, Copy, Debug)]
pub struct CountersCopy(usize);

impl<const N: usize> Counters<N> {
    /// Nothing under way.
    pub fn new(device: &wgpu::Device) -> Self {
        let slot = |_| Slot {
            staging: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("counters"),
                size: 4 * N as u64,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            }),
            state: Arc::new(AtomicU8::new(FREE)),
            generation: 0,
        };
        Self {
            slots: (0..SLOTS).map(slot).collect(),
            next: 0,
            last: None,
            generation: 0,
        }
    }

    /// Records a copy of counters, each at its byte offset in its buffer; `None` if too many are under way.
    pub fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        counters: [(&wgpu::Buffer, u64); N],
    ) -> Option<CountersCopy> {
        let slot = &mut self.slots[self.next];
        if slot.state.load(Ordering::Acquire) != FREE {
            return None;
        }
        for ((counter, offset), place) in counters.into_iter().zip(0..) {
            encoder.copy_buffer_to_buffer(counter, offset, &slot.staging, 4 * place, 4);
        }
        slot.generation = self.generation;
        slot.state.store(RECORDED, Ordering::Release);
        let recorded = CountersCopy(self.next);
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

    /// The newest counters that have arrived, without waiting; `None` before the first ones. The same ones again and
    /// again until newer ones arrive: see [`arrived`](Self::arrived).
    pub fn latest(&mut self, device: &wgpu::Device) -> Option<[u32; N]> {
        self.arrived(device);
        self.last
    }

    /// The newest of the counters that arrived since the last call of this or of [`latest`](Self::latest), without
    /// waiting; `None` if none did. For whoever takes every arrival as an observation of its own: the same copy is
    /// never told twice.
    pub fn arrived(&mut self, device: &wgpu::Device) -> Option<[u32; N]> {
        // Runs the callbacks of what is done. A lost device shows elsewhere.
        let _ = device.poll(wgpu::PollType::Poll);
        let mut newest = None;
        for i in 0..SLOTS {
            // From the oldest on.
            newest = self.take((self.next + i) % SLOTS).or(newest);
        }
        newest
    }

    /// Forgets what has arrived, and what was recorded and has yet to arrive: as after a camera cut, of which they
    /// tell nothing.
    pub fn forget(&mut self) {
        self.last = None;
        self.generation += 1;
    }

    /// Waits for a copy; `None` if the device fails.
    pub(crate) fn wait(
        &mut self,
        device: &wgpu::Device,
        recorded: CountersCopy,
        submitted: wgpu::SubmissionIndex,
    ) -> Option<[u32; N]> {
        self.map_submitted();
        let waited = device.poll(wgpu::PollType::Wait {
            submission_index: Some(submitted),
            timeout: None,
        });
        waited.ok().and_then(|_| self.take(recorded.0))
    }

    fn take(&mut self, slot: usize) -> Option<[u32; N]> {
        let slot = &self.slots[slot];
        match slot.state.load(Ordering::Acquire) {
            MAPPED => {
                let counters = slot.staging.slice(..).get_mapped_range().ok().map(|bytes| {
                    let words = bytemuck::pod_collect_to_vec::<u8, u32>(&bytes);
                    std::array::from_fn(|word| words[word])
                });
                slot.staging.unmap();
                slot.state.store(FREE, Ordering::Release);
                let counters = counters.filter(|_| slot.generation == self.generation);
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
