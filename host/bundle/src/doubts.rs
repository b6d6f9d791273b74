//! Warnings about a lumen that could be built.

use crate::geometry::{GAP_M, SLEEVE_M};
use crate::vessel::{LumenReport, QUALITY_POINTS, WallSource};

/// Error of a stored distance above which a finer grid is advised \[m\].
const LARGEST_ERROR_M: f64 = 50e-6;
/// The finest grid that can be asked for \[m\].
const FINEST_CELL_M: f64 = 0.1e-3;
/// A surface that was decimated with care lies no farther from its facets \[m\]: their sagitta,
/// L²/8R, for edges of 2.5 mm on a vessel of 3 mm radius. Where the curved surface leaves them by
/// more, the mesh is more likely one of flat walls and few, long facets.
const FARTHEST_OFF_FACETS_M: f64 = 0.25e-3;
/// The widest place is found by sampling, so the vessel may be a little wider.
const SURELY_NARROWER: f64 = 0.9;
fn millimetres(place_m: impl Into<[f64; 3]>) -> String {
    let [x, y, z] = place_m.into().map(|x| 1e3 * x);
    format!("({x:.1}, {y:.1}, {z:.1}) mm")
}

impl LumenReport {
    /// What looks wrong, a sentence each.
    pub fn doubts(&self) -> Vec<String> {
        let mut doubts = Vec::new();
        doubts.extend(self.doubtful_room());
        doubts.extend(self.doubtful_distance());
        doubts.extend(self.doubtful_surface());
        doubts.extend(self.doubts_of_openings(self.outer_radius_m));
        for opening in self.openings.iter().filter(|opening| opening.sleeve_m < SLEEVE_M) {
            doubts.push(format!(
                "past the opening at {} the wall goes on for {:.1} mm only: another part of the \
                 vessel lies there; cut the vessel farther from it",
                millimetres(opening.centre_m),
                1e3 * opening.sleeve_m
            ));
        }
        doubts
    }

    /// What is wrong with the openings of a mesh, for an instrument of this radius \[m\].
    pub fn doubtful_openings(&self, outer_radius_m: f64) -> Option<String> {
        let doubts = self.doubts_of_openings(outer_radius_m);
        (!doubts.is_empty()).then(|| doubts.join("; "))
    }

    fn doubts_of_openings(&self, outer_radius_m: f64) -> Vec<String> {
        if !matches!(self.source, WallSource::Mesh { .. }) {
            return Vec::new();
        }
        let mut doubts = Vec::new();
        let diameter_mm = 2e3 * outer_radius_m;
        let narrow = self.openings.iter().filter(|o| o.radius_m < outer_radius_m).count();
        match (narrow, self.openings.len()) {
            (_, 0) => doubts.push(format!(
                "the surface has no opening of more than {:.1} mm: an instrument cannot enter it",
                2e3 * GAP_M
            )),
            (0, _) => {}
            (narrow, all) if narrow == all => doubts
                .push(format!("no opening is as wide as the instrument of {diameter_mm:.2} mm")),
            (narrow, all) => doubts.push(format!(
                "{narrow} of {all} openings are narrower than the instrument of \
                 {diameter_mm:.2} mm: holes in the surface?"
            )),
        }
        for hole in self.openings.iter().filter(|opening| opening.is_flush) {
            doubts.push(format!(
                "the opening at {}, of {:.2} mm radius, lies in the wall and does not end a tube: a \
                 hole in the surface? Then close it",
                millimetres(hole.centre_m),
                1e3 * hole.radius_m
            ));
        }
        doubts
    }

    fn doubtful_room(&self) -> Option<String> {
        let points = self.quality.points;
        let diameter_mm = 2e3 * self.outer_radius_m;
        if points > 0 && self.widest_m >= SURELY_NARROWER * self.outer_radius_m {
            let few = points < QUALITY_POINTS;
            return few.then(|| {
                format!(
                    "the stored distance could be compared at {points} points only, of \
                     {QUALITY_POINTS}: hardly anywhere is room for an instrument of {diameter_mm:.2} mm"
                )
            });
        }
        let widest_mm = 2e3 * self.widest_m;
        Some(format!(
            "nowhere is room for an instrument of {diameter_mm:.2} mm: the vessel is some \
             {widest_mm:.3} mm wide at most"
        ))
    }

    fn doubtful_distance(&self) -> Vec<String> {
        let quality = &self.quality;
        let mut doubts = Vec::new();
        let (worst_m, worst_at) = (quality.distance_m.max, millimetres(quality.worst_at_m));
        if worst_m > LARGEST_ERROR_M {
            // The error falls at least in proportion to the spacing.
            let finer_m = self.cell_m * LARGEST_ERROR_M / worst_m;
            let remedy = match finer_m < FINEST_CELL_M {
                true => "no grid helps; look at the mesh there".to_owned(),
                false => format!(
                    "for less than {:.0} µm take a grid of about {:.2} mm (--cell)",
                    1e6 * LARGEST_ERROR_M,
                    1e3 * finer_m
                ),
            };
            doubts.push(format!(
                "the stored distance errs by {:.0} µm at {worst_at}; {remedy}",
                1e6 * worst_m
            ));
        }
        if quality.not_stored > 0 {
            let share = quality.not_stored as f64 / (quality.points + quality.not_stored) as f64;
            doubts.push(format!(
                "{:.2} % of the places where the instrument touches the wall are not stored, the \
                 device sees no wall there, as at {}; take a finer grid (--cell), or look at the \
                 mesh there",
                100.0 * share,
                millimetres(quality.not_stored_at_m)
            ));
        }
        doubts
    }

    fn doubtful_surface(&self) -> Option<String> {
        let (off_m, at) = self.off_facets?;
        (off_m > FARTHEST_OFF_FACETS_M).then(|| {
            format!(
                "the smooth surface leaves the facets of the mesh by up to {:.2} mm, at {}: if its \
                 walls are flat there, divide its long facets and export it again; `cathforce lumen \
                 --surface flat` shows how far that matters",
                1e3 * off_m,
                millimetres(at)
            )
        })
    }
}
