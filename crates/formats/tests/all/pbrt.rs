//! Tests that pbrt text is read with pbrt's meaning: transforms, cameras, orientation, films,
//! materials, lights and instances, in both versions of the format.

use crate::common::{area, assert_near, load, world};
use linelit_formats::LoadOptions;
use linelit_geometry::{DVec2, DVec3};
use linelit_scene::{MaterialKind, Mesh, Projection, SceneDescription};
use linelit_testkit::folder::Folder;

const TRIANGLE: &str =
    "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point3 P\" [0 0 0  1 0 0  0 1 0]\n";

fn second_vertex(transforms: &str) -> DVec3 {
    let scene = world(&format!("{transforms}\n{TRIANGLE}"));
    scene.corners(0)[1]
}

#[test]
fn transforms_apply_from_the_last_to_the_first() {
    assert_near(second_vertex(""), DVec3::X);
    assert_near(second_vertex("Translate 1 2 3"), DVec3::new(2.0, 2.0, 3.0));
    assert_near(
        second_vertex("Translate 1 0 0 Scale 2 1 1"),
        DVec3::new(3.0, 0.0, 0.0),
    );
    assert_near(
        second_vertex("Scale 2 1 1 Translate 1 0 0"),
        DVec3::new(4.0, 0.0, 0.0),
    );
    assert_near(second_vertex("Rotate 90 0 0 1"), DVec3::Y);
    assert_near(
        second_vertex("Rotate -120 0 1 0"),
        DVec3::new(-0.5, 0.0, 0.75_f64.sqrt()),
    );
    assert_near(second_vertex("Translate 9 9 9 Identity"), DVec3::X);
}

#[test]
fn matrices_are_written_column_by_column() {
    // This matrix maps x to y, y to z and z to x, and then moves by (1, 2, 3).
    let matrix = "[0 1 0 0  0 0 1 0  1 0 0 0  1 2 3 1]";
    assert_near(
        second_vertex(&format!("Transform {matrix}")),
        DVec3::new(1.0, 3.0, 3.0),
    );
    assert_near(
        second_vertex(&format!("Translate 1 0 0 ConcatTransform {matrix}")),
        DVec3::new(2.0, 3.0, 3.0),
    );
    assert_near(
        second_vertex(&format!("Translate 1 0 0 Transform {matrix}")),
        DVec3::new(1.0, 3.0, 3.0),
    );
    // A common factor in the last row is divided out.
    assert_near(
        second_vertex("Transform [2 0 0 0  0 2 0 0  0 0 2 0  0 0 0 2]"),
        DVec3::X,
    );
}

#[test]
fn blocks_save_and_restore() {
    assert_near(
        second_vertex("AttributeBegin Translate 5 0 0 AttributeEnd"),
        DVec3::X,
    );
    assert_near(
        second_vertex("TransformBegin Translate 5 0 0 TransformEnd"),
        DVec3::X,
    );
    // `TransformEnd` restores the transform only, so that the material stays.
    let scene = world(&format!(
        "TransformBegin Translate 5 0 0 Material \"matte\" \"rgb Kd\" [1 0 0] TransformEnd {TRIANGLE}"
    ));
    assert_eq!(
        scene.diffuse_reflectance(scene.material_of(0), DVec2::ZERO),
        DVec3::X
    );
    let scene = world(&format!(
        "AttributeBegin Material \"matte\" \"rgb Kd\" [1 0 0] ReverseOrientation AttributeEnd {TRIANGLE}"
    ));
    assert_eq!(
        scene.diffuse_reflectance(scene.material_of(0), DVec2::ZERO),
        DVec3::splat(0.5)
    );
    assert!(!scene.meshes[0].flipped);
}

#[test]
fn coordinate_systems_are_remembered() {
    assert_near(
        second_vertex(
            "Translate 5 0 0 CoordinateSystem \"here\" Identity CoordSysTransform \"here\"",
        ),
        DVec3::new(6.0, 0.0, 0.0),
    );
    // The coordinate system "camera" is that of the camera in the world.
    let scene = load(&format!(
        "Translate 0 0 -7 Camera \"perspective\" WorldBegin CoordSysTransform \"camera\" {TRIANGLE}"
    ))
    .scene;
    assert_near(scene.corners(0)[0], DVec3::new(0.0, 0.0, 7.0));
    assert_eq!(scene.camera.position(), DVec3::new(0.0, 0.0, 7.0));
    // `WorldBegin` resets the transform.
    let scene = load(&format!(
        "Translate 1 1 1 Camera \"perspective\" WorldBegin {TRIANGLE}"
    ))
    .scene;
    assert_near(scene.corners(0)[0], DVec3::ZERO);
}

