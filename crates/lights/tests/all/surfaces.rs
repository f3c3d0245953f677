//! Surfaces of lights: every density on every shape is that of the sampler it names, on the
//! surface, and says of a point that was drawn what it was drawn with.

use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame, Segment};
use linelit_lights::{
    AngularLines, Area, AreaSampler, ChordMeasure, Cylinder, CylinderArea, CylinderLines,
    CylinderView, Disk, DiskArea, DiskChords, DiskCone, DiskLobes, EmissionTexture,
    ImportanceImage, LightPoint, LineDensity, LineFamily, LineSample, LineSampler, LineSetup,
    LineTechnique, Lobes, Mixture, NoTexture, OffsetDensity, Pdf, PointColumns, PointDensity,
    PointSource, PointTechnique, PointsOnLines, ProxySampler, RegionSampler, SolidAngleSampler,
    Sphere, SphereCap, SphereCone, SphereProjected, Surface, SurfaceMeasure, TextureAxis,
    TexturedLines, TexturedSampler, Viewer, VisibleLobes, around_unit_circle, through,
};
use linelit_shading::ltc::{TransformedCosine, TransformedCosines};
use linelit_testkit::cases::{cases, rng};
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::strategies::{hostile, hostile_direction, hostile_unit, hostile_vectors};
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

/// What coordinates of the scenes, ten at most, are rounded by, some times.
const SLACK: f64 = 64.0 * f64::EPSILON * 10.0;

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

/// A light of each shape, and who looks at them.
struct Scene {
    polygon: ConvexPolygon,
    sphere: Sphere,
    disk: Disk,
    cylinder: CylinderView,
    x: DVec3,
    normals: [DVec3; 2],
    cosines: TransformedCosines,
}

impl Scene {
    /// Lights of up to one around a point that is 1.5 to 4 away.
    fn new(rng: &mut SplitMix64) -> Self {
        let mut unit = || DVec3::from(rng.unit_vector());
        let [x, to, n, g, axis, a, b, tilt] = std::array::from_fn(|_| unit());
        let mut from = |low, high| rng.in_range(low, high);
        let center = x + to * from(1.5, 4.0);
        let radius = from(0.1, 0.8);
        let corners = [
            from(0.0, 1.0),
            from(1.0, 2.5),
            from(2.5, 4.5),
            from(4.5, 6.0),
        ];
        let frame = Frame::from_normal(tilt);
        let on_circle = |turn: &f64| center + frame.x * turn.cos() + frame.y * turn.sin();
        let polygon = match rng.below(3) {
            0 => ConvexPolygon::parallelogram(center, a, b),
            1 => ConvexPolygon::try_new(&corners.map(|turn| on_circle(&turn))),
            _ => ConvexPolygon::try_new(&corners.map(|turn| on_circle(&turn))[..3]),
        };
        // A strip of the endless cylinder must be in view.
        let across = to.cross(axis).length() * (center - x).length();
        let thin = Cylinder {
            axis: Segment::new(center - axis * radius, center + axis * radius),
            radius: radius.min(0.9 * across),
        };
        let normal = (n + to).normalize();
        let frame = Frame::from_normal(normal);
        let mut cosines = TransformedCosines::new(frame, DVec3::splat(0.2) * rng.next_f64());
        for _ in 0..rng.below(4) {
            let about = Frame::from_normal(DVec3::from(rng.unit_vector()));
            let width = rng.in_range(0.1, 1.0);
            let map = DMat3::from_cols(about.x * width, about.y, about.z);
            let albedo = DVec3::splat(rng.next_f64());
            cosines.add(TransformedCosine { map, albedo });
        }
        Self {
            polygon: polygon.expect("a polygon"),
            sphere: Sphere { center, radius },
            disk: Disk {
                center,
                normal: tilt,
                radius,
            },
            cylinder: CylinderView::new(&thin, x).expect("from outside"),
            x,
            normals: [normal, (normal + g * 0.3).normalize()],
            cosines,
        }
    }

    fn surfaces(&self) -> [Surface<'_>; 4] {
        [
            Surface::Polygon(&self.polygon),
            Surface::Sphere(&self.sphere),
            Surface::Disk(&self.disk),
            Surface::Cylinder(&self.cylinder),
        ]
    }

