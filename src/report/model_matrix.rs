//! The picture of `models.csv`: what each reduction of the model saves, and what it changes.

use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{FontTransform, RGBColor, WHITE};

use super::atlas_matrix::frame;
use super::canvas::{Canvas, Drawn, Point, picture};
use super::csv_rows::ModelRow;
use super::layout::{MARGIN, SMALL, TEXT, TITLE, width_of};
use super::table::number;
use super::{ReportError, palette};

/// Lengths in px.
const NAME: f64 = 130.0;
const CELL: Point = (190.0, 52.0);
const FILLS: [(&str, &str, RGBColor); 4] = [
    ("equal", "equal within 1e-9 a step", RGBColor(205, 231, 222)),
    ("apart", "apart, both certified", RGBColor(240, 222, 160)),
    (
        "another solution",
        "another solution of the same problem",
        RGBColor(214, 224, 180),
    ),
    ("unsolved", "unsolved: no claim", RGBColor(225, 225, 225)),
];

/// A row for each scene, a column for each reduction: unknowns and time against the full model, and the
/// verdict.
///
/// # Errors
/// `ReportError::EmptyChart` without a row; `ReportError::Chart` with plotters' own word.
pub fn model_matrix(rows: &[ModelRow]) -> Result<String, ReportError> {
    let title = || "Reductions of the model".to_owned();
    let of = |key: fn(&ModelRow) -> &str| {
        let mut names: Vec<&str> = Vec::new();
        for row in rows {
            if !names.contains(&key(row)) {
                names.push(key(row));
            }
        }
        names
    };
    let (scenes, reductions) = (of(|r| &r.scene), of(|r| &r.reduction));
    if rows.is_empty() {
        return Err(ReportError::EmptyChart {
            title: title(),
            skipped: 0,
        });
    }
    let top = MARGIN + 1.5 * TITLE + 6.4 * TEXT;
    let size = (
        2.0 * MARGIN + NAME + CELL.0 * reductions.len() as f64,
        top + CELL.1 * scenes.len() as f64 + MARGIN,
    );
    picture(size, |canvas| {
        head(canvas)?;
        for (k, name) in reductions.iter().enumerate() {
            let middle = MARGIN + NAME + CELL.0 * (k as f64 + 0.5);
            let of = rows.iter().find(|row| row.reduction == *name);
            text(canvas, name, (middle, top - 1.9 * TEXT), TEXT, HPos::Center)?;
            let key = of.map_or("", |row| &row.key);
            text(canvas, key, (middle, top - 0.7 * TEXT), SMALL, HPos::Center)?;
        }
        for (k, name) in scenes.iter().enumerate() {
            let at = (MARGIN, top + CELL.1 * (k as f64 + 0.5));
            text(canvas, name, at, TEXT, HPos::Left)?;
        }
        for row in rows {
            let place = |names: &[&str], name: &str| names.iter().position(|n| *n == name);
            let column = place(&reductions, &row.reduction).unwrap_or(0) as f64;
            let line = place(&scenes, &row.scene).unwrap_or(0) as f64;
            cell(
                canvas,
                row,
                (MARGIN + NAME + CELL.0 * column, top + CELL.1 * line),
            )?;
        }
        Ok(())
    })
    .map_err(|reason| ReportError::Chart {
        title: title(),
        reason,
    })
}

fn head(canvas: &Canvas) -> Drawn {
    let mut y = MARGIN + 0.5 * TITLE;
    text(
        canvas,
        "Reductions of the model: what is left out, and what it changes",
        (MARGIN, y),
        TITLE,
        HPos::Left,
    )?;
    y += TITLE + 0.4 * TEXT;
    let told =
        "Each cell: the reduced model against the full one, from the same state in every step";
    text(canvas, told, (MARGIN, y), TEXT, HPos::Left)?;
    y += 1.5 * TEXT;
    let mut x = MARGIN;
    for (_, meaning, fill) in FILLS {
        frame(canvas, (x, y - 6.0), (x + 18.0, y + 6.0), fill)?;
        text(canvas, meaning, (x + 24.0, y), SMALL, HPos::Left)?;
        x += 44.0 + width_of(meaning, SMALL);
    }
    Ok(())
}

fn cell(canvas: &Canvas, row: &ModelRow, (x, y): Point) -> Drawn {
    let of = |f: &&(&str, &str, RGBColor)| row.verdict.starts_with(f.0);
    let fill = FILLS.iter().find(of).map_or(WHITE, |f| f.2);
    frame(
        canvas,
        (x + 1.0, y + 1.0),
        (x + CELL.0 - 1.0, y + CELL.1 - 1.0),
        fill,
    )?;
    let unknowns = match (row.unknowns, row.unknowns_full) {
        (a, b) if a == b => "no unknown left out".to_owned(),
        (a, b) => format!("{a} of {b} unknowns"),
    };
    let time = match row.time_ratio {
        r if row.verdict.ends_with("slower") => format!("{} of the time: slower", times(r)),
        r => format!("{} of the time", times(r)),
    };
    let difference = match row.difference {
        0.0 => "no difference".to_owned(),
        d => format!("difference {}", number(d, 2)),
    };
    for (k, line) in [unknowns, time, difference].iter().enumerate() {
        let at = (x + 0.5 * CELL.0, y + 10.0 + 16.0 * k as f64);
        text(canvas, line, at, SMALL, HPos::Center)?;
    }
    Ok(())
}

fn times(ratio: f64) -> String {
    format!("{:.0} %", 100.0 * ratio)
}

fn text(canvas: &Canvas, text: &str, at: Point, size: f64, side: HPos) -> Drawn {
    let ink = (size, palette::INK);
    canvas.text(text, at, ink, (side, VPos::Center), FontTransform::None)
}
