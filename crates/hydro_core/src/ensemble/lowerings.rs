//! The lowerings of an ensemble: blocks of lanes on all cores, watched while they run.

use rayon::prelude::*;

use super::measures::{Measures, MEASURES};
use super::member::{Condition, Drawn};
use super::requirement::{Moment, Watch};
use super::trial::Trial;
use super::verdict::{graver, Verdict};
use crate::error::{refuse, Error};
use crate::lanes::{with_registers, with_single_registers, LaneScalar, LaneWork, Precision, Single, Width};
use crate::mast::{Extended, Lift, LiftName, Mast, Physics, Thesis, POSITION, STATES};
use crate::outputs::{Readings, OUTPUTS};
use crate::run::blocks::{alike, scattered};
use crate::run::closed_loop::{ClosedLoop, Controller, Order, Seat};
use crate::run::drive::Drive;
use crate::run::sensing::Misread;
use crate::run::ticks::{Clock, Oil, Stopped, Ticks, Warmer};
use crate::run::{Interrupt, Lifts};
use crate::scalar::Mask;
use crate::sensors::{PRESSURE_STEP, TEMPERATURE_STEP};
use crate::solver::fixed::ValveSteps;
use crate::solver::vectors::{widest, Work};

/// Makes a controller from its numbers.
pub type Make<'a> = &'a (dyn Fn(&[f64]) -> Result<Box<dyn Controller>, Error> + Sync);

/// A lift has landed this near the lower end of its stroke [m]: what it does there is not the controller's.
const LANDED_M: f64 = 5e-3;

/// What became of a member.
#[derive(Debug, Clone)]
pub struct Outcome {
    pub verdict: Verdict,
    /// The margin of each requirement; then, lift by lift, [`MEASURES`].
    pub numbers: Vec<f64>,
}

/// A member's run, a row a tick.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// (ticks, [`OUTPUTS`]), row-major: the truth, not what the sensors read.
    pub outputs: Vec<f64>,
    pub orders: Vec<Order>,
    /// The speed asked for [mm/s].
    pub request: Vec<i32>,
}

impl Trial {
    /// Of a member that there cannot be.
    fn nothing(&self) -> Outcome {
        Outcome { verdict: Verdict::OutOfBounds, numbers: vec![f64::NAN; self.numbers()] }
    }

