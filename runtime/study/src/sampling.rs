//! Which frames of a camera path a run draws, and which of them it counts.
//!
//! What a method draws depends on the frames before, so the time between two frames is part of every result. An
//! application draws 60 or more frames a second, and little changes from one to the next. Frames spread over a whole
//! path lie a sixth of a second or more apart, where most of what a method draws needlessly comes from outdated
//! history.

use hroc_methods::ChcOptions;
use serde::{Deserialize, Serialize};

use crate::camera_path::{CameraPath, Cameras};

/// Uncounted frames at the start of a window: no method remembers more than these.
///
/// A method starts a window without history, and its first frame treats every object in view alike. Most methods read
/// the frame before, so their second frame is as in a long run. CHC++ remembers longest: it takes a visible object for
/// visible, without a query, for up to [`ChcOptions::assumed_visible`] frames. One frame more is for draw counts that
/// the host reads a frame late (`cr-late` of HROC).
pub const FILL_FRAMES: u32 = 2 + ChcOptions::CHC_PLUS_PLUS.assumed_visible;

/// How frames are taken from a camera path. README.md lists the fields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Sampling {
    /// Evenly from the first key to the last, with one history. Results without this field are of this kind.
    #[default]
    Spread,
    /// Windows of consecutive frames, spread evenly over the path, each with a history of its own.
    #[allow(missing_docs)]
    Windows {
        /// Frames per second of the path's time.
        fps: f64,
        windows: u32,
        frames_per_window: u32,
        /// Uncounted frames that lead to each window along the path.
        fill_frames: u32,
    },
    /// The frames of [`Spread`](Self::Spread), each right after a camera cut: its history holds only frames about the
    /// place that is half of the path's duration away.
    #[allow(missing_docs)]
    Cuts {
        fps: f64,
        /// Uncounted frames along the path that end at the place before the cut.
        fill_frames: u32,
    },
}

impl Sampling {
    /// Its name on the command line.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Spread => "spread",
            Self::Windows { .. } => "windows",
            Self::Cuts { .. } => "cuts",
        }
    }

    /// A clause for reports, about `frames` counted frames.
    pub fn describe(&self, frames: u32) -> String {
        match self {
            Self::Spread => format!("{frames} frames spread evenly over the path"),
            Self::Windows {
                fps,
                windows,
                frames_per_window,
                fill_frames,
            } => format!(
                "{frames} frames in {windows} windows of {frames_per_window} consecutive frames at {fps} frames a \
                 second, each after {fill_frames} uncounted frames"
            ),
            Self::Cuts { fps, fill_frames } => format!(
                "{frames} frames spread evenly over the path, each after a camera cut from {fill_frames} uncounted \
                 frames at {fps} frames a second about another place"
            ),
        }
    }
}

/// One frame to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Seconds after the path's first key. Before the first key and after the last one the camera rests.
    pub t_s: f64,
    /// The number of the counted frame, or of the one that an uncounted frame leads to.
    pub frame: u32,
    /// Whether results include the frame.
    pub counted: bool,
    /// Number of the history. Methods are reset where another one begins.
    pub history: u32,
    /// Frames drawn before with the same history.
    pub age: u32,
}

/// All frames to draw, in order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule {
    sampling: Sampling,
    frames: u32,
    duration_s: f64,
}

impl Schedule {
    /// The schedule of `frames` counted frames over `path`.
    ///
    /// # Errors
    /// A message if the numbers contradict each other, or if a cut would lead from a camera to the same camera.
    pub fn new(sampling: Sampling, frames: u32, path: &CameraPath) -> Result<Self, String> {
        let schedule = Self::over(sampling, frames, path.duration_s())?;
        if let Sampling::Cuts { .. } = sampling {
            let same = |&frame: &u32| {
                let t_s = schedule.spread_s(frame);
                path.camera_at(t_s) == path.camera_at(schedule.before_cut_s(t_s))
            };
            if let Some(frame) = (0..frames).find(same) {
                return Err(format!(
                    "--sampling cuts: half of this camera path's duration away from frame {frame} the camera is at \
                     the same place, so there is no cut; use --sampling windows or spread, or another path"
                ));
            }
        }
        Ok(schedule)
    }

