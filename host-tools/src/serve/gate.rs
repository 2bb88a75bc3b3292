//! Who may use the page: this machine's own browser that knows the project's token.
//!
//! Whoever asks by another name than that of this machine is refused, and so is every page from elsewhere, whatever it
//! asks for: a browser that has a foreign page open must not reach the recordings through it, neither by a name that
//! somebody made point here, nor by a form, nor by a picture. The token stands in the address that the command prints,
//! and is taken from there into a cookie that scripts cannot read and that no other site's request carries.

use axum::http::{HeaderMap, Method, Uri, header};

/// How scripts of the user's say the token.
const BEARER: &str = "Bearer ";

/// What is to be done with a request.
#[derive(Debug, PartialEq, Eq)]
pub enum Pass {
    /// It is answered.
    Granted,
    /// The token goes into a cookie: this header.
    Cookie(String),
    /// It is not answered, and why.
    Refused(&'static str),
}

/// The door of one server.
#[derive(Debug, Clone)]
pub struct Gate {
    port: u16,
    token: String,
}

/// Whether two texts are the same, in a time that does not tell where they differ.
fn is_same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |all, (a, b)| all | (a ^ b)) == 0
}

impl Gate {
    /// On a port, with a token.
    pub fn new(port: u16, token: &str) -> Self {
        Self { port, token: token.to_owned() }
    }

    /// The cookie's name: browsers do not tell ports apart.
    fn cookie(&self) -> String {
        format!("greyrig-{}", self.port)
    }

    /// What is to be done with a request.
    pub fn pass(&self, method: &Method, uri: &Uri, headers: &HeaderMap) -> Pass {
        let text = |name: header::HeaderName| headers.get(name).map(|value| value.to_str().unwrap_or_default());
        let names = [format!("127.0.0.1:{}", self.port), format!("localhost:{}", self.port)];
        if !text(header::HOST).is_some_and(|host| names.iter().any(|name| name == host)) {
            return Pass::Refused("only this machine is answered, by its own name");
        }
        let is_own = |origin: &str| origin.strip_prefix("http://").is_some_and(|host| names.iter().any(|n| n == host));
        if text(header::ORIGIN).is_some_and(|origin| !is_own(origin)) {
            return Pass::Refused("only pages of this program are answered");
        }
        let site = text(header::HeaderName::from_static("sec-fetch-site"));
        if site.is_some_and(|site| site != "same-origin" && site != "none") {
            return Pass::Refused("only pages of this program are answered");
        }
        let cookie = format!("{}={}", self.cookie(), self.token);
        let mut cookies =
            headers.get_all(header::COOKIE).iter().filter_map(|c| c.to_str().ok()).flat_map(|c| c.split(';'));
        let bearer = text(header::AUTHORIZATION).and_then(|all| all.strip_prefix(BEARER));
        let given = uri.query().and_then(|q| q.split('&').find_map(|part| part.strip_prefix("token=")));
        if method == Method::GET && uri.path() == "/" && given.is_some_and(|given| is_same(given, &self.token)) {
            return Pass::Cookie(format!("{cookie}; HttpOnly; SameSite=Strict; Path=/; Max-Age=31536000"));
        }
        if cookies.any(|c| is_same(c.trim(), &cookie)) || bearer.is_some_and(|given| is_same(given, &self.token)) {
            return Pass::Granted;
        }
        Pass::Refused("open the address that greyrig serve has printed, with its token")
    }
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    const TOKEN: &str = "abcdefghijklmnopqrstuvwxyz012345";

    fn asked(method: Method, uri: &'static str, headers: &[(&'static str, String)]) -> Pass {
        let mut all = HeaderMap::new();
        for (name, value) in headers {
            all.append(*name, HeaderValue::from_str(value).unwrap());
        }
        Gate::new(8470, TOKEN).pass(&method, &Uri::from_static(uri), &all)
    }

    fn host(name: &str) -> (&'static str, String) {
        ("host", name.to_owned())
    }

    fn known() -> (&'static str, String) {
        ("cookie", format!("theme=dark; greyrig-8470={TOKEN}"))
    }

    fn is_refused(pass: Pass) -> bool {
        matches!(pass, Pass::Refused(_))
    }

    #[test]
    fn the_token_becomes_a_cookie_of_this_port() {
        let uri = "/?token=abcdefghijklmnopqrstuvwxyz012345";
        let Pass::Cookie(cookie) = asked(Method::GET, uri, &[host("127.0.0.1:8470")]) else { panic!("no cookie") };
        for part in ["greyrig-8470=", "HttpOnly", "SameSite=Strict"] {
            assert!(cookie.contains(part), "{cookie}");
        }
        assert!(is_refused(asked(Method::GET, "/?token=abcdefghijklmnopqrstuvwxyz012346", &[host("127.0.0.1:8470")])));
        assert!(is_refused(asked(Method::POST, uri, &[host("127.0.0.1:8470")])), "a form cannot bring it");
    }

    #[test]
    fn without_token_nothing_is_answered() {
        for uri in ["/", "/state", "/serve.js", "/signal/1/i_a"] {
            assert!(is_refused(asked(Method::GET, uri, &[host("127.0.0.1:8470")])), "{uri}");
            assert_eq!(asked(Method::GET, uri, &[host("localhost:8470"), known()]), Pass::Granted, "{uri}");
        }
        let other = ("cookie", format!("greyrig-8471={TOKEN}"));
        assert!(is_refused(asked(Method::GET, "/state", &[host("127.0.0.1:8470"), other])), "another port's");
        let bearer = ("authorization", format!("Bearer {TOKEN}"));
        assert_eq!(
            asked(Method::POST, "/stop", &[host("127.0.0.1:8470"), bearer]),
            Pass::Granted,
            "a script of the user's"
        );
    }

    #[test]
    fn another_name_of_this_machine_is_refused() {
        for name in ["rig.example:8470", "127.0.0.1:80", "127.0.0.1", "0.0.0.0:8470", ""] {
            assert!(is_refused(asked(Method::GET, "/state", &[host(name), known()])), "{name}");
        }
        assert!(is_refused(asked(Method::GET, "/state", &[known()])));
    }

    #[test]
    fn a_page_from_elsewhere_is_refused_whatever_it_asks() {
        for method in [Method::GET, Method::POST] {
            for origin in ["http://rig.example", "null", "https://127.0.0.1:8470", "http://127.0.0.1:8471"] {
                let headers = [host("127.0.0.1:8470"), known(), ("origin", origin.to_owned())];
                assert!(is_refused(asked(method.clone(), "/state", &headers)), "{origin}");
            }
            for site in ["cross-site", "same-site"] {
                let headers = [host("127.0.0.1:8470"), known(), ("sec-fetch-site", site.to_owned())];
                assert!(is_refused(asked(method.clone(), "/state", &headers)), "{site}");
            }
            let own = [host("127.0.0.1:8470"), known(), ("origin", "http://127.0.0.1:8470".to_owned())];
            assert_eq!(asked(method.clone(), "/state", &own), Pass::Granted);
        }
    }
}
