//! Doing what is left of a plan.
#![allow(clippy::disallowed_methods, reason = "units are computed on threads")]

use crate::{BoxError, Folder, PlanError, Shard, Unit};
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::{fmt, thread};

/// How a process takes part in a plan.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// Which units are its own.
    pub shard: Shard,
    /// Units at a time, each on a thread of its own.
    pub threads: usize,
    /// Asked between units: whether to stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Told what happens.
    pub note: &'a (dyn Fn(&Event<'_>) + Sync),
}

impl Default for Run<'_> {
    /// All units, one at a time, never stopped, in silence.
    fn default() -> Self {
        Self {
            shard: Shard::ALL,
            threads: 1,
            stop: &|| false,
            note: &|_| {},
        }
    }
}

impl fmt::Debug for Run<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("Run");
        shown.field("shard", &self.shard);
        shown.field("threads", &self.threads);
        shown.finish_non_exhaustive()
    }
}

/// What happens while a plan is run.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Event<'a> {
    /// A unit's part was written.
    Done(&'a Unit),
    /// A unit's part was there already.
    Found(&'a Unit),
    /// A unit's part is broken, as the text says, and is computed again.
    Broken(&'a Unit, &'a str),
}

/// What a process did of a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ran {
    /// Units that it computed.
    pub computed: u32,
    /// Units that it found done.
    pub found: u32,
    /// Units of other shards without a part when this process ended.
    pub elsewhere: u32,
}

/// A unit in hand, for who computes it.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    number: u32,
    folder: &'a Folder,
    others: &'a (dyn Others + Sync),
}

impl fmt::Debug for Task<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Task")
            .field("number", &self.number)
            .finish_non_exhaustive()
    }
}

impl Task<'_> {
    /// The unit's number.
    #[must_use]
    pub const fn number(&self) -> u32 {
        self.number
    }

    /// What the plan says of it.
    #[must_use]
    pub fn unit(&self) -> &Unit {
        &self.folder.plan().units[self.number as usize]
    }

    /// The parts of the units that this one needs, in the order of their numbers. What is not there
    /// is computed first.
    ///
    /// # Errors
    /// If one of them cannot be computed or read, and what `each` fails with.
    pub fn parts(
        &self,
        mut each: impl FnMut(u32, Vec<u8>) -> Result<(), BoxError>,
    ) -> Result<(), BoxError> {
        let mut absent: Vec<u32> = self.unit().needs.clone().collect();
        // Units that need the same begin at different ones.
        let begin = self.number as usize % absent.len().max(1);
        absent.rotate_left(begin);
        // What another thread has in hand is waited for when nothing else is to be done.
        for wait in [false, true] {
            for number in &absent {
                if !self.folder.part_path(*number).exists() {
                    self.others.compute(*number, wait)?;
                }
            }
        }
        for number in self.unit().needs.clone() {
            let payload = loop {
                match self.folder.part(number) {
                    Ok(Some(payload)) => break payload,
                    // Lost or damaged since.
                    Ok(None) | Err(PlanError::Broken { .. }) => {
                        self.others.compute(number, true)?;
                    }
                    Err(e) => return Err(e.into()),
                }
            };
            each(number, payload)?;
        }
        Ok(())
    }
}

/// What units ask for each other.
trait Others {
    /// Computes a unit without a valid part, unless another thread has it in hand and this one
    /// shall not `wait`.
    fn compute(&self, number: u32, wait: bool) -> Result<(), PlanError>;
}

