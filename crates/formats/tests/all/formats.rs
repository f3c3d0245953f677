//! The same room as pbrt v3, pbrt v4, OBJ and glTF is the same scene, bit for bit.

#![cfg_attr(
    not(feature = "gltf"),
    allow(dead_code, unused_imports, reason = "what is for glTF")
)]

use crate::common::base64;
use crate::common::{area, line};
use linelit_formats::{Format, LoadOptions};
use linelit_geometry::{DVec2, DVec3};
use linelit_scene::SceneDescription;
use linelit_testkit::folder::Folder;
use std::fmt::Write as _;

type Quad = [[f32; 3]; 4];

/// Quads with their colours; the last one is the light and emits its colour.
fn room() -> Vec<(Quad, [f64; 3])> {
    // The floor, the ceiling, the back wall, the left wall, the right wall and the light.
    let white = [0.75, 0.75, 0.75];
    vec![
        (
            [
                [-1.0, 0.0, 1.0],
                [1.0, 0.0, 1.0],
                [1.0, 0.0, -1.0],
                [-1.0, 0.0, -1.0],
            ],
            white,
        ),
        (
            [
                [-1.0, 2.0, -1.0],
                [1.0, 2.0, -1.0],
                [1.0, 2.0, 1.0],
                [-1.0, 2.0, 1.0],
            ],
            white,
        ),
        (
            [
                [-1.0, 0.0, -1.0],
                [1.0, 0.0, -1.0],
                [1.0, 2.0, -1.0],
                [-1.0, 2.0, -1.0],
            ],
            white,
        ),
        (
            [
                [-1.0, 0.0, 1.0],
                [-1.0, 0.0, -1.0],
                [-1.0, 2.0, -1.0],
                [-1.0, 2.0, 1.0],
            ],
            [0.625, 0.0625, 0.0625],
        ),
        (
            [
                [1.0, 0.0, -1.0],
                [1.0, 0.0, 1.0],
                [1.0, 2.0, 1.0],
                [1.0, 2.0, -1.0],
            ],
            [0.125, 0.5, 0.125],
        ),
        (
            [
                [-0.25, 1.9, -0.25],
                [0.25, 1.9, -0.25],
                [0.25, 1.9, 0.25],
                [-0.25, 1.9, 0.25],
            ],
            [16.0, 12.0, 4.0],
        ),
    ]
}

/// The ends of a linear light.
const TUBE: [[f32; 3]; 2] = [[-0.5, 1.5, 0.0], [0.5, 1.5, 0.0]];
/// The radiance times radius of the linear light.
const TUBE_COLOUR: [f64; 3] = [0.5, 0.25, 0.125];

fn list<const N: usize>(points: &[[f32; N]]) -> String {
    points.iter().flatten().map(|c| format!("{c} ")).collect()
}

fn rgb([r, g, b]: [f64; 3]) -> String {
    format!("{r} {g} {b}")
}

/// The room in pbrt text of version 3 or 4.
fn pbrt(v4: bool) -> String {
    // Write the film, the camera and the quads, with the names of the version.
    let (point, matte, kd) = if v4 {
        ("point3", "diffuse", "reflectance")
    } else {
        ("point", "matte", "Kd")
    };
    let mut text = "Film \"rgb\" \"integer xresolution\" 720 \"integer yresolution\" 720\n\
        Scale -1 1 1 LookAt 0 1 5  0 1 0  0 1 0 Camera \"perspective\" \"float fov\" 40\nWorldBegin\n"
        .to_owned();
    let room = room();
    for (k, (quad, colour)) in room.iter().enumerate() {
        let source = if k + 1 == room.len() {
            format!(
                "Material \"{matte}\" \"rgb {kd}\" [0 0 0] AreaLightSource \"diffuse\" \"rgb L\" [{}]",
                rgb(*colour)
            )
        } else {
            format!("Material \"{matte}\" \"rgb {kd}\" [{}]", rgb(*colour))
        };
        writeln!(
            text,
            "AttributeBegin {source} Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"{point} P\" [{}] AttributeEnd",
            list(quad)
        )
        .unwrap();
    }
    // Write the linear light.
    writeln!(
        text,
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [{}] Shape \"line\" \"{point} p0\" [{}] \"{point} p1\" [{}] AttributeEnd",
        rgb(TUBE_COLOUR),
        list(&TUBE[..1]),
        list(&TUBE[1..])
    )
    .unwrap();
    if !v4 {
        text += "WorldEnd\n";
    }
    text
}

