//! The device's tick once more, on this computer.
//!
//! The bus carries one node of the shape every few ticks, so a whole shape is a third of a second old.
//! The same tick, fed with the same frames, knows all nodes at once. In lock step it agrees with the
//! device to the bit, which the digests on the bus show.

use std::collections::VecDeque;

use cathforce_bus::{Command, Frame, Process, Sealer, Status, Tick};
use cathforce_config::image::{self, ImageError};
use cathforce_control::{Config, Mode};
use cathforce_device::ControlLoop;

/// Digests that wait for the device's: those of more ticks than can be under way.
const DIGESTS: usize = 128;

self_cell::self_cell!(
    /// An image and the configuration that reads in it.
    struct Configured {
        owner: Vec<u8>,
        #[covariant]
        dependent: Config,
    }
);

/// A tick with the device's image.
pub struct Twin {
    configured: Configured,
    ticker: ControlLoop,
    sealer: Sealer,
    digests: VecDeque<(u16, u32)>,
    /// Digests that agreed and that differed since the start.
    pub agreed: u64,
    pub differed: u64,
}

impl Twin {
    pub fn new(image: Vec<u8>, lock_step: bool) -> Result<Self, ImageError> {
        let configured = Configured::try_new(image, |image| image::decode(image))?;
        let mut twin = Self {
            configured,
            ticker: ControlLoop::new(),
            sealer: Sealer::default(),
            digests: VecDeque::new(),
            agreed: 0,
            differed: 0,
        };
        twin.restart(lock_step);
        Ok(twin)
    }

    /// Begins anew, as a device that was configured.
    pub fn restart(&mut self, lock_step: bool) {
        let master = image::master(self.configured.borrow_owner()).unwrap_or_default();
        self.ticker = ControlLoop::new();
        // A new ticker is not armed, so this cannot fail.
        let _ = self.ticker.set_lock_step(lock_step);
        self.ticker.restart(master);
        self.digests.clear();
    }

    /// Tests itself without a command on the bus: whoever joins later has not seen the command.
    pub fn test_itself(&mut self) {
        let frame = self.sealer.seal(Process::Command(Command::SelfTest), Status::default());
        self.ticker.on_frame(&frame);
    }

    pub fn mode(&self) -> Option<Mode> {
        self.ticker.outputs().map(|outputs| outputs.mode)
    }

    /// Takes a frame that went to the device; in lock step it may grant ticks.
    pub fn on_frame_to_device(&mut self, frame: &Frame) {
        self.ticker.on_frame(frame);
        while self.ticker.lock_step() && self.ticker.granted() > 0 {
            self.tick();
        }
    }

    /// The device has ticked by its own clock.
    pub fn device_ticked(&mut self) {
        if !self.ticker.lock_step() {
            self.tick();
        }
    }

    /// The device said its digest.
    pub fn compare(&mut self, said: Tick) {
        let known = self.digests.iter().rev().find(|(tick, _)| *tick == said.tick);
        match known {
            Some((_, digest)) if *digest == said.digest => self.agreed += 1,
            Some(_) => self.differed += 1,
            None => {}
        }
    }

    fn tick(&mut self) {
        let tick = self.ticker.ticks() as u16;
        self.ticker.tick(Some(self.configured.borrow_dependent()), None);
        if let Some(outputs) = self.ticker.outputs() {
            if self.digests.len() == DIGESTS {
                self.digests.pop_front();
            }
            self.digests.push_back((tick, outputs.digest));
        }
    }

    /// Position from the entry \[m\] and contact force on the vessel \[N\] of each node, the tip first.
    pub fn nodes(&self) -> Vec<([f32; 3], [f32; 3])> {
        let entry_m = self.configured.borrow_dependent().model.description().entry.position_m;
        let model = self.ticker.state().mechanics();
        let node = |i: usize| {
            let at_m = model.node_position_m(i)?;
            Some((std::array::from_fn(|k| at_m[k] - entry_m[k]), model.node_force_n(i)?))
        };
        (0..model.nodes()).filter_map(node).collect()
    }
}
