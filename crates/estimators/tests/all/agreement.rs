//! Every technique there is gives the same light, alone and combined.

use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{Bsdf, ClosedForm, ClosedLobe, Fresnel, Frostbite, Lambert, Layers, Lobe};
use linelit_bsdf::{Phong, Reflection, Reflector, Substrate};
use linelit_estimators::{Buffers, EmissionTexture, LightSource, OcclusionStats, Query};
use linelit_estimators::{RandomNumbers, ShadingPoint, Technique, estimate};
use linelit_geometry::{ConvexPolygon, DVec3, Segment};
use linelit_lights::{AreaLight, Disk, DiskLight, Emission, ImportanceImage, Light, LinearLight};
use linelit_lights::{Sphere, SphereLight, TexturedSampler};
use linelit_samplers::SamplerKind;
use linelit_testkit::chi2::sidak;
use linelit_testkit::ztest::{Welford, critical_z, z_score_two};
use linelit_visibility::Occluders;
use std::ops::Range;

/// A reflection of which nothing is known but its values.
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

/// A sum of lobes about any directions, drawn by the cosine.
struct Lobes(Lambert, Vec<ClosedLobe>);

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

    fn closed_form(&self) -> Option<ClosedForm<'_>> {
        Some(ClosedForm::new(self.0, &self.1))
    }
}

/// An image over all of a light.
struct Image(ConvexPolygon, ImportanceImage);

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

/// A light of each kind.
fn lights() -> [Light; 4] {
    let corner = DVec3::new(-0.5, -0.5, 1.5);
    let polygon = ConvexPolygon::parallelogram(corner, DVec3::Y, DVec3::X * 1.25).expect("one");
    let (radiance, emission) = (DVec3::ONE, Emission::one_sided(DVec3::ONE));
    let (center, radius, normal) = (DVec3::new(0.1, 0.2, 1.5), 0.5, -DVec3::Z);
    let sphere = Sphere { center, radius };
    let disk = Disk {
        center,
        normal,
        radius,
    };
    let line = LinearLight {
        segment: Segment::new(corner, DVec3::new(0.5, 0.625, 1.25)),
        radiance_radius: radiance,
    };
    [
        Light::Area(AreaLight { polygon, emission }),
        Light::Linear(line),
        Light::Sphere(SphereLight { sphere, radiance }),
        Light::Disk(DiskLight { disk, emission }),
    ]
}

/// Means of the light that gets past a rectangle half way, with an estimator and so many samples;
/// without skips if it is a technique that stands alone.
fn means<R: Reflection>(
    (light, texture): (&Light, Option<&Image>),
    point: &ShadingPoint<R>,
    text: &str,
    samples: u32,
    seeds: Range<u64>,
) -> Welford {
    let (x, y, z) = ([0.0625, 0.5], [-0.5, 0.125], 0.75);
    let corners = [
        [x[0], y[0], z],
        [x[1], y[0], z],
        [x[1], y[1], z],
        [x[0], y[1], z],
    ];
    let blocker = Occluders::build(&corners, &[[0, 1, 2], [0, 2, 3]]);
    let source = LightSource {
        light,
        texture,
        triangles: 0..0,
        occlusion: OcclusionStats::default(),
    };
    let (estimator, mut buffers) = (text.parse().expect("an estimator"), Buffers::default());
    let one = |seed| {
        let numbers = RandomNumbers::new(SamplerKind::Stratified, seed, [0, 0], 0);
        let mut query = Query::new(&blocker, &source, point, &estimator, numbers, samples);
        query.skip = text.contains('+');
        estimate(&query, &mut buffers).element_sum()
    };
    seeds.map(one).collect()
}

