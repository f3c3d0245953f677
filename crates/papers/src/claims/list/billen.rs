//! Claims of Billen & Dutré 2016.

use super::super::claim::{Claim, Expected, Paper, Verdict};
use super::{BETTER, THEORY};
use crate::billen_orders::{COLUMNS, TABLE};

/// All of them.
pub(super) fn claims() -> Vec<Claim> {
    let mut all = orders();
    all.extend(samples_and_time());
    all.extend(theory());
    all.extend(expectations());
    all.extend(directions());
    all.extend(formulas());
    all.extend(visibility());
    all.extend(times());
    all.extend(ranking());
    all
}

fn claim(id: impl Into<String>, place: &'static str, says: impl Into<String>) -> Claim {
    Claim::new(Paper::Billen, id, place, says)
}

/// The table's cells but the random ones, of which all say the same.
fn orders() -> Vec<Claim> {
    let mut all = Vec::new();
    for (scene, place, row) in TABLE {
        for ((column, ..), order) in COLUMNS.into_iter().zip(row).skip(2) {
            let says = format!(
                "σ falls as N to the −{:.3} by {column} samples on {scene}.",
                -order
            );
            let id = format!("order/{scene}/{column}");
            let found = claim(id, place, says).figure(order, 0.0, tolerance(column), SCENES);
            all.push(match (scene, column) {
                ("logo-large", _)
                | ("logo-small", "stratified line" | "low-discrepancy line") => {
                    found.recorded(Verdict::Stronger)
                }
                ("triangle-soup-small", "stratified line") => {
                    found.recorded(Verdict::Weaker).because_of(
                        "Between the −1 of a jump and the −3/2 of a kink, as the paper's, and nearer to the jump: how many edges run along the lines is each soup's own affair.",
                        "order/triangle-soup-small/stratified line",
                        Expected::Figure {
                            value: -1.125,
                            tolerance: 0.125,
                            none: None,
                        },
                    )
                }
                _ => found,
            });
        }
    }
    all
}

/// The order of points where an edge is before the light.
const JUMP: Expected = Expected::Figure {
    value: -0.75,
    tolerance: 0.05,
    none: Some(-0.5),
};

/// Why orders on our scenes may differ from the paper's.
const SCENES: &str = "our scenes are rebuilt: half of what the column differs by over the paper's own scenes without the logo, whose lobe is its own";

/// Half the range of a column over the paper's scenes but the logo, both sizes of light.
fn tolerance(column: &str) -> f64 {
    let Some(k) = COLUMNS.iter().position(|(name, ..)| *name == column) else {
        return 0.0;
    };
    let orders = TABLE.iter().filter(|row| !row.0.starts_with("logo"));
    let orders = orders.map(|row| row.2[k]);
    let high = orders.clone().fold(f64::NEG_INFINITY, f64::max);
    let low = orders.fold(f64::INFINITY, f64::min);
    0.5 * (high - low)
}

fn samples_and_time() -> Vec<Claim> {
    let mut all = Vec::new();
    for (size, places) in [
        ("small", ["Fig. 13", "Fig. 11"]),
        ("large", ["Fig. 9", "Fig. 7"]),
    ] {
        for column in ["random point", "random line"] {
            let says = format!(
                "σ falls as N to the −1/2 by {column} samples on all scenes with {size} lights."
            );
            let id = format!("{column}, {size}");
            let why =
                "theory, whatever the integrand; what the paper's own table is off at most: 0.034";
            all.push(claim(id, places[0], says).just(-0.5, 0.035, why));
        }
        let says = format!(
            "The squared error of random lines is below that of as many points on all scenes with {size} lights."
        );
        let id = format!("error at equal samples, {size}");
        all.push(claim(id, places[1], says).at_most(
            1.0,
            "an ordering: the worst scene, over all numbers of samples",
        ));
    }
    all
}

