//! A walled town of a fairy tale in a bowl of hills: a keep, a market, rings of houses, a curtain wall with
//! towers, and woods outside. Few objects, each of thousands of triangles.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DQuat, DVec3, dvec3};

use super::noise::Noise;
use super::patch::Grain;
use super::route::{route, stop};
use super::sketch::{Goal, Sketch};
use super::trig::{polar, turn_y};
use super::{Generator, MAIN_PATH, Model, Params, Rng, ScenePath, Shape};

/// Counts of the Fantasy scene of the HROC paper (2021).
const OBJECTS: usize = 7_437;
const TRIANGLES: f64 = 17_879_189.0;
const VERTICES: f64 = 12_292_158.0;

// Plan, metres.
/// Rings of houses at full scale; the town's area follows the number of objects.
const RINGS: f64 = 3.0;
/// Distance from the centre of the innermost houses, and of one ring from the next.
const FIRST_RING: f64 = 46.0;
const RING_STEP: f64 = 25.0;
const STREET: f64 = 7.0;
const WALL_HEIGHT: f64 = 10.0;
const WALL_WIDTH: f64 = 2.4;
/// The streets from the gates to the market, and the gates.
const GATES: usize = 4;
/// How far the land reaches beyond the wall.
const LAND: f64 = 190.0;
/// Sectors of the town's paving.
const SECTORS: usize = 24;
/// Terrain tiles along a side at full scale.
const TILES: f64 = 16.0;

/// The generator.
pub struct Fantasy;

impl Generator for Fantasy {
    fn name(&self) -> &'static str {
        "fantasy"
    }

    fn describe(&self) -> &'static str {
        "a walled town in the hills, few objects of thousands of triangles each (7,437 objects)"
    }

    fn model(&self, params: &Params) -> Model {
        let Params {
            scale,
            detail,
            seed,
        } = *params;
        let objects = params.scaled_count(OBJECTS);
        let name = format!("fantasy scale {scale} detail {detail} seed {seed}");
        let rng = Rng::new(seed);
        let rings = (RINGS * scale.sqrt()).round() as usize;
        let land = Land {
            noise: Noise::new(rng.fork(0).bits()),
            wall: FIRST_RING + RING_STEP * rings as f64 + 14.0,
            tiles: (TILES * scale.sqrt()).round().max(1.0) as usize,
        };
        let mut sketch = Sketch::new(name, objects);
        let kit = Kit::new(&mut sketch, land, rng.fork(1).bits());
        let mut town = Town {
            sketch,
            kit,
            land,
            rng: rng.fork(2),
        };
        town.terrain();
        town.keep();
        town.market();
        town.curtain_wall();
        for ring in 0..rings {
            town.houses(FIRST_RING + RING_STEP * ring as f64);
        }
        town.wilds();
        let per_object = detail * objects as f64 / OBJECTS as f64;
        let mut model = town.sketch.finish(Goal {
            triangles: TRIANGLES * per_object,
            vertices: VERTICES * per_object,
            own_meshes: false,
        });
        model.paths.push(ScenePath {
            name: MAIN_PATH,
            path: walk(&land),
        });
        model
    }
}

/// From above the hills down to a gate, through it, up the street, and into the ring street between the
/// first and the second ring of houses.
fn walk(land: &Land) -> crate::camera_path::CameraPath {
    const EYE: f64 = 1.7;
    let wall = land.wall;
    let at = |distance: f64, quarter: f64, height: f64| {
        polar(distance, quarter * FRAC_PI_2) + DVec3::Y * height
    };
    let ring = FIRST_RING + RING_STEP - 0.5 * STREET;
    route(
        0.1,
        &[
            stop(0.0, at(wall + 150.0, 0.32, 105.0), at(0.0, 0.0, 5.0)),
            stop(3.0, at(wall + 65.0, 0.06, 24.0), at(0.4 * wall, 0.0, 8.0)),
            stop(4.8, at(wall + 14.0, 0.0, 2.6), at(wall - 30.0, 0.0, 2.8)),
            stop(7.4, at(ring + 6.0, 0.0, EYE), at(ring - 14.0, 0.02, 3.0)),
            stop(8.2, at(ring, 0.06, EYE), at(ring - 1.0, 0.4, 2.6)),
            stop(9.1, at(ring, 0.22, EYE), at(ring - 1.0, 0.6, 2.6)),
            stop(10.0, at(ring, 0.38, EYE), at(ring - 1.0, 0.75, 2.6)),
        ],
    )
}

