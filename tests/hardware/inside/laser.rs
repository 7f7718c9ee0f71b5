//! Whatever becomes of a laser's host or guard, the line goes low. Its level is read from the
//! controller's register in memory, apart from all that the library and the kernel say.

use std::os::fd::AsRawFd;
use std::os::unix::process::CommandExt;
use std::time::{Duration, Instant};

use ptzcal::Error;
use ptzcal::device::Laser;
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::laser_host::{ADDRESS, Host, open};

/// The laser is low so soon after whatever happened.
const SOON: Duration = Duration::from_millis(100);
const GUARD: &str = "ptzcal-guard";
const KEEPER: &str = "ptzcal-keeper";

/// The controller's registers.
struct Registers(*const u32);

impl Registers {
    fn new() -> Self {
        let memory = std::fs::OpenOptions::new().read(true).write(true).open("/dev/mem").unwrap();
        // SAFETY: maps the page of the controller, which nothing else in this process touches.
        let page = unsafe {
            libc::mmap(std::ptr::null_mut(), 4096, libc::PROT_READ, libc::MAP_SHARED, memory.as_raw_fd(), 0x1f00_0000)
        };
        assert_ne!(page, libc::MAP_FAILED);
        Self(page as *const u32)
    }

    /// The output level of line 5, "laser".
    fn high(&self) -> bool {
        // SAFETY: within the page that was mapped for good.
        unsafe { std::ptr::read_volatile(self.0.add(2)) >> 5 & 1 == 1 }
    }

    /// How long it takes from the beginning of a deed until the line is low.
    fn until_low(&self, deed: impl FnOnce()) -> Duration {
        let start = Instant::now();
        deed();
        while self.high() {
            assert!(start.elapsed() < Duration::from_secs(5), "the laser stays on");
            std::thread::yield_now();
        }
        start.elapsed()
    }
}

/// The processes with a name, oldest first.
fn processes(name: &str) -> Vec<i32> {
    let mut found: Vec<i32> = std::fs::read_dir("/proc")
        .unwrap()
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok())
        .filter(|pid: &i32| std::fs::read_to_string(format!("/proc/{pid}/comm")).is_ok_and(|comm| comm.trim() == name))
        .collect();
    found.sort_unstable();
    found
}

fn signal(name: &str, signal: i32) {
    let pids = processes(name);
    assert_eq!(pids.len(), 1, "{name}: {pids:?}");
    // SAFETY: a process of this test.
    assert_eq!(unsafe { libc::kill(pids[0], signal) }, 0);
}

/// What the library says of a laser that went off by itself just now.
fn noticed(laser: &mut dyn Laser) -> Error {
    let start = Instant::now();
    loop {
        match laser.check() {
            Ok(()) => assert!(start.elapsed() < SOON, "it is not noticed"),
            Err(error) => return error,
        }
    }
}

