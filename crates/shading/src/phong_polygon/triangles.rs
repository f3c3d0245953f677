//! The lobe over triangles, from terms that are not negative.
//!
//! With unit vectors â, b̂, ĉ to the corners, v the angle along the side from b̂, δ that whole side,
//! ê(v) the direction there, ρ the angle along the arc from â to ê, R that whole arc and
//! τ = sin ρ/sin R,
//!
//! ```text
//! ∫ (n·ω)(w·ω)ᵏ dω = det(â, b̂, ĉ) ∫ dv/sin δ ∫ dρ/sin R · τ (n·ω)(w·ω)ᵏ
//! ```
//!
//! The inner integral is that of a lobe along a line ([`lobe`](crate::lobe)), the outer one is by
//! nodes. What a cut leaves of a triangle is a product of quotients of its determinant, and n·ω and
//! w·ω follow from their values at the corners: nothing cancels, however thin a sliver.

use crate::exact::{cross_at_crossing, dot, length, value_at_crossing};
use crate::fan::Fan;
use crate::gauss::{FEW, FEW_NODES, FEW_WEIGHTS};
use crate::horizon::crossing;
use crate::lobe::{SMOOTH, over_sine};
use crate::solid_angle::volume;
use linelit_geometry::{DVec3, predicates};

/// What is dropped is below e⁻⁴⁶ of the peak.
const DEPTH: f64 = 46.0;
/// A triangle whose every value is below e⁻¹²⁰ of the polygon's peak is dropped: even where the peak is at
/// the tip of a needle of 1e-20 sr, and the horizon passes through it.
const NOTHING: f64 = 120.0;
/// Sides are halved until they subtend at most that angle's cosine.
const LONGEST: f64 = -0.1;
/// The square of a side, so short that the third corner is not opposite the middle of the longest.
const SLENDER: f64 = 0.01;
/// Height of a triangle from where on its rounded corners know their determinant to 2e-13.
const FAT: f64 = 1e-3;
/// A difference below this share of its terms has lost more than three bits.
const CANCELLED: f64 = 0.125;
/// The most halvings of one sweep, lest rounding errors be followed without end.
const BUDGET: i32 = 200;
/// The most rounds of halving: a half-sphere's triangles have sides of at most 180°, 90°, 45°.
const HALVINGS: u32 = 6;

/// A corner: its direction (at first, the point), and n and w times it.
#[derive(Clone, Copy, Debug)]
struct Corner {
    at: DVec3,
    facing: f64,
    lobe: f64,
}

impl Corner {
    /// The sum of two with weights that are not negative.
    fn blend(self, a: f64, other: Self, b: f64) -> Self {
        Self {
            at: self.at * a + other.at * b,
            facing: self.facing * a + other.facing * b,
            lobe: self.lobe * a + other.lobe * b,
        }
    }

    fn unit(self) -> Self {
        let length = length(self.at);
        Self {
            at: self.at / length,
            facing: self.facing / length,
            lobe: self.lobe / length,
        }
    }

    /// With the greatest cosines there are: a cut may be so near the shading point that its distance
    /// underflows.
    fn at_most(self, [facing, lobe]: [f64; 2]) -> Self {
        Self {
            facing: self.facing.min(facing),
            lobe: self.lobe.min(lobe),
            ..self
        }
    }
}

/// A triangle and its corners' determinant, of either sign.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    corners: [Corner; 3],
    /// The cross products of the ends of the sides opposite the corners, in order. Of a side of nearly 180°
    /// its rounded ends know neither the plane nor the sine.
    sides: [DVec3; 3],
    volume: f64,
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

/// `∫ max(0, n·ω) max(0, w·ω)ᵏ dω` over the fan of triangles from the first vertex, positive where they
/// are counter-clockwise; the lobe's highest cosine there is at least `peak`.
pub(crate) fn integral(vertices: &[DVec3], n: DVec3, w: DVec3, k: f64, peak: f64) -> f64 {
    let lobe = Lobe {
        n,
        w,
        k,
        least: if k > 0.0 && peak > 0.0 {
            k * peak.ln() - NOTHING
        } else {
            f64::NEG_INFINITY
        },
    };
    let corner = |at: DVec3| Corner {
        at,
        facing: dot(n, at),
        lobe: dot(w, at),
    };
    let first = vertices[0];
    let mut sum = 0.0;
    for pair in vertices[1..].windows(2) {
        let volume = volume(first, pair[0], pair[1]);
        if volume == 0.0 {
            continue;
        }
        let side = predicates::cross;
        let triangle = Triangle {
            corners: [corner(first), corner(pair[0]), corner(pair[1])],
            sides: [
                side(pair[0], pair[1]),
                side(pair[1], first),
                side(first, pair[0]),
            ],
            volume,
        };
        sum += lobe.above_horizon(triangle);
    }
    sum
}

