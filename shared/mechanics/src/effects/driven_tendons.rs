//! Tendons that drives pull while the instrument works.     docs/explanation/model.md (48)–(53)

use cathforce_scalar::Vector3;
use heapless::Vec;

use crate::algebra::RelativeRotation;
use crate::grid::Grid;
use crate::math::{maximum, minimum, sin_cos};
use crate::overlap::Overlap;
use crate::state::LinkState;
use crate::tables::Joint;
use crate::{Description, DrivenTendon, MAX_TENDONS, Real};

/// Travel of a tendon in its lumen over which static friction sets in \[m\]. It is a tenth of the play that
/// such a tendon has in its lumen, and what a tendon 1 mm off the centre line travels in a bend of 0.01 rad.
const PRESLIDING_M: f64 = 1e-5;
/// Speed of a drive at which static friction has lost half of its excess \[m/s\]: one count of 1 µm in a
/// tick of 1 ms.
const SLIDING_SPEED_M_PER_S: f64 = 1e-3;
/// Time constant of the filter on the drive's speed \[s\]; an encoder moves in whole counts.
const SPEED_TIME_S: f64 = 0.01;
/// Largest friction coefficient times bend of one joint \[1\]. It keeps (50) positive, and only a joint that
/// is bent by more than half a radian reaches it.
const LARGEST_WRAP: f64 = 1.0;
/// Solves for the tensions after each solve of the chain: one finds who slides, one what this sets free, and
/// one settles it. Steady motion needs the first alone.
const ROUNDS: usize = 3;

/// Numbers of a tendon that do not change while a model lives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TendonTable<T> {
    /// Axis about which it bends the instrument, material axes up and side.
    axis: [T; 2],
    offset_m: T,
    stiffness_n_per_m: T,
    /// Arc from the tip to the anchor \[link lengths\].
    anchor: T,
    slack_m: T,
    static_friction: T,
    sliding_friction: T,
    bend_behind_rad: T,
}

impl<T: Real> TendonTable<T> {
    /// Friction coefficient while the drive moves at a speed.     docs/explanation/model.md (51)
    fn friction(&self, speed_m_per_s: T) -> T {
        let v = speed_m_per_s * T::lit(1.0 / SLIDING_SPEED_M_PER_S);
        let excess = self.static_friction - self.sliding_friction;
        self.sliding_friction + excess / (T::one() + v * v)
    }

    /// Rise of the friction coefficient that is called on, with the travel of a tendon that sticks \[1/m\].
    fn holding(&self) -> T {
        self.static_friction * T::lit(1.0 / PRESLIDING_M)
    }

    /// Bend of the instrument about this tendon's axis per bend about the other's \[1\].
    fn along(&self, other: &Self) -> T {
        self.axis[0] * other.axis[0] + self.axis[1] * other.axis[1]
    }
}

/// The tables of the tendons of a description, with the effects on them.
pub(crate) fn tables<T: Real>(description: &Description<T>) -> Vec<TendonTable<T>, MAX_TENDONS> {
    let effects = &description.effects.tendon;
    let rubbed = effects.friction.coefficient;
    let table = |tendon: &DrivenTendon<T>| {
        let (sin, cos) = sin_cos(tendon.angle_rad);
        TendonTable {
            axis: [-sin, cos],
            offset_m: tendon.offset_m,
            stiffness_n_per_m: tendon.stiffness_n_per_m,
            anchor: tendon.anchor_m / description.solver.link_length_m,
            slack_m: tendon.slack_m + effects.slack.length_m,
            static_friction: tendon.static_friction + rubbed,
            sliding_friction: tendon.sliding_friction + rubbed,
            bend_behind_rad: tendon.bend_behind_rad,
        }
    };
    description.tendons.iter().map(table).collect()
}

/// State of one tendon.
#[derive(Clone, Copy, Debug)]
struct Pulled<T> {
    /// Tension at the anchor, and at the drive \[N\].
    tension_n: T,
    at_drive_n: T,
    /// Displacement of the drive in the last step \[m\], and its filtered speed \[m/s\].
    displacement_m: T,
    speed_m_per_s: T,
    /// Path that bending had freed in the last solve \[m\].
    path_m: T,
    /// Friction coefficient that is called on in the bends inside the vessel and behind the entry plane,
    /// positive where the tendon was pulled \[1\].
    held: T,
    held_behind: T,
}

