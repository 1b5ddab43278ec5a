use plotters::style::RGBColor;

/// The colour-blind-safe palette of Okabe & Ito (2008), darkest contrasts on white first; their
/// yellow is left out, being unreadable as a line.
pub(super) const QUALITATIVE: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

pub(super) const INK: RGBColor = RGBColor(38, 38, 38);
pub(super) const FAINT_INK: RGBColor = RGBColor(96, 96, 96);
pub(super) const AXIS: RGBColor = RGBColor(110, 110, 110);
pub(super) const GRID: RGBColor = RGBColor(226, 226, 226);
pub(super) const MINOR_GRID: RGBColor = RGBColor(241, 241, 241);
pub(super) const BODY: RGBColor = RGBColor(214, 214, 214);

/// Anchors of the viridis map (Smith & van der Walt, 2015), light to dark. Its yellow end is left
/// out for the same reason as above. Lightness falls steadily, so it survives grey printing.
const RAMP: [(f64, f64, f64); 5] = [
    (122.0, 209.0, 81.0),
    (34.0, 168.0, 132.0),
    (42.0, 120.0, 142.0),
    (65.0, 68.0, 135.0),
    (68.0, 1.0, 84.0),
];

/// Colour at `fraction` of the sequential ramp, light at 0 and dark at 1; clamped.
pub(super) fn ramp(fraction: f64) -> RGBColor {
    let position = fraction.clamp(0.0, 1.0) * (RAMP.len() - 1) as f64;
    let below = (position as usize).min(RAMP.len() - 2);
    let (a, b, t) = (RAMP[below], RAMP[below + 1], position - below as f64);
    let mix = |a: f64, b: f64| (a + t * (b - a)).round() as u8;
    RGBColor(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}
