//! The reflections that materials of scene files have at a shading point.

use linelit_bsdf::{Bsdf, Fresnel, Lobe, Reflection};
use linelit_formats::LoadOptions;
use linelit_geometry::{DVec3, Frame};
use linelit_integrator::{Renderer, ShadingPoint, Workspace};
use linelit_testkit::rng::SplitMix64;

/// The shading point in the middle of a floor of a material, seen from 45° along −x.
fn floor(materials: &str) -> ShadingPoint {
    let text = format!(
        r#"
        LookAt -2 0 2  0 0 0  0 0 1
        Camera "perspective" "float fov" [ 20 ]
        Film "image" "integer xresolution" [ 3 ] "integer yresolution" [ 3 ]
        WorldBegin
        AttributeBegin
            AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
            Shape "quad" "point o" [ 0 0 5 ] "vector u" [ 0 1 0 ] "vector v" [ 1 0 0 ]
        AttributeEnd
        {materials}
        Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
            "point3 P" [ -5 -5 0  5 -5 0  5 5 0  -5 5 0 ]
        "#
    );
    let options = LoadOptions::default();
    let scene = linelit_formats::from_pbrt_str(&text, "floor.pbrt", &options)
        .unwrap()
        .scene;
    let mut workspace = Workspace::new();
    Renderer::new(&scene)
        .shading_point([1, 1], &mut workspace)
        .unwrap()
}

fn albedo(point: &ShadingPoint) -> DVec3 {
    match &point.bsdf {
        Bsdf::Lambert(lambert) => lambert.albedo,
        other => panic!("not diffuse: {other:?}"),
    }
}

#[test]
fn diffuse_parts_of_a_mixture_add_up_to_lambert() {
    let point = floor(
        r#"
        MakeNamedMaterial "a" "string type" "matte" "rgb Kd" [ 1 0 0 ]
        MakeNamedMaterial "b" "string type" "plastic" "rgb Kd" [ 0 0 1 ] "rgb Ks" [ 0 0 0 ]
        Material "mix" "string namedmaterial1" "a" "string namedmaterial2" "b" "rgb amount" [ .25 .25 .25 ]
        "#,
    );
    assert!((albedo(&point) - DVec3::new(0.25, 0.0, 0.75)).length() < 1e-15);
    assert!(point.bounces.is_empty());
}

