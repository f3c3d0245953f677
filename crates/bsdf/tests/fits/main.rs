//! These tests check reflections as linearly transformed cosines: laws of the densities, albedos,
//! and the differences between the fits and the reflections.

mod fit;
mod fit_errors;

use fit_errors::{alone, nodes, rows, view};
use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{
    Bsdf, ClosedLobe, Fresnel, Frostbite, Lambert, Layers, Lobe, LtcFit, LtcLobe, LtcMixture,
    OrenNayar, Phong, Reflection, Reflector, Substrate,
};
use linelit_geometry::{DVec3, Segment};
use linelit_testkit::assert_close;
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::public::page;
use linelit_testkit::quadrature::{cubature, gauss_kronrod};
use linelit_testkit::rng::SplitMix64;
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

/// The first inputs of each row: the page's worst is of more of the same.
#[test]
fn fits_are_as_near_as_the_page_says() {
    let Some(page) = page(env!("CARGO_MANIFEST_DIR"), "docs/accuracy-ltc.md") else {
        return;
    };
    let rows = rows(12);
    assert!(rows.len() > 50);
    for row in rows {
        let line = page.lines().find(|line| line.starts_with(&row.key));
        let line = line.unwrap_or_else(|| panic!("{}: not on the page", row.key));
        let cells: Vec<f64> = line
            .split('|')
            .filter_map(|c| c.trim().parse().ok())
            .collect();
        let [_, _, worst, albedo] = cells[..] else {
            panic!("{line}: four numbers")
        };
        // Half of the last digit printed.
        let [_, ours, our_albedo] = row.errors.map(|e| e - 5.01e-4);
        assert!(
            ours <= worst && our_albedo <= albedo,
            "{line}\n{}",
            row.text()
        );
    }
}

/// Any facets and views: from mirrors to the roughest, from above to the horizon.
fn any_lobe(random: &mut SplitMix64) -> (TrowbridgeReitz, DVec3, Vec<LtcLobe>) {
    let mut width = || 10f64.powf(-4.5 + 5.0 * random.next_f64());
    let alpha = [width(), width()];
    let facets = TrowbridgeReitz::new(alpha);
    let cosine = [0.0, 1.0, random.next_f64(), random.next_f64().powi(8)];
    let cosine = cosine[usize::try_from(random.below(4)).expect("small")];
    let wo = view(cosine, TAU * random.next_f64());
    let coat = Lobe::Substrate(Substrate {
        diffuse: DVec3::ZERO,
        specular: DVec3::splat(0.5),
        facets,
    });
    let coat = alone(coat)
        .transformed_cosines(wo, DVec3::Z)
        .expect("known");
    let lobes = vec![
        facets.transformed_cosine(&Fresnel::Full, wo),
        coat.lobes()[0],
    ];
    (facets, wo, lobes)
}

/// Positive above the surface and zero below it, invertible, no more than all reflected by a masked
/// lobe; and, since the map keeps heights, all of it is above.
#[test]
fn lobes_are_densities_above_the_surface() {
    let mut random = SplitMix64::new(31);
    for _ in 0..5000 {
        let (facets, wo, lobes) = any_lobe(&mut random);
        assert!(
            lobes[0].albedo.max_element() <= 1.0 + 1e-6,
            "{facets:?} {wo}"
        );
        for lobe in lobes {
            let row = lobe.map.row(2);
            assert!(
                row.x.abs() + row.y.abs() <= 0.0 && row.z > 0.0,
                "{facets:?} {wo}"
            );
            assert!(lobe.map.determinant() > 0.0, "{facets:?} {wo}");
            assert!(lobe.albedo.is_finite() && lobe.albedo.min_element() >= 0.0);
            let w = DVec3::from_array(random.unit_vector());
            let p = lobe.density(w);
            assert!(
                p.is_finite() && (p > 0.0) == (w.z > 0.0),
                "{facets:?} {wo} {w}: {p}"
            );
        }
    }
}