fn ray(before: &str, camera: &str, film: &str, x: f64, y: f64) -> DVec3 {
    let text = format!("{before}\n{film}\nCamera {camera}\nWorldBegin\n{TRIANGLE}");
    load(&text).scene.camera.ray(x, y).direction
}

const SQUARE: &str = "Film \"image\" \"integer xresolution\" 100 \"integer yresolution\" 100";
const WIDE: &str = "Film \"image\" \"integer xresolution\" 200 \"integer yresolution\" 100";
const TALL: &str = "Film \"image\" \"integer xresolution\" 100 \"integer yresolution\" 200";
const FOV_90: &str = "\"perspective\" \"float fov\" 90";

#[test]
fn cameras_are_left_handed_unless_mirrored() {
    // In pbrt, for a camera that looks along +z with y up, +x is to the right.
    let look = "LookAt 0 0 0  0 0 1  0 1 0";
    assert_near(ray(look, FOV_90, SQUARE, 50.0, 50.0), DVec3::Z);
    assert_near(
        ray(look, FOV_90, SQUARE, 100.0, 50.0),
        DVec3::new(1.0, 0.0, 1.0).normalize(),
    );
    assert_near(
        ray(look, FOV_90, SQUARE, 50.0, 0.0),
        DVec3::new(0.0, 1.0, 1.0).normalize(),
    );
    // For one that looks along −z, −x is to the right, or with `Scale -1 1 1`, +x.
    let look = "LookAt 0 0 0  0 0 -1  0 1 0";
    assert_near(
        ray(look, FOV_90, SQUARE, 100.0, 50.0),
        DVec3::new(-1.0, 0.0, -1.0).normalize(),
    );
    let mirrored = format!("Scale -1 1 1 {look}");
    assert_near(
        ray(&mirrored, FOV_90, SQUARE, 100.0, 50.0),
        DVec3::new(1.0, 0.0, -1.0).normalize(),
    );
}

#[test]
fn the_field_of_view_is_that_of_the_shorter_side() {
    let tan = |d: DVec3| DVec2::new(d.x, d.y) / d.z;
    assert!((tan(ray("", FOV_90, WIDE, 200.0, 0.0)) - DVec2::new(2.0, 1.0)).length() < 1e-15);
    assert!((tan(ray("", FOV_90, TALL, 100.0, 0.0)) - DVec2::new(1.0, 2.0)).length() < 1e-15);
    let window = "\"perspective\" \"float fov\" 90 \"float screenwindow\" [-1 3 -1 1]";
    assert!((tan(ray("", window, WIDE, 200.0, 100.0)) - DVec2::new(3.0, -1.0)).length() < 1e-15);
    let frame = "\"perspective\" \"float fov\" 90 \"float frameaspectratio\" 1";
    assert!((tan(ray("", frame, WIDE, 200.0, 0.0)) - DVec2::new(1.0, 1.0)).length() < 1e-15);
    let half = "\"perspective\" \"float halffov\" 45";
    assert!((tan(ray("", half, SQUARE, 100.0, 0.0)) - DVec2::new(1.0, 1.0)).length() < 1e-15);
}

#[test]
fn other_projections() {
    let text = format!("{WIDE} Camera \"orthographic\" WorldBegin {TRIANGLE}");
    let ray = load(&text).scene.camera.ray(200.0, 100.0);
    assert_eq!(
        (ray.origin, ray.direction),
        (DVec3::new(2.0, -1.0, 0.0), DVec3::Z)
    );
    let text = format!("{WIDE} Camera \"environment\" WorldBegin {TRIANGLE}");
    let camera = load(&text).scene.camera;
    assert_near(camera.ray(0.0, 50.0).direction, DVec3::X);
    assert_near(camera.ray(50.0, 50.0).direction, DVec3::Z);
    assert_near(camera.ray(50.0, 0.0).direction, DVec3::Y);
}

