//! These tests check the laws that every reflection obeys.

use super::*;
use crate::lobe::Model;
use crate::microfacet::TrowbridgeReitz;
use linelit_testkit::{chi2, laws, quadrature::cubature, rng::SplitMix64};

#[test]
fn black_is_not_sampled() {
    let black = Bsdf::Lambert(Lambert {
        albedo: DVec3::ZERO,
    });
    assert!(black.sample([0.5; 2], DVec3::Z, DVec3::Z).is_none());
    assert!(black.pdf(DVec3::Z, DVec3::Z, DVec3::Z) <= 0.0);
}

/// One of each model and some sums, with narrow and wide facets.
fn models() -> Vec<(String, Bsdf)> {
    let grey = DVec3::splat(0.5);
    let mut all = Vec::new();
    for alpha in [[1e-3; 2], [0.05; 2], [0.3; 2], [1.0; 2], [0.05, 0.4]] {
        let facets = TrowbridgeReitz::new(alpha);
        let reflector = |fresnel| Reflector {
            reflectance: DVec3::ONE,
            facets,
            fresnel,
        };
        let kinds = [
            Lobe::Reflector(reflector(Fresnel::Full)),
            Lobe::Reflector(reflector(Fresnel::Dielectric { eta: 1.0 / 1.5 })),
            Lobe::Reflector(reflector(Fresnel::Conductor {
                eta: DVec3::new(0.2, 0.9, 1.1),
                k: DVec3::new(3.9, 2.4, 2.2),
            })),
            Lobe::Substrate(Substrate {
                diffuse: grey,
                specular: DVec3::splat(0.04),
                facets,
            }),
            Lobe::Frostbite(Frostbite::new(grey, DVec3::splat(0.04), alpha[0].sqrt())),
        ];
        for lobe in kinds {
            let mut layers = Layers::new(DVec3::new(0.4, 1.0, 0.1));
            assert!(layers.add(DVec3::ONE, lobe));
            all.push((format!("{lobe:?}"), layers));
        }
        let mut plastic = Layers::new(DVec3::ZERO);
        plastic.add_diffuse(grey);
        assert!(plastic.add(grey, kinds[1]));
        all.push((format!("plastic {alpha:?}"), plastic));
        let quarter = DVec3::splat(0.25);
        let phong = Phong {
            specular: grey,
            exponent: 30.0,
        };
        let rough = OrenNayar::new(grey, 0.5);
        let mut mixture = Layers::new(DVec3::ZERO);
        mixture.add_diffuse(quarter * quarter);
        for lobe in [
            kinds[1],
            kinds[3],
            Lobe::OrenNayar(rough),
            Lobe::Phong(phong),
        ] {
            assert!(mixture.add(quarter, lobe));
        }
        all.push((format!("mixture {alpha:?}"), mixture));
    }
    let flat = Phong {
        specular: grey,
        exponent: 0.0,
    };
    let flat = Bsdf::Phong(Lambert { albedo: grey }, flat);
    all.into_iter()
        .map(|(name, layers)| (name, Bsdf::from(layers)))
        .chain([("Phong 0".to_owned(), flat)])
        .collect()
}

fn tilted() -> (DVec3, Frame) {
    let n = DVec3::new(0.3, -0.5, 0.8).normalize();
    (n, Frame::from_normal(n))
}

/// A direction of the upper hemisphere, cosines down to 1e-6.
fn up(random: &mut SplitMix64, frame: &Frame) -> DVec3 {
    let z = random
        .next_f64()
        .max(1e-6)
        .powi(1 + i32::try_from(random.below(3)).unwrap());
    frame.to_world(about(DVec3::Z, z.max(1e-6), random.next_f64()))
}