/// Nothing of a guard is left once its host is gone.
fn no_guards() {
    let start = Instant::now();
    while !processes(GUARD).is_empty() || !processes(KEEPER).is_empty() {
        assert!(start.elapsed() < Duration::from_secs(5), "a guard outlives its host");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
#[ignore = "in the machine"]
fn a_laser_is_found_by_each_form_of_its_address_and_switched() {
    let registers = Registers::new();
    for address in [
        ADDRESS,
        "gpio:///dev/gpiochip0/5",
        "gpio:///gpiochip0/laser",
        "gpio:///laser",
        "gpio:///laser?guard=off",
        "gpio:///dev/gpiochip0/laser?active=high&max_on=1&duty=0.5&window=5&guard=required",
    ] {
        let mut laser = open(address).unwrap();
        assert!(!registers.high());
        for on in [true, false, false, true, true] {
            laser.set(on).unwrap();
            assert_eq!(registers.high(), on, "{address}");
            laser.check().unwrap();
        }
        drop(laser);
        assert!(!registers.high(), "{address}");
        no_guards();
    }
    // The line is free again at once.
    for _ in 0..5 {
        open(ADDRESS).unwrap().set(true).unwrap();
        assert!(!registers.high());
    }
    let mut laser = open(ADDRESS).unwrap();
    let start = Instant::now();
    for k in 0..200 {
        laser.set(k % 2 == 0).unwrap();
    }
    println!("switching through the guard, in the machine: {:?} each", start.elapsed() / 200);
    drop(laser);
    // Active low: high is off.
    let mut laser = open("gpio:///laser?active=low").unwrap();
    assert!(registers.high());
    laser.set(true).unwrap();
    assert!(!registers.high());
    drop(laser);
    assert!(registers.high());
    drop(open(ADDRESS).unwrap());
    assert!(!registers.high());
}

#[test]
#[ignore = "in the machine"]
fn what_cannot_be_opened_says_why() {
    let error = |address: &str| open(address).map(|_| ()).unwrap_err();
    let missing = error("gpio:///dev/gpiochip0/lazer");
    assert!(matches!(missing, Error::DeviceNotFound { .. }));
    assert!(missing.to_string().contains("laser, interlock"), "{missing}");
    assert!(matches!(error("gpio:///dev/gpiochip0/24"), Error::DeviceNotFound { .. }));
    assert!(matches!(error("gpio:///dev/gpiochip7/laser"), Error::DeviceNotFound { .. }));
    assert!(matches!(error("gpio:///no-such-label/laser"), Error::DeviceNotFound { .. }));
    assert!(matches!(error("gpio:///dev/null/laser"), Error::DeviceMismatch { .. }));

    for guard in ["required", "off"] {
        let address = format!("{ADDRESS}?guard={guard}");
        let held = gpiocdev::Request::builder()
            .on_chip("/dev/gpiochip0")
            .with_consumer("somebody else")
            .with_line(5)
            .as_output(gpiocdev::line::Value::Inactive)
            .request()
            .unwrap();
        let busy = error(&address);
        assert!(matches!(&busy, Error::DeviceBusy { .. }) && busy.to_string().contains("somebody else"), "{busy}");
        drop(held);
        let laser = open(&address).unwrap();
        assert!(matches!(error(&address), Error::DeviceBusy { .. }));
        drop(laser);

        let mut nobody = Host::start_with("hang", &address, |command| {
            command.uid(65534);
        });
        let refused = nobody.wait_for("error");
        assert!(refused.contains("DevicePermission"), "{refused}");

        let mut lone = Host::start_with("watch", &address, |command| {
            command.env("PTZCAL_LASER_GUARD", "/no/such/guard");
        });
        if guard == "required" {
            let refused = lone.wait_for("error");
            assert!(refused.contains("LaserRefused") && refused.contains("/no/such/guard"), "{refused}");
        } else {
            lone.wait_for("on");
            // A host without a guard that is killed: this driver keeps the level, so it is mended here.
            drop(lone);
            drop(open(ADDRESS).unwrap());
        }
    }
}

#[test]
#[ignore = "in the machine"]
fn a_host_killed_at_any_moment_leaves_the_laser_off() {
    let registers = Registers::new();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut lit, mut worst) = (0, Duration::ZERO);
    for _ in 0..40 {
        let mut host = Host::start("toggle", ADDRESS);
        host.wait_for("open");
        std::thread::sleep(Duration::from_micros(u64::from(random.next_u32() % 150_000)));
        lit += usize::from(registers.high());
        let time = registers.until_low(|| host.signal(libc::SIGKILL));
        worst = worst.max(time);
        assert!(time < SOON, "{time:?}");
        drop(host);
        no_guards();
        assert!(!registers.high());
    }
    println!("killed hosts: lit at {lit} of 40 kills, low after {worst:?} at the latest");
    assert!(lit >= 20);
    // A copy of the host that lives on, holding the guard's socket.
    let mut host = Host::start("fork", ADDRESS);
    host.wait_for("on");
    assert!(registers.high());
    let time = registers.until_low(|| host.signal(libc::SIGKILL));
    println!("killed host with a living copy: low after {time:?}");
    assert!(time < SOON, "{time:?}");
    drop(host);
    no_guards();
}

#[test]
#[ignore = "in the machine"]
fn a_host_that_is_stopped_or_hangs_does_not_leave_the_laser_on() {
    let registers = Registers::new();
    let mut worst = Duration::ZERO;
    for _ in 0..5 {
        let mut host = Host::start("watch", ADDRESS);
        host.wait_for("on");
        assert!(registers.high());
        let time = registers.until_low(|| host.signal(libc::SIGSTOP));
        worst = worst.max(time);
        assert!(time < SOON, "{time:?}");
        // It hears of it when it goes on.
        host.signal(libc::SIGCONT);
        let error = host.wait_for("error");
        assert!(error.contains("LaserRefused") && error.contains("stands still"), "{error}");
    }
    println!("stopped hosts: low after {worst:?} at the latest");
    let mut host = Host::start("hang", &format!("{ADDRESS}?max_on=0.5"));
    host.wait_for("on");
    let time = registers.until_low(|| ());
    println!("hanging host, longest time on 500 ms: low after {time:?}");
    assert!(time > Duration::from_millis(300) && time < Duration::from_millis(500) + SOON, "{time:?}");
    drop(host);
    no_guards();
}

#[test]
#[ignore = "in the machine"]
fn a_guard_that_is_killed_or_stopped_is_replaced() {
    let registers = Registers::new();
    let mut worst = Duration::ZERO;
    for deed in [libc::SIGKILL, libc::SIGSTOP, libc::SIGSEGV] {
        let mut laser = open(ADDRESS).unwrap();
        laser.set(true).unwrap();
        assert!(registers.high());
        if deed == libc::SIGSEGV {
            // Blocked with all others, it is one of those that only switch off.
            assert!(registers.until_low(|| signal(GUARD, deed)) < SOON);
            assert!(matches!(laser.set(true), Err(Error::LaserRefused { .. })));
            continue;
        }
        // Nobody calls the library: the keeper takes the line.
        let time = registers.until_low(|| signal(GUARD, deed));
        worst = worst.max(time);
        assert!(time < SOON, "{time:?}");
        let error = noticed(&mut *laser);
        assert!(matches!(error, Error::DeviceLost { .. }) && error.to_string().contains("laser is off"), "{error}");
        // Held low by the library meanwhile, and refused until a new guard is started.
        assert!(matches!(open(ADDRESS).map(|_| ()), Err(Error::DeviceBusy { .. })));
        laser.set(false).unwrap();
        assert!(matches!(laser.set(true), Err(Error::DeviceLost { .. })));
        assert!(!registers.high());
        std::thread::sleep(Duration::from_millis(1050));
        laser.set(true).unwrap();
        assert!(registers.high());
        drop(laser);
        no_guards();
        assert!(!registers.high());
    }
    println!("killed and stopped guards: low after {worst:?} at the latest");
}

#[test]
#[ignore = "in the machine"]
fn a_keeper_is_not_needed_for_service_and_the_library_mends_the_loss_of_both() {
    let registers = Registers::new();
    let mut laser = open(ADDRESS).unwrap();
    laser.set(true).unwrap();
    signal(KEEPER, libc::SIGKILL);
    laser.set(false).unwrap();
    laser.set(true).unwrap();
    laser.check().unwrap();
    assert!(registers.high());
    // Now the kernel alone decides, and this one's driver keeps the level.
    signal(GUARD, libc::SIGKILL);
    std::thread::sleep(SOON);
    println!("both killed: the kernel leaves the line {}", if registers.high() { "HIGH" } else { "low" });
    let error = laser.check().unwrap_err();
    assert!(matches!(error, Error::DeviceLost { .. }), "{error}");
    assert!(!registers.high());
}

#[test]
#[ignore = "in the machine"]
fn signals_to_the_guard_switch_off_and_leave_it_in_charge() {
    let registers = Registers::new();
    for number in [libc::SIGTERM, libc::SIGINT, libc::SIGHUP, libc::SIGUSR1, libc::SIGALRM] {
        let mut laser = open(ADDRESS).unwrap();
        laser.set(true).unwrap();
        assert!(registers.until_low(|| signal(GUARD, number)) < SOON);
        let error = noticed(&mut *laser);
        assert!(matches!(&error, Error::LaserRefused { reason } if reason.contains("signal")), "{error}");
        laser.set(false).unwrap();
        assert!(matches!(laser.set(true), Err(Error::LaserRefused { .. })));
        assert!(!registers.high());
    }
    no_guards();
}

#[test]
#[ignore = "in the machine"]
fn the_share_of_time_is_kept_by_the_guard() {
    let registers = Registers::new();
    let mut laser = open(&format!("{ADDRESS}?max_on=5&duty=0.2&window=2")).unwrap();
    laser.set(true).unwrap();
    let time = registers.until_low(|| ());
    assert!(time > Duration::from_millis(250) && time < Duration::from_millis(400) + SOON, "{time:?}");
    assert!(matches!(noticed(&mut *laser), Error::LaserRefused { .. }));
    let error = laser.set(true).unwrap_err();
    assert!(error.to_string().contains("wait"), "{error}");
    std::thread::sleep(Duration::from_millis(1750));
    laser.set(true).unwrap();
    assert!(registers.high());
}

/// Last by name: the chip goes and comes back with another number.
#[test]
#[ignore = "in the machine"]
fn when_the_chip_is_unplugged_that_is_reported_and_plugging_it_in_again_mends_it() {
    let registers = Registers::new();
    let drivers = "/sys/bus/platform/drivers";
    let (driver, device) = std::fs::read_dir(drivers)
        .unwrap()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .find_map(|driver| {
            let device = std::fs::read_dir(&driver).ok()?.filter_map(|e| e.ok()?.file_name().into_string().ok());
            device.into_iter().find(|name| name.starts_with("AMDIF031")).map(|device| (driver.clone(), device))
        })
        .expect("the chip's driver");
    let mut laser = open("gpio:///laser").unwrap();
    laser.set(true).unwrap();
    laser.set(false).unwrap();
    std::fs::write(driver.join("unbind"), &device).unwrap();
    let error = laser.set(true).unwrap_err();
    assert!(matches!(error, Error::DeviceLost { .. }), "{error}");
    assert!(!registers.high());
    std::thread::sleep(Duration::from_millis(1050));
    let error = laser.set(true).unwrap_err();
    assert!(matches!(error, Error::DeviceNotFound { .. } | Error::DeviceLost { .. }), "{error}");
    no_guards();
    std::fs::write(driver.join("bind"), &device).unwrap();
    std::thread::sleep(Duration::from_millis(1050));
    laser.set(true).unwrap();
    assert!(registers.high());
    drop(laser);
    assert!(!registers.high());
}
