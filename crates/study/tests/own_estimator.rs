//! An estimator that is not linelit's is measured, fitted and reported.

use linelit_geometry::DVec3;
use linelit_study::engine::{
    Contest, Counts, Design, Job, Method, Problem, Results, Truth, contest, measure,
};
use linelit_study::report::{Exhibits, Verdict};
use linelit_study::tables::{SceneRecord, StudyRecord};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;

/// ∫ xᵏ over [0, 1] by independent (`false`) or stratified samples.
struct Powers;

impl Problem for Powers {
    type Settings = bool;
    type Workspace = u64;

    fn integrals(&self) -> usize {
        40
    }

    fn estimate(&self, stratified: &bool, n: u32, seed: u64, k: usize, drawn: &mut u64) -> DVec3 {
        let mut random = Pcg64Mcg::seed_from_u64(seed ^ k as u64);
        *drawn += u64::from(n);
        let x = |i: u32| {
            let u: f64 = random.random();
            if *stratified {
                (f64::from(i) + u) / f64::from(n)
            } else {
                u
            }
        };
        let power = |x: f64| x.powi(i32::try_from(k).unwrap() % 8 + 1);
        DVec3::splat((0..n).map(x).map(power).sum::<f64>() / f64::from(n))
    }

    fn take_counts(&self, drawn: &mut u64) -> Counts {
        Counts {
            rays: std::mem::take(drawn),
            ..Counts::default()
        }
    }
}

fn values() -> Vec<DVec3> {
    let value = |k: u32| DVec3::splat(1.0 / f64::from(k % 8 + 2));
    (0..40).map(value).collect()
}

fn method(sampler: &str, settings: bool) -> Method<bool> {
    Method {
        estimator: "mean".to_owned(),
        sampler: sampler.to_owned(),
        trials: 24,
        settings,
    }
}

fn design() -> Design<bool> {
    let methods = vec![method("independent", false), method("stratified", true)];
    Design {
        cell_seconds: 0.0,
        ..Design::new(methods, vec![4, 16, 64])
    }
}

/// Returns the record of a study, and its files by name.
fn study(truth: &Truth<bool>) -> (StudyRecord, BTreeMap<String, Vec<u8>>) {
    let design = design();
    let results = measure(Job {
        problem: &Powers,
        truth,
        design: &design,
    });
    assert_eq!(results.cells.len(), 6);
    let mut record = StudyRecord::new("Powers");
    let scene = SceneRecord {
        scene: "powers".to_owned(),
        ..SceneRecord::default()
    };
    record.add(scene, "all", &design.methods, &results, &[]);
    let files = record
        .files(Exhibits::default())
        .unwrap()
        .into_iter()
        .collect();
    (record, files)
}

/// Stratified samples of a smooth integrand in one dimension: N^−3/2 (see `docs/studies.md`).
#[test]
fn orders_are_those_of_the_theory() {
    let (record, files) = study(&Truth::Known(values()));
    let orders: Vec<f64> = record.slopes.iter().map(|s| s.fit.order).collect();
    // 40 · 24 squares at each of three N: ln σ is good to 1/√(2·960) = 0.023, the slope over ln 16
    // to √2·0.023/2.77 = 0.012. Five of those; small N bend a stratified curve by less than that.
    assert!((orders[0] + 0.5).abs() < 0.06, "{orders:?}");
    assert!((orders[1] + 1.5).abs() < 0.06, "{orders:?}");
    // The work is 40 integrals · 24 trials · N samples.
    let rays: Vec<u64> = record.rows.iter().map(|r| r.rays).collect();
    assert_eq!(rays, [4, 4, 16, 16, 64, 64].map(|n| n * 40 * 24));
    let page = String::from_utf8(files["report.html"].clone()).unwrap();
    assert!(
        page.contains("The least likely of 6 biases") && page.contains("mean"),
        "{page}"
    );
    for name in ["results.csv", "plots/powers-samples.svg"] {
        assert!(!files[name].is_empty(), "{name}");
    }
}

/// Estimators that are not linelit's count neither as points nor as lines, whatever their names
/// are: not in the sentence on efficiency, and not in the table of points against lines.
#[test]
fn estimators_of_ones_own_are_not_called_points_or_lines() {
    let (record, _) = study(&Truth::Known(values()));
    let with_names = |names: [&str; 2]| {
        let mut record = record.clone();
        for row in &mut record.rows {
            let is_first = row.sampler == "independent";
            row.estimator = names[usize::from(!is_first)].to_owned();
            row.cpu_seconds = f64::from(row.samples);
        }
        let files = record.files(Exhibits::default()).unwrap();
        let page = files.into_iter().find(|(name, _)| name == "report.html");
        let page = String::from_utf8(page.unwrap().1).unwrap();
        (page, Verdict::all(&record))
    };
    for names in [
        ["mine", "mine"],
        ["point-mine", "points"],
        ["line-mine", "exactly"],
        ["pointwise", "line-area-of-mine"],
    ] {
        let (page, verdicts) = with_names(names);
        assert!(
            page.contains("the scene&#39;s best estimator,")
                || page.contains("the scene's best estimator,"),
            "{page}"
        );
        assert!(!page.contains("best points"), "{names:?}");
        assert!(verdicts.is_empty(), "{verdicts:?}");
    }
    // If linelit's estimators are measured as well, efficiency is relative to linelit's points, and
    // the other estimator has no part in the comparison of points and lines.
    let (page, verdicts) = with_names(["point-area", "mine"]);
    assert!(
        page.contains("best points, point-area (independent)"),
        "{page}"
    );
    assert!(verdicts.is_empty(), "{verdicts:?}");
    let (page, verdicts) = with_names(["point-area+point-bsdf", "point-area+line-area"]);
    assert!(page.contains("best points, point-area+point-bsdf (independent)"));
    assert!(
        verdicts[0].estimator.starts_with("point-area+line-area"),
        "{verdicts:?}"
    );
}

