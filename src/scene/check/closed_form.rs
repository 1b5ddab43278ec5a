//! Checks that a scene is the one that its closed form describes.
//!
//! A closed form finds its bodies by name and takes their shapes, masses and start from the scene.
//! What it takes for granted is stated here: a run of any other scene would be compared with the
//! wrong numbers.

use super::At;
use crate::scene::document::Document;
use crate::scene::{Body, BodyKind, ClosedForm, JointKind, Scene, SceneError, Shape};

/// Two numbers of a file that ought to be equal may differ by their last digits.
const SAME: f64 = 1e-9;

/// Checks a scene against its closed form, if it names one.
///
/// # Errors
/// [`SceneError::Conflict`] at `reference.closed_form`, with what does not fit.
pub(in crate::scene) fn closed_form(scene: &Scene, document: &Document) -> Result<(), SceneError> {
    let Some(form) = scene.reference else {
        return Ok(());
    };
    fits(&Of(scene), form).map_err(|what| {
        let at = At::top(document).key("reference").key("closed_form");
        at.conflict(format!(
            "does not fit the scene: {what}; with `none` the scene runs without errors against \
             a closed form"
        ))
    })
}

fn fits(of: &Of<'_>, form: ClosedForm) -> Result<(), String> {
    use ClosedForm::*;
    match form {
        None => Ok(()),
        SlidingBlock | Incline | SpinningDisc | Conveyor => slides(of, form),
        BouncingBall | TwoBalls | Cradle | TouchingBalls | ElasticGas => impacts(of, form),
        Beam | ThreeDiscs | Ladder | BlockOnSlope => supports(of, form),
        Wedge | Arch | Capstan => structures(of, form),
        RockingBlock | Pendulum | StuckRod | FallingRod | Painleve | Bowl | RidingDisc
        | Woodpecker => motions(of, form),
    }
}

/// Blocks and discs that slide.
fn slides(of: &Of<'_>, form: ClosedForm) -> Result<(), String> {
    use ClosedForm::*;
    match form {
        SlidingBlock => {
            let [floor, block] = of.bodies(["floor", "block"])?;
            of.falls(block)?;
            of.rough(floor, block)?;
            say(block.velocity[0] != 0.0, "body block does not move along x")?;
            upright(block)
        }
        Incline => {
            let [_, block] = of.bodies(["floor", "block"])?;
            of.drops(block)?;
            at_rest(block)
        }
        SpinningDisc => {
            let [floor, disc] = of.bodies(["floor", "disc"])?;
            let radius = radius(disc)?;
            of.falls(disc)?;
            of.rough(floor, disc)?;
            let slip = disc.velocity[0] + disc.spin * radius;
            say(slip > 0.0, "body disc does not slip towards +x")
        }
        Conveyor => {
            let [belt, block] = of.bodies(["belt", "block"])?;
            of.falls(block)?;
            of.rough(belt, block)?;
            say(
                belt.surface_velocity != 0.0,
                "body belt has no surface_velocity",
            )?;
            at_rest(block)
        }
        _ => Ok(()),
    }
}

/// Bounces and impacts.
fn impacts(of: &Of<'_>, form: ClosedForm) -> Result<(), String> {
    use ClosedForm::*;
    match form {
        BouncingBall => {
            let [floor, ball] = of.bodies(["floor", "ball"])?;
            let top = floor.position[1] + 0.5 * height(floor)? + radius(ball)?;
            of.falls(ball)?;
            at_rest(ball)?;
            say(floor.angle == 0.0, "body floor is not level")?;
            say(ball.position[1] > top, "body ball is not above the floor")
        }
        TwoBalls => {
            let [striker, target] = of.bodies(["striker", "target"])?;
            of.dynamic(&[striker, target])?;
            of.weightless()?;
            moves(striker)?;
            at_rest(target)
        }
        Cradle | TouchingBalls => {
            let [striker] = of.bodies(["striker"])?;
            of.weightless()?;
            moves(striker)?;
            for ball in of.0.bodies.iter().filter(|b| b.name != "striker") {
                radius(ball)?;
                at_rest(ball)?;
                let equal = ball.mass == striker.mass && ball.shape == striker.shape;
                say(
                    equal,
                    format!("body {} is not equal to the striker", ball.name),
                )?;
            }
            let elastic = of.0.materials.iter().all(|m| m.restitution == 1.0);
            say(form == TouchingBalls || elastic, "a restitution is not 1")
        }
        ElasticGas => {
            let ideal = |m: &crate::scene::Material| m.restitution == 1.0 && m.friction == 0.0;
            say(
                of.0.materials.iter().all(ideal),
                "a material has friction or loses energy",
            )?;
            of.weightless()
        }
        _ => Ok(()),
    }
}