    fn viewer(&self, knows: bool) -> Viewer<'_> {
        Viewer {
            position: self.x,
            normal: self.normals[0],
            geometric_normal: self.normals[1],
            cosines: knows.then_some(&self.cosines),
        }
    }

    /// What draws points by a density, told by the table of shapes.
    fn points_by_hand(
        &self,
        by: PointDensity,
        surface: &Surface<'_>,
        knows: bool,
    ) -> PointSource<'_> {
        use {PointDensity as By, PointSource as Of};
        let (x, [n, g]) = (self.x, self.normals);
        let (polygon, sphere, disk) = (&self.polygon, &self.sphere, &self.disk);
        let cosines = match knows {
            true => self.cosines,
            false => TransformedCosines::new(Frame::from_normal(n), DVec3::ZERO),
        };
        let lobes = |disk: &Disk| {
            let lobes = DiskLobes::new(disk, x, &cosines).map(Of::DiskLobes);
            lobes.filter(|_| !cosines.lobes().is_empty())
        };
        let along =
            |measure| Of::CylinderLines(CylinderLines::of(&self.cylinder, &[n, g], measure));
        match (surface, by) {
            (Surface::Polygon(_), By::Area | By::VisibleArea | By::Texture) => {
                Of::Area(AreaSampler::new(polygon))
            }
            (Surface::Polygon(_), By::Proxy) => Of::Proxy(ProxySampler::new(polygon, x)),
            (Surface::Polygon(_), By::SolidAngle) => {
                Of::SolidAngle(SolidAngleSampler::new(polygon, x))
            }
            (Surface::Polygon(_), By::ProjectedSolidAngle) => {
                let lines = AngularLines::by_projected_solid_angle(polygon, 0.0, x, n);
                Of::Projected(PointsOnLines(lines))
            }
            (Surface::Polygon(_), By::Lobes) => Of::Lobes(Lobes::new(polygon, x, &cosines)),
            (Surface::Sphere(_), By::Area) => Of::SphereCap(SphereCap::whole(sphere)),
            (Surface::Sphere(_), By::VisibleArea) => Of::SphereCap(SphereCap::visible(sphere, x)),
            (Surface::Sphere(_), By::ProjectedSolidAngle) => {
                match SphereProjected::new(sphere, x, n) {
                    Some(projected) => Of::SphereProjected(projected),
                    None => Of::SphereCap(SphereCap::whole(sphere)),
                }
            }
            (Surface::Sphere(_), _) => {
                let lobes = lobes(&sphere.outline(x).expect("from outside"));
                let lobes = lobes.filter(|_| by == By::Lobes);
                lobes.unwrap_or(Of::SphereCone(SphereCone::new(sphere, x)))
            }
            (Surface::Disk(_), By::Area | By::VisibleArea) => Of::DiskArea(DiskArea::new(disk)),
            (Surface::Disk(_), By::ProjectedSolidAngle) => {
                Of::DiskChords(DiskChords::new(disk, 0.0, x, &[n]))
            }
            (Surface::Disk(_), _) => {
                let lobes = lobes(disk).filter(|_| by == By::Lobes);
                lobes.unwrap_or(Of::DiskCone(DiskCone::new(disk, x)))
            }
            (Surface::Cylinder(view), By::Area) => {
                Of::CylinderArea(CylinderArea::whole(view.cylinder()))
            }
            (Surface::Cylinder(view), By::VisibleArea) => {
                Of::CylinderArea(CylinderArea::visible(view.cylinder(), x))
            }
            (Surface::Cylinder(_), By::ProjectedSolidAngle) => along(ChordMeasure::Projected),
            (Surface::Cylinder(_), _) => along(ChordMeasure::SolidAngle),
        }
    }
}

/// How far a point is off a surface.
fn off(surface: &Surface<'_>, p: DVec3) -> f64 {
    match surface {
        Surface::Polygon(polygon) => {
            let (n, corners) = (polygon.normal(), polygon.vertices());
            let next = corners.iter().cycle().skip(1);
            let outside = |(a, b): (&DVec3, &DVec3)| (*b - *a).normalize().cross(n).dot(p - *a);
            let outside = corners.iter().zip(next).map(outside).fold(0.0, f64::max);
            n.dot(p - corners[0]).abs().max(outside)
        }
        Surface::Sphere(sphere) => (p.distance(sphere.center) - sphere.radius).abs(),
        Surface::Disk(disk) => {
            let from = p - disk.center;
            disk.normal.dot(from).abs().max(from.length() - disk.radius)
        }
        Surface::Cylinder(view) => {
            let Cylinder { axis, radius } = *view.cylinder();
            let (along, from) = (axis.direction(), p - axis.p0);
            let height = along.dot(from);
            let beyond = (-height).max(height - axis.length());
            ((from - along * height).length() - radius)
                .abs()
                .max(beyond)
        }
    }
}

