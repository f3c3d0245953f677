//! Broken bytes never panic, hang or ask for much memory, in any format.
//!
//! Whole files are cut, bytes are changed, tokens are shuffled; whatever comes out must load or
//! be an error. The long test does the same for a million inputs.

use linelit_scene::{Format, LoadOptions, Scene};
use linelit_testkit::cases::cases;
use proptest::prelude::*;

/// A scene that has something of everything.
const PBRT: &str = include_str!("seeds/everything.pbrt");
const OBJ: &str = include_str!("seeds/everything.obj");
const GLTF: &str = include_str!("seeds/everything.gltf");
const GLTF_CORNERS: &str = include_str!("seeds/corners.gltf");
const PLY_ASCII: &str = "ply\nformat ascii 1.0\ncomment x\nelement vertex 5\nproperty float x\nproperty float y\n\
    property double z\nproperty list uchar int extra\nelement face 2\nproperty list uchar int vertex_indices\n\
    property uchar flag\nend_header\n0 0 0 0\n1 0 0 1 7\n1 1 0 0\n0 1 0 0\n.5 2 0 0\n3 0 1 2 9\n5 0 1 2 4 3 9\n";

fn binary_ply(little: bool) -> Vec<u8> {
    let format = if little { "little" } else { "big" };
    let mut bytes = format!(
        "ply\nformat binary_{format}_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
         property float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n\
         element face 2\nproperty list uchar int vertex_indices\nelement tail 1\nproperty list int short a\nend_header\n"
    )
    .into_bytes();
    for k in 0_u8..4 {
        for v in [f32::from(k & 1), f32::from(k >> 1), 0.0, 0.0, 0.0, 1.0] {
            let b = v.to_le_bytes();
            bytes.extend(if little { b } else { [b[3], b[2], b[1], b[0]] });
        }
        bytes.push(k);
    }
    for (count, list) in [(3_u8, &[0_i32, 1, 2][..]), (4, &[0, 1, 3, 2])] {
        bytes.push(count);
        for i in list {
            bytes.extend(if little {
                i.to_le_bytes()
            } else {
                i.to_be_bytes()
            });
        }
    }
    bytes.extend(if little {
        1_i32.to_le_bytes()
    } else {
        1_i32.to_be_bytes()
    });
    bytes.extend([7, 0]);
    bytes
}

fn glb() -> Vec<u8> {
    let json = br#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,"componentType":5126,
"count":3,"type":"VEC3"}],"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36}]}"#;
    let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    bytes.extend(u32::try_from(json.len()).unwrap().to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend(36_u32.to_le_bytes());
    bytes.extend(b"BIN\0");
    for v in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(v.to_le_bytes());
    }
    bytes
}

/// Whole files of every kind.
fn seeds() -> Vec<(Format, Vec<u8>)> {
    let mut seeds = vec![
        (Format::Pbrt, PBRT.as_bytes().to_vec()),
        (Format::Obj, OBJ.as_bytes().to_vec()),
        (Format::Ply, PLY_ASCII.as_bytes().to_vec()),
        (Format::Ply, binary_ply(true)),
        (Format::Ply, binary_ply(false)),
    ];
    if cfg!(feature = "gltf") {
        seeds.push((Format::Gltf, GLTF.as_bytes().to_vec()));
        seeds.push((Format::Gltf, GLTF_CORNERS.as_bytes().to_vec()));
        seeds.push((Format::Gltf, glb()));
    }
    seeds
}

