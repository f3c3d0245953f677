//! What stands in a scene many times: kept once or copied, the same either way.

use crate::common::load;
use linelit_formats::{Instancing, LoadOptions};
use linelit_geometry::DVec3;
use linelit_scene::{Place, Scene};

fn read(text: &str, instancing: Instancing) -> Scene {
    let options = LoadOptions {
        instancing,
        ..LoadOptions::default()
    };
    let text = format!("Camera \"perspective\" WorldBegin {text}");
    let loaded = linelit_formats::from_pbrt_str(&text, "test.pbrt", &options);
    loaded.unwrap_or_else(|e| panic!("{e}")).scene
}

/// A sphere with normals and a triangle without, turned over, sheared, and mirrored twice over.
const OBJECTS: &str = "ObjectBegin \"o\" Translate 0.5 0 0 Shape \"sphere\"
    Texture \"check\" \"float\" \"checkerboard\" ReverseOrientation
    Material \"matte\" \"rgb Kd\" [0.1 0.2 0.3]
    Shape \"trianglemesh\" \"point3 P\" [0 0 0  1 0 0  0 1 2] \"texture alpha\" \"check\" ObjectEnd
    ObjectInstance \"o\"
    AttributeBegin Scale -2 1 1 Rotate 30 1 2 3 ObjectInstance \"o\" AttributeEnd
    AttributeBegin ReverseOrientation ConcatTransform [ 1 0 0 0  0.5 1 0 0  0 0.25 1 0  7 8 9 1 ]
    ObjectInstance \"o\" AttributeEnd";

/// What a ray meets on an instance is what it meets on a copy.
#[test]
fn surfaces_of_instances_are_those_of_copies() {
    let (kept, copied) = (
        read(OBJECTS, Instancing::Always),
        read(OBJECTS, Instancing::Never),
    );
    assert_eq!((kept.objects.len(), kept.instances.len()), (1, 3));
    assert!(kept.triangles.is_empty() && copied.objects.is_empty());
    assert_eq!(kept.triangles_in_world(), copied.triangles.len());
    let per_instance = copied.triangles.len() / 3;
    for k in 0..copied.triangles.len() {
        let index = |k: usize| u32::try_from(k).unwrap();
        let place = Place {
            instance: Some(index(k / per_instance)),
            triangle: index(k % per_instance),
        };
        for direction in [DVec3::new(0.1, -0.9, 0.3), DVec3::new(-0.7, 0.2, 0.8)] {
            let a = kept.surface(place, [0.3, 0.5], direction);
            let b = copied.surface(index(k), [0.3, 0.5], direction);
            // Coordinates up to 12, rounded to f32 in either; the sphere's triangles are 0.05 wide,
            // which their normals lose by.
            let rounding = 12.0 * f64::from(f32::EPSILON);
            assert!((a.point - b.point).length() < 3.0 * rounding, "{k}");
            let normal = (a.geometric_normal - b.geometric_normal).length();
            assert!(normal < 1e-3, "{k}: {normal}");
            let normal = (a.shading_normal - b.shading_normal).length();
            assert!(normal < 1e-5, "{k}: {normal}");
            assert_eq!((a.outside, a.material), (b.outside, b.material), "{k}");
            assert_eq!(kept.mesh(place).cutout, copied.mesh(index(k)).cutout);
            let [du, dv] = kept.tangents(place);
            let [eu, ev] = copied.tangents(index(k));
            let room = 1e-3 * (eu.length() + ev.length());
            assert!((du - eu).length() + (dv - ev).length() < room, "{k}");
            assert!(a.uv == b.uv && a.extent >= b.extent * (1.0 - 1e-5));
        }
    }
    let (a, b) = (kept.bounds().unwrap(), copied.bounds().unwrap());
    assert!(a.0.cmple(b.0 + 1e-5).all() && a.1.cmpge(b.1 - 1e-5).all());
}

/// Some `count` instances of a sphere of 6,240 triangles or so.
fn spheres(count: usize, before: &str) -> String {
    format!(
        "ObjectBegin \"o\" {before} Shape \"sphere\" ObjectEnd {}",
        "ObjectInstance \"o\" Translate 1 0 0\n".repeat(count)
    )
}

#[test]
fn what_saves_much_is_kept_once() {
    let one = read(&spheres(1, ""), Instancing::Auto);
    assert_eq!((one.objects.len(), one.instances.len()), (0, 0));
    let triangles = one.triangles.len();
    let enough = 1 + Instancing::SAVED.div_ceil(triangles);
    for (count, kept) in [(enough - 1, 0), (enough, enough)] {
        let scene = read(&spheres(count, ""), Instancing::Auto);
        assert_eq!(scene.instances.len(), kept);
        assert_eq!(scene.triangles_in_world(), count * triangles);
    }
    // What emits is a light for each instance.
    let light = "AttributeBegin AreaLightSource \"diffuse\" Shape \"disk\" AttributeEnd";
    let scene = read(&spheres(enough, light), Instancing::Auto);
    assert_eq!((scene.instances.len(), scene.disks.len()), (enough, enough));
    // Few triangles are copied however often.
    let few = format!(
        "ObjectBegin \"o\" Shape \"quad\" \"point o\" [0 0 0] \"vector u\" [1 0 0] \"vector v\" [0 1 0] ObjectEnd {}",
        "ObjectInstance \"o\"\n".repeat(Instancing::SAVED / 2 + 1)
    );
    assert!(read(&few, Instancing::Auto).instances.is_empty());
}

#[test]
fn copies_of_what_is_kept_for_later_are_where_they_would_be() {
    let text = spheres(2, "Translate 1 2 3 Rotate 20 1 1 0");
    let (auto, never) = (
        read(&text, Instancing::Auto),
        read(&text, Instancing::Never),
    );
    assert!(auto.instances.is_empty());
    assert_eq!(
        (auto.positions, auto.triangles),
        (never.positions, never.triangles)
    );
}

#[test]
fn warnings_of_objects_name_their_places() {
    let text = format!(
        "Camera \"perspective\" WorldBegin {}\nScale 1 1 0 ObjectInstance \"o\"",
        spheres(1, "")
    );
    let loaded = load(&text);
    let warning = loaded
        .warnings
        .iter()
        .find(|w| w.message().contains("flattened"));
    assert_eq!(warning.map(|w| w.line()), Some(Some(3)));
}