/// The ground: level inside the wall, hills about it.
#[derive(Clone, Copy)]
struct Land {
    noise: Noise,
    /// Radius of the curtain wall.
    wall: f64,
    tiles: usize,
}

impl Land {
    fn half(&self) -> f64 {
        self.wall + LAND
    }

    /// Height above the town's streets.
    fn height(&self, x: f64, z: f64) -> f64 {
        let smooth = |from: f64, to: f64, at: f64| {
            let share = ((at - from) / (to - from)).clamp(0.0, 1.0);
            share * share * (3.0 - 2.0 * share)
        };
        let distance = (x * x + z * z).sqrt();
        let p = dvec3(x, 0.0, z);
        let meadow = 3.5 * self.noise.octaves(p / 45.0, 4) - 2.0;
        let hills = 60.0 * (0.8 + 0.6 * self.noise.octaves(p / 130.0, 6));
        let open = smooth(self.wall + 12.0, self.wall + 60.0, distance);
        let far = smooth(self.wall + 50.0, self.wall + LAND, distance);
        open * meadow + far * hills
    }

    /// A point of the ground.
    fn point(&self, x: f64, z: f64) -> DVec3 {
        dvec3(x, self.height(x, z), z)
    }
}

/// The kinds of objects. Unless said otherwise shapes stand on the origin in their true size.
struct Kit {
    tile: usize,
    /// A sector of the town's paving, from +x on.
    paving: usize,
    keep: usize,
    wall: usize,
    merlon: usize,
    shaft: usize,
    crown: usize,
    spire: usize,
    flag: usize,
    slit: usize,
    /// In the unit box.
    house: [usize; 3],
    /// Likewise, ridge along x.
    roof: usize,
    /// In the unit box, on a wall: z from 0 outward.
    window: usize,
    /// Likewise.
    door: usize,
    /// In the unit box.
    beam: usize,
    /// In the unit box.
    chimney: usize,
    barrel: usize,
    /// In the unit box.
    chest: usize,
    cart: usize,
    stall: usize,
    well: usize,
    statue: usize,
    trunk: usize,
    crown_of_leaves: usize,
    fir: usize,
    /// In the unit box about the origin.
    rock: usize,
    /// Likewise.
    bush: usize,
}

/// Bends a surface by noise of a wave length, as much as `depth` each way.
fn rough(noise: Noise, length: f64, depth: f64) -> impl Fn(DVec3) -> DVec3 {
    move |p| p + depth * noise.vector(p / length)
}

