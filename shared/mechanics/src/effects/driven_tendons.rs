//! Tendons that drives pull while the instrument works.     docs/explanation/model.md (48)–(53)

use cathforce_scalar::Vector3;
use heapless::Vec;

use crate::algebra::{RelativeRotation, Rotation};
use crate::grid::Grid;
use crate::joint::JointLoad;
use crate::math::{maximum, minimum, sin_cos};
use crate::overlap::Overlap;
use crate::tables::Joint;
use crate::{Description, DrivenTendon, MAX_TENDONS, Real};

/// Travel of a tendon behind the entry plane over which static friction sets in \[m\]: a tenth of the play
/// that such a tendon has in its lumen.
const PRESLIDING_M: f64 = 1e-5;
/// Bend of the instrument per length over which static friction sets in \[1/m\]. Over 100 mm it adds up to
/// 5 mrad, a third of a degree. With a fifth of it, a rod without inertia and viscosity chatters.
const PRESLIDING_PER_M: f64 = 0.05;
/// Speed of a drive at which static friction has lost half of its excess \[m/s\]: one count of 1 µm in a
/// tick of 1 ms.
const SLIDING_SPEED_M_PER_S: f64 = 1e-3;
/// Time constant of the filter on the drive's speed \[s\]; an encoder moves in whole counts.
const SPEED_TIME_S: f64 = 0.01;
/// Largest exponent of [`capstan_ratio`] \[1\], which keeps it positive.
const LARGEST_WRAP: f64 = 1.0;

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

    /// Tension at the drive over that at the entry plane, with this coefficient called on between them.
    fn ratio_behind(&self, held: T) -> T {
        power_ratio(held * self.bend_behind_rad)
    }

    /// Bend of the instrument about this tendon's axis per bend about the other's \[1\].
    fn along(&self, other: &Self) -> T {
        self.axis[0] * other.axis[0] + self.axis[1] * other.axis[1]
    }

    /// Travel of this tendon by tension in the other, in the free instrument \[m/N\].
    /// docs/explanation/model.md (52)
    ///
    /// `shared`: compliance of the part that both bend.
    fn travel_m_per_n(&self, other: &Self, shared: T) -> T {
        self.offset_m * other.offset_m * self.along(other) * shared
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

/// What one joint keeps of the tendons that pass it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TendonCell<T> {
    /// Bend of the joint after the last solve, material axes up and side \[rad\].
    bend: [T; 2],
    /// Bend towards each tendon that friction has taken up, over that at which static friction acts fully
    /// \[1\]; positive where the tendon was pulled.
    held: [T; MAX_TENDONS],
}

impl<T: Real> TendonCell<T> {
    const fn new() -> Self {
        Self { bend: [T::ZERO; 2], held: [T::ZERO; MAX_TENDONS] }
    }
}

/// State of one tendon.
#[derive(Clone, Copy, Debug)]
struct Pulled<T> {
    /// Tension at the entry plane, at the drive and at the anchor \[N\].
    tension_n: T,
    at_drive_n: T,
    at_anchor_n: T,
    /// Displacement of the drive in the last step \[m\], and its filtered speed \[m/s\].
    displacement_m: T,
    speed_m_per_s: T,
    /// Friction coefficient that is called on behind the entry plane, positive where the tendon was pulled
    /// \[1\].
    held_behind: T,
    /// Bend inside the vessel, in any direction \[rad\].
    wrapped_rad: T,
}

impl<T: Real> Pulled<T> {
    const fn new() -> Self {
        let o = T::ZERO;
        Self {
            tension_n: o,
            at_drive_n: o,
            at_anchor_n: o,
            displacement_m: o,
            speed_m_per_s: o,
            held_behind: o,
            wrapped_rad: o,
        }
    }
}

/// State of all tendons.
#[derive(Clone, Debug)]
pub(crate) struct TendonsState<T: Real, const LINKS: usize> {
    pulled: [Pulled<T>; MAX_TENDONS],
    /// Bend of the cell at the guide's mouth by all tendons, material axes \[rad\].
    pub at_mouth: Vector3<T>,
    pub cells: [TendonCell<T>; LINKS],
}

impl<T: Real, const LINKS: usize> TendonsState<T, LINKS> {
    pub const fn new() -> Self {
        Self {
            pulled: [Pulled::new(); MAX_TENDONS],
            at_mouth: T::ORIGIN,
            cells: [TendonCell::new(); LINKS],
        }
    }

