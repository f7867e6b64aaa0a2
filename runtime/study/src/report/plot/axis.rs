//! Axes: which scale, which ticks.

use crate::report::numbers::short;

/// Values further apart than this factor are drawn on a logarithmic scale.
const WIDE: f64 = 30.0;
/// Free space at each end, so that no marker lies on the frame.
const MARGIN: f64 = 0.04;
/// Height of zero's band below a logarithmic scale.
const ZERO: f64 = 0.16;

/// How values become places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// From zero up.
    Linear,
    /// By their logarithms.
    Log,
    /// Likewise, with zero below.
    ZeroLog,
}

/// An axis over values from zero up.
#[derive(Clone, Debug)]
pub struct Axis {
    /// What it shows, with the unit.
    pub label: String,
    scale: Scale,
    low: f64,
    high: f64,
}

impl Axis {
    /// The axis on which all of `values` have room.
    pub fn fit(label: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let values = values
            .into_iter()
            .filter(|value| value.is_finite())
            .collect::<Vec<_>>();
        let positive = || values.iter().copied().filter(|&value| value > 0.0);
        let low = positive().fold(f64::INFINITY, f64::min);
        let high = positive().fold(0.0, f64::max);
        let has_zero = positive().count() < values.len();
        let scale = match has_zero {
            _ if high <= low * WIDE || high <= 0.0 => Scale::Linear,
            true => Scale::ZeroLog,
            false => Scale::Log,
        };
        let [low, high] = match scale {
            Scale::Linear => [0.0, if high > 0.0 { high } else { 1.0 }],
            Scale::Log | Scale::ZeroLog => [low, high],
        };
        Self {
            label: label.into(),
            scale,
            low,
            high,
        }
    }

    /// A linear axis from `low` to `high`, which may be below zero.
    pub fn span(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self {
            label: label.into(),
            scale: Scale::Linear,
            low,
            high: high.max(low + f64::MIN_POSITIVE),
        }
    }

    /// An axis without values.
    pub const fn none() -> Self {
        Self {
            label: String::new(),
            scale: Scale::Linear,
            low: 0.0,
            high: 0.0,
        }
    }

    /// Its scale.
    pub const fn scale(&self) -> Scale {
        self.scale
    }

    /// The place of a value, 0 to 1.
    pub fn place(&self, value: f64) -> f64 {
        let share = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            _ if value <= 0.0 => 0.0,
            _ => {
                let share = (value / self.low).ln() / (self.high / self.low).ln();
                let floor = if self.scale == Scale::ZeroLog {
                    ZERO
                } else {
                    0.0
                };
                floor + (1.0 - floor) * share
            }
        };
        MARGIN + (1.0 - 2.0 * MARGIN) * share.clamp(0.0, 1.0)
    }

    /// The place under which there is only zero, if the scale is broken there.
    pub fn break_at(&self) -> Option<f64> {
        (self.scale == Scale::ZeroLog).then_some(MARGIN + (1.0 - 2.0 * MARGIN) * 0.6 * ZERO)
    }

    /// Places and labels of the ticks.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        let values = match self.scale {
            Scale::Linear if self.low >= self.high => Vec::new(),
            Scale::Linear => linear_ticks(self.low, self.high),
            Scale::Log => log_ticks(self.low, self.high),
            Scale::ZeroLog => {
                let mut ticks = vec![0.0];
                ticks.extend(log_ticks(self.low, self.high));
                ticks
            }
        };
        values
            .into_iter()
            .map(|value| (self.place(value), short(value)))
            .collect()
    }
}

/// Steps of 1, 2 or 5 times a power of ten; four to eight of them.
fn linear_ticks(low: f64, high: f64) -> Vec<f64> {
    let rough = (high - low) / 5.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
    let step = step
        .into_iter()
        .find(|&step| step >= rough)
        .unwrap_or(rough);
    let first = (low / step).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|i| i as f64 * step).collect()
}

/// Powers of ten, not more than seven of them; with 2 and 5 times those where there are few.
fn log_ticks(low: f64, high: f64) -> Vec<f64> {
    let [first, last] = [low, high].map(f64::log10);
    let decades = last - first;
    let every = (decades / 6.0).ceil().max(1.0) as i32;
    let steps: &[f64] = if decades < 2.5 {
        &[1.0, 2.0, 5.0]
    } else {
        &[1.0]
    };
    let powers =
        (first.floor() as i32..=last.ceil() as i32).filter(|power| power.rem_euclid(every) == 0);
    let ticks = powers.flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)));
    ticks
        .filter(|tick| (low * 0.999..=high * 1.001).contains(tick))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_ranges_are_logarithmic_and_zero_has_its_place() {
        let scale = |values: &[f64]| Axis::fit("", values.iter().copied()).scale();
        assert_eq!(scale(&[1.0, 30.0]), Scale::Linear);
        assert_eq!(scale(&[1.0, 31.0]), Scale::Log);
        assert_eq!(scale(&[0.0, 1.0, 31.0]), Scale::ZeroLog);
        assert_eq!(scale(&[0.0, 5.0]), Scale::Linear);
        for of_nothing in [&[][..], &[0.0], &[f64::NAN]] {
            let axis = Axis::fit("", of_nothing.iter().copied());
            assert!((0.0..0.1).contains(&axis.place(0.0)));
        }
        let axis = Axis::fit("", [0.0, 1.0, 1000.0]);
        let places = [0.0, 1.0, 10.0, 1000.0].map(|value| axis.place(value));
        assert!(places.is_sorted() && places[0] < axis.break_at().unwrap());
        assert!(axis.break_at().unwrap() < places[1]);
    }

    #[test]
    fn ticks_are_round_and_few() {
        let labels = |axis: Axis| {
            axis.ticks()
                .into_iter()
                .map(|tick| tick.1)
                .collect::<Vec<_>>()
        };
        assert_eq!(
            labels(Axis::fit("", [3.0, 47.0])),
            ["0", "10", "20", "30", "40"]
        );
        assert_eq!(
            labels(Axis::fit("", [3.0, 300.0])),
            ["5", "10", "20", "50", "100", "200"]
        );
        let expected = ["0", "1", "10", "100", "1000", "10 k", "100 k", "1 M"];
        assert_eq!(labels(Axis::fit("", [0.0, 1.0, 1e6])), expected);
        assert_eq!(labels(Axis::span("", -0.1, 0.1)).len(), 5);
        assert!(labels(Axis::fit("", [1e-12, 1e12])).len() <= 8);
    }
}
