//! Flat-shaded shapes: faces do not share vertices, as in files exported with one normal per face.
//! Unless said otherwise a shape fills the unit box that stands on the origin (x and z from -0.5 to
//! 0.5, y from 0 to 1). Front faces are counter-clockwise.

use std::f32::consts::TAU;

use glam::{DAffine3, DVec3, Vec3, vec3};

use super::trig::sin_cos_f32;

/// Triangles.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// Vertex positions, metres.
    pub positions: Vec<Vec3>,
    /// Triangle list.
    pub indices: Vec<u32>,
}

impl Shape {
    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Adds a convex polygon with vertices of its own.
    pub fn face(&mut self, corners: &[Vec3]) {
        let first = self.positions.len() as u32;
        self.positions.extend_from_slice(corners);
        for i in 2..corners.len() as u32 {
            self.indices.extend([first, first + i - 1, first + i]);
        }
    }

    /// Adds another shape, transformed.
    pub fn with(mut self, other: &Self, transform: DAffine3) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(
            other
                .positions
                .iter()
                .map(|&p| transform.transform_point3(DVec3::from(p)).as_vec3()),
        );
        self.indices.extend(other.indices.iter().map(|i| first + i));
        self
    }

    /// Adds walls between two outlines of equal length. They face outward if the outlines run against
    /// the clock for someone who looks from `upper` to `lower`, else inward.
    fn walls(&mut self, lower: &[Vec3], upper: &[Vec3]) {
        for i in 0..lower.len() {
            let next = (i + 1) % lower.len();
            self.face(&[lower[i], lower[next], upper[next], upper[i]]);
        }
    }

    /// Closes a shape over an outline that runs against the clock seen from above.
    fn underside(&mut self, outline: &[Vec3]) {
        let corners: Vec<_> = outline.iter().rev().copied().collect();
        self.face(&corners);
    }

    /// A cuboid without its underside.
    pub fn cuboid() -> Self {
        let outline = rectangle(0.5, 0.5);
        let (lower, upper) = (at_height(&outline, 0.0), at_height(&outline, 1.0));
        let mut shape = Self::default();
        shape.walls(&lower, &upper);
        shape.face(&upper);
        shape
    }

    /// A cuboid with its underside.
    pub fn closed_cuboid() -> Self {
        let mut shape = Self::cuboid();
        shape.underside(&at_height(&rectangle(0.5, 0.5), 0.0));
        shape
    }

    /// An upright prism over a regular polygon, without its underside; a cylinder for many sides.
    pub fn prism(sides: usize) -> Self {
        let outline = regular_polygon(sides);
        let (lower, upper) = (at_height(&outline, 0.0), at_height(&outline, 1.0));
        let mut shape = Self::default();
        shape.walls(&lower, &upper);
        shape.face(&upper);
        shape
    }

    /// A pyramid over a regular polygon; a cone for many sides.
    pub fn cone(sides: usize) -> Self {
        let lower = at_height(&regular_polygon(sides), 0.0);
        let mut shape = Self::default();
        for i in 0..sides {
            shape.face(&[lower[i], lower[(i + 1) % sides], Vec3::Y]);
        }
        shape.underside(&lower);
        shape
    }

    /// A hipped roof without a ridge.
    pub fn pyramid() -> Self {
        let lower = at_height(&rectangle(0.5, 0.5), 0.0);
        let mut shape = Self::default();
        for i in 0..4 {
            shape.face(&[lower[i], lower[(i + 1) % 4], Vec3::Y]);
        }
        shape.underside(&lower);
        shape
    }

    /// A gabled roof, ridge along x.
    pub fn gable() -> Self {
        let [a, b, c, d]: [Vec3; 4] = at_height(&rectangle(0.5, 0.5), 0.0)
            .try_into()
            .expect("a rectangle has four corners");
        let (left, right) = (vec3(-0.5, 1.0, 0.0), vec3(0.5, 1.0, 0.0));
        let mut shape = Self::default();
        shape.face(&[a, b, right, left]);
        shape.face(&[b, c, right]);
        shape.face(&[c, d, left, right]);
        shape.face(&[d, a, left]);
        shape.underside(&[a, b, c, d]);
        shape
    }

    /// A rectangle that faces +z, at z = 0.
    pub fn pane() -> Self {
        let mut shape = Self::default();
        shape.face(&upright(&rectangle_outline(), 0.0));
        shape
    }

    /// A pane in a frame with an arched top of `arc` segments, facing +z, from z = 0 (the wall) to 1. With
    /// one segment the top is straight.
    pub fn framed_pane(arc: usize) -> Self {
        let outer = arched_outline(arc);
        let inner: Vec<_> = outer
            .iter()
            .map(|&(x, y)| (0.8 * x, 0.5 + 0.8 * (y - 0.5)))
            .collect();
        let mut shape = Self::default();
        // The front of the frame is one smooth strip: its vertices are shared.
        let count = outer.len() as u32;
        shape.positions.extend(upright(&outer, 1.0));
        shape.positions.extend(upright(&inner, 1.0));
        for i in 0..count {
            let next = (i + 1) % count;
            shape
                .indices
                .extend([i, next, count + next, i, count + next, count + i]);
        }
        shape.walls(&upright(&outer, 0.0), &upright(&outer, 1.0));
        shape.walls(&upright(&inner, 1.0), &upright(&inner, 0.3));
        shape.face(&upright(&inner, 0.3));
        shape
    }

    /// A plate over a sector of a ring round the y axis: from radius `inner` to `outer`, `angle` to both
    /// sides of +x, standing on y = 0, without its underside.
    pub fn ring_sector(inner: f32, outer: f32, angle: f32, height: f32, segments: usize) -> Self {
        let corner = |radius: f32, i: usize, y: f32| {
            let (sin, cos) = sin_cos_f32(angle * (2.0 * i as f32 / segments as f32 - 1.0));
            vec3(radius * cos, y, radius * sin)
        };
        let mut shape = Self::default();
        for i in 0..segments {
            let next = i + 1;
            let [a, b] = [i, next].map(|i| corner(inner, i, height));
            let [d, c] = [i, next].map(|i| corner(outer, i, height));
            let [a0, b0] = [i, next].map(|i| corner(inner, i, 0.0));
            let [d0, c0] = [i, next].map(|i| corner(outer, i, 0.0));
            shape.face(&[a, b, c, d]);
            shape.face(&[d, c, c0, d0]);
            shape.face(&[b, a, a0, b0]);
        }
        for (i, flip) in [(0, false), (segments, true)] {
            let mut end = [
                corner(inner, i, 0.0),
                corner(inner, i, height),
                corner(outer, i, height),
                corner(outer, i, 0.0),
            ];
            if flip {
                end.reverse();
            }
            shape.face(&end);
        }
        shape
    }
}

