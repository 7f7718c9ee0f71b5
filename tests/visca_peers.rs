//! The emulated cameras against VISCA clients that other people wrote: grafton-visca (Rust, serial),
//! visca-over-ip (Python, UDP with the header) and pyvisca (Python, serial).

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use grafton_visca::CompileTimeProfile;
use grafton_visca::blocking::{CameraConfig, Connect, Session};
use grafton_visca::camera::profiles::{PtzOpticsG2, SonyBRC300, SonyEVIH100};
use grafton_visca::transport::serial::Startup;
use grafton_visca::types::{SpeedLevel, ZoomPosition};
use grafton_visca::units::Degrees;
use ptzcal::device::visca::models::Model;
use ptzcal::sim::ScaledClock;
use ptzcal::sim::visca_device::{EmulatorOptions, Server, ServerBuilder, ViscaDevice};

#[path = "support/python.rs"]
mod python_programs;

use python_programs::{environment, output};

/// The emulator's time runs so much faster.
const FASTER: f64 = 5.0;

fn device(model: &'static Model, baud: f64) -> ViscaDevice {
    let options = EmulatorOptions { models: vec![model], baud, ..EmulatorOptions::default() };
    ViscaDevice::new(&options, Arc::new(ScaledClock::new(FASTER))).unwrap()
}

/// A device behind a pseudo-terminal.
fn on_a_line(model: &'static Model, path: &Path) -> (ViscaDevice, Server) {
    let device = device(model, 9600.0);
    let mut builder = ServerBuilder::new(&device);
    builder.pty(path).unwrap();
    (device, builder.start().unwrap())
}

fn position(device: &ViscaDevice) -> [i32; 2] {
    let now = device.clock().now();
    device.emulator().position(0, now).unwrap()
}

fn zoom(device: &ViscaDevice) -> u16 {
    let now = device.clock().now();
    device.emulator().zoom(0, now).unwrap()
}

/// AddressSet, IF_Clear, and a session.
fn grafton<P>(path: &Path) -> Session
where
    P: CompileTimeProfile + grafton_visca::capabilities::SupportsSerial,
{
    let startup = Startup::default().with_address_set(true).with_interface_clear(true);
    CameraConfig::<P>::serial(path.to_str().unwrap(), 9600).serial_startup(startup).open_serial().unwrap()
}

#[test]
fn grafton_visca_drives_an_evi_h100() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera");
    let (device, _server) = on_a_line(&Model::EVI_H100, &path);
    let session = grafton::<SonyEVIH100>(&path);
    let camera = session.camera::<SonyEVIH100>().unwrap();
    let version = camera.system().version().unwrap();
    // Sony's, an EVI-H100V.
    assert_eq!((version.vendor, version.model, version.max_socket), (0x0001, 0x050e, 2));
    let at = camera.pan_tilt().position().unwrap();
    assert_eq!((at.pan, at.tilt), (0, 0));
    camera.pan_tilt().absolute(Degrees(20.0), Degrees(-10.0), SpeedLevel::Fast).unwrap().settled().unwrap();
    let at = camera.pan_tilt().position().unwrap();
    // 7707 units are 170 degrees.
    assert!((at.pan - 907).abs() <= 1 && (at.tilt + 453).abs() <= 1, "{at:?}");
    assert_eq!(position(&device), [at.pan, at.tilt]);
    camera.pan_tilt().relative(Degrees(-5.0), Degrees(5.0), SpeedLevel::Fast).unwrap().settled().unwrap();
    assert!((position(&device)[0] - 680).abs() <= 2 && (position(&device)[1] + 227).abs() <= 2);
    camera.zoom().set_position(ZoomPosition::new(0x2000).unwrap()).unwrap().settled().unwrap();
    assert_eq!((zoom(&device), camera.zoom().position().unwrap().value()), (0x2000, 0x2000));
    camera.pan_tilt().stop().unwrap().applied().unwrap();
    camera.pan_tilt().home().unwrap().settled().unwrap();
    assert_eq!(position(&device), [0, 0]);
    session.close().unwrap();
}

#[test]
fn grafton_visca_drives_a_brc_300() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera");
    let (device, _server) = on_a_line(&Model::BRC_300, &path);
    let session = grafton::<SonyBRC300>(&path);
    let camera = session.camera::<SonyBRC300>().unwrap();
    assert_eq!(camera.system().version().unwrap().model, 0x040f);
    camera.pan_tilt().absolute(Degrees(10.0), Degrees(12.0), SpeedLevel::Fastest).unwrap().settled().unwrap();
    let (at, read) = (position(&device), camera.pan_tilt().position().unwrap());
    println!("10 and 12 degrees: the emulator is at {at:?}, the client reads {read:?}");
    assert_eq!(at, [read.pan, read.tilt]);
    // Right is negative. The client counts 208 units per degree; the manual's ends of travel (8A58 for
    // 170 degrees, 493D for 90) say 208.33.
    assert_eq!(at, [-2080, 2496]);
    session.close().unwrap();
}

