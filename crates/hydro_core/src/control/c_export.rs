//! The controller as C99: one `.c` and one `.h`, with the configuration written into them.

use std::fmt::Write;

use super::config::{Config, LiftConfig};
use super::fixed::{Gain, CURRENT_SHIFT, FACTOR_SHIFT, SPEED_SHIFT};
use super::settings::{LIFT_SETTINGS, TICK_S};
use super::table::Table;
use super::vectors::digest;
use crate::sensors::{ENCODER_COUNT, PRESSURE_STEP, TEMPERATURE_STEP};

const HEADER: &str = include_str!("c/forklift_control.h");
const SOURCE: &str = include_str!("c/forklift_control.c");
const TEST: &str = include_str!("c/forklift_control_test.c");
const EVA: &str = include_str!("c/forklift_control_eva.c");
const HELPERS: &str = include_str!("c/forklift_control_helpers.c");
/// What the exported test runs unless it is told otherwise.
const TEST_TICKS: u64 = 100_000;
const TEST_SEED: u64 = 2017;

/// The text of `forklift_control.h` and of the files `forklift_control.c`, `…_test.c`, `…_eva.c` and `…_helpers.c`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sources {
    pub header: String,
    pub source: String,
    pub test: String,
    pub eva: String,
    pub helpers: String,
}

const LIFTS: [&str; 2] = ["free", "main"];

/// The C of a configuration; `name` is the controller's, a single line of plain letters.
pub fn c_sources(config: &Config, name: &str) -> Sources {
    let word = config.word;
    let hash = format!("0x{:016x}", config.hash());
    let mut tables = String::new();
    let mut text = String::from("{\n");
    let fields = [
        ("request_most", config.request_most),
        ("ramp_up", config.ramp_up),
        ("ramp_down", config.ramp_down),
        ("ramp_pole", config.ramp_pole),
        ("temperature_least", config.temperature_least),
        ("temperature_most", config.temperature_most),
    ];
    for (field, value) in fields {
        line(&mut text, 1, field, &value.to_string());
    }
    text.push_str("    .ratio = {\n");
    for (lift, ratio) in LIFTS.iter().zip(&config.ratio) {
        let _ = writeln!(text, "        {},", table(&mut tables, &format!("{lift}_ratio"), ratio));
    }
    text.push_str("    },\n    .lifts = {\n");
    for (name, lift) in LIFTS.iter().zip(&config.lifts) {
        text.push_str("        {\n");
        lift_fields(&mut text, &mut tables, name, lift);
        text.push_str("        },\n");
    }
    text.push_str("    },\n}");
    let gains: String = LIFTS.iter().zip(&config.lifts).map(|(name, lift)| described(name, lift)).collect();
    let filled = |template: &str| {
        let marks = [
            ("@NAME@", name.to_string()),
            ("@HASH@", hash.clone()),
            ("@BITS@", word.bits().to_string()),
            ("@SPEED@", SPEED_SHIFT.to_string()),
            ("@CURRENT@", CURRENT_SHIFT.to_string()),
            ("@FACTOR@", FACTOR_SHIFT.to_string()),
            ("@SPEED_ONE@", (1u32 << SPEED_SHIFT).to_string()),
            ("@CURRENT_ONE@", (1u32 << CURRENT_SHIFT).to_string()),
            ("@FACTOR_ONE@", (1u32 << FACTOR_SHIFT).to_string()),
            ("@PRESSURE@", (PRESSURE_STEP / 1e5).to_string()),
            ("@TEMPERATURE@", TEMPERATURE_STEP.to_string()),
            ("@GAINS@", gains.clone()),
            ("@TABLES@", tables.clone()),
            ("@CONFIG@", text.clone()),
            ("@DECLARED@", declared(config)),
            ("@TICKS@", TEST_TICKS.to_string()),
            ("@SEED@", TEST_SEED.to_string()),
            ("@DIGEST@", format!("0x{:016x}", digest(config, TEST_SEED, TEST_TICKS))),
        ];
        marks.iter().fold(template.to_string(), |text, (mark, value)| text.replace(mark, value))
    };
    Sources {
        header: filled(HEADER),
        source: filled(SOURCE),
        test: filled(TEST),
        eva: filled(EVA),
        helpers: filled(HELPERS),
    }
}

fn line(text: &mut String, depth: usize, field: &str, value: &str) {
    let _ = writeln!(text, "{}.{field} = {value},", "    ".repeat(depth));
}

fn gain(gain: Gain) -> String {
    format!("{{ {}, {}U }}", gain.mantissa, gain.shift)
}