#[test]
fn films_and_filters() {
    let scene = load(&format!(
        "Film \"rgb\" \"integer xresolution\" 400 \"integer yresolution\" 300 \"string filename\" \"a.exr\"
            \"float cropwindow\" [0.25 0.5 0 1]
         PixelFilter \"gaussian\" \"float xradius\" 2 \"float yradius\" 3
         Camera \"perspective\" WorldBegin {TRIANGLE}"
    ))
    .scene;
    assert_eq!((scene.film.width, scene.film.height), (400, 300));
    assert_eq!(scene.film.crop, [100, 200, 0, 300]);
    assert_eq!(
        scene.film.filter_radius.map(f64::to_bits),
        [2.0_f64, 3.0].map(f64::to_bits)
    );
    assert_eq!(
        scene.camera.projection(),
        Projection::Perspective { fov_degrees: 90.0 }
    );
    // The default radius of the filter depends on the version, which follows from the film's name,
    // even if the film comes after the filter.
    for (film, width) in [("image", 2.0), ("rgb", 1.5)] {
        let text = format!(
            "PixelFilter \"gaussian\" \"float yradius\" 1 Film \"{film}\"
             Camera \"perspective\" WorldBegin {TRIANGLE}"
        );
        let radius = load(&text).scene.film.filter_radius;
        assert_eq!(
            radius.map(f64::to_bits),
            [width, 1.0].map(f64::to_bits),
            "{film}"
        );
    }
}

/// Tests to which side a light emits, for combinations of `ReverseOrientation` and transforms.
#[test]
fn the_outside_is_reversed_by_orientation_or_mirroring_but_not_both() {
    let shapes = [
        TRIANGLE,
        "Shape \"quad\" \"point o\" [0 0 0] \"vector u\" [1 0 0] \"vector v\" [0 1 0]\n",
        "Shape \"bilinearmesh\" \"point3 P\" [0 0 0  1 0 0  0 1 0  1 1 0]\n",
        "Shape \"disk\"\n",
    ];
    for shape in shapes {
        for (turn, want) in [
            ("", 1.0),
            ("ReverseOrientation", -1.0),
            // A mirror in x reverses the winding order and with it the right-hand normal of a
            // triangle. pbrt reverses it once more, so that +z stays the outside.
            ("Scale -1 1 1", 1.0),
            ("Scale -1 1 1 ReverseOrientation", -1.0),
            ("Scale 1 1 -1", -1.0),
            ("Scale 1 1 -1 ReverseOrientation", 1.0),
            ("ReverseOrientation ReverseOrientation", 1.0),
            ("Rotate 180 1 0 0", -1.0),
        ] {
            let scene = world(&format!("AreaLightSource \"diffuse\" {turn} {shape}"));
            let light = area(&scene, 0);
            assert_near(light.polygon.normal(), DVec3::Z * want);
            // The surface has the same outside: a ray against the normal comes from there.
            let surface = scene.surface(0, [0.2, 0.2], -DVec3::Z * want);
            assert!(surface.outside, "{turn} {shape}");
            assert_near(surface.geometric_normal, DVec3::Z * want);
            let surface = scene.surface(0, [0.2, 0.2], DVec3::Z * want);
            assert!(!surface.outside && surface.light == Some(0));
            assert_near(surface.geometric_normal, -DVec3::Z * want);
        }
    }
}

#[test]
fn vertex_normals_decide_the_outside() {
    let shape =
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point3 P\" [0 0 0  1 0 0  0 1 0]
        \"normal N\" [0 0 -1  0 0 -1  0 0.6 -0.8]\n";
    for (turn, want) in [
        ("", -1.0),
        ("ReverseOrientation", 1.0),
        ("Scale -1 1 1", -1.0),
        ("Scale 1 1 -1", 1.0),
    ] {
        let scene = world(&format!("AreaLightSource \"diffuse\" {turn} {shape}"));
        assert_near(area(&scene, 0).polygon.normal(), DVec3::Z * want);
        let surface = scene.surface(0, [0.0, 1.0], -DVec3::Z * want);
        assert!(surface.outside);
        let tilt = if turn.contains("Reverse") { -0.6 } else { 0.6 };
        assert_near(surface.shading_normal, DVec3::new(0.0, tilt, 0.8 * want));
    }
}

