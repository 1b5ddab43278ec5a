//! What a threshing machine models, and how well its step resolves it, measured on its first load cycle.

use super::cycle::{first_cycle, first_cycle_steps};
use super::machine::{Machine, Setup};
use super::parameters::Thresher;
use crate::experiment::{Explanation, LeftOut, RunError, TimeScale, Trial};
use crate::report::Progress;
use crate::scene::{Motion, Scene};

/// Why no accuracy is stated: with half and a quarter of the catalogue's step the wear of one revolution does
/// not converge.
const SCATTER: &str = "the wear of single revolutions differs by more than the step changes it";

/// Why one profile stands for all bars; the figures are those of the catalogue's machine, which a test has.
const EQUAL_BARS: &str = "all bars are simulated and share their mean wear: over 64 revolutions no bar of `thresher` \
                          is worn by 1.5 % more or less; over four, up to 35 %, as bars meet the segments of the \
                          crop in phases that come round slowly";

/// Explains a machine by the start of its run: the machine is filled in two revolutions, and one is
/// measured, with the stiffness of the file.
///
/// # Errors
/// [`RunError`] if the machine cannot be built or a step fails.
pub fn explain_threshing(scene: &Scene, setup: &Setup<Thresher>) -> Result<Explanation, RunError> {
    let p = &setup.parameters;
    let (mut trial, mut crop) = (Trial::default(), 0);
    let hidden = Progress::new("", 0, true);
    let cycle = first_cycle(scene, setup, &hidden, &mut |record, world| {
        trial.add(record);
        trial.most_contacts = trial.most_contacts.max(record.contacts.len());
        crop = crop.max(world.crop_bodies());
        Ok(())
    })?;
    let totals = &cycle.totals;
    let steps = first_cycle_steps(p, scene.step.dt);
    // grains are free; of the strip the feeder moves the newest segment, and each of the others ends in a
    // slot of the one behind it
    let (free, each, slots) = match p.grains {
        Some(_) => (crop, 3, 0),
        None => (crop.saturating_sub(1), 2, crop.saturating_sub(1)),
    };
    let machine = Machine::Thresher(setup.clone());
    let dt = scene.step.dt;
    let mut motions = machine.motions();
    motions.extend(p.grains.as_ref().map(|grains| Motion {
        what: "the tip of a tooth past the radius of a grain".to_owned(),
        period: grains.radius / (p.speed * p.tip_radius),
    }));
    Ok(Explanation {
        scene: scene.name.clone(),
        model: scene.model().word(),
        degrees_of_freedom: 1 + each * free,
        dynamic_bodies: 1 + free,
        fixed_bodies: 1,
        kinematic_bodies: 1,
        joints: 1 + slots,
        joint_rows: 2 + slots,
        coordinates_taken: 2 + slots,
        scheme: scene.step.scheme.name(),
        solver: scene.step.solver.clone(),
        trial: Trial {
            steps,
            time_s: totals.time,
            sweeps: totals.sweeps,
            factorisations: totals.factorisations,
            unsolved_islands: totals.unsolved_islands,
            ..trial
        },
        left_out: left_out(setup),
        time_scales: (motions.into_iter())
            .map(|motion| TimeScale {
                what: motion.what,
                period_s: motion.period,
                steps: motion.period / dt,
            })
            .collect(),
        accuracy: Vec::new(),
        accuracy_unknown: Some(SCATTER),
        steps_for: Vec::new(),
        to_choose: match p.grains {
            Some(_) => "runs with other seeds of thresher.grains and a shorter step.dt tell the error of grains; \
                        --accuracy does not apply to a machine"
                .to_owned(),
            None => format!(
                "`moreau2d chart {}` compares the wear of a cycle over step lengths; --accuracy does not apply to \
                 a machine, whose `run` states the error of its hours",
                scene.name
            ),
        },
        warnings: machine.step_warnings(dt),
    })
}

fn left_out(setup: &Setup<Thresher>) -> Vec<LeftOut> {
    let (p, wear) = (&setup.parameters, &setup.wear);
    let left = |what: String, why, key| LeftOut { what, why, key };
    let mut all = vec![left(
        format!("the machine's width of {} m", p.machine_width),
        "a slice one metre deep: torque, inertia and feed are divided by it",
        Some("thresher.machine_width"),
    )];
    let driven = match p.grains {
        Some(_) => "velocities of the concave",
        None => "velocities of the concave and of the feeder's segment",
    };
    all.push(left(
        driven.to_owned(),
        "their motion is given: they have no unknowns",
        None,
    ));
    if p.grains.is_some() && wear.limits.is_empty() {
        return all; // no tooth wears
    }
    all.extend([
        left(
            format!("{} of {} shapes of a worn tooth", p.bars - 1, p.bars),
            match p.grains {
                Some(_) => "all bars are simulated and share their mean wear",
                None => EQUAL_BARS,
            },
            None,
        ),
        left(
            format!(
                "the revolutions between the {} that are measured before each jump",
                wear.revolutions
            ),
            "their wear is that of the measured ones; the run states the error of the jumps",
            Some("wear.jump, wear.revolutions"),
        ),
    ]);
    all
}
