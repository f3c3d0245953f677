//! A study in units: the results equal those of one call, in whichever order and wherever the units
//! are computed.

use anyhow::{Context as _, bail};
use linelit_geometry::DVec3;
use linelit_study::engine::{
    Counts, Design, Gathering, Job, Method, Part, Problem, Results, Truth, Unit, from_bytes,
    measure, to_bytes,
};
use rand::seq::SliceRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;

/// ∫ |x − k/n| over [0, 1] by independent samples. Its counters report so much work that the study
/// is cut.
struct Steps {
    integrals: usize,
    /// The number of rays that each sample reports.
    rays: u64,
}

impl Problem for Steps {
    type Settings = u64;
    type Workspace = u64;

    fn integrals(&self) -> usize {
        self.integrals
    }

    fn estimate(&self, key: &u64, n: u32, seed: u64, k: usize, rays: &mut u64) -> DVec3 {
        let mut random = Pcg64Mcg::seed_from_u64(seed ^ (k as u64) << 20 ^ key);
        *rays += u64::from(n) * self.rays;
        let step = k as f64 / self.integrals as f64;
        let draw = |_| {
            let x: f64 = random.random();
            (x - step).abs()
        };
        DVec3::new(1.0, 0.5, 2.0) * (0..n).map(draw).sum::<f64>() / f64::from(n)
    }

    fn take_counts(&self, rays: &mut u64) -> Counts {
        Counts {
            rays: std::mem::take(rays),
            ..Counts::default()
        }
    }
}

fn method(estimator: &str, key: u64) -> Method<u64> {
    Method {
        estimator: estimator.to_owned(),
        sampler: "independent".to_owned(),
        trials: 5,
        settings: key,
    }
}

fn design() -> Design<u64> {
    let methods = (0..4).map(|k| method(&format!("m{k}"), k)).collect();
    Design {
        cell_seconds: 0.0,
        ..Design::new(methods, vec![1, 4, 16])
    }
}

/// Returns all results that do not depend on the machine, as bits.
fn bits(results: &Results) -> Vec<u64> {
    let mut all: Vec<u64> = vec![results.integrals as u64, results.left_out.len() as u64];
    all.extend([results.power, results.reference.mse].map(f64::to_bits));
    let values = results.reference.values.iter();
    all.extend(values.flat_map(|v| v.to_array().map(f64::to_bits)));
    for cell in &results.cells {
        let s = &cell.score;
        let numbers = [s.mse, s.mse_stderr, s.mrse, s.bias, s.bias_stderr];
        all.extend(numbers.map(f64::to_bits));
        all.extend(s.trial_mse.iter().map(|v| v.to_bits()));
        all.extend(s.trial_variance.iter().map(|v| v.to_bits()));
        all.extend([
            cell.row.rays,
            cell.row.samples.into(),
            cell.row.trials.into(),
        ]);
    }
    all
}

/// A problem, its true values, and the design of its study.
struct Study {
    problem: Steps,
    truth: Truth<u64>,
    design: Design<u64>,
}

impl Study {
    /// Creates a case with a computed reference, and with samples that report this many rays each.
    fn new(rays: u64) -> Self {
        let problem = Steps {
            integrals: 50,
            rays,
        };
        Self {
            problem,
            truth: Truth::Computed(method("reference", 9)),
            design: design(),
        }
    }

    fn job(&self) -> Job<'_, Steps> {
        Job {
            problem: &self.problem,
            truth: &self.truth,
            design: &self.design,
        }
    }

    /// Puts the existing parts together in the order of the units.
    fn gathered(&self, parts: &BTreeMap<usize, Vec<u8>>) -> Gathering<'_, Steps> {
        let units = self.job().units();
        let mut gathering = Gathering::new(self.job());
        for (k, bytes) in parts {
            gathering.add(&units[*k].unit, from_bytes(bytes).unwrap());
        }
        gathering
    }

    /// Computes the units in a random order, references first, each in a pool of its own.
    fn in_pieces(&self, seed: u64) -> BTreeMap<usize, Vec<u8>> {
        let units = self.job().units();
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut order: Vec<usize> = (0..units.len()).collect();
        order.shuffle(&mut random);
        let is_cells = |k: usize| matches!(units[k].unit, Unit::Cells { .. });
        order.sort_by_key(|&k| is_cells(k));
        let mut parts = BTreeMap::new();
        for k in order {
            let threads = rayon::ThreadPoolBuilder::new().num_threads(random.random_range(1..4));
            let reference = is_cells(k).then(|| self.gathered(&parts).reference());
            let known = || reference.as_ref().context("no reference");
            let compute = || self.job().compute(&units[k].unit, known);
            let part = threads.build().unwrap().install(compute).unwrap();
            parts.insert(k, to_bytes(&part));
        }
        parts
    }
}

