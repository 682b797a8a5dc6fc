//! Examples at the end of every `--help`. The tests run each line that begins with `bondline`.

pub(super) const BONDLINE: &str = "\
Examples:
  # Start an own case from a template, and run all studies of it
  bondline init mycase
  bondline study mycase -n 1000

  # Run all studies of a shipped case
  bondline study cases/lamp-test -n 1000

Exit codes: 0 done; 1 failed (no convergence, too many failed members, a failed check,
an error ten times the tolerance); 2 wrong input, nothing is written; 3 device error.";

pub(super) const INIT: &str = "\
Examples:
  # A layup of cloth, insulation and gas barrier
  bondline init mycase

  # Another template, and the list of all
  bondline init myestimate --template estimate
  bondline init --list";

pub(super) const OBSERVATIONS: &str = "\
Examples:
  bondline observations cases/kaowool

  # The numbers as JSON
  bondline observations cases/lamp-test --json";

pub(super) const PREDICT: &str = "\
Examples:
  bondline predict cases/lcat-2259

  # With another conductivity and pressure
  bondline predict cases/lcat-2259 --set f_k_INS=1.1 --set pressure=\"3 kPa\"

  # The summary as JSON, computed on the CPU in single precision
  bondline predict cases/slab --json --backend cpu --precision f32";

pub(super) const UNCERTAINTY: &str = "\
Examples:
  bondline uncertainty cases/lcat-2259 -n 1000

  # Sobol samples between the large bounds; every member in a Parquet file
  bondline uncertainty cases/slab -n 1024 --sampling sobol \\
    --sampling-bounds large --keep members

  # Until the 95th percentile of the peak of TC4 is known to 8 K, and the
  # probability of a rare temperature to a tenth of it
  bondline uncertainty cases/lcat-2259 --until \"TC4 P95 ± 8 K\"
  bondline uncertainty cases/slab --until \"P(BACK>750 K) ± 20 %\"

  # Half of a sweep, for `merge`
  bondline uncertainty cases/slab -n 1000 --members 0..500 --out parts";

pub(super) const MERGE: &str = "\
Examples:
  bondline uncertainty cases/slab -n 1000 --members 0..500 --out parts
  bondline uncertainty cases/slab -n 1000 --members 500..1000 --out parts
  bondline merge parts/slab-0-500.json parts/slab-500-1000.json";

pub(super) const SENSITIVITY: &str = "\
Examples:
  bondline sensitivity cases/lcat-2259

  # For the first 60 s of two thermocouples
  bondline sensitivity cases/lamp-test --sensors TC1,TC3 --window 0:60

  # By central differences with a relative step of 1e-4
  bondline sensitivity cases/slab --step 1e-4";

pub(super) const ESTIMATE: &str = "\
Examples:
  bondline estimate cases/lamp-test --factors f_eps,f_k_INS,f_cp_INS

  # From 8 start points, with a robust loss and a profile likelihood
  bondline estimate cases/lamp-test --factors f_k_INS,f_cp_INS \\
    --starts 8 --loss huber --profile f_k_INS

  # With the posterior distribution, by MCMC
  bondline estimate cases/kaowool-tc --posterior \\
    --walkers 60 --mcmc-iterations 200

  # Two tests of the same materials at once
  bondline estimate cases/lcat-2259 cases/lcat-2330";

pub(super) const STUDY: &str = "\
Examples:
  bondline study cases/lcat-2259 -n 1000

  # On a GPU, with another seed
  bondline study cases/slab -n 1000 --seed 7 --backend gpu";

pub(super) const SIZE: &str = "\
Examples:
  # Felt for a back face below 425 K in 95 % of the members
  bondline size cases/lamp-test --ply INS --limit \"TC3 < 425 K\" \\
    --probability 0.95 -n 500

  # The same, between stated thicknesses
  bondline size cases/lamp-test --ply INS --limit \"TC3 < 425 K\" \\
    --probability 0.95 -n 500 --thickness-range \"2 mm:12 mm\"";

