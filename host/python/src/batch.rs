//! Many catheters, stepped together.

use std::sync::{Mutex, MutexGuard, PoisonError};

use cathforce_mechanics::MAX_LINKS;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::abreast::ride;
use crate::arrays::{numbers, reals, rows, shaped};
use crate::course::{Even, Rows};
use crate::errors::UsageError;
use crate::interrupt::until_done;
use crate::model::Model;
use crate::row::Row;
use crate::snapshot::Snapshot;
use crate::ticks::Ticks;
use crate::twin::{Node, Outcome, Rig, Twin};

/// Ticks of each catheter between two looks at the clock. To lay catheters abreast takes longer than a tick
/// (`cargo xtask bench --environments`), so that fewer would cost.
const PART: usize = 50;
/// Catheters that come to rest between two looks at the clock: each takes some hundred ticks.
const RESETS: usize = 64;

/// `n` independent catheters.
#[pyclass(frozen, subclass, module = "cathforce")]
pub struct Batch {
    model: Py<Model>,
    twins: Mutex<Vec<Twin>>,
    n: usize,
}

/// What each catheter is reset to.
struct Start {
    index: usize,
    at: Row,
    rig: Option<Rig>,
}

/// Names and values of what one catheter has otherwise.
type Parameters = Vec<(String, f64)>;

impl Batch {
    fn locked(&self) -> MutexGuard<'_, Vec<Twin>> {
        self.twins.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn rig(&self) -> &Rig {
        &self.model.get().rig
    }

    fn rows(
        &self,
        given: &Bound<'_, PyAny>,
        leading: &[(&str, Option<usize>)],
    ) -> PyResult<(Vec<Row>, Vec<usize>)> {
        rows(given, self.rig().layout(), self.rig().reach_m(), leading)
    }

