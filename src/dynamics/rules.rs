//! The rule of each contact in the contact problem: activation, free term, law.

use super::contact_cache::Left;
use super::model::{ContactPoint, NormalLaw};
use super::visco_elastic::visco_elastic;
use crate::contact::{Law, Vec2, Vec3};
use crate::solver::Shares;
use serde::{Deserialize, Serialize};

/// How contacts enter a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Gap-aware rules on positions staggered at midpoints: order 2 in persistent contact.
    #[default]
    Staggered,
    /// Moreau's published rule: closed iff `g ≤ 0` at the midpoint, gaps never corrected.
    Moreau,
}

impl Scheme {
    /// The name in scene files and settings.
    pub fn name(self) -> &'static str {
        match self {
            Scheme::Staggered => "staggered",
            Scheme::Moreau => "moreau",
        }
    }
}

/// The impact law, for impacts that are simultaneous or frictional, where Newton's law can add
/// energy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ImpactLaw {
    /// Newton's law, blended per island with the plastic one where it would add energy.
    #[default]
    Capped,
    /// Newton's law without a bound, `γ_N⁺ = −e γ_N⁻`; the record has the energy it adds.
    Newton,
    /// One coefficient for both directions, `e_T = e_N`, which reverses sliding. It adds no energy if
    /// all contacts of an island rebound with the same coefficient. Where some of them persist, it is
    /// bounded like the first.
    Uniform,
}

impl ImpactLaw {
    /// The name in scene files and settings.
    pub fn name(self) -> &'static str {
        match self {
            ImpactLaw::Capped => "capped",
            ImpactLaw::Newton => "newton",
            ImpactLaw::Uniform => "uniform",
        }
    }
}

/// How hard the impulses of a crowd are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Effort {
    /// By sweeps alone.
    #[default]
    Fast,
    /// If the sweeps are not certified, the settings' solver is tried from zero impulses: some 50 to
    /// 150 factorisations a step.
    Exact,
}

impl Effort {
    /// The name in scene files and settings.
    pub fn name(self) -> &'static str {
        match self {
            Effort::Fast => "fast",
            Effort::Exact => "exact",
        }
    }
}

/// The settings that decide how contacts enter a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Rules {
    pub scheme: Scheme,
    pub law: ImpactLaw,
    pub shares: Shares,
    /// Whether fast contacts are deferred until they are located in time.
    pub events: bool,
    /// Whether fast contacts of swept bodies are, see [`super::Sweep`].
    pub sweeps: bool,
    pub effort: Effort,
    /// Whether all islands are one problem, see
    /// [`StepperSettings::split_islands`](super::settings::StepperSettings::split_islands).
    pub one_problem: bool,
    /// Whether distant contacts are solved too, see [`super::working_set`].
    pub distant: bool,
    /// Whether contacts without friction have a second row.
    pub tangents: bool,
}

/// Friction of a contact without friction that has a second row: its impulse is below all round-off.
const LEAST_FRICTION: f64 = 1e-12;

impl Rules {
    /// Whether gaps and joint distances are closed; the published rule leaves them.
    pub fn corrects_gaps(&self) -> bool {
        self.scheme == Scheme::Staggered
    }

    /// Whether islands keep an account of energy: Newton's law is free to give some.
    pub fn keeps_account(&self) -> bool {
        self.corrects_gaps() && self.law != ImpactLaw::Newton
    }

    /// Whether contacts can be deferred.
    pub fn locates(&self) -> bool {
        self.events || self.sweeps
    }
}

/// Time spans that the rules use \[s\].
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    /// Of the whole step: the scale of the thresholds.
    pub step: f64,
    /// Of this interval; 0 for an instant.
    pub length: f64,
    /// From this midpoint to the next one: the time in which gaps are closed.
    pub horizon: f64,
    /// Whether an impact located in time ends the interval.
    pub strikes: bool,
}

impl Span {
    /// A step that is not divided into intervals.
    pub fn whole(dt: f64) -> Span {
        Span {
            step: dt,
            length: dt,
            horizon: dt,
            strikes: false,
        }
    }
}

