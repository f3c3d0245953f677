//! Fits the constants of `hybrid` to built-in scenes: `cargo run --release -p linelit-workshop
//! --features programs --example fit_hybrid`, which takes some ten minutes.
//!
//! Each scene is measured as it is, and with plastic and metal in place of its materials, by the
//! methods that `hybrid` chooses among. A rule picks one method for each scene and number of
//! lines; its loss is its time over the least in which any method reaches its error. The program
//! prints the losses, and the constants of the rules whose losses have the least geometric mean.

#![allow(clippy::print_stdout, reason = "a command-line tool talks to its user")]

use anyhow::{Context, Result};
use linelit_formats::LoadOptions;
use linelit_integrator::{Estimator, Renderer, Settings, Spheres, Workspace};
use linelit_scene::SceneDescription;
use linelit_scenes::Library;
use linelit_study::engine::{Contest, ContestPoint, Curve, Problem as _, contest};
use linelit_study::scene_study::{Targets, all_pixels};

/// The scenes that the constants are fitted to.
const SCENES: [&str; 9] = [
    "cornell-box-small",
    "cornell-box-large",
    "grid-planes-small",
    "grid-planes-large",
    "triangle-soup-small",
    "triangle-soup-large",
    "colonnade-small",
    "colonnade-large",
    "monoliths",
];

/// The materials that replace a scene's, as pbrt's text; with the empty one a scene keeps its own.
const MATERIALS: [&str; 5] = [
    "",
    r#""plastic" "float roughness" .05 "bool remaproughness" "false""#,
    r#""plastic" "float roughness" .3 "bool remaproughness" "false""#,
    r#""metal" "float roughness" .05 "bool remaproughness" "false""#,
    r#""metal" "float roughness" .3 "bool remaproughness" "false""#,
];

/// The methods, in the order of their losses.
const NAMES: [&str; 4] = ["exact", "lines", "points", "rays"];
/// The indices of the methods in [`NAMES`].
const EXACT: usize = 0;
const LINES: usize = 1;
const POINTS: usize = 2;
const RAYS: usize = 3;

/// Returns the estimators of the methods, with their samples for this many lines. Surfaces that are
/// not diffuse use points by LTC.
fn methods(is_diffuse: bool, lines: u32) -> [(String, u32); 4] {
    let (by, with_region) = match is_diffuse {
        true => ("point-area", lines),
        false => ("point-ltc", (4 * lines).max(16)),
    };
    [
        ("exact".to_owned(), with_region),
        ("line-analytic".to_owned(), lines),
        (format!("{by}[visibility=shaft]"), 4 * lines),
        (by.to_owned(), 4 * lines),
    ]
}

/// The numbers of lines.
const COUNTS: [u32; 4] = [1, 4, 16, 64];

/// The measurement of one scene, material and number of lines.
struct Row {
    name: String,
    lines: f64,
    is_diffuse: bool,
    /// Whether the material is diffuse or its lobes are wide.
    is_smooth: bool,
    is_dense: bool,
    triangles: f64,
    edges: f64,
    line_cost: f64,
    /// The time of each method over the least time in which any reaches its error.
    losses: [f64; 4],
    /// The same ratio of `hybrid` itself, compared with the other methods; zero where no other
    /// reaches its error.
    hybrid: f64,
}

/// The constants of the rules.
#[derive(Clone, Copy, Debug)]
struct Constants {
    lines_for_a_triangle: f64,
    triangles_with_cosines: f64,
    lines_if_dense: f64,
    rays_for_lines: f64,
}

/// The constants that `hybrid` has.
const CURRENT: Constants = Constants {
    lines_for_a_triangle: 1.3,
    triangles_with_cosines: 6.0,
    lines_if_dense: 8.0,
    rays_for_lines: 3.0,
};

impl Constants {
    /// Returns the method that the rules pick by the statistics of a light, as `hybrid` does.
    fn pick(&self, row: &Row) -> usize {
        // Where occlusion is dense, rays are faster than a few lines, and than any lines on
        // surfaces that are not diffuse.
        let few = row.lines < self.lines_if_dense.max(row.line_cost / self.rays_for_lines);
        if row.is_dense && (few || !row.is_diffuse) {
            return RAYS;
        }
        // The visible region is worth computing if few triangles are in the way.
        let region = match row.is_smooth {
            true => (self.lines_for_a_triangle + row.edges) * row.triangles <= row.lines,
            false => row.triangles <= self.triangles_with_cosines * (4.0 * row.lines).max(16.0),
        };
        // Otherwise lines, if there are enough of them or the lobes are wide.
        let takes_lines = match row.is_diffuse {
            true => row.lines >= 4.0 || row.is_dense,
            false => row.is_smooth,
        };
        match (region && !row.is_dense, takes_lines) {
            (true, _) => EXACT,
            (false, true) => LINES,
            (false, false) => POINTS,
        }
    }

    /// Returns the geometric mean of the losses, and the largest.
    fn loss(&self, rows: &[Row]) -> [f64; 2] {
        let losses = || rows.iter().map(|row| row.losses[self.pick(row)]);
        let mean = losses().map(f64::ln).sum::<f64>() / rows.len() as f64;
        [mean.exp(), losses().fold(0.0, f64::max)]
    }
}

