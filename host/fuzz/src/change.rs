//! Changes of seeds, the same in every run.

/// Words that parsers stumble over.
const WORDS: [&[u8]; 24] = [
    b"1e308",
    b"-1e308",
    b"1e-320",
    b"nan",
    b"inf",
    b"-0",
    b"0",
    b"18446744073709551616",
    b"-9223372036854775808",
    b"4294967295",
    b"99999999999999999999.9",
    b"{{data}}",
    b"{{script}}",
    b"<!--<script>",
    b"\"",
    b",",
    b"\n",
    b"\xFF\xFE",
    b"\xF0\x9F\x92\x80",
    b"\0",
    b"]",
    b"=",
    b"(",
    b"../",
];
/// Most changes of one input.
const MOST_CHANGES: u64 = 8;
/// Seeds do not grow beyond it \[bytes\].
const MOST_BYTES: usize = 1 << 16;

/// A seed with the changes that belong to the number `nth`: bits, numbers, words and parts of the seed
/// itself or of another one, put in, taken out, doubled or exchanged.
pub fn changed(seeds: &[Vec<u8>], nth: u64) -> Vec<u8> {
    let mut chance = Chance(nth.wrapping_mul(0xD6E8_FEB8_6659_FD93).wrapping_add(1));
    let mut bytes = chance.of(seeds).cloned().unwrap_or_default();
    for _ in 0..1 + chance.below(MOST_CHANGES) {
        change(&mut bytes, seeds, &mut chance);
    }
    bytes.truncate(MOST_BYTES);
    bytes
}

fn change(bytes: &mut Vec<u8>, seeds: &[Vec<u8>], chance: &mut Chance) {
    let at = chance.up_to(bytes.len());
    let len = match chance.below(4) {
        0 => chance.up_to(bytes.len() - at),
        _ => chance.up_to(8.min(bytes.len() - at)),
    };
    let part = at..at + len;
    match chance.below(10) {
        0 | 1 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << chance.below(8);
            }
        }
        2 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte =
                    chance.of(&[0, 1, 0x7F, 0x80, 0xFF, b'-', b'9', b'.']).copied().unwrap_or(0);
            }
        }
        3 => {
            let number = chance.of(&[0, 1, u64::MAX, 1 << 31, 1 << 63, 0xFFFF_FFFF]).copied();
            let number = number.unwrap_or(0).to_le_bytes();
            for (place, byte) in bytes[part].iter_mut().zip(number) {
                *place = byte;
            }
        }
        4 | 5 => {
            let word = chance.of(&WORDS).copied().unwrap_or_default();
            bytes.splice(part, word.iter().copied());
        }
        6 => {
            bytes.drain(part);
        }
        7 => bytes.truncate(at),
        8 => {
            let copy = bytes[part].to_vec();
            bytes.splice(at..at, copy);
        }
        _ => {
            let other = chance.of(seeds).cloned().unwrap_or_default();
            let from = chance.up_to(other.len());
            let to = from + chance.up_to(other.len() - from);
            bytes.splice(part, other[from..to].iter().copied());
        }
    }
}

/// A generator of 64-bit numbers (SplitMix64).
struct Chance(u64);

impl Chance {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    fn up_to(&mut self, n: usize) -> usize {
        self.below(n as u64 + 1) as usize
    }

    fn of<'a, T>(&mut self, from: &'a [T]) -> Option<&'a T> {
        let n = from.len().max(1) as u64;
        from.get(self.below(n) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_gives_the_same_input_each_time_and_numbers_differ() {
        let seeds = [b"1.5,2.5\n".to_vec(), b"t_s,insertion_m\n".to_vec()];
        let all: Vec<_> = (0..1000).map(|nth| changed(&seeds, nth)).collect();
        assert!((0..1000).all(|nth| changed(&seeds, nth) == all[nth as usize]));
        let mut different = all.clone();
        different.sort();
        different.dedup();
        assert!(different.len() > 800, "{}", different.len());
        for word in [&b"{{data}}"[..], b"1e308"] {
            assert!(all.iter().any(|input| input.windows(word.len()).any(|part| part == word)));
        }
    }

    #[test]
    fn without_a_seed_there_is_something_all_the_same() {
        assert!((0..100).any(|nth| !changed(&[], nth).is_empty()));
    }
}
