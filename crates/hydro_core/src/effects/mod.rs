//! The physics the thesis left out: one effect a file, and the list at the bottom.
//!
//! An effect reads the bus (states and inputs of the simulated lifts) and writes to ports. It may
//! own states. Its first parameter is its amplitude, with a quiet value at which the model is the
//! model without it, to the bit; of a shape, the first few are.

use crate::mast::{Bus, Lift, LiftName};
use crate::parameters::ParameterSpec;
use crate::ports::Open;
use crate::scalar::{Mask, Scalar};

/// Where an effect sits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// On one lift: `main.leakage.coefficient`.
    Lift,
    /// Between the lifts: `mast_coupling.factor`.
    Mast,
}

/// What there is to know of a state.
#[derive(Debug, Clone, Copy)]
pub struct StateSpec {
    pub name: &'static str,
    pub unit: &'static str,
    /// A typical size: what the error control measures against.
    pub scale: f64,
    pub meaning: &'static str,
}

/// What there is to know of an effect, whatever its parameters' values.
#[derive(Debug, Clone, Copy)]
pub struct EffectSpec {
    pub id: &'static str,
    pub scope: Scope,
    pub equation: &'static str,
    pub source: &'static str,
    /// The amplitude first, or the amplitudes: see [`Effect::AMPLITUDES`].
    pub parameters: &'static [ParameterSpec],
    /// The amplitude at which the effect is absent.
    pub quiet: f64,
    /// Where each parameter may lie on a truck that has the effect: a search starts between.
    pub plausible: &'static [[f64; 2]],
    pub states: &'static [StateSpec],
    /// What its states add to outputs: which state, to which output, times which factor.
    pub shows: &'static [(usize, &'static str, f64)],
}

/// What effects write: the ports of every simulated lift, and what lies between the lifts.
#[derive(Debug, Clone, Copy)]
pub struct MastPorts<S, const L: usize> {
    pub lifts: [Open<S>; L],
    /// Inertia that couples the two cylinders' accelerations [kg].
    pub joint_inertia: S,
}

impl<S: Scalar, const L: usize> MastPorts<S, L> {
    /// Nothing acts.
    #[inline(always)]
    pub fn quiet() -> Self {
        MastPorts { lifts: [Open::quiet(); L], joint_inertia: S::zero() }
    }
}

/// One effect at work. `place` says on which simulated lift it sits.
pub trait Effect<S: Scalar>: Sized {
    const SPEC: EffectSpec;
    /// `values` in the order of the specification's parameters.
    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self;
    /// How many of the first parameters are amplitudes: the effect is absent where all of them are quiet.
    const AMPLITUDES: usize = 1;
    /// Whether an effect with these values is there only with both lifts.
    fn joins(_values: &[f64]) -> bool {
        matches!(Self::SPEC.scope, Scope::Mast)
    }
    /// Its own states at the start of a run: zero, if this is left out.
    fn start<const L: usize>(&self, _bus: &Bus<S, L>, _own: &mut [S]) {}
    /// How much later the command reaches the valve of the lift it sits on [s]; None: no later.
    fn delay(&self) -> Option<S> {
        None
    }
    /// Adds the effect's share to the ports.
    fn act<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>);
    /// Time derivatives of the effect's own states.
    fn rates<const L: usize>(&self, _bus: &Bus<S, L>, _own: &[S], _rates: &mut [S]) {}
    /// Whether the fast path advances the own states by [`Effect::relax`], instead of by their rates.
    const RELAXES: bool = false;
    /// Advances the own states by `h` [s], while the bus goes from `from` to `to` as far as it is known: in
    /// closed form, so that no time constant is too short.
    fn relax<const L: usize>(&self, _from: &Bus<S, L>, _to: &Bus<S, L>, _h: S, _own: &mut [S]) {}
}

/// y after `h` [s] of dy/dt = rate·(target − y), rate ≥ 0.
#[inline(always)]
fn relaxed<S: Scalar>(y: S, target: S, rate: S, h: S) -> S {
    target + (y - target) * (-(rate * h)).exp()
}

/// y after `h` [s] of dy/dt = source − rate·y; the rate, not negative, may be zero.
#[inline(always)]
fn decayed<S: Scalar>(y: S, source: S, rate: S, h: S) -> S {
    let s = rate * h;
    let decay = (-s).exp();
    // (1 − e^(−s))/s, as a series where the difference would cancel; what it leaves out is below 2e-13.
    const SMALL: f64 = 1e-2;
    let share = |n: f64| s * S::constant(1.0 / n);
    let one = S::one();
    let series = one - share(2.0) * (one - share(3.0) * (one - share(4.0) * (one - share(5.0))));
    let mean = S::select(s.lt(S::constant(SMALL)), series, (one - decay) / s.max(S::constant(SMALL)));
    y * decay + source * h * mean
}

/// The uniform cubic B-spline that is highest, 2/3, at t = 0 and ends at ±2.
#[inline(always)]
fn bell<S: Scalar>(t: S) -> S {
    let (zero, one) = (S::zero(), S::one());
    let far = (one + one - t.abs()).max(zero);
    let near = (one - t.abs()).max(zero);
    (far * far * far - S::constant(4.0) * (near * near * near)) * S::constant(1.0 / 6.0)
}

