//! Fits linearly transformed cosines to isotropic GGX and writes the table of
//! `linelit_bsdf`.
//!
//! `fit-ltc`: fits afresh, compares with the table that is compiled in, and checks that by another
//! quadrature against GGX; exit 1 where they differ or where the table is worse than it says.
//! `fit-ltc --verify`: the check alone. `fit-ltc FILE` writes what it fits (the table is
//! `crates/bsdf/src/ggx_table.rs`).
//!
//! The fit minimises ∫|f cos/albedo − lobe|³ dω by the downhill simplex over the three parameters
//! of the lobe in the frame of its mean direction (Heitz et al. 2016), from its rougher neighbour's
//! result, with samples drawn from both lobes.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "printing is what the program is for"
)]

use linelit_bsdf::microfacet::{TrowbridgeReitz, schlick};
use linelit_bsdf::{Fresnel, Reflector};
use linelit_geometry::{DMat3, DVec3};
use linelit_shading::ltc::Ltc;
use linelit_testkit::quadrature::gauss_legendre;
use std::fmt::Write;

/// The smallest roughness of the table.
const MIN_ROUGHNESS: f64 = 0.1;
/// The worst error of a cell.
const FIT_ERROR: f64 = 0.817;
const SIZE: usize = 16;
const GRID: u32 = 28;

/// What is fitted: GGX without Fresnel reflectance, or its part weighted with (1 − cos)⁵.
#[derive(Clone, Copy, PartialEq)]
struct Target {
    ggx: Reflector,
    wo: DVec3,
    /// The weights of 1 and of (1 − cos)⁵.
    fresnel: [f64; 2],
}

impl Target {
    /// f cos.
    fn value(&self, wi: DVec3) -> f64 {
        if wi.z <= 0.0 {
            return 0.0;
        }
        let rise = schlick((wi + self.wo).normalize().dot(wi));
        self.ggx.value(wi, self.wo).x * wi.z * (self.fresnel[0] + self.fresnel[1] * rise)
    }

    /// A direction drawn by the visible normals, and its density.
    fn sample(&self, u: [f64; 2]) -> Option<(DVec3, f64)> {
        let wi = self.ggx.facets.sample(self.wo, u)?;
        let pdf = self.ggx.facets.pdf(wi, self.wo);
        (pdf > 0.0).then_some((wi, pdf))
    }

    /// Albedo, mean direction, and the spreads about it in the plane of incidence and across.
    fn moments(&self) -> (f64, DVec3, [f64; 2]) {
        let (mut sum, mut mean) = (0.0, DVec3::ZERO);
        let (mut xx, mut xz, mut zz, mut yy) = (0.0, 0.0, 0.0, 0.0);
        let n = 256;
        for i in 0..n {
            for j in 0..n {
                let u = [
                    (f64::from(i) + 0.5) / f64::from(n),
                    (f64::from(j) + 0.5) / f64::from(n),
                ];
                if let Some((wi, pdf)) = self.sample(u) {
                    let weight = self.value(wi) / pdf;
                    sum += weight;
                    mean += wi * weight;
                    xx += wi.x * wi.x * weight;
                    xz += wi.x * wi.z * weight;
                    zz += wi.z * wi.z * weight;
                    yy += wi.y * wi.y * weight;
                }
            }
        }
        mean.y = 0.0;
        let mean = mean.normalize_or(DVec3::Z);
        let (c, s) = (mean.z, -mean.x);
        let along = c * c * xx + 2.0 * c * s * xz + s * s * zz;
        let spread = [along, yy].map(|v| (v / sum).max(0.0).sqrt());
        (sum / f64::from(n * n), mean, spread)
    }
}

/// GGX without Fresnel reflectance.
fn reflector(roughness: f64) -> Reflector {
    Reflector {
        reflectance: DVec3::ONE,
        facets: TrowbridgeReitz::isotropic(roughness * roughness),
        fresnel: Fresnel::Full,
    }
}

/// The map of three parameters about a mean direction.
fn map(p: [f64; 3], mean: DVec3) -> DMat3 {
    let x = DVec3::new(mean.z, 0.0, -mean.x);
    let (a, b) = (p[0].abs().max(1e-5), p[1].abs().max(1e-5));
    DMat3::from_cols(x, DVec3::Y, mean)
        * DMat3::from_cols(DVec3::X * a, DVec3::Y * b, DVec3::new(p[2], 0.0, 1.0))
}