/// The OBJ text and its material library.
fn obj() -> (String, String) {
    let (mut text, mut library) = ("mtllib room.mtl\n".to_owned(), String::new());
    let room = room();
    for (k, (quad, colour)) in room.iter().enumerate() {
        let emits = k + 1 == room.len();
        let key = if emits { "Kd 0 0 0\nKe" } else { "Kd" };
        writeln!(library, "newmtl m{k}\n{key} {}", rgb(*colour)).unwrap();
        for [x, y, z] in quad {
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
        writeln!(text, "usemtl m{k}\nf -4 -3 -2 -1").unwrap();
    }
    writeln!(library, "newmtl tube\nKe {}", rgb(TUBE_COLOUR)).unwrap();
    writeln!(
        text,
        "v {}\nv {}\nusemtl tube\nl -2 -1",
        list(&TUBE[..1]),
        list(&TUBE[1..])
    )
    .unwrap();
    (text, library)
}

fn gltf() -> String {
    let mut bytes: Vec<u8> = [0_u16, 1, 2, 0, 2, 3]
        .iter()
        .flat_map(|i| i.to_le_bytes())
        .collect();
    let (mut meshes, mut materials, mut accessors) = (String::new(), String::new(), String::new());
    let room = room();
    for (k, (quad, colour)) in room.iter().enumerate() {
        let (kd, ke) = if k + 1 == room.len() {
            ([0.0; 3], *colour)
        } else {
            (*colour, [0.0; 3])
        };
        let strength = ke[0].max(1.0);
        let [r, g, b] = kd;
        let factor = ke.map(|c| c / strength);
        write!(
            materials,
            r#"{{ "pbrMetallicRoughness": {{ "baseColorFactor": [{r}, {g}, {b}, 1], "metallicFactor": 0 }},
              "emissiveFactor": [{}, {}, {}],
              "extensions": {{ "KHR_materials_emissive_strength": {{ "emissiveStrength": {strength} }} }} }},"#,
            factor[0], factor[1], factor[2]
        )
        .unwrap();
        write!(
            meshes,
            r#"{{ "attributes": {{ "POSITION": {} }}, "indices": 0, "material": {k} }},"#,
            k + 1
        )
        .unwrap();
        write!(accessors, r#", {{ "bufferView": 0, "byteOffset": {}, "componentType": 5126, "count": 4, "type": "VEC3" }}"#, bytes.len()).unwrap();
        bytes.extend(quad.iter().flatten().flat_map(|c| c.to_le_bytes()));
    }
    let [r, g, b] = TUBE_COLOUR;
    let k = room.len();
    write!(materials, r#"{{ "emissiveFactor": [{r}, {g}, {b}] }}"#).unwrap();
    write!(
        meshes,
        r#"{{ "attributes": {{ "POSITION": {} }}, "material": {k}, "mode": 1 }}"#,
        k + 1
    )
    .unwrap();
    write!(accessors, r#", {{ "bufferView": 0, "byteOffset": {}, "componentType": 5126, "count": 2, "type": "VEC3" }}"#, bytes.len()).unwrap();
    bytes.extend(TUBE.iter().flatten().flat_map(|c| c.to_le_bytes()));
    let n = bytes.len();
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scenes": [ {{ "nodes": [ 0, 1 ] }} ],
        "nodes": [ {{ "mesh": 0 }}, {{ "camera": 0, "translation": [ 0, 1, 5 ] }} ],
        "cameras": [ {{ "type": "perspective", "perspective": {{ "yfov": {}, "aspectRatio": 1, "znear": 1 }} }} ],
        "materials": [ {materials} ], "meshes": [ {{ "primitives": [ {meshes} ] }} ],
        "accessors": [ {{ "bufferView": 0, "componentType": 5123, "count": 6, "type": "SCALAR" }} {accessors} ],
        "bufferViews": [ {{ "buffer": 0, "byteLength": {n} }} ],
        "buffers": [ {{ "byteLength": {n}, "uri": "data:application/octet-stream;base64,{}" }} ] }}"#,
        40_f64.to_radians(),
        base64(&bytes)
    )
}

/// Geometry, colours and lights, comparable.
fn essence(scene: &SceneDescription) -> String {
    let mut out = String::new();
    for t in 0..u32::try_from(scene.triangles.len()).unwrap() {
        let kd = scene.diffuse_reflectance(scene.material_of(t), DVec2::splat(0.5));
        writeln!(out, "{:?} {kd} {:?}", scene.corners(t), scene.light_of(t)).unwrap();
    }
    writeln!(out, "{:?}", area(scene, 0)).unwrap();
    writeln!(out, "{:?}", line(scene, 1)).unwrap();
    out
}

fn load(format: Format, text: &str) -> SceneDescription {
    match linelit_formats::from_bytes(format, text.as_bytes(), "room", &LoadOptions::default()) {
        Ok(loaded) => loaded.scene,
        Err(error) => panic!("{error}"),
    }
}