/// The parts of a triangle with `value` ≥ 0, that is, above `plane`; `cut(i, j)` is the point of the side
/// from i to j where it vanishes. Of corners as they were `given`, products may be taken anew.
fn clip(
    triangle: Triangle,
    plane: DVec3,
    value: [f64; 3],
    cut: impl Fn(usize, usize) -> Corner,
    given: bool,
) -> [Option<Triangle>; 2] {
    let Triangle {
        corners,
        sides,
        volume,
    } = triangle;
    let above = value.map(|c| c >= 0.0);
    // What is kept of the side from i, above, to j, below; and the rest of it.
    let kept = |i: usize, j: usize| value[i] / (value[i] - value[j]);
    let lost = |i: usize, j: usize| -value[j] / (value[i] - value[j]);
    let odd = match above {
        [true, true, true] => return [Some(triangle), None],
        [false, false, false] => return [None; 2],
        [_, b, c] if b == c => 0,
        [a, _, c] if a == c => 1,
        _ => 2,
    };
    let (i, j, l) = (odd, (odd + 1) % 3, (odd + 2) % 3);
    if above[i] {
        let (right, left) = (kept(i, j), kept(i, l));
        let volume = volume * right * left;
        let part = Triangle {
            corners: [corners[i], cut(i, j), cut(i, l)],
            sides: [
                plane * (volume / value[i]),
                sides[j] * left,
                sides[l] * right,
            ],
            volume,
        };
        return [Some(part), None];
    }
    let (q, p) = (cut(j, i), cut(l, i));
    // By the cross products of exact corners, unless p is so near the shading point that they cancel.
    let (one, other) = (sides[i] * lost(l, i), sides[l] * kept(l, i));
    let terms = length(one) + length(other);
    let product = length(corners[j].at) * length(p.at);
    let diagonal = if terms < product {
        one - other
    } else {
        predicates::cross(corners[j].at, p.at)
    };
    // A diagonal of nearly 180° cancels in both; its halves share out the volume by its sine.
    let diagonal = if given && length(diagonal) < CANCELLED * terms.min(product) {
        cross_at_crossing(plane, corners[j].at, corners[l].at, corners[i].at)
    } else {
        diagonal
    };
    // The sides from j and l to i end at q and p; the four-sided rest is divided from j to p.
    let rest = volume * lost(l, i) * kept(j, i);
    [
        Some(Triangle {
            corners: [corners[j], corners[l], p],
            sides: [sides[j] * kept(l, i), -diagonal, sides[i]],
            volume: volume * kept(l, i),
        }),
        Some(Triangle {
            corners: [corners[j], p, q],
            sides: [plane * (rest / value[j]), sides[l] * kept(j, i), diagonal],
            volume: rest,
        }),
    ]
}

impl Lobe {
    fn above_horizon(&self, triangle: Triangle) -> f64 {
        let c = triangle.corners;
        let cut = |i: usize, j: usize| {
            let at = crossing(c[i].at, c[j].at, self.n, c[i].facing, c[j].facing);
            let span = c[j].facing - c[i].facing;
            let lobe = if c[i].lobe * c[j].lobe >= 0.0 {
                c[i].lobe * (c[j].facing / span) + c[j].lobe * (-c[i].facing / span)
            } else {
                value_at_crossing(self.w, self.n, c[i].at, c[j].at)
            };
            Corner {
                at,
                facing: 0.0,
                lobe,
            }
        };
        let parts = clip(triangle, self.n, c.map(|c| c.facing), cut, true);
        parts.into_iter().flatten().map(|t| self.above(t)).sum()
    }

    fn above(&self, triangle: Triangle) -> f64 {
        let c = triangle.corners;
        let cut = |i: usize, j: usize| {
            let span = c[j].lobe - c[i].lobe;
            let turn = if j == (i + 1) % 3 { 1.0 } else { -1.0 };
            let side = triangle.sides[3 - i - j] * turn;
            Corner {
                at: self.crossing_again(c[i], c[j], side),
                facing: c[i].facing * (c[j].lobe / span) + c[j].facing * (-c[i].lobe / span),
                lobe: 0.0,
            }
        };
        let parts = clip(triangle, self.w, c.map(|c| c.lobe), cut, false);
        parts.into_iter().flatten().map(|t| self.whole(t)).sum()
    }

    /// The greatest values of n·ω and w·ω.
    fn most(&self) -> [f64; 2] {
        [self.n.length(), self.w.length()]
    }

    /// A triangle that is above both horizons, by directions.
    fn whole(&self, triangle: Triangle) -> f64 {
        let lengths = triangle.corners.map(|c| length(c.at));
        if lengths.iter().any(|r| !(*r > 0.0)) {
            return 0.0;
        }
        let most = self.most();
        let corners = triangle.corners.map(|c| c.unit().at_most(most));
        let [a, b, c] = corners.map(|c| c.at);
        let direct = volume(a, b, c);
        // Where a cut is near the shading point, its distance is not known so well.
        let across = (b - a).length_squared().max((c - a).length_squared());
        let volume = if direct * direct > FAT * FAT * across {
            direct
        } else {
            triangle.volume / lengths[0] / lengths[1] / lengths[2]
        };
        let side = |i: usize| triangle.sides[i] / lengths[(i + 1) % 3] / lengths[(i + 2) % 3];
        let parts = Triangle {
            corners,
            sides: [side(0), side(1), side(2)],
            volume,
        };
        self.divided(parts, HALVINGS)
    }

