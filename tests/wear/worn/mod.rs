//! Wear of the colliders of a user's own world: closed forms, both sides of a contact, balls, rollers,
//! masses, sleep, and what is refused.

mod refused;
mod rings;

use moreau2d::contact::Vec2;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, SurfaceLaw};
use moreau2d::wear::JumpRule;
use moreau2d::worn::{Jumped, WearingSurface, WornColliders, WornError};

const K: f64 = 1e-13;
const SPEED: f64 = 0.5;
const DT: f64 = 1e-3;
/// Load on a pin \[N\], by its mass \[kg\].
const LOAD: f64 = 1e4;
const MASS: f64 = 1000.0;

fn at(x: f64, y: f64) -> Vector {
    Vector::new(x as Real, y as Real)
}

fn rule(depth: f64) -> JumpRule {
    JumpRule {
        cycles: 1e9,
        depth,
        stability: 1.0,
    }
}

/// The lower face of a box that wears, in cells of this length \[m\].
fn foot(cell: Option<f64>) -> WearingSurface {
    WearingSurface {
        edges: Some([0, 0]),
        cell,
        ..WearingSurface::new(K)
    }
}

/// A world with a disc whose face is y = 0, and a loaded pin on it.
struct Stand {
    world: PhysicsWorld,
    pipeline: MoreauPipeline,
    worn: WornColliders,
    body: RigidBodyHandle,
    pin: ColliderHandle,
    disc: ColliderHandle,
}

impl Stand {
    /// A pin that moves along y alone, its lowest point at `foot` below its origin, on a belt, or on a
    /// body that moves.
    fn new(
        pin: ColliderBuilder,
        foot: f64,
        disc: ColliderBuilder,
        depth: f64,
        belt: bool,
    ) -> Stand {
        let mut world = PhysicsWorld::new();
        let under = match belt {
            true => RigidBodyBuilder::fixed(),
            false => RigidBodyBuilder::kinematic_velocity_based().linvel(at(SPEED, 0.0)),
        };
        let (_, disc) = world.insert(under, disc.friction(0.0));
        let mass = MassProperties::new(Vector::ZERO, MASS as Real, 1.0);
        let body = RigidBodyBuilder::dynamic().additional_mass_properties(mass);
        let body = body.lock_rotations().enabled_translations(false, true);
        let body = body.translation(at(0.0, foot));
        let (body, pin) = world.insert(body, pin.density(0.0).friction(0.0));
        let pipeline = MoreauPipeline::new(MoreauSettings {
            gravity: Some(Vec2::new(0.0, -LOAD / MASS)),
            dt: Some(DT),
            ..MoreauSettings::default()
        });
        let mut pipeline = pipeline.unwrap();
        if belt {
            let law = SurfaceLaw {
                speed: -SPEED,
                ..SurfaceLaw::default()
            };
            pipeline.set_surface(disc, law);
        }
        Stand {
            world,
            pipeline,
            worn: WornColliders::new(rule(depth)),
            body,
            pin,
            disc,
        }
    }

    /// A pin of 10 mm by 40 mm on a flat face.
    fn flat(depth: f64) -> Stand {
        let face = ColliderBuilder::cuboid(4.0, 0.5).translation(at(0.0, -0.5));
        Stand::new(
            ColliderBuilder::cuboid(0.005, 0.02),
            0.02,
            face,
            depth,
            true,
        )
    }

    fn add(&mut self, collider: ColliderHandle, surface: WearingSurface) -> usize {
        let (world, pipeline) = (&mut self.world, &mut self.pipeline);
        self.worn.add(world, pipeline, collider, surface).unwrap()
    }

    fn yielding(&mut self, collider: ColliderHandle, modulus: f64) {
        let law = SurfaceLaw {
            compliance: Some((modulus, 0.0)),
            ..SurfaceLaw::default()
        };
        self.pipeline.set_surface(collider, law);
    }

