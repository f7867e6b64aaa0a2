//! Every culling method that the study can run. A new method is one entry of [`METHODS`], in methods.rs.

mod knobs;
mod methods;

use hroc_format::ArchivedScene;
use hroc_methods::Recorded;
use hroc_runtime::{CullingMethod, DepthConvention, Grouping, HostSync, Scene, Tree};
use wgpu::Features;

pub use methods::METHODS;

/// What a method is made of.
#[derive(Clone, Copy)]
pub struct Parts<'a> {
    /// Where it runs.
    pub device: &'a wgpu::Device,
    /// Its queue.
    pub queue: &'a wgpu::Queue,
    /// What it culls.
    pub scene: &'a Scene,
    /// The same on the host, for a method that culls there.
    pub baked: &'a ArchivedScene,
    /// The hierarchy over it; there for every method that [uses](Method::uses_tree) one.
    pub tree: Option<&'a Tree>,
    /// How depth is stored.
    pub depth: DepthConvention,
    /// One of the method's [`modes`](Method::modes); the name of one that has none is empty.
    pub mode: &'a str,
    /// How coarse the groups are, for a method that groups.
    pub grouping: Grouping,
    /// Values of the method's [`knobs`](Method::knobs).
    pub knobs: &'a Knobs,
    /// What shows in the frame to come, for a method that [is told](Method::is_told).
    pub recorded: &'a Recorded,
    /// Counts work where the method can, see [`hroc_runtime::Sets::work`].
    pub count_work: bool,
}

impl<'a> Parts<'a> {
    /// The hierarchy, for a method that uses one.
    fn tree(&self) -> &'a Tree {
        self.tree.expect("uses_tree is set")
    }
}

/// Whether a method's image is that of no culling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exactness {
    /// Every visible object is drawn: a wrong pixel is a failure.
    Exact,
    /// May miss objects: its errors are reported.
    Approximate,
}

impl Exactness {
    /// `exact` or `approximate`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Approximate => "approximate",
        }
    }
}

/// A mode of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    /// Name on the command line and in reports; empty for the one mode of a method without modes.
    pub name: &'static str,
    /// Whether its image is exact.
    pub exactness: Exactness,
    /// Whether the host waits for the GPU.
    pub host_sync: HostSync,
}

impl Mode {
    /// As a column of a table: `-` for the mode of a method without modes.
    pub const fn label(&self) -> &'static str {
        if self.name.is_empty() { "-" } else { self.name }
    }
}

/// A number that trades speed against error or work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knob {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// What it does, with its unit.
    pub help: &'static str,
    /// Where it stands if nobody turns it.
    pub default: f64,
    /// Where a sweep puts it.
    pub sweep: &'static [f64],
}

/// Values of knobs that differ from their defaults.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Knobs(Vec<(&'static str, f64)>);

impl Knobs {
    /// Turns a knob.
    pub fn set(&mut self, knob: &Knob, value: f64) {
        self.0.retain(|(name, _)| *name != knob.name);
        self.0.push((knob.name, value));
    }

    /// Where a knob stands.
    pub fn get(&self, knob: &Knob) -> f64 {
        let set = self.0.iter().find(|(name, _)| *name == knob.name);
        set.map_or(knob.default, |(_, value)| *value)
    }

    /// The knobs that were turned.
    pub fn turned(&self) -> &[(&'static str, f64)] {
        &self.0
    }
}

/// The modes in which a knob does anything. One that is not listed does so in all.
const KNOB_MODES: &[(&str, &[&str])] = &[(knobs::LATE_MARGIN.name, &["cr-late", "cr-late-exact"])];

/// Whether `knob` does anything in `mode`.
pub fn acts_in(knob: &Knob, mode: &Mode) -> bool {
    let listed = KNOB_MODES.iter().find(|(name, _)| *name == knob.name);
    listed.is_none_or(|(_, modes)| modes.contains(&mode.name))
}

/// A culling method as the study knows it.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// What it is and where it was published.
    pub source: &'static str,
    /// Device features without which it does not run.
    pub features: Features,
    /// Its modes, the default first.
    pub modes: &'static [Mode],
    /// Its knobs.
    pub knobs: &'static [Knob],
    /// It reads the hierarchy.
    pub uses_tree: bool,
    /// It makes groups of the nodes of the hierarchy, coarse or fine.
    pub groups: bool,
    /// It is told beforehand what shows in each frame.
    pub is_told: bool,
    /// It counts rays and ray-box tests if asked to.
    pub counts_work: bool,
    /// Makes it, with the history of a view that was never drawn.
    pub make: fn(&Parts<'_>) -> Box<dyn CullingMethod>,
}

/// The method called `name`.
///
/// # Errors
/// A message that lists the ones there are.
pub fn method(name: &str) -> Result<&'static Method, String> {
    METHODS
        .iter()
        .find(|method| method.name == name)
        .ok_or_else(|| {
            let known = METHODS
                .iter()
                .map(|method| method.name)
                .collect::<Vec<_>>()
                .join(", ");
            format!("no culling method '{name}'; there is: {known} (see hroc methods)")
        })
}

impl Method {
    /// The mode to run in: the one asked for, or the default.
    ///
    /// # Errors
    /// A message that lists the modes there are.
    pub fn mode(&self, asked: Option<&str>) -> Result<&'static Mode, String> {
        let Some(asked) = asked else {
            return Ok(&self.modes[0]);
        };
        let named = |mode: &&Mode| !mode.name.is_empty() && mode.name == asked;
        if let Some(mode) = self.modes.iter().find(named) {
            return Ok(mode);
        }
        Err(match self.modes {
            [only] if only.name.is_empty() => format!(
                "method '{}' has no modes; leave out --mode {asked}",
                self.name
            ),
            modes => format!(
                "method '{}' has no mode '{asked}'; there is: {}",
                self.name,
                modes
                    .iter()
                    .map(|mode| mode.name)
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
        })
    }

