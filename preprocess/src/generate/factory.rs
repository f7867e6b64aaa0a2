//! A factory: blocks in a grid of streets. In each a hall with racks, machines, pipes and barrels, and a
//! yard with tanks, behind a wall as high as a man can reach. From the streets walls hide nearly all of it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DQuat, DVec3, dvec3};

use super::patch::Grain;
use super::route::{route, stop};
use super::sketch::{Goal, Sketch};
use super::trig::{turn, turn_y};
use super::{Generator, MAIN_PATH, Model, Params, Rng, ScenePath, Shape};

/// Counts of the Factory scene of the HROC paper (2021).
const OBJECTS: usize = 46_600;
const TRIANGLES: f64 = 5_718_850.0;
const VERTICES: f64 = 10_535_850.0;

// Plan, metres. A block's frame: its middle at the origin, the gate toward +z.
/// From one block to the next: along x and z.
const PITCH: [f64; 2] = [86.0, 62.0];
const STREET: f64 = 12.0;
/// The hall: half its length and depth, its height, and its middle on x.
const HALL: DVec3 = dvec3(22.0, 9.0, 14.0);
const HALL_X: f64 = -12.0;
const GATE_WIDTH: f64 = 7.0;
const GATE_HEIGHT: f64 = 5.0;
const WALL_HEIGHT: f64 = 3.4;
const KERB: f64 = 0.15;

/// The generator.
pub struct Factory;

impl Generator for Factory {
    fn name(&self) -> &'static str {
        "factory"
    }

    fn describe(&self) -> &'static str {
        "halls and yards full of barrels, pipes and racks behind large walls (46,600 objects)"
    }

    fn model(&self, params: &Params) -> Model {
        let Params {
            scale,
            detail,
            seed,
        } = *params;
        let objects = params.scaled_count(OBJECTS);
        let name = format!("factory scale {scale} detail {detail} seed {seed}");
        let mut sketch = Sketch::new(name, objects);
        let kit = Kit::new(&mut sketch);
        let rng = Rng::new(seed);
        // Rings of blocks about the first one.
        let mut reach = 0.0_f64;
        'blocks: for ring in 0_i32.. {
            for z in -ring..=ring {
                for x in -ring..=ring {
                    if x.abs().max(z.abs()) != ring {
                        continue;
                    }
                    if sketch.is_full() {
                        break 'blocks;
                    }
                    let middle = dvec3(f64::from(x) * PITCH[0], 0.0, f64::from(z) * PITCH[1]);
                    reach = reach.max(middle.length());
                    // The first block faces the walk; the others face this street or that.
                    let index = (i64::from(x) << 32) ^ i64::from(z);
                    let mut rng = rng.fork(index as u64);
                    let turned = ring > 0 && rng.chance(0.5);
                    let rotation = turn_y(if turned { PI } else { 0.0 });
                    let mut block = Block {
                        sketch: &mut sketch,
                        kit: &kit,
                        middle,
                        rotation,
                        rng,
                    };
                    block.build();
                }
            }
        }
        let per_object = detail * objects as f64 / OBJECTS as f64;
        let mut model = sketch.finish(Goal {
            triangles: TRIANGLES * per_object,
            vertices: VERTICES * per_object,
            own_meshes: true,
        });
        model.paths.push(ScenePath {
            name: MAIN_PATH,
            path: walk(reach + PITCH[0]),
        });
        model
    }
}

/// From above a corner of the site down into the street, along it, and through the gate of the first block.
fn walk(reach: f64) -> crate::camera_path::CameraPath {
    const EYE: f64 = 1.7;
    let street = 0.5 * PITCH[1];
    let far = dvec3(0.62 * reach, 0.34 * reach, 0.72 * reach);
    // Above the street before the roofs are near.
    let turn_in = dvec3((0.5 * reach).max(150.0), 0.14 * reach + 16.0, street);
    let gate = |x: f64, y: f64, z: f64| dvec3(HALL_X + x, EYE + y, z);
    route(
        0.1,
        &[
            stop(0.0, far, dvec3(0.0, -20.0, 0.0)),
            stop(2.8, turn_in, dvec3(0.3 * reach, 0.0, street)),
            stop(4.8, dvec3(96.0, 4.0, street), dvec3(20.0, EYE, street)),
            stop(7.5, dvec3(14.0, EYE, street), gate(-4.0, 0.4, street - 1.0)),
            stop(8.7, gate(3.0, 0.0, street - 2.0), gate(-6.0, 0.4, 8.0)),
            stop(10.0, gate(0.0, 0.0, 20.5), gate(-1.0, 0.6, 0.0)),
        ],
    )
}

