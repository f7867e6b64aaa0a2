//! Seeded triangles and queries, for replays, tests and benchmarks. Equal seeds give equal output.

use crate::footprint::Rect;

/// Clip-space triangles.
pub type ClipTriangles = Vec<[[f32; 4]; 3]>;

/// Right isosceles triangles as in Fig. 11 of the paper: `legs_px` long, at random places and angles wholly in an
/// image of `size`, back to front at view depths from 110 to 10.
pub fn right_triangles(seed: u64, count: usize, legs_px: f32, size: [u32; 2]) -> ClipTriangles {
    let mut random = fastrand::Rng::with_seed(seed);
    let size = size.map(|side| side as f32);
    let triangle = |index: usize| {
        let w = 110.0 - 100.0 * index as f32 / count as f32;
        let (sin, cos) = (random.f32() * std::f32::consts::TAU).sin_cos();
        let mut place = |side: f32| legs_px + random.f32() * (side - 2.0 * legs_px).max(0.0);
        let centre = [place(size[0]), place(size[1])];
        let third = legs_px / 3.0;
        [
            [-third, -third],
            [2.0 * third, -third],
            [-third, 2.0 * third],
        ]
        .map(|[x, y]| {
            let (px, py) = (centre[0] + cos * x - sin * y, centre[1] + sin * x + cos * y);
            [
                (2.0 * px / size[0] - 1.0) * w,
                (2.0 * py / size[1] - 1.0) * w,
                0.0,
                w,
            ]
        })
    };
    (0..count).map(triangle).collect()
}

/// Triangles of every kind that a rasterizer may get wrong: of all sizes, thin, with vertices on pixel centres
/// and borders, with horizontal and vertical edges, across the image's border, across the near plane at `near`, and in
/// both orientations.
pub fn triangles(seed: u64, count: usize, size: [u32; 2], near: f32) -> ClipTriangles {
    let mut random = fastrand::Rng::with_seed(seed);
    (0..count)
        .map(|_| triangle(&mut random, size, near))
        .collect()
}

fn triangle(random: &mut fastrand::Rng, size: [u32; 2], near: f32) -> [[f32; 4]; 3] {
    let size = size.map(|side| side as f32);
    let reach = match random.u8(0..8) {
        0 => 4.0 * size[0],
        1..4 => size[0],
        4..6 => 32.0,
        _ => 6.0,
    };
    let centre = size.map(|side| (random.f32() * 1.2 - 0.1) * side);
    let snap = match random.u8(0..6) {
        0 => 1.0,
        1 => 2.0,
        2 => 256.0,
        _ => 0.0,
    };
    let depth = near * (random.f32() * 6.0).exp2();
    let tilt = if random.bool() {
        0.0
    } else {
        random.f32() * 2.0
    };
    let crosses = random.u8(0..12) == 0;
    let mut points = [0; 3].map(|_| {
        let mut place = |axis: usize| {
            let at = centre[axis] + (random.f32() - 0.5) * reach;
            if snap == 0.0 {
                at
            } else {
                (at * snap).round() / snap
            }
        };
        let (x, y) = (place(0), place(1));
        let mut w = depth * (1.0 + tilt * random.f32());
        if crosses && random.bool() {
            w = near * (random.f32() * 2.0 - 1.0);
        }
        [x, y, w]
    });
    match random.u8(0..8) {
        0 => points[1][1] = points[0][1],
        1 => points[1][0] = points[0][0],
        // Thin: the third vertex near the line through the others.
        2 => {
            let (t, off) = (random.f32(), random.f32() * random.f32());
            let ([x0, y0, _], [x1, y1, _]) = (points[0], points[1]);
            points[2][0] = x0 + t * (x1 - x0) + off;
            points[2][1] = y0 + t * (y1 - y0) + off;
        }
        _ => {}
    }
    points.map(|[x, y, w]| {
        // Behind the eye, x and y are anywhere.
        let scale = if w > 0.0 { w } else { near };
        [
            (2.0 * x / size[0] - 1.0) * scale,
            (1.0 - 2.0 * y / size[1]) * scale,
            random.f32(),
            w,
        ]
    })
}

/// Rectangles of all sizes at depths around those of [`triangles`].
pub fn rects(seed: u64, count: usize, size: [u32; 2], near: f32) -> Vec<Rect> {
    let mut random = fastrand::Rng::with_seed(seed);
    let rect = |_| {
        let extent = if random.bool() { 8.0 } else { 64.0 };
        let min: [f32; 2] = std::array::from_fn(|_| random.f32() * 2.1 - 1.05);
        let max =
            std::array::from_fn(|axis| min[axis] + 2.0 * random.f32() * extent / size[axis] as f32);
        Rect {
            min,
            max,
            nearest_w: near * (random.f32() * 8.0).exp2(),
        }
    };
    (0..count).map(rect).collect()
}
