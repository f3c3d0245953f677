//! The laws of what samples reflections, at a million samples: χ², what the density integrates to,
//! and sample → invert → sample, from the normal to grazing views.

use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{Bsdf, Frostbite, Lambert, Layers, Lobe, Phong, Reflection};
use linelit_geometry::{DVec3, Frame};
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::quadrature::cubature;
use linelit_testkit::rng::SplitMix64;
use std::f64::consts::TAU;

/// Cosines and turns.
const CELLS: [u32; 2] = [32, 24];

/// Draws a direction about z, `None` for what is lost; its density.
type Sampler = (
    String,
    Box<dyn Fn([f64; 2]) -> Option<DVec3>>,
    Box<dyn Fn(DVec3) -> f64>,
);

/// Cosines of the views.
const VIEWS: [f64; 4] = [1.0, 0.7, 0.1, 1e-3];

fn view(cosine: f64) -> DVec3 {
    let turn: f64 = 0.3;
    let sine = (1.0 - cosine * cosine).sqrt();
    DVec3::new(sine * turn.cos(), sine * turn.sin(), cosine)
}

fn samplers() -> Vec<Sampler> {
    let grey = DVec3::splat(0.5);
    let lambert = Lambert { albedo: grey };
    let phong = |exponent| {
        let specular = grey;
        Bsdf::Phong(lambert, Phong { specular, exponent })
    };
    let unequal = |diffuse: f64, exponent| {
        let albedo = DVec3::splat(diffuse);
        let specular = DVec3::ONE - albedo;
        Bsdf::Phong(Lambert { albedo }, Phong { specular, exponent })
    };
    let frostbite = |roughness| {
        let mut layers = Layers::new(DVec3::X);
        let lobe = Frostbite::new(grey, DVec3::splat(0.3), roughness);
        assert!(layers.add(DVec3::ONE, Lobe::Frostbite(lobe)));
        Bsdf::from(layers)
    };
    let models = [
        ("Lambert", Bsdf::Lambert(lambert)),
        ("Phong 3.5", phong(3.5)),
        ("Phong 40", phong(40.0)),
        ("Phong 1, all glossy", unequal(0.0, 1.0)),
        ("Phong 20, mostly diffuse", unequal(0.7, 20.0)),
        ("Frostbite 0.9", frostbite(0.9)),
        ("Frostbite 0.4", frostbite(0.4)),
    ];
    let facets = [[0.15, 0.15], [0.5, 0.5], [1.0, 1.0], [0.2, 0.7]];
    let mut all: Vec<Sampler> = Vec::new();
    for cosine in VIEWS {
        let wo = view(cosine);
        for (name, bsdf) in &models {
            let (bsdf, same) = (bsdf.clone(), bsdf.clone());
            all.push((
                format!("{name}, cosine {cosine}"),
                Box::new(move |u| bsdf.sample(u, wo, DVec3::Z)),
                Box::new(move |wi| same.pdf(wi, wo, DVec3::Z)),
            ));
        }
        for alpha in facets {
            let ggx = TrowbridgeReitz::new(alpha);
            all.push((
                format!("visible normals {alpha:?}, cosine {cosine}"),
                Box::new(move |u| ggx.sample(wo, u)),
                Box::new(move |wi| if wi.z > 0.0 { ggx.pdf(wi, wo) } else { 0.0 }),
            ));
        }
    }
    all
}

/// The direction with this cosine and turn about z.
fn direction(z: f64, turn: f64) -> DVec3 {
    let (s, c) = (TAU * turn).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * c, r * s, z)
}

/// Cells are equally wide in the angle, so that grazing ones are resolved.
fn edge(i: u32) -> f64 {
    -(std::f64::consts::PI * f64::from(i) / f64::from(CELLS[0])).cos()
}

