//! A radial city: ring streets and avenues round a plaza, blocks of terraced houses built from many
//! small low-polygon objects, and towers near the centre that are seen from afar. At eye height the
//! closed street fronts hide nearly everything; from above nothing hides anything.

mod buildings;
mod kit;
mod paths;

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Quat, Vec3, vec3};

use super::trig::{sin_cos_f32, turn_y_f32};
use super::{Generator, Group, MAIN_PATH, Model, Params, Part, Rng, ScenePath, Shape};
use buildings::{House, Tower};
use kit::Kit;

/// Counts of the Radial City scene of the HROC paper (2021).
const OBJECTS: usize = 73_812;
const TRIANGLES: f64 = 1_272_764.0;
const VERTICES: f64 = 2_384_053.0;

// Plan of the city, metres.
const PLAZA_RADIUS: f32 = 48.0;
const BLOCK_DEPTH: f32 = 44.0;
const STREET_WIDTH: f32 = 12.0;
const AVENUE_WIDTH: f32 = 14.0;
const BLOCK_LENGTH: f32 = 90.0;
const SIDEWALK: f32 = 2.5;
const SIDEWALK_HEIGHT: f32 = 0.15;
const HOUSE_DEPTH: f32 = 11.0;
const HOUSE_WIDTH: f32 = 12.0;
/// Rings whose inner fronts are towers here and there.
const TOWER_RINGS: usize = 2;

/// The generator.
pub struct RadialCity;

impl Generator for RadialCity {
    fn name(&self) -> &'static str {
        "radial-city"
    }

    fn describe(&self) -> &'static str {
        "ring streets of low-polygon houses round a plaza, towers seen from afar (73,812 objects)"
    }

    fn model(&self, params: &Params) -> Model {
        let mut city = City::new(params);
        let rng = Rng::new(params.seed);
        city.plaza(&mut rng.fork(0));
        for ring in 0.. {
            city.ring(ring, &mut rng.fork(1 + ring as u64));
            if city.is_full() {
                break;
            }
        }
        city.finish()
    }
}

/// The city while it grows from the centre outward, until it has all its objects.
struct City {
    model: Model,
    kit: Kit,
    /// Objects still to come.
    remaining: usize,
    /// Of the objects so far.
    triangles: f64,
    vertices: f64,
    objects: f64,
    triangles_per_object: f64,
    /// Distance of the outermost object from the centre.
    radius: f32,
}

impl City {
    fn new(params: &Params) -> Self {
        let Params {
            scale,
            detail,
            seed,
        } = params;
        let name = format!("radial-city scale {scale} detail {detail} seed {seed}");
        let mut model = Model {
            name,
            ..Model::default()
        };
        let kit = Kit::new(&mut model, *detail);
        Self {
            model,
            kit,
            // One is kept for the ground, which is laid last, when the size of the city is known.
            remaining: params.scaled_count(OBJECTS) - 1,
            triangles: 0.0,
            vertices: 0.0,
            objects: 0.0,
            triangles_per_object: TRIANGLES / OBJECTS as f64 * detail,
            radius: PLAZA_RADIUS,
        }
    }

    fn is_full(&self) -> bool {
        self.remaining == 0
    }

    /// Opens a group at a distance from the centre, in a direction; its +z looks away from the centre,
    /// turned further by `turn`.
    fn group(&mut self, name: &str, distance: f32, direction: f32, turn: f32) {
        if self.is_full() {
            return;
        }
        let (sin, cos) = sin_cos_f32(direction);
        self.radius = self.radius.max(distance + BLOCK_DEPTH);
        self.model.groups.push(Group {
            name: format!("{name} {}", self.model.groups.len()),
            translation: vec3(distance * cos, 0.0, distance * sin),
            rotation: turn_y_f32(FRAC_PI_2 - direction + turn),
            parts: Vec::new(),
        });
    }

    /// Adds an object to the open group, unless the city is full.
    fn part(&mut self, mesh: usize, translation: Vec3, scale: Vec3) {
        self.turned_part(mesh, translation, 0.0, scale);
    }

