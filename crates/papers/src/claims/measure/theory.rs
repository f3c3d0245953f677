//! What theory says of points and lines where nothing, or one edge, stands before a light, and what
//! the choice of a line's direction and offset does (Billen & Dutré 2016, §3 and Figs. 2 and 3).

use super::super::bench::{Ask, Bench, Figures};
use crate::measured::{Measured, largest};
use anyhow::Result;
use linelit_integrator::Renderer;
use linelit_samplers::SamplerKind;
use linelit_study::scene_study::{Spot, StudySpec, Targets};

/// A diffuse floor under a light and nothing else.
const BARE: &str = "LookAt 0 3 -5  0 0 0.5  0 1 0
Camera \"perspective\" \"float fov\" [ 40 ]
Film \"rgb\" \"integer xresolution\" [ 8 ] \"integer yresolution\" [ 8 ]
WorldBegin
AttributeBegin
Material \"diffuse\" \"rgb reflectance\" [ 0.7 0.7 0.7 ]
Shape \"trianglemesh\" \"point3 P\" [ -9 0 -9 -9 0 9 9 0 9 9 0 -9 ] \"integer indices\" [ 0 1 2 0 2 3 ]
AttributeEnd
AttributeBegin
Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]
AreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ]
Shape \"trianglemesh\" \"point3 P\" [ -1 2 -1 1 2 -1 1 2 1 -1 2 1 ] \"integer indices\" [ 0 1 2 0 2 3 ]
AttributeEnd
";

/// A screen with one slanted edge halfway between the floor and the light.
const SCREEN: &str = "AttributeBegin
Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]
Shape \"trianglemesh\" \"point3 P\" [ -9 1 -9 -9 1 9 0.9 1 9 -0.4 1 -9 ] \"integer indices\" [ 0 1 2 0 2 3 ]
AttributeEnd
";

const SAMPLES: [u32; 5] = [4, 16, 64, 256, 1024];

/// Orders that theory knows, and equalities that have no exception.
pub(super) fn run(bench: &Bench<'_>) -> Result<Figures> {
    let mut figures = Figures::new();
    let bare = bench.text(BARE)?;
    bench.on_grid(bare, [8, 8], |targets| {
        unhidden(bench, targets, &mut figures)
    })?;
    let screened = bench.text(&(BARE.to_owned() + SCREEN))?;
    bench.on_grid(screened, [8, 8], |targets| {
        half_hidden(bench, targets, &mut figures)
    })?;
    Ok(figures)
}

fn unhidden(bench: &Bench<'_>, targets: &Targets<'_>, figures: &mut Figures) -> Result<()> {
    let mut add = |name: &str, estimator, sampler| -> Result<()> {
        let order = bench.order(targets, estimator, sampler, &SAMPLES, 12)?;
        figures.insert(format!("unhidden/{name}"), order);
        Ok(())
    };
    // Along an edge of the light all lines are as long: no kink of their length.
    let lines = "line-analytic[orientation=fixed:0,control=none]";
    add("random point", "point-area", SamplerKind::Independent)?;
    add("stratified point", "point-area", SamplerKind::Stratified)?;
    add("stratified line", lines, SamplerKind::Stratified)?;
    add("low-discrepancy point", "point-area", SamplerKind::Sobol)?;
    let each = "line-analytic[orientation=uniform]";
    add("direction of each line", each, SamplerKind::Stratified)?;
    // One point of a line that is all visible is a point like any other.
    let ask = |estimator| Ask {
        estimator,
        sampler: SamplerKind::Independent,
        samples: 4,
        trials: 96,
    };
    let names = [
        "point-area",
        "line-area[orientation=fixed:0,pieces=one]",
        "point-solid-angle",
        "line-solid-angle[orientation=fixed:0,pieces=one]",
    ];
    let found = bench.ask(targets, &names.map(ask))?;
    let [points, lines, by_angle, lines_by_angle] = &found[..] else {
        return Ok(());
    };
    figures.insert(
        "line as point, area".to_owned(),
        lines.variance_ratio(points),
    );
    let ratio = lines_by_angle.variance_ratio(by_angle);
    figures.insert("line as point, solid angle".to_owned(), ratio);
    let gain = by_angle.variance_ratio(points);
    figures.insert("solid angle over area, unhidden".to_owned(), gain);
    Ok(())
}

