//! The frames of a case that are drawn, by the sampling of the run.

use hroc_runtime::{Camera, Projection};

use super::{CaseFrame, CaseScene};
use crate::sampling::{Sampling, Schedule};

/// A frame to draw.
#[derive(Clone, Copy, Debug)]
pub(super) struct CaseStep {
    pub(super) frame: CaseFrame,
    /// Whether results include the frame.
    pub(super) counted: bool,
    /// Whether the methods of the frame's view forget their history before it.
    pub(super) forgets: bool,
}

/// The frames to draw of `case`.
///
/// With [`Sampling::Spread`] these are the listed frames. For windows and cuts the listed frames of a view are the keys
/// of a camera path, one each second; windows are taken along the path, and each listed frame comes after a cut. The
/// views take turns. A case whose objects move has one step of its objects for each listed frame and keeps its list.
///
/// # Errors
/// A message if the numbers of windows and frames contradict each other.
pub(super) fn steps(case: &CaseScene, sampling: Sampling) -> Result<Vec<CaseStep>, String> {
    if sampling == Sampling::Spread || case.motion.is_some() {
        let listed = case.frames.iter().map(|&frame| CaseStep {
            frame,
            counted: true,
            forgets: false,
        });
        return Ok(listed.collect());
    }
    let mut views = Vec::new();
    for view in 0..case.view_count() {
        let keys = case.frames.iter().filter(|frame| frame.view == view);
        let keys = keys.copied().collect::<Vec<_>>();
        if !keys.is_empty() {
            views.push(steps_of_view(&keys, sampling)?);
        }
    }
    let longest = views.iter().map(Vec::len).max().unwrap_or(0);
    let turns =
        (0..longest).flat_map(|number| views.iter().filter_map(move |view| view.get(number)));
    Ok(turns.copied().collect())
}

fn steps_of_view(keys: &[CaseFrame], sampling: Sampling) -> Result<Vec<CaseStep>, String> {
    let frames = match sampling {
        Sampling::Windows {
            windows,
            frames_per_window,
            ..
        } => windows.saturating_mul(frames_per_window),
        Sampling::Spread | Sampling::Cuts { .. } => keys.len() as u32,
    };
    let schedule = Schedule::over(sampling, frames, (keys.len() - 1) as f64)?;
    let steps = schedule.steps().map(|step| CaseStep {
        frame: frame_at(keys, step.t_s),
        counted: step.counted,
        forgets: step.age == 0 && step.history > 0,
    });
    Ok(steps.collect())
}

/// The frame `t_s` seconds after the first key. Keys with different kinds of projection are not blended.
fn frame_at(keys: &[CaseFrame], t_s: f64) -> CaseFrame {
    let t_s = t_s.clamp(0.0, (keys.len() - 1) as f64);
    let (key, share) = (t_s.floor() as usize, t_s.fract());
    let from = keys[key];
    let (true, Some(to)) = (share > 0.0, keys.get(key + 1)) else {
        return from;
    };
    let between = |a: f64, b: f64| a + share * (b - a);
    let (a, b) = (&from.camera, &to.camera);
    let projection = match (a.projection, b.projection) {
        (Projection::Perspective { fov_y_rad: a }, Projection::Perspective { fov_y_rad: b }) => {
            Projection::Perspective {
                fov_y_rad: between(a, b),
            }
        }
        (
            Projection::Orthographic { half_height: a },
            Projection::Orthographic { half_height: b },
        ) => Projection::Orthographic {
            half_height: between(a, b),
        },
        _ => return from,
    };
    CaseFrame {
        camera: Camera {
            position: a.position.lerp(b.position, share),
            orientation: a.orientation.slerp(b.orientation, share).normalize(),
            projection,
            ..*a
        },
        ..from
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hard_cases::{CASES, Scale, case};

    const WINDOWS: Sampling = Sampling::Windows {
        fps: 60.0,
        windows: 2,
        frames_per_window: 3,
        fill_frames: 2,
    };
    const CUTS: Sampling = Sampling::Cuts {
        fps: 60.0,
        fill_frames: 2,
    };

    #[test]
    fn every_case_has_its_listed_frames_and_can_be_sampled_otherwise() {
        for entry in CASES {
            let case = (entry.make)(Scale::Small);
            let cameras = |steps: &[CaseStep]| {
                let counted = steps.iter().filter(|step| step.counted);
                counted.map(|step| step.frame.camera).collect::<Vec<_>>()
            };
            let listed = case.frames.iter().map(|frame| frame.camera);
            let spread = steps(&case, Sampling::Spread).unwrap();
            assert_eq!(
                cameras(&spread),
                listed.collect::<Vec<_>>(),
                "{}",
                entry.name
            );
            let cuts = steps(&case, CUTS).unwrap();
            let windows = steps(&case, WINDOWS).unwrap();
            let views = case.frames.iter().map(|frame| frame.view);
            let views = views.collect::<std::collections::BTreeSet<_>>().len();
            if case.motion.is_some() {
                assert_eq!([cuts.len(), windows.len()], [spread.len(); 2]);
                continue;
            }
            assert_eq!(cuts.len(), 3 * case.frames.len(), "{}", entry.name);
            assert_eq!(cameras(&cuts).len(), case.frames.len());
            assert_eq!(windows.len(), views * 2 * (2 + 3), "{}", entry.name);
            let resets = windows.iter().filter(|step| step.forgets).count();
            assert_eq!(
                resets, views,
                "{}: the second window of each view",
                entry.name
            );
        }
    }

    #[test]
    fn frames_of_a_window_follow_the_listed_cameras() {
        let clutter = (case("clutter").unwrap().make)(Scale::Small);
        let steps = steps(&clutter, WINDOWS).unwrap();
        let [a, b] = [0, 1].map(|key: usize| clutter.frames[key].camera.position);
        for (step, age) in steps.iter().zip(0..5) {
            let expected = a.lerp(b, f64::from(age) / 60.0);
            assert!((step.frame.camera.position - expected).length() < 1e-12);
        }
    }
}
