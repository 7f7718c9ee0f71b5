//! Hosts that end badly: processes that open the laser and are killed, stopped, or hang. Each is this
//! program again, running only the one ignored test here in the role that its environment names.

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use ptzcal::Result;
use ptzcal::control::Log;
use ptzcal::device::{Address, Laser, Surroundings, open_laser};

pub const ADDRESS: &str = "gpio:///dev/gpiochip0/laser";

pub fn open(address: &str) -> Result<Box<dyn Laser>> {
    let log = Log::to(|level, message| println!("log {level:?}: {message}"));
    open_laser(&Address::parse(address)?, &Surroundings { log, ..Surroundings::default() })
}

#[test]
#[ignore = "a role for another test"]
fn role() {
    let Ok(role) = std::env::var("PTZCAL_TEST_ROLE") else { return };
    let address = std::env::var("PTZCAL_TEST_ADDRESS").unwrap();
    let mut laser = match open(&address) {
        Ok(laser) => laser,
        Err(error) => return println!("\nerror {error:?}"),
    };
    println!("\nopen");
    let end = Instant::now() + Duration::from_secs(60);
    match role.as_str() {
        // On and off in haste.
        "toggle" => {
            let mut on = false;
            while Instant::now() < end {
                on = !on;
                laser.set(on).unwrap();
                std::thread::sleep(Duration::from_millis(if on { 40 } else { 5 }));
            }
        }
        // On, and looks after it.
        "watch" => {
            laser.set(true).unwrap();
            println!("\non");
            while Instant::now() < end {
                if let Err(error) = laser.check() {
                    return println!("\nerror {error:?}");
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        // On, and nothing more.
        "hang" => {
            laser.set(true).unwrap();
            println!("\non");
            std::thread::sleep(Duration::from_secs(60));
        }
        // On, with a copy of the process that outlives it and holds all it held.
        "fork" => {
            laser.set(true).unwrap();
            // SAFETY: the copy only sleeps and ends.
            unsafe {
                if libc::fork() == 0 {
                    libc::sleep(5);
                    libc::_exit(0);
                }
            }
            println!("\non");
            std::thread::sleep(Duration::from_secs(60));
        }
        _ => panic!("role {role}"),
    }
}

/// A host in a role.
pub struct Host {
    pub child: Child,
    output: BufReader<ChildStdout>,
}

impl Host {
    pub fn start(role: &str, address: &str) -> Self {
        Self::start_with(role, address, |_| {})
    }

    pub fn start_with(role: &str, address: &str, change: impl FnOnce(&mut Command)) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command
            .args(["inside::laser_host::role", "--exact", "--ignored", "--nocapture"])
            .env("PTZCAL_TEST_ROLE", role)
            .env("PTZCAL_TEST_ADDRESS", address)
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
        change(&mut command);
        let mut child = command.spawn().unwrap();
        let output = BufReader::new(child.stdout.take().unwrap());
        Self { child, output }
    }

    /// Waits for a line that begins so, and gives it.
    pub fn wait_for(&mut self, begin: &str) -> String {
        let mut line = String::new();
        while self.output.read_line(&mut line).unwrap() > 0 {
            if line.starts_with(begin) {
                return line;
            }
            line.clear();
        }
        panic!("the host ended before it said {begin:?}");
    }

    pub fn signal(&self, signal: i32) {
        // SAFETY: a child that was not waited for.
        assert_eq!(unsafe { libc::kill(self.child.id() as i32, signal) }, 0);
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
