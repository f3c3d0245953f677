//! The lobe over triangles, from terms that are not negative.
//!
//! With unit vectors â, b̂, ĉ to the corners, v the angle along the side from b̂, δ that whole
//! side, ê(v) the direction there, ρ the angle along the arc from â to ê, R that whole arc and τ =
//! sin ρ/sin R,
//!
//! ```text
//! ∫ (n·ω)(w·ω)ᵏ dω = det(â, b̂, ĉ) ∫ dv/sin δ ∫ dρ/sin R · τ (n·ω)(w·ω)ᵏ
//! ```
//!
//! The inner integral is that of a lobe along a line ([`lobe`](crate::lobe)), the outer one is by
//! nodes. What [horizons](cut) leave of a triangle has determinants that are products and
//! quotients, and n·ω and w·ω follow from their values at the corners: nothing cancels, however
//! thin a sliver.

mod cut;

use crate::exact::{dot, length};
use crate::fan::Fan;
use crate::gauss::{FEW, FEW_NODES, FEW_WEIGHTS};
use crate::lobe::{SMOOTH, over_sine};
use crate::solid_angle::volume;
use crate::span::not_too_near;
use cut::Horizons;
use linelit_elementary::{atan2, cos, hypot, ln, sin, sin_cos};
use linelit_geometry::{DVec3, predicates};

/// What is dropped is below e⁻⁴⁶ of the peak.
const DEPTH: f64 = 46.0;
/// A triangle whose every value is below e⁻¹²⁰ of the polygon's peak is dropped: even where the
/// peak is at the tip of a needle of 1e-20 sr, and the horizon passes through it.
const NOTHING: f64 = 120.0;
/// Sides are halved until they subtend at most that angle's cosine.
const LONGEST: f64 = -0.1;
/// The square of a side, so short that the third corner is not opposite the middle of the longest.
const SLENDER: f64 = 0.01;
/// Of what is 1e-300 of that, products with its own roundings are within the range of numbers.
const SCALE: f64 = 1_267_650_600_228_229_401_496_703_205_376.0;
/// The most halvings of one sweep, lest rounding errors be followed without end.
const BUDGET: i32 = 200;
/// The most rounds of halving: a half-sphere's triangles have sides of at most 180°, 90°, 45°.
const HALVINGS: u32 = 6;

/// A corner: its direction, or a point that way.
#[derive(Clone, Copy, Debug)]
struct Corner {
    at: DVec3,
    /// n and w times it.
    values: [f64; 2],
}

impl Corner {
    fn new(at: DVec3, normals: [DVec3; 2]) -> Self {
        Self {
            at,
            values: normals.map(|k| dot(k, at)),
        }
    }

    fn each(self, at: DVec3, f: impl Fn(usize) -> f64) -> Self {
        Self {
            at,
            values: [f(0), f(1)],
        }
    }

    /// The sum of two with weights that are not negative.
    fn blend(self, a: f64, other: Self, b: f64) -> Self {
        let at = self.at * a + other.at * b;
        self.each(at, |i| self.values[i] * a + other.values[i] * b)
    }

    fn over(self, length: f64) -> Self {
        self.each(self.at / length, |i| self.values[i] / length)
    }

    /// With the greatest cosines there are: a cut may be so near the shading point that its
    /// distance underflows.
    fn at_most(self, most: [f64; 2]) -> Self {
        self.each(self.at, |i| self.values[i].min(most[i]))
    }
}

/// A triangle and its corners' determinant, of either sign.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    corners: [Corner; 3],
    /// The cross products of the ends of the sides opposite the corners, in order. Of a side of
    /// nearly 180° its rounded ends know neither the plane nor the sine.
    sides: [DVec3; 3],
    /// As two factors: of half a turn's sliver the product is below the range of numbers.
    volume: [f64; 2],
}

/// The lobe.
#[derive(Clone, Copy, Debug)]
struct Lobe {
    n: DVec3,
    w: DVec3,
    k: f64,
    /// The least logarithm of its power that counts.
    least: f64,
}

/// `∫ max(0, n·ω) max(0, w·ω)ᵏ dω` over the fan of triangles from the first vertex, positive where
/// they are counter-clockwise; the lobe's highest cosine there is at least `peak`.
pub(crate) fn integral(vertices: &[DVec3], n: DVec3, w: DVec3, k: f64, peak: f64) -> f64 {
    let lobe = Lobe {
        n,
        w,
        k,
        least: if k > 0.0 && peak > 0.0 {
            k * ln(peak) - NOTHING
        } else {
            f64::NEG_INFINITY
        },
    };
    let horizons = Horizons::new(n, w);
    let mut sum = 0.0;
    for pair in vertices[1..].windows(2) {
        let corners = [vertices[0], pair[0], pair[1]].map(not_too_near);
        let volume = volume(corners[0], corners[1], corners[2]);
        if volume == 0.0 {
            continue;
        }
        let points = corners.map(|p| p * SCALE);
        let volume = volume * (SCALE * SCALE * SCALE);
        sum += horizons.above(points, volume, |t| lobe.divided(t, HALVINGS));
    }
    sum
}

