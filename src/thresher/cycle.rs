//! The machine of the thresher, and what a cycle of it wears.

use super::bar_load::BarLoad;
use super::blocks::{Tooth, Wear};
use super::flow::Flow;
use super::life::Observer;
use super::machine::Setup;
use super::operation::{self, HeldTorque, Operation};
use super::parameters::Thresher;
use super::power::PowerBudget;
use super::shapes::{SPAWN, arc_length};
use super::spin::SpinBudget;
use super::wear_chart::WornCycle;
use super::world::ThreshingWorld;
use crate::checkpoint::{CheckpointError, Reader, Writer};
use crate::dynamics::record::StepRecord;
use crate::experiment::{RunError, Totals};
use crate::report::Progress;
use crate::scene::Scene;
use crate::wear::{Archard, LoadSlip, Profile, WearError, WearState};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Revolutions that fill the machine before anything is measured.
const FILLING: f64 = 2.0;
/// Grains start with an empty machine, and fill it for this many times what one takes through it at the
/// entry speed.
const PASSAGES: f64 = 1.5;
/// Revolutions between a new profile and its measurement.
pub(super) const SETTLING: f64 = 0.25;
/// Parts of a measured revolution whose scatter tells the error of its mean. All bars together meet
/// the crop in every phase of its segments within half a revolution; the bars by themselves do so in 64.
pub(super) const PARTS: usize = 2;

/// One measured cycle.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Cycle {
    /// Load and slip per node and revolution of the slice, mean over the bars.
    pub load: LoadSlip,
    /// Relative standard error of the most loaded node's mean, from the scatter of its parts.
    pub sampling: f64,
    pub operation: Operation,
    pub power: PowerBudget,
    pub spin: SpinBudget,
    pub flow: Flow,
    pub bar_load: BarLoad,
}

/// A machine and the measurement of its cycles.
pub(super) struct Threshing<'a> {
    pub parameters: &'a Thresher,
    pub world: ThreshingWorld,
    pub totals: Totals,
    /// Time of a revolution \[s\].
    pub revolution: f64,
    dt: f64,
}

impl<'a> Threshing<'a> {
    /// A machine with the crop stiffness of the file.
    pub fn new(
        scene: &Scene,
        parameters: &'a Thresher,
        tooth: &Tooth,
        profile: &Profile,
    ) -> Result<Self, RunError> {
        let stiffness = parameters.crop_stiffness;
        Ok(Threshing {
            parameters,
            world: ThreshingWorld::new(scene, parameters, tooth, profile, stiffness)?,
            totals: Totals::default(),
            revolution: TAU / parameters.speed,
            dt: scene.step.dt,
        })
    }

    pub fn save(&self, to: &mut Writer) -> Result<(), CheckpointError> {
        self.totals.save(to)?;
        self.world.save(to)
    }

    pub fn load(&mut self, from: &mut Reader) -> Result<(), CheckpointError> {
        self.totals = Totals::load(from)?;
        self.world.load(from)
    }

    pub fn steps(&self, revolutions: f64) -> usize {
        (revolutions * self.revolution / self.dt).ceil() as usize
    }

    pub fn step(&mut self) -> Result<StepRecord, RunError> {
        let start = std::time::Instant::now();
        let record = self.world.step()?;
        self.totals.wall += start.elapsed().as_secs_f64();
        self.totals.add(&record);
        Ok(record)
    }

    /// Steps without measuring.
    pub fn run(&mut self, revolutions: f64, progress: &Progress) -> Result<(), RunError> {
        for _ in 0..self.steps(revolutions) {
            self.step()?;
            progress.advance();
        }
        self.world.take_passed();
        Ok(())
    }

    /// Steps `revolutions` and measures wear, torque and power.
    pub fn measure(
        &mut self,
        profile: &Profile,
        revolutions: u32,
        progress: &Progress,
        observe: Observer,
    ) -> Result<Cycle, RunError> {
        let mut measure = Measure::start(self, profile, revolutions);
        while measure.step(self, profile, progress, observe)? {}
        measure.close(self)
    }

