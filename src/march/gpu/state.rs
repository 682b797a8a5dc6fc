//! State of a member between dispatches: blocks of words in one storage buffer, slot × member.
//!
//! This table defines the slots: the host reads results by it, and the WGSL functions that load and save each block are
//! generated from it.

use crate::physics::layout::{GasTransport, HEAT_TOTALS};
use crate::plan::Plan;

/// A block of the state, in the order of the buffer. Results for the host start at [`Heat`](Self::Heat).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Block {
    Temperatures,
    Readings,
    Heat,
    Stored,
    Extremes,
    GasSums,
    GasFlows,
    Advancements,
    Phases,
    Sources,
    Pressures,
}

/// Words of [`Slots`]: the size of a uniform struct is a multiple of four words.
const SLOT_WORDS: usize = Block::ALL.len().next_multiple_of(4);

/// First slot of each block; the WGSL struct `Slots`.
pub(super) type Slots = [u32; SLOT_WORDS];

impl Block {
    pub(super) const ALL: [Self; 11] = [
        Self::Temperatures,
        Self::Readings,
        Self::Heat,
        Self::Stored,
        Self::Extremes,
        Self::GasSums,
        Self::GasFlows,
        Self::Advancements,
        Self::Phases,
        Self::Sources,
        Self::Pressures,
    ];

    /// The name of the block in WGSL, and the WGSL variables of item `i`, one word each.
    const fn wgsl(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Temperatures => ("temperatures", &["temperatures[i].high", "temperatures[i].low"]),
            Self::Readings => {
                ("readings", &["readings[i].high", "readings[i].low", "beads_now[i].high", "beads_now[i].low"])
            }
            Self::Heat => ("heat", &["heat[i].high", "heat[i].low"]),
            Self::Stored => ("stored", &["stored_j_m2"]),
            Self::Extremes => ("extremes", &["coldest[i]", "hottest[i]"]),
            Self::GasSums => (
                "gas_sums",
                &[
                    "gas_in.high",
                    "gas_in.low",
                    "gas_out.high",
                    "gas_out.low",
                    "gas_heat.high",
                    "gas_heat.low",
                    "reaction_gain.high",
                    "reaction_gain.low",
                    "lost_and_stored[0]",
                    "lost_and_stored[1]",
                ],
            ),
            Self::GasFlows => {
                ("gas_flows", &["recent_outflows[0]", "recent_outflows[1]", "mean_hot_outflow", "back_outflow"])
            }
            Self::Advancements => ("advancements", &["advancements[i].high", "advancements[i].low"]),
            Self::Phases => ("phases", &["first_stage_phases[i]"]),
            Self::Sources => ("sources", &["mean_gas_source[i]", "mean_absorbed_heat[i]", "heat_slopes[i]"]),
            Self::Pressures => (
                "pressures",
                &[
                    "pressures[i].high",
                    "pressures[i].low",
                    "pressure_rates[i]",
                    "pores[i].storage",
                    "mean_mass_fluxes[i]",
                    "supply[i]",
                ],
            ),
        }
    }

    /// Number of items of one member.
    fn items(self, plan: &Plan) -> usize {
        let of_gas = |items: usize| if plan.rows.gas.is_some() { items } else { 0 };
        match self {
            Self::Temperatures => plan.cells(),
            Self::Readings => plan.rows.sensor_locations.len(),
            Self::Heat => HEAT_TOTALS,
            Self::Stored => 1,
            Self::Extremes => plan.rows.plies.len(),
            Self::GasSums | Self::GasFlows => of_gas(1),
            Self::Advancements => of_gas(plan.cells() * plan.rows.max_reactions.max(1)),
            Self::Phases => of_gas(plan.cells() * plan.rows.max_states),
            Self::Sources => of_gas(plan.cells()),
            Self::Pressures if plan.rows.gas == Some(GasTransport::Darcy) => plan.cells(),
            Self::Pressures => 0,
        }
    }

    fn words(self, plan: &Plan) -> usize {
        self.items(plan) * self.wgsl().1.len()
    }

    /// First slot of the block.
    pub(super) fn slot(self, plan: &Plan) -> usize {
        Self::ALL.iter().take_while(|block| **block != self).map(|block| block.words(plan)).sum()
    }
}

/// Words of the state of one member.
pub(super) fn state_words(plan: &Plan) -> usize {
    Block::ALL.iter().map(|block| block.words(plan)).sum()
}

/// First slot of each block of a plan.
pub(super) fn slots(plan: &Plan) -> Slots {
    let mut slots = [0; SLOT_WORDS];
    slots.iter_mut().zip(Block::ALL).for_each(|(slot, block)| *slot = block.slot(plan) as u32);
    slots
}

/// The WGSL struct `Slots`, and for each block the functions `load_…` and `save_…`, which loop over items from `first`
/// to `end` by `stride`. `save_…` returns the number of items saved, fewer where a driver terminated the loop early.
pub(super) fn declarations() -> String {
    let padding = (Block::ALL.len()..SLOT_WORDS).map(|place| format!("unused_{place}"));
    let names = Block::ALL.iter().map(|block| block.wgsl().0.to_owned()).chain(padding);
    let fields: String = names.map(|name| format!("    {name}: u32,\n")).collect();
    let functions = Block::ALL.iter().map(|block| {
        let (name, variables) = block.wgsl();
        let words = variables.len();
        let places =
            variables.iter().zip(0..).map(|(variable, word)| (*variable, format!("state[slot(base + {word}u)]")));
        let loads: String =
            places.clone().map(|(variable, place)| format!("        {variable} = {place};\n")).collect();
        let saves: String = places.map(|(variable, place)| format!("        {place} = {variable};\n")).collect();
        let each = format!(
            "    for (var i = first; i < end; i += stride) {{\n        let base = run.slots.{name} + {words}u * i;\n"
        );
        format!(
            "fn load_{name}(first: u32, end: u32, stride: u32) {{\n{each}{loads}    }}\n}}\n\
             fn save_{name}(first: u32, end: u32, stride: u32) -> u32 {{\n    var saved = 0u;\n{each}{saves}        \
             saved++;\n    }}\n    return saved;\n}}\n"
        )
    });
    format!("struct Slots {{\n{fields}}}\n{}", functions.collect::<String>())
}
