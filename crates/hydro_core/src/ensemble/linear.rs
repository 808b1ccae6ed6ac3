//! The linear view: a lift's right-hand side linearised about a state, by dual numbers.

use crate::dual::Dual;
use crate::error::Error;
use crate::mast::{Extended, Lift, LiftName, Mast, Physics, Thesis, STATES};
use crate::run::jacobian_by_duals;
use crate::scalar::Scalar;
use crate::truck::Truck;

type Columns = Dual<f64, STATES>;

/// ẋ ≈ f + A (x − x₀) + B (u − u₀) about a state and a command [A].
#[derive(Debug, Clone)]
pub struct Linear {
    /// (n), the rates themselves.
    pub rates: Vec<f64>,
    /// (n, n), row-major.
    pub a: Vec<f64>,
    /// (n), along the command.
    pub b: Vec<f64>,
}

/// Linearises one lift. Where the right-hand side has a kink, the derivative is that of the side the state lies on.
///
/// # Errors
/// A state of another length, effects that join the lifts.
pub fn linearise(
    truck: &Truck,
    lift: LiftName,
    state: &[f64],
    command_a: f64,
    load_kg: f64,
    oil_temperature_degc: f64,
) -> Result<Linear, Error> {
    let constant = |_: usize, value: f64| Columns::constant(value);
    let (lifts, effects) = truck.build([lift], Columns::constant(load_kg), constant)?;
    if effects.is_empty() {
        about(lifts, Thesis, state, command_a, oil_temperature_degc)
    } else {
        let physics = Extended::new(&effects, &lifts);
        about(lifts, physics, state, command_a, oil_temperature_degc)
    }
}

fn about<X: Physics<Columns>>(
    lifts: [Lift<Columns>; 1],
    physics: X,
    state: &[f64],
    command_a: f64,
    oil_temperature_degc: f64,
) -> Result<Linear, Error> {
    let mut mast = Mast { lifts, physics, command: [Columns::zero()], oil_temperature_degc: Columns::zero() };
    let n = mast.dim();
    if state.len() != n {
        let expected = format!("{n}, one per state");
        return Err(Error::Shape { name: "state".into(), got: state.len().to_string(), expected });
    }
    let temperature = Columns::constant(oil_temperature_degc);
    // Along the command first, then, with it fixed, along the states.
    mast.set_inputs([Columns::variable(command_a, 0)], temperature);
    let x: Vec<Columns> = state.iter().map(|&x| Columns::constant(x)).collect();
    let mut dx = vec![Columns::zero(); n];
    mast.rates(&x, &mut dx);
    let (rates, b) = dx.iter().map(|d| (d.re, d.eps[0])).unzip();
    mast.set_inputs([Columns::constant(command_a)], temperature);
    let mut a = vec![0.0; n * n];
    jacobian_by_duals::<STATES>(state, &mut a, |x, dx| mast.rates(x, dx));
    Ok(Linear { rates, a, b })
}
