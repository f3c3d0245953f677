//! Image files of every kind that textures come in.

use linelit_geometry::{DVec2, DVec3};
use linelit_scene::{ErrorKind, LoadOptions, MaterialKind, Scene, Texture};

/// The texture of an image file: (15 x, 31 y, 128) at pixel x, y of 17 × 9, the top row first.
fn texture(name: &str, encoding: &str) -> Texture {
    let text = format!(
        "Camera \"perspective\" WorldBegin
         Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"tests/images/{name}\" \"string encoding\" \"{encoding}\"
         Material \"matte\" \"texture Kd\" \"t\" Shape \"sphere\""
    );
    let loaded = Scene::from_pbrt_str(&text, "image.pbrt", &LoadOptions::default());
    let scene = loaded.unwrap_or_else(|e| panic!("{e}")).scene;
    match &scene.materials.last().unwrap().kind {
        MaterialKind::Matte { kd, .. } => kd.clone(),
        other => panic!("{other:?}"),
    }
}

/// The largest distance of a component from the ramp, in 255ths.
fn worst(texture: &Texture, want: impl Fn(f64, f64) -> DVec3) -> f64 {
    let mut worst = 0.0_f64;
    for y in 0..9 {
        for x in 0..17 {
            let (x, y) = (f64::from(x), f64::from(y));
            let uv = DVec2::new((x + 0.5) / 17.0, 1.0 - (y + 0.5) / 9.0);
            let error = texture.evaluate(uv) * 255.0 - want(x, y);
            worst = worst.max(error.abs().max_element());
        }
    }
    worst
}

fn ramp(x: f64, y: f64) -> DVec3 {
    DVec3::new(15.0 * x, 31.0 * y, 128.0)
}

#[test]
fn png_files_are_read_exactly() {
    for name in ["ramp.png", "interlaced.png"] {
        // The centres of pixels are hit to a few ulps of the coordinates, times the slope.
        let error = worst(&texture(name, "linear"), ramp);
        assert!(error < 1e-10, "{name}: {error}");
    }
}

#[cfg(feature = "jpeg")]
#[test]
fn jpeg_files_are_read_to_their_quality() {
    for name in ["ramp.jpg", "ramp-progressive.jpg"] {
        let error = worst(&texture(name, "linear"), ramp);
        assert!(error < 6.0, "{name}: {error}");
    }
    // Luma of Rec. 601, which JPEG has.
    let grey = |x, y| DVec3::splat(ramp(x, y).dot(DVec3::new(0.299, 0.587, 0.114)));
    let error = worst(&texture("grey.jpg", "linear"), grey);
    assert!(error < 6.0, "grey.jpg: {error}");
}

/// A triangle that emits an image.
#[cfg(feature = "hdr")]
fn lit_by(image: &std::path::Path) -> String {
    format!(
        "Camera \"perspective\" WorldBegin
         AreaLightSource \"diffuse\" \"string filename\" \"{}\"
         Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]
         \"point2 uv\" [ 0 0 1 0 0 1 ]",
        image.display()
    )
}

/// Values above one are kept; half floats of ours hold these exactly, and so do both files.
#[cfg(feature = "hdr")]
#[test]
fn exr_and_pfm_files_are_read_exactly() {
    use linelit_film::{Document, Image, write_pfm};
    let folder = std::env::temp_dir().join(format!("linelit-hdr-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let image = Image::from_fn(17, 9, |x, y| {
        [x, 31 * y, 128].map(|v| f32::from(u16::try_from(v).unwrap()) / 8.0)
    });
    let mut document = Document::new(17, 9);
    document.add_image("", &image).unwrap();
    let (exr, pfm) = (folder.join("a.exr"), folder.join("a.pfm"));
    document.write(&exr).unwrap();
    write_pfm(&pfm, &image).unwrap();
    for path in [exr, pfm] {
        let text = lit_by(&path);
        let loaded = Scene::from_pbrt_str(&text, "hdr.pbrt", &LoadOptions::default());
        let scene = loaded.unwrap_or_else(|e| panic!("{e}")).scene;
        let map = scene.lights[0].map.as_ref().unwrap();
        for (x, y) in [(0, 0), (16, 8), (3, 7)] {
            let (u, v) = (
                (f64::from(x) + 0.5) / 17.0,
                1.0 - (f64::from(y) + 0.5) / 9.0,
            );
            let got = map.evaluate(DVec2::new(u, v)) * 8.0;
            let want = DVec3::new(f64::from(x), f64::from(31 * y), 128.0);
            // A few ulps of the coordinates times the slope.
            assert!((got - want).abs().max_element() < 1e-10, "{got} {want}");
        }
        // A value that is no light is an error with its file.
        std::fs::write(&path, &std::fs::read(&path).unwrap()[..60]).unwrap();
        assert!(Scene::from_pbrt_str(&text, "hdr.pbrt", &LoadOptions::default()).is_err());
    }
}

