//! Tests of texture filtering over the footprint of a pixel, by comparison with direct means, with
//! quadrature and with the rays of neighbouring pixels.

use crate::common::world;
use linelit_formats::{LoadOptions, Warning};
use linelit_geometry::glam::DAffine3;
use linelit_geometry::{DVec2, DVec3};
use linelit_scene::{
    Camera, Footprint, ImageData, ImageTexture, MaterialKind, PlaneUv, Projection, RayDifferential,
    Texture, TextureFilter, UvMapping, Wrap,
};
use proptest::prelude::*;
use std::f64::consts::PI;

/// A bound of the rounding of texels, which are stored in `f32` and rounded once in each of fewer
/// than ten levels.
const KEPT: f64 = 10.0 * 0.5 * f32::EPSILON as f64;

fn image(size: [u32; 2], filter: TextureFilter, value: impl Fn(u32, u32) -> f32) -> ImageTexture {
    let [w, h] = size;
    let pixel = |k: u32| [value(k % w, k / w); 3];
    let pixels = (0..w * h).map(pixel).collect();
    let data = ImageData::linear(w, h, pixels).unwrap();
    ImageTexture {
        filter,
        ..ImageTexture::new(data.into())
    }
}

/// A pseudo-random number in [0, 1) for each pixel.
fn noise(x: u32, y: u32) -> f32 {
    let mixed = (x * 7919 + y * 104_729 + 17).wrapping_mul(2_654_435_761);
    f32::from(u16::try_from(mixed >> 16).unwrap()) / 65536.0
}

fn square(uv: DVec2, side: f64) -> Footprint {
    Footprint {
        uv,
        dx: DVec2::new(side, 0.0),
        dy: DVec2::new(0.0, side),
    }
}

fn filters() -> impl Strategy<Value = TextureFilter> {
    prop_oneof![
        Just(TextureFilter::Point),
        Just(TextureFilter::Bilinear),
        Just(TextureFilter::Trilinear),
        (1.0..64.0).prop_map(|max_anisotropy| TextureFilter::Ewa { max_anisotropy }),
    ]
}

fn wraps() -> impl Strategy<Value = Wrap> {
    prop_oneof![Just(Wrap::Repeat), Just(Wrap::Mirror), Just(Wrap::Clamp)]
}

/// Vectors whose lengths are from 1e-12 to 1e12, and zero.
fn changes() -> impl Strategy<Value = DVec2> {
    let size = prop_oneof![Just(0.0), (-12.0..12.0).prop_map(|e: f64| 10f64.powf(e))];
    (size, 0.0..std::f64::consts::TAU).prop_map(|(size, angle)| size * DVec2::from_angle(angle))
}

