//! Who does which units.

use crate::{Plan, PlanError};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fmt;
use std::str::FromStr;

/// One of so many processes that share a plan; written `I/N`, from `1/N` to `N/N`.
///
/// ```
/// use linelit_plan::Shard;
///
/// let shard: Shard = "3/16".parse()?;
/// assert_eq!((shard.index(), shard.count(), shard.to_string()), (2, 16, "3/16".into()));
/// assert!("0/16".parse::<Shard>().is_err());
/// # Ok::<(), linelit_plan::PlanError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u32,
    count: u32,
}

/// A shard, and what says that this process is it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Named {
    /// The shard.
    pub shard: Shard,
    /// The variable of the environment.
    pub by: &'static str,
}

impl Shard {
    /// All units.
    pub const ALL: Self = Self { index: 0, count: 1 };

    /// The shard of an index below the count.
    #[must_use]
    pub const fn new(index: u32, count: u32) -> Option<Self> {
        if index < count {
            Some(Self { index, count })
        } else {
            None
        }
    }

    /// Its index, from 0.
    #[must_use]
    pub const fn index(self) -> u32 {
        self.index
    }

    /// How many there are.
    #[must_use]
    pub const fn count(self) -> u32 {
        self.count
    }

    /// The shard that a scheduler makes this process by numbering it: Slurm's job arrays, Indexed
    /// Jobs of Kubernetes, array jobs of AWS Batch. `get` reads a variable of the environment;
    /// `count` is how many processes there are, for those that do not say so. `None` if no
    /// scheduler says anything.
    ///
    /// # Errors
    /// If a number is none, there is no count, or the indices are not consecutive.
    pub fn from_environment(
        get: impl Fn(&str) -> Option<String>,
        count: Option<u32>,
    ) -> Result<Option<Named>, PlanError> {
        let number = |name: &'static str| -> Result<Option<u32>, PlanError> {
            let Some(text) = get(name) else {
                return Ok(None);
            };
            let refused = || PlanError::Refused(format!("{name} is `{text}`, not a number"));
            text.trim().parse().map(Some).map_err(|_| refused())
        };
        let named = |by: &'static str, index: u32, of: Option<u32>| {
            let Some(all) = count.or(of) else {
                return Err(PlanError::Refused(format!(
                    "{by} is {index}, and nothing says of how many: add --shards N"
                )));
            };
            match Self::new(index, all) {
                Some(shard) => Ok(Some(Named { shard, by })),
                None => Err(PlanError::Refused(format!(
                    "{by} makes this number {index}, counted from 0, of {all}: say which units it \
                     shall do by --shard I/N"
                ))),
            }
        };
        let slurm = "SLURM_ARRAY_TASK_ID";
        if let Some(id) = number(slurm)? {
            let first = number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(0);
            let step = number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
            let index = id.saturating_sub(first) / step;
            return named(slurm, index, number("SLURM_ARRAY_TASK_COUNT")?);
        }
        for (index, of) in [
            ("JOB_COMPLETION_INDEX", None),
            (
                "AWS_BATCH_JOB_ARRAY_INDEX",
                Some("AWS_BATCH_JOB_ARRAY_SIZE"),
            ),
        ] {
            if let Some(found) = number(index)? {
                let of = of.map(number).transpose()?.flatten();
                return named(index, found, of);
            }
        }
        Ok(None)
    }

    /// The units of each shard: the dearest that is left goes to the shard that has least so far,
    /// so that none has more than the others by more than one unit. The same for everyone who asks.
    fn shares(self, plan: &Plan) -> Vec<Vec<u32>> {
        let mut order: Vec<(u32, f64)> = (0..).zip(plan.units.iter().map(|u| u.cost)).collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut shares = vec![Vec::new(); self.count as usize];
        // Costs are neither negative nor infinite: their bits are in their order.
        let mut loads: BinaryHeap<_> = (0..self.count).map(|s| Reverse((0_u64, s))).collect();
        for (number, cost) in order {
            let Some(Reverse((load, shard))) = loads.pop() else {
                break;
            };
            shares[shard as usize].push(number);
            let load = f64::from_bits(load) + cost;
            loads.push(Reverse((load.to_bits(), shard)));
        }
        for share in &mut shares {
            share.sort_unstable();
        }
        shares
    }

    /// The units of this shard, by their numbers.
    pub(crate) fn units(self, plan: &Plan) -> Vec<u32> {
        self.shares(plan).swap_remove(self.index as usize)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", u64::from(self.index) + 1, self.count)
    }
}

