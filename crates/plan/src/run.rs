//! Computing the remaining units of a plan.
#![allow(clippy::disallowed_methods, reason = "units are computed on threads")]

use crate::{BoxError, Folder, PlanError, Shard, Unit};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::{fmt, thread};

/// The options of a process that takes part in a plan.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// The share of the units that is its own.
    pub shard: Shard,
    /// Units at a time, each on a thread of its own.
    pub threads: usize,
    /// Asked between units: whether to stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Asked before a unit without a part is begun: whether it is left out.
    pub leave: &'a (dyn Fn(u32) -> bool + Sync),
    /// Told what happens.
    pub note: &'a (dyn Fn(&Event<'_>) + Sync),
}

impl Default for Run<'_> {
    /// Computes all units, one at a time, never stopped, without messages.
    fn default() -> Self {
        Self {
            shard: Shard::ALL,
            threads: 1,
            stop: &|| false,
            leave: &|_| false,
            note: &|_| {},
        }
    }
}

impl fmt::Debug for Run<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Run({}, {} threads)", self.shard, self.threads)
    }
}

/// An event while a plan is run.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Event<'a> {
    /// A unit is computed.
    Begun(&'a Unit),
    /// A unit's part was written.
    Done(&'a Unit),
    /// A unit's part was there already.
    Found(&'a Unit),
    /// A unit's part is broken, as the text says, and is computed again.
    Broken(&'a Unit, &'a str),
}

/// The numbers of units that a process computed, found and left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ran {
    /// Units that it computed.
    pub computed: u32,
    /// Units that it found done.
    pub found: u32,
    /// Units of other shards, and those that were left out, without a part when this process ended.
    pub elsewhere: u32,
}

/// A unit in hand, for who computes it.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    number: u32,
    runner: &'a Runner<'a>,
}

impl fmt::Debug for Task<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Task({})", self.number)
    }
}

impl Task<'_> {
    /// The unit's number.
    #[must_use]
    pub const fn number(&self) -> u32 {
        self.number
    }

    /// The unit, as the plan has it.
    #[must_use]
    pub fn unit(&self) -> &Unit {
        self.runner.unit(self.number)
    }

    /// Whether a unit was left out ([`Run::leave`]).
    #[must_use]
    pub fn is_left_out(&self, number: u32) -> bool {
        let all = &self.runner.left_out;
        all.get(number as usize)
            .is_some_and(|left| left.load(Ordering::Relaxed))
    }

    /// The part of a unit that this one needs. If it is not there, it is computed first.
    ///
    /// # Errors
    /// If it cannot be computed or read.
    pub fn part(&self, number: u32) -> Result<Vec<u8>, PlanError> {
        self.runner.part(number)
    }
}

/// Computes the remaining units of a plan, or of a shard: `work` computes the bytes of a unit's
/// part. Existing parts are checked and never computed again; returns when its own units are done.
///
/// Two processes at once may compute the same unit twice, and the later one's part stays: its bytes
/// must be a function of the plan alone, but for what nobody compares, such as times. `work` is
/// called on threads of its own, several at a time.
///
/// # Errors
/// The first thing that goes wrong: `work` fails, a part cannot be read or written. Then, and when
/// it is told to stop ([`PlanError::Interrupted`]), units in hand are finished, and what is done
/// stays.
pub fn run(
    folder: &Folder,
    options: &Run<'_>,
    work: impl Fn(&Task<'_>) -> Result<Vec<u8>, BoxError> + Sync,
) -> Result<Ran, PlanError> {
    folder.check_writable()?;
    let own = options.shard.units(folder.plan());
    let units = folder.plan().units.iter();
    let runner = Runner {
        folder,
        options,
        work: &work,
        counted: units.clone().map(|_| Mutex::new(false)).collect(),
        left_out: units.map(|_| AtomicBool::new(false)).collect(),
        failed: Mutex::default(),
        ran: Mutex::default(),
    };
    let next = AtomicUsize::new(0);
    let worker = || {
        while let Some(number) = own.get(next.fetch_add(1, Ordering::Relaxed)) {
            if !folder.part_path(*number).exists() && (options.leave)(*number) {
                runner.left_out[*number as usize].store(true, Ordering::Relaxed);
                continue;
            }
            if let Err(e) = runner.part(*number) {
                return runner.fail(e);
            }
        }
    };
    thread::scope(|workers| {
        for _ in 0..options.threads.max(1) {
            workers.spawn(worker);
        }
    });
    if let Some(error) = locked(&runner.failed).take() {
        return Err(error);
    }
    let done = u32::try_from(folder.done()?.len()).unwrap_or(0);
    Ok(Ran {
        elsewhere: folder.units() - done,
        ..*locked(&runner.ran)
    })
}

/// The function that computes parts.
type Work<'a> = &'a (dyn Fn(&Task<'_>) -> Result<Vec<u8>, BoxError> + Sync);

struct Runner<'a> {
    folder: &'a Folder,
    options: &'a Run<'a>,
    work: Work<'a>,
    /// A flag for each unit, locked by the thread that computes it: whether it was counted.
    counted: Vec<Mutex<bool>>,
    left_out: Vec<AtomicBool>,
    failed: Mutex<Option<PlanError>>,
    ran: Mutex<Ran>,
}

impl Runner<'_> {
    fn unit(&self, number: u32) -> &Unit {
        &self.folder.plan().units[number as usize]
    }

    /// The part of a unit, which is computed if there is no valid one. A unit waits for those
    /// before it alone, so that threads never wait in a circle.
    fn part(&self, number: u32) -> Result<Vec<u8>, PlanError> {
        if locked(&self.failed).is_some() || (self.options.stop)() {
            return Err(PlanError::Interrupted);
        }
        let mut counted = locked(&self.counted[number as usize]);
        let unit = self.unit(number);
        let found = match self.folder.part(number) {
            Err(e @ PlanError::Broken { .. }) => {
                (self.options.note)(&Event::Broken(unit, &e.to_string()));
                None
            }
            other => other?,
        };
        let is_new = !std::mem::replace(&mut *counted, true);
        let event = found
            .as_ref()
            .map_or(Event::Done(unit), |_| Event::Found(unit));
        let payload = match found {
            Some(payload) => payload,
            None => {
                let payload = self.compute(number)?;
                self.folder.write_part(number, &payload)?;
                payload
            }
        };
        if is_new {
            let mut ran = locked(&self.ran);
            match event {
                Event::Done(_) => ran.computed += 1,
                _ => ran.found += 1,
            }
            drop(ran);
            (self.options.note)(&event);
        }
        Ok(payload)
    }

    fn compute(&self, number: u32) -> Result<Vec<u8>, PlanError> {
        let task = Task {
            number,
            runner: self,
        };
        (self.options.note)(&Event::Begun(task.unit()));
        (self.work)(&task).map_err(|error| match error.downcast::<PlanError>() {
            // Of a unit that this one needs, or of a file that it read.
            Ok(error) => *error,
            Err(error) => PlanError::Work {
                number,
                name: self.unit(number).name.clone(),
                error,
            },
        })
    }

    /// Keeps the first error; that others stopped for it is none.
    fn fail(&self, error: PlanError) {
        let mut failed = locked(&self.failed);
        if matches!(*failed, None | Some(PlanError::Interrupted)) {
            *failed = Some(error);
        }
    }
}

/// The value of a mutex. No thread leaves one half changed.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
