//! Every public function of the crate on input that no scene should have: NaN, infinities,
//! subnormal and huge numbers, equal and nearly equal vectors, in any argument. Nothing panics (the
//! test profile checks overflow and debug assertions), every result is finite, and what is a
//! measure of light is not negative.
//!
//! Left out are plain linear maps of their input ([`Phong::axis`], `Ltc::map`), which are called
//! but may be as infinite as what they are given, and `quadrature`'s values of an integrand that is
//! itself no number.

use linelit_bsdf::microfacet::{TrowbridgeReitz, schlick};
use linelit_bsdf::{
    Bsdf, Fresnel, Frostbite, Lambert, Layers, Lobe, OrenNayar, Phong, Reflection, Reflector,
    Substrate,
};
use linelit_geometry::{DMat3, DVec3, Frame, Segment};
use linelit_shading::ltc::Ltc;
use linelit_shading::quadrature::{self, Model};
use linelit_shading::ribbon::{Sides, emitter, reflected};
use linelit_shading::{
    batch, cylinder, horizon, phong, phong_polygon, polygon, ribbon, solid_angle,
    spherical_gaussian,
};
use linelit_testkit::close::nudge;
use linelit_testkit::rng::SplitMix64;
use proptest::prelude::*;

/// Numbers at the ends of all ranges, among them those at which squares, cubes and products of two
/// lengths leave it.
const NUMBERS: [f64; 30] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    1e308,
    -1e308,
    1e276,
    4.3e261,
    1e160,
    -1e155,
    1e149,
    1e77,
    1e19,
    1.0,
    -1.0,
    0.5,
    0.0,
    -0.0,
    1e-16,
    -1e-17,
    1e-77,
    1e-103,
    1e-149,
    1e-162,
    -1e-170,
    1e-308,
    f64::MIN_POSITIVE,
    5e-318,
    5e-324,
];

/// A source of hostile numbers and vectors.
struct Source(SplitMix64);

impl Source {
    fn below(&mut self, n: u64) -> usize {
        usize::try_from(self.0.below(n)).expect("small")
    }

    fn number(&mut self) -> f64 {
        match self.below(3) {
            0 => NUMBERS[self.below(30)],
            1 => self.0.in_range(-2.0, 2.0),
            _ => self.0.in_range(-1.0, 1.0) * 10f64.powf(self.0.in_range(-320.0, 308.0)),
        }
    }

    /// Half of them ordinary directions, so that the other arguments' effect is seen.
    fn vector(&mut self) -> DVec3 {
        let mut v = DVec3::from_array(self.0.unit_vector());
        match self.below(6) {
            0 | 1 => {}
            2 => v *= 10f64.powf(self.0.in_range(-320.0, 308.0)),
            3 => v[self.below(3)] = self.number(),
            4 => v = DVec3::new(self.number(), self.number(), self.number()),
            _ => v *= 10f64.powf(self.0.in_range(-3.0, 3.0)),
        }
        v
    }

    /// Some of them equal, opposite, or equal but for the last digits.
    fn vectors<const N: usize>(&mut self) -> [DVec3; N] {
        let mut out: [DVec3; N] = std::array::from_fn(|_| self.vector());
        for i in 1..N {
            let other = out[self.below(i as u64)];
            match self.below(6) {
                0 => out[i] = other,
                1 => out[i] = -other,
                2 => {
                    let steps = i64::try_from(self.below(5)).expect("small") - 2;
                    out[i] = DVec3::new(nudge(other.x, steps), other.y, nudge(other.z, -steps));
                }
                _ => {}
            }
        }
        out
    }
}

/// Collects what is wrong, with the function's name.
#[derive(Default)]
struct Wrong(Vec<String>);

impl Wrong {
    fn light(&mut self, name: &str, value: f64) {
        if !(value >= 0.0 && value.is_finite()) {
            self.0.push(format!("{name}: {value}"));
        }
    }

    fn colour(&mut self, name: &str, value: DVec3) {
        for x in value.to_array() {
            self.light(name, x);
        }
    }

    fn finite(&mut self, name: &str, value: f64) {
        if !value.is_finite() {
            self.0.push(format!("{name}: {value}"));
        }
    }

    fn share(&mut self, name: &str, value: f64) {
        if !(0.0..=1.0).contains(&value) {
            self.0.push(format!("{name}: {value} is no share"));
        }
    }

    fn direction(&mut self, name: &str, value: Option<DVec3>) {
        if value.is_some_and(|w| !w.is_finite()) {
            self.0.push(format!("{name}: {value:?}"));
        }
    }

