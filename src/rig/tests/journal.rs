//! Journals that are cut, damaged, foreign or unwritable.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::fuzz::{self, fuzz_inputs, mutated};
use crate::rig::fake::Random;

const IDENTITY: Identity = Identity { fixed_cameras: 2, region: 1, model: 2, options: 3 };
const POSITIONS: usize = 100;

/// A path of its own for each test, removed afterwards.
struct Scratch(PathBuf);

impl Scratch {
    fn new() -> Self {
        static NEXT: AtomicUsize = AtomicUsize::new(0);
        let name = format!("ptzcal-journal-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        Self(std::env::temp_dir().join(name))
    }

    fn holding(bytes: &[u8]) -> Self {
        let scratch = Self::new();
        fs::write(&scratch.0, bytes).unwrap();
        scratch
    }

    fn open(&self) -> Result<Resumed> {
        Journal::open(&self.0, &IDENTITY, POSITIONS, false)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

fn shots(count: u32) -> Vec<Shot> {
    let mut random = Random(5);
    let mut sighting = |i: u32| -> Sighting {
        if i % 3 == 2 {
            return Err(Miss::from_code((i % 5 + 1) as u8).unwrap());
        }
        let mut v = || random.between(-10.0, 500.0);
        Ok(Spot {
            x: v(),
            y: v(),
            covariance: [v(), v(), v()],
            peak: v(),
            signal_to_noise: v(),
            area: i,
            saturated: i.is_multiple_of(2),
        })
    };
    (0..count)
        .map(|i| Shot {
            index: 7 * i % POSITIONS as u32,
            pan: 0.1 * f64::from(i),
            tilt: -0.3,
            zoom: 0.0,
            time: 1e6 + f64::from(i),
            head: sighting(i),
            fixed: vec![sighting(i + 1), sighting(i + 2)],
            colour: [i as u8, 3, 250],
            point: None,
        })
        .collect()
}

fn journal_bytes(shots: &[Shot]) -> Vec<u8> {
    let scratch = Scratch::new();
    let mut journal = scratch.open().unwrap().journal;
    shots.iter().for_each(|s| journal.append(s).unwrap());
    fs::read(&scratch.0).unwrap()
}

#[test]
fn what_is_appended_is_read_again() {
    let all = shots(20);
    let scratch = Scratch::holding(&journal_bytes(&all[..12]));
    let Resumed { mut journal, shots, repair } = scratch.open().unwrap();
    assert_eq!((shots.as_slice(), repair), (&all[..12], None));
    all[12..].iter().for_each(|s| journal.append(s).unwrap());
    drop(journal);
    let again = scratch.open().unwrap();
    assert_eq!((again.shots, again.repair), (all, None));
}

#[test]
fn a_journal_cut_anywhere_keeps_every_whole_shot_and_goes_on() {
    let all = shots(4);
    let bytes = journal_bytes(&all);
    let size = record_size(2);
    for cut in 0..=bytes.len() {
        let scratch = Scratch::holding(&bytes[..cut]);
        let mut resumed = scratch.open().unwrap();
        let whole = cut.saturating_sub(HEADER_SIZE) / size;
        assert_eq!(resumed.shots, all[..whole], "cut at {cut}");
        let loose = if cut < HEADER_SIZE { cut } else { (cut - HEADER_SIZE) % size };
        let repair = JournalRepair { kept: whole, damaged: 0, cut_bytes: loose as u64 };
        assert_eq!(resumed.repair, (loose > 0).then_some(repair), "cut at {cut}");
        resumed.journal.append(&all[3]).unwrap();
        drop(resumed);
        let again = scratch.open().unwrap();
        assert!(again.shots.ends_with(&all[3..]) && again.shots.len() == (whole + 1).min(4), "cut at {cut}");
    }
}

#[test]
fn a_flipped_bit_costs_one_shot_or_is_refused() {
    let all = shots(4);
    let bytes = journal_bytes(&all);
    for at in 0..bytes.len() {
        for flip in [1u8, 0x80, 0xFF] {
            let mut damaged = bytes.clone();
            damaged[at] ^= flip;
            let scratch = Scratch::holding(&damaged);
            match scratch.open() {
                Ok(resumed) => {
                    let lost = (at - HEADER_SIZE) / record_size(2);
                    let mut kept = all.clone();
                    kept.remove(lost);
                    assert_eq!(resumed.shots, kept, "byte {at}");
                    assert_eq!(resumed.repair, Some(JournalRepair { kept: 3, damaged: 1, cut_bytes: 0 }));
                }
                Err(error) => {
                    assert!(at < HEADER_SIZE, "byte {at}: {error}");
                    assert!(matches!(error, Error::FileFormat { .. } | Error::FileVersion { .. }), "{error}");
                    // And it is not touched.
                    assert_eq!(fs::read(&scratch.0).unwrap(), damaged);
                }
            }
        }
    }
}

#[test]
fn random_damage_never_invents_a_shot() {
    let all = shots(5);
    let bytes = journal_bytes(&all);
    let mut random = Random(9);
    let mut pick = |n: usize| random.between(0.0, n as f64) as usize;
    for _ in 0..3000 {
        let mut damaged = bytes.clone();
        for _ in 0..=pick(4) {
            let at = pick(damaged.len());
            match pick(4) {
                0 => damaged[at] = pick(256) as u8,
                1 => damaged.truncate(at + 1),
                2 => damaged.insert(at, pick(256) as u8),
                _ => drop(damaged.drain(at..(at + pick(300)).min(damaged.len()))),
            }
            if damaged.is_empty() {
                break;
            }
        }
        if let Ok(resumed) = Scratch::holding(&damaged).open() {
            assert!(resumed.shots.iter().all(|s| all.contains(s)));
            assert!(resumed.shots.is_sorted_by_key(|s| all.iter().position(|a| a == s)));
        }
    }
}

#[test]
fn records_that_are_whole_but_make_no_sense_are_damage() {
    let mut all = shots(3);
    all[0].index = POSITIONS as u32;
    all[1].pan = f64::NAN;
    all[2].index = 5;
    let again = Shot { pan: 0.7, ..all[2].clone() };
    all.push(again);
    let resumed = Scratch::holding(&journal_bytes(&all)).open().unwrap();
    assert_eq!(resumed.shots, all[2..3]);
    assert_eq!(resumed.repair, Some(JournalRepair { kept: 1, damaged: 3, cut_bytes: 0 }));
}

#[test]
fn other_files_versions_and_scans_are_refused_and_left_alone() {
    for foreign in [&b"my holiday notes"[..], b"P", &[0; 5000], MAGIC] {
        let scratch = Scratch::holding(foreign);
        // A journal's first bytes alone are a journal that was killed at its start.
        let is_start = MAGIC.starts_with(foreign);
        assert_eq!(scratch.open().is_ok(), is_start);
        if !is_start {
            assert!(matches!(scratch.open(), Err(Error::FileFormat { .. })));
            assert_eq!(fs::read(&scratch.0).unwrap(), foreign);
        }
    }
    let bytes = journal_bytes(&shots(2));
    let mut newer = bytes.clone();
    newer[8] = 2;
    let opened = Scratch::holding(&newer).open();
    assert!(matches!(opened, Err(Error::FileVersion { found: 2, supported: 1, .. })));
    let others = [
        Identity { fixed_cameras: 1, ..IDENTITY },
        Identity { region: 9, ..IDENTITY },
        Identity { model: 9, ..IDENTITY },
        Identity { options: 9, ..IDENTITY },
    ];
    let scratch = Scratch::holding(&bytes);
    for (other, named) in others.iter().zip(["2 fixed cameras", "region", "rig model", "options"]) {
        match Journal::open(&scratch.0, other, POSITIONS, false) {
            Err(Error::FileMismatch { reason, .. }) => assert!(reason.contains(named), "{reason}"),
            other => panic!("{:?}", other.map(|r| r.shots)),
        }
    }
    assert_eq!(fs::read(&scratch.0).unwrap(), bytes);
}

#[test]
fn a_journal_is_one_scans_at_a_time() {
    let scratch = Scratch::new();
    let first = scratch.open().unwrap();
    assert!(matches!(scratch.open(), Err(Error::Busy { what: "the journal" })));
    drop(first);
    assert!(scratch.open().is_ok());
}

#[test]
fn places_that_cannot_be_written_are_errors() {
    let missing = Scratch::new().0.join("no/such/directory");
    assert!(matches!(Journal::open(&missing, &IDENTITY, POSITIONS, true), Err(Error::FileIo { .. })));
    let directory = std::env::temp_dir();
    assert!(matches!(Journal::open(&directory, &IDENTITY, POSITIONS, true), Err(Error::FileFormat { .. })));
    if let Ok(file) = OpenOptions::new().write(true).open("/dev/full") {
        let mut full = Journal { path: "/dev/full".into(), file, end: 0, sync: false };
        assert!(matches!(full.append(&shots(1)[0]), Err(Error::DiskFull { .. })));
    }
}

#[test]
fn the_checksum_is_the_common_one() {
    assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    assert_ne!(Fingerprint::new().numbers(&[1.0, 2.0]).finish(), Fingerprint::new().numbers(&[2.0, 1.0]).finish());
    assert_eq!(Fingerprint::new().numbers(&[-0.0]).finish(), Fingerprint::new().numbers(&[0.0]).finish());
}

/// Damaged, cut, spliced and random journals: read in bounded memory, never a shot that was not written.
#[test]
fn fuzz_journals() {
    let mut random = fuzz::Random(77);
    let good = journal_bytes(&shots(4));
    let mut read = 0;
    for _ in 0..fuzz_inputs() {
        let bytes = mutated(&good, &mut random);
        if let Ok(Content::Shots { shots, damaged, cut_bytes, end }) =
            content(&mut &bytes[..], Path::new("fuzz"), &IDENTITY, POSITIONS)
        {
            read += 1;
            assert_eq!(end + cut_bytes, bytes.len() as u64);
            assert_eq!(end, (HEADER_SIZE + (shots.len() + damaged) * record_size(2)) as u64);
        }
    }
    assert!(read > fuzz_inputs() / 10);
}
