//! A capture device's file: what it offers, what it is set to.
//!
//! Crate v4l's structures and request codes; its safe wrappers are not used, because they panic on
//! values of newer kernels (colour spaces, kinds of control), leave the descriptor open to child
//! processes, and hand out whole mappings and damaged frames.
#![allow(unsafe_code)]

use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::{AsRawFd, RawFd};
use std::os::unix::fs::OpenOptionsExt;

use v4l::v4l_sys::*;
use v4l::v4l2::vidioc;

use super::picture::{Encoding, Layout};
use crate::device::device_error;
use crate::error::{Error, Result};

/// V4L2_BUF_TYPE_VIDEO_CAPTURE.
pub const CAPTURE: u32 = 1;
/// V4L2_CAP_*.
const CAN_CAPTURE: u32 = 0x1;
const CAN_CAPTURE_PLANES: u32 = 0x1000;
const CAN_STREAM: u32 = 0x0400_0000;
const HAS_DEVICE_CAPS: u32 = 0x8000_0000;
/// V4L2_FIELD_*: whole frames.
const FIELD_NONE: u32 = 1;
const WHOLE_FRAMES: [u32; 4] = [FIELD_NONE, 4, 8, 9];
/// Entries of a device's lists that are read.
const MAX_LISTED: u32 = 32;
/// A frame rate off by this share is another one.
const RATE_TOLERANCE: f64 = 0.005;

/// What is asked of a device; `None` leaves it as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    pub size: Option<(u32, u32)>,
    pub encoding: Option<Encoding>,
    /// Frames per second.
    pub rate: Option<f64>,
}

/// What a device is set to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    pub layout: Layout,
    /// Seconds from frame to frame, where the device says.
    pub interval: Option<f64>,
}

pub struct Node {
    file: File,
    path: String,
}

