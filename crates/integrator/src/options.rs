//! `key=value` options of estimators.

use crate::{Estimator, ParseEstimatorError, ShaftPoints};
use std::f64::consts::PI;

/// Keys and values of `key=value,…`.
pub(crate) fn pairs(options: &str) -> impl Iterator<Item = (&str, &str)> {
    let options = options.split(',').map(str::trim);
    options
        .filter(|o| !o.is_empty())
        .map(|o| o.split_once('=').unwrap_or((o, "")))
}

/// The fraction of a half turn in `fixed:FRACTION`, 0 if it is not said; `None` for anything else, and for fractions so
/// large that there is no number for the angle.
pub(crate) fn fixed(value: &str) -> Option<f64> {
    let fraction: f64 = match value.strip_prefix("fixed")? {
        "" => 0.0,
        rest => rest.strip_prefix(':')?.parse().ok()?,
    };
    (fraction * PI).is_finite().then_some(fraction)
}

/// `visibility=rays` or `visibility=shaft`.
pub(crate) fn points(
    name: &str,
    options: &str,
    rays: Estimator,
    shaft: ShaftPoints,
) -> Result<Estimator, ParseEstimatorError> {
    let mut out = rays;
    for (key, value) in pairs(options) {
        out = match (key, value) {
            ("visibility", "rays") => rays,
            ("visibility", "shaft") => Estimator::ShaftPoints(shaft),
            ("visibility", _) => {
                return Err(ParseEstimatorError::new(format!(
                    "visibility `{value}`; expected rays or shaft"
                )));
            }
            _ => {
                return Err(ParseEstimatorError::new(format!(
                    "`{name}` has no option `{key}`; expected visibility"
                )));
            }
        };
    }
    Ok(out)
}
