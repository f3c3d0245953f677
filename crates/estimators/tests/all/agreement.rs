//! Every technique gives the same light, alone and in combinations.

use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{
    Bsdf, ClosedForm, ClosedLobe, Fresnel, Frostbite, Lambert, Layers, Lobe, LtcFit,
};
use linelit_bsdf::{Known, OrenNayar, Phong, Reflection, Reflector, Substrate};
use linelit_bsdf::{LtcLobe, LtcMixture};
use linelit_estimators::{Buffers, EmissionTexture, LightSource, OcclusionStats, Query};
use linelit_estimators::{RandomNumbers, ShadingPoint, Technique, estimate};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame, Segment};
use linelit_lights::{AreaLight, Cylinder, CylinderLight, Disk, DiskLight, Emission};
use linelit_lights::{ImportanceImage, Light, LinearLight};
use linelit_lights::{Sphere, SphereLight, TexturedSampler};
use linelit_samplers::SamplerKind;
use linelit_testkit::chi2::sidak;
use linelit_testkit::ztest::{Welford, critical_z, z_score_two};
use linelit_visibility::Occluders;
use std::ops::Range;

/// A reflection of which only values are known, without LTCs and closed forms.
#[derive(Clone)]
pub(crate) struct Opaque(pub Bsdf);

impl Reflection for Opaque {
    fn eval(&self, wi: DVec3, wo: DVec3, n: DVec3) -> DVec3 {
        self.0.eval(wi, wo, n)
    }

    fn sample(&self, u: [f64; 2], wo: DVec3, n: DVec3) -> Option<DVec3> {
        self.0.sample(u, wo, n)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3, n: DVec3) -> f64 {
        self.0.pdf(wi, wo, n)
    }
}

/// A sum of lobes about any directions, sampled in proportion to the cosine.
#[derive(Clone)]
pub(crate) struct Lobes(Lambert, Vec<ClosedLobe>);

impl Reflection for Lobes {
    fn eval(&self, wi: DVec3, _: DVec3, _: DVec3) -> DVec3 {
        let value = |lobe: &ClosedLobe| match lobe {
            ClosedLobe::Power {
                scale,
                axis,
                exponent,
            } => *scale * axis.dot(wi).max(0.0).powf(*exponent),
            ClosedLobe::Gaussian {
                scale,
                axis,
                sharpness,
            } => *scale * (sharpness * (axis.dot(wi) - 1.0)).exp(),
        };
        self.0.value() + self.1.iter().map(value).sum::<DVec3>()
    }

    fn sample(&self, u: [f64; 2], wo: DVec3, n: DVec3) -> Option<DVec3> {
        Bsdf::Lambert(self.0).sample(u, wo, n)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3, n: DVec3) -> f64 {
        Bsdf::Lambert(self.0).pdf(wi, wo, n)
    }

    fn known(&self, _: DVec3, _: DVec3) -> Known<'_> {
        Known::All(ClosedForm::new(self.0, &self.1))
    }
}

/// An image that covers all of a light.
pub(crate) struct Image(ConvexPolygon, ImportanceImage);

impl EmissionTexture for Image {
    fn radiance(&self, on_light: DVec3) -> DVec3 {
        let uv = self.points().expect("one").coordinates(on_light);
        DVec3::splat(self.1.density(uv))
    }

    fn points(&self) -> Option<TexturedSampler<'_>> {
        TexturedSampler::new(&self.0, &self.1)
    }

    fn fits(&self) -> bool {
        true
    }

    fn over(&self, part: &ConvexPolygon) -> Option<&ImportanceImage> {
        (*part == self.0).then_some(&self.1)
    }
}

/// A light of each kind, together with its image if it has one.
pub(crate) fn lights() -> Vec<(Light, Option<Image>)> {
    let corner = DVec3::new(-0.5, -0.5, 1.5);
    let quad = ConvexPolygon::parallelogram(corner, DVec3::Y, DVec3::X * 1.25).expect("one");
    let [b, c] = [[0.2, 0.9, 1.5], [0.9, -0.4, 1.25]].map(DVec3::from);
    let triangle = ConvexPolygon::triangle(corner, b, c).expect("one");
    let (radiance, emission) = (DVec3::ONE, Emission::one_sided(DVec3::ONE));
    let (center, radius, normal) = (DVec3::new(0.1, 0.2, 1.5), 0.5, -DVec3::Z);
    let sphere = Sphere { center, radius };
    let disk = Disk {
        center,
        normal,
        radius,
    };
    let cylinder = Cylinder {
        axis: Segment::new(corner, DVec3::new(0.5, 0.625, 1.25)),
        radius: 0.25,
    };
    let line = LinearLight {
        segment: Segment::new(corner, DVec3::new(0.5, 0.625, 1.25)),
        radiance_radius: radiance,
    };
    let area = |polygon| Light::Area(AreaLight { polygon, emission });
    let values = ImportanceImage::new(2, 2, &[1.0, 4.0, 2.0, 0.5]).expect("four");
    vec![
        (area(quad), None),
        (area(triangle), None),
        (area(quad), Some(Image(quad, values))),
        (Light::Linear(line), None),
        (Light::Sphere(SphereLight { sphere, radiance }), None),
        (Light::Disk(DiskLight { disk, emission }), None),
        (Light::Cylinder(CylinderLight { cylinder, radiance }), None),
    ]
}

