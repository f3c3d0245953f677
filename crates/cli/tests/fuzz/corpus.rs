//! The inputs that are mutated: complete scenes of every format with every kind of picture, and the
//! inputs that once made a reader fail.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A scene and the files that it names, by name.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) main: String,
    pub(crate) files: BTreeMap<String, Vec<u8>>,
}

impl Case {
    pub(crate) fn new(main: &str, text: impl Into<Vec<u8>>) -> Self {
        Self {
            main: main.to_owned(),
            files: BTreeMap::from([(main.to_owned(), text.into())]),
        }
    }

    fn with(mut self, name: &str, bytes: &[u8]) -> Self {
        self.files.insert(name.to_owned(), bytes.to_vec());
        self
    }

    /// Writes the files into a folder, and returns the path of the scene.
    pub(crate) fn write(&self, folder: &Path) -> PathBuf {
        for (name, bytes) in &self.files {
            fs::write(folder.join(name), bytes).unwrap();
        }
        folder.join(&self.main)
    }
}

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
    let four = |b: [u8; 4]| {
        if little { b } else { [b[3], b[2], b[1], b[0]] }
    };
    for k in 0_u8..4 {
        for v in [f32::from(k & 1), f32::from(k >> 1), 0.0, 0.0, 0.0, 1.0] {
            bytes.extend(four(v.to_le_bytes()));
        }
        bytes.push(k);
    }
    for (count, list) in [(3_u8, &[0_i32, 1, 2][..]), (4, &[0, 1, 3, 2])] {
        bytes.push(count);
        bytes.extend(list.iter().flat_map(|i| four(i.to_le_bytes())));
    }
    bytes.extend(four(1_i32.to_le_bytes()));
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

/// A room whose floor, bumps and light use an image.
fn lit_by(image: &str) -> String {
    format!(
        "LookAt 0 2 -4 0 .5 0 0 1 0 Camera \"perspective\"\nWorldBegin\n\
         Texture \"c\" \"spectrum\" \"imagemap\" \"string filename\" \"{image}\" \"float uscale\" 2\n\
         Texture \"n\" \"float\" \"imagemap\" \"string filename\" \"{image}\" \"string wrap\" \"clamp\"\n\
         Material \"matte\" \"texture Kd\" \"c\" \"texture bumpmap\" \"n\"\n\
         Shape \"quad\" \"point o\" [ -2 0 -2 ] \"vector u\" [ 0 0 4 ] \"vector v\" [ 4 0 0 ]\n\
         AreaLightSource \"diffuse\" \"string filename\" \"{image}\"\n\
         Shape \"quad\" \"point o\" [ -.5 2 -.5 ] \"vector u\" [ 1 0 0 ] \"vector v\" [ 0 0 1 ]\n"
    )
}

/// Returns the folder of these tests.
fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fuzz")
        .join(name)
}

fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder).expect("the folder is part of the repository");
    let mut files: Vec<_> = entries
        .map(|e| e.unwrap().path())
        .filter(|p| p.is_file())
        .map(|p| {
            let name = p.file_name().unwrap().to_string_lossy().into_owned();
            (name, fs::read(p).unwrap())
        })
        .collect();
    files.sort();
    files
}

/// Returns complete scenes of every format.
pub(crate) fn seeds() -> Vec<Case> {
    let scene = |name: &str| {
        let path = folder("../../../formats/tests").join(name);
        fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    };
    let mut cases = vec![
        Case::new("main.pbrt", scene("seeds/everything.pbrt")),
        Case::new("main.obj", scene("seeds/everything.obj")),
        Case::new("main.gltf", scene("seeds/everything.gltf")),
        Case::new("main.gltf", scene("seeds/corners.gltf")),
        Case::new("main.glb", glb()),
        Case::new("main.ply", PLY_ASCII),
        Case::new("main.ply", binary_ply(true)),
        Case::new("main.ply", binary_ply(false)),
        Case::new("main.pbrt", scene("seeds/gzip.pbrt"))
            .with("tri.ply.gz", &scene("seeds/tri.ply.gz"))
            .with("part.pbrt.gz", &scene("seeds/part.pbrt.gz")),
    ];
    let own = files(&folder("seeds"));
    let named = |name: &str| {
        let found = own.iter().find(|(n, _)| n == name);
        found.map(|(_, bytes)| bytes.clone()).unwrap()
    };
    let mut room = Case::new("main.obj", named("room.obj")).with("all.mtl", &named("all.mtl"));
    for image in ["a.tga", "grey.tga", "small.png", "palette.png"] {
        room = room.with(image, &named(image));
    }
    cases.push(room);
    let images = [
        "interlaced.png",
        "ramp.jpg",
        "ramp-progressive.jpg",
        "grey.jpg",
    ];
    let images = images.map(|name| (name.to_owned(), scene(&format!("images/{name}"))));
    let is_image = |name: &str| !name.ends_with("obj") && !name.ends_with("mtl");
    for (name, bytes) in own.iter().filter(|(n, _)| is_image(n)).chain(&images) {
        cases.push(Case::new("main.pbrt", lit_by(name)).with(name, bytes));
    }
    cases
}

/// Returns the inputs that once made a reader fail, each a folder with a file `main`.
pub(crate) fn finds() -> Vec<(String, Case)> {
    let entries = fs::read_dir(folder("finds")).expect("the folder is part of the repository");
    let mut finds: Vec<_> = entries
        .map(|e| e.unwrap().path())
        .map(|path| {
            let files: BTreeMap<_, _> = files(&path).into_iter().collect();
            let main = files.keys().find(|n| n.starts_with("main."));
            let main = main.expect("a find has a main file").clone();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            (name, Case { main, files })
        })
        .collect();
    finds.sort_by(|a, b| a.0.cmp(&b.0));
    finds
}