    /// Settles over `steps`, measures one and jumps.
    fn jump(&mut self, steps: usize, until: f64) -> Result<Jumped, WornError> {
        let (world, pipeline) = (&mut self.world, &mut self.pipeline);
        for _ in 0..steps {
            let record = pipeline.step(world).unwrap();
            assert_eq!(record.unsolved, 0, "residual {}", record.residual);
        }
        let record = pipeline.step(world).unwrap();
        self.worn.measure(&record)?;
        self.worn.jump(world, pipeline, until)
    }

    /// Jumps until so many seconds of wear; returns the number of jumps.
    fn run(&mut self, steps: usize, seconds: f64) -> usize {
        let mut jumps = 0;
        while self.worn.seconds() < seconds {
            let jumped = self.jump(steps, seconds).unwrap();
            jumps += 1;
            assert!(jumped.open_load < 1e-3, "{jumped:?}");
            assert!(jumps < 1000);
        }
        jumps
    }

    /// Worn area of a surface \[m²\].
    fn area(&self, surface: usize) -> f64 {
        self.worn.state(surface).life().last().volume.iter().sum()
    }
}

/// `h = K F s / A`, end nodes and all, on a compliant and on a rigid face.
#[test]
fn a_pin_wears_by_its_closed_form() {
    let seconds = 1e5;
    let depth = K * LOAD * SPEED * seconds / 0.01;
    for modulus in [Some(1e11), None] {
        let mut stand = Stand::flat(5e-4);
        let pin = stand.pin;
        if let Some(modulus) = modulus {
            stand.yielding(pin, modulus);
        }
        stand.add(pin, foot(Some(1e-3)));
        let jumps = stand.run(200, seconds);
        let found = stand.worn.state(0).depth();
        assert_eq!(found.len(), 11);
        let worst = found.iter().map(|h| (h / depth - 1.0).abs());
        let worst = worst.fold(0.0, f64::max);
        println!("{modulus:?}: {jumps} jumps, {worst:.1e}");
        // single precision of the corners, 1e-9 m, over the depth of a jump
        assert!(worst < 1e-4, "{modulus:?}: {worst}");
        let whole = stand.area(0) / (K * LOAD * SPEED * seconds);
        assert!((whole - 1.0).abs() < 1e-6, "{whole}");
    }
}

/// A jump of twenty seconds wears what twenty seconds do of which each is measured and worn by itself, for a
/// twentieth of the steps.
#[test]
fn a_jump_wears_what_its_seconds_wear() {
    let seconds = 100.0;
    let [reduced, full] = [1, 20].map(|jumps| {
        let mut stand = Stand::flat(1.0);
        let pin = stand.pin;
        stand.yielding(pin, 1e11);
        stand.add(pin, foot(Some(1e-3)));
        for k in 1..=jumps {
            let until = seconds * f64::from(k) / f64::from(jumps);
            let jumped = stand.jump(200, until).unwrap();
            assert!((jumped.seconds - seconds / f64::from(jumps)).abs() < 1e-6);
        }
        stand.worn.state(0).depth().to_vec()
    });
    let apart = reduced.iter().zip(&full).map(|(a, b)| (a - b).abs());
    let apart = apart.fold(0.0, f64::max);
    println!("{apart:e} m of {:e} m", full[0]);
    assert!(apart <= 1e-9, "{apart:e} m");
    assert!(full[0] > 1e-6, "{:e} m", full[0]);
}