impl Kit {
    fn new(sketch: &mut Sketch, land: Land, seed: u64) -> Self {
        let noise = Noise::new(seed);
        let grass = sketch.material("grass", [0.20, 0.28, 0.10]);
        let stone = sketch.material("stone", [0.43, 0.41, 0.37]);
        let dark = sketch.material("dark stone", [0.29, 0.28, 0.27]);
        let slate = sketch.material("slate", [0.16, 0.20, 0.30]);
        let thatch = sketch.material("thatch", [0.50, 0.36, 0.16]);
        let lime = sketch.material("lime", [0.70, 0.64, 0.52]);
        let ochre = sketch.material("ochre", [0.60, 0.42, 0.22]);
        let rose = sketch.material("rose", [0.58, 0.34, 0.27]);
        let wood = sketch.material("wood", [0.24, 0.14, 0.07]);
        let pane = sketch.material("panes", [0.14, 0.20, 0.26]);
        let cloth = sketch.material("cloth", [0.58, 0.10, 0.09]);
        let bark = sketch.material("bark", [0.20, 0.13, 0.08]);
        let leaves = sketch.material("leaves", [0.13, 0.30, 0.07]);
        let needles = sketch.material("needles", [0.06, 0.19, 0.09]);
        let bronze = sketch.material("bronze", [0.20, 0.32, 0.26]);

        let unit = [dvec3(-0.5, 0.0, -0.5), dvec3(0.5, 1.0, 0.5)];
        let (low, high) = (unit[0], unit[1]);
        let rough_unit = move |grain: Grain, _: usize| {
            let bend = rough(noise, 0.12, 0.004);
            Shape::bent_box(grain, low, high, move |p, _| bend(p))
        };
        let turned = move |profile: &'static [[f64; 2]], length: f64, depth: f64| {
            move |grain: Grain, _: usize| Shape::lathe(grain, profile, rough(noise, length, depth))
        };
        let tile = move |grain: Grain, tile: usize| {
            let side = ((0.5 * grain.triangles).sqrt().round() as usize).max(1);
            let width = 2.0 * land.half() / land.tiles as f64;
            let corner =
                [tile % land.tiles, tile / land.tiles].map(|i| i as f64 * width - land.half());
            let mut shape = Shape::default();
            shape.patch(side, side, grain.chart, |s, t| {
                land.point(corner[0] + width * t, corner[1] + width * s)
            });
            shape
        };
        let foliage = move |grain: Grain, variant: usize| {
            let leafy = Noise::new(seed ^ (variant as u64 + 1));
            Shape::boulder(grain, move |direction| {
                0.36 + 0.10 * leafy.octaves(direction * 2.0, 3) + 0.035 * leafy.at(direction * 17.0)
            })
        };
        let paving = move |grain: Grain, _: usize| {
            let side = (0.5 * grain.triangles).sqrt();
            let across = ((side / 2.0).round() as usize).max(2);
            let along = ((2.0 * side).round() as usize).max(2);
            let mut shape = Shape::default();
            shape.patch(across, along, grain.chart, |s, t| {
                let p = polar((land.wall - 0.8) * t, TAU / SECTORS as f64 * (1.0 - s));
                // The stones lie above the ground in its whole range.
                p + DVec3::Y * (0.12 + 0.03 * noise.at(p * 2.2))
            });
            shape
        };
        Self {
            paving: sketch.kind("paving", dark, 9.0, 1, paving),
            tile: sketch.kind("terrain", grass, 9.0, land.tiles * land.tiles, tile),
            keep: sketch.kind("keep", stone, 24.0, 1, move |grain, _| {
                let bend = rough(noise, 1.3, 0.10);
                Shape::bent_box(
                    grain,
                    dvec3(-9.0, -1.0, -9.0),
                    dvec3(9.0, 27.0, 9.0),
                    move |p, _| bend(p),
                )
            }),
            wall: sketch.kind("curtain wall", stone, 8.0, 3, move |grain, variant| {
                let bend = rough(Noise::new(seed + variant as u64), 0.9, 0.06);
                let end = dvec3(0.5, WALL_HEIGHT, 0.5 * WALL_WIDTH);
                // Length 1 here; a wave along it is as long as one upward once a piece is in place.
                let min = dvec3(-0.5, -2.0, -0.5 * WALL_WIDTH);
                Shape::bent_box(grain, min, end, move |p, _| {
                    let bent = bend(p * dvec3(14.0, 1.0, 1.0));
                    bent * dvec3(1.0 / 14.0, 1.0, 1.0)
                })
            }),
            merlon: sketch.kind("merlon", stone, 1.2, 1, rough_unit),
            shaft: sketch.kind("tower", stone, 11.0, 1, turned(SHAFT, 0.8, 0.06)),
            crown: sketch.kind("tower crown", dark, 7.0, 1, crown),
            spire: sketch.kind("tower roof", slate, 8.0, 1, turned(SPIRE, 0.35, 0.05)),
            flag: sketch.kind("flag", cloth, 1.5, 1, flag),
            slit: sketch.kind("arrow slit", dark, 1.0, 1, rough_unit),
            house: [lime, ochre, rose].map(|m| sketch.kind("house", m, 4.0, 1, rough_unit)),
            roof: sketch.kind("thatched roof", thatch, 8.0, 2, move |grain, variant| {
                let straw = Noise::new(seed.wrapping_mul(3) + variant as u64);
                Shape::bent_box(grain, low, high, move |p, at| {
                    let ridge = dvec3(p.x, p.y, p.z * (1.0 - 0.95 * at.y));
                    ridge + 0.02 * straw.vector(ridge * dvec3(14.0, 7.0, 7.0))
                })
            }),
            window: sketch.kind("window", pane, 1.6, 1, framed),
            door: sketch.kind("door", wood, 2.0, 1, framed),
            beam: sketch.kind("beam", wood, 0.8, 1, rough_unit),
            chimney: sketch.kind("chimney", dark, 2.0, 1, rough_unit),
            barrel: sketch.kind("barrel", wood, 2.6, 1, turned(BARREL, 0.3, 0.004)),
            chest: sketch.kind("chest", wood, 1.6, 1, rough_unit),
            cart: sketch.kind("cart", wood, 6.0, 1, cart),
            stall: sketch.kind("stall", cloth, 6.0, 1, stall),
            well: sketch.kind("well", stone, 9.0, 1, turned(WELL, 0.25, 0.04)),
            statue: sketch.kind("statue", bronze, 20.0, 1, move |grain, _| {
                Shape::lathe(grain, STATUE, rough(noise, 0.5, 0.14))
            }),
            trunk: sketch.kind("trunk", bark, 1.8, 1, turned(TRUNK, 0.3, 0.03)),
            crown_of_leaves: sketch.kind("leaves", leaves, 4.5, 5, foliage),
            fir: sketch.kind("fir", needles, 5.0, 1, turned(FIR, 0.25, 0.11)),
            rock: sketch.kind("rock", dark, 3.0, 6, move |grain, variant| {
                Shape::rock(grain, seed.wrapping_add(100 + variant as u64))
            }),
            bush: sketch.kind("bush", leaves, 3.0, 4, foliage),
        }
    }
}

