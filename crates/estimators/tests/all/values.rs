//! Estimators are compared with quadrature of the light, to a relative error of 5e-5 and better.
//! There are so many stratified samples of a smooth integrand that a factor of 1 + 1e-4 in a
//! density or a weight would be found.

use crate::agreement::{lights, means, occluders};
use crate::linear_lights::reflections;
use crate::round::{estimates, glossy, matte, nothing};
use linelit_bsdf::{Bsdf, Known, LtcLobe, LtcMixture, Reflection};
use linelit_estimators::{Measure, ShadingPoint, Technique, VisibleRegion};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame, Segment};
use linelit_lights::{
    AreaLight, Cylinder, CylinderLight, Disk, Emission, Light, LinearLight, Sphere,
};
use linelit_testkit::chi2::sidak;
use linelit_testkit::quadrature::gauss_kronrod;
use linelit_testkit::ztest::t_p_value;
use linelit_visibility::{Occluders, Scratch, ShaftQuery};
use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A sum that approximates ∫∫ over a square, by the midpoints after a substitution whose derivative
/// vanishes at the ends.
fn square(mut add: impl FnMut([f64; 2], f64)) {
    // x(t) with x' = 2772 t⁵ (1 − t)⁵: the terms of the Euler–Maclaurin sum that remain are of
    // higher order.
    const COUNT: u32 = 96;
    let nodes: Vec<[f64; 2]> = (0..COUNT)
        .map(|i| {
            let t = (f64::from(i) + 0.5) / f64::from(COUNT);
            let x = t.powi(6)
                * (462.0 + t * (-1980.0 + t * (3465.0 + t * (-3080.0 + t * (1386.0 - 252.0 * t)))));
            [x, 2772.0 * (t * (1.0 - t)).powi(5) / f64::from(COUNT)]
        })
        .collect();
    for [x, w] in &nodes {
        nodes.iter().for_each(|[y, v]| add([*x, *y], w * v));
    }
}

/// A sum that approximates ∫ over a polygon.
fn over_polygon(polygon: &ConvexPolygon, f: impl Fn(DVec3) -> f64) -> f64 {
    let v = polygon.vertices();
    let mut sum = 0.0;
    for (b, c) in v[1..].iter().zip(&v[2..]) {
        let (e, g) = (*b - v[0], *c - *b);
        let twice = e.cross(g).length();
        square(|[x, y], w| sum += twice * x * w * f(v[0] + (e + g * y) * x));
    }
    sum
}

/// An integral along the part of a line that is above the horizons.
fn along(line: &Segment, horizons: [DVec3; 2], f: impl Fn(DVec3) -> f64) -> f64 {
    let (mut lo, mut hi) = (0.0, 1.0_f64);
    for n in horizons {
        let [a, b] = [line.p0, line.p1].map(|p| n.dot(p));
        let zero = a / (a - b);
        match (a > 0.0, b > 0.0) {
            (true, true) => {}
            (true, false) => hi = hi.min(zero),
            (false, true) => lo = zero.max(lo),
            (false, false) => return 0.0,
        }
    }
    if lo >= hi {
        return 0.0;
    }
    line.length() * gauss_kronrod(|t| f(line.at(t)), lo, hi, 1e-11).value
}

