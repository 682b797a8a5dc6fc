//! Results of a march: temperatures, peaks, gauges, balances and status of each member.

use std::ops::Range;

/// Temperatures of consecutive members at every sensor and instant, and the status of each member.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Traces {
    /// Ensemble index of the first member.
    pub first: usize,
    /// Number of sensors.
    pub sensors: usize,
    /// Number of instants.
    pub instants: usize,
    /// Member × sensor × instant, K.
    pub temperatures_k: Vec<f64>,
    /// Member × limit × instant, K: the hottest temperature of each part that has a temperature limit, in the order of
    /// [`Case::limits`](crate::case::Case::limits); empty without limits.
    pub limited_k: Vec<f64>,
    /// Member × gauge × instant, in the unit of each [`Gauge`]; empty where nothing decomposes and no gas flows.
    pub gauges: Vec<f64>,
    /// Member × sensor: the peak over the whole march, between the instants too.
    pub peaks: Vec<Peak>,
    /// Member × limit: the peak of each part that has a temperature limit; empty without limits.
    pub limited_peaks: Vec<Peak>,
    /// Member × limit: time above the limit, s; empty without limits.
    pub times_above_s: Vec<f64>,
    /// Member × gauge: the extreme of each gauge; empty where nothing decomposes and no gas flows.
    pub gauge_peaks: Vec<GaugePeak>,
    /// One per member.
    pub statuses: Vec<MemberStatus>,
    /// One per member.
    pub balances: Vec<Balance>,
    /// Member × ply: lowest and highest temperature, K.
    pub extremes_k: Vec<(f64, f64)>,
}

/// The peak of a trace: its highest temperature over the whole march, whatever the instants, from the steps of the
/// march and the curve between them. Of a derivative, the derivative at the time of its member's peak.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Peak {
    /// The highest temperature, K.
    pub temperature_k: f64,
    /// The first time at which this temperature is reached, s.
    pub time_s: f64,
}

/// The extreme of a gauge over the whole march, whatever the instants.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct GaugePeak {
    /// The value of largest magnitude, with its sign: a gas flux that is always inward has no positive peak.
    pub value: f64,
    /// The first time at which this value is reached, s.
    pub time_s: f64,
}

/// A scalar output of the whole layup, in addition to its sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum Gauge {
    /// Gas mass flux out through the hot face, kg/m²/s; negative where gas flows in.
    GasFlux,
    /// Solid lost since the start, kg/m².
    MassLost,
    /// Depth below the hot face at which 2 % of the decomposable mass is lost, m.
    VirginFront,
    /// Depth below the hot face at which 98 % of the decomposable mass is lost, m.
    CharFront,
    /// Largest gas pressure in the layup, Pa.
    PeakPressure,
    /// Gas pressure at the back face, Pa.
    BackPressure,
}

impl Gauge {
    /// All gauges, in the order of [`Traces::gauges`].
    pub const ALL: [Self; 6] =
        [Self::GasFlux, Self::MassLost, Self::VirginFront, Self::CharFront, Self::PeakPressure, Self::BackPressure];

    /// Whether the gauge is the depth of a conversion front.
    pub fn is_front(self) -> bool {
        matches!(self, Self::VirginFront | Self::CharFront)
    }

    /// Name in files, with the unit last.
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

    /// SI unit of the values.
    pub fn unit(self) -> &'static str {
        match self {
            Self::GasFlux => "kg/m²/s",
            Self::MassLost => "kg/m²",
            Self::VirginFront | Self::CharFront => "m",
            Self::PeakPressure | Self::BackPressure => "Pa",
        }
    }
}

/// Status of a member at the end of its march.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub enum MemberStatus {
    /// The march reached the end of the exposure.
    Completed,
    /// A temperature left the range of 0 to 4,000 K or became NaN.
    Diverged {
        /// Time, s.
        time_s: f64,
    },
    /// A temperature left the range of a table that forbids extrapolation.
    OutOfTable {
        /// Index of the ply in the layup.
        ply: usize,
        /// The temperature outside the table, K.
        temperature_k: f64,
    },
}

