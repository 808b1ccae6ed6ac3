//! The fixed-point controllers of an ensemble: one configuration for all, or one for each where its numbers vary.

use std::sync::Arc;

use crate::control::config::Config;
use crate::control::controller::FixedPoint;
use crate::control::fixed::Word;
use crate::control::settings::{LiftSettings, SettingSpec, Settings, SharedSettings, LIFT_SETTINGS, SHARED_SETTINGS};
use crate::error::Error;
use crate::run::closed_loop::Controller;

/// A controller whose numbers may vary from member to member.
#[derive(Debug, Clone)]
pub struct Fleet {
    settings: Settings,
    word: Word,
    numbers: Vec<f64>,
    config: Arc<Config>,
}

/// The names of [`Fleet::numbers`]: `shared.ramp_up`, `free.proportional`, `main.delay`.
pub fn names() -> Vec<String> {
    let shared = SHARED_SETTINGS.iter().map(|spec| format!("shared.{}", spec.name));
    let lifts = ["free", "main"]
        .into_iter()
        .flat_map(|lift| LIFT_SETTINGS.iter().map(move |spec| format!("{lift}.{}", spec.name)));
    shared.chain(lifts).collect()
}

/// Whether a controller may have these numbers; of other controllers than a [`Fleet`]'s nothing is known.
pub fn within_bounds(numbers: &[f64]) -> bool {
    let specs = || SHARED_SETTINGS.iter().chain(LIFT_SETTINGS).chain(LIFT_SETTINGS);
    let fit = |(value, spec): (&f64, &SettingSpec)| *value >= spec.lower && *value <= spec.upper;
    numbers.len() != specs().count() || numbers.iter().zip(specs()).all(fit)
}

impl Fleet {
    /// `shared`, `free` and `main` are the numbers that `settings` has, in the order of their tables.
    ///
    /// # Errors
    /// Settings that the word cannot hold.
    pub fn new(settings: Settings, shared: &[f64], lifts: [&[f64]; 2], word: Word) -> Result<Self, Error> {
        let numbers = [shared, lifts[0], lifts[1]].concat();
        let config = Arc::new(settings.config(word)?);
        Ok(Fleet { settings, word, numbers, config })
    }

    /// Where none varies.
    pub fn numbers(&self) -> &[f64] {
        &self.numbers
    }

    /// The controller of a member with these numbers.
    ///
    /// # Errors
    /// Numbers that are out of bounds, or that the word cannot hold.
    pub fn controller(&self, numbers: &[f64]) -> Result<Box<dyn Controller>, Error> {
        let config = if numbers == self.numbers {
            self.config.clone()
        } else {
            let (shared, lifts) = numbers.split_at(SHARED_SETTINGS.len());
            let (free, main) = lifts.split_at(LIFT_SETTINGS.len());
            let mut settings = self.settings.clone();
            settings.shared = SharedSettings::from_values("shared", shared)?;
            settings.lifts[0].numbers = LiftSettings::from_values("free", free)?;
            settings.lifts[1].numbers = LiftSettings::from_values("main", main)?;
            Arc::new(settings.config(self.word)?)
        };
        Ok(Box::new(FixedPoint::new(config)))
    }
}
