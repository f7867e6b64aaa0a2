//! Which frames of a camera path a command takes.

use clap::{Args, ValueEnum};

use crate::error::StudyError;
use crate::sampling::{FILL_FRAMES, Sampling};

const FPS: f64 = 60.0;
const WINDOWS: u32 = 6;
const FRAMES_PER_WINDOW: u32 = 10;

/// Options of the commands that draw the frames of a camera path.
#[derive(Debug, Args)]
pub(super) struct SamplingArguments {
    /// How frames are taken from the camera path, or from the frames of a hard case; windows if left out, for
    /// hard-cases spread, which are a case's own frames.
    #[arg(long, value_enum)]
    sampling: Option<Kind>,
    /// Number of frames that results include; with windows, the number of windows times their frames. 60 if left
    /// out.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: Option<u32>,
    /// Frames per second of the path's time, for windows and for the frames before a cut; 60 if left out.
    #[arg(long, value_name = "FPS", value_parser = parse_fps)]
    fps: Option<f64>,
    /// Number of windows; 6 if left out, or what the number of frames asks for.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    windows: Option<u32>,
    /// Consecutive frames in each window; 10 if left out, or what the number of frames asks for.
    #[arg(long, value_name = "L", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames_per_window: Option<u32>,
}

/// `--sampling`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Windows of consecutive frames, each after uncounted frames that fill the method's history.
    Windows,
    /// Frames spread evenly over the path, usually far apart.
    Spread,
    /// As spread, but each frame comes right after a cut from another place of the path.
    Cuts,
}

fn parse_fps(text: &str) -> Result<f64, String> {
    let fps = text.parse::<f64>().ok();
    fps.filter(|fps| (1e-3..=1e6).contains(fps))
        .ok_or_else(|| "frames per second, from 0.001 to 1000000, as in 60".to_owned())
}

impl SamplingArguments {
    /// The sampling of a camera path and the number of counted frames.
    pub(super) fn resolve(&self) -> Result<(Sampling, u32), StudyError> {
        self.resolve_as(self.sampling.unwrap_or(Kind::Windows))
    }

    /// The sampling of hard cases, which have their own number of frames where there are no windows.
    pub(super) fn resolve_for_cases(&self) -> Result<Sampling, StudyError> {
        let kind = self.sampling.unwrap_or(Kind::Spread);
        if kind != Kind::Windows && self.frames.is_some() {
            return Err(StudyError::Usage(
                "--frames: each hard case has its own frames; leave it out or use --sampling windows".to_owned(),
            ));
        }
        Ok(self.resolve_as(kind)?.0)
    }

    fn resolve_as(&self, kind: Kind) -> Result<(Sampling, u32), StudyError> {
        let fps = self.fps.unwrap_or(FPS);
        let default_frames = WINDOWS * FRAMES_PER_WINDOW;
        let unused = [
            ("--windows", self.windows.is_some()),
            ("--frames-per-window", self.frames_per_window.is_some()),
            ("--fps", self.fps.is_some() && kind == Kind::Spread),
        ];
        match kind {
            Kind::Windows => {
                let (windows, frames_per_window) = self.window_counts()?;
                let frames = windows * frames_per_window;
                let sampling = Sampling::Windows {
                    fps,
                    windows,
                    frames_per_window,
                    fill_frames: FILL_FRAMES,
                };
                return Ok((sampling, frames));
            }
            Kind::Spread | Kind::Cuts => {
                if let Some((option, _)) = unused.into_iter().find(|(_, given)| *given) {
                    let kind = kind.to_possible_value().expect("no kind is hidden");
                    return Err(StudyError::Usage(format!(
                        "{option} does not apply to --sampling {}; leave it out or use --sampling windows",
                        kind.get_name()
                    )));
                }
            }
        }
        let frames = self.frames.unwrap_or(default_frames);
        let sampling = match kind {
            Kind::Cuts => Sampling::Cuts {
                fps,
                fill_frames: FILL_FRAMES,
            },
            _ => Sampling::Spread,
        };
        Ok((sampling, frames))
    }