/// A problem without integrals.
struct Nothing;

impl Problem for Nothing {
    type Settings = bool;
    type Workspace = ();

    fn integrals(&self) -> usize {
        0
    }

    fn estimate(&self, _: &bool, _: u32, _: u64, _: usize, (): &mut ()) -> DVec3 {
        DVec3::ONE
    }
}

/// No methods, no numbers of samples or no integrals make a report without numbers, and no panic.
#[test]
fn empty_lists_are_empty_studies() {
    let one = || vec![method("independent", false)];
    let report = |design: &Design<bool>, results: &Results| {
        let mut record = StudyRecord::new("Nothing");
        let (scene, pixels) = (SceneRecord::default(), "all");
        record.add(scene, pixels, &design.methods, results, &[]);
        let files = record.files(Exhibits::default()).unwrap();
        let page = files.iter().find(|(name, _)| name == "report.html");
        assert!(!String::from_utf8_lossy(&page.unwrap().1).contains("NaN"));
        record
    };
    for truth in [
        Truth::Known(values()),
        Truth::Computed(method("stratified", true)),
    ] {
        for (methods, samples) in [(vec![], vec![4]), (one(), vec![]), (vec![], vec![])] {
            let (problem, truth, design) = (&Powers, &truth, &Design::new(methods, samples));
            let results = measure(Job {
                problem,
                truth,
                design,
            });
            assert!(results.cells.is_empty());
            assert!(report(design, &results).rows.is_empty());
        }
    }
    for truth in [
        Truth::Known(Vec::new()),
        Truth::Computed(method("stratified", true)),
    ] {
        let mut design = Design::new(one(), vec![4, 16]);
        design.cell_seconds = 0.0;
        let (problem, truth, design) = (&Nothing, &truth, &design);
        let results = measure(Job {
            problem,
            truth,
            design,
        });
        report(design, &results);
    }
}

/// The reference of many samples agrees with the known values within its own error.
#[test]
fn a_computed_reference_knows_its_error() {
    let (record, _) = study(&Truth::Computed(method("stratified", true)));
    let scene = &record.scenes[0];
    assert_eq!(
        scene.reference,
        "24 replicates of mean with 256 stratified samples"
    );
    let (known, _) = study(&Truth::Known(values()));
    for (ours, exact) in record.rows.iter().zip(&known.rows) {
        // Squared errors differ by the reference's, and by twice its product with the mean error:
        // both at most √reference_mse · √mse.
        let bound = 3.0 * (scene.reference_mse * exact.mse).sqrt();
        assert!((ours.mse - exact.mse).abs() <= bound, "{ours:?}\n{exact:?}");
    }
}

/// Any number of threads gives the same bits.
#[test]
fn threads_change_nothing() {
    let errors = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let (record, _) = pool
            .build()
            .unwrap()
            .install(|| study(&Truth::Known(values())));
        let bits = |row: &linelit_study::tables::ResultRow| [row.mse, row.bias].map(f64::to_bits);
        record.rows.iter().map(bits).collect::<Vec<_>>()
    };
    let one = errors(1);
    assert_eq!(one, errors(2));
    assert_eq!(one, errors(5));
}

#[test]
fn a_contest_tells_which_error_comes_first() {
    let what = Contest {
        entries: vec![(false, vec![4, 64]), (true, vec![4, 64])],
        rounds: 8,
        truth: values(),
    };
    let curves = contest(&Powers, &what);
    let [independent, stratified] = [0, 1].map(|k| curves[k].points[1].mse);
    // In theory N² apart, 4096 for one power; the mean over powers leaves a factor of hundreds.
    assert!(
        independent > 100.0 * stratified,
        "{independent} {stratified}"
    );
    assert!(curves[0].time_to(0.5 * stratified).is_none());
}

/// Times on two processors: the processor with most rows comes first, the other has a section of
/// its own, and their times are not compared.
#[test]
fn processors_are_told_apart() {
    let (mut record, _) = study(&Truth::Known(values()));
    for row in &mut record.rows {
        row.cpu_seconds = 0.125;
        row.processor = "One".to_owned();
    }
    let page = |record: &StudyRecord| {
        let files = record.files(Exhibits::default()).unwrap();
        let page = files.into_iter().find(|(name, _)| name == "report.html");
        String::from_utf8(page.unwrap().1).unwrap()
    };
    assert!(!page(&record).contains("Times on"));
    record.rows[1].processor = "Two".to_owned();
    record.rows[1].cpu_seconds = 77.0;
    assert_eq!(record.processors(), ["One", "Two"]);
    let page = page(&record);
    assert!(page.contains("Times on Two") && !page.contains("Times on One"));
    assert!(page.contains("1 of 6 measurements were timed there"));
    // Once in the table of its own processor; in the others a dash.
    assert_eq!(
        page.matches("77 s<").count() + page.matches("77.0 s<").count(),
        1,
        "{page}"
    );
    assert!(page.contains("on Two"));
}
