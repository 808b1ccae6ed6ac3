//! Both lifts, or one, composed into a right-hand side.
//!
//! Positions and velocities are of the cylinders, positive upward: lowering is negative. A lift's
//! forks relative to the second stage move twice as far as the free lift's cylinder.

mod extended;

pub use extended::{Extended, UnknownInput};

use crate::effects::StateSpec;
use crate::parameters::LiftParameters;
use crate::parts::area_table::AreaTable;
use crate::parts::bulk_modulus::BulkModulus;
use crate::parts::compensator::Compensator;
use crate::parts::end_stop::EndStop;
use crate::parts::force_balance::ForceBalance;
use crate::parts::lugre::LuGre;
use crate::parts::orifice::Orifice;
use crate::parts::valve::{Valve, ValveState};
use crate::parts::viscosity::viscosity;
use crate::parts::{cylinder, volume};
use crate::ports::{Closed, Ports};
use crate::scalar::{Mask, Scalar};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LiftName {
    Free,
    Main,
}

impl LiftName {
    pub const BOTH: [LiftName; 2] = [LiftName::Free, LiftName::Main];

    pub fn as_str(self) -> &'static str {
        match self {
            LiftName::Free => "free",
            LiftName::Main => "main",
        }
    }

    /// Cylinder position at which recordings start [m] (thesis reading, reference trajectories).
    pub fn start_position(self) -> f64 {
        match self {
            LiftName::Free => 0.98,
            LiftName::Main => 1.96,
        }
    }
}

