//! f32 arithmetic that rounds as the attacker likes.

use glam::DVec3;

/// The spacing of f32 at 1: no operation errs by more, relative to its result.
pub const U: f64 = 1.0 / (1 << 23) as f64;

/// Rounds each operation to either neighbour in f32, by one bit of the attacker's each. Values are f64 that f32
/// can hold, so products are exact before rounding.
#[derive(Clone, Debug)]
pub struct Dice<'a> {
    bits: &'a [u64],
    at: usize,
}

impl<'a> Dice<'a> {
    /// Dice that fall as `bits` say, over and over.
    pub fn new(bits: &'a [u64]) -> Self {
        Self { bits, at: 0 }
    }

    /// Other dice: as another compiler rounds the same expressions.
    pub fn others(&self) -> Self {
        let at = 64 * (self.bits.len() / 2);
        Self { at, ..self.clone() }
    }

    fn bit(&mut self) -> bool {
        let word = self.bits[(self.at >> 6) % self.bits.len()];
        let bit = word >> (self.at & 63) & 1;
        self.at += 1;
        bit == 1
    }

    /// An f32 next to `x`.
    pub fn round(&mut self, x: f64) -> f64 {
        let up = self.bit();
        let nearest = x as f32;
        let there = f64::from(nearest);
        f64::from(match (there == x, there < x, up) {
            (false, true, true) => nearest.next_up(),
            (false, false, false) => nearest.next_down(),
            _ => nearest,
        })
    }

    /// `a + b`.
    pub fn add(&mut self, a: f64, b: f64) -> f64 {
        self.round(a + b)
    }

    /// `a * b`.
    pub fn mul(&mut self, a: f64, b: f64) -> f64 {
        self.round(a * b)
    }

    /// `a / b`, which may err by 2.5 ulp.
    pub fn div(&mut self, a: f64, b: f64) -> f64 {
        let quotient = a / b;
        let error = if self.bit() { 1.5 } else { -1.5 };
        self.round(quotient * (1.0 + error * U))
    }

    /// `a * b + c`, not fused.
    pub fn mul_add(&mut self, a: f64, b: f64, c: f64) -> f64 {
        let product = self.mul(a, b);
        self.add(product, c)
    }

    /// Products first, then sums from the left.
    pub fn dot(&mut self, a: DVec3, b: DVec3) -> f64 {
        let x = self.mul(a.x, b.x);
        let y = self.mul(a.y, b.y);
        let z = self.mul(a.z, b.z);
        let xy = self.add(x, y);
        self.add(xy, z)
    }
}
