//! Tests of alpha masks, which cut holes into shapes, in files of all formats.

use crate::common::{load, world};
use linelit_formats::{LoadOptions, Loaded};
use linelit_geometry::DVec2;
use linelit_scene::{Alpha, Cutout, SceneDescription};
use linelit_testkit::folder::Folder;

/// Makes a temporary folder with the image `leaf.tga`: 2 × 2 pixels of one colour, whose alphas are
/// 0, 100 in the upper row and 200, 255 in the lower one.
fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    let mut file = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 2, 0, 32, 0x28];
    for alpha in [0, 100, 200, 255] {
        file.extend([10, 20, 30, alpha]);
    }
    std::fs::write(folder.join("leaf.tga"), file).unwrap();
    folder
}

const TRIANGLE: &str = "Shape \"trianglemesh\" \"point3 P\" [0 0 0  1 0 0  0 1 0] \
    \"point2 uv\" [0 0  1 0  0 1]";

/// Returns where a surface with the given alpha mask is solid (true) and where it has a hole
/// (false): at the centres of the four quarters of the unit square of texture coordinates, in the
/// order lower left, lower right, upper left, upper right.
fn there(scene: &SceneDescription, alpha: u32) -> [bool; 4] {
    let alpha = &scene.alphas[alpha as usize];
    [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]]
        .map(|uv| alpha.texture.evaluate_number(DVec2::from_array(uv)) >= f64::from(alpha.cutoff))
}

/// The number of the alpha mask that camera rays use on the first mesh.
fn seen(scene: &SceneDescription) -> u32 {
    scene.meshes[0].cutout.and_then(|c| c.seen).unwrap()
}

#[test]
fn pbrt_cuts_where_alpha_is_zero_and_version_4_below_a_half() {
    let texture = "Texture \"leaf\" \"float\" \"checkerboard\" \"float uscale\" 2 \
        \"float vscale\" 2 \"float tex1\" 0.25 \"float tex2\" 0";
    let shape = format!("{TRIANGLE} \"texture alpha\" \"leaf\"");
    let v3 = world(&format!("{texture} {shape}"));
    assert_eq!(there(&v3, seen(&v3)), [true, false, false, true]);
    assert!(v3.alphas[0].cutoff.to_bits() == Alpha::ABOVE_ZERO.to_bits());
    let v4 = format!("Film \"rgb\" Camera \"perspective\" WorldBegin {texture} {shape}");
    let v4 = load(&v4).scene;
    assert_eq!(there(&v4, seen(&v4)), [false; 4]);
    // A surface with a constant alpha is kept whole or left out. With a `shadowalpha` of 0 it is
    // kept and casts no shadow.
    let scene = world(&format!(
        "{TRIANGLE} \"float alpha\" 0.1 {TRIANGLE} \"float alpha\" 0 \
         {TRIANGLE} \"float shadowalpha\" 0"
    ));
    let meshes = scene.meshes.iter().map(|m| (m.cutout, m.casts_no_shadow));
    assert_eq!(meshes.collect::<Vec<_>>(), [(None, false), (None, true)]);
}

#[test]
fn holes_are_those_of_the_file() {
    let folder = folder("holes");
    let file = folder.join("leaf.tga");
    let scene = world(&format!(
        "Texture \"leaf\" \"float\" \"imagemap\" \"string filename\" \"{}\"
         Texture \"check\" \"float\" \"checkerboard\" \"float tex1\" 1 \"float tex2\" 0
         {TRIANGLE} \"texture alpha\" \"leaf\" \"texture shadowalpha\" \"check\" \"float alphacutoff\" 0.3
         {TRIANGLE} \"texture shadowalpha\" \"leaf\"",
        file.display()
    ));
    let holes: Vec<_> = scene.meshes.iter().map(|m| m.cutout).collect();
    let cutout = |seen, shadow| Some(Cutout { seen, shadow });
    assert_eq!(holes, [cutout(Some(0), Some(1)), cutout(None, Some(2))]);
    let cutoffs: Vec<_> = scene.alphas.iter().map(|a| a.cutoff.to_bits()).collect();
    let zero = Alpha::ABOVE_ZERO.to_bits();
    assert_eq!(cutoffs, [0.3_f32.to_bits(), zero, zero]);
}

