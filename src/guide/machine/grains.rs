/// Drum and concave, and five grains of 16 mm in each of the two gaps between the lower teeth;
/// gravity and step in `f64`.
pub fn machine() -> (PhysicsWorld, MoreauPipeline, RigidBodyHandle, Vec<RigidBodyHandle>) {
    let mut world = PhysicsWorld::new();
    let drum = RigidBodyBuilder::kinematic_velocity_based();
    let (drum, _) = world.insert(drum, outline(drum_outline()));
    world.insert(RigidBodyBuilder::fixed(), concave());
    let angles = (0..10).map(|k| 238.5 + 4.5 * f64::from(k % 5) + 45.0 * f64::from(k / 5));
    let grains = angles.map(|degrees| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let place = Vector::new((0.2215 * cos) as Real, (0.2215 * sin) as Real);
        let body = RigidBodyBuilder::dynamic().translation(place);
        world.insert(body, ColliderBuilder::ball(0.008).density(100.0)).0
    });
    let grains = grains.collect();
    let settings = MoreauSettings {
        gravity: Some(Vec2::new(0.0, -9.81)),
        dt: Some(5e-4),
        stay_awake: true, // every step counts for the wear
        ..MoreauSettings::default()
    };
    let pipeline = MoreauPipeline::new(settings).unwrap();
    (world, pipeline, drum, grains)
}
