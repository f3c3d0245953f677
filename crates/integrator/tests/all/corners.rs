//! Lights with many corners, clipped by horizons to even more, are behind a wall: all estimators
//! find them dark.

use crate::common::{MIXES, PHONG, load, microfacets, points, settings};
use linelit_geometry::{DVec3, MAX_VERTICES};
use linelit_integrator::{Renderer, Settings, Workspace};
use linelit_lights::Light;
use std::fmt::Write;

/// Estimators that are not combinations.
const SINGLE: [&str; 18] = [
    "point-area",
    "point-visible-area",
    "point-solid-angle",
    "point-projected-solid-angle",
    "point-bsdf",
    "point-area[visibility=shaft]",
    "point-solid-angle[visibility=shaft]",
    "point-texture+point-bsdf",
    "line-area",
    "line-analytic",
    "line-analytic[orientation=uniform]",
    "line-analytic[orientation=stratified]",
    "line-area[orientation=origin]",
    "line-analytic[orientation=origin]",
    "line-texture+point-area",
    "line-area+point-bsdf",
    "exact",
    "hybrid",
];

/// A floor, and a regular polygon that is upright behind it and extends `below` it.
fn scene(corners: u32, turn: f64, below: f64, (floor, normal): (&str, &str), wall: &str) -> String {
    let mut indices = String::new();
    for i in 1..corners - 1 {
        write!(indices, "0 {i} {} ", i + 1).unwrap();
    }
    let mut positions = String::new();
    for i in 0..corners {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(corners) + turn;
        // The corners are rounded to f32 so that the polygon stays planar: y is exact.
        let (x, z) = (angle.sin(), 1.0 - below - angle.cos());
        write!(positions, "{x:.7} 2 {z:.7} ").unwrap();
    }
    format!(
        r#"
LookAt 0 -1 6  0 -1 0  0 1 0
Camera "perspective" "float fov" [ 20 ]
Film "image" "integer xresolution" [ 4 ] "integer yresolution" [ 4 ]
WorldBegin
{floor}
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
"point P" [ -9 -9 0  9 -9 0  9 9 0  -9 9 0 ] {normal}
Material "matte"
{wall}
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 10 10 10 ] "bool twosided" "true"
Shape "trianglemesh" "integer indices" [ {indices} ] "point P" [ {positions} ]
AttributeEnd
WorldEnd
"#
    )
}

const WALL: &str = r#"Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
"point P" [ -50 1 -1  50 1 -1  50 1 50  -50 1 50 ]"#;

/// Normals that lean towards the light, so that there are two horizons.
const LEANING: &str = r#""normal N" [ 0.3 0.1 1  -0.3 0.2 1  0.2 0.1 1  -0.2 0.3 1 ]"#;

#[test]
fn a_wall_hides_lights_of_any_number_of_corners() {
    let matte = r#"Material "matte" "rgb Kd" [ 0.5 0.5 0.5 ]"#;
    let glossy = microfacets(0.3);
    let floors = [
        (matte, ""),
        (matte, LEANING),
        (PHONG, LEANING),
        (&glossy, LEANING),
    ];
    for corners in [3, 4, 15, 16] {
        let step = std::f64::consts::TAU / f64::from(corners);
        // One corner is below the floor, or two are: the horizon adds one corner in the former case
        // and none in the latter. A second horizon may add another.
        for (turn, below) in [(0.0, 0.02), (0.5 * step, 0.03)] {
            for floor in floors {
                let open = load(&scene(corners, turn, below, floor, ""));
                let Light::Area(area) = &*open.lights[0].light else {
                    panic!("an area light")
                };
                assert_eq!(area.polygon.vertices().len(), corners as usize);
                let hidden = load(&scene(corners, turn, below, floor, WALL));
                let (open, hidden) = (Renderer::new(&open), Renderer::new(&hidden));
                let mut workspace = Workspace::new();
                let all = points(&hidden);
                let before: Vec<_> = all.iter().filter(|(_, p)| p.position.y < 0.9).collect();
                assert!(before.len() > 4, "{}", before.len());
                for name in SINGLE.iter().chain(&MIXES) {
                    let mut lit = 0;
                    for (pixel, point) in &before {
                        for skip in [false, true] {
                            let settings = Settings {
                                skip,
                                ..settings(name, 8, 1)
                            };
                            let mut direct = |r: &Renderer<'_>| {
                                r.direct(&settings, point, *pixel, &mut workspace)
                            };
                            assert_eq!(
                                direct(&hidden),
                                DVec3::ZERO,
                                "{name}, {corners} corners, {below} below, at {pixel:?}"
                            );
                        }
                        // Directions from the BSDF of the floor rarely meet the light.
                        let settings = settings(name, 256, 1);
                        let direct = |r: &Renderer<'_>, workspace: &mut Workspace| {
                            r.direct(&settings, point, *pixel, workspace)
                        };
                        if lit == 0 {
                            lit += usize::from(direct(&open, &mut workspace) != DVec3::ZERO);
                        }
                    }
                    assert!(lit > 0, "{name} is dark without the wall, too");
                }
            }
        }
    }
    assert_eq!(MAX_VERTICES, 16, "the most corners are among those tried");
}
