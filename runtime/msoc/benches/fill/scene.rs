//! Table 1 of the paper on a generated town: boxes on a grid seen from the street, each an occluder and an object.

use std::fmt::Write;

use hroc_msoc::hiz::SoftwareHiZ;
use hroc_msoc::{Aabb, IDENTITY, Isa, Matrix4, Mode, Msoc, Occluder, OccluderMesh, Visibility};

use crate::{MODES, SIZE, least, options};

/// Houses along one side of the town.
const SIDE: usize = 64;
/// Triangles of a house are those of a box, each face cut into this many squares a side.
const CUTS: usize = 4;

/// A house: its triangles in world space, and its bounds.
pub struct House {
    pub bounds: Aabb,
    pub positions: Vec<[f32; 3]>,
    pub indices: Vec<[u32; 3]>,
}

impl House {
    fn new(bounds: Aabb) -> Self {
        let (mut positions, mut indices) = (Vec::new(), Vec::new());
        for face in 0..6 {
            let (axis, far) = (face / 2, face % 2 == 1);
            let first = positions.len() as u32;
            for (i, j) in (0..=CUTS).flat_map(|j| (0..=CUTS).map(move |i| (i, j))) {
                let (u, v) = (i as f32 / CUTS as f32, j as f32 / CUTS as f32);
                let mut at = [0.0; 3];
                at[axis] = if far { 1.0 } else { 0.0 };
                at[(axis + 1) % 3] = if far { u } else { 1.0 - u };
                at[(axis + 2) % 3] = v;
                let at = std::array::from_fn(|k| {
                    bounds.min[k] + at[k] * (bounds.max[k] - bounds.min[k])
                });
                positions.push(at);
            }
            let row = CUTS as u32 + 1;
            for corner in
                (0..CUTS as u32).flat_map(|j| (0..CUTS as u32).map(move |i| first + j * row + i))
            {
                indices.push([corner, corner + 1, corner + row + 1]);
                indices.push([corner, corner + row + 1, corner + row]);
            }
        }
        Self {
            bounds,
            positions,
            indices,
        }
    }

    pub fn occluder(&self) -> Occluder<'_> {
        let mesh = OccluderMesh {
            positions: &self.positions,
            indices: &self.indices,
        };
        Occluder {
            mesh,
            world_from_object: IDENTITY,
        }
    }
}

/// The houses, nearest first.
pub fn town(seed: u64) -> Vec<House> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut houses = Vec::new();
    for (i, j) in (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| (i, j))) {
        let at = [
            (i as f32 - SIDE as f32 / 2.0) * 8.0 + 1.5,
            -(j as f32) * 8.0 - 6.0,
        ];
        let size = [
            3.0 + 3.0 * random.f32(),
            2.0 + 10.0 * random.f32() * random.f32(),
            3.0 + 3.0 * random.f32(),
        ];
        houses.push(House::new(Aabb {
            min: [at[0], 0.0, at[1] - size[2]],
            max: [at[0] + size[0], size[1], at[1]],
        }));
    }
    houses
}

/// Views from eye height, turned left and right; 60 degrees, reversed infinite, near 0.1.
pub fn camera(turn: f32, x: f32) -> Matrix4 {
    let (sin, cos) = turn.sin_cos();
    let (focal, aspect) = (
        1.0 / 30_f32.to_radians().tan(),
        SIZE[0] as f32 / SIZE[1] as f32,
    );
    let eye = [x, 1.7, 0.0];
    let rows = [
        [focal / aspect * cos, 0.0, focal / aspect * sin],
        [0.0, focal, 0.0],
        [0.0, 0.0, 0.0],
        [sin, 0.0, -cos],
    ];
    let moved = rows.map(|row| -(row[0] * eye[0] + row[1] * eye[1] + row[2] * eye[2]));
    std::array::from_fn(|column| {
        std::array::from_fn(|row| match (column, row) {
            (3, 2) => 0.1,
            (3, row) => moved[row],
            (column, row) => rows[row][column],
        })
    })
}

pub fn table(report: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let houses = town(3);
    let occluders = houses.iter().map(House::occluder).collect::<Vec<_>>();
    let triangles = houses
        .iter()
        .map(|house| house.indices.len())
        .sum::<usize>();
    let view = camera(0.2, 0.0);
    let isa = Isa::best();
    let _ = writeln!(
        report,
        "\n## Table 1: one frame of a town\n\n{} houses of {triangles} triangles in all, every one an occluder and an object; microseconds, {}.\n\
         Rasterization includes transform, projection and clipping.\n\n\
         | | clear | rasterize | reduce | test | total | objects visible |\n|---|---|---|---|---|---|---|",
        houses.len(),
        isa.name().name(),
    );
    let mut row = |name: &str, times: [f64; 4], visible: usize| {
        let cells = times
            .map(|seconds| format!("{:.0}", seconds * 1e6))
            .join(" | ");
        let _ = writeln!(
            report,
            "| {name} | {cells} | {:.0} | {visible} |",
            times.iter().sum::<f64>() * 1e6
        );
    };
    let culled = |mode| hroc_msoc::Options {
        cull_back_faces: true,
        near: 0.1,
        ..options(isa, mode)
    };
    let mut hiz = SoftwareHiZ::new(SIZE, &culled(Mode::Paper))?;
    let clear = least(15, || hiz.clear());
    let rasterize = least(15, || {
        hiz.rasterize(&view, &occluders).expect("indices in range")
    });
    let reduce = least(15, || hiz.reduce());
    let mut visible = 0;
    let test = least(15, || {
        visible = houses
            .iter()
            .filter(|house| hiz.query_box(&view, &house.bounds) == Visibility::Visible)
            .count();
    });
    row(
        "full-resolution Hi-Z",
        [clear, rasterize, reduce, test],
        visible,
    );
    for (name, mode) in MODES {
        let mut msoc = Msoc::new(SIZE, culled(mode))?;
        let clear = least(15, || msoc.clear());
        // Into a cleared buffer each round, whose time is known.
        let both = least(15, || {
            msoc.clear();
            msoc.rasterize(&view, &occluders).expect("indices in range");
        });
        let test = least(15, || {
            visible = houses
                .iter()
                .filter(|house| msoc.query_box(&view, &house.bounds) == Visibility::Visible)
                .count();
        });
        row(
            &format!("masked, {name}"),
            [clear, both - clear, 0.0, test],
            visible,
        );
    }
    Ok(())
}