/// Adds a table's knots to the file, and gives the initialiser that points to them.
fn table(tables: &mut String, name: &str, table: &Table) -> String {
    let knots: Vec<String> = table.knots.iter().map(i32::to_string).collect();
    let rows: Vec<String> = knots.chunks(12).map(|row| format!("    {}", row.join(", "))).collect();
    let _ = writeln!(tables, "static const fc_word fc_{name}[{}] = {{\n{}\n}};", knots.len(), rows.join(",\n"));
    format!("{{ {}, {}U, {}U, {}U, fc_{name} }}", table.first, table.spacing, table.widen, knots.len() - 1)
}

fn lift_fields(text: &mut String, tables: &mut String, name: &str, lift: &LiftConfig) {
    let (p, s) = (&lift.pressure, &lift.shaper);
    let mut add = |field: &str, value: String| line(text, 3, field, &value);
    add("most", lift.most.to_string());
    add("early_pole", lift.early_pole.to_string());
    add("shaper_delay", table(tables, &format!("{name}_shaper_delay"), &s.delay));
    add("shaper_share", table(tables, &format!("{name}_shaper_share"), &s.share));
    add("prediction", lift.prediction.to_string());
    add("overspeed", gain(lift.overspeed));
    add("overspeed_from", lift.overspeed_from.to_string());
    add("count_speed", lift.count_speed.to_string());
    add("pole", lift.pole.to_string());
    add("delay", format!("{}U", lift.delay));
    add("proportional", gain(lift.proportional));
    add("integral", gain(lift.integral));
    add("derivative", gain(lift.derivative));
    add("u_min", lift.u_min.to_string());
    add("u_max", lift.u_max.to_string());
    add("adaptation", gain(lift.adaptation));
    add("scale_base", lift.scale_base.to_string());
    add("scale_slope", gain(lift.scale_slope));
    add("table", table(tables, &format!("{name}_table"), &lift.table));
    add("shift_base", lift.shift_base.to_string());
    add("shift_slope", gain(lift.shift_slope));
    add("i_min", lift.i_min.to_string());
    add("i_max", lift.i_max.to_string());
    let curves = [("cosine", &p.cosine), ("sine", &p.sine), ("real", &p.real), ("imaginary", &p.imaginary)];
    let mut inner = String::from("{\n");
    for (field, curve) in curves {
        line(&mut inner, 4, field, &table(tables, &format!("{name}_{field}"), curve));
    }
    line(&mut inner, 4, "shift", &format!("{}U", p.shift));
    line(&mut inner, 4, "limit", &p.limit.to_string());
    inner.push_str("            }");
    add("pressure", inner);
}

/// Gains anywhere in their ranges: the whole word, and for the integrator what its setting may be at most.
fn declared(config: &Config) -> String {
    let most = config.word.most();
    let mut text = String::new();
    let fastest = (most_of("forks_per_count") * ENCODER_COUNT * 1e3 / TICK_S * f64::from(1u32 << SPEED_SHIFT)) as i64;
    for (k, lift) in config.lifts.iter().enumerate() {
        let _ = writeln!(text, "    config.lifts[{k}].count_speed = Frama_C_interval(0, {fastest});");
        let integral = (most_of("integral") * TICK_S * (1u64 << lift.integral.shift) as f64) as i64;
        let rows = [
            ("proportional", -most, most, lift.proportional),
            ("integral", 0, integral.min(most), lift.integral),
            ("derivative", -most, most, lift.derivative),
            ("adaptation", 0, most, lift.adaptation),
            ("scale_slope", -most, most, lift.scale_slope),
            ("shift_slope", -most, most, lift.shift_slope),
            ("overspeed", 0, most, lift.overspeed),
        ];
        for (field, lower, upper, gain) in rows {
            let _ = writeln!(text, "    config.lifts[{k}].{field} = declared({lower}, {upper}, {}U);", gain.shift);
        }
    }
    text.trim_end().to_string()
}

/// The upper bound of a lift's setting.
fn most_of(setting: &str) -> f64 {
    LIFT_SETTINGS.iter().find(|spec| spec.name == setting).map_or(0.0, |spec| spec.upper)
}

/// The gains as comments, with what they stand for.
fn described(name: &str, lift: &LiftConfig) -> String {
    let rows = [
        ("proportional", lift.proportional),
        ("integral", lift.integral),
        ("derivative", lift.derivative),
        ("adaptation", lift.adaptation),
        ("scale_slope", lift.scale_slope),
        ("shift_slope", lift.shift_slope),
        ("overspeed", lift.overspeed),
    ];
    let row = |(field, gain): (&str, Gain)| {
        format!(" * {name:<5}{field:<13}{:>12} / 2^{:<3} = {:.9}\n", gain.mantissa, gain.shift, gain.value())
    };
    rows.into_iter().map(row).collect()
}