impl Lobe {
    /// A triangle of unit vectors: by parts, while it has a long side.
    fn divided(&self, triangle: Triangle, rounds: u32) -> f64 {
        let corners = triangle.corners;
        let chord = |i: usize| (corners[(i + 1) % 3].at - corners[(i + 2) % 3].at).length_squared();
        let chords = [chord(0), chord(1), chord(2)];
        let pick = |better: fn(&f64, &f64) -> bool| {
            (1..3).fold(0, |best, i| {
                if better(&chords[i], &chords[best]) {
                    i
                } else {
                    best
                }
            })
        };
        let longest = pick(f64::gt);
        let turn = |first: usize| [first, (first + 1) % 3, (first + 2) % 3];
        if rounds == 0 || 1.0 - 0.5 * chords[longest] >= LONGEST {
            let [apex, from, to] = turn(pick(f64::lt)).map(|i| corners[i]);
            return match Sweep::new(*self, apex, from, to) {
                Some(sweep) => triangle.volume[0] * triangle.volume[1] * sweep.integral(),
                None => 0.0,
            };
        }
        let [a, b, c] = turn(longest);
        let turned = Triangle {
            corners: [a, b, c].map(|i| corners[i]),
            sides: [a, b, c].map(|i| triangle.sides[i]),
            ..triangle
        };
        if chords[a] < chords[b] + chords[c] && chords[b].min(chords[c]) > SLENDER {
            self.thirds(turned, rounds)
        } else {
            self.halves(turned, rounds)
        }
    }

    /// From the centre of the circumcircle, where that is inside: of half a sphere, the middle of
    /// the longest side may be opposite the third corner.
    fn thirds(&self, triangle: Triangle, rounds: u32) -> f64 {
        let corners = triangle.corners;
        let [a, b, c] = corners.map(|c| c.at);
        let normal = predicates::cross(b - a, c - a).normalize_or_zero();
        // Which pole is meant, and whether it is inside, rounded corners of (nearly) half a sphere
        // do not know: the triangle's orientation and its sides do.
        let turn = triangle.volume[0].signum() * triangle.volume[1].signum();
        let centre = self.corner(normal * turn);
        let volumes = triangle.sides.map(|side| dot(centre.at, side));
        if volumes.iter().any(|v| v * turn < 0.0) {
            return self.halves(triangle, rounds);
        }
        let third = |i: usize| {
            let (from, to) = (corners[i], corners[(i + 1) % 3]);
            let side = triangle.sides[(i + 2) % 3];
            let part = Triangle {
                corners: [centre, from, to],
                sides: [
                    side,
                    predicates::cross(to.at, centre.at),
                    predicates::cross(centre.at, from.at),
                ],
                volume: [volumes[(i + 2) % 3], 1.0],
            };
            self.divided(part, rounds - 1)
        };
        third(0) + third(1) + third(2)
    }

    /// A corner from its direction alone.
    fn corner(&self, at: DVec3) -> Corner {
        let corner = Corner::new(at, [self.n, self.w]);
        Corner {
            values: corner.values.map(|v| v.max(0.0)),
            ..corner
        }
    }

    /// By the middle of the side opposite the first corner.
    fn halves(&self, triangle: Triangle, rounds: u32) -> f64 {
        let Triangle {
            corners: [a, b, c],
            sides: [across, left, right],
            volume: [one, other],
        } = triangle;
        let sine = length(across).min(1.0);
        let angle = atan2(sine, b.at.dot(c.at));
        let (half_sine, half_cosine) = sin_cos(0.5 * angle);
        // By the side, for ends that are opposite do not know which way round it runs.
        let tangent = predicates::cross(across / sine, b.at);
        let weight = half_sine / sine;
        let middle = Corner {
            at: b.at * half_cosine + tangent * half_sine,
            ..b.blend(weight, c, weight)
        }
        .at_most([self.n.length(), self.w.length()]);
        let volume = if one.abs() < other.abs() {
            [one * weight, other]
        } else {
            [one, other * weight]
        };
        let inner = predicates::cross(a.at, middle.at);
        let half = |corners: [Corner; 3], [left, right]: [DVec3; 2]| {
            let part = Triangle {
                corners,
                sides: [across * weight, left, right],
                volume,
            };
            self.divided(part, rounds - 1)
        };
        half([a, b, middle], [-inner, right]) + half([a, middle, c], [left, inner])
    }
}

/// The arcs from an apex to the side opposite it, by the share u of that side's angle.
struct Sweep {
    lobe: Lobe,
    apex: Corner,
    from: Corner,
    to: Corner,
    angle: f64,
    sine: f64,
}

impl Sweep {
    fn new(lobe: Lobe, apex: Corner, from: Corner, to: Corner) -> Option<Self> {
        let (sine, angle) = match Fan::new(from.at, to.at, &[]) {
            Some(side) => (side.sine, side.angle),
            // The same direction twice, by rounding.
            None if from.at == to.at => (0.0, 0.0),
            None => return None,
        };
        Some(Self {
            lobe,
            apex,
            from,
            to,
            angle,
            sine,
        })
    }

