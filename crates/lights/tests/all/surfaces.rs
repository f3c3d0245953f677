//! These tests check the laws of surfaces: points lie on them, lines pass through their points, and
//! every technique returns the same density for a point that it has drawn.

use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame, Segment};
use linelit_lights::{
    Area, Cylinder, CylinderView, Disk, LightPoint, LineDensity, LineFamily, LineSetup, NoTexture,
    OffsetDensity, Pdf, PointColumns, PointDensity, PointSource, Sphere, Surface, Viewer,
};
use linelit_shading::ltc::{LtcLobe, LtcMixture};
use linelit_testkit::cases::{cases, rng};
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::strategies::{hostile, hostile_direction, hostile_unit, hostile_vectors};
use proptest::prelude::*;
use std::f64::consts::PI;

/// What coordinates of the scenes, ten at most, are rounded by, some times.
pub(crate) const SLACK: f64 = 64.0 * f64::EPSILON * 10.0;

const POINTS: [PointDensity; 7] = [
    PointDensity::Area,
    PointDensity::VisibleArea,
    PointDensity::Proxy,
    PointDensity::SolidAngle,
    PointDensity::ProjectedSolidAngle,
    PointDensity::Lobes,
    PointDensity::Texture,
];

const LINES: [LineDensity; 5] = [
    LineDensity::Area,
    LineDensity::SolidAngle,
    LineDensity::Warped,
    LineDensity::Projected,
    LineDensity::Texture,
];

/// A light of each shape, up to one large, and who looks at them from 1.5 to 4 away.
pub(crate) struct Scene {
    polygon: ConvexPolygon,
    pub sphere: Sphere,
    pub disk: Disk,
    cylinder: CylinderView,
    pub x: DVec3,
    cosines: LtcMixture,
}

impl Scene {
    pub(crate) fn new(rng: &mut SplitMix64) -> Self {
        let [x, to, n, a, b] = std::array::from_fn(|_| DVec3::from(rng.unit_vector()));
        let center = x + to * rng.in_range(1.5, 4.0);
        let radius = rng.in_range(0.1, 0.8);
        let polygon = match rng.below(2) {
            0 => ConvexPolygon::parallelogram(center, a, b),
            _ => ConvexPolygon::triangle(center, center + a, center + b),
        };
        // The point is outside the infinite cylinder.
        let axis = to.cross(a).normalize() + to * rng.in_range(-0.7, 0.7);
        let axis = Segment::new(center, center + axis * radius);
        let frame = Frame::from_normal((n + to).normalize());
        let mut cosines = LtcMixture::new(frame, DVec3::splat(0.1));
        for _ in 0..rng.below(4) {
            let about = Frame::from_normal(DVec3::from(rng.unit_vector()));
            let map = DMat3::from_cols(about.x * rng.in_range(0.1, 1.0), about.y, about.z);
            let albedo = DVec3::splat(rng.next_f64());
            cosines.add(LtcLobe { map, albedo });
        }
        let sphere = Sphere { center, radius };
        Self {
            polygon: polygon.expect("a polygon"),
            sphere,
            disk: sphere.outline(center + a).expect("from outside"),
            cylinder: CylinderView::new(&Cylinder { axis, radius }, x).expect("from outside"),
            x,
            cosines,
        }
    }

    fn surfaces(&self) -> [Surface<'_>; 4] {
        let (sphere, disk) = (Surface::Sphere(&self.sphere), Surface::Disk(&self.disk));
        let cylinder = Surface::Cylinder(&self.cylinder);
        [Surface::Polygon(&self.polygon), sphere, disk, cylinder]
    }
}

pub(crate) fn viewer(position: DVec3, cosines: &LtcMixture) -> Viewer<'_> {
    Viewer {
        position,
        normal: cosines.frame.z,
        geometric_normal: cosines.frame.z,
        cosines: Some(cosines),
    }
}

/// The distance of a point from a surface.
pub(crate) fn off(surface: &Surface<'_>, p: DVec3) -> f64 {
    match surface {
        Surface::Polygon(polygon) => {
            let (n, corners) = (polygon.normal(), polygon.vertices());
            let next = corners.iter().cycle().skip(1);
            let outside = |(a, b): (&DVec3, &DVec3)| (*b - *a).normalize().cross(n).dot(p - *a);
            let sides = corners.iter().zip(next).map(outside);
            sides.fold(n.dot(p - corners[0]).abs(), f64::max)
        }
        Surface::Sphere(sphere) => (p.distance(sphere.center) - sphere.radius).abs(),
        Surface::Disk(disk) => {
            let from = p - disk.center;
            disk.normal.dot(from).abs().max(from.length() - disk.radius)
        }
        Surface::Cylinder(view) => {
            let Cylinder { axis, radius } = view.cylinder();
            let (along, from) = (axis.direction(), p - axis.p0);
            let (height, across) = (along.dot(from), along.cross(from).length());
            (across - radius)
                .abs()
                .max(-height)
                .max(height - axis.length())
        }
        // Any direction from the shading point leads to it.
        Surface::Sky(_) => 0.0,
    }
}

