//! Salehizadeh et al., "Dynamic modeling and identification of a robotic intracardiac echo catheter".

mod catheter;
mod flow;
mod friction;
mod releases;
mod trial;

use crate::part::Part;

pub const PARTS: &[Part] = &[
    Part { name: "weight release", work: releases::work, run: releases::run },
    Part { name: "tendon hysteresis", work: friction::work, run: friction::run },
    Part { name: "pulsatile flow", work: flow::work, run: flow::run },
];
