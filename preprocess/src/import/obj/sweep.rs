//! Polygons into triangles by a sweep, in O(n log n) for any polygon.
//!
//! Ears (`earcut`), constrained Delaunay triangulations (`spade`) and overlays (`i_overlay`) all take the square of
//! the corners on some combs, stars or serpentines: seconds to minutes at 100 000 corners. This sweep does not.
//!
//! Vertices are visited from left to right. The edges that cross the sweep line are kept from bottom to top, each
//! with the region above it. A region is inside where the polygon winds round it. It is triangulated as a monotone
//! polygon while the sweep goes on (de Berg et al., Computational Geometry, chapter 3, with the two passes in one).
//! What a bridge to a hole, a spike or a touching vertex needs is done on the edges: those that run to and fro
//! cancel, and those with a vertex on them are split there. Orientation is exact (Shewchuk's predicates), so only
//! edges that properly cross stop the sweep; neighbours are tested as Shamos and Hoey do. No vertex is added.

use robust::{Coord, orient2d};
use std::cmp::Ordering;
use std::collections::BTreeMap;

pub(super) type Point = [f64; 2];

/// Edges of the polygon cross in a point that is no vertex.
#[derive(Debug, PartialEq)]
pub(super) struct Crossing;

/// What a sweep found.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Triangles {
    /// Corner numbers; each triangle turns as the polygon does round it.
    pub(super) corners: Vec<[usize; 3]>,
    /// Whether the polygon winds more than once round some of them.
    pub(super) overlaps: bool,
}

/// Cuts a polygon into triangles whose corners are its corners. Of corners in the same place, the triangles use
/// the first.
pub(super) fn triangulate(polygon: &[Point]) -> Result<Triangles, Crossing> {
    let mut sweep = Sweep::new(polygon);
    for vertex in 0..sweep.points.len() {
        sweep.visit(vertex)?;
    }
    let corner = |triangle: [usize; 3]| triangle.map(|vertex| sweep.corners[vertex]);
    Ok(Triangles {
        corners: sweep.triangles.iter().copied().map(corner).collect(),
        overlaps: sweep.overlaps,
    })
}

/// An edge that crosses the sweep line, or a place at the sweep line.
#[derive(Clone, Copy, Debug)]
struct Edge {
    left: Point,
    right: Point,
    /// The vertex at the right end.
    end: usize,
    /// How much larger the winding number is above the edge than below it.
    count: i64,
    /// `Less` and `Greater`: not an edge but the place just below or above `left`.
    place: Ordering,
}

impl Edge {
    fn place(point: Point, place: Ordering) -> Self {
        Self {
            left: point,
            right: point,
            end: 0,
            count: 0,
            place,
        }
    }

    /// On which side of the edge a point lies: `Greater` is above.
    fn side(&self, point: Point) -> Ordering {
        turn(self.left, self.right, point)
    }

    /// Whether the edges cross in a point that is no end of either.
    fn crosses(&self, other: &Self) -> bool {
        let apart = |a: Ordering, b: Ordering| a != Ordering::Equal && a == b.reverse();
        apart(self.side(other.left), self.side(other.right))
            && apart(other.side(self.left), other.side(self.right))
    }
}

/// From bottom to top along the sweep line.
impl Ord for Edge {
    fn cmp(&self, other: &Self) -> Ordering {
        match (self.place, other.place) {
            (Ordering::Equal, Ordering::Equal) => {}
            (Ordering::Equal, place) => {
                return self.side(other.left).reverse().then(place.reverse());
            }
            (place, Ordering::Equal) => return other.side(self.left).then(place),
            (a, b) => return a.cmp(&b),
        }
        // Edges in the set overlap along the sweep, so the later left end decides.
        if before(self.left, other.left) != Ordering::Greater {
            let side = self.side(other.left).then(self.side(other.right));
            side.reverse()
        } else {
            other.side(self.left).then(other.side(self.right))
        }
    }
}

