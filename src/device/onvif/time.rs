//! Calendar dates, as cameras tell and want them.

use super::xml::Element;

/// Seconds since 1970-01-01T00:00:00Z of a civil date, proleptic Gregorian.
///
/// Source: H. Hinnant, "chrono-compatible low-level date algorithms", days_from_civil.
pub fn unix_seconds(year: i64, month: i64, day: i64, hour: i64, minute: i64, second: i64) -> Option<i64> {
    let valid = (1970..=9999).contains(&year)
        && (1..=12).contains(&month)
        && (1..=31).contains(&day)
        && (0..24).contains(&hour)
        && (0..60).contains(&minute)
        // Leap seconds.
        && (0..=60).contains(&second);
    if !valid {
        return None;
    }
    let shifted = if month > 2 { year } else { year - 1 };
    let era = shifted.div_euclid(400);
    let year_of_era = shifted - era * 400;
    let day_of_year = (153 * (month + if month > 2 { -3 } else { 9 }) + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    Some((era * 146_097 + day_of_era - 719_468) * 86_400 + hour * 3600 + minute * 60 + second)
}

/// `2010-09-16T07:50:45Z`. Source: as [`unix_seconds`], civil_from_days.
pub fn iso_8601(unix: f64) -> String {
    // Year 1970 to 9999.
    let seconds = unix.clamp(0.0, 253_402_300_799.0) as i64;
    let (days, rest) = (seconds.div_euclid(86_400) + 719_468, seconds.rem_euclid(86_400));
    let era = days.div_euclid(146_097);
    let day_of_era = days - era * 146_097;
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    let (hour, minute, second) = (rest / 3600, rest / 60 % 60, rest % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// The device's own time of GetSystemDateAndTimeResponse, seconds since 1970.
pub fn device_time(response: &Element) -> Option<f64> {
    let utc = response.at(&["SystemDateAndTime", "UTCDateTime"])?;
    let number = |path: [&str; 2]| utc.text_at(&path)?.parse::<i64>().ok();
    let seconds = unix_seconds(
        number(["Date", "Year"])?,
        number(["Date", "Month"])?,
        number(["Date", "Day"])?,
        number(["Time", "Hour"])?,
        number(["Time", "Minute"])?,
        number(["Time", "Second"])?,
    )?;
    Some(seconds as f64)
}

/// xs:duration of whole seconds and tenths, such as `PT2.5S`.
pub fn duration(seconds: f64) -> String {
    let tenths = (seconds * 10.0).round().clamp(0.0, 1e9) as u64;
    if tenths.is_multiple_of(10) {
        format!("PT{}S", tenths / 10)
    } else {
        format!("PT{}.{}S", tenths / 10, tenths % 10)
    }
}

/// Seconds of an xs:duration without years and months.
pub fn seconds(duration: &str) -> Option<f64> {
    let rest = duration.strip_prefix('P')?;
    let (days, time) = rest.split_once('T').unwrap_or((rest, ""));
    let mut total = match days.strip_suffix('D') {
        Some(n) => n.parse::<u32>().ok().map(f64::from)? * 86_400.0,
        None if days.is_empty() => 0.0,
        None => return None,
    };
    let mut number = String::new();
    for c in time.chars() {
        let unit = match c {
            'H' => 3600.0,
            'M' => 60.0,
            'S' => 1.0,
            c => {
                number.push(c);
                continue;
            }
        };
        total += number.parse::<f64>().ok().filter(|n| *n >= 0.0)? * unit;
        number.clear();
    }
    (number.is_empty() && total.is_finite()).then_some(total)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From `date -u -d ... +%s`.
    #[test]
    fn dates_agree_with_known_ones() {
        let known = [
            ((1970, 1, 1, 0, 0, 0), 0, "1970-01-01T00:00:00Z"),
            ((2000, 2, 29, 12, 30, 1), 951_827_401, "2000-02-29T12:30:01Z"),
            ((2010, 9, 16, 7, 50, 45), 1_284_623_445, "2010-09-16T07:50:45Z"),
            ((2024, 12, 31, 23, 59, 59), 1_735_689_599, "2024-12-31T23:59:59Z"),
            ((2100, 3, 1, 0, 0, 0), 4_107_542_400, "2100-03-01T00:00:00Z"),
        ];
        for ((y, mo, d, h, mi, s), unix, text) in known {
            assert_eq!(unix_seconds(y, mo, d, h, mi, s), Some(unix), "{text}");
            assert_eq!(iso_8601(unix as f64 + 0.9), text);
        }
        assert_eq!(unix_seconds(2020, 13, 1, 0, 0, 0), None);
        assert_eq!(unix_seconds(i64::MAX, 1, 1, 0, 0, 0), None);
        assert_eq!(iso_8601(f64::NAN), "1970-01-01T00:00:00Z");
        assert_eq!(iso_8601(1e300), "9999-12-31T23:59:59Z");
    }

    #[test]
    fn durations_are_written_and_read() {
        for (value, text) in [(2.0, "PT2S"), (0.26, "PT0.3S"), (61.5, "PT61.5S"), (-1.0, "PT0S")] {
            assert_eq!(duration(value), text);
        }
        for (text, value) in [("PT10S", 10.0), ("PT1M0.5S", 60.5), ("P1DT1H", 90_000.0), ("PT0S", 0.0), ("P", 0.0)] {
            assert_eq!(seconds(text), Some(value), "{text}");
        }
        for text in ["", "10", "PT10", "PTxS", "P1Y", "PT-1S", "PTS", "PT1e999S"] {
            assert_eq!(seconds(text), None, "{text}");
        }
    }
}