/// Both sides, each by its own coefficient: the areas are as the coefficients, whatever the load.
#[test]
fn both_sides_of_a_contact_wear() {
    for modulus in [Some(1e11), None] {
        let x = |k: i32| at(0.05 - 2e-3 * f64::from(k), 0.0);
        let line: Vec<Vector> = (0..=50).map(x).collect();
        let face = ColliderBuilder::oriented_polyline(line, None);
        let pin = ColliderBuilder::cuboid(0.005, 0.02);
        let mut stand = Stand::new(pin, 0.02, face, 1e-5, false);
        let (pin, disc) = (stand.pin, stand.disc);
        if let Some(modulus) = modulus {
            stand.yielding(pin, modulus);
        }
        let one = stand.add(pin, foot(Some(1e-3)));
        let two = stand.add(disc, WearingSurface::new(0.25 * K));
        // the disc moves by 30 mm below the pin in every cycle, and wears as far
        while stand.worn.seconds() < 5e2 {
            let (world, pipeline) = (&mut stand.world, &mut stand.pipeline);
            let body = world.colliders[disc].parent().unwrap();
            world.bodies[body].set_translation(at(-0.015, 0.0), true);
            for _ in 0..60 {
                let record = pipeline.step(world).unwrap();
                assert_eq!(record.unsolved, 0, "residual {}", record.residual);
                stand.worn.measure(&record).unwrap();
            }
            stand.worn.jump(world, pipeline, 5e2).unwrap();
        }
        let (a, b) = (stand.area(one), stand.area(two));
        println!("{modulus:?}: {a} {b}");
        // what both lose is K times the same load and slip
        assert!((b / a / 0.25 - 1.0).abs() < 1e-12, "{modulus:?}: {a} {b}");
        // the pin rides over what it wore itself: its load is F on average
        let expected = K * LOAD * SPEED * 5e2;
        assert!(
            (a / expected - 1.0).abs() < 0.02,
            "{modulus:?}: {a} {expected}"
        );
    }
}

/// A ball that slides gets a flat: `R² (φ − sin φ cos φ) = K F s`, which an even radius cannot have.
#[test]
fn a_ball_that_slides_gets_a_flat() {
    let radius = 0.02;
    let face = ColliderBuilder::cuboid(4.0, 0.5).translation(at(0.0, -0.5));
    let mut stand = Stand::new(
        ColliderBuilder::ball(radius as Real),
        radius,
        face,
        2e-5,
        true,
    );
    let pin = stand.pin;
    let surface = WearingSurface {
        cell: Some(5e-4),
        ..WearingSurface::new(K)
    };
    stand.add(pin, surface);
    let half = 0.2_f64;
    let area = radius * radius * (half - half.sin() * half.cos());
    stand.run(200, area / (K * LOAD * SPEED));
    let heights = |fold: fn(f64, f64) -> f64| {
        let outline = stand.worn.outline(0);
        outline.points.iter().map(|p| p.y).fold(0.0, fold)
    };
    let lowest = heights(f64::min);
    let depth = radius * (1.0 - half.cos());
    let error = (radius + lowest) / depth - 1.0;
    println!("flat: {error:.1e}");
    assert!(error.abs() < 0.02, "{error}");
    let whole = stand.area(0) / area - 1.0;
    println!("flat: area {whole:.1e}");
    // cells are pressed along their own normals, up to 0.2 rad from the load: half the mean square
    assert!(whole.abs() < 0.01, "{whole}");
    // what was not touched is as it was
    let top = heights(f64::max);
    assert!((top - radius).abs() < 1e-12, "{top}");
}

/// A roller that turns under a shoe wears evenly round, through its first node as well.
#[test]
fn a_roller_wears_evenly_round() {
    let mut world = PhysicsWorld::new();
    let turn = std::f64::consts::TAU / 0.2;
    let roller = RigidBodyBuilder::kinematic_velocity_based().angvel(turn as Real);
    let (_, roller) = world.insert(roller, ColliderBuilder::ball(0.02).friction(0.0));
    // so light that it follows the corners of the roller
    let mass = MassProperties::new(Vector::ZERO, 1.0, 1.0);
    let shoe = RigidBodyBuilder::dynamic().additional_mass_properties(mass);
    let shoe = shoe.lock_rotations().enabled_translations(false, true);
    let shoe = shoe.translation(at(0.0, 0.03));
    let flat = ColliderBuilder::cuboid(0.02, 0.01)
        .density(0.0)
        .friction(0.0);
    world.insert(shoe, flat);
    let mut pipeline = MoreauPipeline::new(MoreauSettings {
        gravity: Some(Vec2::new(0.0, -LOAD)),
        dt: Some(1e-4),
        ..MoreauSettings::default()
    })
    .unwrap();
    let law = SurfaceLaw {
        compliance: Some((1e11, 1e5)),
        ..SurfaceLaw::default()
    };
    pipeline.set_surface(roller, law);
    let mut worn = WornColliders::new(rule(2e-5));
    let surface = WearingSurface {
        cell: Some(2e-3),
        ..WearingSurface::new(K)
    };
    worn.add(&mut world, &mut pipeline, roller, surface)
        .unwrap();
    for _ in 0..4 {
        for step in 0..3000 {
            let record = pipeline.step(&mut world).unwrap();
            if step >= 1000 {
                worn.measure(&record).unwrap();
            }
        }
        let jumped = worn.jump(&mut world, &mut pipeline, 1e9).unwrap();
        assert!(jumped.seconds > 0.0 && !jumped.compliance);
    }
    let depth = worn.state(0).depth();
    let mean = depth.iter().sum::<f64>() / depth.len() as f64;
    let most = depth
        .iter()
        .map(|h| (h / mean - 1.0).abs())
        .fold(0.0, f64::max);
    println!("roller: {most:.1e} of {mean:.1e} m, {} cells", depth.len());
    assert!(most < 0.1, "{most}: {depth:?}");
}

