//! Which bodies form clusters, and which clusters run into other bodies.

use super::context::{Cluster, Context};
use super::counts::FEW;
use super::runner::Runner;
use super::slides::ended_slides;
use super::watched::{is_crowded, near_enough, way};
use crate::contact::{NO_BODY, Vec2, Vec3};
use crate::dynamics::cut_links::CutLink;
use crate::dynamics::events::{crossing, detect_at, may_close, touch_tolerance};
use crate::dynamics::interval::{Source, movable};
use crate::dynamics::islands::Islands;
use crate::dynamics::model::{Configuration, ContactPoint, MultibodyModel, NormalLaw};
use crate::dynamics::settings::StepError;
use crate::dynamics::solve::IslandSolver;
use crate::dynamics::wide_turns::wide_turns;
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;

/// Steps every cluster of bodies in which a contact closes or rebounds late, a slide ends
/// or a contact or link turns too far. `main` is the whole step, `trial` its
/// solution.
///
/// A cluster that would hit a body outside is merged with that body's cluster and restarted; or left to the
/// trial, if it is stepped for late rebounds alone and grows too large.
pub(in crate::dynamics) fn locate_impacts<M: MultibodyModel + ?Sized>(
    model: &mut M,
    solver: &mut IslandSolver,
    context: &Context,
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
    // joined bodies belong together, and so do bodies that load each other, in the trial or by rule
    let mut links: Vec<[u32; 2]> = (0..main.blocks.len())
        .filter(|&i| {
            trial.impulses[i] != Vec2::zeros()
                || match main.blocks[i].source {
                    Source::Joint(_) => true,
                    Source::Contact(c) => {
                        matches!(main.detection.contacts[c].law, NormalLaw::Load { .. })
                    }
                }
        })
        .map(|i| movable(main.blocks[i].bodies, context.inverse_mass))
        .collect();
    let flags = |pairs: &[[u32; 2]]| {
        let mut flags = vec![false; count];
        for &body in pairs.iter().flatten().filter(|b| **b != NO_BODY) {
            flags[body as usize] = true;
        }
        flags
    };
    let asked = flags(&crossing);
    // what rebounds may be thrown into another body in the same step
    let rebounds = deferred.iter().filter(|c| c.law.restitution() > 0.0);
    let mut rebounding: Vec<[u32; 2]> = rebounds.map(|c| bodies(c)).collect();
    rebounding.extend(context.late);
    let rebounding = flags(&rebounding);
    crossing.extend(context.late);
    let any = |bodies: &[u32], flags: &[bool]| bodies.iter().any(|b| flags[*b as usize]);
    let mut done: Vec<Cluster> = Vec::new();
    // where the bodies of clusters were before they were stepped
    let mut middle: BTreeMap<u32, Configuration> = BTreeMap::new();
    loop {
        let crowd = |bodies: &Vec<u32>| bodies.len() > FEW && !any(bodies, &asked);
        let (left, groups): (Vec<_>, Vec<_>) =
            (group(count, &crossing, &links).into_iter()).partition(crowd);
        for body in left.iter().flatten() {
            if let Some(place) = middle.get(body) {
                model.set_configuration(*body as usize, place);
            }
        }
        crossing.retain(|pair| !left.iter().any(|bodies| is_of(bodies, pair)));
        done.retain(|cluster| groups.contains(&cluster.bodies));
        for bodies in groups {
            if !done.iter().any(|cluster| cluster.bodies == bodies) {
                for &body in &bodies {
                    let now = || model.configuration(body as usize);
                    middle.entry(body).or_insert_with(now);
                }
                let plain = context.rules.events || bodies.len() > FEW;
                let own = match !plain && any(&bodies, &rebounding) {
                    true => &context.with_events(),
                    false => context,
                };
                done.push(runner.run(model, solver, own, bodies)?);
            }
        }
        done.sort_by_key(|cluster| cluster.bodies[0]);
        let mut met = collisions(&done, context);
        met.extend(meetings(model, &done, context)?);
        if met.is_empty() {
            return Ok(done);
        }
        links.extend(met);
    }
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

/// For each body the number of its cluster, or [`NO_BODY`], and its displacement from the midpoint to the
/// end of the step, where the midpoint is that of the trial.
fn paths(done: &[Cluster], context: &Context) -> (Vec<u32>, Vec<Vec3>) {
    let start = &context.main.start;
    let mut owner = vec![NO_BODY; start.len()];
    let end = context.trial.end.iter();
    let mut moved: Vec<Vec3> = end.map(|u| 0.5 * context.dt * u).collect();
    for (k, cluster) in done.iter().enumerate() {
        for (&body, d) in cluster.bodies.iter().zip(&cluster.displacement) {
            owner[body as usize] = k as u32;
            moved[body as usize] = d - 0.5 * context.dt * start[body as usize];
        }
    }
    (owner, moved)
}

/// Contacts between a cluster and a body outside it that overlap at the end, on the paths of both.
fn collisions(done: &[Cluster], context: &Context) -> Vec<[u32; 2]> {
    let main = context.main;
    let (owner, moved) = paths(done, context);
    let outside = |contact: &ContactPoint| {
        let [a, b] = movable(contact.rows.bodies, context.inverse_mass);
        if a == NO_BODY || b == NO_BODY || owner[a as usize] == owner[b as usize] {
            return None;
        }
        let start = contact.gap - 0.5 * context.dt * contact.rows.velocity(&main.start).x;
        let end = contact.gap + contact.rows.velocity(&moved).x;
        let touch = touch_tolerance(contact, main, context.dt);
        let rigid = matches!(contact.law, NormalLaw::Rigid { .. });
        (rigid && end < start.min(0.0) - touch).then_some([a, b])
    };
    main.detection.contacts.iter().filter_map(outside).collect()
}

/// Pairs of a cluster and a body outside it that show no contact at the midpoint, and overlap at the end.
fn meetings<M: MultibodyModel + ?Sized>(
    model: &mut M,
    done: &[Cluster],
    context: &Context,
) -> Result<Vec<[u32; 2]>, StepError> {
    let (main, mut met) = (context.main, Vec::new());
    let (owner, moved) = paths(done, context);
    // without events the pairs are near those that rebound late
    let located = |body: u32| {
        let of = |cluster: &Cluster| cluster.located;
        done.get(owner[body as usize] as usize).is_some_and(of)
    };
    let known: FxHashSet<[u32; 2]> = main.detection.contacts.iter().map(|c| c.surfaces).collect();
    for near in &main.detection.near {
        let [a, b] = movable(near.bodies, context.inverse_mass);
        if a == NO_BODY
            || b == NO_BODY
            || !located(a) && !located(b)
            || owner[a as usize] == owner[b as usize]
            || known.contains(&near.surfaces)
            || is_crowded(main, near)
            || way(near, &moved) <= near.bound
        {
            continue;
        }
        // the bodies of clusters are at the end already
        let bodies = vec![a, b];
        let free = bodies.iter().filter(|b| owner[**b as usize] == NO_BODY);
        let free: Vec<_> = free.map(|b| (*b, at_end(model, *b, context))).collect();
        let place = |body: u32| free.iter().find(|p| p.0 == body).map(|p| p.1);
        let found = detect_at(model, &[near.surfaces], bodies, place, context.dt)?;
        let overlaps = |c: &ContactPoint| c.gap < -touch_tolerance(c, main, context.dt);
        if found.contacts.iter().any(overlaps) {
            met.push([a, b]);
        }
    }
    Ok(met)
}

/// Configuration at the end of the step of a body in no cluster, which is at its midpoint.
fn at_end<M: MultibodyModel + ?Sized>(
    model: &mut M,
    body: u32,
    context: &Context,
) -> Configuration {
    let k = body as usize;
    let middle = model.configuration(k);
    model.shift(k, &context.trial.end[k], 0.5 * context.dt);
    let end = model.configuration(k);
    model.set_configuration(k, &middle);
    end
}
