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

/// A substrate, as which dielectrics of glTF are read, becomes a coated diffuse surface, which is
/// drawn without its coat: the warning's number is that of the pictures of both files.
#[test]
fn what_a_conversion_changes_is_said_with_its_number() {
    let dir = folder("changes");
    let (scene, copy, image) = (dir.join("a.pbrt"), dir.join("copy.pbrt"), dir.join("a.exr"));
    let text_of_scene = "LookAt 0 1 -4 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 50
        Film \"rgb\" \"integer xresolution\" 64 \"integer yresolution\" 48 WorldBegin
        AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ] Translate 3 3 -1
        Shape \"quad\" \"point3 o\" [ -1 0 -1 ] \"vector3 u\" [ 2 0 0 ] \"vector3 v\" [ 0 0 2 ]
        AttributeEnd
        MakeNamedMaterial \"clay\" \"string type\" \"substrate\" \"rgb Kd\" [ .5 .5 .5 ]
        \"rgb Ks\" [ .04 .04 .04 ] \"float roughness\" 0.3
        NamedMaterial \"clay\" Shape \"quad\" \"point3 o\" [ -3 -1 -3 ]
        \"vector3 u\" [ 6 0 0 ] \"vector3 v\" [ 0 0 6 ]";
    std::fs::write(&scene, text_of_scene).unwrap();
    let output = linelit(&["convert", path(&scene), "-o", path(&copy)]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let said = text(&output.stderr);
    let is_change = |l: &&str| l.contains("substrate as coateddiffuse (`clay`);");
    let line = said.lines().find(is_change).unwrap();
    let (_, rest) = line.split_once("changes by ").unwrap();
    let said: f64 = rest.split(' ').next().unwrap().parse().unwrap();
    let mean = |file: &Path| {
        // What `convert` compares by.
        let estimator = ["--estimator", "line-analytic"];
        let more = [&estimator[..], &["--samples", "16", "--hide-lights"]].concat();
        let arguments = ["render", path(file), "-o", path(&image)];
        let output = linelit(&[&arguments[..], &more].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        Image::read(&image).unwrap().mean().iter().sum::<f64>()
    };
    let changed = 100.0 * (mean(&copy) / mean(&scene) - 1.0);
    // Printed to a tenth; the same pixels, samples and seed.
    assert!(
        (said - changed).abs() < 0.051 && changed > 5.0,
        "{changed}: {line}"
    );
    // With extensions nothing changes, and nothing is said.
    let output = linelit(&["convert", path(&scene), "-o", path(&copy), "--extensions"]);
    assert!(!text(&output.stderr).contains("changes by"));
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
    let said = text(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(
        said.contains("in 1 meshes, 2 materials, 0 lights; beside it copy-0-a.png\n"),
        "{said}"
    );
    assert!(
        said.contains("warning: the scene has no lights, and gets none"),
        "{said}"
    );
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
