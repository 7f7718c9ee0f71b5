//! The ring of buffers that the kernel fills with frames.
#![allow(unsafe_code)]

use std::io;
use std::sync::Arc;
use std::time::Duration;

use v4l::v4l_sys::{v4l2_buffer, v4l2_requestbuffers};
use v4l::v4l2::vidioc;

use super::node::{CAPTURE, Node, zeroed};

/// V4L2_MEMORY_MMAP.
const MEMORY_MAPPED: u32 = 1;
/// V4L2_BUF_FLAG_*.
const FLAG_ERROR: u32 = 0x40;
const FLAG_CLOCK: u32 = 0xe000;
const FLAG_CLOCK_MONOTONIC: u32 = 0x2000;
const FLAG_SOURCE: u32 = 0x7_0000;
const FLAG_START_OF_EXPOSURE: u32 = 0x1_0000;

/// The buffers of a device that streams.
pub struct Ring {
    node: Arc<Node>,
    maps: Vec<Map>,
}

/// When a frame was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stamp {
    /// Start of exposure, seconds of CLOCK_MONOTONIC.
    Exposure(f64),
    /// The frame was all there, seconds of CLOCK_MONOTONIC.
    Complete(f64),
    Unknown,
}

/// A buffer that the kernel handed over. It has to be given back.
#[must_use]
pub struct Taken {
    index: u32,
    used: usize,
    /// The driver says that the frame is damaged.
    pub damaged: bool,
    pub stamp: Stamp,
}

impl Ring {
    /// Starts streaming into so many buffers, or as many as the driver wants.
    pub fn start(node: &Arc<Node>, buffers: u32) -> io::Result<Self> {
        let mut request: v4l2_requestbuffers = zeroed();
        (request.count, request.type_, request.memory) = (buffers, CAPTURE, MEMORY_MAPPED);
        node.call(vidioc::VIDIOC_REQBUFS, &mut request)?;
        let mut ring = Self { node: node.clone(), maps: Vec::new() };
        for index in 0..request.count {
            let mut buffer = description(index);
            node.call(vidioc::VIDIOC_QUERYBUF, &mut buffer)?;
            // SAFETY: the member of the union for mapped memory.
            let offset = unsafe { buffer.m.offset };
            ring.maps.push(Map::new(node, buffer.length as usize, offset)?);
            node.call(vidioc::VIDIOC_QBUF, &mut buffer)?;
        }
        if ring.maps.is_empty() {
            return Err(io::Error::from_raw_os_error(libc::ENOMEM));
        }
        let mut kind = CAPTURE as libc::c_int;
        node.call(vidioc::VIDIOC_STREAMON, &mut kind)?;
        Ok(ring)
    }

    pub fn len(&self) -> usize {
        self.maps.len()
    }

    /// Waits for a frame and takes it; `None` when none came in time.
    pub fn take(&mut self, timeout: Duration) -> io::Result<Option<Taken>> {
        let mut polled = libc::pollfd { fd: self.node.fd(), events: libc::POLLIN, revents: 0 };
        let milliseconds = i32::try_from(timeout.as_millis()).unwrap_or(i32::MAX);
        // SAFETY: one entry that lives as long as the call.
        match unsafe { libc::poll(&mut polled, 1, milliseconds) } {
            0 => return Ok(None),
            -1 => {
                let error = io::Error::last_os_error();
                return if error.kind() == io::ErrorKind::Interrupted { Ok(None) } else { Err(error) };
            }
            _ => {}
        }
        let mut buffer = description(0);
        match self.node.call(vidioc::VIDIOC_DQBUF, &mut buffer) {
            Ok(()) => {}
            // Readiness without a frame is an error that the next poll would only repeat at once.
            Err(e) if e.kind() == io::ErrorKind::WouldBlock && polled.revents & libc::POLLERR == 0 => return Ok(None),
            Err(e) if e.kind() == io::ErrorKind::WouldBlock => return Err(io::Error::from_raw_os_error(libc::EIO)),
            Err(e) => return Err(e),
        }
        if buffer.index as usize >= self.maps.len() {
            return Err(io::Error::from_raw_os_error(libc::EPROTO));
        }
        let time = buffer.timestamp.tv_sec as f64 + buffer.timestamp.tv_usec as f64 * 1e-6;
        let stamp = match (buffer.flags & FLAG_CLOCK, buffer.flags & FLAG_SOURCE) {
            (FLAG_CLOCK_MONOTONIC, FLAG_START_OF_EXPOSURE) => Stamp::Exposure(time),
            (FLAG_CLOCK_MONOTONIC, _) => Stamp::Complete(time),
            _ => Stamp::Unknown,
        };
        let damaged = buffer.flags & FLAG_ERROR != 0;
        Ok(Some(Taken { index: buffer.index, used: buffer.bytesused as usize, damaged, stamp }))
    }

    /// The frame's bytes, without what the buffer holds behind them.
    pub fn bytes(&self, taken: &Taken) -> &[u8] {
        let map = &self.maps[taken.index as usize];
        // SAFETY: the mapping is `length` bytes long and lives in `self`; the kernel does not write to
        // a buffer that it handed over, and `give_back` needs `self` for itself.
        unsafe { std::slice::from_raw_parts(map.start.cast(), taken.used.min(map.length)) }
    }

    pub fn give_back(&mut self, taken: Taken) -> io::Result<()> {
        self.node.call(vidioc::VIDIOC_QBUF, &mut description(taken.index))
    }
}

impl Drop for Ring {
    fn drop(&mut self) {
        // Of a device that is gone these fail, and there is nothing left to stop.
        let mut kind = CAPTURE as libc::c_int;
        let _ = self.node.call(vidioc::VIDIOC_STREAMOFF, &mut kind);
        self.maps.clear();
        let mut request: v4l2_requestbuffers = zeroed();
        (request.type_, request.memory) = (CAPTURE, MEMORY_MAPPED);
        let _ = self.node.call(vidioc::VIDIOC_REQBUFS, &mut request);
    }
}

fn description(index: u32) -> v4l2_buffer {
    let mut buffer: v4l2_buffer = zeroed();
    (buffer.index, buffer.type_, buffer.memory) = (index, CAPTURE, MEMORY_MAPPED);
    buffer
}

/// A buffer's memory.
struct Map {
    start: *mut libc::c_void,
    length: usize,
}

// SAFETY: memory of the process, not of a thread.
unsafe impl Send for Map {}

impl Map {
    fn new(node: &Node, length: usize, offset: u32) -> io::Result<Self> {
        let flags = libc::MAP_SHARED;
        // SAFETY: a new mapping wherever there is room.
        let start = unsafe {
            libc::mmap(std::ptr::null_mut(), length, libc::PROT_READ, flags, node.fd(), libc::off_t::from(offset))
        };
        if start == libc::MAP_FAILED { Err(io::Error::last_os_error()) } else { Ok(Self { start, length }) }
    }
}

impl Drop for Map {
    fn drop(&mut self) {
        // SAFETY: mapped by `new` with this length, and nothing borrows it any more.
        unsafe { libc::munmap(self.start, self.length) };
    }
}

/// Now, in seconds of the clock that frames are stamped with.
pub fn monotonic_now() -> f64 {
    // SAFETY: filled in by the call.
    let time = unsafe {
        let mut time: libc::timespec = std::mem::zeroed();
        libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut time);
        time
    };
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}
