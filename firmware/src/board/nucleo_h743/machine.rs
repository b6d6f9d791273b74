//! Clocks, tick timer, watchdogs and outputs of the board.

use core::ops::Range;

use cathforce_control::FORCE_HARD_N;
use cortex_m::peripheral::{DWT, Peripherals};
use embassy_stm32::dac::{DacChannel, Value};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::pac;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk,
    VoltageScale, mux,
};
use embassy_stm32::time::Hertz;

use super::can::{self, BusIn, BusOut};
use super::flash::{self, SecondBank};
use super::interrupts;
use super::log::LogOut;
use crate::board::interface::{Board, BootOptions};

/// TIM2, TIM5 and TIM6 count at 200 MHz / 8: 40 ns, as on the emulated board.
const COUNTS_A_SECOND: u32 = 25_000_000;
const PRESCALER: u16 = 8 - 1;
const TICK_COUNTS: u32 = COUNTS_A_SECOND / 1000;
/// The first stage of the watchdog ends 10 ms after the last feed. It counts tens of microseconds.
const FIRST_STAGE_PRESCALER: u16 = 2000 - 1;
const FIRST_STAGE_COUNTS: u16 = 1000;
/// Reload value of the independent watchdog at 32 kHz / 4: 18 ms. Its oscillator may be 6 % off.
const SECOND_STAGE: u16 = 144;
/// The same while the board boots: half a second.
const SECOND_STAGE_AT_BOOT: u16 = 4000;
/// PF3, Arduino's D8: the enable line of the motor drives. It needs a resistor to ground, which holds it while
/// the processor is in reset.
const ENABLE_PIN: usize = 3;
/// The converter has 12 bits. Its middle stands for no force, its ends for the largest that any settings allow.
const CONVERTER_MIDDLE: f32 = 2048.0;

/// Ports of the tasks.
pub struct Ports {
    pub bus_in: BusIn,
    pub bus_out: BusOut,
    pub log_out: LogOut,
}

/// The board. Its existence proves that it has been started.
#[derive(Clone, Copy)]
pub struct NucleoH743(());

/// Sets up clocks, caches, peripherals and interrupts. Called once, by `main`.
///
/// `tick`: called by the tick timer's interrupt, which nothing can interrupt.
pub fn start(tick: fn()) -> (NucleoH743, Ports) {
    watch(SECOND_STAGE_AT_BOOT);
    let p = embassy_stm32::init(clocks());
    // The memory of the second image buffer has its clock off after a reset.
    pac::RCC.ahb2enr().modify(|w| {
        w.set_sram1en(true);
        w.set_sram2en(true);
        w.set_sram3en(true);
    });
    // SAFETY: called once, before anything else uses them.
    let mut core = unsafe { Peripherals::steal() };
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
    core.DCB.enable_trace();
    DWT::unlock();
    core.DWT.enable_cycle_counter();

    // The line and the converter stay as they are set up: nobody drops them.
    core::mem::forget(Output::new(p.PF3, Level::Low, Speed::Low));
    let mut converter = DacChannel::new_blocking(p.DAC1, p.PA4);
    converter.set(Value::Bit12Right(CONVERTER_MIDDLE as u16));
    core::mem::forget(converter);

    start_counters();
    interrupts::enable(tick);
    let (bus_in, bus_out) = can::start(p.FDCAN1, p.PD0, p.PD1);
    let log_out = match LogOut::new(p.USART3, p.PD8) {
        Ok(log) => log,
        Err(_) => panic!("the log's bit rate does not fit its clock"),
    };
    (NucleoH743(()), Ports { bus_in, bus_out, log_out })
}

/// 400 MHz for the core, 200 MHz for buses and timers, 100 MHz for the CAN controller, all from the 8 MHz that
/// the ST-LINK gives: the chip's own oscillator is not exact enough for a bus of 1 Mbit/s.
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
    rcc.pll1 = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV1,
        mul: PllMul::MUL100,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV8),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV2;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    rcc.voltage_scale = VoltageScale::Scale1;
    rcc.mux.fdcansel = mux::Fdcansel::PLL1_Q;
    config
}

