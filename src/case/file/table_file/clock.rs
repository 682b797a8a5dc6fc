//! Clock times in text: a date with a time of day, or a time of day alone.

const MICROSECONDS_PER_SECOND: i64 = 1_000_000;
const MICROSECONDS_PER_DAY: i64 = 86_400 * MICROSECONDS_PER_SECOND;

/// A clock time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ClockTime {
    /// Since 1970-01-01 with a date, since midnight without one; µs.
    microseconds: i64,
    has_date: bool,
}

/// The cells of a column so far.
#[derive(Debug, Default)]
pub(super) enum ColumnKind {
    /// No value yet.
    #[default]
    Unknown,
    Numbers,
    Times(Clock),
}

/// Clock times of a column.
#[derive(Debug)]
pub(super) struct Clock {
    /// The first one, as written.
    first: String,
    origin: ClockTime,
    /// The last one with the days since the first, µs.
    last: i64,
    /// Midnights that times of day have passed.
    midnights: i64,
}

impl ColumnKind {
    /// The number of a cell in this column: seconds since the first clock time. `number` is that of the cell, NaN if it
    /// has none and `not_finite` if it is text.
    pub(super) fn number(&mut self, cell: &str, number: f64, not_finite: f64) -> f64 {
        if number.is_nan() {
            return number;
        }
        match (&mut *self, number.is_finite()) {
            (Self::Numbers, _) => number,
            (Self::Unknown, true) => {
                *self = Self::Numbers;
                number
            }
            (Self::Times(_), true) => not_finite,
            (Self::Unknown, false) => match ClockTime::parse(cell) {
                Some(origin) => {
                    let first = cell.trim().to_owned();
                    *self = Self::Times(Clock { first, origin, last: origin.microseconds, midnights: 0 });
                    0.0
                }
                None => number,
            },
            (Self::Times(clock), false) => {
                ClockTime::parse(cell).and_then(|time| clock.seconds(time)).unwrap_or(not_finite)
            }
        }
    }

    /// Origin from which the seconds of the column count, if it holds clock times.
    pub(super) fn clock(&self) -> Option<String> {
        match self {
            Self::Times(clock) => Some(format!("dates or times of day, as seconds since the first, {}", clock.first)),
            _ => None,
        }
    }
}

impl Clock {
    /// Seconds since the first time; `None` if one of both has a date. A time of day that is more than half a day
    /// before the one above it is of the next day.
    fn seconds(&mut self, time: ClockTime) -> Option<f64> {
        if time.has_date != self.origin.has_date {
            return None;
        }
        let mut now = time.microseconds + self.midnights * MICROSECONDS_PER_DAY;
        if !time.has_date && 2 * (self.last - now) > MICROSECONDS_PER_DAY {
            self.midnights += 1;
            now += MICROSECONDS_PER_DAY;
        }
        self.last = now;
        Some((now - self.origin.microseconds) as f64 / MICROSECONDS_PER_SECOND as f64)
    }
}

impl ClockTime {
    /// `2025-03-30 01:59:30.5`, with `T` or `/` too, or `01:59:30.5`. Orders of day and month that differ between
    /// countries are no clock times, nor are two numbers, which may be hours or minutes first.
    fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        let Some((date, time)) = text.split_once(['T', ' ']) else {
            let (microseconds, has_seconds) = time_of_day(text)?;
            return has_seconds.then_some(Self { microseconds, has_date: false });
        };
        let mut parts = date.split(['-', '/']);
        let (year, month, day) = (parts.next()?, parts.next()?, parts.next()?);
        if year.len() != 4 || parts.next().is_some() {
            return None;
        }
        let (year, month, day) = (digits(year)?, digits(month)?, digits(day)?);
        let days = days_since_1970(year, month, day)?;
        let (microseconds, _) = time_of_day(time.trim().trim_end_matches('Z'))?;
        Some(Self { microseconds: days * MICROSECONDS_PER_DAY + microseconds, has_date: true })
    }
}

