//! From frames back to ticks.

use cathforce_bus::{Contact, Counters, Frame, Haptic, Id, Process, Protection, Status};
use cathforce_device::TickFrames;

/// What a device sent in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickReport {
    /// Ticks since the configuration was activated; the first one is 0.
    pub tick: u32,
    pub status: Status,
    pub haptic: Haptic,
    pub contact: Contact,
    /// TICK, DRIVE, MOMENT, SHAPE, FORCE or GUIDEWIREDRIVE, in ticks that have one.
    pub third: Option<Process>,
    /// The same as frames, in the order in which they arrived.
    pub frames: TickFrames,
}

/// Collects the frames of each tick: HAPTIC begins one, the frame whose status says so
/// ends it.
#[derive(Debug, Default)]
pub(crate) struct Assembler {
    protection: Protection,
    counters: Counters,
    haptic: Option<(Haptic, Frame)>,
    contact: Option<(Contact, Frame)>,
    next_tick: u32,
}

impl Assembler {
    /// The device starts over: ticks and counters from 0.
    pub(crate) fn restart(&mut self) {
        *self = Self { counters: self.counters, ..Self::default() };
    }

    /// Counts of what became of the frames from the device.
    pub(crate) fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Takes a frame; gives the tick that it completes.
    pub(crate) fn push(&mut self, frame: Frame) -> Option<TickReport> {
        let Some(id) = Id::from_raw(frame.id()).filter(|id| !id.is_from_host()) else {
            self.counters.count(cathforce_bus::Counter::Foreign);
            return None;
        };
        let accepted = self.protection.receive(id, &frame, &mut self.counters).ok()?;
        match accepted.process {
            Process::Haptic(haptic) => {
                // A tick whose last frame was lost still counts.
                self.next_tick = self.next_tick.wrapping_add(u32::from(self.haptic.is_some()));
                self.haptic = Some((haptic, frame));
                self.contact = None;
                None
            }
            Process::Contact(contact) => {
                self.contact = Some((contact, frame));
                if accepted.status.last { self.complete(accepted.status, None) } else { None }
            }
            third => {
                if let Process::Tick(sent) = third {
                    self.adopt(sent.tick);
                }
                self.complete(accepted.status, Some((third, frame)))
            }
        }
    }

    /// The tick that ends; `None` if one of its frames got lost.
    fn complete(&mut self, status: Status, third: Option<(Process, Frame)>) -> Option<TickReport> {
        let tick = self.next_tick;
        self.next_tick = tick.wrapping_add(1);
        let (haptic, contact) = (self.haptic.take(), self.contact.take());
        let ((haptic, first), (contact, second)) = haptic.zip(contact)?;
        let frames = [Some(first), Some(second), third.map(|(_, frame)| frame)];
        let third = third.map(|(process, _)| process);
        Some(TickReport { tick, status, haptic, contact, third, frames })
    }

    /// Corrects the count after a loss. The device sends the low 16 bits of its own count.
    fn adopt(&mut self, low: u16) {
        let ahead = low.wrapping_sub(self.next_tick as u16) as i16;
        self.next_tick = self.next_tick.wrapping_add_signed(i32::from(ahead));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cathforce_device::ControlLoop;

    fn ticks(n: usize) -> Vec<Frame> {
        let mut ticker = ControlLoop::new();
        (0..n).flat_map(|_| ticker.tick(None, None)).flatten().collect()
    }

    fn assemble(frames: &[Frame]) -> Vec<u32> {
        let mut assembler = Assembler::default();
        frames.iter().filter_map(|&frame| assembler.push(frame)).map(|t| t.tick).collect()
    }

    #[test]
    fn every_tick_is_seen_once() {
        assert_eq!(assemble(&ticks(4)), [0, 1, 2, 3]);
    }

    #[test]
    fn a_lost_frame_loses_its_tick_and_no_other() {
        for lost in 3..6 {
            let mut frames = ticks(4);
            frames.remove(lost);
            assert_eq!(assemble(&frames), [0, 2, 3], "frame {lost}");
        }
    }

    /// Without a third frame no number of the tick is sent: it is counted by the frames alone.
    #[test]
    fn a_tick_of_two_frames_ends_with_the_second() {
        let whole = || {
            let mut sealer = cathforce_bus::Sealer::default();
            let frames = (0..4).flat_map(move |_| {
                let haptic = Process::Haptic(Haptic {
                    force: Default::default(),
                    torque: Default::default(),
                    mode: 4,
                    fault: 0,
                });
                let contact = Process::Contact(Contact { force: Default::default() });
                let last = Status { last: true, ..Status::default() };
                [sealer.seal(haptic, Status::default()), sealer.seal(contact, last)]
            });
            frames.collect::<Vec<_>>()
        };
        assert_eq!(assemble(&whole()), [0, 1, 2, 3]);
        for lost in 2..4 {
            let mut frames = whole();
            frames.remove(lost);
            assert_eq!(assemble(&frames), [0, 2, 3], "frame {lost}");
        }
    }

    #[test]
    fn numbers_go_on_past_16_bits() {
        let mut assembler = Assembler { next_tick: 0x1_0004, ..Assembler::default() };
        assembler.adopt(0xFFFE);
        assert_eq!(assembler.next_tick, 0xFFFE);
        assembler.adopt(3);
        assert_eq!(assembler.next_tick, 0x1_0003);
    }
}
