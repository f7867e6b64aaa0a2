//! Smooth noise from a seed.

use glam::DVec3;

use super::Rng;

/// Value noise: a random value in -1..1 at every point of the integer lattice, blended between them with
/// continuous first derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    seed: u64,
}

impl Noise {
    /// Equal seeds give equal noise.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    fn lattice(&self, x: i64, y: i64, z: i64) -> f64 {
        // Each coordinate times a large odd number of its own; the generator mixes the rest.
        let key = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
            ^ (z as u64).wrapping_mul(0x1656_67B1_9E37_79F9);
        let unit = (Rng::new(self.seed ^ key).bits() >> 11) as f64 / (1_u64 << 53) as f64;
        2.0 * unit - 1.0
    }

    /// The noise at a point, in -1..=1.
    pub fn at(&self, p: DVec3) -> f64 {
        let cell = p.floor();
        let f = p - cell;
        let s = f * f * (3.0 - 2.0 * f);
        let [x, y, z] = cell.to_array().map(|c| c as i64);
        let along_x = |y: i64, z: i64| {
            let (a, b) = (self.lattice(x, y, z), self.lattice(x + 1, y, z));
            a + (b - a) * s.x
        };
        let along_y = |z: i64| {
            let (a, b) = (along_x(y, z), along_x(y + 1, z));
            a + (b - a) * s.y
        };
        let (a, b) = (along_y(z), along_y(z + 1));
        a + (b - a) * s.z
    }

    /// Octaves of doubling frequency and halving strength; in -2..2.
    pub fn octaves(&self, p: DVec3, count: u32) -> f64 {
        let octave = |i: u32| {
            let frequency = f64::from(1_u32 << i);
            // Off the lattice of the octave before, where its value is known to be extreme.
            self.at(p * frequency + 0.37 * f64::from(i)) / frequency
        };
        (0..count).map(octave).sum()
    }

    /// A vector of three independent noises, each in -1..=1.
    pub fn vector(&self, p: DVec3) -> DVec3 {
        DVec3::new(
            self.at(p),
            self.at(p + DVec3::new(31.4, 0.0, 0.0)),
            self.at(p + DVec3::new(0.0, 57.3, 0.0)),
        )
    }
}
