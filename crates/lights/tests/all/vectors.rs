//! The techniques against reference vectors of 25 digits.

use crate::reference;

#[test]
fn linear_lights() {
    reference::linear_lights(include_str!(
        "../../../testkit/vectors/e_linear_sampling.json"
    ))
    .assert();
}

#[test]
fn polygons() {
    reference::polygons(include_str!("../../../testkit/vectors/d_polygon.json")).assert();
}

#[test]
fn solid_angle_lines() {
    reference::solid_angle_lines(include_str!(
        "../../../testkit/vectors/f_solid_angle_lines.json"
    ))
    .assert();
}
