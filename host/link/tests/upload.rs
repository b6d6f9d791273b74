//! A device image over a bus whose time is counted: how fast, and what becomes of it when it is
//! cut.

#[path = "../../../shared/control/tests/support/wire.rs"]
#[allow(dead_code)]
mod wire;

use std::ops::ControlFlow;
use std::time::Duration;

use cathforce_bus::{Counter, Direction, Frame, Id, Process, Sealer, Status, Sync};
use cathforce_config::{ImageHead, Settings, image};
use cathforce_link::{Client, ClientError, Link, LinkError, Sim};
use cathforce_mechanics::{FREE, LumenHeader};

/// What host and device each may take to answer a frame \[µs\]: a USB adapter, a task on a board.
const TURNAROUND_US: f64 = 300.0;
/// Bits a second are bits a microsecond.
const BITS_A_US: f64 = 1.0;
/// From one tick of a device that runs free to the next \[µs\].
const TICK_US: f64 = 1000.0;
/// Of the bus's time that ticks leave, carrying the image's frames.
const LEAST_SHARE: f64 = 0.70;

/// A device at the other end of 1 Mbit/s.
///
/// Running free, the device ticks whenever a millisecond of the bus has passed, whatever host and
/// upload do, and the frames of its ticks take their share of the bus.
struct TimedBus {
    device: Sim,
    clock: Option<Sealer>,
    /// Ticks that the device has run by its clock.
    ticks: u32,
    last: Option<Direction>,
    /// Time in which the bus carried service frames and frames of ticks, and in which everybody
    /// waited \[µs\].
    busy_us: f64,
    ticks_us: f64,
    idle_us: f64,
    mishap: Option<Mishap>,
}

/// Whose clock runs the ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pace {
    LockStep,
    Free,
}

/// What happens after so many frames to the device.
#[derive(Clone, Copy)]
enum Mishap {
    /// The cable is pulled.
    Cut(usize),
    /// The device loses its supply for a moment.
    Reset(usize),
}

impl TimedBus {
    fn new(pace: Pace, mishap: Option<Mishap>) -> Self {
        Self {
            device: Sim::in_lock_step(),
            clock: (pace == Pace::Free).then(Sealer::default),
            ticks: 0,
            last: None,
            busy_us: 0.0,
            ticks_us: 0.0,
            idle_us: 0.0,
            mishap,
        }
    }

    fn now_us(&self) -> f64 {
        self.busy_us + self.ticks_us + self.idle_us
    }

    fn carry(&mut self, direction: Direction, frame: &Frame) -> Result<(), LinkError> {
        let bits_us = f64::from(frame.most_bits()) / BITS_A_US;
        let id = Id::from_raw(frame.id());
        if !matches!(id, Some(Id::ServiceRequest | Id::ServiceResponse)) {
            self.ticks_us += bits_us;
            return Ok(());
        }
        if self.last.replace(direction).is_some_and(|last| last != direction) {
            self.idle_us += TURNAROUND_US;
        }
        self.busy_us += bits_us;
        self.run_ticks()
    }

    /// Of this device the clock is a SYNC that nobody else sees.
    fn run_ticks(&mut self) -> Result<(), LinkError> {
        let due = (self.now_us() / TICK_US) as u32;
        while let Some(clock) = self.clock.as_mut().filter(|_| self.ticks < due) {
            self.ticks += 1;
            let sync = Process::Sync(Sync { grant: 1, host_tick: self.ticks });
            self.device.send(&clock.seal(sync, Status::default()))?;
        }
        Ok(())
    }
}

impl Link for TimedBus {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        match &mut self.mishap {
            Some(Mishap::Cut(0)) => {
                let source = std::io::ErrorKind::BrokenPipe.into();
                return Err(LinkError::Lost { link: self.name().into(), source });
            }
            Some(Mishap::Reset(0)) => {
                self.device = Sim::in_lock_step();
                self.mishap = None;
            }
            Some(Mishap::Cut(left) | Mishap::Reset(left)) => *left -= 1,
            None => {}
        }
        self.carry(Direction::ToDevice, frame)?;
        self.device.send(frame)
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        let frame = self.device.receive(timeout.min(Duration::from_millis(1)))?;
        if let Some(frame) = &frame {
            self.carry(Direction::ToHost, frame)?;
        }
        Ok(frame)
    }

    fn name(&self) -> &str {
        "timed bus"
    }
}