/// Measures, prints the losses, and searches a grid of constants around the current ones.
fn main() -> Result<()> {
    // Measure.
    let mut rows = Vec::new();
    for scene in SCENES {
        for material in MATERIALS {
            measure(scene, material, &mut rows)?;
        }
    }
    // Print the losses of the current constants.
    println!("scene, material, lines: losses of exact, lines, points, rays; picked");
    for row in &rows {
        let picked = NAMES[CURRENT.pick(row)];
        let losses = row.losses;
        println!(
            "{}: {losses:6.2?}; {picked}; hybrid {:.2}",
            row.name, row.hybrid
        );
    }
    let mut best = (CURRENT, CURRENT.loss(&rows));
    println!("{CURRENT:?}: mean and largest loss {:.3?}", best.1);
    // Search for constants with less loss.
    for lines_for_a_triangle in [0.3, 0.65, 1.3, 2.6, 5.2] {
        for triangles_with_cosines in [1.5, 3.0, 6.0, 12.0, 24.0] {
            for lines_if_dense in [2.0, 4.0, 8.0, 16.0, 32.0] {
                for rays_for_lines in [0.75, 1.5, 3.0, 6.0, 12.0] {
                    let constants = Constants {
                        lines_for_a_triangle,
                        triangles_with_cosines,
                        lines_if_dense,
                        rays_for_lines,
                    };
                    let loss = constants.loss(&rows);
                    if loss[0] < best.1[0] {
                        best = (constants, loss);
                    }
                }
            }
        }
    }
    println!("{:?}: mean and largest loss {:.3?}", best.0, best.1);
    Ok(())
}

/// Returns the times and errors of all methods, and of `hybrid`.
fn compete(targets: &Targets<'_>, is_diffuse: bool) -> Result<Vec<Curve<Settings>>> {
    let settings = |text: &str| -> Result<Settings> {
        let estimator = text.parse::<Estimator>().context("a method")?;
        Ok(Settings {
            estimator,
            ..Settings::default()
        })
    };
    // List the methods, with the distinct numbers of samples that the numbers of lines come to.
    let mut entries = Vec::new();
    for method in 0..NAMES.len() {
        let of = |lines: u32| methods(is_diffuse, lines)[method].1;
        let mut samples = COUNTS.map(of).to_vec();
        samples.dedup();
        entries.push((settings(&methods(is_diffuse, 1)[method].0)?, samples));
    }
    entries.push((settings("hybrid")?, COUNTS.to_vec()));
    // Compare them with the exact value.
    let (exact, mut workspace) = (settings("exact")?, Workspace::new());
    let truth = |k| targets.estimate(&exact, 4096, u64::MAX, k, &mut workspace);
    let what = Contest {
        entries,
        rounds: 3,
        truth: (0..targets.points.len()).map(truth).collect(),
    };
    Ok(contest(targets, &what))
}

/// Measures all methods at all numbers of lines on a scene, in a material.
fn measure(name: &str, material: &str, rows: &mut Vec<Row>) -> Result<()> {
    let mut scene = Library::default().load_lit(name)?.scene;
    scene.set_resolution(24, 18);
    if !material.is_empty() {
        coat(&mut scene, material)?;
    }
    let is_diffuse = material.is_empty();
    let renderer = Renderer::new(&scene);
    let targets = Targets::find(&renderer, &all_pixels(24, 18));
    let curves = compete(&targets, is_diffuse)?;
    // The rules read the occlusion of the first light.
    let lights = renderer.plan().lights_of(Spheres::Exact);
    let occlusion = lights.first().context("a light")?.occlusion;
    // Divide the time of each method by the least time in which any reaches its error.
    let best = |point: &ContestPoint| {
        let others = curves[..NAMES.len()].iter();
        let times = others.filter_map(|curve| curve.time_to(point.mse));
        times.fold(f64::INFINITY, f64::min)
    };
    let losses = |lines: u32| {
        let methods = methods(is_diffuse, lines);
        [EXACT, LINES, POINTS, RAYS].map(|method| {
            let samples = methods[method].1;
            let point = curves[method].points.iter().find(|p| p.samples == samples);
            let point = point.expect("all numbers of samples were measured");
            point.time / best(point)
        })
    };
    for (lines, hybrid) in COUNTS.into_iter().zip(&curves[NAMES.len()].points) {
        rows.push(Row {
            hybrid: hybrid.time / best(hybrid),
            name: format!("{name} {} {lines}", material.replace('"', "")),
            lines: f64::from(lines),
            is_diffuse,
            is_smooth: is_diffuse || material.contains("roughness\" .3"),
            is_dense: occlusion.dense,
            triangles: occlusion.candidates,
            edges: occlusion.edges,
            line_cost: occlusion.line_cost,
            losses: losses(lines),
        });
    }
    Ok(())
}

/// Gives all surfaces of a scene one material.
fn coat(scene: &mut SceneDescription, material: &str) -> Result<()> {
    let text = format!("WorldBegin\nMaterial {material}\nShape \"disk\"");
    let options = LoadOptions::default();
    let loaded = linelit_formats::from_pbrt_str(&text, "material.pbrt", &options)?;
    let coat = loaded.scene.materials.last().context("a material")?;
    for material in &mut scene.materials {
        *material = coat.clone();
    }
    Ok(())
}
