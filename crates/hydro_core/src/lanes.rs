//! N independent numbers that go through the same arithmetic: the SIMD scalar.
//!
//! [`Lanes`] are plain loops over an array; the compiler turns them into vectors. Where the processor has AVX2,
//! eight lanes are two registers of four side by side, and with AVX-512 sixteen are two of eight
//! ([`with_registers`]; [`with_eight`] and [`with_sixteen`] are for benches, which also measure one register of
//! eight). Every lane's bits are those of the `f64` run, whatever its neighbours hold. In single precision
//! ([`Single`]) a register holds twice as many, and a lane's bits are those of the run of one [`Single`].

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod integers;
mod pair;
mod single;
#[cfg(target_arch = "x86_64")]
mod singles;

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::integer::LaneInteger;
use crate::scalar::{Mask, Scalar};

pub use integers::Integers;
pub use single::Single;

#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Lanes<const N: usize>(pub [f64; N]);

#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct LaneMask<const N: usize>(pub [u64; N]);

#[inline(always)]
fn map<const N: usize>(a: Lanes<N>, f: impl Fn(f64) -> f64) -> Lanes<N> {
    let mut out = [0.0; N];
    for i in 0..N {
        out[i] = f(a.0[i]);
    }
    Lanes(out)
}

#[inline(always)]
fn zip<const N: usize>(a: Lanes<N>, b: Lanes<N>, f: impl Fn(f64, f64) -> f64) -> Lanes<N> {
    let mut out = [0.0; N];
    for i in 0..N {
        out[i] = f(a.0[i], b.0[i]);
    }
    Lanes(out)
}

macro_rules! binary {
    ($($trait:ident $method:ident $op:tt),*) => {$(
        impl<const N: usize> $trait for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                zip(self, other, |a, b| a $op b)
            }
        }
    )*};
}
binary!(Add add +, Sub sub -, Mul mul *, Div div /);

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        map(self, |a| -a)
    }
}

impl<const N: usize> Mask for LaneMask<N> {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        let mut out = [0u64; N];
        for i in 0..N {
            out[i] = self.0[i] & other.0[i];
        }
        LaneMask(out)
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        let mut out = [0u64; N];
        for i in 0..N {
            out[i] = self.0[i] | other.0[i];
        }
        LaneMask(out)
    }
    #[inline(always)]
    fn not(self) -> Self {
        let mut out = [0u64; N];
        for i in 0..N {
            out[i] = !self.0[i];
        }
        LaneMask(out)
    }
    #[inline(always)]
    fn any(self) -> bool {
        let mut any = 0;
        for i in 0..N {
            any |= self.0[i];
        }
        any != 0
    }
}

impl<const N: usize> Scalar for Lanes<N> {
    type Mask = LaneMask<N>;
    const NUMBERS: usize = N;
    type Real = Self;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Lanes([value; N])
    }
    #[inline(always)]
    fn from_real(value: Self) -> Self {
        value
    }
    #[inline(always)]
    fn real(self) -> Self {
        self
    }
    #[inline(always)]
    fn implicit(root: Self, _residual: Self, _slope: Self) -> Self {
        root
    }
    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask<N> {
        let mut out = [0u64; N];
        for i in 0..N {
            out[i] = if self.0[i] < other.0[i] { u64::MAX } else { 0 };
        }
        LaneMask(out)
    }
    #[inline(always)]
    fn select(mask: LaneMask<N>, yes: Self, no: Self) -> Self {
        let mut out = [0.0; N];
        for i in 0..N {
            out[i] = f64::from_bits((mask.0[i] & yes.0[i].to_bits()) | (!mask.0[i] & no.0[i].to_bits()));
        }
        Lanes(out)
    }
    #[inline(always)]
    fn is_finite(self) -> LaneMask<N> {
        let mut out = [0u64; N];
        for i in 0..N {
            out[i] = if self.0[i].is_finite() { u64::MAX } else { 0 };
        }
        LaneMask(out)
    }
    fn largest(self) -> f64 {
        self.0.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        map(self, f64::sqrt)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        map(self, crate::elementary::exp)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        map(self, crate::elementary::ln)
    }
    fn cos(self) -> Self {
        map(self, libm::cos)
    }
    fn sin(self) -> Self {
        map(self, libm::sin)
    }
    #[inline(always)]
    fn inverse_fourth_root(self) -> Self {
        map(self, crate::elementary::inverse_fourth_root)
    }
}

