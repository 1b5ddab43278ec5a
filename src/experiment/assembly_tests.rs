//! Scenes of blocks against what statics knows of them in closed form.

use super::*;
use crate::scene::load;

fn scene(name: &str, flags: &[String]) -> Scene {
    load(name, flags).unwrap()
}

fn parsed(text: &str) -> Scene {
    let header = "[scene]\nname = \"s\"\ntitle = \"t\"\n";
    Scene::parse("s", &format!("{header}{text}"), &[]).unwrap()
}

/// The limit that the oracle finds is `exact`, to what its own feasibility and the bisection allow.
#[track_caller]
fn assert_limit(falls: f64, holds: f64, exact: f64, of: impl Fn(f64) -> Scene) {
    let found = limit(falls, holds, |x| can_stand(&of(x))).unwrap();
    assert!(
        (found / exact - 1.0).abs() < 1e-6,
        "{found} and not {exact}"
    );
}

/// Slides from `tan φ = μ` on, tips from width over height on.
#[test]
fn a_block_on_a_slope_slides_or_tips() {
    let on = |slope: f64, mu: f64| {
        scene(
            "block-on-slope",
            &[format!("slope={slope:?}"), format!("friction={mu:?}")],
        )
    };
    assert_limit(0.1, 0.9, 0.3, |mu| on(0.3, mu));
    assert_limit(0.9, 0.1, 0.5, |slope| on(slope, 2.0));
}

/// `tan` of the half angle; the wedge of the scene weighs 1e-4 of the lid, which moves the limit.
#[test]
fn a_wedge_stays_as_far_as_friction_locks_it() {
    let with = |mu: f64| {
        let flags = [
            "body.wedge.mass=1e-6".to_owned(),
            format!("friction={mu:?}"),
        ];
        scene("wedge", &flags)
    };
    assert_limit(0.1, 0.6, 0.25, with);
}

/// Two cards that lean on each other at `a` from the upright, feet and heads cut flat: each has
/// `N = W` at its foot and there the push `T` of the other, at any height of the cut.
///
/// Moments about the foot's outer end: `T h = W (x_c − x)`, least for the highest `h` and the
/// farthest `x`, so that the limit is `(centre − inner end of the foot) / height` of the head.
#[test]
fn two_cards_lean_on_each_other() {
    let (slope, height, thick): (f64, f64, f64) = (0.5, 1.0, 0.04);
    // across the card, and up it: where its two faces meet foot and head
    let (foot, head) = (thick, thick / slope);
    let out = -height * slope;
    let corners = [
        [out, 0.0],
        [out + foot, 0.0],
        [0.0, height - head],
        [0.0, height],
    ];
    let card =
        |name: &str, c: &[[f64; 2]]| format!("[[body]]\nname = \"{name}\"\npolygon = {c:?}\n");
    let mirrored: Vec<[f64; 2]> = corners.iter().rev().map(|[x, y]| [-x, *y]).collect();
    let pair = format!("{}{}", card("left", &corners), card("right", &mirrored));
    // two triangles with the diagonal from foot to head: areas as their upright and level sides
    let [low, high] = [0.5 * foot * (height - head), 0.5 * head * -out];
    let [x, y] = [(2.0 * out + foot) / 3.0, out / 3.0];
    let centre = (low * x + high * y) / (low + high);
    let exact = (centre - (out + foot)) / height;
    assert!(exact > 0.2);
    assert_limit(0.05, 0.9, exact, |mu| {
        parsed(&format!(
            "[[material]]\nname = \"m\"\nfriction = {mu:?}\n{pair}[[body]]\nname = \"floor\"\n\
             kind = \"fixed\"\nbox = [9, 2]\nposition = [0, -1]\n"
        ))
    });
}

/// n blocks of width 1 overhang a table by `Σ 1/(2k)`, each as far as the one below can carry.
#[test]
fn a_harmonic_stack_overhangs_by_the_harmonic_sum() {
    for n in [1u32, 4, 12] {
        assert_limit(1.5, 0.5, 1.0, |stretch| {
            let mut text = "[[body]]\nname = \"table\"\nkind = \"fixed\"\nbox = [20, 2]\n\
                            position = [-10, -1]\n"
                .to_owned();
            let mut x = -0.5;
            for k in (1..=n).rev() {
                x += stretch * 0.5 / f64::from(k);
                let y = 0.1 + 0.2 * f64::from(n - k);
                text += &format!(
                    "[[body]]\nname = \"b{k}\"\nbox = [1, 0.2]\nposition = [{x:?}, {y:?}]\n"
                );
            }
            parsed(&text)
        });
    }
}

/// A corner of one beside a corner of the other: it stands on the top alone.
#[test]
fn a_tower_touches_with_its_faces_only() {
    let tower = scene("tower", &[]);
    assert_eq!(can_stand(&tower), Ok(true));
    let lateral = Scene {
        gravity: [2.0, -9.81],
        ..tower.clone()
    };
    // 10 boxes tip at 1/10
    assert_eq!(can_stand(&lateral), Ok(false));
    let lateral = Scene {
        gravity: [0.97, -9.81],
        ..tower
    };
    assert_eq!(can_stand(&lateral), Ok(true));
}
