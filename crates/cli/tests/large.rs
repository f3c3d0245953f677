//! The memory that a large mesh takes from its file to the first pixel. The test is in a program of
//! its own, because the peak memory is measured for the process.

use linelit_integrator::{Renderer, Settings, Workspace};

use std::io::{BufWriter, Write};

/// Ten million triangles fit into 1.5 GB, of which the scene takes .18 and the hierarchy .7; the
/// rest is temporary: the file in memory, the mesh while it is converted, and the binary tree.
#[test]
#[ignore = "long: a mesh of ten million triangles"]
fn ten_million_triangles() {
    const CELLS: u32 = 2240;
    let rows = CELLS + 1;
    let path = std::env::temp_dir().join(format!("linelit-large-{}.ply", std::process::id()));
    let mut file = BufWriter::new(std::fs::File::create(&path).unwrap());
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        rows * rows,
        2 * CELLS * CELLS
    )
    .unwrap();
    for k in 0..rows * rows {
        let (x, z) = (f64::from(k % rows), f64::from(k / rows));
        let p = linelit_geometry::DVec3::new(x, (0.1 * x).sin() * (0.07 * z).cos(), z).as_vec3();
        for c in p.to_array() {
            file.write_all(&c.to_le_bytes()).unwrap();
        }
    }
    for k in 0..CELLS * CELLS {
        let a = k / CELLS * rows + k % CELLS;
        for face in [[a, a + rows, a + rows + 1], [a, a + rows + 1, a + 1]] {
            file.write_all(&[3]).unwrap();
            for i in face {
                file.write_all(&i.to_le_bytes()).unwrap();
            }
        }
    }
    file.flush().unwrap();
    let loaded = linelit_formats::load(&path, &Default::default());
    std::fs::remove_file(&path).unwrap();
    let mut scene = loaded.unwrap().scene;
    assert_eq!(scene.triangles.len(), 10_035_200);
    assert!(linelit_formats::add_framing_light(&mut scene));
    // Each thread builds a part of the tree, which takes some 30 MB.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build();
    let renderer = pool.unwrap().install(|| Renderer::new(&scene));
    let middle = [scene.film.width / 2, scene.film.height / 2];
    let value = renderer.pixel(&Settings::default(), middle, &mut Workspace::new());
    assert!(value.min_element() > 0.0, "{value}");
    // Where the system reports it.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mark = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    if let Some(mark) = mark.and_then(|m| m.split_ascii_whitespace().next()) {
        let kib: u64 = mark.parse().unwrap();
        assert!(kib * 1024 < 1_500_000_000, "{kib} KiB");
    }
}
