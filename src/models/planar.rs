use super::RotorMotor;
use super::planar_shape::{PlanarShape, Tip};
use crate::contact::{NO_BODY, Rows, Vec2, Vec3};
use crate::dynamics::{
    Configuration, ContactKey, ContactPoint, Detection, JointCoordinate, JointKind, JointPart,
    JointRow, ModelError, MultibodyModel, NormalLaw, Shown, SurfacePoint,
};
use crate::dynamics::{JointFrames, Pose64, RowName};

/// A sinusoidal motion on top of a constant velocity: `x(t) = x₀ + v t + A sin(ω t)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillation {
    /// `A` \[m\].
    pub amplitude: Vec2,
    /// `ω` \[rad/s\].
    pub angular_frequency: f64,
}

/// A body of a [`Planar`] model; its origin is its centre of mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarBody {
    pub shape: PlanarShape,
    /// Mass \[kg\] and moment of inertia [kg m²]; `None` for a body that no force moves.
    pub mass: Option<(f64, f64)>,
    pub pose: Pose64,
    /// [m/s, m/s, rad/s]; constant where no force moves the body.
    pub velocity: Vec3,
    /// Prescribed oscillation of a body without mass.
    pub oscillation: Option<Oscillation>,
    /// Friction and restitution; each combines by the mean of the two bodies.
    pub friction: f64,
    pub restitution: f64,
    /// Tangential speed of the surface, counter-clockwise round the body [m/s].
    pub surface_velocity: f64,
}

/// A pivot: a point of one body pinned to a point of another, or of the world (`None`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pivot {
    pub bodies: [Option<usize>; 2],
    /// In each body's frame, or in the world \[m\].
    pub anchors: [Vec2; 2],
    /// Motor on the spin of the second body relative to the first.
    pub motor: Option<RotorMotor>,
}

/// Planar rigid bodies whose gaps, normals and levers are closed forms in `f64`.
///
/// For geometry that a mesh of segments can only approximate (a bowl, a loop) or that a polygon
/// cannot represent (a rod without width, an infinite plane, a shaking plate):
///
/// ```text
/// m ẍ = m g + F,   J ω̇ = M                                                   (1)
/// γ = W u,   rows of W: ±(n, r × n), ±(t, r × t), arms r from the centres     (2)
/// ```
///
/// with the gaps of [`PlanarShape`]. A body without mass follows its prescribed motion exactly. Its
/// velocity in a step is the mean over the step from midpoint to midpoint, `(x(t_E + Δt/2) −
/// x(t_M))/Δt`: a contact that moves with it stays closed at every midpoint.
///
/// # Source
/// Glocker & Studer, *Multibody System Dynamics* 13 (2005), for rows and signs.
#[derive(Debug, Clone)]
pub struct Planar {
    gravity: Vec2,
    bodies: Vec<PlanarBody>,
    pivots: Vec<Pivot>,
    /// Surface and body with tips of every pair that may touch, ascending.
    pairs: Vec<[usize; 2]>,
    tips: Vec<Vec<Tip>>,
    poses: Vec<Pose64>,
    velocities: Vec<Vec3>,
    inverse: Vec<Vec3>,
    /// Time for which each body has followed its prescribed motion \[s\].
    clocks: Vec<f64>,
    /// Poses and velocities that are shown, where they are not those of the state.
    shown: Vec<Option<(Pose64, Vec3)>>,
}

/// Poses, velocities and clocks of a [`Planar`] model, which has as many bodies.
pub type PlanarState = (Vec<Pose64>, Vec<Vec3>, Vec<f64>);

impl Planar {
    /// What changes in time.
    pub fn state(&self) -> PlanarState {
        let clocks = self.clocks.clone();
        (self.poses.clone(), self.velocities.clone(), clocks)
    }

    /// Goes on from a state.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] for a state of another number of bodies.
    pub fn set_state(&mut self, state: PlanarState) -> Result<(), ModelError> {
        let n = self.bodies.len();
        if [state.0.len(), state.1.len(), state.2.len()] != [n; 3] {
            return Err(ModelError::Invalid(format!(
                "the state is not one of {n} bodies"
            )));
        }
        (self.poses, self.velocities, self.clocks) = state;
        self.show(&[]);
        Ok(())
    }

