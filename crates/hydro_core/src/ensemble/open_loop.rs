//! No controller: what is asked for goes to both valves as a current.

use crate::run::closed_loop::{Controller, Reading};

/// Takes the request for a current [mA].
pub struct OpenLoop;

impl Controller for OpenLoop {
    fn tick(&mut self, request: i32, _reading: &Reading) -> [i32; 2] {
        [request, request]
    }

    fn reference(&self) -> [i32; 2] {
        [0, 0]
    }
}