fn fit(samples: u32) {
    let all = samplers();
    let level = sidak(0.01, all.len());
    for (k, (name, sample, pdf)) in all.iter().enumerate() {
        let cells = (CELLS[0] * CELLS[1]) as usize;
        let mut random = SplitMix64::new(700 + k as u64);
        let mut observed = vec![0_u64; cells + 1];
        for _ in 0..samples {
            let w = sample([random.next_f64(), random.next_f64()]);
            assert!(
                w.is_none_or(|w| pdf(w) > 0.0),
                "{name}: {w:?} has no density"
            );
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "below the number of cells"
            )]
            let cell = w.map_or(cells, |w| {
                let turn = (w.y.atan2(w.x) / TAU).rem_euclid(1.0);
                let row = (1..CELLS[0]).filter(|i| edge(*i) <= w.z).count();
                let column = (turn * f64::from(CELLS[1])) as usize;
                row * CELLS[1] as usize + column.min(CELLS[1] as usize - 1)
            });
            observed[cell] += 1;
        }
        let (mut expected, mut error) = (Vec::new(), 0.0);
        for i in 0..CELLS[0] {
            for j in 0..CELLS[1] {
                let at = |j: u32| f64::from(j) / f64::from(CELLS[1]);
                let mass = cubature(
                    |z, turn| TAU * pdf(direction(z, turn)),
                    [edge(i), edge(i + 1)],
                    [at(j), at(j + 1)],
                    1e-8,
                    7,
                );
                error += mass.error;
                expected.push(mass.value * f64::from(samples));
            }
        }
        let mass = expected.iter().sum::<f64>() / f64::from(samples);
        // What microfacets reflect into the surface is no direction and no density; nothing else is
        // lost.
        let lossless = name.starts_with("Lambert") || name.starts_with("Phong");
        let slack = 1e-9 + error;
        assert!(mass < 1.0 + slack, "{name}: ∫ = {mass} ± {error:e}");
        assert!(
            !lossless || (mass - 1.0).abs() < slack,
            "{name}: ∫ = {mass} ± {error:e}"
        );
        expected.push(((1.0 - mass) * f64::from(samples)).max(0.0));
        // A lobe may reach so little into a cell that no node of the quadrature is in it: what is
        // drawn there is part of what the sum misses.
        for i in (0..cells).filter(|i| expected[*i] <= 0.0) {
            observed[cells] += std::mem::take(&mut observed[i]);
        }
        let p = chi2_test(&observed, &expected, 5.0).p_value;
        assert!(p > level, "{name}: p = {p:e}, ∫ = {mass} ± {error:e}");
    }
}

#[test]
fn samples_follow_their_density() {
    fit(50_000);
}

#[test]
#[ignore = "long: a million samples of each reflection and view"]
fn samples_follow_their_density_long() {
    fit(1_000_000);
}

fn turn(w: DVec3) -> f64 {
    (w.y.atan2(w.x) / TAU).rem_euclid(1.0)
}

/// The numbers that give a direction: the diffuse half takes u[0] below one half, the lobe the
/// rest.
fn invert_phong(w: DVec3, axis: DVec3, exponent: f64, diffuse: bool) -> [f64; 2] {
    let local = Frame::from_normal(if diffuse { DVec3::Z } else { axis }).to_local(w);
    let first = if diffuse {
        0.5 * (1.0 - local.z * local.z)
    } else {
        0.5 + 0.5 * (1.0 - local.z.powf(exponent + 1.0))
    };
    [first, turn(local)]
}

/// Those of visible normals: the cap's direction is the stretched view mirrored at the stretched
/// normal.
fn invert_facets(wi: DVec3, wo: DVec3, [a, b]: [f64; 2]) -> [f64; 2] {
    let h = (wi + wo).normalize();
    let stretched = DVec3::new(a * wo.x, b * wo.y, wo.z).normalize();
    let normal = DVec3::new(h.x / a, h.y / b, h.z).normalize();
    let cap = normal * (2.0 * normal.dot(stretched)) - stretched;
    [turn(cap), 1.0 - (cap.z + stretched.z) / (1.0 + stretched.z)]
}

/// sample → invert → sample returns to the direction, to 1e-10: ε by the steepest of the maps
/// between, the power of Phong's lobe at 1e-5 from its axis.
#[test]
fn samples_invert() {
    let mut random = linelit_testkit::cases::rng(31);
    let grey = DVec3::splat(0.5);
    for cosine in VIEWS {
        let wo = view(cosine);
        for exponent in [0.0, 3.5, 40.0] {
            let bsdf = Bsdf::Phong(
                Lambert { albedo: grey },
                Phong {
                    specular: grey,
                    exponent,
                },
            );
            for _ in 0..10_000 {
                let u = [random.next_f64(), random.next_f64()];
                let w = bsdf.sample(u, wo, DVec3::Z).expect("not black");
                let axis = Phong::axis(wo, DVec3::Z);
                let v = invert_phong(w, axis, exponent, u[0] < 0.5);
                let again = bsdf.sample(v, wo, DVec3::Z).expect("not black");
                let off = (again - w).length();
                assert!(
                    off < 1e-10,
                    "Phong {exponent}, {cosine}: {u:?} {v:?} {off:e}"
                );
            }
        }
        for alpha in [[0.15, 0.15], [0.5, 0.5], [1.0, 1.0], [0.2, 0.7]] {
            let facets = TrowbridgeReitz::new(alpha);
            for _ in 0..10_000 {
                let u = [random.next_f64(), random.next_f64()];
                let Some(w) = facets.sample(wo, u) else {
                    continue;
                };
                let v = invert_facets(w, wo, alpha).map(|x| x.clamp(0.0, 1.0 - f64::EPSILON));
                let again = facets.sample(wo, v);
                let off = again.map_or(f64::INFINITY, |a| (a - w).length());
                // Next to the horizon the same rounding may fall below it.
                assert!(
                    off < 1e-10 || (again.is_none() && w.z < 1e-10),
                    "{alpha:?}, {cosine}: {u:?} {v:?} {off:e}"
                );
            }
        }
    }
}