    /// Resets to [`TendonsState::new`] in place.
    pub fn reset(&mut self) {
        self.pulled = [Pulled::new(); MAX_TENDONS];
        self.at_mouth = Vector3::zeros();
        self.cells.iter_mut().for_each(|cell| *cell = TendonCell::new());
    }

    /// A joint enters the vessel, straight and with no friction taken up.
    pub fn forget(&mut self, joint: usize) {
        if let Some(cell) = self.cells.get_mut(joint) {
            *cell = TendonCell::new();
        }
    }

    /// Tensions of a tendon at the drive and at its anchor \[N\]; `None` from [`MAX_TENDONS`] on.
    pub fn tensions_n(&self, tendon: usize) -> Option<[T; 2]> {
        self.pulled.get(tendon).map(|pulled| [pulled.at_drive_n, pulled.at_anchor_n])
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
                let taken_up = moved_m * table.static_friction * T::lit(1.0 / PRESLIDING_M);
                pulled.held_behind = within(pulled.held_behind + taken_up, -most, most);
            }
        }
    }
}

/// One tendon in a pass along the joints from the tip to the guide.
#[derive(Clone, Copy, Debug)]
struct Running<T> {
    /// Tension at the entry plane \[N\].
    tension_n: T,
    /// Largest friction coefficient at present, and the static one \[1\].
    friction: T,
    static_friction: T,
    /// Bend of the tendon from the present joint to the entry plane \[rad\].
    wrapped_rad: T,
    /// Bend of the free instrument up to the present joint, per moment \[rad/(N·m)\].
    compliance: T,
    /// Path that bending has freed between the anchor and the present joint \[m\].
    path_m: T,
}

/// Friction of a tendon on one joint.     docs/explanation/model.md (50), (51)
struct JointFriction<T> {
    /// Moment per bend while the tendon sticks \[N·m/rad\].
    stiffness: T,
    /// Bend at which static friction acts fully \[rad\].
    bend_rad: T,
    /// Least and largest friction moment \[N·m\].
    least: T,
    most: T,
}

impl<T: Real> Running<T> {
    /// `lever_m`: share of the joint's cell times distance from the centre line; `arc_m`: of the cell.
    fn joint_friction(&self, lever_m: T, arc_m: T) -> JointFriction<T> {
        let (one, pull) = (T::one(), lever_m * self.tension_n);
        let ratio = power_ratio(self.friction * self.wrapped_rad);
        let bend_rad = T::lit(PRESLIDING_PER_M) * arc_m;
        JointFriction {
            stiffness: pull * self.static_friction * self.wrapped_rad / bend_rad,
            bend_rad,
            least: pull * (one - ratio),
            most: pull * (one - one / ratio),
        }
    }
}

