//! These tests check images of all directions: for each mapping and filter, every cell of the
//! hierarchy is sampled in proportion to the lookups in it; also means and irradiance, and lookups
//! that do not depend on random numbers.
#![allow(
    clippy::cast_possible_truncation,
    reason = "pixels are f32, and columns and rows a few thousand"
)]

use crate::skies::{X, portals, sky, turned};
use linelit_geometry::{DMat3, DVec3};
use linelit_lights::octahedral::square_to_sphere;
use linelit_lights::{
    Light, LightSpace, PointTechnique, Shape, SkyBy, SkyEmission, SkyFilter, SkyImage, SkyMapping,
    SkyPoints, SkyView,
};
use linelit_testkit::quadrature::{GaussRule, gauss_kronrod, gauss_legendre};
use linelit_testkit::rng::SplitMix64;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// An image as it is looked up.
#[derive(Clone, Copy, Debug)]
struct Form {
    mapping: SkyMapping,
    filter: SkyFilter,
    size: [usize; 2],
}

impl Form {
    fn image(self, to_image: DMat3, pixel: impl FnMut(usize) -> f32) -> SkyImage {
        let pixels = (0..self.size[0] * self.size[1]).map(pixel).map(|v| [v; 3]);
        let scale = DVec3::new(1.0, 2.0, 0.5);
        let (pixels, size) = (pixels.collect(), self.size);
        let space = LightSpace::new(to_image.transpose()).unwrap();
        SkyImage::placed(self.filter, self.mapping, size, pixels, space, scale).unwrap()
    }

    /// The cells of the hierarchy along a side: at least 8, one for each pixel, or 2048.
    fn count(self) -> usize {
        let wanted = ((self.size[0] * self.size[1]) as f64).sqrt();
        (wanted.ceil() as usize).next_power_of_two().clamp(8, 2048)
    }

    /// The direction at a position in [0, 1]² of the image.
    fn direction(self, [x, y]: [f64; 2]) -> DVec3 {
        if self.mapping == SkyMapping::EqualArea {
            return square_to_sphere([x, y]);
        }
        let ((s, c), (sine, cosine)) = ((TAU * x).sin_cos(), (PI * y).sin_cos());
        DVec3::new(sine * c, sine * s, cosine)
    }

    /// The solid angle per area of the square, at a height in it.
    fn solid_angle(self, y: f64) -> f64 {
        match self.mapping {
            SkyMapping::EqualArea => 4.0 * PI,
            SkyMapping::Equirectangular => TAU * PI * (PI * y).sin(),
        }
    }

    /// The integral of a function of directions of the image over a rectangle in it: by Gauss's
    /// rule between the lines at which lookups are not smooth.
    fn integral(self, rule: &GaussRule, [x, y]: [[f64; 2]; 2], f: impl Fn(DVec3) -> f64) -> f64 {
        let shift = match self.filter {
            SkyFilter::Linear => 0.5,
            SkyFilter::Nearest => 0.0,
        };
        let cuts = |axis: usize, [from, to]: [f64; 2]| {
            let size = self.size[axis] as f64;
            let lines = (0..=self.size[axis]).map(|k| (k as f64 + shift) / size);
            let inside = lines.filter(|x| *x > from && *x < to);
            let cuts: Vec<f64> = [from].into_iter().chain(inside).chain([to]).collect();
            cuts
        };
        let (columns, rows) = (cuts(0, x), cuts(1, y));
        let part = |x: &[f64], y: &[f64]| {
            rule.integrate_2d([x[0], x[1]], [y[0], y[1]], |x, y| {
                f(self.direction([x, y])) * self.solid_angle(y)
            })
        };
        let parts = rows.windows(2).flat_map(|y| {
            let part = &part;
            columns.windows(2).map(move |x| part(x, y))
        });
        parts.sum()
    }
}

/// Mappings and filters with sides that are small, odd, and powers of two.
fn forms() -> Vec<Form> {
    let sizes = [[1, 1], [2, 1], [3, 5], [16, 8], [40, 23], [9, 40]];
    let sides = [1, 2, 3, 5, 8, 13, 33].map(|side| [side; 2]);
    let all = sizes
        .into_iter()
        .map(|size| (SkyMapping::Equirectangular, size));
    let all = all.chain(sides.into_iter().map(|size| (SkyMapping::EqualArea, size)));
    let filters = [SkyFilter::Linear, SkyFilter::Nearest];
    all.flat_map(|(mapping, size)| {
        filters.map(|filter| Form {
            mapping,
            filter,
            size,
        })
    })
    .collect()
}

