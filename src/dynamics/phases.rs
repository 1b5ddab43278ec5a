//! What a step's wall time goes into. Nothing that is computed depends on it.

/// Seconds since some moment, by the host's clock: the core has none of its own.
pub type Clock = fn() -> f64;

/// Wall time of all steps since it was asked for, by what they did \[s\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Phases {
    /// What the user changed is read, and contacts and joint rows are found.
    pub detection: f64,
    /// Free velocities, the rule of every contact, islands and their contact problems.
    pub assembly: f64,
    /// Impulses: solvers, caps, located impacts.
    pub solve: f64,
    /// Energies, the record, what is remembered.
    pub record: f64,
    /// Velocities and poses are given back to the model.
    pub write: f64,
}

impl Phases {
    /// Name and time \[s\] of each, in the order of a step.
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

/// Books time on phases, where it is switched on.
#[derive(Default)]
pub(crate) struct PhaseClock {
    clock: Option<Clock>,
    last: Option<f64>,
    pub phases: Phases,
}

impl PhaseClock {
    /// Starts from nothing, or stops.
    pub fn switch(&mut self, clock: Option<Clock>) {
        *self = PhaseClock {
            clock,
            ..PhaseClock::default()
        };
    }

    /// What follows is to be booked.
    pub fn start(&mut self) {
        self.last = self.clock.map(|now| now());
    }

    /// Books the time since the last call on a phase.
    pub fn lap(&mut self, phase: impl FnOnce(&mut Phases) -> &mut f64) {
        if let Some(elapsed) = self.elapsed() {
            *phase(&mut self.phases) += elapsed;
        }
    }

    /// Time since the last call \[s\], where there was one.
    fn elapsed(&mut self) -> Option<f64> {
        let now = self.clock?();
        let before = self.last.replace(now)?;
        Some(now - before)
    }
}

#[cfg(feature = "parallel")]
impl PhaseClock {
    /// A clock for another thread, which runs where this one does.
    pub fn another(&self) -> PhaseClock {
        let mut clock = PhaseClock::default();
        clock.switch(self.clock);
        clock
    }

    /// Books the time since the last call on assembly and solve, in the shares in which `threads`
    /// have booked theirs.
    pub fn lap_as<'a>(&mut self, threads: impl Iterator<Item = &'a PhaseClock>) {
        let spent = threads.fold([0.0, 0.0], |[a, s], clock| {
            [a + clock.phases.assembly, s + clock.phases.solve]
        });
        let whole = spent[0] + spent[1];
        if let Some(elapsed) = self.elapsed()
            && whole > 0.0
        {
            self.phases.assembly += elapsed * spent[0] / whole;
            self.phases.solve += elapsed * spent[1] / whole;
        }
    }
}
