//! This module fits linearly transformed cosines (LTCs) to any isotropic reflection. Use it to give
//! a reflection of your own the closed forms of LTCs.
#![allow(
    clippy::disallowed_types,
    reason = "a fit is made once, before anything is lit"
)]

use crate::{LtcLobe, LtcMixture, Reflection};
use linelit_elementary::{exp, ln};
use linelit_geometry::{DMat3, DVec3, Frame};
use std::f64::consts::FRAC_1_PI;

/// The number of views that are fitted. Their cosines are the squares of equidistant numbers, since
/// lobes change fastest at grazing angles.
const VIEWS: u8 = 33;
/// The square root of the number of directions that are drawn for the fit of each view.
const SIDE: u32 = 32;
/// The constant that is added to the cosine of the view where a map is divided by it.
const NEAR: f64 = 0.1;

/// A diffuse part and one LTC that approximate an isotropic reflection, tabulated by the cosine of
/// the view. They are what [`Reflection::transformed_cosines`] has to return.
///
/// With this fit, `exact` and `hybrid` integrate these cosines in closed form over the visible part
/// of a light, and correct the result by samples of points; without it they use points alone.
///
/// ```
/// use linelit_bsdf::{Bsdf, LtcFit, Known, Lambert, Phong, Reflection, LtcMixture};
/// use linelit_bsdf::geometry::DVec3;
///
/// /// A reflection of one's own.
/// struct Own(Bsdf, LtcFit);
///
/// impl Reflection for Own {
/// #   fn eval(&self, wi: DVec3, wo: DVec3, n: DVec3) -> DVec3 { self.0.eval(wi, wo, n) }
/// #   fn sample(&self, u: [f64; 2], wo: DVec3, n: DVec3) -> Option<DVec3> {
/// #       self.0.sample(u, wo, n)
/// #   }
/// #   fn pdf(&self, wi: DVec3, wo: DVec3, n: DVec3) -> f64 { self.0.pdf(wi, wo, n) }
///     // … `eval`, `sample` and `pdf`.
///     fn known(&self, _wo: DVec3, _n: DVec3) -> Known<'_> {
///         Known::Cosines { are_unlike: false }
///     }
///
///     fn transformed_cosines(&self, wo: DVec3, n: DVec3) -> Option<LtcMixture> {
///         Some(self.1.transformed_cosines(wo, n))
///     }
/// }
///
/// let phong = Phong { specular: DVec3::splat(0.5), exponent: 20.0 };
/// let bsdf = Bsdf::Phong(Lambert { albedo: DVec3::splat(0.25) }, phong);
/// let own = Own(bsdf.clone(), LtcFit::new(&bsdf));
/// assert_eq!(own.transformed_cosines(DVec3::Z, DVec3::Z).unwrap().lobes().len(), 1);
/// ```
///
/// **Fit**: the mixture p of the cosine and of one LTC that has the smallest divergence ∫ g ln(g/p)
/// dω of Kullback and Leibler from g = f cos/albedo. It is found by the downhill simplex, with
/// directions of [`Reflection::sample`], in a tenth of a second. Maps between views are
/// interpolated. The accuracy of the fit affects only the noise.
///
/// **Source**: Heitz, Dupuy, Hill & Neubelt 2016; the form of the map is the one of `facet_cosine`.
#[derive(Clone, Debug)]
pub struct LtcFit {
    views: Vec<View>,
}

/// The fit for one view.
#[derive(Clone, Copy, Debug, Default)]
struct View {
    diffuse: DVec3,
    lobe: DVec3,
    /// The numbers p, q and r of the map's entries p/(c + k)², q and −r s/(c + k).
    map: [f64; 3],
}

/// A mixture of the cosine and an LTC, in the frame whose x axis points towards the viewer.
struct Mixture {
    /// The fraction of the mixture that is the cosine without a map.
    flat: f64,
    /// The entries of the LTC's map: the widths along x and y, and the shift of x with z.
    map: [f64; 3],
}

impl Mixture {
    /// Makes the mixture from the logarithms of the widths, r, and the logit of the fraction.
    fn new([p, q, r, logit]: [f64; 4], cosine: f64) -> Self {
        Self {
            flat: 1.0 / (1.0 + exp(-logit)),
            map: entries([exp(p), exp(q), r], cosine),
        }
    }

    /// Returns the densities of the cosine and of the LTC, each times its fraction.
    fn densities(&self, w: DVec3) -> [f64; 2] {
        let [a, b, skew] = self.map;
        let (x, y) = ((w.x + skew * w.z) / a, w.y / b);
        let r2 = x * x + y * y + w.z * w.z;
        let z = w.z * FRAC_1_PI;
        [self.flat * z, (1.0 - self.flat) * z / (a * b * r2 * r2)]
    }
}

/// Returns the entries of a map for a view.
fn entries([p, q, r]: [f64; 3], cosine: f64) -> [f64; 3] {
    let near = cosine + NEAR;
    let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
    [p / (near * near), q, r * sine / near]
}

impl LtcFit {
    /// Fits a reflection that is isotropic: it does not change when it is rotated about the normal.
    #[must_use]
    pub fn new(reflection: &impl Reflection) -> Self {
        let mut start = [ln(0.2), ln(0.2), 1.0, 0.0];
        let cosines = (0..VIEWS)
            .rev()
            .map(|k| (f64::from(k) / f64::from(VIEWS - 1)).powi(2));
        let mut views: Vec<View> = cosines
            .map(|cosine| {
                let (view, found) = fit(reflection, cosine, start);
                start = found;
                view
            })
            .collect();
        views.reverse();
        Self { views }
    }

