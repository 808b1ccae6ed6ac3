//! A curve of any shape over one variable of operation, at one port: for physics that has no name yet.

mod variables;

use super::{decayed, relaxed, spline, Effect, EffectSpec, MastPorts, Scope, StateSpec};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::ports::{is_place, port, PORTS};
use crate::scalar::{Mask, Scalar};

use variables::variable;
pub use variables::{VariableSpec, VARIABLES};

/// f = Σ c_k·B_k(y), times what is typical at the port, joins a sum, or the logarithm of a factor. y, between 0 and
/// 1, is where the variable lies between `lower` and `upper`, after a lag. Of a shape that fades it is where the
/// variable less what it lately was lies: what acts at first and no more once the variable has stood for a few lags.
///
/// There is no amplitude beside the coefficients: it would be known only as a product with them, and a search that
/// starts at nothing could not tell which way to go. All of them are amplitudes.
///
/// Port and variable are numbers like the others, and chosen anew wherever they are needed, by `select`: each lane
/// may have its own.
#[derive(Debug, Clone)]
pub struct Curve<S, const N: usize> {
    /// Times what is typical at the port.
    coefficients: [S; N],
    port: S,
    variable: S,
    lower: S,
    inverse_width: S,
    lag: S,
    /// One over the lag [1/s].
    rate: S,
    /// 1 where it fades, else 0.
    fades: S,
    /// What joins the port is no less: of an inertia no more than half of the lift's may be gone.
    least: S,
    load: S,
    place: usize,
}

/// The curve on four intervals.
pub type FreeShape<S> = Curve<S, COEFFICIENTS>;

const VELOCITY: usize = variable("velocity");
const SPEED: usize = variable("speed");
const PRESSURE: usize = variable("pressure");
const OIL_TEMPERATURE: usize = variable("oil_temperature");
const LOAD: usize = variable("load");
const COMMAND: usize = variable("command");
const OTHER_VELOCITY: usize = variable("other_velocity");
const TIME_AT_REST: usize = variable("time_at_rest");
const TIME_SINCE_COMMAND: usize = variable("time_since_command");
const OTHER_COMMAND: usize = variable("other_command");

const COEFFICIENTS: usize = 7;
/// Of the curve that follows what repeats along a stroke: a period of 0.19 m has seven intervals on a way of one
/// metre, and more than three on two.
pub const FINE: usize = 40;
/// A lag shorter than this [s] is none.
const SHORTEST: f64 = 1e-4;
/// Times that are longer count as this long [s].
const LONGEST: f64 = 10.0;
/// The way [m], and the change of the command [A], after which e^(−1) is left of what came before.
const WAY: f64 = 5e-3;
const CHANGE: f64 = 0.01;
/// The time constant [s] of what the command is compared with.
const MEMORY: f64 = 0.02;
/// Far below this [m/s] a speed is rounded off.
const SLOW: f64 = 1e-3;
/// More than any shape reaches.
const ANY: f64 = 1e9;

const fn coefficient(name: &'static str, symbol: &'static str) -> ParameterSpec {
    ParameterSpec {
        name,
        symbol,
        unit: "1",
        lower: -1.7,
        upper: 1.7,
        scale: Scale::Linear,
        origin: Origin::Chosen,
        equation: "any",
        meaning: "coefficient of the shape, in what is typical at the port of a sum, or of a factor's logarithm",
        bounds_reason: "a factor of five either way; with more, friction is stiffer than fixed steps follow",
    }
}

/// What is given with a shape and not estimated.
const fn given(
    name: &'static str,
    symbol: &'static str,
    unit: &'static str,
    [lower, upper]: [f64; 2],
    meaning: &'static str,
    bounds_reason: &'static str,
) -> ParameterSpec {
    let (scale, origin) = (Scale::Linear, Origin::Given);
    ParameterSpec { name, symbol, unit, lower, upper, scale, origin, equation: "any", meaning, bounds_reason }
}

