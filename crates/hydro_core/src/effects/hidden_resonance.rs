//! Something on the lift that rings with a frequency of its own: a load that sways, a loose stage, a hose's coil.

use super::{Effect, EffectSpec, MastPorts, Scope, StateSpec};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// (M − m)·dv/dt = F + k·y + c·ẏ and m·(dv/dt + ÿ) = −k·y − c·ẏ: the mass m of the lift's inertia M hangs on a spring
/// and a damper, y above where it rests.
///
/// Written with ω² = k/m and ζ = c/(2mω), so that the swing itself does not change as m vanishes, and with the mass's
/// own velocity w = v + ẏ, for which no acceleration is needed and which keeps its momentum at a stop:
///
/// dy/dt = w − v,  dw/dt = −ω²y − 2ζω(w − v).
#[derive(Debug, Clone)]
pub struct HiddenResonance<S> {
    mass: S,
    /// ω² and 2ζω.
    stiffness: S,
    damping: S,
    /// ω√(1 − ζ²).
    ringing: S,
    place: usize,
}

/// What hangs on the spring is at most this share of the lift's inertia.
const MOST: f64 = 0.3;

impl<S: Scalar> HiddenResonance<S> {
    /// `inertia`: the lift's whole M.
    fn with(mass: S, frequency: S, damping_ratio: S, inertia: S, place: usize) -> Self {
        let omega = S::constant(std::f64::consts::TAU) * frequency;
        HiddenResonance {
            mass: mass.min(S::constant(MOST) * inertia),
            stiffness: omega * omega,
            damping: S::constant(2.0) * damping_ratio * omega,
            ringing: omega * (S::one() - damping_ratio * damping_ratio).sqrt(),
            place,
        }
    }

    /// dw/dt.
    #[inline(always)]
    fn pull<const L: usize>(&self, bus: &Bus<S, L>, own: &[S]) -> S {
        -(self.stiffness * own[0]) - self.damping * (own[1] - bus.lifts[self.place].v)
    }
}

