//! The content of a checkpoint: what a run must know to go on where it was.
//!
//! A checkpoint is a row of values in CBOR (RFC 8949), read in the order in which they were written. All
//! numbers come back bit for bit, infinite ones and NaN as well, which JSON does not have. Where the file
//! lies and how it gets there is a matter of [`crate::report`].

use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Display;
use thiserror::Error;

/// Why a checkpoint cannot be made, or is not that of the run.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CheckpointError {
    #[error("the state cannot be saved: {0}")]
    Write(String),
    #[error("the checkpoint does not fit the run: {0}")]
    Read(String),
}

impl CheckpointError {
    /// What was read cannot be used.
    pub fn unfit(why: impl Display) -> Self {
        CheckpointError::Read(why.to_string())
    }
}

/// Takes up the values of a checkpoint, one behind the other.
#[derive(Debug, Default)]
pub struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    /// Adds a value.
    ///
    /// # Errors
    /// [`CheckpointError::Write`] if its type refuses to be serialised.
    pub fn put(&mut self, value: &(impl Serialize + ?Sized)) -> Result<(), CheckpointError> {
        let written = ciborium::into_writer(value, &mut self.bytes);
        written.map_err(|error| CheckpointError::Write(error.to_string()))
    }

    /// All values so far.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Gives the values of a checkpoint back in their order.
#[derive(Debug)]
pub struct Reader {
    bytes: Vec<u8>,
    at: usize,
}

impl Reader {
    /// # Arguments
    /// - `bytes`: of a [`Writer`].
    pub fn new(bytes: Vec<u8>) -> Reader {
        Reader { bytes, at: 0 }
    }

    /// The next value.
    ///
    /// # Errors
    /// [`CheckpointError::Read`] if there is none, or one of another kind.
    pub fn take<T: DeserializeOwned>(&mut self) -> Result<T, CheckpointError> {
        let mut rest = &self.bytes[self.at..];
        let value = ciborium::from_reader(&mut rest).map_err(CheckpointError::unfit)?;
        self.at = self.bytes.len() - rest.len();
        Ok(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn values_come_back_bit_for_bit_and_in_order() {
        let numbers = [0.1, -0.0, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE, 1e300];
        let small = [0.1f32, f32::MAX, 1e-40];
        let map = BTreeMap::from([((1u32, 2u32), u64::MAX), ((0, 7), 0)]);
        let mut writer = Writer::default();
        writer.put(&numbers).unwrap();
        writer.put(&small).unwrap();
        writer.put(&map).unwrap();
        writer.put("end").unwrap();
        let mut reader = Reader::new(writer.bytes().to_vec());
        let bits = |x: &[f64; 6]| x.map(f64::to_bits);
        assert_eq!(bits(&reader.take().unwrap()), bits(&numbers));
        assert_eq!(reader.take::<[f32; 3]>().unwrap(), small);
        assert_eq!(reader.take::<BTreeMap<(u32, u32), u64>>().unwrap(), map);
        // another kind is refused, and leaves the value to be read
        assert!(reader.take::<f64>().is_err());
        assert_eq!(reader.take::<String>().unwrap(), "end");
        assert!(reader.take::<String>().is_err());
    }
}
