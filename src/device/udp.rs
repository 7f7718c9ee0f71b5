//! Datagrams as links.
#![allow(unsafe_code)]

use std::io::{self, ErrorKind};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::os::fd::{AsFd, FromRawFd, OwnedFd};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::poll::{Ready, wait};
use super::tcp::resolved;
use super::{Link, Sender, device_error};
use crate::error::{Error, Result};

/// Datagrams to and from a host. Accepted is what comes from the host's address, whatever its port.
///
/// `reply_port`: some devices answer to this port instead of the one that they were asked from. It is
/// listened on too if it is free; several links to different hosts may share it.
///
/// # Errors
/// `DeviceNotFound` for a name that is unknown. That nobody listens shows only when no answer comes.
pub fn open(host: &str, port: u16, reply_port: Option<u16>) -> Result<Box<dyn Link>> {
    let device = format!("{host}:{port}");
    let Some(peer) = resolved(host, port)?.first().copied() else {
        return Err(Error::DeviceNotFound { device, reason: "the name has no address".into() });
    };
    let any: SocketAddr = if peer.is_ipv4() { ([0; 4], 0).into() } else { ([0u16; 8], 0).into() };
    let socket = UdpSocket::bind(any).and_then(|socket| socket.set_nonblocking(true).map(|()| socket));
    let socket = socket.map_err(|error| device_error(&device, &error))?;
    let side = match (peer.ip(), reply_port) {
        (IpAddr::V4(_), Some(reply_port)) => shared_socket(reply_port, peer).ok(),
        _ => None,
    };
    Ok(Box::new(UdpLink { end: Arc::new(End { device, socket, peer }), side }))
}

struct UdpLink {
    end: Arc<End>,
    /// On the reply port.
    side: Option<UdpSocket>,
}

struct End {
    device: String,
    socket: UdpSocket,
    peer: SocketAddr,
}

impl Link for UdpLink {
    fn receive(&mut self, buffer: &mut [u8], timeout: f64) -> Result<usize> {
        let end = Instant::now() + Duration::from_secs_f64(timeout.clamp(0.0, 3600.0).max(0.0));
        loop {
            let left = end.saturating_duration_since(Instant::now()).as_secs_f64();
            let (main, side) = (&self.end.socket, self.side.as_ref());
            let ready = wait([main.as_fd(), side.unwrap_or(main).as_fd()], Ready::Read, left);
            let [main_ready, side_ready] = ready.map_err(|error| device_error(&self.end.device, &error))?;
            if !main_ready && !side_ready {
                return Ok(0);
            }
            let socket = if main_ready { main } else { side.unwrap_or(main) };
            match socket.recv_from(buffer) {
                Ok((count, from)) if from.ip() == self.end.peer.ip() && count > 0 => return Ok(count),
                Ok(_) => (),
                // Unreachable hosts are reported here, late and about an earlier datagram; the silence
                // says it too.
                Err(error) if is_passing(&error) => (),
                Err(error) => return Err(device_error(&self.end.device, &error)),
            }
            if left == 0.0 {
                return Ok(0);
            }
        }
    }

    fn sender(&self) -> Arc<dyn Sender> {
        self.end.clone()
    }
}

impl Sender for End {
    fn send(&self, message: &[u8]) -> Result<()> {
        match self.socket.send_to(message, self.peer) {
            Ok(_) => Ok(()),
            // As good as lost on the way.
            Err(error) if is_passing(&error) => Ok(()),
            Err(error) => Err(device_error(&self.device, &error)),
        }
    }
}

fn is_passing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted | ErrorKind::ConnectionRefused)
}

