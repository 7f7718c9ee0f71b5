//! Ways to an emulated device over the network. Nothing here blocks: what nobody reads is lost.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};

use super::emulator::Emulator;
use super::ip::{IpSession, MAX_PEERS};
use super::wire::{Origin, Outgoing};
use crate::device::visca::codec::Framer;

/// One way to the device.
pub(super) trait Port: Send {
    /// The link is up, or down.
    fn plug(&mut self, plugged: bool);
    /// Hands what has arrived to the emulator; false when nothing has.
    fn hear(&mut self, number: u16, emulator: &mut Emulator, now: f64) -> bool;
    fn say(&mut self, outgoing: &Outgoing);
}

/// Reads of one turn, so that one way does not starve the others.
const MAX_READS: usize = 64;

/// Datagrams, with or without the header of VISCA over IP.
pub(super) struct Udp {
    socket: UdpSocket,
    header: Option<IpSession>,
    /// Who has spoken; when there is no more room the oldest is forgotten.
    peers: Vec<SocketAddr>,
    plugged: bool,
}

impl Udp {
    pub fn bind(address: SocketAddr, header: bool) -> io::Result<(Self, SocketAddr)> {
        let socket = UdpSocket::bind(address)?;
        socket.set_nonblocking(true)?;
        let address = socket.local_addr()?;
        let header = header.then(IpSession::default);
        Ok((Self { socket, header, peers: Vec::new(), plugged: true }, address))
    }

    fn peer(&mut self, address: SocketAddr) -> u16 {
        let known = self.peers.iter().position(|p| *p == address);
        known.unwrap_or_else(|| {
            if self.peers.len() == MAX_PEERS {
                self.peers[0] = address;
                if let Some(session) = &mut self.header {
                    session.forget(0);
                }
                return 0;
            }
            self.peers.push(address);
            self.peers.len() - 1
        }) as u16
    }
}

impl Port for Udp {
    fn plug(&mut self, plugged: bool) {
        // What was sent while it was unplugged went nowhere.
        let mut buffer = [0; 64];
        if !plugged || !self.plugged {
            for _ in 0..MAX_READS {
                if self.socket.recv_from(&mut buffer).is_err() {
                    break;
                }
            }
        }
        self.plugged = plugged;
    }

    fn hear(&mut self, number: u16, emulator: &mut Emulator, now: f64) -> bool {
        let mut buffer = [0; 64];
        for read in 0..MAX_READS {
            let Ok((count, address)) = self.socket.recv_from(&mut buffer) else { return read > 0 };
            let origin = Origin { port: number, peer: self.peer(address), sequence: 0 };
            let datagram = &buffer[..count];
            match &mut self.header {
                None => emulator.feed_packet(datagram, origin, now),
                Some(session) => {
                    if let Some(answer) = session.hear(origin, datagram, emulator, now) {
                        let _ = self.socket.send_to(&answer, address);
                    }
                }
            }
        }
        true
    }

    fn say(&mut self, outgoing: &Outgoing) {
        let Some(address) = self.peers.get(usize::from(outgoing.origin.peer)) else { return };
        // Datagrams may be lost.
        let _ = match &mut self.header {
            None => self.socket.send_to(&outgoing.bytes, address),
            Some(session) => self.socket.send_to(&session.say(outgoing), address),
        };
    }
}

/// The bytes of a serial line, a line for each connection.
pub(super) struct RawTcp {
    listener: TcpListener,
    /// Their places are their numbers.
    connections: Vec<Option<(TcpStream, Framer)>>,
}

impl RawTcp {
    pub fn bind(address: SocketAddr) -> io::Result<(Self, SocketAddr)> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        Ok((Self { listener, connections: Vec::new() }, address))
    }

    /// A connection that finds no place is closed.
    fn accept(&mut self) {
        let Ok((stream, _)) = self.listener.accept() else { return };
        if stream.set_nonblocking(true).is_err() || stream.set_nodelay(true).is_err() {
            return;
        }
        let connection = Some((stream, Framer::new()));
        match self.connections.iter().position(Option::is_none) {
            Some(place) => self.connections[place] = connection,
            None if self.connections.len() < MAX_PEERS => self.connections.push(connection),
            None => {}
        }
    }
}

impl Port for RawTcp {
    fn plug(&mut self, plugged: bool) {
        if !plugged {
            self.connections.clear();
            // Whoever connects meanwhile is hung up on.
            drop(self.listener.accept());
        }
    }

    fn hear(&mut self, number: u16, emulator: &mut Emulator, now: f64) -> bool {
        self.accept();
        let (mut buffer, mut heard) = ([0; 64], false);
        for (i, connection) in self.connections.iter_mut().enumerate() {
            let Some((stream, framer)) = connection else { continue };
            let origin = Origin { port: number, peer: i as u16, sequence: 0 };
            match stream.read(&mut buffer) {
                Ok(0) => *connection = None,
                Ok(count) => {
                    heard = true;
                    for packet in buffer[..count].iter().filter_map(|&byte| framer.push(byte)) {
                        emulator.feed_packet(packet.bytes(), origin, now);
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(_) => *connection = None,
            }
        }
        heard
    }

    fn say(&mut self, outgoing: &Outgoing) {
        let place = self.connections.get_mut(usize::from(outgoing.origin.peer));
        let Some((stream, _)) = place.and_then(Option::as_mut) else { return };
        // One that does not read, or is gone, is noticed at the next read.
        let _ = stream.write(&outgoing.bytes);
    }
}
