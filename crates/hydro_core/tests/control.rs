//! What the controller's integers must do whatever they read.

use hydro_core::control::config::Config;
use hydro_core::control::controller::{FixedPoint, State};
use hydro_core::control::fixed::{Word, SPEED_SHIFT};
use hydro_core::control::ranges::{ranges, widest, Range};
use hydro_core::control::settings::{
    Curve, Lift, LiftSettings, Settings, ShaperSettings, SharedSettings, SwingSettings,
};
use hydro_core::control::twin::FloatingPoint;
use hydro_core::control::vectors::Draws;
use hydro_core::run::closed_loop::{Controller, Reading};
use proptest::prelude::*;

/// Table 5.3, P, I, D, a, b, c, d of the free and the main lift.
const TABLE_5_3: [[f64; 7]; 2] = [
    [0.001201, 1.178, 0.00084129, -0.0030497, 1.8571, -0.3077, -0.049189],
    [0.00010892, 2.1999, 0.006814, -0.0023468, 1.6415, -0.36625, -0.36953],
];
const U_MIN: f64 = 5.0;
const U_MAX: f64 = 700.0;
const I_MIN: i32 = 300;
const I_MAX: i32 = 1300;

fn settings(swing: bool) -> Settings {
    let lift = |k: usize| {
        let [proportional, integral, derivative, a, b, c, d] = TABLE_5_3[k];
        Lift {
            numbers: LiftSettings {
                proportional,
                integral,
                derivative,
                a,
                b,
                c,
                d,
                forks_per_count: [1.0, 2.0][k],
                filter_rate: 20.0,
                delay: 8.0,
                u_min: U_MIN,
                u_max: U_MAX,
                i_min: f64::from(I_MIN),
                i_max: f64::from(I_MAX),
                adaptation_s: if swing { 20.0 } else { 0.0 },
                swing_limit: if swing { 60.0 } else { 0.0 },
                early_corner: if swing { 12.0 } else { 1.5 },
                prediction: if swing { 0.5 } else { 0.0 },
                overspeed: if swing { 3.0 } else { 0.0 },
                overspeed_from: 590.0,
            },
            table: Curve { first: 0, spacing: 5, values: (0..23).map(|k| 400.0 + 40.0 * f64::from(k)).collect() },
            ratio: Curve { first: 900, spacing: 7, values: vec![1.0, 0.4] },
            swing: swing.then(|| SwingSettings {
                spacing: 8,
                frequency: vec![2.4, 2.0, 1.7, 1.6],
                damping: vec![0.35; 4],
                gain: vec![4.0; 4],
                lead: vec![-30.0, 0.0, 40.0, 170.0],
            }),
            shaper: swing.then(|| ShaperSettings {
                spacing: 8,
                delay: vec![0.1, 0.21, 0.25, 0.3],
                share: vec![0.55; 4],
            }),
        }
    };
    let shared = SharedSettings {
        request_most: 600.0,
        ramp_up: 600.0,
        ramp_down: 900.0,
        ramp_corner: 1.5,
        temperature_least: -20.0,
        temperature_most: 90.0,
    };
    Settings { shared, lifts: [lift(0), lift(1)] }
}

fn configs() -> Vec<Config> {
    let both = |swing| Word::BOTH.map(|word| settings(swing).config(word).unwrap());
    [both(false), both(true)].concat()
}

fn reading() -> impl Strategy<Value = Reading> {
    (any::<[i32; 2]>(), any::<[i32; 2]>(), any::<i32>()).prop_map(|(position, pressure, temperature)| Reading {
        position,
        pressure,
        temperature,
    })
}

fn range(rows: &[Range], owner: usize, variable: &str) -> (i128, i128) {
    let row = rows.iter().find(|row| row.owner == owner && row.variable == variable).unwrap();
    (row.kept.0, row.kept.1)
}

