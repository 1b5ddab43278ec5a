use moreau2d::scene;
fn main() {
    let scene = scene::load(
        "/tmp/drum.toml",
        &["restitution=0.0".into(), "step.events=true".into()],
    )
    .unwrap();
    let mut b = scene.build().unwrap();
    let mut shown = 0;
    for k in 0..750 {
        let r = b.simulation.step().unwrap();
        if r.penetration > 1e-5 || r.penetration_impact > 1e-5 {
            println!(
                "step {k} t {:.4} pen {:.2e} pen_impact {:.2e} events {} islands {} contacts {}",
                r.time,
                r.penetration,
                r.penetration_impact,
                r.events,
                r.islands,
                r.contacts.len()
            );
            for c in &r.contacts {
                if c.gap < -1e-5 {
                    println!(
                        "    t {:.6} {:?} s {:?} gap {:.2e} P {:.2e} {:?} n {:?}",
                        c.time,
                        c.bodies,
                        c.surfaces,
                        c.gap,
                        c.impulse_n,
                        c.status,
                        (c.normal.x, c.normal.y)
                    );
                }
            }
            shown += 1;
            if shown > 12 {
                break;
            }
        }
    }
}
