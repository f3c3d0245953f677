//! Rows of pixels, whose camera rays are traced together, are compared with their pixels one by
//! one.

use crate::common::{QUAD_AND_SPHERE, SQUARE, load, room_text};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, Workspace};

/// A room with a mirror on the floor, seen by a camera.
fn text(camera: &str) -> String {
    let mirror = r#"AttributeBegin
Material "mirror"
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point P" [ -1 -1 .2  1 -1 .2  0 0 .2 ]
AttributeEnd"#;
    let text = room_text(SQUARE, &format!("{QUAD_AND_SPHERE}\n{mirror}"));
    let perspective = r#"Camera "perspective" "float fov" [ 40 ]"#;
    assert!(text.contains(perspective));
    text.replace(perspective, camera)
}

#[test]
fn a_row_is_its_pixels() {
    let cameras = [
        r#"Camera "perspective" "float fov" [ 60 ]"#,
        // With this camera, each axis is the largest component of some rays.
        r#"Camera "perspective" "float fov" [ 170 ]"#,
        r#"Camera "orthographic""#,
        r#"Camera "environment""#,
    ];
    let (mut lit, mut dark) = (0, 0);
    for camera in cameras {
        let scene = load(&text(camera));
        let renderer = Renderer::new(&scene);
        for (pixel_samples, show_lights) in [(1, true), (1, false), (3, true)] {
            let settings = Settings {
                estimator: "point-area".parse().expect("an estimator"),
                samples: 2,
                pixel_samples,
                show_lights,
                bounces: 2,
                ..Settings::default()
            };
            let mut workspace = Workspace::new();
            for y in 0..16 {
                // Rows may begin anywhere, extend beyond the film, or be empty.
                for (x0, count) in [(0, 16), (3, 9), (5, 0), (12, 7)] {
                    let mut row = vec![DVec3::NAN; count];
                    renderer.row(&settings, [x0, y], &mut row, &mut workspace);
                    for (x, value) in (x0..).zip(&row) {
                        let want = renderer.pixel(&settings, [x, y], &mut Workspace::new());
                        assert_eq!(*value, want, "{camera}, ({x}, {y})");
                        *if want == DVec3::ZERO {
                            &mut dark
                        } else {
                            &mut lit
                        } += 1;
                    }
                }
            }
        }
    }
    assert!(lit > 1000 && dark > 1000, "{lit} lit, {dark} dark");
}

