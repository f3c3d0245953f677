//! Claims of Shirley & Wang 1991.

use super::super::claim::{Claim, Expected, Paper, Verdict};
use super::BETTER;

fn claim(id: impl Into<String>, place: &'static str, says: impl Into<String>) -> Claim {
    Claim::new(Paper::Shirley, id, place, says)
}

/// All of them.
pub(super) fn claims() -> Vec<Claim> {
    let mut all = densities();
    all.extend(choices());
    all.extend(probabilities());
    all
}

fn densities() -> Vec<Claim> {
    vec![
        claim(
            "secondary estimators",
            "§2",
            "The mean of several primary estimators has less variance: σ falls as N to the −1/2.",
        )
        .by("unhidden/random point")
        .just(-0.5, 0.01, "theory, whatever N; two standard errors of a fit of 12 trials"),
        claim(
            "proxy triangle, overhead",
            "§2",
            "Points uniform on a triangle at unit distance that covers the same solid angle are better than points uniform on the light.",
        )
        .at_most(1.0, BETTER),
        claim(
            "proxy triangle, grazing over overhead",
            "§2",
            "The more so at grazing angles to the light.",
        )
        .at_most(1.0, BETTER),
        claim(
            "wasted on the far side/far",
            "§2",
            "Of points uniform on a sphere at least half face away.",
        )
        .at_least(0.5, BETTER),
        claim(
            "wasted on the far side/near",
            "§2",
            "The nearer the sphere, the more: a point at 1.2 radii does not see (1 + 1/1.2)/2 of it.",
        )
        .just(0.5 + 0.5 / 1.2, 1e-4, "points on the rim of a count of 100,000"),
        claim(
            "visible over whole sphere",
            "§2, Figs. 2 and 3",
            "Points uniform on the part of a sphere that is seen are better than on all of it.",
        )
        .at_most(1.0, BETTER),
        claim(
            "solid angle over visible",
            "§2, Figs. 2 and 3",
            "Points uniform in its solid angle are better still.",
        )
        .at_most(1.0, BETTER),
    ]
}

fn choices() -> Vec<Claim> {
    vec![
        claim(
            "2 luminaires, 1 rays: one over all",
            "Figs. 5 and 6",
            "With two luminaires one shadow ray for both makes little difference.",
        )
        .at_most(1.5, "√2 and a little: variances of half the rays, the same probabilities")
        .recorded(Verdict::Refuted)
        .because_of(
            "The choice of a luminaire has noise of its own beside that of half the rays; of 32 the difference is several times as large.",
            "2 beside 32 luminaires",
            Expected::AtMost(0.5),
        ),
        claim(
            "2 luminaires, 100 rays: one over all",
            "Fig. 6",
            "With a hundred rays a pixel, too.",
        )
        .at_most(1.5, "as before")
        .recorded(Verdict::Refuted)
        .because_of(
            "Edges within pixels, which are in both, add little to the noise of two luminaires' shadows: the difference is nearly that of one ray.",
            "2 luminaires, 1 rays: one over all",
            Expected::AtLeast(1.5),
        ),
        claim(
            "32 luminaires, 1 rays: one over all",
            "Fig. 7",
            "With 32 luminaires and one ray a pixel a shadow ray for each has much less noise than one for all.",
        )
        .at_least(2.0, "\"much\": twice"),
        claim(
            "32 luminaires, 100 rays: one over all",
            "Fig. 8",
            "With a hundred rays a pixel both have little noise: the one's is not much more, as edges have as much in both.",
        )
        .at_most(2.0, "less than is asked of one ray a pixel")
        .recorded(Verdict::Refuted)
        .because_of(
            "Edges bring both together, to less than half of the difference that one ray makes; shadows by one ray for all still have more noise than they.",
            "100 rays beside 1",
            Expected::AtMost(0.5),
        ),
    ]
}

fn probabilities() -> Vec<Claim> {
    vec![
        claim(
            "shadow rays saved",
            "Fig. 8",
            "It takes 100 shadow rays a pixel in place of 3200.",
        )
        .just(32.0, 1e-12, "a count"),
        claim(
            "Fig. 9",
            "Fig. 9",
            "Probabilities by what each luminaire may give have considerably less noise than equal ones.",
        )
        .at_most(0.8, "\"considerably\": a fifth less"),
        claim(
            "Fig. 10/centres",
            "Fig. 10",
            "Probabilities by the luminaires' centres lose light where a centre is not seen and the rest is.",
        )
        .at_least(1.0, "a pixel that lost light"),
        claim(
            "Fig. 10/random points, light missing",
            "§3, Fig. 10",
            "No light is lost if a probability vanishes only where no point can give any.",
        )
        .just(0.0, 0.005, "noise of 1024 rays a pixel"),
        claim(
            "hidden bright light",
            "§5",
            "A bright light that gives nothing takes most of the rays: noise is far larger than without it.",
        )
        .at_least(2.0, "\"poorly\": twice the noise"),
    ]
}
