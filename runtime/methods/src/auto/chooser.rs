//! Which arm draws the next frame: by what each took when it last drew, carried over to what is in view now.
//!
//! Drawing all in view takes what the device was measured to take for its draws, triangles and fragments, each kind
//! times a factor that is fitted to the times told, as shading is the host's own. The time of an arm that culls is a
//! share of this, and the rest, its overhead, which stays. While one of the two that cull is at home, the other takes
//! so many times as much as it did in neighbouring frames of the two. Of several times the median counts, so that a
//! step through a wall changes nothing. As estimates of arms that do not draw grow old, one is tried again now and then, if
//! it could be ahead by then, and within a budget: trying may cost a fiftieth of the time.
//! At first every arm draws twice, the frustum's once where it is out of the question.

/// What draws a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arm {
    /// All in the frustum.
    Frustum,
    /// HROC.
    Groups,
    /// ROC behind a Hi-Z test.
    Leaves,
}

impl Arm {
    pub const ALL: [Self; 3] = [Self::Frustum, Self::Groups, Self::Leaves];

    const fn index(self) -> usize {
        self as usize
    }

    /// The sign with which [`Chooser::pairs`] speaks of this one, that culls.
    const fn side(self) -> f64 {
        match self {
            Self::Leaves => 1.0,
            Self::Frustum | Self::Groups => -1.0,
        }
    }

    /// The other one that culls.
    const fn other(self) -> Option<Self> {
        match self {
            Self::Frustum => None,
            Self::Groups => Some(Self::Leaves),
            Self::Leaves => Some(Self::Groups),
        }
    }
}

/// What is done in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Plan {
    pub arm: Arm,
    /// Another arm follows one that does not know what shows: it has to find out.
    pub hands_over: bool,
}

/// What drawing all in view should take.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct InView {
    pub objects: f64,
    /// Milliseconds for draws and triangles, by the device's times.
    pub geometry_ms: f64,
    /// Milliseconds for fragments, by the device's times: those of a shader that does nothing.
    pub fragments_ms: f64,
}

/// Another arm is taken if it is expected to take less than this share of the time.
const HYSTERESIS: f64 = 0.98;
/// Share of all time that trying one of the other arms may cost.
const TRYING: f64 = 0.01;
/// Frames after which a trial that cost more than it should is forgiven.
const FORGIVEN: f64 = 12.0;
/// Frames of which the budget for trying can be saved up.
const SAVED: f64 = 1000.0;
/// Frames between two trials of an arm at least: at first, and at last, as every trial doubles it until another arm is
/// at home.
const REST: [i64; 2] = [8, 32];
/// Frames after which one of the two arms that cull is tried again that seemed to gain over the other: one time is not
/// enough to change for, and if it was right, every frame until then is lost.
const AGAIN: i64 = 2;
/// An estimate that is so many frames old may be wrong by a factor of two.
const DOUBTFUL: f64 = 32.0;
/// Frames at the start whose times tell little: every arm draws once.
const COLD: u64 = Arm::ALL.len() as u64;
/// Frames at the start in which two arms that cull draw in turn, whatever it costs, until they are
/// [decided](DECIDED), as one rough time would decide between them for long.
const IN_TURN: u64 = 16;
/// An arm that takes so many times as long as another is not drawn in turn with it, nor are two frames that differ so a
/// comparison of arms.
const HOPELESS: f64 = 2.0;
/// Share of the objects in view that is nearly all of what there is to draw.
const NEARLY_ALL: f64 = 0.9;
/// Times of an arm that count.
const SAMPLES: usize = 5;
/// Pairs of neighbouring frames that count. Even, so that each arm comes second in half of them: what the view gains
/// from one frame to the next is held against both.
const PAIRS: usize = 10;
/// Pairs that end the turns at the start, if each of them says the same.
const DECIDED: usize = 3;
/// What they say at least: the logarithm of the times over each other.
const CLEARLY: f64 = 0.05;
/// Of an arm that was away for so many frames the times before that do not count.
const FORGOTTEN: i64 = 16;
/// What geometry and fragments take of the device's times, before any frame told: hosts shade.
const PRIOR: [f64; 2] = [1.0, 8.0];
/// How much [`PRIOR`] counts beside one frame.
const PRIOR_WEIGHT: f64 = 0.05;
/// How much a frame counts beside the next of the frustum's.
const FADING: f64 = 0.9;
/// Frames whose times may be told late.
const LATE: usize = 16;

