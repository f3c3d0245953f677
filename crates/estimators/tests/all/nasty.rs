//! All estimators are compared with points on random nasty scenes: lights of all kinds and sizes,
//! all reflections, and occluders that touch the light or the shading point, lie in the light's
//! plane, cover each other, or are closed and inside out.

use crate::agreement::{Image, Opaque, gaussians, materials};
use linelit_bsdf::{Bsdf, Lambert, Reflection};
use linelit_estimators::{Buffers, LightSource, OcclusionStats, Query};
use linelit_estimators::{Estimator, RandomNumbers, ShadingPoint, Technique, estimate};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame, Segment};
use linelit_lights::{AreaLight, Cylinder, CylinderLight, Disk, DiskLight, DistantLight, Emission};
use linelit_lights::{Falloff, Light, LinearLight, PointLight, Profile, ProfileKind, Sky};
use linelit_lights::{SkyEmission, SkyImage, SkyMapping, Sphere, SphereLight};
use linelit_samplers::SamplerKind;
use linelit_testkit::chi2::sidak;
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::ztest::{Welford, t_p_value, z_score};
use linelit_visibility::Occluders;
use std::f64::consts::TAU;
use std::sync::Arc;

/// The number of independent estimates by each estimator, and the number of samples of an estimate.
const TRIALS: u32 = 64;
const SAMPLES: u32 = 32;

trait Random {
    fn index(&mut self, count: u64) -> usize;
    fn direction(&mut self) -> DVec3;
}

impl Random for SplitMix64 {
    /// A whole number below a limit.
    fn index(&mut self, count: u64) -> usize {
        usize::try_from(self.below(count)).unwrap_or(0)
    }

    fn direction(&mut self) -> DVec3 {
        self.unit_vector().into()
    }
}

/// A scene of one light, one point and some triangles.
#[derive(Clone)]
struct Scene {
    light: Light,
    occluders: Occluders,
    position: DVec3,
    /// The geometric and the shading normal.
    normals: [DVec3; 2],
    outgoing: DVec3,
}

/// A direction in the upper half.
fn above(rng: &mut SplitMix64, n: DVec3) -> DVec3 {
    loop {
        let w = rng.direction();
        if w.dot(n) > 0.05 {
            return w;
        }
    }
}

/// A ball that contains the visible part of the light.
const SCENE: Sphere = Sphere {
    center: DVec3::ZERO,
    radius: 10.0,
};

/// A spot about an axis, with a sharp edge or a soft one.
fn spot(rng: &mut SplitMix64, axis: DVec3) -> Arc<Profile> {
    let cos_outer = rng.in_range(-0.5, 0.95);
    let cos_inner = cos_outer + [0.0, 0.04][rng.index(2)];
    let falloff = [Falloff::Smooth, Falloff::Quartic][rng.index(2)];
    let cone = ProfileKind::Cone {
        cos_inner,
        cos_outer,
        falloff,
    };
    Arc::new(Profile::new(cone, Frame::from_normal(axis)))
}

/// A constant sky, a sun as large as a light of this size at this centre, or an image, with or
/// without a portal of that size.
fn sky(rng: &mut SplitMix64, center: DVec3, size: f64) -> Sky {
    let emission = match rng.index(3) {
        0 => SkyEmission::Constant(DVec3::ONE),
        1 => SkyEmission::Sun {
            direction: center.normalize(),
            half_angle: 0.5 * size / center.length(),
            radiance: DVec3::ONE,
        },
        _ => {
            let (mapping, size) = match rng.index(2) {
                0 => (SkyMapping::EqualArea, [8, 8]),
                _ => (SkyMapping::Equirectangular, [9, 4]),
            };
            let pixel = |_| [(); 3].map(|()| [0.0, 0.5, 2.0][rng.index(3)]);
            let pixels = (0..size[0] * size[1]).map(pixel).collect();
            let turn = DMat3::from_axis_angle(rng.direction(), 1.0);
            let image = SkyImage::new(mapping, size, pixels, turn, DVec3::ONE);
            SkyEmission::Image(Arc::new(image.expect("good pixels")))
        }
    };
    let portal = (rng.index(2) == 0).then(|| {
        let frame = Frame::from_normal((0.8 * rng.direction() - center.normalize()).normalize());
        let (a, b) = (frame.x * size, frame.y * (size * rng.in_range(0.1, 1.0)));
        ConvexPolygon::parallelogram(center - (a + b) * 0.5, a, b).expect("flat")
    });
    Sky {
        emission,
        portal,
        scene: SCENE,
    }
}