    fn verdict(self, seed: u64) -> Result<(), TestCaseError> {
        prop_assert!(self.0.is_empty(), "seed {seed}: {}", self.0.join(", "));
        Ok(())
    }
}

const MODELS: [Model; 2] = [Model::Ribbon, Model::Cylinder];

fn along_lines(source: &mut Source, wrong: &mut Wrong) {
    let [p0, p1, n, m, axis] = source.vectors();
    let (k, albedo, tolerance) = (source.number(), source.number(), source.number());
    wrong.light("ribbon", ribbon::line_integral(p0, p1, n));
    wrong.light("cylinder", cylinder::irradiance(p0, p1, n));
    wrong.light("cylinder::solid_angle", cylinder::solid_angle(p0, p1));
    for sides in [Sides::One, Sides::Both] {
        wrong.light("emitter", emitter(p0, p1, m, sides));
        wrong.light("reflected", reflected(p0, p1, n, m, sides, albedo));
    }
    wrong.light("phong::normalisation", phong::normalisation(k));
    wrong.light("phong::ribbon", phong::ribbon(p0, p1, n, axis, k));
    wrong.light("phong::cylinder", phong::cylinder(p0, p1, n, axis, k));
    let half = phong::half_space(p0, p1, n, m, axis, k);
    wrong.light("phong::half_space", half);
    let widths = [m.x.abs(), m.y.abs()];
    wrong.light("ribbon::tapered", ribbon::tapered(p0, p1, n, widths));
    let tapered = phong::tapered(p0, p1, n, axis, k, widths);
    wrong.light("phong::tapered", tapered);
    let tapered = spherical_gaussian::tapered(p0, p1, n, axis, k, widths);
    wrong.light("spherical_gaussian::tapered", tapered);
    let gauss = spherical_gaussian::ribbon(p0, p1, n, axis, k);
    wrong.light("spherical_gaussian::ribbon", gauss);
    let gauss = spherical_gaussian::cylinder(p0, p1, n, axis, k);
    wrong.light("spherical_gaussian::cylinder", gauss);
    if let Some(clipped) = horizon::clip_segment(p0, p1, n) {
        wrong.light("clip_segment", clipped.cosines[0]);
        wrong.light("clip_segment", clipped.cosines[1]);
        wrong.share("clip_segment", clipped.fraction);
        wrong.direction("clip_segment", Some(clipped.p0));
        wrong.direction("clip_segment", Some(clipped.p1));
    }
    for model in MODELS {
        let one = |_| DVec3::ONE;
        let e = quadrature::line(p0, p1, n, model, one, tolerance, 200);
        wrong.colour("quadrature::line", e.value);
        wrong.light("quadrature::line's error", e.error);
    }
    let e = quadrature::adaptive(|_| DVec3::ONE, k, albedo, tolerance, 200);
    wrong.finite("quadrature::adaptive", e.value.x);
    wrong.light("quadrature::adaptive's error", e.error);
    many(p0, p1, n, wrong);
}

/// All lanes of the batch.
fn many(p0: DVec3, p1: DVec3, n: DVec3, wrong: &mut Wrong) {
    let mut out = [-1.0; 9];
    batch::ribbons(&[Segment::new(p0, p1); 9], n, &mut out);
    out.iter().for_each(|x| wrong.light("batch", *x));
}

fn over_polygons(source: &mut Source, wrong: &mut Wrong) {
    let points: [DVec3; 27] = source.vectors();
    let ([n, w], k) = (source.vectors(), source.number());
    for count in [0, 1, 2, 3, 4, 6, 27] {
        let corners = &points[..count];
        wrong.light("polygon", polygon::irradiance(corners, n));
        let lobe = phong_polygon::irradiance(corners, n, w, k);
        wrong.light("phong_polygon", lobe);
        wrong.light("by edges", polygon::irradiance_by_edges(corners, n));
        wrong.light("solid_angle::polygon", solid_angle::polygon(corners));
    }
    let [a, b, c] = [points[0], points[1], points[2]];
    wrong.finite("polygon::edge", polygon::edge(a, b, n));
    let ends = [[a.x, b.y], [b.z, a.y]];
    let sum = polygon::boundary_irradiance([ends; 9], &[a, b, w], n);
    wrong.light("boundary", sum);
    let sum = phong_polygon::boundary_irradiance([ends; 9], &[a, b, w], n, c, k);
    wrong.light("phong boundary", sum.unwrap_or(0.0));
    wrong.light("triangle", solid_angle::triangle(a, b, c));
}

