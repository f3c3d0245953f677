//! Tests of the lights that a scene gets from its file: merging of coplanar triangles, power,
//! spheres and lines.

use crate::common::{area, assert_near, line, load, world};
use linelit_formats::Loaded;
use linelit_geometry::DVec3;
use linelit_lights::{CylinderLight, DiskLight, Light, SphereLight};
use linelit_scene::{RoundLight, SceneDescription};
use linelit_testkit::folder::Folder;
use std::f64::consts::PI;

fn emissive(indices: &str, points: &str) -> SceneDescription {
    world(&format!(
        "AreaLightSource \"diffuse\" Shape \"trianglemesh\" \"integer indices\" [{indices}] \"point3 P\" [{points}]"
    ))
}

/// Every triangle belongs to exactly one light, and the ranges agree with the lookup.
fn check_ranges(scene: &SceneDescription) {
    let mut covered = vec![0; scene.triangles.len()];
    for (k, light) in scene.lights.iter().enumerate() {
        for t in light.triangles.clone() {
            covered[t as usize] += 1;
            assert_eq!(scene.light_of(t), Some(u32::try_from(k).unwrap()));
        }
        // The triangles have the light's area and lie on its polygon.
        let sum: f64 = light
            .triangles
            .clone()
            .map(|t| {
                let [a, b, c] = scene.corners(t);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum();
        let polygon = &area(scene, k).polygon;
        assert!(
            (sum - polygon.area()).abs() <= 1e-5 * sum,
            "light {k}: {sum} {polygon:?}"
        );
    }
    assert!(covered.iter().all(|c| *c == 1), "{covered:?}");
}

const UNIT: &str = "0 0 0  1 0 0  1 1 0  0 1 0";

#[test]
fn two_triangles_of_a_square_are_one_parallelogram() {
    for indices in ["0 1 2 0 2 3", "0 1 2 2 3 0", "1 2 0 3 0 2", "0 1 3 1 2 3"] {
        let scene = emissive(indices, UNIT);
        check_ranges(&scene);
        assert_eq!(scene.lights.len(), 1, "{indices}");
        let polygon = &area(&scene, 0).polygon;
        assert_eq!(polygon.vertices().len(), 4);
        assert!(polygon.as_parallelogram().is_some());
        assert_near(polygon.normal(), DVec3::Z);
    }
}

#[test]
fn vertices_need_not_be_shared_only_equal() {
    let scene = emissive("0 1 2 3 4 5", "0 0 0  1 0 0  1 1 0   0 0 0  1 1 0  0 1 0");
    check_ranges(&scene);
    assert_eq!(scene.lights.len(), 1);
}

#[test]
fn opposite_windings_do_not_merge() {
    let scene = emissive("0 1 2 0 3 2", UNIT);
    check_ranges(&scene);
    assert_eq!(scene.lights.len(), 2);
    assert_near(area(&scene, 0).polygon.normal(), DVec3::Z);
    assert_near(area(&scene, 1).polygon.normal(), -DVec3::Z);
}

#[test]
fn bent_quads_do_not_merge() {
    let scene = emissive("0 1 2 0 2 3", "0 0 0  1 0 0  1 1 0  0 1 0.001");
    check_ranges(&scene);
    assert_eq!(scene.lights.len(), 2);
}

#[test]
fn quads_that_are_flat_to_rounding_merge() {
    // A tilted, shifted square: its corners round, so that they are flat only to f32.
    let scene = world(
        "AreaLightSource \"diffuse\" Translate 100.3 20.7 3.1 Rotate 33 1 2 3 Scale 0.7 0.7 0.7
         Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [0 0 0  1 0 0  1 1 0  0 1 0]",
    );
    check_ranges(&scene);
    assert_eq!(scene.lights.len(), 1);
    assert!(area(&scene, 0).polygon.as_parallelogram().is_some());
}

#[test]
fn a_grid_of_cells_is_one_square() {
    let n = 7;
    let mut points = String::new();
    let mut indices = String::new();
    for j in 0..=n {
        for i in 0..=n {
            points += &format!("{} 2 {} ", 0.1 * f64::from(i), 0.1 * f64::from(j));
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
            indices += &format!("{a} {b} {c} {a} {c} {d} ");
        }
    }
    let scene = emissive(&indices, &points);
    check_ranges(&scene);
    assert_eq!(scene.lights.len(), 1);
    assert_eq!(area(&scene, 0).polygon.vertices().len(), 4);
    assert_near(area(&scene, 0).polygon.normal(), -DVec3::Y);
}

#[test]
fn an_l_becomes_convex_parts() {
    // Three cells around a corner.
    let points = "0 0 0  1 0 0  2 0 0  0 1 0  1 1 0  2 1 0  0 2 0  1 2 0";
    let scene = emissive("0 1 4 0 4 3  1 2 5 1 5 4  3 4 7 3 7 6", points);
    check_ranges(&scene);
    assert!(scene.lights.len() <= 3, "{}", scene.lights.len());
    let total: f64 = (0..scene.lights.len())
        .map(|k| area(&scene, k).polygon.area())
        .sum();
    assert!((total - 3.0).abs() < 1e-12);
}

#[test]
fn a_ring_is_not_filled() {
    // A square with a square hole: the union is not convex and has two outlines.
    let points = "0 0 0 3 0 0 3 3 0 0 3 0  1 1 0 2 1 0 2 2 0 1 2 0";
    let scene = emissive("0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7", points);
    check_ranges(&scene);
    let total: f64 = (0..scene.lights.len())
        .map(|k| area(&scene, k).polygon.area())
        .sum();
    assert!((total - 8.0).abs() < 1e-12, "{total}");
    assert!(scene.lights.len() <= 8);
}

#[test]
fn parts_that_touch_in_a_corner_stay_apart() {
    let points = "0 0 0 1 0 0 1 1 0 0 1 0  2 1 0 2 2 0 1 2 0";
    let scene = emissive("0 1 2 0 2 3  2 4 5 2 5 6", points);
    check_ranges(&scene);
    assert_eq!(scene.lights.len(), 2);
}

#[test]
fn many_corners_stay_within_the_limit_of_a_polygon() {
    // A disk of 24 steps is convex but has more corners than a polygon may have.
    let scene = world("AreaLightSource \"diffuse\" Shape \"disk\"");
    check_ranges(&scene);
    assert!(
        scene.lights.len() > 1 && scene.lights.len() < 24,
        "{}",
        scene.lights.len()
    );
    let total: f64 = (0..scene.lights.len())
        .map(|k| area(&scene, k).polygon.area())
        .sum();
    // The 24-gon of the disk's area, to the rounding of its vertices.
    assert!(
        (total / PI - 1.0).abs() < f64::from(f32::EPSILON),
        "{total}"
    );
}

#[test]
fn a_cube_has_six_lights() {
    let points = "0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1";
    let indices = "0 2 1 0 3 2  4 5 6 4 6 7  0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7";
    let scene = emissive(indices, points);
    check_ranges(&scene);
    assert_eq!(scene.lights.len(), 6);
    for k in 0..6 {
        let polygon = &area(&scene, k).polygon;
        let outward = polygon.centroid() - DVec3::splat(0.5);
        assert!(polygon.normal().dot(outward) > 0.49);
    }
}

#[test]
fn power_goes_to_each_triangle_of_a_mesh_but_once_to_a_quad() {
    let text = "AreaLightSource \"diffuse\" \"float power\" 10";
    let mesh = world(&format!(
        "{text} Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [{UNIT}]"
    ));
    let quad = world(&format!(
        "{text} Shape \"quad\" \"point o\" [0 0 0] \"vector u\" [1 0 0] \"vector v\" [0 1 0]"
    ));
    assert!((mesh.lights[0].light.power() - 20.0).abs() < 1e-12);
    assert!((quad.lights[0].light.power() - 10.0).abs() < 1e-12);
}

#[test]
fn triangles_of_different_radiance_do_not_merge() {
    // Power gives the smaller triangle more radiance.
    let scene = world(
        "AreaLightSource \"diffuse\" \"float power\" 10
         Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [0 0 0  1 0 0  1 1 0  0 0.5 0]",
    );
    check_ranges(&scene);
    assert_eq!(scene.lights.len(), 2);
}

#[test]
fn lines_are_linear_lights() {
    let scene = world(
        "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] Translate 0 1 0
         Shape \"line\" \"point3 p0\" [0 0 0] \"point3 p1\" [2 0 0]
         Shape \"quad\" \"point o\" [0 0 0] \"vector u\" [1 0 0] \"vector v\" [0 1 0]",
    );
    assert_eq!(scene.lights.len(), 2);
    let light = line(&scene, 0);
    assert_eq!(light.segment.p0, DVec3::Y);
    assert_eq!(light.segment.p1, DVec3::new(2.0, 1.0, 0.0));
    assert_eq!(light.radiance_radius, DVec3::new(1.0, 2.0, 3.0));
    assert!(scene.lights[0].triangles.is_empty());
    // The quad behind it keeps its own triangles.
    assert_eq!(scene.light_of(0), Some(1));
    assert_eq!(scene.light_of(1), Some(1));
    let power = world(
        "AreaLightSource \"diffuse\" \"float power\" 10
         Shape \"line\" \"point3 p0\" [0 0 0] \"point3 p1\" [2 0 0]",
    );
    assert!((power.lights[0].light.power() - 10.0).abs() < 1e-12);
}

#[test]
fn images_on_lines_are_named() {
    let folder = Folder::new("line");
    let path = folder.join("a.tga");
    crate::common::write_tga(&path, [1, 1], &[[128; 3]]);
    let text = format!(
        "Camera \"perspective\" WorldBegin AreaLightSource \"diffuse\" \"string filename\" \"{}\"
         Shape \"line\" \"point3 p0\" [0 0 0] \"point3 p1\" [1 0 0]",
        path.display()
    );
    let loaded = load(&text);
    assert_eq!(line(&loaded.scene, 0).radiance_radius, DVec3::ONE);
    let warnings: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert!(
        warnings.iter().any(|w| w.contains("no place for an image")),
        "{warnings:?}"
    );
}

/// As in pbrt-v4, the radiance of a light with an image and `power` is computed from the mean
/// luminance of all pixels. A light that shows only a part of the image has the same radiance per
/// pixel, and so another power.
#[test]
fn the_power_of_a_light_with_an_image_is_the_images() {
    let folder = Folder::new("power");
    let path = folder.join("a.tga");
    let colours = [[255, 0, 0], [0, 255, 0], [0, 0, 0], [0, 0, 0]];
    let luminance = [0.212_671, 0.715_160];
    let whole = (luminance[0] + luminance[1]) / 4.0;
    crate::common::write_tga(&path, [4, 1], &colours);
    let light = |rest: &str| {
        format!(
            "AreaLightSource \"diffuse\" \"string filename\" \"{}\" \"float power\" 100 {rest}",
            path.display()
        )
    };
    let square = "Shape \"bilinearmesh\" \"point3 P\" [0 0 0 2 0 0 0 2 0 2 2 0]";
    // A light with only the left half of the image shows all of the red pixel and seven eighths of
    // the green one, because the filter blends its edge with the black pixel to its right.
    let left = "\"point2 uv\" [0 0 .5 0 0 1 .5 1]";
    let of_left = (luminance[0] + 0.875 * luminance[1]) / 2.0 / whole;
    for (text, sides, want) in [
        (format!("{} {square}", light("")), 1.0, 100.0),
        (
            format!("{} {square}", light("\"bool twosided\" true")),
            2.0,
            100.0,
        ),
        (
            format!("{} {square}", light("\"float scale\" 2")),
            1.0,
            200.0,
        ),
        (
            format!("{} {square} {left}", light("")),
            1.0,
            100.0 * of_left,
        ),
    ] {
        let scene = world(&text);
        let square = area(&scene, 0);
        let sent = PI * square.polygon.area() * sides * square.emission.radiance;
        let got = sent.x * luminance[0] + sent.y * luminance[1];
        // The mean over the light is a midpoint rule with parts h = 1/8 pixel wide. Where the slope
        // of the image jumps by J, its error is at most J h²/8. The slopes of green jump most, by
        // twice those of red.
        let jumps = luminance[0] * 2.0 + luminance[1] * 4.0;
        let bound = want * jumps / 512.0 / (4.0 * whole);
        assert!((got - want).abs() <= bound, "{text}: {got} {want}");
    }
    // A black image gives no light, and a line cannot have an image.
    crate::common::write_tga(&path, [1, 1], &[[0; 3]]);
    let text = format!("Camera \"perspective\" WorldBegin {} {square}", light(""));
    let loaded = load(&text);
    assert!(loaded.scene.lights.is_empty());
    let said =
        |loaded: &Loaded, what: &str| loaded.warnings.iter().any(|w| w.to_string().contains(what));
    assert!(said(&loaded, "an area light emits nothing"));
    crate::common::write_tga(&path, [1, 1], &[[128; 3]]);
    let line = "Shape \"line\" \"point3 p0\" [0 0 0] \"point3 p1\" [1 0 0]";
    let loaded = load(&format!(
        "Camera \"perspective\" WorldBegin {} {line}",
        light("")
    ));
    assert!(
        loaded.scene.lights.is_empty() && said(&loaded, "left out, as its `power` is the image's")
    );
}

#[test]
fn spheres_remember_what_they_are() {
    let scene = world(
        "AreaLightSource \"diffuse\" Translate 1 2 3 Scale 2 2 -2 Shape \"sphere\" \"float radius\" 0.5",
    );
    check_ranges(&scene);
    let found = &scene.round[0];
    let Light::Sphere(SphereLight { sphere, .. }) = found.light else {
        panic!("a sphere: {found:?}");
    };
    assert_near(sphere.center, DVec3::new(1.0, 2.0, 3.0));
    assert!((sphere.radius - 1.0).abs() < 1e-15 && found.outward);
    assert_eq!(found.lights, 0..u32::try_from(scene.lights.len()).unwrap());
    for k in 0..scene.lights.len() {
        let polygon = &area(&scene, k).polygon;
        assert!(
            polygon.normal().dot(polygon.centroid() - sphere.center) > 0.0,
            "faces outwards"
        );
    }
    // An ellipsoid becomes facets, and no round light.
    let scene = world("AreaLightSource \"diffuse\" Scale 1 2 1 Shape \"sphere\"");
    assert!(scene.round.is_empty() && !scene.lights.is_empty());
}

/// Returns the cylinder light of a round light, or panics if that is no cylinder.
fn tube_of(round: &RoundLight) -> CylinderLight {
    let Light::Cylinder(light) = round.light else {
        panic!("a cylinder: {round:?}");
    };
    light
}

#[test]
fn cylinders_remember_what_they_are() {
    let light = "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] ";
    let tube = "Shape \"cylinder\" \"float radius\" 0.25 \"float zmin\" 1 \"float zmax\" -0.5";
    for (turn, inward) in [("", false), ("ReverseOrientation ", true)] {
        // The transform makes the cylinder longer than it is wide, and mirrors it.
        let place = "Translate 1 2 3 Rotate 90 0 1 0 Scale 2 -2 4";
        let scene = world(&format!("{light}{turn}{place} {tube}"));
        check_ranges(&scene);
        let found = &scene.round[0];
        let CylinderLight { cylinder, radiance } = tube_of(found);
        assert_near(cylinder.axis.p0, DVec3::new(-1.0, 2.0, 3.0));
        assert_near(cylinder.axis.p1, DVec3::new(5.0, 2.0, 3.0));
        assert!((cylinder.radius - 0.5).abs() < 1e-15);
        assert_eq!(found.outward, !inward);
        assert_eq!(radiance, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(found.lights, 0..u32::try_from(scene.lights.len()).unwrap());
        let facet = &area(&scene, 0).polygon;
        let out = cylinder.normal(facet.centroid()) * if inward { -1.0 } else { 1.0 };
        assert!(facet.normal().dot(out) > 0.9, "{facet:?} {found:?}");
    }
    // `power` is spread over the area of the exact cylinder, not over that of its facets.
    let text = "AreaLightSource \"diffuse\" \"float power\" 5 Shape \"cylinder\"";
    let CylinderLight { cylinder, radiance } = tube_of(&world(text).round[0]);
    let power = radiance.element_sum() / 3.0 * cylinder.area() * PI;
    assert!((power - 5.0).abs() < 1e-12, "{power}");
    // Elliptic, slanted and cut cylinders become facets.
    for shape in [
        "Scale 1 2 1 Shape \"cylinder\"",
        "Transform [1 0 0.5 0  0 1 0 0  0 0 1 0  0 0 0 1] Shape \"cylinder\"",
        "Shape \"cylinder\" \"float phimax\" 180",
    ] {
        let scene = world(&format!("{light}{shape}"));
        assert!(
            scene.round.is_empty() && !scene.lights.is_empty(),
            "{shape}"
        );
    }
}

/// The facets of a round light, which the camera sees, are as bright as the exact light that
/// illuminates: the radiance of both is computed with the area of the exact surface.
#[test]
fn the_facets_of_a_round_light_are_as_bright_as_it_is() {
    let light = |shape: &str| {
        world(&format!(
            "AreaLightSource \"diffuse\" \"float power\" 100 {shape}"
        ))
    };
    for (shape, area_of_it) in [
        ("Shape \"sphere\" \"float radius\" .5", PI),
        ("Scale 2 2 2 Shape \"sphere\" \"float radius\" .5", 4.0 * PI),
        ("Shape \"sphere\" \"float zmin\" 0", 2.0 * PI),
        ("Shape \"sphere\" \"float phimax\" 90", PI),
        ("Shape \"disk\" \"float radius\" .5", PI / 4.0),
        ("Scale 3 1 1 Shape \"disk\"", 3.0 * PI),
        ("Shape \"disk\" \"float innerradius\" .5", 0.75 * PI),
        (
            "Rotate 50 1 2 3 Shape \"cylinder\" \"float radius\" .5",
            2.0 * PI,
        ),
        ("Shape \"cylinder\" \"float phimax\" 180", 2.0 * PI),
    ] {
        let scene = light(shape);
        let want = 100.0 / (PI * area_of_it);
        for round in &scene.round {
            let radiance = match &round.light {
                Light::Sphere(s) => s.radiance,
                Light::Disk(d) => d.emission.radiance,
                Light::Cylinder(c) => c.radiance,
                other => panic!("{other:?} is not round"),
            };
            assert!((radiance.x / want - 1.0).abs() < 1e-14, "{shape}");
        }
        let mut power = 0.0;
        for k in 0..scene.lights.len() {
            let facet = area(&scene, k);
            // Vertices are rounded to f32. Their distances are about a tenth, so that the relative
            // error is ten times as large.
            let rounding = 10.0 * f64::from(f32::EPSILON);
            let error = facet.emission.radiance.x / want - 1.0;
            assert!(error.abs() < rounding, "{shape}: {error}");
            power += facet.emission.radiance.x * facet.polygon.area() * PI;
        }
        // The radiance was computed from these facets. Merging coplanar facets changes the area
        // only by the rounding that makes them not quite flat.
        assert!(
            (power / 100.0 - 1.0).abs() < f64::from(f32::EPSILON),
            "{shape}"
        );
    }
    // The radiance of an ellipsoid is computed with the area of its facets.
    let scene = light("Scale .6 .3 .1 Shape \"sphere\"");
    let of = |k| area(&scene, k).emission.radiance.x * area(&scene, k).polygon.area() * PI;
    let power: f64 = (0..scene.lights.len()).map(of).sum();
    assert!(
        (power / 100.0 - 1.0).abs() < f64::from(f32::EPSILON),
        "{power}"
    );
}

/// A warning says why a round light is replaced by facets even if exact round lights are wanted.
#[test]
fn round_lights_say_why_they_are_facets() {
    let warned = |light: &str, shape: &str| {
        let text = format!(
            "Camera \"perspective\" WorldBegin AreaLightSource \"diffuse\" {light} {shape}"
        );
        let warnings = load(&text).warnings;
        let all: Vec<_> = warnings.iter().map(ToString::to_string).collect();
        all.join("\n")
    };
    let (tube, disk) = ("Shape \"cylinder\"", "Shape \"disk\"");
    let two_sided = "\"bool twosided\" true";
    // No warning is given for lights that can be exact.
    for light in [
        warned("", tube),
        warned(two_sided, disk),
        warned("", "Shape \"sphere\""),
    ] {
        assert!(!light.contains("facets"), "{light}");
    }
    for bent in ["Scale 1 2 1", "Scale 1 1 2", "Rotate 30 1 0 0 Scale 3 1 1"] {
        let light = warned("", &format!("{bent} Shape \"sphere\""));
        assert!(
            light.contains("exact are those that its transform leaves round only"),
            "{light}"
        );
    }
    let outwards = "triangles of its area; exact are those that emit outwards only";
    assert!(warned(two_sided, tube).contains(outwards));
    assert!(warned("", &format!("ReverseOrientation {tube}")).contains(outwards));
    assert!(warned(two_sided, "Shape \"sphere\"").contains(outwards));
    let cut = warned("", "Shape \"cylinder\" \"float phimax\" 90");
    assert!(cut.contains("exact are whole spheres, disks and cylinders only"));
}

#[test]
fn disks_remember_what_they_are() {
    let light = "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] ";
    let disk = "Shape \"disk\" \"float radius\" 0.5 \"float height\" 0.25";
    for (turn, sign) in [("", 1.0), ("ReverseOrientation ", -1.0)] {
        let text = format!("{light}{turn}Translate 1 2 3 Rotate 90 0 1 0 Scale 2 2 -2 {disk}");
        let scene = world(&text);
        check_ranges(&scene);
        let found = &scene.round[0];
        let disk_of = |round: &RoundLight| match &round.light {
            Light::Disk(DiskLight { disk, .. }) => *disk,
            other => panic!("{other:?} is no disk"),
        };
        let there = disk_of(found);
        assert_near(there.center, DVec3::new(0.5, 2.0, 3.0));
        assert!((there.radius - 1.0).abs() < 1e-15);
        assert!((there.normal.x.abs() - 1.0).abs() < 1e-15);
        assert_eq!(found.lights, 0..u32::try_from(scene.lights.len()).unwrap());
        let facets = area(&scene, 0).polygon.normal();
        assert!(facets.dot(there.normal) > 0.999, "{facets} {found:?}");
        let without = world(&format!(
            "{light}Translate 1 2 3 Rotate 90 0 1 0 Scale 2 2 -2 {disk}"
        ));
        let same = disk_of(&without.round[0]).normal.dot(there.normal);
        assert!((same - sign).abs() < 1e-15, "{same}");
    }
    // Ellipses, rings and sectors become facets.
    for shape in [
        "Scale 1 2 1 Shape \"disk\"",
        "Shape \"disk\" \"float innerradius\" 0.1",
        "Shape \"disk\" \"float phimax\" 180",
    ] {
        let scene = world(&format!("{light}{shape}"));
        assert!(
            scene.round.is_empty() && !scene.lights.is_empty(),
            "{shape}"
        );
    }
}