/// A light of a random kind, seen from the origin above z = 0, of a size up to twice its distance.
fn light(rng: &mut SplitMix64) -> Light {
    let center = above(rng, DVec3::Z) * rng.in_range(0.5, 3.0);
    let size = center.length() * [0.02, 0.2, 1.0][rng.index(3)];
    let facing = (-center.normalize() + 0.8 * rng.direction()).normalize();
    let two_sided = rng.index(3) == 0;
    let emission = Emission {
        radiance: DVec3::ONE,
        two_sided,
    };
    match rng.index(9) {
        6 => Light::Point(PointLight {
            position: center,
            intensity: DVec3::ONE,
            profile: (rng.index(2) == 0).then(|| spot(rng, -center.normalize())),
        }),
        7 => Light::Distant(DistantLight {
            direction: center.normalize(),
            irradiance: DVec3::ONE,
            scene: SCENE,
        }),
        8 => Light::Sky(sky(rng, center, size)),
        0 => Light::Sphere(SphereLight {
            sphere: Sphere {
                center,
                radius: 0.4 * size,
            },
            radiance: DVec3::ONE,
        }),
        1 => Light::Disk(DiskLight {
            disk: Disk {
                center,
                normal: facing,
                radius: 0.5 * size,
            },
            emission,
        }),
        2 => Light::Linear(LinearLight {
            segment: Segment::new(center, center + rng.direction() * size),
            radiance_radius: DVec3::ONE,
        }),
        3 => Light::Cylinder(CylinderLight {
            cylinder: Cylinder {
                axis: Segment::new(center, center + rng.direction() * size),
                radius: 0.1 * size,
            },
            radiance: DVec3::ONE,
        }),
        _ => {
            // Corners in order of their angles on an ellipse are convex.
            let (a, b) = facing.any_orthonormal_pair();
            let flat = [1.0, 0.1][rng.index(2)];
            let count = 3 + rng.index(4);
            let mut turns: Vec<f64> = (0..count).map(|_| rng.in_range(0.0, TAU)).collect();
            turns.sort_by(f64::total_cmp);
            let corner = |t: &f64| center + (a * t.cos() + b * (flat * t.sin())) * (0.5 * size);
            let corners: Vec<DVec3> = turns.iter().map(corner).collect();
            match ConvexPolygon::new(&corners) {
                Ok(polygon) => Light::Area(AreaLight { polygon, emission }),
                Err(_) => light(rng),
            }
        }
    }
}

/// A point of the light and, for a flat light, two directions in its plane.
fn place(light: &Light) -> (DVec3, [DVec3; 2], f64) {
    match light {
        Light::Area(l) => {
            let v = l.polygon.vertices();
            let (a, b) = l.polygon.normal().any_orthonormal_pair();
            (v[0], [a, b], v[0].distance(v[1]))
        }
        Light::Disk(l) => {
            let (a, b) = l.disk.normal.any_orthonormal_pair();
            (l.disk.center, [a, b], l.disk.radius)
        }
        Light::Sphere(l) => (l.sphere.center, [DVec3::X, DVec3::Y], l.sphere.radius),
        Light::Linear(l) => (l.segment.p0, [DVec3::X, DVec3::Y], l.segment.length()),
        Light::Cylinder(l) => (
            l.cylinder.axis.p0,
            [DVec3::X, DVec3::Y],
            l.cylinder.axis.length(),
        ),
        Light::Point(l) => (l.position, [DVec3::X, DVec3::Y], 0.3),
        Light::Distant(l) => (l.direction, [DVec3::X, DVec3::Y], 0.3),
        Light::Sky(sky) => match (&sky.portal, &sky.emission) {
            (Some(portal), _) => {
                let v = portal.vertices();
                (
                    (v[0] + v[2]) * 0.5,
                    [v[1] - v[0], v[3] - v[0]],
                    v[0].distance(v[1]),
                )
            }
            (None, SkyEmission::Sun { direction, .. }) => (*direction, [DVec3::X, DVec3::Y], 0.3),
            (None, _) => (DVec3::Z, [DVec3::X, DVec3::Y], 0.5),
        },
    }
}

