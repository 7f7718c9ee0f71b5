//! SOAP calls with proof of the password.
//!
//! A call goes out plain, or the way that was accepted last. When the camera wants proof it gets
//! HTTP Digest if it offers that, else (old cameras, that answer with a fault) a WS-UsernameToken
//! stamped with the camera's own time. At most one wrong proof of each kind is sent in a call:
//! cameras lock users out that fail often.

use std::sync::{Arc, Mutex};
use std::time::{SystemTime, UNIX_EPOCH};

use super::digest::{Challenge, client_nonce, nonce, username_token};
use super::http::{Host, Http, Place, Reply};
use super::time::iso_8601;
use super::xml::Element;
use crate::control::{Clock, unpoisoned};
use crate::device::Credentials;
use crate::error::{Error, Result};

/// Of a camera's text in our messages.
const MAX_QUOTE: usize = 200;
/// Plain, digest, digest with a fresh nonce, token.
const MAX_TRIES: u32 = 4;

/// How a camera wants its user proven.
enum Proof {
    /// Not asked for yet.
    None,
    Digest(Challenge, u32),
    Token,
}

/// What is known of a camera's locks; shared by all connections to it.
pub struct Keys {
    credentials: Option<Credentials>,
    clock: Arc<dyn Clock>,
    proof: Mutex<Proof>,
    /// Seconds since 1970 on the camera's clock, less ours.
    skew: Mutex<Option<f64>>,
}

impl Keys {
    pub fn new(credentials: Option<Credentials>, clock: Arc<dyn Clock>) -> Self {
        Self { credentials, clock, proof: Mutex::new(Proof::None), skew: Mutex::new(None) }
    }

    pub fn set_device_time(&self, unix: f64) {
        *unpoisoned(&self.skew) = Some(unix - self.clock.now());
    }

    /// The camera's time, or the host's where the camera does not tell.
    fn device_time(&self) -> f64 {
        let host = || SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64());
        let skew = *unpoisoned(&self.skew);
        skew.map_or_else(host, |skew| skew + self.clock.now())
    }
}

/// What one try sent as proof.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Sent {
    Nothing,
    Digest { nonce: String, first: bool },
    Token,
}

/// A connection of its own to a camera.
pub struct Client {
    http: Http,
    keys: Arc<Keys>,
}

impl Client {
    pub fn new(host: Host, timeout: f64, keys: Arc<Keys>) -> Self {
        Self { http: Http::new(host, timeout), keys }
    }

    /// A second connection, with the same keys.
    pub fn another(&self, timeout: f64) -> Self {
        Self::new(self.host().clone(), timeout, self.keys.clone())
    }

    pub fn host(&self) -> &Host {
        self.http.host()
    }

    pub fn keys(&self) -> &Keys {
        &self.keys
    }

    pub fn mismatch(&self, reason: impl Into<String>) -> Error {
        self.http.mismatch(reason.into())
    }

    /// Calls `action` with the given body; what its response holds.
    ///
    /// # Errors
    /// `Unauthorised`; `DeviceRefused` with the text of the camera's fault; `DeviceMismatch` for
    /// anything that is no such response; `DeviceTimeout`, `DeviceLost`, `DeviceNotFound`.
    pub fn call(&self, place: &Place, action: &str, body: &str) -> Result<Element> {
        let send = |digest: Option<&str>, token: &str| self.http.post(place, &envelope(token, body), digest);
        let reply = self.prove("POST", place, send)?;
        self.response(&reply, action)
    }

    /// Calls what the standard lets everybody ask, without proof; `None` where the camera wants one.
    pub fn ask(&self, place: &Place, action: &str, body: &str) -> Result<Option<Element>> {
        let reply = self.http.post(place, &envelope("", body), None)?;
        if is_locked(&reply) { Ok(None) } else { self.response(&reply, action).map(Some) }
    }