/// The light at a point at the origin, summed over the channels.
fn by_quadrature<R: Reflection>(light: &Light, point: &ShadingPoint<R>) -> f64 {
    let reflected = |p: DVec3| {
        let (w, n) = (p.normalize(), point.normal);
        let f = point.bsdf.eval(w, point.outgoing, n);
        f.element_sum() * n.dot(w).max(0.0) / p.length_squared()
    };
    let horizons = [point.normal, point.geometric_normal];
    match light {
        Light::Linear(l) => {
            let e = l.segment.direction();
            let sine = |p: DVec3| 2.0 * p.cross(e).length() / p.length();
            l.radiance_radius.x * along(&l.segment, horizons, |p| sine(p) * reflected(p))
        }
        Light::Cylinder(l) => {
            let Cylinder { axis, radius } = l.cylinder;
            let direction = axis.direction();
            let foot = axis.p0 - direction * direction.dot(axis.p0);
            let (out, half) = (-foot.normalize(), (radius / foot.length()).acos());
            let strip = |turn: f64| {
                let n = out * turn.cos() + direction.cross(out) * turn.sin();
                let line = Segment::new(axis.p0 + n * radius, axis.p1 + n * radius);
                along(&line, horizons, |p| -n.dot(p.normalize()) * reflected(p))
            };
            radius * gauss_kronrod(strip, -half, half, 1e-9).value
        }
        Light::Area(l) => {
            let above = |part: &ConvexPolygon, n| part.clip(DVec3::ZERO, n);
            let part = above(&l.polygon, horizons[0]).and_then(|part| above(&part, horizons[1]));
            let n = l.polygon.normal();
            let f = |p: DVec3| -n.dot(p.normalize()) * reflected(p);
            part.map_or(0.0, |part| over_polygon(&part, f))
        }
        Light::Disk(l) => over_disk(l.disk, horizons, reflected),
        // As bright as the disk of its outline.
        Light::Sphere(l) => {
            let Sphere { center, radius } = l.sphere;
            let share = 1.0 - radius * radius / center.length_squared();
            let (normal, radius) = (-center.normalize(), radius * share.sqrt());
            let center = center * share;
            over_disk(
                Disk {
                    center,
                    normal,
                    radius,
                },
                horizons,
                reflected,
            )
        }
        _ => f64::NAN,
    }
}

/// The light of a disk, chord by chord.
fn over_disk(disk: Disk, horizons: [DVec3; 2], reflected: impl Fn(DVec3) -> f64) -> f64 {
    let frame = Frame::from_normal(disk.normal);
    let chord = |turn: f64| {
        let (s, c) = turn.sin_cos();
        let (middle, half) = (frame.x * (disk.radius * s), frame.y * (disk.radius * c));
        let line = Segment::new(disk.center + middle - half, disk.center + middle + half);
        let f = |p: DVec3| -frame.z.dot(p.normalize()) * reflected(p);
        disk.radius * c * along(&line, horizons, f)
    };
    gauss_kronrod(chord, -FRAC_PI_2, FRAC_PI_2, 1e-11).value
}

/// Directions of lines that only a technique alone can have.
const ALONE: [&str; 4] = [
    "line-area[orientation=stratified]",
    "line-analytic[orientation=stratified]",
    "line-area[orientation=origin]",
    "line-analytic[orientation=origin]",
];

/// Weighted combinations.
const WEIGHTED: [&str; 7] = [
    "line-area+point-solid-angle",
    "line-area:3+point-area[mis=power]",
    "line-area[pieces=one]+point-solid-angle",
    "line-area+point-solid-angle[mis=smooth]",
    "point-area+point-solid-angle:3[mis=average]",
    "line-solid-angle[orientation=spread:2]+point-area[mis=maximum]",
    "line-area+point-area[mis=optimal]",
];

