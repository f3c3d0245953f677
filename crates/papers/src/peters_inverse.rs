//! Peters 2021, Fig. 3: the inverse distribution function of projected solid angle along a line,
//! and how near two steps of the paper's iteration come to it.

use crate::measured::Measured;
use crate::picture_study::{Context, PictureStudy, Row, section, table};
use anyhow::Result;
use linelit_elementary::{asin, atan2, ln, sin, sin_cos};
use linelit_samplers::{Sampler, SamplerKind};
use linelit_study::report::Plot;
use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;

/// The normal's components along the line and towards it; the third is the paper's square root, the
/// last two are its "n_t near −1".
const NORMALS: [[f64; 2]; 5] = [
    [0.0, 1.0],
    [0.6, 0.8],
    [1.0, 0.0],
    [0.6, -0.8],
    [0.28, -0.96],
];

/// The distribution along a line that is infinitely long: F of eq. 3 from the left end of what is
/// above the horizon.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Distribution {
    ns: f64,
    nt: f64,
    /// Where the line comes above the horizon, and where it goes below.
    ends: [f64; 2],
}

impl Distribution {
    /// Of a normal in the plane of line and shading point.
    pub(crate) fn new([ns, nt]: [f64; 2]) -> Self {
        // n_s ω + n_t √(1 − ω²) is the cosine of the angle from (n_s, n_t).
        let middle = atan2(ns, nt);
        let end = |a: f64| sin(a.clamp(-FRAC_PI_2, FRAC_PI_2));
        let ends = [end(middle - FRAC_PI_2), end(middle + FRAC_PI_2)];
        Self { ns, nt, ends }
    }

    /// F of eq. 3.
    fn antiderivative(&self, w: f64) -> f64 {
        let root = (1.0 - w * w).max(0.0).sqrt();
        self.ns * w * w + self.nt * (root * w + asin(w.clamp(-1.0, 1.0)))
    }

    /// The largest value, at the right end; the left end has zero.
    pub(crate) fn total(&self) -> f64 {
        self.antiderivative(self.ends[1]) - self.antiderivative(self.ends[0])
    }

