//! The stack: a guard region below it, and paint to measure its use.

use cortex_m::peripheral::MPU;

/// Size of the guard region at the bottom \[bytes\]. A power of two that no function's frame but those
/// of the boot exceeds, so that none can step over it. When an overflow is noticed the processor pushes
/// its registers into it.
const GUARD_BYTES: u32 = 16384;
const PAINT: u32 = 0xC0DE_CAFE;
/// Bytes below the stack pointer that are not painted, for the painter's own frame.
const MARGIN_BYTES: u32 = 256;
/// Depth that [`measure`] paints \[bytes\]: twice what a tick may take.
const MEASURED_BYTES: u32 = 8192;

unsafe extern "C" {
    /// Linker symbols: the lowest address of the stack, and the end above its highest.
    static mut _stack_end: u32;
    static mut _stack_start: u32;
}

fn bottom() -> u32 {
    (&raw const _stack_end) as u32 + GUARD_BYTES
}

fn top() -> u32 {
    (&raw const _stack_start) as u32
}

/// Paints the unused stack. Called first in `main`, before interrupts.
pub fn paint() {
    paint_between(bottom(), cortex_m::register::msp::read() - MARGIN_BYTES);
}

fn paint_between(low: u32, high: u32) {
    let mut address = low;
    while address < high {
        // SAFETY: inside the stack's region and below everything in use.
        unsafe { (address as *mut u32).write_volatile(PAINT) };
        address += 4;
    }
}

/// The lowest address from `low` on that is not painted.
fn deepest(low: u32) -> u32 {
    let mut address = low;
    // SAFETY: reads inside the stack's region.
    while address < top() && unsafe { (address as *const u32).read_volatile() } == PAINT {
        address += 4;
    }
    address
}

/// Deepest use so far, and size of the stack \[bytes\].
pub fn use_bytes() -> (u32, u32) {
    (top() - deepest(bottom()), top() - bottom())
}

/// Stack that `work` uses \[bytes\], up to [`MEASURED_BYTES`]. Painting more would take longer than a
/// tick.
pub fn measure(work: impl FnOnce()) -> u32 {
    let in_use = cortex_m::register::msp::read();
    let low = bottom().max(in_use.saturating_sub(MEASURED_BYTES));
    let before = deepest(low);
    paint_between(low, in_use - MARGIN_BYTES);
    work();
    let used = in_use - deepest(low);
    // Keeps the record of an earlier, deeper use that was painted over.
    if before < in_use - MARGIN_BYTES {
        // SAFETY: inside the stack's region and below everything in use.
        unsafe { (before as *mut u32).write_volatile(!PAINT) };
    }
    used
}

/// The stack pointer has left the stack.
pub fn is_overflow(stack_pointer: u32) -> bool {
    stack_pointer < bottom()
}

/// Makes any access to the guard region a fault.
pub fn guard() {
    const REGION_SIZE: u32 = GUARD_BYTES.ilog2() - 1;
    const NO_ACCESS_NO_EXECUTE: u32 = 1 << 28;
    let address = bottom() - GUARD_BYTES;
    // SAFETY: the region holds no data, and the default memory map stays valid elsewhere.
    unsafe {
        let mpu = &*MPU::PTR;
        mpu.rnr.write(0);
        mpu.rbar.write(address);
        mpu.rasr.write(NO_ACCESS_NO_EXECUTE | REGION_SIZE << 1 | 1);
        mpu.ctrl.write(0b101);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
