//! P06: a tip that is pressed past a dividing wall and turned there whips round. Its forces must be resolved
//! again soon, and the device must continue.

use cathforce_control::Mode;
use cathforce_hil_tests::{Bench, Drive, image};
use cathforce_link::Sim;

/// Insertion at the start, and insertion past the dividing wall \[m\].
const FROM_M: f64 = 0.028;
const PRESSED_M: f64 = 0.094;
/// Advance and rotation of a tick.
const FEED_M: f64 = 1.3e-5;
const TURN_RAD: f64 = core::f64::consts::TAU / 4000.0;
const REST: usize = 1000;
/// Ticks after one another that a whip may leave unresolved; the device stops after a hundred.
const LONGEST: usize = 80;

#[test]
fn a_tip_pressed_past_a_dividing_wall_and_turned_is_felt_again_soon() {
    let mut at = Drive { insertion_m: FROM_M, rotation_rad: 0.0 };
    let mut bench = Bench::<Sim>::armed(image(), at);
    let (mut unresolved, mut longest, mut whips) = (0, 0, 0);
    let fed = ((PRESSED_M - FROM_M) / FEED_M) as usize;
    let turns = [(4000, 1.0), (REST, 0.0), (8000, -1.0), (REST, 0.0), (4000, 1.0), (REST, 0.0)];
    let steps = [(fed, FEED_M, 0.0), (REST, 0.0, 0.0)].into_iter();
    for (ticks, feed_m, turn) in steps.chain(turns.map(|(ticks, turn)| (ticks, 0.0, turn))) {
        for tick in 0..ticks {
            at.insertion_m += feed_m;
            at.rotation_rad += turn * TURN_RAD;
            let frame = bench.encoder(at);
            assert_eq!(
                bench.tick(&[frame]).mode(),
                Some(Mode::Armed),
                "{at:?}, tick {tick} of {ticks}"
            );
            let is_unresolved = bench.ticker().outputs().expect("configured").contact.unresolved;
            whips += usize::from(is_unresolved && unresolved == 0);
            unresolved = if is_unresolved { unresolved + 1 } else { 0 };
            longest = unresolved.max(longest);
        }
        println!("{at:?}: {whips} whips so far, {longest} ticks unresolved after one another");
    }
    assert!(whips > 0, "no whip: the tip is not pressed");
    assert!(longest <= LONGEST && unresolved == 0, "{longest} ticks unresolved");
}
