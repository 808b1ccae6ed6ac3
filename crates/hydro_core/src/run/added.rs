//! What each effect of a truck adds at the ports, moment by moment of a run: its law, as it acts.

use super::drive::{Drive, Replay};
use super::sensitivity::Case;
use super::ticks::{Clock, Oil, Ticks, Warmer};
use super::{check, commanded_names, Interrupt, Solver};
use crate::effects::{Instance, MastPorts, Term};
use crate::error::{refuse, Error};
use crate::mast::{Extended, LiftName, LiftState, Mast, STATES};
use crate::ports::{Join, PORTS};
use crate::solver::vectors::widest;
use crate::truck::Truck;

/// One effect at one port of a lift.
#[derive(Debug, Clone, PartialEq)]
pub struct Added {
    /// `main.leakage`.
    pub effect: String,
    pub lift: LiftName,
    /// Its place in [`PORTS`].
    pub port: usize,
    /// (draws, times), row-major: in a sum's unit; of a factor the relative change.
    pub values: Vec<f64>,
}

/// What the effects of the first of `draws` add while it runs through `case`, and what those of the others would add
/// in the same states: every effect at every port that it moves.
///
/// # Errors
/// As [`super::simulate`]; draws whose parameters have other names than the first's.
pub fn added(draws: &[Truck], case: &Case, substeps: usize, interrupt: Interrupt) -> Result<Vec<Added>, Error> {
    check(&case.inputs, case.wanted, Solver::Fixed { substeps })?;
    let Some(first) = draws.first() else { return Ok(Vec::new()) };
    if let Some(k) = draws.iter().position(|draw| draw.names() != first.names()) {
        return refuse(
            &format!("draw {k}"),
            "a truck of other parameters than the first",
            "the same effects and numbers of knots",
        );
    }
    let which = LiftName::BOTH;
    let (lifts, effects) = first.build(which, case.inputs.load_kg, |_, value| value)?;
    let physics = Extended::new(&effects, &lifts);
    let (clock, warmer) = (Clock::from(&case.inputs), Warmer { by: case.warmer, warming: Some(case.warming) });
    let mut drive = Replay::new(which, &case.inputs);
    let (mast, start) = Mast::at_rest(lifts, physics, case.start, drive.command(0), warmer.at(&clock, 0));
    // Of each draw its effects: which, and how many states each has.
    let terms = draws.iter().map(|draw| {
        let (lifts, effects) = draw.build(which, case.inputs.load_kg, |_, value| value)?;
        let of = |(one, place, values): (Instance, usize, Vec<f64>)| {
            (Term::new(one.kind, &values, &lifts, place), one.kind.spec().states.len())
        };
        Ok(effects.into_iter().map(of).collect::<Vec<_>>())
    });
    let terms = terms.collect::<Result<Vec<_>, Error>>()?;
    let (times, ports) = (case.wanted.len(), which.len() * PORTS.len());
    let mut found = vec![0.0; effects.len() * ports * draws.len() * times];
    let bus_of = mast.clone();
    let mut record = |row: usize, x: &[f64]| {
        let held = case.inputs.time.partition_point(|&time| time <= case.wanted[row]).saturating_sub(1);
        let state = |k: usize| LiftState::from_slice(&x[k * STATES..(k + 1) * STATES]);
        let mut bus = bus_of.bus([state(0), state(1)]);
        (bus.command, bus.oil_temperature_degc) = (case.inputs.command[held], warmer.at(&clock, held));
        for (draw, terms) in terms.iter().enumerate() {
            let mut rest = &x[which.len() * STATES..];
            for (place, (term, states)) in terms.iter().enumerate() {
                let (mine, others) = rest.split_at(*states);
                rest = others;
                let mut acting = MastPorts::<f64, 2>::quiet();
                term.act(&bus, mine, &mut acting);
                let moved = acting.lifts.iter_mut().flat_map(|lift| lift.each()).zip(PORTS.iter().cycle());
                for (port, (value, spec)) in moved.enumerate() {
                    let quiet = f64::from(u8::from(spec.join == Join::Factor));
                    found[((place * ports + port) * draws.len() + draw) * times + row] = *value - quiet;
                }
            }
        }
    };
    let ticks = Ticks {
        mast,
        drive: &mut drive,
        clock,
        oil: Oil::Warmer(warmer),
        start: &start,
        wanted: case.wanted,
        substeps,
        record: &mut record,
        carry_on: false,
        interrupt,
    };
    widest(ticks).map_err(|stopped| stopped.error(&commanded_names(&which, start.len())))?;
    let each = found.chunks_exact((draws.len() * times).max(1)).enumerate();
    let moving = each.filter(|(_, values)| values.iter().any(|&value| value != 0.0));
    let told = moving.map(|(k, values)| Added {
        effect: effects[k / ports].0.name(),
        lift: which[k % ports / PORTS.len()],
        port: k % PORTS.len(),
        values: values.to_vec(),
    });
    Ok(told.collect())
}
