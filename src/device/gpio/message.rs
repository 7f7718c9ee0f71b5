//! What the library and its guard process say to each other, over a stream socket.
//!
//! The library sends one byte a command, [`ON`] or [`OFF`], and the guard answers each. Unasked the
//! guard says that it is ready, that it is not, and that the laser went off by itself.

use std::io::{self, Read, Write};

use super::watch::Outcome;

pub const ON: u8 = b'1';
pub const OFF: u8 = b'0';
/// First argument of the guard: a library and a guard of different versions do not work together.
pub const VERSION: &str = "1";

/// What the guard says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Message {
    /// The line is held, inactive. With a remark for the log, or nothing.
    Ready(String),
    Outcome(Outcome),
}

impl Message {
    /// A tag, the text's length, the text: one write, which a socket takes whole.
    pub fn send(&self, to: &mut impl Write) -> io::Result<()> {
        let number;
        let (tag, text) = match self {
            Self::Ready(remark) => (b'R', remark.as_str()),
            Self::Outcome(Outcome::On) => (ON, ""),
            Self::Outcome(Outcome::Off) => (OFF, ""),
            Self::Outcome(Outcome::Refused(reason)) => (b'N', reason.as_str()),
            Self::Outcome(Outcome::WentOff(reason)) => (b'X', reason.as_str()),
            Self::Outcome(Outcome::Fault(errno)) => {
                number = errno.to_string();
                (b'E', number.as_str())
            }
        };
        let text = &text.as_bytes()[..text.len().min(255)];
        let mut bytes = vec![tag, text.len() as u8];
        bytes.extend_from_slice(text);
        to.write_all(&bytes)
    }

    /// # Errors
    /// `UnexpectedEof` when the guard is gone, `InvalidData` for bytes that are no message.
    pub fn receive(from: &mut impl Read) -> io::Result<Self> {
        let mut head = [0; 2];
        from.read_exact(&mut head)?;
        let mut text = vec![0; usize::from(head[1])];
        from.read_exact(&mut text)?;
        let text = String::from_utf8_lossy(&text).into_owned();
        Ok(match head[0] {
            b'R' => Self::Ready(text),
            ON => Self::Outcome(Outcome::On),
            OFF => Self::Outcome(Outcome::Off),
            b'N' => Self::Outcome(Outcome::Refused(text)),
            b'X' => Self::Outcome(Outcome::WentOff(text)),
            b'E' => Self::Outcome(Outcome::Fault(text.parse().map_err(io::Error::other)?)),
            tag => return Err(io::Error::new(io::ErrorKind::InvalidData, format!("message {tag:#04x} of the guard"))),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sent_is_received() {
        let outcomes = [
            Outcome::On,
            Outcome::Off,
            Outcome::Refused("wait".into()),
            Outcome::WentOff(String::new()),
            Outcome::Fault(libc::EBUSY),
        ];
        for message in outcomes
            .into_iter()
            .map(Message::Outcome)
            .chain([Message::Ready("no /proc".into()), Message::Ready("".into())])
        {
            let mut bytes = Vec::new();
            message.send(&mut bytes).unwrap();
            assert_eq!(Message::receive(&mut bytes.as_slice()).unwrap(), message);
            for cut in 0..bytes.len() {
                assert!(Message::receive(&mut &bytes[..cut]).is_err());
            }
        }
        // Cut to what a length byte holds, within a letter.
        let mut bytes = Vec::new();
        Message::Ready("é".repeat(200)).send(&mut bytes).unwrap();
        assert_eq!(bytes.len(), 257);
        assert!(matches!(Message::receive(&mut bytes.as_slice()), Ok(Message::Ready(_))));
        assert!(Message::receive(&mut &b"?\0"[..]).is_err());
        assert!(Message::receive(&mut &b"E\x01x"[..]).is_err());
    }

    #[test]
    fn fuzz_messages() {
        use rand_core::{Rng, SeedableRng};
        let inputs = crate::fuzz::fuzz_inputs();
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(8);
        let mut understood = 0;
        for _ in 0..inputs {
            let tags = b"R10NXE?";
            let mut bytes = [0u8; 40];
            random.fill_bytes(&mut bytes);
            bytes[0] = if bytes[0] < 250 { tags[usize::from(bytes[0]) % tags.len()] } else { bytes[0] };
            bytes[1] %= 48;
            let length = bytes[2] as usize % bytes.len();
            let mut rest = &bytes[..length];
            while !rest.is_empty() && Message::receive(&mut rest).is_ok() {
                understood += 1;
            }
        }
        assert!(understood > 0);
    }
}
