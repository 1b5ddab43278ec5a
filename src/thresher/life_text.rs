//! Output of a run of the thresher: files and text.

use super::blocks::Tooth;
use super::life::ThreshingOutcome;
use super::machine_pictures::{load_over_angle, power_over_hours, torque_over_hours};
use super::operation::TORQUE_TOLERANCE;
use super::parameters::{ConcaveSetting, Hold, Thresher};
use super::power;
use super::rows::ErrorRow;
use super::world::Outlines;
use crate::contact::Vec2;
use crate::report::{
    Axis, Chart, Colour, Dash, OutputFolder, PointLabel, ReportError, Series, Style, number,
    quantity, write_rows,
};
use serde_json::{Value, json};

impl ThreshingOutcome {
    /// Writes the life, and the machine before and after it, as CSV and pictures.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn write(
        &self,
        folder: &OutputFolder,
        p: &Thresher,
        tooth: &Tooth,
    ) -> Result<(), ReportError> {
        for (name, title, outlines) in [
            (
                "machine-new.svg",
                "The machine with new teeth",
                &self.picture_new,
            ),
            (
                "machine-worn.svg",
                "The machine with worn teeth",
                &self.picture_worn,
            ),
        ] {
            folder.write(name, picture(title, outlines).to_svg()?)?;
        }
        let held = match p.hold {
            Hold::Feed => format!("feed held at {} kg/s", p.feed_rate),
            Hold::Torque => format!("torque held at {} N m", p.operating_torque),
        };
        let subtitle = format!("{held}, {} rad/s, all bars equal", p.speed);
        let errors: Vec<ErrorRow> = self.errors.iter().flat_map(|e| e.rows()).collect();
        write_rows(folder, &errors)?;
        let mut loads = self.bar_load_new.rows("new", p.machine_width);
        loads.extend(self.bar_load_worn.rows("worn", p.machine_width));
        write_rows(folder, &loads)?;
        let arc = [p.concave_start_deg, p.concave_end_deg];
        for (name, chart) in [
            (
                "load-over-angle.svg",
                load_over_angle(&loads, arc, &subtitle),
            ),
            (
                "torque-over-hours.svg",
                torque_over_hours(&self.history.operation, p, &subtitle),
            ),
            (
                "power-over-hours.svg",
                power_over_hours(&self.history.operation, &subtitle),
            ),
        ] {
            // a machine without load has nothing to draw
            if chart.series.iter().any(|s| !s.points.is_empty()) {
                folder.write(name, chart.to_svg()?)?;
            }
        }
        self.history.write(folder, &subtitle, tooth.base)
    }

    /// Results for `summary.json`.
    pub fn json(&self, p: &Thresher) -> Value {
        json!({
            "machine_width_m": p.machine_width,
            "calibrated": {
                "crop_stiffness_pa_m": self.stiffness,
                "operating_torque_nm": p.operating_torque,
                "wear_coefficient_m2_n": self.coefficient,
            },
            "concave_moved_m": self.concave_moved,
            "hold": p.hold.word(),
            "torque_new_nm": self.torque_new,
            "torque_worn_nm": self.torque_worn,
            "feeder_share": self.feeder_share(),
            "speed_new_rad_s": self.speed_new,
            "power_new_w": self.power_new.json(),
            "power_worn_w": self.power_worn.json(),
            "revolutions": self.revolutions,
            "jumps": self.jumps,
            "steel_lost_kg": self.steel_lost,
            "sampling_error": self.sampling,
            "largest_k_k_s": self.feedback,
            "life": self.history.life_json(),
            "life_error": self.errors.iter().flat_map(|e| e.rows()).collect::<Vec<_>>(),
        })
    }

    /// Least and largest mean torque of a measured cycle \[N m\].
    pub fn torque_band(&self) -> (f64, f64) {
        let torques = self.history.operation.iter().map(|row| row.torque_nm);
        torques.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| {
            (low.min(t), high.max(t))
        })
    }

    /// Largest power of the feeder, either way, over that of the drive in the same cycle.
    pub fn feeder_share(&self) -> f64 {
        let rows = self.history.operation.iter();
        rows.map(|row| (row.feeder_w / row.drive_w).abs())
            .fold(0.0, f64::max)
    }

    /// What is wrong with the torque of new teeth, if the stiffness of the crop could not bring it
    /// within 2 % of the operating torque.
    pub fn missed_torque(&self, p: &Thresher) -> Option<String> {
        let ratio = self.torque_new / p.operating_torque;
        let off = (ratio - 1.0).abs();
        (off.is_nan() || off > TORQUE_TOLERANCE).then(|| {
            format!(
                "new teeth take {} N m, not the operating torque of {} N m: no stiffness of the crop \
                 gives it with these parameters, and the hours are those of another operation",
                number(self.torque_new, 4),
                number(p.operating_torque, 4)
            )
        })
    }

    /// Results as text.
    pub fn describe(&self, p: &Thresher, tooth: &Tooth) -> String {
        let mut out = format!(
            "hours to each limit at {} rad/s, the {} held, {} N m with new teeth:\n{}",
            p.speed,
            p.hold.word(),
            number(self.torque_new, 4),
            self.history.describe()
        );
        for error in &self.errors {
            out.push_str(&error.describe());
        }
        let last = self.history.profile.iter().rev();
        let height = last
            .take_while(|row| row.cycles == self.history.cycles)
            .map(|row| row.y_m)
            .fold(f64::NEG_INFINITY, f64::max);
        let worn = tooth.gamma - height;
        out.push_str(&format!(
            "  steel lost {} kg on all {} bars\n",
            number(self.steel_lost, 3),
            p.bars
        ));
        out.push_str(&match p.concave {
            ConcaveSetting::Follows => format!(
                "  the concave followed the teeth by {}, so that the clearance stayed\n",
                quantity(self.concave_moved, "m", 3)
            ),
            ConcaveSetting::Fixed => format!(
                "  the concave stayed: clearance grown by {0}; move it in by {0} to restore it\n",
                quantity(worn, "m", 3)
            ),
        });
        out.push_str(&format!(
            "  torque {} N m with the last profile; the feeder takes up to {} % of the drive\n\n",
            number(self.torque_worn, 4),
            number(100.0 * self.feeder_share(), 2)
        ));
        out.push_str(&format!(
            "calibrated: crop stiffness {} Pa/m, so that new teeth take {} N m; the wear \
             coefficient {} m2/N",
            number(self.stiffness, 3),
            number(self.torque_new, 4),
            number(self.coefficient, 3)
        ));
        out.push_str(", under the torque of the published depth\n");
        out.push_str(
            "assumed: tip radius, number of bars, inertia, width, drive, entry speed, bending stiffness and\n  \
             strength of the crop, its friction on the concave, one profile for all bars; the errors above have\n  \
             no part for these, and the strength and that friction move the hours most, by more than the\n  \
             errors (table in the guide of `thresher`)\n\n",
        );
        out.push_str(&power::table(&self.power_new, &self.power_worn));
        out.push_str(&format!(
            "\n{} revolutions in {} steps, {} jumps of a depth up to {} of the elastic penetration (K k \
             S); {} per step; worst residual {}; sampling error of a cycle {} %\n",
            number(self.revolutions, 4),
            self.totals.steps,
            self.jumps,
            number(self.feedback, 2),
            quantity(
                self.totals.wall / self.totals.steps.max(1) as f64,
                "s",
                3
            ),
            number(self.totals.residual, 2),
            number(100.0 * self.sampling, 2),
        ));
        out.push_str(&format!(
            "in every step kinetic energy changes by the work of all impulses to {} J of {} J\n",
            number(self.totals.imbalance, 2),
            number(self.totals.kinetic_most, 3)
        ));
        out
    }
}

