//! A hash that distinguishes resolved scenes.

use super::file::SceneFile;
use super::machine::Whole;
use serde::Serialize;

/// FNV-1a, 64 bits (Fowler, Noll & Vo), over the JSON of the file without title and notes.
///
/// Keys are in the order of the structs and floats in their shortest exact form, so that the hash
/// depends on the values alone, not on platform, key order or comments. Not cryptographic.
pub(super) fn of<M: Serialize>(file: &SceneFile, machine: &M) -> u64 {
    let mut file = file.clone();
    file.scene.title.clear();
    file.scene.notes.clear();
    // Structs of strings and finite numbers always have a JSON form.
    let json = serde_json::to_string(&Whole::new(&file, machine)).unwrap_or_default();
    fnv1a(json.as_bytes())
}

/// FNV-1a, 64 bits, of any bytes: tells contents apart, and is not cryptographic.
pub fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
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