/// Does what is left of a plan, or of a shard of it: `work` computes the bytes of a unit's part.
/// Parts that are there are checked and never computed again; returns when its own units are done.
///
/// Two processes at once may compute the same unit twice, and the later one's part stays: its bytes
/// must be a function of the plan alone, but for what nobody compares, such as times. `work` is
/// called on threads of its own, several at a time.
///
/// # Errors
/// The first thing that goes wrong: `work` fails, a part cannot be read or written. Then, and when
/// it is told to stop ([`PlanError::Interrupted`]), units in hand are finished, and what is done
/// stays.
pub fn run<W>(folder: &Folder, options: &Run<'_>, work: W) -> Result<Ran, PlanError>
where
    W: Fn(&Task<'_>) -> Result<Vec<u8>, BoxError> + Sync,
{
    folder.check_writable()?;
    let own = options.shard.units(folder.plan());
    let units = folder.plan().units.iter();
    let runner = Runner {
        folder,
        options,
        work,
        counted: units.map(|_| Mutex::new(false)).collect(),
        failed: Mutex::default(),
        computed: AtomicU32::new(0),
        found: AtomicU32::new(0),
    };
    let next = AtomicUsize::new(0);
    let worker = || {
        while let Some(number) = own.get(next.fetch_add(1, Ordering::Relaxed)) {
            if let Err(e) = runner.compute(*number, true) {
                return runner.fail(e);
            }
        }
    };
    thread::scope(|workers| {
        for _ in 0..options.threads.max(1) {
            workers.spawn(worker);
        }
    });
    runner.result()
}

struct Runner<'a, W> {
    folder: &'a Folder,
    options: &'a Run<'a>,
    work: W,
    /// Of each unit, held by the thread that computes it: whether it was counted.
    counted: Vec<Mutex<bool>>,
    failed: Mutex<Option<PlanError>>,
    computed: AtomicU32,
    found: AtomicU32,
}

impl<W> Runner<'_, W>
where
    W: Fn(&Task<'_>) -> Result<Vec<u8>, BoxError> + Sync,
{
    fn work(&self, number: u32) -> Result<Vec<u8>, PlanError> {
        let task = Task {
            number,
            folder: self.folder,
            others: self,
        };
        (self.work)(&task).map_err(|error| match error.downcast::<PlanError>() {
            // Of a unit that this one needs, or of a file that it read.
            Ok(error) => *error,
            Err(error) => PlanError::Work {
                number,
                name: task.unit().name.clone(),
                error,
            },
        })
    }

    fn failure(&self) -> MutexGuard<'_, Option<PlanError>> {
        self.failed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps the first error; that others stopped for it is none.
    fn fail(&self, error: PlanError) {
        let mut failed = self.failure();
        let weak = |e: &PlanError| matches!(e, PlanError::Interrupted);
        if failed.as_ref().is_none_or(weak) {
            *failed = Some(error);
        }
    }

    fn result(self) -> Result<Ran, PlanError> {
        if let Some(error) = self.failure().take() {
            return Err(error);
        }
        let done = self.folder.done()?.len();
        Ok(Ran {
            elsewhere: self.folder.units() - u32::try_from(done).unwrap_or(0),
            computed: self.computed.into_inner(),
            found: self.found.into_inner(),
        })
    }
}

impl<W> Others for Runner<'_, W>
where
    W: Fn(&Task<'_>) -> Result<Vec<u8>, BoxError> + Sync,
{
    fn compute(&self, number: u32, wait: bool) -> Result<(), PlanError> {
        if self.failure().is_some() || (self.options.stop)() {
            return Err(PlanError::Interrupted);
        }
        let counted = &self.counted[number as usize];
        let mut counted = match counted.try_lock() {
            Ok(counted) => counted,
            Err(TryLockError::WouldBlock) if !wait => return Ok(()),
            Err(_) => counted.lock().unwrap_or_else(PoisonError::into_inner),
        };
        let is_new = !std::mem::replace(&mut *counted, true);
        let unit = &self.folder.plan().units[number as usize];
        let is_there = match self.folder.part(number) {
            Ok(part) => part.is_some(),
            Err(e @ PlanError::Broken { .. }) => {
                (self.options.note)(&Event::Broken(unit, &e.to_string()));
                false
            }
            Err(e) => return Err(e),
        };
        if !is_there {
            let payload = self.work(number)?;
            self.folder.write_part(number, &payload)?;
        }
        if is_new {
            let (count, event) = match is_there {
                true => (&self.found, Event::Found(unit)),
                false => (&self.computed, Event::Done(unit)),
            };
            count.fetch_add(1, Ordering::Relaxed);
            (self.options.note)(&event);
        }
        Ok(())
    }
}