/// Data that the rule of a contact depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Situation {
    pub span: Span,
    /// Relative velocity at the start, and without contact impulses \[m/s\].
    pub gamma_a: Vec2,
    pub gamma_f: Vec2,
    /// Accelerations \[m/s²\]: [`reference_acceleration`], [`applied_acceleration`].
    pub acceleration: f64,
    pub applied: f64,
    /// Whether it had a normal impulse in the last step, or was left touching and at rest, and whether
    /// it stuck then.
    pub pressed: bool,
    pub stuck: bool,
    /// Velocity at the end of the last step, and its change since then by the turning of the rows
    /// alone, `c = (γ_A − γ_E,prev)/τ` \[m/s²\] with the time `τ` from that midpoint to this.
    pub left: Option<Left>,
    pub turning: Option<Vec2>,
    /// Whether the contact closes by the turning of the rows alone, in this step and the one before, and did not
    /// begin with a gap of 0: the scheme would hold it at `|c| h²/2`.
    pub sinks: bool,
    /// Whether the simulation starts with a touching contact in this interval, and its `c` from the
    /// midpoint to the end, if known.
    pub first: bool,
    pub ahead: Option<Vec2>,
    /// Whether that impulse was a rebound.
    pub rebounded: bool,
    /// Whether it is deferred if it closes fast.
    pub located: bool,
    /// Whether it belongs to a crowd, see [`super::events::find_crowds`].
    pub crowded: bool,
    /// Whether that crowd is small enough to locate landings in it.
    pub few: bool,
    /// Whether it took no part in the last step.
    pub unseen: bool,
    /// Whether the interval ends at its landing.
    pub sought: bool,
    /// `Σk G_NN` [1/s²] and `Σc G_NN` [1/s] of a visco-elastic contact, see [`visco_elastic`].
    pub rates: [f64; 2],
}

/// How a contact enters the contact problem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rule {
    pub free: Vec2,
    pub law: Law,
    /// A rebounding impact.
    pub impact: bool,
}

/// Whether a contact takes part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Choice {
    Inactive,
    /// Deferred: its impact must be located in time first.
    Deferred,
    Active(Rule),
}

/// The rule of one contact.
///
/// The returned free term is the velocity added to `γ_F`: `b = γ_F + free`.
pub(super) fn rule(rules: &Rules, contact: &ContactPoint, now: &Situation) -> Choice {
    let g = contact.gap.signum() * (contact.gap.abs() - contact.gap_noise).max(0.0);
    match contact.law {
        NormalLaw::Rigid { restitution } => match rules.scheme {
            Scheme::Moreau if contact.gap > 0.0 => Choice::Inactive,
            Scheme::Moreau => Choice::Active(Rule {
                free: rebound(rules, restitution, now.gamma_a),
                law: rigid(rules, contact),
                impact: restitution > 0.0 && now.gamma_a.x < 0.0,
            }),
            Scheme::Staggered => staggered(rules, contact, restitution, g, now),
        },
        NormalLaw::ViscoElastic { stiffness, damping } => {
            // the gap is used without a dead band, which would lose force
            let velocities = [now.gamma_a.x, now.gamma_f.x];
            let law = [stiffness, damping];
            match visco_elastic(law, contact.gap, velocities, now.rates, now.span.length) {
                Some((free, compliance)) => Choice::Active(Rule {
                    free: Vec2::new(free, 0.0),
                    law: Law::Contact {
                        friction: friction(rules, contact),
                        compliance,
                    },
                    impact: false,
                }),
                None => Choice::Inactive,
            }
        }
        // only the friction row remains, bounded by the given load
        NormalLaw::Load { force } => {
            let bound = contact.friction * force * now.span.length;
            Choice::Active(Rule {
                free: Vec2::zeros(),
                law: Law::Bounded {
                    lower: -bound,
                    upper: bound,
                    compliance: 0.0,
                },
                impact: false,
            })
        }
    }
}

/// The rule of a touching contact in an instant of impact: Newton's law, with the coefficient
/// `in_force` if it closes, with its own if it opens.
pub(super) fn impact_rule(
    rules: &Rules,
    contact: &ContactPoint,
    gamma: Vec2,
    in_force: f64,
) -> Rule {
    let own = contact.law.restitution();
    let closing = gamma.x < 0.0;
    Rule {
        free: rebound(rules, if closing { in_force } else { own }, gamma),
        law: rigid(rules, contact),
        impact: closing && in_force > 0.0,
    }
}

