//! Work that Ctrl-C ends, and any other signal whose handler raises: Python tells only the thread that it began on.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{channel, RecvTimeoutError};
use std::sync::{Mutex, PoisonError};
use std::thread::scope;
use std::time::Duration;

use hydro_core::error::Error;
use pyo3::prelude::*;

use crate::errors::raise;

/// How often signals are looked at; what is done sooner is not waited for.
const LOOK: Duration = Duration::from_millis(50);

/// What a signal's handler raised, if it did.
#[derive(Default)]
pub struct Signal(Mutex<Option<PyErr>>);

impl Signal {
    /// Whether a handler has raised by now; to be asked on the thread that Python began on.
    pub fn raised(&self) -> bool {
        match Python::attach(|py| py.check_signals()) {
            Ok(()) => false,
            Err(error) => {
                *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                true
            }
        }
    }

    /// What the work gave, or what the handler raised, or the error that ended it.
    pub fn or<T>(self, py: Python<'_>, found: Result<T, Error>) -> PyResult<T> {
        match self.0.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => found.map_err(|error| raise(py, &error)),
        }
    }
}

/// What `work` gives, on a thread of its own and without the interpreter's lock; it is told whether it has been asked
/// to stop.
pub fn watched<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&(dyn Fn() -> bool + Sync)) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let signal = Signal::default();
    let found = py.detach(|| {
        let stop = AtomicBool::new(false);
        let stopped = || stop.load(Ordering::Relaxed);
        scope(|threads| {
            let (done, waiting) = channel::<()>();
            let asked = &stopped;
            let worker = threads.spawn(move || {
                let _done = done; // also if it panics
                work(asked)
            });
            while waiting.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                if !stopped() && signal.raised() {
                    stop.store(true, Ordering::Relaxed);
                }
            }
            worker.join().unwrap_or_else(|panic| resume_unwind(panic))
        })
    });
    signal.or(py, found)
}
