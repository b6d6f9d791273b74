//! P21: versions that do not match → the host refuses to arm and names both.

use std::path::Path;
use std::time::Duration;

use cathforce_bus::service::{self, DeviceEndpoint, Hello, PROTOCOL_HASH, Request, Response};
use cathforce_bus::{Counters, Frame, Id, MODE_UNCONFIGURED};
use cathforce_link::qemu::{Qemu, find_firmware};
use cathforce_link::{Client, ClientError, Link, LinkError, Sim, build_of, version_and_build};

/// A device of another version, which answers `Hello` and nothing else.
struct OtherVersion {
    endpoint: DeviceEndpoint,
    protocol_hash: u64,
}

impl Link for OtherVersion {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let Some(Id::ServiceRequest) = Id::from_raw(frame.id()) else {
            return Ok(());
        };
        let request = self.endpoint.receive(frame, &mut Counters::default());
        let Some((sequence, Request::Hello)) = request.and_then(|m| service::open(m).ok()) else {
            return Ok(());
        };
        let hello = Response::Hello(Hello {
            protocol_hash: self.protocol_hash,
            image_schema_hash: 0,
            firmware: "9.8.7",
            board: "future",
            can_lock_step: true,
            max_image_len: 1000,
            mode: MODE_UNCONFIGURED,
            next_counters: [0; 6],
        });
        let answer = service::seal::<_, { service::MAX_RESPONSE }>(sequence, &hello);
        self.endpoint.send(&answer.expect("fits")).expect("fits");
        Ok(())
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        Ok(())
    }

    fn receive(&mut self, _: Duration) -> Result<Option<Frame>, LinkError> {
        Ok(self.endpoint.next_frame(0))
    }

    fn name(&self) -> &str {
        "other"
    }
}

#[test]
fn p21_a_device_of_another_protocol_is_refused_and_both_are_named() {
    for protocol_hash in [0, PROTOCOL_HASH ^ 1, !PROTOCOL_HASH] {
        let block = service::BLOCK_SIZE;
        let endpoint = DeviceEndpoint::new(Id::ServiceResponse.raw(), block);
        let other = OtherVersion { endpoint, protocol_hash };
        let error = Client::connect(other).err().expect("refused");
        assert!(matches!(error, ClientError::Protocol { .. }), "{error}");
        let (ours, theirs) = (format!("{PROTOCOL_HASH:016x}"), format!("{protocol_hash:016x}"));
        for word in [&*ours, &*theirs, "future", "9.8.7", env!("CARGO_PKG_VERSION")] {
            assert!(error.to_string().contains(word), "`{word}` in: {error}");
        }
    }
    assert!(Client::connect(Sim::new()).is_ok());
}

/// Board and host compute the same build identifier, from flash and from the ELF.
#[test]
fn the_board_says_which_build_it_runs() {
    let client =
        Client::connect(Qemu::boot(None).unwrap_or_else(|e| panic!("{e}"))).expect("boots");
    let firmware = client.device().firmware.clone();
    let elf = find_firmware(None).expect("it was booted");
    let build = build_of(&elf).expect("firmware");
    assert_eq!(version_and_build(&firmware), (env!("CARGO_PKG_VERSION"), Some(&*build)));
    // Changing the last loaded byte changes the build.
    let folder = tempfile::tempdir().expect("a temporary folder");
    let other = folder.path().join("other.elf");
    let mut bytes = std::fs::read(&elf).expect("an ELF");
    // So does a byte inside the code, whose segment comes first.
    bytes[0x10_000 + 0x2000] ^= 1;
    std::fs::write(&other, bytes).expect("written");
    assert_ne!(build_of(&other).expect("still firmware"), build);
    assert_eq!(build_of(Path::new("/no/such.elf")), None);
}
