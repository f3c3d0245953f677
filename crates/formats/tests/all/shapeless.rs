//! Tests of lights without a shape: pbrt's light sources and glTF's punctual lights.

use crate::common::{load, world, write_tga};
use linelit_formats::{LoadOptions, from_pbrt_str};
use linelit_geometry::DVec3;
use linelit_lights::{DistantLight, Light, PointLight, Sky, SkyEmission};
use linelit_scene::SceneDescription;
use linelit_testkit::folder::Folder;
use std::f64::consts::PI;

fn point(scene: &SceneDescription) -> &PointLight {
    match &*scene.lights[0].light {
        Light::Point(light) => light,
        other => panic!("{other:?} is no point"),
    }
}

fn distant(scene: &SceneDescription) -> &DistantLight {
    match &*scene.lights[0].light {
        Light::Distant(light) => light,
        other => panic!("{other:?} is not distant"),
    }
}

fn sky(scene: &SceneDescription) -> &Sky {
    match &*scene.lights[0].light {
        Light::Sky(light) => light,
        other => panic!("{other:?} is no sky"),
    }
}

fn near(got: DVec3, want: DVec3) {
    assert!(
        got.distance(want) <= 1e-12 * want.length().max(1.0),
        "{got} is not {want}"
    );
}

const SQUARE: &str = "Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 4 0 0 0 4 0 4 4 0 ]\n";

#[test]
fn points_stand_where_the_transform_says() {
    let scene = world(
        "Translate 1 2 3 Scale 2 2 2 LightSource \"point\" \"rgb I\" [ 1 2 3 ] \"float scale\" 2 \
         \"point3 from\" [ 1 0 0 ]",
    );
    let light = point(&scene);
    near(light.position, DVec3::new(3.0, 2.0, 3.0));
    near(light.intensity, DVec3::new(2.0, 4.0, 6.0));
    assert!(light.profile.is_none());
    // `from` of a point light is a position: (0, 0, 1), which is the default `to` of other lights.
    let scene = world("LightSource \"point\" \"point3 from\" [ 0 0 1 ]");
    near(point(&scene).position, DVec3::Z);
    // `power` sets the power of the whole light, of a sphere of directions or of a cone.
    for text in [
        "\"point\"",
        "\"spot\" \"point3 to\" [ 1 0 0 ]",
        "\"spot\" \"float coneangle\" 60 \"float conedeltaangle\" 60",
    ] {
        let scene = world(&format!("LightSource {text} \"float power\" 100"));
        let power = scene.lights[0].light.power();
        assert!((power / 100.0 - 1.0).abs() < 1e-12, "{text}: {power}");
    }
}

/// Where the cosine is half-way between those of the inner and the outer cone, the smoothstep of
/// pbrt-v4 gives a half, and the fourth power of pbrt-v3 gives 1/16.
#[test]
fn spots_end_as_the_version_says() {
    let spot = "LightSource \"spot\" \"float coneangle\" 60 \"float conedeltaangle\" 60 \
                \"point from\" [ 0 0 0 ] \"point to\" [ 0 2 0 ] \"rgb I\" [ 8 8 8 ]";
    let camera = "Camera \"perspective\"\nWorldBegin\n";
    for (film, factor) in [("Film \"rgb\"", 0.5), ("Film \"image\"", 1.0 / 16.0)] {
        let scene = load(&format!("{film} {camera} {spot}")).scene;
        let light = point(&scene);
        let w = DVec3::new((1.0 - 0.75 * 0.75_f64).sqrt(), 0.75, 0.0);
        let beam = light.beam(w * 2.0).expect("lit");
        near(beam.irradiance, DVec3::splat(8.0 * factor / 4.0));
        assert!(light.beam(DVec3::new(2.0, 0.9, 0.0)).is_none());
        near(light.beam(DVec3::Y).unwrap().irradiance, DVec3::splat(8.0));
    }
}

