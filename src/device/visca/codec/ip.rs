//! VISCA over IP: a header before each packet, in datagrams (Sony, SRG-300H command list).

/// The port that cameras listen on.
pub const PORT: u16 = 52381;
pub const HEADER: usize = 8;
/// Bytes of the longest message.
pub const MAX_MESSAGE: usize = HEADER + super::MAX_PACKET;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Command,
    Inquiry,
    Reply,
    DeviceSetting,
    Control,
    ControlReply,
}

/// One datagram, taken apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Message<'a> {
    pub kind: Kind,
    /// Of the request; replies repeat it.
    pub sequence: u32,
    /// A packet, or a [`Control`].
    pub payload: &'a [u8],
}

/// What is said about the numbering itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// Asks to count from 0 again; answered by the same byte.
    Reset,
    /// The sequence number is not the expected one (or not a new one).
    BadSequence,
    /// The kind of message is unknown.
    BadMessage,
}

impl Kind {
    pub const ALL: [Self; 6] =
        [Self::Command, Self::Inquiry, Self::Reply, Self::DeviceSetting, Self::Control, Self::ControlReply];

    fn code(self) -> [u8; 2] {
        match self {
            Self::Command => [0x01, 0x00],
            Self::Inquiry => [0x01, 0x10],
            Self::Reply => [0x01, 0x11],
            Self::DeviceSetting => [0x01, 0x20],
            Self::Control => [0x02, 0x00],
            Self::ControlReply => [0x02, 0x01],
        }
    }
}

impl<'a> Message<'a> {
    /// None when the bytes are no such message. Bytes after its end are ignored.
    pub fn decode(bytes: &'a [u8]) -> Option<Self> {
        let (header, rest) = bytes.split_first_chunk::<HEADER>()?;
        let &[k0, k1, l0, l1, s0, s1, s2, s3] = header;
        let kind = Kind::ALL.into_iter().find(|kind| kind.code() == [k0, k1])?;
        let length = usize::from(u16::from_be_bytes([l0, l1]));
        if !(1..=super::MAX_PACKET).contains(&length) {
            return None;
        }
        Some(Self { kind, sequence: u32::from_be_bytes([s0, s1, s2, s3]), payload: rest.get(..length)? })
    }

    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER + self.payload.len());
        bytes.extend(self.kind.code());
        bytes.extend((self.payload.len() as u16).to_be_bytes());
        bytes.extend(self.sequence.to_be_bytes());
        bytes.extend(self.payload);
        bytes
    }
}

impl Control {
    pub fn payload(self) -> &'static [u8] {
        match self {
            Self::Reset => &[0x01],
            Self::BadSequence => &[0x0f, 0x01],
            Self::BadMessage => &[0x0f, 0x02],
        }
    }

    pub fn from_payload(payload: &[u8]) -> Option<Self> {
        [Self::Reset, Self::BadSequence, Self::BadMessage].into_iter().find(|c| c.payload() == payload)
    }
}
