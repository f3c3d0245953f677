//! Small scenes and statistics that the tests share.

use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, ShadingPoint, Workspace};
use linelit_scene::{LoadOptions, Scene};

/// A floor seen from above, a square light over it, and whatever `occluders` says.
pub(crate) fn room(light: &str, occluders: &str) -> Scene {
    load(&room_text(light, occluders))
}

/// The text of that scene.
pub(crate) fn room_text(light: &str, occluders: &str) -> String {
    format!(
        r#"
LookAt 0 -0.5 5  0 0 0  0 1 0
Camera "perspective" "float fov" [ 40 ]
Film "image" "integer xresolution" [ 16 ] "integer yresolution" [ 16 ]
WorldBegin
Material "matte" "rgb Kd" [ 0.7 0.5 0.3 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -3 -3 0  3 -3 0  3 3 0  -3 3 0 ]
{occluders}
AttributeBegin
Material "matte" "rgb Kd" [ 0 0 0 ]
AreaLightSource "diffuse" "rgb L" [ 8 6 4 ]
{light}
AttributeEnd
WorldEnd
"#
    )
}

/// A scene from pbrt text.
pub(crate) fn load(text: &str) -> Scene {
    Scene::from_pbrt_str(text, "test.pbrt", &LoadOptions::default())
        .expect("the test scene is valid")
        .scene
}

/// A square light of side 1 above the floor, facing down.
pub(crate) const SQUARE: &str = r#"Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
"point P" [ -0.5 -0.5 2  -0.5 0.5 2  0.5 0.5 2  0.5 -0.5 2 ]"#;

/// A triangular light, tilted.
pub(crate) const TRIANGLE: &str = r#"Shape "trianglemesh" "integer indices" [ 0 1 2 ]
"point P" [ -0.8 -0.5 2  0.1 0.9 1.6  0.7 -0.4 2.2 ]"#;

/// Occluders of several kinds: a tilted triangle, a slat, and one that touches the floor.
pub(crate) const CLUTTER: &str = r#"
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point P" [ -0.6 -0.3 0.9  0.5 -0.2 1.1  0.1 0.6 0.8 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -1 0.2 1.3  1 0.25 1.3  1 0.35 1.3  -1 0.3 1.3 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point P" [ 0.8 0.3 0  1.0 0.9 0  0.9 0.6 1.2 ]
"#;

/// The shading points of all pixels.
pub(crate) fn points(renderer: &Renderer<'_>) -> Vec<([u32; 2], ShadingPoint)> {
    let mut workspace = Workspace::new();
    let film = &renderer.scene().film;
    let pixels = (0..film.height).flat_map(|y| (0..film.width).map(move |x| [x, y]));
    pixels
        .filter_map(|p| renderer.shading_point(p, &mut workspace).map(|s| (p, s)))
        .collect()
}

/// Mean and its standard error over independent trials, by channel.
pub(crate) fn trials(
    renderer: &Renderer<'_>,
    settings: &Settings,
    (pixel, point): &([u32; 2], ShadingPoint),
    count: u32,
) -> (DVec3, DVec3) {
    let mut workspace = Workspace::new();
    let estimate = |trial: u32| {
        let settings = Settings {
            seed: settings.seed + u64::from(trial),
            ..*settings
        };
        renderer.direct(&settings, point, *pixel, 0, &mut workspace)
    };
    let values: Vec<DVec3> = (0..count).map(estimate).collect();
    let n = f64::from(count);
    let mean = values.iter().copied().sum::<DVec3>() / n;
    let square: DVec3 = values.iter().map(|v| (*v - mean) * (*v - mean)).sum();
    (mean, (square / (n * (n - 1.0))).map(f64::sqrt))
}
