//! The last minute of forces.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use serde_json::{Value, json};

/// Points in a picture: a viewer that misses a few pictures still draws a whole line.
const POINTS: usize = 12;
/// Points of the history for a viewer that comes: a minute.
const HISTORY: usize = 3600;

/// Time \[s\]; fx, fy, fz, drive \[N\], torque \[N·m\]; measured fx, fy, fz, drive \[N\]; half widths of
/// fx, fy, fz, drive \[N\].
pub type Point = [Option<f32>; 14];

/// The last minute, shared with the server.
#[derive(Clone, Debug, Default)]
pub struct History(Arc<Mutex<VecDeque<(u64, Point)>>>);

impl History {
    pub fn push(&self, number: u64, point: Point) {
        let mut points = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if points.len() == HISTORY {
            points.pop_front();
        }
        points.push_back((number, point));
    }

    /// Numbers and points, oldest first.
    pub fn json(&self) -> Value {
        let points = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        json!(points.iter().collect::<Vec<_>>())
    }

    /// The points for one picture.
    pub fn latest(&self) -> Vec<(u64, Point)> {
        let points = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        points.range(points.len().saturating_sub(POINTS)..).copied().collect()
    }
}
