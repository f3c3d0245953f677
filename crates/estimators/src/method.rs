//! What each technique does, by the kind of light and by what is known of the reflection.
//!
//! One function says it for a technique alone ([`Technique::method`]), one for all estimators
//! ([`Estimator::methods`]); `docs/estimators.md` has the table that they make, and a test holds
//! estimates to them.

use crate::{Estimator, Integration, LightSource, LineBy, LinearOptions, PointBy, Points};
use crate::{Lines, ShadingPoint, Technique};
use linelit_bsdf::Reflection;
use linelit_geometry::{DVec3, Segment};
use linelit_lights::Light;
use std::fmt;

/// The kinds of lights that techniques tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LightKind {
    /// A polygon of one radiance.
    Polygon,
    /// A polygon that emits an image.
    Textured,
    /// A linear light.
    Linear,
    /// A sphere.
    Sphere,
    /// A disk.
    Disk,
    /// A cylinder.
    Cylinder,
}

impl LightKind {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Polygon,
        Self::Textured,
        Self::Linear,
        Self::Sphere,
        Self::Disk,
        Self::Cylinder,
    ];

    /// Whether it is a sphere or a disk, which have no lines.
    const fn is_round(self) -> bool {
        matches!(self, Self::Sphere | Self::Disk)
    }

    /// The kind of a light.
    #[must_use]
    pub const fn of<T>(light: &LightSource<'_, T>) -> Self {
        match light.light {
            Light::Area(_) if light.texture.is_some() => Self::Textured,
            Light::Area(_) => Self::Polygon,
            Light::Linear(_) => Self::Linear,
            Light::Sphere(_) => Self::Sphere,
            Light::Disk(_) => Self::Disk,
            Light::Cylinder(_) => Self::Cylinder,
        }
    }
}

impl fmt::Display for LightKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Polygon => "polygon",
            Self::Textured => "textured polygon",
            Self::Linear => "line",
            Self::Sphere => "sphere",
            Self::Disk => "disk",
            Self::Cylinder => "cylinder",
        })
    }
}

/// Where the integrals of a reflection have closed forms
/// ([`Reflection::known`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Closed {
    /// Nowhere.
    Nowhere,
    /// Along lines: it has lobes of Phong or Gaussians.
    AlongLines,
    /// Along lines and over lights: it is diffuse.
    Diffuse,
}

/// What is known of a reflection as linearly transformed cosines
/// ([`Reflection::transformed_cosines`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Cosines {
    /// Nothing.
    Unknown,
    /// It looks like the cosine itself.
    Flat,
    /// It has lobes.
    Lobes,
}

/// What is known of a reflection as one viewer sees it: all that a technique's choice of method
/// depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Known {
    /// Its closed forms.
    pub closed: Closed,
    /// Its transformed cosines.
    pub cosines: Cosines,
    /// Whether its peaks along lines are known ([`Reflection::peaks`]).
    pub peaks: bool,
}

impl Known {
    /// What the reflection at a shading point says of itself.
    pub fn of<R: Reflection>(point: &ShadingPoint<R>) -> Self {
        let (bsdf, wo, n) = (&point.bsdf, point.outgoing, point.normal);
        let closed = match point.known().closed_form() {
            None => Closed::Nowhere,
            Some(form) if form.is_diffuse() => Closed::Diffuse,
            Some(_) => Closed::AlongLines,
        };
        let cosines = match point.cosines() {
            None => Cosines::Unknown,
            Some(cosines) if cosines.lobes().is_empty() => Cosines::Flat,
            Some(_) => Cosines::Lobes,
        };
        let line = Segment::new(n, n + DVec3::X);
        let peaks = bsdf.peaks(&line, wo, n).is_some();
        Self {
            closed,
            cosines,
            peaks,
        }
    }
}

