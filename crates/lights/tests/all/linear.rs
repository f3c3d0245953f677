//! These tests check the laws of the techniques for linear lights, for LTCs and for profiles.

use linelit_geometry::{DMat3, DVec3, Frame, Segment};
use linelit_lights::linear::{
    LinearSample, LinearSampler, LinearTechnique, LtcSampler, SegmentLtc,
};
use linelit_lights::{LinearPointTechnique, Pdf, ThinSolidAngle};
use linelit_shading::ltc::{LtcLobe, LtcMixture};
use linelit_testkit::cases::rng;
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::laws::Technique;
use linelit_testkit::quadrature::gauss_kronrod;
use std::f64::consts::PI;

struct Case {
    name: &'static str,
    light: Segment,
    x: DVec3,
    n: DVec3,
}

fn cases() -> Vec<Case> {
    let line = |a: [f64; 3], b: [f64; 3]| Segment::new(DVec3::from(a), DVec3::from(b));
    let case = |name, light, x, n| Case { name, light, x, n };
    let (o, up) = (DVec3::ZERO, DVec3::Z);
    let tilted = DVec3::new(0.48, 0.6, 0.64);
    let shift = DVec3::new(3e4, -1e5, 2e4);
    let ordinary = line([-1.0, 0.5, 1.0], [2.0, 0.5, 1.5]);
    let moved = Segment::new(ordinary.p0 + shift, ordinary.p1 + shift);
    vec![
        case("ordinary", ordinary, o, tilted),
        case(
            "below the horizon",
            line([-1.0, 0.5, -1.0], [2.0, 0.5, 1.5]),
            o,
            up,
        ),
        case(
            "tiny",
            line([0.5, 0.5, 1.0], [0.5 + 1e-6, 0.5, 1.0 + 1e-6]),
            o,
            tilted,
        ),
        case(
            "long and near",
            line([-1e3, 0.01, 0.01], [2e3, 0.01, 0.01]),
            o,
            up,
        ),
        case("grazing", line([1.0, -1.0, 1e-4], [1.0, 2.0, 2e-4]), o, up),
        case(
            "nearly collinear",
            line([1.0, 1e-4, 1.0], [2.0, 1e-4, 2.0001]),
            o,
            tilted,
        ),
        case("far from the origin", moved, shift, tilted),
    ]
}

impl Case {
    fn distance(&self, t: f64) -> f64 {
        (self.light.at(t) - self.x).length()
    }

    /// Distance h of the infinite line, and the fraction of the foot.
    fn foot(&self) -> (f64, f64) {
        let d = self.light.direction();
        let s = (self.x - self.light.p0).dot(d);
        let q = self.light.p0 - self.x + d * s;
        (q.length(), s / self.light.length())
    }

    /// ε of the whole line against its distance, and of the coordinates against its size.
    fn resolution(&self) -> f64 {
        let far = self.light.p0.abs().max_element();
        let l = self.light.length();
        f64::EPSILON * (1.0 + (l + far) / self.foot().0 + far / l)
    }

    /// Density per fraction of the light.
    fn per_fraction(&self, t: f64, pdf: Pdf<ThinSolidAngle>) -> f64 {
        pdf.to_length(self.distance(t), self.foot().0).value() * self.light.length()
    }
}

/// How hard a technique is looked at, and how well it does.
struct Level<'a> {
    samples: u32,
    alpha: f64,
    /// Where the density jumps.
    knots: &'a [f64],
    round_trip: f64,
}

/// The laws of places on the light, and that the parts of a sample agree.
fn laws(case: &Case, name: &str, level: &Level<'_>, technique: &impl LinearPointTechnique) {
    const BINS: usize = 48;
    // Cells bounded by fractions that are equally spaced in angle: a long light is dark but for its
    // near part.
    let (h, foot) = case.foot();
    let l = case.light.length();
    let angle = |t: f64| ((t - foot) * l / h).atan();
    let (a, b) = (angle(0.0), angle(1.0));
    let edge = |i: usize| match i {
        0 => 0.0,
        BINS => 1.0,
        _ => foot + (a + (b - a) * i as f64 / BINS as f64).tan() * h / l,
    };
    // The baseline by bisection is allowed what its differences lose, and finds its places to a
    // tolerance that its density does not know.
    let baseline = if name == "newton-bisection" {
        1e-5
    } else {
        0.0
    };
    let slack = 64.0 * case.resolution();
    Technique::new(format!("{name} on {}", case.name))
        .samples(level.samples as usize)
        .alpha(level.alpha)
        .seed(23)
        .cells((0..=BINS).map(edge).collect())
        .kinks(level.knots)
        .round_trip(level.round_trip)
        .resolution(0.0)
        // The distance of a point is resolved to ε of the coordinates, and enters cubed.
        .mass(baseline + 1e-9 + slack)
        .density(if baseline > 0.0 { f64::INFINITY } else { 3e-7 })
        .sure(if baseline > 0.0 { 0.0 } else { 0.2 })
        .check_1d(
            [0.0, 1.0],
            |u| {
                let s = technique.sample(u);
                let p = case.light.at(s.t) - case.x;
                let off = (p.normalize() - s.direction).length();
                assert!(
                    off < slack,
                    "{name} on {}: direction off by {off:e} > {slack:e}",
                    case.name
                );
                s.t
            },
            |t| case.per_fraction(t, technique.pdf(t)),
            |t| technique.invert(t),
        );
}

