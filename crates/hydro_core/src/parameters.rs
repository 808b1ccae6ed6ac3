//! The table of a lift's parameters: name, unit, bounds and meaning, once.
//!
//! Both lifts have the same parameters; a truck's names carry the lift in front,
//! `free.viscosity.nu_0`. Values of a particular truck live in its TOML file. The thesis gives no
//! bounds: these are wide, each with its reason, and meant to catch a wrong unit, not another truck.
//! `origin` is the column "Source" of Tables 5.1 and 5.2 (Fri & Fahlén, 2017).

use crate::parts::area_table::MOST_KNOTS;
use crate::scalar::Scalar;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Positive, and spread over decades: estimated and scattered by its logarithm.
    Log,
    Linear,
    /// Above 1, and only ever under a logarithm: estimated by the logarithm of its logarithm.
    LogLog,
    /// An angle that counts by its cosine: estimated by the logarithm of that.
    LogCos,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    Given,
    Chosen,
    Steady,
    Prms,
}

/// What there is to know of a parameter, whatever its value.
#[derive(Debug, Clone, Copy)]
pub struct ParameterSpec {
    /// Name within a lift or an effect.
    pub name: &'static str,
    /// As the source prints it.
    pub symbol: &'static str,
    pub unit: &'static str,
    pub lower: f64,
    pub upper: f64,
    pub scale: Scale,
    pub origin: Origin,
    /// Where it enters.
    pub equation: &'static str,
    pub meaning: &'static str,
    pub bounds_reason: &'static str,
}

