//! The controllers of a block of lanes: all in one go where they are of one kind, else lane by lane.

use super::closed_loop::{Controller, Order, Reading};
use crate::control::config::Config;
use crate::control::controller::State;
use crate::control::numbers::Numbers;
use crate::integer::LaneInteger;
use crate::lanes::LaneScalar;
use crate::solver::vectors::{widest, Work};

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
    fn idles(&self) -> bool {
        true
    }
}

/// What answers the sensors of N lanes.
pub(super) enum Controllers<'a, S: LaneScalar<N>, const N: usize> {
    /// Fixed-point controllers, each with its own settings.
    Lanes(Box<Block<S::Integer>>),
    Each(Vec<Box<dyn Controller + 'a>>),
}

/// Controllers side by side.
pub(super) struct Block<I> {
    numbers: Numbers<I>,
    state: State<I>,
}

impl<'a, S: LaneScalar<N>, const N: usize> Controllers<'a, S, N> {
    /// One controller a lane. Lanes beyond the last fixed-point controller run its like, and nothing is read of them.
    pub(super) fn of(controllers: Vec<Box<dyn Controller + 'a>>) -> Self {
        assert_eq!(controllers.len(), N, "a controller in every lane");
        let configs: Vec<&Config> = controllers.iter().map_while(|controller| controller.in_integers()).collect();
        let idle = controllers[configs.len()..].iter().all(|controller| controller.idles());
        let numbers = match configs.first() {
            Some(_) if idle => {
                let last = configs.len() - 1;
                Some(Numbers::of(std::array::from_fn::<&Config, N, _>(|lane| configs[lane.min(last)])))
            }
            _ => None,
        };
        match numbers {
            Some(numbers) => Controllers::Lanes(Box::new(Block { numbers, state: State::at_rest() })),
            None => Controllers::Each(controllers),
        }
    }

    /// Writes the order where it stays: that of many lanes is too large to be handed round.
    #[inline(always)]
    pub(super) fn tick(&mut self, request: S::Integer, reading: &Reading<S::Integer>, order: &mut Order<S::Integer>) {
        match self {
            Controllers::Lanes(block) => {
                let Block { numbers, state } = &mut **block;
                widest(Answer::<S, N> { numbers, state, request, reading, order });
            }
            Controllers::Each(controllers) => *order = one_by_one(controllers, request, reading),
        }
    }
}

/// One tick of all controllers, with the widest vectors: compiled once for all that has lanes.
struct Answer<'n, S: LaneScalar<N>, const N: usize> {
    numbers: &'n Numbers<S::Integer>,
    state: &'n mut State<S::Integer>,
    request: S::Integer,
    reading: &'n Reading<S::Integer>,
    order: &'n mut Order<S::Integer>,
}

impl<S: LaneScalar<N>, const N: usize> Work for Answer<'_, S, N> {
    type Number = S;
    type Output = ();
    #[inline(always)]
    fn run(self) {
        self.order.current = self.state.tick_of(self.numbers, self.request, self.reading);
        self.order.reference = self.state.meant();
    }
}

fn one_by_one<I: LaneInteger<N>, const N: usize>(
    controllers: &mut [Box<dyn Controller + '_>],
    request: I,
    reading: &Reading<I>,
) -> Order<I> {
    let (request, temperature) = (request.lanes(), reading.temperature.lanes());
    let (position, pressure) = (reading.position.map(I::lanes), reading.pressure.map(I::lanes));
    let (mut reference, mut current) = ([[0; N]; 2], [[0; N]; 2]);
    for (lane, controller) in controllers.iter_mut().enumerate() {
        let of = |both: [[i64; N]; 2]| both.map(|lanes| lanes[lane] as i32);
        let own = Reading { position: of(position), pressure: of(pressure), temperature: temperature[lane] as i32 };
        let (ordered, meant) = (controller.tick(request[lane] as i32, &own), controller.reference());
        for lift in 0..2 {
            current[lift][lane] = i64::from(ordered[lift]);
            reference[lift][lane] = i64::from(meant[lift]);
        }
    }
    Order { reference: reference.map(I::from_lanes), current: current.map(I::from_lanes) }
}
