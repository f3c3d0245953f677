//! Parts of small rooms as pbrt text, for tests and the integrator's example `pixels`.

/// A square light of side 1 above the floor, facing down.
pub const SQUARE: &str = r#"Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
"point P" [ -0.5 -0.5 2  -0.5 0.5 2  0.5 0.5 2  0.5 -0.5 2 ]"#;

/// A triangular light, tilted.
pub const TRIANGLE: &str = r#"Shape "trianglemesh" "integer indices" [ 0 1 2 ]
"point P" [ -0.8 -0.5 2  0.1 0.9 1.6  0.7 -0.4 2.2 ]"#;

/// A square light that goes through the floor.
pub const THROUGH_THE_FLOOR: &str = r#"Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
"point P" [ -1.5 -1 -0.5  -1.5 1 -0.5  -1.5 1 1.5  -1.5 -1 1.5 ]"#;

/// Occluders of several kinds: a tilted triangle, a slat, and a triangle that touches the floor.
pub const CLUTTER: &str = r#"
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point P" [ -0.6 -0.3 0.9  0.5 -0.2 1.1  0.1 0.6 0.8 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -1 0.2 1.3  1 0.25 1.3  1 0.35 1.3  -1 0.3 1.3 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point P" [ 0.8 0.3 0  1.0 0.9 0  0.9 0.6 1.2 ]
"#;

/// The material of a floor with the Phong model.
pub const PHONG: &str = r#"Material "phong" "rgb Kd" [ 0.2 0.1 0.3 ] "rgb Ks" [ 0.5 0.6 0.7 ] "float exponent" [ 40.5 ]"#;

/// The material of the room's diffuse floor.
pub const MATTE: &str = r#"Material "matte" "rgb Kd" [ 0.7 0.5 0.3 ]"#;
