//! A valve whose answer takes a time of its own for every distance: ramps, and lags that are not linear.

use super::{Effect, EffectSpec, MastPorts, Scope, StateSpec};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// u → y, dy/dt = (u − y)/τ(|u − y|), τ(d) = Σ c_k·B_k(d/range).
///
/// A time that does not depend on the distance is a lag; one in proportion to it is a ramp, whose slope is its
/// inverse. The fast path gives the valve the mean of y over its substep, as [`super::valve_lag`] does.
#[derive(Debug, Clone)]
pub struct FreeResponse<S> {
    /// [s].
    times: [S; COEFFICIENTS],
    inverse_range: S,
    place: usize,
}

const COEFFICIENTS: usize = 7;
/// Times below this [s] count as this long where they divide.
const SHORTEST: f64 = 1e-4;
/// Parts of a substep; in each the distance decays with one time constant, that of its middle.
const PARTS: usize = 4;

/// What is plausible of a coefficient [s]. Only the width counts, four of the prior's deviations; no time, which is
/// quiet, is not an end of it.
const TIME: [f64; 2] = [0.004, 0.104];

const fn time(name: &'static str, symbol: &'static str) -> ParameterSpec {
    ParameterSpec {
        name,
        symbol,
        unit: "s",
        lower: 0.0,
        upper: 1.0,
        scale: Scale::Linear,
        origin: Origin::Chosen,
        equation: "(3.13)",
        meaning: "coefficient of the time the valve takes, over the distance it has to go",
        bounds_reason: "no valve that still works takes longer",
    }
}

impl<S: Scalar> FreeResponse<S> {
    fn with(times: [S; COEFFICIENTS], range: S, place: usize) -> Self {
        FreeResponse { times, inverse_range: S::one() / range, place }
    }

    /// τ at a distance, not negative [A].
    #[inline(always)]
    fn time(&self, distance: S) -> S {
        super::spline(&self.times, distance * self.inverse_range)
    }

    /// What is left of a distance after `h` [s].
    // No closure: such would be compiled without the lanes' vectors.
    #[inline(always)]
    fn left(distance: S, time: S, h: S) -> S {
        distance * (-(h / time.max(S::constant(SHORTEST)))).exp()
    }

    /// Where the distance is left after `h` [s], and its sum over that time [A s].
    #[inline(always)]
    fn onward(&self, distance: S, h: S) -> (S, S) {
        let (half, sixth) = (S::constant(0.5), S::constant(1.0 / 6.0));
        let before = self.time(distance);
        let foreseen = Self::left(distance, before, h);
        let after = Self::left(distance, self.time(half * (distance + foreseen)), h);
        // ∫ d dt = ∫ τ dd, by Simpson's rule over the distances that are passed.
        let middle = self.time(half * (distance + after));
        let mean = sixth * (before + S::constant(4.0) * middle + self.time(after));
        (after, mean * (distance - after))
    }
}

