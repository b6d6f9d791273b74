//! Thins a mask to lines one pixel wide.

use super::mask::{Mask, neighbours};

/// The pixels that are left when a mask is thinned from all sides as far as its parts stay whole.
///
/// Source: Zhang and Suen, "A fast parallel algorithm for thinning digital patterns", 1984.
pub fn thin(mask: &Mask) -> Mask {
    let width = mask.width;
    let mut thinned = mask.clone();
    let part = &mut thinned.part;
    let mut pixels: Vec<usize> = (0..part.len()).filter(|i| part[*i] != 0).collect();
    let mut gone = Vec::new();
    loop {
        let before = pixels.len();
        for half in [0, 1] {
            gone.clear();
            gone.extend(pixels.iter().copied().filter(|i| is_removable(part, width, *i, half)));
            gone.iter().for_each(|i| part[*i] = 0);
            pixels.retain(|i| part[*i] != 0);
        }
        if pixels.len() == before {
            return thinned;
        }
    }
}

/// Whether a pixel of the outline may go in the first (0) or the second (1) half of a round: its
/// neighbours stay connected, and it is no end of a line.
fn is_removable(part: &[u16], width: usize, i: usize, half: usize) -> bool {
    let around = neighbours(i, width).map(|j| part[j] != 0);
    let count = around.iter().filter(|there| **there).count();
    let runs = (0..8).filter(|k| !around[*k] && around[(k + 1) % 8]).count();
    let [right, _, below, _, left, _, above, _] = around;
    let sides = match half {
        0 => !(right && below && (above || left)),
        _ => !(above && left && (right || below)),
    };
    (2..=6).contains(&count) && runs == 1 && sides
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_becomes_a_line_along_its_middle_and_a_cross_keeps_its_arms() {
        let mut mask = Mask { width: 60, height: 40, part: vec![0; 60 * 40] };
        for y in 10..15 {
            mask.part[y * 60 + 5..][..50].fill(1);
        }
        let line = thin(&mask);
        let pixels: Vec<usize> = (0..line.part.len()).filter(|i| line.part[*i] != 0).collect();
        assert!((44..=50).contains(&pixels.len()), "{}", pixels.len());
        assert!(pixels.iter().all(|i| (11..=13).contains(&(i / 60))));
        for y in 2..38 {
            mask.part[y * 60 + 30..][..5].fill(1);
        }
        let cross = thin(&mask);
        let ends = (0..cross.part.len()).filter(|i| {
            let around =
                |i: usize| neighbours(i, 60).iter().filter(|j| cross.part[**j] != 0).count();
            cross.part[*i] != 0 && around(*i) == 1
        });
        assert_eq!(ends.count(), 4);
    }
}