    /// A model of `bodies` under `gravity` \[m/s²\].
    ///
    /// Bodies joined by a pivot do not touch, nor do the pairs of `apart`, nor two bodies without
    /// mass.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] for a mass or inertia that is not finite and positive, a line or
    /// bowl with a mass, or a pivot on a body that does not exist; [`ModelError::Unsupported`] for
    /// two bodies that could touch but have no closed form (see [`PlanarShape::meets`]).
    pub fn new(
        gravity: Vec2,
        bodies: Vec<PlanarBody>,
        pivots: Vec<Pivot>,
        apart: &[[usize; 2]],
    ) -> Result<Planar, ModelError> {
        for (k, body) in bodies.iter().enumerate() {
            let good = |x: f64| x > 0.0 && x.is_finite();
            if body.mass.is_some_and(|(m, j)| !good(m) || !good(j)) {
                return Err(ModelError::Invalid(format!(
                    "body {k}: mass and inertia must be finite and above 0"
                )));
            }
            if body.mass.is_some() && body.shape.is_surface() {
                return Err(ModelError::Invalid(format!(
                    "body {k}: a line or bowl has no mass"
                )));
            }
        }
        for pivot in &pivots {
            if let Some(k) = pivot.bodies.iter().flatten().find(|k| **k >= bodies.len()) {
                return Err(ModelError::Invalid(format!("a pivot holds no body {k}")));
            }
        }
        let pairs = pairs(&bodies, &pivots, apart)?;
        let poses: Vec<Pose64> = bodies.iter().map(|b| b.pose).collect();
        let mut model = Planar {
            gravity,
            tips: bodies.iter().map(|b| b.shape.tips()).collect(),
            velocities: bodies.iter().map(|b| b.velocity).collect(),
            inverse: bodies
                .iter()
                .map(|b| match b.mass {
                    Some((m, j)) => Vec3::new(1.0 / m, 1.0 / m, 1.0 / j),
                    None => Vec3::zeros(),
                })
                .collect(),
            clocks: vec![0.0; bodies.len()],
            shown: vec![None; bodies.len()],
            pairs,
            poses,
            pivots,
            bodies,
        };
        for (velocity, body) in model.velocities.iter_mut().zip(&model.bodies) {
            if let Some(o) = body.oscillation {
                let start = o.amplitude * o.angular_frequency;
                *velocity += Vec3::new(start.x, start.y, 0.0);
            }
        }
        Ok(model)
    }

    /// Pose of body `k`; `None` beyond the last.
    pub fn pose(&self, k: usize) -> Option<Pose64> {
        let own = *self.poses.get(k)?;
        Some(self.shown[k].map_or(own, |(pose, _)| pose))
    }

    /// Velocity and spin of body `k` [m/s, m/s, rad/s].
    pub fn velocity(&self, k: usize) -> Option<Vec3> {
        let own = *self.velocities.get(k)?;
        Some(self.shown[k].map_or(own, |(_, velocity)| velocity))
    }

