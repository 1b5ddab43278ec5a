//! The rows of the CSV files, and how records become rows.

use super::row;
use crate::dynamics::record::{ContactRecord, ImpactRecord, StepRecord};
use std::borrow::Cow;

row! {
    /// Position and velocity of one body at one time.
    BodyRow in "bodies.csv" {
        time_s: f64,
        /// The model's number of the body, as in `contacts.csv`.
        body: u32,
        x_m: f64,
        y_m: f64,
        angle_rad: f64,
        vx_m_s: f64,
        vy_m_s: f64,
        omega_rad_s: f64,
    }
}

row! {
    /// A grain of a machine, at the first written step that has it under this number. As grains leave, numbers
    /// pass to others.
    GrainRow in "grains.csv" {
        time_s: f64,
        body: u32,
        radius_m: f64,
    }
}

row! {
    /// One contact in one step: see [`ContactRecord`].
    ContactRow in "contacts.csv" {
        time_s: f64,
        body_1: u32,
        body_2: u32,
        /// The larger of the two cells: on the surface of several pieces, if only one is.
        cell: u32,
        x_m: f64,
        y_m: f64,
        nx: f64,
        ny: f64,
        gap_m: f64,
        impulse_n_ns: f64,
        impulse_t_ns: f64,
        slip_m: f64,
        load_slip_nm: f64,
        friction_work_j: f64,
        status: Cow<'static, str>,
    }
}

row! {
    /// One impact: see [`ImpactRecord`].
    ImpactRow in "impacts.csv" {
        time_s: f64,
        body_1: u32,
        body_2: u32,
        x_m: f64,
        y_m: f64,
        nx: f64,
        ny: f64,
        approach_speed_m_s: f64,
        impulse_n_ns: f64,
        impulse_t_ns: f64,
        energy_lost_j: f64,
    }
}

row! {
    /// One step: see [`StepRecord`]. What is not known, of the step of a peer, is empty. With one row for
    /// several steps, counts of work, unsolved islands and events, `impact_gain_j` and `work_..._j` are sums
    /// over all steps since the row before, residuals, `imbalance_j` and `penetration_impact_m` the largest of
    /// them. The rest is of the step itself.
    StepRow in "steps.csv" {
        time_s: f64,
        dt_s: f64,
        contacts: usize,
        islands: Option<usize>,
        resting: Option<usize>,
        sweeps: Option<usize>,
        factorisations: Option<usize>,
        pivots: Option<usize>,
        residual: Option<f64>,
        residual_velocity_m_s: Option<f64>,
        unsolved: Option<usize>,
        failed: Option<usize>,
        redundant: Option<usize>,
        capped: Option<usize>,
        relaxed: Option<usize>,
        joints_capped: Option<usize>,
        events: Option<usize>,
        recovering: Option<usize>,
        impact_gain_j: Option<f64>,
        kinetic_j: f64,
        potential_j: f64,
        work_forces_j: Option<f64>,
        work_contact_n_j: Option<f64>,
        work_contact_t_j: Option<f64>,
        work_joints_j: Option<f64>,
        work_motors_j: Option<f64>,
        work_returned_j: Option<f64>,
        work_recovery_j: Option<f64>,
        imbalance_j: Option<f64>,
        penetration_m: f64,
        penetration_impact_m: Option<f64>,
        joint_gap_m: Option<f64>,
    }
}

row! {
    /// A scene stepped with one reduction and without it, both with all others.
    ModelRow in "models.csv" {
        reduction: String,
        key: String,
        scene: String,
        steps: usize,
        /// Unknown impulses of all problems that were solved.
        unknowns_full: usize,
        unknowns: usize,
        /// Sweeps, factorisations and pivots.
        work_full: usize,
        work: usize,
        /// Wall time of the steps, each the least of its repeats \[s\].
        time_full_s: f64,
        time_s: f64,
        /// Time with the reduction over that of the full model.
        time_ratio: f64,
        /// Largest distance of a body's places \[m\], and of its directions \[rad\], after a step of each from
        /// the same state.
        difference: f64,
        /// Steps with a difference above 1e-9, and those of them in which both models are certified.
        steps_apart: usize,
        steps_apart_certified: usize,
        /// Those of them in which the impulses of the reduced model solve the full one's problems.
        steps_another_solution: usize,
        /// `equal`, `another solution`, `apart` or `unsolved`, and `slower`.
        verdict: String,
    }
}

