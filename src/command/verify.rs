//! `bondline verify`: the verification table.

use crate::command::args::MarchArgs;
use crate::command::exit::{Failure, Output, input};
use crate::march::backend_selection::{self, BackendKind};
use crate::march::cpu::Cpu;
use crate::march::gpu::Gpu;
use crate::march::gpu::device::{self, Device};
use crate::march::{March, Precision};
use crate::plan::Plan;
use crate::verify::{Group, problems::flexible, text_table, verification_rows};
use serde_json::json;

/// Groups whose marches are those of the chosen backend.
const MARCHED: [Group; 5] = [Group::Exact, Group::Orders, Group::Codes, Group::Adapted, Group::Balance];

/// Compute every problem and print the table. The chosen backend is compared with the references; all backends are
/// compared with the CPU in double precision. Exit code 1 if a row fails.
pub(crate) fn run(as_json: bool, group: Option<&str>, args: &MarchArgs) -> Result<Output, Failure> {
    let groups: Vec<Group> = match group {
        None => Group::ALL.to_vec(),
        Some(name) => {
            let found = Group::ALL.into_iter().filter(|group| group.name() == name).collect::<Vec<_>>();
            if found.is_empty() {
                let names = Group::ALL.map(Group::name).join(", ");
                return Err(input(format!("--group {name:?}: no such group; there are {names}")));
            }
            found
        }
    };
    if !args.sets.is_empty() {
        return Err(input("--set changes a case file, and verify reads none"));
    }
    let mut choice = args.backend.clone();
    let given = [
        (choice.backend != BackendKind::Auto, "--backend"),
        (choice.precision.is_some(), "--precision"),
        (choice.instruction_set.is_some(), "--instruction-set"),
    ];
    let given = given.into_iter().find_map(|(is_given, option)| is_given.then_some(option));
    if let (Some(option), false) = (given, groups.iter().any(|group| MARCHED.contains(group))) {
        let names = groups.iter().map(|group| group.name()).collect::<Vec<_>>().join(", ");
        return Err(input(format!("{option} has no effect on the group {names}, which chooses its own marches")));
    }
    if choice.backend == BackendKind::Auto {
        choice.backend = BackendKind::Cpu;
    }
    if let (Some(device), BackendKind::Cpu, false) =
        (&choice.device, choice.backend, groups.contains(&Group::CrossBackend))
    {
        return Err(input(format!(
            "--device {device:?}: these groups run on the CPU; give --backend gpu, or --group cross-backend"
        )));
    }
    choice.precision = choice.precision.or(Some(Precision::F64));
    let mut march = backend_selection::open(&choice, &Plan::new(&flexible::flexible_layup()), 1)?;
    let mut marches: Vec<Box<dyn March>> = vec![Box::new(Cpu::new(Precision::F32))];
    let mut note = String::new();
    if groups.contains(&Group::CrossBackend) {
        match device::find(args.backend.device.as_deref()) {
            Ok(adapter) => {
                marches.push(Box::new(Gpu::new(Device::open(adapter.clone(), false)?, Precision::F32)?));
                if adapter.has_f64 {
                    marches.push(Box::new(Gpu::new(Device::open(adapter, false)?, Precision::F64)?));
                }
            }
            Err(error) if args.backend.device.is_some() => return Err(error.into()),
            Err(error) if !args.quiet => note = format!("no device was compared with the CPU: {error}\n"),
            Err(_) => {}
        }
    }
    let rows = verification_rows(march.as_mut(), &mut marches, &groups)?;
    let failed = rows.iter().filter(|row| !row.pass()).count();
    let text = if as_json {
        let values: Vec<_> = rows
            .iter()
            .map(|row| {
                json!({
                    "group": row.group.name(),
                    "case": row.case,
                    "reference": row.reference,
                    "quantity": row.quantity,
                    "difference": row.difference,
                    "tolerance": row.tolerance,
                    "unit": row.unit,
                    "source_of_tolerance": row.source(),
                    "pass": row.pass(),
                })
            })
            .collect();
        format!("{:#}\n", json!({ "rows": values, "passed": rows.len() - failed, "failed": failed }))
    } else {
        format!("{}{note}", text_table(&rows))
    };
    Ok(Output { text, failure: (failed > 0).then(|| format!("{failed} of {} rows fail", rows.len())) })
}
