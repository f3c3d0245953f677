//! The techniques against reference vectors of 25 digits.

use crate::common::reference;

#[test]
fn linear_lights() {
    reference::linear_lights(include_str!("../vectors/e_linear_sampling.json")).assert();
}

#[test]
fn polygons() {
    reference::polygons(include_str!("../vectors/d_polygon.json")).assert();
}

#[test]
fn solid_angle_lines() {
    reference::solid_angle_lines(include_str!("../vectors/f_solid_angle_lines.json")).assert();
}