    /// Runs members, given by the values of their columns (row-major) and their sequences of noise.
    ///
    /// A member whose values are out of bounds or make no controller, or whose run ceases to be finite, has a verdict
    /// that says so.
    ///
    /// # Errors
    /// A width that is not here, an interrupt.
    pub fn run(
        &self,
        columns: &[f64],
        streams: &[u64],
        make: Make,
        width: Width,
        interrupt: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<Outcome>, Error> {
        let here = |width: &Width| width.is_here();
        if !self.precision.widths().iter().copied().filter(here).any(|known| known == width) {
            let known = self.precision.widths().iter().copied().filter(here);
            let known: Vec<String> = known.map(|width| width.lanes().to_string()).collect();
            return refuse(
                "lanes",
                width.lanes(),
                &format!("{}: this processor has no registers for others", known.join(" or ")),
            );
        }
        let per = self.makeup.columns.len();
        let drawn: Vec<Option<Drawn>> = streams
            .par_iter()
            .enumerate()
            .map(|(k, &stream)| self.makeup.member(&columns[k * per..(k + 1) * per], stream, self.ticks, self.tick_s))
            .collect();
        // Lanes of a block share how their valves are stepped, so each block holds members that are stepped alike:
        // how a member is, is its own.
        let h = self.tick_s / self.substeps as f64;
        let steps = |member: &Drawn| match self.precision {
            Precision::Double => self.makeup.valve_steps::<f64>(member, h),
            Precision::Single => self.makeup.valve_steps::<Single>(member, h),
        };
        let steps: Vec<Option<ValveSteps>> = drawn.iter().map(|member| member.as_ref().map(steps)).collect();
        let blocks = alike(&steps, width.lanes());
        let found: Vec<Result<Vec<Outcome>, Error>> = blocks
            .par_iter()
            .map(|places| {
                let members: Vec<&Drawn> = places.iter().filter_map(|&k| drawn[k].as_ref()).collect();
                let block = Block { trial: self, members, make, interrupt, trace: None };
                match self.precision {
                    Precision::Double => with_registers(width, block),
                    Precision::Single => with_single_registers(width, block),
                }
            })
            .collect();
        let mut outcomes = vec![self.nothing(); drawn.len()];
        scattered(&blocks, found, &mut outcomes)?;
        Ok(outcomes)
    }

    /// One member by itself, with its trajectory; its outcome has the bits of [`Trial::run`].
    ///
    /// # Errors
    /// As of [`Trial::run`]; values out of bounds, or that make no controller.
    pub fn trace(
        &self,
        columns: &[f64],
        stream: u64,
        make: Make,
        interrupt: Interrupt,
    ) -> Result<(Outcome, Trace), Error> {
        let Some(drawn) = self.makeup.member(columns, stream, self.ticks, self.tick_s) else {
            return refuse("columns", format!("{columns:?}"), "within the bounds of what they vary");
        };
        let mut trace = Trace { request: drawn.request.clone(), ..Trace::default() };
        let block = Block { trial: self, members: vec![&drawn], make, interrupt, trace: Some(&mut trace) };
        let outcome = match self.precision {
            Precision::Double => LaneWork::<1>::run::<f64>(block),
            Precision::Single => LaneWork::<1>::run::<Single>(block),
        }?
        .remove(0);
        Ok((outcome, trace))
    }
}

/// Members side by side; a lane without one repeats the last.
struct Block<'a, 'm> {
    trial: &'a Trial,
    members: Vec<&'m Drawn>,
    make: Make<'a>,
    interrupt: Interrupt<'a>,
    trace: Option<&'a mut Trace>,
}

impl<const N: usize> LaneWork<N> for Block<'_, '_> {
    type Output = Result<Vec<Outcome>, Error>;
    fn run<S: LaneScalar<N>>(self) -> Self::Output {
        match self.trial.makeup.lifts {
            Lifts::Both => self.of_lifts::<S, N, 2>(LiftName::BOTH),
            Lifts::One(lift) => self.of_lifts::<S, N, 1>([lift]),
        }
    }
}

impl Block<'_, '_> {
    /// A number of each member, in lanes.
    fn each<S: LaneScalar<N>, const N: usize>(&self, f: impl Fn(&Drawn) -> f64) -> S {
        S::from_lanes(std::array::from_fn(|lane| f(self.members[lane.min(self.members.len() - 1)])))
    }

    fn of_lifts<S: LaneScalar<N>, const N: usize, const L: usize>(
        self,
        which: [LiftName; L],
    ) -> Result<Vec<Outcome>, Error> {
        let load = self.each(|m| m.condition(Condition::Load));
        let (lifts, effects) = self.trial.makeup.truck.build(which, load, |k, _| self.each(|m| m.values[k]))?;
        if effects.is_empty() {
            self.through::<S, _, N, L>(which, lifts, Thesis)
        } else {
            let physics = Extended::new(&effects, &lifts);
            self.through::<S, _, N, L>(which, lifts, physics)
        }
    }

