//! Lines with radii as the centre line of a bundle.
//!
//! VMTK writes a line from the inlet to each outlet, so that the lines of a tree run along each other. A
//! later line begins where it leaves the earlier ones.

use cathforce_bundle::geometry::{Branch, Station};

use crate::contents::{Contents, FileError, Point};

/// Names of the array of radii, the usual first.
const RADII: [&str; 4] =
    ["MaximumInscribedSphereRadius", "Radius", "radius", "CenterlineSectionRadius"];
/// Share of the radius by which a line may be off an earlier one and still run along it.
const ALONG: f64 = 0.2;

/// What the file does not say.
#[derive(Clone, Debug, PartialEq)]
pub struct LineOptions {
    /// The file's unit \[m\].
    pub unit_m: f64,
    /// The array of radii; `None` takes one that is named so.
    pub array: Option<String>,
    /// The radius of a file without radii \[m\].
    pub radius_m: Option<f64>,
}

/// The branches of a file's lines, and remarks on what was left out.
pub fn branches(
    contents: &Contents,
    options: &LineOptions,
) -> Result<(Vec<Branch>, Vec<String>), FileError> {
    if contents.lines.is_empty() {
        let fix = "give the centre line, for example of `vmtkcenterlines`, and not the surface";
        return Err(FileError::new("the file has no lines", fix));
    }
    let radii = radii(contents, options)?;
    let mut remarks = Vec::new();
    let mut branches: Vec<Branch> = Vec::new();
    for (index, line) in contents.lines.iter().enumerate() {
        let station = |&corner: &u32| {
            (contents.points[corner as usize] * options.unit_m, radii[corner as usize])
        };
        let mut stations = line.iter().map(station).collect::<Vec<(Point, f64)>>();
        let before = stations.len();
        stations.dedup_by(|a, b| a.0 == b.0);
        let doubled = before - stations.len();
        if doubled > 0 {
            remarks.push(format!(
                "line {index}: {doubled} points stand on the one before them and are left out"
            ));
        }
        if let Some((_, radius_m)) =
            stations.iter().find(|(_, radius_m)| radius_m.is_nan() || *radius_m <= 0.0)
        {
            let problem =
                format!("line {index} has a radius of {radius_m} m; a vessel has one above 0");
            return Err(FileError::new(problem, "give another array with --radius-array"));
        }
        let shared = stations.iter().take_while(|station| runs_along(station, &branches)).count();
        // The station before is on the earlier line, so that the two meet.
        let own = stations.split_off(shared.saturating_sub(1));
        if own.len() < 2 {
            remarks.push(format!("line {index} runs along others and is left out"));
            continue;
        }
        if shared > 1 {
            remarks.push(format!("line {index}: its first {} points run along others", shared - 1));
        }
        branches.push(branch(index, &own));
    }
    match branches.is_empty() {
        true => Err(FileError::new("no line has two points", "give the centre line again")),
        false => Ok((branches, remarks)),
    }
}

fn radii(contents: &Contents, options: &LineOptions) -> Result<Vec<f64>, FileError> {
    let named = |name: &str| contents.scalars.iter().find(|(own, _)| own == name);
    let found = match &options.array {
        Some(name) => {
            let names =
                contents.scalars.iter().map(|(name, _)| format!("`{name}`")).collect::<Vec<_>>();
            Some(named(name).ok_or_else(|| {
                let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
                FileError::new(
                    format!("there is no array `{name}`"),
                    format!("name one of the file's: {names}"),
                )
            })?)
        }
        None => RADII.iter().find_map(|name| named(name)),
    };
    match (found, options.radius_m) {
        (Some((_, values)), _) => Ok(values.iter().map(|radius| radius * options.unit_m).collect()),
        (None, Some(radius_m)) => Ok(vec![radius_m; contents.points.len()]),
        (None, None) => {
            let fix =
                "name its array with --radius-array, or give one radius for all with --radius";
            Err(FileError::new("the file has no array of radii", fix))
        }
    }
}

