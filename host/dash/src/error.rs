//! Why there is no server.

use std::net::SocketAddr;
use std::path::PathBuf;

/// Why there is no server.
#[derive(Debug, thiserror::Error)]
pub enum DashError {
    #[error(
        "cannot listen on {listen}: {source}\n  fix: give another --listen; port 0 takes a free one"
    )]
    Listen { listen: SocketAddr, source: std::io::Error },
    #[error("cannot write the token into {}: {source}\n  fix: check the folder", path.display())]
    Token { path: PathBuf, source: std::io::Error },
    #[error(
        "cannot serve Foxglove on {listen}: {why}\n  fix: give another address to --foxglove; port 0 takes \
         a free one"
    )]
    Foxglove { listen: SocketAddr, why: String },
    #[error(
        "this program was built without `--foxglove`\n  fix: build it with its feature `foxglove`, which is \
         on by default: `cargo install --path host/cli`"
    )]
    WithoutFoxglove,
    #[error(
        "a diagnosis has no topics for Foxglove\n  fix: omit --foxglove, or give a link or a recording"
    )]
    NothingForFoxglove,
    #[error(
        "cannot join domain {domain} of ROS 2: {why}\n  fix: domains are 0 to 232, as in ROS_DOMAIN_ID, and a \
         network interface must be up"
    )]
    Ros2 { domain: u16, why: String },
    #[error(
        "this program was built without `--ros2`\n  fix: build it with its feature `ros2`, which is on by \
         default: `cargo install --path host/cli`"
    )]
    WithoutRos2,
    #[error(
        "a device that runs cannot be saved as a page\n  fix: record it with `cathforce run --out FILE.mcap`, and \
         save the recording"
    )]
    NothingToSave,
    #[error("the vessel in the recording: {0}")]
    Vessel(String),
    #[error("the server ended: {0}")]
    Served(std::io::Error),
}
