//! A search for the camera, the box and the roundings that need the most of the padding. It must not find any that
//! need more than there is, and it must come near enough to show that it could: with half of a padding it finds a
//! miss.

use glam::DVec2;
use hroc_study::hard_cases::builder::Rng;
use hroc_tests::attack::arithmetic::Dice;
use hroc_tests::attack::search::search;
use hroc_tests::attack::shaders::{KEPT, Shares};
use hroc_tests::attack::situation::{Genome, Range, Situation};

const ANYTHING: Range = Range {
    name: "anything",
    coordinates: [1e-3, 1e6],
    turn: 1.0,
    distance: [1e-3, 1e6],
    extent: [1e-6, 0.7],
    sides: [1.0, 4096.0],
    near: [1e-3, 10.0],
    step_px: 1.0 / 16.0,
    perspective: false,
};
/// The subpixel step counts most.
const FEW_PIXELS: Range = Range {
    name: "few pixels",
    coordinates: [1e-1, 1e2],
    distance: [1e-1, 1e2],
    sides: [1.0, 64.0],
    perspective: true,
    ..ANYTHING
};
/// Rounding alone: nothing is snapped.
const ROUNDING: Range = Range {
    name: "rounding alone",
    coordinates: [1e4, 1e6],
    distance: [1e1, 1e5],
    sides: [64.0, 512.0],
    step_px: 0.0,
    perspective: true,
    ..ANYTHING
};
/// Rounding of boxes that reach far beside the eye is as large as the distance of the near plane.
const BESIDE_THE_EYE: Range = Range {
    name: "beside the eye",
    coordinates: [1e-1, 1e3],
    distance: [1e3, 1e6],
    near: [1e-5, 1e-3],
    perspective: true,
    ..ANYTHING
};

/// Rounding alone, of triangles that reach from near the eye to far away.
const DEEP: Range = Range {
    name: "deep triangles",
    coordinates: [1e-1, 1e2],
    turn: 0.01,
    distance: [1e0, 1e2],
    extent: [0.9, 0.9999],
    sides: [8.0, 64.0],
    near: [1e-4, 1e-2],
    step_px: 0.0,
    perspective: true,
};

/// Climbs, random genomes and steps of each.
const EFFORT: [usize; 3] = [20, 400, 6000];

/// What part of the padding is scaled to see how much of it is needed.
struct Term {
    name: &'static str,
    scale: fn(f64) -> Shares,
}

const BOUNDS: Term = Term {
    name: "padding of bounds",
    scale: |share| Shares {
        world: share,
        per_depth: share,
        ..Shares::ALL
    },
};
const BOUNDS_WORLD: Term = Term {
    name: "part for rounding",
    scale: |share| Shares {
        world: share,
        ..Shares::ALL
    },
};
const BOUNDS_STEP: Term = Term {
    name: "part for the subpixel step",
    scale: |share| Shares {
        per_depth: share,
        ..Shares::ALL
    },
};
const BOXES: Term = Term {
    name: "padding of boxes",
    scale: |share| Shares {
        box_world: share,
        box_per_depth: share,
        ..Shares::ALL
    },
};
const BOXES_WORLD: Term = Term {
    name: "part for rounding",
    scale: |share| Shares {
        box_world: share,
        ..Shares::ALL
    },
};
const BOXES_STEP: Term = Term {
    name: "part for the subpixel step",
    scale: |share| Shares {
        box_per_depth: share,
        ..Shares::ALL
    },
};
const NEAR: Term = Term {
    name: "distance from the near plane",
    scale: |share| Shares {
        near: share,
        ..Shares::ALL
    },
};
const DEPTH: Term = Term {
    name: "depth tolerance",
    scale: |share| Shares {
        depth: share,
        ..Shares::ALL
    },
};
const DEEPEST: Term = Term {
    name: "part for the largest depth",
    scale: |share| Shares {
        deepest: share,
        ..Shares::ALL
    },
};
const EVERYTHING: Term = Term {
    name: "all tolerances",
    scale: |share| Shares {
        world: share,
        per_depth: share,
        depth: share,
        slab: share,
        ..Shares::ALL
    },
};

/// The smallest share of `term` with which `holds`; 2 stands for more than that.
fn needed(term: &Term, holds: impl Fn(&Shares) -> bool) -> f64 {
    let holds = |share| holds(&(term.scale)(share));
    let (mut lo, mut hi) = (0.0, 2.0);
    if holds(lo) {
        return lo;
    }
    if !holds(hi) {
        return hi;
    }
    for _ in 0..11 {
        let middle = (lo + hi) / 2.0;
        *if holds(middle) { &mut hi } else { &mut lo } = middle;
    }
    hi
}