// Radius and height, from below upward.
const SHAFT: &[[f64; 2]] = &[
    [4.6, -2.0],
    [4.3, 1.0],
    [3.8, 3.0],
    [3.7, 9.0],
    [3.7, 15.0],
    [4.3, 16.0],
    [0.0, 16.0],
];
const SPIRE: &[[f64; 2]] = &[[0.0, 0.0], [4.4, 0.0], [3.1, 2.4], [1.5, 6.4], [0.0, 10.0]];
const BARREL: &[[f64; 2]] = &[
    [0.0, 0.0],
    [0.30, 0.0],
    [0.38, 0.45],
    [0.30, 0.9],
    [0.0, 0.9],
];
const WELL: &[[f64; 2]] = &[
    [1.3, -0.2],
    [1.25, 1.0],
    [0.95, 1.0],
    [0.95, 0.1],
    [0.0, 0.1],
];
const TRUNK: &[[f64; 2]] = &[
    [0.5, -0.6],
    [0.28, 0.5],
    [0.2, 2.0],
    [0.14, 4.0],
    [0.0, 4.0],
];
const FIR: &[[f64; 2]] = &[
    [0.0, 1.0],
    [2.2, 0.9],
    [0.9, 3.2],
    [1.8, 3.0],
    [0.6, 5.4],
    [1.3, 5.2],
    [0.0, 8.6],
];
const STATUE: &[[f64; 2]] = &[
    [2.4, -0.3],
    [2.4, 0.5],
    [1.6, 0.6],
    [1.5, 2.6],
    [1.8, 2.8],
    [0.8, 2.9],
    [0.55, 4.2],
    [0.85, 5.4],
    [0.30, 6.0],
    [0.42, 6.5],
    [0.0, 6.9],
];

/// Several boxes, cut by their share of the surface alike.
fn boxes(grain: Grain, corners: &[[DVec3; 2]]) -> Shape {
    let mut shape = Shape::default();
    for &[min, max] in corners {
        shape.merge(Shape::fine_box(
            grain.share(1.0 / corners.len() as f64),
            min,
            max,
        ));
    }
    shape
}

/// A ring of stone on a tower with eight merlons.
fn crown(grain: Grain, _: usize) -> Shape {
    let ring = [
        [3.6, 0.0],
        [4.6, 0.5],
        [4.6, 1.4],
        [4.0, 1.4],
        [4.0, 0.6],
        [0.0, 0.6],
    ];
    let mut shape = Shape::lathe(grain.share(0.5), &ring, |p| p);
    for i in 0..8 {
        let rotation = turn_y(TAU * f64::from(i) / 8.0);
        let (min, max) = (dvec3(4.0, 1.3, -0.8), dvec3(4.6, 2.3, 0.8));
        shape.merge(Shape::bent_box(grain.share(0.5 / 8.0), min, max, |p, _| {
            rotation * p
        }));
    }
    shape
}

/// A pole and a waving cloth.
fn flag(grain: Grain, _: usize) -> Shape {
    let pole = [[0.06, 0.0], [0.05, 4.0], [0.0, 4.05]];
    let mut shape = Shape::lathe(grain.share(0.3), &pole, |p| p);
    let (min, max) = (dvec3(0.05, 2.6, -0.01), dvec3(2.4, 3.9, 0.01));
    let (wave, length) = (0.16, 1.1);
    shape.merge(Shape::bent_box(grain.share(0.7), min, max, |p, at| {
        let swing = super::trig::sin_cos(TAU * p.x / length).0;
        p + DVec3::Z * (wave * at.x * swing)
    }));
    shape
}

