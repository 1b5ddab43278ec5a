//! Wall time of the phases of a step. No result depends on it.

/// Seconds since some moment, from the host's clock. The core has no clock of its own.
pub type Clock = fn() -> f64;

/// Timings: wall time of each phase since timing was switched on, over all steps \[s\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Phases {
    /// Reading the user's changes, and detection of contacts and joint rows.
    pub detection: f64,
    /// Free velocities, the rule of every contact, islands and their contact problems.
    pub assembly: f64,
    /// Impulses: solvers, energy bounds, located impacts.
    pub solve: f64,
    /// Energies, the record, the caches.
    pub record: f64,
    /// Writing velocities and poses to the model.
    pub write: f64,
}

impl Phases {
    /// Name and time \[s\] of each phase, in the order of a step.
    pub fn named(&self) -> [(&'static str, f64); 5] {
        [
            ("detection", self.detection),
            ("assembly", self.assembly),
            ("solve", self.solve),
            ("record", self.record),
            ("write", self.write),
        ]
    }
}

/// Measures the time of phases, if switched on.
#[derive(Default)]
pub(crate) struct PhaseClock {
    clock: Option<Clock>,
    last: Option<f64>,
    pub phases: Phases,
}

impl PhaseClock {
    /// Resets and starts the timing, or stops it.
    pub fn switch(&mut self, clock: Option<Clock>) {
        *self = PhaseClock {
            clock,
            ..PhaseClock::default()
        };
    }

    /// Starts the time of the next phase.
    pub fn start(&mut self) {
        self.last = self.clock.map(|now| now());
    }

    /// Adds the time since the last call to a phase.
    pub fn lap(&mut self, phase: impl FnOnce(&mut Phases) -> &mut f64) {
        if let Some(elapsed) = self.elapsed() {
            *phase(&mut self.phases) += elapsed;
        }
    }

    /// Time since the last call \[s\]; `None` if timing is off.
    fn elapsed(&mut self) -> Option<f64> {
        let now = self.clock?();
        let before = self.last.replace(now)?;
        Some(now - before)
    }
}

impl PhaseClock {
    /// A clock for another thread, switched on if this one is.
    pub fn another(&self) -> PhaseClock {
        let mut clock = PhaseClock::default();
        clock.switch(self.clock);
        clock
    }

    /// Adds the time since the last call to assembly and solve, in proportion to the times that
    /// `threads` measured.
    pub fn lap_in_proportion<'a>(&mut self, threads: impl Iterator<Item = &'a PhaseClock>) {
        let times = threads.fold([0.0, 0.0], |[a, s], clock| {
            [a + clock.phases.assembly, s + clock.phases.solve]
        });
        let whole = times[0] + times[1];
        if let Some(elapsed) = self.elapsed()
            && whole > 0.0
        {
            self.phases.assembly += elapsed * times[0] / whole;
            self.phases.solve += elapsed * times[1] / whole;
        }
    }
}