/// Bodies on supports.
fn supports(of: &Of<'_>, form: ClosedForm) -> Result<(), String> {
    use ClosedForm::*;
    match form {
        Beam => {
            let [left, right, beam, load] = of.bodies(["left", "right", "beam", "load"])?;
            of.dynamic(&[beam, load])?;
            of.falls(load)?;
            height(beam)?;
            let x = [left, load, right].map(|b| b.position[0]);
            say(x.is_sorted(), "body load is not between left and right")
        }
        ThreeDiscs => {
            let discs = of.bodies(["left", "right", "top"])?;
            let [left, right, top] = discs;
            of.dynamic(&discs)?;
            of.falls(top)?;
            let r = radius(top)?;
            let equal = |b: &Body| b.mass == top.mass && b.shape == top.shape;
            say(equal(left) && equal(right), "the discs are not equal")?;
            let apart = right.position[0] - left.position[0];
            say(
                apart > 2.0 * r && apart < 4.0 * r,
                "the lower discs touch, or are too far apart",
            )
        }
        Ladder => {
            let [wall, ladder] = of.bodies(["wall", "ladder"])?;
            of.bodies(["floor"])?;
            of.falls(ladder)?;
            let smooth = of.friction(wall, ladder) == 0.0;
            say(smooth, "the wall has friction")?;
            say(
                matches!(ladder.shape, Shape::Capsule { .. }),
                "body ladder is not a capsule",
            )
        }
        BlockOnSlope => {
            let [_, block] = of.bodies(["floor", "block"])?;
            height(block)?;
            of.drops(block)?;
            say(of.0.gravity[0] >= 0.0, "the slope does not fall towards +x")?;
            at_rest(block)
        }
        _ => Ok(()),
    }
}

/// Assemblies of many bodies, and what is squeezed.
fn structures(of: &Of<'_>, form: ClosedForm) -> Result<(), String> {
    use ClosedForm::*;
    match form {
        Wedge => {
            let [floor, wedge, lid] = of.bodies(["floor", "wedge", "lid"])?;
            let same = of.friction(floor, wedge) == of.friction(wedge, lid);
            say(same, "the wedge's two faces differ in friction")?;
            of.falls(lid)
        }
        Arch => {
            let stones =
                of.0.bodies
                    .iter()
                    .filter(|b| b.name.starts_with("voussoir["));
            let mut count = 0;
            for stone in stones {
                count += 1;
                of.falls(stone)?;
                at_rest(stone)?;
            }
            say(count > 0, "there is no body voussoir[0]")
        }
        Capstan => {
            of.bodies(["drum", "link[0]", "link[1]"])?;
            let weights = of.bodies(["heavy", "light"])?;
            of.dynamic(&weights)?;
            of.falls(weights[0])
        }
        _ => Ok(()),
    }
}

/// Motion about a pivot, on curves, and mechanisms.
fn motions(of: &Of<'_>, form: ClosedForm) -> Result<(), String> {
    use ClosedForm::*;
    match form {
        RockingBlock => {
            let [block] = of.bodies(["block"])?;
            let (width, height) = (width(block)?, height(block)?);
            of.falls(block)?;
            at_rest(block)?;
            let tilt = block.angle.abs();
            say(
                tilt > 0.0 && tilt < (width / height).atan(),
                "body block does not stand on one corner with its centre inside its base",
            )
        }
        Pendulum => {
            let pins = !of.0.joints.is_empty()
                && of.0.joints.iter().all(|j| j.kind == JointKind::Revolute)
                && of.0.joints[0].bodies.contains(&Option::None);
            say(
                pins,
                "the joints are no chain of pins that starts at the world",
            )?;
            of.vertical()
        }
        StuckRod | FallingRod => {
            let [rod] = of.bodies(["rod"])?;
            of.falls(rod)?;
            is_rod(rod)?;
            let smooth = of.0.materials.iter().all(|m| m.friction == 0.0);
            say(form == StuckRod || smooth, "a material has friction")
        }
        Painleve => {
            let [_, rod] = of.bodies(["floor", "rod"])?;
            of.falls(rod)?;
            is_rod(rod)
        }
        Bowl => {
            let [bowl, disc] = of.bodies(["bowl", "disc"])?;
            radius(disc)?;
            of.falls(disc)?;
            say(
                matches!(bowl.shape, Shape::Bowl { .. }),
                "body bowl is no bowl",
            )
        }
        RidingDisc => {
            let [plate, disc] = of.bodies(["plate", "disc"])?;
            radius(disc)?;
            of.falls(disc)?;
            let swing = plate.oscillation.map_or(f64::INFINITY, |swing| {
                swing.amplitude[1].abs() * swing.angular_frequency.powi(2)
            });
            say(
                swing < -of.0.gravity[1],
                "body plate does not swing, or throws the disc off",
            )
        }
        Woodpecker => {
            let known = |name: &str| {
                let block = of.0.linear.as_ref();
                block.is_some_and(|block| block.coordinates.iter().any(|c| c == name))
            };
            say(
                known("y") && known("phi_s"),
                "[linear] has no coordinates `y` and `phi_s`",
            )
        }
        _ => Ok(()),
    }
}

