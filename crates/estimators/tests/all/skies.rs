//! Delta lights and skies: closed forms, shadows, brute force, and profiles.

use crate::linear_lights::reflections;
use crate::round::{estimates, glossy, matte, nothing, rectangles};
use linelit_bsdf::Bsdf;
use linelit_estimators::{
    Buffers, Estimator, KnownKind, LightKind, LightSource, MethodFacts, NoTexture, PlanCounters,
    Query, RandomNumbers, ShadingPoint, estimate,
};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame};
use linelit_lights::{
    AreaLight, Cylinder, CylinderLight, Disk, DiskLight, DistantLight, Emission, Falloff, Light,
    PointLight, Profile, ProfileKind, Sky, SkyEmission, SkyImage, SkyMapping, Sphere, SphereLight,
};
use linelit_samplers::SamplerKind;
use linelit_testkit::chi2::sidak;
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::ztest::{Welford, critical_z, z_score_two};
use linelit_visibility::{Occluders, Ray, Scratch};
use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

const VIEW: DVec3 = DVec3::new(-0.6, 0.0, 0.8);
const SCENE: Sphere = Sphere {
    center: DVec3::ZERO,
    radius: 10.0,
};

const TEXTS: [&str; 16] = [
    "point-area",
    "point-solid-angle",
    "point-projected-solid-angle",
    "point-ltc",
    "point-texture",
    "point-bsdf",
    "point-linear",
    "line-area",
    "line-solid-angle[mis=balance]",
    "line-analytic",
    "exact",
    "hybrid",
    "hybrid+point-bsdf",
    "point-area+point-bsdf[mis=power]",
    "line-area+point-bsdf[mis=smooth]",
    "point-texture+point-projected-solid-angle+point-bsdf[mis=optimal]",
];

fn point(bsdf: Bsdf) -> ShadingPoint {
    ShadingPoint::new(DVec3::ZERO, DVec3::Z, VIEW, bsdf)
}

fn lamp(position: DVec3, profile: Option<ProfileKind>, axis: DVec3) -> Light {
    let profile = profile.map(|kind| Arc::new(Profile::new(kind, Frame::from_normal(axis))));
    Light::Point(PointLight {
        position,
        intensity: DVec3::splat(3.0),
        profile,
    })
}

fn distant(direction: DVec3) -> Light {
    Light::Distant(DistantLight {
        direction: direction.normalize(),
        irradiance: DVec3::splat(2.0),
        scene: SCENE,
    })
}

fn sky(emission: SkyEmission, portal: Option<ConvexPolygon>) -> Light {
    Light::Sky(Sky {
        emission,
        portal,
        scene: SCENE,
    })
}

fn sun(half_angle: f64) -> SkyEmission {
    SkyEmission::Sun {
        direction: DVec3::new(0.3, 0.4, 1.2).normalize(),
        half_angle,
        radiance: DVec3::splat(5.0),
    }
}

/// A smooth image with a bright spot.
fn image(mapping: SkyMapping, size: [usize; 2], sharp: i32) -> SkyEmission {
    let pixel = |k: usize| {
        let [x, y] = [k % size[0], k / size[0]].map(|c| c as f32);
        let wave = 1.0 + (0.4 * x).sin() * (0.3 * y).cos();
        let spot = [size[0] / 3, size[1] / 4].map(|c| c as f32);
        let square = (x - spot[0]).powi(2) + (y - spot[1]).powi(2);
        let bright = 30.0 * (1.0 / (1.0 + square)).powi(sharp);
        [wave + bright, wave, 0.5 * wave + bright]
    };
    let pixels = (0..size[0] * size[1]).map(pixel).collect();
    let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    let image = SkyImage::new(mapping, size, pixels, turn, DVec3::ONE);
    SkyEmission::Image(Arc::new(image.expect("good pixels")))
}

