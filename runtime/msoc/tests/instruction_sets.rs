//! One result, whatever the instruction set and the number of threads.

use hroc_msoc::{Isa, IsaName, Mode, Msoc, Options, generate};

const NEAR: f32 = 0.5;

/// Every pixel's depth and every query's answer.
fn everything(
    options: Options,
    size: [u32; 2],
    seed: u64,
    count: usize,
) -> (Vec<u32>, Vec<hroc_msoc::Visibility>) {
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
    (
        depth,
        rects.iter().map(|rect| msoc.query_rect(rect)).collect(),
    )
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