    /// The point of the side at u.
    fn edge(&self, u: f64) -> Corner {
        let [a, b] = if self.sine > 0.0 {
            [
                sin(self.angle * (1.0 - u)) / self.sine,
                sin(self.angle * u) / self.sine,
            ]
        } else {
            [1.0 - u, u]
        };
        self.from.blend(a, self.to, b)
    }

    /// `∫ dv/sin δ ∫ dρ/sin R τ (n·ω)(w·ω)ᵏ`.
    fn integral(&self) -> f64 {
        let peak = self.peak();
        let high = self.level(peak);
        if !(high > self.lobe.least) {
            return 0.0;
        }
        let scale = if self.sine > 0.0 {
            self.angle / self.sine
        } else {
            1.0
        };
        let mut sum = 0.0;
        for end in [0.0, 1.0] {
            let mut width: f64 = end - peak;
            if width == 0.0 {
                continue;
            }
            // The logarithm falls at least in proportion: halving finds the window but for a factor
            // of two.
            while self.level(peak + 0.5 * width) < high - DEPTH {
                width *= 0.5;
            }
            sum += self.adaptive(peak, width, sum);
        }
        scale * sum
    }

    /// Where the highest arc ends.
    fn peak(&self) -> f64 {
        let mut best = (self.level(0.0), 0.0);
        let mut offer = |u: f64| {
            let level = self.level(u);
            if level > best.0 {
                best = (level, u);
            }
        };
        offer(1.0);
        if self.sine > 0.0 {
            let (a, b, c) = (self.apex.at, self.from, self.to);
            let cosine = cos(self.angle);
            // The side's own highest point, and the arc through the axis.
            let foot = atan2(
                (c.values[1] - b.values[1] * cosine) / self.sine,
                b.values[1],
            ) / self.angle;
            if foot > 0.0 && foot < 1.0 {
                offer(foot);
            }
            let across = predicates::cross(a, self.lobe.w);
            let [left, right] = [b, c].map(|c| predicates::dot(across, c.at));
            if left * right < 0.0 {
                let s = left.abs() * self.sine;
                offer(atan2(s, left.abs() * cosine + right.abs()) / self.angle);
            }
        }
        best.1
    }

    /// The logarithm of the lobe's highest power on the arc that ends at u.
    fn level(&self, u: f64) -> f64 {
        if self.lobe.k <= 0.0 {
            return 0.0;
        }
        let end = self.edge(u);
        let (z0, z1) = (self.apex.values[1], end.values[1]);
        let cosine = dot(self.apex.at, end.at);
        let sine = predicates::cross(self.apex.at, end.at).length();
        // The slopes at both ends, times the sine. On shorter arcs an end is as good, and slopes
        // are noise.
        let (rise, fall) = (z1 - z0 * cosine, z0 - z1 * cosine);
        let high = if sine > 1e-7 && rise > 0.0 && fall > 0.0 {
            hypot(z0, rise / sine)
        } else {
            z0.max(z1)
        };
        self.lobe.k * ln(high)
    }

    /// The inner integral along the arc that ends at u.
    fn value(&self, u: f64) -> f64 {
        let end = self.edge(u);
        let Lobe { w, k, .. } = self.lobe;
        let values = [
            [self.apex.values[0], end.values[0]],
            [0.0, 1.0],
            [self.apex.values[1], end.values[1]],
        ];
        let ends = [self.apex.at, end.at];
        let fan =
            Fan::measure(ends, ends, values, 1.0, 1.0).unwrap_or_else(|| Fan::flat(ends, values));
        let [sum, half] = over_sine(&fan, w, k);
        sum * half * half
    }

    fn rule(&self, from: f64, width: f64) -> f64 {
        let term = |i: usize| FEW_WEIGHTS[i] * self.value(from + width * FEW_NODES[i]);
        width.abs() * (0..FEW).map(term).sum::<f64>()
    }

    /// By halves until sixteen nodes on the whole and on both halves agree to 1e-8, so that the
    /// halves are right to 1e-13; to that itself where a power that is no integer ends on the
    /// triangle.
    fn adaptive(&self, from: f64, width: f64, before: f64) -> f64 {
        let k = self.lobe.k;
        let tolerance = if k < 2.0 * SMOOTH && k.fract() != 0.0 {
            1e-13
        } else {
            1e-11
        };
        let mut waiting = [(0.0, 0.0, 0.0); 64];
        waiting[0] = (from, width, self.rule(from, width));
        let (mut count, mut sum) = (1, 0.0);
        let mut budget = BUDGET;
        while count > 0 {
            (count, budget) = (count - 1, budget - 1);
            let (from, width, whole) = waiting[count];
            let (half, middle) = (0.5 * width, from + 0.5 * width);
            let parts = [self.rule(from, half), self.rule(middle, half)];
            let both = parts[0] + parts[1];
            let close = (both - whole).abs() <= tolerance * (before + sum + both);
            if close || budget <= 0 || count + 2 > waiting.len() {
                sum += both;
            } else {
                waiting[count] = (middle, half, parts[1]);
                waiting[count + 1] = (from, half, parts[0]);
                count += 2;
            }
        }
        sum
    }
}