/// ∫|f cos/albedo − lobe|^power dω by samples of both.
fn distance(target: &Target, albedos: [f64; 2], maps: [DMat3; 2], power: i32) -> f64 {
    let albedo = albedos[0] + albedos[1];
    let share = albedos.map(|a| a / albedo);
    let lobes = maps.map(|m| Ltc::new(m, 1.0));
    let mut sum = 0.0;
    let mut add = |w: DVec3| {
        let l = share[0] * lobes[0].density(w) + share[1] * lobes[1].density(w);
        let f = target.value(w) / albedo;
        let pdf = target.ggx.facets.pdf(w, target.wo) + l;
        if pdf > 0.0 {
            sum += (f - l).abs().powi(power) / pdf;
        }
    };
    for i in 0..GRID {
        for j in 0..GRID {
            let u = [
                (f64::from(i) + 0.5) / f64::from(GRID),
                (f64::from(j) + 0.5) / f64::from(GRID),
            ];
            if let Some((wi, _)) = target.sample(u) {
                add(wi);
            }
            let phi = 2.0 * std::f64::consts::PI * u[1];
            // From the lobe that this sample's turn belongs to: the first for i below its share.
            let first = (f64::from(i) + 0.5) / f64::from(GRID) < share[0];
            let (m, r) = if first {
                (maps[0], (u[0] / share[0]).sqrt())
            } else {
                (maps[1], ((u[0] - share[0]) / share[1]).max(0.0).sqrt())
            };
            let r = if r > 1.0 { 1.0 } else { r };
            add((m * DVec3::new(r * phi.cos(), r * phi.sin(), (1.0 - r * r).sqrt())).normalize());
        }
    }
    sum / f64::from(GRID * GRID)
}

/// The downhill simplex of Nelder and Mead in three dimensions.
fn minimise(start: [f64; 3], f: impl Fn([f64; 3]) -> f64) -> [f64; 3] {
    let mut simplex: Vec<([f64; 3], f64)> = (0..4)
        .map(|i| {
            let mut p = start;
            if i > 0 {
                p[i - 1] += if i < 3 { 0.1 * p[i - 1] } else { 0.05 };
            }
            (p, f(p))
        })
        .collect();
    for _ in 0..90 {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        if (simplex[3].1 - simplex[0].1).abs() < 1e-6 * simplex[0].1.abs() {
            break;
        }
        let centre: [f64; 3] =
            std::array::from_fn(|j| simplex[..3].iter().map(|s| s.0[j]).sum::<f64>() / 3.0);
        let worst = simplex[3];
        let along = |t: f64| -> ([f64; 3], f64) {
            let p = std::array::from_fn(|j| centre[j] + t * (worst.0[j] - centre[j]));
            (p, f(p))
        };
        let reflected = along(-1.0);
        if reflected.1 < simplex[0].1 {
            let expanded = along(-2.0);
            simplex[3] = if expanded.1 < reflected.1 {
                expanded
            } else {
                reflected
            };
        } else if reflected.1 < simplex[2].1 {
            simplex[3] = reflected;
        } else {
            let contracted = along(0.5);
            if contracted.1 < worst.1 {
                simplex[3] = contracted;
            } else {
                let best = simplex[0].0;
                for s in &mut simplex[1..] {
                    s.0 = std::array::from_fn(|j| 0.5 * (s.0[j] + best[j]));
                    s.1 = f(s.0);
                }
            }
        }
    }
    simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
    simplex[0].0
}

/// From each start by the cubes of the differences, whose landscape is smooth, and on from there by
/// the differences themselves, which are what is published; the best of all.
fn best_fit(target: &Target, albedo: f64, mean: DVec3, starts: [[f64; 3]; 2]) -> [f64; 3] {
    let error = |p: [f64; 3], power: i32| distance(target, [albedo, 0.0], [map(p, mean); 2], power);
    let mut best = (starts[0], f64::INFINITY);
    for start in starts {
        let mut p = start;
        for power in [3, 1, 1] {
            p = minimise(p, |p| error(p, power));
            let e = error(p, 1);
            if e < best.1 {
                best = (p, e);
            }
        }
    }
    best.0
}

/// Grazing parts that reflect less than this keep the shape of the other part.
const NEGLIGIBLE: f64 = 0.002;

/// As a single-precision number, in its shortest form.
fn number(x: f64) -> String {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "the table is single precision"
    )]
    let x = ((x * 1e6).round() / 1e6) as f32;
    format!("{x:?}")
}

/// A cell: albedos, matrix entries, and the L1 errors for F0 = 0.04 and 1.
struct Cell {
    row: [f64; 10],
    error: [f64; 2],
}