/// What the sampler itself gives for random numbers and for a point, per solid angle.
fn by_itself(technique: &impl PointTechnique, u: [f64; 2], at: &LightPoint) -> [f64; 5] {
    fn per_angle<T: PointTechnique>(_: &T, pdf: Pdf<T::Measure>, at: &LightPoint) -> f64 {
        T::Measure::to_solid_angle(pdf, at.square, at.cos_light).value()
    }
    let sample = technique.sample(u);
    let [x, y, z] = sample.point.to_array();
    let drawn = per_angle(technique, sample.pdf, at);
    [
        x,
        y,
        z,
        drawn,
        per_angle(technique, technique.pdf(at.point), at),
    ]
}

/// The same of any source that is a technique.
fn by_technique(source: &PointSource<'_>, u: [f64; 2], at: &LightPoint) -> Option<[f64; 5]> {
    Some(match source {
        PointSource::Area(s) => by_itself(s, u, at),
        PointSource::Proxy(s) => by_itself(s, u, at),
        PointSource::SolidAngle(s) => by_itself(s, u, at),
        PointSource::Projected(s) => by_itself(s, u, at),
        PointSource::SphereCap(s) => by_itself(s, u, at),
        PointSource::SphereCone(s) => by_itself(s, u, at),
        PointSource::SphereProjected(s) => by_itself(s, u, at),
        PointSource::DiskArea(s) => by_itself(s, u, at),
        PointSource::DiskCone(s) => by_itself(s, u, at),
        PointSource::DiskChords(s) => by_itself(s, u, at),
        PointSource::CylinderArea(s) => by_itself(s, u, at),
        PointSource::CylinderLines(s) => by_itself(s, u, at),
        PointSource::Lobes(_) | PointSource::DiskLobes(_) | PointSource::Texture(_) => return None,
    })
}

/// Whether a density at a point is `drawn`: it may be what it is as far around as the point is
/// rounded, and a cosine that is as much off as the normal turns, or the direction, on that way.
fn is_near(
    drawn: f64,
    at: &LightPoint,
    x: DVec3,
    surface: &Surface<'_>,
    density: impl Fn(&LightPoint) -> f64,
) -> bool {
    let frame = Frame::from_normal(surface.normal(at.point));
    let here = density(at);
    let around = [frame.x, -frame.x, frame.y, -frame.y].map(|way| {
        let beside = LightPoint::new(at.point + way * SLACK, x, surface);
        (density(&beside) - here).abs()
    });
    let change = around.into_iter().fold(0.0, f64::max);
    let size = match surface {
        Surface::Sphere(sphere) => sphere.radius,
        Surface::Cylinder(view) => view.cylinder().radius,
        Surface::Polygon(_) | Surface::Disk(_) => at.square.sqrt(),
    };
    let cosine = SLACK / (size * at.cos_light.abs());
    (drawn - here).abs() <= (64.0 * f64::EPSILON + cosine) * drawn + change
}

fn bits<const N: usize>(numbers: [f64; N]) -> [u64; N] {
    numbers.map(f64::to_bits)
}

/// The numbers of eight draws.
fn numbers(rng: &mut SplitMix64) -> [[f64; 8]; 2] {
    [0; 2].map(|_| std::array::from_fn(|_| rng.next_f64()))
}

/// A point lies on its surface, and its density and place are as [`LightPoint`] says.
fn check(drawn: (LightPoint, f64), x: DVec3, surface: &Surface<'_>, what: &str) {
    let (at, density) = drawn;
    assert!(
        off(surface, at.point) <= SLACK,
        "{what}: {at:?} off {}",
        off(surface, at.point)
    );
    assert_eq!(at.to_light, at.point - x, "{what}");
    let square = at.to_light.length_squared();
    assert_eq!(bits([at.square]), bits([square]), "{what}");
    let cosine = -surface.normal(at.point).dot(at.to_light) / at.square.sqrt();
    assert!(
        (at.cos_light - cosine).abs() <= 8.0 * f64::EPSILON,
        "{what}"
    );
    assert!(density.is_finite() && density >= 0.0, "{what}: {density}");
    // The side in view is where a ray first meets the surface, along it off by 1/cos of the point.
    if at.cos_light > 0.1
        && surface.border(at.point, x, |inside| f64::from(u8::from(inside > 1e-6))) > 0.0
    {
        let met = surface.meets(x, at.direction).expect(what);
        assert!(
            met.distance(at.point) <= 10.0 * SLACK,
            "{what}: {met} for {at:?}"
        );
    }
}

