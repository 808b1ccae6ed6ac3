//! The thesis's truck and the reference trajectories, read from the repository.

#![allow(dead_code)] // each test file uses its part

pub mod space;

use std::collections::BTreeMap;
use std::path::Path;

use hydro_core::error::Error;
use hydro_core::mast::LiftName;
use hydro_core::run::{Inputs, Lifts, Run, Solver};
use hydro_core::truck::{Truck, Value};

/// Above the package that is built with this: the core, or its benches.
fn repository() -> &'static Path {
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    above.skip(1).find(|folder| folder.join("Cargo.lock").exists()).expect("the workspace has a lock file")
}

/// A file of the repository.
pub fn read(path: &str) -> String {
    std::fs::read_to_string(repository().join(path)).unwrap()
}

fn flatten(prefix: &str, table: &toml::Table, values: &mut BTreeMap<String, Value>) {
    for (key, entry) in table {
        let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        if let Some(table) = entry.as_table() {
            let number = |v: &toml::Value| v.as_float().or(v.as_integer().map(|i| i as f64)).unwrap();
            match table.get("value") {
                Some(toml::Value::Array(list)) => {
                    values.insert(name, Value::Table(list.iter().map(number).collect()));
                }
                Some(value) => {
                    values.insert(name, Value::Number(number(value)));
                }
                None => flatten(&name, table, values),
            }
        }
    }
}

pub fn thesis_values() -> BTreeMap<String, Value> {
    let mut values = BTreeMap::new();
    flatten("", &read("python/forklift/plant/forklift/trucks/thesis.toml").parse().unwrap(), &mut values);
    values
}

/// The thesis's truck with some values replaced or effects added.
pub fn truck_with(changes: &[(&str, f64)]) -> Truck {
    let mut values = thesis_values();
    for (name, value) in changes {
        values.insert(name.to_string(), Value::Number(*value));
    }
    Truck::from_values(values).unwrap()
}

pub struct Reference {
    pub name: String,
    pub lift: LiftName,
    pub load_kg: f64,
    pub oil_temperature_degc: f64,
    pub time: Vec<f64>,
    pub command: Vec<[f64; 2]>,
    /// Current, position, velocity, cylinder pressure, volume pressure.
    pub columns: [Vec<f64>; 5],
}

pub fn references() -> Vec<Reference> {
    let folder = repository().join("tests/reference/trajectories");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "csv"));
    files.sort();
    files.iter().map(|file| read_reference(file)).collect()
}

fn read_reference(file: &std::path::Path) -> Reference {
    let name = file.file_stem().unwrap().to_str().unwrap().to_string();
    let parts: Vec<&str> = name.split('_').collect();
    let lift = if parts[0] == "free" { LiftName::Free } else { LiftName::Main };
    let (mut time, mut command, mut columns) = (vec![], vec![], [const { vec![] }; 5]);
    for line in std::fs::read_to_string(file).unwrap().lines().skip(1) {
        let row: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        time.push(row[0]);
        command.push(if lift == LiftName::Free { [row[1], 0.0] } else { [0.0, row[1]] });
        for (column, value) in columns.iter_mut().zip(&row[2..]) {
            column.push(*value);
        }
    }
    Reference {
        lift,
        load_kg: parts[2].trim_end_matches("kg").parse().unwrap(),
        oil_temperature_degc: parts[3].trim_end_matches('c').parse().unwrap(),
        name,
        time,
        command,
        columns,
    }
}

/// Simulates the lift of a reference at its own times.
pub fn replay(truck: &Truck, reference: &Reference, solver: Solver) -> Run {
    let temperature = vec![reference.oil_temperature_degc; reference.time.len()];
    let inputs = Inputs {
        time: &reference.time,
        command: &reference.command,
        oil_temperature_degc: &temperature,
        load_kg: reference.load_kg,
    };
    let run =
        hydro_core::run::simulate(truck, Lifts::One(reference.lift), &inputs, &reference.time, solver, None, &|| false);
    run.unwrap_or_else(|error| panic!("{}: {error}", reference.name))
}

/// One lift under a command sampled at 50 Hz, from its usual start, shown at the samples.
pub struct Lowering<'a> {
    pub lift: LiftName,
    pub load_kg: f64,
    pub oil_temperature_degc: f64,
    pub command: &'a [f64],
}

/// Period of the controller [s].
pub const TICK: f64 = 0.02;

impl Lowering<'_> {
    pub fn run(&self, truck: &Truck, solver: Solver) -> Result<Run, Error> {
        self.run_from(truck, solver, None)
    }

    /// From `start`, or at rest.
    pub fn run_from(&self, truck: &Truck, solver: Solver, start: Option<&[f64]>) -> Result<Run, Error> {
        let time: Vec<f64> = (0..self.command.len()).map(|k| k as f64 * TICK).collect();
        let free = self.lift == LiftName::Free;
        let command: Vec<[f64; 2]> = self.command.iter().map(|&u| if free { [u, 0.0] } else { [0.0, u] }).collect();
        let inputs = Inputs {
            time: &time,
            command: &command,
            oil_temperature_degc: &vec![self.oil_temperature_degc; time.len()],
            load_kg: self.load_kg,
        };
        hydro_core::run::simulate(truck, Lifts::One(self.lift), &inputs, &time, solver, start, &|| false)
    }
}

/// A state of the first lift of a run at all its times.
pub fn column(run: &Run, state: usize) -> Vec<f64> {
    run.states.chunks_exact(run.state_names.len()).map(|row| row[state]).collect()
}

/// Places of a lift's states in the state vector.
pub mod state {
    pub const POSITION: usize = 3;
    pub const VELOCITY: usize = 4;
    pub const PRESSURE: usize = 6;
}

/// max |Δv| in m/s and max |Δp_A|/p_A of a run against its reference.
pub fn deviation(run: &Run, reference: &Reference) -> (f64, f64) {
    let n = run.state_names.len();
    let mut worst = (0.0f64, 0.0f64);
    for (k, row) in run.states.chunks_exact(n).enumerate() {
        worst.0 = worst.0.max((row[4] - reference.columns[2][k]).abs());
        worst.1 = worst.1.max((row[6] / reference.columns[3][k] - 1.0).abs());
    }
    worst
}