/// Energy and mass balance of a march: heat through both faces and to the holder, gas through the faces, and storage of
/// both; J/m² and kg/m². All terms are positive unless a field states otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Balance {
    /// Heat into the layup through the hot face.
    pub hot_in_j_m2: f64,
    /// Heat out of the layup through the hot face.
    pub hot_out_j_m2: f64,
    /// Heat into the layup through the back face.
    pub back_in_j_m2: f64,
    /// Heat out of the layup through the back face.
    pub back_out_j_m2: f64,
    /// Heat from the holder into the layup.
    pub holder_in_j_m2: f64,
    /// Heat from the layup to the holder.
    pub holder_out_j_m2: f64,
    /// Change of stored heat; of either sign.
    pub stored_j_m2: f64,
    /// Enthalpy of the outgoing gas minus that of the incoming gas; of either sign where enthalpies are absolute.
    pub gas_heat_j_m2: f64,
    /// Heat of reaction beyond the enthalpy difference of reactants and products; zero where enthalpies are absolute.
    pub reaction_gain_j_m2: f64,
    /// Solid turned into gas.
    pub solid_lost_kg_m2: f64,
    /// Gas through both faces, inward.
    pub gas_in_kg_m2: f64,
    /// Gas through both faces, outward.
    pub gas_out_kg_m2: f64,
    /// Change of the gas stored in the pores; of either sign.
    pub gas_stored_kg_m2: f64,
}

/// Smallest heat to which a residual is relative: less is rounding. It warms a gram of cloth on a square metre by a
/// thousandth of a kelvin.
const MIN_HEAT_J_M2: f64 = 1e-3;

impl Balance {
    /// The balance from the sums of a member: heat in and out through the hot face, the back face, and the holder.
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

