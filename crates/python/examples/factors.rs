//! View factors of triangles of a file by the Rust library, for `tests/test_same_bits.py`:
//! `factors FOLDER` reads vertices, points and directions, and writes what Python is to answer.

use linelit::viewfactors::{Facets, Memory, Sides};
use std::error::Error;
use std::fs;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("no folder")?;
    let folder = Path::new(&folder);
    let read = |name: &str| -> Result<Vec<[f64; 3]>, Box<dyn Error>> {
        let bytes = fs::read(folder.join(name))?;
        let numbers = bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b));
        let numbers: Vec<f64> = numbers.collect();
        Ok(numbers.as_chunks().0.to_vec())
    };
    let write = |name: &str, numbers: &[f64]| {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        fs::write(folder.join(name), bytes)
    };
    let (vertices, points, directions) = (read("vertices")?, read("points")?, read("directions")?);
    let count = u32::try_from(vertices.len() / 3)?;
    let triangles: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
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
    Ok(write("sunlit", &sunlit)?)
}
