//! Satellites: a few huge rocks, and round them swarms of rocks of every size. From far away the swarms
//! stand before the black; between two of the huge ones they fill the view, and little of it is seen.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::{DQuat, DVec3, dvec3};

use super::route::{route, stop};
use super::sketch::{Goal, Sketch};
use super::trig::{polar, pow, turn, turn_y};
use super::{Generator, MAIN_PATH, Model, Params, Rng, ScenePath, Shape};

/// Counts of the Satellites scene of the HROC paper (2021).
const OBJECTS: usize = 120_000;
const TRIANGLES: f64 = 807_172_000.0;
const VERTICES: f64 = 669_111_000.0;

/// Where the huge rocks are and how large, metres: a wall of two, and others about them.
const HUGE: [([f64; 3], f64); 7] = [
    ([0.0, 0.0, 0.0], 420.0),
    ([830.0, 90.0, -180.0], 330.0),
    ([-760.0, -140.0, 330.0], 300.0),
    ([180.0, -70.0, 880.0], 270.0),
    ([-330.0, 160.0, -890.0], 290.0),
    ([960.0, -180.0, 760.0], 210.0),
    ([-1080.0, 120.0, -540.0], 230.0),
];
/// Radius of the smallest rocks, and of the largest beside the huge ones.
const RADII: [f64; 2] = [1.3, 100.0];
/// Number of rocks above a radius falls with this power of it, as among asteroids.
const POWER: f64 = 2.0;
/// How far a swarm reaches from the surface of its rock, in radii of the rock.
const SWARM_DEPTH: f64 = 0.85;

/// The classes: smallest radius, triangles in relation to each other, variants.
const CLASSES: [(&str, f64, f64, usize); 4] = [
    ("pebble", 0.0, 1.0, 8),
    ("rock", 4.0, 2.0, 8),
    ("boulder", 16.0, 6.0, 6),
    ("moon", 100.0, 24.0, 7),
];

/// The generator.
pub struct Satellites;

impl Generator for Satellites {
    fn name(&self) -> &'static str {
        "satellites"
    }

    fn describe(&self) -> &'static str {
        "rocks of very different size in swarms round a few huge ones (120,000 objects, 807 million triangles)"
    }

    fn model(&self, params: &Params) -> Model {
        let Params {
            scale,
            detail,
            seed,
        } = *params;
        let objects = params.scaled_count(OBJECTS);
        let name = format!("satellites scale {scale} detail {detail} seed {seed}");
        let mut sketch = Sketch::new(name, objects);
        let stone = [
            sketch.material("dark stone", [0.22, 0.20, 0.19]),
            sketch.material("red stone", [0.40, 0.24, 0.16]),
            sketch.material("grey stone", [0.43, 0.42, 0.41]),
            sketch.material("pale stone", [0.62, 0.57, 0.49]),
        ];
        let rng = Rng::new(seed);
        let kinds: Vec<usize> = CLASSES
            .iter()
            .zip(stone)
            .enumerate()
            .map(|(class, (&(name, _, weight, variants), stone))| {
                let shapes = rng.fork(class as u64).bits();
                sketch.kind(name, stone, weight, variants, move |grain, variant| {
                    Shape::rock(grain, shapes.wrapping_add(variant as u64))
                })
            })
            .collect();
        let mut swarm = Swarm::default();
        let mut rng = rng.fork(100);
        for (i, radius) in radii(objects).enumerate() {
            let centre = match HUGE.get(i) {
                Some(&(centre, _)) => DVec3::from_array(centre),
                None => swarm.place(radius, &mut rng),
            };
            swarm.add(centre, radius);
            let class = CLASSES.iter().rposition(|class| class.1 <= radius);
            let class = class.expect("the first class takes all");
            // A group for each thousand: a scene of a flat list of nodes would be no real one.
            if i % 1000 == 0 {
                sketch.group(format!("swarm {}", i / 1000), DVec3::ZERO, DQuat::IDENTITY);
            }
            let size = DVec3::splat(2.0 * radius);
            sketch.part(
                kinds[class],
                rng.below(64),
                centre,
                any_turn(&mut rng),
                size,
            );
        }
        let per_object = detail * objects as f64 / OBJECTS as f64;
        let mut model = sketch.finish(Goal {
            triangles: TRIANGLES * per_object,
            vertices: VERTICES * per_object,
            own_meshes: false,
        });
        model.paths.push(ScenePath {
            name: MAIN_PATH,
            path: walk(),
        });
        model
    }
}

