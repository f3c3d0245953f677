//! A street canyon of some facets: how many pairs each step settles, and what rows cost.
//!
//! ```text
//! cargo run --release -p linelit-viewfactors --example canyon -- 1000 1e-4
//! ```

#![allow(clippy::print_stdout, reason = "a program")]

use linelit_viewfactors::{Facets, Sides, SparseRow};
use std::convert::Infallible;
use std::time::Instant;

type Mesh = (Vec<[f64; 3]>, Vec<[u32; 4]>);

/// Adds a parallelogram of n × m facets.
fn wall(mesh: &mut Mesh, corner: [f64; 3], u: [f64; 3], v: [f64; 3], [n, m]: [u32; 2]) {
    for i in 0..n {
        for j in 0..m {
            let first = u32::try_from(mesh.0.len()).expect("few vertices");
            for [a, b] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
                let (s, t) = (
                    f64::from(i + a) / f64::from(n),
                    f64::from(j + b) / f64::from(m),
                );
                mesh.0
                    .push([0, 1, 2].map(|k| corner[k] + s * u[k] + t * v[k]));
            }
            mesh.1.push([first, first + 1, first + 2, first + 3]);
        }
    }
}

/// A block of houses: four walls and a roof.
fn house(mesh: &mut Mesh, [x, y]: [f64; 2], [w, d, h]: [f64; 3], n: u32) {
    let up = [0.0, 0.0, h];
    wall(mesh, [x, y, 0.0], [w, 0.0, 0.0], up, [n, n]);
    wall(mesh, [x + w, y, 0.0], [0.0, d, 0.0], up, [n, n]);
    wall(mesh, [x + w, y + d, 0.0], [-w, 0.0, 0.0], up, [n, n]);
    wall(mesh, [x, y + d, 0.0], [0.0, -d, 0.0], up, [n, n]);
    wall(mesh, [x, y, h], [w, 0.0, 0.0], [0.0, d, 0.0], [n, n]);
}

fn main() {
    let mut numbers = std::env::args()
        .skip(1)
        .map(|word| word.parse::<f64>().ok());
    let facets = numbers.next().flatten().unwrap_or(1000.0);
    let tolerance = numbers.next().flatten().unwrap_or(1e-4);
    // Two rows of houses of different heights along a street of 100 m, which is paved.
    let mut mesh = (Vec::new(), Vec::new());
    let n = 2;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "few"
    )]
    let houses = (facets * 0.8 / 40.0).round() as u32;
    for k in 0..houses {
        let (y, height) = (12.0 * f64::from(k), 8.0 + f64::from(k % 4) * 3.0);
        house(&mut mesh, [-18.0, y], [10.0, 10.0, height], n);
        house(&mut mesh, [8.0, y + 3.0], [10.0, 10.0, 20.0 - height], n);
    }
    let length = 12.0 * f64::from(houses);
    wall(
        &mut mesh,
        [-8.0, 0.0, 0.0],
        [16.0, 0.0, 0.0],
        [0.0, length, 0.0],
        [4, 2 * houses],
    );
    let facets = match Facets::new(&mesh.0, &mesh.1, Sides::One) {
        Ok(facets) => facets,
        Err(problem) => return println!("{problem}"),
    };
    let begin = Instant::now();
    let plan = facets.plan();
    println!(
        "{} facets; pairs by facing, hidden, clear, partly: {:?}",
        facets.len(),
        plan.pairs
    );
    println!("looked at all pairs in {:?}", begin.elapsed());
    let (mut worst, mut most, mut count) = (0.0_f64, 0.0_f64, 0);
    let told = |row: SparseRow| -> Result<(), Infallible> {
        worst = worst.max(row.errors.iter().sum());
        most = most.max(row.values.iter().sum());
        count += row.values.len();
        Ok(())
    };
    let begin = Instant::now();
    if facets.rows(tolerance, told).is_ok() {
        let time = begin.elapsed();
        println!("{count} factors in {time:?}; errors of a row up to {worst:e}, sums up to {most}");
    }
}
