//! The published systems.

use crate::part::Part;
use crate::{cathbot, ice, li, pescio};

/// A published system.
#[derive(Clone, Copy, Debug)]
pub struct System {
    /// Its name on the command line and in the rows.
    pub name: &'static str,
    /// What it is.
    pub doc: &'static str,
    /// The publication.
    pub source: &'static str,
    pub(crate) parts: &'static [Part],
}

/// Every published system, in the order of the table.
pub const SYSTEMS: &[System] = &[
    System {
        name: "pescio",
        doc: "Force and shape sensing of a peripheral catheter",
        source: "Pescio et al., A simulation environment for robot-assisted endovascular interventions, \
                 Int. J. CARS 20 (2025) 2259, doi:10.1007/s11548-025-03458-2",
        parts: pescio::PARTS,
    },
    System {
        name: "li",
        doc: "Catheter model and force estimation",
        source: "C. Li, Catheter modelling and force estimation in endovascular applications, MSc thesis, \
                 University of Twente, 2023",
        parts: li::PARTS,
    },
    System {
        name: "cathbot",
        doc: "Medical simulator with the CathBot master",
        source: "Catheter modelling for medical simulator with CathBot integration, MSc thesis, \
                 University of Twente",
        parts: cathbot::PARTS,
    },
    System {
        name: "ice",
        doc: "Robotic intracardiac echo catheter",
        source: "Salehizadeh et al., Dynamic modeling and identification of a robotic intracardiac echo \
                 catheter",
        parts: ice::PARTS,
    },
    System {
        name: "ultrasound",
        doc: "A vessel under an ultrasound probe",
        source: "3D deformation simulation for vascular tissue with 2D medical imaging",
        #[cfg(feature = "wall")]
        parts: crate::ultrasound::PARTS,
        #[cfg(not(feature = "wall"))]
        parts: &[crate::left_out::ULTRASOUND],
    },
];

impl System {
    /// The system of that name.
    pub fn find(name: &str) -> Option<&'static Self> {
        SYSTEMS.iter().find(|own| own.name == name)
    }

    /// Work of all its parts.
    pub(crate) fn work(&self) -> u64 {
        self.parts.iter().map(|part| (part.work)()).sum()
    }
}
