//! One rough lobe of a reflection, whichever its model.

use crate::microfacet::TrowbridgeReitz;
use crate::{Frostbite, GlossyLobe, OrenNayar, Phong, Reflector, Substrate};
use linelit_geometry::DVec3;

/// What a model of reflection answers, in the local frame of the surface (normal +z).
pub(crate) trait Model {
    /// f(ω_i, ω_o), 1/sr; zero below the surface.
    fn value(&self, wi: DVec3, wo: DVec3) -> DVec3;

    /// About how much of the light from ω_o is reflected diffusely and about the mirror direction,
    /// channel by channel: how often each is to be sampled.
    fn shares(&self, wo: DVec3) -> [DVec3; 2];

    /// The microfacets by whose visible normals the part about the mirror direction is sampled, if
    /// it has some.
    fn facets(&self) -> Option<TrowbridgeReitz> {
        None
    }

    /// Draws ω_i for the part about the mirror direction.
    fn sample(&self, wo: DVec3, u: [f64; 2]) -> Option<DVec3> {
        self.facets()?.sample(wo, u)
    }

    /// The density of [`sample`](Self::sample), per solid angle.
    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        self.facets().map_or(0.0, |facets| facets.pdf(wi, wo))
    }

    /// The albedo of the diffuse part, by channel.
    fn diffuse_albedo(&self) -> DVec3 {
        DVec3::ZERO
    }

    /// The part about the mirror direction, if its transformation from the cosine is known.
    fn glossy(&self, _scale: DVec3) -> Option<GlossyLobe> {
        None
    }

    /// Whether it reflects nothing.
    fn is_black(&self) -> bool;
}

/// The enumeration of models, and its answers, which are those of the model that it holds.
macro_rules! lobes {
    ($($(#[$doc:meta])* $model:ident,)+) => {
        /// One model of reflection, in the local frame of the surface (normal +z).
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Lobe {
            $($(#[$doc])* $model($model),)+
        }

        lobes! { @answers [$($model)+]
            fn value(wi: DVec3, wo: DVec3) -> DVec3;
            fn shares(wo: DVec3) -> [DVec3; 2];
            fn facets() -> Option<TrowbridgeReitz>;
            fn sample(wo: DVec3, u: [f64; 2]) -> Option<DVec3>;
            fn pdf(wi: DVec3, wo: DVec3) -> f64;
            fn diffuse_albedo() -> DVec3;
            fn glossy(scale: DVec3) -> Option<GlossyLobe>;
            fn is_black() -> bool;
        }
    };
    (@answers $models:tt $(fn $name:ident($($with:ident: $what:ty),*) -> $out:ty;)+) => {
        impl Model for Lobe {
            $(#[inline]
            fn $name(&self, $($with: $what),*) -> $out {
                lobes!(@match self, $name($($with),*), $models)
            })+
        }
    };
    (@match $self:ident, $name:ident $with:tt, [$($model:ident)+]) => {
        match $self {
            $(Self::$model(model) => lobes!(@call model, $name $with),)+
        }
    };
    (@call $model:ident, $name:ident($($with:ident),*)) => {
        Model::$name($model, $($with),*)
    };
}

lobes! {
    /// Rough diffuse.
    OrenNayar,
    /// About the mirror direction, by a power of the cosine.
    Phong,
    /// A rough mirror.
    Reflector,
    /// Diffuse under a glossy coat.
    Substrate,
    /// Frostbite's standard material.
    Frostbite,
}
