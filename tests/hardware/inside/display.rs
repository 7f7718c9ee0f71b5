//! The other end of the virtual camera's cable: its output device, its switches, and a picture.

use std::fs::{File, OpenOptions};
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use v4l::control::{Control, MenuItem, Value};
use v4l::v4l_sys::*;
use v4l::v4l2::vidioc;
use v4l::{Device, Format, FourCC};

pub const CAMERA: &str = "/dev/video0";
const DISPLAY: &str = "/dev/video1";
/// The size of the HDMI link's frames.
pub const SIZE: (usize, usize) = (1280, 720);
/// V4L2_BUF_TYPE_VIDEO_OUTPUT, V4L2_MEMORY_MMAP.
const OUTPUT: u32 = 2;
const MAPPED: u32 = 1;

fn call<T>(file: &File, request: u64, argument: &mut T) -> std::io::Result<()> {
    // SAFETY: each request is called with its own structure.
    unsafe { v4l::v4l2::ioctl(file.as_raw_fd(), request as _, (&raw mut *argument).cast()) }
}

fn file(path: &str) -> File {
    OpenOptions::new().read(true).write(true).custom_flags(libc::O_NONBLOCK).open(path).unwrap()
}

/// Sets a control of the camera by its name.
pub fn control(name: &str, value: Value) -> bool {
    let camera = Device::with_path(CAMERA).unwrap();
    let controls = camera.query_controls().unwrap();
    match controls.iter().find(|c| c.name == name) {
        Some(found) => {
            camera.set_control(Control { id: found.id, value }).unwrap();
            true
        }
        None => false,
    }
}

/// Switches the camera to its webcam (0) or its HDMI input (3).
pub fn input(mut number: i32) {
    call(&file(CAMERA), vidioc::VIDIOC_S_INPUT, &mut number).unwrap();
}

/// Connects the output device to the camera's HDMI input: 1280x720, 24 frames a second, GREY.
pub fn connect() {
    let mut hdmi = 1i32;
    call(&file(DISPLAY), vidioc::VIDIOC_S_OUTPUT, &mut hdmi).unwrap();
    input(3);
    const S_DV_TIMINGS: u64 = 0xc084_5657;
    for path in [DISPLAY, CAMERA] {
        // CEA-861 1280x720p24.
        // SAFETY: numbers and a union of such.
        let mut timings: v4l2_dv_timings = unsafe { std::mem::zeroed() };
        timings.__bindgen_anon_1.bt = v4l2_bt_timings {
            width: 1280,
            height: 720,
            polarities: 3,
            pixelclock: 59_400_000,
            hfrontporch: 1760,
            hsync: 40,
            hbackporch: 220,
            vfrontporch: 5,
            vsync: 5,
            vbackporch: 20,
            // SAFETY: as above.
            ..unsafe { std::mem::zeroed() }
        };
        call(&file(path), S_DV_TIMINGS, &mut timings).unwrap();
    }
    let grey = Format::new(SIZE.0 as u32, SIZE.1 as u32, FourCC::new(b"GREY"));
    let output = Device::with_path(DISPLAY).unwrap();
    v4l::video::Output::set_format(&output, &grey).unwrap();
    let camera = Device::with_path(CAMERA).unwrap();
    v4l::video::Capture::set_format(&camera, &grey).unwrap();
    drop((output, camera));
    // A switch up to Linux 6.11, later a menu of each input.
    if !control("Loop Video", Value::Boolean(true)) {
        let camera = Device::with_path(CAMERA).unwrap();
        let controls = camera.query_controls().unwrap();
        let menu = controls.iter().find(|c| c.name.starts_with("HDMI") && c.name.contains("Connected To")).unwrap();
        let is_output = |item: &MenuItem| item.to_string().contains("Output HDMI");
        let (index, _) = menu.items.iter().flatten().find(|(_, item)| is_output(item)).unwrap();
        camera.set_control(Control { id: menu.id, value: Value::Integer(i64::from(*index)) }).unwrap();
    }
    control("OSD Text Mode", Value::Integer(2));
}

/// Shows a picture until it is dropped; the picture can be replaced.
pub struct Display {
    picture: Arc<Mutex<Arc<Vec<u8>>>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Display {
    pub fn new(picture: Vec<u8>) -> Self {
        let picture = Arc::new(Mutex::new(Arc::new(picture)));
        let stop = Arc::new(AtomicBool::new(false));
        let (shown, end) = (picture.clone(), stop.clone());
        let thread = std::thread::spawn(move || {
            let mut queue = Queue::new();
            while !end.load(Ordering::SeqCst) {
                let picture = shown.lock().unwrap().clone();
                queue.show(&picture);
            }
        });
        Self { picture, stop, thread: Some(thread) }
    }

    pub fn show(&self, picture: Vec<u8>) {
        *self.picture.lock().unwrap() = Arc::new(picture);
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        let _ = self.thread.take().unwrap().join();
    }
}

/// The output device's buffers.
struct Queue {
    file: File,
    maps: Vec<&'static mut [u8]>,
    free: Vec<u32>,
    streams: bool,
}

impl Queue {
    fn new() -> Self {
        let file = file(DISPLAY);
        // SAFETY: numbers and unions of such, throughout this function.
        let mut request: v4l2_requestbuffers = unsafe { std::mem::zeroed() };
        (request.count, request.type_, request.memory) = (3, OUTPUT, MAPPED);
        call(&file, vidioc::VIDIOC_REQBUFS, &mut request).unwrap();
        let maps = (0..request.count)
            .map(|index| {
                let mut buffer = description(index);
                call(&file, vidioc::VIDIOC_QUERYBUF, &mut buffer).unwrap();
                let (length, access) = (buffer.length as usize, libc::PROT_READ | libc::PROT_WRITE);
                // SAFETY: the device's memory, mapped for the rest of the process.
                unsafe {
                    let offset = i64::from(buffer.m.offset);
                    let fd = file.as_raw_fd();
                    let start = libc::mmap(std::ptr::null_mut(), length, access, libc::MAP_SHARED, fd, offset);
                    assert_ne!(start, libc::MAP_FAILED);
                    std::slice::from_raw_parts_mut(start.cast(), length)
                }
            })
            .collect();
        Self { file, maps, free: (0..request.count).collect(), streams: false }
    }

    fn show(&mut self, picture: &[u8]) {
        let mut buffer = description(0);
        match self.free.pop() {
            Some(index) => buffer.index = index,
            None => {
                let mut polled = libc::pollfd { fd: self.file.as_raw_fd(), events: libc::POLLOUT, revents: 0 };
                // SAFETY: one entry that lives as long as the call.
                unsafe { libc::poll(&mut polled, 1, 1000) };
                if call(&self.file, vidioc::VIDIOC_DQBUF, &mut buffer).is_err() {
                    return;
                }
            }
        }
        self.maps[buffer.index as usize][..picture.len()].copy_from_slice(picture);
        (buffer.bytesused, buffer.field) = (picture.len() as u32, 1);
        call(&self.file, vidioc::VIDIOC_QBUF, &mut buffer).unwrap();
        if !self.streams && self.free.is_empty() {
            let mut kind = OUTPUT;
            call(&self.file, vidioc::VIDIOC_STREAMON, &mut kind).unwrap();
            self.streams = true;
        }
    }
}

fn description(index: u32) -> v4l2_buffer {
    // SAFETY: numbers and unions of such.
    let mut buffer: v4l2_buffer = unsafe { std::mem::zeroed() };
    (buffer.index, buffer.type_, buffer.memory) = (index, OUTPUT, MAPPED);
    buffer
}
