//! The `hroc` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    leave_wayland_alone();
    hroc_study::cli::main()
}

/// Switches off Mesa's device selection where it can only complain.
///
/// Mesa's Vulkan layer asks the Wayland server for its GPU, and libwayland prints an error, twice, where there is no
/// `XDG_RUNTIME_DIR` to look for one. hroc opens no window and chooses among all devices itself. Somebody who chooses
/// by the layer's own variable keeps it.
fn leave_wayland_alone() {
    let is_set = |name| std::env::var_os(name).is_some();
    if cfg!(target_os = "linux") && !is_set("XDG_RUNTIME_DIR") && !is_set("MESA_VK_DEVICE_SELECT") {
        // SAFETY: this is the first thing that the process does, and it has no thread but this one, so that none can
        // read the environment meanwhile.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
