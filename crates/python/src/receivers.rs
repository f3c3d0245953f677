//! Points with normals, and what is asked of many of them.

use crate::arrays::{Rows, Vectors, shape_text};
use crate::errors::{NAMED, of_query, value_error};
use crate::threads::{in_batches, of_points};
use linelit::geometry::DVec3;
use linelit::{Error, Measure, Scene};
use pyo3::prelude::*;
use std::ops::Range;

/// The arguments of most queries: points, and a normal for each.
pub(crate) struct Receivers<'a> {
    pub(crate) points: Rows<'a>,
    normals: Rows<'a>,
}

impl<'a> Receivers<'a> {
    /// Points with a normal for each, or one for all.
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

    pub(crate) fn normal(&self, i: usize) -> DVec3 {
        let only = self.normals.len() == 1;
        self.normals.get(if only { 0 } else { i }).into()
    }

    pub(crate) fn get(&self, i: usize) -> [[f64; 3]; 2] {
        [self.points.get(i), self.normal(i).to_array()]
    }

    /// Does work for all points in batches; an error names the point.
    pub(crate) fn in_batches(
        &self,
        py: Python<'_>,
        threads: Option<usize>,
        work: impl FnMut(Range<usize>) -> Result<(), Error> + Send,
    ) -> PyResult<()> {
        let error = |e, first| of_query(e, first, NAMED, |i| self.get(i));
        let batches = of_points(self.points.len(), threads);
        in_batches(py, &batches, work, error, |_| Ok(()))
    }

    pub(crate) fn irradiances(
        &self,
        scene: &Scene,
        range: Range<usize>,
        out: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        // Vectors of one type go as they are; else both become f64.
        match (self.points, self.normals) {
            (Rows::Double(points), Rows::Double(normals)) if normals.len() == points.len() => {
                scene.irradiances(&points[range.clone()], &normals[range], out)
            }
            (Rows::Single(points), Rows::Single(normals)) if normals.len() == points.len() => {
                scene.irradiances(&points[range.clone()], &normals[range], out)
            }
            _ => {
                let points: Vec<_> = range.clone().map(|i| self.points.get(i)).collect();
                let normals: Vec<_> = range.map(|i| self.normal(i).to_array()).collect();
                scene.irradiances(&points, &normals, out)
            }
        }
    }

    pub(crate) fn fractions(
        &self,
        scene: &Scene,
        range: Range<usize>,
        measure: impl Fn(usize) -> Measure + Sync,
        out: &mut [f64],
    ) -> Result<(), Error> {
        match self.points {
            Rows::Double(points) => scene.visible_fractions(&points[range], 0, measure, out),
            Rows::Single(points) => scene.visible_fractions(&points[range], 0, measure, out),
        }
    }
}