/// A leaf of wood or glass in a frame.
fn framed(grain: Grain, _: usize) -> Shape {
    let bar = |min: [f64; 2], max: [f64; 2], depth: f64| {
        [dvec3(min[0], min[1], 0.0), dvec3(max[0], max[1], depth)]
    };
    boxes(
        grain,
        &[
            bar([-0.42, 0.06], [0.42, 0.94], 0.4),
            bar([-0.5, 0.0], [-0.42, 1.0], 1.0),
            bar([0.42, 0.0], [0.5, 1.0], 1.0),
            bar([-0.42, 0.94], [0.42, 1.0], 1.0),
            bar([-0.42, 0.0], [0.42, 0.06], 1.0),
            bar([-0.03, 0.06], [0.03, 0.94], 0.7),
            bar([-0.42, 0.47], [0.42, 0.53], 0.7),
        ],
    )
}

/// A box on two wheels and a shaft.
fn cart(grain: Grain, _: usize) -> Shape {
    let mut shape = boxes(
        grain.share(0.5),
        &[
            [dvec3(-1.3, 0.75, -0.65), dvec3(1.1, 0.85, 0.65)],
            [dvec3(-1.3, 0.85, -0.65), dvec3(1.1, 1.35, -0.58)],
            [dvec3(-1.3, 0.85, 0.58), dvec3(1.1, 1.35, 0.65)],
            [dvec3(-1.3, 0.85, -0.58), dvec3(-1.23, 1.35, 0.58)],
            [dvec3(-0.07, 0.63, -0.8), dvec3(0.07, 0.75, 0.8)],
            [dvec3(1.1, 0.72, -0.05), dvec3(2.6, 0.82, 0.05)],
        ],
    );
    for z in [-0.78, 0.78] {
        let mut wheel = Shape::ring(grain.share(0.25), 0.62, 0.06, TAU);
        for p in &mut wheel.positions {
            *p += glam::vec3(0.0, 0.68, z as f32);
        }
        shape.merge(wheel);
    }
    shape
}

/// A table under a sagging canopy.
fn stall(grain: Grain, _: usize) -> Shape {
    let post = |x: f64, z: f64| {
        [
            dvec3(x - 0.05, 0.0, z - 0.05),
            dvec3(x + 0.05, 2.3, z + 0.05),
        ]
    };
    let mut shape = boxes(
        grain.share(0.4),
        &[
            post(-1.4, -0.9),
            post(1.4, -0.9),
            post(-1.4, 0.9),
            post(1.4, 0.9),
            [dvec3(-1.35, 0.8, 0.1), dvec3(1.35, 0.9, 0.85)],
        ],
    );
    let (min, max) = (dvec3(-1.6, 2.3, -1.1), dvec3(1.6, 2.36, 1.1));
    shape.merge(Shape::bent_box(grain.share(0.6), min, max, |p, at| {
        let sag = (at.x - at.x * at.x) + (at.z - at.z * at.z);
        p + DVec3::Y * (0.5 * at.z - 0.5 * sag)
    }));
    shape
}

/// The town while it is built.
struct Town {
    sketch: Sketch,
    kit: Kit,
    land: Land,
    rng: Rng,
}

impl Town {
    fn within(&mut self, from: f64, to: f64) -> f64 {
        f64::from(self.rng.within(from as f32..to as f32))
    }

    fn terrain(&mut self) {
        self.sketch.group("terrain", DVec3::ZERO, DQuat::IDENTITY);
        for tile in 0..self.land.tiles * self.land.tiles {
            self.sketch.part(
                self.kit.tile,
                tile,
                DVec3::ZERO,
                DQuat::IDENTITY,
                DVec3::ONE,
            );
        }
        for sector in 0..SECTORS {
            let turn = turn_y(TAU * sector as f64 / SECTORS as f64);
            self.sketch
                .part(self.kit.paving, 0, DVec3::ZERO, turn, DVec3::ONE);
        }
    }

    /// A square house of stone with windows all round, and a tower at each of its corners.
    fn keep(&mut self) {
        self.sketch.group("keep", DVec3::ZERO, DQuat::IDENTITY);
        self.sketch.put(self.kit.keep, DVec3::ZERO, DVec3::ONE);
        for side in 0..4 {
            let rotation = turn_y(FRAC_PI_2 * f64::from(side));
            for floor in 0..4 {
                for column in [-4.0, 0.0, 4.0] {
                    let is_door = floor == 0 && column == 0.0;
                    let (kind, size) = if is_door {
                        (self.kit.door, dvec3(3.0, 4.5, 0.5))
                    } else {
                        (self.kit.window, dvec3(1.4, 2.6, 0.4))
                    };
                    let y = if is_door {
                        0.0
                    } else {
                        2.5 + 6.0 * f64::from(floor)
                    };
                    let at = rotation * dvec3(column, y, 8.95);
                    self.sketch.part(kind, 0, at, rotation, size);
                }
            }
            for i in 0..6 {
                let at = rotation * dvec3(-6.0 + 2.4 * f64::from(i), 26.9, 8.4);
                let size = dvec3(1.2, 1.8, 1.0);
                self.sketch.part(self.kit.merlon, 0, at, rotation, size);
            }
        }
        for x in [-10.0, 10.0] {
            for z in [-10.0, 10.0] {
                self.tower(dvec3(x, 0.0, z), 2.0, 0.0);
            }
        }
    }

