//! A truck's parameter values, checked against the tables, and the lifts built from them.

use std::collections::BTreeMap;

use crate::effects::{Instance, Scope};
use crate::error::Error;
use crate::mast::{Lift, LiftName};
use crate::parameters::{LiftParameters, ParameterSpec, LIFT_PARAMETERS, MOST_TABLE_KNOTS, TABLE_PARAMETERS};
use crate::scalar::Scalar;

/// A value as a parameter file gives it.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    Number(f64),
    Table(Vec<f64>),
}

#[derive(Debug, Clone, PartialEq)]
struct LiftValues {
    scalars: Vec<f64>,
    current: Vec<f64>,
    area: Vec<f64>,
}

impl LiftValues {
    fn len(&self) -> usize {
        self.scalars.len() + self.current.len() + self.area.len()
    }
}

/// Knots of a table's current stand this far apart [A] or further, a seven-thousandth of a step of the ECU: a
/// number of 32 bits tells them apart, and a slope between them is finite.
pub const LEAST_KNOT_GAP_A: f64 = 1e-6;

/// Whether a table's next value is as far above the one before as it has to be; `strictly` says it of currents.
fn rising(pair: &[f64], strictly: bool) -> bool {
    pair[1] - pair[0] >= if strictly { LEAST_KNOT_GAP_A } else { 0.0 }
}

/// Both lifts' parameters and the effects the truck asks for. Every value is within its bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Truck {
    lifts: [LiftValues; 2],
    effects: Vec<(Instance, Vec<f64>)>,
}

/// Where a value acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    Lift(LiftName),
    /// Between the lifts.
    Mast,
}

/// What [`Truck::build`] gives: lifts and effects over any scalar.
pub type Parts<S, const L: usize> = ([Lift<S>; L], Vec<(Instance, usize, Vec<S>)>);

fn check(name: &str, value: f64, spec: &ParameterSpec) -> Result<f64, Error> {
    if value >= spec.lower && value <= spec.upper {
        return Ok(value);
    }
    Err(Error::OutOfBounds {
        name: name.to_string(),
        value,
        lower: spec.lower,
        upper: spec.upper,
        unit: spec.unit.to_string(),
        reason: spec.bounds_reason.to_string(),
    })
}

/// Takes values out of what was given, so that what remains is unknown.
struct Taker(BTreeMap<String, Value>);

impl Taker {
    fn number(&mut self, name: &str, spec: &ParameterSpec) -> Result<f64, Error> {
        match self.0.remove(name) {
            Some(Value::Number(value)) => check(name, value, spec),
            Some(Value::Table(_)) => Err(Error::argument(name, "a table", "a single number")),
            None => Err(missing(name, spec)),
        }
    }

    fn table(&mut self, name: &str, spec: &ParameterSpec) -> Result<Vec<f64>, Error> {
        let values = match self.0.remove(name) {
            Some(Value::Table(values)) => values,
            Some(Value::Number(value)) => return Err(Error::argument(name, value, "a table, one number per knot")),
            None => return Err(missing(name, spec)),
        };
        for (k, &value) in values.iter().enumerate() {
            check(&format!("{name}.{k}"), value, spec)?;
        }
        Ok(values)
    }

    fn lift(&mut self, lift: LiftName) -> Result<LiftValues, Error> {
        let full = |name: &str| format!("{}.{name}", lift.as_str());
        let scalars =
            LIFT_PARAMETERS.iter().map(|spec| self.number(&full(spec.name), spec)).collect::<Result<Vec<_>, _>>()?;
        let [current_spec, area_spec] = &TABLE_PARAMETERS;
        let (current_name, area_name) = (full(current_spec.name), full(area_spec.name));
        let current = self.table(&current_name, current_spec)?;
        let area = self.table(&area_name, area_spec)?;
        for (name, length, partner) in
            [(&current_name, current.len(), area.len()), (&area_name, area.len(), current.len())]
        {
            if !(2..=MOST_TABLE_KNOTS).contains(&length) || length < partner {
                return Err(Error::TableLength { name: name.clone(), length, most: MOST_TABLE_KNOTS });
            }
        }
        rises(&current_name, &current, current_spec.unit, true)?;
        rises(&area_name, &area, area_spec.unit, false)?;
        Ok(LiftValues { scalars, current, area })
    }
}

fn missing(name: &str, spec: &ParameterSpec) -> Error {
    Error::MissingParameter {
        name: name.to_string(),
        unit: spec.unit.to_string(),
        lower: spec.lower,
        upper: spec.upper,
    }
}

fn rises(name: &str, values: &[f64], unit: &str, strictly: bool) -> Result<(), Error> {
    for (k, pair) in values.windows(2).enumerate() {
        if !rising(pair, strictly) {
            return Err(Error::TableNotRising {
                name: name.to_string(),
                knot: k + 1,
                value: pair[1],
                previous: pair[0],
                unit: unit.to_string(),
            });
        }
    }
    Ok(())
}

