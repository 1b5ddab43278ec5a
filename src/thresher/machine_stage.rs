//! The machine for a replay: its bodies in the order of the record.

use super::blocks::Tooth;
use super::cycle::new_tooth;
use super::machine::Setup;
use super::parameters::Thresher;
use super::shapes::{base_radius, concave_chain, segment_shape, tooth_chain};
use super::world::{ThreshingError, ThreshingWorld};
use crate::contact::Vec2;
use crate::peers::ShapeSpec;
use crate::report::{Actor, Piece, Stage};
use crate::scene::Scene;
use crate::wear::{Profile, WearError};

/// The stage of a machine with new teeth, for the first `count` bodies of its record.
///
/// # Errors
/// [`ThreshingError`], as [`ThreshingWorld::new`].
pub fn machine_stage(
    scene: &Scene,
    setup: &Setup<Thresher>,
    count: usize,
) -> Result<Stage, ThreshingError> {
    let (p, tooth) = (&setup.parameters, &setup.tooth);
    let state = new_tooth(tooth, &setup.wear, p)?;
    let world = ThreshingWorld::new(scene, p, tooth, state.profile(), p.crop_stiffness)?;
    Ok(world.stage(tooth, state.profile(), count)?)
}

impl ThreshingWorld {
    /// Outlines of the first `count` bodies of the record, with new teeth: the cylinder, the concave, and
    /// segments of crop under all other numbers, or grains. Numbers pass from one that has left to one that
    /// enters; the mean radius stands for that of each grain, which the replay knows.
    ///
    /// # Errors
    /// [`WearError`]: none for a profile that makes teeth.
    fn stage(&self, tooth: &Tooth, profile: &Profile, count: usize) -> Result<Stage, WearError> {
        let p: &Thresher = self.parameters();
        let [cylinder, concave] = self.steel();
        let crop = match &p.grains {
            Some(grains) => Piece::Disc([0.0, 0.0, grains.radius, 0.0]),
            None => Piece::Area(outline(segment_shape(p))),
        };
        let mut bodies: Vec<Actor> = (0..count)
            .map(|_| Actor {
                name: if p.grains.is_some() { "grain" } else { "crop" }.to_owned(),
                kind: "dynamic",
                pieces: vec![crop.clone()],
                belt: 0.0,
            })
            .collect();
        let hub = base_radius(p, tooth);
        // the core on which the bars sit
        let mut pieces = vec![Piece::Disc([0.0, 0.0, hub, 0.0])];
        for bar in 0..p.bars as usize {
            pieces.push(Piece::Area(outline(tooth_chain(p, tooth, profile, bar)?)));
        }
        let steel = [
            (cylinder, "cylinder", "driven", pieces),
            (
                concave,
                "concave",
                "fixed",
                vec![Piece::Line(outline(concave_chain(p, p.tip_radius)))],
            ),
        ];
        for (number, name, kind, pieces) in steel {
            if let Some(body) = number.and_then(|number| bodies.get_mut(number as usize)) {
                *body = Actor {
                    name: name.to_owned(),
                    kind,
                    pieces,
                    belt: 0.0,
                };
            }
        }
        Ok(Stage {
            bodies,
            links: Vec::new(),
            gravity: [0.0; 2],
            lane: 0.0,
        })
    }
}

/// The points of a chain or a box \[m\], to a micrometre, as they are written into a page.
fn outline(shape: ShapeSpec) -> Vec<[f64; 2]> {
    let points: Vec<Vec2> = match shape {
        ShapeSpec::Chain { points, .. } => points,
        ShapeSpec::Box { half } => [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
            .map(|(x, y)| half.component_mul(&Vec2::new(x, y)))
            .to_vec(),
        _ => Vec::new(),
    };
    let micrometres = |x: f64| (1e6 * x).round() / 1e6;
    points.iter().map(|p| [p.x, p.y].map(micrometres)).collect()
}