fn transformed_cosines(source: &mut Source, wrong: &mut Wrong) {
    let points: [DVec3; 6] = source.vectors();
    let [x, y, z, n, w] = source.vectors();
    let albedo = source.number();
    let frame = Frame::from_normal(n);
    let ltc = Ltc::new(DMat3::from_cols(x, y, z), albedo);
    let _ = ltc.map();
    wrong.light("Ltc::density", ltc.density(w));
    wrong.light("Ltc::polygon", ltc.polygon(&frame, &points));
    wrong.light(
        "Ltc::polygon_by_edges",
        ltc.polygon_by_edges(&frame, &points),
    );
    wrong.light("Ltc::line", ltc.line(&frame, points[0], points[1]));
}

fn layers([tangent, kd, ks]: [DVec3; 3], parts: [Lobe; 5]) -> Layers {
    let mut layers = Layers::new(tangent);
    layers.set_tangent(tangent);
    layers.add_diffuse(kd);
    for lobe in parts {
        assert!(layers.add(ks, lobe), "five of eight");
    }
    let _ = (layers.diffuse(), layers.is_black(), layers.lobes().count());
    layers
}

#[allow(clippy::too_many_lines, reason = "one function after the other")]
fn reflection(source: &mut Source, wrong: &mut Wrong) {
    let [wi, wo, n, kd, ks, tangent] = source.vectors();
    let u = [source.number(), source.number()];
    let (a, b, cosine) = (source.number(), source.number(), source.number());
    wrong.share("schlick", schlick(cosine));
    let facets = TrowbridgeReitz::new([a, b]);
    let _ = (TrowbridgeReitz::isotropic(a).alpha(), facets.is_isotropic());
    wrong.light("TrowbridgeReitz::density", facets.density(wi));
    wrong.light("TrowbridgeReitz::reflection", facets.reflection(n, wi, wo));
    wrong.light("TrowbridgeReitz::pdf", facets.pdf(wi, wo));
    wrong.direction("TrowbridgeReitz::sample", facets.sample(wo, u));
    let fresnels = [
        Fresnel::Full,
        Fresnel::Schlick { f0: ks, f90: a },
        Fresnel::Dielectric { eta: a },
        Fresnel::Conductor { eta: kd, k: ks },
    ];
    for fresnel in fresnels {
        wrong.colour("Fresnel", fresnel.at(cosine));
    }
    let phong = Phong {
        specular: ks,
        exponent: a,
    };
    let _ = Phong::axis(wo, n);
    wrong.colour("Phong::scale", phong.scale());
    wrong.colour("Phong::value", phong.value(cosine));
    wrong.light("Phong::pdf", phong.pdf(cosine));
    let lambert = Lambert { albedo: kd };
    wrong.colour("Lambert", lambert.value());
    let rough = OrenNayar::new(kd, a);
    wrong.colour("OrenNayar", rough.value(wi, wo));
    let reflector = Reflector {
        reflectance: ks,
        facets,
        fresnel: fresnels[source.below(4)],
    };
    wrong.colour("Reflector", reflector.value(wi, wo));
    let substrate = Substrate {
        diffuse: kd,
        specular: ks,
        facets,
    };
    wrong.colour("Substrate", substrate.value(wi, wo));
    let frostbite = Frostbite::new(kd, ks, a);
    wrong.share("Frostbite::roughness", frostbite.roughness());
    wrong.colour("Frostbite", frostbite.value(wi, wo));
    let metal = Frostbite::from_base_color(kd, a, b);
    wrong.colour("Frostbite", metal.value(wi, wo));
    let parts = [
        Lobe::OrenNayar(rough),
        Lobe::Phong(phong),
        Lobe::Reflector(reflector),
        Lobe::Substrate(substrate),
        Lobe::Frostbite(frostbite),
    ];
    let all = [
        Bsdf::Lambert(lambert),
        Bsdf::Phong(lambert, phong),
        Bsdf::from(layers([tangent, kd, ks], parts)),
    ];
    for bsdf in all {
        let _ = bsdf.is_black();
        wrong.colour("Bsdf::eval", bsdf.eval(wi, wo, n));
        wrong.light("Bsdf::pdf", bsdf.pdf(wi, wo, n));
        wrong.direction("Bsdf::sample", bsdf.sample(u, wo, n));
    }
}

proptest! {
    #[test]
    fn nothing_panics_and_all_light_is_a_number(seed in any::<u64>()) {
        let mut source = Source(SplitMix64::new(seed));
        for part in [along_lines, over_polygons, transformed_cosines, reflection] {
            for _ in 0..4 {
                let mut wrong = Wrong::default();
                part(&mut source, &mut wrong);
                wrong.verdict(seed)?;
            }
        }
    }
}
