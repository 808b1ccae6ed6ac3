//! What an ensemble's lowerings have in common, and whether that can be meant.

use super::measures::{Settling, MEASURES};
use super::member::Makeup;
use super::requirement::{Requirement, Signal, Template};
use crate::error::{refuse, Error};
use crate::lanes::Precision;
use crate::run::Lifts;

/// What every member goes through, and what is asked of it.
#[derive(Debug, Clone)]
pub struct Trial {
    pub makeup: Makeup,
    pub requirements: Vec<Requirement>,
    pub settling: Settling,
    pub tick_s: f64,
    pub ticks: usize,
    pub substeps: usize,
    /// Of the trucks; the controllers' integers are the same.
    pub precision: Precision,
    /// Whether a controller follows what is asked for; else that is a current.
    pub followed: bool,
}

/// How many ticks a duration [s] has.
///
/// # Errors
/// One that is not positive and finite, or longer than an hour.
pub fn whole_ticks(duration_s: f64, tick_s: f64) -> Result<usize, Error> {
    if duration_s >= tick_s && duration_s <= 3600.0 {
        return Ok((duration_s / tick_s).round() as usize);
    }
    refuse("duration_s", duration_s, &format!("between {tick_s} and 3600 s"))
}

impl Trial {
    fn lifts(&self) -> usize {
        match self.makeup.lifts {
            Lifts::Both => 2,
            Lifts::One(_) => 1,
        }
    }

    /// How many numbers an outcome has.
    pub fn numbers(&self) -> usize {
        self.requirements.len() + self.lifts() * MEASURES.len()
    }

    /// # Errors
    /// A run without ticks or substeps, a requirement on a lift that does not run or on too long a window.
    pub fn check(&self) -> Result<(), Error> {
        if !(1..=1_000_000).contains(&self.ticks) {
            return refuse("ticks", self.ticks, "between 1 and 1000000");
        }
        if !(1..=1000).contains(&self.substeps) {
            return refuse("substeps", self.substeps, "between 1 and 1000");
        }
        if !(self.tick_s > 0.0 && self.tick_s <= 1.0) {
            return refuse("tick_s", self.tick_s, "above 0 and up to 1 s");
        }
        let Settling { after_s, band_m_s } = self.settling;
        if !(0.0..=3600.0).contains(&after_s) {
            return refuse("settle_s", after_s, "between 0 and 3600 s");
        }
        if !(band_m_s >= 0.0 && band_m_s.is_finite()) {
            return refuse("band_m_s", band_m_s, "0 m/s or more");
        }
        self.requirements.iter().try_for_each(|requirement| self.check_of(requirement))
    }

    /// # Errors
    /// A requirement on a lift that does not run, on a stretch that the run does not have or on too long a window; one
    /// on the speed asked for, where a current is.
    pub fn check_of(&self, requirement: &Requirement) -> Result<(), Error> {
        let end_s = (self.ticks.max(1) - 1) as f64 * self.tick_s;
        if let Some((from_s, to_s)) = requirement.template.stretch() {
            if !(from_s <= end_s && to_s >= 0.0 && from_s <= to_s) {
                let stretch = format!("a stretch of the run, which lasts from 0 to {end_s} s");
                return refuse("from_s, to_s", format!("{from_s} to {to_s}"), &stretch);
            }
        }
        if requirement.lift >= self.lifts() {
            return refuse("lift", requirement.lift, "a lift that is simulated");
        }
        if let Some(window) = requirement.peak_to_peak_s.filter(|w| !(*w >= self.tick_s && *w <= 60.0)) {
            return refuse("peak_to_peak_s", window, "at least a tick and at most 60 s");
        }
        let asks_for_speed =
            requirement.signal == Signal::Error || matches!(requirement.template, Template::Responds { .. });
        if asks_for_speed && !self.followed {
            return refuse("signal", "the speed asked for", "another: without a controller a current is asked for");
        }
        Ok(())
    }
}
