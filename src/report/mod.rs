//! Output of the program: CSV files, SVG charts, terminal tables, and the output folder.
//!
//! All output is made from records and rows alone. Files hold SI units at full precision;
//! millimetres and hours appear in charts and tables only.

mod accuracy_charts;
mod arrows;
mod atlas_matrix;
mod axis;
mod canvas;
mod chart;
mod csv_files;
mod csv_rows;
mod domination;
mod drawing;
mod folder;
mod issues_matrix;
mod kept;
mod labels;
mod layout;
mod legend;
mod markup;
mod model_matrix;
mod moving;
mod moving_frames;
mod order;
mod packed;
mod page;
mod palette;
mod panel;
mod panels;
mod performance;
mod progress;
mod replay;
mod result_charts;
mod run_charts;
mod scatter;
mod sheet;
mod stage;
mod still;
mod still_bodies;
mod sweep_charts;
mod table;
mod throughput_chart;
mod tornado;
mod value_map;

pub use accuracy_charts::accuracy_charts;
pub use atlas_matrix::matrix;
pub use axis::{Axis, Scale};
pub use chart::{Chart, Colour, Dash, HLine, Mark, PointLabel, Series, Style};
pub(crate) use csv_files::row;
pub use csv_files::{CsvFile, Row, parse_rows, read_rows, write_rows, written_rows};
pub use csv_rows::{
    AccuracyRow, BodyRow, ContactRow, DominationRow, GrainRow, ImpactRow, ModelRow, PerformanceRow,
    PointRow, ResultRow, StepRow, UndominatedRow,
};
pub use domination::{Cause, Domination, front, shared};
pub use folder::{OutputFolder, Reopened};
pub use issues_matrix::{Reply, SAID, complaints, engines, rows_of};
pub use kept::{Checkpoint, KEPT, RunRecord};
pub use model_matrix::model_matrix;
pub use moving::Moving;
pub use order::observed_order;
pub use page::{Lead, Page, Section};
pub use panels::panels;
pub use performance::{Performance, Score, Work};
pub use progress::Progress;
pub use replay::{Replay, Watch};
pub use result_charts::{convergence, energy, work_precision};
pub use run_charts::run_charts;
pub use scatter::scatter;
pub use stage::{Actor, Link, Piece, Pose, Stage, View};
pub use still::Still;
pub use sweep_charts::{SweepPoint, SweepResult};
pub use table::{Align, Table, counted, number, plus_minus, quantity, step_length};
pub use throughput_chart::throughput;
pub use tornado::{Tornado, TornadoRow};

use std::path::{Path, PathBuf};

/// Errors of writing and drawing results.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file or folder cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    /// The path of a folder exists and is not a folder.
    #[error("{}: exists and is not a folder", path.display())]
    NotAFolder { path: PathBuf },
    /// A file would replace a folder of the same name.
    #[error("{}: is a folder, not replaced by a file", path.display())]
    IsAFolder { path: PathBuf },
    /// There is no run to be resumed.
    #[error("{}: no run was stopped here that had begun, there is no {}/run.json; peers, the study and runs with \
             --accuracy or --dump-problems keep no checkpoint and are run anew", path.display(), kept::KEPT)]
    NothingKept { path: PathBuf },
    /// The run is not stopped.
    #[error("{}: another run is still writing here", path.display())]
    Running { path: PathBuf },
    /// A file of a checkpoint is not what it was.
    #[error("{}: the checkpoint is damaged: {reason}; remove the folder and run again", path.display())]
    Damaged { path: PathBuf, reason: String },
    /// A CSV file does not hold the expected rows.
    #[error("{}: {source}", path.display())]
    Csv { path: PathBuf, source: csv::Error },
    /// A CSV file has another header.
    #[error("{}: header is \"{found}\", expected \"{expected}\"", path.display())]
    Header {
        path: PathBuf,
        found: String,
        expected: String,
    },
    /// No point of the chart can be drawn.
    #[error(
        "chart \"{title}\": nothing to draw, {skipped} points are not finite (or not positive on a log axis)"
    )]
    EmptyChart { title: String, skipped: usize },
    /// The chart's settings contradict each other or its data.
    #[error("chart \"{title}\": {reason}")]
    Chart { title: String, reason: String },
}

impl ReportError {
    fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |source| ReportError::Io {
            path: path.to_path_buf(),
            source,
        }
    }

    /// An I/O error inside the csv crate becomes `ReportError::Io`.
    fn csv(path: &Path) -> impl FnOnce(csv::Error) -> Self + '_ {
        move |error| {
            let path = path.to_path_buf();
            if !error.is_io_error() {
                return ReportError::Csv {
                    path,
                    source: error,
                };
            }
            match error.into_kind() {
                csv::ErrorKind::Io(source) => ReportError::Io { path, source },
                other => ReportError::Io {
                    path,
                    source: std::io::Error::other(format!("{other:?}")),
                },
            }
        }
    }
}