fn fit(roughness: f64, cosine: f64, start: &mut [[f64; 3]; 2]) -> Cell {
    let ggx = reflector(roughness);
    let wo = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let mut cell = Cell {
        row: [0.0; 10],
        error: [0.0; 2],
    };
    for (which, start) in start.iter_mut().enumerate() {
        let fresnel = if which == 0 { [1.0, 0.0] } else { [0.0, 1.0] };
        let target = Target { ggx, wo, fresnel };
        let (albedo, mean, spread) = target.moments();
        cell.row[which] = albedo;
        if which == 1 && albedo < NEGLIGIBLE {
            // Nothing to see: the shape of the other part does.
            cell.row.copy_within(2..6, 6);
            continue;
        }
        let p = best_fit(&target, albedo, mean, [*start, [spread[0], spread[1], 0.0]]);
        *start = p;
        let m = map(p, mean);
        let m = m * (1.0 / m.z_axis.z);
        let entries = [m.x_axis.x, m.x_axis.z, m.y_axis.y, m.z_axis.x];
        cell.row[2 + 4 * which..6 + 4 * which].copy_from_slice(&entries);
    }
    // What a user gets: a dielectric and a mirror, as the sum of the two lobes.
    for (error, f0) in cell.error.iter_mut().zip([0.04, 1.0]) {
        let albedos = [f0 * cell.row[0], (1.0 - f0) * cell.row[1]];
        let lobes: [DMat3; 2] = std::array::from_fn(|i| {
            let e = &cell.row[2 + 4 * i..6 + 4 * i];
            DMat3::from_cols(
                DVec3::new(e[0], 0.0, e[1]),
                DVec3::Y * e[2],
                DVec3::new(e[3], 0.0, 1.0),
            )
        });
        let target = Target {
            ggx,
            wo,
            fresnel: [f0, 1.0 - f0],
        };
        *error = distance(&target, albedos, lobes, 1);
    }
    cell
}

fn axes(i: usize, j: usize) -> (f64, f64) {
    let step = |i: usize| {
        f64::from(u32::try_from(i).expect("small"))
            / f64::from(u32::try_from(SIZE - 1).expect("small"))
    };
    let roughness = MIN_ROUGHNESS + (1.0 - MIN_ROUGHNESS) * step(i);
    // The last column would be the horizon itself.
    let s = step(j).min(0.9975);
    (roughness, 1.0 - s * s)
}

/// ∫|f cos/albedo − lobe| dω by Gauss nodes in the half-vector's polar angles: another way than the
/// fit's samples, for the table as it is used, interpolated.
fn independent(roughness: f64, cosine: f64, f0: f64) -> f64 {
    let alpha = roughness * roughness;
    let ggx = reflector(roughness);
    let wo = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let target = Target {
        ggx,
        wo,
        fresnel: [f0, 1.0 - f0],
    };
    let lobe = ggx.facets.transformed_cosine(wo, &Fresnel::Full);
    let lobe = Ltc::new(lobe.map, 1.0);
    // Directions about the mirror direction, by the tangent of the half-vector's tilt over α.
    let (rule, turns) = (gauss_legendre(96), 192);
    let (mut sum, mut albedo) = (0.0, 0.0);
    let mut cells = Vec::new();
    for (node, weight) in rule.nodes.iter().zip(&rule.weights) {
        let u = 0.5 * (node + 1.0);
        // tan² = α² u/(1 − u): uniform in u is the distribution's own measure.
        let tan2 = alpha * alpha * u / (1.0 - u);
        let cos = 1.0 / (1.0 + tan2).sqrt();
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        // d(cos²)/du, and dω_h = sin dθ dφ = −d cos dφ.
        let slope = alpha * alpha / ((1.0 - u) * (1.0 - u)) * cos.powi(3) * 0.5;
        for turn in 0..turns {
            let phi = 2.0 * std::f64::consts::PI * (f64::from(turn) + 0.5) / f64::from(turns);
            let h = DVec3::new(sin * phi.cos(), sin * phi.sin(), cos);
            let d = wo.dot(h);
            let wi = h * (2.0 * d) - wo;
            if d <= 0.0 || wi.z <= 0.0 {
                continue;
            }
            let measure =
                0.5 * weight * slope * (2.0 * std::f64::consts::PI / f64::from(turns)) * 4.0 * d;
            let f = target.value(wi);
            albedo += f * measure;
            cells.push((wi, f, measure));
        }
    }
    let mut seen = 0.0;
    for (wi, f, measure) in cells {
        let l = lobe.density(wi);
        sum += (f / albedo - l).abs() * measure;
        seen += l * measure;
    }
    // What of the lobe is below the horizon or beyond the nodes counts as wholly wrong.
    sum + (1.0 - seen).max(0.0)
}