#[test]
fn distant_light_knows_the_scene() {
    let text = format!(
        "{SQUARE} AttributeBegin Rotate 90 0 0 1 LightSource \"distant\" \"rgb L\" [ 1 1 1 ] \
         \"float illuminance\" 3 \"point3 from\" [ 1 0 1 ] \"point3 to\" [ 0 0 0 ] AttributeEnd"
    );
    let scene = world(&text);
    let light = distant(&scene);
    near(light.direction, DVec3::new(0.0, 1.0, 1.0).normalize());
    near(light.irradiance, DVec3::splat(3.0));
    near(light.scene.center, DVec3::new(2.0, 2.0, 0.0));
    assert!((light.scene.radius - 8f64.sqrt()).abs() < 1e-12);
    assert!((scene.lights[0].light.power() - 24.0 * PI).abs() < 1e-9);
    // A scene without any shapes has a bounding sphere of radius zero.
    let scene = world("LightSource \"distant\" LightSource \"infinite\"");
    assert_eq!((scene.lights.len(), distant(&scene).scene.radius), (2, 0.0));
}

/// Returns the irradiance from a sun on a wall with the given normal.
///
/// It is computed by a midpoint rule over a spherical cap around the centre of the sun, which is
/// twice as high as the sun's own cap. The integrand is linear in the direction, so that the rule
/// is exact.
fn irradiance(sky: &Sky, middle: DVec3, cap_height: f64, normal: DVec3) -> DVec3 {
    const N: u32 = 64;
    let frame = linelit_geometry::Frame::from_normal(middle);
    let mut sum = DVec3::ZERO;
    for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
        let c = 1.0 - 2.0 * cap_height * (f64::from(i) + 0.5) / f64::from(N);
        let (s, phi) = ((1.0 - c * c).sqrt(), 2.0 * PI * f64::from(j) / f64::from(N));
        let w = frame.to_world(DVec3::new(s * phi.cos(), s * phi.sin(), c));
        sum += sky.radiance(DVec3::ZERO, w) * normal.dot(w);
    }
    sum * (2.0 * cap_height * 2.0 * PI / f64::from(N * N))
}

/// A distant light with an angle becomes a sun, which lights walls just as parallel light does,
/// however wide it is. At an angle of zero it stays parallel light.
#[test]
fn distant_light_with_an_angle_is_a_sun() {
    let text = "LightSource \"distant\" \"rgb L\" [ 1 2 3 ] \"float illuminance\" 4 \
                \"point3 from\" [ 3 0 4 ] \"point3 to\" [ 0 0 0 ]";
    let parallel = world(text);
    let parallel = distant(&parallel).beam(DVec3::ZERO).unwrap();
    for angle in [1e-3, 0.53, 10.0, 120.0, 180.0_f64] {
        let scene = world(&format!("{text} \"float angle\" {angle}"));
        let (sun, half) = (sky(&scene), 0.5 * angle.to_radians());
        let middle = DVec3::new(0.6, 0.0, 0.8);
        let cap_height = 2.0 * (0.5 * half).sin().powi(2);
        for tilt in [0.0, 0.4] {
            // Only compare walls that see the whole sun: those whose tilt and the half angle of
            // the sun add up to 90° at most.
            if tilt + half > 0.5 * PI + 1e-9 {
                continue;
            }
            let normal = DVec3::new(0.6 * f64::cos(tilt), f64::sin(tilt), 0.8 * f64::cos(tilt));
            let got = irradiance(sun, middle, cap_height, normal);
            near(got, parallel.irradiance * normal.dot(middle));
        }
    }
    for angle in ["0", "1e-9"] {
        let scene = world(&format!("{text} \"float angle\" {angle}"));
        near(distant(&scene).irradiance, parallel.irradiance);
    }
}

