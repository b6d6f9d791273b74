//! A bus without CAN: one program listens, the others join.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use cathforce_bus::{Encoder, Frame, Id, Insertion, Rotation};
use cathforce_link::{Client, Hub, Link, LinkError, Served, Sim, Slcan, Step, serve};

/// Long enough for a busy computer.
const SOON: Duration = Duration::from_secs(20);

fn hub() -> (Hub, String) {
    let hub = Hub::listen("test", "127.0.0.1:0").unwrap();
    let address = hub.name().trim_start_matches("slcan:listen:").to_owned();
    (hub, address)
}

fn join(address: &str) -> Slcan {
    Slcan::connect("member", address).unwrap()
}

fn frame(id: u32, number: u32) -> Frame {
    Frame::new(id, &number.to_be_bytes()).unwrap()
}

/// Sends until it is heard: a member that has connected may not have been taken in yet.
fn introduce(from: &mut dyn Link, to: &mut dyn Link) {
    let hello = frame(0x7FF, 0);
    let deadline = Instant::now() + SOON;
    while Instant::now() < deadline {
        // Before the first member has joined, this program is alone.
        let _ = from.send(&hello).and_then(|()| from.flush());
        if to.receive(Duration::from_millis(20)).unwrap() == Some(hello) {
            while to.receive(Duration::from_millis(50)).unwrap().is_some() {}
            return;
        }
    }
    panic!("nobody was heard");
}

fn send(link: &mut dyn Link, frames: &[Frame]) {
    frames.iter().for_each(|frame| link.send(frame).unwrap());
    link.flush().unwrap();
}

#[track_caller]
fn expect(link: &mut dyn Link, frames: &[Frame]) {
    for frame in frames {
        assert_eq!(link.receive(SOON).unwrap(), Some(*frame));
    }
}

#[test]
fn a_frame_reaches_everyone_but_its_sender() {
    let (mut hub, address) = hub();
    let (mut a, mut b) = (join(&address), join(&address));
    introduce(&mut a, &mut hub);
    introduce(&mut b, &mut hub);
    introduce(&mut hub, &mut a);
    introduce(&mut hub, &mut b);
    while b.receive(Duration::from_millis(50)).unwrap().is_some() {}
    while a.receive(Duration::from_millis(50)).unwrap().is_some() {}

    let [of_a, of_b, of_hub] =
        [0x100, 0x200, 0x300].map(|id| (0..100).map(|n| frame(id, n)).collect::<Vec<_>>());
    send(&mut a, &of_a);
    expect(&mut hub, &of_a);
    expect(&mut b, &of_a);
    send(&mut b, &of_b);
    expect(&mut hub, &of_b);
    expect(&mut a, &of_b);
    send(&mut hub, &of_hub);
    expect(&mut a, &of_hub);
    expect(&mut b, &of_hub);
    for link in [&mut a as &mut dyn Link, &mut b, &mut hub] {
        assert_eq!(link.receive(Duration::from_millis(50)).unwrap(), None, "nobody hears himself");
    }
    assert_eq!(hub.dropped(), 0);

    // Who leaves disturbs nobody, and who joins later hears what comes then.
    drop(a);
    let mut late = join(&address);
    introduce(&mut late, &mut hub);
    while b.receive(Duration::from_millis(50)).unwrap().is_some() {}
    send(&mut hub, &of_hub);
    expect(&mut b, &of_hub);
    expect(&mut late, &of_hub);
}

#[test]
fn what_a_member_does_not_read_is_dropped_for_it_alone_and_counted() {
    let (mut hub, address) = hub();
    let mut quick = join(&address);
    introduce(&mut quick, &mut hub);
    introduce(&mut hub, &mut quick);
    // It never reads: the socket's buffers fill first, then its queue.
    let mut slow = TcpStream::connect(&address).unwrap();
    slow.write_all(b"t7FF400000000\r").unwrap();
    expect(&mut hub, &[frame(0x7FF, 0)]);
    expect(&mut quick, &[frame(0x7FF, 0)]);

    let mut sent = 0;
    while hub.dropped() == 0 {
        assert!(sent < 4_000_000, "{sent} frames fit into no buffer");
        let frames: Vec<_> = (sent..sent + 1000).map(|n| frame(0x123, n)).collect();
        send(&mut hub, &frames);
        expect(&mut quick, &frames);
        sent += 1000;
    }
    // What it does get are whole frames in their order, of which the last ones are missing.
    let dropped = hub.dropped();
    drop(slow.try_clone().unwrap());
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        slow.read_to_string(&mut text).unwrap();
        text
    });
    std::thread::sleep(Duration::from_millis(200));
    drop(hub);
    let text = reader.join().unwrap();
    let numbers = text.split('\r').filter_map(|line| {
        let number = line.strip_prefix("t1234")?;
        Some(u32::from_str_radix(number, 16).unwrap())
    });
    let numbers: Vec<_> = numbers.collect();
    assert!(numbers.iter().copied().eq(0..numbers.len() as u32));
    assert_eq!(numbers.len() as u64 + dropped, u64::from(sent));
}