/// N numbers that go through the same arithmetic.
pub trait LaneScalar<const N: usize>: Scalar<Real = Self> {
    /// As many integers, of the same masks.
    type Integer: LaneInteger<N>;
    fn from_lanes(lanes: [f64; N]) -> Self;
    fn lanes(self) -> [f64; N];
    /// The largest integer of 32 bits up to x; of what is not a number zero, of what is too small the least integer.
    fn floor(self) -> Self::Integer;
    /// The nearest integer of 32 bits, halves away from zero; of what is not a number zero.
    fn nearest(self) -> Self::Integer;
    /// An integer below 2^51 either way, exactly.
    fn of_integer(value: Self::Integer) -> Self;
}

#[inline(always)]
fn floor(x: f64) -> i64 {
    i64::from(x.floor() as i32)
}

#[inline(always)]
fn nearest(x: f64) -> i64 {
    i64::from(x.round() as i32)
}

/// A plain number is one lane.
impl LaneScalar<1> for f64 {
    type Integer = i64;
    #[inline(always)]
    fn from_lanes([value]: [f64; 1]) -> Self {
        value
    }
    #[inline(always)]
    fn lanes(self) -> [f64; 1] {
        [self]
    }
    #[inline(always)]
    fn floor(self) -> i64 {
        floor(self)
    }
    #[inline(always)]
    fn nearest(self) -> i64 {
        nearest(self)
    }
    #[inline(always)]
    fn of_integer(value: i64) -> f64 {
        value as f64
    }
}

impl<const N: usize> LaneScalar<N> for Lanes<N> {
    type Integer = Integers<N>;
    #[inline(always)]
    fn from_lanes(lanes: [f64; N]) -> Self {
        Lanes(lanes)
    }
    #[inline(always)]
    fn lanes(self) -> [f64; N] {
        self.0
    }
    #[inline(always)]
    fn floor(self) -> Integers<N> {
        Integers(self.0.map(floor))
    }
    #[inline(always)]
    fn nearest(self) -> Integers<N> {
        Integers(self.0.map(nearest))
    }
    #[inline(always)]
    fn of_integer(value: Integers<N>) -> Self {
        Lanes(value.0.map(|x| x as f64))
    }
}

/// Work on N lanes, whichever scalar holds them.
pub trait LaneWork<const N: usize> {
    type Output;
    fn run<S: LaneScalar<N>>(self) -> Self::Output;
}

/// Runs `work` over the fastest eight lanes that the processor has; what is to be fast in it runs
/// under [`crate::solver::vectors::widest`].
pub fn with_eight<W: LaneWork<8>>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if crate::solver::vectors::has_avx512() {
        return work.run::<avx512::Eight>();
    }
    work.run::<Lanes<8>>()
}

/// As [`with_eight`], two groups of eight side by side.
pub fn with_sixteen<W: LaneWork<16>>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if crate::solver::vectors::has_avx512() {
        return work.run::<pair::Pair<avx512::Eight>>();
    }
    work.run::<pair::Pair<Lanes<8>>>()
}

/// Four lanes, in one register where the processor has AVX2.
pub fn with_four<W: LaneWork<4>>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if crate::solver::vectors::has_avx2() {
        return work.run::<avx2::Four>();
    }
    work.run::<Lanes<4>>()
}

/// How precise the numbers of a run are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 53 bits.
    Double,
    /// 24 bits.
    Single,
}

impl Precision {
    /// The numbers of lanes that runs of it have, the widest first.
    pub fn widths(self) -> &'static [Width] {
        match self {
            Precision::Double => &[Width::Sixteen, Width::Eight, Width::One],
            Precision::Single => &[Width::ThirtyTwo, Width::One],
        }
    }

    /// The widest that is here.
    pub fn widest(self) -> Width {
        self.widths().iter().copied().find(|width| width.is_here()).unwrap_or(Width::One)
    }
}

/// Numbers of lanes for which processors have registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Width {
    /// Two groups of sixteen in single precision, on AVX-512.
    ThirtyTwo,
    /// Two groups of eight, on AVX-512.
    Sixteen,
    /// Two groups of four, on AVX2.
    Eight,
    One,
}

impl Width {
    /// How many lanes.
    pub fn lanes(self) -> usize {
        match self {
            Width::ThirtyTwo => 32,
            Width::Sixteen => 16,
            Width::Eight => 8,
            Width::One => 1,
        }
    }

    /// Whether this processor has the registers.
    pub fn is_here(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        return match self {
            Width::ThirtyTwo | Width::Sixteen => crate::solver::vectors::has_avx512(),
            Width::Eight => crate::solver::vectors::has_avx2(),
            Width::One => true,
        };
        #[cfg(not(target_arch = "x86_64"))]
        return self == Width::One;
    }
}

