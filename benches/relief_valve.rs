//! A second ensemble that nobody here made: the pressure relief valve with impacts.
//!
//!     cargo bench --bench relief_valve -- OUT lanes=16 members=1024
//!
//! Dimensionless displacement, velocity and pressure (Hős & Champneys, Physica D 241, 2012, 2068–2076; as an
//! ensemble Nagy, Plavecz & Hegedűs, Commun. Nonlinear Sci. Numer. Simul. 112, 2022, 106521):
//!
//!     y1' = y2,   y2' = −κ y2 − (y1 + δ) + y3,   y3' = β (q − y1 √y3),   y1 ≥ 0,
//!     y2 → −r y2 where y1 = 0 and y2 < 0,
//!
//! κ = 1.25, δ = 10, β = 20, r = 0.8, from (0.2, 0, 0); each member has a flow rate q, evenly spaced from 0.2 to 10.
//! 2048 extrema of the displacement and impacts are passed over, the next 64 kept: a bifurcation diagram. A member
//! whose extrema no longer change has come to rest, and is done.
//!
//! Dormand & Prince 5(4) (1980) with a relative and absolute tolerance of 1e-10. Each lane has its own time and step: a
//! step over an event is tried again to where the cubic Hermite polynomial through its ends has the root, while the
//! other lanes go on; a lane whose member is done takes the next one. Impacts that follow each other ever faster
//! (Nordmark & Piiroinen, Nonlinear Dyn. 58, 2009) end on the seat: slower than [`STICKS`] the valve stays there
//! until the pressure reaches δ, which is known in closed form, t = (δ − y3)/(β q).
//!
//! OUT is text: a line a member, q and its 64 values. Printed: seconds of one core, attempted steps.

use std::fmt::Write;
use std::time::Instant;

use hydro_core::lanes::{with_eight, with_sixteen, LaneScalar, LaneWork};
use hydro_core::scalar::{Mask, Scalar};
use hydro_core::solver::vectors::{widest, Work};

const KAPPA: f64 = 1.25;
const DELTA: f64 = 10.0;
const BETA: f64 = 20.0;
const RESTITUTION: f64 = 0.8;
const FLOW_RATES: (f64, f64) = (0.2, 10.0);
const START: [f64; 3] = [0.2, 0.0, 0.0];

const PASSED_OVER: usize = 2048;
const KEPT: usize = 64;
/// Extrema that differ by less are those of a valve at rest.
const AT_REST: f64 = 1e-9;

const TOLERANCE: f64 = 1e-10;
const FIRST_STEP: f64 = 0.01;
/// How near y1 = 0 an impact, and y2 = 0 an extremum is found. An extremum's height is off by the square of it.
const NEAR_SEAT: f64 = 1e-12;
const NEAR_EXTREMUM: f64 = 1e-7;
/// Speed after an impact below which the valve stays on its seat: it would rise by 5e-12.
const STICKS: f64 = 1e-5;
const SAFETY: f64 = 0.9;
const STEP_CHANGES: (f64, f64) = (0.2, 5.0);
const LEAST_ERROR: f64 = 1e-12;
const NEWTON: usize = 8;
/// Attempted steps a member takes at most.
const MOST_ATTEMPTS: f64 = 1e7;

/// Dormand & Prince (1980), Table 2; the last row is the solution's, and the next step's first stage.
const A: [[f64; 6]; 6] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Fifth order less fourth.
const ERROR: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

#[inline(always)]
fn rates<S: Scalar>(y: [S; 3], q: S) -> [S; 3] {
    let root = y[2].max(S::zero()).sqrt();
    let force = y[2] - (y[0] + S::constant(DELTA));
    [y[1], force - S::constant(KAPPA) * y[1], S::constant(BETA) * (q - y[0] * root)]
}

