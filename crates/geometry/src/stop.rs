//! Cooperative cancellation: long loops check whether the work of their thread is to stop.
//!
//! A library knows no signals and reads no clock. A caller that wants to be able to end work gives
//! each of its threads a closure, called its *question*, that says whether the thread's work is to
//! stop ([`ask`]). Loops that may take long call [`check`] in every step, which unwinds if the
//! closure returns true; the caller ends the unwinding by [`catch`]. Threads without such a closure
//! never unwind.
//!
//! ```
//! use linelit_geometry::stop;
//! use std::{cell::Cell, rc::Rc};
//! let left = Cell::new(3_u32);
//! let is_enough = move || left.replace(left.get().saturating_sub(1)) == 0;
//! let mut steps = 0;
//! let before = stop::ask(Some(Rc::new(is_enough)));
//! let ended = stop::catch(|| loop {
//!     stop::check();
//!     steps += 1;
//! });
//! stop::ask(before);
//! assert_eq!((ended, steps), (Err::<(), _>(stop::Stopped), 3));
//! ```

#![allow(
    clippy::disallowed_types,
    reason = "what a thread is asked is its own, and nothing that is computed depends on it"
)]

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::rc::Rc;

/// A closure that returns true if the work of its thread is to stop.
pub type Question = Rc<dyn Fn() -> bool>;

/// The error of work that was stopped; what it had done is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopped;

thread_local! {
    /// The question of this thread.
    static QUESTION: RefCell<Option<Question>> = const { RefCell::new(None) };
    /// Whether there is a question: a byte without a destructor, for checks in short loops.
    static HAS_QUESTION: Cell<bool> = const { Cell::new(false) };
}

/// Sets the closure that says whether the work of this thread is to stop, or removes it with
/// `None`; returns the closure that was set before.
pub fn ask(question: Option<Question>) -> Option<Question> {
    HAS_QUESTION.set(question.is_some());
    QUESTION.replace(question)
}

/// Unwinds to [`catch`] if the closure that [`ask`] set for this thread says that its work is to
/// stop. Without such a closure, the call costs a load and a branch.
#[inline]
pub fn check() {
    if HAS_QUESTION.get() {
        check_question();
    }
}

#[cold]
fn check_question() {
    // The closure may run other work in this thread, with another question.
    let question = QUESTION.with_borrow(Clone::clone);
    if question.is_some_and(|question| question()) {
        // Not a panic: there is no message, and no panic hook is called.
        resume_unwind(Box::new(Stopped));
    }
}

/// Runs `work` until it is done or stopped, and returns its result. Panics are passed on.
///
/// # Errors
/// Returns [`Stopped`] if the work was stopped.
pub fn catch<T>(work: impl FnOnce() -> T) -> Result<T, Stopped> {
    // The owner of data that stopped work has changed must reset it.
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| match payload.downcast() {
        Ok(stopped) => *stopped,
        Err(panic) => resume_unwind(panic),
    })
}
