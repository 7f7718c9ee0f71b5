//! One error type for the whole crate. Each variant carries the offending value, knows its stable
//! [`Status`] (the C API's return code), and, where there is one, the index of the offending point,
//! view or sample and a hint that tells the user what to do.

/// Stable status codes. Pinned for ever: a code is never reused or renumbered (COMPATIBILITY.md).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(i32)]
#[non_exhaustive]
pub enum Status {
    Ok = 0,
    // Arguments.
    InvalidArgument = -1,
    NullPointer = -2,
    NotFinite = -3,
    BufferTooSmall = -4,
    Unsupported = -5,
    Busy = -6,
    BadState = -7,
    InvalidAddress = -8,
    // Data and geometry.
    TooFewPoints = -100,
    Degenerate = -101,
    NoConvergence = -102,
    NoConsensus = -103,
    LensNotMonotone = -104,
    BehindCamera = -105,
    Unreachable = -106,
    OutsideLens = -107,
    // Detection.
    NotFound = -200,
    Ambiguous = -201,
    // Devices.
    Device = -300,
    DeviceLost = -301,
    DeviceTimeout = -302,
    LaserRefused = -303,
    DeviceNotFound = -304,
    DevicePermission = -305,
    DeviceBusy = -306,
    DeviceMismatch = -307,
    DeviceGarbled = -308,
    DeviceRefused = -309,
    Unauthorised = -310,
    // Files.
    FileIo = -400,
    FileFormat = -401,
    FileVersion = -402,
    FileMismatch = -403,
    DiskFull = -404,
    // Control.
    Cancelled = -500,
    // Ours to mend.
    Internal = -900,
    Panic = -901,
}

/// Why a point set cannot determine what was asked of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Degeneracy {
    /// All points are (nearly) the same point.
    Coincident,
    /// All points lie on one line.
    Collinear,
    /// All points lie in one plane.
    Coplanar,
    /// Not a plane, but too little relief for the noise: focal length and distance trade off.
    NoRelief,
    /// The image points cover too little of the image, or coincide.
    ImageCollapsed,
    /// The edges (or planes) are parallel: a translation or rotation is unobservable.
    Parallel,
    /// All calibration boards are parallel to each other: focal length and distance trade off.
    ParallelBoards,
    /// All boards are at one distance: the laser's offset and slope trade off.
    OneDistance,
    /// The lines all meet in one point: they show its image and nothing of the depth behind it.
    Concurrent,
    /// Other near-singular geometry, such as points on a twisted cubic through the centre.
    IllConditioned,
}

