//! Replay files: they read back, and bad ones are refused with the place.

use hroc_msoc::replay::{Queries, Replay, ReplayError, RunError, RunOptions, run};
use hroc_msoc::{IsaName, Mode};

fn bytes(replay: &Replay) -> Vec<u8> {
    let mut bytes = Vec::new();
    replay.write(&mut bytes).unwrap();
    bytes
}

fn options(mode: Mode) -> RunOptions {
    RunOptions {
        mode,
        isa: None,
        threads: 1,
        repeat: 2,
        check: true,
    }
}

#[test]
fn files_read_back() {
    for (triangles, queries) in [(0, 0), (1, 1), (100, 77)] {
        let replay = Replay::random(3, [64, 48], triangles, queries);
        for replay in [replay.clone(), replay.with_boxes()] {
            assert_eq!(Replay::from_bytes(&bytes(&replay)).unwrap(), replay);
        }
    }
}

#[test]
fn the_layout_is_the_one_promised() {
    let replay = Replay::random(1, [64, 48], 2, 3);
    let bytes = bytes(&replay);
    let word =
        |index: usize| u32::from_le_bytes(bytes[4 * index..4 * index + 4].try_into().unwrap());
    assert_eq!(
        [word(0), word(1), word(2), word(4)],
        [0x3143_4F4D, 64, 48, 2]
    );
    assert_eq!(
        [word(3), word(5)],
        [0.5_f32.to_bits(), replay.triangles[0][0][0].to_bits()]
    );
    assert_eq!([word(5 + 24), word(6 + 24)], [0, 3]);
    assert_eq!(bytes.len(), 4 * (7 + 24 + 15));
}

#[test]
fn every_truncation_and_what_follows_is_refused() {
    for replay in [
        Replay::random(1, [64, 48], 2, 3),
        Replay::random(1, [64, 48], 2, 3).with_boxes(),
    ] {
        let mut bytes = bytes(&replay);
        for length in 0..bytes.len() {
            let (at, problem) = Replay::from_bytes(&bytes[..length]).unwrap_err();
            assert!(at <= length && !problem.is_empty());
        }
        bytes.push(0);
        let (at, _) = Replay::from_bytes(&bytes).unwrap_err();
        assert_eq!(at, bytes.len() - 1);
    }
}

#[test]
fn sizes_and_counts_that_a_file_claims_are_not_trusted() {
    let good = bytes(&Replay::random(1, [64, 48], 2, 3));
    let (kind, count) = (4 * (5 + 24), 4 * (6 + 24));
    for (at, value, reported) in [
        (0, 7, 0),
        (4, 0, 4),
        (4, u32::MAX, 4),
        (8, 20_000, 4),
        (12, (-1.0_f32).to_bits(), 12),
        (12, f32::NAN.to_bits(), 12),
        (16, u32::MAX, 20),
        (kind, 2, kind),
        (kind, 1, count + 4),
        (count, u32::MAX, count + 4),
    ] {
        let mut bad = good.clone();
        bad[at..at + 4].copy_from_slice(&u32::to_le_bytes(value));
        let (found, problem) = Replay::from_bytes(&bad).unwrap_err();
        assert_eq!(found, reported, "{problem}");
    }
}

#[test]
fn errors_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.moc");
    assert!(matches!(Replay::open(&path), Err(ReplayError::Read { .. })));
    std::fs::write(&path, b"glTF").unwrap();
    let message = Replay::open(&path).unwrap_err().to_string();
    assert!(message.contains("frame.moc: byte 0"), "{message}");
}

#[test]
fn playing_gives_bits_times_and_a_comparison() {
    let replay = Replay::random(5, [200, 100], 60, 203);
    for replay in [replay.clone(), replay.with_boxes()] {
        for mode in [Mode::Paper, Mode::INNER] {
            let report = run(&replay, &options(mode)).unwrap();
            let bytes = (0..report.visible_bits.len() / 2)
                .map(|i| u8::from_str_radix(&report.visible_bits[2 * i..2 * i + 2], 16).unwrap())
                .collect::<Vec<_>>();
            assert_eq!(bytes.len(), 203_usize.div_ceil(8));
            let set = bytes
                .iter()
                .map(|byte| byte.count_ones() as usize)
                .sum::<usize>();
            assert_eq!((set, report.queries), (report.visible, 203));
            let check = report.check.unwrap();
            assert!(check.reference_occluded > 20 && check.leaks < check.reference_occluded);
            assert!(!report.failed() && report.raster_ms_all.len() == 2);
            // More threads and other instructions answer the same.
            for isa in [None, Some(IsaName::Portable)] {
                let other = RunOptions {
                    isa,
                    threads: 3,
                    ..options(mode)
                };
                assert_eq!(
                    run(&replay, &other).unwrap().visible_bits,
                    report.visible_bits
                );
            }
        }
    }
}

#[test]
fn no_queries_and_images_too_large_to_check() {
    let report = run(&Replay::random(1, [8, 8], 1, 0), &options(Mode::Paper)).unwrap();
    assert_eq!((report.query_ns, report.visible_bits.as_str()), (None, ""));
    let huge = Replay {
        size: [16384, 16384],
        near: 0.1,
        triangles: Vec::new(),
        queries: Queries::Rects(Vec::new()),
    };
    assert!(matches!(
        run(&huge, &options(Mode::Paper)),
        Err(RunError::TooLargeToCheck(_))
    ));
}
