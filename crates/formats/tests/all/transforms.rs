//! Tests of transformed lights whose emission depends on the direction. Each kind of light is read
//! under each of several transforms, in each format that has it, and is compared with formulas that
//! are written here independently of the library.

use crate::common::load;
use linelit_geometry::glam::DMat3;
use linelit_geometry::{DVec2, DVec3};
use linelit_lights::octahedral::square_to_sphere;
use linelit_lights::{Light, PointLight, Sky};
use linelit_scene::SceneDescription;
use linelit_testkit::folder::Folder;
use linelit_testkit::pictures::pfm;
use linelit_testkit::quadrature::gauss_legendre;
use std::f64::consts::{PI, TAU};

/// A directive that changes the current transform.
#[derive(Clone, Copy)]
enum Step {
    Scale([f64; 3]),
    Rotate(f64, [f64; 3]),
}
use Step::{Rotate, Scale};

/// The transforms of the tests: rotations, reflections and uneven scales, in different orders.
const TRANSFORMS: [&[Step]; 9] = [
    &[],
    &[Rotate(40.0, [0.6, 0.0, 0.8])],
    &[Scale([3.0, 3.0, 3.0])],
    &[Scale([-1.0, 1.0, 1.0])],
    &[Rotate(25.0, [0.0, 1.0, 0.0]), Scale([1.0, -2.0, 1.0])],
    &[Scale([1.0, 2.0, 1.0])],
    &[Scale([2.0, 1.0, 0.5]), Rotate(50.0, [0.0, 0.6, 0.8])],
    &[Rotate(-70.0, [0.48, 0.6, 0.64]), Scale([1.0, 1.0, 3.0])],
    &[Scale([1.0, 0.7, -1.5]), Rotate(130.0, [0.8, 0.6, 0.0])],
];

fn matrix(steps: &[Step]) -> DMat3 {
    let each = steps.iter().map(|step| match *step {
        Scale(by) => DMat3::from_diagonal(DVec3::from(by)),
        Rotate(degrees, axis) => DMat3::from_axis_angle(DVec3::from(axis), degrees.to_radians()),
    });
    each.fold(DMat3::IDENTITY, |all, one| all * one)
}

fn directives(steps: &[Step]) -> String {
    let each = steps.iter().map(|step| match step {
        Scale([x, y, z]) => format!("Scale {x} {y} {z} "),
        Rotate(degrees, [x, y, z]) => format!("Rotate {degrees} {x} {y} {z} "),
    });
    each.collect()
}

/// Returns directions all over the sphere, none of which is horizontal.
fn directions() -> impl Iterator<Item = DVec3> {
    (0..60).map(|k| {
        let z = 1.0 - 2.0 * (f64::from(k) + 0.5) / 60.0;
        let (sin, cos) = (f64::from(k) * 2.4).sin_cos();
        DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
    })
}

/// Reads a light of the given version of pbrt under each transform, and calls `check` with the
/// scene, the matrix and a name for messages.
fn each_scene(version: u32, light: &str, mut check: impl FnMut(&SceneDescription, DMat3, &str)) {
    for steps in TRANSFORMS {
        let film = if version == 3 { "image" } else { "rgb" };
        let transform = directives(steps);
        let text = format!(
            "Film \"{film}\" Camera \"perspective\" WorldBegin AttributeBegin {transform} {light} \
             AttributeEnd"
        );
        check(
            &load(&text).scene,
            matrix(steps),
            &format!("{version} {transform}"),
        );
    }
}

fn point(scene: &SceneDescription) -> &PointLight {
    match &*scene.lights[0].light {
        Light::Point(light) => light,
        other => panic!("{other:?} is no point"),
    }
}

fn sky(scene: &SceneDescription) -> &Sky {
    match &*scene.lights[0].light {
        Light::Sky(light) => light,
        other => panic!("{other:?} is no sky"),
    }
}

