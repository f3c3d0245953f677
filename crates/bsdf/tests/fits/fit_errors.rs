//! This module measures the differences between fitted lobes and the reflections that they
//! approximate, for the table of `docs/accuracy-ltc.md`.

use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{Bsdf, Fresnel, Layers, Lobe, Reflection, Reflector, Substrate};
use linelit_geometry::DVec3;

/// A reflection by the α of its facets.
pub(crate) type Model = (&'static str, fn(f64) -> (Lobe, TrowbridgeReitz));

/// What the tables are fitted to: one for each.
pub(crate) const FITTED: [Model; 2] = [
    ("facets", |alpha| mirror([alpha; 2], Fresnel::Full)),
    ("coat", |alpha| coat(alpha, 1.0)),
];

/// What uses them.
const USED: [Model; 7] = [
    FITTED[0],
    ("facets, F₀ = 0.04", |alpha| {
        let (f0, f90) = (DVec3::splat(0.04), 1.0);
        mirror([alpha; 2], Fresnel::Schlick { f0, f90 })
    }),
    ("facets, plastic", |alpha| {
        mirror([alpha; 2], Fresnel::Dielectric { eta: 1.0 / 1.5 })
    }),
    ("facets, copper", |alpha| {
        let (eta, k) = (DVec3::new(0.2, 0.92, 1.1), DVec3::new(3.9, 2.45, 2.14));
        mirror([alpha; 2], Fresnel::Conductor { eta, k })
    }),
    ("facets, α twice as wide along y", |alpha| {
        mirror(
            [alpha * 0.5f64.sqrt(), alpha * 2.0f64.sqrt()],
            Fresnel::Full,
        )
    }),
    ("facets, four times", |alpha| {
        mirror([alpha * 0.5, alpha * 2.0], Fresnel::Full)
    }),
    ("coat, R_s = 0.04", |alpha| coat(alpha, 0.04)),
];

fn mirror(alpha: [f64; 2], fresnel: Fresnel) -> (Lobe, TrowbridgeReitz) {
    let facets = TrowbridgeReitz::new(alpha);
    let reflectance = DVec3::ONE;
    let mirror = Reflector {
        reflectance,
        facets,
        fresnel,
    };
    (Lobe::Reflector(mirror), facets)
}

fn coat(alpha: f64, specular: f64) -> (Lobe, TrowbridgeReitz) {
    let facets = TrowbridgeReitz::isotropic(alpha);
    let coat = Substrate {
        diffuse: DVec3::ZERO,
        specular: DVec3::splat(specular),
        facets,
    };
    (Lobe::Substrate(coat), facets)
}

/// The lobe alone, anisotropic along x.
pub(crate) fn alone(lobe: Lobe) -> Bsdf {
    let mut layers = Layers::new(DVec3::X);
    assert!(layers.add(DVec3::ONE, lobe));
    Bsdf::Layers(layers)
}

/// A direction with a cosine, at an angle to the x axis.
pub(crate) fn view(cosine: f64, turn: f64) -> DVec3 {
    let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
    DVec3::new(sine * turn.cos(), sine * turn.sin(), cosine)
}

/// Directions drawn by the visible normals from the midpoints of `side`² squares, with the measure
/// of each, to integrate what lives on a lobe.
pub(crate) fn nodes(
    facets: TrowbridgeReitz,
    wo: DVec3,
    side: u32,
) -> impl Iterator<Item = (DVec3, f64)> {
    let middle = move |i: u32| (f64::from(i) + 0.5) / f64::from(side);
    (0..side * side).filter_map(move |i| {
        let w = facets.sample(wo, [middle(i / side), middle(i % side)])?;
        let pdf = facets.pdf(w, wo) * f64::from(side * side);
        (pdf > 0.0).then_some((w, 1.0 / pdf))
    })
}

/// ∫ |f cos/albedo − p| dω of the lobe, at most 2, and the relative error of its albedo; of green.
pub(crate) fn errors((lobe, facets): (Lobe, TrowbridgeReitz), wo: DVec3, side: u32) -> [f64; 2] {
    let bsdf = alone(lobe);
    let fitted = bsdf
        .transformed_cosines(wo, DVec3::Z)
        .expect("known")
        .lobes()[0];
    let seen = |w: DVec3| bsdf.eval(w, wo, DVec3::Z).y * w.z;
    let lit: Vec<_> = nodes(facets, wo, side)
        .map(|(w, measure)| (w, seen(w) * measure, measure))
        .collect();
    let albedo: f64 = lit.iter().map(|(_, share, _)| share).sum();
    // Both integrate to one: what exceeds is half of the difference.
    let exceeds = lit
        .iter()
        .map(|(w, share, measure)| (share / albedo - fitted.density(*w) * measure).max(0.0));
    [2.0 * exceeds.sum::<f64>(), fitted.albedo.y / albedo - 1.0]
}

/// A line of the table: of how many inputs, the mean and the worst of the first error, and the
/// worst of the second.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) key: String,
    pub(crate) count: usize,
    pub(crate) errors: [f64; 3],
}

impl Row {
    fn new(key: String, all: &[[f64; 2]]) -> Self {
        let worst = |k: usize| all.iter().map(|e| e[k].abs()).fold(0.0, f64::max);
        #[allow(clippy::cast_precision_loss, reason = "some thousands")]
        let mean = all.iter().map(|e| e[0]).sum::<f64>() / all.len() as f64;
        Self {
            key,
            count: all.len(),
            errors: [mean, worst(0), worst(1)],
        }
    }

    pub(crate) fn text(&self) -> String {
        let [mean, worst, albedo] = self.errors;
        format!(
            "{} | {} | {mean:.3} | {worst:.3} | {albedo:.3} |",
            self.key, self.count
        )
    }
}

/// Ranges of α and of the cosine, and what the table calls them.
const ALPHAS: [([f64; 2], &str); 4] = [
    ([1e-3, 0.01], "0.001 to 0.01"),
    ([0.01, 0.1], "0.01 to 0.1"),
    ([0.1, 0.4], "0.1 to 0.4"),
    ([0.4, 1.6], "0.4 to 1.6"),
];
const COSINES: [([f64; 2], &str); 3] = [
    ([0.3, 1.0], "0.3 to 1"),
    ([0.05, 0.3], "0.05 to 0.3"),
    ([0.001, 0.05], "0.001 to 0.05"),
];

/// All lines, of `count` inputs each: even in the logarithms of α and of the cosine, and in the
/// angle to the axes, and so hardly ever on a node of the tables.
pub(crate) fn rows(count: u32) -> Vec<Row> {
    let mut rows = Vec::new();
    for (name, model) in USED {
        for (alphas, alpha_name) in ALPHAS {
            for (cosines, cosine_name) in COSINES {
                let all: Vec<_> = (0..count)
                    .map(|i| {
                        // The additive recurrence with the plastic number's powers.
                        let x = [0.819_172_5, 0.671_043_6, 0.549_700_5]
                            .map(|step| (0.5 + f64::from(i) * step).fract());
                        let along = |[a, b]: [f64; 2], x: f64| a * (b / a).powf(x);
                        let wo = view(along(cosines, x[1]), x[2] * std::f64::consts::FRAC_PI_2);
                        errors(model(along(alphas, x[0])), wo, 48)
                    })
                    .collect();
                let key = format!("| {name} | {alpha_name} | {cosine_name}");
                rows.push(Row::new(key, &all));
            }
        }
    }
    rows
}