/// χ² of M times directions drawn by the cosine against the density integrated in each cell, and
/// what all cells together hold, for lobes that the cells resolve.
#[test]
fn the_map_draws_by_the_density() {
    const CELLS: [u32; 2] = [16, 24];
    const COUNT: u32 = 50_000;
    let cases: Vec<_> = [[0.2, 0.2], [0.5, 0.5], [1.3, 1.3], [0.2, 0.7]]
        .into_iter()
        .flat_map(|alpha| [1.0, 0.6, 0.15].map(|cosine| (alpha, cosine)))
        .collect();
    let level = sidak(1e-3, cases.len());
    for (k, (alpha, cosine)) in cases.into_iter().enumerate() {
        let facets = TrowbridgeReitz::new(alpha);
        let lobe = facets.transformed_cosine(&Fresnel::Full, view(cosine, 0.7));
        let mut random = SplitMix64::new(50 + k as u64);
        let mut observed = vec![0u64; (CELLS[0] * CELLS[1]) as usize];
        for _ in 0..COUNT {
            let z = random.next_f64().sqrt();
            let w = (lobe.map * view(z, TAU * random.next_f64())).normalize();
            let turn = (w.y.atan2(w.x) / TAU).rem_euclid(1.0);
            let cell =
                |v: f64, cells: u32| (0..cells - 1).filter(|i| edge(*i + 1, cells) <= v).count();
            observed[cell(w.z, CELLS[0]) * CELLS[1] as usize + cell(turn, CELLS[1])] += 1;
        }
        let expected: Vec<f64> = (0..CELLS[0] * CELLS[1])
            .map(|cell| {
                let (i, j) = (cell / CELLS[1], cell % CELLS[1]);
                let ranges = [
                    [edge(i, CELLS[0]), edge(i + 1, CELLS[0])],
                    [edge(j, CELLS[1]), edge(j + 1, CELLS[1])],
                ];
                let density = |z: f64, turn: f64| lobe.density(view(z, TAU * turn)) * TAU;
                f64::from(COUNT) * cubature(density, ranges[0], ranges[1], 1e-7, 10).value
            })
            .collect();
        // 384 cells, each to 1e-7 or as far as ten halvings go.
        let whole = expected.iter().sum::<f64>() / f64::from(COUNT);
        assert!((whole - 1.0).abs() < 1e-4, "{alpha:?} {cosine}: {whole}");
        let test = chi2_test(&observed, &expected, 5.0);
        assert!(test.p_value > level, "{alpha:?} {cosine}: {test:?}");
    }
}

fn edge(i: u32, count: u32) -> f64 {
    f64::from(i) / f64::from(count)
}

/// ∫ f cos dω by cubature: of what is wide.
fn albedo(bsdf: &impl Reflection, wo: DVec3) -> f64 {
    let light = |z: f64, turn: f64| bsdf.eval(view(z, TAU * turn), wo, DVec3::Z).x * z * TAU;
    cubature(light, [0.0, 1.0], [0.0, 1.0], 1e-9, 14).value
}

/// The same in angles, of what has kinks where both directions are as low, and a quarter of a turn
/// from the viewer.
fn kinked_albedo(bsdf: &impl Reflection, wo: DVec3) -> f64 {
    let (low, away) = (wo.z.acos(), wo.y.atan2(wo.x));
    let light = |angle: f64, turn: f64| {
        let (sin, cos) = angle.sin_cos();
        bsdf.eval(view(cos, turn + away), wo, DVec3::Z).x * cos * sin
    };
    // By symmetry, half of the turns.
    let around = |angle: f64| {
        let part = |from, to| gauss_kronrod(|turn| light(angle, turn), from, to, 1e-12).value;
        2.0 * (part(0.0, FRAC_PI_2) + part(FRAC_PI_2, PI))
    };
    [(0.0, low), (low, FRAC_PI_2)]
        .into_iter()
        .filter(|(from, to)| from < to)
        .map(|(from, to)| gauss_kronrod(around, from, to, 1e-12).value)
        .sum()
}