impl<T: Real> Pulled<T> {
    const fn new() -> Self {
        let o = T::ZERO;
        Self {
            tension_n: o,
            at_drive_n: o,
            displacement_m: o,
            speed_m_per_s: o,
            path_m: o,
            held: o,
            held_behind: o,
        }
    }
}

/// State of all tendons.
#[derive(Clone, Debug)]
pub(crate) struct TendonsState<T: Real> {
    pulled: [Pulled<T>; MAX_TENDONS],
    /// Bend of the cell at the guide's mouth by all tendons, material axes \[rad\].
    pub at_mouth: Vector3<T>,
}

impl<T: Real> TendonsState<T> {
    pub const fn new() -> Self {
        Self { pulled: [Pulled::new(); MAX_TENDONS], at_mouth: T::ORIGIN }
    }

    /// Tensions of a tendon at the drive and at its anchor \[N\]; `None` from [`MAX_TENDONS`] on.
    pub fn tensions_n(&self, tendon: usize) -> Option<[T; 2]> {
        self.pulled.get(tendon).map(|pulled| [pulled.at_drive_n, pulled.tension_n])
    }

    /// Takes in the displacements of the drives at the end of a step of `dt_s`. A step without `friction`
    /// is one of a run that begins.     docs/explanation/model.md (51)
    pub fn advance(
        &mut self,
        tables: &[TendonTable<T>],
        displacements_m: &[T; MAX_TENDONS],
        friction: bool,
        dt_s: T,
    ) {
        let time_s = T::lit(SPEED_TIME_S);
        for ((pulled, &at_m), table) in self.pulled.iter_mut().zip(displacements_m).zip(tables) {
            let moved_m = at_m - pulled.displacement_m;
            pulled.displacement_m = at_m;
            if friction {
                let travel_m = maximum(moved_m, -moved_m);
                pulled.speed_m_per_s = (pulled.speed_m_per_s * time_s + travel_m) / (time_s + dt_s);
                let most = table.friction(pulled.speed_m_per_s);
                let wanted = pulled.held_behind + moved_m * table.holding();
                pulled.held_behind = within(wanted, most);
            }
        }
    }
}

/// One tendon in a pass of the recursion from the tip to the guide.
#[derive(Clone, Copy, Debug)]
struct Running<T> {
    /// Tension at the anchor \[N\], and at the present joint over it \[1\].
    tension_n: T,
    ratio: T,
    /// Friction coefficient that is called on \[1\].
    held: T,
    /// Path that bending has freed \[m\], and bend of the tendon in any direction \[rad\], inside the
    /// vessel.
    path_m: T,
    wrapped_rad: T,
    /// Bend of the free instrument up to the present joint, per moment of the tendon at its anchor
    /// \[rad/(N·m)\].
    compliance: T,
}

/// The tendons in one pass of the recursion from the tip to the guide.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrivenTendons<'a, T: Real> {
    tables: &'a [TendonTable<T>],
    grid: Grid<T>,
    /// Arc from the catheter's tip to the distal end of the first joint's cell, and of the next one's
    /// \[link lengths\].
    first: T,
    begins: T,
    /// Friction acts; it does not while a run begins.
    friction: bool,
    running: [Running<T>; MAX_TENDONS],
    /// Bend of the last cell by all tendons \[rad\].
    last_bend: [T; 2],
}

impl<'a, T: Real> DrivenTendons<'a, T> {
    /// `None` without tendons.
    pub fn new(
        tables: &'a [TendonTable<T>],
        grid: &Grid<T>,
        overlap: &Overlap<T>,
        state: &TendonsState<T>,
        friction: bool,
    ) -> Option<Self> {
        if tables.is_empty() {
            return None;
        }
        let zero = T::zero();
        let first = grid.middle(0) - overlap.catheter.behind_m / grid.link_length_m;
        Some(Self {
            tables,
            grid: *grid,
            first,
            begins: first,
            friction,
            running: state.pulled.map(|pulled| Running {
                tension_n: pulled.tension_n,
                ratio: T::one(),
                held: pulled.held,
                path_m: zero,
                wrapped_rad: zero,
                compliance: zero,
            }),
            last_bend: [zero; 2],
        })
    }