/// Where in a step, as a share of it, the cubic through values and slopes at its ends falls to zero, if its sign is such
/// that it is positive before: Newton's method from the far end, so that a valve that leaves its seat and comes back is
/// found where it comes back, and halving where Newton's method leaves the bracket.
#[inline(always)]
fn root<S: Scalar>(before: S, slope_before: S, after: S, slope_after: S) -> S {
    let (half, two, three) = (S::constant(0.5), S::constant(2.0), S::constant(3.0));
    let rise = after - before;
    let a = slope_before + slope_after - two * rise;
    let b = three * rise - two * slope_before - slope_after;
    let (mut low, mut high) = (S::zero(), S::one());
    let mut at = S::one();
    for _ in 0..NEWTON {
        let value = ((a * at + b) * at + slope_before) * at + before;
        let slope = (three * a * at + two * b) * at + slope_before;
        let past = value.lt(S::zero());
        high = S::select(past, at, high);
        low = S::select(past, low, at);
        let flat = slope.abs().lt(S::constant(1e-300));
        let newton = at - value / S::select(flat, S::one(), slope);
        let within = low.lt(newton).and(newton.lt(high)).and(flat.not());
        at = S::select(within, newton, half * (low + high));
    }
    at
}

/// The lanes on their way.
struct Flight<S> {
    q: S,
    y: [S; 3],
    /// Rates at y.
    k: [S; 3],
    /// What the next step tries, and what it would try were there no event.
    h: S,
    full: S,
    /// 1 while the valve opens, −1 while it closes.
    rising: S,
}

/// What a lane's member has shown so far.
#[derive(Clone)]
struct Log {
    member: usize,
    events: usize,
    before: f64,
    kept: Vec<f64>,
}

struct Ensemble {
    members: usize,
}

impl Ensemble {
    fn flow_rate(&self, member: usize) -> f64 {
        let (least, most) = FLOW_RATES;
        least + (most - least) * member as f64 / (self.members - 1).max(1) as f64
    }
}

struct Block<'a, S, const N: usize> {
    ensemble: &'a Ensemble,
    flight: Flight<S>,
}

/// By member its values; how many steps were attempted for all of them.
type Diagram = (Vec<Vec<f64>>, f64);

impl<S: LaneScalar<N>, const N: usize> Work for Block<'_, S, N> {
    type Number = S;
    type Output = Diagram;

    #[inline(always)]
    fn run(self) -> Diagram {
        let Block { ensemble, mut flight } = self;
        let mut diagram = vec![Vec::new(); ensemble.members];
        let mut logs = vec![Log { member: usize::MAX, events: 0, before: f64::INFINITY, kept: Vec::new() }; N];
        let (mut next, mut left, mut attempts) = (0, ensemble.members, 0.0);
        for (lane, log) in logs.iter_mut().enumerate() {
            begin(ensemble, &mut flight, lane, log, &mut next);
        }
        while left > 0 {
            let (impact, extremum) = flight.step();
            attempts += logs.iter().filter(|log| log.member != usize::MAX).count() as f64;
            assert!(attempts < MOST_ATTEMPTS * ensemble.members as f64, "a member does not end");
            if impact.or(extremum).any() {
                let flag = |mask| S::select(mask, S::one(), S::zero()).lanes();
                let (hit, turned) = (flag(impact), flag(extremum));
                for lane in 0..N {
                    let log = &mut logs[lane];
                    if hit[lane] + turned[lane] == 0.0 || log.member == usize::MAX {
                        continue;
                    }
                    let height = if hit[lane] > 0.0 { bounce(&mut flight, lane) } else { turn(&mut flight, lane) };
                    if log.shows(height) {
                        diagram[log.member] = std::mem::take(&mut log.kept);
                        left -= 1;
                        begin(ensemble, &mut flight, lane, log, &mut next);
                    }
                }
            }
        }
        (diagram, attempts)
    }
}

impl Log {
    /// One more extremum or impact; true if the member is done.
    fn shows(&mut self, height: f64) -> bool {
        if self.events >= PASSED_OVER {
            self.kept.push(height);
        }
        self.events += 1;
        if height > AT_REST && (height - self.before).abs() < AT_REST {
            self.kept.resize(KEPT, height);
        }
        self.before = height;
        self.kept.len() == KEPT
    }
}

