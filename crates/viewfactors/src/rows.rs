//! Rows of the matrix of view factors, each to a tolerance: how the tolerance is divided among
//! pairs, and how rows are computed in parallel and in order.

use crate::facets::Facets;
use crate::pair::{Estimate, open_exchange, past};
use crate::point::Memory;
use crate::sight::{PairOutcome, Sight};
use linelit_geometry::ConvexPolygon;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::ops::Range;

/// The view factors from one facet to all others that are not zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparseRow {
    /// The index of the facet that sends.
    pub facet: usize,
    /// The indices of the facets that receive, in ascending order.
    pub columns: Vec<u32>,
    /// For each entry of `columns`, the view factor to that facet.
    pub values: Vec<f64>,
    /// For each entry of `columns`, the estimate of the absolute error of the view factor.
    pub errors: Vec<f64>,
    /// The factor to the sky, which no facet receives: one minus the sum of all factors.
    pub sky: f64,
}

/// The matrix of view factors in compressed rows, as `scipy.sparse.csr_matrix` expects it.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    /// The view factors that are not zero, row after row.
    pub data: Vec<f64>,
    /// For each entry of `data`, its column: the index of the facet that receives.
    pub indices: Vec<u32>,
    /// For each row, the index in `data` at which it begins; and, as the last entry, the length of
    /// `data`.
    pub indptr: Vec<usize>,
    /// For each entry of `data`, the estimate of its absolute error.
    pub error: Vec<f64>,
    /// For each facet, the view factor from it to the sky.
    pub sky: Vec<f64>,
}

impl Default for Matrix {
    /// Returns a matrix without rows.
    fn default() -> Self {
        Self {
            data: Vec::new(),
            indices: Vec::new(),
            indptr: vec![0],
            error: Vec::new(),
            sky: Vec::new(),
        }
    }
}

impl Matrix {
    /// Appends the row of the next facet.
    pub fn push(&mut self, row: SparseRow) {
        self.data.extend(row.values);
        self.indices.extend(row.columns);
        self.error.extend(row.errors);
        self.sky.push(row.sky);
        self.indptr.push(self.data.len());
    }
}

/// The result of examining all pairs before any is integrated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// For each facet, the sum of the weights of its pairs that are partly hidden; these divide the
    /// facet's tolerance in proportion to their weights.
    pub weights: Vec<f64>,
    /// The numbers of pairs by [`PairOutcome`](crate::PairOutcome): facing away, hidden, clear, and
    /// partly hidden. A pair is two sides of convex parts, in either order.
    pub pairs: [u64; 4],
}

/// The number of rows that are computed in parallel before they are handed to the caller.
const BLOCK: usize = 64;
/// The largest number of exchanges that are stored for later rows, 24 bytes each; exchanges beyond
/// that number are computed again.
const KEPT: usize = 4 << 20;
/// The fraction of a row's tolerance for pairs without blockers.
const OPEN: f64 = 0.1;

/// Exchanges that later rows need, each stored for its row with its column.
#[derive(Default)]
struct StoredExchanges {
    rows: BTreeMap<usize, Vec<(u32, Estimate)>>,
    count: usize,
    /// The end of the range of rows whose exchanges were stored for later rows.
    end: usize,
}

impl Facets {
    /// Examines all pairs before the integration, to find the pairs that need no integral over what
    /// is hidden. The other pairs share the tolerance of their rows.
    #[must_use]
    pub fn plan(&self) -> Plan {
        let one = |memory: &mut Memory, i: usize| {
            let (mut weights, mut pairs) = (Vec::new(), [0; 4]);
            for side in self.sides_of(i) {
                // Examine each pair once, from the facet with the lower number.
                let mut search = self.partners(&side, 0..i + 1);
                while let Some(partner) = search.next(memory) {
                    let settled = partner.sight.settled();
                    pairs[settled as usize] += partner.count;
                    if let (PairOutcome::Partly, Sight::Visible(pair)) = (settled, &partner.sight) {
                        let facet = self.parts[partner.part].facet;
                        weights.push((facet, weight(&pair.polygons)));
                    }
                }
            }
            (weights, pairs)
        };
        let mut plan = Plan {
            weights: vec![0.0; self.len()],
            pairs: [0; 4],
        };
        // Add up the results block by block, in the order of facets.
        for first in (0..self.len()).step_by(BLOCK) {
            let block = first..self.len().min(first + BLOCK);
            let all: Vec<_> = block
                .clone()
                .into_par_iter()
                .map_init(Memory::default, one)
                .collect();
            for (i, (weights, pairs)) in block.zip(all) {
                for (j, weight) in weights {
                    plan.weights[i] += weight;
                    plan.weights[j] += weight;
                }
                plan.pairs = [0, 1, 2, 3].map(|k| plan.pairs[k] + pairs[k]);
            }
        }
        plan
    }

    /// Computes the exchanges of a facet with all others except those in the range `known`.
    fn exchanges(
        &self,
        facet: usize,
        tolerance: f64,
        plan: &Plan,
        known: Range<usize>,
        memory: &mut Memory,
    ) -> Vec<(u32, Estimate)> {
        // Collect terms by the other facet and both sides, so that sums do not depend on the
        // direction.
        let mut found = BTreeMap::<(u32, [(usize, bool); 2]), Estimate>::new();
        let share = |k: usize| self.sending_area(k) / plan.weights[k].max(f64::MIN_POSITIVE);
        for side in self.sides_of(facet) {
            let mut search = self.partners(&side, known.clone());
            while let Some(partner) = search.next(memory) {
                let Sight::Visible(pair) = &partner.sight else {
                    continue;
                };
                let (other, polygons) = (self.parts[partner.part].facet, &pair.polygons);
                let part = if pair.blockers.is_empty() {
                    // Factors without blockers add up to at most one, so the tolerance is relative.
                    open_exchange(polygons, OPEN * tolerance)
                } else {
                    let share = (1.0 - OPEN) * tolerance * share(facet).min(share(other));
                    let share = share * weight(polygons);
                    past(polygons, &pair.blockers, share, memory)
                };
                if part != Estimate::default() {
                    let sides = [(side.part, side.back), (partner.part, partner.back)];
                    let sides = [sides[0].min(sides[1]), sides[0].max(sides[1])];
                    found.entry((number(other), sides)).or_default().add(part);
                }
            }
        }
        // Add up the terms of each facet.
        let mut sums = BTreeMap::<u32, Estimate>::new();
        for ((other, _), part) in found {
            sums.entry(other).or_default().add(part);
        }
        sums.into_iter().collect()
    }

