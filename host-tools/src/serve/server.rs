//! The page's server, for this machine alone.
//!
//! Whoever asks by another name than that of this machine is refused, and so is a page from elsewhere that wants
//! something done: a browser that has a foreign page open must not reach the recordings through it.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;

use axum::Router;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, Path, Query, Request, State};
use axum::http::{HeaderMap, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};

use super::error::{Error, Result};
use super::page;
use super::session::Session;
use super::task::Task;
use crate::context::CancelFlag;
use crate::error;

/// Largest recording that the page takes.
const LARGEST: usize = 1 << 30;
/// How often it is looked whether the page is to end.
const LOOK: Duration = Duration::from_millis(100);
/// What the page may load: from this server alone.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; frame-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Serves a session until it is to stop; `listening` is told the address.
///
/// # Errors
/// A port that is taken.
pub async fn serve(
    session: Session,
    port: u16,
    stop: &CancelFlag,
    listening: impl FnOnce(SocketAddr) -> error::Result<()>,
) -> error::Result<()> {
    let refused = |e: std::io::Error| error::Error::usage(format!("port {port}: {e}"), "give another one with --port");
    let listener = tokio::net::TcpListener::bind((Ipv4Addr::LOCALHOST, port)).await.map_err(refused)?;
    let address = listener.local_addr().map_err(refused)?;
    listening(address)?;
    tokio::select! {
        done = axum::serve(listener, router(session, address.port())).into_future() => done.map_err(refused),
        () = until(stop) => Ok(()),
    }
}

async fn until(stop: &CancelFlag) {
    while !stop.is_cancelled() {
        tokio::time::sleep(LOOK).await;
    }
}

fn router(session: Session, port: u16) -> Router {
    Router::new()
        .route("/", get(|| async { as_page(page::page()) }))
        .route("/serve.js", get(|| async { as_file("text/javascript", page::SCRIPT) }))
        .route("/serve.css", get(|| async { as_file("text/css", page::STYLE) }))
        .route("/state", get(state))
        .route("/falling.svg", get(falling))
        .route("/report/{version}", get(report))
        .route("/model.toml", get(model_file))
        .route("/identify", post(|session: State<Session>| async move { begin(&session, Ok(Task::Identify)) }))
        .route("/diagnose", post(|session: State<Session>| async move { begin(&session, Ok(Task::Diagnose)) }))
        .route("/add", post(add))
        .route("/stop", post(|session: State<Session>| async move { answer(session.stop()) }))
        .route("/go", post(go))
        .route("/recordings", post(add_recording))
        .route("/remove", post(remove_recording))
        .layer(DefaultBodyLimit::max(LARGEST))
        .layer(middleware::from_fn(move |request: Request, next: Next| async move {
            match is_from_here(request.method(), request.headers(), port) {
                true => next.run(request).await,
                false => (StatusCode::FORBIDDEN, "only pages of this program are answered\n").into_response(),
            }
        }))
        .with_state(session)
}

/// Whether a request names this machine, and what it wants done comes from this server's own page or from no page.
fn is_from_here(method: &Method, headers: &HeaderMap, port: u16) -> bool {
    let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or_default());
    let names = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    let is_named = text(header::HOST).is_some_and(|host| names.iter().any(|name| name == host));
    let is_own = |origin: &str| origin.strip_prefix("http://").is_some_and(|host| names.iter().any(|n| n == host));
    is_named && (method == Method::GET || text(header::ORIGIN).is_none_or(is_own))
}

fn as_page(text: String) -> Response {
    let kind = (header::CONTENT_TYPE, "text/html; charset=utf-8");
    ([kind, (header::CONTENT_SECURITY_POLICY, POLICY)], text).into_response()
}

fn as_file(kind: &'static str, text: impl IntoResponse) -> Response {
    ([(header::CONTENT_TYPE, kind), (header::CACHE_CONTROL, "no-store")], text).into_response()
}

