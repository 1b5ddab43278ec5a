use super::{WearError, all_finite, in_range, same_length};
use crate::dynamics::record::{ContactRecord, SurfacePoint};
use serde::{Deserialize, Serialize};

/// Sum of load and slip on the nodes of a surface over simulated cycles.
///
/// ```text
/// S_i = Σ P_N |γ̄_T| φ_i,   A_i = Σ k |s| φ_i                                        (1)
/// ```
///
/// over the contacts, from the solver's impulses. `φ_i` is the hat function of node `i`: a contact
/// at `t ∈ [0, 1]` of an edge gives `1 − t` of its sum to the node where the edge starts and `t` to
/// the other. `S_i` needs no force and no division by a time step, so an impact counts like
/// sustained contact, and a contact that sticks adds exactly 0 to both. `A_i` is the feedback of
/// depth on `S_i`, see [`Archard::feedback`]: `k` is the stiffness of the contact, `s` its slip.
///
/// Detection names the edge and the place on it, [`SurfacePoint`]. With two points at the ends of
/// every overlap, each with half of its modulus, a pressure that is linear along the surface wears
/// every node by its own pressure, and every wave of the surface decays alike.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LoadSlip {
    sums: Vec<f64>,
    stiffness: Vec<f64>,
    /// The last edge ends at the first node.
    closed: bool,
}

impl LoadSlip {
    /// Zero sums for an open surface of `nodes` nodes.
    pub fn new(nodes: usize) -> Self {
        LoadSlip {
            sums: vec![0.0; nodes],
            stiffness: vec![0.0; nodes],
            closed: false,
        }
    }

    /// Zero sums for a closed outline of `nodes` nodes, whose last edge ends at the first node.
    pub fn ring(nodes: usize) -> Self {
        LoadSlip {
            closed: true,
            ..LoadSlip::new(nodes)
        }
    }

    /// Adds the contacts of one step.
    ///
    /// # Arguments
    /// - `contacts`: the records of the step, [`crate::dynamics::record::StepRecord::contacts`].
    /// - `place_of`: where a contact wears the surface, edge `e` from node `e` to node `e + 1`, or
    ///   `None` for a contact that does not count (another body, another bar):
    ///   [`ContactRecord::place_on`] the worn surface.
    ///
    /// # Errors
    /// [`WearError::NonFinite`] and [`WearError::Range`] for a `load_slip` that is NaN, infinite or
    /// negative; [`WearError::Range`] for an edge that does not exist, or a place outside of [0, 1].
    /// Nothing is added then.
    pub fn add(
        &mut self,
        contacts: &[ContactRecord],
        place_of: impl Fn(&ContactRecord) -> Option<SurfacePoint>,
    ) -> Result<(), WearError> {
        let mut counted = Vec::new();
        for (index, contact) in contacts.iter().enumerate() {
            let Some(SurfacePoint { edge, at }) = place_of(contact) else {
                continue;
            };
            let value = contact.load_slip;
            let finite = value.is_finite() && contact.slip.is_finite();
            if !finite || contact.stiffness.is_nan() {
                return Err(WearError::NonFinite {
                    what: "load_slip of contact",
                    index,
                });
            }
            in_range("load_slip [N m]", value, value >= 0.0, "at least 0")?;
            let inside = (0.0..=1.0).contains(&at);
            in_range("place of a contact on its edge", at, inside, "in [0, 1]")?;
            let node = edge as usize;
            // a contact on the last node may count as the start of an edge
            let last = match node + usize::from(at > 0.0) {
                last if self.closed && last == self.sums.len() => 0,
                last => last,
            };
            in_range(
                "edge of a contact",
                f64::from(edge),
                node.max(last) < self.sums.len(),
                "an edge of the surface",
            )?;
            // also of a rigid contact that sticks, whose stiffness is infinite
            let stiffness = match contact.slip == 0.0 || value == 0.0 {
                true => 0.0,
                false => contact.stiffness * contact.slip.abs(),
            };
            counted.push((node, 1.0 - at, value, stiffness));
            counted.push((last, at, value, stiffness));
        }
        for (node, share, value, stiffness) in counted {
            if share > 0.0 {
                self.sums[node] += share * value;
                self.stiffness[node] += share * stiffness;
            }
        }
        Ok(())
    }

