//! How much error is left after how much work: renders a scene in several ways, several times each, at growing cost, and
//! says which way is worth its time.
//!
//! The error of a picture x against a reference r is relMSE = mean((x − r)²/(r² + 0.01)) over pixels and channels
//! ([`estimate`]). The figure of merit is the efficiency 1/(CPU seconds × relMSE): for an unbiased estimator of independent
//! samples it does not depend on their number.
//!
//! What was measured is a [`report::Report`]; [`table`], [`csv`] and [`page`] show it.

mod clock;
pub mod csv;
pub mod estimate;
pub mod fit;
pub mod page;
pub mod report;
pub mod run;
pub mod split;
pub mod table;

pub use clock::{Took, timed, utc_now};