/// f(ω_i, ω_o) = f(ω_o, ω_i) but for rounding: the cosines of directions in the world are wrong by
/// 4 ε, of a cosine of 1e-6 and of a lobe 1e-3 wide that is ε/1e-6 each, twice over.
#[test]
fn reciprocal() {
    let (n, frame) = tilted();
    let mut random = SplitMix64::new(5);
    for (name, bsdf) in models() {
        for _ in 0..500 {
            let (wi, wo) = (up(&mut random, &frame), up(&mut random, &frame));
            let (ab, ba) = (bsdf.eval(wi, wo, n), bsdf.eval(wo, wi, n));
            let close = (ab - ba).abs().cmple(ab.abs() * 1e-8);
            assert!(close.all(), "{name}: {ab} {ba}");
        }
        // A viewer below the horizon counts as one above, light from there does not.
        let Bsdf::Layers(layers) = &bsdf else {
            continue;
        };
        let (wi, below) = (frame.to_world(about(DVec3::Z, 0.9, 0.1)), -n);
        let glossy = layers.diffuse() == DVec3::ZERO;
        let (mirrored, above) = (bsdf.eval(wi, below, n), bsdf.eval(wi, n, n));
        let close = (mirrored - above).abs().cmple(above.abs() * 1e-8);
        assert!(close.all(), "{name}: {mirrored} {above}");
        assert!(!glossy || bsdf.eval(below, wi, n) == DVec3::ZERO, "{name}");
    }
}

/// Every law of `linelit-testkit`, for facets wide enough that cells resolve them; at a family-wise
/// level of 1e-3. Facets as rough as can be lose less than half below the horizon.
#[test]
fn layers_obey_the_laws() {
    let wide: Vec<_> = models()
        .into_iter()
        .filter(|(name, _)| !name.contains("0.001"))
        .collect();
    let level = chi2::sidak(1e-3, 4 * wide.len());
    for (k, (name, bsdf)) in wide.iter().enumerate() {
        for tilt in [0.4, 3.0] {
            let wo = (DVec3::Z + tilt * DVec3::X + 0.2 * DVec3::Y).normalize();
            laws::Bsdf::new(format!("{name} {tilt}"))
                .seed(k as u64 + 100)
                .alpha(level)
                .lost(0.5)
                // What its documentation says of Frostbite's.
                .most(1.13)
                .check(
                    wo.to_array(),
                    |wi, wo| bsdf.eval(wi.into(), wo.into(), DVec3::Z).x,
                    |u, wo| bsdf.sample(u, wo.into(), DVec3::Z).map(Into::into),
                    |wi, wo| bsdf.pdf(wi.into(), wo.into(), DVec3::Z),
                );
        }
    }
}

/// The mean of f cos/pdf, stratified: the albedo.
fn albedo(bsdf: &Bsdf, wo: DVec3, n: DVec3) -> f64 {
    let side = 64;
    let mut sum = 0.0;
    for i in 0..side * side {
        let u = [i / side, i % side].map(|k| (f64::from(k) + 0.5) / f64::from(side));
        if let Some(w) = bsdf.sample(u, wo, n).filter(|w| w.dot(n) > 0.0) {
            let weight = bsdf.eval(w, wo, n).x * w.dot(n) / bsdf.pdf(w, wo, n);
            assert!(
                weight >= 0.0 && weight.is_finite(),
                "{bsdf:?} {wo} {w}: {weight}"
            );
            sum += weight;
        }
    }
    sum / f64::from(side * side)
}

/// A coat over black that reflects nothing at normal incidence is drawn by there all the same.
#[test]
fn what_says_it_reflects_nothing_is_not_black() {
    let mut layers = Layers::new(DVec3::ZERO);
    let coat = Lobe::Substrate(Substrate {
        diffuse: DVec3::ZERO,
        specular: DVec3::ZERO,
        facets: TrowbridgeReitz::isotropic(0.5),
    });
    assert!(coat.shares(DVec3::Z) == [DVec3::ZERO; 2] && layers.add(DVec3::ONE, coat));
    let light = |z: f64, turn: f64| coat.value(about(DVec3::Z, z, turn), DVec3::Z).x * z * TAU;
    let want = cubature(light, [0.0, 1.0], [0.0, 1.0], 1e-7, 12).value;
    let got = albedo(&Bsdf::from(layers), DVec3::Z, DVec3::Z);
    // 4096 strata: a hundredth for those at the horizon.
    assert!(
        want > 0.0 && (got / want - 1.0).abs() < 0.01,
        "{got} {want}"
    );
}