#[test]
fn normals_transform_as_normals() {
    let shape =
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point3 P\" [0 0 0  1 0 0  0 1 0]
        \"normal N\" [0.6 0 0.8  0.6 0 0.8  0.6 0 0.8]\n";
    let scene = world(&format!("Scale 2 1 1 {shape}"));
    let surface = scene.surface(0, [0.3, 0.3], -DVec3::Z);
    assert_near(
        surface.shading_normal,
        DVec3::new(0.3, 0.0, 0.8).normalize(),
    );
}

/// Returns the specular reflectance of each of the given smooth materials, one a line, for a viewer
/// whose direction has the given cosine with the normal.
fn reflected(materials: &str, cosine: f64) -> Vec<DVec3> {
    let square = "Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]";
    let each = materials.lines().map(|line| format!("{line} {square}\n"));
    let scene = world(&each.collect::<String>());
    let outgoing = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let weight = |mesh: &Mesh| {
        let surface = scene.surface(mesh.triangles.start, [0.25, 0.25], -outgoing);
        let response = scene.response(&surface, outgoing, DVec3::Z, None);
        response.bounces[0].weight
    };
    scene.meshes.iter().map(weight).collect()
}

/// A conductor with `reflectance` r has η = 1 and k = 2 √r / √(1 − r) as in pbrt-v4, which reflects
/// r at normal incidence. With linelit's parameter `schlick`, which is used for materials from
/// glTF, it has Schlick's approximation.
#[test]
fn a_conductor_of_a_reflectance_is_pbrts() {
    let r = DVec3::new(0.8, 0.2, 1.0);
    let two = "Material \"conductor\" \"rgb reflectance\" [.8 .2 1]
        Material \"conductor\" \"rgb eta\" [1 1 1] \"rgb k\" [4 1 199.98999974998750]";
    for cosine in [1.0, 0.6, 0.1, 0.01] {
        let [ours, pbrts] = reflected(two, cosine)[..] else {
            panic!("two materials");
        };
        // k is 4 for r = 0.8 and 1 for r = 0.2. For r = 1, which is clamped to 0.9999, it is
        // 2 √0.9999 / √0.0001.
        assert!(
            (ours - pbrts).abs().max_element() < 1e-14,
            "{cosine}: {ours} {pbrts}"
        );
    }
    let [at_normal, _] = reflected(two, 1.0)[..] else {
        panic!("two materials");
    };
    let want = r.min(DVec3::splat(0.9999));
    assert!(
        (at_normal - want).abs().max_element() < 1e-14,
        "{at_normal}"
    );
    let schlick = "Material \"conductor\" \"rgb reflectance\" [.8 .2 1] \"bool schlick\" true";
    let got = reflected(schlick, 0.6)[0];
    let want = r + (DVec3::ONE - r) * 0.4_f64.powi(5);
    assert!((got - want).abs().max_element() < 1e-14, "{got}");
    // The metal of pbrt-v3 has no `reflectance`.
    let metal = "Camera \"perspective\" WorldBegin Material \"metal\" \"rgb reflectance\" [1 0 0]";
    let warnings = load(&format!("{metal} Shape \"sphere\"")).warnings;
    assert!(
        warnings
            .iter()
            .any(|w| w.message().contains("no parameter `reflectance`"))
    );
}

#[test]
fn surfaces_interpolate() {
    let shape =
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point3 P\" [0 0 0  1 0 0  0 1 0]";
    let scene = world(&format!("{shape} {shape} \"point2 uv\" [1 1  3 1  1 5]"));
    let plain = scene.surface(0, [0.25, 0.5], -DVec3::Z);
    assert_near(plain.point, DVec3::new(0.25, 0.5, 0.0));
    // A mesh without texture coordinates has (0,0), (1,0), (1,1) at the corners of each triangle.
    assert_eq!(plain.uv, DVec2::new(0.75, 0.5));
    assert_eq!(
        scene.surface(1, [0.25, 0.5], -DVec3::Z).uv,
        DVec2::new(1.5, 3.0)
    );
}

