//! Every closed form over a polygon against adaptive quadrature of what it is defined as, in polar
//! coordinates about the point of its plane below the shading point: ordinary polygons, slivers,
//! far ones, and from (nearly) their plane.

use linelit_bsdf::Fresnel;
use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_geometry::{DVec3, Frame};
use linelit_shading::ltc::Ltc;
use linelit_shading::{phong_polygon, polygon, solid_angle};
use linelit_testkit::assert_close;
use linelit_testkit::cases::cases;
use linelit_testkit::quadrature::{gauss_kronrod_to, gauss_legendre};
use linelit_testkit::strategies::{convex_polygon_2d, unit_vector};
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

/// Relative tolerances along a ray from the foot, and over the rays.
const INNER: f64 = 1e-13;
const OUTER: f64 = 1e-11;
/// The number of pieces towards an azimuth with a kink, each of which is the fraction `STEP` of the
/// one before.
const GRADES: i32 = 8;
const STEP: f64 = 1.0 / 64.0;
/// Of an integrand of at most one, at a direction of four roundings.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The fitted lobe of microfacets, for a direction at this cosine in the xz plane.
pub(crate) fn facets(roughness: f64, cosine: f64) -> Ltc {
    let wo = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let lobe =
        TrowbridgeReitz::isotropic(roughness * roughness).transformed_cosine(&Fresnel::Full, wo);
    Ltc::new(lobe.map, lobe.albedo.x)
}

/// A convex polygon in the plane z = `height`.
#[derive(Clone, Debug)]
struct Shape {
    corners: Vec<[f64; 2]>,
    height: f64,
    /// The quadrature's own ends are off by this, relative to how far they are apart.
    rounding: f64,
}

impl Shape {
    fn vertices(&self) -> Vec<DVec3> {
        self.corners
            .iter()
            .map(|p| DVec3::new(p[0], p[1], self.height))
            .collect()
    }

