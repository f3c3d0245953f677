//! View factors: the numbers are the same in all files, at once or in parts; and errors in input.

use crate::common::{Folder, folder, linelit, path, succeeded, text};
use flate2::Crc;
use std::fs;
use std::path::Path;

/// Two unit squares face each other, and a quarter of a square halfway hides a quarter of all pairs
/// of points; a fourth surface only hides, and is far away.
const SQUARES: &str = "\
T Two squares with a square in between\nF 3\n\
V 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\nV 5 0 0 1\nV 6 1 0 1\nV 7 1 1 1\nV 8 0 1 1\n\
V 9 0 0 .5\nV 10 .5 0 .5\nV 11 .5 .5 .5\nV 12 0 .5 .5\nV 13 0 0 90\nV 14 1 0 90\nV 15 0 1 90\n\
S 1 1 2 3 4 0 0 0.50 low\nS 2 7 6 5 8 0 0 0.25 high\nS 3 9 10 11 12 0 0 0.75 between\n\
O 4 13 14 15 0 0 0 1 far\n";

fn squares() -> (Folder, String) {
    let dir = folder("viewfactors");
    let file = dir.join("squares.vs3");
    fs::write(&file, SQUARES).unwrap();
    let name = path(&file).to_owned();
    (dir, name)
}

/// Rows of a table of factors.
fn table(file: &Path) -> Vec<(usize, i64, f64, f64)> {
    let text = fs::read_to_string(file).unwrap();
    let (head, rows) = text.split_once('\n').unwrap();
    assert_eq!(head, "from,to,factor,error");
    let row = |line: &str| {
        let mut cells = line.split(',');
        let mut next = || cells.next().unwrap();
        (
            next().parse().unwrap(),
            next().parse().unwrap(),
            next().parse().unwrap(),
            next().parse().unwrap(),
        )
    };
    rows.lines().map(row).collect()
}

/// The bytes behind numpy's head, of each stored entry of a zip file.
fn arrays(file: &Path) -> Vec<(String, String, Vec<u8>)> {
    let bytes = fs::read(file).unwrap();
    let number = |at: usize, size: usize| {
        let digits = bytes[at..at + size].iter().rev();
        digits.fold(0, |all, byte| 256 * all + usize::from(*byte))
    };
    let (mut at, mut found) = (0, Vec::new());
    while bytes[at..].starts_with(b"PK\x03\x04") {
        let (name, extra) = (number(at + 26, 2), number(at + 28, 2));
        let start = at + 30 + name + extra;
        let body = &bytes[start..start + number(at + 30 + name + 4, 8)];
        let mut crc = Crc::new();
        crc.update(body);
        assert_eq!(crc.sum() as usize, number(at + 14, 4));
        assert!(body.starts_with(b"\x93NUMPY\x01\x00"));
        let head = 10 + number(start + 8, 2);
        assert_eq!(head % 64, 0);
        let shown = |range: &[u8]| String::from_utf8(range.to_vec()).unwrap();
        let name = shown(&bytes[at + 30..at + 30 + name]);
        found.push((name, shown(&body[10..head]), body[head..].to_vec()));
        at = start + body.len();
    }
    // The end in 64 bits leads to the directory, which leads to each entry.
    let end = bytes.len() - 22 - 20 - 56;
    assert!(bytes[end..].starts_with(b"PK\x06\x06"));
    assert_eq!(
        (number(end + 32, 8), number(end + 48, 8)),
        (found.len(), at)
    );
    assert_eq!(number(end + 56 + 8, 8), end);
    found
}