#[test]
fn environments_are_skies() {
    let scene = world(&format!(
        "{SQUARE} LightSource \"infinite\" \"rgb L\" [ 1 2 3 ] \"float illuminance\" 6"
    ));
    near(sky(&scene).mean(), DVec3::new(1.0, 2.0, 3.0) * (6.0 / PI));
    assert!(sky(&scene).portal.is_none());
    // An image by longitude and latitude: green at longitude 3π/4, turned by 90° about z.
    let folder = Folder::new("environments");
    let path = folder.join("sky.tga");
    let mut pixels = [[0, 0, 0]; 8];
    pixels[1] = [0, 255, 0];
    write_tga(&path, [4, 2], &pixels);
    let name = path.display();
    let text = format!(
        "{SQUARE} Rotate 90 0 0 1 LightSource \"infinite\" \"string mapname\" \"{name}\" \
         \"rgb L\" [ 2 2 2 ]"
    );
    let scene = world(&text);
    let along = |longitude: f64| {
        let (s, c) = longitude.sin_cos();
        sky(&scene).along(DVec3::new(c, s, 1.0).normalize())
    };
    near(along(1.25 * PI), DVec3::new(0.0, 2.0, 0.0));
    near(along(0.25 * PI), DVec3::ZERO);
    assert!(scene.texture_memory() > 8 * 12);
    // The equal-area map of version 4 is square.
    let wrong = format!(
        "Camera \"perspective\" WorldBegin {SQUARE} LightSource \"infinite\" \"string filename\" \"{name}\""
    );
    let options = LoadOptions {
        root: linelit_formats::Root::Anywhere,
        ..LoadOptions::default()
    };
    let error = from_pbrt_str(&wrong, "a.pbrt", &options)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("square, this is 4 x 2") && error.contains("mapname"),
        "{error}"
    );
    // Through a portal.
    let scene = world(&format!(
        "{SQUARE} LightSource \"infinite\" \"point3 portal\" [ 0 0 5 0 1 5 1 1 5 1 0 5 ]"
    ));
    let portal = sky(&scene).portal.as_ref().expect("a portal");
    assert!(portal.normal().z < 0.0);
    assert!(matches!(sky(&scene).emission, SkyEmission::Constant(_)));
}

/// For environments and goniometers pbrt-v4 takes the nearest pixel of the equal-area map, and
/// pbrt-v3 interpolates. Behind a portal pbrt-v4 resamples the image by interpolation.
#[test]
fn images_of_version_4_are_looked_up_by_the_nearest_pixel() {
    let folder = Folder::new("nearest");
    let path = folder.join("quarter.tga");
    // Write an image of 4 × 4 pixels in which only that at column 2 and row 1 is white. Its
    // directions have x > 0 > y.
    let mut pixels = [[0, 0, 0]; 16];
    pixels[6] = [255, 255, 255];
    write_tga(&path, [4, 4], &pixels);
    let name = path.display();
    let direction = |x: f64, y: f64| linelit_lights::octahedral::square_to_sphere([x, y]);
    let places = [
        (0.51, 1.0),
        (0.74, 1.0),
        (0.6, 1.0),
        (0.49, 0.0),
        (0.76, 0.0),
    ];
    let at = |x: f64| direction(x, 0.375);
    let read = |light: &str| {
        load(&format!(
            "Camera \"perspective\" WorldBegin {SQUARE} LightSource {light}"
        ))
        .scene
    };
    let file = format!("\"string filename\" \"{name}\"");
    let scene = read(&format!("\"infinite\" {file}"));
    for (x, value) in places {
        near(sky(&scene).along(at(x)), DVec3::splat(value));
    }
    let portal = "\"point3 portal\" [ 0 0 5 0 1 5 1 1 5 1 0 5 ]";
    let scene = read(&format!("\"infinite\" {file} {portal}"));
    near(sky(&scene).along(at(0.5)), DVec3::splat(0.5));
    let scene = read(&format!("\"goniometric\" {file}"));
    let profile = point(&scene).profile.as_ref().expect("an image");
    // The white pixel covers a sixteenth of the sphere and has the same value everywhere.
    near(profile.mean(), DVec3::splat(1.0 / 16.0));
    let values = (0..4000).map(|k| {
        let z = 1.0 - (f64::from(k) + 0.5) / 2000.0;
        let (s, c) = (2.4 * f64::from(k)).sin_cos();
        let sine = (1.0 - z * z).sqrt();
        profile.factor(DVec3::new(sine * c, sine * s, z)).x
    });
    let (white, black): (Vec<f64>, Vec<f64>) = values.partition(|v| *v > 0.0);
    assert!(white.iter().all(|v| (v - 1.0).abs() < 1e-12) && !black.is_empty());
    assert!((150..350).contains(&white.len()), "{}", white.len());
    // With pbrt-v3's interpolation the value at the edge of column 2, which lies half-way between
    // the centres of two pixels, is a half.
    let scene = world(&format!(
        "{SQUARE} LightSource \"infinite\" \"string mapname\" \"{name}\""
    ));
    let row = 1.5 * PI / 4.0;
    let along = |turn: f64| {
        let (s, c) = (2.0 * PI * turn).sin_cos();
        sky(&scene).along(DVec3::new(row.sin() * c, row.sin() * s, row.cos()))
    };
    near(along(0.5), DVec3::splat(0.5));
    near(along(0.625), DVec3::ONE);
}