fn all_techniques(samples: u32) {
    let cases = cases();
    let alpha = sidak(0.01, cases.len() * LinearTechnique::ALL.len());
    for case in &cases {
        for technique in LinearTechnique::ALL {
            let s = LinearSampler::new(technique, &case.light, case.x, case.n).expect("visible");
            let name = technique.name();
            let [a, b] = s.view().range();
            let bisection = technique == LinearTechnique::NewtonBisection;
            let round_trip = if bisection {
                1e-4
            } else {
                64.0 * case.resolution()
            };
            let level = Level {
                samples,
                alpha,
                knots: &[a, b],
                round_trip,
            };
            laws(case, name, &level, &s);
        }
    }
}

#[test]
fn techniques_obey_the_laws() {
    all_techniques(50_000);
}

#[test]
#[ignore = "long: a million samples of each technique and light"]
fn techniques_obey_the_laws_long() {
    all_techniques(1_000_000);
}

#[test]
fn techniques_agree_on_the_irradiance() {
    // The mean of cos/pdf is the projected solid angle for every technique; for the last ones each
    // sample is.
    for case in &cases() {
        let exact = LinearSampler::new(
            LinearTechnique::ProjectedSolidAngle,
            &case.light,
            case.x,
            case.n,
        )
        .expect("visible");
        let of = |s: &LinearSample| case.n.dot(s.direction).max(0.0) / s.pdf.value();
        let want = of(&exact.sample(0.5));
        let whole = exact.irradiance().expect("known") / want;
        let slack = 1e-9 + 256.0 * case.resolution();
        assert!((whole - 1.0).abs() < slack, "{}: {whole}", case.name);
        for technique in LinearTechnique::ALL {
            let s = LinearSampler::new(technique, &case.light, case.x, case.n).expect("visible");
            // What is known is the same, and what is not known is no number.
            let knows = matches!(
                technique,
                LinearTechnique::ProjectedSolidAngle | LinearTechnique::NewtonBisection
            );
            assert_eq!(s.irradiance().is_some(), knows, "{technique:?}");
            let f = |t: f64| {
                let p = (case.light.at(t) - case.x).normalize();
                let pdf = s.pdf(t);
                if pdf.is_positive() {
                    case.n.dot(p).max(0.0) * case.per_fraction(t, pdf) / pdf.value()
                } else {
                    0.0
                }
            };
            let [a, b] = s.view().range();
            let (_, foot) = case.foot();
            let clip = exact.view().range();
            let mut cuts = vec![a, b, foot.clamp(a, b)];
            cuts.extend(clip.iter().map(|c| c.clamp(a, b)));
            cuts.sort_by(f64::total_cmp);
            let got: f64 = cuts
                .windows(2)
                .map(|c| gauss_kronrod(f, c[0], c[1], 1e-11).value)
                .sum();
            let bisection = technique == LinearTechnique::NewtonBisection;
            let baseline = if bisection { 1e-5 } else { 0.0 };
            let slack = baseline + 1e-9 + 256.0 * case.resolution();
            let known = s.irradiance().map_or(1.0, |whole| whole / want);
            assert!((known - 1.0).abs() < slack, "{}: {known}", case.name);
            assert!(
                (got / want - 1.0).abs() < slack,
                "{} on {}: {got} {want}",
                technique.name(),
                case.name
            );
        }
        for i in 0..1000 {
            let s = exact.sample((f64::from(i) + 0.5) / 1000.0);
            let cosine = case.n.dot(s.direction);
            let slack = 64.0 * case.resolution() * (1.0 + 1.0 / cosine);
            assert!((of(&s) / want - 1.0).abs() < slack, "{}: {i}", case.name);
        }
    }
}

