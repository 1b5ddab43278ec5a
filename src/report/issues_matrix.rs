//! The atlas of complaints as a picture, with a row for each scene and a column for each engine.

use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{FontTransform, RGBColor, WHITE};

use super::atlas_matrix::frame;
use super::canvas::{Canvas, Drawn, picture, stroke};
use super::layout::{MARGIN, SMALL, TEXT, TITLE, width_of};
use super::{ReportError, ResultRow, palette};

/// Name of the row that tells whether an engine itself says that something is wrong with a run.
pub const SAID: &str = "said";

/// How an engine did on a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reply {
    Pass,
    /// It fails, and says that something is wrong, or stops with an error.
    Said,
    /// It fails, and reports nothing.
    Silent,
    /// It cannot run the scene, or was not run.
    None,
}

impl Reply {
    /// Of the rows of one engine on one scene.
    pub fn of(rows: &[&ResultRow]) -> Reply {
        let said = |r: &&ResultRow| r.measure == SAID && r.value == 1.0;
        match rows.first().map(|r| (r.verdict.as_str(), r.mode.as_str())) {
            Some(("pass", _)) => Reply::Pass,
            Some(("unsolved", _) | ("fail", "stops")) => Reply::Said,
            Some(("fail", _)) if rows.iter().any(said) => Reply::Said,
            Some(("fail", _)) => Reply::Silent,
            _ => Reply::None,
        }
    }

    /// Fill and ink: light, middle and dark, so that they differ in grey too.
    fn look(self) -> (RGBColor, RGBColor) {
        match self {
            Reply::Pass => (RGBColor(205, 231, 222), palette::INK),
            Reply::Said => (RGBColor(240, 190, 80), palette::INK),
            Reply::Silent => (RGBColor(160, 58, 0), WHITE),
            Reply::None => (WHITE, palette::FAINT_INK),
        }
    }
}

/// The engines of `rows` in the order in which they first appear.
pub fn engines(rows: &[ResultRow]) -> Vec<&str> {
    let mut engines: Vec<&str> = Vec::new();
    for row in rows {
        if !engines.contains(&row.engine.as_str()) {
            engines.push(&row.engine);
        }
    }
    engines
}

/// The rows of one engine on one scene.
pub fn rows_of<'a>(rows: &'a [ResultRow], scene: &str, engine: &str) -> Vec<&'a ResultRow> {
    let own = rows
        .iter()
        .filter(|r| r.scene == scene && r.engine == engine);
    own.collect()
}

/// Lengths in px.
const SCENE: f64 = 134.0;
const CELL: f64 = 88.0;
const LINE: f64 = 19.0;

/// The picture: one word for the result of each engine on each scene. The fill distinguishes a pass,
/// a failure that the engine reports, and a silent failure.
///
/// # Arguments
/// - `rows`: of `results.csv`.
/// - `scenes`: name of each scene, and the issue threads that it stands for.
///
/// # Errors
/// `ReportError::EmptyChart` without a scene; `ReportError::Chart` with plotters' own word.
pub fn complaints(rows: &[ResultRow], scenes: &[(String, String)]) -> Result<String, ReportError> {
    let title = "The atlas of complaints".to_owned();
    if scenes.is_empty() || rows.is_empty() {
        return Err(ReportError::EmptyChart { title, skipped: 0 });
    }
    draw(rows, scenes).map_err(|reason| ReportError::Chart { title, reason })
}

const LEFT: (HPos, VPos) = (HPos::Left, VPos::Center);
const MIDDLE: (HPos, VPos) = (HPos::Center, VPos::Center);

fn draw(rows: &[ResultRow], scenes: &[(String, String)]) -> Result<String, String> {
    let engines = engines(rows);
    let labels = scenes.iter().map(|(_, threads)| width_of(threads, SMALL));
    let threads = 0.9 * labels.fold(60.0, f64::max) + 10.0;
    let left = MARGIN + SCENE + threads;
    let width = left + CELL * engines.len() as f64 + MARGIN;
    let top = MARGIN + 1.35 * TITLE + 2.2 * TEXT + LINE;
    let height = top + LINE * (scenes.len() + 1) as f64 + MARGIN;
    picture((width, height), |canvas| {
        header(canvas)?;
        let ends = [(MARGIN, top), (width - MARGIN, top)];
        canvas.path(&ends, stroke(palette::AXIS, 0.8))?;
        for (engine, k) in engines.iter().zip(0..) {
            let at = (left + CELL * (f64::from(k) + 0.5), top - 0.5 * LINE);
            word(canvas, engine, at, palette::INK)?;
        }
        for ((scene, threads), k) in scenes.iter().zip(0..) {
            let y = top + LINE * (f64::from(k) + 0.5) + 2.0;
            let ink = (TEXT, palette::INK);
            canvas.text(scene, (MARGIN, y), ink, LEFT, FontTransform::None)?;
            let (at, ink) = ((MARGIN + SCENE, y), (SMALL, palette::FAINT_INK));
            canvas.text(threads, at, ink, LEFT, FontTransform::None)?;
            for (engine, column) in engines.iter().zip(0..) {
                let x = left + CELL * f64::from(column);
                cell(canvas, &rows_of(rows, scene, engine), (x, y))?;
            }
        }
        let y = top + LINE * (scenes.len() as f64 + 0.5) + 4.0;
        let at = (MARGIN, y);
        canvas.text(
            "passed",
            at,
            (TEXT, palette::INK),
            LEFT,
            FontTransform::None,
        )?;
        for (engine, column) in engines.iter().zip(0..) {
            let replies: Vec<Reply> = scenes
                .iter()
                .map(|(scene, _)| Reply::of(&rows_of(rows, scene, engine)))
                .collect();
            let count = |what: fn(&&Reply) -> bool| replies.iter().filter(what).count();
            let passed = count(|r| **r == Reply::Pass);
            let run = count(|r| **r != Reply::None);
            let at = (left + CELL * (f64::from(column) + 0.5), y);
            word(canvas, &format!("{passed} of {run}"), at, palette::INK)?;
        }
        Ok(())
    })
}

