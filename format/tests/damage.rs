//! Damaged and hostile files: refused, or harmless; never a panic.

mod support;

use hroc_format::*;
use proptest::prelude::*;
use support::{file, file_with, open, scene, seal, sections, walk};

#[test]
fn every_flipped_bit_is_found_by_verify() {
    let mut bytes = file_with(&scene(12), &sections());
    open(&bytes, Check::Everything).unwrap();
    for bit in 0..bytes.len() * 8 {
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(open(&bytes, Check::Everything).is_err(), "bit {bit} passed");
        if bit < HEADER_LEN * 8 {
            assert!(
                open(&bytes, Check::Ranges).is_err(),
                "bit {bit} of the header passed"
            );
        }
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}

/// Below the checksum's depth a flip may pass; then it has hit a value, not what is followed.
#[test]
fn every_flipped_bit_leaves_a_checked_scene_safe() {
    let mut bytes = file_with(&scene(12), &sections());
    for bit in HEADER_LEN * 8..bytes.len() * 8 {
        bytes[bit / 8] ^= 1 << (bit % 8);
        if let Ok(baked) = open(&bytes, Check::Objects) {
            walk(baked.scene());
            for entry in baked.sections() {
                let _ = baked.section(entry.name);
            }
        }
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}

#[test]
fn every_truncation_is_refused() {
    let bytes = file_with(&scene(12), &sections());
    for len in 0..bytes.len() {
        let error = open(&bytes[..len], Check::Ranges).expect_err("cut short");
        match len {
            0 => assert!(matches!(error, OpenError::NotHroc { .. })),
            _ => assert!(
                matches!(error, OpenError::Length { .. }),
                "{len} bytes: {error:?}"
            ),
        }
    }
}

/// The same with a header that fits what is left: nothing but the archive itself can tell.
#[test]
fn every_truncation_of_the_payload_is_refused() {
    let bytes = file(&scene(12));
    for len in HEADER_LEN..bytes.len() {
        assert!(
            open(&seal(&bytes[HEADER_LEN..len]), Check::Everything).is_err(),
            "{len} bytes passed"
        );
    }
}

/// A hundred thousand times: a few bits flipped and, every fourth time, the end cut off; as it is, and under a
/// header that fits it, which leaves the rules alone to tell.
#[test]
fn random_damage_is_refused_or_harmless() {
    let whole = file(&scene(50));
    let mut state = 1_u64;
    let mut random = |below: usize| {
        // Steele, Lea, Flood: SplitMix64.
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ z >> 31) % below as u64) as usize
    };
    let mut harmless = 0;
    for round in 0..100_000 {
        let mut bytes = whole.clone();
        if round % 4 == 3 {
            bytes.truncate(random(bytes.len()));
        }
        for _ in 0..1 + random(3) {
            if !bytes.is_empty() {
                let at = random(bytes.len());
                bytes[at] ^= 1 << random(8);
            }
        }
        // Two flips of one bit are none.
        if bytes != whole {
            let error = open(&bytes, Check::Everything).expect_err("damage passed the checksum");
            assert_eq!(error.to_string().lines().count(), 1);
        }
        if let Some(payload) = bytes.get(HEADER_LEN..)
            && let Ok(baked) = open(&seal(payload), Check::Objects)
        {
            walk(baked.scene());
            harmless += 1;
        }
    }
    assert!(
        harmless > 1000,
        "only {harmless} reached what is behind the rules"
    );
}

proptest! {
    #[test]
    fn garbage_is_refused(garbage in prop::collection::vec(any::<u8>(), 0..4096)) {
        prop_assert!(open(&garbage, Check::Ranges).is_err());
        prop_assert!(open(&seal(&garbage), Check::Ranges).is_err());
    }

    /// A forger knows how to compute checksums.
    #[test]
    fn forged_numbers_are_refused_or_harmless(
        forgeries in prop::collection::vec((any::<prop::sample::Index>(), any::<u32>(), 0..4_u32), 1..6),
    ) {
        let mut payload = file(&scene(9))[HEADER_LEN..].to_vec();
        for (place, value, kind) in forgeries {
            let place = place.index(payload.len() / 4) * 4;
            let old = u32::from_le_bytes(payload[place..place + 4].try_into().unwrap());
            let new = match kind {
                0 => value,
                1 => value % 64,
                2 => old.wrapping_add(value % 8).wrapping_sub(4),
                _ => u32::MAX - value % 2,
            };
            payload[place..place + 4].copy_from_slice(&new.to_le_bytes());
        }
        if let Ok(baked) = open(&seal(&payload), Check::Objects) {
            walk(baked.scene());
        }
        if let Ok(baked) = open(&seal(&payload), Check::Everything) {
            for mesh in baked.scene().meshes.iter() {
                let vertices = &baked.scene().positions()[mesh.vertex_range()];
                for &index in &baked.scene().indices()[mesh.index_range()] {
                    prop_assert!(vertices[index as usize].iter().all(|v| v.is_finite()));
                }
            }
        }
    }
}
