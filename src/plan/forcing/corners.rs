//! Corners of a schedule on which steps end, by their effect on the temperature of a surface.

use crate::case::Schedule;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Smallest rank of a corner on which adapted steps end.
///
/// Integrals stay exact at a corner inside a step, so the threshold sets the work of a plan and hardly its accuracy. Of
/// 20,000 rows with 1 % noise less than sixty corners are above it.
const MAJOR_CORNER_RANK: f64 = 1e-2;
/// Steps end on every corner of a schedule with at most so many.
const FEW_CORNERS: usize = 32;
/// Corners of this share of the largest rank are major, however small that is: pulses that are short against the run.
const LARGE_SHARE: f64 = 0.1;
/// In a schedule of more corners than these, only corners of [`LARGE_HEIGHT`] are major: others may be noise.
const SOME_CORNERS: usize = 256;
/// Height of a corner that is no noise, relative to the largest magnitude of the schedule.
const LARGE_HEIGHT: f64 = 0.1;
/// Most corners of a schedule on which steps end, those of the highest rank: 500 square pulses. A record of noise that
/// is as large as its signal has more of that height, and keeps only those above [`MAJOR_CORNER_RANK`].
const MOST_CORNERS: usize = 2048;
/// A corner of a smaller rank is rounding.
const ROUNDING_RANK: f64 = 1e-12;

