//! The surface of a collider as corners in `f64`, to read and to change: what wear needs of a world.

use super::bodies::ExactBody;
use super::body_checks::not_there;
use super::engine::prelude::*;
use super::parry::shape::{PolylineFlags, TypedShape};
use super::pipeline::MoreauPipeline;
use super::widen::widen;
use crate::contact::Vec2;
use crate::dynamics::{ModelError, Pose64};
use std::f64::consts::TAU;

/// Edges of the outline of a ball whose cells have no given length.
const BALL_EDGES: usize = 64;

/// Largest number of cells of an outline. It is ten times finer than any measured profile of a tooth; time
/// grows with its square, as finer cells also shorten every jump.
pub const MOST_CELLS: usize = 10_000;

/// The surface of a collider in its own frame.
///
/// The solid lies on the left of the edges: counter-clockwise and closed it is a solid, clockwise and
/// closed a hollow. Edge `k` starts at corner `k`; the last edge of a closed outline ends at the first
/// corner. Contacts name edges by these numbers, [`SurfacePoint::edge`](crate::dynamics::SurfacePoint).
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Corners \[m\].
    pub points: Vec<Vec2>,
    pub closed: bool,
}

/// A piece of material at some place of a body.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Piece {
    /// \[kg\]
    pub mass: f64,
    /// Centre of mass in the frame of the collider \[m\].
    pub centre: Vec2,
    /// About its centre of mass [kg m²].
    pub inertia: f64,
}

fn invalid(collider: ColliderHandle, problem: &str) -> ModelError {
    let id = collider.into_raw_parts();
    ModelError::Invalid(format!("collider (handle {id:?}): {problem}"))
}

/// The body of a collider and the collider's place in its frame.
fn body_of(
    world: &PhysicsWorld,
    collider: ColliderHandle,
) -> Result<(RigidBodyHandle, Pose64), ModelError> {
    let found = world.colliders.get(collider);
    let found = found.ok_or_else(|| invalid(collider, "is not in the world"))?;
    let place = found.position_wrt_parent().map(Pose64::from_rapier);
    let body = found.parent().zip(place);
    body.ok_or_else(|| invalid(collider, "has no body"))
}

