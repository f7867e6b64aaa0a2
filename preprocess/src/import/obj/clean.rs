//! Rewrites an OBJ file into the part of the format that `tobj` reads as the format means it.
//!
//! `tobj` 4.0.5 refuses `\` continuations, bytes that are not UTF-8 and normals that are not numbers. It
//! divides by the weight behind a position, takes polylines for polygons and tells neither which index is
//! out of range nor on which line. In the copy, vertices come first, each on the line it has in the file.
//! The faces follow part by part, every index counted from 1 and known to exist. Names stay here: they are
//! bytes in an unknown encoding, and `tobj` gets none of them.

use super::lines::{Lines, keyword, number, without_bom, words};
use crate::import::error::{ImportError, Result};
use crate::import::{ImportErrorKind, ImportOptions, MAX_OBJECTS};
use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::fmt::Write;

/// Names are stored once per object, so long ones could make a small file large.
const MAX_NAME_BYTES: usize = 255;

/// The faces between one `o` line and the next that share a `g`.
pub(super) struct Group {
    /// For display: bytes that are not UTF-8 are replaced.
    pub(super) name: String,
    /// Number of parts.
    pub(super) parts: usize,
    /// Number of the current run: faces of other groups stand between runs.
    run: u32,
}

/// The faces of a group that share a `usemtl`.
pub(super) struct Part {
    /// Index into [`Cleaned::groups`].
    pub(super) group: usize,
    /// Index of this part among those of the group.
    pub(super) number: usize,
    /// Index into [`Cleaned::names`].
    pub(super) material: usize,
    /// The runs of the group that have faces here: run number and first face.
    pub(super) runs: Vec<(u32, usize)>,
    /// The lines of the faces of more than three corners.
    pub(super) polygon_lines: Vec<u32>,
    face_count: usize,
    faces: String,
}

/// The copy, and what was left out of it.
#[derive(Default)]
pub(super) struct Cleaned {
    pub(super) text: String,
    /// In the order of their first faces.
    pub(super) groups: Vec<Group>,
    /// In the order of their first faces.
    pub(super) parts: Vec<Part>,
    /// Names of groups and materials, each once; the first is empty.
    pub(super) names: Vec<Vec<u8>>,
    /// What stands behind `mtllib`, each once.
    pub(super) libraries: Vec<Vec<u8>>,
    pub(super) points: usize,
    pub(super) lines: usize,
    pub(super) curves: usize,
    pub(super) bad_normals: usize,
    pub(super) bad_uvs: usize,
    pub(super) cut_names: usize,
}

pub(super) fn clean(bytes: &[u8], options: &ImportOptions) -> Result<Cleaned> {
    let mut cleaner = Cleaner {
        cleaned: Cleaned {
            text: String::with_capacity(bytes.len()),
            names: vec![Vec::new()],
            ..Default::default()
        },
        normals: options.normals,
        uvs: options.uvs,
        line: 0,
        understood: false,
        counts: [0; 3],
        not_finite: HashMap::new(),
        bad_uvs: HashSet::new(),
        bad_normals: HashSet::new(),
        name_ids: HashMap::from([(Vec::new(), 0)]),
        known_libraries: HashSet::new(),
        object_line: 0,
        object: 0,
        group: 0,
        material: 0,
        group_of_names: HashMap::new(),
        part_of_names: HashMap::new(),
        last_group: None,
        current: None,
    };
    let mut lines = Lines::new(without_bom(bytes)).enumerate();
    let mut joined = Vec::new();
    while let Some((index, line)) = lines.next() {
        cleaner.line = index + 1;
        let mut continued = 0;
        let mut statement = line;
        // Any number of lines may be continued. What was joined is not looked through again.
        if let Some(start) = continues(line, is_named(line)) {
            let named = is_named(line);
            joined.clear();
            joined.extend_from_slice(start);
            for (_, next) in lines.by_ref() {
                continued += 1;
                joined.push(b' ');
                match continues(next, named) {
                    Some(start) => joined.extend_from_slice(start),
                    None => {
                        joined.extend_from_slice(next);
                        break;
                    }
                }
            }
            statement = &joined;
        }
        cleaner
            .statement(statement)
            .map_err(|error| error.within(format_args!("line {}", index + 1)))?;
        cleaner.cleaned.text.extend((0..=continued).map(|_| '\n'));
    }
    if !cleaner.understood {
        let what = "holds no OBJ statement";
        return Err(ImportError::new(ImportErrorKind::UnknownFormat, what));
    }
    let Cleaned { text, parts, .. } = &mut cleaner.cleaned;
    for part in parts {
        text.push_str("o\n");
        text.push_str(&std::mem::take(&mut part.faces));
    }
    Ok(cleaner.cleaned)
}

