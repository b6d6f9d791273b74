//! The excitation: what a recording must contain so that effects can be told apart.
//!
//! Between two depths the drive stands still, feeds at 13 and at 23 mm/s, dwells, turns ±360° at
//! four depths, reverses over 3, 20 and 60 mm, and withdraws at 18 mm/s. Repeats of it are
//! repeats of this very motion.

use std::f64::consts::TAU;

/// Time in which the drive reaches a speed \[s\].
const RAMP_S: f64 = 0.1;
const SLOW_M_PER_S: f64 = 0.013;
const FAST_M_PER_S: f64 = 0.023;
const WITHDRAWAL_M_PER_S: f64 = 0.018;
const TURN_RAD_PER_S: f64 = TAU / 4.0;
/// Shorter ways than this hold no protocol \[m\].
const SHORTEST_WAY_M: f64 = 0.01;

/// Where the drive is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    pub insertion_m: f64,
    pub rotation_rad: f64,
}

/// A named part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    pub name: &'static str,
    /// What the drive does, in a few words.
    pub what: &'static str,
    pub start_s: f64,
    pub end_s: f64,
}

/// One motion from standing to standing.
#[derive(Clone, Copy, Debug)]
struct Move {
    start_s: f64,
    end_s: f64,
    from: Position,
    to: Position,
    ramp_s: f64,
}

/// The whole motion.
#[derive(Clone, Debug)]
pub struct Protocol {
    moves: Vec<Move>,
    pieces: Vec<Piece>,
    remarks: Vec<String>,
}

/// Depths between which nothing can be told.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a protocol cannot go from {from_m} m to {to_m} m\n  fix: give two insertions, the second \
     at least 10 mm deeper"
)]
pub struct WayError {
    pub from_m: f64,
    pub to_m: f64,
}

impl Protocol {
    /// From an insertion at which the tip is free to one at which it touches \[m\].
    pub fn new(from_m: f64, to_m: f64) -> Result<Self, WayError> {
        // Written so that NaN fails.
        if !(from_m >= 0.0 && to_m - from_m >= SHORTEST_WAY_M && to_m.is_finite()) {
            return Err(WayError { from_m, to_m });
        }
        let start = Position { insertion_m: from_m, rotation_rad: 0.0 };
        let (middle_m, third_m) = (0.5 * (from_m + to_m), from_m + (to_m - from_m) / 3.0);
        let mut builder = Builder { at: start, now_s: 0.0, moves: Vec::new(), pieces: Vec::new() };
        let mut remarks = Vec::new();
        let b = &mut builder;
        b.piece("static-zero", "stand still for 3 s, the tip free", |b| b.rest(3.0));
        b.piece("rotation-free", "turn by ±360° at 90°/s, the tip free", Builder::turn_around);
        b.piece("dwell-free", "stand for 1 s", |b| b.rest(1.0));
        b.piece("forward-13mm", "feed at 13 mm/s to the middle", |b| {
            b.feed(middle_m, SLOW_M_PER_S)
        });
        b.piece("dwell-bend", "stand for 5 s in the bend", |b| b.rest(5.0));
        b.piece("rotation-bend", "turn by ±360° at 90°/s there", Builder::turn_around);
        b.piece("forward-23mm", "feed at 23 mm/s to the end", |b| b.feed(to_m, FAST_M_PER_S));
        b.piece("dwell-tip", "stand for 5 s with the tip in contact", |b| b.rest(5.0));
        b.piece("rotation-tip", "turn by ±360° at 90°/s there", Builder::turn_around);
        for (name, what, stroke_m, speed_m_per_s) in [
            ("reversal-3mm", "3 mm back and forth at 13 mm/s", 3e-3, SLOW_M_PER_S),
            ("reversal-20mm", "20 mm back and forth at 13 mm/s", 0.02, SLOW_M_PER_S),
            ("reversal-60mm", "60 mm back and forth at 23 mm/s", 0.06, FAST_M_PER_S),
        ] {
            if stroke_m > to_m - from_m {
                remarks.push(format!("{name} is left out: the way is only {} m", to_m - from_m));
                continue;
            }
            b.piece(name, what, |b| {
                b.feed(to_m - stroke_m, speed_m_per_s);
                b.feed(to_m, speed_m_per_s);
            });
        }
        let back = "withdraw at 18 mm/s";
        b.piece("withdrawal-18mm", back, |b| b.feed(third_m, WITHDRAWAL_M_PER_S));
        b.piece("rotation-shallow", "turn by ±360° at 90°/s", Builder::turn_around);
        b.piece("withdrawal-18mm", back, |b| b.feed(from_m, WITHDRAWAL_M_PER_S));
        b.piece("static-zero", "stand still for 3 s again", |b| b.rest(3.0));
        Ok(Self { moves: builder.moves, pieces: builder.pieces, remarks })
    }

    /// Its length \[s\].
    pub fn duration_s(&self) -> f64 {
        self.moves.last().map_or(0.0, |last| last.end_s)
    }

    /// Its parts one after the other; some come twice.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// What was left out, and why.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }

    /// The part at a time.
    pub fn piece_at(&self, t_s: f64) -> Option<&Piece> {
        self.pieces.iter().find(|piece| t_s < piece.end_s).or(self.pieces.last())
    }

