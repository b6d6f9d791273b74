//! One catheter.

use std::sync::{Mutex, MutexGuard, PoisonError};

use cathforce_control::Command;
use pyo3::prelude::*;

use crate::arrays::{reals, rows, shaped};
use crate::errors::{FaultError, UsageError};
use crate::interrupt::until_done;
use crate::model::Model;
use crate::row::{Layout, Row};
use crate::snapshot::Snapshot;
use crate::ticks::Ticks;
use crate::twin::{Node, Outcome, Twin};

/// Ticks between two looks at the clock: well below a millisecond.
const PART: usize = 64;

/// One catheter in its vessel.
#[pyclass(frozen, subclass, module = "cathforce")]
pub struct Simulator {
    model: Py<Model>,
    /// Whether a fault of the device is an exception.
    raises: bool,
    twin: Mutex<Twin>,
}

/// Positions of the drives, as keywords of a call.
#[derive(FromPyObject)]
#[pyo3(transparent)]
struct Tendons(Vec<f64>);

impl Simulator {
    fn locked(&self) -> MutexGuard<'_, Twin> {
        // A panic elsewhere leaves a state between two ticks, never half of one.
        self.twin.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn layout(&self) -> Layout {
        self.model.get().layout()
    }

    /// A row of what was given for one tick.
    fn row(
        &self,
        catheter: [f64; 2],
        guidewire: [Option<f64>; 2],
        tendons_m: Option<Tendons>,
        before: &Row,
    ) -> PyResult<Row> {
        let layout = self.layout();
        if guidewire.iter().any(Option::is_some) && !layout.has_guidewire {
            return Err(UsageError::new_err(
                "guidewire_insertion_m or guidewire_rotation_rad is given, and this rig has no guidewire\n  \
                 fix: leave it out, or describe the wire in the table [guidewire] of rig.toml",
            ));
        }
        let mut row = Row { catheter, ..*before };
        for (place, given) in row.guidewire.iter_mut().zip(guidewire) {
            *place = given.unwrap_or(*place);
        }
        if let Some(Tendons(given)) = tendons_m {
            if given.len() != layout.tendons {
                return Err(UsageError::new_err(format!(
                    "tendons_m has {} numbers, and this rig has {} driven tendons\n  fix: one number in \
                     metres for each",
                    given.len(),
                    layout.tendons
                )));
            }
            row.tendons_m[..given.len()].copy_from_slice(&given);
        }
        layout.check(&row, self.model.get().rig.reach_m()).map_err(UsageError::new_err)?;
        Ok(row)
    }

    /// Refuses an outcome that no caller should go on with.
    fn check(&self, twin: &Twin, outcome: &Outcome, tick: usize) -> PyResult<()> {
        let Some(device) = &outcome.device else {
            return match outcome.contact.lost && self.raises {
                true => Err(FaultError::new_err(format!(
                    "tick {tick}: a result was not finite\n  fix: move the drives more slowly"
                ))),
                false => Ok(()),
            };
        };
        if let Some(fault) = device.fault.filter(|_| self.raises) {
            return Err(FaultError::new_err(format!("tick {tick}: {}", fault.text())));
        }
        if device.refused && self.raises {
            let value = |name| self.model.get().rig.setting(name).unwrap_or(f32::NAN);
            return Err(FaultError::new_err(format!(
                "tick {tick}: the device refuses the position of a drive: from one tick to the next it may \
                 move by {} m and {} rad, and at most to {} m\n  fix: move it more slowly, as move_to does, or \
                 set max_insertion_speed_m_per_s or max_rotation_speed_rad_per_s",
                value("max_insertion_speed_m_per_s") * 1e-3,
                value("max_rotation_speed_rad_per_s") * 1e-3,
                value("max_insertion_m"),
            )));
        }
        if self.raises && twin.has_lost_the_drives(outcome) {
            return Err(FaultError::new_err(format!(
                "tick {tick}: the device has lost the drives and computes no forces ({})\n  fix: reset it \
                 where the drives are",
                device.mode.name()
            )));
        }
        Ok(())
    }

    fn ticks(&self, outcomes: Vec<Outcome>, shape: Vec<usize>) -> Ticks {
        Ticks::new(outcomes, None, shape, self.model.get().rig.is_double())
    }

    /// One vector for each node.
    fn of_nodes(&self, py: Python<'_>, of: fn(&Node) -> [f64; 3]) -> PyResult<Py<PyAny>> {
        let nodes = py.detach(|| self.locked().nodes());
        let double = self.model.get().rig.is_double();
        reals(py, double, nodes.iter().flat_map(of), &[nodes.len(), 3])
    }
}

fn command(name: Option<&str>) -> PyResult<Option<Command>> {
    Ok(match name {
        None => None,
        Some("self_test") => Some(Command::SelfTest),
        Some("arm") => Some(Command::Arm),
        Some("disarm") => Some(Command::Disarm),
        Some(other) => {
            let message = format!("command `{other}`\n  fix: \"self_test\", \"arm\" or \"disarm\"");
            return Err(UsageError::new_err(message));
        }
    })
}

#[pymethods]
impl Simulator {
    #[new]
    #[pyo3(signature = (model, *, faults="raise"))]
    fn new(model: Py<Model>, faults: &str) -> PyResult<Self> {
        let raises = match faults {
            "raise" => true,
            "report" => false,
            other => {
                let message = format!("faults `{other}`\n  fix: \"raise\" or \"report\"");
                return Err(UsageError::new_err(message));
            }
        };
        let twin = Mutex::new(Twin::new(model.get().rig.clone()));
        Ok(Self { model, raises, twin })
    }

