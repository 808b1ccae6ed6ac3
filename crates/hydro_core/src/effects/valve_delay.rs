//! Dead time between the command and the proportional valve.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// u(t) → u(t − τ), exactly: the runs look the earlier command up.
#[derive(Debug, Clone)]
pub struct ValveDelay<S> {
    delay: S,
}

impl<S: Scalar> Effect<S> for ValveDelay<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "valve_delay",
        scope: Scope::Lift,
        equation: "u at the valve is u(t - delay)",
        source: "Åström & Hägglund (1995), PID Controllers: dead time",
        parameters: &[ParameterSpec {
            name: "delay",
            symbol: "τ",
            unit: "s",
            lower: 0.0,
            upper: 0.5,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.13)",
            meaning: "dead time of the command",
            bounds_reason: "25 periods of the controller; no valve that still works is later",
        }],
        quiet: 0.0,
        plausible: &[[0.005, 0.1]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], _lifts: &[Lift<S>], _place: usize) -> Self {
        ValveDelay { delay: values[0] }
    }

    fn delay(&self) -> Option<S> {
        Some(self.delay)
    }

    #[inline(always)]
    fn act<const L: usize>(&self, _bus: &Bus<S, L>, _own: &[S], _ports: &mut MastPorts<S, L>) {}
}
