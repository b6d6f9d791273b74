//! What ticks computed, as arrays.

use cathforce_control::Mode;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

use crate::arrays::{reals, shaped};
use crate::twin::{Device, Outcome};

/// Arrays of a [`Ticks`].
const ARRAYS: usize = 20;

/// Outputs of ticks: one number, or one vector, for each of them.
///
/// In the shapes below ``…`` is the shape of the call: nothing for one tick, ``(ticks,)`` for many, ``(n,)`` or
/// ``(n, ticks)`` of a batch. Real numbers are ``float32``, or ``float64`` of a model in double precision. Forces
/// and moments are those of the instrument on the vessel, in the rig's frame.
#[pyclass(frozen, module = "cathforce")]
pub struct Ticks {
    outcomes: Vec<Outcome>,
    /// The largest contact forces \[N\], if they are not those of the ticks.
    peaks_n: Option<Vec<f64>>,
    shape: Vec<usize>,
    double: bool,
    /// Each array is made when it is asked for, because most callers want few of them.
    made: [PyOnceLock<Py<PyAny>>; ARRAYS],
}

impl Ticks {
    pub fn new(
        outcomes: Vec<Outcome>,
        peaks_n: Option<Vec<f64>>,
        shape: Vec<usize>,
        double: bool,
    ) -> Self {
        Self { outcomes, peaks_n, shape, double, made: [const { PyOnceLock::new() }; ARRAYS] }
    }

    fn array(
        &self,
        py: Python<'_>,
        place: usize,
        make: impl FnOnce() -> PyResult<Py<PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        Ok(self.made[place].get_or_try_init(py, make)?.clone_ref(py))
    }

    fn scalar(
        &self,
        py: Python<'_>,
        place: usize,
        of: impl Fn(&Outcome) -> f64,
    ) -> PyResult<Py<PyAny>> {
        let values = self.outcomes.iter().map(of);
        self.array(py, place, || reals(py, self.double, values, &self.shape))
    }

    fn vector(
        &self,
        py: Python<'_>,
        place: usize,
        of: impl Fn(&Outcome) -> [f64; 3],
    ) -> PyResult<Py<PyAny>> {
        let shape = [&self.shape[..], &[3]].concat();
        let values = self.outcomes.iter().flat_map(of);
        self.array(py, place, || reals(py, self.double, values, &shape))
    }

    fn plain<T: numpy::Element>(
        &self,
        py: Python<'_>,
        place: usize,
        of: impl Fn(&Outcome) -> T,
    ) -> PyResult<Py<PyAny>> {
        let values = self.outcomes.iter().map(of);
        self.array(py, place, || shaped(py, values.collect(), &self.shape))
    }

    fn of_device<T: numpy::Element + Copy>(
        &self,
        py: Python<'_>,
        place: usize,
        otherwise: T,
        of: impl Fn(Device) -> T,
    ) -> PyResult<Py<PyAny>> {
        self.plain(py, place, |tick| tick.device.map_or(otherwise, &of))
    }
}

const NOWHERE: [f64; 3] = [f64::NAN; 3];

#[pymethods]
impl Ticks {
    #[getter]
    fn force_on_vessel_n(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.vector(py, 0, |tick| tick.contact.force_on_vessel_n)
    }

    #[getter]
    fn moment_on_vessel_n_m(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.vector(py, 1, |tick| tick.contact.moment_on_vessel_n_m)
    }

    #[getter]
    fn drive_force_n(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.scalar(py, 2, |tick| tick.contact.drive_force_n)
    }

    #[getter]
    fn drive_torque_n_m(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.scalar(py, 3, |tick| tick.contact.drive_torque_n_m)
    }

    #[getter]
    fn guidewire_force_n(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.scalar(py, 4, |tick| tick.contact.guidewire_force_n)
    }

    #[getter]
    fn guidewire_torque_n_m(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.scalar(py, 5, |tick| tick.contact.guidewire_torque_n_m)
    }

    #[getter]
    fn peak_contact_force_n(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        match &self.peaks_n {
            Some(peaks_n) => {
                self.array(py, 6, || reals(py, self.double, peaks_n.iter().copied(), &self.shape))
            }
            None => self.scalar(py, 6, |tick| tick.contact.peak_contact_force_n),
        }
    }

    #[getter]
    fn peak_node(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.plain(py, 7, |tick| tick.contact.peak_node)
    }

    #[getter]
    fn links(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.plain(py, 8, |tick| tick.contact.links)
    }

    #[getter]
    fn tip_m(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.vector(py, 9, |tick| tick.tip_m.unwrap_or(NOWHERE))
    }

    #[getter]
    fn unresolved(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.plain(py, 10, |tick| tick.contact.unresolved)
    }

    #[getter]
    fn lost(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.plain(py, 11, |tick| tick.contact.lost)
    }

    #[getter]
    fn refused(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.of_device(py, 12, false, |device| device.refused)
    }

    #[getter]
    fn mode(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.of_device(py, 13, 0, |device| Mode::code(device.mode))
    }

    #[getter]
    fn fault(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.of_device(py, 14, 0, |device| device.fault.map_or(0, |fault| fault.code()))
    }

    #[getter]
    fn limited(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.of_device(py, 15, 0, |device| device.limited)
    }

    #[getter]
    fn haptic_force_n(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let of = |device: Device| f64::from(device.haptic_force_n);
        self.scalar(py, 16, |tick| tick.device.map_or(0.0, of))
    }

    #[getter]
    fn haptic_torque_n_m(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let of = |device: Device| f64::from(device.haptic_torque_n_m);
        self.scalar(py, 17, |tick| tick.device.map_or(0.0, of))
    }

    #[getter]
    fn force_half_width_n(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let of = |device: Device| device.band.force_n.map(|half| half.map(f64::from));
        self.vector(py, 18, |tick| tick.device.and_then(of).unwrap_or(NOWHERE))
    }

    #[getter]
    fn digest(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.of_device(py, 19, 0, |device| device.digest)
    }

    /// Shape of the call: ``()`` for one tick.
    #[getter]
    fn shape<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyTuple>> {
        pyo3::types::PyTuple::new(py, &self.shape)
    }

    fn __repr__(&self) -> String {
        let shape: Vec<String> = self.shape.iter().map(usize::to_string).collect();
        format!("<cathforce.Ticks of shape ({})>", shape.join(", "))
    }
}
