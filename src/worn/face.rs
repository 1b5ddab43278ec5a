use super::WornError;
use crate::contact::Vec2;
use crate::dynamics::{Pose64, SurfacePoint};
use crate::rapier::{MOST_CELLS, Outline, Piece};
use crate::wear::{Profile, WearError, check_chain, check_polygon};
use serde::{Deserialize, Serialize};

/// The part of an outline that wears, and its place in the frame of its profile.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Face {
    /// Corners of the outline that do not wear, before and after those that do; a closed outline
    /// starts with those that do.
    before: Vec<Vec2>,
    after: Vec<Vec2>,
    closed: bool,
    /// Frame of the profile in that of the collider: its x axis along the chord.
    frame: Pose64,
}

/// A face with its first profile and the size of its cells \[m\].
pub(super) type Cut = (Face, Profile, f64);

impl Face {
    /// Cuts what wears out of an outline.
    ///
    /// # Arguments
    /// - `edges`: the first and the last of the edges that wear; all without.
    /// - `cell`: length of a cell \[m\]; without, that of the shortest edge that wears.
    /// - `surface`: the number of the surface, for errors.
    pub fn cut(
        outline: &Outline,
        edges: Option<[usize; 2]>,
        cell: Option<f64>,
        surface: usize,
    ) -> Result<Cut, WornError> {
        let wear = |source| WornError::Wear { surface, source };
        let (points, n) = (&outline.points, outline.points.len());
        let count = if outline.closed {
            n
        } else {
            n.saturating_sub(1)
        };
        let (first, worn) = range(edges, count, outline.closed)?;
        let corner = |k: usize| points[(first + k) % n];
        let length = |k: usize| (corner(k + 1) - corner(k)).norm();
        let shortest = (0..worn).min_by(|a, b| length(*a).total_cmp(&length(*b)));
        let shortest = shortest.map_or((first, 0.0), |k| ((first + k) % count, length(k)));
        let mut cell = cell.unwrap_or(shortest.1);
        if !(cell > 0.0 && cell <= 2.0 * shortest.1) {
            let (edge, length) = shortest;
            return Err(WornError::Cell { cell, edge, length });
        }
        // a profile has at least three nodes
        if worn == 1 {
            cell = cell.min(0.5 * shortest.1);
        }
        let parts = |k: usize| (length(k) / cell).round().max(1.0);
        let cells: f64 = (0..worn).map(parts).sum();
        // false for an edge that is not finite
        let few = cells <= MOST_CELLS as f64;
        if !few {
            return Err(WornError::Cells { cell, cells });
        }
        let mut nodes = Vec::new();
        for k in 0..worn {
            let along = (corner(k + 1) - corner(k)) / parts(k);
            nodes.extend((0..parts(k) as usize).map(|j| corner(k) + along * j as f64));
        }
        if outline.closed && worn == n {
            let face = Face {
                before: Vec::new(),
                after: Vec::new(),
                closed: true,
                frame: Pose64::new(Vec2::zeros(), 0.0),
            };
            // the solid of a profile is on its right
            nodes.reverse();
            return Ok((face, Profile::ring(nodes).map_err(wear)?, cell));
        }
        nodes.push(corner(worn));
        let chord = corner(0) - corner(worn);
        let along = chord.try_normalize(0.0).unwrap_or_else(Vec2::x);
        let frame = Pose64 {
            translation: Vec2::zeros(),
            cos: along.x,
            sin: along.y,
        };
        nodes.reverse();
        let nodes: Vec<Vec2> = nodes.iter().map(|p| frame.unrotate(*p)).collect();
        let (before, after) = match outline.closed {
            true => (Vec::new(), (worn + 1..n).map(corner).collect()),
            false => (
                points[..first].to_vec(),
                points[first + worn + 1..].to_vec(),
            ),
        };
        // the edges beside what wears, out of the solid; where an open outline ends, its own normal
        let face = |from: Option<Vec2>, to: Vec2, normal: Vec2| {
            from.map_or(normal, |from| frame.unrotate(to - from))
        };
        let neighbours = match outline.closed {
            true => [Some(corner(worn + 1)), Some(corner(n - 1))],
            false => [after.first().copied(), before.last().copied()],
        };
        let profile = Profile::new(nodes).map_err(wear)?;
        let normals = profile.normals();
        let faces = [
            face(neighbours[0], corner(worn), normals[0]),
            face(neighbours[1], corner(0), normals[normals.len() - 1]),
        ];
        let profile = profile.between(faces).map_err(wear)?;
        let face = Face {
            before,
            after,
            closed: outline.closed,
            frame,
        };
        Ok((face, profile, cell))
    }