    /// A tower of `stretch` times the common height, with slits that look in `direction` and to its sides.
    fn tower(&mut self, at: DVec3, stretch: f64, direction: f64) {
        let top = 16.0 * stretch;
        let Kit {
            shaft,
            crown,
            spire,
            flag,
            slit,
            ..
        } = self.kit;
        self.sketch.put(shaft, at, dvec3(1.0, stretch, 1.0));
        self.sketch
            .put(crown, at + DVec3::Y * (top - 0.1), DVec3::ONE);
        self.sketch
            .put(spire, at + DVec3::Y * (top + 2.6), DVec3::ONE);
        // The roof rests on a drum within the crown.
        let drum = dvec3(5.2, 2.6, 5.2);
        self.sketch.put(slit, at + DVec3::Y * (top + 0.2), drum);
        let turn = turn_y(self.within(0.0, TAU));
        let mast = at + DVec3::Y * (top + 12.0);
        self.sketch.part(flag, 0, mast, turn, DVec3::ONE);
        for (side, y) in [(-1.0, 0.3), (0.0, 0.5), (1.0, 0.3)] {
            let out = direction + side * FRAC_PI_2;
            let place = at + polar(3.7, out) + DVec3::Y * (top * y);
            let rotation = turn_y(FRAC_PI_2 - out);
            self.sketch
                .part(slit, 0, place, rotation, dvec3(0.5, 1.8, 0.4));
        }
    }

    /// Stalls round a well and a statue before the keep.
    fn market(&mut self) {
        self.sketch.group("market", DVec3::ZERO, DQuat::IDENTITY);
        let Kit {
            well,
            statue,
            stall,
            barrel,
            chest,
            cart,
            ..
        } = self.kit;
        self.sketch.put(well, polar(27.0, 0.5), DVec3::ONE);
        self.sketch
            .put(statue, polar(24.0, TAU / 4.0 + 0.6), DVec3::ONE);
        for i in 0..14 {
            let direction = TAU * (f64::from(i) + 0.5) / 14.0;
            let out = polar(1.0, direction);
            let rotation = turn_y(FRAC_PI_2 - direction);
            let middle = 31.0 * out;
            self.sketch.part(stall, 0, middle, rotation, DVec3::ONE);
            for x in [-1.0, 0.0, 1.0] {
                let size = dvec3(self.within(0.4, 0.8), self.within(0.2, 0.4), 0.5);
                let at = middle + rotation * dvec3(x, 0.9, 0.45);
                self.sketch.part(chest, 0, at, rotation, size);
            }
            for x in [-2.3, 2.3] {
                let at = middle + rotation * dvec3(x + self.within(-0.2, 0.2), 0.0, -0.4);
                self.sketch.put(barrel, at, DVec3::ONE);
            }
            if i % 4 == 1 {
                let at = middle + rotation * dvec3(0.0, 0.0, -4.5);
                let turn = turn_y(self.within(0.0, TAU));
                self.sketch.part(cart, 0, at, turn, DVec3::ONE);
            }
        }
    }

    /// Pieces of wall from tower to tower, and a gatehouse over each of the streets.
    fn curtain_wall(&mut self) {
        self.sketch
            .group("curtain wall", DVec3::ZERO, DQuat::IDENTITY);
        let radius = self.land.wall;
        let gate = 5.0;
        let towers = ((TAU * radius / 52.0 / GATES as f64).round().max(1.0) as usize) * GATES;
        // Each gate is an opening between two towers; the other towers stand between the gates.
        for i in 0..towers {
            let from = TAU * i as f64 / towers as f64;
            let to = TAU * (i + 1) as f64 / towers as f64;
            let is_gate = |i: usize| (i % towers).is_multiple_of(towers / GATES);
            let opening = (0.5 * gate + 3.6) / radius;
            let start = if is_gate(i) { from + opening } else { from };
            let end = if is_gate(i + 1) { to - opening } else { to };
            self.tower(polar(radius, start), 1.0, start);
            if is_gate(i + 1) {
                self.tower(polar(radius, end), 1.0, end);
            }
            self.wall_piece(start, end, 0.0);
            if is_gate(i) {
                let half = opening - 3.0 / radius;
                self.gatehouse(from, 2.0 * half * radius);
            }
        }
    }

