/// A time span as people say it: `850 µs`, `1.2 ms`, `3.4 s`, `5 min 20 s`, `3 h 2 min`.
pub(crate) fn span(seconds: f64) -> String {
    let size = seconds.abs();
    match size {
        _ if !seconds.is_finite() => "?".into(),
        _ if size < 0.9995e-3 => format!("{:.0} µs", seconds * 1e6),
        _ if size < 0.09995 => format!("{:.1} ms", seconds * 1e3),
        _ if size < 0.9995 => format!("{:.0} ms", seconds * 1e3),
        _ if size < 99.95 => format!("{seconds:.1} s"),
        _ if size < 5940.0 => format!("{} min {} s", (seconds / 60.0) as i64, (size % 60.0) as u64),
        _ => format!(
            "{} h {} min",
            (seconds / 3600.0) as i64,
            (size % 3600.0 / 60.0) as u64
        ),
    }
}

/// A span of nanoseconds.
pub(crate) fn span_ns(nanoseconds: f64) -> String {
    span(nanoseconds * 1e-9)
}

/// A size in bytes: `312 B`, `4.1 kB`, `23.0 MB`.
pub(crate) fn size(bytes: u64) -> String {
    match bytes {
        0..=999 => format!("{bytes} B"),
        1_000..=999_949 => format!("{:.1} kB", bytes as f64 * 1e-3),
        1_000_000..=999_949_999 => format!("{:.1} MB", bytes as f64 * 1e-6),
        _ => format!("{:.1} GB", bytes as f64 * 1e-9),
    }
}

/// `1 object`, `3 objects`.
pub(crate) fn count(n: u64, noun: &str) -> String {
    if n == 1 {
        format!("1 {noun}")
    } else {
        format!("{n} {noun}s")
    }
}

/// A rate without needless digits: `240`, `29.97`.
pub(crate) fn rate(hz: f64) -> String {
    let text = format!("{hz:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Rows as columns two spaces apart; the first row is the header.
pub(crate) fn table(rows: &[Vec<String>]) -> Vec<String> {
    let n_columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter()
            .filter_map(|row| row.get(column))
            .map(|cell| console::measure_text_width(cell))
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..n_columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let padded = row
            .iter()
            .zip(&widths)
            .map(|(cell, width)| pad(cell, *width));
        padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

/// The text in exactly that many columns: cut with an ellipsis, or filled with spaces. Colours do not count.
pub(crate) fn pad(text: &str, width: usize) -> String {
    let cut = console::truncate_str(text, width, "…");
    console::pad_str(&cut, width, console::Alignment::Left, None).into_owned()
}

/// The same, against the right.
pub(crate) fn pad_left(text: &str, width: usize) -> String {
    let cut = console::truncate_str(text, width, "…");
    console::pad_str(&cut, width, console::Alignment::Right, None).into_owned()
}

/// Text that a stranger chose (names, reasons), without control characters.
pub(crate) fn printable(text: &str) -> String {
    text.chars()
        .map(|letter| if letter.is_control() { '·' } else { letter })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans() {
        for (seconds, expected) in [
            (0.0, "0 µs"),
            (12e-6, "12 µs"),
            (-12e-6, "-12 µs"),
            (0.9996e-3, "1.0 ms"),
            (4.2e-3, "4.2 ms"),
            (0.25, "250 ms"),
            (3.12, "3.1 s"),
            (192.0, "3 min 12 s"),
            (10_920.0, "3 h 2 min"),
            (f64::NAN, "?"),
        ] {
            assert_eq!(span(seconds), expected);
        }
    }

    #[test]
    fn sizes_counts_and_rates() {
        assert_eq!(
            [size(0), size(4_100), size(23_000_000), size(5_100_000_000)],
            ["0 B", "4.1 kB", "23.0 MB", "5.1 GB"]
        );
        assert_eq!([count(1, "hand"), count(0, "hand")], ["1 hand", "0 hands"]);
        assert_eq!([rate(240.0), rate(29.97), rate(0.0)], ["240", "29.97", "0"]);
    }

    #[test]
    fn tables_and_cells() {
        let rows = [
            vec!["name".into(), "state".into()],
            vec!["a".into(), "grasped".into()],
        ];
        assert_eq!(table(&rows), ["name  state", "a     grasped"]);
        assert_eq!(
            [pad("abcdef", 4), pad("ab", 4), pad_left("ab", 4)],
            ["abc…", "ab  ", "  ab"]
        );
        assert_eq!(printable("a\u{1b}[2Jb\n"), "a·[2Jb·");
    }
}
