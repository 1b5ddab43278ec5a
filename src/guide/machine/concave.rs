/// From 200 to 340 degrees about the drum's axis in segments of 5, clockwise.
pub fn concave() -> ColliderBuilder {
    let points: Vec<Vector> = (0..=28)
        .map(|i| {
            let (sin, cos) = (340.0 - 5.0 * i as f64).to_radians().sin_cos();
            Vector::new((0.23 * cos) as Real, (0.23 * sin) as Real)
        })
        .collect();
    let edges = (0..28).map(|i| [i, i + 1]).collect();
    ColliderBuilder::oriented_polyline(points, Some(edges))
}
