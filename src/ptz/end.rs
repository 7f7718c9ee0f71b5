//! How moves end.

use crate::device::PtzPosition;
use crate::error::Error;

#[derive(Debug, Clone, PartialEq)]
pub enum MoveEnd {
    /// The head stands where it was sent.
    Arrived,
    /// It stands elsewhere: at a limit, blocked, or the device gave up.
    Missed,
    /// It was stopped.
    Stopped,
    /// A drive was not renewed in time, and stopped.
    DeadMan,
    /// A later move took its place.
    Replaced,
    /// The device tells neither its position nor whether it moves.
    Unknown,
    /// The device failed.
    Failed(Error),
}

/// The end of a move.
#[derive(Debug, Clone, PartialEq)]
pub struct MoveEvent {
    /// The move, as numbered by the call that started it.
    pub number: u64,
    pub end: MoveEnd,
    /// Where the head stands, where that is known.
    pub position: Option<PtzPosition>,
}
