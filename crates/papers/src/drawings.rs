//! Figures of the papers that show functions and counts instead of errors of estimators. Come here
//! to add such a figure; `figures.toml` refers to it by name.

use crate::Context;
use crate::judged::special::inverse::{above, antiderivative};
use crate::judged::special::peters::backward_errors;
use anyhow::{Result, bail};
use linelit_elementary::sin;
use linelit_film::{HeatMap, Tile};
use linelit_geometry::intervals::{IntervalSet, VisibleSet};
use linelit_geometry::{DVec3, Segment, ShadowTriangle};
use linelit_integrator::{Renderer, Settings, Workspace};
use linelit_lights::Light;
use linelit_mis::smoothing;
use linelit_samplers::{Sampler, SamplerKind};
use linelit_study::report::{Picture, Plot, Section};
use linelit_study::scene_study;
use std::f64::consts::PI;
use std::fmt::Write as _;

/// A function that draws a figure.
pub(crate) type Drawing = fn(&Context<'_>) -> Result<Section>;

/// Returns the drawing of this name in `figures.toml`.
pub(crate) fn find(name: &str) -> Option<Drawing> {
    Some(match name {
        "pieces of lines" => pieces,
        "inverse distributions" => inverses,
        "backward errors" => rounding,
        "weights over a light" => weights,
        _ => return None,
    })
}

/// Makes a square picture in false colour from one number per pixel.
fn scalars(side: u32, values: &[f64], map: HeatMap, caption: &str) -> Result<Picture> {
    #[allow(clippy::cast_possible_truncation, reason = "colours need no more")]
    let values: Vec<f32> = values.iter().map(|v| *v as f32).collect();
    Ok(Picture::of_scalars(side, side, &values, map, caption)?)
}

/// Draws figure 5 of Billen & Dutré 2016: the mean number of visible intervals of a line, pixel by
/// pixel.
fn pieces(context: &Context<'_>) -> Result<Section> {
    const LINES: u32 = 64;
    let side = context.side(256);
    let mut pictures = Vec::new();
    for name in [
        "grid-planes-large",
        "triangle-soup-large",
        "colonnade-large",
    ] {
        let mut scene = context.library.load(name)?.scene;
        scene.set_resolution(side, side);
        let renderer = Renderer::new(&scene);
        let settings = Settings {
            estimator: "line-analytic".parse()?,
            sampler: SamplerKind::Stratified,
            samples: LINES,
            seed: context.seed,
            skip: false,
            ..Settings::default()
        };
        // Count the visible pieces of the lines at each shading point.
        let count = |pixel: [u32; 2], workspace: &mut Workspace| {
            let Some(point) = renderer.shading_point(pixel, workspace) else {
                return DVec3::ZERO;
            };
            workspace.take_counts();
            let _ = renderer.direct(&settings, &point, pixel, workspace);
            let segments = workspace.take_counts().segments;
            DVec3::splat(segments.pieces as f64 / segments.lines.max(1) as f64)
        };
        let (image, _) = scene_study::map(Tile::whole(side, side), context.progress, count);
        // Colour the counts, from none to the largest.
        let values: Vec<f64> = image.rgb.iter().map(|p| f64::from(p[0])).collect();
        let most = values.iter().copied().fold(0.0, f64::max);
        let map = HeatMap {
            low: 0.0,
            high: most.max(1.0),
            logarithmic: false,
        };
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let caption = format!("{name}: {mean:.2} visible pieces of a line on average");
        pictures.push(scalars(side, &values, map, &caption)?);
    }
    Ok(Section {
        title: "Billen & Dutré 2016, Fig. 5".to_owned(),
        lead: format!("Visible pieces of a line: the mean of {LINES} lines at each point."),
        pictures,
        ..Section::default()
    })
}

/// Draws figure 3 of Peters 2021: the inverse distribution function of projected solid angle along
/// an infinitely long line, for five normals in the plane of the line and the shading point.
fn inverses(_: &Context<'_>) -> Result<Section> {
    // The components along the line and towards it. The inverse for the third is a square root; the
    // last two are the paper's "n_t near −1".
    const NORMALS: [[f64; 2]; 5] = [
        [0.0, 1.0],
        [0.6, 0.8],
        [1.0, 0.0],
        [0.6, -0.8],
        [0.28, -0.96],
    ];
    // Draw the levels −1, 0 and 1 of the sine.
    let at = |value: f64, w: f64| format!("{:.1},{:.1}", 40.0 + 125.0 * value, 150.0 - 130.0 * w);
    let mut svg = r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 560 300" width="560" fill="none" stroke="currentColor" font-family="sans-serif" font-size="12">"#.to_owned();
    for w in [-1.0, 0.0, 1.0] {
        let (ends, y) = ([at(0.0, w), at(3.2, w)], 154.0 - 130.0 * w);
        let _ = write!(
            svg,
            r#"<path d="M{}L{}" opacity="0.3"/><text x="8" y="{y}" fill="currentColor" stroke="none">{w}</text>"#,
            ends[0], ends[1]
        );
    }
    // Draw the curve of each normal, with an entry of the legend.
    for (k, normal) in NORMALS.into_iter().enumerate() {
        let [first, last] = above(normal);
        let cdf = |angle| antiderivative(normal, angle) - antiderivative(normal, first);
        let angle = |i: i32| first + (last - first) * f64::from(i) / 200.0;
        let points: Vec<String> = (0..=200)
            .map(|i| at(cdf(angle(i)), sin(angle(i))))
            .collect();
        let dash = ["none", "8 3", "2 3", "8 3 2 3", "1 2"][k];
        let (path, [ns, nt], y) = (points.join("L"), normal, 200 + 18 * k);
        let _ = write!(
            svg,
            r#"<path d="M{path}M400,{y}h36" stroke-width="2" stroke-dasharray="{dash}"/><text x="444" y="{}" fill="currentColor" stroke="none">({ns}, {nt})</text>"#,
            y + 4
        );
    }
    let plot = Plot {
        svg: svg + "</svg>",
        caption: "The sine of the angle along the line over the projected solid angle up to it, \
                  for normals (along the line, towards it)."
            .to_owned(),
    };
    Ok(Section {
        title: "Peters 2021, Fig. 3".to_owned(),
        plots: vec![plot],
        ..Section::default()
    })
}

/// Draws figure 4 of Peters 2021: the worst backward error of 16 samples in each pixel, by the
/// algorithm as printed in single precision and by ours. The backward error is the change of the
/// random number that would give the sample exactly.
fn rounding(context: &Context<'_>) -> Result<Section> {
    const SAMPLES: u32 = 16;
    let side = context.side(256);
    let mut scene = context.library.load("cornell-box-line")?.scene;
    scene.set_resolution(side, side);
    let Some(Light::Linear(light)) = scene.lights.first().map(|l| &*l.light) else {
        bail!("the room has no linear light");
    };
    // Take half of the light, to keep away from the wall.
    let line = light.segment.piece(0.0, 0.5);
    let renderer = Renderer::new(&scene);
    let numbers = Sampler::new(SamplerKind::Independent, context.seed);
    // Find the worst errors of the samples of each pixel.
    let measure = |pixel: [u32; 2], workspace: &mut Workspace| {
        let Some(point) = renderer.shading_point(pixel, workspace) else {
            return DVec3::ZERO;
        };
        let set = numbers.points(pixel, 0, SAMPLES);
        let all = (0..SAMPLES).filter_map(|i| backward_errors(&line, &point, set.get_1d(i)));
        all.fold(DVec3::ZERO, DVec3::max)
    };
    let (image, _) = scene_study::map(Tile::whole(side, side), context.progress, measure);
    // Show both errors, alone and times the brightness.
    let most = image.rgb.iter().fold(0.0, |most, p| p[2].max(most));
    let mut pictures = Vec::new();
    for (k, name) in ["as printed, in f32", "ours, in f64"]
        .into_iter()
        .enumerate()
    {
        for (times, bright) in [("", false), (", times the brightness", true)] {
            let value = |p: &[f32; 3]| f64::from(if bright { p[k] * p[2] / most } else { p[k] });
            let values: Vec<f64> = image.rgb.iter().map(value).collect();
            let worst = values.iter().copied().fold(0.0, f64::max);
            let map = HeatMap {
                low: 1e-8,
                high: 1e-2,
                logarithmic: true,
            };
            let caption = format!("{name}{times}: {worst:.1e} at worst");
            pictures.push(scalars(side, &values, map, &caption)?);
        }
    }
    Ok(Section {
        title: "Peters 2021, Fig. 4".to_owned(),
        lead: "The change of the random number that explains the sample.".to_owned(),
        pictures,
        ..Section::default()
    })
}

/// Draws figure 4 of Salesin & Jarosz 2019: the weights of BSDF samples over a light behind two
/// triangles.
fn weights(context: &Context<'_>) -> Result<Section> {
    let side = context.side(256);
    let at = |k: u32| 2.0 * (f64::from(k) + 0.5) / f64::from(side) - 1.0;
    let mut pictures = Vec::new();
    for (smoothing, name) in [
        (Smoothing::None, "without smoothing"),
        (Smoothing::Fixed, "smoothed by one width"),
        (
            Smoothing::Variable,
            "by a width that narrows with what is hidden",
        ),
    ] {
        // Evaluate the weight at the centre of each pixel, the upper row first.
        let row = |y: u32| (0..side).map(move |x| [at(x), -at(y)]);
        let values = (0..side).flat_map(row).map(|at| weight(smoothing, at));
        let values: Vec<f64> = values.collect();
        let map = HeatMap::spanning(&[0.0, 1.0]);
        pictures.push(scalars(side, &values, map, name)?);
    }
    Ok(Section {
        title: "Salesin & Jarosz 2019, Fig. 4".to_owned(),
        lead: "The weight of a BSDF sample beside lines in both directions.".to_owned(),
        pictures,
        ..Section::default()
    })
}

/// The kinds of smoothing of a weight at the ends of visible parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Smoothing {
    /// No smoothing: the balance heuristic.
    None,
    /// Smoothing over one width everywhere.
    Fixed,
    /// Smoothing over a width that is narrower where less is hidden beyond the end (eq. 24).
    Variable,
}

