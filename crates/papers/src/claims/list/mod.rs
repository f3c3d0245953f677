//! The claims, paper by paper.

mod billen;
mod peters;
mod salesin;
mod shirley;

use super::claim::Claim;

/// All claims, in the order of the papers.
pub(super) fn all() -> Vec<Claim> {
    [
        billen::claims(),
        salesin::claims(),
        peters::claims(),
        shirley::claims(),
    ]
    .concat()
}

/// Why a bound has no tolerance.
const BETTER: &str = "an ordering: the whole interval is on one side";
/// Why a claim of theory has a tolerance.
const THEORY: &str =
    "theory of N → ∞; over the N that are fitted, closed forms differ from it by as much";