/// The point is so far away that all points of a light give nearly the same value: the noise of
/// stratified samples is about 1e-5. This does not hold for points of round lights by area and for
/// directions that miss the light, but each technique is tested on some light.
#[test]
fn densities_and_weights_are_right_to_five_hundred_thousandths() {
    let (seeds, samples) = (0..24, 1024);
    let lights: Vec<_> = lights().into_iter().filter(|l| l.1.is_none()).collect();
    let names = || {
        (Technique::all().map(|t| t.name()))
            .chain(ALONE)
            .chain(WEIGHTED)
    };
    // Student's t with 23 degrees of freedom.
    let level = sidak(1e-4, 2 * lights.len() * names().count());
    let mut held = BTreeSet::new();
    for (light, bsdf) in lights
        .iter()
        .flat_map(|l| [Bsdf::Lambert(matte()), glossy()].map(|bsdf| (l, bsdf)))
    {
        let (far, wo) = (DVec3::new(1.0, -0.5, 40.0), DVec3::new(-0.6, 0.0, 0.8));
        let light = &(moved(&light.0, far), None);
        let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, wo, bsdf);
        let want = by_quadrature(&light.0, &point);
        for name in names() {
            let got = means(
                light,
                &nothing(),
                &point,
                (name, true),
                samples,
                seeds.clone(),
            );
            // The errors of quadrature, and of sums over boundaries that are a fortieth of their
            // distance wide.
            let noise = got.standard_error().max(1e-10 * want);
            let t = (got.mean() - want) / noise;
            assert!(
                t_p_value(t, 23.0) > level,
                "{name}: t {t}, {got:?} for {want} of {:?} on {:?}",
                light.0,
                point.bsdf
            );
            if t_p_value(5e-5 * want / noise, 23.0) < level {
                held.insert((name, matches!(point.bsdf, Bsdf::Lambert(_))));
            }
        }
    }
    for cell in names().flat_map(|name| [(name, true), (name, false)]) {
        assert!(held.contains(&cell), "{cell:?} is too noisy on all");
    }
}

/// The same light at another position.
fn moved(light: &Light, by: DVec3) -> Light {
    let mut light = light.clone();
    let line = |s: &Segment| Segment::new(s.p0 + by, s.p1 + by);
    match &mut light {
        Light::Area(l) => {
            let corners: Vec<_> = l.polygon.vertices().iter().map(|v| *v + by).collect();
            l.polygon = ConvexPolygon::new(&corners).expect("as it was");
        }
        Light::Linear(l) => l.segment = line(&l.segment),
        Light::Sphere(l) => l.sphere.center += by,
        Light::Disk(l) => l.disk.center += by,
        Light::Cylinder(l) => l.cylinder.axis = line(&l.cylinder.axis),
        _ => {}
    }
    light
}

/// Linear lights and cylinders that intersect the horizon of the surface, of the shading normal, or
/// of both.
#[test]
fn horizons_cut_lines_and_cylinders_where_they_are() {
    let (tilted, wo) = (
        DVec3::new(-0.6, 0.0, 0.8),
        DVec3::new(-0.2, 0.1, 0.9).normalize(),
    );
    let axis = Segment::new([0.9, -0.9, -0.25].into(), [0.4, 1.0, 0.75].into());
    let radiance_radius = DVec3::ONE;
    let line = Light::Linear(LinearLight {
        segment: axis,
        radiance_radius,
    });
    let (radius, radiance) = (0.125, DVec3::ONE);
    let cylinder = Cylinder { axis, radius };
    let cylinder = Light::Cylinder(CylinderLight { cylinder, radiance });
    let rough = reflections()[2].clone();
    let level = sidak(1e-4, 3 * 2);
    for (normal, geometric_normal) in [(DVec3::Z, tilted), (tilted, DVec3::Z), (DVec3::Z, DVec3::Z)]
    {
        for bsdf in [Bsdf::Lambert(matte()), glossy(), rough.clone()] {
            let mut point = ShadingPoint::new(DVec3::ZERO, normal, wo, bsdf);
            point.geometric_normal = geometric_normal;
            let want = by_quadrature(&line, &point);
            let (got, _) = estimates(&nothing(), &line, &point, "exact", 4, 0..4);
            // This is the promised error of quadrature along lines; closed forms are good to 1e-9
            // here.
            let is_closed = !matches!(point.bsdf, Bsdf::Layers(_));
            let most = want * if is_closed { 1e-9 } else { 1e-6 };
            let error = (got.mean() - want).abs();
            assert!(
                want > 1e-3 && error < most,
                "{normal}, {geometric_normal}: {got:?} for {want}"
            );
            let want = by_quadrature(&cylinder, &point);
            let (got, _) = estimates(&nothing(), &cylinder, &point, "exact", 256, 0..24);
            let t = (got.mean() - want) / got.standard_error();
            assert!(got.standard_error() < 5e-4 * want, "{got:?} for {want}");
            assert!(
                t_p_value(t, 23.0) > level,
                "{normal}, {geometric_normal}: {got:?} for {want}"
            );
        }
    }
}