#[test]
fn instances_expand_with_their_transforms() {
    let scene = world(&format!(
        "ObjectBegin \"o\" Translate 1 0 0 {TRIANGLE} ObjectEnd
         ObjectInstance \"o\"
         AttributeBegin Scale -2 2 2 ObjectInstance \"o\" AttributeEnd"
    ));
    assert_eq!(scene.triangles.len(), 2);
    assert_near(scene.corners(0)[1], DVec3::new(2.0, 0.0, 0.0));
    assert_near(scene.corners(1)[1], DVec3::new(-4.0, 0.0, 0.0));
    assert!(!scene.meshes[0].flipped && scene.meshes[1].flipped);
}

#[test]
fn an_instance_that_is_flattened_is_warned_about_where_it_stands() {
    let text = format!(
        "Camera \"perspective\" WorldBegin ObjectBegin \"o\" {TRIANGLE} ObjectEnd
        ObjectInstance \"o\"
        Scale 1 1 0 ObjectInstance \"o\""
    );
    let loaded = load(&text);
    let mut warnings = loaded.warnings.iter();
    let warning = warnings.find(|w| w.message().contains("flattened"));
    assert_eq!(warning.and_then(|w| w.line()), Some(text.lines().count()));
}

#[test]
fn too_many_instances_are_refused() {
    let text = format!(
        "WorldBegin ObjectBegin \"o\" {TRIANGLE} ObjectEnd\n{}",
        "ObjectInstance \"o\"\n".repeat(11)
    );
    let options = LoadOptions {
        max_triangles: 10,
        ..LoadOptions::default()
    };
    let error = linelit_formats::from_pbrt_str(&text, "t", &options).unwrap_err();
    assert_eq!(error.message(), "more than 10 triangles");
}

#[test]
fn materials_of_both_versions() {
    let scene = world(
        "Material \"diffuse\" \"rgb reflectance\" [0.1 0.2 0.3] Shape \"sphere\"
         Material \"uber\" \"rgb Kd\" [0.4 0.4 0.4] \"rgb opacity\" [0.5 0.5 0.5] Shape \"sphere\"
         MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [1 0 0]
         MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [0 0 1]
         Material \"mix\" \"string materials\" [\"a\" \"b\"] \"float amount\" 0.25 Shape \"sphere\"
         Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \"float amount\" 0.25 Shape \"sphere\"
         Material \"phong\" \"rgb Kd\" [0.2 0.2 0.2] \"rgb Ks\" [0.7 0.7 0.7] \"float exponent\" 50 Shape \"sphere\"
         Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\" Shape \"sphere\"",
    );
    let kd = |mesh: usize| scene.diffuse_reflectance(scene.meshes[mesh].material, DVec2::ZERO);
    assert_eq!(kd(0), DVec3::new(0.1, 0.2, 0.3));
    assert_eq!(kd(1), DVec3::splat(0.2));
    // The amount is the weight of the second material in pbrt-v4, and of the first in pbrt-v3.
    assert_eq!(kd(2), DVec3::new(0.75, 0.0, 0.25));
    assert_eq!(kd(3), DVec3::new(0.25, 0.0, 0.75));
    assert_eq!(kd(4), DVec3::splat(0.2));
    let gold = &scene.materials[scene.meshes[5].material as usize];
    let MaterialKind::Conductor { eta, .. } = &gold.kind else {
        panic!("{gold:?}");
    };
    assert!(eta.as_constant().unwrap().x < 0.2);
}

#[test]
fn textures_evaluate() {
    let scene = world(
        "Texture \"red\" \"spectrum\" \"constant\" \"rgb value\" [0.8 0 0]
         Texture \"half\" \"spectrum\" \"scale\" \"texture tex1\" \"red\" \"rgb tex2\" [0.5 0.5 0.5]
         Texture \"check\" \"spectrum\" \"checkerboard\" \"texture tex1\" \"half\" \"rgb tex2\" [0 1 0]
             \"float uscale\" 2 \"float vscale\" 2
         Material \"matte\" \"texture Kd\" \"check\" Shape \"sphere\"",
    );
    let kd = |u: f64, v: f64| scene.diffuse_reflectance(scene.material_of(0), DVec2::new(u, v));
    assert_eq!(kd(0.1, 0.1), DVec3::new(0.4, 0.0, 0.0));
    assert_eq!(kd(0.6, 0.1), DVec3::Y);
    assert_eq!(kd(-0.1, 0.1), DVec3::Y);
}