proptest! {
    /// A constant is a constant over every footprint, whatever the size of the image.
    #[test]
    fn a_constant_stays(
        size in [1..40u32, 1..40u32],
        filter in filters(),
        wrap in [wraps(), wraps()],
        uv in [-3.0..3.0, -3.0..3.0f64],
        change in [changes(), changes()],
    ) {
        let mut constant = image(size, filter, |_, _| 0.3);
        constant.wrap = wrap;
        let at = Footprint { uv: uv.into(), dx: change[0], dy: change[1] };
        let got = constant.evaluate(at).x;
        prop_assert!((got - f64::from(0.3f32)).abs() < KEPT, "{got}");
    }

    /// Lookups are finite and within the range of the image, resampling aside, wherever they are.
    #[test]
    fn lookups_are_finite(
        size in [1..20u32, 1..20u32],
        filter in filters(),
        uv in [-300..300i32, -300..300i32],
        change in [-300..300i32, -300..300i32, -300..300i32, -300..300i32],
    ) {
        let number = |e: i32| if e == 0 { 0.0 } else { f64::from(e.signum()) * 10f64.powi(e) };
        let texture = image(size, filter, noise);
        let [a, b, c, d] = change.map(number);
        let at = Footprint {
            uv: uv.map(number).into(),
            dx: DVec2::new(a, b),
            dy: DVec2::new(c, d),
        };
        let got = texture.evaluate(at).x;
        // The Lanczos filter of radius two overshoots by less than a quarter in two directions.
        prop_assert!((0.0..1.25).contains(&got), "{got}");
    }

    /// The ray differentials of a camera ray are the rays of the neighbouring pixels. Where those
    /// meet the plane of a triangle, the texture coordinates have changed by as much as the
    /// footprint of the surface says.
    #[test]
    fn footprints_reach_to_the_neighbours(
        kind in 0..3usize,
        film in [1.0..90.0, 1.0..50.0f64],
        corners in [[-2.0..2.0, -2.0..2.0, 3.0..6.0f64], [-2.0..2.0, -2.0..2.0, 3.0..6.0], [-2.0..2.0, -2.0..2.0, 3.0..6.0]],
        spacing in 0.01..1.0f64,
    ) {
        let projection = [
            Projection::Perspective { fov_degrees: 40.0 },
            Projection::Orthographic,
            Projection::Spherical { z_up: false },
        ][kind];
        let place = DAffine3::from_rotation_y(0.3) * DAffine3::from_rotation_x(-0.2);
        let camera = Camera::new(place, projection, None, None, [96, 54]);
        let numbers: Vec<String> = corners.iter().flatten().map(f64::to_string).collect();
        let scene = world(&format!(
            "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point P\" [ {} ]
             \"float uv\" [ 0.1 0.2  1.4 0.3  0.2 2.5 ]",
            numbers.join(" ")
        ));
        let corners = scene.corners(0);
        let uv = [[0.1f32, 0.2], [1.4, 0.3], [0.2, 2.5]]
            .map(|uv| DVec2::from(uv.map(f64::from)));
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let plane = PlaneUv::new(corners, uv);
        let hit = |origin: DVec3, direction: DVec3| {
            origin + direction * (normal.dot(corners[0] - origin) / normal.dot(direction))
        };
        let ray = camera.ray(film[0], film[1]);
        let point = hit(ray.origin, ray.direction);
        // Triangles seen not too obliquely; anywhere on their planes.
        let oblique = normal.normalize_or_zero().dot(ray.direction).abs();
        prop_assume!(normal.length() > 0.1 && oblique > 0.2);
        let weights = {
            let (e, f) = (corners[1] - corners[0], corners[2] - corners[0]);
            let at = point - corners[0];
            let square = normal.length_squared();
            [f.cross(normal).dot(at) / square, normal.cross(e).dot(at) / square]
        };
        let beside = camera.differential(film[0], film[1], 1.0);
        for (k, step) in [DVec2::X, DVec2::Y].into_iter().enumerate() {
            let next = camera.ray(film[0] + step.x, film[1] + step.y);
            prop_assert_eq!([beside.origins[k], beside.directions[k]], [next.origin, next.direction]);
        }
        let surface = scene.surface_over(0, weights, ray.direction, Some(&beside));
        let footprint = surface.footprint();
        let steps = [(DVec2::X, footprint.dx), (DVec2::Y, footprint.dy)];
        for (k, (step, change)) in steps.into_iter().enumerate() {
            let next = camera.ray(film[0] + step.x, film[1] + step.y);
            let there = hit(next.origin, next.direction);
            // Coordinates of about ten, through a few operations, divided by cosine and area.
            let size = 10.0 + (there - point).length() + point.length();
            let tolerance = 1e-13 * size / oblique;
            let moved = surface.covered.point[k] - (there - point);
            prop_assert!(moved.length() < tolerance, "{moved}");
            let moved = change - (plane.at(there) - plane.at(point));
            prop_assert!(moved.length() < 30.0 * tolerance, "{moved}");
        }
        // A fraction of the pixel spacing shifts the rays by that fraction, on either side.
        let part = camera.differential(film[0], film[1], spacing);
        for k in 0..2 {
            let origin = ray.origin + spacing * (beside.origins[k] - ray.origin);
            let direction = ray.direction + spacing * (beside.directions[k] - ray.direction);
            prop_assert!((part.origins[k] - origin).length() < 1e-14);
            prop_assert!((part.directions[k] - direction).length() < 1e-14);
        }
    }

    /// A checkerboard over a footprint is the mean over the rectangle that reaches a pixel to
    /// each side.
    #[test]
    fn checkerboards_are_means(uv in [-4.0..4.0, -4.0..4.0f64], reach in [0.01..3.0, 0.01..3.0f64]) {
        let board = |filtered| Texture::Checkerboard {
            mapping: UvMapping::IDENTITY,
            filtered,
            even: Texture::number(1.0).into(),
            odd: Texture::number(0.25).into(),
        };
        let at = Footprint {
            uv: uv.into(),
            dx: DVec2::new(reach[0], -0.3 * reach[1]),
            dy: DVec2::new(0.2 * reach[0], reach[1]),
        };
        // Integrate by a midpoint rule with N² cells. Each of the at most 2 · 7 edges that cross
        // the footprint causes an error of a fraction of one row of cells.
        const N: u32 = 400;
        let mut sum = 0.0;
        for k in 0..N * N {
            let place = DVec2::new(f64::from(k % N), f64::from(k / N)) + DVec2::splat(0.5);
            let place = at.uv + DVec2::from(reach) * (place * (2.0 / f64::from(N)) - DVec2::ONE);
            sum += board(true).evaluate_number(place);
        }
        let mean = sum / f64::from(N * N);
        let got = board(true).evaluate_number(at);
        prop_assert!((got - mean).abs() < 0.75 * 14.0 / f64::from(N), "{got} {mean}");
        prop_assert_eq!(
            board(false).evaluate_number(at).to_bits(),
            board(true).evaluate_number(at.uv).to_bits()
        );
    }
}

