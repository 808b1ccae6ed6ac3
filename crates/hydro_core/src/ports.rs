//! The places where an effect, or an unknown input of a diagnosis, may enter the equations.
//!
//! The thesis model is compiled with [`Closed`] ports, which are the identity and vanish. An
//! extended model carries [`Open`] ports; at their quiet values (zero for a sum, one for a factor)
//! they change no bit.

use crate::scalar::Scalar;

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
    pub meaning: &'static str,
}

macro_rules! ports {
    ($($name:ident: $join:ident, $unit:literal, $meaning:literal;)*) => {
        /// One method per port: takes the quantity of the thesis model, gives it with the port's share.
        pub trait Ports<S: Scalar>: Copy {
            $(#[doc = $meaning]
            #[inline(always)]
            fn $name(&self, quantity: S) -> S {
                quantity
            })*
        }

        /// No port is open: the thesis model.
        #[derive(Debug, Clone, Copy)]
        pub struct Closed;
        impl<S: Scalar> Ports<S> for Closed {}

        /// All ports of one lift, each with its value.
        #[derive(Debug, Clone, Copy)]
        pub struct Open<S> {
            $(pub $name: S,)*
        }

        impl<S: Scalar> Open<S> {
            /// Every port at its quiet value.
            pub fn quiet() -> Self {
                Open { $($name: ports!(@quiet $join),)* }
            }

            /// What both do.
            #[inline(always)]
            pub fn joined(&self, other: &Self) -> Self {
                Open { $($name: ports!(@join $join, self.$name, other.$name),)* }
            }

            /// Moves the port at `place` of [`PORTS`] by `value` from where it is.
            pub fn push(&mut self, place: usize, value: S) {
                let ports = [$(&mut self.$name,)*];
                *ports[place] = *ports[place] + value;
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
            $(PortSpec { name: stringify!($name), unit: $unit, join: Join::$join, meaning: $meaning },)*
        ];
    };
    (@quiet Sum) => { S::zero() };
    (@quiet Factor) => { S::one() };
    (@join Sum, $a:expr, $b:expr) => { $a + $b };
    (@join Factor, $a:expr, $b:expr) => { $a * $b };
}

ports! {
    current: Sum, "A", "Command at the proportional valve, (3.13).";
    opening: Factor, "1", "Opening of the proportional valve, (3.14).";
    viscosity: Factor, "1", "Kinematic viscosity, (3.1).";
    preset_pressure: Sum, "Pa", "Preset pressure of the compensator, (3.15).";
    bulk_modulus: Factor, "1", "Bulk modulus of the cylinder's oil, (3.2).";
    cylinder_flow: Sum, "m3/s", "Flow into the cylinder, (3.20).";
    return_pressure: Sum, "Pa", "Pressure behind the compensator, p_D in (3.18).";
    inlet_pressure: Sum, "Pa", "Pressure before the proportional valve, p_A in (3.14) and in the drop of (3.15).";
    sensed_drop: Factor, "1", "Drop across the proportional valve as the compensator senses it, p_xy in (3.15).";
    viscous_friction: Factor, "1", "Viscous friction coefficient, (3.5).";
    coulomb_friction: Factor, "1", "Coulomb and breakaway friction, g_s in (3.4).";
    friction: Factor, "1", "Whole friction force, (3.5).";
    inertia: Sum, "kg", "Inertia at the cylinder, (3.27) and (3.33).";
    force: Sum, "N", "Upward force on the cylinder, (3.27) and (3.33).";
}