    /// The distances at which a ray from the foot enters and leaves.
    fn chord(&self, [c, s]: [f64; 2]) -> Option<[f64; 2]> {
        let mut hits = Vec::new();
        for (a, b) in self.sides() {
            let side = |p: [f64; 2]| c * p[1] - s * p[0];
            let (da, db) = (side(a), side(b));
            if (da < 0.0) != (db < 0.0) {
                let t = da / (da - db);
                let at = [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
                hits.push(c * at[0] + s * at[1]);
            }
        }
        hits.retain(|r| *r > 0.0);
        hits.sort_by(f64::total_cmp);
        match hits[..] {
            [] => None,
            [far] => Some([0.0, far]),
            [near, .., far] => Some([near, far]),
        }
    }

    fn sides(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().copied().zip(next.copied())
    }

    /// ∫ f dω along a ray from the foot, by azimuth, where k·ω > 0 for all `planes`.
    fn along(&self, azimuth: f64, planes: &[DVec3], f: impl Fn(DVec3) -> f64) -> f64 {
        let (s, c) = azimuth.sin_cos();
        let Some([near, far]) = self.chord([c, s]) else {
            return 0.0;
        };
        let height = self.height;
        // dω = sin t dt dφ, for tan t = r/h.
        let value = |r: f64| {
            let slant = r.hypot(height);
            let (out, up) = (r / slant, height / slant);
            let w = DVec3::new(out * c, out * s, up);
            let lit = planes.iter().all(|k| k.dot(w) > 0.0);
            if lit {
                [f(w) * out, up, slant]
            } else {
                [0.0, up, slant]
            }
        };
        let mut marks = vec![near, far];
        // Where a horizon is met.
        marks.extend(planes.iter().map(|k| -k.z * height / (k.x * c + k.y * s)));
        marks.retain(|r| *r >= near && *r <= far);
        marks.sort_by(f64::total_cmp);
        let pieces = marks.windows(2).filter(|p| p[0] < p[1]);
        let integral = |p: &[f64]| {
            let (s0, s1) = (p[0].hypot(height), p[1].hypot(height));
            // Its solid angle, cos t₀ − cos t₁ without cancellation: what rounding is relative to.
            let solid = height / s0 * ((p[1] - p[0]) / s1) * ((p[1] + p[0]) / (s0 + s1));
            let rounding = ROUNDING * solid;
            if p[1] > 16.0 * p[0] {
                // Over powers of ten: r = h sinh q, dt = dq/cosh q.
                let by_log = |q: f64| {
                    let [value, up, _] = value(height * q.sinh());
                    value * up
                };
                let [from, to] = [p[0], p[1]].map(|r| (r / height).asinh());
                // Near the foot is most, of a range of up to 600.
                let ends = (0..10).map(|j| to.min(from + 2f64.powi(j + 1)));
                let (mut last, mut sum) = (from, 0.0);
                for end in ends {
                    if end <= last {
                        break;
                    }
                    sum += gauss_kronrod_to(by_log, last, end, INNER, rounding).value;
                    last = end;
                }
                sum
            } else {
                let by_distance = |r: f64| {
                    let [value, up, slant] = value(r);
                    value * up / slant
                };
                gauss_kronrod_to(by_distance, p[0], p[1], INNER, rounding).value
            }
        };
        pieces.map(integral).sum()
    }

    /// ∫ f(ω) dω where k·ω > 0 for all `planes`, and a bound of the error; `whole` is the solid
    /// angle, horizons or not, for an integrand of at most one.
    fn integral(&self, whole: f64, planes: &[DVec3], f: impl Fn(DVec3) -> f64) -> (f64, f64) {
        // Azimuths with a kink: of corners, and of a horizon where it leaves by a side, meets
        // another, and is far away.
        let mut kinks: Vec<[f64; 2]> = self.corners.clone();
        for (i, k) in planes.iter().enumerate() {
            let above = |p: [f64; 2]| k.x * p[0] + k.y * p[1] + k.z * self.height;
            for (a, b) in self.sides() {
                let (ka, kb) = (above(a), above(b));
                if (ka < 0.0) != (kb < 0.0) {
                    let t = ka / (ka - kb);
                    kinks.push([0, 1].map(|i| a[i] + t * (b[i] - a[i])));
                }
            }
            for m in &planes[..i] {
                let both = k.cross(*m);
                kinks.extend([[both.x, both.y], [-both.x, -both.y]]);
            }
            kinks.extend([[-k.y, k.x], [k.y, -k.x]]);
        }
        let azimuth = |p: &[f64; 2]| p[1].atan2(p[0]).rem_euclid(TAU);
        let mut marks: Vec<f64> = kinks.iter().map(azimuth).collect();
        marks.sort_by(f64::total_cmp);
        marks.push(marks[0] + TAU);
        // Smaller and smaller towards each: next to a horizon that is as good as upright, much
        // happens.
        let graded = |p: &[f64]| {
            let half = 0.5 * (p[1] - p[0]);
            let (from, to) = (p[0], p[1]);
            let steps = (0..GRADES).flat_map(move |j| {
                let far = half * STEP.powi(j);
                let near = if j + 1 < GRADES { far * STEP } else { 0.0 };
                [(from + near, from + far), (to - far, to - near)]
            });
            steps.collect::<Vec<_>>()
        };
        let pieces: Vec<(f64, f64)> = marks.windows(2).flat_map(graded).collect();
        // Coarsely at first, so that what is small is not followed further than the sum needs.
        let sum = |pieces: &[(f64, f64)], relative: f64, absolute: f64| {
            let pieces = pieces.iter().filter(|p| p.0 < p.1);
            pieces.fold((0.0, 0.0), |(value, error), p| {
                let along = |azimuth| self.along(azimuth, planes, &f);
                let e = gauss_kronrod_to(along, p.0, p.1, relative, absolute);
                (value + e.value, error + e.error)
            })
        };
        let whole_pieces: Vec<(f64, f64)> = marks.windows(2).map(|p| (p[0], p[1])).collect();
        let (coarse, _) = sum(&whole_pieces, 0.1, ROUNDING * whole);
        let needed = (OUTER * coarse).max(4.0 * ROUNDING * whole);
        let (value, error) = sum(&pieces, OUTER, needed / pieces.len() as f64);
        (value, error + OUTER * value)
    }

    /// `whole` is the solid angle, horizons or not, for an integrand of at most one.
    fn compare(&self, name: &str, got: f64, goal: f64, whole: f64, (want, error): (f64, f64)) {
        // Sum the errors of the integrand, of the integrals along rays, and of the integral over
        // the rays.
        let own = 6.0 * ROUNDING * whole;
        // Below that, digits are lost to the range of numbers.
        let tolerance = error + own + (goal + self.rounding) * want + 1e-290;
        assert_close!(got, want, tolerance, "{name}: {self:?}");
    }
}

/// The nearest that the light's plane is, by its power of ten: below 1e-280 of the polygon's size,
/// so are cosines with roundings that have to be known.
const NEAREST: f64 = -280.0;

/// Ordinary ones, slivers, far ones, and from nearly their plane, the foot inside or outside.
fn shape(nearest: f64) -> impl Strategy<Value = Shape> {
    let place = (-3.0..3.0f64, -3.0..3.0f64, any::<bool>());
    let squash = prop_oneof![Just(0.0), -5.0..0.0f64];
    let height = prop_oneof![2 => -2.0..4.0f64, 1 => -15.0..-2.0f64, 1 => nearest..-15.0f64];
    (convex_polygon_2d(), place, squash, height).prop_map(
        |(corners, (x, y, inside), squash, height)| {
            let (x, y) = if inside { (0.1 * x, 0.1 * y) } else { (x, y) };
            let squash = 10f64.powf(squash);
            let place = |p: &[f64; 2]| [p[0] + x, squash * p[1] + y];
            Shape {
                corners: corners.iter().map(place).collect(),
                height: 10f64.powf(height),
                // Ends at up to 5 of the foot, between sides that are 0.02 of the width apart at
                // least.
                rounding: 8.0 * f64::EPSILON * 5.0 / (0.02 * squash),
            }
        },
    )
}

/// A shape and a normal, which is arbitrary, nearly the normal of its plane, or has a horizon that
/// passes close to a corner.
fn lit(nearest: f64) -> impl Strategy<Value = (Shape, DVec3)> {
    (shape(nearest), unit(), 0..4u8, -13.0..-1.0f64).prop_map(|(shape, away, kind, little)| {
        let little = 10f64.powf(little);
        let corner = shape.vertices()[0].normalize();
        let n = match kind {
            0 => (DVec3::Z + away * little).normalize(),
            1 => (away - corner * (corner.dot(away) - little)).normalize(),
            _ => away,
        };
        (shape, n)
    })
}

fn unit() -> impl Strategy<Value = DVec3> {
    unit_vector().prop_map(DVec3::from_array)
}

/// A shape, a normal and an axis: any, the normal but for little, or one whose horizon passes at
/// little from a corner.
fn lit_and_axis() -> impl Strategy<Value = (Shape, DVec3, DVec3)> {
    (lit(NEAREST), unit(), 0..4u8, -18.0..-1.0f64).prop_map(|((shape, n), away, kind, little)| {
        let little = 10f64.powf(little);
        let corner = shape.vertices()[1].normalize();
        let w = match kind {
            0 => (n + away * little).normalize(),
            1 => (away - corner * (corner.dot(away) - little)).normalize(),
            _ => away,
        };
        (shape, n, w)
    })
}

/// What the error of a lobe over a polygon is relative to.
fn most(corners: &[DVec3], n: DVec3, k: f64) -> f64 {
    polygon::irradiance(corners, n).min(TAU / (k + 2.0))
}

/// Returns the effect of rounded ends of lines for a polygon next to the shading point, as the doc
/// of [`phong_polygon::irradiance`] derives it: 8 ε times the distance of the farthest vertex over
/// the distance of the nearest point.
fn next_to_the_point(shape: &Shape) -> f64 {
    let next = shape.corners.iter().cycle().skip(1);
    let edges: Vec<_> = shape.corners.iter().zip(next).collect();
    let across = |([ax, ay], [bx, by]): (&[f64; 2], &[f64; 2])| ax * by - ay * bx;
    let is_inside = [1.0, -1.0]
        .iter()
        .any(|side| edges.iter().all(|e| side * across(*e) >= 0.0));
    // The distance of an edge from the foot, without differences that cancel.
    let distance = |(a, b): (&[f64; 2], &[f64; 2])| {
        let along = [b[0] - a[0], b[1] - a[1]];
        let at = |p: &[f64; 2]| p[0] * along[0] + p[1] * along[1];
        match at(a) < 0.0 && at(b) > 0.0 {
            true => across((a, b)).abs() / along[0].hypot(along[1]),
            false => a[0].hypot(a[1]).min(b[0].hypot(b[1])),
        }
    };
    let foot = edges
        .iter()
        .map(|e| distance(*e))
        .fold(f64::INFINITY, f64::min);
    let near = shape.height.hypot(if is_inside { 0.0 } else { foot });
    let far = shape
        .corners
        .iter()
        .map(|c| c[0].hypot(c[1]))
        .fold(shape.height, f64::max);
    8.0 * f64::EPSILON * far / near
}

/// ∫ max(0, w·ω)ᵏ n·ω dω over a convex polygon above the horizon of n, and a bound of the error, in
/// polar coordinates about the axis w: however narrow the lobe, its peak is at zero.
fn about_the_axis(corners: &[DVec3], n: DVec3, w: DVec3, k: f64) -> (f64, f64) {
    let (frame, most) = (Frame::from_normal(w), most(corners, n, k));
    let local: Vec<DVec3> = corners.iter().map(|p| frame.to_local(*p)).collect();
    let facing = frame.to_local(n);
    let next = local.iter().cycle().skip(1);
    let planes: Vec<DVec3> = local.iter().zip(next).map(|(a, b)| a.cross(*b)).collect();
    let turn = planes[0].dot(local[2]).signum();
    // The lobe's values further from the axis are below e⁻⁵⁰.
    let widest = (-50.0 / k).exp().acos();
    let inner = |azimuth: f64| {
        let (s, c) = azimuth.sin_cos();
        let out = DVec3::new(c, s, 0.0);
        let (mut low, mut high) = (0.0f64, widest);
        for plane in planes.iter().map(|plane| *plane * turn) {
            // Inside where p cos θ + q sin θ is positive: up to, or from, one angle.
            let (p, q) = (plane.z, plane.dot(out));
            let zero = if q > 0.0 { (-p).atan2(q) } else { p.atan2(-q) };
            match q > 0.0 {
                true => low = low.max(zero),
                false => high = high.min(zero),
            }
        }
        if low >= high {
            return 0.0;
        }
        let along = facing.dot(out);
        let value = |t: f64| {
            let (s, c) = t.sin_cos();
            (0.5 * k * (-s * s).ln_1p()).exp() * s * (facing.z * c + along * s)
        };
        gauss_kronrod_to(value, low, high, INNER, INNER * most).value
    };
    let mut marks: Vec<f64> = local.iter().map(|p| p.y.atan2(p.x)).collect();
    marks.extend([-PI, PI]);
    // Where a side leaves the range of the lobe.
    for plane in &planes {
        let (tilt, flat) = (plane.y.atan2(plane.x), plane.x.hypot(plane.y));
        let ratio = -plane.z / flat / widest.tan();
        if ratio.abs() <= 1.0 {
            let turn = |azimuth: f64| (azimuth + PI).rem_euclid(TAU) - PI;
            marks.extend([turn(tilt + ratio.acos()), turn(tilt - ratio.acos())]);
        }
    }
    marks.sort_by(f64::total_cmp);
    let pieces = marks.windows(2).filter(|m| m[0] < m[1]);
    pieces.fold((0.0, 0.0), |(value, error), m| {
        let e = gauss_kronrod_to(inner, m[0], m[1], OUTER, OUTER * most);
        (value + e.value, error + e.error)
    })
}

/// ∫ max(0, w·ω)ᵏ n·ω dω over a convex polygon on which the lobe is smooth, by Gauss' rule over the
/// triangles of a fan.
fn in_the_plane(corners: &[DVec3], n: DVec3, w: DVec3, k: f64) -> f64 {
    let (rule, a) = (gauss_legendre(40), corners[0]);
    let value = |p: DVec3| {
        let square = p.length_squared();
        let log = 0.5 * (-w.cross(p).length_squared() / square).ln_1p();
        let power = if w.dot(p) > 0.0 { (k * log).exp() } else { 0.0 };
        n.dot(p) * power / (square * square)
    };
    let triangle = |pair: &[DVec3]| {
        let [u, v] = [pair[0] - a, pair[1] - a];
        let line =
            |t: f64| rule.integrate(0.0, 1.0, |s| t * value(a + (u * (1.0 - s) + v * s) * t));
        u.cross(v).dot(a).abs() * rule.integrate(0.0, 1.0, line)
    };
    corners[1..].windows(2).map(triangle).sum()
}

/// What of a convex polygon is where `height` is not negative.
fn above(corners: &[[f64; 2]], height: impl Fn([f64; 2]) -> f64) -> Vec<[f64; 2]> {
    let next = corners.iter().cycle().skip(1);
    let mut kept = Vec::new();
    for (a, b) in corners.iter().zip(next) {
        let (ha, hb) = (height(*a), height(*b));
        if ha >= 0.0 {
            kept.push(*a);
        }
        if (ha < 0.0) != (hb < 0.0) {
            let t = ha / (ha - hb);
            kept.push([0, 1].map(|i| a[i] + t * (b[i] - a[i])));
        }
    }
    kept
}

/// ∫∫ max(0, y) max(0, h)ᵏ dx dy over a convex polygon, h = c·(x, y) for a unit vector c, by
/// Stokes' theorem: with the coordinate g across h, y = c₁ h + c₀ g is the derivative of c₁ h g +
/// c₀ g²/2.
fn flat_lobe(corners: &[[f64; 2]], c: [f64; 2], k: f64) -> f64 {
    let height = |p: [f64; 2]| c[0] * p[0] + c[1] * p[1];
    let across = |p: [f64; 2]| c[0] * p[1] - c[1] * p[0];
    let lit = above(&above(corners, |p| p[1]), height);
    let side = |(a, b): (&[f64; 2], &[f64; 2])| {
        let sign = if height(*a) < height(*b) { 1.0 } else { -1.0 };
        let [a, b] = if sign > 0.0 { [*a, *b] } else { [*b, *a] };
        // From the lower end by the eighth root, which makes any power smooth.
        let value = |root: f64| {
            let t = root.powi(8);
            let [h, g] = [height(a), across(a)];
            let [h, g] = [h + t * (height(b) - h), g + t * (across(b) - g)];
            8.0 * root.powi(7) * (c[1] * h + 0.5 * c[0] * g) * g * h.max(0.0).powf(k)
        };
        sign * (height(b) - height(a)) * gauss_kronrod_to(value, 0.0, 1.0, INNER, INNER).value
    };
    let next = lit.iter().cycle().skip(1);
    lit.iter().zip(next).map(side).sum::<f64>().abs()
}

fn config(usual: u32) -> ProptestConfig {
    ProptestConfig {
        cases: cases(usual),
        max_global_rejects: u32::MAX,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config(30))]

