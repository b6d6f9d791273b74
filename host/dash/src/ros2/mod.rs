//! A node of ROS 2 without a ROS installation: topics of a recording go out, a robot's joints come in.

mod joints;
mod outlet;

use cathforce_bus::master::Master;
use ros2_client::{Context, ContextOptions, Node, NodeName, NodeOptions};

use self::outlet::Outlet;
use crate::error::DashError;
use crate::joint_names::JointNames;
use crate::live::Listener;
use crate::stamped::Stamped;

pub use self::joints::Joints;

/// A node of ROS 2.
pub struct Ros2 {
    node: Node,
}

impl Ros2 {
    /// Joins a domain, as `ROS_DOMAIN_ID` names it.
    pub fn join(domain: u16) -> Result<Self, DashError> {
        let failed = |why: String| DashError::Ros2 { domain, why };
        let context = Context::with_options(ContextOptions::new().domain_id(domain));
        let context = context.map_err(|error| failed(error.to_string()))?;
        let name = NodeName::new("/", "cathforce").map_err(|error| failed(error.to_string()))?;
        let node = context.new_node(name, NodeOptions::new());
        Ok(Self { node: node.map_err(|error| failed(format!("{error:?}")))? })
    }

    /// Follows the joints of a robot from now on.
    pub fn joints(&mut self, names: JointNames) -> Result<Joints, DashError> {
        let domain = self.node.domain_id();
        let topic = names.topic.clone();
        let failed = |why| DashError::Ros2 { domain, why: format!("{topic}: {why}") };
        Joints::follow(&mut self.node, names).map_err(failed)
    }

    /// Publishes what it hears.
    pub fn listener(self, master: Master) -> Result<Box<dyn Listener>, DashError> {
        let domain = self.node.domain_id();
        let outlet = Outlet::new(self.node).map_err(|why| DashError::Ros2 { domain, why })?;
        Ok(Box::new(Stamped::new(outlet, master)))
    }
}