    /// `S_i` [N m], one per node.
    pub fn sums(&self) -> &[f64] {
        &self.sums
    }

    /// `A_i` \[N\], one per node; infinite where a rigid contact slid.
    pub fn stiffness(&self) -> &[f64] {
        &self.stiffness
    }

    /// Adds `share` of another sum, node by node: a mean over bars and revolutions.
    ///
    /// # Errors
    /// [`WearError::Length`]; nothing is added then.
    pub fn add_share(&mut self, other: &LoadSlip, share: f64) -> Result<(), WearError> {
        same_length("load_slip", other.sums.len(), self.sums.len())?;
        for (to, from) in [
            (&mut self.sums, &other.sums),
            (&mut self.stiffness, &other.stiffness),
        ] {
            for (to, from) in to.iter_mut().zip(from) {
                *to += share * from;
            }
        }
        Ok(())
    }
}

/// Archard's wear law.
///
/// ```text
/// h_i = K S_i / w_i                                                        (1)
/// ```
///
/// with `S_i` [N m] the sum of `load_slip` and `w_i` \[m\] the width of the node along the surface;
/// a planar scene is one metre deep, and `S_i` per metre of width. The worn area is
/// `Σ h_i w_i = K Σ S_i` on every mesh: `K` is a property of the two materials and of no mesh.
///
/// # Source
/// Archard (1953); K is the dimensional coefficient `k / H`, wear coefficient by hardness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Archard {
    /// `K` [m²/N], worn volume per load and slip.
    pub coefficient: f64,
}

impl Archard {
    /// Depth of every node, equation (1).
    ///
    /// # Arguments
    /// - `load_slip`: `S_i` [N m], one per node.
    /// - `widths`: tributary widths `w_i` \[m\], one per node.
    ///
    /// # Returns
    /// `h_i` \[m\], for the cycles that `load_slip` sums over; `h_i` is exactly 0 where `S_i` is.
    ///
    /// # Errors
    /// [`WearError::Length`]; [`WearError::NonFinite`]; [`WearError::Range`] for `K < 0`, a width
    /// that is not above 0 or a negative `load_slip`.
    pub fn depths(&self, load_slip: &[f64], widths: &[f64]) -> Result<Vec<f64>, WearError> {
        all_finite("load_slip of node", load_slip)?;
        let depths = self.over_widths(load_slip, widths)?;
        all_finite("depth of node", &depths)?;
        Ok(depths)
    }

    /// Largest feedback of depth on itself over the cycles that `stiffness` sums over,
    ///
    /// ```text
    /// K k S = max_i K A_i / w_i                                                (2)
    /// ```
    ///
    /// with `A_i` \[N\] of [`LoadSlip::stiffness`]. A node that is worn by `δ` more loses `K k S δ` of
    /// the depth of the next jump of as many cycles: explicit wear is stable below 2 and monotone up
    /// to 1, where no node wears more in a jump than its elastic penetration.
    ///
    /// # Returns
    /// A number without unit, 0 if no depth acts on its load, infinite if a rigid contact slid.
    ///
    /// # Errors
    /// Those of [`Archard::depths`].
    pub fn feedback(&self, stiffness: &[f64], widths: &[f64]) -> Result<f64, WearError> {
        let all = self.over_widths(stiffness, widths)?;
        Ok(all.into_iter().fold(0.0, f64::max))
    }