pub(super) const TRADE: &str = "\
Examples:
  # Two cloths and two insulators, by the mass that holds 650 K in 90 % of members
  bondline trade cases/lcat-2259 --ply OF=nextel440-bf20,sic-5hs \\
    --ply INS=pyrogel3350,pi-aerogel --size INS --limit \"TC4 < 650 K\" \\
    --probability 0.9 -n 100

  # The same, also under the exposure of another case
  bondline trade cases/lcat-2259 cases/lcat-2330 --ply INS=pyrogel3350,pi-aerogel \\
    --size INS --limit \"TC4 < 650 K\" --probability 0.9 -n 100";

pub(super) const DESIGN: &str = "\
Examples:
  bondline design cases/lcat-2259 --estimate f_k_INS,f_cp_INS,f_k_OF -n 200

  # Two thermocouples, placed to a quarter of a millimetre, in a shorter run too,
  # for the prediction of TC4
  bondline design cases/lcat-2259 --estimate f_k_INS,f_cp_INS --sensors 2 \\
    --position-tolerance \"0.25 mm\" --run-lengths 80s,200s --criterion c -n 200";

pub(super) const HISTORY: &str = "\
Examples:
  bondline history cases/lcat-2259-lumps

  # From one thermocouple, with 60 knots
  bondline history cases/lcat-2259-lumps --sensors TC1 --knots 60 --quantity flux";

pub(super) const TWIN: &str = "\
Examples:
  # Synthetic observations with 2 K noise, correlated over 5 s
  bondline twin cases/slab --truth f_k=1.1 --noise \"2 K\" \\
    --correlation-time \"5 s\" --out made.csv

  # How often the intervals of an estimate contain the truth
  bondline twin cases/lamp-test --study 20 --factors f_eps,f_k_INS,f_cp_INS";

pub(super) const REPEAT: &str = "\
Examples:
  bondline predict cases/slab --out report
  bondline repeat report";

pub(super) const DEVICES: &str = "\
Examples:
  bondline devices
  bondline devices --json";

pub(super) const MATERIALS: &str = "\
Examples:
  bondline materials list
  bondline materials show pyrogel3350
  bondline materials check cases/slab/materials/constant.toml";

pub(super) const MATERIALS_LIST: &str = "\
Examples:
  bondline materials list";

pub(super) const MATERIALS_SHOW: &str = "\
Examples:
  bondline materials show pyrogel3350";

pub(super) const MATERIALS_CHECK: &str = "\
Examples:
  bondline materials check cases/slab/materials/constant.toml";

pub(super) const MATERIALS_IMPORT: &str = "\
Examples:
  bondline materials import table data/import/felt.csv --name \"My felt\" \\
    --temperature \"T [K]\" --density 120 --conductivity \"k [W/m/K]\" \\
    --heat-capacity cp --unit \"cp=J/kg/K\" --emissivity 0.85 --out my_felt.toml";

pub(super) const MATERIALS_IMPORT_TABLE: &str = "\
Examples:
  # The heat capacity has no unit in the file
  bondline materials import table data/import/felt.csv --name \"My felt\" \\
    --temperature \"T [K]\" --density 120 --conductivity \"k [W/m/K]\" \\
    --heat-capacity cp --unit \"cp=J/kg/K\" --emissivity 0.85 --out my_felt.toml

  # Measured by us, with the report
  bondline materials import table data/import/felt.csv --name \"My felt\" \\
    --temperature \"T [K]\" --density \"7.5 lb/ft^3\" --conductivity \"k [W/m/K]\" \\
    --heat-capacity \"900 J/kg/K\" --emissivity 0.85 --out my_felt_2.toml \\
    --mark measured --source \"TR-2031, hot disk\" --uncertainty \"5 %\"";

pub(super) const MATERIALS_IMPORT_PATO: &str = "\
Examples:
  bondline materials import pato data/import/pato --name \"Made-up resin\" \\
    --out resin.toml

  # With the heats of the reactions
  bondline materials import pato data/import/pato --name \"Made-up resin\" \\
    --heat of-reaction --out resin_2.toml";

pub(super) const VERIFY: &str = "\
Examples:
  # All groups take some minutes
  bondline verify --group exact

  # As JSON
  bondline verify --group balance --json";

pub(super) const COMPLETIONS: &str = "\
Examples:
  bondline completions bash > bondline.bash
  bondline completions zsh > _bondline
  bondline completions fish > bondline.fish";

pub(super) const MAN: &str = "\
Examples:
  # Then: man -l man/bondline-estimate.1
  bondline man man";