/// Over footprints of 2^k texels at the centre of a block of the same size, trilinear lookups are
/// the block's mean; half-way between two such widths they are half-way between the two.
#[test]
fn trilinear_lookups_are_means_of_blocks() {
    let (w, h) = (32, 16);
    let texture = image([w, h], TextureFilter::Trilinear, noise);
    let mean = |x: u32, y: u32, n: u32| {
        let pixels = (0..n * n).map(|k| f64::from(noise(x * n + k % n, y * n + k / n)));
        pixels.sum::<f64>() / f64::from(n * n)
    };
    for level in 0..4 {
        let n = 1u32 << level;
        for (x, y) in [(0, 0), (1, 0), ((w / n) - 1, (h / n) - 1)] {
            // Rows count from the top, v from the bottom. The width is twice the larger change.
            let texels = DVec2::new(f64::from(w), f64::from(h));
            let middle = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) * f64::from(n) / texels;
            let uv = DVec2::new(middle.x, 1.0 - middle.y);
            let side = 0.5 * f64::from(n) / f64::from(w);
            let got = texture.evaluate(square(uv, side)).x;
            assert!((got - mean(x, y, n)).abs() < KEPT, "{n} {x} {y}: {got}");
            // The coarser level is bilinear there: the middle of a block is a quarter of the way
            // from the middle of its parent, to three neighbours.
            let parent = texture.evaluate(square(uv, 2.0 * side)).x;
            let between = texture.evaluate(square(uv, side * 2f64.sqrt())).x;
            assert!(
                (between - 0.5 * (got + parent)).abs() < KEPT,
                "{n} {x} {y}: {between}"
            );
        }
    }
}