    /// Modulus of a foundation that wears while it is pressed [Pa/m],
    ///
    /// ```text
    /// 1/k' = 1/k + K s                                                         (3)
    /// ```
    ///
    /// A pressure `p` presses it in by `p/k`, and wears it by `K s p` over the sliding distance `s` of
    /// a jump. With `k'` in place of `k` the contact problem is therefore backward-Euler wear: its
    /// load and slip, times the cycles of the jump, are those at the end of the jump. This is stable at
    /// any `K k s`. The load of rigid contacts gets unique shares.
    ///
    /// # Arguments
    /// - `modulus`: `k` [Pa/m], above 0; infinite for rigid contacts.
    /// - `slip`: `s` \[m\], above 0, the same for the whole surface.
    ///
    /// # Errors
    /// [`WearError::Range`], also if nothing gives way: `K = 0` and rigid contacts.
    ///
    /// # Source
    /// Ours; the explicit rule on a Winkler foundation is that of Põdra & Andersson (1999).
    pub fn worn_modulus(&self, modulus: f64, slip: f64) -> Result<f64, WearError> {
        in_range("modulus [Pa/m]", modulus, modulus > 0.0, "above 0")?;
        let inside = slip > 0.0 && slip.is_finite();
        in_range("sliding distance [m]", slip, inside, "finite and above 0")?;
        let k = self.coefficient;
        let finite = "finite and at least 0";
        in_range("K [m²/N]", k, k >= 0.0 && k.is_finite(), finite)?;
        let compliance = 1.0 / modulus + k * slip;
        in_range("compliance [m/Pa]", compliance, compliance > 0.0, "above 0")?;
        Ok(1.0 / compliance)
    }

