//! Arguments of `cathforce dash`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;

use super::Changes;

#[derive(Debug, Args)]
pub struct DashArguments {
    /// What to show: the address of a link (qemu, sim, slcan:tcp:HOST:PORT, socketcan:can0 …), a recording,
    /// or the JSON of a diagnosis.
    pub source: String,
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
