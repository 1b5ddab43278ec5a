use super::world::{box2d_error, lacks, narrow, widened};
use crate::dynamics::ModelError;
use crate::rapier::SurfaceLaw;
use crate::rapier::engine::prelude::*;
use crate::rapier::parry::shape::PolylineFlags;
use boxdd::{
    BodyId, ChainDef, Filter, MixerId, ShapeDef, ShapeId, SurfaceMaterial, Transform, World, shapes,
};

/// Largest number of corners of a polygon.
const CORNERS: usize = 8;

/// The rules that combine two coefficients, if Box2D's own rules do not suffice.
pub(super) struct Rules {
    friction: bool,
    restitution: bool,
}

impl Rules {
    /// A world of one coefficient and rapier's default rule needs no callback: the mean, the root
    /// of the product and the larger of two equal numbers are that number. Without the callback
    /// contacts take less time.
    pub fn of(world: &PhysicsWorld) -> Rules {
        let mixed = |number: fn(&Collider) -> Real,
                     rule: fn(&Collider) -> CoefficientCombineRule| {
            let mut all = world.colliders.iter().map(|(_, c)| c);
            let first = all.next().map(number);
            let mut all = world.colliders.iter().map(|(_, c)| c);
            all.any(|c| {
                let keeps = [
                    CoefficientCombineRule::Average,
                    CoefficientCombineRule::Max,
                    CoefficientCombineRule::Min,
                ];
                Some(number(c)) != first || !keeps.contains(&rule(c))
            })
        };
        Rules {
            friction: mixed(Collider::friction, Collider::friction_combine_rule),
            restitution: mixed(Collider::restitution, Collider::restitution_combine_rule),
        }
    }

    pub fn install(&self, world: &mut World) -> Result<(), ModelError> {
        let rule = |id: u64, shift: u32| RULES[(id >> shift & 7) as usize % RULES.len()];
        let mix = move |shift: u32| {
            move |a: boxdd::MaterialMixInput, b: boxdd::MaterialMixInput| {
                narrow(CoefficientCombineRule::combine(
                    widened(a.coefficient),
                    widened(b.coefficient),
                    rule(a.user_material_id, shift),
                    rule(b.user_material_id, shift),
                ))
            }
        };
        let id = |kind: u8| MixerId::from_bytes([kind; 32]);
        if self.friction {
            let set = world.set_friction_callback(id(1), mix(0));
            set.map_err(box2d_error("friction"))?;
        }
        if self.restitution {
            let set = world.set_restitution_callback(id(2), mix(3));
            set.map_err(box2d_error("restitution"))?;
        }
        Ok(())
    }
}

/// In the order of their numbers. The material number contains three bits of them: those of
/// friction, then those of restitution.
const RULES: [CoefficientCombineRule; 6] = [
    CoefficientCombineRule::Average,
    CoefficientCombineRule::Min,
    CoefficientCombineRule::Multiply,
    CoefficientCombineRule::Max,
    CoefficientCombineRule::ClampedSum,
    CoefficientCombineRule::GeometricMean,
];

/// Friction coefficient of a pair.
pub(super) fn friction(pair: [&Collider; 2]) -> f64 {
    let [a, b] = pair;
    let rules = [a, b].map(Collider::friction_combine_rule);
    CoefficientCombineRule::combine(a.friction(), b.friction(), rules[0], rules[1]).into()
}

/// Adds a collider to a body.
///
/// # Returns
/// The shapes it became: for a polyline, one per edge.
///
/// # Errors
/// [`ModelError::Unsupported`] for shapes and properties that Box2D does not have.
pub(super) fn add(
    world: &mut World,
    body: BodyId,
    collider: &Collider,
    law: &SurfaceLaw,
    name: &str,
) -> Result<Vec<ShapeId>, ModelError> {
    let groups = collider.collision_groups();
    let hooks = collider.active_hooks();
    let has_not = [
        (law.compliance.is_some(), "compliant surfaces"),
        (collider.is_sensor(), "sensors without contact"),
        (!collider.is_enabled(), "disabled colliders"),
        (collider.contact_skin() != 0.0, "contact skin"),
        // belts are the only hooks of a scene, and their law identifies them
        (!hooks.is_empty() && law.speed == 0.0, "hooks"),
        (
            collider.solver_groups() != InteractionGroups::all()
                || groups.test_mode != InteractionTestMode::And,
            "solver groups",
        ),
    ];
    if let Some((_, what)) = has_not.iter().find(|(has, _)| *has) {
        return Err(lacks(&format!("{what} ({name})")));
    }
    let rules =
        collider.friction_combine_rule() as u64 | (collider.restitution_combine_rule() as u64) << 3;
    let material = || -> boxdd::Result<SurfaceMaterial> {
        Ok(SurfaceMaterial::new()
            .with_friction(narrow(collider.friction()))?
            .with_restitution(narrow(collider.restitution()))?
            // along Box2D's tangent, opposite to ours
            .with_tangent_speed(-law.speed as f32)?
            .with_user_material_id(rules))
    };
    let material = material().map_err(box2d_error(name))?;
    let filter = Filter {
        category_bits: groups.memberships.bits().into(),
        mask_bits: groups.filter.bits().into(),
        group_index: 0,
    };
    let shape = collider.shape().as_typed_shape();
    if let TypedShape::Polyline(line) = shape
        && line.flags().contains(PolylineFlags::ORIENTED)
    {
        let points = corners(line, collider);
        let points = points.ok_or_else(|| lacks(&format!("edges in such an order ({name})")))?;
        return chain(world, body, points, material, filter).map_err(box2d_error(name));
    }
    let define = || {
        // the density gives the extents for sweeps; the mass is replaced later
        let def = ShapeDef::builder().density(1.0);
        def.material(material).filter(filter).build()
    };
    let def = define().map_err(box2d_error(name))?;
    let mut copy = world.body(body).map_err(box2d_error(name))?;
    match shape {
        TypedShape::Polyline(line) => {
            let edge = |edge| solid(&mut copy, &def, collider, TypedShape::Segment(&edge), name);
            line.segments().map(edge).collect()
        }
        shape => Ok(vec![solid(&mut copy, &def, collider, shape, name)?]),
    }
}