fn header(canvas: &Canvas) -> Drawn {
    let corner = (HPos::Left, VPos::Top);
    let flat = || FontTransform::None;
    let ink = (TITLE, palette::INK);
    let title = "The atlas of complaints";
    canvas.text(title, (MARGIN, MARGIN), ink, corner, flat())?;
    let y = MARGIN + 1.35 * TITLE + 0.9 * TEXT;
    let mut x = MARGIN;
    for (reply, text) in [
        (Reply::Pass, "pass"),
        (Reply::Said, "fails, and says so"),
        (Reply::Silent, "fails in silence"),
        (Reply::None, "not run"),
    ] {
        frame(canvas, (x, y - 6.0), (x + 22.0, y + 6.0), reply.look().0)?;
        let ink = (TEXT, palette::INK);
        canvas.text(text, (x + 28.0, y), ink, LEFT, flat())?;
        x += 44.0 + width_of(text, TEXT);
    }
    Ok(())
}

/// A text in the middle of a cell, made smaller until it fits.
fn word(canvas: &Canvas, text: &str, at: (f64, f64), ink: RGBColor) -> Drawn {
    let width = 0.9 * width_of(text, SMALL);
    let size = SMALL * ((CELL - 6.0) / width).min(1.0);
    canvas.text(text, at, (size, ink), MIDDLE, FontTransform::None)
}

fn cell(canvas: &Canvas, rows: &[&ResultRow], (x, y): (f64, f64)) -> Drawn {
    let reply = Reply::of(rows);
    let (fill, ink) = reply.look();
    let (a, b) = (
        (x + 1.0, y - 0.5 * LINE + 1.0),
        (x + CELL - 1.0, y + 0.5 * LINE - 1.0),
    );
    frame(canvas, a, b, fill)?;
    let text = match (reply, rows.first()) {
        (Reply::None, _) | (_, None) => "–",
        (_, Some(row)) => row.mode.as_str(),
    };
    word(canvas, text, (x + 0.5 * CELL, y), ink)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::parse_rows;

    const HEAD: &str = "scene,rung,engine,scheme,solver,setting,dt_s,threads,precision,measure,\
        value,unit,reference,seconds_per_simulated_second,spread,verdict,mode\n";

    fn rows(lines: &[&str]) -> Vec<ResultRow> {
        let line = |l: &&str| {
            let [scene, engine, measure, value, verdict, mode] =
                <[&str; 6]>::try_from(l.split(' ').collect::<Vec<_>>()).unwrap();
            format!(
                "{scene},,{engine},,,default,0.01,1,f64,{measure},{value},m,,,,{verdict},{mode}\n"
            )
        };
        let text = HEAD.to_owned() + &lines.iter().map(line).collect::<String>();
        parse_rows(&text, "issues.csv").unwrap()
    }

    /// What an engine says of a failure decides between the two fills, whatever the order of rows.
    #[test]
    fn a_failure_is_silent_unless_it_is_said() {
        let rows = rows(&[
            "a moreau gap 2 fail lifts",
            "a moreau said 1 fail lifts",
            "a rapier gap 2 fail lifts",
            "a rapier said 0 fail lifts",
            "a box2d gap NaN fail stops",
            "b moreau gap 0 unsolved uncertified",
            "b rapier gap 0 pass stays",
        ]);
        let reply = |scene, engine| Reply::of(&rows_of(&rows, scene, engine));
        assert_eq!(reply("a", "moreau"), Reply::Said);
        assert_eq!(reply("a", "rapier"), Reply::Silent);
        assert_eq!(reply("a", "box2d"), Reply::Said);
        assert_eq!(reply("b", "moreau"), Reply::Said);
        assert_eq!(reply("b", "rapier"), Reply::Pass);
        assert_eq!(reply("b", "box2d"), Reply::None);
        let scenes = [("a", "x#1"), ("b", "y#2")].map(|(a, b)| (a.to_owned(), b.to_owned()));
        let svg = complaints(&rows, &scenes).unwrap();
        let count = |word: &str| svg.lines().filter(|l| l.trim() == word).count();
        assert_eq!((count("lifts"), count("stays"), count("–")), (2, 1, 1));
        assert_eq!(
            (count("0 of 2"), count("1 of 2"), count("0 of 1")),
            (1, 1, 1)
        );
    }
}
