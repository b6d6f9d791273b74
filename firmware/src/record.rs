//! What the device writes down before it resets itself. It lies in memory that no boot initialises.

use core::fmt::{self, Write};

use cathforce_bus::service::{Crash, MAX_CRASH_TEXT, crc32};
use cathforce_control::Fault;

const MAGIC: u32 = 0xCF_C0_1D_01;

unsafe extern "C" {
    /// Linker symbol: memory for one record, at the end of the RAM.
    static mut _crash_record: Record;
}

/// Layout of the memory. The CRC covers everything before it.
#[derive(Clone, Copy)]
#[repr(C)]
struct Record {
    magic: u32,
    fault: u32,
    resets: u32,
    tick: u32,
    time_us: u32,
    program_counter: u32,
    link_register: u32,
    status: u32,
    address: u32,
    hung_tasks: u32,
    len: u32,
    text: [u8; MAX_CRASH_TEXT],
    crc: u32,
}

/// Where the processor was.
#[derive(Clone, Copy, Default)]
pub struct At {
    pub program_counter: u32,
    pub link_register: u32,
    pub status: u32,
    pub address: u32,
}

/// The registers that the processor pushes when an exception begins.
#[repr(C)]
pub struct Pushed {
    registers: [u32; 5],
    link_register: u32,
    program_counter: u32,
}

impl At {
    /// Where an exception came from. `stack_pointer`: that at its begin.
    pub fn pushed(stack_pointer: u32) -> Self {
        // SAFETY: the processor has pushed them there, or has failed to: any bits are a number.
        let pushed = unsafe { &*(stack_pointer as *const Pushed) };
        let Pushed { link_register, program_counter, .. } = *pushed;
        Self { program_counter, link_register, ..Self::default() }
    }
}

impl Record {
    fn bytes(&self) -> &[u8] {
        // SAFETY: `repr(C)` of words and bytes, without padding: its length is a multiple of 4.
        unsafe {
            core::slice::from_raw_parts((&raw const *self).cast(), core::mem::offset_of!(Self, crc))
        }
    }

    fn is_valid(&self) -> bool {
        self.magic == MAGIC
            && self.crc == crc32(self.bytes())
            && self.len as usize <= MAX_CRASH_TEXT
    }
}

fn load() -> Record {
    // SAFETY: memory of this record alone; any bits are a record, and a wrong CRC says that they are none.
    unsafe { (&raw const _crash_record).read_volatile() }
}

/// The record of the last reset by the device itself; `None` if it was switched on.
pub fn read() -> Option<Crash<'static>> {
    let record = load();
    if !record.is_valid() {
        return None;
    }
    // SAFETY: nobody writes to the record any more until the next fault, from which nobody returns.
    let text: &'static [u8] = unsafe {
        let text = &raw const _crash_record.text;
        &*text
    };
    let text = text.get(..record.len as usize).and_then(|text| core::str::from_utf8(text).ok());
    Some(Crash {
        fault: record.fault as u8,
        resets: record.resets,
        tick: record.tick,
        time_us: record.time_us,
        program_counter: record.program_counter,
        link_register: record.link_register,
        status: record.status,
        address: record.address,
        hung_tasks: record.hung_tasks as u8,
        text: text.unwrap_or(""),
    })
}

/// Writes a record. `write`: its text, which is cut where it gets too long.
pub fn write(
    fault: Fault,
    at: At,
    (tick, time_us): (u32, u32),
    hung_tasks: u8,
    write: impl FnOnce(&mut Text) -> fmt::Result,
) {
    let before = load();
    let resets = if before.is_valid() { before.resets.saturating_add(1) } else { 1 };
    let mut text = Text { bytes: [0; MAX_CRASH_TEXT], len: 0 };
    // A text that does not fit is cut, which is no reason not to reset.
    let _ = write(&mut text);
    let mut record = Record {
        magic: MAGIC,
        fault: u32::from(fault.code()),
        resets,
        tick,
        time_us,
        program_counter: at.program_counter,
        link_register: at.link_register,
        status: at.status,
        address: at.address,
        hung_tasks: u32::from(hung_tasks),
        len: text.len as u32,
        text: text.bytes,
        crc: 0,
    };
    record.crc = crc32(record.bytes());
    // SAFETY: memory of this record alone, and interrupts are off for good.
    unsafe { (&raw mut _crash_record).write_volatile(record) }
}

/// The text of a record. It takes whole characters, so that it stays UTF-8.
pub struct Text {
    bytes: [u8; MAX_CRASH_TEXT],
    len: usize,
}

impl Write for Text {
    fn write_str(&mut self, s: &str) -> fmt::Result {
        for c in s.chars() {
            let end = self.len + c.len_utf8();
            let Some(place) = self.bytes.get_mut(self.len..end) else { return Err(fmt::Error) };
            c.encode_utf8(place);
            self.len = end;
        }
        Ok(())
    }
}
