//! Emulated VISCA cameras for whoever writes a controller and has no camera: on a pseudo-terminal and
//! on UDP and TCP ports, with any fault that real ones have. `--help` says how.

use std::error::Error;
use std::io::Read;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ptzcal::device::visca::models::Model;
use ptzcal::sim::ScaledClock;
use ptzcal::sim::visca_device::{EmulatorOptions, FaultKind, ServerBuilder, ViscaDevice};

const HELP: &str = "\
Emulated VISCA cameras. They run until Ctrl-C or the end of input.

usage: cargo run --example visca_emulator -- [OPTIONS]

  --pty PATH          serial line: PATH becomes a link to a pseudo-terminal [default: visca-emulator
                      in the folder of temporary files, when no other way is given]
  --ip ADDRESS        VISCA over IP, such as 127.0.0.1:52381
  --udp ADDRESS       packets in datagrams without a header, such as 127.0.0.1:1259
  --tcp ADDRESS       packets over TCP, such as 127.0.0.1:5678
  --model NAME[,..]   the camera, or the cameras of a chain [default: evi-d100]
  --baud RATE         bits per second of the line; 0: no time passes on it [default: 9600]
  --fault FAULT       what goes wrong: KIND=PROBABILITY at each occasion, or KIND@MOMENT once, in
                      seconds from the start; with :SECONDS where it takes time. Any number of times
  --stale-position    positions asked for during a move are those of its beginning
  --no-stop-first     absolute moves are taken while the head drives or goes home
  --seed NUMBER       delays and faults follow from it [default: 1]
  --speed FACTOR      the cameras' time runs so much faster than ours [default: 1]
  --quiet             do not print where the heads are
  --help              this
";

/// What the user asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Arguments {
    pub pty: Option<PathBuf>,
    pub ip: Vec<SocketAddr>,
    pub udp: Vec<SocketAddr>,
    pub tcp: Vec<SocketAddr>,
    pub options: EmulatorOptions,
    pub speed: f64,
    pub quiet: bool,
}

impl Arguments {
    /// `None`: help is asked for.
    pub fn parse(arguments: impl IntoIterator<Item = String>) -> Result<Option<Self>, Box<dyn Error>> {
        let mut parsed = Self {
            pty: None,
            ip: Vec::new(),
            udp: Vec::new(),
            tcp: Vec::new(),
            options: EmulatorOptions::default(),
            speed: 1.0,
            quiet: false,
        };
        let mut arguments = arguments.into_iter();
        while let Some(name) = arguments.next() {
            let mut value = || arguments.next().ok_or_else(|| format!("{name} wants a value"));
            let options = &mut parsed.options;
            match &name[..] {
                "--help" | "-h" => return Ok(None),
                "--pty" => parsed.pty = Some(value()?.into()),
                "--ip" => parsed.ip.push(value()?.parse()?),
                "--udp" => parsed.udp.push(value()?.parse()?),
                "--tcp" => parsed.tcp.push(value()?.parse()?),
                "--model" => options.models = models(&value()?)?,
                "--baud" => options.baud = value()?.parse()?,
                "--fault" => options.faults.push(value()?.parse()?),
                "--stale-position" => options.behaviour.stale_position = true,
                "--no-stop-first" => options.behaviour.stop_first = false,
                "--seed" => options.seed = value()?.parse()?,
                "--speed" => parsed.speed = value()?.parse()?,
                "--quiet" => parsed.quiet = true,
                _ => return Err(format!("unknown option {name}; --help lists them").into()),
            }
        }
        if !(parsed.speed > 0.0 && parsed.speed <= 1000.0) {
            return Err(format!("--speed {}: a number above 0, at most 1000", parsed.speed).into());
        }
        if parsed.ip.is_empty() && parsed.udp.is_empty() && parsed.tcp.is_empty() && parsed.pty.is_none() {
            parsed.pty = Some(std::env::temp_dir().join("visca-emulator"));
        }
        Ok(Some(parsed))
    }
}

fn models(names: &str) -> Result<Vec<&'static Model>, String> {
    let known = || Model::ALL.map(|model| model.name).join(", ");
    names.split(',').map(|n| Model::named(n).ok_or_else(|| format!("no model {n:?}; known: {}", known()))).collect()
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let Some(arguments) = Arguments::parse(std::env::args().skip(1))? else {
        print!("{HELP}");
        println!("\nmodels: {}", Model::ALL.map(|model| model.name).join(", "));
        println!("faults: {}", FaultKind::ALL.map(FaultKind::name).join(", "));
        return Ok(());
    };
    let device = ViscaDevice::new(&arguments.options, Arc::new(ScaledClock::new(arguments.speed)))?;
    let mut builder = ServerBuilder::new(&device);
    if let Some(path) = &arguments.pty {
        builder.pty(path)?;
        println!("serial line           {}", path.display());
    }
    for address in &arguments.ip {
        println!("VISCA over IP         {} (UDP)", builder.ip(*address)?);
    }
    for address in &arguments.udp {
        println!("VISCA without header  {} (UDP)", builder.raw_udp(*address)?);
    }
    for address in &arguments.tcp {
        println!("VISCA without header  {} (TCP)", builder.raw_tcp(*address)?);
    }
    let server = builder.start()?;
    let names: Vec<&str> = arguments.options.models.iter().map(|model| model.name).collect();
    println!("cameras from address 1 on: {}. Ctrl-C or the end of input stops.", names.join(", "));

    let stop = stop_on_end();
    let mut shown = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        let heads = heads(&device, &arguments.options.models);
        if !arguments.quiet && heads != shown {
            println!("{}", heads.join("   "));
            shown = heads;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    // The link to the pseudo-terminal goes with it.
    drop(server);
    println!("stopped after {} requests", device.emulator().requests());
    Ok(())
}

/// Where the heads are, degrees.
fn heads(device: &ViscaDevice, models: &[&Model]) -> Vec<String> {
    let now = device.clock().now();
    let mut emulator = device.emulator();
    let line = |(i, model): (usize, &&Model)| {
        let [pan, tilt] = emulator.position(i, now)?;
        let degrees = [model.pan.to_radians(pan), model.tilt.to_radians(tilt)].map(f64::to_degrees);
        let zoom = emulator.zoom(i, now)?;
        Some(format!("{}: pan {:.2} tilt {:.2} deg, zoom {zoom:04X}", i + 1, degrees[0], degrees[1]))
    };
    models.iter().enumerate().filter_map(line).collect()
}

static STOP: AtomicBool = AtomicBool::new(false);

/// Is set at the end of input, and by Ctrl-C or SIGTERM.
fn stop_on_end() -> &'static AtomicBool {
    #[cfg(unix)]
    {
        extern "C" fn stop(_signal: libc::c_int) {
            STOP.store(true, Ordering::Relaxed);
        }
        let handler = stop as extern "C" fn(libc::c_int);
        for signal in [libc::SIGINT, libc::SIGTERM] {
            // SAFETY: the handler only stores into an atomic, which a signal handler may.
            unsafe { libc::signal(signal, handler as libc::sighandler_t) };
        }
    }
    std::thread::spawn(|| {
        let mut buffer = [0; 256];
        while matches!(std::io::stdin().read(&mut buffer), Ok(1..)) {}
        STOP.store(true, Ordering::Relaxed);
    });
    &STOP
}
