//! Claims of Peters 2021.

use super::super::claim::{Claim, Expected, Paper, Verdict};
use super::BETTER;

/// All of them.
pub(super) fn claims() -> Vec<Claim> {
    let mut all = formulas();
    all.extend(diffuse());
    all.extend(gloss());
    all.extend(costs());
    all
}

fn claim(id: impl Into<String>, place: &'static str, says: impl Into<String>) -> Claim {
    Claim::new(Paper::Peters, id, place, says)
}

fn formulas() -> Vec<Claim> {
    let exact = "a closed form has rounding alone, and the quadrature that it is held to 1e-11";
    vec![
        claim(
            "backward error of two steps",
            "§3.4",
            "After two steps the worst backward error of all lines and random numbers is 1.58e-5.",
        )
        .just(1.58e-5, 0.04e-5, "a search finds the worst from below: what one of 24 million starts without a climb misses"),
        claim(
            "eq. 1 of Peters",
            "§3.1, eq. 1",
            "The solid angle of a thin cylinder is 2R/‖q‖ times what its ends differ by.",
        )
        .at_most(1e-9, exact),
        claim(
            "eq. 2 of Peters",
            "§3.2, eqs. 2 and 3",
            "The antiderivative of eq. 3 gives its projected solid angle.",
        )
        .at_most(1e-9, exact),
        claim(
            "eq. 5 of Peters",
            "§4.1, eq. 5",
            "The factor of eq. 5 accounts for what a linear transformation does to a cylinder's radius.",
        )
        .at_most(1e-9, exact),
        claim(
            "square root of Peters",
            "§3.3, Fig. 3",
            "The inverse distribution of a normal along the line is a square root.",
        )
        .at_most(1e-15, "rounding: four ulps of one"),
        claim(
            "Fig. 4/raw, worst",
            "§3.4, Fig. 4a",
            "In single precision rounding can be far more than the error of two steps.",
        )
        .at_least(1.58e-5, "the error of two steps"),
        claim(
            "Fig. 4/times brightness",
            "§3.4, Fig. 4b",
            "Times the brightness the error is always low.",
        )
        .at_most(1e-3, "a change of a random number that no eye sees: a quarter of a step of eight bits"),
    ]
}

/// As good as the same.
const THOUSANDTH: Expected = Expected::Figure {
    value: 1.0,
    tolerance: 1e-3,
    none: None,
};

fn diffuse() -> Vec<Claim> {
    let of = |id: &str, place, says: &str| claim(format!("Fig. 6/{id}"), place, says);
    vec![
        of("solid angle over area", "Fig. 6", "Sampling by solid angle is far better than by area.")
            .at_most(0.5, "\"far\": half the error or less"),
        of("clipped over solid angle", "Fig. 6", "Clipping at the horizon takes noise away.")
            .at_most(0.9999, "an ordering: some of it")
        .recorded(Verdict::Weaker)
        .because_of(
            "It matters where the light's horizon cuts a face that is seen; at the pixels of our room it changes the error by less than a thousandth.",
            "Fig. 6/clipped over solid angle",
            THOUSANDTH,
        )
        .but_in_full(
            Verdict::Confirmed,
            "At the figure's own resolution it is as little, a ten-thousandth, but just beyond the bound in place of just short of it.",
            Some(("Fig. 6/clipped over solid angle", THOUSANDTH)),
        ),
        of("linear over clipped", "Fig. 6e", "The linear cosine warp has a worse RMSE than clipped solid angle alone, by what it does near the light.")
            .at_least(1.0, BETTER),
        of("quadratic over clipped", "Fig. 6f", "The quadratic warp helps.")
            .at_most(1.0, BETTER),
        of("quadratic over linear", "Fig. 6", "The quadratic warp is better than the linear one.")
            .at_most(1.0, BETTER),
        of("clear, quadratic over clipped", "Fig. 6f", "The quadratic warp helps outside of penumbrae, too.")
            .at_most(1.0, BETTER),
        of("projected over quadratic", "Fig. 6", "Projected solid angle is better than the quadratic warp.")
            .at_most(1.0, BETTER),
        of("projected over Newton-bisection", "Fig. 6g", "Newton-bisection gives the same picture.")
            .just(1.0, 0.01, "the same densities: the errors of both inversions, 1.6e-5 and rounding, move few samples over an edge"),
        of("outside penumbrae", "Fig. 6h", "Projected solid angle has no variance outside of penumbrae.")
            .at_most(1e-5, "film is f32: the relative error of one pixel, and of its backward error in the worst"),
        of("within penumbrae", "§5.1", "Within penumbrae it is no great help.")
            .just(1.0, 0.3, "\"not significantly\": within a third"),
    ]
}

