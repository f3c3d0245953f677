//! Billen & Dutré 2016, section 6.2: what finding all blockers of a line costs, O(log n + m), and
//! which share of the time it takes.

use crate::measured::{Measured, settings};
use crate::picture_study::{Context, PictureStudy, Row, section, table};
use anyhow::{Context as _, Result};
use linelit_elementary::{cos, ln, log2, sin};
use linelit_geometry::{DMat3, DVec3, Segment, ShadowTriangle};
use linelit_integrator::{Renderer, Settings, Workspace};
use linelit_lights::Light;
use linelit_samplers::SamplerKind;
use linelit_study::engine::CpuClock;
use linelit_study::scene_study::{Targets, all_pixels};
use linelit_visibility::{Occluders, Scratch, ShaftQuery, VisibleLines};
use std::hint::black_box;

/// Shadow triangles of a measurement.
const LINES: u32 = 256;
/// Runs through them, of which the fastest counts.
const RUNS: u32 = 5;
/// Lines whose blockers are counted one by one.
const COUNTED: usize = 64;
/// Triangles in the way in the scenes that grow elsewhere, and extent of those that do not shrink.
const FIRST: u32 = 1 << 10;
const EXTENT: f64 = 0.06;

/// How a scene between floor and light grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Growing {
    /// The same thousand triangles in the way, all others beside.
    Beside,
    /// A bumpy surface in ever finer triangles: blockers as √n.
    Finer,
    /// More of the same triangles: blockers as n.
    Denser,
    /// Ever smaller triangles all over the space, so that blockers stay as many.
    Dust,
}

impl Growing {
    const ALL: [Self; 4] = [Self::Beside, Self::Finer, Self::Denser, Self::Dust];

    const fn name(self) -> &'static str {
        match self {
            Self::Beside => "more triangles beside, the same in the way",
            Self::Finer => "a surface in finer triangles",
            Self::Denser => "more of the same triangles",
            Self::Dust => "dust: ever smaller triangles all over the space",
        }
    }
}

/// Random numbers in [0, 1): a splitmix sequence.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// The cost of single shadow triangles among n triangles, each a query of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Growth {
    /// How the scene grew.
    pub growing: Growing,
    /// Triangles.
    pub triangles: u32,
    /// Those that a shadow triangle meets, on average: the paper's m.
    pub blockers: Measured,
    /// Box tests of a shadow triangle.
    pub boxes: Measured,
    /// Triangle tests of a shadow triangle.
    pub triangle_tests: Measured,
    /// Nanoseconds of a shadow triangle: the fastest run.
    pub nanoseconds: f64,
}

/// Corners, three for each triangle.
fn soup(count: u32, extent: f64, beside: f64, numbers: &mut Numbers) -> Vec<DVec3> {
    let mut corners = Vec::new();
    for _ in 0..count {
        let centre = DVec3::new(
            numbers.between(-1.0, 1.0) + beside,
            numbers.between(-1.0, 1.0),
            numbers.between(0.15, 0.85),
        );
        for _ in 0..3 {
            let mut off = || numbers.between(-0.5, 0.5) * extent;
            corners.push(centre + DVec3::new(off(), off(), off()));
        }
    }
    corners
}

/// A bumpy surface over the whole floor, of about so many triangles; every other square is open,
/// so that not all light is hidden.
fn surface(count: u32) -> Vec<DVec3> {
    let side = f64::from(count).sqrt().round().max(1.0);
    let at = |x: f64, y: f64| {
        let [x, y] = [x, y].map(|v| 2.0 * v / side - 1.0);
        DVec3::new(x, y, 0.5 + 0.1 * sin(5.0 * x) * cos(4.0 * y))
    };
    let mut corners = Vec::new();
    let cells =
        |n: f64| std::iter::successors(Some(0.0), |x| Some(x + 1.0)).take_while(move |x| *x < n);
    for y in cells(side) {
        for x in cells(side).filter(|x| (x + y) % 2.0 < 0.5) {
            let quad = [
                at(x, y),
                at(x + 1.0, y),
                at(x + 1.0, y + 1.0),
                at(x, y + 1.0),
            ];
            corners.extend([0, 1, 2, 0, 2, 3].map(|k| quad[k]));
        }
    }
    corners
}

/// The scene of n triangles, as corners of `f32`.
fn corners(growing: Growing, n: u32, numbers: &mut Numbers) -> Vec<DVec3> {
    let mut corners = match growing {
        Growing::Beside => {
            let mut all = soup(n.min(FIRST), EXTENT, 0.0, numbers);
            all.extend(soup(n.saturating_sub(FIRST), EXTENT, 3.0, numbers));
            all
        }
        Growing::Finer => surface(n),
        Growing::Denser => soup(n, EXTENT, 0.0, numbers),
        Growing::Dust => {
            let extent = EXTENT * f64::from(FIRST) / f64::from(n);
            soup(n, extent, 0.0, numbers)
        }
    };
    for corner in &mut corners {
        *corner = corner.as_vec3().as_dvec3();
    }
    corners
}

