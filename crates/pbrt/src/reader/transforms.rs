//! The directives that change the current transform, such as `Translate`, `LookAt` and
//! `CoordSysTransform`.

use super::Loader;
use super::lexer::{Lexer, Token, TokenKind};
use linelit_assembly::{ErrorKind, Result, SceneError, nearest, shorten};
use linelit_elementary::sin_cos;
use linelit_geometry::glam::{DAffine3, DMat3};
use linelit_geometry::{DMat4, DVec3};

impl Loader {
    /// Executes a directive that changes or stores the current transform.
    pub(super) fn transform_directive(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        // Compute the next transform: a new transform is applied to points before the current one.
        let ctm = self.state.ctm;
        let next = match lexer.word(token) {
            b"Identity" => DAffine3::IDENTITY,
            b"Translate" => {
                let [x, y, z] = self.numbers(lexer, token)?;
                ctm * DAffine3::from_translation(DVec3::new(x, y, z))
            }
            b"Scale" => {
                let [x, y, z] = self.numbers(lexer, token)?;
                ctm * DAffine3::from_scale(DVec3::new(x, y, z))
            }
            b"Rotate" => {
                let [angle, x, y, z] = self.numbers(lexer, token)?;
                let Some(axis) = DVec3::new(x, y, z).try_normalize() else {
                    return Err(bad_transform(
                        lexer,
                        token,
                        "the axis of `Rotate` has no length",
                    ));
                };
                ctm * rotation(angle, axis)
            }
            b"LookAt" => {
                let n: [f64; 9] = self.numbers(lexer, token)?;
                let [eye, target, up] = [0, 3, 6].map(|i| DVec3::new(n[i], n[i + 1], n[i + 2]));
                ctm * look_at(eye, target, up).map_err(|m| bad_transform(lexer, token, m))?
            }
            b"Transform" => self.matrix(lexer, token)?,
            b"ConcatTransform" => ctm * self.matrix(lexer, token)?,
            b"CoordinateSystem" => {
                let (name, _) = self.name(lexer, token, "a coordinate system's name")?;
                self.coordinate_systems.insert(name, ctm);
                return Ok(());
            }
            _ => {
                let (name, name_token) = self.name(lexer, token, "a coordinate system's name")?;
                match self.coordinate_systems.get(&name) {
                    Some(system) => *system,
                    None => {
                        let names = self.coordinate_systems.keys().map(String::as_str);
                        let message = format!("unknown coordinate system `{}`", shorten(&name));
                        return Err(lexer
                            .error(ErrorKind::UnknownName, message, name_token.span, "")
                            .suggest(nearest(&name, names)));
                    }
                }
            }
        };
        // Set it, unless it is for the end of a motion.
        if !next.is_finite() {
            let message = "the transform is not finite any more";
            return Err(bad_transform(lexer, token, message));
        }
        if !self.state.end_time_only {
            self.state.ctm = next;
        }
        Ok(())
    }

    /// Reads one number of a directive.
    pub(super) fn next_number(&mut self, lexer: &mut Lexer, directive: Token) -> Result<f64> {
        match lexer.peek()? {
            Some(token) if token.kind == TokenKind::Word => {
                lexer.next()?;
                lexer.number(token)
            }
            other => {
                let word = lexer.source().text(directive.span);
                let span = other.map_or(lexer.end(), |t| t.span);
                Err(lexer.error(
                    ErrorKind::Syntax,
                    format!("`{word}` has too few numbers"),
                    span,
                    "expected a number",
                ))
            }
        }
    }

    /// Reads the numbers of a directive, with or without brackets.
    fn numbers<const N: usize>(&mut self, lexer: &mut Lexer, directive: Token) -> Result<[f64; N]> {
        let open = lexer.peek()?.filter(|t| t.kind == TokenKind::Open);
        if open.is_some() {
            lexer.next()?;
        }
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.next_number(lexer, directive)?;
        }
        if open.is_some() {
            match lexer.next()? {
                Some(token) if token.kind == TokenKind::Close => {}
                other => {
                    let word = lexer.source().text(directive.span);
                    let span = other.map_or(lexer.end(), |t| t.span);
                    let message = format!("`{word}` takes {N} numbers");
                    return Err(lexer.error(ErrorKind::Syntax, message, span, "expected `]`"));
                }
            }
        }
        Ok(values)
    }

    /// Reads a 4×4 matrix, given column by column, as an affine map.
    fn matrix(&mut self, lexer: &mut Lexer, directive: Token) -> Result<DAffine3> {
        let m: [f64; 16] = self.numbers(lexer, directive)?;
        let [a, b, c, w] = [m[3], m[7], m[11], m[15]];
        if a != 0.0 || b != 0.0 || c != 0.0 || w == 0.0 {
            let message = "the matrix is projective: its last row is not 0 0 0 1";
            return Err(bad_transform(lexer, directive, message)
                .help("matrices are written column by column, translation last"));
        }
        Ok(DAffine3::from_mat4(DMat4::from_cols_array(
            &m.map(|v| v / w),
        )))
    }
}

