//! These tests compare the powers of lights and the conversions of densities with their
//! definitions.

use linelit_geometry::{ConvexPolygon, DVec3, Segment};
use linelit_lights::linear::ProjectedLine;
use linelit_lights::{
    AngularLines, Area, AreaLight, Cylinder, CylinderLight, Disk, DiskLight, Emission, Length,
    Light, LineSampler, LineTechnique, LinearLight, Offset, OffsetDensity, Pdf, SolidAngle, Sphere,
    SphereLight, ThinSolidAngle,
};
use linelit_testkit::assert_close;
use std::f64::consts::PI;

/// A few roundings.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// The power is π times the area times the mean of the radiance, on each side; for a linear light
/// it is the power of a cylinder of the radius R whose radiance is the given product divided by R.
#[test]
fn powers_are_of_areas() {
    let radiance = DVec3::new(1.0, 2.5, 4.0);
    let [center, normal] = [DVec3::new(0.3, -2.0, 1.0), DVec3::Z];
    let (radius, length) = (0.7, 3.0);
    let axis = Segment::new(center, center + DVec3::new(1.0, 2.0, 2.0));
    let corners = [center, center + DVec3::X * 0.5, center + DVec3::Y * 1.5];
    for (two_sided, sides) in [(false, 1.0), (true, 2.0)] {
        let emission = Emission {
            radiance,
            two_sided,
        };
        let polygon = ConvexPolygon::new(&corners).expect("a triangle");
        let disk = Disk {
            center,
            normal,
            radius,
        };
        let sphere = Sphere { center, radius };
        let cylinder = Cylinder { axis, radius };
        let radiance_radius = radiance;
        let lights = [
            (Light::Area(AreaLight { polygon, emission }), sides * 0.375),
            (
                Light::Disk(DiskLight { disk, emission }),
                sides * PI * radius * radius,
            ),
            (
                Light::Sphere(SphereLight { sphere, radiance }),
                4.0 * PI * radius * radius,
            ),
            (
                Light::Cylinder(CylinderLight { cylinder, radiance }),
                2.0 * PI * radius * length,
            ),
            (
                Light::Linear(LinearLight {
                    segment: axis,
                    radiance_radius,
                }),
                2.0 * PI * length,
            ),
        ];
        for (light, area) in lights {
            assert_close!(light.power(), PI * area * 2.5, rel = ROUNDING, "{light:?}");
            let channels = light.power_by_channel();
            for (found, one) in channels.to_array().into_iter().zip(radiance.to_array()) {
                assert_close!(found, PI * area * one, rel = ROUNDING, "{light:?}");
            }
        }
    }
}

/// Of 3 at r² = 6.25 and the cosines −0.4 and 0.3, and h = 1.5.
#[test]
fn densities_are_converted_by_their_ratio() {
    let close = |got: f64, want: f64| assert_close!(got, want, rel = ROUNDING, "a conversion");
    let (r, h) = (2.5, 1.5);
    close(
        Pdf::<Area>::new(3.0).to_solid_angle(r * r, -0.4).value(),
        3.0 * 6.25 / 0.4,
    );
    close(
        Pdf::<SolidAngle>::new(3.0).to_area(r * r, -0.4).value(),
        3.0 * 0.4 / 6.25,
    );
    close(
        Pdf::<Offset>::new(3.0)
            .joint(Pdf::<Length>::new(0.7))
            .value(),
        2.1,
    );
    let per_length = 2.0 * h / (r * r * r);
    close(
        Pdf::<Length>::new(3.0).to_thin_solid_angle(r, h).value(),
        3.0 / per_length,
    );
    close(
        Pdf::<ThinSolidAngle>::new(3.0).to_length(r, h).value(),
        3.0 * per_length,
    );
    close(Pdf::<Area>::new(3.0).scaled(0.3).value(), 0.9);
}

/// What a sample says of its density is what is said of its offset.
#[test]
fn sampled_lines_have_the_density_of_their_offset() {
    fn check(name: &str, lines: &impl LineTechnique) {
        for u in [0.1, 0.3, 0.5, 0.7, 0.9] {
            let line = lines.sample(u);
            let want = lines.pdf(line.offset).value();
            // The offset is rounded, from which the pieces' places are formed anew.
            assert_close!(line.pdf.value(), want, rel = 1e-12, "{name} {u}");
        }
    }
    let (polygon, x, n) = (triangle(), DVec3::ZERO, DVec3::new(0.0, 0.6, 0.8));
    for density in [OffsetDensity::Uniform, OffsetDensity::Length] {
        let name = format!("{density:?}");
        check(&name, &LineSampler::new(&polygon, 0.7, density));
    }
    check("solid", &AngularLines::by_solid_angle(&polygon, 0.7, x));
    check(
        "warped",
        &AngularLines::by_warped_solid_angle(&polygon, 0.7, x),
    );
    let projected = AngularLines::by_projected_solid_angle(&polygon, 0.7, x, n);
    check("projected", &projected);
}

fn triangle() -> ConvexPolygon {
    let corners = [[-1.0, -0.5, 1.5], [1.25, -0.75, 1.25], [0.5, 1.0, 2.0]].map(DVec3::from);
    ConvexPolygon::new(&corners).expect("a triangle")
}

/// Offsets that are linear in their angle between a light's corners are a choice: samples and
/// densities have to agree for any choice.
#[test]
fn warped_offsets_are_frozen() {
    let lines = AngularLines::by_warped_solid_angle(&triangle(), 0.7, DVec3::ZERO);
    let found = [0.1, 0.3, 0.5, 0.7, 0.9].map(|u| lines.sample(u).offset);
    let want = [
        -0.913_580_586_701_533_6,
        -0.552_347_775_929_856_7,
        -0.299_072_377_846_936_2,
        -0.078_854_798_718_726_69,
        0.163_745_134_229_875_38,
    ];
    for (got, want) in found.into_iter().zip(want) {
        assert_close!(got, want, 1e-13, "{found:?}");
    }
}

/// Per solid angle, the cosine over the projected solid angle.
#[test]
fn the_density_on_a_line_is_of_its_cosine() {
    let ends = [DVec3::new(-1.0, 0.5, 0.75), DVec3::new(1.5, 0.25, 1.0)];
    let n = DVec3::new(0.0, 0.6, 0.8);
    let line = ProjectedLine::new(ends[0], ends[1], n).expect("above the horizon");
    for place in [0.1, 0.4, 0.9] {
        let cosine = n.dot(ends[0].lerp(ends[1], place).normalize());
        let got = line.pdf(place) * line.projected_solid_angle();
        assert_close!(got, cosine, rel = 8.0 * ROUNDING, "{place}");
    }
}