macro_rules! lift_states {
    ($($field:ident: $name:literal, $unit:literal, $scale:expr, $meaning:literal;)*) => {
        /// The states of one lift.
        #[derive(Debug, Clone, Copy)]
        pub struct LiftState<S> {
            $(#[doc = concat!($meaning, " [", $unit, "].")] pub $field: S,)*
        }

        /// One row per state of a lift, in the order of the state vector.
        pub const LIFT_STATES: &[StateSpec] = &[
            $(StateSpec { name: $name, unit: $unit, scale: $scale, meaning: $meaning },)*
        ];

        impl<S: Scalar> LiftState<S> {
            #[inline(always)]
            pub fn from_slice(x: &[S]) -> Self {
                let [$($field,)*] = *x else { unreachable!("a lift has {STATES} states") };
                LiftState { $($field,)* }
            }

            #[inline(always)]
            pub fn write(&self, x: &mut [S]) {
                let [$($field,)*] = x else { unreachable!("a lift has {STATES} states") };
                $(*$field = self.$field;)*
            }
        }
    };
}

lift_states! {
    i: "valve_current", "A", 1.0, "effective current of the proportional valve";
    i_rate: "valve_current_rate", "A/s", 10.0, "its rate";
    i_bristle: "valve_bristle", "A", 0.05, "bristle of the valve's hysteresis";
    x: "position", "m", 1.0, "cylinder position";
    v: "velocity", "m/s", 0.5, "cylinder velocity, upward positive";
    z: "friction_bristle", "m", 1.0, "bristle of the mast's friction";
    p_a: "cylinder_pressure", "Pa", 1e7, "pressure in the cylinder";
    p_b: "volume_pressure", "Pa", 1e7, "pressure between valve and compensator";
    a_comp: "compensator_area", "m2", 1e-5, "opening of the compensator";
}

impl<S: Copy> LiftState<S> {
    /// That of its valve.
    #[inline(always)]
    pub fn valve(&self) -> ValveState<S> {
        ValveState { i: self.i, rate: self.i_rate, bristle: self.i_bristle }
    }

    #[inline(always)]
    pub fn set_valve(&mut self, valve: ValveState<S>) {
        (self.i, self.i_rate, self.i_bristle) = (valve.i, valve.rate, valve.bristle);
    }
}

/// Number of states of one lift.
pub const STATES: usize = LIFT_STATES.len();
/// Place of the position among them.
pub const POSITION: usize = place("position");
/// Place of the velocity.
pub const VELOCITY: usize = place("velocity");
/// Place of the cylinder pressure.
pub const CYLINDER_PRESSURE: usize = place("cylinder_pressure");

/// Where [`LIFT_STATES`] lists a state; one that it lacks does not compile.
pub const fn place(name: &str) -> usize {
    let mut k = 0;
    while !same(LIFT_STATES[k].name.as_bytes(), name.as_bytes()) {
        k += 1;
    }
    k
}

/// Whether two names are the same, where `==` is not at hand.
pub(crate) const fn same(a: &[u8], b: &[u8]) -> bool {
    let mut k = 0;
    while k < a.len() && k < b.len() && a[k] == b[k] {
        k += 1;
    }
    k == a.len() && k == b.len()
}

/// One lift with everything that stays fixed during a run worked out.
#[derive(Debug, Clone)]
pub struct Lift<S> {
    pub valve: Valve<S>,
    pub table: AreaTable<S>,
    pub orifice_a: Orifice<S>,
    pub orifice_b: Orifice<S>,
    pub compensator: Compensator<S>,
    pub bulk: BulkModulus<S>,
    pub friction: LuGre<S>,
    pub balance: ForceBalance<S>,
    pub stop: EndStop<S>,
    pub volume_stiffness: S,
    pub v_0: S,
    pub p_tank: S,
    /// Mass that moves with the cylinder [kg].
    pub m_c: S,
    /// Mass that moves twice as fast, with the load [kg].
    pub m: S,
    /// That load [kg].
    pub load: S,
    nu_0: S,
    /// Viscosity-temperature coefficient [1/K].
    pub lambda: S,
    /// Reference temperature of the viscosity [K].
    pub t_0: S,
    /// Kinematic viscosity at the present temperature [m²/s].
    pub nu: S,
}

impl<S: Scalar> Lift<S> {
    pub fn new(p: &LiftParameters<S>, current: &[S], area: &[S], load_kg: S) -> Self {
        let m = p.m_moving + load_kg;
        Lift {
            valve: Valve::new(p.omega, p.damping, p.f_hs, p.valve_sigma_0, p.valve_sigma_1),
            table: AreaTable::new(current, area, p.valve_a_min),
            orifice_a: Orifice::new(p.valve_c_d, p.valve_re_cr, p.density),
            orifice_b: Orifice::new(p.comp_c_d, p.comp_re_cr, p.density),
            compensator: Compensator::new(
                p.comp_a_max,
                p.comp_a_leak,
                p.comp_a_spool,
                p.comp_p_reg,
                p.comp_p_set,
                p.comp_tau,
                p.comp_c_d,
                p.comp_theta,
            ),
            bulk: BulkModulus::new(p.e_max, p.p_max, p.a_1, p.a_2, p.a_3),
            friction: LuGre::new(p.f_pr + m * p.f_cfr, p.k_brk, p.c_v, p.sigma_0, p.sigma_1, p.sigma_2),
            balance: ForceBalance::new(p.m_c, m, p.g, p.area),
            stop: EndStop { lower: p.stroke_lower, upper: p.stroke_upper },
            volume_stiffness: p.volume_bulk / p.volume,
            v_0: p.v_0,
            p_tank: p.p_tank,
            m_c: p.m_c,
            m,
            load: load_kg,
            nu_0: p.nu_0,
            lambda: p.lambda,
            t_0: p.t_0,
            nu: p.nu_0,
        }
    }

    /// At rest at `x`: no friction, p_A in equilibrium, p_B half of it, the compensator closed.
    pub fn at_rest(&self, x: S) -> LiftState<S> {
        let zero = S::zero();
        let p_a = self.balance.equilibrium_pressure();
        LiftState {
            i: zero,
            i_rate: zero,
            i_bristle: zero,
            x,
            v: zero,
            z: zero,
            p_a,
            p_b: S::constant(0.5) * p_a,
            a_comp: self.compensator.a_leak,
        }
    }

    /// Net upward force on the cylinder [N] and the rate of the friction bristle [m/s].
    ///
    /// Dry friction that a port adds follows the sign of the velocity at once: the bristles of (3.4) give way over
    /// decimetres, so that what they carry cannot change along the stroke as fast as rollers and joints of rails do.
    #[inline(always)]
    pub fn force_and_bristle_rate<P: Ports<S>>(&self, v: S, z: S, p_a: S, ports: &P) -> (S, S) {
        let sigma_2 = ports.viscous_friction(self.friction.sigma_2);
        let coulomb = ports.coulomb_friction(self.friction.coulomb);
        let (friction, dz) = self.friction.force_and_rate_at(v, z, coulomb, sigma_2);
        let mut friction = ports.friction(friction);
        if P::OPEN {
            friction = friction + ports.dry_friction(S::zero()) * direction(v);
        }
        (ports.force(self.balance.net_force(p_a, friction)), dz)
    }

    /// Opening of the proportional valve [m²] at its effective current.
    #[inline(always)]
    pub fn opening<P: Ports<S>>(&self, i: S, ports: &P) -> S {
        ports.opening(self.table.at(i))
    }

    /// The orifices of the proportional valve and of the compensator.
    #[inline(always)]
    pub fn orifices<P: Ports<S>>(&self, ports: &P) -> (Orifice<S>, Orifice<S>) {
        let gain = |gain: S| ports.orifice_gain(gain);
        (self.orifice_a.with_gain(gain), self.orifice_b.with_gain(gain))
    }

    /// dp_A/dt over the flow into the cylinder, E/V [Pa/m³].
    #[inline(always)]
    pub fn cylinder_stiffness<P: Ports<S>>(&self, p_a: S, x: S, ports: &P) -> S {
        cylinder::stiffness(ports.bulk_modulus(self.bulk.at(p_a)), self.v_0, self.balance.area, x)
    }

    /// Rates of the valve and of the oil; those of the mechanics stand in [`Mast::rates`].
    #[inline(always)]
    fn oil_rates<P: Ports<S>>(&self, s: &LiftState<S>, ports: &P) -> (S, S, S) {
        let nu = ports.viscosity(self.nu);
        let p_d = ports.return_pressure(self.p_tank);
        // The floor of Figure A.10.
        let a_comp = s.a_comp.max(S::constant(f64::EPSILON));
        let drop = ports.inlet_pressure(s.p_a) - s.p_b;
        let (a, b) = self.orifices(ports);
        let q_a = a.flow(a.critical_squared(nu), self.opening(s.i, ports), drop);
        let q_b = b.flow(b.critical_squared(nu), a_comp, s.p_b - p_d);
        let p_set = ports.preset_pressure(self.compensator.p_set);
        let into = ports.cylinder_flow(-q_a) - self.balance.area * s.v;
        (
            self.cylinder_stiffness(s.p_a, s.x, ports) * into,
            volume::pressure_rate(self.volume_stiffness, q_a, q_b),
            self.compensator.rate(ports.sensed_drop(drop), s.p_b - p_d, a_comp, p_set),
        )
    }
}

/// The speed [m/s] at which a dry friction has 0.7 of its force.
const CREEP: f64 = 0.01;

/// The sign of a velocity, smooth within a few [`CREEP`]: v/√(v² + CREEP²).
#[inline(always)]
fn direction<S: Scalar>(v: S) -> S {
    v / (v * v + S::constant(CREEP * CREEP)).sqrt()
}

/// What effects may read: the states and inputs of the simulated lifts.
#[derive(Debug, Clone, Copy)]
pub struct Bus<S, const L: usize> {
    pub lifts: [LiftState<S>; L],
    /// Commands [A].
    pub command: [S; L],
    /// Pressures in the tank [Pa].
    pub p_tank: [S; L],
    pub oil_temperature_degc: S,
}

/// What stands beside the thesis model: nothing, or effects.
pub trait Physics<S: Scalar>: Clone {
    type Ports: Ports<S>;
    /// True where the lifts' accelerations may be joined.
    const JOINED: bool;
    /// True where nothing comes between the command and the valve.
    const COMMAND_AS_GIVEN: bool;
    /// How many states the effects own.
    fn states(&self) -> usize;
    fn ports<const L: usize>(&self, bus: &Bus<S, L>, own: &[S]) -> ([Self::Ports; L], S);
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]);
    /// The effects' states where a run starts.
    fn start<const L: usize>(&self, bus: &Bus<S, L>, own: &mut [S]);
    /// Told by the fast path before each substep: the time in its middle [s].
    #[inline(always)]
    fn at_time(&mut self, _t: f64) {}
    /// Moves unknown inputs, which stand in pairs: the first of each to one centre [s], the second to the other.
    fn move_inputs(&mut self, _centres: [f64; 2]) {}
    /// How much later each lift's command reaches its valve [s]; None: none does.
    fn delays<const L: usize>(&self) -> Option<[S; L]> {
        None
    }
    /// As [`Physics::rates`], but for the states that relax, which are left out.
    fn explicit_rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]);
    /// Advances the states that relax by `h` [s], exactly; see [`crate::effects::Effect::relax`].
    fn relax<const L: usize>(&self, from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]);
}