/// Frostbite's diffuse albedo of white, with F90 at the mean of (ω_i·h)² over the cosine.
fn of_mean_scatter(roughness: f64, wo: DVec3) -> f64 {
    let square = |z: f64, turn: f64| {
        let wi = view(z, turn);
        wi.dot((wi + wo).normalize()).powi(2) * z * FRAC_1_PI
    };
    let around = |z: f64| gauss_kronrod(|turn| square(z, turn), 0.0, TAU, 1e-12).value;
    let mean = gauss_kronrod(around, 0.0, 1.0, 1e-12).value;
    let f90 = 0.5 * roughness + 2.0 * roughness * mean;
    let scatter = |c: f64| 1.0 + (f90 - 1.0) * (1.0 - c).powi(5);
    let e = gauss_kronrod(|c| 2.0 * scatter(c) * c, 0.0, 1.0, 1e-12);
    e.value * scatter(wo.z) * (1.0 - roughness + roughness / 1.51)
}

/// What counts as the cosine itself has the albedo of the reflection: exactly of Oren and Nayar's
/// and of a substrate's base, nearly of Frostbite's.
#[test]
fn diffuse_parts_have_their_albedos() {
    let grey = DVec3::splat(0.6);
    let black = DVec3::ZERO;
    for cosine in [1.0, 0.8, 0.3, 0.02] {
        let wo = view(cosine, 0.4);
        let diffuse = |lobe: Lobe| {
            alone(lobe)
                .transformed_cosines(wo, DVec3::Z)
                .expect("known")
                .diffuse
                .x
        };
        let rough = Lobe::OrenNayar(OrenNayar::new(grey, 0.6));
        let want = kinked_albedo(&alone(rough), wo);
        // Four integrals, each to 1e-12.
        assert_close!(diffuse(rough), want, rel = 1e-11, "{cosine}");
        // The base is what the coat alone does not reflect.
        let facets = TrowbridgeReitz::isotropic(0.3);
        let specular = DVec3::splat(0.1);
        let [with, without] = [grey, black].map(|diffuse| {
            Lobe::Substrate(Substrate {
                diffuse,
                specular,
                facets,
            })
        });
        let want = albedo(&alone(with), wo) - albedo(&alone(without), wo);
        assert!(
            (diffuse(with) / want - 1.0).abs() < 1e-6,
            "{cosine}: {want}"
        );
        for roughness in [0.5, 0.9] {
            let [with, without] =
                [grey, black].map(|c| Lobe::Frostbite(Frostbite::new(c, specular, roughness)));
            let want = albedo(&alone(with), wo) - albedo(&alone(without), wo);
            // F90 is taken at the mean of (ω_i·h)²: 4 % is what that costs at the horizon.
            let error = diffuse(with) / want - 1.0;
            assert!(error.abs() < 0.04, "{roughness} {cosine}: {error}");
            // All else is exact: two integrals, each to 1e-12.
            let want = grey.x * of_mean_scatter(roughness, wo);
            assert_close!(diffuse(with), want, rel = 1e-11, "{roughness} {cosine}");
        }
    }
}

/// The albedo of masked facets by quadrature, which falls short of one by what is reflected twice:
/// the table is it, also between its nodes.
#[test]
fn albedos_are_those_of_a_white_furnace() {
    let mut random = SplitMix64::new(8);
    for _ in 0..200 {
        let alpha = 10f64.powf(-3.0 + 3.2 * random.next_f64());
        let (facets, wo) = (
            TrowbridgeReitz::isotropic(alpha),
            view(random.next_f64(), 0.0),
        );
        let furnace: f64 = nodes(facets, wo, 100)
            .map(|(w, measure)| {
                let h = (w + wo).normalize();
                facets.reflection(h, w, wo) * w.z * measure
            })
            .sum();
        let got = facets.transformed_cosine(&Fresnel::Full, wo).albedo.x;
        assert!(
            (got / furnace - 1.0).abs() < 0.02,
            "{alpha} {wo}: {got} {furnace}"
        );
    }
}