    #[test]
    fn diffuse_and_solid_angle((shape, n) in lit(NEAREST), scale in -400..400i32) {
        let corners = shape.vertices();
        let solid = shape.integral(0.0, &[], |_| 1.0);
        let whole = solid_angle::polygon(&corners);
        shape.compare("solid angle", whole, 1e-12, 0.0, solid);
        let diffuse = shape.integral(whole, &[n], |w| n.dot(w));
        shape.compare("polygon", polygon::irradiance(&corners, n), 1e-12, whole, diffuse);
        if let [a, b, c] = corners[..] {
            shape.compare("triangle", solid_angle::triangle(a, b, c), 1e-12, 0.0, solid);
        }
        // Tiny and huge, if their coordinates are within the range.
        let scale = if shape.height < 1e-15 { scale.abs() } else { scale };
        let far: Vec<DVec3> = corners.iter().map(|p| *p * 2f64.powi(scale)).collect();
        shape.compare("scaled", polygon::irradiance(&far, n), 1e-12, whole, diffuse);
        shape.compare("scaled solid angle", solid_angle::polygon(&far), 1e-12, 0.0, solid);
    }
}

proptest! {
    #![proptest_config(config(8))]

    #[test]
    fn lobes((shape, n, w) in lit_and_axis(), k in prop_oneof![0.0..4.0f64, 4.0..60.0f64, (0..60i32).prop_map(f64::from)], scale in -400..400i32) {
        let corners = shape.vertices();
        let whole = solid_angle::polygon(&corners);
        let (want, error) = shape.integral(whole, &[n, w], |d| n.dot(d) * w.dot(d).max(0.0).powf(k));
        let want = (want, error + (1e-10 + next_to_the_point(&shape)) * most(&corners, n, k));
        shape.compare("phong_polygon", phong_polygon::irradiance(&corners, n, w, k), 0.0, whole, want);
        let scale = if shape.height < 1e-15 { scale.abs() } else { scale };
        let far: Vec<DVec3> = corners.iter().map(|p| *p * 2f64.powi(scale)).collect();
        shape.compare("scaled", phong_polygon::irradiance(&far, n, w, k), 0.0, whole, want);
    }

    /// Mapped corners are rounded by η = 7 roundings × the map's condition (below 1e4) of their
    /// distance, and a polygon by 80 η over its height and width.
    #[test]
    fn transformed_cosines((shape, n) in lit(NEAREST), roughness in 0.1..1.0f64, cosine in 0.05..1.0f64) {
        let corners = shape.vertices();
        let frame = Frame::from_normal(n);
        let lobe = facets(roughness, cosine);
        let goal = 80.0 * 7.0 * f64::EPSILON * 1e4 * 5.0 / shape.height.min(1.0) * (1.0 + shape.rounding / f64::EPSILON / 2000.0);
        prop_assume!(goal < 1e-5);
        let own = frame.to_world(lobe.map().inverse().transpose() * DVec3::Z);
        let (value, error) = shape.integral(0.0, &[n, own], |w| lobe.albedo * lobe.density(frame.to_local(w)));
        // Relative to the whole lobe where only its foot is met.
        let error = error + goal * value + goal * 1e-3 * lobe.albedo;
        shape.compare("Ltc::polygon", lobe.polygon(&frame, &corners), 0.0, 0.0, (value, error));
    }
}