/// From outside toward the gap between the two largest rocks, through the swarms, to the face of the one.
fn walk() -> crate::camera_path::CameraPath {
    let [a, b] = [0, 1].map(|i| DVec3::from_array(HUGE[i].0));
    let gap = a.lerp(b, HUGE[0].1 / (HUGE[0].1 + HUGE[1].1));
    let across = (b - a).cross(DVec3::Y).normalize();
    let entry = gap + across * 560.0 + DVec3::Y * 60.0;
    route(
        0.3,
        &[
            stop(0.0, dvec3(1400.0, 800.0, 2000.0), DVec3::ZERO),
            stop(3.0, dvec3(1150.0, 420.0, 1500.0), gap * 0.5),
            stop(6.0, entry, gap),
            stop(
                8.5,
                gap + across * 190.0 + DVec3::Y * 25.0,
                gap - across * 150.0,
            ),
            stop(
                10.0,
                gap + across * 90.0,
                a + DVec3::Y * 40.0 - across * 200.0,
            ),
        ],
    )
}

/// The radius of each rock, the largest first: the huge ones, then a power law cut off at both ends.
fn radii(objects: usize) -> impl Iterator<Item = f64> {
    let [least, most] = RADII.map(|radius| pow(radius, -POWER));
    let small = objects.saturating_sub(HUGE.len());
    let power_law = (0..small).map(move |i| {
        let share = (i as f64 + 0.5) / small as f64;
        pow(most + (least - most) * share, -1.0 / POWER)
    });
    HUGE.iter()
        .map(|huge| huge.1)
        .take(objects)
        .chain(power_law)
}

/// A uniformly random direction.
fn direction(rng: &mut Rng) -> DVec3 {
    let y = 2.0 * f64::from(rng.unit()) - 1.0;
    polar((1.0 - y * y).sqrt(), TAU * f64::from(rng.unit())) + DVec3::Y * y
}

fn any_turn(rng: &mut Rng) -> DQuat {
    let axis = direction(rng);
    (turn(axis, TAU * f64::from(rng.unit())) * turn_y(TAU * f64::from(rng.unit()))).normalize()
}

/// Level, and place in the grid of that level.
type Cell = (i32, [i32; 3]);

/// The rocks so far, by centre and reach, in grids of cells of which each is at least as wide as its rocks.
#[derive(Default)]
struct Swarm {
    cells: HashMap<Cell, Vec<(DVec3, f64)>>,
    /// Levels in use.
    levels: Vec<i32>,
}

/// How far a rock reaches, in its nominal radius: between the directions looked at a little farther.
const BULGE: f64 = 1.05;

impl Swarm {
    /// Cells of level n are 4^n metres wide.
    fn width(level: i32) -> f64 {
        f64::from(2.0_f32.powi(2 * level))
    }

    fn cell(level: i32, at: DVec3) -> [i32; 3] {
        (at / Self::width(level))
            .floor()
            .to_array()
            .map(|x| x as i32)
    }

    fn add(&mut self, centre: DVec3, radius: f64) {
        let reach = BULGE * radius;
        let level = (0..8)
            .find(|&level| Self::width(level) >= 2.0 * reach)
            .expect("no rock is that large");
        if !self.levels.contains(&level) {
            self.levels.push(level);
        }
        let cell = Self::cell(level, centre);
        self.cells
            .entry((level, cell))
            .or_default()
            .push((centre, reach));
    }

    /// Whether a rock no larger than those so far would be clear of them all.
    fn is_free(&self, centre: DVec3, radius: f64) -> bool {
        let reach = BULGE * radius;
        self.levels.iter().all(|&level| {
            let around = DVec3::splat(reach + 0.5 * Self::width(level));
            let from = Self::cell(level, centre - around);
            let to = Self::cell(level, centre + around);
            (from[0]..=to[0]).all(|x| {
                (from[1]..=to[1]).all(|y| {
                    (from[2]..=to[2]).all(|z| {
                        let rocks = self.cells.get(&(level, [x, y, z]));
                        rocks.is_none_or(|rocks| {
                            rocks.iter().all(|&(other, other_reach)| {
                                let apart = reach + other_reach;
                                (other - centre).length_squared() >= apart * apart
                            })
                        })
                    })
                })
            })
        })
    }

    /// Finds a place in the swarm of one of the huge rocks, or now and then in the wide disc of all.
    fn place(&self, radius: f64, rng: &mut Rng) -> DVec3 {
        /// Places tried before one that is taken is taken: far more than ever needed.
        const TRIES: usize = 200;
        let mut found = DVec3::ZERO;
        for _ in 0..TRIES {
            found = if rng.chance(0.25) {
                let distance = 1500.0 * f64::from(rng.unit()).sqrt();
                polar(distance, TAU * f64::from(rng.unit()))
                    + DVec3::Y * f64::from(rng.within(-160.0..160.0))
            } else {
                let (centre, huge) = HUGE[rng.below(HUGE.len())];
                // Denser toward the rock.
                let depth = f64::from(rng.unit());
                let distance = huge * (1.15 + SWARM_DEPTH * depth * depth);
                DVec3::from_array(centre) + direction(rng) * (distance + BULGE * radius)
            };
            if self.is_free(found, radius) {
                return found;
            }
        }
        found
    }
}
