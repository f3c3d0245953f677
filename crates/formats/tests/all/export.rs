//! What is written as pbrt text reads back as the same scene.

use crate::common::{area, load, written};
use linelit_formats::ExportOptions;
use linelit_geometry::DVec2;
use linelit_scene::Scene;

/// The same without extensions.
fn plainly(scene: &Scene) -> Scene {
    let mut text = Vec::new();
    let options = ExportOptions::default();
    linelit_formats::write_pbrt(scene, &mut text, &options).unwrap();
    load(&String::from_utf8(text).unwrap()).scene
}

#[test]
fn everything_comes_back() {
    let scene = load(include_str!("../seeds/everything.pbrt")).scene;
    let back = written(&scene);
    assert_eq!(back.triangles.len(), scene.triangles.len());
    assert_eq!(back.lights.len(), scene.lights.len());
    assert_eq!(back.film, scene.film);
    for t in 0..u32::try_from(scene.triangles.len()).unwrap() {
        // A mirrored mesh is wound the other way, which is the same triangle from the outside.
        let sorted = |s: &Scene| {
            let mut corners = s.corners(t).map(|p| p.to_array().map(f64::to_bits));
            corners.sort_unstable();
            corners
        };
        assert_eq!(sorted(&scene), sorted(&back), "triangle {t}");
        let centre = |s: &Scene| s.surface(t, [1.0 / 3.0, 1.0 / 3.0], linelit_geometry::DVec3::Z);
        let (a, b) = (centre(&scene), centre(&back));
        assert_eq!(a.outside, b.outside, "triangle {t}");
        assert!((a.shading_normal - b.shading_normal).length() < 1e-6);
        let uv = DVec2::new(0.3, 0.6);
        let kd = |s: &Scene, m: u32| s.diffuse_reflectance(m, uv);
        let (x, y) = (kd(&scene, a.material), kd(&back, b.material));
        assert!((x - y).length() < 1e-12, "triangle {t}: {x} {y}");
    }
    for (x, y) in [(0.0, 0.0), (3.5, 7.25), (20.0, 10.0)] {
        let (a, b) = (scene.camera.ray(x, y), back.camera.ray(x, y));
        // The matrix is inverted twice: a few ulps of its condition number, which is one.
        assert!((a.direction - b.direction).length() < 1e-14);
        assert!((a.origin - b.origin).length() < 1e-13);
    }
}

#[test]
fn lights_come_back_exactly() {
    let scene = load(
        "Camera \"perspective\" WorldBegin
         AreaLightSource \"diffuse\" \"rgb L\" [0.1 0.2 0.3] \"bool twosided\" true
         Scale -1 1 1 Rotate 17 1 2 3
         Shape \"quad\" \"point o\" [0 0 0] \"vector u\" [1 0 0] \"vector v\" [0 1 0]
         AreaLightSource \"diffuse\" \"rgb L\" [7 8 9]
         Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [0 0 1  1 0 1  1 1 2  0 1 1]",
    )
    .scene;
    let back = written(&scene);
    assert_eq!(scene.lights.len(), 3);
    for k in 0..3 {
        let (a, b) = (area(&scene, k), area(&back, k));
        assert_eq!(a.emission, b.emission);
        assert!((a.polygon.normal() - b.polygon.normal()).length() < 1e-14);
        assert!((a.polygon.area() - b.polygon.area()).abs() < 1e-14);
    }
}

