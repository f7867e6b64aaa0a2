//! Looks values up in the JSON of a glTF file.

use super::super::affine::Point;
use serde_json::Value;

/// A place in the JSON, for errors.
pub(super) type Result<T> = std::result::Result<T, String>;

/// An index or a size. JSON may write it as `1.0`.
pub(super) fn number(value: &Value) -> Option<usize> {
    let whole = value.as_u64().or_else(|| {
        let float = value
            .as_f64()
            .filter(|x| x.fract() == 0.0 && (0.0..9e15).contains(x))?;
        Some(float as u64)
    });
    usize::try_from(whole?).ok()
}

/// A member that is an index or a size; `None` if it is not there.
pub(super) fn optional(object: &Value, name: &str) -> Result<Option<usize>> {
    match &object[name] {
        Value::Null => Ok(None),
        value => match number(value) {
            Some(number) => Ok(Some(number)),
            None => Err(format!("{name} is {value}, not a number from 0 on")),
        },
    }
}

pub(super) fn required(object: &Value, name: &str) -> Result<usize> {
    optional(object, name)?.ok_or_else(|| format!("{name} is missing"))
}

/// Element `index` of a list of the file, such as `nodes`.
pub(super) fn item<'a>(root: &'a Value, list: &str, index: usize) -> Result<&'a Value> {
    root[list]
        .get(index)
        .ok_or_else(|| format!("{list} has no element {index}"))
}

/// A list of indices; empty if it is not there.
pub(super) fn indices(object: &Value, name: &str) -> Result<Vec<usize>> {
    let list = object[name].as_array().map(Vec::as_slice);
    let index = |value| number(value).ok_or_else(|| format!("{name} has the element {value}"));
    list.unwrap_or_default().iter().map(index).collect()
}

/// A list of `N` numbers; `None` if it is not there.
pub(super) fn floats<const N: usize>(object: &Value, name: &str) -> Result<Option<[f64; N]>> {
    if object[name].is_null() {
        return Ok(None);
    }
    let list = object[name].as_array().filter(|list| list.len() == N);
    let numbers = list.and_then(|list| {
        let numbers: Option<Vec<f64>> = list.iter().map(Value::as_f64).collect();
        numbers?.try_into().ok()
    });
    match numbers {
        Some(numbers) => Ok(Some(numbers)),
        None => Err(format!("{name} is not a list of {N} numbers")),
    }
}

pub(super) fn point(object: &Value, name: &str, default: Point) -> Result<Point> {
    Ok(floats(object, name)?.unwrap_or(default))
}
