//! The evidence for each option: two lines of a command whose outputs differ by it.

/// Two runs of a command that differ by an option.
pub(super) struct Row {
    /// The command, or `*` for every command with this option.
    pub(super) command: &'static str,
    /// Its long name, `-n`, or the name of a positional argument.
    pub(super) option: &'static str,
    /// The first run; empty for the line of the command.
    pub(super) line: &'static str,
    /// What the second run adds to it, or "word => another" for what it has in place of a word.
    pub(super) change: &'static str,
    pub(super) evidence: Evidence,
}

pub(super) enum Evidence {
    /// The outputs differ.
    Differs,
    /// The outputs differ beside a file of the user under this path; `{}` is the command.
    BesideOwnFile(&'static str),
    /// The option is refused with this reason.
    Refused(&'static str),
    /// Another test shows the effect: its file and its name.
    Test(&'static str, &'static str),
}

const fn row(
    command: &'static str,
    option: &'static str,
    line: &'static str,
    change: &'static str,
    evidence: Evidence,
) -> Row {
    Row { command, option, line, change, evidence }
}

const fn differs(command: &'static str, option: &'static str, line: &'static str, change: &'static str) -> Row {
    row(command, option, line, change, Evidence::Differs)
}

const fn refused(command: &'static str, option: &'static str, change: &'static str, reason: &'static str) -> Row {
    row(command, option, "", change, Evidence::Refused(reason))
}

/// A command of the walk.
pub(super) struct WalkedCommand {
    pub(super) name: &'static str,
    /// The line that rows begin with.
    pub(super) line: &'static str,
    /// The files that the line writes; `*` is a part of a name without strokes. Those of a report lie in its folder,
    /// with the page and the summary.
    pub(super) writes: &'static [&'static str],
}

const fn command(name: &'static str, line: &'static str, writes: &'static [&'static str]) -> WalkedCommand {
    WalkedCommand { name, line, writes }
}

pub(super) const COMMANDS: &[WalkedCommand] = &[
    command("init", "init new", &["new/case.toml"]),
    command("observations", "observations c", &["figures/observations.svg", "flags.csv", "observations.csv"]),
    command("predict", "predict c", &["figures/hot-face.svg", "figures/nominal.svg", "traces.csv"]),
    command(
        "uncertainty",
        "uncertainty c -n 20",
        &[
            "figures/hot-face.svg",
            "figures/indices-*.svg",
            "figures/nominal.svg",
            "figures/peaks.svg",
            "figures/shares-*.svg",
            "figures/spread-*.svg",
            "percentiles.csv",
            "shares.csv",
            "traces.csv",
        ],
    ),
    command(
        "merge",
        "merge p/c-0-10.json p/c-10-20.json",
        &[
            "figures/hot-face.svg",
            "figures/indices-*.svg",
            "figures/nominal.svg",
            "figures/peaks.svg",
            "figures/shares-*.svg",
            "figures/spread-*.svg",
            "percentiles.csv",
            "shares.csv",
            "traces.csv",
        ],
    ),
    command("repeat", "repeat p/r", &[]),
    command(
        "sensitivity",
        "sensitivity c",
        &[
            "figures/alignment.svg",
            "figures/hot-face.svg",
            "figures/nominal.svg",
            "figures/sensitivity-*.svg",
            "sensitivities.csv",
            "traces.csv",
        ],
    ),
    command(
        "estimate",
        "estimate c",
        &[
            "figures/fit-*.svg",
            "figures/objective.svg",
            "figures/residuals.svg",
            "iterations.csv",
            "residuals.csv",
            "traces.csv",
        ],
    ),
    command(
        "study",
        "study c -n 8",
        &[
            "figures/alignment.svg",
            "figures/fit-*.svg",
            "figures/hot-face.svg",
            "figures/nominal.svg",
            "figures/objective.svg",
            "figures/peaks.svg",
            "figures/residuals.svg",
            "figures/sensitivity-*.svg",
            "figures/shares-*.svg",
            "figures/spread-*.svg",
            "iterations.csv",
            "percentiles.csv",
            "residuals.csv",
            "sensitivities.csv",
            "shares.csv",
            "traces.csv",
        ],
    ),
    command(
        "size",
        "size c --ply BASE --limit TC2<600K --probability 0.8 -n 20",
        &[
            "figures/hot-face.svg",
            "figures/nominal.svg",
            "figures/size-*.svg",
            "required-thickness.csv",
            "sizing.csv",
            "traces.csv",
        ],
    ),
    command(
        "trade",
        "trade c --ply BASE=pyrogel3350,saffil-96 --size BASE --limit TC2<700K --probability 0.8 -n 20",
        &[
            "figures/hot-face.svg",
            "figures/nominal.svg",
            "figures/trade-*.svg",
            "layups.csv",
            "masses.csv",
            "rank-changes.csv",
            "traces.csv",
        ],
    ),
    command(
        "design",
        "design c --estimate f_k --sensors 1 -n 10",
        &[
            "design.toml",
            "designs.csv",
            "figures/design-*.svg",
            "figures/hot-face.svg",
            "figures/nominal.svg",
            "information.csv",
            "traces.csv",
        ],
    ),
    command(
        "history",
        "history c --knots 1",
        &[
            "figures/history-*.svg",
            "figures/hot-face.svg",
            "figures/nominal.svg",
            "history-*.csv",
            "history.csv",
            "traces.csv",
        ],
    ),
    command(
        "twin",
        "twin c --study 2",
        &[
            "coverage.csv",
            "figures/coverage.svg",
            "figures/estimates-*.svg",
            "figures/hot-face.svg",
            "figures/nominal.svg",
            "traces.csv",
        ],
    ),
    command("devices", "devices", &[]),
    command("materials list", "materials list", &[]),
    command("materials show", "materials show akk", &[]),
    command("materials check", "materials check felt.toml", &[]),
    command(
        "materials import table",
        "materials import table felt.csv --name Felt --temperature T --density 120 --conductivity k --heat-capacity cp \
         --emissivity 0.85 --unit cp=J/kg/K --out made.toml",
        &["made.toml"],
    ),
    command("materials import pato", "materials import pato resin --name Resin --out made.toml", &["made.toml"]),
    command("verify", "verify --group fit", &[]),
    command("completions", "completions bash", &[]),
    command("man", "man pages", &["pages/bondline*.1"]),
];

