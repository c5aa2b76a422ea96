//! Who may look and who may change something.
//!
//! | rule | why |
//! |---|---|
//! | the panel listens on loopback; another address needs a token | the network of a machine has guests |
//! | `Host` must name where we listen, `Origin` the same | another page in the same browser must not reach us, nor a name that an attacker points at loopback |
//! | one page at a time may change things | two hands on one machine |

use std::net::{IpAddr, SocketAddr};

use thiserror::Error;

/// Where the panel listens and what it asks of a page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Access {
    listen: SocketAddr,
    token: Option<String>,
}

/// The panel cannot be served like that.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PanelError {
    /// An address that others reach, and no token.
    #[error(
        "{listen} can be reached from other machines: give --token SECRET of at least 16 characters, or listen on 127.0.0.1"
    )]
    TokenNeeded {
        /// The address.
        listen: SocketAddr,
    },
    /// A token that can be guessed.
    #[error("the token has {got} characters, at least 16 of A–Z, a–z, 0–9, - and _ are needed")]
    WeakToken {
        /// Its length.
        got: usize,
    },
    /// The address is taken, or none of ours.
    #[error("{listen}: {source}")]
    Listen {
        /// The address.
        listen: SocketAddr,
        /// What the system says.
        source: std::io::Error,
    },
    /// The rig cannot be built.
    #[error("{0}")]
    Rig(#[from] crate::rig::RigError),
    /// The line cannot be opened.
    #[error("{0}")]
    Line(String),
    /// The server ended.
    #[error("the server ended: {0}")]
    Server(std::io::Error),
}

/// Why a page is turned away.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum AccessRefused {
    /// The request names another host.
    #[error("the request is for another host")]
    Host,
    /// The request comes from another page.
    #[error("the request comes from another page")]
    Origin,
    /// No token, or a wrong one.
    #[error("the token is missing or wrong")]
    Token,
    /// There are enough.
    #[error("too many pages are connected")]
    TooMany,
}

const TOKEN_LENGTH: usize = 16;

impl Access {
    /// # Errors
    ///
    /// [`PanelError::TokenNeeded`], [`PanelError::WeakToken`].
    pub fn new(listen: SocketAddr, token: Option<String>) -> Result<Self, PanelError> {
        match &token {
            None if !listen.ip().is_loopback() => Err(PanelError::TokenNeeded { listen }),
            Some(token) if !is_strong(token) => Err(PanelError::WeakToken { got: token.len() }),
            _ => Ok(Self { listen, token }),
        }
    }

    /// The same at the port that the system chose.
    #[must_use]
    pub fn at(&self, listen: SocketAddr) -> Self {
        Self {
            listen,
            token: self.token.clone(),
        }
    }

    /// Where it listens.
    #[must_use]
    pub fn listen(&self) -> SocketAddr {
        self.listen
    }

    /// Checks the headers of a request, and the token of one that wants the live connection.
    ///
    /// # Errors
    ///
    /// [`AccessRefused`].
    pub fn check(&self, host: Option<&str>, origin: Option<&str>, token: Option<&str>) -> Result<(), AccessRefused> {
        self.check_host(host)?;
        let host = host.unwrap_or_default();
        // A browser always tells the origin of a WebSocket; a program that has none is no page.
        if origin.is_some_and(|origin| origin != format!("http://{host}")) {
            return Err(AccessRefused::Origin);
        }
        match (&self.token, token) {
            (None, _) => Ok(()),
            (Some(expected), Some(given)) if same(expected, given) => Ok(()),
            (Some(_), _) => Err(AccessRefused::Token),
        }
    }

    /// Checks whom a request is for.
    ///
    /// # Errors
    ///
    /// [`AccessRefused::Host`].
    pub fn check_host(&self, host: Option<&str>) -> Result<(), AccessRefused> {
        let host = host.ok_or(AccessRefused::Host)?;
        let (name, port) = host.rsplit_once(':').unwrap_or((host, "80"));
        let name = name.trim_start_matches('[').trim_end_matches(']');
        let is_port = port.parse() == Ok(self.listen.port());
        let is_name = match name.parse::<IpAddr>() {
            Ok(ip) => ip == self.listen.ip() || self.listen.ip().is_unspecified(),
            Err(_) => name.eq_ignore_ascii_case("localhost") && self.listen.ip().is_loopback(),
        };
        if is_port && is_name {
            Ok(())
        } else {
            Err(AccessRefused::Host)
        }
    }
}

fn is_strong(token: &str) -> bool {
    token.len() >= TOKEN_LENGTH
        && token
            .bytes()
            .all(|octet| octet.is_ascii_alphanumeric() || octet == b'-' || octet == b'_')
}

/// Compares in a time that does not tell where the first difference is.
fn same(expected: &str, given: &str) -> bool {
    let differences = expected
        .bytes()
        .zip(given.bytes())
        .fold(0, |differences, (a, b)| differences | (a ^ b));
    expected.len() == given.len() && differences == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access(listen: &str, token: Option<&str>) -> Result<Access, PanelError> {
        Access::new(listen.parse().expect("an address"), token.map(str::to_owned))
    }

    #[test]
    fn another_address_than_loopback_needs_a_token() {
        assert!(access("127.0.0.1:8930", None).is_ok());
        assert!(access("[::1]:8930", None).is_ok());
        let told = access("0.0.0.0:8930", None).expect_err("no token").to_string();
        assert!(told.contains("--token") && told.contains("127.0.0.1"), "{told}");
        assert!(access("0.0.0.0:8930", Some("short")).is_err());
        assert!(access("0.0.0.0:8930", Some("no spaces in a token")).is_err());
        assert!(access("0.0.0.0:8930", Some("0123456789abcdef")).is_ok());
    }

    #[test]
    fn only_our_own_page_is_let_in() {
        let loopback = access("127.0.0.1:8930", None).expect("loopback");
        let ok = |host, origin| loopback.check(host, origin, None);
        assert_eq!(ok(Some("127.0.0.1:8930"), Some("http://127.0.0.1:8930")), Ok(()));
        assert_eq!(ok(Some("localhost:8930"), Some("http://localhost:8930")), Ok(()));
        assert_eq!(ok(Some("localhost:8930"), None), Ok(()), "a program, not a page");
        assert_eq!(ok(Some("evil.example:8930"), None), Err(AccessRefused::Host));
        assert_eq!(ok(Some("127.0.0.1:80"), None), Err(AccessRefused::Host));
        assert_eq!(ok(None, None), Err(AccessRefused::Host));
        for origin in [
            "http://evil.example",
            "null",
            "https://127.0.0.1:8930",
            "http://127.0.0.1:8931",
        ] {
            assert_eq!(
                ok(Some("127.0.0.1:8930"), Some(origin)),
                Err(AccessRefused::Origin),
                "{origin}"
            );
        }
    }

    #[test]
    fn a_token_must_be_the_token() {
        let open = access("0.0.0.0:8930", Some("0123456789abcdef")).expect("strong enough");
        let check = |token| open.check(Some("10.0.0.7:8930"), None, token);
        assert_eq!(check(Some("0123456789abcdef")), Ok(()));
        for token in [
            None,
            Some(""),
            Some("0123456789abcdeF"),
            Some("0123456789abcdef0"),
            Some("0123456789abcde"),
        ] {
            assert_eq!(check(token), Err(AccessRefused::Token), "{token:?}");
        }
    }
}