/// Checks that the intensity of a point light is `want` of the direction in the light's own space,
/// under each transform and in all directions.
fn check_point(version: u32, light: &str, tolerance: f64, want: impl Fn(DVec3) -> DVec3) {
    each_scene(version, light, |scene, to_world, name| {
        let (light, to_light) = (point(scene), to_world.inverse());
        for w in directions() {
            let beam = light.beam(light.position + w);
            let got = beam.map_or(DVec3::ZERO, |beam| beam.irradiance);
            let want = want((to_light * w).normalize());
            let off = (got - want).abs().max_element();
            assert!(off <= tolerance, "{name}, {w}: {got}, not {want}");
        }
    });
}

/// Spot lights have the smooth border of pbrt-v4 or the fourth power of pbrt-v3. Both are functions
/// of the direction in the light's own space, so that cones become elliptic under uneven scales;
/// `power` is computed in that space as well.
#[test]
fn spots_are_cones_of_their_own_space() {
    let light = "LightSource \"spot\" \"point3 from\" [ .1 .2 .3 ] \"point3 to\" [ .7 -.6 .3 ] \
                 \"float coneangle\" 80 \"float conedeltaangle\" 50 \"rgb I\" [ 1 2 3 ]";
    let axis = DVec3::new(0.6, -0.8, 0.0);
    let [inner, outer] = [30.0, 80.0].map(|degrees: f64| degrees.to_radians().cos());
    let place = |w: DVec3| ((axis.dot(w) - outer) / (inner - outer)).clamp(0.0, 1.0);
    let smooth = |w: DVec3| place(w).powi(2) * (3.0 - 2.0 * place(w));
    let color = DVec3::new(1.0, 2.0, 3.0);
    // A steep border magnifies the rounding of the direction, hence the tolerance.
    check_point(4, light, 1e-13, |w| color * smooth(w));
    check_point(3, light, 1e-13, |w| color * place(w).powi(4));
    let powerful = format!("{light} \"float power\" 50");
    // The mean of the smooth border is a half.
    let solid_angle = TAU * (1.0 - 0.5 * (inner + outer));
    check_point(4, &powerful, 1e-12, |w| {
        color * smooth(w) * (50.0 / solid_angle)
    });
}

/// A `conedeltaangle` above `coneangle` makes the inner angle negative. Its cosine is used, as in
/// pbrt. Above twice the angle, the inner cone would be wider than the outer one; then the cone has
/// a sharp edge and does not light its outside.
#[test]
fn cones_may_begin_at_a_negative_angle() {
    for (delta, inner) in [(35.0, 5.0), (60.0, 30.0), (170.0, 30.0_f64)] {
        let light =
            format!("LightSource \"spot\" \"float coneangle\" 30 \"float conedeltaangle\" {delta}");
        let [inner, outer] = [inner, 30.0].map(|degrees: f64| degrees.to_radians().cos());
        check_point(4, &light, 1e-13, |w| {
            let t = match inner > outer {
                true => ((w.z - outer) / (inner - outer)).clamp(0.0, 1.0),
                false => f64::from(u8::from(w.z > outer)),
            };
            DVec3::splat(t * t * (3.0 - 2.0 * t))
        });
        let text = format!("Camera \"perspective\" WorldBegin {light}");
        let warnings = load(&text).warnings;
        let mut messages = warnings.iter().map(|w| w.message());
        assert!(
            messages.any(|m| m.contains("above `coneangle`")),
            "{warnings:?}"
        );
    }
}

/// The colours of the test images: three linear functions of the direction, which no reflection
/// and no exchange of axes leaves the same.
fn image(w: DVec3) -> DVec3 {
    DVec3::new(
        2.0 + w.dot(DVec3::new(0.7, 0.5, 0.3)),
        2.0 + w.dot(DVec3::new(-0.4, 0.2, 0.8)),
        2.0 + w.dot(DVec3::new(0.3, -0.9, 0.1)),
    )
}

/// The width and the height of the test images in pixels.
const SIDE: u32 = 128;
/// A bound of the distance, in radians, of a direction from the centre of the nearest pixel, in
/// the equal-area map and in images by longitude and latitude. It also bounds the error of a
/// lookup, of the nearest pixel or interpolated, of functions whose gradient is at most one.
const PIXEL: f64 = 4.31 / SIDE as f64;

