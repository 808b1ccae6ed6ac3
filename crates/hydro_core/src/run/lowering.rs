//! Trucks lowered by their controllers, as many at a time as the processor has registers for.

use rayon::prelude::*;

use super::blocks::{alike, scattered, valve_steps};
use super::closed_loop::{ClosedLoop, Order, Seat};
use super::ticks::{substep_s, Clock, Oil, Stopped, Ticks, Warmer};
use super::{Interrupt, Lifts};
use crate::error::{refuse, Error};
use crate::lanes::{with_registers, LaneScalar, LaneWork, Precision};
use crate::mast::{Extended, Lift, LiftName, Mast, Physics, Thesis};
use crate::outputs::{Readings, OUTPUTS};
use crate::solver::vectors::widest;
use crate::truck::Truck;

/// One truck with its controller.
pub struct Member<'a> {
    pub truck: &'a Truck,
    pub load_kg: f64,
    /// Added to the clock's oil temperature [K].
    pub warmer: f64,
    /// Cylinder positions at the start [m], free and main.
    pub start: [f64; 2],
    pub seat: Seat<'a>,
}

/// A member's run, a row a tick.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// (ticks, [`OUTPUTS`]), row-major: the truth, not what the sensors read.
    pub outputs: Vec<f64>,
    pub orders: Vec<Order>,
}

/// Lowers every member through the ticks of `clock`, on all cores. A member's bits depend neither on the others nor
/// on the number of threads; a truck that runs away has outputs that are not finite, and disturbs no other.
///
/// # Errors
/// Trucks whose parameters have different names, no ticks, an interrupt.
pub fn lower(
    members: Vec<Member>,
    lifts: Lifts,
    clock: Clock,
    substeps: usize,
    interrupt: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Trace>, Error> {
    let Some(first) = members.first() else { return Ok(Vec::new()) };
    let names = first.truck.names();
    if let Some(k) = members.iter().position(|member| member.truck.names() != names) {
        return refuse(
            &format!("truck {k}"),
            "of another make than the first",
            "of the same effects and numbers of knots, to run beside it",
        );
    }
    if clock.time.is_empty() || clock.time.len() != clock.oil_temperature_degc.len() || !(1..=1000).contains(&substeps)
    {
        return refuse(
            "clock",
            format!("{} ticks of {substeps} substeps", clock.time.len()),
            "a time and an oil temperature for each of one or more ticks of 1 to 1000 substeps",
        );
    }
    for (k, member) in members.iter().enumerate() {
        if let Some(start) = member.start.iter().find(|start| !start.is_finite()) {
            return refuse(&format!("start of truck {k}"), start, "finite");
        }
    }
    let h = substep_s(clock.time, substeps);
    let steps = |member: &Member| Some(valve_steps(lifts, h, |lift| member.truck.lifts([lift], 0.0, |_, value| value)));
    let steps: Vec<_> = members.iter().map(steps).collect();
    let width = Precision::Double.widest();
    let places = alike(&steps, width.lanes());
    let mut members: Vec<Option<Member>> = members.into_iter().map(Some).collect();
    let groups: Vec<Vec<Member>> =
        places.iter().map(|places| places.iter().filter_map(|&k| members[k].take()).collect()).collect();
    let run = |members| with_registers(width, Group { members, lifts, clock, substeps, interrupt });
    let found: Vec<Result<Vec<Trace>, Error>> = groups.into_par_iter().map(run).collect();
    let mut traces = vec![Trace::default(); members.len()];
    scattered(&places, found, &mut traces)?;
    Ok(traces)
}

/// At most as many members as lanes; a lane without one idles.
struct Group<'a> {
    members: Vec<Member<'a>>,
    lifts: Lifts,
    clock: Clock<'a>,
    substeps: usize,
    interrupt: Interrupt<'a>,
}

impl<const N: usize> LaneWork<N> for Group<'_> {
    type Output = Result<Vec<Trace>, Error>;
    fn run<S: LaneScalar<N>>(self) -> Self::Output {
        match self.lifts {
            Lifts::Both => of_lifts::<S, N, 2>(self, LiftName::BOTH),
            Lifts::One(lift) => of_lifts::<S, N, 1>(self, [lift]),
        }
    }
}

fn of_lifts<S: LaneScalar<N>, const N: usize, const L: usize>(
    group: Group,
    which: [LiftName; L],
) -> Result<Vec<Trace>, Error> {
    let members = &group.members;
    let of = |lane: usize| &members[lane.min(members.len() - 1)];
    let each = |f: &dyn Fn(&Member) -> f64| S::from_lanes(std::array::from_fn(|lane| f(of(lane))));
    let values: Vec<Vec<f64>> = members.iter().map(|member| member.truck.values()).collect();
    let value = |k: usize, _: f64| S::from_lanes(std::array::from_fn(|lane| values[lane.min(values.len() - 1)][k]));
    let (lifts, effects) = members[0].truck.build(which, each(&|m| m.load_kg), value)?;
    let start = which.map(|lift| each(&|m| m.start[usize::from(lift == LiftName::Main)]));
    let warmer = Warmer { by: each(&|m| m.warmer), warming: None };
    if effects.is_empty() {
        through(group, which, lifts, Thesis, start, warmer)
    } else {
        let physics = Extended::new(&effects, &lifts);
        through(group, which, lifts, physics, start, warmer)
    }
}

fn through<S: LaneScalar<N>, X: Physics<S>, const N: usize, const L: usize>(
    group: Group,
    which: [LiftName; L],
    lifts: [Lift<S>; L],
    physics: X,
    from: [S; L],
    warmer: Warmer<S>,
) -> Result<Vec<Trace>, Error> {
    let Group { members, clock, substeps, interrupt, .. } = group;
    let (count, truck) = (members.len(), members[0].truck);
    let (mast, start) = Mast::at_rest(lifts, physics, from, [S::zero(); L], warmer.at(&clock, 0));
    let mut seats = members.into_iter().map(|member| member.seat);
    let seats = std::array::from_fn(|_| seats.next().unwrap_or_else(Seat::idle));
    let mut drive = ClosedLoop::<S, N, L>::new(which, truck, seats).remembering();
    let readings = Readings::new(&which, truck.effects());
    let mut traces = vec![Trace::default(); count];
    let mut record = |_, x: &[S]| {
        for k in 0..OUTPUTS.len() {
            // A lift that is not simulated is not a number.
            let mut terms = readings.of(k).peekable();
            let from = if terms.peek().is_some() { 0.0 } else { f64::NAN };
            let all = terms.fold(S::constant(from), |sum, (place, factor)| sum + S::constant(factor) * x[place]);
            for (trace, value) in traces.iter_mut().zip(all.lanes()) {
                trace.outputs.push(value);
            }
        }
    };
    let ticks = Ticks {
        mast,
        drive: &mut drive,
        clock,
        oil: Oil::Warmer(warmer),
        start: &start,
        wanted: clock.time,
        substeps,
        record: &mut record,
        carry_on: true,
        interrupt,
    };
    match widest(ticks) {
        Ok(_) | Err(Stopped::NotFinite { .. }) => {}
        Err(Stopped::Interrupted { time_s }) => return Err(Error::Interrupted { time_s }),
    }
    for (lane, trace) in traces.iter_mut().enumerate() {
        trace.outputs.resize(clock.time.len() * OUTPUTS.len(), f64::NAN);
        trace.orders = drive.orders(lane);
        trace.orders.resize(clock.time.len(), Order::default());
    }
    Ok(traces)
}
