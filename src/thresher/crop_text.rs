//! Output of a run with grains: files, pictures and text.

use super::blocks::Tooth;
use super::crop_run::{CropComparison, CropRun};
use super::life_text::picture;
use super::machine_pictures::load_over_angle;
use super::parameters::Thresher;
use super::part_wear::most;
use super::rows::{BarRow, ConcaveRow, CropRow, CropWearRow};
use crate::experiment::Totals;
use crate::report::{
    Align, Axis, Chart, OutputFolder, ReportError, Series, Style, Table, number, quantity,
    write_rows,
};
use serde_json::{Value, json};

/// Overlap, as a share of the mean radius, beyond which grains do not hold each other apart. An impact that is
/// seen late is as deep as grains close in a step.
const DEEPEST: f64 = 0.5;

/// Revolutions for which depths and volumes are told.
const MILLION: f64 = 1e6;

impl CropRun {
    /// The deepest cell, from 1, and its depth of a revolution \[m\].
    pub fn deepest(&self) -> (usize, f64) {
        let (cell, depth) = most(&self.depths);
        (cell + 1, depth)
    }

    /// Certified, bounded and failed contact problems: the labels of the steps' worst ones, as counts of
    /// steps and of problems.
    fn labels(&self) -> [usize; 3] {
        let t = &self.totals;
        let failed = t.failed_islands.min(t.unsolved_steps);
        [
            t.steps - t.unsolved_steps,
            t.unsolved_steps - failed,
            failed,
        ]
    }

    /// Imbalance of the power budget over the power of the drive.
    pub fn closure(&self) -> f64 {
        (self.power.imbalance() / self.power.drive).abs()
    }

    fn json(&self) -> Value {
        let (cell, depth) = self.deepest();
        let [certified, bounded, failed] = self.labels();
        json!({
            "torque_nm": self.torque,
            "speed_rad_s": self.speed,
            "power_w": self.power.json(),
            "power_closure": self.closure(),
            "angular_momentum": self.spin.json(),
            "mass": self.flow.json(),
            "worn_m3_per_m_bar_revolution": self.worn,
            "deepest_cell": cell,
            "deepest_m_per_revolution": depth,
            "interval_95": self.interval,
            "steps": self.totals.steps,
            "certified_steps": certified,
            "bounded_steps": bounded,
            "failed_steps": failed,
            "worst_residual_velocity_m_s": self.totals.residual_velocity,
            "worst_penetration_m": overlap(&self.totals),
        })
    }

    /// Figures with their names and units.
    fn figures(&self) -> Vec<(String, &'static str, f64)> {
        let mut all = vec![
            ("torque of the drive".to_owned(), "N m", self.torque),
            ("speed of the cylinder".to_owned(), "rad/s", self.speed),
        ];
        for (name, watts) in self.power.terms() {
            let word = match name {
                "drive" | "feeder" | "gravity" => format!("power of {name}"),
                name => name.to_owned(),
            };
            all.push((word, "W", watts));
        }
        all.extend([
            (
                "torque of the concave on the crop".to_owned(),
                "N m",
                self.spin.concave,
            ),
            (
                "torque that turns the crop".to_owned(),
                "N m",
                self.spin.crop,
            ),
            (
                "rest of the torque".to_owned(),
                "N m",
                self.spin.rest() - self.spin.gravity + self.spin.stored,
            ),
        ]);
        let (cell, depth) = self.deepest();
        all.extend([
            ("sum of the powers".to_owned(), "W", self.power.imbalance()),
            (
                "worn volume of a bar, 1e6 revolutions, per metre".to_owned(),
                "mm3/m",
                1e9 * MILLION * self.worn,
            ),
            (
                "deepest cell, 1e6 revolutions".to_owned(),
                "mm",
                1e3 * MILLION * depth,
            ),
            ("that cell".to_owned(), "", cell as f64),
            (
                "half of its 95 % interval, this seed".to_owned(),
                "%",
                100.0 * self.interval,
            ),
            (
                "worn volume of the concave, 1e6 revolutions, per metre".to_owned(),
                "mm3/m",
                1e9 * MILLION * self.concave.iter().map(|n| n.width * n.depth).sum::<f64>(),
            ),
            (
                "its deepest place, 1e6 revolutions".to_owned(),
                "mm",
                1e3 * MILLION * most(&self.concave.iter().map(|n| n.depth).collect::<Vec<_>>()).1,
            ),
            (
                "crop in the machine".to_owned(),
                "kg",
                self.flow.inside_mean,
            ),
        ]);
        all
    }
}

