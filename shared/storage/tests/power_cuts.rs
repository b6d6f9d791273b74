//! P15 and P16: a power cut at every word and every erase, torn words, bit rot, images on trial.

mod support;

use cathforce_storage::{Found, Layout, SaveError, State, Store, TRIALS};
use support::{BLOCK, Failure, Flash};

/// Blocks of a slot. The image begins behind the first one, which has room for header and marks.
const SLOT: usize = 4;
const IMAGE: usize = 256;
/// Ways in which a word or a block can be torn.
const SEEDS: u64 = 8;

fn flash() -> Flash {
    Flash::new(2 * SLOT)
}

fn store(flash: Flash) -> Store<Flash> {
    let at = |block: usize| (block * BLOCK) as u32;
    let layout = Layout { slots: [at(0)..at(SLOT), at(SLOT)..at(2 * SLOT)] };
    Store::new(flash, layout).expect("whole blocks")
}

/// An image whose bytes depend on `n`; the last word is not full.
fn image(n: u8) -> Vec<u8> {
    (0..2 * BLOCK + 37).map(|i| (i as u8).wrapping_mul(31).wrapping_add(n)).collect()
}

/// What a boot finds, and the bytes.
fn boot(flash: Flash) -> (Found, Vec<u8>, Flash) {
    let mut store = store(flash.powered());
    let mut into = vec![0; SLOT * BLOCK];
    let found = store.load(&mut into, |_| true).expect("the power is on");
    into.truncate(found.len);
    (found, into, store.into_flash())
}

/// A flash that has seen so many confirmed images, the last of which is `image(images)`.
fn used(images: u8) -> Flash {
    (1..=images).fold(flash(), |flash, n| {
        let mut store = store(flash);
        store.save(&image(n)).expect("saved");
        store.confirm().expect("recorded");
        store.into_flash()
    })
}

#[test]
fn p15_a_power_cut_at_every_word_and_every_erase_leaves_the_old_image_or_the_new_one() {
    let (mut cuts, mut kept_old) = (0, 0);
    for before in [0, 1, 2, 3] {
        let old = used(before);
        let mut whole = store(Flash { done: 0, ..old.clone() });
        whole.save(&image(99)).expect("nothing is cut");
        let whole = whole.into_flash();
        let operations = whole.done;
        assert_eq!(boot(whole).1, image(99), "nothing is cut");
        assert!(operations > image(99).len() / 4);
        for cut in 0..operations {
            for seed in 0..SEEDS {
                let mut cut_short = store(Flash { fuel: Some(cut), done: 0, seed, ..old.clone() });
                assert_eq!(cut_short.save(&image(99)), Err(SaveError::Flash(Failure::PowerCut)));
                let (found, bytes, after) = boot(cut_short.into_flash());
                let is_old = bytes == if before == 0 { Vec::new() } else { image(before) };
                assert!(
                    is_old || bytes == image(99),
                    "cut {cut} of {operations} after {before} images"
                );
                // A slot that was cut short is told.
                let expected = if before == 0 && is_old {
                    [State::Empty, State::Lost]
                } else {
                    [State::Good, State::Fallback]
                };
                assert!(expected.contains(&found.state), "cut {cut}: {found:?}");
                // The next image is taken as if nothing had been.
                let mut again = store(after);
                assert_eq!(again.save(&image(77)), Ok(()), "after cut {cut}, {before} images");
                assert_eq!(boot(again.into_flash()).1, image(77));
                cuts += 1;
                kept_old += usize::from(is_old);
            }
        }
    }
    println!(
        "figure P15: {cuts} power cuts, {kept_old} left the old image and {} the new",
        cuts - kept_old
    );
    assert!(kept_old > 0);
}

#[test]
fn p15_a_power_cut_while_a_trial_is_counted_or_confirmed_loses_no_image() {
    let mut saved = store(used(3));
    saved.save(&image(4)).expect("saved");
    let on_trial = saved.into_flash();
    for cut in 0..40 {
        for seed in 0..SEEDS {
            let mut tried = store(Flash { fuel: Some(cut), done: 0, seed, ..on_trial.clone() });
            // Whether the load or the confirmation is cut, or neither, the image stays.
            let _ = tried.load(&mut vec![0; SLOT * BLOCK], |_| true);
            let _ = tried.confirm();
            let (found, bytes, _) = boot(tried.into_flash());
            assert_eq!((found.state, bytes == image(4)), (State::Good, true), "cut {cut}");
        }
    }
}

#[test]
fn p16_every_flipped_bit_of_an_image_falls_back_to_the_one_before() {
    let good = used(2);
    let slot_of = |flash: &Flash, n| {
        (0..2).position(|slot| flash.bytes[slot * SLOT * BLOCK + IMAGE..].starts_with(&image(n)))
    };
    let newest = slot_of(&good, 2).expect("the newest image is in a slot") * SLOT * BLOCK + IMAGE;
    for bit in 0..8 * image(2).len() {
        let mut rotten = good.clone();
        rotten.bytes[newest + bit / 8] ^= 1 << (bit % 8);
        let (found, bytes, _) = boot(rotten);
        assert_eq!((found.state, bytes == image(1)), (State::Fallback, true), "bit {bit}");
    }
}

