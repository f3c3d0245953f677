//! Points of a light are drawn here in blocks of at most 64, before their visibility is queried.
//! They are drawn one by one, or in SIMD lanes, eight at a time, with the same bits.

use crate::draw::Source;
use crate::integrand::Integrand;
use crate::visible::Target;
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::{Emission, EmissionTexture, LightPoint, PointColumns, Surface};
use linelit_samplers::SampleSet;
use linelit_simd::{Isa, Lanes, Simd, dispatch};
use std::ops::Range;

/// The most points that are drawn before their visibility is queried, which gives one bit for each.
pub(crate) const BLOCK: u32 = u64::BITS;

const SIZE: usize = BLOCK as usize;

/// Fewer points than this are drawn faster one by one than in lanes.
pub(crate) const LEAST: usize = 3;

/// One number for each point of a block, eight in each row.
pub(crate) type Column = [[f64; 8]; SIZE / 8];

/// The points of one block that carry light. They have been drawn, and their visibility is not yet
/// known.
#[derive(Debug)]
pub(crate) struct PointBlock {
    len: usize,
    /// The light that each point contributes if it is visible, L f_r cos θ/p_ω.
    contributions: [DVec3; SIZE],
    /// The positions of the points, in the form that [`Target`] says.
    targets: [DVec3; SIZE],
    columns: Columns,
}

impl Default for PointBlock {
    fn default() -> Self {
        Self {
            len: 0,
            contributions: [DVec3::ZERO; SIZE],
            targets: [DVec3::ZERO; SIZE],
            columns: Columns::default(),
        }
    }
}

/// The points of a block in lanes. Rows that the block does not fill have values of blocks before
/// it.
#[derive(Debug, Default)]
struct Columns {
    /// The pairs of random numbers.
    u: [Column; 2],
    /// The points. Each vector here is three columns, one for each coordinate.
    point: [Column; 3],
    /// The densities of the points: first in the measure in which they were drawn, then per solid
    /// angle.
    density: Column,
    to_light: [Column; 3],
    direction: [Column; 3],
    cos_light: Column,
    contribution: [Column; 3],
}

impl PointBlock {
    pub(crate) const fn clear(&mut self) {
        self.len = 0;
    }

    /// The positions of the points, in the form that [`Target`] says.
    pub(crate) fn targets(&self) -> &[DVec3] {
        &self.targets[..self.len]
    }

    /// Adds a point, if it carries light and the block is not full.
    #[inline]
    pub(crate) fn push(&mut self, value: DVec3, density: f64, target: DVec3) {
        if density > 0.0 && value != DVec3::ZERO && self.len < SIZE {
            self.contributions[self.len] = value * (1.0 / density);
            self.targets[self.len] = target;
            self.len += 1;
        }
    }

    /// Adds the contributions of the points in a mask to a sum, one after the other.
    #[inline]
    pub(crate) fn add_to(&self, mut sum: DVec3, mut mask: u64) -> DVec3 {
        while mask != 0 {
            sum += self.contributions[mask.trailing_zeros() as usize];
            mask &= mask - 1;
        }
        sum
    }

    /// Draws points into the columns, by some numbers of a set, which are no more than a block
    /// ([`Source::sample_into`]). If the result is `None`, only the random numbers are in the
    /// columns.
    pub(crate) fn draw_columns(
        &mut self,
        source: Source<'_, '_>,
        set: &SampleSet,
        numbers: &Range<u32>,
    ) -> Option<bool> {
        let len = numbers.len().min(SIZE);
        let columns = &mut self.columns;
        let u = columns.u.each_mut();
        set.fill_2d(numbers.start, u.map(|u| &mut u.as_flattened_mut()[..len]));
        let rows = len.div_ceil(8);
        let out = PointColumns {
            point: columns.point.each_mut().map(|column| &mut column[..rows]),
            pdf: &mut columns.density[..rows],
        };
        source.sample_into(columns.u.each_ref().map(|column| &column[..rows]), out)
    }

    /// The pair of random numbers of a point in the columns.
    #[inline]
    pub(crate) fn numbers(&self, i: usize) -> [f64; 2] {
        self.columns.u.each_ref().map(|u| number(u, i))
    }

    /// The position of a point in the columns.
    #[inline]
    pub(crate) fn on_light(&self, i: usize) -> DVec3 {
        at(&self.columns.point, i)
    }

