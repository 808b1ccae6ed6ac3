//! The adaptive integrator on standard stiff problems with known solutions
//! (tests/reference/stiff_problems.toml), its order from halved steps, and its damping of what is
//! infinitely fast (Hairer & Wanner, *Solving Ordinary Differential Equations II*, 1996).

mod common;

use hydro_core::dual::Dual;
use hydro_core::error::Error;
use hydro_core::run::jacobian_by_duals;
use hydro_core::scalar::Scalar;
use hydro_core::solver::radau::{Radau, System};
use hydro_core::solver::statistics::Statistics;

/// dy/dt = f(t, y), written once for numbers and for duals.
trait Equations {
    fn rates<S: Scalar>(&self, t: S, y: &[S], dy: &mut [S]);
}

struct Problem<E> {
    equations: E,
    scale: Vec<f64>,
}

impl<E: Equations> System for Problem<E> {
    fn dim(&self) -> usize {
        self.scale.len()
    }
    fn rates(&self, t: f64, y: &[f64], dy: &mut [f64]) {
        self.equations.rates(t, y, dy);
    }
    fn jacobian(&self, t: f64, y: &[f64], jacobian: &mut [f64]) {
        jacobian_by_duals::<8>(y, jacobian, |y, dy| self.equations.rates(Dual::constant(t), y, dy));
    }
    fn scale(&self) -> &[f64] {
        &self.scale
    }
}

fn c<S: Scalar>(value: f64) -> S {
    S::constant(value)
}

struct Robertson;
impl Equations for Robertson {
    fn rates<S: Scalar>(&self, _t: S, y: &[S], dy: &mut [S]) {
        let (slow, middle, fast) = (c::<S>(0.04) * y[0], c::<S>(1e4) * y[1] * y[2], c::<S>(3e7) * y[1] * y[1]);
        dy[0] = middle - slow;
        dy[1] = slow - middle - fast;
        dy[2] = fast;
    }
}

struct Hires;
impl Equations for Hires {
    fn rates<S: Scalar>(&self, _t: S, y: &[S], dy: &mut [S]) {
        dy[0] = c::<S>(-1.71) * y[0] + c::<S>(0.43) * y[1] + c::<S>(8.32) * y[2] + c(0.0007);
        dy[1] = c::<S>(1.71) * y[0] - c::<S>(8.75) * y[1];
        dy[2] = c::<S>(-10.03) * y[2] + c::<S>(0.43) * y[3] + c::<S>(0.035) * y[4];
        dy[3] = c::<S>(8.32) * y[1] + c::<S>(1.71) * y[2] - c::<S>(1.12) * y[3];
        dy[4] = c::<S>(-1.745) * y[4] + c::<S>(0.43) * (y[5] + y[6]);
        let bound = c::<S>(280.0) * y[5] * y[7];
        dy[5] = c::<S>(0.69) * y[3] + c::<S>(1.71) * y[4] - c::<S>(0.43) * y[5] + c::<S>(0.69) * y[6] - bound;
        dy[6] = bound - c::<S>(1.81) * y[6];
        dy[7] = -dy[6];
    }
}

struct VanDerPol;
impl Equations for VanDerPol {
    fn rates<S: Scalar>(&self, _t: S, y: &[S], dy: &mut [S]) {
        dy[0] = y[1];
        dy[1] = ((S::one() - y[0] * y[0]) * y[1] - y[0]) * c(1e6);
    }
}

struct Oregonator;
impl Equations for Oregonator {
    fn rates<S: Scalar>(&self, _t: S, y: &[S], dy: &mut [S]) {
        dy[0] = c::<S>(77.27) * (y[1] + y[0] * (S::one() - c::<S>(8.375e-6) * y[0] - y[1]));
        dy[1] = (y[2] - (S::one() + y[0]) * y[1]) * c(1.0 / 77.27);
        dy[2] = c::<S>(0.161) * (y[0] - y[2]);
    }
}

struct Reference {
    start: Vec<f64>,
    end: f64,
    solution: Vec<f64>,
}

fn reference(name: &str) -> Reference {
    let all: toml::Table = common::read("tests/reference/stiff_problems.toml").parse().unwrap();
    let numbers = |key: &str| -> Vec<f64> {
        let number = |v: &toml::Value| v.as_float().unwrap_or_else(|| v.as_str().unwrap().parse().unwrap());
        all[name][key].as_array().unwrap().iter().map(number).collect()
    };
    Reference { start: numbers("y0"), end: all[name]["t_end"].as_float().unwrap(), solution: numbers("solution") }
}