#[test]
fn batches_are_the_samples() {
    let xi: Vec<f64> = (0..37).map(|i| (f64::from(i) + 0.5) / 37.0).collect();
    for case in &cases() {
        for technique in LinearTechnique::ALL {
            let s = LinearSampler::new(technique, &case.light, case.x, case.n).expect("visible");
            let mut out = [LinearSample::default(); 40];
            s.sample_into(&xi, &mut out);
            for (got, &xi) in out.iter().zip(&xi) {
                let want = s.sample(xi);
                // Lanes may take a step more than they need: rounding, in ξ.
                let slack = 64.0 * case.resolution();
                let back = |q: &LinearSample| s.invert(q.t).expect("on the light");
                assert!(
                    (back(got) - back(&want)).abs() < slack,
                    "{} on {}",
                    technique.name(),
                    case.name
                );
                assert!((got.direction - want.direction).length() < 64.0 * slack);
                let ratio = got.pdf.value() / want.pdf.value();
                let of_cosine = 64.0 * slack / case.n.dot(want.direction).abs();
                assert!((ratio - 1.0).abs() < of_cosine, "{}: {ratio}", case.name);
            }
            assert_eq!(out[37..], [LinearSample::default(); 3]);
        }
    }
}

/// Peters' worst case, found by `cargo xtask accuracy`, and what the third step makes of it.
#[test]
fn the_worst_case_of_two_steps() {
    use linelit_lights::linear::ProjectedLine;
    let (nu, phi, xi) = (
        -8.106_508e-5_f64,
        [1.568_100_523_344, 1.570_743_755_088_f64],
        0.998_025_307_227,
    );
    let [a, b] = phi.map(|p: f64| DVec3::new(p.tan(), 1.0, 0.0));
    let line = ProjectedLine::new(a, b, DVec3::new(nu.sin(), nu.cos(), 0.0)).expect("visible");
    let error = |steps| (line.cdf(line.angle_steps(xi, steps)) - xi).abs();
    // The paper: 1.58e-5 after two steps from 28 billion starts.
    assert!((1.57e-5..1.58e-5).contains(&error(2)), "{}", error(2));
    assert!(
        error(3) < 2.2e-7 && error(4) < 1e-10,
        "{} {}",
        error(3),
        error(4)
    );
}

#[test]
fn degenerate_lights_give_nothing() {
    let (o, up) = (DVec3::ZERO, DVec3::Z);
    let lights = [
        Segment::new(DVec3::ONE, DVec3::ONE),
        Segment::new(DVec3::Z, 2.0 * DVec3::Z),
        Segment::new(-DVec3::Z, DVec3::Z),
        Segment::new(o, DVec3::X),
        Segment::new(DVec3::NAN, DVec3::X),
    ];
    for light in lights {
        for technique in LinearTechnique::ALL {
            assert!(
                LinearSampler::new(technique, &light, o, up).is_none(),
                "{technique:?} {light:?}"
            );
        }
    }
    let below = Segment::new(DVec3::new(1.0, 0.0, -1.0), DVec3::new(0.0, 1.0, -2.0));
    for technique in &LinearTechnique::ALL[2..] {
        assert!(LinearSampler::new(*technique, &below, o, up).is_none());
    }
    assert!(LtcSampler::new(&below, o, up, DMat3::IDENTITY).is_none());
    let above = Segment::new(DVec3::new(1.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 2.0));
    assert!(LtcSampler::new(&above, o, up, DMat3::ZERO).is_none());
}

/// p_M(ω) by its definition.
fn ltc_density(m: DMat3, w: DVec3) -> f64 {
    let c = m.inverse() * w;
    let r = c.length();
    (c.z / r).max(0.0) / (PI * m.determinant().abs() * r * r * r)
}

#[test]
fn ltc_obeys_the_laws() {
    ltc_fits(20_000);
}

#[test]
#[ignore = "long: a million samples of each cosine on each light"]
fn ltc_obeys_the_laws_long() {
    ltc_fits(1_000_000);
}

