//! Shapes, masses and laws of the threshing machine, computed from its parameters.

use super::blocks::Tooth;
use super::grain_parameters::Grains;
use super::parameters::Thresher;
use crate::contact::Vec2;
use crate::models::damping_for_restitution;
use crate::peers::{JointDrive, PairRule, ShapeSpec, Surface};
use crate::rapier::SurfaceLaw;
use crate::wear::{Profile, WearError};
use std::f64::consts::TAU;

/// Collision groups as (own, met): only crop and steel touch, each face of the crop the steel on its side.
const TEETH: (u32, u32) = (1, 4);
const CONCAVE: (u32, u32) = (2, 8);
const CROP: [(u32, u32); 2] = [(4, 1), (8, 2)];
/// Grains meet all steel and each other.
const GRAINS: (u32, u32) = (4 | 8 | 16, 1 | 2 | 16);
/// New crop appears this far before the inlet \[m\].
pub(super) const SPAWN: f64 = 0.06;
/// Corners of a disc in a picture.
const CORNERS: usize = 12;
/// Length of one segment of the concave \[m\]: its chord is 5e-5 m off the arc, 0.6 % of the least
/// clearance.
pub(super) const CONCAVE_SEGMENT: f64 = 0.01;
/// Straight table before the concave \[m\]: the strip enters along its tangent.
pub(super) const TABLE: f64 = 0.2;

pub(super) fn unit(degrees: f64) -> Vec2 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vec2::new(cos, sin)
}

pub(super) fn turned(v: Vec2) -> Vec2 {
    Vec2::new(-v.y, v.x)
}

pub(super) fn base_radius(p: &Thresher, tooth: &Tooth) -> f64 {
    p.tip_radius - tooth.gamma
}

/// Outward and forward axes of a bar in the cylinder's frame.
pub(super) fn bar_axes(p: &Thresher, bar: usize) -> (Vec2, Vec2) {
    let (sin, cos) = (TAU * bar as f64 / f64::from(p.bars)).sin_cos();
    (Vec2::new(cos, sin), Vec2::new(-sin, cos))
}

/// Clearance \[m\] after a share of the arc of the concave.
pub(super) fn clearance(p: &Thresher, share: f64) -> f64 {
    p.clearance_inlet + share * (p.clearance_outlet - p.clearance_inlet)
}

/// Length \[m\] of the strip's middle line along the concave.
pub(super) fn arc_length(p: &Thresher) -> f64 {
    let middle = p.tip_radius + 0.5 * (p.clearance_inlet + p.clearance_outlet - p.crop_thickness);
    (p.concave_end_deg - p.concave_start_deg).to_radians() * middle
}

/// Middle and direction of a strip that lies on the concave, `s` \[m\] after the inlet.
pub(super) fn strip_pose(p: &Thresher, s: f64) -> (Vec2, Vec2) {
    let share = (s / arc_length(p)).clamp(0.0, 1.0);
    let angle = p.concave_start_deg + share * (p.concave_end_deg - p.concave_start_deg);
    let radius = p.tip_radius + clearance(p, share) - 0.5 * p.crop_thickness;
    let along = turned(unit(angle));
    // straight on along the tangent before the inlet and behind the outlet
    let beyond = s - share * arc_length(p);
    (unit(angle) * radius + along * beyond, along)
}

/// A tooth's outline in the cylinder's frame: the nodes of its profile from the tall end to the toe,
/// then the back of its base. Segment k is edge k of the profile.
pub(super) fn tooth_chain(
    p: &Thresher,
    tooth: &Tooth,
    profile: &Profile,
    bar: usize,
) -> Result<ShapeSpec, WearError> {
    let (out, along) = bar_axes(p, bar);
    let l = base_radius(p, tooth);
    let scaled = match p.bar.get(bar).and_then(|own| own.height) {
        Some(height) => {
            let share = height / tooth.gamma;
            let nodes = profile.nodes().iter();
            Some(Profile::new(
                nodes.map(|q| Vec2::new(q.x, q.y * share)).collect(),
            )?)
        }
        None => None,
    };
    let mut points: Vec<Vec2> = (scaled.as_ref().unwrap_or(profile))
        .outline(tooth.base)?
        .iter()
        .map(|q| out * (l + q.y) + along * q.x)
        .collect();
    // the tooth frame is left-handed in the cylinder's: the orientation reverses
    points.reverse();
    Ok(ShapeSpec::Chain {
        points,
        closed: true,
    })
}

/// Inlet table and concave, oriented so that the steel lies outside.
pub(super) fn concave_chain(p: &Thresher, tips: f64) -> ShapeSpec {
    let (from, to) = (p.concave_start_deg, p.concave_end_deg);
    let arc = (to - from).to_radians() * (tips + p.clearance_inlet);
    let n = (arc / CONCAVE_SEGMENT).ceil().max(1.0) as usize;
    let mut points: Vec<Vec2> = (0..=n)
        .map(|i| {
            let s = i as f64 / n as f64;
            unit(from + s * (to - from)) * (tips + clearance(p, s))
        })
        .collect();
    points.insert(0, points[0] - turned(unit(from)) * TABLE);
    points.reverse();
    ShapeSpec::Chain {
        points,
        closed: false,
    }
}

