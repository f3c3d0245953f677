//! This module holds a single rough lobe of a reflection, and the trait that each model of a lobe
//! implements.

use crate::microfacet::TrowbridgeReitz;
use crate::peaks::ridges;
use crate::{Frostbite, LtcLobe, OrenNayar, Peaks, Phong, Reflector, Substrate};
use linelit_geometry::{DVec3, Segment};
use std::f64::consts::FRAC_1_PI;

/// A model of reflection in the local frame of the surface (normal +z).
///
/// A model that implements [`value`](Self::value), [`shares`](Self::shares),
/// [`cosines`](Self::cosines) and [`is_black`](Self::is_black) is rendered by every technique
/// without bias. The other methods reduce noise.
///
/// ω_i is drawn in one of two ways, with frequencies from [`shares`](Self::shares): by the cosine
/// about the normal, or by [`sample`](Self::sample). A model that overrides one of `sample` and
/// [`pdf`](Self::pdf) has to override the other.
pub(crate) trait Model {
    /// Returns f(ω_i, ω_o) in 1/sr; zero below the surface.
    fn value(&self, wi: DVec3, wo: DVec3) -> DVec3;

    /// Returns the approximate albedo for light from ω_o, by channel, in two parts: the part that
    /// is drawn by the cosine about the normal, and the rest, which is drawn by
    /// [`sample`](Self::sample).
    ///
    /// Only their ratio to each other, and to the parts of other lobes, matters. A part of zero is
    /// never used for drawing. If both parts are zero although the model is not black, the second
    /// is drawn, but seldom.
    fn shares(&self, wo: DVec3) -> [DVec3; 2];

    /// Returns the microfacets by whose visible normals the second part of [`shares`](Self::shares)
    /// is drawn, unless `sample` and `pdf` are overridden.
    fn facets(&self) -> Option<TrowbridgeReitz> {
        None
    }

    /// Draws ω_i for the second part of [`shares`](Self::shares): by the visible normals of
    /// [`facets`](Self::facets) or, without facets, by the cosine about the normal. `None` for a
    /// sample that is lost, where the model reflects no light.
    fn sample(&self, wo: DVec3, u: [f64; 2]) -> Option<DVec3> {
        match self.facets() {
            Some(facets) => facets.sample(wo, u),
            None => Some(by_cosine(u)),
        }
    }

    /// Returns the density of [`sample`](Self::sample) alone, per solid angle; without facets it is
    /// max(0, cos)/π. It integrates to one minus the fraction of lost samples. It is positive
    /// wherever [`value`](Self::value) is, unless the first part of [`shares`](Self::shares) is
    /// positive.
    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        match self.facets() {
            Some(facets) => facets.pdf(wi, wo),
            None => wi.z.max(0.0) * FRAC_1_PI,
        }
    }

    /// Adds the positions along a segment at which the model is much larger than elsewhere, by
    /// default by the [`facets`](Self::facets), or at which it has a kink.
    fn add_peaks(&self, line: &Segment, wo: DVec3, peaks: &mut Peaks) {
        if let Some(facets) = self.facets() {
            ridges(line, wo, facets, peaks);
        }
    }

    /// Returns an approximation of f cos for light from ω_o by LTCs, in two parts: the albedo, by
    /// channel, of the nearly diffuse part, and the lobe about the mirror direction, if there is
    /// one. Lights are sampled by it, so that its accuracy affects only the noise.
    fn cosines(&self, wo: DVec3) -> (DVec3, Option<LtcLobe>);

    /// Whether the model reflects no light.
    fn is_black(&self) -> bool;
}

/// Draws a direction by the cosine about the normal: its density is max(0, cos)/π.
pub(crate) fn by_cosine([v, turn]: [f64; 2]) -> DVec3 {
    crate::about(DVec3::Z, (1.0 - v).sqrt(), turn)
}

/// Defines the enumeration of models, whose methods call the methods of the model that it holds.
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
            fn add_peaks(line: &Segment, wo: DVec3, peaks: &mut Peaks) -> ();
            fn cosines(wo: DVec3) -> (DVec3, Option<LtcLobe>);
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
    /// A rough diffuse reflection.
    OrenNayar,
    /// A lobe about the mirror direction, by a power of the cosine.
    Phong,
    /// A rough mirror.
    Reflector,
    /// A diffuse base under a glossy coat.
    Substrate,
    /// Frostbite's standard material.
    Frostbite,
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::{quadrature::cubature, rng::SplitMix64, ztest::Welford};
    use std::f64::consts::TAU;

    /// The model f = k cos_i cos_o, which implements only the required methods.
    struct Least(f64);

    impl Model for Least {
        fn value(&self, wi: DVec3, wo: DVec3) -> DVec3 {
            DVec3::splat(self.0 * wi.z.max(0.0) * wo.z.max(0.0))
        }

        fn shares(&self, _: DVec3) -> [DVec3; 2] {
            [DVec3::ZERO, DVec3::splat(self.0)]
        }

        fn cosines(&self, wo: DVec3) -> (DVec3, Option<LtcLobe>) {
            (DVec3::splat(self.0 * wo.z * TAU / 3.0), None)
        }

        fn is_black(&self) -> bool {
            false
        }
    }

    /// Defaults are not black: samples of a model with no override give its albedo k cos_o 2π/3.
    #[test]
    fn a_model_that_overrides_nothing_is_drawn_without_bias() {
        let (model, wo) = (Least(0.4), DVec3::new(0.6, 0.0, 0.8));
        let mut random = SplitMix64::new(21);
        let draws = (0..100_000).map(|_| {
            let u = [random.next_f64(), random.next_f64()];
            let wi = model.sample(wo, u).expect("a direction");
            model.value(wi, wo).x * wi.z / model.pdf(wi, wo)
        });
        let z = draws.collect::<Welford>().z_score(0.4 * 0.8 * TAU / 3.0);
        assert!(z.abs() < 4.0, "{z}");
        let density = |z: f64, turn: f64| model.pdf(crate::about(DVec3::Z, z, turn), wo) * TAU;
        let whole = cubature(density, [-1.0, 1.0], [0.0, 1.0], 1e-7, 12).value;
        assert!((whole - 1.0).abs() < 1e-6, "{whole}");
    }
}
