//! Rows of pixels, whose camera rays are traced together, against their pixels one by one.

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
        // Rays along all axes.
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
                // From anywhere on, beyond the film, too, and none.
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

/// Film places that no picture has are places all the same.
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
