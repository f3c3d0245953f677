//! The exit statuses and messages of the command line, as a user runs it.

use crate::common::{folder, linelit, path, succeeded, text};

#[test]
fn usage_errors_exit_with_two() {
    for line in [
        "render plates -o x.exr --light-estimator point-bsdf",
        "render plates -o x.exr --light-estimator 0=lines",
        "rendr",
        "render cornell-box",
        "render cornell-box -o x.exr --samples 0",
        "render cornell-box -o x.exr --estimator lines",
        "render cornell-box -o x.exr --crop 0,2,0,1",
        "render cornell-box -o x.exr --crop 0,1,0.5",
        "render cornell-box -o x.exr --crop 0.5,0.2,0,1",
        "render cornell-box -o x.exr --crop 0,nan,0,1",
        "render cornell-box -o x.exr --threads=-1",
        "converge --pixels 0x0",
        "render cornell-box -o x.jpg",
        "render cornell-box -o x.exr --threads 1000000",
        "converge --threads 4294967295",
        "converge --samples 0,4",
        "converge --samples 4,1",
        "converge --samples 1,99999999",
        "converge --trials 1",
        "converge --time-budget 0",
        "converge --time-budget nan",
        "converge --time-budget inf",
        "converge --time-budget=-1",
        "converge --samples 16777217",
        "converge default shirley",
        "converge shirley cornell-box",
        "converge salesin-fig9",
        "converge salesin-fig5 plates strips",
    ] {
        let output = linelit(&line.split_ascii_whitespace().collect::<Vec<_>>());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn failures_exit_with_one_and_leave_nothing() {
    let dir = folder("failures");
    let image = dir.join("x.exr");
    let missing = linelit(&["render", "no-such-scene", "-o", path(&image)]);
    assert_eq!(missing.status.code(), Some(1));
    assert!(
        text(&missing.stderr).contains("no-such-scene"),
        "{}",
        text(&missing.stderr)
    );
    let said = text(&linelit(&["info", path(&dir)]).stderr);
    assert!(said.contains("it is not a regular file"), "{said}");
    let broken = dir.join("broken.pbrt");
    std::fs::write(
        &broken,
        "WorldBegin\nShape \"trianglemesh\" \"integer indices\" [ 0 1 9 ]\n",
    )
    .unwrap();
    let output = linelit(&["render", path(&broken), "-o", path(&image)]);
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    assert!(
        message.contains("broken.pbrt") && message.contains('2'),
        "{message}"
    );
    assert!(!image.exists());
}

#[test]
fn renders_are_reproducible_and_compare_equal() {
    let dir = folder("render");
    let (a, b) = (dir.join("a.exr"), dir.join("b.exr"));
    for (image, threads) in [(&a, "1"), (&b, "3")] {
        let arguments = [
            "render",
            "cornell-box",
            "-o",
            path(image),
            "--resolution",
            "24x24",
            "--threads",
            threads,
        ];
        succeeded(&arguments);
    }
    assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap());
    let compared = linelit(&["compare", path(&a), path(&b), "--json"]);
    assert!(compared.status.success(), "{}", text(&compared.stderr));
    let value: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert_eq!(value["mse"].as_f64(), Some(0.0), "{value}");
    let crop = dir.join("crop.exr");
    let arguments = [
        "render",
        "cornell-box",
        "-o",
        path(&crop),
        "--resolution",
        "24x24",
        "--crop",
        "0.25,0.75,0,1",
    ];
    succeeded(&arguments);
    let cropped = linelit_film::Image::read(&crop).unwrap();
    assert_eq!((cropped.width, cropped.height), (12, 24));
    let whole = linelit_film::Image::read(&a).unwrap();
    let bits = |v: [f32; 3]| v.map(f32::to_bits);
    assert_eq!(bits(cropped.get(0, 12)), bits(whole.get(6, 12)));
    // The file states the position of the part, where it is compared.
    let placement = linelit_film::Document::read(&crop).unwrap().placement;
    assert_eq!(
        placement.map(|p| (p.origin, p.full)),
        Some(([6, 0], [24, 24]))
    );
    assert_eq!(linelit_film::Document::read(&a).unwrap().placement, None);
    let compared = linelit(&["compare", path(&crop), path(&a), "--json"]);
    let value: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert_eq!(
        (value["mse"].as_f64(), &value["pixels"]),
        (Some(0.0), &288.into())
    );
}

#[test]
fn a_study_leaves_its_report() {
    let dir = folder("study");
    let arguments = [
        "converge",
        "cornell-box",
        "--samples",
        "1,4",
        "--trials",
        "2",
        "--pixels",
        "8x8",
        "--samplers",
        "independent",
        "--estimators",
        "point-area,line-analytic",
        "--out",
        path(&dir),
        "--json",
    ];
    let output = succeeded(&arguments);
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(value["rows"].as_array().unwrap().len(), 4);
    for file in ["results.csv", "slopes.csv", "results.json", "report.html"] {
        assert!(dir.join(file).is_file(), "{file}");
    }
    let csv = std::fs::read_to_string(dir.join("results.csv")).unwrap();
    assert!(csv.starts_with("scene,pixels,estimator,sampler,samples,trials,mse,mse_stderr,mrse,variance,bias,bias_stderr,cpu_seconds,cpu_error,wall_seconds,rays,line_queries,node_tests,triangle_tests,intervals,processor"));
    assert!(std::fs::read_dir(dir.join("plots")).unwrap().count() >= 2);
    let page = std::fs::read_to_string(dir.join("report.html")).unwrap();
    // Pictures are base64, in which any word may occur.
    let (first, pictures) = page.split_once("base64,").unwrap();
    let after = |picture: &str| picture.split_once('"').map(|(_, text)| text.to_owned());
    let others: String = pictures.split("base64,").filter_map(after).collect();
    let words = [first, &others].concat();
    assert!(words.contains("</html>") && !words.contains("src=\"http"));
    assert!(!words.contains("NaN"));
}
