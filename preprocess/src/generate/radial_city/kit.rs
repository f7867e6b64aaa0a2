//! The meshes the city is put together from.

use glam::{DAffine3, DQuat, DVec3, Vec3, vec3};

use crate::generate::trig::turn;
use crate::generate::{Material, Model, Shape};

/// Segments of the arches of window frames, from coarse to fine: seven triangles for each.
const ARC_SEGMENTS: [usize; 11] = [1, 3, 5, 8, 12, 18, 27, 40, 60, 90, 130];

/// Indices of meshes and materials.
pub struct Kit {
    /// Bodies of houses, one per colour.
    pub walls: Vec<usize>,
    /// Roofs on a unit box.
    pub roofs: Vec<usize>,
    pub flat_roof: usize,
    pub spire: usize,
    pub door: usize,
    pub ledge: usize,
    pub chimney: usize,
    pub balcony: usize,
    pub lamp: usize,
    pub tree: usize,
    pub plinth: usize,
    pub obelisk: usize,
    pub ground: usize,
    /// Every kind of window, simple ones first; from the wall (z = 0) outward in a unit box.
    pub windows: Vec<usize>,
    /// Material of the blocks.
    pub pavement: usize,
}

impl Kit {
    /// Adds materials and meshes to an empty model. Round things get `detail` times their sides.
    pub fn new(model: &mut Model, detail: f64) -> Self {
        let mut material = |name, base_color| {
            model.materials.push(Material { name, base_color });
            model.materials.len() - 1
        };
        let plaster = [
            material("ochre plaster", [0.63, 0.42, 0.20]),
            material("red brick", [0.42, 0.14, 0.09]),
            material("grey plaster", [0.45, 0.44, 0.42]),
            material("white plaster", [0.74, 0.71, 0.66]),
        ];
        let tiles = material("roof tiles", [0.30, 0.08, 0.05]);
        let stone = material("stone", [0.52, 0.49, 0.43]);
        let glass = material("glass", [0.10, 0.16, 0.22]);
        let wood = material("wood", [0.17, 0.09, 0.04]);
        let iron = material("iron", [0.05, 0.05, 0.06]);
        let leaves = material("leaves", [0.07, 0.20, 0.04]);
        let asphalt = material("asphalt", [0.09, 0.09, 0.10]);
        let pavement = material("pavement", [0.33, 0.31, 0.29]);

        let sides = |count: f64| (count * detail).round().clamp(3.0, 128.0) as usize;
        let mut windows = vec![
            model.add_mesh("pane", glass, Shape::pane()),
            model.add_mesh("shutter", wood, shutter()),
            model.add_mesh("bay window", glass, bay_window()),
        ];
        for arc in ARC_SEGMENTS {
            windows.push(model.add_mesh(format!("window {arc}"), glass, Shape::framed_pane(arc)));
        }
        let walls = plaster
            .iter()
            .map(|&m| model.add_mesh("body", m, Shape::cuboid()))
            .collect();
        let roofs = vec![
            model.add_mesh("gabled roof", tiles, Shape::gable()),
            model.add_mesh("hipped roof", tiles, Shape::pyramid()),
        ];
        Self {
            walls,
            roofs,
            flat_roof: model.add_mesh("flat roof", stone, Shape::closed_cuboid()),
            spire: model.add_mesh("spire", iron, Shape::cone(sides(6.0))),
            door: model.add_mesh("door", wood, shutter()),
            ledge: model.add_mesh("ledge", stone, Shape::closed_cuboid()),
            chimney: model.add_mesh("chimney", stone, Shape::cuboid()),
            balcony: model.add_mesh("balcony", iron, balcony()),
            lamp: model.add_mesh("lamp", iron, lamp(sides(5.0))),
            tree: model.add_mesh("tree", leaves, tree(sides(6.0))),
            plinth: model.add_mesh("plinth", stone, Shape::prism(sides(12.0))),
            obelisk: model.add_mesh("obelisk", stone, obelisk()),
            ground: model.add_mesh("ground", asphalt, Shape::prism(64)),
            windows,
            pavement,
        }
    }
}

fn place(scale: Vec3, translation: Vec3) -> DAffine3 {
    DAffine3::from_scale_rotation_translation(scale.into(), DQuat::IDENTITY, translation.into())
}

/// A box on a wall: the cuboid's open underside becomes its back.
fn shutter() -> Shape {
    let to_wall = turn(DVec3::X, std::f64::consts::FRAC_PI_2);
    let transform = DAffine3::from_rotation_translation(to_wall, DVec3::Y * 0.5);
    Shape::default().with(&Shape::cuboid(), transform)
}

/// A box with a sill.
fn bay_window() -> Shape {
    Shape::default()
        .with(&shutter(), place(vec3(0.9, 0.9, 0.6), vec3(0.0, 0.1, 0.0)))
        .with(&shutter(), place(vec3(1.0, 0.1, 1.0), Vec3::ZERO))
}

/// A slab on a wall (z from 0 to 1) with a rail on three sides.
fn balcony() -> Shape {
    let rail = |scale: Vec3, at: Vec3| (Shape::cuboid(), place(scale, at));
    let parts = [
        (shutter(), place(vec3(1.0, 0.15, 1.0), Vec3::ZERO)),
        rail(vec3(1.0, 0.85, 0.08), vec3(0.0, 0.15, 0.95)),
        rail(vec3(0.04, 0.85, 0.9), vec3(-0.47, 0.15, 0.45)),
        rail(vec3(0.04, 0.85, 0.9), vec3(0.47, 0.15, 0.45)),
    ];
    parts
        .iter()
        .fold(Shape::default(), |shape, (part, at)| shape.with(part, *at))
}

fn lamp(sides: usize) -> Shape {
    Shape::default()
        .with(
            &Shape::prism(sides),
            place(vec3(0.25, 0.9, 0.25), Vec3::ZERO),
        )
        .with(
            &Shape::prism(sides),
            place(vec3(1.0, 0.1, 1.0), vec3(0.0, 0.9, 0.0)),
        )
}

fn tree(sides: usize) -> Shape {
    Shape::default()
        .with(&Shape::prism(3), place(vec3(0.12, 0.35, 0.12), Vec3::ZERO))
        .with(
            &Shape::cone(sides),
            place(vec3(1.0, 0.5, 1.0), vec3(0.0, 0.25, 0.0)),
        )
        .with(
            &Shape::cone(sides),
            place(vec3(0.7, 0.45, 0.7), vec3(0.0, 0.55, 0.0)),
        )
}

fn obelisk() -> Shape {
    Shape::default()
        .with(&Shape::cuboid(), place(vec3(1.0, 0.9, 1.0), Vec3::ZERO))
        .with(
            &Shape::pyramid(),
            place(vec3(1.0, 0.1, 1.0), vec3(0.0, 0.9, 0.0)),
        )
}