#[test]
fn p16_both_slots_bad_are_reported_and_an_image_can_be_saved_again() {
    let mut rotten = used(2);
    for slot in 0..2 {
        rotten.bytes[slot * SLOT * BLOCK + IMAGE] ^= 1;
    }
    let (found, _, flash) = boot(rotten);
    assert_eq!(found, Found { state: State::Lost, len: 0, on_trial: false });
    let mut store = store(flash);
    assert_eq!(store.save(&image(3)), Ok(()));
    let (found, bytes, _) = boot(store.into_flash());
    assert_eq!((found.state, bytes), (State::Good, image(3)));
}

/// An image that this program cannot read is passed over, takes no trial, and is the one that the next save
/// overwrites: at no time is there no image that can be read.
#[test]
fn p16_an_image_that_is_not_accepted_is_passed_over_and_overwritten() {
    let mut flash = used(2);
    let readable = |bytes: &[u8]| bytes != image(2);
    for _ in 0..=TRIALS {
        let mut store = store(flash.powered());
        let mut into = vec![0; SLOT * BLOCK];
        let found = store.load(&mut into, readable).expect("the power is on");
        into.truncate(found.len);
        assert_eq!((found.state, into == image(1)), (State::Fallback, true));
        flash = store.into_flash();
    }
    let operations = {
        let mut store = store(Flash { done: 0, ..flash.clone() });
        store.load(&mut vec![0; SLOT * BLOCK], readable).expect("the power is on");
        store.save(&image(3)).expect("nothing is cut");
        store.into_flash().done
    };
    for cut in 0..operations {
        let mut cut_short = store(Flash { fuel: Some(cut), done: 0, ..flash.clone() });
        cut_short.load(&mut vec![0; SLOT * BLOCK], readable).expect("a load writes nothing here");
        cut_short.save(&image(3)).expect_err("the power is cut");
        let mut store = store(cut_short.into_flash().powered());
        let mut into = vec![0; SLOT * BLOCK];
        let found = store.load(&mut into, readable).expect("the power is on");
        into.truncate(found.len);
        assert!(into == image(1) || into == image(3), "cut {cut} of {operations}: {found:?}");
    }
}

/// Any flipped bit of headers and marks: never a wrong image, and never none.
#[test]
fn p16_every_flipped_bit_of_a_header_gives_one_of_the_saved_images() {
    let good = used(2);
    for slot in 0..2 {
        for bit in 0..8 * IMAGE {
            let mut rotten = good.clone();
            rotten.bytes[slot * SLOT * BLOCK + bit / 8] ^= 1 << (bit % 8);
            let (found, bytes, _) = boot(rotten);
            let known = bytes == image(2) || bytes == image(1);
            assert!(known, "slot {slot}, bit {bit}: {found:?}");
        }
    }
}

#[test]
fn an_image_that_never_proves_itself_is_left_for_the_last_good_one() {
    let mut store = store(used(1));
    store.save(&image(2)).expect("saved");
    let mut flash = store.into_flash();
    for boots in 0..TRIALS {
        let (found, bytes, after) = boot(flash);
        assert_eq!((found.on_trial, bytes == image(2)), (true, true), "boot {boots}");
        flash = after;
    }
    let (found, bytes, _) = boot(flash);
    assert_eq!(found, Found { state: State::Fallback, len: image(1).len(), on_trial: false });
    assert_eq!(bytes, image(1));
}

#[test]
fn a_confirmed_image_needs_no_more_trials() {
    let mut flash = used(1);
    for _ in 0..=2 * TRIALS {
        let (found, bytes, after) = boot(flash);
        assert_eq!((found.state, found.on_trial, bytes == image(1)), (State::Good, false, true));
        flash = after;
    }
}

#[test]
fn what_does_not_fit_is_refused_and_layouts_are_checked() {
    let mut full = store(used(1));
    let room = SLOT * BLOCK - IMAGE;
    let capacity = room as u32;
    assert_eq!(full.save(&vec![7; room + 1]), Err(SaveError::TooLong { capacity }));
    assert_eq!(full.save(&vec![7; room]), Ok(()));
    assert_eq!(boot(full.into_flash()).1, vec![7; room]);

    let slots = |a: [usize; 2], b: [usize; 2]| {
        let slots = [a, b].map(|[from, to]| from as u32..to as u32);
        Store::new(Flash::new(6), Layout { slots })
    };
    let block = BLOCK;
    assert!(slots([0, 2 * block], [2 * block, 4 * block]).is_some());
    for (a, b) in [
        ([0, 2 * block], [block, 3 * block]),
        ([0, 2 * block], [5 * block, 7 * block]),
        ([0, 2 * block + 4], [3 * block, 5 * block]),
        ([0, block], [2 * block, 4 * block]),
    ] {
        assert!(slots(a, b).is_none(), "{a:?} {b:?}");
    }
}
