//! Writes a replay file of random triangles and queries, for `hroc msoc`:
//! `cargo run -p hroc-msoc --example random_replay -- FILE [SEED] [TRIANGLES] [QUERIES] [rects|boxes]`.

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;

use hroc_msoc::replay::Replay;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = std::env::args().skip(1).collect::<Vec<_>>();
    let file = arguments.first().ok_or("name the file to write")?;
    let number = |index: usize, default: u64| match arguments.get(index) {
        Some(text) => text.parse::<u64>(),
        None => Ok(default),
    };
    let (seed, triangles, queries) = (number(1, 1)?, number(2, 10_000)?, number(3, 10_000)?);
    let mut replay = Replay::random(seed, [1920, 1080], triangles as usize, queries as usize);
    match arguments.get(4).map_or("rects", String::as_str) {
        "rects" => {}
        "boxes" => replay = replay.with_boxes(),
        other => {
            return Err(
                format!("there are no queries named {other}; there are rects and boxes").into(),
            );
        }
    }
    replay.write(BufWriter::new(File::create(file)?))?;
    Ok(())
}
