//! Affine maps in f64, written for the comparison alone, so that it does not repeat a fault of another library.

pub(super) type Point = [f64; 3];

/// Three rows of a 3x4 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Affine(pub(super) [[f64; 4]; 3]);

impl Affine {
    pub(super) const IDENTITY: Self = Self([
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ]);

    pub(super) fn translation([x, y, z]: Point) -> Self {
        let mut map = Self::IDENTITY;
        (map.0[0][3], map.0[1][3], map.0[2][3]) = (x, y, z);
        map
    }

    /// A scaling, then a rotation by a quaternion of any length, then a translation. A zero quaternion rotates nothing.
    pub(super) fn compose(translation: Point, [x, y, z, w]: [f64; 4], scale: Point) -> Self {
        let square = x * x + y * y + z * z + w * w;
        let s = if square > 0.0 { 2.0 / square } else { 0.0 };
        let rotation = [
            [
                1.0 - s * (y * y + z * z),
                s * (x * y - w * z),
                s * (x * z + w * y),
            ],
            [
                s * (x * y + w * z),
                1.0 - s * (x * x + z * z),
                s * (y * z - w * x),
            ],
            [
                s * (x * z - w * y),
                s * (y * z + w * x),
                1.0 - s * (x * x + y * y),
            ],
        ];
        Self(std::array::from_fn(|row| {
            let [a, b, c] = rotation[row];
            [a * scale[0], b * scale[1], c * scale[2], translation[row]]
        }))
    }

    /// From a 4x4 matrix in columns, as glTF stores it. The last row is taken for 0, 0, 0, 1.
    pub(super) fn from_columns(columns: [f64; 16]) -> Self {
        Self(std::array::from_fn(|row| {
            std::array::from_fn(|column| columns[4 * column + row])
        }))
    }

    /// This map after `first`.
    pub(super) fn after(&self, first: &Self) -> Self {
        Self(std::array::from_fn(|row| {
            let own = self.0[row];
            std::array::from_fn(|column| {
                let product: f64 = (0..3).map(|k| own[k] * first.0[k][column]).sum();
                product + if column == 3 { own[3] } else { 0.0 }
            })
        }))
    }

    pub(super) fn apply(&self, point: Point) -> Point {
        self.0
            .map(|row| row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + row[3])
    }

    /// The weighted sum of maps, entry by entry.
    pub(super) fn add_scaled(&mut self, other: &Self, weight: f64) {
        for (row, by) in self.0.iter_mut().zip(other.0) {
            for (entry, by) in row.iter_mut().zip(by) {
                *entry += by * weight;
            }
        }
    }

    /// The inverse by cofactors; `None` for a map that flattens.
    pub(super) fn inverse(&self) -> Option<Self> {
        let m = &self.0;
        let cofactor = |r: usize, c: usize| {
            let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
            m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
        };
        let determinant: f64 = (0..3).map(|c| m[0][c] * cofactor(0, c)).sum();
        let mut inverse = Self(std::array::from_fn(|row| {
            let [a, b, c] = std::array::from_fn(|column| cofactor(column, row) / determinant);
            [a, b, c, 0.0]
        }));
        let moved = inverse.apply([m[0][3], m[1][3], m[2][3]]);
        for (row, moved) in inverse.0.iter_mut().zip(moved) {
            row[3] = -moved;
        }
        let finite = inverse.0.iter().flatten().all(|entry| entry.is_finite());
        finite.then_some(inverse)
    }

    /// The largest sum of magnitudes in a row of the linear part: no coordinate of a vector becomes more than this
    /// times the vector's largest coordinate.
    pub(super) fn reach(&self) -> f64 {
        let sums = self.0.map(|row| row[0].abs() + row[1].abs() + row[2].abs());
        sums.into_iter().fold(0.0, f64::max)
    }
}

pub(super) fn sub(a: Point, b: Point) -> Point {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

pub(super) fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(super) fn length(a: Point) -> f64 {
    (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt()
}

/// A box around points; inside out while it holds none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub(super) min: Point,
    pub(super) max: Point,
}

impl Extent {
    pub(super) const NONE: Self = Self {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    pub(super) fn of<'a>(points: impl IntoIterator<Item = &'a Point>) -> Self {
        let mut extent = Self::NONE;
        points.into_iter().for_each(|&point| extent.add(point));
        extent
    }

    pub(super) fn add(&mut self, point: Point) {
        for (axis, coordinate) in point.into_iter().enumerate() {
            self.min[axis] = self.min[axis].min(coordinate);
            self.max[axis] = self.max[axis].max(coordinate);
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.min[0] > self.max[0]
    }

    /// The longest edge.
    pub(super) fn size(&self) -> f64 {
        let edges = sub(self.max, self.min);
        edges.into_iter().fold(0.0, f64::max)
    }

    /// The largest magnitude of a coordinate.
    pub(super) fn largest(&self) -> f64 {
        let corners = self.min.into_iter().chain(self.max);
        corners.fold(0.0, |largest, x| largest.max(x.abs()))
    }

    /// How far this box reaches out of `other` on any axis.
    pub(super) fn beyond(&self, other: &Self) -> f64 {
        let axis =
            |axis: usize| (other.min[axis] - self.min[axis]).max(self.max[axis] - other.max[axis]);
        (0..3).map(axis).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_compose_and_invert() {
        // A quarter turn about z, by a quaternion that is not of unit length.
        let map = Affine::compose([1.0, 2.0, 3.0], [0.0, 0.0, 3.0, 3.0], [2.0, 1.0, 1.0]);
        let near = |a: Point, b: Point| length(sub(a, b)) < 1e-12;
        assert!(near(map.apply([1.0, 0.0, 0.0]), [1.0, 4.0, 3.0]));
        assert!(near(map.apply([0.0, 1.0, 0.0]), [0.0, 2.0, 3.0]));
        let back = map.inverse().unwrap().after(&map);
        assert!(near(back.apply([5.0, -6.0, 7.0]), [5.0, -6.0, 7.0]));
        assert!(Affine([[0.0; 4]; 3]).inverse().is_none());
        let columns = std::array::from_fn(|i| i as f64);
        assert_eq!(Affine::from_columns(columns).0[1], [1.0, 5.0, 9.0, 13.0]);
    }
}
