//! Thermal response of layups of cloth, insulation and film behind a hot face: prediction, uncertainty, and estimation
//! from thermocouples. Many variations are computed at a time, on the CPU and on Vulkan devices.
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
//! Heat flux is positive into the layup at both faces, and towards the back face inside. A factor multiplies one
//! property of one group of plies, or the heating, the contacts or the heat lost by the back face. An ensemble is a
//! list of members, each with a value of every factor.
//!
//! # Types
//!
//! A [`Case`] describes the problem: [layup](case::Layup), [exposure](case::Exposure), [sensors](case::Sensor),
//! [factors](case::Factor), [observations](case::Observation). It becomes a
//! [`Plan`]: flat arrays for the backends, with the cells and time steps that [`adapt`] chooses. An [`Ensemble`] has
//! one [member](Ensemble::member) per variation. A [`March`](march::March) integrates the members in time and returns
//! [`Traces`]. A [study] computes one kind of answer from them; a [`Fit`](fit::Fit) is the result of a least-squares
//! minimisation, which is independent of heat transfer.
//!
//! A [`Session`] does all of this for a case, with the numbers of the command to the last bit. A hundred variations of
//! a slab, and the highest back-face temperature among them:
//!
//! ```
//! use bondline::ensemble::SamplingKind;
//! use bondline::question::{Draw, Uncertainty};
//! use bondline::session::Options;
//! use bondline::{Case, Session};
//!
//! let case = Case::load("cases/slab".as_ref())?;
//! let back = case.sensors().iter().position(|sensor| sensor.name == "BACK").expect("the slab has one");
//! let mut session = Session::open(case, &Options::default())?;
//! let draw = Draw { sampling: SamplingKind::Sobol, ..Draw::default() };
//! let question = Uncertainty { members: 100, draw, ..Uncertainty::default() };
//! let mut hottest_k = 0.0_f64;
//! let found = session.uncertainty_with(&question, &mut |_, traces| {
//!     for member in 0..traces.members() {
//!         hottest_k = hottest_k.max(traces.peak(member, back).temperature_k);
//!     }
//! })?;
//! assert!(hottest_k > 700.0, "the nominal back face reaches 633 K");
//! assert!(found.peaks[back].mean_k < hottest_k);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # In reading order
//!
//! - [`session`]: one case and its studies: the entry point
//! - [`question`]: the questions to a session, with all their options
//! - [`case`]: the description of a problem: case files, materials, validation
//! - [`limits`]: how large a case, a file or a request may be
//! - [`plan`]: the discretised problem: cells, time steps and flat arrays
//! - [`adapt`]: the choice of cells and time steps for a tolerance
//! - [`ensemble`]: members and their sampling
//! - `physics` (a package of its own, not public): one time step of one member, each file with a twin in WGSL, and its
//!   march on the CPU
//! - [`march`]: time integration of an ensemble, on the CPU or a device
//! - [`traces`]: temperatures and balances over time
//! - [`fit`]: bounded least squares and identifiability
//! - [`statistics`]: sums over the members of an ensemble
//! - [`study`]: one function per kind of answer
//! - [`work_log`]: rows of finished work, by which an interrupted study goes on
//! - [`report`]: pages, figures and tables
//! - [`verify`]: verification against exact solutions, other codes and refined grids
//!
//! The library does not print, apart from the command, and has no global state. Only [`Case::load`] and the materials
//! that it names read files, and only [`report`] writes them.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod adapt;
pub mod case;
/// For the binary and the Python package; not part of the public interface.
#[cfg(feature = "command")]
#[doc(hidden)]
pub mod command;
pub mod ensemble;
pub mod fit;
mod kept_work;
pub use kept_work::work_log;
pub mod limits;
pub mod march;
use bondline_physics as physics;
mod numerics;
pub mod plan;
pub mod question;
mod random;
pub mod report;
pub mod session;
pub mod statistics;
pub mod study;
pub mod traces;
mod user_cache;
pub mod verify;

pub use case::Case;
pub use ensemble::Ensemble;
pub use plan::Plan;
pub use session::Session;
pub use traces::Traces;

/// The example of the book is compiled and run as a documentation test.
#[cfg(doctest)]
#[doc = include_str!("../docs/how-to/use-the-library.md")]
struct BookExample;

/// The tests under `tests/inside` refer to the crate by name, as its users do.
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
