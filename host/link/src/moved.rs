//! A link on whose bus the protocol's identifiers lie elsewhere.

use std::time::Duration;

use cathforce_bus::{Frame, Placement};

use crate::{Link, LinkError};

/// What introduces the base in an address: `socketcan:can0,id-base=0x12345`.
pub(crate) const SUFFIX: &str = ",id-base=";

/// Moves identifiers on their way to the bus and back, so that everybody behind it sees them in their usual places.
pub struct Moved {
    link: Box<dyn Link>,
    placement: Placement,
    name: String,
}

impl Moved {
    pub fn new(link: Box<dyn Link>, placement: Placement, name: &str) -> Self {
        Self { link, placement, name: name.into() }
    }
}

impl Link for Moved {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.link.send(&self.placement.exchange(*frame))
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        self.link.flush()
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        let frame = self.link.receive(timeout)?;
        Ok(frame.map(|frame| self.placement.exchange(frame)))
    }

    fn waited(&self) -> Option<Duration> {
        self.link.waited()
    }

    fn dropped(&self) -> u64 {
        self.link.dropped()
    }

    fn name(&self) -> &str {
        &self.name
    }
}

/// An address without the base of moved identifiers.
pub fn carrier(address: &str) -> &str {
    address.rsplit_once(SUFFIX).map_or(address, |(carrier, _)| carrier)
}

/// An address without its base, and where the identifiers lie. `Err` says what is wrong with the base.
pub(crate) fn placement(address: &str) -> Result<(&str, Placement), &'static str> {
    let Some((carrier, base)) = address.rsplit_once(SUFFIX) else {
        return Ok((address, Placement::default()));
    };
    Placement::read(base)
        .map(|placement| (carrier, placement))
        .ok_or("after `id-base=` comes a number from 0 to 0x3FFFF, the upper 18 of 29 bits")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Client, Sim};

    #[test]
    fn the_base_is_the_end_of_an_address() {
        let at = |base| Placement::at(base).unwrap();
        assert_eq!(
            placement("socketcan:can0,id-base=0x12345"),
            Ok(("socketcan:can0", at(0x12345)))
        );
        assert_eq!(placement("qemu,id-base=7"), Ok(("qemu", at(7))));
        assert_eq!(placement("qemu:a,b.elf"), Ok(("qemu:a,b.elf", Placement::default())));
        for wrong in ["sim,id-base=", "sim,id-base=0x40000", "sim,id-base=-1", "sim,id-base=x"] {
            assert!(placement(wrong).unwrap_err().contains("0x3FFFF"), "{wrong}");
        }
    }

    /// A device is found where it is, and a host that looks elsewhere does not hear it.
    #[test]
    fn a_device_is_heard_where_its_identifiers_lie() {
        let device = |base| Moved::new(Box::new(Sim::new()), Placement::at(base).unwrap(), "sim");
        let host = |base| Moved::new(Box::new(device(5)), Placement::at(base).unwrap(), "host");
        assert!(Client::connect(host(5)).is_ok());
        let error = Client::connect(host(6)).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("host: nothing heard"), "{error}");
    }
}
