//! A device image over a bus whose time is counted: how fast, and what becomes of it when it is
//! cut.

#[path = "../../../shared/control/tests/support/wire.rs"]
#[allow(dead_code)]
mod wire;

use std::ops::ControlFlow;
use std::time::Duration;

use cathforce_bus::{Direction, Frame};
use cathforce_config::{ImageHead, Settings, image};
use cathforce_link::{Client, ClientError, Link, LinkError, Sim};
use cathforce_mechanics::{FREE, LumenHeader};

/// What host and device each may take to answer a frame \[µs\]: a USB adapter, a task on a board.
const TURNAROUND_US: f64 = 300.0;
/// Bits a second are bits a microsecond.
const BITS_A_US: f64 = 1.0;
/// Of the bus's time, carrying the image's frames.
const LEAST_SHARE: f64 = 0.70;

/// A device at the other end of 1 Mbit/s.
struct TimedBus {
    device: Sim,
    last: Option<Direction>,
    /// Time in which the bus carried frames, and in which everybody waited \[µs\].
    busy_us: f64,
    idle_us: f64,
    mishap: Option<Mishap>,
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
    fn new(mishap: Option<Mishap>) -> Self {
        let device = Sim::in_lock_step();
        Self { device, last: None, busy_us: 0.0, idle_us: 0.0, mishap }
    }

    fn carry(&mut self, direction: Direction, frame: &Frame) {
        if self.last.replace(direction).is_some_and(|last| last != direction) {
            self.idle_us += TURNAROUND_US;
        }
        self.busy_us += f64::from(frame.most_bits()) / BITS_A_US;
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
        self.carry(Direction::ToDevice, frame);
        self.device.send(frame)
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        let frame = self.device.receive(timeout.min(Duration::from_millis(1)))?;
        if let Some(frame) = &frame {
            self.carry(Direction::ToHost, frame);
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
    let head = ImageHead { description: wire::wire(), lumen, settings, master: Default::default() };
    let bytes = FREE.to_le_bytes().repeat(80 * 80 * 80);
    let mut made = vec![0; image::encoded_len(&head, &bytes).unwrap()];
    image::encode(&head, &bytes, &mut made).unwrap();
    made
}

fn go_on(_: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

#[test]
fn an_image_of_1_mb_takes_at_least_70_percent_of_the_bus() {
    let image = large_image();
    assert!(image.len() > 1_000_000);
    let mut client = Client::connect(TimedBus::new(None)).unwrap();
    let mut reported = Vec::new();
    client
        .upload_image(&image, |sent| {
            reported.push(sent);
            ControlFlow::Continue(())
        })
        .unwrap();
    assert!(reported.is_sorted() && reported.last() == Some(&image.len()), "progress");
    let TimedBus { busy_us, idle_us, .. } = *client.link();
    let share = busy_us / (busy_us + idle_us);
    println!(
        "{} bytes in {:.1} s of 1 Mbit/s, {:.0} % of it carrying frames ({} µs a turn)",
        image.len(),
        1e-6 * (busy_us + idle_us),
        100.0 * share,
        TURNAROUND_US
    );
    assert!(share >= LEAST_SHARE, "{share}");
}

/// The host's end is cut; another program begins again and the device knows how far it was.
#[test]
fn an_upload_that_was_cut_goes_on_where_it_was() {
    let image = large_image();
    let mut client = Client::connect(TimedBus::new(Some(Mishap::Cut(50_000)))).unwrap();
    let error = client.upload_image(&image, go_on).unwrap_err();
    assert!(matches!(error, ClientError::Link(LinkError::Lost { .. })), "{error}");

    let mut client = Client::connect(client.into_link().mended()).unwrap();
    let mut reported = Vec::new();
    client
        .upload_image(&image, |sent| {
            reported.push(sent);
            ControlFlow::Continue(())
        })
        .unwrap();
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
    let mishap = Some(Mishap::Reset(50_000));
    let mut client = Client::connect(TimedBus::new(mishap)).unwrap();
    client.upload_image(&image, go_on).unwrap();
    assert_eq!(client.status().unwrap().image_crc32, cathforce_bus::service::crc32(&image));
}

impl TimedBus {
    /// With the cable in its place again.
    fn mended(self) -> Self {
        Self { mishap: None, last: None, ..self }
    }
}
