//! All integration tests in one binary, so that the crate is linked once.

mod asked; // sizing against closed forms, coverage studies
mod bands; // pointwise and simultaneous bands: coverage of independent members
mod browser; // headless Chromium; results come back through its console
mod builder; // cases from Rust values, and their validation
mod cli; // the built binary: exit codes, messages, files
mod derivatives; // exact derivatives against differences, for every property and kind of case
#[cfg(unix)]
mod documentation; // README and the book: commands run, case files load
mod estimates; // estimates of whole cases: intervals, profiles, standard errors, coverage
mod fit; // least squares against certified answers, bounds, identification
mod golden; // nominal march of every shipped case against stored values
mod history; // inverse heat conduction: flux from a thermocouple
mod import_graph; // imports between files have no cycle
mod instants; // sample times between output instants
mod landscape; // maps of the objective against minimisations of it
mod measured_schedules; // schedules of thousands of noisy rows: cost and accuracy
#[cfg(unix)]
mod outputs; // columns, keys and screens against docs/reference/outputs.md
mod posterior; // posteriors against linear intervals and profiles; prediction of unfitted sensors
mod readings; // convergence of sensors beside plies that decompose
mod reduction; // selection of factors to estimate, against the paper
mod report; // the page in a browser: no error, every chart drawn, no request, no sideways scroll
mod serialised; // cases and answers as JSON, and the fingerprint of a case
mod session; // sessions against the command; progress, cancellation, invalid options
#[expect(dead_code, reason = "the tests inside the library use the rest")]
mod support; // tolerances with their reasons, cases, devices
mod tangents; // exact derivatives of a march against differences
mod tidy; // rules of the source tree
mod verification; // every row of the verification suite; a spoiled row fails