/// The height of the light above the shading point. The light is from −1 to 1 along x and y, and
/// faces the point.
const HEIGHT: f64 = 2.0;

/// The x and y coordinates of the corners of two triangles halfway between the shading point and
/// the light. The parts of the light that the triangles hide are twice as large as the triangles.
pub(crate) const OCCLUDERS: [[[f64; 2]; 3]; 2] = [
    [[-0.42, -0.31], [0.03, -0.12], [-0.27, 0.17]],
    [[0.11, 0.05], [0.44, 0.21], [0.16, 0.36]],
];

/// Returns the visible intervals of a line across the light, as fractions of the line. The line is
/// parallel to x (`axis` 0) or to y (`axis` 1); `offset` is its position along the other axis, from
/// −1 to 1.
pub(crate) fn visible(axis: usize, offset: f64) -> IntervalSet {
    let at = |t: f64| match axis {
        0 => DVec3::new(t, offset, HEIGHT),
        _ => DVec3::new(offset, t, HEIGHT),
    };
    let triangle = ShadowTriangle::new(DVec3::ZERO, &Segment::new(at(-1.0), at(1.0)));
    let mut parts = IntervalSet::full();
    for corners in OCCLUDERS {
        let corners = corners.map(|[x, y]| DVec3::new(x, y, 0.5 * HEIGHT));
        if let Some(hidden) = triangle.as_ref().and_then(|t| t.blocked_by(&corners)) {
            parts.clip(hidden.lo, hidden.hi);
        }
    }
    parts
}

