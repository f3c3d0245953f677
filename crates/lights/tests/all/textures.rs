//! These tests check the laws of textured techniques: points and lines on parallelograms, by an
//! image.

use super::surfaces::{Laws, SLACK, setup, viewer};
use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DVec3, Frame};
use linelit_lights::{
    EmissionTexture, ImportanceImage, LineDensity, LineFamily, LineTechnique, PointDensity,
    PointSource, PointTechnique, Surface, TextureAxis, TexturedLines, TexturedSampler,
};
use linelit_shading::ltc::LtcMixture;
use linelit_testkit::cases::{cases, rng};
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::rng::SplitMix64;

const WIDTH: usize = 7;
const HEIGHT: usize = 5;
const PIXELS: usize = WIDTH * HEIGHT;
const AXES: [TextureAxis; 2] = [TextureAxis::U, TextureAxis::V];

/// Values from 0 to 10, a fifth of them black; one row and one column wholly so.
fn values() -> Vec<f64> {
    (0..PIXELS)
        .map(|i| {
            let (x, y) = (i % WIDTH, i / WIDTH);
            let value = i * i % 11;
            if x == 4 || y == 2 { 0.0 } else { value as f64 }
        })
        .collect()
}

fn image() -> ImportanceImage {
    ImportanceImage::new(WIDTH, HEIGHT, &values()).expect("not black")
}

fn pixel([u, v]: [f64; 2]) -> usize {
    let index = |x: f64, n: usize| {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "below n"
        )]
        let i = (x * n as f64) as usize;
        i.min(n - 1)
    };
    index(v, HEIGHT) * WIDTH + index(u, WIDTH)
}