/// What an arm took.
#[derive(Clone, Copy, Debug)]
struct Sample {
    ms: f64,
    in_view: InView,
    /// Share of what is in view that was drawn.
    drawn: f64,
    frame: i64,
}

/// A frame whose time is not told yet.
#[derive(Clone, Copy, Debug)]
struct Pending {
    frame: u64,
    plan: Plan,
    in_view: InView,
    /// What each arm should have taken in this frame; `None` where that is unknown.
    expected_ms: [Option<f64>; 3],
    /// The arm that would have drawn without trial and handing over.
    home: Arm,
}

/// What drawing all in view takes: least squares of relative errors.
#[derive(Clone, Copy, Debug, Default)]
struct Cost {
    /// Sums of g g, g f, f f, g, f, of the device's times over those told.
    sums: [f64; 5],
}

impl Cost {
    fn learn(&mut self, ms: f64, in_view: &InView) {
        let (g, f) = (in_view.geometry_ms / ms, in_view.fragments_ms / ms);
        for (sum, new) in self.sums.iter_mut().zip([g * g, g * f, f * f, g, f]) {
            *sum = FADING * *sum + new;
        }
    }

    /// Milliseconds for what is in view.
    fn ms(&self, in_view: &InView) -> f64 {
        let [gg, gf, ff, g, f] = self.sums;
        let prior = PRIOR.map(|factor| PRIOR_WEIGHT / (factor * factor));
        let (gg, ff) = (gg + prior[0], ff + prior[1]);
        let (g, f) = (g + prior[0] * PRIOR[0], f + prior[1] * PRIOR[1]);
        // Positive by the inequality of Cauchy and Schwarz.
        let determinant = gg * ff - gf * gf;
        let factors = [g * ff - f * gf, f * gg - g * gf].map(|sum| sum / determinant);
        let [geometry, fragments] = [0, 1].map(|kind| factors[kind].max(0.05 * PRIOR[kind]));
        geometry * in_view.geometry_ms + fragments * in_view.fragments_ms
    }
}

#[derive(Debug)]
pub(super) struct Chooser {
    cost: Cost,
    /// Of each arm, the newest last.
    samples: [Vec<Sample>; 3],
    /// Logarithms of the time of Leaves over that of Groups, each from two neighbouring frames, the newest last.
    pairs: Vec<f64>,
    /// What draws unless another arm is tried.
    home: Arm,
    /// What draws the next frame whatever else: the arm that was handed over to.
    follows: Option<Arm>,
    last: Option<Plan>,
    frame: u64,
    /// The frame in which each arm was last planned to draw.
    planned: [i64; 3],
    /// See [`REST`].
    rest: [i64; 3],
    /// Milliseconds that may be spent on trying each arm.
    credit_ms: [f64; 3],
    pending: [Option<Pending>; LATE],
    /// What each arm took in the first [`COLD`] frames.
    cold: [Option<Sample>; 3],
    /// Frames by which the opening is shorter, as an arm is out of the question.
    left_out: u64,
    /// Share of what was in view that was drawn, of the last frame that told.
    drawn: f64,
    /// Frames in a row that drew nearly all: more than a step through a wall makes.
    full: usize,
}

impl Chooser {
    pub fn new() -> Self {
        Self {
            cost: Cost::default(),
            samples: Default::default(),
            pairs: Vec::new(),
            home: Arm::Groups,
            follows: None,
            last: None,
            frame: 0,
            planned: [0; 3],
            rest: [REST[0]; 3],
            credit_ms: [0.0; 3],
            pending: [None; LATE],
            cold: [None; 3],
            left_out: 0,
            drawn: 1.0,
            full: 0,
        }
    }

    /// Milliseconds that `arm` should take for what is in view; `None` before it ever drew.
    fn expected_ms(&self, arm: Arm, in_view: &InView) -> Option<f64> {
        let samples = &self.samples[arm.index()];
        if arm == Arm::Frustum {
            let now = self.cost.ms(in_view);
            return median(samples.iter().map(|sample| {
                let then = self.cost.ms(&sample.in_view);
                sample.ms * if then > 0.0 { now / then } else { 1.0 }
            }));
        }
        // What makes one slower makes both: a crowded view, a busy machine.
        if arm != self.home
            && self.home != Arm::Frustum
            && let Some(pair) = median(self.pairs.iter().copied())
        {
            return Some((arm.side() * pair).exp() * self.expected_ms(self.home, in_view)?);
        }
        median(
            samples
                .iter()
                .map(|sample| self.carried_ms(sample, in_view)),
        )
    }

