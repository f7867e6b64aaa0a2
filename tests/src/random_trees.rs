//! Random and adversarial cameras, boxes and trees, for tests of single stages.

use glam::DVec3;
use hroc_format::{ArchivedBvhNode, ArchivedObjectBounds, Bounds, BvhNode, ObjectBounds};
use hroc_runtime::{Camera, Projection, SceneShape};
use hroc_study::hard_cases::builder::Rng;

/// A camera somewhere in the cube `-reach..reach`: telephoto to fisheye, or orthographic.
pub fn camera(rng: &mut Rng, reach: f64) -> Camera {
    let projection = if rng.bits().is_multiple_of(3) {
        Projection::Orthographic {
            half_height: rng.magnitude(0.01, 3.0 * reach),
        }
    } else {
        Projection::Perspective {
            fov_y_rad: rng.magnitude(0.02, 3.0),
        }
    };
    let near = rng.magnitude(1e-3, 1.0);
    Camera {
        position: rng.point(reach),
        orientation: rng.rotation(),
        projection,
        near,
        far: rng
            .bits()
            .is_multiple_of(3)
            .then(|| near + rng.magnitude(0.1, 4.0 * reach)),
        jitter_px: match rng.bits() % 4 {
            0 => [rng.within(-2.0, 2.0), rng.within(-2.0, 2.0)],
            _ => [0.0; 2],
        },
    }
}

/// A point in view of the camera at that depth; at `edge` 1 somewhere on the border of the image.
fn in_view(rng: &mut Rng, camera: &Camera, aspect: f64, depth: f64, edge: f64) -> DVec3 {
    let half = match camera.projection {
        Projection::Perspective { fov_y_rad } => depth * (0.5 * fov_y_rad).tan(),
        Projection::Orthographic { half_height } => half_height,
    };
    let [mut x, mut y] = [rng.within(-edge, edge), rng.within(-edge, edge)];
    if edge == 1.0 {
        let side = if rng.bits().is_multiple_of(2) {
            &mut x
        } else {
            &mut y
        };
        *side = side.signum();
    }
    camera.position + camera.orientation * DVec3::new(x * half * aspect, y * half, -depth)
}

/// The corners in f32, never inside out.
pub fn bounds(center: DVec3, half: DVec3) -> Bounds {
    let [min, max] = [center - half, center + half].map(|corner| corner.as_vec3());
    Bounds {
        min: min.to_array(),
        max: max.max(min).to_array(),
    }
}

/// Boxes in the cube `-reach..reach` and around `cameras`: points, flat ones, each other's twins, some that begin where
/// a near plane lies or one ulp beside it, some cut by the border of an image or behind an eye, and with `huge` some
/// many times as large as all others.
pub fn boxes(
    rng: &mut Rng,
    cameras: &[(Camera, f64)],
    reach: f64,
    count: usize,
    huge: bool,
) -> Vec<Bounds> {
    let mut boxes = Vec::<Bounds>::with_capacity(count);
    while boxes.len() < count {
        let (camera, aspect) = cameras[(rng.bits() % cameras.len() as u64) as usize];
        let largest = reach * rng.magnitude(1e-4, 0.1);
        let mut half = rng.point(largest).abs();
        match rng.bits() % 6 {
            0 => half = DVec3::ZERO,
            1 => half[(rng.bits() % 3) as usize] = 0.0,
            _ => {}
        }
        let depth = rng.magnitude(camera.near, 2.0 * reach);
        let made = match rng.bits() % 12 {
            0 if !boxes.is_empty() => boxes[(rng.bits() % boxes.len() as u64) as usize],
            1 if huge => bounds(rng.point(reach), rng.point(100.0 * reach).abs()),
            2 => bounds(
                in_view(rng, &camera, aspect, camera.near, 0.9),
                half * 0.001,
            ),
            3 => {
                // The nearest corner stands on the near plane, or as near as f32 comes.
                let forward = camera.orientation * DVec3::NEG_Z;
                let corner = half * forward.signum();
                let on_plane = in_view(rng, &camera, aspect, camera.near, 0.9);
                bounds(on_plane + corner, half)
            }
            4 => bounds(in_view(rng, &camera, aspect, depth, 1.0), half),
            5 => bounds(
                in_view(rng, &camera, aspect, depth, 1.0),
                DVec3::splat(depth * 1e-7),
            ),
            6 => bounds(camera.position + rng.point(camera.near), half * 0.01),
            7 => bounds(
                camera.position
                    + camera.orientation * DVec3::Z * depth
                    + rng.point(0.3) * half.length(),
                half,
            ),
            8 | 9 => bounds(in_view(rng, &camera, aspect, depth, 0.9), half),
            _ => bounds(rng.point(reach), half),
        };
        boxes.push(made);
    }
    boxes
}

/// The shape of a scene of these boxes; room for `moving` more objects.
pub fn shape(boxes: &[Bounds], moving: u32) -> SceneShape {
    let corners = boxes.iter().flat_map(|b| [b.min, b.max]);
    let far = corners
        .map(|corner| DVec3::from_array(corner.map(f64::from)).abs())
        .fold(DVec3::ZERO, DVec3::max);
    SceneShape {
        origin: DVec3::ZERO,
        cells: [DVec3::ZERO].into(),
        radius: far.length(),
        reach: far.element_sum(),
        object_count: boxes.len() as u32 + moving,
        static_count: boxes.len() as u32,
        subpixel_step_px: 1.0 / 256.0,
    }
}

/// Bounds of objects in the first cell.
pub fn placed(bounds: &Bounds) -> ObjectBounds {
    ObjectBounds {
        min: bounds.min,
        cell: 0,
        max: bounds.max,
        reserved: 0,
    }
}

/// Bounds as they are stored.
pub fn stored_bounds(bounds: &ObjectBounds) -> ArchivedObjectBounds {
    ArchivedObjectBounds {
        min: bounds.min.map(Into::into),
        cell: bounds.cell.into(),
        max: bounds.max.map(Into::into),
        reserved: bounds.reserved.into(),
    }
}

/// Nodes as they are stored.
pub fn stored(nodes: &[BvhNode]) -> Vec<ArchivedBvhNode> {
    nodes
        .iter()
        .map(|node| ArchivedBvhNode {
            min: node.min.map(Into::into),
            skip: node.skip.into(),
            max: node.max.map(Into::into),
            cell_and_object: node.cell_and_object.into(),
        })
        .collect()
}
