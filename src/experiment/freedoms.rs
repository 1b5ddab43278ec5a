//! Coordinates that the joints of a scene take from its bodies.

use crate::scene::{Body, BodyKind, Joint, JointKind};
use nalgebra::DMatrix;

/// Most rows of a group of joined bodies of which the rank is computed: a dense matrix of them, a few
/// milliseconds. Of larger groups each row counts.
const MOST_ROWS: usize = 300;

/// Pivot below which a row repeats others, over the largest one.
const REPEATS: f64 = 1e-9;

/// Rows of a joint.
pub(super) fn rows(kind: JointKind) -> usize {
    match kind {
        JointKind::Revolute | JointKind::Prismatic => 2,
        JointKind::Fixed => 3,
        JointKind::PinSlot => 1,
        JointKind::Rope | JointKind::Spring => 0,
    }
}

/// Number of coordinates that the joints take: the rank of their rows at the start, where dead centres leave
/// more than elsewhere. Joints that repeat each other, as the third crank of a parallel guide, take fewer
/// than they have rows.
pub(super) fn coordinates_taken(bodies: &[Body], joints: &[Joint]) -> usize {
    let moves = |k: usize| bodies[k].kind == BodyKind::Dynamic;
    let sides = |joint: &Joint| joint.bodies.map(|k| k.filter(|k| moves(*k)));
    let mut group: Vec<usize> = (0..bodies.len()).collect();
    for joint in joints.iter().filter(|joint| rows(joint.kind) > 0) {
        if let [Some(a), Some(b)] = sides(joint) {
            let [a, b] = [a, b].map(|k| root(&mut group, k));
            group[a.max(b)] = a.min(b);
        }
    }
    let mut groups = std::collections::BTreeMap::<usize, Vec<&Joint>>::new();
    for joint in joints {
        // between bodies that do not move it takes nothing
        if let Some(k) = sides(joint).into_iter().flatten().next() {
            groups.entry(root(&mut group, k)).or_default().push(joint);
        }
    }
    groups.values().map(|own| rank(bodies, own, sides)).sum()
}

/// The first body of the group of a body.
fn root(group: &mut [usize], mut k: usize) -> usize {
    while group[k] != k {
        group[k] = group[group[k]];
        k = group[k];
    }
    k
}

/// Whether no joints of a group close a loop, through bodies that do not move neither: then no row repeats
/// others, since each joint alone holds all that hangs on it.
fn is_open(bodies: usize, joints: &[&Joint], sides: impl Fn(&Joint) -> [Option<usize>; 2]) -> bool {
    let mut group: Vec<usize> = (0..=bodies).collect();
    let mut binding = joints.iter().filter(|joint| rows(joint.kind) > 0);
    binding.all(|joint| {
        let [a, b] = sides(joint).map(|k| root(&mut group, k.unwrap_or(bodies)));
        group[a] = b;
        a != b
    })
}

/// Rank of the rows of joints that hang together.
fn rank(bodies: &[Body], joints: &[&Joint], sides: impl Fn(&Joint) -> [Option<usize>; 2]) -> usize {
    let count = joints.iter().map(|joint| rows(joint.kind)).sum();
    if count > MOST_ROWS || is_open(bodies.len(), joints, &sides) {
        return count;
    }
    rank_of_rows(bodies, joints, sides)
}

