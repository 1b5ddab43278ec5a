use super::{WearError, all_finite, in_range, same_length};
use crate::dynamics::record::ContactRecord;
use serde::{Deserialize, Serialize};

/// Sum of `load_slip` per cell over simulated cycles.
///
/// `S_i = Σ P_N |γ̄_T|` over the contacts of cell `i`                                   (1)
///
/// from the solver's impulses. It needs no force and no division by a time step, so an impact
/// counts like sustained contact, and the sum of a sticking cell stays at exactly 0.
///
/// A cell is as detection counts it, [`ContactRecord::places`]: an edge of a polyline.
/// [`Profile::on_nodes`](super::Profile::on_nodes) distributes the sums of the edges of a profile
/// to its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadSlip {
    sums: Vec<f64>,
}

impl LoadSlip {
    /// Zero sums for `cells` cells.
    pub fn new(cells: usize) -> Self {
        LoadSlip {
            sums: vec![0.0; cells],
        }
    }

    /// Adds the contacts of one step.
    ///
    /// # Arguments
    /// - `contacts`: the records of the step, [`crate::dynamics::record::StepRecord::contacts`].
    /// - `cell_of`: the cell that a contact wears, counted from 0, or `None` for a contact that
    ///   does not count (another body, another bar): [`ContactRecord::cell_on`] the worn surface.
    ///
    /// # Errors
    /// [`WearError::NonFinite`] and [`WearError::Range`] for a `load_slip` that is NaN, infinite or
    /// negative; [`WearError::Range`] for a cell that does not exist. Nothing is added then.
    pub fn add(
        &mut self,
        contacts: &[ContactRecord],
        cell_of: impl Fn(&ContactRecord) -> Option<usize>,
    ) -> Result<(), WearError> {
        let mut counted = Vec::new();
        for (index, contact) in contacts.iter().enumerate() {
            let Some(cell) = cell_of(contact) else {
                continue;
            };
            let value = contact.load_slip;
            if !value.is_finite() {
                return Err(WearError::NonFinite {
                    what: "load_slip of contact",
                    index,
                });
            }
            in_range("load_slip [N m]", value, value >= 0.0, "at least 0")?;
            in_range(
                "cell of a contact",
                cell as f64,
                cell < self.sums.len(),
                "a cell of the surface",
            )?;
            counted.push((cell, value));
        }
        for (cell, value) in counted {
            self.sums[cell] += value;
        }
        Ok(())
    }

    /// `S_i` [N m].
    pub fn sums(&self) -> &[f64] {
        &self.sums
    }
}

/// The area over which the `load_slip` of a node is distributed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CellArea {
    /// One area `δΩ` \[m²\] for every node, whatever the mesh, as in the study. Only the quotient
    /// `K / δΩ` matters.
    Fixed(f64),
    /// Tributary width times the metre of depth of a planar scene: 0.002 m² for a node of 2 mm,
    /// half of that for a node of 1 mm at an end.
    Tributary,
}

