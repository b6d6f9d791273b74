//! The packets of the protocol RDT (raw data transfer). Source: ATI's manual 9620-05, chapter "UDP
//! Interface Using RDT"; every number has its highest byte first.

const REQUEST: u16 = 0x1234;
const STOP: u16 = 0;
/// Packets as they are measured, without end.
const STREAM: u16 = 2;
pub(super) const PACKET_BYTES: usize = 36;

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Packet {
    /// Counts the packets since the stream began.
    pub(super) sequence: u32,
    pub(super) status: u32,
    /// Forces in counts.
    pub(super) counts: [i32; 3],
}

pub(super) fn start() -> [u8; 8] {
    request(STREAM)
}

pub(super) fn stop() -> [u8; 8] {
    request(STOP)
}

fn request(command: u16) -> [u8; 8] {
    let mut bytes = [0; 8];
    bytes[..2].copy_from_slice(&REQUEST.to_be_bytes());
    bytes[2..4].copy_from_slice(&command.to_be_bytes());
    // The last four are the number of packets; 0 is without end.
    bytes
}

impl Packet {
    /// `None` for bytes of another length.
    pub(super) fn read(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; PACKET_BYTES] = bytes.try_into().ok()?;
        let word = |at: usize| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| bytes[4 * at + k]);
            u32::from_be_bytes([a, b, c, d])
        };
        Some(Self {
            sequence: word(0),
            // Word 1 counts the measurements inside of the sensor.
            status: word(2),
            counts: [3, 4, 5].map(|at| word(at).cast_signed()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_are_as_the_manual_has_them() {
        assert_eq!(start(), [0x12, 0x34, 0, 2, 0, 0, 0, 0]);
        assert_eq!(stop(), [0x12, 0x34, 0, 0, 0, 0, 0, 0]);
        let mut bytes = [0; PACKET_BYTES];
        bytes[3] = 7;
        bytes[8] = 0x80;
        bytes[12..16].copy_from_slice(&[0xFF, 0xFF, 0xFF, 0xFE]);
        bytes[20..24].copy_from_slice(&[0, 1, 0, 0]);
        let packet = Packet { sequence: 7, status: 0x8000_0000, counts: [-2, 0, 65536] };
        assert_eq!(Packet::read(&bytes), Some(packet));
        assert_eq!(Packet::read(&bytes[..35]), None);
    }
}