/// Nothing, or what is wrong in one line.
fn answer(done: Result<()>) -> Response {
    match done {
        Ok(()) => StatusCode::NO_CONTENT.into_response(),
        Err(error) => refusal(&error),
    }
}

/// The answer to what takes a while, without keeping others waiting.
async fn answered(work: impl FnOnce() -> Result<()> + Send + 'static) -> Response {
    match tokio::task::spawn_blocking(work).await {
        Ok(done) => answer(done),
        Err(_) => refusal(&Error::Panicked),
    }
}

fn refusal(error: &Error) -> Response {
    (error.status(), format!("{error}\n")).into_response()
}

fn begin(session: &Session, task: Result<Task>) -> Response {
    answer(task.and_then(|task| session.begin(task)))
}

async fn state(State(session): State<Session>) -> Response {
    as_file("application/json", session.as_json().to_string())
}

async fn falling(State(session): State<Session>) -> Response {
    as_file("image/svg+xml", session.error_falling())
}

async fn report(State(session): State<Session>, Path(version): Path<usize>) -> Response {
    let made = tokio::task::spawn_blocking(move || session.report(version)).await;
    match made {
        // It says itself what it may load.
        Ok(Ok(text)) => as_file("text/html; charset=utf-8", text),
        Ok(Err(error)) => refusal(&error),
        Err(_) => refusal(&Error::Panicked),
    }
}

async fn model_file(State(session): State<Session>) -> Response {
    match session.model_file() {
        Ok(text) => {
            let name = (header::CONTENT_DISPOSITION, "attachment; filename=\"model.toml\"");
            ([(header::CONTENT_TYPE, "application/toml"), name], text).into_response()
        }
        Err(error) => refusal(&error),
    }
}

type Named = Query<BTreeMap<String, String>>;

fn value<'q>(query: &'q Named, name: &'static str) -> Result<&'q str> {
    query.get(name).map(String::as_str).ok_or(Error::Missing(name))
}

async fn add(State(session): State<Session>, query: Named) -> Response {
    begin(&session, value(&query, "effect").and_then(Task::add))
}

async fn go(State(session): State<Session>, query: Named) -> Response {
    let number = |text: &str| text.parse().map_err(|_| Error::NoNumber(text.to_owned()));
    answer(value(&query, "version").and_then(number).and_then(|version| session.go_to(version)))
}

async fn remove_recording(State(session): State<Session>, query: Named) -> Response {
    let number = |text: &str| text.parse().map_err(|_| Error::NoNumber(text.to_owned()));
    let remove = move || value(&query, "recording").and_then(number).and_then(|place| session.remove_recording(place));
    answered(remove).await
}

async fn add_recording(State(session): State<Session>, query: Named, body: Bytes) -> Response {
    let add = move || value(&query, "name").and_then(|name| session.add_recording(name, &body));
    answered(add).await
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    #[test]
    fn whoever_is_not_of_this_machine_is_refused() {
        let asked = |method: Method, host: &'static str, origin: Option<&'static str>| {
            let mut headers = HeaderMap::new();
            headers.insert(header::HOST, HeaderValue::from_static(host));
            if let Some(origin) = origin {
                headers.insert(header::ORIGIN, HeaderValue::from_static(origin));
            }
            is_from_here(&method, &headers, 8470)
        };
        assert!(asked(Method::GET, "127.0.0.1:8470", None) && asked(Method::GET, "localhost:8470", None));
        assert!(asked(Method::POST, "127.0.0.1:8470", Some("http://127.0.0.1:8470")));
        assert!(asked(Method::POST, "127.0.0.1:8470", None), "a script of the user's");
        // A name that somebody has made point to this machine, and a foreign page.
        assert!(!asked(Method::GET, "rig.example:8470", None));
        assert!(!asked(Method::POST, "127.0.0.1:8470", Some("http://rig.example")));
        assert!(!asked(Method::POST, "127.0.0.1:8470", Some("null")));
        assert!(!is_from_here(&Method::GET, &HeaderMap::new(), 8470));
    }
}
