//! The footprint of a pixel after mirrors and glass, and the part of a texture that the samples of
//! a pixel see together.

use crate::common::load;
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, Workspace};
use linelit_scene::{Bounce, SceneDescription};
use proptest::prelude::*;

/// A scene in front of a camera with this many pixels; the checkerboard makes it a scene with
/// textures.
fn before_camera(pixels: u32, world: &str) -> SceneDescription {
    load(&format!(
        r#"
LookAt 0 -3 1  0 0 0  0 0 1
Camera "perspective" "float fov" [ 30 ]
Film "image" "integer xresolution" [ {pixels} ] "integer yresolution" [ {pixels} ]
WorldBegin
Texture "squares" "spectrum" "checkerboard"
Material "matte" "texture Kd" "squares"
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point P" [ 90 90 -9  91 90 -9  90 91 -9 ]
{world}
"#
    ))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: linelit_testkit::cases::cases(48), ..ProptestConfig::default() })]

    /// The rays that are given next to a reflected or refracted ray are, to first order, the
    /// reflected or refracted views of the neighbouring pixels. The error is of second order: the
    /// difference between the changes of the direction to either side, plus the squares of the
    /// changes of view and normal together. The latter may cancel in that difference. Normals turn
    /// by at most twice as much as views.
    #[test]
    fn rays_beside_the_view_are_the_neighbours(
        material in prop_oneof![Just("mirror"), Just("glass"), Just("thindielectric")],
        normals in [[-0.8..0.8, -0.8..0.8f64], [-0.8..0.8, -0.8..0.8], [-0.8..0.8, -0.8..0.8]],
        tilt in -0.5..0.5f64,
        place in [0.35..0.65, 0.35..0.65f64],
    ) {
        const PIXELS: u32 = 2000;
        // The square of the angle between two views, 30° wide over all pixels.
        let views = (2.0 * 15f64.to_radians().tan() / f64::from(PIXELS)).powi(2);
        let unit = |[x, y]: [f64; 2]| DVec3::new(x, y, 1.0).normalize();
        let normals: Vec<String> = normals
            .into_iter()
            .flat_map(|n| unit(n).to_array())
            .map(|n| n.to_string())
            .collect();
        let scene = before_camera(PIXELS, &format!(
            r#"Material "{material}"
            Shape "trianglemesh" "integer indices" [ 0 1 2 ]
                "point P" [ -4 -4 {}  4 -4 0  0 6 {tilt} ] "normal N" [ {} ]"#,
            -tilt,
            normals.join(" ")
        ));
        let renderer = Renderer::new(&scene);
        let mut workspace = Workspace::new();
        let pixel = place.map(|p| {
            #[allow(clippy::cast_possible_truncation, reason = "a pixel")]
            let pixel = (p * f64::from(PIXELS)) as u32;
            pixel
        });
        let mut seen = |x: u32, y: u32| {
            let point = renderer.shading_point([x, y], &mut workspace);
            point.map(|p| (p.position, p.bounces))
        };
        let [x, y] = pixel;
        let here = seen(x, y).expect("the surface fills the view");
        for (k, [ahead, behind]) in [[(x + 1, y), (x - 1, y)], [(x, y + 1), (x, y - 1)]]
            .into_iter()
            .enumerate()
        {
            let ahead = seen(ahead.0, ahead.1).expect("the surface fills the view");
            let behind = seen(behind.0, behind.1).expect("the surface fills the view");
            prop_assert_eq!(here.1.len(), ahead.1.len());
            for (i, bounce) in here.1.iter().enumerate() {
                let beside = bounce.beside.expect("the scene has textures");
                let direction = |bounces: &[Bounce]| bounces[i].direction;
                let (d, before, after) =
                    (direction(&here.1), direction(&behind.1), direction(&ahead.1));
                let second = (after - 2.0 * d + before).length();
                // The second order is small compared with the change of the view, so that the first
                // order means something.
                prop_assert!(second < 0.05 * views.sqrt(), "{second}");
                let error = (beside.directions[k] - after).length();
                prop_assert!(error <= 2.0 * second + 9.0 * views, "{error} {second}");
                // The origins are on the plane of the triangle, exactly but for the lift.
                let error = (beside.origins[k] - ahead.0).length();
                prop_assert!(error < 1e-4, "{error}");
                prop_assert!(error < 0.1 * (ahead.0 - here.0).length(), "{error}");
            }
        }
    }
}

