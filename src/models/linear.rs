use crate::contact::{NO_BODY, Rows, Vec2, Vec3};
use crate::dynamics::{
    Configuration, ContactKey, ContactPoint, Detection, JointRow, ModelError, MultibodyModel,
    NormalLaw, SurfacePoint,
};
use nalgebra::Matrix3;

/// Constant mass, stiffness and load in one to three coordinates; entries beyond the coordinates
/// are ignored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearSystem {
    /// Number of coordinates, 1 to 3.
    pub coordinates: usize,
    /// `M`, symmetric and positive definite, and `K`, symmetric.
    pub mass: Matrix3<f64>,
    pub stiffness: Matrix3<f64>,
    /// `f`, in the coordinates' own units of force.
    pub load: Vec3,
}

/// A contact with constant levers, its gap linear in the coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearContact {
    /// `γ_N = w_N·q̇`, `γ_T = w_T·q̇`.
    pub normal: Vec3,
    pub tangent: Vec3,
    /// Gap \[m\] at q = 0: `g = gap + w_N·q`.
    pub gap: f64,
    pub friction: f64,
    pub restitution: f64,
}

/// A mechanism linearised about a configuration: constant matrices, constant levers.
///
/// ```text
/// M q̈ + K q = f + Σ (w_N P_N + w_T P_T)/Δt                                   (1)
/// ```
///
/// The stepper supports only diagonal mass matrices. With the Cholesky factor `M = L Lᵀ` the
/// velocity `u = Lᵀ q̇` has unit mass, `T = ½ q̇ᵀ M q̇ = ½ uᵀ u`, and (1) becomes
///
/// ```text
/// u̇ = L⁻¹ (f − K q) + Σ L⁻¹ (w_N P_N + w_T P_T)/Δt,   γ = (L⁻¹ w)ᵀ u,   q̇ = L⁻ᵀ u   (2)
/// ```
///
/// [`super::Rotor`] is not a special case of it: the moment of its weight depends on cos θ, and it
/// has a motor.
///
/// # Source
/// Golub & Van Loan, *Matrix Computations*, section 4.2; Glocker & Studer (2005) for the rows.
#[derive(Debug, Clone)]
pub struct Linear {
    system: LinearSystem,
    contacts: Vec<LinearContact>,
    position: Vec3,
    /// `u`, and 1 for every coordinate in use.
    velocity: [Vec3; 1],
    inverse: [Vec3; 1],
    /// `L⁻¹`
    factor: Matrix3<f64>,
}

impl Linear {
    /// Position `q`, and `u`, of which `q̇` is made.
    pub fn state(&self) -> [Vec3; 2] {
        [self.position, self.velocity[0]]
    }

    /// Goes on from a state.
    pub fn set_state(&mut self, [position, velocity]: [Vec3; 2]) {
        (self.position, self.velocity) = (position, [velocity]);
    }

