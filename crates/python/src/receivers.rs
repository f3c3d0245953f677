//! The points and normals of a query, and the queries of the Rust library for all of them. Points
//! and normals may each be in single or double precision, and one normal may be for all points.

use crate::arrays::{Rows, Vectors, shape_text};
use crate::errors::{NAMED, of_query, value_error};
use crate::threads::detached;
use linelit::bsdf::Bsdf;
use linelit::geometry::DVec3;
use linelit::{Error, Measure, Scene};
use pyo3::prelude::*;

/// The arguments of most queries: points, and a normal for each or one for all.
pub(crate) struct Receivers<'a> {
    pub(crate) points: Rows<'a>,
    normals: Rows<'a>,
}

impl<'a> Receivers<'a> {
    /// Checks that there is a normal for each point, or one for all.
    pub(crate) fn new(points: &'a Vectors<'_>, normals: &'a Vectors<'_>) -> PyResult<Self> {
        if !normals.shape.is_empty() && normals.shape != points.shape {
            let (points, normals) = (shape_text(&points.shape), shape_text(&normals.shape));
            return Err(value_error(format!(
                "points are {points} vectors, normals {normals}: each point needs one"
            )));
        }
        Ok(Self {
            points: points.rows()?,
            normals: normals.rows()?,
        })
    }

    /// Returns the normal of the point with the index `i`.
    pub(crate) fn normal(&self, i: usize) -> DVec3 {
        let only = self.normals.len() == 1;
        self.normals.get(if only { 0 } else { i }).into()
    }

    /// Returns the point with the index `i` and its normal.
    pub(crate) fn get(&self, i: usize) -> [[f64; 3]; 2] {
        [self.points.get(i), self.normal(i).to_array()]
    }

    /// Does work for all points without the interpreter's lock; errors name the point.
    pub(crate) fn detached(
        &self,
        py: Python<'_>,
        threads: Option<usize>,
        work: impl FnOnce() -> Result<(), Error> + Send,
    ) -> PyResult<()> {
        let done = detached(py, self.points.len(), threads, work)?;
        done.map_err(|e| of_query(e, NAMED, |i| self.get(i)))
    }

    /// Writes the irradiance at each point to `out`.
    pub(crate) fn irradiances(&self, scene: &Scene, out: &mut [[f64; 3]]) -> Result<(), Error> {
        // Pass points and normals of one precision on as they are; convert others to f64, some at a
        // time, which needs little memory.
        match (self.points, self.normals) {
            (Rows::Double(points), Rows::Double(normals)) if normals.len() == points.len() => {
                scene.irradiances(points, normals, out)
            }
            (Rows::Single(points), Rows::Single(normals)) if normals.len() == points.len() => {
                scene.irradiances(points, normals, out)
            }
            _ => {
                for (k, out) in out.chunks_mut(AT_ONCE).enumerate() {
                    let first = k * AT_ONCE;
                    let numbers = || first..first + out.len();
                    let points: Vec<_> = numbers().map(|i| self.points.get(i)).collect();
                    let normals: Vec<_> = numbers().map(|i| self.normal(i).to_array()).collect();
                    let found = scene.irradiances(&points, &normals, out);
                    found.map_err(|e| from(first, e))?;
                }
                Ok(())
            }
        }
    }

    /// Writes to `out` the radiance that each point reflects to its viewer, with one BSDF for all
    /// points or one for each, and one direction for all or one for each.
    pub(crate) fn radiances(
        &self,
        scene: &Scene,
        bsdfs: &[Bsdf],
        outgoing: Rows<'_>,
        out: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        let one = |count: usize, i: usize| if count == 1 { 0 } else { i };
        for (k, out) in out.chunks_mut(AT_ONCE).enumerate() {
            // Convert the arguments of some points, then compute their radiance.
            let first = k * AT_ONCE;
            let numbers = || first..first + out.len();
            let points: Vec<_> = numbers().map(|i| self.points.get(i)).collect();
            let normals: Vec<_> = numbers().map(|i| self.normal(i).to_array()).collect();
            let to_viewer = numbers().map(|i| outgoing.get(one(outgoing.len(), i)));
            let to_viewer: Vec<_> = to_viewer.collect();
            let bsdfs = numbers().map(|i| bsdfs[one(bsdfs.len(), i)].clone());
            let bsdfs: Vec<_> = bsdfs.collect();
            let found = scene.radiances(&points, &normals, &bsdfs, &to_viewer, out);
            found.map_err(|e| from(first, e))?;
        }
        Ok(())
    }

    /// Writes to `out` the fraction of the scene's only light that each point sees.
    pub(crate) fn fractions(
        &self,
        scene: &Scene,
        measure: impl Fn(usize) -> Measure + Sync,
        out: &mut [f64],
    ) -> Result<(), Error> {
        match self.points {
            Rows::Double(points) => scene.visible_fractions(points, 0, measure, out),
            Rows::Single(points) => scene.visible_fractions(points, 0, measure, out),
        }
    }
}

/// The number of points that are converted to double precision at a time.
pub(crate) const AT_ONCE: usize = 1 << 16;

/// Converts an error about a chunk of points, whose first point has the index `first` among all
/// points, to an error with the index among all points.
pub(crate) const fn from(first: usize, error: Error) -> Error {
    match error {
        Error::Point(i) => Error::Point(first + i),
        Error::Normal(i) => Error::Normal(first + i),
        Error::Outgoing(i) => Error::Outgoing(first + i),
        other => other,
    }
}
