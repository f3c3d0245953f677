//! Tests of those features of glTF that are rare in scenes but common in collections of test files.

use crate::common::{assert_near, base64};
use linelit_formats::{Format, LoadOptions, Loaded, SceneError};
use linelit_geometry::{DVec2, DVec3};
use linelit_scene::{MaterialKind, Projection, SceneDescription, Texture};

/// Returns a glTF document around a buffer. Buffer view 0 is the whole buffer, and view 1 is the
/// same with a stride of 16 bytes; `rest` is added at the top level.
fn document(buffer: &[u8], rest: &str) -> String {
    let n = buffer.len();
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scenes": [ {{ "nodes": [ 0 ] }} ],
        "bufferViews": [ {{ "buffer": 0, "byteLength": {n} }}, {{ "buffer": 0, "byteLength": {n}, "byteStride": 16 }} ],
        "buffers": [ {{ "byteLength": {n}, "uri": "data:;base64,{}" }} ],
        {rest} }}"#,
        base64(buffer)
    )
}

fn floats(list: &[f32]) -> Vec<u8> {
    list.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn attempt(text: &str) -> Result<Loaded, SceneError> {
    linelit_formats::from_bytes(
        Format::Gltf,
        text.as_bytes(),
        "test.gltf",
        &LoadOptions::default(),
    )
}

fn load(text: &str) -> Loaded {
    attempt(text).unwrap_or_else(|e| panic!("{e}"))
}

fn has_warning(loaded: &Loaded, part: &str) -> bool {
    loaded.warnings.iter().any(|w| w.message().contains(part))
}

/// The corners (0,0), (1,0), (1,1), (0,1) of a square at z = 0.
const SQUARE: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];

const POSITIONS: &str = r#"{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" }"#;

#[test]
fn strips_fans_and_points() {
    for (mode, want) in [(4, Some(1)), (5, Some(2)), (6, Some(2)), (0, None)] {
        let text = document(
            &floats(&SQUARE),
            &format!(
                r#""nodes": [ {{ "mesh": 0 }} ], "accessors": [ {POSITIONS} ],
                "meshes": [ {{ "primitives": [ {{ "attributes": {{ "POSITION": 0 }}, "mode": {mode} }} ] }} ]"#
            ),
        );
        let loaded = load(&text);
        assert_eq!(
            loaded.scene.triangles.len(),
            want.unwrap_or(0),
            "mode {mode}"
        );
        assert_eq!(
            has_warning(&loaded, "points are not supported"),
            want.is_none()
        );
        // The list and the fan face upwards. As a strip, these corners cross over, and its second
        // triangle faces downwards.
        for t in 0..u32::try_from(loaded.scene.triangles.len()).unwrap() {
            let [a, b, c] = loaded.scene.corners(t);
            let up = (b - a).cross(c - a).z;
            assert!(mode == 5 || up > 0.0, "mode {mode}");
        }
    }
}

