//! These tests repeat inputs that once gave wrong results, by up to a third of the light, and hold
//! them to the goals of docs/accuracy.md. The property tests and tables search for more inputs of
//! their kind.

use linelit_geometry::DVec3;
use linelit_shading::{phong, polygon};
use linelit_testkit::assert_close;

/// Next to the light's plane, the foot inside, the horizon cutting: by up to 22 %. Values by
/// Lambert's sum at 120 to 1,200 digits.
#[test]
fn next_to_the_plane_with_a_horizon() {
    let normal = DVec3::new(0.6, 0.0, 0.8);
    for (height, want) in [
        (1e-12, 2.827_433_388_228_671_5),
        (1e-14, 2.827_433_388_230_792_6),
        (1e-16, 2.827_433_388_230_814),
        (1e-17, 2.827_433_388_230_814),
        (1e-100, 2.827_433_388_230_814),
        (1e-280, 2.827_433_388_230_814),
    ] {
        let triangle = [(1.0, 0.0), (-0.5, 0.75), (-0.5, -0.75)];
        let triangle = triangle.map(|(x, y)| DVec3::new(x, y, height));
        let got = polygon::irradiance(&triangle, normal);
        assert_close!(got, want, rel = 1e-12, "{height:e}");
    }
}

/// The same from below: three times π and π came out.
#[test]
fn next_to_the_plane_never_above_pi() {
    let triangle = [
        DVec3::new(-0.774_590_517_202_238_1, 0.254_877_720_409_088_5, 1e-60),
        DVec3::new(0.031_550_141_635_781_82, 0.141_593_263_722_274, 1e-60),
        DVec3::new(0.743_040_375_566_456_4, -0.396_470_984_134_136_3, 1e-60),
    ];
    let normal = DVec3::new(
        -0.592_501_870_575_138_6,
        -0.613_134_859_282_675,
        -0.522_500_887_747_931_2,
    );
    let got = polygon::irradiance(&triangle, normal);
    assert_close!(got, 0.750_053_851_573_373_7, rel = 1e-12, "foot inside");
    let triangle = [
        DVec3::new(0.212_353_504_195_216_92, 0.028_680_029_398_881_812, 1e-30),
        DVec3::new(-0.207_589_330_740_222_12, -0.028_036_589_888_578_156, 1e-30),
        DVec3::new(-0.359_555_376_692_676_2, 1.543_851_911_361_615_8, 1e-30),
    ];
    let got = polygon::irradiance(&triangle, DVec3::Z);
    assert_close!(
        got,
        9.037_660_782_148_03e-28,
        rel = 1e-12,
        "foot on an edge"
    );
}

/// A line that crosses the horizon, the lobe's axis nearly perpendicular to it: five digits lost.
#[test]
fn lobe_perpendicular_to_a_line_through_the_horizon() {
    let p0 = DVec3::new(
        1.290_716_784_489_442,
        0.350_989_610_544_715_45,
        -0.830_739_275_193_354_2,
    );
    let p1 = DVec3::new(
        0.175_754_454_343_877_15,
        -1.544_271_171_493_001_7,
        -0.925_576_396_733_302_6,
    );
    let normal = DVec3::new(
        0.842_915_952_574_523_5,
        0.131_916_438_641_096_84,
        0.521_623_187_858_470_8,
    );
    let axis = DVec3::new(
        -0.571_753_722_428_248_2,
        0.372_923_892_768_226_6,
        -0.730_770_450_340_464_8,
    );
    let got = phong::cylinder(p0, p1, normal, axis, 1.0);
    assert_close!(got, 1.751_087_852_476_151_4e-13, rel = 1e-10, "k = 1");
}
