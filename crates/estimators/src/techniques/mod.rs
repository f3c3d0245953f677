//! The table of techniques: one row for each, from which the enumerations, names, parser, printer
//! and every dispatch are made.
//!
//! A row `Variant: file::Type` says that `Type` in `points/file.rs`, `lines/file.rs` or
//! `integrals/file.rs` is what `Variant` stands for; `Variant(options): file::Type` that the
//! variant holds it, since it has options. All else is the type's: it implements the trait of its
//! kind, [`points::PointDensity`], [`lines::LineMeasure`] or [`integrals::Integral`], which takes
//! nothing for granted that could leave a light black.

pub(crate) mod integrals;
pub(crate) mod lines;
pub(crate) mod points;

use crate::text::{Options, OwnOptions, Result};
use crate::{LineDirection, Lines, Points};

/// Techniques of points, handed to one of the macros below.
macro_rules! point_techniques {
    ($make:ident $with:tt) => {
        $crate::techniques::$make! { $with PointBy points PointDensity
            /// Uniform on the light's area.
            Area: area::Area,
            /// Uniform on the part of the area that faces the shading point: of a sphere the
            /// visible cap, of other lights all of it.
            VisibleArea: visible_area::VisibleArea,
            /// Uniform on the triangles that a polygon spans at unit distance (Shirley & Wang
            /// 1991), nearly its solid angle; on other lights as [`PointBy::SolidAngle`].
            Proxy: proxy::Proxy,
            /// Uniform in the light's solid angle; of disks within 1 %.
            SolidAngle: solid_angle::SolidAngle,
            /// Uniform in the light's projected solid angle: no noise on diffuse surfaces that see
            /// all of the light; of disks within 2 %.
            ProjectedSolidAngle: projected::ProjectedSolidAngle,
            /// By linearly transformed cosines that look like the reflection, and seldom uniform in
            /// the solid angle. Spheres and disks as [`PointBy::SolidAngle`].
            Ltc: ltc::Ltc,
            /// In proportion to the light's texture; uniform on the area of a light without one.
            Texture: texture::Texture,
            /// Directions drawn from the BSDF; those that meet the light count. A linear light is
            /// never met: it gets points by its projected solid angle.
            Bsdf: bsdf::Bsdf,
            /// On linear lights by any technique; on other lights as [`PointBy::SolidAngle`].
            Linear(options): linear::LinearOptions,
        }
    };
}

/// Techniques of lines, handed to one of the macros below.
macro_rules! line_techniques {
    ($make:ident $with:tt) => {
        $crate::techniques::$make! { $with LineBy lines LineMeasure
            /// Area: points uniform in length (Salesin & Jarosz 2019, eq. 14).
            Area: area::Area,
            /// Solid angle (eqs. 16–19), for any polygon and direction.
            SolidAngle: solid_angle::SolidAngle,
            /// Nearly solid angle: offsets from a density that needs no iteration
            /// ([`linelit_lights::AngularLines::by_warped_solid_angle`]).
            Warped: warped::Warped,
            /// Projected solid angle of the part above the horizon.
            Projected: projected::Projected,
            /// The light's texture: offsets by what is on the line, points by the texture along
            /// what is visible of it ([`linelit_lights::TexturedLines`]); area where there is no
            /// texture, or where the light is no parallelogram that is wholly above the horizon.
            Texture: texture::Texture,
        }
    };
}

/// Integrals over what lines find visible, handed to one of the macros below.
macro_rules! integrations {
    ($make:ident $with:tt) => {
        $crate::techniques::$make! { $with Integration integrals Integral
            /// The closed form along the visible parts of each line.
            Analytic: analytic::Analytic,
            /// The closed form over what is visible of the light, past any number of triangles
            /// unless there is a limit; past those, and holes, as [`Integration::Analytic`].
            Exact(options): exact::ExactOptions,
            /// Whichever of exact, lines, points and rays takes the least time to an equal error,
            /// chosen per shading point and light by what is in between. In a combination, where
            /// there is no closed form and a shaft is too dense to keep: points uniform on the
            /// area, eight for each sample of all parts.
            Cheapest: hybrid::Cheapest,
        }
    };
}