/// Each technique alone and with points of the BSDF under two heuristics, on each kind of light,
/// against points uniform on the area: z tests of 128 seeds, together with those of nine more
/// calls at a level of 1e-4.
fn hold<R: Reflection>(x: DVec3, n: DVec3, bsdf: R) {
    const MIXES: [&str; 3] = ["", "+point-bsdf", "+point-bsdf[mis=power]"];
    let point = ShadingPoint::new(x, n, DVec3::new(-0.6, 0.0, 0.8), bsdf);
    let lights = lights();
    let Light::Area(AreaLight { polygon, .. }) = lights[0] else {
        panic!("the first is a polygon")
    };
    let values = ImportanceImage::new(2, 2, &[1.0, 4.0, 2.0, 0.5]).expect("four");
    let image = Image(polygon, values);
    let cells = 10 * (lights.len() + 1) * MIXES.len() * Technique::all().count();
    let bound = critical_z(sidak(1e-4, cells));
    let textured = (&lights[0], Some(&image));
    for light in lights.iter().map(|light| (light, None)).chain([textured]) {
        let want = means(light, &point, "point-area", 512, 1000..1128);
        assert!(want.mean() > 0.01, "{:?}: {want:?}", light.0);
        for (technique, mix) in Technique::all().flat_map(|t| MIXES.map(|mix| (t, mix))) {
            let text = technique.name().to_owned() + mix;
            let got = means(light, &point, &text, 32, 0..128);
            let z = z_score_two(&got, &want);
            assert!(
                z.abs() < bound,
                "{text}: z {z}, {got:?} for {want:?} of {:?}",
                light.0
            );
        }
    }
}

/// Lobes that materials have: two of Phong, plastic, rough metal along one direction, a coat, and
/// Frostbite's.
fn materials() -> [Vec<Lobe>; 5] {
    let [quarter, f0] = [0.25, 0.04].map(DVec3::splat);
    let phong = |exponent| {
        let specular = quarter;
        Lobe::Phong(Phong { specular, exponent })
    };
    let rough = |alpha, fresnel| {
        let (reflectance, facets) = (DVec3::ONE, TrowbridgeReitz::new(alpha));
        Lobe::Reflector(Reflector {
            reflectance,
            facets,
            fresnel,
        })
    };
    let coat = Substrate {
        diffuse: quarter,
        specular: f0,
        facets: TrowbridgeReitz::isotropic(0.3),
    };
    [
        vec![phong(4.0), phong(40.0)],
        vec![rough([0.2; 2], Fresnel::Dielectric { eta: 1.5 })],
        vec![rough(
            [0.1, 0.4],
            Fresnel::Schlick {
                f0: quarter,
                f90: 1.0,
            },
        )],
        vec![Lobe::Substrate(coat)],
        vec![Lobe::Frostbite(Frostbite::new(quarter, f0, 0.5))],
    ]
}

/// Though the BSDF has no closed form, and where the horizon cuts the lights.
#[test]
fn every_technique_gives_the_same_light() {
    let albedo = DVec3::splat(0.5);
    let matte = Lambert { albedo };
    let glossy = Bsdf::Phong(
        matte,
        Phong {
            specular: albedo,
            exponent: 12.0,
        },
    );
    let tilted = DVec3::new(-0.95, 0.125, 0.25).normalize();
    hold(DVec3::ZERO, DVec3::Z, Bsdf::Lambert(matte));
    hold(DVec3::X * 0.125, DVec3::Z, glossy);
    hold(DVec3::X * 0.25, DVec3::Z, Opaque(glossy));
    hold(DVec3::ZERO, tilted, glossy);
    for lobes in materials() {
        let mut layers = Layers::new(DVec3::new(0.6, 0.8, 0.0));
        layers.add_diffuse(DVec3::splat(0.25));
        for lobe in lobes {
            assert!(layers.add(DVec3::ONE, lobe));
        }
        hold(DVec3::X * 0.25, DVec3::Z, Bsdf::Layers(layers));
    }
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
    hold(DVec3::X * 0.25, DVec3::Z, Lobes(matte, lobes));
}