    /// The catheters of a mask or of a list of indices; all of them without one.
    fn which(&self, given: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<usize>> {
        let Some(given) = given else { return Ok((0..self.n).collect()) };
        let (values, shape) = numbers(given, "which")?;
        let refused = |message: String| Err(UsageError::new_err(message));
        if shape.len() != 1 {
            return refused(format!(
                "which has the shape {shape:?}\n  fix: give a list of indices or a mask"
            ));
        }
        let is_mask = given.py().import("numpy")?.call_method1("asarray", (given,))?;
        let is_mask = is_mask.getattr("dtype")?.getattr("kind")?.extract::<String>()? == "b";
        if is_mask {
            if values.len() != self.n {
                return refused(format!(
                    "which masks {} catheters, and there are {}",
                    values.len(),
                    self.n
                ));
            }
            return Ok((0..self.n).filter(|&k| values[k] != 0.0).collect());
        }
        let mut found = Vec::with_capacity(values.len());
        for value in values {
            let index = value as usize;
            if index as f64 != value || index >= self.n {
                return refused(format!(
                    "which has {value}, and the catheters are 0 to {}",
                    self.n - 1
                ));
            }
            found.push(index);
        }
        Ok(found)
    }

    /// The parameters of each catheter of `which`; `None` where none is given.
    fn parameters(
        &self,
        given: Option<&Bound<'_, PyDict>>,
        which: &[usize],
    ) -> PyResult<Option<Vec<Parameters>>> {
        let Some(given) = given.filter(|given| !given.is_empty()) else { return Ok(None) };
        let mut all = vec![Vec::new(); which.len()];
        for (name, values) in given {
            let name: String = name.extract()?;
            let (values, shape) = numbers(&values, &name)?;
            if !(shape.is_empty() || shape == [which.len()]) {
                return Err(UsageError::new_err(format!(
                    "{name} has the shape {shape:?}\n  fix: one number for all, or ({},), one for each",
                    which.len()
                )));
            }
            for (k, own) in all.iter_mut().enumerate() {
                let value = if shape.is_empty() { values[0] } else { values[k] };
                cathforce_bundle::setting::check(&name, value as f32).map_err(
                    |(message, fix)| {
                        UsageError::new_err(format!("parameters: {message}\n  fix: {fix}"))
                    },
                )?;
                if self.rig().setting(&name).is_some() {
                    return Err(UsageError::new_err(format!(
                        "parameters: {name} is a setting of the operator, which all catheters share\n  fix: \
                         give it to the model, Model(…, settings={{\"{name}\": …}})"
                    )));
                }
                own.push((name.clone(), value));
            }
        }
        Ok(Some(all))
    }

    fn is_double(&self) -> bool {
        self.rig().is_double()
    }

    /// A vector for each node, NaN beyond the nodes that are inside.
    fn of_nodes(&self, py: Python<'_>, of: fn(&Node) -> [f64; 3]) -> PyResult<Py<PyAny>> {
        let values = py.detach(|| {
            let mut values = vec![f64::NAN; self.n * MAX_LINKS * 3];
            let places = values.par_chunks_mut(MAX_LINKS * 3);
            self.locked().par_iter().zip(places).for_each(|(twin, place)| {
                for (place, node) in place.chunks_mut(3).zip(twin.nodes().iter()) {
                    place.copy_from_slice(&of(node));
                }
            });
            values
        });
        reals(py, self.is_double(), values.into_iter(), &[self.n, MAX_LINKS, 3])
    }
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (model, n, *, parameters=None))]
    fn new(
        py: Python<'_>,
        model: Py<Model>,
        n: usize,
        parameters: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        if n == 0 {
            return Err(UsageError::new_err("n is 0\n  fix: give at least one catheter"));
        }
        let twins = vec![Twin::new(model.get().rig.clone()); n];
        let batch = Self { model, twins: Mutex::new(twins), n };
        batch.reset(py, None, None, parameters, None, false)?;
        Ok(batch)
    }

    #[getter]
    fn model(&self, py: Python<'_>) -> Py<Model> {
        self.model.clone_ref(py)
    }

    #[getter]
    fn n(&self) -> usize {
        self.n
    }

    fn __len__(&self) -> usize {
        self.n
    }

    #[pyo3(signature = (positions=None, *, which=None, parameters=None, snapshot=None, armed=false))]
    fn reset(
        &self,
        py: Python<'_>,
        positions: Option<&Bound<'_, PyAny>>,
        which: Option<&Bound<'_, PyAny>>,
        parameters: Option<&Bound<'_, PyDict>>,
        snapshot: Option<&Snapshot>,
        armed: bool,
    ) -> PyResult<()> {
        let which = self.which(which)?;
        if let Some(Snapshot(state)) = snapshot {
            if positions.is_some() || parameters.is_some() {
                let message =
                    "a snapshot has its positions and parameters\n  fix: give the snapshot alone";
                return Err(UsageError::new_err(message));
            }
            if state.rig.is_double() != self.is_double() {
                let message = "the snapshot is of the other precision\n  fix: take one of a model of this dtype";
                return Err(UsageError::new_err(message));
            }
            py.detach(|| {
                let mut twins = self.locked();
                which.iter().for_each(|&index| twins[index].clone_from(state));
            });
            return Ok(());
        }
        let at = match positions {
            Some(given) => self.rows(given, &[("n", Some(which.len()))])?.0,
            None => vec![Row::default(); which.len()],
        };
        let parameters = self.parameters(parameters, &which)?;
        let made = |k: usize| match &parameters {
            Some(parameters) => self.rig().with_parameters(&parameters[k]).map(Some),
            None => Ok(None),
        };
        let starts = py.detach(|| {
            let starts = which.par_iter().enumerate().map(|(k, &index)| {
                let rig = made(k).map_err(|error| format!("catheter {index}: {error}"))?;
                Ok(Start { index, at: at[k], rig })
            });
            starts.collect::<Result<Vec<Start>, String>>()
        });
        let starts = starts.map_err(UsageError::new_err)?;
        let mut start = vec![None; self.n];
        py.detach(|| {
            let mut twins = self.locked();
            for Start { index, rig, at } in &starts {
                if let Some(rig) = rig {
                    twins[*index] = Twin::new(rig.clone());
                }
                start[*index] = Some(*at);
            }
        });
        let mut next = 0;
        until_done(py, || {
            let mut twins = self.locked();
            let part = next..self.n.min(next + RESETS);
            let both = twins[part.clone()].par_iter_mut().zip(&start[part.clone()]);
            let settled = both.enumerate().map(|(k, (twin, start))| {
                let Some(at) = start else { return Ok(()) };
                let k = part.start + k;
                twin.reset(*at, armed).map_err(|error| format!("catheter {k}: {error}"))
            });
            settled.collect::<Result<(), String>>().map_err(UsageError::new_err)?;
            next = part.end;
            Ok(next == self.n)
        })
    }

    fn step(&self, py: Python<'_>, positions: &Bound<'_, PyAny>) -> PyResult<Ticks> {
        let (rows, shape) = self.rows(positions, &[("n", Some(self.n))])?;
        let mut outcomes = vec![Outcome::default(); rows.len()];
        py.detach(|| {
            let mut twins = self.locked();
            let places = outcomes.chunks_mut(1).zip(rows.chunks(1));
            let courses = places.map(|(places, rows)| Rows::new(rows, places));
            ride(twins.iter_mut().zip(courses).collect());
        });
        Ok(Ticks::new(outcomes, None, shape, self.is_double()))
    }

    fn step_many(&self, py: Python<'_>, positions: &Bound<'_, PyAny>) -> PyResult<Ticks> {
        let (rows, shape) = self.rows(positions, &[("n", Some(self.n)), ("ticks", None)])?;
        let ticks = shape[1];
        let mut outcomes = vec![Outcome::default(); rows.len()];
        if ticks > 0 {
            let mut done = 0;
            until_done(py, || {
                let mut twins = self.locked();
                let most = PART.min(ticks - done);
                let places = outcomes.chunks_mut(ticks).zip(rows.chunks(ticks));
                let part = done..done + most;
                let courses = places.map(|(places, rows)| {
                    Rows::new(&rows[part.clone()], &mut places[part.clone()])
                });
                ride(twins.iter_mut().zip(courses).collect());
                done += most;
                Ok(done == ticks)
            })?;
        }
        Ok(Ticks::new(outcomes, None, shape, self.is_double()))
    }

    #[pyo3(signature = (positions, ticks))]
    fn move_to(
        &self,
        py: Python<'_>,
        positions: &Bound<'_, PyAny>,
        ticks: usize,
    ) -> PyResult<Ticks> {
        let (rows, shape) = self.rows(positions, &[("n", Some(self.n))])?;
        if ticks == 0 {
            return Err(UsageError::new_err("ticks is 0\n  fix: give at least one tick"));
        }
        let mut outcomes = vec![Outcome::default(); rows.len()];
        let mut peaks_n = vec![0.0; rows.len()];
        let from: Vec<Row> = py.detach(|| self.locked().iter().map(|twin| twin.at).collect());
        let answers = outcomes.iter_mut().zip(&mut peaks_n);
        let courses = from.into_iter().zip(&rows).zip(answers);
        let mut courses: Vec<Even<'_>> = courses
            .map(|((from, goal), (last, peak_n))| Even::new(from, goal, ticks, last, peak_n))
            .collect();
        until_done(py, || {
            let mut goes_on = false;
            courses.iter_mut().for_each(|course| goes_on |= course.go_on(PART));
            if goes_on {
                ride(self.locked().iter_mut().zip(&mut courses).collect());
            }
            Ok(!goes_on)
        })?;
        Ok(Ticks::new(outcomes, Some(peaks_n), shape, self.is_double()))
    }

    fn snapshot(&self, py: Python<'_>, index: usize) -> PyResult<Snapshot> {
        if index >= self.n {
            let message = format!("there is no catheter {index}\n  fix: 0 to {}", self.n - 1);
            return Err(UsageError::new_err(message));
        }
        Ok(Snapshot(py.detach(|| self.locked()[index].clone())))
    }

    /// Each catheter becomes a copy of one of them.
    fn select(&self, py: Python<'_>, indices: &Bound<'_, PyAny>) -> PyResult<()> {
        let indices = self.which(Some(indices))?;
        if indices.len() != self.n {
            let message = format!(
                "indices has {} numbers\n  fix: one for each of the {} catheters",
                indices.len(),
                self.n
            );
            return Err(UsageError::new_err(message));
        }
        py.detach(|| {
            let mut twins = self.locked();
            *twins = indices.par_iter().map(|&index| twins[index].clone()).collect();
        });
        Ok(())
    }

    #[getter]
    fn positions(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let layout = self.rig().layout();
        let rows: Vec<Row> = py.detach(|| self.locked().iter().map(|twin| twin.at).collect());
        let numbers: Vec<f64> = rows.iter().flat_map(|row| layout.numbers(row)).collect();
        shaped(py, numbers, &[self.n, layout.columns().len()])
    }

    #[getter]
    fn shape_m(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.of_nodes(py, |node| node.position_m)
    }

    #[getter]
    fn contact_forces_n(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.of_nodes(py, |node| node.force_n)
    }

    fn __repr__(&self) -> String {
        format!("<cathforce.Batch of {} catheters, {}>", self.n, self.model.get().shown())
    }
}
