use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{ExactBody, MoreauPipeline, MoreauSettings, SurfaceLaw};
use moreau2d::wear::JumpRule;
use moreau2d::worn::{WearingSurface, WornColliders};

fn pin_on_disc(duration: f64) -> Result<WornColliders, Box<dyn std::error::Error>> {
    let mut world = PhysicsWorld::new();
    let (_, disc) = world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(0.5, 0.05));
    let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.07));
    let (body, pin) = world.insert(body, ColliderBuilder::cuboid(0.005, 0.02));
    let ground = world.insert_body(RigidBodyBuilder::fixed());
    let guide = PrismaticJointBuilder::new(Vector::Y).local_anchor2(Vector::new(0.0, -0.07));
    world.insert_impulse_joint(ground, body, guide);
    let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
    pipeline.set_exact_mass(body, ExactBody { mass: 0.4, inertia: 1e-4 })?;
    pipeline.set_surface(disc, SurfaceLaw { speed: -0.5, ..SurfaceLaw::default() });

    let rule = JumpRule { cycles: duration, depth: 2e-4, ..JumpRule::default() };
    let mut worn = WornColliders::new(rule);
    let lower = WearingSurface { edges: Some([0, 0]), ..WearingSurface::new(1e-12) };
    worn.add(&mut world, &mut pipeline, pin, lower)?;
    while worn.seconds() < duration {
        for _ in 0..60 {
            pipeline.step(&mut world)?; // comes down on the new surface
        }
        for _ in 0..60 {
            worn.measure(&pipeline.step(&mut world)?)?; // one cycle
        }
        worn.jump(&mut world, &mut pipeline, duration)?;
    }
    Ok(worn)
}
