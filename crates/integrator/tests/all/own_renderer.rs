//! A renderer of one's own, without a scene, gives the same light as this crate on the same scene
//! from a file.

mod renderer;

use linelit_formats::{LoadOptions, from_pbrt_str};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, Workspace};
use renderer::radiance;

const SCENE: &str = r#"
LookAt 0 -0.5 5  0 0 0  0 1 0
Camera "perspective" "float fov" [ 40 ]
Film "image" "integer xresolution" [ 4 ] "integer yresolution" [ 4 ]
WorldBegin
Material "matte" "rgb Kd" [ 0.75 0.5 0.25 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -9 -9 0  9 -9 0  9 9 0  -9 9 0 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ -0.5 -0.25 1  0.5 -0.25 1  0.125 0.5 0.75 ]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 8 6 4 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ -0.75 -0.5 2  0.125 0.875 1.625  0.75 -0.375 2.25 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ 1.25 -0.5 2  2.125 0.875 1.625  2.75 -0.375 2.25 ]
AttributeEnd
WorldEnd
"#;

/// Only rounding may differ: the random numbers are the same, and so are the lights and the
/// occluder, whose corners are `f32` numbers. Points are lifted above the floor, which the own
/// renderer does not have. A sample has some 50 rounding errors between its random number and its
/// light, and the mean has no larger error.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

#[test]
fn an_own_renderer_gives_the_same_light() {
    let scene = from_pbrt_str(SCENE, "room.pbrt", &LoadOptions::default())
        .unwrap()
        .scene;
    let renderer = Renderer::new(&scene);
    let mut workspace = Workspace::new();
    let mut point = renderer.shading_point([2, 2], &mut workspace).unwrap();
    (point.geometric_normal, point.normal, point.outgoing) = (DVec3::Z, DVec3::Z, DVec3::Z);
    // The own renderer does not probe which direction of lines is best for a light.
    for estimator in [
        "point-area",
        "line-area[orientation=parallel]",
        "line-solid-angle[orientation=parallel]+point-bsdf",
    ] {
        let settings = Settings {
            estimator: estimator.parse().unwrap(),
            samples: 1024,
            seed: 1,
            ..Settings::default()
        };
        for x in [
            DVec3::new(0.0, 0.0, 1e-3),
            DVec3::new(0.6, -0.2, 1e-3),
            DVec3::new(-0.4, 0.3, 1e-3),
        ] {
            point.position = x;
            let want = renderer.direct(&settings, &point, [0, 0], &mut workspace);
            let got = radiance(x, estimator, settings.samples, settings.seed);
            let error = (got - want).abs().max_element() / want.max_element();
            assert!(
                want.min_element() > 0.01 && error < ROUNDING,
                "{estimator}: {got} for {want}, {error:e}"
            );
        }
    }
}
