//! No text panics.

use super::*;
use proptest::prelude::*;

#[test]
fn deep_nesting_is_refused_not_a_stack_overflow() {
    // The parser's own recursion limit is what protects the recursive readers here.
    for text in [
        format!("a = {}", "[".repeat(100_000)),
        format!("a = {}{}", "[".repeat(5_000), "]".repeat(5_000)),
        format!("a{} = 1", ".a".repeat(100_000)),
        format!("[a{}]", ".a".repeat(100_000)),
    ] {
        let error = error_of(&text, &[]);
        assert!(error.starts_with("t.toml:1:"), "{error}");
    }
    let error = error_of(BALL, &[&format!("step.dt={}", "[".repeat(100_000))]);
    assert!(error.contains("expected a number"));
}

proptest! {
    /// Broken files are refused or accepted, never a panic; what is accepted is finite.
    #[test]
    fn mangled_files_never_panic(
        scene in 0_usize..4,
        cut in 0.0_f64..1.0,
        flips in prop::collection::vec((0.0_f64..1.0, any::<u8>()), 0..8),
        flag in prop::option::of("[a-z.0-9]{0,12}=[ -~]{0,12}"),
    ) {
        let name = ["cradle", "drum", "thresher", "beam"][scene];
        let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let mut bytes = std::fs::read(path).unwrap();
        for (at, byte) in flips {
            let index = (at * bytes.len() as f64) as usize;
            bytes[index] = byte;
        }
        // Half of the files are cut short.
        bytes.truncate((bytes.len() as f64 * (2.0 * cut).min(1.0)) as usize);
        let text = String::from_utf8_lossy(&bytes).into_owned();
        match Scene::parse("t.toml", &text, flag.as_slice()) {
            Ok(scene) => prop_assert!(scene.bodies.iter().all(|b| b.position[0].is_finite())),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }

    /// Any number in any place is refused or leaves a scene of finite numbers.
    #[test]
    fn wild_values_never_panic(
        key in prop::sample::select(vec![
            "step.dt", "step.time", "gravity.slope", "body.striker.disc", "body.striker.mass",
            "body.ball.position.0", "body.ball.box", "repeat.0.count", "repeat.0.step",
            "repeat.0.shrink", "repeat.0.ring", "repeat.0.jitter", "material.0.stiffness",
            "body.ball.polygon", "body.ball.polyline", "wear.jump", "study.speeds", "joint",
        ]),
        value in prop_oneof![
            any::<f64>().prop_map(|x| format!("{x:?}")),
            any::<i64>().prop_map(|x| x.to_string()),
            prop::collection::vec(any::<f64>(), 0..5).prop_map(|x| format!("{x:?}")),
            prop::collection::vec([any::<f64>(), any::<f64>()], 0..6).prop_map(|x| format!("{x:?}")),
            prop::collection::vec(0_u32..2000, 0..4).prop_map(|x| format!("{x:?}")),
            "[ -~]{0,20}",
        ],
    ) {
        match load("cradle", &[format!("{key}={value}")]) {
            Ok(scene) => {
                prop_assert!(scene.gravity.iter().all(|x| x.is_finite()));
                for body in &scene.bodies {
                    prop_assert!(body.position.iter().all(|x| x.is_finite()), "{body:?}");
                }
            }
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
}