/// A white furnace: no model reflects more than it gets, up to what its documentation says; and
/// narrow facets lose nothing.
#[test]
fn furnace() {
    let (n, frame) = tilted();
    for cosine in [1.0, 0.9, 0.7, 0.5, 0.3, 0.2, 0.1, 0.05, 0.005] {
        let wo = frame.to_world(about(DVec3::Z, cosine, 0.1));
        let all = models().into_iter().map(|(name, bsdf)| (name, bsdf, 1.0));
        for (name, bsdf, most) in all.chain(white()) {
            let got = albedo(&bsdf, wo, n);
            // 4096 strata of a bounded weight: 1e-2 for what straddles the choice of lobes.
            assert!(got <= most + 0.01, "{name} {cosine}: {got}");
        }
        for alpha in [1e-4, 1e-3, 1e-2] {
            let mirror = mirror(alpha);
            let got = albedo(&mirror, wo, n);
            // What masking takes: of the order of (α tan)².
            let least = 1.0 - (4.0 * alpha / cosine).powi(2).max(1e-9);
            assert!(
                (least..=1.0 + 1e-9).contains(&got),
                "{alpha} {cosine}: {got}"
            );
        }
    }
}

fn mirror(alpha: f64) -> Bsdf {
    single(Lobe::Reflector(Reflector {
        reflectance: DVec3::ONE,
        facets: TrowbridgeReitz::isotropic(alpha),
        fresnel: Fresnel::Full,
    }))
}

fn single(lobe: Lobe) -> Bsdf {
    let mut layers = Layers::new(DVec3::ZERO);
    assert!(layers.add(DVec3::ONE, lobe));
    Bsdf::from(layers)
}

/// Models that are as white as can be, with the most that each reflects.
fn white() -> Vec<(String, Bsdf, f64)> {
    let white = DVec3::ONE;
    let mut all = Vec::new();
    for alpha in [0.01, 0.1, 0.3, 0.6, 1.0] {
        let facets = TrowbridgeReitz::isotropic(alpha);
        all.push((format!("mirror {alpha}"), mirror(alpha), 1.0));
        for specular in [0.0, 0.04, 0.3, 1.0].map(DVec3::splat) {
            let coat = Lobe::Substrate(Substrate {
                diffuse: white,
                specular,
                facets,
            });
            all.push((format!("{coat:?}"), single(coat), 1.0));
        }
        for metalness in [0.0, 0.5, 1.0] {
            let lobe = Frostbite::from_base_color(white, metalness, alpha.sqrt());
            let lobe = Lobe::Frostbite(lobe);
            all.push((format!("{lobe:?}"), single(lobe), 1.13));
        }
    }
    for exponent in [0.0, 1.0, 7.0, 300.0] {
        let specular = white;
        let phong = Phong { specular, exponent };
        all.push((format!("{phong:?}"), single(Lobe::Phong(phong)), 1.0));
    }
    all
}

/// Checks albedos known in closed form: Phong's lobe seen from above loses nothing, and Oren and
/// Nayar's model reflects up to 1.0152 times its albedo, at σ² = 0.0394.
#[test]
fn albedos_known_in_closed_form() {
    for exponent in [0.0, 1.0, 7.0, 300.0] {
        let specular = DVec3::splat(0.7);
        let phong = single(Lobe::Phong(Phong { specular, exponent }));
        // Midpoints of 20,000 cosines: k²/(24 · 20,000²) of it.
        let light = |i: i32| {
            let z = (f64::from(i) + 0.5) / 2e4;
            phong.eval(about(DVec3::Z, z, 0.2), DVec3::Z, DVec3::Z).x * z * TAU / 2e4
        };
        let whole: f64 = (0..20_000).map(light).sum();
        assert!((whole - 0.7).abs() < 1e-5, "{exponent}: {whole}");
    }
    let mut most = 0.0f64;
    for i in 0..=400 {
        let model = OrenNayar::new(DVec3::ONE, f64::from(i) * 0.005);
        for j in 0..=100 {
            let wo = about(DVec3::Z, f64::from(j) / 100.0, 0.0);
            most = most.max(model.cosines(wo).0.x);
        }
    }
    // A + B/2 at the horizon, where it is largest.
    assert!((1.0151..1.0152).contains(&most), "{most}");
}

