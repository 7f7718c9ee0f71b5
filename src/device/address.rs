//! Addresses of devices: `scheme://user@host:port/path?option=value&...`. Passwords have no place in
//! them, because addresses are logged.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use crate::error::{Error, Result};

/// Longest address, bytes.
const MAX_LENGTH: usize = 4096;

/// An address, taken apart. `%XX` in user, path and values is decoded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    text: String,
    scheme: String,
    user: Option<String>,
    host: String,
    port: Option<u16>,
    path: String,
    options: Vec<(String, String)>,
}

/// Who opens a device. Never part of an address, never logged.
#[derive(Clone, PartialEq, Eq)]
pub struct Credentials {
    pub user: String,
    pub password: String,
}

impl fmt::Debug for Credentials {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Credentials").field("user", &self.user).finish_non_exhaustive()
    }
}

impl Address {
    /// # Errors
    /// `InvalidAddress` that says what is wrong and where.
    pub fn parse(text: &str) -> Result<Self> {
        // A password that slipped in must not come back in the message.
        let shown = || without_password(text.get(..MAX_LENGTH).unwrap_or(text));
        let wrong = |reason: String| Error::InvalidAddress { address: shown(), reason };
        if text.len() > MAX_LENGTH {
            return Err(wrong(format!("longer than {MAX_LENGTH} bytes")));
        }
        if text.chars().any(|c| c.is_control()) {
            return Err(wrong("it holds a control character".into()));
        }
        let Some((scheme, rest)) = text.split_once("://") else {
            return Err(wrong("it does not begin with a kind of device and ://".into()));
        };
        if scheme.is_empty() || !scheme.bytes().all(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b)) {
            return Err(wrong(format!("{scheme:?} is no kind of device")));
        }
        let (rest, query) = rest.split_once('?').map_or((rest, None), |(rest, query)| (rest, Some(query)));
        let (authority, path) = rest.find('/').map_or((rest, ""), |i| rest.split_at(i));
        let (user, host) = match authority.rsplit_once('@') {
            None => (None, authority),
            Some((user, host)) => {
                if user.contains(':') {
                    return Err(wrong("it holds a password: hand credentials in separately".into()));
                }
                (Some(decoded(user).map_err(&wrong)?), host)
            }
        };
        let (host, port) = split_port(host).map_err(&wrong)?;
        let mut options: Vec<(String, String)> = Vec::new();
        for pair in query.into_iter().flat_map(|q| q.split('&')).filter(|p| !p.is_empty()) {
            let (name, value) =
                pair.split_once('=').ok_or_else(|| wrong(format!("option {pair:?} has no value (name=value)")))?;
            if options.iter().any(|(n, _)| n == name) {
                return Err(wrong(format!("option {name:?} is there twice")));
            }
            options.push((name.to_owned(), decoded(value).map_err(&wrong)?));
        }
        Ok(Self {
            text: text.to_owned(),
            scheme: scheme.to_ascii_lowercase(),
            user,
            host: host.to_owned(),
            port,
            path: decoded(path).map_err(&wrong)?,
            options,
        })
    }

    /// In small letters, such as "visca+udp".
    pub fn scheme(&self) -> &str {
        &self.scheme
    }

    pub fn user(&self) -> Option<&str> {
        self.user.as_deref()
    }

    /// Empty for local devices; IPv6 without its brackets.
    pub fn host(&self) -> &str {
        &self.host
    }

    pub fn port(&self) -> Option<u16> {
        self.port
    }

    /// From the slash on, decoded; empty when there is none.
    pub fn path(&self) -> &str {
        &self.path
    }

    pub fn option(&self, name: &str) -> Option<&str> {
        self.options.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }

    /// An option that is a number within a range.
    pub fn number<T>(&self, name: &str, default: T, range: RangeInclusive<T>) -> Result<T>
    where
        T: FromStr + PartialOrd + fmt::Display,
    {
        let Some(text) = self.option(name) else { return Ok(default) };
        text.parse().ok().filter(|value| range.contains(value)).ok_or_else(|| {
            self.wrong(format!("option {name}={text:?} is no number from {} to {}", range.start(), range.end()))
        })
    }

    /// Refuses options that the device does not have.
    pub fn check_options(&self, known: &[&str]) -> Result<()> {
        match self.options.iter().find(|(name, _)| !known.contains(&name.as_str())) {
            None => Ok(()),
            Some((name, _)) if known.is_empty() => Err(self.wrong(format!("option {name:?}: there are none"))),
            Some((name, _)) => Err(self.wrong(format!("option {name:?} is not among {}", known.join(", ")))),
        }
    }

    /// The host, which has to be there.
    pub fn need_host(&self) -> Result<&str> {
        if self.host.is_empty() { Err(self.wrong("it names no host")) } else { Ok(&self.host) }
    }

    /// The path of a local device or file, which has to be there, without a host before it.
    pub fn need_local_path(&self) -> Result<&str> {
        if !self.host.is_empty() || self.user.is_some() || self.port.is_some() {
            return Err(self.wrong(format!("a local path needs three slashes: {}:///dev/...", self.scheme)));
        }
        if self.path.len() < 2 { Err(self.wrong("it names no path")) } else { Ok(&self.path) }
    }

    /// The fault of this address.
    pub fn wrong(&self, reason: impl Into<String>) -> Error {
        Error::InvalidAddress { address: self.text.clone(), reason: reason.into() }
    }
}

