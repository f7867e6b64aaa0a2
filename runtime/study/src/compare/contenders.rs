//! Who competes.

use hroc_format::ArchivedScene;
use hroc_runtime::Grouping;

use super::unique;
use crate::registry::{Knob, Method, Mode, acts_in};
use crate::run::Contender;

/// Which trees are used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Splits {
    /// Every one in the scene.
    Baked,
    /// Those of these split rules.
    Named(Vec<String>),
}

impl Splits {
    /// The split rules for `scene`.
    pub fn of(&self, scene: &ArchivedScene) -> Vec<String> {
        match self {
            Self::Baked => scene
                .bvhs
                .iter()
                .map(|bvh| bvh.split.as_str().to_owned())
                .collect(),
            Self::Named(names) => names.clone(),
        }
    }
}

/// Settings, of which every combination that means something competes.
#[derive(Clone, Debug)]
pub struct Selection {
    /// Which methods.
    pub methods: Vec<&'static Method>,
    /// Names of modes, of which a method runs those it has, or its default if it has none of them; empty: the
    /// default.
    pub modes: Vec<String>,
    /// Every mode of every method.
    pub all_modes: bool,
    /// For methods that group.
    pub groupings: Vec<Grouping>,
    /// For methods that read a tree.
    pub splits: Splits,
    /// One contender more for each value in the sweep of each knob.
    pub sweep: bool,
}

impl Selection {
    /// That the modes are some method's.
    ///
    /// # Errors
    /// A message that lists those there are.
    pub fn check(&self) -> Result<(), String> {
        let known = || {
            self.methods
                .iter()
                .flat_map(|method| method.modes)
                .map(|mode| mode.name)
        };
        let unknown = self
            .modes
            .iter()
            .find(|&mode| !known().any(|name| name == mode));
        let Some(unknown) = unknown else {
            return Ok(());
        };
        let names = unique(known().filter(|name| !name.is_empty()));
        Err(if names.is_empty() {
            format!("--modes {unknown}: none of these methods has modes; leave it out")
        } else {
            format!(
                "no mode '{unknown}' in these methods; there is: {}, or all",
                names.join(", ")
            )
        })
    }

    fn modes_of(&self, method: &'static Method) -> Vec<&'static Mode> {
        let named = |name: &String| method.modes.iter().find(|mode| mode.name == *name);
        let modes = match self.all_modes {
            true => method.modes.iter().collect(),
            false => self.modes.iter().filter_map(named).collect::<Vec<_>>(),
        };
        if modes.is_empty() {
            vec![&method.modes[0]]
        } else {
            modes
        }
    }

    /// The contenders over `scene`, method by method.
    pub fn contenders(&self, scene: &ArchivedScene) -> Vec<Contender> {
        let splits = self.splits.of(scene);
        let mut contenders = Vec::new();
        for &method in &self.methods {
            let modes = self.modes_of(method);
            let once = [Grouping::default()];
            let groupings = if method.groups {
                &self.groupings[..]
            } else {
                &once
            };
            let none = [String::new()];
            let splits = if method.uses_tree { &splits[..] } else { &none };
            for &grouping in groupings {
                for split in splits {
                    let contender = |mode| Contender {
                        grouping,
                        split: split.clone(),
                        ..Contender::new(method, mode)
                    };
                    contenders.extend(modes.iter().map(|mode| contender(mode)));
                    if self.sweep {
                        let knobs = method.knobs.iter();
                        contenders
                            .extend(knobs.flat_map(|knob| sweep(knob, method, &modes, contender)));
                    }
                }
            }
        }
        contenders
    }
}

/// The contenders of one knob, in those of `modes` in which it does anything, or else in the first mode in which it
/// does. The default stands already where the mode runs without the sweep.
fn sweep(
    knob: &'static Knob,
    method: &'static Method,
    modes: &[&'static Mode],
    contender: impl Fn(&'static Mode) -> Contender,
) -> Vec<Contender> {
    let acting = |modes: &mut dyn Iterator<Item = &'static Mode>| {
        modes.filter(|mode| acts_in(knob, mode)).collect::<Vec<_>>()
    };
    let chosen = acting(&mut modes.iter().copied());
    let mut swept = Vec::new();
    if chosen.is_empty() {
        let first = acting(&mut method.modes.iter()).into_iter().take(1);
        // The point that the sweep is about.
        for mode in first.filter(|_| !knob.sweep.is_empty()) {
            swept.push(contender(mode));
            swept.extend(turned(knob, contender(mode)));
        }
    }
    swept.extend(
        chosen
            .into_iter()
            .flat_map(|mode| turned(knob, contender(mode))),
    );
    swept
}

fn turned(knob: &'static Knob, base: Contender) -> impl Iterator<Item = Contender> {
    let values = knob.sweep.iter().filter(|&&value| value != knob.default);
    values.map(move |&value| {
        let mut contender = base.clone();
        contender.knobs.set(knob, value);
        contender
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::method;
    use hroc_format::{BakedScene, Check, Scene, to_bytes};

    fn selection(methods: &[&str]) -> Selection {
        Selection {
            methods: methods.iter().map(|name| method(name).unwrap()).collect(),
            modes: Vec::new(),
            all_modes: false,
            groupings: vec![Grouping::default()],
            splits: Splits::Named(vec!["sah".into()]),
            sweep: false,
        }
    }

    fn labels(selection: &Selection) -> Vec<String> {
        let file = to_bytes(&Scene::default()).unwrap();
        let scene = BakedScene::from_aligned(file, Check::Ranges).unwrap();
        let contenders = selection.contenders(scene.scene());
        contenders.iter().map(Contender::label).collect()
    }

    #[test]
    fn a_method_runs_in_its_default_mode_or_in_those_asked_for() {
        let mut selection = selection(&["noc", "hroc"]);
        assert_eq!(labels(&selection), ["noc", "hroc of"]);
        selection.modes = vec!["na".into(), "cr".into()];
        assert_eq!(labels(&selection), ["noc", "hroc na", "hroc cr"]);
        selection.all_modes = true;
        assert_eq!(labels(&selection).len(), 7);
        selection.check().unwrap();
        selection.modes = vec!["fo".into()];
        assert!(selection.check().unwrap_err().contains("of, na"));
        selection.methods.pop();
        assert!(selection.check().unwrap_err().contains("leave it out"));
    }

    #[test]
    fn groupings_and_trees_multiply_what_uses_them() {
        let mut selection = selection(&["noc", "hroc"]);
        selection.groupings.push(Grouping::Published);
        selection.splits = Splits::Named(vec!["sah".into(), "middle".into()]);
        let expected = [
            "noc",
            "hroc of",
            "hroc of middle",
            "hroc of published",
            "hroc of published middle",
        ];
        assert_eq!(labels(&selection), expected);
        selection.splits = Splits::Baked;
        assert_eq!(labels(&selection), ["noc"], "this scene has no trees");
    }

    #[test]
    fn a_sweep_turns_one_knob_at_a_time_where_it_does_anything() {
        let mut selection = selection(&["hroc"]);
        selection.sweep = true;
        let margins = ["0", "0.05", "1", "4"];
        let of = |mode: &str| margins.map(|margin| format!("hroc {mode} late-margin={margin}"));
        let mut expected = vec!["hroc of".to_owned(), "hroc cr-late".to_owned()];
        expected.extend(of("cr-late"));
        assert_eq!(labels(&selection), expected);
        selection.modes = vec!["cr-late-exact".into()];
        expected = vec!["hroc cr-late-exact".to_owned()];
        expected.extend(of("cr-late-exact"));
        assert_eq!(labels(&selection), expected);
    }
}