/// Distance of the numbers of cells from their tooth \[m\].
const ABOVE: f64 = 0.02;

/// Drum, teeth, crop and concave, to scale.
pub(super) fn picture(title: &str, outlines: &Outlines) -> Chart {
    let mut chart = Chart::new(title, Axis::linear("x [mm]"), Axis::linear("y [mm]"));
    chart.equal_aspect = true;
    let points = |outline: &[Vec2], closed: bool| {
        let end = closed.then(|| outline.first()).flatten();
        let all = outline.iter().chain(end);
        all.map(|p| (1e3 * p.x, 1e3 * p.y)).collect::<Vec<_>>()
    };
    for (k, tooth) in outlines.teeth.iter().enumerate() {
        let name = if k == 0 { "teeth" } else { "" };
        let body = Series::new(name, Style::Body, points(tooth, true));
        chart.series.push(body);
    }
    for (k, segment) in outlines.crop.iter().enumerate() {
        let name = if k == 0 { "crop" } else { "" };
        let mut line = Series::new(name, Style::Line, points(segment, true));
        line.colour = Colour::Palette(1);
        chart.series.push(line);
    }
    let mut line = Series::new("concave", Style::Line, points(&outlines.concave, false));
    line.colour = Colour::Palette(0);
    chart.series.push(line);
    let mut drum = Series::new("drum", Style::Line, circle(1e3 * drum_radius(outlines)));
    drum.colour = Colour::Palette(2);
    drum.dash = Dash::Dashed;
    chart.series.push(drum);
    number_cells(outlines, &mut chart);
    let radius = outlines.teeth.iter().flatten().map(|p| p.norm());
    let mut turn = Series::new(
        "sense of rotation",
        Style::Line,
        turning(0.7e3 * radius.fold(f64::INFINITY, f64::min)),
    );
    turn.colour = Colour::Palette(6);
    chart.series.push(turn);
    chart.notes.push(
        "Crop is soft: where its outline lies within steel, it is pressed in by that depth."
            .to_owned(),
    );
    chart
}