#[test]
fn sparse_accessors_replace_zeros_or_values() {
    // The sparse accessor replaces corner 2 by (5, 6, 7): of a stored square first, and below of
    // zeros, which represent an accessor without a buffer view.
    let mut buffer = floats(&SQUARE);
    buffer.extend([2, 0, 0, 0]);
    buffer.extend(floats(&[5.0, 6.0, 7.0]));
    let sparse = r#""sparse": { "count": 1,
        "indices": { "bufferView": 2, "componentType": 5121 }, "values": { "bufferView": 3 } }"#;
    let text = |accessor: &str| {
        document(
            &buffer,
            &format!(
                r#""nodes": [ {{ "mesh": 0 }} ], "accessors": [ {accessor} ],
                "meshes": [ {{ "primitives": [ {{ "attributes": {{ "POSITION": 0 }}, "mode": 6 }} ] }} ]"#
            ),
        )
        .replace(
            r#""byteStride": 16 }"#,
            r#""byteStride": 16 }, { "buffer": 0, "byteOffset": 48, "byteLength": 1 },
            { "buffer": 0, "byteOffset": 52, "byteLength": 12 }"#,
        )
    };
    let moved = DVec3::new(5.0, 6.0, 7.0);
    let dense = format!("{}, {sparse} }}", POSITIONS.trim_end_matches(" }"));
    let scene = load(&text(&dense)).scene;
    assert_eq!(scene.corners(0), [DVec3::ZERO, DVec3::X, moved]);
    let zeros = format!(r#"{{ "componentType": 5126, "count": 4, "type": "VEC3", {sparse} }}"#);
    // With three corners at the origin, no triangle has an area.
    let loaded = load(&text(&zeros));
    assert!(loaded.scene.triangles.is_empty() && has_warning(&loaded, "without area"));
    let none = zeros.replace(sparse, "\"name\": \"nothing\"");
    assert!(has_warning(&load(&text(&none)), "its numbers are zeros"));
    // An accessor of a billion zeros is refused.
    let error = attempt(&text(
        &zeros.replace("\"count\": 4", "\"count\": 1000000000"),
    ));
    assert!(error.unwrap_err().message().contains("1000000000 zeros"));
    let error = attempt(&text(
        &dense.replace("\"componentType\": 5121", "\"componentType\": 5126"),
    ));
    assert!(error.is_err(), "a float is no index");
}

#[test]
fn interleaved_and_quantised_vertices() {
    // Write positions and normals as normalised bytes, with a stride of sixteen bytes.
    let mut buffer = Vec::new();
    for [x, y] in [[0, 0], [127, 0], [127, 127], [0, 127]] {
        buffer.extend([x, y, 0, 0, 0, 0, 127, 0, 9, 9, 9, 9, 9, 9, 9, 9]);
    }
    let text = document(
        &buffer,
        r#""extensionsUsed": [ "KHR_mesh_quantization" ], "extensionsRequired": [ "KHR_mesh_quantization" ],
        "nodes": [ { "mesh": 0, "scale": [ 2, 2, 2 ] } ], "accessors": [
        { "bufferView": 1, "componentType": 5120, "normalized": true, "count": 4, "type": "VEC3" },
        { "bufferView": 1, "byteOffset": 4, "componentType": 5120, "normalized": true, "count": 4, "type": "VEC3" } ],
        "meshes": [ { "primitives": [ { "attributes": { "POSITION": 0, "NORMAL": 1 }, "mode": 6 } ] } ]"#,
    );
    let loaded = load(&text);
    assert_eq!(loaded.warnings.len(), 1, "only that there is no light");
    let scene = loaded.scene;
    assert_eq!(scene.corners(0)[2], DVec3::new(2.0, 2.0, 0.0));
    assert_eq!(
        scene.surface(0, [0.2, 0.2], -DVec3::Z).shading_normal,
        DVec3::Z
    );
}