/// One of the horizons goes through the middle of every light, for every technique.
#[test]
fn horizons_cut_all_lights_where_they_are() {
    let (steep, wo) = (
        DVec3::new(-0.6, 0.72, 0.0).normalize(),
        DVec3::new(-0.2, 0.1, 0.9).normalize(),
    );
    let texts = [
        "exact",
        "line-area",
        "line-analytic",
        "point-solid-angle",
        "point-area",
        "point-visible-area",
        "point-projected-solid-angle",
    ];
    let lights: Vec<_> = lights().into_iter().filter(|l| l.1.is_none()).collect();
    let level = sidak(1e-4, 4 * texts.len() * lights.len());
    for (normal, geometric_normal) in [(DVec3::Z, steep), (steep, DVec3::Z)] {
        for (light, bsdf) in lights
            .iter()
            .flat_map(|l| [Bsdf::Lambert(matte()), glossy()].map(|b| (l, b)))
        {
            let mut point = ShadingPoint::new(DVec3::ZERO, normal, wo, bsdf);
            point.geometric_normal = geometric_normal;
            let want = by_quadrature(&light.0, &point);
            for text in texts {
                let got = means(light, &nothing(), &point, (text, true), 1024, 0..24);
                // Disks are integrated by chords, whose ends are kinks where horizons cut them.
                let noise = got.standard_error().max(1e-9 * want);
                let t = (got.mean() - want) / noise;
                assert!(
                    want > 1e-4 && noise < 0.01 * want && t_p_value(t, 23.0) > level,
                    "{text}: t {t}, {got:?} for {want} of {:?} on {:?}, {normal}",
                    light.0,
                    point.bsdf
                );
            }
        }
    }
}

/// A reflection that consists of LTCs leaves no light to sample.
struct Cosines(LtcMixture);

impl Reflection for Cosines {
    fn eval(&self, wi: DVec3, _: DVec3, _: DVec3) -> DVec3 {
        let w = self.0.frame.to_local(wi);
        let lobes = self.0.lobes().iter();
        let sum = lobes.fold(DVec3::ZERO, |sum, lobe| sum + lobe.albedo * lobe.density(w));
        self.0.diffuse / PI + sum / w.z
    }

    fn sample(&self, u: [f64; 2], wo: DVec3, n: DVec3) -> Option<DVec3> {
        Bsdf::Lambert(matte()).sample(u, wo, n)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3, n: DVec3) -> f64 {
        Bsdf::Lambert(matte()).pdf(wi, wo, n)
    }

    fn known(&self, _: DVec3, _: DVec3) -> Known<'_> {
        Known::Cosines { are_unlike: false }
    }

    fn transformed_cosines(&self, _: DVec3, _: DVec3) -> Option<LtcMixture> {
        Some(self.0)
    }
}