/// The times of the corners inside the run on which steps end, s.
///
/// Repeatedly drops the corner that has the least rank with its neighbours (after Visvalingam & Whyatt, The
/// Cartographic Journal 30, 1993, who rank by area). The rank is that of a surface temperature: a triangle of flux of
/// height h and base w heats a surface by `h √w`, up to a factor; here relative to the largest magnitude and the square
/// root of the duration. A pulse of 0.01 % of the run has rank 0.01; noise of 1 % that a row every 0.01 % samples has
/// 0.0001.
pub(super) fn major_corners(schedule: &Schedule, duration_s: f64) -> Vec<f64> {
    let inside = |time_s: f64| 0.0 < time_s && time_s < duration_s;
    let rows = schedule.times_s.iter().zip(&schedule.values).filter(|(time_s, _)| inside(**time_s));
    let mut points = vec![(0.0, schedule.after(0.0))];
    points.extend(rows.map(|(&time_s, &value)| (time_s, value)));
    points.push((duration_s, schedule.before(duration_s)));
    let last = points.len() - 1;
    let largest = points.iter().fold(0.0, |most: f64, point| most.max(point.1.abs()));
    let scale = duration_s.sqrt() * largest;
    let doubled_area = |before: usize, point: usize, after: usize| {
        let [(x0, y0), (x1, y1), (x2, y2)] = [before, point, after].map(|index| points[index]);
        ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)).abs()
    };
    let width_s = |before: usize, after: usize| points[after].0 - points[before].0;
    let rank = |before: usize, point: usize, after: usize| {
        let rank = doubled_area(before, point, after) / (width_s(before, after).sqrt() * scale);
        if rank > ROUNDING_RANK { rank } else { 0.0 }
    };
    let mut before: Vec<usize> = (0..=last).map(|point| point.saturating_sub(1)).collect();
    let mut after: Vec<usize> = (0..=last).map(|point| (point + 1).min(last)).collect();
    let mut ranks: Vec<f64> = (0..=last).map(|point| rank(before[point], point, after[point])).collect();
    // Ranks are non-negative, so their bit patterns sort as they do.
    let mut smallest: BinaryHeap<Reverse<(u64, usize)>> =
        (1..last).map(|point| Reverse((ranks[point].to_bits(), point))).collect();
    let mut is_dropped = vec![false; last + 1];
    let mut heights = vec![0.0; last + 1];
    let mut so_far = 0.0_f64;
    while let Some(Reverse((bits, point))) = smallest.pop() {
        if is_dropped[point] || bits != ranks[point].to_bits() {
            continue;
        }
        is_dropped[point] = true;
        // A corner that is dropped later ranks no lower.
        so_far = so_far.max(ranks[point]);
        ranks[point] = so_far;
        let (left, right) = (before[point], after[point]);
        heights[point] = doubled_area(left, point, right) / (width_s(left, right) * largest);
        (after[left], before[right]) = (right, left);
        for neighbour in [left, right].into_iter().filter(|&neighbour| 0 < neighbour && neighbour < last) {
            ranks[neighbour] = rank(before[neighbour], neighbour, after[neighbour]);
            smallest.push(Reverse((ranks[neighbour].to_bits(), neighbour)));
        }
    }
    let mut corners: Vec<usize> = (1..last).filter(|&point| ranks[point] > 0.0).collect();
    if corners.len() > FEW_CORNERS {
        let least = LARGE_SHARE * corners.iter().fold(0.0, |most: f64, &point| most.max(ranks[point]));
        let is_short = corners.len() <= SOME_CORNERS;
        let is_large = |point: usize| ranks[point] >= least && (is_short || heights[point] >= LARGE_HEIGHT);
        let keeps_large = corners.iter().filter(|&&point| is_large(point)).count() <= MOST_CORNERS;
        corners.retain(|&point| ranks[point] >= MAJOR_CORNER_RANK || (keeps_large && is_large(point)));
        corners.sort_by(|&one, &other| ranks[other].total_cmp(&ranks[one]));
        corners.truncate(MOST_CORNERS);
        corners.sort_unstable();
    }
    corners.into_iter().map(|point| points[point].0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::RandomStream;

    /// Square pulses sampled at 100 Hz, with noise relative to the first.
    fn noisy(rows: usize, noise: f64, value: impl Fn(f64) -> f64) -> Schedule {
        let mut numbers = RandomStream::new(1, 27);
        let times_s: Vec<f64> = (0..rows).map(|row| 0.01 * row as f64).collect();
        let values = times_s.iter().map(|&time_s| value(time_s) + noise * numbers.normal()).collect();
        Schedule { times_s, values }
    }

    #[test]
    fn ramps_and_jumps_are_major_corners_and_noise_is_not() {
        let bare = Schedule { times_s: vec![0.0, 0.5, 41.0, 41.2], values: vec![0.0, 26.7, 26.7, 0.0] };
        assert_eq!(major_corners(&bare, 200.0), [0.5, 41.0, 41.2]);
        let jump = Schedule { times_s: vec![0.0, 41.0, 41.0], values: vec![26.7, 26.7, 0.0] };
        assert_eq!(major_corners(&jump, 200.0), [41.0, 41.0]);
        let pulse = noisy(20_001, 2e3, |time_s| if (40.0..100.0).contains(&time_s) { 2e5 } else { 0.0 });
        let found_s = major_corners(&pulse, 200.0);
        assert!(found_s.len() < 60, "{} of 20,001 rows are major corners", found_s.len());
        for edge_s in [40.0, 100.0] {
            let nearest_s = found_s.iter().map(|found_s| (found_s - edge_s).abs()).fold(f64::INFINITY, f64::min);
            assert!(nearest_s < 0.015, "the edge at {edge_s} s is {nearest_s} s from the nearest corner");
        }
        assert!(major_corners(&Schedule::constant(5.0), 200.0).is_empty());
        assert!(major_corners(&Schedule { times_s: vec![0.0, 10.0, 20.0], values: vec![1.0; 3] }, 200.0).is_empty());
    }

    #[test]
    fn a_pulse_of_a_millisecond_in_two_days_keeps_its_corners() {
        let (start_s, end_s) = (100_000.0, 100_000.001);
        let times_s = vec![0.0, start_s, start_s, end_s, end_s, 172_800.0];
        let pulse = Schedule { times_s, values: vec![0.0, 0.0, 1e6, 1e6, 0.0, 0.0] };
        assert_eq!(major_corners(&pulse, 172_800.0), [start_s, start_s, end_s, end_s]);
    }

    #[test]
    fn a_short_pulse_ranks_above_the_noise_of_a_long_record() {
        let is_pulse = |time_s: f64| (150.0..150.5).contains(&time_s);
        let record = noisy(20_001, 2e3, |time_s| if is_pulse(time_s) { 2e5 } else { 0.0 });
        let found_s = major_corners(&record, 200.0);
        let close = |time_s: &f64| (time_s - 150.0).abs() < 0.015 || (time_s - 150.5).abs() < 0.015;
        assert!(found_s.iter().filter(|time_s| close(time_s)).count() >= 3 && found_s.len() < 60, "{found_s:?}");
    }

    #[test]
    fn every_one_of_twenty_pulses_keeps_its_corners_and_noise_about_a_constant_few() {
        let starts_s: Vec<f64> = (0..20).map(|n| 137.3 + 491.7 * f64::from(n)).collect();
        let times_s: Vec<f64> = starts_s.iter().flat_map(|&at_s| [at_s, at_s, at_s + 0.1, at_s + 0.1]).collect();
        let pulses = Schedule { values: [0.0, 5e4, 5e4, 0.0].repeat(20), times_s };
        assert_eq!(major_corners(&pulses, 10_000.0), pulses.times_s);
        let of_noise_s = major_corners(&noisy(20_001, 2e3, |_| 2e5), 200.0);
        assert!(of_noise_s.len() < 60, "{} of 20,001 rows are major corners", of_noise_s.len());
    }

    #[test]
    fn every_one_of_300_pulses_in_a_day_keeps_its_corners_and_noise_of_a_thousand_rows_none() {
        let starts_s: Vec<f64> = (0..300).map(|n| 137.3 + 287.1 * f64::from(n)).collect();
        let times_s: Vec<f64> = starts_s.iter().flat_map(|&at_s| [at_s, at_s, at_s + 0.2, at_s + 0.2]).collect();
        let pulses = Schedule { values: [0.0, 5e4, 5e4, 0.0].repeat(300), times_s };
        let mut found_s = major_corners(&pulses, 86_400.0);
        found_s.dedup();
        let are_ends = found_s.chunks(2).zip(&starts_s).all(|(pair, &start_s)| pair == [start_s, start_s + 0.2]);
        assert!(found_s.len() == 600 && are_ends, "{} corners", found_s.len());
        let of_noise_s = major_corners(&noisy(1000, 2e3, |_| 2e5), 10.0);
        assert!(of_noise_s.len() < 60, "{} of 1,000 rows are major corners", of_noise_s.len());
    }

    #[test]
    fn of_many_pulses_the_corners_of_the_highest_are_kept() {
        let times_s: Vec<f64> = (0..4000).map(|n| 0.05 * f64::from(n)).collect();
        let values = (0..4000).map(|n| if n % 2 == 0 { 0.0 } else { 1.0 + f64::from(n) / 4000.0 }).collect();
        let found_s = major_corners(&Schedule { times_s, values }, 200.0);
        assert_eq!(found_s.len(), MOST_CORNERS);
        assert!(found_s.windows(2).all(|pair| pair[0] < pair[1]) && found_s[0] > 90.0, "{found_s:?}");
    }
}