/// Normalised integers are converted as in glTF 2.0, section 3.11: f = max(c/127, −1),
/// max(c/32767, −1), c/255 and c/65535, for every attribute and for the values of sparse accessors.
#[test]
fn normalised_integers_are_the_fractions_of_the_specification() {
    let short = |c: i16| c.to_le_bytes();
    let mut buffer: Vec<u8> = Vec::new();
    // Write positions as i16, normals as i8 and texture coordinates as i8 and as u16, with a stride
    // of sixteen bytes.
    for [x, y] in [[-32768, -32767], [32767, 0], [16384, 32767], [1, -1]] {
        buffer.extend([short(x), short(y), short(0)].concat());
        buffer.extend([0x80, 0x81, 0x7f, 0, 0x80, 0x40]);
        buffer.extend([short(-1), short(0)].concat());
    }
    // Append the value of the sparse accessor.
    buffer.extend([short(-32768), short(32767), short(-32768)].concat());
    let accessor = |offset: usize, kind: u16, width: &str| {
        format!(
            r#"{{ "bufferView": 1, "byteOffset": {offset}, "componentType": {kind}, "normalized": true,
            "count": 4, "type": "{width}" }}"#
        )
    };
    let sparse = r#""sparse": { "count": 1, "indices": { "bufferView": 2, "componentType": 5121 },
        "values": { "bufferView": 3 } } }"#;
    let positions = accessor(0, 5122, "VEC3");
    let positions = format!("{}, {sparse}", positions.trim_end_matches(" }"));
    let text = |uv: usize| {
        let accessors = [
            positions.clone(),
            accessor(6, 5120, "VEC3"),
            accessor(10, 5120, "VEC2"),
            accessor(12, 5123, "VEC2"),
        ]
        .join(", ");
        let rest = format!(
            r#""nodes": [ {{ "mesh": 0 }} ], "accessors": [ {accessors} ], "meshes": [ {{ "primitives": [ {{
            "attributes": {{ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": {uv} }}, "mode": 6 }} ] }} ]"#
        );
        document(&buffer, &rest).replace(
            r#""byteStride": 16 }"#,
            r#""byteStride": 16 }, { "buffer": 0, "byteOffset": 2, "byteLength": 1 },
            { "buffer": 0, "byteOffset": 64, "byteLength": 6 }"#,
        )
    };
    // The sparse accessor takes its index from byte 2 of the buffer, the 0x01 of −32767, so that it
    // replaces the second corner.
    let scene = load(&text(2)).scene;
    #[allow(clippy::cast_possible_truncation, reason = "positions are f32")]
    let half = (16384.0 / 32767.0) as f32;
    let bits = |values: [f32; 3]| values.map(f32::to_bits);
    for (k, want) in [[-1.0, -1.0, 0.0], [-1.0, 1.0, -1.0], [half, 1.0, 0.0]]
        .into_iter()
        .enumerate()
    {
        assert_eq!(bits(scene.positions[k]), bits(want), "{k}");
    }
    // The normal is (−1, −1, 1), normalised.
    let [x, y, z] = scene.normals[0];
    assert!((f64::from(z) - 3f64.sqrt().recip()).abs() <= f64::from(f32::EPSILON));
    assert_eq!(bits([x, y, z]), bits([-z, -z, z]));
    // glTF counts v from the top and linelit from the bottom, hence 1 − 64/127.
    #[allow(clippy::cast_possible_truncation, reason = "coordinates are f32")]
    let v = (1.0 - 64.0 / 127.0) as f32;
    let uv = |scene: &SceneDescription| scene.uvs[0].map(f32::to_bits);
    assert_eq!(uv(&scene), [-1.0, v].map(f32::to_bits));
    assert_eq!(uv(&load(&text(3)).scene), [1.0_f32, 1.0].map(f32::to_bits));
}

#[test]
fn mirrored_nodes_keep_their_outside() {
    let text = |scale: &str| {
        document(
            &floats(&SQUARE),
            &format!(
                r#""nodes": [ {{ "mesh": 0, "scale": {scale} }} ], "accessors": [ {POSITIONS} ],
                "materials": [ {{ "emissiveFactor": [ 1, 1, 1 ] }} ],
                "meshes": [ {{ "primitives": [ {{ "attributes": {{ "POSITION": 0 }}, "mode": 6, "material": 0 }} ] }} ]"#
            ),
        )
    };
    for scale in ["[ 1, 1, 1 ]", "[ -1, 1, 1 ]", "[ -1, -1, 1 ]"] {
        let scene = load(&text(scale)).scene;
        assert_eq!(scene.lights.len(), 1);
        // In glTF a negative determinant reverses the winding order, so that the same side stays
        // the front.
        let seen = scene.surface(0, [0.3, 0.3], -DVec3::Z);
        assert!(seen.outside, "{scale}");
    }
    let loaded = load(&text("[ 1, 0, 1 ]"));
    assert!(has_warning(&loaded, "flattened by its transform"));
}

#[test]
fn what_is_compressed_or_unknown_is_named() {
    let draco = document(
        &floats(&SQUARE),
        r#""extensionsUsed": [ "KHR_draco_mesh_compression" ], "extensionsRequired": [ "KHR_draco_mesh_compression" ],
        "nodes": [ { "mesh": 0 } ], "accessors": [ { "componentType": 5126, "count": 4, "type": "VEC3" } ],
        "meshes": [ { "primitives": [ { "attributes": { "POSITION": 0 },
          "extensions": { "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": { "POSITION": 0 } } } } ] } ]"#,
    );
    // The compression is an error if it is required, and also if it is only used by a mesh that has
    // no uncompressed vertices.
    let unrequired = draco.replace("extensionsRequired", "extensionsWanted");
    for (text, what) in [
        (draco, "is not supported"),
        (unrequired, "are not supported"),
    ] {
        let error = attempt(&text).unwrap_err().to_string();
        let named = format!("`KHR_draco_mesh_compression` {what}");
        assert!(error.contains(&named), "{error}");
        assert!(
            error.contains("export the scene without mesh compression"),
            "{error}"
        );
    }

    let odd = document(
        &floats(&SQUARE),
        &format!(
            r#""extensionsUsed": [ "KHR_materials_unlit", "EXT_other" ],
            "nodes": [ {{ "mesh": 0 }} ], "accessors": [ {POSITIONS} ], "scenes": [ {{ "nodes": [ 0 ] }}, {{ "nodes": [] }} ],
            "materials": [ {{ "alphaMode": "BLEND", "extensions": {{ "KHR_materials_unlit": {{}} }} }} ],
            "meshes": [ {{ "primitives": [ {{ "attributes": {{ "POSITION": 0, "COLOR_0": 0 }}, "mode": 6, "material": 0,
              "targets": [ {{ "POSITION": 0 }} ] }} ] }} ], "skins": [ {{ "joints": [ 0 ] }} ], "animations": [ {{}} ]"#
        ),
    );
    let odd = odd.replacen(r#""scenes": [ { "nodes": [ 0 ] } ],"#, "", 1);
    let loaded = load(&odd);
    for part in [
        "`KHR_materials_unlit` is not supported",
        "extension `EXT_other`",
        "blending is not supported",
        "vertex colours",
        "morph targets",
        "`skins`",
        "`animations`",
        "several scenes",
    ] {
        assert!(has_warning(&loaded, part), "{part}: {:#?}", loaded.warnings);
    }
}

/// An extension that a file requires and the reader does not support is an error (glTF 2.0,
/// section 3.12).
#[test]
fn files_that_require_what_is_not_read_are_refused_by_its_name() {
    let text = |rest: &str| {
        let rest = format!(
            r#"{rest} "nodes": [ {{ "mesh": 0 }} ], "accessors": [ {POSITIONS} ],
            "meshes": [ {{ "primitives": [ {{ "attributes": {{ "POSITION": 0 }}, "mode": 6 }} ] }} ]"#
        );
        document(&floats(&SQUARE), &rest)
    };
    let read = [
        "EXT_mesh_gpu_instancing",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_specular",
        "KHR_mesh_quantization",
        "KHR_texture_transform",
    ];
    let all = format!(r#""extensionsRequired": {read:?},"#);
    assert_eq!(load(&text(&all)).scene.triangles.len(), 2);
    for unknown in [
        "VENDOR_made_up",
        "KHR_texture_basisu",
        "KHR_materials_clearcoat",
    ] {
        let required =
            format!(r#""extensionsRequired": [ "KHR_texture_transform", "{unknown}" ],"#);
        let error = attempt(&text(&required)).unwrap_err();
        let message = format!("the extension `{unknown}` is not supported");
        assert_eq!(error.message(), message);
        // If it is used but not required, it is ignored.
        assert!(attempt(&text(&required.replace("Required", "Used"))).is_ok());
    }
    // A buffer without data that only an extension can fill is an error even if the file does not
    // require the extension.
    let empty = r#""extensions": { "EXT_meshopt_compression": { "fallback": true } }"#;
    let whole = text("");
    let start = whole.find(r#""uri""#).unwrap();
    let end = start + whole[start..].find(" }").unwrap();
    let error = attempt(&format!("{}{empty}{}", &whole[..start], &whole[end..]));
    let error = error.unwrap_err().to_string();
    assert!(
        error.contains("`EXT_meshopt_compression` is not supported"),
        "{error}"
    );
}

#[test]
fn instanced_nodes_are_many() {
    // Write the translations, the rotations, by a right angle about z, and the scales of two
    // instances.
    let half = 0.5_f32.sqrt();
    let mut numbers = SQUARE.to_vec();
    numbers.extend([5.0, 0.0, 0.0, 0.0, 0.0, 7.0]);
    numbers.extend([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half]);
    numbers.extend([2.0, 2.0, 2.0, 1.0, 3.0, 1.0]);
    let list = |start: usize, count: usize, kind: &str| {
        format!(
            r#"{{ "bufferView": 0, "byteOffset": {}, "componentType": 5126, "count": {count}, "type": "{kind}" }}"#,
            4 * start
        )
    };
    let text = |scales: &str| {
        document(
            &floats(&numbers),
            &format!(
                r#""nodes": [ {{ "mesh": 0, "extensions": {{ "EXT_mesh_gpu_instancing": {{ "attributes":
                {{ "TRANSLATION": 1, "ROTATION": 2, "SCALE": 3 }} }} }} }} ],
                "accessors": [ {POSITIONS}, {}, {}, {scales} ], "extensionsUsed": [ "EXT_mesh_gpu_instancing" ],
                "meshes": [ {{ "primitives": [ {{ "attributes": {{ "POSITION": 0 }}, "mode": 6 }} ] }} ]"#,
                list(12, 2, "VEC3"),
                list(18, 2, "VEC4"),
            ),
        )
    };
    let scene = load(&text(&list(26, 2, "VEC3"))).scene;
    let corner = |triangle| scene.corners(triangle)[1];
    assert_near(corner(0), DVec3::new(7.0, 0.0, 0.0));
    // The corner is scaled by three along y, then rotated, then moved upwards.
    assert_near(scene.corners(3)[2], DVec3::new(-3.0, 0.0, 7.0));
    let error = attempt(&text(&list(26, 1, "VEC3")))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("`SCALE` has another number of entries"),
        "{error}"
    );
    let error = attempt(&text(&list(26, 1, "VEC2")))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("`SCALE` has 2 numbers per instance, expected 3"),
        "{error}"
    );
}

