//! What the closed form costs next to lines, on the machine and in the scene at hand.

use crate::techniques::integrals::hybrid;
use crate::{Buffers, EmissionTexture, Estimator, Query};
use linelit_bsdf::Reflection;
use linelit_lights::AreaLight;
use linelit_visibility::ShaftClass;

/// Numbers of lines between whose times that of the closed form is placed.
const LINES: [u32; 2] = [4, 16];

/// Closed forms of fewer lines say little: they are cheaper whatever they are multiplied with.
const FEW_LINES: f64 = 2.0;

/// How often each is timed: the least counts, for what disturbs a measurement adds to it.
const ROUNDS: usize = 7;

/// Gathers how much dearer than by the table of `hybrid` the closed form past occluders is, in
/// lines.
///
/// Pictures by `hybrid` then depend on the machine and its load, though what they converge to does
/// not.
#[derive(Clone, Debug, Default)]
pub struct Calibration {
    /// Lines that take as long as the closed form did, over those that the table says.
    ratios: Vec<f64>,
}

impl Calibration {
    /// Times the closed form and lines for a query of a light with triangles before it; where there
    /// are none, or too many, or the reflection has no closed form, nothing is noted.
    ///
    /// `clock` gives seconds of processor time.
    pub fn look<R: Reflection, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        buffers: &mut Buffers,
        mut clock: impl FnMut() -> f64,
    ) {
        if query.light.closed_form(query.point).is_none() {
            return;
        }
        let expected = {
            let shaft = query
                .occluders
                .shaft(query.shaft(&area.polygon), &mut buffers.scratch);
            if shaft.class() != ShaftClass::Partial || shaft.is_dense() {
                return;
            }
            hybrid::lines_of_exact(query, area, &shaft)
        };
        if expected < FEW_LINES {
            return;
        }
        let [exact, lines] = [Estimator::exact(), Estimator::analytic()];
        let mut time = |estimator: &Estimator, samples: u32| {
            let query = Query {
                estimator,
                ..query.with_samples(samples)
            };
            let mut least = f64::INFINITY;
            for _ in 0..ROUNDS {
                let start = clock();
                std::hint::black_box(crate::estimate(&query, buffers));
                least = least.min(clock() - start);
            }
            least
        };
        let few = time(&lines, LINES[0]);
        let for_a_line = (time(&lines, LINES[1]) - few) / f64::from(LINES[1] - LINES[0]);
        let measured = f64::from(LINES[0]) + (time(&exact, 1) - few) / for_a_line;
        if measured.is_finite() && for_a_line > 0.0 {
            self.ratios.push(measured.max(0.0) / expected);
        }
    }

    /// [`OcclusionStats::exact_cost`](crate::OcclusionStats::exact_cost): the median, for a few
    /// points where the light is cut by the horizon take ten times as long; 1 where nothing was
    /// noted.
    #[must_use]
    pub fn exact_cost(mut self) -> f64 {
        self.ratios.sort_by(f64::total_cmp);
        let middle = self.ratios.get(self.ratios.len() / 2);
        middle.copied().unwrap_or(1.0)
    }
}
