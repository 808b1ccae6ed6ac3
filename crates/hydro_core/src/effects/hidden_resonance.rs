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
const MOST: f64 = 0.5;

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
                bounds_reason: "500 kg on the forks, which move twice as fast; more than half of the lift's inertia counts \
                                as half",
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
                upper: 0.9,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.27), (3.33)",
                meaning: "its damping ratio",
                bounds_reason: "from welded steel to a swing that is gone at once; at one it would no longer ring",
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
