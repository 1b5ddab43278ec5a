use super::{Chart, ReportError};

/// Width or height in an SVG document of ours, whose header has both.
pub(super) fn size(svg: &str, name: &str) -> f64 {
    let from = svg.split_once(&format!("{name}=\"")).map_or("", |s| s.1);
    let number = from.split('"').next().unwrap_or("");
    number.parse().unwrap_or(0.0)
}

/// Charts one below the other in a single SVG document.
///
/// # Errors
/// Those of [`Chart::to_svg`].
pub fn panels(charts: &[Chart]) -> Result<String, ReportError> {
    let (mut width, mut height) = (0.0_f64, 0.0);
    let mut inner = String::new();
    for chart in charts {
        let svg = chart.to_svg()?;
        inner.push_str(&svg.replacen("<svg ", &format!("<svg y=\"{height}\" "), 1));
        width = width.max(size(&svg, "width"));
        height += size(&svg, "height");
    }
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#FFFFFF\"/>\n{inner}</svg>\n"
    ))
}
