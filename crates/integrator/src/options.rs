//! `key=value` options of estimators.

use crate::{Estimator, ParseEstimatorError, ShaftPoints};

/// Keys and values of `key=value,…`.
pub(crate) fn pairs(options: &str) -> impl Iterator<Item = (&str, &str)> {
    let options = options.split(',').map(str::trim);
    options
        .filter(|o| !o.is_empty())
        .map(|o| o.split_once('=').unwrap_or((o, "")))
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
