//! The plots of a report.

mod curves;
mod differences;
mod speed_error;
mod stages;

pub use curves::curves;
pub use differences::{Difference, differences};
pub use speed_error::speed_error;
pub use stages::stages;

/// Width of a plot, pixels.
pub(crate) const WIDTH: f64 = 980.0;