impl Degeneracy {
    /// What the user can do about it.
    pub fn hint(self) -> &'static str {
        match self {
            Self::Coincident => "the points coincide: spread them over the scene",
            Self::Collinear => "the points lie on one line: add points off that line, in two other directions",
            Self::Coplanar => {
                "the points lie in one plane: add points in front of or behind it, at a tenth of the distance or more"
            }
            Self::NoRelief => {
                "the points have too little relief for their noise: add points at other depths, or fix the intrinsics"
            }
            Self::ImageCollapsed => "the image points cover too little of the image: spread them over the image",
            Self::ParallelBoards => "the boards are parallel: add views tilted by 20 to 40 degrees, each another way",
            Self::OneDistance => {
                "the boards are at one distance: add views nearer and farther, over all depths of the work"
            }
            Self::Parallel => "the edges or planes are (nearly) parallel: add one in another direction",
            Self::Concurrent => "the lines all meet in one point: add lines that pass it by, or two points",
            Self::IllConditioned => "the geometry is nearly singular: add points at other depths and directions",
        }
    }
}

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error("{name}: {reason}")]
    InvalidArgument { name: &'static str, reason: String },
    #[error("{name} is NULL")]
    NullPointer { name: &'static str },
    #[error("{name}[{index}] is NaN or infinite")]
    NotFinite { name: &'static str, index: usize },
    #[error("the buffer holds {capacity}, {needed} are needed")]
    BufferTooSmall { needed: usize, capacity: usize },
    #[error("not supported: {what}")]
    Unsupported { what: String },
    #[error("{what} is in use by another call")]
    Busy { what: &'static str },
    #[error("{reason}")]
    BadState { reason: String },
    #[error("address {address:?}: {reason}")]
    InvalidAddress { address: String, reason: String },

    #[error("{given} usable points, at least {needed} are needed")]
    TooFewPoints { given: usize, needed: usize },
    #[error("{given} usable spots of the laser on boards, at least {needed} are needed")]
    TooFewSpots { given: usize, needed: usize },
    #[error("the images have too little in common: {detail}, {needed} are needed")]
    TooFewMatches { needed: usize, detail: String },
    #[error("degenerate geometry ({kind:?}): {detail}")]
    Degenerate { kind: Degeneracy, detail: String },
    #[error("no convergence after {iterations} iterations: {detail}")]
    NoConvergence { iterations: usize, detail: String },
    #[error("no consensus: only {inliers} of {total} points agree with the best model")]
    NoConsensus { inliers: usize, total: usize },
    #[error("the fitted lens folds back inside the image, at {radius_px:.1} px from the principal point")]
    LensNotMonotone { radius_px: f64 },
    #[error("point {index} is behind the camera")]
    BehindCamera { index: usize },
    #[error("out of reach: {reason}")]
    Unreachable { reason: String },
    #[error("point {index} is outside what the lens model covers")]
    OutsideLens { index: usize },
    /// One of several cameras failed.
    #[error("camera {index}: {source}")]
    Camera { index: usize, source: Box<Error> },

    /// One of several regions of measurements failed.
    #[error("region {index}: {source}")]
    Region { index: usize, source: Box<Error> },

    #[error("not found: {reason}")]
    NotFound { reason: String },
    #[error("no plane in {measurements} measurements")]
    NoPlanes { measurements: usize },
    /// Two stations' planes do not match.
    #[error("the stations share too few planes: {reason}")]
    NoSharedPlanes { reason: String },
    /// Two stations' planes match in more than one way.
    #[error("the pose between the stations is ambiguous: {reason}")]
    AmbiguousStations { reason: String },
    #[error("ambiguous: {reason}")]
    Ambiguous { reason: String },
    #[error("no chessboard: {reason}")]
    NoChessboard { reason: String },
    #[error("more than one chessboard: {reason}")]
    ManyChessboards { reason: String },

    #[error("device: {reason}")]
    Device { reason: String },
    #[error("device lost: {reason}")]
    DeviceLost { reason: String },
    #[error("no answer from the {what} within {seconds} s")]
    DeviceTimeout { what: &'static str, seconds: f64 },
    #[error("the laser stays off: {reason}")]
    LaserRefused { reason: String },
    /// No such device file, host or line; or nobody listens there.
    #[error("{device}: {reason}")]
    DeviceNotFound { device: String, reason: String },
    #[error("{device}: permission denied")]
    DevicePermission { device: String },
    #[error("{device}: in use by another process")]
    DeviceBusy { device: String },
    /// Something answers, and it is not what the address says.
    #[error("{device}: {reason}")]
    DeviceMismatch { device: String, reason: String },
    /// Bytes arrive that are no messages.
    #[error("{device}: {reason}")]
    DeviceGarbled { device: String, reason: String },
    /// The device understood, and will not.
    #[error("the device refuses: {reason}")]
    DeviceRefused { reason: String },
    #[error("{device}: {reason}")]
    Unauthorised { device: String, reason: String },

    #[error("{path}: {reason}")]
    FileIo { path: String, reason: String },
    #[error("{path}: {reason}")]
    FileFormat { path: String, reason: String },
    #[error("{path}: version {found}, this library reads version {supported}")]
    FileVersion { path: String, found: u32, supported: u32 },
    #[error("{path}: {reason}")]
    FileMismatch { path: String, reason: String },

    #[error("{path}: the disk is full")]
    DiskFull { path: String },

    #[error("cancelled")]
    Cancelled,
    #[error("internal error: {reason}")]
    Internal { reason: String },
    #[error("a panic was caught: {reason}")]
    Panic { reason: String },
}

pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub fn invalid(name: &'static str, reason: impl Into<String>) -> Self {
        Self::InvalidArgument { name, reason: reason.into() }
    }

    pub fn degenerate(kind: Degeneracy, detail: impl Into<String>) -> Self {
        Self::Degenerate { kind, detail: detail.into() }
    }

    /// The fault of one camera among several.
    pub fn in_camera(index: usize, source: Self) -> Self {
        Self::Camera { index, source: Box::new(source) }
    }

    /// The fault of one region among several.
    pub fn in_region(index: usize, source: Self) -> Self {
        Self::Region { index, source: Box::new(source) }
    }

    pub fn status(&self) -> Status {
        match self {
            Self::Camera { source, .. } | Self::Region { source, .. } => source.status(),
            Self::InvalidArgument { .. } => Status::InvalidArgument,
            Self::NullPointer { .. } => Status::NullPointer,
            Self::NotFinite { .. } => Status::NotFinite,
            Self::BufferTooSmall { .. } => Status::BufferTooSmall,
            Self::Unsupported { .. } => Status::Unsupported,
            Self::Busy { .. } => Status::Busy,
            Self::BadState { .. } => Status::BadState,
            Self::InvalidAddress { .. } => Status::InvalidAddress,
            Self::TooFewPoints { .. } | Self::TooFewSpots { .. } | Self::TooFewMatches { .. } => Status::TooFewPoints,
            Self::Degenerate { .. } => Status::Degenerate,
            Self::NoConvergence { .. } => Status::NoConvergence,
            Self::NoConsensus { .. } => Status::NoConsensus,
            Self::LensNotMonotone { .. } => Status::LensNotMonotone,
            Self::BehindCamera { .. } => Status::BehindCamera,
            Self::Unreachable { .. } => Status::Unreachable,
            Self::OutsideLens { .. } => Status::OutsideLens,
            Self::NotFound { .. } | Self::NoChessboard { .. } | Self::NoPlanes { .. } | Self::NoSharedPlanes { .. } => {
                Status::NotFound
            }
            Self::Ambiguous { .. } | Self::ManyChessboards { .. } | Self::AmbiguousStations { .. } => Status::Ambiguous,
            Self::Device { .. } => Status::Device,
            Self::DeviceLost { .. } => Status::DeviceLost,
            Self::DeviceTimeout { .. } => Status::DeviceTimeout,
            Self::LaserRefused { .. } => Status::LaserRefused,
            Self::DeviceNotFound { .. } => Status::DeviceNotFound,
            Self::DevicePermission { .. } => Status::DevicePermission,
            Self::DeviceBusy { .. } => Status::DeviceBusy,
            Self::DeviceMismatch { .. } => Status::DeviceMismatch,
            Self::DeviceGarbled { .. } => Status::DeviceGarbled,
            Self::DeviceRefused { .. } => Status::DeviceRefused,
            Self::Unauthorised { .. } => Status::Unauthorised,
            Self::DiskFull { .. } => Status::DiskFull,
            Self::FileIo { .. } => Status::FileIo,
            Self::FileFormat { .. } => Status::FileFormat,
            Self::FileVersion { .. } => Status::FileVersion,
            Self::FileMismatch { .. } => Status::FileMismatch,
            Self::Cancelled => Status::Cancelled,
            Self::Internal { .. } => Status::Internal,
            Self::Panic { .. } => Status::Panic,
        }
    }

    /// Which point, view or sample is at fault, where one is.
    pub fn index(&self) -> Option<usize> {
        match self {
            Self::NotFinite { index, .. }
            | Self::BehindCamera { index }
            | Self::OutsideLens { index }
            | Self::Camera { index, .. }
            | Self::Region { index, .. } => Some(*index),
            _ => None,
        }
    }

    /// What the user can do about it, where there is something to say.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            Self::Camera { source, .. } | Self::Region { source, .. } => source.hint(),
            Self::Degenerate { kind, .. } => Some(kind.hint()),
            Self::TooFewPoints { .. } => Some("add points spread over the image and over depth"),
            Self::TooFewSpots { .. } => Some("add pictures with the laser on, its spot on the board, near and far"),
            Self::TooFewMatches { .. } => Some(
                "both cameras must see the same textured things, from not too different places; add auxiliary views",
            ),
            Self::NoConvergence { .. } => {
                Some("check the units (metres, pixels) and that 2D and 3D points are paired in the same order")
            }
            Self::NoConsensus { .. } => Some(
                "more than half of the points disagree: check the pairing of 2D and 3D points, or raise the threshold",
            ),
            Self::LensNotMonotone { .. } => {
                Some("add points towards the image's corners, or use a distortion model with fewer coefficients")
            }
            Self::BufferTooSmall { .. } => Some("call again with a buffer of the needed size"),
            Self::Busy { .. } => Some("wait for the other call, or use a handle of your own for each thread"),
            Self::NotFound { .. } => Some("check exposure, the laser's power and the region of interest"),
            Self::Ambiguous { .. } => Some("give an off frame, a region of interest or the epipolar line"),
            Self::NoPlanes { .. } => {
                Some("measure larger flat surfaces more densely, or state the measurements' noise")
            }
            Self::NoSharedPlanes { .. } => {
                Some("both stations must see the same three walls, floors or faces in different directions")
            }
            Self::AmbiguousStations { .. } => {
                Some("give a rough pose as prior, or measure what makes the room differ from itself turned")
            }
            Self::NoChessboard { .. } => {
                Some("check the number of inner corners, focus and light; all four sides of the board must be in view")
            }
            Self::ManyChessboards { .. } => Some("cover all boards but one"),
            Self::DeviceLost { .. } => {
                Some("check cable and power, then open the rig again; a journalled scan resumes")
            }
            Self::DeviceTimeout { .. } => {
                Some("check its power and cable; on serial lines also number and baud rate in its address")
            }
            Self::LaserRefused { .. } => Some("release the emergency stop and make sure that the head stands still"),
            Self::InvalidAddress { .. } => Some("docs/addresses.md lists the forms, each with an example"),
            Self::DeviceNotFound { .. } => {
                Some("check the name, cable and power; for serial ports use the name under /dev/serial/by-id")
            }
            Self::DevicePermission { .. } => {
                Some("let the user into the device's group (dialout, video or gpio), then log in again")
            }
            Self::DeviceBusy { .. } => Some("end the other program that holds it: `fuser -v` names it"),
            Self::DeviceMismatch { .. } => {
                Some("correct the kind of device or the model in the address; probe says what it is")
            }
            Self::DeviceGarbled { .. } => Some("set the device's baud rate in the address (baud=9600, baud=38400)"),
            Self::DeviceRefused { .. } => Some("wait for the end of its move or set-up, or stop it first"),
            Self::Unauthorised { .. } => Some("give the user's name and password, and check the device's clock"),
            Self::DiskFull { .. } => Some("make room on the disk and call again: a journalled scan resumes"),
            Self::FileVersion { .. } | Self::FileMismatch { .. } => Some("use another path, or remove the old file"),
            _ => None,
        }
    }
}
