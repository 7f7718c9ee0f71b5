//! Finding things in images: the laser's spot.

pub mod spot;