/// As it was written.
impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// `host`, `host:port`, `[ipv6]`, `[ipv6]:port`.
fn split_port(authority: &str) -> std::result::Result<(&str, Option<u16>), String> {
    let (host, rest) = match authority.strip_prefix('[') {
        Some(inner) => inner.split_once(']').ok_or("the bracket of its IPv6 host does not end")?,
        None => authority.find(':').map_or((authority, ""), |i| authority.split_at(i)),
    };
    if rest.is_empty() {
        return Ok((host, None));
    }
    let port = rest.strip_prefix(':').ok_or_else(|| format!("{rest:?} after its host"))?;
    match port.parse::<u16>() {
        Ok(port) if port > 0 => Ok((host, Some(port))),
        _ => Err(format!("{port:?} is no port (1 to 65535; an IPv6 host stands in brackets)")),
    }
}

fn decoded(text: &str) -> std::result::Result<String, String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let digit = |b: Option<u8>| b.and_then(|b| char::from(b).to_digit(16));
        match (digit(rest.next()), digit(rest.next())) {
            (Some(high), Some(low)) => bytes.push((high * 16 + low) as u8),
            _ => return Err(format!("{text:?}: % is not followed by two hexadecimal digits")),
        }
    }
    String::from_utf8(bytes).ok().filter(|s| !s.contains('\0')).ok_or_else(|| format!("{text:?} is not UTF-8 text"))
}

fn without_password(text: &str) -> String {
    let start = text.find("://").map_or(0, |i| i + 3);
    let end = text[start..].find(['/', '?']).map_or(text.len(), |i| start + i);
    match (text[start..end].rfind('@'), text[start..end].find(':')) {
        (Some(at), Some(colon)) if colon < at => format!("{}***{}", &text[..start + colon + 1], &text[start + at..]),
        _ => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_taken_apart() {
        let a = Address::parse("ONVIF://opera%20tor@[fe80::1]:8080/onvif/device?profile=a%26b&x=").unwrap();
        assert_eq!((a.scheme(), a.user(), a.host(), a.port()), ("onvif", Some("opera tor"), "fe80::1", Some(8080)));
        assert_eq!((a.path(), a.option("profile"), a.option("x")), ("/onvif/device", Some("a&b"), Some("")));
        let a = Address::parse("visca:///dev/serial/by-id/usb-FTDI_1234?model=evi-d100&address=1").unwrap();
        assert_eq!((a.host(), a.need_local_path().unwrap()), ("", "/dev/serial/by-id/usb-FTDI_1234"));
        assert_eq!(a.number("address", 1, 1..=7).unwrap(), 1);
        assert!(a.check_options(&["model", "address"]).is_ok());
        assert!(a.need_host().is_err());
        let a = Address::parse("visca+udp://camera.lan").unwrap();
        assert_eq!((a.need_host().unwrap(), a.port(), a.path()), ("camera.lan", None, ""));
    }

    #[test]
    fn every_wrong_address_says_what_is_wrong() {
        let wrong = [
            ("", "begin with"),
            ("visca:/dev/ttyS0", "begin with"),
            ("://x", "kind of device"),
            ("vi sca://x", "kind of device"),
            ("onvif://h:0/", "port"),
            ("onvif://h:65536/", "port"),
            ("onvif://h:x/", "port"),
            ("onvif://fe80::1/", "brackets"),
            ("onvif://[fe80::1/", "bracket"),
            ("onvif://[::1]x/", "after its host"),
            ("visca:///dev/x?model", "no value"),
            ("visca:///dev/x?a=1&a=2", "twice"),
            ("visca:///dev/%zz", "hexadecimal"),
            ("visca:///dev/%2", "hexadecimal"),
            ("visca:///dev/%ff", "UTF-8"),
            ("visca:///dev/%00", "UTF-8"),
            ("visca:///dev/\n", "control"),
        ];
        for (text, part) in wrong {
            let error = Address::parse(text).unwrap_err();
            assert!(
                matches!(error, Error::InvalidAddress { .. }) && error.to_string().contains(part),
                "{text}: {error}"
            );
        }
        let long = format!("visca:///{}", "é".repeat(MAX_LENGTH));
        assert!(Address::parse(&long).unwrap_err().to_string().contains("longer"));
    }

    #[test]
    fn a_password_is_refused_and_not_repeated() {
        let error = Address::parse("onvif://admin:hunter2@camera/onvif").unwrap_err();
        assert!(error.to_string().contains("password") && !error.to_string().contains("hunter2"), "{error}");
        let credentials = Credentials { user: "admin".into(), password: "hunter2".into() };
        assert!(!format!("{credentials:?}").contains("hunter2"));
    }

    #[test]
    fn options_are_checked() {
        let a = Address::parse("visca://host/path?model=x&baud=fast").unwrap();
        for error in [
            a.check_options(&["model"]).unwrap_err(),
            a.check_options(&[]).unwrap_err(),
            a.number("baud", 9600, 300..=115_200).unwrap_err(),
            a.need_local_path().unwrap_err(),
            Address::parse("gpio:///").unwrap().need_local_path().unwrap_err(),
        ] {
            assert!(matches!(error, Error::InvalidAddress { .. }), "{error}");
        }
        assert_eq!(a.number("address", 1, 1..=7).unwrap(), 1);
    }
}