/// Over the whole image, every filter gives its mean: exactly where sides are powers of two; where
/// they are not, resampling weighs the pixels of noise unequally by its window's ripple, a few
/// hundredths of each.
#[test]
fn the_whole_image_is_its_mean() {
    let all = [
        TextureFilter::Point,
        TextureFilter::Bilinear,
        TextureFilter::Trilinear,
        TextureFilter::default(),
    ];
    for (size, tolerance) in [
        ([32, 8], KEPT),
        ([1, 64], KEPT),
        ([27, 33], 2e-3),
        ([450, 30], 2e-3),
    ] {
        for filter in all {
            let texture = image(size, filter, noise);
            let [w, h] = size;
            let pixels = (0..w * h).map(|k| f64::from(noise(k % w, k / w)));
            let mean = pixels.sum::<f64>() / f64::from(w * h);
            let got = texture.evaluate(square(DVec2::new(0.3, 0.8), 2.0)).x;
            assert!(
                (got - mean).abs() < tolerance,
                "{size:?} {filter:?}: {got} {mean}"
            );
        }
    }
}

/// Where a lookup over an ellipse uses only the finest level, it is the mean of the texels with
/// Gaussian weights, up to the rounding of the table of 128 weights. The table rounds the argument
/// by at most 1/128 and so each weight by at most exp(−2 r²)/64; the error of the mean is bounded
/// by the sum of these, each times the difference of the texel from the mean.
#[test]
fn ellipses_are_sums_with_gaussian_weights() {
    let n = 32;
    let texture = image(
        [n, n],
        TextureFilter::Ewa {
            max_anisotropy: 8.0,
        },
        noise,
    );
    let mut largest = 0.0f64;
    for (turn, long, wide) in [
        (0.3, 1.0, 1.0),
        (0.0, 5.0, 1.0),
        (1.1, 7.5, 1.0),
        (2.5, 3.0, 0.8),
    ] {
        let axis = DVec2::from_angle(turn);
        let (p, q) = (long * axis, wide * axis.perp());
        let uv = DVec2::new(0.43, 0.71);
        let at = Footprint {
            uv,
            dx: p / f64::from(n),
            dy: q / f64::from(n),
        };
        let got = texture.evaluate(at).x;
        // The ellipse is x^T M^-1 x < 1 with M = p p^T + q q^T + 1, in texels, with v upwards.
        let (xx, xy, yy) = (
            p.x * p.x + q.x * q.x + 1.0,
            p.x * p.y + q.x * q.y,
            p.y * p.y + q.y * q.y + 1.0,
        );
        // Collect the texels in the ellipse as pairs (r², value).
        let centre = uv * f64::from(n);
        let mut terms = Vec::new();
        for row in -20..52i32 {
            for column in -20..52i32 {
                let d = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5) - centre;
                let square =
                    (yy * d.x * d.x - 2.0 * xy * d.x * d.y + xx * d.y * d.y) / (xx * yy - xy * xy);
                if square < 1.0 {
                    let index = |k: i32| u32::try_from(k.rem_euclid(32)).unwrap();
                    terms.push((square, f64::from(noise(index(column), 31 - index(row)))));
                }
            }
        }
        // Compare their weighted mean with the lookup.
        let weight = |square: f64| (-2.0 * square).exp() - (-2.0f64).exp();
        let weights: f64 = terms.iter().map(|(s, _)| weight(*s)).sum();
        let mean = terms.iter().map(|(s, v)| weight(*s) * v).sum::<f64>() / weights;
        let rounding = |(s, v): &(f64, f64)| (-2.0 * s).exp() / 64.0 * (v - mean).abs();
        let tolerance = terms.iter().map(rounding).sum::<f64>() / weights;
        let error = (got - mean).abs();
        assert!(
            error < tolerance,
            "{turn} {long}: {got} {mean} ± {tolerance}"
        );
        largest = largest.max(tolerance);
    }
    // The tolerance is small enough to see a wrong turn: a quarter turn of the longest ellipse
    // would change the mean by more.
    assert!(largest < 0.02, "{largest}");
}