#[test]
fn points_are_those_of_their_samplers() {
    let mut rng = rng(5);
    for case in 0..cases(400) {
        let scene = Scene::new(&mut rng);
        let (x, knows) = (scene.x, case % 4 > 0);
        for (surface, by) in scene
            .surfaces()
            .into_iter()
            .flat_map(|s| POINTS.map(|by| (s, by)))
        {
            let what = &format!("case {case}, {by:?} on {surface:?}");
            let source = PointSource::new(by, surface, None::<&NoTexture>, &scene.viewer(knows));
            let hand = scene.points_by_hand(by, &surface, knows);
            assert_eq!(format!("{source:?}"), format!("{hand:?}"), "{what}");
            let u = numbers(&mut rng);
            let [mut px, mut py, mut pz, mut pdf] = [[[0.0; 8]]; 4];
            let out = PointColumns {
                point: [&mut px, &mut py, &mut pz],
                pdf: &mut pdf,
            };
            let local = source.sample_into([&[u[0]], &[u[1]]], out);
            for i in 0..8 {
                let u = [u[0][i], u[1][i]];
                let Some((at, density)) = source.draw(u, &surface, x) else {
                    assert!(matches!(source, PointSource::DiskLobes(_)), "{what}");
                    continue;
                };
                let own = by_technique(&source, u, &at);
                assert_eq!(own.is_some(), local.is_some(), "{what}");
                if let (Some(own), Some(local)) = (own, local) {
                    let [x0, y0, z0] = at.point.to_array();
                    let said = [x0, y0, z0, density, source.density(&at)];
                    assert_eq!(bits(said), bits(own), "{what}");
                    let column = if local {
                        at.density(Pdf::<Area>::new(pdf[0][i]))
                    } else {
                        pdf[0][i]
                    };
                    let side_by_side = [px[0][i], py[0][i], pz[0][i], column, own[4]];
                    assert_eq!(bits(side_by_side), bits(own), "{what}");
                }
                if density > 0.0 {
                    check((at, density), x, &surface, what);
                    let near = is_near(density, &at, x, &surface, |at| source.density(at));
                    assert!(near, "{what}: {density}, {}", source.density(&at));
                }
            }
        }
    }
}

fn setup(rng: &mut SplitMix64) -> LineSetup {
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

/// Lines by a density, told by the table of shapes.
fn lines_by_hand<'t>(
    scene: &'t Scene,
    by: LineDensity,
    surface: &Surface<'_>,
    setup: LineSetup,
) -> Option<LineFamily<'t>> {
    let (x, [n, g], angle) = (scene.x, scene.normals, setup.angle);
    let polygon = &scene.polygon;
    let uniform = setup.offset == OffsetDensity::Uniform;
    let measure = match by {
        LineDensity::Area | LineDensity::Texture if uniform => ChordMeasure::Uniform,
        LineDensity::Area | LineDensity::Texture => ChordMeasure::Length,
        LineDensity::SolidAngle | LineDensity::Warped => ChordMeasure::SolidAngle,
        LineDensity::Projected => ChordMeasure::Projected,
    };
    Some(match (surface, by) {
        (Surface::Sphere(_) | Surface::Disk(_), _) => return None,
        (Surface::Cylinder(view), _) => {
            LineFamily::Cylinder(CylinderLines::of(view, &[n, g], measure))
        }
        (_, LineDensity::SolidAngle) => {
            LineFamily::Angular(AngularLines::by_solid_angle(polygon, angle, x))
        }
        (_, LineDensity::Warped) => {
            LineFamily::Angular(AngularLines::by_warped_solid_angle(polygon, angle, x))
        }
        (_, LineDensity::Projected) => {
            LineFamily::Angular(AngularLines::by_projected_solid_angle(polygon, angle, x, n))
        }
        (_, _) => LineFamily::Area(LineSampler::new(polygon, angle, setup.offset)),
    })
}