impl MoreauPipeline {
    /// The outline of a collider.
    ///
    /// A one-sided polyline, closed or open, has its own. Edge 0 of a box is its lower one, the others
    /// follow counter-clockwise; those of a triangle or a convex polygon start at its first corner.
    /// A ball becomes a regular polygon with its corners on the circle, the first at angle 0: it
    /// removes material only where it is touched, whatever its motion, which an even radius cannot.
    ///
    /// # Arguments
    /// - `cell`: longest edge of the outline of a ball \[m\]; 64 edges without.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] for a collider that is not in the world, a polyline that is two-sided or
    /// whose edges are not in one row, a ball with more than [`MOST_CELLS`] edges;
    /// [`ModelError::Unsupported`] for any other shape.
    pub fn outline(
        &self,
        world: &PhysicsWorld,
        collider: ColliderHandle,
        cell: Option<f64>,
    ) -> Result<Outline, ModelError> {
        let found = world.colliders.get(collider);
        let found = found.ok_or_else(|| invalid(collider, "is not in the world"))?;
        let point = |p: &Vector| Vec2::new(widen(p.x), widen(p.y));
        let closed = |points: Vec<Vec2>| Outline {
            points,
            closed: true,
        };
        match found.shape().as_typed_shape() {
            TypedShape::Polyline(line) => {
                if !line.flags().contains(PolylineFlags::ORIENTED) {
                    let problem = "is a two-sided polyline, which has no solid that could wear";
                    return Err(invalid(collider, problem));
                }
                let (vertices, edges) = (line.vertices(), line.indices());
                if edges.windows(2).any(|pair| pair[0][1] != pair[1][0]) {
                    let problem = "the edges of its polyline do not follow on each other";
                    return Err(invalid(collider, problem));
                }
                let ends = edges.first().zip(edges.last());
                let closed = ends.is_some_and(|(first, last)| first[0] == last[1]);
                let starts = edges.iter().map(|edge| edge[0]);
                let last = edges.last().filter(|_| !closed).map(|edge| edge[1]);
                let corners = starts.chain(last);
                Ok(Outline {
                    points: corners.map(|k| point(&vertices[k as usize])).collect(),
                    closed,
                })
            }
            TypedShape::Cuboid(cuboid) => {
                let [x, y] = [cuboid.half_extents.x, cuboid.half_extents.y].map(widen);
                let corners = [(-x, -y), (x, -y), (x, y), (-x, y)];
                Ok(closed(corners.map(|(x, y)| Vec2::new(x, y)).to_vec()))
            }
            TypedShape::Triangle(triangle) => {
                let mut points: Vec<Vec2> = triangle.vertices().iter().map(point).collect();
                if (points[1] - points[0]).perp(&(points[2] - points[0])) < 0.0 {
                    points.swap(1, 2);
                }
                Ok(closed(points))
            }
            TypedShape::ConvexPolygon(polygon) => {
                Ok(closed(polygon.points().iter().map(point).collect()))
            }
            TypedShape::Ball(ball) => {
                let radius = widen(ball.radius);
                let edges = cell.map_or(BALL_EDGES as f64, |c| (TAU * radius / c).ceil());
                if edges > MOST_CELLS as f64 {
                    let problem = format!(
                        "a ball of {radius} m in edges of {} m would have {edges}, at most {MOST_CELLS} \
                         are allowed",
                        cell.unwrap_or_default()
                    );
                    return Err(invalid(collider, &problem));
                }
                let edges = (edges as usize).max(4);
                let corner = |k: usize| {
                    let (sin, cos) = (TAU * k as f64 / edges as f64).sin_cos();
                    radius * Vec2::new(cos, sin)
                };
                Ok(closed((0..edges).map(corner).collect()))
            }
            _ => {
                let id = collider.into_raw_parts();
                Err(ModelError::Unsupported(format!(
                    "collider (handle {id:?}): {:?} cannot wear; a one-sided polyline, a box, a \
                     triangle, a convex polygon and a ball can",
                    found.shape().shape_type()
                )))
            }
        }
    }

    /// Gives a collider the shape of an outline, a one-sided polyline. Its mass stays as it is.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] for a collider that is not in the world.
    pub fn set_outline(
        &mut self,
        world: &mut PhysicsWorld,
        collider: ColliderHandle,
        outline: &Outline,
    ) -> Result<(), ModelError> {
        let found = world.colliders.get_mut(collider);
        let found = found.ok_or_else(|| invalid(collider, "is not in the world"))?;
        let corners = outline.points.iter();
        let points: Vec<Vector> = corners
            .map(|p| Vector::new(p.x as Real, p.y as Real))
            .collect();
        let n = points.len() as u32;
        let last = if outline.closed {
            n
        } else {
            n.saturating_sub(1)
        };
        let edges = (0..last).map(|k| [k, (k + 1) % n]).collect();
        // a polyline has no area to take a mass from
        let mass = found.mass_properties();
        found.set_mass_properties(mass);
        let shape = ColliderBuilder::oriented_polyline(points, Some(edges)).shape;
        found.set_shape(shape);
        Ok(())
    }

