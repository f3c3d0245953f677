//! Alpha masks: grids of texels that cut holes into triangles, exact for lines as well as for
//! points. [`AlphaMask`] is the [`Filter`] to use for leaves, fences and other cutouts.

use crate::Filter;
use linelit_geometry::intervals::Interval;
use std::{fmt, sync::Arc};

/// How a grid of texels continues beyond its edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AlphaWrap {
    /// The grid repeats.
    #[default]
    Repeat,
    /// The grid repeats, with every other copy mirrored.
    Mirror,
    /// The texels at the grid's edge continue outward.
    Clamp,
    /// Alpha is zero beyond the edges.
    Zero,
}

/// How alpha is looked up between the centres of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AlphaLookup {
    /// The alpha of the nearest texel.
    Nearest,
    /// Linear interpolation between the four nearest centres, along u and v.
    #[default]
    Bilinear,
}

/// The threshold of alpha that decides whether a triangle hides what is behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaCutoff {
    /// A triangle hides what is behind it where alpha is above this value. With 0 this is pbrt's
    /// rule: the triangle is cut out only where alpha is exactly 0.
    Above(f32),
    /// A triangle hides what is behind it where alpha is at least this value; glTF's `alphaCutoff`.
    AtLeast(f32),
}

impl Default for AlphaCutoff {
    /// Returns pbrt's rule: everything above 0 hides.
    fn default() -> Self {
        Self::Above(0.0)
    }
}

impl AlphaCutoff {
    #[inline]
    fn hides(self, alpha: f64) -> bool {
        match self {
            Self::Above(cutoff) => alpha > f64::from(cutoff),
            Self::AtLeast(cutoff) => alpha >= f64::from(cutoff),
        }
    }

    #[inline]
    fn value(self) -> f64 {
        let (Self::Above(cutoff) | Self::AtLeast(cutoff)) = self;
        cutoff.into()
    }
}

/// Why a grid of texels or a mask could not be created.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AlphaError {
    /// The grid has no texels, or their number is not its width times its height, or a side is
    /// longer than 2²⁴ texels.
    Size,
    /// A texel's value, or the cutoff, is not finite.
    Value,
    /// A triangle's texture coordinates are not finite, or farther than 2²⁴ texels from zero: that
    /// far out, `f32` cannot tell neighbouring texels apart, and a walk along them would take for
    /// ever.
    Coordinates {
        /// The index of the triangle.
        triangle: usize,
    },
}

impl fmt::Display for AlphaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size => {
                f.write_str("an alpha mask needs width × height texels, up to 2^24 a side")
            }
            Self::Value => f.write_str("a value of an alpha mask is not finite"),
            Self::Coordinates { triangle } => write!(
                f,
                "texture coordinates of triangle {triangle} are not finite, or beyond 2^24 texels"
            ),
        }
    }
}

impl std::error::Error for AlphaError {}

/// The largest distance of texture coordinates from zero, in texels. Up to this distance an `f32`
/// distinguishes one texel from the next; a mask with coordinates beyond it is refused.
const FARTHEST: f64 = (1_u32 << f32::MANTISSA_DIGITS) as f64;

/// A grid of alpha values over the unit square of texture coordinates (u, v), with a lookup and a
/// cutoff that say where it hides.
///
/// The first value is at (0, 0), the next one along u. Texel (i, j) spans from i to i + 1 widths of
/// a texel along u, and its value is the value at its centre. For an image whose rows are stored
/// from the top while coordinates count from the bottom, as in pbrt and OBJ, pass 1 − v to
/// [`AlphaMask::new`].
#[derive(Clone, Debug, PartialEq)]
pub struct AlphaTexels {
    size: [i64; 2],
    values: Vec<f32>,
    wrap: [AlphaWrap; 2],
    lookup: AlphaLookup,
    cutoff: AlphaCutoff,
}

impl AlphaTexels {
    /// Creates a grid that repeats, is looked up bilinearly, and hides where alpha is not 0, as in
    /// pbrt.
    pub fn new(width: u32, height: u32, values: Vec<f32>) -> Result<Self, AlphaError> {
        let size = [width, height].map(i64::from);
        let few = |n: &i64| (1..=1 << 24).contains(n);
        if !size.iter().all(few) || usize::try_from(size[0] * size[1]) != Ok(values.len()) {
            return Err(AlphaError::Size);
        }
        if !values.iter().all(|value| value.is_finite()) {
            return Err(AlphaError::Value);
        }
        Ok(Self {
            size,
            values,
            wrap: [AlphaWrap::default(); 2],
            lookup: AlphaLookup::default(),
            cutoff: AlphaCutoff::default(),
        })
    }