/// The mean of a cosine wave over an ellipse lies between two bounds: the Gaussian mean over the
/// ellipse of the footprint, and that over an ellipse to whose axes a texel of the coarser level
/// was added in quadrature, damped by the box filter of these texels.
#[test]
fn ellipses_are_gaussian_means_of_waves() {
    let n = 512;
    let waves = 6.0;
    let wave = |x: u32, _: u32| {
        let phase = (f64::from(x) + 0.5) / f64::from(n) * waves * 2.0 * PI;
        #[allow(clippy::cast_possible_truncation, reason = "rounding is meant")]
        let value = (0.5 + 0.5 * phase.cos()) as f32;
        value
    };
    let texture = image(
        [n, n],
        TextureFilter::Ewa {
            max_anisotropy: 8.0,
        },
        wave,
    );
    // The Fourier transform of the truncated Gaussian on the unit disk at ω, divided by that at 0.
    let damping = |omega: f64| {
        let steps = 2000;
        let (mut sum, mut all) = (0.0, 0.0);
        for i in 0..steps {
            // For each x, integrate the weights over y.
            let x = (f64::from(i) + 0.5) / f64::from(steps);
            let half = (1.0 - x * x).sqrt();
            let strip: f64 = (0..200)
                .map(|k| {
                    let y = half * (f64::from(k) + 0.5) / 200.0;
                    (-2.0 * (x * x + y * y)).exp() - (-2.0f64).exp()
                })
                .sum::<f64>()
                * half;
            sum += strip * (omega * x).cos();
            all += strip;
        }
        sum / all
    };
    for (long, wide, turn) in [(0.02, 0.01, 0.0), (0.03, 0.012, 0.5), (0.024, 0.006, 1.2)] {
        let axis = DVec2::from_angle(turn);
        let (p, q) = (long * axis, wide * axis.perp());
        // Look up the texture at a crest of the wave.
        let at = Footprint {
            uv: DVec2::new(0.5, 0.3),
            dx: p,
            dy: q,
        };
        let got = 2.0 * texture.evaluate(at).x - 1.0;
        let omega = 2.0 * PI * waves;
        let reach = (p.x * p.x + q.x * q.x).sqrt();
        // The texels of the coarser of the two levels are at most twice as large as the width of
        // the ellipse.
        let texel = 2.0 * wide;
        let most = damping(omega * reach);
        let half = 0.5 * omega * texel;
        let least = damping(omega * (reach * reach + texel * texel).sqrt()) * half.sin() / half;
        // Sums over texels differ from integrals, and weights from those of the table, by less than
        // a hundredth.
        assert!(
            (least - 0.01..most + 0.01).contains(&got),
            "{least} {got} {most}"
        );
    }
}

