//! Shards: the distribution of a plan's units among processes.

use crate::{Plan, PlanError};
use std::fmt;
use std::str::FromStr;

/// One of N equal shares of a plan's units, which one of N processes computes. It is written `I/N`,
/// where I is the number of the process, from 1 to N.
///
/// ```
/// use linelit_plan::Shard;
///
/// let shard: Shard = "3/16".parse()?;
/// assert_eq!((Some(shard), shard.to_string()), (Shard::new(2, 16), "3/16".into()));
/// assert!("0/16".parse::<Shard>().is_err());
/// # Ok::<(), linelit_plan::PlanError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u32,
    count: u32,
}

impl Shard {
    /// The only shard, which has all units.
    pub const ALL: Self = Self { index: 0, count: 1 };

    /// Creates the shard with an index from 0; `None` unless the index is below the count.
    #[must_use]
    pub fn new(index: u32, count: u32) -> Option<Self> {
        (index < count).then_some(Self { index, count })
    }

    /// Returns the shard that a scheduler assigned to this process by numbering it (job arrays of
    /// Slurm, Indexed Jobs of Kubernetes, array jobs of AWS Batch), and the name of the environment
    /// variable that says so. `get` reads a variable; `count` is the number of processes, for
    /// schedulers that do not state it. `None` if no scheduler numbered the process.
    ///
    /// # Errors
    /// If a variable is not a number, the number of processes is unknown, or the index is not below
    /// the number of processes.
    pub fn from_environment(
        get: impl Fn(&str) -> Option<String>,
        count: Option<u32>,
    ) -> Result<Option<(Self, &'static str)>, PlanError> {
        // Slurm's indices may begin anywhere and have steps.
        let number = |name: &str| -> Result<Option<u32>, PlanError> {
            let Some(text) = get(name) else {
                return Ok(None);
            };
            let refused = |_| PlanError::Refused(format!("{name} is `{text}`, not a number"));
            text.trim().parse().map(Some).map_err(refused)
        };
        let first = number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(0);
        let step = number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
        // Take the first scheduler that gives an index.
        for (by, of, first, step) in [
            ("SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT", first, step),
            ("JOB_COMPLETION_INDEX", "", 0, 1),
            (
                "AWS_BATCH_JOB_ARRAY_INDEX",
                "AWS_BATCH_JOB_ARRAY_SIZE",
                0,
                1,
            ),
        ] {
            let Some(id) = number(by)? else { continue };
            let index = id.saturating_sub(first) / step;
            // The number of processes comes from the caller, or from the scheduler.
            let Some(all) = count.or(number(of)?) else {
                return Err(PlanError::Refused(format!(
                    "{by} is {index}, and nothing says of how many: add --shards N"
                )));
            };
            let shard = Self::new(index, all).ok_or_else(|| {
                PlanError::Refused(format!(
                    "{by} makes this number {index}, counted from 0, of {all}: say which units it \
                     shall do by --shard I/N"
                ))
            })?;
            return Ok(Some((shard, by)));
        }
        Ok(None)
    }

    /// Returns the numbers of the units of this shard, which are the same for every process.
    ///
    /// Units are dealt in the order of their cost, the most expensive first, to the shards from
    /// first to last, then from last to first, and so on. So no shard costs more than another by
    /// more than the most expensive unit:
    ///
    /// ```text
    /// shard   1/3  2/3  3/3
    /// cost      9    8    7
    ///           4    5    6
    ///           3    2    1
    /// ```
    pub(crate) fn units(self, plan: &Plan) -> Vec<u32> {
        // Sort by cost, then by number.
        let mut order: Vec<(u32, f64)> = (0..).zip(plan.units.iter().map(|u| u.cost)).collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        // Take this shard's unit of each round; odd rounds run backwards.
        let rounds = order.chunks(self.count as usize).enumerate();
        let own = rounds.filter_map(|(round, dealt)| {
            let last = self.count - 1;
            let place = if round % 2 == 0 {
                self.index
            } else {
                last - self.index
            };
            dealt.get(place as usize)
        });
        let mut own: Vec<u32> = own.map(|(number, _)| *number).collect();
        own.sort_unstable();
        own
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

    #[test]
    fn schedulers_number_their_processes() {
        let shard = |variables: &[(&str, &str)], count| {
            let get = |name: &str| {
                let found = variables.iter().find(|(known, _)| *known == name);
                found.map(|(_, value)| (*value).to_owned())
            };
            Shard::from_environment(get, count).map(|n| n.map(|n| n.0.to_string()))
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
        // `--array=3,7`: the indices do not number the shards.
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
}
