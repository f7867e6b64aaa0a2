//! Boxes of many kinds, from fixed seeds.

use hroc_format::Bounds;
use hroc_preprocess::generate::Rng;

fn at(centre: [f32; 3], half: [f32; 3]) -> Bounds {
    Bounds {
        min: std::array::from_fn(|axis| centre[axis] - half[axis]),
        max: std::array::from_fn(|axis| centre[axis] + half[axis]),
    }
}

fn point(rng: &mut Rng, radius: f32) -> [f32; 3] {
    std::array::from_fn(|_| rng.within(-radius..radius))
}

/// Boxes of similar size, anywhere.
pub fn uniform(count: usize, seed: u64) -> Vec<Bounds> {
    let mut rng = Rng::new(seed);
    let edge = |rng: &mut Rng| std::array::from_fn(|_| rng.within(0.1..2.0));
    (0..count)
        .map(|_| at(point(&mut rng, 100.0), edge(&mut rng)))
        .collect()
}

/// Small boxes round a few centres, far from each other.
pub fn clustered(count: usize, seed: u64) -> Vec<Bounds> {
    let mut rng = Rng::new(seed);
    let centres: Vec<_> = (0..20).map(|_| point(&mut rng, 1000.0)).collect();
    let near = |rng: &mut Rng| {
        let (centre, offset) = (centres[rng.below(centres.len())], point(rng, 10.0));
        at(
            std::array::from_fn(|axis| centre[axis] + offset[axis]),
            [rng.within(0.01..0.5); 3],
        )
    };
    (0..count).map(|_| near(&mut rng)).collect()
}

/// Sizes over four orders of magnitude.
pub fn of_all_sizes(count: usize, seed: u64) -> Vec<Bounds> {
    let mut rng = Rng::new(seed);
    let size = |rng: &mut Rng| [10_f32.powf(rng.within(-3.0..1.5)); 3];
    (0..count)
        .map(|_| at(point(&mut rng, 100.0), size(&mut rng)))
        .collect()
}

/// A regular grid of touching cubes: every centroid coordinate is shared by many.
pub fn grid(edge_count: usize) -> Vec<Bounds> {
    let cell = |i: usize| {
        [
            i % edge_count,
            i / edge_count % edge_count,
            i / edge_count.pow(2),
        ]
    };
    (0..edge_count.pow(3))
        .map(|i| at(cell(i).map(|c| c as f32), [0.5; 3]))
        .collect()
}

/// Long thin boxes along the axes, on a plane: streets, pipes.
pub fn sticks(count: usize, seed: u64) -> Vec<Bounds> {
    let mut rng = Rng::new(seed);
    let stick = |rng: &mut Rng| {
        let mut half = [0.1; 3];
        half[rng.below(3)] = rng.within(1.0..20.0);
        let [x, y, z] = point(rng, 100.0);
        at([x, y * 0.1, z], half)
    };
    (0..count).map(|_| stick(&mut rng)).collect()
}

/// Every kind, with the degenerate ones, by name.
#[allow(dead_code, reason = "each test program uses its share of this module")]
pub fn all_kinds() -> Vec<(String, Vec<Bounds>)> {
    let count = 1000;
    let numbers = || (0..count).map(|i| i as f32);
    let power = |i: usize| 2_f32.powi(i as i32 - 120);
    let mut kinds = vec![
        ("uniform".to_owned(), uniform(count, 1)),
        ("clustered".to_owned(), clustered(count, 2)),
        ("of all sizes".to_owned(), of_all_sizes(count, 3)),
        ("grid".to_owned(), grid(10)),
        ("sticks".to_owned(), sticks(count, 4)),
        ("identical".to_owned(), vec![at([5.0; 3], [1.0; 3]); count]),
        (
            "identical points".to_owned(),
            vec![at([5.0; 3], [0.0; 3]); count],
        ),
        ("zero".to_owned(), vec![at([0.0; 3], [0.0; 3]); count]),
        (
            "collinear".to_owned(),
            numbers().map(|x| at([x, 0.0, 0.0], [0.4; 3])).collect(),
        ),
        (
            "diagonal".to_owned(),
            numbers().map(|x| at([x; 3], [0.4; 3])).collect(),
        ),
        (
            "nested".to_owned(),
            numbers().map(|x| at([0.0; 3], [x + 1.0; 3])).collect(),
        ),
        ("flat".to_owned(), {
            let mut rng = Rng::new(5);
            (0..count)
                .map(|_| at([rng.unit(), 0.0, rng.unit()], [0.01, 0.0, 0.01]))
                .collect()
        }),
        ("powers of two".to_owned(), {
            (0..240)
                .map(|i| Bounds {
                    min: [0.0; 3],
                    max: [power(i); 3],
                })
                .collect()
        }),
        ("powers of two apart".to_owned(), {
            (0..240)
                .map(|i| Bounds {
                    min: [power(i); 3],
                    max: [power(i); 3],
                })
                .collect()
        }),
        ("huge beside tiny".to_owned(), {
            let size = |i: usize| if i.is_multiple_of(2) { 1e38 } else { 1e-38 };
            (0..count)
                .map(|i| at([size(i) * ((i % 7) as f32 / 7.0); 3], [size(i); 3]))
                .collect()
        }),
        ("the whole of f32".to_owned(), {
            let end = |i: usize| if i.is_multiple_of(3) { f32::MAX } else { 1.0 };
            (0..count)
                .map(|i| Bounds {
                    min: [-end(i); 3],
                    max: [end(i + 1); 3],
                })
                .collect()
        }),
        ("subnormal".to_owned(), {
            let step = |i: usize| f32::from_bits(i as u32);
            (0..count)
                .map(|i| Bounds {
                    min: [step(i); 3],
                    max: [step(i + 2); 3],
                })
                .collect()
        }),
        ("signed zeros".to_owned(), {
            let zero = |i: usize| if i.is_multiple_of(2) { 0.0 } else { -0.0 };
            (0..count)
                .map(|i| Bounds {
                    min: [zero(i); 3],
                    max: [zero(i / 2); 3],
                })
                .collect()
        }),
    ];
    for count in 1..=10 {
        kinds.push((format!("{count} boxes"), uniform(count, count as u64)));
        kinds.push((
            format!("{count} identical boxes"),
            vec![at([1.0; 3], [1.0; 3]); count],
        ));
    }
    kinds
}
