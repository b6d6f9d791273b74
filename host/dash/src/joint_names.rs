//! The joints of a robot that move the drives, by their names.

/// Where the positions of the drives come from.
#[derive(Clone, Debug)]
pub struct JointNames {
    /// A topic of `sensor_msgs/JointState`.
    pub topic: String,
    /// The joint that inserts \[m\].
    pub insertion: String,
    /// The joint that turns \[rad\].
    pub rotation: Option<String>,
}