/// A surface that a shading point looks at, held to the laws.
#[derive(Debug)]
pub(crate) struct Laws<'a> {
    pub surface: Surface<'a>,
    pub x: DVec3,
}

impl Laws<'_> {
    /// Holds a point that was drawn: it lies on the surface, where rays meet it, and its density is
    /// what is said of it. That may be what it is as far around as the point is rounded, and as
    /// much off as a cosine, where the normal or the direction turns on that way.
    fn hold(&self, at: LightPoint, drawn: f64, density: impl Fn(&LightPoint) -> f64) {
        let Self { surface, x } = self;
        assert!(off(surface, at.point) <= SLACK, "{at:?} {self:?}");
        let normal = surface.normal(at.point);
        let cosine = -normal.dot(at.point - x) / at.square.sqrt();
        let error = (at.cos_light - cosine).abs();
        assert!(error <= 8.0 * f64::EPSILON, "{error} {self:?}");
        let frame = Frame::from_normal(normal);
        let around = [frame.x, -frame.x, frame.y, -frame.y].map(|way| {
            let near = LightPoint::new(at.point + way * SLACK, *x, surface);
            (density(&near) - density(&at)).abs()
        });
        let size = match surface {
            Surface::Sphere(sphere) => sphere.radius,
            Surface::Cylinder(view) => view.cylinder().radius,
            Surface::Polygon(_) | Surface::Disk(_) | Surface::Sky(_) => at.square.sqrt(),
        };
        let relative = 64.0 * f64::EPSILON + SLACK / (size * at.cos_light.abs());
        let room = relative * drawn + around.into_iter().fold(0.0, f64::max);
        let error = (drawn - density(&at)).abs();
        assert!(error <= room, "{drawn} is off {error} {self:?}");
        // Along a ray a point is off by 1/cos of what it is off the surface.
        let is_inside = surface.border(at.point, *x, |d| f64::from(u8::from(d > 1e-6))) > 0.0;
        if at.cos_light > 0.1 && is_inside {
            let met = surface.meets(*x, at.direction).expect("a hit");
            let error = met.distance(at.point);
            assert!(error <= 10.0 * SLACK, "{error} {at:?} {self:?}");
        }
    }

    /// Checks that eight points of a source, drawn one by one, are the points of its columns, to
    /// the bit. Returns how many of them missed the light.
    pub(crate) fn points(&self, source: &PointSource<'_>, rng: &mut SplitMix64) -> u32 {
        let u: [[f64; 8]; 2] = [(); 2].map(|()| std::array::from_fn(|_| rng.next_f64()));
        let [mut a, mut b, mut c, mut pdf] = [[[0.0; 8]]; 4];
        let (point, pdfs) = ([&mut a[..], &mut b, &mut c], &mut pdf);
        let per_area = source.sample_into([&[u[0]], &[u[1]]], PointColumns { point, pdf: pdfs });
        let mut missed = 0;
        for i in 0..8 {
            let Some((at, density)) = source.draw([u[0][i], u[1][i]], &self.surface, self.x) else {
                missed += 1;
                continue;
            };
            if let Some(per_area) = per_area {
                assert_eq!(at.point, DVec3::new(a[0][i], b[0][i], c[0][i]), "{self:?}");
                let pdf = Pdf::<Area>::new(pdf[0][i]);
                let column = [pdf.value(), at.density(pdf)][usize::from(per_area)];
                assert_eq!(density.to_bits(), column.to_bits(), "{self:?}");
            }
            if density > 0.0 {
                self.hold(at, density, |at| source.density(at));
            }
        }
        assert!(missed == 0 || per_area.is_none(), "{self:?}");
        missed
    }

    /// Holds points of a family's lines: they lie on their line, and the line through each is that.
    pub(crate) fn lines(&self, family: &LineFamily<'_>, rng: &mut SplitMix64) {
        let way = family.direction();
        for _ in 0..4 {
            let [u, v, a, b] = std::array::from_fn(|_| rng.next_f64());
            let parts =
                [[0.4 * a, 0.4], [0.6, 0.6 + 0.4 * b]].map(|[lo, hi]| Interval::new(lo, hi));
            let line = family.sample(u);
            let (at, density) = family.point(&line, &parts, v, self.x, &self.surface);
            // A line of no length is below a horizon.
            if density <= 0.0 || line.segment.length() <= 0.0 {
                continue;
            }
            self.hold(at, density, |at| family.density(at, &parts));
            for line in [line.segment, family.through(at.point)] {
                let turned = way.cross(line.vector()).length();
                let off = way.cross(at.point - line.p0).length();
                assert!(turned.max(off) <= SLACK, "{turned} {off} {self:?}");
            }
            let height = match self.surface {
                Surface::Polygon(_) => 1.0,
                _ => at.cos_light * at.square.sqrt(),
            };
            let error = (family.height(&line) - height).abs();
            assert!(error <= SLACK, "{error} {self:?}");
        }
    }
}

