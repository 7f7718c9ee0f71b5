//! What no camera says: random and damaged replies.

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::services::{Node, Status};
use super::time::device_time;
use super::xml::Element;

const STATUS: &str = "<?xml version=\"1.0\"?><s:Envelope xmlns:s=\"urn:s\"><s:Body><GetStatusResponse><PTZStatus>\
    <tt:Position><tt:PanTilt x=\"-0.5\" y=\"2e-1\" space=\"a/PositionGenericSpace\"/><tt:Zoom x=\"1\"/></tt:Position>\
    <tt:MoveStatus><tt:PanTilt>IDLE</tt:PanTilt><tt:Zoom>MOVING</tt:Zoom></tt:MoveStatus></PTZStatus>\
    </GetStatusResponse></s:Body></s:Envelope>";
const NODE: &str = "<PTZNode token=\"n\"><SupportedPTZSpaces><AbsolutePanTiltPositionSpace>\
    <URI>x/SphericalPositionSpaceDegrees</URI><XRange><Min>-170</Min><Max>170</Max></XRange>\
    <YRange><Min>-90</Min><Max>20</Max></YRange></AbsolutePanTiltPositionSpace></SupportedPTZSpaces>\
    <MaximumNumberOfPresets>16</MaximumNumberOfPresets><HomeSupported>true</HomeSupported></PTZNode>";
const TIME: &str = "<R><SystemDateAndTime><UTCDateTime><Time><Hour>7</Hour><Minute>50</Minute><Second>45</Second></Time>\
    <Date><Year>2010</Year><Month>9</Month><Day>16</Day></Date></UTCDateTime></SystemDateAndTime></R>";
/// What is put into them.
const PIECES: [&str; 16] = [
    "<",
    ">",
    "/",
    "&amp;",
    "&x;",
    "&#9;",
    "\"",
    "<a>",
    "</a>",
    "<![CDATA[",
    "]]>",
    "<!--",
    "NaN",
    "-1e999",
    "\u{e4}",
    "\0",
];

fn damaged(text: &str, random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..1 + random.next_u32() % 3 {
        let at = random.next_u32() as usize % (bytes.len() + 1);
        match random.next_u32() % 4 {
            0 => bytes.truncate(at),
            1 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b = random.next_u32() as u8),
            2 => drop(bytes.splice(at..at, PIECES[random.next_u32() as usize % PIECES.len()].bytes())),
            _ => {
                let end = (at + random.next_u32() as usize % 40).min(bytes.len());
                bytes.drain(at..end);
            }
        }
    }
    bytes
}

#[test]
fn undamaged_replies_are_read() {
    let status = Element::parse(STATUS.as_bytes()).unwrap();
    let status = Status::read(status.at(&["Body", "GetStatusResponse"]).unwrap()).unwrap();
    assert_eq!((status.pan_tilt, status.zoom), (Some([-0.5, 0.2]), Some(1.0)));
    let node = Node::read(&Element::parse(NODE.as_bytes()).unwrap()).unwrap();
    assert_eq!((node.degrees.unwrap().y, node.presets, node.home), ([-90.0, 20.0], 16, true));
    assert_eq!(device_time(&Element::parse(TIME.as_bytes()).unwrap()), Some(1_284_623_445.0));
}

/// A reply is read or refused; what was read is finite and in order.
#[test]
fn fuzz_replies() {
    let inputs = crate::fuzz::fuzz_inputs();
    let mut random = ChaCha8Rng::seed_from_u64(2026);
    let mut read = [0u64; 3];
    for i in 0..inputs {
        let kind = (i % 3) as usize;
        let Ok(root) = Element::parse(&damaged([STATUS, NODE, TIME][kind], &mut random)) else { continue };
        let fine = match kind {
            0 => root.at(&["Body", "GetStatusResponse"]).and_then(|r| Status::read(r).ok()).map(|status| {
                assert!(status.pan_tilt.iter().flatten().chain(&status.zoom).all(|v| v.is_finite()));
            }),
            1 => Node::read(&root).ok().map(|node| {
                let spaces = [node.generic, node.degrees].into_iter().flatten();
                assert!(spaces.flat_map(|s| [s.x, s.y]).all(|[low, high]| low < high && (high - low).is_finite()));
            }),
            _ => device_time(&root).map(|unix| assert!((0.0..2.6e11).contains(&unix))),
        };
        read[kind] += u64::from(fine.is_some());
    }
    assert!(read.iter().all(|n| *n > inputs / 1000), "{read:?}");
}