    /// What an arm that culls and took `sample` would have taken for what is in view.
    fn carried_ms(&self, sample: &Sample, in_view: &InView) -> f64 {
        // Before the frustum's ever drew, nothing tells draws from overhead.
        let all = |in_view| self.expected_ms(Arm::Frustum, in_view).unwrap_or(0.0);
        let (now, then) = (all(in_view), all(&sample.in_view));
        let drawn = sample.drawn.min(sample.ms / then.max(f64::MIN_POSITIVE));
        // What comes into view is hidden for the most part, as an image holds only so much: the geometric mean
        // of all of it and nothing.
        let now = now.min((now * then).sqrt());
        sample.ms + drawn * (now - then)
    }

    /// Frames since the newest one of `arm` whose time was told.
    fn age(&self, arm: Arm) -> i64 {
        let newest = self.samples[arm.index()].last();
        newest.map_or(i64::MAX, |newest| self.frame as i64 - newest.frame)
    }

    /// [`Self::expected_ms`] of every arm.
    fn estimates_ms(&self, in_view: &InView) -> [Option<f64>; 3] {
        Arm::ALL.map(|arm| self.expected_ms(arm, in_view))
    }

    /// The arm that should take the least, if it is better than `home` by more than may be noise.
    fn best(&self, mut expected_ms: [Option<f64>; 3]) -> Arm {
        // Where nearly all is drawn whoever draws, culling has little to spare and noise is more than that; and who draws
        // so much takes no less than drawing so much, whatever its times say.
        if self.full >= SAMPLES
            && let [Some(frustum), culling @ ..] = &mut expected_ms
        {
            for ms in culling.iter_mut().flatten() {
                *ms = ms.max(self.drawn * *frustum);
            }
            *frustum *= NEARLY_ALL;
        }
        let expected = |arm: Arm| expected_ms[arm.index()].unwrap_or(f64::INFINITY);
        let least = |a: &Arm, b: &Arm| expected(*a).total_cmp(&expected(*b));
        let best = Arm::ALL.into_iter().min_by(least).unwrap_or(self.home);
        match expected_ms[self.home.index()] {
            Some(home) if expected(best) < HYSTERESIS * home => best,
            _ => self.home,
        }
    }

    /// Whether all pairs so far say clearly which of the two arms that cull takes longer.
    fn is_decided(&self) -> bool {
        let says = |side: f64| self.pairs.iter().all(|pair| side * pair > CLEARLY);
        self.pairs.len() >= DECIDED && (says(1.0) || says(-1.0))
    }

    /// An arm to try instead of `home`.
    fn trial(&self, expected_ms: &[Option<f64>; 3]) -> Option<Arm> {
        let home = expected_ms[self.home.index()]?;
        let others = Arm::ALL.into_iter().filter(|&arm| arm != self.home);
        let worth_it = |&arm: &Arm| {
            // By what was planned: of a trial not told yet there need not be another.
            let rested = self.frame as i64 - self.planned[arm.index()];
            let Some(expected) = expected_ms[arm.index()] else {
                return rested >= self.rest[arm.index()];
            };
            if self.frame < IN_TURN && arm.other() == Some(self.home) {
                return rested > 1 && expected < HOPELESS * home && !self.is_decided();
            }
            let age = self.age(arm);
            // Who draws nearly all that is in view would not take much longer for all, unless it is known that the few
            // objects that are left are heavy ones.
            let are_light = age > self.full as i64 || expected < HOPELESS * home;
            let expected = match arm {
                Arm::Frustum if self.full >= SAMPLES && are_light => {
                    expected.min(home / self.drawn)
                }
                _ => expected,
            };
            // The less of what is in view shows, the less likely all of it takes less time.
            let doubt = match arm {
                Arm::Frustum => self.drawn * age as f64 / DOUBTFUL,
                _ => age as f64 / DOUBTFUL,
            };
            // After the frustum's comes a frame that hands over.
            let frames = if arm == Arm::Frustum { 2.0 } else { 1.0 };
            rested >= self.rest[arm.index()]
                && expected / (1.0 + doubt) < home
                && frames * (expected - home) <= self.credit_ms[arm.index()]
        };
        others.filter(worth_it).max_by_key(|&arm| self.age(arm))
    }

