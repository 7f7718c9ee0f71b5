//! Holds the line of a laser for libptzcal, which starts it: see `device::gpio` of the library.

fn main() -> std::process::ExitCode {
    #[cfg(target_os = "linux")]
    return ptzcal::device::laser_guard_main(std::env::args_os().skip(1));
    #[cfg(not(target_os = "linux"))]
    std::process::ExitCode::from(2)
}
