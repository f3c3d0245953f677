//! The program on every instruction set that the processor has: the same pictures, the same work.

use crate::common::{folder, linelit, path, succeeded, text};
use linelit_film::Image;
use linelit_simd::InstructionSet;
use std::path::Path;

/// Scenes of few and of many triangles, with shafts of every kind, next to estimators that use
/// every kernel: rays, shafts, dense walks, lines in closed form, lobes.
const RENDERS: [(&str, &str); 17] = [
    ("strips", "line-analytic"),
    ("strips", "line-solid-angle:3+point-bsdf[mis=smooth]"),
    ("cornell-box", "exact"),
    ("cornell-box", "point-solid-angle"),
    // If boxes are rounded differently, rays meet occluders in another order.
    ("strips", "point-solid-angle"),
    ("triangle-soup-large", "point-solid-angle"),
    ("grid-planes", "line-analytic[orientation=uniform]"),
    ("grid-planes", "hybrid"),
    ("logo-large", "line-analytic[orientation=origin]"),
    ("triangle-soup", "line-area+point-area"),
    ("triangle-soup", "exact"),
    ("triangle-soup-large", "line-analytic"),
    ("triangle-soup-large", "point-area[visibility=shaft]"),
    ("logo-large", "line-analytic"),
    ("logo-small", "exact"),
    ("cornell-box-line", "line-analytic"),
    ("plates", "hybrid+point-bsdf"),
];

/// The bits of a picture.
fn pixels(path: &Path) -> Vec<u32> {
    let image = Image::read(path).unwrap();
    image
        .rgb
        .into_flattened()
        .into_iter()
        .map(f32::to_bits)
        .collect()
}

/// Numbers of a report without its times.
fn counts(json: &str) -> serde_json::Value {
    let mut value: serde_json::Value = serde_json::from_str(json).unwrap();
    let fields = value.as_object_mut().unwrap();
    let before = fields.len();
    fields.retain(|name, _| !name.contains("seconds") && name != "output");
    assert!(fields.len() < before && fields.len() > 3, "{fields:?}");
    value
}

#[test]
fn pictures_and_counters_are_the_same() {
    let dir = folder("isa");
    let available: Vec<_> = InstructionSet::ALL
        .into_iter()
        .filter(|s| s.is_available())
        .collect();
    for (scene, estimator) in RENDERS {
        let render = |set: &InstructionSet| {
            let image = dir.join(format!("{set}.exr"));
            let output = succeeded(&[
                "render",
                scene,
                "-o",
                path(&image),
                "--estimator",
                estimator,
                "--samples",
                "5",
                "--resolution",
                "64x48",
                "--json",
                "--isa",
                &set.to_string(),
            ]);
            (pixels(&image), counts(&text(&output.stdout)))
        };
        let results: Vec<_> = available.iter().map(render).collect();
        for (set, (image, counts)) in available.iter().zip(&results) {
            assert_eq!(counts, &results[0].1, "{scene} by {estimator} on {set}");
            assert!(
                image == &results[0].0,
                "{scene} by {estimator} on {set}: another picture"
            );
        }
    }
}

#[test]
fn what_is_not_there_is_refused() {
    for set in InstructionSet::ALL {
        let name = set.to_string();
        let output = linelit(&["--isa", &name, "info", "cornell-box"]);
        let message = text(&output.stderr);
        if set.is_available() {
            assert!(output.status.success(), "{message}");
        } else {
            assert_eq!(output.status.code(), Some(2));
            assert!(
                message.contains(&format!("this processor has no {set}")),
                "{message}"
            );
        }
    }
    let output = linelit(&["info", "cornell-box", "--isa", "sse9"]);
    assert_eq!(output.status.code(), Some(2));
    let message = text(&output.stderr);
    assert!(
        message.contains("expected scalar, avx2 or avx512"),
        "{message}"
    );
}
