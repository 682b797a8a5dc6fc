//! All integration tests in one binary, so that the crate is linked once.

mod asked; // a ply sized against closed forms, twins fitted and counted
mod bands; // bands over members: what they hold of others, drawn anew
mod browser; // a headless Chromium whose console is the channel back
mod builder; // cases built of values, and what is refused of them
mod cli; // the built binary from outside: exit codes, messages, files
mod derivatives; // derivatives at nominal factors, against differences, for every property on every kind of case
#[cfg(unix)]
mod documentation; // README and the book: commands run, case files load
mod estimates; // estimates of whole cases: intervals, profiles, standard errors, coverage
mod fit; // least squares against certified answers, bounds, identification
mod golden; // the nominal march of every shipped case, as it was
mod history; // the flux that heated, from what it left at a thermocouple
mod import_graph; // imports between files: no cycle
mod instants; // readings beside the instants that they are of
mod landscape; // the map of an objective beside the descents that minimise it
mod measured_schedules; // schedules of thousands of noisy rows: what they cost, and that none is lost
#[cfg(unix)]
mod outputs; // columns, keys and screens against docs/reference/outputs.md
mod posterior; // posteriors beside linear intervals and profiles; bands beside what was not fitted
mod readings; // what sensors read beside plies that decompose
mod reduction; // which factors are left to estimate, beside what the paper left
mod report; // the page in a browser: no error, every chart drawn, no request, no sideways scroll
mod serialised; // cases and answers as JSON, and the fingerprint of a case
mod session; // sessions of the library beside the command; progress, cancellation, refused options
#[expect(dead_code, reason = "the tests inside the library use the rest")]
mod support; // tolerances with their reasons, cases, devices
mod tangents; // derivatives that a march tells, against differences
mod tidy; // the tree's own rules, read from its sources
mod verification; // every row of the verification suite, and that a row can fail
