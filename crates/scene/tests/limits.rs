//! Small files cannot ask for much time or memory: each of these is refused by its first limit, or
//! is done soon.

use linelit_scene::{ErrorKind, Format, LoadOptions, Root, Scene, SceneError};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

/// Runs an attempt, which must be over within the five seconds that are a hang: on the processor,
/// where the system tells, because others use it too.
fn soon<T>(attempt: impl FnOnce() -> T) -> T {
    let (start, cpu) = (Instant::now(), processor_seconds());
    let result = attempt();
    let seconds = match (cpu, processor_seconds()) {
        (Some(before), Some(now)) => now - before,
        _ => start.elapsed().as_secs_f64(),
    };
    assert!(seconds < 5.0, "took {seconds} s");
    result
}

/// Seconds that this thread has run (Linux).
fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split_ascii_whitespace().next()?.parse().ok()?;
    Some(nanoseconds * 1e-9)
}

fn refused(result: Result<linelit_scene::Loaded, SceneError>, part: &str) {
    let error = result.expect_err(part);
    assert_eq!(error.kind(), ErrorKind::Limit, "{error}");
    assert!(error.message().contains(part), "{error}");
}

fn pbrt(text: &str) -> Result<linelit_scene::Loaded, SceneError> {
    Scene::from_pbrt_str(text, "limits.pbrt", &LoadOptions::default())
}

