//! Names beside points, where there is room for them.

use super::canvas::Point;
use super::chart::Chart;
use super::layout::{Layout, SMALL, width_of};

/// Room kept round a marker, in px.
const MARKER: f64 = 5.5;

/// An upright rectangle, in px from the top left of the picture.
#[derive(Debug, Clone, Copy)]
struct Area {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

impl Area {
    fn overlaps(&self, other: &Area) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }

    fn round((x, y): Point, half: f64) -> Area {
        Area {
            left: x - half,
            top: y - half,
            right: x + half,
            bottom: y + half,
        }
    }
}

/// Places the chart's labels, first come first served: where each starts, at half its height.
///
/// A label goes to the right, left, top or bottom of its point, or to a corner; one that would
/// cover a marker, another label or the frame everywhere is left out.
///
/// # Arguments
/// - `markers`: all points drawn, in px.
pub(super) fn place(chart: &Chart, layout: &Layout, markers: &[Point]) -> Vec<(Point, String)> {
    let mut taken: Vec<Area> = markers.iter().map(|&m| Area::round(m, MARKER)).collect();
    let mut placed = Vec::new();
    for label in &chart.labels {
        let Some((x, y)) = chart.place((label.x, label.y)).map(|p| layout.pixel(p)) else {
            continue;
        };
        let (width, height) = (width_of(&label.text, SMALL), 1.15 * SMALL);
        let (beside, above) = (MARKER + 1.0, MARKER + 0.5 * height);
        let candidates = [
            (x + beside, y),
            (x - beside - width, y),
            (x - 0.5 * width, y - above),
            (x - 0.5 * width, y + above),
            (x + 2.0, y - above),
            (x + 2.0, y + above),
            (x - 2.0 - width, y - above),
            (x - 2.0 - width, y + above),
        ];
        let free = candidates.into_iter().find_map(|(left, middle)| {
            let area = Area {
                left,
                top: middle - 0.5 * height,
                right: left + width,
                bottom: middle + 0.5 * height,
            };
            let inside = area.left >= layout.left
                && area.right <= layout.right
                && area.top >= layout.top
                && area.bottom <= layout.bottom;
            (inside && !taken.iter().any(|t| t.overlaps(&area))).then_some(area)
        });
        if let Some(area) = free {
            placed.push((
                (area.left, 0.5 * (area.top + area.bottom)),
                label.text.clone(),
            ));
            taken.push(area);
        }
    }
    placed
}
