//! This library was built without ROS 2: it says so.

use cathforce_bus::master::Master;

use crate::error::DashError;
use crate::joint_names::JointNames;
use crate::live::Listener;

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