/// Lobes with a closed form: as wide and as bright as they are, whichever way they come.
#[test]
fn closed_forms_are_their_lobes() {
    let (n, wo) = (DVec3::Z, view(0.8, 0.3));
    let lambert = Lambert {
        albedo: DVec3::splat(0.3),
    };
    let phong = Phong {
        specular: DVec3::splat(0.5),
        exponent: 200.0,
    };
    let both = Bsdf::Phong(lambert, phong);
    let mut layers = Layers::new(DVec3::X);
    layers.add_diffuse(lambert.albedo);
    assert!(layers.add(DVec3::ONE, Lobe::Phong(phong)));
    for bsdf in [both, Bsdf::Layers(layers)] {
        let cosines = bsdf.transformed_cosines(wo, n).expect("known");
        let [lobe] = cosines.lobes() else {
            panic!("one lobe")
        };
        assert!((cosines.diffuse - lambert.albedo).length() < 1e-15);
        let axis = cosines.frame.to_local(Phong::axis(wo, n));
        // Of 201/(2π) both, and the albedo k_s cos but for what is below the horizon.
        assert!((lobe.density(axis) / phong.pdf(1.0) - 1.0).abs() < 1e-12);
        assert!((lobe.albedo.x / 0.4 - 1.0).abs() < 1e-12, "{}", lobe.albedo);
    }
    assert!(
        Bsdf::Lambert(lambert)
            .transformed_cosines(wo, n)
            .expect("known")
            .lobes()
            .is_empty()
    );
    let gaussian = [0.0, 1.0, 1e3].map(|sharpness| ClosedLobe::Gaussian {
        scale: DVec3::ONE,
        axis: DVec3::Z,
        sharpness,
    });
    for lobe in gaussian {
        let form = linelit_bsdf::ClosedForm::new(lambert, std::slice::from_ref(&lobe));
        let cosines = form.transformed_cosines(wo, n);
        assert!(cosines.lobes()[0].albedo.x > 0.0 && cosines.lobes()[0].density(DVec3::Z) > 0.0);
    }
}

/// What is fitted, and where quadrature looks, biases nothing: a wrong formula adds noise. Sums
/// over three views, of squares of entries of maps with albedos, and of knots along a line; of a
/// Gaussian in place of the latter.
#[test]
fn fits_and_peaks_are_frozen() {
    let (n, ends) = (DVec3::Z, [[-1.0, 0.2, 0.6], [1.5, 0.7, 0.9]]);
    let line = Segment::new(ends[0].into(), ends[1].into());
    let facets = TrowbridgeReitz::new([0.12, 0.2]);
    let f0 = DVec3::splat(0.1);
    let mirror = |fresnel| {
        let reflectance = DVec3::splat(0.7);
        Lobe::Reflector(Reflector {
            reflectance,
            facets,
            fresnel,
        })
    };
    let (specular, exponent) = (f0, 400.0);
    let models = [
        mirror(Fresnel::Full),
        mirror(Fresnel::Schlick { f0, f90: 1.0 }),
        mirror(Fresnel::Dielectric { eta: 0.7 }),
        Lobe::Frostbite(Frostbite::new(f0, f0, 0.4)),
        Lobe::Substrate(Substrate {
            diffuse: f0,
            specular,
            facets,
        }),
        Lobe::Phong(Phong { specular, exponent }),
    ];
    let size = |lobe: &LtcLobe| {
        let entries = lobe.map.to_cols_array().into_iter().enumerate();
        entries.map(|(k, x)| (k + 1) as f64 * x * x).sum::<f64>() + 100.0 * lobe.albedo.x
    };
    let mut found = [[0.0; 2]; 7];
    for cosine in [1.0, 0.7, 0.2] {
        let wo = view(cosine, 0.4);
        for ([fit, knots], model) in found.iter_mut().zip(models) {
            let bsdf = alone(model);
            let cosines = bsdf.transformed_cosines(wo, n).expect("known");
            *fit += cosines.lobes().iter().map(size).sum::<f64>();
            let peaks = bsdf.peaks(&line, wo, n).expect("known");
            *knots += peaks
                .knots()
                .enumerate()
                .map(|(k, t)| (k + 1) as f64 * t)
                .sum::<f64>();
        }
        for (sum, sharpness) in found[6].iter_mut().zip([1.0, 30.0]) {
            let lobe = ClosedLobe::Gaussian {
                scale: f0,
                axis: wo,
                sharpness,
            };
            let flat = Lambert { albedo: f0 };
            let form = linelit_bsdf::ClosedForm::new(flat, std::slice::from_ref(&lobe));
            *sum += size(&form.transformed_cosines(wo, n).lobes()[0]);
        }
    }
    for (got, want) in found.iter().flatten().zip(FROZEN.iter().flatten()) {
        assert_close!(*got, *want, rel = 1e-12, "{found:?}");
    }
}