impl PartialOrd for Edge {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Edge {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Edge {}

/// The order in which points are visited.
fn before(a: Point, b: Point) -> Ordering {
    a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
}

/// `Greater` where `c` lies to the left of the way from `a` to `b`.
fn turn(a: Point, b: Point, c: Point) -> Ordering {
    let [a, b, c] = [a, b, c].map(|[x, y]| Coord { x, y });
    // The sum turns -0 into 0.
    (orient2d(a, b, c) + 0.0).total_cmp(&0.0)
}

/// What lies above an edge.
#[derive(Clone, Copy, Debug, Default)]
struct Region {
    winding: i64,
    /// The parts of the region from bottom to top; none outside. There are two where a vertex closed a gap
    /// between two regions, until the next vertex parts them.
    lower: Option<usize>,
    upper: Option<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    Bottom,
    Top,
}

/// A monotone polygon, of which all but this is triangulated: a chain of vertices along one side, the first of
/// which is the latest of the other side.
#[derive(Debug)]
struct Section {
    chain: Vec<usize>,
    side: Side,
    /// Whether the polygon runs clockwise round it.
    clockwise: bool,
}

struct Sweep {
    /// The places of corners, from left to right.
    points: Vec<Point>,
    /// The first corner at each.
    corners: Vec<usize>,
    /// The edges that go right from each: end and count.
    rights: Vec<Vec<(usize, i64)>>,
    line: BTreeMap<Edge, Region>,
    sections: Vec<Section>,
    triangles: Vec<[usize; 3]>,
    overlaps: bool,
}

impl Sweep {
    fn new(polygon: &[Point]) -> Self {
        // 0 and -0 are one place.
        let polygon: Vec<Point> = polygon.iter().map(|point| point.map(|x| x + 0.0)).collect();
        let mut order: Vec<usize> = (0..polygon.len()).collect();
        order.sort_unstable_by(|&a, &b| before(polygon[a], polygon[b]).then(a.cmp(&b)));
        let mut corners: Vec<usize> = Vec::new();
        let mut vertex_of = vec![0; polygon.len()];
        for corner in order {
            if corners
                .last()
                .is_none_or(|&last| polygon[last] != polygon[corner])
            {
                corners.push(corner);
            }
            vertex_of[corner] = corners.len() - 1;
        }
        let mut rights = vec![Vec::new(); corners.len()];
        let next = vertex_of.iter().cycle().skip(1);
        for (&from, &to) in vertex_of.iter().zip(next) {
            match from.cmp(&to) {
                Ordering::Less => rights[from].push((to, 1)),
                Ordering::Greater => rights[to].push((from, -1)),
                Ordering::Equal => {}
            }
        }
        Self {
            points: corners.iter().map(|&corner| polygon[corner]).collect(),
            corners,
            rights,
            line: BTreeMap::new(),
            sections: Vec::new(),
            triangles: Vec::new(),
            overlaps: false,
        }
    }

    fn visit(&mut self, vertex: usize) -> Result<(), Crossing> {
        let point = self.points[vertex];
        let [low, high] = [Ordering::Less, Ordering::Greater].map(|side| Edge::place(point, side));
        let below = self.line.range(..low).next_back().map(|(edge, _)| *edge);
        let above = self.line.range(high..).next().map(|(edge, _)| *edge);
        // The edges that end here or go on behind this vertex.
        let ending: Vec<Edge> = self.line.range(low..high).map(|(edge, _)| *edge).collect();
        let mut under = below.map_or(Region::default(), |edge| self.line[&edge]);
        let mut over = under;
        for (number, edge) in ending.iter().enumerate() {
            if number > 0 {
                self.close(over, vertex);
            }
            over = self.line.remove(edge).unwrap_or_default();
            if edge.end != vertex {
                self.rights[vertex].push((edge.end, edge.count));
            }
        }
        let starting = self.starting(vertex);
        match (ending.is_empty(), starting.is_empty()) {
            (true, true) => return Ok(()),
            (true, false) => (under, over) = self.part(under, vertex),
            (false, no_start) => {
                under = self.touch(under, vertex, Side::Top);
                over = self.touch(over, vertex, Side::Bottom);
                if no_start {
                    (under.upper, over) = (over.lower, Region::default());
                }
            }
        }
        if let Some(below) = below {
            self.line.insert(below, under);
        }
        let mut winding = under.winding;
        for (number, &edge) in starting.iter().enumerate() {
            winding += edge.count;
            let region = match number + 1 == starting.len() {
                true => over,
                false => self.begin(winding, vertex),
            };
            self.line.insert(edge, region);
        }
        let (first, last) = match starting.as_slice() {
            [] => (above, below),
            [first, .., last] | [first @ last] => (Some(*first), Some(*last)),
        };
        let cross = |pair: Option<(Edge, Edge)>| pair.is_some_and(|(a, b)| a.crosses(&b));
        match cross(below.zip(first)) || cross(last.zip(above)) {
            true => Err(Crossing),
            false => Ok(()),
        }
    }