/// Everything a state holds lies in the ranges that the crate prints.
fn within(config: &Config, state: &State) -> Result<(), String> {
    let rows = ranges(config);
    let hold = |owner: usize, variable: &str, value: i64| {
        let (low, high) = range(&rows, owner, variable);
        if (low..=high).contains(&i128::from(value)) {
            return Ok(());
        }
        Err(format!("{variable} of {owner} is {value}, not in {low}..={high}"))
    };
    hold(0, "ramp", state.reference.ramp)?;
    hold(0, "smooth", state.reference.smooth)?;
    for (k, lift) in state.lifts.iter().enumerate() {
        hold(k + 1, "speed", lift.speed)?;
        hold(k + 1, "error", lift.error)?;
        hold(k + 1, "integral", lift.integral)?;
        for &past in &lift.corrections {
            hold(k + 1, "correction", past)?;
        }
        hold(k + 1, "reference", lift.references[(lift.oldest as usize + 31) % 32])?;
        hold(k + 1, "trim", lift.trim)?;
        hold(k + 1, "cosine", lift.cosine)?;
        hold(k + 1, "sine", lift.sine)?;
    }
    Ok(())
}

proptest! {
    #[test]
    fn any_integers_are_answered_within_the_limits_and_the_ranges(
        inputs in proptest::collection::vec((any::<i32>(), reading()), 1..40),
        seed in any::<u64>(),
    ) {
        for config in configs() {
            let mut state = Draws::new(seed).state(&config);
            for (request, reading) in &inputs {
                let current = state.tick(&config, *request, reading);
                for k in 0..2 {
                    let newest = (state.lifts[k].oldest as usize + 31) % 32;
                    let shut = state.lifts[k].references[newest] == 0 && current[k] == 0;
                    prop_assert!(shut || (I_MIN..=I_MAX).contains(&current[k]));
                }
                prop_assert_eq!(within(&config, &state), Ok(()));
            }
        }
    }

    #[test]
    fn a_lift_without_a_share_of_the_reference_is_left_out_and_no_order_changes(
        requests in proptest::collection::vec(any::<i32>(), 1..60),
        readings in proptest::collection::vec(reading(), 60),
        idle in 0usize..2,
    ) {
        let mut one = settings(true);
        one.lifts[idle].ratio = Curve { first: 0, spacing: 0, values: vec![0.0; 2] };
        for word in Word::BOTH {
            let config = one.config(word).unwrap();
            let (mut left_out, mut both) = (FixedPoint::new(&config), State::default());
            for (&request, reading) in requests.iter().zip(&readings) {
                prop_assert_eq!(left_out.tick(request, reading), both.tick(&config, request, reading));
            }
        }
    }

    #[test]
    fn the_order_leaves_its_limit_within_a_tick_of_the_errors_change_of_sign(wait in 50usize..400, up in any::<bool>()) {
        // Pushed against a limit for as long as one likes, then the forks run away to the other side. With the strongest
        // integral gain a tick of it shows in whole mA.
        let mut strong = settings(false);
        strong.lifts[0].numbers.integral = 20.0;
        for config in Word::BOTH.map(|word| strong.config(word).unwrap()).iter() {
            let mut state = State::default();
            let mut position = 500_000i32;
            let mut reading = Reading { position: [position, 0], pressure: [1000, 0], temperature: 80 };
            let mut tick = |state: &mut State, counts: i32| {
                position -= counts;
                reading.position = [position, 0];
                state.tick(config, 300, &reading)[0]
            };
            let (pushed, freed) = if up { (0, 60) } else { (60, 0) };
            for _ in 0..wait + 1500 {
                tick(&mut state, pushed);
            }
            let held = tick(&mut state, pushed);
            let before = state.lifts[0].error.signum();
            let mut now = held;
            while state.lifts[0].error.signum() == before || state.lifts[0].error == 0 {
                now = tick(&mut state, freed);
            }
            let next = tick(&mut state, freed);
            let left = if up { next.min(now) < held } else { next.max(now) > held };
            prop_assert!(left, "held {}, then {}, {}", held, now, next);
        }
    }
}

#[test]
fn every_product_leaves_room_to_be_rounded_in_64_bits() {
    for config in configs() {
        // `rounded` adds half a unit to what is below 2^62.
        assert!(widest(&config) <= 63, "{}", widest(&config));
    }
}

#[test]
fn the_speed_filter_and_the_resonator_come_to_rest_at_zero() {
    for config in configs() {
        let mut state = Draws::new(7).state(&config);
        let reading = Reading { position: [100, 100], pressure: [1500, 900], temperature: 80 };
        for _ in 0..3000 {
            state.tick(&config, 0, &reading);
        }
        for lift in state.lifts {
            assert_eq!((lift.speed, lift.cosine, lift.sine, lift.integral), (0, 0, 0, 0));
        }
    }
}

