//! Feed and rotation at the drives, by which links are added and dropped at the guide.

use cathforce_scalar::Vector3;

use crate::grid::Grid;
use crate::math::{maximum, minimum, sin_cos};
use crate::overlap::Overlap;
use crate::proximity::Proximity;
use crate::segments::AxialPosition;
use crate::state::{LinkState, SHORTEST_BASE, Span, State};
use crate::{Drive, Drives, MAX_TENDONS, Model, Real};

/// Arc from the tip of the chain back to the tip of an instrument \[m\].
/// docs/explanation/model.md (24)
///
/// `chain_m`, `inside_m`: arcs of the chain and of the instrument inside the vessel \[m\]. The table of
/// the guide's joint covers a full cell, which reaches up to 1.5 links behind the mouth. An instrument
/// that enters second therefore enters the tables there, and not at the mouth.
fn behind_m<T: Real>(link_length_m: T, chain_m: T, inside_m: T) -> T {
    let behind_m = chain_m - inside_m;
    let outside_m = maximum(link_length_m * T::lit(1.5) - inside_m, T::zero());
    behind_m + outside_m * minimum(behind_m / link_length_m, T::one())
}

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Cell of the guide's joint: half of the base link \[m\].
    pub(crate) fn guide_cell_m(&self, model: &Model<T, LINKS>) -> T {
        let shortest = model.description().solver.link_length_m * T::lit(SHORTEST_BASE);
        maximum(self.base_length_m, shortest) * T::lit(0.5)
    }

    /// Moves the drives to `target`, within the reach of the links; adds and drops links.
    /// docs/explanation/model.md (3)
    ///
    /// A link is added slightly late. Otherwise a drive at a whole number of links would add and drop
    /// one in turn with the last bit of its position.
    pub(crate) fn feed(&mut self, model: &Model<T, LINKS>, target: Drives<T>) {
        let Grid { link_length_m: h, .. } = model.grid;
        let catheter = model.within_reach(target.catheter);
        let turned = catheter.rotation_rad - self.drives.catheter.rotation_rad;
        let mut insertion = catheter.insertion_m;
        if model.guidewire.is_some() {
            let guidewire = model.within_reach(target.guidewire);
            insertion = maximum(guidewire.insertion_m, insertion);
            let tendons_m = self.drives.tendons_m;
            self.slide_instruments(Drives { catheter, guidewire, tendons_m }, insertion, h);
        } else {
            self.drives.catheter = catheter;
        }
        self.fed_m = insertion - self.insertion_m;
        self.insertion_m = insertion;
        self.guide.rotation = model.guide_turned(catheter.rotation_rad + self.effects.wound_rad);
        self.guide.tangent = self.guide.rotation.tangent();
        self.guide.turn = self.guide.tangent * turned;
        let full = model.grid.node(self.count.saturating_sub(1)) * h;
        self.base_length_m = insertion - full;
        self.add_and_drop_links(model);
        let last = self.count.saturating_sub(1);
        if let Some(base) = self.links[..self.count.min(LINKS)].last_mut() {
            base.span = Span::new(self.base_length_m, model.grid.link_m(last));
        }
        self.fill_coaxial_tables(model);
    }

    /// Moves the drives of the tendons in a step of `dt_s`.
    #[inline(always)]
    pub(crate) fn pull_tendons(
        &mut self,
        model: &Model<T, LINKS>,
        target_m: [T; MAX_TENDONS],
        friction: bool,
        dt_s: T,
    ) {
        if !model.tendons.is_empty() {
            self.drives.tendons_m = target_m;
            self.tendons.advance(&model.tendons, &target_m, friction, dt_s);
        }
    }

    /// Adds and drops links at the guide until the base link has an admissible length.
    #[inline(always)]
    fn add_and_drop_links(&mut self, model: &Model<T, LINKS>) {
        let longest = |link: usize| model.grid.link_m(link) * T::lit(1.0 + SHORTEST_BASE);
        while self.count < LINKS
            && self.count.checked_sub(1).is_none_or(|base| self.base_length_m > longest(base))
        {
            let base_m = model.grid.link_m(self.count.saturating_sub(1));
            if self.count > 0 {
                self.base_length_m -= base_m;
            } else if self.insertion_m <= T::zero() {
                break;
            }
            if !model.tendons.is_empty() {
                self.tendons.forget(self.count);
            }
            self.add_link(base_m);
        }
        while self.count > 0 && self.base_length_m <= T::zero() {
            self.count -= 1;
            if self.count > 0 {
                self.base_length_m += model.grid.link_m(self.count - 1);
            }
        }
    }

    /// Moves both drives, and the instruments in the chain, whose tip is the foremost of theirs.
    fn slide_instruments(&mut self, drives: Drives<T>, insertion_m: T, link_length_m: T) {
        let before = core::mem::replace(&mut self.drives, drives);
        let fed_m = insertion_m - self.insertion_m;
        let slid_m = |now: Drive<T>, was: Drive<T>| now.insertion_m - was.insertion_m - fed_m;
        let rolled =
            |drives: &Drives<T>| drives.guidewire.rotation_rad - drives.catheter.rotation_rad;
        let behind_m = |drive: Drive<T>| behind_m(link_length_m, insertion_m, drive.insertion_m);
        self.overlap = Overlap {
            catheter: AxialPosition {
                behind_m: behind_m(drives.catheter),
                ..AxialPosition::leading()
            },
            wire: AxialPosition {
                behind_m: behind_m(drives.guidewire),
                roll: sin_cos(rolled(&drives)),
            },
            catheter_slid_m: slid_m(drives.catheter, before.catheter),
            wire_slid_m: slid_m(drives.guidewire, before.guidewire),
            wire_rolled_rad: rolled(&drives) - rolled(&before),
        };
    }

    /// Adds a base link that is straight, along the guide and at rest in the material frame. The last
    /// base link is then a full link.
    fn add_link(&mut self, link_length: T) {
        let mut strain = T::zero();
        if let Some(base) = self.count.checked_sub(1).and_then(|base| self.links.get_mut(base)) {
            base.span = Span::new(link_length, link_length);
            strain = base.strain;
        }
        if let Some((link, elimination)) =
            self.links.get_mut(self.count).zip(self.eliminations.get_mut(self.count))
        {
            elimination.proximity = [Proximity::none(); 2];
            // It has the guide's orientation, so neither has turned against the other in this step.
            self.guide.turn = Vector3::zeros();
            *link = LinkState {
                rotation: self.guide.rotation,
                tangent: self.guide.tangent,
                strain,
                position: self.effects.mouth,
                ..LinkState::new()
            };
            self.count += 1;
        }
    }
}
