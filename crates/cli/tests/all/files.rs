//! Scenes in various file formats: the same picture from each, and files of other folders.

use crate::common::{folder, linelit, path, succeeded, text};
use linelit_film::Image;
use linelit_formats::{LoadOptions, Loaded};
use std::path::{Path, PathBuf};

/// Renders a scene file; returns the picture and the messages.
fn render(scene: &str, image: &Path, more: &[&str]) -> Image {
    let arguments = ["render", scene, "-o", path(image), "--samples", "4"];
    succeeded(&[&arguments[..], more].concat());
    Image::read(image).unwrap()
}

/// Counts the pixels that differ in any bit.
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
    // triangles have the same bits.
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
        table.contains("light 0  quad, area 0.6400 m², power 18.0956 W"),
        "{table}"
    );
}

/// Writes a scene with a quad, a sphere, a two-sided sphere, a point and a disk as lights, and
/// returns what `info` prints about it.
fn many_lights(dir: &Path) -> (PathBuf, serde_json::Value) {
    let scene = dir.join("rows.pbrt");
    let quad = |z: i32| {
        format!("Shape \"bilinearmesh\" \"point3 P\" [ 0 0 {z} 0 1 {z} 1 0 {z} 1 1 {z} ] ")
    };
    let emits = |more: &str| format!("AreaLightSource \"diffuse\" \"rgb L\" [ 1 2 6 ] {more} ");
    let world = [
        "LookAt 0 -6 6  0 0 0  0 0 1 Camera \"perspective\" WorldBegin ",
        "Shape \"trianglemesh\" \"point3 P\" [ -9 -9 -1 9 -9 -1 0 9 -1 ] ",
        "AttributeBegin ",
        &emits("\"float power\" 100"),
        &quad(3),
        "AttributeEnd AttributeBegin ",
        &emits(""),
        "Shape \"sphere\" AttributeEnd AttributeBegin ",
        &emits("\"bool twosided\" true"),
        "Translate 4 0 0 Shape \"sphere\" AttributeEnd ",
        "LightSource \"point\" \"point3 from\" [ 0 0 4 ] ",
        "AttributeBegin Translate -4 0 1 ",
        &emits(""),
        "ReverseOrientation Shape \"disk\" AttributeEnd",
    ];
    std::fs::write(&scene, world.concat()).unwrap();
    let output = succeeded(&["info", path(&scene), "--json"]);
    (scene, serde_json::from_slice(&output.stdout).unwrap())
}

/// The two numbers of a row of lights.
fn range(row: &serde_json::Value, key: &str) -> [u64; 2] {
    [0, 1].map(|k| row[key][k].as_u64().unwrap())
}

/// Each light of the file has one row, however many lights of the scene it becomes.
#[test]
fn info_lists_the_lights_of_the_file() {
    let dir = folder("rows");
    let (_, info) = many_lights(&dir);
    let rows = info["light_rows"].as_array().unwrap();
    let kinds = rows.iter().map(|row| row["kind"].as_str().unwrap());
    // The facets of the two-sided sphere, of several kinds, are in one row.
    let wanted = ["quad", "sphere", "polygon", "point", "disk"];
    assert_eq!(kinds.collect::<Vec<_>>(), wanted, "{info}");
    // pbrt's power is the power of a white light. This colour has a luminance of 0.2126 × 1 +
    // 0.7152 × 2 + 0.0722 × 6 = 2.0762 and a mean of 3, up to the rounding of corners.
    for (key, want) in [("power", 300.0), ("power_luminance", 207.62)] {
        let power = rows[0][key].as_f64().unwrap();
        assert!((power - want).abs() < 1e-4 * want, "{key} {power}");
    }
    // Round lights are one each, and the numbers of all facets go on from row to row.
    let of_kind = |kind: &str| &info["lights"][kind]["lights"];
    assert_eq!(["sphere", "disk", "point"].map(of_kind), [1, 1, 1]);
    let groups = info["facet_lights"].as_object().unwrap().values();
    let facets: u64 = groups.map(|group| group["lights"].as_u64().unwrap()).sum();
    let mut next = 0;
    for row in rows {
        assert_eq!(range(row, "facets")[0], next, "{info}");
        next = range(row, "facets")[1] + 1;
    }
    assert_eq!(next, facets);
}

