use super::polygon::{check_nodes, check_polygon, crossing, crossing_of_ring};
use super::{WearError, in_range};
use crate::contact::Vec2;
use serde::{Deserialize, Serialize};

/// The worn surface: a polyline of nodes in the frame of the part, open or a ring.
///
/// It runs with the solid on its right, see [`crate::wear`]: an open one from the tall end to the toe,
/// a ring clockwise round a solid and counter-clockwise round a hollow. The two ends of an open one lie
/// on faces of the part: wear moves them along these faces, by default straight down.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    nodes: Vec<Vec2>,
    rim: Rim,
}

/// What the surface ends at.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Rim {
    /// Faces of the part along these directions, out of the solid.
    Faces([Vec2; 2]),
    /// Nothing: the last node is joined to the first.
    Ring,
}

impl Profile {
    /// A profile through the given nodes \[m\].
    ///
    /// # Errors
    /// [`WearError::TooFewNodes`] below 3; [`WearError::NonFinite`]; [`WearError::ZeroEdge`];
    /// [`WearError::Crossing`]; [`WearError::Winding`] if the last node is not to the right of the
    /// first.
    pub fn new(nodes: Vec<Vec2>) -> Result<Self, WearError> {
        Self::unchecked(nodes)?.simple()
    }

    /// A closed surface through the given nodes \[m\], the last joined to the first.
    ///
    /// # Errors
    /// [`WearError::TooFewNodes`] below 4; [`WearError::NonFinite`]; [`WearError::ZeroEdge`];
    /// [`WearError::Crossing`]; [`WearError::Winding`] if it encloses no area.
    pub fn ring(nodes: Vec<Vec2>) -> Result<Self, WearError> {
        let rim = Rim::Ring;
        Profile { nodes, rim }.usable()?.simple()
    }

    /// The same open surface between two faces of the part along which its ends wear.
    ///
    /// # Arguments
    /// - `faces`: direction out of the solid of the face at the first node and of that at the last; any
    ///   length. Straight down is `(0, 1)` for both.
    ///
    /// # Errors
    /// [`WearError::Range`] for a ring, or a face that does not rise above the surface beside it by at
    /// least 30 degrees: an end would run far along it.
    pub fn between(mut self, faces: [Vec2; 2]) -> Result<Self, WearError> {
        let normals = self.normals();
        let ends = [normals[0], normals[normals.len() - 1]];
        let unit = faces.map(|f| f.try_normalize(0.0).unwrap_or_else(Vec2::zeros));
        for (face, normal) in unit.iter().zip(ends) {
            let rise = face.dot(&normal);
            let inside = rise >= 0.5 && !self.is_ring();
            let allowed = "at least 0.5: the next edge leads on and must wear as well";
            in_range(
                "rise of the face at an end of what wears",
                rise,
                inside,
                allowed,
            )?;
        }
        self.rim = Rim::Faces(unit);
        Ok(self)
    }

    /// Like [`Profile::new`], but accepts a crossing, for [`clip_loops`](super::clip_loops).
    pub(super) fn unchecked(nodes: Vec<Vec2>) -> Result<Self, WearError> {
        let rim = Rim::Faces([Vec2::y(); 2]);
        Profile { nodes, rim }.usable()
    }

    /// This surface with other nodes, which may cross.
    pub(super) fn moved(&self, nodes: Vec<Vec2>) -> Result<Self, WearError> {
        let rim = self.rim;
        Profile { nodes, rim }.usable()
    }

    fn usable(self) -> Result<Self, WearError> {
        let (found, needed) = (self.nodes.len(), if self.is_ring() { 4 } else { 3 });
        if found < needed {
            return Err(WearError::TooFewNodes { found, needed });
        }
        check_nodes(&self.nodes)?;
        let last = self.nodes.len() - 1;
        let measure = match self.rim {
            Rim::Faces(_) => self.nodes[last].x - self.nodes[0].x,
            Rim::Ring if self.nodes[last] == self.nodes[0] => {
                return Err(WearError::ZeroEdge { node: last });
            }
            Rim::Ring => self.area_above(0.0).abs(),
        };
        if measure > 0.0 {
            Ok(self)
        } else {
            Err(WearError::Winding { measure })
        }
    }

    /// Itself, unless two of its edges cross.
    pub(super) fn simple(self) -> Result<Self, WearError> {
        let found = match self.rim {
            Rim::Faces(_) => crossing(&self.nodes, |_, _| false),
            Rim::Ring => crossing_of_ring(&self.nodes),
        };
        match found {
            Some((first, second)) => Err(WearError::Crossing { first, second }),
            None => Ok(self),
        }
    }

    /// Whether the last node is joined to the first.
    pub fn is_ring(&self) -> bool {
        self.rim == Rim::Ring
    }

    /// Directions of the faces at the two ends, as unit vectors; `None` for a ring.
    pub(super) fn faces(&self) -> Option<[Vec2; 2]> {
        match self.rim {
            Rim::Faces(faces) => Some(faces),
            Rim::Ring => None,
        }
    }

