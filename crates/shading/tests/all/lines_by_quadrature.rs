//! Every closed form along a line against adaptive quadrature of what it is defined as, on ordinary
//! and on hostile input.
//!
//! The points of the line are in double-double arithmetic, so that the integrand is right to some
//! roundings however near the line passes, and the line is divided at the point nearest to the
//! shading point, at each horizon, and where the lobe is highest, towards each of which the pieces
//! become smaller by halves.

use crate::accuracy;
use crate::polygons_by_quadrature::facets;
use linelit_geometry::{DMat3, DVec3, Frame};
use linelit_shading::ltc::Ltc;
use linelit_shading::quadrature::{self, Model};
use linelit_shading::{cylinder, phong, ribbon, spherical_gaussian};
use linelit_testkit::assert_close;
use linelit_testkit::cases::cases;
use linelit_testkit::dd::Dd;
use linelit_testkit::quadrature::gauss_kronrod_to;
use linelit_testkit::real::{Real, cross, dot, length, sub, vector};
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::strategies::unit_vector;
use proptest::prelude::*;

/// The pieces next to a division are 2 to the minus this of the whole; smooth from there on.
const HALVINGS: i32 = 50;

/// A point of the line, and its distance.
struct Seen {
    p: [Dd; 3],
    r: Dd,
}

impl Seen {
    /// The part of a vector along the point's direction, not below zero.
    fn cosine(&self, k: DVec3) -> f64 {
        let k = vector::<Dd>(k.to_array());
        (dot(&k, &self.p) / self.r).to_f64().max(0.0)
    }

    fn distance(&self) -> f64 {
        self.r.to_f64()
    }

    fn direction(&self) -> DVec3 {
        DVec3::from_array(self.p.map(|x| (x / self.r).to_f64()))
    }
}

/// The line as its nearest point, direction, distance, and the ends by length from the former.
struct Line {
    nearest: [Dd; 3],
    along: [Dd; 3],
    distance: Dd,
    ends: [Dd; 2],
}

impl Line {
    fn new(p0: DVec3, p1: DVec3) -> Self {
        let [a, b] = [p0, p1].map(|p| vector::<Dd>(p.to_array()));
        let edge = sub(&b, &a);
        let size = length(&edge);
        let along = edge.map(|x| x / size);
        // By the cross product: a − (a·τ) τ would keep a rounding of the ends' distance.
        let area = cross(&a, &b).map(|x| x / size);
        Self {
            nearest: cross(&along, &area),
            along,
            distance: length(&area),
            ends: [dot(&a, &along), dot(&b, &along)],
        }
    }

    /// ∫ f ds over the parts with k·p > 0 for all `planes`, and a bound of the error; divided also
    /// where each `axis` is nearest in direction.
    fn integral(&self, planes: &[DVec3], axes: &[DVec3], f: impl Fn(&Seen) -> f64) -> (f64, f64) {
        let zero = Dd::new(0.0);
        let mut marks = vec![self.ends[0], self.ends[1], zero];
        let parts = |k: &DVec3| {
            let k = vector::<Dd>(k.to_array());
            [dot(&k, &self.nearest), dot(&k, &self.along)]
        };
        marks.extend(planes.iter().map(|k| {
            let [up, rise] = parts(k);
            zero - up / rise
        }));
        marks.extend(axes.iter().map(|k| {
            let [up, rise] = parts(k);
            self.distance * self.distance * rise / up
        }));
        marks.retain(|s| *s >= self.ends[0] && *s <= self.ends[1]);
        marks.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
        let (mut value, mut error) = (0.0, 0.0);
        for pair in marks.windows(2).filter(|p| p[0] < p[1]) {
            let span = pair[1] - pair[0];
            for (from, sign) in [(pair[0], 1.0), (pair[1], -1.0)] {
                let at = |x: f64| {
                    let s = from + span * Dd::new(sign * x);
                    let p = [0, 1, 2].map(|i| self.nearest[i] + self.along[i] * s);
                    f(&Seen { p, r: length(&p) })
                };
                let ends = (1..=HALVINGS).map(|j| (0.5f64.powi(j + 1), 0.5f64.powi(j)));
                for (low, high) in ends.chain([(0.0, 0.5f64.powi(HALVINGS + 1))]) {
                    // What adds nothing to the sum so far is followed no further.
                    let least = 1e-16 * value / span.to_f64();
                    let e = gauss_kronrod_to(at, low, high, 1e-13, least);
                    value += e.value * span.to_f64();
                    error += e.error * span.to_f64();
                }
            }
        }
        (value, error)
    }
}