/// Parallelograms: plain, sheared, tiny, huge, needle-like, far from the origin.
fn quads() -> Vec<(&'static str, ConvexPolygon)> {
    let quad = |name, o: [f64; 3], a: [f64; 3], b: [f64; 3]| {
        let quad = ConvexPolygon::parallelogram(o, a, b).expect("a quad");
        (name, quad)
    };
    vec![
        quad("plain", [0.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        quad("sheared", [0.3, 0.2, 1.0], [2.0, 0.0, 0.1], [1.5, 1.0, 0.0]),
        quad(
            "tiny",
            [1e-3, 0.0, 1.0],
            [2e-7, 1e-7, 0.0],
            [-1e-7, 3e-7, 0.0],
        ),
        quad("huge", [-3e5, 1e5, 1e4], [9e5, 0.0, 2e5], [0.0, 4e5, 1e5]),
        quad(
            "needle",
            [0.0, 0.0, 1.0],
            [100.0, 0.0, 0.0],
            [0.3, 0.01, 0.0],
        ),
        quad("far", [1e5, -2e5, 3e5], [2.0, 0.3, 0.1], [0.5, 1.0, 0.0]),
    ]
}

/// How far rounding the coordinates of points moves texture coordinates.
fn resolution(quad: &ConvexPolygon) -> f64 {
    let v = quad.vertices();
    let far = v.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let (_, a, b) = quad.as_parallelogram().expect("a parallelogram");
    // The height over the longer edge is the smallest extent.
    let least = quad.area() / a.length().max(b.length());
    16.0 * f64::EPSILON * (1.0 + far / least)
}

#[test]
fn images_obey_the_laws() {
    let (values, image) = (values(), image());
    let mut rng = SplitMix64::new(17);
    let mut counts = [0_u64; PIXELS];
    const N: u32 = 1_000_000;
    for _ in 0..N {
        let x = [rng.next_f64(), rng.next_f64()];
        let uv = image.sample(x);
        counts[pixel(uv)] += 1;
        let density = image.density(uv);
        assert!(density > 0.0);
        let back = image.invert(uv).expect("not black there");
        // ε over the density of the rows and along them, at least 1/35 of the mean here.
        let close = |a: f64, b: f64| (a - b).abs() < 64.0 * f64::EPSILON;
        assert!(
            close(back[0], x[0]) && close(back[1], x[1]),
            "{x:?} {back:?}"
        );
    }
    let total: f64 = values.iter().sum();
    let expected: Vec<f64> = values.iter().map(|v| v / total * f64::from(N)).collect();
    assert!(chi2_test(&counts, &expected, 5.0).p_value > 0.01);
    // Constant on pixels: sums over their centres are integrals.
    let center = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    let density = |k: usize| image.density([center(k % WIDTH, WIDTH), center(k / WIDTH, HEIGHT)]);
    let mean = (0..PIXELS).map(density).sum::<f64>() / PIXELS as f64;
    assert!((mean - 1.0).abs() < 1e-14, "{mean}");
    assert!(ImportanceImage::new(2, 1, &[0.0, 0.0]).is_none());
    assert!(ImportanceImage::new(2, 2, &[1.0]).is_none());
    assert!(ImportanceImage::new(1, 1, &[f64::NAN]).is_none());
}

#[test]
fn samples_are_never_black() {
    // Borders of pixels, where i/n · n rounds below i for some n; every other pixel is black.
    for n in 1..200_usize {
        let values: Vec<f64> = (0..n * n)
            .map(|i| f64::from(u8::from((i / n + i % n) % 2 == 0)))
            .collect();
        let image = ImportanceImage::new(n, n, &values).expect("not black");
        for i in 0..n {
            let x = i as f64 / n as f64;
            for x in [x, x.next_up(), x.next_down().max(0.0)] {
                let uv = image.sample([x, 0.5 * x]);
                assert!(image.density(uv) > 0.0, "{n} {i}");
                assert!(image.invert(uv).is_some(), "{n} {i}");
            }
        }
    }
}

#[test]
fn points_on_textured_quads_obey_the_laws() {
    let (values, image) = (values(), image());
    let total: f64 = values.iter().sum();
    let quads = quads();
    for (name, quad) in &quads {
        let s = TexturedSampler::new(quad, &image).expect("a parallelogram");
        let slack = resolution(quad);
        let mut rng = SplitMix64::new(19);
        let mut counts = [0_u64; PIXELS];
        const N: u32 = 1_000_000;
        for _ in 0..N {
            let u = [rng.next_f64(), rng.next_f64()];
            let p = s.sample(u);
            let uv = s.coordinates(p.point);
            counts[pixel(uv)] += 1;
            // A point so near a border that its coordinates round across has the neighbour's
            // density.
            let near = |x: f64, n: usize| {
                let place = (x * n as f64).fract();
                place.min(1.0 - place) < slack * n as f64
            };
            if near(uv[0], WIDTH) || near(uv[1], HEIGHT) {
                continue;
            }
            assert!((p.pdf.value() / s.pdf(p.point).value() - 1.0).abs() < 1e-12);
            let back = s.invert(p.point).expect("not black there");
            // Densities of the marginal and the conditional are at most 7 times the mean here.
            let error = (back[0] - u[0]).abs() + (back[1] - u[1]).abs();
            assert!(error < 16.0 * slack, "{name}: {u:?} {back:?}");
        }
        // The far quad's points are rounded across borders, into black pixels too: with a
        // probability of the resolution times the borders.
        let expected: Vec<f64> = values
            .iter()
            .map(|v| f64::from(N) * (v / total).max(1e-9))
            .collect();
        let p = chi2_test(&counts, &expected, 5.0).p_value;
        assert!(p > sidak(0.01, quads.len()), "{name}: p = {p:e}");
    }
}

/// Lines along both edges, against them, and at angles of their own.
fn line_samplers<'i>(
    quad: &ConvexPolygon,
    image: &'i ImportanceImage,
) -> Vec<(String, bool, TexturedLines<'i>)> {
    let mut out = Vec::new();
    for axis in AXES {
        let lines = TexturedLines::along(quad, image, axis).expect("a parallelogram");
        out.push((format!("along {axis:?}"), true, lines));
    }
    for (angle, edge) in [(0.7, false), (2.5, false), (std::f64::consts::PI, true)] {
        let lines = TexturedLines::new(quad, image, angle).expect("a parallelogram");
        out.push((format!("at {angle}"), edge, lines));
    }
    out
}

#[allow(clippy::too_many_lines, reason = "one case after the other")]
fn lines_fit(samples: u32) {
    let (values, image) = (values(), image());
    let total: f64 = values.iter().sum();
    let quads = quads();
    for (name, quad) in &quads {
        let slack = resolution(quad);
        let texture = TexturedSampler::new(quad, &image).expect("a parallelogram");
        for (way, edge, s) in line_samplers(quad, &image) {
            let mut rng = SplitMix64::new(23);
            let mut counts = [0_u64; PIXELS];
            let mut strips = [0_u64; 32];
            let (a, b) = s.lines().range();
            let mut mean = 0.0;
            for _ in 0..samples {
                let u = [rng.next_f64(), rng.next_f64()];
                let line = s.sample(u[0]);
                assert!(line.pdf.is_positive());
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "below 32"
                )]
                let bin = ((line.offset - a) / (b - a) * 32.0) as usize;
                strips[bin.min(31)] += 1;
                let back = s.invert(line.offset).expect("on the light");
                assert!(
                    (back - u[0]).abs() < 64.0 * slack,
                    "{name} {way}: {u:?} {back}"
                );
                let p = s.point(&line, &[Interval::UNIT], u[1]);
                if !p.pdf.is_positive() {
                    // An oblique strip holds the image's mean: it may be wider than what the line
                    // meets.
                    assert!(!edge, "{name} {way}: {u:?}");
                    continue;
                }
                let uv = texture.coordinates(p.point);
                let value = image.density(uv) / quad.area();
                let weight = value / p.pdf.value();
                mean += weight;
                if edge {
                    counts[pixel(uv)] += 1;
                    // Perfect, but where the point's rounding crosses a border.
                    let near = |x: f64, n: usize| {
                        let place = (x * n as f64).fract();
                        place.min(1.0 - place) < slack * n as f64
                    };
                    if !near(uv[0], WIDTH) && !near(uv[1], HEIGHT) {
                        assert!((weight - 1.0).abs() < 64.0 * slack, "{name} {way} {weight}");
                        let back = s.invert_point(p.point, &[Interval::UNIT]).expect("there");
                        let error = (back[0] - u[0]).abs() + (back[1] - u[1]).abs();
                        assert!(error < 256.0 * slack, "{name} {way}: {u:?} {back:?}");
                    }
                }
            }
            let tests = 2 * quads.len() * 5;
            // The mean weight is one; weights are at most a few, so that their deviation is below
            // 2.
            let mean = mean / f64::from(samples);
            let sigma = 2.0 / f64::from(samples).sqrt();
            assert!((mean - 1.0).abs() < 5.0 * sigma, "{name} {way}: {mean}");
            // Offsets: each bin's mass by many small steps, whose error is at most one step of the
            // density at each jump.
            let expected: Vec<f64> = (0..32)
                .map(|bin| {
                    let steps = 3500;
                    let mass: f64 = (0..steps)
                        .map(|i| {
                            let x =
                                (f64::from(bin) + (f64::from(i) + 0.5) / f64::from(steps)) / 32.0;
                            s.pdf(a + x * (b - a)).value() * (b - a)
                        })
                        .sum();
                    mass / f64::from(32 * steps) * f64::from(samples)
                })
                .collect();
            let sum = expected.iter().sum::<f64>() / f64::from(samples);
            assert!((sum - 1.0).abs() < 1e-3, "{name} {way}: ∫ = {sum}");
            let p = chi2_test(&strips, &expected, 5.0).p_value;
            assert!(p > sidak(0.01, tests), "{name} {way}: p = {p:e}");
            if edge {
                let expected: Vec<f64> = values
                    .iter()
                    .map(|v| f64::from(samples) * (v / total).max(1e-9))
                    .collect();
                let p = chi2_test(&counts, &expected, 5.0).p_value;
                assert!(p > sidak(0.01, tests), "{name} {way}: p = {p:e}");
            }
        }
    }
}