impl<S: Scalar> Effect<S> for FreeResponse<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "free_response",
        scope: Scope::Lift,
        equation: "u at the valve = y,  time(|u - y|) dy/dt = u - y,  time(d) = sum of time_k B_k(d / range)",
        source: "de Boor (1978), A Practical Guide to Splines, chapters IX and X: cubic B-splines, here on four equal \
                 intervals; Merritt (1967), Hydraulic Control Systems, chapter 5: lag and saturation of a pilot stage",
        parameters: &[
            time("time_0", "τ0"),
            time("time_1", "τ1"),
            time("time_2", "τ2"),
            time("time_3", "τ3"),
            time("time_4", "τ4"),
            time("time_5", "τ5"),
            time("time_6", "τ6"),
            ParameterSpec {
                name: "range",
                symbol: "r",
                unit: "A",
                lower: 0.01,
                upper: 10.0,
                scale: Scale::Linear,
                origin: Origin::Given,
                equation: "(3.13)",
                meaning: "distance at which the curve ends; the time is constant beyond",
                bounds_reason: "the valve's whole current, and a step that is still one",
            },
        ],
        quiet: 0.0,
        // The range is chosen, not estimated; what is plausible must have a width all the same.
        plausible: &[TIME, TIME, TIME, TIME, TIME, TIME, TIME, [0.9, 1.1]],
        states: &[
            StateSpec { name: "answer", unit: "A", scale: 1.0, meaning: "command as far as the valve has followed it" },
            StateSpec { name: "late", unit: "A", scale: 1.0, meaning: "what the valve is given of it: its mean" },
        ],
        shows: &[],
    };

    const AMPLITUDES: usize = COEFFICIENTS;

    fn new(values: &[S], _lifts: &[Lift<S>], place: usize) -> Self {
        FreeResponse::with(std::array::from_fn(|k| values[k]), values[COEFFICIENTS], place)
    }

    fn start<const L: usize>(&self, bus: &Bus<S, L>, own: &mut [S]) {
        own.fill(bus.command[self.place]);
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>) {
        let port = &mut ports.lifts[self.place].current;
        *port = *port + (own[1] - bus.command[self.place]);
    }

    #[inline(always)]
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        let distance = bus.command[self.place] - own[0];
        let rate = S::one() / self.time(distance.abs()).max(S::constant(SHORTEST));
        rates[0] = distance * rate;
        // In continuous time the mean over no time is the value: the second term pulls it there, where the fast
        // path may have left it beside.
        rates[1] = rates[0] + (own[0] - own[1]) * rate;
    }

    const RELAXES: bool = true;

    #[inline(always)]
    fn relax<const L: usize>(&self, _from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]) {
        let (command, part) = (to.command[self.place], h * S::constant(1.0 / PARTS as f64));
        let from = command - own[0];
        let (mut distance, mut behind) = (from.abs(), S::zero());
        for _ in 0..PARTS {
            let (after, sum) = self.onward(distance, part);
            distance = after;
            behind = behind + sum;
        }
        let sign = S::select(from.lt(S::zero()), -S::one(), S::one());
        own[0] = command - sign * distance;
        own[1] = command - sign * behind / h;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    /// The answer to a step from 0 to `step` [A] after `seconds`, and what the valve was given meanwhile on average.
    fn stepped(response: &FreeResponse<f64>, step: f64, seconds: f64, h: f64) -> (f64, f64) {
        let mut bus = bus_at_rest();
        let mut own = [0.0; 2];
        response.start(&bus, &mut own);
        bus.command = [0.0, step];
        let (mut given, count) = (0.0, (seconds / h).round() as usize);
        for _ in 0..count {
            response.relax(&bus, &bus, h, &mut own);
            given += own[1] / count as f64;
        }
        (own[0], given)
    }

    #[test]
    fn one_time_for_all_distances_is_a_lag() {
        let lag = FreeResponse::with([0.1; 7], 1.0, 1);
        for step in [1.0, -0.3, 5.0] {
            for h in [0.005, 0.1] {
                let (answer, given) = stepped(&lag, step, 0.1, h);
                assert!((answer / step - (1.0 - (-1.0f64).exp())).abs() < 1e-12, "{step} {h}: {answer}");
                assert!((given / step - (-1.0f64).exp()).abs() < 1e-12, "{step} {h}: {given}");
            }
        }
    }

    #[test]
    fn a_time_in_proportion_to_the_distance_is_a_ramp() {
        // 0.1 s/A: 10 A/s. The coefficient beyond the end at nothing is negative where the curve is straight down to
        // it; it is held at nothing, which rounds the ramp's end.
        let slowness = 0.1;
        let ramp = FreeResponse::with(std::array::from_fn(|k| slowness * (k as f64 - 1.0).max(0.0) / 4.0), 1.0, 1);
        for (step, sign) in [(0.8, 1.0), (-0.8, -1.0)] {
            for t in [0.01, 0.02, 0.04, 0.06] {
                let (answer, given) = stepped(&ramp, step, t, 0.005);
                assert!((sign * answer - t / slowness).abs() < 0.01, "{t}: {answer}");
                assert!((sign * given - 0.5 * t / slowness).abs() < 0.01, "{t}: {given}");
            }
            let (answer, _) = stepped(&ramp, step, 0.15, 0.005);
            assert!((answer - step).abs() < 2e-3, "{answer}");
        }
    }

    #[test]
    fn the_first_of_a_time_is_felt_where_there_is_none() {
        // A ramp that is infinitely steep lags by half its slowness times the square of the step, and so does one of
        // 1 µs/A within rounding: the derivative at none is told.
        let slowness = 1e-6;
        let ramp = FreeResponse::with(std::array::from_fn(|k| slowness * (k as f64 - 1.0) / 4.0), 1.0, 1);
        let (answer, given) = stepped(&ramp, 0.6, 0.005, 0.005);
        assert!((answer - 0.6).abs() < 1e-9);
        let lost = (0.6 - given) * 0.005;
        assert!((lost / (0.5 * slowness * 0.36) - 1.0).abs() < 1e-6, "{lost:e}");
    }

    #[test]
    fn without_times_the_command_passes_to_the_bit() {
        let none = FreeResponse::with([0.0; 7], 1.0, 1);
        let mut bus = bus_at_rest();
        let mut own = [0.0; 2];
        for command in [0.3, 1.1, 0.0, 0.7] {
            bus.command = [0.2, command];
            none.relax(&bus, &bus, 0.005, &mut own);
            let mut ports = MastPorts::quiet();
            none.act(&bus, &own, &mut ports);
            assert_eq!(ports.lifts[1].current.to_bits(), 0.0f64.to_bits());
            assert_eq!(ports.lifts[0].current, 0.0);
        }
    }

    #[test]
    fn the_rates_lead_where_the_closed_form_ends() {
        let curve = FreeResponse::with([0.0, 0.01, 0.05, 0.03, 0.08, 0.04, 0.1], 0.9, 1);
        let mut bus = bus_at_rest();
        bus.command = [0.0, 0.8];
        let (mut own, steps) = ([0.0; 2], 20_000);
        for _ in 0..steps {
            let mut rates = [0.0; 2];
            curve.rates(&bus, &own, &mut rates);
            for (x, rate) in own.iter_mut().zip(rates) {
                *x += 0.04 / f64::from(steps) * rate;
            }
        }
        let (answer, _) = stepped(&curve, 0.8, 0.04, 0.005);
        assert!((answer - own[0]).abs() < 1e-3, "{answer} {}", own[0]);
    }
}
