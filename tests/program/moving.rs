//! `run --animate`: a picture that moves without a script, of bounded size.

use crate::common::program::Place;
use std::fs;

/// Most bytes of the picture, as the help says.
const MOST: usize = 480_000;

fn moving(args: &[&str]) -> String {
    let place = Place::new();
    let all = [&["run"], args, &["--animate", "--quiet", "--out", "r"]].concat();
    let (code, _, err) = place.run(&all);
    assert!(code == 0 || code == 2, "{args:?}: {err}");
    let svg = fs::read_to_string(place.path("r/scene-moving.svg")).unwrap();
    assert!(svg.len() <= MOST, "{args:?}: {} bytes", svg.len());
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{args:?}");
    // an image runs no script and loads nothing
    assert!(
        !svg.contains("<script") && !svg.contains("href"),
        "{args:?}"
    );
    svg
}

/// The lists of an attribute, each with its values.
fn values(svg: &str, kind: &str) -> Vec<Vec<String>> {
    let start = format!("{kind} values=\"");
    let pieces = svg.split(&start).skip(1);
    pieces
        .map(|piece| {
            piece
                .split('"')
                .next()
                .unwrap()
                .split(';')
                .map(str::to_owned)
                .collect()
        })
        .collect()
}

#[test]
fn a_falling_ball_is_where_the_files_say() {
    // free fall from 1 m for 0.3 s: y = 1 - g t^2 / 2 at each of the 19 frames
    let scene = "[scene]\nname = \"fall\"\ntitle = \"A ball falls\"\n[step]\ntime = 0.3\n\
                 [[body]]\nname = \"ball\"\ndisc = 0.1\nposition = [0, 1]\n";
    let place = Place::new();
    place.write("fall.toml", scene);
    let (code, _, err) = place.run(&["run", "fall.toml", "--animate", "--quiet", "--out", "r"]);
    assert_eq!(code, 0, "{err}");
    let svg = fs::read_to_string(place.path("r/scene-moving.svg")).unwrap();
    let ways = values(&svg, "type=\"translate\"");
    assert_eq!(ways.len(), 1, "one body moves");
    let down = |value: &String| value.split(' ').nth(1).unwrap().parse::<f64>().unwrap();
    let heights: Vec<f64> = place
        .rows("r/bodies.csv")
        .iter()
        .map(|row| row[3].parse().unwrap())
        .collect();
    let frames = heights.len();
    assert_eq!(frames, 19);
    let pixels: Vec<f64> = ways[0].iter().map(down).collect();
    let scale = (pixels[frames - 1] - pixels[0]) / (heights[0] - heights[frames - 1]);
    assert!(scale > 0.0);
    for (pixel, height) in pixels.iter().zip(&heights) {
        // pixels are rounded to a tenth, and so are the two that the scale is taken from
        assert!(
            (pixel - pixels[0] - scale * (heights[0] - height)).abs() < 0.2,
            "{pixel} {height}"
        );
    }
    // the end is held
    assert!(pixels.len() > frames && pixels[frames..].iter().all(|p| *p == pixels[frames - 1]));
    assert!(svg.contains("every written step is shown"), "{svg}");
}

/// Contacts are found in the middle of a step, and drawn where the body has carried them by its end. They once
/// lagged by half the way of a step, here by a quarter of the box.
#[test]
fn contacts_lie_on_the_body_that_carries_them() {
    let scene = "[scene]\nname = \"slide\"\ntitle = \"A box slides\"\n[step]\ntime = 0.3\n\
                 [[material]]\nname = \"m\"\nfriction = 0.2\n\
                 [[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [10, 1]\nposition = [0, -0.5]\nmaterial = \"m\"\n\
                 [[body]]\nname = \"box\"\nbox = [0.2, 0.1]\nposition = [-2, 0.05]\nvelocity = [6, 0]\nmaterial = \"m\"\n";
    let place = Place::new();
    place.write("slide.toml", scene);
    let (code, _, err) = place.run(&["run", "slide.toml", "--animate", "--quiet", "--out", "r"]);
    assert_eq!(code, 0, "{err}");
    let svg = fs::read_to_string(place.path("r/scene-moving.svg")).unwrap();
    let number = |text: &str| text.parse::<f64>().unwrap();
    let across = |value: &String| number(value.split(' ').next().unwrap());
    let middles: Vec<f64> = values(&svg, "type=\"translate\"")[0]
        .iter()
        .map(across)
        .collect();
    let last = place.rows("r/bodies.csv").len() / 2 - 1;
    let rows = place.rows("r/bodies.csv");
    let way = number(&rows[2 * last + 1][2]) - number(&rows[1][2]);
    let half = 0.1 * (middles[last] - middles[0]) / way;
    // in the frame of the end, which is drawn last, the dots of contacts that slip
    let end = svg.rsplit("<path class=\"d1\" d=\"").next().unwrap();
    let dots = end.split('"').next().unwrap().split('M').skip(1);
    let dots: Vec<f64> = dots
        .map(|dot| number(dot.split(' ').next().unwrap()))
        .collect();
    assert_eq!(dots.len(), 2, "{dots:?}");
    for dot in &dots {
        let off = (dot - middles[last]).abs() - half;
        assert!(off.abs() < 0.2, "{dots:?} of {} +- {half}", middles[last]);
    }
}

#[test]
fn frames_are_thinned_and_said_so() {
    let svg = moving(&["hit-heap", "--time", "1.5"]);
    assert!(svg.contains("one written step in"), "not thinned");
    assert!(svg.contains("contact slips") && svg.contains("impact"));
    // one frame at a time: each group of arrows is shown by one animation
    let shown = svg.matches("attributeName=\"display\"").count();
    assert!(shown >= 8, "{shown} frames");
    assert_eq!(shown, svg.matches("t = ").count());
}

#[test]
fn every_kind_of_scene_moves() {
    for args in [
        &["woodpecker", "--steps", "60"] as &[&str],
        &["chain", "--time", "0.3"],
        &["slider-crank", "--steps", "60"],
        &["tower", "--engine", "rapier", "--steps", "10"],
    ] {
        assert!(moving(args).contains("<animate"), "{args:?}");
    }
}

#[test]
fn what_does_not_fit_is_refused_before_the_run() {
    let place = Place::new();
    place.refused(
        &["run", "large-pyramid", "--animate"],
        &["--animate", "large-pyramid", "5050 bodies", "480 kB"],
    );
    place.refused(
        &["run", "thresher-study", "--animate"],
        &["--animate", "a machine"],
    );
}