proptest! {
    #![proptest_config(config(300))]

    /// Lights of all sizes, in the lobe, at its edge and beyond.
    #[test]
    fn narrow_lobes(
        corners in convex_polygon_2d(),
        (centre, n) in (unit(), unit()),
        size in -8.0..0.3f64,
        (away, widths) in (unit(), 0.0..12.0f64),
        power in 0.8..5.0f64,
    ) {
        let (frame, size, k) = (Frame::from_normal(centre), 10f64.powf(size), 10f64.powf(power));
        let at = |p: &[f64; 2]| frame.to_world(DVec3::new(size * p[0], size * p[1], 1.0));
        let corners: Vec<DVec3> = corners.iter().map(at).collect();
        let n = if n.dot(centre) < 0.0 { -n } else { n };
        prop_assume!(corners.iter().all(|p| n.dot(*p) > 0.0));
        let w = (centre + away * (widths / (k + 1.0).sqrt())).normalize();
        let got = phong_polygon::irradiance(&corners, n, w, k);
        let most = most(&corners, n, k);
        let (want, error) = if size < 1e-2 {
            // Cosines with n are rounded.
            let least = corners.iter().map(|p| n.dot(*p)).fold(1.0, f64::min);
            (in_the_plane(&corners, n, w, k), 8.0 * f64::EPSILON / least * most)
        } else {
            // Planes of sides turn by the rounding of corners, here by some 30 ε.
            let (want, error) = about_the_axis(&corners, n, w, k);
            (want, error + 30.0 * f64::EPSILON / size.min(1.0) * most)
        };
        let tolerance = error + 1e-10 * most;
        assert_close!(got, want, tolerance, "{corners:?} {n} {w} {k}");
    }
}