/// Triangles of all sorts between the origin and the light.
fn triangles(rng: &mut SplitMix64, light: &Light) -> Vec<[DVec3; 3]> {
    let (at, [a, b], size) = place(light);
    let mut all: Vec<[DVec3; 3]> = Vec::new();
    for _ in 0..rng.index(7) {
        let t = rng.in_range(0.1, 0.95);
        let middle = at * t + rng.direction() * (size * t);
        let reach = size * [0.1, 0.5, 2.0][rng.index(3)];
        match rng.index(7) {
            // In the light's plane, with a corner on it.
            0 => all.push([at, at + a * reach, at + b * reach]),
            // Touching the light from its front.
            1 => all.push([at, at + a * reach, at * (1.0 - 0.3) + b * reach]),
            // Next to the shading point, upright.
            2 => {
                let side = rng.direction() * 0.3;
                all.push([DVec3::Z * 1e-6, side, side + DVec3::Z]);
            }
            // The same triangle twice, once reversed.
            3 => {
                let t = [(); 3].map(|()| middle + rng.direction() * reach);
                all.extend([t, [t[1], t[0], t[2]]]);
            }
            // A closed tetrahedron, with its faces inward or outward.
            4 => {
                let [p, q, r, s] = [(); 4].map(|()| middle + rng.direction() * (0.5 * reach));
                let faces = [[p, q, r], [p, s, q], [q, s, r], [r, s, p]];
                let inward = rng.index(2) == 0;
                all.extend(faces.map(|[a, b, c]| if inward { [b, a, c] } else { [a, b, c] }));
            }
            _ => all.push([(); 3].map(|()| middle + rng.direction() * reach)),
        }
    }
    all
}

#[allow(clippy::cast_possible_truncation, reason = "vertices are f32")]
fn scene(rng: &mut SplitMix64) -> Scene {
    let light = light(rng);
    let corners: Vec<[f32; 3]> = triangles(rng, &light)
        .into_iter()
        .flatten()
        .map(|v| v.to_array().map(|x| x as f32))
        .collect();
    let triangles: Vec<[u32; 3]> = (0_u32..)
        .step_by(3)
        .map(|k| [k, k + 1, k + 2])
        .take(corners.len() / 3)
        .collect();
    let normal = if rng.index(3) == 0 {
        (DVec3::Z + 0.5 * rng.direction()).normalize()
    } else {
        DVec3::Z
    };
    let outgoing = loop {
        let w = above(rng, normal);
        if w.z > 0.05 {
            break w;
        }
    };
    Scene {
        light,
        occluders: Occluders::build(&corners, &triangles),
        position: DVec3::ZERO,
        normals: [DVec3::Z, normal],
        outgoing,
    }
}

/// The text of a random estimator, which samples the light itself.
fn estimator(rng: &mut SplitMix64) -> String {
    let names: Vec<&str> = Technique::all()
        .map(|t| t.name())
        .filter(|name| *name != "point-bsdf" && *name != "point-linear")
        .collect();
    let name = |rng: &mut SplitMix64| names[rng.index(names.len() as u64)];
    let weights = ["", "[mis=power]", "[mis=smooth]", "[mis=optimal]"];
    match rng.index(3) {
        0 => name(rng).to_owned(),
        1 => format!("{}+point-bsdf{}", name(rng), weights[rng.index(4)]),
        _ => format!("{}+{}", name(rng), name(rng)),
    }
}

fn means<R: Reflection + Clone>(
    scene: &Scene,
    bsdf: &R,
    text: &str,
    samples: u32,
    first_seed: u64,
) -> Welford {
    let source = LightSource::<Image> {
        profile: None,
        light: &scene.light,
        texture: None,
        triangles: 0..0,
        occlusion: OcclusionStats::FEW,
    };
    let mut point = ShadingPoint::new(
        scene.position,
        scene.normals[0],
        scene.outgoing,
        bsdf.clone(),
    );
    point.normal = scene.normals[1];
    let estimator: Estimator = text.parse().expect("an estimator");
    let mut buffers = Buffers::default();
    let one = |k: u64| {
        let numbers = RandomNumbers::new(SamplerKind::Stratified, first_seed + k, [0, 0], 0);
        let query = Query::new(
            &scene.occluders,
            &source,
            &point,
            &estimator,
            numbers,
            samples,
        );
        estimate(&query, &mut buffers).element_sum()
    };
    (0..u64::from(TRIALS)).map(one).collect()
}

