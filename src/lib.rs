//! Thermal response of layups of cloth, insulation and film behind a hot face: predicted, doubted and fitted to
//! thermocouples, many variations at a time, on the processor and on Vulkan devices.
//!
//! # The equation
//!
//! Through the thickness, from the hot face (x = 0) to the back face (x = L):
//!
//! ```text
//! ρ c(T) ∂T/∂t = ∂/∂x ( k(T, P) ∂T/∂x )
//!
//! x = 0     q_cw (h_r − h_w(T))/(h_r − h_cw) + ε q_rad + h (T_g − T) + ε σ (T_s⁴ − T⁴),   or T held
//! plies     flux continuous; across an interface of contact conductance h_c it is h_c (T⁻ − T⁺)
//! x = L     h (T_a − T) + ε σ (T_s⁴ − T⁴),   or T held, or nothing
//! ```
//!
//! Heat flux is positive into the layup at both faces, and towards the back inside. A factor multiplies one property
//! of one group of plies, the heating, the contacts or the loss; an ensemble is many rows of factors.
//!
//! # The nouns
//!
//! A [`Case`] says what is asked: [layup](case::Layup), [exposure](case::Exposure), [sensors](case::Sensor),
//! [factors](case::Factor), [observations](case::Observation). It is planned once into a [`Plan`], flat arrays that
//! are all a backend reads, with as many cells and steps as a [`pilot`] finds it to need. An [`Ensemble`] says which variations to run, one [member](Ensemble::member) a row. A
//! [`March`](march::March) carries members through the plan and returns [`Traces`]. A [study] asks a question and
//! gives its answer; a [`Fit`](fit::Fit) is the end of a least-squares minimisation, which knows no heat.
//!
//! A [`Session`] does all of it for a case: it gives what the command gives, to the last bit. A hundred variations of a
//! slab, and the hottest back face among them:
//!
//! ```
//! use bondline::ensemble::SamplingKind;
//! use bondline::session::{Options, UncertaintyOptions};
//! use bondline::{Case, Session};
//!
//! let case = Case::load("cases/slab".as_ref())?;
//! let back = case.sensors().iter().position(|sensor| sensor.name == "BACK").expect("the slab has one");
//! let mut session = Session::open(case, &Options::default())?;
//! let options = UncertaintyOptions { members: 100, sampling: SamplingKind::Sobol, ..Default::default() };
//! let mut hottest_k = 0.0_f64;
//! let spread = session.uncertainty_with(&options, &mut |_, traces| {
//!     for member in 0..traces.members() {
//!         hottest_k = traces.trace(member, back).iter().copied().fold(hottest_k, f64::max);
//!     }
//! })?;
//! assert!(hottest_k > 700.0, "the nominal one reaches 633 K");
//! assert!(spread.peaks[back].mean_k < hottest_k);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # In reading order
//!
//! - [`session`]: one case and its questions: the entry point
//! - [`case`]: what is asked, as written in a file and as it holds
//! - [`plan`]: the bridge; cells, steps and rows of numbers
//! - [`pilot`]: cells and steps for an error that was asked for
//! - [`ensemble`]: which variations to march, and how they are drawn
//! - `physics`, which is private: how one member moves by one step, each file with a twin in WGSL
//! - [`march`]: who carries an ensemble, the processor or a device
//! - [`traces`]: what comes back
//! - [`fit`]: least squares between bounds, and what data determine
//! - [`study`]: one function a question
//! - [`report`]: answers made visible
//! - [`verify`]: the march against exact solutions, other codes and itself
//!
//! Nothing here prints, holds global state or reads a file but [`Case::load`], the materials it names, and what
//! [`report`] writes.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod case;
mod chance;
pub mod ensemble;
pub mod fit;
pub mod march;
#[cfg(not(feature = "internals"))]
#[expect(unreachable_pub, reason = "public with the feature `internals`")]
mod physics;
#[cfg(feature = "internals")]
#[expect(missing_docs, reason = "not part of the public interface")]
pub mod physics;
pub mod pilot;
pub mod plan;
#[cfg(feature = "report")]
pub mod report;
pub mod session;
pub mod study;
pub mod traces;
pub mod verify;

pub use case::Case;
pub use ensemble::Ensemble;
pub use plan::Plan;
pub use session::Session;
pub use traces::Traces;

/// The example of the book is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../docs/how-to/use-the-library.md")]
struct BookExample;

/// The tests under `tests/inside` name the crate as its users do.
#[cfg(all(test, feature = "command"))]
extern crate self as bondline;
#[cfg(all(test, feature = "command"))]
#[path = "../tests/browser.rs"]
mod browser;
#[cfg(all(test, feature = "command"))]
#[path = "../tests/inside/mod.rs"]
mod inside;
#[cfg(all(test, feature = "command"))]
#[path = "../tests/support.rs"]
#[expect(dead_code, reason = "the integration tests use the rest")]
mod support;
