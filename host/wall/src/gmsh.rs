//! Reads a wall from a mesh of Gmsh: MSH 4.1 or 2.2, as text, in millimetres.
//!
//! The one crate that reads MSH, `mshio`, has not been changed since 2020, reads version 4.1 only and
//! pulls in a parser of that time; the part of the format that a wall needs is read here. Source: the
//! manual of Gmsh, section "MSH file format".

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use thiserror::Error;

use crate::mesh::{MeshError, WallMesh};

/// Types of elements: triangles and tetrahedra with three, four, six and ten nodes.
const TRIANGLES: [(usize, usize); 2] = [(2, 3), (9, 6)];
const TETRAHEDRA: [(usize, usize); 2] = [(4, 4), (11, 10)];
/// Nodes of elements of the types 1 to 15, which is all that Gmsh writes of first and second order.
const NODES: [usize; 15] = [2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1];
/// Names of the physical surfaces.
const INNER: &str = "inner";
const FIXED: &str = "fixed";

/// Why a file is refused: the place, the cause and the fix.
#[derive(Debug, Error)]
#[error("{}:{line}: {cause}\n  fix: {fix}", file.display())]
pub struct GmshError {
    pub file: PathBuf,
    pub line: usize,
    pub cause: String,
    pub fix: String,
}

type Fault = (usize, String, String);

/// Words with their lines.
struct Words<'a> {
    words: Vec<(usize, &'a str)>,
    at: usize,
}

#[derive(Default)]
struct Read {
    nodes: HashMap<usize, u32>,
    places: Vec<Vector3<f64>>,
    /// Names of the physical surfaces by number.
    names: HashMap<usize, String>,
    /// Physical surfaces of each surface of the geometry (version 4.1).
    surfaces: HashMap<usize, Vec<usize>>,
    tetrahedra: Vec<[u32; 4]>,
    /// Triangles with the physical surfaces that they belong to.
    triangles: Vec<([u32; 3], Vec<usize>)>,
}

/// Reads a wall: its tetrahedra, the physical surface `inner` that is loaded, and the physical
/// surfaces `fixed` whose nodes do not move.
pub fn read_gmsh(file: &Path) -> Result<WallMesh, GmshError> {
    let refused =
        |(line, cause, fix): Fault| GmshError { file: file.to_path_buf(), line, cause, fix };
    let text = std::fs::read_to_string(file).map_err(|error| {
        let fix = "check the path, and save the mesh as text (`Mesh.Binary = 0`)";
        refused((0, format!("cannot be read: {error}"), fix.into()))
    })?;
    let words = text.lines().enumerate().flat_map(|(line, text)| {
        // Names in quotes may hold spaces.
        let text = text.trim();
        let is_name = text.contains('"');
        let split: Vec<&str> =
            if is_name { text.splitn(3, ' ').collect() } else { text.split_whitespace().collect() };
        split.into_iter().map(move |word| (line + 1, word))
    });
    let mut words = Words { words: words.collect(), at: 0 };
    let read = Read::of(&mut words).map_err(refused)?;
    read.mesh().map_err(refused)
}

impl Read {
    fn of(words: &mut Words<'_>) -> Result<Self, Fault> {
        let mut read = Self::default();
        let mut is_new = None;
        while let Some((line, word)) = words.next_word() {
            match word {
                "$MeshFormat" => is_new = Some(format(words)?),
                "$PhysicalNames" => read.names(words)?,
                "$Entities" => read.entities(words)?,
                "$Nodes" if is_new == Some(true) => read.nodes_new(words)?,
                "$Nodes" => read.nodes_old(words)?,
                "$Elements" if is_new == Some(true) => read.elements_new(words)?,
                "$Elements" => read.elements_old(words)?,
                // Sections of other content, such as $Periodic, are skipped word by word.
                _ if is_new.is_some() => {}
                _ => {
                    let fix = "give a file that Gmsh saved as .msh";
                    return Err((line, "this is no mesh of Gmsh".into(), fix.into()));
                }
            }
        }
        Ok(read)
    }

    fn names(&mut self, words: &mut Words<'_>) -> Result<(), Fault> {
        for _ in 0..words.whole()? {
            let dimension = words.whole()?;
            let number = words.whole()?;
            let (_, name) = words.word()?;
            if dimension == 2 {
                self.names.insert(number, name.trim_matches('"').to_owned());
            }
        }
        Ok(())
    }