/// Corners (x, z) of a rectangle, against the clock seen from above.
fn rectangle(x: f32, z: f32) -> Vec<(f32, f32)> {
    vec![(-x, z), (x, z), (x, -z), (-x, -z)]
}

/// Corners (x, z) of a regular polygon in the unit circle's diameter, against the clock from above.
fn regular_polygon(sides: usize) -> Vec<(f32, f32)> {
    let corner = |i: usize| {
        let (sin, cos) = sin_cos_f32(TAU * i as f32 / sides as f32);
        (0.5 * cos, -0.5 * sin)
    };
    (0..sides).map(corner).collect()
}

fn at_height(outline: &[(f32, f32)], y: f32) -> Vec<Vec3> {
    outline.iter().map(|&(x, z)| vec3(x, y, z)).collect()
}

/// Corners (x, y) of the unit rectangle, against the clock seen from +z.
fn rectangle_outline() -> Vec<(f32, f32)> {
    vec![(-0.5, 0.0), (0.5, 0.0), (0.5, 1.0), (-0.5, 1.0)]
}

/// The unit rectangle with its top edge replaced by `arc` segments that rise from 0.8 to 1 and fall.
fn arched_outline(arc: usize) -> Vec<(f32, f32)> {
    if arc == 1 {
        return rectangle_outline();
    }
    let mut outline = vec![(-0.5, 0.0), (0.5, 0.0)];
    outline.extend((0..=arc).map(|i| {
        let (sin, cos) = sin_cos_f32(0.5 * TAU * i as f32 / arc as f32);
        (0.5 * cos, 0.8 + 0.2 * sin)
    }));
    outline
}

fn upright(outline: &[(f32, f32)], z: f32) -> Vec<Vec3> {
    outline.iter().map(|&(x, y)| vec3(x, y, z)).collect()
}
