//! What opening costs, by depth: `cargo bench -p hroc-format`. A million triangles in 1000 meshes, 120 000
//! objects, three trees.

#[path = "../tests/support/mod.rs"]
mod support;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use hroc_format::*;

fn open(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("large.hroc");
    let bytes = write(&path, &large_scene()).expect("room for the file");

    let mut group = criterion.benchmark_group("open");
    for (name, depth) in [
        ("ranges", Check::Ranges),
        ("objects", Check::Objects),
        ("everything", Check::Everything),
    ] {
        if depth == Check::Everything {
            group.throughput(Throughput::Bytes(bytes));
        }
        group.bench_function(name, |bencher| {
            bencher.iter(|| BakedScene::open_with(&path, depth))
        });
    }
}

fn write_file(criterion: &mut Criterion) {
    let scene = large_scene();
    let mut group = criterion.benchmark_group("write");
    group.sample_size(10).throughput(Throughput::Bytes(
        to_bytes(&scene).expect("memory").len() as u64
    ));
    group.bench_function("to_bytes", |bencher| bencher.iter(|| to_bytes(&scene)));
    let folder = tempfile::tempdir().expect("a temporary folder");
    group.bench_function("file", |bencher| {
        bencher.iter(|| write(&folder.path().join("out.hroc"), &scene))
    });
}

/// The sample scene with more objects, and its meshes replaced by larger ones.
fn large_scene() -> Scene {
    const VERTICES: u32 = 3000;
    const TRIANGLES: u32 = 6000;
    let mut scene = support::scene(120_000);
    scene.bvhs.push(Bvh {
        split: "third".into(),
        ..scene.bvhs[0].clone()
    });
    (scene.meshes, scene.positions, scene.indices) = Default::default();
    (scene.normals, scene.uvs) = Default::default();
    for mesh in 0..1000 {
        scene.meshes.push(Mesh {
            min: [0.0; 3],
            max: [1.0; 3],
            first_index: mesh * TRIANGLES * 3,
            index_count: TRIANGLES * 3,
            first_vertex: mesh * VERTICES,
            vertex_count: VERTICES,
            reserved: [0; 2],
        });
        let coordinate = |v: u32| (v.wrapping_mul(0x9E37_79B9) >> 8) as f32 / (1 << 24) as f32;
        scene
            .positions
            .extend((0..VERTICES).map(|v| [coordinate(v), coordinate(v + 1), coordinate(v + 2)]));
        scene
            .indices
            .extend((0..TRIANGLES * 3).map(|i| i.wrapping_mul(0x9E37_79B9) % VERTICES));
    }
    scene
}

criterion_group!(benches, open, write_file);
criterion_main!(benches);