    /// Adds the tendons' bend to the unloaded rotation of joint `index`.
    /// docs/explanation/model.md (48), (50)
    ///
    /// `bend`: present rotation of the joint, material axes \[rad\].
    pub fn bend_joint(&mut self, index: usize, bend: &Vector3<T>, joint: &mut Joint<T>) {
        let (zero, half) = (T::zero(), T::lit(0.5));
        let arc = self.grid.cell(index);
        let per_arc = T::one() / arc;
        self.begins += arc;
        let turned = turned(bend);
        let softness = T::one() / joint.bending;
        let mut moment = [zero; 2];
        for (tendon, table) in self.running.iter_mut().zip(self.tables) {
            // The share of the cell that lies behind the anchor.
            let share = minimum(maximum(self.begins - table.anchor, zero), arc) * per_arc;
            let lever = table.offset_m * share;
            let [x, y] = table.axis;
            let before = tendon.ratio;
            tendon.ratio = before * capstan_ratio(tendon.held * turned * share);
            let ratio = (before + tendon.ratio) * half;
            tendon.compliance += ratio * share * softness;
            let pull = tendon.tension_n * ratio * lever;
            moment[0] += pull * x;
            moment[1] += pull * y;
        }
        self.last_bend = moment.map(|moment| moment * softness);
        joint.unloaded += Vector3::new(self.last_bend[0], self.last_bend[1], zero);
    }

    /// Paths and bends of the tendons in the links of the chain as they are.
    /// docs/explanation/model.md (49)
    fn measure(&mut self, links: &[LinkState<T>], guide: &LinkState<T>) {
        self.begins = self.first;
        for (j, link) in links.iter().enumerate() {
            let proximal = links.get(j + 1).unwrap_or(guide);
            let bend = RelativeRotation::between(&proximal.rotation, &link.rotation).angle;
            let arc = self.grid.cell(j);
            let per_arc = T::one() / arc;
            self.begins += arc;
            let turned = turned(&bend);
            for (tendon, table) in self.running.iter_mut().zip(self.tables) {
                let share = minimum(maximum(self.begins - table.anchor, T::zero()), arc) * per_arc;
                let [x, y] = table.axis;
                tendon.path_m += table.offset_m * share * (bend.x() * x + bend.y() * y);
                tendon.wrapped_rad += turned * share;
            }
        }
    }

    /// Updates friction and tensions for the next solve by a Newton step, which is exact for the free
    /// instrument and too short for one that is held. `links`: those of the chain after the solve.
    /// docs/explanation/model.md (51)–(53)
    pub fn finish(
        &mut self,
        links: &[LinkState<T>],
        guide: &LinkState<T>,
        state: &mut TendonsState<T>,
    ) {
        self.measure(links, guide);
        let [up, side] = self.last_bend;
        state.at_mouth = Vector3::new(up, side, T::zero());
        let mut balances = [Balance::none(); MAX_TENDONS];
        for (i, balance) in balances.iter_mut().enumerate().take(self.tables.len()) {
            let pulled = &mut state.pulled[i];
            *balance = self.balance(i, pulled);
        }
        let mut change = [T::zero(); MAX_TENDONS];
        for round in 0..ROUNDS {
            change = self.changes(&balances);
            if round + 1 < ROUNDS {
                for (i, balance) in balances.iter_mut().enumerate().take(self.tables.len()) {
                    balance.slide_if_beyond(self.slip_m(i, &change));
                }
            }
        }
        let each = state.pulled.iter_mut().zip(&balances).zip(change);
        for ((pulled, balance), change) in each.take(self.tables.len()) {
            pulled.tension_n = maximum(pulled.tension_n + change, T::zero());
            pulled.at_drive_n = pulled.tension_n * balance.ratio;
        }
    }