    /// Knobs turned as `NAME=VALUE` says.
    ///
    /// # Errors
    /// A message that lists the knobs there are.
    pub fn knobs(&self, turned: &[String]) -> Result<Knobs, String> {
        let mut knobs = Knobs::default();
        for text in turned {
            let (name, value) = text
                .split_once('=')
                .ok_or_else(|| format!("--knob {text}: NAME=VALUE is wanted"))?;
            let knob = self
                .knobs
                .iter()
                .find(|knob| knob.name == name)
                .ok_or_else(|| {
                    let known = self.knobs.iter().map(|knob| knob.name).collect::<Vec<_>>();
                    match known.as_slice() {
                        [] => format!(
                            "method '{}' has no knobs; leave out --knob {text}",
                            self.name
                        ),
                        known => format!(
                            "method '{}' has no knob '{name}'; there is: {}",
                            self.name,
                            known.join(", ")
                        ),
                    }
                })?;
            // Methods take many of them as f32, which has no place for more.
            let value = value
                .parse::<f64>()
                .ok()
                .filter(|&v| (v as f32).is_finite() && v >= 0.0);
            knobs.set(
                knob,
                value.ok_or_else(|| format!("--knob {text}: a number from 0 to 3e38 is wanted"))?,
            );
        }
        Ok(knobs)
    }
}

/// How a method waits, for people.
pub const fn host_sync_name(sync: HostSync) -> &'static str {
    match sync {
        HostSync::Never => "never",
        HostSync::NextFrame => "next-frame",
        HostSync::MidFrame => "mid-frame",
    }
}

/// Names of features, for people.
pub fn feature_names(features: Features) -> String {
    features
        .iter_names()
        .map(|(name, _)| name)
        .collect::<Vec<_>>()
        .join(" ")
}

/// The registry as Markdown: a row per mode, then the knobs.
pub fn table() -> String {
    let rows = METHODS.iter().flat_map(|method| {
        method.modes.iter().map(|mode| {
            [
                method.name.to_owned(),
                mode.label().to_owned(),
                mode.exactness.name().to_owned(),
                host_sync_name(mode.host_sync).to_owned(),
                feature_names(method.features),
                method.source.to_owned(),
            ]
        })
    });
    let methods = crate::table::markdown(
        ["method", "mode", "image", "host waits", "needs", "source"],
        rows,
    );
    let rows = METHODS.iter().flat_map(|method| {
        method.knobs.iter().map(|knob| {
            [
                method.name.to_owned(),
                knob.name.to_owned(),
                if knob.default.is_nan() {
                    "see there".to_owned()
                } else {
                    knob.default.to_string()
                },
                knob.help.to_owned(),
            ]
        })
    });
    let knobs = crate::table::markdown(["method", "knob", "default", "what it does"], rows);
    format!("{methods}\n{knobs}")
}

#[cfg(test)]
mod tests {
    use hroc_runtime::HrocMode;

    use super::knobs::LATE_MARGIN;
    use super::*;

    #[test]
    fn names_are_unique_and_found() {
        for (i, entry) in METHODS.iter().enumerate() {
            assert_eq!(
                METHODS.iter().position(|other| other.name == entry.name),
                Some(i)
            );
            assert_eq!(method(entry.name).unwrap().name, entry.name);
            assert!(table().contains(entry.source));
        }
        let unknown = method("hrok").unwrap_err();
        assert!(METHODS.iter().all(|entry| unknown.contains(entry.name)));
    }

    #[test]
    fn modes_are_checked() {
        let [noc, hroc] = ["noc", "hroc"].map(|name| method(name).unwrap());
        assert_eq!(hroc.mode(None).unwrap().name, "of");
        assert_eq!(hroc.mode(Some("cr-of")).unwrap().name, "cr-of");
        assert!(hroc.mode(Some("fo")).unwrap_err().contains("of"));
        assert_eq!(noc.mode(None).unwrap().name, "");
        assert!(noc.mode(Some("")).is_err());
        assert!(noc.mode(Some("of")).unwrap_err().contains("leave out"));
    }
    #[test]
    fn knobs_are_checked() {
        let hroc = method("hroc").unwrap();
        let turned = |text: &str| hroc.knobs(&[text.to_owned()]);
        assert_eq!(turned("late-margin=2").unwrap().get(&LATE_MARGIN), 2.0);
        assert_eq!(
            hroc.knobs(&[]).unwrap().get(&LATE_MARGIN),
            LATE_MARGIN.default
        );
        for wrong in [
            "late-margin",
            "late-margin=-1",
            "late-margin=nan",
            "box-cost=1e39",
            "margin=1",
        ] {
            assert!(turned(wrong).is_err(), "{wrong}");
        }
        assert!(turned("margin=1").unwrap_err().contains("late-margin"));
        assert!(
            method("noc")
                .unwrap()
                .knobs(&["a=1".to_owned()])
                .unwrap_err()
                .contains("no knobs")
        );
    }

    #[test]
    fn modes_say_of_themselves_what_the_methods_say() {
        for mode in method("hroc").unwrap().modes {
            let found = HrocMode::ALL
                .into_iter()
                .find(|m| m.name() == mode.name)
                .unwrap();
            assert_eq!(mode.host_sync, found.host_sync());
        }
    }
}