fn folder(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("linelit-limits-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    dir
}

#[test]
fn files_that_are_read_again_and_again() {
    let dir = folder("again");
    std::fs::write(dir.join("long.part"), "# nothing\n".repeat(100_000)).unwrap();
    let main = dir.join("main.pbrt");
    std::fs::write(&main, "Include \"long.part\"\n".repeat(9_000)).unwrap();
    let result = soon(|| Scene::load(&main, &LoadOptions::default()));
    refused(result, "`long.part` and others are read too often");
    // Files that include each other twice double with each level.
    for k in 0..30 {
        let text = format!("Include \"{}.part\"\n", k + 1).repeat(2);
        std::fs::write(dir.join(format!("{k}.part")), text).unwrap();
    }
    std::fs::write(dir.join("30.part"), "").unwrap();
    std::fs::write(&main, "Include \"0.part\"").unwrap();
    let result = soon(|| Scene::load(&main, &LoadOptions::default()));
    refused(result, "more than 10000 files are included");
    std::fs::remove_dir_all(&dir).unwrap();
}

/// A world with an object of many triangles, and many instances of it.
fn instances(before: &str, count: usize) -> String {
    let n = 2000;
    let mut text = format!(
        "Camera \"perspective\" WorldBegin ObjectBegin \"o\" {before} Shape \"trianglemesh\" \"point3 P\" ["
    );
    for k in 0..n {
        write!(text, " {k} 0 0 {k} 1 0 {k} 0 {}", k % 7 + 1).unwrap();
    }
    text += " ] \"integer indices\" [";
    (0..3 * n).for_each(|k| write!(text, " {k}").unwrap());
    text += " ] ObjectEnd\n";
    text + &"ObjectInstance \"o\"\n".repeat(count)
}

#[test]
fn instances_without_end() {
    let options = LoadOptions {
        max_triangles: 1 << 19,
        ..LoadOptions::default()
    };
    let text = instances("", 100_000);
    let load = || Scene::from_pbrt_str(&text, "limits.pbrt", &options);
    refused(soon(load), "more than 524288 triangles");
    let text = instances("AreaLightSource \"diffuse\"", 100_000);
    let load = || Scene::from_pbrt_str(&text, "limits.pbrt", &options);
    refused(soon(load), "more than 131072 lights");
    // Triangles without area count as work, though they are left out.
    let text = instances("Scale 1e-60 1e-60 1e-60", 100_000);
    let load = || Scene::from_pbrt_str(&text, "limits.pbrt", &options);
    refused(soon(load), "more than 524288 triangles");
}

#[test]
fn lines_without_end() {
    let text = format!(
        "Camera \"perspective\" WorldBegin AreaLightSource \"diffuse\" ObjectBegin \"o\" {} ObjectEnd {}",
        "Shape \"line\" \"point3 p0\" [ 0 0 0 ] \"point3 p1\" [ 1 0 0 ]\n".repeat(3000),
        "ObjectInstance \"o\"\n".repeat(3000)
    );
    refused(soon(|| pbrt(&text)), "lights");
}

#[test]
fn blocks_and_textures_without_end() {
    let text = format!("WorldBegin {}", "AttributeBegin ".repeat(1_000_000));
    refused(soon(|| pbrt(&text)), "nested more than 10000 deep");
    let mut text =
        "WorldBegin Texture \"t0\" \"spectrum\" \"constant\" \"rgb value\" [1 1 1]\n".to_owned();
    for k in 0..40 {
        writeln!(text, "Texture \"t{}\" \"spectrum\" \"scale\" \"texture tex1\" \"t{k}\" \"texture tex2\" \"t{k}\"", k + 1).unwrap();
    }
    refused(soon(|| pbrt(&text)), "is nested too deeply");
}

#[test]
fn suggestions_take_no_time() {
    let dir = folder("names");
    let mut library = String::new();
    let mut text = "mtllib many.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
    for k in 0..50_000 {
        writeln!(
            library,
            "newmtl a_material_with_a_name_that_is_as_long_as_they_are_looked_at_{k}"
        )
        .unwrap();
        writeln!(
            text,
            "usemtl a_material_with_a_name_as_long_as_they_are_looked_at_unknown_{k}\nf 1 2 3"
        )
        .unwrap();
    }
    std::fs::write(dir.join("many.mtl"), library).unwrap();
    std::fs::write(dir.join("many.obj"), text).unwrap();
    let loaded = soon(|| Scene::load(dir.join("many.obj"), &LoadOptions::default())).unwrap();
    assert_eq!(loaded.scene.triangles.len(), 50_000);
    assert!(loaded.warnings.len() <= 201);
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn polygons_with_very_many_corners() {
    let mut text = String::new();
    let n = 200_000;
    for k in 0..n {
        let angle = f64::from(k) * std::f64::consts::TAU / f64::from(n);
        let radius = if k % 2 == 0 { 1.0 } else { 0.9 };
        writeln!(
            text,
            "v {} {} 0",
            radius * angle.cos(),
            radius * angle.sin()
        )
        .unwrap();
    }
    text += "f";
    (1..=n).for_each(|k| write!(text, " {k}").unwrap());
    let options = LoadOptions::default();
    let loaded = soon(|| Scene::from_bytes(Format::Obj, text.as_bytes(), "star.obj", &options));
    assert!(loaded.unwrap().scene.triangles.len() > 100_000);
}

/// A mesh of ten million triangles within 4 GiB: the file in memory, the mesh on its way, and the
/// scene.
#[test]
#[ignore = "long: a mesh of ten million triangles"]
fn ten_million_triangles() {
    const CELLS: u32 = 2240;
    let rows = CELLS + 1;
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        rows * rows,
        2 * CELLS * CELLS
    )
    .into_bytes();
    for k in 0..rows * rows {
        let (x, z) = (f64::from(k % rows), f64::from(k / rows));
        let p = linelit_geometry::DVec3::new(x, (0.1 * x).sin() * (0.07 * z).cos(), z).as_vec3();
        bytes.extend(p.to_array().iter().flat_map(|c| c.to_le_bytes()));
    }
    for k in 0..CELLS * CELLS {
        let a = k / CELLS * rows + k % CELLS;
        for face in [[a, a + rows, a + rows + 1], [a, a + rows + 1, a + 1]] {
            bytes.push(3);
            bytes.extend(face.iter().flat_map(|i| i.to_le_bytes()));
        }
    }
    let loaded = Scene::from_bytes(Format::Ply, &bytes, "large.ply", &LoadOptions::default());
    let scene = loaded.unwrap().scene;
    assert_eq!(scene.triangles.len(), 10_035_200);
    // The high-water mark, where the system tells.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mark = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    if let Some(mark) = mark.and_then(|m| m.split_ascii_whitespace().next()) {
        let kib: u64 = mark.parse().unwrap();
        assert!(kib < 4 << 20, "{kib} KiB");
    }
}

