//! The fuzz targets of `tests/fuzz` on mutations of their corpus, from a fixed seed: what can be had without a
//! nightly compiler. `HROC_FUZZ_SECONDS` runs each target for so long; otherwise it is a fixed number of inputs.

#[path = "../../tests/fuzz/targets.rs"]
mod targets;

use hroc_preprocess::generate::Rng;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Inputs per target without a time: a few seconds.
const INPUTS: usize = 100_000;
/// Mutated inputs stay below this: growth finds nothing that size does not.
const MAX_BYTES: usize = 1 << 14;
/// An input that takes longer hangs; the slowest legal one takes a fraction, unoptimized.
const TIME_LIMIT: Duration = Duration::from_secs(10);

fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fuzz/corpus");
    let entries = std::fs::read_dir(folder.join(target)).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let corpus = paths.iter().map(|path| std::fs::read(path).unwrap());
    corpus.collect()
}

fn run(name: &str, target: fn(&[u8])) {
    let corpus = corpus(name);
    assert!(!corpus.is_empty());
    let one = |input: &[u8]| {
        let start = Instant::now();
        let result = std::panic::catch_unwind(|| target(input));
        let hang = start.elapsed() > TIME_LIMIT;
        if result.is_err() || hang {
            let path = std::env::temp_dir().join(format!("hroc-{name}.fuzz"));
            std::fs::write(&path, input).unwrap();
            panic!(
                "{name}: fails or hangs on {}; put it into tests/fuzz/corpus",
                path.display()
            );
        }
    };
    corpus.iter().for_each(|seed| one(seed));
    let seconds = std::env::var("HROC_FUZZ_SECONDS").ok();
    let seconds = seconds.map(|text| text.parse().expect("HROC_FUZZ_SECONDS is a number"));
    let end = seconds.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds));
    let mut rng = Rng::new(20_21);
    let mut inputs = 0;
    while end.map_or(inputs < INPUTS, |end| Instant::now() < end) {
        let mut input = corpus[rng.below(corpus.len())].clone();
        for _ in 0..1 + rng.below(4) {
            mutate(&mut input, &corpus, &mut rng);
        }
        one(&input);
        inputs += 1;
    }
    eprintln!("{name}: {inputs} mutated inputs");
}

/// Changes an input in one of the ways that parsers stumble over.
fn mutate(input: &mut Vec<u8>, corpus: &[Vec<u8>], rng: &mut Rng) {
    const NUMBERS: &[&str] = &[
        "0",
        "-1",
        "1",
        "2",
        "3",
        "255",
        "256",
        "65535",
        "4294967295",
        "4294967296",
        "18446744073709551615",
        "1e39",
        "-1e308",
        "1e-45",
        "nan",
        "5126",
        "null",
        "[]",
        "\"\"",
    ];
    const WORDS: &[u32] = &[
        0,
        1,
        3,
        0x7F,
        0xFFFF,
        0x7F80_0000,
        0x7FC0_0000,
        0x7FFF_FFFF,
        0x8000_0000,
        u32::MAX,
    ];
    if input.is_empty() {
        input.push(0);
    }
    let at = rng.below(input.len());
    match rng.below(8) {
        0 => input[at] ^= 1 << rng.below(8),
        1 => input[at] = rng.below(256) as u8,
        2 => {
            let word = WORDS[rng.below(WORDS.len())].to_le_bytes();
            let at = at & !3;
            let end = input.len().min(at + 4);
            input[at..end].copy_from_slice(&word[..end - at]);
        }
        3 => input.truncate(at),
        4 => drop(input.drain(at..(at + 1 + rng.below(16)).min(input.len()))),
        // A run of this or another input, here or over what is here.
        5 => {
            let other = &corpus[rng.below(corpus.len())];
            let from = rng.below(other.len());
            let run = &other[from..(from + 1 + rng.below(64)).min(other.len())];
            let end = if rng.below(2) == 0 {
                at
            } else {
                (at + run.len()).min(input.len())
            };
            input.splice(at..end, run.iter().copied());
        }
        // Another number in the place of the next one in the text.
        _ => {
            let is_number = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
            let start = input[at..].iter().position(u8::is_ascii_digit);
            let Some(start) = start.map(|start| at + start) else {
                return;
            };
            let length = input[start..].iter().position(|byte| !is_number(byte));
            let end = length.map_or(input.len(), |length| start + length);
            let number = NUMBERS[rng.below(NUMBERS.len())];
            input.splice(start..end, number.bytes());
        }
    }
    input.truncate(MAX_BYTES);
}

#[test]
fn any_scene_file_is_refused_or_baked() {
    run("import", targets::import);
}

#[test]
fn any_baked_file_is_refused_or_safe_to_follow() {
    run("open", targets::open);
}