impl<S: Scalar> Flight<S> {
    /// One attempted step of every lane; which of them have come to an impact or an extremum.
    #[inline(always)]
    fn step(&mut self) -> (S::Mask, S::Mask) {
        let (y, q, h) = (self.y, self.q, self.h);
        let mut k = [self.k; 7];
        let mut to = y;
        for stage in 0..6 {
            for state in 0..3 {
                let mut sum = S::constant(A[stage][0]) * k[0][state];
                for earlier in 1..=stage {
                    if A[stage][earlier] != 0.0 {
                        sum = sum + S::constant(A[stage][earlier]) * k[earlier][state];
                    }
                }
                to[state] = y[state] + h * sum;
            }
            k[stage + 1] = rates(to, q);
        }
        let tolerance = S::constant(TOLERANCE);
        let mut error = S::constant(LEAST_ERROR);
        for state in 0..3 {
            let mut sum = S::constant(ERROR[0]) * k[0][state];
            for stage in 2..7 {
                sum = sum + S::constant(ERROR[stage]) * k[stage][state];
            }
            let scale = tolerance + tolerance * y[state].abs().max(to[state].abs());
            error = error.max((h * sum).abs() / scale);
        }
        let good = S::one().lt(error).not();
        let (down, up) = STEP_CHANGES;
        let change = (S::constant(SAFETY) * error.inverse_fourth_root()).clamp_to(S::constant(down), S::constant(up));

        let slopes = k[6];
        let speed = self.rising * to[1];
        let (seat, flat) = (S::constant(NEAR_SEAT), S::constant(NEAR_EXTREMUM));
        let beyond_seat = to[0].lt(-seat);
        let beyond_extremum = speed.lt(-flat);
        let beyond = good.and(beyond_seat.or(beyond_extremum));
        if beyond.any() {
            let one = S::one();
            let (rate, last) = (self.rising * h * k[0][1], self.rising * h * slopes[1]);
            let turning = root(self.rising * y[1], rate, speed, last);
            let to_seat = S::select(beyond_seat, root(y[0], h * y[1], to[0], h * to[1]), one);
            let to_extremum = S::select(beyond_extremum, turning, one);
            let nearer = h * to_seat.min(to_extremum);
            self.h = S::select(beyond, nearer, h * change);
        } else {
            self.h = h * change;
        }
        let done = good.and(beyond.not());
        // What an event cut off says nothing of how long a step may be.
        let cut = done.and(h.lt(self.full)).and(S::one().lt(change));
        self.full = S::select(beyond, self.full, S::select(cut, self.full.max(self.h), self.h));
        for state in 0..3 {
            self.y[state] = S::select(done, to[state], y[state]);
            self.k[state] = S::select(done, slopes[state], self.k[state]);
        }
        self.h = S::select(done, self.full, self.h);
        let closing = to[1].lt(S::zero());
        let impact = done.and(to[0].lt(seat)).and(closing);
        let slowing = (self.rising * slopes[1]).lt(S::zero());
        let extremum = done.and(speed.lt(flat)).and(slowing).and(impact.not());
        (impact, extremum)
    }

    /// Changes one lane: q, y, step without events, direction; the rates follow.
    fn set<const N: usize>(&mut self, lane: usize, q: f64, y: [f64; 3], full: f64, rising: f64)
    where
        S: LaneScalar<N>,
    {
        let put = |into: &mut S, value: f64| {
            let mut lanes = into.lanes();
            lanes[lane] = value;
            *into = S::from_lanes(lanes);
        };
        let slopes = rates(y, q);
        put(&mut self.q, q);
        for state in 0..3 {
            put(&mut self.y[state], y[state]);
            put(&mut self.k[state], slopes[state]);
        }
        put(&mut self.h, full);
        put(&mut self.full, full);
        put(&mut self.rising, rising);
    }
}

