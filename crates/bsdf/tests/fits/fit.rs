//! Fits linearly transformed cosines to microfacets, and says how far they are from them.
//!
//! `cargo xtask fit-ltc`: fits afresh and compares with the tables that are compiled in, then
//! measures these as `docs/accuracy-ltc.md` says, and fails where either differs. `fit-ltc tables`
//! writes the tables below `crates/bsdf/src/fits`, `fit-ltc page`, compiled with them, that page.
//!
//! What is minimised, and over which maps, says `crates/bsdf/src/facet_cosine.rs`. The search is
//! the downhill simplex, from the results of the neighbours.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    clippy::disallowed_types,
    clippy::cast_possible_truncation,
    reason = "printing is what the program is for, and tables are kept in single precision"
)]

use crate::fit_errors::{FITTED, Model, alone, nodes, rows, view};
use linelit_bsdf::microfacet::schlick;
use linelit_bsdf::{Reflection, minimise};
use linelit_geometry::DVec3;
use linelit_testkit::program::arguments;
use std::fs;
use std::path::{Path, PathBuf};

const SIZE: usize = 64;
/// The ends of the axis of √α.
const ROOTS: [f64; 2] = [0.01, 1.3];
/// The view whose skew is used for the view from above, where the map has none.
const NEARLY_ABOVE: f64 = 0.99;
const FOLDER: &str = "crates/bsdf/src/fits";
const PAGE: &str = "docs/accuracy-ltc.md";
const HEAD: &str = include_str!("../accuracy-ltc-head.md");

/// A reflection seen from one direction: g = f cos/albedo at nodes, with the measure of each.
struct Target {
    alpha: f64,
    cosine: f64,
    nodes: Vec<(DVec3, f64)>,
    albedo: f64,
    /// The cosine at which Schlick's rise is its mean.
    effective: f64,
}

impl Target {
    fn new(model: Model, alpha: f64, cosine: f64) -> Self {
        let (lobe, facets) = model.1(alpha);
        let (bsdf, wo) = (alone(lobe), view(cosine, 0.0));
        // The two sides of the plane of incidence are the same.
        let mut lit: Vec<_> = nodes(facets, wo, 56)
            .filter(|(w, _)| w.y >= 0.0)
            .map(|(w, measure)| (w, 2.0 * bsdf.eval(w, wo, DVec3::Z).y * w.z * measure))
            .collect();
        let albedo: f64 = lit.iter().map(|(_, share)| share).sum();
        assert!(albedo > 0.0, "{}: alpha {alpha}, cosine {cosine}", model.0);
        let rise = |(w, share): &(DVec3, f64)| share * schlick((*w + wo).normalize().dot(*w));
        let mean = lit.iter().map(rise).sum::<f64>() / albedo;
        for (_, share) in &mut lit {
            *share /= albedo;
        }
        Self {
            alpha,
            cosine,
            nodes: lit,
            albedo,
            effective: 1.0 - mean.powf(0.2),
        }
    }

    /// −∫ g ln p dω for a cell (ln p, ln q, r): the divergence but for a constant.
    fn divergence(&self, [p, q, r]: [f64; 3]) -> f64 {
        let near = self.cosine + self.alpha;
        let a = self.alpha * p.exp() / (near * near);
        let b = self.alpha * q.exp();
        let skew = r * (1.0 - self.cosine * self.cosine).sqrt() / near;
        let at = |(w, share): &(DVec3, f64)| {
            let (x, y) = ((w.x + skew * w.z) / a, w.y / b);
            share * ((x * x + y * y + w.z * w.z).powi(2) / w.z).ln()
        };
        (a * b).ln() + self.nodes.iter().map(at).sum::<f64>()
    }

    /// The best cell near the best of some starts.
    fn fit(&self, starts: &[[f64; 3]]) -> [f64; 3] {
        let f = |p: [f64; 3]| self.divergence(p);
        let best = starts
            .iter()
            .copied()
            .min_by(|a, b| f(*a).total_cmp(&f(*b)));
        minimise(minimise(best.expect("a start"), f), f)
    }
}

