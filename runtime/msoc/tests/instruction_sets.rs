//! One result, whatever the instruction set and the number of threads.

use hroc_msoc::{Depth, Isa, IsaName, Mode, Msoc, Options, Rect, Visibility, generate};

const NEAR: f32 = 0.5;

/// Answers of rectangles, which must not depend on whether one or many are asked about.
fn ask(msoc: &Msoc, rects: &[Rect]) -> Vec<Visibility> {
    let mut together = vec![Visibility::Outside; 3];
    msoc.query_rects(rects, &mut together);
    for (rect, answer) in rects.iter().zip(&together) {
        let alone = msoc.query_rect(rect);
        assert_eq!(
            *answer,
            alone,
            "{rect:?} {:?} {:?}",
            msoc.isa(),
            msoc.mode()
        );
    }
    assert_eq!(together.len(), rects.len());
    together
}

/// Every pixel's depth and every query's answer.
fn everything(
    options: Options,
    size: [u32; 2],
    seed: u64,
    count: usize,
) -> (Vec<u32>, Vec<Visibility>) {
    let mut msoc = Msoc::new(size, options).unwrap();
    let mut triangles = generate::triangles(seed, count, size, NEAR);
    // What no occluder should hold: it must be ignored, and alike.
    triangles.extend([
        [[f32::NAN; 4]; 3],
        [[f32::INFINITY, 0.0, 0.0, 1.0]; 3],
        [[0.0; 4]; 3],
    ]);
    triangles.extend(generate::triangles(seed + 1, count, size, NEAR));
    msoc.rasterize_clip(&triangles);
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
    let depth = pixels.map(|pixel| msoc.depth(pixel).to_bits()).collect();
    let rects = generate::rects(seed, 200, size, NEAR);
    (depth, ask(&msoc, &rects))
}

#[test]
fn instruction_sets_agree_bit_for_bit() {
    for mode in [Mode::Paper, Mode::INNER] {
        for (seed, size) in [(1, [300, 130]), (2, [33, 17]), (3, [1, 1]), (4, [640, 5])] {
            for seed in (0..40).map(|i| seed + 100 * i) {
                let with = |isa| {
                    let options = Options {
                        mode,
                        near: NEAR,
                        isa: Some(isa),
                        ..Options::default()
                    };
                    everything(options, size, seed, 1 + (seed as usize * 7) % 90)
                };
                let portable = with(Isa::new(IsaName::Portable).unwrap());
                for isa in Isa::available() {
                    assert!(
                        with(isa) == portable,
                        "{isa:?} {mode:?} {size:?} seed {seed}"
                    );
                }
            }
        }
    }
}

#[test]
fn any_bits_are_taken() {
    // Floats of every kind, NaN and infinity among them: no panic, and the same result everywhere.
    let mut random = fastrand::Rng::with_seed(9);
    for depth in [Depth::InverseW, Depth::Reversed, Depth::Standard] {
        for mode in [Mode::Paper, Mode::INNER] {
            for _ in 0..50 {
                let mut any = || match random.u8(0..4) {
                    0 => f32::from_bits(random.u32(..)),
                    1 => f32::from_bits(random.u32(..)) % 100.0,
                    _ => random.f32() * 4.0 - 1.0,
                };
                let triangles: Vec<_> = (0..100)
                    .map(|_| [0; 3].map(|_| [0; 4].map(|_| any())))
                    .collect();
                let boxes: Vec<_> = (0..20)
                    .map(|_| [0; 8].map(|_| [0; 4].map(|_| any())))
                    .collect();
                let rects: Vec<_> = (0..20)
                    .map(|_| Rect {
                        min: [any(), any()],
                        max: [any(), any()],
                        nearest_w: any(),
                    })
                    .collect();
                let with = |isa| {
                    let options = Options {
                        depth,
                        mode,
                        near: NEAR,
                        isa: Some(isa),
                        ..Options::default()
                    };
                    let mut msoc = Msoc::new([70, 40], options).unwrap();
                    msoc.rasterize_clip(&triangles);
                    let pixels = (0..40).flat_map(|y| (0..70).map(move |x| [x, y]));
                    let depth: Vec<_> = pixels.map(|pixel| msoc.depth(pixel).to_bits()).collect();
                    let boxes: Vec<_> = boxes
                        .iter()
                        .map(|corners| msoc.query_box_clip(corners))
                        .collect();
                    (depth, boxes, ask(&msoc, &rects))
                };
                let portable = with(Isa::new(IsaName::Portable).unwrap());
                for isa in Isa::available() {
                    assert!(
                        with(isa) == portable,
                        "{isa:?} {depth:?} {mode:?} {triangles:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn threads_agree_bit_for_bit() {
    for isa in Isa::available() {
        let with = |parallel| {
            let options = Options {
                parallel,
                near: NEAR,
                isa: Some(isa),
                ..Options::default()
            };
            everything(options, [1000, 500], 5, 5000)
        };
        let alone = with(false);
        for threads in [2, 3, 7] {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            assert!(
                pool.install(|| with(true)) == alone,
                "{isa:?}, {threads} threads"
            );
        }
    }
}
