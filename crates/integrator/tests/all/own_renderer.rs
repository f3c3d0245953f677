//! The renderer that the tests of `linelit-estimators` build without a scene gives the light of
//! this one, on the same scene from a file.

#[path = "../../../estimators/tests/all/renderer.rs"]
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
Material "matte" "rgb Kd" [ 0.7 0.5 0.3 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -9 -9 0  9 -9 0  9 9 0  -9 9 0 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ -0.6 -0.2 1  0.5 -0.2 1.1  0.1 0.6 0.7 ]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 8 6 4 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ -0.8 -0.5 2  0.1 0.9 1.6  0.7 -0.4 2.2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ 1.2 -0.5 2  2.1 0.9 1.6  2.7 -0.4 2.2 ]
AttributeEnd
WorldEnd
"#;

/// From points above the floor, which the own renderer does not have. The same random numbers, so
/// that only rounding differs: positions of the scene are f32 (6e-8), which near an edge of the
/// blocker may decide one of 1,024 samples otherwise.
#[test]
fn an_own_renderer_gives_the_same_light() {
    let scene = from_pbrt_str(SCENE, "room.pbrt", &LoadOptions::default())
        .unwrap()
        .scene;
    let renderer = Renderer::new(&scene);
    let mut workspace = Workspace::new();
    let mut point = renderer.shading_point([2, 2], &mut workspace).unwrap();
    (point.geometric_normal, point.normal, point.outgoing) = (DVec3::Z, DVec3::Z, DVec3::Z);
    for estimator in ["point-area", "line-area", "line-solid-angle+point-bsdf"] {
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
            let want = renderer.direct(&settings, &point, [0, 0], 0, &mut workspace);
            let got = radiance(x, estimator, settings.samples, settings.seed);
            let error = (got - want).abs().max_element() / want.max_element();
            assert!(
                want.min_element() > 0.01 && error < 2e-3,
                "{estimator}: {got} for {want}"
            );
        }
    }
}
