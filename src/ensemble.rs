//! Which variations of a case to march.

/// Members × factors, made row by row when asked for, so that a million members need no memory.
#[derive(Clone, Debug)]
pub struct Ensemble {
    factors: usize,
    members: usize,
    values: Vec<f64>,
}

impl Ensemble {
    /// Exactly these rows of factor values, row after row.
    pub fn at(factors: usize, values: Vec<f64>) -> Self {
        let members = if factors == 0 { 1 } else { values.len() / factors };
        Self { factors, members, values }
    }

    pub fn len(&self) -> usize {
        self.members
    }

    pub fn is_empty(&self) -> bool {
        self.members == 0
    }

    /// The factor values of one member.
    pub fn member(&self, member: usize) -> Vec<f64> {
        self.values[member * self.factors..(member + 1) * self.factors].to_vec()
    }
}