/// Each number that is listed changes the picture; a flag that names another is refused.
#[test]
fn lights_go_by_the_numbers_that_info_lists() {
    let dir = folder("numbers");
    let (scene, info) = many_lights(&dir);
    let rows = info["light_rows"].as_array().unwrap();
    // Files without metadata, which would name the estimators.
    let image = scene.with_extension("pfm");
    let render = |more: &[&str]| {
        let small = ["--resolution", "8x8", "--samples", "1", "-o", path(&image)];
        linelit(&[&["render", path(&scene)], &small[..], more].concat())
    };
    assert_eq!(render(&[]).status.code(), Some(0));
    let plain = std::fs::read(&image).unwrap();
    for row in rows {
        let [[first, last], [_, last_facet]] = ["numbers", "facets"].map(|key| range(row, key));
        for number in [first, last] {
            let output = render(&["--light-estimator", &format!("{number}=point-area")]);
            assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
            // Light without size has no noise, and a facet may face away from all that is seen.
            let is_whole = first == last && row["kind"] != "point";
            let is_changed = std::fs::read(&image).unwrap() != plain;
            assert!(is_changed || !is_whole, "{row}");
        }
        if last_facet > last {
            let number = last_facet.to_string();
            let output = render(&["--light-estimator", &format!("{number}=point-area")]);
            let said = text(&output.stderr);
            assert!(said.contains(&format!("facet of light {first}")), "{said}");
            let facets = ["--spheres", "facets", "--lights", "one:power"];
            let apart = [&facets[..], &["--light-apart", &number]].concat();
            assert_eq!(render(&apart).status.code(), Some(0));
        }
    }
    let twice = ["0=exact"; 2]
        .map(|own| ["--light-estimator", own])
        .concat();
    let beyond = ["--light-apart", "9999", "--lights", "one:power"];
    for (flags, what) in [
        (&twice[..], "two estimators"),
        (&["--light-apart", "0"], "--lights that pick one"),
        (&beyond, "no light 9999"),
    ] {
        let output = render(flags);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(what), "{said}");
    }
}

/// Objects and instances are counted, in each format that has them.
#[test]
fn info_counts_what_a_file_places() {
    let dir = folder("placed");
    let counts = |name: &str, text: &str| {
        let file = dir.join(name);
        std::fs::write(&file, text).unwrap();
        let output = succeeded(&["info", path(&file), "--json"]);
        let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        ["objects", "instances", "triangles"].map(|key| info[key].as_u64().unwrap())
    };
    let shape = "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]";
    let object = |name: &str| format!("ObjectBegin \"{name}\" {shape} {shape} ObjectEnd ");
    let place = |name: &str| format!("ObjectInstance \"{name}\" Translate 1 0 0 ");
    let world = |text: &[&str]| format!("WorldBegin {}", text.concat());
    let (a, b) = (object("a"), object("b"));
    assert_eq!(counts("none.pbrt", &world(&[shape])), [0, 0, 1]);
    assert_eq!(counts("unused.pbrt", &world(&[&a])), [0, 0, 0]);
    assert_eq!(counts("one.pbrt", &world(&[&a, &place("a")])), [1, 1, 2]);
    let text = [
        &*a,
        &b,
        &place("a"),
        &place("b"),
        &place("a"),
        &a,
        &place("a"),
    ];
    assert_eq!(counts("two.pbrt", &world(&text)), [3, 4, 8]);

    let gltf = |nodes: &[&str]| {
        let all: Vec<_> = (0..nodes.len()).map(|k| k.to_string()).collect();
        format!(
            "{{\"asset\": {{\"version\": \"2.0\"}}, \"scenes\": [{{\"nodes\": [{}]}}],
            \"nodes\": [{}], \"meshes\": [{{\"primitives\": [{{\"attributes\":
            {{\"POSITION\": 0}}}}]}}], \"accessors\": [{{\"bufferView\": 0, \"componentType\":
            5126, \"count\": 3, \"type\": \"VEC3\", \"min\": [0, 0, 0], \"max\": [1, 1, 0]}}],
            \"bufferViews\": [{{\"buffer\": 0, \"byteLength\": 36}}], \"buffers\":
            [{{\"byteLength\": 36, \"uri\": \"data:application/octet-stream;base64,\
            AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}}]}}",
            all.join(","),
            nodes.join(",")
        )
    };
    let node = "{\"mesh\": 0}";
    assert_eq!(counts("one.gltf", &gltf(&[node])), [0, 0, 1]);
    assert_eq!(counts("three.gltf", &gltf(&[node; 3])), [1, 3, 3]);
}
