//! Tests of image files in all formats that textures have.

use linelit_formats::{ErrorKind, LoadOptions, Root};
use linelit_geometry::{DVec2, DVec3};
use linelit_scene::{MaterialKind, Texture};
use linelit_testkit::folder::Folder;
use linelit_testkit::pictures;

/// Returns options that let scenes name images in the system's temporary folder.
fn anywhere() -> LoadOptions {
    LoadOptions {
        root: Root::Anywhere,
        ..LoadOptions::default()
    }
}

/// Reads an image file of `tests/images` as a texture. Most of them show the [`ramp`]: 17 × 9
/// pixels with the value (15 x, 31 y, 128) at pixel (x, y), the top row first.
fn texture(name: &str, encoding: &str) -> Texture {
    let text = format!(
        "Camera \"perspective\" WorldBegin
         Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"tests/images/{name}\" \"string encoding\" \"{encoding}\"
         Material \"matte\" \"texture Kd\" \"t\" Shape \"sphere\""
    );
    let loaded = linelit_formats::from_pbrt_str(&text, "image.pbrt", &LoadOptions::default());
    let scene = loaded.unwrap_or_else(|e| panic!("{e}")).scene;
    match &scene.materials.last().unwrap().kind {
        MaterialKind::Matte { kd, .. } => kd.clone(),
        other => panic!("{other:?}"),
    }
}

/// Returns the largest difference of a component of the texture from `want`, in 255ths, over the
/// centres of all pixels.
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
        // The coordinates of the centres of pixels have an error of a few ulps, which is multiplied
        // by the slope.
        let error = worst(&texture(name, "linear"), ramp);
        assert!(error < 1e-10, "{name}: {error}");
    }
}

/// The test image has 16 bits a channel: (4001 x + 7, 7001 y + 3, 2047) at pixel (x, y).
#[test]
fn png_files_of_sixteen_bits_keep_all_of_them() {
    let words = |x: f64, y: f64| DVec3::new(4001.0 * x + 7.0, 7001.0 * y + 3.0, 2047.0) / 65535.0;
    // Values below one are stored as f32, with an error of at most 2⁻²⁵; one of 65536 steps is
    // 2⁻¹⁶. The coordinates of the centres have an error of a few ulps, times the slope.
    let rounding = 255.0 * 2f64.powi(-25) + 1e-10;
    let error = worst(&texture("words.png", "linear"), |x, y| 255.0 * words(x, y));
    assert!(error < rounding, "{error}");
    let linear = |v: f64| {
        if v <= 0.04045 {
            v / 12.92
        } else {
            ((v + 0.055) / 1.055).powf(2.4)
        }
    };
    let error = worst(&texture("words.png", "sRGB"), |x, y| {
        255.0 * DVec3::from(words(x, y).to_array().map(linear))
    });
    assert!(error < rounding, "{error}");
}

#[cfg(feature = "jpeg")]
#[test]
fn jpeg_files_are_read_to_their_quality() {
    for name in ["ramp.jpg", "ramp-progressive.jpg"] {
        let error = worst(&texture(name, "linear"), ramp);
        assert!(error < 6.0, "{name}: {error}");
    }
    // The grey image has the luma of Rec. 601, which JPEG uses.
    let grey = |x, y| DVec3::splat(ramp(x, y).dot(DVec3::new(0.299, 0.587, 0.114)));
    let error = worst(&texture("grey.jpg", "linear"), grey);
    assert!(error < 6.0, "grey.jpg: {error}");
}

/// Returns the pbrt text of a scene with a triangle that emits an image.
fn lit_by(image: &std::path::Path) -> String {
    format!(
        "Camera \"perspective\" WorldBegin
         AreaLightSource \"diffuse\" \"string filename\" \"{}\"
         Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]
         \"point2 uv\" [ 0 0 1 0 0 1 ]",
        image.display()
    )
}

/// Values above one are kept, and EXR and PFM files are read without an error: the numbers of this
/// image are eighths, which are exact in both formats.
#[test]
fn exr_and_pfm_files_are_read_exactly() {
    use linelit_film::{Document, Image};
    let folder = Folder::new("hdr");
    let image = Image::from_fn(17, 9, |x, y| {
        [x, 31 * y, 128].map(|v| f32::from(u16::try_from(v).unwrap()) / 8.0)
    });
    let mut document = Document::new(17, 9);
    document.add_image("", &image).unwrap();
    let (exr, pfm) = (folder.join("a.exr"), folder.join("a.pfm"));
    document.write(&exr).unwrap();
    std::fs::write(&pfm, pictures::pfm([17, 9], &image.rgb)).unwrap();
    for path in [exr, pfm] {
        let text = lit_by(&path);
        let loaded = linelit_formats::from_pbrt_str(&text, "hdr.pbrt", &anywhere());
        let scene = loaded.unwrap_or_else(|e| panic!("{e}")).scene;
        let map = scene.lights[0].map.as_ref().unwrap();
        for (x, y) in [(0, 0), (16, 8), (3, 7)] {
            let (u, v) = (
                (f64::from(x) + 0.5) / 17.0,
                1.0 - (f64::from(y) + 0.5) / 9.0,
            );
            let got = map.evaluate(DVec2::new(u, v)) * 8.0;
            let want = DVec3::new(f64::from(x), f64::from(31 * y), 128.0);
            // The error of the coordinates is a few ulps, times the slope.
            assert!((got - want).abs().max_element() < 1e-10, "{got} {want}");
        }
        // A value that is no light is an error with its file.
        std::fs::write(&path, &std::fs::read(&path).unwrap()[..60]).unwrap();
        assert!(linelit_formats::from_pbrt_str(&text, "hdr.pbrt", &anywhere()).is_err());
    }
}