    /// Fills the machine with crop and scales the crop's stiffness until the mean torque of teeth
    /// with `profile` is the operating torque, if it `calibrates`. Grains have no stiffness to scale.
    pub fn fill(
        &mut self,
        profile: &Profile,
        calibrates: bool,
        progress: &Progress,
    ) -> Result<(), RunError> {
        let mut ignore = |_: &StepRecord, _: &ThreshingWorld| Ok(());
        if self.parameters.grains.is_some() {
            return self.run(grains_fill(self.parameters), progress);
        }
        self.run(FILLING, progress)?;
        let cycle = self.measure(profile, 1, progress, &mut ignore)?;
        if calibrates {
            self.hold_torque(cycle, profile, 1, progress)?;
        }
        Ok(())
    }
}

/// A measurement of revolutions on its way: plain data, so that one that was stopped goes on.
#[derive(Serialize, Deserialize)]
pub(super) struct Measure {
    revolutions: u32,
    /// Steps in all, and taken.
    steps: usize,
    step: usize,
    /// Load and slip of each of equal parts of the time.
    sums: Vec<LoadSlip>,
    power: PowerBudget,
    spin: SpinBudget,
    flow: Flow,
    bar_load: BarLoad,
    hold: HeldTorque,
    /// Angle that the cylinder has turned \[rad\], and sum of [`ThreshingWorld::filled`].
    angle: f64,
    filled: f64,
    /// Speeds of the cylinder at the start and now [rad/s].
    first: f64,
    last: f64,
    /// Kinetic energy \[J\] and spin [N m s] at the start.
    kinetic: f64,
    turning: f64,
}

impl Measure {
    pub fn start(machine: &mut Threshing, profile: &Profile, revolutions: u32) -> Measure {
        let steps = machine.steps(f64::from(revolutions));
        let parts = PARTS * revolutions as usize;
        let speed = machine.world.speed();
        machine.world.take_passed();
        Measure {
            revolutions,
            steps,
            step: 0,
            sums: vec![LoadSlip::new(profile.node_count()); parts],
            power: PowerBudget::default(),
            spin: SpinBudget::default(),
            flow: Flow::start(&machine.world),
            bar_load: BarLoad::default(),
            hold: HeldTorque::new(machine, steps, revolutions),
            angle: 0.0,
            filled: 0.0,
            first: speed,
            last: speed,
            kinetic: machine.world.kinetic_energy(),
            turning: machine.world.spin(),
        }
    }

    pub fn steps_taken(&self) -> usize {
        self.step
    }

    /// Takes a step.
    ///
    /// # Returns
    /// Whether there was one left to take.
    pub fn step(
        &mut self,
        machine: &mut Threshing,
        profile: &Profile,
        progress: &Progress,
        observe: Observer,
    ) -> Result<bool, RunError> {
        if self.step == self.steps {
            return Ok(false);
        }
        let record = machine.step()?;
        progress.advance();
        let (world, dt, parts) = (&mut machine.world, machine.dt, self.sums.len());
        self.sums[self.step * parts / self.steps].add(&record.contacts, |contact| {
            Some(world.worn_place(contact, profile)?.1)
        })?;
        self.power.add(&record, world);
        self.spin.add(&record, world);
        (self.bar_load).add(&record, world, machine.parameters.bars, dt);
        observe(&record, world)?;
        self.angle += 0.5 * (world.speed() + self.last) * dt;
        self.last = world.speed();
        self.filled += world.filled();
        self.flow.count(world);
        let torque = self.power.drive / self.angle;
        self.hold.steer(world, self.step, torque);
        self.step += 1;
        Ok(true)
    }