/// Whether a statement's arguments are a name, in which `#` starts no comment.
fn is_named(line: &[u8]) -> bool {
    matches!(keyword(line).0, b"o" | b"g" | b"usemtl" | b"mtllib")
}

/// The line before the `\` that continues it, if there is one.
///
/// A comment is not continued: it may end in the name of a Windows folder. Nor is a name that is not UTF-8
/// and has a byte above 127 before the `\`: in Shift-JIS, GBK and Big5 that `\` is half of a character.
fn continues(line: &[u8], named: bool) -> Option<&[u8]> {
    let start = line.trim_ascii_end().strip_suffix(b"\\")?;
    let in_comment = !named && words(start).any(|word| word.starts_with(b"#"));
    let half =
        named && start.last().is_some_and(|&byte| byte > 127) && std::str::from_utf8(line).is_err();
    (!in_comment && !half).then_some(start.trim_ascii_end())
}

/// The indices of a face's corner, from 1: position, texture coordinate, normal.
type Corner = [Option<usize>; 3];

struct Cleaner {
    cleaned: Cleaned,
    normals: bool,
    uvs: bool,
    /// Number of the line being read.
    line: usize,
    /// Whether any statement was known.
    understood: bool,
    /// Positions, texture coordinates and normals so far.
    counts: [usize; 3],
    /// Positions that are infinite or no number, and their lines. They may stand there, but not in a face.
    not_finite: HashMap<usize, usize>,
    /// Texture coordinates that are no numbers.
    bad_uvs: HashSet<usize>,
    /// Normals that are no numbers.
    bad_normals: HashSet<usize>,
    /// Indices into [`Cleaned::names`]: long names are compared where they stand and nowhere else.
    name_ids: HashMap<Vec<u8>, usize>,
    known_libraries: HashSet<Vec<u8>>,
    /// Number of `o` lines so far: each begins an object, whatever its name.
    object_line: usize,
    /// The names in force, as indices into [`Cleaned::names`].
    object: usize,
    group: usize,
    material: usize,
    /// By `o` line and `g`.
    group_of_names: HashMap<(usize, usize), usize>,
    /// By group and material.
    part_of_names: HashMap<(usize, usize), usize>,
    /// The group that got the latest face.
    last_group: Option<usize>,
    /// The part of the names in force, once a face was read under them.
    current: Option<usize>,
}

impl Cleaner {
    fn statement(&mut self, line: &[u8]) -> Result<()> {
        let (keyword, rest) = keyword(line);
        let words = words(rest).take_while(|word| !word.starts_with(b"#"));
        match keyword {
            b"v" => self.position(words),
            b"vt" => {
                self.counts[1] += 1;
                if self.uvs {
                    let words = words.chain([b"0".as_slice()]).take(2);
                    if !self.vector("vt", words, 2, "0 0") {
                        self.cleaned.bad_uvs += 1;
                        self.bad_uvs.insert(self.counts[1]);
                    }
                }
            }
            b"vn" => {
                self.counts[2] += 1;
                if self.normals && !self.vector("vn", words.take(3), 3, "0 0 1") {
                    self.cleaned.bad_normals += 1;
                    self.bad_normals.insert(self.counts[2]);
                }
            }
            b"f" | b"fo" => {
                let corners: Vec<Corner> =
                    words.map(|word| self.corner(word)).collect::<Result<_>>()?;
                self.face(&corners)?;
            }
            b"p" => self.cleaned.points += 1,
            b"l" => self.cleaned.lines += 1,
            b"curv" | b"curv2" | b"surf" => self.cleaned.curves += 1,
            b"o" => {
                self.object_line += 1;
                self.object = self.name_id(rest);
                self.current = None;
            }
            b"g" => {
                self.group = self.name_id(rest);
                self.current = None;
            }
            b"usemtl" => {
                self.material = self.name_id(rest);
                self.current = None;
            }
            b"mtllib" => {
                if self.known_libraries.insert(rest.to_owned()) {
                    self.cleaned.libraries.push(rest.to_owned());
                }
            }
            b"vp" | b"s" => {}
            _ => return Ok(()),
        }
        self.understood = true;
        Ok(())
    }