/// A delta light takes one ray and has no noise, by any estimator: it gives I cos θ f/d² or E cos θ
/// f, and zero in shadow. Spots of all three kinds are tested between their cones.
#[test]
fn lights_without_size_are_exact() {
    let at = DVec3::new(0.6, 0.0, 2.0);
    let cone = |falloff| ProfileKind::Cone {
        cos_inner: 0.98,
        cos_outer: 0.9,
        falloff,
    };
    let cos = at.z / at.length();
    // The axis points straight down, and the point is at the fraction t between the cones.
    let t = (cos - 0.9) / (0.98 - 0.9);
    let falloffs = [
        (None, 1.0),
        (Some(cone(Falloff::Smooth)), t * t * (3.0 - 2.0 * t)),
        (Some(cone(Falloff::Quartic)), t.powi(4)),
        (Some(cone(Falloff::Quadratic)), t * t),
        (Some(ProfileKind::CosinePower(3.0)), cos.powi(3)),
    ];
    let albedo = 0.5 * FRAC_1_PI;
    let plain = Bsdf::Lambert(matte());
    let lamps = falloffs.map(|(profile, factor)| {
        let want = 3.0 * factor * cos / at.length_squared() * albedo;
        (lamp(at, profile, DVec3::NEG_Z), want, at)
    });
    let direction = DVec3::new(-0.3, 0.5, 0.8).normalize();
    let far = (
        distant(direction),
        2.0 * direction.z * albedo,
        direction * 4.0,
    );
    for (light, want, towards) in lamps.iter().chain([&far]) {
        for text in TEXTS {
            let (got, _) = estimates(&nothing(), light, &point(plain.clone()), text, 4, 0..4);
            assert!(got.variance() < f64::MIN_POSITIVE, "{text}");
            assert!(
                (got.mean() / (3.0 * want) - 1.0).abs() < 1e-12,
                "{text} {light:?}"
            );
            // One plate is between, and one is beyond the lamp or to the side.
            let [x, y, z] = (*towards * 0.5).as_vec3().to_array();
            let before = rectangles(&[([x - 0.1, x + 0.1], [y - 0.1, y + 0.1], z)]);
            let (dark, _) = estimates(&before, light, &point(plain.clone()), text, 4, 0..2);
            assert_eq!(dark.mean().to_bits(), 0, "{text} {light:?}");
            let beside = rectangles(&[([x + 0.2, x + 0.4], [y - 0.1, y + 0.1], z)]);
            let (lit, _) = estimates(&beside, light, &point(plain.clone()), text, 4, 0..2);
            assert_eq!(
                lit.mean().to_bits(),
                got.mean().to_bits(),
                "{text} {light:?}"
            );
        }
        let beyond = rectangles(&[([-5.0, 5.0], [-5.0, 5.0], 3.0)]);
        let (got, _) = estimates(&beyond, light, &point(plain.clone()), "hybrid", 1, 0..1);
        // It hides parallel light, and is farther away than the lamps.
        assert_eq!(got.mean() > 0.0, matches!(light, Light::Point(_)));
        // The light is below the horizon.
        let mut below = point(plain.clone());
        (below.normal, below.geometric_normal) = (-DVec3::Z, -DVec3::Z);
        let source = LightSource::<NoTexture>::new(light);
        assert!(!source.reaches(&below, &mut PlanCounters::default()));
    }
}

/// A constant sky over a diffuse surface gives albedo times radiance, without noise if it is
/// sampled by the cosine; over half of the sky, it gives half of that. A sun of any size gives π L
/// sin² cos.
#[test]
fn skies_are_those_of_the_books() {
    let albedo = 0.5;
    let constant = sky(SkyEmission::Constant(DVec3::splat(2.0)), None);
    let surface = point(Bsdf::Lambert(matte()));
    let one = "point-projected-solid-angle";
    let (whole, _) = estimates(&nothing(), &constant, &surface, one, 4, 0..8);
    assert!((whole.mean() / (3.0 * 2.0 * albedo) - 1.0).abs() < 1e-12);
    assert!(whole.std_dev() < 1e-12, "{}", whole.std_dev());
    // An endless wall in the plane x = 0 leaves half of the light.
    let far = 1e6_f32;
    let corners = [[-far, -far], [far, -far], [far, far], [-far, far]];
    let wall = Occluders::build(&corners.map(|[y, z]| [1e-3, y, z]), &[[0, 1, 2], [0, 2, 3]]);
    let bound = critical_z(sidak(1e-4, 2 + TEXTS.len()));
    let light = sky(SkyEmission::Constant(DVec3::splat(2.0)), None);
    let (half, _) = estimates(&wall, &light, &surface, one, 64, 0..64);
    assert!(half.z_score(3.0 * albedo).abs() < bound, "{half:?}");
    for half_angle in [1e-4, 0.004_65, 0.4] {
        let light = sky(sun(half_angle), None);
        let cos = DVec3::new(0.3, 0.4, 1.2).normalize().z;
        let want = 3.0 * 5.0 * half_angle.sin().powi(2) * cos * albedo;
        for text in TEXTS {
            let (got, _) = estimates(&nothing(), &light, &surface, text, 64, 0..64);
            // The cosines of points of a cap vary, one stratum each.
            let error = (got.mean() / want - 1.0).abs();
            let allowed = bound * got.standard_error() / want + 1e-9;
            assert!(error <= allowed || text == "point-bsdf", "{text}: {error}");
        }
    }
}

