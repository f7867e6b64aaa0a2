//! Import against reading the same triangles with plain `gltf` and `tobj`; opening against reading.

use crate::{Contender, measure};
use hroc_format::{BakedScene, Check};
use hroc_preprocess::import::{ImportOptions, import};
use hroc_preprocess::progress::Silent;
use std::hint::black_box;
use std::path::{Path, PathBuf};

const ROUNDS: usize = 7;

/// hroc, on all threads and on one, checks every index, composes transforms and makes objects; the peers read positions
/// and indices of each primitive.
pub fn import_table(files: &[String]) {
    println!("| file | reader | median ms | least ms |\n|---|---|---|---|");
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    for file in files {
        let path = PathBuf::from(file);
        let options = ImportOptions {
            normals: false,
            ..Default::default()
        };
        let ours = || {
            let scene = import(&[path.clone()], &options, &Silent).expect("a good file");
            black_box(scene);
        };
        let is_obj = file.ends_with(".obj");
        let mut contenders = vec![
            Contender {
                name: "hroc".into(),
                run: Box::new(ours),
            },
            Contender {
                name: "hroc, one thread".into(),
                run: Box::new(|| one.install(ours)),
            },
            Contender {
                name: if is_obj { "tobj" } else { "gltf" }.into(),
                run: Box::new(|| match is_obj {
                    true => plain_obj(&path),
                    false => plain_gltf(&path),
                }),
            },
        ];
        let times = measure(&mut contenders, ROUNDS);
        for (contender, [median, least]) in contenders.iter().zip(times) {
            let file = path.file_name().unwrap_or_default().display();
            println!("| {file} | {} | {median:.1} | {least:.1} |", contender.name);
        }
    }
}

fn plain_obj(path: &Path) {
    let options = tobj::LoadOptions {
        single_index: true,
        triangulate: true,
        ..Default::default()
    };
    let (models, _) = tobj::load_obj(path, &options).expect("a good file");
    black_box(models);
}

fn plain_gltf(path: &Path) {
    let bytes = std::fs::read(path).expect("a good file");
    let gltf = gltf::Gltf::from_slice(&bytes).expect("a good file");
    let blob = gltf.blob.as_deref();
    for mesh in gltf.meshes() {
        for primitive in mesh.primitives() {
            let reader = primitive.reader(|_| blob);
            let positions: Option<Vec<[f32; 3]>> = reader.read_positions().map(Iterator::collect);
            let indices: Option<Vec<u32>> = reader.read_indices().map(|i| i.into_u32().collect());
            black_box((positions, indices));
        }
    }
}

/// Opening at three depths against reading the file into memory.
pub fn open_table(files: &[String]) {
    println!("| file | MB | what | median ms | GB/s |\n|---|---|---|---|---|");
    for file in files {
        let path = PathBuf::from(file);
        let megabytes = std::fs::metadata(&path).expect("a file").len() as f64 / 1e6;
        let open = |name: &str, check: Check| {
            let path = path.clone();
            Contender {
                name: name.into(),
                run: Box::new(move || {
                    black_box(BakedScene::open_with(&path, check).expect("a baked file"));
                }),
            }
        };
        let mut contenders = vec![
            open("open", Check::Ranges),
            open("open_checked", Check::Objects),
            open("verify", Check::Everything),
            Contender {
                name: "std::fs::read".into(),
                run: Box::new(|| {
                    black_box(std::fs::read(&path).expect("a file"));
                }),
            },
        ];
        let times = measure(&mut contenders, 15);
        for (contender, [median, _]) in contenders.iter().zip(times) {
            println!(
                "| {} | {megabytes:.1} | {} | {median:.3} | {:.1} |",
                path.file_name().unwrap_or_default().display(),
                contender.name,
                megabytes / median
            );
        }
    }
}