impl<S: Scalar> Effect<S> for HiddenResonance<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "hidden_resonance",
        scope: Scope::Lift,
        equation: "(M - mass) a = F + k y + c y',  mass (a + y'') = -k y - c y',  k = mass omega^2,  \
                   c = 2 ratio omega mass,  omega = 2 pi frequency",
        source: "Den Hartog (1934), Mechanical Vibrations, section 3.2: a mass on a spring upon the mass that moves",
        parameters: &[
            ParameterSpec {
                name: "mass",
                symbol: "m",
                unit: "kg",
                lower: 0.0,
                upper: 2000.0,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.27), (3.33)",
                meaning: "what of the lift's inertia, seen at the cylinder, hangs on the spring",
                bounds_reason: "500 kg on the forks, which move twice as fast; more than 0.3 of the lift's inertia counts \
                                as that, since fixed steps follow no more of it",
            },
            ParameterSpec {
                name: "frequency",
                symbol: "f",
                unit: "Hz",
                lower: 1.0,
                upper: 15.0,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.27), (3.33)",
                meaning: "its natural frequency with the cylinder held",
                bounds_reason: "slower is the truck on its tyres; faster is not seen at 50 samples a second",
            },
            ParameterSpec {
                name: "damping_ratio",
                symbol: "ζ",
                unit: "1",
                lower: 0.01,
                upper: 0.3,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.27), (3.33)",
                meaning: "its damping ratio",
                bounds_reason: "from welded steel to a swing that is gone after the first; with more it is stiffer than fixed steps follow",
            },
        ],
        quiet: 0.0,
        plausible: &[[20.0, 400.0], [2.0, 8.0], [0.02, 0.2]],
        states: &[
            StateSpec { name: "displacement", unit: "m", scale: 0.01, meaning: "the mass above where it rests on the lift" },
            StateSpec { name: "velocity", unit: "m/s", scale: 0.5, meaning: "its velocity, with the cylinder's" },
        ],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
        HiddenResonance::with(values[0], values[1], values[2], lifts[place].balance.inertia, place)
    }

    fn start<const L: usize>(&self, bus: &Bus<S, L>, own: &mut [S]) {
        (own[0], own[1]) = (S::zero(), bus.lifts[self.place].v);
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>) {
        let pull = self.pull(bus, own);
        let ports = &mut ports.lifts[self.place];
        ports.force = ports.force - self.mass * pull;
        ports.inertia = ports.inertia - self.mass;
    }

    #[inline(always)]
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        rates[0] = own[1] - bus.lifts[self.place].v;
        rates[1] = self.pull(bus, own);
    }

    const RELAXES: bool = true;

    /// Exact while the cylinder accelerates evenly.
    #[inline(always)]
    fn relax<const L: usize>(&self, from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]) {
        let (before, after) = (from.lifts[self.place].v, to.lifts[self.place].v);
        // At this displacement the mass would ride along.
        let riding = -((after - before) / (h * self.stiffness));
        let half = S::constant(0.5) * self.damping;
        let decay = (-(half * h)).exp();
        let angle = self.ringing * h;
        let (cos, sin) = (angle.cos(), angle.sin() / self.ringing);
        let (y, rate) = (own[0] - riding, own[1] - before);
        own[0] = riding + decay * (y * (cos + half * sin) + rate * sin);
        own[1] = after + decay * (rate * (cos - half * sin) - self.stiffness * y * sin);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    /// 400 of 3000 kg at 2 Hz on the second lift.
    fn thing(damping_ratio: f64) -> HiddenResonance<f64> {
        HiddenResonance::with(400.0, 2.0, damping_ratio, 3000.0, 1)
    }

    /// The cylinder's acceleration under the force `force`, and the mass's own.
    fn accelerations(thing: &HiddenResonance<f64>, bus: &Bus<f64, 2>, own: &[f64], force: f64) -> [f64; 2] {
        let mut ports = MastPorts::quiet();
        thing.act(bus, own, &mut ports);
        assert_eq!((ports.lifts[0].force, ports.lifts[0].inertia), (0.0, 0.0));
        let mut rates = [0.0; 2];
        thing.rates(bus, own, &mut rates);
        [(force + ports.lifts[1].force) / (3000.0 + ports.lifts[1].inertia), rates[1]]
    }

    #[test]
    fn what_the_forces_give_both_masses_is_the_momentum_they_have() {
        let mut bus = bus_at_rest();
        bus.lifts[1].v = -0.2;
        for own in [[0.0, -0.2], [0.01, 0.1], [-0.02, -0.5]] {
            let [lift, mass] = accelerations(&thing(0.1), &bus, &own, -700.0);
            assert!((2600.0 * lift + 400.0 * mass + 700.0).abs() < 1e-9);
        }
    }

    #[test]
    fn with_the_cylinder_held_it_is_back_upside_down_after_half_a_period_and_alone_it_rings_faster() {
        let (bus, mut own) = (bus_at_rest(), [0.01, 0.0]);
        for _ in 0..50 {
            thing(0.0).relax(&bus, &bus, 0.005, &mut own);
        }
        assert!((own[0] + 0.01).abs() < 1e-14 && own[1].abs() < 1e-13, "{own:?}");
        // y″ = −ω²·M/(M − m)·y.
        let [lift, mass] = accelerations(&thing(0.0), &bus, &[0.01, 0.0], 0.0);
        let omega = 2.0 * std::f64::consts::TAU;
        assert!((mass - lift + omega * omega * 3000.0 / 2600.0 * 0.01).abs() < 1e-12);
    }

    #[test]
    fn its_damping_leaves_what_the_logarithmic_decrement_says() {
        // ln(y₀/y₁) = 2πζ/√(1 − ζ²) a period, of 0.5 s/√(1 − ζ²).
        let zeta: f64 = 0.3;
        let root = (1.0 - zeta * zeta).sqrt();
        let (bus, mut own) = (bus_at_rest(), [0.01, 0.0]);
        for _ in 0..100 {
            thing(zeta).relax(&bus, &bus, 0.005 / root, &mut own);
        }
        assert!((own[0] - 0.01 * (-std::f64::consts::TAU * zeta / root).exp()).abs() < 1e-14, "{own:?}");
    }

    #[test]
    fn on_an_even_acceleration_the_closed_form_is_the_sum_of_its_rates() {
        let thing = thing(0.2);
        let (mut from, mut to) = (bus_at_rest(), bus_at_rest());
        (from.lifts[1].v, to.lifts[1].v) = (-0.1, -0.3);
        let (start, h, n) = ([0.004, -0.15], 0.2, 4000);
        let mut closed = start;
        thing.relax(&from, &to, h, &mut closed);
        // Midpoint rule.
        let (mut own, step) = (start, h / f64::from(n));
        for k in 0..n {
            let rates = |t: f64, own: &[f64; 2]| {
                let (mut bus, mut rates) = (from, [0.0; 2]);
                bus.lifts[1].v += (to.lifts[1].v - from.lifts[1].v) * t;
                thing.rates(&bus, own, &mut rates);
                rates
            };
            let t = f64::from(k) / f64::from(n);
            let first = rates(t, &own);
            let middle = [0, 1].map(|j| own[j] + 0.5 * step * first[j]);
            let second = rates(t + 0.5 / f64::from(n), &middle);
            own = [0, 1].map(|j| own[j] + step * second[j]);
        }
        assert!((closed[0] - own[0]).abs() < 1e-8 && (closed[1] - own[1]).abs() < 1e-7, "{closed:?} {own:?}");
    }

    #[test]
    fn no_more_than_three_tenths_of_the_lift_hang_on_it() {
        assert_eq!(HiddenResonance::with(2000.0, 5.0, 0.1, 3000.0, 0).mass, 900.0);
    }
}
