use crate::contact::{NO_BODY, Rows, Vec2, Vec3};
use crate::dynamics::{
    Bend, Configuration, ContactKey, ContactPoint, Detection, JointCoordinate, JointKind,
    JointPart, JointRow, ModelError, MultibodyModel, NormalLaw, SurfacePoint,
};

/// A contact of a rotor: constant levers, gap linear in the angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotorContact {
    /// `γ_N = w_N u`, `γ_T = w_T u` \[m\].
    pub lever: Vec2,
    /// Gap at the reference angle \[m\]; it changes by `w_N` per radian.
    pub gap: f64,
    pub friction: f64,
    pub law: NormalLaw,
    /// Position in the rotor frame \[m\], for the record.
    pub position: Vec2,
}

/// A motor that keeps a rotor's speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotorMotor {
    /// \[rad/s\]
    pub speed: f64,
    /// [N m]
    pub max_torque: f64,
}

/// A body on a fixed axle with one coordinate: `M u̇ = T + m g l_m sin ψ`-like moments and contacts.
///
/// ```text
/// M u̇ = T − G cos θ + Σ (w_N P_N + w_T P_T) / Δt                             (1)
/// ```
///
/// A full planar body on a revolute joint has five unknowns; this model has one, and 26 contacts on
/// it make a contact problem of rank one.
///
/// # Source
/// Glocker & Studer (2005) for the step; the rotor is the thresher study's (section 2 of it).
#[derive(Debug, Clone, PartialEq)]
pub struct Rotor {
    /// Moment of inertia about the axis [kg m²].
    pub inertia: f64,
    /// Applied torque [N m].
    pub torque: f64,
    /// Weight moment `m g l_m` [N m], acting as `−G cos θ`.
    pub weight_moment: f64,
    /// θ \[rad\] and the angle at which the gaps are given.
    pub angle: f64,
    pub reference_angle: f64,
    pub contacts: Vec<RotorContact>,
    pub motor: Option<RotorMotor>,
    velocity: [Vec3; 1],
    inverse: [Vec3; 1],
}

impl Rotor {
    /// A rotor at `angle` \[rad\] turning with `speed` \[rad/s\], free of contacts.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] unless the inertia is finite and positive and the rest finite.
    pub fn new(inertia: f64, angle: f64, speed: f64) -> Result<Rotor, ModelError> {
        if !(inertia > 0.0 && inertia.is_finite()) {
            return Err(ModelError::Invalid(format!(
                "rotor: inertia is {inertia} kg m2, must be finite and above 0"
            )));
        }
        if !angle.is_finite() || !speed.is_finite() {
            return Err(ModelError::Invalid(format!(
                "rotor: angle {angle} rad and speed {speed} rad/s must be finite"
            )));
        }
        Ok(Rotor {
            inertia,
            torque: 0.0,
            weight_moment: 0.0,
            angle,
            reference_angle: angle,
            contacts: Vec::new(),
            motor: None,
            velocity: [Vec3::new(0.0, 0.0, speed)],
            inverse: [Vec3::new(0.0, 0.0, 1.0 / inertia)],
        })
    }

    /// `u` \[rad/s\].
    pub fn speed(&self) -> f64 {
        self.velocity[0].z
    }

    fn rows(lever: Vec2) -> Rows {
        let zero = [Vec3::zeros(); 2];
        Rows {
            bodies: [NO_BODY, 0],
            jacobian: [
                zero,
                [Vec3::new(0.0, 0.0, lever.x), Vec3::new(0.0, 0.0, lever.y)],
            ],
        }
    }
}

impl MultibodyModel for Rotor {
    fn velocities(&self) -> &[Vec3] {
        &self.velocity
    }

    fn set_velocities(&mut self, velocities: &[Vec3]) {
        self.velocity.copy_from_slice(velocities);
    }

    fn inverse_mass(&self) -> &[Vec3] {
        &self.inverse
    }

    fn forces(&self, _time: f64, out: &mut [Vec3]) {
        out[0].z = self.torque - self.weight_moment * self.angle.cos();
    }

    fn shift(&mut self, _body: usize, velocity: &Vec3, dt: f64) {
        self.angle += velocity.z * dt;
    }

    fn configuration(&self, _body: usize) -> Configuration {
        [self.angle, 0.0, 0.0, 0.0, 0.0]
    }

    fn set_configuration(&mut self, _body: usize, configuration: &Configuration) {
        self.angle = configuration[0];
    }

    fn detect(&mut self, dt: f64, out: &mut Detection) -> Result<(), ModelError> {
        let turned = self.angle - self.reference_angle;
        for (i, c) in self.contacts.iter().enumerate() {
            out.contacts.push(ContactPoint {
                key: ContactKey {
                    pair: 0,
                    feature: i as u64,
                },
                rows: Rotor::rows(c.lever),
                bodies: [NO_BODY, 0],
                surfaces: [1, 0],
                places: [0, i as u32].map(SurfacePoint::on),
                position: c.position,
                normal: Vec2::y(),
                gap: c.gap + c.lever.x * turned,
                // the gap is one product and one sum of numbers of this size
                gap_noise: 4.0 * f64::EPSILON * (c.gap.abs() + (c.lever.x * turned).abs()),
                radii: [0.0; 2],
                rolls_on: [0.0; 2],
                friction: c.friction,
                law: c.law,
                surface_velocity: 0.0,
            });
        }
        self.detect_joints(dt, &mut out.joints)
    }

    fn detect_joints(&mut self, _dt: f64, out: &mut Vec<JointRow>) -> Result<(), ModelError> {
        if let Some(motor) = self.motor {
            out.push(JointRow {
                key: ContactKey {
                    pair: 1,
                    feature: 0,
                },
                joint: 0,
                part: JointPart::Drive(JointCoordinate::Angle),
                rows: Rotor::rows(Vec2::new(1.0, 0.0)),
                bend: Bend::Straight,
                kind: JointKind::Motor {
                    speed: motor.speed,
                    max_force: motor.max_torque,
                },
            });
        }
        Ok(())
    }

    fn potential_energy(&self) -> f64 {
        self.weight_moment * self.angle.sin()
    }
}
