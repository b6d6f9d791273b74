//! The same for Foxglove: the topics of a recording over Foxglove's own WebSocket protocol.
//!
//! A client can only watch: the server takes no messages, parameters or calls from it. Of a recording it
//! may also say when to play, from where and how fast.

mod outlet;
mod player;

use std::net::{IpAddr, SocketAddr};

use cathforce_bus::master::Master;
use cathforce_recording::Recording;
use foxglove::websocket::Capability;
use foxglove::{WebSocketServer, WebSocketServerHandle};

use self::outlet::Outlet;
use self::player::Player;
use crate::error::DashError;
use crate::live::Listener;
use crate::stamped::Stamped;

/// Messages that wait for one client, some half second of all topics; the oldest are dropped for newer.
const WAITING: usize = 8192;

/// A server for Foxglove. It ends when it is dropped.
pub struct Bridge {
    address: SocketAddr,
    /// The server of a device that runs.
    live: Option<WebSocketServerHandle>,
    /// Ends its server when it is dropped.
    _player: Option<Player>,
}

impl Bridge {
    /// Serves a device that runs; what the listener hears goes to the clients.
    pub async fn live(
        listen: SocketAddr,
        name: &str,
        master: Master,
    ) -> Result<(Self, Box<dyn Listener>), DashError> {
        let outlet = Outlet::new().map_err(|error| failed(listen, &error))?;
        let server = server(listen, name, &outlet);
        let (address, handle) = start(listen, server).await?;
        let bridge = Self { address, live: Some(handle), _player: None };
        Ok((bridge, Box::new(Stamped::new(outlet, master))))
    }

    /// Serves a recording, which plays when somebody connects.
    pub async fn replay(
        listen: SocketAddr,
        name: &str,
        recording: Recording,
    ) -> Result<Self, DashError> {
        let outlet = Outlet::new().map_err(|error| failed(listen, &error))?;
        let control = player::Control::of(&recording);
        let (begin_ns, end_ns) = control.range_ns();
        let server = server(listen, name, &outlet)
            .capabilities([Capability::Time])
            .playback_time_range(begin_ns, end_ns)
            .listener(control.clone());
        let (address, handle) = start(listen, server).await?;
        let player = Player::start(outlet, recording, control, handle);
        Ok(Self { address, live: None, _player: Some(player) })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        if let Some(handle) = self.live.take() {
            // Clients are let go at once.
            drop(handle.stop());
        }
    }
}

/// The address that it took, and the server.
async fn start(
    listen: SocketAddr,
    server: WebSocketServer,
) -> Result<(SocketAddr, WebSocketServerHandle), DashError> {
    let handle = server.start().await.map_err(|error| failed(listen, &error))?;
    Ok((SocketAddr::new(listen.ip(), handle.port()), handle))
}

fn server(listen: SocketAddr, name: &str, outlet: &Outlet) -> WebSocketServer {
    let host = match listen.ip() {
        IpAddr::V4(ip) => ip.to_string(),
        IpAddr::V6(ip) => format!("[{ip}]"),
    };
    WebSocketServer::new()
        .name(format!("cathforce: {name}"))
        .context(outlet.context())
        .message_backlog_size(WAITING)
        .bind(host, listen.port())
}

fn failed(listen: SocketAddr, error: &foxglove::FoxgloveError) -> DashError {
    DashError::Foxglove { listen, why: error.to_string() }
}