impl<S: Scalar, const N: usize> Curve<S, N> {
    /// How much of the age is renewed per second by moving at `v`.
    #[inline(always)]
    fn renewal(v: S) -> S {
        v.abs() * S::constant(1.0 / WAY)
    }

    /// Where the chosen variable lies between `lower`, 0, and `upper`, 1.
    // Long, and called thrice; but compiled by itself it would be compiled without the lanes' vectors.
    #[inline(always)]
    fn spot<const L: usize>(&self, bus: &Bus<S, L>, own: &[S]) -> S {
        let s = &bus.lifts[self.place];
        let mut chosen = s.x;
        chosen = self.if_named(VELOCITY, s.v, chosen);
        chosen = self.if_named(PRESSURE, s.p_a, chosen);
        chosen = self.if_named(OIL_TEMPERATURE, bus.oil_temperature_degc, chosen);
        chosen = self.if_named(LOAD, self.load, chosen);
        chosen = self.if_named(COMMAND, bus.command[self.place], chosen);
        if L == 2 {
            chosen = self.if_named(OTHER_VELOCITY, bus.lifts[1 - self.place].v, chosen);
            chosen = self.if_named(OTHER_COMMAND, bus.command[1 - self.place], chosen);
        }
        if is_place(self.variable, SPEED).any() {
            let slow = S::constant(SLOW);
            chosen = self.if_named(SPEED, (s.v * s.v + slow * slow).sqrt() - slow, chosen);
        }
        if is_place(self.variable, TIME_AT_REST).or(is_place(self.variable, TIME_SINCE_COMMAND)).any() {
            let fresh = (S::one() - own[2]).max(S::constant(1.0 / std::f64::consts::E));
            let time = -(S::constant(LONGEST) * fresh.ln());
            chosen = self.if_named(TIME_AT_REST, time, chosen);
            chosen = self.if_named(TIME_SINCE_COMMAND, time, chosen);
        }
        (chosen - self.lower) * self.inverse_width
    }

    /// The value where `variable` names the `k`-th, else the other. What no lane names costs a comparison.
    #[inline(always)]
    fn if_named(&self, k: usize, value: S, other: S) -> S {
        let here = is_place(self.variable, k);
        if here.any() {
            S::select(here, value, other)
        } else {
            other
        }
    }

    #[inline(always)]
    fn shape(&self, y: S) -> S {
        spline(&self.coefficients, y)
    }

    /// Where the curve is taken, of the variable's spot now and after the lag.
    #[inline(always)]
    fn taken(&self, now: S, late: S) -> S {
        S::select(is_place(self.fades, 1), now - late - self.lower * self.inverse_width, late)
    }
}

/// The parameters of a curve with these coefficients.
macro_rules! parameters {
    ($($k:literal)*) => {
        &[
            $(coefficient(concat!("shape_", $k), concat!("c", $k)),)*
            given(
                "port",
                "",
                "1",
                [0.0, (PORTS.len() - 1) as f64],
                "where it acts: place in the table of ports, counted from 0",
                "the table's length",
            ),
            given(
                "variable",
                "",
                "1",
                [0.0, (VARIABLES.len() - 1) as f64],
                "what it is a function of: place in the table of variables, counted from 0",
                "the table's length",
            ),
            given(
                "lower",
                "",
                "variable's",
                [-1e9, 1e9],
                "the variable where the shape begins; it is constant before",
                "more than any variable reaches",
            ),
            given(
                "upper",
                "",
                "variable's",
                [-1e9, 1e9],
                "the variable where the shape ends; it is constant beyond",
                "more than any variable reaches; a range that is too narrow counts as the narrowest",
            ),
            ParameterSpec {
                name: "lag",
                symbol: "τ",
                unit: "s",
                lower: 0.0,
                upper: 20.0,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "any",
                meaning: "time constant with which the variable acts late, or is forgotten; 0 is at once",
                bounds_reason: "longer than a lowering",
            },
            given(
                "fades",
                "",
                "1",
                [0.0, 1.0],
                "1: the shape is a function of the variable less what it was a lag ago, 0: of the variable after the lag",
                "yes or no",
            ),
        ]
    };
}