/// The tendons in one solve.
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
    pub fn new<const LINKS: usize>(
        tables: &'a [TendonTable<T>],
        grid: &Grid<T>,
        overlap: &Overlap<T>,
        state: &TendonsState<T, LINKS>,
        friction: bool,
    ) -> Option<Self> {
        if tables.is_empty() {
            return None;
        }
        let zero = T::zero();
        let mut running = [Running {
            tension_n: zero,
            friction: zero,
            static_friction: zero,
            wrapped_rad: zero,
            compliance: zero,
            path_m: zero,
        }; MAX_TENDONS];
        for ((running, table), pulled) in running.iter_mut().zip(tables).zip(&state.pulled) {
            running.tension_n = pulled.tension_n;
            running.wrapped_rad = pulled.wrapped_rad;
            if friction {
                running.friction = table.friction(pulled.speed_m_per_s);
                running.static_friction = table.static_friction;
            }
        }
        let first = grid.middle(0) - overlap.catheter.behind_m / grid.link_length_m;
        Some(Self {
            tables,
            grid: *grid,
            first,
            begins: first,
            friction,
            running,
            last_bend: [zero; 2],
        })
    }

    /// Adds the tendons' moments to the joint at the proximal end of link `index`, and the stiffness of
    /// those that stick.     docs/explanation/model.md (48), (50), (51)
    ///
    /// `bend`: rotation of the joint, material axes \[rad\]; `axes`: up and side halfway between its links.
    pub fn load_joint(
        &mut self,
        index: usize,
        joint: &Joint<T>,
        bend: &Vector3<T>,
        axes: &[Vector3<T>; 2],
        cell: &TendonCell<T>,
        load: &mut JointLoad<T>,
    ) {
        let (zero, half) = (T::zero(), T::lit(0.5));
        let arc = self.grid.cell(index);
        let arc_m = self.grid.cell_m(index);
        let per_arc = T::one() / arc;
        self.begins += arc;
        let softness = T::one() / joint.bending;
        let turned = turned(bend);
        let changed = [bend.x() - cell.bend[0], bend.y() - cell.bend[1]];
        let mut moment = [zero; 2];
        let tendons = self.running.iter_mut().zip(self.tables).zip(&cell.held);
        for ((tendon, table), &held) in tendons {
            // The share of the cell that lies behind the anchor.
            let share = minimum(maximum(self.begins - table.anchor, zero), arc) * per_arc;
            let lever_m = table.offset_m * share;
            let [x, y] = table.axis;
            tendon.compliance += share * softness;
            let mut along = lever_m * tendon.tension_n;
            if self.friction {
                let half_wrapped = turned * share * half;
                tendon.wrapped_rad = maximum(tendon.wrapped_rad - half_wrapped, zero);
                let friction = tendon.joint_friction(lever_m, arc_m);
                tendon.wrapped_rad = maximum(tendon.wrapped_rad - half_wrapped, zero);
                let bent = held * friction.bend_rad + changed[0] * x + changed[1] * y;
                let wanted = friction.stiffness * bent;
                let rubbed = within(wanted, friction.least, friction.most);
                along -= rubbed;
                if rubbed == wanted {
                    let axis = axes[0] * x + axes[1] * y;
                    load.stiffness.add_outer(&(axis * friction.stiffness), &axis);
                }
            }
            moment[0] += along * x;
            moment[1] += along * y;
        }
        load.moment -= axes[0] * moment[0] + axes[1] * moment[1];
        self.last_bend = moment.map(|moment| moment * softness);
    }

    /// Updates friction and tensions for the next solve.
    ///
    /// `links`: how many the chain has; `rotation`: of each after the solve, and of the guide behind the
    /// last one.
    /// docs/explanation/model.md (49), (51)–(53)
    pub fn finish<'r, const LINKS: usize>(
        &mut self,
        links: usize,
        rotation: impl Fn(usize) -> &'r Rotation<T>,
        state: &mut TendonsState<T, LINKS>,
    ) where
        T: 'r,
    {
        let [up, side] = self.last_bend;
        state.at_mouth = Vector3::new(up, side, T::zero());
        self.slide(links, rotation, state);
        let change = self.changes(state);
        let each = state.pulled.iter_mut().zip(self.tables).zip(change);
        for ((pulled, table), change) in each {
            pulled.tension_n = maximum(pulled.tension_n + change, T::zero());
            pulled.at_drive_n = pulled.tension_n * table.ratio_behind(pulled.held_behind);
        }
    }

    /// Paths and bends of the tendons after a solve, and the friction that their sliding leaves.
    /// docs/explanation/model.md (49), (51)
    fn slide<'r, const LINKS: usize>(
        &mut self,
        links: usize,
        rotation: impl Fn(usize) -> &'r Rotation<T>,
        state: &mut TendonsState<T, LINKS>,
    ) where
        T: 'r,
    {
        let (zero, half) = (T::zero(), T::lit(0.5));
        self.begins = self.first;
        for (tendon, pulled) in self.running.iter_mut().zip(&mut state.pulled) {
            tendon.wrapped_rad = pulled.wrapped_rad;
            (pulled.wrapped_rad, pulled.at_anchor_n) = (zero, tendon.tension_n);
        }
        for (j, cell) in state.cells.iter_mut().take(links).enumerate() {
            let bend = RelativeRotation::between(rotation(j + 1), rotation(j)).angle;
            let arc = self.grid.cell(j);
            let arc_m = self.grid.cell_m(j);
            let per_arc = T::one() / arc;
            let begins = self.begins;
            self.begins += arc;
            let turned = turned(&bend);
            let changed = [bend.x() - cell.bend[0], bend.y() - cell.bend[1]];
            cell.bend = [bend.x(), bend.y()];
            let tendons = self.running.iter_mut().zip(self.tables);
            let tendons = tendons.zip(cell.held.iter_mut().zip(&mut state.pulled));
            for ((tendon, table), (held, pulled)) in tendons {
                let share = minimum(maximum(self.begins - table.anchor, zero), arc) * per_arc;
                let lever_m = table.offset_m * share;
                let [x, y] = table.axis;
                tendon.path_m += lever_m * (bend.x() * x + bend.y() * y);
                pulled.wrapped_rad += turned * share;
                if !self.friction {
                    continue;
                }
                let half_wrapped = turned * share * half;
                tendon.wrapped_rad = maximum(tendon.wrapped_rad - half_wrapped, zero);
                let friction = tendon.joint_friction(lever_m, arc_m);
                tendon.wrapped_rad = maximum(tendon.wrapped_rad - half_wrapped, zero);
                let bent = *held * friction.bend_rad + changed[0] * x + changed[1] * y;
                let rubbed = within(friction.stiffness * bent, friction.least, friction.most);
                let full = friction.stiffness * friction.bend_rad;
                *held = if full > zero { rubbed / full } else { zero };
                if begins <= table.anchor || j == 0 {
                    let per_lever = if lever_m > zero { T::one() / lever_m } else { zero };
                    pulled.at_anchor_n = tendon.tension_n - rubbed * per_lever;
                }
            }
        }
    }

    /// Changes of the tensions by a Newton step.     docs/explanation/model.md (52), (53)
    fn changes<const LINKS: usize>(&self, state: &TendonsState<T, LINKS>) -> [T; MAX_TENDONS] {
        let zero = T::zero();
        let mut matrix = [[zero; MAX_TENDONS]; MAX_TENDONS];
        let mut missing = [zero; MAX_TENDONS];
        // Iterators instead of indices, so that the device's code has no panic here (P13).
        let each = || self.tables.iter().zip(&state.pulled).zip(&self.running);
        let stretched_m = |table: &TendonTable<T>, pulled: &Pulled<T>, own: &Running<T>| {
            pulled.displacement_m - table.slack_m - own.path_m
        };
        // A slack tendon stays without tension, and no other tendon feels it.
        let is_taut = |table: &TendonTable<T>, pulled: &Pulled<T>, own: &Running<T>| {
            stretched_m(table, pulled, own) > zero || pulled.tension_n > zero
        };
        let rows = matrix.iter_mut().zip(&mut missing).zip(each()).enumerate();
        for (i, ((row, missing), ((table, pulled), own))) in rows {
            let ratio = table.ratio_behind(pulled.held_behind);
            if let Some(own) = row.get_mut(i) {
                *own = ratio;
            }
            if !is_taut(table, pulled, own) {
                continue;
            }
            *missing = table.stiffness_n_per_m * stretched_m(table, pulled, own)
                - ratio * pulled.tension_n;
            for (place, ((other, other_pulled), running)) in row.iter_mut().zip(each()) {
                if is_taut(other, other_pulled, running) {
                    let shared = minimum(own.compliance, running.compliance);
                    *place += table.stiffness_n_per_m * table.travel_m_per_n(other, shared);
                }
            }
        }
        solve(&mut matrix, &mut missing, self.tables.len());
        missing
    }
}

