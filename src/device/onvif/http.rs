//! One HTTP exchange with one host: bounded in time and size, no redirects, no proxy, no cookies.

use std::net::{SocketAddr, ToSocketAddrs};
use std::time::Duration;

use ureq::Agent;
use ureq::unversioned::resolver::{ResolvedSocketAddrs, Resolver};
use ureq::unversioned::transport::{DefaultConnector, NextTimeout};

use crate::device::{Address, device_error};
use crate::error::{Error, Result};

/// Of a SOAP answer.
pub const MAX_REPLY: u64 = 4 << 20;
const MAX_HEADERS: usize = 32 << 10;
/// Longest time to connect, seconds.
const CONNECT_TIMEOUT: f64 = 3.0;

/// A host that was looked up once, so that a stop never waits for a name server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Host {
    /// As it stands in an URL; IPv6 in brackets.
    pub name: String,
    /// What the address says, or 80.
    pub port: u16,
    addresses: Vec<SocketAddr>,
}

impl Host {
    /// # Errors
    /// `InvalidAddress` without a host, `DeviceNotFound` when nobody knows it.
    pub fn look_up(address: &Address) -> Result<Self> {
        let (host, port) = (address.need_host()?, address.port().unwrap_or(80));
        let found = (host, port).to_socket_addrs().map(Iterator::collect::<Vec<_>>);
        let lost = |reason: String| Error::DeviceNotFound { device: host.to_owned(), reason };
        let addresses = found.map_err(|e| lost(e.to_string()))?;
        if addresses.is_empty() {
            return Err(lost("the host has no address".into()));
        }
        let name = if host.contains(':') { format!("[{host}]") } else { host.to_owned() };
        Ok(Self { name, port, addresses })
    }

    /// What a camera calls one of its services, as a place on this host. Its own idea of its name
    /// (and, behind another name, port) is passed over: behind a gateway it is wrong, and the
    /// password goes to no other host.
    pub fn place(&self, url: &str) -> Option<Place> {
        let (scheme, rest) = url.trim().split_once("://")?;
        let (authority, path) = rest.find(['/', '?']).map_or((rest, ""), |i| rest.split_at(i));
        let path = path.split('#').next().unwrap_or_default();
        let printable = path.bytes().all(|b| b.is_ascii_graphic());
        if !matches!(scheme.to_ascii_lowercase().as_str(), "http" | "https") || !printable {
            return None;
        }
        let path = if path.starts_with('/') { path.to_owned() } else { format!("/{path}") };
        let own = authority.rsplit('@').next().unwrap_or_default().strip_prefix(&self.name);
        let port = match own.and_then(|rest| rest.strip_prefix(':')) {
            Some(port) if scheme.eq_ignore_ascii_case("http") => port.parse().ok()?,
            _ => self.port,
        };
        Some(Place { port, path })
    }
}

/// Where on the host a request goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    pub port: u16,
    /// With its query.
    pub path: String,
}

/// Gives the addresses that were looked up at open. The client's own resolver starts a thread for
/// each connection.
#[derive(Debug)]
struct Known(Vec<SocketAddr>);

impl Resolver for Known {
    fn resolve(
        &self,
        uri: &ureq::http::Uri,
        _config: &ureq::config::Config,
        _timeout: NextTimeout,
    ) -> std::result::Result<ResolvedSocketAddrs, ureq::Error> {
        let port = uri.port_u16().unwrap_or(80);
        let mut known = self.empty();
        // The client has room for 16.
        for address in self.0.iter().take(8) {
            known.push(SocketAddr::new(address.ip(), port));
        }
        Ok(known)
    }
}

/// What came back, whatever its status.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Reply {
    pub status: u16,
    /// All values of WWW-Authenticate.
    pub challenges: Vec<String>,
    pub body: Vec<u8>,
}

pub struct Http {
    host: Host,
    agent: Agent,
    /// Of a whole exchange, seconds.
    pub timeout: f64,
}

impl Http {
    pub fn new(host: Host, timeout: f64) -> Self {
        let config = Agent::config_builder()
            .http_status_as_error(false)
            .max_redirects(0)
            .max_redirects_will_error(false)
            .proxy(None)
            .user_agent(concat!("ptzcal/", env!("CARGO_PKG_VERSION")))
            .max_response_header_size(MAX_HEADERS)
            // A connection each: cameras close idle ones unsaid, and a command that is lost with one
            // must not be guessed to have been carried out or not.
            .max_idle_connections(0)
            .build();
        let agent = Agent::with_parts(config, DefaultConnector::default(), Known(host.addresses.clone()));
        Self { host, agent, timeout }
    }

