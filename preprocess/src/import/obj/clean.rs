//! Rewrites an OBJ file into the part of the format that `tobj` reads as the format means it.
//!
//! `tobj` 4.0.5 refuses `\` continuations and bytes that are not UTF-8, divides by the weight behind a
//! position, takes polylines for polygons, ends an object at every `o` and `g` but, without a material
//! library, at no `usemtl`, and tells neither which index is out of range nor on which line. In the
//! copy, vertices come first, each on the line it has in the file. The faces follow object by object,
//! every index counted from 1 and known to exist.

use crate::import::ImportOptions;
use crate::import::error::{ImportError, Result};
use std::collections::{HashMap, HashSet};
use std::fmt::Write;

/// The faces of one `o`, one `g` and one `usemtl`.
pub(super) struct Part {
    pub(super) name: String,
    pub(super) material: String,
    faces: String,
}

/// The copy, and what was left out of it.
#[derive(Default)]
pub(super) struct Cleaned {
    pub(super) text: String,
    /// In the order of their first faces.
    pub(super) parts: Vec<Part>,
    pub(super) points: usize,
    pub(super) lines: usize,
    pub(super) curves: usize,
}

pub(super) fn clean(bytes: &[u8], options: &ImportOptions) -> Result<Cleaned> {
    let mut cleaner = Cleaner {
        cleaned: Cleaned {
            text: String::with_capacity(bytes.len()),
            ..Default::default()
        },
        normals: options.normals,
        uvs: options.uvs,
        counts: [0; 3],
        not_finite: HashSet::new(),
        names: Default::default(),
        part_of_names: HashMap::new(),
        current: None,
    };
    let mut lines = bytes.split(|&byte| byte == b'\n').enumerate();
    while let Some((number, line)) = lines.next() {
        let mut line = String::from_utf8_lossy(line);
        let mut continued = 0;
        // A backslash before the line's end continues it. Any number of lines may do so: what was
        // joined is neither copied nor looked through again.
        while let Some(start) = line.trim_end().strip_suffix('\\') {
            let end = start.trim_end().len();
            let Some((_, next)) = lines.next() else { break };
            let line = line.to_mut();
            line.truncate(end);
            line.push(' ');
            line.push_str(&String::from_utf8_lossy(next));
            continued += 1;
        }
        cleaner
            .statement(line.trim())
            .map_err(|error| error.within(format_args!("line {}", number + 1)))?;
        cleaner.cleaned.text.extend((0..=continued).map(|_| '\n'));
    }
    let Cleaned { text, parts, .. } = &mut cleaner.cleaned;
    for part in parts {
        text.push_str("o\n");
        text.push_str(&std::mem::take(&mut part.faces));
    }
    Ok(cleaner.cleaned)
}

/// The indices of a face's corner, from 1: position, texture coordinate, normal.
type Corner = [Option<usize>; 3];

struct Cleaner {
    cleaned: Cleaned,
    normals: bool,
    uvs: bool,
    /// Positions, texture coordinates and normals so far.
    counts: [usize; 3],
    /// Positions that are infinite or no number. They may stand there, but not in a face.
    not_finite: HashSet<usize>,
    /// The names in force: `o`, `g`, `usemtl`.
    names: [String; 3],
    part_of_names: HashMap<[String; 3], usize>,
    /// The part of the names in force, once a face was read under them.
    current: Option<usize>,
}