/// Bend of a joint in any direction \[rad\].
fn turned<T: Real>(bend: &Vector3<T>) -> T {
    (bend.x() * bend.x() + bend.y() * bend.y()).root()
}

fn within<T: Real>(x: T, least: T, most: T) -> T {
    minimum(maximum(x, least), most)
}

/// exp(x) to third order up to [`LARGEST_WRAP`], with ratio(−x) = 1/ratio(x).
fn capstan_ratio<T: Real>(x: T) -> T {
    let most = T::lit(LARGEST_WRAP);
    let half = within(x, -most, most) * T::lit(0.5);
    (T::one() + half) / (T::one() - half)
}

/// exp(x) for larger x, up to eight times [`LARGEST_WRAP`].     docs/explanation/model.md (50)
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
    let count = count.min(MAX_TENDONS);
    for pivot in 0..count {
        let inverse = T::one() / matrix[pivot][pivot];
        let (above, of_above) = (matrix[pivot], right[pivot]);
        let below = matrix.iter_mut().zip(right.iter_mut()).take(count).skip(pivot + 1);
        for (row, right) in below {
            let factor = row[pivot] * inverse;
            for (place, above) in row.iter_mut().zip(above) {
                *place -= factor * above;
            }
            *right -= factor * of_above;
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
            // (1 + x/2)/(1 − x/2) = exp(x + x³/12 + x⁵/80 + …)
            let error = |ratio: f64| (ratio / x.exp() - 1.0).abs();
            assert!(error(capstan_ratio(x)) <= 0.11 * (x * x * x).abs() + 1e-15, "{x}");
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
