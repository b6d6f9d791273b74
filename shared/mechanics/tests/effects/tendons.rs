//! Tendons that drives pull, against closed forms.     docs/explanation/model.md (48)–(53)

use std::f64::consts::{FRAC_PI_2, PI};

use cathforce_mechanics::*;

use crate::rod::{free_space, rod};
use crate::wall::StoredWall;

const LENGTH_M: f64 = 0.1;
const STIFFNESS: f64 = 1e-4;
const OFFSET_M: f64 = 0.7e-3;
const TENDON_N_PER_M: f64 = 3000.0;
/// Time of a step of [`rod`] \[s\].
const STEP_S: f64 = 1e-2;

fn tendon(angle_rad: f64) -> DrivenTendon<f64> {
    DrivenTendon {
        angle_rad,
        offset_m: OFFSET_M,
        anchor_m: 0.0,
        stiffness_n_per_m: TENDON_N_PER_M,
        slack_m: 0.0,
        static_friction: 0.0,
        sliding_friction: 0.0,
        bend_behind_rad: 0.0,
    }
}

/// A tendon towards `up` with the same friction at rest and in motion.
fn rubbing(friction: f64) -> DrivenTendon<f64> {
    DrivenTendon { static_friction: friction, sliding_friction: friction, ..tendon(0.0) }
}

/// A rod in free space whose tendons are pulled.
struct Pulled {
    model: Model<f64>,
    state: State<f64>,
    wall: StoredWall,
    tendons_m: [f64; MAX_TENDONS],
}

impl Pulled {
    fn new(links: usize, tendons: &[DrivenTendon<f64>]) -> Self {
        let mut description = rod(LENGTH_M, links, STIFFNESS);
        description.tendons.extend_from_slice(tendons).unwrap();
        let mut pulled = Self {
            model: Model::new(description).unwrap(),
            state: State::new(),
            wall: free_space(),
            tendons_m: [0.0; MAX_TENDONS],
        };
        pulled.begin();
        pulled
    }

    /// Begins a run at the present displacements.
    fn begin(&mut self) {
        let drives = self.drives();
        self.state.reset();
        while !settle(&self.model, &self.wall.lumen(), &mut self.state, drives) {}
    }

    fn drives(&self) -> Drives<f64> {
        let catheter = Drive { insertion_m: LENGTH_M, rotation_rad: 0.0 };
        Drives { catheter, tendons_m: self.tendons_m, ..Drives::default() }
    }

    fn step(&mut self) {
        let drives = self.drives();
        let outputs = step(&self.model, &self.wall.lumen(), &mut self.state, drives);
        assert!(!outputs.lost, "{drives:?}");
    }

    /// Moves the drives evenly to these displacements in a number of steps.
    fn pull(&mut self, to_m: [f64; MAX_TENDONS], steps: u32) {
        let from_m = self.tendons_m;
        for step in 1..=steps {
            let share = f64::from(step) / f64::from(steps);
            self.tendons_m = std::array::from_fn(|i| from_m[i] + share * (to_m[i] - from_m[i]));
            self.step();
        }
    }

    /// Moves the first drive, then waits.
    fn pull_first(&mut self, to_m: f64, steps: u32) {
        self.pull([to_m, 0.0, 0.0, 0.0], steps);
        (0..30).for_each(|_| self.step());
    }

    fn tip(&self) -> [f64; 3] {
        self.state.node_position_m(0).unwrap()
    }

    /// Tensions of the first tendon at its drive and at its anchor \[N\].
    fn tensions_n(&self) -> [f64; 2] {
        self.state.tendon_tensions_n(0).unwrap()
    }

    /// Angle in the plane of the bend by which the tip's last link is turned \[rad\].
    fn angle_rad(&self) -> f64 {
        let [a, b] = [0, 1].map(|node| self.state.node_position_m(node).unwrap());
        (a[2] - b[2]).atan2(a[0] - b[0])
    }
}