/// A rectangle between the point and the light, or no occluders.
pub(crate) fn occluders(there: bool) -> Occluders {
    let (x, y, z) = ([0.0625, 0.5], [-0.5, 0.125], 0.75);
    let corners = [
        [x[0], y[0], z],
        [x[1], y[0], z],
        [x[1], y[1], z],
        [x[0], y[1], z],
    ];
    Occluders::build(&corners, if there { &[[0, 1, 2], [0, 2, 3]] } else { &[] })
}

/// The light past occluders, by an estimator with this many samples. If `every` is set, every
/// sample is taken, without skips.
pub(crate) fn means<R: Reflection>(
    (light, texture): &(Light, Option<Image>),
    occluders: &Occluders,
    point: &ShadingPoint<R>,
    (text, every): (&str, bool),
    samples: u32,
    seeds: Range<u64>,
) -> Welford {
    let source = LightSource {
        profile: None,
        light,
        texture: texture.as_ref(),
        triangles: 0..0,
        occlusion: OcclusionStats::FEW,
    };
    let (estimator, mut buffers) = (text.parse().expect("an estimator"), Buffers::default());
    let one = |seed| {
        let numbers = RandomNumbers::new(SamplerKind::Stratified, seed, [0, 0], 0);
        let mut query = Query::new(occluders, &source, point, &estimator, numbers, samples);
        query.skip = !every;
        estimate(&query, &mut buffers).element_sum()
    };
    seeds.map(one).collect()
}

/// Options that change `exact` before many triangles or before any, and directions of lines that
/// only a technique alone can have.
const ALONE: [&str; 6] = [
    "exact[limit=0]",
    "exact[limit=0,orientation=origin]",
    "line-area[orientation=stratified]",
    "line-analytic[orientation=stratified]",
    "line-area[orientation=origin]",
    "line-analytic[orientation=origin]",
];

fn stands_alone(name: &str) -> bool {
    ["stratified", "origin"]
        .iter()
        .any(|direction| name.contains(direction))
}

/// Compares each technique, alone and with points of the BSDF, with points that are uniform in the
/// area, on each kind of light. With a rectangle in between there are 128 seeds. Without occluders
/// there are 64 seeds with half as many samples, and closed forms are used where there are any. All
/// calls of a test together have a level of 1e-4.
fn hold<R: Reflection>(what: &str, calls: usize, x: DVec3, n: DVec3, bsdf: R) {
    let point = ShadingPoint::new(x, n, DVec3::new(-0.6, 0.0, 0.8), bsdf);
    let lights = lights();
    let names = || {
        Technique::all()
            .map(|technique| technique.name())
            .chain(ALONE)
    };
    let cells = calls * lights.len() * 3 * names().count();
    let bound = critical_z(sidak(1e-4, cells));
    for light in &lights {
        for there in [true, false] {
            let occluders = occluders(there);
            let samples = if there { 512 } else { 256 };
            let want = ("point-area", true);
            let want = means(light, &occluders, &point, want, samples, 1000..1128);
            assert!(want.mean() > 0.01, "{what}: {:?}: {want:?}", light.0);
            let mixes: &[_] = if there { &["", "+point-bsdf"] } else { &[""] };
            let all = names().flat_map(|name| mixes.iter().map(move |m| (name, m)));
            for (name, mix) in all.filter(|(name, m)| m.is_empty() || !stands_alone(name)) {
                let text = name.to_owned() + mix;
                let how = (&*text, there && mix.is_empty());
                let (samples, seeds) = if there { (32, 0..128) } else { (16, 0..64) };
                let got = means(light, &occluders, &point, how, samples, seeds);
                let z = z_score_two(&got, &want);
                assert!(
                    z.abs() < bound,
                    "{what}, {text}, occluded: {there}: z {z}, {got:?} for {want:?} of {:?}",
                    light.0
                );
            }
        }
    }
}