/// A line, a normal, another vector, an axis and an exponent.
#[derive(Clone, Copy, Debug)]
struct Input {
    ends: [DVec3; 2],
    n: DVec3,
    m: DVec3,
    axis: DVec3,
    k: f64,
}

fn input() -> impl Strategy<Value = Input> {
    let domain = prop::sample::select(&accuracy::LINE_DOMAINS[..]);
    (domain, any::<u64>(), any::<bool>()).prop_map(|(domain, seed, whole)| {
        let mut rng = SplitMix64::new(seed);
        let (a, b, n) = accuracy::lit_segment(domain, &mut rng);
        let towards = a.lerp(b, rng.next_f64()).normalize();
        let wide = if rng.next_f64() < 0.5 { 0.05 } else { 2.0 };
        let axis = (towards + accuracy::vector(&mut rng) * wide).normalize();
        let k = accuracy::log_uniform(&mut rng, -1.0, 3.0);
        Input {
            ends: [a, b],
            n,
            m: accuracy::vector(&mut rng),
            axis,
            k: if whole { k.floor() } else { k },
        }
    })
}

/// One closed form, by its name, and what it is defined as.
fn compare(name: &str, input: &Input, got: f64, goal: f64, (want, error): (f64, f64)) {
    // The integrand's own power: k times four roundings.
    let tolerance = error + (goal + 4.0 * f64::EPSILON * (input.k + 8.0)) * want;
    if want > 1e-230 {
        assert_close!(got, want, tolerance, "{name}: {input:?}");
    } else {
        // Where digits are lost below the range of numbers.
        assert!((0.0..1e-220).contains(&got), "{name}: {got:e} {input:?}");
    }
}

/// The published goals.
const DIFFUSE: f64 = 1e-13;
const LOBES: f64 = 1e-10;

