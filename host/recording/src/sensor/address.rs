//! The address of a sensor: `netft:HOST` or `netft:HOST:PORT`.

use std::fmt;
use std::net::{SocketAddr, ToSocketAddrs as _};

use super::error::SensorError;

/// The port of the sensor's protocol, by ATI's manual 9620-05.
const PORT: u16 = 49152;

/// A sensor in the network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SensorAddress {
    /// Without the brackets of an IPv6 address.
    pub(super) host: String,
    pub(super) port: u16,
}

impl SensorAddress {
    /// From `netft:192.168.1.1`, `netft:sensor.lab:49152` or `netft:[fe80::1]:49152`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no sensor: write netft:HOST or netft:HOST:PORT");
        let rest = text.strip_prefix("netft:").ok_or_else(wrong)?;
        let (host, port) = match rest.strip_prefix('[') {
            Some(rest) => {
                let (host, port) = rest.split_once(']').ok_or_else(wrong)?;
                (host, port.strip_prefix(':'))
            }
            None => match rest.split_once(':') {
                Some((host, port)) => (host, Some(port)),
                None => (rest, None),
            },
        };
        let port = port.map_or(Some(PORT), |port| port.parse().ok().filter(|port| *port > 0));
        let is_host = !host.is_empty() && !host.contains(char::is_whitespace);
        match port.filter(|_| is_host) {
            Some(port) => Ok(Self { host: host.to_owned(), port }),
            None => Err(wrong()),
        }
    }

    /// The first address that a name has, at a port.
    pub(super) fn at(&self, port: u16) -> Result<SocketAddr, SensorError> {
        let found = (self.host.as_str(), port).to_socket_addrs();
        let why = match found.map(|mut found| found.next()) {
            Ok(Some(address)) => return Ok(address),
            Ok(None) => "it has no address".to_owned(),
            Err(error) => error.to_string(),
        };
        let problem = format!("{self}: the name cannot be found: {why}");
        Err(SensorError::new(problem, "give the sensor's address, like netft:192.168.1.1"))
    }
}

impl fmt::Display for SensorAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.host.contains(':') {
            true => write!(f, "netft:[{}]:{}", self.host, self.port),
            false => write!(f, "netft:{}:{}", self.host, self.port),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_a_host_and_may_have_a_port() {
        for (text, shown) in [
            ("netft:192.168.1.1", "netft:192.168.1.1:49152"),
            ("netft:sensor.lab:50000", "netft:sensor.lab:50000"),
            ("netft:[::1]:7", "netft:[::1]:7"),
            ("netft:[::1]", "netft:[::1]:49152"),
        ] {
            assert_eq!(SensorAddress::parse(text).unwrap().to_string(), shown);
        }
        for text in ["192.168.1.1", "netft:", "netft:a:0", "netft:a:b", "netft:[::1", "udp:a"] {
            assert!(SensorAddress::parse(text).unwrap_err().contains("netft:HOST"), "{text}");
        }
    }
}
