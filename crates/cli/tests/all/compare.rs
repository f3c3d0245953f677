//! `compare`: its metrics, parts of pictures, and the maps that it writes.

use crate::common::{folder, linelit, path, succeeded, text};
use linelit_film::{Document, Exposure, Image, Placement, srgb_decode, write_png};
use linelit_testkit::pictures;
use serde_json::Value;
use std::path::Path;

fn compared(arguments: &[&str]) -> Value {
    let all = [&["compare"], arguments, &["--json"]].concat();
    let output = succeeded(&all);
    serde_json::from_slice(&output.stdout).unwrap()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key]
        .as_f64()
        .unwrap_or_else(|| panic!("{key} of {value}"))
}

/// Writes a ramp, and the same ramp with an error in red that grows downwards.
fn pair(folder: &Path) -> [std::path::PathBuf; 2] {
    let ramp = Image::from_fn(16, 12, |x, y| [x as f32 / 15.0, 0.5, y as f32 / 11.0]);
    let seen = Image::from_fn(16, 12, |x, y| {
        [x as f32 / 15.0 + y as f32 / 32.0, 0.5, y as f32 / 11.0]
    });
    let names = ["seen.exr", "ramp.pfm"].map(|name| folder.join(name));
    let mut document = Document::new(16, 12);
    document.add_image("", &ramp).unwrap();
    document.add_image("seen", &seen).unwrap();
    document.set("seed", 2);
    document.write(&names[0]).unwrap();
    std::fs::write(&names[1], pictures::pfm([16, 12], &ramp.rgb)).unwrap();
    names
}

#[test]
fn layers_channels_and_metadata_are_told_apart() {
    let dir = folder("compare-layers");
    let [exr, pfm] = pair(&dir);
    let same = compared(&[path(&exr), path(&pfm)]);
    assert!(number(&same, "mse") <= 0.0 && same["crop"].is_null());
    let layer = format!("{}:seen", exr.display());
    let other = compared(&[&layer, path(&pfm)]);
    // Σ y²/32² over 12 rows, in one of three channels.
    let square = f64::from((0..12).map(|y| y * y).sum::<i32>()) / 1024.0 / 12.0;
    // Each value is an f32 near 1. The difference is off by 2⁻²⁴, and the square by twice that, in
    // one of three channels.
    let rounding = 2f64.powi(-24);
    assert!(
        (number(&other, "mse") - square / 3.0).abs() < rounding,
        "{other}"
    );
    let channels = other["channels"].as_array().unwrap();
    assert!((number(&channels[0], "mse") - square).abs() < rounding);
    assert!(number(&channels[1], "mse") <= 0.0 && number(&channels[2], "mrse") <= 0.0);
    let mrse = number(&channels[0], "mrse") / 3.0;
    assert!(
        (number(&other, "mrse") - mrse).abs() <= 1e-14 * mrse,
        "{other}"
    );

    let again = dir.join("again.exr");
    let mut document = Document::read(&exr).unwrap();
    document.set("seed", 1);
    document.write(&again).unwrap();
    let output = linelit(&["compare", path(&exr), path(&again)]);
    let said = text(&output.stdout);
    assert!(
        said.contains("\nred        MSE 0.000e0, MRSE 0.000e0, bias 0.000e0\n"),
        "{said}"
    );
    assert!(
        said.ends_with("\nseed       2, of the reference 1\n"),
        "{said}"
    );
}