    /// What one tendon's tension has to balance; updates its friction by what it has slid since the last
    /// solve.     docs/explanation/model.md (51)
    fn balance(&self, i: usize, pulled: &mut Pulled<T>) -> Balance<T> {
        let (table, running) = (&self.tables[i], &self.running[i]);
        let slid_m = running.path_m - pulled.path_m;
        pulled.path_m = running.path_m;
        let most = table.friction(pulled.speed_m_per_s);
        if self.friction {
            pulled.held = within(pulled.held + slid_m * table.holding(), most);
        }
        let stretched_m = pulled.displacement_m - table.slack_m - running.path_m;
        Balance {
            // A slack tendon stays without tension, and no other tendon feels it.
            taut: stretched_m > T::zero() || pulled.tension_n > T::zero(),
            tension_n: pulled.tension_n,
            wanted_n: table.stiffness_n_per_m * stretched_m,
            stiffness_n_per_m: table.stiffness_n_per_m,
            behind: power_ratio(pulled.held_behind * table.bend_behind_rad),
            wrapped_rad: running.wrapped_rad,
            ratio: T::one(),
            held: pulled.held,
            most,
            holding: if self.friction { table.holding() } else { T::zero() },
        }
        .holding_at(pulled.held)
    }

    /// Travel of a tendon by changes of the tensions, in the free instrument \[m\].
    fn slip_m(&self, i: usize, change: &[T; MAX_TENDONS]) -> T {
        let others = change.iter().enumerate().take(self.tables.len());
        others.fold(T::zero(), |sum, (j, &change)| sum + self.travel_m_per_n(i, j) * change)
    }

    /// Travel of tendon `i` by tension in `j`, in the free instrument \[m/N\].
    fn travel_m_per_n(&self, i: usize, j: usize) -> T {
        let (own, other) = (&self.tables[i], &self.tables[j]);
        let shared = minimum(self.running[i].compliance, self.running[j].compliance);
        own.offset_m * other.offset_m * own.along(other) * shared
    }

    /// Changes of the tensions at the anchors by a Newton step.     docs/explanation/model.md (52), (53)
    fn changes(&self, balances: &[Balance<T>; MAX_TENDONS]) -> [T; MAX_TENDONS] {
        let count = self.tables.len();
        let mut matrix = [[T::zero(); MAX_TENDONS]; MAX_TENDONS];
        let mut missing = [T::zero(); MAX_TENDONS];
        for (i, balance) in balances.iter().enumerate().take(count) {
            matrix[i][i] = balance.ratio;
            if !balance.taut {
                continue;
            }
            missing[i] = balance.wanted_n - balance.ratio * balance.tension_n;
            let gain = balance.stiffness_n_per_m + balance.sticking_n_per_m();
            for (j, other) in balances.iter().enumerate().take(count) {
                if other.taut {
                    matrix[i][j] += gain * self.travel_m_per_n(i, j);
                }
            }
        }
        solve(&mut matrix, &mut missing, count);
        missing
    }
}

/// What one tendon's tension has to balance.
#[derive(Clone, Copy, Debug)]
struct Balance<T> {
    taut: bool,
    /// Tension at the anchor, and what the stretch of the tendon wants at the drive \[N\].
    tension_n: T,
    wanted_n: T,
    stiffness_n_per_m: T,
    /// Ratio of tensions by the bends behind the entry plane, and the bend inside the vessel \[rad\].
    behind: T,
    wrapped_rad: T,
    /// Tension at the drive over that at the anchor.
    ratio: T,
    /// Friction coefficient that is called on, its limit, and its rise with travel \[1/m\]; the rise is zero
    /// for a tendon that slides.
    held: T,
    most: T,
    holding: T,
}

impl<T: Real> Balance<T> {
    fn none() -> Self {
        let o = T::zero();
        Self {
            taut: false,
            tension_n: o,
            wanted_n: o,
            stiffness_n_per_m: o,
            behind: T::one(),
            wrapped_rad: o,
            ratio: T::one(),
            held: o,
            most: o,
            holding: o,
        }
    }

    fn holding_at(self, held: T) -> Self {
        Self { held, ratio: self.behind * power_ratio(held * self.wrapped_rad), ..self }
    }

