//! What a march returns.

use std::ops::Range;

/// Temperatures of a run of members at every sensor and instant, and how each member arrived.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Traces {
    /// Index in the ensemble of the first member here.
    pub first: usize,
    /// Sensors of the case.
    pub sensors: usize,
    /// Instants of each trace.
    pub instants: usize,
    /// Member × sensor × instant, K.
    pub temperatures_k: Vec<f64>,
    /// Member × gauge × instant, in the units of each [`Gauge`]; empty where nothing decomposes and no gas flows.
    pub gauges: Vec<f64>,
    /// One a member.
    pub arrivals: Vec<Arrival>,
    /// One a member.
    pub balances: Vec<Balance>,
    /// Member × ply: coldest and hottest temperature met, K.
    pub extremes_k: Vec<(f64, f64)>,
}

/// What is read of a layup as a whole, beside its sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Gauge {
    /// Gas that leaves through the hot face, kg/m²/s; below zero where it flows in.
    GasFlux,
    /// Solid lost since the start, kg/m².
    MassLost,
    /// Depth below the hot face down to which 2 % of what can be lost is lost, m.
    VirginFront,
    /// Depth below the hot face down to which 98 % of what can be lost is lost, m.
    CharFront,
    /// Largest gas pressure in the layup, Pa.
    PeakPressure,
    /// Gas pressure at the back face, Pa.
    BackPressure,
}

impl Gauge {
    /// In the order in which traces hold them.
    pub const ALL: [Self; 6] =
        [Self::GasFlux, Self::MassLost, Self::VirginFront, Self::CharFront, Self::PeakPressure, Self::BackPressure];

    /// Whether it is a depth at which conversion crosses a mark.
    pub fn is_front(self) -> bool {
        matches!(self, Self::VirginFront | Self::CharFront)
    }

    /// What it is called in files, its unit last.
    pub fn name(self) -> &'static str {
        match self {
            Self::GasFlux => "gas_flux_kg_m2_s",
            Self::MassLost => "mass_lost_kg_m2",
            Self::VirginFront => "virgin_front_m",
            Self::CharFront => "char_front_m",
            Self::PeakPressure => "peak_pressure_pa",
            Self::BackPressure => "back_pressure_pa",
        }
    }

    /// The SI unit of its values.
    pub fn unit(self) -> &'static str {
        match self {
            Self::GasFlux => "kg/m²/s",
            Self::MassLost => "kg/m²",
            Self::VirginFront | Self::CharFront => "m",
            Self::PeakPressure | Self::BackPressure => "Pa",
        }
    }
}

/// How a member's march ended.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Arrival {
    /// The march reached its end.
    Done,
    /// A temperature left the range in which anything is known, or was no number.
    Strayed {
        /// When, s.
        time_s: f64,
    },
    /// A table that refuses to be left was left.
    LeftTable {
        /// The place of the ply in the layup.
        ply: usize,
        /// The temperature that it met, K.
        temperature_k: f64,
    },
}

/// Heat through the two faces and from and to the holder over the whole march, gas through the faces, and what was
/// stored of both: J/m² and kg/m². All are positive but where a field says otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[non_exhaustive]
pub struct Balance {
    /// Into the hot face.
    pub hot_in_j_m2: f64,
    /// Out of the hot face.
    pub hot_out_j_m2: f64,
    /// Into the back face.
    pub back_in_j_m2: f64,
    /// Out of the back face.
    pub back_out_j_m2: f64,
    /// From the holder.
    pub holder_in_j_m2: f64,
    /// To the holder.
    pub holder_out_j_m2: f64,
    /// Heat stored at the end less that at the start; of either sign.
    pub stored_j_m2: f64,
    /// Enthalpy that gas took along out of the layup, less what it brought; absolute where enthalpies are, so of either sign.
    pub gas_heat_j_m2: f64,
    /// Heat that reactions gave beyond the enthalpies of what they turned into what; nothing where those are absolute.
    pub reaction_gain_j_m2: f64,
    /// Solid turned into gas.
    pub solid_lost_kg_m2: f64,
    /// Through both faces, inward.
    pub gas_in_kg_m2: f64,
    /// Through both faces, outward.
    pub gas_out_kg_m2: f64,
    /// Gas in the pores at the end less that at the start.
    pub gas_stored_kg_m2: f64,
}