fn half_hidden(bench: &Bench<'_>, targets: &Targets<'_>, figures: &mut Figures) -> Result<()> {
    let ask = |estimator| Ask {
        estimator,
        sampler: SamplerKind::Independent,
        samples: 8,
        trials: 96,
    };
    let names = [
        "point-area",
        "point-solid-angle",
        "line-area[orientation=parallel]",
        "line-solid-angle",
        "line-analytic[orientation=parallel,control=none]",
        "line-analytic[orientation=parallel,offset=uniform,control=none]",
        "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5]",
        "line-solid-angle[orientation=fixed:0]+point-bsdf",
        "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=smooth]",
        "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=smooth-fixed]",
    ];
    let found = bench.ask(targets, &names.map(ask))?;
    let worst = found.iter().map(|a| a.bias_z.abs()).fold(0.0, f64::max);
    figures.insert("bias of all".to_owned(), Measured::exact(worst));
    if let [.., by_area, _, analytic, _, _, _, _, _] = &found[..] {
        let ratio = analytic.variance_ratio(by_area);
        figures.insert("closed form over a point of a line".to_owned(), ratio);
    }
    // Where the edge is seen before the light.
    let partly = bench.noisy(targets, "point-projected-solid-angle")?;
    let mut add = |name: &str, estimator, sampler| -> Result<()> {
        let order = if partly.points.is_empty() {
            Measured::UNKNOWN
        } else {
            bench.order(&partly, estimator, sampler, &SAMPLES, 12)?
        };
        figures.insert(format!("half hidden/{name}"), order);
        Ok(())
    };
    add("stratified point", "point-area", SamplerKind::Stratified)?;
    let lines = "line-analytic[orientation=fixed:0.3,control=none]";
    add("stratified line", lines, SamplerKind::Stratified)?;
    add("random line", lines, SamplerKind::Independent)
}

/// Figs. 2 and 3: what a direction for each point, for each line, or for all does, and where
/// offsets go in proportion to length.
pub(super) fn directions(bench: &Bench<'_>) -> Result<Figures> {
    let mut figures = Figures::new();
    let room = bench.scene("cornell-box-large")?;
    bench.on_grid(room, [16, 16], |targets| {
        for (name, orientation) in [
            ("fixed", "fixed:0"),
            ("for each line", "uniform"),
            ("for each point", "parallel"),
        ] {
            let estimator = format!("line-analytic[orientation={orientation},control=none]");
            let samples = &SAMPLES[..4];
            let order = bench.order(targets, &estimator, SamplerKind::Stratified, samples, 12)?;
            figures.insert(format!("direction/{name}"), order);
        }
        Ok(())
    })?;
    let soup = bench.scene("triangle-soup-large")?;
    bench.on_grid(soup, [16, 16], |targets| {
        let ask = |estimator| Ask {
            estimator,
            sampler: SamplerKind::Independent,
            samples: 16,
            trials: 16,
        };
        let found = bench.ask(
            targets,
            &[
                ask("line-analytic[orientation=parallel,control=none]"),
                ask("line-analytic[orientation=parallel,offset=uniform,control=none]"),
            ],
        )?;
        let ratio = found[0].variance_ratio(&found[1]).map(f64::sqrt);
        figures.insert("offsets by length over uniform".to_owned(), ratio);
        Ok(())
    })?;
    artefacts(bench, &mut figures)?;
    Ok(figures)
}

/// The same two shadow edges, one along the lines and one across: with one direction for all, and
/// with one for each point.
fn artefacts(bench: &Bench<'_>, figures: &mut Figures) -> Result<()> {
    let scene = bench.scene("floating-quad")?;
    let renderer = Renderer::new(&scene);
    let spots = floating_quad().spots;
    for (name, estimator) in [
        ("fixed", "line-analytic[orientation=fixed:0,control=none]"),
        (
            "for each point",
            "line-analytic[orientation=parallel,control=none]",
        ),
    ] {
        let ask = Ask {
            estimator,
            sampler: SamplerKind::Stratified,
            samples: bench.pick(4, 64, 64),
            // The direction of a point's lines is drawn anew by each seed.
            trials: bench.pick(4, 256, 256),
        };
        let beside = |spot: &Spot| {
            let targets = Targets::find(&renderer, &[spot.pixel]);
            bench.ask(&targets, &[ask])
        };
        let found = spots.iter().map(beside);
        let found = found.collect::<Result<Vec<_>>>()?.concat();
        if let [a, b] = &found[..] {
            // Which of both edges is the better one is the light's affair.
            let either = [a.variance_ratio(b), b.variance_ratio(a)];
            if let Some(ratio) = largest(either) {
                figures.insert(format!("two edges/{name}"), ratio.map(f64::sqrt));
            }
        }
    }
    Ok(())
}

/// A quad afloat whose edges are the light's, with a pixel beside each of two of them.
fn floating_quad() -> StudySpec {
    crate::salesin::spec("salesin-fig5", None).unwrap_or_default()
}
