//! The status word of a row of a Net F/T or an Ethernet Axia.

/// Bit of a threshold that the user has set; it says nothing of the force's validity.
const MONITOR_CONDITION: u32 = 1 << 16;

/// Bits that have a meaning of their own. Source: ATI's manuals 9620-05 (Net F/T) and 9610-05 (Axia),
/// chapters "status code".
const BITS: [(u32, &str); 8] = [
    (1, "temperature"),
    (1 << 1, "supply voltage"),
    (1 << 2, "broken gage"),
    (1 << 3, "busy"),
    (1 << 27, "gage out of range"),
    (1 << 28, "simulated error"),
    (1 << 29, "calibration checksum"),
    (1 << 30, "force or torque out of range"),
];

/// Reads a status; `is_hex` if the column says so. `None` if it is no such word.
pub(super) fn parse(field: &str, is_hex: bool) -> Option<u32> {
    let digits = field.strip_prefix("0x").or_else(|| field.strip_prefix("0X"));
    if let Some(digits) = digits {
        return u32::from_str_radix(digits, 16).ok();
    }
    let decimal = || {
        field.parse::<i64>().ok().and_then(|word| {
            // Some programs print the word with a sign.
            u32::try_from(word).ok().or_else(|| i32::try_from(word).ok().map(i32::cast_unsigned))
        })
    };
    let hex = || u32::from_str_radix(field, 16).ok();
    if is_hex { hex().or_else(decimal) } else { decimal().or_else(hex) }
}

/// Whether the row's forces are no measurement.
pub(crate) fn is_error(word: u32) -> bool {
    word & !MONITOR_CONDITION != 0
}

/// `0x88000000 (gage out of range)`.
pub(crate) fn text(word: u32) -> String {
    let names = BITS.iter().filter(|(bit, _)| word & bit != 0).map(|(_, name)| *name);
    let names = names.collect::<Vec<_>>().join(", ");
    match names.is_empty() {
        true => format!("{word:#010x}"),
        false => format!("{word:#010x} ({names})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_told_from_a_threshold_of_the_user() {
        assert_eq!(parse("0x88000000", true), Some(0x8800_0000));
        assert_eq!(parse("88000000", true), Some(0x8800_0000));
        assert_eq!(parse("-2147483648", false), Some(0x8000_0000));
        assert_eq!((parse("0", false), parse("well", true)), (Some(0), None));
        assert!(is_error(0x8800_0000) && is_error(1 << 31) && !is_error(0) && !is_error(1 << 16));
        assert_eq!(text(0x8800_0000), "0x88000000 (gage out of range)");
        assert_eq!(text(0x8000_0000), "0x80000000");
    }
}