const MCMC: &str = "estimate c --posterior --walkers 16 --mcmc-iterations 20";
const STUDY_MCMC: &str = "study c -n 8 --posterior --walkers 16 --mcmc-iterations 20";
const TABLE: &str = "materials import table felt.csv --name Felt --temperature T --density 120 --conductivity k \
                     --heat-capacity cp --emissivity 0.85 --out made.toml";
const ANISOTROPIC: &str = "materials import pato anisotropic --name Resin --out made.toml";
const NOISY: &str = "twin c --noise 3K";

pub(super) const ROWS: &[Row] = &[
    // The case, the output and the march, of all commands that have them.
    differs("*", "case", "", "c => d"),
    differs("*", "out", "", "--out elsewhere"),
    row("*", "force", "", "--force", Evidence::BesideOwnFile("out/c/{}/report.html")),
    differs("*", "json", "", "--json"),
    differs("*", "limit-time", "", "--limit-time 0s"),
    differs("*", "backend", "", "--backend gpu"),
    differs("*", "precision", "", "--precision f32"),
    differs("*", "device", "", "--device nonesuch"),
    refused(
        "*",
        "instruction-set",
        "--instruction-set nonesuch",
        "'nonesuch' for '--instruction-set <NAME>': this processor has ",
    ),
    differs("*", "set", "", "--set f_q=1.05"),
    refused("observations", "limit-time", "--limit-time 1s", "--limit-time has no effect: observations are read"),
    differs("observations", "set", "", "--set observations.sigma=5K"),
    row("*", "quiet", "", "--quiet", Evidence::BesideOwnFile("out/c/{}/report.html")),
    // Sweeps.
    differs("uncertainty", "-n", "uncertainty c", "-n 20"),
    differs("study", "-n", "study c", "-n 8"),
    differs("size", "-n", "size c --ply BASE --limit TC2<600K --probability 0.8", "-n 20"),
    differs("trade", "-n", "trade c --ply BASE=pyrogel3350 --size BASE --limit TC2<700K --probability 0.8", "-n 20"),
    differs("design", "-n", "design c --estimate f_k --sensors 1", "-n 10"),
    differs("*", "sampling", "", "--sampling sobol"),
    differs("*", "seed", "", "--seed 2"),
    differs("*", "sampling-bounds", "", "--sampling-bounds large"),
    differs("uncertainty", "max-failed", "uncertainty fails -n 40", "--max-failed 40"),
    differs("study", "max-failed", "study fails -n 40", "--max-failed 40"),
    differs(
        "size",
        "max-failed",
        "size fails --ply BASE --limit TC2<1060K --thickness-range 1mm:4mm --probability 0.8 -n 40",
        "--max-failed 40",
    ),
    differs(
        "trade",
        "max-failed",
        "trade fails --ply BASE=short --size BASE --limit TC2<1060K --thickness-range 1mm:4mm --probability 0.8 -n 40",
        "--max-failed 40",
    ),
    differs("merge", "max-failed", "merge q/fails-0-20.json q/fails-20-40.json", "--max-failed 40"),
    differs("*", "resume", "", "--resume"),
    refused(
        "*",
        "checkpoint-interval",
        "--checkpoint-interval 3K",
        "'3K' for '--checkpoint-interval <TIME>': wrong dimension",
    ),
    row(
        "estimate",
        "checkpoint-interval",
        MCMC,
        "--checkpoint-interval 3K",
        Evidence::Refused("'3K' for '--checkpoint-interval <TIME>': wrong dimension"),
    ),
    row(
        "uncertainty",
        "checkpoint-interval",
        "",
        "",
        Evidence::Test("cli/trials.rs", "a_sweep_that_is_killed_at_any_moment_is_resumed_to_the_same_bits"),
    ),
    differs("*", "depth-profiles", "", "--depth-profiles 10s"),
    differs("uncertainty", "until", "uncertainty c -n 3000", "--until TC2\u{a0}P90±50K"),
    differs("uncertainty", "keep", "", "--keep members"),
    differs("uncertainty", "members", "", "--members 0..10"),
    differs("uncertainty", "piece", "", "--piece 1/4"),
    differs("merge", "parts", "merge p/c-0-10.json", "p/c-10-20.json"),
    differs("merge", "missing", "merge p/c-0-10.json", "--missing"),
    differs("merge", "case", "", "--case d"),
    differs("repeat", "folder", "", "p/r => p/s"),
    row("repeat", "quiet", "", "--quiet", Evidence::BesideOwnFile("p/r-repeated/report.html")),
    row("repeat", "force", "", "--force", Evidence::BesideOwnFile("p/r-repeated/report.html")),
    // Observations, fits and posteriors.
    differs("*", "sensors", "", "--sensors TC1"),
    differs("history", "sensors", "history c --knots 1", "--sensors TC1"),
    differs("*", "window", "", "--window 0:20"),
    differs("history", "window", "history c --knots 0 --sensors TC1,TC2", "--window 0:36"),
    differs("*", "bounds", "", "--bounds large"),
    differs("twin", "bounds", "twin c --study 2 --noise 60K", "--bounds large"),
    refused("history", "bounds", "--bounds large", "--bounds: a history estimates no factor"),
    differs("*", "factors", "", "--factors f_q"),
    differs("*", "start", "", "--start f_k=0.85"),
    differs("*", "loss", "", "--loss soft-l1"),
    differs("*", "prior", "", "--prior small"),
    differs("*", "minimiser", "", "--minimiser paper"),
    differs("estimate", "minimiser", "estimate c --start f_k=0.85", "--minimiser paper"),
    differs("study", "minimiser", "study c -n 8 --start f_k=0.85", "--minimiser paper"),
    differs("*", "starts", "", "--starts 3"),
    differs("twin", "starts", "twin c --study 2 --max-iterations 1", "--starts 4"),
    differs("*", "profile", "", "--profile f_k"),
    refused("twin", "profile", "--profile f_k", "--profile: a coverage study counts the linear intervals"),
    differs("*", "max-iterations", "", "--max-iterations 1 --start f_k=0.85"),
    differs("*", "posterior", "", "--posterior --walkers 16 --mcmc-iterations 20"),
    differs("estimate", "walkers", MCMC, "16 => 24"),
    differs("estimate", "mcmc-iterations", MCMC, "20 => 30"),
    differs("study", "walkers", STUDY_MCMC, "16 => 24"),
    differs("study", "mcmc-iterations", STUDY_MCMC, "20 => 30"),
    differs("estimate", "seed", MCMC, "--seed 2"),
    differs("estimate", "resume", MCMC, "--resume"),
    differs("estimate", "compare", "", "--compare d"),
    differs("estimate", "others", "", "d"),
    differs("sensitivity", "method", "", "--method difference"),
    differs("sensitivity", "step", "sensitivity c --method difference", "--step 1e-2"),
    // Sizing, trade studies and designs.
    differs("size", "ply", "", "BASE => TOP"),
    differs("trade", "ply", "", "--ply TOP=nextel440_bf20,sic_5hs"),
    differs("trade", "size", "", "BASE => TOP"),
    differs("trade", "exposures", "", "d"),
    differs("size", "limit", "", "TC2<600K => TC2<650K"),
    differs("trade", "limit", "", "TC2<700K => TC2<650K"),
    differs("*", "probability", "", "0.8 => 0.6"),
    differs("*", "thickness-range", "", "--thickness-range 2mm:9mm"),
    differs("design", "others", "", "d"),
    differs("design", "estimate", "design c --sensors 1 -n 10", "--estimate f_q"),
    differs("design", "sensors", "design c --estimate f_k -n 10", "--sensors 1"),
    differs("design", "criterion", "", "--criterion c"),
    differs("design", "worst", "", "--worst"),
    differs("design", "target", "", "--target TC1"),
    differs("design", "grid", "", "--grid 0.3mm"),
    differs("design", "least-distance", "design c --estimate f_k --sensors 2 -n 10", "--least-distance 2mm"),
    differs("design", "position-tolerance", "", "--position-tolerance 0.2mm"),
    differs("design", "sampling", "", "--sampling 2s"),
    differs("design", "noise", "", "--noise 3K"),
    differs("design", "correlation-time", "", "--correlation-time 3s"),
    differs("design", "run-lengths", "", "--run-lengths 20s,40s"),
    refused("history", "quantity", "--quantity gas", "give it a `heat_transfer_coefficient` and a `gas`"),
    differs("history", "knots", "history c", "--knots 1"),
    differs("history", "smoothing", "", "--smoothing 3"),
    // Synthetic observations.
    differs("twin", "out", NOISY, "--out elsewhere.csv"),
    row("twin", "force", NOISY, "--force", Evidence::BesideOwnFile("measured.csv")),
    refused("twin", "truth", "--truth f_k=1.1", "cannot be used with"),
    differs("twin", "truth", "twin c", "--truth f_k=1.1"),
    differs("twin", "noise", "", "--noise 3K"),
    differs("twin", "correlation-time", "", "--correlation-time 5s"),
    differs("twin", "seed", "", "--seed 2"),
    differs("twin", "study", "twin c", "--study 2"),
    // Materials, templates and what describes the command.
    differs("init", "folder", "", "new => other"),
    differs("init", "template", "", "--template estimate"),
    differs("init", "list", "", "new => --list"),
    row("init", "force", "", "--force", Evidence::BesideOwnFile("new/notes.txt")),
    differs("devices", "json", "", "--json"),
    differs("materials show", "name", "", "akk => kkl"),
    differs("materials check", "file", "", "felt.toml => felt.csv"),
    differs("materials import table", "file", "", "felt.csv => other.csv"),
    differs("materials import table", "temperature", "", "T => k"),
    differs("materials import table", "density", "", "120 => 130"),
    differs("materials import table", "conductivity", "", "k => 0.2W/m/K"),
    differs("materials import table", "heat-capacity", TABLE, "cp => 900J/kg/K"),
    differs("materials import table", "emissivity", "", "0.85 => 0.7"),
    differs("materials import table", "unit", "", "--unit k=kW/m/K"),
    differs("materials import table", "outside", "", "--outside extrapolate"),
    row(
        "materials import table",
        "outside",
        "materials import table felt.csv --name Felt --temperature T --density 120 --conductivity 0.1W/m/K \
         --heat-capacity 900J/kg/K --emissivity 0.85 --out made.toml",
        "--outside extrapolate",
        Evidence::Refused("outside: no property is a table"),
    ),
    differs("materials import pato", "folder", "", "resin => anisotropic"),
    differs("materials import pato", "heat", "", "--heat of-reaction"),
    differs("materials import pato", "direction", ANISOTROPIC, "--direction k"),
    differs("materials import table", "name", "", "Felt => Other"),
    differs("materials import pato", "name", "", "Resin => Other"),
    differs("materials import table", "out", "", "made.toml => other.toml"),
    differs("materials import pato", "out", "", "made.toml => other.toml"),
    row("materials import table", "force", "", "--force", Evidence::BesideOwnFile("made.toml")),
    row("materials import pato", "force", "", "--force", Evidence::BesideOwnFile("made.toml")),
    differs("*", "mark", "", "--mark read --source paper --uncertainty 3%"),
    differs("*", "source", "", "--source paper"),
    differs("*", "uncertainty", "", "--mark read --source paper --uncertainty 3%"),
    differs("verify", "group", "", "fit => nonesuch"),
    differs("verify", "json", "", "--json"),
    refused("verify", "set", "--set f_q=1", "--set changes a case file, and verify reads none"),
    refused("verify", "precision", "--precision f32", "--precision has no effect on the group fit"),
    refused("verify", "backend", "--backend gpu", "--backend has no effect on the group fit"),
    row("verify", "quiet", "verify --group cross-backend", "--quiet", Evidence::Differs),
    differs("completions", "shell", "", "bash => zsh"),
    differs("man", "folder", "", "pages => others"),
];
