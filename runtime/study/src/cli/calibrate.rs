//! `hroc calibrate`.

use clap::Args;
use hroc_methods::HardwareTimes;
use serde::Serialize;

use super::{Destination, JsonOutput, to_stdout};
use crate::error::{StudyError, exit};
use crate::gpu::{Gpu, GpuOptions};
use crate::results::{AdapterInfo, Hardware};
use crate::table;

/// Options of `hroc calibrate`.
#[derive(Debug, Args)]
pub(super) struct CalibrateArguments {
    /// Write the results as JSON; `-` for the standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<Destination>,
    /// Part of the name of the adapter to use; also read from WGPU_ADAPTER_NAME.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

/// What `hroc calibrate --json` writes.
#[derive(Debug, Serialize)]
struct Calibration {
    schema: u32,
    adapter: AdapterInfo,
    /// The grid that the rasterizer moves vertices to, pixels.
    subpixel_step_px: f64,
    /// Cost of one more box of adaptive grouping, in ray-box tests.
    box_cost: f32,
    #[serde(flatten)]
    hardware: Hardware,
}

pub(super) fn calibrate(arguments: &CalibrateArguments) -> Result<u8, StudyError> {
    let json = arguments.json.as_ref().map(JsonOutput::open).transpose()?;
    let gpu = Gpu::open(&GpuOptions {
        adapter: arguments.adapter.clone(),
        ..GpuOptions::default()
    })?;
    let times = HardwareTimes::measure(&gpu.device, &gpu.queue);
    let calibration = Calibration {
        schema: 1,
        adapter: AdapterInfo::of(&gpu.info),
        subpixel_step_px: gpu.profile.subpixel_step_px,
        box_cost: gpu.profile.measure_box_cost(&gpu.device, &gpu.queue),
        hardware: times.into(),
    };
    gpu.check()?;
    let text = serde_json::to_string_pretty(&calibration).expect("results become JSON") + "\n";
    match json {
        Some(JsonOutput::Stdout) => to_stdout(&text)?,
        Some(JsonOutput::File(file)) => {
            file.finish(text.as_bytes())?;
            to_stdout(&markdown(&calibration))?;
        }
        None => to_stdout(&markdown(&calibration))?,
    }
    Ok(exit::GOOD)
}

fn markdown(calibration: &Calibration) -> String {
    let hardware = &calibration.hardware;
    let microseconds = |ms: f64| format!("{:.5} us", ms * 1e3);
    let rows = [
        ("adapter", calibration.adapter.name.clone()),
        (
            "subpixel step",
            format!("1/{} px", 1.0 / calibration.subpixel_step_px),
        ),
        (
            "box of a group",
            format!("{:.0} ray-box tests", calibration.box_cost),
        ),
        ("draw (T_r^s)", microseconds(hardware.draw_ms)),
        ("triangle (T_r^tri)", microseconds(hardware.triangle_ms)),
        ("fragment (T_r^f)", microseconds(hardware.fragment_ms)),
        ("query (T_o^s)", microseconds(hardware.query_ms)),
        (
            "fragment in a query (T_o^f)",
            microseconds(hardware.query_fragment_ms),
        ),
        (
            "latency of a query (T_o^l)",
            microseconds(hardware.query_latency_ms),
        ),
        (
            "query round a draw (T_o^o)",
            microseconds(hardware.query_overhead_ms),
        ),
    ];
    let rows = rows.map(|(what, value)| [what.to_owned(), value]);
    table::markdown(["what", "cost"], rows)
}