    /// The number of windows and of frames in each.
    fn window_counts(&self) -> Result<(u32, u32), StudyError> {
        let contradiction = |text: String| Err(StudyError::Usage(text));
        let counts = match (self.frames, self.windows, self.frames_per_window) {
            (None, windows, length) => (
                windows.unwrap_or(WINDOWS),
                length.unwrap_or(FRAMES_PER_WINDOW),
            ),
            (Some(frames), None, None) => {
                let length = nearest_divisor(frames, FRAMES_PER_WINDOW);
                (frames / length, length)
            }
            (Some(frames), Some(windows), None) if frames % windows == 0 => {
                (windows, frames / windows)
            }
            (Some(frames), None, Some(length)) if frames % length == 0 => (frames / length, length),
            (Some(frames), Some(windows), Some(length))
                if u64::from(windows) * u64::from(length) == u64::from(frames) =>
            {
                (windows, length)
            }
            (Some(frames), windows, length) => {
                let windows = windows.map(|windows| format!(" in {windows} windows"));
                let length = length.map(|length| format!(" of {length} frames each"));
                return contradiction(format!(
                    "--frames {frames}: there cannot be {frames} frames{}{}; leave --frames out, or give the number \
                     of windows times the frames of each",
                    windows.unwrap_or_else(|| " in windows".to_owned()),
                    length.unwrap_or_else(|| " of equally many frames".to_owned()),
                ));
            }
        };
        let frames = u64::from(counts.0) * u64::from(counts.1);
        if frames > 1_000_000 {
            return contradiction(format!(
                "{} windows of {} frames are {frames} frames; at most 1000000 are possible",
                counts.0, counts.1
            ));
        }
        Ok(counts)
    }
}

/// The divisor of `frames` whose ratio to `wanted` is nearest to 1; the larger one of two.
fn nearest_divisor(frames: u32, wanted: u32) -> u32 {
    let ratio = |&divisor: &u32| {
        let [divisor, wanted] = [divisor, wanted].map(f64::from);
        (divisor / wanted).max(wanted / divisor)
    };
    let divisors = (1..=frames)
        .rev()
        .filter(|divisor| frames.is_multiple_of(*divisor));
    divisors
        .min_by(|a, b| ratio(a).total_cmp(&ratio(b)))
        .unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolve(sampling: Kind, numbers: [Option<u32>; 3]) -> Result<(Sampling, u32), String> {
        let [frames, windows, frames_per_window] = numbers;
        let arguments = SamplingArguments {
            sampling: Some(sampling),
            frames,
            fps: None,
            windows,
            frames_per_window,
        };
        arguments.resolve().map_err(|error| error.to_string())
    }

    #[test]
    fn windows_times_their_frames_are_the_frames() {
        let counts = |numbers| {
            let (sampling, frames) = resolve(Kind::Windows, numbers)?;
            let Sampling::Windows {
                windows,
                frames_per_window,
                ..
            } = sampling
            else {
                panic!("{sampling:?}");
            };
            assert_eq!(windows * frames_per_window, frames);
            Ok::<_, String>([windows, frames_per_window])
        };
        for (given, expected) in [
            ([None, None, None], [6, 10]),
            ([Some(60), None, None], [6, 10]),
            ([Some(100), None, None], [10, 10]),
            ([Some(24), None, None], [2, 12]),
            ([Some(1), None, None], [1, 1]),
            ([Some(13), None, None], [1, 13]),
            ([None, Some(3), None], [3, 10]),
            ([None, None, Some(4)], [6, 4]),
            ([Some(12), Some(3), None], [3, 4]),
            ([Some(12), None, Some(3)], [4, 3]),
            ([Some(12), Some(2), Some(6)], [2, 6]),
        ] {
            assert_eq!(counts(given), Ok(expected), "{given:?}");
        }
        for wrong in [
            [Some(10), Some(3), None],
            [Some(10), None, Some(4)],
            [Some(12), Some(2), Some(5)],
            [None, Some(1001), Some(1000)],
        ] {
            counts(wrong).unwrap_err();
        }
    }

    #[test]
    fn other_samplings_have_no_windows() {
        let spread = resolve(Kind::Spread, [Some(7), None, None]);
        assert_eq!(spread, Ok((Sampling::Spread, 7)));
        let cuts = resolve(Kind::Cuts, [None; 3]).unwrap();
        assert_eq!((cuts.0.name(), cuts.1), ("cuts", 60));
        for kind in [Kind::Spread, Kind::Cuts] {
            let refused = resolve(kind, [None, Some(2), None]).unwrap_err();
            assert!(refused.contains("--windows does not apply"), "{refused}");
        }
        let cases = SamplingArguments {
            sampling: None,
            frames: Some(3),
            fps: None,
            windows: None,
            frames_per_window: None,
        };
        let refused = cases.resolve_for_cases().unwrap_err().to_string();
        assert!(refused.contains("--frames"), "{refused}");
        for wrong in ["0", "-1", "nan", "inf", "x", "1e9"] {
            assert!(parse_fps(wrong).is_err(), "{wrong}");
        }
        assert_eq!(parse_fps("59.94"), Ok(59.94));
    }
}
