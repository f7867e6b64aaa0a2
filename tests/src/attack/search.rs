//! Random search, then hill climbing from what it found.

use hroc_study::hard_cases::builder::Rng;

use super::situation::{Genome, NUMBERS, WORDS};

/// The genome that scored highest, and how often `score` was asked.
#[derive(Clone, Debug)]
pub struct Found {
    /// The highest score.
    pub score: f64,
    /// Who has it; `None`: nothing scored at all.
    pub genome: Option<Genome>,
    /// Evaluations.
    pub evaluations: usize,
}

/// Looks for a genome of high `score` (`None`: it stands for nothing): `climbs` times the best of `random`
/// random ones is changed `steps` times, for the better.
pub fn search(
    rng: &mut Rng,
    [climbs, random, steps]: [usize; 3],
    mut score: impl FnMut(&Genome) -> Option<f64>,
) -> Found {
    let mut found = Found {
        score: f64::NEG_INFINITY,
        genome: None,
        evaluations: climbs * (random + steps),
    };
    for _ in 0..climbs {
        let mut best: Option<(f64, Genome)> = None;
        for _ in 0..random {
            let genome = Genome {
                numbers: [(); NUMBERS].map(|()| rng.within(0.0, 1.0)),
                bits: [(); WORDS].map(|()| rng.bits()),
            };
            if let Some(score) = score(&genome)
                && best.as_ref().is_none_or(|(best, _)| score > *best)
            {
                best = Some((score, genome));
            }
        }
        let Some((mut high, mut best)) = best else {
            continue;
        };
        for _ in 0..steps {
            let mut next = best.clone();
            mutate(rng, &mut next);
            if let Some(score) = score(&next)
                && score >= high
            {
                (high, best) = (score, next);
            }
        }
        if high > found.score {
            found.score = high;
            found.genome = Some(best);
        }
    }
    found
}

/// Changes a few numbers by steps of any size, or a few roundings.
fn mutate(rng: &mut Rng, genome: &mut Genome) {
    if rng.bits().is_multiple_of(2) {
        for _ in 0..1 + rng.bits() % 3 {
            let at = (rng.bits() % NUMBERS as u64) as usize;
            let step = rng.magnitude(1e-9, 0.5)
                * if rng.bits().is_multiple_of(2) {
                    1.0
                } else {
                    -1.0
                };
            genome.numbers[at] = (genome.numbers[at] + step).clamp(0.0, 1.0 - 1e-12);
        }
    } else {
        for _ in 0..1 + rng.bits() % 6 {
            let at = (rng.bits() % WORDS as u64) as usize;
            genome.bits[at] ^= 1 << (rng.bits() % 64);
        }
    }
}
