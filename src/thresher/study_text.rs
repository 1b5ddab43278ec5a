//! Output of a run of the study: files and text.

use super::blocks::{Reading, Study, Tooth};
use super::rows::ComparisonRow;
use super::study::StudyOutcome;
use super::study_pictures::{depth_over_friction, depth_over_speed, life_over_friction};
use crate::report::{Align, OutputFolder, ReportError, Table, number, quantity, write_rows};
use serde_json::{Value, json};

fn reading(study: &Study) -> &'static str {
    match study.reading {
        Reading::Literal => "literal",
        Reading::TorqueBalanced => "torque-balanced",
    }
}

impl StudyOutcome {
    /// Writes the comparison and the life as CSV and pictures.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn write(
        &self,
        folder: &OutputFolder,
        study: &Study,
        tooth: &Tooth,
    ) -> Result<(), ReportError> {
        write_rows(folder, &self.comparison)?;
        let how = match self.life_contact_time {
            Some(_) => format!("contact time {}", quantity(self.contact_time, "s", 5)),
            None => "depths per cell are not unique".to_owned(),
        };
        let subtitle = format!("reading {}, {how}", reading(study));
        let chart = depth_over_speed(&self.comparison, &subtitle);
        folder.write("depth-over-speed.svg", chart.to_svg()?)?;
        if !self.frictions.is_empty() {
            write_rows(folder, &self.frictions)?;
            let at = format!(
                "{} N m, {} rad/s, reading {}, contact time {}, held",
                self.torque,
                self.speed,
                reading(study),
                quantity(self.life_contact_time.unwrap_or(f64::NAN), "s", 5)
            );
            let chart = life_over_friction(&self.frictions, &at);
            // nothing to draw without a limit and without published hours
            if chart
                .series
                .iter()
                .any(|s| s.points.iter().any(|p| p.1.is_finite()))
            {
                folder.write("life-over-friction.svg", chart.to_svg()?)?;
            }
        }
        if !self.friction_depths.is_empty() {
            write_rows(folder, &self.friction_depths)?;
            let at = format!("{} rad/s, {subtitle}, held", self.speed);
            let chart = depth_over_friction(&self.friction_depths, &at);
            folder.write("depth-over-friction.svg", chart.to_svg()?)?;
        }
        let Some(history) = &self.history else {
            return Ok(());
        };
        let subtitle = format!(
            "{} N m, {} rad/s, reading {}",
            self.torque,
            self.speed,
            reading(study)
        );
        history.write(folder, &subtitle, tooth.base)
    }

    /// Results for `summary.json`.
    pub fn json(&self, study: &Study) -> Value {
        json!({
            "reading": reading(study),
            "contact_time_s": self.contact_time,
            "life_contact_time_s": self.life_contact_time,
            "contact_time_calibrated": self.calibrated,
            "comparison": self.comparison,
            "frictions": self.frictions,
            "friction_depths": self.friction_depths,
            "stepper_against_algebra": self.oracle_difference,
            "life": self.history.as_ref().map(|h| h.life_json()),
        })
    }

    /// Results as text.
    pub fn describe(&self, study: &Study) -> String {
        let mut out = format!("reading: {}\n", reading(study));
        if let Some(stall) = &self.stall {
            out.push_str(&format!(
                "The rotor stalls: with e = 0 one closed contact stops it in one step (speed after it \
                 {} rad/s); {} step of a cycle wears, sliding under load is impossible.\n\
                 Wear per cycle goes as torque^{:.4} speed^{:.4}.\n\
                 {} of {} loadings by a single cell pass the judge: the Delassus operator has rank \
                 one, and the shares of the cells are not unique. Depths per cell mean nothing here, and no \
                 life is followed.\n",
                number(stall.speed_after, 2),
                stall.wearing_steps,
                stall.torque_exponent,
                stall.speed_exponent,
                stall.single_cell.0,
                stall.single_cell.1,
            ));
        } else {
            out.push_str(&format!(
                "{}\n\
                 assumed: axis distance {} m, friction {}; the study does not give them\n\
                 stepper against the algebra: {} (largest relative difference of a depth)\n",
                self.of_contact_time(study),
                study.axis_distance,
                study.friction,
                number(self.oracle_difference.unwrap_or(f64::NAN), 2),
            ));
        }
        out.push('\n');
        out.push_str(&self.comparison_table());
        out.push_str(&self.friction_table());
        if let Some(history) = &self.history {
            out.push_str(&format!(
                "\nlife at {} N m, {} rad/s, worn along the normals of the profile:\n{}",
                self.torque,
                self.speed,
                history.describe()
            ));
        }
        out.push_str(&format!(
            "{} steps, {} per step; worst residual {}\n",
            self.totals.steps,
            quantity(self.totals.wall / self.totals.steps.max(1) as f64, "s", 3),
            number(self.totals.residual, 2)
        ));
        out
    }

    /// What to say of the points at which the base is worn through before the study's cycles.
    pub fn worn_through(&self, study: &Study) -> Option<String> {
        let compared = self.comparison.iter().map(|row| row.worn_through_cycles);
        let at_frictions = self.frictions.iter().map(|row| row.worn_through_cycles);
        let all: Vec<f64> = compared.chain(at_frictions).collect();
        let through = all.iter().copied().filter(|cycles| cycles.is_finite());
        let first = through.clone().reduce(f64::min)?;
        Some(format!(
            "at {} of {} points the base is worn through before the study.cycles = {:?}, first after {} \
             cycles: their depths are those of that moment, and no depth of a tooth goes beyond",
            through.count(),
            all.len(),
            study.cycles,
            number(first, 4)
        ))
    }

    /// Where the contact time comes from.
    fn of_contact_time(&self, study: &Study) -> String {
        let time = quantity(self.contact_time, "s", 5);
        if !self.calibrated {
            return format!("given: contact time of one cycle {time}, also of the life below");
        }
        format!(
            "calibrated: contact time of one cycle {time}, of the life below {} (one published depth: \
             {} at {} N m, {} rad/s)",
            quantity(self.life_contact_time.unwrap_or(f64::NAN), "s", 5),
            quantity(study.calibrate.depth, "m", 4),
            study.calibrate.torque,
            study.calibrate.speed,
        )
    }

    /// Depth and life by friction; empty without rows.
    fn friction_table(&self) -> String {
        let Some(first) = self.frictions.first() else {
            return String::new();
        };
        let mut table = Table::new([
            ("friction", Align::Right),
            ("depth [um]", Align::Right),
            ("life [h]", Align::Right),
            ("published life [h]", Align::Right),
            ("", Align::Left),
        ]);
        let hours = |h: f64| match h.is_nan() {
            true => "-".to_owned(),
            false => number(h, 4),
        };
        for row in &self.frictions {
            table.push([
                number(row.friction, 3),
                format!("{:.0}", row.computed_um),
                hours(row.life_hours),
                hours(row.published_hours),
                through(row.worn_through_cycles),
            ]);
        }
        format!(
            "\nfriction at {} N m, {} rad/s, the contact time held; life to the first limit:\n{table}\
             the published lives reverse three times and are no target: more friction leaves less \
             normal force here\n",
            number(first.torque_nm, 5),
            number(first.omega_rad_s, 4)
        )
    }

    /// The published and the computed depths, and the errors.
    fn comparison_table(&self) -> String {
        let mut table = Table::new([
            ("torque [N m]", Align::Right),
            ("speed [rad/s]", Align::Right),
            ("published [um]", Align::Right),
            ("computed [um]", Align::Right),
            ("error", Align::Right),
            ("", Align::Left),
        ]);
        let (mut sum, mut worst, mut count) = (0.0, 0.0f64, 0);
        for row in &self.comparison {
            let error = row.relative_error;
            if !row.calibrated && error.is_finite() {
                sum += error.abs();
                worst = worst.max(error.abs());
                count += 1;
            }
            let published = if row.published_um.is_nan() {
                "-".to_owned()
            } else {
                format!("{:.0}", row.published_um)
            };
            let percent = if error.is_nan() {
                "-".to_owned()
            } else {
                format!("{:+.1} %", 100.0 * error)
            };
            table.push([
                number(row.torque_nm, 5),
                number(row.omega_rad_s, 4),
                published,
                format!("{:.0}", row.computed_um),
                percent,
                remark(row),
            ]);
        }
        let mut out = format!("{table}");
        if count > 0 {
            out.push_str(&format!(
                "mean error of the other {count} points {:.1} %, worst {:.1} %\n",
                100.0 * sum / f64::from(count),
                100.0 * worst
            ));
        }
        out
    }
}

/// What marks a row of the comparison.
fn remark(row: &ComparisonRow) -> String {
    let calibrated = if row.calibrated { "calibrated" } else { "" };
    let both = [calibrated.to_owned(), through(row.worn_through_cycles)];
    let said: Vec<String> = both.into_iter().filter(|s| !s.is_empty()).collect();
    said.join(", ")
}

/// When a base is worn through; empty if it is not.
fn through(cycles: f64) -> String {
    match cycles.is_nan() {
        true => String::new(),
        false => format!("base worn through after {} cycles", number(cycles, 4)),
    }
}