/// Returns whether an estimator agrees with points by solid angle and the BSDF on a scene, at a
/// level.
fn agree<R: Reflection + Clone>(
    scene: &Scene,
    bsdf: &R,
    text: &str,
    level: f64,
) -> Result<(), String> {
    let got = means(scene, bsdf, text, SAMPLES, 0);
    let reference = match &scene.light {
        // Directions never meet a linear light.
        Light::Linear(_) => "point-solid-angle",
        // They meet all of a sky, for which there are only the points of the estimators themselves.
        Light::Sky(Sky {
            portal: None,
            emission: SkyEmission::Constant(_) | SkyEmission::Image(_),
            ..
        }) => "point-bsdf",
        _ => "point-solid-angle+point-bsdf",
    };
    let want = means(scene, bsdf, reference, 8 * SAMPLES, 1 << 32);
    let (a, b) = (got.mean(), want.mean());
    let error = got.standard_error().hypot(want.standard_error());
    // Light that no sample met does not show in the deviation of the samples. At that level, it is
    // a fraction below ln(1/level)/n of the points met by n samples, and at most as bright as the
    // light without occluders and horizons.
    let unseen = -level.ln() / f64::from(TRIALS * SAMPLES);
    let to_light = place(&scene.light).0.normalize();
    let open = Scene {
        occluders: Occluders::default(),
        normals: [to_light; 2],
        outgoing: to_light,
        ..scene.clone()
    };
    let most = means(&open, bsdf, reference, SAMPLES, 1 << 33).mean();
    let room = (unseen + 1e-9) * a.abs().max(b.abs()).max(most);
    let beyond = ((a - b).abs() - room).max(0.0);
    let p = t_p_value(z_score(beyond, 0.0, error), f64::from(TRIALS - 1));
    if p > level {
        return Ok(());
    }
    Err(format!(
        "{text}: {a:e} +- {:e}, {reference}: {b:e} +- {:e}, {:?}, normals {:?}, {} triangles",
        got.standard_error(),
        want.standard_error(),
        scene.light,
        scene.normals,
        scene.occluders.triangle_count()
    ))
}

/// Makes this many tests from a seed, which have a level of 0.01 together.
fn hold(seed: u64, count: u32) {
    let level = sidak(0.01, count as usize);
    let materials = materials();
    let mut failed = Vec::new();
    for k in 0..count {
        let mut rng = SplitMix64::new(seed.wrapping_add(u64::from(k)));
        let (scene, text) = (scene(&mut rng), estimator(&mut rng));
        let albedo = DVec3::splat(0.5);
        let which = rng.index(materials.len() as u64 + 3);
        let result = match which.checked_sub(materials.len()) {
            None => agree(&scene, &materials[which].1, &text, level),
            Some(0) => agree(&scene, &gaussians(), &text, level),
            Some(1) => agree(&scene, &Opaque(materials[1].1.clone()), &text, level),
            Some(_) => agree(&scene, &Bsdf::Lambert(Lambert { albedo }), &text, level),
        };
        if let Err(why) = result {
            let name = materials.get(which).map_or("another", |(name, _)| name);
            failed.push(format!("seed {seed}, case {k}, on {name}: {why}"));
        }
    }
    assert!(
        failed.is_empty(),
        "{} of {count}:\n{}",
        failed.len(),
        failed.join("\n")
    );
}

#[test]
fn estimators_agree_on_nasty_scenes() {
    hold(1, 200);
}

#[test]
#[ignore = "long: 5,000 random scenes, new ones on every run"]
#[allow(clippy::print_stdout, reason = "a long test says its seed")]
fn estimators_agree_on_thousands_of_nasty_scenes() {
    let seed = linelit_testkit::cases::rng(5).next_u64();
    println!("nasty scenes from seed {seed} on");
    hold(seed, 5_000);
}
