//! Damaged and hostile files: refused, or harmless; never a panic.

mod support;

use hroc_format::*;
use proptest::prelude::*;
use support::{file, open, scene, seal, walk};

#[test]
fn every_flipped_bit_is_found_by_verify() {
    let mut bytes = file(&scene(12));
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
    let mut bytes = file(&scene(12));
    for bit in HEADER_LEN * 8..bytes.len() * 8 {
        bytes[bit / 8] ^= 1 << (bit % 8);
        if let Ok(baked) = open(&bytes, Check::Objects) {
            walk(baked.scene());
        }
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}

#[test]
fn every_truncation_is_refused() {
    let bytes = file(&scene(12));
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
