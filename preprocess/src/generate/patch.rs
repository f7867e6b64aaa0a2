//! Shapes that can be cut as finely as wanted, in f64: patches of quads, and boxes, bodies of
//! revolution, rings and rocks made of them.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};

use super::Shape;
use super::noise::Noise;
use super::trig::{polar, sin_cos};

/// How finely a shape is cut.
#[derive(Clone, Copy, Debug)]
pub struct Grain {
    /// Triangles the whole shape should have; met as far as its quads allow.
    pub triangles: f64,
    /// Quads along the side of a chart. Within a chart vertices are shared, as where texture coordinates
    /// are continuous; between charts they are not. 1 is flat shading.
    pub chart: usize,
}

impl Grain {
    /// The grain of a share of the shape.
    pub fn share(self, share: f64) -> Self {
        Self {
            triangles: self.triangles * share,
            ..self
        }
    }

    /// Quads along and across a patch that is `aspect` times as long as it is wide; `across` comes in
    /// multiples of `step`.
    fn quads(self, aspect: f64, step: usize) -> [usize; 2] {
        let quads = 0.5 * self.triangles;
        let across = ((quads / aspect).sqrt() / step as f64).round().max(1.0) as usize * step;
        let along = (quads / across as f64).round().max(1.0) as usize;
        [along, across]
    }
}

impl Shape {
    /// Adds `u` times `v` quads over the unit square. The direction of growing u turned toward growing v
    /// is counter-clockwise for someone outside. Where corners coincide, as at a pole, there are no
    /// triangles.
    pub fn patch(&mut self, u: usize, v: usize, chart: usize, at: impl Fn(f64, f64) -> DVec3) {
        let steps = |count: usize| {
            (0..count)
                .step_by(chart)
                .map(move |a| (a, (a + chart).min(count)))
        };
        for (v0, v1) in steps(v) {
            for (u0, u1) in steps(u) {
                let first = self.positions.len() as u32;
                let row = (u1 - u0 + 1) as u32;
                for j in v0..=v1 {
                    self.positions.extend(
                        (u0..=u1).map(|i| at(i as f64 / u as f64, j as f64 / v as f64).as_vec3()),
                    );
                }
                for j in 0..(v1 - v0) as u32 {
                    for i in 0..(u1 - u0) as u32 {
                        let a = first + j * row + i;
                        let (b, c, d) = (a + 1, a + row + 1, a + row);
                        self.triangle([a, b, c]);
                        self.triangle([a, c, d]);
                    }
                }
            }
        }
    }