/// The next member into a lane; without one the lane goes on, and is not looked at.
fn begin<S: LaneScalar<N>, const N: usize>(
    ensemble: &Ensemble,
    flight: &mut Flight<S>,
    lane: usize,
    log: &mut Log,
    next: &mut usize,
) {
    *log = Log { member: usize::MAX, events: 0, before: f64::INFINITY, kept: Vec::with_capacity(KEPT) };
    flight.set(lane, ensemble.flow_rate((*next).min(ensemble.members - 1)), START, FIRST_STEP, -1.0);
    if *next < ensemble.members {
        log.member = *next;
        *next += 1;
    }
}

/// Off the seat again, or, if slower than [`STICKS`], once the pressure lifts it; the height, which is zero.
fn bounce<S: LaneScalar<N>, const N: usize>(flight: &mut Flight<S>, lane: usize) -> f64 {
    let [_, y2, y3] = flight.y.map(|state| state.lanes()[lane]);
    let (q, full) = (flight.q.lanes()[lane], flight.full.lanes()[lane]);
    let speed = -RESTITUTION * y2;
    let after = if speed < STICKS && y3 < DELTA { [0.0, 0.0, DELTA] } else { [0.0, speed, y3] };
    flight.set(lane, q, after, full, 1.0);
    0.0
}

/// The other way; the height at which the valve turned.
fn turn<S: LaneScalar<N>, const N: usize>(flight: &mut Flight<S>, lane: usize) -> f64 {
    let y = flight.y.map(|state| state.lanes()[lane]);
    let (q, full, rising) = (flight.q.lanes()[lane], flight.full.lanes()[lane], flight.rising.lanes()[lane]);
    flight.set(lane, q, y, full, -rising);
    y[0]
}

impl<const N: usize> LaneWork<N> for &Ensemble {
    type Output = Diagram;
    fn run<S: LaneScalar<N>>(self) -> Diagram {
        let zero = S::zero();
        let flight = Flight { q: zero, y: [zero; 3], k: [zero; 3], h: zero, full: zero, rising: zero };
        widest(Block::<S, N> { ensemble: self, flight })
    }
}

/// Processor time of this thread where the system tells it, else wall time: another job does not count.
struct Clock {
    wall: Instant,
    processor: Option<f64>,
}

impl Clock {
    fn start() -> Self {
        Clock { wall: Instant::now(), processor: Self::processor() }
    }

    fn processor() -> Option<f64> {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(1e-9 * text.split(' ').next()?.parse::<f64>().ok()?)
    }

    fn seconds(&self) -> f64 {
        match (self.processor, Self::processor()) {
            (Some(before), Some(now)) => now - before,
            _ => self.wall.elapsed().as_secs_f64(),
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let [out, settings @ ..] = arguments.as_slice() else {
        println!("relief_valve: give OUT lanes=1|8|16 members=N");
        return;
    };
    let option = |name: &str, usual: usize| {
        let text = settings.iter().find_map(|s| s.strip_prefix(&format!("{name}=")));
        text.map_or(usual, |t| t.parse().unwrap_or_else(|_| panic!("{name} is a number, not {t}")))
    };
    let ensemble = Ensemble { members: option("members", 1024) };
    let clock = Clock::start();
    let (diagram, attempts) = match option("lanes", 16) {
        1 => LaneWork::<1>::run::<f64>(&ensemble),
        8 => with_eight(&ensemble),
        16 => with_sixteen(&ensemble),
        other => panic!("lanes is 1, 8 or 16, not {other}"),
    };
    let seconds = clock.seconds();
    let mut text = String::new();
    for (member, kept) in diagram.iter().enumerate() {
        write!(text, "{:?}", ensemble.flow_rate(member)).expect("text takes text");
        for height in kept {
            write!(text, " {height:?}").expect("text takes text");
        }
        text.push('\n');
    }
    std::fs::write(out, text).expect("the diagram can be written");
    println!("{seconds:?} {attempts:?}");
}
