//! A hash that distinguishes resolved scenes.

use super::file::SceneFile;
use super::machine::Whole;
use serde::Serialize;
use std::io::{self, Write};

/// FNV-1a, 64 bits (Fowler, Noll & Vo), over the JSON of the file without title and notes.
///
/// Keys are in the order of the structs and floats in their shortest exact form, so that the hash
/// depends on the values alone, not on platform, key order or comments. Not cryptographic.
pub(super) fn of<M: Serialize>(file: &mut SceneFile, machine: &M) -> u64 {
    let [title, notes] = [&mut file.scene.title, &mut file.scene.notes].map(std::mem::take);
    let mut hash = Fnv1a(START);
    // Structs of strings and finite numbers always have a JSON form, and hashing cannot fail.
    let _ = serde_json::to_writer(&mut hash, &Whole::new(file, machine));
    (file.scene.title, file.scene.notes) = (title, notes);
    hash.0
}

const START: u64 = 0xCBF2_9CE4_8422_2325;

/// FNV-1a, 64 bits, of any bytes: tells contents apart, and is not cryptographic.
pub fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(START, next)
}

fn next(hash: u64, byte: &u8) -> u64 {
    (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01B3)
}

/// The hash of what is written to it.
struct Fnv1a(u64);

impl Write for Fnv1a {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 = bytes.iter().fold(self.0, next);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn fnv_gives_the_published_values() {
        // Test vectors of the authors' page.
        assert_eq!(super::fnv1a(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(super::fnv1a(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(super::fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }
}