    /// Number of edges: one fewer than nodes, as many on a ring.
    pub fn edge_count(&self) -> usize {
        self.nodes.len() - usize::from(!self.is_ring())
    }

    /// Start and end of every edge.
    pub(super) fn edge_ends(&self) -> impl Iterator<Item = [usize; 2]> {
        let n = self.nodes.len();
        (0..self.edge_count()).map(move |i| [i, (i + 1) % n])
    }

    /// `y = α x² + β x + γ` at equal stations `x_i = i · width / (nodes − 1)`.
    ///
    /// The study's tooth is α = −5.539 1/m, β = −0.1014, γ = 0.0188 m, width 0.05 m, 26 nodes.
    ///
    /// # Errors
    /// [`WearError::Range`] unless `width` is finite and above 0; those of [`Profile::new`].
    pub fn quadratic(
        alpha: f64,
        beta: f64,
        gamma: f64,
        width: f64,
        nodes: usize,
    ) -> Result<Self, WearError> {
        let inside = width > 0.0 && width.is_finite();
        in_range("profile width [m]", width, inside, "finite and above 0")?;
        if nodes < 3 {
            return Err(WearError::TooFewNodes {
                found: nodes,
                needed: 3,
            });
        }
        let last = (nodes - 1) as f64;
        let at = |i: usize| {
            let x = width * (i as f64 / last);
            Vec2::new(x, (alpha * x + beta) * x + gamma)
        };
        Self::new((0..nodes).map(at).collect())
    }

    /// The profile with every node below `floor` \[m\] raised to it, `y = max(y, floor)`.
    ///
    /// For a new part only: the study's quadratic dips 0.12 mm below its base line at the toe,
    /// where the real tooth does not. Wear may later move the nodes below the floor.
    ///
    /// # Errors
    /// Those of [`Profile::new`].
    pub fn raised_to(&self, floor: f64) -> Result<Self, WearError> {
        let raise = |p: &Vec2| Vec2::new(p.x, if p.y < floor { floor } else { p.y });
        self.moved(self.nodes.iter().map(raise).collect())?.simple()
    }

    /// Nodes \[m\], tall end first.
    pub fn nodes(&self) -> &[Vec2] {
        &self.nodes
    }

    /// Number of nodes, at least 3.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Length of every edge \[m\]: one fewer than nodes, as many on a ring.
    pub fn edges(&self) -> Vec<f64> {
        self.edge_ends()
            .map(|[a, b]| (self.nodes[b] - self.nodes[a]).norm())
            .collect()
    }