/// The light of a sky by directions that are uniform over the sphere, or over a sun, stratified.
fn brute(occluders: &Occluders, sky: &Sky, point: &ShadingPoint, batches: u64) -> Welford {
    const SIDE: u32 = 48;
    let mut scratch = Scratch::default();
    let mut rng = SplitMix64::new(77);
    let (axis, height) = match sky.emission {
        SkyEmission::Sun {
            direction,
            half_angle,
            ..
        } => (direction, 1.0 - half_angle.cos()),
        _ => (DVec3::Z, 2.0),
    };
    let frame = Frame::from_normal(axis);
    let mut batch = |_| {
        let mut sum = 0.0;
        for k in 0..SIDE * SIDE {
            let [i, j] = [k % SIDE, k / SIDE].map(f64::from);
            let u = [i + rng.next_f64(), j + rng.next_f64()].map(|u| u / f64::from(SIDE));
            let c = 1.0 - height * u[0];
            let sine = (1.0 - c * c).max(0.0).sqrt();
            let (s, cs) = (TAU * u[1]).sin_cos();
            let w = frame.to_world(DVec3::new(sine * cs, sine * s, c));
            let light = point.reflected(sky.radiance(point.position, w), w);
            if light == DVec3::ZERO {
                continue;
            }
            let ray = Ray::new(point.position, w);
            if !occluders.any_hit(&ray, &(0..0), &mut scratch) {
                sum += light.element_sum();
            }
        }
        sum * TAU * height / f64::from(SIDE * SIDE)
    };
    (0..batches).map(&mut batch).collect()
}

/// Every sky, every reflection for which uniform directions have a finite variance, and every
/// technique.
#[test]
fn skies_agree_with_brute_force() {
    let plates = rectangles(&[
        ([-0.6, 0.7], [-0.5, 0.9], 1.1),
        ([0.5, 3.0], [-2.0, 1.0], 2.0),
    ]);
    let corner = DVec3::new(-1.0, -1.5, 2.5);
    let portal = ConvexPolygon::new(&[
        corner,
        corner + 3.0 * DVec3::Y,
        corner + 3.0 * DVec3::Y + 2.0 * DVec3::X,
        corner + 2.0 * DVec3::X,
    ]);
    let portal = portal.expect("flat");
    assert!(portal.normal().z < 0.0, "it faces the point");
    let octahedral = || image(SkyMapping::EqualArea, [24, 24], 1);
    let skies = [
        sky(SkyEmission::Constant(DVec3::new(1.0, 2.0, 3.0)), None),
        sky(sun(0.5), None),
        sky(image(SkyMapping::Equirectangular, [40, 20], 1), None),
        sky(octahedral(), None),
        sky(octahedral(), Some(portal)),
        sky(SkyEmission::Constant(DVec3::ONE), Some(portal)),
        sky(sun(0.9), Some(portal)),
    ];
    let rough = reflections();
    let surfaces = [
        Bsdf::Lambert(matte()),
        glossy(),
        rough[1].clone(),
        rough[2].clone(),
        rough[6].clone(),
        rough[7].clone(),
    ];
    let bound = critical_z(sidak(1e-4, skies.len() * surfaces.len() * TEXTS.len()));
    for light in &skies {
        let Light::Sky(of) = light else {
            unreachable!("a sky")
        };
        for bsdf in &surfaces {
            let at = point(bsdf.clone());
            let want = brute(&plates, of, &at, 48);
            assert!(want.mean() > 1e-3);
            for text in TEXTS {
                let (got, _) = estimates(&plates, light, &at, text, 16, 0..200);
                let z = z_score_two(&got, &want);
                assert!(
                    z.abs() < bound,
                    "{text} {of:?} {bsdf:?}: {z}, {got:?} for {want:?}"
                );
            }
        }
    }
}

/// One bright pixel of 64 × 32: points by image times cosine, compared with the BSDF alone, whose
/// directions seldom meet it.
#[test]
fn a_bright_pixel_is_drawn() {
    let mut pixels = vec![[0.01_f32; 3]; 64 * 32];
    pixels[8 * 64 + 20] = [1e4; 3];
    let new = |pixels| {
        let size = [64, 32];
        SkyImage::new(
            SkyMapping::Equirectangular,
            size,
            pixels,
            DMat3::IDENTITY,
            DVec3::ONE,
        )
    };
    let light = sky(SkyEmission::Image(Arc::new(new(pixels).unwrap())), None);
    let surface = point(glossy());
    let variance = |text| {
        let (got, _) = estimates(&nothing(), &light, &surface, text, 16, 0..2000);
        got.variance()
    };
    let [drawn, both, bsdf] = ["point-projected-solid-angle", "hybrid", "point-bsdf"].map(variance);
    assert!(
        drawn < 1e-2 * bsdf && both < 1e-1 * bsdf,
        "{drawn} {both} {bsdf}"
    );
}