fn matte() -> Lambert {
    let albedo = DVec3::splat(0.5);
    Lambert { albedo }
}

fn rough(alpha: [f64; 2], fresnel: Fresnel) -> Lobe {
    let (reflectance, facets) = (DVec3::ONE, TrowbridgeReitz::new(alpha));
    Lobe::Reflector(Reflector {
        reflectance,
        facets,
        fresnel,
    })
}

/// Materials as readers of scene files make them.
pub(crate) fn materials() -> Vec<(&'static str, Bsdf)> {
    let [quarter, f0] = [0.25, 0.04].map(DVec3::splat);
    let phong = |exponent| {
        let specular = quarter;
        Lobe::Phong(Phong { specular, exponent })
    };
    let coat = Lobe::Substrate(Substrate {
        diffuse: quarter,
        specular: f0,
        facets: TrowbridgeReitz::isotropic(0.3),
    });
    let schlick = Fresnel::Schlick {
        f0: quarter,
        f90: 1.0,
    };
    let copper = Fresnel::Conductor {
        eta: DVec3::new(0.2, 0.92, 1.1),
        k: DVec3::new(3.9, 2.45, 2.14),
    };
    let plastic = Fresnel::Dielectric { eta: 1.0 / 1.5 };
    let frostbite = Lobe::Frostbite(Frostbite::new(quarter, f0, 0.5));
    let plate = rough([0.2; 2], copper);
    let grey = Lobe::OrenNayar(OrenNayar::new(quarter, 0.5));
    let all: Vec<(_, f64, Vec<(f64, Lobe)>)> = vec![
        (
            "two lobes",
            0.25,
            vec![(1.0, phong(4.0)), (1.0, phong(40.0))],
        ),
        ("plastic", 0.25, vec![(1.0, rough([0.2; 2], plastic))]),
        ("metal", 0.0, vec![(1.0, rough([0.25; 2], copper))]),
        (
            "brushed metal",
            0.0,
            vec![(1.0, rough([0.1, 0.4], schlick))],
        ),
        ("substrate", 0.0, vec![(1.0, coat)]),
        (
            "glTF",
            0.0,
            vec![(0.5, coat), (0.5, rough([0.3; 2], schlick))],
        ),
        ("frostbite", 0.0, vec![(1.0, frostbite)]),
        ("rough diffuse", 0.0, vec![(1.0, grey)]),
        (
            "mixture",
            0.125,
            vec![(0.5, grey), (0.25, phong(40.0)), (0.25, plate)],
        ),
    ];
    let layers = |(name, diffuse, lobes): (_, _, Vec<(f64, Lobe)>)| {
        let mut layers = Layers::new(DVec3::new(0.6, 0.8, 0.0));
        layers.add_diffuse(DVec3::splat(diffuse));
        for (scale, lobe) in lobes {
            assert!(layers.add(DVec3::splat(scale), lobe));
        }
        (name, Bsdf::Layers(layers))
    };
    all.into_iter().map(layers).collect()
}

/// Lobes about any directions.
pub(crate) fn gaussians() -> Lobes {
    let scale = DVec3::splat(0.25);
    let lobes = vec![
        ClosedLobe::Power {
            scale,
            axis: DVec3::new(0.0, 0.28, 0.96),
            exponent: 8.0,
        },
        ClosedLobe::Gaussian {
            scale,
            axis: DVec3::new(0.28, 0.0, 0.96),
            sharpness: 20.0,
        },
    ];
    Lobes(matte(), lobes)
}

/// This also holds where nothing is known of the BSDF, and where the horizon clips the lights.
#[test]
fn every_technique_gives_the_same_light() {
    let specular = DVec3::splat(0.5);
    let phong = |exponent| Bsdf::Phong(matte(), Phong { specular, exponent });
    let glossy = phong(12.0);
    let tilted = DVec3::new(-0.95, 0.125, 0.25).normalize();
    let hold = |x: f64, n, bsdf| hold("closed form", 7, DVec3::X * x, n, bsdf);
    hold(0.0, DVec3::Z, Bsdf::Lambert(matte()));
    hold(0.125, DVec3::Z, glossy.clone());
    hold(0.0, tilted, glossy.clone());
    // A wide Phong lobe, also where the horizon clips the lights, and a narrow one.
    hold(0.125, DVec3::Z, phong(2.5));
    hold(0.0, tilted, phong(2.5));
    hold(0.125, DVec3::Z, phong(150.0));
    self::hold("values alone", 7, DVec3::X * 0.25, DVec3::Z, Opaque(glossy));
}

