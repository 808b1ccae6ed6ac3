//! A controller in the loop: the sensors of all lanes are read as integers, and answered, once a tick.

use super::controllers::{Controllers, Idle};
use super::drive::Drive;
use super::sensing::{Sensing, Sensors};
use crate::control::config::Config;
use crate::integer::{Integer, LaneInteger};
use crate::lanes::LaneScalar;
use crate::mast::LiftName;
use crate::solver::vectors::{widest, Work};
use crate::truck::Truck;

/// What the ECU reads in one tick; free and main. A lift that is not simulated stands at zero, without pressure.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Reading<I = i32> {
    /// Encoder counts of [`crate::sensors::ENCODER_COUNT`], upward positive.
    pub position: [I; 2],
    /// Cylinder pressures in steps of [`crate::sensors::PRESSURE_STEP`].
    pub pressure: [I; 2],
    /// Oil temperature in steps of [`crate::sensors::TEMPERATURE_STEP`], from 0 °C.
    pub temperature: I,
}

impl Reading {
    /// As the controller's arithmetic has it.
    pub fn whole(&self) -> Reading<i64> {
        Reading {
            position: self.position.map(i64::from),
            pressure: self.pressure.map(i64::from),
            temperature: i64::from(self.temperature),
        }
    }
}

/// What runs on the ECU: integers in, integers out.
pub trait Controller: Send {
    /// One tick: the currents [mA] of the free and the main valve for the lowering speed asked for [mm/s].
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2];
    /// The lowering speeds of the forks [mm/s] that the last tick meant the lifts to have.
    fn reference(&self) -> [i32; 2];
    /// The configuration, if this is the fixed-point controller before its first tick: lanes then run it together.
    fn in_integers(&self) -> Option<&Config> {
        None
    }
    /// Whether it leaves the valves shut, whatever it reads.
    fn idles(&self) -> bool {
        false
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

/// One tick: what was wanted and what was ordered; of one truck, or of one in each lane.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Order<I = i32> {
    /// [`Controller::reference`] [mm/s].
    pub reference: [I; 2],
    /// Currents [mA], before the delay.
    pub current: [I; 2],
}

/// One controller in each of N lanes, one call a tick.
pub struct ClosedLoop<'a, S: LaneScalar<N>, const N: usize, const L: usize> {
    controllers: Controllers<'a, S, N>,
    sensing: Sensing<S, N, L>,
    requests: [&'a [i32]; N],
    /// Of all lanes, where it is one.
    one_request: Option<&'a [i32]>,
    delays: [usize; N],
    /// Of all lanes, where it is one.
    one_delay: Option<usize>,
    which: [LiftName; L],
    /// What the controllers ordered, by tick: of as many of the last ticks as are looked back on.
    orders: Vec<Order<S::Integer>>,
    /// The bits of a tick's number that tell its place among them.
    kept: usize,
    begun: usize,
    /// What the valves get, by tick.
    commands: Vec<[S; L]>,
}

/// What is asked for in a tick [mm/s]: the last stays.
fn asked(request: &[i32], k: usize) -> i64 {
    i64::from(request.get(k).or(request.last()).copied().unwrap_or(0))
}

pub(super) fn place(lift: LiftName) -> usize {
    usize::from(lift == LiftName::Main)
}

