//! Registers of the board's CMSDK peripherals, as far as they are used.
//!
//! Source: Arm, *Cortex-M System Design Kit Technical Reference Manual*, and application
//! note AN500 for the addresses.

use volatile_register::{RO, RW, WO};

/// CMSDK APB UART.
#[repr(C)]
pub struct Uart {
    /// Received byte, or the byte to send.
    pub data: RW<u32>,
    /// Bit 0: transmit buffer full; bit 1: receive buffer full.
    pub state: RW<u32>,
    /// Bit 0: transmit; bit 1: receive; bit 2: transmit interrupt; bit 3: receive interrupt.
    pub control: RW<u32>,
    /// Bit 0: transmit interrupt; bit 1: receive interrupt. Ones clear.
    pub interrupt: RW<u32>,
    /// Clock over baud rate, 16 or more.
    pub baud_divider: RW<u32>,
}

/// CMSDK APB timer: counts down and reloads.
#[repr(C)]
pub struct Timer {
    /// Bit 0: run; bit 3: interrupt.
    pub control: RW<u32>,
    pub value: RW<u32>,
    pub reload: RW<u32>,
    /// Bit 0. One clears.
    pub interrupt: RW<u32>,
}

/// CMSDK APB watchdog: interrupt at the first time-out, reset at the second.
#[repr(C)]
pub struct Watchdog {
    pub load: RW<u32>,
    pub value: RO<u32>,
    /// Bit 0: interrupt and counter; bit 1: reset.
    pub control: RW<u32>,
    /// Any write reloads the counter.
    pub interrupt_clear: WO<u32>,
}

/// The board's FPGA system registers.
#[repr(C)]
pub struct FpgaIo {
    /// Bits 0 and 1: the user LEDs.
    pub leds: RW<u32>,
    _reserved: [u32; 5],
    /// Counts up at 25 MHz over `prescale` + 1.
    pub counter: RW<u32>,
    pub prescale: RW<u32>,
}

/// Defines access to a peripheral at its address.
macro_rules! peripheral {
    ($name:ident: $block:ty = $address:literal) => {
        pub fn $name() -> &'static $block {
            // SAFETY: a peripheral of this board, and all registers are volatile.
            unsafe { &*($address as *const $block) }
        }
    };
}

peripheral!(timer0: Timer = 0x4000_0000);
peripheral!(uart0: Uart = 0x4000_4000);
peripheral!(uart1: Uart = 0x4000_5000);
peripheral!(watchdog: Watchdog = 0x4000_8000);
peripheral!(fpga_io: FpgaIo = 0x4002_8000);