    /// Draws points in lanes, by some numbers of a set, which are no more than a block, and adds
    /// those that carry light. The result has the same bits as points that are drawn one by one.
    /// Returns `false`, without points, if the surface is not flat or the source cannot draw in
    /// lanes.
    pub(crate) fn draw_in_lanes<R: Reflection, T: EmissionTexture>(
        &mut self,
        integrand: &Integrand<'_, R, T>,
        surface: &Surface<'_>,
        source: Source<'_, '_>,
        set: &SampleSet,
        numbers: &Range<u32>,
        target: Target,
    ) -> bool {
        // Draw the points on the light.
        let Some(normal) = surface.flat() else {
            return false;
        };
        let Some(local) = self.draw_columns(source, set, numbers) else {
            return false;
        };
        // See them from the shading point, and find those that carry light.
        let len = numbers.len().min(SIZE);
        let point = integrand.point;
        let seen = KernelInput {
            x: point.position,
            normals: [point.normal, point.geometric_normal],
            light: normal,
            local,
            even: integrand.even(),
        };
        let mut carry = look(Isa::best(), &seen, len.div_ceil(8), &mut self.columns)
            & (u64::MAX >> (SIZE - len));
        // Add them to the block; for emission or reflection that varies, evaluate the integrand
        // first.
        let columns = &self.columns;
        let targets = match target {
            Target::ToLight => &columns.to_light,
            Target::Point => &columns.point,
        };
        while carry != 0 {
            let i = carry.trailing_zeros() as usize;
            carry &= carry - 1;
            let place = self.len % SIZE;
            self.targets[place] = at(targets, i);
            if seen.even.is_some() {
                self.contributions[place] = at(&columns.contribution, i);
                self.len += 1;
                continue;
            }
            let value = integrand.value(&columns.light_point(i));
            self.contributions[place] = value * (1.0 / number(&columns.density, i));
            self.len += usize::from(value != DVec3::ZERO);
        }
        true
    }
}

/// The number of a point in a column.
#[inline]
fn number(column: &Column, i: usize) -> f64 {
    column[i / 8 % column.len()][i % 8]
}

/// The vector of a point in three columns.
#[inline]
fn at([x, y, z]: &[Column; 3], i: usize) -> DVec3 {
    DVec3::new(number(x, i), number(y, i), number(z, i))
}

impl Columns {
    /// Returns one point, after the kernel has seen it from the shading point.
    fn light_point(&self, i: usize) -> LightPoint {
        let to_light = at(&self.to_light, i);
        LightPoint {
            point: at(&self.point, i),
            to_light,
            direction: at(&self.direction, i),
            square: to_light.length_squared(),
            cos_light: number(&self.cos_light, i),
        }
    }
}

/// A shading point and a flat light, in the form that the kernel takes.
struct KernelInput {
    x: DVec3,
    /// The normals of the horizons, the shading normal first.
    normals: [DVec3; 2],
    /// The light's normal.
    light: DVec3,
    /// Whether densities are per area, not per solid angle.
    local: bool,
    /// Emission times reflection, if both are the same everywhere.
    even: Option<Emission>,
}