/// A line, the height over its plane, the line through a point of it, and a point with its density.
type Drawn = (LineSample, f64, Segment, DVec3, f64);

/// What lines themselves give.
fn drawn_by_itself(
    family: &LineFamily<'_>,
    [u, v]: [f64; 2],
    parts: &[Interval],
    at: &LightPoint,
) -> Drawn {
    fn parallel<L: LineTechnique>(
        lines: &L,
        [u, v]: [f64; 2],
        parts: &[Interval],
        at: &LightPoint,
    ) -> Drawn {
        let line = lines.sample(u);
        let sample = lines.point(&line, parts, v);
        let pdf = L::Measure::to_solid_angle(sample.pdf, at.square, at.cos_light);
        (
            line,
            1.0,
            through(lines.lines(), at.point),
            sample.point,
            pdf.value(),
        )
    }
    match family {
        LineFamily::Area(lines) => parallel(lines, [u, v], parts, at),
        LineFamily::Angular(lines) => parallel(lines, [u, v], parts, at),
        LineFamily::Texture(lines) => parallel(lines, [u, v], parts, at),
        LineFamily::Cylinder(lines) => {
            let line = lines.sample(u);
            let sample = lines.point(&line, parts, v);
            let through = lines.through(at.point);
            (
                line,
                lines.height(&line),
                through,
                sample.point,
                sample.pdf.value(),
            )
        }
    }
}

/// Points of the lines of a family, and what it says of them, against what the lines say.
fn check_lines(
    family: &LineFamily<'_>,
    surface: &Surface<'_>,
    x: DVec3,
    rng: &mut SplitMix64,
    what: &str,
) {
    for _ in 0..4 {
        let [u, v, a, b] = std::array::from_fn(|_| rng.next_f64());
        let parts = [
            Interval::new(0.4 * a, 0.4),
            Interval::new(0.6, 0.6 + 0.4 * b),
        ];
        let line = family.sample(u);
        let (at, density) = family.point(&line, &parts, v, x, surface);
        let (height, through) = (family.height(&line), family.through(at.point));
        let got = (line, height, through, at.point, density);
        assert_eq!(got, drawn_by_itself(family, [u, v], &parts, &at), "{what}");
        // A line of no length is below a horizon.
        if density > 0.0 && line.segment.length() > 0.0 {
            check((at, density), x, surface, what);
            let across = family.direction().cross(line.segment.direction()).length();
            assert!(across <= SLACK / line.segment.length(), "{what}: {across}");
            let near = is_near(density, &at, x, surface, |at| family.density(at, &parts));
            assert!(near, "{what}: {density}, {}", family.density(&at, &parts));
        }
    }
}

#[test]
fn lines_are_those_of_their_samplers() {
    let mut rng = rng(6);
    for case in 0..cases(400) {
        let scene = Scene::new(&mut rng);
        for (surface, by) in scene
            .surfaces()
            .into_iter()
            .flat_map(|s| LINES.map(|by| (s, by)))
        {
            let what = &format!("case {case}, {by:?} on {surface:?}");
            let setup = setup(&mut rng);
            let family =
                LineFamily::new(by, surface, None::<&NoTexture>, setup, &scene.viewer(false));
            let hand = lines_by_hand(&scene, by, &surface, setup);
            assert_eq!(format!("{family:?}"), format!("{hand:?}"), "{what}");
            if let Some(family) = family {
                check_lines(&family, &surface, scene.x, &mut rng, what);
            }
        }
    }
}

/// An image on a quad, of which a light may be a part.
struct Painted<'a> {
    quad: ConvexPolygon,
    image: &'a ImportanceImage,
    fits: bool,
}

impl EmissionTexture for Painted<'_> {
    fn radiance(&self, on_light: DVec3) -> DVec3 {
        on_light
    }

    fn points(&self) -> Option<TexturedSampler<'_>> {
        TexturedSampler::new(&self.quad, self.image)
    }

    fn fits(&self) -> bool {
        self.fits
    }

    fn over(&self, _: &ConvexPolygon) -> Option<&ImportanceImage> {
        self.fits.then_some(self.image)
    }
}

