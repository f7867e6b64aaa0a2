//! Compares the polygons of a source object with the triangles of the baked objects that were made of it.
//!
//! Neither the order of vertices nor that of triangles counts. Vertices that are equal to a tolerance have one number
//! ([`Clusters`]). Then:
//!
//! * In each cluster the box of the source's vertices and the box of the baked ones agree to the tolerance. A
//!   vertex that moved by more than it is found: alone in its cluster, it makes a different box, and elsewhere a
//!   cluster of its own.
//! * The source's triangles are the baked ones, as lists of three numbers in their order around the triangle. An
//!   index that was changed makes a triangle that is in one list only.
//! * Polygons may be cut in many ways. The sum of the edges of any cut, where an edge and its reverse cancel, is the
//!   polygon's outline. So the edges of the other baked triangles must sum to those of all outlines, and there are at
//!   most as many triangles as a cut makes.
//! * The area is the same, as far as polygons have an area that does not depend on the cut.
//!
//! Triangles two of whose corners have the same number are left out on both sides: the bake may drop them.

use super::affine::{Extent, Point, cross, length, sub};
use super::clusters::Clusters;
use super::geometry::Shape;
use super::polygon::Measure;
use super::stored::Stored;

/// An object is stored too coarsely to be compared if rounding can move its vertices by this share of its size.
const TOO_COARSE: f64 = 0.01;

/// What the comparison of one object found.
#[derive(Default)]
pub(super) struct Outcome {
    pub(super) problems: Vec<String>,
    pub(super) triangles: usize,
    /// Source triangles with two corners that are equal to the tolerance.
    pub(super) small: usize,
    pub(super) area: [f64; 2],
    pub(super) displacement: f64,
}

/// Compares `shape`, whose points are at `points` in the world, with what is stored of it. Rounding explains that
/// coordinates differ by `tolerance`.
pub(super) fn compare(shape: &Shape, points: &[Point], stored: &Stored, tolerance: f64) -> Outcome {
    let source = Extent::of(points);
    // The f64 numbers themselves are good to a few units in the last place.
    let tolerance = tolerance
        .max(source.largest() * 1e-15)
        .max(f64::MIN_POSITIVE * 1e6);
    let mut outcome = Outcome {
        triangles: stored.triangles.len(),
        ..Outcome::default()
    };
    let size = source.size();
    if size > 0.0 && tolerance > TOO_COARSE * size {
        outcome.problems.push(format!(
            "is stored to {tolerance:.1e} only, which is {:.0} % of its size of {size:.1e}",
            100.0 * tolerance / size
        ));
        return outcome;
    }
    let baked = Extent::of(&stored.points);
    let apart = source.beyond(&baked).max(baked.beyond(&source));
    if apart > tolerance && shape.ends.is_empty() {
        outcome.problems.push(format!(
            "its box is {:?} to {:?} in the source and {:?} to {:?} in the file",
            source.min, source.max, baked.min, baked.max
        ));
    }
    let clusters = Clusters::new(points, &stored.points, tolerance);
    let faces = Faces::new(shape, points, stored, &clusters);
    outcome.small = faces.small;
    outcome.area = faces.area;
    outcome.problems.extend(faces.problems(tolerance));
    let boxes = Boxes::new(points, stored, &clusters, &faces);
    outcome.displacement = boxes.displacement;
    outcome.problems.extend(boxes.problem(tolerance));
    outcome
}

/// Three numbers in their order around the triangle, the least first; `None` if two are equal.
fn turned([a, b, c]: [u32; 3]) -> Option<[u32; 3]> {
    if a == b || b == c || c == a {
        return None;
    }
    let least = a.min(b).min(c);
    Some(match least {
        least if least == a => [a, b, c],
        least if least == b => [b, c, a],
        _ => [c, a, b],
    })
}

fn area([a, b, c]: [Point; 3]) -> f64 {
    0.5 * length(cross(sub(b, a), sub(c, a)))
}

/// The faces of both sides, as numbers of clusters.
struct Faces {
    /// Triangles of the source and of the file, sorted.
    source: Vec<[u32; 3]>,
    stored: Vec<[u32; 3]>,
    /// Outlines of polygons of more corners, as edges.
    outlines: Vec<[u32; 2]>,
    /// The triangles that the source's polygons make, at most and all told.
    most: usize,
    /// Source triangles that are left out.
    small: usize,
    /// Triangles that a cut of the polygons makes, at most.
    cut: usize,
    area: [f64; 2],
    /// Whether the source's area holds for every cut.
    is_area_certain: bool,
    perimeter: f64,
    /// For messages: a point of each cluster.
    example: Vec<Point>,
    stored_count: usize,
    /// Whether a vertex is a corner of a face that counts.
    counts: [Vec<bool>; 2],
}