    /// `K v_i / w_i`; exactly 0 where `v_i` is.
    fn over_widths(&self, values: &[f64], widths: &[f64]) -> Result<Vec<f64>, WearError> {
        same_length("load_slip", values.len(), widths.len())?;
        all_finite("width of node", widths)?;
        let k = self.coefficient;
        let finite = "finite and at least 0";
        in_range("K [m²/N]", k, k >= 0.0 && k.is_finite(), finite)?;
        let mut found = Vec::with_capacity(widths.len());
        for (&v, &w) in values.iter().zip(widths) {
            in_range("load_slip [N m]", v, v >= 0.0, "at least 0")?;
            in_range("tributary width [m]", w, w > 0.0, "above 0")?;
            found.push(if v == 0.0 { 0.0 } else { k * v / w });
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Vec2;
    use crate::dynamics::record::ContactStatus;

    fn record(edge: u32, at: f64, load_slip: f64, status: ContactStatus) -> ContactRecord {
        ContactRecord {
            time: 0.0,
            bodies: [0, 1],
            surfaces: [7, 8],
            places: [SurfacePoint { edge, at }, SurfacePoint::default()],
            position: Vec2::zeros(),
            normal: Vec2::y(),
            gap: 0.0,
            impulse_n: 1.0,
            impulse_t: 0.0,
            moments: [None; 2],
            slip: if status == ContactStatus::Stick {
                0.0
            } else {
                -0.5
            },
            load_slip,
            friction_work: 0.0,
            normal_work: 0.0,
            stiffness: 8.0,
            status,
        }
    }

    #[test]
    fn impacts_count_sticking_does_not_and_others_are_left_out() {
        let mut sum = LoadSlip::new(3);
        let contacts = [
            record(0, 0.0, 0.25, ContactStatus::SlipPlus),
            record(0, 0.25, 0.5, ContactStatus::Impact),
            ContactRecord {
                stiffness: f64::INFINITY,
                ..record(1, 1.0, 0.0, ContactStatus::Stick)
            },
            ContactRecord {
                surfaces: [8, 9],
                ..record(0, 0.0, 9.0, ContactStatus::SlipMinus)
            },
        ];
        sum.add(&contacts, |c| c.place_on(7)).unwrap();
        assert_eq!(sum.sums(), [0.625, 0.125, 0.0]);
        assert_eq!(sum.stiffness(), [7.0, 1.0, 0.0]);
        let mut mean = LoadSlip::new(3);
        mean.add_share(&sum, 0.5).unwrap();
        assert_eq!(mean.sums(), [0.3125, 0.0625, 0.0]);
        assert!(mean.add_share(&LoadSlip::new(2), 1.0).is_err());
    }

    #[test]
    fn a_bad_record_adds_nothing() {
        let mut sum = LoadSlip::new(2);
        let slides = ContactStatus::SlipPlus;
        let contacts = [
            record(0, 0.0, 1.0, slides),
            record(0, 0.0, f64::NAN, slides),
        ];
        let bad = sum.add(&contacts, |c| c.place_on(7));
        assert!(matches!(bad, Err(WearError::NonFinite { index: 1, .. })));
        for (edge, at) in [(1, 0.5), (2, 0.0), (0, 1.5), (0, f64::NAN)] {
            let outside = sum.add(&contacts[..1], |_| Some(SurfacePoint { edge, at }));
            assert!(
                matches!(outside, Err(WearError::Range { .. })),
                "{edge} {at}"
            );
        }
        assert_eq!(sum, LoadSlip::new(2));
        // the last node, by either of its names
        for (edge, at) in [(1, 0.0), (0, 1.0)] {
            let place = SurfacePoint { edge, at };
            sum.add(&contacts[..1], |_| Some(place)).unwrap();
        }
        assert_eq!(sum.sums(), [0.0, 2.0]);
        // the last edge of a ring ends at its first node
        let mut ring = LoadSlip::ring(2);
        let place = SurfacePoint { edge: 1, at: 0.25 };
        ring.add(&contacts[..1], |_| Some(place)).unwrap();
        assert_eq!(ring.sums(), [0.25, 0.75]);
    }

    /// Two points at the ends of each edge, half of the edge's load each: a pressure that is linear
    /// along the surface wears every node by its own pressure, also the ends, and the cell of
    /// 3 mm between cells of 1 mm.
    #[test]
    fn a_linear_pressure_wears_each_node_by_its_own() {
        let x = [0.0, 1e-3, 2e-3, 5e-3, 6e-3];
        let pressure = |x: f64| 1e6 * (1.0 + 100.0 * x);
        let mut sum = LoadSlip::new(5);
        for edge in 0..4 {
            let half = 0.5 * (x[edge + 1] - x[edge]);
            let ends = [(0.0, x[edge]), (1.0, x[edge + 1])];
            let contacts = ends.map(|(at, x)| {
                record(edge as u32, at, half * pressure(x), ContactStatus::SlipPlus)
            });
            sum.add(&contacts, |c| c.place_on(7)).unwrap();
        }
        let widths = [0.5e-3, 1e-3, 2e-3, 2e-3, 0.5e-3];
        let law = Archard { coefficient: 1e-9 };
        let depths = law.depths(sum.sums(), &widths).unwrap();
        for (h, x) in depths.iter().zip(x) {
            // a few roundings of numbers near 1e-3
            assert!((h / (1e-9 * pressure(x)) - 1.0).abs() < 1e-14, "{x}: {h}");
        }
    }

    #[test]
    fn feedback_is_the_largest_of_all_nodes() {
        let law = Archard { coefficient: 0.5 };
        let of = |stiffness: &[f64]| law.feedback(stiffness, &[2.0, 1.0]);
        assert_eq!(of(&[2.0, 3.0]), Ok(1.5));
        assert_eq!(of(&[0.0, 0.0]), Ok(0.0));
        assert_eq!(of(&[f64::INFINITY, 0.0]), Ok(f64::INFINITY));
        assert!(of(&[f64::NAN, 0.0]).is_err());
        assert_eq!(law.worn_modulus(0.5, 4.0), Ok(0.25));
        assert_eq!(law.worn_modulus(f64::INFINITY, 4.0), Ok(0.5));
        for (modulus, slip) in [
            (0.0, 1.0),
            (1.0, 0.0),
            (f64::NAN, 1.0),
            (1.0, f64::INFINITY),
        ] {
            assert!(law.worn_modulus(modulus, slip).is_err(), "{modulus} {slip}");
        }
        let steady = Archard { coefficient: 0.0 };
        assert!(steady.worn_modulus(f64::INFINITY, 1.0).is_err());
        assert!(matches!(
            law.depths(&[1.0], &[2.0, 1.0]),
            Err(WearError::Length { .. })
        ));
        assert!(matches!(
            law.depths(&[-1.0, 0.0], &[2.0, 1.0]),
            Err(WearError::Range { .. })
        ));
    }
}
