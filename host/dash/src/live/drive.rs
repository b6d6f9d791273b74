//! A trial that this program plays on the device: there and back, without a jump.

use std::sync::{Arc, Mutex, PoisonError};

use cathforce_bus::Command;
use cathforce_control::{Mode, TICK_S};
use cathforce_link::Step;
use serde::Serialize;
use serde_json::json;

use super::action::Reply;
use super::record::NewRecording;

/// Ticks after which a command is sent again: a device does not arm in a tick that it has not resolved.
const COMMAND_EVERY_TICKS: u32 = 50;
/// Ticks within which a device must arm or ramp down.
const PATIENCE_TICKS: u32 = 2000;

/// fx, fy, fz on the vessel and the force behind the guide, where a sensor measured them \[N\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measurement(pub [Option<f32>; 4]);

/// What to play.
pub struct Drive {
    pub image: Vec<u8>,
    /// The host grants each tick, at the pace of its own clock.
    pub lock_step: bool,
    /// The positions of the drives at a time of the trial \[s\].
    pub step_at: Box<dyn Fn(f64) -> Step + Send>,
    pub measured_at: Box<dyn Fn(f64) -> Option<Measurement> + Send>,
    pub duration_s: f64,
    /// Arms and begins without being asked.
    pub play: bool,
    /// Makes the file of a recording that somebody with the token asks for.
    pub new_recording: Option<NewRecording>,
}

/// Where the trial that is played stands.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Playing {
    pub playing: bool,
    pub t_s: f64,
    pub duration_s: f64,
}

/// Where the trial stands, and what was measured there.
type Stand = (Playing, Option<Measurement>);

/// Where the trial stands, for whoever draws it.
#[derive(Clone, Default)]
pub struct Position(Arc<Mutex<Option<Stand>>>);

impl Position {
    pub fn set(&self, playing: Playing, measured: Option<Measurement>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some((playing, measured));
    }

    pub fn get(&self) -> Option<Stand> {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A mode that the device is to reach, and whom to tell.
pub struct Goal {
    pub command: Command,
    pub mode: Mode,
    pub reply: Option<Reply>,
    pub then_play: bool,
}

/// The motion of the drives and what the device is told, tick by tick.
pub struct Motion {
    t_s: f64,
    duration_s: f64,
    backward: bool,
    pub playing: bool,
    pub mode: Option<Mode>,
    goal: Option<Goal>,
    goal_ticks: u32,
    ticks: u32,
}

impl Motion {
    pub fn new(duration_s: f64) -> Self {
        Self {
            t_s: 0.0,
            duration_s,
            backward: false,
            playing: false,
            mode: None,
            goal: None,
            goal_ticks: 0,
            ticks: 0,
        }
    }

    /// Lets the device go for a mode; whoever waited for another one is told.
    pub fn go_for(&mut self, goal: Goal) {
        self.end_goal(Err("another request came before this one was done".to_owned()));
        (self.goal, self.goal_ticks) = (Some(goal), 0);
    }

    pub fn t_s(&self) -> f64 {
        self.t_s
    }

    pub fn position(&self) -> Playing {
        Playing { playing: self.playing, t_s: self.t_s, duration_s: self.duration_s }
    }

    /// The next tick: the time of the trial, and a command.
    pub fn step(&mut self) -> (f64, Option<Command>) {
        if self.playing && self.mode == Some(Mode::Armed) {
            let step_s = f64::from(TICK_S);
            self.t_s += if self.backward { -step_s } else { step_s };
            if self.t_s >= self.duration_s || self.t_s <= 0.0 {
                self.t_s = self.t_s.clamp(0.0, self.duration_s);
                self.backward = !self.backward;
            }
        }
        self.ticks = self.ticks.wrapping_add(1);
        if self.goal.is_some() {
            self.goal_ticks += 1;
            // A device that settles first has its time; only then it can arm.
            let waits = matches!(self.mode, Some(Mode::Boot | Mode::Idle | Mode::Settling));
            if waits {
                self.goal_ticks = 0;
            } else if self.goal_ticks > PATIENCE_TICKS {
                let mode = self.mode.map_or("not configured", Mode::name);
                self.end_goal(Err(format!("the device stayed {mode}")));
            }
        }
        let command = match self.mode {
            Some(Mode::Boot) => Some(Command::SelfTest),
            Some(Mode::Ready | Mode::Armed) => self.goal.as_ref().map(|goal| goal.command),
            _ => None,
        };
        (self.t_s, command.filter(|_| self.ticks.is_multiple_of(COMMAND_EVERY_TICKS)))
    }

    /// The device said its mode.
    pub fn heard(&mut self, mode: Option<Mode>) {
        self.mode = mode;
        if let Some(fault) = mode.and_then(Mode::fault) {
            self.playing = false;
            self.end_goal(Err(format!("the device has a fault: {}", fault.text())));
        }
        if self.goal.as_ref().is_some_and(|goal| Some(goal.mode) == mode) {
            self.playing = self.goal.as_ref().is_some_and(|goal| goal.then_play);
            let name = mode.map_or("", Mode::name);
            self.end_goal(Ok(json!({ "mode": name })));
        }
    }

    fn end_goal(&mut self, answer: Result<serde_json::Value, String>) {
        if let Some(reply) = self.goal.take().and_then(|goal| goal.reply) {
            // Whoever asked may have gone.
            let _ = reply.send(answer);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::sync::oneshot;

    #[test]
    fn a_trial_goes_there_and_back_without_a_jump_and_only_while_armed() {
        let mut motion = Motion::new(0.01);
        motion.playing = true;
        assert_eq!(motion.step().0, 0.0);
        motion.mode = Some(Mode::Armed);
        let times = (0..50).map(|_| motion.step().0).collect::<Vec<_>>();
        assert!(times.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 1.001e-3));
        assert!(times.iter().any(|t| *t > 0.0099) && times[30..].iter().any(|t| *t < 1e-9));
        motion.heard(Mode::from_codes(6, cathforce_control::Fault::EncoderJump.code()));
        assert!(!motion.playing);
    }

    #[test]
    fn whoever_waits_for_a_mode_is_told_of_it_or_why_not() {
        let mut motion = Motion::new(1.0);
        motion.heard(Some(Mode::Ready));
        let ask = |motion: &mut Motion| {
            let (reply, answer) = oneshot::channel();
            let (command, mode) = (Command::Arm, Mode::Armed);
            motion.go_for(Goal { command, mode, reply: Some(reply), then_play: true });
            answer
        };
        let mut answer = ask(&mut motion);
        let commands = (0..100).filter_map(|_| motion.step().1).collect::<Vec<_>>();
        assert_eq!(commands, [Command::Arm, Command::Arm]);
        motion.heard(Some(Mode::Armed));
        assert_eq!(answer.try_recv().unwrap().unwrap()["mode"], "armed");
        assert!(motion.playing);
        motion.heard(Some(Mode::Ready));
        let mut answer = ask(&mut motion);
        for _ in 0..=PATIENCE_TICKS {
            motion.step();
        }
        assert!(answer.try_recv().unwrap().unwrap_err().contains("stayed ready"));
    }
}
