//! The two paths that every scene has. They follow from the scene alone.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, TAU};

use glam::{DQuat, DVec2, DVec3};
use hroc_format::ArchivedScene;

use super::{CameraPath, Key, ProjectionKind};

/// Full vertical field of view of both paths.
const FOV_Y_RAD: f64 = FRAC_PI_3;
/// Duration of both paths.
const DURATION_S: f64 = 10.0;
/// When the walk ends and the turn begins.
const ARRIVAL_S: f64 = 6.0;
/// Near plane distance as a share of the scene's radius: millimetres in a house, decimetres in a town.
const NEAR_SHARE: f64 = 1e-4;
/// From the scene's centre toward the overview, before normalization: a corner seen from above.
const OVERVIEW_DIRECTION: DVec3 = DVec3::new(1.0, 0.6, 1.0);
/// Cells along x and along z of the grid that finds the densest part.
const CELLS: usize = 32;
/// Straight pieces of the orbit: at 5 degrees each they stay within 0.1 % of the circle.
const ORBIT_PIECES: u32 = 72;
/// The orbit's radius in radii of the scene.
const ORBIT_RADII: f64 = 1.2;

/// Where a scene lies and where its objects are, in the source's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    /// Centre of the scene's bounds.
    pub centre: DVec3,
    /// Half the diagonal of the scene's bounds; 1 where the scene has no extent.
    pub radius: f64,
    /// Eye position in the densest part.
    ///
    /// The centres of the objects' bounds are counted in a grid of 32x32 cells over their extent in x
    /// and z; the cell with most of them wins (the lowest index among equals, x fastest). x and z are
    /// the means over the cell, y is the median: half of what stands there is above the eye and half below,
    /// which puts it inside a room, between floor and ceiling, and a few storeys up in a tower.
    pub densest: DVec3,
}

impl Layout {
    /// The layout of a scene; a scene without objects looks like a unit sphere at its origin.
    pub fn of(scene: &ArchivedScene) -> Self {
        let origin = DVec3::from_array(scene.origin.map(|x| x.to_native()));
        let cells = scene.cell_origins();
        let bounds = scene.bounds.to_native();
        let [min, max] = [bounds.min, bounds.max].map(to_f64);
        let radius = 0.5 * (max - min).length();
        let centres = scene
            .object_bounds
            .iter()
            .map(|bounds| bounds.to_native())
            .map(|bounds| {
                let zero = DVec3::from(cells[bounds.cell as usize]) - origin;
                zero + 0.5 * (to_f64(bounds.min) + to_f64(bounds.max))
            })
            .collect::<Vec<_>>();
        Self {
            centre: origin + 0.5 * (min + max),
            // The smallest extent that leaves the near plane a normal f32.
            radius: if radius > 1e-30 { radius } else { 1.0 },
            densest: origin + densest(&centres),
        }
    }

    fn near(&self) -> f64 {
        NEAR_SHARE * self.radius
    }
}

/// Overview of the whole scene, a straight walk to its densest part, a turn of 360 degrees there.
pub fn walk_in(scene: &ArchivedScene) -> CameraPath {
    let layout = Layout::of(scene);
    // The bounding sphere touches the upper and lower edge of the image.
    let distance = layout.radius / (0.5 * FOV_Y_RAD).sin();
    let overview = layout.centre + OVERVIEW_DIRECTION.normalize() * distance;
    let walk = layout.densest - overview;
    let arrival = DQuat::from_rotation_y(yaw(walk));
    let mut keys = vec![key(0.0, overview, looking_along(layout.centre - overview))];
    keys.extend((0..=4).map(|quarter| {
        let t_s = ARRIVAL_S + (DURATION_S - ARRIVAL_S) * f64::from(quarter) / 4.0;
        let turned = DQuat::from_rotation_y(FRAC_PI_2 * f64::from(quarter)) * arrival;
        key(t_s, layout.densest, turned)
    }));
    path(&layout, keys)
}

/// A level circle round the scene's centre at 1.2 radii, looking at the centre.
pub fn orbit(scene: &ArchivedScene) -> CameraPath {
    let layout = Layout::of(scene);
    let keys = (0..=ORBIT_PIECES).map(|piece| {
        let share = f64::from(piece) / f64::from(ORBIT_PIECES);
        let orientation = DQuat::from_rotation_y(TAU * share);
        let position = layout.centre + orientation * DVec3::Z * (ORBIT_RADII * layout.radius);
        key(DURATION_S * share, position, orientation)
    });
    path(&layout, keys.collect())
}

fn path(layout: &Layout, keys: Vec<Key>) -> CameraPath {
    CameraPath::new(ProjectionKind::Perspective, layout.near(), None, keys)
        .expect("finite bounds make a sound path")
}

fn key(t_s: f64, position: DVec3, orientation: DQuat) -> Key {
    Key {
        t_s,
        position: position.to_array(),
        orientation: orientation.normalize().to_array(),
        fov_y_rad: Some(FOV_Y_RAD),
        half_height: None,
    }
}

/// The turn about y that takes -z to `direction` seen from above; 0 for a vertical one.
fn yaw(direction: DVec3) -> f64 {
    if direction.x == 0.0 && direction.z == 0.0 {
        0.0
    } else {
        (-direction.x).atan2(-direction.z)
    }
}

fn looking_along(direction: DVec3) -> DQuat {
    let pitch = direction.y.atan2(direction.x.hypot(direction.z));
    DQuat::from_rotation_y(yaw(direction)) * DQuat::from_rotation_x(pitch)
}