/// The thesis and nothing else: no state, no arithmetic of the catalogue.
#[derive(Debug, Clone, Copy)]
pub struct Thesis;

impl<S: Scalar> Physics<S> for Thesis {
    type Ports = Closed;
    const JOINED: bool = false;
    const COMMAND_AS_GIVEN: bool = true;
    #[inline(always)]
    fn states(&self) -> usize {
        0
    }
    #[inline(always)]
    fn ports<const L: usize>(&self, _bus: &Bus<S, L>, _own: &[S]) -> ([Closed; L], S) {
        ([Closed; L], S::zero())
    }
    #[inline(always)]
    fn rates<const L: usize>(&self, _bus: &Bus<S, L>, _own: &[S], _rates: &mut [S]) {}
    #[inline(always)]
    fn start<const L: usize>(&self, _bus: &Bus<S, L>, _own: &mut [S]) {}
    #[inline(always)]
    fn explicit_rates<const L: usize>(&self, _bus: &Bus<S, L>, _own: &[S], _rates: &mut [S]) {}
    #[inline(always)]
    fn relax<const L: usize>(&self, _from: &Bus<S, L>, _to: &Bus<S, L>, _h: S, _own: &mut [S]) {}
}

/// L lifts in one mast. The state vector is lift after lift, then the effects' states.
#[derive(Debug, Clone)]
pub struct Mast<S, X, const L: usize> {
    pub lifts: [Lift<S>; L],
    pub physics: X,
    pub command: [S; L],
    pub oil_temperature_degc: S,
}

