//! What Billen & Dutré's tabulation would cost and lose: ∫cosᵏ on a grid that is denser near the
//! lobe's peak, looked up at both ends of a segment, beside `phong::ribbon` on the same segments.
//! `cargo run --release -p linelit-workshop --no-default-features --example tabulated`
#![allow(clippy::print_stdout, reason = "printing is what the program is for")]

mod input;

use input::{COUNT, segments};
use linelit_geometry::{DVec3, Segment};
use linelit_shading::{phong, ribbon};
use linelit_testkit::quadrature::gauss_legendre;
use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::time::Instant;

/// An integral by its name.
type Form<'a> = (&'a str, &'a dyn Fn(&Segment) -> f64);

/// C(u) = ∫₀ᵘ cosᵏ at u = (π/2) s⁴, s evenly spaced from 0 to 1, and its derivative there.
struct Table {
    k: f64,
    nodes: Vec<[f64; 3]>,
}

impl Table {
    fn new(k: f64, size: usize) -> Self {
        let rule = gauss_legendre(16);
        let (mut sum, mut last, mut nodes) = (0.0, 0.0, Vec::new());
        for i in 0..=size {
            let u = FRAC_PI_2 * (i as f64 / size as f64).powi(4);
            sum += rule.integrate(last, u, |x| x.cos().powf(k));
            nodes.push([u, sum, u.cos().max(0.0).powf(k)]);
            last = u;
        }
        Self { k, nodes }
    }

    /// C(u) for |u| ≤ π/2: linear between entries, or by Hermite's cubic.
    fn at<const CUBIC: bool>(&self, u: f64) -> f64 {
        let cells = (self.nodes.len() - 1) as f64;
        let s = (u.abs() * (1.0 / FRAC_PI_2)).sqrt().sqrt() * cells;
        #[allow(clippy::cast_possible_truncation, reason = "an index")]
        let i = (s as usize).min(self.nodes.len() - 2);
        let ([u0, c0, d0], [u1, c1, d1]) = (self.nodes[i], self.nodes[i + 1]);
        let width = u1 - u0;
        let t = (u.abs() - u0) / width;
        let value = if CUBIC {
            let bend = t * (1.0 - t);
            c0 + (c1 - c0) * t * t * (3.0 - 2.0 * t) + width * bend * (d0 * (1.0 - t) - d1 * t)
        } else {
            c0 + (c1 - c0) * t
        };
        value.copysign(u)
    }

    /// Their eq. 24 in three terms, for a segment in front of the surface.
    fn ribbon<const CUBIC: bool>(&self, s: &Segment, n: DVec3, axis: DVec3) -> f64 {
        let k = self.k;
        let along = (s.p1 - s.p0).normalize();
        let foot = s.p0 - along * s.p0.dot(along);
        let h = foot.length();
        let up = foot / h;
        let polar = |v: DVec3| (v.dot(along).atan2(v.dot(up)), v.dot(along).hypot(v.dot(up)));
        let ((phi_n, sin_n), (phi_r, sin_r)) = (polar(n), polar(axis));
        let ends =
            [s.p0, s.p1].map(|p| ((p.dot(along) / h).atan() - phi_r).clamp(-FRAC_PI_2, FRAC_PI_2));
        let (alpha, beta) = (phi_r - phi_n, phi_r);
        let lower = self.at::<CUBIC>(ends[1]) - self.at::<CUBIC>(ends[0]);
        let powers = ends.map(|u| {
            let (sine, cosine) = u.sin_cos();
            let power = cosine.max(0.0).powf(k + 1.0);
            (power * sine, power * cosine)
        });
        let upper = (powers[1].0 - powers[0].0 + (k + 1.0) * lower) / (k + 2.0);
        let sum = (alpha + beta).cos() * upper
            + alpha.sin() * beta.sin() * lower
            + (alpha + beta).sin() * (powers[1].1 - powers[0].1) / (k + 2.0);
        sin_n * sin_r.powf(k) * sum / (h * h)
    }
}

fn main() {
    let input = segments();
    let (n, axis) = (DVec3::Z, DVec3::new(0.2, 0.1, 0.9).normalize());
    println!("exponent  form              ns   bytes   error: median    90 %     worst");
    for k in [10.0, 100.0, 1000.0] {
        let table = Table::new(k, 1024);
        let forms: [Form<'_>; 4] = [
            ("diffuse ribbon", &|s| ribbon::irradiance(s.p0, s.p1, n)),
            ("phong::ribbon", &|s| phong::ribbon(s.p0, s.p1, n, axis, k)),
            ("table, linear", &|s| table.ribbon::<false>(s, n, axis)),
            ("table, cubic", &|s| table.ribbon::<true>(s, n, axis)),
        ];
        // In turns: the least time of each.
        let mut least = [f64::INFINITY; 4];
        for _ in 0..600 {
            for (best, (_, f)) in least.iter_mut().zip(&forms) {
                let start = Instant::now();
                black_box(black_box(&input).iter().map(f).sum::<f64>());
                *best = best.min(start.elapsed().as_secs_f64());
            }
        }
        for (i, ((name, f), time)) in forms.iter().zip(least).enumerate() {
            let ns = time * 1e9 / f64::from(u32::try_from(COUNT).expect("small"));
            let mut errors: Vec<f64> = input
                .iter()
                .map(|s| (f(s), phong::ribbon(s.p0, s.p1, n, axis, k)))
                .filter(|(_, want)| *want > 1e-280)
                .map(|(got, want)| (got / want - 1.0).abs())
                .collect();
            errors.sort_by(f64::total_cmp);
            let share = |of: usize| errors[(errors.len() - 1) * of / 100];
            match i {
                0 | 1 => println!("{k:8}  {name:14} {ns:6.1}"),
                _ => println!(
                    "{k:8}  {name:14} {ns:6.1} {:7}        {:9.1e} {:9.1e} {:9.1e}",
                    table.nodes.len() * if i == 2 { 16 } else { 24 },
                    share(50),
                    share(90),
                    share(100)
                ),
            }
        }
    }
}