/// The kinds of objects. Shapes fill the unit box that stands on the origin, unless said otherwise.
struct Kit {
    asphalt: usize,
    concrete: usize,
    brick: usize,
    sheet: usize,
    steel: usize,
    glass: usize,
    sawtooth: usize,
    barrels: [usize; 3],
    crate_: usize,
    /// Of unit length along x about the origin, and of unit diameter.
    pipe: usize,
    /// A quarter turn from +x to +y about the origin, of unit radius.
    elbow: usize,
    flange: usize,
    valve: usize,
    rack: usize,
    machine: usize,
    tank: usize,
    ladder: usize,
    lamp: usize,
    vent: usize,
    hydrant: usize,
}

impl Kit {
    fn new(sketch: &mut Sketch) -> Self {
        let asphalt = sketch.material("asphalt", [0.10, 0.10, 0.11]);
        let concrete = sketch.material("concrete", [0.42, 0.41, 0.39]);
        let brick = sketch.material("brick", [0.40, 0.17, 0.11]);
        let sheet = sketch.material("sheet metal", [0.30, 0.38, 0.44]);
        let steel = sketch.material("steel", [0.24, 0.25, 0.27]);
        let glass = sketch.material("glass", [0.16, 0.24, 0.28]);
        let blue = sketch.material("blue drum", [0.07, 0.19, 0.46]);
        let yellow = sketch.material("yellow drum", [0.66, 0.46, 0.06]);
        let red = sketch.material("red drum", [0.52, 0.09, 0.06]);
        let wood = sketch.material("wood", [0.42, 0.28, 0.14]);
        let pipe = sketch.material("pipe", [0.55, 0.56, 0.55]);
        let green = sketch.material("machine green", [0.16, 0.33, 0.21]);
        let white = sketch.material("tank white", [0.72, 0.72, 0.68]);

        let unit = [dvec3(-0.5, 0.0, -0.5), dvec3(0.5, 1.0, 0.5)];
        let cuboid = move |grain: Grain, _| Shape::fine_box(grain, unit[0], unit[1]);
        let turned = |profile: &'static [[f64; 2]]| {
            move |grain: Grain, _| Shape::lathe(grain, profile, |p| p)
        };
        let mut box_of = |name, material| sketch.kind(name, material, 1.0, 1, cuboid);
        Self {
            asphalt: box_of("street", asphalt),
            concrete: box_of("concrete", concrete),
            brick: box_of("wall", brick),
            sheet: box_of("sheet", sheet),
            steel: box_of("beam", steel),
            glass: box_of("skylight", glass),
            sawtooth: sketch.kind("sawtooth roof", sheet, 1.0, 1, move |grain, _| {
                Shape::bent_box(grain, unit[0], unit[1], |p, at| {
                    dvec3(p.x, p.y * (0.12 + 0.88 * at.x), p.z)
                })
            }),
            barrels: [blue, yellow, red].map(|m| sketch.kind("barrel", m, 18.0, 1, turned(BARREL))),
            crate_: sketch.kind("crate", wood, 9.0, 1, slatted_crate),
            pipe: sketch.kind("pipe", pipe, 7.0, 1, |grain, _| {
                // Its ends are open: flanges and elbows close them.
                Shape::lathe(grain, &[[0.5, -0.5], [0.5, 0.5]], |p| dvec3(p.y, -p.x, p.z))
            }),
            elbow: sketch.kind("elbow", pipe, 10.0, 1, |grain, _| {
                Shape::ring(grain, 1.0, 0.45, FRAC_PI_2)
            }),
            flange: sketch.kind("flange", steel, 7.0, 1, |grain, _| {
                let profile = [[0.0, -0.5], [0.5, -0.5], [0.5, 0.5], [0.0, 0.5]];
                Shape::lathe(grain, &profile, |p| dvec3(p.y, -p.x, p.z))
            }),
            valve: sketch.kind("valve", red, 24.0, 1, valve),
            rack: sketch.kind("rack", blue, 20.0, 1, rack),
            machine: sketch.kind("machine", green, 70.0, 1, machine),
            tank: sketch.kind("tank", white, 60.0, 1, turned(TANK)),
            ladder: sketch.kind("ladder", steel, 22.0, 1, ladder),
            lamp: sketch.kind("lamp", steel, 12.0, 1, lamp),
            vent: sketch.kind("vent", steel, 10.0, 1, turned(VENT)),
            hydrant: sketch.kind("hydrant", red, 16.0, 1, turned(HYDRANT)),
        }
    }
}

