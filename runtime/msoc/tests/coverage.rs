//! The closed form of `inner` coverage, by brute force; and `paper` against centre sampling.

use hroc_msoc::hiz::SoftwareHiZ;
use hroc_msoc::reference::Reference;
use hroc_msoc::{Mode, Msoc, Options, Visibility, generate};

const SIZE: [u32; 2] = [16, 16];

/// Twice the area of a triangle in 1/64 px, exactly.
fn cross(a: [i64; 2], b: [i64; 2], p: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}

/// Whether each of the 4^3 displacements of the vertices to the corners of a square covers `p`. The area
/// of a triangle with `p` is linear in each coordinate, so corners are the extremes.
fn always_covered(triangle: [[i64; 2]; 3], p: [i64; 2], step: i64) -> bool {
    (0..64).all(|corners: usize| {
        let moved: [[i64; 2]; 3] = std::array::from_fn(|vertex| {
            std::array::from_fn(|axis| {
                triangle[vertex][axis]
                    + if corners >> (2 * vertex + axis) & 1 == 0 {
                        step
                    } else {
                        -step
                    }
            })
        });
        let signs = [0, 1, 2].map(|i| cross(moved[i], moved[(i + 1) % 3], p));
        signs.iter().all(|&s| s > 0) || signs.iter().all(|&s| s < 0)
    })
}

#[test]
fn the_reference_covers_what_every_displacement_covers() {
    let mut random = fastrand::Rng::with_seed(4);
    let options = Options {
        mode: Mode::Inner {
            subpixel_bits: 2,
            depth_tolerance: 0.0,
        },
        near: 0.5,
        ..Options::default()
    };
    let mut reference = Reference::new(SIZE, &options).unwrap();
    let mut msoc = Msoc::new(SIZE, options).unwrap();
    let (mut covered, mut found) = (0, 0);
    for _ in 0..4000 {
        // In 1/64 px; 16 of them are a step.
        let triangle = [0; 3].map(|_| [0; 2].map(|_| random.i64(-200..1200)));
        let clip =
            triangle.map(|[x, y]| [x as f32 / 512.0 - 1.0, 1.0 - y as f32 / 512.0, 0.0, 1.0]);
        reference.clear();
        msoc.clear();
        reference.rasterize_clip(&[clip]);
        msoc.rasterize_clip(&[clip]);
        for (x, y) in (0..16).flat_map(|y| (0..16).map(move |x| (x, y))) {
            let always = always_covered(triangle, [64 * x + 32, 64 * y + 32], 16);
            let pixel = [x as u32, y as u32];
            assert_eq!(
                reference.depth(pixel) > 0.0,
                always,
                "{triangle:?} {pixel:?}"
            );
            assert!(always || msoc.depth(pixel) == 0.0, "{triangle:?} {pixel:?}");
            covered += usize::from(always);
            found += usize::from(msoc.depth(pixel) > 0.0);
        }
    }
    // Only whole subtiles and working layers count as covered, and with one triangle that is all of it.
    assert!(
        covered > 10_000 && found * 100 > covered * 97,
        "{found} of {covered}"
    );
}

#[test]
fn paper_differs_from_centre_sampling_only_at_edges() {
    let size = [300, 200];
    let options = Options {
        near: 0.5,
        ..Options::default()
    };
    let (mut pixels, mut wrong) = (0, 0);
    for seed in 0..300 {
        let mut msoc = Msoc::new(size, options).unwrap();
        let mut reference = Reference::new(size, &options).unwrap();
        let triangles = generate::triangles(seed, 1, size, 0.5);
        msoc.rasterize_clip(&triangles);
        reference.rasterize_clip(&triangles);
        for pixel in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y])) {
            let (ours, truth) = (msoc.depth(pixel) > 0.0, reference.depth(pixel) > 0.0);
            pixels += usize::from(truth);
            wrong += usize::from(ours != truth);
        }
    }
    assert!(
        pixels > 100_000 && wrong * 1000 < pixels,
        "{wrong} of {pixels}"
    );
}

#[test]
fn neighbours_leave_no_gap() {
    // A fan about a point: each pixel inside belongs to some triangle.
    let mut random = fastrand::Rng::with_seed(8);
    let mut msoc = Msoc::new([256, 128], Options::default()).unwrap();
    for _ in 0..200 {
        msoc.clear();
        let centre = [random.f32() - 0.5, random.f32() - 0.5, 0.0, 1.0];
        let rim = (0..12).map(|i| (i as f32 * std::f32::consts::TAU / 12.0).sin_cos());
        let rim = rim
            .map(|(sin, cos)| [1.5 * cos, 1.5 * sin, 0.0, 1.0])
            .collect::<Vec<_>>();
        let fan = (0..12)
            .map(|i| [centre, rim[i], rim[(i + 1) % 12]])
            .collect::<Vec<_>>();
        msoc.rasterize_clip(&fan);
        for pixel in (0..128).flat_map(|y| (0..256).map(move |x| [x, y])) {
            assert!(msoc.depth(pixel) > 0.0, "{pixel:?}");
        }
    }
}

#[test]
fn the_software_hi_z_agrees_with_the_reference() {
    let size = [203, 101];
    let options = Options {
        mode: Mode::INNER,
        near: 0.5,
        ..Options::default()
    };
    let mut hiz = SoftwareHiZ::new(size, &options).unwrap();
    let mut reference = Reference::new(size, &options).unwrap();
    let (mut hidden, mut truly) = (0, 0);
    for seed in 0..60 {
        hiz.clear();
        reference.clear();
        let triangles = generate::triangles(seed, 60, size, 0.5);
        hiz.rasterize_clip(&triangles);
        reference.rasterize_clip(&triangles);
        hiz.reduce();
        for pixel in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y])) {
            assert!(
                f64::from(hiz.depth(pixel)) <= reference.depth(pixel),
                "seed {seed} {pixel:?}"
            );
        }
        for rect in generate::rects(seed, 100, size, 0.5) {
            let answers = [hiz.query_rect(&rect), reference.query_rect(&rect)];
            assert_ne!(answers, [Visibility::Occluded, Visibility::Visible]);
            hidden += usize::from(answers[0] == Visibility::Occluded);
            truly += usize::from(answers[1] == Visibility::Occluded);
        }
    }
    assert!(
        hidden > 500 && hidden * 10 > truly * 7,
        "{hidden} of {truly}"
    );
}