#[test]
fn a_bus_that_everybody_has_left_says_so_and_goes_on() {
    let (mut hub, address) = hub();
    let error = hub.send(&frame(1, 1)).unwrap_err();
    assert!(matches!(error, LinkError::Alone { .. }), "{error}");
    let mut member = join(&address);
    introduce(&mut member, &mut hub);
    drop(member);
    let deadline = Instant::now() + SOON;
    while hub.send(&frame(1, 1)).and_then(|()| hub.flush()).is_ok() {
        assert!(Instant::now() < deadline, "it is not alone");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(hub.receive(Duration::from_millis(1)).unwrap(), None);
    introduce(&mut join(&address), &mut hub);
}

#[test]
fn two_programs_cannot_listen_on_one_port() {
    let (hub, address) = hub();
    let error = Hub::listen("second", &address).err().unwrap().to_string();
    assert!(error.contains("no other program listens on this port"), "{error}");
    let error = cathforce_link::check_address(&format!("slcan:listen:{address}")).unwrap_err();
    assert!(error.to_string().contains("slcan:tcp:HOST:PORT"), "{error}");
    drop(hub);
    cathforce_link::check_address("slcan:listen:0").unwrap();
}

/// An answer to every command, as an adapter gives it.
#[test]
fn members_are_answered_as_by_an_adapter() {
    let (_hub, address) = hub();
    let mut member = TcpStream::connect(&address).unwrap();
    member.set_read_timeout(Some(SOON)).unwrap();
    member.write_all(b"C\rS8\rO\rnonsense\r").unwrap();
    let wanted = b"\rC\rS8\rO\r\r\r\r\x07";
    let mut heard = [0; 12];
    member.read_exact(&mut heard).unwrap();
    assert_eq!(&heard, wanted);
}

/// Device, host and a listener on one bus, in lock step and running free.
#[test]
fn a_device_a_host_and_a_listener_meet() {
    let (mut hub, address) = hub();
    let stop = AtomicBool::new(false);
    let (served, heard) = std::thread::scope(|scope| {
        let device = scope.spawn(|| serve(&mut hub, &mut Sim::new(), &stop));
        let mut listener = join(&address);
        let mut client = Client::connect(join(&address)).unwrap();
        let encoder =
            Encoder { insertion: Insertion::from_m(0.05), rotation: Rotation::from_rad(0.5) };
        let step = Step { encoder: Some(encoder), ..Step::default() };
        for lock_step in [true, false] {
            client.set_lock_step(lock_step).unwrap();
            let mut ticks = 0;
            let steps = (0..200).map(|_| step);
            let count = |_: &_| {
                ticks += 1;
                ControlFlow::Continue(())
            };
            assert_eq!(client.play(steps, count).unwrap(), 200);
            // Running free, a busy computer may miss some.
            assert!(if lock_step { ticks == 200 } else { ticks > 50 }, "{ticks} {lock_step}");
        }
        drop(client);
        stop.store(true, Ordering::Relaxed);
        let served = device.join().unwrap().unwrap();
        let mut heard = Vec::new();
        while let Ok(Some(frame)) = listener.receive(Duration::from_millis(200)) {
            heard.push(frame);
        }
        (served, heard)
    });
    let count = |id: Id| heard.iter().filter(|frame| frame.id() == id.raw()).count();
    assert_eq!(count(Id::Encoder), 400, "of the host");
    assert_eq!(count(Id::Sync), 200, "of the host");
    assert!(count(Id::Haptic) > 250, "of the device");
    let Served { received, sent, dropped, .. } = served;
    assert!(received > 600 && sent > 500 && dropped == 0, "{served:?}");
}