    #[getter]
    fn model(&self, py: Python<'_>) -> Py<Model> {
        self.model.clone_ref(py)
    }

    /// Back to the state directly after configuration, before the self-test.
    fn clear(&self, py: Python<'_>) {
        py.detach(|| self.locked().clear());
    }

    #[pyo3(signature = (insertion_m=0.0, rotation_rad=0.0, *, guidewire_insertion_m=None,
        guidewire_rotation_rad=None, tendons_m=None, armed=false))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn reset(
        &self,
        py: Python<'_>,
        insertion_m: f64,
        rotation_rad: f64,
        guidewire_insertion_m: Option<f64>,
        guidewire_rotation_rad: Option<f64>,
        tendons_m: Option<Tendons>,
        armed: bool,
    ) -> PyResult<()> {
        let wire = [guidewire_insertion_m, guidewire_rotation_rad];
        let row = self.row([insertion_m, rotation_rad], wire, tendons_m, &Row::default())?;
        py.detach(|| self.locked().reset(row, armed)).map_err(FaultError::new_err)
    }

    #[pyo3(signature = (insertion_m, rotation_rad=None, *, guidewire_insertion_m=None,
        guidewire_rotation_rad=None, tendons_m=None, command=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn step(
        &self,
        py: Python<'_>,
        insertion_m: Option<f64>,
        rotation_rad: Option<f64>,
        guidewire_insertion_m: Option<f64>,
        guidewire_rotation_rad: Option<f64>,
        tendons_m: Option<Tendons>,
        command: Option<&str>,
    ) -> PyResult<Ticks> {
        let command = self::command(command)?;
        let wire = [guidewire_insertion_m, guidewire_rotation_rad];
        let row = match insertion_m {
            Some(insertion_m) => {
                let at = py.detach(|| self.locked().at);
                let rotation_rad = rotation_rad.unwrap_or(at.catheter[1]);
                Some(self.row([insertion_m, rotation_rad], wire, tendons_m, &at)?)
            }
            None => None,
        };
        let outcome = py.detach(|| {
            let mut twin = self.locked();
            let outcome = twin.tick(row.as_ref(), command);
            self.check(&twin, &outcome, 0).map(|()| outcome)
        })?;
        Ok(self.ticks(vec![outcome], Vec::new()))
    }

    #[pyo3(signature = (positions))]
    fn step_many(&self, py: Python<'_>, positions: &Bound<'_, PyAny>) -> PyResult<Ticks> {
        let reach_m = self.model.get().rig.reach_m();
        let (rows, shape) = rows(positions, self.layout(), reach_m, &[("ticks", None)])?;
        let mut outcomes = Vec::with_capacity(rows.len());
        until_done(py, || {
            let mut twin = self.locked();
            for row in rows.iter().skip(outcomes.len()).take(PART) {
                let outcome = twin.tick(Some(row), None);
                self.check(&twin, &outcome, outcomes.len())?;
                outcomes.push(outcome);
            }
            Ok(outcomes.len() == rows.len())
        })?;
        Ok(self.ticks(outcomes, shape))
    }

    #[pyo3(signature = (position, ticks))]
    fn move_to(
        &self,
        py: Python<'_>,
        position: &Bound<'_, PyAny>,
        ticks: usize,
    ) -> PyResult<Ticks> {
        let reach_m = self.model.get().rig.reach_m();
        let (rows, _) = rows(position, self.layout(), reach_m, &[])?;
        let goal = rows.first().copied().unwrap_or_default();
        let from = py.detach(|| self.locked().at);
        let mut outcomes = Vec::with_capacity(ticks);
        until_done(py, || {
            let mut twin = self.locked();
            for _ in 0..PART.min(ticks - outcomes.len()) {
                let share = (outcomes.len() + 1) as f64 / ticks as f64;
                let outcome = twin.tick(Some(&from.towards(&goal, share)), None);
                self.check(&twin, &outcome, outcomes.len())?;
                outcomes.push(outcome);
            }
            Ok(outcomes.len() == ticks)
        })?;
        Ok(self.ticks(outcomes, vec![ticks]))
    }

    fn snapshot(&self, py: Python<'_>) -> Snapshot {
        Snapshot(py.detach(|| self.locked().clone()))
    }

    fn restore(&self, py: Python<'_>, snapshot: &Snapshot) -> PyResult<()> {
        if !snapshot.0.rig.is(&self.model.get().rig) {
            return Err(UsageError::new_err(
                "the snapshot is of another model\n  fix: restore it in a simulator of the model that it was \
                 taken of",
            ));
        }
        py.detach(|| self.locked().clone_from(&snapshot.0));
        Ok(())
    }

    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Py<PyAny>> {
        let at = py.detach(|| self.locked().at);
        let all = self.layout().numbers(&at);
        let columns = all.len();
        shaped(py, all, &[columns])
    }

    #[getter]
    fn shape_m(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.of_nodes(py, |node| node.position_m)
    }

    #[getter]
    fn contact_forces_n(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.of_nodes(py, |node| node.force_n)
    }

    #[getter]
    fn tendon_tensions_n(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let tensions = py.detach(|| self.locked().tensions_n());
        let double = self.model.get().rig.is_double();
        reals(py, double, tensions.iter().flatten().copied(), &[tensions.len(), 2])
    }

    fn __repr__(&self) -> String {
        format!("<cathforce.Simulator of {}>", self.model.get().shown())
    }
}