/// α and the cosine of a cell.
fn axes(i: usize, j: usize) -> (f64, f64) {
    let step = |i: usize| i as f64 / (SIZE - 1) as f64;
    let root = ROOTS[0] + (ROOTS[1] - ROOTS[0]) * step(i);
    let alpha = root * root;
    // The inverse of y = c (1 + α)/(c + α).
    let cosine = step(j) * alpha / (1.0 + alpha - step(j));
    (alpha, cosine.min(1.0))
}

/// The fits to a model, by their files' names: maps and albedos.
fn fits(model: Model) -> [Vec<f32>; 2] {
    let narrow = [2.0f64.ln(), 2.0f64.ln(), 1.0];
    let mut cells = vec![[narrow; SIZE]; SIZE];
    let [mut maps, mut albedos] = [3, 2].map(|n| Vec::with_capacity(n * SIZE * SIZE));
    for i in 0..SIZE {
        let mut views = [[0.0; 2]; SIZE];
        for j in (0..SIZE).rev() {
            let (alpha, cosine) = axes(i, j);
            let next = cells[i][(j + 1).min(SIZE - 1)];
            let starts = [next, cells[i.saturating_sub(1)][j]];
            let target = Target::new(model, alpha, cosine);
            let mut cell = target.fit(&starts);
            if j == SIZE - 1 {
                cell[2] = Target::new(model, alpha, NEARLY_ABOVE).fit(&starts)[2];
            }
            cells[i][j] = cell;
            views[j] = [target.albedo, target.effective - cosine];
        }
        for (cell, view) in cells[i].iter().zip(views) {
            maps.extend([cell[0].exp(), cell[1].exp(), cell[2]].map(|x| x as f32));
            albedos.extend(view.map(|x| x as f32));
        }
        eprintln!("{} {} of {SIZE}", model.0, i + 1);
    }
    [maps, albedos]
}

/// The files with their names.
fn files() -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(FOLDER);
    let names = ["masked", "unmasked"];
    let mut files = Vec::new();
    for (name, model) in names.into_iter().zip(FITTED) {
        for (kind, numbers) in ["maps", "albedos"].iter().zip(fits(model)) {
            let bytes = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
            files.push((folder.join(format!("{name}.{kind}")), bytes));
        }
    }
    files
}

/// The greatest difference of numbers, to the greater of them or one.
fn apart(a: &[u8], b: &[u8]) -> f32 {
    let numbers = |bytes: &[u8]| bytes.as_chunks::<4>().0.to_vec();
    let pairs = numbers(a).into_iter().zip(numbers(b));
    let gaps = pairs.map(|(a, b)| {
        let (a, b) = (f32::from_le_bytes(a), f32::from_le_bytes(b));
        (a - b).abs() / a.abs().max(b.abs()).max(1.0)
    });
    gaps.fold(0.0, f32::max)
}

fn page() -> String {
    let mut page = format!(
        "{HEAD}\n\
         | reflection | α | cosine of the view | views | mean | worst | albedo, worst |\n\
         |---|---|---|---:|---:|---:|---:|\n"
    );
    for row in rows(200) {
        page += &row.text();
        page.push('\n');
    }
    page
}

#[test]
#[ignore = "long: fits all tables afresh"]
fn fit() {
    let arguments = arguments(&[]);
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(PAGE);
    match arguments.first().map(String::as_str) {
        Some("tables") => {
            for (name, bytes) in files() {
                fs::write(name, bytes).expect("a table");
            }
        }
        Some("page") => fs::write(path, page()).expect("the page"),
        None => {
            let mut good = fs::read_to_string(path).expect("the page") == page();
            println!("{PAGE}: {}", if good { "the same" } else { "differs" });
            for (name, bytes) in files() {
                let gap = apart(&fs::read(&name).expect("a table"), &bytes);
                println!("{}: differs by {gap:.1e} at most", name.display());
                good &= gap < 1e-3;
            }
            assert!(good);
        }
        Some(other) => panic!("{other}: tables, page or nothing"),
    }
}