    fn seat<'s>(&self, drawn: &'s Drawn) -> Result<Seat<'s>, Error> {
        let steps = |condition: Condition, step: f64| (drawn.condition(condition) / step).round() as i32;
        let mut sensors = drawn.sensors(self.trial.makeup.seed);
        sensors.misread = Misread {
            encoder_factor: drawn.condition(Condition::EncoderFactor),
            pressure_offset: steps(Condition::PressureOffset, PRESSURE_STEP),
            temperature_offset: steps(Condition::TemperatureOffset, TEMPERATURE_STEP),
        };
        Ok(Seat {
            controller: (self.make)(&drawn.controller)?,
            sensors,
            request: &drawn.request,
            delay: drawn.condition(Condition::Delay).round() as usize,
        })
    }

    fn through<S: LaneScalar<N>, X: Physics<S>, const N: usize, const L: usize>(
        mut self,
        which: [LiftName; L],
        lifts: [Lift<S>; L],
        physics: X,
    ) -> Result<Vec<Outcome>, Error> {
        let trial = self.trial;
        let warmer = Warmer { by: self.each(|m| m.condition(Condition::OilTemperature)), warming: None };
        let starts = [Condition::StartFree, Condition::StartMain];
        let from = which.map(|lift| self.each(|m| m.condition(starts[usize::from(lift == LiftName::Main)])));
        let time: Vec<f64> = (0..trial.ticks).map(|k| k as f64 * trial.tick_s).collect();
        let oil = vec![0.0; trial.ticks];
        let clock = Clock { time: &time, oil_temperature_degc: &oil };
        let landed = std::array::from_fn(|k| lifts[k].stop.lower + S::constant(LANDED_M));
        let (mast, start) = Mast::at_rest(lifts, physics, from, [S::zero(); L], warmer.at(&clock, 0));
        let made: Vec<Result<Seat, Error>> = self.members.iter().map(|drawn| self.seat(drawn)).collect();
        let refused = made.iter().find_map(|seat| seat.as_ref().err());
        if let (Some(error), true) = (refused, self.trace.is_some()) {
            return Err(error.clone());
        }
        let seated: Vec<bool> = made.iter().map(Result::is_ok).collect();
        let mut made = made.into_iter();
        let seats = std::array::from_fn(|_| made.next().and_then(Result::ok).unwrap_or_else(Seat::idle));
        let readings = Readings::new(&which, trial.makeup.truck.effects());
        let inner = ClosedLoop::<S, N, L>::new(which, &trial.makeup.truck, seats);
        let inner = if self.trace.is_some() { inner.remembering() } else { inner };
        let mut drive = Watched::new(trial, which, inner, &readings, landed);
        let last = [time[time.len() - 1]];
        let mut outputs = Vec::new();
        let tracing = self.trace.is_some();
        let mut record = |_, x: &[S]| {
            if tracing {
                let x: Vec<f64> = x.iter().map(|x| x.lanes()[0]).collect();
                outputs.extend(readings.read(&x));
            }
        };
        let ticks = Ticks {
            mast,
            drive: &mut drive,
            clock,
            oil: Oil::Warmer(warmer),
            start: &start,
            wanted: if tracing { &time } else { &last },
            substeps: trial.substeps,
            record: &mut record,
            carry_on: true,
            interrupt: self.interrupt,
        };
        match widest(ticks) {
            Ok(_) => {}
            // In every lane some state is not finite, and no tick is left in which that would be seen.
            Err(Stopped::NotFinite { .. }) => drive.finite = S::one().lt(S::zero()),
            Err(Stopped::Interrupted { time_s }) => return Err(Error::Interrupted { time_s }),
        }
        if let Some(trace) = &mut self.trace {
            trace.outputs = outputs;
            trace.outputs.resize(trial.ticks * OUTPUTS.len(), f64::NAN);
            trace.orders = drive.inner.orders(0);
            trace.orders.resize(trial.ticks, Order::default());
        }
        let mut outcomes = drive.outcomes(self.members.len());
        for (outcome, _) in outcomes.iter_mut().zip(seated).filter(|(_, seated)| !seated) {
            *outcome = trial.nothing();
        }
        Ok(outcomes)
    }
}

/// Where a signal stands among the states, with factors.
type Channel = Vec<(usize, f64)>;

/// Travel of the forks over that of a lift's position, as the outputs have both.
fn forks_per_output(lift: LiftName) -> f64 {
    let factor = |name: &str| {
        let output = OUTPUTS.iter().find(|output| output.name == name).expect("the table has it");
        output.of.iter().find_map(|&(of, _, factor)| (of == lift).then_some(factor)).expect("it has this lift")
    };
    factor("fork_height_m") / factor(&format!("position_{}_m", lift.as_str()))
}

/// A closed loop with an eye on it.
struct Watched<'a, S: LaneScalar<N>, const N: usize, const L: usize> {
    inner: ClosedLoop<'a, S, N, L>,
    places: [usize; L],
    /// Velocity, pressure and position of each lift.
    channels: [[Channel; 3]; L],
    /// Downward speed of the forks over each lift's velocity.
    forks: [f64; L],
    /// Below this cylinder position a lift has landed.
    landed: [S; L],
    watches: Vec<(usize, Watch<S>)>,
    measures: [Measures<S>; L],
    /// Lanes whose lift still moves freely and is finite.
    counted: [S::Mask; L],
    finite: S::Mask,
    request: S,
    since: S,
}