    /// The frustum's first time, if it is out of the question by that and by the device's times, both of which err: what
    /// comes first waits for caches and pipelines, and hosts shade.
    fn hopeless_frustum(&self, in_view: &InView) -> Option<Sample> {
        let [frustum, groups, leaves] = self.cold;
        let least_ms = groups?.ms.min(leaves?.ms);
        let least_of_frustum_ms = frustum?.ms.min(self.cost.ms(in_view));
        frustum.filter(|_| least_of_frustum_ms > HOPELESS * least_ms)
    }

    /// The arm that draws next whatever else, in the first frames: each of them once, and once more when caches and
    /// pipelines are warm. Nobody knows what shows in the first one, so it is the frustum's; the others follow.
    fn opening(&mut self, in_view: &InView) -> Option<Arm> {
        if self.frame == COLD
            && let Some(frustum) = self.hopeless_frustum(in_view)
        {
            self.samples[Arm::Frustum.index()].push(frustum);
            self.left_out = 1;
        }
        let turn = self.frame + self.left_out;
        (turn < 2 * COLD).then(|| Arm::ALL[(turn % COLD) as usize])
    }

    /// The plan for the next frame; it must be followed.
    pub fn next(&mut self, in_view: InView) -> Plan {
        let first = self.opening(&in_view);
        let mut expected_ms = self.estimates_ms(&in_view);
        let wanted = first.or(self.follows.take()).unwrap_or_else(|| {
            let best = self.best(expected_ms);
            if best != self.home {
                (self.home, self.rest) = (best, [REST[0]; 3]);
                // One is held against the other that culls by which is at home.
                expected_ms = self.estimates_ms(&in_view);
            }
            self.trial(&expected_ms).unwrap_or(self.home)
        });
        let is_ignorant = |last: Plan| last.arm == Arm::Frustum && !last.hands_over;
        let needs_handing = wanted != Arm::Frustum && self.last.is_some_and(is_ignorant);
        let plan = if needs_handing {
            self.follows = Some(wanted);
            Plan {
                arm: Arm::Frustum,
                hands_over: true,
            }
        } else {
            Plan {
                arm: wanted,
                hands_over: first == Some(Arm::Frustum),
            }
        };
        self.pending[self.frame as usize % LATE] = Some(Pending {
            frame: self.frame,
            plan,
            in_view,
            expected_ms,
            home: self.home,
        });
        self.planned[plan.arm.index()] = self.frame as i64;
        self.frame += 1;
        self.last = Some(plan);
        plan
    }

    /// The plan of the last frame.
    pub const fn last_plan(&self) -> Option<Plan> {
        self.last
    }

    /// Tells what share of what was in view the last frame drew that culled and whose time is told.
    pub fn drew(&mut self, share: f64) {
        self.drawn = share.clamp(0.0, 1.0);
        let culling = self.samples[1..]
            .iter_mut()
            .filter_map(|of_arm| of_arm.last_mut());
        if let Some(newest) = culling.max_by_key(|sample| sample.frame) {
            newest.drawn = self.drawn;
        }
        let is_full = self.drawn > NEARLY_ALL;
        self.full = if is_full {
            self.full.saturating_add(1)
        } else {
            0
        };
    }

