//! Work on all cores that Ctrl-C ends: Python tells only the thread that it began on of signals.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{channel, RecvTimeoutError};
use std::thread::scope;
use std::time::Duration;

use pyo3::prelude::*;

/// How often signals are looked at; what is done sooner is not waited for.
const LOOK: Duration = Duration::from_millis(50);

/// What `work` gives, without the interpreter's lock; it is told whether it has been asked to stop.
pub fn watched<T: Send>(py: Python<'_>, work: impl FnOnce(&(dyn Fn() -> bool + Sync)) -> T + Send) -> T {
    py.detach(|| {
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
                if Python::attach(|py| py.check_signals().is_err()) {
                    stop.store(true, Ordering::Relaxed);
                }
            }
            worker.join().unwrap_or_else(|panic| resume_unwind(panic))
        })
    })
}