#[cfg(feature = "gltf")]
#[test]
fn four_formats_one_scene() {
    let v3 = load(Format::Pbrt, &pbrt(false));
    let want = essence(&v3);
    assert_eq!(v3.lights.len(), 2);
    assert_eq!(area(&v3, 0).polygon.normal(), -DVec3::Y);

    assert_eq!(essence(&load(Format::Pbrt, &pbrt(true))), want, "pbrt v4");

    let gltf = load(Format::Gltf, &gltf());
    assert_eq!(essence(&gltf), want, "glTF");
    for (x, y) in [(360.0, 360.0), (0.0, 0.0), (720.0, 100.0)] {
        let (a, b) = (v3.camera.ray(x, y), gltf.camera.ray(x, y));
        // The angle goes through radians and a tangent and back: a few ulps.
        assert!((a.direction - b.direction).length() < 1e-14, "{a:?} {b:?}");
        assert!((a.origin - b.origin).length() < 1e-14);
    }

    // OBJ names its library, so it needs files.
    let folder = Folder::new("formats");
    let (text, library) = obj();
    std::fs::create_dir_all(folder.join("a b")).unwrap();
    std::fs::write(folder.join("room.mtl"), &library).unwrap();
    std::fs::write(folder.join("a b/room.mtl"), &library).unwrap();
    // Windows' way to write a path, too.
    for name in [
        "room.mtl",
        ".\\room.mtl",
        "a b\\room.mtl",
        ".\\a b\\..\\room.mtl",
    ] {
        let text = text.replacen("room.mtl", name, 1);
        std::fs::write(folder.join("room.obj"), text).unwrap();
        let loaded = linelit_formats::load(folder.join("room.obj"), &LoadOptions::default());
        let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
        assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
        assert_eq!(essence(&loaded.scene), want, "OBJ, {name}");
    }
    // Which leads out of the scene's folder no more than slashes do.
    std::fs::write(folder.join("a b/room.obj"), "mtllib ..\\room.mtl\n").unwrap();
    let loaded = linelit_formats::load(folder.join("a b/room.obj"), &LoadOptions::default());
    let error = loaded.unwrap_err().to_string();
    assert!(
        error.contains("it lies outside of the scene's folder"),
        "{error}"
    );
}

#[test]
fn framing_cameras_see_everything() {
    let scene = load(
        Format::Obj,
        "v 3 4 5\nv 13 4 5\nv 3 24 5\nv 3 4 35\nf 1 2 3\nf 1 3 4\nf 1 4 2\n",
    );
    let camera = &scene.camera;
    let to_camera = camera.camera_to_world.inverse();
    let linelit_scene::Projection::Perspective { fov_degrees } = camera.projection() else {
        panic!("{camera:?}");
    };
    let edge = (0.5 * fov_degrees).to_radians().tan();
    for t in 0..3 {
        for p in scene.corners(t) {
            let p = to_camera.transform_point3(p);
            assert!(
                p.z > 0.0 && p.x.abs() <= edge * p.z * 16.0 / 9.0 && p.y.abs() <= edge * p.z,
                "{p}"
            );
        }
    }
    // Not mirrored: in a right-handed world the right of the picture is forward × up.
    let (left, right) = (
        camera.ray(0.0, 360.0).direction,
        camera.ray(1280.0, 360.0).direction,
    );
    assert!(left.cross(right).y < 0.0);
}

#[test]
fn compressed_meshes_and_parts_are_unpacked() {
    // A mesh and an included part, made with `gzip -9`.
    let scene = linelit_formats::load("tests/seeds/gzip.pbrt", &LoadOptions::default())
        .unwrap()
        .scene;
    assert_eq!(scene.triangles.len(), 2);
    assert_eq!(scene.corners(0)[1], DVec3::new(1.5, 0.0, 0.0));
    assert_eq!(scene.corners(1)[1], DVec3::X);
}