    /// Where the drive is; held before the beginning and after the end.
    pub fn at(&self, t_s: f64) -> Position {
        let own = self.moves.partition_point(|m| m.end_s <= t_s);
        let Some(m) = self.moves.get(own).or(self.moves.last()) else {
            return Position { insertion_m: 0.0, rotation_rad: 0.0 };
        };
        let share = m.share(t_s);
        let between = |from: f64, to: f64| from + (to - from) * share;
        Position {
            insertion_m: between(m.from.insertion_m, m.to.insertion_m),
            rotation_rad: between(m.from.rotation_rad, m.to.rotation_rad),
        }
    }
}

impl Move {
    /// How much of the way is done: constant speed between two equal ramps.
    fn share(&self, t_s: f64) -> f64 {
        let time_s = self.end_s - self.start_s;
        let (since, left) = (t_s - self.start_s, self.end_s - t_s);
        if since <= 0.0 {
            return 0.0;
        }
        if left <= 0.0 {
            return 1.0;
        }
        // Share of the way per time at full speed.
        let speed = 1.0 / (time_s - self.ramp_s);
        if since < self.ramp_s {
            0.5 * speed * since * since / self.ramp_s
        } else if left < self.ramp_s {
            1.0 - 0.5 * speed * left * left / self.ramp_s
        } else {
            speed * (since - 0.5 * self.ramp_s)
        }
    }
}

struct Builder {
    at: Position,
    now_s: f64,
    moves: Vec<Move>,
    pieces: Vec<Piece>,
}

impl Builder {
    fn piece(&mut self, name: &'static str, what: &'static str, add: impl FnOnce(&mut Self)) {
        let start_s = self.now_s;
        add(self);
        self.pieces.push(Piece { name, what, start_s, end_s: self.now_s });
    }

    fn rest(&mut self, time_s: f64) {
        self.go(self.at, time_s, RAMP_S);
    }

    fn feed(&mut self, to_m: f64, speed_m_per_s: f64) {
        let time_s = (to_m - self.at.insertion_m).abs() / speed_m_per_s;
        let ramp_s = RAMP_S.min(time_s);
        self.go(Position { insertion_m: to_m, ..self.at }, time_s + ramp_s, ramp_s);
    }

    /// Forth, back, the other way and back.
    fn turn_around(&mut self) {
        let start = self.at;
        for angle in [TAU, 0.0, -TAU, 0.0] {
            let to = Position { rotation_rad: start.rotation_rad + angle, ..start };
            self.go(to, TAU / TURN_RAD_PER_S + RAMP_S, RAMP_S);
        }
    }

    fn go(&mut self, to: Position, time_s: f64, ramp_s: f64) {
        let (start_s, end_s) = (self.now_s, self.now_s + time_s);
        self.moves.push(Move { start_s, end_s, from: self.at, to, ramp_s });
        (self.at, self.now_s) = (to, end_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_there_and_back_at_its_speeds_without_a_jump() {
        let protocol = Protocol::new(0.03, 0.11).unwrap();
        let step_s = 1e-3;
        let ticks = (protocol.duration_s() / step_s) as usize + 1;
        let at: Vec<Position> = (0..=ticks).map(|i| protocol.at(i as f64 * step_s)).collect();
        let deepest = at.iter().map(|p| p.insertion_m).fold(0.0, f64::max);
        assert!((deepest - 0.11).abs() < 1e-12 && at[0].insertion_m == 0.03);
        let last = at[ticks];
        assert!((last.insertion_m - 0.03).abs() < 1e-12 && last.rotation_rad.abs() < 1e-12);
        let fastest = |of: &dyn Fn(&Position) -> f64| {
            let steps = at.windows(2).map(|pair| (of(&pair[1]) - of(&pair[0])).abs() / step_s);
            steps.fold(0.0, f64::max)
        };
        assert!((fastest(&|p| p.insertion_m) - FAST_M_PER_S).abs() < 1e-6);
        assert!((fastest(&|p| p.rotation_rad) - TURN_RAD_PER_S).abs() < 1e-6);
        let turned = at.iter().map(|p| p.rotation_rad).fold(0.0, f64::max);
        assert!((turned - TAU).abs() < 1e-3);
    }

    #[test]
    fn parts_follow_each_other_and_say_what_is_left_out() {
        let protocol = Protocol::new(0.03, 0.08).unwrap();
        assert!(protocol.pieces().windows(2).all(|pair| pair[0].end_s == pair[1].start_s));
        assert_eq!(protocol.pieces().last().unwrap().end_s, protocol.duration_s());
        assert!(protocol.pieces().iter().all(|piece| piece.name != "reversal-60mm"));
        assert!(protocol.remarks()[0].contains("reversal-60mm"));
        assert_eq!(protocol.piece_at(1.0).unwrap().name, "static-zero");
        let middle = protocol.pieces().iter().find(|p| p.name == "dwell-bend").unwrap();
        assert!((protocol.at(middle.start_s + 1.0).insertion_m - 0.055).abs() < 1e-12);
    }

    #[test]
    fn ways_that_are_none_are_refused() {
        for (from_m, to_m) in [(0.1, 0.05), (0.03, 0.031), (f64::NAN, 0.1), (0.03, f64::INFINITY)] {
            assert!(Protocol::new(from_m, to_m).is_err(), "{from_m} {to_m}");
        }
    }
}