pub(crate) fn setup(rng: &mut SplitMix64) -> LineSetup {
    let fraction = rng.in_range(-1.0, 2.0);
    LineSetup {
        fraction,
        angle: fraction * PI,
        fixed: rng.below(2) == 0,
        offset: match rng.below(2) {
            0 => OffsetDensity::Uniform,
            _ => OffsetDensity::Length,
        },
    }
}

#[test]
fn points_and_lines_obey() {
    let mut rng = rng(5);
    for _ in 0..cases(400) {
        let scene = Scene::new(&mut rng);
        let (x, viewer) = (scene.x, &viewer(scene.x, &scene.cosines));
        for surface in scene.surfaces() {
            let laws = Laws { surface, x };
            for by in POINTS {
                let source = PointSource::new(by, surface, None::<&NoTexture>, viewer);
                let missed = laws.points(&source, &mut rng);
                assert!(missed == 0 || by == PointDensity::Lobes, "{laws:?}");
            }
            for by in LINES {
                let (texture, setup) = (None::<&NoTexture>, setup(&mut rng));
                let family = LineFamily::new(by, surface, texture, setup, viewer);
                let has_lines = matches!(surface, Surface::Polygon(_) | Surface::Cylinder(_));
                assert_eq!(family.is_some(), has_lines, "{laws:?}");
                if let Some(family) = family {
                    laws.lines(&family, &mut rng);
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(1_000), failure_persistence: None, ..ProptestConfig::default() })]

    /// No numbers cause a panic, and all densities are valid.
    #[test]
    fn hostile_numbers(
        places in hostile_vectors::<5>(), directions in [hostile_direction(), hostile_direction(), hostile_direction()],
        radius in hostile(), u in [hostile_unit(), hostile_unit()], fraction in hostile(), knows in any::<bool>(),
    ) {
        let [a, b, c, x, q] = places.map(DVec3::from);
        let [n, g, way] = directions.map(DVec3::from);
        let mut cosines = LtcMixture::new(Frame::from_normal(n), a);
        cosines.add(LtcLobe { map: DMat3::from_cols(b, c, q), albedo: a });
        let viewer = Viewer { position: x, normal: n, geometric_normal: g, cosines: knows.then_some(&cosines) };
        let setup = LineSetup { fraction, angle: fraction * PI, fixed: true, offset: OffsetDensity::Length };
        let (sphere, disk) = (Sphere { center: a, radius }, Disk { center: a, normal: g, radius });
        let polygon = ConvexPolygon::triangle(a, b, c).ok();
        let cylinder = CylinderView::new(&Cylinder { axis: Segment::new(a, b), radius }, x);
        let round = [Some(Surface::Sphere(&sphere)), Some(Surface::Disk(&disk))];
        let others = [polygon.as_ref().map(Surface::Polygon), cylinder.as_ref().map(Surface::Cylinder)];
        let _ = (sphere.outline(x), sphere.before(x), sphere.is_clear_of([b, c, q]), disk.around());
        for surface in round.into_iter().chain(others).flatten() {
            let _ = (surface.normal(q), surface.flat(), surface.meets(x, way), surface.half_width());
            let _ = surface.border(q, x, |distance| distance);
            let other = LightPoint::towards(q, way, way, &surface);
            prop_assert!(other.density(Pdf::<Area>::new(radius)) >= 0.0);
            for by in POINTS {
                let source = PointSource::new(by, surface, None::<&NoTexture>, &viewer);
                let drawn = source.draw(u, &surface, x);
                let densities = drawn.iter().flat_map(|(at, density)| [*density, source.density(at)]);
                for density in densities.chain([source.density(&other)]) {
                    prop_assert!(density.is_finite() && density >= 0.0, "{density} {source:?}");
                }
            }
            let lines = |by| LineFamily::new(by, surface, None::<&NoTexture>, setup, &viewer);
            for family in LINES.into_iter().filter_map(lines) {
                let line = family.sample(u[0]);
                let _ = (family.direction(), family.through(q), family.height(&line));
                let (at, density) = family.point(&line, &[Interval::UNIT], u[1], x, &surface);
                for density in [density, family.density(&at, &[Interval::UNIT]), family.density(&other, &[])] {
                    prop_assert!(density.is_finite() && density >= 0.0, "{density} {family:?}");
                }
            }
        }
    }
}
