//! Parts as bytes: numbers as their bits, lists with their lengths before them (postcard).

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Bytes that are no part, or a part of another study: what was expected there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Broken(pub(super) &'static str);

impl Broken {
    /// The error that says what was expected.
    #[must_use]
    pub const fn of(expected: &'static str) -> Self {
        Self(expected)
    }
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "not a part of this study: expected {}", self.0)
    }
}

impl std::error::Error for Broken {}

/// A value as bytes, from which [`from_bytes`] makes the same.
#[must_use]
pub fn to_bytes(value: &impl Serialize) -> Vec<u8> {
    // Memory takes everything; bytes that are none would be found broken.
    postcard::to_allocvec(value).unwrap_or_default()
}

/// The value that some bytes are of.
///
/// # Errors
/// [`Broken`] if they are not those of such a value, or more than those.
pub fn from_bytes<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Broken> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        Ok(_) => Err(Broken("the end")),
        Err(_) => Err(Broken("other bytes")),
    }
}

/// Lists of vectors, as serde takes them.
pub(super) mod vectors {
    use super::{Deserialize, Serialize};
    use linelit_geometry::DVec3;
    use serde::{Deserializer, Serializer};

    pub(in super::super) fn serialize<S: Serializer>(
        v: &[DVec3],
        to: S,
    ) -> Result<S::Ok, S::Error> {
        let arrays: Vec<[f64; 3]> = v.iter().map(|v| v.to_array()).collect();
        arrays.serialize(to)
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Vec<DVec3>, D::Error> {
        let arrays = Vec::<[f64; 3]>::deserialize(from)?;
        Ok(arrays.into_iter().map(DVec3::from_array).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Counts;
    use super::super::reference::ReferencePart;
    use super::super::score::TrialSums;
    use super::super::times::{PassTime, Times};
    use super::super::units::{CellPart, Part};
    use super::*;
    use linelit_geometry::DVec3;

    fn parts() -> [Part; 2] {
        let vector = |k: f64| DVec3::new(k, f64::NAN, -0.0);
        let reference = ReferencePart {
            first: 7,
            replicates: 4,
            mean: vec![vector(0.1), vector(1e-300)],
            square: vec![vector(3.0), vector(f64::INFINITY)],
        };
        let mut times = Times::default();
        times.add(PassTime {
            trials: 2.0,
            cpu: 0.5,
            wall: 0.6,
        });
        let cell = CellPart {
            sums: TrialSums {
                mse: vec![0.1, 0.2],
                bias: vec![-0.1, 0.3],
                variance: vec![0.5, 0.25],
                mrse: 0.75,
                power: 2.0,
                reference: 0.5,
            },
            times,
            counts: Counts {
                rays: u64::MAX,
                intervals: 3,
                ..Counts::default()
            },
            processor: "a processor, ™".to_owned(),
        };
        [
            Part::Reference(reference),
            Part::Cells(vec![cell.clone(), cell]),
        ]
    }

    #[test]
    fn parts_come_back_as_they_were() {
        for part in parts() {
            let bytes = to_bytes(&part);
            let again = from_bytes::<Part>(&bytes).unwrap();
            assert_eq!(to_bytes(&again), bytes);
            // NaN is not equal to itself: the bytes say it for the reference.
            assert!(matches!(part, Part::Reference(_)) || again == part);
        }
    }

    /// No bytes make it panic or take memory beyond them: neither a part cut short nor one with a
    /// flipped bit.
    #[test]
    fn broken_parts_are_refused_or_other_parts() {
        for part in parts() {
            let bytes = to_bytes(&part);
            for end in 0..bytes.len() {
                assert!(from_bytes::<Part>(&bytes[..end]).is_err(), "{end}");
            }
            for bit in 0..8 * bytes.len() {
                let mut flipped = bytes.clone();
                flipped[bit / 8] ^= 1 << (bit % 8);
                let _ = from_bytes::<Part>(&flipped);
            }
            assert!(from_bytes::<Part>(&[&bytes[..], b"more"].concat()).is_err());
        }
    }
}