    /// The whole outline with the worn profile in its place.
    pub fn outline(&self, profile: &Profile) -> Outline {
        let worn = profile.nodes().iter().rev().map(|p| self.frame.rotate(*p));
        let before = self.before.iter().copied();
        Outline {
            points: before
                .chain(worn)
                .chain(self.after.iter().copied())
                .collect(),
            closed: self.closed,
        }
    }

    /// How thick the solid is under the nodes of a profile that are asked for, along their normals, as pairs
    /// of node and thickness \[m\]; infinite with nothing behind. The ends of an open profile are left out:
    /// they lie on the faces beside it.
    pub fn thickness<'a>(
        &self,
        profile: &'a Profile,
        asked: impl Fn(usize) -> bool + 'a,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let outline = self.outline(profile);
        let frame = self.frame;
        let ends = usize::from(!profile.is_ring());
        let nodes = ends..profile.node_count() - ends;
        let normals = profile.normals();
        nodes.filter(move |node| asked(*node)).map(move |node| {
            let from = frame.rotate(profile.nodes()[node]);
            (node, through(&outline, from, -frame.rotate(normals[node])))
        })
    }

    /// Checks that the outline does not cross itself.
    pub fn check(outline: &Outline, hollow: bool) -> Result<(), WearError> {
        match (outline.closed, hollow) {
            (false, _) => check_chain(&outline.points),
            (true, false) => check_polygon(&outline.points),
            (true, true) => {
                let turned: Vec<Vec2> = outline.points.iter().rev().copied().collect();
                check_polygon(&turned)
            }
        }
    }

    /// The place on the profile of a place on the outline; `None` where it does not wear.
    pub fn place(&self, profile: &Profile, place: SurfacePoint) -> Option<SurfacePoint> {
        let cells = profile.edge_count() as u32;
        let edge = place.edge.checked_sub(self.before.len() as u32)?;
        if edge >= cells {
            return None;
        }
        // the last edge of a ring stays the last
        let turned = match profile.is_ring() {
            true => (2 * cells - 2 - edge) % cells,
            false => cells - 1 - edge,
        };
        Some(SurfacePoint {
            edge: turned,
            at: 1.0 - place.at,
        })
    }

    /// A point of the profile's frame in the frame of the collider.
    pub fn in_collider(&self, point: Vec2) -> Vec2 {
        self.frame.rotate(point)
    }

    /// What lies between a profile and the worn one, of this density [kg/m²].
    pub fn piece(&self, before: &Profile, after: &Profile, density: f64) -> Piece {
        let mut area = Moments::default();
        area.add(before, 1.0);
        area.add(after, -1.0);
        if !before.is_ring() {
            let ends = |p: &Profile| [p.nodes()[0], p.nodes()[p.node_count() - 1]];
            let ([a, b], [c, d]) = (ends(before), ends(after));
            area.edge(b, d, 1.0);
            area.edge(c, a, 1.0);
        }
        let Moments {
            area,
            first,
            second,
        } = area;
        if area == 0.0 {
            return Piece::default();
        }
        let centre = first / area;
        Piece {
            mass: density * area,
            centre: self.frame.rotate(centre),
            inertia: density * (second - area * centre.norm_squared()),
        }
    }
}

