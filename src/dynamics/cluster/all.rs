//! Which bodies form clusters, and which clusters run into other bodies.

use super::context::{Cluster, Context, PARTS};
use super::counts::LATE;
use super::meetings::meetings;
use super::runner::Runner;
use super::slides::ended_slides;
use super::watched::near_enough;
use crate::contact::{NO_BODY, Vec2};
use crate::dynamics::crowd::crowd_bodies;
use crate::dynamics::cut_links::CutLink;
use crate::dynamics::events::{crossing, may_close};
use crate::dynamics::interval::{Source, movable};
use crate::dynamics::islands::Islands;
use crate::dynamics::model::{Configuration, ContactPoint, MultibodyModel, NormalLaw};
use crate::dynamics::record::StepRecord;
use crate::dynamics::settings::StepError;
use crate::dynamics::solve::IslandSolver;
use crate::dynamics::wide_turns::wide_turns;
use std::collections::BTreeMap;

/// Steps every cluster of bodies in which a contact closes or rebounds late, a slide ends
/// or a contact or link turns too far. `main` is the whole step, `trial` its
/// solution. `work` gets that of clusters that are stepped again.
///
/// A cluster that would hit a body outside is merged with that body's cluster and restarted. One that grows to more
/// than [`LATE`] bodies without events is stepped in [`PARTS`], unless something in it is too fast for these. One with
/// a crowd in it is left to the trial, for its cost, unless the trial has deferred a contact.
pub(in crate::dynamics) fn locate_impacts(
    model: &mut dyn MultibodyModel,
    solver: &mut IslandSolver,
    context: &Context,
    work: &mut StepRecord,
) -> Result<Vec<Cluster>, StepError> {
    let (main, trial) = (context.main, context.trial);
    let count = main.start.len();
    let deferred = trial.deferred.iter().map(|&i| &main.detection.contacts[i]);
    let deferred: Vec<&ContactPoint> = deferred
        .filter(|c| crossing(main, trial, c, context.dt).is_some() || may_close(main, trial, c))
        .collect();
    let bodies = |contact: &ContactPoint| movable(contact.rows.bodies, context.inverse_mass);
    let mut crossing: Vec<[u32; 2]> = deferred.iter().map(|c| bodies(c)).collect();
    if context.rules.events {
        let slides = ended_slides(main, trial, context.dt, |_| true);
        crossing.extend(
            slides
                .iter()
                .map(|s| movable(s.bodies, context.inverse_mass)),
        );
        let turns = wide_turns(main, trial, context.inverse_mass, |_| true);
        crossing.extend(
            turns
                .iter()
                .map(|t| movable(t.bodies, context.inverse_mass)),
        );
    }
    let cut = |c: &CutLink| [c.link.body as u32, NO_BODY];
    crossing.extend(context.cuts.iter().map(cut));
    let mut runner = Runner::default();
    if context.rules.events {
        for near in near_enough(main, trial) {
            let bodies = movable(near.bodies, context.inverse_mass);
            let mut moving: Vec<u32> = bodies.into_iter().filter(|b| *b != NO_BODY).collect();
            moving.sort_unstable();
            if !moving.is_empty() && runner.meets(model, context, near.surfaces, &moving)? {
                crossing.push(bodies);
            }
        }
    }
    if crossing.is_empty() && context.late.is_empty() {
        return Ok(Vec::new());
    }
    let mut links = loads(context);
    let flags = |pairs: &[[u32; 2]]| {
        let mut flags = vec![false; count];
        for &body in pairs.iter().flatten().filter(|b| **b != NO_BODY) {
            flags[body as usize] = true;
        }
        flags
    };
    // the trial leaves out what is deferred
    let asked = flags(&crossing);
    let fast = deferred.iter().filter(|c| needs_impacts(c, context));
    let others = crossing[deferred.len()..].iter().copied();
    let fast: Vec<[u32; 2]> = fast.map(|c| bodies(c)).chain(others).collect();
    let fast = flags(&fast);
    // what rebounds may be thrown into another body in the same step
    let rebounds = deferred.iter().filter(|c| c.law.restitution() > 0.0);
    let mut rebounding: Vec<[u32; 2]> = rebounds.map(|c| bodies(c)).collect();
    rebounding.extend(context.late);
    let rebounding = flags(&rebounding);
    crossing.extend(context.late);
    let mut crowds = crowd_bodies(count, main, trial);
    crowds.resize(count, false);
    let any = |bodies: &[u32], flags: &[bool]| bodies.iter().any(|b| flags[*b as usize]);
    let mut done: Vec<Cluster> = Vec::new();
    // bodies that run into others in the step: without events they may be deep in each other when they are next
    // looked at
    let mut struck = vec![false; count];
    // where the bodies of clusters were before they were stepped
    let mut middle: BTreeMap<u32, Configuration> = BTreeMap::new();
    loop {
        let crowd =
            |bodies: &Vec<u32>| bodies.len() > LATE && any(bodies, &crowds) && !any(bodies, &asked);
        let (left, groups): (Vec<_>, Vec<_>) =
            (group(count, &crossing, &links).into_iter()).partition(crowd);
        for body in left.iter().flatten() {
            if let Some(place) = middle.get(body) {
                model.set_configuration(*body as usize, place);
            }
        }
        crossing.retain(|pair| !left.iter().any(|bodies| is_of(bodies, pair)));
        done.retain(|cluster| {
            let stays = groups.contains(&cluster.bodies);
            if !stays {
                work.add_work(&cluster.record);
            }
            stays
        });
        for bodies in groups {
            if !done.iter().any(|cluster| cluster.bodies == bodies) {
                for &body in &bodies {
                    let now = || model.configuration(body as usize);
                    middle.entry(body).or_insert_with(now);
                }
                let plain = context.rules.events || bodies.len() > LATE;
                let large = !context.rules.events && plain;
                let in_parts = large && !any(&bodies, &fast);
                let finely = any(&bodies, &rebounding) || any(&bodies, &struck);
                let own = match !plain && finely {
                    true => &context.with_events(),
                    false if in_parts => &context.in_parts(),
                    false => context,
                };
                let mut cluster = runner.run(model, solver, own, bodies)?;
                if runner.deep && !plain {
                    work.add_work(&cluster.record);
                    let own = &context.with_events();
                    cluster = runner.run(model, solver, own, cluster.bodies)?;
                }
                done.push(cluster);
            }
        }
        done.sort_by_key(|cluster| cluster.bodies[0]);
        let met = meetings(model, &done, context)?;
        if met.is_empty() {
            return Ok(done);
        }
        for body in met.iter().flatten() {
            struck[*body as usize] = true;
        }
        // a heap would meet one body after the other, and be stepped from its start each time
        let heaps: Vec<&Cluster> = (done.iter())
            .filter(|c| c.bodies.len() > LATE && met.iter().any(|pair| is_of(&c.bodies, pair)))
            .collect();
        if !context.rules.events && !heaps.is_empty() {
            let near: Vec<[u32; 2]> = main.detection.contacts.iter().map(bodies).collect();
            let is_near = |pair: &&[u32; 2]| heaps.iter().any(|c| is_of(&c.bodies, pair));
            links.extend(near.iter().filter(is_near));
            // those in parts take all at once that they may meet
            let mut islands = Islands::default();
            islands.build(count, near.iter().copied());
            for k in 0..islands.len() {
                let pairs = || islands.blocks(k).iter().map(|&i| near[i as usize]);
                let own = |c: &&Cluster| c.in_parts && pairs().any(|pair| is_of(&c.bodies, &pair));
                if heaps.iter().copied().any(|c| own(&c)) {
                    links.extend(pairs());
                }
            }
        }
        links.extend(met);
    }
}