/// Sees the points of some rows from the shading point, with the bits of [`LightPoint::towards`],
/// and of [`ShadingPoint::reflected`](crate::ShadingPoint::reflected) where emission and reflection
/// are uniform. Returns a bit for each point that carries light; if emission or reflection varies,
/// for each point with positive density.
#[inline(always)]
fn look_kernel<S: Simd>(s: S, seen: &KernelInput, rows: usize, columns: &mut Columns) -> u64 {
    let mut carry = 0;
    for row in 0..rows.min(SIZE / 8) {
        let zero = s.dsplat(0.0);
        // Find the vector to each point, its direction, and the cosine at the light.
        let [px, py, pz] = load(s, &columns.point, row);
        let to_light = [px - seen.x.x, py - seen.x.y, pz - seen.x.z];
        let square = dot(s, to_light, to_light);
        let direction = seen.direction(s, to_light, square);
        let cos_light = along(s, seen.light, direction) * -1.0;
        // Convert a density per area into a density per solid angle, which is zero where it would
        // overflow.
        let mut density = s.dload(&columns.density[row]);
        if seen.local {
            density = density * square / s.dmax(cos_light, cos_light * -1.0);
            let usable = s.dlt(zero, density) & s.dle(density, s.dsplat(f64::MAX));
            density = s.select(usable, zero, density);
        }
        store(s, to_light, &mut columns.to_light, row);
        // Find the contribution where it is uniform; otherwise store what the integrand needs.
        let mut carries = s.dlt(zero, density);
        if let Some(even) = &seen.even {
            let (value, some) = seen.reflected(s, even, direction, cos_light);
            let inverse = s.dsplat(1.0) / density;
            let [r, g, b] = value;
            let contribution = [r * inverse, g * inverse, b * inverse];
            store(s, contribution, &mut columns.contribution, row);
            carries = carries & some;
        } else {
            store(s, direction, &mut columns.direction, row);
            s.dstore(cos_light, &mut columns.cos_light[row]);
            s.dstore(density, &mut columns.density[row]);
        }
        carry |= u64::from(s.bits(carries)) << (8 * row);
    }
    carry
}
dispatch! {
    fn look = look_kernel(seen: &KernelInput, rows: usize, columns: &mut Columns) -> u64
}

impl KernelInput {
    /// The unit vectors to points, with the rounding that points of either measure have one by one.
    #[inline(always)]
    fn direction<S: Simd>(&self, s: S, [x, y, z]: [S::D; 3], square: S::D) -> [S::D; 3] {
        let length = s.dsqrt(square);
        if self.local {
            return [x / length, y / length, z / length];
        }
        let (zero, inverse) = (s.dsplat(0.0), s.dsplat(1.0) / length);
        let usable = s.dlt(zero, inverse) & s.dle(inverse, s.dsplat(f64::MAX));
        [
            s.select(usable, zero, x * inverse),
            s.select(usable, zero, y * inverse),
            s.select(usable, zero, z * inverse),
        ]
    }

    /// Returns the light that uniform emission causes to be reflected to the viewer, and where it
    /// is not zero.
    #[inline(always)]
    fn reflected<S: Simd>(
        &self,
        s: S,
        even: &Emission,
        direction: [S::D; 3],
        cos_light: S::D,
    ) -> ([S::D; 3], S::M) {
        let zero = s.dsplat(0.0);
        let [shading, geometric] = self.normals;
        let cosine = s.dmax(along(s, shading, direction), zero);
        let above = s.dlt(zero, along(s, geometric, direction)) & s.dlt(zero, cosine);
        let mut emits = s.dlt(zero, cos_light);
        if even.two_sided {
            emits = emits | s.dlt(cos_light, zero);
        }
        let DVec3 { x, y, z } = even.radiance;
        let (r, g, b) = (cosine * x, cosine * y, cosine * z);
        let none = is_zero(s, r) & is_zero(s, g) & is_zero(s, b);
        ([r, g, b], above & emits & !none)
    }
}

#[inline(always)]
fn is_zero<S: Simd>(s: S, a: S::D) -> S::M {
    s.dle(a, s.dsplat(0.0)) & s.dle(s.dsplat(0.0), a)
}

#[inline(always)]
fn load<S: Simd>(s: S, [x, y, z]: &[Column; 3], row: usize) -> [S::D; 3] {
    [s.dload(&x[row]), s.dload(&y[row]), s.dload(&z[row])]
}

#[inline(always)]
fn store<S: Simd>(s: S, a: [S::D; 3], [x, y, z]: &mut [Column; 3], row: usize) {
    s.dstore(a[0], &mut x[row]);
    s.dstore(a[1], &mut y[row]);
    s.dstore(a[2], &mut z[row]);
}

