//! Numbers that stand for many numbers, and what can be said about the difference of two series.

mod bootstrap;
mod equivalence;

pub use bootstrap::{CONFIDENCE, Interval, RESAMPLES, relative_difference};
pub use equivalence::{Comparison, MARGIN, Verdict, compare};

/// The smallest value that at least the share `p` of all values do not exceed (nearest rank).
pub fn percentile(values: &[f64], p: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (p * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.max(1) - 1).copied()
}

/// The middle value; the mean of the two in the middle of an even number of them.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// First and third quartile.
pub fn quartiles(values: &[f64]) -> Option<[f64; 2]> {
    Some([quantile(values, 0.25)?, quantile(values, 0.75)?])
}

/// Arithmetic mean.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Median of the absolute deviations from the median.
pub fn median_absolute_deviation(values: &[f64]) -> Option<f64> {
    let middle = median(values)?;
    let deviations = values.iter().map(|value| (value - middle).abs());
    median(&deviations.collect::<Vec<_>>())
}

/// Linear between the order statistics (type 7 of Hyndman and Fan 1996).
fn quantile(values: &[f64], p: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = p * sorted.len().checked_sub(1)? as f64;
    let (below, above) = (
        sorted[place.floor() as usize],
        sorted[place.ceil() as usize],
    );
    Some(below + (above - below) * place.fract())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_statistics_of_known_samples() {
        let values = [5.0, 1.0, 4.0, 2.0, 3.0];
        assert_eq!(
            [0.0, 0.5, 0.8, 0.81, 0.99, 1.0].map(|p| percentile(&values, p).unwrap()),
            [1.0, 3.0, 4.0, 5.0, 5.0, 5.0]
        );
        assert_eq!(median(&values), Some(3.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(quartiles(&values), Some([2.0, 4.0]));
        assert_eq!(quartiles(&[1.0, 2.0]), Some([1.25, 1.75]));
        assert_eq!(mean(&values), Some(3.0));
        // Deviations 2, 2, 1, 1, 0; one outlier moves nothing.
        assert_eq!(median_absolute_deviation(&values), Some(1.0));
        assert_eq!(
            median_absolute_deviation(&[5e9, 1.0, 4.0, 2.0, 3.0]),
            Some(1.0)
        );
        assert_eq!(median_absolute_deviation(&[7.0]), Some(0.0));
        for of_nothing in [
            percentile(&[], 0.5),
            median(&[]),
            mean(&[]),
            median_absolute_deviation(&[]),
        ] {
            assert_eq!(of_nothing, None);
        }
        assert_eq!(quartiles(&[]), None);
    }
}
