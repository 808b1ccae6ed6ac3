//! The twelve trajectories of an independent simulation of the thesis's model.

mod common;

use common::{deviation, references, replay, truck_with};
use hydro_core::run::Solver;

#[test]
fn zz_print() {
    let truck = truck_with(&[]);
    for solver in [
        Solver::Fixed { substeps: 2 },
        Solver::Fixed { substeps: 4 },
        Solver::Fixed { substeps: 8 },
        Solver::Fixed { substeps: 16 },
        Solver::Fixed { substeps: 64 },
    ] {
        println!("{solver:?}");
        for reference in references() {
            let t = std::time::Instant::now();
            let run = replay(&truck, &reference, solver);
            let ms = t.elapsed().as_secs_f64() * 1e3;
            let (v, p) = deviation(&run, &reference);
            println!("  {:26} v {v:.2e} p {p:.2e} {ms:6.2} ms {:?}", reference.name, run.statistics.rows().map(|r| r.1));
        }
    }
}