#[allow(clippy::too_many_lines, reason = "one case after the other")]
fn ltc_fits(samples: u32) {
    let matrices = [
        DMat3::IDENTITY,
        DMat3::from_cols(
            DVec3::new(0.3, 0.0, 0.1),
            DVec3::new(0.0, 0.2, 0.0),
            DVec3::new(-0.4, 0.0, 1.0),
        ),
        DMat3::from_cols(
            DVec3::new(0.05, 0.01, 0.0),
            DVec3::new(0.0, 0.08, 0.02),
            DVec3::new(0.5, 0.3, 1.0),
        ),
    ];
    let all = cases();
    let cases = [&all[0], &all[1], &all[3], &all[6]];
    let alpha = sidak(0.01, 12);
    let mut seen = 0;
    for case in cases {
        for m in matrices {
            // Cosine space is given around the shading normal.
            let f = Frame::from_normal(case.n);
            let m = DMat3::from_cols(f.x, f.y, f.z) * m;
            let Some(s) = LtcSampler::new(&case.light, case.x, case.n, m) else {
                continue;
            };
            seen += 1;
            let density = |t: f64| {
                let p = case.light.at(t) - case.x;
                let upper = if case.n.dot(p) > 0.0 { 1.0 } else { 0.0 };
                // ∫ over the thin strip: dω/R = 2h/r³ dt.
                let (r, l) = (p.length(), case.light.length());
                upper * ltc_density(m, p / r) * 2.0 * case.foot().0 / (r * r * r) * l
            };
            // Where the light meets the horizons.
            let cut = |g: DVec3| {
                let (a, b) = (g.dot(case.light.p0 - case.x), g.dot(case.light.p1 - case.x));
                (a / (a - b)).clamp(0.0, 1.0)
            };
            let knots = [cut(case.n), cut(m.inverse().transpose() * DVec3::Z)];
            let mut cuts = vec![0.0, 1.0, case.foot().1.clamp(0.0, 1.0)];
            cuts.extend(knots);
            cuts.sort_by(f64::total_cmp);
            let want: f64 = cuts
                .windows(2)
                .map(|c| gauss_kronrod(density, c[0], c[1], 1e-11).value)
                .sum();
            let slack = 1e-8 + 256.0 * case.resolution();
            assert!(
                (s.integral() / want - 1.0).abs() < slack,
                "{}: {} {want}",
                case.name,
                s.integral()
            );
            for i in 0..50 {
                let q = s.sample((f64::from(i) + 0.5) / 50.0);
                let want = density(q.t) / (s.integral() * case.per_fraction(q.t, Pdf::new(1.0)));
                assert!(
                    (q.pdf.value() / want - 1.0).abs() < slack * 1e3,
                    "{}: {q:?} {want}",
                    case.name
                );
            }
            let level = Level {
                samples,
                alpha,
                knots: &knots,
                round_trip: 1e3 * case.resolution(),
            };
            laws(case, "ltc", &level, &s);
        }
    }
    assert!(seen >= 8, "{seen} of 12 see the light");
}

/// Samples of lobes together follow their density, and what they reflect is the sum of each.
#[test]
#[allow(clippy::cast_possible_truncation, reason = "few bins")]
fn lobes_follow_their_density() {
    const SAMPLES: u64 = 20_000;
    let case = &cases()[0];
    let frame = Frame::from_normal(case.n);
    let mut cosines = LtcMixture::new(frame, DVec3::ONE);
    let mut want = DVec3::ZERO;
    for (width, albedo) in [(0.2, DVec3::X), (0.8, DVec3::new(0.1, 0.5, 0.0))] {
        let map = DMat3::from_cols(DVec3::X * width, DVec3::Y, DVec3::Z);
        cosines.add(LtcLobe { map, albedo });
        let map = DMat3::from_cols(frame.x, frame.y, frame.z) * map;
        let lobe = LtcSampler::new(&case.light, case.x, case.n, map).expect("visible");
        want += albedo * lobe.integral();
    }
    let lobes = SegmentLtc::new(&case.light, case.x, case.n, &cosines).expect("visible");
    assert_eq!(lobes.reflected, want);
    let (mut observed, mut rng) = ([0_u64; 16], rng(24));
    for _ in 0..SAMPLES {
        let sample = lobes.sample(rng.next_f64());
        assert_eq!(sample.pdf, lobes.pdf(sample.t));
        observed[(sample.t * 16.0) as usize] += 1;
    }
    let density = |t: f64| case.per_fraction(t, lobes.pdf(t)) * SAMPLES as f64;
    let edge = |i: u32| f64::from(i) / 16.0;
    let mass = |i| gauss_kronrod(density, edge(i), edge(i + 1), 1e-6).value;
    let expected: Vec<f64> = (0..16).map(mass).collect();
    let sum = expected.iter().sum::<f64>() / SAMPLES as f64;
    assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    let test = chi2_test(&observed, &expected, 5.0);
    assert!(test.p_value > 0.01, "{test:?}");
}
