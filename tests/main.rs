//! All integration tests in one binary, so that the crate is linked once.

mod bands; // pointwise and simultaneous bands: coverage of independent members
mod browser; // headless Chromium; results come back through its console
mod case_builder; // cases from Rust values, and their validation
mod cli; // the built binary: exit codes, messages, files
mod comments; // names in the comments of sources exist
mod derivatives; // exact derivatives against differences, for every property and kind of case
#[cfg(unix)]
mod documentation; // README and the book: commands run, case files load
#[cfg(unix)]
mod environment; // environment variables against the page on them
mod estimates; // estimates of whole cases: intervals, profiles, standard errors, coverage
mod experiment_design; // designs of tests against twin experiments
mod factor_selection; // selection of factors to estimate, against the paper
mod fit; // least squares against certified answers, bounds, identification
mod flux_inversion; // inverse heat conduction: flux from a thermocouple
#[cfg(target_os = "linux")]
mod fuzz; // mutants of everything that is read, in this process and through the command
mod golden; // nominal march of every shipped case against stored values
mod history_coverage; // bands of heating histories over random histories
mod import_graph; // imports between files have no cycle
mod json_serialisation; // cases and answers as JSON, and the fingerprint of a case
mod landscape; // maps of the objective against minimisations of it
mod margins; // margins to temperature limits: exact solutions, exact distributions, the command
mod measured_schedules; // schedules of thousands of noisy rows: cost and accuracy
mod messages; // messages of the library name no option of the command line
mod one_ply; // one ply at the ends of what inputs may say: rates, bounds, emissivity, readings, exit codes
mod output_instants; // sample times between output instants
#[cfg(unix)]
mod outputs; // columns, keys and screens against docs/reference/outputs.md
mod paper; // the chapter on the figures of the paper
mod peaks; // peaks between output instants: exact solutions, probabilities, derivatives, times above limits
mod posterior; // posteriors against linear intervals and profiles; prediction of unfitted sensors
mod pyrometer; // readings by Planck's law; estimates from them
mod questions; // fields of questions: options of the command, defaults, keys of a file
mod rare_probability; // sampling until an interval is narrow, rare probabilities
mod report; // the page in a browser: no error, every chart drawn, no request, no sideways scroll
mod sensor_convergence; // convergence of sensors beside plies that decompose
mod session; // sessions against the command; progress, cancellation, invalid options
mod single_precision; // metal foils in f32 and f64
mod sizing_and_coverage; // sizing against closed forms, coverage studies
mod stated_tables; // tables as stated: latent heat, jumps, pressures
#[expect(dead_code, reason = "the tests inside the library use the rest")]
mod support; // tolerances with their reasons, cases, devices
mod tangents; // exact derivatives of a march against differences
mod tidy; // rules of the source tree
mod trade; // trade studies against sizings, other seeds and changed properties
mod verification; // every row of the verification suite; a spoiled row fails