    /// The schedule over a path of this duration.
    ///
    /// # Errors
    /// A message if the numbers contradict each other.
    pub(crate) fn over(sampling: Sampling, frames: u32, duration_s: f64) -> Result<Self, String> {
        let fps = match sampling {
            Sampling::Spread => 1.0,
            Sampling::Windows { fps, .. } | Sampling::Cuts { fps, .. } => fps,
        };
        if !(fps.is_finite() && fps > 0.0) {
            return Err(format!("{fps} frames per second; use a number above 0"));
        }
        if let Sampling::Windows {
            windows,
            frames_per_window,
            ..
        } = sampling
            && windows.checked_mul(frames_per_window) != Some(frames)
        {
            return Err(format!(
                "{windows} windows of {frames_per_window} frames are not {frames} frames"
            ));
        }
        Ok(Self {
            sampling,
            frames,
            duration_s,
        })
    }

    /// Counted and uncounted frames of each history.
    fn history(&self) -> (u32, u32) {
        match self.sampling {
            Sampling::Spread => (self.frames, 0),
            Sampling::Windows {
                frames_per_window,
                fill_frames,
                ..
            } => (frames_per_window, fill_frames),
            Sampling::Cuts { fill_frames, .. } => (1, fill_frames),
        }
    }

    /// The number of frames to draw.
    pub fn len(&self) -> u64 {
        let (counted, fill) = self.history();
        let histories = self.frames / counted.max(1);
        u64::from(histories) * (u64::from(counted) + u64::from(fill))
    }

    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The frames, in order.
    pub fn steps(&self) -> impl Iterator<Item = Step> + use<> {
        let schedule = *self;
        (0..self.len()).map(move |number| schedule.step(number))
    }

    /// Frame `number` in the order of drawing.
    fn step(&self, number: u64) -> Step {
        let (counted, fill) = self.history();
        let length = u64::from(counted) + u64::from(fill);
        let (history, age) = ((number / length) as u32, (number % length) as u32);
        let frame = history * counted + age.saturating_sub(fill);
        // Frames after the first counted one of this history; below 0 for uncounted ones.
        let place = f64::from(age) - f64::from(fill);
        let t_s = match self.sampling {
            Sampling::Spread => self.spread_s(frame),
            Sampling::Windows { fps, .. } => self.window_s(history) + place / fps,
            Sampling::Cuts { fps, .. } if age < fill => {
                self.before_cut_s(self.spread_s(frame)) + (place + 1.0) / fps
            }
            Sampling::Cuts { .. } => self.spread_s(frame),
        };
        Step {
            t_s,
            frame,
            counted: age >= fill,
            history,
            age,
        }
    }

    /// When frame `frame` of frames that are spread evenly is.
    fn spread_s(&self, frame: u32) -> f64 {
        let steps = f64::from(self.frames.saturating_sub(1).max(1));
        self.duration_s * f64::from(frame) / steps
    }

    /// When the last frame before a cut to `t_s` is.
    fn before_cut_s(&self, t_s: f64) -> f64 {
        let half = 0.5 * self.duration_s;
        if t_s < half { t_s + half } else { t_s - half }
    }

    /// When the first counted frame of a window is. The uncounted frames of the first window and the counted ones of
    /// the last window reach the ends of the path; a lone window lies in the middle.
    fn window_s(&self, window: u32) -> f64 {
        let Sampling::Windows {
            fps,
            windows,
            frames_per_window,
            fill_frames,
        } = self.sampling
        else {
            return 0.0;
        };
        let last = (self.duration_s - f64::from(frames_per_window - 1) / fps).max(0.0);
        let first = (f64::from(fill_frames) / fps).min(last);
        let share = match windows {
            0 | 1 => 0.5,
            _ => f64::from(window) / f64::from(windows - 1),
        };
        first + share * (last - first)
    }

    /// How long the windows are together, seconds, if the path has no room for that: windows then overlap, or the
    /// camera rests at the end of the path. A lone window of a camera that never moves is not meant to move.
    pub fn too_long_s(&self) -> Option<f64> {
        let Sampling::Windows { fps, windows, .. } = self.sampling else {
            return None;
        };
        let together = f64::from(self.frames.saturating_sub(1)) / fps;
        let still = self.duration_s == 0.0 && windows == 1;
        (together > self.duration_s && !still).then_some(together)
    }