impl<'a, S: LaneScalar<N>, const N: usize, const L: usize> Watched<'a, S, N, L> {
    fn new(
        trial: &Trial,
        which: [LiftName; L],
        inner: ClosedLoop<'a, S, N, L>,
        readings: &Readings,
        landed: [S; L],
    ) -> Self {
        let channel = |name: &str, lift: LiftName| -> Channel {
            let name = name.replace("LIFT", lift.as_str());
            let k = OUTPUTS.iter().position(|output| output.name == name).expect("the table has it");
            readings.of(k).collect()
        };
        let names = ["velocity_LIFT_m_s", "pressure_LIFT_pa", "position_LIFT_m"];
        let all = S::zero().lt(S::one());
        Watched {
            inner,
            places: which.map(|lift| usize::from(lift == LiftName::Main)),
            channels: which.map(|lift| names.map(|name| channel(name, lift))),
            forks: which.map(|lift| -forks_per_output(lift)),
            landed,
            watches: trial.requirements.iter().map(|&r| (r.lift, Watch::new(r, trial.tick_s))).collect(),
            measures: std::array::from_fn(|_| Measures::new(trial.settling, trial.tick_s, trial.followed)),
            counted: [all; L],
            finite: all,
            request: S::zero(),
            since: S::zero(),
        }
    }

    /// Of the first `count` lanes.
    fn outcomes(&self, count: usize) -> Vec<Outcome> {
        let margins: Vec<[f64; N]> = self.watches.iter().map(|(_, watch)| watch.margin().lanes()).collect();
        let measures: Vec<[f64; N]> = self.measures.iter().flat_map(|m| m.finish().map(S::lanes)).collect();
        let growth = MEASURES.iter().position(|(name, ..)| *name == "growth").expect("the table has it");
        let alive = S::select(self.finite, S::one(), S::zero()).lanes();
        (0..count)
            .map(|lane| {
                let mut verdict = if alive[lane] == 1.0 { Verdict::Stable } else { Verdict::NotFinite };
                for ((lift, watch), margin) in self.watches.iter().zip(&margins) {
                    if margin[lane] < 0.0 {
                        let grew = measures[lift * MEASURES.len() + growth][lane];
                        verdict = graver(verdict, watch.broken(grew));
                    }
                }
                let numbers = margins.iter().chain(&measures).map(|all| all[lane]).collect();
                Outcome { verdict, numbers }
            })
            .collect()
    }
}

impl<S: LaneScalar<N>, const N: usize, const L: usize> Drive<S, L> for Watched<'_, S, N, L> {
    fn known_ahead(&self) -> bool {
        self.inner.known_ahead()
    }

    fn tick(&mut self, k: usize, x: &[S], oil_temperature_degc: S) {
        self.inner.tick(k, x, oil_temperature_degc);
        widest(Look { watched: self, k, x });
    }

    fn command(&self, k: usize) -> [S; L] {
        self.inner.command(k)
    }
}

/// Thousandths: m/s of mm/s, A of mA.
#[inline(always)]
fn thousandths<S: LaneScalar<N>, const N: usize>(value: S::Integer) -> S {
    S::of_integer(value) * S::constant(1e-3)
}

/// One tick looked at, with the widest vectors.
struct Look<'w, 'a, 'x, S: LaneScalar<N>, const N: usize, const L: usize> {
    watched: &'w mut Watched<'a, S, N, L>,
    k: usize,
    x: &'x [S],
}

impl<S: LaneScalar<N>, const N: usize, const L: usize> Work for Look<'_, '_, '_, S, N, L> {
    type Number = S;
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Look { watched, k, x } = self;
        let request = thousandths::<S, N>(watched.inner.request(k));
        let step = request - watched.request;
        let same = S::zero().lt(step.abs()).not();
        let since = if k == 0 { S::zero() } else { S::select(same, watched.since + S::one(), S::zero()) };
        (watched.request, watched.since) = (request, since);
        let mut moments = [None; L];
        for l in 0..L {
            let mut read = [S::zero(); 3];
            for (value, channel) in read.iter_mut().zip(&watched.channels[l]) {
                for &(place, factor) in channel {
                    *value = *value + S::constant(factor) * x[place];
                }
            }
            let [velocity, pressure, position] = read;
            let lift = watched.places[l];
            let order = watched.inner.order(k);
            let (reference, current) =
                (thousandths::<S, N>(order.reference[lift]), thousandths::<S, N>(order.current[lift]));
            let finite = velocity.is_finite().and(pressure.is_finite());
            watched.finite = watched.finite.and(finite);
            let aloft = x[l * STATES + POSITION].lt(watched.landed[l]).not();
            watched.counted[l] = watched.counted[l].and(aloft).and(watched.finite);
            let speed = S::constant(watched.forks[l]) * velocity;
            let moment = Moment { speed, error: speed - reference, pressure, position, current, request, step, since };
            watched.measures[l].see(k, &moment, watched.counted[l]);
            moments[l] = Some(moment);
        }
        for (lift, watch) in &mut watched.watches {
            if let Some(moment) = &moments[*lift] {
                watch.see(k, moment, watched.counted[*lift]);
            }
        }
    }
}