/// Edits that turn one name into another (Levenshtein 1966).
fn distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.bytes().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.bytes().enumerate() {
            let substituted = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

impl Truck {
    /// Takes every parameter of both lifts, and the parameters of the effects the truck has.
    ///
    /// # Errors
    /// Unknown, missing or out-of-bounds parameters; tables of wrong length or order.
    pub fn from_values(values: BTreeMap<String, Value>) -> Result<Truck, Error> {
        let mut taker = Taker(values);
        let lifts = [taker.lift(LiftName::Free)?, taker.lift(LiftName::Main)?];
        if let Some(EndStops { lower, upper, lift }) = reversed_stroke(&lifts) {
            return Err(Error::argument(
                &format!("{}.cylinder.stroke_upper", lift.as_str()),
                upper,
                &format!("above {}.cylinder.stroke_lower, {lower} m", lift.as_str()),
            ));
        }
        let mut effects = Vec::new();
        for instance in Instance::all() {
            let name = instance.name();
            let prefix = format!("{name}.");
            if !taker.0.keys().any(|key| key.starts_with(&prefix)) {
                continue;
            }
            let spec = instance.kind.spec();
            let values = spec
                .parameters
                .iter()
                .map(|p| taker.number(&format!("{prefix}{}", p.name), p))
                .collect::<Result<Vec<_>, _>>()?;
            effects.push((instance, values));
        }
        let truck = Truck { lifts, effects };
        match taker.0.into_keys().next() {
            None => Ok(truck),
            Some(name) => Err(Error::UnknownParameter { nearest: truck.nearest(&name), name }),
        }
    }

    fn nearest(&self, name: &str) -> String {
        let effects = Instance::all().flat_map(|instance| {
            let prefix = instance.name();
            instance.kind.spec().parameters.iter().map(move |p| format!("{prefix}.{}", p.name)).collect::<Vec<_>>()
        });
        let tables = LiftName::BOTH
            .iter()
            .flat_map(|lift| TABLE_PARAMETERS.iter().map(move |p| format!("{}.{}", lift.as_str(), p.name)));
        self.names()
            .into_iter()
            .chain(tables)
            .chain(effects)
            .min_by_key(|known| distance(known, name))
            .unwrap_or_default()
    }

    /// Names of [`Truck::values`]; a table's knots carry their number, `free.valve.table_area.3`.
    pub fn names(&self) -> Vec<String> {
        let mut names = Vec::new();
        for (lift, values) in LiftName::BOTH.iter().zip(&self.lifts) {
            names.extend(LIFT_PARAMETERS.iter().map(|spec| format!("{}.{}", lift.as_str(), spec.name)));
            for (spec, table) in TABLE_PARAMETERS.iter().zip([&values.current, &values.area]) {
                names.extend((0..table.len()).map(|k| format!("{}.{}.{k}", lift.as_str(), spec.name)));
            }
        }
        for (instance, _) in &self.effects {
            let prefix = instance.name();
            names.extend(instance.kind.spec().parameters.iter().map(|p| format!("{prefix}.{}", p.name)));
        }
        names
    }

    /// All values in one row: free lift, main lift (scalars, currents, areas), effects.
    pub fn values(&self) -> Vec<f64> {
        let lifts = self.lifts.iter().flat_map(|lift| [&lift.scalars, &lift.current, &lift.area]);
        lifts.chain(self.effects.iter().map(|(_, values)| values)).flatten().copied().collect()
    }

    /// What values in the place of [`Truck::values`] have to keep to.
    pub fn limits(&self) -> Limits {
        let (mut bounds, mut tables, mut lifts) = (Vec::new(), Vec::new(), Vec::new());
        let of = |spec: &ParameterSpec| (spec.lower, spec.upper);
        for lift in &self.lifts {
            lifts.push(bounds.len());
            bounds.extend(LIFT_PARAMETERS.iter().map(of));
            for (spec, table, strictly) in
                [(&TABLE_PARAMETERS[0], &lift.current, true), (&TABLE_PARAMETERS[1], &lift.area, false)]
            {
                tables.push((bounds.len()..bounds.len() + table.len(), strictly));
                bounds.extend(std::iter::repeat_n(of(spec), table.len()));
            }
        }
        for (instance, _) in &self.effects {
            bounds.extend(instance.kind.spec().parameters.iter().map(of));
        }
        Limits { bounds, tables, lifts: [lifts[0], lifts[1]] }
    }

    /// To which lift each of [`Truck::values`] belongs.
    pub fn owners(&self) -> Vec<Owner> {
        let mut owners = Vec::new();
        for (&lift, values) in LiftName::BOTH.iter().zip(&self.lifts) {
            owners.extend(std::iter::repeat_n(Owner::Lift(lift), values.len()));
        }
        for (instance, values) in &self.effects {
            let owner = instance.lift.map_or(Owner::Mast, Owner::Lift);
            owners.extend(std::iter::repeat_n(owner, values.len()));
        }
        owners
    }

    /// The effects the truck has.
    pub fn effects(&self) -> impl Iterator<Item = Instance> + '_ {
        self.effects.iter().map(|(instance, _)| *instance)
    }

    /// Whether one lift alone is not the same as one of both.
    pub fn joined(&self) -> bool {
        self.effects.iter().any(|(instance, values)| instance.kind.joins(values))
    }

    /// An effect on a lift, or between both, that is there only with both lifts, where the truck has these in the
    /// place of [`Truck::values`].
    pub fn joined_beyond(&self, lift: LiftName, values: &[f64]) -> Option<Instance> {
        let mut at = self.lifts.iter().map(LiftValues::len).sum::<usize>();
        self.effects.iter().find_map(|(instance, own)| {
            let given = &values[at..at + own.len()];
            at += own.len();
            (instance.lift.is_none_or(|own| own == lift) && instance.kind.joins(given)).then_some(*instance)
        })
    }

    /// Lifts over any scalar, without effects; `value` as of [`Truck::build`].
    pub fn lifts<S: Scalar, const L: usize>(
        &self,
        which: [LiftName; L],
        load_kg: S,
        value: impl Fn(usize, f64) -> S,
    ) -> [Lift<S>; L] {
        which.map(|name| {
            let lift = &self.lifts[usize::from(name == LiftName::Main)];
            let mut index = if name == LiftName::Main { self.lifts[0].len() } else { 0 };
            let mut take = |values: &[f64]| -> Vec<S> {
                let taken = values.iter().enumerate().map(|(k, &v)| value(index + k, v)).collect();
                index += values.len();
                taken
            };
            let scalars = take(&lift.scalars);
            let (current, area) = (take(&lift.current), take(&lift.area));
            Lift::new(&LiftParameters::from_values(&scalars), &current, &area, load_kg)
        })
    }

    /// Lifts and effects over any scalar. `value` turns the k-th of [`Truck::values`] into a scalar:
    /// a constant, a dual variable, a different number in each lane.
    ///
    /// # Errors
    /// [`Error::EffectNeedsBothLifts`] if an effect joins the lifts but only one is asked for. An
    /// effect on a lift that is not asked for is left out with it.
    pub fn build<S: Scalar, const L: usize>(
        &self,
        which: [LiftName; L],
        load_kg: S,
        value: impl Fn(usize, f64) -> S,
    ) -> Result<Parts<S, L>, Error> {
        let mut index = self.lifts.iter().map(LiftValues::len).sum::<usize>();
        let mut effects = Vec::new();
        for (instance, values) in &self.effects {
            let place = match instance.lift {
                Some(lift) => which.iter().position(|&w| w == lift),
                None => Some(0),
            };
            if place.is_some() && which != LiftName::BOTH[..] && instance.kind.joins(values) {
                return Err(Error::EffectNeedsBothLifts { effect: instance.name() });
            }
            if let Some(place) = place {
                let taken = values.iter().enumerate().map(|(k, &v)| value(index + k, v)).collect();
                effects.push((*instance, place, taken));
            }
            index += values.len();
        }
        Ok((self.lifts(which, load_kg, value), effects))
    }
}

