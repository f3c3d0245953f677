//! Every estimator gives the same light on every material.

use crate::common::{CLUTTER, SQUARE, load, points, room_text, settings, trials};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, ShadingPoint};
use linelit_testkit::{chi2::sidak, ztest::critical_z};

const TRIALS: u32 = 32;

const MATERIALS: [&str; 9] = [
    r#"Material "matte" "rgb Kd" [ .5 .4 .3 ] "float sigma" 30"#,
    r#"Material "plastic" "rgb Kd" [ .3 .3 .3 ] "rgb Ks" [ .9 .6 .3 ] "float roughness" .3 "bool remaproughness" "false""#,
    r#"Material "plastic" "rgb Kd" [ .3 .3 .3 ] "rgb Ks" [ .9 .6 .3 ] "float roughness" .02 "bool remaproughness" "false""#,
    r#"Material "metal" "float uroughness" .15 "float vroughness" .5 "bool remaproughness" "false""#,
    r#"Material "metal" "float uroughness" .01 "float vroughness" .2 "bool remaproughness" "false""#,
    r#"Material "substrate" "rgb Kd" [ .5 .1 .2 ] "rgb Ks" [ .1 .1 .1 ] "float roughness" .2 "bool remaproughness" "false""#,
    r#"Material "substrate" "rgb Kd" [ .5 .1 .2 ] "rgb Ks" [ .04 .04 .04 ] "float roughness" .001 "bool remaproughness" "false""#,
    r#"Material "uber" "rgb Kd" [ .2 .2 .2 ] "rgb Ks" [ .5 .5 .5 ] "rgb opacity" [ .5 .7 .9 ] "float roughness" .1"#,
    r#"MakeNamedMaterial "a" "string type" "phong" "rgb Kd" [ .2 .1 .3 ] "rgb Ks" [ .5 .6 .7 ] "float exponent" 40.5
       MakeNamedMaterial "b" "string type" "metal" "float roughness" .1
       Material "mix" "string namedmaterial1" "a" "string namedmaterial2" "b""#,
];

/// The estimators: their name, their number of samples, and whether they can sample a lobe that is
/// as narrow as a mirror's.
const ESTIMATORS: [(&str, u32, bool); 9] = [
    ("line-solid-angle+point-bsdf", 32, true),
    (
        "line-solid-angle[orientation=fixed:0]+line-area[orientation=fixed:0.5]+point-bsdf[mis=smooth]",
        48,
        true,
    ),
    ("point-bsdf", 2048, true),
    ("point-area", 256, false),
    ("line-area", 16, false),
    ("line-analytic", 8, false),
    ("exact", 8, false),
    ("exact+point-bsdf", 16, true),
    ("hybrid+point-bsdf[mis=optimal]", 16, true),
];

/// A z test over pixels, channels, estimators and materials at α = 0.01.
#[test]
fn estimators_agree_on_every_material() {
    let floor = r#"Material "matte" "rgb Kd" [ 0.7 0.5 0.3 ]"#;
    for material in MATERIALS {
        let scene = load(&room_text(SQUARE, CLUTTER).replacen(floor, material, 1));
        let renderer = Renderer::new(&scene);
        let all: Vec<_> = points(&renderer)
            .into_iter()
            .filter(|([x, y], point)| (x + 3 * y) % 11 == 0 && point.position.z < 1.9)
            .collect();
        let narrow =
            material.contains(".02 ") || material.contains(".01 ") || material.contains(".001");
        let used = ESTIMATORS.iter().filter(|e| e.2 || !narrow);
        let z = critical_z(sidak(
            0.01,
            all.len() * 3 * ESTIMATORS.len() * MATERIALS.len(),
        ));
        let base = settings("point-solid-angle+point-bsdf", 512, 5_000_000);
        let truth: Vec<_> = all
            .iter()
            .map(|p| trials(&renderer, &base, p, TRIALS))
            .collect();
        let brightest = truth.iter().map(|r| r.0.x).fold(0.0, f64::max);
        assert!(brightest > 0.01, "{material}: {brightest}");
        for (k, (name, samples, _)) in used.enumerate() {
            let settings = settings(name, *samples, 10_000 * (k as u64 + 1));
            for (point, want) in all.iter().zip(&truth) {
                // Sums of rare hits are not normally distributed, so that only pixels count that
                // are not dim.
                if *name == "point-bsdf" && want.0.x < 0.1 * brightest {
                    continue;
                }
                let got = trials(&renderer, &settings, point, TRIALS);
                agree((material, name), point, got, *want, z);
            }
        }
    }
}

fn agree(
    what: (&str, &str),
    point: &([u32; 2], ShadingPoint),
    got: (DVec3, DVec3),
    want: (DVec3, DVec3),
    z: f64,
) {
    for c in 0..3 {
        let error = got.1[c].hypot(want.1[c]);
        // Constant values have sums of a few hundred terms, which differ by rounding.
        let allowed = z * error + 1e-12 * (1.0 + want.0[c]);
        assert!(
            (got.0[c] - want.0[c]).abs() <= allowed,
            "{what:?} at {:?}: {} +- {}, wanted {} +- {}",
            point.0,
            got.0[c],
            got.1[c],
            want.0[c],
            want.1[c]
        );
    }
}
