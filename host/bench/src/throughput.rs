//! Cost of a tick on the host over links, contacts and the size of the lumen.

use cathforce_bundle::SolverDefaults;
use cathforce_mechanics::{
    Compiled, Drive, Lumen, MAX_LINKS, MOST_LINKS, Model, State, settle, step,
};
use serde::Serialize;

use crate::clock::Stopwatch;
use crate::insertion::{INSERTION, Insertion, Tube};

/// Number of batches, of which the fastest counts, since disturbances only slow a batch down.
const BATCHES: usize = 10;
/// Ticks of a batch at 64 links; fewer for more links.
const TICKS: usize = 500;
/// Spacing of the lumen unless it is varied \[m\].
const CELL_M: f64 = 1e-3;

/// Cost of a tick on the host.
#[derive(Debug, Serialize)]
pub struct Throughput {
    /// Simulated over processor time, on one core with 64 links and ticks of 1 ms \[1\].
    pub real_time_factor_64_links: f64,
    /// The insertion's instrument in its vessel, over the number of links.
    pub scaling: Vec<Scaling>,
    /// 64 links in tubes of different widths.
    pub contacts: Vec<Contacts>,
    /// 64 links in the same tube, over the size of the stored lumen.
    pub lumen: Vec<LumenSize>,
}

/// Time of a tick with this number of links.
#[derive(Debug, Serialize)]
pub struct Scaling {
    pub links: usize,
    pub us_per_tick: f64,
}

/// Time of a tick with this number of nodes in contact.
#[derive(Debug, Serialize)]
pub struct Contacts {
    pub nodes_in_contact: usize,
    pub us_per_tick: f64,
}

/// Time of a tick with a lumen of this spacing and size.
#[derive(Debug, Serialize)]
pub struct LumenSize {
    pub cell_mm: f64,
    pub bytes: usize,
    pub us_per_tick: f64,
}

/// Measures all of it on one core.
pub fn measure() -> anyhow::Result<Throughput> {
    let scaling = scalings()?;
    let at_64 = scaling.iter().find(|row| row.links == 64).map_or(f64::NAN, |row| row.us_per_tick);
    Ok(Throughput {
        real_time_factor_64_links: 1e6 * INSERTION.sample_s / at_64,
        scaling,
        contacts: [20e-3, 3.5e-3, 1.2e-3, 0.84e-3]
            .map(contacts)
            .into_iter()
            .collect::<Result<_, _>>()?,
        lumen: [2e-3, 1e-3, 0.5e-3].map(lumen_size).into_iter().collect::<Result<_, _>>()?,
    })
}

/// The device's number of links, fewer and more; more than the device's have a longer state.
fn scalings() -> anyhow::Result<Vec<Scaling>> {
    let on_device = [16, 32, MAX_LINKS].map(scaling::<MAX_LINKS>);
    let longer = [128, 256, MOST_LINKS].map(scaling::<MOST_LINKS>);
    on_device.into_iter().chain(longer).collect()
}

fn scaling<const MOST: usize>(links: usize) -> anyhow::Result<Scaling>
where
    f32: Compiled<MOST>,
{
    let (us_per_tick, _) = tick::<MOST>(&INSERTION, CELL_M, links)?.measure()?;
    Ok(Scaling { links, us_per_tick })
}

/// 64 links in a tube of constant radius; fewer nodes touch a wider one.
fn contacts(radius_m: f64) -> anyhow::Result<Contacts> {
    let tube = Tube { first_radius_m: radius_m, last_radius_m: radius_m, ..INSERTION.tube };
    let (us_per_tick, nodes_in_contact) =
        tick::<MAX_LINKS>(&Insertion { tube, ..INSERTION }, CELL_M, MAX_LINKS)?.measure()?;
    Ok(Contacts { nodes_in_contact, us_per_tick })
}

fn lumen_size(cell_m: f64) -> anyhow::Result<LumenSize> {
    let scene = tick::<MAX_LINKS>(&INSERTION, cell_m, MAX_LINKS)?;
    let (us_per_tick, _) = scene.measure()?;
    Ok(LumenSize { cell_mm: 1e3 * cell_m, bytes: scene.bytes.len(), us_per_tick })
}

/// Model, lumen and state of a tick.
struct Scene<const MOST: usize> {
    model: Model<f32, MOST>,
    links: usize,
    header: cathforce_mechanics::LumenHeader,
    bytes: Vec<u8>,
    /// Of the instrument, with half of the last link, and of a link \[m\].
    inside_m: [f32; 2],
}

/// The instrument wholly inside, with every link in use.
fn tick<const MOST: usize>(
    insertion: &Insertion,
    cell_m: f64,
    links: usize,
) -> anyhow::Result<Scene<MOST>>
where
    f32: Compiled<MOST>,
{
    let half_of_last = links as f64 - 0.5;
    let link_m = SolverDefaults::default().link_length_over(insertion.length_m, half_of_last);
    let model = Model::new(insertion.description(link_m))
        .map_err(|error| anyhow::anyhow!("{links} links: {error:?}"))?;
    let built = insertion.lumen(cell_m)?;
    let inside_m = [insertion.length_m, link_m].map(|length_m| length_m as f32);
    Ok(Scene { model, links, header: built.header, bytes: built.bytes, inside_m })
}

impl<const MOST: usize> Scene<MOST>
where
    f32: Compiled<MOST>,
{
    /// Processor time of a tick \[µs\], and the nodes in contact at the end.
    fn measure(&self) -> anyhow::Result<(f64, usize)> {
        let lumen = Lumen::new(self.header, &self.bytes)
            .map_err(|error| anyhow::anyhow!("the lumen: {error:?}"))?;
        let mut state = State::new();
        // The drive moves to and fro within the base link, so that every tick has all links.
        let at = |tick: usize| {
            let phase = (tick % 200) as f32 / 100.0 - 1.0;
            let [inside_m, link_m] = self.inside_m;
            let insertion_m = inside_m + link_m * 0.3 * (phase.abs() - 0.5);
            Drive { insertion_m, rotation_rad: 0.0 }
        };
        while !settle(&self.model, &lumen, &mut state, at(0)) {}
        let links = self.links;
        let ticks = TICKS * MAX_LINKS / links.max(MAX_LINKS);
        let mut fastest = f64::INFINITY;
        for batch in 0..BATCHES {
            let watch = Stopwatch::start();
            for tick in batch * ticks..(batch + 1) * ticks {
                std::hint::black_box(step(&self.model, &lumen, &mut state, at(tick)));
            }
            fastest = fastest.min(1e6 * watch.elapsed().as_secs_f64() / ticks as f64);
        }
        anyhow::ensure!(state.nodes() == links, "{} of {links} links inside", state.nodes());
        let force_n = |node| state.node_force_n(node).unwrap_or_default();
        let touching = (0..links).filter(|&node| force_n(node) != [0.0; 3]).count();
        Ok((fastest, touching))
    }
}
