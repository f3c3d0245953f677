//! Tests of whole files: what is written is read again, and damaged files do not cause a panic.

use std::fs;
use std::path::Path;

use linelit_film::{
    Channel, Compression, Document, FilmError, Image, Placement, Samples, decode_exr,
    decode_picture, write_atomically,
};
use linelit_testkit::cases::cases;
use linelit_testkit::folder::Folder;
use linelit_testkit::pictures::pfm;
use proptest::prelude::*;

fn picture() -> Image {
    Image::from_fn(7, 5, |x, y| {
        let value = (x * 31 + y * 17) as f32 / 7.0;
        [value, value / 3.0, 1e9 * value]
    })
}

fn document() -> Document {
    let mut document = Document::new(7, 5);
    document.add_image("", &picture()).unwrap();
    document
        .add_scalar("depth", (0..35_u8).map(f32::from).collect())
        .unwrap();
    document
        .add_counts("segments", (0..35).map(|k| k * 123_456_789).collect())
        .unwrap();
    for (name, value) in [
        ("samples", "64"),
        ("seed", "18446744073709551615"),
        ("commit", "abc"),
        ("scene", "Fähre ½"),
    ] {
        document.set(name, value);
    }
    document
}

#[test]
fn an_exr_document_comes_back_bit_for_bit() {
    let folder = Folder::new("film-round");
    let path = folder.join("a.exr");
    let mut document = document();
    document.placement = Some(Placement {
        origin: [3, 4],
        full: [100, 50],
        corner: [0, 0],
    });
    document.world_to = [Some([0.5; 16].map(|x| x / 3.0)), None];
    document.write(&path).unwrap();
    let again = Document::read(&path).unwrap();
    assert_eq!(again.metadata, document.metadata);
    assert_eq!(again.world_to, document.world_to);
    assert_eq!(again.placement, document.placement);
    for layer in &document.layers {
        let found = again.layer(&layer.name).unwrap();
        for channel in &layer.channels {
            assert_eq!(
                found.channel(&channel.name),
                Some(&channel.samples),
                "{}",
                layer.name
            );
        }
    }
    assert_eq!(Image::read(&path).unwrap(), picture());
    let segments = Image::read_layer(&path, Some("segments")).unwrap();
    // 246 913 578 to the nearest f32, whose neighbours are 16 apart.
    assert!((segments.get(2, 0)[1] - 246_913_578.0).abs() <= 8.0);
    let error = Image::read_layer(&path, Some("nothing")).unwrap_err();
    assert!(
        error.to_string().ends_with(
            "expected a layer named `nothing`, found the unnamed layer, `depth`, `segments`"
        ),
        "{error}"
    );
}

/// The error for a file without a main picture names the layers that it has.
#[test]
fn a_file_of_several_layers_has_no_picture_by_itself() {
    let folder = Folder::new("film-layers");
    let path = folder.join("a.exr");
    let mut document = Document::new(2, 1);
    for (name, value) in [("diffuse", 0.5), ("specular", 0.25)] {
        let image = Image::from_fn(2, 1, |_, _| [value; 3]);
        document.add_image(name, &image).unwrap();
    }
    document.layers[0].channels.push(Channel {
        name: "Z".to_owned(),
        samples: Samples::Float(vec![9.0; 2]),
    });
    document.write(&path).unwrap();
    let expected = "expected colour or luminance in the unnamed layer, or colour in a single one, \
                    found `diffuse`, `specular`";
    let error = Image::read(&path).unwrap_err().to_string();
    assert!(error.ends_with(expected), "{error}");
    let bytes = fs::read(&path).unwrap();
    let decoded = decode_picture("a.exr", &bytes).unwrap();
    let error = decoded.unwrap_err().to_string();
    assert!(error.ends_with(expected), "{error}");
    assert_eq!(document.main_image(), None);
    let grey = |value| Image::from_fn(2, 1, |_, _| [value; 3]);
    let specular = Image::read_layer(&path, Some("specular"));
    assert_eq!(specular.unwrap(), grey(0.25));
    // A single layer with colours is the main picture whatever its name is.
    document.layers.remove(1);
    document.write(&path).unwrap();
    assert_eq!(Image::read(&path).unwrap(), grey(0.5));
    assert_eq!(document.main_image(), Some(Image::read(&path).unwrap()));
}