row! {
    /// A setting that `--accuracy` chose for a scene, and the best fixed setting found by search.
    AccuracyRow in "accuracy.csv" {
        scene: String,
        /// What was asked.
        accuracy: f64,
        scheme: String,
        events: bool,
        /// Step length \[s\].
        dt_s: f64,
        tolerance: f64,
        /// How often the setting was made finer because a run was not held.
        tightened: usize,
        /// Error that the program states.
        bound: f64,
        /// Error against the closed form, and its measure.
        error: f64,
        measure: String,
        /// Steps, events, sweeps, factorisations and pivots: of the run, and of all trials.
        work: usize,
        choice_work: usize,
        best_scheme: String,
        best_events: bool,
        best_dt_s: f64,
        best_work: usize,
        /// Least work of any setting of the search that holds, be it by luck.
        lucky_work: usize,
        /// Work of the run over that of the best fixed setting; NaN if the search found none.
        ratio: f64,
    }
}

row! {
    /// A step of a solver's performance profile: see [`super::Performance`].
    PerformanceRow in "performance-profile.csv" {
        solver: String,
        /// τ, time over that of the fastest solver of the same problem.
        ratio: f64,
        /// Of all problems, those solved within the ratio.
        share: f64,
    }
}

row! {
    /// One measure of one run: the table that compare, chart, bench and atlas are views of.
    ResultRow in "results.csv" {
        scene: String,
        rung: String,
        engine: String,
        scheme: String,
        solver: String,
        setting: String,
        dt_s: f64,
        threads: usize,
        precision: String,
        measure: String,
        /// NaN where the run failed.
        value: f64,
        unit: String,
        reference: String,
        /// Empty where nothing was timed.
        seconds_per_simulated_second: Option<f64>,
        spread: Option<f64>,
        verdict: String,
        mode: String,
    }
}

row! {
    /// How a point of `results.csv` is run again by itself.
    PointRow in "points.csv" {
        scene: String,
        rung: String,
        engine: String,
        scheme: String,
        solver: String,
        setting: String,
        dt_s: f64,
        command: String,
    }
}

row! {
    /// One measure of a scene, and how many points of the peers ours dominate: see
    /// [`super::Domination`].
    DominationRow in "domination.csv" {
        scene: String,
        rung: String,
        measure: String,
        unit: String,
        /// Points measured, and those that failed; of ours the unsolved ones with them.
        ours: usize,
        ours_failed: usize,
        peers: usize,
        peers_failed: usize,
        dominated: usize,
        /// With no allowance for the spread of times.
        dominated_strictly: usize,
    }
}

row! {
    /// A point of a peer that no point of ours dominates, and the nearest of ours.
    UndominatedRow in "undominated.csv" {
        scene: String,
        rung: String,
        measure: String,
        unit: String,
        engine: String,
        setting: String,
        dt_s: f64,
        value: f64,
        seconds_per_simulated_second: f64,
        spread: Option<f64>,
        our_scheme: String,
        our_solver: String,
        our_setting: String,
        our_dt_s: Option<f64>,
        our_value: Option<f64>,
        our_seconds_per_simulated_second: Option<f64>,
        /// `accuracy`, `step`, `time` or `none`, see [`super::Cause`].
        cause: String,
        /// Of values where the cause is `accuracy`, else of times: ours over theirs.
        ratio: Option<f64>,
    }
}

impl ContactRow {
    /// The row of `contact` in the step that ends at `time` in s.
    pub fn new(contact: &ContactRecord) -> Self {
        ContactRow {
            time_s: contact.time,
            body_1: contact.bodies[0],
            body_2: contact.bodies[1],
            cell: contact.places[0].edge.max(contact.places[1].edge),
            x_m: contact.position.x,
            y_m: contact.position.y,
            nx: contact.normal.x,
            ny: contact.normal.y,
            gap_m: contact.gap,
            impulse_n_ns: contact.impulse_n,
            impulse_t_ns: contact.impulse_t,
            slip_m: contact.slip,
            load_slip_nm: contact.load_slip,
            friction_work_j: contact.friction_work,
            status: Cow::Borrowed(contact.status.word()),
        }
    }
}