/// The time since midnight of `01:59:30.5` or `01:59`, µs, and whether there are seconds.
fn time_of_day(text: &str) -> Option<(i64, bool)> {
    let mut parts = text.split(':');
    let (hour, minute) = (digits(parts.next()?)?, digits(parts.next()?)?);
    let (second, fraction) = match parts.next() {
        None => (None, ""),
        Some(second) => {
            let (whole, fraction) = second.split_once(['.', ',']).unwrap_or((second, ""));
            (Some(digits(whole)?), fraction)
        }
    };
    let is_fraction = fraction.bytes().all(|byte| byte.is_ascii_digit());
    if parts.next().is_some() || hour > 23 || minute > 59 || second.is_some_and(|second| second > 59) || !is_fraction {
        return None;
    }
    let microseconds: i64 = format!("{fraction:0<6}")[..6].parse().ok()?;
    let seconds = 3600 * hour + 60 * minute + second.unwrap_or(0);
    Some((seconds * MICROSECONDS_PER_SECOND + microseconds, second.is_some()))
}

/// A number of at most four digits and nothing else.
fn digits(text: &str) -> Option<i64> {
    let is_plain = (1..=4).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
    is_plain.then(|| text.parse().ok())?
}

/// Days since 1970-01-01, by Hinnant's algorithm for the Gregorian calendar; `None` for a date that there is not.
fn days_since_1970(year: i64, month: i64, day: i64) -> Option<i64> {
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let length = match month {
        1 | 3 | 5 | 7 | 8 | 10 | 12 => 31,
        4 | 6 | 9 | 11 => 30,
        2 if is_leap => 29,
        2 => 28,
        _ => return None,
    };
    if !(1..=length).contains(&day) {
        return None;
    }
    // Years begin in March, so that the leap day is the last.
    let year = if month <= 2 { year - 1 } else { year };
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    Some(365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400) + day_of_year - 719_468)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers of a column of cells.
    fn seconds(cells: &[&str]) -> Vec<f64> {
        let mut kind = ColumnKind::default();
        cells.iter().map(|cell| kind.number(cell, f64::INFINITY, f64::INFINITY)).collect()
    }

    #[test]
    fn clock_times_are_seconds_since_the_first_also_past_midnight_and_at_leap_days() {
        assert_eq!(seconds(&["2025-03-30 01:59:30", "2025-03-30 02:00:00.25"]), [0.0, 30.25]);
        assert_eq!(seconds(&["2025/03/30T01:59", "2025-03-31T01:59:00Z"]), [0.0, 86_400.0]);
        assert_eq!(seconds(&["2024-02-28 23:59:59", "2024-03-01 00:00:00"]), [0.0, 86_401.0]);
        assert_eq!(seconds(&["1969-12-31 23:59:59", "1970-01-01 00:00:00,5"]), [0.0, 1.5]);
        assert_eq!(
            seconds(&["23:59:40", "23:59:50", "0:00:00", "12:00:01", "00:00:00"])[2..],
            [20.0, 43_221.0, 86_420.0]
        );
        assert_eq!(seconds(&["08:00:10", "08:00:00"]), [0.0, -10.0]);
        assert_eq!(days_since_1970(2000, 3, 1), Some(11_017));
    }

    #[test]
    fn text_whose_order_is_not_certain_and_dates_that_there_are_not_are_no_clock_times() {
        for text in [
            "30.03.2025 01:59:30",
            "3/30/2025 1:59:30",
            "01:59",
            "24:00:00",
            "12:60:00",
            "2025-02-29 00:00:00",
            "2025-13-01 00:00:00",
            "2025-03-30",
            "1:59:30 PM",
            "2025-03-30 01:59:30+01:00",
            "12:00:00.x",
            "a:b:c",
        ] {
            assert_eq!(ClockTime::parse(text), None, "{text}");
        }
        assert_eq!(seconds(&["08:00:00", "2025-03-30 08:00:00"])[1], f64::INFINITY);
    }
}