/// A PNG image of 2 × 2 pixels in base64: (50, 100, 150), (200, 40, 80) in the upper row and
/// (10, 20, 30), (0, 255, 0) in the lower one.
const PIXELS: &str = "iVBORw0KGgoAAAANSUhEUgAAAAIAAAACCAIAAAD91JpzAAAAFklEQVR42mMwSpl2QiOAgUtEjuE/AwAciAOorEZXEQAAAABJRU5ErkJggg==";

fn textured(material: &str, sampler: &str) -> Loaded {
    let mut buffer = floats(&SQUARE);
    // Add two sets of texture coordinates: those of the square, and the same flipped and doubled.
    buffer.extend(floats(&[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]));
    buffer.extend(floats(&[0.0, 2.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0]));
    load(&document(
        &buffer,
        &format!(
            r#""nodes": [ {{ "mesh": 0 }} ], "accessors": [ {POSITIONS},
            {{ "bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC2" }},
            {{ "bufferView": 0, "byteOffset": 80, "componentType": 5126, "count": 4, "type": "VEC2" }} ],
            "images": [ {{ "uri": "data:image/png;base64,{PIXELS}" }} ], "samplers": [ {sampler} ],
            "textures": [ {{ "source": 0, "sampler": 0 }} ], "materials": [ {material} ],
            "meshes": [ {{ "primitives": [ {{ "mode": 6, "material": 0,
              "attributes": {{ "POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 2 }} }} ] }} ]"#
        ),
    ))
}

#[test]
fn metallic_roughness_textures_are_channels() {
    let loaded = textured(
        r#"{ "pbrMetallicRoughness": { "metallicRoughnessTexture": { "index": 0 }, "roughnessFactor": 0.5 } }"#,
        "{}",
    );
    let MaterialKind::Mix { materials, amount } = &loaded.scene.materials.last().unwrap().kind
    else {
        panic!("{:?}", loaded.scene.materials);
    };
    // The centre of the upper left pixel.
    let uv = DVec2::new(0.25, 0.75);
    assert!((amount.evaluate_number(uv) - 150.0 / 255.0).abs() < 1e-12);
    for part in materials {
        let (MaterialKind::Substrate { roughness, .. }
        | MaterialKind::ColoredConductor { roughness, .. }) =
            &loaded.scene.materials[*part as usize].kind
        else {
            panic!("{:?}", loaded.scene.materials);
        };
        let kind = &loaded.scene.materials[*part as usize].kind;
        let of_gltf = matches!(kind, MaterialKind::ColoredConductor { schlick: true, .. });
        assert!(of_gltf || matches!(kind, MaterialKind::Substrate { .. }));
        let alpha = (0.5_f64 * 100.0 / 255.0).powi(2);
        assert!((roughness.alpha(uv)[0] - alpha).abs() < 1e-12);
    }
}

fn base_colour(loaded: &Loaded) -> &Texture {
    match &loaded.scene.materials.last().unwrap().kind {
        MaterialKind::Substrate { kd, .. } | MaterialKind::Matte { kd, .. } => kd,
        other => panic!("{other:?}"),
    }
}

#[test]
fn textures_wrap_turn_and_choose_their_coordinates() {
    let material = |info: &str| {
        format!(
            r#"{{ "pbrMetallicRoughness": {{ "metallicFactor": 0, "baseColorTexture": {info} }} }}"#
        )
    };
    // The sRGB curve, with its linear part near zero.
    let linear = |byte: f64| match byte / 255.0 {
        v if v <= 0.04045 => v / 12.92,
        v => ((v + 0.055) / 1.055).powf(2.4),
    };
    let red = |loaded: &Loaded, u: f64, v: f64| base_colour(loaded).evaluate(DVec2::new(u, v)).x;
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");

    // The red channel of the upper row is 50 and 200. Check repeated, mirrored and clamped edges.
    let plain = textured(&material(r#"{ "index": 0 }"#), "{}");
    near(red(&plain, 0.25, 0.75), linear(50.0));
    near(red(&plain, 1.25, 0.75), linear(50.0));
    let odd = r#"{ "wrapS": 33648, "wrapT": 33071 }"#;
    let mirrored = textured(&material(r#"{ "index": 0 }"#), odd);
    near(red(&mirrored, 1.25, 0.75), linear(200.0));
    near(red(&mirrored, 0.25, 7.0), linear(50.0));

    // Check a rotation by a right angle. The extension turns (u, v), with v from the top, into
    // (v, −u) + offset, so that the upper left of the surface shows the image at (0.25, 0.75),
    // which is in the lower left pixel.
    let turned = material(
        r#"{ "index": 0, "extensions": { "KHR_texture_transform": { "rotation": 1.5707963267948966, "offset": [ 0, 1 ] } } }"#,
    );
    let turned = textured(&turned, "{}");
    near(red(&turned, 0.25, 0.75), linear(10.0));

    // Check the second set of texture coordinates.
    let second = textured(&material(r#"{ "index": 0, "texCoord": 1 }"#), "{}");
    let uv = second.scene.surface(0, [0.0, 0.0], DVec3::Z).uv;
    assert_eq!(
        uv,
        DVec2::new(0.0, -1.0),
        "the second set at the first corner, from below"
    );
}

#[test]
fn emission_textures_lie_over_one_light() {
    let loaded = textured(
        r#"{ "emissiveFactor": [ 1, 1, 1 ], "emissiveTexture": { "index": 0 },
           "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 3 } } }"#,
        r#"{ "wrapS": 33071, "wrapT": 33071 }"#,
    );
    let scene = &loaded.scene;
    assert_eq!(
        scene.lights.len(),
        1,
        "the texture goes on over the diagonal"
    );
    let light = &scene.lights[0];
    let linelit_lights::Light::Area(area) = &*light.light else {
        panic!("{light:?}");
    };
    let map = light.map.as_ref().unwrap();
    assert_eq!(map.radiance, DVec3::splat(3.0));
    // The camera sees the texture on the front, and a dark back.
    let uv = DVec2::new(0.25, 0.75);
    let front = area.polygon.normal();
    assert_eq!(light.shown(uv, front), map.evaluate(uv));
    assert_eq!(light.shown(uv, -front), DVec3::ZERO);
    // The texture coordinates of the light's map agree with those of its triangles.
    for t in light.triangles.clone() {
        for [b1, b2] in [[0.0, 0.0], [1.0, 0.0], [0.3, 0.5]] {
            let corners = scene.triangles[t as usize].map(|i| {
                let [x, y, z] = scene.positions[i as usize].map(f64::from);
                DVec3::new(x, y, z)
            });
            let point = corners[0] * (1.0 - b1 - b2) + corners[1] * b1 + corners[2] * b2;
            let uv = scene.surface(t, [b1, b2], DVec3::NEG_Z).uv;
            // They differ by a few roundings of numbers of order one.
            assert!((map.coordinates.at(point) - uv).length() < 1e-14);
        }
    }
    // With clamped edges the mean over the square is the mean of the four pixels. The light's
    // radiance is only near it, because two parts along each edge are few for a bilinear ramp that
    // is half as wide as the image.
    let linear = |byte: f64| ((byte / 255.0 + 0.055) / 1.055).powf(2.4);
    let green = [100.0, 40.0, 20.0, 255.0].map(linear).iter().sum::<f64>() / 4.0;
    let mean = area.emission.radiance.y / 3.0;
    assert!((mean - green).abs() < 0.05, "{mean} {green}");
}

#[test]
fn orthographic_cameras_see_their_magnification() {
    let text = document(
        &floats(&SQUARE),
        &format!(
            r#""nodes": [ {{ "mesh": 0, "camera": 0, "translation": [ 0, 0, 3 ] }} ], "accessors": [ {POSITIONS} ],
            "cameras": [ {{ "type": "orthographic", "orthographic": {{ "xmag": 2, "ymag": 1, "znear": 0, "zfar": 9 }} }} ],
            "meshes": [ {{ "primitives": [ {{ "attributes": {{ "POSITION": 0 }}, "mode": 6 }} ] }} ]"#
        ),
    );
    let scene = load(&text).scene;
    assert_eq!(scene.camera.projection(), Projection::Orthographic);
    let [width, height] = scene.camera.resolution();
    assert_eq!(width, 2 * height);
    let corner = scene.camera.ray(f64::from(width), 0.0);
    assert!(
        (corner.origin - DVec3::new(2.0, 1.0, 3.0)).length() < 1e-12,
        "{corner:?}"
    );
    assert_eq!(corner.direction, -DVec3::Z);
}

#[test]
fn overlapping_accessors_cannot_ask_for_everything() {
    // Many accessors of one small buffer are read until their numbers exceed the limit.
    let buffer = vec![0_u8; 3 << 16];
    let accessor = r#"{ "bufferView": 0, "componentType": 5121, "count": 65536, "type": "VEC3" }"#;
    let many = vec![accessor; 200].join(",");
    let primitives: Vec<String> = (0..200)
        .map(|k| format!(r#"{{ "attributes": {{ "POSITION": {k} }}, "indices": 200 }}"#))
        .collect();
    let text = document(
        &buffer,
        &format!(
            r#""nodes": [ {{ "mesh": 0 }} ], "accessors": [ {many},
            {{ "bufferView": 0, "componentType": 5121, "count": 3, "type": "SCALAR" }} ],
            "meshes": [ {{ "primitives": [ {} ] }} ]"#,
            primitives.join(",")
        ),
    );
    let error = attempt(&text).unwrap_err();
    assert!(
        error
            .message()
            .contains("far more numbers than the buffers hold"),
        "{error}"
    );
}