proptest! {
    #![proptest_config(config(200))]

    /// A speck is a point: its solid angle times the integrand at its middle, but for the square of
    /// its size in widths of the lobe.
    #[test]
    fn specks_are_points(centre in unit(), n in unit(), w in unit(), size in -300.0..-4.0f64, k in 0.0..1e3f64) {
        let (frame, size) = (Frame::from_normal(centre), 10f64.powf(size).max(1e-13));
        prop_assume!(n.dot(centre) > 0.1 && w.dot(centre) > 0.5);
        let corners = [(-2.0, -1.0), (1.0, -1.0), (1.0, 2.0)]
            .map(|(x, y)| frame.to_world(DVec3::new(size * x, size * y, 1.0)));
        let solid = solid_angle::polygon(&corners);
        let want = solid * n.dot(centre) * w.dot(centre).powf(k);
        // Second derivatives of logarithms are below 1/0.1², and (k + 3)(1 + 1/0.5²); corners are
        // rounded.
        let tolerance = (100.0 + 5.0 * (k + 3.0) + 4.0 * k * k) * 4.0 * size * size
            + (8.0 * k + 50.0) * f64::EPSILON + 4.0 * k * f64::EPSILON / 0.5;
        let got = phong_polygon::irradiance(&corners, n, w, k);
        assert_close!(got, want, (tolerance + 1e-10) * solid, "{size:e} {k}");
    }

    /// A small polygon across the horizons of the surface and of the lobe is one in a plane, where
    /// cosines are heights, but for the square of its size.
    #[test]
    fn small_polygons_across_horizons(
        corners in convex_polygon_2d(),
        // Across a horizon, or above it, where heights differ by a small factor.
        shift in (-1.0..1.0f64, prop_oneof![-1.0..1.0f64, 1.0..3.0f64]),
        size in -14.0..-6.0f64,
        turn in 0.3..2.8f64,
        (is_grazing, k) in prop_oneof![
            (Just(true), prop_oneof![Just(0.0), 0.0..1.0f64]),
            (Just(false), 0.0..100.0f64),
        ],
        scale in 0.5..2.0f64,
    ) {
        let size = 10f64.powf(size);
        let corners: Vec<[f64; 2]> = corners.iter().map(|p| [p[0] + shift.0, p[1] + shift.1]).collect();
        let top = corners.iter().map(|p| p[1]).fold(0.0, f64::max);
        prop_assume!(top > 1e-3);
        let c = [turn.sin(), turn.cos()];
        let at = |p: &[f64; 2]| DVec3::new(1.0, size * p[0], size * p[1]) * scale;
        let vertices: Vec<DVec3> = corners.iter().map(at).collect();
        let w = if is_grazing { DVec3::new(0.0, c[0], c[1]) } else { DVec3::X };
        let got = phong_polygon::irradiance(&vertices, DVec3::Z, w, k);
        let most = flat_lobe(&corners, [0.0, 1.0], 0.0) * size.powi(3);
        let want = match is_grazing {
            true => flat_lobe(&corners, c, k) * size.powi(3) * size.powf(k),
            false => most,
        };
        // Corners cut off are rounded in the plane.
        let tolerance = 1e-10 + 8.0 * (k + 4.0) * size * size + 16.0 * f64::EPSILON / top;
        assert_close!(got, want, tolerance * most, "{vertices:?} {w} {k}");
    }

    /// A region with a hole is the whole less the hole.
    #[test]
    fn holes_are_left_out(x in -2.0..2.0f64, y in -2.0..2.0f64, w in unit(), power in 0.8..4.0f64) {
        let (n, k) = (DVec3::Z, 10f64.powf(power));
        let plane = [DVec3::new(x, y, 1.0), DVec3::X, DVec3::Y];
        let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0f64]];
        let in_space = |size: f64| square.map(|[p, q]| plane[0] + DVec3::new(size * p, size * q, 0.0));
        let edges = (0..4).flat_map(|i| {
            let (a, b) = (square[i], square[(i + 1) % 4]);
            [[a, b], [b.map(|c| 0.4 * c), a.map(|c| 0.4 * c)]]
        });
        let got = phong_polygon::boundary_irradiance(edges, &plane, n, w, k.round());
        let [outer, inner] = [1.0, 0.4].map(|size| phong_polygon::irradiance(&in_space(size), n, w, k.round()));
        let most = most(&in_space(1.0), n, k);
        assert_close!(got.expect("a smooth power"), outer - inner, 2e-10 * most, "{plane:?} {w} {k}");
    }
}

