//! Arguments of `cathforce dash`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;

use super::Changes;

/// The ports of a later one would lie beyond the last port.
const LAST_DOMAIN: u16 = 232;

#[derive(Debug, Args)]
pub struct DashArguments {
    /// What to show: the address of a link (qemu, sim, slcan:tcp:HOST:PORT, socketcan:can0 …), a recording,
    /// or the JSON of a diagnosis.
    pub source: String,
    /// Write the same views of a recording or a diagnosis as one page that needs no server, and serve nothing.
    #[arg(long, value_name = "FILE.html",
          conflicts_with_all = ["foxglove", "ros2", "bundle"])]
    pub save: Option<PathBuf>,
    /// Address and port to listen on; port 0 takes a free one. Other computers can watch only where this
    /// is no address of this computer alone.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7410")]
    pub listen: SocketAddr,
    /// Serve Foxglove too, with the topics of a recording: `ws://` and this address is what to open there.
    /// Without an address, this computer alone and Foxglove's usual port.
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "127.0.0.1:8765"
    )]
    pub foxglove: Option<SocketAddr>,
    /// Write the layout for Foxglove into this file, to be imported there.
    #[arg(long, value_name = "FILE", requires = "foxglove")]
    pub foxglove_layout: Option<PathBuf>,
    /// Publish the topics of a device in ROS 2 too, in this domain; no ROS has to be installed. Without a
    /// number, in the domain of ROS_DOMAIN_ID, or in 0.
    #[arg(long, value_name = "DOMAIN", num_args = 0..=1, require_equals = true, value_parser = domain,
          default_missing_value = "")]
    pub ros2: Option<u16>,
    /// Move the drives as the joints of this topic (sensor_msgs/JointState) move, instead of playing a trial.
    #[arg(long, value_name = "TOPIC", requires_all = ["ros2", "bundle", "insertion_joint"],
          conflicts_with = "trial")]
    pub ros2_joints: Option<String>,
    /// Name of the joint that inserts the catheter, in metres.
    #[arg(long, value_name = "NAME", requires = "ros2_joints")]
    pub insertion_joint: Option<String>,
    /// Name of the joint that turns the catheter, in radians. Without it, the catheter is not turned.
    #[arg(long, value_name = "NAME", requires = "ros2_joints")]
    pub rotation_joint: Option<String>,
    /// Name of this computer under which browsers may ask, besides localhost. May be repeated.
    #[arg(long = "host", value_name = "NAME")]
    pub hosts: Vec<String>,
    /// Configure the device with this trial bundle and play a trial on it, there and back. Without it,
    /// another program runs the device.
    #[arg(long, value_name = "BUNDLE", conflicts_with = "watch_only")]
    pub bundle: Option<PathBuf>,
    /// Number of the trial to play [default: the first trial of the bundle]
    #[arg(long, requires = "bundle")]
    pub trial: Option<u32>,
    /// Arm the device and begin the trial at once, instead of waiting for a click.
    #[arg(long, requires = "bundle")]
    pub play: bool,
    /// Let the device's own clock run its ticks.
    #[arg(long, requires = "bundle")]
    pub free: bool,
    /// Folder for the recordings that are started from the page.
    #[arg(long, value_name = "FOLDER", default_value = ".", requires = "bundle")]
    pub recordings: PathBuf,
    /// Send nothing to the device: the vessel and the settings are not known then, and nothing can be
    /// changed.
    #[arg(long)]
    pub watch_only: bool,
    #[command(flatten)]
    pub changes: Changes,
}

/// The domain of ROS 2; that of the environment where none is named.
fn domain(text: &str) -> Result<u16, String> {
    let named = match text {
        "" => std::env::var("ROS_DOMAIN_ID").unwrap_or_else(|_| "0".to_owned()),
        named => named.to_owned(),
    };
    let domain = named.parse().ok().filter(|domain| *domain <= LAST_DOMAIN);
    domain.ok_or_else(|| format!("`{named}` is no domain of ROS 2; domains are 0 to {LAST_DOMAIN}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_is_one_that_ros_has() {
        assert_eq!(domain("42"), Ok(42));
        for wrong in ["233", "-1", "lab"] {
            assert!(domain(wrong).unwrap_err().contains("0 to 232"), "{wrong}");
        }
    }
}