/// Σ c_k·B_k(y): cubic B-splines on equal intervals of 0 to 1, constant beyond.
#[inline(always)]
fn spline<S: Scalar, const N: usize>(coefficients: &[S; N], y: S) -> S {
    let y = S::constant((N - 3) as f64) * y.clamp_to(S::zero(), S::one());
    let mut sum = S::zero();
    for (k, &c) in coefficients.iter().enumerate() {
        let t = y - S::constant(k as f64 - 1.0);
        // Only four of them are not zero anywhere.
        if t.abs().lt(S::constant(2.0)).any() {
            sum = sum + c * bell(t);
        }
    }
    sum
}

/// An effect that a truck asks for: which, and on which lift.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instance {
    pub kind: Kind,
    /// None for an effect between the lifts.
    pub lift: Option<LiftName>,
}

impl Instance {
    /// `main.leakage`, or `mast_coupling`.
    pub fn name(&self) -> String {
        match self.lift {
            Some(lift) => format!("{}.{}", lift.as_str(), self.kind.spec().id),
            None => self.kind.spec().id.to_string(),
        }
    }

    /// Every place an effect of the list may take.
    pub fn all() -> impl Iterator<Item = Instance> {
        Kind::ALL.iter().flat_map(|&kind| {
            let lifts: &[Option<LiftName>] = match kind.spec().scope {
                Scope::Lift => &[Some(LiftName::Free), Some(LiftName::Main)],
                Scope::Mast => &[None],
            };
            lifts.iter().map(move |&lift| Instance { kind, lift })
        })
    }
}

macro_rules! catalogue {
    ($($module:ident :: $effect:ident),* $(,)?) => {
        $(mod $module;)*

        /// The effects by kind.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Kind { $($effect,)* }

        impl Kind {
            pub const ALL: &'static [Kind] = &[$(Kind::$effect,)*];

            pub fn spec(self) -> EffectSpec {
                match self {
                    $(Kind::$effect => <$module::$effect<f64> as Effect<f64>>::SPEC,)*
                }
            }

            /// How many of the first parameters are amplitudes.
            pub fn amplitudes(self) -> usize {
                match self {
                    $(Kind::$effect => <$module::$effect<f64> as Effect<f64>>::AMPLITUDES,)*
                }
            }

            /// Whether the effect with these values needs both lifts.
            pub fn joins(self, values: &[f64]) -> bool {
                match self {
                    $(Kind::$effect => <$module::$effect<f64> as Effect<f64>>::joins(values),)*
                }
            }
        }

        /// An effect with its parameters.
        #[derive(Debug, Clone)]
        pub enum Term<S> { $($effect($module::$effect<S>),)* }

        impl<S: Scalar> Term<S> {
            pub fn new(kind: Kind, values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
                match kind {
                    $(Kind::$effect => Term::$effect($module::$effect::new(values, lifts, place)),)*
                }
            }

            pub fn delay(&self) -> Option<S> {
                match self {
                    $(Term::$effect(effect) => effect.delay(),)*
                }
            }

            #[inline(always)]
            pub fn act<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>) {
                match self {
                    $(Term::$effect(effect) => effect.act(bus, own, ports),)*
                }
            }

            #[inline(always)]
            pub fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
                match self {
                    $(Term::$effect(effect) => effect.rates(bus, own, rates),)*
                }
            }

            #[inline(always)]
            pub fn start<const L: usize>(&self, bus: &Bus<S, L>, own: &mut [S]) {
                match self {
                    $(Term::$effect(effect) => effect.start(bus, own),)*
                }
            }

            #[inline(always)]
            pub fn relaxes(&self) -> bool {
                match self {
                    $(Term::$effect(_) => <$module::$effect<S> as Effect<S>>::RELAXES,)*
                }
            }

            #[inline(always)]
            pub fn relax<const L: usize>(&self, from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]) {
                match self {
                    $(Term::$effect(effect) => effect.relax(from, to, h, own),)*
                }
            }
        }
    };
}

catalogue! {
    mast_coupling::MastCoupling,
    friction_temperature::FrictionTemperature,
    leakage::Leakage,
    friction_position::FrictionPosition,
    friction_pressure::FrictionPressure,
    friction_dwell::FrictionDwell,
    bulk_modulus_temperature::BulkModulusTemperature,
    entrained_air::EntrainedAir,
    chain_elasticity::ChainElasticity,
    end_cushion::EndCushion,
    chassis_compliance::ChassisCompliance,
    hose_resistance::HoseResistance,
    hose_inertance::HoseInertance,
    return_back_pressure::ReturnBackPressure,
    viscosity_law::ViscosityLaw,
    oil_temperature_at_valve::OilTemperatureAtValve,
    valve_delay::ValveDelay,
    valve_lag::ValveLag,
    valve_current_limit::ValveCurrentLimit,
    valve_flow_force::ValveFlowForce,
    compensator_dynamics::CompensatorDynamics,
    free_shape::FreeShape,
    hidden_resonance::HiddenResonance,
    free_response::FreeResponse,
    fine_shape::FineShape,
}

pub use free_shape::{VariableSpec, VARIABLES};

/// What an effect sees of two lifts at rest without pressure, at 0 °C.
#[cfg(test)]
fn bus_at_rest() -> Bus<f64, 2> {
    let rest = crate::mast::LiftState::from_slice(&[0.0; crate::mast::STATES]);
    Bus { lifts: [rest; 2], command: [0.0; 2], p_tank: [0.0; 2], oil_temperature_degc: 0.0 }
}
