//! Spheres and disks: closed forms, visible parts, and triangles that reach into a sphere.

use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{Bsdf, Fresnel, Lambert, Layers, Lobe, Phong, Reflection, Reflector};
use linelit_estimators::estimate;
use linelit_estimators::{Buffers, LightSource, NoTexture, Query, RandomNumbers, ShadingPoint};
use linelit_geometry::DVec3;
use linelit_lights::{Disk, DiskLight, Emission, Light, Sphere, SphereLight};
use linelit_samplers::SamplerKind;
use linelit_testkit::chi2::sidak;
use linelit_testkit::ztest::{Welford, critical_z, z_score_two};
use linelit_visibility::Occluders;

pub(crate) fn matte() -> Lambert {
    Lambert {
        albedo: DVec3::splat(0.5),
    }
}

pub(crate) fn glossy() -> Bsdf {
    let specular = DVec3::splat(0.4);
    Bsdf::Phong(
        matte(),
        Phong {
            specular,
            exponent: 12.0,
        },
    )
}

fn sphere(center: [f64; 3], radius: f64) -> Light {
    let center = center.into();
    Light::Sphere(SphereLight {
        sphere: Sphere { center, radius },
        radiance: DVec3::ONE,
    })
}

fn disk(center: [f64; 3], normal: [f64; 3], radius: f64) -> Light {
    let (center, normal) = (center.into(), DVec3::from(normal).normalize());
    Light::Disk(DiskLight {
        disk: Disk {
            center,
            normal,
            radius,
        },
        emission: Emission::one_sided(DVec3::ONE),
    })
}

/// Estimates by many seeds, and the counters.
pub(crate) fn estimates<R: Reflection>(
    occluders: &Occluders,
    light: &Light,
    point: &ShadingPoint<R>,
    text: &str,
    samples: u32,
    seeds: std::ops::Range<u64>,
) -> (Welford, Buffers) {
    let source = LightSource::<NoTexture>::new(light);
    let (estimator, mut buffers) = (text.parse().expect("an estimator"), Buffers::default());
    let one = |seed| {
        let numbers = RandomNumbers::new(SamplerKind::Stratified, seed, [0, 0], 0);
        let query = Query::new(occluders, &source, point, &estimator, numbers, samples);
        estimate(&query, &mut buffers).element_sum()
    };
    (seeds.map(one).collect(), buffers)
}

pub(crate) fn nothing() -> Occluders {
    Occluders::build(&[], &[])
}

/// A diffuse surface that sees all of a round light takes no samples, and has the mean of points.
#[test]
fn whole_round_lights_are_in_closed_form() {
    let view = DVec3::new(0.0, 0.6, 0.8);
    let lights = [
        (sphere([0.3, 0.4, 1.5], 0.5), DVec3::Z),
        (sphere([1.2, 0.4, 0.2], 0.5), DVec3::Z),
        (sphere([1.2, 0.4, -0.1], 0.5), DVec3::Z),
        (disk([0.3, 0.4, 1.5], [0.3, 0.1, -1.0], 0.5), DVec3::Z),
        (
            disk([1.0, 0.4, 0.7], [-1.0, 0.1, -0.2], 0.4),
            DVec3::new(0.1, 0.0, 1.0).normalize(),
        ),
    ];
    let bound = critical_z(sidak(1e-4, lights.len()));
    for (light, normal) in &lights {
        let point = ShadingPoint::new(DVec3::ZERO, *normal, view, Bsdf::Lambert(matte()));
        let (closed, buffers) = estimates(&nothing(), light, &point, "exact", 4, 0..8);
        assert_eq!(buffers.counts.plan.closed_form, 8, "{light:?}");
        assert!(
            closed.variance() == 0.0 && closed.mean() > 0.001,
            "{light:?}"
        );
        let (points, _) = estimates(&nothing(), light, &point, "point-area", 1024, 0..128);
        let z = z_score_two(&points, &closed);
        assert!(z.abs() < bound, "{light:?}: {z}, {closed:?} for {points:?}");
    }
}

/// Lambert's formula for a disk overhead, and Nusselt's formula for a sphere.
#[test]
fn closed_forms_are_those_of_the_books() {
    let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, DVec3::Z, Bsdf::Lambert(matte()));
    let of = |light| {
        estimates(&nothing(), &light, &point, "exact", 1, 0..1)
            .0
            .mean()
    };
    // 3 channels of ρ/π × π r²/(h² + r²), and of ρ/π × π r²/d².
    let (above, ball) = (
        of(disk([0.0, 0.0, 2.0], [0.0, 0.0, -1.0], 1.0)),
        of(sphere([0.0, 0.0, 2.0], 1.0)),
    );
    assert!((above - 1.5 / 5.0).abs() < 1e-14, "{above}");
    assert!((ball - 1.5 / 4.0).abs() < 1e-14, "{ball}");
}

