//! Numbers for points that are equal to a tolerance.
//!
//! Space is cut into cubes of 8 tolerances. A cube that a point of either list lies in, and every other such cube
//! that is within 2 tolerances of the point, are in one cluster, and so on from cube to cube. Two points that are
//! at most one tolerance apart are always in one cluster, so that a correct bake never fails; the time is linear
//! in the number of points, however they lie.

use super::affine::{Extent, Point};
use std::collections::HashMap;

const CUBE: f64 = 8.0;
const REACH: f64 = 2.0;

/// The clusters of two lists of points.
pub(super) struct Clusters {
    /// For each point of the first list.
    pub(super) first: Vec<u32>,
    /// For each point of the second list.
    pub(super) second: Vec<u32>,
    pub(super) count: usize,
}

impl Clusters {
    pub(super) fn new(first: &[Point], second: &[Point], tolerance: f64) -> Self {
        let zero = Extent::of(first).min;
        let place = |point: &Point| -> Point {
            std::array::from_fn(|axis| (point[axis] - zero[axis]) / (CUBE * tolerance))
        };
        let cube = |place: Point| place.map(|x| x.floor() as i64);
        let mut cubes = HashMap::new();
        let mut own = |point: &Point| {
            let next = cubes.len() as u32;
            *cubes.entry(cube(place(point))).or_insert(next)
        };
        let mut numbers: Vec<u32> = first.iter().chain(second).map(&mut own).collect();
        let mut groups = Groups((0..cubes.len() as u32).collect());
        let reach = REACH / CUBE;
        for (point, &number) in first.iter().chain(second).zip(&numbers) {
            let place = place(point);
            let [low, high] = [place.map(|x| x - reach), place.map(|x| x + reach)].map(cube);
            let home = cube(place);
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        if [x, y, z] != home
                            && let Some(&other) = cubes.get(&[x, y, z])
                        {
                            groups.unite(number, other);
                        }
                    }
                }
            }
        }
        let (names, count) = groups.names();
        for number in &mut numbers {
            *number = names[*number as usize];
        }
        let second = numbers.split_off(first.len());
        Self {
            first: numbers,
            second,
            count,
        }
    }
}

/// Sets of numbers: each points to another of its set, and the least to itself.
struct Groups(Vec<u32>);

impl Groups {
    fn root(&mut self, mut number: u32) -> u32 {
        while self.0[number as usize] != number {
            let above = self.0[self.0[number as usize] as usize];
            self.0[number as usize] = above;
            number = above;
        }
        number
    }

    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// A number from 0 on for the set of each number, and how many sets there are.
    fn names(mut self) -> (Vec<u32>, usize) {
        let mut names = vec![0; self.0.len()];
        let mut count = 0;
        for number in 0..self.0.len() as u32 {
            let root = self.root(number);
            names[number as usize] = match root == number {
                true => {
                    count += 1;
                    count - 1
                }
                false => names[root as usize],
            };
        }
        (names, count as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn near_points_share_a_number_and_far_ones_do_not() {
        let first = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1e-4, 0.0]];
        let second = [[1.0, 0.0, 9e-4], [-9e-4, 0.0, 0.0], [5.0, 5.0, 5.0]];
        let clusters = Clusters::new(&first, &second, 1e-3);
        assert_eq!(clusters.first, [0, 1, 1]);
        assert_eq!(clusters.second, [1, 0, 2]);
        assert_eq!(clusters.count, 3);
    }

    proptest! {
        #[test]
        fn points_within_the_tolerance_are_in_one_cluster(
            points in prop::collection::vec((prop::array::uniform3(-1.0..1.0), prop::array::uniform3(-1.0..=1.0)), 1..60),
            tolerance in 1e-6..0.1,
        ) {
            let first: Vec<Point> = points.iter().map(|(point, _)| *point).collect();
            let moved = |(point, by): &(Point, Point)| std::array::from_fn(|k| point[k] + by[k] * tolerance);
            let second: Vec<Point> = points.iter().map(moved).collect();
            let clusters = Clusters::new(&first, &second, tolerance);
            prop_assert_eq!(clusters.first, clusters.second);
        }
    }
}
