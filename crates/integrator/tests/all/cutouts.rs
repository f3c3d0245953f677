//! Holes by masks are compared with holes in the geometry.

use crate::common::load;
use linelit_formats::{LoadOptions, Root};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, Workspace};
use linelit_scene::SceneDescription;
use linelit_testkit::{chi2::sidak, ztest::critical_z};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Arc;

/// The number of texels along a side of the mask.
const SIDE: u32 = 16;

/// Returns whether a texel of the mask is solid; rows count from the top.
fn is_there(x: u32, y: u32) -> bool {
    // The mask is a leaf with veins: an ellipse without some of its texels.
    let [a, b] = [x, y].map(|k| f64::from(k) + 0.5 - 8.0);
    (a * a + 2.0 * b * b < 60.0) && !(x * 7 + y * 13).is_multiple_of(5)
}

/// A floor and its light, seen from below, with the text of `panel` in between.
fn text(panel: &str) -> String {
    format!(
        r#"LookAt 2 -2 0.9  0 0 0  0 0 1
Camera "perspective" "float fov" [ 60 ]
Film "image" "integer xresolution" [ 24 ] "integer yresolution" [ 24 ]
WorldBegin
Material "matte" "rgb Kd" [ 0.7 0.5 0.3 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -3 -3 0  3 -3 0  3 3 0  -3 3 0 ]
{panel}
Material "matte" "rgb Kd" [ 0 0 0 ]
AreaLightSource "diffuse" "rgb L" [ 8 6 4 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
  "point P" [ -0.5 -0.5 2  -0.5 0.5 2  0.5 0.5 2  0.5 -0.5 2 ]"#
    )
}

/// The leaf as a mask on one quadrilateral; `more` is added to its shape.
fn masked(alpha: &str) -> String {
    format!(
        r#"Texture "leaf" "float" "imagemap" "string filename" "leaf.tga" "string filter" "point"
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point2 uv" [ 0 0  1 0  1 1  0 1 ]
"point P" [ -1 -1 1  1 -1 1  1 1 1  -1 1 1 ] "texture {alpha}" "leaf""#
    )
}

/// The leaf as one quadrilateral for each solid texel. Corners are multiples of 1/8, which are
/// exact.
fn cut_out() -> String {
    let mut points = String::new();
    let mut indices = String::new();
    let mut count = 0;
    for y in 0..SIDE {
        for x in (0..SIDE).filter(|x| is_there(*x, y)) {
            let [x, y] = [x, SIDE - 1 - y].map(|k| f64::from(k) / 8.0 - 1.0);
            for [dx, dy] in [[0.0, 0.0], [0.125, 0.0], [0.125, 0.125], [0.0, 0.125]] {
                write!(points, " {} {} 1", x + dx, y + dy).unwrap();
            }
            for k in [0, 1, 2, 0, 2, 3] {
                write!(indices, " {}", count + k).unwrap();
            }
            count += 4;
        }
    }
    assert!(count > 300);
    format!("Shape \"trianglemesh\" \"integer indices\" [{indices} ] \"point P\" [{points} ]")
}

/// A scene whose text may refer to the leaf.
fn with_leaf(text: &str) -> SceneDescription {
    let texels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| [u8::from(is_there(x, y)) * 9; 3]));
    let leaf = linelit_testkit::pictures::tga([SIDE; 2], &texels.collect::<Vec<_>>());
    let files = BTreeMap::from([("leaf.tga".to_owned(), leaf)]);
    let options = LoadOptions {
        root: Root::Memory(Arc::new(files)),
        ..LoadOptions::default()
    };
    let loaded = linelit_formats::from_pbrt_str(text, "test.pbrt", &options);
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

fn picture(scene: &SceneDescription, estimator: &str, samples: u32, seed: u64) -> Vec<DVec3> {
    rendered(scene, estimator, samples, seed, true)
}

/// A picture with every sample taken, since skips depend on the boxes of the hierarchy.
fn unskipped(scene: &SceneDescription, estimator: &str, samples: u32) -> Vec<DVec3> {
    rendered(scene, estimator, samples, 1, false)
}

fn rendered(
    scene: &SceneDescription,
    estimator: &str,
    samples: u32,
    seed: u64,
    skip: bool,
) -> Vec<DVec3> {
    let renderer = Renderer::new(scene);
    let settings = Settings {
        estimator: estimator.parse().expect("an estimator"),
        samples,
        seed,
        skip,
        ..Settings::default()
    };
    let mut workspace = Workspace::new();
    let [width, height] = [scene.film.width, scene.film.height];
    let mut all = Vec::new();
    for y in 0..height {
        let mut row = vec![DVec3::ZERO; width as usize];
        renderer.row(&settings, [0, y], &mut row, &mut workspace);
        all.extend(row);
    }
    all
}