#[test]
#[allow(clippy::too_many_lines, reason = "one case after the other")]
fn polygons_and_byte_orders_of_ply() {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 5\nproperty double x\nproperty float y\nproperty short z\n\
             property float u\nproperty float v\nelement face 1\nproperty list ushort uchar vertex_index\nend_header\n"
        )
    };
    let points = [
        (0.0_f64, 0.0_f32),
        (2.0, 0.0),
        (2.0, 2.0),
        (1.0, 0.5),
        (0.0, 2.0),
    ];
    let mut ascii = header("ascii");
    let (mut little, mut big) = (
        header("binary_little_endian").into_bytes(),
        header("binary_big_endian").into_bytes(),
    );
    for (x, y) in points {
        writeln!(ascii, "{x} {y} 7 {x} {y}").unwrap();
        let u = DVec3::splat(x).as_vec3().x;
        little.extend(
            [
                &x.to_le_bytes()[..],
                &y.to_le_bytes(),
                &7_i16.to_le_bytes(),
                &u.to_le_bytes(),
                &y.to_le_bytes(),
            ]
            .concat(),
        );
        big.extend(
            [
                &x.to_be_bytes()[..],
                &y.to_be_bytes(),
                &7_i16.to_be_bytes(),
                &u.to_be_bytes(),
                &y.to_be_bytes(),
            ]
            .concat(),
        );
    }
    ascii += "5 0 1 2 3 4\n";
    little.extend([5, 0, 0, 1, 2, 3, 4]);
    big.extend([0, 5, 0, 1, 2, 3, 4]);
    for bytes in [ascii.as_bytes(), &little, &big] {
        let loaded =
            linelit_formats::from_bytes(Format::Ply, bytes, "ply", &LoadOptions::default());
        let scene = loaded.unwrap_or_else(|e| panic!("{e}")).scene;
        // The notch at (1, 0.5) must not be filled.
        let areas = (0..3).map(|t| {
            let [a, b, c] = scene.corners(t);
            0.5 * (b - a).cross(c - a).z
        });
        let total: f64 = areas.inspect(|a| assert!(*a > 0.0)).sum();
        assert!((total - 2.5).abs() < 1e-12, "{total}");
        assert!(scene.triangles.iter().all(|t| {
            t.iter()
                .all(|i| scene.positions[*i as usize][2].to_bits() == 7.0_f32.to_bits())
        }));
        assert_eq!(
            scene.uvs[2].map(f32::to_bits),
            [2.0_f32, 2.0].map(f32::to_bits)
        );
    }
}

#[test]
fn what_is_left_out_of_a_ply_file_is_named() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty uchar red\nproperty list uchar float weights\nelement face 1\n\
        property uchar flags\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
        element thing 1\nproperty int k\nend_header\n\
        0 0 0 9 2 1 1\n1 0 0 9 0\n0 1 0 9 0\n7 3 0 1 2 6 0 0 1 0 0 1\n5\n";
    let read = |text: &str| {
        let options = LoadOptions::default();
        linelit_formats::from_bytes(Format::Ply, text.as_bytes(), "ply", &options).unwrap()
    };
    let loaded = read(text);
    assert_eq!(loaded.scene.triangles.len(), 1);
    let warnings = loaded.warnings.iter().map(|w| w.message());
    let warnings: Vec<&str> = warnings.filter(|w| w.contains("left out")).collect();
    assert_eq!(
        warnings,
        [
            "vertex properties are left out: `red`, `weights`",
            "face properties are left out: `flags`, `texcoord`",
            "elements are left out: `thing`",
        ]
    );
    // Where there are no faces, nothing of them is left out.
    let without = text
        .replace("face 1", "face 0")
        .replace("\n7 3 0 1 2 6 0 0 1 0 0 1", "");
    let loaded = read(&without);
    assert!(
        !loaded
            .warnings
            .iter()
            .any(|w| w.message().contains("face properties"))
    );
}

/// Of a plate with more than five hundred teeth.
#[test]
fn faces_of_too_many_corners_are_refused() {
    let read = |format, text: &str| {
        linelit_formats::from_bytes(format, text.as_bytes(), "plate", &LoadOptions::default())
    };
    let tooth = |k: u32| format!("{k} {} 0", k % 2);
    let ends = ["1099 -1 0".to_owned(), "0 -1 0".to_owned()];
    let corners: Vec<String> = (0..1100).map(tooth).chain(ends).collect();
    let n = corners.len();
    let numbers = |from: usize| {
        let numbers: Vec<String> = (from..from + n).rev().map(|k| k.to_string()).collect();
        numbers.join(" ")
    };
    let it = format!("has {n} corners and is not convex; at most 1024 are cut into triangles");
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {n}\nproperty float x\nproperty float y\n\
         property float z\nelement face 1\nproperty list int int vertex_indices\nend_header\n\
         {}\n{n} {}\n",
        corners.join("\n"),
        numbers(0)
    );
    let error = read(Format::Ply, &ply).unwrap_err();
    assert_eq!(error.message(), format!("face 0 {it}"));
    let obj = format!("v {}\nf {}\nf 1 3 2\n", corners.join("\nv "), numbers(1));
    let loaded = read(Format::Obj, &obj).unwrap();
    assert_eq!(loaded.scene.triangles.len(), 1);
    let mut warnings = loaded.warnings.iter().map(|w| w.message());
    assert!(warnings.any(|w| w == format!("a face {it}")));
}