/// A hierarchy over triangles.
fn occluders(corners: &[DVec3]) -> Occluders {
    let positions: Vec<[f32; 3]> = corners.iter().map(|c| c.as_vec3().to_array()).collect();
    let triangles: Vec<[u32; 3]> = (0..)
        .step_by(3)
        .take(corners.len() / 3)
        .map(|k| [k, k + 1, k + 2])
        .collect();
    Occluders::build(&positions, &triangles)
}

/// Triangles that hide part of a line from a point.
fn blockers(corners: &[DVec3], (point, line): &(DVec3, Segment)) -> f64 {
    let Some(triangle) = ShadowTriangle::new(*point, line) else {
        return 0.0;
    };
    let hides = |c: &&[DVec3; 3]| triangle.blocked_by(c).is_some();
    corners.as_chunks::<3>().0.iter().filter(hides).count() as f64
}

/// Measures shadow triangles from the floor to lines at a height of one.
pub(crate) fn measure(growing: Growing, triangles: u32, lines: u32, seed: u64) -> Growth {
    let mut numbers = Numbers(seed);
    let corners = corners(growing, triangles, &mut numbers);
    let occluders = occluders(&corners);
    let mut place = |z| {
        let [x, y] = [(); 2].map(|()| numbers.between(-0.8, 0.8));
        DVec3::new(x, y, z)
    };
    let queries: Vec<(DVec3, Segment)> = (0..lines)
        .map(|_| (place(0.0), Segment::new(place(1.0), place(1.0))))
        .collect();
    let mut scratch = Scratch::new();
    let mut visible = VisibleLines::new();
    let mut one = |(point, line): &(DVec3, Segment)| {
        let ends = [line.p0, line.p1];
        let mut shaft = occluders.shaft(ShaftQuery::new(*point, &ends), &mut scratch);
        shaft.visible(std::slice::from_ref(line), &mut visible);
        black_box(&visible);
        std::mem::take(&mut scratch.counters)
    };
    let counts: Vec<_> = queries.iter().map(&mut one).collect();
    let mut least = f64::INFINITY;
    for _ in 0..RUNS {
        let clock = CpuClock::start();
        for query in &queries {
            black_box(one(black_box(query)));
        }
        least = least.min(clock.seconds() * 1e9 / f64::from(lines));
    }
    let mean = |f: fn(&linelit_visibility::Counters) -> u64| {
        Measured::mean(&counts.iter().map(|c| f(c) as f64).collect::<Vec<_>>())
    };
    let counted: Vec<f64> = queries
        .iter()
        .take(COUNTED)
        .map(|query| blockers(&corners, query))
        .collect();
    Growth {
        growing,
        triangles,
        blockers: Measured::mean(&counted),
        boxes: mean(|c| c.node_tests),
        triangle_tests: mean(|c| c.triangle_tests),
        nanoseconds: least,
    }
}

/// Box and triangle tests as a + b log₂ n + c m: coefficients, and the largest relative residual.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    /// a, b and c.
    pub coefficients: [f64; 3],
    /// Of all measurements.
    pub worst: f64,
}

impl Law {
    /// The tests that it expects.
    fn of(&self, g: &Growth) -> f64 {
        DVec3::from(self.coefficients).dot(DVec3::from(row(g)))
    }
}

/// 1, log₂ n and m.
fn row(g: &Growth) -> [f64; 3] {
    [1.0, log2(f64::from(g.triangles)), g.blockers.value]
}

/// Fits the law by least squares of relative residuals.
pub(crate) fn law(all: &[Growth]) -> Option<Law> {
    // Normal equations, three by three.
    let mut matrix = DMat3::ZERO;
    let mut right = DVec3::ZERO;
    for g in all {
        let r = DVec3::from(row(g)) / tests(g);
        matrix += DMat3::from_cols(r * r.x, r * r.y, r * r.z);
        right += r;
    }
    if matrix.determinant().abs() <= 0.0 {
        return None;
    }
    let mut law = Law {
        coefficients: (matrix.inverse() * right).to_array(),
        worst: 0.0,
    };
    let residual = |g: &Growth| (law.of(g) / tests(g) - 1.0).abs();
    law.worst = all.iter().map(residual).fold(0.0, f64::max);
    Some(law)
}

/// Times of one scene: finding what is between points and light, over everything.
#[derive(Clone, Debug)]
pub(crate) struct Share {
    /// The scene.
    pub scene: &'static str,
    /// Lines at each point.
    pub lines: u32,
    /// Share of the walk through the hierarchy in the time of the whole estimate.
    pub walk: Measured,
}