/// Less than a polygon: nothing, and (where rounding gives a triangle of nothing an area) no more
/// than that.
fn flat() -> impl Strategy<Value = Vec<DVec3>> {
    let point = || (unit(), -3.0..3.0f64).prop_map(|(d, s)| d * 10f64.powf(s));
    let shares = prop::collection::vec(0.0..1.0f64, 3..8);
    // Exactly on one line, with the shading point between them.
    let powers = prop::collection::vec(
        prop::sample::select(&[-2.0, -1.0, 0.25, 0.5, 4.0][..]),
        3..8,
    );
    prop_oneof![
        // Fewer than three.
        prop::collection::vec(point(), 0..3),
        // One and the same.
        (point(), 3..30usize).prop_map(|(p, count)| vec![p; count]),
        // Of one line, there and back; of a line through the shading point.
        (point(), point(), shares)
            .prop_map(|(a, b, shares)| shares.iter().map(|t| a.lerp(b, *t)).collect()),
        (point(), powers).prop_map(|(a, powers)| powers.iter().map(|s| a * *s).collect()),
        // Of the shading point's own plane, that outside.
        (shape(NEAREST), 0..3usize).prop_map(|(shape, turn)| {
            let at = |p: &[f64; 2]| {
                let v = [p[0] + 10.0, p[1], 0.0];
                DVec3::new(v[turn], v[(turn + 1) % 3], v[(turn + 2) % 3])
            };
            shape.corners.iter().map(at).collect()
        }),
    ]
}

proptest! {
    #![proptest_config(config(1000))]

    /// What is no polygon is dark, but for the area that its corners' rounding gives it: of up to
    /// 30 corners each turned by 2 ε, of some radian of circumference.
    #[test]
    fn degenerate_is_dark(corners in flat(), n in unit(), w in unit(), k in 0.0..60.0f64, roughness in 0.1..1.0f64) {
        let frame = Frame::from_normal(n);
        let bound = 30.0 * 2.0 * f64::EPSILON * 6.0;
        let lobe = facets(roughness, 0.5);
        // The map's condition is below 1e4, its density below 1e4, too.
        let values = [
            ("polygon", polygon::irradiance(&corners, n), bound),
            ("solid angle", solid_angle::polygon(&corners), bound),
            ("phong", phong_polygon::irradiance(&corners, n, w, k), bound),
            ("ltc", lobe.polygon(&frame, &corners), 1e8 * bound),
        ];
        for (name, value, bound) in values {
            prop_assert!((0.0..=bound).contains(&value), "{name}: {value:e} {corners:?}");
        }
    }
}
