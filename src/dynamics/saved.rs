//! Number formats of a saved state.

/// A pair as a list of two.
pub(crate) mod pair {
    use crate::contact::Vec2;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(v: &Vec2, to: S) -> Result<S::Ok, S::Error> {
        [v.x, v.y].serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec2, D::Error> {
        <[f64; 2]>::deserialize(from).map(Vec2::from)
    }
}

/// An optional pair.
pub(crate) mod some_pair {
    use crate::contact::Vec2;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(v: &Option<Vec2>, to: S) -> Result<S::Ok, S::Error> {
        v.map(|v| [v.x, v.y]).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Vec2>, D::Error> {
        Option::<[f64; 2]>::deserialize(from).map(|v| v.map(Vec2::from))
    }
}

/// A number that may be infinite; JSON has none for that.
pub(crate) mod endless {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(number: &f64, to: S) -> Result<S::Ok, S::Error> {
        number.is_finite().then_some(*number).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        Option::deserialize(from).map(|number| number.unwrap_or(f64::INFINITY))
    }
}