/// Values and densities are finite and not negative wherever directions lie, also below and at the
/// horizon, for mirrors and for the roughest facets; samples have a positive density.
#[test]
fn extremes_stay_finite() {
    let (n, frame) = tilted();
    let mut random = SplitMix64::new(77);
    let mut cases = models();
    for alpha in [[0.0; 2], [1e-4; 2], [1e-4, 1.0], [1e9; 2], [f64::NAN; 2]] {
        let facets = TrowbridgeReitz::new(alpha);
        let mut layers = Layers::new(DVec3::X);
        let fresnel = Fresnel::Dielectric { eta: 1.5 };
        let reflectance = DVec3::ONE;
        let sharp = Lobe::Reflector(Reflector {
            reflectance,
            facets,
            fresnel,
        });
        let coat = Lobe::Substrate(Substrate {
            diffuse: reflectance,
            specular: DVec3::ZERO,
            facets,
        });
        assert!(layers.add(DVec3::ONE, sharp) && layers.add(DVec3::ONE, coat));
        cases.push((format!("{alpha:?}"), layers.into()));
    }
    let cosines = [
        1.0,
        1.0 - 1e-16,
        0.5,
        1e-3,
        1e-9,
        1e-160,
        0.0,
        -1e-9,
        -0.7,
        -1.0,
    ];
    for (name, bsdf) in cases {
        for _ in 0..1500 {
            let mut any = || {
                let z = cosines[usize::try_from(random.below(10)).unwrap()];
                frame.to_world(about(DVec3::Z, z, random.below(8) as f64 / 8.0))
            };
            let (wi, wo) = (any(), any());
            let (value, pdf) = (bsdf.eval(wi, wo, n), bsdf.pdf(wi, wo, n));
            assert!(
                value.is_finite() && value.min_element() >= 0.0,
                "{name} {wi} {wo}: {value}"
            );
            assert!(pdf.is_finite() && pdf >= 0.0, "{name} {wi} {wo}: {pdf}");
            let u = [random.next_f64(), random.next_f64()];
            if let Some(w) = bsdf.sample(u, wo, n) {
                assert!((w.length() - 1.0).abs() < 1e-12, "{name}: {w}");
                let pdf = bsdf.pdf(w, wo, n);
                assert!(
                    pdf.is_finite() && (pdf > 0.0 || w.dot(n) < 1e-12),
                    "{name} {w} {wo}: {pdf}"
                );
            }
        }
    }
}