#[test]
fn what_is_no_light_is_an_error_at_its_place() {
    for (text, part) in [
        ("\"spot\" \"float coneangle\" 200", "no such angle"),
        ("\"spot\" \"float coneangle\" -1", "no such angle"),
        ("\"spot\" \"float conedeltaangle\" -1", "no such angle"),
        ("\"spot\" \"point3 to\" [ 0 0 0 ]", "are one point"),
        ("\"distant\" \"point3 from\" [ 0 0 1 ]", "are one point"),
        ("\"distant\" \"float angle\" -1", "is -1"),
        ("\"distant\" \"float angle\" 181", "is 181"),
        ("\"point\" \"rgb I\" [ 1 -1 1 ]", "negative"),
        (
            "\"infinite\" \"point3 portal\" [ 0 0 0 ]",
            "takes 12 values",
        ),
        (
            "\"infinite\" \"point3 portal\" [ 0 0 0 1 0 0 1 1 1 0 1 0 ]",
            "the portal of",
        ),
        ("\"lamp\"", "unknown light source `lamp`"),
    ] {
        let text = format!("Camera \"perspective\"\nWorldBegin\nLightSource {text}\n");
        let error = from_pbrt_str(&text, "a.pbrt", &LoadOptions::default());
        let error = error.expect_err(part).to_string();
        assert!(
            error.contains(part) && error.contains("a.pbrt:3"),
            "{error}"
        );
    }
    for (text, part) in [
        (
            "LightSource \"projection\"",
            "`projection` is not supported",
        ),
        ("LightSource \"point\" \"rgb I\" [ 0 0 0 ]", "emits nothing"),
        (
            "LightSource \"spot\" \"float coneangle\" 0",
            "emits nothing",
        ),
        (
            "LightSource \"point\" \"float power\" 0 \"bool bogus\" true",
            "no parameter `bogus`",
        ),
        (
            "AreaLightSource \"diffuse\" \"float focus\" 3 Shape \"line\" \"point p0\" [ 0 0 1 ] \"point p1\" [ 1 0 1 ]",
            "no normal",
        ),
    ] {
        let loaded = load(&format!(
            "Camera \"perspective\"\nWorldBegin\n{SQUARE}{text}\n"
        ));
        let said = loaded.warnings.iter().any(|w| w.message().contains(part));
        assert!(said, "{part}: {:?}", loaded.warnings);
    }
    for text in [
        "\"float focus\" -1",
        "\"float focus\" 1 \"float coneangle\" 3",
    ] {
        let text =
            format!("Camera \"perspective\"\nWorldBegin\nAreaLightSource \"diffuse\" {text}\n");
        assert!(from_pbrt_str(&text, "a.pbrt", &LoadOptions::default()).is_err());
    }
}