/// Sets up the timers. TIM5 runs from here on.
fn start_counters() {
    pac::RCC.apb1lenr().modify(|w| {
        w.set_tim2en(true);
        w.set_tim5en(true);
        w.set_tim6en(true);
    });
    for (timer, reload) in [(pac::TIM2, TICK_COUNTS - 1), (pac::TIM5, u32::MAX)] {
        timer.psc().write_value(PRESCALER);
        timer.arr().write_value(reload);
        // Loads the prescaler, and is no tick.
        timer.egr().write(|w| w.set_ug(true));
        timer.sr().modify(|w| w.set_uif(false));
        timer.dier().modify(|w| w.set_uie(true));
    }
    pac::TIM5.cr1().modify(|w| w.set_cen(true));
    let first = pac::TIM6;
    first.psc().write_value(FIRST_STAGE_PRESCALER);
    first.arr().write(|w| w.set_arr(FIRST_STAGE_COUNTS - 1));
    first.egr().write(|w| w.set_ug(true));
    first.sr().modify(|w| w.set_uif(false));
    first.dier().modify(|w| w.set_uie(true));
}

/// Starts the independent watchdog, or gives it another time.
fn watch(reload: u16) {
    use pac::iwdg::vals::{Key, Pr};
    pac::IWDG1.kr().write(|w| w.set_key(Key::START));
    pac::IWDG1.kr().write(|w| w.set_key(Key::ENABLE));
    pac::IWDG1.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    pac::IWDG1.rlr().write(|w| w.set_rl(reload));
    pac::IWDG1.kr().write(|w| w.set_key(Key::RESET));
}

/// Gives both stages of the watchdog their whole time again.
pub fn feed_watchdog() {
    pac::TIM6.egr().write(|w| w.set_ug(true));
    pac::TIM6.sr().modify(|w| w.set_uif(false));
    pac::IWDG1.kr().write(|w| w.set_key(pac::iwdg::vals::Key::RESET));
}

/// Removes the power of the motor drives. Safe in any state, also before [`start`], when the pin is an input.
pub fn outputs_off() {
    pac::GPIOF.bsrr().write(|w| w.set_br(ENABLE_PIN, true));
}

/// Time since boot, wrapping \[µs\].
pub fn time_us() -> u32 {
    pac::TIM5.cnt().read() / (COUNTS_A_SECOND / 1_000_000)
}

impl Board for NucleoH743 {
    const COUNTS_A_SECOND: u32 = COUNTS_A_SECOND;
    /// The two buffers are the memories of the first and the second domain; the smaller one has 288 KiB.
    const IMAGE_BUFFER_LEN: usize = 280 << 10;
    const SAVED_IMAGES: [Range<u32>; 2] = flash::SLOTS;
    type Flash = SecondBank;

    fn flash(self, working: fn()) -> SecondBank {
        SecondBank::new(working)
    }

    fn name(self) -> &'static str {
        "nucleo-h743zi2"
    }

    fn can_lock_step(self) -> bool {
        false
    }

    fn time(self) -> u32 {
        pac::TIM5.cnt().read()
    }

    fn lateness(self) -> u32 {
        // The timer counts up from 0, where the tick is due.
        let late = pac::TIM2.cnt().read();
        pac::TIM2.sr().modify(|w| w.set_uif(false));
        late
    }

    fn tick_pending(self) -> bool {
        pac::TIM2.sr().read().uif()
    }

    fn instructions(self, _counts: u32) -> u32 {
        0
    }

    fn cycles(self) -> u32 {
        DWT::cycle_count()
    }

    fn show_force(self, force_n: f32) {
        let share = (force_n / FORCE_HARD_N).clamp(-1.0, 1.0);
        let value = CONVERTER_MIDDLE + share * (CONVERTER_MIDDLE - 1.0);
        pac::DAC1.dhr12r(0).write(|w| w.set_dhr(value as u16));
    }

    fn start_ticks(self) {
        watch(SECOND_STAGE);
        feed_watchdog();
        pac::TIM6.cr1().modify(|w| w.set_cen(true));
        pac::TIM2.cr1().modify(|w| w.set_cen(true));
    }

    /// Ticks are never held: this board has no lock step.
    fn hold_ticks(self) {}

    fn alive(self) {
        feed_watchdog();
    }

    /// The controller's queues bound what a bus can bring.
    fn renew_input(self) {}

    fn enable_outputs(self, on: bool) {
        pac::GPIOF
            .bsrr()
            .write(|w| if on { w.set_bs(ENABLE_PIN, true) } else { w.set_br(ENABLE_PIN, true) });
    }

    fn boot_options(self) -> BootOptions {
        BootOptions::default()
    }

    fn run(self, _: BootOptions) {
        self.start_ticks();
    }

    fn idle(self) {
        cortex_m::asm::wfi();
    }
}