    /// Rise of the tension at the drive with the travel of a tendon that sticks \[N/m\].
    fn sticking_n_per_m(&self) -> T {
        self.ratio * self.tension_n * self.wrapped_rad * self.holding
    }

    /// Slides at the limit of friction if a travel calls on more.     docs/explanation/model.md (52)
    fn slide_if_beyond(&mut self, slip_m: T) {
        let wanted = self.held + slip_m * self.holding;
        let limited = within(wanted, self.most);
        if limited != wanted {
            *self = Self { holding: T::zero(), ..self.holding_at(limited) };
        }
    }
}

/// Bend of a joint in any direction \[rad\].
fn turned<T: Real>(bend: &Vector3<T>) -> T {
    (bend.x() * bend.x() + bend.y() * bend.y()).root()
}

fn within<T: Real>(x: T, most: T) -> T {
    minimum(maximum(x, -most), most)
}

/// exp(x) to third order up to [`LARGEST_WRAP`], with ratio(−x) = 1/ratio(x).
/// docs/explanation/model.md (50)
fn capstan_ratio<T: Real>(x: T) -> T {
    let half = within(x, T::lit(LARGEST_WRAP)) * T::lit(0.5);
    (T::one() + half) / (T::one() - half)
}

/// exp(x) for larger x, up to eight times [`LARGEST_WRAP`].
fn power_ratio<T: Real>(x: T) -> T {
    let eighth = capstan_ratio(x * T::lit(0.125));
    let quarter = eighth * eighth;
    let half = quarter * quarter;
    half * half
}

/// Solves `matrix` · x = `right` in place, for the first `count` rows. The matrix is a positive diagonal
/// plus a positive diagonal times a symmetric positive semidefinite matrix, so that no pivot is searched.
fn solve<T: Real>(
    matrix: &mut [[T; MAX_TENDONS]; MAX_TENDONS],
    right: &mut [T; MAX_TENDONS],
    count: usize,
) {
    for pivot in 0..count {
        let inverse = T::one() / matrix[pivot][pivot];
        let (above, of_above) = (matrix[pivot], right[pivot]);
        for row in pivot + 1..count {
            let factor = matrix[row][pivot] * inverse;
            for column in pivot..count {
                matrix[row][column] -= factor * above[column];
            }
            right[row] -= factor * of_above;
        }
    }
    for row in (0..count).rev() {
        let known = (row + 1..count).fold(T::zero(), |sum, i| sum + matrix[row][i] * right[i]);
        right[row] = (right[row] - known) / matrix[row][row];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_capstan_s_ratio_is_exponential_and_reverses() {
        for x in [-0.3f64, -0.02, 0.0, 0.05, 0.3, 1.0] {
            // (1 + x/2)/(1 − x/2) = exp(x) (1 + x³/12 + …)
            let error = |ratio: f64| (ratio / x.exp() - 1.0).abs();
            assert!(error(capstan_ratio(x)) <= 0.1 * (x * x * x).abs() + 1e-15, "{x}");
            assert!((capstan_ratio(x) * capstan_ratio(-x) - 1.0).abs() < 1e-15);
            assert!(error(power_ratio(x)) <= 0.002 * (x * x * x).abs() + 1e-14, "{x}");
        }
    }

    #[test]
    fn a_small_system_is_solved() {
        let matrix: [[f64; 4]; 4] = [
            [3.0, -1.0, 0.5, 0.0],
            [-2.0, 5.0, 0.0, 1.0],
            [0.5, 0.0, 2.0, -0.3],
            [0.0, 0.7, -0.3, 4.0],
        ];
        for count in 1..=4 {
            let expected = [0.3, -1.2, 2.5, 0.7];
            let mut right = [0.0; 4];
            for (row, right) in matrix.iter().zip(&mut right) {
                *right = (0..count).map(|i| row[i] * expected[i]).sum();
            }
            solve(&mut matrix.clone(), &mut right, count);
            for i in 0..count {
                assert!((right[i] - expected[i]).abs() < 1e-12, "{right:?}");
            }
        }
    }
}