#[test]
fn at_a_constant_reference_and_position_the_current_stands_still() {
    for config in configs() {
        let mut state = State::default();
        let reading = Reading { position: [700, 0], pressure: [1500, 900], temperature: 81 };
        let mut last = Vec::new();
        for k in 0..40_000 {
            let current = state.tick(&config, 250, &reading);
            if k >= 39_000 {
                last.push(current);
            }
        }
        for lift in 0..2 {
            let (low, high) = (last.iter().map(|c| c[lift]).min(), last.iter().map(|c| c[lift]).max());
            assert!(high.unwrap() - low.unwrap() <= 1, "{low:?} {high:?}");
        }
    }
}

/// Forks that follow their current some ticks late: 1 mm/s per mA above 400 mA. In counts of the encoder.
struct Forks {
    travelled: f64,
    late: Vec<i32>,
}

impl Forks {
    fn new() -> Self {
        Forks { travelled: 0.0, late: vec![0; 6] }
    }
    fn moved(&mut self, current: i32) -> Reading {
        self.late.push(current);
        let speed = f64::from(self.late.remove(0) - 400).max(0.0);
        self.travelled += speed * 0.02 / 1.963495;
        Reading { position: [-self.travelled as i32, 0], pressure: [1200, 900], temperature: 80 }
    }
}

#[test]
fn a_tick_lost_or_doubled_does_no_harm_that_lasts() {
    for config in configs() {
        let run = |odd: Option<(usize, usize)>| {
            let (mut state, mut forks) = (State::default(), Forks::new());
            let mut current = [0; 2];
            let mut all = Vec::new();
            for k in 0..2500 {
                let reading = forks.moved(current[0]);
                let times = odd.filter(|(at, _)| *at == k).map_or(1, |(_, times)| times);
                for _ in 0..times {
                    current = state.tick(&config, 300, &reading);
                }
                all.push(current[0]);
            }
            all
        };
        let good = run(None);
        for odd in [(300, 0), (300, 2)] {
            let bad = run(Some(odd));
            let end = |all: &[i32]| all[2000..].iter().map(|&c| f64::from(c)).sum::<f64>() / 500.0;
            assert!((end(&good) - end(&bad)).abs() < 2.0, "{} {}", end(&good), end(&bad));
            let widest = good.iter().zip(&bad).map(|(a, b)| (a - b).abs()).max().unwrap();
            assert!(widest < 120, "{widest}");
        }
    }
}

#[test]
fn the_steady_speed_is_the_reference_and_the_twin_in_floating_point_says_the_same() {
    for config in configs() {
        let end = |controller: &mut dyn Controller| {
            let (mut forks, mut current, mut from) = (Forks::new(), [0; 2], 0.0);
            for k in 0..3000 {
                current = controller.tick(300, &forks.moved(current[0]));
                if k == 1999 {
                    from = forks.travelled;
                }
            }
            (forks.travelled - from) * 1.963495 / 20.0
        };
        // The ratio is 1 while the free lift is below 900 counts, which it is here.
        let integers = end(&mut FixedPoint::new(&config));
        let floats = end(&mut FloatingPoint::new(&config));
        assert!((integers - 300.0).abs() < 1.0, "{integers}");
        assert!((integers - floats).abs() < 1.0, "{integers} {floats}");
    }
}

/// Swing left of an oscillator without damping that follows `references` [speed], with a period in ticks.
fn left_over(references: &[f64], period: f64) -> f64 {
    let turn = 2.0 * std::f64::consts::PI / period;
    let (cos, sin) = (turn.cos(), turn.sin());
    let (mut x, mut v, mut before) = (0.0, 0.0, 0.0);
    for &reference in references {
        // x is how far it is off; a change of the reference moves it, then it turns.
        x -= reference - before;
        before = reference;
        (x, v) = (cos * x - sin * v, sin * x + cos * v);
    }
    f64::hypot(x, v)
}

