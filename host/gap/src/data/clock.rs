//! The clock of a recording: the usual step between rows, and jumps.

/// A step of time larger than this many usual ones is a jump of the clock.
const JUMP: f64 = 5.0;
/// A longer jump is cut to this \[s\]: nothing near it is compared, and a model would have to be led through
/// all of it.
const LONGEST_S: f64 = 5.0;

/// A jump of the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// Last row before it.
    pub row: usize,
    /// Time of that row, and how long the jump is, as they were recorded \[s\].
    pub at_s: f64,
    pub step_s: f64,
}

/// Times of rows, and where they jump.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// Rising strictly, no jump longer than [`LONGEST_S`] \[s\].
    pub t_s: Vec<f64>,
    pub jumps: Vec<Jump>,
}

/// Half of the steps between rows are at most as long \[s\]; 0 where there are none.
pub fn usual_step_s(t_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or_default()
}

/// Where a clock jumps.
pub fn jumps(t_s: &[f64]) -> Vec<Jump> {
    let longest_s = JUMP * usual_step_s(t_s);
    let steps = t_s.windows(2).enumerate();
    let jump =
        |(row, pair): (usize, &[f64])| Jump { row, at_s: pair[0], step_s: pair[1] - pair[0] };
    steps.map(jump).filter(|jump| jump.step_s > longest_s).collect()
}

impl Clock {
    /// Of times that rise strictly.
    pub fn of(t_s: &[f64]) -> Self {
        let jumps = jumps(t_s);
        let mut long = jumps.iter().filter(|jump| jump.step_s > LONGEST_S).peekable();
        let mut cut_s = 0.0;
        let at = |(row, t_s): (usize, &f64)| {
            if let Some(jump) = long.next_if(|jump| jump.row < row) {
                cut_s += jump.step_s - LONGEST_S;
            }
            t_s - cut_s
        };
        Self { t_s: t_s.iter().enumerate().map(at).collect(), jumps }
    }

    /// From the last row before every jump to the first one after it \[s\].
    pub fn spans_s(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.jumps.iter().map(|jump| [self.t_s[jump.row], self.t_s[jump.row + 1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_jump_is_cut_and_known() {
        let t_s = [0.0, 1.0, 2.0, 9.0, 10.0, 1e9, 1e9 + 1.0];
        let clock = Clock::of(&t_s);
        assert_eq!(clock.t_s, [0.0, 1.0, 2.0, 7.0, 8.0, 13.0, 14.0]);
        let known: Vec<_> = clock.jumps.iter().map(|j| (j.row, j.at_s, j.step_s)).collect();
        assert_eq!(known, [(2, 2.0, 7.0), (4, 10.0, 1e9 - 10.0)]);
        assert_eq!(clock.spans_s().collect::<Vec<_>>(), [[2.0, 7.0], [8.0, 13.0]]);
    }

    #[test]
    fn an_even_clock_stays_as_it_is() {
        let t_s: Vec<f64> = (0..100).map(|i| 0.3 + f64::from(i) * 1e-3).collect();
        assert_eq!(Clock::of(&t_s), Clock { t_s: t_s.clone(), jumps: Vec::new() });
        assert_eq!(Clock::of(&[]).t_s, [0.0; 0]);
        assert_eq!(Clock::of(&[2.0]).t_s, [2.0]);
    }
}