fn rank_of_rows(
    bodies: &[Body],
    joints: &[&Joint],
    sides: impl Fn(&Joint) -> [Option<usize>; 2],
) -> usize {
    let count: usize = joints.iter().map(|joint| rows(joint.kind)).sum();
    let mut columns: Vec<usize> = joints.iter().flat_map(|j| sides(j)).flatten().collect();
    columns.sort_unstable();
    columns.dedup();
    let arm = |k: usize, joint: &Joint, side: usize| {
        let ([x, y], [cx, cy]) = (joint.at[side], bodies[k].position);
        [x - cx, y - cy]
    };
    let arms = (joints.iter()).flat_map(|joint| {
        let each = sides(joint).into_iter().enumerate();
        each.filter_map(|(side, k)| Some(arm(k?, joint, side)))
    });
    let longest = arms.map(|[x, y]| x.hypot(y)).fold(0.0, f64::max);
    // angles in lengths, so that pivots compare
    let size = if longest > 0.0 { longest } else { 1.0 };
    let mut matrix = DMatrix::zeros(count.max(1), 3 * columns.len());
    let mut row = 0;
    for joint in joints {
        let (sin, cos) = joint.axis.sin_cos();
        let (x, y, across) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-sin, cos, 0.0]);
        let angle = [0.0, 0.0, 1.0];
        let of_kind: &[[f64; 3]] = match joint.kind {
            JointKind::Revolute => &[x, y],
            JointKind::Fixed => &[x, y, angle],
            JointKind::Prismatic => &[across, angle],
            JointKind::PinSlot => &[across],
            JointKind::Rope | JointKind::Spring => &[],
        };
        for direction in of_kind {
            for (side, k) in sides(joint).into_iter().enumerate() {
                let Some((k, column)) = k.and_then(|k| Some((k, columns.binary_search(&k).ok()?)))
                else {
                    continue;
                };
                let [rx, ry] = arm(k, joint, side);
                let [dx, dy, turn] = *direction;
                let sign = if side == 0 { -1.0 } else { 1.0 };
                let entries = [dx, dy, turn + (dy * rx - dx * ry) / size];
                for (c, entry) in entries.into_iter().enumerate() {
                    matrix[(row, 3 * column + c)] += sign * entry;
                }
            }
            row += 1;
        }
    }
    let triangle = matrix.col_piv_qr().r();
    let diagonal = 0..triangle.nrows().min(triangle.ncols());
    let pivots: Vec<f64> = diagonal.map(|k| triangle[(k, k)]).collect();
    let largest = pivots.iter().fold(0.0, |most, p| f64::max(most, p.abs()));
    pivots
        .iter()
        .filter(|p| p.abs() > REPEATS * largest)
        .count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// Free coordinates of a bar on `cranks` cranks of equal length, each on a pin of its own.
    fn free(cranks: usize, equal: bool) -> usize {
        let mut text = "[scene]\nname = \"s\"\ntitle = \"t\"\n\
                        [[body]]\nname = \"bar\"\nbox = [9, 0.1]\nposition = [3, 1]\n"
            .to_owned();
        for k in 0..cranks {
            let foot = if equal || k != 2 { 0.0 } else { -0.5 };
            text.push_str(&format!(
                "[[body]]\nname = \"c{k}\"\nbox = [0.1, 1]\nposition = [{k}, 0.5]\n\
                 [[joint]]\nkind = \"revolute\"\nbodies = [\"world\", \"c{k}\"]\nat = [{k}, {foot}]\n\
                 [[joint]]\nkind = \"revolute\"\nbodies = [\"c{k}\", \"bar\"]\nat = [{k}.3, 1]\n"
            ));
        }
        let scene = Scene::parse("s.toml", &text, &[]).unwrap();
        3 * scene.bodies.len() - coordinates_taken(&scene.bodies, &scene.joints)
    }

    /// What is said of groups without a loop is what the rank of their rows says.
    #[test]
    fn groups_without_a_loop_need_no_rank() {
        for name in ["capstan", "double-pendulum", "slider-crank", "chain"] {
            let scene = crate::scene::load(name, &[]).unwrap();
            let moves = |k: &usize| scene.bodies[*k].kind == BodyKind::Dynamic;
            let sides = |joint: &Joint| joint.bodies.map(|k| k.filter(moves));
            let all: Vec<&Joint> = scene.joints.iter().collect();
            assert!(is_open(scene.bodies.len(), &all, sides), "{name}");
            let count: usize = all.iter().map(|joint| rows(joint.kind)).sum();
            assert_eq!(rank_of_rows(&scene.bodies, &all, sides), count, "{name}");
        }
    }

    #[test]
    fn a_parallel_guide_moves_on_two_cranks_or_more() {
        assert_eq!([1, 2, 3, 5].map(|n| free(n, true)), [2, 1, 1, 1]);
        // a crank of another length blocks it
        assert_eq!(free(3, false), 0);
    }
}