/// The scene, with what closed forms ask of it.
struct Of<'a>(&'a Scene);

impl<'a> Of<'a> {
    /// The bodies of these names, none of them with a drag or a scaled weight.
    fn bodies<const N: usize>(&self, names: [&str; N]) -> Result<[&'a Body; N], String> {
        let find = |name: &str| self.0.bodies.iter().find(|b| b.name == name);
        let mut found = Vec::with_capacity(N);
        for name in names {
            let body = find(name).ok_or_else(|| format!("there is no body {name}"))?;
            let plain = body.damping == [0.0; 2] && body.gravity_scale == 1.0;
            say(plain, format!("body {name} has a drag or a gravity_scale"))?;
            found.push(body);
        }
        found
            .try_into()
            .map_err(|_| "bodies are missing".to_owned())
    }

    fn dynamic(&self, bodies: &[&Body]) -> Result<(), String> {
        let fixed = bodies.iter().find(|b| b.kind != BodyKind::Dynamic);
        match fixed {
            Some(body) => Err(format!("body {} is not dynamic", body.name)),
            Option::None => Ok(()),
        }
    }

    /// A dynamic body under gravity that points straight down.
    fn falls(&self, body: &Body) -> Result<(), String> {
        self.vertical()?;
        self.dynamic(&[body])
    }

    /// A dynamic body under gravity that points downwards.
    fn drops(&self, body: &Body) -> Result<(), String> {
        say(self.0.gravity[1] < 0.0, "gravity does not point downwards")?;
        self.dynamic(&[body])
    }

    fn vertical(&self) -> Result<(), String> {
        let [x, y] = self.0.gravity;
        say(
            y < 0.0 && x.abs() <= SAME * y.abs(),
            "gravity does not point straight down",
        )
    }

    fn weightless(&self) -> Result<(), String> {
        say(self.0.gravity == [0.0; 2], "there is gravity")
    }

    /// The mean of both coefficients, rapier's rule.
    fn friction(&self, a: &Body, b: &Body) -> f64 {
        let of = |body: &Body| self.0.materials[body.material].friction;
        0.5 * (of(a) + of(b))
    }

    fn rough(&self, a: &Body, b: &Body) -> Result<(), String> {
        say(self.friction(a, b) > 0.0, "there is no friction")
    }
}

fn say(fits: bool, fault: impl Into<String>) -> Result<(), String> {
    if fits { Ok(()) } else { Err(fault.into()) }
}

fn at_rest(body: &Body) -> Result<(), String> {
    say(
        body.velocity == [0.0; 2] && body.spin == 0.0,
        format!("body {} moves at the start", body.name),
    )
}

fn moves(body: &Body) -> Result<(), String> {
    radius(body)?;
    let [x, y] = body.velocity;
    say(
        x != 0.0 && y == 0.0 && body.spin == 0.0,
        format!("body {} does not move along x without a spin", body.name),
    )
}

fn upright(body: &Body) -> Result<(), String> {
    say(
        body.velocity[1] == 0.0 && body.spin == 0.0,
        format!("body {} leaves the ground at the start", body.name),
    )
}

fn radius(body: &Body) -> Result<f64, String> {
    match body.shape {
        Shape::Disc { radius } => Ok(radius),
        _ => Err(format!("body {} is not a disc", body.name)),
    }
}

fn width(body: &Body) -> Result<f64, String> {
    match body.shape {
        Shape::Box { width, .. } => Ok(width),
        _ => Err(format!("body {} is not a box", body.name)),
    }
}

fn height(body: &Body) -> Result<f64, String> {
    match body.shape {
        Shape::Box { height, .. } => Ok(height),
        _ => Err(format!("body {} is not a box", body.name)),
    }
}

fn is_rod(body: &Body) -> Result<(), String> {
    say(
        matches!(body.shape, Shape::Rod { .. }),
        format!("body {} is not a rod", body.name),
    )
}