#[test]
fn mirrors_send_the_view_on_and_reflect_no_light() {
    let point = floor(r#"Material "mirror" "rgb Kr" [ .5 .5 .5 ]"#);
    assert!(point.bsdf.is_black());
    let [bounce] = point.bounces[..] else {
        panic!("one bounce: {:?}", point.bounces)
    };
    let want = DVec3::new(1.0, 0.0, 1.0).normalize();
    assert!((bounce.direction - want).length() < 1e-7, "{bounce:?}");
    assert_eq!(bounce.weight, DVec3::splat(0.5));
}

/// Snell's law from outside: sin t = sin 45°/1.5. Radiance falls by η².
#[test]
fn glass_reflects_and_refracts() {
    let point = floor(r#"Material "glass" "float index" 1.5"#);
    let [mirrored, refracted] = point.bounces[..] else {
        panic!("two bounces: {:?}", point.bounces)
    };
    let reflectance = Fresnel::Dielectric { eta: 1.5 }.at(0.5f64.sqrt()).x;
    // The camera's ray is at 45° but for the f32 numbers of its transform.
    assert!((mirrored.weight.x - reflectance).abs() < 1e-7);
    assert!((refracted.direction.x - 0.5f64.sqrt() / 1.5).abs() < 1e-7);
    assert!(refracted.direction.z < 0.0);
    let energy = refracted.weight.x * 2.25 + mirrored.weight.x;
    assert!((energy - 1.0).abs() < 1e-12);
}

#[test]
fn opacity_lets_the_view_straight_through() {
    let point = floor(
        r#"Material "uber" "rgb Kd" [ .8 .8 .8 ] "rgb Ks" [ 0 0 0 ] "rgb opacity" [ .25 .25 .25 ]"#,
    );
    assert!((albedo(&point) - DVec3::splat(0.2)).length() < 1e-15);
    let [through] = point.bounces[..] else {
        panic!("one bounce: {:?}", point.bounces)
    };
    assert!((through.direction + point.outgoing).length() < 1e-15);
    assert_eq!(through.weight, DVec3::splat(0.75));
}

#[test]
fn roughness_is_remapped_and_follows_the_tangents() {
    let facets = |text: &str| match &floor(text).bsdf {
        Bsdf::Layers(layers) => match layers.lobes().next() {
            Some((_, Lobe::Reflector(lobe))) => lobe.facets.alpha(),
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    };
    let plain = facets(
        r#"Material "metal" "bool remaproughness" "false" "float uroughness" .1 "float vroughness" .4"#,
    );
    assert_eq!(plain.map(f64::to_bits), [0.1f64, 0.4].map(f64::to_bits));
    let remapped = facets(r#"Material "metal" "float roughness" .1"#);
    // This is pbrt-v3's polynomial at ln 0.1, by hand.
    assert!((remapped[0] - 0.461_760_032).abs() < 1e-9, "{remapped:?}");
}

/// Materials that are as white as possible, with the largest fraction that each reflects of light
/// from all around: the sum of its colours, or the bound that the model's documentation gives.
const WHITE: [(&str, f64); 10] = [
    (r#"Material "matte" "rgb Kd" [ 1 1 1 ]"#, 1.0),
    (
        r#"Material "matte" "rgb Kd" [ 1 1 1 ] "float sigma" 11.4"#,
        1.0152,
    ),
    (
        r#"Material "phong" "rgb Kd" [ .5 .5 .5 ] "rgb Ks" [ .5 .5 .5 ] "float exponent" 7"#,
        1.0,
    ),
    (
        r#"Material "plastic" "rgb Kd" [ .5 .5 .5 ] "rgb Ks" [ .5 .5 .5 ] "float roughness" .2"#,
        1.0,
    ),
    (
        r#"Material "metal" "float uroughness" .1 "float vroughness" .4"#,
        1.0,
    ),
    (
        r#"Material "substrate" "rgb Kd" [ 1 1 1 ] "rgb Ks" [ .04 .04 .04 ] "float roughness" .3"#,
        1.0,
    ),
    (
        r#"Material "uber" "rgb Kd" [ .5 .5 .5 ] "rgb Ks" [ .5 .5 .5 ] "float roughness" .3"#,
        1.0,
    ),
    (
        r#"Material "glass" "float uroughness" .3 "float vroughness" .3"#,
        1.0,
    ),
    (
        r#"Material "frostbite" "rgb Kd" [ 1 1 1 ] "rgb Ks" [ .04 .04 .04 ] "float roughness" 1"#,
        1.13,
    ),
    (
        r#"
        MakeNamedMaterial "base" "string type" "substrate" "rgb Kd" [ 1 1 1 ] "rgb Ks" [ .04 .04 .04 ]
            "float uroughness" .3 "float vroughness" .3 "bool remaproughness" "false"
        MakeNamedMaterial "metal" "string type" "metal" "rgb k" [ 9 9 9 ] "rgb eta" [ .1 .1 .1 ]
            "float roughness" .3 "bool remaproughness" "false"
        Material "mix" "string namedmaterial1" "base" "string namedmaterial2" "metal" "rgb amount" [ .5 .5 .5 ]
        "#,
        1.0,
    ),
];

/// The materials of scene files pass a white furnace test, and are reciprocal.
#[test]
fn materials_keep_energy_and_are_reciprocal() {
    for (text, most) in WHITE {
        let point = floor(text);
        let (bsdf, n) = (&point.bsdf, point.normal);
        let mut random = SplitMix64::new(3);
        let frame = Frame::from_normal(n);
        let mut up = |least: f64| {
            let z = least + (1.0 - least) * random.next_f64();
            let (s, c) = (std::f64::consts::TAU * random.next_f64()).sin_cos();
            let sine = ((1.0 - z) * (1.0 + z)).sqrt();
            frame.to_world(DVec3::new(sine * c, sine * s, z))
        };
        for _ in 0..500 {
            let (wi, wo) = (up(1e-3), up(1e-3));
            let (ab, ba) = (bsdf.eval(wi, wo, n), bsdf.eval(wo, wi, n));
            // Cosines have errors of 4 ε, and cosines of 1e-3 have 1e3 times that.
            assert!((ab - ba).abs().cmple(ab * 1e-11).all(), "{text}: {ab} {ba}");
        }
        for _ in 0..16 {
            let wo = up(0.01);
            let side = 64;
            let mut albedo = DVec3::ZERO;
            for i in 0..side * side {
                let u = [i / side, i % side].map(|k| (f64::from(k) + 0.5) / f64::from(side));
                if let Some(w) = bsdf.sample(u, wo, n).filter(|w| w.dot(n) > 0.0) {
                    albedo += bsdf.eval(w, wo, n) * (w.dot(n) / bsdf.pdf(w, wo, n));
                }
            }
            albedo /= f64::from(side * side);
            // 4096 strata of a bounded weight; it has to be more than zero.
            assert!(albedo.max_element() < most + 0.01, "{text}: {albedo}");
            assert!(albedo.min_element() > 0.01, "{text}: {albedo}");
        }
    }
}