    /// The edges that go right from a vertex, from bottom to top. Of edges that lie on each other only the
    /// shortest starts here; the others start at its end.
    fn starting(&mut self, vertex: usize) -> Vec<Edge> {
        let left = self.points[vertex];
        let edge = |&(end, count): &(usize, i64)| Edge {
            left,
            right: self.points[end],
            end,
            count,
            place: Ordering::Equal,
        };
        let mut edges: Vec<Edge> = self.rights[vertex].iter().map(edge).collect();
        edges.sort_by(|a, b| a.cmp(b).then(a.end.cmp(&b.end)));
        let mut starting: Vec<Edge> = Vec::with_capacity(edges.len());
        for edge in edges {
            match starting.last_mut() {
                Some(last) if *last == edge => {
                    last.count += edge.count;
                    if edge.end != last.end {
                        self.rights[last.end].push((edge.end, edge.count));
                    }
                }
                _ => starting.push(edge),
            }
        }
        starting.retain(|edge| edge.count != 0);
        starting
    }

    /// A region that a vertex begins.
    fn begin(&mut self, winding: i64, vertex: usize) -> Region {
        let chain = vec![vertex];
        let lower = (winding != 0).then(|| self.section(chain, Side::Bottom, winding < 0));
        self.overlaps |= winding.abs() > 1;
        Region {
            winding,
            lower,
            upper: None,
        }
    }

    fn section(&mut self, chain: Vec<usize>, side: Side, clockwise: bool) -> usize {
        self.sections.push(Section {
            chain,
            side,
            clockwise,
        });
        self.sections.len() - 1
    }

    /// A vertex lies on the given side of a region.
    fn touch(&mut self, mut region: Region, vertex: usize, side: Side) -> Region {
        if let (Some(lower), Some(upper)) = (region.lower, region.upper.take()) {
            let (ends, goes_on) = match side {
                Side::Bottom => (lower, upper),
                Side::Top => (upper, lower),
            };
            self.finish(ends, vertex);
            region.lower = Some(goes_on);
        }
        if let Some(section) = region.lower {
            self.add(section, vertex, side);
        }
        region
    }

    /// A vertex parts a region into one below and one above.
    fn part(&mut self, region: Region, vertex: usize) -> (Region, Region) {
        let Some(lower) = region.lower else {
            return (region, region);
        };
        let winding = region.winding;
        let (lower, upper) = match region.upper {
            Some(upper) => {
                self.add(lower, vertex, Side::Top);
                self.add(upper, vertex, Side::Bottom);
                (lower, upper)
            }
            None => {
                let Section {
                    ref chain,
                    side,
                    clockwise,
                } = self.sections[lower];
                let latest = chain[chain.len() - 1];
                let other = match side {
                    Side::Bottom => Side::Top,
                    Side::Top => Side::Bottom,
                };
                let new = self.section(vec![latest, vertex], other, clockwise);
                self.add(lower, vertex, side);
                match side {
                    Side::Bottom => (new, lower),
                    Side::Top => (lower, new),
                }
            }
        };
        let region = |section| Region {
            winding,
            lower: Some(section),
            upper: None,
        };
        (region(lower), region(upper))
    }

    /// A vertex ends a region.
    fn close(&mut self, region: Region, vertex: usize) {
        for section in [region.lower, region.upper].into_iter().flatten() {
            self.finish(section, vertex);
        }
    }

    fn finish(&mut self, section: usize, vertex: usize) {
        let chain = std::mem::take(&mut self.sections[section].chain);
        let clockwise = self.sections[section].clockwise;
        for pair in chain.windows(2) {
            self.emit([pair[0], pair[1], vertex], clockwise);
        }
    }

    /// Adds a vertex on one side of a section and cuts off all triangles it allows.
    fn add(&mut self, section: usize, vertex: usize, side: Side) {
        let Section {
            side: chain_side,
            clockwise,
            ..
        } = self.sections[section];
        let mut chain = std::mem::take(&mut self.sections[section].chain);
        if chain.len() > 1 && side != chain_side {
            for pair in chain.windows(2) {
                self.emit([pair[0], pair[1], vertex], clockwise);
            }
            chain.drain(..chain.len() - 1);
        }
        let inside = match side {
            Side::Bottom => Ordering::Greater,
            Side::Top => Ordering::Less,
        };
        while let [.., a, b] = chain[..]
            && turn(self.points[a], self.points[b], self.points[vertex]) == inside
        {
            self.emit([a, b, vertex], clockwise);
            chain.pop();
        }
        chain.push(vertex);
        self.sections[section].chain = chain;
        self.sections[section].side = side;
    }

    /// Adds a triangle, unless it has no area.
    fn emit(&mut self, [a, b, c]: [usize; 3], clockwise: bool) {
        let triangle = match turn(self.points[a], self.points[b], self.points[c]) {
            Ordering::Equal => return,
            Ordering::Greater => [a, b, c],
            Ordering::Less => [a, c, b],
        };
        let [a, b, c] = triangle;
        self.triangles
            .push(if clockwise { [a, c, b] } else { triangle });
    }
}
