//! Tests of damaged files of lights: each file is cut off at every byte, and each of its words is
//! replaced by others. The result must either be read or be refused with a message that names the
//! file and the position.

use linelit_formats::{LoadOptions, Loaded, Root, SceneError, from_pbrt_str};
use linelit_geometry::DVec3;
use linelit_lights::{DeltaSample, Light};
use linelit_testkit::folder::Folder;

/// The replacements that are tried for each word.
const WORDS: [&str; 16] = [
    "", "nan", "-1", "0", "180", "1e38", "-1e38", "1e999", "\"x\"", "NaN", "7.5", "1e-40", "\"\"",
    "true", "[", "]",
];

/// Returns all damaged versions of a text: those cut off at every byte, and those in which one
/// word is replaced by one of `others`.
fn spoilt(text: &str, others: &[&str]) -> Vec<String> {
    let mut all: Vec<String> = (0..text.len())
        .filter_map(|end| Some(text.get(..end)?.to_owned()))
        .collect();
    let is_word = |c: char| !c.is_whitespace() && !",:{}[]".contains(c);
    let mut start = 0;
    while let Some(first) = text[start..].find(is_word).map(|k| start + k) {
        let end = text[first..].find(|c| !is_word(c));
        let end = end.map_or(text.len(), |k| first + k);
        all.extend(others.iter().map(|other| {
            let (before, after) = (&text[..first], &text[end..]);
            format!("{before}{other}{after}")
        }));
        start = end;
    }
    all
}

/// Returns whether a damaged text was read.
///
/// If it was, all lights of the scene must give finite values that are not negative. If it was
/// not, the error must name one of `files`.
fn is_read(text: &str, result: Result<Loaded, SceneError>, files: &[&str]) -> bool {
    let loaded = match result {
        Ok(loaded) => loaded,
        Err(error) => {
            let error = error.to_string();
            let named = files.iter().any(|file| error.contains(&format!("{file}:")));
            assert!(named, "{text}\n{error}");
            return false;
        }
    };
    for light in &loaded.scene.lights {
        let light = &*light.light;
        let x = DVec3::new(0.3, -0.2, 0.1);
        let at_x = |beam: Option<DeltaSample>| beam.map_or(DVec3::ZERO, |beam| beam.irradiance);
        let (emitted, shown) = match light {
            Light::Point(light) => (light.intensity, at_x(light.beam(x))),
            Light::Distant(light) => (light.irradiance, at_x(light.beam(x))),
            Light::Sky(light) => (light.mean(), light.radiance(x, DVec3::Z)),
            light => (light.emission().radiance, DVec3::ZERO),
        };
        for value in [emitted, shown] {
            let is_good = value.is_finite() && value.min_element() >= 0.0;
            assert!(is_good, "{text}: {value} of {light:?}");
        }
    }
    true
}

/// Asserts that some of the texts were read and that some were refused.
fn count(all: &[String], read: impl FnMut(&&String) -> bool) {
    let good = all.iter().filter(read).count();
    assert!(good > 0 && good < all.len(), "{good} of {}", all.len());
}

const SQUARE: &str = "Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 4 0 0 0 4 0 4 4 0 ]\n";

fn options() -> LoadOptions {
    LoadOptions {
        root: Root::Anywhere,
        ..LoadOptions::default()
    }
}

#[test]
fn spoilt_lights_of_pbrt_are_read_or_refused() {
    for light in [
        "LightSource \"point\" \"rgb I\" [ 1 2 3 ] \"float power\" 5 \"float scale\" 2 \
         \"point3 from\" [ 1 0 1 ]",
        "LightSource \"spot\" \"blackbody I\" 3000 \"float coneangle\" 30 \
         \"float conedeltaangle\" 5 \"point3 from\" [ 1 0 1 ] \"point3 to\" [ 0 0 0 ]",
        "Rotate 30 0 1 0 LightSource \"goniometric\" \"string mapname\" \
         \"tests/images/ramp.png\" \"float power\" 3",
        "LightSource \"distant\" \"rgb L\" [ 1 2 3 ] \"float illuminance\" 3 \
         \"point3 from\" [ 0 0 1 ] \"point3 to\" [ 0 0 0 ] \"float angle\" 0.5",
        "Rotate 30 1 1 0 LightSource \"infinite\" \"rgb L\" [ 1 2 3 ] \"float illuminance\" 3 \
         \"point3 portal\" [ 0 0 5 0 1 5 1 1 5 1 0 5 ]",
        "Scale 2 -1 1 LightSource \"infinite\" \"string mapname\" \"tests/images/ramp.png\" \
         \"float scale\" 2 \"float illuminance\" 3",
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ 1 2 3 ] \"float coneangle\" 30 \
         \"float conedeltaangle\" 5 Shape \"disk\" AttributeEnd",
        "AttributeBegin AreaLightSource \"diffuse\" \"float power\" 2 \"float focus\" 3 \
         Shape \"sphere\" AttributeEnd",
    ] {
        count(&spoilt(light, &WORDS), |light| {
            let text = format!("Camera \"perspective\"\nWorldBegin\n{SQUARE}{light}");
            is_read(
                light,
                from_pbrt_str(&text, "a.pbrt", &options()),
                &["a.pbrt"],
            )
        });
    }
}

#[test]
fn spoilt_ies_files_are_read_or_refused() {
    let folder = Folder::new("spoilt-ies");
    let path = folder.join("lamp.ies");
    let name = path.display();
    let light = format!("LightSource \"point\" \"string iesfile\" \"{name}\"");
    let text = format!("Camera \"perspective\"\nWorldBegin\n{SQUARE}{light}\n");
    let file = "IESNA:LM-63-2002\n[TEST] none\nTILT=INCLUDE\n1\n2\n0 90\n1 .8\n\
                1 1000 2 3 2 1 2 0 0 0\n1.5 1 50\n0 45 90\n0 90\n100 60 0\n100,20 0\n";
    count(&spoilt(file, &WORDS[..9]), |file| {
        std::fs::write(&path, file).unwrap();
        let files = ["lamp.ies", "a.pbrt"];
        is_read(file, from_pbrt_str(&text, "a.pbrt", &options()), &files)
    });
}

#[cfg(feature = "gltf")]
#[test]
fn spoilt_lights_of_gltf_are_read_or_refused() {
    let text = r#"{ "asset": { "version": "2.0" }, "extensionsUsed": [ "KHR_lights_punctual" ],
        "extensions": { "KHR_lights_punctual": { "lights": [
            { "type": "point", "color": [ 1, 0.5, 0 ], "intensity": 2e8, "range": 5 },
            { "type": "spot", "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.5 } },
            { "type": "directional", "intensity": 3 } ] } },
        "nodes": [ { "rotation": [ 0, 0.6, 0, 0.8 ], "scale": [ 1, 2, 1 ], "translation": [ 1, 2, 3 ],
                     "extensions": { "KHR_lights_punctual": { "light": 0 } } },
                   { "extensions": { "KHR_lights_punctual": { "light": 1 } } },
                   { "extensions": { "KHR_lights_punctual": { "light": 2 } } } ] }"#;
    let more = ["1e300", "-1e300", "1.5", "4294967296", "{}", "[]", "null"];
    count(&spoilt(text, &[&WORDS[..], &more].concat()), |text| {
        let format = linelit_formats::Format::Gltf;
        let loaded = linelit_formats::from_bytes(format, text.as_bytes(), "a.gltf", &options());
        is_read(text, loaded, &["a.gltf"])
    });
}