/// `e γ_A`, in both directions under the uniform law.
fn rebound(rules: &Rules, e: f64, gamma: Vec2) -> Vec2 {
    match rules.law {
        ImpactLaw::Uniform => e * gamma,
        _ => Vec2::new(e * gamma.x, 0.0),
    }
}

/// Half of the velocity that the reference acceleration gives in a step. Slower impacts do not
/// rebound.
pub(super) fn rest_velocity(acceleration: f64, step: f64) -> f64 {
    0.5 * acceleration * step
}

/// Normal speed \[m/s\] up to which a touching contact is at rest: all bounces that are left take less
/// than a thousandth of the step.
pub(super) fn resting_speed(contact: &ContactPoint, acceleration: f64, step: f64) -> f64 {
    let e = contact.law.restitution();
    1e-3 * (1.0 - e) * rest_velocity(acceleration, step)
}

fn rigid(rules: &Rules, contact: &ContactPoint) -> Law {
    Law::Contact {
        friction: friction(rules, contact),
        compliance: 0.0,
    }
}

/// The friction of the contact's law.
fn friction(rules: &Rules, contact: &ContactPoint) -> f64 {
    // a row of zeros, as hand-written models may have without friction, moves nothing
    let turns = || {
        contact
            .rows
            .jacobian
            .iter()
            .any(|[_, t]| *t != Vec3::zeros())
    };
    match rules.tangents && contact.friction == 0.0 && turns() {
        true => LEAST_FRICTION,
        false => contact.friction,
    }
}

