//! Rows of the matrix of view factors, each to a tolerance.

use crate::facets::Facets;
use crate::pair::Settled;
use crate::point::Memory;
use rayon::prelude::*;

/// The view factors from a facet to others: those that are not zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparseRow {
    /// The facet that sends.
    pub facet: usize,
    /// The facets that receive, ascending.
    pub columns: Vec<u32>,
    /// The factor to each.
    pub values: Vec<f64>,
    /// The told error of each, absolute.
    pub errors: Vec<f64>,
    /// What no facet receives: one less the sum of all, within the sum of the errors.
    pub sky: f64,
}

/// The facets whose pairs are counted, by how each pair was settled.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Plan {
    /// The number of facets that are partly hidden from each.
    partly: Vec<u32>,
    /// Unordered pairs that were settled by facing, by a facet that hides all, by an empty hull,
    /// and those that are partly hidden.
    pub pairs: [u64; 4],
}

/// Rows that threads compute before they are handed on.
const BLOCK: usize = 64;

impl Facets {
    /// Looks at all pairs: which are settled without an integral over what is hidden. Rows share
    /// their tolerance among the others.
    #[must_use]
    pub fn plan(&self) -> Plan {
        let one = |i: usize| {
            let (mut partly, mut pairs) = (0, [0; 4]);
            for j in (0..self.len()).filter(|j| *j != i) {
                let by = self.settled(i, j);
                partly += u32::from(by == Settled::Partly);
                pairs[by as usize] += u64::from(i < j);
            }
            (partly, pairs)
        };
        let all: Vec<(u32, [u64; 4])> = (0..self.len()).into_par_iter().map(one).collect();
        let mut plan = Plan::default();
        for (partly, pairs) in all {
            plan.partly.push(partly);
            plan.pairs = [0, 1, 2, 3].map(|k| plan.pairs[k] + pairs[k]);
        }
        plan
    }

    /// The view factors from a facet: the sum of the told errors is at most the tolerance, wherever
    /// [`Facets::between`] keeps to its own. A row does not depend on others, or on threads, and
    /// areas times factors are the same both ways to the bit.
    ///
    /// # Panics
    /// If there is no facet of this number, or the plan is of other facets.
    #[must_use]
    pub fn row(&self, facet: usize, tolerance: f64, plan: &Plan, memory: &mut Memory) -> SparseRow {
        let share = |k: usize| {
            let pairs = f64::from(plan.partly[k].max(1));
            tolerance * self.facets[k].area * self.side_count() / pairs
        };
        let area = self.facets[facet].area * self.side_count();
        let mut row = SparseRow {
            facet,
            sky: 1.0,
            ..SparseRow::default()
        };
        for (column, other) in (0_u32..).zip(0..self.len()) {
            let tolerance = share(facet).min(share(other));
            let (found, _) = self.exchange(facet, other, tolerance, memory);
            if found.value > 0.0 || found.error > 0.0 {
                row.columns.push(column);
                row.values.push(found.value / area);
                row.errors.push(found.error / area);
            }
        }
        row.sky = 1.0 - row.values.iter().sum::<f64>();
        row
    }

    /// Computes all rows on all threads of the rayon pool, and hands them on in their order. Memory
    /// does not grow with the square of the number of facets.
    ///
    /// # Errors
    /// The first error of `each`, which ends the work.
    pub fn rows<E>(
        &self,
        tolerance: f64,
        mut each: impl FnMut(SparseRow) -> Result<(), E>,
    ) -> Result<Plan, E> {
        let plan = self.plan();
        for first in (0..self.len()).step_by(BLOCK) {
            let block = first..self.len().min(first + BLOCK);
            let rows: Vec<SparseRow> = block
                .into_par_iter()
                .map_init(Memory::default, |memory, i| {
                    self.row(i, tolerance, &plan, memory)
                })
                .collect();
            rows.into_iter().try_for_each(&mut each)?;
        }
        Ok(plan)
    }
}
