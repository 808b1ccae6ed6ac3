//! The thesis with the effects of the catalogue, and with unknown inputs of a diagnosis.

use super::{Bus, Lift, Physics};
use crate::effects::{Instance, MastPorts, Term};
use crate::ports::Open;
use crate::scalar::Scalar;
use crate::solver::vectors::{widest, Work};

/// The thesis with effects, and with unknown inputs at its ports.
#[derive(Debug, Clone)]
pub struct Extended<S> {
    /// Each effect with the number of its states.
    terms: Vec<(Term<S>, usize)>,
    inputs: Vec<UnknownInput<S>>,
    /// What the unknown inputs write now, by simulated lift.
    pushed: [Open<S>; 2],
    /// By simulated lift, how much later its command reaches the valve [s].
    delays: Option<[S; 2]>,
}

/// A hat over time at one port of a simulated lift: `height` at `centre` [s], zero from `width` [s] on.
#[derive(Debug, Clone, Copy)]
pub struct UnknownInput<S> {
    pub place: usize,
    /// Its place in [`crate::ports::PORTS`].
    pub port: usize,
    pub height: S,
    pub centre: f64,
    pub width: f64,
}

impl<S: Scalar> Extended<S> {
    /// `effects`: which, at which simulated lift, with which values.
    pub fn new(effects: &[(Instance, usize, Vec<S>)], lifts: &[Lift<S>]) -> Self {
        let mut terms = Vec::with_capacity(effects.len());
        let mut delays = None;
        for (instance, place, values) in effects {
            let term = Term::new(instance.kind, values, lifts, *place);
            if let Some(delay) = term.delay() {
                delays.get_or_insert([S::zero(); 2])[*place] = delay;
            }
            terms.push((term, instance.kind.spec().states.len()));
        }
        Extended { terms, inputs: Vec::new(), pushed: [Open::quiet(); 2], delays }
    }

    /// With unknown inputs besides: of the fast path only, which tells the time.
    pub fn with_inputs(mut self, inputs: Vec<UnknownInput<S>>) -> Self {
        self.inputs = inputs;
        self
    }
}

impl<S: Scalar> Physics<S> for Extended<S> {
    type Ports = Open<S>;
    const JOINED: bool = true;
    const COMMAND_AS_GIVEN: bool = false;
    // The catalogue is compiled once for each kind of vectors, not into every caller: each call is a piece of work.
    fn states(&self) -> usize {
        self.terms.iter().map(|(_, n)| n).sum()
    }
    fn ports<const L: usize>(&self, bus: &Bus<S, L>, own: &[S]) -> ([Open<S>; L], S) {
        widest(Acting { physics: self, bus, own })
    }
    #[inline(always)]
    fn at_time(&mut self, t: f64) {
        if self.inputs.is_empty() {
            return;
        }
        self.pushed = [Open::quiet(); 2];
        for input in &self.inputs {
            let share = 1.0 - ((t - input.centre) / input.width).abs();
            if share > 0.0 {
                self.pushed[input.place].push(input.port, S::constant(share) * input.height);
            }
        }
    }
    fn move_inputs(&mut self, centres: [f64; 2]) {
        for pair in self.inputs.chunks_exact_mut(2) {
            for (input, centre) in pair.iter_mut().zip(centres) {
                input.centre = centre;
            }
        }
    }
    fn delays<const L: usize>(&self) -> Option<[S; L]> {
        self.delays.map(|delays| std::array::from_fn(|k| delays[k]))
    }
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        widest(Moving { physics: self, bus, own, rates, relaxing: true });
    }
    fn start<const L: usize>(&self, bus: &Bus<S, L>, own: &mut [S]) {
        let mut rest = own;
        for (term, n) in &self.terms {
            let (mine, others) = rest.split_at_mut(*n);
            term.start(bus, mine);
            rest = others;
        }
    }
    fn explicit_rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        widest(Moving { physics: self, bus, own, rates, relaxing: false });
    }
    fn relax<const L: usize>(&self, from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]) {
        if self.terms.iter().any(|(term, _)| term.relaxes()) {
            widest(Relaxing { physics: self, from, to, h, own });
        }
    }
}

/// What the effects write to the ports.
struct Acting<'a, S, const L: usize> {
    physics: &'a Extended<S>,
    bus: &'a Bus<S, L>,
    own: &'a [S],
}

impl<S: Scalar, const L: usize> Work for Acting<'_, S, L> {
    type Number = S;
    type Output = ([Open<S>; L], S);
    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut ports = MastPorts::quiet();
        let mut rest = self.own;
        for (term, n) in &self.physics.terms {
            let (mine, others) = rest.split_at(*n);
            term.act(self.bus, mine, &mut ports);
            rest = others;
        }
        if !self.physics.inputs.is_empty() {
            for (port, pushed) in ports.lifts.iter_mut().zip(&self.physics.pushed) {
                *port = port.joined(pushed);
            }
        }
        (ports.lifts, ports.joint_inertia)
    }
}

/// The rates of the effects' states, with those that relax or without.
struct Moving<'a, S, const L: usize> {
    physics: &'a Extended<S>,
    bus: &'a Bus<S, L>,
    own: &'a [S],
    rates: &'a mut [S],
    relaxing: bool,
}

impl<S: Scalar, const L: usize> Work for Moving<'_, S, L> {
    type Number = S;
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let (mut rest, mut out) = (self.own, self.rates);
        for (term, n) in &self.physics.terms {
            let (mine, others) = rest.split_at(*n);
            let (mine_out, others_out) = out.split_at_mut(*n);
            if self.relaxing || !term.relaxes() {
                term.rates(self.bus, mine, mine_out);
            }
            (rest, out) = (others, others_out);
        }
    }
}

/// A step of the states that relax.
struct Relaxing<'a, S, const L: usize> {
    physics: &'a Extended<S>,
    from: &'a Bus<S, L>,
    to: &'a Bus<S, L>,
    h: S,
    own: &'a mut [S],
}

impl<S: Scalar, const L: usize> Work for Relaxing<'_, S, L> {
    type Number = S;
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let mut rest = self.own;
        for (term, n) in &self.physics.terms {
            let (mine, others) = rest.split_at_mut(*n);
            term.relax(self.from, self.to, self.h, mine);
            rest = others;
        }
    }
}
