/// Eight teeth, 20 mm high, on a drum of 0.2 m: 40 points, counter-clockwise.
pub fn drum_outline() -> Vec<Vector> {
    let tooth = [(-0.10, 0.20), (-0.05, 0.22), (0.05, 0.22), (0.10, 0.20), (0.39, 0.20)];
    (0..8)
        .flat_map(|k| {
            let middle = std::f64::consts::TAU * k as f64 / 8.0;
            tooth.map(|(angle, r): (f64, f64)| {
                let (sin, cos) = (middle + angle).sin_cos();
                Vector::new((r * cos) as Real, (r * sin) as Real)
            })
        })
        .collect()
}

/// A closed outline as a collider.
pub fn outline(points: Vec<Vector>) -> ColliderBuilder {
    let n = points.len() as u32;
    let edges = (0..n).map(|i| [i, (i + 1) % n]).collect();
    ColliderBuilder::oriented_polyline(points, Some(edges))
}
