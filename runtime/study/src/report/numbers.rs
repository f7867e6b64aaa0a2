//! Numbers as people read them.

use crate::table::ABSENT;

/// A number with three significant digits or all before the point, the thousands apart.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    let decimals = match size {
        0.0 => 0,
        _ if size >= 99.95 => 0,
        _ if size >= 9.995 => 1,
        _ if size >= 0.9995 => 2,
        _ if size >= 0.0005 => 3,
        _ => return format!("{value:.1e}"),
    };
    let text = format!("{value:.decimals$}");
    let (whole, fraction) = text.split_at(text.find('.').unwrap_or(text.len()));
    let (sign, digits) = whole.split_at(usize::from(whole.starts_with('-')));
    let mut apart = String::from(sign);
    for (i, digit) in digits.char_indices() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            apart.push(',');
        }
        apart.push(digit);
    }
    apart + fraction
}

/// A whole number, the thousands apart.
pub(crate) fn count(value: impl TryInto<u64>) -> String {
    let value: u64 = value.try_into().unwrap_or(u64::MAX);
    if value < 1000 {
        value.to_string()
    } else {
        format!("{},{:03}", count(value / 1000), value % 1000)
    }
}

/// A number, or a dash.
pub(super) fn or_absent(value: Option<f64>) -> String {
    value.map_or_else(|| ABSENT.to_owned(), number)
}

/// Per cent with two decimals, or a dash. What is not all is not rounded to all, nor to nothing.
pub(super) fn share(value: Option<f64>) -> String {
    match value {
        None => ABSENT.to_owned(),
        Some(value) if value < 1.0 && value > 0.99995 => "> 99.99 %".to_owned(),
        Some(value) => format!("{:.2} %", 100.0 * value),
    }
}

/// A relative difference with its sign, per cent.
pub(crate) fn signed_share(value: f64) -> String {
    // Without the sign of a zero.
    let percent = (1000.0 * value).round() / 10.0 + 0.0;
    format!("{percent:+.1} %")
}

/// A short number for an axis: 1.5 M rather than 1,500,000.
pub(super) fn short(value: f64) -> String {
    let size = value.abs();
    let (scaled, unit) = match size {
        _ if size >= 0.9995e9 => (value / 1e9, " G"),
        _ if size >= 0.9995e6 => (value / 1e6, " M"),
        _ if size >= 0.9995e4 => (value / 1e3, " k"),
        _ => (value, ""),
    };
    // At most three digits, without zeros at the end.
    let digits = if scaled.abs() >= 100.0 || scaled == 0.0 {
        format!("{scaled:.0}")
    } else {
        let decimals = (2.0 - scaled.abs().log10().floor()).clamp(0.0, 8.0) as usize;
        let text = format!("{scaled:.decimals$}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    digits + unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_tables_and_axes() {
        let cases = [
            0.0, 0.0001, 0.0123, 0.99999, 9.9999, 12.34, 123.4, 1234567.0, -1234.5,
        ];
        let expected = [
            "0",
            "1.0e-4",
            "0.012",
            "1.00",
            "10.0",
            "12.3",
            "123",
            "1,234,567",
            "-1,234",
        ];
        assert_eq!(cases.map(number), expected);
        assert_eq!(
            [0u64, 999, 1000, 1000007].map(count),
            ["0", "999", "1,000", "1,000,007"]
        );
        assert_eq!(
            [Some(1.0), Some(0.99999), Some(0.5), None].map(share),
            ["100.00 %", "> 99.99 %", "50.00 %", "-"]
        );
        let cases = [0.0, 0.05, 1.0, 2.5, 1000.0, 20000.0, 1.5e6, 3e9];
        assert_eq!(
            cases.map(short),
            ["0", "0.05", "1", "2.5", "1000", "20 k", "1.5 M", "3 G"]
        );
    }
}
