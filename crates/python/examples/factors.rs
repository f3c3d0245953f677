//! A program that computes view factors by the Rust library, for `tests/test_same_bits.py`.
//! `factors FOLDER` reads vertices, points and directions from files, and writes the values that
//! Python has to compute, too.

mod common;

use common::{Folder, soup};
use linelit::viewfactors::{Facets, Memory, Sides};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Folder::of_arguments()?;
    let read = |name| folder.vectors(name);
    let write = |name, numbers: &[f64]| folder.write(name, numbers);
    let (vertices, points, directions) = (read("vertices")?, read("points")?, read("directions")?);
    let triangles = soup(vertices.len())?;
    let facets = Facets::new(&vertices, &triangles, Sides::One)?;
    let matrix = facets.matrix(1e-2);
    write("factors", &[matrix.data, matrix.error, matrix.sky].concat())?;
    let columns = matrix.indices.iter().map(|&i| f64::from(i));
    let ends = matrix.indptr.iter().map(|&end| end as f64);
    write("columns", &columns.chain(ends).collect::<Vec<_>>())?;
    let memory = &mut Memory::default();
    let (mut seen, mut sky, mut sunlit) = (Vec::new(), Vec::new(), Vec::new());
    for (point, direction) in points.into_iter().zip(directions) {
        let row = facets.from_point(point, direction, memory);
        seen.extend(row.facets);
        sky.push(row.sky);
        sunlit.extend((0..facets.len()).map(|i| facets.sunlit(i, direction, memory)));
    }
    write("facets", &seen)?;
    write("sky", &sky)?;
    write("sunlit", &sunlit)
}