    /// Likewise, turned about the y axis.
    fn turned_part(&mut self, mesh: usize, translation: Vec3, turn: f32, scale: Vec3) {
        if self.is_full() {
            return;
        }
        self.remaining -= 1;
        let shape = &self.model.meshes[mesh].shape;
        self.triangles += shape.triangle_count() as f64;
        self.vertices += shape.vertex_count() as f64;
        self.objects += 1.0;
        let rotation = if turn == 0.0 {
            Quat::IDENTITY
        } else {
            turn_y_f32(turn)
        };
        let group = self
            .model
            .groups
            .last_mut()
            .expect("a group is open while objects remain");
        group.parts.push(Part {
            mesh,
            translation,
            rotation,
            scale,
        });
    }

    /// The kind of window which, shown `count` times, brings triangles and vertices per object nearest
    /// to those of the full scene. It is how the city keeps its proportions at any detail.
    fn choose_window(&self, count: usize) -> usize {
        // Vertices follow as far as the kinds allow; beyond this many objects' worth they give way.
        const VERTEX_SLACK: f64 = 50.0;
        let objects = self.objects + count as f64;
        let error = |window: &&usize| {
            let shape = &self.model.meshes[**window].shape;
            let excess = |so_far: f64, each: usize, per_object: f64| {
                (so_far + (count * each) as f64) / per_object - objects
            };
            let triangles = excess(
                self.triangles,
                shape.triangle_count(),
                self.triangles_per_object,
            );
            let vertices_per_object = self.triangles_per_object * (VERTICES / TRIANGLES);
            let vertices = excess(self.vertices, shape.vertex_count(), vertices_per_object)
                .clamp(-VERTEX_SLACK, VERTEX_SLACK);
            triangles * triangles + vertices * vertices
        };
        let windows = self.kit.windows.iter();
        *windows
            .min_by(|a, b| error(a).total_cmp(&error(b)))
            .expect("the kit has windows")
    }

    /// The open centre: a monument that is seen from everywhere, lamps and trees round it.
    fn plaza(&mut self, rng: &mut Rng) {
        self.group("monument", 0.0, 0.0, 0.0);
        self.part(self.kit.plinth, Vec3::ZERO, vec3(16.0, 2.0, 16.0));
        self.part(self.kit.obelisk, Vec3::Y * 2.0, vec3(7.0, 70.0, 7.0));
        for i in 0..24 {
            let direction = TAU * i as f32 / 24.0;
            self.group("plaza", PLAZA_RADIUS - STREET_WIDTH - 4.0, direction, 0.0);
            self.street_furniture(i, Vec3::ZERO, rng);
        }
    }

    /// A lamp or a tree.
    fn street_furniture(&mut self, index: usize, at: Vec3, rng: &mut Rng) {
        if index.is_multiple_of(3) {
            self.part(self.kit.lamp, at, vec3(0.6, 5.5, 0.6));
        } else {
            let (width, height) = (rng.within(3.0..5.0), rng.within(5.0..9.0));
            self.part(self.kit.tree, at, vec3(width, height, width));
        }
    }

    /// A ring of blocks between two ring streets. The number of blocks doubles with the radius, so that
    /// avenues run on outward.
    fn ring(&mut self, ring: usize, rng: &mut Rng) {
        let inner = PLAZA_RADIUS + ring as f32 * (BLOCK_DEPTH + STREET_WIDTH);
        let outer = inner + BLOCK_DEPTH;
        let doublings = libm::log2f(TAU * outer / (6.0 * BLOCK_LENGTH))
            .floor()
            .max(0.0);
        let blocks = 6 << doublings as u32;
        let half_angle = PI / blocks as f32 - 0.5 * AVENUE_WIDTH / inner;
        let segments = (half_angle * inner / 6.0).ceil() as usize;
        let plate = Shape::ring_sector(inner, outer, half_angle, SIDEWALK_HEIGHT, segments);
        let plate = self
            .model
            .add_mesh(format!("block of ring {ring}"), self.kit.pavement, plate);
        for block in 0..blocks {
            let direction = TAU * (block as f32 + 0.5) / blocks as f32;
            self.group("ground", 0.0, direction, -FRAC_PI_2);
            self.part(plate, Vec3::ZERO, Vec3::ONE);
            self.block(
                Block {
                    ring,
                    inner,
                    outer,
                    direction,
                    half_angle,
                },
                &mut rng.fork(block),
            );
        }
    }