/// Writes the image by the equal-area map and by longitude and latitude, and returns the names of
/// both files.
fn images(folder: &Folder) -> [String; 2] {
    let bright = |w: DVec3| image(w).as_vec3().to_array();
    let places = || (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| [i, j]));
    let place = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE);
    let octahedral = places().map(|at| bright(square_to_sphere(at.map(place))));
    let by_angles = places().map(|[i, j]| {
        let ((s, c), (sin, cos)) = ((PI * place(j)).sin_cos(), (TAU * place(i)).sin_cos());
        bright(DVec3::new(s * cos, s * sin, c))
    });
    let all: [Vec<_>; 2] = [octahedral.collect(), by_angles.collect()];
    let mut names = ["square.pfm", "angles.pfm"].into_iter();
    all.map(|pixels| {
        let path = folder.join(names.next().unwrap());
        std::fs::write(&path, pfm([SIDE; 2], &pixels)).unwrap();
        path.display().to_string()
    })
}

/// The axis of a goniometric image is the light's y axis in both versions. pbrt-v3 uses the colours
/// of the image, and pbrt-v4 the mean of its channels.
#[test]
fn goniometers_are_images_about_the_y_axis() {
    let folder = Folder::new("transformed-goniometers");
    let [square, angles] = images(&folder);
    let swapped = |w: DVec3| image(DVec3::new(w.x, w.z, w.y));
    let mean = |w: DVec3| DVec3::splat(swapped(w).element_sum() / 3.0);
    let light = |key: &str, name: &str, rest: &str| {
        format!("LightSource \"goniometric\" \"string {key}\" \"{name}\" {rest}")
    };
    check_point(4, &light("filename", &square, ""), PIXEL, mean);
    check_point(3, &light("mapname", &angles, ""), PIXEL, swapped);
    // The mean of each linear function over the sphere is its constant, 2.
    let powerful = light("filename", &square, "\"float power\" 100");
    check_point(4, &powerful, 4.0 * PIXEL, |w| {
        mean(w) * (100.0 / (4.0 * PI * 2.0))
    });
    let powerful = light("mapname", &angles, "\"float power\" 100");
    check_point(3, &powerful, 4.0 * PIXEL, |w| {
        swapped(w) * (100.0 / (4.0 * PI * 2.0))
    });
}

/// Environments are looked up by the direction in their own space, and `illuminance` is computed
/// in that space.
#[test]
fn environments_are_images_of_their_own_space() {
    let folder = Folder::new("transformed-skies");
    let [square, angles] = images(&folder);
    // A radiance c + a·w, integrated over the hemisphere with the cosine, gives the irradiance
    // π c + (2π/3) a·n on a plane with the normal n.
    let upper = DVec3::splat(2.0 * PI) + DVec3::new(0.3, 0.8, 0.1) * (TAU / 3.0);
    let upper = upper.dot(linelit_scene::LUMINANCE);
    for (version, key, name) in [(4, "filename", square), (3, "mapname", angles)] {
        for (rest, factor) in [("", 1.0), ("\"float illuminance\" 7", 7.0 / upper)] {
            let light = format!("LightSource \"infinite\" \"string {key}\" \"{name}\" {rest}");
            each_scene(version, &light, |scene, to_world, name| {
                let (sky, to_light) = (sky(scene), to_world.inverse());
                for w in directions() {
                    let got = sky.radiance(DVec3::ZERO, w);
                    let want = image((to_light * w).normalize()) * factor;
                    // The illuminance is a sum over cells of the size of pixels, so that the same
                    // bound holds.
                    let off = (got - want).abs().max_element() / factor;
                    assert!(off <= PIXEL, "{name}, {w}: {got}, not {want}");
                }
            });
        }
    }
}

/// The direction of parallel light is transformed as a direction. The corners of a portal are given
/// in world space and are not transformed.
#[test]
fn directions_are_transformed_and_portals_are_not() {
    let light = "LightSource \"distant\" \"point3 from\" [ 3 1 2 ] \"point3 to\" [ 1 0 4 ]";
    for version in [3, 4] {
        each_scene(version, light, |scene, to_world, name| {
            let Light::Distant(light) = &*scene.lights[0].light else {
                panic!("{name}: not distant");
            };
            let want = (to_world * DVec3::new(2.0, 1.0, -2.0)).normalize();
            assert!(light.direction.distance(want) < 1e-15 * 4.0, "{name}");
        });
    }
    let light = "LightSource \"infinite\" \"point3 portal\" [ 0 0 5 0 1 5 1 1 5 1 0 5 ]";
    each_scene(4, light, |scene, _, name| {
        let portal = sky(scene).portal.expect("a portal");
        let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
        let corners = corners.map(|[x, y]| DVec3::new(x, y, 5.0));
        assert_eq!(portal.vertices(), corners, "{name}");
        assert_eq!(portal.normal(), DVec3::NEG_Z, "{name}");
    });
}

