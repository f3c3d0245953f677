//! The conversion of colours with other primaries to linear RGB with the primaries of Rec. 709.
//!
//! The conversion is absolute, as are Mitsuba's and OpenEXR's own (`RGBtoXYZ`, `XYZtoRGB`): from
//! the file's primaries and white to CIE XYZ, and from there to Rec. 709 with D65, without
//! chromatic adaptation. So the tristimulus values of a file in XYZ do not change, and the white of
//! a file that has another white than D65 keeps its tint.

use crate::FormatError;

/// The chromaticities x, y of red, green, blue and white.
type Chromaticities = [[f64; 2]; 4];

/// The chromaticities of Rec. 709.
const REC709: Chromaticities = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]];

/// The sum of squared differences up to which chromaticities count as Rec. 709, as in Mitsuba.
const SAME: f64 = 1e-6;

/// A linear map of colours, by rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Matrix([[f64; 3]; 3]);

impl Matrix {
    /// Returns the colour that the map makes of a colour.
    pub(crate) fn apply(&self, rgb: [f32; 3]) -> [f32; 3] {
        let rgb = rgb.map(f64::from);
        self.times(rgb).map(crate::moments::to_f32)
    }

    /// Returns the product of this matrix and a vector.
    fn times(&self, v: [f64; 3]) -> [f64; 3] {
        self.0
            .map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    /// Returns the product of this matrix and the matrix `other`, which is applied first.
    fn product(&self, other: &Self) -> Self {
        let column = |k: usize| self.times(other.0.map(|row| row[k]));
        let columns = [column(0), column(1), column(2)];
        Self([0, 1, 2].map(|i| columns.map(|column| column[i])))
    }

    /// Returns the inverse of the matrix by Cramer's rule; `None` if the matrix is singular.
    fn inverse(&self) -> Option<Self> {
        let m = &self.0;
        let cofactor = |i: usize, j: usize| {
            let (a, b) = ((i + 1) % 3, (i + 2) % 3);
            let (c, d) = ((j + 1) % 3, (j + 2) % 3);
            m[a][c] * m[b][d] - m[a][d] * m[b][c]
        };
        let determinant: f64 = (0..3).map(|j| m[0][j] * cofactor(0, j)).sum();
        let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j| cofactor(j, i) / determinant));
        let finite = rows.iter().flatten().all(|v| v.is_finite());
        (finite && determinant.abs() > 1e-12).then_some(Self(rows))
    }
}

/// Returns the matrix from RGB to XYZ, whose columns are multiples of the primaries with the white
/// of luminance one as their sum; `None` if there are no such multiples, because the primaries lie
/// on a line or the white has no luminance.
fn to_xyz(chromaticities: &Chromaticities) -> Option<Matrix> {
    let tristimulus = |[x, y]: [f64; 2]| [x, y, 1.0 - x - y];
    let [r, g, b, white] = chromaticities.map(tristimulus);
    let primaries = Matrix([0, 1, 2].map(|i| [r[i], g[i], b[i]]));
    let white = white.map(|v| v / white[1]);
    let shares = primaries.inverse()?.times(white);
    let matrix = Matrix(primaries.0.map(|row| [0, 1, 2].map(|k| row[k] * shares[k])));
    let finite = matrix.0.iter().flatten().all(|v| v.is_finite());
    finite.then_some(matrix)
}

/// Returns the map from colours with these primaries and white to Rec. 709; `None` if the primaries
/// and the white are those of Rec. 709, up to [`SAME`].
///
/// # Errors
/// The primaries lie on a line, or the white has no luminance.
pub(crate) fn to_rec709(from: Chromaticities) -> Result<Option<Matrix>, FormatError> {
    let differences = from.iter().flatten().zip(REC709.iter().flatten());
    if differences.map(|(a, b)| (a - b) * (a - b)).sum::<f64>() < SAME {
        return Ok(None);
    }
    let back = to_xyz(&REC709).and_then(|m| m.inverse());
    match (back, to_xyz(&from)) {
        (Some(back), Some(there)) => Ok(Some(back.product(&there))),
        _ => Err(FormatError::new(
            "OpenEXR",
            "chromaticities of three primaries and a white",
            format!("{from:?}"),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const XYZ: Chromaticities = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]];

    /// The usual matrix for these primaries and this white, to eight digits.
    #[test]
    fn xyz_becomes_rec709() {
        let matrix = to_rec709(XYZ).unwrap().unwrap();
        let want = [
            [3.24096994, -1.53738318, -0.49861076],
            [-0.96924364, 1.87596750, 0.04155506],
            [0.05563008, -0.20397696, 1.05697151],
        ];
        for (got, want) in matrix.0.iter().flatten().zip(want.iter().flatten()) {
            assert!((got - want).abs() < 1e-8, "{got} {want}");
        }
        // D65 in XYZ is white.
        let white = matrix.times([0.3127 / 0.3290, 1.0, (1.0 - 0.3127 - 0.3290) / 0.3290]);
        assert!(white.iter().all(|v| (v - 1.0).abs() < 1e-12), "{white:?}");
    }

    #[test]
    fn colours_of_the_same_white_keep_white() {
        // Rec. 2020: its red lies outside of Rec. 709.
        let rec2020 = [
            [0.708, 0.292],
            [0.170, 0.797],
            [0.131, 0.046],
            [0.3127, 0.3290],
        ];
        let matrix = to_rec709(rec2020).unwrap().unwrap();
        let [white, red] = [[1.0; 3], [1.0, 0.0, 0.0]].map(|v| matrix.times(v));
        assert!(white.iter().all(|v| (v - 1.0).abs() < 1e-12), "{white:?}");
        // ITU-R BT.2407, table of M1: 1.6605, -0.1246, -0.0182.
        for (got, want) in red.iter().zip([1.6605, -0.1246, -0.0182]) {
            assert!((got - want).abs() < 1e-4, "{red:?}");
        }
    }

    #[test]
    fn nonsense_is_an_error() {
        assert!(to_rec709(REC709).unwrap().is_none());
        for broken in [
            [[0.3, 0.3]; 4],
            [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3, 0.0]],
            [[f64::NAN; 2]; 4],
        ] {
            assert!(to_rec709(broken).is_err(), "{broken:?}");
        }
    }
}