/// A socket on a port that several sockets share: connected to their hosts, each gets only what its
/// host sends.
fn shared_socket(port: u16, peer: SocketAddr) -> io::Result<UdpSocket> {
    let kind = libc::SOCK_DGRAM | libc::SOCK_CLOEXEC | libc::SOCK_NONBLOCK;
    let on: libc::c_int = 1;
    let size = |bytes: usize| bytes as libc::socklen_t;
    let address = libc::sockaddr_in {
        sin_family: libc::AF_INET as libc::sa_family_t,
        sin_port: port.to_be(),
        sin_addr: libc::in_addr { s_addr: u32::from(Ipv4Addr::UNSPECIFIED).to_be() },
        sin_zero: [0; 8],
    };
    // SAFETY: a new descriptor, owned from the start; options and address are passed with their sizes.
    let socket = unsafe {
        let fd = libc::socket(libc::AF_INET, kind, 0);
        if fd < 0 {
            return Err(io::Error::last_os_error());
        }
        let owned = OwnedFd::from_raw_fd(fd);
        let shared = (&raw const on).cast();
        if libc::setsockopt(fd, libc::SOL_SOCKET, libc::SO_REUSEPORT, shared, size(size_of_val(&on))) < 0
            || libc::bind(fd, (&raw const address).cast(), size(size_of_val(&address))) < 0
        {
            return Err(io::Error::last_os_error());
        }
        UdpSocket::from(owned)
    };
    socket.connect(peer)?;
    Ok(socket)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn local(ip: &str) -> UdpSocket {
        let socket = UdpSocket::bind((ip, 0)).unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        socket
    }

    #[test]
    fn datagrams_come_one_at_a_time_and_from_the_host_only() {
        let far = local("127.0.0.1");
        let mut link = open("127.0.0.1", far.local_addr().unwrap().port(), None).unwrap();
        link.sender().send(b"question").unwrap();
        let mut buffer = [0; 32];
        let (count, near) = far.recv_from(&mut buffer).unwrap();
        assert_eq!(&buffer[..count], b"question");
        local("127.0.0.2").send_to(b"stranger", near).unwrap();
        far.send_to(b"one", near).unwrap();
        // Another port of the same host.
        local("127.0.0.1").send_to(b"three", near).unwrap();
        assert_eq!(link.receive(&mut buffer, 1.0).unwrap(), 3);
        assert_eq!(link.receive(&mut buffer, 1.0).unwrap(), 5);
        let start = Instant::now();
        assert_eq!(link.receive(&mut buffer, 0.05).unwrap(), 0);
        assert!(start.elapsed().as_secs_f64() < 1.0);
    }

    #[test]
    fn answers_to_the_reply_port_are_heard_by_whom_they_are_for() {
        // Any free port stands for the one of the protocol.
        let reply_port = local("0.0.0.0").local_addr().unwrap().port();
        let cameras = [local("127.0.0.2"), local("127.0.0.3")];
        let mut links = cameras.each_ref().map(|camera| {
            let address = camera.local_addr().unwrap();
            open(&address.ip().to_string(), address.port(), Some(reply_port)).unwrap()
        });
        for (i, camera) in cameras.iter().enumerate() {
            camera.send_to(&[i as u8; 3][..=i], ("127.0.0.1", reply_port)).unwrap();
        }
        let mut buffer = [9; 8];
        for (i, link) in links.iter_mut().enumerate() {
            assert_eq!(link.receive(&mut buffer, 1.0).unwrap(), i + 1);
            assert_eq!(buffer[0], i as u8);
            assert_eq!(link.receive(&mut buffer, 0.0).unwrap(), 0);
        }
    }

    #[test]
    fn silence_is_silence_and_not_an_error() {
        let port = local("127.0.0.1").local_addr().unwrap().port();
        let mut link = open("127.0.0.1", port, None).unwrap();
        for _ in 0..3 {
            link.sender().send(b"anybody?").unwrap();
            assert_eq!(link.receive(&mut [0; 8], 0.02).unwrap(), 0);
        }
        assert!(matches!(open("no.such.host.invalid", 1, None), Err(Error::DeviceNotFound { .. })));
    }
}
