//! Trucks, loads and commands from anywhere within their bounds.
//!
//! A failing case shrinks towards the thesis's values, so that what is left names the culprits.

use std::collections::BTreeMap;

use hydro_core::effects::Instance;
use hydro_core::parameters::{ParameterSpec, Scale, LIFT_PARAMETERS, TABLE_PARAMETERS};
use hydro_core::truck::{Truck, Value};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

/// The same cases in every run; PROPTEST_CASES and PROPTEST_RNG_SEED ask for more or others.
pub fn cases(count: u32) -> Config {
    let mut config = Config { failure_persistence: None, max_shrink_iters: 3_000, ..Config::default() };
    if std::env::var("PROPTEST_CASES").is_err() {
        config.cases = count;
    }
    if std::env::var("PROPTEST_RNG_SEED").is_err() {
        config.rng_seed = RngSeed::Fixed(2017);
    }
    config
}

/// Evenly spread over [lower, upper] on the parameter's scale; an angle over its radians.
pub fn inside(lower: f64, upper: f64, scale: Scale) -> BoxedStrategy<f64> {
    match scale {
        Scale::Linear | Scale::LogCos => (lower..=upper).boxed(),
        Scale::Log => (lower.ln()..=upper.ln()).prop_map(move |x| x.exp().clamp(lower, upper)).boxed(),
        Scale::LogLog => {
            (lower.ln().ln()..=upper.ln().ln()).prop_map(move |x| x.exp().exp().clamp(lower, upper)).boxed()
        }
    }
}

/// The middle of where the k-th parameter of an effect may plausibly lie, on its scale.
pub fn plausible(effect: &Instance, k: usize) -> f64 {
    let spec = effect.kind.spec();
    let [lower, upper] = spec.plausible[k];
    match spec.parameters[k].scale {
        Scale::Log => (lower * upper).sqrt(),
        _ => 0.5 * (lower + upper),
    }
}

/// As [`inside`], but one in ten sits on a bound.
pub fn within(lower: f64, upper: f64, scale: Scale) -> BoxedStrategy<f64> {
    prop_oneof![18 => inside(lower, upper, scale), 1 => Just(lower), 1 => Just(upper)].boxed()
}

/// Of either sign, spread over decades.
pub fn signed(smallest: f64, largest: f64) -> BoxedStrategy<f64> {
    (inside(smallest, largest, Scale::Log), any::<bool>()).prop_map(|(x, up)| if up { x } else { -x }).boxed()
}

pub fn parameter(spec: &ParameterSpec) -> BoxedStrategy<f64> {
    within(spec.lower, spec.upper, spec.scale)
}

/// The row of the table of a lift's parameters with this name.
pub fn spec(name: &str) -> &'static ParameterSpec {
    LIFT_PARAMETERS.iter().find(|spec| spec.name == name).unwrap_or_else(|| panic!("no parameter {name}"))
}

/// Knots of an area table, currents a microampere apart at least.
pub fn table(knots: std::ops::RangeInclusive<usize>) -> BoxedStrategy<(Vec<f64>, Vec<f64>)> {
    let [current, area] = &TABLE_PARAMETERS;
    knots
        .prop_flat_map(move |n| {
            let currents = proptest::collection::vec(current.lower..current.upper - 1e-3, n);
            (currents, proptest::collection::vec(area.lower..=area.upper, n))
        })
        .prop_map(|(mut currents, mut areas)| {
            currents.sort_by(f64::total_cmp);
            areas.sort_by(f64::total_cmp);
            for k in 1..currents.len() {
                currents[k] = currents[k].max(currents[k - 1] + 1e-6);
            }
            (currents, areas)
        })
        .boxed()
}

/// A truck with parameters from anywhere within their bounds, some of them the thesis's.
pub fn trucks() -> BoxedStrategy<Truck> {
    let thesis = super::thesis_values();
    let mut names = Vec::new();
    let mut values = Vec::new();
    for lift in ["free", "main"] {
        for spec in LIFT_PARAMETERS {
            let name = format!("{lift}.{}", spec.name);
            let Value::Number(usual) = thesis[&name] else { unreachable!() };
            values.push(prop_oneof![1 => Just(usual), 4 => parameter(spec)].boxed());
            names.push(name);
        }
    }
    let usual = |lift: &str| {
        let [current, area] = [0, 1].map(|k| match &thesis[&format!("{lift}.{}", TABLE_PARAMETERS[k].name)] {
            Value::Table(values) => values.clone(),
            Value::Number(_) => unreachable!(),
        });
        prop_oneof![1 => Just((current, area)), 2 => table(2..=24)]
    };
    (values, usual("free"), usual("main"))
        .prop_map(move |(values, free, main)| {
            let mut all: BTreeMap<String, Value> =
                names.iter().cloned().zip(values.into_iter().map(Value::Number)).collect();
            for (lift, (current, area)) in [("free", free), ("main", main)] {
                all.insert(format!("{lift}.valve.table_current"), Value::Table(current));
                all.insert(format!("{lift}.valve.table_area"), Value::Table(area));
                let (lower, upper) = (format!("{lift}.cylinder.stroke_lower"), format!("{lift}.cylinder.stroke_upper"));
                let (Value::Number(a), Value::Number(b)) = (&all[&lower], &all[&upper]) else { unreachable!() };
                let b = b.max(a + 0.01);
                all.insert(upper, Value::Number(b));
            }
            Truck::from_values(all).unwrap()
        })
        .boxed()
}

/// Values within `factor` of the thesis's, and within their bounds; angles, strokes and reference
/// temperatures stay.
pub fn values_near_the_thesis(factor: f64) -> BoxedStrategy<BTreeMap<String, Value>> {
    let thesis = super::thesis_values();
    proptest::collection::vec(-1.0..1.0f64, thesis.len())
        .prop_map(move |exponents| {
            let scaled = |(name, value): (&String, &Value), exponent: f64| {
                let inner = name.split_once('.').unwrap().1;
                let kept = ["stroke", "T_0", "theta"].iter().any(|part| inner.contains(part));
                match value {
                    Value::Number(x) if !kept => {
                        let row = spec(inner);
                        Value::Number((x * factor.powf(exponent)).clamp(row.lower, row.upper))
                    }
                    other => other.clone(),
                }
            };
            thesis.iter().zip(&exponents).map(|(pair, &e)| (pair.0.clone(), scaled(pair, e))).collect()
        })
        .boxed()
}

/// Where the truck differs from the usual one, a line a value: what to print of a failing case.
pub fn differences(truck: &Truck, usual: &Truck) -> String {
    let usual: BTreeMap<String, f64> = usual.names().into_iter().zip(usual.values()).collect();
    let rows = truck.names().into_iter().zip(truck.values());
    rows.filter(|(name, value)| usual.get(name) != Some(value))
        .map(|(name, value)| format!("{name} = {value}\n"))
        .collect()
}
