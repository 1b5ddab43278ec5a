use plotters::style::RGBColor;

use super::chart::{Chart, Colour, Series, Style};
use super::palette;

/// Of a longer family of curves the legend names this many: all times of a wear picture.
const LEGEND_FAMILY: usize = 9;

/// A series with the looks it was given.
pub(super) struct Look<'a> {
    pub series: &'a Series,
    pub colour: RGBColor,
    pub marker: usize,
}

/// A line of the legend.
pub(super) struct Entry<'a> {
    pub name: String,
    /// `None` for a mark.
    pub look: Option<&'a Look<'a>>,
}

pub(super) fn looks(chart: &Chart) -> Vec<Look<'_>> {
    let mut next = 0;
    let mut looks = Vec::new();
    for series in &chart.series {
        let (colour, marker) = match series.colour {
            _ if series.style == Style::Body => (palette::BODY, 0),
            Colour::Ramp(fraction) => (palette::ramp(fraction), 0),
            Colour::Next | Colour::Palette(_) => {
                let index = match series.colour {
                    Colour::Palette(index) => index,
                    _ => {
                        next += 1;
                        next - 1
                    }
                };
                let colours = palette::QUALITATIVE;
                (colours[index % colours.len()], index)
            }
        };
        looks.push(Look {
            series,
            colour,
            marker,
        });
    }
    looks
}

pub(super) fn legend<'a>(chart: &Chart, looks: &'a [Look<'a>]) -> Vec<Entry<'a>> {
    let family = |l: &Look| matches!(l.series.colour, Colour::Ramp(_));
    let members = looks.iter().filter(|l| family(l)).count();
    let shown: Vec<usize> = spread(members, LEGEND_FAMILY);
    let mut member = 0;
    let mut entries = Vec::new();
    for look in looks {
        let mut named = !look.series.name.is_empty();
        if family(look) {
            named &= shown.contains(&member);
            member += 1;
        }
        if named {
            entries.push(Entry {
                name: look.series.name.clone(),
                look: Some(look),
            });
        }
    }
    for mark in chart.marks.iter().filter(|m| !m.label.is_empty()) {
        entries.push(Entry {
            name: mark.label.clone(),
            look: None,
        });
    }
    entries
}

/// At most `most` of the indices below `count`, evenly spread, with both ends.
fn spread(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    (0..most)
        .map(|i| (i * (count - 1) + (most - 1) / 2) / (most - 1))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legend_of_a_family_keeps_both_ends() {
        assert_eq!(spread(3, 6), [0, 1, 2]);
        assert_eq!(spread(12, 6), [0, 2, 4, 7, 9, 11]);
        assert_eq!(spread(0, 6), [0usize; 0]);
    }
}
