//! The journal of a scan: a file to which each shot is appended before it is acknowledged, so that
//! a killed scan resumes without losing one.
//!
//! All numbers are little-endian. Header (44 bytes): magic, version u32, number of fixed cameras
//! u32, fingerprints u64 of region, rig model and options, CRC-32 of what precedes. Then records,
//! which have one size in a file: index u32, pan tilt zoom time f64, colour 3 bytes, 0, a sighting
//! for the head and for each fixed camera, CRC-32. A sighting (64 bytes): 0 for a spot or the code
//! of the [`Miss`], saturated, 2 zero bytes, area u32, and x y cxx cxy cyy peak signal-to-noise f64.

use std::fs::{self, File, OpenOptions};
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::shot::{Miss, Shot, Sighting};
use crate::detect::spot::Spot;
use crate::error::{Error, Result};
use crate::format::io_error;

const MAGIC: &[u8; 8] = b"PTZCALJ\n";
const VERSION: u32 = 1;
const HEADER_SIZE: usize = 44;
const SIGHTING_SIZE: usize = 64;

/// What a journal belongs to. Resuming needs the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Identity {
    pub fixed_cameras: u32,
    pub region: u64,
    pub model: u64,
    pub options: u64,
}

/// What was mended in a journal that was cut off or damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JournalRepair {
    /// Whole shots that were kept.
    pub kept: usize,
    /// Records that are damaged; their positions are measured again.
    pub damaged: usize,
    /// Bytes of an unfinished record, cut off the end.
    pub cut_bytes: u64,
}

pub(super) struct Journal {
    path: PathBuf,
    file: File,
    /// Bytes of the file that are whole records.
    end: u64,
    sync: bool,
}

/// An opened journal with what was in it.
pub(super) struct Resumed {
    pub journal: Journal,
    /// Without their 3D points.
    pub shots: Vec<Shot>,
    pub repair: Option<JournalRepair>,
}

/// Two scans in one journal would tear each other's records. Held until the file is closed; a file
/// system without locks is let pass.
fn lock(file: &File) -> Result<()> {
    match file.try_lock() {
        Err(std::fs::TryLockError::WouldBlock) => Err(Error::Busy { what: "the journal" }),
        _ => Ok(()),
    }
}

impl Journal {
    /// Opens the journal at `path` for a scan of `positions` positions, or starts it. `sync`: wait
    /// for the disk at each shot.
    ///
    /// # Errors
    /// `FileIo`; `Busy` for a journal that another scan is writing; `FileFormat` for a file that is no
    /// journal (it is left alone); `FileVersion`; `FileMismatch` for the journal of another scan.
    pub fn open(path: &Path, identity: &Identity, positions: usize, sync: bool) -> Result<Resumed> {
        let io = |e: std::io::Error| io_error(path, &e);
        let journal = |file| Journal { path: path.to_owned(), file, end: 0, sync };
        match fs::metadata(path) {
            Err(e) if e.kind() == ErrorKind::NotFound => {
                let file = OpenOptions::new().read(true).write(true).create_new(true).open(path).map_err(io)?;
                lock(&file)?;
                let mut journal = journal(file);
                journal.write(&header(identity))?;
                sync_directory(path);
                return Ok(Resumed { journal, shots: Vec::new(), repair: None });
            }
            Err(e) => return Err(io(e)),
            Ok(metadata) if !metadata.is_file() => {
                return Err(Error::FileFormat {
                    path: path.display().to_string(),
                    reason: "not a regular file".into(),
                });
            }
            Ok(_) => {}
        }
        let file = OpenOptions::new().read(true).write(true).open(path).map_err(io)?;
        lock(&file)?;
        let mut journal = journal(file);
        let (shots, repair) = journal.read(identity, positions)?;
        Ok(Resumed { journal, shots, repair })
    }

    /// Appends a shot: when this returns, it is in the file (on the disk, with `sync`).
    pub fn append(&mut self, shot: &Shot) -> Result<()> {
        self.write(&encode(shot))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        let written = self.file.write_all(bytes).and_then(|()| if self.sync { self.file.sync_data() } else { Ok(()) });
        match written {
            Ok(()) => {
                self.end += bytes.len() as u64;
                Ok(())
            }
            Err(e) => {
                // Half a record would shift those after it; opening cuts it off if this cannot.
                let _ = self.file.set_len(self.end).and_then(|()| self.file.seek(SeekFrom::Start(self.end)));
                Err(self.io(&e))
            }
        }
    }

    fn io(&self, e: &std::io::Error) -> Error {
        io_error(&self.path, e)
    }

