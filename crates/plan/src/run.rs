//! Doing what is left of a plan.
#![allow(clippy::disallowed_methods, reason = "units are computed on threads")]

use crate::durable;
use crate::folder::part_number;
use crate::lease::{Claim, Held, Leases, sweep};
use crate::{BoxError, Folder, PlanError, Shard, Unit};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, OnceLock, PoisonError};
use std::time::Duration;
use std::{fmt, thread};

/// How a process takes part in a plan.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// Which units are its own.
    pub shard: Shard,
    /// Units at a time, each on a thread of its own.
    pub threads: usize,
    /// A unit whose holder gave no sign for so long is taken over. Holders give one four times as
    /// often; network file systems may show it late.
    pub lease: Duration,
    /// Leave units of other shards alone. Else, once its own are in hand, a process takes those of
    /// others that nobody has, whether they are late or were killed.
    pub only_own: bool,
    /// Asked between units: whether to stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Told what happens.
    pub note: &'a (dyn Fn(&Event<'_>) + Sync),
}

impl Default for Run<'_> {
    /// All units, one at a time, a lease of 90 seconds, never stopped, in silence.
    fn default() -> Self {
        Self {
            shard: Shard::ALL,
            threads: 1,
            lease: Duration::from_secs(90),
            only_own: false,
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
        shown.field("lease", &self.lease);
        shown.field("only_own", &self.only_own);
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
    /// A unit is taken from a process that is gone.
    TakenOver(&'a Unit),
}

/// What a process did of a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ran {
    /// Units that it computed.
    pub computed: u32,
    /// Units of its own that were done before.
    pub found: u32,
    /// Units of others without a part when this process ended: in other hands, or left alone by
    /// request.
    pub elsewhere: u32,
}

/// A unit in hand, for who computes it.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    number: u32,
    folder: &'a Folder,
    others: &'a (dyn Attempt + Sync),
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
    /// is computed first, here or by whoever has it in hand.
    ///
    /// # Errors
    /// If one of them cannot be computed or read, and what `each` fails with.
    pub fn parts(
        &self,
        mut each: impl FnMut(u32, Vec<u8>) -> Result<(), BoxError>,
    ) -> Result<(), BoxError> {
        let needs = self.unit().needs.clone();
        let mut left: Vec<u32> = needs.clone().collect();
        // Units that need the same begin at different ones.
        let begin = self.number as usize % left.len().max(1);
        left.rotate_left(begin);
        self.others.finish(left)?;
        for number in needs {
            let payload = loop {
                match self.folder.part(number) {
                    Ok(Some(payload)) => break payload,
                    // Lost or damaged since.
                    Ok(None) | Err(PlanError::Broken { .. }) => self.others.again(number)?,
                    Err(e) => return Err(e.into()),
                }
            };
            each(number, payload)?;
        }
        Ok(())
    }
}

/// What units ask for each other.
trait Attempt {
    /// Has units done, by this process or others.
    fn finish(&self, units: Vec<u32>) -> Result<(), PlanError>;
    /// Has a unit done whose part was there and is no more.
    fn again(&self, number: u32) -> Result<(), PlanError>;
}

/// Does what is left of a plan, or of a shard of it: `work` computes the bytes of a unit's part.
/// Parts that are there are checked and never computed again; returns when its own units are done.
///
/// A unit may be computed twice when a process was given up too early; its bytes must be a function
/// of the plan alone, but for what nobody compares, such as times. `work` is called on threads of
/// its own, several at a time.
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
    let runner = Runner::new(folder, options, work);
    for place in [folder.parts(), folder.leases()] {
        sweep(&place, &runner.leases)?;
    }
    let (done, wake) = (Mutex::new(false), Condvar::new());
    thread::scope(|scope| {
        scope.spawn(|| runner.leases.keep(&done, &wake));
        // Whatever comes, even a panic: or the other thread would never end.
        let _end = End(&done, &wake);
        thread::scope(|workers| {
            for _ in 0..options.threads.max(1) {
                workers.spawn(|| {
                    if let Err(e) = runner.worker() {
                        runner.fail(e);
                    }
                });
            }
        });
    });
    runner.result()
}

/// Says that all is done when it goes.
struct End<'a>(&'a Mutex<bool>, &'a Condvar);

impl Drop for End<'_> {
    fn drop(&mut self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.1.notify_all();
    }
}

/// What comes of trying to do a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tried {
    Done,
    InOtherHands,
}

/// How well a part that is there is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Look {
    /// Read, and its checksum compared.
    Whole,
    /// Its name is enough.
    Name,
}

struct Runner<'a, W> {
    folder: &'a Folder,
    options: &'a Run<'a>,
    work: W,
    leases: Leases,
    own: Vec<u32>,
    others: Vec<u32>,
    /// How many of each are begun.
    next: [AtomicUsize; 2],
    /// Own units that others have in hand.
    waiting: Mutex<Vec<u32>>,
    /// Units known to have a part.
    done: Vec<AtomicBool>,
    /// Other shards' units without a part when this one came to them.
    left: OnceLock<Vec<u32>>,
    failed: Mutex<Option<PlanError>>,
    computed: AtomicU32,
    found: AtomicU32,
}