#[test]
fn what_cannot_be_compared_is_said() {
    let dir = folder("compare-errors");
    let [exr, pfm] = pair(&dir);
    let small = dir.join("small.pfm");
    std::fs::write(&small, pictures::pfm([2, 3], &[[0.0; 3]; 6])).unwrap();
    let (layer, absent) = (format!("{}:x", pfm.display()), dir.join("none.png"));
    std::fs::write(dir.join("broken.png"), "no picture").unwrap();
    for (arguments, status, what) in [
        (
            vec![path(&small), path(&pfm)],
            1,
            "expected 16 × 12 pixels, found 2 × 3",
        ),
        (vec![&layer, path(&pfm)], 1, "named `x`"),
        (vec![path(&absent), path(&pfm)], 1, "none.png"),
        (
            vec![path(&dir.join("broken.png")), path(&pfm)],
            1,
            "broken.png: ",
        ),
        (
            vec![path(&exr), path(&pfm), "--difference", path(&exr)],
            2,
            "written over",
        ),
        (
            vec![path(&exr), path(&pfm), "--error-map", "a.jpg"],
            2,
            ".exr or .png",
        ),
        (
            vec![path(&exr), path(&pfm), "--crop", "0,2,0,1"],
            2,
            "0 <= X0 < X1 <= 1",
        ),
    ] {
        let output = linelit(&[&["compare"], &arguments[..]].concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {said}");
        assert!(
            said.contains(what) && output.stdout.is_empty(),
            "{arguments:?}: {said}"
        );
    }
}

/// Writes some columns and rows of the ramp of [`pair`], which may lie beyond its edges, with an
/// error added, to a file that states their position.
fn ramp_at(file: &Path, [x0, y0]: [i32; 2], [width, height]: [u32; 2], error: f32) {
    let image = Image::from_fn(width, height, |x, y| {
        let at = |from: i32, k: u32| from as f32 + k as f32;
        [at(x0, x) / 15.0 + error, 0.5, at(y0, y) / 11.0]
    });
    let mut document = Document::new(width, height);
    document.placement = Some(Placement {
        origin: [x0, y0],
        full: [16, 12],
        corner: [0, 0],
    });
    document.add_image("", &image).unwrap();
    let nothing = vec![1.0; image.rgb.len()];
    document.add_scalar("depth", nothing).unwrap();
    document.write(file).unwrap();
}

#[test]
fn parts_of_a_picture_are_compared_where_they_lie() {
    let dir = folder("compare-parts");
    let [_, pfm] = pair(&dir);
    let names = [
        "left.exr",
        "middle.exr",
        "right.exr",
        "beyond.exr",
        "wrong.exr",
    ];
    let [left, middle, right, beyond, wrong] = names.map(|name| dir.join(name));
    ramp_at(&left, [0, 0], [8, 12], 0.0);
    ramp_at(&middle, [4, 3], [8, 6], 0.0);
    ramp_at(&right, [8, 0], [8, 12], 0.0);
    // A picture with pixels beyond all edges, and with an error of a quarter in red.
    ramp_at(&beyond, [-2, -1], [20, 14], 0.25);
    // The pixels of the middle, at another position.
    let mut document = Document::read(&middle).unwrap();
    document.placement.as_mut().unwrap().origin = [0, 0];
    document.write(&wrong).unwrap();
    for (a, b, crop, error) in [
        (&middle, &pfm, [4, 12, 3, 9], 0.0),
        (&pfm, &middle, [4, 12, 3, 9], 0.0),
        (&middle, &left, [4, 8, 3, 9], 0.0),
        (&right, &middle, [8, 12, 3, 9], 0.0),
        (&beyond, &middle, [4, 12, 3, 9], 0.25),
        (&beyond, &beyond, [-2, 18, -1, 13], 0.0),
        (&wrong, &pfm, [0, 8, 0, 6], 4.0 / 15.0),
    ] {
        let m = compared(&[path(a), path(b)]);
        assert_eq!(m["crop"], serde_json::json!(crop), "{m}");
        let red = number(&m["channels"][0], "bias").abs();
        // Sums and differences of f32 below 2 are off by 2⁻²³.
        assert!((red - error).abs() <= 2f64.powi(-23), "{m}");
    }
    // The whole picture is not reported as a part, and parts of parts have coordinates of the whole
    // picture.
    assert!(compared(&[path(&beyond), path(&pfm)])["crop"].is_null());
    let part = compared(&[path(&middle), path(&pfm), "--crop", "0,.5,.5,1"]);
    assert_eq!(part["crop"], serde_json::json!([4, 8, 6, 9]));
    // Layers and maps have the position of the picture.
    let depths = [&middle, &left].map(|file| format!("{}:depth", file.display()));
    assert_eq!(compared(&[&depths[0], &depths[1]])["pixels"], 24);
    let map = dir.join("map.exr");
    compared(&[path(&middle), path(&left), "--difference", path(&map)]);
    let placement = Document::read(&map).unwrap().placement.unwrap();
    assert_eq!((placement.origin, placement.full), ([4, 3], [16, 12]));
}

#[test]
fn pictures_without_a_pixel_in_common_are_refused() {
    let dir = folder("compare-apart");
    let [_, pfm] = pair(&dir);
    let [left, right, other] = ["l.exr", "r.exr", "o.exr"].map(|name| dir.join(name));
    ramp_at(&left, [0, 0], [8, 12], 0.0);
    ramp_at(&right, [8, 0], [8, 12], 0.0);
    let refused = |arguments: &[&str], what: &str| {
        let output = linelit(&[&["compare"], arguments].concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        assert!(said.contains(what) && output.stdout.is_empty(), "{said}");
    };
    let [l, r, o] = [&left, &right, &other].map(|file| path(file));
    let apart =
        "no pixel in common: one has columns 0 to 8, rows 0 to 12, the reference columns 8 to 16";
    refused(&[l, r], apart);
    refused(
        &[l, path(&pfm), "--crop", ".5,1,0,1"],
        "no pixel of that --crop in common",
    );
    // Parts of another picture, which is larger or begins at another pixel.
    let moved = |full, corner| {
        let mut document = Document::read(&left).unwrap();
        let origin = [0, 0];
        document.placement = Some(Placement {
            origin,
            full,
            corner,
        });
        document.write(&other).unwrap();
    };
    moved([16, 13], [0, 0]);
    let larger =
        "display windows are 16 × 13 pixels from 0, 0 on, and of the reference 16 × 12 pixels";
    refused(&[o, path(&pfm)], larger);
    moved([16, 12], [1, 0]);
    refused(&[o, l], "16 × 12 pixels from 1, 0 on");
}

#[test]
fn maps_are_what_the_figures_are_means_of() {
    let dir = folder("compare-maps");
    let [exr, pfm] = pair(&dir);
    let layer = format!("{}:seen", exr.display());
    let [difference, error] = ["d.exr", "e.exr"].map(|name| dir.join(name));
    let maps = [
        "--difference",
        path(&difference),
        "--error-map",
        path(&error),
    ];
    let whole = compared(&[&[&layer, path(&pfm)], &maps[..]].concat());
    let mean = |file: &Path| Image::read(file).unwrap().mean();
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b.abs();
    assert!(near(mean(&error)[0], number(&whole, "mrse")), "{whole}");
    assert!(near(
        mean(&difference).iter().sum::<f64>() / 3.0,
        number(&whole, "bias")
    ));

    // The right half of the lower rows gives the same as if it had been cut out before.
    let crop = ["--crop", "0.5,1,0.5,1"];
    let part = compared(&[&[&layer, path(&pfm)], &crop[..], &maps[..]].concat());
    assert_eq!(part["crop"], serde_json::json!([8, 16, 6, 12]));
    assert_eq!(part["pixels"], 48);
    let cut = |file: &Path, layer| {
        let image = Image::read_layer(file, layer).unwrap();
        let cut = Image::from_fn(8, 6, |x, y| image.get(x + 8, y + 6));
        let name = dir.join(format!("cut-{}.pfm", layer.unwrap_or("")));
        std::fs::write(&name, pictures::pfm([8, 6], &cut.rgb)).unwrap();
        name
    };
    let [a, b] = [cut(&exr, Some("seen")), cut(&pfm, None)];
    assert_eq!(compared(&[path(&a), path(&b)])["mrse"], part["mrse"]);
    let map = Image::read(&error).unwrap();
    assert_eq!((map.width, map.height), (8, 6));
}

/// The difference is above the middle grey in red, and equals it in the other channels; the error
/// map goes from dark to light colours.
#[test]
fn maps_are_pictures_too() {
    let dir = folder("compare-shown");
    let [exr, pfm] = pair(&dir);
    let layer = format!("{}:seen", exr.display());
    let [difference, error] = ["d.png", "e.png"].map(|name| dir.join(name));
    let maps = [
        "--difference",
        path(&difference),
        "--error-map",
        path(&error),
    ];
    let arguments = [&["compare", &layer, path(&pfm)], &maps[..]];
    let output = linelit(&arguments.concat());
    assert!(output.status.success());
    let said = text(&output.stderr);
    assert!(
        said.contains("e.png: ") && said.contains("is darkest"),
        "{said}"
    );
    let bytes = std::fs::read(&difference).unwrap();
    let decoded = linelit_film::decode_picture("d.png", &bytes)
        .unwrap()
        .unwrap();
    let linelit_film::Pixels::Bytes(shown) = decoded.pixels else {
        panic!("a PNG file has bytes");
    };
    assert_eq!(shown.rgb[0], [128; 3]);
    // 11/32 of half of the range above the middle.
    assert_eq!(shown.rgb[11 * 16], [171, 128, 128]);
}

/// A picture of 8 bits is decoded as a screen shows it.
#[test]
fn pictures_of_bytes_are_read() {
    let dir = folder("compare-png");
    let [_, pfm] = pair(&dir);
    let png = dir.join("ramp.png");
    let ramp = Image::read(&pfm).unwrap();
    write_png(&png, &ramp, Exposure::default()).unwrap();
    let m = compared(&[path(&png), path(&pfm)]);
    // Half a step of the encoding where it is steepest, at white.
    let step = 1.0 - srgb_decode(254.5 / 255.0);
    assert!(number(&m, "largest") <= step, "{m}");
    let output = linelit(&["compare", path(&png), path(&pfm)]);
    assert!(text(&output.stderr).contains("has integers"));
}