/// Which lifts rest on an end of their stroke.
pub enum Resting<S: Scalar, const L: usize> {
    /// Those at these positions [m] that their acceleration presses onto a stop.
    At([S; L]),
    /// These.
    Held([S::Mask; L]),
}

impl<S: Scalar, const L: usize> Resting<S, L> {
    #[inline(always)]
    fn of(&self, k: usize, stop: &EndStop<S>, acceleration: S) -> S::Mask {
        match self {
            Resting::At(x) => stop.blocks(x[k], acceleration),
            Resting::Held(held) => held[k],
        }
    }
}

/// A state vector of `dim` with the lifts at rest at `from` [m], kept within their strokes, and zeros after them.
pub fn resting<S: Scalar, const L: usize>(lifts: &[Lift<S>; L], from: [S; L], dim: usize) -> Vec<S> {
    let mut x = vec![S::zero(); dim];
    for ((lift, from), own) in lifts.iter().zip(from).zip(x.chunks_exact_mut(STATES)) {
        lift.at_rest(from.clamp_to(lift.stop.lower, lift.stop.upper)).write(own);
    }
    x
}

impl<S: Scalar, X: Physics<S>, const L: usize> Mast<S, X, L> {
    /// The mast under the inputs with which a run starts, [`Mast::set_inputs`], and the state vector there: lifts at
    /// rest at `from` [m], kept within their strokes, effects as they start.
    pub fn at_rest(
        lifts: [Lift<S>; L],
        physics: X,
        from: [S; L],
        command: [S; L],
        oil_temperature_degc: S,
    ) -> (Self, Vec<S>) {
        let mut start = resting(&lifts, from, L * STATES + physics.states());
        let mut mast = Mast { lifts, physics, command, oil_temperature_degc };
        mast.set_inputs(command, oil_temperature_degc);
        mast.start_effects(&mut start);
        (mast, start)
    }

    /// Length of the state vector.
    pub fn dim(&self) -> usize {
        L * STATES + self.physics.states()
    }

    /// Holds the command [A] and the oil temperature [°C] from now on.
    #[inline(always)]
    pub fn set_inputs(&mut self, command: [S; L], oil_temperature_degc: S) {
        self.command = command;
        self.oil_temperature_degc = oil_temperature_degc;
        for lift in &mut self.lifts {
            lift.nu = viscosity(lift.nu_0, lift.lambda, lift.t_0, oil_temperature_degc);
        }
    }