/// The largest difference divided by the largest value.
fn difference(a: &[DVec3], b: &[DVec3]) -> f64 {
    let largest = a.iter().map(|v| v.max_element()).fold(0.0, f64::max);
    assert!(largest > 0.1, "the picture is not black");
    let apart = a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element());
    apart.fold(0.0, f64::max) / largest
}

/// Checks that the panel casts a shadow: more than a few pixels differ from the picture without it.
fn assert_shadow(with: &[DVec3], without: &[DVec3]) {
    let differ = with
        .iter()
        .zip(without)
        .filter(|(a, b)| (**a - **b).length() > 0.01);
    assert!(differ.count() > 50);
}

#[test]
fn masks_cut_what_geometry_cuts() {
    let mask = with_leaf(&text(&masked("alpha")));
    let cut = load(&text(&cut_out()));
    let empty = load(&text(""));
    for (estimator, room) in [
        // The random numbers are the same, and rays hit the same points unless they are within
        // rounding of an edge, which does not happen here.
        ("point-area", 0.0),
        ("point-solid-angle", 0.0),
        // Ends of visible intervals agree to 1e-9 of the line, and there are up to 30 of them on
        // each.
        ("line-analytic", 1e-7),
        ("line-analytic[orientation=fixed:0]", 1e-7),
        ("line-warped", 1e-7),
    ] {
        let [a, b, c] = [&mask, &cut, &empty].map(|scene| unskipped(scene, estimator, 4));
        assert_shadow(&a, &c);
        let apart = difference(&a, &b);
        assert!(apart <= room, "{estimator}: {apart}");
    }
}

/// The z value that is as rare as a value of Student's t with this many degrees of freedom (Wallace
/// 1959), since means of a few trials have heavier tails.
fn normal(t: f64, f: f64) -> f64 {
    (f * (t * t / f).ln_1p()).sqrt() * (8.0 * f + 1.0) / (8.0 * f + 3.0)
}

/// Estimators whose samples past a mask differ from their samples past holes in the geometry
/// converge to the same light.
#[test]
fn other_ways_past_masks_agree_in_the_mean() {
    const SEEDS: u64 = 24;
    let mask = with_leaf(&text(&masked("alpha")));
    let cut = load(&text(&cut_out()));
    let exact = picture(&cut, "exact[limit=1000]", 1, 0);
    let ways = [
        "hybrid",
        "exact",
        "line-warped",
        "line-area+point-bsdf",
        "point-area[visibility=shaft]",
    ];
    let mut worst = 0.0_f64;
    let mut tests = 0;
    for way in ways {
        let pictures: Vec<_> = (0..SEEDS)
            .map(|seed| picture(&mask, way, 4, seed))
            .collect();
        for (k, want) in exact.iter().enumerate() {
            let n = SEEDS as f64;
            let values = pictures.iter().map(|p| p[k].y);
            let mean = values.clone().sum::<f64>() / n;
            let square = values.map(|v| (v - mean) * (v - mean)).sum::<f64>();
            let error = (square / (n * (n - 1.0))).sqrt();
            // Closed forms have no noise but rounding.
            let z = (mean - want.y).abs() / (error + 1e-9);
            worst = worst.max(z);
            tests += 1;
        }
    }
    let z = normal(worst, (SEEDS - 1) as f64);
    let critical = critical_z(sidak(1e-3, tests));
    assert!(z < critical, "{z} of {critical}");
}

#[test]
fn holes_to_lights_alone_are_not_seen() {
    let seen = with_leaf(&text(&masked("alpha")));
    let shadow = with_leaf(&text(&masked("shadowalpha")));
    // From below, the panel is behind the camera, and the shadows are the same.
    let [a, b] = [&seen, &shadow].map(|scene| picture(scene, "line-analytic", 4, 1));
    assert_eq!(a, b);
    // From above, the camera sees the floor through the holes.
    let hits = |scene: &SceneDescription| {
        let renderer = Renderer::new(scene);
        let mut scratch = linelit_visibility::Scratch::new();
        (0..SIDE)
            .flat_map(|y| (0..SIDE).map(move |x| [x, y]))
            .filter(|[x, y]| {
                let at = |k: u32| f64::from(k) / 8.0 - 1.0 + 0.0625;
                let origin = [at(*x), at(SIDE - 1 - y), 1.5];
                let ray = linelit_visibility::Ray::new(origin, [0.0, 0.0, -1.0]);
                let hit = renderer
                    .occluders()
                    .closest_hit(&ray, &mut scratch)
                    .unwrap();
                let on_panel = hit.t < 1.0;
                let surface = scene.surface(hit.triangle, hit.barycentric, -DVec3::Z);
                assert!((surface.point.z - if on_panel { 1.0 } else { 0.0 }).abs() < 1e-12);
                on_panel
            })
            .count()
    };
    let leaf = (0..SIDE * SIDE)
        .filter(|k| is_there(k % SIDE, k / SIDE))
        .count();
    assert_eq!([hits(&seen), hits(&shadow)], [leaf, (SIDE * SIDE) as usize]);
}