impl CropComparison {
    /// Writes figures, wear per cell and pictures.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn write(
        &self,
        folder: &OutputFolder,
        p: &Thresher,
        tooth: &Tooth,
    ) -> Result<(), ReportError> {
        let rows: Vec<CropRow> = (self.grains.figures().into_iter())
            .zip(self.strip.figures())
            .map(|((figure, unit, grains), (_, _, strip))| CropRow {
                figure,
                unit: unit.to_owned(),
                grains,
                strip,
            })
            .collect();
        write_rows(folder, &rows)?;
        let mut wear: Vec<CropWearRow> = Vec::new();
        let mut loads = Vec::new();
        for (crop, run) in self.both() {
            let cells = run.places.iter().zip(&run.depths).enumerate();
            wear.extend(cells.map(|(cell, (x, depth))| CropWearRow {
                crop: crop.to_owned(),
                cell: cell as u32 + 1,
                x_m: *x,
                depth_m_per_revolution: *depth,
            }));
            loads.extend(run.bar_load.rows(crop, p.machine_width));
        }
        write_rows(folder, &wear)?;
        write_rows(folder, &loads)?;
        self.write_parts(folder)?;
        let subtitle = format!("feed {} kg/s, {} rad/s, new teeth", p.feed_rate, p.speed);
        folder.write("wear-by-crop.svg", wear_by_crop(&wear, &subtitle).to_svg()?)?;
        let arc = [p.concave_start_deg, p.concave_end_deg];
        let chart = load_over_angle(&loads, arc, &subtitle);
        if !chart.series.is_empty() {
            folder.write("load-over-angle.svg", chart.to_svg()?)?;
        }
        let mut grains = picture("The machine with grains", &self.grains.picture);
        grains.notes.clear();
        folder.write("machine-grains.svg", grains.to_svg()?)?;
        let strip = picture("The machine with the strip", &self.strip.picture);
        folder.write("machine-strip.svg", strip.to_svg()?)?;
        match &self.life {
            Some(life) => life.history.write(folder, &subtitle, tooth.base),
            None => Ok(()),
        }
    }

    /// Wear of the bars and of the concave.
    fn write_parts(&self, folder: &OutputFolder) -> Result<(), ReportError> {
        let (mut bars, mut concave) = (Vec::new(), Vec::new());
        for (crop, run) in self.both() {
            bars.extend((run.bars.iter().enumerate()).map(|(bar, of)| BarRow {
                crop: crop.to_owned(),
                bar: bar as u32 + 1,
                height_m: of.height,
                torque_nm: of.torque,
                worn_m3_per_m_revolution: of.worn,
                deepest_cell: of.cell as u32,
                deepest_m_per_revolution: of.deepest,
            }));
            concave.extend(run.concave.iter().map(|node| ConcaveRow {
                crop: crop.to_owned(),
                angle_deg: node.angle_deg,
                width_m: node.width,
                depth_m_per_revolution: node.depth,
            }));
        }
        write_rows(folder, &bars)?;
        write_rows(folder, &concave)?;
        let mut chart = Chart::new(
            "Wear along the concave",
            Axis::linear("angle about the axle, from the inlet to the outlet [degrees]"),
            Axis::linear("depth of 1e6 revolutions [mm]"),
        );
        for own in concave.chunk_by(|a, b| a.crop == b.crop) {
            let points = own
                .iter()
                .map(|r| (r.angle_deg, 1e3 * MILLION * r.depth_m_per_revolution));
            let series = Series::new(own[0].crop.as_str(), Style::LinePoints, points.collect());
            chart.series.push(series);
        }
        folder.write("wear-of-concave.svg", chart.to_svg()?)
    }

    /// Bars of their own as a table; empty for equal ones.
    fn describe_bars(&self, p: &Thresher) -> String {
        if p.bar.is_empty() {
            return String::new();
        }
        let mut table = Table::new([
            ("bar", Align::Right),
            ("height [mm]", Align::Right),
            ("torque, grains [N m]", Align::Right),
            ("strip [N m]", Align::Right),
            ("worn in 1e6 revolutions, grains [mm3/m]", Align::Right),
            ("strip [mm3/m]", Align::Right),
        ]);
        for (bar, (g, s)) in self.grains.bars.iter().zip(&self.strip.bars).enumerate() {
            let volume = |worn: f64| number(1e9 * MILLION * worn, 3);
            table.push([
                (bar + 1).to_string(),
                number(1e3 * g.height, 4),
                number(g.torque, 3),
                number(s.torque, 3),
                volume(g.worn),
                volume(s.worn),
            ]);
        }
        format!("{table}\n")
    }

    fn both(&self) -> [(&'static str, &CropRun); 2] {
        [("grains", &self.grains), ("strip", &self.strip)]
    }

    /// Results for `summary.json`.
    pub fn json(&self, p: &Thresher) -> Value {
        json!({
            "machine_width_m": p.machine_width,
            "loose_torque_nm": loose_torque(p),
            "squeeze_pa": squeeze(p),
            "grains": self.grains.json(),
            "strip": self.strip.json(),
            "life": self.life.as_ref().map(|life| life.history.life_json()),
        })
    }

    /// Results as text.
    pub fn describe(&self, p: &Thresher) -> String {
        let mut table = Table::new([
            ("whole machine, new teeth", Align::Left),
            ("", Align::Left),
            ("grains", Align::Right),
            ("strip", Align::Right),
        ]);
        for ((name, unit, a), (_, _, b)) in
            self.grains.figures().into_iter().zip(self.strip.figures())
        {
            // what neither crop has
            if a != 0.0 || b != 0.0 {
                let cells = [a, b].map(|value| number(value, 4));
                let [a, b] = cells;
                table.push([name, unit.to_owned(), a, b]);
            }
        }
        let (g, f) = (&self.grains, &self.grains.flow);
        let [certified, bounded, failed] = g.labels();
        let share = 100.0 * g.torque / p.operating_torque;
        let kg = |mass: f64| format!("{} kg", number(mass, 4));
        format!(
            "{table}\n{}\
             the strip is calibrated to the operating torque of {} N m; of the grains nothing is: they take {} % \
             of it\n\
             a loose crop at the speed of the tips, which its own centrifugal force alone presses on the concave, \
             takes {} N m; the rest of the operating torque asks for a crop that is squeezed, by {} on the \
             concave\n\
             grains above the concave: as a solid layer {} deep, clearance {} to {}; {} % reach within the circle \
             of the tips, {} % of those that left had met a tooth\n\
             grains at once: {} in the mean, {} at most\n\
             mass over the measured revolutions: due {}, entered {}, left {}, thrown back {}, in the machine {} \
             before and {} after; imbalance {}; waiting for room {}; {} behind steel\n\
             contact problems with grains: of {} steps {certified} certified, {bounded} bounded, {failed} failed; \
             worst closing velocity {}, worst overlap {}; {} contacts a step, {} per step\n\
             the powers add up to {} of the drive with grains, to {} with the strip\n\
             {}",
            self.describe_bars(p),
            number(p.operating_torque, 4),
            number(share, 3),
            number(loose_torque(p), 3),
            match p.friction_concave > 0.0 {
                true => quantity(squeeze(p), "Pa", 2),
                false => "no pressure, for want of friction,".to_owned(),
            },
            quantity(f.solid_depth, "m", 2),
            quantity(p.clearance_inlet, "m", 2),
            quantity(p.clearance_outlet, "m", 2),
            number(100.0 * f.reach_tips, 2),
            number(100.0 * f.met_share, 2),
            number(f.bodies_mean, 4),
            f.bodies_most,
            kg(f.due),
            kg(f.entered),
            kg(f.left),
            kg(f.thrown_back),
            kg(f.inside_start),
            kg(f.inside_end),
            kg(f.imbalance()),
            kg(f.waiting),
            f.through_steel,
            g.totals.steps,
            quantity(g.totals.residual_velocity, "m/s", 2),
            quantity(overlap(&g.totals).max(0.0), "m", 2),
            number(g.totals.contacts as f64 / g.totals.steps.max(1) as f64, 4),
            quantity(g.totals.wall / g.totals.steps.max(1) as f64, "s", 3),
            number(g.closure(), 2),
            number(self.strip.closure(), 2),
            self.describe_life(),
        )
    }

    /// The life with grains as text, if there is one.
    fn describe_life(&self) -> String {
        let Some(life) = &self.life else {
            return "wear is that of new teeth: `limits` in [wear] give a life, to which wear.jump belongs\n".to_owned();
        };
        format!(
            "\nhours to each limit with grains, all bars equal:\n{}{} jumps, {} revolutions; torque {} N m with \
             new teeth, {} N m with the last; sampling error of a cycle {} %\n",
            life.history.describe(),
            life.jumps,
            number(life.revolutions, 4),
            number(life.torque_new, 3),
            number(life.torque_worn, 3),
            number(100.0 * life.sampling, 3)
        )
    }

    /// What makes the results those of another machine.
    pub fn wrong(&self, p: &Thresher) -> Option<String> {
        let (f, t) = (&self.grains.flow, &self.grains.totals);
        let radius = p.grains.as_ref().map_or(0.0, |grains| grains.radius);
        let of_life = self.life.as_ref().map_or(0.0, |life| overlap(&life.totals));
        let deepest = overlap(t).max(of_life);
        if deepest > DEEPEST * radius {
            return Some(format!(
                "grains overlapped by {}, over {} % of their mean radius: take a shorter step.dt",
                quantity(deepest, "m", 2),
                number(100.0 * DEEPEST, 2)
            ));
        }
        if f.through_steel > 0 {
            return Some(format!(
                "{} grains passed through the steel",
                f.through_steel
            ));
        }
        let of_life = self
            .life
            .as_ref()
            .map_or(0, |life| life.totals.failed_islands);
        let failed = t.failed_islands + of_life;
        if failed > 0 {
            return Some(format!("{failed} contact problems failed"));
        }
        // the feed holds up to a grain
        let late = f.waiting > 0.01 * f.due;
        late.then(|| {
            format!(
                "{} of grains found no room at the inlet: the machine does not take the feed",
                quantity(f.waiting, "kg", 3)
            )
        })
    }
}

