//! Scenes in the files that people have: the same picture from each, and files of other folders.

use crate::common::{folder, linelit, path, succeeded, text};
use linelit_film::Image;
use linelit_formats::{LoadOptions, Loaded};
use std::path::Path;

/// The picture of a scene file, and the messages.
fn render(scene: &str, image: &Path, more: &[&str]) -> Image {
    let arguments = ["render", scene, "-o", path(image), "--samples", "4"];
    succeeded(&[&arguments[..], more].concat());
    Image::read(image).unwrap()
}

/// How many pixels differ in any bit.
fn different(a: &Image, b: &Image) -> usize {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let pixels = (0..a.height).flat_map(|y| (0..a.width).map(move |x| (x, y)));
    pixels
        .filter(|&(x, y)| a.get(x, y).map(f32::to_bits) != b.get(x, y).map(f32::to_bits))
        .count()
}

fn strictly(file: &str) -> Loaded {
    let strict = LoadOptions {
        strict: true,
        ..LoadOptions::default()
    };
    linelit_formats::load(file, &strict).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn one_cornell_box_in_four_formats_is_one_picture() {
    let dir = folder("formats");
    let image = dir.join("box.exr");
    let want = render("tests/cornell/v3.pbrt", &image, &["--strict"]);
    assert!(want.mean().iter().all(|c| *c > 0.05), "{:?}", want.mean());
    let v4 = render("tests/cornell/v4.pbrt", &image, &["--strict"]);
    assert_eq!(different(&v4, &want), 0, "pbrt v4");

    // The others' cameras differ: glTF's angle is in radians over the height, OBJ has none. The
    // triangles are the same to the bit.
    let v3 = strictly("tests/cornell/v3.pbrt").scene;
    for file in ["tests/cornell/box.gltf", "tests/cornell/box.obj"] {
        let scene = strictly(file).scene;
        assert_eq!(scene.triangles.len(), v3.triangles.len(), "{file}");
        for t in 0..u32::try_from(v3.triangles.len()).unwrap() {
            let [a, b] =
                [&scene, &v3].map(|s| s.corners(t).map(|p| p.to_array().map(f64::to_bits)));
            assert_eq!(a, b, "{file}: triangle {t}");
        }
    }

    // glTF through its own camera: rays within 1e-14 of the others, so that a pixel may only
    // change where its ray grazes an edge, or in the last bit of f32.
    let gltf = render(
        "tests/cornell/box.gltf",
        &image,
        &["--strict", "--resolution", "96x96"],
    );
    let changed = different(&gltf, &want);
    assert!(changed * 100 <= 96 * 96, "glTF's own camera: {changed}");
}

/// A scene may name only files of its folder.
#[test]
fn files_of_other_folders_are_read_if_it_is_allowed() {
    let dir = folder("folders");
    std::fs::create_dir_all(dir.join("inner")).unwrap();
    std::fs::write(dir.join("part.pbrt"), "Shape \"sphere\"").unwrap();
    let outer = dir.join("inner/outer.pbrt");
    std::fs::write(&outer, "WorldBegin Include \"../part.pbrt\"").unwrap();
    for (more, code) in [
        (&[][..], 1),
        (&["--allow-outside"], 0),
        (&["--root", path(&dir)], 0),
        (&["--root", path(&dir), "--allow-outside"], 2),
    ] {
        let output = linelit(&[&["info", path(&outer)][..], more].concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{more:?} {said}");
    }
}

#[test]
fn info_says_what_is_in_a_scene() {
    let output = succeeded(&["info", "tests/cornell/v3.pbrt", "--json"]);
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(value["triangles"], 36);
    assert_eq!(value["lights"]["quad"]["lights"], 1);
    // 0.8 × 0.8 × π × (12 + 9 + 6) / 3, the corners rounded to f32.
    let power = value["lights"]["quad"]["power"].as_f64().unwrap();
    assert!(
        (power - 0.64 * std::f64::consts::PI * 9.0).abs() < 1e-5,
        "{power}"
    );
    assert_eq!(value["materials"]["matte"]["triangles"], 36);
    let pairs = value["plan"]["counts"]["(point, light) pairs"].as_u64();
    assert!(pairs.unwrap() > 1000, "{value}");
    let table = text(&linelit(&["info", "tests/cornell/v3.pbrt"]).stdout);
    assert!(
        table.contains("1 quad, area 0.6400 m², power 18.0956 W"),
        "{table}"
    );
}
