/// Observed order of convergence: the slope of ln(error) against ln(Δt), by least squares.
///
/// # Arguments
/// - `points`: (Δt \[s\], error), in any order; points that are not positive and finite are left out.
///
/// # Returns
/// The slope and its standard error; `None` for fewer than three points or a single Δt.
pub fn observed_order(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(|p| p.0 > 0.0 && p.1 > 0.0 && p.0.is_finite() && p.1.is_finite())
        .map(|p| (p.0.ln(), p.1.ln()))
        .collect();
    let n = logs.len() as f64;
    if n < 3.0 {
        return None;
    }
    let x_mean = logs.iter().map(|p| p.0).sum::<f64>() / n;
    let y_mean = logs.iter().map(|p| p.1).sum::<f64>() / n;
    let xx: f64 = logs.iter().map(|p| (p.0 - x_mean).powi(2)).sum();
    let xy: f64 = logs.iter().map(|p| (p.0 - x_mean) * (p.1 - y_mean)).sum();
    if xx == 0.0 {
        return None;
    }
    let slope = xy / xx;
    let rest: f64 = logs
        .iter()
        .map(|p| (p.1 - y_mean - slope * (p.0 - x_mean)).powi(2))
        .sum();
    Some((slope, (rest / (n - 2.0) / xx).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_gives_its_exponent_and_a_kink_its_error() {
        let exact: Vec<(f64, f64)> = [0.1, 0.05, 0.02].map(|t| (t, 3.0 * t * t)).to_vec();
        let (slope, error) = observed_order(&exact).unwrap();
        assert!(
            (slope - 2.0).abs() < 1e-12 && error < 1e-12,
            "{slope} {error}"
        );
        // by hand: ln t = -1, 0, 1 and ln error = 0, 1, 0 have slope 0 and error sqrt((2/3) / 2)
        let e = std::f64::consts::E;
        let (slope, error) = observed_order(&[(1.0 / e, 1.0), (1.0, e), (e, 1.0)]).unwrap();
        assert!(slope.abs() < 1e-12);
        assert!((error - (1.0_f64 / 3.0).sqrt()).abs() < 1e-12, "{error}");
    }

    #[test]
    fn zeros_and_failures_take_no_part() {
        let points = [(0.1, 0.0), (0.2, f64::NAN), (0.3, 1.0), (0.4, 2.0)];
        assert_eq!(observed_order(&points), None);
        assert_eq!(observed_order(&[(0.1, 1.0); 4]), None);
    }
}
