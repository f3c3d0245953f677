//! The output of `render` other than plain radiance: exposed pictures and layers.

use crate::common::{folder, linelit, path, succeeded, text};
use linelit_film::{Document, Image, Pixels, Samples, decode_picture};
use std::path::Path;

fn render(image: &Path, more: &[&str]) {
    let fixed = [
        "render",
        "cornell-box",
        "-o",
        path(image),
        "--resolution",
        "32x32",
    ];
    succeeded(&[&fixed[..], &["--samples", "4"], more].concat());
}

fn bytes(image: &Path) -> Vec<[u8; 3]> {
    let bytes = std::fs::read(image).unwrap();
    match decode_picture("a.png", &bytes).unwrap().unwrap().pixels {
        Pixels::Bytes(picture) => picture.rgb,
        Pixels::Words(_) | Pixels::Linear(_) => panic!("a PNG file of ours has bytes"),
    }
}

#[test]
fn exposure_doubles() {
    let dir = folder("exposure");
    let [plain, bright] = ["a.png", "b.png"].map(|name| dir.join(name));
    render(&plain, &[]);
    render(&bright, &["--exposure", "2"]);
    let [plain, bright] = [plain, bright].map(|image| bytes(&image));
    let white = |image: &[[u8; 3]]| image.iter().filter(|p| p.contains(&255)).count();
    // At first only the light is white; with four times the brightness, much else is too.
    let counts = [&plain, &bright].map(|image| white(image));
    assert!(0 < counts[0] && counts[0] < counts[1], "{counts:?}");
    for (plain, bright) in plain.iter().zip(&bright) {
        let darker = (0..3).all(|k| plain[k] <= bright[k]);
        assert!(darker, "{plain:?} {bright:?}");
    }
}

#[test]
fn layers_stand_beside_the_same_picture() {
    let dir = folder("aovs");
    let [plain, layered] = ["plain.exr", "layered.exr"].map(|name| dir.join(name));
    let four = ["--pixel-samples", "4"];
    let four = [&four[..], &["--estimator", "line-analytic"]].concat();
    render(&plain, &four);
    let aovs = ["--aovs", "albedo,normal,depth,variance,samples"];
    render(&layered, &[&four[..], &aovs].concat());
    let document = Document::read(&layered).unwrap();
    assert_eq!(Image::read(&plain).unwrap(), document.main_image().unwrap());
    let layer = |name: &str| {
        document
            .image(name)
            .unwrap_or_else(|| panic!("no layer {name}"))
    };

    // At the centre of the lowest row is the floor: white, level, four to five units away.
    let at = |image: &Image| image.get(16, 31);
    let [x, y, z] = at(&layer("normal"));
    assert!(
        (y - 1.0).abs() < 1e-6 && x.abs() + z.abs() < 1e-6,
        "{x} {y} {z}"
    );
    let [r, g, b] = at(&layer("albedo"));
    assert!(
        r > 0.6 && r < 0.8 && (r - g).abs() < 0.05 && (r - b).abs() < 0.05,
        "{r} {g} {b}"
    );
    let [depth, ..] = at(&layer("depth"));
    assert!(depth > 1.0 && depth < 10.0, "{depth}");
    // Where the camera sees one surface under all samples the variance is noise; across the rim of
    // the light it is large.
    let variance = layer("variance");
    assert!(
        variance
            .rgb
            .iter()
            .flatten()
            .all(|v| *v >= 0.0 && v.is_finite())
    );
    let worst = variance.rgb.iter().map(|p| p[0]).fold(0.0, f32::max);
    assert!(worst > 1.0, "{worst}");
    let counts = |name: &str| match document.layer(name).unwrap().channel("Y").unwrap() {
        Samples::Count(counts) => counts.clone(),
        other => panic!("{other:?}"),
    };
    assert!(counts("samples").iter().all(|n| *n == 4));
    // There is at least one camera ray for each sample.
    assert!(counts("rays").iter().all(|n| *n >= 4));
    assert!(counts("lines").iter().sum::<u32>() > 0);
}

/// Trials are the pictures of seeds in a row: their mean is the picture, and the variance of that
/// mean its layer, to the rounding of the film's f32.
#[test]
fn trials_are_pictures_of_their_own() {
    const TRIALS: usize = 5;
    let dir = folder("trials");
    let each = ["--pixel-samples", "3"];
    let own = |seed: usize| {
        let path = dir.join(format!("{seed}.exr"));
        render(&path, &[&each[..], &["--seed", &seed.to_string()]].concat());
        Image::read(&path).unwrap()
    };
    let own: Vec<Image> = (7..7 + TRIALS).map(own).collect();
    let path = dir.join("all.exr");
    let trials = ["--trials", "5", "--seed", "7", "--aovs", "variance,samples"];
    render(&path, &[&each[..], &trials].concat());
    let document = Document::read(&path).unwrap();
    let (mean, variance) = (
        document.main_image().unwrap(),
        document.image("variance").unwrap(),
    );
    let n = TRIALS as f64;
    let mut noisy = 0;
    for (i, (got, of_mean)) in mean.rgb.iter().zip(&variance.rgb).enumerate() {
        for k in 0..3 {
            let values: Vec<f64> = own.iter().map(|o| f64::from(o.rgb[i][k])).collect();
            let want = values.iter().sum::<f64>() / n;
            let m2: f64 = values.iter().map(|v| (v - want).powi(2)).sum();
            let largest = values.iter().fold(0.0, |a, v| v.max(a));
            // Each picture's value and the mean are rounded to f32: half an ulp, ε/2 of theirs.
            let off = f64::from(f32::EPSILON) * largest;
            assert!((f64::from(got[k]) - want).abs() <= off, "{got:?} {want}");
            // δ(m2) ≤ 2 Σ |v − mean| δv ≤ 2 √(n m2) δv, and n δv² where all are alike.
            let off = (2.0 * (n * m2).sqrt() * off + n * off * off) / (n * (n - 1.0));
            let want = m2 / (n * (n - 1.0));
            let error = (f64::from(of_mean[k]) - want).abs();
            let rounded = f64::from(f32::EPSILON) * want;
            assert!(error <= off + rounded, "{of_mean:?} {want} {off}");
            noisy += usize::from(want > 1e-6);
        }
    }
    assert!(noisy > 100, "{noisy}");
    let Samples::Count(taken) = document.layer("samples").unwrap().channel("Y").unwrap() else {
        panic!("samples are counts");
    };
    assert!(taken.iter().all(|n| *n == 15));
}

#[test]
fn what_a_file_cannot_hold_is_said() {
    for (line, what) in [
        ("render plates -o x.png --aovs depth", "layers of EXR files"),
        (
            "render plates -o x.exr --aovs variance",
            "--trials 2 or more",
        ),
        ("render plates -o x.exr --aovs detph", "'depth'"),
        ("render plates -o x.exr --exposure 1", "for PNG files"),
        ("render plates -o x.png --exposure nan", "from -100 to 100"),
    ] {
        let output = linelit(&line.split(' ').collect::<Vec<_>>());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        assert!(said.contains(what), "{line}: {said}");
    }
}