/// Rules 3 to 5 of the staggered scheme.
///
/// With `v_r = a Δt/2` and `g_r = a_ref Δt²/2` a contact is smooth if it had an impulse
/// and `g < g_r`, or if `e (−γ_A) ≤ v_r`; else it rebounds. `a` is the acceleration of the applied
/// forces: they alone make a resting contact close within a step, and its impulse cancels that.
/// The spin of a body is part of `γ_A`, so that it counts as approach. `a_ref` has the centripetal
/// acceleration too: it opens the gap of a contact that persists. The normal law is
/// `0 ≤ γ_E + b ⟂ P_N ≥ 0` with
///
/// ```text
/// smooth, opening   b = e γ_A   for e > 0, if g < 0, or g = 0 and it had no impulse: an opening
///                   contact takes part in the impacts of others
/// smooth, g ≥ 0     b = g/Δt                        a linearised SHAKE
/// smooth, g < 0     b = −min(−g/Δt, max(−γ_A, 0))   if it had an impulse before: pushed out at
///                   most as fast as it came in; a first landing takes b = 0
/// rebounding        b = e γ_A, active iff g + Δt γ_F/2 ≤ 0
/// ```
///
/// and `b_T = c_T h/2` for a contact that stuck last step, with `c` of [`Situation`] and the length `h`
/// of the interval: half of the change of `γ_T` since the last step, in equal steps. A contact that
/// began with a gap of 0 takes the `b` of [`on_surface`], and `b_T` with the turning of the rows that
/// [`turning_at_end`] expects. One that overlaps and [sinks](Situation::sinks) takes that `b` too, and may
/// open as fast as the turning closes it. In the first step of a simulation both take the turning that
/// [`super::first_step`] has found. So does an interval that ends in an impact located in time, in both
/// rows: `γ_E` then vanishes on the rows of that instant. On the rows of the midpoint it would be an
/// average over the interval, off by first order, which the impact would keep.
///
/// With event location, new contacts that close fast are deferred: those that rebound, and outside
/// crowds those that land faster than `v_r/2`, see [`landing_speed`]. In a crowd the step before keeps a contact from
/// closing; one that took no part in it, and is closed at the midpoint, is deferred too. So is one that is
/// deeper than `g_r`: an impact inside the step drove it in. And so it is in the intervals that are tried
/// up to its landing, whose own midpoints lie before that.
fn staggered(rules: &Rules, contact: &ContactPoint, e: f64, g: f64, now: &Situation) -> Choice {
    let (dt, closing) = (now.span.horizon, -now.gamma_a.x);
    let v_r = rest_velocity(now.applied, now.span.step);
    let g_r = rest_velocity(now.acceleration, now.span.step) * now.span.step;
    // a contact that has just rebounded and closes fast again rebounds again
    let again = now.rebounded && e * closing > v_r;
    let persists = now.pressed && g < g_r && !again;
    let late = now.few && g < if now.unseen { 0.0 } else { -g_r };
    let alone = !now.crowded || now.sought || late;
    let landing = landing_speed(g, now);
    let fast = e * landing > v_r || alone && landing > 0.5 * v_r;
    if now.located && fast && !persists {
        return Choice::Deferred;
    }
    let smooth = persists || e * closing <= v_r;
    let mut free = Vec2::zeros();
    // γ_A differs from the velocity that the last interval left because the rows have turned since.
    // They turn on from the midpoint to the end: `turned` is what that adds to γ.
    let half = 0.5 * now.span.length;
    let turned = half * now.ahead.unwrap_or_else(|| turning_at_end(now));
    if smooth && now.span.strikes && now.left.is_some() {
        // the impact needs the velocities of its instant
        free.x = turned.x;
        if now.stuck {
            free.y = turned.y;
        }
        return Choice::Active(Rule {
            free,
            law: rigid(rules, contact),
            impact: false,
        });
    }
    let stays = now.left.is_some_and(|left| left.on_surface);
    let sinks = persists && g < 0.0 && now.sinks && turned.x < 0.0;
    if !smooth {
        if g + 0.5 * dt * now.gamma_f.x > 0.0 {
            return Choice::Inactive;
        }
        free = rebound(rules, e, now.gamma_a);
    } else if e > 0.0 && closing < 0.0 && (g < 0.0 || g == 0.0 && !now.pressed) {
        // under the uniform law in both rows; a contact that only touches keeps b = g/Δt, or order
        // 2 is lost
        free = rebound(rules, e, now.gamma_a);
    } else if stays && now.first {
        // the gap is that of the start, round-off, and that of the turn so far
        free.x = turned.x.max(-closing.max(0.0));
    } else if (stays || sinks) && (e == 0.0 || g < g_r) {
        // what this gives at first the account of energy takes back
        let most = match sinks && rules.keeps_account() {
            true => turned.x.min(-closing),
            false => -closing.max(0.0),
        };
        free.x = on_surface(g, turned.x, &now.span).max(most);
    } else if g >= 0.0 {
        if e > 0.0 && g > 0.0 && g >= g_r && g + dt * now.gamma_f.x > 0.0 {
            return Choice::Inactive;
        }
        free.x = g / dt;
    } else if now.pressed {
        free.x = -(-g / dt).min(closing.max(0.0));
    }
    // any other contact deep at the midpoint got there in this very step: a landing, not a rebound
    if smooth && now.stuck {
        free.y = match stays {
            true => turned.y,
            false => half * now.turning.map_or(0.0, |c| c.y),
        };
    }
    Choice::Active(Rule {
        free,
        law: rigid(rules, contact),
        impact: !smooth,
    })
}

/// Normal speed \[m/s\] at which a contact with the gap `g` at the midpoint closes, or at which it would at
/// the end of the interval: that of the start, faster by the applied forces until then. A body that
/// is let go just above the floor starts with a speed of 0.
fn landing_speed(g: f64, now: &Situation) -> f64 {
    let (closing, gained) = (-now.gamma_a.x, now.gamma_a.x - now.gamma_f.x);
    let start = g + 0.5 * now.span.length * closing;
    if closing < 0.0 || gained <= 0.0 || start <= 0.0 {
        return closing;
    }
    let square = closing * closing + 2.0 * gained / now.span.length * start;
    square.sqrt().min(closing + gained)
}