/// The parameter `focus` of an area light narrows its emission about the normal and keeps its
/// power.
#[test]
fn shapes_have_a_focus() {
    let shape = "Shape \"disk\" \"float radius\" 2";
    let area = |parameters: &str| {
        world(&format!(
            "AreaLightSource \"diffuse\" \"float power\" 50 {parameters} {shape}"
        ))
    };
    let (even, focus) = (area(""), area("\"float focus\" 4"));
    for (a, b) in even.lights.iter().zip(&focus.lights) {
        assert_eq!(a.light.power().to_bits(), b.light.power().to_bits());
        let profile = b.profile.as_ref().expect("a profile");
        assert!((profile.lambertian_mean() - 1.0).abs() < 1e-12);
        // The radiance is multiplied by (4 + 2)/2 cos⁴ θ, which is 3 along the normal.
        let Light::Area(light) = &*b.light else {
            panic!("facets");
        };
        let n = light.polygon.normal();
        let uv = linelit_geometry::DVec2::ZERO;
        near(b.shown(uv, n), a.shown(uv, n) * 3.0);
        near(b.shown(uv, -n), DVec3::ZERO);
    }
    assert_eq!(focus.round.len(), 1);
}

/// Tests the spellings of IES files: the tilt line in upper or lower case and with blanks, the line
/// ends of old Macs, and a byte order mark. Also, the number after the ballast factor is a factor
/// in editions before 2019, and a code since then.
#[test]
fn editions_and_spellings_of_ies_files() {
    let folder = Folder::new("ies-editions");
    let path = folder.join("lamp.ies");
    let intensity = |text: &str| {
        std::fs::write(&path, text).unwrap();
        let name = path.display();
        let scene = world(&format!(
            "LightSource \"point\" \"string iesfile\" \"{name}\""
        ));
        point(&scene).beam(DVec3::Z).unwrap().irradiance.x
    };
    // Candela are stored as f32.
    let near = |got: f64, want: f64, text: &str| {
        assert!((got - want).abs() < 1e-4, "{text}: {got}");
    };
    let with = |first: &str, tilt: &str, code: &str| {
        format!("{first}\n{tilt}\n1 -1 1 2 1 1 2 0 0 0\n.5 {code} 10\n0 90\n0\n800 800\n")
    };
    for (first, want) in [
        ("IES:LM-63-2019", 400.0),
        ("IESNA:LM-63-2019", 400.0),
        ("IESNA:LM-63-2002", 440.0),
        ("IESNA:LM-63-1995", 440.0),
        ("IESNA91", 440.0),
        ("[TEST] LM-63-", 440.0),
    ] {
        near(intensity(&with(first, "TILT=NONE", "1.10000")), want, first);
    }
    for tilt in [
        "TILT = NONE",
        "TILT=none",
        " tilt =None ",
        "\u{feff}TILT=NONE",
    ] {
        let text = with("[TEST] a = b", tilt, "1");
        for end in ["\n", "\r", "\r\n"] {
            near(intensity(&text.replace('\n', end)), 400.0, tilt);
        }
    }
    let include = with("", "Tilt = include\n1\n2\n0 90\n1 1", "1");
    near(intensity(&include), 400.0, &include);
}

const IES: &str = "IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 1000 2 3 2 1 2 0 0 0\n1.5 1 50\n\
                   0 45 90\n0 90\n100 60 0\n100,20 0\n";