/// What resampling leaves below zero is zero; other values below zero are no light.
#[cfg(feature = "hdr")]
#[test]
fn ringing_is_not_an_error() {
    use linelit_film::{Image, write_pfm};
    let folder = std::env::temp_dir().join(format!("linelit-ringing-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("a.pfm");
    let text = lit_by(&path);
    for (value, fine) in [(-0.01, true), (-0.02, false), (f32::NAN, false)] {
        let image = Image::from_fn(2, 1, |x, _| [if x == 0 { value } else { 10.0 }; 3]);
        write_pfm(&path, &image).unwrap();
        match Scene::from_pbrt_str(&text, "hdr.pbrt", &LoadOptions::default()) {
            Ok(loaded) => {
                assert!(fine, "{value}");
                let map = loaded.scene.lights[0].map.as_ref().unwrap();
                assert_eq!(map.evaluate(DVec2::new(0.25, 0.5)), DVec3::ZERO);
            }
            Err(error) => assert!(!fine && error.to_string().contains("a.pfm"), "{error}"),
        }
    }
}

#[test]
fn srgb_is_decoded() {
    let linear = texture("ramp.png", "sRGB").evaluate(DVec2::splat(0.5));
    // The curve of sRGB at 128/255.
    assert!(
        (linear.z - 0.215_860_500_113_899_26).abs() < 1e-12,
        "{linear}"
    );
}

/// A cut image, or one with a changed byte, is an image or an error.
#[test]
fn broken_images_are_errors() {
    let folder = std::env::temp_dir().join(format!("linelit-images-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for name in [
        "ramp.png",
        "interlaced.png",
        "ramp.jpg",
        "ramp-progressive.jpg",
        "grey.jpg",
    ] {
        let whole = std::fs::read(format!("tests/images/{name}")).unwrap();
        let file = folder.join(name);
        let text = format!(
            "Camera \"perspective\" WorldBegin
             Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" {:?}
             Material \"matte\" \"texture Kd\" \"t\" Shape \"sphere\"",
            file.to_str().unwrap()
        );
        let attempt = |bytes: &[u8]| {
            std::fs::write(&file, bytes).unwrap();
            Scene::from_pbrt_str(&text, "image.pbrt", &LoadOptions::default()).err()
        };
        for cut in (0..whole.len()).step_by(7) {
            attempt(&whole[..cut]);
        }
        for k in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[k] = [0, 0xff, whole[k] ^ 0x10][k % 3];
            attempt(&bytes);
        }
        let error = attempt(&whole[..whole.len() / 4]);
        if name.ends_with("png") {
            assert_eq!(error.unwrap().kind(), ErrorKind::Syntax, "{name}");
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn sizes_beyond_reason_are_refused() {
    // A header that promises 60,000 × 60,000 pixels, and next to nothing behind it.
    let mut tga = vec![
        0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x60, 0xea, 0x60, 0xea, 24, 0,
    ];
    tga.extend([0x81; 4000]);
    let file = std::env::temp_dir().join(format!("linelit-large-{}.tga", std::process::id()));
    std::fs::write(&file, tga).unwrap();
    let text = format!(
        "Camera \"perspective\" WorldBegin Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" {:?}",
        file.to_str().unwrap()
    );
    let error = Scene::from_pbrt_str(&text, "image.pbrt", &LoadOptions::default()).unwrap_err();
    std::fs::remove_file(&file).unwrap();
    assert!(
        error
            .message()
            .ends_with("a TGA image of 60000 x 60000 pixels in 4018 bytes"),
        "{error}"
    );
}
