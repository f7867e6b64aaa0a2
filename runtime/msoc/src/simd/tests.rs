//! Every instruction set against the portable one, operation by operation.

use super::*;

/// All operations on two vectors, as bits per lane of the first eight lanes.
struct Everything<'a>(&'a [u32; 16], &'a [u32; 16]);

struct Alternating<'a>(&'a [[f32; 4]; 2]);

impl Rows for Alternating<'_> {
    fn row(&self, lane: usize) -> &[f32; 4] {
        &self.0[lane % 2]
    }
}

impl Kernel for Everything<'_> {
    type Output = Vec<u32>;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Vec<u32> {
        let (a_i, b_i) = (s.load(self.0), s.load(self.1));
        let (a, b) = (s.of_bits(a_i), s.of_bits(b_i));
        let low = |v| s.and(v, s.splat_i(0xFFFF));
        let (less, equal, greater) = (s.lt(a, b), s.eq_i(a_i, b_i), s.gt_i(a_i, b_i));
        let bounded = s.max(s.min(a, s.splat(1e9)), s.splat(-1e9));
        let rows = [[1.0, 2.0, 3.0, 4.0], [5.0, -6.0, 7.5, -8.0]];
        let columns = s.transpose_rows(&Alternating(&rows));
        let mut out = Vec::new();
        for v in [
            s.bits(s.add(a, b)),
            s.bits(s.sub(a, b)),
            s.bits(s.mul(a, b)),
            s.bits(s.div(a, b)),
            s.bits(s.min(a, b)),
            s.bits(s.max(a, b)),
            s.bits(s.abs(a)),
            s.bits(s.select(less, a, b)),
            s.fill(s.not_lt(a, b), s.splat_i(0)),
            s.to_int(bounded),
            s.bits(s.to_float(a_i)),
            s.add_i(a_i, b_i),
            s.min_i(a_i, b_i),
            s.max_i(a_i, b_i),
            s.min_u(a_i, b_i),
            s.bits(s.repeat_four(&rows[1])),
            s.sub_saturating(low(a_i), low(b_i)),
            s.and(a_i, b_i),
            s.or(a_i, b_i),
            s.and_not(a_i, b_i),
            s.shl(b_i, s.and(a_i, s.splat_i(63))),
            s.keep(less, a_i),
            s.drop(less, a_i),
            s.fill(less, a_i),
            s.transpose_bytes(a_i),
            s.select_i(s.either(equal, greater), a_i, b_i),
            s.select_i(s.both(less, greater), a_i, b_i),
            s.select_i(s.but_not(less, greater), a_i, b_i),
            s.lane_index(),
            s.bits(columns[0]),
            s.bits(columns[1]),
            s.bits(columns[2]),
            s.bits(columns[3]),
        ] {
            let mut lanes = [0; 16];
            s.store(v, &mut lanes);
            // A NaN's payload is not part of the promise.
            out.extend(lanes[..8].iter().map(|&bits| match f32::from_bits(bits) {
                value if value.is_nan() => 0x7FC0_0000,
                _ => bits,
            }));
        }
        out.push(s.mask_bits(less) & 0xFF);
        out.push(u32::from(s.any(a_i)) + 2 * u32::from(s.any(s.and_not(a_i, a_i))));
        let in_last_lane = s.keep(
            s.eq_i(s.lane_index(), s.splat_i(S::LANES as i32 - 1)),
            s.splat_i(1),
        );
        out.push(u32::from(s.any(in_last_lane)));
        out
    }
}

#[test]
fn every_instruction_set_computes_the_same() {
    let mut random = fastrand::Rng::with_seed(1);
    let special = [0, 0x8000_0000, 0x7F80_0000, 0xFF80_0000, 0x7FC0_0000, 1, !0];
    for _ in 0..20_000 {
        let mut lanes = || {
            let half: [u32; 8] = std::array::from_fn(|_| match random.u8(..) {
                0..32 => special[random.usize(..special.len())],
                32..160 => (random.f32() * 4000.0 - 2000.0).to_bits(),
                _ => random.u32(..),
            });
            std::array::from_fn(|i| half[i % 8])
        };
        let (a, b) = (lanes(), lanes());
        let expected = Isa::new(IsaName::Portable)
            .expect("everywhere")
            .run(Everything(&a, &b));
        for isa in Isa::available() {
            assert_eq!(
                isa.run(Everything(&a, &b)),
                expected,
                "{isa:?} {a:x?} {b:x?}"
            );
        }
    }
}

#[test]
fn names_read_back() {
    for name in IsaName::ALL {
        assert_eq!(IsaName::from_name(name.name()), Some(name));
    }
    assert_eq!(Isa::best().name(), Isa::available()[0].name());
}