    /// What was measured, after the last step.
    pub fn close(self, machine: &mut Threshing) -> Result<Cycle, RunError> {
        let (world, p) = (&mut machine.world, machine.parameters);
        // kinetic energy that the crop gained leaves with it, or is still in the machine
        let passed = world.take_passed();
        let (mut power, mut spin) = (self.power, self.spin);
        power.crop = passed.energy_out - passed.energy_in;
        power.stored = world.kinetic_energy() - self.kinetic;
        spin.crop = passed.spin_out - passed.spin_in;
        spin.stored = world.spin() - self.turning;
        let time = self.steps as f64 * machine.dt;
        let inertia = p.per_metre(p.inertia);
        let gained = 0.5 * inertia * (self.last * self.last - self.first * self.first);
        let demand = p.machine_width * (power.drive - gained) / self.angle;
        let power = power.scaled(p.machine_width / time);
        let (filled, speed) = (self.filled / self.steps as f64, self.angle / time);
        let operation = Operation {
            torque: power.drive / speed,
            demand,
            speed,
            drive: power.drive,
            feeder: power.feeder,
            stiffness: self.hold.close(world),
            filled,
            out: passed.mass_out / time * p.machine_width,
            conveys: operation::conveys(filled, speed / p.speed),
        };
        let mut load = LoadSlip::new(self.sums[0].sums().len());
        for sum in &self.sums {
            load.add_share(sum, 1.0 / f64::from(p.bars * self.revolutions))?;
        }
        Ok(Cycle {
            sampling: sampling_error(&self.sums),
            load,
            operation,
            power,
            spin: spin.scaled(p.machine_width / time),
            flow: self.flow.close(world, &passed, self.steps, time),
            bar_load: self.bar_load,
        })
    }
}

/// Revolutions that fill a machine with grains.
pub(super) fn grains_fill(p: &Thresher) -> f64 {
    let way = SPAWN + arc_length(p) + p.exit_distance;
    PASSAGES * way / p.entry_speed * p.speed / TAU
}

/// Relative standard error of the mean of the most loaded node over equal `parts` of a measured time,
/// as of independent parts.
fn sampling_error(parts: &[LoadSlip]) -> f64 {
    let n = parts.len() as f64;
    let nodes = parts.first().map_or(0, |part| part.sums().len());
    let mean = |node: usize| parts.iter().map(|p| p.sums()[node]).sum::<f64>() / n;
    let most = (0..nodes).max_by(|&a, &b| mean(a).total_cmp(&mean(b)));
    let Some((node, mean)) = most.map(|node| (node, mean(node))) else {
        return 0.0;
    };
    if n < 2.0 || mean <= 0.0 {
        return 0.0;
    }
    let off = parts.iter().map(|p| (p.sums()[node] - mean).powi(2));
    (off.sum::<f64>() / (n * (n - 1.0))).sqrt() / mean
}

/// Wear of a new tooth in the first revolution after the machine is filled, at the stiffness of the
/// file: the start of a run, without its calibration. `observe` is called after every step of that
/// revolution.
///
/// # Errors
/// [`RunError`].
pub(super) fn first_cycle(
    scene: &Scene,
    setup: &Setup<Thresher>,
    progress: &Progress,
    observe: Observer,
) -> Result<WornCycle, RunError> {
    let (parameters, tooth, wear) = (&setup.parameters, &setup.tooth, &setup.wear);
    let mut state = new_tooth(tooth, wear, parameters)?;
    let mut machine = Threshing::new(scene, parameters, tooth, state.profile())?;
    machine.run(FILLING, progress)?;
    let cycle = machine.measure(state.profile(), 1, progress, observe)?;
    state.advance(cycle.load.sums(), 1.0, 0.0)?;
    Ok(WornCycle {
        depth: state.depth().to_vec(),
        exact: None,
        totals: machine.totals,
    })
}

/// Steps of [`first_cycle`] at `dt` \[s\].
pub(super) fn first_cycle_steps(p: &Thresher, dt: f64) -> usize {
    let revolution = TAU / p.speed;
    let steps = |revolutions: f64| (revolutions * revolution / dt).ceil() as usize;
    steps(FILLING) + steps(1.0)
}

