#[path = "../tests/common/mod.rs"]
mod common;
use common::*;
fn main() {
    let mut text =
        "[scene]\nname = \"pile\"\ntitle = \"Sixteen boxes\"\n[step]\ntime = 2\nevents=true\n\
                    [[material]]\nname = \"m\"\nfriction = 0\nrestitution = 1\n"
            .to_owned();
    let walls = [(6, 2, 2, -1), (2, 10, -1, 3), (2, 10, 5, 3), (6, 2, 2, 6)];
    for (k, (w, h, x, y)) in walls.into_iter().enumerate() {
        text.push_str(&format!(
            "[[body]]\nname = \"w{k}\"\nkind = \"fixed\"\nbox = [{w}, {h}]\n\
             position = [{x}, {y}]\n"
        ));
    }
    let mut random = common::Random(12345);
    for k in 0..16 {
        let u = [(); 4].map(|()| random.between(-1.0, 1.0));
        text.push_str(&format!(
            "[[body]]\nname = \"b{k}\"\nbox = [0.5, 0.3]\nmass = 1\n\
             position = [{:?}, {:?}]\nangle = {:?}\nvelocity = [{:?}, {:?}]\nspin = {:?}\n",
            0.5 + 0.95 * (k % 4) as f64,
            0.6 + 0.9 * (k / 4) as f64,
            1.5 * u[0],
            2.0 * u[1],
            2.0 * u[2],
            3.0 * u[3]
        ));
    }
    let r = run(&parse(&text));
    let mut last = r.totals.energy_start;
    for (i, rec) in r.records.iter().enumerate() {
        let e = rec.energy.kinetic_end + rec.energy.potential_end;
        if e - last < -1e-6 {
            println!(
                "step {i} t {} dE {} events {} capped {}",
                rec.time,
                e - last,
                rec.events,
                rec.capped
            );
            for c in &rec.contacts {
                println!(
                    "   t {:.6} {:?} gap {:.2e} P {:.3} work {:.4} {:?}",
                    c.time, c.bodies, c.gap, c.impulse_n, c.normal_work, c.status
                );
            }
        }
        last = e;
    }
}