    fn entities(&mut self, words: &mut Words<'_>) -> Result<(), Fault> {
        let counts = [words.whole()?, words.whole()?, words.whole()?, words.whole()?];
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let tag = words.whole()?;
                let extent = if dimension == 0 { 3 } else { 6 };
                words.skip(extent)?;
                let physical = words.whole()?;
                let physical: Vec<usize> = (0..physical)
                    .map(|_| words.number().map(|number| number.abs() as usize))
                    .collect::<Result<_, _>>()?;
                if dimension == 2 {
                    self.surfaces.insert(tag, physical);
                }
                if dimension > 0 {
                    let bounds = words.whole()?;
                    words.skip(bounds)?;
                }
            }
        }
        Ok(())
    }

    fn nodes_new(&mut self, words: &mut Words<'_>) -> Result<(), Fault> {
        let blocks = words.whole()?;
        words.skip(3)?;
        for _ in 0..blocks {
            words.skip(2)?;
            let parametric = words.whole()?;
            let count = words.whole()?;
            let tags: Vec<usize> = (0..count).map(|_| words.whole()).collect::<Result<_, _>>()?;
            if parametric != 0 {
                let line = words.line();
                let fix = "save it without parametric coordinates (`Mesh.SaveParametric = 0`)";
                return Err((line, "the nodes have parametric coordinates".into(), fix.into()));
            }
            for tag in tags {
                self.node(tag, words)?;
            }
        }
        Ok(())
    }

    fn nodes_old(&mut self, words: &mut Words<'_>) -> Result<(), Fault> {
        for _ in 0..words.whole()? {
            let tag = words.whole()?;
            self.node(tag, words)?;
        }
        Ok(())
    }

    fn node(&mut self, tag: usize, words: &mut Words<'_>) -> Result<(), Fault> {
        let place = Vector3::new(words.number()?, words.number()?, words.number()?);
        self.nodes.insert(tag, self.places.len() as u32);
        self.places.push(place);
        Ok(())
    }

    fn elements_new(&mut self, words: &mut Words<'_>) -> Result<(), Fault> {
        let blocks = words.whole()?;
        words.skip(3)?;
        for _ in 0..blocks {
            let dimension = words.whole()?;
            let entity = words.whole()?;
            let kind = words.whole()?;
            let physical = match dimension {
                2 => self.surfaces.get(&entity).cloned().unwrap_or_default(),
                _ => Vec::new(),
            };
            for _ in 0..words.whole()? {
                words.skip(1)?;
                self.element(kind, &physical, words)?;
            }
        }
        Ok(())
    }

    fn elements_old(&mut self, words: &mut Words<'_>) -> Result<(), Fault> {
        for _ in 0..words.whole()? {
            words.skip(1)?;
            let kind = words.whole()?;
            let tags: Vec<usize> = {
                let count = words.whole()?;
                (0..count).map(|_| words.whole()).collect::<Result<_, _>>()?
            };
            let physical: Vec<usize> = tags.first().copied().into_iter().collect();
            self.element(kind, &physical, words)?;
        }
        Ok(())
    }

    fn element(
        &mut self,
        kind: usize,
        physical: &[usize],
        words: &mut Words<'_>,
    ) -> Result<(), Fault> {
        let count = kind.checked_sub(1).and_then(|kind| NODES.get(kind)).copied();
        let count = count.ok_or_else(|| {
            let fix = "mesh with tetrahedra of first or second order";
            (words.line(), format!("elements of the type {kind} are not known here"), fix.into())
        })?;
        let line = words.line();
        let tags: Vec<usize> = (0..count).map(|_| words.whole()).collect::<Result<_, _>>()?;
        let node = |tag: &usize| {
            self.nodes.get(tag).copied().ok_or_else(|| {
                let fix = "save the mesh again; $Nodes comes before $Elements";
                (line, format!("node {tag} is not in the file"), fix.to_owned())
            })
        };
        let is = |known: &[(usize, usize)]| known.iter().any(|(known, _)| *known == kind);
        if is(&TETRAHEDRA) {
            let corners = [node(&tags[0])?, node(&tags[1])?, node(&tags[2])?, node(&tags[3])?];
            self.tetrahedra.push(corners);
        } else if is(&TRIANGLES) {
            let corners = [node(&tags[0])?, node(&tags[1])?, node(&tags[2])?];
            self.triangles.push((corners, physical.to_vec()));
        }
        Ok(())
    }

    fn mesh(self) -> Result<WallMesh, Fault> {
        let of = |name: &str| -> Vec<[u32; 3]> {
            let is_named = |number: &usize| self.names.get(number).is_some_and(|n| n == name);
            let belongs = |physical: &[usize]| physical.iter().any(is_named);
            self.triangles.iter().filter(|(_, all)| belongs(all)).map(|(t, _)| *t).collect()
        };
        let (mut inner, fixed) = (of(INNER), of(FIXED));
        for (name, found) in [(INNER, &inner), (FIXED, &fixed)] {
            if found.is_empty() {
                let cause = format!("no triangle belongs to a physical surface `{name}`");
                let fix = format!(
                    "name the surface that is loaded `{INNER}` and those that are held `{FIXED}`: \
                     `Physical Surface(\"{name}\") = {{…}};`, beside a `Physical Volume`"
                );
                return Err((0, cause, fix));
            }
        }
        // Nodes of edges of second order, and of surfaces alone, are no corners.
        let mut number = vec![None; self.places.len()];
        let mut corners = Vec::new();
        let tetrahedra: Vec<[u32; 4]> = self
            .tetrahedra
            .iter()
            .map(|t| {
                t.map(|node| {
                    *number[node as usize].get_or_insert_with(|| {
                        corners.push(self.places[node as usize]);
                        corners.len() as u32 - 1
                    })
                })
            })
            .collect();
        let renumber = |t: &[u32; 3]| {
            let all = t.map(|node| number[node as usize]);
            match all {
                [Some(a), Some(b), Some(c)] => Ok([a, b, c]),
                _ => {
                    let fix = "mesh the volume again, with its surfaces";
                    Err((
                        0,
                        "a named triangle belongs to no tetrahedron".to_owned(),
                        fix.to_owned(),
                    ))
                }
            }
        };
        inner = inner.iter().map(renumber).collect::<Result<_, _>>()?;
        let fixed: Vec<[u32; 3]> = fixed.iter().map(renumber).collect::<Result<_, _>>()?;
        let mut held: Vec<u32> = fixed.into_flattened();
        held.sort_unstable();
        held.dedup();
        turn_outwards(&mut inner, &tetrahedra, &corners)?;
        let middle = |a: &Vector3<f64>, b: &Vector3<f64>| (a + b) * 0.5;
        WallMesh::quadratic(corners, tetrahedra, &inner, &held, middle).map_err(
            |error: MeshError| {
                let text = error.to_string();
                let (cause, fix) = text.split_once("\n  fix: ").unwrap_or((&text, ""));
                (0, cause.to_owned(), fix.to_owned())
            },
        )
    }
}