#[test]
fn emission_of_both_versions() {
    let l = |source: &str| {
        let scene = world(&format!("AreaLightSource \"diffuse\" {source}\n{TRIANGLE}"));
        let light = area(&scene, 0);
        (light.emission.radiance, light.emission.two_sided)
    };
    assert_eq!(l(""), (DVec3::ONE, false));
    assert_eq!(
        l("\"rgb L\" [1 2 3] \"bool twosided\" true").0,
        DVec3::new(1.0, 2.0, 3.0)
    );
    assert!(l("\"bool twosided\" [\"true\"]").1);
    assert_eq!(
        l("\"rgb L\" [1 2 3] \"float scale\" 2").0,
        DVec3::new(2.0, 4.0, 6.0)
    );
    assert_eq!(
        l("\"rgb L\" [1 2 3] \"rgb scale\" [2 1 0]").0,
        DVec3::new(2.0, 2.0, 0.0)
    );
    // The radiance is the power over π times the area, which is a half, and over the number of
    // sides.
    let power = l("\"float power\" 10").0;
    assert!((power.x - 20.0 / std::f64::consts::PI).abs() < 1e-12);
    let both = l("\"float power\" 10 \"bool twosided\" true").0;
    assert!((both.x - 10.0 / std::f64::consts::PI).abs() < 1e-12);
    let luminance = |c: DVec3| c.dot(DVec3::new(0.2126, 0.7152, 0.0722));
    // A black body of pbrt-v4 has a luminance of one. In pbrt-v3 its scale is the peak of the
    // spectrum.
    assert!((luminance(l("\"blackbody L\" 3000").0) - 1.0).abs() < 0.01);
    assert!(luminance(l("\"blackbody L\" [3000 2]").0) < 1.0);
}

/// The picture is multiplied by the film's `scale` in pbrt-v3, and in pbrt-v4 by the imaging ratio,
/// exposure time × ISO / 100, and by the time that the camera's shutter is open.
#[test]
fn films_scale_the_picture() {
    let scene = |film: &str, camera: &str| {
        let text = format!("Camera \"perspective\" {camera}\n{film}\nWorldBegin {TRIANGLE}");
        load(&text)
    };
    let half = "\"float shutteropen\" .25 \"float shutterclose\" .75";
    for (film, camera, want) in [
        ("Film \"image\"", "", 1.0),
        ("Film \"image\" \"float scale\" 3", "", 3.0),
        ("Film \"image\" \"float scale\" 3", half, 3.0),
        ("Film \"rgb\"", "", 1.0),
        ("Film \"rgb\" \"float iso\" 200", "", 2.0),
        ("Film \"rgb\" \"float exposuretime\" .25", "", 0.25),
        (
            "Film \"gbuffer\" \"float iso\" 400 \"float exposuretime\" .125",
            half,
            0.25,
        ),
        ("Film \"rgb\"", half, 0.5),
        ("", half, 1.0),
    ] {
        let loaded = scene(film, camera);
        assert_eq!(
            loaded.scene.film.scale.to_bits(),
            f64::to_bits(want),
            "{film} {camera}"
        );
        let told = loaded.warnings.iter();
        let told = told.filter(|w| w.message().contains("the time that the shutter is open"));
        assert_eq!(told.count() > 0, film.is_empty() && !camera.is_empty());
    }
    // If a film has both crops, `cropwindow` takes precedence over `pixelbounds`, as in pbrt-v4.
    let both = "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8 \
        \"float cropwindow\" [ 0 .5 0 1 ] \"integer pixelbounds\" [ 1 2 1 2 ]";
    assert_eq!(scene(both, "").scene.film.crop, [0, 4, 0, 8]);
    for (film, camera, what) in [
        (
            "Film \"rgb\" \"float iso\" 0",
            "",
            "`iso` of film `rgb` must be positive",
        ),
        (
            "Film \"image\" \"float scale\" -1",
            "",
            "`scale` of film `image` must be positive",
        ),
        (
            "Film \"rgb\"",
            "\"float shutterclose\" 0",
            "the shutter does not open",
        ),
    ] {
        let text = format!("{film} Camera \"perspective\" {camera} WorldBegin {TRIANGLE}");
        let error = linelit_formats::from_pbrt_str(&text, "test.pbrt", &LoadOptions::default());
        assert!(
            error.unwrap_err().message().contains(what),
            "{film} {camera}"
        );
    }
}