/// An IES file of one quadrant: the candela are multiplied by the multiplier and the ballast
/// factor and mirrored twice, and the axis of the luminaire points along `to`.
#[test]
fn ies_files_are_luminaires() {
    let folder = Folder::new("ies");
    let path = folder.join("lamp.ies");
    std::fs::write(&path, IES).unwrap();
    let name = path.display();
    let scene = world(&format!(
        "LightSource \"point\" \"point3 to\" [ 0 0 -1 ] \"string iesfile\" \"{name}\" \"rgb I\" [ 1 1 1 ]"
    ));
    let light = point(&scene);
    let at = |theta: f64, phi: f64| {
        let (theta, phi) = (theta.to_radians(), phi.to_radians());
        let w = DVec3::new(
            theta.sin() * phi.cos(),
            theta.sin() * phi.sin(),
            -theta.cos(),
        );
        light.beam(w).map_or(0.0, |beam| beam.irradiance.x)
    };
    for (theta, phi, want) in [
        (0.0, 0.0, 300.0),
        (45.0, 0.0, 180.0),
        (45.0, 90.0, 60.0),
        (45.0, 180.0, 180.0),
        (45.0, 270.0, 60.0),
        (45.0, 45.0, 120.0),
        (45.0, 135.0, 120.0),
        (45.0, 315.0, 120.0),
        (22.5, 0.0, 240.0),
        (100.0, 0.0, 0.0),
    ] {
        // Candela are stored as f32.
        assert!(
            (at(theta, phi) - want).abs() < 1e-4,
            "{theta} {phi}: {}",
            at(theta, phi)
        );
    }
    let scene = world(&format!(
        "AreaLightSource \"diffuse\" \"string iesfile\" \"{name}\" Shape \"disk\""
    ));
    assert!(scene.lights.iter().all(|light| light.profile.is_some()));
}

/// Even the narrowest beams of IES files emit, with the right power. For a beam that is uniform up
/// to the angle b and ends at 1.2 b, the power for one candela is the volume of a truncated cone,
/// (1 + 1.2 + 1.2²)/3 π b².
#[test]
fn beams_of_ies_files_have_their_power() {
    let folder = Folder::new("ies-beams");
    let path = folder.join("lamp.ies");
    for degrees in [1.0, 0.5, 0.1, 1e-3, 1e-6_f64] {
        let end = 1.2 * degrees;
        let text = format!(
            "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 4 1 1 2 0 0 0\n1 1 1\n0 {degrees} {end} 90\n0\n\
             1000 1000 0 0\n"
        );
        std::fs::write(&path, text).unwrap();
        let name = path.display();
        let at = |rest: &str| {
            let scene = world(&format!(
                "LightSource \"point\" {rest} \"string iesfile\" \"{name}\""
            ));
            point(&scene).beam(DVec3::Z * 2.0).unwrap().irradiance.x
        };
        assert!((at("") - 250.0).abs() < 1e-12);
        let b = degrees.to_radians();
        let want = 100.0 / (PI * b * b * 3.64 / 3.0) / 4.0;
        let off = at("\"float power\" 100") / want - 1.0;
        // The formula takes b for sin b, which differs by b³/6.
        assert!(off.abs() < b * b + 1e-12, "{degrees}: {off:e}");
    }
}

