//! The sensors of a block of lanes: what the trucks show, with noise, as the integers that an ECU reads.

use super::closed_loop::{place, Reading};
use crate::integer::{Integer, LaneInteger};
use crate::lanes::LaneScalar;
use crate::mast::LiftName;
use crate::outputs::{Readings, OUTPUTS};
use crate::random::{bell, Random};
use crate::sensors::{ENCODER_COUNT, PRESSURE_STEP, TEMPERATURE_STEP};
use crate::streams::Streams;
use crate::truck::Truck;

/// Sensors that read wrong, after all else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misread {
    /// Counts that the encoders give for each true one.
    pub encoder_factor: f64,
    /// Added to the pressures [steps].
    pub pressure_offset: i32,
    /// Added to the temperature [steps].
    pub temperature_offset: i32,
}

impl Misread {
    /// Nothing read wrong.
    pub const NONE: Misread = Misread { encoder_factor: 1.0, pressure_offset: 0, temperature_offset: 0 };
}

/// The sensors of one truck. Their noise depends on seed, stream and tick alone.
pub struct Sensors {
    /// Standard deviation of a pressure's noise [Pa], before rounding.
    pub pressure_noise_pa: f64,
    /// Standard deviation of the temperature's noise [K], before rounding.
    pub temperature_noise_k: f64,
    /// Where within a count the encoders' zeros lie [m]; free and main.
    pub encoder_zero_m: [f64; 2],
    pub misread: Misread,
    random: Random,
}

impl Sensors {
    /// Without noise, of zeros where the outputs have theirs.
    pub fn perfect() -> Self {
        Sensors::noisy(0.0, 0.0, [0.0; 2], 0, 0)
    }

    /// Different streams of one seed are independent.
    pub fn noisy(
        pressure_noise_pa: f64,
        temperature_noise_k: f64,
        encoder_zero_m: [f64; 2],
        seed: u64,
        stream: u64,
    ) -> Self {
        let random = Random::new(seed, stream);
        Sensors { pressure_noise_pa, temperature_noise_k, encoder_zero_m, misread: Misread::NONE, random }
    }
}

/// Places of a channel among the states, with factors.
type Channel = Vec<(usize, f64)>;

/// The sensors of N trucks.
pub(super) struct Sensing<S: LaneScalar<N>, const N: usize, const L: usize> {
    which: [LiftName; L],
    position: [Channel; L],
    pressure: [Channel; L],
    zero: [S; L],
    pressure_noise: S,
    temperature_noise: S,
    /// None where no lane has noise: none is drawn. A tick takes a word for each pressure, then the temperature's.
    random: Option<Streams<S, N>>,
    /// Any lane's, else they are as they should be.
    misread: Option<Faults<S, S::Integer>>,
}

/// [`Misread`] of each lane.
struct Faults<S, I> {
    encoder_factor: S,
    pressure_offset: I,
    temperature_offset: I,
}

impl<S: LaneScalar<N>, const N: usize, const L: usize> Sensing<S, N, L> {
    pub(super) fn new(which: [LiftName; L], truck: &Truck, sensors: [Sensors; N]) -> Self {
        let readings = Readings::new(&which, truck.effects());
        let channel = |name: &str, lift: LiftName| -> Channel {
            let name = name.replace("LIFT", lift.as_str());
            let k = OUTPUTS.iter().position(|output| output.name == name).expect("the table has it");
            readings.of(k).collect()
        };
        let each = |of: &dyn Fn(&Sensors) -> f64| S::from_lanes(sensors.each_ref().map(of));
        let whole =
            |of: &dyn Fn(&Sensors) -> i32| S::Integer::from_lanes(sensors.each_ref().map(|own| i64::from(of(own))));
        let silent = sensors.iter().all(|own| own.pressure_noise_pa == 0.0 && own.temperature_noise_k == 0.0);
        let exact = sensors.iter().all(|own| own.misread == Misread::NONE);
        Sensing {
            which,
            position: which.map(|lift| channel("position_LIFT_m", lift)),
            pressure: which.map(|lift| channel("pressure_LIFT_pa", lift)),
            zero: which.map(|lift| each(&|own| own.encoder_zero_m[place(lift)])),
            pressure_noise: each(&|own| own.pressure_noise_pa),
            temperature_noise: each(&|own| own.temperature_noise_k),
            random: (!silent).then(|| Streams::of(sensors.each_ref().map(|own| &own.random))),
            misread: (!exact).then(|| Faults {
                encoder_factor: each(&|own| own.misread.encoder_factor),
                pressure_offset: whole(&|own| own.misread.pressure_offset),
                temperature_offset: whole(&|own| own.misread.temperature_offset),
            }),
        }
    }

    /// The noise of the tick's next signal.
    #[inline(always)]
    fn noise(&mut self, deviation: S) -> S {
        match &mut self.random {
            Some(random) => deviation * bell::<S, N>(random.word()),
            None => S::zero(),
        }
    }

    /// One tick's readings.
    #[inline(always)]
    pub(super) fn read(&mut self, x: &[S], oil_temperature_degc: S) -> Reading<S::Integer> {
        let zero = S::Integer::zero();
        let mut reading = Reading { position: [zero; 2], pressure: [zero; 2], temperature: zero };
        for l in 0..L {
            let lift = place(self.which[l]);
            let from_zero = sum(&self.position[l], x) - self.zero[l];
            reading.position[lift] = (from_zero * S::constant(1.0 / ENCODER_COUNT)).floor();
            let read = sum(&self.pressure[l], x) + self.noise(self.pressure_noise);
            reading.pressure[lift] = (read * S::constant(1.0 / PRESSURE_STEP)).nearest();
        }
        let read = oil_temperature_degc + self.noise(self.temperature_noise);
        reading.temperature = (read * S::constant(1.0 / TEMPERATURE_STEP)).nearest();
        if let Some(faults) = &self.misread {
            for lift in 0..2 {
                let counts = S::of_integer(reading.position[lift]) * faults.encoder_factor;
                reading.position[lift] = counts.floor();
                reading.pressure[lift] = bounded(reading.pressure[lift] + faults.pressure_offset);
            }
            reading.temperature = bounded(reading.temperature + faults.temperature_offset);
        }
        reading
    }
}

/// The nearest integer of 32 bits.
#[inline(always)]
fn bounded<I: Integer>(x: I) -> I {
    x.clamp_to(I::constant(i64::from(i32::MIN)), I::constant(i64::from(i32::MAX)))
}

/// A channel's value in each lane.
#[inline(always)]
fn sum<S: LaneScalar<N>, const N: usize>(channel: &Channel, x: &[S]) -> S {
    let mut sum = S::zero();
    for &(place, factor) in channel {
        sum = sum + S::constant(factor) * x[place];
    }
    sum
}