/// Pixels at poles, seams and corners, and in the middle.
fn places([width, height]: [usize; 2]) -> Vec<usize> {
    let columns = [0, width / 2, width - 1];
    let rows = [0, height / 3, height - 1];
    let mut all: Vec<usize> = rows
        .iter()
        .flat_map(|j| columns.map(|i| j * width + i))
        .collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Checks the probability of cells of the hierarchy against the integral of what is looked up in
/// them; returns the sum of these integrals.
fn check_cells(form: Form, image: SkyImage, cells: impl Iterator<Item = [usize; 2]>) -> f64 {
    let (image, count, rule) = (Arc::new(image), form.count(), gauss_legendre(6));
    let sky = sky(SkyEmission::Image(Arc::clone(&image)), None);
    let view = SkyView::new(&sky, X);
    let points = SkyPoints::new(view, SkyBy::Radiance(DVec3::Z));
    let total = image.mean().element_sum() * 4.0 * PI;
    // Rounding to 24 bits: of the value, of its sum with the uniform part, and of three sums and
    // the quotient at each level.
    let levels = f64::from(count.ilog2());
    let allowed = (2.0 + 4.0 * levels) * f64::from(f32::EPSILON) / 2.0;
    let mut sum = 0.0;
    for [i, j] in cells {
        let [x, y] = [i, j].map(|c| [c, c + 1].map(|c| c as f64 / count as f64));
        let light = form.integral(&rule, [x, y], |w| {
            image.radiance(turned().transpose() * w).element_sum()
        });
        let solid_angle = form.integral(&rule, [x, y], |_| 1.0);
        sum += light;
        // A hundredth is uniform.
        let want = (light / total + 0.01 * solid_angle / (4.0 * PI)) / 1.01;
        let middle = [x, y].map(|[a, b]| 0.5 * (a + b));
        let w = turned().transpose() * form.direction(middle);
        let got = points.pdf(view.meets(X, w).expect("a direction")).value() * solid_angle;
        let error = (got / want - 1.0).abs();
        assert!(error < allowed, "{form:?} cell {i} {j}: {got} for {want}");
    }
    sum
}

fn all_cells(count: usize) -> impl Iterator<Item = [usize; 2]> {
    (0..count * count).map(move |k| [k % count, k / count])
}

/// For each mapping, filter and size, with random pixels and with single bright ones: the
/// probability of each cell is the fraction of the light that lookups return in it, and the mean is
/// the mean of lookups.
#[test]
fn cells_are_drawn_by_the_light_that_lookups_return() {
    for form in forms() {
        let mut rng = SplitMix64::new(9);
        let random = form.image(turned(), |_| rng.in_range(-0.5, 1.0).max(0.01) as f32);
        let bright = |at: usize| form.image(turned(), |k| if k == at { 1e3 } else { 0.0 });
        let singles = places(form.size).into_iter().map(bright);
        for image in [random].into_iter().chain(singles) {
            let mean = image.mean().element_sum();
            let sum = check_cells(form, image, all_cells(form.count())) / (4.0 * PI);
            assert!((sum / mean - 1.0).abs() < 1e-8, "{form:?}: {sum} {mean}");
        }
    }
}

/// Suns of one pixel and of two by two in a sky, next to the poles and away from them, at the seam,
/// in images whose pixels are smaller than cells, larger, or as large: the cells about them.
#[test]
fn narrow_suns_are_drawn_by_their_light() {
    let of = |mapping, filter, size| Form {
        mapping,
        filter,
        size,
    };
    let (linear, nearest) = (SkyFilter::Linear, SkyFilter::Nearest);
    let forms = [
        of(SkyMapping::Equirectangular, linear, [1024, 512]),
        of(SkyMapping::Equirectangular, linear, [512, 256]),
        of(SkyMapping::Equirectangular, linear, [601, 299]),
        of(SkyMapping::Equirectangular, nearest, [601, 299]),
        of(SkyMapping::EqualArea, linear, [300, 300]),
        of(SkyMapping::EqualArea, nearest, [513, 513]),
    ];
    for form in forms {
        let ([width, height], count) = (form.size, form.count());
        let rows = [0, 1, 20, 62, height / 2, height - 1];
        for (round, [column, row]) in rows
            .into_iter()
            .flat_map(|row| [0, width / 3, width - 1].map(|column| [column, row]))
            .enumerate()
        {
            let (across, sky) = if round % 2 == 0 { (1, 0.0) } else { (2, 1.0) };
            let is_sun = |k: usize| {
                let [i, j] = [(k + width - column) % width, k / width];
                i % width < across && (row..row + across).contains(&j)
            };
            let image = form.image(turned(), |k| if is_sun(k) { 1e5 } else { sky });
            // The cells that touch the pixels about the sun, and some others.
            let near = |axis: usize, at: usize| {
                let scale = count as f64 / form.size[axis] as f64;
                let [from, to] = [at as f64 - 1.0, (at + across) as f64 + 1.0];
                let first = (from * scale).floor().max(0.0) as usize;
                first..((to * scale).ceil() as usize).min(count)
            };
            let columns = near(0, column);
            let cells = near(1, row).flat_map(|j| columns.clone().map(move |i| [i, j]));
            let others = (0..20).map(|k| [k * 97 % count, k * 61 % count]);
            let _ = check_cells(form, image, cells.chain(others));
        }
    }
}

/// The irradiance of a constant sky is π L for any normal, and the irradiance of rows by longitude
/// and latitude about their pole is an integral over one angle.
#[test]
fn irradiance_is_the_integral_of_the_radiance() {
    for form in forms() {
        let even = form.image(turned(), |_| 2.0);
        for n in [
            DVec3::Z,
            DVec3::new(0.6, 0.0, 0.8),
            DVec3::new(-0.48, 0.6, -0.64),
        ] {
            let error = (even.irradiance(n).x / TAU - 1.0).abs();
            assert!(error < 1e-5, "{form:?} {n}: {error}");
        }
    }
    for filter in [SkyFilter::Linear, SkyFilter::Nearest] {
        let form = Form {
            mapping: SkyMapping::Equirectangular,
            filter,
            size: [5, 7],
        };
        let image = form.image(DMat3::IDENTITY, |k| {
            [3.0, 0.5, 2.0, 1.0, 9.0, 9.0, 9.0][k / 5]
        });
        let at = |angle: f64| {
            let (s, c) = angle.sin_cos();
            image.radiance(DVec3::new(s, 0.0, c)).x * s * c
        };
        // Between the lines at which lookups are not smooth.
        let cuts = (0..=7)
            .map(|k| f64::from(k) * PI / 14.0)
            .collect::<Vec<_>>();
        let parts = cuts
            .windows(2)
            .map(|c| gauss_kronrod(at, c[0], c[1], 1e-10).value);
        let (want, got) = (TAU * parts.sum::<f64>(), image.irradiance(DVec3::Z).x);
        assert!((got / want - 1.0).abs() < 1e-5, "{filter:?}: {got} {want}");
    }
}

/// Behind a portal, half of the samples of an image and all samples of a constant sky are uniform
/// in its solid angle: the density is 1/Ω, with Ω by the formula of Van Oosterom and Strackee.
#[test]
fn portals_have_the_density_of_their_solid_angle() {
    let even = Form {
        mapping: SkyMapping::EqualArea,
        filter: SkyFilter::Linear,
        size: [4, 4],
    };
    let even = SkyEmission::Image(Arc::new(even.image(turned(), |_| 1.0)));
    // The fourth is so small that rounding of its corners moves its solid angle.
    for (k, portal) in portals().into_iter().enumerate().filter(|(k, _)| *k != 3) {
        let corners = portal.vertices();
        let triangle = |a: usize, b: usize, c: usize| {
            let [a, b, c] = [a, b, c].map(|k| (corners[k] - X).normalize());
            let down = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
            2.0 * a.dot(b.cross(c)).abs().atan2(down)
        };
        let solid_angle = triangle(0, 1, 2) + triangle(0, 2, 3);
        let whole = 1.0 / (4.0 * PI);
        let constant = SkyEmission::Constant(DVec3::ONE);
        let cases = [
            (&constant, 1.0 / solid_angle),
            (&even, 0.5 * (1.0 / solid_angle + whole)),
        ];
        for (emission, want) in cases {
            let sky = sky(emission.clone(), Some(portal));
            let points = SkyPoints::new(SkyView::new(&sky, X), SkyBy::Radiance(DVec3::Z));
            for u in [[0.1, 0.2], [0.4, 0.9], [0.3, 0.5]] {
                let sample = points.sample(u);
                // f32 importance, and cancellation of the solid angle of the small portal.
                for got in [sample.pdf.value(), points.pdf(sample.point).value()] {
                    assert!((got / want - 1.0).abs() < 1e-6, "{k}: {got} {want}");
                }
            }
        }
    }
}

/// A sun is above the horizon as long as a part of it is.
#[test]
fn suns_are_above_the_horizon_until_they_have_set() {
    let n = DVec3::new(0.48, -0.6, 0.64);
    let along = n.any_orthonormal_vector();
    for half_angle in [1e-3, 0.004_65, 0.3, 1.5] {
        let above = |elevation: f64| {
            let direction = along * elevation.cos() + n * elevation.sin();
            let Light::Sky(sky) = Light::sun(direction, half_angle, DVec3::ONE) else {
                unreachable!("a sky")
            };
            sky.is_above(X, n)
        };
        for part in [0.999, 0.5, 0.0, -0.5, -0.999] {
            assert!(above(part * half_angle), "{half_angle}: {part}");
        }
        assert!(!above(-1.001 * half_angle), "{half_angle}");
    }
}