/// Bounds and orders of a truck's values, for values drawn anew.
#[derive(Debug, Clone)]
pub struct Limits {
    bounds: Vec<(f64, f64)>,
    /// Where a table's knots stand, and whether they must rise strictly.
    tables: Vec<(std::ops::Range<usize>, bool)>,
    /// Where each lift's scalars begin.
    lifts: [usize; 2],
}

impl Limits {
    /// Whether a truck may have these values.
    pub fn hold(&self, values: &[f64]) -> bool {
        let within = values.iter().zip(&self.bounds).all(|(value, (lower, upper))| value >= lower && value <= upper);
        let rise = self
            .tables
            .iter()
            .all(|(knots, strictly)| values[knots.clone()].windows(2).all(|pair| rising(pair, *strictly)));
        within
            && rise
            && LiftName::BOTH.iter().all(|&lift| {
                let p = self.parameters(lift, values);
                p.stroke_lower < p.stroke_upper
            })
    }

    /// How large the k-th value can be, to a power of two.
    pub fn size(&self, k: usize) -> f64 {
        let (lower, upper) = self.bounds[k];
        let (mantissa, exponent) = libm::frexp(lower.abs().max(upper.abs()));
        libm::ldexp(1.0, if mantissa < std::f64::consts::FRAC_1_SQRT_2 { exponent - 1 } else { exponent })
    }

    /// A lift's scalars among the values.
    pub fn parameters(&self, lift: LiftName, values: &[f64]) -> LiftParameters<f64> {
        LiftParameters::from_values(&values[self.lifts[usize::from(lift == LiftName::Main)]..])
    }
}

struct EndStops {
    lower: f64,
    upper: f64,
    lift: LiftName,
}

fn reversed_stroke(lifts: &[LiftValues; 2]) -> Option<EndStops> {
    LiftName::BOTH.into_iter().zip(lifts).find_map(|(lift, values)| {
        let p = LiftParameters::from_values(&values.scalars);
        (p.stroke_upper <= p.stroke_lower).then_some(EndStops { lower: p.stroke_lower, upper: p.stroke_upper, lift })
    })
}

impl Scope {
    pub fn as_str(self) -> &'static str {
        match self {
            Scope::Lift => "lift",
            Scope::Mast => "mast",
        }
    }
}