/// Full, Schlick's and total reflection, Frostbite's material, a substrate, Phong's lobe; two
/// Gaussians.
const FROZEN: [[f64; 2]; 7] = [
    [290.407_549_891_131_1, 8.262_549_128_327_25],
    [124.880_204_395_068_56, 8.262_549_128_327_25],
    [185.737_314_039_598_12, 8.262_549_128_327_25],
    [122.766_680_203_103_59, 5.430_595_152_564_832],
    [157.959_363_752_390_74, 18.333_011_132_590_073],
    [43.386_247_648_088_045, 21.158_067_435_904_066],
    [104.690_260_418_206_07, 29.643_409_891_934_915],
];

/// Of a model that says nothing, nothing is known.
#[test]
fn foreign_models_are_the_cosine() {
    struct Foreign;
    impl Reflection for Foreign {
        fn eval(&self, wi: DVec3, _: DVec3, n: DVec3) -> DVec3 {
            DVec3::splat(wi.dot(n) * FRAC_1_PI)
        }
        fn sample(&self, _: [f64; 2], _: DVec3, n: DVec3) -> Option<DVec3> {
            Some(n)
        }
        fn pdf(&self, _: DVec3, _: DVec3, _: DVec3) -> f64 {
            1.0
        }
    }
    let n = DVec3::new(0.6, 0.0, 0.8);
    assert_eq!(Foreign.transformed_cosines(DVec3::Z, n), None);
}

/// For reflectors that do not count as unlike their LTCs, samples by these have a mean square of
/// weights below 8, for any widths. Of the reflectors that do, two thirds and more (69 %) have
/// above four, up to millions.
#[test]
fn what_is_unlike_is_said() {
    let mut random = SplitMix64::new(11);
    let (mut unlike, mut high) = (0, 0);
    for _ in 0..5000 {
        let mut any = |low: f64, high: f64| low + (high - low) * random.next_f64();
        let alpha = [any(-3.5, 0.0), any(-3.5, 0.0)].map(|e| 10f64.powf(e));
        let wo = view(any(0.1, 1.0), any(0.0, TAU));
        let mirror = Reflector {
            reflectance: DVec3::ONE,
            facets: TrowbridgeReitz::new(alpha),
            fresnel: Fresnel::Full,
        };
        let mut layers = Layers::new(DVec3::X);
        assert!(layers.add(DVec3::ONE, Lobe::Reflector(mirror)));
        let bsdf = Bsdf::Layers(layers);
        let cosines = bsdf.transformed_cosines(wo, DVec3::Z).expect("known");
        let lobe = cosines.lobes()[0];
        // ∫ (f cos)²/p over the albedo, by directions of f cos.
        let mut weight = || {
            let u = [random.next_f64(), random.next_f64()];
            let wi = bsdf.sample(u, wo, DVec3::Z).filter(|wi| wi.z > 0.0)?;
            let f = bsdf.eval(wi, wo, DVec3::Z).x * wi.z;
            Some(f / (lobe.albedo.x * lobe.density(cosines.frame.to_local(wi))))
        };
        let weights: Vec<f64> = (0..400).filter_map(|_| weight()).collect();
        #[allow(clippy::cast_precision_loss, reason = "at most 400")]
        let square = weights.iter().sum::<f64>() / weights.len() as f64;
        if bsdf.known(wo, DVec3::Z).is_unlike_cosines() {
            (unlike, high) = (unlike + 1, high + u32::from(square > 4.0));
        } else {
            assert!(square < 8.0, "{alpha:?}, {wo}: {square}");
        }
    }
    assert!(unlike > 1000 && 3 * high > 2 * unlike, "{high} of {unlike}");
}