/// A rectangle across z.
fn rectangle(x: [f32; 2], y: [f32; 2], z: f32, from: u32) -> ([[f32; 3]; 4], [[u32; 3]; 2]) {
    let corners = [
        [x[0], y[0], z],
        [x[1], y[0], z],
        [x[1], y[1], z],
        [x[0], y[1], z],
    ];
    (
        corners,
        [[from, from + 1, from + 2], [from, from + 2, from + 3]],
    )
}

pub(crate) fn rectangles(all: &[Rectangle]) -> Occluders {
    let (mut corners, mut triangles) = (Vec::new(), Vec::new());
    for (x, y, z) in all {
        let (c, t) = rectangle(*x, *y, *z, u32::try_from(corners.len()).expect("few"));
        corners.extend(c);
        triangles.extend(t);
    }
    Occluders::build(&corners, &triangles)
}

pub(crate) type Rectangle = ([f32; 2], [f32; 2], f32);

pub(crate) const WIDE: [f32; 2] = [-3.0, 3.0];

/// Occluders in front of or in a sphere 1.5 above with the radius 0.5, and whether a shaft can
/// answer for it. Its outline is at 1.333, and its nearest point at 1.
const INTRUDERS: [(&str, &[Rectangle], bool); 7] = [
    ("before it", &[([0.1, 3.0], WIDE, 0.75)], true),
    (
        "inside, before the outline",
        &[([-0.2, 0.2], [-0.2, 0.2], 1.2)],
        false,
    ),
    (
        "inside, all of the outline's cone",
        &[([-0.34, 0.34], [-0.34, 0.34], 1.15)],
        false,
    ),
    (
        "cuts in before the outline",
        &[([-3.0, 0.05], WIDE, 1.25)],
        false,
    ),
    ("a plane through it", &[(WIDE, WIDE, 1.2)], false),
    ("hides it at its nearest point", &[(WIDE, WIDE, 0.9)], true),
    (
        "inside, and one before it",
        &[([-0.2, 0.2], [-0.2, 0.2], 1.25), ([0.05, 3.0], WIDE, 0.5)],
        false,
    ),
];

/// The first two estimators take points with rays at once, without a shaft.
const TEXTS: [&str; 13] = [
    "line-area",
    "line-analytic",
    "exact",
    "hybrid",
    "point-ltc[visibility=shaft]",
    "point-ltc+point-bsdf",
    "point-solid-angle[visibility=shaft]",
    "point-solid-angle+point-bsdf",
    "line-solid-angle+point-bsdf",
    "line-area[orientation=spread:2]+point-bsdf[mis=smooth]",
    "line-area+point-projected-solid-angle[mis=optimal]",
    "exact+point-bsdf",
    "hybrid+line-area[mis=power]",
];

/// Points on a sphere's far side contribute nothing, also if LTCs are known.
#[test]
fn the_far_side_of_a_sphere_takes_nothing_off() {
    let light = sphere([0.0, 0.0, 1.5], 0.5);
    let occluders = rectangles(INTRUDERS[0].1);
    let all = crate::agreement::materials();
    let (_, plastic) = all
        .iter()
        .find(|(name, _)| *name == "plastic")
        .expect("one");
    let (x, wo) = (DVec3::new(0.05, 0.1, 0.0), DVec3::new(-0.6, 0.0, 0.8));
    let point = ShadingPoint::new(x, DVec3::Z, wo, plastic.clone());
    let (want, _) = estimates(&occluders, &light, &point, "point-area", 1024, 1000..1128);
    let texts = ["exact+point-area", "hybrid:2+point-area", "exact"];
    let bound = critical_z(sidak(1e-4, texts.len()));
    for text in texts {
        let (got, _) = estimates(&occluders, &light, &point, text, 32, 0..512);
        let z = z_score_two(&got, &want);
        assert!(z.abs() < bound, "{text}: {z}, {got:?} for {want:?}");
    }
}