/// Estimate of the torque \[N m\] that a loose crop takes, a machine total; impacts and grains that outrun the
/// tips may add to it.
///
/// ```text
/// T = ṁ R [v (1 + μ Θ) − v_0],    v = ω R                                            (1)
/// ```
///
/// It enters at `v_0` and leaves at the speed of the tips `v`. On its way through the arc `Θ` its own
/// centrifugal force, `ṁ v` a radian, presses it on the concave, whose friction is `μ`.
fn loose_torque(p: &Thresher) -> f64 {
    let arc = (p.concave_end_deg - p.concave_start_deg).to_radians();
    let tip = p.speed * p.tip_radius;
    p.feed_rate * p.tip_radius * (tip * (1.0 + p.friction_concave * arc) - p.entry_speed)
}

/// Mean pressure on the concave \[Pa\] whose friction takes what [`loose_torque`] leaves of the operating
/// torque; 0 if it leaves nothing.
fn squeeze(p: &Thresher) -> f64 {
    let arc = (p.concave_end_deg - p.concave_start_deg).to_radians();
    let radius = p.tip_radius + 0.5 * (p.clearance_inlet + p.clearance_outlet);
    let left = (p.operating_torque - loose_torque(p)).max(0.0);
    left / (p.friction_concave * radius * radius * arc * p.machine_width)
}

/// The worst overlap \[m\], of impacts too.
fn overlap(totals: &Totals) -> f64 {
    totals.penetration.max(totals.penetration_impact)
}

/// Depth of a revolution along the tooth, by crop.
fn wear_by_crop(rows: &[CropWearRow], subtitle: &str) -> Chart {
    let mut chart = Chart::new(
        "Wear along the tooth",
        Axis::linear("along the base, from the tall end to the toe [mm]"),
        Axis::linear("depth of 1e6 revolutions at the rate of new teeth [mm]"),
    );
    chart.subtitle = subtitle.into();
    for own in rows.chunk_by(|a, b| a.crop == b.crop) {
        let points = own
            .iter()
            .map(|r| (1e3 * r.x_m, 1e3 * MILLION * r.depth_m_per_revolution));
        let series = Series::new(own[0].crop.as_str(), Style::LinePoints, points.collect());
        chart.series.push(series);
    }
    chart
}
