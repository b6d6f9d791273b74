//! The log on USART3, polled: nothing waits for it.

use core::future::poll_fn;
use core::task::Poll;

use embassy_stm32::Peri;
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac;
use embassy_stm32::peripherals::{PD8, USART3};
use embassy_stm32::usart::{Config, ConfigError, UartTx};

/// 115 200 bit/s, which the ST-LINK takes.
const BAUD: u32 = 115_200;

/// Output of the log.
pub struct LogOut {
    /// Keeps the UART configured.
    _uart: UartTx<'static, Blocking>,
}

impl LogOut {
    pub fn new(uart: Peri<'static, USART3>, pin: Peri<'static, PD8>) -> Result<Self, ConfigError> {
        let mut config = Config::default();
        config.baudrate = BAUD;
        Ok(Self { _uart: UartTx::new_blocking(uart, pin, config)? })
    }

    /// Writes what there is room for. A byte without room is polled for when the watch asks.
    pub async fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            poll_fn(|_| if write(byte) { Poll::Ready(()) } else { Poll::Pending }).await;
        }
    }
}

/// Writes from a fault. Returns `false` if the UART does not get done: the reset must not wait for it.
pub fn emergency_log(byte: u8) -> bool {
    /// A byte takes 87 µs; an attempt takes a few cycles of the peripheral's bus.
    const ATTEMPTS: u32 = 10_000;
    (0..ATTEMPTS).any(|_| write(byte))
}

/// Writes a byte if there is room for it.
fn write(byte: u8) -> bool {
    if !pac::USART3.isr().read().txe() {
        return false;
    }
    pac::USART3.tdr().write(|w| w.set_dr(u16::from(byte)));
    true
}
