//! Fatal faults: switch the outputs off, write a record, send the log, reset.
//!
//! Every handler does these in this order, on a stack of its own, with interrupts off.

use core::arch::naked_asm;
use core::fmt::Write as _;
use core::panic::PanicInfo;

use cathforce_control::Fault;
use cortex_m::peripheral::SCB;

use crate::record::{self, At};
use crate::{board, device, log, stack, watch};

/// Writes the record and resets. The outputs are off already.
fn end(
    fault: Fault,
    at: At,
    hung: u8,
    text: impl FnOnce(&mut record::Text) -> core::fmt::Result,
) -> ! {
    record::write(fault, at, (device::ticks(), board::time_us()), hung, text);
    log::flush_in_fault();
    reset()
}

/// The last function that runs before a reset.
#[inline(never)]
#[unsafe(no_mangle)]
extern "C" fn cathforce_reset() -> ! {
    SCB::sys_reset()
}

fn reset() -> ! {
    cathforce_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    board::outputs_off();
    defmt::error!("{}", defmt::Display2Format(info));
    let at = At { link_register: cortex_m::register::lr::read(), ..At::default() };
    end(Fault::Panic, at, 0, |text| {
        if let Some(place) = info.location() {
            write!(text, "{}:{}: ", place.file(), place.line())?;
        }
        write!(text, "{}", info.message())
    })
}

/// Calls a function with the stack pointer at the begin of an exception, on the stack of faults. The stack
/// in use may have overflowed.
macro_rules! on_its_own_stack {
    ($name:ident => $handler:ident) => {
        #[unsafe(naked)]
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $name() -> ! {
            naked_asm!(
                "cpsid i",
                "mov r0, sp",
                "ldr r1, =_fault_stack_start",
                "mov sp, r1",
                "b {}",
                sym $handler,
            )
        }
    };
}

on_its_own_stack!(HardFault => hard_fault);
on_its_own_stack!(NonMaskableInt => watchdog);

extern "C" fn hard_fault(stack_pointer: u32) -> ! {
    board::outputs_off();
    // SAFETY: reads of status registers.
    let (hard, configurable, address) = unsafe {
        let scb = &*SCB::PTR;
        (scb.hfsr.read(), scb.cfsr.read(), scb.mmfar.read())
    };
    let overflow = stack::is_overflow(stack_pointer);
    defmt::error!(
        "{=str}: HFSR {=u32:08x}, CFSR {=u32:08x}, address {=u32:08x}, stack {=u32:08x}",
        if overflow { "stack overflow" } else { "hard fault" },
        hard,
        configurable,
        address,
        stack_pointer
    );
    // Below the stack's end the processor may have pushed nothing.
    let pushed = if overflow { At::default() } else { At::pushed(stack_pointer) };
    let at = At { status: configurable, address, ..pushed };
    let fault = if overflow { Fault::StackOverflow } else { Fault::HardFault };
    end(fault, at, 0, |text| write!(text, "HFSR {hard:08x}, stack pointer {stack_pointer:08x}"))
}

/// First time-out of the watchdog: for 10 ms the tick or a task has not run.
extern "C" fn watchdog(stack_pointer: u32) -> ! {
    board::outputs_off();
    let (bits, names) = watch::hung();
    defmt::error!("watchdog: tasks {=u8:b} hang; none of them: the tick", bits);
    end(Fault::Hang, At::pushed(stack_pointer), bits, |text| {
        if bits == 0 {
            return text.write_str("tick");
        }
        for (i, name) in names.enumerate() {
            write!(text, "{}{name}", if i > 0 { ", " } else { "" })?;
        }
        Ok(())
    })
}

#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) {
    panic!("exception {number}, which nobody handles");
}