#[test]
fn a_shaped_reference_leaves_no_swing_of_its_period_and_the_same_speed() {
    let mut shaped = settings(true);
    for lift in &mut shaped.lifts {
        lift.numbers.early_corner = 25.0;
        lift.shaper = Some(ShaperSettings { spacing: 10, delay: vec![0.205; 4], share: vec![0.5; 4] });
    }
    // A jump: a ramp is a shaper too.
    shaped.shared.ramp_up = 1e5;
    // Without a shaper its corner is the ramp's.
    shaped.shared.ramp_corner = 25.0;
    let plain = Settings { lifts: shaped.lifts.clone().map(|lift| Lift { shaper: None, ..lift }), ..shaped.clone() };
    for word in Word::BOTH {
        let references = |settings: &Settings| -> Vec<f64> {
            let config = settings.config(word).unwrap();
            let mut state = State::default();
            let reading = Reading { position: [700, 0], pressure: [1500, 900], temperature: 81 };
            let tick = |_| {
                state.tick(&config, 300, &reading);
                state.lifts[0].references[(state.lifts[0].oldest as usize + 31) % 32] as f64
            };
            (0..200).map(tick).collect()
        };
        let (with, without) = (references(&shaped), references(&plain));
        assert_eq!(with.last(), without.last());
        let unit = f64::from(1u32 << SPEED_SHIFT);
        for period in [20.5, 19.5, 21.5] {
            let (swing, before) = (left_over(&with, period), left_over(&without, period));
            assert!(before > 200.0 * unit, "{before}");
            // |cos(π/2 · f/f₀)| of what it was, and a rounding a tick (Singer & Seering 1990, equation 7).
            let share = (std::f64::consts::FRAC_PI_2 * 20.5 / period).cos().abs();
            assert!(swing < (share + 0.02) * before, "{period}: {swing} of {before}");
        }
    }
}

#[test]
fn a_controller_that_shapes_nothing_follows_what_the_operator_is_used_to_to_the_bit() {
    for word in Word::BOTH {
        let config = settings(false).config(word).unwrap();
        let mut state = State::default();
        let reading = Reading { position: [960, 0], pressure: [1500, 900], temperature: 81 };
        for k in 0..400 {
            state.tick(&config, [0, 500, 120, 590, 0][k / 80], &reading);
            let newest = (state.lifts[0].oldest as usize + 31) % 32;
            assert_eq!([0, 1].map(|lift| state.lifts[lift].references[newest]), state.wanted);
        }
    }
}

/// Forks whose speed is the current's, 1 mm/s per mA above 400 mA, `late` ticks ago: the largest overshoot [mm/s] of
/// the speed that counts of the encoder give, after the first second.
fn overshoot(config: &Config, too_much: f64) -> f64 {
    let (mut state, mut travelled, mut current) = (State::default(), 0.0, vec![0; 8]);
    let mut speeds = Vec::new();
    for _ in 0..600 {
        let speed = f64::from((current.remove(0) - 400).max(0)) * too_much;
        travelled += speed * 0.02 / 1.963495;
        speeds.push(speed);
        let reading = Reading { position: [-travelled as i32, 0], pressure: [1200, 900], temperature: 80 };
        current.push(state.tick(config, 300, &reading)[0]);
    }
    let end = speeds[500..].iter().sum::<f64>() / 100.0;
    speeds[50..].iter().fold(0.0, |most: f64, &speed| most.max((speed - end).abs()))
}

#[test]
fn the_predictor_bears_an_integral_part_that_swings_without_it() {
    // 1 mA per mm/s, no temperature: the table is the forks' inverse.
    let with = |prediction: f64| {
        let mut strong = settings(false);
        let numbers = &mut strong.lifts[0].numbers;
        (numbers.integral, numbers.prediction, numbers.derivative) = (12.0, prediction, 0.0);
        (numbers.a, numbers.b, numbers.c, numbers.d) = (0.0, 1.0, 0.0, 0.0);
        strong.lifts[0].table.values = (0..23).map(|k| 400.0 + 32.0 * f64::from(k)).collect();
        strong.config(Word::Bits32).unwrap()
    };
    let (without, predicted) = (overshoot(&with(0.0), 0.8), overshoot(&with(1.0), 0.8));
    assert!(without > 60.0, "{without}");
    assert!(predicted < without / 3.0, "{predicted} of {without}");
}