impl Faces {
    fn new(shape: &Shape, points: &[Point], stored: &Stored, clusters: &Clusters) -> Self {
        let mut faces = Self {
            source: Vec::new(),
            stored: Vec::with_capacity(stored.triangles.len()),
            outlines: Vec::new(),
            most: 0,
            small: 0,
            cut: 0,
            area: [0.0; 2],
            is_area_certain: true,
            perimeter: 0.0,
            example: vec![[f64::NAN; 3]; clusters.count],
            stored_count: stored.triangles.len(),
            counts: [vec![false; points.len()], vec![false; stored.points.len()]],
        };
        for (&cluster, &point) in clusters.second.iter().zip(&stored.points) {
            faces.example[cluster as usize] = point;
        }
        for (&cluster, &point) in clusters.first.iter().zip(points) {
            faces.example[cluster as usize] = point;
        }
        let mut measure = Measure::default();
        for polygon in shape.polygons() {
            faces.add_source(polygon, points, clusters, &mut measure);
        }
        for &corners in &stored.triangles {
            let places = corners.map(|corner| stored.points[corner as usize]);
            faces.area[1] += area(places);
            let edges = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| length(sub(places[a], places[b])));
            faces.perimeter += edges.iter().sum::<f64>();
            let numbers = corners.map(|corner| clusters.second[corner as usize]);
            if let Some(triangle) = turned(numbers) {
                faces.stored.push(triangle);
                for corner in corners {
                    faces.counts[1][corner as usize] = true;
                }
            }
        }
        faces.source.sort_unstable();
        faces.stored.sort_unstable();
        faces
    }

    fn add_source(
        &mut self,
        polygon: &[u32],
        points: &[Point],
        clusters: &Clusters,
        measure: &mut Measure,
    ) {
        let number = |corner: u32| clusters.first[corner as usize];
        let place = |corner: u32| points[corner as usize];
        self.most += polygon.len() - 2;
        if let &[a, b, c] = polygon {
            self.area[0] += area([a, b, c].map(place));
            match turned([a, b, c].map(number)) {
                Some(triangle) => {
                    self.source.push(triangle);
                    polygon
                        .iter()
                        .for_each(|&corner| self.counts[0][corner as usize] = true);
                }
                None => self.small += 1,
            }
            return;
        }
        let corners: Vec<Point> = polygon.iter().map(|&corner| place(corner)).collect();
        let (area, is_certain) = measure.area(&corners);
        self.area[0] += area;
        self.is_area_certain &= is_certain;
        self.cut += polygon.len() - 2;
        let next = polygon.iter().cycle().skip(1);
        for (&a, &b) in polygon.iter().zip(next) {
            let edge = [number(a), number(b)];
            if edge[0] != edge[1] {
                self.outlines.push(edge);
            }
        }
        polygon
            .iter()
            .for_each(|&corner| self.counts[0][corner as usize] = true);
    }

    fn problems(&self, tolerance: f64) -> Vec<String> {
        let mut problems = Vec::new();
        let (most, found) = (self.most, self.stored_count);
        // Only small ones may be missing, and none may be added.
        let polygons = if self.cut > 0 { self.cut } else { 0 };
        if found > most || found + self.small + polygons < most {
            problems.push(format!(
                "has {most} triangles in the source and {found} in the file"
            ));
        }
        let (missing, others) = difference(&self.source, &self.stored);
        if let Some(triangle) = missing.first() {
            problems.push(format!(
                "{} triangles of the source are not in the file; the first is {}",
                missing.len(),
                self.corners(triangle)
            ));
        }
        if self.cut == 0 {
            if let Some(triangle) = others.first() {
                problems.push(format!(
                    "{} triangles of the file are not in the source; the first is {}",
                    others.len(),
                    self.corners(triangle)
                ));
            }
        } else if missing.is_empty() {
            problems.extend(self.outline_problem(&others));
        }
        // A corner that moves by the tolerance on each axis changes an area by less than the perimeter times that;
        // triangles that were left out have less than that, too.
        let slack = 2.0 * tolerance * self.perimeter
            + 8.0 * tolerance * tolerance * self.most as f64
            + 2e-6 * self.area[0];
        let [source, stored] = self.area;
        if stored < source - slack || (self.is_area_certain && stored > source + slack) {
            problems.push(format!(
                "its area is {source} in the source and {stored} in the file"
            ));
        }
        problems
    }

    /// Whether the triangles `cut` have the outlines of the polygons.
    fn outline_problem(&self, cut: &[[u32; 3]]) -> Option<String> {
        if cut.len() > self.cut {
            return Some(format!(
                "its polygons make at most {} triangles, and the file has {}",
                self.cut,
                cut.len()
            ));
        }
        let inner = cut.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let signed = |[a, b]: [u32; 2], sign: i64| match a < b {
            true => ([a, b], sign),
            false => ([b, a], -sign),
        };
        let outlines = self.outlines.iter().map(|&edge| signed(edge, -1));
        let mut edges: Vec<_> = inner.map(|edge| signed(edge, 1)).chain(outlines).collect();
        edges.sort_unstable();
        let mut wrong = edges
            .chunk_by(|a, b| a.0 == b.0)
            .filter(|edges| edges.iter().map(|(_, sign)| sign).sum::<i64>() != 0);
        let edge = wrong.next()?[0].0;
        let [a, b] = edge.map(|cluster| self.example[cluster as usize]);
        Some(format!(
            "the triangles do not cover its polygons: {} edges differ, the first from {a:?} to {b:?}",
            1 + wrong.count()
        ))
    }

    fn corners(&self, triangle: &[u32; 3]) -> String {
        let [a, b, c] = triangle.map(|cluster| self.example[cluster as usize]);
        format!("{a:?}, {b:?}, {c:?}")
    }
}

