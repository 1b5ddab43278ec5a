//! Frames of a moving picture, read from the CSV files of a run.

use super::arrows::Arrow;
use super::replay::{Rows, column};
use super::stage::{Pose, Stage};
use super::{BodyRow, ContactRow, ImpactRow, OutputFolder, ReportError};
use crate::dynamics::record::ContactStatus;
use std::f64::consts::TAU;

/// The scene at the end of a step.
pub(super) struct Frame {
    /// \[s\]
    pub time: f64,
    /// Angles go on beyond whole turns.
    pub poses: Vec<Pose>,
    pub arrows: Vec<Arrow>,
}

impl Frame {
    /// Every `stride`-th block of rows, up to the first that is not finite.
    pub fn read(
        stage: &Stage,
        folder: &OutputFolder,
        times: &[f64],
        stride: usize,
    ) -> Result<Vec<Frame>, ReportError> {
        let mut frames = Frame::read_bodies(stage, folder, times, stride)?;
        let (mut rows, header) = Rows::open::<ContactRow>(folder)?;
        let of = arrow_columns(&header);
        let [at, status] = ["time_s", "status"].map(|name| column(&header, name));
        while rows.next()? {
            let block = 1 + times.partition_point(|end| *end < rows.number(at));
            let frame = frames.get_mut(block / stride);
            if let Some(frame) = frame.filter(|_| block.is_multiple_of(stride)) {
                let arrow = arrow_of(stage, &rows, of, status_of(rows.word(status)));
                frame.arrows.extend(arrow);
            }
        }
        // a frame shows the impacts since the frame before it
        let (mut rows, header) = Rows::open::<ImpactRow>(folder)?;
        let of = arrow_columns(&header);
        let at = column(&header, "time_s");
        while rows.next()? {
            let block = 1 + times.partition_point(|end| *end < rows.number(at));
            if let Some(frame) = frames.get_mut(block.div_ceil(stride)) {
                let arrow = arrow_of(stage, &rows, of, ContactStatus::Impact);
                frame.arrows.extend(arrow);
            }
        }
        Ok(frames)
    }

    fn read_bodies(
        stage: &Stage,
        folder: &OutputFolder,
        times: &[f64],
        stride: usize,
    ) -> Result<Vec<Frame>, ReportError> {
        let (mut rows, header) = Rows::open::<BodyRow>(folder)?;
        let names = ["x_m", "y_m", "angle_rad", "omega_rad_s"];
        let [x, y, angle, omega] = names.map(|name| column(&header, name));
        let count = stage.bodies.len().max(1);
        let mut frames: Vec<Frame> = Vec::new();
        // of each body: pose, spin
        let mut last: Vec<(Pose, f64)> = Vec::new();
        for block in 0..=times.len() {
            let time = |block: usize| if block == 0 { 0.0 } else { times[block - 1] };
            let span = time(block) - time(block.saturating_sub(1));
            for k in 0..count {
                if !rows.next()? {
                    return Ok(frames);
                }
                let mut pose = [x, y, angle].map(|column| rows.number(column));
                let spin = rows.number(omega);
                match last.get_mut(k) {
                    Some((before, spun)) => {
                        // the angle is known up to whole turns: the spin says how many
                        let turned = before[2] + 0.5 * span * (*spun + spin);
                        pose[2] += TAU * ((turned - pose[2]) / TAU).round();
                        (*before, *spun) = (pose, spin);
                    }
                    None => last.push((pose, spin)),
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
                    time: time(block),
                    poses: last.iter().map(|(pose, _)| *pose).collect(),
                    arrows: Vec::new(),
                });
            }
        }
        Ok(frames)
    }
}

/// The impulse of a row; `None` without one.
fn arrow_of(stage: &Stage, rows: &Rows, of: [usize; 7], status: ContactStatus) -> Option<Arrow> {
    let [second, x, y, nx, ny, n, t] = of.map(|column| rows.number(column));
    let arrow = Arrow::new(stage, second as u32, [x, y], [nx, ny], [n, t], status);
    let size = arrow.size();
    (size > 0.0 && size.is_finite() && stage.lane == 0.0).then_some(arrow)
}

/// Places of what an arrow needs in a row of contacts or impacts.
fn arrow_columns(header: &[String]) -> [usize; 7] {
    [
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