/// A cosine and two lobes about a normal, by maps that mirror or do not, with its horizon.
fn lobes(normal: DVec3, mirror: f64) -> Cosines {
    let flip = DMat3::from_diagonal(DVec3::new(mirror, 1.0, 1.0));
    let mut sum = LtcMixture::new(Frame::from_normal(normal), DVec3::splat(0.1));
    for (columns, albedo) in [
        ([[0.5, 0.0, 0.0], [0.1, 0.75, 0.0], [0.25, 0.1, 1.0]], 0.25),
        ([[1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [-0.5, 0.0, 1.0]], 0.5),
    ] {
        let albedo = DVec3::new(albedo, 0.5 * albedo, 0.0);
        let map = DMat3::from_cols_array_2d(&columns) * flip;
        sum.add(LtcLobe { map, albedo });
    }
    Cosines(sum)
}

/// Lobes by maps that rotate are equal to lobes by maps that mirror: the cosine is the same on both
/// sides of any plane through its axis.
#[test]
fn transformed_cosines_are_exact_also_by_maps_that_mirror() {
    let of = |light: &Light, between: &Occluders, mirror| {
        let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, DVec3::Z, lobes(DVec3::Z, mirror));
        let (got, _) = estimates(between, light, &point, "exact", 4, 0..4);
        // Sums over boundaries lose only a few digits here.
        assert!(
            got.variance().sqrt() < 1e-10 * got.mean(),
            "{got:?} of {light:?}"
        );
        (got.mean(), by_quadrature(light, &point))
    };
    for (light, _) in lights() {
        if matches!(light, Light::Linear(_) | Light::Cylinder(_)) {
            continue;
        }
        let mut last = None;
        for mirror in [1.0, -1.0] {
            let (got, want) = of(&light, &nothing(), mirror);
            assert!(
                (got / want - 1.0).abs() < 1e-9,
                "{got} for {want} of {light:?}"
            );
            let (part, _) = of(&light, &occluders(true), mirror);
            assert!(part < 0.95 * got, "{part} of {got}");
            let before = *last.get_or_insert(part);
            assert!(
                (part / before - 1.0).abs() < 1e-10,
                "{part}, {before} of {light:?}"
            );
        }
    }
}

/// The light that a triangle blocks is the light that it would send as a lamp of the same radiance.
#[test]
fn a_triangle_takes_as_much_as_it_fills() {
    let corners = [
        [0.0, 0.0, 0.75],
        [0.125, 0.03125, 0.75],
        [0.03125, 0.125, 0.75],
    ];
    let between = Occluders::build(&corners, &[[0, 1, 2]]);
    let [a, b, c] = corners.map(|p| DVec3::from(p.map(f64::from)));
    let polygon = ConvexPolygon::triangle(a, c, b).expect("one");
    let emission = Emission::one_sided(DVec3::ONE);
    let hidden = Light::Area(AreaLight { polygon, emission });
    let steep = DVec3::new(-0.6, 0.72, 0.05).normalize();
    for (normal, geometric_normal) in [(DVec3::Z, DVec3::Z), (DVec3::Z, steep), (steep, DVec3::Z)] {
        for (light, image) in lights() {
            if image.is_some() || matches!(light, Light::Linear(_) | Light::Cylinder(_)) {
                continue;
            }
            fn hold<R: Reflection>(
                of: (&Light, &Light),
                between: &Occluders,
                point: &ShadingPoint<R>,
            ) {
                let (light, hidden) = of;
                let [whole, taken] = [light, hidden].map(|l| by_quadrature(l, point));
                let want = whole - taken;
                let (got, _) = estimates(between, light, point, "exact", 4, 0..4);
                // Disks are integrated by chords, whose ends are kinks where horizons cut them.
                assert!(
                    taken > 0.01 * whole && (got.mean() / want - 1.0).abs() < 1e-9,
                    "{got:?} for {want} of {light:?}, {}, {}",
                    point.normal,
                    point.geometric_normal
                );
                assert!(got.variance().sqrt() < 1e-10 * want, "{got:?}");
            }
            let mut point =
                ShadingPoint::new(DVec3::ZERO, normal, DVec3::Z, Bsdf::Lambert(matte()));
            point.geometric_normal = geometric_normal;
            hold((&light, &hidden), &between, &point);
            let mut point = ShadingPoint::new(DVec3::ZERO, normal, DVec3::Z, lobes(normal, 1.0));
            point.geometric_normal = geometric_normal;
            hold((&light, &hidden), &between, &point);
        }
    }
}