/// Whether a station lies on an earlier branch.
fn runs_along((point, radius_m): &(Point, f64), branches: &[Branch]) -> bool {
    let near = |branch: &Branch| {
        branch.stations.windows(2).any(|pair| {
            let [from, to] = [pair[0].position_m, pair[1].position_m];
            let along = to - from;
            let share = ((point - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            (from + along * share - point).norm() < ALONG * radius_m
        })
    };
    branches.iter().any(near)
}

fn branch(index: usize, stations: &[(Point, f64)]) -> Branch {
    let mut s_m = 0.0;
    let mut before = stations[0].0;
    let station = |&(position_m, radius_m): &(Point, f64)| {
        s_m += (position_m - before).norm();
        before = position_m;
        Station { s_m, position_m, radius_m }
    };
    Branch { name: format!("line{index}"), stations: stations.iter().map(station).collect() }
}

/// The branches as `centreline.csv`.
pub fn centreline_csv(branches: &[Branch]) -> String {
    let mut text = String::from("branch,s_m,x_m,y_m,z_m,radius_m\n");
    for branch in branches {
        for Station { s_m, position_m: p, radius_m } in &branch.stations {
            text += &format!(
                "{},{s_m:.7},{:.7},{:.7},{:.7},{radius_m:.7}\n",
                branch.name, p.x, p.y, p.z
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use cathforce_bundle::geometry::read_centreline;

    use super::*;
    use crate::contents::Format;

    /// Two lines in mm that part after 20 mm, the second with its last point doubled.
    fn tree() -> Contents {
        let mut contents = Contents::new(Format::VtkXml);
        let trunk = |k: u32| Point::new(2.0 * f64::from(k), 0.0, 0.0);
        let away = |k: u32, side: f64| {
            Point::new(20.0 + 2.0 * f64::from(k), side * 2.0 * f64::from(k), 0.0)
        };
        for side in [1.0, -1.0] {
            let first = contents.points.len() as u32;
            contents.points.extend((0..=10).map(trunk));
            contents.points.extend((1..=10).map(|k| away(k, side)));
            if side < 0.0 {
                contents.points.push(away(10, side));
            }
            contents.lines.push((first..contents.points.len() as u32).collect());
        }
        contents
            .scalars
            .push(("MaximumInscribedSphereRadius".into(), vec![3.0; contents.points.len()]));
        contents
    }

    #[test]
    fn lines_that_run_along_each_other_become_branches_that_meet() {
        let options = LineOptions { unit_m: 1e-3, array: None, radius_m: None };
        let (found, remarks) = branches(&tree(), &options).unwrap();
        let [first, second] = &found[..] else { panic!("{found:?}") };
        assert_eq!((first.stations.len(), second.stations.len()), (21, 11));
        assert!((second.stations[0].position_m.x - 20e-3).abs() < 1e-9, "{second:?}");
        let said = remarks.join("\n");
        assert!(
            said.contains("line 1: 1 points stand on")
                && said.contains("first 10 points run along"),
            "{said}"
        );
        let (read, remarks) = read_centreline(&centreline_csv(&found)).unwrap();
        assert_eq!((read.len(), remarks.len()), (2, 0));
        assert!((read[0].stations[20].s_m - (20e-3 + 10.0 * 8f64.sqrt() * 1e-3)).abs() < 1e-6);
    }

    #[test]
    fn radii_come_from_an_array_or_from_the_user() {
        let mut contents = tree();
        let options = |array: Option<&str>, radius_m| LineOptions {
            unit_m: 1e-3,
            array: array.map(str::to_owned),
            radius_m,
        };
        let wrong = branches(&contents, &options(Some("width"), None)).unwrap_err();
        assert!(wrong.fix.contains("`MaximumInscribedSphereRadius`"), "{wrong}");
        contents.scalars.clear();
        assert!(branches(&contents, &options(None, None)).unwrap_err().fix.contains("--radius"));
        let (found, _) = branches(&contents, &options(None, Some(2e-3))).unwrap();
        assert_eq!(found[0].stations[0].radius_m, 2e-3);
        contents.lines.clear();
        assert!(
            branches(&contents, &options(None, None)).unwrap_err().problem.contains("no lines")
        );
    }
}
