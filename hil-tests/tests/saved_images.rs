//! P15 and P16 on the board: what it has saved is there after a reset, the newest image that is whole; what was
//! only applied is gone. Slots are damaged by the debugger.

use cathforce_bundle::ImageOptions;
use cathforce_bus::service::{self, HostEndpoint, MAX_REQUEST, Request, SavedState, crc32};
use cathforce_bus::{Command, Id, Process};
use cathforce_config::Settings;
use cathforce_control::{Fault, Mode};
use cathforce_hil_tests::lab::{HANG, Lab};
use cathforce_hil_tests::{Bench, Drive, encoder, image_with, small_image};
use cathforce_link::qemu::BoardOptions;
use cathforce_link::{Link as _, SavedImage};
use cathforce_storage::{Layout, Store};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

/// A short insertion, so that settling ends soon.
const START: Drive = Drive { insertion_m: 0.012, rotation_rad: 0.0 };
/// Ticks after which a board counts a saved image as one that it can boot with, and a few more.
const PROVEN_TICKS: usize = 1010;

/// The board's flash (`firmware/src/board/mps2_an500/flash.rs`): a slot \[bytes\], and where in it an image
/// begins.
const SLOT: u32 = (2 << 20) + (128 << 10);
const IMAGE: u32 = 256;

/// Another image than [`small_image`]: another gain.
fn other_image() -> Vec<u8> {
    let settings = Settings { force_gain: 0.5, ..Settings::default() };
    image_with(&ImageOptions { cell_m: 2e-3, settings, ..ImageOptions::default() })
}

/// What is saved, as the device says.
fn saved(bench: &mut Bench<Lab>) -> SavedImage {
    bench.client_mut().saved().expect("an answer").expect("the board can save")
}

fn save(bench: &mut Bench<Lab>, image: &[u8]) {
    bench.upload(image).expect("nothing is armed");
    bench.client_mut().save_image().expect("saved");
}

/// The board after somebody has pressed its button.
fn reset(mut bench: Bench<Lab>) -> Bench<Lab> {
    bench.link_mut().reset();
    bench.again()
}

/// The digest of all outputs of a short insertion.
fn digest_of_a_run(bench: &mut Bench<Lab>) -> u32 {
    bench.arm(START);
    let steps = (0..100).map(|i| {
        vec![encoder(Drive { insertion_m: START.insertion_m + 2e-5 * f64::from(i), ..START })]
    });
    bench.play(steps);
    bench.report().digest
}

/// Flips a bit of the image in each slot that holds this one, and says how many.
fn damage(lab: &mut Lab, image: &[u8]) -> usize {
    let flash = lab.symbols.address("_saved_images");
    // The memory holds the complement. Header and settings tell one image from the other.
    let stored: Vec<u8> = image.iter().map(|byte| !byte).collect();
    let (front, middle) = (&stored[..1024], stored.len() / 2);
    let slots = [0, SLOT].map(|slot| flash + slot + IMAGE);
    let holding: Vec<u32> =
        slots.into_iter().filter(|&at| lab.debugger.read(at, front.len()) == front).collect();
    for at in &holding {
        lab.debugger.write(at + middle as u32, &[stored[middle] ^ 0x10]);
    }
    holding.len()
}