/// A quad with an image, and a part of it.
fn painted() -> (ImportanceImage, ConvexPolygon, ConvexPolygon) {
    let image = ImportanceImage::new(3, 2, &[1.0, 4.0, 2.0, 0.5, 3.0, 0.0]).expect("not black");
    let quad = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X * 2.0, DVec3::Y).expect("a quad");
    let half = quad.clip(DVec3::X * 0.8, DVec3::new(1.0, 0.5, 0.0));
    (image, quad, half.expect("a part"))
}

/// Where the quad and its part are looked at from.
const BELOW: Viewer<'_> = Viewer {
    position: DVec3::new(0.3, 0.1, -0.5),
    normal: DVec3::Z,
    geometric_normal: DVec3::Z,
    cosines: None,
};

/// Points by a texture on a part of what it covers: those that lie on the part, as they are.
#[test]
fn textured_points_are_those_of_their_sampler() {
    let mut rng = rng(7);
    let (image, quad, half) = painted();
    let sampler = TexturedSampler::new(&quad, &image).expect("a quad");
    let x = BELOW.position;
    let mut missed = 0;
    for (light, fits) in [(&quad, true), (&half, false)] {
        let texture = Painted {
            quad,
            image: &image,
            fits,
        };
        assert_eq!(texture.radiance(x), x);
        let surface = Surface::Polygon(light);
        let source = PointSource::new(PointDensity::Texture, surface, Some(&texture), &BELOW);
        for _ in 0..cases(400) {
            let u = [rng.next_f64(), rng.next_f64()];
            let sample = sampler.sample(u);
            let Some((at, density)) = source.draw(u, &surface, x) else {
                assert!(off(&surface, sample.point) > -SLACK && !fits);
                missed += 1;
                continue;
            };
            check((at, density), x, &surface, "texture");
            let moved = at.point.distance(sample.point);
            assert!(moved <= if fits { 0.0 } else { SLACK }, "{moved}");
            assert_eq!(bits([density]), bits([at.density(sample.pdf)]));
            assert!(is_near(density, &at, x, &surface, |at| source.density(at)));
        }
        let u = numbers(&mut rng);
        let [mut a, mut b, mut c, mut pdf] = [[[0.0; 8]]; 4];
        let out = PointColumns {
            point: [&mut a, &mut b, &mut c],
            pdf: &mut pdf,
        };
        assert_eq!(source.sample_into([&[u[0]], &[u[1]]], out), None);
    }
    // What is cut off has a fifth of the area and of the light.
    assert!(missed > cases(400) / 10);
}

/// Lines by a texture along an edge, or as they are asked for, where it covers the light.
#[test]
fn textured_lines_are_those_of_their_sampler() {
    let mut rng = rng(11);
    let (image, quad, half) = painted();
    for case in 0..cases(100) {
        let (light, fits) = [(&quad, true), (&half, false)][case as usize % 2];
        let (texture, surface) = (
            Painted {
                quad,
                image: &image,
                fits,
            },
            Surface::Polygon(light),
        );
        let setup = setup(&mut rng);
        let by = LineDensity::Texture;
        let family = LineFamily::new(by, surface, Some(&texture), setup, &BELOW).expect("lines");
        let axis = match (2.0 * setup.fraction).floor().rem_euclid(2.0) > 0.5 {
            true => TextureAxis::V,
            false => TextureAxis::U,
        };
        let want = match (fits, setup.fixed) {
            (false, _) => None,
            (true, true) => TexturedLines::new(light, &image, setup.fraction * PI),
            (true, false) => TexturedLines::along(light, &image, axis),
        };
        let by_area = LineFamily::Area(LineSampler::new(light, setup.angle, setup.offset));
        let want = want.map_or(by_area, LineFamily::Texture);
        assert_eq!(format!("{family:?}"), format!("{want:?}"));
        check_lines(&family, &surface, BELOW.position, &mut rng, "texture");
    }
}