impl Cleaner {
    fn statement(&mut self, line: &str) -> Result<()> {
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let words = rest
            .split_whitespace()
            .take_while(|word| !word.starts_with('#'));
        match keyword {
            "v" => {
                self.counts[0] += 1;
                // As Rust spells what is not finite; an overflow is found when f32 is made of it.
                if words.clone().take(3).any(|word| word.contains(['n', 'N'])) {
                    self.not_finite.insert(self.counts[0]);
                }
                // What follows, a weight of free-form surfaces or a colour, is nothing to polygons.
                self.vector("v", words.take(3));
            }
            "vt" => {
                self.counts[1] += 1;
                self.vector("vt", words.chain(["0"]).take(2));
            }
            "vn" => {
                self.counts[2] += 1;
                self.vector("vn", words.take(3));
            }
            "f" | "fo" => {
                let corners: Vec<Corner> =
                    words.map(|word| self.corner(word)).collect::<Result<_>>()?;
                self.face(&corners);
            }
            "p" => self.cleaned.points += 1,
            "l" => self.cleaned.lines += 1,
            "curv" | "curv2" | "surf" => self.cleaned.curves += 1,
            "o" => self.rename(0, rest),
            "g" => self.rename(1, rest),
            "usemtl" => self.rename(2, rest),
            "mtllib" => self.vector("mtllib", [rest].into_iter()),
            _ => {}
        }
        Ok(())
    }

    fn vector<'w>(&mut self, keyword: &str, words: impl Iterator<Item = &'w str>) {
        let text = &mut self.cleaned.text;
        text.push_str(keyword);
        for word in words {
            text.push(' ');
            text.push_str(word);
        }
    }

    fn rename(&mut self, which: usize, name: &str) {
        self.names[which] = name.to_owned();
        self.current = None;
    }

    fn corner(&self, word: &str) -> Result<Corner> {
        let mut parts = word.split('/');
        let mut index = |what: &str, count: usize| -> Result<Option<usize>> {
            let Some(part) = parts.next().filter(|part| !part.is_empty()) else {
                return Ok(None);
            };
            let fault = |why: &str| {
                ImportError::malformed(format!("{what} index {part:?} of a face {why}"))
            };
            let number: i64 = part.parse().map_err(|_| fault("is not a number"))?;
            // Counted from 1, or backwards from the latest.
            let from_end = number.saturating_add(count as i64).saturating_add(1);
            let index = if number < 0 { from_end } else { number };
            match usize::try_from(index) {
                Ok(index) if (1..=count).contains(&index) => Ok(Some(index)),
                _ => Err(fault(&format!("is outside the {count} read so far"))),
            }
        };
        let position = index("the position", self.counts[0])?
            .ok_or_else(|| ImportError::malformed("a face corner has no position"))?;
        if self.not_finite.contains(&position) {
            let what = format!("a face uses position {position}, which is not finite");
            return Err(ImportError::malformed(what));
        }
        // Wrong ones among the other two cost that attribute only.
        let uv = index("the texture coordinate", self.counts[1]).unwrap_or_default();
        let normal = index("the normal", self.counts[2]).unwrap_or_default();
        Ok([
            Some(position),
            uv.filter(|_| self.uvs),
            normal.filter(|_| self.normals),
        ])
    }

    fn face(&mut self, corners: &[Corner]) {
        match corners.len() {
            0 | 1 => return self.cleaned.points += 1,
            2 => return self.cleaned.lines += 1,
            _ => {}
        }
        let faces = &mut self.part().faces;
        faces.push('f');
        for corner in corners {
            for (index, separator) in corner.iter().zip([' ', '/', '/']) {
                faces.push(separator);
                if let Some(index) = index {
                    // Writing to a string cannot fail.
                    let _ = write!(faces, "{index}");
                }
            }
        }
        faces.push('\n');
    }

    /// The part that faces go to now.
    fn part(&mut self) -> &mut Part {
        let parts = &mut self.cleaned.parts;
        let current = *self.current.get_or_insert_with(|| {
            let known = self.part_of_names.entry(self.names.clone());
            *known.or_insert_with(|| {
                let [object, group, material] = &self.names;
                let name = match (object.as_str(), group.as_str()) {
                    (name, "") | ("", name) => name.to_owned(),
                    (object, group) if object == group => object.to_owned(),
                    (object, group) => format!("{object}/{group}"),
                };
                parts.push(Part {
                    name,
                    material: material.clone(),
                    faces: String::new(),
                });
                parts.len() - 1
            })
        });
        &mut parts[current]
    }
}
