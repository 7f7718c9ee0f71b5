//! Finds out what a device really is and does, and prints it:
//!
//! ```text
//! cargo run --release --example probe -- sim:room?backlash_deg=0.1
//! cargo run --release --example probe -- visca:///dev/serial/by-id/... v4l2:///dev/video0 --limits
//! cargo run --release --example probe -- onvif://operator@192.168.0.20/ --amplitude=0.05
//! ```
//!
//! First the head's address, then its camera's frames' (optional). `--limits` goes to the ends of the
//! range, `--laser` switches the laser of a simulated rig, `--amplitude=` is the moves' share of the range.
//! User and password are taken from PTZ_USER and PTZ_PASSWORD.

use std::process::ExitCode;

use ptzcal::control::{Cancel, Log};
use ptzcal::device::{
    Address, Credentials, FrameSource, LaserLimits, PanTiltZoom, Surroundings, open_frames, open_ptz,
};
use ptzcal::geometry::Camera;
use ptzcal::probe::{ProbeOptions, ProbeParts, ProbeReport, probe};
use ptzcal::rig::LaserControl;
use ptzcal::sim::{SimOptions, Simulator};

/// What an address led to.
struct Devices {
    head: Box<dyn PanTiltZoom>,
    frames: Option<Box<dyn FrameSource>>,
    laser: Option<LaserControl>,
    camera: Option<Camera>,
    surroundings: Surroundings,
}

fn simulated(address: &str) -> ptzcal::Result<Devices> {
    let simulator = Simulator::new(SimOptions::parse(address)?)?;
    let (laser, clock) = (Box::new(simulator.laser()), simulator.clock());
    Ok(Devices {
        head: Box::new(simulator.ptz()),
        frames: Some(Box::new(simulator.head_frames())),
        laser: Some(LaserControl::new(laser, clock.clone(), Log::silent(), &LaserLimits::default())?),
        // Its nominal model, as a calibration would have found it.
        camera: Some(simulator.nominal_rig().head_camera(0.0, 0.0)),
        surroundings: Surroundings { clock, ..Surroundings::default() },
    })
}

fn real(head: &str, frames: Option<&str>) -> ptzcal::Result<Devices> {
    let variable = |name| std::env::var(name).ok();
    let credentials =
        variable("PTZ_USER").zip(variable("PTZ_PASSWORD")).map(|(user, password)| Credentials { user, password });
    let surroundings = Surroundings { credentials, ..Surroundings::default() };
    let frames = frames.map(|f| open_frames(&Address::parse(f)?, &surroundings)).transpose()?;
    let head = open_ptz(&Address::parse(head)?, &surroundings)?;
    Ok(Devices { head, frames, laser: None, camera: None, surroundings })
}

fn run(arguments: &[String]) -> ptzcal::Result<ProbeReport> {
    let mut options = ProbeOptions::default();
    let mut addresses = Vec::new();
    for argument in arguments {
        match argument.as_str() {
            "--limits" => options.reach_limits = true,
            "--laser" => options.toggle_laser = true,
            other => match other.strip_prefix("--amplitude=") {
                Some(share) => options.amplitude = share.parse().unwrap_or(f64::NAN),
                None => addresses.push(other),
            },
        }
    }
    let usage = || {
        ptzcal::Error::invalid(
            "arguments",
            "probe HEAD-ADDRESS [FRAMES-ADDRESS] [--limits] [--laser] [--amplitude=0.1]",
        )
    };
    let head = addresses.first().ok_or_else(usage)?;
    let mut devices = if head.starts_with("sim:") { simulated(head)? } else { real(head, addresses.get(1).copied())? };
    let parts = ProbeParts {
        head: &mut *devices.head,
        frames: devices.frames.as_mut().map(|f| &mut **f as &mut dyn FrameSource),
        laser: devices.laser.as_ref(),
        camera: devices.camera,
        clock: &*devices.surroundings.clock,
        log: &Log::silent(),
    };
    probe(parts, &options, &Cancel::new())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(report) => {
            println!("{report}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            if let Some(hint) = error.hint() {
                eprintln!("{hint}");
            }
            ExitCode::FAILURE
        }
    }
}