/// The table that is compiled in, cell by cell and between the cells, against its published error.
fn verify() -> bool {
    println!("  L1 error of the table in use, dielectric (F0 = 0.04) and mirror (F0 = 1)\n");
    println!("  roughness   cos 0.97    0.75    0.44    0.11");
    let mut worst = 0.0f64;
    for i in 0..8 {
        let roughness = MIN_ROUGHNESS + (1.0 - MIN_ROUGHNESS) * (f64::from(i) + 0.5) / 8.0;
        let mut line = format!("  {roughness:9.3}");
        for cosine in [0.97, 0.75, 0.44, 0.11] {
            let [a, b] = [0.04, 1.0].map(|f0| independent(roughness, cosine, f0));
            worst = worst.max(a).max(b);
            write!(line, "  {a:.2}/{b:.2}").expect("a String takes any text");
        }
        println!("{line}");
    }
    println!("\n  worst here {worst:.3}, published worst over the cells {FIT_ERROR:.3}");
    worst <= FIT_ERROR
}

/// The table's text, its worst and its median error.
fn fresh() -> (String, f64, f64) {
    let mut rows = vec![[0.0; 10]; SIZE * SIZE];
    let mut errors = Vec::new();
    for j in 0..SIZE {
        let mut start = [[1.0, 1.0, 0.0]; 2];
        for i in (0..SIZE).rev() {
            let (roughness, cosine) = axes(i, j);
            let cell = fit(roughness, cosine, &mut start);
            rows[i * SIZE + j] = cell.row;
            if cell.error.iter().any(|e| *e > 0.4) {
                eprintln!(
                    "roughness {roughness:.2} cosine {cosine:.3}: {:.2} {:.2}",
                    cell.error[0], cell.error[1]
                );
            }
            errors.extend(cell.error);
        }
        eprintln!("column {} of {SIZE}", j + 1);
    }
    errors.sort_by(f64::total_cmp);
    let (worst, median) = (errors[errors.len() - 1], errors[errors.len() / 2]);
    let mut text = format!(
        "//! Generated by the example `fit-ltc`. Do not edit.\n\n\
         /// Entries along each axis: roughness, and √(1 − cosine) of the view.\n\
         pub(crate) const SIZE: usize = {SIZE};\n\n\
         /// By roughness, then inclination: the albedos without Fresnel reflectance and of its\n\
         /// grazing part, then m00, m20, m11, m02 of each lobe's map, with m22 = 1.\n\
         #[rustfmt::skip]\n\
         pub(crate) static TABLE: [[f32; 10]; {}] = [\n",
        SIZE * SIZE
    );
    for row in rows {
        let cells: Vec<String> = row.iter().map(|x| number(*x)).collect();
        writeln!(text, "    [{}],", cells.join(", ")).expect("a String takes any text");
    }
    text += "];\n";
    (text, worst, median)
}

/// The entries of a table's text.
fn entries(text: &str) -> Vec<f64> {
    let rows = text.lines().filter(|l| l.starts_with("    ["));
    rows.flat_map(|l| l.split([' ', '[', ']', ',']))
        .filter_map(|word| word.parse().ok())
        .collect()
}

/// Whether a fresh fit is the table that is compiled in, but for the last digit of its entries,
/// which the library's functions may turn.
fn same(text: &str) -> bool {
    let (new, old) = (
        entries(text),
        entries(include_str!("../../bsdf/src/ggx_table.rs")),
    );
    let apart = |(a, b): (&f64, &f64)| (a - b).abs() / b.abs().max(0.01);
    let most = new.iter().zip(&old).map(apart).fold(0.0, f64::max);
    println!("{} entries, differing by {most:.1e} at most", old.len());
    new.len() == old.len() && most < 1e-3
}

fn main() {
    let argument = std::env::args().nth(1);
    if argument.as_deref() == Some("--verify") {
        std::process::exit(i32::from(!verify()));
    }
    let (text, worst, median) = fresh();
    println!("fit error: worst {worst:.3}, median {median:.3}");
    let Some(path) = argument else {
        let good = same(&text) & verify();
        std::process::exit(i32::from(!good));
    };
    if let Err(error) = std::fs::write(&path, text) {
        eprintln!("{path}: {error}");
        std::process::exit(1);
    }
}
