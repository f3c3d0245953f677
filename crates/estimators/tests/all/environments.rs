//! Images of all directions over a diffuse surface: the light that estimators find is the sum over
//! the pixels of the values of lookups times the cosine, for narrow suns and wide skies, each
//! mapping and each filter.

use crate::round::{estimates, matte, nothing};
use linelit_bsdf::Bsdf;
use linelit_estimators::ShadingPoint;
use linelit_geometry::{DMat3, DVec3, Frame};
use linelit_lights::octahedral::square_to_sphere;
use linelit_lights::{
    Light, LightSpace, Sky, SkyEmission, SkyFilter, SkyImage, SkyMapping, Sphere,
};
use linelit_testkit::chi2::sidak;
use linelit_testkit::quadrature::{GaussRule, gauss_kronrod, gauss_legendre};
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::ztest::{Welford, critical_z};
use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

const TEXTS: [&str; 4] = [
    "point-solid-angle",
    "point-projected-solid-angle",
    "hybrid",
    "point-bsdf",
];

/// The reflection of `matte` times π.
const ALBEDO: f64 = 0.5;

/// The pixels of a sky, for a size of its image: a background, and some pixels of other values.
#[derive(Clone, Debug)]
struct Pixels {
    size: [usize; 2],
    even: f32,
    /// Column, row, and the value that is added.
    bright: Vec<[usize; 2]>,
    value: f32,
    /// Random pixels instead of a background.
    is_random: bool,
}

impl Pixels {
    fn values(&self) -> Vec<f32> {
        let mut rng = SplitMix64::new(5);
        let mut even = |_| match self.is_random {
            #[allow(clippy::cast_possible_truncation, reason = "pixels are f32")]
            true => rng.in_range(-0.5, 2.0).max(0.0) as f32,
            false => self.even,
        };
        let mut values: Vec<f32> = (0..self.size[0] * self.size[1]).map(&mut even).collect();
        for [i, j] in &self.bright {
            values[j * self.size[0] + i] += self.value;
        }
        values
    }

    /// Whether uniform directions often meet the bright part.
    fn is_wide(&self) -> bool {
        self.bright.is_empty()
    }
}

/// Seven skies: uniform; random with few and with many pixels; one pixel next to the pole; one at
/// the seam; a sun of two by two pixels in a uniform sky; and one pixel of many, next to the seam
/// and the pole.
fn skies(mapping: SkyMapping) -> [Pixels; 7] {
    let is_flat = mapping == SkyMapping::EqualArea;
    let of = |wide: [usize; 2], square: usize| if is_flat { [square; 2] } else { wide };
    let plain = |size| Pixels {
        size,
        even: 0.0,
        bright: Vec::new(),
        value: 0.0,
        is_random: false,
    };
    let one = |size: [usize; 2], bright: [usize; 2], value| Pixels {
        bright: vec![bright],
        value,
        ..plain(size)
    };
    let random = |size| Pixels {
        is_random: true,
        ..plain(size)
    };
    let (small, seam) = (of([16, 8], 16), of([32, 16], 33));
    let (large, many) = (of([1024, 512], 512), of([512, 256], 300));
    let suns = if is_flat { [263, 248] } else { [700, 11] };
    let across = |k: usize| [suns[0] + k % 2, suns[1] + k / 2];
    [
        Pixels {
            even: 1.0,
            ..plain(of([2, 1], 1))
        },
        random(of([5, 3], 3)),
        random(of([40, 23], 33)),
        one(small, if is_flat { [7, 8] } else { [0, 0] }, 1.0),
        one(seam, [seam[0] - 1, seam[1] / 2], 1.0),
        Pixels {
            even: 1.0,
            bright: (0..4).map(across).collect(),
            value: 1e5,
            ..plain(large)
        },
        one(many, if is_flat { [150, 140] } else { [511, 20] }, 1e4),
    ]
}

/// Maps from directions of the world, whose z is the surface's normal, to directions of the image:
/// the identity, a small and a large rotation, a reflection, and one with the image's pole next to
/// the horizon.
fn frames() -> [DMat3; 5] {
    let axis = DVec3::new(0.6, 0.0, 0.8);
    let turn = |angle| DMat3::from_axis_angle(axis, angle);
    let tilt = Frame::from_normal(DVec3::new(0.8, 0.6, 0.1).normalize());
    [
        DMat3::IDENTITY,
        turn(0.7),
        turn(2.1),
        turn(1.3) * DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)),
        DMat3::from_cols(tilt.x, tilt.y, tilt.z),
    ]
}