/// The outline of a segment, for pictures.
pub(super) fn segment_shape(p: &Thresher) -> ShapeSpec {
    ShapeSpec::Box {
        half: 0.5 * Vec2::new(p.segment_length, p.crop_thickness),
    }
}

/// What steel meets of a segment, with its surface: the face towards the teeth, and the one towards the
/// concave.
///
/// The ends of a segment are inside the mat, and nothing meets them. With ends a segment would leave a
/// tooth sideways once less of it is under the tooth than it is pressed in, by the back of the tooth, and
/// the last cell alone would lose that load: 10 % of it, however short the cell.
pub(super) fn segment_faces(p: &Thresher) -> [(ShapeSpec, Surface); 2] {
    let half = 0.5 * Vec2::new(p.segment_length, p.crop_thickness);
    let face = |half: Vec2, groups| {
        let shape = ShapeSpec::Chain {
            points: vec![half, Vec2::new(-half.x, half.y)],
            closed: false,
        };
        let surface = Surface {
            // the friction of the pair is set on the steel
            friction: 0.0,
            friction_rule: PairRule::Larger,
            groups,
            ..Surface::default()
        };
        (shape, surface)
    };
    [face(half, CROP[0]), face(-half, CROP[1])]
}

/// Mass \[kg\] and inertia \[kg m²\] of a segment one metre deep.
pub(super) fn segment_mass(p: &Thresher) -> (f64, f64) {
    let (a, b) = (p.segment_length, p.crop_thickness);
    let mass = p.crop_density() * a * b;
    (mass, mass * (a * a + b * b) / 12.0)
}

/// A mat of stalks bends like a beam, not like a chain: a spring at every joint, with half of the
/// critical damping of one segment.
pub(super) fn bending(p: &Thresher) -> JointDrive {
    let (_, inertia) = segment_mass(p);
    JointDrive::Spring {
        target: 0.0,
        max_force: f64::INFINITY,
        stiffness: p.crop_bending_stiffness,
        damping: (p.crop_bending_stiffness * inertia).sqrt(),
    }
}

/// A mat holds together by the friction of its stalks: a Coulomb slider between two segments.
pub(super) fn parting(p: &Thresher) -> JointDrive {
    JointDrive::Motor {
        speed: 0.0,
        max_force: p.crop_strength,
    }
}

/// Of a bar, and of the core for a number that no bar has.
pub(super) fn teeth_surface(p: &Thresher, stiffness: f64, bar: usize) -> Surface {
    let own = p.bar.get(bar).and_then(|own| own.friction);
    steel(p, own.unwrap_or(p.friction_steel), TEETH, stiffness)
}

pub(super) fn concave_surface(p: &Thresher, stiffness: f64) -> Surface {
    steel(p, p.friction_concave, CONCAVE, stiffness)
}

/// Steel has the coefficients of its pair with the crop, and gives way to a strip.
fn steel(p: &Thresher, friction: f64, groups: (u32, u32), stiffness: f64) -> Surface {
    let law = steel_law(p, stiffness);
    let surface = Surface {
        friction,
        friction_rule: PairRule::Larger,
        groups,
        law,
        ..Surface::default()
    };
    match &p.grains {
        None => surface,
        Some(grains) => Surface {
            friction_rule: PairRule::prevails(friction, grains.friction),
            restitution: p.crop_restitution,
            restitution_rule: PairRule::prevails(p.crop_restitution, grains.restitution),
            ..surface
        },
    }
}

/// The surface of a grain, with the coefficients of two grains.
pub(super) fn grain_surface(grains: &Grains) -> Surface {
    Surface {
        friction: grains.friction,
        restitution: grains.restitution,
        groups: GRAINS,
        ..Surface::default()
    }
}

/// The core of the cylinder, on which the bars sit: grains do not get behind the bars.
pub(super) fn hub(p: &Thresher, tooth: &Tooth) -> ShapeSpec {
    ShapeSpec::Ball {
        radius: base_radius(p, tooth),
    }
}

/// A disc as a polygon \[m\], for pictures.
pub(super) fn disc_outline(at: Vec2, radius: f64) -> Vec<Vec2> {
    let corner = |k: usize| at + radius * unit(360.0 * k as f64 / CORNERS as f64);
    (0..CORNERS).map(corner).collect()
}

/// The crop's Kelvin-Voigt law per metre of contact length, set on the steel: its damping gives one
/// segment that lands flat the requested restitution. Grains meet rigid steel.
pub(super) fn steel_law(p: &Thresher, stiffness: f64) -> SurfaceLaw {
    if p.grains.is_some() {
        return SurfaceLaw::default();
    }
    let segment = stiffness * p.segment_length;
    let (mass, _) = segment_mass(p);
    let damping = damping_for_restitution(p.crop_restitution, segment, mass) / p.segment_length;
    SurfaceLaw {
        compliance: Some((stiffness, damping)),
        speed: 0.0,
        cells: true,
    }
}