/// Where the parameters of a curve may lie.
const fn plausible<const M: usize>() -> [[f64; 2]; M] {
    let mut ends = [[-0.5, 0.5]; M];
    // A choice has no width, but a range has: all of it is the force, over the velocity.
    ends[M - 6] = [port("force") as f64 - 0.4, port("force") as f64];
    ends[M - 5] = [variable("velocity") as f64, variable("velocity") as f64 + 0.4];
    ends[M - 4] = [-0.5, -0.3];
    ends[M - 3] = [-0.1, 0.1];
    ends[M - 2] = [0.0, 0.5];
    ends[M - 1] = [0.0, 0.4];
    ends
}

const EQUATION: &str = "f = sum of shape_k B_k(y),  y between 0 and 1,  y = (late - lower) / (upper - lower), or of one that fades \
                        (variable - late - lower) / (upper - lower),  lag d(late)/dt = variable - late,  \
                        the port's sum grows by f times what is typical, or the logarithm of its factor";
const FEW: [[f64; 2]; COEFFICIENTS + 6] = plausible();
const MANY: [[f64; 2]; FINE + 6] = plausible();

const FEW_SPEC: EffectSpec = EffectSpec {
    id: "free_shape",
    scope: Scope::Lift,
    equation: EQUATION,
    source: "de Boor (1978), A Practical Guide to Splines, chapters IX and X: cubic B-splines, here on four equal \
             intervals",
    parameters: parameters!(0 1 2 3 4 5 6),
    quiet: 0.0,
    plausible: &FEW,
    states: STATES,
    shows: &[],
};

const MANY_SPEC: EffectSpec = EffectSpec {
    id: "fine_shape",
    source: "de Boor (1978), A Practical Guide to Splines, chapters IX and X: cubic B-splines, here on 37 equal \
             intervals",
    parameters: parameters!(
        0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32 33 34 35 36 37 38 39
    ),
    plausible: &MANY,
    ..FEW_SPEC
};

const STATES: &[StateSpec] = &[
        StateSpec { name: "spot", unit: "1", scale: 1.0, meaning: "where in its range the curve is taken" },
        StateSpec { name: "memory", unit: "A", scale: 1.0, meaning: "command of a moment ago" },
        StateSpec { name: "age", unit: "1", scale: 1.0, meaning: "1 - exp(-time / 10 s), the time at rest or since the command moved" },
        StateSpec { name: "late", unit: "1", scale: 1.0, meaning: "where the variable lies in its range, after the lag" },
    ];

impl<S: Scalar, const N: usize> Effect<S> for Curve<S, N> {
    const SPEC: EffectSpec = if N == COEFFICIENTS { FEW_SPEC } else { MANY_SPEC };

    const AMPLITUDES: usize = N;

