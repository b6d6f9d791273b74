//! Who may ask, and who may change something.

use std::net::{IpAddr, SocketAddr};

use axum::http::uri::Authority;
use rand::RngCore as _;

/// Bytes of a token: nobody guesses 128 bits.
const TOKEN_BYTES: usize = 16;

/// What a request must say of itself.
#[derive(Clone, Debug)]
pub struct Guard {
    listen: SocketAddr,
    /// Names of this computer that its user has allowed.
    names: Vec<String>,
    token: Option<String>,
}

/// A fresh token.
pub fn new_token() -> String {
    let mut bytes = [0; TOKEN_BYTES];
    rand::rng().fill_bytes(&mut bytes);
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Guard {
    /// `token`: `None` where there is nothing to change.
    pub fn new(listen: SocketAddr, names: Vec<String>, token: Option<String>) -> Self {
        Self { listen, names, token }
    }

    /// Whether a `Host` header means this server.
    ///
    /// A page of another origin can let its own name point here (DNS rebinding). The browser then sends
    /// that name, so names that nobody has allowed are refused. An address cannot be rebound.
    pub fn is_host(&self, host: &str) -> bool {
        let Ok(authority) = host.parse::<Authority>() else { return false };
        if authority.port_u16().unwrap_or(80) != self.listen.port() || host.contains('@') {
            return false;
        }
        let name = authority.host().trim_start_matches('[').trim_end_matches(']');
        match name.parse::<IpAddr>() {
            Ok(address) => address.is_loopback() || !self.listen.ip().is_loopback(),
            Err(_) => {
                let allowed = self.names.iter().map(String::as_str).chain(["localhost"]);
                allowed.into_iter().any(|allowed| allowed.eq_ignore_ascii_case(name))
            }
        }
    }

    /// Whether a page of this origin may ask. Programs that are no browsers send no origin.
    pub fn is_origin(origin: Option<&str>, host: &str) -> bool {
        origin.is_none_or(|origin| origin.strip_prefix("http://") == Some(host))
    }

    /// Whether an `Authorization` header has the token.
    pub fn may_change(&self, authorization: Option<&str>) -> bool {
        let said = authorization.and_then(|header| header.strip_prefix("Bearer "));
        said.zip(self.token.as_deref()).is_some_and(|(said, token)| is_same(said, token))
    }
}

/// Compares in a time that does not tell how far two texts agree.
fn is_same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |all, (x, y)| all | (x ^ y)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(listen: &str) -> Guard {
        Guard::new(listen.parse().unwrap(), vec!["Lab.example".into()], Some("secret".into()))
    }

    #[test]
    fn a_host_is_an_address_or_an_allowed_name_with_the_right_port() {
        let local = guard("127.0.0.1:7410");
        for good in ["127.0.0.1:7410", "localhost:7410", "LOCALHOST:7410", "[::1]:7410"] {
            assert!(local.is_host(good), "{good}");
        }
        assert!(local.is_host("lab.example:7410"));
        for bad in [
            "evil.example:7410",
            "127.0.0.1",
            "127.0.0.1:80",
            "localhost",
            "192.168.1.2:7410",
            "127.0.0.1.evil.example:7410",
            "evil@127.0.0.1:7410",
            "",
        ] {
            assert!(!local.is_host(bad), "{bad}");
        }
        let open = guard("0.0.0.0:7410");
        assert!(open.is_host("192.168.1.2:7410") && !open.is_host("evil.example:7410"));
    }

    #[test]
    fn an_origin_is_this_server_or_none() {
        let host = "127.0.0.1:7410";
        assert!(Guard::is_origin(None, host));
        assert!(Guard::is_origin(Some("http://127.0.0.1:7410"), host));
        for bad in ["null", "http://127.0.0.1:7411", "https://127.0.0.1:7410", "http://evil"] {
            assert!(!Guard::is_origin(Some(bad), host), "{bad}");
        }
    }

    #[test]
    fn only_the_whole_token_changes_anything() {
        let guard = guard("127.0.0.1:7410");
        assert!(guard.may_change(Some("Bearer secret")));
        for bad in
            [None, Some("Bearer secre"), Some("secret"), Some("Bearer secreT"), Some("Bearer ")]
        {
            assert!(!guard.may_change(bad), "{bad:?}");
        }
        let nothing = Guard::new("127.0.0.1:7410".parse().unwrap(), Vec::new(), None);
        assert!(!nothing.may_change(Some("Bearer ")));
        assert_ne!(new_token(), new_token());
        assert_eq!(new_token().len(), 2 * TOKEN_BYTES);
    }
}