/// The wear of a tooth that is new.
pub(super) fn new_tooth(tooth: &Tooth, wear: &Wear, p: &Thresher) -> Result<WearState, WearError> {
    let law = Archard {
        coefficient: wear.coefficient,
    };
    let profile = tooth.profile()?.raised_to(0.0)?;
    WearState::new(profile, wear.settings(law, TAU / p.speed))
}

#[cfg(test)]
mod tests {
    use super::super::shapes::tooth_chain;
    use super::*;
    use crate::contact::Vec2;
    use crate::dynamics::Pose64;
    use crate::dynamics::record::SurfacePoint;
    use crate::peers::ShapeSpec;
    use crate::thresher::{Machine, load};

    /// Regression test: wear combined the position of a contact, which is at the midpoint of the
    /// step, with the pose at the end of the step, and so found another cell than detection. At
    /// this step length it did so for 16 843 of 18 468 contacts.
    #[test]
    fn wear_goes_to_the_cell_that_detection_found() {
        let dt = 1.6e-4;
        let flags = [format!("step.dt={dt}")];
        let (scene, Some(Machine::Thresher(setup))) = load("thresher", &flags).unwrap() else {
            panic!("no thresher");
        };
        let (p, tooth) = (&setup.parameters, &setup.tooth);
        let profile = tooth.profile().unwrap().raised_to(0.0).unwrap();
        let chains: Vec<Vec<Vec2>> = (0..p.bars as usize)
            .map(|bar| match tooth_chain(p, tooth, &profile, bar).unwrap() {
                ShapeSpec::Chain { points, .. } => points,
                other => panic!("{other:?}"),
            })
            .collect();
        let mut machine = Threshing::new(&scene, p, tooth, &profile).unwrap();
        let hidden = Progress::new("", 1, true);
        machine.run(FILLING, &hidden).unwrap();

        let mut start = machine.world.bodies()[0];
        let (mut all, mut elsewhere, mut late) = (0, 0, 0);
        let mut expected = vec![0.0; profile.node_count()];
        let mut observe = |record: &StepRecord, world: &ThreshingWorld| {
            let end = world.bodies()[0];
            // detection runs at the midpoint of the step
            let (number, pose, u) = start;
            let turned = pose.angle() + 0.5 * dt * u.z;
            let middle = Pose64::new(pose.translation + 0.5 * dt * u.xy(), turned);
            for contact in record.contacts.iter().filter(|c| c.load_slip > 0.0) {
                let Some((bar, SurfacePoint { edge, at })) = world.worn_place(contact, &profile)
                else {
                    continue;
                };
                let edge = edge as usize;
                // the contact lies in the middle of the gap, its point of the tooth on the surface
                let side = if contact.bodies[0] == number {
                    -0.5
                } else {
                    0.5
                };
                let touched = contact.position + side * contact.gap * contact.normal;
                let ends = [chains[bar][edge], chains[bar][edge + 1]];
                let place = ends[0] + at * (ends[1] - ends[0]);
                let off = |pose: &Pose64| (pose.apply_inverse(touched) - place).norm() > 1e-5;
                all += 1;
                elsewhere += usize::from(off(&middle));
                late += usize::from(off(&end.1));
                let share = contact.load_slip / f64::from(p.bars);
                expected[edge] += (1.0 - at) * share;
                expected[edge + 1] += at * share;
            }
            start = end;
            Ok(())
        };
        let cycle = machine.measure(&profile, 1, &hidden, &mut observe).unwrap();
        assert!(all > 3000, "{all}");
        assert_eq!(elsewhere, 0, "of {all}");
        // the test would detect the bug
        assert!(late > all / 2, "{late} of {all}");
        let most = expected.iter().copied().fold(0.0, f64::max);
        for (node, (found, expected)) in cycle.load.sums().iter().zip(&expected).enumerate() {
            // sums of thousands in another order
            assert!(
                (found - expected).abs() < 1e-12 * most,
                "node {node}: {found}, {expected}"
            );
        }
    }
}
