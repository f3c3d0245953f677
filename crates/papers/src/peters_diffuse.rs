//! Peters 2021, Figs. 4 and 6: a diffuse room under a linear light.

use crate::picture_study::{
    Context, PictureStudy, Row, exposed, logarithmic, render_with, rmse, section, table,
};
use anyhow::{Result, bail};
use linelit_bsdf::Reflection;
use linelit_elementary::atan2;
use linelit_film::{Image, Tile};
use linelit_geometry::{DVec3, Segment};
use linelit_integrator::{Renderer, Settings, ShadingPoint, Workspace};
use linelit_lights::Light;
use linelit_lights::linear::{LinearTechnique, ProjectedLine};
use linelit_samplers::{Sampler, SamplerKind};
use linelit_study::scene_study;
use linelit_testkit::peters_as_printed::sample_as_printed;

/// Side of the pictures in pixels.
const SIZE: u32 = 256;
/// The scene.
const SCENE: &str = "cornell-box-line";
/// Seeds over which variances are taken.
const TRIALS: u64 = 8;

/// Settings of one technique.
fn settings(estimator: &str, seed: u64) -> Result<Settings> {
    Ok(Settings {
        estimator: estimator.parse()?,
        sampler: SamplerKind::BlueNoise,
        samples: 1,
        seed,
        show_lights: false,
        ..Settings::default()
    })
}

/// Panel of the paper's figure that shows a technique.
fn source(technique: LinearTechnique) -> &'static str {
    match technique {
        LinearTechnique::Area => "(a) area",
        LinearTechnique::SolidAngle => "(c) solid angle",
        LinearTechnique::ClippedSolidAngle => "(d) clipped solid angle",
        LinearTechnique::LinearCosine => "(e) linear cosine warp",
        LinearTechnique::QuadraticCosine => "(f) quadratic cosine warp",
        LinearTechnique::NewtonBisection => "(g) projected solid angle by Newton-bisection",
        LinearTechnique::ProjectedSolidAngle => "(h) projected solid angle",
    }
}

/// Fig. 6: every technique with one sample a pixel, against the closed form over what is visible.
pub(super) fn figure_6(context: &Context<'_>) -> Result<PictureStudy> {
    let mut scene = context.library.load(SCENE)?.scene;
    let size = context.size([SIZE; 2]);
    scene.set_resolution(size[0], size[1]);
    let renderer = Renderer::new(&scene);
    let render =
        |settings: &Settings| render_with(&renderer, settings, size, context.progress, |_| {});
    let exact = render(&settings("line-analytic", 0)?);
    let lit = outside_penumbrae(&renderer, context)?;
    let mut pictures = vec![exposed(
        &exact,
        &exact,
        "(b) reference: closed form, exact",
    )?];
    let mut rows = Vec::new();
    for technique in LinearTechnique::ALL {
        let name = format!("point-linear[technique={}]", technique.name());
        let images: Vec<Image> = (0..TRIALS)
            .map(|k| Ok(render(&settings(&name, context.seed.wrapping_add(k))?)))
            .collect::<Result<_>>()?;
        let mean =
            |f: &dyn Fn(&Image) -> f64| images.iter().map(f).sum::<f64>() / images.len() as f64;
        let error = mean(&|i| rmse(i, &exact).powi(2)).sqrt();
        let (clear, worst) = clear_error(&images, &exact, &lit);
        let caption = format!("{}: RMSE {error:.4}", source(technique));
        pictures.push(exposed(&images[0], &exact, &caption)?);
        rows.push(Row::new(
            technique.name(),
            &[
                ("RMSE", error),
                ("RMSE outside penumbrae", clear),
                ("worst relative error outside", worst),
            ],
        ));
    }
    let share = 100.0 * lit.iter().filter(|l| **l).count() as f64 / lit.len() as f64;
    let columns = [
        "RMSE",
        "RMSE outside penumbrae",
        "worst relative error outside",
    ];
    let caption = format!(
        "One sample a pixel, blue noise; errors over {TRIALS} seeds, against the closed form. {share:.1} % of the pixels see all or nothing of the light."
    );
    let tables = vec![table(&caption, &columns, &rows)];
    let lead = outside_sentence(&rows);
    Ok(PictureStudy {
        title: "Linear lights, diffuse: Peters 2021, Fig. 6".to_owned(),
        summary: vec![lead],
        sections: vec![section("Fig. 6", "", pictures, tables)],
        rows,
    })
}

/// Relative errors below this are rounding of pictures in `f32`: half an ulp, 6e-8, and a few more
/// of sums.
const ROUNDING: f64 = 1e-6;

