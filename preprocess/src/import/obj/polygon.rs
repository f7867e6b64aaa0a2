//! Polygons into triangles.
//!
//! A convex polygon is a fan: `n` corners make `n - 2` triangles. Any other is cut by a sweep ([`super::sweep`]),
//! which covers what the polygon winds round, once, and adds no vertex.

use super::sweep::{Point, triangulate};
use glam::{DVec3, Vec3};

/// Cuts polygons one after the other.
#[derive(Default)]
pub(super) struct Cutter {
    corners: Vec<DVec3>,
    /// Polygons that cross themselves and became fans.
    fans: Counted,
    /// Polygons that wind more than once round some of their area, which is filled once.
    overlaps: Counted,
}

#[derive(Default)]
struct Counted {
    count: usize,
    first_line: u32,
}

impl Counted {
    fn add(&mut self, line: u32) {
        if self.count == 0 {
            self.first_line = line;
        }
        self.count += 1;
    }
}

impl Cutter {
    /// What was cut otherwise than it may have been meant.
    pub(super) fn warnings(&self) -> Vec<String> {
        let counts = [
            (
                &self.fans,
                "polygons that cross themselves, cut as fans; cut them into triangles before the export",
            ),
            (
                &self.overlaps,
                "polygons that overlap themselves, filled once",
            ),
        ];
        let counts = counts.into_iter().filter(|(counted, _)| counted.count > 0);
        let warning = |(counted, what): (&Counted, &str)| {
            let Counted { count, first_line } = counted;
            format!("{what}: {count}, the first on line {first_line}")
        };
        counts.map(warning).collect()
    }

    /// Appends the triangles of a polygon of at least three corners, which stands on `line`, to `triangles`.
    pub(super) fn cut(
        &mut self,
        polygon: &[u32],
        positions: &[Vec3],
        line: u32,
        triangles: &mut Vec<u32>,
    ) {
        let corner = |&index: &u32| positions[index as usize].as_dvec3();
        self.corners.clear();
        self.corners.extend(polygon.iter().map(corner));
        let Some(flat) = flat(&self.corners) else {
            // All corners lie on a line: nothing is to be seen of it.
            fan(polygon, triangles);
            return;
        };
        if is_convex(&flat) {
            fan(polygon, triangles);
            return;
        }
        match triangulate(&flat) {
            Ok(found) => {
                if found.overlaps {
                    self.overlaps.add(line);
                }
                let corners = found.corners.iter().flatten();
                triangles.extend(corners.map(|&corner| polygon[corner]));
            }
            Err(_) => {
                self.fans.add(line);
                fan(polygon, triangles);
            }
        }
    }
}

fn fan(polygon: &[u32], triangles: &mut Vec<u32>) {
    triangles.extend(
        polygon[1..]
            .windows(2)
            .flat_map(|edge| [polygon[0], edge[0], edge[1]]),
    );
}

/// The corners without the coordinate along which the polygon's normal is longest, turned so that the polygon
/// runs counterclockwise. No coordinate is rounded: what coincides or lies on a line in space does so here. None
/// if all corners lie on a line.
fn flat(corners: &[DVec3]) -> Option<Vec<Point>> {
    let first = corners[0];
    let edges = corners[1..].windows(2);
    let cross = |edge: &[DVec3]| (edge[0] - first).cross(edge[1] - first);
    let mut normal: DVec3 = edges.clone().map(cross).sum();
    if normal == DVec3::ZERO {
        // The loops of an eight may cancel.
        normal = edges.map(cross).map(DVec3::abs).sum();
    }
    let axis = normal.abs().max_position();
    let (x, y) = ((axis + 1) % 3, (axis + 2) % 3);
    let turned = normal[axis] < 0.0;
    let flatten = |corner: &DVec3| match turned {
        true => [corner[y], corner[x]],
        false => [corner[x], corner[y]],
    };
    (normal[axis] != 0.0).then(|| corners.iter().map(flatten).collect())
}