    /// Puts the effects' states to where a run under the present inputs starts, the lifts being where `x` has them.
    pub fn start_effects(&self, x: &mut [S]) {
        let (lifts, own) = x.split_at_mut(L * STATES);
        let lifts = std::array::from_fn(|k| LiftState::from_slice(&lifts[k * STATES..(k + 1) * STATES]));
        self.physics.start(&self.bus(lifts), own);
    }

    #[inline(always)]
    pub fn bus(&self, lifts: [LiftState<S>; L]) -> Bus<S, L> {
        Bus {
            lifts,
            command: self.command,
            p_tank: std::array::from_fn(|k| self.lifts[k].p_tank),
            oil_temperature_degc: self.oil_temperature_degc,
        }
    }

    /// Accelerations [m/s²] from net forces [N]: each lift's own, or joined by an inertia between
    /// them (Gaussian elimination, which at zero joint inertia leaves every bit as it was). A lift that rests on a
    /// stop takes no other with it; its own is as if it did not rest.
    #[inline(always)]
    pub fn accelerations(
        &self,
        force: [S; L],
        ports: &[X::Ports; L],
        joint_inertia: S,
        resting: &Resting<S, L>,
    ) -> [S; L] {
        let inertia: [S; L] = std::array::from_fn(|k| ports[k].inertia(self.lifts[k].balance.inertia));
        if !(X::JOINED && L == 2) {
            return std::array::from_fn(|k| force[k] / inertia[k]);
        }
        let mut joint = force;
        let ratio = joint_inertia / inertia[0];
        joint[1] = (force[1] - ratio * force[0]) / (inertia[1] - ratio * joint_inertia);
        joint[0] = (force[0] - joint_inertia * joint[1]) / inertia[0];
        // With the other at rest a lift accelerates by itself. Its being pressed onto a stop with the other moving
        // makes the other move by itself, which may then be pressed onto one, too.
        let alone: [S; L] = std::array::from_fn(|k| force[k] / inertia[k]);
        let rests = |k: usize, acceleration: S| resting.of(k, &self.lifts[k].stop, acceleration);
        let pressed = [rests(0, joint[0]), rests(1, joint[1])];
        let by_itself =
            [pressed[1].or(pressed[0].and(rests(1, alone[1]))), pressed[0].or(pressed[1].and(rests(0, alone[0])))];
        std::array::from_fn(|k| S::select(by_itself[k], alone[k], joint[k]))
    }

    /// Time derivatives of the whole state vector with no lift on a stop.
    pub fn rates(&self, x: &[S], dx: &mut [S]) {
        self.rates_resting(x, dx, &Resting::Held([S::one().lt(S::zero()); L]));
    }

    /// Time derivatives of the whole state vector; of a lift that rests on a stop, see [`Mast::accelerations`], those
    /// that it would have without, which the integrators take off.
    #[inline(always)]
    pub fn rates_resting(&self, x: &[S], dx: &mut [S], resting: &Resting<S, L>) {
        let lifts: [LiftState<S>; L] = std::array::from_fn(|k| LiftState::from_slice(&x[k * STATES..(k + 1) * STATES]));
        let own = &x[L * STATES..];
        let bus = self.bus(lifts);
        let (ports, joint) = self.physics.ports(&bus, own);
        let mechanics: [(S, S); L] = std::array::from_fn(|k| {
            let s = &lifts[k];
            self.lifts[k].force_and_bristle_rate(s.v, s.z, s.p_a, &ports[k])
        });
        let acceleration = self.accelerations(std::array::from_fn(|k| mechanics[k].0), &ports, joint, resting);
        for k in 0..L {
            let (lift, s) = (&self.lifts[k], &lifts[k]);
            let command = ports[k].current(self.command[k]);
            let valve = lift.valve.rates(s.valve(), command);
            let (dp_a, dp_b, da_comp) = lift.oil_rates(s, &ports[k]);
            LiftState {
                i: valve.i,
                i_rate: valve.rate,
                i_bristle: valve.bristle,
                x: s.v,
                v: acceleration[k],
                z: mechanics[k].1,
                p_a: dp_a,
                p_b: dp_b,
                a_comp: da_comp,
            }
            .write(&mut dx[k * STATES..(k + 1) * STATES]);
        }
        self.physics.rates(&bus, own, &mut dx[L * STATES..]);
    }
}