    /// Sets how the grid continues beyond its edges, along u and v.
    #[must_use]
    pub fn with_wrap(self, wrap: [AlphaWrap; 2]) -> Self {
        Self { wrap, ..self }
    }

    /// Sets how values between the centres of texels are looked up.
    #[must_use]
    pub fn with_lookup(self, lookup: AlphaLookup) -> Self {
        Self { lookup, ..self }
    }

    /// Sets the cutoff. With a cutoff that is not a number, the grid hides nowhere.
    #[must_use]
    pub fn with_cutoff(self, cutoff: AlphaCutoff) -> Self {
        Self { cutoff, ..self }
    }

    /// Returns the alpha value at texture coordinates; not a number where a coordinate is not
    /// finite.
    #[must_use]
    pub fn alpha(&self, uv: [f64; 2]) -> f64 {
        if !(uv[0].is_finite() && uv[1].is_finite()) {
            return f64::NAN;
        }
        self.value(self.texels(uv))
    }

    /// Whether the grid hides what is behind it at texture coordinates.
    #[must_use]
    pub fn hides(&self, uv: [f64; 2]) -> bool {
        self.cutoff.hides(self.alpha(uv))
    }

    /// Converts texture coordinates to units of texels, shifted such that within each cell of the
    /// grid of integers one formula gives the value.
    #[inline]
    fn texels(&self, uv: [f64; 2]) -> [f64; 2] {
        let shift = match self.lookup {
            AlphaLookup::Nearest => 0.0,
            AlphaLookup::Bilinear => 0.5,
        };
        #[allow(clippy::cast_precision_loss, reason = "at most 2^24")]
        [0, 1].map(|k| uv[k] * self.size[k] as f64 - shift)
    }

    /// Returns the alpha value at a point in units of texels.
    #[inline]
    fn value(&self, at: [f64; 2]) -> f64 {
        let cell = at.map(whole);
        match self.lookup {
            AlphaLookup::Nearest => self.texel(cell),
            AlphaLookup::Bilinear => self.corners(cell).at(at, cell),
        }
    }

    /// Returns the value of a texel, which may be beyond the edges of the grid.
    #[inline]
    fn texel(&self, at: [i64; 2]) -> f64 {
        let wrapped = [0, 1].map(|k| {
            let (i, n) = (at[k], self.size[k]);
            match self.wrap[k] {
                AlphaWrap::Repeat => Some(i.rem_euclid(n)),
                AlphaWrap::Mirror => {
                    let i = i.rem_euclid(2 * n);
                    Some(i.min(2 * n - 1 - i))
                }
                AlphaWrap::Clamp => Some(i.clamp(0, n - 1)),
                AlphaWrap::Zero => (0..n).contains(&i).then_some(i),
            }
        });
        let [Some(i), Some(j)] = wrapped else {
            return 0.0;
        };
        let index = usize::try_from(j * self.size[0] + i).unwrap_or(usize::MAX);
        self.values.get(index).copied().map_or(0.0, f64::from)
    }

    /// Returns the values at the corners of a cell of the grid of texels' centres.
    #[inline]
    fn corners(&self, [i, j]: [i64; 2]) -> Corners {
        let row = |j| [self.texel([i, j]), self.texel([i + 1, j])];
        Corners([row(j), row(j + 1)])
    }

    /// Pushes the intervals of the segment between two texture coordinates where the grid hides.
    fn hides_along(&self, ends: [[f64; 2]; 2], hidden: &mut Vec<Interval>) {
        let ends = ends.map(|uv| self.texels(uv));
        // Append an interval, and join it to the one before if they touch.
        let mut piece = |lo: f64, hi: f64, hides: bool| match hidden.last_mut() {
            _ if !(hides && lo < hi) => {}
            #[allow(clippy::float_cmp, reason = "the same number")]
            Some(last) if last.hi == lo => last.hi = hi,
            _ => hidden.push(Interval { lo, hi }),
        };
        // Go through the cells that the segment crosses.
        march(ends, |cell, lo, hi| match self.lookup {
            AlphaLookup::Nearest => piece(lo, hi, self.cutoff.hides(self.texel(cell))),
            AlphaLookup::Bilinear => {
                let corners = self.corners(cell);
                // If all corners of a cell hide, the whole cell hides; if none does, nothing in it
                // hides.
                let hiding = corners.0.as_flattened().iter();
                let hiding = hiding.filter(|value| self.cutoff.hides(**value)).count();
                if hiding % 4 == 0 {
                    piece(lo, hi, hiding > 0);
                    return;
                }
                // Cut the way through the cell where the value crosses the cutoff, and test the
                // middle of each piece.
                let [a, b] = [lo, hi].map(|s| along(ends, s));
                let mut from = 0.0;
                let mut start = lo;
                let roots = corners.crossings([a, b], cell, self.cutoff.value());
                for to in roots.into_iter().chain([1.0]) {
                    if from < to {
                        let middle = along([a, b], 0.5 * (from + to));
                        // The end of a cell is exactly the beginning of the next.
                        let end = if to < 1.0 {
                            (lo + (hi - lo) * to).min(hi)
                        } else {
                            hi
                        };
                        piece(start, end, self.cutoff.hides(corners.at(middle, cell)));
                        (from, start) = (to, end);
                    }
                }
            }
        });
    }
}

