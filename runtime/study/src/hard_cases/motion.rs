//! Objects that move, come and go.

use glam::{DAffine3, DQuat, DVec3};
use hroc_format::ArchivedScene;
use hroc_runtime::moving::{MovingError, MovingObject, MovingObjects};

use super::builder::{looking, turning};
use super::everyday::{ROOM, clutter, rooms};
use super::{CaseScene, HardCase, Motion};

/// Objects that cross the view at once.
const CARS: u32 = 60;

pub(super) const CROSSING: HardCase = HardCase {
    name: "crossing",
    failure: "moving objects were tested by the bounds of the frame before, or occluded where they had been",
    make: |scale| CaseScene {
        motion: Some(Motion {
            capacity: CARS,
            step: crossing,
        }),
        ..CaseScene::new(rooms(scale), {
            let frames = scale.pick(8, 60);
            let inside = turning(DVec3::new(2.0 * ROOM, 1.6, 2.0 * ROOM), frames);
            let still = looking(DVec3::new(-6.0, 4.0, -6.0), DVec3::new(8.0, 1.0, 8.0));
            inside.into_iter().chain(std::iter::repeat_n(still, frames))
        })
    },
};

pub(super) const TAKEN_APART: HardCase = HardCase {
    name: "taken-apart",
    failure: "an object taken out of the hierarchy still hid others, or its place given to another kept its visibility",
    make: |scale| CaseScene {
        motion: Some(Motion {
            capacity: 64,
            step: taken_apart,
        }),
        ..CaseScene::new(
            clutter(scale),
            (0..scale.pick(16, 64)).map(|i| {
                let eye = DVec3::new(15.0 - 0.5 * f64::from(i), 2.0, 12.0);
                looking(eye, DVec3::ZERO)
            }),
        )
    },
};

/// Boxes and balls run through the rooms and their walls, far out of the scene, through the eye, and back.
fn crossing(
    frame: usize,
    _: &ArchivedScene,
    moving: &mut MovingObjects,
) -> Result<(), MovingError> {
    let first = moving.first_id();
    for car in 0..CARS {
        let t = frame as f64 * 0.37 + f64::from(car) * 0.61;
        let lane = f64::from(car % 10) * 2.0;
        let along = 10.0 + 18.0 * t.sin() * if car == 7 { 40.0 } else { 1.0 };
        let at = DVec3::new(along, 0.6 + f64::from(car % 3) * 0.7, lane);
        let size = DVec3::new(0.5, 0.1 + 0.05 * f64::from(car % 5), 0.3);
        let place = DAffine3::from_scale_rotation_translation(size, DQuat::from_rotation_y(t), at);
        if frame == 0 {
            moving.insert(MovingObject {
                mesh: car % 2,
                world_from_object: place,
                ..Default::default()
            })?;
        } else {
            moving.place(first + car, place)?;
        }
    }
    Ok(())
}

/// Every frame some objects of the bake are taken and flung about, others hidden or shown again, and places of
/// removed ones given to new ones.
fn taken_apart(
    frame: usize,
    baked: &ArchivedScene,
    moving: &mut MovingObjects,
) -> Result<(), MovingError> {
    let first = moving.first_id();
    let count = baked.objects.len() as u32;
    let n = frame as u32;
    for i in 0..3 {
        moving.take(baked, (n * 29 + i * 101) % count)?;
    }
    for i in 0..5 {
        moving.set_hidden((n * 31 + i * 7) % count, n.is_multiple_of(2))?;
    }
    if n > 3 {
        let id = first + n % 5;
        moving.remove(id)?;
        let turn = DQuat::from_rotation_x(f64::from(n));
        let at = DVec3::new(f64::from(n % 4) * 3.0 - 5.0, 1.0, 6.0);
        moving.insert(MovingObject {
            mesh: n % 2,
            world_from_object: DAffine3::from_scale_rotation_translation(
                DVec3::splat(2.0),
                turn,
                at,
            ),
            ..Default::default()
        })?;
    }
    Ok(())
}
