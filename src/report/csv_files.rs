//! CSV files: written row by row or whole, and read back.

use std::fs::File;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{OutputFolder, ReportError};

/// One row of one of the program's CSV files.
pub trait Row: Serialize {
    /// The file's name.
    const FILE: &'static str;
    /// The column names, which are the field names.
    const HEADER: &'static [&'static str];
}

/// A row type whose header is its field names, so that the two cannot drift apart.
macro_rules! row {
    ($(#[$doc:meta])* $name:ident in $file:literal {
        $($(#[$field_doc:meta])* $field:ident: $kind:ty,)*
    }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $kind,)*
        }

        impl $crate::report::Row for $name {
            const FILE: &'static str = $file;
            const HEADER: &'static [&'static str] = &[$(stringify!($field)),*];
        }
    };
}
pub(crate) use row;

/// A CSV file written row by row; only a buffer of it is ever in memory.
///
/// Floats are the shortest text that reads back bit for bit; no comment rows.
#[derive(Debug)]
pub struct CsvFile<R> {
    writer: csv::Writer<File>,
    /// Where it will stand.
    path: PathBuf,
    row: PhantomData<fn(&R)>,
}

impl<R: Row> CsvFile<R> {
    /// Starts `R::FILE` in `folder` with its header, which stands there even if no row follows.
    ///
    /// # Errors
    /// `ReportError::Io`.
    pub fn create(folder: &OutputFolder) -> Result<Self, ReportError> {
        let path = folder.place(R::FILE);
        let mut writer = csv::WriterBuilder::new()
            .has_headers(false)
            .from_path(folder.path(R::FILE))
            .map_err(ReportError::csv(&path))?;
        writer
            .write_record(R::HEADER)
            .map_err(ReportError::csv(&path))?;
        Ok(CsvFile {
            writer,
            path,
            row: PhantomData,
        })
    }

    /// Goes on with a file of a resumed run, from its first `length` bytes.
    ///
    /// # Errors
    /// `ReportError::Io`; `ReportError::Damaged` if it is shorter.
    pub fn reopen(folder: &OutputFolder, length: u64) -> Result<Self, ReportError> {
        let path = folder.place(R::FILE);
        let open = || -> std::io::Result<(File, u64)> {
            let file = File::options().append(true).open(folder.path(R::FILE))?;
            let found = file.metadata()?.len();
            if found > length {
                // rows that were written after the checkpoint
                file.set_len(length)?;
            }
            Ok((file, found))
        };
        let (file, found) = open().map_err(ReportError::io(&folder.path(R::FILE)))?;
        if found < length {
            return Err(ReportError::Damaged {
                path: folder.path(R::FILE),
                reason: format!("it has {found} bytes of {length}"),
            });
        }
        Ok(CsvFile {
            writer: csv::WriterBuilder::new()
                .has_headers(false)
                .from_writer(file),
            path,
            row: PhantomData,
        })
    }

    /// Hands what is buffered to the system, which keeps it if the program is killed.
    ///
    /// # Errors
    /// `ReportError::Io`.
    pub fn flush(&mut self) -> Result<(), ReportError> {
        self.writer.flush().map_err(ReportError::io(&self.path))
    }

    /// Writes out what is buffered, down to the disk, and tells the length of the file.
    ///
    /// # Errors
    /// `ReportError::Io`.
    pub fn settle(&mut self) -> Result<u64, ReportError> {
        let mut settle = || -> std::io::Result<u64> {
            self.writer.flush()?;
            let file = self.writer.get_ref();
            file.sync_data()?;
            Ok(file.metadata()?.len())
        };
        settle().map_err(ReportError::io(&self.path))
    }

    /// Appends a row.
    ///
    /// # Errors
    /// `ReportError::Io`.
    pub fn write(&mut self, row: &R) -> Result<(), ReportError> {
        self.writer
            .serialize(row)
            .map_err(ReportError::csv(&self.path))
    }

    /// Writes out what is buffered. A file merely dropped is written too, but its errors are lost.
    ///
    /// # Errors
    /// `ReportError::Io`, such as a full disk.
    pub fn finish(mut self) -> Result<(), ReportError> {
        self.writer.flush().map_err(ReportError::io(&self.path))
    }
}

/// Writes `R::FILE` of `folder` in one go: header and rows.
///
/// # Errors
/// `ReportError::Io`.
pub fn write_rows<R: Row>(folder: &OutputFolder, rows: &[R]) -> Result<(), ReportError> {
    let mut file = CsvFile::create(folder)?;
    for row in rows {
        file.write(row)?;
    }
    file.finish()
}