/// Returns the floor of a number, limited to ±2⁴⁰.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    reason = "beyond i64, the last there is"
)]
fn whole(x: f64) -> i64 {
    // The limit leaves room for the indices of neighbours.
    (x.floor() as i64).clamp(-(1 << 40), 1 << 40)
}

/// The point at parameter `s` of a segment.
#[inline]
fn along([a, b]: [[f64; 2]; 2], s: f64) -> [f64; 2] {
    [0, 1].map(|k| a[k] * (1.0 - s) + b[k] * s)
}

/// The alpha values at the four corners of a cell, by rows.
#[derive(Clone, Copy)]
struct Corners([[f64; 2]; 2]);

impl Corners {
    /// The bilinear value at a point of the cell; exact where all corners are equal.
    #[inline]
    fn at(&self, at: [f64; 2], cell: [i64; 2]) -> f64 {
        let [x, y] = place_in(cell, at);
        let [low, high] = self.0.map(|[a, b]| a + (b - a) * x);
        low + (high - low) * y
    }

    /// Finds where the alpha value is `cutoff` on a segment from `a` to `b` through the cell: up to
    /// two parameters between 0 and 1 in ascending order, with 1 in place of each that does not
    /// exist.
    ///
    /// Along the segment the value is A + B t + C t². To lose no digits to cancellation, the root
    /// in whose formula the two terms have the same sign is computed first, and the other from
    /// their product.
    fn crossings(&self, [a, b]: [[f64; 2]; 2], cell: [i64; 2], cutoff: f64) -> [f64; 2] {
        let (from, to) = (place_in(cell, a), place_in(cell, b));
        let [[v00, v10], [v01, v11]] = self.0;
        let twist = (v00 - v10) + (v11 - v01);
        let c = twist * (to[0] - from[0]) * (to[1] - from[1]);
        let at_start = self.at(a, cell) - cutoff;
        let at_end = self.at(b, cell) - cutoff;
        let b = at_end - at_start - c;
        let discriminant = b * b - 4.0 * c * at_start;
        if !(discriminant >= 0.0) {
            return [1.0; 2];
        }
        let q = -0.5 * (b + discriminant.sqrt().copysign(b));
        let inside = |t: f64| if t > 0.0 && t < 1.0 { t } else { 1.0 };
        let [s, t] = [inside(q / c), inside(at_start / q)];
        [s.min(t), s.max(t)]
    }
}

/// Returns the coordinates of a point relative to a cell, from 0 to 1.
#[inline]
fn place_in(cell: [i64; 2], at: [f64; 2]) -> [f64; 2] {
    #[allow(clippy::cast_precision_loss, reason = "at most 2^40")]
    [0, 1].map(|k| (at[k] - cell[k] as f64).clamp(0.0, 1.0))
}

