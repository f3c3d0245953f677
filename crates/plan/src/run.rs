//! The computation of the remaining units of a plan.
//!
//! Each worker thread takes the next unit of the shard. A unit may need the parts of earlier units;
//! if one is missing, it is computed first. Each unit has a lock, which the thread that computes it
//! holds, so that no two threads of a process compute the same unit. As a unit needs only earlier
//! ones, threads never wait in a circle.
#![allow(clippy::disallowed_methods, reason = "units are computed on threads")]

use crate::{BoxError, Folder, PlanError, Shard, Unit};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::{fmt, thread};

/// The options of a process that takes part in a plan.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// The units that the process computes.
    pub shard: Shard,
    /// The number of units that are computed at the same time, each on a thread of its own.
    pub threads: usize,
    /// Returns whether to stop; it is called between units.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Returns whether a unit is left out; it is called before a unit without a part is begun.
    pub leave: &'a (dyn Fn(u32) -> bool + Sync),
    /// Is called with every event.
    pub note: &'a (dyn Fn(&Event<'_>) + Sync),
}

impl Default for Run<'_> {
    /// Computes all units, one at a time, without stopping and without messages.
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
    /// The computation of a unit begins.
    Begun(&'a Unit),
    /// A unit's part was written.
    Done(&'a Unit),
    /// A unit's part already existed.
    Found(&'a Unit),
    /// A unit's part is broken, as the text says, and is computed again.
    Broken(&'a Unit, &'a str),
}

/// The numbers of units that a process computed, found and left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RunCounts {
    /// The number of units that the process computed.
    pub computed: u32,
    /// The number of units whose parts already existed.
    pub found: u32,
    /// The number of units without a part when the process ended: units of other shards, and units
    /// that were left out.
    pub elsewhere: u32,
}

/// A unit that is being computed, as the function that computes it sees it.
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
    /// Returns the index of the unit in the plan.
    #[must_use]
    pub const fn number(&self) -> u32 {
        self.number
    }

    /// Returns the unit in the plan.
    #[must_use]
    pub fn unit(&self) -> &Unit {
        self.runner.unit(self.number)
    }

    /// Returns whether a unit was left out ([`Run::leave`]).
    #[must_use]
    pub fn is_left_out(&self, number: u32) -> bool {
        let all = &self.runner.left_out;
        all.get(number as usize)
            .is_some_and(|left| left.load(Ordering::Relaxed))
    }

    /// Returns the part of a unit that this one needs. If it does not exist, it is computed first.
    ///
    /// # Errors
    /// If the part cannot be computed or read.
    pub fn part(&self, number: u32) -> Result<Vec<u8>, PlanError> {
        self.runner.part(number)
    }
}

/// Computes the remaining units of a plan, or of a shard of it, and returns when they are done;
/// `work` computes the bytes of a unit's part. Existing parts are verified, and only broken ones
/// are computed again.
///
/// Two processes may compute the same unit at the same time; the later part replaces the earlier
/// one. Its bytes must therefore be a function of the plan alone, except for values that are not
/// compared, such as times. `work` is called on several threads at a time.
///
/// # Errors
/// The first failure of `work`, or of reading or writing a part; [`PlanError::Interrupted`] if
/// [`Run::stop`] stopped the run. In both cases the units that are being computed are finished
/// first, and finished parts stay.
pub fn run(
    folder: &Folder,
    options: &Run<'_>,
    work: impl Fn(&Task<'_>) -> Result<Vec<u8>, BoxError> + Sync,
) -> Result<RunCounts, PlanError> {
    // Set up the state that the threads share.
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
    // Each thread takes the next unit, and stops at the first error.
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
    // Report the first error, or count what is done.
    if let Some(error) = locked(&runner.failed).take() {
        return Err(error);
    }
    let done = u32::try_from(folder.done()?.len()).unwrap_or(0);
    Ok(RunCounts {
        elsewhere: folder.units() - done,
        ..*locked(&runner.ran)
    })
}

/// The function that computes parts.
type Work<'a> = &'a (dyn Fn(&Task<'_>) -> Result<Vec<u8>, BoxError> + Sync);

/// The state that the threads of a run share.
struct Runner<'a> {
    folder: &'a Folder,
    options: &'a Run<'a>,
    work: Work<'a>,
    /// For each unit of the plan, a flag whether the unit was counted in `ran`. The thread that
    /// computes the unit holds the lock of its flag.
    counted: Vec<Mutex<bool>>,
    /// For each unit of the plan, whether it was left out.
    left_out: Vec<AtomicBool>,
    /// The first error.
    failed: Mutex<Option<PlanError>>,
    /// The numbers of units that were computed, found and left so far.
    ran: Mutex<RunCounts>,
}

impl Runner<'_> {
    /// Returns a unit of the plan.
    fn unit(&self, number: u32) -> &Unit {
        &self.folder.plan().units[number as usize]
    }

    /// Returns the part of a unit, which is computed if there is no valid one. A unit only waits
    /// for units before it, so that threads never wait in a circle.
    fn part(&self, number: u32) -> Result<Vec<u8>, PlanError> {
        if locked(&self.failed).is_some() || (self.options.stop)() {
            return Err(PlanError::Interrupted);
        }
        // Take the unit's lock, and read an existing part.
        let mut counted = locked(&self.counted[number as usize]);
        let unit = self.unit(number);
        let found = match self.folder.part(number) {
            Err(e @ PlanError::Broken { .. }) => {
                (self.options.note)(&Event::Broken(unit, &e.to_string()));
                None
            }
            other => other?,
        };
        // Compute and write the part if there is none.
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
        // Count each unit once, however many other units need it.
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

    /// Computes the part of a unit.
    fn compute(&self, number: u32) -> Result<Vec<u8>, PlanError> {
        let task = Task {
            number,
            runner: self,
        };
        (self.options.note)(&Event::Begun(task.unit()));
        (self.work)(&task).map_err(|error| match error.downcast::<PlanError>() {
            // An error of a unit that this one needs, or of a file that it read.
            Ok(error) => *error,
            Err(error) => PlanError::Work {
                number,
                name: self.unit(number).name.clone(),
                error,
            },
        })
    }

    /// Stores the first error. An interruption of other threads by that error does not replace it.
    fn fail(&self, error: PlanError) {
        let mut failed = locked(&self.failed);
        if matches!(*failed, None | Some(PlanError::Interrupted)) {
            *failed = Some(error);
        }
    }
}

/// Locks a mutex. Its value is valid even if a thread panicked, as no thread leaves one half
/// changed.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
