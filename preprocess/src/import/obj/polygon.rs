//! Polygons into triangles: `n` corners make `n - 2` triangles, whatever their shape.
//!
//! A convex polygon is a fan. A concave one would stick out of itself as a fan; its ears are cut instead.

use earcut::Earcut;
use earcut::utils3d::project3d_to_2d;
use glam::{DVec3, Vec3};

/// Cutting ears takes at most about the cube of the corners. All concave polygons of a file together may
/// take this; it is minutes of nobody's time, and far above what models need: 30 000 polygons of 100 corners.
const MAX_WORK: u64 = 1 << 35;

/// Cuts polygons one after the other.
pub(super) struct Cutter {
    ears: Earcut<f64>,
    corners: Vec<[f64; 3]>,
    flat: Vec<[f64; 2]>,
    cut: Vec<u32>,
    work_left: u64,
    /// Concave polygons that became fans nevertheless: they cross themselves, or there was no work left.
    pub(super) fans: usize,
}

impl Cutter {
    pub(super) fn new() -> Self {
        Self {
            ears: Earcut::new(),
            corners: Vec::new(),
            flat: Vec::new(),
            cut: Vec::new(),
            work_left: MAX_WORK,
            fans: 0,
        }
    }

    pub(super) fn warnings(&self) -> impl Iterator<Item = String> {
        let fans = Some(self.fans).filter(|&fans| fans > 0);
        let what = "concave polygons that cross themselves or are too many, cut as fans";
        fans.map(|fans| format!("{what}: {fans}")).into_iter()
    }

    /// Appends the triangles of a polygon of at least three corners to `triangles`.
    pub(super) fn cut(
        &mut self,
        polygon: &[u32],
        positions: &[Vec3],
        line: u32,
        triangles: &mut Vec<u32>,
    ) {
        let _ = line;
        if polygon.len() == 3 {
            triangles.extend(polygon);
            return;
        }
        let corner = |&index: &u32| positions[index as usize].as_dvec3();
        if is_convex(polygon.iter().map(corner)) {
            fan(polygon, triangles);
            return;
        }
        let work = (polygon.len() as u64).saturating_pow(3);
        self.corners.clear();
        self.corners
            .extend(polygon.iter().map(|index| corner(index).to_array()));
        if let Some(left) = self.work_left.checked_sub(work)
            && project3d_to_2d(&self.corners, polygon.len(), &mut self.flat)
        {
            self.work_left = left;
            self.ears
                .earcut(self.flat.iter().copied(), &[], &mut self.cut);
            // Where corners coincide or edges cross, it leaves triangles out.
            if self.cut.len() == 3 * (polygon.len() - 2) {
                triangles.extend(self.cut.iter().map(|&corner| polygon[corner as usize]));
                return;
            }
        }
        self.fans += 1;
        fan(polygon, triangles);
    }
}

fn fan(polygon: &[u32], triangles: &mut Vec<u32>) {
    triangles.extend(
        polygon[1..]
            .windows(2)
            .flat_map(|edge| [polygon[0], edge[0], edge[1]]),
    );
}

/// Whether no corner turns against the polygon's own sense. (A star that winds round more than once passes;
/// no cut is right for it.)
fn is_convex(corners: impl ExactSizeIterator<Item = DVec3> + Clone) -> bool {
    let next = |by: usize| corners.clone().cycle().skip(by);
    let corner = || corners.clone().zip(next(1)).zip(next(2));
    let turn = |((a, b), c): ((DVec3, DVec3), DVec3)| (b - a).cross(c - b);
    let area: DVec3 = corners.clone().zip(next(1)).map(|(a, b)| a.cross(b)).sum();
    corner().all(|corner| turn(corner).dot(area) >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(points: &[[f32; 3]]) -> (Vec<u32>, usize) {
        let positions: Vec<Vec3> = points.iter().copied().map(Vec3::from).collect();
        let polygon: Vec<u32> = (0..points.len() as u32).collect();
        let (mut cutter, mut triangles) = (Cutter::new(), Vec::new());
        cutter.cut(&polygon, &positions, 1, &mut triangles);
        (triangles, cutter.fans)
    }

    /// Twice the area of the triangles, with the sign of their turn about +x.
    fn areas(points: &[[f32; 3]], triangles: &[u32]) -> Vec<f32> {
        let corner = |index: u32| Vec3::from(points[index as usize]);
        let area = |t: &[u32]| {
            (corner(t[1]) - corner(t[0]))
                .cross(corner(t[2]) - corner(t[0]))
                .x
        };
        triangles.chunks_exact(3).map(area).collect()
    }

    #[test]
    fn a_convex_polygon_is_a_fan() {
        let (triangles, fans) = cut(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!((triangles.as_slice(), fans), (&[0, 1, 2, 0, 2, 3][..], 0));
    }

    /// An arrow head in the yz plane, with the notch at each of its corners in turn.
    #[test]
    fn a_concave_polygon_is_covered_once() {
        let arrow = [
            [2.0, 0.0, 0.0],
            [2.0, 4.0, 2.0],
            [2.0, 0.0, 4.0],
            [2.0, 1.0, 2.0],
        ];
        for first in 0..4 {
            let mut points = arrow;
            points.rotate_left(first);
            let (triangles, fans) = cut(&points);
            let areas = areas(&points, &triangles);
            assert_eq!((areas.len(), fans), (2, 0));
            assert!(areas.iter().all(|&area| area > 0.0), "{areas:?}");
            assert_eq!(areas.iter().sum::<f32>(), 12.0);
        }
    }

    #[test]
    fn the_count_holds_where_there_is_nothing_right_to_do() {
        let bow_tie = [
            [0.0; 3],
            [0.0, 1.0, 1.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 3.0, 3.0],
        ];
        let line: [[f32; 3]; 6] = std::array::from_fn(|i| [i as f32; 3]);
        for points in [&bow_tie[..], &line, &[[7.0; 3]; 9]] {
            assert_eq!(cut(points).0.len(), 3 * (points.len() - 2));
        }
    }

    #[test]
    fn work_is_bounded() {
        let comb: Vec<[f32; 3]> = (0..4000)
            .map(|i| [0.0, i as f32, if i % 2 == 0 { 1.0 } else { 5.0 }])
            .chain([[0.0, 4000.0, 0.0], [0.0, 0.0, 0.0]])
            .collect();
        let (triangles, fans) = cut(&comb);
        assert_eq!((triangles.len(), fans), (3 * (comb.len() - 2), 1));
    }
}