    /// Number of the window that a counted frame belongs to; `None` where there are no windows.
    pub fn window(&self, step: &Step) -> Option<u32> {
        matches!(self.sampling, Sampling::Windows { .. }).then_some(step.history)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera_path::{Key, ProjectionKind};

    const WINDOWS: Sampling = Sampling::Windows {
        fps: 60.0,
        windows: 3,
        frames_per_window: 4,
        fill_frames: 2,
    };
    const CUTS: Sampling = Sampling::Cuts {
        fps: 60.0,
        fill_frames: 2,
    };

    fn steps(sampling: Sampling, frames: u32, duration_s: f64) -> Vec<Step> {
        let schedule = Schedule::over(sampling, frames, duration_s).unwrap();
        let steps = schedule.steps().collect::<Vec<_>>();
        assert_eq!(schedule.len(), steps.len() as u64);
        let counted = steps.iter().filter(|step| step.counted);
        let numbers = counted.map(|step| step.frame).collect::<Vec<_>>();
        assert_eq!(numbers, (0..frames).collect::<Vec<_>>());
        for step in &steps {
            assert!(step.t_s <= duration_s.max(1.0), "{step:?}");
        }
        steps
    }

    #[test]
    fn frames_of_a_window_are_consecutive_and_windows_reach_the_ends() {
        let steps = steps(WINDOWS, 12, 10.0);
        assert_eq!(steps.len(), 3 * (2 + 4));
        for window in steps.chunks(6) {
            for (age, step) in window.iter().enumerate() {
                assert_eq!(
                    (step.age as usize, step.counted, step.history),
                    (age, age >= 2, window[0].history)
                );
                let from_first = step.t_s - window[0].t_s;
                assert!((from_first - age as f64 / 60.0).abs() < 1e-12);
            }
        }
        assert_eq!(steps[0].t_s, 0.0);
        assert!((steps[17].t_s - 10.0).abs() < 1e-12);
        assert!((steps[8].t_s - steps[2].t_s - (steps[14].t_s - steps[8].t_s)).abs() < 1e-12);
    }

    #[test]
    fn a_path_without_room_for_the_windows_is_told() {
        let schedule = |windows, frames_per_window, duration_s| {
            let sampling = Sampling::Windows {
                fps: 60.0,
                windows,
                frames_per_window,
                fill_frames: 2,
            };
            let frames = windows * frames_per_window;
            let steps = steps(sampling, frames, duration_s);
            let first = steps.iter().find(|step| step.counted).unwrap().t_s;
            let told = Schedule::over(sampling, frames, duration_s)
                .unwrap()
                .too_long_s()
                .is_some();
            (first, told)
        };
        // One window in the middle; a path shorter than a window; one key; overlapping windows.
        assert_eq!(schedule(1, 1, 2.0), (1.0 + 1.0 / 60.0, false));
        assert_eq!(schedule(1, 60, 0.5), (0.0, true));
        assert_eq!(schedule(1, 10, 0.0), (0.0, false));
        assert_eq!(schedule(2, 10, 0.0), (0.0, true));
        assert!(schedule(6, 10, 0.9).1 && !schedule(6, 10, 1.0).1);
    }

    #[test]
    fn spread_frames_have_one_history_and_cuts_come_from_the_other_half() {
        let spread = steps(Sampling::Spread, 5, 8.0);
        let times = spread.iter().map(|step| step.t_s).collect::<Vec<_>>();
        assert_eq!(times, [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert!(spread.iter().all(|step| step.history == 0 && step.counted));
        let cuts = steps(CUTS, 5, 8.0);
        assert_eq!(cuts.len(), 5 * 3);
        for (cut, spread) in cuts.chunks(3).zip(&spread) {
            assert_eq!((cut[2].t_s, cut[2].frame), (spread.t_s, spread.frame));
            assert!(cut[1].t_s == spread.t_s + 4.0 || cut[1].t_s == spread.t_s - 4.0);
            assert!((cut[1].t_s - cut[0].t_s - 1.0 / 60.0).abs() < 1e-12);
            assert!(cut.iter().all(|step| step.history == spread.frame));
        }
    }

    #[test]
    fn contradictions_are_refused() {
        assert!(Schedule::over(WINDOWS, 11, 1.0).is_err());
        let fps = |fps| Sampling::Cuts {
            fps,
            fill_frames: 1,
        };
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Schedule::over(fps(wrong), 1, 1.0).is_err());
        }
        let key = |t_s: f64, x: f64| Key {
            t_s,
            position: [x, 0.0, 0.0],
            orientation: [0.0, 0.0, 0.0, 1.0],
            fov_y_rad: Some(1.0),
            half_height: None,
        };
        let path = |keys| CameraPath::new(ProjectionKind::Perspective, 0.1, None, keys).unwrap();
        let still = path(vec![key(0.0, 0.0)]);
        let refused = Schedule::new(CUTS, 3, &still).unwrap_err();
        assert!(refused.contains("frame 0"), "{refused}");
        Schedule::new(CUTS, 3, &path(vec![key(0.0, 0.0), key(1.0, 1.0)])).unwrap();
        Schedule::new(Sampling::Spread, 3, &still).unwrap();
    }
}