/// Radius and height, from below upward.
const BARREL: &[[f64; 2]] = &[
    [0.0, 0.0],
    [0.47, 0.0],
    [0.47, 0.32],
    [0.5, 0.34],
    [0.47, 0.36],
    [0.47, 0.64],
    [0.5, 0.66],
    [0.47, 0.68],
    [0.47, 1.0],
    [0.44, 1.0],
    [0.43, 0.97],
    [0.0, 0.97],
];
const TANK: &[[f64; 2]] = &[
    [0.0, 0.0],
    [0.5, 0.0],
    [0.5, 0.42],
    [0.5, 0.84],
    [0.4, 0.93],
    [0.22, 0.98],
    [0.0, 1.0],
];
const VENT: &[[f64; 2]] = &[
    [0.28, 0.0],
    [0.28, 0.6],
    [0.5, 0.68],
    [0.4, 0.85],
    [0.0, 1.0],
];
const HYDRANT: &[[f64; 2]] = &[
    [0.5, 0.0],
    [0.5, 0.1],
    [0.32, 0.12],
    [0.32, 0.7],
    [0.42, 0.72],
    [0.3, 0.9],
    [0.0, 1.0],
];

/// Boxes given by their corners, cut alike.
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

/// A crate with a rim at its foot and its lid.
fn slatted_crate(grain: Grain, _: usize) -> Shape {
    let slab = |low: f64, high: f64, half: f64| [dvec3(-half, low, -half), dvec3(half, high, half)];
    boxes(
        grain,
        &[
            slab(0.0, 0.1, 0.5),
            slab(0.1, 0.9, 0.46),
            slab(0.9, 1.0, 0.5),
        ],
    )
}

/// Posts, and three shelves.
fn rack(grain: Grain, _: usize) -> Shape {
    let mut parts = Vec::new();
    for x in [-0.5, -0.01, 0.48] {
        for z in [-0.5, 0.42] {
            parts.push([dvec3(x, 0.0, z), dvec3(x + 0.02, 1.0, z + 0.08)]);
        }
    }
    for y in SHELVES {
        parts.push([dvec3(-0.48, y - 0.02, -0.46), dvec3(0.48, y, 0.46)]);
    }
    boxes(grain, &parts)
}

/// Height of a rack's shelves in that of the rack.
const SHELVES: [f64; 3] = [0.05, 0.38, 0.71];

/// A body with a control desk, a motor and a chimney-like filter.
fn machine(grain: Grain, _: usize) -> Shape {
    let mut shape = boxes(
        grain.share(0.3),
        &[
            [dvec3(-0.5, 0.0, -0.4), dvec3(0.5, 0.12, 0.4)],
            [dvec3(-0.45, 0.12, -0.35), dvec3(0.2, 0.7, 0.35)],
            [dvec3(0.26, 0.12, 0.05), dvec3(0.42, 0.45, 0.35)],
        ],
    );
    let motor = |p: DVec3| dvec3(0.2 + 0.3 * p.y, 0.3 - 0.26 * p.x, -0.18 + 0.26 * p.z);
    shape.merge(Shape::lathe(grain.share(0.3), BARREL, motor));
    let filter = |p: DVec3| dvec3(-0.2 + 0.24 * p.x, 0.7 + 0.3 * p.y, 0.36 * p.z);
    shape.merge(Shape::lathe(grain.share(0.4), VENT, filter));
    shape
}

