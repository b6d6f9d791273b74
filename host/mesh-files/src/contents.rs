//! What a file holds, and why one is not read.

use nalgebra::Vector3;

/// A point in the file's own unit.
pub type Point = Vector3<f64>;

/// The format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    VtkXml,
    Obj,
    Ply,
    Stl,
    Markups,
    Table,
}

/// What a file holds, in its own unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    pub format: Format,
    pub points: Vec<Point>,
    /// Corners of each facet, as indices into `points`.
    pub facets: Vec<[u32; 3]>,
    /// Points of each line, as indices into `points`.
    pub lines: Vec<Vec<u32>>,
    /// Arrays of a number for each point, by their names.
    pub scalars: Vec<(String, Vec<f64>)>,
    /// What the file says of itself and what was left out.
    pub remarks: Vec<String>,
    /// The unit that the file names, in metres.
    pub unit: Option<(String, f64)>,
}

/// Why a file is not read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{problem}; fix: {fix}", .line.map_or(String::new(), |line| format!("line {line}: ")))]
pub struct FileError {
    pub line: Option<usize>,
    pub problem: String,
    pub fix: String,
}

impl FileError {
    pub(crate) fn new(problem: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { line: None, problem: problem.into(), fix: fix.into() }
    }

    pub(crate) fn at(line: usize, problem: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { line: Some(line), ..Self::new(problem, fix) }
    }
}

impl Format {
    pub fn name(self) -> &'static str {
        match self {
            Self::VtkXml => "VTK XML",
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::Markups => "markups of 3D Slicer",
            Self::Table => "a table of points",
        }
    }
}

impl Contents {
    pub(crate) fn new(format: Format) -> Self {
        Self {
            format,
            points: Vec::new(),
            facets: Vec::new(),
            lines: Vec::new(),
            scalars: Vec::new(),
            remarks: Vec::new(),
            unit: None,
        }
    }

    /// Refuses coordinates that are none, and corners that are not there.
    pub(crate) fn check(self) -> Result<Self, FileError> {
        let fix = "export the file again";
        if let Some(at) = self.points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(FileError::new(
                format!("point {at} has a coordinate that is no number"),
                fix,
            ));
        }
        let corners = self.facets.iter().flatten().chain(self.lines.iter().flatten());
        if let Some(corner) = corners.copied().find(|&corner| corner as usize >= self.points.len())
        {
            let count = self.points.len();
            let problem = format!("a corner is point {corner}, but there are {count} points");
            return Err(FileError::new(problem, fix));
        }
        if let Some((name, values)) =
            self.scalars.iter().find(|(_, values)| values.len() != self.points.len())
        {
            let (found, count) = (values.len(), self.points.len());
            let problem = format!("the array `{name}` has {found} values for {count} points");
            return Err(FileError::new(problem, fix));
        }
        Ok(self)
    }

    /// Adds a facet of any number of corners as a fan of triangles.
    pub(crate) fn add_polygon(&mut self, corners: &[u32]) {
        for pair in corners.get(1..).unwrap_or_default().windows(2) {
            self.facets.push([corners[0], pair[0], pair[1]]);
        }
    }
}
