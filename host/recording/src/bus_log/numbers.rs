//! Numbers and frames in the text of a log.

use cathforce_bus::{EXTENDED, Frame, MAX_EXTENDED_ID};

/// Seconds, milliseconds or microseconds as written, in nanoseconds. `unit_ns` is a power of ten. Digits
/// below a nanosecond are cut off. `None` if it is no positive number or out of range.
pub(super) fn time_ns(text: &str, unit_ns: u64) -> Option<u64> {
    let (whole, part) = text.split_once('.').unwrap_or((text, ""));
    let are_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || !are_digits(whole) || !are_digits(part) {
        return None;
    }
    let mut part_ns = 0;
    let mut unit = unit_ns / 10;
    for digit in part.bytes().take_while(|_| unit_ns > 1) {
        part_ns += u64::from(digit - b'0') * unit;
        unit /= 10;
    }
    whole.parse::<u64>().ok()?.checked_mul(unit_ns)?.checked_add(part_ns)
}

/// Bytes in a given base, each a word.
pub(super) fn bytes<'a>(words: impl Iterator<Item = &'a str>, base: u32) -> Option<Vec<u8>> {
    words.map(|word| byte(word, base)).collect()
}

pub(super) fn byte(word: &str, base: u32) -> Option<u8> {
    let is_number = word.bytes().all(|byte| byte.is_ascii_alphanumeric());
    u8::from_str_radix(word, base).ok().filter(|_| is_number)
}

pub(super) fn number(word: &str, base: u32) -> Option<u32> {
    let is_number = word.bytes().all(|byte| byte.is_ascii_alphanumeric());
    u32::from_str_radix(word, base).ok().filter(|_| is_number)
}

/// A frame. Errors: the identifier has more than 11 bits, or 29 if it is extended, or there are more than 8
/// bytes.
pub(super) fn frame(id: u32, is_extended: bool, data: &[u8]) -> Result<Frame, String> {
    let (bits, mark) = if is_extended { (29, EXTENDED) } else { (11, 0) };
    let frame = (id <= MAX_EXTENDED_ID).then(|| Frame::new(id | mark, data)).flatten();
    frame.ok_or_else(|| {
        let bytes = data.len();
        format!(
            "identifier {id:#x} with {bytes} bytes is no frame of {bits} bits and 8 bytes at most"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_to_the_nanosecond() {
        assert_eq!(time_ns("1.5", 1_000_000_000), Some(1_500_000_000));
        assert_eq!(time_ns("2.25", 1_000_000), Some(2_250_000));
        assert_eq!(time_ns("7", 1000), Some(7000));
        assert_eq!(
            time_ns("1700000000.123456789123", 1_000_000_000),
            Some(1_700_000_000_123_456_789)
        );
        for wrong in ["", ".5", "-1", "1e3", "99999999999999999999", "20000000000.0"] {
            assert_eq!(time_ns(wrong, 1_000_000_000), None, "{wrong}");
        }
    }

    #[test]
    fn a_sign_is_no_digit() {
        assert_eq!((byte("fF", 16), byte("+1", 16), byte("100", 16)), (Some(255), None, None));
        assert!(frame(0x800, false, &[]).is_err() && frame(0x7FF, false, &[0; 9]).is_err());
        assert_eq!(frame(0x800, true, &[]).unwrap().id(), EXTENDED | 0x800);
        assert!(frame(0x2000_0000, true, &[]).is_err());
    }
}