fn theory() -> Vec<Claim> {
    let rough = "a jump along a curve is met by √N of N strata: −3/4 exactly, the rest is the edge's place in the pattern";
    vec![
        claim(
            "unhidden/random point",
            "§3, eq. 2",
            "The standard deviation of independent samples falls as N to the −1/2.",
        )
        .just(-0.5, 0.01, "theory, whatever N; two standard errors of a fit of 12 trials"),
        claim(
            "unhidden/stratified point",
            "§3",
            "Stratified points of a smooth integrand in two dimensions: −1/2 − 1/s = −1.",
        )
        .figure(-1.0, -0.5, 0.05, THEORY),
        claim(
            "unhidden/stratified line",
            "§3",
            "Stratified lines of a smooth integrand, of one dimension: −1/2 − 1/s = −3/2.",
        )
        .figure(-1.5, -0.5, 0.05, THEORY),
        claim(
            "half hidden/as printed",
            "§3",
            "Stratified points of a piecewise continuous integrand: −1/2 − 1/s = −1, as the text prints it.",
        )
        .by("half hidden/stratified point")
        .figure(-1.0, -0.5, 0.05, rough)
        .recorded(Verdict::Weaker)
        .because_of(
            "The text prints the exponent of smooth integrands twice; Mitchell's is −1/2 − 1/(2s), −3/4 in two dimensions.",
            "half hidden/stratified point",
            JUMP,
        ),
        claim(
            "half hidden/stratified point",
            "§3, after Mitchell 1996",
            "Stratified points of a piecewise continuous integrand: −1/2 − 1/(2s) = −3/4.",
        )
        .figure(-0.75, -0.5, 0.05, rough),
        claim(
            "half hidden/stratified line",
            "§3 and §7",
            "With an edge before the light lines still have an order of −1 or better, from one dimension less.",
        )
        .at_most(-1.0, "the order of a jump in one dimension"),
        claim(
            "half hidden/random line",
            "§6.1",
            "Independent lines have an order of −1/2, too.",
        )
        .just(-0.5, 0.02, "theory, whatever N; two standard errors of a fit of 12 trials"),
    ]
}

fn expectations() -> Vec<Claim> {
    vec![
        claim(
            "unhidden/low-discrepancy point",
            "§3, Koksma–Hlawka",
            "Low-discrepancy points of a smooth integrand are at least as good as (log N)²/N.",
        )
        .at_most(-0.65, "the slope of (log N)²/N from 4 to 1024: −1 + 2 ln(10/2)/ln 256 = −0.42, and half of the way to −1 beyond it"),
        claim(
            "bias of all",
            "§4, §5.1 and eq. 2",
            "Lines of any direction and offset, and points, have the same expectation.",
        )
        .at_most(3.3, "z scores of ten estimators: P(any beyond 3.3) = 1 % if none is biased"),
        claim(
            "closed form over a point of a line",
            "§4",
            "Integrating a line takes variance from taking a point of it.",
        )
        .at_most(1.0, BETTER),
    ]
}

fn directions() -> Vec<Claim> {
    vec![
        claim(
            "direction/for each line",
            "§5.1.1, Fig. 2",
            "With a random direction for each line even stratified offsets give an order of −1/2 alone.",
        )
        .just(-0.5, 0.03, "what is left of the strata in the direction's light at the fewest lines"),
        claim(
            "unhidden/direction of each line",
            "§5.1.1",
            "The same where nothing is before the light: −1/2.",
        )
        .just(-0.5, 0.03, "as before"),
        claim(
            "direction/for each point",
            "§5.1.1, Fig. 2",
            "One random direction for each shading point keeps the higher order.",
        )
        .at_most(-1.0, "the order of a jump in one dimension, twice that of independent samples"),
        claim(
            "direction/fixed",
            "§5.1.1",
            "So does one direction for all points.",
        )
        .at_most(-1.0, "as before"),
        claim(
            "two edges/fixed",
            "§5.1.1, Fig. 2",
            "With one direction for all, noise at a shadow's edge depends on how the edge runs: nearly none on one side of a penumbra, much on the other.",
        )
        .at_least(2.0, "a difference that the eye sees"),
        claim(
            "two edges/for each point",
            "§5.1.1, Fig. 2",
            "With a direction for each point both edges are as noisy.",
        )
        .at_most(2.0, "less than is asked of a fixed direction"),
        claim(
            "offsets by length over uniform",
            "§5.1.2, Fig. 3",
            "On triangular lights offsets in proportion to the lines' lengths have less noise than uniform ones.",
        )
        .at_most(1.0, BETTER),
    ]
}

fn formulas() -> Vec<Claim> {
    vec![
        claim(
            "eq. 20 as printed",
            "Appendix A, eq. 20",
            "Eq. 20 is the light of a line on a diffuse surface.",
        )
        .at_most(1e-9, "a closed form has rounding alone, and the quadrature that it is held to 1e-11")
        .recorded(Verdict::Refuted)
        .because_of(
            "The first term lacks the factor F and the second has C + l where D + l belongs; with both mended it is exact.",
            "eq. 20 mended",
            Expected::AtMost(1e-9),
        ),
        claim(
            "eq. 24",
            "Appendix B, eqs. 15, 16 and 24",
            "The light of a line on a Phong lobe by the sine form and the recursion of powers of cosines.",
        )
        .at_most(1e-9, "as before"),
        claim(
            "growth of the recursion",
            "§6.1",
            "The recursion takes a time in proportion to the exponent.",
        )
        .just(1.0, 0.1, "power of the time from an exponent of 1,000 to 10,000; what comes before and after the loop")
        .timed(),
        claim(
            "density with its printed peak",
            "§5.1.2",
            "The triangular density of offsets is highest at the middle corner's place, with 2/A.",
        )
        .just(1.0, 1e-12, "a density integrates to one, but for rounding")
        .recorded(Verdict::Refuted)
        .because_of(
            "The base of the density's triangle is b − a and not the light's area: its height is 2/(b − a).",
            "density with its peak mended",
            Expected::Figure {
                value: 1.0,
                tolerance: 1e-12,
                none: None,
            },
        ),
    ]
}