    /// Adds a triangle unless two of its corners are the same point.
    fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners.map(|i| self.positions[i as usize]);
        if a != b && b != c && c != a {
            self.indices.extend(corners);
        }
    }

    /// A box from `min` to `max` with all its faces, its surface moved by `bend`, which is given points of
    /// the box and of the unit box `0..1`.
    pub fn bent_box(
        grain: Grain,
        min: DVec3,
        max: DVec3,
        bend: impl Fn(DVec3, DVec3) -> DVec3,
    ) -> Self {
        let mut shape = Self::default();
        let size = max - min;
        let areas = [size.y * size.z, size.z * size.x, size.x * size.y];
        let total: f64 = 2.0 * areas.iter().sum::<f64>();
        for (axis, area) in areas.iter().enumerate() {
            let (along, across) = ((axis + 1) % 3, (axis + 2) % 3);
            let aspect = size[along] / size[across];
            let [u, v] = grain.share(area / total).quads(aspect, 1);
            for end in [0.0, 1.0] {
                shape.patch(u, v, grain.chart, |s, t| {
                    let mut unit = DVec3::ZERO;
                    unit[axis] = end;
                    // The lower face is seen from the other side: mirrored, it faces outward too.
                    unit[along] = if end == 0.0 { 1.0 - s } else { s };
                    unit[across] = t;
                    bend(min + unit * size, unit)
                });
            }
        }
        shape
    }

    /// A plain box.
    pub fn fine_box(grain: Grain, min: DVec3, max: DVec3) -> Self {
        Self::bent_box(grain, min, max, |p, _| p)
    }

    /// A body of revolution about the y axis. `profile` holds radius and height, from below upward on the
    /// outside; it starts and ends on the axis where the body is closed. `bend` moves its surface.
    pub fn lathe(grain: Grain, profile: &[[f64; 2]], bend: impl Fn(DVec3) -> DVec3) -> Self {
        let pieces = profile.len() - 1;
        let length = |p: &[[f64; 2]]| {
            let [along, up] = [0, 1].map(|i| p[1][i] - p[0][i]);
            (along * along + up * up).sqrt()
        };
        let height: f64 = profile.windows(2).map(length).sum();
        let widest = profile.iter().fold(0.0_f64, |widest, p| widest.max(p[0]));
        let [around, along] = grain.quads(TAU * widest / height, pieces);
        let around = around.max(3);
        let mut shape = Self::default();
        shape.patch(around, along, grain.chart, |s, t| {
            let at = t * pieces as f64;
            let piece = (at as usize).min(pieces - 1);
            let share = at - piece as f64;
            let [a, b] = [profile[piece], profile[piece + 1]];
            let [radius, y] = [0, 1].map(|i| a[i] + (b[i] - a[i]) * share);
            // The seam closes: a whole turn is no turn.
            let p = polar(radius, -TAU * if s == 1.0 { 0.0 } else { s });
            bend(p + DVec3::Y * y)
        });
        shape
    }

    /// A piece of a ring of round section that lies in the plane of x and y about the origin: `angle` of it
    /// from +x on, a whole one for `TAU`.
    pub fn ring(grain: Grain, radius: f64, section: f64, angle: f64) -> Self {
        let [along, around] = grain.quads(radius * angle / (TAU * section), 1);
        let (along, around) = (along.max(if angle == TAU { 3 } else { 1 }), around.max(3));
        let mut shape = Self::default();
        shape.patch(along, around, grain.chart, |s, t| {
            let (sin, cos) = sin_cos(angle * if angle == TAU && s == 1.0 { 0.0 } else { s });
            let (up, out) = sin_cos(TAU * if t == 1.0 { 0.0 } else { t });
            let from_axis = radius + section * out;
            dvec3(from_axis * cos, from_axis * sin, section * up)
        });
        shape
    }

    /// A closed body seen from the origin: `radius` is its extent in a direction of unit length. Six
    /// patches, as of a cube blown up to a sphere.
    pub fn boulder(grain: Grain, radius: impl Fn(DVec3) -> f64) -> Self {
        Self::bent_box(grain, DVec3::NEG_ONE, DVec3::ONE, |p, _| {
            let direction = p.normalize();
            direction * radius(direction)
        })
    }

    /// A rock that just fits in the sphere of unit diameter about the origin, with ridges and craters.
    pub fn rock(grain: Grain, seed: u64) -> Self {
        /// Directions along the side of each patch that are looked at to find how far the rock reaches.
        const SAMPLES: u32 = 12;
        let noise = Noise::new(seed);
        let stretch = 1.0 + 0.35 * noise.vector(DVec3::splat(7.7));
        let craters: [DVec3; 7] = std::array::from_fn(|i| {
            noise
                .vector(DVec3::splat(3.3 * i as f64))
                .normalize_or(DVec3::Y)
        });
        let radius = |direction: DVec3| {
            let bumps = 0.22 * noise.octaves(direction * 1.6, 5);
            let ridges = 0.10 * (1.0 - noise.octaves(direction * 2.3 + 11.0, 4).abs());
            let dent = |(i, centre): (usize, &DVec3)| {
                let width = 0.06 + 0.03 * i as f64;
                let from_centre = (1.0 - direction.dot(*centre)) / width;
                let depth = (1.0 - from_centre * from_centre).max(0.0);
                if from_centre < 1.0 {
                    0.3 * width.sqrt() * depth
                } else {
                    0.0
                }
            };
            let dents: f64 = craters.iter().enumerate().map(dent).sum();
            (direction * stretch).length() * (1.0 + bumps + ridges - dents).max(0.3)
        };
        let side = || (0..=SAMPLES).map(|i| 2.0 * f64::from(i) / f64::from(SAMPLES) - 1.0);
        let mut reach = 0.0_f64;
        for (axis, end) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
            for (s, t) in side().flat_map(|s| side().map(move |t| (s, t))) {
                let mut p = DVec3::splat(end);
                p[(axis + 1) % 3] = s;
                p[(axis + 2) % 3] = t;
                reach = reach.max(radius(p.normalize()));
            }
        }
        Self::boulder(grain, |direction| 0.5 * radius(direction) / reach)
    }

    /// Adds the triangles of another shape.
    pub fn merge(&mut self, other: Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.indices.extend(other.indices.iter().map(|i| first + i));
    }
}