/// The dot product, in the order of glam's.
#[inline(always)]
fn dot<L: Lanes>(_: L, a: [L::D; 3], b: [L::D; 3]) -> L::D {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The dot product with the same vector in all lanes.
#[inline(always)]
fn along<L: Lanes>(_: L, a: DVec3, b: [L::D; 3]) -> L::D {
    b[0] * a.x + b[1] * a.y + b[2] * a.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ShadingPoint;
    use linelit_bsdf::{Bsdf, Lambert};
    use linelit_geometry::ConvexPolygon;
    use linelit_lights::{Area, Pdf, SolidAngle};
    use linelit_simd::InstructionSet;
    use linelit_testkit::rng::SplitMix64;

    fn bits(v: DVec3) -> [u64; 3] {
        v.to_array().map(f64::to_bits)
    }

    /// Random columns: points before and behind the light's plane and the horizons, on the shading
    /// point, at no place; densities that are zero or no number.
    fn columns(rng: &mut SplitMix64, x: DVec3) -> Columns {
        let mut out = Columns::default();
        for i in 0..SIZE {
            let point = match i {
                3 => x,
                11 => DVec3::NAN,
                17 => DVec3::new(1e200, 0.0, 1.0),
                _ => DVec3::from([0, 1, 2].map(|_| rng.in_range(-1.0, 1.0))),
            };
            for (column, coordinate) in out.point.iter_mut().zip(point.to_array()) {
                column.as_flattened_mut()[i] = coordinate;
            }
            let densities = [rng.next_f64(), 0.0, f64::MIN_POSITIVE, f64::MAX];
            out.density.as_flattened_mut()[i] = densities[usize::from(i % 9 == 0) + i / 60];
        }
        out
    }

    /// Returns a point computed by itself, with its density per area, or per solid angle.
    fn one_by_one(
        columns: &Columns,
        quad: &ConvexPolygon,
        x: DVec3,
        i: usize,
        local: bool,
    ) -> (LightPoint, f64) {
        let (point, density) = (at(&columns.point, i), number(&columns.density, i));
        let to_light = point - x;
        let direction = match local {
            true => to_light / to_light.length(),
            false => to_light.normalize_or_zero(),
        };
        let seen = LightPoint::towards(point, to_light, direction, &Surface::Polygon(quad));
        let density = match local {
            true => seen.density(Pdf::<Area>::new(density)),
            false => Pdf::<SolidAngle>::new(density).value(),
        };
        (seen, density)
    }

    #[test]
    fn lanes_give_the_bits_of_points_one_by_one() {
        let mut rng = SplitMix64::new(5);
        for round in 0..200 {
            let mut v = || DVec3::from([0, 1, 2].map(|_| rng.in_range(-1.0, 1.0)));
            let (x, n, g) = (v(), v().normalize(), v().normalize());
            let quad = ConvexPolygon::parallelogram(v(), v(), v()).expect("one");
            let albedo = v().abs() * f64::from(round % 5);
            let bsdf = Bsdf::Lambert(Lambert { albedo });
            let mut point = ShadingPoint::new(x, n, n, bsdf);
            point.geometric_normal = g;
            let emission = Emission {
                radiance: v().abs(),
                two_sided: round % 3 == 0,
            };
            let drawn = columns(&mut rng, x);
            let (local, is_even) = (round % 2 == 0, round % 7 > 2);
            let f = point.known().constant().expect("Lambert");
            let seen = KernelInput {
                x,
                normals: [point.normal, point.geometric_normal],
                light: quad.normal(),
                local,
                even: is_even.then_some(Emission {
                    radiance: emission.radiance * f,
                    ..emission
                }),
            };
            for set in InstructionSet::ALL.into_iter().filter(|s| s.is_available()) {
                let mut got = Columns {
                    point: drawn.point,
                    density: drawn.density,
                    ..Columns::default()
                };
                let carry = look(Isa::detect(set), &seen, SIZE / 8, &mut got);
                for i in 0..SIZE {
                    let (want, density) = one_by_one(&drawn, &quad, x, i, local);
                    let value = point.reflected(emission.towards(want.cos_light), want.direction);
                    let carries = density > 0.0 && (!is_even || value != DVec3::ZERO);
                    assert_eq!(carry >> i & 1 == 1, carries, "{set} {round} {i}");
                    if !carries {
                        continue;
                    }
                    assert_eq!(bits(at(&got.to_light, i)), bits(want.to_light));
                    if is_even {
                        let contribution = value * (1.0 / density);
                        assert_eq!(bits(at(&got.contribution, i)), bits(contribution));
                        continue;
                    }
                    let seen = got.light_point(i);
                    assert_eq!(bits(seen.direction), bits(want.direction));
                    assert_eq!(seen.cos_light.to_bits(), want.cos_light.to_bits());
                    assert_eq!(seen.square.to_bits(), want.square.to_bits());
                    assert_eq!(number(&got.density, i).to_bits(), density.to_bits());
                }
            }
        }
    }
}