    /// The inverse, by bisection to the last bit.
    pub(crate) fn inverse(&self, value: f64) -> f64 {
        let [mut low, mut high] = self.ends;
        let wanted = value + self.antiderivative(self.ends[0]);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if self.antiderivative(middle) < wanted {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// The exponent p of ω − ω₀ ~ value^p at the left end: below one, the derivative is infinite.
    pub(crate) fn exponent(&self) -> f64 {
        let rise = |share: f64| self.inverse(share * self.total()) - self.ends[0];
        // F is good to 2e-16 of its total: to 2e-8 of the smaller value.
        ln(rise(1e-6) / rise(1e-8)) / ln(100.0)
    }

    /// The steepest part of the inverse, away from its ends: ω over share of the total.
    fn slope(&self) -> f64 {
        let at = |share: f64| self.inverse(share * self.total());
        (at(0.9) - at(0.1)) / (0.8 * self.total())
    }
}

/// The error in ξ of the paper's iteration (algorithm 2 in f64) on part of a line from `ends[0]` to
/// `ends[1]`, after some steps.
pub(crate) fn backward_error([ns, nt]: [f64; 2], ends: [f64; 2], xi: f64, steps: u32) -> f64 {
    let f = Distribution {
        ns,
        nt,
        ends: [-1.0, 1.0],
    };
    let (first, last) = (f.antiderivative(ends[0]), f.antiderivative(ends[1]));
    let target = first + xi * (last - first);
    let mut alpha = asin((ends[0] + xi * (ends[1] - ends[0])).clamp(-1.0, 1.0));
    if (1e-5..=1.0 - 1e-5).contains(&xi) {
        for _ in 0..steps {
            let (ws, wt) = sin_cos(alpha);
            let n = ns * ws + nt * wt;
            let g = n * ws + nt * alpha - target;
            let g1 = 2.0 * n * wt;
            let g2 = 2.0 * (ns * wt - nt * ws) * wt - 2.0 * n * ws;
            let root = (g1 * g1 - 2.0 * g2 * g).max(0.0).sqrt();
            let sum = g1 + root.copysign(g1);
            let step = if sum.abs() > 0.0 { -2.0 * g / sum } else { 0.0 };
            alpha = (alpha + step).clamp(-FRAC_PI_2, FRAC_PI_2);
        }
    }
    ((f.antiderivative(sin(alpha)) - first) / (last - first) - xi).abs()
}

/// The worst backward errors after one, two and three steps, over random normals, ends above the
/// horizon and numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Worst {
    /// Cases that were tried.
    pub cases: u32,
    /// Errors after one, two and three steps.
    pub errors: [f64; 3],
}

/// Tries random cases; those with a hundred-thousandth of the whole light cancel, and are left out.
pub(crate) fn worst(cases: u32, seed: u64) -> Worst {
    let numbers = Sampler::new(SamplerKind::Independent, seed);
    let points = |stream| numbers.points([0, 0], stream, cases);
    let (sets, more) = (points(0), points(1));
    let mut out = Worst {
        cases: 0,
        errors: [0.0; 3],
    };
    for k in 0..cases {
        let ([a, b], [c, xi]) = (sets.get_2d(k), more.get_2d(k));
        // Half of the normals look nearly away from the line, where the iteration is worst.
        let angle = if k % 2 == 0 {
            std::f64::consts::PI * (2.0 * a - 1.0)
        } else {
            std::f64::consts::PI - 0.3 * a
        };
        let (ns, nt) = sin_cos(angle);
        let whole = Distribution::new([ns, nt]);
        let [low, high] = whole.ends;
        // Ends uniform in the angle.
        let [from, to] = [low, high].map(asin);
        let at = |share: f64| sin(from + share * (to - from));
        let ends = [at(b.min(c)), at(b.max(c))];
        let part = whole.antiderivative(ends[1]) - whole.antiderivative(ends[0]);
        if part < 1e-5 {
            continue;
        }
        out.cases += 1;
        for (error, steps) in out.errors.iter_mut().zip(1..) {
            *error = error.max(backward_error([ns, nt], ends, xi, steps));
        }
    }
    out
}

const COLUMNS: [&str; 5] = [
    "width of the domain",
    "left end",
    "exponent at the left end",
    "slope",
    "distance from a square root",
];

/// A row of numbers for each normal.
fn shapes() -> Vec<Row> {
    let mut rows = Vec::new();
    for normal in NORMALS {
        let f = Distribution::new(normal);
        let shares = (0..=1000).map(|k| f64::from(k) / 1000.0);
        let from_root = shares.map(|s| (f.inverse(s * f.total()) - (s * f.total()).sqrt()).abs());
        let from_root = from_root.fold(0.0, f64::max);
        let values = [f.total(), f.ends[0], f.exponent(), f.slope(), from_root];
        let values: Vec<_> = COLUMNS
            .into_iter()
            .zip(values.map(Measured::exact))
            .collect();
        let [ns, nt] = normal;
        rows.push(Row::measured(format!("n = ({ns}, {nt})"), &values));
    }
    rows
}

/// The study.
pub(super) fn run(context: &Context<'_>) -> Result<PictureStudy> {
    let mut rows = shapes();
    let worst = worst(context.or_least(2_000_000, 2_000), context.seed);
    let steps = ["after one step", "after two steps", "after three steps"];
    let values: Vec<_> = steps
        .into_iter()
        .zip(worst.errors.map(Measured::exact))
        .collect();
    let iteration = Row::measured("worst error in ξ", &values);
    let of = |k: usize, name| rows[k].values.get(name).copied().unwrap_or(f64::NAN);
    let exponents = (0..NORMALS.len()).map(|k| of(k, COLUMNS[2]));
    let largest = exponents.fold(0.0, f64::max);
    let lead = format!(
        "The inverse rises from its left end as a power of at most {largest:.3}: below one, its derivative is \
         infinite there for all five normals. For (1, 0) it is the square root to {:.0e}. As n_t nears −1 the domain \
         shrinks, from {:.2} at n_t = 1 to {:.2} and {:.3}, and the slope grows from {:.2} to {:.2} and {:.2}.",
        of(2, COLUMNS[4]),
        of(0, COLUMNS[0]),
        of(3, COLUMNS[0]),
        of(4, COLUMNS[0]),
        of(0, COLUMNS[3]),
        of(3, COLUMNS[3]),
        of(4, COLUMNS[3]),
    );
    let [one, two, three] = worst.errors;
    let said = format!(
        "Over {} random cases in f64 the worst error in ξ is {one:.1e} after one step, {two:.2e} after the paper's \
         two (paper: 1.58e-5 over 28 billion) and {three:.1e} after three{}.",
        worst.cases,
        // Numbers within 1e-5 of 0 and 1 are not iterated.
        if two - three < 1e-9 {
            ": what the guard at the ends of ξ leaves, which no step changes"
        } else {
            ""
        }
    );
    let mut first = section(
        "Fig. 3",
        &lead,
        Vec::new(),
        vec![table("", &COLUMNS, &rows)],
    );
    first.plots.push(Plot {
        svg: plot(),
        caption: "The inverse distribution function for five normals.".to_owned(),
    });
    let tables = vec![table("", &steps, std::slice::from_ref(&iteration))];
    let second = section("The iteration", &said, Vec::new(), tables);
    rows.push(iteration);
    Ok(PictureStudy {
        title: "Inverting projected solid angle: Peters 2021, Fig. 3".to_owned(),
        summary: vec![lead, said],
        sections: vec![first, second],
        rows,
    })
}

/// The five curves, in the colour of the text, each with its normal at its right end.
fn plot() -> String {
    let (width, height, left) = (560.0, 300.0, 40.0);
    let mut svg = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" fill="none" stroke="currentColor" font-family="sans-serif" font-size="12">"#
    );
    let at = |value: f64, w: f64| {
        let (x, y) = (left + 125.0 * value, 150.0 - 130.0 * w);
        format!("{x:.1},{y:.1}")
    };
    for w in [-1.0, 0.0, 1.0] {
        let [a, b] = [at(0.0, w), at(3.2, w)];
        let _ = write!(svg, r#"<path d="M{a}L{b}" opacity="0.3"/>"#);
        let y = 154.0 - 130.0 * w;
        let _ = write!(
            svg,
            r#"<text x="8" y="{y}" fill="currentColor" stroke="none">{w}</text>"#
        );
    }
    for (k, normal) in NORMALS.into_iter().enumerate() {
        let f = Distribution::new(normal);
        let points: Vec<String> = (0..=200)
            .map(|i| {
                let value = f.total() * (f64::from(i) / 200.0).powi(2);
                at(value, f.inverse(value))
            })
            .collect();
        let dash = ["none", "8 3", "2 3", "8 3 2 3", "1 2"][k];
        let _ = write!(
            svg,
            r#"<path d="M{}" stroke-width="2" stroke-dasharray="{dash}"/>"#,
            points.join("L")
        );
        let (x, y) = (left + 125.0 * f.total() + 4.0, 24.0 + 13.0 * k as f64);
        let [ns, nt] = normal;
        let _ = write!(
            svg,
            r#"<text x="{x:.1}" y="{y:.1}" fill="currentColor" stroke="none">({ns}, {nt})</text>"#
        );
    }
    svg + "</svg>"
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The antiderivative of (1, 0) is ω², that of (0, 1) is symmetric about ω = 0.
    #[test]
    fn inverses_are_known() {
        let root = Distribution::new([1.0, 0.0]);
        let flat = Distribution::new([0.0, 1.0]);
        for share in [0.1, 0.25, 0.5, 0.81] {
            // Roundings of F over its slope there, at least 0.6.
            assert!((root.inverse(share) - share.sqrt()).abs() < 1e-15);
            let both = [share, 1.0 - share].map(|s| flat.inverse(s * flat.total()));
            assert!((both[0] + both[1]).abs() < 1e-14, "{both:?}");
        }
        // The horizon crosses at a slope: a square root; the end of the line at infinity: 2/3.
        assert!((root.exponent() - 0.5).abs() < 1e-6);
        assert!((flat.exponent() - 2.0 / 3.0).abs() < 1e-3);
    }

    /// Two steps are as good as the paper says, one is not.
    #[test]
    fn two_steps_are_enough() {
        let Worst { errors, .. } = worst(100_000, 3);
        assert!(
            errors[1] <= 1.58e-5 && errors[1] < 0.1 * errors[0],
            "{errors:?}"
        );
    }
}
