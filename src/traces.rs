//! What a march returns.

/// Temperatures of a run of members at every sensor and instant, and how each member arrived.
#[derive(Clone, Debug)]
pub struct Traces {
    /// Index in the ensemble of the first member here.
    pub first: usize,
    pub sensors: usize,
    pub instants: usize,
    /// Member × sensor × instant, K.
    pub temperatures_k: Vec<f64>,
    pub arrivals: Vec<Arrival>,
    pub balances: Vec<Balance>,
    /// Member × ply: coldest and hottest temperature met, K.
    pub extremes_k: Vec<(f64, f64)>,
}

/// How a member's march ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Arrival {
    Done,
    /// A temperature left the range in which anything is known, or was no number.
    Strayed {
        time_s: f64,
    },
    /// A table that refuses to be left was left.
    LeftTable {
        ply: usize,
        temperature_k: f64,
    },
}

/// Heat through the two faces and from and to the holder over the whole march, and heat stored, J/m², all positive but `stored`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Balance {
    pub hot_in_j_m2: f64,
    pub hot_out_j_m2: f64,
    pub back_in_j_m2: f64,
    pub back_out_j_m2: f64,
    pub holder_in_j_m2: f64,
    pub holder_out_j_m2: f64,
    pub stored_j_m2: f64,
}

impl Balance {
    /// From the sums that a member keeps: in and out through the hot face and the back face, from and to the holder.
    pub fn new(sums_j_m2: [f64; 6], stored_j_m2: f64) -> Self {
        let [hot_in_j_m2, hot_out_j_m2, back_in_j_m2, back_out_j_m2, holder_in_j_m2, holder_out_j_m2] = sums_j_m2;
        Self { hot_in_j_m2, hot_out_j_m2, back_in_j_m2, back_out_j_m2, holder_in_j_m2, holder_out_j_m2, stored_j_m2 }
    }

    /// In less out less stored, relative to what came in.
    pub fn residual(&self) -> f64 {
        let came_in = self.hot_in_j_m2 + self.back_in_j_m2 + self.holder_in_j_m2;
        let went_out = self.hot_out_j_m2 + self.back_out_j_m2 + self.holder_out_j_m2;
        let moved = came_in.max(went_out).max(self.stored_j_m2.abs());
        if moved > 0.0 { (came_in - went_out - self.stored_j_m2) / moved } else { 0.0 }
    }
}

impl Traces {
    pub fn members(&self) -> usize {
        self.arrivals.len()
    }

    /// One member's temperatures at one sensor over the instants, K.
    pub fn trace(&self, member: usize, sensor: usize) -> &[f64] {
        let start = (member * self.sensors + sensor) * self.instants;
        &self.temperatures_k[start..start + self.instants]
    }

    /// One member's temperatures: sensor × instant, K.
    pub fn member(&self, member: usize) -> &[f64] {
        let size = self.sensors * self.instants;
        &self.temperatures_k[member * size..(member + 1) * size]
    }
}