/// Measures the share of one walk for each point in the time of line samples in closed form.
pub(crate) fn share(context: &Context<'_>, scene_name: &'static str, lines: u32) -> Result<Share> {
    let mut scene = context.library.load(scene_name)?.scene;
    let [width, height] = context.size([12; 2]);
    scene.set_resolution(width, height);
    let renderer = Renderer::new(&scene);
    let targets = Targets::find(&renderer, &all_pixels(width, height));
    let light = renderer.plan().lights().first().context("no light")?;
    let Light::Area(area) = &*light.light else {
        anyhow::bail!("`{scene_name}` has no polygonal light");
    };
    let settings = Settings {
        samples: lines,
        seed: context.seed,
        ..settings(crate::billen_orders::LINES, SamplerKind::Stratified)?
    };
    let mut workspace = Workspace::new();
    let mut scratch = Scratch::new();
    let occluders = renderer.light_occluders();
    let ratios: Vec<f64> = (0..context.or_least(6, 2))
        .map(|_| {
            let clock = CpuClock::start();
            for (pixel, point) in &targets.points {
                black_box(renderer.direct(&settings, point, *pixel, 0, &mut workspace));
            }
            let whole = clock.seconds();
            let clock = CpuClock::start();
            for (_, point) in &targets.points {
                let Some(above) = area.polygon.clip(point.position, point.normal) else {
                    continue;
                };
                let query =
                    ShaftQuery::new(point.position, &above).excluding(light.triangles.clone());
                black_box(occluders.shaft(query, &mut scratch).class());
            }
            clock.seconds() / whole
        })
        .collect();
    Ok(Share {
        scene: scene_name,
        lines,
        walk: Measured::geometric_mean(&ratios),
    })
}

const GROWTH: [&str; 5] = [
    "triangles n",
    "blockers m",
    "box tests",
    "triangle tests",
    "ns per line",
];

/// The study.
pub(super) fn run(context: &Context<'_>) -> Result<PictureStudy> {
    let counts = context.or_least(
        &[1_u32 << 10, 1 << 13, 1 << 16, 1 << 19][..],
        &[1 << 4, 1 << 6],
    );
    let lines = context.or_least(LINES, 8);
    let (mut sections, mut rows, mut all) = (Vec::new(), Vec::new(), Vec::new());
    let mut summary = Vec::new();
    for growing in Growing::ALL {
        let (mut own, mut series) = (Vec::new(), Vec::new());
        let name = growing.name();
        for &n in counts {
            // Nothing is left to see among 64 times as many.
            if growing == Growing::Denser && n > 1 << 16 {
                continue;
            }
            let g = measure(growing, n, lines, context.seed);
            let values = [
                Measured::exact(f64::from(n)),
                g.blockers,
                g.boxes,
                g.triangle_tests,
                Measured::exact(g.nanoseconds),
            ];
            let values: Vec<_> = GROWTH.into_iter().zip(values).collect();
            own.push(Row::measured(format!("{name}: n = {n}"), &values));
            series.push(g);
        }
        let lead = grown(&series);
        summary.push(format!("{name}: {lead}"));
        let tables = vec![table("For each shadow triangle.", &GROWTH, &own)];
        sections.push(section(name, "", Vec::new(), tables));
        rows.extend(own);
        all.extend(series);
    }
    summary.insert(0, law_sentence(&all));
    let shares = shares(context)?;
    let (section, more, said) = shares_section(&shares);
    sections.push(section);
    rows.extend(more);
    summary.push(said);
    Ok(PictureStudy {
        title: "What visibility of lines costs: Billen & Dutré 2016, section 6.2".to_owned(),
        summary,
        sections,
        rows,
    })
}

/// What the law says of all but dust, and how far it is from that.
fn law_sentence(all: &[Growth]) -> String {
    let (dust, others): (Vec<Growth>, _) = all.iter().partition(|g| g.growing == Growing::Dust);
    let Some(found) = law(&others) else {
        return "The law cannot be fitted to so few measurements.".to_owned();
    };
    let [a, b, c] = found.coefficients;
    let missed: Vec<String> = dust
        .iter()
        .map(|g| format!("{:.1}", tests(g) / found.of(g)))
        .collect();
    let order = |g: &[Growth]| {
        let (first, last) = (g.first()?, g.last()?);
        let grown = f64::from(last.triangles) / f64::from(first.triangles);
        Some(ln(tests(last) / tests(first)) / ln(grown))
    };
    let order = order(&dust).map_or(String::new(), |p| format!("{p:.2}"));
    format!(
        "Where n grows beside what is in the way, a surface gets finer, or triangles of one size grow in number, box and \
         triangle tests of a shadow triangle are {a:.0} + {b:.1} log₂ n + {c:.1} m, to within {:.0} % of each measurement \
         (the paper: O(log n + m)). Dust is the exception: its tests are {} times what that says, and grow as n^{order} \
         with as many blockers, for a shadow triangle is a sheet that passes n^(2/3) of the n cells of a space.",
        100.0 * found.worst,
        missed.join(", "),
    )
}