/// The outline is what rays touch, the disk before the sphere has the same cone and touches it,
/// and a triangle that reaches into the sphere is not clear of it.
#[test]
fn outlines_are_tangent() {
    let mut rng = rng(8);
    for _ in 0..cases(400) {
        let Scene { sphere, x, .. } = Scene::new(&mut rng);
        let [outline, before] =
            [sphere.outline(x), sphere.before(x)].map(|d| d.expect("from outside"));
        assert_eq!(outline.normal, before.normal);
        let frame = Frame::from_normal(outline.normal);
        for turn in [0.0, 1.0, 2.5, 4.0] {
            let way = frame.x * f64::cos(turn) + frame.y * f64::sin(turn);
            for disk in [outline, before] {
                let ray = (disk.center + way * disk.radius - x).normalize();
                let distance = ray.cross(sphere.center - x).length();
                assert!(
                    (distance - sphere.radius).abs() <= SLACK,
                    "{distance} for {sphere:?}"
                );
            }
        }
        let height = (before.center - sphere.center).dot(outline.normal);
        assert!((height - sphere.radius).abs() <= SLACK);
        let around = [0.0, 2.0, 4.0].map(|turn: f64| frame.x * turn.cos() + frame.y * turn.sin());
        for (part, clear) in [(1.01, true), (0.99, false), (-0.99, false), (-1.01, true)] {
            let middle = sphere.center + outline.normal * (sphere.radius * part);
            assert_eq!(sphere.is_clear_of(around.map(|way| middle + way)), clear);
        }
        let inside = sphere.center + outline.normal * (0.5 * sphere.radius);
        assert!(sphere.outline(inside).is_none() && sphere.before(inside).is_none());
        let border = Surface::Sphere(&sphere).border(x, inside, |_| 0.0);
        assert_eq!(bits([border]), bits([1.0]));
    }
}

/// The polygon around a disk touches it in the middle of its edges, 1e-9 of the radius off, and
/// turns as the one around the unit circle.
#[test]
fn polygons_around_disks_touch_them() {
    let mut rng = rng(9);
    let unit = around_unit_circle();
    for _ in 0..cases(400) {
        let Scene { disk, .. } = Scene::new(&mut rng);
        let frame = Frame::from_normal(disk.normal);
        let corners = disk.around();
        for k in 0..Disk::CORNERS {
            let (corner, next) = (corners[k], corners[(k + 1) % Disk::CORNERS]);
            let middle = disk.center.distance(0.5 * (corner + next)) / disk.radius;
            assert!(
                (middle - 1.0 - 1e-9).abs() <= SLACK / disk.radius,
                "{middle}"
            );
            let [p, q] = unit[k];
            let same = disk.center + (frame.x * p + frame.y * q) * disk.radius;
            assert!(corner.distance(same) <= SLACK);
        }
    }
}

/// Half the width of a rectangle, a disk and a sphere, and of what is seen of a cylinder; and the
/// borders that a point on the light is this and that far from.
#[test]
fn borders_are_where_they_are() {
    let x = DVec3::new(0.0, 0.0, -3.0);
    let quad = ConvexPolygon::parallelogram(DVec3::ZERO, DVec3::X * 2.0, DVec3::Y).expect("a quad");
    let sphere = Sphere {
        center: DVec3::ZERO,
        radius: 1.5,
    };
    let disk = Disk {
        center: DVec3::ZERO,
        normal: DVec3::Z,
        radius: 0.5,
    };
    let axis = Segment::new(DVec3::ZERO, DVec3::X * 4.0);
    let view = CylinderView::new(&Cylinder { axis, radius: 1.5 }, x).expect("from outside");
    // Of a sphere or a cylinder half as wide as far away, the rim is at 60°, or 30° off the axis.
    let rim = 1.5 * (0.75_f64).sqrt();
    let nearest = DVec3::Z * -1.5;
    let cases = [
        (
            Surface::Polygon(&quad),
            0.5,
            DVec3::new(0.5, 0.25, 0.0),
            0.5 * 1.5 * 0.25 * 0.75,
        ),
        (Surface::Disk(&disk), 0.5, DVec3::new(0.3, 0.0, 0.0), 0.2),
        (Surface::Sphere(&sphere), 1.5, nearest, rim),
        (
            Surface::Cylinder(&view),
            rim,
            nearest + DVec3::X,
            3.0 * 1.5 * TAU / 6.0,
        ),
    ];
    for (surface, half, point, border) in cases {
        assert!((surface.half_width() - half).abs() <= SLACK, "{surface:?}");
        let got = surface.border(point, x, |distance| distance);
        assert!((got - border).abs() <= SLACK, "{got} {surface:?}");
        let flat = matches!(surface, Surface::Polygon(_) | Surface::Disk(_));
        assert_eq!(surface.flat(), flat.then(|| surface.normal(point)));
    }
    // On the sphere's rim as it is seen, 60° off.
    let seen = DVec3::new(rim, 0.0, -0.75);
    assert!(
        Surface::Sphere(&sphere)
            .border(seen, x, |distance| distance)
            .abs()
            <= SLACK
    );
}