/// What is done about a light on a reflection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Points by a density. With `visibility=shaft`, the closed form, if there is one, where the
    /// shaft is empty.
    Points(PointBy),
    /// Points on a linear light.
    LinearPoints(LinearOptions),
    /// A point of what is visible of each line, or of each of its pieces.
    PointsOfLines(LineBy),
    /// The closed form along what is visible of each line. Without samples where nothing is in
    /// between, if there is a closed form over the whole light.
    AlongLines,
    /// Adaptive quadrature along what is visible of each line.
    QuadratureAlongLines,
    /// The closed form over what is visible of the light, without noise; along lines where too many
    /// triangles are in between.
    OverVisible,
    /// Transformed cosines over what is visible of the light in closed form, and points by them for
    /// what they leave out; points of lines where too many triangles are in between.
    Cosines,
    /// The closed form over what is visible of a linear light, without noise.
    OverLine,
    /// Adaptive quadrature over what is visible of a linear light, without noise.
    Quadrature,
    /// Whichever takes the least time to an equal error: what `exact` does, lines, points in a
    /// shaft, or points with rays.
    Cheapest(Known),
}

impl Method {
    /// Whether the estimate of a light with nothing in between has no noise, if all of it is above
    /// the horizon.
    #[must_use]
    pub fn is_exact_unoccluded(&self, light: LightKind, known: Known) -> bool {
        let has_lines = !matches!(light, LightKind::Textured | LightKind::Linear);
        match self {
            Self::AlongLines if has_lines => known.closed == Closed::Diffuse,
            Self::Cheapest(known) if has_lines => known.closed == Closed::Diffuse,
            _ => self.is_exact(),
        }
    }

    /// Whether the estimate has no noise past occluders, unless too many triangles are in between.
    #[must_use]
    pub const fn is_exact(&self) -> bool {
        matches!(self, Self::OverVisible | Self::OverLine | Self::Quadrature)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Points(by) => write!(f, "points as `{}`", name(Points::by(by))),
            Self::LinearPoints(options) => {
                write!(
                    f,
                    "points as `{}`",
                    Estimator::from(Points::by(PointBy::Linear(options)))
                )
            }
            Self::PointsOfLines(by) => {
                write!(f, "a point of each line as `{}`", name(Lines::by(by)))
            }
            Self::AlongLines => f.write_str("closed form along each line"),
            Self::QuadratureAlongLines => f.write_str("quadrature along each line"),
            Self::OverVisible => f.write_str("closed form over what is visible"),
            Self::Cosines => {
                f.write_str("transformed cosines over what is visible, points for the rest")
            }
            Self::OverLine => f.write_str("closed form over what is visible of the line"),
            Self::Quadrature => f.write_str("quadrature over what is visible of the line"),
            Self::Cheapest(known) => {
                f.write_str("whichever is cheapest: lines, points, rays")?;
                match exact(LightKind::Polygon, known) {
                    Self::PointsOfLines(_) => Ok(()),
                    exact => write!(f, ", or {exact}"),
                }
            }
        }
    }
}

fn name(technique: impl Into<Technique>) -> &'static str {
    technique.into().name()
}

/// What `exact` does.
fn exact(light: LightKind, known: Known) -> Method {
    match (light, known.closed, known.cosines) {
        (LightKind::Polygon, Closed::Diffuse, _) => Method::OverVisible,
        (LightKind::Polygon, _, Cosines::Flat | Cosines::Lobes) => Method::Cosines,
        (LightKind::Sphere | LightKind::Disk, Closed::Diffuse, _) => Method::OverVisible,
        (LightKind::Sphere | LightKind::Disk, _, Cosines::Flat | Cosines::Lobes) => Method::Cosines,
        (LightKind::Sphere | LightKind::Disk, ..) => Method::Points(PointBy::SolidAngle),
        _ => analytic(light, known),
    }
}

/// What `line-analytic` does.
fn analytic(light: LightKind, known: Known) -> Method {
    if light == LightKind::Cylinder && known.closed == Closed::Nowhere && known.peaks {
        Method::QuadratureAlongLines
    } else if light == LightKind::Textured || known.closed == Closed::Nowhere {
        Method::PointsOfLines(LineBy::Area)
    } else {
        Method::AlongLines
    }
}

/// Lines and combinations on a linear light.
fn line(known: Known) -> Method {
    match known {
        Known {
            closed: Closed::AlongLines | Closed::Diffuse,
            ..
        } => Method::OverLine,
        Known { peaks: true, .. } => Method::Quadrature,
        Known { peaks: false, .. } => Method::LinearPoints(LinearOptions::default()),
    }
}

