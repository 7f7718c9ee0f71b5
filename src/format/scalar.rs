//! Numbers in binary files.

use super::file::Source;
use crate::error::Result;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number at the start of `bytes`, which hold it whole; `big`: most significant byte first.
    #[inline]
    pub fn read(self, bytes: &[u8], big: bool) -> f64 {
        #[inline]
        fn first<const N: usize>(bytes: &[u8], big: bool) -> [u8; N] {
            let mut b = std::array::from_fn(|i| bytes[i]);
            if big {
                b.reverse();
            }
            b
        }
        match self {
            Self::I8 => i8::from_le_bytes(first(bytes, big)).into(),
            Self::U8 => bytes[0].into(),
            Self::I16 => i16::from_le_bytes(first(bytes, big)).into(),
            Self::U16 => u16::from_le_bytes(first(bytes, big)).into(),
            Self::I32 => i32::from_le_bytes(first(bytes, big)).into(),
            Self::U32 => u32::from_le_bytes(first(bytes, big)).into(),
            Self::I64 => i64::from_le_bytes(first(bytes, big)) as f64,
            Self::U64 => u64::from_le_bytes(first(bytes, big)) as f64,
            Self::F32 => f32::from_le_bytes(first(bytes, big)).into(),
            Self::F64 => f64::from_le_bytes(first(bytes, big)),
        }
    }
}

/// How the numbers of a body are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

impl Encoding {
    /// Bytes that a number takes at least.
    pub fn least_size(self, scalar: Scalar) -> usize {
        // A digit and what parts it from the next.
        if self == Self::Text { 2 } else { scalar.size() }
    }

    /// The next number.
    pub fn next(self, scalar: Scalar, source: &mut Source<'_>) -> Result<f64> {
        if self == Self::Text {
            let word = source.word()?.ok_or_else(|| source.wrong("cut short"))?;
            let number = std::str::from_utf8(&word).ok().and_then(|w| match scalar {
                // The float that was written.
                Scalar::F32 => w.parse::<f32>().ok().map(f64::from),
                _ => w.parse().ok(),
            });
            return number.ok_or_else(|| {
                source.wrong(format!("'{}' is no number", String::from_utf8_lossy(&word).escape_debug()))
            });
        }
        let mut bytes = [0; 8];
        let bytes = &mut bytes[..scalar.size()];
        source.read(bytes)?;
        Ok(scalar.read(bytes, self == Self::BigEndian))
    }
}