/// The models as their sources print them, by angles, in the local frame.
#[test]
fn values_follow_the_printed_formulas() {
    let mut random = SplitMix64::new(3);
    let frame = Frame::from_normal(DVec3::Z);
    for _ in 0..2000 {
        let mut direction = || {
            let w = up(&mut random, &frame);
            DVec3::new(w.x, w.y, w.z.max(0.02)).normalize()
        };
        let (wi, wo) = (direction(), direction());
        let h = (wi + wo).normalize();
        let (a, b) = (0.2, 0.5);
        let tan2 = |w: DVec3| (1.0 - w.z * w.z) / (w.z * w.z);
        let phi = |w: DVec3| w.y.atan2(w.x);
        let e = |w: DVec3, a: f64, b: f64| {
            tan2(w) * ((phi(w).cos() / a).powi(2) + (phi(w).sin() / b).powi(2))
        };
        let d = |a: f64, b: f64| {
            1.0 / (std::f64::consts::PI * a * b * h.z.powi(4) * (1.0 + e(h, a, b)).powi(2))
        };
        let lambda = |w: DVec3, a: f64, b: f64| {
            let alpha2 = (phi(w).cos() * a).powi(2) + (phi(w).sin() * b).powi(2);
            0.5 * ((1.0 + alpha2 * tan2(w)).sqrt() - 1.0)
        };
        let g = |a: f64, b: f64| 1.0 / (1.0 + lambda(wi, a, b) + lambda(wo, a, b));
        let facets = TrowbridgeReitz::new([a, b]);
        let glossy = d(a, b) * g(a, b) / (4.0 * wi.z * wo.z);
        let mirror = Reflector {
            reflectance: DVec3::splat(0.7),
            facets,
            fresnel: Fresnel::Full,
        };
        let close = |got: f64, want: f64| (got - want).abs() <= 1e-9 * want;
        assert!(close(mirror.value(wi, wo).x, 0.7 * glossy));

        let (rd, rs) = (0.6, 0.1);
        let flat = 28.0 * rd / (23.0 * std::f64::consts::PI)
            * (1.0 - rs)
            * (1.0 - (1.0 - 0.5 * wi.z).powi(5))
            * (1.0 - (1.0 - 0.5 * wo.z).powi(5));
        let fresnel = rs + (1.0 - rs) * (1.0 - wi.dot(h)).powi(5);
        let want = flat + d(a, b) / (4.0 * wi.dot(h) * wi.z.max(wo.z)) * fresnel;
        let coat = Substrate {
            diffuse: DVec3::splat(rd),
            specular: DVec3::splat(rs),
            facets,
        };
        assert!(close(coat.value(wi, wo).x, want));

        let r: f64 = 0.6;
        let f90 = 0.5 * r + 2.0 * wi.dot(h).powi(2) * r;
        let scatter = |c: f64| 1.0 + (f90 - 1.0) * (1.0 - c).powi(5);
        let factor = (1.0 - r) + r / 1.51;
        let flat = rd / std::f64::consts::PI * scatter(wi.z) * scatter(wo.z) * factor;
        let want = flat + d(r * r, r * r) * g(r * r, r * r) / (4.0 * wi.z * wo.z) * fresnel;
        let ours = Frostbite::new(DVec3::splat(rd), DVec3::splat(rs), r);
        assert!(close(ours.value(wi, wo).x, want));

        let exponent = 40.0;
        let specular = DVec3::splat(rs);
        let cosine = DVec3::new(-wo.x, -wo.y, wo.z).dot(wi);
        let want = rs * (exponent + 2.0) / TAU * cosine.max(0.0).powf(exponent);
        let lobe = Phong { specular, exponent };
        assert!(close(Model::value(&lobe, wi, wo).x, want));
    }
}

/// f is a sum, and the density a mixture of the densities of the cosine and the lobe, with the same
/// fraction of the cosine everywhere.
#[test]
fn layers_are_their_parts() {
    let lobe = Lobe::Reflector(Reflector {
        reflectance: DVec3::splat(0.5),
        facets: TrowbridgeReitz::isotropic(0.4),
        fresnel: Fresnel::Full,
    });
    let mut layers = Layers::new(DVec3::X);
    layers.add_diffuse(DVec3::splat(0.3));
    assert!(layers.add(DVec3::ONE, lobe));
    let (both, glossy) = (Bsdf::Layers(layers), single(lobe));
    let (n, wo) = (DVec3::Z, about(DVec3::Z, 0.8, 0.1));
    let shares = [(0.8, 0.6), (0.9, 0.1), (0.3, 0.3)].map(|(cosine, turn)| {
        let wi = about(n, cosine, turn);
        let want = glossy.eval(wi, wo, n).x + 0.3 / std::f64::consts::PI;
        let got = both.eval(wi, wo, n).x;
        assert!(
            (got / want - 1.0).abs() < 8.0 * f64::EPSILON,
            "{got} {want}"
        );
        let (flat, peak) = (cosine / std::f64::consts::PI, glossy.pdf(wi, wo, n));
        (both.pdf(wi, wo, n) - peak) / (flat - peak)
    });
    // Differences of densities, apart by a tenth and more of themselves.
    for share in shares {
        assert!((share - shares[0]).abs() < 1e-13, "{shares:?}");
    }
}