/// All pairs of a light and a material.
#[test]
fn every_light_on_every_material() {
    let materials = materials();
    let calls = materials.len() + 1;
    for (name, bsdf) in materials {
        hold(name, calls, DVec3::X * 0.25, DVec3::Z, bsdf);
    }
    hold("Gaussians", calls, DVec3::X * 0.25, DVec3::Z, gaussians());
}

/// The weights of one more heuristic, on lights and reflections of all kinds.
#[test]
fn weights_by_power_give_the_same_light() {
    let x = DVec3::X * 0.25;
    let point = |bsdf| ShadingPoint::new(x, DVec3::Z, DVec3::new(-0.6, 0.0, 0.8), bsdf);
    let points = [
        point(Bsdf::Lambert(matte())),
        point(materials()[1].1.clone()),
    ];
    let (lights, occluders) = (lights(), occluders(true));
    let cells = points.len() * lights.len() * Technique::all().count();
    let bound = critical_z(sidak(1e-4, cells));
    for (point, light) in points
        .iter()
        .flat_map(|p| lights.iter().map(move |l| (p, l)))
    {
        let want = means(
            light,
            &occluders,
            point,
            ("point-area", true),
            512,
            1000..1128,
        );
        for technique in Technique::all() {
            let text = technique.name().to_owned() + "+point-bsdf[mis=power]";
            let got = means(light, &occluders, point, (&text, false), 32, 0..128);
            let z = z_score_two(&got, &want);
            assert!(z.abs() < bound, "{text}: z {z}, {got:?} for {want:?}");
        }
    }
}

/// A reflection of which only LTCs are known, which a function of the viewer and the normal
/// returns.
struct Likened<F>(Bsdf, F);

impl<F: Fn(DVec3, DVec3) -> LtcMixture> Reflection for Likened<F> {
    fn eval(&self, wi: DVec3, wo: DVec3, n: DVec3) -> DVec3 {
        self.0.eval(wi, wo, n)
    }

    fn sample(&self, u: [f64; 2], wo: DVec3, n: DVec3) -> Option<DVec3> {
        self.0.sample(u, wo, n)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3, n: DVec3) -> f64 {
        self.0.pdf(wi, wo, n)
    }

    fn known(&self, _: DVec3, _: DVec3) -> Known<'_> {
        Known::Cosines { are_unlike: false }
    }

    fn transformed_cosines(&self, wo: DVec3, n: DVec3) -> Option<LtcMixture> {
        Some(self.1(wo, n))
    }
}

/// LTCs that were fitted to a user's reflection let `exact` integrate them. The light is the same,
/// and the variance is .011 to .026 of the variance of points without LTCs, on every light but the
/// one with an image. The ratio of two variances of 256 estimates is known to a factor of 1.5 (α =
/// 0.001).
#[test]
fn fitted_reflections_have_the_same_light_with_less_noise() {
    let phong = Phong {
        specular: DVec3::splat(0.4),
        exponent: 12.0,
    };
    let bsdf = Bsdf::Phong(matte(), phong);
    let fit = LtcFit::new(&bsdf);
    let fitted = || Likened(bsdf.clone(), |wo, n| fit.transformed_cosines(wo, n));
    let (x, n, wo) = (DVec3::X * 0.25, DVec3::Z, DVec3::new(-0.6, 0.0, 0.8));
    hold("fitted", 1, x, n, fitted());
    let alone = ShadingPoint::new(x, n, wo, Opaque(bsdf.clone()));
    let fitted = ShadingPoint::new(x, n, wo, fitted());
    for light in lights().iter().filter(|(_, image)| image.is_none()) {
        if matches!(light.0, Light::Linear(_) | Light::Cylinder(_)) {
            // Lines on these need peaks, too.
            continue;
        }
        let between = occluders(true);
        let with = means(light, &between, &fitted, ("exact", true), 16, 0..256).variance();
        let without = means(light, &between, &alone, ("exact", true), 16, 0..256).variance();
        assert!(with < 0.04 * without, "{:?}: {with} for {without}", light.0);
    }
}

