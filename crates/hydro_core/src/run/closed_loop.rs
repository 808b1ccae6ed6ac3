//! A controller in the loop: each lane's sensors are read as integers, and answered, once a tick.

use super::drive::Drive;
use crate::lanes::LaneScalar;
use crate::mast::LiftName;
use crate::outputs::{Readings, OUTPUTS};
use crate::random::Random;
use crate::sensors::{ENCODER_COUNT, PRESSURE_STEP, TEMPERATURE_STEP};
use crate::truck::Truck;

/// What the ECU reads in one tick; free and main. A lift that is not simulated stands at zero, without pressure.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Reading {
    /// Encoder counts of [`ENCODER_COUNT`], upward positive.
    pub position: [i32; 2],
    /// Cylinder pressures in steps of [`PRESSURE_STEP`].
    pub pressure: [i32; 2],
    /// Oil temperature in steps of [`TEMPERATURE_STEP`], from 0 °C.
    pub temperature: i32,
}

/// What runs on the ECU: integers in, integers out.
pub trait Controller: Send {
    /// One tick: the currents [mA] of the free and the main valve for the lowering speed asked for [mm/s].
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2];
    /// The lowering speeds of the forks [mm/s] that the last tick meant the lifts to have.
    fn reference(&self) -> [i32; 2];
}

/// Leaves the valves shut.
#[derive(Debug, Clone, Copy)]
pub struct Idle;

impl Controller for Idle {
    fn tick(&mut self, _request: i32, _reading: &Reading) -> [i32; 2] {
        [0, 0]
    }
    fn reference(&self) -> [i32; 2] {
        [0, 0]
    }
}

/// The sensors of one truck. Their noise depends on seed, stream and tick alone.
pub struct Sensors {
    /// Standard deviation of a pressure's noise [Pa], before rounding.
    pub pressure_noise_pa: f64,
    /// Standard deviation of the temperature's noise [K], before rounding.
    pub temperature_noise_k: f64,
    /// Where within a count the encoders' zeros lie [m]; free and main.
    pub encoder_zero_m: [f64; 2],
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
        Sensors { pressure_noise_pa, temperature_noise_k, encoder_zero_m, random: Random::new(seed, stream) }
    }
}

/// A truck's controller and what lies between it and the truck.
pub struct Seat<'a> {
    pub controller: Box<dyn Controller + 'a>,
    pub sensors: Sensors,
    /// The lowering speed [mm/s] asked for in each tick; the last one stays.
    pub request: &'a [i32],
    /// From reading the sensors to the current in the valve's coil [ticks].
    pub delay: usize,
}

impl Seat<'_> {
    /// Of a truck that stands still.
    pub fn idle() -> Self {
        Seat { controller: Box::new(Idle), sensors: Sensors::perfect(), request: &[], delay: 0 }
    }
}

/// One tick of one lane: what was wanted and what was ordered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Order {
    /// [`Controller::reference`] [mm/s].
    pub reference: [i32; 2],
    /// Currents [mA], before the delay.
    pub current: [i32; 2],
}

/// Places of a channel among the states, with factors.
type Channel = Vec<(usize, f64)>;

/// One controller in each of N lanes, one call a tick.
pub struct ClosedLoop<'a, S, const N: usize, const L: usize> {
    seats: [Seat<'a>; N],
    which: [LiftName; L],
    position: [Channel; L],
    pressure: [Channel; L],
    /// What the controllers ordered, by tick and lane.
    orders: Vec<[Order; N]>,
    /// What the valves get, by tick.
    commands: Vec<[S; L]>,
}

fn place(lift: LiftName) -> usize {
    usize::from(lift == LiftName::Main)
}

impl<'a, S: LaneScalar<N>, const N: usize, const L: usize> ClosedLoop<'a, S, N, L> {
    /// The lifts `which` of trucks of one make: `truck` says which effects show in its outputs.
    pub fn new(which: [LiftName; L], truck: &Truck, seats: [Seat<'a>; N]) -> Self {
        let readings = Readings::new(&which, truck.effects());
        let channel = |name: &str, lift: LiftName| -> Channel {
            let name = name.replace("LIFT", lift.as_str());
            let k = OUTPUTS.iter().position(|output| output.name == name).expect("the table has it");
            readings.of(k).collect()
        };
        ClosedLoop {
            seats,
            which,
            position: which.map(|lift| channel("position_LIFT_m", lift)),
            pressure: which.map(|lift| channel("pressure_LIFT_pa", lift)),
            orders: Vec::new(),
            commands: Vec::new(),
        }
    }

    /// What the controllers ordered so far, by tick and lane.
    pub fn orders(&self) -> &[[Order; N]] {
        &self.orders
    }
}

/// A channel's value in each lane.
#[inline(always)]
fn sum<S: LaneScalar<N>, const N: usize>(channel: &Channel, x: &[S]) -> [f64; N] {
    channel.iter().fold(S::zero(), |sum, &(place, factor)| sum + S::constant(factor) * x[place]).lanes()
}

/// The nearest step; of what is not a number zero, of what is too large the largest integer.
#[inline(always)]
fn steps(value: f64, step: f64) -> i32 {
    (value / step).round() as i32
}

impl<S: LaneScalar<N>, const N: usize, const L: usize> Drive<S, L> for ClosedLoop<'_, S, N, L> {
    fn known_ahead(&self) -> bool {
        false
    }

    fn tick(&mut self, k: usize, x: &[S], oil_temperature_degc: S) {
        let positions: [[f64; N]; L] = std::array::from_fn(|l| sum(&self.position[l], x));
        let pressures: [[f64; N]; L] = std::array::from_fn(|l| sum(&self.pressure[l], x));
        let temperature = oil_temperature_degc.lanes();
        let mut orders = [Order::default(); N];
        for (lane, seat) in self.seats.iter_mut().enumerate() {
            let mut reading = Reading::default();
            let sensors = &mut seat.sensors;
            for l in 0..L {
                let lift = place(self.which[l]);
                let from_zero = positions[l][lane] - sensors.encoder_zero_m[lift];
                reading.position[lift] = (from_zero / ENCODER_COUNT).floor() as i32;
                let noise = sensors.pressure_noise_pa * sensors.random.bell();
                reading.pressure[lift] = steps(pressures[l][lane] + noise, PRESSURE_STEP);
            }
            let noise = sensors.temperature_noise_k * sensors.random.bell();
            reading.temperature = steps(temperature[lane] + noise, TEMPERATURE_STEP);
            let request = seat.request.get(k).or(seat.request.last()).copied().unwrap_or(0);
            let current = seat.controller.tick(request, &reading);
            orders[lane] = Order { reference: seat.controller.reference(), current };
        }
        self.orders.push(orders);
        let arrived = |lane: usize, lift: usize| {
            let given = k.checked_sub(self.seats[lane].delay).map(|then| self.orders[then][lane].current[lift]);
            f64::from(given.unwrap_or(0)) * 1e-3
        };
        let command = self.which.map(|lift| S::from_lanes(std::array::from_fn(|lane| arrived(lane, place(lift)))));
        self.commands.push(command);
    }

    fn command(&self, k: usize) -> [S; L] {
        self.commands[k]
    }
}