/// All rows of a CSV file that this program wrote, from which its charts are drawn.
///
/// # Errors
/// `ReportError::Io`; `ReportError::Header` where the columns are not `R`'s, in order;
/// `ReportError::Csv`, with the line, where a value is not of its column's kind.
pub fn read_rows<R: Row + DeserializeOwned>(path: &Path) -> Result<Vec<R>, ReportError> {
    rows_of(path, path)
}

/// All rows of `R::FILE` as written to a folder that is not committed yet.
///
/// # Errors
/// Those of [`read_rows`], the file called by where it will stand.
pub fn written_rows<R: Row + DeserializeOwned>(
    folder: &OutputFolder,
) -> Result<Vec<R>, ReportError> {
    rows_of(&folder.path(R::FILE), &folder.place(R::FILE))
}

/// The rows of `file`, which errors call `path`.
fn rows_of<R: Row + DeserializeOwned>(file: &Path, path: &Path) -> Result<Vec<R>, ReportError> {
    rows_from(
        csv::Reader::from_path(file).map_err(ReportError::csv(path))?,
        path,
    )
}

/// The rows of a CSV file's `text`, which errors call `name`.
///
/// # Errors
/// Those of [`read_rows`].
pub fn parse_rows<R: Row + DeserializeOwned>(
    text: &str,
    name: &str,
) -> Result<Vec<R>, ReportError> {
    rows_from(csv::Reader::from_reader(text.as_bytes()), Path::new(name))
}