/// The texture filter depends on the parameters of the texture and on the version of the file,
/// which follows from the film's name: "image" is pbrt-v3's and "rgb" is pbrt-v4's.
#[test]
#[allow(clippy::too_many_lines, reason = "one case after the other")]
fn files_say_how_to_filter() {
    let text = |film: &str, parameters: &str| {
        format!(
            "Film \"{film}\"\nCamera \"perspective\"\nWorldBegin\n\
             Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"tests/images/ramp.png\" \
             {parameters}\nMaterial \"matte\" \"texture Kd\" \"t\"\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point3 P\" [0 0 0  1 0 0  0 1 0]\n"
        )
    };
    let read = |film, parameters| {
        let loaded = linelit_formats::from_pbrt_str(
            &text(film, parameters),
            "a.pbrt",
            &LoadOptions::default(),
        );
        loaded.map(|loaded| {
            let scene = loaded.scene;
            let MaterialKind::Matte {
                kd: Texture::Image(image),
                ..
            } = &scene.materials[scene.material_of(0) as usize].kind
            else {
                panic!("an image");
            };
            let about = |w: &&Warning| w.to_string().contains("maxanisotropy");
            (image.filter, loaded.warnings.iter().filter(about).count())
        })
    };
    let ellipses = |max_anisotropy| TextureFilter::Ewa { max_anisotropy };
    let cases = [
        ("image", "", ellipses(8.0), 0),
        ("image", "\"float maxanisotropy\" 3", ellipses(3.0), 0),
        ("image", "\"float maxanisotropy\" 100", ellipses(64.0), 1),
        ("image", "\"bool trilinear\" \"false\"", ellipses(8.0), 0),
        (
            "image",
            "\"bool trilinear\" \"true\"",
            TextureFilter::Trilinear,
            0,
        ),
        ("rgb", "", TextureFilter::Bilinear, 0),
        (
            "rgb",
            "\"string filter\" \"point\"",
            TextureFilter::Point,
            0,
        ),
        (
            "rgb",
            "\"string filter\" \"bilinear\"",
            TextureFilter::Bilinear,
            0,
        ),
        (
            "rgb",
            "\"string filter\" \"trilinear\"",
            TextureFilter::Trilinear,
            0,
        ),
        (
            "rgb",
            "\"string filter\" \"ewa\" \"float maxanisotropy\" 4",
            ellipses(4.0),
            0,
        ),
        ("rgb", "\"string filter\" \"EWA\"", ellipses(8.0), 0),
    ];
    for (film, parameters, filter, warnings) in cases {
        assert_eq!(
            read(film, parameters).unwrap(),
            (filter, warnings),
            "{film} {parameters}"
        );
    }
    for wrong in [
        "\"float maxanisotropy\" 0.5",
        "\"string filter\" \"bilinaer\"",
    ] {
        let error = read("rgb", wrong).unwrap_err();
        assert!(error.to_string().contains("a.pbrt:4"), "{error}");
    }
}

/// A bump map that repeats many times in a pixel looks flat, and one that repeats rarely is as
/// steep as without a footprint.
#[test]
fn bumps_are_as_flat_as_they_look() {
    let scene = |scale: f64| {
        world(&format!(
            "Texture \"b\" \"float\" \"checkerboard\" \"float tex1\" 0 \"float tex2\" 0.2
                \"float uscale\" {scale} \"float vscale\" {scale}
             Material \"matte\" \"texture bumpmap\" \"b\"
             Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point P\" [ 0 0 0  1 0 0  0 1 0 ]
                \"float uv\" [ 0 0  1 0  0 1 ]"
        ))
    };
    let beside = |change: f64| RayDifferential {
        origins: [
            DVec3::new(0.3 + change, 0.4, 1.0),
            DVec3::new(0.3, 0.4 + change, 1.0),
        ],
        directions: [DVec3::NEG_Z; 2],
    };
    let normal = |scale: f64, change: f64| {
        let beside = beside(change);
        let seen = scene(scale).surface_over(0, [0.3, 0.4], DVec3::NEG_Z, Some(&beside));
        seen.shading_normal
    };
    // With a hundred squares in a pixel, the mean of a square wave over two pixels is at most
    // 1/200, so that heights are within 0.2 · 1/2 · 1/200² of their mean. The step of the
    // difference is half a pixel.
    let flat = normal(1000.0, 0.1);
    let slope = 2.0 * 0.1 / (200.0 * 200.0) / 0.05;
    assert!(flat.x.abs() <= slope && flat.y.abs() <= slope, "{flat}");
    // The footprint around u = 0.3 reaches to 0.31. A step of 0.005, half a pixel, moves it to
    // 0.315, so that 0.003 of its width of 0.02 are past the edge at 0.312. Its mean height grows
    // by 0.03 over the step of 0.005, which is a slope of six.
    let steep = normal(1.0 / 0.312, 0.01);
    assert!((steep.x.abs() - 6.0 / 37f64.sqrt()).abs() < 1e-6, "{steep}");
    // Far from all edges the surface is flat again.
    assert_eq!(normal(1.0, 0.01), DVec3::Z);
}