/// Returns half of ∫ |f cos − g| dω over the albedo: the fraction of the light that a sum of LTCs
/// has in wrong directions, lacks or has in excess, on the midpoints of 400 by 400 squares.
fn misplaced(bsdf: &Bsdf, cosines: &LtcMixture, wo: DVec3) -> f64 {
    let (mut seen, mut fitted) = (Vec::new(), Vec::new());
    let middle = |i: u32| (f64::from(i) + 0.5) / 400.0;
    for i in 0..400 * 400 {
        // Equal shares of the measure cos dω.
        let w = view(middle(i / 400).sqrt(), TAU * middle(i % 400));
        let local = cosines.frame.to_local(w);
        let lobes = cosines.lobes().iter();
        let lobes: f64 = lobes.map(|lobe| lobe.albedo.x * lobe.density(local)).sum();
        seen.push(bsdf.eval(w, wo, DVec3::Z).x);
        fitted.push(cosines.diffuse.x * FRAC_1_PI + lobes / w.z);
    }
    let apart = seen.iter().zip(&fitted).map(|(f, g)| (f - g).abs());
    0.5 * apart.sum::<f64>() / seen.iter().sum::<f64>()
}

/// At most a fifth of the light is in wrong directions, from grazing angles to above (.04 to .17;
/// sums over nodes leave less than .01); a cosine alone has up to four fifths there.
#[test]
fn any_isotropic_reflection_is_fitted() {
    let mut worst = 0.0_f64;
    for (name, bsdf) in fitted_reflections() {
        let fit = LtcFit::new(&bsdf);
        for cosine in [0.15, 0.4, 0.75, 0.97] {
            let wo = view(cosine, 0.7);
            let fitted = fit.transformed_cosines(wo, DVec3::Z);
            let albedo = fitted.lobes().iter().map(|lobe| lobe.albedo).sum::<DVec3>();
            let flat = LtcMixture::new(fitted.frame, fitted.diffuse + albedo);
            let share = misplaced(&bsdf, &fitted, wo);
            assert!(share < 0.2, "{name}, {cosine}: {share}");
            worst = worst.max(misplaced(&bsdf, &flat, wo));
        }
    }
    assert!(worst > 0.7, "{worst}");
}

fn fitted_reflections() -> Vec<(&'static str, Bsdf)> {
    let rough = |alpha: f64, diffuse: f64| {
        let mirror = Reflector {
            reflectance: DVec3::ONE,
            facets: TrowbridgeReitz::isotropic(alpha),
            fresnel: Fresnel::Dielectric { eta: 1.0 / 1.5 },
        };
        let mut layers = Layers::new(DVec3::X);
        assert!(layers.add(DVec3::ONE, Lobe::Reflector(mirror)));
        let under = OrenNayar::new(DVec3::splat(diffuse), 0.3);
        assert!(layers.add(DVec3::ONE, Lobe::OrenNayar(under)));
        Bsdf::Layers(layers)
    };
    let phong = Phong {
        specular: DVec3::splat(0.4),
        exponent: 30.0,
    };
    let albedo = DVec3::splat(0.3);
    vec![
        ("narrow facets", rough(0.1, 0.1)),
        ("facets", rough(0.3, 0.4)),
        ("wide facets", rough(0.5, 0.2)),
        ("Phong", Bsdf::Phong(Lambert { albedo }, phong)),
    ]
}