/// The candela of the test luminaire: a row for each of the horizontal angles 0, 90, 180 and 270,
/// with values at the vertical angles 0, 60, 90, 120 and 180.
const CANDELA: [[f64; 5]; 4] = [
    [8.0, 7.0, 3.0, 1.0, 2.0],
    [8.0, 2.0, 1.0, 4.0, 2.0],
    [8.0, 4.0, 9.0, 0.0, 2.0],
    [8.0, 5.0, 5.0, 6.0, 2.0],
];
const VERTICAL: [f64; 5] = [0.0, 60.0, 90.0, 120.0, 180.0];

fn ies(path: &std::path::Path) {
    let mut text = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 5 5 1 2 0 0 0\n1 1 9\n".to_owned();
    text += "0 60 90 120 180\n0 90 180 270 360\n";
    for k in 0..5 {
        let row = CANDELA[k % 4].map(|c| c.to_string());
        text += &format!("{}\n", row.join(" "));
    }
    std::fs::write(path, text).unwrap();
}

/// Returns the interpolated candela in a direction, for a luminaire with the given axes, of which
/// the third is its own axis.
fn candela([x, y, z]: [DVec3; 3], w: DVec3) -> f64 {
    let theta = w.dot(z).clamp(-1.0, 1.0).acos().to_degrees();
    let phi = w.dot(y).atan2(w.dot(x)).to_degrees().rem_euclid(360.0);
    let i = (0..4).rfind(|i| VERTICAL[*i] <= theta).unwrap_or(0);
    let a = (theta - VERTICAL[i]) / (VERTICAL[i + 1] - VERTICAL[i]);
    let turns = [0.0, 90.0, 180.0, 270.0];
    let column = turns.iter().rposition(|turn| *turn <= phi).unwrap_or(0);
    let b = (phi - turns[column]) / 90.0;
    let [this, next] = [0, 1].map(|k| CANDELA[(column + k) % 4]);
    let at = |column: [f64; 5]| column[i] * (1.0 - a) + column[i + 1] * a;
    at(this) * (1.0 - b) + at(next) * b
}

/// Returns orthonormal axes with the given z, whose x is as near to the given x as possible.
fn axes(z: DVec3, x: DVec3) -> [DVec3; 3] {
    let x = (x - z * z.dot(x)).normalize();
    [x, z.cross(x), z]
}

/// The horizontal angles of a point light's IES file run from x towards z × x about its axis z, in
/// the light's own space. Its power is computed in that space, too.
#[test]
fn ies_points_turn_with_their_space() {
    let folder = Folder::new("transformed-points");
    let path = folder.join("lamp.ies");
    ies(&path);
    let light = format!(
        "LightSource \"point\" \"point3 from\" [ 1 1 1 ] \"point3 to\" [ 1.48 1.6 .36 ] \
         \"string iesfile\" \"{}\" \"rgb I\" [ 1 2 3 ]",
        path.display()
    );
    let axes = axes(DVec3::new(0.48, 0.6, -0.64), DVec3::X);
    let color = DVec3::new(1.0, 2.0, 3.0);
    for version in [3, 4] {
        check_point(version, &light, 1e-12, |w| color * candela(axes, w));
    }
    // Compare a light with a given power, of which the whole luminaire has `whole` per candela.
    let whole = luminaire(|_| 1.0, 180.0);
    let powerful = format!("{light} \"float power\" 30");
    check_point(4, &powerful, 1e-12, |w| {
        color * candela(axes, w) * (30.0 / whole)
    });
}