/// There is no bias where LTCs are zero though the reflection is not: about an axis whose horizon
/// leaves half of the lights black, about an axis whose horizon leaves all of them black, and
/// without any lobe.
#[test]
fn cosines_that_are_zero_cost_noise_alone() {
    let quarter = DVec3::splat(0.25);
    let lobe = |axis: DVec3| {
        let about = Frame::from_normal(axis.normalize());
        let map = DMat3::from_cols(about.x * 0.5, about.y * 0.5, about.z);
        let mut cosines = LtcMixture::new(Frame::from_normal(DVec3::Z), DVec3::ZERO);
        cosines.add(LtcLobe {
            map,
            albedo: quarter,
        });
        cosines
    };
    let half = lobe(DVec3::new(0.95, 0.1, 0.25));
    let seen = lights()
        .iter()
        .filter(|(light, _)| {
            let Light::Area(area) = light else {
                return false;
            };
            let corners = area.polygon.vertices().iter();
            let local = |p: &DVec3| half.frame.to_local((*p - DVec3::X * 0.25).normalize());
            let dark = corners
                .filter(|p| half.lobes()[0].density(local(p)) <= 0.0)
                .count();
            (1..area.polygon.vertices().len()).contains(&dark)
        })
        .count();
    assert_eq!(seen, 3, "horizons that cut every polygon");
    let nothing = LtcMixture::new(half.frame, DVec3::ZERO);
    let (_, bsdf) = &materials()[1];
    for cosines in [half, lobe(DVec3::new(1.0, 0.0, -2.0)), nothing] {
        hold(
            "misled",
            3,
            DVec3::X * 0.25,
            DVec3::Z,
            Likened(bsdf.clone(), |_, _| cosines),
        );
    }
}

/// Estimators whose variance stays finite next to a light.
const BY_DIRECTION: [&str; 5] = [
    "point-solid-angle",
    "point-projected-solid-angle",
    "point-bsdf",
    "line-projected",
    "line-solid-angle+point-bsdf",
];

/// A point in the plane of a flat light receives no light by any technique. A point right next to
/// the foot of an upright light receives almost half of what a half space would send, by all
/// techniques that follow directions.
#[test]
fn points_at_the_foot_of_a_light_receive_nothing_or_half_a_space() {
    let bsdf = Bsdf::Lambert(Lambert { albedo: DVec3::ONE });
    let occluders = Occluders::build(
        &[[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]],
        &[[0, 1, 2]],
    );
    let emission = Emission::one_sided(DVec3::ONE);
    let bound = critical_z(sidak(1e-4, 2 * 5 * BY_DIRECTION.len()));
    for angle in [0.0, 0.3, 1.1, 2.5, 4.0] {
        let turn = DMat3::from_rotation_z(angle);
        // As in a file, the coordinates are rounded to f32, which moves the point by a few 1e-8
        // from the plane.
        let at = |x: f64, z: f64| (turn * DVec3::new(x, 0.25, z)).as_vec3().as_dvec3();
        let corners = [at(-0.5, 0.0), at(0.5, 0.0), at(0.5, 1.0), at(-0.5, 1.0)];
        let polygon = ConvexPolygon::new(&corners).expect("a square");
        let disk = Disk {
            center: at(0.0, 0.25),
            normal: polygon.normal(),
            radius: 0.5,
        };
        let lights = [
            Light::Area(AreaLight { polygon, emission }),
            Light::Disk(DiskLight { disk, emission }),
        ];
        for light in lights.map(|light| (light, None)) {
            let see = |aside: f64, text: &str, samples| {
                let x = turn * DVec3::new(0.1, 0.25, 1e-13) + polygon.normal() * aside;
                let point = ShadingPoint::new(x, DVec3::Z, DVec3::Z, bsdf.clone());
                means(&light, &occluders, &point, (text, false), samples, 0..64)
            };
            let names = || Technique::all().map(|technique| technique.name());
            for name in names() {
                for text in [name.to_owned(), format!("{name}+point-bsdf")] {
                    for aside in [0.0, 1e-9, -1e-9] {
                        let got = see(aside, &text, 4).mean();
                        assert!(got == 0.0, "{text}, {aside:e} aside, angle {angle}: {got}");
                    }
                }
            }
            // Right next to the light, it fills almost half of the hemisphere.
            let want = see(3e-3, "exact", 1).mean();
            assert!((want / 3.0 - 0.497).abs() < 1e-3, "angle {angle}: {want}");
            for text in BY_DIRECTION {
                let got = see(3e-3, text, 64);
                let z = (got.mean() - want) / got.standard_error().max(1e-9);
                assert!(
                    z.abs() < bound,
                    "{text}, angle {angle}: z {z}, {got:?} for {want}"
                );
            }
        }
    }
}