/// A bonnet on the pipe and a hand wheel with two spokes.
fn valve(grain: Grain, _: usize) -> Shape {
    let stem = [
        [0.3, 0.0],
        [0.3, 0.25],
        [0.12, 0.3],
        [0.06, 0.34],
        [0.06, 0.95],
        [0.0, 0.95],
    ];
    let mut shape = Shape::lathe(grain.share(0.35), &stem, |p| p);
    let mut wheel = Shape::ring(grain.share(0.5), 0.42, 0.06, TAU);
    for p in &mut wheel.positions {
        *p = glam::vec3(p.x, p.z + 0.9, -p.y);
    }
    shape.merge(wheel);
    shape.merge(boxes(
        grain.share(0.15),
        &[
            [dvec3(-0.42, 0.88, -0.04), dvec3(0.42, 0.92, 0.04)],
            [dvec3(-0.04, 0.87, -0.42), dvec3(0.04, 0.93, 0.42)],
        ],
    ));
    shape
}

fn ladder(grain: Grain, _: usize) -> Shape {
    let mut parts = vec![
        [dvec3(-0.5, 0.0, -0.5), dvec3(-0.4, 1.0, 0.5)],
        [dvec3(0.4, 0.0, -0.5), dvec3(0.5, 1.0, 0.5)],
    ];
    parts.extend((0..12).map(|rung| {
        let y = (f64::from(rung) + 0.5) / 12.0;
        [dvec3(-0.4, y - 0.01, -0.3), dvec3(0.4, y + 0.01, 0.3)]
    }));
    boxes(grain, &parts)
}

/// A post with an arm toward +x and a head on it.
fn lamp(grain: Grain, _: usize) -> Shape {
    let post = [[0.05, 0.0], [0.03, 1.0], [0.0, 1.0]];
    let mut shape = Shape::lathe(grain.share(0.5), &post, |p| p);
    shape.merge(boxes(
        grain.share(0.5),
        &[
            [dvec3(0.0, 0.97, -0.02), dvec3(0.8, 0.985, 0.02)],
            [dvec3(0.6, 0.955, -0.08), dvec3(1.0, 0.97, 0.08)],
        ],
    ));
    shape
}

/// A block while it is built.
struct Block<'a> {
    sketch: &'a mut Sketch,
    kit: &'a Kit,
    middle: DVec3,
    rotation: DQuat,
    rng: Rng,
}