/// A floor of tiles with joints and relief, seen across a room, under a light without occluders.
fn tiled_floor(tiles: u32, relief: f64) -> SceneDescription {
    before_camera(
        24,
        &format!(
            r#"
AttributeBegin
    AreaLightSource "diffuse" "rgb L" [ 10 10 10 ]
    Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -1 2 3  -1 4 3  1 4 3  1 2 3 ]
AttributeEnd
Texture "tiles" "spectrum" "checkerboard" "rgb tex1" [ .8 .8 .8 ] "rgb tex2" [ .1 .1 .1 ]
    "float uscale" {tiles} "float vscale" {tiles}
Texture "relief" "float" "checkerboard" "float tex1" 0 "float tex2" {relief}
    "float uscale" {tiles} "float vscale" {tiles}
Material "matte" "texture Kd" "tiles" "texture bumpmap" "relief"
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -9 -5 0  9 -5 0  9 30 0  -9 30 0 ]
    "float uv" [ 0 0  1 0  1 1  0 1 ]"#
        ),
    )
}

/// The pixels of a row, with this many samples in each.
fn row(scene: &SceneDescription, y: u32, pixel_samples: u32) -> Vec<f64> {
    let renderer = Renderer::new(scene);
    let settings = Settings {
        estimator: "exact".parse().expect("an estimator"),
        pixel_samples,
        ..Settings::default()
    };
    let mut workspace = Workspace::new();
    let pixel = |x| renderer.pixel(&settings, [x, y], &mut workspace).x;
    (0..24).map(pixel).collect()
}

/// Far away, where a pixel contains many tiles, one sample shows the same as a thousand samples.
#[test]
fn a_distant_floor_is_its_mean() {
    let scene = tiled_floor(600, 0.0);
    // Row 5 meets the floor 5.6 m away: a pixel is .12 m wide and .7 m long, and tiles are .03 m by
    // .06 m. The rectangle of the one sample contains 8 by 24 tiles. The mean of a wave over it is
    // at most 1/8 and 1/24 of the wave, so that the tiles' .45 ± .35 are met to .4 %.
    let rectangle = 0.35 / 0.45 / (8.0 * 24.0);
    let (one, many) = (row(&scene, 5, 1), row(&scene, 5, 1024));
    // Four times the deviation of 1024 samples of such tiles.
    let scatter = 4.0 * 0.35 / 0.45 / 1024f64.sqrt();
    for (x, (one, many)) in one.iter().zip(&many).enumerate() {
        let error = (one / many - 1.0).abs();
        assert!(error < scatter + rectangle, "{x}: {one} {many}");
    }
    let [one, many] = [one, many].map(|row| row.iter().sum::<f64>());
    let error = (one / many - 1.0).abs();
    assert!(error < scatter / 24f64.sqrt() + rectangle, "{one} {many}");
}

/// With relief, means over more and more samples converge: each sample's footprint shrinks, and
/// shows the relief itself in the end.
#[test]
fn a_relief_seen_from_afar_converges() {
    let scene = tiled_floor(60, 0.02);
    let sum = |samples: u32| row(&scene, 7, samples).iter().sum::<f64>();
    let [few, more, most] = [16, 144, 4096].map(sum);
    let (before, after) = ((few / most - 1.0).abs(), (more / most - 1.0).abs());
    assert!(
        after < 0.02 && after < before.max(0.005),
        "{few} {more} {most}"
    );
}