    /// GETs a picture or the like.
    pub fn get(&self, place: &Place, most: u64, timeout: f64) -> Result<Vec<u8>> {
        let end = self.keys.clock.now() + timeout;
        let reply = self.prove("GET", place, |digest, _| {
            // Of several tries the last has what the first ones left.
            let left = (end - self.keys.clock.now()).min(timeout);
            if left <= 0.0 {
                return Err(Error::DeviceTimeout { what: "camera", seconds: timeout });
            }
            self.http.get(place, digest, most, left)
        })?;
        match reply.status {
            200 => Ok(reply.body),
            300..=399 => Err(self.mismatch(format!("{} is somewhere else (HTTP {})", place.path, reply.status))),
            status => Err(Error::DeviceRefused { reason: format!("{} (HTTP {status})", place.path) }),
        }
    }

    /// Sends until the camera accepts the proof.
    fn prove(&self, method: &str, place: &Place, send: impl Fn(Option<&str>, &str) -> Result<Reply>) -> Result<Reply> {
        let mut tried = Vec::new();
        for _ in 0..MAX_TRIES {
            let (sent, digest, token) = self.proof(method, place);
            let reply = send(digest.as_deref(), token.as_deref().unwrap_or_default())?;
            if !is_locked(&reply) {
                return Ok(reply);
            }
            tried.push(sent);
            self.next_proof(method, &reply, &tried)?;
        }
        Err(self.unauthorised("it accepts neither digest nor token"))
    }

    fn proof(&self, method: &str, place: &Place) -> (Sent, Option<String>, Option<String>) {
        let Some(credentials) = &self.keys.credentials else { return (Sent::Nothing, None, None) };
        match &mut *unpoisoned(&self.keys.proof) {
            Proof::Digest(challenge, count) => {
                *count += 1;
                let value = challenge.answer(credentials, method, &place.path, *count, &client_nonce());
                (Sent::Digest { nonce: challenge.nonce.clone(), first: *count == 1 }, Some(value), None)
            }
            // A token has its place in an envelope.
            Proof::Token if method == "POST" => {
                let created = iso_8601(self.keys.device_time());
                (Sent::Token, None, Some(username_token(credentials, &nonce(), &created)))
            }
            Proof::Token | Proof::None => (Sent::Nothing, None, None),
        }
    }

    /// After a refusal: what to try next.
    fn next_proof(&self, method: &str, reply: &Reply, tried: &[Sent]) -> Result<()> {
        if self.keys.credentials.is_none() {
            return Err(self.unauthorised("it wants a user and a password"));
        }
        let challenge = Challenge::strongest(reply.challenges.iter().map(String::as_str));
        let mut proof = unpoisoned(&self.keys.proof);
        if let Some(challenge) = challenge {
            let digests = tried.iter().filter(|t| matches!(t, Sent::Digest { .. })).count();
            // An old nonce, or one that the camera calls stale, says nothing of the password.
            let again = match tried.last() {
                Some(Sent::Digest { first, .. }) => (challenge.stale || !first) && digests < 2,
                _ => digests == 0,
            };
            if again {
                *proof = Proof::Digest(challenge, 0);
                return Ok(());
            }
        } else if method == "GET" && reply.challenges.iter().any(|c| c.trim_start().starts_with("Basic")) {
            return Err(self.unauthorised("it offers only Basic, which would send the password readable"));
        }
        if method == "POST" && !tried.contains(&Sent::Token) {
            *proof = Proof::Token;
            return Ok(());
        }
        *proof = Proof::None;
        Err(self.unauthorised("it refuses this user or password"))
    }

    fn unauthorised(&self, reason: &str) -> Error {
        Error::Unauthorised { device: self.host().name.clone(), reason: reason.into() }
    }

