//! Ticks of many catheters: on all cores, and on each core one catheter in each lane of the processor's packs.

use cathforce_control as control;
use cathforce_control::{Inputs, Ticks};
use cathforce_mechanics::{self as mechanics, Attendant, Drives, Found, Kind, MAX_LINKS};
use rayon::prelude::*;

use crate::row::{Layout, Row};
use crate::twin::{Outcome, Rig, State, Twin};

/// Fewest catheters that are stepped abreast: all lanes together take about as long as three catheters one
/// after the other (`cargo xtask bench --environments`).
const FEWEST: usize = 3;

/// Where the drives of a catheter go, tick by tick, and where the answers are put.
pub trait Course: Send {
    /// Positions in the next tick; `None` after the last.
    fn next(&mut self) -> Option<Row>;
    fn take(&mut self, outcome: Outcome);
}

impl<C: Course> Course for &mut C {
    fn next(&mut self) -> Option<Row> {
        (**self).next()
    }

    fn take(&mut self, outcome: Outcome) {
        (**self).take(outcome);
    }
}

/// A catheter and its course.
pub type Ride<'a, C> = (&'a mut Twin, C);

/// Steps every catheter to the end of its course. Each has the bits that it has alone.
pub fn ride<C: Course>(mut rides: Vec<Ride<'_, C>>) {
    let share = rides.len().div_ceil(rayon::current_num_threads().max(1));
    // Those that are alike are beside each other, so that few lanes wait.
    rides.sort_by_cached_key(|(twin, _)| kind(twin));
    let mut groups: Vec<Vec<Ride<'_, C>>> = Vec::new();
    let mut last: Option<Kind> = None;
    for own in rides {
        let kind = kind(own.0);
        let most = match own.0.rig {
            Rig::Single(_) => mechanics::side_by_side::<f32>(),
            Rig::Double(_) => mechanics::side_by_side::<f64>(),
        };
        let goes = last.zip(kind).is_some_and(|(last, kind)| last.goes_with(&kind));
        match groups.last_mut().filter(|group| goes && group.len() < most.min(share)) {
            Some(group) => group.push(own),
            None => groups.push(vec![own]),
        }
        last = kind;
    }
    groups.into_par_iter().for_each(together);
}

/// How a catheter can be stepped abreast; `None` if it can be only alone.
fn kind(twin: &Twin) -> Option<Kind> {
    match (&twin.rig, &twin.state) {
        (Rig::Single(rig), State::Single(state)) => control::kind(rig.config(), state),
        (Rig::Double(rig), State::Double(state)) => Kind::of(&rig.config().model, state),
        _ => None,
    }
}

fn together<C: Course>(mut group: Vec<Ride<'_, C>>) {
    if group.len() < FEWEST {
        for (twin, course) in &mut group {
            while let Some(row) = course.next() {
                course.take(twin.tick(Some(&row), None));
            }
        }
        return;
    }
    let (mut singles, mut doubles) = (Vec::new(), Vec::new());
    let (mut configs, mut models) = (Vec::new(), Vec::new());
    let mut riders = Riders { layout: group[0].0.rig.layout(), seats: Vec::new() };
    let mut lumen = None;
    for (twin, course) in &mut group {
        let Twin { rig, state, at, .. } = &mut **twin;
        match (&*rig, state) {
            (Rig::Single(rig), State::Single(state)) => {
                configs.push(rig.config());
                singles.push(&mut **state);
            }
            (Rig::Double(rig), State::Double(state)) => {
                lumen = Some(&rig.config().lumen);
                models.push(&rig.config().model);
                doubles.push(&mut **state);
            }
            // Both are made together, and `restore` keeps them so.
            _ => continue,
        }
        riders.seats.push((at, course));
    }
    match lumen {
        None => control::step_abreast(&configs, &mut singles, &mut riders),
        Some(lumen) => {
            let mut of_models = OfModels { riders, models: &models, lumen };
            mechanics::step_abreast(&models, lumen, &mut doubles, &mut of_models);
        }
    }
}

/// Courses of catheters abreast, and where each catheter keeps the positions of its drives.
struct Riders<'a, C> {
    layout: Layout,
    seats: Vec<(&'a mut Row, &'a mut C)>,
}

impl<C: Course> Riders<'_, C> {
    fn next(&mut self, k: usize) -> Option<Row> {
        let (at, course) = &mut self.seats[k];
        let row = course.next()?;
        **at = row;
        Some(row)
    }

    fn take(&mut self, k: usize, outcome: Outcome) {
        self.seats[k].1.take(outcome);
    }
}

impl<C: Course> Ticks for Riders<'_, C> {
    fn inputs(&mut self, k: usize) -> Option<Inputs> {
        let row = self.next(k)?;
        Some(row.inputs(self.layout))
    }

    fn outputs(&mut self, k: usize, found: &control::Outputs, tip_m: Option<[f32; 3]>) {
        self.take(k, Outcome::of_device(found, tip_m, true));
    }
}

/// The model in double precision, without a device around it.
struct OfModels<'a, 'l, C> {
    riders: Riders<'a, C>,
    models: &'a [&'a mechanics::Model<f64>],
    lumen: &'a mechanics::Lumen<'l>,
}

impl<C: Course> Attendant<f64, MAX_LINKS> for OfModels<'_, '_, C> {
    fn before(&mut self, k: usize) -> Option<Drives<f64>> {
        Some(self.riders.next(k)?.drives())
    }

    fn out(&mut self, k: usize, state: &mut mechanics::State<f64>) {
        while let Some(row) = self.riders.next(k) {
            let contact = mechanics::step(self.models[k], self.lumen, state, row.drives());
            self.riders.take(k, Outcome { contact, tip_m: state.node_position_m(0), device: None });
        }
    }

    fn after(&mut self, found: &Found<'_, f64>, _anew: &mut [bool]) {
        for (k, contact) in found.outputs.iter().enumerate() {
            if let Some(contact) = *contact {
                self.riders.take(k, Outcome { contact, tip_m: found.tips_m[k], device: None });
            }
        }
    }
}