/// Returns the integral of the candela, times a weight that depends on the cosine, over the
/// directions up to the vertical angle `end` in degrees.
fn luminaire(weight: impl Fn(f64) -> f64, end: f64) -> f64 {
    let rings: Vec<_> = (0..5)
        .map(|i| CANDELA.iter().map(|column| column[i]).sum::<f64>() / 4.0)
        .collect();
    let nodes = gauss_legendre(16);
    let piece = |i: usize| {
        let [a, b] = [VERTICAL[i], VERTICAL[i + 1]].map(f64::to_radians);
        nodes.integrate(a, b, |theta| {
            let value = rings[i] + (rings[i + 1] - rings[i]) * (theta - a) / (b - a);
            TAU * value * weight(theta.cos()) * theta.sin()
        })
    };
    let pieces = (0..4).filter(|i| VERTICAL[*i] < end);
    pieces.map(piece).sum()
}

/// On a surface, the axis of a luminaire is the normal on the side that emits. Horizontal angles
/// begin at the x axis of the shape, and turn and mirror with it. The profile is scaled so that the
/// power stays the same. Warnings say what a surface cannot do: emit behind itself, and be
/// stretched.
#[test]
fn ies_surfaces_turn_with_their_shapes() {
    let folder = Folder::new("transformed-surfaces");
    let path = folder.join("lamp.ies");
    ies(&path);
    let lambertian = luminaire(|c| c, 90.0) / PI;
    let square = "Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 4 0 0 0 4 0 4 4 0 ]";
    for (sides, side) in [
        ("", 1.0),
        ("ReverseOrientation", -1.0),
        ("\"bool twosided\" true", 0.0),
    ] {
        let (reverse, two_sided) = match sides.starts_with('R') {
            true => (sides, ""),
            false => ("", sides),
        };
        let light = format!(
            "{reverse} AreaLightSource \"diffuse\" \"string iesfile\" \"{}\" \"rgb L\" [ 2 4 6 ] \
             {two_sided} {square}",
            path.display()
        );
        let behind = 1.0 - luminaire(|_| 1.0, 90.0) / luminaire(|_| 1.0, 180.0);
        for steps in TRANSFORMS {
            let (to_world, transform) = (matrix(steps), directives(steps));
            let placed = format!("{transform} {light}");
            let instanced =
                format!("ObjectBegin \"a\" {light} ObjectEnd {transform} ObjectInstance \"a\"");
            let warned = check_surface(&placed, to_world, side, lambertian);
            check_surface(&instanced, to_world, side, lambertian);
            let percent = format!("{:.3} % of the light", 100.0 * behind);
            assert!(warned.contains(&percent), "{percent}: {warned}");
            let squares = to_world.transpose() * to_world;
            let is_even =
                (squares - DMat3::IDENTITY * squares.x_axis.x).abs_diff_eq(DMat3::ZERO, 1e-9);
            assert_eq!(warned.contains("not stretched"), !is_even, "{transform}");
        }
    }
}

/// Checks the radiance of an area light with (2, 4, 6) W/(m² sr) and the test luminaire, and
/// returns its warnings. It emits on the side of the normal (`side` 1), on the other (−1) or on
/// both (0).
fn check_surface(text: &str, to_world: DMat3, side: f64, lambertian: f64) -> String {
    let loaded = load(&format!("Camera \"perspective\" WorldBegin {text}"));
    let light = &loaded.scene.lights[0];
    let up = (to_world.transpose().inverse() * DVec3::Z).normalize();
    let mirror = to_world.determinant().signum();
    for w in directions() {
        let normal = if w.dot(up) > 0.0 { up } else { -up };
        let [x, y, z] = axes(normal, to_world * DVec3::X);
        let emits = side == 0.0 || w.dot(up) * side > 0.0;
        let factor = if emits {
            candela([x, y * mirror, z], w) / lambertian
        } else {
            0.0
        };
        let want = DVec3::new(2.0, 4.0, 6.0) * factor;
        let got = light.shown(DVec2::ZERO, w);
        // The corners are rounded to 32 bits, and the candela change by at most 6 per radian.
        let off = (got - want).abs().max_element();
        assert!(
            off <= 6.0 * 64.0 * f64::from(f32::EPSILON),
            "{text}, {w}: {got}, not {want}"
        );
    }
    loaded.warnings.iter().map(|w| w.message()).collect()
}