    /// Reads header and records, and cuts an unfinished record off.
    fn read(&mut self, identity: &Identity, positions: usize) -> Result<(Vec<Shot>, Option<JournalRepair>)> {
        match content(&mut BufReader::new(&self.file), &self.path, identity, positions)? {
            Content::Unstarted { cut_bytes } => {
                self.rewind_to(0)?;
                self.write(&header(identity))?;
                Ok((Vec::new(), (cut_bytes > 0).then_some(JournalRepair { kept: 0, damaged: 0, cut_bytes })))
            }
            Content::Shots { shots, damaged, cut_bytes, end } => {
                self.rewind_to(end)?;
                let kept = shots.len();
                let repair = (damaged > 0 || cut_bytes > 0).then_some(JournalRepair { kept, damaged, cut_bytes });
                Ok((shots, repair))
            }
        }
    }

    fn rewind_to(&mut self, end: u64) -> Result<()> {
        self.end = end;
        let done = self.file.set_len(end).and_then(|()| self.file.seek(SeekFrom::Start(end)));
        done.map(|_| ()).map_err(|e| self.io(&e))
    }
}

/// What a journal holds.
#[derive(Debug)]
enum Content {
    /// Killed while it was started: there is no shot to lose.
    Unstarted { cut_bytes: u64 },
    /// `end`: length of the header and whole records.
    Shots { shots: Vec<Shot>, damaged: usize, cut_bytes: u64, end: u64 },
}

fn content(reader: &mut impl Read, path: &Path, identity: &Identity, positions: usize) -> Result<Content> {
    let io = |e: std::io::Error| io_error(path, &e);
    let mut start = [0; HEADER_SIZE];
    let length = read_up_to(reader, &mut start).map_err(io)?;
    if length < HEADER_SIZE && header(identity).starts_with(&start[..length]) {
        return Ok(Content::Unstarted { cut_bytes: length as u64 });
    }
    check_header(&start[..length], path, identity)?;
    let (mut shots, mut seen) = (Vec::new(), vec![false; positions]);
    let (mut damaged, mut end) = (0, HEADER_SIZE as u64);
    let mut record = vec![0; record_size(identity.fixed_cameras as usize)];
    loop {
        let length = read_up_to(reader, &mut record).map_err(io)?;
        if length < record.len() {
            return Ok(Content::Shots { shots, damaged, cut_bytes: length as u64, end });
        }
        end += length as u64;
        match decode(&record).filter(|shot| (shot.index as usize) < positions) {
            // A position measured again after damage is in the file once.
            Some(shot) if !std::mem::replace(&mut seen[shot.index as usize], true) => shots.push(shot),
            _ => damaged += 1,
        }
    }
}

fn check_header(found: &[u8], path: &Path, identity: &Identity) -> Result<()> {
    let path = || path.display().to_string();
    let format = |reason: &str| Error::FileFormat { path: path(), reason: reason.into() };
    if !found.starts_with(MAGIC) || found.len() < HEADER_SIZE {
        return Err(format("not a scan journal"));
    }
    let mut fields = Fields(&found[MAGIC.len()..]);
    let (version, fixed_cameras) = (fields.u32(), fields.u32());
    if version != VERSION {
        return Err(Error::FileVersion { path: path(), found: version, supported: VERSION });
    }
    if crc32(&found[..HEADER_SIZE - 4]).to_le_bytes() != found[HEADER_SIZE - 4..] {
        return Err(format("the journal's header is damaged"));
    }
    let differs =
        |what: &str| Err(Error::FileMismatch { path: path(), reason: format!("the journal of another scan: {what}") });
    if fixed_cameras != identity.fixed_cameras {
        return differs(&format!("{fixed_cameras} fixed cameras instead of {}", identity.fixed_cameras));
    }
    let named = [("region", identity.region), ("rig model", identity.model), ("options or cameras", identity.options)];
    for (what, wanted) in named {
        if fields.u64() != wanted {
            return differs(&format!("its {what} differ"));
        }
    }
    Ok(())
}

fn header(identity: &Identity) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(identity.fixed_cameras.to_le_bytes());
    for fingerprint in [identity.region, identity.model, identity.options] {
        bytes.extend(fingerprint.to_le_bytes());
    }
    bytes.extend(crc32(&bytes).to_le_bytes());
    bytes
}

fn record_size(fixed_cameras: usize) -> usize {
    4 + 4 * 8 + 4 + SIGHTING_SIZE * (1 + fixed_cameras) + 4
}

