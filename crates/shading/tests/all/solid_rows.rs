//! This module measures the errors of solid angles and of linearly transformed cosines, domain by
//! domain.

use crate::accuracy::{
    LINE_DOMAINS, POLYGON_DOMAINS, Row, Sample, error, lit_segment, log_uniform, printed_error,
    shape, sine,
};
use crate::{naive, oracle};
use linelit_geometry::{DMat3, DVec3, Frame};
use linelit_shading::cylinder;
use linelit_shading::ltc::Ltc;
use linelit_testkit::real::Real;
use linelit_testkit::rng::SplitMix64;
use std::f64::consts::PI;

/// The solid angle of a thin cylinder.
pub(crate) fn solid_angles(count: usize) -> Vec<Row> {
    let mut rows = Vec::new();
    for domain in LINE_DOMAINS {
        let mut rng = SplitMix64::new(7);
        let mut samples = Vec::new();
        while samples.len() < count {
            let (a, b, _) = lit_segment(domain, &mut rng);
            // Closer to the line than that, double-double loses too much as well.
            if sine(a, b) < 1e-13 {
                continue;
            }
            let want = oracle::cylinder_solid_angle(a.to_array(), b.to_array());
            samples.push(Sample {
                condition: 1.0 / sine(a, b),
                ours: error(cylinder::solid_angle(a, b), want, 0.0),
                printed: printed_error(naive::cylinder_solid_angle(a, b), want, 1e-300),
            });
        }
        rows.push(Row {
            function: "cylinder::solid_angle",
            domain,
            samples,
            goal: 1e-13,
        });
    }
    rows
}

/// Corners that were mapped are off by 4 roundings of the inverse and 3 of the product, times the
/// map's condition |M||M⁻¹| (below 1.6 × 105 for [`map`]): η = 7 × 1.1e-16 × 170 = 1.3e-13 of their
/// distance.
const MAPPED: f64 = 1.3e-13;
/// A line's two ends, its sine and its width: 8 η, which is 1e-12.
const LINE_GOAL: f64 = 1e-12;
/// A polygon's sides by the same, both horizons that cut it, and the height above its plane, which
/// is a difference of three products of what is off: 80 η, which is 1e-11.
const POLYGON_GOAL: f64 = 1e-11;
const _: () = assert!(8.0 * MAPPED > LINE_GOAL && 80.0 * MAPPED > POLYGON_GOAL);

/// A map as the tables have them: roughness from 0.1, the skew of grazing views.
fn map(rng: &mut SplitMix64) -> DMat3 {
    let width = log_uniform(rng, -1.5, 0.0);
    DMat3::from_cols(
        DVec3::new(width, 0.0, width * rng.in_range(-0.5, 0.5)),
        DVec3::new(0.0, width * rng.in_range(0.3, 1.0), 0.0),
        DVec3::new(rng.in_range(-1.0, 1.0), 0.0, 1.0),
    )
}

/// Linearly transformed cosines, for a given map and in its own frame: over polygons relative to
/// the mapped solid angle times what is written at [`oracle::ltc_polygon`], along lines relative to
/// the value over the sine of the mapped angle.
pub(crate) fn ltc(count: usize) -> Vec<Row> {
    let mut rows = ltc_polygons(count);
    rows.extend(ltc_lines(count));
    rows
}

/// The map's own frame.
const OWN: Frame = Frame {
    x: DVec3::X,
    y: DVec3::Y,
    z: DVec3::Z,
};

fn ltc_polygons(count: usize) -> Vec<Row> {
    let mut rows = Vec::new();
    for domain in POLYGON_DOMAINS {
        let mut rng = SplitMix64::new(9);
        let mut samples = Vec::new();
        while samples.len() < count {
            let (corners, n) = shape(domain, &mut rng);
            // The domain's normal is the frame's z.
            let turn = Frame::from_normal(n);
            let local: Vec<DVec3> = corners.iter().map(|v| turn.to_local(*v)).collect();
            let m = map(&mut rng);
            let columns = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.to_array());
            let arrays: Vec<[f64; 3]> = local.iter().map(|v| v.to_array()).collect();
            let (want, scale) = oracle::ltc_polygon(columns, &arrays);
            if !(scale > 0.0 && scale.is_finite()) {
                continue;
            }
            let got = Ltc::new(m, PI).polygon(&OWN, &local);
            let inverse = m.inverse();
            let mapped: Vec<DVec3> = local.iter().map(|v| inverse * *v).collect();
            samples.push(Sample {
                condition: 1.0 / scale,
                ours: error(got, want, scale),
                printed: printed_error(naive::polygon(&mapped, DVec3::Z), want, scale),
            });
        }
        rows.push(Row {
            function: "ltc::Ltc::polygon",
            domain,
            samples,
            goal: POLYGON_GOAL,
        });
    }
    rows
}

fn ltc_lines(count: usize) -> Vec<Row> {
    let mut rows = Vec::new();
    // Through the line and nearly perpendicular to it, the rounding of the inverse map decides
    // whether the mapped ends are above the horizon.
    for domain in LINE_DOMAINS
        .into_iter()
        .filter(|d| *d != "near and grazing")
    {
        let mut rng = SplitMix64::new(10);
        let mut samples = Vec::new();
        while samples.len() < count {
            let (a, b, n) = lit_segment(domain, &mut rng);
            let turn = Frame::from_normal(n);
            let (a, b) = (turn.to_local(a), turn.to_local(b));
            let m = map(&mut rng);
            let columns = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.to_array());
            let (want, scale) = oracle::ltc_line(columns, a.to_array(), b.to_array());
            if sine(a, b) < 1e-12 || want.to_f64() < 1e-280 || !scale.is_finite() {
                continue;
            }
            let got = Ltc::new(m, PI).line(&OWN, a, b);
            let inverse = m.inverse();
            let side = a.cross(b).normalize_or_zero();
            let width = (m.transpose() * side).length();
            let printed = naive::cylinder(inverse * a, inverse * b, DVec3::Z) / width;
            samples.push(Sample {
                condition: 1.0 / sine(a, b),
                ours: error(got, want, scale),
                printed: printed_error(printed, want, scale),
            });
        }
        rows.push(Row {
            function: "ltc::Ltc::line",
            domain,
            samples,
            goal: LINE_GOAL,
        });
    }
    rows
}
