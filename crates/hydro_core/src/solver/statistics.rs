//! How much work a run took: counts, not seconds.

/// Counts of a run. Tests pin them; benches turn them into time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: usize,
    /// Steps given up because their error was too large.
    pub rejected_by_error: usize,
    /// Steps given up because Newton's iteration did not converge.
    pub rejected_by_newton: usize,
    /// Newton iterations over all steps.
    pub newton_iterations: usize,
    /// Evaluations of the right-hand side.
    pub rates: usize,
    /// Jacobians from dual numbers.
    pub jacobians: usize,
    /// Pairs of one real and one complex factorisation.
    pub factorisations: usize,
    /// Jumps of an input at which the integrator stopped.
    pub stops: usize,
    /// Ends of a stroke that were reached or left.
    pub events: usize,
}

impl Statistics {
    /// Each count with its name.
    pub fn rows(&self) -> [(&'static str, usize); 9] {
        [
            ("steps", self.steps),
            ("rejected_by_error", self.rejected_by_error),
            ("rejected_by_newton", self.rejected_by_newton),
            ("newton_iterations", self.newton_iterations),
            ("rates", self.rates),
            ("jacobians", self.jacobians),
            ("factorisations", self.factorisations),
            ("stops", self.stops),
            ("events", self.events),
        ]
    }
}