macro_rules! lift_parameters {
    ($($field:ident: $name:literal, $symbol:literal, $unit:literal, $lower:expr, $upper:expr, $scale:ident,
       $origin:ident, $equation:literal, $meaning:literal, $reason:literal;)*) => {
        /// The parameters of one lift but for its area table, in the order of [`LIFT_PARAMETERS`].
        #[derive(Debug, Clone, Copy)]
        pub struct LiftParameters<S> {
            $(#[doc = concat!($meaning, " [", $unit, "], ", $equation, ".")] pub $field: S,)*
        }

        /// One row per scalar parameter of a lift.
        pub const LIFT_PARAMETERS: &[ParameterSpec] = &[
            $(ParameterSpec { name: $name, symbol: $symbol, unit: $unit, lower: $lower, upper: $upper,
                scale: Scale::$scale, origin: Origin::$origin, equation: $equation, meaning: $meaning,
                bounds_reason: $reason },)*
        ];

        impl<S: Scalar> LiftParameters<S> {
            /// Takes the values in the order of [`LIFT_PARAMETERS`].
            pub fn from_values(values: &[S]) -> Self {
                let mut next = values.iter().copied();
                let mut take = || next.next().expect("as many values as rows in LIFT_PARAMETERS");
                LiftParameters { $($field: take(),)* }
            }
        }
    };
}

lift_parameters! {
    nu_0: "viscosity.nu_0", "η0", "m2/s", 1e-6, 2e-3, Log, Prms, "(3.1)",
        "kinematic viscosity of the oil at the reference temperature",
        "1 cSt is thinner than any hydraulic oil, 2000 cSt is a VG 320 near its pour point";
    t_0: "viscosity.T_0", "T0", "K", 250.0, 350.0, Linear, Chosen, "(3.1)",
        "reference temperature of the viscosity law",
        "the range in which a truck's oil works";
    lambda: "viscosity.lambda", "λ", "1/K", 0.0, 0.15, Linear, Prms, "(3.1)",
        "viscosity-temperature coefficient",
        "viscosity does not rise with temperature; mineral oils reach 0.1/K when cold";
    density: "oil.density", "ρ", "kg/m3", 600.0, 1300.0, Log, Given, "(3.7)",
        "density of the oil",
        "from light fuels to water glycols";
    g: "gravity.g", "g", "m/s2", 9.7, 9.9, Linear, Given, "(3.27), (3.33)",
        "gravitational acceleration, positive",
        "9.76 to 9.83 over the Earth's surface";
    p_tank: "tank.pressure", "p_T", "Pa", 5e4, 5e5, Log, Given, "Figure A.7",
        "absolute pressure in the tank",
        "high altitude to a pressurised tank";
    volume: "volume.V", "V", "m3", 1e-7, 1e-4, Log, Given, "(3.19)",
        "control volume between proportional valve and compensator",
        "a bore of 0.1 cm3 to a block of 0.1 l";
    volume_bulk: "volume.E", "E", "Pa", 1e7, 5e9, Log, Chosen, "(3.19)",
        "bulk modulus of the control volume, constant",
        "foaming oil to more than steel-cased oil (2 GPa) can have";
    area: "cylinder.area", "A_c", "m2", 1e-4, 0.1, Log, Given, "(3.20)",
        "piston area of the lift's cylinders, all together",
        "a piston of 11 mm to one of 360 mm";
    v_0: "cylinder.V_0", "V0", "m3", 1e-5, 0.2, Log, Prms, "(3.21)",
        "oil volume between cylinder and valve with the cylinder at its bottom",
        "a bare hose to a 200 l accumulator of a dead volume";
    m_c: "cylinder.mass", "m_c", "kg", 0.1, 5e3, Log, Given, "(3.25), (3.33)",
        "mass that moves with the cylinder: piston and rod, on the main lift with the first stage",
        "lighter than any rod to heavier than any mast stage";
    stroke_lower: "cylinder.stroke_lower", "x_min", "m", -0.1, 5.0, Linear, Chosen, "Figure A.11",
        "lower end of the cylinder's stroke",
        "the mast's own height";
    stroke_upper: "cylinder.stroke_upper", "x_max", "m", 0.05, 20.0, Linear, Chosen, "Figure A.11",
        "upper end of the cylinder's stroke",
        "the tallest masts lift to some 18 m";
    m_moving: "mass.moving", "m_L", "kg", 1.0, 2e4, Log, Given, "(3.25), (3.31)",
        "mass that moves twice as fast as the cylinder, without load",
        "an empty carriage to the heaviest mast stage";
    e_max: "bulk.E_max", "E_max", "Pa", 1e8, 5e9, Log, Chosen, "(3.2)",
        "bulk modulus that scales the law",
        "oil without air has 1.4 to 2 GPa";
    p_max: "bulk.p_max", "p_max", "Pa", 1e6, 1e8, Log, Chosen, "(3.2)",
        "pressure that scales the bulk-modulus law; no limit of the pressure",
        "working pressures of mobile hydraulics";
    a_1: "bulk.a_1", "a1", "1", 1e-3, 5.0, Log, Prms, "(3.2)",
        "factor of the bulk-modulus law",
        "with a3 it may give 1 MPa to 20 GPa at rest";
    a_2: "bulk.a_2", "a2", "1", 0.0, 1e4, Linear, Prms, "(3.2)",
        "weight of the pressure in the bulk-modulus law",
        "0 is a constant bulk modulus; above 1e4 a3 no longer matters";
    a_3: "bulk.a_3", "a3", "1", 1.5, 1e5, LogLog, Prms, "(3.2)",
        "offset of the bulk-modulus law",
        "above 1, so that the bulk modulus is positive at zero pressure";
    f_pr: "friction.F_pr", "F_pr", "N", 0.0, 2e4, Linear, Prms, "(3.34)",
        "preload friction force",
        "friction takes nothing to the weight of two tonnes";
    k_brk: "friction.K_brk", "K_brk", "1", 1.0, 30.0, Log, Prms, "(3.34)",
        "breakaway friction over Coulomb friction",
        "starting takes no less force than sliding";
    c_v: "friction.c_v", "c_v", "s/m", 1.0, 1e4, Log, Prms, "(3.34)",
        "transition coefficient of the Stribeck curve",
        "transition between 0.1 mm/s and 1 m/s";
    f_cfr: "friction.f_cfr", "f_cfr", "N/kg", 0.0, 20.0, Linear, Prms, "(3.34)",
        "Coulomb friction per moving mass",
        "no more than twice the weight itself";
    sigma_0: "friction.sigma_0", "σ0", "N/m", 1.0, 1e8, Log, Prms, "(3.4), (3.5)",
        "stiffness of the bristles",
        "a rubber band to steel on steel";
    sigma_1: "friction.sigma_1", "σ1", "N s/m", 0.0, 1e6, Linear, Prms, "(3.5)",
        "damping of the bristles",
        "well above forty times the thesis's values";
    sigma_2: "friction.sigma_2", "σ2", "N s/m", 0.0, 1e6, Linear, Prms, "(3.5)",
        "viscous friction",
        "well above forty times the thesis's values";
    damping: "valve.D", "D", "1", 0.1, 10.0, Log, Chosen, "(3.13)",
        "damping ratio of the proportional valve",
        "a valve rings less than a tenth or creeps more than ten is defect";
    omega: "valve.omega", "ω", "rad/s", 2.0, 1e3, Log, Prms, "(3.13)",
        "natural frequency of the proportional valve",
        "a spool of half a second to the fastest servo valves";
    f_hs: "valve.f_hs", "f_hs", "A", 1e-5, 0.5, Log, Steady, "(3.11)",
        "half width of the valve's hysteresis",
        "a single step of the ECU is 7 mA; half an ampere would bury the command";
    valve_re_cr: "valve.Re_cr", "Re_cr", "1", 1.0, 1e6, Log, Steady, "(3.8)",
        "critical Reynolds number of the proportional valve",
        "sharp edges have 10, long gaps 2300; the estimates stand in for more than geometry";
    valve_c_d: "valve.C_D", "C_D", "1", 0.1, 1.5, Log, Chosen, "(3.7)",
        "discharge coefficient of the proportional valve",
        "0.6 to 1 physically; areas estimated with it scale it";
    valve_sigma_0: "valve.sigma_0", "σ0", "1", 1e-3, 1e3, Log, Chosen, "(3.11), (3.12)",
        "stiffness of the valve's hysteresis bristle, ampere over its state",
        "three decades around the thesis's choice";
    valve_sigma_1: "valve.sigma_1", "σ1", "s", 0.0, 10.0, Linear, Chosen, "(3.12)",
        "damping of the valve's hysteresis bristle",
        "up to a hundred times the thesis's choice";
    valve_a_min: "valve.A_min", "", "m2", 1e-13, 1e-6, Log, Given, "Figure A.3",
        "least opening of the proportional valve",
        "tighter than any seat to a stuck-open valve";
    comp_a_max: "compensator.A_max", "A_max", "m2", 1e-6, 1e-3, Log, Given, "(3.15)",
        "opening of the compensator at rest",
        "a bore of 1 mm to one of 36 mm";
    comp_a_leak: "compensator.A_leak", "A_leak", "m2", 1e-13, 1e-6, Log, Given, "(3.15)",
        "least opening of the compensator",
        "tighter than any spool to a worn one";
    comp_a_spool: "compensator.A_spool", "A_spool", "m2", 1e-5, 1e-2, Log, Given, "(3.16)",
        "area of the compensator's spool",
        "a spool of 3.6 mm to one of 113 mm";
    comp_p_reg: "compensator.p_reg", "p_reg", "Pa", 1e4, 1e7, Log, Given, "(3.15)",
        "regulation range of the compensator",
        "0.1 to 100 bar";
    comp_p_set: "compensator.p_set", "p_set", "Pa", 1e4, 1e7, Log, Given, "(3.15)",
        "preset pressure of the compensator",
        "0.1 to 100 bar";
    comp_tau: "compensator.tau", "τ", "s", 1e-4, 1.0, Log, Chosen, "(3.17)",
        "time constant of the compensator's opening",
        "0.1 ms to one second";
    comp_c_d: "compensator.C_D", "C_D", "1", 0.1, 1.5, Log, Steady, "(3.16), (3.18)",
        "discharge coefficient of the compensator",
        "0.6 to 1 physically; it stands in for the geometry";
    comp_re_cr: "compensator.Re_cr", "Re_cr", "1", 1.0, 1e6, Log, Steady, "(3.8)",
        "critical Reynolds number of the compensator",
        "as for the proportional valve";
    comp_theta: "compensator.theta", "θ", "rad", 0.0, 1.571, LogCos, Steady, "(3.16)",
        "angle of the jet in the compensator, for its flow force",
        "from along the spool (0) to across it (π/2)";
}

/// The knots of the table from valve current to opening, Figure 5.5.
pub const TABLE_PARAMETERS: [ParameterSpec; 2] = [
    ParameterSpec {
        name: "valve.table_current",
        symbol: "i",
        unit: "A",
        lower: -0.5,
        upper: 3.0,
        scale: Scale::Linear,
        origin: Origin::Steady,
        equation: "(3.14)",
        meaning: "currents of the knots of the area table, rising",
        bounds_reason: "the ECU commands up to 1.75 A",
    },
    ParameterSpec {
        name: "valve.table_area",
        symbol: "A(i)",
        unit: "m2",
        lower: 0.0,
        upper: 1e-3,
        scale: Scale::Linear,
        origin: Origin::Steady,
        equation: "(3.14)",
        meaning: "openings of the proportional valve at those currents, not falling",
        bounds_reason: "up to a bore of 36 mm",
    },
];

/// Most knots an area table may have.
pub const MOST_TABLE_KNOTS: usize = MOST_KNOTS;