#[test]
fn simple_sums_keep_their_closed_forms() {
    let mut layers = Layers::new(DVec3::X);
    layers.add_diffuse(DVec3::splat(0.25));
    layers.add_diffuse(DVec3::splat(0.25));
    let black = Reflector {
        reflectance: DVec3::ZERO,
        facets: TrowbridgeReitz::isotropic(0.1),
        fresnel: Fresnel::Full,
    };
    assert!(layers.add(DVec3::ONE, Lobe::Reflector(black)));
    let half = Lambert {
        albedo: DVec3::splat(0.5),
    };
    assert_eq!(Bsdf::from(layers.clone()), Bsdf::Lambert(half));
    let phong = Phong {
        specular: DVec3::ONE,
        exponent: 4.0,
    };
    assert!(layers.add(DVec3::splat(0.5), Lobe::Phong(phong)));
    let scaled = Phong {
        specular: DVec3::splat(0.5),
        ..phong
    };
    assert_eq!(Bsdf::from(layers.clone()), Bsdf::Phong(half, scaled));
    assert!(!Bsdf::from(layers).is_black());
    assert!(Bsdf::from(Layers::default()).is_black());
}

/// Between two knots along a line, the arguments of each `max` in a reflection keep their order.
#[test]
fn kinks_are_knots() {
    let mut random = SplitMix64::new(40);
    let mut up = || {
        let w = DVec3::from_array(random.unit_vector());
        DVec3::new(w.x, w.y, w.z.abs())
    };
    let facets = TrowbridgeReitz::new([0.2; 2]);
    let (diffuse, specular) = (DVec3::splat(0.5), DVec3::splat(0.04));
    let substrate = Substrate {
        diffuse,
        specular,
        facets,
    };
    let phong = Phong {
        specular,
        exponent: 1.0,
    };
    let lobes = [
        Lobe::OrenNayar(OrenNayar::new(diffuse, 0.5)),
        Lobe::Substrate(substrate),
        Lobe::Phong(phong),
    ];
    let mut passed = [[0; 2]; 3];
    for _ in 0..1000 {
        let (wo, line) = (up(), Segment::new(up(), up() * 2.0));
        // cos Δφ to zero, cos_i to cos_o, and the mirror direction's cosine to zero, as signs.
        let beside = |w: DVec3| w.x * wo.x + w.y * wo.y < 0.0;
        let steeper = |w: DVec3| w.z < wo.z;
        let behind = |w: DVec3| w.z * wo.z - w.x * wo.x - w.y * wo.y < 0.0;
        for (lobe, passed) in lobes.iter().zip(&mut passed) {
            let mut layers = Layers::new(DVec3::X);
            assert!(layers.add(DVec3::ONE, *lobe));
            let peaks = Bsdf::Layers(layers).peaks(&line, wo, DVec3::Z);
            let knots: Vec<f64> = peaks.expect("known").knots().collect();
            let mut from = 0.0;
            for to in knots {
                // Knots are rounded by far less than a thousandth of the parts next to them.
                let at = |k: u32| {
                    line.at(from + (to - from) * f64::from(k) / 1000.0)
                        .normalize()
                };
                let signs = |w: DVec3| match lobe {
                    Lobe::OrenNayar(_) => [beside(w), steeper(w)],
                    Lobe::Substrate(_) => [steeper(w); 2],
                    _ => [behind(w); 2],
                };
                let [first, last] = [signs(at(1)), signs(at(999))];
                assert!(
                    to - from < 1e-9 || (1..1000).all(|k| signs(at(k)) == first),
                    "{lobe:?} from {from} to {to}"
                );
                passed[0] += u32::from(last[0]);
                passed[1] += u32::from(!last[0]);
                from = to;
            }
        }
    }
    assert!(passed.iter().flatten().all(|n| *n > 10), "{passed:?}");
}