    /// What follows the three coordinates, a weight of free-form surfaces or a colour, is nothing to polygons.
    fn position<'w>(&mut self, words: impl Iterator<Item = &'w [u8]> + Clone) {
        self.counts[0] += 1;
        let words = words.take(3);
        // As Rust and others spell what is not finite. An overflow is found when f32 is made of it.
        let is_special = |word: &[u8]| word.iter().any(|byte| b"nN#".contains(byte));
        let text = &mut self.cleaned.text;
        if words.clone().count() == 3 && words.clone().any(is_special) {
            self.not_finite.insert(self.counts[0], self.line);
            text.push_str("v 0 0 0");
            return;
        }
        text.push('v');
        for word in words {
            text.push(' ');
            text.push_str(&String::from_utf8_lossy(word));
        }
    }

    /// Copies a vector of `count` numbers, or writes `instead` where it is none.
    fn vector<'w>(
        &mut self,
        keyword: &str,
        words: impl Iterator<Item = &'w [u8]> + Clone,
        count: usize,
        instead: &str,
    ) -> bool {
        let good = words.clone().filter(|word| number(word).is_some()).count() == count;
        let text = &mut self.cleaned.text;
        text.push_str(keyword);
        if good {
            for word in words {
                text.push(' ');
                text.push_str(&String::from_utf8_lossy(word));
            }
        } else {
            text.push(' ');
            text.push_str(instead);
        }
        good
    }

    fn name_id(&mut self, name: &[u8]) -> usize {
        if let Some(&id) = self.name_ids.get(name) {
            return id;
        }
        let id = self.cleaned.names.len();
        self.cleaned.names.push(name.to_owned());
        self.name_ids.insert(name.to_owned(), id);
        id
    }

    fn corner(&self, word: &[u8]) -> Result<Corner> {
        let mut parts = word.split(|&byte| byte == b'/');
        let mut index = |what: &str, count: usize| -> Result<Option<usize>> {
            let Some(part) = parts.next().filter(|part| !part.is_empty()) else {
                return Ok(None);
            };
            let part = String::from_utf8_lossy(part);
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
        if let Some(line) = self.not_finite.get(&position) {
            let what =
                format!("a face uses position {position} of line {line}, which is not finite");
            return Err(ImportError::malformed(what));
        }
        // Wrong ones among the other two cost that attribute only.
        let uv = index("the texture coordinate", self.counts[1]).unwrap_or_default();
        let normal = index("the normal", self.counts[2]).unwrap_or_default();
        Ok([
            Some(position),
            uv.filter(|uv| self.uvs && !self.bad_uvs.contains(uv)),
            normal.filter(|normal| self.normals && !self.bad_normals.contains(normal)),
        ])
    }

    fn face(&mut self, corners: &[Corner]) -> Result<()> {
        match corners.len() {
            0 | 1 => self.cleaned.points += 1,
            2 => self.cleaned.lines += 1,
            count => {
                let line = u32::try_from(self.line).unwrap_or(u32::MAX);
                let part = self.part()?;
                part.face_count += 1;
                if count > 3 {
                    part.polygon_lines.push(line);
                }
                let faces = &mut part.faces;
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
        }
        Ok(())
    }

    /// The part that faces go to now.
    fn part(&mut self) -> Result<&mut Part> {
        let current = match self.current {
            Some(current) => current,
            None => self.enter_part()?,
        };
        self.current = Some(current);
        Ok(&mut self.cleaned.parts[current])
    }

    /// Finds or makes the part of the names in force.
    fn enter_part(&mut self) -> Result<usize> {
        let group = match self.group_of_names.entry((self.object_line, self.group)) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(new) => {
                let names = &self.cleaned.names;
                let name = display_name(&names[self.object], &names[self.group]);
                let cut = name.floor_char_boundary(MAX_NAME_BYTES);
                self.cleaned.cut_names += usize::from(cut < name.len());
                self.cleaned.groups.push(Group {
                    name: name[..cut].to_owned(),
                    parts: 0,
                    run: 0,
                });
                *new.insert(self.cleaned.groups.len() - 1)
            }
        };
        let parts = &mut self.cleaned.parts;
        let of_group = &mut self.cleaned.groups[group];
        if self.last_group.replace(group) != Some(group) {
            of_group.run += 1;
        }
        let part = match self.part_of_names.entry((group, self.material)) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(new) => {
                if parts.len() == MAX_OBJECTS {
                    let what = format!("holds more than {MAX_OBJECTS} objects");
                    return Err(ImportError::new(ImportErrorKind::TooLarge, what));
                }
                parts.push(Part {
                    group,
                    number: of_group.parts,
                    material: self.material,
                    runs: Vec::new(),
                    polygon_lines: Vec::new(),
                    face_count: 0,
                    faces: String::new(),
                });
                of_group.parts += 1;
                *new.insert(parts.len() - 1)
            }
        };
        let runs = &mut parts[part].runs;
        if runs.last().is_none_or(|&(run, _)| run != of_group.run) {
            let first = parts[part].face_count;
            parts[part].runs.push((of_group.run, first));
        }
        Ok(part)
    }
}

fn display_name(object: &[u8], group: &[u8]) -> String {
    let [object, group] = [object, group].map(String::from_utf8_lossy);
    match (&*object, &*group) {
        (name, "") | ("", name) => name.to_owned(),
        (object, group) if object == group => object.to_owned(),
        (object, group) => format!("{object}/{group}"),
    }
}