#[cfg(test)]
#[path = "../../tests/common/mod.rs"]
mod common;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::measures::Settling;
    use crate::ensemble::member::{Makeup, DEFAULTS};
    use crate::lanes::Lanes;
    use crate::mast::VELOCITY;
    use crate::scalar::Scalar;
    use crate::truck::Truck;

    const TICKS: usize = 20;

    /// Four lanes that stand still; of one the velocity is what is given, from a tick on.
    fn watched(bad: Option<(usize, usize, f64)>) -> Vec<Outcome> {
        let lifts = Lifts::One(LiftName::Free);
        let truck = Truck::from_values(common::thesis_values()).unwrap();
        let makeup = Makeup::new(truck, lifts, DEFAULTS, vec![(0.0, 0.0)], vec![], vec![], 1).unwrap();
        let settling = Settling { after_s: 0.1, band_m_s: 0.05 };
        let precision = Precision::Double;
        let trial = Trial {
            makeup,
            requirements: vec![],
            settling,
            tick_s: 0.02,
            ticks: TICKS,
            substeps: 1,
            precision,
            followed: true,
        };
        let which = [LiftName::Free];
        let readings = Readings::new(&which, trial.makeup.truck.effects());
        let seats = std::array::from_fn(|_| Seat::idle());
        let inner = ClosedLoop::<Lanes<4>, 4, 1>::new(which, &trial.makeup.truck, seats);
        let landed = [Lanes::constant(-1.0)];
        let mut drive = Watched::new(&trial, which, inner, &readings, landed);
        for k in 0..TICKS {
            let mut x = vec![Lanes::<4>::zero(); STATES];
            if let Some((lane, from, velocity)) = bad.filter(|(_, from, _)| k >= *from) {
                assert!(from > 0);
                x[VELOCITY].0[lane] = velocity;
            }
            drive.tick(k, &x, Lanes::constant(40.0));
        }
        drive.outcomes(4)
    }

    #[test]
    fn members_that_all_cease_to_be_finite_at_once_have_that_verdict_however_many_they_are() {
        let lifts = Lifts::One(LiftName::Free);
        let truck = Truck::from_values(common::thesis_values()).unwrap();
        let makeup = Makeup::new(truck, lifts, DEFAULTS, vec![(0.0, 0.5)], vec![], vec![], 1).unwrap();
        let drawn = makeup.member(&[], 0, TICKS, 0.02).unwrap();
        let settling = Settling { after_s: 0.1, band_m_s: 0.05 };
        let precision = Precision::Double;
        let trial = Trial {
            makeup,
            requirements: vec![],
            settling,
            tick_s: 0.02,
            ticks: TICKS,
            substeps: 1,
            precision,
            followed: true,
        };
        let make: Make = &|_| Ok(Box::new(crate::ensemble::open_loop::OpenLoop));
        let block =
            |count| Block { trial: &trial, members: vec![&drawn; count], make, interrupt: &|| false, trace: None };
        for found in [without_weight::<f64, 1>(block(1)), without_weight::<Lanes<4>, 4>(block(4))] {
            assert!(found.iter().all(|outcome| outcome.verdict == Verdict::NotFinite), "{}", found.len());
        }
    }

    /// With a load that is not a number, which no value within its bounds is.
    fn without_weight<S: LaneScalar<N>, const N: usize>(block: Block) -> Vec<Outcome> {
        let which = [LiftName::Free];
        let lifts = block.trial.makeup.truck.lifts(which, S::constant(f64::NAN), |_, value| S::constant(value));
        block.through::<S, _, N, 1>(which, lifts, Thesis).unwrap()
    }

    #[test]
    fn a_member_that_ceases_to_be_finite_has_that_verdict_and_disturbs_no_other() {
        let bits = |outcome: &Outcome| outcome.numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let good = watched(None);
        assert!(good.iter().all(|outcome| outcome.verdict == Verdict::Stable));
        for velocity in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let found = watched(Some((2, 5, velocity)));
            for (lane, (one, other)) in found.iter().zip(&good).enumerate() {
                if lane == 2 {
                    assert_eq!(one.verdict, Verdict::NotFinite);
                    // What was measured before counts; nothing after does.
                    assert!(one.numbers.iter().all(|x| !x.is_infinite()));
                } else {
                    assert_eq!((one.verdict, bits(one)), (Verdict::Stable, bits(other)));
                }
            }
        }
    }
}