/// Runs `work` on so many lanes; every lane is the `f64` run to the bit. What is to be fast in it runs under
/// [`crate::solver::vectors::widest`].
///
/// # Panics
/// A width that is not here, or that double precision does not have.
pub fn with_registers<T, W>(width: Width, work: W) -> T
where
    W: LaneWork<16, Output = T> + LaneWork<8, Output = T> + LaneWork<1, Output = T>,
{
    check(Precision::Double, width);
    match width {
        #[cfg(target_arch = "x86_64")]
        Width::Sixteen => LaneWork::<16>::run::<pair::Pair<avx512::Eight>>(work),
        #[cfg(target_arch = "x86_64")]
        Width::Eight => LaneWork::<8>::run::<pair::Pair<avx2::Four>>(work),
        _ => LaneWork::<1>::run::<f64>(work),
    }
}

/// As [`with_registers`] in single precision; every lane is the run of one [`Single`] to the bit.
///
/// # Panics
/// A width that is not here, or that single precision does not have.
pub fn with_single_registers<T, W>(width: Width, work: W) -> T
where
    W: LaneWork<32, Output = T> + LaneWork<1, Output = T>,
{
    check(Precision::Single, width);
    match width {
        #[cfg(target_arch = "x86_64")]
        Width::ThirtyTwo => LaneWork::<32>::run::<pair::Pair<singles::Sixteen>>(work),
        _ => LaneWork::<1>::run::<Single>(work),
    }
}

