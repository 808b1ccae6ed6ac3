//! The places where an effect, or an unknown input of a diagnosis, may enter the equations.
//!
//! The thesis model is compiled with [`Closed`] ports, which are the identity and vanish. An
//! extended model carries [`Open`] ports; at their quiet values (zero for a sum, one for a factor)
//! they change no bit.

use crate::mast::same;
use crate::scalar::{Mask, Scalar};

/// How a port joins its quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Join {
    /// The port's value is added; quiet at zero.
    Sum,
    /// The quantity is multiplied by the port's value; quiet at one.
    Factor,
}

/// What there is to know of a port.
#[derive(Debug, Clone, Copy)]
pub struct PortSpec {
    pub name: &'static str,
    pub unit: &'static str,
    pub join: Join,
    /// What counts as one there, of a sum in its unit; of a factor, of its logarithm.
    pub typical: f64,
    pub meaning: &'static str,
}

macro_rules! ports {
    ($($name:ident: $join:ident, $unit:literal, $typical:literal, $meaning:literal;)*) => {
        /// One method per port: takes the quantity of the thesis model, gives it with the port's share.
        pub trait Ports<S: Scalar>: Copy {
            /// True where a port may have a value at all.
            const OPEN: bool = true;
            $(#[doc = $meaning]
            #[inline(always)]
            fn $name(&self, quantity: S) -> S {
                quantity
            })*
        }

        /// No port is open: the thesis model.
        #[derive(Debug, Clone, Copy)]
        pub struct Closed;
        impl<S: Scalar> Ports<S> for Closed {
            const OPEN: bool = false;
        }

        /// All ports of one lift, each with its value.
        #[derive(Debug, Clone, Copy)]
        pub struct Open<S> {
            $(pub $name: S,)*
        }

        impl<S: Scalar> Open<S> {
            /// Every port at its quiet value.
            #[inline(always)]
            pub fn quiet() -> Self {
                Open { $($name: ports!(@quiet $join),)* }
            }

            /// What both do.
            #[inline(always)]
            pub fn joined(&self, other: &Self) -> Self {
                Open { $($name: ports!(@join $join, self.$name, other.$name),)* }
            }

            /// In the order of [`PORTS`].
            #[inline(always)]
            pub fn each(&mut self) -> [&mut S; PORTS.len()] {
                [$(&mut self.$name,)*]
            }

            /// Moves the port at `place` of [`PORTS`] by `value` from where it is.
            pub fn push(&mut self, place: usize, value: S) {
                let port = &mut *self.each()[place];
                *port = *port + value;
            }

            /// Adds `amount` to a sum, or to the logarithm of a factor, at the port that `place` names in [`PORTS`].
            #[inline(always)]
            pub fn bend(&mut self, place: S, amount: S) {
                let factor = amount.exp();
                for (k, (port, spec)) in self.each().into_iter().zip(PORTS).enumerate() {
                    let here = is_place(place, k);
                    if !here.any() {
                        continue; // as nearly all: all lanes of a run name the same
                    }
                    let bent = match spec.join {
                        Join::Sum => *port + amount,
                        Join::Factor => *port * factor,
                    };
                    *port = S::select(here, bent, *port);
                }
            }
        }

        impl<S: Scalar> Ports<S> for Open<S> {
            $(#[inline(always)]
            fn $name(&self, quantity: S) -> S {
                ports!(@join $join, quantity, self.$name)
            })*
        }

        /// One row per port of a lift.
        pub const PORTS: &[PortSpec] = &[
            $(PortSpec {
                name: stringify!($name),
                unit: $unit,
                join: Join::$join,
                typical: $typical,
                meaning: $meaning,
            },)*
        ];
    };
    (@quiet Sum) => { S::zero() };
    (@quiet Factor) => { S::one() };
    (@join Sum, $a:expr, $b:expr) => { $a + $b };
    (@join Factor, $a:expr, $b:expr) => { $a * $b };
}

/// True where the number `choice`, rounded, names the `k`-th of a list.
#[inline(always)]
pub fn is_place<S: Scalar>(choice: S, k: usize) -> S::Mask {
    let past = choice - S::constant(k as f64);
    past.lt(S::constant(0.5)).and(past.lt(S::constant(-0.5)).not())
}

/// Where [`PORTS`] lists a port; one that it lacks does not compile.
pub const fn port(name: &str) -> usize {
    let mut k = 0;
    while !same(PORTS[k].name.as_bytes(), name.as_bytes()) {
        k += 1;
    }
    k
}

// Typical sizes are some percent of what the quantity is while an empty lift is lowered: a free shape of some tenths
// is then a fault worth finding, whatever the port. Of factors it is the whole, but for the friction force, whose
// bristles are stiffer than fixed steps follow when they are multiplied by four.
ports! {
    current: Sum, "A", 0.1, "Command at the proportional valve, (3.13).";
    opening: Factor, "1", 1.0, "Opening of the proportional valve, (3.14).";
    viscosity: Factor, "1", 1.0, "Kinematic viscosity, (3.1).";
    orifice_gain: Factor, "1", 1.0, "Flow through both orifices at a given area and drop, C_D sqrt(2/rho) in (3.7).";
    preset_pressure: Sum, "Pa", 1e5, "Preset pressure of the compensator, (3.15).";
    bulk_modulus: Factor, "1", 1.0, "Bulk modulus of the cylinder's oil, (3.2).";
    cylinder_flow: Sum, "m3/s", 5e-5, "Flow into the cylinder, (3.20).";
    return_pressure: Sum, "Pa", 1e5, "Pressure behind the compensator, p_D in (3.18).";
    inlet_pressure: Sum, "Pa", 1e5, "Pressure before the proportional valve, p_A in (3.14) and in the drop of (3.15).";
    sensed_drop: Factor, "1", 1.0, "Drop across the proportional valve as the compensator senses it, p_xy in (3.15).";
    viscous_friction: Factor, "1", 1.0, "Viscous friction coefficient, (3.5).";
    coulomb_friction: Factor, "1", 1.0, "Coulomb and breakaway friction, g_s in (3.4).";
    friction: Factor, "1", 0.5, "Whole friction force, (3.5).";
    inertia: Sum, "kg", 100.0, "Inertia at the cylinder, (3.27) and (3.33).";
    force: Sum, "N", 2e3, "Upward force on the cylinder, (3.27) and (3.33).";
    dry_friction: Sum, "N", 300.0, "Additional dry friction, beside (3.5) and of any load, full from some centimetres a second on.";
}
