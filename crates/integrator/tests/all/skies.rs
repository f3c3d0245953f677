//! Skies in pictures: behind what cameras and mirrors see, and hidden with the lights.

use crate::common::load;
use linelit_geometry::DVec3;
use linelit_integrator::{Estimator, Renderer, Settings, Workspace};
use linelit_scene::Scene;

fn scene(world: &str) -> Scene {
    let view = "LookAt 0 0 0  0 0 1  0 1 0 Camera \"perspective\" \"float fov\" 40\n\
        Film \"image\" \"integer xresolution\" 3 \"integer yresolution\" 3\nWorldBegin\n";
    load(&format!("{view}{world}"))
}

/// The radiance of the picture's middle.
fn middle(scene: &Scene, change: impl Fn(&mut Settings)) -> DVec3 {
    let mut settings = Settings::default();
    change(&mut settings);
    Renderer::new(scene).pixel(&settings, [1, 1], &mut Workspace::new())
}

const SKY: &str = "LightSource \"infinite\" \"rgb L\" [ 1 2 3 ]\n";
const SUN: &str = "LightSource \"distant\" \"point3 from\" [ 0 0 -1 ] \"point3 to\" [ 0 0 0 ] \"rgb L\" [ 2 2 2 ]\n";

#[test]
fn cameras_see_the_sky_unless_lights_are_hidden() {
    let alone = scene(SKY);
    assert_eq!(middle(&alone, |_| {}), DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(middle(&alone, |s| s.show_lights = false), DVec3::ZERO);
    // Two skies add up, and parallel light is not seen.
    let two = scene(&format!(
        "{SKY}{SUN}LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n"
    ));
    assert_eq!(middle(&two, |_| {}), DVec3::new(2.0, 3.0, 4.0));
    // Beside a portal a sky is black; through it, it shines.
    for (shift, want) in [(0.0, DVec3::ONE), (5.0, DVec3::ZERO)] {
        let through = scene(&format!(
            "Translate {shift} 0 0 LightSource \"infinite\" \"point3 portal\" \
             [ -1 -1 3 -1 1 3 1 1 3 1 -1 3 ]\n"
        ));
        assert_eq!(middle(&through, |_| {}), want, "{shift}");
    }
}

/// A mirror straight ahead shows the sky behind the camera; a wall is lit by albedo times radiance,
/// and by parallel light from behind the camera as E albedo/π.
#[test]
fn mirrors_show_the_sky_and_walls_are_lit() {
    let wall =
        "Shape \"quad\" \"point o\" [ -9 -9 2 ] \"vector u\" [ 18 0 0 ] \"vector v\" [ 0 18 0 ]\n";
    let mirror = scene(&format!(
        "{SKY}Material \"mirror\" \"rgb Kr\" [ .5 .5 .5 ]\n{wall}"
    ));
    let shown = middle(&mirror, |s| s.bounces = 1);
    assert!(shown.distance(DVec3::new(0.5, 1.0, 1.5)) < 1e-12, "{shown}");
    assert_eq!(middle(&mirror, |s| s.bounces = 0), DVec3::ZERO);
    let matte = "Material \"matte\" \"rgb Kd\" [ .5 .5 .5 ]\n";
    let wall_lit = scene(&format!("{SKY}{matte}{wall}"));
    let lit = middle(&wall_lit, |s| s.estimator = Estimator::hybrid());
    // Drawn by the cosine, without noise.
    assert!(lit.distance(DVec3::new(0.5, 1.0, 1.5)) < 1e-12, "{lit}");
    let sunny = middle(&scene(&format!("{SUN}{matte}{wall}")), |_| {});
    let want = DVec3::splat(2.0 * 0.5 * std::f64::consts::FRAC_1_PI);
    assert!(sunny.distance(want) < 1e-12, "{sunny}");
}
