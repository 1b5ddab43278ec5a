use moreau2d::rapier::*;
use rapier2d::prelude::*;
#[test]
fn drop_and_slide() {
    for solver in ["auto", "direct", "nsgs"] {
        let mut w = PhysicsWorld::new();
        w.insert(
            RigidBodyBuilder::fixed(),
            ColliderBuilder::cuboid(100.0, 0.5).friction(0.5),
        );
        let (b, _) = w.insert(
            RigidBodyBuilder::dynamic()
                .translation(Vector::new(0.0, 1.0))
                .linvel(Vector::new(5.0, 0.0)),
            ColliderBuilder::cuboid(0.5, 0.5).friction(0.5),
        );
        let mut s = MoreauSettings::default();
        s.stepper.solver = solver.into();
        s.dt = Some(1.0 / 60.0);
        let mut p = MoreauPipeline::new(s).unwrap();
        let mut work = 0.0;
        let mut imb = 0.0f64;
        let mut sw = 0;
        let mut fa = 0;
        for i in 0..120 {
            let r = p.step(&mut w).unwrap();
            work += r.friction_work();
            imb = imb.max(r.energy.imbalance().abs());
            sw += r.sweeps;
            fa += r.factorisations;
            assert_eq!(r.unsolved, 0, "{i} {:?}", r);
        }
        let x = p.pose(b).unwrap();
        let d = 25.0 / (2.0 * 0.5 * 9.81);
        println!(
            "{solver} x {:?} exact {d} rel {:.2e} y-1 {:.2e} work {work} imb {imb:.1e} sweeps {sw} fact {fa}",
            x.translation.x,
            x.translation.x / d - 1.0,
            x.translation.y - 1.0
        );
        // tower
        let mut w = PhysicsWorld::new();
        w.insert(
            RigidBodyBuilder::fixed(),
            ColliderBuilder::cuboid(100.0, 0.5).friction(0.5),
        );
        let mut hs = vec![];
        for k in 0..20 {
            hs.push(
                w.insert(
                    RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 1.0 + k as f32)),
                    ColliderBuilder::cuboid(0.5, 0.5).friction(0.5),
                )
                .0,
            );
        }
        let mut s = MoreauSettings::default();
        s.stepper.solver = solver.into();
        s.dt = Some(1.0 / 60.0);
        let mut p = MoreauPipeline::new(s).unwrap();
        let (mut sw, mut fa, mut un, mut pen) = (0, 0, 0, 0.0f64);
        let t = std::time::Instant::now();
        for _ in 0..120 {
            let r = p.step(&mut w).unwrap();
            sw += r.sweeps;
            fa += r.factorisations;
            un += r.unsolved;
            pen = pen.max(r.penetration);
        }
        println!(
            "{solver} tower sweeps {sw} fact {fa} unsolved {un} pen {pen:.1e} x {:.1e} {:.1} us/step",
            p.pose(hs[19]).unwrap().translation.x,
            t.elapsed().as_secs_f64() / 120.0 * 1e6
        );
    }
}
