//! `point-linear`: points on linear lights by any technique of Peters 2021.

use super::solid_angle::SolidAngle;
use super::{PointDensity, Polygon};
use crate::EmissionTexture;
use crate::text::{Options, OwnOptions, Result, error, unknown};
use linelit_lights::SolidAngleSampler;
use linelit_lights::linear::LinearTechnique;

/// How points on linear lights are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinearOptions {
    /// One technique.
    Technique(LinearTechnique),
    /// As many samples by projected solid angle, for what is diffuse, as by linearly transformed
    /// cosines, for the lobes. On a surface without a lobe, the first alone.
    Ltc(LinearHeuristic),
}

/// How diffuse and glossy samples of a linear light are weighted (Peters 2021, section 4.2).
///
/// The heuristics but the first know the unshadowed diffuse and glossy light cₖ, by channel, in
/// closed form. The share ν of them is the visibility that is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinearHeuristic {
    /// By the densities, which any technique may have in place of projected solid angle.
    Balance(LinearTechnique),
    /// By cₖ times the densities; perfect where nothing is hidden.
    WeightedBalance,
    /// The optimal heuristic for the visibility ν. Contributions of hidden samples count, and may
    /// be negative.
    Optimal(f64),
    /// ν times the weighted balance and 1 − ν times the balance.
    ClampedOptimal(f64),
}

impl Default for LinearOptions {
    fn default() -> Self {
        Self::Technique(LinearTechnique::ProjectedSolidAngle)
    }
}

/// Peters' ν.
const NU: f64 = 0.5;

impl Default for LinearHeuristic {
    /// Clamped optimal, expecting half of the light to be visible.
    fn default() -> Self {
        Self::ClampedOptimal(NU)
    }
}

impl PointDensity for LinearOptions {
    const NAME: &'static str = "point-linear";
    const HAS_OWN_MIS: bool = true;

    type OnPolygon<'t> = SolidAngleSampler;

    fn on_polygon<T: EmissionTexture>(self, light: &Polygon<'_, T>) -> Option<SolidAngleSampler> {
        SolidAngle.on_polygon(light)
    }

    fn on_linear(self) -> Self {
        self
    }
}

impl OwnOptions for LinearOptions {
    fn read(self, options: &mut Options<'_>) -> Result<Self> {
        let (technique, mis) = (options.take("technique"), options.take("mis"));
        let with = options.take("with").map(named).transpose()?;
        let mut nu = None;
        let share = |text: &str| text.parse().ok().filter(|nu| (0.0..=1.0).contains(nu));
        options.read("nu", "0 to 1", |text| share(text).map(Some), &mut nu)?;
        match technique {
            Some("ltc") => heuristic(mis, nu, with).map(Self::Ltc),
            _ if mis.is_some() || nu.is_some() || with.is_some() => {
                error("`mis`, `nu` and `with` are of the two techniques of `technique=ltc`")
            }
            None => Ok(self),
            Some(name) => named(name).map(Self::Technique),
        }
    }

    fn write(self, out: &mut Vec<String>) {
        let (mis, nu) = match self {
            Self::Technique(LinearTechnique::ProjectedSolidAngle) => return,
            Self::Technique(technique) => {
                return out.push(format!("technique={}", technique.name()));
            }
            Self::Ltc(LinearHeuristic::Balance(_)) => (Some("balance"), None),
            Self::Ltc(LinearHeuristic::WeightedBalance) => (Some("weighted-balance"), None),
            Self::Ltc(LinearHeuristic::Optimal(nu)) => (Some("optimal"), Some(nu)),
            Self::Ltc(LinearHeuristic::ClampedOptimal(nu)) => (None, Some(nu)),
        };
        out.push("technique=ltc".to_owned());
        out.extend(mis.map(|mis| format!("mis={mis}")));
        let nu = nu.filter(|nu| (nu - NU).abs() > 0.0);
        out.extend(nu.map(|nu| format!("nu={nu}")));
        if let Self::Ltc(LinearHeuristic::Balance(first)) = self
            && first != LinearTechnique::ProjectedSolidAngle
        {
            out.push(format!("with={}", first.name()));
        }
    }
}

fn named(name: &str) -> Result<LinearTechnique> {
    let found = LinearTechnique::ALL.into_iter().find(|t| t.name() == name);
    found.map_or_else(
        || {
            let mut names = LinearTechnique::ALL.map(LinearTechnique::name).to_vec();
            let message = format!("technique `{name}`; expected {} or ltc", names.join(", "));
            names.push("ltc");
            unknown(message, name, names)
        },
        Ok,
    )
}

fn heuristic(
    mis: Option<&str>,
    nu: Option<f64>,
    with: Option<LinearTechnique>,
) -> Result<LinearHeuristic> {
    Ok(match mis {
        Some("balance") if nu.is_none() => {
            LinearHeuristic::Balance(with.unwrap_or(LinearTechnique::ProjectedSolidAngle))
        }
        _ if with.is_some() => return error("`with` stands beside `mis=balance`"),
        None | Some("clamped-optimal") => LinearHeuristic::ClampedOptimal(nu.unwrap_or(NU)),
        Some("optimal") => LinearHeuristic::Optimal(nu.unwrap_or(NU)),
        Some("weighted-balance") if nu.is_none() => LinearHeuristic::WeightedBalance,
        Some(name @ ("balance" | "weighted-balance")) => {
            return error(format!("`mis={name}` knows no nu"));
        }
        Some(name) => {
            let expected = "balance, weighted-balance, optimal or clamped-optimal";
            let names = ["balance", "weighted-balance", "optimal", "clamped-optimal"];
            let message = format!("mis `{name}`; expected {expected}");
            return unknown(message, name, names.to_vec());
        }
    })
}