/// Broken IES files, and files that are cut off at any byte, are refused with a message that names
/// the file and the position.
#[test]
fn broken_ies_files_are_refused() {
    let folder = Folder::new("broken-ies");
    let path = folder.join("lamp.ies");
    let name = path.display();
    let tilted = IES.replace("TILT=NONE", "TILT=INCLUDE\n1\n2\n0 90\n1 .8");
    let bad = [
        (IES.replace("1000 2 3", "1000 2 4"), "an intensity"),
        (IES.replace("2 3 2 1 2", "2 3 2 3 2"), "types A and B"),
        (IES.replace("0 45 90", "0 95 90"), "does not ascend"),
        (IES.replace("\n0 90\n", "\n10 90\n"), "expected 0, 0 to 90"),
        (IES.replace("\n0 90\n", "\n0 0\n"), "do not ascend"),
        (IES.replace("100,20", "100,-20"), "negative"),
        (IES.replace("100,20", "100,many"), "`many`, not a number"),
        (
            IES.replace("2 3 2 1 2", "2 3e9 2 1 2"),
            "vertical angles is 3000000000",
        ),
        (IES.replace("TILT=NONE", "TILT=lamp.tlt"), "another file"),
        (IES.replace("TILT=NONE", ""), "no IES file"),
    ];
    let load_with = |text: &str| {
        std::fs::write(&path, text).unwrap();
        let options = LoadOptions {
            root: linelit_formats::Root::Anywhere,
            ..LoadOptions::default()
        };
        let scene = format!(
            "Camera \"perspective\"\nWorldBegin\n{SQUARE}LightSource \"point\" \"string iesfile\" \"{name}\"\n"
        );
        from_pbrt_str(&scene, "a.pbrt", &options)
    };
    for (text, part) in &bad {
        let error = load_with(text).expect_err(part).to_string();
        assert!(
            error.contains(part) && error.contains("lamp.ies:"),
            "{part}: {error}"
        );
    }
    let warned = load_with(&tilted).unwrap().warnings;
    assert!(
        warned.iter().any(|w| w.message().contains("tilted lamp")),
        "{warned:?}"
    );
    // A file that is cut off is refused, unless the cut is in the last number, which then is still
    // a number.
    for end in 0..IES.len() {
        if let Ok(loaded) = load_with(&IES[..end]) {
            assert!(end >= IES.len() - 2, "{end}: {:?}", loaded.warnings);
        }
    }
}

/// A file whose lights are dark or not supported counts as a file with lights, so that no lamp is
/// added to its scene.
#[test]
fn dark_lights_are_lights() {
    let folder = Folder::new("dark");
    let black = folder.join("black.tga");
    write_tga(&black, [1, 1], &[[0; 3]]);
    let (black, dark) = (
        black.display(),
        "AreaLightSource \"diffuse\" \"rgb L\" [ 0 0 0 ]",
    );
    for (text, has_lights) in [
        (String::new(), false),
        ("LightSource \"point\" \"rgb I\" [ 0 0 0 ]".to_owned(), true),
        ("LightSource \"projection\"".to_owned(), true),
        (
            "LightSource \"spot\" \"float coneangle\" 0".to_owned(),
            true,
        ),
        (
            format!("LightSource \"infinite\" \"string filename\" \"{black}\""),
            true,
        ),
        (
            format!("LightSource \"infinite\" \"string mapname\" \"{black}\""),
            true,
        ),
        (
            format!("LightSource \"goniometric\" \"string filename\" \"{black}\""),
            true,
        ),
        (format!("{dark} {SQUARE}"), true),
        (
            format!("AreaLightSource \"diffuse\" \"string filename\" \"{black}\" {SQUARE}"),
            true,
        ),
    ] {
        let text = format!("Camera \"perspective\"\nWorldBegin\n{SQUARE} {text}");
        let loaded = load(&text);
        assert!(loaded.scene.lights.is_empty(), "{text}");
        assert_eq!(loaded.has_lights, has_lights, "{text}");
        let said = match has_lights {
            true => "no light of the scene emits anything",
            false => "the scene has no lights",
        };
        let warned = loaded.warnings.iter().any(|w| w.message() == said);
        assert!(warned, "{:?}", loaded.warnings);
    }
}

#[cfg(feature = "gltf")]
fn gltf(light: &str, node: &str) -> Result<linelit_formats::Loaded, String> {
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "extensionsUsed": [ "KHR_lights_punctual" ],
        "extensionsRequired": [ "KHR_lights_punctual" ],
        "extensions": {{ "KHR_lights_punctual": {{ "lights": [ {light} ] }} }},
        "nodes": [ {{ {node} "extensions": {{ "KHR_lights_punctual": {{ "light": 0 }} }} }} ] }}"#
    );
    linelit_formats::from_bytes(
        linelit_formats::Format::Gltf,
        text.as_bytes(),
        "a.gltf",
        &LoadOptions::default(),
    )
    .map_err(|e| e.to_string())
}