#[test]
fn pieces_in_any_order_are_one_study() {
    let known = (0..50).map(|k| DVec3::splat(f64::from(k))).collect();
    for truth in [Truth::Computed(method("reference", 9)), Truth::Known(known)] {
        let mut uncut: Option<Vec<f64>> = None;
        for rays in [0, 100_000] {
            let study = Study {
                truth: truth.clone(),
                ..Study::new(rays)
            };
            let results = measure(study.job());
            let whole = bits(&results);
            // However the study is cut, the sums are over all integrals and trials.
            for cell in &results.cells {
                assert_eq!(cell.row.rays, 50 * 5 * u64::from(cell.row.samples) * rays);
            }
            let errors = |r: &Results| -> Vec<f64> {
                let scores = r.cells.iter().map(|c| &c.score);
                scores
                    .flat_map(|s| [s.mse, s.mrse, s.bias, s.mse_stderr, s.variance])
                    .collect()
            };
            let pieces = errors(&results);
            let uncut = uncut.get_or_insert_with(|| pieces.clone());
            for (a, b) in pieces.iter().zip(&*uncut) {
                // Sums of some hundred squares, in another order: 750 roundings of 1.1e-16, of
                // terms that are at most some hundred times the sum that they make.
                assert!((a - b).abs() <= 1e-11 * b.abs().max(1e-3), "{a} {b}");
            }
            for seed in 0..3 {
                let parts = study.in_pieces(seed);
                let gathered = study.gathered(&parts).results();
                assert_eq!(bits(&gathered), whole, "{rays} {seed}");
            }
        }
    }
}

/// Every integral of every measurement is in one unit and one only, and none is long.
#[test]
fn units_cover_a_study_and_are_short() {
    for rays in [0, 20_000, 1_000_000] {
        let study = Study::new(rays);
        let units = study.job().units();
        assert_eq!(units, study.job().units());
        let mut seen = vec![0; 50 * study.design.cells().len()];
        let mut rounds: BTreeMap<u32, usize> = BTreeMap::new();
        for planned in &units {
            match &planned.unit {
                Unit::Reference { round, integrals } => {
                    *rounds.entry(*round).or_default() += integrals.len();
                }
                Unit::Cells { cells, integrals } => {
                    for cell in cells.clone() {
                        integrals.clone().for_each(|k| seen[50 * cell + k] += 1);
                    }
                }
            }
            // A trial of one integral of 256 samples takes up to 1.5 s of the 10⁶ rays of 15 ns
            // that are counted for a sample: five of them are the shortest that there is.
            let least = 5.0 * 256.0 * rays as f64 * 15e-9;
            assert!(planned.seconds <= least.max(4.0) + 0.1, "{planned:?}");
        }
        assert!(seen.iter().all(|n| *n == 1), "{rays}");
        assert!(rounds.values().all(|n| *n == 50), "{rounds:?}");
        // As many units as the work requires.
        assert_eq!(units.len() > 60, rays == 1_000_000, "{}", units.len());
    }
}

/// The pilot finds rounds enough, and no more than are allowed.
#[test]
fn the_reference_is_a_tenth_of_the_smallest_error() {
    // Replicates have 256 samples: 5 of them a variance of 1/80 of that with 16, which is enough.
    // With 4,096 samples in both the study and its reference, four rounds of five replicates are
    // needed for a twentieth of the variance.
    for (samples, rounds, enough) in [(16, 32, true), (4096, 32, true), (4096, 1, false)] {
        let design = Design {
            reference_rounds: rounds,
            ..Design::new(vec![method("m", 0)], vec![1, samples])
        };
        let study = Study {
            design,
            ..Study::new(0)
        };
        let results = measure(study.job());
        let smallest = results.cells[1].score.variance;
        let share = results.reference.mse / smallest;
        assert_eq!(share < 0.1, enough, "{samples} {rounds}: {share}");
        assert!(share > 0.005, "{samples} {rounds}: {share}");
    }
}

#[test]
fn what_is_missing_is_left_out_and_strange_units_are_refused() {
    let study = Study::new(1_000_000);
    let mut parts = study.in_pieces(0);
    let whole = study.gathered(&parts).results();
    // One block of several.
    let (_, last) = parts.pop_last().unwrap();
    assert!(matches!(from_bytes(&last), Ok(Part::Cells(cells)) if cells.len() == 1));
    // A part that is cut short or goes on is none.
    assert!(from_bytes::<Part>(&last[..last.len() - 1]).is_err());
    assert!(from_bytes::<Part>(&[&last[..], b"more"].concat()).is_err());
    let most = study.gathered(&parts).results();
    assert_eq!(whole.left_out.len(), 0);
    assert_eq!(most.left_out.len() + most.cells.len(), 12);
    assert_eq!(most.left_out.last().unwrap().samples, 16);
    // What is there has the bits of the whole.
    let there = |r: &Results| {
        r.cells
            .iter()
            .map(|c| c.row.mse.to_bits())
            .collect::<Vec<_>>()
    };
    assert_eq!(there(&most), there(&whole)[..most.cells.len()]);

    for unit in [
        Unit::Cells {
            cells: 0..13,
            integrals: 0..50,
        },
        Unit::Cells {
            cells: 0..1,
            integrals: 0..51,
        },
        Unit::Reference {
            round: 0,
            integrals: 49..51,
        },
    ] {
        let none = || bail!("no reference");
        let why = study.job().compute(&unit, none).unwrap_err().to_string();
        assert_eq!(why, "a unit of another study", "{unit:?}");
    }
}