#[test]
fn p15_what_was_saved_is_there_after_a_reset_and_computes_the_same() {
    let image = other_image();
    let mut bench = Bench::<Lab>::configured(&image);
    assert_eq!(saved(&mut bench).state, SavedState::Empty);
    let before = digest_of_a_run(&mut bench);
    // Output is on: nothing is saved.
    bench.client_mut().save_image().expect_err("the board is armed");
    assert_eq!(saved(&mut bench).state, SavedState::Empty);
    bench.play([vec![Process::Command(Command::Disarm), encoder(START)]]);
    bench.play(vec![vec![encoder(START)]; 30]);
    bench.client_mut().save_image().expect("disarmed");

    let mut bench = reset(bench);
    assert_eq!(bench.report().image_crc32, crc32(&image));
    assert_eq!(bench.client_mut().read_image(|_| usize::MAX).expect("an image"), image);
    let on_trial = saved(&mut bench);
    let expected = SavedImage {
        state: SavedState::Good,
        image_crc32: crc32(&image),
        on_trial: true,
        refused: String::new(),
    };
    assert_eq!(on_trial, expected);
    assert_eq!(digest_of_a_run(&mut bench), before, "another digest after the reset");

    // It has run for a second; the watchdog's reset keeps it too.
    bench.play(vec![vec![encoder(START)]; PROVEN_TICKS]);
    assert!(!saved(&mut bench).on_trial, "{:?}", saved(&mut bench));
    bench.grant_ticks(22);
    let lab = bench.link_mut();
    let task = lab.poll_of("service::serve");
    let patch = lab.patch(task, HANG);
    lab.run_to(lab.symbols.address("cathforce_reset"));
    lab.run_to(lab.symbols.address("Reset"));
    lab.mend(&patch);
    lab.debugger.go_on();
    let mut bench = bench.again();
    let record = bench.client_mut().crash().expect("an answer").expect("a record");
    assert_eq!(record.fault, Some(Fault::Hang));
    assert_eq!(saved(&mut bench), SavedImage { on_trial: false, ..expected });
    assert_eq!(bench.report().image_crc32, crc32(&image));
}

#[test]
fn p15_what_was_only_applied_is_gone_after_a_reset() {
    let mut bench = Bench::<Lab>::booted();
    save(&mut bench, small_image());
    bench.upload(&other_image()).expect("nothing is armed");
    assert_eq!(bench.report().image_crc32, crc32(&other_image()));
    let mut bench = reset(bench);
    assert_eq!(bench.report().image_crc32, crc32(small_image()));
    assert_eq!(saved(&mut bench).state, SavedState::Good);
}

#[test]
fn p16_a_damaged_slot_falls_back_and_two_lock_the_board() {
    let (old, new) = (small_image(), &other_image()[..]);
    let mut bench = Bench::<Lab>::booted();
    save(&mut bench, old);
    save(&mut bench, new);
    assert_eq!(damage(bench.link_mut(), new), 1);
    let mut bench = reset(bench);
    let found = saved(&mut bench);
    assert_eq!((found.state, found.image_crc32), (SavedState::Fallback, crc32(old)));
    assert_eq!(bench.report().image_crc32, crc32(old));
    assert_eq!(bench.client_mut().read_image(|_| usize::MAX).expect("an image"), old);

    assert_eq!(damage(bench.link_mut(), old), 1);
    let mut bench = reset(bench);
    let found = saved(&mut bench);
    assert_eq!((found.state, found.image_crc32), (SavedState::Lost, 0));
    assert_eq!(bench.report().image_crc32, 0, "it has no configuration");
    assert_locked_until_cleared(&mut bench, old);

    // Saved again, it is as new.
    bench.client_mut().save_image().expect("disarmed");
    let mut bench = reset(bench);
    assert_eq!(saved(&mut bench).state, SavedState::Good);
    bench.arm(START);
}

/// The fault holds the board, whatever image it gets, until it is cleared by its name.
fn assert_locked_until_cleared(bench: &mut Bench<Lab>, image: &[u8]) {
    let fault = Fault::SavedImageLost;
    bench.upload(image).expect("nothing is armed");
    let mode = |bench: &mut Bench<Lab>, command| {
        let ticks = bench.play([vec![encoder(START), Process::Command(command)]]);
        assert!(ticks[0].is_silent());
        ticks[0].mode()
    };
    let latched = Some(Mode::Fault { cause: fault });
    for command in [Command::SelfTest, Command::Arm] {
        assert_eq!(mode(bench, command), latched, "{command:?}");
    }
    let token = fault.clear_token();
    assert_eq!(mode(bench, Command::ClearFault { token }), Some(Mode::Boot));
}

/// A flash on this computer, in which the store lays out what is put into the board's.
struct Memory(Vec<u8>);

impl ErrorType for Memory {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Memory {
    const READ_SIZE: usize = 1;