/// Turns triangles so that their normal points out of the material.
fn turn_outwards(
    triangles: &mut [[u32; 3]],
    tetrahedra: &[[u32; 4]],
    corners: &[Vector3<f64>],
) -> Result<(), Fault> {
    let sorted = |mut t: [u32; 3]| {
        t.sort_unstable();
        t
    };
    let mut opposite: HashMap<[u32; 3], u32> = HashMap::new();
    for t in tetrahedra {
        for k in 0..4 {
            let side = [t[(k + 1) % 4], t[(k + 2) % 4], t[(k + 3) % 4]];
            opposite.insert(sorted(side), t[k]);
        }
    }
    for t in triangles {
        let Some(behind) = opposite.get(&sorted(*t)) else {
            let fix = "mesh the volume again, with its surfaces";
            return Err((
                0,
                "a triangle of `inner` is no side of a tetrahedron".into(),
                fix.into(),
            ));
        };
        let at = |vertex: u32| corners[vertex as usize];
        let normal = (at(t[1]) - at(t[0])).cross(&(at(t[2]) - at(t[0])));
        if normal.dot(&(at(*behind) - at(t[0]))) > 0.0 {
            t.swap(1, 2);
        }
    }
    Ok(())
}

/// Whether the file is of version 4.1.
fn format(words: &mut Words<'_>) -> Result<bool, Fault> {
    let (line, version) = words.word()?;
    let is_binary = words.whole()? != 0;
    words.skip(1)?;
    let fix = "save it as text in version 4.1 or 2.2: `gmsh -save -format msh41 -o out.msh in.msh`";
    match version {
        _ if is_binary => Err((line, "the mesh is binary".into(), fix.into())),
        "4.1" => Ok(true),
        "2.2" | "2" => Ok(false),
        other => Err((line, format!("version {other} of the format is not read"), fix.into())),
    }
}

impl<'a> Words<'a> {
    fn next_word(&mut self) -> Option<(usize, &'a str)> {
        let word = self.words.get(self.at).copied();
        self.at += 1;
        word
    }

    fn line(&self) -> usize {
        let last = self.words.last().map_or(0, |(line, _)| *line);
        self.words.get(self.at).map_or(last, |(line, _)| *line)
    }

    fn word(&mut self) -> Result<(usize, &'a str), Fault> {
        let line = self.line();
        self.next_word()
            .ok_or_else(|| (line, "the file ends too early".into(), "save the mesh again".into()))
    }

    fn skip(&mut self, count: usize) -> Result<(), Fault> {
        (0..count).try_for_each(|_| self.word().map(|_| ()))
    }

    fn whole(&mut self) -> Result<usize, Fault> {
        let (line, word) = self.word()?;
        word.parse().map_err(|_| {
            (line, format!("`{word}` is not a whole number"), "save the mesh again".into())
        })
    }

    fn number(&mut self) -> Result<f64, Fault> {
        let (line, word) = self.word()?;
        let value = word.parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| {
            (line, format!("`{word}` is not a finite number"), "save the mesh again".into())
        })
    }
}