/// The scale of a film multiplies each camera sample, including lights that are seen directly or in
/// mirrors.
#[test]
fn a_film_scales_its_picture() {
    let plain = load(&text(r#"Camera "perspective" "float fov" [ 60 ]"#));
    let mut scaled = plain.clone();
    // The scale is a power of two, so that nothing is rounded.
    scaled.film.scale = 0.25;
    let [plain, scaled] = [&plain, &scaled].map(Renderer::new);
    for pixel_samples in [1, 3] {
        let settings = Settings {
            pixel_samples,
            bounces: 1,
            ..Settings::default()
        };
        let mut workspace = Workspace::new();
        for y in 0..16 {
            let [mut ours, mut theirs] = [[DVec3::ZERO; 16]; 2];
            plain.row(&settings, [0, y], &mut ours, &mut workspace);
            scaled.row(&settings, [0, y], &mut theirs, &mut workspace);
            assert_eq!(ours.map(|v| 0.25 * v), theirs, "row {y}");
            let sample = |renderer: &Renderer<'_>, workspace: &mut Workspace| {
                let mut sum = DVec3::ZERO;
                let (pixel, all) = ([y, y], 0..pixel_samples);
                let add = |sample| sum += sample;
                let _ = renderer.pixel_block(&settings, pixel, all, workspace, add);
                sum
            };
            let want = 0.25 * sample(&plain, &mut workspace);
            assert_eq!(sample(&scaled, &mut workspace), want);
        }
    }
}

/// Pixels outside any picture can be computed, too.
#[test]
fn rows_end_where_numbers_do() {
    let scene = load(&text(r#"Camera "perspective" "float fov" [ 60 ]"#));
    let renderer = Renderer::new(&scene);
    let (settings, mut workspace) = (Settings::default(), Workspace::new());
    let mut row = [DVec3::NAN; 20];
    renderer.row(
        &settings,
        [u32::MAX - 9, u32::MAX],
        &mut row,
        &mut workspace,
    );
    assert!(row.iter().all(|value| value.is_finite()));
}

/// The sum of the blocks of camera samples, in their order, is the pixel, no matter where they were
/// computed.
#[test]
fn a_pixel_is_its_blocks() {
    let scene = load(&text(r#"Camera "perspective" "float fov" [ 60 ]"#));
    let renderer = Renderer::new(&scene);
    let pixel = [5, 9];
    for (pixel_samples, blocks) in [(0, 1), (1, 1), (64, 1), (65, 2), (4097, 64), (9999, 64)] {
        let settings = Settings {
            estimator: "point-area".parse().expect("an estimator"),
            samples: 1,
            pixel_samples,
            bounces: 1,
            ..Settings::default()
        };
        assert_eq!(settings.sample_blocks().len(), blocks);
        let mut parts: Vec<_> = settings.sample_blocks().enumerate().collect();
        // Compute the blocks from the last one on, each with a workspace of its own.
        parts.reverse();
        let mut sums = vec![DVec3::ZERO; blocks];
        let mut seen = 0;
        for (k, block) in parts {
            let each = |_| seen += 1;
            let mut workspace = Workspace::new();
            sums[k] = renderer.pixel_block(&settings, pixel, block, &mut workspace, each);
        }
        let count = pixel_samples.max(1);
        assert_eq!(seen, count);
        let sum = sums.into_iter().fold(DVec3::ZERO, |a, b| a + b);
        let whole = renderer.pixel(&settings, pixel, &mut Workspace::new());
        assert_eq!(sum / f64::from(count), whole, "{pixel_samples} samples");
        assert!(whole.min_element() > 0.0);
    }
    let most = Settings {
        pixel_samples: u32::MAX,
        ..Settings::default()
    };
    let ends: Vec<_> = most.sample_blocks().collect();
    assert_eq!((ends.len(), ends[63].end), (64, u32::MAX));
    assert!(
        ends.windows(2)
            .all(|w| w[0].end == w[1].start && !w[1].is_empty())
    );
}

/// The counts do not show which trials a thread has computed, or in which order.
#[test]
fn an_estimate_counts_its_own_work_alone() {
    let scene = load(&text(r#"Camera "perspective" "float fov" [ 60 ]"#));
    let renderer = Renderer::new(&scene);
    let mut hidden = 0;
    for estimator in ["point-area", "line-analytic", "hybrid"] {
        let settings = |seed| Settings {
            estimator: estimator.parse().expect("an estimator"),
            samples: 4,
            seed,
            ..Settings::default()
        };
        let mut one_thread = Workspace::new();
        for pixel in (0..256).map(|k| [k % 16, k / 16]) {
            let Some(point) = renderer.shading_point(pixel, &mut Workspace::new()) else {
                continue;
            };
            for seed in 0..4 {
                let count = |workspace: &mut Workspace| {
                    let value = renderer.direct(&settings(seed), &point, pixel, workspace);
                    (value, workspace.take_counts().visibility)
                };
                let alone = count(&mut Workspace::new());
                assert_eq!(count(&mut one_thread), alone, "{estimator}, {pixel:?}");
                hidden += u32::from(alone.0 == DVec3::ZERO);
            }
        }
    }
    assert!(hidden > 100, "{hidden} estimates found nothing");
}

/// Estimators that query visibility by rays alone get the same pixels from occluders that are built
/// for rays. If any other estimator is among them, there are the occluders that it needs.
#[test]
fn occluders_for_rays_show_the_same() {
    let scene = load(&text(r#"Camera "perspective" "float fov" [ 60 ]"#));
    let all = Renderer::new(&scene);
    let memory = all.occluders().memory();
    for (estimator, by_rays) in [
        ("point-area", true),
        ("point-bsdf", true),
        ("point-area[visibility=shaft]", false),
        ("point-area+point-bsdf", false),
        ("line-analytic", false),
        ("exact", false),
        ("hybrid", false),
    ] {
        let estimator = estimator.parse().expect("an estimator");
        let settings = Settings {
            estimator,
            samples: 2,
            ..Settings::default()
        };
        let few = Renderer::for_estimators(&scene, [&estimator]);
        assert_eq!(few.occluders().memory() < memory, by_rays, "{estimator}");
        let mut workspace = Workspace::new();
        for pixel in (0..64).map(|k| [k % 8, k / 8]) {
            let [a, b] = [&all, &few].map(|r| r.pixel(&settings, pixel, &mut workspace));
            assert_eq!(a, b, "{estimator} at {pixel:?}");
        }
        let both = [estimator, "exact".parse().expect("an estimator")];
        let both = Renderer::for_estimators(&scene, &both);
        assert_eq!(both.occluders().memory(), memory);
    }
}

/// Past holes, `exact` takes lines, whose direction is known because the light was probed. This is
/// also so for a renderer that is built for `exact` alone.
#[test]
fn exact_past_holes_takes_the_lines_of_any_renderer() {
    let slat = |y: f64| {
        format!(
            r#"Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
"point P" [ -1 {y} 1  1 {y} 1  1 {0} 1  -1 {0} 1 ]"#,
            y + 0.1
        )
    };
    let slats: String = (0..5).map(|k| slat(-0.8 + 0.35 * f64::from(k))).collect();
    let panel = r#"Texture "holes" "float" "checkerboard" "float tex1" [ 1 ] "float tex2" [ 0 ]
"float uscale" [ 4 ] "float vscale" [ 4 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point2 uv" [ 0 0  1 0  1 1  0 1 ]
"point P" [ -1 -1 1.2  1 -1 1.2  1 1 1.2  -1 1 1.2 ] "texture alpha" "holes""#;
    let scene = load(&room_text(SQUARE, &format!("{slats}\n{panel}")));
    let settings = Settings {
        estimator: "exact".parse().expect("an estimator"),
        samples: 2,
        ..Settings::default()
    };
    let all = Renderer::new(&scene);
    let light = &all.plan().lights_of(settings.spheres)[0];
    assert!(light.occlusion.direction.is_some());
    let few = Renderer::for_estimators(&scene, [&settings.estimator]);
    let mut workspace = Workspace::new();
    for pixel in (0..256).map(|k| [k % 16, k / 16]) {
        let [a, b] = [&all, &few].map(|r| r.pixel(&settings, pixel, &mut workspace));
        assert_eq!(a, b, "{pixel:?}");
    }
}
