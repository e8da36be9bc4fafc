//! The calendar's time, for what outlives a process: when it began, when it was last alive. It may jump (a robot without a
//! battery learns it from the network), so nothing waits for it and nothing is decided by it.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

const DAY: u64 = 86_400;

/// A moment of the calendar: seconds since the beginning of 1970, UTC.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Wall(pub f64);

impl Wall {
    /// Now.
    pub fn now() -> Self {
        SystemTime::now().into()
    }

    /// How long ago it was, for people: `3 min ago`.
    pub fn ago(self) -> String {
        let seconds = Self::now().0 - self.0;
        match seconds {
            s if s < 0.0 => "in the future, by this machine's clock".to_owned(),
            s if s < 120.0 => format!("{s:.0} s ago"),
            s if s < 7200.0 => format!("{:.0} min ago", s / 60.0),
            s if s < 172_800.0 => format!("{:.0} h ago", s / 3600.0),
            s => format!("{:.0} days ago", s / 86_400.0),
        }
    }
}

impl From<SystemTime> for Wall {
    fn from(time: SystemTime) -> Self {
        Self(time.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64())
    }
}

impl From<Wall> for SystemTime {
    fn from(wall: Wall) -> Self {
        UNIX_EPOCH + Duration::try_from_secs_f64(wall.0).unwrap_or_default()
    }
}

/// As RFC 3339 has it, in UTC: `2012-10-08T14:03:05Z`.
impl fmt::Display for Wall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let whole = Duration::try_from_secs_f64(self.0).unwrap_or_default().as_secs();
        let (year, month, day) = date(whole / DAY);
        let (hour, minute, second) = (whole % DAY / 3600, whole % 3600 / 60, whole % 60);
        write!(f, "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
    }
}

/// Year, month and day of so many days after the beginning of 1970.
fn date(days: u64) -> (u64, u64, u64) {
    // Years that begin in March, so that the leap day is the last of its year; since the first of March of the year 0.
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let of_month = day - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    (era * 400 + year + u64::from(month <= 2), month, of_month)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, text) in [
            (0.0, "1970-01-01T00:00:00Z"),
            (951_782_399.9, "2000-02-28T23:59:59Z"),
            (951_782_400.0, "2000-02-29T00:00:00Z"),
            (951_868_800.0, "2000-03-01T00:00:00Z"),
            (1_349_704_985.0, "2012-10-08T14:03:05Z"),
            (4_107_542_400.0, "2100-03-01T00:00:00Z"),
            (1_735_689_599.0, "2024-12-31T23:59:59Z"),
        ] {
            assert_eq!(Wall(seconds).to_string(), text);
        }
    }

    #[test]
    fn a_moment_ago_is_said_in_words() {
        assert_eq!(Wall(Wall::now().0 - 600.0).ago(), "10 min ago");
        assert!(Wall(Wall::now().0 + 600.0).ago().starts_with("in the future"));
    }
}
