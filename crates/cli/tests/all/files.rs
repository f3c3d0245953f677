//! Scenes in the files that people have: the same picture from each, and through `convert`.

use crate::common::{folder, linelit, path, text};
use linelit_film::Image;
use linelit_formats::{LoadOptions, Loaded};
use std::path::Path;

/// The picture of a scene file, and the messages.
fn render(scene: &str, image: &Path, more: &[&str]) -> Image {
    let arguments = ["render", scene, "-o", path(image), "--samples", "4"];
    let output = linelit(&[&arguments[..], more].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
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
    // scenes are the same to the bit; so are the pictures with the camera of the first.
    let v3 = strictly("tests/cornell/v3.pbrt").scene;
    for file in ["tests/cornell/box.gltf", "tests/cornell/box.obj"] {
        let mut scene = strictly(file).scene;
        assert_eq!(scene.triangles.len(), v3.triangles.len(), "{file}");
        for t in 0..u32::try_from(v3.triangles.len()).unwrap() {
            let [a, b] =
                [&scene, &v3].map(|s| s.corners(t).map(|p| p.to_array().map(f64::to_bits)));
            assert_eq!(a, b, "{file}: triangle {t}");
        }
        scene.camera = v3.camera.clone();
        scene.film = v3.film.clone();
        let copy = dir.join("copy.pbrt");
        let mut out = std::fs::File::create(&copy).unwrap();
        let options = linelit_formats::ExportOptions {
            extensions: true,
            ..Default::default()
        };
        linelit_formats::write_pbrt(&scene, &mut out, &options).unwrap();
        drop(out);
        let got = render(path(&copy), &image, &["--strict"]);
        assert_eq!(different(&got, &want), 0, "{file}");
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
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn converted_scenes_give_the_same_picture() {
    let dir = folder("convert");
    let (image, copy) = (dir.join("a.exr"), dir.join("copy.pbrt"));
    let scenes = [
        "cornell-box-small",
        "logo-large",
        "../formats/tests/seeds/everything.pbrt",
        "../formats/tests/seeds/everything.obj",
        "../formats/tests/seeds/everything.gltf",
        "tests/cornell/box.gltf",
    ];
    for scene in scenes {
        let size = ["--resolution", "32x24"];
        let want = render(scene, &image, &size);
        let output = linelit(&["convert", scene, "-o", path(&copy), "--extensions"]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let got = render(path(&copy), &image, &size);
        assert_eq!(different(&got, &want), 0, "{scene}");
        // What pbrt-v4 reads loads without a warning about what is not pbrt's.
        let output = linelit(&["convert", scene, "-o", path(&copy)]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let plain = std::fs::read_to_string(&copy).unwrap();
        let foreign = [
            "\"line\"",
            "\"phong\"",
            "\"substrate\"",
            "\"plastic\"",
            "\"matte\"",
        ];
        for line in plain.lines().filter(|l| !l.starts_with('#')) {
            let code = line.split(" # ").next().unwrap();
            assert!(!foreign.iter().any(|w| code.contains(w)), "{scene}: {line}");
        }
    }
    std::fs::remove_dir_all(&dir).unwrap();
}

/// A dielectric of glTF becomes a coated one, which is drawn without its coat: as bright as its
/// colour, where it was darker. The diffuse part alone reflects 28/23 · 0.96 · 0.5 · M² = 0.394 of
/// light from everywhere, with M = 23/28; the coat adds at most its 4 % to that, and less than 4 %
/// in the mean over directions where Fresnel's term rises.
#[test]
fn what_a_conversion_changes_is_said_with_its_number() {
    let dir = folder("changes");
    let (scene, copy) = (dir.join("a.gltf"), dir.join("copy.pbrt"));
    let json = r#"{"asset":{"version":"2.0"},"materials":[{"name":"clay","pbrMetallicRoughness":
        {"baseColorFactor":[0.5,0.5,0.5,1],"metallicFactor":0}}]}"#;
    std::fs::write(&scene, json).unwrap();
    let output = linelit(&["convert", path(&scene), "-o", path(&copy)]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let said = text(&output.stderr);
    let line = said
        .lines()
        .find(|l| l.contains("`clay` reflects 0.500"))
        .unwrap();
    let (_, rest) = line.split_once("where it reflects ").unwrap();
    let before: f64 = rest.split(' ').next().unwrap().parse().unwrap();
    assert!((0.394..0.394 + 0.08).contains(&before), "{line}");
    assert!(line.contains("as `substrate` (+"), "{line}");
    // With extensions nothing changes, and nothing is said.
    let output = linelit(&["convert", path(&scene), "-o", path(&copy), "--extensions"]);
    assert!(!text(&output.stderr).contains("reflects"));
    std::fs::remove_dir_all(&dir).unwrap();
}

/// Images elsewhere are copied: a scene may name only files of its folder.
#[test]
fn converted_scenes_have_their_images_beside_them() {
    let dir = folder("copies");
    let inner = dir.join("inner");
    std::fs::create_dir_all(&inner).unwrap();
    let image = "../formats/tests/images/ramp.png";
    std::fs::copy(image, inner.join("a.png")).unwrap();
    let scene = inner.join("a.pbrt");
    let words = "Camera \"perspective\" WorldBegin Texture \"t\" \"spectrum\" \"imagemap\" \
                 \"string filename\" \"a.png\" Material \"diffuse\" \"texture reflectance\" \"t\" \
                 Shape \"sphere\"";
    std::fs::write(&scene, words).unwrap();
    let copy = dir.join("copy.pbrt");
    let output = linelit(&["convert", path(&scene), "-o", path(&copy)]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let output = linelit(&["info", path(&copy)]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let same = std::fs::read(dir.join("copy-0-a.png")).unwrap();
    assert_eq!(same, std::fs::read(image).unwrap());
    // From another folder, only if it is allowed.
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
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn info_says_what_is_in_a_scene() {
    let output = linelit(&["info", "tests/cornell/v3.pbrt", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
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
