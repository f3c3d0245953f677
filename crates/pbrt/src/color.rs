//! The conversion of spectra to linear RGB: sampled spectra, black bodies and named metals.
//!
//! The renderer works in linear RGB with the Rec. 709 primaries. Spectra in scene files are
//! converted by the matching functions of the CIE 1931 observer. These are approximated by the
//! multi-lobe fit of Wyman, Sloan and Shirley, "Simple Analytic Approximations to the CIE XYZ Color
//! Matching Functions" (JCGT 2013), eq. 4, which is good to about 1 % of the peak.

use linelit_elementary::{exp, exp_m1};
use linelit_geometry::{DMat3, DVec3};
#[cfg(test)]
use linelit_scene::LUMINANCE;

/// Converts CIE XYZ to linear RGB (Rec. 709 primaries, D65 white).
pub(crate) fn xyz_to_rgb(xyz: DVec3) -> DVec3 {
    let m = DMat3::from_cols(
        DVec3::new(3.240_479, -0.969_256, 0.055_648),
        DVec3::new(-1.537_150, 1.875_991, -0.204_043),
        DVec3::new(-0.498_535, 0.041_556, 1.057_311),
    );
    m * xyz
}

/// Returns the CIE 1931 colour matching functions x̄, ȳ and z̄ at a wavelength in nanometres, by
/// the fit of Wyman, Sloan and Shirley (2013).
fn matching(nm: f64) -> DVec3 {
    let lobe = |centre: f64, below: f64, above: f64| {
        let t = (nm - centre) * if nm < centre { below } else { above };
        exp(-0.5 * t * t)
    };
    DVec3::new(
        0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323)
            - 0.065 * lobe(501.1, 0.0490, 0.0382),
        0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322),
        1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725),
    )
}

/// Returns the XYZ of a spectrum, scaled so that the equal-energy spectrum has Y = 1, like pbrt's
/// `Spectrum::ToXYZ`.
fn spectrum_to_xyz(value: impl Fn(f64) -> f64) -> DVec3 {
    let (mut sum, mut white) = (DVec3::ZERO, 0.0);
    for nm in 360..=830 {
        let nm = f64::from(nm);
        let weights = matching(nm);
        sum += weights * value(nm);
        white += weights.y;
    }
    sum / white
}

/// Returns the linear RGB of a spectrum that is given by samples `(wavelength in nm, value)` in
/// ascending order; it is linear between samples and constant beyond the first and the last.
pub(crate) fn sampled_to_rgb(samples: &[(f64, f64)]) -> DVec3 {
    let value = |nm: f64| {
        let k = samples.partition_point(|s| s.0 <= nm);
        match (
            k.checked_sub(1).and_then(|i| samples.get(i)),
            samples.get(k),
        ) {
            (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (nm - a.0) / (b.0 - a.0),
            (Some(a), None) => a.1,
            (None, Some(b)) => b.1,
            (None, None) => 0.0,
        }
    };
    xyz_to_rgb(spectrum_to_xyz(value)).max(DVec3::ZERO)
}

/// Returns the linear RGB of a black body at a temperature in kelvin.
///
/// With `unit_luminance` the colour is scaled to luminance one, as light sources of pbrt-v4 are;
/// otherwise the spectrum has a peak of one, as in pbrt-v3.
pub(crate) fn blackbody_to_rgb(kelvin: f64, unit_luminance: bool) -> DVec3 {
    // Evaluate Planck's law up to a factor that cancels in the scaling.
    let planck = |nm: f64| {
        let x = 1.438_776_877e7 / (nm * kelvin);
        (nm / 1000.0).powi(-5) / exp_m1(x)
    };
    // Divide by the peak, which is at the wavelength 2.8978 mm·K over the temperature (Wien).
    let peak = planck(2.897_771_955e6 / kelvin);
    let xyz = spectrum_to_xyz(|nm| planck(nm) / peak);
    let scale = if unit_luminance { 1.0 / xyz.y } else { 1.0 };
    let rgb = (xyz_to_rgb(xyz) * scale).max(DVec3::ZERO);
    if rgb.is_finite() { rgb } else { DVec3::ZERO }
}

/// Returns the complex index of refraction (η, k), in linear RGB, of a metal that pbrt-v4 knows by
/// name; `None` for other names.
pub(crate) fn named_metal(name: &str) -> Option<(DVec3, DVec3)> {
    let (eta, k) = match name {
        "metal-Cu" => (
            [0.200_44, 0.924_03, 1.102_21],
            [3.912_95, 2.452_85, 2.142_19],
        ),
        "metal-Au" => (
            [0.143_12, 0.374_96, 1.442_48],
            [3.983_16, 2.385_72, 1.603_22],
        ),
        "metal-Ag" => (
            [0.155_26, 0.116_72, 0.138_38],
            [4.828_34, 3.122_25, 2.147_05],
        ),
        "metal-Al" => (
            [1.657_46, 0.880_37, 0.521_23],
            [9.223_87, 6.269_52, 4.837_00],
        ),
        "metal-CuZn" => ([0.444, 0.527, 1.094], [3.695, 2.765, 1.829]),
        _ => return None,
    };
    Some((DVec3::from_array(eta), DVec3::from_array(k)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_energy_is_white_of_luminance_one() {
        let rgb = sampled_to_rgb(&[(400.0, 1.0), (700.0, 1.0)]);
        // XYZ of equal energy is (1, 1, 1); the fit is good to 1 %.
        let want = xyz_to_rgb(DVec3::ONE);
        assert!((rgb - want).abs().max_element() < 0.02, "{rgb} {want}");
        assert!((LUMINANCE.dot(rgb) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn black_bodies_go_from_red_to_blue() {
        let warm = blackbody_to_rgb(2700.0, true);
        let day = blackbody_to_rgb(6500.0, true);
        let sky = blackbody_to_rgb(12000.0, true);
        assert!(warm.x > 2.0 * warm.z && sky.z > sky.x);
        // 6500 K is close to the D65 white of the primaries.
        assert!((day - DVec3::ONE).abs().max_element() < 0.08, "{day}");
        assert!((LUMINANCE.dot(warm) - 1.0).abs() < 0.02);
        assert_eq!(blackbody_to_rgb(1e-300, true), DVec3::ZERO);
    }
}
