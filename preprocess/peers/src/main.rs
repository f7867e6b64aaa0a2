//! Tables of hroc beside its peers, measured in turns in one run, so that a busy machine is busy for all alike.
//!
//! `hroc-peers trees [MAX_OBJECTS]`, `hroc-peers import FILE..`, `hroc-peers open FILE.hroc`

mod files;
mod trees;

use std::time::Instant;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let rest = arguments.get(1..).unwrap_or_default();
    match arguments.first().map(String::as_str) {
        Some("trees") => {
            let max = rest.first().and_then(|text| text.parse().ok());
            trees::table(max.unwrap_or(1_000_000));
        }
        Some("import") => files::import_table(rest),
        Some("open") => files::open_table(rest),
        _ => {
            eprintln!("usage: hroc-peers trees [MAX_OBJECTS] | import FILE.. | open FILE.hroc..");
            std::process::exit(2);
        }
    }
}

/// One thing to measure.
struct Contender<'a> {
    name: String,
    run: Box<dyn FnMut() + 'a>,
}

/// The median and the smallest time of each in milliseconds; all take turns, after one turn that does not count.
fn measure(contenders: &mut [Contender<'_>], rounds: usize) -> Vec<[f64; 2]> {
    let mut times = vec![Vec::with_capacity(rounds); contenders.len()];
    for round in 0..=rounds {
        for (contender, times) in contenders.iter_mut().zip(&mut times) {
            let start = Instant::now();
            (contender.run)();
            if round > 0 {
                times.push(start.elapsed().as_secs_f64() * 1e3);
            }
        }
    }
    let both = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        [times[times.len() / 2], times[0]]
    };
    times.into_iter().map(both).collect()
}