    /// Takes pieces of material off the bodies of colliders: the mass of each body, its centre of mass and
    /// its inertia become those of the rest. From then on the mass is the body's own, its colliders have
    /// none. The velocity of the centre of mass stays as it is.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] for a collider without a dynamic body, or if no mass or inertia is left;
    /// nothing is changed then, whichever piece it is.
    pub fn take_material(
        &mut self,
        world: &mut PhysicsWorld,
        pieces: &[(ColliderHandle, Piece)],
    ) -> Result<(), ModelError> {
        let mut left: Vec<(RigidBodyHandle, Vec2, ExactBody)> = Vec::new();
        for (collider, piece) in pieces {
            let (handle, place) = body_of(world, *collider)?;
            let earlier = left.iter().position(|(known, ..)| *known == handle);
            let (centre, whole) = match earlier {
                Some(k) => (left[k].1, left[k].2),
                None => self.whole(world, *collider, handle)?,
            };
            let gone = place.apply(piece.centre);
            let mass = whole.mass - piece.mass;
            let rest = (centre * whole.mass - gone * piece.mass) / mass;
            let inertia = whole.inertia + whole.mass * (centre - rest).norm_squared()
                - piece.inertia
                - piece.mass * (gone - rest).norm_squared();
            // the last test is one for finite numbers as well
            if !(mass > 0.0 && inertia > 0.0 && mass + inertia < f64::INFINITY) {
                let problem =
                    format!("wear leaves a mass of {mass} kg and {inertia} kg m2 of inertia");
                return Err(invalid(*collider, &problem));
            }
            let rest = (handle, rest, ExactBody { mass, inertia });
            match earlier {
                Some(k) => left[k] = rest,
                None => left.push(rest),
            }
        }
        for (handle, rest, exact) in left {
            let properties = MassProperties::new(
                Vector::new(rest.x as Real, rest.y as Real),
                exact.mass as Real,
                exact.inertia as Real,
            );
            let body = world.bodies.get(handle).ok_or_else(|| not_there(handle))?;
            for own in body.colliders().to_vec() {
                if let Some(own) = world.colliders.get_mut(own) {
                    own.set_density(0.0);
                }
            }
            if let Some(body) = world.bodies.get_mut(handle) {
                body.set_additional_mass_properties(properties, true);
                body.recompute_mass_properties_from_colliders(&world.colliders);
            }
            self.set_exact_mass(handle, exact)?;
        }
        Ok(())
    }

    /// Centre of mass, in its own frame, and mass of the dynamic body of a collider.
    fn whole(
        &self,
        world: &PhysicsWorld,
        collider: ColliderHandle,
        handle: RigidBodyHandle,
    ) -> Result<(Vec2, ExactBody), ModelError> {
        let body = world.bodies.get(handle).ok_or_else(|| not_there(handle))?;
        if !body.is_dynamic() {
            return Err(invalid(collider, "only a dynamic body has a mass to lose"));
        }
        let local = &body.mass_properties().local_mprops;
        let known = self.bodies.exact().find(|(known, _)| *known == handle);
        let exact = known.map_or_else(
            || ExactBody {
                mass: widen(local.mass()),
                inertia: widen(local.principal_inertia()),
            },
            |(_, exact)| exact,
        );
        let centre = Vec2::new(widen(local.local_com.x), widen(local.local_com.y));
        Ok((centre, exact))
    }

    /// Least mass \[kg\] of the dynamic bodies of some colliders, by their numbers in records.
    pub fn least_mass(&self, world: &PhysicsWorld, surfaces: impl Fn(u32) -> bool) -> Option<f64> {
        let own = world.colliders.iter();
        let own = own.filter(|(handle, _)| surfaces(handle.into_raw_parts().0));
        let bodies = own.filter_map(|(_, collider)| world.bodies.get(collider.parent()?));
        let masses = bodies.filter(|body| body.is_dynamic());
        masses.map(|body| widen(body.mass())).reduce(f64::min)
    }

    /// Keeps all bodies awake from now on, as [`MoreauSettings::stay_awake`](super::MoreauSettings).
    pub fn stay_awake(&mut self) {
        self.settings.stay_awake = true;
    }

    /// Whether no body falls asleep.
    pub fn is_awake(&self) -> bool {
        self.settings.stay_awake
    }

    /// The surface law of a collider.
    pub fn surface(&self, collider: ColliderHandle) -> super::SurfaceLaw {
        let mut all = self.surfaces();
        all.find(|(known, _)| *known == collider)
            .map_or_else(super::SurfaceLaw::default, |(_, law)| law)
    }
}