/// Less heat than this is rounding of what a layup holds: it warms a gram of cloth on a square metre by a thousandth of a kelvin.
const LEAST_HEAT_J_M2: f64 = 1e-3;

impl Balance {
    /// From the sums that a member keeps: in and out through the hot face and the back face, from and to the holder.
    pub fn new(sums_j_m2: [f64; 6], stored_j_m2: f64) -> Self {
        let [hot_in_j_m2, hot_out_j_m2, back_in_j_m2, back_out_j_m2, holder_in_j_m2, holder_out_j_m2] = sums_j_m2;
        Self {
            hot_in_j_m2,
            hot_out_j_m2,
            back_in_j_m2,
            back_out_j_m2,
            holder_in_j_m2,
            holder_out_j_m2,
            stored_j_m2,
            ..Self::default()
        }
    }

    /// With what gas took along: gas in and out through both faces, the heat it carried, what reactions gave beyond enthalpies, solid lost and gas
    /// stored.
    #[must_use]
    pub fn and_gas(self, gone: [f64; 6]) -> Self {
        let [gas_in_kg_m2, gas_out_kg_m2, gas_heat_j_m2, reaction_gain_j_m2, solid_lost_kg_m2, gas_stored_kg_m2] = gone;
        Self {
            gas_in_kg_m2,
            gas_out_kg_m2,
            gas_heat_j_m2,
            reaction_gain_j_m2,
            solid_lost_kg_m2,
            gas_stored_kg_m2,
            ..self
        }
    }

    /// Each entry from those of two others.
    #[must_use]
    pub fn combined(one: Self, other: Self, each: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            hot_in_j_m2: each(one.hot_in_j_m2, other.hot_in_j_m2),
            hot_out_j_m2: each(one.hot_out_j_m2, other.hot_out_j_m2),
            back_in_j_m2: each(one.back_in_j_m2, other.back_in_j_m2),
            back_out_j_m2: each(one.back_out_j_m2, other.back_out_j_m2),
            holder_in_j_m2: each(one.holder_in_j_m2, other.holder_in_j_m2),
            holder_out_j_m2: each(one.holder_out_j_m2, other.holder_out_j_m2),
            stored_j_m2: each(one.stored_j_m2, other.stored_j_m2),
            gas_heat_j_m2: each(one.gas_heat_j_m2, other.gas_heat_j_m2),
            reaction_gain_j_m2: each(one.reaction_gain_j_m2, other.reaction_gain_j_m2),
            solid_lost_kg_m2: each(one.solid_lost_kg_m2, other.solid_lost_kg_m2),
            gas_in_kg_m2: each(one.gas_in_kg_m2, other.gas_in_kg_m2),
            gas_out_kg_m2: each(one.gas_out_kg_m2, other.gas_out_kg_m2),
            gas_stored_kg_m2: each(one.gas_stored_kg_m2, other.gas_stored_kg_m2),
        }
    }

    /// In less out less stored, relative to what came in.
    pub fn residual(&self) -> f64 {
        let came_in = self.hot_in_j_m2 + self.back_in_j_m2 + self.holder_in_j_m2;
        let went_out = self.hot_out_j_m2 + self.back_out_j_m2 + self.holder_out_j_m2;
        let moved = came_in.max(went_out);
        let moved = if moved > 0.0 { moved } else { self.stored_j_m2.abs() };
        let left = came_in - went_out - self.gas_heat_j_m2 + self.reaction_gain_j_m2 - self.stored_j_m2;
        left / moved.max(LEAST_HEAT_J_M2)
    }

    /// Solid lost and gas in less gas out less gas stored, relative to the largest of the first three; nothing moved leaves
    /// no residual.
    pub fn mass_residual(&self) -> f64 {
        let moved = self.solid_lost_kg_m2.max(self.gas_in_kg_m2).max(self.gas_out_kg_m2);
        let left = self.solid_lost_kg_m2 + self.gas_in_kg_m2 - self.gas_out_kg_m2 - self.gas_stored_kg_m2;
        if moved > 0.0 { left / moved } else { 0.0 }
    }
}