    /// Returns the fit to f cos for light that leaves in the direction ω_o.
    #[must_use]
    pub fn transformed_cosines(&self, wo: DVec3, n: DVec3) -> LtcMixture {
        // Interpolate between the two nearest views.
        let cosine = wo.dot(n).abs().min(1.0);
        let last = usize::from(VIEWS - 1);
        let place = cosine.sqrt() * f64::from(VIEWS - 1);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between zero and the number of views"
        )]
        let k = (place as usize).min(last - 1);
        #[allow(clippy::cast_precision_loss, reason = "a few dozen")]
        let t = place - k as f64;
        let [a, b] = [self.views[k], self.views[k + 1]];
        let mix = |a: f64, b: f64| a * (1.0 - t) + b * t;
        let [along, across, skew] = entries([0, 1, 2].map(|i| mix(a.map[i], b.map[i])), cosine);
        // Orient the map towards the viewer.
        let x = (wo - n * wo.dot(n)).try_normalize();
        let x = x.unwrap_or_else(|| Frame::from_normal(n).x);
        let frame = Frame {
            x,
            y: n.cross(x),
            z: n,
        };
        let mut sum = LtcMixture::new(frame, a.diffuse.lerp(b.diffuse, t));
        sum.add(LtcLobe {
            map: DMat3::from_cols(
                DVec3::X * along,
                DVec3::Y * across,
                DVec3::new(-skew, 0.0, 1.0),
            ),
            albedo: a.lobe.lerp(b.lobe, t),
        });
        sum
    }
}

/// Fits one view, starting from the numbers of the previous view, and also returns the new ones.
fn fit(reflection: &impl Reflection, cosine: f64, start: [f64; 4]) -> (View, [f64; 4]) {
    let wo = DVec3::new(
        ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt(),
        0.0,
        cosine,
    );
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(SIDE);
    // Draw directions of the reflection, with their weights.
    let nodes: Vec<(DVec3, DVec3)> = (0..SIDE * SIDE)
        .filter_map(|i| {
            let w = reflection.sample([middle(i / SIDE), middle(i % SIDE)], wo, DVec3::Z)?;
            let pdf = reflection.pdf(w, wo, DVec3::Z) * f64::from(SIDE * SIDE);
            let sent = reflection.eval(w, wo, DVec3::Z) * (w.z / pdf);
            (w.z > 0.0 && sent.is_finite()).then_some((w, sent))
        })
        .collect();
    let total: f64 = nodes.iter().map(|(_, sent)| sent.element_sum()).sum();
    if total <= 0.0 {
        let map = [1.0, 1.0, 0.0];
        return (
            View {
                map,
                ..View::default()
            },
            start,
        );
    }
    // Minimise the divergence, and restart once from the result.
    let divergence = |p: [f64; 4]| {
        let mixture = Mixture::new(p, cosine);
        let at = |(w, sent): &(DVec3, DVec3)| {
            let [flat, lobe] = mixture.densities(*w);
            sent.element_sum() * ln((flat + lobe).max(f64::MIN_POSITIVE))
        };
        -nodes.iter().map(at).sum::<f64>() / total
    };
    let found = minimise(minimise(start, divergence), divergence);
    // Divide the reflected light between both parts, by channel, in proportion to their densities.
    let mixture = Mixture::new(found, cosine);
    let (mut diffuse, mut lobe) = (DVec3::ZERO, DVec3::ZERO);
    for (w, sent) in &nodes {
        let densities = mixture.densities(*w);
        let share = densities[0] / (densities[0] + densities[1]);
        diffuse += *sent * share;
        lobe += *sent * (1.0 - share);
    }
    let map = [exp(found[0]), exp(found[1]), found[2]];
    (View { diffuse, lobe, map }, found)
}

/// Returns a point near the start at which `f` has a local minimum, by the downhill simplex of
/// Nelder and Mead, until values differ by less than 1e-9.
pub fn minimise<const N: usize>(start: [f64; N], f: impl Fn([f64; N]) -> f64) -> [f64; N] {
    let corner = |i: usize| {
        let p = std::array::from_fn(|j| start[j] + if i == j + 1 { 0.05 } else { 0.0 });
        (p, f(p))
    };
    let mut simplex: Vec<([f64; N], f64)> = (0..=N).map(corner).collect();
    // Sort the corners; the worst one is last.
    for _ in 0..200 {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        if simplex[N].1 - simplex[0].1 < 1e-9 {
            break;
        }
        #[allow(clippy::cast_precision_loss, reason = "a few")]
        let centre: [f64; N] =
            std::array::from_fn(|j| simplex[..N].iter().map(|s| s.0[j]).sum::<f64>() / N as f64);
        // Reflect the worst corner at the centre of the others.
        let worst = simplex[N];
        let along = |t: f64| -> ([f64; N], f64) {
            let p = std::array::from_fn(|j| centre[j] + t * (worst.0[j] - centre[j]));
            (p, f(p))
        };
        let reflected = along(-1.0);
        // Go further if this is the best corner; contract, or shrink the simplex, if it is no
        // better.
        if reflected.1 < simplex[0].1 {
            let expanded = along(-2.0);
            simplex[N] = if expanded.1 < reflected.1 {
                expanded
            } else {
                reflected
            };
        } else if reflected.1 < simplex[N - 1].1 {
            simplex[N] = reflected;
        } else {
            let contracted = along(0.5);
            if contracted.1 < worst.1 {
                simplex[N] = contracted;
            } else {
                let best = simplex[0].0;
                for s in &mut simplex[1..] {
                    s.0 = std::array::from_fn(|j| 0.5 * (s.0[j] + best[j]));
                    s.1 = f(s.0);
                }
            }
        }
    }
    simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
    simplex[0].0
}