/// An image whose irradiance is integrated.
struct Reference<'a> {
    image: &'a SkyImage,
    mapping: SkyMapping,
    to_world: DMat3,
    rule: GaussRule,
}

impl Reference<'_> {
    /// The direction in the world at a position in the image, and the solid angle per area there.
    fn at(&self, x: f64, y: f64) -> (DVec3, f64) {
        let (w, solid_angle) = match self.mapping {
            SkyMapping::EqualArea => (square_to_sphere([x, y]), 4.0 * PI),
            SkyMapping::Equirectangular => {
                let ((s, c), (sine, cosine)) = ((TAU * x).sin_cos(), (PI * y).sin_cos());
                (DVec3::new(sine * c, sine * s, cosine), TAU * PI * sine)
            }
        };
        (self.to_world * w, solid_angle)
    }

    /// The integral of (radiance − `even`) times the cosine above the horizon, over a rectangle in
    /// which lookups are smooth. Where the horizon cuts the rectangle, it is halved along both
    /// sides a few times.
    fn integral(&self, [x, y]: [[f64; 2]; 2], even: f64, halvings: u32) -> f64 {
        let corners = [0, 1, 2, 3].map(|k| self.at(x[k % 2], y[k / 2]).0.z > 0.0);
        let is_cut = corners.contains(&true) && corners.contains(&false);
        if is_cut && halvings > 0 {
            let halves = |[a, b]: [f64; 2]| [[a, 0.5 * (a + b)], [0.5 * (a + b), b]];
            let parts =
                halves(y).map(|y| halves(x).map(|x| self.integral([x, y], even, halvings - 1)));
            return parts.iter().flatten().sum();
        }
        self.rule.integrate_2d(x, y, |x, y| {
            let (w, solid_angle) = self.at(x, y);
            (self.image.radiance(w).x - even) * w.z.max(0.0) * solid_angle
        })
    }
}

/// The irradiance of the surface with the normal z: π times the background, plus integrals over
/// rectangles of half a pixel or less, wherever the image may be brighter.
fn irradiance(image: &SkyImage, mapping: SkyMapping, of: &Pixels, to_image: DMat3) -> f64 {
    let reference = Reference {
        image,
        mapping,
        to_world: to_image.transpose(),
        rule: gauss_legendre(4),
    };
    let intervals = |axis: usize| {
        let size = of.size[axis];
        // Take at least 16 of them, because of the functions of the mapping.
        let parts = 2 * 8_usize.div_ceil(size);
        let cut = move |k: usize| k as f64 / (size * parts) as f64;
        let all = (0..size * parts).map(move |k| [cut(k), cut(k + 1)]);
        let is_near = move |[from, to]: &[f64; 2]| {
            let middle = 0.5 * (from + to) * size as f64;
            let apart = |at: &[usize; 2]| (middle - at[axis] as f64 - 0.5).abs();
            // Interpolation extends over one pixel, and from one border to the opposite one.
            size <= 64
                || of
                    .bright
                    .iter()
                    .any(|at| apart(at).min(size as f64 - apart(at)) < 1.5)
        };
        all.filter(is_near).collect::<Vec<_>>()
    };
    let columns = intervals(0);
    let cells = intervals(1)
        .into_iter()
        .flat_map(|y| columns.iter().map(move |x| [*x, y]));
    let even = f64::from(of.even);
    PI * even
        + cells
            .map(|cell| reference.integral(cell, even, 5))
            .sum::<f64>()
}

/// The irradiance by directions that are uniform over the hemisphere, stratified.
fn by_uniform_directions(image: &SkyImage, batches: u32) -> Welford {
    const SIDE: u32 = 16;
    let mut rng = SplitMix64::new(23);
    let mut batch = |_| {
        let mut sum = 0.0;
        for k in 0..SIDE * SIDE {
            let [i, j] = [k % SIDE, k / SIDE].map(f64::from);
            let [z, turn] = [i, j].map(|c| (c + rng.next_f64()) / f64::from(SIDE));
            let ((s, c), sine) = ((TAU * turn).sin_cos(), (1.0 - z * z).sqrt());
            sum += image.radiance(DVec3::new(sine * c, sine * s, z)).x * z;
        }
        sum * TAU / f64::from(SIDE * SIDE)
    };
    (0..batches).map(&mut batch).collect()
}

