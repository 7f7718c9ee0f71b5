//! TCP connections as links.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream, ToSocketAddrs};
use std::os::fd::AsFd;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::poll::{Ready, wait};
use super::{Link, Sender, device_error};
use crate::control::unpoisoned;
use crate::error::{Error, Result};

const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);
/// Addresses of one name that are tried.
const MAX_ADDRESSES: usize = 4;

/// Connects to a host.
///
/// # Errors
/// `DeviceNotFound` for a name that is unknown or a host where nobody listens, `DeviceTimeout` when
/// the host is silent.
pub fn open(host: &str, port: u16) -> Result<Box<dyn Link>> {
    let device = format!("{host}:{port}");
    let mut failure = None;
    for address in resolved(host, port)? {
        match TcpStream::connect_timeout(&address, CONNECT_TIMEOUT) {
            Ok(stream) => {
                let failed = |error| device_error(&device, &error);
                // Small messages go out at once.
                stream.set_nodelay(true).map_err(failed)?;
                stream.set_write_timeout(Some(WRITE_TIMEOUT)).map_err(failed)?;
                return Ok(Box::new(TcpLink(Arc::new(Connection { device, stream, sending: Mutex::new(()) }))));
            }
            Err(error) => failure = Some(error),
        }
    }
    Err(match failure {
        Some(error) if error.kind() == ErrorKind::TimedOut => {
            Error::DeviceTimeout { what: "host", seconds: CONNECT_TIMEOUT.as_secs_f64() }
        }
        Some(error) => device_error(&device, &error),
        None => Error::DeviceNotFound { device, reason: "the name has no address".into() },
    })
}

/// The addresses of a host, a few of them.
pub(super) fn resolved(host: &str, port: u16) -> Result<Vec<SocketAddr>> {
    let addresses = (host, port).to_socket_addrs().map_err(|error| Error::DeviceNotFound {
        device: host.to_owned(),
        reason: format!("the name is unknown ({error})"),
    })?;
    Ok(addresses.take(MAX_ADDRESSES).collect())
}

struct TcpLink(Arc<Connection>);

struct Connection {
    device: String,
    stream: TcpStream,
    /// Held for a whole message.
    sending: Mutex<()>,
}

impl Link for TcpLink {
    fn receive(&mut self, buffer: &mut [u8], timeout: f64) -> Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        let connection = &self.0;
        let ready = wait([connection.stream.as_fd()], Ready::Read, timeout);
        if !ready.map_err(|error| connection.lost(&error.to_string()))?[0] {
            return Ok(0);
        }
        match (&connection.stream).read(buffer) {
            Ok(0) => Err(connection.lost("the host closed the connection")),
            Ok(count) => Ok(count),
            Err(error) if [ErrorKind::WouldBlock, ErrorKind::Interrupted].contains(&error.kind()) => Ok(0),
            Err(error) => Err(connection.lost(&error.to_string())),
        }
    }

    fn sender(&self) -> Arc<dyn Sender> {
        self.0.clone()
    }
}

impl Sender for Connection {
    fn send(&self, message: &[u8]) -> Result<()> {
        let _whole = unpoisoned(&self.sending);
        match (&self.stream).write_all(message) {
            Ok(()) => Ok(()),
            Err(error) if [ErrorKind::WouldBlock, ErrorKind::TimedOut].contains(&error.kind()) => {
                // Half a message may be out: nothing that follows could be understood.
                let _ = self.stream.shutdown(Shutdown::Both);
                Err(Error::DeviceTimeout { what: "host", seconds: WRITE_TIMEOUT.as_secs_f64() })
            }
            Err(error) => Err(self.lost(&error.to_string())),
        }
    }
}

impl Connection {
    fn lost(&self, reason: &str) -> Error {
        let _ = self.stream.shutdown(Shutdown::Both);
        Error::DeviceLost { reason: format!("{}: {reason}", self.device) }
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn bytes_go_both_ways_until_the_host_closes() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut link = open("127.0.0.1", listener.local_addr().unwrap().port()).unwrap();
        let (mut far, _) = listener.accept().unwrap();
        link.sender().send(b"question").unwrap();
        let mut asked = [0; 8];
        far.read_exact(&mut asked).unwrap();
        assert_eq!(&asked, b"question");
        let mut buffer = [0; 16];
        assert_eq!(link.receive(&mut buffer, 0.02).unwrap(), 0);
        assert_eq!(link.receive(&mut buffer, f64::NAN).unwrap(), 0);
        far.write_all(b"answer").unwrap();
        assert_eq!(link.receive(&mut buffer, 1.0).unwrap(), 6);
        assert_eq!(&buffer[..6], b"answer");
        drop(far);
        assert!(matches!(link.receive(&mut buffer, 1.0), Err(Error::DeviceLost { .. })));
        assert!(matches!(link.sender().send(b"x"), Err(Error::DeviceLost { .. })));
    }

    #[test]
    fn a_host_that_takes_nothing_fails_in_time() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let link = open("127.0.0.1", listener.local_addr().unwrap().port()).unwrap();
        let (_far, _) = listener.accept().unwrap();
        let error = (0..100).find_map(|_| link.sender().send(&[0; 1 << 20]).err()).unwrap();
        assert!(matches!(error, Error::DeviceTimeout { what: "host", .. }), "{error}");
        assert!(matches!(link.sender().send(b"x"), Err(Error::DeviceLost { .. })));
    }

    #[test]
    fn where_nobody_listens_there_is_no_device() {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        assert!(matches!(open("127.0.0.1", port), Err(Error::DeviceNotFound { .. })));
        assert!(matches!(open("no.such.host.invalid", 1), Err(Error::DeviceNotFound { .. })));
    }
}
