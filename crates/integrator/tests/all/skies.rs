//! Skies in pictures: seen by cameras and in mirrors, and hidden together with the lights.

use crate::common::load;
use linelit_geometry::{DMat3, DVec3};
use linelit_integrator::{Estimator, LightChoice, Renderer, Settings, Window, Workspace};
use linelit_lights::{Light, Sky, SkyEmission, SkyImage, SkyMapping};
use linelit_scene::SceneDescription;
use linelit_testkit::ztest::critical_z;
use std::sync::Arc;

fn scene(world: &str) -> SceneDescription {
    let view = "LookAt 0 0 0  0 0 1  0 1 0 Camera \"perspective\" \"float fov\" 40\n\
        Film \"image\" \"integer xresolution\" 3 \"integer yresolution\" 3\nWorldBegin\n";
    load(&format!("{view}{world}"))
}

/// The radiance of the middle of the picture.
fn middle(scene: &SceneDescription, change: impl Fn(&mut Settings)) -> DVec3 {
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
    // Outside a portal a sky is black, and through it, it shines. Portals are in world space.
    for (low, high, want) in [(-1, 1, DVec3::ONE), (4, 6, DVec3::ZERO)] {
        let through = scene(&format!(
            "Translate 5 0 0 LightSource \"infinite\" \"point3 portal\" \
             [ {low} -1 3 {low} 1 3 {high} 1 3 {high} -1 3 ]\n"
        ));
        assert_eq!(middle(&through, |_| {}), want, "{low}");
    }
}

/// A mirror straight ahead shows the sky behind the camera. Such a sky lights a wall by albedo
/// times radiance, and parallel light from behind the camera lights it by E albedo/π.
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
    // It is sampled by the cosine, without noise.
    assert!(lit.distance(DVec3::new(0.5, 1.0, 1.5)) < 1e-12, "{lit}");
    let sunny = middle(&scene(&format!("{SUN}{matte}{wall}")), |_| {});
    let want = DVec3::splat(2.0 * 0.5 * std::f64::consts::FRAC_1_PI);
    assert!(sunny.distance(want) < 1e-12, "{sunny}");
}

/// Settings below or above their bounds count as these bounds: there is no panic, and neither
/// memory nor stack runs out. Between two mirrors, views would never end.
#[test]
fn settings_out_of_bounds_count_as_their_bounds() {
    let quad = |z: i32| {
        format!(
            "Shape \"quad\" \"point o\" [ -9 -9 {z} ] \"vector u\" [ 18 0 0 ] \"vector v\" [ 0 18 0 ]\n"
        )
    };
    let mirror = "Material \"mirror\" \"rgb Kr\" [ 1 1 1 ]\n";
    let lamp = "AttributeBegin AreaLightSource \"diffuse\" Translate 3 3 0 Shape \"sphere\" \
                \"float radius\" .25 AttributeEnd\n";
    let hall = scene(&format!("{lamp}{mirror}{}{}", quad(2), quad(-2)));
    let most = Settings::MOST_BOUNCES;
    assert_eq!(
        middle(&hall, |s| s.bounces = u32::MAX),
        middle(&hall, |s| s.bounces = most)
    );
    let wall = scene(&format!("{lamp}{}", quad(2)));
    let lit = middle(&wall, |s| s.samples = 1);
    assert!(lit.max_element() > 0.0, "{lit}");
    assert_eq!(middle(&wall, |s| s.samples = 0), lit);
    assert_eq!(
        middle(&wall, |s| (s.samples, s.pixel_samples) = (0, 0)),
        lit
    );
    // In closed form, the largest number of samples needs no memory.
    let square = "AttributeBegin AreaLightSource \"diffuse\" Translate -1 -1 0 Shape \"quad\" \
                  \"point o\" [ 0 0 -1 ] \"vector u\" [ 1 0 0 ] \"vector v\" [ 0 1 0 ] AttributeEnd\n";
    let open = scene(&format!("{square}{}", quad(2)));
    let by = |samples| {
        middle(&open, |s| {
            (s.samples, s.estimator) = (samples, Estimator::hybrid())
        })
    };
    assert_eq!(by(u32::MAX), by(16));
}

