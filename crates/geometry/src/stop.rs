//! Work that may be stopped: long loops look whether their thread is to go on.
//!
//! A library knows nothing of signals and asks no clock. A caller that wants to end work gives each
//! thread of it a question ([`ask`]); loops that may be long [`check`] it at every step, and unwind
//! once it says yes; the caller [`catch`]es that. Threads without a question never unwind.
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

/// Says whether the work of a thread is to stop.
pub type Question = Rc<dyn Fn() -> bool>;

/// The work was stopped, and what it had done is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopped;

thread_local! {
    static QUESTION: RefCell<Option<Question>> = const { RefCell::new(None) };
    /// Whether there is a question: a byte that needs no destructor, for checks in short loops.
    static HAS_QUESTION: Cell<bool> = const { Cell::new(false) };
}

/// Gives this thread a question in place of the one that it had, which is returned.
pub fn ask(question: Option<Question>) -> Option<Question> {
    HAS_QUESTION.set(question.is_some());
    QUESTION.replace(question)
}

/// Unwinds to [`catch`] if this thread is to stop; takes a load and a branch where there is no
/// question.
#[inline]
pub fn check() {
    if HAS_QUESTION.get() {
        check_question();
    }
}

#[cold]
fn check_question() {
    // The answer may need to run work of this thread, with another question.
    let question = QUESTION.with_borrow(Clone::clone);
    if question.is_some_and(|question| question()) {
        // No panic: there is no message, and no hook is called.
        resume_unwind(Box::new(Stopped));
    }
}

/// Does work until it is done or stopped. Panics go on.
///
/// # Errors
/// [`Stopped`], where the work was.
pub fn catch<T>(work: impl FnOnce() -> T) -> Result<T, Stopped> {
    // What the work changed when it was stopped is for its owner to begin anew.
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| match payload.downcast() {
        Ok(stopped) => *stopped,
        Err(panic) => resume_unwind(panic),
    })
}