    fn joins(values: &[f64]) -> bool {
        is_place(values[N + 1], OTHER_VELOCITY) || is_place(values[N + 1], OTHER_COMMAND)
    }

    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
        let &[place_of_port, variable, lower, upper, lag, fades] = &values[N..] else {
            unreachable!("six parameters beside the shape")
        };
        let mut finest = S::zero();
        for (k, spec) in VARIABLES.iter().enumerate() {
            finest = S::select(is_place(variable, k), S::constant(spec.finest), finest);
        }
        let mut typical = S::one();
        for (k, spec) in PORTS.iter().enumerate() {
            typical = S::select(is_place(place_of_port, k), S::constant(spec.typical), typical);
        }
        let half = S::constant(-0.5) * lifts[place].balance.inertia;
        Curve {
            coefficients: std::array::from_fn(|k| typical * values[k]),
            port: place_of_port,
            variable,
            lower,
            inverse_width: S::one() / (upper - lower).max(finest),
            lag,
            rate: S::one() / lag.max(S::constant(SHORTEST)),
            fades,
            least: S::select(is_place(place_of_port, port("inertia")), half, S::constant(-ANY)),
            load: lifts[place].load,
            place,
        }
    }

    fn start<const L: usize>(&self, bus: &Bus<S, L>, own: &mut [S]) {
        own[1] = bus.command[self.place];
        own[2] = S::zero();
        own[3] = self.spot(bus, own);
        own[0] = self.taken(own[3], own[3]);
    }

    #[inline(always)]
    fn act<const L: usize>(&self, _bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>) {
        ports.lifts[self.place].bend(self.port, self.shape(own[0]).max(self.least));
    }

    #[inline(always)]
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        let now = self.spot(bus, own);
        rates[3] = (now - own[3]) * self.rate;
        // Where the curve is taken is no state of its own beside what is late: it is drawn there.
        let drawn = self.taken(now, own[3]) - own[0];
        let along = rates[3] + drawn * self.rate;
        rates[0] = S::select(is_place(self.fades, 1), drawn * S::constant(1.0 / SHORTEST), along);
        rates[1] = (bus.command[self.place] - own[1]) * S::constant(1.0 / MEMORY);
        let renewal = S::select(
            is_place(self.variable, TIME_AT_REST),
            Self::renewal(bus.lifts[self.place].v),
            rates[1].abs() * S::constant(1.0 / CHANGE),
        );
        rates[2] = (S::one() - own[2]) * S::constant(1.0 / LONGEST) - renewal * own[2];
    }

    const RELAXES: bool = true;

    #[inline(always)]
    fn relax<const L: usize>(&self, from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]) {
        let before = self.spot(from, own);
        let memory = relaxed(own[1], to.command[self.place], S::constant(1.0 / MEMORY), h);
        let changed = (memory - own[1]).abs() * S::constant(1.0 / CHANGE) / h;
        let moved = Self::renewal(from.lifts[self.place].v) + Self::renewal(to.lifts[self.place].v);
        let renewal = S::select(is_place(self.variable, TIME_AT_REST), S::constant(0.5) * moved, changed);
        let ageing = S::constant(1.0 / LONGEST);
        own[1] = memory;
        own[2] = decayed(own[2], ageing, ageing + renewal, h);
        let after = self.spot(to, own);
        // What a lag leaves of a straight line; exact for a lag of any length, and so is the derivative at none.
        let decay = (-(self.rate * h)).exp();
        own[3] = after - (after - before) * self.lag * (S::one() - decay) / h + (own[3] - before) * decay;
        own[0] = self.taken(after, own[3]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;
    use crate::ports::Open;

    /// On the second lift, over the range 0 to `width` of a variable.
    fn shape(place_of_port: usize, variable: usize, coefficients: [f64; 7], width: f64, lag: f64) -> FreeShape<f64> {
        FreeShape {
            coefficients,
            port: place_of_port as f64,
            variable: variable as f64,
            lower: 0.0,
            inverse_width: 1.0 / width,
            lag,
            rate: 1.0 / lag.max(SHORTEST),
            fades: 0.0,
            least: -ANY,
            load: 700.0,
            place: 1,
        }
    }

    fn values(mut ports: Open<f64>) -> Vec<f64> {
        ports.each().into_iter().map(|port| *port).collect()
    }

    fn bits(ports: Open<f64>) -> Vec<u64> {
        values(ports).into_iter().map(f64::to_bits).collect()
    }

    /// What joins the port at `k`, of quiet ports.
    fn joined(shape: &FreeShape<f64>, own: &[f64], k: usize) -> f64 {
        let mut ports = MastPorts::<f64, 2>::quiet();
        shape.act(&bus_at_rest(), own, &mut ports);
        values(ports.lifts[1])[k]
    }

    #[test]
    fn equal_coefficients_are_a_constant_and_even_ones_a_straight_line_that_ends_level() {
        for k in -10..=50 {
            let y = f64::from(k) / 40.0;
            let [flat, even] = [[0.7; 7], std::array::from_fn(|j| 0.2 + 0.3 * (j as f64 - 1.0) / 4.0)]
                .map(|coefficients| shape(13, 0, coefficients, 1.0, 0.0).shape(y));
            assert!((flat - 0.7).abs() < 1e-15, "{y}: {flat}");
            assert!((even - (0.2 + 0.3 * y.clamp(0.0, 1.0))).abs() < 1e-15, "{y}: {even}");
        }
    }

    #[test]
    fn one_coefficient_alone_is_a_bell_over_four_intervals_that_is_two_thirds_high() {
        let bell = shape(13, 0, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 1.0, 0.0);
        for (y, height) in [(0.0, 0.0), (0.25, 1.0 / 6.0), (0.5, 2.0 / 3.0), (0.625, 23.0 / 48.0), (1.0, 0.0)] {
            assert!((bell.shape(y) - height).abs() < 1e-15, "{y}");
        }
    }

    #[test]
    fn without_coefficients_no_port_changes_a_bit_and_with_them_the_chosen_one_does() {
        for k in 0..PORTS.len() {
            let mut before = MastPorts::<f64, 2>::quiet();
            for (j, port) in before.lifts[1].each().into_iter().enumerate() {
                *port = 0.3 + 0.1 * j as f64;
            }
            let mut after = before;
            shape(k, 0, [0.0; 7], 1.0, 0.0).act(&bus_at_rest(), &[0.4, 0.0, 0.0, 0.4], &mut after);
            assert_eq!(bits(after.lifts[1]), bits(before.lifts[1]));
            shape(k, 0, [0.5; 7], 1.0, 0.0).act(&bus_at_rest(), &[0.4, 0.0, 0.0, 0.4], &mut after);
            let moved = (0..PORTS.len()).filter(|&j| values(after.lifts[1])[j] != values(before.lifts[1])[j]);
            assert_eq!(moved.collect::<Vec<_>>(), [k]);
            assert_eq!(values(after.lifts[0]), values(Open::quiet()));
        }
    }

    #[test]
    fn a_sum_grows_by_the_shape_and_a_factor_by_its_exponential() {
        let own = [0.5, 0.0, 0.0, 0.5];
        let force = shape(port("force"), 0, [300.0; 7], 1.0, 0.0);
        assert!((joined(&force, &own, port("force")) - 300.0).abs() < 1e-12);
        let opening = shape(port("opening"), 0, [-0.5; 7], 1.0, 0.0);
        assert!((joined(&opening, &own, port("opening")) - (-0.5f64).exp()).abs() < 1e-15);
        let light = FreeShape { least: -40.0, ..shape(port("inertia"), 0, [-100.0; 7], 1.0, 0.0) };
        assert_eq!(joined(&light, &own, port("inertia")), -40.0);
    }

    #[test]
    fn what_fades_is_the_step_at_first_and_a_lag_later_its_eth_part() {
        // A range of −1 to 1 m/s: 0.6 m/s more is 0.3 of it from its middle.
        let fading = FreeShape {
            lower: -1.0,
            fades: 1.0,
            ..shape(13, variable("velocity"), [0.0; 7], 2.0, 0.2)
        };
        for h in [0.005, 0.05] {
            let mut bus = bus_at_rest();
            let mut own = [0.0; 4];
            fading.start(&bus, &mut own);
            assert_eq!(own[0], 0.5);
            bus.lifts[1].v = 0.6;
            for k in 1..=(1.0 / h) as usize {
                fading.relax(&bus, &bus, h, &mut own);
                let left = 0.3 * (-(k as f64) * h / 0.2).exp();
                assert!((own[0] - 0.5 - left).abs() < 1e-12, "{h} {k}: {own:?}");
            }
            let mut rates = [0.0; 4];
            fading.rates(&bus, &own, &mut rates);
            assert!(rates[0].abs() < 1e-7 && rates[3] > 0.0);
        }
    }

    #[test]
    fn a_lag_follows_a_ramp_as_its_closed_form_says_and_no_lag_follows_at_once() {
        // u = t/2 s: y = (t − τ(1 − e^(−t/τ)))/2 s.
        for (lag, h) in [(0.0, 0.005), (0.3, 0.005), (0.3, 0.05), (5.0, 0.005)] {
            let ramp = shape(13, variable("velocity"), [0.0; 7], 2.0, lag);
            let (mut from, mut own) = (bus_at_rest(), [0.0; 4]);
            for k in 1..=20 {
                let mut to = from;
                to.lifts[1].v = f64::from(k) * h;
                ramp.relax(&from, &to, h, &mut own);
                from = to;
                let t = f64::from(k) * h;
                let behind = if lag > 0.0 { lag * (1.0 - (-t / lag).exp()) } else { 0.0 };
                assert!((own[0] - 0.5 * (t - behind)).abs() < 1e-12, "{lag} {h} {k}: {}", own[0]);
            }
        }
    }

    #[test]
    fn variables_are_what_they_say() {
        let mut bus = bus_at_rest();
        bus.oil_temperature_degc = 42.0;
        bus.command = [0.3, 0.8];
        (bus.lifts[1].x, bus.lifts[1].v, bus.lifts[1].p_a) = (1.5, -0.4, 7e6);
        bus.lifts[0].v = -0.1;
        let wanted = [
            ("position", 1.5),
            ("velocity", -0.4),
            ("speed", 0.4),
            ("pressure", 7e6),
            ("oil_temperature", 42.0),
            ("load", 700.0),
            ("command", 0.8),
            ("other_velocity", -0.1),
            ("time_at_rest", 0.0),
            ("time_since_command", 0.0),
            ("other_command", 0.3),
        ];
        assert_eq!(wanted.map(|(name, _)| name).as_slice(), VARIABLES.iter().map(|v| v.name).collect::<Vec<_>>());
        for (k, (name, value)) in wanted.into_iter().enumerate() {
            let got = shape(13, k, [0.0; 7], 1.0, 0.0).spot(&bus, &[0.0; 4]);
            assert!((got - value).abs() < 1.1e-3, "{name}: {got}");
        }
    }

    #[test]
    fn time_at_rest_is_told_to_ten_seconds_and_moving_takes_it_back() {
        let rest = shape(13, TIME_AT_REST, [0.0; 7], 1.0, 0.0);
        let (mut bus, mut own) = (bus_at_rest(), [0.0; 4]);
        rest.start(&bus, &mut own);
        let run = |bus: &Bus<f64, 2>, own: &mut [f64], seconds: usize| {
            for _ in 0..200 * seconds {
                rest.relax(bus, bus, 0.005, own);
            }
        };
        run(&bus, &mut own, 3);
        assert!((own[0] - 3.0).abs() < 1e-9, "{}", own[0]);
        run(&bus, &mut own, 9);
        assert!((own[0] - 10.0).abs() < 1e-12, "{}", own[0]);
        // At 0.1 m/s half a centimetre takes 50 ms.
        bus.lifts[1].v = -0.1;
        run(&bus, &mut own, 1);
        assert!((own[0] - 0.05).abs() < 3e-4, "{}", own[0]);
    }

    #[test]
    fn time_since_the_command_moved_starts_again_with_each_move() {
        let since = shape(13, TIME_AT_REST + 1, [0.0; 7], 1.0, 0.0);
        let (mut bus, mut own) = (bus_at_rest(), [0.0; 4]);
        since.start(&bus, &mut own);
        for command in [0.6, 0.7, 0.5] {
            bus.command[1] = command;
            // The move itself takes a moment, until less than a hundredth of an ampere is left of it.
            for k in 1..=400 {
                since.relax(&bus, &bus, 0.005, &mut own);
                let t = 0.005 * f64::from(k);
                assert!(t < 0.045 || own[0] <= t + 1e-3, "{command}: {} after {t}", own[0]);
            }
            assert!(own[0] > 1.85, "{command}: {}", own[0]);
            let mut rates = [0.0; 4];
            since.rates(&bus, &own, &mut rates);
            assert!(rates[0].abs() < 1.0 && (rates[2] - 0.1 * (1.0 - own[2])).abs() < 1e-9);
        }
    }
}
