use hroc_msoc::*;
fn now() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
}
fn tris(n: usize, size: f32, rng: &mut fastrand::Rng) -> Vec<[[f32; 4]; 3]> {
    (0..n)
        .map(|i| {
            let w = 10.0 + 100.0 * (n - i) as f32 / n as f32; // back to front
            let a = rng.f32() * std::f32::consts::TAU;
            let (s, c) = a.sin_cos();
            let (px, py) = (
                rng.f32() * (1920.0 - 2.0 * size) + size,
                rng.f32() * (1080.0 - 2.0 * size) + size,
            );
            [[0.0, 0.0], [size, 0.0], [0.0, size]].map(|[x, y]| {
                let (x, y) = (x - size / 3., y - size / 3.);
                let (x, y) = (px + c * x - s * y, py + s * x + c * y);
                [(x / 960.0 - 1.0) * w, (y / 540.0 - 1.0) * w, 0.0, w]
            })
        })
        .collect()
}
fn main() {
    for mode in [Mode::Paper, Mode::INNER] {
        for isa in Isa::available() {
            print!("{:?} {:9}", matches!(mode, Mode::Paper), isa.name().name());
            for size in [10.0_f32, 25.0, 50.0, 100.0, 200.0] {
                let mut rng = fastrand::Rng::with_seed(1);
                let t = tris(32768, size, &mut rng);
                let mut m = Msoc::new(
                    [1920, 1080],
                    Options {
                        isa: Some(isa),
                        near: 1.0,
                        mode,
                        ..Default::default()
                    },
                )
                .unwrap();
                let mut v: Vec<f64> = (0..21)
                    .map(|_| {
                        m.clear();
                        let s = now();
                        m.rasterize_clip(&t);
                        (now() - s)
                    })
                    .collect();
                v.sort_by(f64::total_cmp);
                print!("  {size}: {:6.2}", 0.032768 / v[10]);
            }
            let mut m = Msoc::new(
                [1920, 1080],
                Options {
                    isa: Some(isa),
                    near: 1.0,
                    mode,
                    ..Default::default()
                },
            )
            .unwrap();
            let mut rng = fastrand::Rng::with_seed(1);
            m.rasterize_clip(&tris(32768, 50.0, &mut rng));
            let rects: Vec<Rect> = (0..10000)
                .map(|_| {
                    let (x, y) = (rng.f32() * 1.9 - 1.0, rng.f32() * 1.9 - 1.0);
                    let s = rng.f32() * 0.1;
                    Rect {
                        min: [x, y],
                        max: [x + s, y + s],
                        nearest_w: 5.0 + rng.f32() * 100.0,
                    }
                })
                .collect();
            let mut v: Vec<(f64, usize)> = (0..21)
                .map(|_| {
                    let s = now();
                    let n = rects
                        .iter()
                        .filter(|r| m.query_rect(r) == Visibility::Visible)
                        .count();
                    ((now() - s) / 10000.0 * 1e9, n)
                })
                .collect();
            v.sort_by(|a, b| a.0.total_cmp(&b.0));
            println!("  query {:.1} ns ({} visible)", v[10].0, v[10].1);
        }
    }
}