/// Whether each corner turns to the left and the polygon runs round once.
fn is_convex(corners: &[Point]) -> bool {
    let count = corners.len();
    let edge = |i: usize| {
        let [from, to] = [corners[i % count], corners[(i + 1) % count]];
        [to[0] - from[0], to[1] - from[1]]
    };
    let turns_left = |i: usize| {
        let [a, b] = [edge(i), edge(i + 1)];
        a[0] * b[1] - a[1] * b[0] > 0.0
    };
    // A polygon that runs round once goes from left to right once.
    let goes_right = |i: usize| edge(i)[0] > 0.0 || (edge(i)[0] == 0.0 && edge(i)[1] < 0.0);
    let starts = (0..count).filter(|&i| goes_right(i + 1) && !goes_right(i));
    (0..count).all(turns_left) && starts.count() == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The triangles of a polygon, and how many warnings there were.
    fn cut(points: &[[f32; 3]]) -> (Vec<u32>, usize) {
        let positions: Vec<Vec3> = points.iter().copied().map(Vec3::from).collect();
        let polygon: Vec<u32> = (0..points.len() as u32).collect();
        let (mut cutter, mut triangles) = (Cutter::default(), Vec::new());
        cutter.cut(&polygon, &positions, 1, &mut triangles);
        (triangles, cutter.warnings().len())
    }

    /// Twice the area of the triangles, with the sign of their turn about +x.
    fn areas(points: &[[f32; 3]], triangles: &[u32]) -> Vec<f64> {
        let corner = |index: u32| Vec3::from(points[index as usize]).as_dvec3();
        let area = |t: &[u32]| {
            (corner(t[1]) - corner(t[0]))
                .cross(corner(t[2]) - corner(t[0]))
                .x
        };
        triangles.chunks_exact(3).map(area).collect()
    }

    /// A polygon in the yz plane is covered once, by triangles that turn as it does, and uses all its places.
    fn check(name: &str, flat: &[[f32; 2]]) {
        let points: Vec<[f32; 3]> = flat.iter().map(|&[y, z]| [0.5, y, z]).collect();
        let start = std::time::Instant::now();
        let (triangles, warnings) = cut(&points);
        let seconds = start.elapsed().as_secs_f64();
        assert!(seconds < 5.0, "{name}: {seconds} s");
        assert_eq!(warnings, 0, "{name}");
        let wide = |p: &[f32; 2]| p.map(f64::from);
        let next = flat.iter().cycle().skip(1);
        let cross = |(a, b): (&[f32; 2], &[f32; 2])| {
            let ([a, b], [c, d]) = (wide(a), wide(b));
            a * d - b * c
        };
        let expected: f64 = flat.iter().zip(next).map(cross).sum();
        let areas = areas(&points, &triangles);
        assert!(
            areas.iter().all(|area| area * expected > 0.0),
            "{name}: a triangle turns back"
        );
        let found: f64 = areas.iter().sum();
        assert!(
            (found - expected).abs() <= 1e-9 * expected.abs(),
            "{name}: {found} of {expected}"
        );
        let place = |index: u32| flat[index as usize].map(f32::to_bits);
        let used: std::collections::HashSet<_> =
            triangles.iter().map(|&index| place(index)).collect();
        let all: std::collections::HashSet<_> = (0..flat.len() as u32).map(place).collect();
        assert_eq!(
            used.len(),
            all.len(),
            "{name}: a corner in an edge opens a crack"
        );
    }

    /// A plate with `n` by `n` holes of 2 `k` corners, joined to its left edge by bridges along each row.
    fn plate(n: usize, k: usize) -> Vec<[f32; 2]> {
        let mut plate = vec![
            [0.0, 0.0],
            [n as f32, 0.0],
            [n as f32, n as f32],
            [0.0, n as f32],
        ];
        for row in (0..n).rev() {
            let y = row as f32 + 0.5;
            let hole = |column: usize, i: usize| {
                let angle = i as f32 / k as f32 * std::f32::consts::PI;
                let x = column as f32 + 0.5;
                match i {
                    0 => [x - 0.3, y],
                    _ if i == k => [x + 0.3, y],
                    _ if i == 2 * k => [x - 0.3, y],
                    _ => [x - 0.3 * angle.cos(), y + 0.3 * angle.sin()],
                }
            };
            plate.push([0.0, y]);
            plate.extend((0..n).flat_map(|column| (0..=k).map(move |i| hole(column, i))));
            plate.extend(
                (0..n)
                    .rev()
                    .flat_map(|column| (k..=2 * k).map(move |i| hole(column, i))),
            );
            plate.push([0.0, y]);
        }
        plate
    }

    fn star(count: usize, inner: impl Fn(usize) -> f32) -> Vec<[f32; 2]> {
        let corner = |i: usize| {
            let (sin, cos) = (i as f64 / count as f64 * std::f64::consts::TAU).sin_cos();
            let radius = if i.is_multiple_of(2) {
                1000.0
            } else {
                f64::from(inner(i))
            };
            [(radius * cos) as f32, (radius * sin) as f32]
        };
        (0..count).map(corner).collect()
    }

    fn comb(count: usize, step: f32, length: f32) -> Vec<[f32; 2]> {
        let tooth = |i: usize| {
            [
                i as f32 * step,
                if i.is_multiple_of(2) { 1.0 } else { length },
            ]
        };
        let back = [[count as f32 * step, 0.0], [0.0, 0.0]];
        (0..count).map(tooth).chain(back).collect()
    }

    fn spiral(count: usize) -> Vec<[f32; 2]> {
        let corner = |i: usize, wider: f64| {
            let angle = i as f64 * 0.05;
            let radius = 1.0 + angle * 0.01 + wider;
            [(radius * angle.cos()) as f32, (radius * angle.sin()) as f32]
        };
        let inwards = (0..count / 2).rev().map(|i| corner(i, 0.03));
        (0..count / 2)
            .map(|i| corner(i, 0.0))
            .chain(inwards)
            .collect()
    }

    /// Long thin strips between two rows of points.
    fn serpentine(count: usize) -> Vec<[f32; 2]> {
        let third = count / 3;
        let row =
            |i: usize, y: f32, by: f32| [i as f32, if i.is_multiple_of(2) { y } else { y + by }];
        let (right, top) = (third as f32, 3.0 + third as f32);
        let strip = |i: usize| [[right + 10.0, i as f32 + 1.0], [10.0, i as f32 + 1.5]];
        let end = [[right + 20.0, top - 0.5]];
        (0..third)
            .map(|i| row(i, 0.0, -0.5))
            .chain((0..third / 2).flat_map(strip))
            .chain(end)
            .chain((0..third).rev().map(|i| row(i, top, 0.5)))
            .collect()
    }

    #[test]
    fn large_polygons_of_any_shape_are_covered_in_little_time() {
        for count in [40, 4000, 100_000] {
            let side = (count as f64 / 26.0).sqrt().ceil() as usize;
            for (name, mut polygon) in [
                ("plate", plate(side, 12)),
                (
                    "star",
                    star(count, |i| 500.0 + 400.0 * (i as f32 * 0.37).sin()),
                ),
                ("thin star", star(count, |_| 1.0)),
                ("comb", comb(count, 1.0, 5.0)),
                ("long comb", comb(count, 0.015625, 5000.0)),
                ("spiral", spiral(count)),
                ("serpentine", serpentine(count)),
            ] {
                let name = format!("{name} of {count}");
                check(&name, &polygon);
                polygon.reverse();
                check(&name, &polygon);
                // Along the other axis.
                polygon.iter_mut().for_each(|p| p.reverse());
                check(&name, &polygon);
            }
        }
    }

    #[test]
    fn bridges_touching_corners_and_corners_on_edges_are_covered_once() {
        let square = [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]];
        // Joined by a bridge, touching a corner, touching an edge, and bridged through a corner of the hole.
        let with = |extra: &[[f32; 2]]| [&square[..], extra].concat();
        let hole = [
            [0.0, 0.0],
            [3.0, 3.0],
            [3.0, 6.0],
            [6.0, 6.0],
            [6.0, 3.0],
            [3.0, 3.0],
            [0.0, 0.0],
        ];
        check("bridge", &with(&hole[..]));
        check(
            "touching a corner",
            &with(&[[0.0, 0.0], [1.0, 8.0], [8.0, 8.0]]),
        );
        check(
            "touching an edge",
            &with(&[[0.0, 5.0], [5.0, 6.0], [5.0, 4.0], [0.0, 5.0]]),
        );
        check(
            "touching an edge from outside",
            &[[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [5.0, 0.0], [0.0, 9.0]],
        );
        check(
            "collinear corners",
            &[
                [0.0, 0.0],
                [1.0, 0.0],
                [2.0, 0.0],
                [5.0, 0.0],
                [5.0, 1.0],
                [5.0, 4.0],
                [3.0, 4.0],
                [0.0, 4.0],
                [0.0, 3.0],
            ],
        );
        check(
            "repeated corners",
            &[
                [0.0, 0.0],
                [0.0, 0.0],
                [4.0, 2.0],
                [4.0, 2.0],
                [4.0, 2.0],
                [0.0, 4.0],
                [1.0, 2.0],
                [1.0, 2.0],
            ],
        );
        for turn in 0..8 {
            let mut bow = [
                [0.0, 0.0],
                [2.0, 1.0],
                [4.0, 0.0],
                [4.0, 4.0],
                [2.0, 1.0],
                [0.0, 4.0],
                [0.0, 3.0],
                [0.0, 2.0],
            ];
            bow.rotate_left(turn);
            check("loops that touch", &bow);
        }
        // A spike has no area, so its end has no triangle.
        let spike = [
            [0.0; 3],
            [0.0, 9.0, 0.0],
            [0.0, 12.0, 0.0],
            [0.0, 9.0, 0.0],
            [0.0, 9.0, 9.0],
        ];
        assert_eq!(cut(&spike), (vec![0, 1, 4], 0));
    }

    #[test]
    fn a_convex_polygon_is_a_fan() {
        let (triangles, fans) = cut(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!((triangles.as_slice(), fans), (&[0, 1, 2, 0, 2, 3][..], 0));
    }

    /// An arrow head in the yz plane, with the notch at each of its corners in turn.
    #[test]
    fn a_concave_polygon_is_covered_once() {
        let mut arrow = [[0.0, 0.0], [4.0, 2.0], [0.0, 4.0], [1.0, 2.0]];
        for _ in 0..4 {
            arrow.rotate_left(1);
            check("arrow head", &arrow);
        }
    }

    #[test]
    fn polygons_that_cross_or_overlap_themselves_have_a_result_and_a_warning() {
        let tie = [[0.0; 3], [0.0, 2.0, 2.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
        assert_eq!(cut(&tie), (vec![0, 1, 2, 0, 2, 3], 1));
        let pentagram = star(10, |_| 0.0).into_iter().step_by(2);
        let order = [0, 2, 4, 1, 3];
        let points: Vec<_> = pentagram.map(|[y, z]| [0.0, y, z]).collect();
        let pentagram = order.map(|i| points[i]);
        assert_eq!(cut(&pentagram).1, 1);
        // Twice round a square: filled once.
        let square = [[0.0; 3], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]];
        let twice = [square, square].concat();
        let (triangles, warnings) = cut(&twice);
        assert_eq!(
            (areas(&twice, &triangles).iter().sum::<f64>(), warnings),
            (2.0, 1)
        );
        // Random corners cross at once, however many there are.
        let mut rng = crate::generate::Rng::new(5);
        let random = |_| [0.0, rng.below(1 << 20) as f32, rng.below(1 << 20) as f32];
        let random: Vec<[f32; 3]> = (0..100_000).map(random).collect();
        assert_eq!(cut(&random).1, 1);
    }

    #[test]
    fn corners_on_a_line_are_a_fan() {
        let line: [[f32; 3]; 6] = std::array::from_fn(|i| [i as f32; 3]);
        for points in [&line[..], &[[7.0; 3]; 9]] {
            assert_eq!(cut(points), (cut(points).0, 0));
            assert_eq!(cut(points).0.len(), 3 * (points.len() - 2));
        }
    }

    /// Polygons on a small grid touch, overlap and cross in every way. Where no edges cross, the triangles cover
    /// each point as often as nonzero winding says: once or not at all.
    #[test]
    fn random_polygons_on_a_grid_are_covered_where_they_wind() {
        let mut rng = crate::generate::Rng::new(3);
        let (mut whole, mut crossed) = (0, 0);
        for _ in 0..50_000 {
            let count = 4 + rng.below(8);
            let size = 2 + rng.below(4);
            let polygon: Vec<Point> = (0..count)
                .map(|_| [rng.below(size) as f64, rng.below(size) as f64])
                .collect();
            let Ok(found) = triangulate(&polygon) else {
                crossed += 1;
                continue;
            };
            whole += 1;
            // A point on no line through two points of the grid.
            for _ in 0..4 {
                let point = [0, 1]
                    .map(|axis| rng.below(size) as f64 + [0.318_309_886, 0.271_828_182][axis]);
                let winding = |corners: &[Point]| -> i64 {
                    let next = corners.iter().cycle().skip(1);
                    let step = |(a, b): (&Point, &Point)| {
                        let left = (b[0] - a[0]) * (point[1] - a[1])
                            - (b[1] - a[1]) * (point[0] - a[0])
                            > 0.0;
                        match (a[1] > point[1], b[1] > point[1]) {
                            (false, true) if left => 1,
                            (true, false) if !left => -1,
                            _ => 0,
                        }
                    };
                    corners.iter().zip(next).map(step).sum()
                };
                let covered: i64 = found
                    .corners
                    .iter()
                    .map(|triangle| winding(&triangle.map(|corner| polygon[corner])))
                    .sum();
                assert_eq!(
                    covered,
                    winding(&polygon).signum(),
                    "{polygon:?} at {point:?}"
                );
            }
        }
        assert!(whole > 5_000 && crossed > 5_000, "{whole} {crossed}");
    }
}