fn gloss() -> Vec<Claim> {
    let one = |id: &str, says: &str| claim(format!("Fig. 1/{id}"), "Fig. 1", says);
    let seven = |id: &str, says: &str| claim(format!("Fig. 7 of Peters/{id}"), "Fig. 7", says);
    vec![
        one("projected over clipped", "One sample by projected solid angle has a smaller RMSE than one by clipped solid angle.")
            .at_most(1.0, BETTER)
        .recorded(Verdict::Refuted)
        .because_of(
            "The puddles have most of the error, and on gloss projected solid angle is the worse of both; on diffuse surfaces it is the better.",
            "Fig. 1/projected over clipped, gloss",
            Expected::AtLeast(1.0),
        ),
        one("projected over clipped, diffuse", "It does on diffuse surfaces.")
            .at_most(1.0, BETTER),
        one("LTC over two projected", "A second sample by an LTC takes more away than a second one by projected solid angle.")
            .at_most(1.0, BETTER),
        one("LTC over two projected, gloss", "In the puddle, drastically.")
            .at_most(0.5, "\"drastically\": half the error or less"),
        one("LTC over two clipped", "Projected solid angle and LTC have a smaller RMSE than two samples by clipped solid angle.")
            .at_most(1.0, BETTER),
        one("clamped optimal over balance", "Clamped optimal weights are better than the balance heuristic.")
            .at_most(1.0, BETTER),
        claim(
            "Fig. 1/projected over clipped, gloss",
            "§5.2",
            "On gloss projected solid angle alone remains noisy: no better than clipped solid angle.",
        )
        .at_least(1.0, BETTER),
        seven("jittered over independent", "Uniform jitter takes variance from penumbrae.")
            .at_most(1.0, BETTER),
        seven("blue over white", "Blue noise leaves the variance of independent samples as it is.")
            .just(1.0, 0.03, "the same distribution at each pixel: what five pictures tell"),
        seven("blurred, blue over white", "Blue noise moves it to high frequencies: less is left after a blur.")
            .at_most(1.0, BETTER),
        seven("blurred, both over neither", "Both together leave the least.")
            .at_most(0.5, "half the error or less, as of the picture"),
    ]
}

/// A claim of Table 1: a ratio of times.
fn cost(id: &str, says: &str, ratio: f64) -> Claim {
    let machine = "ratios of a graphics processor's times beside one core's: half of what the paper's is above one";
    let tolerance = 0.5 * (ratio - 1.0).abs();
    let id = format!("Table 1/{id}");
    claim(id, "Table 1", says)
        .figure(ratio, 1.0, tolerance, machine)
        .timed()
}

