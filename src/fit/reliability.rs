//! Structural reliability: the probability that a limit state is exceeded, by sampling about its design points.
//!
//! The variables are independent and standard normal. A limit state is a function `g` of them; `g < 0` means that the
//! limit is exceeded. A design point is a point with `g = 0` that is nearer to the origin than its neighbours: the most
//! probable combination that exceeds the limit, and others of nearly the same probability ([`find_design_points`]).
//! Samples about it exceed the limit in about half of all draws ([`ImportanceSampling`]). What lies away from the
//! design points is counted by members that are drawn plainly, so that a combination that no search found is part of
//! the interval.
//!
//! Sources: Melchers & Beck, *Structural Reliability Analysis and Prediction* (2018), chapters 3 and 4.

mod design_point;
mod importance_sampling;

pub use design_point::{DesignPoint, DesignPoints, find_design_points};
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

    /// The value and its derivatives by the variables at each point.
    ///
    /// # Errors
    /// As [`values`](Self::values).
    fn gradients(&mut self, points: &[Vec<f64>]) -> Result<Vec<(f64, Vec<f64>)>, Self::Error>;
}

#[cfg(test)]
mod test_states {
    use super::LimitState;
    use std::convert::Infallible;

    /// The least of `distance − normal·u` over some planes, with unit normals: where two meet it has a kink.
    pub(super) struct Planes {
        pub normals: Vec<Vec<f64>>,
        pub distances: Vec<f64>,
    }

    impl Planes {
        /// A plane at a distance from the origin, in five variables.
        pub(super) fn one(distance: f64) -> Self {
            let normal = [1.0_f64, -2.0, 0.5, 0.0, 3.0];
            let length = normal.iter().map(|by| by * by).sum::<f64>().sqrt();
            Self { normals: vec![normal.iter().map(|by| by / length).collect()], distances: vec![distance] }
        }

        /// Planes at right angles, each along one of four variables.
        pub(super) fn some(distances: &[f64]) -> Self {
            let axis = |place: usize| (0..4).map(|variable| f64::from(u8::from(variable == place))).collect();
            Self { normals: (0..distances.len()).map(axis).collect(), distances: distances.to_vec() }
        }

        fn least(&self, point: &[f64]) -> (f64, usize) {
            let along = |normal: &Vec<f64>| normal.iter().zip(point).map(|(by, u)| by * u).sum::<f64>();
            let each = self.normals.iter().zip(&self.distances).map(|(normal, distance)| distance - along(normal));
            let places = each.enumerate().map(|(place, value)| (value, place));
            places.min_by(|one, other| one.0.total_cmp(&other.0)).expect("a plane at least")
        }
    }

    impl LimitState for Planes {
        type Error = Infallible;

        fn variables(&self) -> usize {
            self.normals[0].len()
        }

        fn values(&mut self, points: &[Vec<f64>]) -> Result<Vec<f64>, Infallible> {
            Ok(points.iter().map(|point| self.least(point).0).collect())
        }

        fn gradients(&mut self, points: &[Vec<f64>]) -> Result<Vec<(f64, Vec<f64>)>, Infallible> {
            let gradient = |point: &Vec<f64>| {
                let (value, place) = self.least(point);
                (value, self.normals[place].iter().map(|by| -by).collect())
            };
            Ok(points.iter().map(gradient).collect())
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

        fn gradients(&mut self, points: &[Vec<f64>]) -> Result<Vec<(f64, Vec<f64>)>, Infallible> {
            let values = self.values(points)?;
            Ok(points.iter().zip(values).map(|(point, value)| (value, vec![0.5 * point[0], -1.0])).collect())
        }
    }
}