/// No matter which triangles are inside a sphere or cut into it, every estimator gives the light of
/// points by area with a ray each.
#[test]
fn what_reaches_into_a_sphere_hides_as_rays_say() {
    let light = sphere([0.0, 0.0, 1.5], 0.5);
    let bound = critical_z(sidak(1e-4, INTRUDERS.len() * TEXTS.len() * 2));
    for (name, occluders, by_lines) in INTRUDERS {
        let occluders = rectangles(occluders);
        for bsdf in [Bsdf::Lambert(matte()), glossy()] {
            let x = DVec3::new(0.05, 0.1, 0.0);
            let point = ShadingPoint::new(x, DVec3::Z, DVec3::new(-0.6, 0.0, 0.8), bsdf);
            let (want, _) = estimates(&occluders, &light, &point, "point-area", 1024, 1000..1128);
            for text in TEXTS {
                let (got, buffers) = estimates(&occluders, &light, &point, text, 32, 0..128);
                let plan = &buffers.counts.plan;
                let is_told = by_lines || TEXTS[..2].contains(&text);
                assert_eq!(plan.spheres_by_rays == 0, is_told, "{name}, {text}: {plan}");
                if want.mean() == 0.0 {
                    assert!(got.mean() == 0.0, "{name}, {text}: {got:?}");
                    continue;
                }
                let z = z_score_two(&got, &want);
                assert!(
                    z.abs() < bound,
                    "{name}, {text}: z {z}, {got:?} for {want:?}"
                );
            }
        }
    }
}

/// The horizon cuts round lights; and the point is inside a sphere, or behind a disk.
#[test]
fn horizons_cut_round_lights() {
    let view = DVec3::new(-0.6, 0.0, 0.8);
    let tilted = DVec3::new(0.5, 0.0, 0.8).normalize();
    let texts = ["line-area", "exact", "line-projected+point-bsdf"];
    let lights = [
        sphere([0.8, 0.1, 0.1], 0.6),
        disk([0.8, 0.1, 0.1], [-1.0, 0.2, 0.3], 0.6),
    ];
    let bound = critical_z(sidak(1e-4, texts.len() * lights.len()));
    for light in &lights {
        let mut point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, view, glossy());
        point.normal = tilted;
        let (want, _) = estimates(&nothing(), light, &point, "point-area", 1024, 1000..1256);
        for text in texts {
            let (got, _) = estimates(&nothing(), light, &point, text, 32, 0..256);
            let z = z_score_two(&got, &want);
            assert!(
                z.abs() < bound,
                "{text}: z {z}, {got:?} for {want:?} of {light:?}"
            );
        }
    }
    let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, view, glossy());
    for light in [
        sphere([0.0, 0.0, 0.2], 0.5),
        disk([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], 0.5),
    ] {
        for text in texts {
            let (got, _) = estimates(&nothing(), &light, &point, text, 4, 0..4);
            assert!(got.mean() == 0.0, "{text}: {got:?} of {light:?}");
        }
    }
}

/// A rough conductor alone, whose lobe is sampled without any other density.
fn rough(alpha: f64) -> Bsdf {
    let mut layers = Layers::new(DVec3::X);
    let lobe = Reflector {
        reflectance: DVec3::ONE,
        facets: TrowbridgeReitz::isotropic(alpha),
        fresnel: Fresnel::Schlick {
            f0: DVec3::splat(0.6),
            f90: 1.0,
        },
    };
    assert!(layers.add(DVec3::ONE, Lobe::Reflector(lobe)));
    Bsdf::Layers(layers)
}

/// Rectangles that hide about half of the lights, cross their rims, and touch each other on them.
const BEFORE: [Rectangle; 4] = [
    ([-0.1, 0.1], [-3.0, 0.125], 0.5),
    ([0.1, 0.5], [0.0, 0.25], 0.5),
    ([-0.75, -0.25], [-0.25, 0.5], 0.375),
    ([0.25, 0.375], [-0.5, -0.125], 0.625),
];