/// Tip of a rod that is bent to an arc towards `up` and straight from there on.
fn arc_then_straight(curvature: f64, bent_m: f64, straight_m: f64) -> [f64; 3] {
    let angle = curvature * bent_m;
    let [sin, cos] = [angle.sin(), angle.cos()];
    [sin / curvature + straight_m * cos, 0.0, (1.0 - cos) / curvature + straight_m * sin]
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn a_tendon_bends_a_cantilever_to_the_arc_at_which_its_tension_balances() {
    let (pulled_m, slack_m, straight_m) = (2e-3, 0.3e-3, 0.025);
    let bent_m = LENGTH_M - straight_m;
    let anchored = DrivenTendon { slack_m, anchor_m: straight_m, ..tendon(0.0) };
    // T = k (p − z − e φ), φ = T e L/EI.
    let per_tension = OFFSET_M * bent_m / STIFFNESS;
    let tension =
        TENDON_N_PER_M * (pulled_m - slack_m) / (1.0 + TENDON_N_PER_M * OFFSET_M * per_tension);
    let expected = arc_then_straight(tension * OFFSET_M / STIFFNESS, bent_m, straight_m);
    let errors = [8, 16, 32].map(|links| {
        let mut rod = Pulled::new(links, &[anchored]);
        rod.pull_first(pulled_m, 50);
        let [at_drive, at_anchor] = rod.tensions_n();
        assert!((at_drive / at_anchor - 1.0).abs() < 1e-6, "{at_drive} {at_anchor}");
        (distance(rod.tip(), expected), (at_drive / tension - 1.0).abs())
    });
    println!("errors of tip [m] and tension at 8, 16, 32 links: {errors:?}");
    // The tip's half cell has no joint: first order.
    assert!(errors[2].0 < 0.05 * expected[2] && errors[2].0 < 0.6 * errors[1].0, "{errors:?}");
    assert!(errors[2].1 < 1e-2 && errors[1].0 < 0.6 * errors[0].0, "{errors:?}");
}

/// Pull at which a free rod is bent by `angle` while a tendon with this friction slides, and its tension at
/// the anchor: dφ/ds = T e/EI and dT/ds = μ T dφ/ds, so that 1/T_a − 1/T = μ e L/EI and T/T_a = exp(μ φ).
fn sliding(friction: f64, angle_rad: f64) -> (f64, f64) {
    let ratio = (friction * angle_rad).exp();
    let at_anchor = (1.0 - 1.0 / ratio) * STIFFNESS / (friction * OFFSET_M * LENGTH_M);
    (at_anchor * ratio / TENDON_N_PER_M + OFFSET_M * angle_rad, at_anchor)
}

/// T/T_a = exp(μ θ), evaluated to ten digits: coefficient, angle \[°\], ratio.
const CAPSTAN: [(f64, f64, f64); 5] = [
    (0.1, 90.0, 1.170088787),
    (0.1, 180.0, 1.369107771),
    (0.3, 90.0, 1.601977651),
    (0.3, 180.0, 2.566332395),
    (0.62, 90.0, 2.648235906),
];

#[test]
fn tension_decays_along_the_bend_as_along_a_capstan() {
    for (friction, angle_deg, ratio) in CAPSTAN {
        let (pulled_m, at_anchor_n) = sliding(friction, f64::to_radians(angle_deg));
        let mut rod = Pulled::new(40, &[rubbing(friction)]);
        rod.pull_first(pulled_m, 150);
        let [at_drive, at_anchor] = rod.tensions_n();
        let turned = rod.angle_rad().rem_euclid(2.0 * PI).to_degrees();
        println!(
            "μ {friction}, {angle_deg}°: ratio {:.4} of {ratio}, turned {turned:.1}°, at the \
             anchor {at_anchor:.3} N of {at_anchor_n:.3} N",
            at_drive / at_anchor
        );
        assert!(((at_drive / at_anchor) / ratio - 1.0).abs() < 0.02);
        assert!((turned / angle_deg - 1.0).abs() < 0.03);
        assert!((at_anchor / at_anchor_n - 1.0).abs() < 0.03);
    }
}

#[test]
fn a_back_and_forth_pull_runs_through_a_closed_loop_that_friction_opens() {
    let (low_m, middle_m, high_m) = (0.2e-3, 0.9e-3, 2.5e-3);
    let amounts = |friction: f64| {
        let mut rod = Pulled::new(30, &[rubbing(friction)]);
        rod.pull_first(high_m, 100);
        let mut at_middle = Vec::new();
        for _ in 0..2 {
            let mut ratios = Vec::new();
            for to_m in [low_m, high_m] {
                rod.pull_first(middle_m, 60);
                let [at_drive, at_anchor] = rod.tensions_n();
                ratios.push((rod.angle_rad(), at_drive / at_anchor));
                rod.pull_first(to_m, 60);
            }
            at_middle.push(ratios);
        }
        at_middle
    };
    let smooth = amounts(0.0);
    assert!((smooth[0][0].0 - smooth[0][1].0).abs() < 1e-5, "{smooth:?}");
    let friction = 0.3;
    let rough = amounts(friction);
    println!("let out, pulled: {rough:?}");
    for around in &rough {
        let [out, pulled] = [around[0], around[1]];
        // Let out, the tip holds more than the drive.
        assert!((out.1 / (-friction * out.0).exp() - 1.0).abs() < 0.02, "{out:?}");
        assert!((pulled.1 / (friction * pulled.0).exp() - 1.0).abs() < 0.02, "{pulled:?}");
        assert!(out.0 > 1.05 * pulled.0, "{rough:?}");
    }
    for (first, second) in rough[0].iter().zip(&rough[1]) {
        assert!((first.0 - second.0).abs() < 2e-3, "{rough:?}");
    }
}

#[test]
fn a_reversal_leaves_the_tip_pulled_until_friction_has_turned_around() {
    let friction = 0.3;
    let mut rod = Pulled::new(30, &[rubbing(friction)]);
    rod.pull_first(2.5e-3, 100);
    let (angle, [at_drive, at_anchor]) = (rod.angle_rad(), rod.tensions_n());
    // The tension at the drive may fall by exp(−2 μ φ) before the anchor lets go.
    let dead_m = at_drive * (1.0 - (-2.0 * friction * angle).exp()) / TENDON_N_PER_M;
    let back = |rod: &mut Pulled, back_m: f64| {
        let before = rod.angle_rad();
        rod.pull_first(rod.tendons_m[0] - back_m, 100);
        let [drive, anchor] = rod.tensions_n();
        [before - rod.angle_rad(), drive / at_drive, anchor / at_anchor]
    };
    let [within, further] = [0.5, 2.5].map(|share| back(&mut rod, share * dead_m));
    println!(
        "of {angle:.3} rad, turned and tension at drive and anchor: {within:.3?}, {further:.3?}"
    );
    // Joints near the drive turn first; the anchor is still held.
    assert!(within[1] < 0.75 && within[2] > 0.97, "{within:?}");
    assert!(within[0] < 0.1 * angle, "{within:?}");
    assert!(further[2] < 0.5 && further[0] > 0.5 * angle, "{further:?}");
}

#[test]
fn a_drive_at_rest_is_held_by_static_friction_and_slides_with_less() {
    let rough = DrivenTendon { sliding_friction: 0.15, ..rubbing(0.35) };
    let (pulled_m, _) = sliding(0.15, 1.2);
    let ratio_at = |speed_m_per_s: f64| {
        let mut rod = Pulled::new(20, &[rough]);
        rod.pull([pulled_m, 0.0, 0.0, 0.0], (pulled_m / speed_m_per_s / STEP_S) as u32);
        let moving = rod.tensions_n();
        (0..100).for_each(|_| rod.step());
        let angle = rod.angle_rad();
        ([moving, rod.tensions_n()].map(|[at_drive, at_anchor]| at_drive / at_anchor), angle)
    };
    let ([slow, _], slow_angle) = ratio_at(2e-4);
    assert!((slow / (0.35 * slow_angle).exp() - 1.0).abs() < 0.03, "{slow} at {slow_angle}");
    // At five times the speed at which half of the excess is lost, 1/26 of it is left.
    let ([fast, after], angle) = ratio_at(5e-3);
    assert!((fast / (0.15 * angle).exp() - 1.0).abs() < 0.06, "{fast} at {angle}");
    // A drive that stops keeps what it slid with: nothing creeps back.
    // What is left of the motion is held more strongly.
    let called_on = after.ln() / angle;
    assert!((0.14..0.25).contains(&called_on), "{called_on} at {angle}");
}

#[test]
fn bends_behind_the_entry_hold_a_straight_catheter() {
    let (friction, bend_rad) = (0.2, 2.0);
    let behind = DrivenTendon { bend_behind_rad: bend_rad, ..rubbing(friction) };
    let mut rod = Pulled::new(20, &[behind]);
    rod.pull_first(1e-3, 100);
    let [at_drive, at_anchor] = rod.tensions_n();
    let wrapped = friction * (bend_rad + rod.angle_rad());
    assert!((at_drive / at_anchor / wrapped.exp() - 1.0).abs() < 0.02, "{at_drive} {at_anchor}");
}

#[test]
fn a_slack_tendon_neither_pulls_nor_pushes() {
    let slack_m = 1e-3;
    let mut rod = Pulled::new(20, &[DrivenTendon { slack_m, ..rubbing(0.2) }]);
    for pulled_m in [0.99e-3, -5e-3] {
        rod.pull_first(pulled_m, 50);
        assert_eq!(rod.tensions_n(), [0.0; 2]);
        assert!(rod.tip()[2].abs() < 1e-9, "{:?}", rod.tip());
    }
    rod.pull_first(2e-3, 50);
    assert!(rod.tip()[2] > 1e-3);
    rod.pull_first(0.0, 50);
    assert_eq!(rod.tensions_n(), [0.0; 2]);
    assert!(rod.tip()[2].abs() < 1e-6, "{:?}", rod.tip());
}

#[test]
fn opposite_tendons_hold_each_other_and_neighbours_bend_between_them() {
    let four: Vec<_> = (0..4).map(|i| tendon(f64::from(i) * FRAC_PI_2)).collect();
    let mut rod = Pulled::new(20, &four);
    let taut_m = 5e-4;
    rod.pull([taut_m; 4], 20);
    (0..100).for_each(|_| rod.step());
    for i in 0..4 {
        let [at_drive, _] = rod.state.tendon_tensions_n(i).unwrap();
        assert!((at_drive / (TENDON_N_PER_M * taut_m) - 1.0).abs() < 1e-6, "{at_drive}");
    }
    assert!(distance(rod.tip(), [LENGTH_M, 0.0, 0.0]) < 1e-8, "{:?}", rod.tip());
    rod.pull([taut_m + 1e-3, taut_m + 1e-3, taut_m, taut_m], 50);
    (0..100).for_each(|_| rod.step());
    // Towards up = z and direction × up = −y alike.
    let [_, y, z] = rod.tip();
    assert!(z > 2e-3 && (y + z).abs() < 1e-6, "{:?}", rod.tip());
}

#[test]
fn what_no_tendon_uses_changes_no_bit() {
    let mut rods = [Pulled::new(20, &[]), Pulled::new(20, &[])];
    rods[1].pull([1e-3, 0.5, -2.0, 3e-3], 10);
    rods[0].pull([0.0; 4], 10);
    let [a, b] =
        rods.map(|rod| rod.state.node_results().flatten().map(f64::to_bits).collect::<Vec<_>>());
    assert_eq!(a, b);
}

#[test]
fn a_reset_forgets_the_tendons() {
    let mut rod = Pulled::new(20, &[rubbing(0.3)]);
    let first = |rod: &mut Pulled| {
        rod.tendons_m = [0.0; MAX_TENDONS];
        rod.begin();
        rod.pull_first(2e-3, 20);
        rod.tip().map(f64::to_bits)
    };
    assert_eq!(first(&mut rod), first(&mut rod));
}

#[test]
fn a_tendon_outside_of_the_catheter_is_refused() {
    let refused = |change: fn(&mut DrivenTendon<f64>)| {
        let mut description = rod(LENGTH_M, 20, STIFFNESS);
        let mut tendon = rubbing(0.2);
        change(&mut tendon);
        description.tendons.push(tendon).unwrap();
        Model::<f64>::new(description).err()
    };
    assert_eq!(refused(|_| ()), None);
    let range = |key| Some(DescriptionError::Range(key));
    assert_eq!(refused(|t| t.offset_m = 0.9e-3), range("tendons.offset_m"));
    assert_eq!(refused(|t| t.offset_m = f64::NAN), range("tendons.offset_m"));
    assert_eq!(refused(|t| t.sliding_friction = 0.3), range("tendons.sliding_friction"));
    assert_eq!(refused(|t| t.stiffness_n_per_m = 0.0), range("tendons.stiffness_n_per_m"));
    assert_eq!(refused(|t| t.bend_behind_rad = 25.0), range("tendons.bend_behind_rad"));
}