    /// Straight pieces of wall along an arc of the ring, with merlons.
    fn wall_piece(&mut self, from: f64, to: f64, lift: f64) {
        let radius = self.land.wall;
        let pieces = ((to - from) * radius / 14.0).ceil().max(1.0);
        let step = (to - from) / pieces;
        for i in 0..pieces as usize {
            let [a, b] = [i, i + 1].map(|i| polar(radius, from + step * i as f64));
            let middle = 0.5 * (a + b) + DVec3::Y * lift;
            let rotation = turn_y(FRAC_PI_2 - (from + step * (i as f64 + 0.5)));
            let length = (b - a).length();
            // A little longer, so that the outside has no gap at the corner.
            let size = dvec3(length + 0.4, 1.0, 1.0);
            self.sketch.part(self.kit.wall, i, middle, rotation, size);
            let merlons = (length / 2.4).floor();
            for merlon in 0..merlons as usize {
                let x = length * ((merlon as f64 + 0.5) / merlons - 0.5);
                let out = 0.5 * WALL_WIDTH - 0.3;
                let at = middle + rotation * dvec3(x, WALL_HEIGHT - 0.1, out);
                let size = dvec3(1.2, 1.5, 0.6);
                self.sketch.part(self.kit.merlon, 0, at, rotation, size);
            }
        }
    }

    /// Wall over an opening, its leaves swung in, torches as slits beside it.
    fn gatehouse(&mut self, direction: f64, width: f64) {
        let middle = polar(self.land.wall, direction);
        let rotation = turn_y(FRAC_PI_2 - direction);
        let Kit {
            merlon, door, beam, ..
        } = self.kit;
        let lintel = dvec3(width, 5.5, WALL_WIDTH + 0.8);
        self.sketch
            .part(merlon, 0, middle + DVec3::Y * 5.5, rotation, lintel);
        for x in [-1.0, 0.0, 1.0] {
            let at = middle + rotation * dvec3(0.3 * width * x, 10.9, 1.2);
            self.sketch
                .part(merlon, 0, at, rotation, dvec3(1.2, 1.5, 0.6));
        }
        self.sketch.part(
            beam,
            0,
            middle + rotation * dvec3(0.0, 5.2, 0.0),
            rotation,
            dvec3(width, 0.4, WALL_WIDTH + 0.4),
        );
        for side in [-1.0, 1.0] {
            // Hung on the tower's side, they open toward the town.
            let hinge = middle + rotation * dvec3(side * 2.6, 0.0, -1.2);
            let open = rotation * turn_y(side * FRAC_PI_2);
            let at = hinge + rotation * dvec3(0.0, 0.0, -1.25);
            self.sketch.part(door, 0, at, open, dvec3(2.5, 5.0, 0.25));
        }
    }

    /// Houses that face the ring streets on both sides of a ring, and leave the streets to the gates free.
    fn houses(&mut self, radius: f64) {
        let width = 11.5;
        let street = 0.5 * STREET / radius;
        let quarter = TAU / GATES as f64 - 2.0 * street;
        let depth = RING_STEP - STREET;
        // Measured where the row is shortest, so that neighbours do not intersect.
        let count = (quarter * radius / width).floor().max(1.0);
        let step = quarter / count;
        for gate in 0..GATES {
            for i in 0..count as usize {
                let direction = TAU * gate as f64 / GATES as f64 + street + step * (i as f64 + 0.5);
                for (middle, face) in [(radius + 0.25 * depth, -1.0), (radius + 0.75 * depth, 1.0)]
                {
                    let turn = if face > 0.0 { 0.0 } else { TAU / 2.0 };
                    let rotation = turn_y(FRAC_PI_2 - direction + turn);
                    let place = polar(middle, direction);
                    self.sketch.group("house", place, rotation);
                    let size = [0.92 * step * radius, 0.44 * depth];
                    self.house(size[0], size[1]);
                }
            }
        }
    }