#[test]
fn all_files_have_the_same_numbers() {
    let (dir, facets) = squares();
    let [csv, npz, vf] = ["f.csv", "f.npz", "f.vf"].map(|name| dir.join(name));
    for file in [&csv, &npz, &vf] {
        succeeded(&[
            "viewfactors",
            &facets,
            "-o",
            path(file),
            "--tolerance",
            "1e-6",
        ]);
    }
    let rows = table(&csv);
    let at = |from, to| rows.iter().find(|r| (r.0, r.1) == (from, to)).unwrap();
    // Three quarters of the closed form, by symmetry.
    let (_, _, factor, error) = *at(0, 1);
    assert!(
        (factor - 0.149_868_671_774).abs() <= error + 1e-12 && error <= 1e-6,
        "{factor}"
    );
    // The obstruction has no row and no column.
    assert!(rows.iter().all(|r| r.0 < 3 && r.1 < 3));
    for row in 0..3 {
        let all = rows.iter().filter(|r| r.0 == row);
        assert!((all.map(|r| r.2).sum::<f64>() - 1.0).abs() < 1e-15);
    }

    let found = arrays(&npz);
    let doubles = |name: &str| -> Vec<f64> {
        let (_, head, bytes) = found.iter().find(|f| f.0 == format!("{name}.npy")).unwrap();
        assert!(
            head.starts_with("{'descr': '<f8', 'fortran_order': False, 'shape': ("),
            "{head}"
        );
        bytes
            .as_chunks::<8>()
            .0
            .iter()
            .map(|b| f64::from_le_bytes(*b))
            .collect()
    };
    let of = |is_sky| rows.iter().filter(move |r| (r.1 < 0) == is_sky);
    assert_eq!(doubles("data"), of(false).map(|r| r.2).collect::<Vec<_>>());
    assert_eq!(doubles("error"), of(false).map(|r| r.3).collect::<Vec<_>>());
    assert_eq!(doubles("sky"), of(true).map(|r| r.2).collect::<Vec<_>>());
    assert_eq!(doubles("area"), [1.0, 1.0, 0.25]);
    assert_eq!(
        (found[0].0.as_str(), &found[0].2[..]),
        ("format.npy", &b"csr"[..])
    );
    assert!(
        found[0].1.contains("'|S3'") && found[0].1.contains("'shape': ()"),
        "{}",
        found[0].1
    );

    view3d_text(&vf, &rows);
}

/// View3D's text has the numbers of the table, and areas and emittances.
fn view3d_text(file: &Path, rows: &[(usize, i64, f64, f64)]) {
    let text = fs::read_to_string(file).unwrap();
    let lines: Vec<Vec<&str>> = text.lines().map(|l| l.split(' ').collect()).collect();
    assert!(
        text.starts_with("linelit ") && text.lines().next().unwrap().trim_end().ends_with(" 3")
    );
    assert_eq!(
        (&lines[1][..], &lines[5][..]),
        (&["1.0", "1.0", "0.25"][..], &["0.5", "0.25", "0.75"][..])
    );
    assert_eq!(lines.len(), 6);
    for (row, line) in lines[2..5].iter().enumerate() {
        for (column, word) in (0..).zip(line) {
            let in_table = rows.iter().find(|r| (r.0, r.1) == (row, column));
            let numbers = [word.parse().unwrap(), in_table.map_or(0.0, |r| r.2)];
            let [a, b] = numbers.map(f64::to_bits);
            assert_eq!(a, b, "{row} {column}");
        }
    }
}

#[test]
fn parts_come_to_the_same_bytes() {
    let (dir, facets) = squares();
    let [whole, merged] = ["whole.npz", "merged.npz"].map(|name| dir.join(name));
    let (plan, report) = (dir.join("plan"), dir.join("report"));
    let (plan, to) = (path(&plan), path(&merged));
    succeeded(&[
        "viewfactors",
        &facets,
        "-o",
        path(&whole),
        "--tolerance",
        "1e-5",
        "--sides",
        "2",
    ]);
    let factors = ["--tolerance", "1e-5", "--sides", "2", "--rows", "2"];
    succeeded(&[&["plan", "viewfactors", &facets, "-o", plan][..], &factors].concat());
    succeeded(&["run", plan, "--shard", "2/2"]);
    let missing = linelit(&["merge", plan, "-o", to]);
    assert_eq!(missing.status.code(), Some(75), "{}", text(&missing.stderr));
    assert!(
        text(&missing.stderr).contains("rows "),
        "{}",
        text(&missing.stderr)
    );
    succeeded(&["run", plan]);
    succeeded(&["merge", plan, "-o", to, "--report", path(&report)]);
    assert!(fs::read(&whole).unwrap() == fs::read(&merged).unwrap());
    assert!(report.join("report.html").exists());

    fs::write(&facets, SQUARES.replace("V 7 1 1 1", "V 7 1 1 2")).unwrap();
    let changed = linelit(&["run", plan]);
    assert_eq!(changed.status.code(), Some(1));
    assert!(
        text(&changed.stderr).contains("has changed"),
        "{}",
        text(&changed.stderr)
    );
}