/// An image of 1 MB: a wire in empty space.
fn large_image() -> Vec<u8> {
    let lumen = LumenHeader {
        origin_m: [-0.2; 3],
        cell_m: 1e-3,
        distance_unit_m: 1e-6,
        bricks: [80; 3],
        stored: 0,
    };
    let settings = Settings::default();
    let head = ImageHead {
        description: wire::wire(),
        lumen,
        settings,
        master: Default::default(),
        band: None,
    };
    let bytes = FREE.to_le_bytes().repeat(80 * 80 * 80);
    let mut made = vec![0; image::encoded_len(&head, &bytes).unwrap()];
    image::encode(&head, &bytes, &mut made).unwrap();
    made
}

fn go_on(_: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Uploads and returns how many bytes were there at each report.
fn uploaded(client: &mut Client<TimedBus>, image: &[u8]) -> Vec<usize> {
    let mut reported = Vec::new();
    let report = |sent| {
        reported.push(sent);
        ControlFlow::Continue(())
    };
    client.upload_image(image, report).unwrap();
    reported
}

#[test]
fn an_image_of_1_mb_takes_at_least_70_percent_of_the_bus_that_ticks_leave() {
    let image = large_image();
    assert!(image.len() > 1_000_000);
    for pace in [Pace::LockStep, Pace::Free] {
        let mut client = Client::connect(TimedBus::new(pace, None)).unwrap();
        let reported = uploaded(&mut client, &image);
        assert!(reported.is_sorted() && reported.last() == Some(&image.len()), "progress");
        let bus = client.link();
        let left_us = bus.now_us() - bus.ticks_us;
        let share = bus.busy_us / left_us;
        println!(
            "{pace:?}: {} bytes in {:.1} s of 1 Mbit/s, {:.0} % of it ticks; of the rest {:.0} % \
             carried the image ({TURNAROUND_US} µs a turn)",
            image.len(),
            1e-6 * bus.now_us(),
            100.0 * bus.ticks_us / bus.now_us(),
            100.0 * share,
        );
        assert!(share >= LEAST_SHARE, "{pace:?}: {share}");
        // Every tick that was due has run, and its frames were heard.
        assert_eq!(f64::from(bus.ticks) * TICK_US > 20e6, pace == Pace::Free);
        assert_eq!(bus.ticks_us > 0.3 * bus.now_us(), pace == Pace::Free);
        assert_eq!(client.counters().get(Counter::Lost), 0);
    }
}

/// The host's end is cut; another program begins again and the device knows how far it was.
#[test]
fn an_upload_that_was_cut_goes_on_where_it_was() {
    goes_on_after_a_cut(Pace::LockStep);
    goes_on_after_a_cut(Pace::Free);
}

fn goes_on_after_a_cut(pace: Pace) {
    let image = large_image();
    let mut client = Client::connect(TimedBus::new(pace, Some(Mishap::Cut(50_000)))).unwrap();
    let error = client.upload_image(&image, go_on).unwrap_err();
    assert!(matches!(error, ClientError::Link(LinkError::Lost { .. })), "{error}");

    let mut client = Client::connect(client.into_link().mended()).unwrap();
    let reported = uploaded(&mut client, &image);
    assert!(reported[0] > 300_000, "it began again at {}", reported[0]);
    assert_eq!(client.status().unwrap().image_crc32, cathforce_bus::service::crc32(&image));
    // Of another image nothing is left over.
    let mut other = image.clone();
    other.truncate(5000);
    assert!(matches!(client.upload_image(&other, go_on), Err(ClientError::Refused { .. })));
    assert_eq!(client.status().unwrap().image_crc32, cathforce_bus::service::crc32(&image));
}

/// The device is reset in the middle: it gets the image from its beginning.
#[test]
fn a_device_that_is_reset_gets_the_image_from_the_beginning() {
    let image = large_image();
    for pace in [Pace::LockStep, Pace::Free] {
        let mishap = Some(Mishap::Reset(50_000));
        let mut client = Client::connect(TimedBus::new(pace, mishap)).unwrap();
        client.upload_image(&image, go_on).unwrap();
        assert_eq!(client.status().unwrap().image_crc32, cathforce_bus::service::crc32(&image));
    }
}

impl TimedBus {
    /// With the cable in its place again.
    fn mended(self) -> Self {
        Self { mishap: None, last: None, ..self }
    }
}