    /// Two rows of houses that face the ring streets, a house at either end that closes the courtyard
    /// toward the avenue, and trees.
    fn block(&mut self, block: Block, rng: &mut Rng) {
        let Block {
            ring,
            inner,
            outer,
            direction,
            half_angle,
        } = block;
        let rows = [
            (inner + SIDEWALK, inner + SIDEWALK + 0.5 * HOUSE_DEPTH, PI),
            (
                outer - SIDEWALK - HOUSE_DEPTH,
                outer - SIDEWALK - 0.5 * HOUSE_DEPTH,
                0.0,
            ),
        ];
        for (front, middle, turn) in rows {
            // Measured where the row is shortest, so that neighbours touch and do not intersect.
            let half = half_angle - SIDEWALK / front;
            let houses = (2.0 * half * front / HOUSE_WIDTH).floor().max(1.0);
            let step = 2.0 * half / houses;
            let width = 2.0 * front * libm::tanf(0.5 * step);
            for house in 0..houses as usize {
                let direction = direction - half + step * (house as f32 + 0.5);
                if ring < TOWER_RINGS && turn != 0.0 && rng.chance(0.3) {
                    self.group("tower", middle, direction, turn);
                    self.tower(&Tower::random(width, HOUSE_DEPTH, ring, rng), rng);
                } else {
                    self.group("house", middle, direction, turn);
                    self.house(&House::random(width, HOUSE_DEPTH, rng), rng);
                }
                let curb = 0.5 * HOUSE_DEPTH + 0.7 * SIDEWALK;
                self.street_furniture(house, vec3(0.5 * width, SIDEWALK_HEIGHT, curb), rng);
            }
        }
        let courtyard = BLOCK_DEPTH - 2.0 * (SIDEWALK + HOUSE_DEPTH);
        let middle = 0.5 * (inner + outer);
        for side in [-1.0, 1.0] {
            let offset = half_angle - (SIDEWALK + 0.5 * HOUSE_DEPTH) / middle;
            self.group(
                "house",
                middle,
                direction + side * offset,
                -side * FRAC_PI_2,
            );
            self.house(&House::random(courtyard - 1.0, HOUSE_DEPTH - 1.0, rng), rng);
        }
        for tree in 0..4 {
            let turn = half_angle * rng.within(-0.6..0.6);
            self.group(
                "courtyard",
                middle + rng.within(-4.0..4.0),
                direction + turn,
                0.0,
            );
            self.street_furniture(3 * tree + 1, Vec3::Y * SIDEWALK_HEIGHT, rng);
        }
    }

    /// Lays the ground under everything.
    fn finish(mut self) -> Model {
        self.remaining = 1;
        let diameter = 2.0 * (self.radius + STREET_WIDTH);
        self.group("ground", 0.0, 0.0, 0.0);
        self.part(self.kit.ground, Vec3::NEG_Y, vec3(diameter, 1.0, diameter));
        self.model.groups.retain(|group| !group.parts.is_empty());
        let radius = f64::from(self.radius);
        self.model.paths = vec![
            ScenePath {
                name: MAIN_PATH,
                path: paths::walk(radius),
            },
            ScenePath {
                name: "fast",
                path: paths::fast(radius),
            },
        ];
        self.model
    }
}

/// A block between two avenues.
#[derive(Clone, Copy)]
struct Block {
    ring: usize,
    /// Distances of its curbs from the centre.
    inner: f32,
    outer: f32,
    /// Of its middle, seen from the centre.
    direction: f32,
    /// From its middle to the curb of an avenue.
    half_angle: f32,
}
