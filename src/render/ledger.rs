//! Which units of work are done, which are being done, and what is left: hands them out in order, each once.

use super::Done;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// How far the work is: all units before `next` are done but those that are missing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Standing {
    /// The first unit that was never begun.
    pub next: u64,
    /// Units before it that are not done, in order.
    pub missing: Vec<u64>,
}

/// The book of a render's units.
pub(super) struct Ledger {
    units: u64,
    book: Mutex<Book>,
}

#[derive(Default)]
struct Book {
    next: u64,
    /// Handed out, and not done.
    open: BTreeSet<u64>,
    /// Begun in an earlier run, and not done: to be handed out before anything new. The next one is the last.
    waiting: Vec<u64>,
    done: Done,
}

impl Ledger {
    /// A book of so many units, none of them done.
    pub(super) fn new(units: u64) -> Self {
        Self { units, book: Mutex::default() }
    }

    /// A book that goes on where another stood, which had counted `done`; `None` where that one was not of so many units.
    pub(super) fn resumed(units: u64, standing: &Standing, done: Done) -> Option<Self> {
        let Standing { next, missing } = standing;
        let in_order = missing.windows(2).all(|pair| pair[0] < pair[1]);
        if *next > units || !in_order || missing.last().is_some_and(|last| last >= next) {
            return None;
        }
        let waiting = missing.iter().rev().copied().collect();
        Some(Self { units, book: Mutex::new(Book { next: *next, open: BTreeSet::new(), waiting, done }) })
    }

    fn book(&self) -> MutexGuard<'_, Book> {
        // Every change of the book is whole.
        self.book.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next unit to do, if `may_begin` lets a new one begin.
    pub(super) fn take(&self, may_begin: impl Fn(u64) -> bool) -> Option<u64> {
        let mut book = self.book();
        let unit = book.waiting.pop().or_else(|| {
            let unit = (book.next < self.units && may_begin(book.next)).then_some(book.next)?;
            book.next += 1;
            Some(unit)
        })?;
        book.open.insert(unit);
        Some(unit)
    }

    /// Notes that a unit is done, and what it took.
    pub(super) fn finish(&self, unit: u64, done: Done) {
        let mut book = self.book();
        book.open.remove(&unit);
        book.done += done;
    }

    /// What is done.
    pub(super) fn done(&self) -> Done {
        self.book().done
    }

    /// How far the work is.
    pub(super) fn standing(&self) -> Standing {
        let book = self.book();
        let missing: BTreeSet<u64> = book.open.iter().chain(&book.waiting).copied().collect();
        Standing { next: book.next, missing: missing.into_iter().collect() }
    }

    /// Whether every unit is done.
    pub(super) fn is_complete(&self) -> bool {
        self.standing() == Standing { next: self.units, missing: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_handed_out_once_and_what_was_not_done_comes_first() {
        let first = Ledger::new(5);
        assert_eq!([0; 3].map(|_| first.take(|_| true)), [Some(0), Some(1), Some(2)]);
        first.finish(1, Done { samples: 7, ..Done::default() });
        let standing = first.standing();
        assert_eq!(standing, Standing { next: 3, missing: vec![0, 2] });
        let second = Ledger::resumed(5, &standing, first.done()).unwrap();
        let order: Vec<u64> = std::iter::from_fn(|| second.take(|_| true)).collect();
        assert_eq!(order, [0, 2, 3, 4]);
        assert!(!second.is_complete());
        order.iter().for_each(|&unit| second.finish(unit, Done { samples: 1, ..Done::default() }));
        assert!(second.is_complete());
        assert_eq!(second.done().samples, 11);
    }

    #[test]
    fn what_no_book_can_say_is_refused() {
        for (next, missing) in [(6, vec![]), (3, vec![3]), (3, vec![1, 1]), (3, vec![2, 1]), (0, vec![0])] {
            assert!(Ledger::resumed(5, &Standing { next, missing }, Done::default()).is_none());
        }
        assert!(Ledger::resumed(5, &Standing { next: 5, missing: vec![0, 4] }, Done::default()).is_some());
    }
}
