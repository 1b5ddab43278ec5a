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

    /// Whether the straight line from `a` to `b` enters the area: clipped at each pair of edges.
    fn is_crossed(&self, a: Point, b: Point) -> bool {
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for (start, end, low, high) in [
            (a.0, b.0, self.left, self.right),
            (a.1, b.1, self.top, self.bottom),
        ] {
            let run = end - start;
            if run == 0.0 {
                if start < low || start > high {
                    return false;
                }
                continue;
            }
            let (p, q) = ((low - start) / run, (high - start) / run);
            from = from.max(p.min(q));
            to = to.min(p.max(q));
        }
        from < to
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
/// A label goes to the right, left, top or bottom of its point, or to a corner, where it covers
/// no marker, no other label and best no line. One without room inside the frame is left out, and
/// so is a second one of the same text at the same place.
///
/// # Arguments
/// - `markers`: all points drawn, in px.
/// - `lines`: the ends of all straight pieces drawn, in px.
pub(super) fn place(
    chart: &Chart,
    layout: &Layout,
    markers: &[Point],
    lines: &[(Point, Point)],
) -> Vec<(Point, String)> {
    let mut taken: Vec<Area> = markers.iter().map(|&m| Area::round(m, MARKER)).collect();
    let mut named: Vec<(Point, &str)> = Vec::new();
    let mut placed = Vec::new();
    for label in &chart.labels {
        let Some((x, y)) = chart.place((label.x, label.y)).map(|p| layout.pixel(p)) else {
            continue;
        };
        let near = |p: Point| (p.0 - x).hypot(p.1 - y) < 2.0 * MARKER;
        if named.iter().any(|&(p, text)| text == label.text && near(p)) {
            continue;
        }
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
        let free = candidates.into_iter().filter_map(|(left, middle)| {
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
        let crossed = |area: &Area| {
            lines
                .iter()
                .filter(|(a, b)| area.is_crossed(*a, *b))
                .count()
        };
        if let Some(area) = free.min_by_key(crossed) {
            placed.push((
                (area.left, 0.5 * (area.top + area.bottom)),
                label.text.clone(),
            ));
            named.push(((x, y), &label.text));
            taken.push(area);
        }
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_crosses_only_what_it_enters() {
        let area = Area::round((10.0, 10.0), 2.0);
        assert!(area.is_crossed((0.0, 10.0), (20.0, 10.0)));
        assert!(area.is_crossed((9.0, 9.0), (9.5, 9.5)), "inside");
        assert!(area.is_crossed((0.0, 0.0), (20.0, 20.0)));
        assert!(!area.is_crossed((0.0, 10.0), (7.0, 10.0)), "ends before it");
        assert!(!area.is_crossed((0.0, 5.0), (20.0, 5.0)), "passes above");
        assert!(
            !area.is_crossed((0.0, 16.0), (16.0, 0.0 - 1.0)),
            "passes a corner"
        );
    }
}
