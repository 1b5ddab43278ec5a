//! Output of a run of the thresher: files and text.

use super::blocks::Tooth;
use super::life::{PowerBudget, ThreshingOutcome};
use super::machine_pictures::{load_over_angle, power_over_hours, torque_over_hours};
use super::parameters::{ConcaveSetting, Thresher};
use super::rows::ErrorRow;
use super::world::Outlines;
use crate::contact::Vec2;
use crate::report::{
    Align, Axis, Chart, Colour, OutputFolder, ReportError, Series, Style, Table, number, quantity,
    write_rows,
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
        let subtitle = format!(
            "{} N m, {} rad/s, all bars equal",
            p.operating_torque, p.speed
        );
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
                torque_over_hours(&self.operation, p.operating_torque, &subtitle),
            ),
            (
                "power-over-hours.svg",
                power_over_hours(&self.operation, &subtitle),
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
                "depth_at_calibration_m": self.calibration.map(|(_, depth)| depth),
            },
            "concave_moved_m": self.concave_moved,
            "torque_new_nm": self.torque_new,
            "torque_worn_nm": self.torque_worn,
            "speed_new_rad_s": self.speed_new,
            "power_new_w": power_json(&self.power_new),
            "power_worn_w": power_json(&self.power_worn),
            "revolutions": self.revolutions,
            "jumps": self.jumps,
            "steel_lost_kg": self.steel_lost,
            "sampling_error": self.sampling,
            "largest_k_k_s": self.feedback,
            "life": self.history.life_json(),
            "life_error": self.errors.iter().flat_map(|e| e.rows()).collect::<Vec<_>>(),
        })
    }

    /// Results as text.
    pub fn describe(&self, p: &Thresher, tooth: &Tooth) -> String {
        let mut out = format!(
            "hours to each limit at {} N m, {} rad/s:\n{}",
            p.operating_torque,
            p.speed,
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
            "  torque {} N m with new teeth, {} N m at the end\n\n",
            number(self.torque_new, 4),
            number(self.torque_worn, 4)
        ));
        out.push_str(&format!(
            "calibrated: crop stiffness {} Pa/m, so that new teeth take the operating torque; the wear \
             coefficient {} m2/N",
            number(self.stiffness, 3),
            number(self.coefficient, 3)
        ));
        match &self.calibration {
            Some((target, depth)) => out.push_str(&format!(
                ",\n  to one published depth: {} after {:.0} revolutions; this run gives {}\n",
                quantity(target.depth, "m", 3),
                target.cycles,
                quantity(*depth, "m", 3)
            )),
            None => out.push_str(", at the study's operating point (not this one)\n"),
        }
        out.push_str(
            "assumed: tip radius, number of bars, inertia, width, drive, entry speed, concave friction,\n  \
             bending stiffness of the crop, one profile for all bars\n\n",
        );
        out.push_str(&budget(&self.power_new, &self.power_worn));
        out.push_str(&format!(
            "\n{} revolutions in {} steps, {} jumps of a depth up to {} of the elastic penetration (K k \
             S); {} per step; worst residual {}; sampling error of a cycle up to {} %\n",
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

/// Teeth, crop and concave, to scale.
fn picture(title: &str, outlines: &Outlines) -> Chart {
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
    chart
}

/// Every term of the power balance with its name, in the order of the table.
fn terms(p: &PowerBudget) -> [(&'static str, f64); 10] {
    [
        ("drive", p.drive),
        ("feeder", p.feeder),
        ("gravity", p.gravity),
        ("friction on the teeth", -p.friction_teeth),
        ("friction on the concave", -p.friction_concave),
        ("normal losses on the teeth", -p.normal_teeth),
        ("normal losses on the concave", -p.normal_concave),
        ("carried away by the crop", -p.crop),
        ("bending of the crop", -p.bending),
        ("stored in the machine", -p.stored),
    ]
}

fn power_json(p: &PowerBudget) -> Value {
    let mut map = serde_json::Map::new();
    for (name, value) in terms(p) {
        map.insert(name.replace(' ', "_"), json!(value));
    }
    map.insert("sum".to_owned(), json!(p.imbalance()));
    Value::Object(map)
}

fn budget(new: &PowerBudget, worn: &PowerBudget) -> String {
    let mut table = Table::new([
        ("power, whole machine", Align::Left),
        ("new teeth [W]", Align::Right),
        ("worn teeth [W]", Align::Right),
    ]);
    for ((name, a), (_, b)) in terms(new).into_iter().zip(terms(worn)) {
        table.push([name.to_owned(), format!("{a:.0}"), format!("{b:.0}")]);
    }
    table.push([
        "sum".to_owned(),
        number(new.imbalance(), 2),
        number(worn.imbalance(), 2),
    ]);
    format!("{table}")
}