/// On request the body loses the mass of what is gone, and its centre of mass moves.
#[test]
fn the_mass_goes_with_the_material() {
    let mut stand = Stand::flat(5e-4);
    let pin = stand.pin;
    let surface = WearingSurface {
        density: Some(1e6),
        ..foot(None)
    };
    stand.add(pin, surface);
    stand.run(200, 5e4);
    let gone = 1e6 * stand.area(0);
    let local = stand.world.bodies[stand.body]
        .mass_properties()
        .local_mprops;
    // rapier's single precision
    assert!(
        (f64::from(local.mass()) - (MASS - gone)).abs() < 1e-4,
        "{gone}"
    );
    let up = f64::from(local.local_com.y);
    let expected = gone * 0.019 / (MASS - gone);
    assert!((up / expected - 1.0).abs() < 0.1, "{up} {expected}");
    // without the request nothing changes
    let mut other = Stand::flat(5e-4);
    let pin = other.pin;
    other.add(pin, foot(None));
    other.run(200, 5e4);
    let whole = other.world.bodies[other.body].mass();
    assert!((f64::from(whole) - MASS).abs() < 1e-4, "{whole}");
}

/// A pin at rest on a belt falls asleep, and would wear by nothing for ever.
#[test]
fn nothing_that_wears_falls_asleep() {
    for wears in [false, true] {
        let mut stand = Stand::flat(5e-4);
        let pin = stand.pin;
        if wears {
            stand.add(pin, foot(None));
        }
        let mut slid = 0.0;
        for step in 0..5000 {
            let record = stand.pipeline.step(&mut stand.world).unwrap();
            if step > 4900 {
                slid += record.contacts.iter().map(|c| c.load_slip).sum::<f64>();
            }
        }
        assert_eq!(slid > 0.0, wears, "{slid}");
    }
}

/// Bug: a bowl whose ends are steep against its chord was refused: "the next edge leads on and must wear as
/// well", where there is none. An end without a next edge wears along its own normal.
#[test]
fn a_steep_bowl_wears_to_its_free_ends() {
    let mut world = PhysicsWorld::new();
    let bowl = [
        (0.2, 0.3),
        (0.1, 0.05),
        (0.0, 0.0),
        (-0.1, 0.05),
        (-0.2, 0.3),
    ];
    let bowl = bowl.map(|(x, y)| at(x, y)).to_vec();
    let bowl = ColliderBuilder::oriented_polyline(bowl, None);
    let (_, bowl) = world.insert(RigidBodyBuilder::fixed(), bowl);
    let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
    let mut worn = WornColliders::new(rule(1e-3));
    let all = WearingSurface::new(K);
    worn.add(&mut world, &mut pipeline, bowl, all).unwrap();
    let nodes = worn.state(0).profile().node_count();
    let load: Vec<f64> = worn.state(0).profile().widths();
    let mut state = worn.state(0).clone();
    let step = state.advance(&load, 1e-3 / K, 0.0).unwrap();
    assert!(nodes > 5 && step.clipped_area.abs() < 1e-12, "{step:?}");
    for h in state.depth() {
        assert!((h / 1e-3 - 1.0).abs() < 1e-9, "{h}");
    }
}
