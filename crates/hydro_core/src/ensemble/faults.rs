//! Sensors that read wrong, between the truck and its controller.

use crate::run::closed_loop::{Controller, Reading};

/// A controller whose sensors are off.
pub struct Misread {
    pub inner: Box<dyn Controller>,
    /// Counts that the encoders give for each true one.
    pub encoder_factor: f64,
    /// Added to the pressures [steps].
    pub pressure_offset: i32,
    /// Added to the temperature [steps].
    pub temperature_offset: i32,
}

impl Controller for Misread {
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2] {
        let read = Reading {
            position: reading.position.map(|counts| (f64::from(counts) * self.encoder_factor).floor() as i32),
            pressure: reading.pressure.map(|steps| steps.saturating_add(self.pressure_offset)),
            temperature: reading.temperature.saturating_add(self.temperature_offset),
        };
        self.inner.tick(request, &read)
    }

    fn reference(&self) -> [i32; 2] {
        self.inner.reference()
    }
}