/// Loads; a scene that comes out must be consistent.
fn attempt(format: Format, bytes: &[u8]) {
    let options = LoadOptions {
        strict: false,
        max_triangles: 100_000,
    };
    let Ok(loaded) = Scene::from_bytes(format, bytes, "fuzz", &options) else {
        return;
    };
    let scene = &loaded.scene;
    let count = scene.positions.len();
    assert!(scene.positions.iter().flatten().all(|c| c.is_finite()));
    assert!(
        scene
            .triangles
            .iter()
            .flatten()
            .all(|i| (*i as usize) < count)
    );
    for t in [
        0,
        scene.triangles.len() / 2,
        scene.triangles.len().saturating_sub(1),
    ] {
        if t < scene.triangles.len() {
            let t = u32::try_from(t).unwrap();
            let surface = scene.surface(t, [0.25, 0.25], linelit_geometry::DVec3::Z);
            assert!(surface.point.is_finite() && surface.geometric_normal.is_normalized());
            assert!((surface.material as usize) < scene.materials.len());
            scene.diffuse_reflectance(surface.material, surface.uv);
        }
    }
    let ray = scene.camera.ray(1.0, 1.0);
    assert!(ray.direction.is_normalized());
}

#[test]
fn the_seeds_load() {
    for (format, bytes) in seeds() {
        if let Err(error) = Scene::from_bytes(format, &bytes, "seed", &LoadOptions::default()) {
            panic!("{error}");
        }
    }
}

#[test]
fn every_cut_is_handled() {
    for (format, bytes) in seeds() {
        for cut in 0..bytes.len() {
            attempt(format, &bytes[..cut]);
        }
    }
}

/// What a mutation does at a place.
fn mutate(bytes: &mut Vec<u8>, place: usize, kind: u8, value: u8) {
    if bytes.is_empty() {
        return;
    }
    let i = place % bytes.len();
    match kind % 6 {
        0 => bytes[i] = value,
        1 => bytes.insert(i, value),
        2 => drop(bytes.remove(i)),
        3 => {
            let end = (i + usize::from(value)).min(bytes.len());
            let copy = bytes[i..end].to_vec();
            bytes.splice(i..i, copy);
        }
        4 => drop(bytes.drain(i..(i + usize::from(value)).min(bytes.len()))),
        // A digit becomes another one: numbers stay numbers but change.
        _ => {
            if let Some(b) = bytes[i..].iter_mut().find(|b| b.is_ascii_digit()) {
                *b = b'0' + value % 10;
            }
        }
    }
}

fn formats() -> impl Strategy<Value = Format> {
    prop::sample::select(vec![Format::Pbrt, Format::Obj, Format::Ply, Format::Gltf])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(2000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_are_handled(format in formats(), bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        attempt(format, &bytes);
    }

    #[test]
    fn random_text_is_handled(format in formats(), text in "[ -~\\n]{0,300}") {
        attempt(format, text.as_bytes());
    }

    #[test]
    fn shuffled_words_are_handled(words in prop::collection::vec(0_usize..10_000, 1..60)) {
        let all: Vec<&str> = PBRT.split_inclusive(char::is_whitespace).collect();
        let text: String = words.iter().map(|w| all[w % all.len()]).collect();
        attempt(Format::Pbrt, format!("WorldBegin {text}").as_bytes());
    }

    #[test]
    fn mutated_files_are_handled(
        seed in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<usize>(), any::<u8>(), any::<u8>()), 1..6),
    ) {
        let (format, mut bytes) = seed.get(&seeds()).clone();
        for (place, kind, value) in changes {
            mutate(&mut bytes, place, kind, value);
        }
        attempt(format, &bytes);
    }
}

#[test]
#[ignore = "long: a million mutated inputs over all readers"]
fn a_million_mutated_files_are_handled() {
    let seeds = seeds();
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = move || {
        // splitmix64
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    for round in 0..1_000_000_usize {
        let (format, mut bytes) = seeds[round % seeds.len()].clone();
        for _ in 0..=next() % 8 {
            let [kind, value, ..] = next().to_le_bytes();
            let place = usize::try_from(next() >> 8).unwrap_or(0);
            mutate(&mut bytes, place, kind, value);
        }
        let start = std::time::Instant::now();
        attempt(format, &bytes);
        assert!(start.elapsed().as_secs() < 5, "a hang");
    }
    // The high-water mark of the whole, where the system tells.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mark = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    if let Some(mark) = mark.and_then(|m| m.split_ascii_whitespace().next()) {
        let kib: u64 = mark.parse().unwrap();
        assert!(kib < 1 << 20, "{kib} KiB");
    }
}
