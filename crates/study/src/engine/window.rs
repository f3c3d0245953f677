//! Some of a problem's integrals, as a problem of their own.

use super::{Counts, Problem};
use linelit_geometry::DVec3;

/// The integrals `first`, `first + step`, … of another problem.
#[derive(Debug)]
pub(super) struct Window<'a, P> {
    pub(super) problem: &'a P,
    pub(super) first: usize,
    pub(super) step: usize,
    pub(super) count: usize,
}

impl<P: Problem> Problem for Window<'_, P> {
    type Settings = P::Settings;
    type Workspace = P::Workspace;

    fn integrals(&self) -> usize {
        self.count
    }

    fn estimate(
        &self,
        settings: &Self::Settings,
        samples: u32,
        seed: u64,
        integral: usize,
        workspace: &mut Self::Workspace,
    ) -> DVec3 {
        let integral = self.first + integral * self.step;
        self.problem
            .estimate(settings, samples, seed, integral, workspace)
    }

    fn take_counts(&self, workspace: &mut Self::Workspace) -> Counts {
        self.problem.take_counts(workspace)
    }
}
