//! Tests of scenes at map coordinates, whose vertices are rounded relative to the scene's centre.

use crate::common::base64;
use linelit_formats::{Format, LoadOptions, Loaded};
use linelit_geometry::DVec3;
use std::fmt::Write as _;

const PLACES: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [1e3, -1e3, 1e3],
    [540_000.0, 0.0, 0.0],
    [500_000.0, 5_400_000.0, 300.0],
    [1e7, -1e7, 1e7],
];

/// Two triangles, and the vertices that they use.
const CORNERS: [[f64; 3]; 4] = [
    [0.1, 0.2, 0.3],
    [1.3, 0.0, 0.7],
    [0.9, 1.1, 0.1],
    [-0.3, 0.8, 0.0],
];
const TRIANGLES: [[usize; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn numbers(vertices: &[DVec3]) -> String {
    let each = vertices.iter().map(|v| format!("{} {} {}", v.x, v.y, v.z));
    each.collect::<Vec<_>>().join("\n")
}

fn read(format: Format, text: &str) -> Loaded {
    let loaded =
        linelit_formats::from_bytes(format, text.as_bytes(), "far", &LoadOptions::default());
    loaded.unwrap_or_else(|e| panic!("{e}"))
}

fn pbrt(before: &str, vertices: &[DVec3]) -> Loaded {
    let points = numbers(vertices);
    read(
        Format::Pbrt,
        &format!(
            "Camera \"perspective\"\nWorldBegin\nLightSource \"point\"\n{before}\n\
             Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ {points} ]"
        ),
    )
}

fn ply(vertices: &[DVec3]) -> Loaded {
    let (count, points) = (vertices.len(), numbers(vertices));
    read(
        Format::Ply,
        &format!(
            "ply\nformat ascii 1.0\nelement vertex {count}\nproperty double x\n\
             property double y\nproperty double z\nelement face 2\n\
             property list uchar int vertex_indices\nend_header\n{points}\n3 0 1 2\n3 0 2 3\n"
        ),
    )
}

fn obj(vertices: &[DVec3]) -> Loaded {
    let mut text = String::new();
    for v in vertices {
        writeln!(text, "v {} {} {}", v.x, v.y, v.z).unwrap();
    }
    read(Format::Obj, &(text + "f 1 2 3\nf 1 3 4\n"))
}

#[cfg(feature = "gltf")]
fn gltf(at: DVec3) -> Loaded {
    let singles = CORNERS.map(|v| DVec3::from(v).as_vec3().to_array());
    let mut bytes: Vec<u8> = singles
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    bytes.extend([0, 1, 2, 0, 2, 3]);
    let (n, buffer) = (bytes.len(), base64(&bytes));
    read(
        Format::Gltf,
        &format!(
            r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [ {{ "nodes": [ 0 ] }} ],
            "nodes": [ {{ "mesh": 0, "translation": [ {}, {}, {} ] }} ],
            "meshes": [ {{ "primitives": [ {{ "attributes": {{ "POSITION": 0 }}, "indices": 1 }} ] }} ],
            "accessors": [
                {{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" }},
                {{ "bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR" }} ],
            "bufferViews": [ {{ "buffer": 0, "byteLength": 48 }},
                {{ "buffer": 0, "byteOffset": 48, "byteLength": 6 }} ],
            "buffers": [ {{ "byteLength": {n}, "uri": "data:;base64,{buffer}" }} ] }}"#,
            at.x, at.y, at.z
        ),
    )
}

/// The corners of the triangles are where the file puts them, up to three roundings:
/// - half an ulp of their distance from the middle of the scene, which is less than one on each
///   axis; or, for a scene near zero, of their distance from zero, which is less than two;
/// - for glTF, the rounding of the single-precision numbers of the file;
/// - the rounding of the sums in transforms.
#[test]
fn all_formats_round_relative_to_the_middle() {
    for place in PLACES.map(DVec3::from) {
        let here = CORNERS.map(|v| DVec3::from(v) + place);
        // Add a vertex on the other side of the origin that no triangle uses. It must not move
        // the middle of the scene.
        let stray: Vec<_> = here.into_iter().chain([-place]).collect();
        let mut all = vec![
            ("pbrt", pbrt("", &here)),
            ("pbrt, moved", {
                let DVec3 { x, y, z } = place;
                pbrt(&format!("Translate {x} {y} {z}"), &CORNERS.map(DVec3::from))
            }),
            ("pbrt, stray", pbrt("", &stray)),
            ("ply", ply(&here)),
            ("ply, stray", ply(&stray)),
            ("obj", obj(&here)),
            ("obj, stray", obj(&stray)),
        ];
        #[cfg(feature = "gltf")]
        all.push(("gltf", gltf(place)));
        let bound = 3f64.sqrt() * 2f64.powi(-23) + 8.0 * f64::EPSILON * place.abs().max_element();
        for (
            format,
            Loaded {
                scene, warnings, ..
            },
        ) in all
        {
            assert_eq!(scene.better_origin(), None);
            let coarse = warnings
                .iter()
                .any(|w| w.message().contains("single precision"));
            assert!(!coarse, "{format} at {place}");
            for (t, corners) in (0..).zip(TRIANGLES) {
                for (got, k) in scene.corners(t).into_iter().zip(corners) {
                    let error = got.distance(here[k]);
                    assert!(error <= bound, "{format} at {place}: {got} for {}", here[k]);
                }
            }
        }
    }
}

/// A scene that has details and parts far away from them is read, with one warning that single
/// precision is too coarse for its details.
#[test]
fn what_is_too_large_for_its_details_is_warned_about_once() {
    let far = [[4e7, 0.0, 0.1], [4e7, 0.7, 0.0], [4e7, 0.0, 0.8]];
    let near = CORNERS.map(DVec3::from);
    let all: Vec<_> = near.into_iter().chain(far.map(DVec3::from)).collect();
    let points = numbers(&all);
    let text = format!(
        "Camera \"perspective\"\nWorldBegin\nLightSource \"point\"\nShape \"trianglemesh\"\n\
         \"integer indices\" [ 0 1 2 0 2 3 4 5 6 ] \"point3 P\" [ {points} ]"
    );
    let loaded = read(Format::Pbrt, &text);
    let count = |loaded: &Loaded| {
        let texts = loaded.warnings.iter();
        texts
            .filter(|w| w.message().contains("single precision"))
            .count()
    };
    // 40,000,000 is exact in `f32`, and 40,000,000.9 is not.
    assert_eq!(count(&loaded), 0);
    let loaded = read(Format::Pbrt, &text.replace("40000000 ", "40000000.9 "));
    assert_eq!(count(&loaded), 1);
    let strict = LoadOptions {
        strict: true,
        ..LoadOptions::default()
    };
    let text = text.replace("40000000 ", "40000000.9 ");
    assert!(linelit_formats::from_pbrt_str(&text, "far", &strict).is_err());
}
