//! SIGINT, SIGTERM and SIGHUP end the process as ever, but leave no temporary file.

/// Watches for the signals from now on. Where that cannot be set up they end the process all the same, and the
/// next bake tidies up.
#[cfg(unix)]
pub(super) fn tidy_up_on_termination() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;

    // A signal that the parent ignores (nohup, a shell's background job) stays ignored.
    let watched = [SIGINT, SIGTERM, SIGHUP];
    let Ok(mut signals) = Signals::new(watched.into_iter().filter(|&signal| !is_ignored(signal)))
    else {
        return;
    };
    let wait = move || {
        if let Some(signal) = signals.forever().next() {
            hroc_format::discard_unfinished();
            let _ = emulate_default_handler(signal);
        }
    };
    let _ = std::thread::Builder::new()
        .name("signals".into())
        .spawn(wait);
}

/// Whether this process was started with the signal ignored; taken for no where the system does not say.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask & 1 << (signal - 1) != 0)
}

#[cfg(not(unix))]
pub(super) fn tidy_up_on_termination() {}