/// Returns the error for a directive whose transform is not valid.
fn bad_transform(lexer: &Lexer, token: Token, message: &str) -> SceneError {
    lexer.error(ErrorKind::BadTransform, message, token.span, "")
}

/// Returns the rotation by an angle in degrees about a unit axis, exact for multiples of 90°.
fn rotation(degrees: f64, axis: DVec3) -> DAffine3 {
    let turn = degrees.rem_euclid(360.0);
    let exact = [
        (0.0, (0.0, 1.0)),
        (90.0, (1.0, 0.0)),
        (180.0, (0.0, -1.0)),
        (270.0, (-1.0, 0.0)),
    ];
    #[allow(clippy::float_cmp, reason = "exactly these angles have exact sines")]
    let found = exact.iter().find(|(a, _)| *a == turn);
    let (sin, cos) = found.map_or_else(|| sin_cos(turn.to_radians()), |(_, sc)| *sc);
    let column = |v: DVec3| v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos));
    let columns = [DVec3::X, DVec3::Y, DVec3::Z].map(column);
    DAffine3::from_mat3(DMat3::from_cols(columns[0], columns[1], columns[2]))
}

/// Returns the transform of pbrt's `LookAt`, from world to camera, where the camera looks along +z
/// and x is to the right of `up` (a left-handed system).
fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> std::result::Result<DAffine3, &'static str> {
    let forward = (target - eye)
        .try_normalize()
        .ok_or("the eye of `LookAt` is at its target")?;
    let right = up
        .try_normalize()
        .and_then(|up| up.cross(forward).try_normalize())
        .ok_or("the up vector of `LookAt` is zero or along the view")?;
    let up = forward.cross(right);
    let camera_to_world = DAffine3 {
        matrix3: DMat3::from_cols(right, up, forward),
        translation: eye,
    };
    // Invert it: the matrix is orthonormal, so that its transpose is its inverse.
    let inverse = camera_to_world.matrix3.transpose();
    Ok(DAffine3 {
        matrix3: inverse,
        translation: -(inverse * eye),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_turn_counter_clockwise_and_right_angles_are_exact() {
        assert_eq!(
            rotation(90.0, DVec3::Z).transform_vector3(DVec3::X),
            DVec3::Y
        );
        assert_eq!(
            rotation(-90.0, DVec3::X).transform_vector3(DVec3::Y),
            DVec3::NEG_Z
        );
        let v = rotation(30.0, DVec3::Y).transform_vector3(DVec3::Z);
        assert!((v - DVec3::new(0.5, 0.0, 0.75_f64.sqrt())).length() < 1e-15);
    }

    #[test]
    fn look_at_puts_the_target_ahead_and_x_to_the_right() {
        let m = look_at(
            DVec3::new(0.0, 4.0, 20.0),
            DVec3::new(0.0, -2.0, 2.5),
            DVec3::Y,
        )
        .unwrap();
        let ahead = m.transform_point3(DVec3::new(0.0, -2.0, 2.5));
        assert!(ahead.x.abs() < 1e-14 && ahead.y.abs() < 1e-14 && ahead.z > 18.0);
        // Looking along −z with y up, pbrt's left-handed camera has x to the left of the world's.
        let m = look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y).unwrap();
        assert_eq!(m.transform_vector3(DVec3::X), DVec3::NEG_X);
        assert!(look_at(DVec3::ZERO, DVec3::Y, DVec3::Y).is_err());
        assert!(look_at(DVec3::Y, DVec3::Y, DVec3::X).is_err());
    }
}