    /// The deepest penetration of the present configuration: surface, body with tips, gap \[m\]
    /// below 0.
    pub fn deepest(&self) -> Option<([usize; 2], f64)> {
        let gap = |pair: [usize; 2], tip| Some((pair, self.contact(pair, tip, 0.0)?.gap));
        self.pairs
            .iter()
            .flat_map(|&pair| (0..self.tips[pair[1]].len()).filter_map(move |tip| gap(pair, tip)))
            .filter(|(_, gap)| *gap < 0.0)
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// From the centre of `body` (from the origin for the world) to a point of it.
    fn arm(&self, body: Option<usize>, anchor: Vec2) -> Vec2 {
        body.map_or(anchor, |k| self.poses[k].rotate(anchor))
    }

    /// Bound of the motion in `dt` \[s\] of a point of body `k`, `arm` \[m\] from its centre.
    fn reach(&self, k: usize, arm: f64, dt: f64) -> f64 {
        let u = self.velocities[k];
        let free = if self.bodies[k].mass.is_some() {
            self.gravity.norm()
        } else {
            0.0
        };
        dt * (u.xy().norm() + u.z.abs() * arm) + dt * dt * (free + u.z * u.z * arm)
    }

    fn contact(
        &self,
        [surface, body]: [usize; 2],
        feature: usize,
        dt: f64,
    ) -> Option<ContactPoint> {
        let (a, b) = (&self.bodies[surface], &self.bodies[body]);
        let (tip, radius) = self.tips[body][feature];
        let (frame, centre) = (self.poses[surface], self.poses[body].translation);
        let out = self.poses[body].rotate(tip);
        let (tip, up) = (centre + out, frame.rotate(Vec2::y()));
        let from = tip - frame.translation;
        let (gap, normal) = a.shape.gap(from, radius, up);
        // on the tip's own surface; half way across the gap if both bodies move
        let below = match a.shape {
            PlanarShape::Disc { .. } => radius + 0.5 * gap,
            _ => radius,
        };
        let arms = [a.shape.arm(from, below, normal), out - normal * below];
        // twice the motion: an impact elsewhere in the same step may accelerate the body
        if gap
            > 2.0 * (self.reach(surface, arms[0].norm(), dt) + self.reach(body, arms[1].norm(), dt))
        {
            return None;
        }
        let coordinate = tip.amax().max(frame.translation.amax()).max(centre.amax());
        Some(ContactPoint {
            key: ContactKey {
                pair: (surface as u64) << 32 | body as u64,
                feature: feature as u64,
            },
            rows: rows([Some(surface), Some(body)], arms, normal),
            bodies: [surface as u32, body as u32],
            surfaces: [surface as u32, body as u32],
            places: [0, feature as u32].map(SurfacePoint::on),
            position: tip - normal * below,
            normal,
            gap,
            gap_noise: (1e-12 * a.shape.size().min(b.shape.size()))
                .max(4.0 * f64::EPSILON * coordinate),
            radii: [a.shape.surface_radius(), radius],
            rolls_on: [0.0; 2],
            friction: 0.5 * (a.friction + b.friction),
            law: NormalLaw::Rigid {
                restitution: 0.5 * (a.restitution + b.restitution),
            },
            surface_velocity: -a.surface_velocity - b.surface_velocity,
        })
    }
}

/// Rows (n, t) of the velocity of the second body relative to the first, `arms` from their centres.
fn rows(bodies: [Option<usize>; 2], arms: [Vec2; 2], n: Vec2) -> Rows {
    let t = Vec2::new(-n.y, n.x);
    let mut rows = Rows {
        bodies: [NO_BODY; 2],
        jacobian: [[Vec3::zeros(); 2]; 2],
    };
    for (side, sign) in [(0, -1.0), (1, 1.0)] {
        if let Some(k) = bodies[side] {
            rows.bodies[side] = k as u32;
            rows.jacobian[side] = [n, t].map(|d| sign * Vec3::new(d.x, d.y, arms[side].perp(&d)));
        }
    }
    rows
}

/// Pairs that may touch, the surface first.
fn pairs(
    bodies: &[PlanarBody],
    pivots: &[Pivot],
    apart: &[[usize; 2]],
) -> Result<Vec<[usize; 2]>, ModelError> {
    let mut pairs = Vec::new();
    for i in 0..bodies.len() {
        for j in i + 1..bodies.len() {
            let tied = pivots
                .iter()
                .any(|p| p.bodies == [Some(i), Some(j)] || p.bodies == [Some(j), Some(i)]);
            let apart = apart.iter().any(|p| *p == [i, j] || *p == [j, i]);
            let still = bodies[i].mass.is_none() && bodies[j].mass.is_none();
            if tied || apart || still {
                continue;
            }
            if !bodies[i].shape.meets(&bodies[j].shape) {
                return Err(ModelError::Unsupported(format!(
                    "bodies {i} and {j}: the gap of {:?} and {:?} is no closed form here",
                    bodies[i].shape, bodies[j].shape
                )));
            }
            pairs.push(if bodies[j].shape.is_surface() {
                [j, i]
            } else {
                [i, j]
            });
        }
    }
    Ok(pairs)
}

impl PlanarBody {
    /// Pose of the body after the prescribed motion of `t` \[s\].
    fn prescribed(&self, t: f64) -> Pose64 {
        let swing = self.oscillation.map_or(Vec2::zeros(), |o| {
            o.amplitude * (o.angular_frequency * t).sin()
        });
        let mut pose = self.pose;
        pose.advance(&self.velocity, Vec2::zeros(), t);
        pose.translation += swing;
        pose
    }
}

impl MultibodyModel for Planar {
    fn begin_step(&mut self, dt: f64) -> Result<(), ModelError> {
        for (k, body) in self.bodies.iter().enumerate() {
            if body.oscillation.is_some() {
                let at = |share: f64| body.prescribed(self.clocks[k] + share * dt).translation;
                let mean = (at(1.5) - at(0.5)) / dt;
                self.velocities[k] = Vec3::new(mean.x, mean.y, body.velocity.z);
            }
        }
        Ok(())
    }