/// Commands of the clones, over TCP and UDP without a header.
#[test]
fn grafton_visca_drives_a_ptzoptics_over_the_network() {
    let device = device(&Model::PTZOPTICS, 0.0);
    let mut builder = ServerBuilder::new(&device);
    let any: SocketAddr = "127.0.0.1:0".parse().unwrap();
    let (tcp, udp) = (builder.raw_tcp(any).unwrap(), builder.raw_udp(any).unwrap());
    let _server = builder.start().unwrap();
    let sessions = [
        Connect::open_tcp::<PtzOpticsG2>(tcp.to_string()).unwrap(),
        Connect::open_udp::<PtzOpticsG2>(udp.to_string()).unwrap(),
    ];
    for (session, sign) in sessions.into_iter().zip([1.0, -1.0]) {
        let camera = session.camera();
        assert!(camera.power().state().unwrap());
        let (pan, tilt) = (Degrees(-30.0 * sign), Degrees(12.0 + sign));
        camera.pan_tilt().absolute(pan, tilt, SpeedLevel::Fast).unwrap().settled().unwrap();
        let at = camera.pan_tilt().position().unwrap();
        // 14.4 units are a degree.
        assert_eq!(position(&device), [(-432.0 * sign) as i32, if sign > 0.0 { 187 } else { 158 }]);
        assert_eq!(position(&device), [at.pan, at.tilt]);
        camera.zoom().set_position(ZoomPosition::new(0x1800).unwrap()).unwrap().settled().unwrap();
        assert_eq!(camera.zoom().position().unwrap().value(), 0x1800);
        session.close().unwrap();
    }
}

/// Runs a program in the Python clients' environment.
fn run(program: &str, argument: &str) -> Option<String> {
    static PYTHON: OnceLock<Option<PathBuf>> = OnceLock::new();
    let packages = ["visca-over-ip==0.5.2", "pyvisca==0.1.9", "pyserial"];
    let make = || environment("visca-peers-venv", &packages, "visca_over_ip, pyvisca, serial");
    let python = PYTHON.get_or_init(make).as_ref()?;
    let (success, text) = output(Command::new(python).args(["-c", program, argument]), Duration::from_secs(60));
    assert!(success, "{text}");
    print!("{text}");
    Some(text)
}

fn lines(text: &str) -> Vec<&str> {
    text.lines().collect()
}

/// It waits at most 0.1 s for an answer, of the system's time.
#[test]
fn visca_over_ip_drives_a_d100() {
    let address: SocketAddr = "127.0.0.2:0".parse().unwrap();
    let device = device(&Model::EVI_D100, 0.0);
    let mut builder = ServerBuilder::new(&device);
    let address = builder.ip(address).unwrap();
    let _server = builder.start().unwrap();
    let program = "
import socket, sys, time
from visca_over_ip import Camera

class Modest(socket.socket):
    # The client takes the camera's port for itself, of all addresses: one will do.
    def bind(self, address):
        super().bind(('127.0.0.1', address[1]))

import visca_over_ip.camera
visca_over_ip.camera.socket.socket = Modest
camera = Camera('127.0.0.2', int(sys.argv[1]))
print(camera.get_pantilt_position())
camera.pantilt(12, 12, 0x100, -0x80)
while camera.get_pantilt_position() != (0x100, -0x80):
    time.sleep(0.02)
camera.zoom_to(0.5)
while camera.get_zoom_position() != 0x2000:
    time.sleep(0.02)
print(camera.get_pantilt_position(), camera.get_zoom_position(), camera.get_focus_mode())
camera.save_preset(2)
camera.pantilt_home()
while camera.get_pantilt_position() != (0, 0):
    time.sleep(0.02)
camera.recall_preset(2)
while camera.get_pantilt_position() != (0x100, -0x80):
    time.sleep(0.02)
camera.pantilt(10, 0)
time.sleep(0.2)
camera.pantilt(0, 0)
stopped = camera.get_pantilt_position()
time.sleep(0.2)
print('stands', camera.get_pantilt_position() == stopped, 'moved', stopped[0] - 0x100)
try:
    camera.set_focus_mode('infinity')
except Exception as error:
    print(type(error).__name__, error.status_code)
";
    let Some(text) = run(program, &address.port().to_string()) else { return };
    let lines = lines(&text);
    assert_eq!(lines[..2], ["(0, 0)", "(256, -128) 8192 auto"]);
    // Its direction 02 is right, as in the manuals; its own documentation says left.
    let moved: i32 = lines[2].strip_prefix("stands True moved ").unwrap().parse().unwrap();
    assert!(moved > 0, "{text}");
    assert_eq!(lines[3], "ViscaException 2");
}

#[test]
fn pyvisca_drives_a_d100() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera");
    let (device, _server) = on_a_line(&Model::EVI_D100, &path);
    let program = "
import sys, time
from pyvisca.visca import PTZ
camera = PTZ(sys.argv[1])
def get(inquire):
    # It takes the next packet for the answer, and that may be a completion.
    for attempt in range(100):
        try:
            return inquire()
        except (IndexError, ValueError):
            time.sleep(0.02)
def until(inquire, value):
    end = time.time() + 20
    while get(inquire) != value and time.time() < end:
        time.sleep(0.05)
    return get(inquire)
print(camera.get_power(), camera.get_pan(), camera.get_tilt())
camera.set_pan(0x120, 10)
print(until(camera.get_pan, 0x120))
camera.set_zoom(0x1234)
print(hex(until(camera.get_zoom, 0x1234)))
camera.set_pan(-100, 10)
time.sleep(5)
print(get(camera.get_pan) - 65536)
camera.right(8)
time.sleep(0.5)
camera.stop()
time.sleep(0.5)
there = get(camera.get_pan)
time.sleep(0.5)
print('stands', get(camera.get_pan) == there)
";
    let Some(text) = run(program, path.to_str().unwrap()) else { return };
    // It takes one unit too many from negative numbers: 65535 for 65536.
    assert_eq!(lines(&text), ["1 0 0", "288", "0x1234", "-101", "stands True"]);
    assert!(position(&device)[0] > -101);
}