fn rows_from<R: Row + DeserializeOwned>(
    mut reader: csv::Reader<impl std::io::Read>,
    path: &Path,
) -> Result<Vec<R>, ReportError> {
    let header = reader.headers().map_err(ReportError::csv(path))?;
    if !header.iter().eq(R::HEADER.iter().copied()) {
        return Err(ReportError::Header {
            path: path.to_path_buf(),
            found: header.iter().collect::<Vec<_>>().join(","),
            expected: R::HEADER.join(","),
        });
    }
    reader
        .deserialize()
        .collect::<Result<_, _>>()
        .map_err(ReportError::csv(path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Vec2;
    use crate::dynamics::record::{
        ContactRecord, ContactStatus, StepEnergy, StepRecord, SurfacePoint,
    };
    use crate::report::{BodyRow, ContactRow, ImpactRow, PerformanceRow, ResultRow, StepRow};
    use std::fs;

    fn written<R: Row>(rows: &[R]) -> (tempfile::TempDir, PathBuf) {
        let root = tempfile::tempdir().unwrap();
        let folder = OutputFolder::create(root.path()).unwrap();
        write_rows(&folder, rows).unwrap();
        let path = folder.commit().unwrap().join(R::FILE);
        (root, path)
    }

    fn header<R: Row>() -> String {
        let (_root, path) = written::<R>(&[]);
        fs::read_to_string(path).unwrap()
    }

    /// The headers are those of the interface document; an empty file has one too.
    #[test]
    fn headers_are_those_of_the_interface() {
        assert_eq!(
            header::<BodyRow>(),
            "time_s,body,x_m,y_m,angle_rad,vx_m_s,vy_m_s,omega_rad_s\n"
        );
        assert_eq!(
            header::<ContactRow>(),
            "time_s,body_1,body_2,cell,x_m,y_m,nx,ny,gap_m,impulse_n_ns,impulse_t_ns,slip_m,\
             load_slip_nm,friction_work_j,status\n"
        );
        assert_eq!(
            header::<ImpactRow>(),
            "time_s,body_1,body_2,x_m,y_m,nx,ny,approach_speed_m_s,impulse_n_ns,impulse_t_ns,\
             energy_lost_j\n"
        );
        assert_eq!(
            header::<StepRow>(),
            "time_s,dt_s,contacts,islands,resting,sweeps,factorisations,pivots,\
             residual,\
             residual_velocity_m_s,unsolved,failed,redundant,capped,relaxed,joints_capped,events,recovering,\
             impact_gain_j,kinetic_j,potential_j,\
             work_forces_j,work_contact_n_j,work_contact_t_j,work_joints_j,work_motors_j,\
             work_returned_j,work_recovery_j,imbalance_j,penetration_m,penetration_impact_m,joint_gap_m\n"
        );
        assert_eq!(header::<PerformanceRow>(), "solver,ratio,share\n");
        assert_eq!(
            header::<ResultRow>(),
            "scene,rung,engine,scheme,solver,setting,dt_s,threads,precision,measure,value,unit,\
             reference,seconds_per_simulated_second,spread,verdict,mode\n"
        );
    }

    #[test]
    fn floats_read_back_bit_for_bit() {
        let values = [
            0.1 + 0.2,
            -0.0,
            5e-324,
            f64::MAX,
            f64::MIN_POSITIVE,
            1.0 / 3.0,
            1e23,
            -f64::from_bits(0x000f_ffff_ffff_ffff),
            4e6,
        ];
        let rows: Vec<BodyRow> = values
            .iter()
            .map(|&v| BodyRow {
                time_s: v,
                body: 1,
                x_m: -v,
                y_m: v,
                angle_rad: v,
                vx_m_s: v,
                vy_m_s: v,
                omega_rad_s: v,
            })
            .collect();
        let (_root, path) = written(&rows);
        let back: Vec<BodyRow> = read_rows(&path).unwrap();
        assert_eq!(back.len(), values.len());
        for (row, value) in back.iter().zip(values) {
            assert_eq!(row.time_s.to_bits(), value.to_bits());
            assert_eq!(row.x_m.to_bits(), (-value).to_bits());
        }
    }

    #[test]
    fn a_failed_result_keeps_its_nan_and_its_commas() {
        let row = ResultRow {
            scene: "stack".into(),
            rung: "10".into(),
            engine: "rapier".into(),
            scheme: String::new(),
            solver: String::new(),
            setting: "dt=1/60, substeps \"4\"".into(),
            dt_s: 1.0 / 60.0,
            threads: 1,
            precision: "f32".into(),
            measure: "drift".into(),
            value: f64::NAN,
            unit: "m".into(),
            reference: "rest".into(),
            seconds_per_simulated_second: None,
            spread: None,
            verdict: "fail".into(),
            mode: "explodes".into(),
        };
        let (_root, path) = written(std::slice::from_ref(&row));
        let back: Vec<ResultRow> = read_rows(&path).unwrap();
        assert!(back[0].value.is_nan());
        assert_eq!(back[0].setting, row.setting);
        assert_eq!(back[0].spread, None);
    }

    #[test]
    fn records_land_in_their_columns() {
        let contact = ContactRecord {
            time: 0.5,
            bodies: [1, 2],
            surfaces: [0, 0],
            places: [3, 0].map(SurfacePoint::on),
            position: Vec2::new(4.0, 5.0),
            normal: Vec2::new(6.0, 7.0),
            gap: 8.0,
            impulse_n: 9.0,
            impulse_t: 10.0,
            moments: [None; 2],
            slip: 11.0,
            load_slip: 12.0,
            friction_work: 13.0,
            normal_work: 0.0,
            stiffness: 14.0,
            status: ContactStatus::SlipMinus,
        };
        let (_root, path) = written(&[ContactRow::new(&contact)]);
        let text = fs::read_to_string(path).unwrap();
        assert_eq!(
            text.lines().nth(1).unwrap(),
            "0.5,1,2,3,4.0,5.0,6.0,7.0,8.0,9.0,10.0,11.0,12.0,13.0,slip-"
        );
        let step = StepRecord {
            time: 0.5,
            dt: 0.25,
            accounted: true,
            contacts: vec![contact],
            impacts: Vec::new(),
            unread: 0,
            joints: Vec::new(),
            islands: 2,
            resting: 1,
            sweeps: 3,
            factorisations: 4,
            pivots: 5,
            residual: 6.0,
            residual_velocity: 7.0,
            unsolved: 8,
            failed: 27,
            redundant: 9,
            capped: 10,
            relaxed: 11,
            joints_capped: 25,
            events: 22,
            recovering: 23,
            impact_gain: 24.0,
            energy: StepEnergy {
                kinetic_start: 100.0,
                kinetic_end: 12.0,
                potential_start: 0.0,
                potential_end: 13.0,
                forces: 14.0,
                contact_n: 15.0,
                contact_t: 16.0,
                joints: 17.0,
                motors: 18.0,
                returned: 28.0,
                recovery: 19.0,
            },
            penetration: 20.0,
            penetration_impact: 21.0,
            joint_gap: 26.0,
            ..StepRecord::default()
        };
        let (_root, path) = written(&[StepRow::of(&step)]);
        let text = fs::read_to_string(path).unwrap();
        // imbalance: (12 - 100) - (14 + 15 + 16 + 17 + 18 + 28)
        assert_eq!(
            text.lines().nth(1).unwrap(),
            "0.5,0.25,1,2,1,3,4,5,6.0,7.0,8,27,9,10,11,25,22,23,24.0,12.0,13.0,14.0,15.0,16.0,17.0,18.0,28.0,19.0,-196.0,20.0,21.0,26.0"
        );
    }

    #[test]
    fn another_header_is_refused_by_name() {
        let (_root, path) = written::<BodyRow>(&[]);
        let error = read_rows::<StepRow>(&path).unwrap_err();
        assert!(matches!(error, ReportError::Header { .. }));
        assert!(
            error.to_string().contains("time_s,dt_s,contacts"),
            "{error}"
        );
    }
}