    fn read(&mut self, at: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        bytes.copy_from_slice(&self.0[at as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Memory {
    const WRITE_SIZE: usize = 32;
    const ERASE_SIZE: usize = 128 << 10;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.0[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, at: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        self.0[at as usize..][..bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

#[test]
fn p16_a_saved_image_of_another_version_is_refused_by_name() {
    /// Where an image states the hash of its types.
    const SCHEMA: usize = 6;
    let mut older = small_image().to_vec();
    older[SCHEMA] ^= 1;
    let layout = Layout { slots: [0..SLOT, SLOT..2 * SLOT] };
    let mut store = Store::new(Memory(vec![0xFF; 2 * SLOT as usize]), layout).expect("it fits");
    store.save(&older).expect("a flash without faults");
    let slot = &store.into_flash().0[..IMAGE as usize + older.len()];
    let stored: Vec<u8> = slot.iter().map(|byte| !byte).collect();

    let mut bench = Bench::<Lab>::booted();
    let lab = bench.link_mut();
    let flash = lab.symbols.address("_saved_images");
    for (i, bytes) in stored.chunks(1024).enumerate() {
        lab.debugger.write(flash + 1024 * i as u32, bytes);
    }
    let mut bench = reset(bench);
    let found = saved(&mut bench);
    assert_eq!((found.state, found.image_crc32), (SavedState::Lost, 0));
    assert_eq!(found.refused, "made for another version of this firmware");
    assert_locked_until_cleared(&mut bench, small_image());
    // The device takes an image of this version beside it, and boots with that.
    bench.client_mut().save_image().expect("disarmed");
    let mut bench = reset(bench);
    assert_eq!(saved(&mut bench).image_crc32, crc32(small_image()));
}

/// The emulator is killed at a write of the flash, and another one starts with the memory that it leaves.
#[test]
fn p15_a_power_cut_while_the_board_saves_leaves_the_old_image_or_the_new_one() {
    let (old, new) = (small_image(), &other_image()[..]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let memory = folder.path().join("memory");
    let before = folder.path().join("before");
    let boot = || {
        let memory = Some(memory.clone());
        let options = BoardOptions { reboots: true, memory, ..BoardOptions::default() };
        let mut lab = Lab::start_with(options);
        lab.debugger.go_on();
        Bench::over(lab)
    };
    let mut bench = boot();
    save(&mut bench, old);
    bench.upload(new).expect("nothing is armed");
    drop(bench);
    std::fs::copy(&memory, &before).expect("a copy");

    let len = new.len() as u32;
    // A byte is written when it is erased, and a second time when it gets its value; those of the header do so
    // last.
    let (erased, written) = (1, 2);
    let cuts = [(0, erased), (IMAGE + len / 2, erased), (IMAGE + len / 2, written), (31, written)];
    let (mut kept, mut lost_power) = (0, 0);
    for (i, (cut, writes)) in cuts.into_iter().enumerate() {
        std::fs::copy(&before, &memory).expect("a copy");
        let mut bench = boot();
        assert_eq!(bench.report().image_crc32, crc32(old), "cut {cut}");
        bench.upload(new).expect("nothing is armed");
        let lab = bench.link_mut();
        let at = lab.symbols.address("_saved_images") + SLOT + cut;
        lab.debugger.go_on_to_write(at);
        let request = service::seal::<_, MAX_REQUEST>(i as u8 + 99, &Request::SaveImage);
        let mut endpoint = HostEndpoint::new(Id::ServiceRequest.raw(), 0);
        endpoint.send(&request.expect("it fits")).expect("nothing is under way");
        lab.send(&endpoint.next_frame(0).expect("a single frame")).expect("sent");
        lab.flush().expect("sent");
        lab.debugger.wait_until_stopped();
        for _ in 1..writes {
            lab.debugger.go_on();
            lab.debugger.wait_until_stopped();
        }
        drop(bench);

        let mut bench = boot();
        let found = saved(&mut bench);
        let used = bench.report().image_crc32;
        assert!([crc32(old), crc32(new)].contains(&used), "cut {cut}: {found:?}");
        assert_eq!(found.image_crc32, used, "cut {cut}");
        kept += u32::from(used == crc32(old));
        lost_power += 1;
        if i + 1 == cuts.len() {
            // The board saves again as if nothing had been.
            save(&mut bench, new);
            let mut bench = reset(bench);
            assert_eq!(bench.report().image_crc32, crc32(new), "after cut {cut}");
        }
    }
    println!(
        "figure P15: {lost_power} power cuts on the board, after {kept} the old image, else the new one"
    );
    assert!(kept > 0, "no cut came before the new image was complete");
}