/// Which techniques are exact outside penumbrae, and how wrong the best of the others is.
fn outside_sentence(rows: &[Row]) -> String {
    let value = |row: &Row, name| row.values.get(name).copied().unwrap_or(f64::NAN);
    let worst = |row: &Row| value(row, "worst relative error outside");
    let (exact, others): (Vec<&Row>, Vec<&Row>) = rows.iter().partition(|r| worst(r) < ROUNDING);
    let names: Vec<String> = exact
        .iter()
        .map(|r| format!("{} ({:.0e} at worst)", r.what, worst(r)))
        .collect();
    let outside = |r: &&&Row| value(r, "RMSE outside penumbrae");
    let best = others
        .iter()
        .min_by(|a, b| outside(a).total_cmp(&outside(b)));
    let best = best.map_or(String::new(), |r| {
        format!(
            " The best of the others there is {}, with an RMSE of {:.4} of {:.4} over the picture.",
            r.what,
            value(r, "RMSE outside penumbrae"),
            value(r, "RMSE")
        )
    });
    format!(
        "A Lambertian room under a linear light just below the ceiling, each technique with one sample a pixel. Outside \
         penumbrae {} of {} techniques are exact but for rounding: {}.{best}",
        exact.len(),
        rows.len(),
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(", ")
        },
    )
}

/// The pixels where all or nothing of the light is seen: its light is the unhidden one, or none.
fn outside_penumbrae(renderer: &Renderer<'_>, context: &Context<'_>) -> Result<Vec<bool>> {
    let exact = settings("line-analytic", 0)?;
    let shade = |pixel: [u32; 2], workspace: &mut Workspace| {
        let Some(point) = renderer.shading_point(pixel, workspace) else {
            return DVec3::ONE;
        };
        let whole = unhidden(renderer, &point);
        let light = renderer.direct(&exact, &point, pixel, 0, workspace).x;
        // Both are closed forms, to some 1e-13.
        let all = (light - whole).abs() <= 1e-10 * whole;
        DVec3::splat(f64::from(u8::from(all || light <= 0.0)))
    };
    let [width, height] = context.size([SIZE; 2]);
    let window = Tile::whole(width, height);
    let (image, _) = scene_study::map(window, context.progress, shade);
    Ok(image.rgb.iter().map(|p| p[0] > 0.5).collect())
}

/// Unoccluded radiance of the line at a diffuse point, first channel.
fn unhidden(renderer: &Renderer<'_>, point: &ShadingPoint) -> f64 {
    let light = renderer.plan().lights().first().map(|l| *l.light);
    let Some(Light::Linear(light)) = light else {
        return 0.0;
    };
    let ends = [light.segment.p0, light.segment.p1].map(|p| p - point.position);
    let line = ProjectedLine::new(ends[0], ends[1], point.normal);
    let f = point
        .bsdf
        .eval(point.normal, point.outgoing, point.normal)
        .x;
    line.map_or(0.0, |l| {
        l.projected_solid_angle() * f * light.radiance_radius.x
    })
}

/// Root mean squared and worst relative error over the marked pixels of all images.
fn clear_error(images: &[Image], exact: &Image, marked: &[bool]) -> (f64, f64) {
    let (mut sum, mut count, mut worst) = (0.0, 0.0, 0.0_f64);
    for image in images {
        for ((p, q), clear) in image.rgb.iter().zip(&exact.rgb).zip(marked) {
            if !clear {
                continue;
            }
            for (a, b) in p.iter().zip(q) {
                let (a, b) = (f64::from(*a), f64::from(*b));
                sum += (a - b).powi(2);
                count += 1.0;
                if b > 0.0 {
                    worst = worst.max((a / b - 1.0).abs());
                }
            }
        }
    }
    (f64::sqrt(sum / count), worst)
}

