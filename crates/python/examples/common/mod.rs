//! The files by which the examples and `tests/test_same_bits.py` exchange arrays of numbers.

use std::error::Error;
use std::fs;
use std::path::PathBuf;

/// A folder of files, each an array of numbers.
pub(crate) struct Folder(PathBuf);

impl Folder {
    /// Returns the folder that is the first argument of the program.
    pub(crate) fn of_arguments() -> Result<Self, Box<dyn Error>> {
        Ok(Self(std::env::args().nth(1).ok_or("no folder")?.into()))
    }

    /// Reads a file of vectors in `f64`.
    pub(crate) fn vectors(&self, name: &str) -> Result<Vec<[f64; 3]>, Box<dyn Error>> {
        let bytes = fs::read(self.0.join(name))?;
        let numbers = bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b));
        let numbers: Vec<f64> = numbers.collect();
        Ok(numbers.as_chunks().0.to_vec())
    }

    /// Reads a file of vectors in `f32`.
    #[allow(dead_code, reason = "one of the examples has such a file")]
    pub(crate) fn singles(&self, name: &str) -> Result<Vec<[f32; 3]>, Box<dyn Error>> {
        let bytes = fs::read(self.0.join(name))?;
        let numbers = bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b));
        let numbers: Vec<f32> = numbers.collect();
        Ok(numbers.as_chunks().0.to_vec())
    }

    /// Writes numbers to a file.
    pub(crate) fn write(&self, name: &str, numbers: &[f64]) -> Result<(), Box<dyn Error>> {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        Ok(fs::write(self.0.join(name), bytes)?)
    }
}

/// Triangles that share no vertices: each has the next three, in their order.
pub(crate) fn soup(vertices: usize) -> Result<Vec<[u32; 3]>, Box<dyn Error>> {
    let count = u32::try_from(vertices / 3)?;
    Ok((0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}