/// A wall that a point sees edge-on, at a distance from its plane below rounding, hides nothing of
/// a round light.
#[test]
fn walls_that_are_seen_edge_on_hide_nothing() {
    let corners = [[0.125, -3.0, 0.5], [0.125, 3.0, 0.5], [0.125, 0.0, 0.875]];
    let wall = Occluders::build(&corners, &[[0, 1, 2]]);
    for (light, image) in lights() {
        if image.is_some() || matches!(light, Light::Linear(_) | Light::Cylinder(_)) {
            continue;
        }
        for (k, off) in [0.0, 1e-17, 1e-16, 1e-15, 1e-12]
            .into_iter()
            .flat_map(|x| [(0, x), (1, -x)])
        {
            let x = DVec3::X * (0.125 + off);
            let point = ShadingPoint::new(x, DVec3::Z, DVec3::Z, Bsdf::Lambert(matte()));
            let [got, want] = [&wall, &nothing()].map(|between| {
                estimates(between, &light, &point, "exact", 1, 0..1)
                    .0
                    .mean()
            });
            // The image of the wall is a few times as wide as the point's distance from its plane.
            assert!(
                (got / want - 1.0).abs() < 1e-11,
                "{k} {off:e}: {got} for {want} of {light:?}"
            );
        }
    }
}

/// The walls around a point and the objects between them fill all directions. Together they send
/// what a surface receives from a half space; a wall of a cube sends a sixth.
#[test]
fn visible_regions_around_a_point_fill_all_directions() {
    let wall = |k: usize, side: f64| {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let (n, u, v) = (
            axes[k] * side,
            axes[(k + 1) % 3] * 2.0,
            axes[(k + 2) % 3] * 2.0,
        );
        ConvexPolygon::parallelogram(n - 0.5 * (u + v), u, v).expect("a wall")
    };
    let walls: Vec<_> = (0..3).flat_map(|k| [wall(k, 1.0), wall(k, -1.0)]).collect();
    let near = [[0.5, -0.25, -0.25], [0.5, 0.5, -0.125], [0.25, 0.0, 0.5]];
    let far = [[0.75, -0.5, -0.5], [0.75, 0.5, -0.25], [0.75, 0.25, 0.75]];
    let triangle = |t: &[[f32; 3]; 3]| {
        let [a, b, c] = t.map(|p| DVec3::from(p.map(f64::from)));
        ConvexPolygon::triangle(a, b, c).expect("one")
    };
    let both: Vec<_> = near.iter().chain(&far).copied().collect();
    let [none, first, all] = [&[][..], &[[0, 1, 2]], &[[0, 1, 2], [3, 4, 5]]]
        .map(|triangles| Occluders::build(&both, triangles));
    let (mut region, mut scratch) = (VisibleRegion::default(), Scratch::new());
    let n = DVec3::new(0.48, -0.6, 0.64);
    let mut of = |between, polygon: &ConvexPolygon, x| {
        region.find(between, ShaftQuery::new(x, polygon), &mut scratch);
        [Measure::SolidAngle, Measure::Cosine(n), Measure::Area]
            .map(|measure| region.measure(measure))
    };
    let sixth = of(&none, &walls[0], DVec3::ZERO)[0];
    assert!((sixth - TAU / 3.0).abs() < 1e-14, "{sixth}");
    let area = of(&none, &walls[0], DVec3::ZERO)[2];
    assert!((area - 4.0).abs() < 1e-14, "{area}");
    for x in [
        DVec3::ZERO,
        DVec3::new(0.1, -0.2, 0.05),
        DVec3::new(-0.5, 0.3, 0.9),
    ] {
        let mut sum = [
            of(&none, &triangle(&near), x),
            of(&first, &triangle(&far), x),
        ];
        let hidden = of(&none, &triangle(&far), x)[0];
        assert!(sum[1][0] < 0.9 * hidden, "some of it is hidden");
        for wall in &walls {
            let more = of(&all, wall, x);
            sum[0] = [0, 1, 2].map(|k| sum[0][k] + more[k]);
        }
        let [solid_angle, cosine] = [0, 1].map(|k| sum[0][k] + sum[1][k]);
        // The default margins: 1e-9 of the way, at the edges of two triangles.
        assert!(
            (solid_angle - 2.0 * TAU).abs() < 1e-11,
            "{x}: {solid_angle}"
        );
        assert!((cosine - PI).abs() < 1e-11, "{x}: {cosine}");
    }
}