/// Box and triangle tests together.
fn tests(g: &Growth) -> f64 {
    g.boxes.value + g.triangle_tests.value
}

/// What a series says: how tests and blockers grow from its first measurement to its last.
fn grown(series: &[Growth]) -> String {
    let (Some(first), Some(last)) = (series.first(), series.last()) else {
        return String::new();
    };
    let times = |f: fn(&Growth) -> f64| f(last) / f(first);
    format!(
        "{:.0} times the triangles are {:.2} times the blockers, {:.2} times the tests and {:.2} times the time of \
         a shadow triangle.",
        times(|g| f64::from(g.triangles)),
        times(|g| g.blockers.value),
        times(tests),
        times(|g| g.nanoseconds),
    )
}

/// The share of the walk on each scene, with few lines and with the paper's 1024.
pub(crate) fn shares(context: &Context<'_>) -> Result<Vec<Share>> {
    let scenes = [
        "grid-planes-large",
        "triangle-soup-large",
        "colonnade-large",
    ];
    let mut out = Vec::new();
    for scene in scenes {
        for lines in context.or_least(&[1, 1024][..], &[1]) {
            out.push(share(context, scene, *lines)?);
        }
    }
    Ok(out)
}

fn shares_section(shares: &[Share]) -> (linelit_study::report::Section, Vec<Row>, String) {
    const COLUMN: &str = "share of the walk in the seconds";
    let row = |s: &Share| {
        let what = format!("{}, lines at a point: {}", s.scene, s.lines);
        Row::measured(what, &[(COLUMN, s.walk)])
    };
    let rows: Vec<Row> = shares.iter().map(row).collect();
    let of = |few: bool| -> Vec<&Share> {
        let chosen = shares.iter().filter(|s| (s.lines == 1) == few);
        chosen.collect()
    };
    let range = |list: &[&Share]| {
        let values = list.iter().map(|s| 100.0 * s.walk.value);
        let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        format!("{low:.1} to {high:.1} %")
    };
    let many = of(false);
    let many = if many.is_empty() {
        String::new()
    } else {
        format!(
            "; of 1024 lines, which share one walk, it is {}",
            range(&many)
        )
    };
    let said = format!(
        "Walking the hierarchy takes {} of the time of one line at a point (paper: 90 %, with a walk for each of \
         1024){many}.",
        range(&of(true))
    );
    let tables = vec![table(
        "Time of the shaft towards the light over that of line samples in closed form, taken in turns.",
        &[COLUMN],
        &rows,
    )];
    let section = section("Share of the traversal", "", Vec::new(), tables);
    (section, rows, said)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn growth(triangles: u32, m: f64, tests: f64) -> Growth {
        Growth {
            growing: Growing::Denser,
            triangles,
            blockers: Measured::exact(m),
            boxes: Measured::exact(tests),
            triangle_tests: Measured::exact(0.0),
            nanoseconds: 1.0,
        }
    }

    #[test]
    fn the_law_is_found() {
        let of = |n: u32, m: f64| growth(n, m, 5.0 + 3.0 * f64::from(n).log2() + 7.0 * m);
        let found = law(&[of(16, 2.0), of(1024, 2.0), of(64, 9.0), of(4096, 30.0)]).unwrap();
        let [a, b, c] = found.coefficients;
        // Rounding times the condition of the normal equations, 10⁴.
        assert!((a - 5.0).abs() < 1e-9 && (b - 3.0).abs() < 1e-9 && (c - 7.0).abs() < 1e-9);
        assert!(found.worst < 1e-9);
        assert!(law(&[of(16, 2.0)]).is_none());
    }

    /// Twice as many triangles of one size have twice as many blockers, to five standard errors of
    /// both counts; and as many box tests at least as the tree is high.
    #[test]
    fn blockers_grow_with_triangles() {
        let [few, many] = [1 << 11, 1 << 12].map(|n| measure(Growing::Denser, n, 256, 7));
        let error = |m: Measured| {
            let [low, high] = m.interval.unwrap();
            0.25 * (high - low) / m.value
        };
        let ratio = many.blockers.value / few.blockers.value;
        let bound = 5.0 * error(many.blockers).hypot(error(few.blockers));
        assert!((ratio / 2.0).ln().abs() < bound, "{ratio} ± {bound}");
        assert!(many.boxes.value >= 3.0 * 8.0 && many.triangle_tests.value >= many.blockers.value);
    }
}