fn read(folder: &std::path::Path, name: &str, text: &str) -> Loaded {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    linelit_formats::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn messages(loaded: &Loaded) -> Vec<&str> {
    loaded.warnings.iter().map(|w| w.message()).collect()
}

#[test]
fn obj_cuts_by_the_alpha_channel() {
    let folder = folder("map_d");
    let library = "newmtl leaf\nmap_d leaf.tga\nnewmtl glass\nd 0.3\n";
    std::fs::write(folder.join("a.mtl"), library).unwrap();
    let faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
        usemtl leaf\nf 1/1 2/2 3/3\nusemtl glass\nf 1/1 3/3 2/2\n";
    let loaded = read(&folder, "a.obj", &format!("mtllib a.mtl\n{faces}"));
    assert_eq!(
        there(&loaded.scene, seen(&loaded.scene)),
        // The lower row of the surface is the second row of the file.
        [true, true, false, false]
    );
    assert_eq!(loaded.scene.meshes[1].cutout, None);
    let message = "transparency is not supported: surfaces are there or not";
    assert!(
        messages(&loaded).contains(&message),
        "{:?}",
        messages(&loaded)
    );
}

/// Returns a glTF document of one triangle with the first of the given materials.
#[cfg(feature = "gltf")]
fn gltf(materials: &str) -> String {
    // The positions (0,0,0), (1,0,0), (0,1,0).
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scenes": [ {{ "nodes": [ 0 ] }} ], "nodes": [ {{ "mesh": 0 }} ],
        "buffers": [ {{ "byteLength": 36, "uri": "data:;base64,{data}" }} ],
        "bufferViews": [ {{ "buffer": 0, "byteLength": 36 }} ],
        "accessors": [ {{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }} ],
        "meshes": [ {{ "primitives": [ {{ "attributes": {{ "POSITION": 0 }}, "material": 0 }} ] }} ],
        "images": [ {{ "uri": "leaf.tga" }} ], "textures": [ {{ "source": 0 }} ], "materials": [ {materials} ] }}"#
    )
}

#[cfg(feature = "gltf")]
#[test]
fn gltf_masks_cut_at_their_cutoff() {
    let folder = folder("mask");
    let base = r#""pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "baseColorFactor": [ 1, 1, 1, 0.5 ] }"#;
    // With the factor 0.5 the alphas are 0, 50, 100 and 127.5 of 255; all but the first are at
    // least 0.196, which is above the cutoff of 0.19.
    let cut = r#""alphaMode": "MASK", "alphaCutoff": 0.19"#;
    for (mode, want) in [
        (cut, [true, true, false, true]),
        (r#""alphaMode": "MASK""#, [false, true, false, false]),
        (r#""alphaMode": "BLEND""#, [false, true, false, false]),
    ] {
        let loaded = read(&folder, "a.gltf", &gltf(&format!("{{ {base}, {mode} }}")));
        assert_eq!(there(&loaded.scene, seen(&loaded.scene)), want, "{mode}");
        let warned = messages(&loaded).iter().any(|m| m.contains("blending"));
        assert_eq!(warned, mode.contains("BLEND"));
    }
    let plain = read(&folder, "a.gltf", &gltf(&format!("{{ {base} }}"))).scene;
    assert_eq!(plain.meshes[0].cutout, None);
    // A mask without an image keeps the whole mesh or leaves it out.
    let base =
        r#""pbrMetallicRoughness": { "baseColorFactor": [ 1, 1, 1, 0.4 ] }, "alphaMode": "MASK""#;
    for (cutoff, want) in [(0.3, 1), (0.5, 0)] {
        let material = format!(r#"{{ {base}, "alphaCutoff": {cutoff} }}"#);
        let scene = read(&folder, "a.gltf", &gltf(&material)).scene;
        assert_eq!(scene.meshes.len(), want);
    }
}