    /// Where a side meets the lobe's own horizon: between its ends where one of them is rounded (on the
    /// surface's horizon), unless the cross product of the exact ones says more.
    fn crossing_again(&self, from: Corner, to: Corner, side: DVec3) -> DVec3 {
        if from.facing * to.facing > 0.0 {
            return crossing(from.at, to.at, self.w, from.lobe, to.lobe);
        }
        let span = to.lobe - from.lobe;
        // On the surface's own horizon the side is along n, and rounded; w may be, too, or nearly.
        if from.facing == 0.0 && to.facing == 0.0 {
            let share = dot(self.n, side) / self.n.length_squared();
            return predicates::cross(self.w, self.n) * (share / span);
        }
        // What the roundings of the ends and of the side are relative to.
        let ends = length(from.at) * to.lobe.abs() + length(to.at) * from.lobe.abs();
        if ends <= length(side) {
            return from.at * (to.lobe / span) + to.at * (-from.lobe / span);
        }
        predicates::cross(self.w, side) / span
    }

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
                Some(sweep) => triangle.volume * sweep.integral(),
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

    /// From the centre of the circumcircle, where that is inside: of half a sphere, the middle of the
    /// longest side may be opposite the third corner.
    fn thirds(&self, triangle: Triangle, rounds: u32) -> f64 {
        let corners = triangle.corners;
        let [a, b, c] = corners.map(|c| c.at);
        let normal = predicates::cross(b - a, c - a).normalize_or_zero();
        // Which pole is meant, and whether it is inside, rounded corners of (nearly) half a sphere do not
        // know: the triangle's orientation and its sides do.
        let turn = triangle.volume.signum();
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
                volume: volumes[(i + 2) % 3],
            };
            self.divided(part, rounds - 1)
        };
        third(0) + third(1) + third(2)
    }

    /// A corner from its direction alone.
    fn corner(&self, at: DVec3) -> Corner {
        Corner {
            at,
            facing: dot(self.n, at).max(0.0),
            lobe: dot(self.w, at).max(0.0),
        }
    }

    /// By the middle of the side opposite the first corner.
    fn halves(&self, triangle: Triangle, rounds: u32) -> f64 {
        let Triangle {
            corners: [a, b, c],
            sides: [across, left, right],
            volume: whole,
        } = triangle;
        let sine = length(across).min(1.0);
        let angle = sine.atan2(b.at.dot(c.at));
        let (half_sine, half_cosine) = (0.5 * angle).sin_cos();
        // By the side, for ends that are opposite do not know which way round it runs.
        let tangent = predicates::cross(across / sine, b.at);
        let weight = half_sine / sine;
        let middle = Corner {
            at: b.at * half_cosine + tangent * half_sine,
            ..b.blend(weight, c, weight)
        }
        .at_most(self.most());
        let inner = predicates::cross(a.at, middle.at);
        let half = |corners: [Corner; 3], [left, right]: [DVec3; 2]| {
            let part = Triangle {
                corners,
                sides: [across * weight, left, right],
                volume: whole * weight,
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
                (self.angle * (1.0 - u)).sin() / self.sine,
                (self.angle * u).sin() / self.sine,
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
            // The logarithm falls at least in proportion: halving finds the window but for a factor of two.
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
            let cosine = self.angle.cos();
            // The side's own highest point, and the arc through the axis.
            let foot = ((c.lobe - b.lobe * cosine) / self.sine).atan2(b.lobe) / self.angle;
            if foot > 0.0 && foot < 1.0 {
                offer(foot);
            }
            let across = predicates::cross(a, self.lobe.w);
            let [left, right] = [b, c].map(|c| predicates::dot(across, c.at));
            if left * right < 0.0 {
                let s = left.abs() * self.sine;
                offer(s.atan2(left.abs() * cosine + right.abs()) / self.angle);
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
        let (z0, z1) = (self.apex.lobe, end.lobe);
        let cosine = dot(self.apex.at, end.at);
        let sine = predicates::cross(self.apex.at, end.at).length();
        // The slopes at both ends, times the sine. On shorter arcs an end is as good, and slopes are noise.
        let (rise, fall) = (z1 - z0 * cosine, z0 - z1 * cosine);
        let high = if sine > 1e-7 && rise > 0.0 && fall > 0.0 {
            z0.hypot(rise / sine)
        } else {
            z0.max(z1)
        };
        self.lobe.k * high.ln()
    }

    /// The inner integral along the arc that ends at u.
    fn value(&self, u: f64) -> f64 {
        let end = self.edge(u);
        let Lobe { w, k, .. } = self.lobe;
        let values = [
            [self.apex.facing, end.facing],
            [0.0, 1.0],
            [self.apex.lobe, end.lobe],
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

    /// By halves until sixteen nodes on the whole and on both halves agree to 1e-8, so that the halves are
    /// right to 1e-13; to that itself where a power that is no integer ends on the triangle.
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