impl FromStr for Shard {
    type Err = PlanError;

    fn from_str(text: &str) -> Result<Self, PlanError> {
        let refused =
            || PlanError::Refused(format!("shard `{text}`; expected I/N, from 1/N to N/N"));
        let (index, count) = text.split_once('/').ok_or_else(refused)?;
        let index: u32 = index.parse().map_err(|_| refused())?;
        let index = index.checked_sub(1).ok_or_else(refused)?;
        let count = count.parse().map_err(|_| refused())?;
        Self::new(index, count).ok_or_else(refused)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unit;

    #[test]
    fn schedulers_number_their_processes() {
        let shard = |variables: &[(&str, &str)], count| {
            let get = |name: &str| {
                let found = variables.iter().find(|(known, _)| *known == name);
                found.map(|(_, value)| (*value).to_owned())
            };
            Shard::from_environment(get, count).map(|n| n.map(|n| n.shard.to_string()))
        };
        let slurm = |id, min, step, count| {
            let variables = [
                ("SLURM_ARRAY_TASK_ID", id),
                ("SLURM_ARRAY_TASK_MIN", min),
                ("SLURM_ARRAY_TASK_STEP", step),
                ("SLURM_ARRAY_TASK_COUNT", count),
            ];
            shard(&variables, None)
        };
        assert_eq!(shard(&[], Some(4)).unwrap(), None);
        assert_eq!(slurm("0", "0", "1", "16").unwrap().unwrap(), "1/16");
        assert_eq!(slurm("17", "10", "7", "3").unwrap().unwrap(), "2/3");
        // `--array=3,7`: no shard by its number.
        assert!(slurm("7", "3", "1", "2").is_err());
        assert!(slurm("x", "3", "1", "2").is_err());
        let kubernetes = [("JOB_COMPLETION_INDEX", "5")];
        assert!(shard(&kubernetes, None).is_err());
        assert_eq!(shard(&kubernetes, Some(6)).unwrap().unwrap(), "6/6");
        let aws = [
            ("AWS_BATCH_JOB_ARRAY_INDEX", "0"),
            ("AWS_BATCH_JOB_ARRAY_SIZE", "9"),
        ];
        assert_eq!(shard(&aws, None).unwrap().unwrap(), "1/9");
    }

    #[test]
    fn shares_are_even_and_hold_each_unit_once() {
        let mut plan = Plan::default();
        for k in 0..100_u32 {
            let cost = f64::from(k * 37 % 100) + 0.5;
            plan.units.push(Unit::new("", cost, "{}"));
        }
        let cost =
            |units: &[u32]| -> f64 { units.iter().map(|k| plan.units[*k as usize].cost).sum() };
        for count in [1, 2, 7, 64, 1000] {
            let shares = Shard::new(0, count).unwrap().shares(&plan);
            let mut all = shares.concat();
            all.sort_unstable();
            assert_eq!(all, (0..100).collect::<Vec<_>>());
            let costs: Vec<f64> = shares.iter().map(|share| cost(share)).collect();
            let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
            let most = costs.iter().copied().fold(0.0, f64::max);
            assert!(most - least <= 99.5, "{count}: {least} to {most}");
            let own = Shard::new(count - 1, count).unwrap().units(&plan);
            assert_eq!(own, shares[count as usize - 1]);
        }
    }
}