/// The visible part behind occluders is integrated in closed form: for large and small lights,
/// above the horizon and clipped by one or two horizons, seen from both sides, on diffuse and on
/// rough surfaces.
#[test]
fn what_is_visible_is_that_of_points() {
    let tilted = DVec3::new(0.6, 0.0, 0.8);
    let mut two_sided = disk([0.1, 0.2, 1.5], [0.2, 0.1, 1.0], 0.75);
    if let Light::Disk(light) = &mut two_sided {
        light.emission.two_sided = true;
    }
    let lights = [
        sphere([0.1, 0.2, 1.5], 0.5),
        sphere([0.1, 0.2, 50.0], 20.0),
        sphere([0.1, 0.0, 1.5], 2e-3),
        sphere([1.25, 0.1, 0.25], 0.75),
        disk([0.1, 0.2, 1.5], [0.0, 0.0, -1.0], 0.5),
        disk([0.1, 0.2, 1.0], [0.0, 0.0, -1.0], 30.0),
        disk([1.0, 0.1, 0.25], [-1.0, 0.1, 0.1], 0.75),
        disk([0.1, 0.2, 1.5], [0.0, 0.999, -0.04], 0.5),
        two_sided,
    ];
    let bsdfs = [Bsdf::Lambert(matte()), rough(0.4), rough(0.1), glossy()];
    let bound = critical_z(sidak(1e-4, lights.len() * bsdfs.len() * 4 * 3));
    for (light, bsdf) in lights
        .iter()
        .flat_map(|l| bsdfs.iter().map(move |b| (l, b)))
    {
        for (before, normal) in [(0, DVec3::Z), (4, DVec3::Z), (0, tilted), (4, tilted)] {
            let occluders = rectangles(&BEFORE[..before]);
            let wo = DVec3::new(-0.6, 0.0, 0.8);
            let mut point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, wo, bsdf.clone());
            point.normal = normal;
            let of =
                |text, samples, seeds| estimates(&occluders, light, &point, text, samples, seeds);
            let (want, _) = of("point-solid-angle", 512, 1000..1064);
            for text in ["exact", "hybrid", "point-ltc"] {
                let (got, buffers) = of(text, 32, 0..128);
                let what = format!("{text} of {light:?} on {bsdf:?}, {before} before, {normal}");
                let plan = &buffers.counts.plan;
                assert_eq!(plan.exact_fallbacks, 0, "{what}");
                let diffuse = matches!(bsdf, Bsdf::Lambert(_));
                if text == "exact" && diffuse {
                    // Rounding, divided by the square of the smallest light's width, which is
                    // 1.3e-3.
                    assert!(
                        got.variance().sqrt() <= 1e-9 * got.mean(),
                        "{what}: {got:?}"
                    );
                }
                let z = z_score_two(&got, &want);
                assert!(z.abs() < bound, "{what}: z {z}, {got:?} for {want:?}");
            }
        }
    }
}

/// Lights that are too small, or seen too flatly, for sums over boundaries are sampled by points.
#[test]
fn tiny_and_flat_lights_are_handed_to_points() {
    let occluders = rectangles(&[([0.0, 3.0], WIDE, 0.5)]);
    let lights = [
        sphere([0.0, 0.0, 1.5], 1e-5),
        disk([1.0, 0.0, 1e-6], [0.0, 0.0, -1.0], 0.5),
    ];
    for light in lights {
        for bsdf in [Bsdf::Lambert(matte()), rough(0.3)] {
            let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, DVec3::Z, bsdf);
            let [exact, points] = ["exact", "point-solid-angle"].map(|text| {
                let (values, buffers) = estimates(&occluders, &light, &point, text, 8, 0..512);
                // These points see it past the occluder; the disk is below it.
                let is_behind = text == "exact" && matches!(light, Light::Sphere(_));
                let fell_back = buffers.counts.plan.exact_fallbacks > 0;
                assert_eq!(fell_back, is_behind, "{light:?}");
                values
            });
            // α = 1e-4 for the four tests together.
            let z = z_score_two(&exact, &points);
            assert!(z.abs() < critical_z(sidak(1e-4, 4)), "{light:?}: {z}");
        }
    }
}

/// On a rough conductor, with four samples across a penumbra, the standard deviation is less than 2
/// % of the light, and the variance is less than a fiftieth of the variance of lines. (Where the
/// light is seen as a whole, stratified points leave hardly any noise of a smooth difference.)
#[test]
fn penumbrae_of_spheres_are_as_smooth_as_light() {
    let light = sphere([0.3, 0.0, 2.0], 0.3);
    let occluders = rectangles(&[([-3.0, 0.3], WIDE, 1.0)]);
    for alpha in [0.05, 0.1, 0.2, 0.5] {
        let [mut exact, mut lines, mut square] = [0.0; 3];
        for i in 0..12 {
            let x = DVec3::X * (0.1 + 0.04 * f64::from(i));
            let point = ShadingPoint::new(x, DVec3::Z, DVec3::new(-0.2, 0.0, 0.98), rough(alpha));
            let of = |text| estimates(&occluders, &light, &point, text, 4, 0..512).0;
            let values = of("exact");
            exact += values.variance();
            square += values.mean() * values.mean();
            lines += of("line-area").variance();
        }
        assert!(exact < 4e-4 * square && exact < 0.02 * lines, "{alpha}");
    }
}