/// The enumeration of a table: `[docs]`.
macro_rules! enumeration {
    ([$(#[$outer:meta])*] $name:ident $kind:ident $trait:ident $(
        $(#[$doc:meta])* $variant:ident $(($field:ident))?: $file:ident::$type:ident,
    )+) => {
        $(#[$outer])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum $name {
            $($(#[$doc])* $variant $((enumeration!(@second $field $kind::$file::$type)))?,)+
        }

        impl $name {
            /// All of them, options as they are by default.
            fn all() -> impl Iterator<Item = Self> {
                [$(Self::$variant $((enumeration!(@default $field)))?),+].into_iter()
            }

            /// With the options of its own as a text says them.
            #[allow(unused_variables, reason = "of some tables no technique has options")]
            pub(crate) fn read(self, options: &mut Options<'_>) -> Result<Self> {
                Ok(match self {
                    $(Self::$variant $(($field))? => {
                        Self::$variant $(($field.read(options)?))?
                    })+
                })
            }

            /// The options of its own that are not the default, as `key=value`.
            #[allow(unused_variables, clippy::ptr_arg, reason = "some have no options at all")]
            pub(crate) fn write(self, out: &mut Vec<String>) {
                match self {
                    $(Self::$variant $(($field))? => { $($field.write(out);)? })+
                }
            }
        }
    };
    (@second $field:ident $type:ty) => { $type };
    (@default $field:ident) => { Default::default() };
}

/// `[value, technique => code]`: the code for whichever technique the value is.
macro_rules! dispatch {
    ([$value:expr, $technique:ident => $code:expr] $name:ident $kind:ident $trait:ident $(
        $(#[$doc:meta])* $variant:ident $(($field:ident))?: $file:ident::$type:ident,
    )+) => {
        match $value {
            $($crate::$name::$variant $(($field))? => {
                let $technique = $crate::techniques::dispatch!(
                    @technique $crate::techniques::$kind::$file::$type $(, $field)?
                );
                $code
            })+
        }
    };
    (@technique $type:ty, $field:ident) => { $field };
    (@technique $type:ty) => { <$type>::default() };
}

/// `[value, CONSTANT]`: the constant of whichever technique the value is.
macro_rules! constant {
    ([$value:expr, $constant:ident] $name:ident $kind:ident $trait:ident $(
        $(#[$doc:meta])* $variant:ident $(($field:ident))?: $file:ident::$type:ident,
    )+) => {
        match $value {
            $($crate::$name::$variant { .. } => {
                use $crate::techniques::$kind::{$file::$type, $trait};
                <$type as $trait>::$constant
            })+
        }
    };
}

/// `[docs Name]`: the enumeration of what the techniques draw from on a polygon.
macro_rules! sources {
    ([$(#[$outer:meta])* $source:ident] $name:ident $kind:ident $trait:ident $(
        $(#[$doc:meta])* $variant:ident $(($field:ident))?: $file:ident::$type:ident,
    )+) => {
        $(#[$outer])*
        #[derive(Clone, Debug)]
        #[allow(
            clippy::large_enum_variant,
            reason = "a few of them live in a buffer that is used again"
        )]
        pub(crate) enum $source<'t> {
            $($variant(<$file::$type as $trait>::OnPolygon<'t>),)+
        }
    };
}

/// `[value, Source, technique => code]`: what the code, an option, gives, as a variant of `Source`.
macro_rules! prepare {
    ([$value:expr, $source:ident, $technique:ident => $code:expr] $name:ident $kind:ident $trait:ident $(
        $(#[$doc:meta])* $variant:ident $(($field:ident))?: $file:ident::$type:ident,
    )+) => {
        match $value {
            $($crate::$name::$variant $(($field))? => {
                let $technique = $crate::techniques::dispatch!(
                    @technique $crate::techniques::$kind::$file::$type $(, $field)?
                );
                ($code).map($source::$variant)
            })+
        }
    };
}

/// `[value, Source, prepared => code]`: the code for whichever variant of `Source` the value is.
macro_rules! with_source {
    ([$value:expr, $source:ident, $prepared:ident => $code:expr] $name:ident $kind:ident $trait:ident $(
        $(#[$doc:meta])* $variant:ident $(($field:ident))?: $file:ident::$type:ident,
    )+) => {
        match $value {
            $($source::$variant($prepared) => $code,)+
        }
    };
}

pub(crate) use {
    constant, dispatch, enumeration, integrations, line_techniques, point_techniques, prepare,
    sources, with_source,
};

point_techniques! { enumeration [
    /// The density of points.
] }

line_techniques! { enumeration [
    /// The measure in which lines, and points on them, are uniform where nothing occludes.
] }

integrations! { enumeration [
    /// How light is integrated over what lines find visible, in place of points of it.
    ///
    /// Alone, each says itself what it does where the reflection has no closed form, or the light
    /// has a texture: these take points, of lines or of the light.
    ///
    /// In a combination they stand alone where there is a closed form, the first of them with the
    /// share of all: they integrate over the BSDF, too, so that nothing is left for others to add.
    /// Where there is none, each becomes `line-area` ([`LineBy::Area`], a point of what is visible
    /// of each line), but for [`Integration::Cheapest`] before a shaft too dense to keep.
] }

/// One way to estimate the light of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Technique {
    /// Points of the light, or directions that may meet it.
    Points(Points),
    /// Lines on the light, with their visible parts.
    Lines(Lines),
}

impl From<Points> for Technique {
    fn from(points: Points) -> Self {
        Self::Points(points)
    }
}

impl From<Lines> for Technique {
    fn from(lines: Lines) -> Self {
        Self::Lines(lines)
    }
}

impl Technique {
    /// All techniques with their default options, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        let points = PointBy::all().map(|by| Points::by(by).into());
        let lines = LineBy::all().map(|by| Lines::by(by).into());
        let integrated = Integration::all().map(|integral| Lines::integrated(integral).into());
        points.chain(lines).chain(integrated)
    }

    /// The name in texts, whatever the options.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Points(points) => point_techniques! { constant [points.by, NAME] },
            Self::Lines(lines) => match lines.integration {
                None => line_techniques! { constant [lines.by, NAME] },
                Some(integral) => integrations! { constant [integral, NAME] },
            },
        }
    }

    /// Whether it asks what the reflection looks like.
    pub(crate) fn asks_for_cosines(&self) -> bool {
        match self {
            Self::Points(points) => point_techniques! { constant [points.by, ASKS_FOR_COSINES] },
            Self::Lines(lines) => lines.integration.is_some_and(|i| !i.keeps_lines()),
        }
    }

    /// Its lines and how they are integrated, if they are.
    pub(crate) fn integrated(&self) -> Option<(Lines, Integration)> {
        match self {
            Self::Lines(lines) => Some((*lines, lines.integration?)),
            Self::Points(_) => None,
        }
    }

    /// How many techniques it counts for.
    pub(crate) const fn width(&self) -> usize {
        match self {
            Self::Lines(Lines {
                direction: LineDirection::Spread(count),
                ..
            }) => *count as usize,
            Self::Lines(_) | Self::Points(_) => 1,
        }
    }

    /// Whether its samples need no weights as an estimator's only technique: it then draws on the
    /// whole light, by its first stream. Any other is a combination of one.
    pub(crate) fn can_stand_alone(&self) -> bool {
        match self {
            Self::Points(points) => point_techniques! { constant [points.by, STANDS_ALONE] },
            Self::Lines(lines) => lines.can_stand_alone(),
        }
    }

    /// Whether it cannot be weighted: there is no density to weight by.
    pub(crate) fn must_stand_alone(&self) -> bool {
        use LineDirection::{Origin, Stratified, UniformPerLine};
        matches!(self, Self::Lines(l) if matches!(l.direction, UniformPerLine | Stratified | Origin))
    }

    /// Whether the option `mis` is its own, so that weights of techniques cannot be said with it.
    pub(crate) fn has_own_mis(&self) -> bool {
        match self {
            Self::Points(points) => point_techniques! { constant [points.by, HAS_OWN_MIS] },
            Self::Lines(_) => false,
        }
    }
}
