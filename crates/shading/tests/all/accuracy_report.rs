//! This module makes the table and the plots of `docs/accuracy.md`.

use crate::accuracy::Row;
use std::fmt::Write;

/// The head of the table.
pub(crate) const HEADER: &str = "| function | domain | inputs | worst | 99.9 % | goal | printed form: median | printed form: 99 % | printed form: worst |\n\
     |---|---|---:|---:|---:|---:|---:|---:|---:|\n";

/// Lines of the table, in Markdown.
pub(crate) fn lines(rows: &[Row]) -> String {
    let mut out = String::new();
    for row in rows {
        let printed: Row = Row {
            samples: row
                .samples
                .iter()
                .copied()
                .filter(|s| !s.printed.is_nan())
                .collect(),
            ..*row
        };
        writeln!(
            out,
            "{} {} | {:.1e} | {:.1e} | {:.0e} | {} | {} | {} |",
            row.key(),
            row.samples.len(),
            row.worst(),
            row.quantile(0.999, |s| s.ours),
            row.goal,
            cell(printed.quantile(0.5, |s| s.printed)),
            cell(printed.quantile(0.99, |s| s.printed)),
            cell(printed.quantile(1.0, |s| s.printed)),
        )
        .expect("a String takes any text");
    }
    out
}

fn cell(x: f64) -> String {
    if x.is_nan() {
        return "–".to_owned();
    }
    if x.is_finite() {
        format!("{x:.1e}")
    } else {
        "NaN or ∞".to_owned()
    }
}

/// Error over condition, log–log, in thirds of a decade: the worst of ours, the median and the
/// worst of the printed form.
pub(crate) fn plot(function: &str, rows: &[Row]) -> String {
    let (width, height) = (640.0, 400.0);
    let [ours, printed, typical] = binned(function, rows);
    let x = |bin: f64| 60.0 + bin / 48.0 * (width - 80.0);
    let y = |error: f64| 20.0 + (4.0 - error.max(1e-18).log10()) / 22.0 * (height - 70.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    let condition = condition(function);
    for decade in (-18..=4).step_by(2) {
        let py = y(10f64.powi(decade));
        writeln!(svg, "<path d=\"M60 {py:.1}H{:.0}\" stroke=\"#ddd\"/><text x=\"54\" y=\"{:.1}\" text-anchor=\"end\">1e{decade}</text>", width - 20.0, py + 4.0).expect("text");
    }
    for decade in (0..=16).step_by(2) {
        let px = x(f64::from(decade) * 3.0);
        writeln!(svg, "<path d=\"M{px:.1} 20V{:.0}\" stroke=\"#ddd\"/><text x=\"{px:.1}\" y=\"{:.0}\" text-anchor=\"middle\">1e{decade}</text>", height - 50.0, height - 34.0).expect("text");
    }
    for (values, colour, label, at) in [
        (
            &typical,
            "#e0a020",
            "printed form (corrected), median",
            80.0,
        ),
        (&printed, "#c04020", "printed form (corrected), worst", 60.0),
        (&ours, "#2060c0", "linelit, worst", 40.0),
    ] {
        let mut path = String::new();
        for (bin, value) in values.iter().enumerate().filter(|(_, v)| !v.is_nan()) {
            let command = if path.is_empty() { 'M' } else { 'L' };
            let px = x(bin as f64 + 0.5);
            write!(path, "{command}{px:.1} {:.1}", y(*value)).expect("text");
        }
        if path.is_empty() {
            continue;
        }
        writeln!(svg, "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/><text x=\"70\" y=\"{at}\" fill=\"{colour}\">{label}</text>").expect("text");
    }
    writeln!(svg, "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{function}: relative error over condition ({condition})</text>\n</svg>", width / 2.0, height - 12.0).expect("text");
    svg
}

/// Bins of the condition, three to a decade.
const BINS: usize = 48;

/// By condition, the worst of ours, the worst and the median of the printed form.
fn binned(function: &str, rows: &[Row]) -> [[f64; BINS]; 3] {
    let mut ours = [f64::NAN; BINS];
    let mut printed = [f64::NAN; BINS];
    let mut typical = [f64::NAN; BINS];
    let mut all = vec![Vec::new(); BINS];
    for sample in rows
        .iter()
        .filter(|r| r.function == function)
        .flat_map(|r| &r.samples)
    {
        let decade = sample.condition.log10().clamp(0.0, 15.9);
        #[allow(clippy::cast_possible_truncation, reason = "0 to 47")]
        let bin = (decade * 3.0) as usize;
        ours[bin] = ours[bin].max(sample.ours);
        printed[bin] = printed[bin].max(sample.printed.min(1e4));
        if !sample.printed.is_nan() {
            all[bin].push(sample.printed.min(1e4));
        }
    }
    for (median, errors) in typical.iter_mut().zip(&mut all) {
        errors.sort_by(f64::total_cmp);
        *median = errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN);
    }
    [ours, printed, typical]
}

/// The condition number of a function, in words.
fn condition(function: &str) -> &'static str {
    match function.split("::").next() {
        Some("phong" | "quadrature") => "(k + 1)/sin δ, δ the angle between the ends' directions",
        Some("spherical_gaussian") => "(λ + 1)/sin δ, δ the angle between the ends' directions",
        _ if function == "ltc::Ltc::polygon" => "1/(mapped Ω × distance/height)",
        Some("polygon" | "solid_angle") => "1/Ω",
        _ => "1/sin δ, δ the angle between the ends' directions",
    }
}