/// Looks for the genome in `range` that needs the most of `term`, which must be `least` of it and no more than all.
fn attack(
    what: &str,
    range: &Range,
    term: &Term,
    least: f64,
    score: impl Fn(&Situation, &mut Dice<'_>) -> Option<f64>,
) {
    let mut rng = Rng(2013);
    let found = search(&mut rng, EFFORT, |genome: &Genome| {
        let situation = Situation::new(genome, range)?;
        score(&situation, &mut Dice::new(&genome.bits))
    });
    eprintln!(
        "{what}, {}: {:.3} of the {} are needed, of {} tried",
        range.name, found.score, term.name, found.evaluations
    );
    assert!(
        found.score <= 1.0,
        "{what}, {}: a miss that needs {} of the {}:\n{:?}",
        range.name,
        found.score,
        term.name,
        found.genome.map(|genome| Situation::new(&genome, range))
    );
    assert!(
        found.score >= least,
        "{what}, {}: the attack needs {} of the {} only: weak, or the padding is too wide",
        range.name,
        found.score,
        term.name
    );
}

/// `hroc_keeps` loses no fragment that a rasterizer may leave of a triangle within the bounds.
#[test]
fn true_fragments_are_kept() {
    let kept = |range, term: &Term, least| {
        attack("kept fragments", range, term, least, |situation, dice| {
            let fragment = situation.fragment(dice)?;
            let holds =
                |shares: &Shares| situation.keeps(&mut dice.clone(), fragment, &shares.of(&KEPT));
            // Where this part is not needed at all, what needs the most of the others is closest to needing it.
            Some(needed(term, holds).max(0.01 * needed(&EVERYTHING, holds)))
        });
    };
    kept(&ANYTHING, &BOUNDS, 0.6);
    kept(&FEW_PIXELS, &BOUNDS_STEP, 0.6);
    // In proportion to the distance rounding takes less than the part that scales with depth has to spare.
    kept(&ROUNDING, &BOUNDS_WORLD, 0.001);
    kept(&BESIDE_THE_EYE, &BOUNDS, 0.01);
    kept(&ANYTHING, &DEPTH, 0.3);
    kept(&DEEP, &DEPTH, 0.4);
    kept(&DEEP, &DEEPEST, 0.5);
}

/// The rasterized box of bounds covers every position whose ray the slab test lets meet them.
#[test]
fn boxes_cover_what_rays_meet() {
    let covers = |range, term: &Term, least| {
        attack(
            "covered positions",
            range,
            term,
            least,
            |situation, dice| {
                let p = situation.met(dice)?;
                let by = |share| situation.covers_by(&mut dice.clone(), p, &(term.scale)(share));
                let ([all, _], [none, _]) = (by(1.0)?, by(0.0)?);
                // Coverage grows with the padding evenly enough.
                Some(if none >= 0.0 {
                    0.0
                } else {
                    -none / (all - none).max(1e-9)
                })
            },
        );
    };
    covers(&ANYTHING, &BOXES, 0.6);
    covers(&FEW_PIXELS, &BOXES_STEP, 0.6);
    // In proportion to the distance rounding takes less than the part that scales with depth has to spare.
    covers(&ROUNDING, &BOXES_WORLD, 0.0);
    covers(&BESIDE_THE_EYE, &BOXES, 0.0);
}

/// No box is rasterized with a corner that comes out behind the eye.
#[test]
fn rasterized_boxes_lie_before_the_eye() {
    attack(
        "boxes before the eye",
        &BESIDE_THE_EYE,
        &NEAR,
        -1.0,
        |situation, dice| {
            let [_, least_w] = situation.covers_by(dice, DVec2::ZERO, &Shares::ALL)?;
            Some(1.0 - least_w / situation.near_margin(dice))
        },
    );
}

/// No object with a fragment in the image is taken for one beside the view volume.
#[test]
fn what_shows_is_in_the_frustum() {
    for range in [ANYTHING, ROUNDING, BESIDE_THE_EYE] {
        attack("frustum", &range, &BOUNDS, 0.0, |situation, dice| {
            situation.fragment(dice)?;
            let holds = |shares: &Shares| situation.in_frustum(&mut dice.clone(), shares);
            Some(needed(&BOUNDS, holds))
        });
    }
}

/// What is asked before a ray is cast turns nothing away that the ray would find.
#[test]
fn nothing_is_turned_away_before_its_ray() {
    for range in [ANYTHING, ROUNDING, BESIDE_THE_EYE] {
        attack(
            "before the ray",
            &range,
            &EVERYTHING,
            0.0,
            |situation, dice| {
                let (_, depth) = situation.grazed(dice)?;
                Some(if situation.reaches_the_ray(dice, depth) {
                    0.0
                } else {
                    2.0
                })
            },
        );
    }
}

/// Two pipelines may round the same expressions differently: what the host's keeps, the test must find.
#[test]
fn two_pipelines_agree() {
    for range in [ANYTHING, FEW_PIXELS, ROUNDING, BESIDE_THE_EYE, DEEP] {
        attack(
            "two pipelines",
            &range,
            &EVERYTHING,
            0.8,
            |situation, dice| {
                let at = situation.grazed(dice)?;
                Some(needed(&EVERYTHING, |shares| {
                    situation.passes(&mut dice.others(), at, shares)
                }))
            },
        );
    }
}

/// The nodes above an object let pass whatever the object's own bounds do.
#[test]
fn ancestors_pass_what_their_objects_pass() {
    for range in [ANYTHING, FEW_PIXELS, ROUNDING, BESIDE_THE_EYE, DEEP] {
        attack("ancestors", &range, &EVERYTHING, 0.0, |situation, dice| {
            let at = situation.grazed(dice)?;
            Some(needed(&EVERYTHING, |shares| {
                situation.ancestor_passes(&mut dice.others(), at, shares)
            }))
        });
    }
}
