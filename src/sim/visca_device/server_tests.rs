//! The same emulator through a pseudo-terminal and sockets.

use std::fs;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream, UdpSocket};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::*;
use crate::device::visca::models::Model;
use crate::error::Error;
use crate::sim::ScaledClock;

const POSITION: [u8; 5] = [0x81, 0x09, 0x06, 0x12, 0xff];
const AT_ZERO: [u8; 11] = [0x90, 0x50, 0, 0, 0, 0, 0, 0, 0, 0, 0xff];
const ANY: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 0);
/// So long a loaded machine may take, real time.
const PATIENCE: Duration = Duration::from_secs(20);

fn device(models: &[&'static Model]) -> ViscaDevice {
    let options = EmulatorOptions { models: models.to_vec(), ..EmulatorOptions::default() };
    ViscaDevice::new(&options, Arc::new(ScaledClock::new(10.0))).unwrap()
}

/// Reads until so many bytes have come.
fn read(from: &mut dyn Read, count: usize) -> Vec<u8> {
    let (mut bytes, start) = (Vec::new(), Instant::now());
    while bytes.len() < count && start.elapsed() < PATIENCE {
        let mut buffer = [0; 64];
        if let Ok(count) = from.read(&mut buffer) {
            bytes.extend(&buffer[..count]);
        }
    }
    bytes
}

fn open(path: &Path) -> Box<dyn serialport::SerialPort> {
    serialport::new(path.to_str().unwrap(), 9600).timeout(Duration::from_millis(50)).open().unwrap()
}

#[test]
fn a_pseudo_terminal_is_a_serial_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera");
    let device = device(&[&Model::EVI_D100, &Model::BRC_300]);
    let mut builder = ServerBuilder::new(&device);
    builder.pty(&path).unwrap();
    let server = builder.start().unwrap();
    let mut port = open(&path);
    port.write_all(&POSITION).unwrap();
    assert_eq!(read(&mut port, 11), AT_ZERO);
    // In two pieces, and the second camera.
    port.write_all(&[0x82, 0x09]).unwrap();
    std::thread::sleep(Duration::from_millis(10));
    port.write_all(&[0x06, 0x12, 0xff]).unwrap();
    assert_eq!(read(&mut port, 12)[..2], [0xa0, 0x50]);
    // Every byte goes through as it is, in both directions: nothing is a control character.
    port.write_all(b"\x03\x04\x11\x13\x1a\n\r\x7f\xff").unwrap();
    port.write_all(&POSITION).unwrap();
    assert_eq!(read(&mut port, 11), AT_ZERO);

    // Unplugged: the line hangs up and the name is gone; then it is back.
    let now = device.clock().now();
    device.emulator().set_faults(&[format!("unplug@{now}:3").parse().unwrap()]).unwrap();
    let start = Instant::now();
    while fs::symlink_metadata(&path).is_ok() && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(1));
    }
    let gone = loop {
        match port.read(&mut [0; 8]) {
            Err(error) if error.kind() == std::io::ErrorKind::TimedOut && start.elapsed() < PATIENCE => {}
            other => break other,
        }
    };
    assert!(!matches!(gone, Ok(1..)), "{gone:?}");
    while !path.exists() && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(1));
    }
    let mut port = open(&path);
    port.write_all(&POSITION).unwrap();
    assert_eq!(read(&mut port, 11), AT_ZERO);
    drop(server);
    assert!(fs::symlink_metadata(&path).is_err());
}

#[test]
fn a_file_is_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file");
    fs::write(&path, "mine").unwrap();
    let device = device(&[&Model::EVI_D30]);
    let error = ServerBuilder::new(&device).pty(&path).unwrap_err();
    assert!(matches!(error, Error::DeviceBusy { .. }), "{error}");
    let error = ServerBuilder::new(&device).pty(&folder.path().join("no/such/folder")).unwrap_err();
    assert!(matches!(error, Error::DeviceNotFound { .. }), "{error}");
    assert_eq!(fs::read(&path).unwrap(), b"mine");
}

#[test]
fn three_ways_over_the_network_to_one_camera() {
    let device = device(&[&Model::PTZOPTICS]);
    let mut builder = ServerBuilder::new(&device);
    let ip = builder.ip(ANY).unwrap();
    let raw = builder.raw_udp(ANY).unwrap();
    let tcp = builder.raw_tcp(ANY).unwrap();
    assert!(matches!(builder.ip(ip), Err(Error::DeviceBusy { .. })));
    let server = builder.start().unwrap();
    let socket = UdpSocket::bind(ANY).unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    let ask = |to: SocketAddr, bytes: &[u8]| {
        let mut buffer = [0; 64];
        socket.send_to(bytes, to).unwrap();
        let (count, from) = socket.recv_from(&mut buffer).unwrap();
        assert_eq!(from, to);
        buffer[..count].to_vec()
    };
    assert_eq!(ask(raw, &POSITION), AT_ZERO);
    let asked = [&[1, 0x10, 0, 5, 0, 0, 0, 42][..], &POSITION].concat();
    let answered = [&[1, 0x11, 0, 11, 0, 0, 0, 42][..], &AT_ZERO].concat();
    assert_eq!(ask(ip, &asked), answered);
    assert_eq!(ask(ip, &asked), [2, 1, 0, 2, 0, 0, 0, 42, 0x0f, 1]);

    let mut streams: Vec<TcpStream> = (0..3).map(|_| TcpStream::connect(tcp).unwrap()).collect();
    for stream in &mut streams {
        stream.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
        stream.write_all(&POSITION).unwrap();
    }
    for stream in &mut streams {
        assert_eq!(read(stream, 11), AT_ZERO);
    }
    drop(server);
    // Hung up.
    assert_eq!(streams[0].read(&mut [0; 8]).unwrap_or(0), 0);
    assert!(TcpStream::connect(tcp).is_err());
}

#[test]
fn a_server_ends_with_its_handle() {
    let device = device(&[&Model::EVI_D100]);
    let mut builder = ServerBuilder::new(&device);
    let ip = builder.ip(ANY).unwrap();
    drop(builder.start().unwrap());
    // The port is free again at once.
    let mut builder = ServerBuilder::new(&device);
    assert_eq!(builder.ip(ip).unwrap(), ip);
}
