//! The two ways to prove a password without sending it: HTTP Digest (RFC 7616, and RFC 2069 for old
//! servers) and the digest of WS-UsernameToken (OASIS Username Token Profile 1.0).

use std::fmt::Write;
use std::hash::{BuildHasher, Hasher, RandomState};

use md5::{Digest, Md5};
use sha1::Sha1;
use sha2::Sha256;

use crate::device::Credentials;
use crate::format::base64;

const MAX_CHALLENGE: usize = 4096;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Algorithm {
    Md5,
    Sha256,
}

/// What a server asks for with `WWW-Authenticate: Digest`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Challenge {
    realm: String,
    pub nonce: String,
    opaque: Option<String>,
    /// The algorithm's name as the server wrote it, for the answer; `None` when it gave none.
    algorithm_name: Option<String>,
    algorithm: Algorithm,
    session: bool,
    /// Is the answer protected by counter and client nonce (qop=auth)?
    counted: bool,
    pub stale: bool,
}

impl Challenge {
    /// The strongest challenge that can be answered among the values of `WWW-Authenticate`.
    pub fn strongest<'a>(headers: impl Iterator<Item = &'a str>) -> Option<Self> {
        headers.flat_map(challenges).filter_map(|c| Self::from_parameters(&c)).max_by_key(|c| c.algorithm)
    }

    fn from_parameters(parameters: &[(String, String)]) -> Option<Self> {
        let get = |name: &str| parameters.iter().find(|(n, _)| n == name).map(|(_, value)| value.clone());
        let algorithm_name = get("algorithm");
        let name = algorithm_name.as_deref().unwrap_or("MD5").to_ascii_uppercase();
        let (name, session) = name.strip_suffix("-SESS").map_or((name.as_str(), false), |name| (name, true));
        let algorithm = match name {
            "MD5" => Algorithm::Md5,
            "SHA-256" => Algorithm::Sha256,
            _ => return None,
        };
        let counted = match get("qop") {
            None => false,
            Some(offered) if offered.split(',').any(|q| q.trim().eq_ignore_ascii_case("auth")) => true,
            // Only auth-int: over the body too, which no camera asks for.
            Some(_) => return None,
        };
        Some(Self {
            realm: get("realm")?,
            nonce: get("nonce")?,
            opaque: get("opaque"),
            algorithm_name,
            algorithm,
            session,
            counted,
            stale: get("stale").is_some_and(|s| s.eq_ignore_ascii_case("true")),
        })
    }

    fn hash(&self, text: &str) -> String {
        match self.algorithm {
            Algorithm::Md5 => hex(&Md5::digest(text)),
            Algorithm::Sha256 => hex(&Sha256::digest(text)),
        }
    }

    /// The value of `Authorization` for a request; `count` grows by one with each use of a nonce.
    pub fn answer(&self, credentials: &Credentials, method: &str, uri: &str, count: u32, cnonce: &str) -> String {
        let Credentials { user, password } = credentials;
        let (realm, nonce) = (&self.realm, &self.nonce);
        let mut secret = self.hash(&format!("{user}:{realm}:{password}"));
        if self.session {
            secret = self.hash(&format!("{secret}:{nonce}:{cnonce}"));
        }
        let request = self.hash(&format!("{method}:{uri}"));
        let response = if self.counted {
            self.hash(&format!("{secret}:{nonce}:{count:08x}:{cnonce}:auth:{request}"))
        } else {
            self.hash(&format!("{secret}:{nonce}:{request}"))
        };
        let mut value = format!(
            "Digest username=\"{}\", realm=\"{}\", nonce=\"{}\", uri=\"{}\", response=\"{response}\"",
            quoted(user),
            quoted(realm),
            quoted(nonce),
            quoted(uri)
        );
        if let Some(name) = &self.algorithm_name {
            value += &format!(", algorithm={}", token(name));
        }
        if self.counted {
            value += &format!(", qop=auth, nc={count:08x}, cnonce=\"{cnonce}\"");
        } else if self.session {
            value += &format!(", cnonce=\"{cnonce}\"");
        }
        if let Some(opaque) = &self.opaque {
            value += &format!(", opaque=\"{}\"", quoted(opaque));
        }
        value
    }
}

/// The parameters of each Digest challenge in one header, names in small letters.
fn challenges(header: &str) -> Vec<Vec<(String, String)>> {
    let mut found: Vec<Vec<(String, String)>> = Vec::new();
    let mut current = false;
    let mut rest = header.get(..MAX_CHALLENGE).unwrap_or(header);
    while !rest.is_empty() {
        rest = rest.trim_start_matches([',', ' ', '\t']);
        let end = rest.find(['=', ' ', ',', '\t']).unwrap_or(rest.len());
        let (name, after) = rest.split_at(end);
        // Some write `name = value`.
        let trimmed = after.trim_start();
        let Some(value) = trimmed.strip_prefix('=').filter(|_| !name.is_empty()) else {
            // A new scheme, or nothing that can be read.
            current = name.eq_ignore_ascii_case("digest");
            if current {
                found.push(Vec::new());
            }
            rest = if end == 0 { after.get(1..).unwrap_or_default() } else { after };
            continue;
        };
        let (value, after) = unquoted(value.trim_start());
        if let Some(parameters) = found.last_mut().filter(|_| current) {
            parameters.push((name.to_ascii_lowercase(), value));
        }
        rest = after;
    }
    found
}