/// All bits of a picture of 8 × 8 pixels, by this many threads.
fn bits(scene: &SceneDescription, settings: &Settings, threads: usize) -> Vec<[u32; 3]> {
    let window = Window {
        columns: 0..8,
        rows: 0..8,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let renderer = Renderer::new(scene);
    let draw = || renderer.picture(settings, &window, || ()).0;
    let pixels = pool.expect("threads").install(draw);
    pixels.iter().map(|v| v.map(f32::to_bits)).collect()
}

/// The light of the scene's first light, which is a sun of half a radian.
fn sunlit(scene: &mut SceneDescription) {
    let Light::Sky(sky) = &*scene.lights[0].light else {
        panic!("a sky");
    };
    let emission = SkyEmission::Sun {
        direction: DVec3::NEG_Z,
        half_angle: 0.5,
        radiance: DVec3::new(1.0, 2.0, 3.0),
    };
    let sun = Sky {
        emission,
        ..sky.clone()
    };
    scene.lights[0].light = Arc::new(Light::Sky(sun));
}

#[test]
fn pictures_do_not_depend_on_threads() {
    let spot = "LightSource \"spot\" \"point3 from\" [ 1 1 0 ] \"point3 to\" [ 0 0 2 ]\n";
    let balls = "Shape \"sphere\" \"float radius\" .5 Translate 0 0 2\n\
        Shape \"quad\" \"point o\" [ -9 -9 1 ] \"vector u\" [ 18 0 0 ] \"vector v\" [ 0 18 0 ]\n";
    let mut scene = scene(&format!("{SKY}{SKY}{SUN}{spot}Translate 0 0 1.5\n{balls}"));
    sunlit(&mut scene);
    let Light::Sky(sky) = &*scene.lights[1].light else {
        panic!("a sky");
    };
    let pixels = (0..128_u8).map(|k| [f32::from(k % 7), 1.0, 2.0]).collect();
    let size = [16, 8];
    let mapping = SkyMapping::Equirectangular;
    let image = SkyImage::new(mapping, size, pixels, DMat3::IDENTITY, DVec3::ONE);
    let image = Sky {
        emission: SkyEmission::Image(Arc::new(image.expect("good pixels"))),
        ..sky.clone()
    };
    scene.lights[1].light = Arc::new(Light::Sky(image));
    for lights in [
        LightChoice::All,
        LightChoice::Tree,
        LightChoice::Estimate,
        LightChoice::Exact,
    ] {
        let settings = Settings {
            lights,
            pixel_samples: 2,
            ..Settings::default()
        };
        let one = bits(&scene, &settings, 1);
        assert!(one.iter().flatten().any(|v| *v > 0), "{lights:?}");
        assert_eq!(one, bits(&scene, &settings, 2), "{lights:?}");
        assert_eq!(one, bits(&scene, &settings, 7), "{lights:?}");
    }
}

/// In a scene with only a sky, all pixels show the sky. A triangle that faces a sun has its
/// irradiance, π L sin² 0.5.
#[test]
fn a_sky_alone_and_a_triangle_in_the_sun() {
    let settings = Settings::default();
    let alone = bits(&scene(SKY), &settings, 1);
    assert!(
        alone
            .iter()
            .all(|v| *v == [1.0_f32, 2.0, 3.0].map(f32::to_bits))
    );
    let triangle = "Material \"matte\" \"rgb Kd\" [ .5 .5 .5 ]\n\
        Shape \"trianglemesh\" \"point P\" [ -9 -9 2 9 -9 2 0 9 2 ] \"integer indices\" [ 0 1 2 ]\n";
    let mut lit = scene(&format!("{SKY}{triangle}"));
    sunlit(&mut lit);
    let samples = 256;
    let got = middle(&lit, |s| s.samples = samples);
    let want = DVec3::new(1.0, 2.0, 3.0) * (0.5 * 0.5_f64.sin().powi(2));
    // Cosines within the sun are in [0.877, 1], so that their relative deviation is below 0.062.
    let bound = critical_z(1e-4) * 0.062 / 0.877 / f64::from(samples).sqrt();
    assert!(
        (got / want - DVec3::ONE).abs().max_element() < bound,
        "{got} {want}"
    );
}
