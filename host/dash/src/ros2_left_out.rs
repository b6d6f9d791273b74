//! This library was built without ROS 2: it says so.

use cathforce_bus::master::Master;

use crate::error::DashError;
use crate::live::Listener;

/// Joints of another robot.
#[derive(Clone, Debug)]
pub struct JointNames {
    pub topic: String,
    pub insertion: String,
    pub rotation: Option<String>,
}

/// There are none.
#[derive(Clone)]
pub enum Joints {}

impl Joints {
    pub fn now(&self) -> Option<(f64, f64)> {
        match *self {}
    }
}

/// There is none.
pub enum Ros2 {}

impl Ros2 {
    pub fn join(_: u16) -> Result<Self, DashError> {
        Err(DashError::WithoutRos2)
    }

    pub fn joints(&mut self, _: JointNames) -> Result<Joints, DashError> {
        match *self {}
    }

    pub fn listener(self, _: Master) -> Result<Box<dyn Listener>, DashError> {
        match self {}
    }
}