/// `c` \[m/s²\] of [`Situation`] at the end of the interval, by a straight line through that at its
/// start and that at the start of the interval before; at most twice that at the start, and not of
/// the other sign. With `c` of the start a rocking block lags by a step: its peak was off by 4e-3 at
/// 1/60 s in place of 2e-5.
fn turning_at_end(now: &Situation) -> Vec2 {
    let half = 0.5 * now.span.length;
    match (now.turning, now.left) {
        (Some(c), Some(left)) => match left.turning.filter(|_| left.ago > 0.0) {
            Some(before) => {
                let more = (c - before) * (half / left.ago);
                // not `clamp`, which panics at NaN
                c + more.zip_map(&c.abs(), |more, most| more.max(-most).min(most))
            }
            None => c,
        },
        _ => Vec2::zeros(),
    }
}

/// The normal velocity to add in a contact that began with a gap of 0.
///
/// With `c` the acceleration of the gap at constant velocities, the rows turn `γ` by `t = c h/2`
/// from the midpoint to the end, and `b = t` lets the contact neither open nor close there. Between
/// midpoints on a path that began on the surface the gap is `c h²/8`; on one along which the rule
/// `b = g/h` is steady it is `c h²/2 = t h`. The rule `b = g/h` alone would go from the first to the
/// second in one step, and its force be off by 3/8 of that which `c` needs. Above a convex surface
/// the first is restored; in a hollow, where that would push the bodies apart, all gaps between the
/// two are left.
fn on_surface(g: f64, turned: f64, span: &Span) -> f64 {
    let excess = g - turned * span.length;
    let edge = -0.75 * turned * span.length;
    let allowed = if turned > 0.0 {
        edge
    } else {
        excess.clamp(0.0, edge.max(0.0))
    };
    turned + (excess - allowed) / span.horizon
}

/// `a_ref` \[m/s²\]: the largest of `|F/m|` of both bodies and of [`centripetal`]; 0.1 if both
/// vanish.
pub(super) fn reference_acceleration(
    contact: &ContactPoint,
    velocities: &[Vec3],
    accelerations: &[Vec3],
) -> f64 {
    centripetal(contact, velocities).max(applied_acceleration(contact, accelerations))
}

/// Largest centripetal acceleration `ω² |c − x|` \[m/s²\] of the centre of curvature `c` of a surface
/// at the contact, for a body with centre of mass `x` and spin `ω`.
///
/// The contact point of a round surface does not turn with the body; `c` does. At a corner `c` is
/// the corner itself, for a disc it is the centre.
pub(super) fn centripetal(contact: &ContactPoint, velocities: &[Vec3]) -> f64 {
    let (rows, mut largest) = (&contact.rows, 0.0f64);
    for (side, &body) in rows.bodies.iter().enumerate() {
        let omega = velocities.get(body as usize).map_or(0.0, |u| u.z);
        if omega != 0.0 {
            // moments of n and t: the components of the arm along t and n
            let [n, t] = rows.jacobian[side];
            // the surface lies the radius away from `c`, towards the other body
            let arm = n.z.hypot(t.z + contact.radii[side]);
            largest = largest.max(omega * omega * arm);
        }
    }
    largest
}

/// `a_ref` \[m/s²\] of the forces alone: the scale of an impact located in time.
pub(super) fn applied_acceleration(contact: &ContactPoint, accelerations: &[Vec3]) -> f64 {
    let mut a: f64 = 0.0;
    for (body, arm) in levers(contact) {
        let free = accelerations[body];
        a = a.max(free.xy().norm() + free.z.abs() * arm);
    }
    if a > 0.0 { a } else { 0.1 }
}

/// Spin \[rad/s\] of each body and distance \[m\] of its centre from the contact.
pub(super) fn turning<'a>(
    contact: &'a ContactPoint,
    velocities: &'a [Vec3],
) -> impl Iterator<Item = (f64, f64)> + 'a {
    levers(contact).map(|(body, arm)| (velocities[body].z, arm))
}

fn levers(contact: &ContactPoint) -> impl Iterator<Item = (usize, f64)> + '_ {
    let rows = &contact.rows;
    let sides = rows.bodies.iter().zip(&rows.jacobian);
    sides
        .filter(|(body, _)| **body != crate::contact::NO_BODY)
        .map(|(body, [n, t])| (*body as usize, (n.z * n.z + t.z * t.z).sqrt()))
}