/// The `focus` of an area light is about its normal under any transform, without a warning.
#[test]
fn cones_of_surfaces_are_about_the_normal() {
    let square = "Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 4 0 0 0 4 0 4 4 0 ]";
    let light = format!("AreaLightSource \"diffuse\" \"float focus\" 3 {square}");
    for steps in TRANSFORMS {
        let (to_world, transform) = (matrix(steps), directives(steps));
        let text = format!("Camera \"perspective\" WorldBegin {transform} {light}");
        let loaded = load(&text);
        let up = (to_world.transpose().inverse() * DVec3::Z).normalize();
        for w in directions() {
            let want = 2.5 * w.dot(up).max(0.0).powi(3);
            let got = loaded.scene.lights[0].shown(DVec2::ZERO, w).x;
            assert!((got - want).abs() < 1e-5, "{transform}: {got}, not {want}");
        }
        let said = |what: &str| loaded.warnings.iter().any(|w| w.message().contains(what));
        assert!(!said("stretched") && !said("behind"));
    }
}

/// The nodes of glTF turn their lights, and no scale, uniform or not, changes a cone.
#[cfg(feature = "gltf")]
#[test]
fn nodes_of_gltf_turn_their_lights() {
    use linelit_formats::{Format, LoadOptions, from_bytes};
    let (half, s) = (0.5_f64.sqrt(), [1.0, 2.0, -0.5]);
    // Quaternions: none, a right angle about x, and 2 acos(0.8) about the axis (.48, .6, .64).
    let turns = [
        [0.0, 0.0, 0.0, 1.0],
        [half, 0.0, 0.0, half],
        [0.288, 0.36, 0.384, 0.8],
    ];
    for (kind, [outer, inner]) in [("spot", [1.2, 0.3]), ("directional", [1.2, 0.3])] {
        for (turn, scale) in turns.iter().flat_map(|turn| [(turn, [1.0; 3]), (turn, s)]) {
            for is_nested in [false, true] {
                let light = format!(
                    r#"{{ "type": "{kind}", "spot": {{ "outerConeAngle": {outer}, "innerConeAngle": {inner} }} }}"#
                );
                let extension = r#""extensions": { "KHR_lights_punctual": { "light": 0 } }"#;
                // Scale after the rotation by two nested nodes, or before it by a single one.
                let nodes = match is_nested {
                    true => format!(
                        r#"{{ "scale": {scale:?}, "children": [ 1 ] }}, {{ "rotation": {turn:?}, {extension} }}"#
                    ),
                    false => {
                        format!(r#"{{ "rotation": {turn:?}, "scale": {scale:?}, {extension} }}"#)
                    }
                };
                let text = format!(
                    r#"{{ "asset": {{ "version": "2.0" }}, "extensionsUsed": [ "KHR_lights_punctual" ],
                    "extensions": {{ "KHR_lights_punctual": {{ "lights": [ {light} ] }} }},
                    "scene": 0, "scenes": [ {{ "nodes": [ 0 ] }} ], "nodes": [ {nodes} ] }}"#
                );
                let options = LoadOptions::default();
                let loaded = from_bytes(Format::Gltf, text.as_bytes(), "a.gltf", &options).unwrap();
                let turned = DMat3::from_quat(linelit_geometry::glam::DQuat::from_array(*turn));
                let scaled = DMat3::from_diagonal(DVec3::from(scale));
                let to_world = if is_nested {
                    scaled * turned
                } else {
                    turned * scaled
                };
                let axis = (to_world * DVec3::NEG_Z).normalize();
                if let Light::Distant(light) = &*loaded.scene.lights[0].light {
                    assert!(light.direction.distance(-axis) < 1e-15 * 4.0, "{text}");
                    continue;
                }
                for w in directions() {
                    let (outer, inner) = (f64::cos(outer), f64::cos(inner));
                    let t = ((axis.dot(w) - outer) / (inner - outer)).clamp(0.0, 1.0);
                    let got = point(&loaded.scene).beam(w).map_or(0.0, |b| b.irradiance.x);
                    assert!((got - t * t).abs() < 1e-13, "{text}: {got}");
                }
            }
        }
    }
}