fn check(precision: Precision, width: Width) {
    let known = precision.widths().contains(&width) && width.is_here();
    assert!(known, "{width:?} lanes of {precision:?} precision have no registers here");
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Four = Lanes<4>;

    fn numbers() -> impl Strategy<Value = [f64; 8]> {
        proptest::array::uniform8(prop_oneof![
            8 => -1e3..1e3f64,
            1 => Just(0.0),
            1 => Just(-0.0),
            1 => Just(f64::INFINITY),
            1 => Just(f64::NEG_INFINITY),
            1 => Just(f64::NAN),
        ])
    }

    /// Every operation a scalar has.
    fn operations<S: Scalar>(a: S, b: S) -> Vec<S> {
        let (less, finite) = (a.lt(b), b.is_finite());
        let choices = [less, less.not(), less.and(finite), less.or(finite)].map(|mask| S::select(mask, a, b));
        let plain = vec![a + b, a - b, a * b, a / b, -a, a.max(b), a.min(b), a.abs(), a.abs().sqrt(), a.sin(), a.cos()];
        [plain, choices.to_vec()].concat()
    }

    fn functions<S: Scalar>(a: S) -> Vec<S> {
        vec![a.exp(), (-a).exp(), a.ln(), a.inverse_fourth_root()]
    }

    /// Which of several signalling bits a "not a number" carries is not settled.
    fn bits(x: f64) -> u64 {
        if x.is_nan() {
            f64::NAN.to_bits()
        } else {
            x.to_bits()
        }
    }

    struct Operations<const N: usize>([f64; N], [f64; N]);

    impl<const N: usize> LaneWork<N> for Operations<N> {
        type Output = Vec<[f64; N]>;
        fn run<S: LaneScalar<N>>(self) -> Self::Output {
            operations(S::from_lanes(self.0), S::from_lanes(self.1)).into_iter().map(S::lanes).collect()
        }
    }

    struct Functions<const N: usize>([f64; N]);

    impl<const N: usize> LaneWork<N> for Functions<N> {
        type Output = Vec<[f64; N]>;
        fn run<S: LaneScalar<N>>(self) -> Self::Output {
            functions(S::from_lanes(self.0)).into_iter().map(S::lanes).collect()
        }
    }

    /// The same work on eight lanes as runs have them on a processor with AVX2.
    fn on_avx2<W: LaneWork<8>>(work: W) -> Option<W::Output> {
        #[cfg(target_arch = "x86_64")]
        if Width::Eight.is_here() {
            return Some(work.run::<pair::Pair<avx2::Four>>());
        }
        let _ = work;
        None
    }

    /// Beside its mirror image, so that both halves of sixteen hold other numbers at each place.
    fn twice(a: [f64; 8]) -> [f64; 16] {
        std::array::from_fn(|k| if k < 8 { a[k] } else { a[15 - k] })
    }

    proptest! {
        #[test]
        fn every_operation_on_lanes_is_that_on_each_number_infinities_included(a in numbers(), b in numbers()) {
            let (wide, pair) = (with_eight(Operations(a, b)), on_avx2(Operations(a, b)));
            let wider = with_sixteen(Operations(twice(a), twice(b)));
            let together = operations(Lanes(a), Lanes(b));
            for lane in 0..8 {
                for (k, alone) in operations(a[lane], b[lane]).into_iter().enumerate() {
                    prop_assert_eq!(bits(together[k].0[lane]), bits(alone), "operation {} in lane {}", k, lane);
                    prop_assert_eq!(bits(wide[k][lane]), bits(alone), "operation {} in lane {} of eight", k, lane);
                    if let Some(pair) = &pair {
                        prop_assert_eq!(bits(pair[k][lane]), bits(alone), "operation {} in lane {} of 2 x 4", k, lane);
                    }
                    for lane in [lane, 15 - lane] {
                        prop_assert_eq!(bits(wider[k][lane]), bits(alone), "operation {} in lane {} of 16", k, lane);
                    }
                }
            }
        }

        #[test]
        fn every_function_on_lanes_is_that_on_each_number(a in proptest::array::uniform8(1e-3..700.0f64)) {
            let (wide, pair) = (with_eight(Functions(a)), on_avx2(Functions(a)));
            let wider = with_sixteen(Functions(twice(a)));
            let together = functions(Lanes(a));
            for lane in 0..8 {
                for (k, alone) in functions(a[lane]).into_iter().enumerate() {
                    prop_assert_eq!(together[k].0[lane].to_bits(), alone.to_bits(), "function {} in lane {}", k, lane);
                    prop_assert_eq!(wide[k][lane].to_bits(), alone.to_bits(), "function {} in lane {} of eight", k, lane);
                    if let Some(pair) = &pair {
                        prop_assert_eq!(pair[k][lane].to_bits(), alone.to_bits(), "function {} in lane {} of 2 x 4", k, lane);
                    }
                    for lane in [lane, 15 - lane] {
                        prop_assert_eq!(wider[k][lane].to_bits(), alone.to_bits(), "function {} in lane {} of 16", k, lane);
                    }
                }
            }
        }
    }

    /// All that is done with numbers, their integers included.
    struct All<const N: usize>([f64; N], [f64; N], [f64; N]);

    impl<const N: usize> LaneWork<N> for All<N> {
        type Output = Vec<[f64; N]>;
        fn run<S: LaneScalar<N>>(self) -> Self::Output {
            let (a, b, c) = (S::from_lanes(self.0), S::from_lanes(self.1), S::from_lanes(self.2));
            let whole = [a.floor(), a.nearest(), b.floor(), b.nearest()]
                .map(|y| [y.lanes().map(|k| k as f64), S::of_integer(y).lanes()]);
            let numbers = operations(a, b).into_iter().chain(functions(c)).map(S::lanes);
            numbers.chain(whole.into_iter().flatten()).collect()
        }
    }

    #[cfg(target_arch = "x86_64")]
    proptest! {
        #[test]
        fn every_operation_on_thirty_two_is_that_on_each_single(
            a in numbers(), b in numbers(), c in proptest::array::uniform8(1e-3..80.0f64), far in -40i32..40,
        ) {
            if Width::ThirtyTwo.is_here() {
                let wide = |x: [f64; 8], scale: f64| -> [f64; 32] {
                    std::array::from_fn(|k| if k < 16 { twice(x)[k] } else { scale * twice(x)[31 - k] })
                };
                let (a, b, c) = (wide(a, f64::from(far).exp2()), wide(b, 0.7), wide(c, 0.9));
                let together = All(a, b, c).run::<pair::Pair<singles::Sixteen>>();
                for lane in 0..32 {
                    let alone = LaneWork::<1>::run::<Single>(All([a[lane]], [b[lane]], [c[lane]]));
                    for (k, [alone]) in alone.into_iter().enumerate() {
                        prop_assert_eq!(bits(together[k][lane]), bits(alone), "operation {} in lane {}", k, lane);
                    }
                }
            }
        }
    }

    #[test]
    fn any_lane_that_is_true_makes_any_true() {
        let x = Lanes([1.0, 2.0, f64::NAN, 4.0]);
        let less = |bound: f64| x.lt(Four::constant(bound));
        assert!(!less(1.0).any() && less(1.5).any() && less(9.0).not().any());
        assert!(!less(1.0).or(less(0.5)).any() && !less(1.5).and(less(1.0)).any());
        assert!(x.is_finite().any() && !Four::constant(f64::NAN).is_finite().any());
    }

    #[test]
    fn a_constant_is_the_same_in_every_lane() {
        assert_eq!(Four::constant(0.1).0, [0.1; 4]);
        assert_eq!((Four::zero().0, Four::one().0), ([0.0; 4], [1.0; 4]));
    }
}
