//! The machine that a comparison ran on.

use std::fs;

use serde::{Deserialize, Serialize};

/// What is known of the machine and of this program.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Host {
    /// Model of the processor; empty where the system does not tell.
    pub cpu: String,
    /// Cores that this process may use.
    pub cores: usize,
    /// Operating system and processor architecture.
    pub os: String,
    /// Version of hroc.
    pub hroc: String,
    /// The commit it was built of, where `HROC_COMMIT` was set at the build.
    pub commit: Option<String>,
}

impl Host {
    /// This one.
    pub fn here() -> Self {
        let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
        let cpu = field(&read("/proc/cpuinfo"), "model name", ':')
            .or_else(|| std::env::var("PROCESSOR_IDENTIFIER").ok());
        let name = field(&read("/etc/os-release"), "PRETTY_NAME", '=');
        let name = name.unwrap_or_else(|| std::env::consts::OS.to_owned());
        Self {
            cpu: cpu.unwrap_or_default(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            os: format!("{name} {}", std::env::consts::ARCH),
            hroc: env!("CARGO_PKG_VERSION").to_owned(),
            commit: option_env!("HROC_COMMIT").map(str::to_owned),
        }
    }
}

/// The value of the first line `name<separator>value`, without quotes.
fn field(text: &str, name: &str, separator: char) -> Option<String> {
    let fields = text.lines().filter_map(|line| line.split_once(separator));
    let value = fields.into_iter().find(|(key, _)| key.trim() == name)?.1;
    Some(value.trim().trim_matches('"').to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_found() {
        assert_eq!(
            field("a\t: b\nmodel name\t: X 1 : y\n", "model name", ':').unwrap(),
            "X 1 : y"
        );
        assert_eq!(
            field("NAME=a\nPRETTY_NAME=\"b c\"\n", "PRETTY_NAME", '=').unwrap(),
            "b c"
        );
        assert_eq!(field("", "a", ':'), None);
        let host = Host::here();
        assert!(host.cores > 0 && !host.os.is_empty() && !host.hroc.is_empty());
    }
}