fn costs() -> Vec<Claim> {
    let [area, li, ours] = [[0.47, 0.41], [10.0, 5.2], [4.4, 2.05]];
    let above = |k: usize| (li[k] - area[k]) / (ours[k] - area[k]);
    let mut all = vec![
        cost(
            "Newton-bisection at equal error, light",
            "Above what sampling by area takes, Newton-bisection takes 2.42 times as long for each light as two steps do.",
            above(0),
        ),
        cost(
            "Newton-bisection at equal error, sample",
            "And 2.92 times as long for each sample.",
            above(1),
        )
        .recorded(Verdict::Weaker)
        .because_of(
            "Twice as long, not thrice: a core's iterations end one by one, where lanes of a graphics processor wait for the last.",
            "Table 1/Newton-bisection at equal error, sample",
            Expected::AtLeast(1.5),
        ),
        cost(
            "clipping above area, light",
            "Above sampling by area, clipping takes 2.93 times as long for each light as solid angle without it.",
            (1.29 - 0.47) / (0.75 - 0.47),
        )
        .recorded(Verdict::Weaker)
        .because_of(
            "Clipping does take longer, by less: of what a core takes above sampling by area the roots of the solid angle are the larger part.",
            "Table 1/clipping above area, light",
            Expected::Figure {
                value: 1.5,
                tolerance: 0.5,
                none: None,
            },
        ),
        cost(
            "solid angle under area, sample",
            "A sample by area takes 2.4 times as long as one by solid angle.",
            0.41 / 0.17,
        )
        .recorded(Verdict::Refuted)
        .because_of(
            "The paper's are above a baseline that draws by area itself, so that its row for area is the density alone; ours are whole samples, and one by solid angle takes a root and a division more.",
            "Table 1/clipping, sample",
            Expected::Figure {
                value: 1.0,
                tolerance: 0.25,
                none: None,
            },
        ),
    ];
    all.extend(costs_of_rectangles());
    all.extend(costs_side_by_side());
    all
}

fn costs_of_rectangles() -> Vec<Claim> {
    vec![
        cost(
            "rectangle, light",
            "The solid angle of a rectangle takes 4.9 times as long as a line's for each light.",
            3.65 / 0.75,
        ),
        cost(
            "rectangle, sample",
            "And 6.5 times for each sample.",
            1.11 / 0.17,
        )
        .recorded(Verdict::Weaker)
        .because_of(
            "Whole samples, where the paper's are above its baseline: what both have in common brings the ratio down, and that for each light is the paper's.",
            "Table 1/rectangle, light",
            Expected::AtLeast(2.5),
        ),
        cost(
            "quad, light",
            "Projected solid angle of a quad takes 6.6 times as long as a line's for each light.",
            28.9 / 4.4,
        )
        .recorded(Verdict::Stronger),
        cost(
            "quad, sample",
            "And 5.6 times for each sample.",
            11.5 / 2.05,
        )
        .recorded(Verdict::Stronger),
    ]
}

fn costs_side_by_side() -> Vec<Claim> {
    vec![
        claim(
            "Table 1/clipping, sample",
            "Table 1",
            "A clipped sample costs as much as one that is not.",
        )
        .just(1.0, 0.25, "the same code: what a core's times differ by").timed(),
        claim(
            "Table 1/quadratic, light",
            "§5.4, Table 1",
            "The quadratic warp takes about as long for a light as projected solid angle does.",
        )
        .just(4.78 / 4.4, 0.5, "\"similarly\"").timed(),
        claim(
            "Table 1/linear, light",
            "§5.4, Table 1",
            "The linear warp is faster, for each light.",
        )
        .at_most(1.0, BETTER).timed(),
        claim(
            "Table 1/linear, sample",
            "§5.4, Table 1",
            "And for each sample.",
        )
        .at_most(1.0, BETTER).timed(),
        claim(
            "Fig. 1/milliseconds",
            "Fig. 1",
            "Frames of 1.1, 1.1 and 1.5 ms at 1920 × 1080.",
        )
        .recorded(Verdict::NotMeasurable)
        .because("Milliseconds of one graphics processor; ours is a renderer of general processors."),
        claim(
            "Table 1/divergence",
            "§5.4, Table 1",
            "On a scene with much geometry Newton-bisection takes 4.5 times as long for each sample, by divergent execution.",
        )
        .recorded(Verdict::NotMeasurable)
        .because("Lanes that wait for each other are a graphics processor's: a core's iterations wait for no other point's."),
    ]
}
