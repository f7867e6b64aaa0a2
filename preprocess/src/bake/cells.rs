//! Cells: the zeros that the f32 coordinates of objects are relative to.
//!
//! An f32 coordinate is off by up to 2^-24 of itself. About one zero for the whole scene, that moves a bolt in a hall
//! by some thousandths of its size, which nobody sees, but a bolt beside a marker on the other side of the planet by
//! many times its size. So an object whose distance from the scene's zero is more than 2^12 times its size is placed
//! in a cell: a cube of a power-of-two grid, with its zero in the middle, as large as fits the size of the object. Most
//! scenes need none but the scene's own, cell 0.

use glam::DVec3;
use hroc_format::MAX_CELLS;
use std::collections::HashMap;

/// An object stays in cell 0 up to this distance, in units of its size: rounding then moves it by at most 2^-12.
const FARTHEST: f64 = 4096.0;
/// Edge of the smallest cells, as a power of two times the size of their objects: rounding moves a vertex by at most
/// a millionth of the object's size.
const FINEST: i32 = 3;
/// Sizes below this share of the distance count as this, so that points have one.
const SMALLEST: f64 = 1.0 / (1_u64 << 40) as f64;

/// The cells of a scene, and which one each object is in.
pub(super) struct Cells {
    /// In the source's coordinates; the first is the scene's.
    pub(super) origins: Vec<DVec3>,
    pub(super) of_object: Vec<u32>,
}

/// Chooses cells for objects with these boxes in the source's coordinates. Objects with the same entry in `places`
/// share a cell, so that what met under one transform still meets. Where the smallest cells would be too many for the
/// format, all of them are twice as large, and so on.
pub(super) fn choose(boxes: &[[DVec3; 2]], places: &[u32], origin: DVec3) -> Cells {
    let count = places.iter().max().map_or(0, |&last| last as usize + 1);
    let mut united = vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; count];
    for (&place, [min, max]) in places.iter().zip(boxes) {
        let [least, most] = &mut united[place as usize];
        (*least, *most) = (least.min(*min), most.max(*max));
    }
    // Ends: a cell that holds all of the scene is cell 0.
    let (origins, of_place) = (FINEST..)
        .find_map(|power| on_grids(&united, origin, power))
        .unwrap_or_else(|| (vec![origin], vec![0; count]));
    Cells {
        origins,
        of_object: places.iter().map(|&p| of_place[p as usize]).collect(),
    }
}

/// The cells of that power, numbered in the order of the objects; `None` if they are too many.
fn on_grids(boxes: &[[DVec3; 2]], origin: DVec3, power: i32) -> Option<(Vec<DVec3>, Vec<u32>)> {
    let mut origins = vec![origin];
    let mut numbers = HashMap::new();
    let mut of_place = Vec::with_capacity(boxes.len());
    for b in boxes {
        let Some((level, cube)) = cube(b, origin, power) else {
            of_place.push(0);
            continue;
        };
        let number = *numbers.entry((level, cube)).or_insert_with(|| {
            let index = DVec3::from_array(cube.map(|index| index as f64));
            origins.push((index + 0.5) * f64::from(level).exp2());
            origins.len() as u32 - 1
        });
        if origins.len() > MAX_CELLS {
            return None;
        }
        of_place.push(number);
    }
    Some((origins, of_place))
}

/// The power-of-two grid and the cube in it for an object; `None` for cell 0.
fn cube([min, max]: &[DVec3; 2], origin: DVec3, power: i32) -> Option<(i32, [i64; 3])> {
    let size = (*max - *min).max_element();
    let reach = (*min - origin)
        .abs()
        .max((*max - origin).abs())
        .max_element();
    if reach <= FARTHEST * size || !reach.is_finite() {
        return None;
    }
    let level = size.max(reach * SMALLEST).log2().ceil() as i32 + power;
    let edge = f64::from(level).exp2();
    if reach <= edge {
        return None;
    }
    let middle = *min + (*max - *min) * 0.5;
    Some((level, (middle / edge).floor().to_array().map(|x| x as i64)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube_at(x: f64, size: f64) -> [DVec3; 2] {
        let half = DVec3::splat(0.5 * size);
        [
            DVec3::new(x, 0.0, 0.0) - half,
            DVec3::new(x, 0.0, 0.0) + half,
        ]
    }

    fn places(count: usize) -> Vec<u32> {
        (0..count as u32).collect()
    }

    #[test]
    fn what_one_zero_serves_has_one_cell() {
        let hall: Vec<_> = (0..1000)
            .map(|i| cube_at(f64::from(i) * 0.1 - 50.0, 0.05))
            .collect();
        let cells = choose(&hall, &places(hall.len()), DVec3::ZERO);
        assert_eq!(cells.origins, [DVec3::ZERO]);
        assert!(cells.of_object.iter().all(|&cell| cell == 0));
        assert_eq!(choose(&[], &[], DVec3::ONE).origins, [DVec3::ONE]);
    }

    #[test]
    fn small_objects_far_away_are_near_the_zero_of_their_cell() {
        let mut boxes = vec![cube_at(-6.4e6, 1.0), cube_at(6.4e6, 1.0)];
        boxes.extend((0..100).map(|i| cube_at(6.4e6 + f64::from(i) * 0.2, 0.1)));
        let cells = choose(&boxes, &places(boxes.len()), DVec3::ZERO);
        assert!(cells.origins.len() <= MAX_CELLS);
        for (b, &cell) in boxes.iter().zip(&cells.of_object) {
            let far = (b[1] - cells.origins[cell as usize]).abs().max_element();
            let size = (b[1] - b[0]).max_element();
            assert!(far <= 10.0 * size, "{far} of {size}");
        }
    }

    #[test]
    fn cells_are_as_small_as_fit_the_format() {
        // A million places, each of which would have a cell of its own.
        let boxes: Vec<_> = (0..1_000_000)
            .map(|i| cube_at(f64::from(i) * 100.0, 0.5))
            .collect();
        let cells = choose(&boxes, &places(boxes.len()), DVec3::new(5e7, 0.0, 0.0));
        let count = cells.origins.len();
        assert!(MAX_CELLS / 4 < count && count <= MAX_CELLS, "{count}");
    }

    #[test]
    fn what_shares_a_place_shares_a_cell() {
        let boxes = [
            cube_at(1e7, 1.0),
            cube_at(1e7 + 700.0, 0.01),
            cube_at(-1e7, 1.0),
        ];
        let cells = choose(&boxes, &[0, 0, 1], DVec3::ZERO);
        assert_eq!(cells.of_object[0], cells.of_object[1]);
        assert_ne!(cells.of_object[0], cells.of_object[2]);
    }

    #[test]
    fn points_and_extremes_are_placed() {
        let point = [DVec3::splat(1e9); 2];
        let huge = cube_at(0.0, 1e36);
        for boxes in [
            vec![point],
            vec![point, huge],
            vec![huge, cube_at(1e30, 1e-30)],
        ] {
            let cells = choose(&boxes, &places(boxes.len()), DVec3::ZERO);
            assert!(cells.origins.iter().all(|origin| origin.is_finite()));
        }
    }
}
