//! Every culling method that the study can run. A new method is one entry of [`METHODS`].

use hroc_runtime::{
    CullingMethod, DepthConvention, Grouping, HostSync, Hroc, HrocOptions, Noc, Scene, Tree, device,
};
use wgpu::Features;

/// What a method is made of.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// Where it runs.
    pub device: &'a wgpu::Device,
    /// Its queue.
    pub queue: &'a wgpu::Queue,
    /// What it culls.
    pub scene: &'a Scene,
    /// The hierarchy over it; there for every method that [uses](Method::uses_tree) one.
    pub tree: Option<&'a Tree>,
    /// How depth is stored.
    pub depth: DepthConvention,
    /// One of the method's [`modes`](Method::modes); empty where it has none.
    pub mode: &'a str,
    /// How coarse the groups are, for a method that groups.
    pub grouping: Grouping,
    /// Counts work where the method can, see [`hroc_runtime::Sets::work`].
    pub count_work: bool,
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

/// A culling method as the study knows it.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// What it is and where it was published.
    pub source: &'static str,
    /// Whether its image is exact.
    pub exactness: Exactness,
    /// Whether the host waits for the GPU.
    pub host_sync: HostSync,
    /// Device features without which it does not run.
    pub features: Features,
    /// Names of its modes, the default first; empty where it has none.
    pub modes: &'static [&'static str],
    /// It reads the hierarchy.
    pub uses_tree: bool,
    /// It counts rays and ray-box tests if asked to.
    pub counts_work: bool,
    /// Makes it, with the history of a view that was never drawn.
    pub make: fn(&Parts<'_>) -> Box<dyn CullingMethod>,
}

/// The registry.
pub const METHODS: &[Method] = &[
    Method {
        name: "noc",
        source: "no culling: every object is drawn; the truth for all others",
        exactness: Exactness::Exact,
        host_sync: HostSync::Never,
        features: device::REQUIRED,
        modes: &[],
        uses_tree: false,
        counts_work: false,
        make: |parts| Box::new(Noc::new(parts.device, parts.scene, parts.depth)),
    },
    Method {
        name: "hroc",
        source: "hierarchical raster occlusion culling (Lee, Kwon, Lee, Computer Graphics Forum 40(2), 2021)",
        exactness: Exactness::Exact,
        host_sync: HostSync::Never,
        features: device::REQUIRED,
        modes: &["of"],
        uses_tree: true,
        counts_work: true,
        make: |parts| {
            let options = HrocOptions {
                depth: parts.depth,
                grouping: parts.grouping,
                count_work: parts.count_work,
                ..HrocOptions::default()
            };
            let tree = parts.tree.expect("uses_tree is set");
            Box::new(Hroc::new(
                parts.device,
                parts.queue,
                parts.scene,
                tree,
                options,
            ))
        },
    },
];

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
    /// The mode to run in: the one asked for, or the default. `None` for a method without modes.
    ///
    /// # Errors
    /// A message that lists the modes there are.
    pub fn mode(&self, asked: Option<&str>) -> Result<Option<&'static str>, String> {
        let Some(asked) = asked else {
            return Ok(self.modes.first().copied());
        };
        if let Some(mode) = self.modes.iter().find(|mode| **mode == asked) {
            return Ok(Some(mode));
        }
        Err(match self.modes {
            [] => format!(
                "method '{}' has no modes; leave out --mode {asked}",
                self.name
            ),
            modes => format!(
                "method '{}' has no mode '{asked}'; there is: {}",
                self.name,
                modes.join(", ")
            ),
        })
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

/// The registry as a Markdown table.
pub fn table() -> String {
    let rows = METHODS.iter().map(|method| {
        let modes = if method.modes.is_empty() {
            "-".to_owned()
        } else {
            method.modes.join(" ")
        };
        [
            method.name.to_owned(),
            modes,
            method.exactness.name().to_owned(),
            host_sync_name(method.host_sync).to_owned(),
            feature_names(method.features),
            method.source.to_owned(),
        ]
    });
    crate::table::markdown(
        ["method", "modes", "image", "host waits", "needs", "source"],
        rows,
    )
}

#[cfg(test)]
mod tests {
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
        assert_eq!(hroc.mode(None), Ok(Some("of")));
        assert_eq!(hroc.mode(Some("of")), Ok(Some("of")));
        assert!(hroc.mode(Some("fo")).unwrap_err().contains("of"));
        assert_eq!(noc.mode(None), Ok(None));
        assert!(noc.mode(Some("of")).unwrap_err().contains("leave out"));
    }
}