/// Samples by lobes on a part of a light: none is beside it, and they see all of it.
#[test]
fn lobes_on_a_part_see_all_of_it() {
    let mut rng = rng(10);
    let quad = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X * 2.0, DVec3::Y).expect("a quad");
    let x = DVec3::new(0.4, 0.3, 0.0);
    let frame = Frame::from_normal(DVec3::new(0.6, 0.0, 0.8));
    let mut cosines = TransformedCosines::new(frame, DVec3::splat(0.3));
    for width in [0.3, 0.6] {
        let map = DMat3::from_diagonal(DVec3::new(width, width, 1.0));
        let albedo = DVec3::splat(0.2);
        cosines.add(TransformedCosine { map, albedo });
    }
    // What is beyond a line through two edges.
    let corners = [[0.25, 0.0], [1.0, 0.0], [1.0, 1.0], [0.75, 1.0]];
    let part = ConvexPolygon::try_new(&corners.map(|[p, q]| DVec3::new(2.0 * p, q, 1.0)));
    let part = part.expect("a part");
    let mut region = RegionSampler::default();
    let sides = (0..4).map(|k| [corners[k], corners[(k + 1) % 4]]);
    region.set([DVec3::Z, DVec3::X * 2.0, DVec3::Y], sides);
    let lobes: Mixture<_, _> = VisibleLobes::within(&region, &quad, x, &cosines, &[0.1, 0.2, 0.15]);
    let (count, mut drawn, mut sum, mut squares) = (100_000, 0, 0.0, 0.0);
    for _ in 0..count {
        let u = [rng.next_f64(), rng.next_f64()];
        if let Some((at, density)) = lobes.draw(u, &quad, x) {
            check((at, density), x, &Surface::Polygon(&part), "a part");
            drawn += 1;
            sum += 1.0 / density;
            squares += 1.0 / (density * density);
        }
    }
    let n = f64::from(count);
    let error = (squares / n - (sum / n) * (sum / n)).sqrt() / n.sqrt();
    let want = SolidAngleSampler::new(&part, x).solid_angle();
    // Once in two millions of such tests.
    assert!(
        (sum / n - want).abs() < 5.0 * error,
        "{} ± {error} for {want}",
        sum / n
    );
    assert!(drawn < count && error < 0.01 * want);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(1_000), failure_persistence: None, ..ProptestConfig::default() })]

    /// Nothing panics, whatever the numbers, and densities are none or densities.
    #[test]
    fn hostile_numbers(
        places in hostile_vectors::<5>(), directions in [hostile_direction(), hostile_direction(), hostile_direction()],
        radius in hostile(), u in [hostile_unit(), hostile_unit()], fraction in hostile(), knows in any::<bool>(),
    ) {
        let [a, b, c, x, q] = places.map(DVec3::from);
        let [n, g, way] = directions.map(DVec3::from);
        let mut cosines = TransformedCosines::new(Frame::from_normal(n), a);
        cosines.add(TransformedCosine { map: DMat3::from_cols(b, c, q), albedo: a });
        let viewer = Viewer { position: x, normal: n, geometric_normal: g, cosines: knows.then_some(&cosines) };
        let setup = LineSetup { fraction, angle: fraction * PI, fixed: true, offset: OffsetDensity::Length };
        let sphere = Sphere { center: a, radius };
        let disk = Disk { center: a, normal: g, radius };
        let polygon = ConvexPolygon::triangle(a, b, c);
        let cylinder = CylinderView::new(&Cylinder { axis: Segment::new(a, b), radius }, x);
        let flat = polygon.as_ref().ok().map(Surface::Polygon);
        let along = cylinder.as_ref().map(Surface::Cylinder);
        let _ = (sphere.outline(x), sphere.before(x), sphere.is_clear_of([b, c, q]), disk.around());
        for surface in [Surface::Sphere(&sphere), Surface::Disk(&disk)].into_iter().chain(flat).chain(along) {
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
            for by in LINES {
                let Some(family) = LineFamily::new(by, surface, None::<&NoTexture>, setup, &viewer) else {
                    continue;
                };
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
