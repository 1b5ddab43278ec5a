//! Makes an assembly of rigid blocks from a scene and checks its equilibrium, without time stepping.

use super::equilibrium::{EquilibriumError, Joint, Load, stands};
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use crate::scene::{Body, JointKind, Mass, Scene, Shape};

/// Largest distance of a corner and an edge that touch, relative to the size of the largest block.
const TOUCH: f64 = 1e-9;

/// A convex body: its corners in the world \[m\], counter-clockwise, and the index of its load.
struct Block {
    corners: Vec<Vec2>,
    load: Option<usize>,
    material: usize,
}

/// Whether the boxes and convex polygons of a scene can stand in their initial positions, see
/// [`stands`].
///
/// Two bodies touch at every corner of one that lies on an edge of the other, if the whole body lies
/// beyond that edge. A revolute joint transmits forces in all directions. Velocities and bodies of
/// other shapes are ignored.
///
/// # Errors
/// Those of [`stands`].
pub fn can_stand(scene: &Scene) -> Result<bool, EquilibriumError> {
    let gravity = Vec2::from(scene.gravity);
    let mut loads = Vec::new();
    let mut numbers = vec![None; scene.bodies.len()];
    let mut blocks = Vec::new();
    for (k, body) in scene.bodies.iter().enumerate() {
        let Some((corners, area, centre)) = outline(body) else {
            continue;
        };
        let mass = body.mass.map(|mass| match mass {
            Mass::Density(density) => density * area,
            Mass::Given { mass, .. } => mass,
        });
        if let Some(mass) = mass {
            numbers[k] = Some(loads.len());
            loads.push(Load {
                force: gravity * mass,
                at: centre,
            });
        }
        blocks.push(Block {
            corners,
            load: numbers[k],
            material: body.material,
        });
    }
    let size = blocks.iter().filter(|b| b.load.is_some());
    let size = size.map(|b| extent(&b.corners)).fold(0.0, f64::max);
    let mut joints = Vec::new();
    for (i, a) in blocks.iter().enumerate() {
        for b in &blocks[i + 1..] {
            if a.load.is_some() || b.load.is_some() {
                let friction = [a, b].map(|block| scene.materials[block.material].friction);
                let friction = 0.5 * (friction[0] + friction[1]);
                joints.extend(touching(a, b, friction, TOUCH * size));
                joints.extend(touching(b, a, friction, TOUCH * size));
            }
        }
    }
    for joint in scene
        .joints
        .iter()
        .filter(|j| j.kind == JointKind::Revolute)
    {
        let bodies = joint.bodies.map(|body| body.and_then(|k| numbers[k]));
        if bodies != [None, None] {
            for normal in [Vec2::x(), -Vec2::x(), Vec2::y(), -Vec2::y()] {
                joints.push(Joint {
                    bodies,
                    position: Vec2::from(joint.at[0]),
                    normal,
                    friction: 0.0,
                });
            }
        }
    }
    stands(&loads, &joints)
}

/// Corners in the world \[m\], counter-clockwise, area [m²] and its centroid.
fn outline(body: &Body) -> Option<(Vec<Vec2>, f64, Vec2)> {
    let points: Vec<[f64; 2]> = match &body.shape {
        Shape::Box { width, height } => {
            let (x, y) = (0.5 * width, 0.5 * height);
            vec![[-x, -y], [x, -y], [x, y], [-x, y]]
        }
        Shape::Polygon { points } => points.clone(),
        _ => return None,
    };
    let pose = Pose64::new(Vec2::from(body.position), body.angle);
    let corners: Vec<Vec2> = points.iter().map(|p| pose.apply(Vec2::from(*p))).collect();
    // a fan of triangles round the first corner
    let (mut double, mut moment) = (0.0, Vec2::zeros());
    for pair in corners[1..].windows(2) {
        let [a, b] = [pair[0] - corners[0], pair[1] - corners[0]];
        let twice = a.perp(&b);
        double += twice;
        moment += (a + b) / 3.0 * twice;
    }
    let centre = corners[0] + moment / double;
    Some((corners, 0.5 * double, centre))
}

fn extent(corners: &[Vec2]) -> f64 {
    let far = corners.iter().map(|c| (c - corners[0]).norm());
    far.fold(0.0, f64::max)
}

/// Corners of `b` on edges of `a`.
fn touching(a: &Block, b: &Block, friction: f64, near: f64) -> Vec<Joint> {
    let n = a.corners.len();
    let mut joints = Vec::new();
    for k in 0..n {
        let (start, end) = (a.corners[k], a.corners[(k + 1) % n]);
        let length = (end - start).norm();
        let along = (end - start) / length;
        let normal = Vec2::new(along.y, -along.x);
        let height = |c: &Vec2| normal.dot(&(c - start));
        if b.corners.iter().map(height).fold(f64::INFINITY, f64::min) < -near {
            continue;
        }
        for corner in &b.corners {
            let place = along.dot(&(corner - start));
            if height(corner) <= near && place >= -near && place <= length + near {
                joints.push(Joint {
                    bodies: [a.load, b.load],
                    position: *corner,
                    normal,
                    friction,
                });
            }
        }
    }
    joints
}

/// The parameter value at which an assembly begins to stand, by bisection between `falls` and
/// `holds`, to 1e-7 of their distance.
///
/// # Arguments
/// - `holds`: a value at which it stands; `falls`: one at which it does not. Either may be larger.
///
/// # Errors
/// Those of `stands`.
pub fn limit<E>(
    mut falls: f64,
    mut holds: f64,
    stands: impl Fn(f64) -> Result<bool, E>,
) -> Result<f64, E> {
    for _ in 0..24 {
        let middle = 0.5 * (falls + holds);
        if stands(middle)? {
            holds = middle;
        } else {
            falls = middle;
        }
    }
    Ok(holds)
}

#[cfg(test)]
#[path = "assembly_tests.rs"]
mod tests;
