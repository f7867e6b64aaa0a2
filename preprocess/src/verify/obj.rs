//! Reads Wavefront OBJ: positions and faces, nothing else.
//!
//! Faces under one `o` line and one `g` are a group, wherever they stand; those with one `usemtl` are a part of it. Groups
//! of the file and parts of a group are numbered in the order of their first faces.

use super::affine::{Affine, Point};
use super::geometry::{Part, Shape};
use std::collections::HashMap;

/// The number of the `o` line in force, and the names of `g` and `usemtl`.
type Key<'a> = (usize, &'a [u8], &'a [u8]);

pub(super) struct File {
    pub(super) parts: Vec<Part>,
    points: Vec<Point>,
    faces: Vec<Faces>,
}

#[derive(Default)]
struct Faces {
    corners: Vec<u32>,
    ends: Vec<u32>,
}

impl File {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, String> {
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        let mut file = Self {
            parts: Vec::new(),
            points: Vec::new(),
            faces: Vec::new(),
        };
        let mut numbers = HashMap::new();
        // The number of each group and how many parts it has.
        let mut groups = HashMap::new();
        let mut key: Key<'_> = (0, b"", b"");
        let mut name: &[u8] = b"";
        for (number, line) in statements(bytes) {
            let first = line.iter().position(u8::is_ascii_whitespace);
            let (keyword, rest) = line.split_at(first.unwrap_or(line.len()));
            let rest = rest.trim_ascii();
            let words = rest.split(|byte| byte.is_ascii_whitespace() || *byte == b'\\');
            let words = words.filter(|word| !word.is_empty());
            let words = words.take_while(|word| !word.starts_with(b"#"));
            let fault = |what: String| format!("line {number}: {what}");
            match keyword {
                b"v" => file.points.push(point(words).map_err(fault)?),
                b"o" => {
                    key.0 += 1;
                    name = rest;
                }
                b"g" => key.1 = rest,
                b"usemtl" => key.2 = rest,
                b"f" | b"fo" => {
                    let count = file.points.len();
                    let corners = words.map(|word| corner(word, count));
                    let corners: Vec<u32> = corners.collect::<Result<_, _>>().map_err(fault)?;
                    if corners.len() < 3 {
                        continue;
                    }
                    let part = *numbers.entry(key).or_insert_with(|| {
                        let next = groups.len() as u32;
                        let (group, parts) = groups.entry((key.0, key.1)).or_insert((next, 0));
                        file.add_part(if name.is_empty() { key.1 } else { name }, [*group, *parts]);
                        *parts += 1;
                        file.faces.len() - 1
                    });
                    let faces = &mut file.faces[part];
                    faces.corners.extend(corners);
                    faces.ends.push(faces.corners.len() as u32);
                }
                b"curv" | b"curv2" | b"surf" | b"call" => {}
                _ => {}
            }
        }
        Ok(file)
    }

    fn add_part(&mut self, name: &[u8], [node, primitive]: [u32; 2]) {
        let number = self.parts.len();
        self.faces.push(Faces::default());
        self.parts.push(Part {
            node,
            primitive,
            name: String::from_utf8_lossy(name).into_owned(),
            places: vec![Affine::IDENTITY],
            shape: number,
        });
    }

    pub(super) fn shape(&self, number: usize) -> Result<Shape, String> {
        let faces = &self.faces[number];
        let mut corners = faces.corners.clone();
        let points = Shape::gather(&mut corners, |corner| self.points[corner as usize]);
        match points.iter().flatten().all(|x| x.is_finite()) {
            true => Ok(Shape {
                points,
                corners,
                ends: faces.ends.clone(),
                is_computed: false,
            }),
            false => Err("a face has a corner that is not finite".into()),
        }
    }
}

/// The statements and the numbers of their lines. A line ends with LF, CR or both; a backslash at its end, which is
/// not in a comment, continues it: the backslash and the end of the line stay in the statement.
fn statements(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let mut rest = bytes;
    let mut line = 0;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let number = line + 1;
        let mut end = 0;
        loop {
            let start = end;
            end += rest[start..]
                .iter()
                .position(|byte| matches!(byte, b'\n' | b'\r'))
                .unwrap_or(rest.len() - start);
            line += 1;
            let continues = rest[start..end].trim_ascii_end().ends_with(b"\\")
                && !rest[..end].trim_ascii_start().starts_with(b"#");
            let break_len = match &rest[end..] {
                [b'\r', b'\n', ..] => 2,
                [] => 0,
                _ => 1,
            };
            if !continues || break_len == 0 {
                let statement = rest[..end].trim_ascii();
                rest = &rest[end + break_len..];
                return Some((number, statement));
            }
            end += break_len;
        }
    })
}

fn point<'a>(mut words: impl Iterator<Item = &'a [u8]>) -> Result<Point, String> {
    let mut coordinate = || {
        let word = words
            .next()
            .ok_or("a vertex has fewer than three numbers".to_owned())?;
        let number = std::str::from_utf8(word)
            .ok()
            .and_then(|word| word.parse().ok());
        // What is no number may stand in a vertex that no face uses.
        Ok::<f64, String>(number.unwrap_or(f64::NAN))
    };
    Ok([coordinate()?, coordinate()?, coordinate()?])
}

/// The number of a corner's position, from 0. Files count from 1, or backwards from the latest position.
fn corner(word: &[u8], count: usize) -> Result<u32, String> {
    let index = word.split(|&byte| byte == b'/').next().unwrap_or_default();
    let number = std::str::from_utf8(index)
        .ok()
        .and_then(|text| text.parse::<i64>().ok());
    let position = match number {
        Some(number) if number < 0 => count as i64 + number,
        Some(number) => number - 1,
        None => -1,
    };
    match position {
        0.. if position < count as i64 && position < i64::from(u32::MAX) => Ok(position as u32),
        _ => Err(format!(
            "the corner {:?} names none of the {count} positions so far",
            String::from_utf8_lossy(word)
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_sorted_into_parts() {
        let text = b"\xEF\xBB\xBFv 0 0 0\rv 1 0 0\r\nv 0 1 \\\n 0.5 # not 7\n# end \\\no a\nf 1 2 3\ng x\nf -1 -2/1/1 1//2\n\
            o a\nf 1 2 3 3\nf 1 2\ng x\nusemtl m\nf 3 2 1\n";
        let file = File::read(text).unwrap();
        let names: Vec<_> = file.parts.iter().map(|part| part.name.as_str()).collect();
        assert_eq!(names, ["a", "a", "a", "a"]);
        let shape = file.shape(1).unwrap();
        assert_eq!(shape.points[2], [0.0, 1.0, 0.5]);
        assert_eq!(shape.corners, [2, 1, 0]);
        let polygons: Vec<_> = file.faces.iter().map(|faces| faces.ends.len()).collect();
        assert_eq!(polygons, [1, 1, 1, 1]);
        assert!(File::read(b"v 0 0 0\nf 1 2 0\n").is_err());
        assert!(
            File::read(b"v 0 nan 0\nf 1 1 1\n")
                .unwrap()
                .shape(0)
                .is_err()
        );
    }
}
