//! Tests that small files cannot make the reader use much time or memory. Each of them is refused
//! by the first limit that it exceeds, or is read quickly.

use linelit_formats::{ErrorKind, Format, LoadOptions, SceneError};
use linelit_testkit::folder::Folder;
use std::fmt::Write as _;
use std::time::Instant;

/// Runs an attempt and asserts that it takes less than five seconds. Where the system reports it,
/// the time of the processor counts, because other processes may run at the same time.
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

/// Returns the seconds that this thread has run on a processor, or `None` where the system does not
/// tell it (Linux does).
fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split_ascii_whitespace().next()?.parse().ok()?;
    Some(nanoseconds * 1e-9)
}

fn refused(result: Result<linelit_formats::Loaded, SceneError>, part: &str) {
    let error = result.expect_err(part);
    assert_eq!(error.kind(), ErrorKind::Limit, "{error}");
    assert!(error.message().contains(part), "{error}");
}

fn pbrt(text: &str) -> Result<linelit_formats::Loaded, SceneError> {
    linelit_formats::from_pbrt_str(text, "limits.pbrt", &LoadOptions::default())
}

#[test]
fn files_that_are_read_again_and_again() {
    let dir = Folder::new("limits-again");
    std::fs::write(dir.join("long.part"), "# nothing\n".repeat(100_000)).unwrap();
    let main = dir.join("main.pbrt");
    std::fs::write(&main, "Include \"long.part\"\n".repeat(9_000)).unwrap();
    let result = soon(|| linelit_formats::load(&main, &LoadOptions::default()));
    refused(result, "`long.part` and others are read too often");
    // With files each of which includes the next one twice, the number of included files doubles
    // with each level.
    for k in 0..30 {
        let text = format!("Include \"{}.part\"\n", k + 1).repeat(2);
        std::fs::write(dir.join(format!("{k}.part")), text).unwrap();
    }
    std::fs::write(dir.join("30.part"), "").unwrap();
    std::fs::write(&main, "Include \"0.part\"").unwrap();
    let result = soon(|| linelit_formats::load(&main, &LoadOptions::default()));
    refused(result, "more than 10000 files are included");
}

/// Returns pbrt text with an object of 2000 triangles, after the directives `before`, and `count`
/// instances of it.
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
    let load = || linelit_formats::from_pbrt_str(&text, "limits.pbrt", &options);
    refused(soon(load), "more than 524288 triangles");
    let text = instances("AreaLightSource \"diffuse\"", 100_000);
    let load = || linelit_formats::from_pbrt_str(&text, "limits.pbrt", &options);
    refused(soon(load), "more than 131072 lights");
    // Triangles without area are left out, but count for the limit because they take time.
    let text = instances("Scale 1e-60 1e-60 1e-60", 100_000);
    let load = || linelit_formats::from_pbrt_str(&text, "limits.pbrt", &options);
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
    let dir = Folder::new("limits-names");
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
    let loaded =
        soon(|| linelit_formats::load(dir.join("many.obj"), &LoadOptions::default())).unwrap();
    assert_eq!(loaded.scene.triangles.len(), 50_000);
    assert!(loaded.warnings.len() <= 201);
}

/// Faces of many corners do not take long: 200 of 1024 corners are triangulated, and one of 200,000
/// corners has too many and is left out.
#[test]
fn polygons_with_very_many_corners() {
    for (n, times, triangles) in [(1024, 200, 200 * 1022), (200_000, 1, 0)] {
        let mut text = "v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n".to_owned();
        for k in 0..n {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(n);
            let radius = if k % 2 == 0 { 1.0 } else { 0.9 };
            let [x, y] = [angle.cos(), angle.sin()].map(|v| radius * v);
            writeln!(text, "v {x} {y} 0").unwrap();
        }
        let corners: String = (4..n + 4).map(|k| format!(" {k}")).collect();
        text += &format!("f{corners}\n").repeat(times);
        let options = LoadOptions::default();
        let loaded = soon(|| {
            linelit_formats::from_bytes(Format::Obj, text.as_bytes(), "star.obj", &options)
        });
        assert_eq!(loaded.unwrap().scene.triangles.len(), 1 + triangles);
    }
}