#[test]
fn attributes_give_defaults() {
    let scene = world(
        "Attribute \"shape\" \"float radius\" 3 Shape \"sphere\" Shape \"sphere\" \"float radius\" 1",
    );
    let top = |mesh: usize| {
        let range = scene.meshes[mesh].triangles.clone();
        range
            .flat_map(|t| scene.corners(t))
            .map(|p| p.z)
            .fold(0.0, f64::max)
    };
    assert_eq!((top(0), top(1)), (3.0, 1.0));
}

#[test]
fn both_versions_of_one_scene_are_the_same() {
    let v3 = load(
        "LookAt 0 1 5  0 1 0  0 1 0 Camera \"perspective\" \"float fov\" [40]
         WorldBegin
         MakeNamedMaterial \"m\" \"string type\" [\"matte\"] \"rgb Kd\" [0.1 0.2 0.3]
         NamedMaterial \"m\"
         Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0] \"float st\" [0 0 1 0 1 1]
         AttributeBegin AreaLightSource \"diffuse\" \"color L\" [1 2 3]
         Shape \"quad\" \"point o\" [0 2 0] \"vector u\" [1 0 0] \"vector v\" [0 0 1] AttributeEnd
         WorldEnd",
    );
    let v4 = load(
        "LookAt 0 1 5  0 1 0  0 1 0 Camera \"perspective\" \"float fov\" 40
         WorldBegin
         MakeNamedMaterial \"m\" \"string type\" \"diffuse\" \"rgb reflectance\" [0.1 0.2 0.3]
         NamedMaterial \"m\"
         Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"point2 uv\" [0 0 1 0 1 1]
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 2 3]
         Shape \"bilinearmesh\" \"point3 P\" [0 2 0  1 2 0  0 2 1  1 2 1] AttributeEnd",
    );
    let (a, b) = (v3.scene, v4.scene);
    assert_eq!(a.camera, b.camera);
    assert_eq!(a.uvs[..3], b.uvs[..3]);
    let corners = |s: &SceneDescription| (0..3).map(|t| s.corners(t)).collect::<Vec<_>>();
    assert_eq!(corners(&a), corners(&b));
    assert_eq!(area(&a, 0), area(&b, 0));
    let kd = |s: &SceneDescription| s.diffuse_reflectance(s.material_of(0), DVec2::ZERO);
    assert_eq!(kd(&a), kd(&b));
}

#[test]
fn imports_keep_their_state_and_includes_do_not() {
    let dir = Folder::new("import");
    let part = "Translate 5 0 0 MakeNamedMaterial \"m\" \"string type\" \"diffuse\" \"rgb reflectance\" [ 0.25 0.5 1 ]";
    std::fs::write(dir.join("part.pbrt"), part).unwrap();
    for (word, x) in [("Include", 5.0), ("Import", 0.0)] {
        let text = format!(
            "Camera \"perspective\" WorldBegin {word} \"part.pbrt\" NamedMaterial \"m\"
             Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]"
        );
        let main = dir.join("main.pbrt");
        std::fs::write(&main, text).unwrap();
        let loaded = linelit_formats::load(&main, &LoadOptions::default());
        let scene = loaded.unwrap_or_else(|e| panic!("{e}")).scene;
        assert_eq!(scene.corners(0)[0].x.to_bits(), f64::to_bits(x), "{word}");
        // The named material of the part is known in the main file in both cases.
        let uv = DVec2::ZERO;
        let kd = scene.diffuse_reflectance(scene.material_of(0), uv);
        assert_eq!(kd, DVec3::new(0.25, 0.5, 1.0), "{word}");
    }
}
