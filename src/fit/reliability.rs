//! Structural reliability: the probability that a limit state is exceeded, by sampling about its design point.
//!
//! The variables are independent and standard normal. A limit state is a function `g` of them; `g < 0` means that the
//! limit is exceeded. The design point is the point nearest to the origin with `g = 0`, the most probable combination
//! that exceeds the limit ([`find_design_point`]). Samples about it exceed the limit in about half of all draws, so
//! that a probability of one in a million takes as many members as one of one in a hundred ([`ImportanceSampling`]).
//!
//! Sources: Melchers & Beck, *Structural Reliability Analysis and Prediction* (2018), chapters 3 and 4.

mod design_point;
mod importance_sampling;

pub use design_point::{DesignPoint, find_design_point};
pub use importance_sampling::{ImportanceEstimate, ImportanceSampling, PLAIN_SHARE, WeightedMember};

/// A limit state in independent standard normal variables.
pub trait LimitState {
    /// The error of an evaluation.
    type Error;

    /// Number of variables.
    fn variables(&self) -> usize;

    /// The value `g` at each point; negative where the limit is exceeded, also for a point that cannot be computed.
    ///
    /// # Errors
    /// When the evaluation fails as a whole.
    fn values(&mut self, points: &[Vec<f64>]) -> Result<Vec<f64>, Self::Error>;

    /// The value and its derivatives by the variables at a point.
    ///
    /// # Errors
    /// As [`values`](Self::values).
    fn gradient(&mut self, point: &[f64]) -> Result<(f64, Vec<f64>), Self::Error>;
}

#[cfg(test)]
mod test_states {
    use super::LimitState;
    use std::convert::Infallible;

    /// `distance − normal·u`, with a unit normal.
    pub(super) struct Plane {
        pub normal: Vec<f64>,
        pub distance: f64,
    }

    impl Plane {
        /// A plane at a distance from the origin, in five variables.
        pub(super) fn at(distance: f64) -> Self {
            let normal = [1.0_f64, -2.0, 0.5, 0.0, 3.0];
            let length = normal.iter().map(|by| by * by).sum::<f64>().sqrt();
            Self { normal: normal.iter().map(|by| by / length).collect(), distance }
        }
    }

    impl LimitState for Plane {
        type Error = Infallible;

        fn variables(&self) -> usize {
            self.normal.len()
        }

        fn values(&mut self, points: &[Vec<f64>]) -> Result<Vec<f64>, Infallible> {
            let along = |point: &Vec<f64>| point.iter().zip(&self.normal).map(|(u, by)| u * by).sum::<f64>();
            Ok(points.iter().map(|point| self.distance - along(point)).collect())
        }

        fn gradient(&mut self, point: &[f64]) -> Result<(f64, Vec<f64>), Infallible> {
            let value = self.values(&[point.to_vec()])?[0];
            Ok((value, self.normal.iter().map(|by| -by).collect()))
        }
    }

    /// `3 + u₁²/4 − u₂`.
    pub(super) struct Curved;

    impl LimitState for Curved {
        type Error = Infallible;

        fn variables(&self) -> usize {
            2
        }

        fn values(&mut self, points: &[Vec<f64>]) -> Result<Vec<f64>, Infallible> {
            Ok(points.iter().map(|point| 3.0 + 0.25 * point[0] * point[0] - point[1]).collect())
        }

        fn gradient(&mut self, point: &[f64]) -> Result<(f64, Vec<f64>), Infallible> {
            Ok((self.values(&[point.to_vec()])?[0], vec![0.5 * point[0], -1.0]))
        }
    }
}
