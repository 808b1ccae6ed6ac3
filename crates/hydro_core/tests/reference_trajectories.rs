//! The twelve trajectories of an independent simulation of the thesis's model: how near each solver
//! comes, and how much work it takes. The reference itself is known to 1e-7 m/s in v and to 2e-7 of
//! p_A (tests/reference/README.md).

mod common;

use common::{deviation, references, replay, truck_with};
use hydro_core::run::Solver;

const DEFAULT: Solver = Solver::Adaptive { tolerance: Solver::DEFAULT_TOLERANCE };

/// Largest deviations of each trajectory: v in m/s, p_A relative.
fn deviations(solver: Solver) -> Vec<(String, f64, f64)> {
    let truck = truck_with(&[]);
    references()
        .into_iter()
        .map(|reference| {
            let (v, p) = deviation(&replay(&truck, &reference, solver), &reference);
            (reference.name, v, p)
        })
        .collect()
}

#[track_caller]
fn assert_every_trajectory_within(solver: Solver, most_v: f64, most_p: f64) {
    let deviations = deviations(solver);
    assert_eq!(deviations.len(), 12);
    for (name, v, p) in deviations {
        assert!(v <= most_v && p <= most_p, "{name}: v is off by {v:.1e} m/s, p_A by {p:.1e}");
    }
}

#[test]
fn the_default_tolerance_keeps_velocity_within_a_tenth_of_a_millimetre_a_second() {
    assert_every_trajectory_within(DEFAULT, 1e-4, 1e-3);
}

#[test]
fn a_tight_tolerance_reaches_the_accuracy_of_the_reference() {
    assert_every_trajectory_within(Solver::Adaptive { tolerance: 1e-9 }, 1e-7, 2e-7);
}

#[test]
fn the_error_falls_in_proportion_to_the_tolerance() {
    let worst = |tolerance: f64| {
        let v = deviations(Solver::Adaptive { tolerance }).into_iter().map(|(_, v, _)| v);
        v.fold(0.0, f64::max)
    };
    let errors = [1e-4, 1e-5, 1e-6, 1e-7].map(worst);
    for (k, pair) in errors.windows(2).enumerate() {
        let gain = pair[0] / pair[1];
        assert!((2.0..30.0).contains(&gain), "step {k} of the ladder: {errors:?}");
    }
    assert!(errors[0] / errors[3] > 100.0, "{errors:?}");
}

#[test]
fn four_substeps_keep_velocity_within_a_third_of_a_millimetre_a_second() {
    assert_every_trajectory_within(Solver::Fixed { substeps: 4 }, 3e-4, 3e-3);
}

#[test]
fn eight_substeps_keep_velocity_within_a_tenth_of_a_millimetre_a_second() {
    assert_every_trajectory_within(Solver::Fixed { substeps: 8 }, 1e-4, 1e-3);
}

#[test]
fn a_hundred_substeps_leave_only_what_the_kinks_do() {
    // The valve opens onto a volume at another pressure within some 0.1 ms: that refill, which no
    // substep resolves, converges slowly and is worth some 1e-4 of the pressure.
    assert_every_trajectory_within(Solver::Fixed { substeps: 100 }, 3e-5, 2e-4);
}

/// Compares counts with a table and, where they differ, prints the table as it should stand.
#[track_caller]
fn assert_pinned<const N: usize>(pinned: &[(&str, [usize; N])], counts: impl Fn(&common::Reference) -> [usize; N]) {
    let counted: Vec<(String, [usize; N])> = references().iter().map(|r| (r.name.clone(), counts(r))).collect();
    let same = counted.len() == pinned.len() && counted.iter().zip(pinned).all(|(a, b)| a.0 == b.0 && a.1 == b.1);
    let table: String = counted.iter().map(|row| format!("    {row:?},\n")).collect();
    assert!(same, "the work has changed; it is now\n{table}");
}

/// Steps, steps rejected by their error and by Newton's iteration, Newton iterations, Jacobians, factorisations.
const ADAPTIVE_WORK: &[(&str, [usize; 6])] = &[
    ("free_prms1_0kg_20c", [847, 56, 122, 2687, 361, 920]),
    ("free_prms1_1500kg_60c", [777, 53, 112, 2442, 287, 819]),
    ("free_prms1_800kg_40c", [790, 55, 102, 2491, 301, 826]),
    ("free_steps_0kg_20c", [874, 57, 285, 2957, 389, 1089]),
    ("free_steps_1500kg_60c", [1031, 47, 602, 4035, 522, 1478]),
    ("free_steps_800kg_40c", [1125, 48, 580, 4259, 585, 1536]),
    ("main_prms1_0kg_20c", [652, 97, 104, 2175, 235, 766]),
    ("main_prms1_1500kg_60c", [634, 94, 88, 2045, 206, 712]),
    ("main_prms1_800kg_40c", [641, 93, 84, 2068, 211, 719]),
    ("main_steps_0kg_20c", [677, 54, 259, 2419, 308, 902]),
    ("main_steps_1500kg_60c", [771, 60, 385, 2926, 348, 1100]),
    ("main_steps_800kg_40c", [702, 53, 305, 2598, 317, 940]),
];

#[test]
fn the_adaptive_work_is_what_it_was_on_every_machine() {
    let truck = truck_with(&[]);
    assert_pinned(ADAPTIVE_WORK, |reference| {
        let s = replay(&truck, reference, DEFAULT).statistics;
        [s.steps, s.rejected_by_error, s.rejected_by_newton, s.newton_iterations, s.jacobians, s.factorisations]
    });
}

/// Substeps and Newton iterations of the pressure equation, at 4 and at 8 substeps per tick.
const FIXED_WORK: &[(&str, [usize; 4])] = &[
    ("free_prms1_0kg_20c", [2397, 2474, 4793, 4827]),
    ("free_prms1_1500kg_60c", [2389, 2412, 4777, 4813]),
    ("free_prms1_800kg_40c", [2397, 2426, 4793, 4823]),
    ("free_steps_0kg_20c", [2557, 2925, 5113, 5423]),
    ("free_steps_1500kg_60c", [2421, 2774, 4841, 5144]),
    ("free_steps_800kg_40c", [2557, 3059, 5113, 5499]),
    ("main_prms1_0kg_20c", [2397, 2434, 4793, 4821]),
    ("main_prms1_1500kg_60c", [2397, 2440, 4793, 4826]),
    ("main_prms1_800kg_40c", [2397, 2425, 4793, 4814]),
    ("main_steps_0kg_20c", [2077, 2264, 4153, 4339]),
    ("main_steps_1500kg_60c", [2077, 2290, 4153, 4350]),
    ("main_steps_800kg_40c", [2077, 2280, 4153, 4309]),
];

#[test]
fn the_fixed_work_is_what_it_was_on_every_machine() {
    let truck = truck_with(&[]);
    assert_pinned(FIXED_WORK, |reference| {
        let [four, eight] = [4, 8].map(|substeps| replay(&truck, reference, Solver::Fixed { substeps }).statistics);
        [four.steps, four.newton_iterations, eight.steps, eight.newton_iterations]
    });
}
