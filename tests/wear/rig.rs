//! A pad that wears on a counterface: rapier bodies, contacts of our detection, our wear layer.

use moreau2d::contact::Vec2;
use moreau2d::dynamics::record::{ContactRecord, StepRecord, SurfacePoint};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, SurfaceLaw};
use moreau2d::wear::{
    Archard, JumpRule, LoadSlip, Profile, Update, WearError, WearSettings, WearState,
};

/// Wear coefficient [m²/N], speed of the counterface \[m/s\], step \[s\].
pub const K: f64 = 1e-13;
pub const SPEED: f64 = 1.0;
pub const DT: f64 = 1e-3;
/// Mass of the pad \[kg\] and lever of its weight on a hinge \[m\], exact in single precision.
const MASS: f64 = 0.0625;
pub const LEVER: f64 = 0.03125;
/// A pad is at rest below this part of the speed that its load would give it in a step; the solver's
/// tolerance is 1e-8.
const REST: f64 = 1e-7;

fn vector(p: Vec2) -> Vector {
    Vector::new(p.x as Real, p.y as Real)
}

pub fn part(profile: Profile, k: f64) -> WearState {
    let settings = WearSettings {
        law: Archard { coefficient: k },
        update: Update::Normal,
        smoothing_length: 0.0,
        cycle_seconds: 1.0,
    };
    WearState::new(profile, settings).unwrap()
}

/// A collider of the profile, solid behind it: facing up, or turned over by 180 degrees.
fn shape(profile: &Profile, down: bool) -> SharedShape {
    let sign = if down { -1.0 } else { 1.0 };
    // the solid of a profile is on its right, that of a polyline on its left
    let points = profile.nodes().iter().rev();
    let points = points.map(|p| vector(sign * p)).collect();
    ColliderBuilder::oriented_polyline(points, None)
        .shape
        .clone()
}

/// The place on the profile of a place on its collider.
fn on_profile(place: SurfacePoint, profile: &Profile) -> SurfacePoint {
    SurfacePoint {
        edge: profile.node_count() as u32 - 2 - place.edge,
        at: 1.0 - place.at,
    }
}

/// What holds the pad.
#[derive(Clone, Copy, PartialEq)]
pub enum Guide {
    /// It moves along y alone.
    Straight,
    /// It turns about the origin alone, where its profile begins.
    Hinge,
    /// None: on a surface at rest with friction 0.5 it is pulled aside by a fifth of its load.
    Free,
}

/// A pad under a load on a flat belt, or on a counterface that wears as well.
pub struct Rig {
    world: PhysicsWorld,
    pipeline: MoreauPipeline,
    pad: RigidBodyHandle,
    surface: ColliderHandle,
    face: (RigidBodyHandle, ColliderHandle),
    pub part: WearState,
    pub counterpart: Option<WearState>,
    /// The new area, and what all jumps should have taken from it, `K Σ S` \[m²\].
    area: [f64; 2],
    /// Sliding distance so far \[m\].
    pub slid: f64,
    /// Speed below which the pad is at rest \[m/s\].
    rest: f64,
}

impl Rig {
    /// # Arguments
    /// - `load` \[N\]: on a straight guide down through the pad, on a hinge at the lever from it.
    /// - `modulus` \[Pa/m\] of the foundation.
    /// - `counterface`: its profile and wear coefficient [m²/N], at rest at first; a belt without.
    pub fn new(
        profile: Profile,
        guide: Guide,
        load: f64,
        modulus: f64,
        counterface: Option<(Profile, f64)>,
    ) -> Rig {
        let mut world = PhysicsWorld::new();
        let counterpart = counterface.map(|(profile, k)| part(profile, k));
        let face = match &counterpart {
            None => world.insert(
                RigidBodyBuilder::fixed().translation(Vector::new(0.0, -1.0)),
                ColliderBuilder::cuboid(4.0, 1.0).friction(0.0),
            ),
            Some(face) => world.insert(
                RigidBodyBuilder::kinematic_velocity_based(),
                ColliderBuilder::new(shape(face.profile(), false)).friction(0.0),
            ),
        };
        let centre = match guide {
            Guide::Hinge => vector(Vec2::new(-LEVER, 0.0)),
            Guide::Straight => Vector::ZERO,
            Guide::Free => vector(-0.5 * profile.nodes()[profile.node_count() - 1]),
        };
        let mass = MassProperties::new(centre, MASS as Real, (1e-3 * MASS) as Real);
        let body = RigidBodyBuilder::dynamic().additional_mass_properties(mass);
        let body = match guide {
            Guide::Straight => body.lock_rotations().enabled_translations(false, true),
            _ => body,
        };
        let (friction, aside) = match guide {
            Guide::Free => (1.0, 0.2),
            _ => (0.0, 0.0),
        };
        let collider = ColliderBuilder::new(shape(&profile, true)).friction(friction);
        let (pad, surface) = world.insert(body.can_sleep(false), collider.density(0.0));
        if guide == Guide::Hinge {
            let ground = world.insert_body(RigidBodyBuilder::fixed());
            world.insert_impulse_joint(ground, pad, RevoluteJointBuilder::new());
        }
        let mut pipeline = MoreauPipeline::new(MoreauSettings {
            gravity: Some(Vec2::new(aside, -1.0) * (load / MASS)),
            dt: Some(DT),
            stay_awake: true,
            ..MoreauSettings::default()
        })
        .unwrap();
        let cells = SurfaceLaw {
            compliance: Some((modulus, 0.0)),
            cells: true,
            ..SurfaceLaw::default()
        };
        pipeline.set_surface(surface, cells);
        if counterpart.is_none() && guide != Guide::Free {
            let belt = SurfaceLaw {
                speed: SPEED,
                ..SurfaceLaw::default()
            };
            pipeline.set_surface(face.1, belt);
        }
        let area = profile.area_above(0.0);
        Rig {
            part: part(profile, K),
            world,
            pipeline,
            pad,
            surface,
            face,
            counterpart,
            area: [area, 0.0],
            slid: 0.0,
            rest: REST * load * DT / MASS,
        }
    }

