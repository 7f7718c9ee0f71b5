//! Cameras of the local network, by WS-Discovery (OASIS 2005, as ONVIF Core uses it): one probe to a
//! multicast group, answers from whoever is a network video transmitter.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use super::client::bounded;
use super::digest::nonce;
use super::xml::Element;
use crate::device::device_error;
use crate::error::Result;

const GROUP: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::new(239, 255, 255, 250)), 3702);
/// Answers beyond these are dropped.
const MAX_CAMERAS: usize = 256;
/// Longest answer that a datagram can hold.
const MAX_DATAGRAM: usize = 65_536;

/// A camera that answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Discovered {
    /// To open it with, such as `onvif://192.168.1.20/onvif/device_service`.
    pub address: String,
    /// What it calls itself and its make; empty where it does not say.
    pub name: String,
    pub hardware: String,
}

/// Asks once and listens for `timeout` seconds (at most 60). Not on the workflow's clock: it waits
/// for the network.
///
/// # Errors
/// The system's, when it does not let datagrams out.
pub fn discover(timeout: f64) -> Result<Vec<Discovered>> {
    discover_at(GROUP, timeout)
}

fn discover_at(target: SocketAddr, timeout: f64) -> Result<Vec<Discovered>> {
    let failed = |e| device_error("WS-Discovery", &e);
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).map_err(failed)?;
    let id = uuid();
    socket.send_to(probe(&id).as_bytes(), target).map_err(failed)?;
    let end =
        Instant::now() + Duration::from_secs_f64(if timeout.is_finite() { timeout.clamp(0.0, 60.0) } else { 60.0 });
    let mut found = Vec::new();
    let mut buffer = vec![0; MAX_DATAGRAM];
    while found.len() < MAX_CAMERAS {
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            break;
        }
        socket.set_read_timeout(Some(left)).map_err(failed)?;
        match socket.recv_from(&mut buffer) {
            Ok((count, from)) => {
                let answer = buffer.get(..count).unwrap_or_default();
                if let Some(camera) = read(answer, &id, from).filter(|camera| !found.contains(camera)) {
                    found.push(camera);
                }
            }
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => break,
            // A signal, or somebody's refusal of the probe.
            Err(e) if matches!(e.kind(), ErrorKind::Interrupted | ErrorKind::ConnectionRefused) => {}
            Err(e) => return Err(failed(e)),
        }
    }
    Ok(found)
}