#[test]
fn pictures_that_are_parts_of_one_say_where_they_lie() {
    let decoded = |placement: Option<Placement>| {
        let mut document = Document::new(2, 1);
        document.add_image("", &Image::new(2, 1)).unwrap();
        document.placement = placement;
        let bytes = document.encode().unwrap();
        assert_eq!(decode_exr(&bytes).unwrap().placement, placement);
        decode_picture("a.exr", &bytes).unwrap().unwrap().warning
    };
    let at = |origin, full, corner| {
        Some(Placement {
            origin,
            full,
            corner,
        })
    };
    assert_eq!(decoded(None), None);
    // A picture that is whole needs no warning, whatever the coordinates of its corner are.
    assert_eq!(decoded(at([0, 0], [2, 1], [7, -8])), None);
    for (origin, corner) in [([3, 0], [0, 0]), ([-1, 2], [4, 4])] {
        let warning = decoded(at(origin, [16, 9], corner)).unwrap();
        let [x, y] = origin;
        let want = format!("its pixels lie at {x}, {y} of a picture of 16 x 9");
        assert!(warning.starts_with(&want), "{warning}");
    }
}

#[test]
fn equal_documents_are_equal_files() {
    // The exr crate keeps metadata in hash maps of random order, which must not show in the file.
    let first = document().encode().unwrap();
    for _ in 0..8 {
        assert_eq!(document().encode().unwrap(), first);
    }
}

/// The picture has blocks of 16 rows and a last one of fewer. Some blocks are noise, which does not
/// shrink and is stored uncompressed, and some can be compressed.
#[test]
fn every_compression_comes_back_bit_for_bit_from_any_number_of_threads() {
    const SIZE: [u32; 2] = [37, 300];
    let mut document = Document::new(SIZE[0], SIZE[1]);
    let count = SIZE[0] * SIZE[1];
    let noise = |k: u32| k.wrapping_mul(0x9E37_79B9).rotate_left(k % 31) ^ k.wrapping_mul(k);
    let values = (0..count).map(|k| if k < count / 2 { noise(k) } else { k / 9 });
    document.add_counts("counts", values.collect()).unwrap();
    let smooth = Image::from_fn(SIZE[0], SIZE[1], |x, y| [x as f32, 0.1 * y as f32, 0.0]);
    document.add_image("", &smooth).unwrap();
    document.placement = Some(Placement {
        origin: [-7, 40],
        full: [100, 500],
        corner: [5, -3],
    });
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let mut sizes = Vec::new();
    for text in ["none", "rle", "zip:1", "zip:4", "zip:9"] {
        let compression: Compression = text.parse().unwrap();
        assert_eq!(compression.to_string(), text);
        let bytes = document.clone().into_bytes(compression).unwrap();
        let again = decode_exr(&bytes).unwrap();
        assert_eq!(again.placement, document.placement, "{text}");
        for name in ["", "counts"] {
            assert_eq!(again.layer(name), document.layer(name), "{text} `{name}`");
        }
        for threads in [1, 3] {
            let again = document.clone();
            let again = pool(threads)
                .unwrap()
                .install(|| again.into_bytes(compression));
            assert!(again.unwrap() == bytes, "{text}, {threads} threads");
        }
        sizes.push(bytes.len());
    }
    assert!(sizes.is_sorted_by(|a, b| a > b), "{sizes:?}");
}

#[test]
fn not_a_number_and_infinity_survive() {
    let mut image = Image::new(2, 1);
    image.rgb = vec![
        [f32::NAN, f32::INFINITY, -0.0],
        [f32::MIN_POSITIVE / 2.0, 1.0, f32::MAX],
    ];
    let mut document = Document::new(2, 1);
    document.add_image("", &image).unwrap();
    let again = decode_exr(&document.encode().unwrap())
        .unwrap()
        .main_image()
        .unwrap();
    let bits = |image: &Image| {
        image
            .rgb
            .iter()
            .flatten()
            .map(|v| v.to_bits())
            .collect::<Vec<_>>()
    };
    assert_eq!(bits(&again), bits(&image));
}

#[test]
fn what_cannot_be_stored_is_refused() {
    let mut document = Document::new(2, 2);
    assert!(
        document
            .encode()
            .unwrap_err()
            .to_string()
            .contains("no layer")
    );
    assert!(document.add_scalar("x", vec![0.0; 3]).is_err());
    assert!(matches!(
        document.add_image("", &Image::new(1, 4)),
        Err(FilmError::Size {
            expected: [2, 2],
            found: [1, 4]
        })
    ));
    let broken = Image {
        width: 2,
        height: 2,
        rgb: vec![[0.0; 3]; 3],
    };
    assert!(document.add_image("", &broken).is_err());
    assert!(Document::new(0, 0).encode().is_err());
}