impl<'a, S: LaneScalar<N>, const N: usize, const L: usize> ClosedLoop<'a, S, N, L> {
    /// The lifts `which` of trucks of one make: `truck` says which effects show in its outputs. It remembers orders as
    /// long as they are on their way.
    pub fn new(which: [LiftName; L], truck: &Truck, seats: [Seat<'a>; N]) -> Self {
        let (requests, delays) = (seats.each_ref().map(|seat| seat.request), seats.each_ref().map(|seat| seat.delay));
        let longest = requests.iter().map(|request| request.len()).max().unwrap_or(0);
        let mut controllers = Vec::with_capacity(N);
        let sensors = seats.map(|seat| {
            controllers.push(seat.controller);
            seat.sensors
        });
        ClosedLoop {
            controllers: Controllers::of(controllers),
            sensing: Sensing::new(which, truck, sensors),
            requests,
            one_request: requests.iter().all(|&request| request == requests[0]).then_some(requests[0]),
            delays,
            one_delay: delays.iter().all(|&delay| delay == delays[0]).then_some(delays[0]),
            which,
            orders: Vec::new(),
            kept: (1 + delays.iter().max().unwrap_or(&0)).next_power_of_two() - 1,
            begun: 0,
            commands: Vec::with_capacity(longest),
        }
    }

    /// The same, remembering every order.
    pub fn remembering(mut self) -> Self {
        self.kept = usize::MAX;
        self
    }

    /// What the controllers ordered in a tick that is remembered.
    #[inline(always)]
    pub fn order(&self, k: usize) -> &Order<S::Integer> {
        &self.orders[k & self.kept]
    }

    /// What a lane's controller ordered so far, by tick.
    ///
    /// # Panics
    /// If it did not remember every order.
    pub fn orders(&self, lane: usize) -> Vec<Order> {
        assert_eq!(self.orders.len(), self.begun, "every order is remembered");
        let of = |both: [S::Integer; 2]| both.map(|value| value.lanes()[lane] as i32);
        self.orders.iter().map(|order| Order { reference: of(order.reference), current: of(order.current) }).collect()
    }

    /// What is asked of each lane in a tick [mm/s].
    #[inline(always)]
    pub fn request(&self, k: usize) -> S::Integer {
        if let Some(request) = self.one_request {
            return S::Integer::constant(asked(request, k));
        }
        S::Integer::from_lanes(std::array::from_fn(|lane| asked(self.requests[lane], k)))
    }

    /// The currents [mA] that reach a lift's valves in tick `k`.
    #[inline(always)]
    fn arrived(&self, k: usize, lift: usize) -> S::Integer {
        if let Some(delay) = self.one_delay {
            return if k < delay { S::Integer::zero() } else { self.order(k - delay).current[lift] };
        }
        S::Integer::from_lanes(std::array::from_fn(|lane| {
            let then = k.checked_sub(self.delays[lane]);
            then.map_or(0, |then| self.order(then).current[lift].lanes()[lane])
        }))
    }

    // No closure touches lanes here: one that is not inlined is compiled without the vectors.
    #[inline(always)]
    fn tick_here(&mut self, k: usize, x: &[S], oil_temperature_degc: S) {
        let reading = self.sensing.read(x, oil_temperature_degc);
        let request = self.request(k);
        let at = k & self.kept;
        if at == self.orders.len() {
            let none = [S::Integer::zero(); 2];
            self.orders.push(Order { reference: none, current: none });
        }
        self.controllers.tick(request, &reading, &mut self.orders[at]);
        self.begun = k + 1;
        let mut command = [S::zero(); L];
        for l in 0..L {
            command[l] = S::of_integer(self.arrived(k, place(self.which[l]))) * S::constant(1e-3);
        }
        self.commands.push(command);
    }
}

/// One tick with the widest vectors.
struct Tick<'c, 'a, 'x, S: LaneScalar<N>, const N: usize, const L: usize> {
    closed: &'c mut ClosedLoop<'a, S, N, L>,
    k: usize,
    x: &'x [S],
    oil_temperature_degc: S,
}

impl<S: LaneScalar<N>, const N: usize, const L: usize> Work for Tick<'_, '_, '_, S, N, L> {
    type Number = S;
    type Output = ();
    #[inline(always)]
    fn run(self) {
        self.closed.tick_here(self.k, self.x, self.oil_temperature_degc);
    }
}

impl<S: LaneScalar<N>, const N: usize, const L: usize> Drive<S, L> for ClosedLoop<'_, S, N, L> {
    fn known_ahead(&self) -> bool {
        false
    }

    fn tick(&mut self, k: usize, x: &[S], oil_temperature_degc: S) {
        widest(Tick { closed: self, k, x, oil_temperature_degc });
    }

    fn command(&self, k: usize) -> [S; L] {
        self.commands[k]
    }
}
