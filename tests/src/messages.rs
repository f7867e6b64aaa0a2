//! What wgpu and, through it, the driver and its validation layer log while a test runs.

use std::sync::{Mutex, Once, PoisonError};

pub use log::LevelFilter;
use log::{Log, Metadata, Record};

/// Messages that say nothing about hroc: parts of their text, and why they are let pass.
const HARMLESS: &[(&[&str], &str)] = &[
    (
        &["Invalid source language operand: 10"],
        "Debian's layer of 2023 does not know that WGSL has a number of its own among SPIR-V's source languages",
    ),
    (
        &[
            "WRITE_AFTER_READ",
            "depth aspect during store with storeOp VK_ATTACHMENT_STORE_OP_STORE",
            "prior_usage: SYNC_FRAGMENT_SHADER_SHADER_SAMPLED_READ",
        ],
        "WebGPU lets a pass sample the depth that is attached to it read-only; wgpu 30 ends such a pass with a store, \
         which Vulkan counts as a write of what is there already (Vulkan-ValidationLayers issue 2349)",
    ),
    (
        &["is not a conformant Vulkan implementation"],
        "Mesa's notice of itself",
    ),
];

struct Collector(Mutex<Vec<String>>);

static COLLECTOR: Collector = Collector(Mutex::new(Vec::new()));
static INSTALL: Once = Once::new();

impl Log for Collector {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.level() <= log::max_level()
    }

    fn log(&self, record: &Record<'_>) {
        if !self.enabled(record.metadata()) {
            return;
        }
        let text = record.args().to_string();
        let mut messages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // wgpu logs what a message of the layer is about as messages of their own, indented.
        match messages.last_mut().filter(|_| text.starts_with('\t')) {
            Some(last) => *last += &text,
            None => messages.push(format!("{} {}: {text}", record.level(), record.target())),
        }
    }

    fn flush(&self) {}
}

/// Listens from now on, before the first device is opened.
///
/// # Panics
/// If another logger is installed in this process.
pub fn listen(level: LevelFilter) {
    INSTALL.call_once(|| {
        log::set_logger(&COLLECTOR).expect("the only logger of this process");
        log::set_max_level(level);
    });
}

/// Every message since [`listen`], the harmless ones included.
pub fn all() -> Vec<String> {
    let messages = COLLECTOR.0.lock();
    messages.unwrap_or_else(PoisonError::into_inner).clone()
}

/// Those of [`all`] that are not known to be harmless.
pub fn telling() -> Vec<String> {
    let harmless = |message: &String| {
        let said = |(parts, _): &(&[&str], _)| parts.iter().all(|part| message.contains(part));
        HARMLESS.iter().any(said)
    };
    all().into_iter().filter(|m| !harmless(m)).collect()
}