#[test]
fn lines_on_textured_quads_obey_the_laws() {
    lines_fit(50_000);
}

#[test]
#[ignore = "long: a million lines on each light in each direction"]
fn lines_on_textured_quads_obey_the_laws_long() {
    lines_fit(1_000_000);
}

#[test]
fn joint_densities_integrate_to_what_is_visible() {
    let image = image();
    let visible = [Interval::new(0.1, 0.35), Interval::new(0.6, 0.9)];
    for (name, quad) in &quads()[..2] {
        for (way, _, s) in line_samplers(quad, &image) {
            // On each line: ∫ joint dt · length = p(u), wherever something visible emits.
            let (a, b) = s.lines().range();
            for k in 1..40 {
                let u = a + (b - a) * (f64::from(k) + 0.213) / 40.3;
                let segment = s.lines().segment(u).expect("on the light");
                let steps = 20_000;
                let sum: f64 = (0..steps)
                    .map(|i| (f64::from(i) + 0.5) / f64::from(steps))
                    .map(|t| s.joint_pdf(segment.at(t), &visible).value())
                    .sum();
                let mass = sum * segment.length() / f64::from(steps);
                let p = s.pdf(u).value();
                // Steps of the density, at most a few times its mean, at most 24 borders and ends.
                let close = (mass / p - 1.0).abs() < 24.0 * 5.0 / f64::from(steps);
                assert!(mass <= 0.0 || close, "{name} {way} {u}: {mass} {p}");
                let mut line = s.sample(0.5);
                (line.segment, line.offset, line.pdf) = (segment, u, s.pdf(u));
                for i in 0..50 {
                    let xi = (f64::from(i) + 0.5) / 50.0;
                    let p = s.point(&line, &visible, xi);
                    if !p.pdf.is_positive() {
                        continue;
                    }
                    let q = s.joint_pdf(p.point, &visible).value();
                    assert!((q / p.pdf.value() - 1.0).abs() < 1e-10, "{name} {way} {xi}");
                    let [_, back] = s.invert_point(p.point, &visible).expect("visible");
                    assert!((back - xi).abs() < 1e-12, "{name} {way}: {xi} {back}");
                }
            }
        }
    }
}