impl Technique {
    /// What the technique does alone. Where the reflection is black, and lights are out of reach,
    /// nothing is done at all.
    #[must_use]
    pub fn method(&self, light: LightKind, known: Known) -> Method {
        match self {
            Self::Points(points) => points.by.method(light, known),
            Self::Lines(_) if light == LightKind::Linear => line(known),
            Self::Lines(lines) => match lines.integration {
                None | Some(Integration::Analytic) if light.is_round() => {
                    Method::Points(PointBy::SolidAngle)
                }
                None => Method::PointsOfLines(lines.by.on(light)),
                Some(Integration::Analytic) => analytic(light, known),
                Some(Integration::Exact(_)) => exact(light, known),
                Some(Integration::Cheapest) => match light {
                    LightKind::Polygon => Method::Cheapest(known),
                    LightKind::Textured => Method::Cheapest(Known {
                        closed: Closed::Nowhere,
                        cosines: Cosines::Unknown,
                        ..known
                    }),
                    LightKind::Sphere | LightKind::Disk => exact(light, known),
                    LightKind::Linear | LightKind::Cylinder => analytic(light, known),
                },
            },
        }
    }
}

impl PointBy {
    fn method(self, light: LightKind, known: Known) -> Method {
        if light == LightKind::Linear {
            return Method::LinearPoints(match self.on_linear() {
                LinearOptions::Ltc(_) if known.cosines < Cosines::Lobes => LinearOptions::default(),
                options => options,
            });
        }
        let polygon = matches!(light, LightKind::Polygon | LightKind::Textured);
        Method::Points(match self {
            Self::VisibleArea if !matches!(light, LightKind::Sphere | LightKind::Cylinder) => {
                Self::Area
            }
            Self::Texture if light == LightKind::Polygon => Self::Area,
            Self::Ltc if light == LightKind::Cylinder || known.cosines < Cosines::Lobes => {
                Self::SolidAngle
            }
            Self::Texture | Self::Proxy if !polygon => Self::SolidAngle,
            Self::Linear(_) => Self::SolidAngle,
            Self::Area
            | Self::VisibleArea
            | Self::SolidAngle
            | Self::ProjectedSolidAngle
            | Self::Ltc
            | Self::Texture
            | Self::Bsdf
            | Self::Proxy => self,
        })
    }
}

impl LineBy {
    /// Which lines it is on a light.
    fn on(self, light: LightKind) -> Self {
        match (self, light) {
            (Self::Texture, LightKind::Textured) => self,
            (Self::Texture, _) => Self::Area,
            (Self::Warped, LightKind::Cylinder) => Self::SolidAngle,
            (Self::Area | Self::SolidAngle | Self::Warped | Self::Projected, _) => self,
        }
    }
}

impl Estimator {
    /// What the estimator does, method by method: of a technique alone one, of a combination one
    /// for each part, but for one where that leaves nothing for the others to add.
    pub fn methods(&self, light: LightKind, known: Known) -> impl Iterator<Item = Method> {
        let one = if let Some(technique) = self.alone() {
            Some(technique.method(light, known))
        } else if light == LightKind::Linear {
            Some(line(known))
        } else if light.is_round() && known.closed != Closed::Nowhere
            || analytic(light, known) != Method::PointsOfLines(LineBy::Area)
        {
            let is_kept = |integration: Integration| light.is_round() && integration.keeps_lines();
            let first = (self.parts()).find(|part| part.technique.integrated().is_some());
            let integrated = first.filter(|part| {
                let integration = part.technique.integrated();
                integration.is_some_and(|(_, integration)| !is_kept(integration))
            });
            integrated.map(|part| part.technique.method(light, known))
        } else {
            None
        };
        let parts = self.parts().map(move |part| match &part.technique {
            Technique::Points(_) => part.technique.method(light, known),
            Technique::Lines(lines) => match part.technique.method(light, known) {
                Method::Cosines => Method::Cosines,
                Method::Cheapest(known) if known.cosines != Cosines::Unknown => {
                    Method::Cheapest(known)
                }
                _ if light.is_round() => Method::Points(PointBy::SolidAngle),
                _ => Method::PointsOfLines(lines.measure().on(light)),
            },
        });
        let count = if one.is_some() { 0 } else { usize::MAX };
        one.into_iter().chain(parts.take(count))
    }
}