impl From<&ImpactRecord> for ImpactRow {
    fn from(impact: &ImpactRecord) -> Self {
        ImpactRow {
            time_s: impact.time,
            body_1: impact.bodies[0],
            body_2: impact.bodies[1],
            x_m: impact.position.x,
            y_m: impact.position.y,
            nx: impact.normal.x,
            ny: impact.normal.y,
            approach_speed_m_s: impact.approach_speed,
            impulse_n_ns: impact.impulse_n,
            impulse_t_ns: impact.impulse_t,
            energy_lost_j: impact.energy_lost,
        }
    }
}

impl StepRow {
    /// A row of one step.
    pub fn of(step: &StepRecord) -> Self {
        let known = step.accounted;
        let [
            forces,
            contact_n,
            contact_t,
            joints,
            motors,
            returned,
            recovery,
        ] = step.energy.work().map(|work| known.then_some(work));
        StepRow {
            time_s: step.time,
            dt_s: step.dt,
            contacts: step.contacts_at_end(),
            islands: known.then_some(step.islands),
            resting: known.then_some(step.resting),
            sweeps: known.then_some(step.sweeps),
            factorisations: known.then_some(step.factorisations),
            pivots: known.then_some(step.pivots),
            residual: known.then_some(step.residual),
            residual_velocity_m_s: known.then_some(step.residual_velocity),
            unsolved: known.then_some(step.unsolved),
            failed: known.then_some(step.failed),
            redundant: known.then_some(step.redundant),
            capped: known.then_some(step.capped),
            relaxed: known.then_some(step.relaxed),
            joints_capped: known.then_some(step.joints_capped),
            events: known.then_some(step.events),
            recovering: known.then_some(step.recovering),
            impact_gain_j: known.then_some(step.impact_gain),
            kinetic_j: step.energy.kinetic_end,
            potential_j: step.energy.potential_end,
            work_forces_j: forces,
            work_contact_n_j: contact_n,
            work_contact_t_j: contact_t,
            work_joints_j: joints,
            work_motors_j: motors,
            work_returned_j: returned,
            work_recovery_j: recovery,
            imbalance_j: known.then_some(step.energy.imbalance()),
            penetration_m: step.penetration,
            penetration_impact_m: known.then_some(step.penetration_impact),
            joint_gap_m: known.then_some(step.joint_gap),
        }
    }

    /// Adds what the steps before did, whose row is not written: see [`StepRow`].
    pub fn include(&mut self, before: &StepRow) {
        let counts: [(&mut Option<usize>, Option<usize>); 9] = [
            (&mut self.sweeps, before.sweeps),
            (&mut self.factorisations, before.factorisations),
            (&mut self.pivots, before.pivots),
            (&mut self.unsolved, before.unsolved),
            (&mut self.failed, before.failed),
            (&mut self.capped, before.capped),
            (&mut self.relaxed, before.relaxed),
            (&mut self.joints_capped, before.joints_capped),
            (&mut self.events, before.events),
        ];
        for (own, before) in counts {
            *own = own.zip(before).map(|(a, b)| a + b);
        }
        let sums: [(&mut Option<f64>, Option<f64>); 8] = [
            (&mut self.impact_gain_j, before.impact_gain_j),
            (&mut self.work_forces_j, before.work_forces_j),
            (&mut self.work_contact_n_j, before.work_contact_n_j),
            (&mut self.work_contact_t_j, before.work_contact_t_j),
            (&mut self.work_joints_j, before.work_joints_j),
            (&mut self.work_motors_j, before.work_motors_j),
            (&mut self.work_returned_j, before.work_returned_j),
            (&mut self.work_recovery_j, before.work_recovery_j),
        ];
        for (own, before) in sums {
            *own = own.zip(before).map(|(a, b)| a + b);
        }
        let worst: [(&mut Option<f64>, Option<f64>); 4] = [
            (&mut self.residual, before.residual),
            (
                &mut self.residual_velocity_m_s,
                before.residual_velocity_m_s,
            ),
            (&mut self.imbalance_j, before.imbalance_j),
            (&mut self.penetration_impact_m, before.penetration_impact_m),
        ];
        for (own, before) in worst {
            // NaN stays: nothing is known then
            let larger = |a: f64, b: f64| {
                if a.is_nan() || a.abs() >= b.abs() {
                    a
                } else {
                    b
                }
            };
            *own = own.zip(before).map(|(a, b)| larger(a, b));
        }
    }
}
