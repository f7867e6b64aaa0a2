//! The area of a polygon, where it has one that does not depend on how the polygon is cut.

use super::affine::{Extent, Point, cross, length, sub};

/// Pairs of edges that are tested for all polygons of one object.
const MAX_PAIRS: u64 = 20_000_000;
/// A polygon is flat if its corners are this close to a plane, as a share of its size. Its area then is that of its
/// projection to within a millionth, however it is cut, unless its triangles are very thin.
const FLATNESS: f64 = 1e-6;

/// Measures polygons.
pub(super) struct Measure {
    pairs_left: u64,
}

impl Default for Measure {
    fn default() -> Self {
        Self {
            pairs_left: MAX_PAIRS,
        }
    }
}

impl Measure {
    /// The length of the sum of the area vectors, which no cut can have less area than, and whether the area of
    /// every cut that covers the polygon once is the same.
    pub(super) fn area(&mut self, corners: &[Point]) -> (f64, bool) {
        let zero = corners[0];
        let mut sum = [0.0; 3];
        for edge in corners.windows(2) {
            let area = cross(sub(edge[0], zero), sub(edge[1], zero));
            (0..3).for_each(|axis| sum[axis] += 0.5 * area[axis]);
        }
        let area = length(sum);
        let size = Extent::of(corners).size();
        let height = |corner: &Point| {
            let along = sub(*corner, zero);
            (along[0] * sum[0] + along[1] * sum[1] + along[2] * sum[2]).abs() / area
        };
        let is_flat = area > 1e-9 * size * size
            && corners
                .iter()
                .all(|corner| height(corner) <= FLATNESS * size);
        (area, is_flat && self.is_simple(corners, sum))
    }

    /// Whether no two edges cross. Edges may touch and coincide, as those that lead to a hole and back do.
    fn is_simple(&mut self, corners: &[Point], normal: Point) -> bool {
        let drop = (0..3)
            .max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()))
            .unwrap_or(2);
        let flat = |corner: &Point| [corner[(drop + 1) % 3], corner[(drop + 2) % 3]];
        let flat: Vec<[f64; 2]> = corners.iter().map(flat).collect();
        let mut edges: Vec<[[f64; 2]; 2]> = (0..flat.len())
            .map(|i| [flat[i], flat[(i + 1) % flat.len()]])
            .collect();
        let low = |edge: &[[f64; 2]; 2]| edge[0][0].min(edge[1][0]);
        edges.sort_by(|a, b| low(a).total_cmp(&low(b)));
        for (i, edge) in edges.iter().enumerate() {
            let high = edge[0][0].max(edge[1][0]);
            for other in edges[i + 1..].iter().take_while(|other| low(other) <= high) {
                match self.pairs_left.checked_sub(1) {
                    Some(left) => self.pairs_left = left,
                    None => return false,
                }
                if cross_properly(edge, other) {
                    return false;
                }
            }
        }
        true
    }
}

fn cross_properly(a: &[[f64; 2]; 2], b: &[[f64; 2]; 2]) -> bool {
    let side = |of: &[[f64; 2]; 2], p: [f64; 2]| {
        let [o, d] = *of;
        (d[0] - o[0]) * (p[1] - o[1]) - (d[1] - o[1]) * (p[0] - o[0])
    };
    side(a, b[0]) * side(a, b[1]) < 0.0 && side(b, a[0]) * side(b, a[1]) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_and_whether_they_are_certain() {
        let area = |corners: &[[f64; 2]], z: f64| {
            let lift = |(i, &[x, y]): (usize, &[f64; 2])| [x, y, if i == 0 { z } else { 0.0 }];
            let corners: Vec<Point> = corners.iter().enumerate().map(lift).collect();
            Measure::default().area(&corners)
        };
        let arrow = [[0.0, 0.0], [4.0, 2.0], [0.0, 4.0], [1.0, 2.0]];
        assert_eq!(area(&arrow, 0.0), (6.0, true));
        assert!(!area(&arrow, 1.0).1);
        let bow_tie = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]];
        assert!(!area(&bow_tie, 0.0).1);
        // A square with a square hole, the way there and back along one edge.
        let ring = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        assert_eq!(area(&ring, 0.0), (15.0, true));
    }
}