/// Fig. 4: backward errors, as printed in single precision and ours, alone and times the
/// brightness.
pub(super) fn figure_4(context: &Context<'_>) -> Result<PictureStudy> {
    let mut scene = context.library.load(SCENE)?.scene;
    let size = context.size([SIZE; 2]);
    scene.set_resolution(size[0], size[1]);
    let Some(Light::Linear(light)) = scene.lights.first().map(|l| *l.light) else {
        bail!("`{SCENE}` has no linear light");
    };
    // Cut in half, to keep away from the wall.
    let line = light.segment.piece(0.0, 0.5);
    let renderer = Renderer::new(&scene);
    let numbers = Sampler::new(SamplerKind::Independent, context.seed);
    let measure = |pixel: [u32; 2], workspace: &mut Workspace| {
        let Some(point) = renderer.shading_point(pixel, workspace) else {
            return DVec3::ZERO;
        };
        let set = numbers.points(pixel, 0, PER_PIXEL);
        let all = (0..PER_PIXEL).filter_map(|i| errors(&line, &point, set.get_1d(i)));
        all.fold(DVec3::ZERO, DVec3::max)
    };
    let window = Tile::whole(size[0], size[1]);
    let (image, _) = scene_study::map(window, context.progress, measure);
    let channel = |c: usize| -> Vec<f64> { image.rgb.iter().map(|p| f64::from(p[c])).collect() };
    let (printed, ours, bright) = (channel(0), channel(1), channel(2));
    let most = bright.iter().copied().fold(0.0, f64::max);
    let times =
        |e: &[f64]| -> Vec<f64> { e.iter().zip(&bright).map(|(e, b)| e * b / most).collect() };
    let maps = [
        ("as printed", printed.clone()),
        ("ours", ours.clone()),
        ("as printed, times brightness", times(&printed)),
        ("ours, times brightness", times(&ours)),
    ];
    let (mut pictures, mut rows) = (Vec::new(), Vec::new());
    for (name, values) in &maps {
        pictures.push(logarithmic(size, values, [1e-8, 1e-2], name)?);
        rows.push(summary(name, values));
    }
    let value = |k: usize, name| rows[k].values.get(name).copied().unwrap_or(f64::NAN);
    let lead = format!(
        "The backward error, the change of the random number that explains the output, of diffuse samples. As \
         printed, in f32, it is {:.0e} at worst and {:.0e} in the median pixel, ours, in f64, {:.0e} and {:.0e}; times the brightness, {:.0e} \
         and {:.0e} at worst. The printed antiderivative is a difference of two at the closest point of the line, ours is \
         anchored at the line's end.",
        value(0, "worst"),
        value(0, "median"),
        value(1, "worst"),
        value(1, "median"),
        value(2, "worst"),
        value(3, "worst"),
    );
    let columns = ["median", "99.9 %", "worst"];
    let caption = format!(
        "The worst of {PER_PIXEL} samples in each pixel; brightness 1 is the brightest pixel's."
    );
    let tables = vec![table(&caption, &columns, &rows)];
    Ok(PictureStudy {
        title: "Linear lights, rounding: Peters 2021, Fig. 4".to_owned(),
        summary: vec![lead],
        sections: vec![section("Fig. 4", "", pictures, tables)],
        rows,
    })
}

/// Samples of each pixel in Fig. 4.
const PER_PIXEL: u32 = 16;

/// Backward errors as printed, in `f32`, and ours, in `f64`, of the same `f32` input, and the
/// projected solid angle; `None` where no light falls.
fn errors(line: &Segment, point: &ShadingPoint, xi: f64) -> Option<DVec3> {
    let narrow = |v: DVec3| v.as_vec3().to_array();
    let [p0, p1] = [line.p0, line.p1].map(|p| narrow(p - point.position));
    let n = narrow(point.normal);
    #[allow(
        clippy::cast_possible_truncation,
        reason = "single precision is the point"
    )]
    let xi = xi as f32;
    let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let exact = ProjectedLine::new(wide(p0), wide(p1), wide(n))?;
    let xi64 = f64::from(xi);
    let ours = exact.sample(xi64);
    let own = if exact.view().is_short() {
        (exact.invert_fractions(ours.lambda, ours.rest) - xi64).abs()
    } else {
        backward(&exact, ours.direction, xi64)
    };
    let printed = sample_as_printed(p0, p1, n, xi).map_or(1.0, |w| backward(&exact, wide(w), xi64));
    Some(DVec3::new(printed, own, exact.projected_solid_angle()))
}

/// The backward error of a direction in the plane of the line; at most one, also for no direction.
pub(crate) fn backward(exact: &ProjectedLine, w: DVec3, xi: f64) -> f64 {
    let (p0, p1) = exact.view().ends();
    let axis = p0.cross(p1).normalize_or_zero();
    let v = atan2(p0.cross(w).dot(axis), p0.dot(w));
    let error = (exact.cdf(v.clamp(0.0, exact.view().angle())) - xi).abs();
    if error <= 1.0 { error } else { 1.0 }
}

fn summary(name: &str, values: &[f64]) -> Row {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |n: usize, d: usize| sorted[(sorted.len() - 1) * n / d];
    Row::new(
        name,
        &[
            ("median", at(1, 2)),
            ("99.9 %", at(999, 1000)),
            ("worst", at(1, 1)),
        ],
    )
}