#[test]
fn what_is_too_fast_is_taken_back_sooner() {
    let steps_down = |overspeed: f64| {
        let mut fast = settings(false);
        let numbers = &mut fast.lifts[0].numbers;
        (numbers.overspeed, numbers.overspeed_from) = (overspeed, 400.0);
        (numbers.proportional, numbers.derivative) = (0.0, 0.0);
        let config = fast.config(Word::Bits32).unwrap();
        let (mut state, mut position) = (State::default(), 0);
        let mut currents = Vec::new();
        for k in 0..80 {
            // 3 counts a tick are what is asked, 295 mm/s; 5 are 491 mm/s.
            position -= if k < 60 { 3 } else { 5 };
            let reading = Reading { position: [position, 0], pressure: [1200, 900], temperature: 80 };
            currents.push(state.tick(&config, 300, &reading)[0]);
        }
        currents[59] - currents[79]
    };
    let (plain, sooner) = (steps_down(0.0), steps_down(4.0));
    // In the end 191 + 4·91 for 191; the filter's lag takes from it.
    assert!(plain > 5 && 2 * sooner > 3 * plain, "{plain} {sooner}");
    // Below the speed from which it counts nothing changes.
    let quiet = |overspeed: f64| {
        let mut slow = settings(false);
        slow.lifts[0].numbers.overspeed = overspeed;
        overshoot(&slow.config(Word::Bits16).unwrap(), 1.0)
    };
    assert_eq!(quiet(0.0), quiet(4.0));
}

#[test]
fn a_setting_beyond_its_bounds_or_its_word_is_refused() {
    let names: Vec<f64> = vec![0.0; 3];
    assert!(LiftSettings::from_values("free", &names).is_err());
    let mut far = settings(false);
    far.lifts[0].table.values[3] = 3000.0;
    assert!(far.config(Word::Bits16).is_err());
    for (delay, share) in [(0.61, 0.5), (-0.1, 0.5), (0.2, 1.1), (0.2, -0.1)] {
        let mut odd = settings(false);
        odd.lifts[1].shaper = Some(ShaperSettings { spacing: 9, delay: vec![delay; 3], share: vec![share; 3] });
        let refused = odd.config(Word::Bits16).unwrap_err();
        assert_eq!(refused.code(), "argument-invalid");
        assert!(refused.to_string().contains("main.shaper"), "{refused}");
    }
    let mut falling = settings(false);
    falling.lifts[1].table.values[3] = 0.0;
    let refused = falling.config(Word::Bits32).unwrap_err();
    assert_eq!(refused.code(), "argument-invalid");
    let mut wide = settings(true);
    if let Some(swing) = &mut wide.lifts[0].swing {
        swing.spacing = 48;
    }
    assert_eq!(wide.config(Word::Bits16).unwrap_err().code(), "argument-invalid");
}

#[test]
fn what_is_refused_is_told_with_the_value_that_was_given() {
    type Change = fn(&mut Settings);
    let cases: [(Change, &str); 7] = [
        (|s| s.lifts[0].numbers.adaptation_s = 1e-9, "free.adaptation_s is 0.000000001;"),
        (|s| (s.lifts[0].numbers.u_min, s.lifts[0].numbers.u_max) = (0.0, 0.0), "free.adaptation_s is 20;"),
        (|s| s.lifts[1].table.first = i32::MAX, "main.table is 2147483647;"),
        (|s| s.lifts[1].ratio.first = -2_000_000, "main.ratio is -2000000;"),
        (|s| s.lifts[1].table.spacing = 15, "main.table is 15;"),
        (|s| s.lifts[0].swing.as_mut().unwrap().damping[1] = 0.96, "free.swing.damping is 0.96;"),
        (|s| s.lifts[0].swing.as_mut().unwrap().lead[2] = 400.0, "free.swing.lead_deg is 400;"),
    ];
    for (change, told) in cases {
        let mut odd = settings(true);
        change(&mut odd);
        let refused = odd.config(Word::Bits16).unwrap_err();
        assert_eq!(refused.code(), "argument-invalid");
        assert!(refused.to_string().contains(told), "{refused}");
    }
}

#[test]
fn no_knot_stands_for_more_than_32_bits() {
    // Of one gain in some fifty thousand the largest knot would be rounded up to 2^31.
    for gain in [5.846753279329128, 4.0, 50.0] {
        let mut edge = settings(true);
        for lift in &mut edge.lifts {
            let swing = lift.swing.as_mut().unwrap();
            (swing.frequency, swing.gain, swing.lead) = (vec![2.0; 4], vec![gain; 4], vec![0.0; 4]);
        }
        for word in Word::BOTH {
            for lift in edge.config(word).unwrap().lifts {
                let pressure = lift.pressure;
                for table in [&pressure.cosine, &pressure.sine, &pressure.real, &pressure.imaginary] {
                    for k in 0..table.knots.len() {
                        assert!(i32::try_from(table.knot(k)).is_ok(), "{gain} {word:?} {}", table.knot(k));
                    }
                }
            }
        }
    }
}