/// Values below zero are read as zero. If they are as small as those that resampling leaves, there
/// is no warning; else there is one that names the pixel. Values that are not finite are an error
/// that names the pixel.
#[test]
fn values_below_zero_are_zero() {
    let folder = Folder::new("ringing");
    let path = folder.join("a.pfm");
    let text = lit_by(&path);
    let load = |value: f32| {
        let bytes = pictures::pfm([2, 1], &[[10.0; 3], [value; 3]]);
        std::fs::write(&path, bytes).unwrap();
        linelit_formats::from_pbrt_str(&text, "hdr.pbrt", &anywhere())
    };
    for (value, warnings) in [(-0.01, 0), (-0.02, 1), (-50.0, 1)] {
        let loaded = load(value).unwrap();
        let map = loaded.scene.lights[0].map.as_ref().unwrap();
        assert_eq!(map.evaluate(DVec2::new(0.75, 0.5)), DVec3::ZERO);
        assert_eq!(loaded.warnings.len(), warnings, "{value}");
        for warning in &loaded.warnings {
            let want = format!(
                "1 pixels are below zero and read as zero; the least is {value} at pixel (1, 0)"
            );
            assert!(warning.message().ends_with(&want), "{warning}");
        }
    }
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let error = load(value).unwrap_err();
        assert!(
            error.message().contains("a.pfm`: pixel (1, 0) is ["),
            "{error}"
        );
    }
}

#[test]
fn srgb_is_decoded() {
    let linear = texture("ramp.png", "sRGB").evaluate(DVec2::splat(0.5));
    // The blue channel is 128 everywhere; compare it with the sRGB curve at 128/255.
    assert!(
        (linear.z - 0.215_860_500_113_899_26).abs() < 1e-12,
        "{linear}"
    );
}

/// An image that is cut off or has a changed byte is read or is an error, but never a panic.
#[test]
fn broken_images_are_errors() {
    let folder = Folder::new("images");
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
            linelit_formats::from_pbrt_str(&text, "image.pbrt", &anywhere()).err()
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
}

#[test]
fn sizes_beyond_reason_are_refused() {
    // The header promises 60,000 × 60,000 pixels, but only 4000 bytes follow.
    let mut tga = vec![
        0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x60, 0xea, 0x60, 0xea, 24, 0,
    ];
    tga.extend([0x81; 4000]);
    let folder = Folder::new("large");
    let file = folder.join("a.tga");
    std::fs::write(&file, tga).unwrap();
    let text = format!(
        "Camera \"perspective\" WorldBegin Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" {:?}",
        file.to_str().unwrap()
    );
    let error = linelit_formats::from_pbrt_str(&text, "image.pbrt", &anywhere()).unwrap_err();
    assert!(
        error
            .message()
            .ends_with("a TGA image of 60000 x 60000 pixels takes 10800000000 bytes, 268692608 are allowed for a file of 4018"),
        "{error}"
    );
}

/// Returns an EXR file of one block with the attribute `chromaticities` added to its header.
fn with_chromaticities(exr: &[u8], values: [f32; 8]) -> Vec<u8> {
    let mut attribute = b"chromaticities\0chromaticities\0".to_vec();
    attribute.extend(32_u32.to_le_bytes());
    attribute.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    // Insert the attribute after the magic number and the version.
    let name = b"linelit\0";
    let end = exr.windows(name.len()).position(|w| w == name);
    assert!(end.is_none_or(|e| e > 8));
    let mut bytes = [&exr[..8], &attribute, &exr[8..]].concat();
    // Move the offset of the block by the attribute's length.
    let table = exr_table(&bytes);
    let offset = u64::from_le_bytes(*bytes[table..].first_chunk().unwrap());
    let moved = offset + u64::try_from(attribute.len()).unwrap();
    bytes[table..table + 8].copy_from_slice(&moved.to_le_bytes());
    bytes
}

/// Returns where the table of block offsets begins, which is right after the header.
fn exr_table(bytes: &[u8]) -> usize {
    let end_of_text = |at: usize| at + bytes[at..].iter().position(|b| *b == 0).unwrap() + 1;
    let mut at = 8;
    while bytes[at] != 0 {
        let size = end_of_text(end_of_text(at));
        let length = u32::from_le_bytes(*bytes[size..].first_chunk().unwrap());
        at = size + 4 + length as usize;
    }
    at + 1
}

/// The picture is stored in XYZ and has two pixels: the white D65 and the red of Rec. 709. They
/// must be read as (1, 1, 1) and (1, 0, 0).
#[test]
fn primaries_of_exr_files_are_converted() {
    use linelit_film::{Document, Image};
    let folder = Folder::new("primaries");
    let xyz = [
        [0.950_456, 1.0, 1.089_058],
        [0.412_391, 0.212_639, 0.019_331],
    ];
    let image = Image::from_fn(2, 1, |x, _| xyz[x as usize]);
    let mut document = Document::new(2, 1);
    document.add_image("", &image).unwrap();
    let path = folder.join("xyz.exr");
    let third = 1.0 / 3.0;
    let xyz = with_chromaticities(
        &document.encode().unwrap(),
        [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, third, third],
    );
    std::fs::write(&path, xyz).unwrap();
    let loaded = linelit_formats::from_pbrt_str(&lit_by(&path), "hdr.pbrt", &anywhere());
    let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
    let map = loaded.scene.lights[0].map.as_ref().unwrap();
    for (u, want) in [(0.25, DVec3::ONE), (0.75, DVec3::X)] {
        let got = map.evaluate(DVec2::new(u, 0.5));
        // The values above have six digits, and the matrix enlarges their errors by at most 3.3.
        assert!((got - want).abs().max_element() < 4e-6, "{got}");
    }
}