/// Visits the cells of the unit grid that a segment crosses, in order, each with the parameters
/// where the segment enters and leaves it.
///
/// The parameters of borders are computed from the segment's ends and not added up, so that each is
/// off only by the rounding of one difference and one quotient.
fn march(ends: [[f64; 2]; 2], mut visit: impl FnMut([i64; 2], f64, f64)) {
    let [from, to] = ends;
    let finite = ends.as_flattened().iter().all(|x| x.is_finite());
    if !finite {
        return;
    }
    let size = [0, 1].map(|k| to[k] - from[k]);
    let mut cell = from.map(whole);
    let step = size.map(|d: f64| if d < 0.0 { -1 } else { 1 });
    // The parameter where the segment leaves the cell along an axis.
    let border = |cell: [i64; 2], k: usize| {
        #[allow(clippy::cast_precision_loss, reason = "at most 2^40")]
        let at = (cell[k] + i64::from(step[k] > 0)) as f64;
        match size[k] {
            0.0 => f64::INFINITY,
            d => (at - from[k]) / d,
        }
    };
    // Leave each cell through the nearer of its two borders.
    let mut start = 0.0;
    loop {
        let next = [border(cell, 0), border(cell, 1)];
        let axis = usize::from(next[1] < next[0]);
        let end = next[axis].clamp(start, 1.0);
        if start < end {
            visit(cell, start, end);
        }
        if !(next[axis] < 1.0) {
            return;
        }
        cell[axis] += step[axis];
        start = end;
    }
}

/// Triangles with holes where a grid of texels says so: a [`Filter`] for both points and lines.
///
/// Lines are handled exactly. Along the segment in which a line sample's plane of view cuts a
/// triangle, texture coordinates are linear, so the cells that it passes are visited from border to
/// border; where the lookup is bilinear, the cutoff is reached at the roots of a quadratic in each
/// cell. Ends of intervals have the rounding errors of texture coordinates: 2⁻⁵³ of the triangle's
/// distance from zero in texels.
///
/// ```
/// use linelit_visibility::{AlphaLookup, AlphaMask, AlphaTexels, Filter};
/// use std::sync::Arc;
///
/// // A checkerboard of two by two, over a triangle that is half of it.
/// let board = AlphaTexels::new(2, 2, vec![1.0, 0.0, 0.0, 1.0])?.with_lookup(AlphaLookup::Nearest);
/// let mask = AlphaMask::new(Arc::new(board), vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]])?;
/// assert!(mask.hides(0, [0.25, 0.25]) && !mask.hides(0, [0.75, 0.25]));
///
/// let mut hidden = Vec::new();
/// mask.hides_along(0, [[0.0, 0.25], [0.75, 0.25]], &mut hidden);
/// assert_eq!((hidden.len(), hidden[0].lo), (1, 0.0));
/// assert!((hidden[0].hi - 2.0 / 3.0).abs() < 1e-15);
/// # Ok::<(), linelit_visibility::AlphaError>(())
/// ```
#[derive(Clone, Debug)]
pub struct AlphaMask {
    texels: Arc<AlphaTexels>,
    uv: Vec<[[f64; 2]; 3]>,
}

impl AlphaMask {
    /// Creates the mask from the grid of texels and the texture coordinates of each triangle's
    /// corners. A triangle whose index is beyond the list has no holes.
    pub fn new(texels: Arc<AlphaTexels>, uv: Vec<[[f64; 2]; 3]>) -> Result<Self, AlphaError> {
        let fits = |corners: &[[f64; 2]; 3]| {
            let corners = corners.map(|corner| texels.texels(corner));
            // Not a number is not less.
            corners.as_flattened().iter().all(|x| x.abs() <= FARTHEST)
        };
        match uv.iter().position(|corners| !fits(corners)) {
            Some(triangle) => Err(AlphaError::Coordinates { triangle }),
            None => Ok(Self { texels, uv }),
        }
    }

    /// The grid of texels.
    #[must_use]
    pub fn texels(&self) -> &Arc<AlphaTexels> {
        &self.texels
    }

    /// Returns the texture coordinates at a point given by barycentric coordinates, which are
    /// limited to the triangle; `None` if the triangle has no texture coordinates.
    #[inline]
    fn uv(&self, triangle: u32, [b, c]: [f64; 2]) -> Option<[f64; 2]> {
        let corners = self.uv.get(triangle as usize)?;
        let (b, c) = (b.clamp(0.0, 1.0), c.clamp(0.0, 1.0));
        let a = 1.0 - b - c;
        Some([0, 1].map(|k| corners[0][k] * a + corners[1][k] * b + corners[2][k] * c))
    }
}

impl Filter for AlphaMask {
    fn hides(&self, triangle: u32, barycentric: [f64; 2]) -> bool {
        let uv = self.uv(triangle, barycentric);
        uv.is_none_or(|uv| self.texels.hides(uv))
    }

    fn hides_along(&self, triangle: u32, ends: [[f64; 2]; 2], hidden: &mut Vec<Interval>) {
        match ends.map(|end| self.uv(triangle, end)) {
            [Some(from), Some(to)] => self.texels.hides_along([from, to], hidden),
            _ => hidden.push(Interval::UNIT),
        }
    }
}