#[test]
fn oblique_lines_have_the_marginal_of_the_image() {
    // A constant image: the marginal is the length of the lines, in the mean over each strip.
    let quad = &quads()[1].1;
    let image = ImportanceImage::new(64, 64, &[1.0; 64 * 64]).expect("not black");
    let s = TexturedLines::new(quad, &image, 1.1).expect("a parallelogram");
    let (a, b) = s.lines().range();
    for k in 0..100 {
        let u = a + (b - a) * (f64::from(k) + 0.5) / 100.0;
        let error = s.pdf(u).value() - s.lines().length(u) / quad.area();
        // The length grows by at most its largest value over the first or last strip's
        // neighbourhood; half a strip off.
        assert!(error.abs() * (b - a) < 0.05, "{k}: {error}");
    }
}

/// An image on a quad, of which a light may be a part.
struct Painted {
    quad: ConvexPolygon,
    image: ImportanceImage,
    fits: bool,
}

impl EmissionTexture for Painted {
    fn radiance(&self, on_light: DVec3) -> DVec3 {
        on_light
    }

    fn points(&self) -> Option<TexturedSampler<'_>> {
        TexturedSampler::new(&self.quad, &self.image)
    }

    fn fits(&self) -> bool {
        self.fits
    }

    fn over(&self, _: &ConvexPolygon) -> Option<&ImportanceImage> {
        self.fits.then_some(&self.image)
    }
}

/// Points by a texture lie on the part that is the light. Lines by a texture run along its edges
/// unless a direction is given, and are by area where the texture does not cover the light.
#[test]
fn textures_obey() {
    let mut rng = rng(7);
    let quad = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X * 2.0, DVec3::Y).expect("a quad");
    let half = quad.clip(DVec3::X * 0.8, DVec3::new(1.0, 0.5, 0.0));
    let cosines = LtcMixture::new(Frame::from_normal(DVec3::Z), DVec3::ZERO);
    let x = DVec3::new(0.3, 0.1, -0.5);
    let below = viewer(x, &cosines);
    for (light, fits) in [(quad, true), (half.expect("a part"), false)] {
        let image = image();
        let (texture, surface) = (Painted { quad, image, fits }, Surface::Polygon(&light));
        assert_eq!(texture.radiance(x), x);
        let laws = Laws { surface, x };
        let source = PointSource::new(PointDensity::Texture, surface, Some(&texture), &below);
        let missed: u32 = (0..100).map(|_| laws.points(&source, &mut rng)).sum();
        // What is cut off has a fifth of the area and of the light.
        assert!(matches!(source, PointSource::Texture(_)) && (missed > 80) != fits);
        for _ in 0..cases(100) {
            let (by, setup) = (LineDensity::Texture, setup(&mut rng));
            let family = LineFamily::new(by, surface, Some(&texture), setup, &below);
            let family = family.expect("lines");
            assert_eq!(matches!(family, LineFamily::Texture(_)), fits);
            if fits && !setup.fixed {
                let is_first = (2.0 * setup.fraction).rem_euclid(2.0) < 1.0;
                let edge = if is_first { DVec3::X } else { DVec3::Y };
                assert!(family.direction().cross(edge).length() <= SLACK);
            }
            laws.lines(&family, &mut rng);
        }
    }
}