impl Node {
    /// # Errors
    /// `DeviceNotFound`, `DevicePermission`, `DeviceBusy`; `DeviceMismatch` for what is no camera.
    pub fn open(path: &str) -> Result<Self> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(libc::O_NONBLOCK)
            .open(path)
            .map_err(|e| device_error(path, &e))?;
        let node = Self { file, path: path.to_owned() };
        let mut caps: v4l2_capability = zeroed();
        node.call(vidioc::VIDIOC_QUERYCAP, &mut caps).map_err(|e| match e.raw_os_error() {
            Some(libc::ENOTTY | libc::EINVAL) => node.mismatch("it is no V4L2 device"),
            _ => node.error(&e),
        })?;
        let can = if caps.capabilities & HAS_DEVICE_CAPS != 0 { caps.device_caps } else { caps.capabilities };
        if can & CAN_CAPTURE == 0 {
            return Err(node.mismatch(if can & CAN_CAPTURE_PLANES != 0 {
                "it captures only in several planes, which is not supported"
            } else {
                "it is no camera: it does not capture"
            }));
        }
        if can & CAN_STREAM == 0 {
            return Err(node.mismatch("it does not stream into memory"));
        }
        Ok(node)
    }

    pub fn fd(&self) -> RawFd {
        self.file.as_raw_fd()
    }

    pub fn error(&self, error: &io::Error) -> Error {
        device_error(&self.path, error)
    }

    fn mismatch(&self, reason: impl Into<String>) -> Error {
        Error::DeviceMismatch { device: self.path.clone(), reason: reason.into() }
    }

    /// One request, again when a signal came in between. `T` is the request's own structure.
    pub fn call<T>(&self, request: vidioc::_IOC_TYPE, argument: &mut T) -> io::Result<()> {
        loop {
            // SAFETY: every request of this module is called with the structure that it is defined for
            // (the size is part of the code), alive and writable during the call.
            let done = unsafe { v4l::v4l2::ioctl(self.fd(), request as _, (&raw mut *argument).cast()) };
            match done {
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                done => return done,
            }
        }
    }

    /// Sets the device, and reads back what it made of it.
    ///
    /// # Errors
    /// `DeviceMismatch`, with what the device offers, when that is not what was asked; `DeviceBusy`.
    pub fn set(&self, wanted: &Wanted) -> Result<Mode> {
        let mut format: v4l2_format = zeroed();
        format.type_ = CAPTURE;
        self.call(vidioc::VIDIOC_G_FMT, &mut format).map_err(|e| self.error(&e))?;
        // SAFETY: the kernel filled in the pixel format of this type of buffer; any bytes make one.
        let pix = unsafe { &mut format.fmt.pix };
        let encoding = match wanted.encoding.or(Encoding::from_fourcc(pix.pixelformat)) {
            Some(encoding) => encoding,
            None => {
                let offered = self.formats();
                Encoding::ALL
                    .into_iter()
                    .find(|e| offered.contains(&u32::from_le_bytes(e.fourcc())))
                    .ok_or_else(|| self.mismatch(format!("none of its formats is supported: {}", self.offers())))?
            }
        };
        let (width, height) = wanted.size.unwrap_or((pix.width, pix.height));
        (pix.width, pix.height) = (width, height);
        pix.pixelformat = u32::from_le_bytes(encoding.fourcc());
        pix.field = FIELD_NONE;
        (pix.bytesperline, pix.sizeimage) = (0, 0);
        self.call(vidioc::VIDIOC_S_FMT, &mut format).map_err(|e| match e.raw_os_error() {
            Some(libc::EINVAL) => self.mismatch(format!("it does not take the format: {}", self.offers())),
            _ => self.error(&e),
        })?;
        // SAFETY: as above.
        let pix = unsafe { format.fmt.pix };
        if (pix.width, pix.height) != (width, height) || Encoding::from_fourcc(pix.pixelformat) != Some(encoding) {
            return Err(self.mismatch(format!(
                "asked for {width}x{height} {}, it gives {}x{} {}; it offers {}",
                name(u32::from_le_bytes(encoding.fourcc())),
                pix.width,
                pix.height,
                name(pix.pixelformat),
                self.offers()
            )));
        }
        if !WHOLE_FRAMES.contains(&pix.field) {
            return Err(self.mismatch(format!("it gives half frames (field order {})", pix.field)));
        }
        let layout = Layout { encoding, width, height, stride: pix.bytesperline };
        Ok(Mode { layout, interval: self.set_rate(wanted.rate, &layout)? })
    }

    /// Seconds from frame to frame.
    fn set_rate(&self, rate: Option<f64>, layout: &Layout) -> Result<Option<f64>> {
        let mut parameters: v4l2_streamparm = zeroed();
        parameters.type_ = CAPTURE;
        let mut done = self.call(vidioc::VIDIOC_G_PARM, &mut parameters);
        if let (Some(rate), Ok(())) = (rate, &done) {
            let time = v4l2_fract { numerator: 1000, denominator: (rate * 1000.0).round() as u32 };
            parameters.parm.capture.timeperframe = time;
            done = self.call(vidioc::VIDIOC_S_PARM, &mut parameters);
        }
        // SAFETY: the part for this type of buffer; any bytes make one.
        let time = unsafe { parameters.parm.capture.timeperframe };
        let interval = (done.is_ok() && time.numerator > 0 && time.denominator > 0)
            .then(|| f64::from(time.numerator) / f64::from(time.denominator));
        let Some(rate) = rate else { return Ok(interval) };
        match (done, interval) {
            (Err(e), _) if e.raw_os_error() == Some(libc::EBUSY) => Err(self.error(&e)),
            (Ok(()), Some(interval)) if (interval * rate - 1.0).abs() <= RATE_TOLERANCE => Ok(Some(interval)),
            (_, interval) => Err(self.mismatch(format!(
                "asked for {rate} frames a second, it gives {}; at this size it offers {}",
                interval.map_or("no rate".into(), |i| format!("{:.3}", 1.0 / i)),
                self.rates(layout)
            ))),
        }
    }

    /// Codes of the formats that it offers.
    fn formats(&self) -> Vec<u32> {
        (0..MAX_LISTED)
            .map_while(|index| {
                let mut entry: v4l2_fmtdesc = zeroed();
                (entry.index, entry.type_) = (index, CAPTURE);
                self.call(vidioc::VIDIOC_ENUM_FMT, &mut entry).ok().map(|()| entry.pixelformat)
            })
            .collect()
    }

    /// Formats and sizes, for people.
    pub fn offers(&self) -> String {
        let formats = self.formats();
        let (understood, others): (Vec<u32>, Vec<u32>) =
            formats.into_iter().partition(|&code| Encoding::from_fourcc(code).is_some());
        let mut offers: Vec<String> =
            understood.into_iter().map(|code| format!("{} {}", name(code), self.sizes(code))).collect();
        if !others.is_empty() {
            offers.push(format!("and unsupported {}", others.into_iter().map(name).collect::<Vec<_>>().join(" ")));
        }
        if offers.is_empty() { "nothing".into() } else { offers.join("; ") }
    }

    fn sizes(&self, code: u32) -> String {
        let mut sizes = Vec::new();
        for index in 0..MAX_LISTED {
            let mut entry: v4l2_frmsizeenum = zeroed();
            (entry.index, entry.pixel_format) = (index, code);
            if self.call(vidioc::VIDIOC_ENUM_FRAMESIZES, &mut entry).is_err() {
                break;
            }
            // SAFETY: the union's member is the one that the type names; any bytes make either.
            sizes.push(unsafe {
                if entry.type_ == v4l2_frmsizetypes_V4L2_FRMSIZE_TYPE_DISCRETE {
                    let s = entry.__bindgen_anon_1.discrete;
                    format!("{}x{}", s.width, s.height)
                } else {
                    let s = entry.__bindgen_anon_1.stepwise;
                    format!("{}x{} to {}x{}", s.min_width, s.min_height, s.max_width, s.max_height)
                }
            });
        }
        if sizes.is_empty() { "of unknown sizes".into() } else { sizes.join(", ") }
    }

    fn rates(&self, layout: &Layout) -> String {
        let mut rates = Vec::new();
        for index in 0..MAX_LISTED {
            let mut entry: v4l2_frmivalenum = zeroed();
            (entry.index, entry.pixel_format) = (index, u32::from_le_bytes(layout.encoding.fourcc()));
            (entry.width, entry.height) = (layout.width, layout.height);
            if self.call(vidioc::VIDIOC_ENUM_FRAMEINTERVALS, &mut entry).is_err() {
                break;
            }
            let rate = |time: v4l2_fract| f64::from(time.denominator) / f64::from(time.numerator.max(1));
            // SAFETY: as for the sizes.
            rates.push(unsafe {
                if entry.type_ == v4l2_frmivaltypes_V4L2_FRMIVAL_TYPE_DISCRETE {
                    format!("{:.3}", rate(entry.__bindgen_anon_1.discrete))
                } else {
                    let s = entry.__bindgen_anon_1.stepwise;
                    format!("{:.3} to {:.3}", rate(s.max), rate(s.min))
                }
            });
        }
        if rates.is_empty() { "no choice".into() } else { rates.join(", ") }
    }
}

/// A kernel structure to be filled in.
pub fn zeroed<T: KernelStructure>() -> T {
    // SAFETY: the trait is for structures of numbers and unions of such, for which zeros are a value.
    unsafe { std::mem::zeroed() }
}

/// A structure of numbers alone, of which every bit pattern is a value.
///
/// # Safety
/// Holds nothing but integers, arrays and unions of them, and raw pointers.
pub unsafe trait KernelStructure: Copy {}

macro_rules! kernel_structures {
    ($($name:ty),*) => { $(
        // SAFETY: the kernel's definition, taken over by bindgen.
        unsafe impl KernelStructure for $name {}
    )* };
}
kernel_structures!(
    v4l2_capability,
    v4l2_format,
    v4l2_streamparm,
    v4l2_fmtdesc,
    v4l2_frmsizeenum,
    v4l2_frmivalenum,
    v4l2_requestbuffers,
    v4l2_buffer
);

/// A four-character code as text.
fn name(code: u32) -> String {
    code.to_le_bytes().iter().map(|&b| if b.is_ascii_graphic() { char::from(b) } else { '.' }).collect()
}