/// Archard's wear law.
///
/// ```text
/// h_i = K S_i / A_i                                                        (1)
/// ```
///
/// with `S_i` [N m] the sum of `load_slip` and `A_i` \[m²\] the area of the node. With
/// [`CellArea::Fixed`] this is the study's depth `(K / δΩ) S_i`, `K / δΩ` in 1/N. With
/// [`CellArea::Tributary`], `A_i = w_i · 1 m` and the worn area `h_i w_i` is `K S_i` [m² per metre
/// of width], `S_i` being per metre of width.
///
/// # Source
/// Archard (1953); K is the dimensional coefficient `k / H`, wear coefficient by hardness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Archard {
    /// `K` [m²/N], worn volume per load and slip.
    pub coefficient: f64,
    /// `A_i`, the area of a node.
    pub area: CellArea,
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
    /// [`WearError::Length`]; [`WearError::NonFinite`]; [`WearError::Range`] for `K < 0`,
    /// `δΩ ≤ 0`, a width that is not above 0 or a negative `load_slip`.
    pub fn depths(&self, load_slip: &[f64], widths: &[f64]) -> Result<Vec<f64>, WearError> {
        same_length("load_slip", load_slip.len(), widths.len())?;
        all_finite("load_slip of node", load_slip)?;
        all_finite("width of node", widths)?;
        let k = self.coefficient;
        let finite = "finite and at least 0";
        in_range("K [m²/N]", k, k >= 0.0 && k.is_finite(), finite)?;
        if let CellArea::Fixed(area) = self.area {
            let inside = area > 0.0 && area.is_finite();
            in_range("cell area [m²]", area, inside, "finite and above 0")?;
        }
        let mut depths = Vec::with_capacity(widths.len());
        for (&s, &w) in load_slip.iter().zip(widths) {
            in_range("load_slip [N m]", s, s >= 0.0, "at least 0")?;
            in_range("tributary width [m]", w, w > 0.0, "above 0")?;
            depths.push(match self.area {
                CellArea::Fixed(area) => k / area * s,
                CellArea::Tributary => k * s / w,
            });
        }
        all_finite("depth of node", &depths)?;
        Ok(depths)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Vec2;
    use crate::dynamics::record::{ContactStatus, SurfacePoint};

    fn record(cell: u32, load_slip: f64, status: ContactStatus) -> ContactRecord {
        ContactRecord {
            time: 0.0,
            bodies: [0, 1],
            surfaces: [7, 8],
            places: [cell, 0].map(SurfacePoint::on),
            position: Vec2::zeros(),
            normal: Vec2::y(),
            gap: 0.0,
            impulse_n: 1.0,
            impulse_t: 0.0,
            moments: [None; 2],
            slip: 0.0,
            load_slip,
            friction_work: 0.0,
            normal_work: 0.0,
            status,
        }
    }

    #[test]
    fn impacts_count_sticking_does_not_and_others_are_left_out() {
        let mut sum = LoadSlip::new(2);
        let contacts = [
            record(0, 0.25, ContactStatus::SlipPlus),
            record(0, 0.5, ContactStatus::Impact),
            record(1, 0.0, ContactStatus::Stick),
            ContactRecord {
                surfaces: [8, 9],
                ..record(0, 9.0, ContactStatus::SlipMinus)
            },
        ];
        sum.add(&contacts, |c| Some(c.cell_on(7)? as usize))
            .unwrap();
        assert_eq!(sum.sums(), [0.75, 0.0]);
    }

    #[test]
    fn a_bad_record_adds_nothing() {
        let mut sum = LoadSlip::new(1);
        let contacts = [
            record(1, 1.0, ContactStatus::SlipPlus),
            record(1, f64::NAN, ContactStatus::SlipPlus),
        ];
        let bad = sum.add(&contacts, |_| Some(0));
        assert!(matches!(bad, Err(WearError::NonFinite { index: 1, .. })));
        let outside = sum.add(&contacts[..1], |_| Some(1));
        assert!(matches!(outside, Err(WearError::Range { .. })));
        assert_eq!(sum.sums(), [0.0]);
    }

    #[test]
    fn both_forms_agree_where_their_areas_do() {
        let fixed = Archard {
            coefficient: 5e-17,
            area: CellArea::Fixed(2e-3),
        };
        let tributary = Archard {
            area: CellArea::Tributary,
            ..fixed
        };
        let (s, w) = ([1e9, 0.0], [2e-3, 1e-3]);
        let h = fixed.depths(&s, &w).unwrap();
        // two orders of the same three numbers: a few ulp
        assert!((h[0] / tributary.depths(&s, &w).unwrap()[0] - 1.0).abs() < 1e-15);
        assert_eq!(h[1], 0.0);
        assert!(matches!(
            fixed.depths(&s[..1], &w),
            Err(WearError::Length { .. })
        ));
        assert!(matches!(
            fixed.depths(&[-1.0, 0.0], &w),
            Err(WearError::Range { .. })
        ));
    }
}