/// What is in one of two sorted lists only, as often as it is there more often.
fn difference(a: &[[u32; 3]], b: &[[u32; 3]]) -> (Vec<[u32; 3]>, Vec<[u32; 3]>) {
    let (mut only_a, mut only_b) = (Vec::new(), Vec::new());
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        match a[i].cmp(&b[j]) {
            std::cmp::Ordering::Less => {
                only_a.push(a[i]);
                i += 1;
            }
            std::cmp::Ordering::Greater => {
                only_b.push(b[j]);
                j += 1;
            }
            std::cmp::Ordering::Equal => (i, j) = (i + 1, j + 1),
        }
    }
    only_a.extend(&a[i..]);
    only_b.extend(&b[j..]);
    (only_a, only_b)
}

/// Per cluster the boxes of the vertices on both sides.
struct Boxes {
    displacement: f64,
    /// The cluster with the largest difference, by its two boxes.
    worst: Option<(Extent, Extent)>,
}

impl Boxes {
    /// Vertices of faces that are left out may be missing on the other side. So the box of the vertices that
    /// count is compared with the box of all vertices of the other side.
    fn new(points: &[Point], stored: &Stored, clusters: &Clusters, faces: &Faces) -> Self {
        let boxes = |numbers: &[u32], points: &[Point], counts: &[bool]| {
            let mut boxes = vec![[Extent::NONE; 2]; clusters.count];
            for ((&number, &point), &counts) in numbers.iter().zip(points).zip(counts) {
                boxes[number as usize][0].add(point);
                if counts {
                    boxes[number as usize][1].add(point);
                }
            }
            boxes
        };
        let source = boxes(&clusters.first, points, &faces.counts[0]);
        let stored = boxes(&clusters.second, &stored.points, &faces.counts[1]);
        let mut found = Self {
            displacement: 0.0,
            worst: None,
        };
        for ([all_a, a], [all_b, b]) in source.into_iter().zip(stored) {
            let one_way =
                |counted: &Extent, all: &Extent| match (counted.is_empty(), all.is_empty()) {
                    (true, _) => 0.0,
                    (false, true) => f64::INFINITY,
                    (false, false) => counted.beyond(all),
                };
            let apart = one_way(&a, &all_b).max(one_way(&b, &all_a));
            if apart > found.displacement {
                found.displacement = apart;
                found.worst = Some((all_a, all_b));
            }
        }
        found
    }

    fn problem(&self, tolerance: f64) -> Option<String> {
        let (source, stored) = self.worst.as_ref()?;
        if self.displacement <= tolerance {
            return None;
        }
        Some(match (source.is_empty(), stored.is_empty()) {
            (true, _) => format!(
                "the file has a vertex at {:?}, the source has none there",
                stored.min
            ),
            (_, true) => format!(
                "the source has a vertex at {:?}, the file has none there",
                source.min
            ),
            _ => format!(
                "a vertex is at {:?} in the source and at {:?} in the file, {:.1e} apart; rounding explains {tolerance:.1e}",
                source.min, stored.min, self.displacement
            ),
        })
    }
}