/// Correct digits of the worst component at the end, and the work.
fn digits<E: Equations>(problem: &mut Problem<E>, reference: &Reference, tolerance: f64) -> (f64, Statistics) {
    let mut radau = Radau::new(problem, 0.0, &reference.start, tolerance, 100_000);
    radau.advance(problem, reference.end, |_| Ok(())).unwrap();
    let worst = radau.x.iter().zip(&reference.solution).map(|(y, r)| (y / r - 1.0).abs()).fold(0.0, f64::max);
    (-worst.log10(), radau.statistics)
}

/// The ladder 1e-2, 1e-3, … 1e-10: the error at each rung stays below the tolerance, and it falls
/// with the tolerance at least in proportion and at most as its power 5/4 (the step follows an
/// estimate of order h⁴, the global error is of order h⁵).
#[track_caller]
fn assert_ladder<E: Equations>(name: &str, equations: E, scale: &[f64]) {
    let mut problem = Problem { equations, scale: scale.to_vec() };
    let reference = reference(name);
    let ladder: Vec<f64> = (2..=10).map(|k| digits(&mut problem, &reference, 10f64.powi(-k)).0).collect();
    for (k, digits) in ladder.iter().enumerate() {
        assert!(*digits >= (k + 2) as f64, "{name}: {digits:.2} digits at 1e-{}; the ladder is {ladder:.2?}", k + 2);
    }
    let slope = (ladder[8] - ladder[0]) / 8.0;
    assert!((1.0..1.3).contains(&slope), "{name}: error ~ tolerance^{slope:.2}; the ladder is {ladder:.2?}");
}

// A scale is the size below which a component no longer matters: the smallest it is asked for.
const ROBERTSON_SCALE: [f64; 3] = [1e-6, 1e-12, 1.0];
const HIRES_SCALE: [f64; 8] = [1e-4; 8];
const VAN_DER_POL_SCALE: [f64; 2] = [0.1; 2];
const OREGONATOR_SCALE: [f64; 3] = [1e-2; 3];

#[test]
fn robertsons_reaction_is_followed_over_eleven_decades_of_time_at_every_tolerance() {
    assert_ladder("robertson", Robertson, &ROBERTSON_SCALE);
}

#[test]
fn hires_is_solved_to_the_tolerance() {
    assert_ladder("hires", Hires, &HIRES_SCALE);
}

#[test]
fn van_der_pols_jumps_are_solved_to_the_tolerance() {
    assert_ladder("van_der_pol", VanDerPol, &VAN_DER_POL_SCALE);
}

#[test]
fn the_oregonator_is_solved_to_the_tolerance() {
    assert_ladder("orego", Oregonator, &OREGONATOR_SCALE);
}

#[test]
fn the_work_on_stiff_problems_is_what_it_was_on_every_machine() {
    fn work<E: Equations>(name: &str, equations: E, scale: &[f64]) -> [usize; 4] {
        let mut problem = Problem { equations, scale: scale.to_vec() };
        let s = digits(&mut problem, &reference(name), 1e-6).1;
        [s.steps, s.newton_iterations, s.jacobians, s.factorisations]
    }
    let got = [
        work("robertson", Robertson, &ROBERTSON_SCALE),
        work("hires", Hires, &HIRES_SCALE),
        work("van_der_pol", VanDerPol, &VAN_DER_POL_SCALE),
        work("orego", Oregonator, &OREGONATOR_SCALE),
    ];
    assert_eq!(got, [[496, 1129, 134, 246], [228, 723, 94, 168], [937, 2225, 203, 788], [1055, 2941, 399, 803]]);
}

/// y' = λ(y − sin t) + cos t with the solution sin t (Prothero & Robinson 1974).
struct ProtheroRobinson {
    lambda: f64,
}
impl Equations for ProtheroRobinson {
    fn rates<S: Scalar>(&self, t: S, y: &[S], dy: &mut [S]) {
        dy[0] = c::<S>(self.lambda) * (y[0] - t.sin()) + t.cos();
    }
}