    /// Length of the shortest edge \[m\].
    pub fn shortest_edge(&self) -> f64 {
        self.edges().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Area vector of every node \[m\], `N_i = ½ J (x_{i+1} − x_{i−1})` with `J` the turn by +90
    /// degrees; an end uses itself in place of the missing neighbour, a ring has no ends.  (1)
    ///
    /// The gradient of the area under the profile: moving node `i` by `δ` changes it by `N_i · δ`,
    /// exactly. Its direction is the outward normal, its length the tributary width.
    pub fn area_vectors(&self) -> Vec<Vec2> {
        let last = self.nodes.len() - 1;
        let beside = |i: usize| match self.rim {
            Rim::Faces(_) => [i.saturating_sub(1), (i + 1).min(last)],
            Rim::Ring => [(i + last) % (last + 1), (i + 1) % (last + 1)],
        };
        (0..=last)
            .map(|i| {
                let [before, after] = beside(i);
                let chord = self.nodes[after] - self.nodes[before];
                0.5 * Vec2::new(-chord.y, chord.x)
            })
            .collect()
    }

    /// Unit outward normal of every node, along equation (1) of [`Profile::area_vectors`].
    pub fn normals(&self) -> Vec<Vec2> {
        // a chord of length 0 is a spike of no width; any direction will do there
        let unit = |v: Vec2| v.try_normalize(0.0).unwrap_or(Vec2::y());
        self.area_vectors().into_iter().map(unit).collect()
    }

    /// Tributary width of every node along the surface \[m\], `w_i = |N_i|`: for depths along the
    /// normal. On a flat of 2 mm edges: 2 mm, and 1 mm at both ends.
    pub fn widths(&self) -> Vec<f64> {
        self.area_vectors().iter().map(|v| v.norm()).collect()
    }

    /// Tributary width of every node along `x` \[m\]: for vertical depths.
    pub fn spans(&self) -> Vec<f64> {
        self.area_vectors().iter().map(|v| v.y).collect()
    }

    /// The highest node and its height `max y` \[m\].
    pub fn highest(&self) -> (usize, f64) {
        let mut best = (0, self.nodes[0].y);
        for (i, p) in self.nodes.iter().enumerate() {
            if p.y > best.1 {
                best = (i, p.y);
            }
        }
        best
    }

    /// Height above the base line, `max y` \[m\].
    pub fn height(&self) -> f64 {
        self.highest().1
    }

    /// Area between the profile and the line `y = level` \[m²\], negative below it. For a ring the
    /// area of the solid that it encloses, minus that of a hollow.
    pub fn area_above(&self, level: f64) -> f64 {
        let ends = self.edge_ends();
        ends.map(|[a, b]| strip(self.nodes[a], self.nodes[b], level))
            .sum()
    }

    /// Area \[m²\] between this profile and what is left of it, with its ends on the same faces.
    pub fn area_over(&self, worn: &Profile) -> f64 {
        let lost = self.area_above(0.0) - worn.area_above(0.0);
        if self.is_ring() {
            return lost;
        }
        // upright faces have no part in the areas above a line
        let ends = |p: &Profile| [p.nodes[0], p.nodes[p.nodes.len() - 1]];
        let ([a, b], [c, d]) = (ends(self), ends(worn));
        lost + strip(b, d, 0.0) + strip(c, a, 0.0)
    }

    /// Closed counter-clockwise outline \[m\] of the part: the profile on a base `base` \[m\]
    /// thick, whose underside is `y = −base`; of an open profile between upright faces.
    ///
    /// # Returns
    /// Underside from left to right, then the profile from toe to tall end.
    ///
    /// # Errors
    /// [`WearError::WornThrough`] if a node has reached the underside; [`WearError::Crossing`];
    /// [`WearError::Winding`]; [`WearError::Range`] unless `base` is finite and above 0.
    pub fn outline(&self, base: f64) -> Result<Vec<Vec2>, WearError> {
        let inside = base > 0.0 && base.is_finite();
        in_range("base thickness [m]", base, inside, "finite and above 0")?;
        if let Some(node) = self.nodes.iter().position(|p| p.y <= -base) {
            let y = self.nodes[node].y;
            return Err(WearError::WornThrough { node, y, base });
        }
        let (first, last) = (self.nodes[0], self.nodes[self.nodes.len() - 1]);
        let mut polygon = vec![Vec2::new(first.x, -base), Vec2::new(last.x, -base)];
        polygon.extend(self.nodes.iter().rev());
        check_polygon(&polygon)?;
        Ok(polygon)
    }
}

/// Area between an edge and the line `y = level`.
fn strip(a: Vec2, b: Vec2, level: f64) -> f64 {
    0.5 * (b.x - a.x) * (a.y + b.y - 2.0 * level)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wear::signed_area;

    fn tooth() -> Profile {
        Profile::quadratic(-5.539, -0.1014, 0.0188, 0.05, 26).unwrap()
    }

    #[test]
    fn the_tooth_of_the_study() {
        let tooth = tooth();
        assert_eq!(tooth.highest(), (0, 0.0188));
        // spans are 2 mm and 1 mm at the ends, to the round-off of 0.05
        for (i, span) in tooth.spans().into_iter().enumerate() {
            let expected = if i == 0 || i == 25 { 1e-3 } else { 2e-3 };
            assert!((span - expected).abs() < 1e-17);
        }
        // the normal turns with the slope y' = 2 α x + β: exact for a quadratic inside
        let slope = 2.0 * -5.539 * 0.02 - 0.1014;
        let n = tooth.normals()[10];
        assert!((n - Vec2::new(-slope, 1.0).normalize()).norm() < 1e-13);
        // it dips 0.12 mm below the base line at the toe, and the outline does not
        assert!((tooth.nodes()[25].y + 1.175e-4).abs() < 1e-9);
        let raised = tooth.raised_to(0.0).unwrap();
        assert_eq!(raised.nodes()[25].y, 0.0);
        assert_eq!(raised.nodes()[..25], tooth.nodes()[..25]);
    }

    #[test]
    fn the_outline_is_counter_clockwise_and_holds_base_and_tooth() {
        let tooth = tooth().raised_to(0.0).unwrap();
        let outline = tooth.outline(8e-3).unwrap();
        assert_eq!(outline.len(), 28);
        // two sums of the same 1e-3 m²: a few ulp
        let expected = tooth.area_above(0.0) + 0.05 * 8e-3;
        assert!((signed_area(&outline) - expected).abs() < 1e-17);
        let low: Vec<_> = tooth.nodes().iter().map(|p| p - 9e-3 * Vec2::y()).collect();
        assert!(matches!(
            Profile::new(low).unwrap().outline(8e-3),
            Err(WearError::WornThrough { node: 25, .. })
        ));
    }

    #[test]
    fn bad_profiles_are_refused() {
        let p =
            |xy: &[(f64, f64)]| Profile::new(xy.iter().map(|&(x, y)| Vec2::new(x, y)).collect());
        assert!(matches!(
            p(&[(1.0, 0.0), (0.5, 0.0), (0.0, 0.0)]),
            Err(WearError::Winding { .. })
        ));
        assert!(matches!(
            p(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.5, -1.0), (2.0, 0.0)]),
            Err(WearError::Crossing {
                first: 0,
                second: 2
            })
        ));
        assert!(matches!(
            p(&[(0.0, 0.0), (1.0, 0.0)]),
            Err(WearError::TooFewNodes { .. })
        ));
        assert!(matches!(
            Profile::quadratic(f64::NAN, 0.0, 0.0, 1.0, 5),
            Err(WearError::NonFinite { .. })
        ));
    }
}
