//! Derivatives are difference quotients, whatever the sensor and however parameters go with unknowns.

use fit_core::likelihood::{Rule, HUBER};
use fit_core::linearised::{linearised, residuals, Chain, Channel, Said, Slopes};
use proptest::prelude::*;

/// A sensor that reads all there is, one between two ends, and an encoder; all of noise or softness `sigma`.
fn rules(sigma: f64) -> [Rule; 3] {
    let all = [f64::NEG_INFINITY, f64::INFINITY];
    [Rule::of(sigma, 0.0, all), Rule::of(sigma, 0.0, [-1.0, 2.0]), Rule::of(sigma, 1.0, all)]
}

proptest! {
    #[test]
    fn a_slope_is_the_residuals_difference_quotient(
        off in -30.0..30.0f64, power in -1.0..1.0f64, read in prop::sample::select(vec![-1.0, 0.0, 2.0]),
    ) {
        let sigma = 10f64.powf(power);
        for rule in rules(sigma) {
            let model = read + off * sigma.max(0.5);
            let step = 1e-6 * sigma;
            let [ahead, behind] = [model + step, model - step].map(|at| rule.residual(read, at));
            let quotient = (ahead - behind) / (2.0 * step);
            let (rho, slope) = rule.misfit(read, model);
            prop_assert_eq!(rho.to_bits(), rule.residual(read, model).to_bits());
            let near = (slope - quotient).abs() <= 1e-4 * slope.abs().max(1.0 / sigma);
            // Where a residual begins to count by its distance, its slope bends.
            let bends = (rho.abs() - HUBER).abs() < 1e-4;
            prop_assert!(near || bends, "{rule:?} {model}: {slope} is not {quotient}");
        }
    }

    #[test]
    fn a_recordings_jacobian_is_the_weight_times_the_models_slope_times_the_chain(
        numbers in prop::collection::vec(-2.0..2.0f64, 6 * 2 * 5), shared in any::<bool>(), gap in any::<bool>(),
    ) {
        // Six times, two outputs, four parameters and a condition of the recording's own.
        let values: Vec<f64> = numbers.chunks(5).map(|row| row.iter().sum()).collect();
        let of = [(0, 0.3), (1, -2.0), (if shared { 1 } else { 2 }, 0.7), (if shared { 0 } else { 3 }, 1.1)];
        let chain = Chain::new(of.to_vec(), if shared { 2 } else { 4 });
        let rows: Vec<i64> = if gap { vec![0, 2, 5] } else { (0..6).collect() };
        let read = vec![0.25; rows.len()];
        let channels = [0, 1].map(|column| Channel {
            column,
            rows: gap.then_some(&rows[..]),
            read: &read,
            rule: rules(0.5)[column],
        });
        let said = Said { values: &values, outputs: 2, channels: channels.to_vec() };
        let along = Slopes { slopes: &numbers, directions: 5, own: vec![(4, 3.0)] };
        let found = &linearised(&[(said.clone(), along)], &chain, true)[0];
        prop_assert_eq!(&found.residual, &residuals(&[said])[0]);
        let wide = chain.unknowns + 1;
        for (k, channel) in channels.iter().enumerate() {
            for (j, &row) in rows.iter().enumerate() {
                let (at, cell) = (k * rows.len() + j, row as usize * 2 + channel.column);
                let (_, weight) = channel.rule.misfit(0.25, values[cell]);
                prop_assert_eq!(found.model[at], values[cell]);
                let mut wanted = vec![0.0; wide];
                for (raw, (unknown, factor)) in numbers[cell * 5..].iter().zip(of) {
                    wanted[unknown] += raw * factor;
                }
                wanted[wide - 1] = numbers[cell * 5 + 4] * 3.0;
                for (got, want) in found.slope[at * wide..].iter().zip(&wanted) {
                    prop_assert!((got - want).abs() < 1e-12);
                }
                for (got, want) in found.jacobian[at * wide..].iter().zip(&wanted) {
                    prop_assert!((got - want * weight).abs() < 1e-12 * weight.abs().max(1.0));
                }
            }
        }
    }
}