/// Largest errors at the steps' ends and within the steps on [0, 2] cut into `count` equal steps.
fn errors_of_equal_steps(lambda: f64, count: usize) -> (f64, f64) {
    // A scale so large that no error shortens a step; the equation is linear, so Newton's iteration is exact.
    let mut problem = Problem { equations: ProtheroRobinson { lambda }, scale: vec![1e9] };
    let mut radau = Radau::new(&problem, 0.0, &[0.0], 1e-3, 1_000);
    radau.set_longest_step(2.0 / count as f64);
    let (mut at_ends, mut within) = (0.0f64, 0.0f64);
    let mut y = [0.0];
    radau
        .advance(&mut problem, 2.0, |step| {
            step.at(step.to, &mut y);
            at_ends = at_ends.max((y[0] - step.to.sin()).abs());
            for k in 1..20 {
                let t = step.from + (step.to - step.from) * k as f64 / 20.0;
                step.at(t, &mut y);
                within = within.max((y[0] - t.sin()).abs());
            }
            Ok(())
        })
        .unwrap();
    assert_eq!(radau.statistics.steps, count);
    (at_ends, within)
}

/// Orders seen when the steps are halved: at their ends, and within.
fn orders(lambda: f64, count: usize) -> (f64, f64) {
    let (coarse, fine) = (errors_of_equal_steps(lambda, count), errors_of_equal_steps(lambda, 2 * count));
    ((coarse.0 / fine.0).log2(), (coarse.1 / fine.1).log2())
}

#[test]
fn halved_steps_show_order_five_and_a_dense_output_of_order_four() {
    for count in [4, 8, 16] {
        let (at_ends, within) = orders(-1.0, count);
        assert!((at_ends - 5.0).abs() < 0.2 && (within - 4.0).abs() < 0.2, "{count}: {at_ends:.2}, {within:.2}");
    }
}

#[test]
fn on_an_infinitely_stiff_problem_the_stage_order_three_remains() {
    // Hairer & Wanner, Table IV.15.1: the error of Radau IIA with three stages is h³/λ.
    for count in [4, 8, 16] {
        let (at_ends, _) = orders(-1e7, count);
        assert!((at_ends - 3.0).abs() < 0.2, "{count}: {at_ends:.2}");
    }
    let ten_times_stiffer = errors_of_equal_steps(-1e6, 8).0 / errors_of_equal_steps(-1e7, 8).0;
    assert!((ten_times_stiffer - 10.0).abs() < 0.1, "{ten_times_stiffer}");
}

/// y' = λ(y − cos t) with λ = −1e10.
struct Relaxation;
impl Equations for Relaxation {
    fn rates<S: Scalar>(&self, t: S, y: &[S], dy: &mut [S]) {
        dy[0] = c::<S>(-1e10) * (y[0] - t.cos());
    }
}

#[test]
fn one_long_step_forgets_a_disturbance_that_decays_infinitely_fast() {
    // The stability function is −3/z for large z = λh; that of the trapezoidal rule, A-stable only, is −1.
    for start in [0.0, 1.0, 1e3] {
        let mut problem = Problem { equations: Relaxation, scale: vec![1e9] };
        let mut radau = Radau::new(&problem, 0.0, &[start], 1e-3, 1);
        radau.set_longest_step(1.0);
        radau.advance(&mut problem, 1.0, |_| Ok(())).unwrap();
        let error = (radau.x[0] - 1f64.cos()).abs();
        let (forgotten, of_order_three) = (3.01e-10 * (start - 1.0).abs(), 1e-10);
        assert!(error < forgotten + of_order_three, "from {start}: {error:e}");
    }
}

/// y' = y², which from 1 reaches infinity at t = 1.
struct Explosion;
impl Equations for Explosion {
    fn rates<S: Scalar>(&self, _t: S, y: &[S], dy: &mut [S]) {
        dy[0] = y[0] * y[0];
    }
}

#[test]
fn a_solution_that_ceases_to_exist_ends_in_an_error_that_says_when_and_where() {
    let mut problem = Problem { equations: Explosion, scale: vec![1.0] };
    let mut radau = Radau::new(&problem, 0.0, &[1.0], 1e-6, 100_000);
    match radau.advance(&mut problem, 2.0, |_| Ok(())).unwrap_err() {
        Error::StepTooSmall { time_s, worst_state, .. } => {
            assert!((time_s - 1.0).abs() < 1e-5, "{time_s}");
            assert_eq!(worst_state, "state 0");
        }
        other => panic!("{other}"),
    }
}

#[test]
fn a_limit_of_steps_is_kept() {
    let mut problem = Problem { equations: VanDerPol, scale: VAN_DER_POL_SCALE.to_vec() };
    let mut radau = Radau::new(&problem, 0.0, &[2.0, 0.0], 1e-6, 50);
    let error = radau.advance(&mut problem, 2.0, |_| Ok(())).unwrap_err();
    assert!(matches!(error, Error::TooManySteps { limit: 50, .. }), "{error}");
    assert_eq!(radau.statistics.steps, 50);
}