#[test]
fn a_pfm_comes_back_bit_for_bit() {
    let folder = Folder::new("film-pfm");
    let image = picture();
    fs::write(folder.join("a.pfm"), pfm([7, 5], &image.rgb)).unwrap();
    assert_eq!(Image::read(&folder.join("a.pfm")).unwrap(), image);
}

#[test]
fn writing_replaces_whole_files_and_leaves_nothing_behind() {
    let folder = Folder::new("film-atomic");
    let path = folder.join("x.txt");
    write_atomically(&path, b"old and long").unwrap();
    write_atomically(&path, b"new").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
    assert_eq!(folder.names(), ["x.txt"]);
    write_atomically(&folder.join("deeper/still/y"), b"1").unwrap();
    // A folder already has the name that the file should get.
    let error = write_atomically(&folder.join("deeper"), b"2").unwrap_err();
    assert!(
        error.to_string().contains("deeper: cannot write"),
        "{error}"
    );
    assert_eq!(folder.names(), ["deeper", "x.txt"]);
    assert!(write_atomically(Path::new("/"), b"3").is_err());
}

#[test]
fn errors_name_the_file() {
    let folder = Folder::new("film-errors");
    let missing = folder.join("none.exr");
    let error = Image::read(&missing).unwrap_err().to_string();
    assert!(
        error.starts_with(&format!("{}: cannot read: ", missing.display())),
        "{error}"
    );
    let text = folder.join("text.exr");
    fs::write(&text, "hello").unwrap();
    let error = Image::read(&text).unwrap_err().to_string();
    assert!(error.ends_with(
        "text.exr: not a readable OpenEXR file: expected the magic number [76, 2f, 31, 01], found another file of 5 bytes"
    ), "{error}");
}

#[test]
fn truncated_files_are_errors() {
    let bytes = document().encode().unwrap();
    for length in 0..bytes.len() {
        let error = decode_exr(&bytes[..length]).expect_err("a truncated file");
        assert_eq!(error.format, "OpenEXR");
    }
}

#[test]
fn a_header_that_promises_terabytes_is_refused() {
    let mut bytes = document().encode().unwrap();
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    // Change only the width, because the height must agree with the number of chunks.
    bytes[at + 8..at + 12].copy_from_slice(&900_000_000_i32.to_le_bytes());
    let error = decode_exr(&bytes).unwrap_err();
    assert!(
        error.expected.contains("bytes of pixels in a file of"),
        "{error}"
    );
}

/// The memory that a picture needs is checked before it is unpacked. It is 12 bytes for each pixel
/// plus the largest block.
#[test]
fn pictures_beyond_the_limit_are_refused_with_the_numbers() {
    let mut document = Document::new(100, 50);
    document.add_image("", &Image::new(100, 50)).unwrap();
    document.add_scalar("depth", vec![0.0; 5000]).unwrap();
    let bytes = document.encode().unwrap();
    // The largest block has 16 rows of 100 pixels with four channels of 4 bytes.
    let needed = 5000 * 12 + 100 * 16 * 4 * 4;
    assert_eq!(
        Image::from_bytes(&bytes, needed).unwrap(),
        Image::new(100, 50)
    );
    let error = Image::from_bytes(&bytes, needed - 1)
        .unwrap_err()
        .to_string();
    let want = format!(
        "expected a picture that takes at most {} bytes, found 100 × 50 pixels that take {needed}",
        needed - 1
    );
    assert!(error.ends_with(&want), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        cases: cases(2000),
        ..ProptestConfig::default()
    })]

    #[test]
    fn damaged_exr_files_do_not_panic(
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        in_header in any::<bool>(),
    ) {
        let mut bytes = document().encode().unwrap();
        let reach = if in_header { 700.min(bytes.len()) } else { bytes.len() };
        for (index, value) in damage {
            bytes[index.index(reach)] = value;
        }
        let _ = decode_exr(&bytes);
        let _ = Image::from_bytes(&bytes, 1 << 24);
    }

    #[test]
    fn noise_does_not_panic(noise in prop::collection::vec(any::<u8>(), 0..300)) {
        let mut exr = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
        exr.extend(&noise);
        prop_assert!(decode_exr(&exr).is_err());
        let folder = Folder::new("film-noise");
        let path = folder.join("n.pfm");
        let mut pfm = b"PF\n".to_vec();
        pfm.extend(&noise);
        fs::write(&path, &pfm).unwrap();
        let _ = Image::read(&path);
    }
}