#[cfg(feature = "gltf")]
#[test]
fn punctual_lights_of_gltf() {
    let turned = r#""translation": [ 1, 2, 3 ], "rotation": [ 0, 0.7071067811865476, 0, 0.7071067811865476 ],"#;
    let light = r#"{ "type": "point", "color": [ 1, 0.5, 0 ], "intensity": 20 }"#;
    let loaded = gltf(light, turned).unwrap();
    near(point(&loaded.scene).position, DVec3::new(1.0, 2.0, 3.0));
    near(point(&loaded.scene).intensity, DVec3::new(20.0, 10.0, 0.0));
    // −z turned by 90° about y is −x.
    let loaded = gltf(r#"{ "type": "directional", "intensity": 3 }"#, turned).unwrap();
    near(distant(&loaded.scene).direction, DVec3::X);
    near(distant(&loaded.scene).irradiance, DVec3::splat(3.0));
    // At a cosine of 0.75, half-way between the cosines 1 and 0.5 of the cones, the intensity is
    // the square of a half.
    let light = r#"{ "type": "spot", "spot": { "outerConeAngle": 1.0471975511965976 } }"#;
    let loaded = gltf(light, "").unwrap();
    let w = DVec3::new((1.0 - 0.75 * 0.75_f64).sqrt(), 0.0, -0.75);
    near(
        point(&loaded.scene).beam(w).unwrap().irradiance,
        DVec3::splat(0.25),
    );
    // A light that two nodes use is read once, with one warning about its range.
    let twice = r#""extensions": { "KHR_lights_punctual": { "light": 0 } } }, {"#;
    let ranged = gltf(r#"{ "type": "point", "range": 5 }"#, twice).unwrap();
    let said = &ranged.warnings[0];
    assert!(said.message().contains("`range`"), "{said}");
    assert_eq!((ranged.scene.lights.len(), said.repeats()), (2, 1));
    let dark = gltf(r#"{ "type": "point", "intensity": 0 }"#, "").unwrap();
    assert!(dark.scene.lights.is_empty() && dark.has_lights);
    // Read cones whose outer angle is π/2 or equals the inner one, up to rounding to 32 bits or to
    // five digits.
    let [half, quarter] = ["1.5707963705062866", "0.7853981852531433"];
    for (inner, outer) in [
        ("0", half),
        ("0", "1.5708"),
        (quarter, "0.7853981633974483"),
        (half, half),
    ] {
        let cone = format!(r#""innerConeAngle": {inner}, "outerConeAngle": {outer}"#);
        let loaded = gltf(
            &format!(r#"{{ "type": "spot", "spot": {{ {cone} }} }}"#),
            "",
        )
        .unwrap();
        let light = point(&loaded.scene);
        let beam = light.beam(DVec3::new(0.3, 0.0, -0.4)).unwrap();
        // Between the angles 0 and π/2 the intensity is the square of the cosine, and in a cone
        // with a sharp edge it is one.
        let want = if inner == "0" { 0.64 } else { 1.0 };
        near(beam.irradiance, DVec3::splat(want / 0.25));
        assert!(light.beam(DVec3::Z).is_none());
    }
    for (light, part) in [
        (r#"{ "type": "area" }"#, "`type` of a light"),
        (
            r#"{ "type": "point", "intensity": -1 }"#,
            "`intensity` of a light",
        ),
        (
            r#"{ "type": "point", "color": [ 1, -1, 0 ] }"#,
            "`color` of a light",
        ),
        (
            r#"{ "type": "spot", "spot": { "innerConeAngle": 2 } }"#,
            "`spot` of a light",
        ),
        ("", "number 0 of `lights`"),
    ] {
        let error = gltf(light, "").unwrap_err();
        assert!(error.contains(part), "{error}");
    }
}