/// How far a ray from a corner of an outline runs until it meets an edge that does not start or end there.
fn through(outline: &Outline, from: Vec2, along: Vec2) -> f64 {
    let points = &outline.points;
    let edges = points.len() - usize::from(!outline.closed);
    let meets = |k: usize| {
        let (a, b) = (points[k], points[(k + 1) % points.len()]);
        if a == from || b == from {
            return None;
        }
        // from + t along = a + s (b − a)
        let (edge, start) = (b - a, a - from);
        let turn = along.perp(&edge);
        let (t, s) = (start.perp(&edge) / turn, start.perp(&along) / turn);
        (t > 0.0 && (0.0..=1.0).contains(&s)).then_some(t)
    };
    (0..edges).filter_map(meets).fold(f64::INFINITY, f64::min)
}

/// The first edge that wears and how many do.
fn range(
    edges: Option<[usize; 2]>,
    count: usize,
    closed: bool,
) -> Result<(usize, usize), WornError> {
    let Some([first, last]) = edges else {
        return Ok((0, count));
    };
    let order = match closed {
        true => "",
        false => ", in this order on an open one",
    };
    if first.max(last) >= count || (!closed && last < first) {
        let found = [first, last];
        let last = count.saturating_sub(1);
        return Err(WornError::Edges { found, last, order });
    }
    Ok((first, (last + count - first) % count + 1))
}

/// Moments of the area to the right of a path, about the origin.
#[derive(Default)]
struct Moments {
    area: f64,
    first: Vec2,
    second: f64,
}

impl Moments {
    fn add(&mut self, profile: &Profile, sign: f64) {
        let nodes = profile.nodes();
        for k in 0..profile.edge_count() {
            self.edge(nodes[k], nodes[(k + 1) % nodes.len()], sign);
        }
    }

