//! The faults that a device has had, kept until somebody acknowledges them.

use cathforce_control::Fault;
use serde::Serialize;

/// A fault that was seen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Latched {
    pub name: &'static str,
    pub code: u8,
    pub cause: &'static str,
    pub next: &'static str,
    /// Milliseconds since 1970.
    pub first_ms: u64,
    pub last_ms: u64,
    /// How often it began.
    pub count: u32,
    /// The device has it now.
    pub active: bool,
    #[serde(skip)]
    fault: Fault,
}

/// All that were seen and not acknowledged, the newest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Faults(Vec<Latched>);

impl Faults {
    /// The device's fault now, at this time since 1970 \[ms\].
    pub fn see(&mut self, now: Option<Fault>, unix_ms: u64) {
        for latched in &mut self.0 {
            if Some(latched.fault) != now {
                latched.active = false;
            }
        }
        let Some(fault) = now else { return };
        let at = self.0.iter().position(|latched| latched.fault == fault);
        let mut latched = at.map_or_else(
            || Latched {
                name: fault.name(),
                code: fault.code(),
                cause: fault.cause(),
                next: fault.next_step(),
                first_ms: unix_ms,
                last_ms: unix_ms,
                count: 0,
                active: false,
                fault,
            },
            |at| self.0.remove(at),
        );
        latched.count += u32::from(!latched.active);
        latched.active = true;
        latched.last_ms = unix_ms;
        self.0.insert(0, latched);
    }

    /// Takes a fault from the list; `false` if it is not there.
    pub fn acknowledge(&mut self, fault: Fault) -> bool {
        let before = self.0.len();
        self.0.retain(|latched| latched.fault != fault);
        self.0.len() < before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_stays_until_it_is_acknowledged_and_counts_how_often_it_began() {
        let mut faults = Faults::default();
        faults.see(None, 1);
        assert_eq!(faults, Faults::default());
        faults.see(Some(Fault::EncoderLost), 2);
        faults.see(Some(Fault::EncoderLost), 3);
        faults.see(None, 4);
        faults.see(Some(Fault::BusOff), 5);
        faults.see(Some(Fault::EncoderLost), 6);
        let said = faults.0.iter().map(|f| (f.name, f.first_ms, f.last_ms, f.count, f.active));
        let said = said.collect::<Vec<_>>();
        assert_eq!(said, [("EncoderLost", 2, 6, 2, true), ("BusOff", 5, 5, 1, false)]);
        assert!(faults.acknowledge(Fault::EncoderLost) && !faults.acknowledge(Fault::Overrun));
        assert_eq!(faults.0.len(), 1);
    }
}