/// All skies, mappings, frames and estimators.
fn check(frames: &[DMat3], seeds: u64) {
    let forms = [
        (SkyMapping::Equirectangular, SkyFilter::Linear),
        (SkyMapping::EqualArea, SkyFilter::Linear),
        (SkyMapping::EqualArea, SkyFilter::Nearest),
    ];
    let surface = ShadingPoint::new(
        DVec3::ZERO,
        DVec3::Z,
        DVec3::new(-0.6, 0.0, 0.8),
        Bsdf::Lambert(matte()),
    );
    let bound = critical_z(sidak(
        1e-4,
        7 * forms.len() * frames.len() * (TEXTS.len() + 1),
    ));
    for (mapping, filter) in forms {
        for (k, of) in skies(mapping).into_iter().enumerate() {
            for (frame, to_image) in frames.iter().enumerate() {
                let case = format!("{mapping:?} {filter:?}, sky {k}, frame {frame}");
                let pixels = of.values().into_iter().map(|v| [v; 3]).collect();
                let one = DVec3::ONE;
                let space = LightSpace::new(to_image.transpose()).unwrap();
                let image = SkyImage::placed(filter, mapping, of.size, pixels, space, one);
                let image = Arc::new(image.expect("good pixels"));
                let want = irradiance(&image, mapping, &of, *to_image);
                if of.is_wide() {
                    let z = by_uniform_directions(&image, 400).z_score(want);
                    assert!(z.abs() < bound, "{case}: {z} by uniform directions");
                }
                let light = Light::Sky(Sky {
                    emission: SkyEmission::Image(image),
                    portal: None,
                    scene: Sphere {
                        center: DVec3::ZERO,
                        radius: 10.0,
                    },
                });
                for mut text in TEXTS {
                    // Directions from the BSDF hardly ever meet a narrow sun.
                    if text == "point-bsdf" && !of.is_wide() {
                        text = "point-area+point-bsdf[mis=power]";
                    }
                    let (got, _) = estimates(&nothing(), &light, &surface, text, 16, 0..seeds);
                    let want = 3.0 * want * ALBEDO * FRAC_1_PI;
                    // There is no noise but rounding where the integrand is constant.
                    let z = (got.mean() - want) / got.standard_error().max(1e-12 * want);
                    let is_good = if want > 0.0 {
                        z.abs() < bound
                    } else {
                        got.mean() <= 0.0
                    };
                    assert!(is_good, "{case}, {text}: {z}, {got:?} for {want}");
                }
            }
        }
    }
}

#[test]
fn environments_are_the_sums_of_their_pixels() {
    check(&frames()[1..2], 200);
}

#[test]
#[ignore = "long: seven skies by three mappings by five frames by four estimators"]
fn environments_are_the_sums_of_their_pixels_in_all_frames() {
    check(&frames(), 4000);
}

/// A sun that the horizon cuts lights the surface by its part above: the expected value is an
/// integral over elevations of the sun's width at each.
#[test]
fn suns_set_gradually() {
    let surface = ShadingPoint::new(
        DVec3::ZERO,
        DVec3::Z,
        DVec3::new(-0.6, 0.0, 0.8),
        Bsdf::Lambert(matte()),
    );
    let parts = [0.6, 0.2, -0.2, -0.6];
    let bound = critical_z(sidak(1e-4, 3 * parts.len() * TEXTS.len()));
    for half_angle in [0.1, 0.3, 1.0] {
        for part in parts {
            let elevation: f64 = part * half_angle;
            let (sine, cosine) = elevation.sin_cos();
            let direction = DVec3::new(0.6 * cosine, -0.8 * cosine, sine);
            let light = Light::sun(direction, half_angle, DVec3::ONE);
            let width = |h: f64| {
                let inside = (half_angle.cos() - sine * h.sin()) / (cosine * h.cos());
                2.0 * inside.clamp(-1.0, 1.0).acos() * h.sin() * h.cos()
            };
            let highest = (elevation + half_angle).min(0.5 * PI);
            let want = gauss_kronrod(width, 0.0, highest, 1e-9).value * 3.0 * ALBEDO * FRAC_1_PI;
            for text in TEXTS {
                // Directions from the BSDF hardly ever meet a sun next to the horizon.
                let samples = if text == "point-bsdf" { 256 } else { 16 };
                let (got, _) = estimates(&nothing(), &light, &surface, text, samples, 0..1000);
                let z = got.z_score(want);
                assert!(
                    z.abs() < bound,
                    "{half_angle} {part} {text}: {z}, {got:?} {want}"
                );
            }
        }
    }
}