fn visibility() -> Vec<Claim> {
    let scene = "how many more are tested depends on how much of the scene is before each light, and scenes are rebuilt: half of the paper's own figure";
    let mut all = Vec::new();
    for (name, boxes, triangles) in [
        ("grid planes", [1462.0, 1926.4], [136.3, 268.2]),
        ("triangle soup", [7686.7, 13848.6], [344.9, 1238.2]),
        ("Sponza", [7809.1, 53729.2], [1498.3, 21474.2]),
    ] {
        for (what, [small, large]) in [("boxes", boxes), ("triangles", triangles)] {
            let ratio: f64 = large / small;
            let says = format!(
                "The large light of {name} has {ratio:.2} times as many tests of {what} as the small one."
            );
            let id = format!("{what} for a large light/{name}");
            let found = claim(id, "Table 1", says).figure(ratio, 1.0, 0.5 * ratio, scene);
            all.push(match (name, what) {
                ("grid planes" | "triangle soup", _) => found,
                _ => found.recorded(Verdict::Stronger),
            });
        }
    }
    all.push(
        claim(
            "pieces/triangle soup over grid planes",
            "Fig. 5",
            "Many disjoint occluders cut a line into more pieces than the grids do.",
        )
        .at_least(1.0, BETTER),
    );
    all
}

fn times() -> Vec<Claim> {
    let mut all = Vec::new();
    for (scene, name, differs) in [
        (
            "triangle-soup-large",
            "the soup",
            Some([Verdict::Refuted, Verdict::Weaker]),
        ),
        ("colonnade-large", "Sponza", None),
    ] {
        let random = claim(
            format!("cost at random/{scene}"),
            "§6.1, Figs. 8 and 12",
            format!(
                "Random lines have the larger error for the same time on {name} with its large light."
            ),
        );
        let few = claim(
            format!("cost of few strata/{scene}"),
            "§6.1, Fig. 8",
            format!(
                "At first, with four samples, stratified points have the smaller error for their time on {name}."
            ),
        );
        for (k, claim) in [random, few].into_iter().enumerate() {
            let claim = claim.at_least(1.0, BETTER).timed();
            all.push(match differs {
                Some(verdicts) => claim.recorded(verdicts[k]).because_of(
                    "All lines of a point share one walk of the hierarchy: a line costs little more than a ray there.",
                    "time of a line/triangle-soup-large",
                    Expected::AtMost(3.0),
                ),
                None => claim,
            });
        }
    }
    for size in ["small", "large"] {
        let says = format!(
            "With 1024 samples stratified lines have overtaken stratified points for the same time on all scenes with {size} lights."
        );
        all.push(
            claim(
                format!("cost of many strata, {size}"),
                "§6.1, Figs. 8 and 12",
                says,
            )
            .at_most(1.0, "an ordering: the worst scene")
            .timed(),
        );
    }
    all
}

/// Which pattern the paper finds better for lines, by the orders of its Fig. 9.
fn ranking() -> Vec<Claim> {
    let mut all = Vec::new();
    for (scene, name, below) in [
        ("grid-planes-large", "grid planes", false),
        ("triangle-soup-large", "the soup", false),
        ("colonnade-large", "Sponza", true),
        ("logo-large", "the logo", true),
    ] {
        let claim = claim(
            format!("rank/{scene}"),
            "§6.1, Fig. 9",
            if below {
                format!("Low-discrepancy lines converge faster than stratified ones on {name}.")
            } else {
                format!("Low-discrepancy lines converge slower than stratified ones on {name}.")
            },
        );
        let claim = if below {
            claim.at_most(0.0, BETTER)
        } else {
            claim.at_least(0.0, BETTER)
        };
        all.push(claim.recorded(Verdict::Weaker).because_of(
            "Both are as good: our net is scrambled, and then of a ramp has the −3/2 of strata; as it is, without, it has −1, as the paper's on four of eight scenes.",
            "a ramp, scrambled",
            Expected::Figure {
                value: -0.5,
                tolerance: 0.1,
                none: None,
            },
        ));
    }
    all
}
