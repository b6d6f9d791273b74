//! Fatal faults: switch the outputs off, send the log, reset.

use core::arch::naked_asm;
use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;

use crate::{board, log};

fn end() -> ! {
    log::flush_in_fault();
    SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    board::outputs_off();
    defmt::error!("{}", defmt::Display2Format(info));
    end()
}

/// The stack may have overflowed, so the handler starts over at its top. The old contents are lost.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "cpsid i",
        "mov r0, sp",
        "ldr r1, =_stack_start",
        "mov sp, r1",
        "b {}",
        sym hard_fault,
    )
}

extern "C" fn hard_fault(stack_pointer: u32) -> ! {
    board::outputs_off();
    // SAFETY: reads of status registers.
    let (hard, configurable, address) = unsafe {
        let scb = &*SCB::PTR;
        (scb.hfsr.read(), scb.cfsr.read(), scb.mmfar.read())
    };
    if crate::stack::is_overflow(stack_pointer) {
        defmt::error!("stack overflow");
    }
    defmt::error!(
        "hard fault: HFSR {=u32:08x}, CFSR {=u32:08x}, address {=u32:08x}, stack {=u32:08x}",
        hard,
        configurable,
        address,
        stack_pointer
    );
    end()
}

/// First time-out of the watchdog: no tick has run for 10 ms.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    cortex_m::interrupt::disable();
    board::outputs_off();
    defmt::error!("watchdog: the tick hangs");
    end()
}

#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) {
    panic!("exception {number}, which nobody handles");
}
