//! Parts of a study as bytes: words of eight, little-endian, numbers as their bits.

use super::Counts;
use super::reference::ReferencePart;
use super::score::TrialSums;
use super::times::{PassTime, Times};
use super::units::CellPart;
use linelit_geometry::DVec3;
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

/// What is written.
#[derive(Default)]
pub(super) struct Writer(Vec<u8>);

impl Writer {
    pub(super) fn finish(self) -> Vec<u8> {
        self.0
    }

    fn word(&mut self, value: u64) {
        self.0.extend(value.to_le_bytes());
    }

    pub(super) fn count(&mut self, value: usize) {
        self.word(value as u64);
    }

    fn numbers(&mut self, values: impl IntoIterator<Item = f64>) {
        for value in values {
            self.word(value.to_bits());
        }
    }

    pub(super) fn reference(&mut self, part: &ReferencePart) {
        self.count(part.first);
        self.word(part.replicates.into());
        self.count(part.mean.len());
        for value in part.mean.iter().chain(&part.square) {
            self.numbers(value.to_array());
        }
    }

    pub(super) fn cell(&mut self, part: &CellPart) {
        let sums = &part.sums;
        self.count(sums.mse.len());
        for values in [&sums.mse, &sums.bias, &sums.variance] {
            self.numbers(values.iter().copied());
        }
        self.numbers([sums.mrse, sums.power, sums.reference]);
        let c = &part.counts;
        for count in [
            c.rays,
            c.lines,
            c.line_queries,
            c.node_tests,
            c.triangle_tests,
            c.intervals,
            c.exact_tests,
        ] {
            self.word(count);
        }
        let passes = part.times.passes();
        self.count(passes.len());
        for pass in passes {
            self.numbers([pass.trials, pass.cpu, pass.wall]);
        }
        self.count(part.processor.len());
        self.0.extend(part.processor.as_bytes());
    }
}

/// What is read, from its start on.
pub(super) struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    pub(super) const fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    pub(super) const fn end(&self) -> Result<(), Broken> {
        if self.0.is_empty() {
            Ok(())
        } else {
            Err(Broken("the end"))
        }
    }

    fn word(&mut self) -> Result<u64, Broken> {
        let (word, rest) = self.0.split_first_chunk().ok_or(Broken("a number"))?;
        self.0 = rest;
        Ok(u64::from_le_bytes(*word))
    }

    pub(super) fn count(&mut self) -> Result<usize, Broken> {
        usize::try_from(self.word()?).map_err(|_| Broken("a count"))
    }

    fn number(&mut self) -> Result<f64, Broken> {
        self.word().map(f64::from_bits)
    }

    /// So many, one by one: what is not there takes no memory.
    fn list<T>(
        &mut self,
        count: usize,
        one: impl Fn(&mut Self) -> Result<T, Broken>,
    ) -> Result<Vec<T>, Broken> {
        (0..count).map(|_| one(self)).collect()
    }

    fn vector(&mut self) -> Result<DVec3, Broken> {
        Ok(DVec3::new(self.number()?, self.number()?, self.number()?))
    }

    pub(super) fn reference(&mut self) -> Result<ReferencePart, Broken> {
        let first = self.count()?;
        let replicates = u32::try_from(self.word()?).map_err(|_| Broken("replicates"))?;
        let count = self.count()?;
        Ok(ReferencePart {
            first,
            replicates,
            mean: self.list(count, Self::vector)?,
            square: self.list(count, Self::vector)?,
        })
    }

    pub(super) fn cell(&mut self) -> Result<CellPart, Broken> {
        let trials = self.count()?;
        let sums = TrialSums {
            mse: self.list(trials, Self::number)?,
            bias: self.list(trials, Self::number)?,
            variance: self.list(trials, Self::number)?,
            mrse: self.number()?,
            power: self.number()?,
            reference: self.number()?,
        };
        let counts = Counts {
            rays: self.word()?,
            lines: self.word()?,
            line_queries: self.word()?,
            node_tests: self.word()?,
            triangle_tests: self.word()?,
            intervals: self.word()?,
            exact_tests: self.word()?,
        };
        let passes = self.count()?;
        let pass = |reader: &mut Self| {
            Ok(PassTime {
                trials: reader.number()?,
                cpu: reader.number()?,
                wall: reader.number()?,
            })
        };
        let times = Times::of(self.list(passes, pass)?);
        let length = self.count()?;
        let name = self.0.split_at_checked(length);
        let (name, rest) = name.ok_or(Broken("a processor's name"))?;
        self.0 = rest;
        Ok(CellPart {
            sums,
            times,
            counts,
            processor: String::from_utf8_lossy(name).into_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::units::Part;
    use super::*;

    fn parts() -> [Part; 2] {
        let vector = |k: f64| DVec3::new(k, f64::NAN, -0.0);
        let reference = ReferencePart {
            first: 7,
            replicates: 4,
            mean: vec![vector(0.1), vector(1e-300)],
            square: vec![vector(3.0), vector(f64::INFINITY)],
        };
        let cell = CellPart {
            sums: TrialSums {
                mse: vec![0.1, 0.2],
                bias: vec![-0.1, 0.3],
                variance: vec![0.5, 0.25],
                mrse: 0.75,
                power: 2.0,
                reference: 0.5,
            },
            times: Times::of(vec![PassTime {
                trials: 2.0,
                cpu: 0.5,
                wall: 0.6,
            }]),
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
            let bytes = part.to_bytes();
            let again = Part::from_bytes(&bytes).unwrap();
            assert_eq!(again.to_bytes(), bytes);
            // NaN is not equal to itself: the bytes say it for the reference.
            assert!(matches!(part, Part::Reference(_)) || again == part);
        }
    }

    /// No bytes make it panic or take memory beyond them: neither a part cut short nor one with a
    /// flipped bit.
    #[test]
    fn broken_parts_are_refused_or_other_parts() {
        for part in parts() {
            let bytes = part.to_bytes();
            for end in 0..bytes.len() {
                assert!(Part::from_bytes(&bytes[..end]).is_err(), "{end}");
            }
            for bit in 0..8 * bytes.len() {
                let mut flipped = bytes.clone();
                flipped[bit / 8] ^= 1 << (bit % 8);
                let _ = Part::from_bytes(&flipped);
            }
            assert!(Part::from_bytes(&[&bytes[..], b"more"].concat()).is_err());
        }
    }
}