/// Pipes would wait, devices have no end, and what lies elsewhere is nobody's business: by every
/// way that a scene has of naming a file, and as the scene itself.
#[cfg(unix)]
#[test]
fn only_regular_files_below_the_root_are_opened() {
    use std::os::unix::fs::symlink;
    let dir = folder("files");
    let mut mkfifo = std::process::Command::new("mkfifo");
    let made = mkfifo.arg(dir.join("pipe")).status();
    assert!(made.is_ok_and(|s| s.success()), "mkfifo");
    let _ = std::fs::remove_file(dir.join("link"));
    symlink("/dev/zero", dir.join("link")).unwrap();
    std::fs::create_dir_all(dir.join("inner")).unwrap();
    std::fs::write(dir.join("outer.pbrt"), "Shape \"sphere\"\n").unwrap();
    let anywhere = LoadOptions {
        root: Root::Anywhere,
        ..LoadOptions::default()
    };
    let forms: [(&str, fn(&str) -> String); 5] = [
        ("a.pbrt", |f| format!("WorldBegin Include \"{f}\"")),
        ("b.pbrt", |f| {
            format!("WorldBegin Shape \"plymesh\" \"string filename\" \"{f}\"")
        }),
        ("c.pbrt", |f| {
            format!(
                "WorldBegin Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{f}\""
            )
        }),
        ("d.obj", |f| format!("mtllib {f}\nv 0 0 0\n")),
        ("e.gltf", |f| {
            format!(
                "{{\"asset\":{{\"version\":\"2.0\"}},\"buffers\":[{{\"byteLength\":10,\"uri\":\"{f}\"}}],
                \"bufferViews\":[{{\"buffer\":0,\"byteLength\":10}}],\"accessors\":[{{\"bufferView\":0,
                \"componentType\":5126,\"type\":\"VEC3\",\"count\":3}}],\"meshes\":[{{\"primitives\":
                [{{\"attributes\":{{\"POSITION\":0}}}}]}}],\"nodes\":[{{\"mesh\":0}}]}}"
            )
        }),
    ];
    let strict = |options: &LoadOptions| LoadOptions {
        strict: true,
        ..options.clone()
    };
    for (main, text) in forms {
        let main = dir.join("inner").join(main);
        let is_read = cfg!(feature = "gltf") || !main.ends_with("e.gltf");
        if !is_read {
            continue;
        }
        let pipe = dir.join("pipe");
        for (name, options, part) in [
            (
                pipe.to_str().unwrap(),
                &anywhere,
                "it is a pipe, a socket or a device",
            ),
            ("/dev/zero", &anywhere, "it is a pipe, a socket or a device"),
            ("..", &anywhere, "it is a folder"),
            (
                "/dev/zero",
                &LoadOptions::default(),
                "it lies outside of the scene's folder",
            ),
            (
                "../outer.pbrt",
                &LoadOptions::default(),
                "it lies outside of the scene's folder",
            ),
            (
                "../nothing",
                &LoadOptions::default(),
                "it lies outside of the scene's folder",
            ),
        ] {
            std::fs::write(&main, text(name)).unwrap();
            let error = soon(|| Scene::load(&main, &strict(options))).unwrap_err();
            assert!(
                error.message().ends_with(part) || error.message().contains(part),
                "{error}"
            );
        }
    }
    // Links are followed before the root is asked.
    let main = dir.join("link.pbrt");
    std::fs::write(&main, "WorldBegin Include \"link\"").unwrap();
    let error = Scene::load(&main, &LoadOptions::default()).unwrap_err();
    assert!(error.message().contains("outside"), "{error}");
    // A folder may be named in place of the scene's.
    let main = dir.join("inner/up.pbrt");
    std::fs::write(&main, "WorldBegin Include \"../outer.pbrt\"").unwrap();
    let wider = LoadOptions {
        root: Root::Folder(dir.clone()),
        ..LoadOptions::default()
    };
    assert!(Scene::load(&main, &wider).is_ok());
    // The scene itself, and the limit on bytes.
    symlink("pipe", dir.join("pipe.pbrt")).unwrap_or(());
    let error = soon(|| Scene::load(dir.join("pipe.pbrt"), &anywhere)).unwrap_err();
    assert!(error.message().contains("it is a pipe"), "{error}");
    let short = LoadOptions {
        max_file_bytes: 10,
        ..wider
    };
    let error = Scene::load(&main, &short).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Limit);
    let want = "it has 34 bytes or more, 10 are allowed";
    assert!(error.message().ends_with(want), "{error}");
    std::fs::remove_dir_all(&dir).unwrap();
}

/// A picture of 4,194,304 × 16 pixels in a few bytes, of which a texture takes 805 megabytes.
#[cfg(feature = "hdr")]
#[test]
fn pictures_that_unpack_to_much_memory_are_refused_before() {
    let dir = folder("exr");
    let mut document = linelit_film::Document::new(16, 16);
    let small = linelit_film::Image::new(16, 16);
    document.add_image("", &small).unwrap();
    let mut bytes = document.encode().unwrap();
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    bytes[at + 8..at + 12].copy_from_slice(&4_194_303_i32.to_le_bytes());
    std::fs::write(dir.join("a.exr"), &bytes).unwrap();
    let main = dir.join("main.pbrt");
    let text = "WorldBegin Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.exr\"";
    std::fs::write(&main, text).unwrap();
    let result = soon(|| Scene::load(&main, &LoadOptions::default()));
    // The pixels, and a block of sixteen rows of three channels.
    let needed = 4_194_304_u64 * 16 * 12 * 2;
    let part = format!("found 4194304 × 16 pixels that take {needed}");
    refused(result, &part);
    std::fs::remove_dir_all(&dir).unwrap();
}