    fn response(&self, reply: &Reply, action: &str) -> Result<Element> {
        let status = reply.status;
        let wrong = |what: String| self.mismatch(format!("its answer to {action} (HTTP {status}): {what}"));
        let envelope = match Element::parse(&reply.body) {
            Ok(envelope) => envelope,
            Err(_) if status == 404 || (300..400).contains(&status) => return Err(wrong("no ONVIF service".into())),
            Err(reason) => return Err(wrong(reason)),
        };
        let body = envelope.child("Body").filter(|_| envelope.name == "Envelope");
        let body = body.ok_or_else(|| wrong("it is no SOAP envelope".into()))?;
        if let Some(fault) = body.child("Fault") {
            return Err(Error::DeviceRefused { reason: format!("{action}: {}", fault_text(fault)) });
        }
        let expected = format!("{action}Response");
        match body.child(&expected) {
            Some(response) => Ok(response.clone()),
            None => {
                let found = body.children().next().map_or("nothing", |e| e.name.as_str());
                Err(wrong(format!("it holds {} instead of {expected}", bounded(found))))
            }
        }
    }
}

fn envelope(header: &str, body: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\
         <s:Envelope xmlns:s=\"http://www.w3.org/2003/05/soap-envelope\">\
         <s:Header>{header}</s:Header><s:Body>{body}</s:Body></s:Envelope>"
    )
}

/// Does the reply ask for (better) proof? Old cameras do so with a fault.
fn is_locked(reply: &Reply) -> bool {
    match reply.status {
        401 => true,
        400 | 403 | 500 => fault(&reply.body).is_some_and(|fault| {
            let code = codes(&fault).join(" ");
            ["NotAuthorized", "FailedAuthentication", "InvalidSecurity"].iter().any(|c| code.contains(c))
        }),
        _ => false,
    }
}

fn fault(body: &[u8]) -> Option<Element> {
    Element::parse(body).ok()?.at(&["Body", "Fault"]).cloned()
}

/// The code and subcodes of a fault of SOAP 1.2, or the code of 1.1, without prefixes.
fn codes(fault: &Element) -> Vec<String> {
    let short = |text: &str| text.rsplit(':').next().unwrap_or_default().to_owned();
    let mut codes: Vec<String> = fault.text_at(&["faultcode"]).map(short).into_iter().collect();
    let mut next = fault.child("Code");
    while let Some(code) = next {
        codes.extend(code.text_at(&["Value"]).map(short));
        next = code.child("Subcode");
    }
    codes
}

fn fault_text(fault: &Element) -> String {
    let reason = fault.text_at(&["Reason", "Text"]).or_else(|| fault.text_at(&["faultstring"]));
    let codes = codes(fault).join(", ");
    bounded(&match reason {
        Some(reason) => format!("{reason} ({codes})"),
        None => codes,
    })
}

/// A camera's text, fit for a message.
pub fn bounded(text: &str) -> String {
    let clean = |c: char| if c.is_control() { ' ' } else { c };
    let mut short: String = text.chars().map(clean).take(MAX_QUOTE).collect();
    if text.chars().nth(MAX_QUOTE).is_some() {
        short.push_str("...");
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_of_both_soaps_are_read() {
        let of = |text: &str| fault(text.as_bytes()).map(|f| fault_text(&f)).unwrap();
        let twelve = "<e:Envelope><e:Body><e:Fault><e:Code><e:Value>env:Sender</e:Value><e:Subcode><e:Value>ter:NotAuthorized\
            </e:Value></e:Subcode></e:Code><e:Reason><e:Text>Who are you?</e:Text></e:Reason></e:Fault></e:Body></e:Envelope>";
        assert_eq!(of(twelve), "Who are you? (Sender, NotAuthorized)");
        let reply = |status, body: &str| Reply { status, body: body.into(), ..Reply::default() };
        assert!(is_locked(&reply(400, twelve)) && is_locked(&reply(500, twelve)) && !is_locked(&reply(200, "")));
        let eleven = "<Envelope><Body><Fault><faultcode>Server</faultcode><faultstring>x\ny</faultstring></Fault></Body></Envelope>";
        assert_eq!(of(eleven), "x y (Server)");
        assert!(!is_locked(&reply(500, eleven)) && is_locked(&reply(401, "")));
        assert_eq!(bounded(&"ä".repeat(300)).chars().count(), MAX_QUOTE + 3);
    }
}
