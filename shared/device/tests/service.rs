//! Service messages: what they do, and which are refused.

mod support;

use cathforce_bus::service::{
    self, Hello, HostEndpoint, MAX_CHUNK, MAX_REQUEST, PROTOCOL_HASH, Refusal, Request, Response,
    Status, crc32,
};
use cathforce_bus::{Counter, Counters, Frame, Id, NextCounters};
use cathforce_device::{Board, Identity, Image, Service, copy_from};
use proptest::prelude::*;

const CAPACITY: usize = 70_000;

#[derive(Default)]
struct FakeBoard {
    armed: bool,
    lock_step: bool,
    /// The image in use.
    image: Option<Vec<u8>>,
    activations: u32,
}

impl Board<Vec<u8>> for FakeBoard {
    fn is_armed(&mut self) -> bool {
        self.armed
    }
    fn status(&mut self) -> Status {
        Status { mode: 3, tick: 77, lock_step: self.lock_step, ..Status::default() }
    }
    fn next_counters(&mut self) -> NextCounters {
        [1, 2, 3, 4, 5, 6]
    }
    fn activate(
        &mut self,
        image: Image<Vec<u8>>,
    ) -> Result<Option<Vec<u8>>, (Vec<u8>, Refusal<'static>)> {
        self.activations += 1;
        self.image = Some(image.bytes().to_vec());
        Ok(Some(image.into_parts().0))
    }
    fn set_lock_step(&mut self, on: bool) -> Result<(), Refusal<'static>> {
        self.lock_step = on;
        Ok(())
    }
    fn reset_counters(&mut self) {}
    fn read_image(&mut self, offset: usize, into: &mut [u8]) -> Option<usize> {
        Some(copy_from(self.image.as_ref()?, offset, into))
    }
}

struct Bench {
    service: Service<Vec<u8>>,
    board: FakeBoard,
    host: HostEndpoint,
    sequence: u8,
}

impl Bench {
    fn new() -> Self {
        let identity = Identity {
            firmware: "1.2.3",
            board: "fake",
            can_lock_step: true,
            max_image_len: CAPACITY as u32,
        };
        Self {
            service: Service::new(identity, vec![0; CAPACITY]),
            board: FakeBoard::default(),
            host: HostEndpoint::new(Id::ServiceRequest.raw(), 0),
            sequence: 0,
        }
    }

    fn ask(&mut self, request: Request) -> Reply {
        self.sequence = self.sequence.wrapping_add(1);
        self.ask_again(request)
    }

    /// With the sequence number of the request before.
    fn ask_again(&mut self, request: Request) -> Reply {
        let bytes = service::seal::<_, MAX_REQUEST>(self.sequence, &request).unwrap();
        self.ask_bytes(&bytes).unwrap()
    }

    fn ask_bytes(&mut self, bytes: &[u8]) -> Option<Reply> {
        self.host.send(bytes).unwrap();
        let mut reply = None;
        loop {
            let mut silent = true;
            while let Some(frame) = self.host.next_frame(0) {
                silent = false;
                self.service.on_frame(&frame, &mut self.board);
            }
            while let Some(frame) = self.service.next_frame(0) {
                silent = false;
                if let Some(message) = self.host.receive(&frame, &mut Counters::default()) {
                    reply = Some(Reply(message.to_vec()));
                }
            }
            if silent {
                return reply;
            }
        }
    }

    fn upload(&mut self, image: &[u8], len: u32, crc32: u32) -> Reply {
        assert_eq!(self.ask(Request::BeginImage { len, crc32 }).response(), Response::Done);
        for (i, bytes) in image.chunks(MAX_CHUNK).enumerate() {
            let offset = (i * MAX_CHUNK) as u32;
            let reply = self.ask(Request::ImageChunk { offset, bytes });
            assert_eq!(reply.response(), Response::Done, "{offset}");
        }
        self.ask(Request::Activate)
    }

    /// CRC-32 of the image that the device says it uses.
    fn image_in_use(&mut self) -> u32 {
        match self.ask(Request::GetStatus).response() {
            Response::Status(status) => status.image_crc32,
            other => panic!("{other:?}"),
        }
    }

    fn upload_whole(&mut self, image: &[u8]) -> Reply {
        self.upload(image, image.len() as u32, crc32(image))
    }
}

struct Reply(Vec<u8>);

impl Reply {
    fn response(&self) -> Response<'_> {
        service::open(&self.0).unwrap().1
    }
}