/// All formats give polygons if their reader knows polygons, otherwise triangles.
#[test]
fn facets_come_from_all_formats() {
    let dir = folder("viewfactors-formats");
    let ply = dir.join("quads.ply");
    let head = "ply\nformat ascii 1.0\nelement vertex 5\nproperty double x\nproperty double y\n\
                property double z\nelement face 2\nproperty list uchar int vertex_indices\n\
                end_header\n";
    fs::write(
        &ply,
        format!("{head}0 0 0\n1 0 0\n1 1 0\n0 1 0\n.5 .5 1\n4 0 1 2 3\n3 1 0 4\n"),
    )
    .unwrap();
    let stl = dir.join("one.stl");
    fs::write(
        &stl,
        "solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\n",
    )
    .unwrap();
    let obj = dir.join("quad.obj");
    fs::write(
        &obj,
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2/2 3/3 4/4\n",
    )
    .unwrap();
    let gltf = "tests/cornell/box.gltf";
    for (file, facets) in [
        (path(&ply), 2),
        (path(&stl), 1),
        (path(&obj), 1),
        (gltf, 36),
    ] {
        let output = dir.join("f.csv");
        let said = succeeded(&[
            "viewfactors",
            file,
            "-o",
            path(&output),
            "--json",
            "--tolerance",
            "0.1",
        ]);
        let said: serde_json::Value = serde_json::from_slice(&said.stdout).unwrap();
        assert_eq!(said["facets"], facets, "{file}: {said}");
    }
}

#[test]
fn what_is_wrong_is_said_with_file_and_line() {
    let (dir, facets) = squares();
    let output = dir.join("f.csv");
    let bad = dir.join("bad.vs3");
    let flat = SQUARES
        .replace("V 3 1 1 0", "V 3 .5 0 0")
        .replace("V 4 0 1 0", "V 4 .2 0 0");
    for (contents, what) in [
        (
            SQUARES.replace("S 2 7", "S 2 77"),
            "bad.vs3, line 19: there is no vertex 77",
        ),
        (
            SQUARES.replace("V 7 1 1 1", "V 7 1 1 5"),
            "bad.vs3, line 19: facet 1 is not flat",
        ),
        (flat, "bad.vs3, line 18: facet 0 "),
        (
            SQUARES.replace("V 7 1 1 1", "V 7 1 1 1e30"),
            "bad.vs3: vertex 6 is not finite",
        ),
        ("T nothing\n".to_owned(), "bad.vs3: no facets"),
    ] {
        fs::write(&bad, contents).unwrap();
        let failed = linelit(&["viewfactors", path(&bad), "-o", path(&output)]);
        let said = text(&failed.stderr);
        assert_eq!(failed.status.code(), Some(1), "{said}");
        assert!(said.contains(what), "`{said}`, not `{what}`");
    }
    let image = dir.join("f.exr");
    let usage = [
        &["viewfactors", &facets, "-o", path(&image)][..],
        &[
            "viewfactors",
            &facets,
            "-o",
            path(&output),
            "--tolerance",
            "0",
        ],
        &[
            "viewfactors",
            &facets,
            "-o",
            path(&output),
            "--tolerance",
            "nan",
        ],
        &["viewfactors", &facets, "-o", path(&output), "--sides", "3"],
    ];
    for arguments in usage {
        let status = linelit(arguments).status;
        assert_eq!(status.code(), Some(2), "{arguments:?}");
    }
    assert!(!output.exists());
}