impl Block<'_> {
    fn build(&mut self) {
        self.group("grounds");
        self.grounds();
        self.group("hall");
        self.hall();
        self.group("racks");
        self.racks();
        self.group("machines");
        self.machines();
        self.group("pipes");
        self.pipe_runs();
        self.group("stores");
        self.stores();
        self.group("yard");
        self.yard();
        self.group("pipe bridge");
        self.pipe_bridge();
    }

    fn group(&mut self, name: &str) {
        self.sketch.group(name, self.middle, self.rotation);
    }

    fn put(&mut self, kind: usize, x: f64, y: f64, z: f64, size: DVec3) {
        self.sketch.put(kind, dvec3(x, y, z), size);
    }

    fn within(&mut self, from: f64, to: f64) -> f64 {
        f64::from(self.rng.within(from as f32..to as f32))
    }

    /// Street, lot, the wall round it with its gate, lamps and hydrants.
    fn grounds(&mut self) {
        let [length, depth] = PITCH.map(|pitch| pitch - STREET);
        let (kit, half) = (self.kit, [0.5 * length, 0.5 * depth]);
        self.put(kit.asphalt, 0.0, -0.5, 0.0, dvec3(PITCH[0], 0.5, PITCH[1]));
        self.put(
            kit.concrete,
            0.0,
            0.0,
            0.0,
            dvec3(length + 3.0, KERB, depth + 3.0),
        );
        let thick = 0.3;
        self.put(
            kit.brick,
            0.0,
            KERB,
            -half[1],
            dvec3(length, WALL_HEIGHT, thick),
        );
        for side in [-1.0, 1.0] {
            let size = dvec3(thick, WALL_HEIGHT, depth - thick);
            self.put(kit.brick, side * half[0], KERB, 0.0, size);
            // The front leaves the gate open, before that of the hall.
            let (from, to) = (side * half[0], HALL_X + side * 0.5 * GATE_WIDTH);
            let size = dvec3((from - to).abs(), WALL_HEIGHT, thick);
            self.put(kit.brick, 0.5 * (from + to), KERB, half[1], size);
            let post = dvec3(0.6, WALL_HEIGHT + 0.5, 0.6);
            self.put(kit.concrete, to, KERB, half[1], post);
        }
        for i in 0..4 {
            // Beside the gate, not in it.
            let x = -half[0] + (f64::from(i) + 0.5) * length / 4.0 + 4.0;
            let at = dvec3(x, KERB, half[1] + 1.1);
            let size = dvec3(2.4, 6.5, 2.4);
            self.sketch.part(kit.lamp, 0, at, turn_y(-FRAC_PI_2), size);
        }
        for x in [-half[0] + 5.0, half[0] - 6.0] {
            self.put(kit.hydrant, x, KERB, half[1] + 0.9, dvec3(0.4, 0.9, 0.4));
        }
    }

    /// Walls with an open gate, the gate slid aside, columns, girders, sawtooth roof, skylights, vents.
    fn hall(&mut self) {
        let kit = self.kit;
        let (half, wall) = (HALL, 0.35);
        let height = HALL.y;
        self.put(
            kit.sheet,
            HALL_X,
            KERB,
            -half.z,
            dvec3(2.0 * half.x, height, wall),
        );
        for side in [-1.0, 1.0] {
            let depth = dvec3(wall, height, 2.0 * half.z - wall);
            self.put(kit.sheet, HALL_X + side * half.x, KERB, 0.0, depth);
            let width = half.x - 0.5 * GATE_WIDTH;
            let x = HALL_X + side * (0.5 * GATE_WIDTH + 0.5 * width);
            self.put(kit.sheet, x, KERB, half.z, dvec3(width, height, wall));
        }
        let above = height - GATE_HEIGHT;
        let lintel = dvec3(GATE_WIDTH, above, wall);
        self.put(kit.sheet, HALL_X, KERB + GATE_HEIGHT, half.z, lintel);
        let leaf = dvec3(GATE_WIDTH, GATE_HEIGHT + 0.2, 0.12);
        self.put(
            kit.steel,
            HALL_X + GATE_WIDTH + 0.2,
            KERB,
            half.z + 0.3,
            leaf,
        );
        let bays = 5;
        let bay = 2.0 * half.x / f64::from(bays);
        for i in 0..bays {
            let x = HALL_X - half.x + (f64::from(i) + 0.5) * bay;
            let roof = dvec3(bay, 3.2, 2.0 * half.z + 0.6);
            self.put(kit.sawtooth, x, KERB + height, 0.0, roof);
            // On the steep side of the roof, which looks to +x.
            for z in [-7.0, 0.0, 7.0] {
                let pane = dvec3(0.1, 2.0, 5.5);
                self.put(
                    kit.glass,
                    x + 0.5 * bay + 0.02,
                    KERB + height + 0.8,
                    z,
                    pane,
                );
            }
            let (z, size) = (self.within(-9.0, 9.0), self.within(1.0, 1.7));
            let y = KERB + height + 1.0;
            self.put(kit.vent, x - 0.1 * bay, y, z, dvec3(size, 1.6 * size, size));
        }
        for i in 0..=bays {
            let x = (HALL_X - half.x + f64::from(i) * bay)
                .clamp(HALL_X - half.x + 0.4, HALL_X + half.x - 0.4);
            for z in [-half.z + 0.4, half.z - 0.4] {
                self.put(kit.steel, x, KERB, z, dvec3(0.35, height - 0.5, 0.35));
            }
            let girder = dvec3(0.3, 0.5, 2.0 * half.z - wall);
            self.put(kit.steel, x, KERB + height - 0.5, 0.0, girder);
        }
    }

    /// Rows of racks along the back, with crates and barrels on every shelf.
    fn racks(&mut self) {
        let kit = self.kit;
        for row in 0..2 {
            for i in 0..3 {
                let x = HALL_X - 13.5 + 13.5 * f64::from(i);
                let z = -11.0 + 4.6 * f64::from(row);
                let size = dvec3(11.0, self.within(4.2, 5.2), 1.5);
                self.put(kit.rack, x, KERB, z, size);
                for shelf in SHELVES {
                    let y = KERB + shelf * size.y;
                    for place in 0..9 {
                        let at = x + size.x * ((f64::from(place) + 0.5) / 9.0 - 0.5);
                        // Beside the posts in the middle.
                        let at = if place == 4 { at + 0.3 } else { at };
                        if self.rng.chance(0.1) {
                            continue;
                        }
                        self.goods(at, y, z, 0.9);
                    }
                }
            }
        }
    }

    /// A barrel or a crate no wider than `width`.
    fn goods(&mut self, x: f64, y: f64, z: f64, width: f64) {
        let kit = self.kit;
        if self.rng.chance(0.6) {
            self.barrel(x, y, z);
        } else {
            let turn = self.within(-0.1, 0.1);
            let edge = dvec3(
                width * self.within(0.6, 0.95),
                self.within(0.5, 1.0),
                width * self.within(0.6, 0.95),
            );
            let at = dvec3(x, y, z);
            self.sketch.part(kit.crate_, 0, at, turn_y(turn), edge);
        }
    }

    fn barrel(&mut self, x: f64, y: f64, z: f64) {
        let kind = self.kit.barrels[self.rng.below(3)];
        let (width, height) = (self.within(0.55, 0.62), self.within(0.85, 0.95));
        let turn = turn_y(self.within(0.0, TAU));
        self.sketch
            .part(kind, 0, dvec3(x, y, z), turn, dvec3(width, height, width));
    }

    /// A line of machines, each with a riser to the pipes under the roof.
    fn machines(&mut self) {
        let kit = self.kit;
        for i in 0..5 {
            let x = HALL_X - 17.0 + 8.5 * f64::from(i);
            let size = dvec3(
                self.within(3.2, 4.4),
                self.within(2.0, 2.8),
                self.within(2.0, 2.6),
            );
            self.put(kit.machine, x, KERB, 0.5, size);
            let (from, to) = (KERB + size.y, KERB + 7.0);
            let riser = dvec3(x - 0.2 * size.x, 0.5 * (from + to), 0.5);
            let upright = turn(DVec3::Z, FRAC_PI_2);
            let long = dvec3(to - from, 0.3, 0.3);
            self.sketch.part(kit.pipe, 0, riser, upright, long);
            let foot = dvec3(riser.x, from, 0.5);
            self.sketch
                .part(kit.flange, 0, foot, upright, dvec3(0.12, 0.5, 0.5));
            self.steel_guard(x, 0.5 + 0.5 * size.z + 0.5, size.x);
        }
    }

    /// A rail before a machine.
    fn steel_guard(&mut self, x: f64, z: f64, width: f64) {
        let kit = self.kit;
        self.put(kit.steel, x, KERB + 0.95, z, dvec3(width, 0.06, 0.06));
        for side in [-0.5, 0.5] {
            self.put(kit.steel, x + side * width, KERB, z, dvec3(0.06, 1.0, 0.06));
        }
    }

    /// A straight run of pipes along x, with flanges between and a valve here and there.
    fn run(&mut self, from: DVec3, length: f64, diameter: f64) {
        let kit = self.kit;
        let pieces = (length / 4.2).ceil();
        let piece = length / pieces;
        for i in 0..pieces as u32 {
            let start = from + DVec3::X * (f64::from(i) * piece);
            let size = dvec3(piece, diameter, diameter);
            self.put(kit.pipe, start.x + 0.5 * piece, start.y, start.z, size);
            let rim = 1.5 * diameter;
            self.put(kit.flange, start.x, start.y, start.z, dvec3(0.12, rim, rim));
            if self.rng.chance(0.25) {
                let size = dvec3(2.0, 2.2, 2.0) * diameter;
                self.put(kit.valve, start.x + 0.6 * piece, start.y, start.z, size);
            }
        }
        // The last piece bends down, into the wall's foot.
        let bend = dvec3(from.x + length, from.y - diameter, from.z);
        let rotation = DQuat::IDENTITY;
        let size = DVec3::splat(diameter);
        self.sketch.part(kit.elbow, 0, bend, rotation, size);
        let (top, bottom) = (bend.y, KERB);
        let down = dvec3(bend.x + diameter, 0.5 * (top + bottom), bend.z);
        let long = dvec3(top - bottom, 0.9 * diameter, 0.9 * diameter);
        self.sketch
            .part(kit.pipe, 0, down, turn(DVec3::Z, FRAC_PI_2), long);
    }

    /// Along the back wall, under the roof, and outside along the hall.
    fn pipe_runs(&mut self) {
        let start = HALL_X - HALL.x + 0.8;
        for (y, z, diameter) in [
            (6.2, -HALL.z + 0.9, 0.35),
            (7.0, -HALL.z + 1.5, 0.25),
            (7.0, 0.5, 0.4),
            (7.8, HALL.z - 1.4, 0.3),
            (1.2, -HALL.z - 1.2, 0.5),
            (1.9, -HALL.z - 1.8, 0.3),
        ] {
            let length = 2.0 * HALL.x - 2.5 - self.within(0.0, 3.0);
            self.run(dvec3(start, y, z), length, diameter);
        }
    }

    /// Barrels and crates in stacks on the hall's floor, in its front part, beside the way in.
    fn stores(&mut self) {
        for side in [-1.0, 1.0] {
            for stack in 0..2 {
                let x = HALL_X + side * (7.0 + 7.0 * f64::from(stack));
                let (columns, rows) = (5, 3);
                for column in 0..columns {
                    for row in 0..rows {
                        let at = [0.75 * f64::from(column), 0.75 * f64::from(row)];
                        let levels = 1 + self.rng.below(2);
                        for level in 0..levels {
                            let y = KERB + 0.96 * level as f64;
                            self.barrel(x + side * at[0], y, 7.5 + at[1]);
                        }
                    }
                }
            }
        }
    }

    /// Tanks with ladders and pipes, barrels and crates in the yard.
    fn yard(&mut self) {
        let kit = self.kit;
        for i in 0..3 {
            let (x, z) = (17.0 + 1.2 * f64::from(i % 2), -16.0 + 9.5 * f64::from(i));
            let (width, height) = (self.within(5.5, 7.5), self.within(7.0, 11.0));
            self.put(kit.tank, x, KERB, z, dvec3(width, height, width));
            let ladder = dvec3(0.6, 0.84 * height, 0.12);
            self.put(kit.ladder, x, KERB, z + 0.5 * width + 0.15, ladder);
            let length = 34.0 - (x + 0.5 * width) - 3.0;
            let from = dvec3(x + 0.5 * width - 0.1, KERB + 1.4, z);
            self.run(from, length, 0.35);
        }
        for column in 0..7 {
            for row in 0..4 {
                let x = 14.0 + 0.8 * f64::from(column) + self.within(-0.05, 0.05);
                let z = 15.5 + 0.8 * f64::from(row) + self.within(-0.05, 0.05);
                self.barrel(x, KERB, z);
                if self.rng.chance(0.3) {
                    self.barrel(x, KERB + 0.96, z);
                }
            }
        }
        for _ in 0..10 {
            let (x, z) = (self.within(24.0, 33.0), self.within(14.0, 21.0));
            self.goods(x, KERB, z, 1.4);
        }
    }

    /// Three pipes on two portals over the street behind the block.
    fn pipe_bridge(&mut self) {
        let kit = self.kit;
        let (x, edge) = (26.0, -0.5 * PITCH[1]);
        let from = edge - 0.5 * STREET - 1.0;
        let length = STREET + 2.0;
        for z in [from + 0.7, from + length - 0.7] {
            for side in [-1.3, 1.3] {
                self.put(kit.steel, x + side, KERB, z, dvec3(0.3, 5.6, 0.3));
            }
            self.put(kit.steel, x, KERB + 5.6, z, dvec3(3.2, 0.3, 0.3));
        }
        for (i, diameter) in [0.5, 0.35, 0.6].into_iter().enumerate() {
            let at = x - 0.9 + 0.9 * i as f64;
            let y = KERB + 5.9 + 0.5 * diameter;
            for piece in 0..3 {
                let z = from + length * (f64::from(piece) + 0.5) / 3.0;
                let size = dvec3(length / 3.0, diameter, diameter);
                self.sketch
                    .part(kit.pipe, 0, dvec3(at, y, z), turn_y(FRAC_PI_2), size);
                let joint = dvec3(at, y, from + length * f64::from(piece) / 3.0);
                let rim = dvec3(0.12, 1.5 * diameter, 1.5 * diameter);
                self.sketch
                    .part(kit.flange, 0, joint, turn_y(FRAC_PI_2), rim);
            }
        }
    }
}
