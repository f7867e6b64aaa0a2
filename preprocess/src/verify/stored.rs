//! The triangles of baked objects in f64, from the numbers in the file.

use super::affine::{Affine, Extent, Point};
use hroc_format::{ArchivedObject, ArchivedScene};

/// Half a unit in the last place of a number between 1 and 2: the relative error of rounding to f32.
const UNIT: f64 = 1.0 / (1_u64 << 24) as f64;
/// Numbers that are smaller are stored as 0.
const SMALLEST: f64 = f32::MIN_POSITIVE as f64;

/// Some baked objects as one list of triangles, in the coordinates of the source.
#[derive(Default)]
pub(super) struct Stored {
    pub(super) points: Vec<Point>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// How far rounding can have moved a coordinate.
    pub(super) tolerance: f64,
    /// Objects whose bounds do not fit their vertices.
    pub(super) wrong_bounds: Vec<u32>,
}

/// Where the zero of an object's coordinates is in the source.
fn zero(scene: &ArchivedScene, object: &ArchivedObject) -> Point {
    scene.cells[object.cell.to_native() as usize].map(|x| x.to_native())
}

impl Stored {
    pub(super) fn new(scene: &ArchivedScene, objects: &[u32]) -> Self {
        let mut stored = Self::default();
        for &object in objects {
            stored.add(scene, object);
        }
        stored
    }

    fn add(&mut self, scene: &ArchivedScene, id: u32) {
        let object = &scene.objects[id as usize];
        let mesh = &scene.meshes[object.mesh.to_native() as usize];
        let zero = zero(scene, object);
        let rows = object
            .world_from_object
            .map(|row| row.map(|x| f64::from(x.to_native())));
        let mut map = Affine(rows);
        for (row, zero) in map.0.iter_mut().zip(zero) {
            row[3] += zero;
        }
        let first = self.points.len();
        let vertices = mesh.vertex_range();
        let place = |vertex| map.apply(scene.position(vertex).map(f64::from));
        self.points.extend(vertices.map(place));
        let corner = |index: u32| first as u32 + index;
        let indices = &scene.indices()[mesh.index_range()];
        let triangles = indices.as_chunks::<3>().0.iter();
        self.triangles
            .extend(triangles.map(|corners| corners.map(corner)));

        let corners = [mesh.min, mesh.max].map(|corner| corner.map(|x| f64::from(x.to_native())));
        let quantum = match scene.quantized_positions.is_empty() {
            true => 0.0,
            // The nearest of 65536 numbers. The grid may be shifted by less than its step against the source.
            false => 0.5 / 65535.0 * (1.0 + 1e-3),
        };
        let tolerance = tolerance(&rows, corners, quantum);
        self.tolerance = self.tolerance.max(tolerance);

        let bounds = scene.object_bounds[id as usize].to_native();
        let stored = Extent {
            min: std::array::from_fn(|axis| f64::from(bounds.min[axis]) + zero[axis]),
            max: std::array::from_fn(|axis| f64::from(bounds.max[axis]) + zero[axis]),
        };
        let right = Extent::of(&self.points[first..]);
        // The bake widens bounds by what a GPU may round in ten operations, each by a whole unit in the last place. In
        // `tolerance` a translation counts with two halves of one.
        if right.beyond(&stored) > 0.25 * tolerance || stored.beyond(&right) > 8.0 * tolerance {
            self.wrong_bounds.push(id);
        }
    }
}

/// How far a coordinate can be from the source, if every number was rounded to the nearest f32 once and every position
/// to the nearest grid point: entry times position is off by the errors of both, a translation by its own. Twice that
/// is allowed, since the source's transforms are composed in f64 by the bake and here in different orders.
fn tolerance(rows: &[[f64; 4]; 3], [min, max]: [Point; 2], quantum: f64) -> f64 {
    let position: Point = std::array::from_fn(|axis| min[axis].abs().max(max[axis].abs()));
    let of_row = |row: &[f64; 4]| {
        let products = (0..3).map(|axis| {
            let (entry, position) = (row[axis].abs(), position[axis]);
            2.0 * UNIT * entry * position + (quantum + SMALLEST) * entry + SMALLEST * position
        });
        products.sum::<f64>() + UNIT * row[3].abs() + SMALLEST
    };
    2.0 * rows.iter().map(of_row).fold(0.0, f64::max)
}

/// How far rounding to f32 about the middle of a shape can have moved a coordinate of it: OBJ files have numbers in
/// f64, and a bake may move the zero of a mesh.
pub(super) fn rounding_about_centre(world: &Extent) -> f64 {
    2.0 * UNIT * world.size()
}

/// How far rounding computed positions to f32 can have moved a coordinate of a point that `map` takes to the world.
pub(super) fn computed_tolerance(map: &Affine, points: &[Point]) -> f64 {
    2.0 * UNIT * map.reach() * Extent::of(points).largest()
}