fn to_f64(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

/// See [`Layout::densest`].
fn densest(centres: &[DVec3]) -> DVec3 {
    let [Some(min), Some(max)] =
        [DVec3::min, DVec3::max].map(|extreme| centres.iter().copied().reduce(extreme))
    else {
        return DVec3::ZERO;
    };
    let cell_of = |centre: &DVec3| {
        let axis = |x: f64, min: f64, max: f64| {
            let share = if max > min {
                (x - min) / (max - min)
            } else {
                0.0
            };
            // Saturates: the far edge belongs to the last cell.
            ((share * CELLS as f64) as usize).min(CELLS - 1)
        };
        axis(centre.x, min.x, max.x) + CELLS * axis(centre.z, min.z, max.z)
    };
    let mut counts = vec![0u32; CELLS * CELLS];
    for centre in centres {
        counts[cell_of(centre)] += 1;
    }
    let fullest = *counts.iter().max().expect("there are cells");
    let cell = counts
        .iter()
        .position(|&count| count == fullest)
        .expect("the maximum is one of them");
    let inside = centres
        .iter()
        .filter(|centre| cell_of(centre) == cell)
        .collect::<Vec<_>>();
    let sum = inside.iter().fold(DVec2::ZERO, |sum, centre| {
        sum + DVec2::new(centre.x, centre.z)
    });
    let mean = sum / inside.len() as f64;
    let mut heights = inside.iter().map(|centre| centre.y).collect::<Vec<_>>();
    heights.sort_by(f64::total_cmp);
    DVec3::new(mean.x, heights[heights.len() / 2], mean.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera_path::Cameras;
    use hroc_format::{BakedScene, Bounds, Check, ObjectBounds, Scene, to_bytes};

    fn baked(boxes: &[[[f32; 3]; 2]]) -> BakedScene {
        let object_bounds = boxes
            .iter()
            .map(|&[min, max]| ObjectBounds {
                min,
                max,
                ..Default::default()
            })
            .collect::<Vec<_>>();
        let fold = |pick: fn(&ObjectBounds) -> [f32; 3], extreme: fn(f32, f32) -> f32| {
            let join = |a: [f32; 3], b: [f32; 3]| std::array::from_fn(|i| extreme(a[i], b[i]));
            object_bounds
                .iter()
                .map(pick)
                .reduce(join)
                .unwrap_or_default()
        };
        let bounds = Bounds {
            min: fold(|b| b.min, f32::min),
            max: fold(|b| b.max, f32::max),
        };
        let scene = Scene {
            origin: [1e6, 0.0, 0.0],
            bounds,
            object_bounds,
            ..Scene::default()
        };
        // Only what the paths read is there, so only the structure is checked.
        BakedScene::from_aligned(to_bytes(&scene).unwrap(), Check::Ranges).unwrap()
    }

    #[test]
    fn the_densest_cell_wins_and_the_eye_is_at_its_median_height() {
        let small = |x: f32, y: f32| [[x, y, 0.0], [x, y, 0.0]];
        let scene = baked(&[
            small(0.0, 9.0),
            small(10.0, 1.0),
            small(10.1, 2.0),
            small(10.2, 7.0),
        ]);
        let densest = Layout::of(scene.scene()).densest - DVec3::new(1e6, 0.0, 0.0);
        assert!(
            (densest - DVec3::new(10.1, 2.0, 0.0)).length() < 1e-5,
            "{densest}"
        );
    }

    #[test]
    fn every_scene_has_sound_paths() {
        let cube = |half: f32| [[-half; 3], [half; 3]];
        let cases: &[&[[[f32; 3]; 2]]] = &[
            &[],
            &[cube(0.0)],
            &[cube(1e-38)],
            &[cube(1e-3)],
            &[cube(3e38)],
            &[[[-1.0, 0.0, -1.0], [1.0, 0.0, 1.0]]],
            &[[[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]],
        ];
        for case in cases {
            let scene = baked(case);
            for path in [walk_in(scene.scene()), orbit(scene.scene())] {
                assert_eq!(path.duration_s(), DURATION_S);
                for frame in 0..50 {
                    let camera = path.frame(frame, 50);
                    let clip =
                        camera.clip_from_world(Default::default(), [64, 36], camera.position, 1.0);
                    assert!(clip.unwrap().is_finite(), "{case:?} frame {frame}");
                }
            }
        }
    }

    #[test]
    fn the_overview_sees_the_scene_and_the_turn_is_full() {
        let scene = baked(&[[[-3.0, 0.0, -2.0], [5.0, 2.0, 4.0]]]);
        let path = walk_in(scene.scene());
        let layout = Layout::of(scene.scene());
        let forward = |t| path.camera_at(t).orientation * DVec3::NEG_Z;
        let start = path.camera_at(0.0);
        assert!(forward(0.0).dot((layout.centre - start.position).normalize()) > 1.0 - 1e-12);
        assert_eq!(path.camera_at(ARRIVAL_S).position, layout.densest);
        assert!(forward(ARRIVAL_S).y.abs() < 1e-12);
        assert!(forward(ARRIVAL_S).dot(forward(DURATION_S)) > 1.0 - 1e-12);
        assert!(forward(ARRIVAL_S).dot(forward(0.5 * (ARRIVAL_S + DURATION_S))) < -1.0 + 1e-12);
    }

    #[test]
    fn the_orbit_keeps_its_distance_and_its_aim() {
        let scene = baked(&[[[-3.0, 0.0, -2.0], [5.0, 2.0, 4.0]]]);
        let (path, layout) = (orbit(scene.scene()), Layout::of(scene.scene()));
        for frame in 0..200 {
            let camera = path.frame(frame, 200);
            let to_centre = layout.centre - camera.position;
            assert!((to_centre.length() / layout.radius - ORBIT_RADII).abs() < 2e-3);
            assert!((camera.orientation * DVec3::NEG_Z).dot(to_centre.normalize()) > 1.0 - 1e-4);
        }
    }
}