fn uuid() -> String {
    let mut b = nonce();
    // Version 4, variant 1 (RFC 9562).
    b[6] = (b[6] & 0x0F) | 0x40;
    b[8] = (b[8] & 0x3F) | 0x80;
    let hex: String = b.iter().map(|b| format!("{b:02x}")).collect();
    format!("urn:uuid:{}-{}-{}-{}-{}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}

fn probe(id: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?><s:Envelope xmlns:s=\"http://www.w3.org/2003/05/soap-envelope\" \
         xmlns:a=\"http://schemas.xmlsoap.org/ws/2004/08/addressing\"><s:Header>\
         <a:Action>http://schemas.xmlsoap.org/ws/2005/04/discovery/Probe</a:Action><a:MessageID>{id}</a:MessageID>\
         <a:To>urn:schemas-xmlsoap-org:ws:2005:04:discovery</a:To></s:Header><s:Body>\
         <d:Probe xmlns:d=\"http://schemas.xmlsoap.org/ws/2005/04/discovery\" \
         xmlns:n=\"http://www.onvif.org/ver10/network/wsdl\"><d:Types>n:NetworkVideoTransmitter</d:Types></d:Probe>\
         </s:Body></s:Envelope>"
    )
}

/// An answer to our probe. The address is built on where the datagram came from: what a camera
/// writes there may be a link-local one, or somebody else's.
fn read(answer: &[u8], id: &str, from: SocketAddr) -> Option<Discovered> {
    let envelope = Element::parse(answer).ok()?;
    if envelope.text_at(&["Header", "RelatesTo"]) != Some(id) {
        return None;
    }
    let found = envelope.at(&["Body", "ProbeMatches", "ProbeMatch"])?;
    let urls: Vec<&str> = found.text_at(&["XAddrs"])?.split_whitespace().filter(|u| u.starts_with("http://")).collect();
    let authority =
        |url: &str| url.get(7..).unwrap_or_default().split(['/', '?']).next().unwrap_or_default().to_owned();
    let ip = from.ip().to_string();
    let own = urls.iter().find(|url| authority(url).split(':').next() == Some(ip.as_str()));
    let url = own.or(urls.first())?;
    let authority = authority(url);
    let port = authority.split_once(':').and_then(|(_, port)| port.parse::<u16>().ok()).unwrap_or(80);
    let path = url.get(7 + authority.len()..).unwrap_or_default();
    if !path.bytes().all(|b| b.is_ascii_alphanumeric() || b"/._-".contains(&b)) || path.len() > 256 {
        return None;
    }
    let port = if port == 80 { String::new() } else { format!(":{port}") };
    let scopes = found.text_at(&["Scopes"]).unwrap_or_default();
    let scope = |kind: &str| {
        let mut values = scopes.split_whitespace().filter_map(|s| s.strip_prefix("onvif://www.onvif.org/"));
        let value = values.find_map(|s| s.strip_prefix(kind)?.strip_prefix('/')).unwrap_or_default();
        bounded(&value.replace("%20", " "))
    };
    Some(Discovered { address: format!("onvif://{ip}{port}{path}"), name: scope("name"), hardware: scope("hardware") })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Address;

    fn answer(id: &str, urls: &str) -> String {
        format!(
            "<E><Header><a:RelatesTo>{id}</a:RelatesTo></Header><Body><d:ProbeMatches><d:ProbeMatch>\
             <d:Scopes>onvif://www.onvif.org/type/ptz onvif://www.onvif.org/name/North%20gate \
             onvif://www.onvif.org/hardware/X1</d:Scopes><d:XAddrs>{urls}</d:XAddrs>\
             </d:ProbeMatch></d:ProbeMatches></Body></E>"
        )
    }

    /// A camera on this machine, asked without multicast; it answers twice, and a stranger once.
    #[test]
    fn a_camera_that_answers_is_found_once() {
        let camera = UdpSocket::bind("127.0.0.1:0").unwrap();
        let target = camera.local_addr().unwrap();
        let thread = std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            let (count, from) = camera.recv_from(&mut buffer).unwrap();
            let probe = Element::parse(&buffer[..count]).unwrap();
            let id = probe.text_at(&["Header", "MessageID"]).unwrap().to_owned();
            assert_eq!(probe.text_at(&["Body", "Probe", "Types"]), Some("n:NetworkVideoTransmitter"));
            let urls = "http://169.254.1.1/link http://127.0.0.1:8899/onvif/device_service";
            for text in ["garbage", &answer("urn:uuid:other", urls), &answer(&id, urls), &answer(&id, urls)] {
                camera.send_to(text.as_bytes(), from).unwrap();
            }
        });
        let found = discover_at(target, 0.5).unwrap();
        thread.join().unwrap();
        let expected = Discovered {
            address: "onvif://127.0.0.1:8899/onvif/device_service".into(),
            name: "North gate".into(),
            hardware: "X1".into(),
        };
        assert_eq!(found, [expected]);
        assert!(Address::parse(&found[0].address).is_ok());
    }

    #[test]
    fn answers_that_mislead_are_passed_over() {
        let from = "10.0.0.5:3702".parse().unwrap();
        let at = |urls: &str| read(answer("i", urls).as_bytes(), "i", from).map(|c| c.address);
        assert_eq!(at("http://evil.example:81/x").as_deref(), Some("onvif://10.0.0.5:81/x"));
        for none in ["", "https://10.0.0.5/x", "http://10.0.0.5/x?model=1", "http://10.0.0.5/%zz", "http:///"] {
            assert!(at(none).is_none_or(|a| Address::parse(&a).is_ok_and(|a| a.host() == "10.0.0.5")), "{none}");
        }
        assert_eq!(read(answer("j", "http://a/").as_bytes(), "i", from), None);
        assert!(discover_at("127.0.0.1:9".parse().unwrap(), 0.01).unwrap().is_empty());
        let id = uuid();
        assert!(id.len() == 45 && id.as_bytes()[23] == b'4', "{id}");
    }
}