    /// Tells how long a frame took.
    pub fn took(&mut self, frame: u64, ms: f64) {
        let place = &self.pending[frame as usize % LATE];
        let told = place.filter(|pending| pending.frame == frame && ms.is_finite() && ms > 0.0);
        let Some(Pending {
            plan,
            in_view,
            expected_ms,
            home,
            ..
        }) = told
        else {
            return;
        };
        for credit_ms in &mut self.credit_ms {
            *credit_ms = (*credit_ms + TRYING * ms).min(SAVED * TRYING * ms);
        }
        if frame < COLD {
            // Times of the first frames are few and rough: more may be tried.
            self.credit_ms = [FORGIVEN * TRYING * ms; 3];
        }
        if frame >= IN_TURN && (plan.hands_over || plan.arm != home) {
            let expected_ms = expected_ms[home.index()];
            // Signed, as noise is: what one trial seems to lose, another seems to gain.
            let lost_ms = expected_ms.map_or(0.0, |expected| ms - expected);
            let credit_ms = &mut self.credit_ms[plan.arm.index()];
            *credit_ms = (*credit_ms - lost_ms).max(-FORGIVEN * TRYING * ms);
            if !plan.hands_over {
                let rest = &mut self.rest[plan.arm.index()];
                *rest = if lost_ms < 0.0 && plan.arm.other() == Some(home) {
                    AGAIN
                } else {
                    (2 * *rest).clamp(REST[0], REST[1])
                };
            }
        }
        let is_first = self.samples[plan.arm.index()].is_empty();
        let sample = Sample {
            ms,
            in_view,
            drawn: self.drawn,
            frame: frame as i64,
        };
        if frame < COLD {
            self.cold[plan.arm.index()] = Some(sample);
            return;
        }
        if plan.hands_over && !is_first {
            return;
        }
        if plan.arm == Arm::Frustum {
            self.cost.learn(ms, &in_view);
        }
        let frame = frame as i64;
        let before = plan
            .arm
            .other()
            .and_then(|other| self.samples[other.index()].last());
        if let Some(before) = before.filter(|before| before.frame + 1 == frame) {
            let over_other = (ms / self.carried_ms(before, &in_view)).ln();
            // A jump may tell of the view and not of the arms: it counts no more than a clear difference.
            let most = HOPELESS.ln();
            if !over_other.is_nan() {
                push_bounded(
                    &mut self.pairs,
                    plan.arm.side() * over_other.clamp(-most, most),
                    PAIRS,
                );
            }
        }
        let samples = &mut self.samples[plan.arm.index()];
        samples.retain(|sample| frame < sample.frame + FORGOTTEN);
        push_bounded(samples, sample, SAMPLES);
    }
}