    fn velocities(&self) -> &[Vec3] {
        &self.velocities
    }

    fn set_velocities(&mut self, velocities: &[Vec3]) {
        self.velocities.copy_from_slice(velocities);
    }

    fn inverse_mass(&self) -> &[Vec3] {
        &self.inverse
    }

    fn forces(&self, _time: f64, out: &mut [Vec3]) {
        for (force, body) in out.iter_mut().zip(&self.bodies) {
            if let Some((mass, _)) = body.mass {
                let weight = self.gravity * mass;
                *force = Vec3::new(weight.x, weight.y, 0.0);
            }
        }
    }

    fn shift(&mut self, body: usize, velocity: &Vec3, dt: f64) {
        let own = &self.bodies[body];
        // with an unchanged velocity, a body with a prescribed motion follows that curve
        if own.oscillation.is_some() && *velocity == self.velocities[body] {
            self.clocks[body] += dt;
            self.poses[body] = own.prescribed(self.clocks[body]);
        } else {
            self.poses[body].advance(velocity, Vec2::zeros(), dt);
        }
    }

    fn show(&mut self, shown: &[Shown]) {
        self.shown.fill(None);
        for own in shown {
            let k = own.body as usize;
            let mut pose = self.poses[k];
            pose.advance(&own.displacement, Vec2::zeros(), 1.0);
            self.shown[k] = Some((pose, self.velocities[k] + own.velocity));
        }
    }

    fn configuration(&self, body: usize) -> Configuration {
        let mut numbers = self.poses[body].numbers();
        numbers[4] = self.clocks[body];
        numbers
    }

    fn centre(&self, body: usize) -> Option<Vec2> {
        Some(self.poses[body].translation)
    }

    fn set_configuration(&mut self, body: usize, configuration: &Configuration) {
        self.poses[body] = Pose64::from_numbers(configuration);
        self.clocks[body] = configuration[4];
    }

    fn detect(&mut self, dt: f64, out: &mut Detection) -> Result<(), ModelError> {
        for &pair in &self.pairs {
            let tips = 0..self.tips[pair[1]].len();
            out.contacts
                .extend(tips.filter_map(|feature| self.contact(pair, feature, dt)));
        }
        self.detect_joints(dt, &mut out.joints)
    }

    fn detect_joints(&mut self, _dt: f64, out: &mut Vec<JointRow>) -> Result<(), ModelError> {
        for (k, pivot) in self.pivots.iter().enumerate() {
            let key = |feature| ContactKey {
                pair: u64::MAX - k as u64,
                feature,
            };
            let arms = [0, 1].map(|side| self.arm(pivot.bodies[side], pivot.anchors[side]));
            let [first, second] = [0, 1].map(|side| {
                let centre =
                    pivot.bodies[side].map_or(Vec2::zeros(), |k| self.poses[k].translation);
                centre + arms[side]
            });
            let frames = JointFrames {
                bodies: pivot.bodies.map(|b| b.map_or(NO_BODY, |k| k as u32)),
                arms,
                offset: second - first,
            };
            let name = |part, feature| RowName {
                key: key(feature),
                joint: k as u32,
                part,
            };
            out.push(frames.point().lock(name(JointPart::Pin, 0), 0.0));
            if let Some(motor) = pivot.motor {
                let kind = JointKind::Motor {
                    speed: motor.speed,
                    max_force: motor.max_torque,
                };
                let part = JointPart::Drive(JointCoordinate::Angle);
                out.push(frames.angle(0.0).driven(name(part, 1), kind));
            }
        }
        Ok(())
    }

    fn potential_energy(&self) -> f64 {
        let weight = |(body, pose): (&PlanarBody, &Pose64)| {
            let mass = body.mass.map_or(0.0, |(mass, _)| mass);
            -mass * self.gravity.dot(&pose.translation)
        };
        self.bodies.iter().zip(&self.poses).map(weight).sum()
    }
}
