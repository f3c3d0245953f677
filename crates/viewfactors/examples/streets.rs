//! Measures how many pairs of a street canyon or a city each step settles, and what rows cost.
//!
//! ```text
//! cargo run --release -p linelit-viewfactors --example streets -- canyon 1000 1e-4
//! cargo run --release -p linelit-viewfactors --example streets -- city 22000 1e-3 30
//! ```
//!
//! The last number is an angle in degrees by which everything is rotated.

#![allow(clippy::print_stdout, reason = "a program")]

use linelit_viewfactors::{FacetError, Facets, Sides, SparseRow};
use std::convert::Infallible;
use std::time::Instant;

#[derive(Default)]
struct Mesh {
    vertices: Vec<[f64; 3]>,
    facets: Vec<[u32; 4]>,
}

impl Mesh {
    /// Adds a parallelogram of n × m facets.
    fn wall(&mut self, corner: [f64; 3], u: [f64; 3], v: [f64; 3], [n, m]: [u32; 2]) {
        for i in 0..n {
            for j in 0..m {
                let first = u32::try_from(self.vertices.len()).expect("few vertices");
                for [a, b] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
                    let s = f64::from(i + a) / f64::from(n);
                    let t = f64::from(j + b) / f64::from(m);
                    let vertex = [0, 1, 2].map(|k| corner[k] + s * u[k] + t * v[k]);
                    self.vertices.push(vertex);
                }
                self.facets.push([first, first + 1, first + 2, first + 3]);
            }
        }
    }

    /// Adds a house of five sides with n × n facets each.
    fn house(&mut self, [x, y]: [f64; 2], [w, d, h]: [f64; 3], n: u32) {
        let up = [0.0, 0.0, h];
        self.wall([x, y, 0.0], [w, 0.0, 0.0], up, [n, n]);
        self.wall([x + w, y, 0.0], [0.0, d, 0.0], up, [n, n]);
        self.wall([x + w, y + d, 0.0], [-w, 0.0, 0.0], up, [n, n]);
        self.wall([x, y + d, 0.0], [0.0, -d, 0.0], up, [n, n]);
        self.wall([x, y, h], [w, 0.0, 0.0], [0.0, d, 0.0], [n, n]);
    }

    /// Two rows of houses of different heights along a street, which is paved.
    fn canyon(facets: f64) -> Self {
        let mut mesh = Self::default();
        let houses = whole(facets * 0.8 / 40.0);
        for k in 0..houses {
            let (y, height) = (12.0 * f64::from(k), 8.0 + f64::from(k % 4) * 3.0);
            mesh.house([-18.0, y], [10.0, 10.0, height], 2);
            mesh.house([8.0, y + 3.0], [10.0, 10.0, 20.0 - height], 2);
        }
        let length = 12.0 * f64::from(houses);
        let (across, along) = ([16.0, 0.0, 0.0], [0.0, length, 0.0]);
        mesh.wall([-8.0, 0.0, 0.0], across, along, [4, 2 * houses]);
        mesh
    }

    /// Blocks of 20 m with a house of 80 facets each, and pavement around it.
    fn city(facets: f64) -> Self {
        let mut mesh = Self::default();
        let side = whole((facets / 88.0).sqrt());
        for i in 0..side {
            for j in 0..side {
                let (x, y) = (20.0 * f64::from(i), 20.0 * f64::from(j));
                let height = 9.0 + f64::from((7 * i + 11 * j + i * j) % 5) * 0.75;
                mesh.house([x + 4.0, y + 4.0], [12.0, 12.0, height], 4);
                let cuts = [0.0, 4.0, 16.0, 20.0];
                for k in [0, 1, 2, 3, 5, 6, 7, 8] {
                    let [a, b] = [k % 3, k / 3];
                    let size = |c: usize| cuts[c + 1] - cuts[c];
                    let corner = [x + cuts[a], y + cuts[b], 0.0];
                    mesh.wall(corner, [size(a), 0.0, 0.0], [0.0, size(b), 0.0], [1, 1]);
                }
            }
        }
        mesh
    }

    fn turned(mut self, degrees: f64) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        for [x, y, _] in &mut self.vertices {
            (*x, *y) = (cos * *x - sin * *y, sin * *x + cos * *y);
        }
        self
    }
}

/// The whole number next to a small one.
fn whole(x: f64) -> u32 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "few"
    )]
    let whole = x.round() as u32;
    whole
}

fn main() -> Result<(), FacetError> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, default: f64| {
        let word = words.get(k).and_then(|word| word.parse::<f64>().ok());
        word.unwrap_or(default)
    };
    let (count, tolerance) = (number(1, 1000.0), number(2, 1e-4));
    let mesh = match words.first().map(String::as_str) {
        Some("city") => Mesh::city(count),
        _ => Mesh::canyon(count),
    };
    let mesh = mesh.turned(number(3, 0.0));
    let begin = Instant::now();
    let facets = Facets::new(&mesh.vertices, &mesh.facets, Sides::One)?;
    println!("{} facets in {:?}", facets.len(), begin.elapsed());
    let begin = Instant::now();
    let plan = facets.plan();
    let time = begin.elapsed();
    println!(
        "pairs by facing, hidden, clear, partly: {:?}, looked at in {time:?}",
        plan.pairs
    );
    let (mut worst, mut most, mut least, mut factors) = (0.0_f64, 0.0_f64, 1.0_f64, 0);
    let told = |row: SparseRow| -> Result<(), Infallible> {
        worst = worst.max(row.errors.iter().sum());
        most = most.max(row.values.iter().sum());
        least = least.min(row.sky);
        factors += row.values.len();
        Ok(())
    };
    let begin = Instant::now();
    match facets.rows_of(0..facets.len(), tolerance, &plan, told) {
        Ok(()) => {}
        Err(never) => match never {},
    }
    println!(
        "{factors} factors in {:?}; errors of a row up to {worst:.2e}",
        begin.elapsed()
    );
    println!("sums up to {most}, the least sky {least}");
    Ok(())
}