/// Appends an element to a list of which only the newest `bound` count.
fn push_bounded<T>(list: &mut Vec<T>, element: T, bound: usize) {
    if list.len() == bound {
        list.remove(0);
    }
    list.push(element);
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values = values.collect::<Vec<_>>();
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => None,
        n if n % 2 == 1 => Some(values[n / 2]),
        n => Some(0.5 * (values[n / 2 - 1] + values[n / 2])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(load_ms: f64) -> InView {
        InView {
            objects: 1.0,
            geometry_ms: 0.5 * load_ms,
            fragments_ms: 0.1 * load_ms,
        }
    }

    /// Milliseconds of the frames that the chooser draws where each arm takes what `cost` says, and the arms.
    fn run(frames: u64, late: u64, mut cost: impl FnMut(u64, Plan) -> f64) -> (f64, Vec<Arm>) {
        let mut chooser = Chooser::new();
        let mut times = Vec::new();
        let mut arms = Vec::new();
        for frame in 0..frames {
            let plan = chooser.next(view(10.0));
            times.push(cost(frame, plan));
            arms.push(plan.arm);
            if let Some(told) = frame.checked_sub(late) {
                chooser.drew(0.3);
                chooser.took(told, times[told as usize]);
            }
        }
        (times[6..].iter().sum(), arms)
    }

    fn fixed(costs: [f64; 3]) -> impl FnMut(u64, Plan) -> f64 {
        // Handing over costs something.
        move |_, plan| costs[plan.arm.index()] + if plan.hands_over { 1.0 } else { 0.0 }
    }

    #[test]
    fn the_best_of_constant_arms_is_kept_within_the_budget() {
        for costs in [
            [10.0, 20.0, 15.0],
            [50.0, 10.0, 12.0],
            [50.0, 14.0, 10.0],
            [10.0, 10.4, 10.3],
            [500.0, 10.0, 10.0],
        ] {
            let (total, arms) = run(500, 0, fixed(costs));
            let least = costs.into_iter().fold(f64::INFINITY, f64::min) * 494.0;
            assert!(total <= 1.04 * least, "{costs:?}: {}", total / least);
            let switches = arms.windows(2).filter(|pair| pair[0] != pair[1]).count();
            assert!(switches < 100, "{costs:?}: {switches}");
        }
    }

    #[test]
    fn noise_and_late_news_cost_little() {
        let mut rng = fastrand::Rng::with_seed(1);
        for late in [0, 1, 3] {
            for costs in [[10.0, 13.0, 12.0], [30.0, 10.0, 11.0], [11.0, 14.0, 10.0]] {
                let mut exact = fixed(costs);
                let noisy = |frame, plan| exact(frame, plan) * (0.9 + 0.2 * rng.f64());
                let (total, _) = run(500, late, noisy);
                let least = costs.into_iter().fold(f64::INFINITY, f64::min) * 494.0;
                assert!(total <= 1.05 * least, "{late} {costs:?}: {}", total / least);
            }
        }
    }

    #[test]
    fn it_follows_a_scene_that_changes() {
        // Open, then indoors, then open again; the changes fall on any frame of the rests between trials.
        let mut regrets = Vec::new();
        for length in 280..320 {
            let costs = |frame| match frame / length {
                1 => [40.0, 12.0, 10.0],
                _ => [10.0, 16.0, 15.0],
            };
            let cost = |frame: u64, plan: Plan| costs(frame)[plan.arm.index()];
            let frames = 3 * length;
            let (total, _) = run(frames, 0, cost);
            let least = (6..frames).map(|frame| costs(frame)[0].min(costs(frame)[2]));
            regrets.push(total / least.sum::<f64>());
        }
        let mean = regrets.iter().sum::<f64>() / regrets.len() as f64;
        // What is in view does not tell it here: only trials do, within their budget.
        assert!(mean <= 1.1, "{regrets:?}");
    }

    #[test]
    fn one_that_cuts_the_other_to_less_than_half_is_found() {
        let costs = |frame| match frame {
            0..200 => [100.0, 10.0, 10.5],
            _ => [100.0, 40.0, 15.0],
        };
        let (_, arms) = run(400, 0, |frame, plan| costs(frame)[plan.arm.index()]);
        assert!(arms[190..200].contains(&Arm::Groups));
        let leaves = arms[300..].iter().filter(|&&arm| arm == Arm::Leaves);
        assert!(leaves.count() > 90);
    }

    #[test]
    fn a_host_that_stops_telling_is_not_kept_in_a_trial() {
        let mut chooser = Chooser::new();
        let mut cost = fixed([50.0, 10.0, 11.0]);
        let mut frustum = 0;
        for frame in 0..2000 {
            let plan = chooser.next(view(10.0));
            if frame < 1000 {
                chooser.took(frame, cost(frame, plan));
            } else {
                frustum += u32::from(plan.arm == Arm::Frustum);
            }
        }
        assert!(frustum < 100, "{frustum}");
    }

    #[test]
    fn a_host_that_begins_late_to_tell_gets_the_best_too() {
        for costs in [[10.0, 20.0, 15.0], [50.0, 14.0, 10.0]] {
            let mut chooser = Chooser::new();
            let mut cost = fixed(costs);
            let best = [Arm::Frustum, Arm::Leaves][usize::from(costs[0] > costs[2])];
            let mut drew = 0;
            for frame in 0..400 {
                let plan = chooser.next(view(10.0));
                if frame >= 100 {
                    chooser.took(frame, cost(frame, plan));
                }
                drew += u32::from(frame >= 300 && plan.arm == best);
            }
            assert!(drew > 90, "{costs:?}: {drew}");
        }
    }

    #[test]
    fn noise_moves_nobody_where_nearly_all_is_drawn() {
        let mut rng = fastrand::Rng::with_seed(3);
        let mut chooser = Chooser::new();
        let mut total = 0.0;
        for frame in 0..1000 {
            let plan = chooser.next(view(10.0));
            let exact = [10.0, 11.0, 10.8][plan.arm.index()];
            total += exact;
            if plan.arm != Arm::Frustum {
                chooser.drew(0.97);
            }
            chooser.took(frame, exact * (0.8 + 0.4 * rng.f64()));
        }
        assert!(total < 1.015 * 10_000.0, "{total}");
    }

    /// Who draws all of it takes no less than drawing all of it: what seems so is noise.
    #[test]
    fn the_frustum_is_not_left_where_all_is_drawn() {
        let mut worst: f64 = 0.0;
        for seed in 0..50 {
            let mut rng = fastrand::Rng::with_seed(seed);
            let mut chooser = Chooser::new();
            let mut total = 0.0;
            for frame in 0..60 {
                let plan = chooser.next(view(10.0));
                let exact = [10.0, 11.5, 11.2][plan.arm.index()];
                total += exact;
                if plan.arm != Arm::Frustum {
                    chooser.drew(1.0);
                }
                chooser.took(frame, exact * (0.7 + 0.6 * rng.f64()));
            }
            worst = worst.max(total / 600.0);
        }
        assert!(worst < 1.04, "{worst}");
    }

    #[test]
    fn what_is_in_view_foretells() {
        let mut chooser = Chooser::new();
        let load = |frame: u64| if frame < 50 { 10.0 } else { 1.0 };
        let mut frustum = 0;
        for frame in 0..60 {
            let plan = chooser.next(view(load(frame)));
            // Drawing takes what it should; culling takes 4 ms and leaves a fifth.
            let ms = match plan.arm {
                Arm::Frustum => load(frame),
                _ => 4.0 + 0.2 * load(frame),
            };
            chooser.drew(0.2);
            chooser.took(frame, ms);
            frustum += u32::from(frame >= 50 && plan.arm == Arm::Frustum);
        }
        assert!(
            frustum == 10,
            "at once, as the estimate is carried over: {frustum}"
        );
    }

    #[test]
    fn one_that_was_tried_in_another_view_is_not_held_to_that_time() {
        // A crowded view, then an empty one; what culls takes its share of both, Leaves less in the second.
        let mut chooser = Chooser::new();
        let mut leaves = 0;
        for frame in 0..60 {
            let plan = chooser.next(view(if frame < 8 { 100.0 } else { 90.0 }));
            let [groups, leaf] = if frame < 8 { [40.0, 41.0] } else { [10.0, 8.0] };
            chooser.drew(0.2);
            chooser.took(frame, [100.0, groups, leaf][plan.arm.index()]);
            leaves += u32::from(frame >= 20 && plan.arm == Arm::Leaves);
        }
        assert!(leaves >= 35, "{leaves} of 40 frames");
    }

    /// How many of 30 frames the frustum's draws, the first of which takes `cold` times as long as it would.
    fn frustums(load_ms: f64, costs: [f64; 3], cold: f64) -> usize {
        let mut chooser = Chooser::new();
        let mut frustums = 0;
        for frame in 0..30 {
            let plan = chooser.next(view(load_ms));
            let factor = if frame == 0 { cold } else { 1.0 };
            if plan.arm != Arm::Frustum {
                chooser.drew(0.2);
            }
            chooser.took(frame, factor * costs[plan.arm.index()]);
            frustums += usize::from(plan.arm == Arm::Frustum);
        }
        frustums
    }

    #[test]
    fn the_frustum_draws_once_where_it_is_hopeless() {
        assert_eq!(frustums(100.0, [100.0, 30.0, 28.0], 1.0), 1);
        // Not by its first time alone, which waits for pipelines, nor by the device's times alone, which err.
        assert!(frustums(10.0, [10.0, 14.0, 13.0], 20.0) > 20);
        assert!(frustums(100.0, [40.0, 30.0, 28.0], 1.0) > 1);
    }

    #[test]
    fn a_trial_that_seemed_to_gain_is_repeated_soon() {
        // Leaves seems worse at the start and is better from frame 14 on.
        let mut chooser = Chooser::new();
        let mut leaves = Vec::new();
        for frame in 0..120 {
            let plan = chooser.next(view(50.0));
            let leaf = if frame < 14 { 50.0 } else { 32.0 };
            chooser.drew(0.2);
            chooser.took(frame, [200.0, 40.0, leaf][plan.arm.index()]);
            if frame >= 14 && plan.arm == Arm::Leaves {
                leaves.push(frame);
            }
        }
        // Three at most until it is at home, as soon as the budget allows.
        assert!(leaves[2] < 30 && leaves[3] == leaves[2] + 1, "{leaves:?}");
        assert!(leaves.len() >= 90, "{leaves:?}");
    }

    #[test]
    fn one_rough_time_at_the_start_decides_nothing() {
        for rough in 3..12 {
            let mut chooser = Chooser::new();
            let mut leaves = 0;
            for frame in 0..60 {
                let plan = chooser.next(view(50.0));
                let ms = [100.0, 40.0, 34.0][plan.arm.index()];
                chooser.drew(0.2);
                chooser.took(frame, if frame == rough { 1.6 * ms } else { ms });
                leaves += u32::from(frame >= 12 && plan.arm == Arm::Leaves);
            }
            assert!(leaves >= 44, "frame {rough} rough: {leaves} of 48 frames");
        }
    }

    #[test]
    fn arms_that_differ_clearly_do_not_draw_in_turn_for_long() {
        for (costs, worse) in [
            ([100.0, 40.0, 34.0], Arm::Groups),
            ([100.0, 34.0, 40.0], Arm::Leaves),
        ] {
            let (_, arms) = run(IN_TURN, 0, fixed(costs));
            let worse = arms[4..].iter().filter(|&&arm| arm == worse).count();
            assert_eq!(worse, 2, "{arms:?}");
        }
        // The same within a few percent: it costs nothing to look again.
        let (_, arms) = run(IN_TURN, 0, fixed([100.0, 34.0, 34.5]));
        let leaves = arms[4..].iter().filter(|&&arm| arm == Arm::Leaves);
        assert_eq!(leaves.count() as u64, (IN_TURN - 4) / 2, "{arms:?}");
    }

    #[test]
    fn the_frustum_is_not_tried_where_little_of_what_is_in_view_shows() {
        // What is in view shrinks to a third, and so does the time of every arm.
        let mut chooser = Chooser::new();
        for frame in 0..110 {
            let load = if frame < 80 { 100.0 } else { 30.0 };
            let plan = chooser.next(view(load));
            assert!(frame < 12 || plan.arm != Arm::Frustum, "frame {frame}");
            chooser.drew(0.2);
            chooser.took(frame, [1.2, 0.45, 0.4][plan.arm.index()] * load);
        }
    }

    #[test]
    fn a_step_through_a_wall_changes_nothing() {
        let mut chooser = Chooser::new();
        for frame in 0..60 {
            let plan = chooser.next(view(50.0));
            let is_wall = (27..29).contains(&frame);
            let ms = match plan.arm {
                Arm::Frustum => 100.0,
                _ if is_wall => 150.0,
                Arm::Groups => 40.0,
                Arm::Leaves => 34.0,
            };
            chooser.drew(if is_wall { 0.99 } else { 0.2 });
            chooser.took(frame, ms);
            assert!(frame < 6 || plan.arm != Arm::Frustum, "frame {frame}");
        }
    }

    #[test]
    fn a_slow_spell_of_the_machine_is_forgotten() {
        let mut chooser = Chooser::new();
        let mut total = 0.0;
        for frame in 0..160 {
            let plan = chooser.next(view(10.0));
            let spell = if (20..30).contains(&frame) { 1.6 } else { 1.0 };
            let ms = spell * [10.0, 11.2, 11.0][plan.arm.index()];
            chooser.drew(0.96);
            chooser.took(frame, ms);
            total += if frame < 50 { 0.0 } else { ms };
        }
        let regret = total / (110.0 * 10.0);
        assert!(regret <= 1.025, "{regret}");
    }

    #[test]
    fn the_cost_of_fragments_is_learned() {
        let view = |geometry_ms, fragments_ms| InView {
            geometry_ms,
            fragments_ms,
            ..InView::default()
        };
        let truth = |view: &InView| 0.7 * view.geometry_ms + 17.0 * view.fragments_ms;
        let mut cost = Cost::default();
        for view in [view(146.0, 0.9), view(86.0, 6.0), view(20.0, 6.5)] {
            cost.learn(truth(&view), &view);
        }
        for view in [view(150.0, 1.0), view(50.0, 7.0), view(5.0, 5.0)] {
            let ratio = cost.ms(&view) / truth(&view);
            assert!((0.9..1.1).contains(&ratio), "{ratio}");
        }
        let mut alike = Cost::default();
        for _ in 0..1000 {
            alike.learn(114.0, &view(146.0, 0.0));
        }
        assert!((alike.ms(&view(146.0, 0.0)) / 114.0 - 1.0).abs() < 0.01);
        assert!(alike.ms(&view(0.0, 1.0)) > 0.0);
    }

    #[test]
    fn a_host_that_tells_nothing_gets_hroc() {
        let mut chooser = Chooser::new();
        let arms = (0..20)
            .map(|_| chooser.next(view(1.0)).arm)
            .collect::<Vec<_>>();
        assert_eq!(arms[0], Arm::Frustum);
        assert!(arms[6..].iter().all(|arm| *arm == Arm::Groups));
    }

    #[test]
    fn nobody_follows_the_frustum_without_knowing_what_shows() {
        let mut rng = fastrand::Rng::with_seed(2);
        let mut chooser = Chooser::new();
        let mut last: Option<Plan> = None;
        let mut switches = 0;
        for frame in 0..5000 {
            let plan = chooser.next(view(1.0 + rng.f64()));
            if let Some(last) = last.filter(|last| last.arm == Arm::Frustum && plan.arm != last.arm)
            {
                assert!(last.hands_over);
                switches += 1;
            }
            last = Some(plan);
            chooser.took(frame, 0.1 + 30.0 * rng.f64());
        }
        assert!(switches > 50, "{switches}");
    }
}
