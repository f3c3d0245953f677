//! Billen & Dutré 2016, Figs. 9 and 13: the order of convergence of points and lines.

use linelit_estimators::PointBy;
use linelit_integrator::Estimator;
use linelit_samplers::SamplerKind;
use linelit_study::pixels::{Pixels, Resolution};
use linelit_study::record::PaperOrder;
use linelit_study::scene_study::StudySpec;

/// Figs. 9 (large lights) and 13 (small): random point, line; stratified point, line;
/// low-discrepancy point, line.
pub(super) const TABLE: [(&str, &str, [f64; 6]); 8] = [
    (
        "grid-planes-large",
        "Fig. 9",
        [
            -0.500006, -0.499698, -0.722607, -1.152465, -0.728064, -1.025048,
        ],
    ),
    (
        "logo-large",
        "Fig. 9",
        [
            -0.528350, -0.483650, -0.511009, -0.660526, -0.600950, -0.661047,
        ],
    ),
    (
        "triangle-soup-large",
        "Fig. 9",
        [
            -0.466542, -0.502162, -0.580416, -1.130108, -0.589068, -1.115833,
        ],
    ),
    (
        "colonnade-large",
        "Fig. 9, Sponza",
        [
            -0.500072, -0.499975, -0.720497, -1.269119, -0.763655, -1.444029,
        ],
    ),
    (
        "grid-planes-small",
        "Fig. 13",
        [
            -0.499750, -0.500003, -0.737551, -1.165623, -0.752114, -1.005696,
        ],
    ),
    (
        "logo-small",
        "Fig. 13",
        [
            -0.493513, -0.514205, -0.660507, -0.820198, -0.803129, -0.822268,
        ],
    ),
    (
        "triangle-soup-small",
        "Fig. 13",
        [
            -0.502810, -0.506269, -0.845316, -1.245989, -0.866152, -0.945898,
        ],
    ),
    (
        "colonnade-small",
        "Fig. 13, Sponza",
        [
            -0.500227, -0.500084, -0.743929, -1.180712, -0.757675, -0.999242,
        ],
    ),
];

/// The paper's lines: of one random direction for each shading point.
pub(super) const LINES: &str = "line-analytic[orientation=parallel,control=none]";

/// The columns of [`TABLE`]: the paper's words, estimator and pattern.
pub(super) const COLUMNS: [(&str, &str, SamplerKind); 6] = [
    ("random point", "point-area", SamplerKind::Independent),
    ("random line", LINES, SamplerKind::Independent),
    ("stratified point", "point-area", SamplerKind::Stratified),
    ("stratified line", LINES, SamplerKind::Stratified),
    ("low-discrepancy point", "point-area", SamplerKind::Sobol),
    ("low-discrepancy line", LINES, SamplerKind::Sobol),
];

/// The paper's orders.
pub(super) fn paper_orders() -> Vec<PaperOrder> {
    let row = |&(scene, source, orders): &(&str, &'static str, [f64; 6])| {
        let cell = |(&(_, estimator, sampler), order): (&(_, &'static str, SamplerKind), f64)| {
            PaperOrder {
                scene: scene.to_owned(),
                estimator,
                sampler: sampler.to_string(),
                order,
                source,
            }
        };
        COLUMNS.iter().zip(orders).map(cell).collect::<Vec<_>>()
    };
    TABLE.iter().flat_map(row).collect()
}

/// Grid planes, triangle soup, colonnade (in Sponza's place) and the glossy logo, small and large
/// lights. Every
/// sample is taken, as the paper takes it: no closed form where nothing occludes.
pub(super) fn spec() -> StudySpec {
    StudySpec {
        title: "Orders of convergence: Billen & Dutré 2016, Figs. 9 and 13".to_owned(),
        scenes: [
            "grid-planes-small",
            "grid-planes-large",
            "triangle-soup-small",
            "triangle-soup-large",
            "colonnade-small",
            "colonnade-large",
            "logo-small",
            "logo-large",
        ]
        .map(str::to_owned)
        .to_vec(),
        estimators: vec![
            Estimator::points(PointBy::Area),
            LINES.parse().expect("names an estimator"),
        ],
        samples: vec![4, 16, 64, 256, 1024],
        trials: 32,
        independent_trials: Some(128),
        pixels: Pixels::Grid(Resolution {
            width: 16,
            height: 16,
        }),
        skip: false,
        papers: paper_orders(),
        ..StudySpec::default()
    }
}