    /// The balance with the gas terms: gas in and out through both faces, its net enthalpy, the heat of reaction beyond
    /// enthalpies, solid lost, and gas stored.
    #[must_use]
    pub fn with_gas(self, gone: [f64; 6]) -> Self {
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

    /// Combine two balances entry by entry.
    #[must_use]
    pub fn zip_map(one: Self, other: Self, each: impl Fn(f64, f64) -> f64) -> Self {
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

    /// The same net flows without negative amounts: what is missing of inflow flowed out.
    #[must_use]
    pub(crate) fn without_negative_flows(self) -> Self {
        let pair = |inward: f64, outward: f64| {
            let least = inward.min(outward).min(0.0);
            (inward - least, outward - least)
        };
        let (hot_in_j_m2, hot_out_j_m2) = pair(self.hot_in_j_m2, self.hot_out_j_m2);
        let (back_in_j_m2, back_out_j_m2) = pair(self.back_in_j_m2, self.back_out_j_m2);
        let (holder_in_j_m2, holder_out_j_m2) = pair(self.holder_in_j_m2, self.holder_out_j_m2);
        let (gas_in_kg_m2, gas_out_kg_m2) = pair(self.gas_in_kg_m2, self.gas_out_kg_m2);
        Self {
            hot_in_j_m2,
            hot_out_j_m2,
            back_in_j_m2,
            back_out_j_m2,
            holder_in_j_m2,
            holder_out_j_m2,
            gas_in_kg_m2,
            gas_out_kg_m2,
            ..self
        }
    }

    /// Energy residual: heat in minus heat out minus storage, relative to the larger of in and out.
    pub fn residual(&self) -> f64 {
        let came_in = self.hot_in_j_m2 + self.back_in_j_m2 + self.holder_in_j_m2;
        let went_out = self.hot_out_j_m2 + self.back_out_j_m2 + self.holder_out_j_m2;
        let moved = came_in.max(went_out);
        let moved = if moved > 0.0 { moved } else { self.stored_j_m2.abs() };
        let left = came_in - went_out - self.gas_heat_j_m2 + self.reaction_gain_j_m2 - self.stored_j_m2;
        left / moved.max(MIN_HEAT_J_M2)
    }

    /// Mass residual: solid lost plus gas in minus gas out minus gas stored, relative to the largest of the first
    /// three; zero where no mass moved.
    pub fn mass_residual(&self) -> f64 {
        let moved = self.solid_lost_kg_m2.max(self.gas_in_kg_m2).max(self.gas_out_kg_m2);
        let left = self.solid_lost_kg_m2 + self.gas_in_kg_m2 - self.gas_out_kg_m2 - self.gas_stored_kg_m2;
        if moved > 0.0 { left / moved } else { 0.0 }
    }
}

impl Traces {
    /// Traces without members.
    pub fn empty(first: usize, sensors: usize, instants: usize) -> Self {
        Self {
            first,
            sensors,
            instants,
            temperatures_k: Vec::new(),
            limited_k: Vec::new(),
            gauges: Vec::new(),
            peaks: Vec::new(),
            limited_peaks: Vec::new(),
            times_above_s: Vec::new(),
            gauge_peaks: Vec::new(),
            statuses: Vec::new(),
            balances: Vec::new(),
            extremes_k: Vec::new(),
        }
    }

    /// Append some members of `other`, indexed from its first.
    pub fn extend(&mut self, other: &Self, members: Range<usize>) {
        let (count, of) = (other.members(), &members);
        self.temperatures_k.extend_from_slice(member_slice(&other.temperatures_k, count, of));
        self.limited_k.extend_from_slice(member_slice(&other.limited_k, count, of));
        self.gauges.extend_from_slice(member_slice(&other.gauges, count, of));
        self.peaks.extend_from_slice(member_slice(&other.peaks, count, of));
        self.limited_peaks.extend_from_slice(member_slice(&other.limited_peaks, count, of));
        self.times_above_s.extend_from_slice(member_slice(&other.times_above_s, count, of));
        self.gauge_peaks.extend_from_slice(member_slice(&other.gauge_peaks, count, of));
        self.statuses.extend_from_slice(member_slice(&other.statuses, count, of));
        self.balances.extend_from_slice(member_slice(&other.balances, count, of));
        self.extremes_k.extend_from_slice(member_slice(&other.extremes_k, count, of));
    }

    /// Number of members.
    pub fn members(&self) -> usize {
        self.statuses.len()
    }

    /// Temperatures of one member at one sensor over the instants, K.
    pub fn trace(&self, member: usize, sensor: usize) -> &[f64] {
        let start = (member * self.sensors + sensor) * self.instants;
        &self.temperatures_k[start..start + self.instants]
    }

    /// The peak of one member at one sensor.
    pub fn peak(&self, member: usize, sensor: usize) -> Peak {
        self.peaks[member * self.sensors + sensor]
    }

    /// The peaks of one member, one per sensor.
    pub fn member_peaks(&self, member: usize) -> &[Peak] {
        &self.peaks[member * self.sensors..(member + 1) * self.sensors]
    }

    /// The peak of one member in the part of a limit.
    ///
    /// # Panics
    /// When there is no such limit.
    pub fn limited_peak(&self, member: usize, limit: usize) -> Peak {
        self.limited_peaks[member * self.limits() + limit]
    }

    /// The time for which one member is above a limit in its part, s.
    ///
    /// # Panics
    /// When there is no such limit.
    pub fn time_above_s(&self, member: usize, limit: usize) -> f64 {
        self.times_above_s[member * self.limits() + limit]
    }

    /// The extreme of one gauge of one member; `None` where gauges were not recorded.
    pub fn gauge_peak(&self, member: usize, gauge: Gauge) -> Option<GaugePeak> {
        self.gauge_peaks.get(member * Gauge::ALL.len() + gauge as usize).copied()
    }

    /// Number of temperature limits.
    pub(crate) fn limits(&self) -> usize {
        self.limited_peaks.len() / self.members().max(1)
    }

    /// Hottest temperatures of one member in the part of a limit over the instants, K.
    ///
    /// # Panics
    /// When there is no such limit.
    pub fn limited(&self, member: usize, limit: usize) -> &[f64] {
        let of_member = self.limited_k.len() / self.members();
        let start = member * of_member + limit * self.instants;
        &self.limited_k[start..start + self.instants]
    }

    /// Values of one gauge of one member over the instants; `None` where gauges were not recorded.
    pub fn gauge(&self, member: usize, gauge: Gauge) -> Option<&[f64]> {
        let start = (member * Gauge::ALL.len() + gauge as usize) * self.instants;
        self.gauges.get(start..start + self.instants)
    }

    /// Temperatures of one member: sensor × instant, K.
    pub fn member(&self, member: usize) -> &[f64] {
        let size = self.sensors * self.instants;
        &self.temperatures_k[member * size..(member + 1) * size]
    }
}

/// The values of some of `count` members, stored member by member with equally many values each.
fn member_slice<'a, T>(values: &'a [T], count: usize, members: &Range<usize>) -> &'a [T] {
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
        let traces = Traces { gauges, statuses: vec![MemberStatus::Completed; 2], ..Traces::empty(0, 0, 3) };
        for (index, gauge) in Gauge::ALL.into_iter().enumerate() {
            let first = (3 * (Gauge::ALL.len() + index)) as f64;
            assert_eq!(traces.gauge(1, gauge), Some([first, first + 1.0, first + 2.0].as_slice()));
        }
        assert_eq!(Traces { gauges: Vec::new(), ..traces }.gauge(0, Gauge::GasFlux), None);
    }
}
