//! Frames of a moving picture, read from the CSV files of a run.

use super::arrows::{Arrow, AtEnd};
use super::replay::{Rows, column};
use super::stage::{Pose, Stage};
use super::{BodyRow, ContactRow, ImpactRow, OutputFolder, ReportError};
use crate::dynamics::record::ContactStatus;
use std::f64::consts::TAU;

/// The scene at the end of a step.
pub(super) struct Frame {
    /// \[s\]
    pub time: f64,
    /// Length of the step that ends then \[s\].
    dt: f64,
    /// Angles go on beyond whole turns.
    pub poses: Vec<Pose>,
    velocities: Vec<[f64; 3]>,
    pub arrows: Vec<Arrow>,
}

impl Frame {
    /// Every `stride`-th block of rows, up to the first that is not finite.
    pub fn read(
        stage: &Stage,
        folder: &OutputFolder,
        steps: &[[f64; 2]],
        stride: usize,
    ) -> Result<Vec<Frame>, ReportError> {
        let mut frames = Frame::read_bodies(stage, folder, steps, stride)?;
        let block_of = |time: f64| 1 + steps.partition_point(|[end, _]| *end < time);
        let (mut rows, header) = Rows::open::<ContactRow>(folder)?;
        let of = arrow_columns(&header);
        let [at, status] = ["time_s", "status"].map(|name| column(&header, name));
        while rows.next()? {
            let block = block_of(rows.number(at));
            let frame = frames.get_mut(block / stride);
            if let Some(frame) = frame.filter(|_| block.is_multiple_of(stride)) {
                let arrow = arrow_of(stage, &rows, of, status_of(rows.word(status)));
                frame.push(stage, arrow, None);
            }
        }
        // a frame shows the impacts since the frame before it
        let (mut rows, header) = Rows::open::<ImpactRow>(folder)?;
        let of = arrow_columns(&header);
        let at = column(&header, "time_s");
        while rows.next()? {
            let block = block_of(rows.number(at));
            if let Some(frame) = frames.get_mut(block.div_ceil(stride)) {
                let arrow = arrow_of(stage, &rows, of, ContactStatus::Impact);
                frame.push(stage, arrow, Some(rows.number(at)));
            }
        }
        Ok(frames)
    }

    /// Adds an arrow where the bodies of the frame have carried it; see [`AtEnd::carried`].
    fn push(&mut self, stage: &Stage, found: Option<(Arrow, [u32; 2])>, instant: Option<f64>) {
        let at_end = AtEnd {
            stage,
            poses: &self.poses,
            velocities: &self.velocities,
            time: self.time,
            dt: self.dt,
        };
        let arrow = found.map(|(arrow, bodies)| at_end.carried(arrow, bodies, instant));
        self.arrows.extend(arrow);
    }

    fn read_bodies(
        stage: &Stage,
        folder: &OutputFolder,
        steps: &[[f64; 2]],
        stride: usize,
    ) -> Result<Vec<Frame>, ReportError> {
        let (mut rows, header) = Rows::open::<BodyRow>(folder)?;
        let pose = ["x_m", "y_m", "angle_rad"].map(|name| column(&header, name));
        let velocity = ["vx_m_s", "vy_m_s", "omega_rad_s"].map(|name| column(&header, name));
        let count = stage.bodies.len().max(1);
        let mut frames: Vec<Frame> = Vec::new();
        // of each body: pose, velocity
        let mut last: Vec<(Pose, [f64; 3])> = Vec::new();
        for block in 0..=steps.len() {
            let step = |block: usize| {
                if block == 0 {
                    [0.0; 2]
                } else {
                    steps[block - 1]
                }
            };
            let [time, dt] = step(block);
            let span = time - step(block.saturating_sub(1))[0];
            for k in 0..count {
                if !rows.next()? {
                    return Ok(frames);
                }
                let mut pose = pose.map(|column| rows.number(column));
                let velocity = velocity.map(|column| rows.number(column));
                match last.get_mut(k) {
                    Some(before) => {
                        // the angle is known up to whole turns: the spin says how many
                        let turned = before.0[2] + 0.5 * span * (before.1[2] + velocity[2]);
                        pose[2] += TAU * ((turned - pose[2]) / TAU).round();
                        *before = (pose, velocity);
                    }
                    None => last.push((pose, velocity)),
                }
            }
            if last
                .iter()
                .any(|(pose, _)| pose.iter().any(|q| !q.is_finite()))
            {
                return Ok(frames);
            }
            if block.is_multiple_of(stride) {
                frames.push(Frame {
                    time,
                    dt,
                    poses: last.iter().map(|(pose, _)| *pose).collect(),
                    velocities: last.iter().map(|(_, velocity)| *velocity).collect(),
                    arrows: Vec::new(),
                });
            }
        }
        Ok(frames)
    }
}

/// The impulse of a row and its bodies; `None` without an impulse.
fn arrow_of(
    stage: &Stage,
    rows: &Rows,
    of: [usize; 8],
    status: ContactStatus,
) -> Option<(Arrow, [u32; 2])> {
    let [first, second, x, y, nx, ny, n, t] = of.map(|column| rows.number(column));
    let arrow = Arrow::new(stage, second as u32, [x, y], [nx, ny], [n, t], status);
    let size = arrow.size();
    let shown = size > 0.0 && size.is_finite() && stage.lane == 0.0;
    shown.then_some((arrow, [first as u32, second as u32]))
}

/// Places of what an arrow needs in a row of contacts or impacts.
fn arrow_columns(header: &[String]) -> [usize; 8] {
    [
        "body_1",
        "body_2",
        "x_m",
        "y_m",
        "nx",
        "ny",
        "impulse_n_ns",
        "impulse_t_ns",
    ]
    .map(|name| column(header, name))
}

fn status_of(word: &str) -> ContactStatus {
    match word {
        "stick" => ContactStatus::Stick,
        "slip+" => ContactStatus::SlipPlus,
        "slip-" => ContactStatus::SlipMinus,
        "impact" => ContactStatus::Impact,
        _ => ContactStatus::Open,
    }
}