/// Place of a collider's point in its body's frame.
fn placed(collider: &Collider, point: Vector) -> boxdd::Vec2 {
    let point = collider.position_wrt_parent().map_or(point, |p| p * point);
    boxdd::Vec2::new(narrow(point.x), narrow(point.y))
}

fn solid(
    body: &mut boxdd::Body<'_>,
    def: &ShapeDef,
    collider: &Collider,
    shape: TypedShape<'_>,
    name: &str,
) -> Result<ShapeId, ModelError> {
    let at = |point: Vector| placed(collider, point);
    let made = match shape {
        TypedShape::Ball(ball) => shapes::circle(at(Vector::ZERO), narrow(ball.radius))
            .and_then(|circle| body.create_circle(def, &circle)),
        TypedShape::Cuboid(cuboid) => {
            let [x, y] = [cuboid.half_extents.x, cuboid.half_extents.y];
            let pose = collider.position_wrt_parent();
            let turn = pose.map_or(0.0, |p| p.rotation.angle());
            Transform::from_pos_angle(at(Vector::ZERO), narrow(turn))
                .and_then(|place| shapes::offset_box_polygon(narrow(x), narrow(y), place))
                .and_then(|polygon| body.create_polygon(def, &polygon))
        }
        TypedShape::Capsule(capsule) => {
            let [a, b] = [capsule.segment.a, capsule.segment.b].map(at);
            shapes::capsule(a, b, narrow(capsule.radius))
                .and_then(|capsule| body.create_capsule(def, &capsule))
        }
        TypedShape::Segment(segment) => shapes::segment(at(segment.a), at(segment.b))
            .and_then(|segment| body.create_segment(def, &segment)),
        TypedShape::ConvexPolygon(polygon) => {
            let points = polygon.points();
            if points.len() > CORNERS {
                let corners = points.len();
                return Err(lacks(&format!("polygons of {corners} corners ({name})")));
            }
            let made = shapes::polygon_from_points(points.iter().map(|p| at(*p)), 0.0);
            if made.is_ok_and(|made| made.count() != points.len()) {
                return Err(lacks(&format!(
                    "polygons with corners within 20 mm or nearly in line ({name})"
                )));
            }
            made.and_then(|polygon| body.create_polygon(def, &polygon))
        }
        _ => {
            let kind = format!("{:?}", collider.shape().shape_type());
            return Err(lacks(&format!("shapes of kind {kind} ({name})")));
        }
    };
    made.map_err(box2d_error(name))
}

/// The points of a polyline in the body's frame, and whether it is closed; `None` if its edges are
/// not consecutive.
fn corners(line: &Polyline, collider: &Collider) -> Option<(Vec<boxdd::Vec2>, bool)> {
    let (edges, n) = (line.indices(), line.vertices().len() as u32);
    let follow = |(k, edge): (usize, &[u32; 2])| *edge == [k as u32, (k as u32 + 1) % n];
    let closed = edges.len() as u32 == n;
    let whole = edges.iter().enumerate().all(follow) && (closed || edges.len() as u32 + 1 == n);
    let points = line.vertices().iter().map(|p| placed(collider, *p));
    whole.then(|| (points.collect(), closed))
}

/// One-sided edges, the solid on the left of their direction, in Box2D as well.
fn chain(
    world: &mut World,
    body: BodyId,
    (mut points, closed): (Vec<boxdd::Vec2>, bool),
    material: SurfaceMaterial,
    filter: Filter,
) -> boxdd::Result<Vec<ShapeId>> {
    if let (false, [a, b, ..]) = (closed, &points.clone()[..]) {
        // the first and the last point of an open chain only guide contacts that slide over its
        // ends
        points.insert(0, boxdd::Vec2::new(2.0 * a.x - b.x, 2.0 * a.y - b.y));
        let [.., c, d] = &points[..] else {
            return Ok(Vec::new());
        };
        points.push(boxdd::Vec2::new(2.0 * d.x - c.x, 2.0 * d.y - c.y));
    }
    let def = ChainDef::builder()
        .points(points)
        .is_loop(closed)
        .filter(filter)
        .single_material(&material)
        .build()?;
    let chain = world.body(body)?.create_chain(&def)?;
    world.chain(chain)?.segments()
}