    /// A house in the open group: its front toward +z.
    fn house(&mut self, width: f64, depth: f64) {
        let Kit {
            house,
            roof,
            window,
            door,
            beam,
            chimney,
            barrel,
            chest,
            cart,
            ..
        } = self.kit;
        let floors = 2 + self.rng.below(2);
        let floor_height = 2.9;
        let height = floors as f64 * floor_height;
        let front = 0.5 * depth;
        let body = house[self.rng.below(house.len())];
        self.sketch
            .put(body, DVec3::NEG_Y * 0.2, dvec3(width, height + 0.2, depth));
        let pitch = self.within(3.6, 5.4);
        let variant = self.rng.below(2);
        let eaves = dvec3(width + 0.5, pitch, depth + 1.4);
        let top = DVec3::Y * (height - 0.15);
        self.sketch.part(roof, variant, top, DQuat::IDENTITY, eaves);
        let x = width * self.within(-0.35, 0.35);
        let z = depth * self.within(-0.2, 0.2);
        let size = dvec3(0.9, pitch + 1.0, 0.9);
        self.sketch.put(chimney, dvec3(x, height - 0.2, z), size);
        for floor in 0..floors {
            let y = floor as f64 * floor_height;
            let sill = dvec3(0.0, y + floor_height - 0.3, front - 0.05);
            self.sketch.put(beam, sill, dvec3(width + 0.1, 0.3, 0.25));
            for column in 0..3 {
                let x = width * (f64::from(column) - 1.0) * 0.3;
                if floor == 0 && column == 1 {
                    let at = dvec3(x, 0.0, front - 0.03);
                    self.sketch.put(door, at, dvec3(1.3, 2.3, 0.25));
                } else {
                    let at = dvec3(x, y + 0.9, front - 0.03);
                    self.sketch.put(window, at, dvec3(1.1, 1.4, 0.2));
                }
            }
        }
        for side in [-0.5, 0.5] {
            let post = dvec3(side * (width - 0.2), 0.0, front - 0.05);
            self.sketch.put(beam, post, dvec3(0.3, height, 0.25));
        }
        match self.rng.below(5) {
            0 => {
                let turn = turn_y(self.within(-0.2, 0.2));
                let at = dvec3(0.2 * width, 0.0, front + 1.1);
                self.sketch.part(cart, 0, at, turn, DVec3::splat(0.8));
            }
            1 | 2 => {
                for i in 0..2 {
                    let at = dvec3(width * 0.3 - 0.85 * f64::from(i), 0.0, front + 0.55);
                    self.sketch.put(barrel, at, DVec3::ONE);
                }
            }
            3 => {
                let at = dvec3(-0.3 * width, 0.0, front + 0.5);
                self.sketch.put(chest, at, dvec3(0.9, 0.6, 0.6));
            }
            _ => {}
        }
    }

    /// Trees, rocks and bushes outside the wall until the scene is full.
    fn wilds(&mut self) {
        let Kit {
            trunk,
            crown_of_leaves,
            fir,
            rock,
            bush,
            ..
        } = self.kit;
        let mut grove = 0;
        while !self.sketch.is_full() {
            // Groves: what stands together is a group.
            let (middle, spread) = loop {
                let half = self.land.half() - 20.0;
                let (x, z) = (self.within(-half, half), self.within(-half, half));
                if dvec3(x, 0.0, z).length() > self.land.wall + 45.0 {
                    break (dvec3(x, 0.0, z), self.within(8.0, 22.0));
                }
            };
            grove += 1;
            self.sketch
                .group(format!("grove {grove}"), DVec3::ZERO, DQuat::IDENTITY);
            let firs = self.rng.chance(0.5);
            for _ in 0..18 {
                let distance = spread * f64::from(self.rng.unit()).sqrt();
                let at = middle + polar(distance, self.within(0.0, TAU));
                let ground = self.land.point(at.x, at.z);
                let turn = turn_y(self.within(0.0, TAU));
                let variant = self.rng.below(60);
                let kind = self.rng.unit();
                if kind < 0.6 {
                    let size = self.within(0.9, 1.7);
                    let scale = DVec3::splat(size);
                    self.sketch.part(trunk, 0, ground, turn, scale);
                    if firs {
                        self.sketch.part(fir, 0, ground, turn, scale);
                    } else {
                        let leaves = ground + DVec3::Y * (4.6 * size);
                        let scale = dvec3(5.2, 4.8, 5.2) * size;
                        self.sketch
                            .part(crown_of_leaves, variant, leaves, turn, scale);
                    }
                } else if kind < 0.8 {
                    let size = self.within(0.8, 3.2);
                    let scale = dvec3(size, 0.8 * size, size);
                    self.sketch.part(rock, variant, ground, turn, scale);
                } else {
                    let size = self.within(1.2, 2.4);
                    let at = ground + DVec3::Y * (0.25 * size);
                    self.sketch
                        .part(bush, variant, at, turn, DVec3::splat(size));
                }
            }
        }
    }
}