/// Returns the weight of a BSDF sample (cosine lobe, normal towards the light) at (x, y) on the
/// light, when BSDF samples are combined with lines in both directions; zero where the light is
/// hidden, or beyond the light.
pub(crate) fn weight(smoothing: Smoothing, [x, y]: [f64; 2]) -> f64 {
    if x.abs() > 1.0 || y.abs() > 1.0 {
        return 0.0;
    }
    // Half of the light's smaller extent, which the paper recommends.
    const WIDTH: f64 = 1.0;
    let to = DVec3::new(x, y, HEIGHT);
    let cos = HEIGHT / to.length();
    // The densities per area: cos θ/π · cos θ'/r² of the lobe, and eqs. 14 and 15 of lines.
    let mut densities = [cos * cos / (PI * to.length_squared()), 0.0, 0.0];
    let mut factor = 1.0;
    // For each direction, find the visible part of the line through the point, the density of lines
    // there, and the smoothing factor.
    for (axis, [along, offset]) in [[x, y], [y, x]].into_iter().enumerate() {
        let parts = visible(axis, offset);
        let (all, t) = (parts.as_slice(), 0.5 * (along + 1.0));
        let Some(k) = all.iter().position(|p| p.lo <= t && t <= p.hi) else {
            return 0.0;
        };
        densities[axis + 1] = 0.25 / parts.measure();
        if smoothing == Smoothing::None {
            continue;
        }
        // The hidden fractions on both sides of that part.
        let before = all[k].lo - k.checked_sub(1).map_or(0.0, |j| all[j].hi);
        let after = all.get(k + 1).map_or(1.0, |p| p.lo) - all[k].hi;
        // Ends at the border of the light have no gap; the border has its own factor.
        let [before, after] = [before, after].map(|share| match smoothing {
            Smoothing::Fixed if share > 1e-12 => f64::INFINITY,
            _ => 2.0 * share,
        });
        let [lo, hi] = [all[k].lo, all[k].hi].map(|t| 2.0 * t - 1.0);
        factor *= smoothing::border(along, -1.0, 1.0, WIDTH)
            * smoothing::visible_interval(along, lo, hi, before, after, WIDTH);
    }
    // Weight the BSDF sample by the balance heuristic, smoothed by the factor.
    smoothing::smoothed_balance(&[1.0; 3], &densities, &[factor, 1.0, 1.0], 0)
}