    /// The triangle of an edge and the origin, by Green's theorem.
    fn edge(&mut self, a: Vec2, b: Vec2, sign: f64) {
        let twice = -sign * a.perp(&b);
        self.area += 0.5 * twice;
        self.first += (a + b) * (twice / 6.0);
        self.second += twice * (a.norm_squared() + a.dot(&b) + b.norm_squared()) / 12.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline(xy: &[(f64, f64)], closed: bool) -> Outline {
        Outline {
            points: xy.iter().map(|&(x, y)| Vec2::new(x, y)).collect(),
            closed,
        }
    }

    fn square() -> Outline {
        outline(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)], true)
    }

    #[test]
    fn a_lower_face_is_cut_out_and_put_back() {
        let (face, profile, cell) = Face::cut(&square(), Some([0, 0]), Some(1.0), 0).unwrap();
        assert_eq!((profile.node_count(), cell), (5, 1.0));
        // turned over, along its chord
        assert_eq!(profile.nodes()[0], Vec2::new(-4.0, 0.0));
        let back = face.outline(&profile);
        assert_eq!(back.points.len(), 7);
        assert_eq!(back.points[..2], [Vec2::zeros(), Vec2::new(1.0, 0.0)]);
        assert_eq!(back.points[5..], square().points[2..]);
        // a quarter along the first cell is three quarters along the last edge of the profile
        let on = |edge, at| face.place(&profile, SurfacePoint { edge, at });
        let expected = SurfacePoint { edge: 3, at: 0.75 };
        assert_eq!(on(0, 0.25), Some(expected));
        assert_eq!(on(4, 0.0), None);
    }

    #[test]
    fn places_on_an_open_outline_and_on_a_ring_are_those_of_the_same_point() {
        let open = outline(
            &[(3.0, 0.0), (2.0, 0.0), (1.0, 0.5), (0.0, 0.0), (-1.0, 0.0)],
            false,
        );
        let cases = [
            (open.clone(), None),
            (open, Some([1, 2])),
            (square(), None),
            (square(), Some([3, 0])),
        ];
        for (outline, edges) in cases {
            // an edge that leads straight on has no face for the ends to move along
            let (face, profile, _) = match Face::cut(&outline, edges, Some(1.0), 0) {
                Ok(cut) => cut,
                Err(error) => {
                    assert!(matches!(error, WornError::Wear { .. }), "{error}");
                    assert_eq!(edges, Some([1, 2]));
                    continue;
                }
            };
            let whole = face.outline(&profile);
            Face::check(&whole, false).unwrap();
            let n = whole.points.len();
            for edge in 0..n {
                let place = SurfacePoint {
                    edge: edge as u32,
                    at: 0.25,
                };
                let Some(on) = face.place(&profile, place) else {
                    continue;
                };
                let (a, b) = (whole.points[edge], whole.points[(edge + 1) % n]);
                let nodes = profile.nodes();
                let k = on.edge as usize;
                let (c, d) = (nodes[k], nodes[(k + 1) % nodes.len()]);
                let found = face.in_collider(c + on.at * (d - c));
                assert!((found - (a + 0.25 * (b - a))).norm() < 1e-15, "{edge}");
            }
        }
    }

    #[test]
    fn a_square_is_as_thick_as_it_is_wide() {
        let (face, profile, _) = Face::cut(&square(), Some([0, 0]), Some(1.0), 0).unwrap();
        let found: Vec<(usize, f64)> = face.thickness(&profile, |node| node != 2).collect();
        assert_eq!(found, [(1, 4.0), (3, 4.0)]);
        // from the corners of a whole outline to those across
        let (face, profile, _) = Face::cut(&square(), None, Some(4.0), 0).unwrap();
        for (_, thick) in face.thickness(&profile, |_| true) {
            assert!((thick - 32f64.sqrt()).abs() < 1e-14, "{thick}");
        }
        let ground = outline(&[(2.0, 0.0), (1.0, 0.0), (0.0, 0.0)], false);
        let (face, profile, _) = Face::cut(&ground, None, None, 0).unwrap();
        assert_eq!(
            face.thickness(&profile, |_| true).next(),
            Some((1, f64::INFINITY))
        );
    }

    #[test]
    fn a_piece_has_the_mass_of_what_is_gone() {
        let (face, profile, _) = Face::cut(&square(), Some([0, 0]), Some(2.0), 0).unwrap();
        let worn: Vec<Vec2> = (profile.nodes().iter())
            .map(|p| p - Vec2::new(0.0, 1.0))
            .collect();
        let piece = face.piece(&profile, &Profile::new(worn).unwrap(), 3.0);
        // a bar of 4 by 1
        assert!((piece.mass - 12.0).abs() < 1e-14, "{piece:?}");
        assert!(
            (piece.centre - Vec2::new(2.0, 0.5)).norm() < 1e-14,
            "{piece:?}"
        );
        assert!((piece.inertia - 17.0).abs() < 1e-13, "{piece:?}");
    }

    #[test]
    fn edges_and_cells_that_cannot_be_are_refused() {
        let cut = |edges, cell| Face::cut(&square(), edges, cell, 0).map(|_| ());
        let said = |edges, cell| cut(edges, cell).unwrap_err().to_string();
        assert!(said(Some([0, 4]), None).contains("0 to 3"));
        assert!(said(None, Some(8.1)).contains("a cell may have twice that"));
        assert!(said(None, Some(1e-9)).contains("16000000000 cells, at most 10000"));
        assert!(cut(None, Some(f64::NAN)).is_err());
        assert!(cut(None, Some(0.0)).is_err());
        assert!(cut(Some([3, 1]), None).is_ok());
        let open = outline(&[(0.0, 0.0), (0.0, 1.0), (1.0, 1.0)], false);
        assert!(Face::cut(&open, Some([1, 0]), None, 0).is_err());
    }
}
