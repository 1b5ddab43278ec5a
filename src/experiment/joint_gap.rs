use super::simulate::Engine;
use crate::contact::Vec2;
use crate::scene::JointKind;
use crate::scene::{Built, Scene};

/// The joints of a scene that hold two points together. Their gaps follow from the poses alone: the
/// same measure for every engine.
pub(super) struct Pins(Vec<Pin>);

/// The two bodies (`None` is the world) and the anchor of each in its own frame \[m\].
struct Pin {
    bodies: [Option<usize>; 2],
    anchors: [Vec2; 2],
}

impl Pins {
    /// The revolute and fixed joints of a scene; `None` if there are none.
    pub(super) fn of(scene: &Scene) -> Option<Pins> {
        let holds = |kind| matches!(kind, JointKind::Revolute | JointKind::Fixed);
        let joints = scene.joints.iter().filter(|j| holds(j.kind));
        let pins: Vec<Pin> = joints
            .map(|joint| Pin {
                bodies: joint.bodies,
                anchors: scene.anchors(joint),
            })
            .collect();
        (!pins.is_empty()).then_some(Pins(pins))
    }

    /// Widest gap between the two anchors of a joint \[m\]; NaN if a body has no pose.
    pub(super) fn gap(&self, built: &Built, engine: Engine) -> f64 {
        self.widest(built, engine, |_| 1.0)
    }

    /// As [`Pins::gap`], each gap over the size of the smaller body of its joint.
    pub(super) fn relative_gap(&self, built: &Built, engine: Engine) -> f64 {
        self.widest(built, engine, |pin| {
            let bodies = pin.bodies.iter().flatten();
            let sizes = bodies.filter_map(|&k| built.size(k));
            sizes.fold(f64::INFINITY, f64::min)
        })
    }

    fn widest(&self, built: &Built, engine: Engine, size: impl Fn(&Pin) -> f64) -> f64 {
        let place = |body: Option<usize>, anchor: Vec2| match body {
            None => anchor,
            Some(k) => engine
                .state(built, k)
                .map_or(Vec2::repeat(f64::NAN), |(pose, _)| pose.apply(anchor)),
        };
        let gap = |pin: &Pin| {
            let [a, b] = [0, 1].map(|side| place(pin.bodies[side], pin.anchors[side]));
            (a - b).norm() / size(pin)
        };
        let worse = |most: f64, gap: f64| {
            if gap > most || gap.is_nan() {
                gap
            } else {
                most
            }
        };
        self.0.iter().map(gap).fold(0.0, worse)
    }
}
