//! What competes in a run, and what all that compete share.

use hroc_runtime::{DepthConvention, DeviceProfile, Grouping};

use crate::camera_path::CameraPath;
use crate::gpu_clock::ClockChoice;
use crate::registry::{Knobs, Method, Mode};
use crate::sampling::Sampling;
use crate::truth::TruthCache;

/// A method in one setting.
#[derive(Clone, Debug)]
pub struct Contender {
    /// Which method.
    pub method: &'static Method,
    /// One of its modes.
    pub mode: &'static Mode,
    /// The method's knobs.
    pub knobs: Knobs,
    /// How coarse the groups are, for a method that groups.
    pub grouping: Grouping,
    /// The split rule of the tree, for a method that reads one.
    pub split: String,
}

impl Contender {
    /// A method in one of its modes, otherwise by default: adaptive grouping, the SAH tree, knobs at their defaults.
    pub fn new(method: &'static Method, mode: &'static Mode) -> Self {
        Self {
            method,
            mode,
            knobs: Knobs::default(),
            grouping: Grouping::default(),
            split: "sah".to_owned(),
        }
    }

    /// The setting in words, as [`RunResults::label`](crate::results::RunResults::label) has it.
    pub fn label(&self) -> String {
        let tree = self.method.uses_tree;
        label(
            self.method.name,
            Some(self.mode.name).filter(|name| !name.is_empty()),
            self.method.groups.then(|| self.grouping.name()),
            tree.then_some(&self.split),
            self.knobs.turned().iter().copied(),
        )
    }
}

/// Method and mode, then what is not as by default.
pub(crate) fn label<'a>(
    method: &str,
    mode: Option<&str>,
    grouping: Option<&str>,
    split: Option<&str>,
    knobs: impl Iterator<Item = (&'a str, f64)>,
) -> String {
    let mut label = method.to_owned();
    let parts = [
        mode,
        grouping.filter(|&grouping| grouping != Grouping::default().name()),
        split.filter(|&split| split != "sah"),
    ];
    for part in parts.into_iter().flatten() {
        label.push(' ');
        label.push_str(part);
    }
    for (name, value) in knobs {
        label.push_str(&format!(" {name}={value}"));
    }
    label
}

/// What all contenders of a run share: the frames, and what is done with each.
#[derive(Clone, Debug)]
pub struct Course {
    /// Name of the scene in reports.
    pub scene_name: String,
    /// Name of the camera path in reports.
    pub path_name: String,
    /// Where the frames are seen from.
    pub path: CameraPath,
    /// How frames are taken from the path.
    pub sampling: Sampling,
    /// How many frames results include.
    pub frames: u32,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// How depth is stored.
    pub depth: DepthConvention,
    /// The device's paths, as probed or as forced.
    pub profile: DeviceProfile,
    /// What times the stages.
    pub clock: ClockChoice,
    /// Compare each frame with the truth.
    pub check: bool,
    /// How often the path is replayed for its times; 0 leaves out the replays that time and count work.
    pub repeats: u32,
    /// The counted frame whose overdraw is mapped, if any. Contenders whose knobs are turned have no map.
    pub overdraw_frame: Option<u32>,
    /// Where the truth is kept between runs, if anywhere.
    pub truth_cache: Option<TruthCache>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::method;

    #[test]
    fn a_label_names_what_is_not_the_default() {
        let hroc = method("hroc").unwrap();
        let mut contender = Contender::new(hroc, hroc.mode(Some("cr-late")).unwrap());
        assert_eq!(contender.label(), "hroc cr-late");
        contender.grouping = Grouping::Published;
        contender.split = "middle".into();
        contender.knobs = hroc.knobs(&["late-margin=1".to_owned()]).unwrap();
        assert_eq!(
            contender.label(),
            "hroc cr-late published middle late-margin=1"
        );
        let noc = method("noc").unwrap();
        assert_eq!(Contender::new(noc, &noc.modes[0]).label(), "noc");
    }
}