    /// The system at `position` with `velocity` `q̇`.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] unless there are one to three coordinates and `M` is symmetric and
    /// positive definite, `K` symmetric, all finite.
    pub fn new(
        system: LinearSystem,
        contacts: Vec<LinearContact>,
        position: Vec3,
        velocity: Vec3,
    ) -> Result<Linear, ModelError> {
        let invalid = |what: &str| ModelError::Invalid(format!("linear model: {what}"));
        let n = system.coordinates;
        if !(1..=3).contains(&n) {
            return Err(invalid("one to three coordinates"));
        }
        let part = |v: Vec3| Vec3::from_fn(|i, _| if i < n { v[i] } else { 0.0 });
        let square = |m: Matrix3<f64>, rest: f64| {
            Matrix3::from_fn(|i, j| match (i < n && j < n, i == j) {
                (true, _) => m[(i, j)],
                (false, true) => rest,
                (false, false) => 0.0,
            })
        };
        let system = LinearSystem {
            coordinates: n,
            mass: square(system.mass, 1.0),
            stiffness: square(system.stiffness, 0.0),
            load: part(system.load),
        };
        let symmetric = |m: &Matrix3<f64>| *m == m.transpose();
        if !symmetric(&system.mass) || !symmetric(&system.stiffness) {
            return Err(invalid("mass and stiffness must be symmetric"));
        }
        let finite = [system.load, position, velocity]
            .iter()
            .chain(contacts.iter().flat_map(|c| [&c.normal, &c.tangent]))
            .all(|v| v.iter().all(|x| x.is_finite()));
        if !finite || system.stiffness.iter().any(|x| !x.is_finite()) {
            return Err(invalid("every number must be finite"));
        }
        let factor = system
            .mass
            .cholesky()
            .and_then(|c| c.l().try_inverse())
            .filter(|l| l.iter().all(|x| x.is_finite()))
            .ok_or_else(|| invalid("the mass matrix must be positive definite"))?;
        let contacts = contacts
            .into_iter()
            .map(|c| LinearContact {
                normal: part(c.normal),
                tangent: part(c.tangent),
                ..c
            })
            .collect();
        let position = part(position);
        let mut linear = Linear {
            system,
            contacts,
            position,
            velocity: [Vec3::zeros()],
            inverse: [part(Vec3::repeat(1.0))],
            factor,
        };
        // u = Lᵀ q̇ solves L⁻ᵀ u = q̇
        if let Some(transposed) = factor.transpose().try_inverse() {
            linear.velocity = [transposed * part(velocity)];
        }
        Ok(linear)
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.system.coordinates
    }

    /// `q`; zeros beyond the coordinates.
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// `q̇`; zeros beyond the coordinates.
    pub fn velocity(&self) -> Vec3 {
        self.factor.tr_mul(&self.velocity[0])
    }
}

impl MultibodyModel for Linear {
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
        out[0] = self.factor * (self.system.load - self.system.stiffness * self.position);
    }

    fn shift(&mut self, _body: usize, velocity: &Vec3, dt: f64) {
        self.position += self.factor.tr_mul(velocity) * dt;
    }

    fn configuration(&self, _body: usize) -> Configuration {
        let q = self.position;
        [q.x, q.y, q.z, 0.0, 0.0]
    }

    fn set_configuration(&mut self, _body: usize, [x, y, z, _, _]: &Configuration) {
        self.position = Vec3::new(*x, *y, *z);
    }

    fn detect(&mut self, _dt: f64, out: &mut Detection) -> Result<(), ModelError> {
        for (i, c) in self.contacts.iter().enumerate() {
            let terms = c.normal.component_mul(&self.position);
            out.contacts.push(ContactPoint {
                key: ContactKey {
                    pair: 0,
                    feature: i as u64,
                },
                rows: Rows {
                    bodies: [NO_BODY, 0],
                    jacobian: [
                        [Vec3::zeros(); 2],
                        [self.factor * c.normal, self.factor * c.tangent],
                    ],
                },
                bodies: [NO_BODY, 0],
                surfaces: [1, 0],
                places: [0, i as u32].map(SurfacePoint::on),
                // the model knows levers, not positions
                position: Vec2::zeros(),
                normal: Vec2::y(),
                gap: c.gap + terms.sum(),
                // rounding of one sum of numbers of this size
                gap_noise: 4.0 * f64::EPSILON * (c.gap.abs() + terms.abs().sum()),
                radii: [0.0; 2],
                rolls_on: [0.0; 2],
                friction: c.friction,
                law: NormalLaw::Rigid {
                    restitution: c.restitution,
                },
                surface_velocity: 0.0,
            });
        }
        Ok(())
    }

    fn detect_joints(&mut self, _dt: f64, _out: &mut Vec<JointRow>) -> Result<(), ModelError> {
        Ok(())
    }

    fn potential_energy(&self) -> f64 {
        let q = &self.position;
        0.5 * q.dot(&(self.system.stiffness * q)) - self.system.load.dot(q)
    }
}