/// Radius of the drum on which the teeth sit \[m\]: the least of any point of a tooth.
fn drum_radius(outlines: &Outlines) -> f64 {
    let least = |tooth: &Vec<Vec2>| {
        let next = tooth.iter().cycle().skip(1);
        let middles = tooth.iter().zip(next).map(|(a, b)| (0.5 * (a + b)).norm());
        middles.fold(f64::INFINITY, f64::min)
    };
    let radius = outlines.teeth.iter().map(least);
    radius.fold(f64::INFINITY, f64::min)
}

/// A circle about the origin; nothing where the radius is not finite.
fn circle(radius: f64) -> Vec<(f64, f64)> {
    let angles = (0..=120).map(|k| f64::from(3 * k).to_radians());
    angles
        .map(|a| (radius * a.cos(), radius * a.sin()))
        .collect()
}

/// Numbers some cells of the leftmost tooth above the axle: the concave and the crop are below.
fn number_cells(outlines: &Outlines, chart: &mut Chart) {
    let middle = |tooth: &[Vec2]| tooth.iter().sum::<Vec2>() / tooth.len() as f64;
    let known = outlines.teeth.iter().filter(|t| t.len() > outlines.cells);
    let above = known.filter(|tooth| middle(tooth).y > 0.0);
    let leftmost = above.min_by(|a, b| middle(a).x.total_cmp(&middle(b).x));
    let Some(tooth) = leftmost else {
        return;
    };
    let shown = (0..outlines.cells).filter(|k| k % 10 == 0 || k + 1 == outlines.cells);
    for k in shown {
        let middle = 0.5 * (tooth[k] + tooth[k + 1]);
        let beside = 1e3 * middle * (1.0 + ABOVE / middle.norm());
        chart.labels.push(PointLabel {
            x: beside.x,
            y: beside.y,
            text: (k + 1).to_string(),
        });
    }
    let note = "Numbers on a tooth are those of its cells.".to_owned();
    chart.notes.push(note);
}

/// An arc with a head about the origin, counter-clockwise.
fn turning(radius: f64) -> Vec<(f64, f64)> {
    let at = |degrees: f64, r: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        (r * cos, r * sin)
    };
    let mut points: Vec<(f64, f64)> = (20..=160)
        .step_by(5)
        .map(|d| at(f64::from(d), radius))
        .collect();
    points.extend([
        at(152.0, 1.05 * radius),
        at(160.0, radius),
        at(152.0, 0.95 * radius),
    ]);
    points
}