fn refused(refusal: Refusal<'static>) -> Response<'static> {
    Response::Refused(refusal)
}

#[test]
fn a_device_says_who_and_how_it_is() {
    let mut bench = Bench::new();
    let reply = bench.ask(Request::Hello);
    let Response::Hello(hello) = reply.response() else { panic!() };
    let expected = Hello {
        protocol_hash: PROTOCOL_HASH,
        image_schema_hash: cathforce_config::image::schema_hash(),
        firmware: "1.2.3",
        board: "fake",
        can_lock_step: true,
        max_image_len: CAPACITY as u32,
        mode: 3,
        next_counters: [1, 2, 3, 4, 5, 6],
    };
    assert_eq!(hello, expected);
    let reply = bench.ask(Request::GetStatus);
    let Response::Status(status) = reply.response() else { panic!() };
    assert_eq!((status.mode, status.tick), (3, 77));
    assert!(status.counters.get(Counter::Segment) > 0);
    assert_eq!(bench.ask(Request::SetLockStep { on: true }).response(), Response::Done);
    assert!(bench.board.lock_step);
    bench.ask(Request::ResetCounters);
    assert_eq!(bench.service.counters().iter().map(|(_, n)| n).sum::<u32>(), 0);
}

#[test]
fn images_arrive_as_they_were_sent_and_replace_each_other() {
    let mut bench = Bench::new();
    let image = support::image();
    for n in 1..=3 {
        assert_eq!(bench.upload_whole(&image).response(), Response::Done);
        assert_eq!(bench.board.activations, n);
        assert_eq!(bench.board.image.as_ref(), Some(&image));
    }
}

#[test]
fn a_wrong_upload_is_refused_whole_and_the_next_one_is_taken() {
    let image = support::image();
    let (len, crc) = (image.len() as u32, crc32(&image));
    let mut bench = Bench::new();
    assert_eq!(bench.image_in_use(), 0);
    assert_eq!(bench.upload_whole(&image).response(), Response::Done);
    assert_eq!(bench.image_in_use(), crc);

    let none = refused(Refusal::NoUpload);
    assert_eq!(bench.ask(Request::Activate).response(), none);
    assert_eq!(bench.ask(Request::ImageChunk { offset: 0, bytes: &[1] }).response(), none);

    let begin = |len| Request::BeginImage { len, crc32: crc };
    let too_long = refused(Refusal::TooLong { capacity: CAPACITY as u32 });
    assert_eq!(bench.ask(begin(CAPACITY as u32 + 1)).response(), too_long);

    let wrong_crc = bench.upload(&image, len, !crc);
    assert_eq!(wrong_crc.response(), refused(Refusal::Crc { expected: !crc, computed: crc }));

    bench.ask(begin(100));
    let chunk = |offset, bytes| Request::ImageChunk { offset, bytes };
    let wanted = |expected| refused(Refusal::Offset { expected });
    assert_eq!(bench.ask(chunk(1, &[0; 9])).response(), wanted(0));
    assert_eq!(bench.ask(chunk(0, &[0; 99])).response(), Response::Done);
    assert_eq!(bench.ask(chunk(0, &[0; 1])).response(), wanted(99));
    assert_eq!(bench.ask(chunk(99, &[0; 2])).response(), wanted(99));
    assert_eq!(bench.ask(chunk(u32::MAX, &[0; 2])).response(), wanted(99));
    let incomplete = Refusal::Incomplete { expected: 100, received: 99 };
    assert_eq!(bench.ask(Request::Activate).response(), refused(incomplete));

    assert_eq!((bench.board.activations, bench.image_in_use()), (1, crc));
    assert_eq!(bench.upload_whole(&image).response(), Response::Done);
    assert_eq!(bench.board.activations, 2);
}

#[test]
fn p16_an_image_that_is_wrong_inside_is_refused_with_byte_and_reason() {
    let image = support::image();
    let mut bench = Bench::new();
    let mut reason = |edit: &dyn Fn(&mut Vec<u8>)| {
        let mut wrong = image.clone();
        edit(&mut wrong);
        let reply = bench.upload_whole(&wrong);
        assert_eq!(bench.board.activations, 0);
        match reply.response() {
            Response::Refused(Refusal::Image { offset, reason, .. }) => (offset, reason.to_owned()),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(reason(&|i| i[0] = b'X'), (0, "does not begin with CFIM".into()));
    assert_eq!(reason(&|i| i[4] = 99).0, 4);
    assert_eq!(reason(&|i| i[7] ^= 1).0, 6);
    assert_eq!(reason(&|i| i[17] = 0xFF).0, 14);
    assert_eq!(reason(&|i| i.truncate(10)).0, 10);
    assert_eq!(reason(&|i| i.truncate(60_000)).0, 10);
    let last = image.len() - 1;
    assert_eq!(reason(&|i| i[last] ^= 1).0, 18);
    // Every check fits, but a directory entry names a brick that is not there.
    let (offset, text) = reason(&|i| {
        i[last] = 0;
        let crc = crc32(&i[22..]);
        i[18..22].copy_from_slice(&crc.to_le_bytes());
    });
    assert_eq!(
        (offset as usize, text),
        (last - 1, "lumen names a brick that is not stored".into())
    );
}

#[test]
fn p17_nothing_changes_while_armed() {
    let image = support::image();
    let mut bench = Bench::new();
    bench.upload_whole(&image);
    for armed_at in 0..3 {
        let mut requests = vec![
            Request::BeginImage { len: 4, crc32: 0 },
            Request::ImageChunk { offset: 0, bytes: &[1, 2, 3, 4] },
            Request::Activate,
        ];
        for (i, request) in requests.drain(..).enumerate() {
            bench.board.armed = i >= armed_at;
            let reply = bench.ask(request);
            let is_refused = reply.response() == refused(Refusal::Armed);
            assert_eq!(is_refused, bench.board.armed, "{request:?}");
        }
        let reply = bench.ask(Request::SetLockStep { on: true });
        assert_eq!(reply.response(), refused(Refusal::Armed));
        assert!(matches!(bench.ask(Request::GetStatus).response(), Response::Status(_)));
        assert_eq!((bench.board.activations, bench.board.lock_step), (1, false));
    }
}

#[test]
fn a_request_whose_answer_was_lost_is_answered_again_and_done_once() {
    let image = support::image();
    let mut bench = Bench::new();
    assert_eq!(bench.upload_whole(&image).response(), Response::Done);
    assert_eq!(bench.ask_again(Request::Activate).response(), Response::Done);
    assert_eq!(bench.board.activations, 1);
    assert_eq!(bench.service.counters().get(Counter::MessageRepeat), 1);
}

#[test]
fn messages_that_are_none_of_ours_are_counted() {
    let mut bench = Bench::new();
    let mut unknown = vec![5, 99];
    unknown.extend(crc32(&unknown).to_le_bytes());
    assert_eq!(bench.ask_bytes(&unknown).unwrap().response(), refused(Refusal::Unknown));
    assert!(bench.ask_bytes(&[1, 2, 3, 4, 5, 6]).is_none());
    assert!(bench.ask_bytes(&[1, 2]).is_none());
    assert_eq!(bench.service.counters().get(Counter::MessageBroken), 3);
}

proptest! {
    /// P03 for the service id: any frames are counted, and none of them activates an image.
    #[test]
    fn p03_any_service_frames_change_nothing(
        frames in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..=8), 0..300),
    ) {
        let mut bench = Bench::new();
        for data in frames {
            bench.service.on_frame(&Frame::new(0x600, &data).unwrap(), &mut bench.board);
            bench.service.next_frame(0);
        }
        prop_assert_eq!(bench.board.activations, 0);
        prop_assert!(!bench.board.lock_step);
        while bench.service.next_frame(0).is_some() {}
        prop_assert!(matches!(bench.ask(Request::Hello).response(), Response::Hello(_)));
    }
}

#[test]
fn the_image_in_use_is_read_back_part_by_part() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask(Request::ReadImage { offset: 0 }).response(), refused(Refusal::NoImage));
    let image = support::image();
    assert_eq!(bench.upload_whole(&image).response(), Response::Done);
    let mut read = Vec::new();
    loop {
        let reply = bench.ask(Request::ReadImage { offset: read.len() as u32 });
        match reply.response() {
            Response::ImageBytes([]) => break,
            Response::ImageBytes(bytes) => read.extend_from_slice(bytes),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(read, image);
    // Also while armed: nothing changes by it.
    bench.board.armed = true;
    let reply = bench.ask(Request::ReadImage { offset: u32::MAX });
    assert_eq!(reply.response(), Response::ImageBytes(&[]));
}
