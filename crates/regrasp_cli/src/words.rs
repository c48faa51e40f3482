//! Numbers in words.

/// `n` with a thin separation of thousands: 12 004.
pub fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}

/// Seconds, or milliseconds when they are few.
pub fn duration(seconds: f64) -> String {
    if seconds < 0.1 { format!("{:.1} ms", 1e3 * seconds) } else { format!("{seconds:.2} s") }
}

/// `1 finger`, `2 fingers`.
pub fn counted(n: usize, noun: &str) -> String {
    format!("{} {noun}{}", grouped(n as u64), if n == 1 { "" } else { "s" })
}

/// `[0.082, -0.003, 0.005]`, as a scene file takes it. Values that round to zero have no sign.
pub fn metres(point: &[f64; 3]) -> String {
    let [x, y, z] = point.map(|value| (value * 1000.0).round() / 1000.0 + 0.0);
    format!("[{x:.3}, {y:.3}, {z:.3}]")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_as_scene_files_take_them() {
        assert_eq!(metres(&[0.0821, -0.0002, 1.0]), "[0.082, 0.000, 1.000]");
    }

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!([0, 999, 1000, 1234567].map(grouped).join("|"), "0|999|1 000|1 234 567");
        assert_eq!(counted(1, "joint") + &counted(0, "joint"), "1 joint0 joints");
    }
}