/// A folder of this process with an image of 2 × 2 pixels, and a light that emits it.
fn lit_by_image(name: &str, parameters: &str, shape: &str) -> Scene {
    let folder = std::env::temp_dir().join(format!("linelit-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("a.tga");
    let pixels = vec![[10, 20, 30], [255, 0, 0], [90, 80, 70], [1, 2, 3]];
    crate::common::write_tga(&path, [2, 2], pixels);
    let light = format!(
        "AreaLightSource \"diffuse\" \"string filename\" \"{}\"",
        path.display()
    );
    load(&format!(
        "Camera \"perspective\" WorldBegin {light} {parameters} {shape}"
    ))
    .scene
}

const QUAD: &str = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]
    \"point3 P\" [0 0 1  1 0 1  1 1 1  0 1 1] \"point2 uv\" [ 0.5 0  1 0  1 1  0.5 1 ]";

/// With extensions of any colour, without them of grey: pbrt-v4 has only a factor.
#[test]
fn emitted_images_come_back() {
    let colours = lit_by_image("colours", "\"rgb L\" [1 2 3] \"float scale\" 0.1", QUAD);
    let back = written(&colours);
    let grey = lit_by_image("grey", "\"float scale\" 0.1", QUAD);
    let (plain, meant) = (plainly(&grey), plainly(&colours));
    for (scene, back) in [(&colours, &back), (&grey, &plain)] {
        let (a, b) = (scene.lights[0].map.as_ref(), back.lights[0].map.as_ref());
        let (a, b) = (a.unwrap(), b.unwrap());
        assert_eq!(area(scene, 0), area(back, 0));
        assert_eq!((a.radiance, a.coordinates), (b.radiance, b.coordinates));
        let uv = DVec2::new(0.7, 0.4);
        assert_eq!(a.evaluate(uv), b.evaluate(uv));
    }
    // Of what cannot be written, the mean is.
    assert!(meant.lights[0].map.is_none());
    assert_eq!(area(&meant, 0).emission, area(&colours, 0).emission);
}

#[test]
fn emissive_spheres_come_back_as_spheres() {
    let scene = load(
        "Camera \"perspective\" WorldBegin AreaLightSource \"diffuse\" \"rgb L\" [1 2 3]
         Translate 1 2 3 Rotate 30 1 1 0 Scale 2 2 2 Shape \"sphere\" \"float radius\" 0.5
         ReverseOrientation Shape \"sphere\"",
    )
    .scene;
    assert_eq!(scene.spheres.len(), 2);
    let back = written(&scene);
    assert_eq!(back.spheres, scene.spheres);
    for t in 0..u32::try_from(scene.triangles.len()).unwrap() {
        assert_eq!(back.corners(t), scene.corners(t));
    }
    // pbrt-v4 gets the spheres themselves: with other facets, but at the same place.
    let plain = plainly(&scene);
    for (a, b) in plain.spheres.iter().zip(&scene.spheres) {
        assert_eq!(
            (a.inward, a.radius.to_bits()),
            (b.inward, b.radius.to_bits())
        );
        assert_eq!((a.center, a.emission), (b.center, b.emission));
    }
}

#[test]
fn emissive_disks_come_back_as_disks() {
    let scene = load(
        "Camera \"perspective\" WorldBegin AreaLightSource \"diffuse\" \"rgb L\" [1 2 3]
         Translate 1 2 3 Rotate 30 1 1 0 Scale 2 2 2 Shape \"disk\" \"float radius\" 0.5
         ReverseOrientation Shape \"disk\"",
    )
    .scene;
    assert_eq!(scene.disks.len(), 2);
    let back = written(&scene);
    assert_eq!(back.disks, scene.disks);
    for t in 0..u32::try_from(scene.triangles.len()).unwrap() {
        assert_eq!(back.corners(t), scene.corners(t));
    }
    // pbrt-v4 gets the disks themselves: with other facets, but at the same place.
    let plain = plainly(&scene);
    assert_eq!(plain.disks.len(), 2);
    for (a, b) in plain.disks.iter().zip(&scene.disks) {
        assert_eq!(a.emission, b.emission);
        let off =
            [a.disk.center - b.disk.center, a.disk.normal - b.disk.normal].map(|v| v.length());
        assert!(off[0].max(off[1]) < 1e-14, "{a:?} {b:?}");
        assert!((a.disk.radius / b.disk.radius - 1.0).abs() < 1e-14);
    }
}

#[test]
fn emissive_cylinders_come_back_as_cylinders() {
    let scene = load(
        "Camera \"perspective\" WorldBegin AreaLightSource \"diffuse\" \"rgb L\" [1 2 3]
         Translate 1 2 3 Rotate 30 1 1 0 Scale 2 2 3 Shape \"cylinder\" \"float radius\" 0.5
         ReverseOrientation Shape \"cylinder\"",
    )
    .scene;
    assert_eq!(scene.cylinders.len(), 2);
    assert!(!scene.cylinders[0].inward && scene.cylinders[1].inward);
    let back = written(&scene);
    assert_eq!(back.cylinders, scene.cylinders);
    for t in 0..u32::try_from(scene.triangles.len()).unwrap() {
        assert_eq!(back.corners(t), scene.corners(t));
    }
    // pbrt-v4 gets the cylinders themselves: with other facets, but at the same place.
    let plain = plainly(&scene);
    assert_eq!(plain.cylinders.len(), 2);
    for (a, b) in plain.cylinders.iter().zip(&scene.cylinders) {
        assert_eq!((a.inward, a.emission), (b.inward, b.emission));
        let [(p, q), (r, s)] = [a, b].map(|c| (c.cylinder.axis.p0, c.cylinder.axis.p1));
        assert!(
            (p - r).length().max((q - s).length()) < 1e-14,
            "{a:?} {b:?}"
        );
        assert!((a.cylinder.radius / b.cylinder.radius - 1.0).abs() < 1e-14);
    }
}

/// Facets show the image of a sphere; the sphere as it is would emit as if the image were white.
#[test]
fn emissive_spheres_with_images_are_facets() {
    let scene = lit_by_image("sphere", "", "Shape \"sphere\"");
    assert!(scene.spheres.is_empty() && scene.lights.len() > 10);
    assert!(scene.lights.iter().all(|light| light.map.is_some()));
}

/// What the program says that other materials become, they become.
#[test]
fn plain_materials_are_the_nearest_that_pbrt_v4_has() {
    let mut text = "Camera \"perspective\" WorldBegin\n".to_owned();
    for material in [
        "\"matte\" \"float sigma\" 20",
        "\"plastic\"",
        "\"substrate\" \"rgb Ks\" [ .1 .1 .1 ]",
        "\"uber\" \"float eta\" 1.25",
        "\"phong\"",
        "\"mirror\" \"rgb Kr\" [ .5 .5 .5 ]",
        "\"glass\" \"rgb Kr\" [ .5 .5 .5 ]",
    ] {
        text += &format!("Material {material} Shape \"sphere\"\n");
    }
    let scene = load(&text).scene;
    let back = plainly(&scene);
    let is_used = |m: &&linelit_scene::Mesh| m.material > 0;
    let meshes = scene.meshes.iter().zip(&back.meshes);
    let mut compared = 0;
    for (ours, theirs) in meshes.filter(|(m, _)| is_used(m)) {
        let nearest = linelit_formats::nearest_in_pbrt_v4(&scene.materials[ours.material as usize]);
        let nearest = nearest.expect("none of these is pbrt-v4's");
        let read = &back.materials[theirs.material as usize];
        let (want, got) = (format!("{:?}", nearest.kind), format!("{:?}", read.kind));
        // How a roughness of zero is remapped is all one.
        let strip = |s: &str| {
            s.replace("remap: V3", "")
                .replace("remap: V4", "")
                .replace("remap: None", "")
        };
        let numbers = |s: &str| {
            strip(s)
                .chars()
                .filter(|c| !c.is_whitespace())
                .collect::<String>()
        };
        if !want.contains("roughness") {
            assert_eq!(numbers(&got), numbers(&want));
        }
        assert_eq!(read.kind.name(), nearest.kind.name());
        compared += 1;
    }
    assert_eq!(compared, 7);
}