fn encode(shot: &Shot) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(record_size(shot.fixed.len()));
    bytes.extend(shot.index.to_le_bytes());
    for value in [shot.pan, shot.tilt, shot.zoom, shot.time] {
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend(shot.colour);
    bytes.push(0);
    for sighting in std::iter::once(&shot.head).chain(&shot.fixed) {
        let (kind, spot) = match sighting {
            Ok(spot) => (0, *spot),
            Err(miss) => (*miss as u8, NO_SPOT),
        };
        bytes.extend([kind, u8::from(spot.saturated), 0, 0]);
        bytes.extend(spot.area.to_le_bytes());
        let [xx, xy, yy] = spot.covariance;
        for value in [spot.x, spot.y, xx, xy, yy, spot.peak, spot.signal_to_noise] {
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes.extend(crc32(&bytes).to_le_bytes());
    bytes
}

const NO_SPOT: Spot =
    Spot { x: 0.0, y: 0.0, covariance: [0.0; 3], peak: 0.0, signal_to_noise: 0.0, area: 0, saturated: false };

/// `None` for a record that is damaged.
fn decode(record: &[u8]) -> Option<Shot> {
    let (body, crc) = record.split_at(record.len() - 4);
    if crc32(body).to_le_bytes() != crc {
        return None;
    }
    let mut fields = Fields(body);
    let index = fields.u32();
    let [pan, tilt, zoom, time] = std::array::from_fn(|_| fields.f64());
    let [red, green, blue, _] = fields.take::<4>();
    let mut sightings = Vec::with_capacity(fields.0.len() / SIGHTING_SIZE);
    while !fields.0.is_empty() {
        sightings.push(decode_sighting(&mut fields)?);
    }
    let fixed = sightings.split_off(1);
    let shot =
        Shot { index, pan, tilt, zoom, time, head: sightings[0], fixed, colour: [red, green, blue], point: None };
    [pan, tilt, zoom, time].iter().all(|v| v.is_finite()).then_some(shot)
}

fn decode_sighting(fields: &mut Fields<'_>) -> Option<Sighting> {
    let [kind, saturated, _, _] = fields.take::<4>();
    let area = fields.u32();
    let values: [f64; 7] = std::array::from_fn(|_| fields.f64());
    let [x, y, xx, xy, yy, peak, signal_to_noise] = values;
    if kind != 0 {
        return Miss::from_code(kind).map(Err);
    }
    let spot = Spot { x, y, covariance: [xx, xy, yy], peak, signal_to_noise, area, saturated: saturated != 0 };
    values.iter().all(|v| v.is_finite()).then_some(Ok(spot))
}

/// Takes little-endian fields off the front. The sizes of headers and records are fixed, so that
/// the bytes are always there.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, tail) = self.0.split_first_chunk::<N>().expect("records have their full size");
        self.0 = tail;
        *head
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }
}

fn read_up_to(reader: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut length = 0;
    while length < buffer.len() {
        match reader.read(&mut buffer[length..]) {
            Ok(0) => break,
            Ok(n) => length += n,
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(length)
}

/// A new file survives a power cut only when its directory is on the disk too. Not every system can.
fn sync_directory(path: &Path) {
    if cfg!(unix) {
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let _ = File::open(parent).and_then(|directory| directory.sync_all());
    }
}

/// CRC-32 of IEEE 802.3 (reflected, polynomial 0xEDB88320), as in zip and PNG.
fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut i = 0;
        while i < 256 {
            let mut value = i as u32;
            let mut bit = 0;
            while bit < 8 {
                value = if value & 1 == 1 { value >> 1 ^ 0xEDB8_8320 } else { value >> 1 };
                bit += 1;
            }
            table[i] = value;
            i += 1;
        }
        table
    };
    !bytes.iter().fold(!0, |crc, byte| TABLE[((crc ^ u32::from(*byte)) & 0xFF) as usize] ^ crc >> 8)
}

/// FNV-1a over the numbers that a scan consists of.
pub(super) struct Fingerprint(u64);

impl Fingerprint {
    pub fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    pub fn integers(mut self, values: &[u64]) -> Self {
        for byte in values.iter().flat_map(|v| v.to_le_bytes()) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        self
    }

    pub fn numbers(mut self, values: &[f64]) -> Self {
        for value in values {
            // -0 and 0 are the same number.
            self = self.integers(&[(value + 0.0).to_bits()]);
        }
        self
    }

    pub fn finish(self) -> u64 {
        self.0
    }
}

#[cfg(test)]
#[path = "tests/journal.rs"]
mod tests;