/// A polygon and a disk that emit from both sides, a sphere and a cylinder.
fn shapes() -> [Light; 4] {
    let quad = ConvexPolygon::new(&[
        DVec3::new(-0.4, -0.3, 1.5),
        DVec3::new(-0.4, 0.6, 1.5),
        DVec3::new(0.7, 0.6, 1.6),
        DVec3::new(0.7, -0.3, 1.6),
    ]);
    let emission = Emission {
        radiance: DVec3::ONE,
        two_sided: true,
    };
    let polygon = quad.expect("flat");
    let (center, normal) = (
        DVec3::new(0.4, 0.2, 1.5),
        DVec3::new(0.3, 0.1, -1.0).normalize(),
    );
    [
        Light::Area(AreaLight { polygon, emission }),
        Light::Disk(DiskLight {
            disk: Disk {
                center,
                normal,
                radius: 0.5,
            },
            emission,
        }),
        Light::Sphere(SphereLight {
            sphere: Sphere {
                center,
                radius: 0.5,
            },
            radiance: DVec3::ONE,
        }),
        Light::Cylinder(CylinderLight {
            cylinder: Cylinder {
                axis: linelit_geometry::Segment::new(center - DVec3::X, center + DVec3::Y),
                radius: 0.3,
            },
            radiance: DVec3::ONE,
        }),
    ]
}

/// Polygons, disks, spheres and cylinders with a profile: every technique agrees with points by
/// area, and a cosine power of zero gives the light without a profile.
#[test]
fn profiles_agree_whatever_the_technique() {
    let lights = shapes();
    let texts = [
        "point-solid-angle",
        "point-ltc+point-bsdf",
        "line-area",
        "line-analytic",
        "exact",
        "hybrid",
        "line-solid-angle+point-bsdf[mis=power]",
    ];
    let frame = Frame::from_normal(DVec3::Z);
    let plates = rectangles(&[([0.1, 0.4], [-0.5, 0.2], 0.7)]);
    let bound = critical_z(sidak(1e-4, lights.len() * 2 * texts.len()));
    for light in &lights {
        for bsdf in [Bsdf::Lambert(matte()), glossy()] {
            let at = point(bsdf);
            let run = |profile: Option<&Profile>, text: &str, seeds: std::ops::Range<u64>| {
                let source = LightSource::<NoTexture> {
                    profile,
                    ..LightSource::new(light)
                };
                let (estimator, mut buffers) =
                    (text.parse::<Estimator>().unwrap(), Buffers::default());
                let one = |seed| {
                    let numbers = RandomNumbers::new(SamplerKind::Stratified, seed, [0, 0], 0);
                    let query = Query::new(&plates, &source, &at, &estimator, numbers, 16);
                    estimate(&query, &mut buffers).element_sum()
                };
                seeds.map(one).collect::<Welford>()
            };
            let focus = Profile::new(ProfileKind::CosinePower(3.0), frame);
            let even = Profile::new(ProfileKind::CosinePower(0.0), frame);
            let want = run(Some(&focus), "point-area", 1000..4000);
            let plain = run(None, "point-area", 1000..4000);
            let same = run(Some(&even), "point-area", 1000..4000);
            let error = (same.mean() / plain.mean() - 1.0).abs();
            assert!(error < 1e-12, "{light:?}: {error}");
            assert!(want.mean() < 0.95 * plain.mean(), "{want:?} {plain:?}");
            for text in texts {
                let got = run(Some(&focus), text, 0..400);
                let z = z_score_two(&got, &want);
                assert!(
                    z.abs() < bound,
                    "{text} {light:?}: {z}, {got:?} for {want:?}"
                );
            }
        }
    }
}

/// The description that `--explain` gives of them.
#[test]
fn methods_are_told() {
    let known = KnownKind::ALL[3].1;
    let told = |text: &str, light| {
        let estimator: Estimator = text.parse().expect("an estimator");
        estimator.explain(&MethodFacts::new(light, known, 8))
    };
    for text in TEXTS {
        assert_eq!(
            told(text, LightKind::Delta),
            "one shadow ray, without noise"
        );
    }
    let by = |text: &str| told(text, LightKind::Sky);
    assert_eq!(
        by("line-analytic"),
        "8 points as `point-texture`, a shadow ray each"
    );
    assert_eq!(
        by("point-area"),
        "8 points as `point-texture`, a shadow ray each"
    );
    let hybrid = "8 samples weighted among `point-projected-solid-angle` and `point-bsdf`, a \
                  shadow ray each";
    assert_eq!(by("hybrid"), hybrid);
    let _ = PI;
}
