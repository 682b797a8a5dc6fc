//! Whether walkers have been everywhere often enough: autocorrelation, and how far walkers differ.

/// What the trail of one variable says of a walk.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Mixing {
    /// Integrated autocorrelation time: so many moves of a walker are worth one draw.
    pub autocorrelation_moves: f64,
    /// Draws of the walkers together that are worth as much as independent ones.
    pub effective_draws: f64,
    /// The ratio of all values' deviation to those within halves of walkers' trails.
    pub r_hat: f64,
}

/// Moves that the window of an autocorrelation spans, in autocorrelation times: further out chance outweighs what is left
/// (Sokal, *Monte Carlo Methods in Statistical Mechanics*, 1996).
const WINDOW: f64 = 5.0;

impl Mixing {
    /// R-hat above which walkers have not been everywhere. A trail that is n moves long and known to have come to rest has
    /// a mean that is off by √(τ/n) deviations, and so an R-hat of √(1 + τ/n): 1.1 of its halves says that each is five
    /// autocorrelation times long. The 1.01 asked of a few long chains (Vehtari et al., Bayesian Anal. 16, 2021) would have
    /// each of thousands of walkers alone draw what they are there to draw together.
    pub const R_HAT: f64 = 1.1;

    /// Of a trail, move × walker.
    ///
    /// # Panics
    /// When the trail is not a whole number of moves.
    pub fn of(trail: &[f64], walkers: usize) -> Self {
        assert!(walkers > 0 && trail.len().is_multiple_of(walkers), "a trail of moves of {walkers} walkers");
        let autocorrelation_moves = autocorrelation_moves(trail, walkers);
        Self {
            autocorrelation_moves,
            effective_draws: trail.len() as f64 / autocorrelation_moves,
            r_hat: split_r_hat(trail, walkers),
        }
    }
}

/// `τ = 1 + 2 Σ ρₘ`, where ρₘ is the correlation of all walkers' values with those of m moves later, about the mean of all:
/// walkers that do not meet never forget where they are. The sum ends at the first m that is five times what it has come to,
/// or with the trail. Infinite where nothing moved.
fn autocorrelation_moves(trail: &[f64], walkers: usize) -> f64 {
    let moves = trail.len() / walkers;
    let mean = trail.iter().sum::<f64>() / trail.len() as f64;
    let off: Vec<f64> = trail.iter().map(|value| value - mean).collect();
    let covariance = |lag: usize| {
        let pairs = off.len() - lag * walkers;
        let later = &off[lag * walkers..];
        off[..pairs].iter().zip(later).map(|(a, b)| a * b).sum::<f64>() / pairs as f64
    };
    let variance = covariance(0);
    if moves == 0 || variance <= 0.0 {
        return f64::INFINITY;
    }
    let mut time = 1.0;
    for lag in 1..moves {
        time += 2.0 * covariance(lag) / variance;
        if lag as f64 >= WINDOW * time {
            break;
        }
    }
    time.max(1.0)
}

/// Gelman and Rubin's ratio (Stat. Sci. 7, 1992) of the two halves of each walker's trail: a walker that stays apart makes
/// it rise, and so does one that is still on its way. Infinite where nothing moved or there is nothing to halve.
fn split_r_hat(trail: &[f64], walkers: usize) -> f64 {
    let length = trail.len() / walkers / 2;
    if length < 2 {
        return f64::INFINITY;
    }
    let n = length as f64;
    // The last two of each, as an odd move out is the oldest.
    let kept = &trail[trail.len() - 2 * length * walkers..];
    let (mut means, mut within) = (Vec::with_capacity(2 * walkers), 0.0);
    for half in kept.chunks(length * walkers) {
        for walker in 0..walkers {
            let values = half[walker..].iter().step_by(walkers);
            let mean = values.clone().sum::<f64>() / n;
            within += values.map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
            means.push(mean);
        }
    }
    let chains = means.len() as f64;
    let mean = means.iter().sum::<f64>() / chains;
    let between = means.iter().map(|other| (other - mean).powi(2)).sum::<f64>() / (chains - 1.0);
    let within = within / chains;
    if within > 0.0 { ((n - 1.0) / n + between / within).sqrt() } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::Numbers;

    const WALKERS: usize = 200;

    /// Autoregressions side by side, of variance one, about a centre each.
    fn trail(moves: usize, autocorrelation: f64, centre: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let mut numbers = Numbers::of(1, 0);
        let mut now: Vec<f64> = (0..WALKERS).map(|_| numbers.normal()).collect();
        let mut trail = Vec::new();
        for turn in 0..moves {
            for (walker, value) in now.iter_mut().enumerate() {
                *value = autocorrelation * *value + (1.0 - autocorrelation.powi(2)).sqrt() * numbers.normal();
                trail.push(*value + centre(turn, walker));
            }
        }
        trail
    }

    /// τ = (1 + φ)/(1 − φ) of a first-order autoregression: 1, 3, 19.
    #[test]
    fn the_autocorrelation_time_of_an_autoregression_is_the_known_one() {
        for (autocorrelation, exact) in [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0)] {
            let found = Mixing::of(&trail(500, autocorrelation, |_, _| 0.0), WALKERS);
            assert!((found.autocorrelation_moves / exact - 1.0).abs() < 0.05, "{exact}: {found:?}");
            assert!((found.effective_draws * found.autocorrelation_moves / 1e5 - 1.0).abs() < 1e-12);
            // Each half's mean is off by τ/250 of the variance.
            assert!((found.r_hat - (1.0 + exact / 250.0).sqrt()).abs() < 0.01, "{exact}: {found:?}");
        }
    }

    #[test]
    fn walkers_that_stay_apart_and_walkers_on_their_way_are_told() {
        let apart = Mixing::of(&trail(500, 0.5, |_, walker| if walker < 20 { 6.0 } else { 0.0 }), WALKERS);
        assert!(apart.r_hat > 1.5 && apart.autocorrelation_moves > 100.0, "{apart:?}");
        let coming = Mixing::of(&trail(500, 0.5, |turn, _| 0.01 * turn as f64), WALKERS);
        assert!(coming.r_hat > 1.2, "{coming:?}");
        let still = Mixing::of(&vec![1.0; 40 * WALKERS], WALKERS);
        assert_eq!((still.r_hat, still.effective_draws), (f64::INFINITY, 0.0));
    }
}