/// Joined bodies, which belong together, and bodies that load each other, in the trial or by rule.
fn loads(context: &Context) -> Vec<[u32; 2]> {
    let (main, trial) = (context.main, context.trial);
    let by_rule = |source: Source| match source {
        Source::Joint(_) => true,
        Source::Contact(c) => {
            matches!(main.detection.contacts[c].law, NormalLaw::Load { .. })
        }
    };
    let blocks = main.blocks.iter().zip(&trial.impulses);
    blocks
        .filter(|(block, p)| **p != Vec2::zeros() || by_rule(block.source))
        .map(|(block, _)| movable(block.bodies, context.inverse_mass))
        .collect()
}

/// Whether the impacts of the cluster of a deferred contact are located however large it is: with events, and where
/// it asked for it or is too fast for parts of the step.
fn needs_impacts(contact: &ContactPoint, context: &Context) -> bool {
    let (roles, w) = (&context.main.roles, context.inverse_mass);
    let is_asked = |body: u32| roles.sweeps.get(body as usize).is_some_and(|s| s.all);
    let pair = contact.rows.bodies;
    let gamma = contact.rows.velocity(&context.main.start);
    context.rules.events
        || pair.into_iter().any(is_asked)
        || roles.swept(pair, gamma, context.dt / PARTS, w)
}

/// Bodies of each cluster, ascending.
fn group(count: usize, crossing: &[[u32; 2]], links: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let all: Vec<[u32; 2]> = crossing.iter().chain(links).copied().collect();
    let mut islands = Islands::default();
    islands.build(count, all.iter().copied());
    (0..islands.len())
        .filter(|&k| {
            islands
                .blocks(k)
                .iter()
                .any(|&i| (i as usize) < crossing.len())
        })
        .map(|k| {
            let mut bodies: Vec<u32> = islands
                .blocks(k)
                .iter()
                .flat_map(|&i| all[i as usize])
                .filter(|b| *b != NO_BODY)
                .collect();
            bodies.sort_unstable();
            bodies.dedup();
            bodies
        })
        .collect()
}

/// Whether a body of the pair is one of these, ascending.
fn is_of(bodies: &[u32], pair: &[u32; 2]) -> bool {
    pair.iter().any(|body| bodies.binary_search(body).is_ok())
}