/// A quoted string or a token, and what comes after it.
fn unquoted(text: &str) -> (String, &str) {
    let Some(inner) = text.strip_prefix('"') else {
        let end = text.find([',', ' ', '\t']).unwrap_or(text.len());
        return (text[..end].to_owned(), &text[end..]);
    };
    let mut value = String::new();
    let mut chars = inner.char_indices();
    while let Some((at, c)) = chars.next() {
        match c {
            '"' => return (value, &inner[at + 1..]),
            '\\' => value.extend(chars.next().map(|(_, c)| c)),
            c => value.push(c),
        }
    }
    (value, "")
}

fn quoted(text: &str) -> String {
    let clean: String = text.chars().filter(|c| !c.is_control()).collect();
    clean.replace('\\', "\\\\").replace('"', "\\\"")
}

fn token(text: &str) -> String {
    text.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-').collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// The header block of a WS-UsernameToken: Base64(SHA-1(nonce + created + password)).
pub fn username_token(credentials: &Credentials, nonce: &[u8], created: &str) -> String {
    let mut hash = Sha1::new();
    hash.update(nonce);
    hash.update(created);
    hash.update(&credentials.password);
    let profile = "http://docs.oasis-open.org/wss/2004/01/oasis-200401-wss";
    format!(
        "<wsse:Security s:mustUnderstand=\"1\" xmlns:wsse=\"{profile}-wssecurity-secext-1.0.xsd\" \
         xmlns:wsu=\"{profile}-wssecurity-utility-1.0.xsd\"><wsse:UsernameToken>\
         <wsse:Username>{}</wsse:Username>\
         <wsse:Password Type=\"{profile}-username-token-profile-1.0#PasswordDigest\">{}</wsse:Password>\
         <wsse:Nonce EncodingType=\"{profile}-soap-message-security-1.0#Base64Binary\">{}</wsse:Nonce>\
         <wsu:Created>{created}</wsu:Created></wsse:UsernameToken></wsse:Security>",
        super::xml::escaped(&credentials.user),
        base64(&hash.finalize()),
        base64(nonce),
    )
}

/// 16 bytes that nobody can foretell: the standard library's hash keys come from the system's
/// random source.
pub fn nonce() -> [u8; 16] {
    let half = || RandomState::new().build_hasher().finish().to_be_bytes();
    let (a, b) = (half(), half());
    std::array::from_fn(|i| if i < 8 { a[i] } else { b[i - 8] })
}

/// A fresh client nonce of HTTP Digest.
pub fn client_nonce() -> String {
    hex(&nonce())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mufasa() -> Credentials {
        Credentials { user: "Mufasa".into(), password: "Circle of Life".into() }
    }

    fn one(header: &str) -> Challenge {
        Challenge::strongest([header].into_iter()).unwrap()
    }

    /// RFC 7616 section 3.9.1; RFC 2617 section 3.5; and RFC 2069 with its erratum 749.
    #[test]
    fn the_examples_of_the_standards() {
        let header = |algorithm: &str| {
            format!(
                "Digest realm=\"http-auth@example.org\", qop=\"auth, auth-int\", algorithm={algorithm}, \
                 nonce=\"7ypf/xlj9XXwfDPEoM4URrv/xwf94BcCAzFZH4GiTo0v\", \
                 opaque=\"FQhe/qaU925kfnzjCev0ciny7QMkPqMAFRtzCUYo5tdS\""
            )
        };
        let cnonce = "f2/wE4q74E6zIJEtWaHKaf5wv/H5QzzpXusqGemxURZJ";
        let answer = |h: &str| one(h).answer(&mufasa(), "GET", "/dir/index.html", 1, cnonce);
        let md5 = answer(&header("MD5"));
        assert!(md5.contains("response=\"8ca523f5e9506fed4657c9700eebdbec\""), "{md5}");
        assert!(md5.contains("nc=00000001") && md5.contains("qop=auth,") && md5.contains("opaque=\"FQhe"), "{md5}");
        let sha = answer(&header("SHA-256"));
        assert!(
            sha.contains("response=\"753927fa0e85d155564e2e272a28d1802ca10daf4496794697cf8db5856cb6c1\"")
                && sha.contains("algorithm=SHA-256"),
            "{sha}"
        );
        let old = "Digest realm=\"testrealm@host.com\", qop=\"auth,auth-int\", \
                   nonce=\"dcd98b7102dd2f0e8b11d0f600bfb0c093\", opaque=\"5ccc069c403ebaf9f0171e9517f40e41\"";
        let circle = Credentials { user: "Mufasa".into(), password: "Circle Of Life".into() };
        let answer = one(old).answer(&circle, "GET", "/dir/index.html", 1, "0a4f113b");
        assert!(answer.contains("response=\"6629fae49393a05397450978507c4ef1\""), "{answer}");
        let older = "Digest realm=\"testrealm@host.com\", nonce=\"dcd98b7102dd2f0e8b11d0f600bfb0c093\", \
                     opaque=\"5ccc069c403ebaf9f0171e9517f40e41\"";
        let lion = Credentials { user: "Mufasa".into(), password: "CircleOfLife".into() };
        let answer = one(older).answer(&lion, "GET", "/dir/index.html", 1, "unused");
        assert!(
            answer.contains("response=\"1949323746fe6a43ef61f9606e7febea\"") && !answer.contains("qop"),
            "{answer}"
        );
    }

    /// ONVIF Application Programmer's Guide 1.0, section 6.1.1.3.
    #[test]
    fn the_example_of_the_username_token() {
        let nonce = [0x2c, 0xaa, 0x88, 0xe8, 0x6f, 0xc0, 0x8a, 0x42, 0x82, 0x42, 0xb3, 0x74, 0xce, 0xa6, 0x45, 0x96];
        assert_eq!(base64(&nonce), "LKqI6G/AikKCQrN0zqZFlg==");
        let user = Credentials { user: "user<".into(), password: "userpassword".into() };
        let token = username_token(&user, &nonce, "2010-09-16T07:50:45Z");
        assert!(token.contains(">tuOSpGlFlIXsozq4HFNeeGeFLEI=<") && token.contains(">user&lt;<"), "{token}");
        assert!(!token.contains("userpassword"));
    }

    #[test]
    fn challenges_are_told_apart_in_any_dress() {
        let both = "Basic realm=\"x, Digest realm=y\", Digest realm=\"a \\\"b\\\"\", nonce=n1, stale=TRUE, \
                    Digest realm=\"c\",nonce = \"n2\" ,algorithm=\"sha-256\",qop=\"auth\"";
        let found = one(both);
        assert_eq!(
            (found.nonce.as_str(), found.algorithm, found.counted, found.stale),
            ("n2", Algorithm::Sha256, true, false)
        );
        let first = one(both.split(", Digest realm=\"c\"").next().unwrap());
        assert_eq!((first.realm.as_str(), first.stale, first.counted), ("a \"b\"", true, false));
        assert!(one("Digest realm=r, nonce=n, algorithm=MD5-sess, qop=auth").session);
        for none in [
            "",
            "Basic realm=\"x\"",
            "Digest",
            "Digest realm=\"r\"",
            "Digest nonce=\"n\"",
            "Digest realm=r, nonce=n, algorithm=SHA-512-256",
            "Digest realm=r, nonce=n, qop=\"auth-int\"",
            "Digest realm=\"r, nonce=n",
            "===,,,\"\"\\",
        ] {
            assert_eq!(Challenge::strongest([none].into_iter()), None, "{none}");
        }
        // What a server says cannot break out of the answer's quotes.
        let evil = one("Digest realm=\"a\\\" , x=\\\"\", nonce=n");
        let answer = evil.answer(&mufasa(), "GET", "/", 1, "c");
        assert!(answer.contains("realm=\"a\\\" , x=\\\"\""), "{answer}");
    }

    #[test]
    fn nonces_differ() {
        let all: std::collections::BTreeSet<_> = (0..100).map(|_| nonce()).collect();
        assert_eq!(all.len(), 100);
    }

    #[test]
    fn fuzz_challenges() {
        use rand_chacha::ChaCha8Rng;
        use rand_core::{Rng, SeedableRng};
        let pieces = [
            "Digest",
            " ",
            ",",
            "=",
            "\"",
            "\\",
            "realm",
            "nonce",
            "qop",
            "auth",
            "algorithm",
            "MD5",
            "SHA-256",
            "ä",
            "\t",
            "Basic",
            "stale=true",
            "x",
        ];
        let inputs = crate::fuzz::fuzz_inputs();
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut answered = 0;
        for _ in 0..inputs {
            let length = random.next_u32() % 20;
            let mut text =
                String::from(if random.next_u32().is_multiple_of(2) { "Digest realm=r,nonce=n," } else { "" });
            (0..length).for_each(|_| text.push_str(pieces[random.next_u32() as usize % pieces.len()]));
            if let Some(challenge) = Challenge::strongest([text.as_str()].into_iter()) {
                answered += 1;
                assert!(challenge.answer(&mufasa(), "POST", "/x", 1, "c").starts_with("Digest username="));
            }
        }
        assert!(answered > 0);
    }
}