    pub fn host(&self) -> &Host {
        &self.host
    }

    /// POST of a SOAP envelope.
    pub fn post(&self, place: &Place, envelope: &str, authorization: Option<&str>) -> Result<Reply> {
        let request = self.agent.post(self.url(place)).config();
        let request = request.timeout_global(duration(self.timeout)).timeout_connect(connect(self.timeout)).build();
        let request = request.header("Content-Type", "application/soap+xml; charset=utf-8");
        let request = authorization.into_iter().fold(request, |r, value| r.header("Authorization", value));
        self.reply(request.send(envelope), MAX_REPLY, self.timeout)
    }

    /// GET within `timeout` seconds.
    pub fn get(&self, place: &Place, authorization: Option<&str>, most: u64, timeout: f64) -> Result<Reply> {
        let request = self.agent.get(self.url(place)).config();
        let request = request.timeout_global(duration(timeout)).timeout_connect(connect(timeout)).build();
        let request = authorization.into_iter().fold(request, |r, value| r.header("Authorization", value));
        self.reply(request.call(), most, timeout)
    }

    fn url(&self, place: &Place) -> String {
        format!("http://{}:{}{}", self.host.name, place.port, place.path)
    }

    fn reply(
        &self,
        response: std::result::Result<ureq::http::Response<ureq::Body>, ureq::Error>,
        most: u64,
        timeout: f64,
    ) -> Result<Reply> {
        let failed = |error| self.error(error, timeout);
        let mut response = response.map_err(failed)?;
        let status = response.status().as_u16();
        let values = response.headers().get_all("www-authenticate").into_iter();
        let challenges = values.filter_map(|v| v.to_str().ok()).map(str::to_owned).collect();
        let body = response.body_mut().with_config().limit(most).read_to_vec().map_err(failed)?;
        Ok(Reply { status, challenges, body })
    }

    fn error(&self, error: ureq::Error, timeout: f64) -> Error {
        let name = &self.host.name;
        match error {
            ureq::Error::Timeout(_) => Error::DeviceTimeout { what: "camera", seconds: timeout },
            ureq::Error::Io(e) if matches!(e.kind(), std::io::ErrorKind::TimedOut | std::io::ErrorKind::WouldBlock) => {
                Error::DeviceTimeout { what: "camera", seconds: timeout }
            }
            ureq::Error::Io(e) => device_error(name, &e),
            ureq::Error::ConnectionFailed | ureq::Error::HostNotFound => {
                Error::DeviceNotFound { device: name.clone(), reason: "no connection".into() }
            }
            ureq::Error::BodyExceedsLimit(limit) => self.mismatch(format!("its answer is longer than {limit} bytes")),
            ureq::Error::LargeResponseHeader(..) => self.mismatch("the head of its answer has no end".into()),
            other => self.mismatch(format!("it does not speak HTTP: {other}")),
        }
    }

    pub fn mismatch(&self, reason: String) -> Error {
        Error::DeviceMismatch { device: self.host.name.clone(), reason }
    }
}

fn duration(seconds: f64) -> Option<Duration> {
    Some(Duration::from_secs_f64(seconds.clamp(0.001, 3600.0)))
}

fn connect(seconds: f64) -> Option<Duration> {
    duration(seconds.min(CONNECT_TIMEOUT))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_request_leaves_the_host_of_the_address() {
        let host = Host::look_up(&Address::parse("onvif://127.0.0.1:8000/").unwrap()).unwrap();
        let place = |url: &str| host.place(url).map(|p| (p.port, p.path));
        let at = |port, path: &str| Some((port, path.to_owned()));
        assert_eq!(place("http://127.0.0.1:81/onvif/ptz"), at(81, "/onvif/ptz"));
        assert_eq!(place(" HTTP://127.0.0.1/a?b=c#d "), at(8000, "/a?b=c"));
        assert_eq!(place("http://evil.example:666/steal"), at(8000, "/steal"));
        assert_eq!(place("http://127.0.0.1@evil.example/steal"), at(8000, "/steal"));
        assert_eq!(place("http://127.0.0.1.evil.example/steal"), at(8000, "/steal"));
        assert_eq!(place("https://127.0.0.1:443/s"), at(8000, "/s"));
        assert_eq!(place("http://127.0.0.1"), at(8000, "/"));
        for wrong in ["", "/onvif", "ftp://127.0.0.1/", "http://127.0.0.1:x/", "http://a/b c", "http://a/\r\nX: y"] {
            assert_eq!(place(wrong), None, "{wrong}");
        }
        assert!(matches!(Host::look_up(&Address::parse("onvif:///x").unwrap()), Err(Error::InvalidAddress { .. })));
    }
}