proptest! {
    // Long runs reject more than the 1,024 lines that are allowed low above the horizon.
    #![proptest_config(ProptestConfig { cases: cases(160), max_global_rejects: 100_000, ..ProptestConfig::default() })]

    #[test]
    fn diffuse_forms(input in input()) {
        let Input { ends: [a, b], n, .. } = input;
        let line = Line::new(a, b);
        let h = line.distance.to_f64();
        let (value, error) = line.integral(&[n], &[n], |s| s.cosine(n) / s.distance().powi(3));
        compare("ribbon", &input, ribbon::line_integral(a, b, n), DIFFUSE, (value, error));
        compare("cylinder", &input, cylinder::irradiance(a, b, n), DIFFUSE, (2.0 * h * value, 2.0 * h * error));
        let solid = line.integral(&[], &[], |s| 2.0 * h / s.distance().powi(3));
        compare("solid_angle", &input, cylinder::solid_angle(a, b), DIFFUSE, solid);
    }

    #[test]
    fn phong_forms(input in input()) {
        let Input { ends: [a, b], n, m, axis, k } = input;
        let line = Line::new(a, b);
        let h = line.distance.to_f64();
        let power = |s: &Seen| {
            let z = s.cosine(axis);
            if z > 0.0 { z.powf(k) } else { 0.0 }
        };
        let (value, error) = line.integral(&[n, axis], &[axis], |s| s.cosine(n) * power(s) / s.distance().powi(3));
        compare("phong::ribbon", &input, phong::ribbon(a, b, n, axis, k), LOBES, (value, error));
        compare("phong::cylinder", &input, phong::cylinder(a, b, n, axis, k), LOBES, (2.0 * h * value, 2.0 * h * error));
        let half = line.integral(&[n, m, axis], &[axis], |s| s.cosine(n) * s.cosine(m) * power(s) / s.distance().powi(2));
        compare("phong::half_space", &input, phong::half_space(a, b, n, m, axis, k), LOBES, half);
    }

    #[test]
    fn gaussian_forms(input in input()) {
        let Input { ends: [a, b], n, axis, k, .. } = input;
        let line = Line::new(a, b);
        let h = line.distance.to_f64();
        let xi = vector::<Dd>(axis.to_array());
        let lobe = |s: &Seen| (Dd::new(k) * (dot(&xi, &s.p) / s.r - Dd::new(1.0))).to_f64().exp();
        let (value, error) = line.integral(&[n], &[axis], |s| s.cosine(n) * lobe(s) / s.distance().powi(3));
        compare("spherical_gaussian::ribbon", &input, spherical_gaussian::ribbon(a, b, n, axis, k), LOBES, (value, error));
        let got = spherical_gaussian::cylinder(a, b, n, axis, k);
        compare("spherical_gaussian::cylinder", &input, got, LOBES, (2.0 * h * value, 2.0 * h * error));
    }

    /// Of a width that is not zero at the far end, and of one that is at either.
    #[test]
    fn tapered_forms(input in input(), ends in prop::sample::select(vec![[0.0, 1.0], [1.0, 0.0], [0.3, 1.0]])) {
        let Input { ends: [a, b], n, axis, k, .. } = input;
        let line = Line::new(a, b);
        let size = line.ends[1] - line.ends[0];
        let width = |s: &Seen| {
            let [to, from] = [line.ends[1], line.ends[0]].map(|end| dot(&s.p, &line.along) - end);
            ends[0] * (-to / size).to_f64() + ends[1] * (from / size).to_f64()
        };
        let seen = |s: &Seen| width(s) * s.cosine(n) / s.distance().powi(3);
        let diffuse = line.integral(&[n], &[n], seen);
        compare("ribbon::tapered", &input, ribbon::tapered(a, b, n, ends), DIFFUSE, diffuse);
        let power = |s: &Seen| {
            let z = s.cosine(axis);
            if z > 0.0 { z.powf(k) } else { 0.0 }
        };
        let lobe = line.integral(&[n, axis], &[axis], |s| seen(s) * power(s));
        compare("phong::tapered", &input, phong::tapered(a, b, n, axis, k, ends), LOBES, lobe);
        let xi = vector::<Dd>(axis.to_array());
        let gauss = |s: &Seen| (Dd::new(k) * (dot(&xi, &s.p) / s.r - Dd::new(1.0))).to_f64().exp();
        let lobe = line.integral(&[n], &[axis], |s| seen(s) * gauss(s));
        let got = spherical_gaussian::tapered(a, b, n, axis, k, ends);
        compare("spherical_gaussian::tapered", &input, got, LOBES, lobe);
    }

    #[test]
    fn the_crates_own_quadrature(input in input()) {
        let Input { ends: [a, b], n, .. } = input;
        let line = Line::new(a, b);
        let h = line.distance.to_f64();
        // Smooth all along: no kink or peak that nodes may miss.
        let own = |model| quadrature::line(a, b, n, model, |w| DVec3::splat(1.0 + w.x * w.x), 1e-10, 100_000);
        let (value, error) = line.integral(&[n], &[n], |s| (1.0 + s.direction().x.powi(2)) * s.cosine(n) / s.distance().powi(3));
        for (model, factor) in [(Model::Ribbon, 1.0), (Model::Cylinder, 2.0 * h)] {
            let e = own(model);
            compare("quadrature::line", &input, e.value.x, 1e-8, (value * factor, error * factor + e.error));
        }
    }

    /// Transformed cosines over the value of their own density; the mapped ends are rounded, which
    /// counts for the more the nearer the line passes and the lower it is.
    #[test]
    fn transformed_cosines(input in input(), width in 0.05..1.0f64, skew in -0.5..0.5f64, roughness in 0.1..1.0f64, cosine in 0.05..1.0f64) {
        let Input { ends: [a, b], n, .. } = input;
        let frame = Frame::from_normal(n);
        let line = Line::new(a, b);
        let h = line.distance.to_f64();
        let m = DMat3::from_cols(DVec3::new(width, 0.0, 0.0), DVec3::new(0.0, 1.0, 0.0), DVec3::new(skew, 0.0, 1.0));
        let ltc = Ltc::new(m, 0.7);
        let fitted = facets(roughness, cosine);
        let sine = accuracy::sine(a, b);
        let low = [a, b].map(|p| (n.dot(p) / p.length()).abs());
        // 8 η with η = 7 roundings × the maps' condition, below 3/width and 1e4 (0.1 of roughness).
        let rounding = 8.0 * 7.0 * f64::EPSILON * 1e4 / sine / low[0].min(low[1]);
        prop_assume!(rounding < 1e-4);
        // Kinks: the lobes' own horizons.
        let own = |lobe: &Ltc| frame.to_world(lobe.map().inverse().transpose() * DVec3::Z);
        let horizons = [n, own(&ltc), own(&fitted)];
        let ours = |density: &dyn Fn(DVec3) -> f64| line.integral(&horizons, &[n], |s| {
            if s.cosine(n) > 0.0 { 2.0 * h / s.distance().powi(2) * density(frame.to_local(s.direction())) / s.distance() } else { 0.0 }
        });
        for ltc in [ltc, fitted] {
            let want = ours(&|w| ltc.albedo * ltc.density(w));
            compare("Ltc::line", &input, ltc.line(&frame, a, b), rounding, want);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(256), ..ProptestConfig::default() })]

    /// Lines that point at the shading point to the last bit are seen in one direction d: of r d
    /// from r = 1 to 4, ∫ dr/r³ is 15/32. A thin cylinder shows nothing.
    #[test]
    fn lines_that_point_at_the_point(d in unit_vector(), n in unit_vector(), axis in unit_vector(), k in 0.1..50.0f64, exponent in -40..40_i32) {
        let [d, n, axis] = [d, n, axis].map(DVec3::from_array);
        let [n, axis] = [n, axis].map(|k| if k.dot(d) < 0.0 { -k } else { k });
        prop_assume!(n.dot(d) > 1e-3 && axis.dot(d) > 1e-3);
        let scale = 2f64.powi(exponent);
        let (a, b) = (d * scale, d * (4.0 * scale));
        let size = d.length();
        let cosine = n.dot(d) / size;
        let narrow = 15.0 / 32.0 / (size * scale).powi(2);
        let gaussian = (k * (axis.dot(d) / size - 1.0)).exp();
        let power = (axis.dot(d) / size).powf(k);
        // Powers of cosines that are rounded: k times four roundings.
        let close = |name: &str, got: f64, want: f64| {
            let tolerance = DIFFUSE + 8.0 * f64::EPSILON * (k + 8.0) / (n.dot(d).min(axis.dot(d)));
            assert_close!(got, want, rel = tolerance, "{name} {d} {n} {axis} {k}");
        };
        close("ribbon", ribbon::line_integral(a, b, n), cosine * narrow);
        close("phong::ribbon", phong::ribbon(a, b, n, axis, k), power * cosine * narrow);
        close("spherical_gaussian::ribbon", spherical_gaussian::ribbon(a, b, n, axis, k), gaussian * cosine * narrow);
        let own = |model| quadrature::line(a, b, n, model, |w| DVec3::splat(1.0 + w.x), 1e-10, 1000).value.x;
        close("quadrature of a ribbon", own(Model::Ribbon), (1.0 + d.x / size) * cosine * narrow);
        for nothing in [cylinder::irradiance(a, b, n), phong::cylinder(a, b, n, axis, k), spherical_gaussian::cylinder(a, b, n, axis, k), own(Model::Cylinder)] {
            prop_assert_eq!(nothing.to_bits(), 0);
        }
    }
}

/// (k + 2)/(2π) brings ∫ max(0, cos)ᵏ⁺¹ dω to one: the albedo at normal incidence.
#[test]
fn phong_is_normalised_with_the_cosine() {
    for k in [0.0, 0.3, 1.0, 2.5, 40.0, 1e3, 1e5] {
        let e = gauss_kronrod_to(|z| z.powf(k + 1.0), 0.0, 1.0, 1e-13, 0.0);
        let whole = phong::normalisation(k) * std::f64::consts::TAU * e.value;
        assert_close!(whole, 1.0, 1e-12, "{k}");
    }
}

#[test]
fn lines_without_length_are_dark() {
    for p in [DVec3::Z, DVec3::ZERO, DVec3::new(1e-300, 1e300, 0.5)] {
        for value in [
            ribbon::line_integral(p, p, DVec3::Z),
            cylinder::irradiance(p, p, DVec3::Z),
            cylinder::solid_angle(p, p),
            phong::ribbon(p, p, DVec3::Z, DVec3::Z, 3.0),
            spherical_gaussian::ribbon(p, p, DVec3::Z, DVec3::Z, 3.0),
        ] {
            assert_eq!(value.to_bits(), 0, "{p}");
        }
    }
}