impl<'a, W> Runner<'a, W>
where
    W: Fn(&Task<'_>) -> Result<Vec<u8>, BoxError> + Sync,
{
    fn new(folder: &'a Folder, options: &'a Run<'a>, work: W) -> Self {
        let (own, others) = options.shard.units(folder.plan());
        let done = folder.plan().units.iter().map(|_| AtomicBool::new(false));
        Self {
            folder,
            options,
            work,
            leases: Leases::new(folder, options.lease),
            own,
            others,
            next: [AtomicUsize::new(0), AtomicUsize::new(0)],
            waiting: Mutex::default(),
            done: done.collect(),
            left: OnceLock::new(),
            failed: Mutex::default(),
            computed: AtomicU32::new(0),
            found: AtomicU32::new(0),
        }
    }

    /// What each thread does.
    fn worker(&self) -> Result<(), PlanError> {
        while let Some(number) = self.take(0, &self.own) {
            if self.attempt(number, Look::Whole)? == Tried::InOtherHands {
                self.waiting().push(number);
            }
        }
        let left = self.left()?;
        while let Some(number) = self.take(1, left) {
            if self.options.only_own {
                break;
            }
            // Who has it in hand finishes it, or it is for who comes next.
            self.attempt(number, Look::Name)?;
        }
        let waiting = std::mem::take(&mut *self.waiting());
        self.finish_all(waiting, Look::Whole)
    }

    fn take(&self, pass: usize, units: &[u32]) -> Option<u32> {
        let next = self.next[pass].fetch_add(1, Ordering::Relaxed);
        units.get(next).copied()
    }

    fn waiting(&self) -> std::sync::MutexGuard<'_, Vec<u32>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Units of other shards that have no part, by one look at the folder.
    fn left(&self) -> Result<&[u32], PlanError> {
        if self.left.get().is_none() {
            let left = self.without_part()?;
            return Ok(self.left.get_or_init(|| left));
        }
        Ok(self.left.get().map_or(&[], Vec::as_slice))
    }

    /// Units of other shards that have no part now.
    fn without_part(&self) -> Result<Vec<u32>, PlanError> {
        if !self.others.is_empty() {
            for name in durable::names(&self.folder.parts())? {
                let number = part_number(&name);
                if let Some(done) = number.and_then(|n| self.done.get(n as usize)) {
                    done.store(true, Ordering::Relaxed);
                }
            }
        }
        let is_left = |number: &&u32| !self.is_done(**number);
        Ok(self.others.iter().filter(is_left).copied().collect())
    }

    fn is_done(&self, number: u32) -> bool {
        self.done[number as usize].load(Ordering::Relaxed)
    }

    /// Whether the part of a unit is there; of one that is broken, why.
    fn look(&self, number: u32, look: Look) -> Result<Result<bool, String>, PlanError> {
        if look == Look::Name {
            return Ok(Ok(self.folder.part_path(number).exists()));
        }
        match self.folder.part(number) {
            Ok(part) => Ok(Ok(part.is_some())),
            Err(e @ PlanError::Broken { .. }) => Ok(Err(e.to_string())),
            Err(e) => Err(e),
        }
    }

    /// Does a unit, unless it is done or in other hands.
    fn attempt(&self, number: u32, look: Look) -> Result<Tried, PlanError> {
        if self.is_done(number) {
            return Ok(Tried::Done);
        }
        self.check_stop()?;
        let unit = &self.folder.plan().units[number as usize];
        if self.look(number, look)? == Ok(true) {
            self.found.fetch_add(1, Ordering::Relaxed);
            (self.options.note)(&Event::Found(unit));
            return Ok(self.set_done(number));
        }
        let Claim::Ours(held) = self.leases.claim(number)? else {
            return Ok(Tried::InOtherHands);
        };
        if held.taken_over {
            (self.options.note)(&Event::TakenOver(unit));
        }
        // Done by another in between, perhaps.
        match self.look(number, Look::Whole)? {
            Ok(true) => return Ok(self.set_done(number)),
            Ok(false) => {}
            Err(reason) => (self.options.note)(&Event::Broken(unit, &reason)),
        }
        let payload = self.compute(number)?;
        self.write(held, number, &payload)?;
        self.computed.fetch_add(1, Ordering::Relaxed);
        (self.options.note)(&Event::Done(unit));
        Ok(self.set_done(number))
    }

    /// Writes a part, and only then lets the unit go.
    fn write(&self, held: Held<'_>, number: u32, payload: &[u8]) -> Result<(), PlanError> {
        self.folder.write_part(number, payload)?;
        drop(held);
        Ok(())
    }

    fn compute(&self, number: u32) -> Result<Vec<u8>, PlanError> {
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

    fn set_done(&self, number: u32) -> Tried {
        self.done[number as usize].store(true, Ordering::Relaxed);
        Tried::Done
    }

    /// Has all of these units done: those that nobody has first, then those that others do not
    /// finish.
    fn finish_all(&self, mut units: Vec<u32>, look: Look) -> Result<(), PlanError> {
        loop {
            let mut left = Vec::new();
            for number in units {
                if self.attempt(number, look)? == Tried::InOtherHands {
                    left.push(number);
                }
            }
            if left.is_empty() {
                return Ok(());
            }
            units = left;
            thread::sleep((self.options.lease / 8).min(Duration::from_millis(200)));
        }
    }

    fn check_stop(&self) -> Result<(), PlanError> {
        if self.failure().is_some() || (self.options.stop)() {
            return Err(PlanError::Interrupted);
        }
        Ok(())
    }

    fn failure(&self) -> std::sync::MutexGuard<'_, Option<PlanError>> {
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
        Ok(Ran {
            elsewhere: u32::try_from(self.without_part()?.len()).unwrap_or(u32::MAX),
            computed: self.computed.into_inner(),
            found: self.found.into_inner(),
        })
    }
}

impl<W> Attempt for Runner<'_, W>
where
    W: Fn(&Task<'_>) -> Result<Vec<u8>, BoxError> + Sync,
{
    fn finish(&self, units: Vec<u32>) -> Result<(), PlanError> {
        self.finish_all(units, Look::Name)
    }

    fn again(&self, number: u32) -> Result<(), PlanError> {
        self.done[number as usize].store(false, Ordering::Relaxed);
        self.finish_all(vec![number], Look::Whole)
    }
}