    /// Computes the rows of a range of facets on all threads of the rayon pool, and passes them to
    /// `each` in order. The sum of a row's error estimates is at most the tolerance wherever
    /// [`Facets::between`] meets its own. A row depends neither on the threads nor on the range,
    /// and both directions between two facets are one exchange, divided by the area of each.
    ///
    /// An exchange between two facets of the range is computed once; exchanges with facets outside
    /// of the range are computed as well. Four million exchanges are stored, in 100 MB; beyond
    /// that, they are computed again.
    ///
    /// # Errors
    /// The first error of `each`, which ends the work.
    ///
    /// # Panics
    /// If the range or the plan is not of these facets.
    pub fn rows_of<E>(
        &self,
        range: Range<usize>,
        tolerance: f64,
        plan: &Plan,
        mut each: impl FnMut(SparseRow) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut kept = StoredExchanges {
            end: range.start,
            ..StoredExchanges::default()
        };
        for first in range.clone().step_by(BLOCK) {
            let block = first..range.end.min(first + BLOCK);
            // Once the store is full, rows compute everything that was not stored before.
            let hands = kept.end == first && kept.count < KEPT;
            if hands {
                kept.end = block.end;
            }
            let (start, end) = (range.start, kept.end);
            // Compute the block's exchanges, except those that earlier rows have stored.
            let found: Vec<Vec<(u32, Estimate)>> = block
                .clone()
                .into_par_iter()
                .map_init(Memory::default, |memory, i| {
                    self.exchanges(i, tolerance, plan, start..i.min(end), memory)
                })
                .collect();
            // Complete each row, store what later rows need, and pass the row on.
            for (i, found) in block.zip(found) {
                let mut all = kept.rows.remove(&i).unwrap_or_default();
                kept.count -= all.len();
                if hands {
                    let later = |j: u32| (i + 1..range.end).contains(&(j as usize));
                    for (j, estimate) in found.iter().filter(|(j, _)| later(*j)) {
                        let row = kept.rows.entry(*j as usize).or_default();
                        row.push((number(i), *estimate));
                        kept.count += 1;
                    }
                }
                all.extend(found);
                all.sort_unstable_by_key(|(j, _)| *j);
                each(self.sparse(i, &all))?;
            }
        }
        Ok(())
    }

    /// Returns the row that follows from the exchanges of its facet.
    fn sparse(&self, facet: usize, exchanges: &[(u32, Estimate)]) -> SparseRow {
        let area = self.sending_area(facet);
        let factors = || exchanges.iter().map(|(_, exchange)| exchange.over(area));
        SparseRow {
            facet,
            columns: exchanges.iter().map(|(column, _)| *column).collect(),
            values: factors().map(|f| f.value).collect(),
            errors: factors().map(|f| f.error).collect(),
            sky: match area > 0.0 {
                true => 1.0 - factors().map(|f| f.value).sum::<f64>(),
                false => 0.0,
            },
        }
    }

    /// Computes all rows, as [`Facets::rows_of`] does.
    ///
    /// # Errors
    /// The first error of `each`, which ends the work.
    pub fn rows<E>(
        &self,
        tolerance: f64,
        each: impl FnMut(SparseRow) -> Result<(), E>,
    ) -> Result<Plan, E> {
        let plan = self.plan();
        self.rows_of(0..self.len(), tolerance, &plan, each)?;
        Ok(plan)
    }

    /// Computes the whole matrix in memory, for scenes that are small enough.
    #[must_use]
    pub fn matrix(&self, tolerance: f64) -> Matrix {
        let mut matrix = Matrix::default();
        let add = |row| {
            matrix.push(row);
            Ok::<(), std::convert::Infallible>(())
        };
        match self.rows(tolerance, add) {
            Ok(_) => matrix,
            Err(never) => match never {},
        }
    }
}

/// Converts a facet's index to 32 bits; there are fewer than 2³² facets.
fn number(facet: usize) -> u32 {
    u32::try_from(facet).unwrap_or(u32::MAX)
}

/// Returns a coarse approximation of the exchange of two polygons: the exchange of disks of the
/// same areas, with limited cosines.
pub(crate) fn coarse([p, q]: &[ConvexPolygon; 2]) -> f64 {
    let between = q.centroid() - p.centroid();
    let square = between.length_squared();
    let cosines = p.normal().dot(between) * q.normal().dot(-between) / square;
    let (small, large) = (p.area().min(q.area()), p.area().max(q.area()));
    small * large * cosines.clamp(0.01, 1.0) / (PI * square + large)
}

/// Returns the weight of a pair that is partly hidden, in proportion to which it receives a part of
/// the tolerance. The cost grows as the inverse of the tolerance, so the total cost is least if
/// tolerances are in proportion to square roots.
fn weight(polygons: &[ConvexPolygon; 2]) -> f64 {
    coarse(polygons).sqrt()
}