impl Traces {
    /// Of no member yet.
    pub fn none(first: usize, sensors: usize, instants: usize) -> Self {
        Self {
            first,
            sensors,
            instants,
            temperatures_k: Vec::new(),
            gauges: Vec::new(),
            arrivals: Vec::new(),
            balances: Vec::new(),
            extremes_k: Vec::new(),
        }
    }

    /// Takes some of the members of others behind its own, counted from the first that is there.
    pub fn extend(&mut self, other: &Self, members: Range<usize>) {
        let (count, of) = (other.members(), &members);
        self.temperatures_k.extend_from_slice(some(&other.temperatures_k, count, of));
        self.gauges.extend_from_slice(some(&other.gauges, count, of));
        self.arrivals.extend_from_slice(some(&other.arrivals, count, of));
        self.balances.extend_from_slice(some(&other.balances, count, of));
        self.extremes_k.extend_from_slice(some(&other.extremes_k, count, of));
    }

    /// Members that the traces are of.
    pub fn members(&self) -> usize {
        self.arrivals.len()
    }

    /// One member's temperatures at one sensor over the instants, K.
    pub fn trace(&self, member: usize, sensor: usize) -> &[f64] {
        let start = (member * self.sensors + sensor) * self.instants;
        &self.temperatures_k[start..start + self.instants]
    }

    /// One member's readings of one gauge over the instants; none where gauges were not read.
    pub fn gauge(&self, member: usize, gauge: Gauge) -> Option<&[f64]> {
        let start = (member * Gauge::ALL.len() + gauge as usize) * self.instants;
        self.gauges.get(start..start + self.instants)
    }

    /// One member's temperatures: sensor × instant, K.
    pub fn member(&self, member: usize) -> &[f64] {
        let size = self.sensors * self.instants;
        &self.temperatures_k[member * size..(member + 1) * size]
    }
}

/// What belongs to some members of values that lie member by member, as many of each.
fn some<'a, T>(values: &'a [T], count: usize, members: &Range<usize>) -> &'a [T] {
    let each = values.len() / count;
    &values[members.start * each..members.end * each]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solid_lost_is_gas_out_and_gas_stored() {
        let whole = Balance { solid_lost_kg_m2: 2.0, gas_out_kg_m2: 1.5, gas_stored_kg_m2: 0.5, ..Balance::default() };
        assert_eq!(whole.mass_residual(), 0.0);
        assert_eq!(Balance { gas_out_kg_m2: 1.0, ..whole }.mass_residual(), 0.25);
        assert_eq!(Balance::default().mass_residual(), 0.0);
    }

    #[test]
    fn gas_blown_in_is_gas_stored() {
        let filled = Balance { gas_in_kg_m2: 0.5, gas_stored_kg_m2: 0.5, ..Balance::default() };
        assert_eq!(filled.mass_residual(), 0.0);
        assert_eq!(Balance { gas_stored_kg_m2: 0.25, ..filled }.mass_residual(), 0.5);
    }

    #[test]
    fn gauges_lie_member_by_member_in_their_order() {
        let gauges = (0..2 * Gauge::ALL.len() * 3).map(|n| n as f64).collect();
        let traces = Traces {
            first: 0,
            sensors: 0,
            instants: 3,
            temperatures_k: Vec::new(),
            gauges,
            arrivals: vec![Arrival::Done; 2],
            balances: Vec::new(),
            extremes_k: Vec::new(),
        };
        for (index, gauge) in Gauge::ALL.into_iter().enumerate() {
            let first = (3 * (Gauge::ALL.len() + index)) as f64;
            assert_eq!(traces.gauge(1, gauge), Some([first, first + 1.0, first + 2.0].as_slice()));
        }
        assert_eq!(Traces { gauges: Vec::new(), ..traces }.gauge(0, Gauge::GasFlux), None);
    }
}