    pub fn step(&mut self) -> StepRecord {
        let record = self.pipeline.step(&mut self.world).unwrap();
        assert_eq!(record.unsolved, 0, "residual {}", record.residual);
        record
    }

    /// Moves the counterface at a speed \[m/s\] along x.
    pub fn drive(&mut self, speed: f64) {
        let face = &mut self.world.bodies[self.face.0];
        face.set_linvel(Vector::new(speed as Real, 0.0), true);
    }

    /// Angle of the pad \[rad\].
    pub fn tilt(&self) -> f64 {
        self.pipeline.pose(self.pad).unwrap().angle()
    }

    /// Adds a step to the sums of the pad and of the counterface.
    pub fn add(&self, record: &StepRecord, [pad, face]: [&mut LoadSlip; 2]) {
        let on = |surface: ColliderHandle, profile: &Profile, contact: &ContactRecord| {
            let place = contact.place_on(surface.into_raw_parts().0)?;
            Some(on_profile(place, profile))
        };
        let all = &record.contacts;
        pad.add(all, |c| on(self.surface, self.part.profile(), c))
            .unwrap();
        if let Some(counterpart) = &self.counterpart {
            face.add(all, |c| on(self.face.1, counterpart.profile(), c))
                .unwrap();
        }
    }

    /// Load and slip of a step on the pad, once it is at rest.
    pub fn cycle(&mut self) -> LoadSlip {
        let mut steps = 0;
        let record = loop {
            let record = self.step();
            steps += 1;
            assert!(steps < 500, "the pad does not come to rest");
            let speed = self.pipeline.velocity(self.pad).unwrap().amax();
            if steps > 2 && speed < self.rest {
                break record;
            }
        };
        let mut sum = LoadSlip::new(self.part.profile().node_count());
        self.add(&record, [&mut sum, &mut LoadSlip::new(0)]);
        sum
    }

    /// One jump of `cycles`, or of as many as `kks` says; returns its depths and `K k S`.
    pub fn jump(&mut self, kks: f64) -> Result<(Vec<f64>, f64), WearError> {
        let sum = self.cycle();
        let feedback = self.part.feedback(sum.stiffness())?;
        self.wear(&sum, kks / feedback).map(|depth| (depth, kks))
    }

    /// One jump over the sliding distance `slip` \[m\] with wear compliance on a foundation of `modulus`
    /// [Pa/m].
    pub fn jump_implicitly(&mut self, modulus: f64, slip: f64) -> Vec<f64> {
        let modulus = self.part.law().worn_modulus(modulus, slip).unwrap();
        let cells = SurfaceLaw {
            compliance: Some((modulus, 0.0)),
            cells: true,
            ..SurfaceLaw::default()
        };
        self.pipeline.set_surface(self.surface, cells);
        let sum = self.cycle();
        self.wear(&sum, slip / (SPEED * DT)).unwrap()
    }

    /// One jump by a rule, with its measured feedback: the depths and `K k S`.
    pub fn jump_by(&mut self, rule: &JumpRule) -> (Vec<f64>, f64) {
        let sum = self.cycle();
        let feedback = self.part.feedback(sum.stiffness()).unwrap();
        let jump = self.part.next_jump(rule, sum.sums(), feedback).unwrap();
        let depth = self.wear(&sum, jump.cycles).unwrap();
        (depth, feedback * jump.cycles)
    }

    fn wear(&mut self, sum: &LoadSlip, cycles: f64) -> Result<Vec<f64>, WearError> {
        let depths = self.part.rates(sum.sums())?;
        let step = self.part.advance(sum.sums(), cycles, 0.0)?;
        self.area[1] += K * cycles * sum.sums().iter().sum::<f64>();
        assert!(!step.remeshed && step.clipped_area == 0.0);
        self.slid += cycles * SPEED * DT;
        self.show();
        Ok(depths.into_iter().map(|h| cycles * h).collect())
    }

    /// Relative difference of the area that is gone to K times all load and slip.
    pub fn area_error(&self) -> f64 {
        let gone = self.area[0] - self.part.profile().area_above(0.0);
        (gone / self.area[1] - 1.0).abs()
    }

    /// Gives both colliders their worn profiles.
    pub fn show(&mut self) {
        let pad = shape(self.part.profile(), true);
        self.world.colliders[self.surface].set_shape(pad);
        if let Some(counterpart) = &self.counterpart {
            let face = shape(counterpart.profile(), false);
            self.world.colliders[self.face.1].set_shape(face);
        }
    }
}
