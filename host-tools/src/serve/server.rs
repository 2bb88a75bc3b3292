//! The page's server, for this machine alone: [`super::gate`] says whom it answers.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::{DefaultBodyLimit, Path, Query, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use futures_util::{Stream, StreamExt, stream};
use greyrig::effects::EffectId;
use tempfile::NamedTempFile;

use super::api::{Changed, Role};
use super::connections;
use super::curves::Of;
use super::error::{Error, Result};
use super::gate::{Gate, Pass};
use super::page;
use super::plane::Plane;
use super::planning::Wanted;
use super::session::{Expected, Over, Session, Stretch};
use super::simulated::Kind;
use super::task::{Added, Task, Training};
use crate::compare::Signal;
use crate::context::CancelFlag;
use crate::error;
use crate::model::Model;
use crate::plan::Limits;
use crate::recording::Channel;
use crate::term::Formula;

/// Largest recording that the page takes, bytes.
const LARGEST: u64 = 1 << 30;
/// Largest model file, bytes.
const LARGEST_MODEL: u64 = 1 << 24;
/// How long a sender may pause.
const PATIENCE: Duration = Duration::from_secs(30);
/// How often it is looked whether the page is to end.
const LOOK: Duration = Duration::from_millis(100);
/// Time between two events at least.
const CALM: Duration = Duration::from_millis(100);
/// What the page may load: from this server alone.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
/// What a report may do: it brings its own scripts, and has no access to this server.
const SANDBOX: &str = "sandbox allow-scripts allow-downloads; frame-ancestors 'none'";

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
        never = connections::answer(listener, router(session, address.port())) => match never {},
        () = until(stop) => Ok(()),
    }
}

async fn until(stop: &CancelFlag) {
    while !stop.is_cancelled() {
        tokio::time::sleep(LOOK).await;
    }
}

fn router(session: Session, port: u16) -> Router {
    let gate = Gate::new(port, session.token());
    Router::new()
        .route("/", get(|| async { as_file("text/html; charset=utf-8", page::page()) }))
        .route("/serve.js", get(|| async { as_file("text/javascript; charset=utf-8", page::SCRIPT) }))
        .route("/serve.css", get(|| async { as_file("text/css; charset=utf-8", page::STYLE) }))
        .route("/state", get(|session: State<Session>| async move { json(&session.told()) }))
        .route("/events", get(events))
        .route("/signal/{recording}/{channel}", get(signal))
        .route("/spectrum/{recording}/{channel}", get(spectrum))
        .route("/correlations/{recording}/{channel}", get(correlations))
        .route("/planes/{recording}", get(planes))
        .route("/map/{version}/{plane}/{signal}", get(map))
        .route("/instants/{version}/{plane}/{recording}", get(instants))
        .route("/cells/{version}/{plane}/{recording}", get(cells))
        .route("/report/{version}", get(report))
        .route("/model/{version}", get(model_file))
        .route("/term", get(term))
        .route("/identify", post(|session, headers| begin(session, headers, Ok(Task::Identify))))
        .route("/diagnose", post(|session, headers| begin(session, headers, Ok(Task::Diagnose))))
        .route("/add", post(add))
        .route("/models", post(open_model))
        .route("/train", post(begin_training))
        .route("/correction/{version}", get(correction))
        .route("/plan", post(begin_plan))
        .route("/challenge", post(begin_challenge))
        .route("/station", post(set_station))
        .route("/calibrate", post(begin_calibration))
        .route("/judge", post(begin_to_judge))
        .route("/judged", get(judged))
        .route("/proposed/{version}/{profile}", get(proposed))
        .route("/profile/{version}/{profile}", get(profile_file))
        .route("/stop", post(|session: State<Session>| async move { answer(session.stop()) }))
        .route("/tour", post(tour))
        .route("/go", post(go))
        .route("/forget", post(remove_version))
        .route("/note", post(write_note))
        .route("/recordings", post(add_recording))
        .route("/remove", post(remove_recording))
        .route("/role", post(set_role))
        .route("/remap", post(map_recording))
        .layer(DefaultBodyLimit::disable())
        .layer(middleware::from_fn(move |request: Request, next: Next| guarded(gate.clone(), request, next)))
        .with_state(session)
}

/// Lets a request pass or not, and says what browsers may do with the answer.
async fn guarded(gate: Gate, request: Request, next: Next) -> Response {
    let mut response = match gate.pass(request.method(), request.uri(), request.headers()) {
        Pass::Granted => next.run(request).await,
        Pass::Cookie(cookie) => {
            // The token does not stay in the address bar, nor in the history.
            (StatusCode::SEE_OTHER, [(header::LOCATION, "/".to_owned()), (header::SET_COOKIE, cookie)]).into_response()
        }
        Pass::Refused(why) => (StatusCode::FORBIDDEN, format!("{why}\n")).into_response(),
    };
    let headers = response.headers_mut();
    let mut say = |name: HeaderName, value| {
        headers.entry(name).or_insert(HeaderValue::from_static(value));
    };
    say(header::CONTENT_SECURITY_POLICY, POLICY);
    say(header::X_CONTENT_TYPE_OPTIONS, "nosniff");
    say(header::X_FRAME_OPTIONS, "DENY");
    say(header::REFERRER_POLICY, "no-referrer");
    say(header::CACHE_CONTROL, "no-store");
    say(HeaderName::from_static("cross-origin-resource-policy"), "same-origin");
    say(HeaderName::from_static("cross-origin-opener-policy"), "same-origin");
    response
}

fn as_file(kind: &'static str, text: impl IntoResponse) -> Response {
    ([(header::CONTENT_TYPE, kind)], text).into_response()
}

fn json(said: &impl serde::Serialize) -> Response {
    match serde_json::to_vec(said) {
        Ok(bytes) => as_file("application/json", bytes),
        Err(_) => refusal(&Error::Panicked),
    }
}

/// The revision after a change, or what is wrong in one line.
fn answer(done: Result<u32>) -> Response {
    match done {
        Ok(revision) => json(&Changed { revision }),
        Err(error) => refusal(&error),
    }
}

fn refusal(error: &Error) -> Response {
    (error.status(), format!("{error}\n")).into_response()
}

/// What takes a while, without keeping others waiting.
async fn aside<T: Send + 'static>(work: impl FnOnce() -> Result<T> + Send + 'static) -> Result<T> {
    tokio::task::spawn_blocking(work).await.unwrap_or(Err(Error::Panicked))
}

async fn as_json<T: serde::Serialize + Send + 'static>(work: impl FnOnce() -> Result<T> + Send + 'static) -> Response {
    match aside(work).await {
        Ok(said) => json(&said),
        Err(error) => refusal(&error),
    }
}

type Named = Query<BTreeMap<String, String>>;

fn value<'q>(query: &'q Named, name: &'static str) -> Result<&'q str> {
    query.get(name).map(String::as_str).ok_or(Error::Missing(name))
}

fn parsed<T: std::str::FromStr>(text: &str) -> Result<T> {
    text.parse().map_err(|_| Error::Unknown(text.to_owned()))
}

fn number<T: std::str::FromStr>(query: &Named, name: &'static str) -> Result<T> {
    value(query, name).and_then(parsed)
}

/// Two times, s.
fn times(query: &Named) -> Result<[f64; 2]> {
    let range: [f64; 2] = [number(query, "from")?, number(query, "to")?];
    match range.iter().all(|t| t.is_finite()) {
        true => Ok(range),
        false => Err(Error::Unknown(format!("{range:?}"))),
    }
}

/// The revision that a change rests on: `If-Match: "7"`, or `*` for any.
fn expected(headers: &HeaderMap) -> Result<Expected> {
    let text = headers.get(header::IF_MATCH).and_then(|v| v.to_str().ok()).ok_or(Error::NoRevision)?;
    match text.trim_matches('"') {
        "*" => Ok(Expected(None)),
        revision => parsed(revision).map(|revision| Expected(Some(revision))),
    }
}

async fn begin(State(session): State<Session>, headers: HeaderMap, task: Result<Task>) -> Response {
    answer(expected(&headers).and_then(|expected| session.begin(expected, task?)))
}

async fn add(session: State<Session>, query: Named, headers: HeaderMap) -> Response {
    let text = |name: &str| query.get(name).map(String::as_str);
    let added = Added::parse(text("effect"), text("term")).map(Task::Add);
    begin(session, headers, added).await
}

/// Whether a formula can be read: nothing, or what is wrong.
async fn term(query: Named) -> Response {
    as_json(move || match value(&query, "formula")?.parse::<Formula>() {
        Ok(_) => Ok(None),
        Err(error) => Ok(Some(error.to_string())),
    })
    .await
}

async fn tour(State(session): State<Session>, query: Named, headers: HeaderMap) -> Response {
    let run = move || session.tour(expected(&headers)?, number(&query, "seed")?);
    answer(aside(run).await)
}

async fn go(State(session): State<Session>, query: Named, headers: HeaderMap) -> Response {
    answer(expected(&headers).and_then(|expected| session.go_to(expected, number(&query, "version")?)))
}

async fn remove_version(State(session): State<Session>, query: Named, headers: HeaderMap) -> Response {
    answer(expected(&headers).and_then(|expected| session.remove_version(expected, number(&query, "version")?)))
}

async fn write_note(State(session): State<Session>, query: Named, headers: HeaderMap) -> Response {
    let write = || session.write_note(expected(&headers)?, number(&query, "version")?, value(&query, "text")?);
    answer(write())
}

async fn remove_recording(State(session): State<Session>, query: Named, headers: HeaderMap) -> Response {
    answer(aside(move || session.remove_recording(expected(&headers)?, number(&query, "recording")?)).await)
}

async fn set_role(State(session): State<Session>, query: Named, headers: HeaderMap) -> Response {
    let role = |text: &str| match text {
        "fit" => Ok(Role::Fit),
        "judge" => Ok(Role::Judge),
        "off" => Ok(Role::Off),
        other => Err(Error::Unknown(other.to_owned())),
    };
    let set =
        move || session.set_role(expected(&headers)?, number(&query, "recording")?, role(value(&query, "role")?)?);
    answer(aside(set).await)
}

async fn map_recording(State(session): State<Session>, query: Named, headers: HeaderMap) -> Response {
    let again = move || {
        let rules = shlex::split(value(&query, "map")?).ok_or_else(|| Error::Unknown("map".to_owned()))?;
        session.map_recording(expected(&headers)?, number(&query, "recording")?, rules)
    };
    answer(aside(again).await)
}

/// Takes what is sent into a file, of a size that it may have.
async fn received(mut file: NamedTempFile, body: Body, largest: u64) -> Result<NamedTempFile> {
    let mut parts = body.into_data_stream();
    let mut size = 0;
    loop {
        let part = tokio::time::timeout(PATIENCE, parts.next()).await.map_err(|_| Error::TooSlow)?;
        let Some(part) = part else { return Ok(file) };
        let part = part.map_err(|_| Error::TooSlow)?;
        size += part.len() as u64;
        if size > largest {
            return Err(Error::TooLarge(largest));
        }
        let path = file.path().to_owned();
        file.write_all(&part).map_err(|e| error::Error::io(path, e))?;
    }
}

async fn add_recording(State(session): State<Session>, query: Named, headers: HeaderMap, body: Body) -> Response {
    let ready = || {
        expected(&headers)?;
        Ok((value(&query, "name")?.to_owned(), session.receive()?))
    };
    let (name, file) = match ready() {
        Ok(ready) => ready,
        Err(error) => return refusal(&error),
    };
    match received(file, body, LARGEST).await {
        Ok(file) => answer(aside(move || session.add_recording(&name, file)).await),
        Err(error) => refusal(&error),
    }
}

async fn begin_training(session: State<Session>, query: Named, headers: HeaderMap) -> Response {
    let training = || {
        let blanking_s: f64 = number(&query, "blanking")?;
        match blanking_s >= 0.0 && blanking_s.is_finite() {
            true => Ok(Task::Train(Training { epochs: number(&query, "epochs")?, blanking_s })),
            false => Err(Error::Unknown("blanking".to_owned())),
        }
    };
    let task = training();
    begin(session, headers, task).await
}

async fn correction(State(session): State<Session>, Path(version): Path<u32>) -> Response {
    match aside(move || session.correction(version)).await {
        Ok(text) => as_file("application/json", text),
        Err(error) => refusal(&error),
    }
}

async fn begin_plan(session: State<Session>, query: Named, headers: HeaderMap) -> Response {
    let wanted = || {
        let positive = |x: f64| (x > 0.0 && x.is_finite()).then_some(x);
        let limit = |name| positive(number(&query, name)?).ok_or_else(|| Error::Unknown(name.to_owned()));
        let limits = Limits { voltage_v: limit("volts")?, current_a: limit("amperes")? };
        let rivals = effects(value(&query, "rivals")?)?;
        Ok(Task::Plan(Wanted { rivals, seconds: limit("seconds")?, limits }))
    };
    let task = wanted();
    begin(session, headers, task).await
}

async fn begin_challenge(session: State<Session>, query: Named, headers: HeaderMap) -> Response {
    let task = value(&query, "effects").and_then(effects).map(Task::Challenge);
    begin(session, headers, task).await
}

/// Effects, with commas between them.
fn effects(names: &str) -> Result<Vec<EffectId>> {
    let names = names.split(',').map(str::trim).filter(|name| !name.is_empty());
    names.map(|name| name.parse().map_err(|_| Error::NoEffect(name.to_owned()))).collect()
}

/// Numbers of recordings, with commas between them.
fn numbers(query: &Named) -> Result<Vec<u32>> {
    value(query, "recordings")?.split(',').filter(|text| !text.is_empty()).map(parsed).collect()
}

async fn begin_calibration(session: State<Session>, query: Named, headers: HeaderMap) -> Response {
    let task = numbers(&query).map(Task::Calibrate);
    begin(session, headers, task).await
}

async fn begin_to_judge(State(session): State<Session>, query: Named, headers: HeaderMap) -> Response {
    answer(expected(&headers).and_then(|expected| session.begin_to_judge(expected, numbers(&query)?)))
}

async fn set_station(State(session): State<Session>, query: Named, headers: HeaderMap, body: Body) -> Response {
    let ready = || Ok((expected(&headers)?, value(&query, "name")?.to_owned(), session.receive()?));
    let (expected, name, file) = match ready() {
        Ok(ready) => ready,
        Err(error) => return refusal(&error),
    };
    match received(file, body, LARGEST_MODEL).await {
        Ok(file) => answer(aside(move || session.set_station(expected, &name, &file)).await),
        Err(error) => refusal(&error),
    }
}

async fn judged(State(session): State<Session>) -> Response {
    match session.judged() {
        Ok(judged) => json(&*judged),
        Err(error) => refusal(&error),
    }
}

/// `seconds`: length; `from`, `to`, `px` as for a signal.
async fn proposed(
    State(session): State<Session>,
    Path((version, profile)): Path<(u32, String)>,
    query: Named,
) -> Response {
    let window = move || {
        let [from_s, to_s] = times(&query)?;
        let curve = session.proposed(version, &profile, number(&query, "seconds")?)?;
        Ok(curve.window(from_s, to_s, number(&query, "px")?).bytes())
    };
    match aside(window).await {
        Ok(bytes) => as_file("application/octet-stream", bytes),
        Err(error) => refusal(&error),
    }
}

/// The profile as a table of volts over seconds.
async fn profile_file(
    State(session): State<Session>,
    Path((version, profile)): Path<(u32, String)>,
    query: Named,
) -> Response {
    let table = move || {
        use std::fmt::Write;
        let curve = session.proposed(version, &profile, number(&query, "seconds")?)?;
        let mut text = "t_s,u_v\n".to_owned();
        for (n, u) in curve.pyramid.samples().iter().enumerate() {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{:.4},{u}", n as f64 * curve.step_s);
        }
        Ok(text)
    };
    match aside(table).await {
        Ok(text) => {
            let name = (header::CONTENT_DISPOSITION, "attachment; filename=\"profile.csv\"");
            ([(header::CONTENT_TYPE, "text/csv"), name], text).into_response()
        }
        Err(error) => refusal(&error),
    }
}

async fn open_model(session: State<Session>, query: Named, headers: HeaderMap, body: Body) -> Response {
    let name = match value(&query, "name") {
        Ok(name) => name.to_owned(),
        Err(error) => return refusal(&error),
    };
    let file = match session.receive() {
        Ok(file) => file,
        Err(error) => return refusal(&error),
    };
    let read = received(file, body, LARGEST_MODEL).await.and_then(|file| {
        Model::load(file.path()).map(|model| Task::Open(name.clone(), Box::new(model))).map_err(|error| match error {
            error::Error::Input { mut place, what, remedy } => {
                place.path = name.into();
                Error::Work(error::Error::Input { place, what, remedy })
            }
            other => Error::Work(other),
        })
    });
    begin(session, headers, read).await
}

/// What the state shows changes, and how far a task is.
fn told(session: Session) -> impl Stream<Item = std::result::Result<Event, Infallible>> {
    let changes = session.watch();
    stream::unfold((session, changes, true), |(session, mut changes, is_first)| async move {
        if !is_first {
            changes.changed().await.ok()?;
            tokio::time::sleep(CALM).await;
        }
        changes.borrow_and_update();
        let text = serde_json::to_string(&session.tick()).ok()?;
        Some((Ok(Event::default().data(text)), (session, changes, false)))
    })
}

async fn events(State(session): State<Session>) -> Response {
    Sse::new(told(session)).keep_alive(KeepAlive::default()).into_response()
}

fn channel(column: &str) -> Result<Channel> {
    Channel::ALL.into_iter().find(|c| c.column() == column).ok_or(Error::NoSignal)
}

/// Which curve of a signal, and of which model.
fn curve_of(query: &Named) -> Result<(Kind, Option<Of>)> {
    let curve = match query.get("of").map(String::as_str) {
        None | Some("raw") => Kind::Raw,
        Some("measured") => Kind::Measured,
        Some("modelled") => Kind::Modelled,
        Some("residual") => Kind::Residual,
        Some(other) => return Err(Error::Unknown(other.to_owned())),
    };
    let of = match (query.get("version"), query.get("candidate")) {
        (None, _) => None,
        (Some(version), None) => Some(Of::Version(parsed(version)?)),
        (Some(version), Some(effect)) => Some(Of::Candidate(parsed(version)?, parsed(effect)?)),
    };
    Ok((curve, of))
}

/// `from`, `to`, `of`, `version`, `candidate` as for a signal; `over`: `frequency` or `order`.
async fn spectrum(
    State(session): State<Session>,
    Path((recording, column)): Path<(u32, String)>,
    query: Named,
) -> Response {
    as_json(move || {
        let over = match value(&query, "over")? {
            "frequency" => Over::Frequency,
            "order" => Over::Order,
            other => return Err(Error::Unknown(other.to_owned())),
        };
        let (curve, of) = curve_of(&query)?;
        session.spectrum(recording, channel(&column)?, curve, of, over, times(&query)?)
    })
    .await
}

/// `from`, `to`, `version`.
async fn planes(State(session): State<Session>, Path(recording): Path<u32>, query: Named) -> Response {
    as_json(move || session.planes(recording, number(&query, "version")?, times(&query)?)).await
}

/// `from`, `to`, `version`.
async fn correlations(
    State(session): State<Session>,
    Path((recording, column)): Path<(u32, String)>,
    query: Named,
) -> Response {
    as_json(move || session.correlations(recording, channel(&column)?, number(&query, "version")?, times(&query)?))
        .await
}

/// `from`, `to`: times, s; `px`: stretches at most; `of`: `raw`, `measured`, `modelled` or `residual`; `version`, and
/// `candidate`: an effect that its diagnosis has tried; `rms`: a period, s, over which the RMS is wanted.
async fn signal(
    State(session): State<Session>,
    Path((recording, channel)): Path<(u32, String)>,
    query: Named,
) -> Response {
    let window = move || {
        let (channel, (curve, of)) = (self::channel(&channel)?, curve_of(&query)?);
        let rms_s = query.get("rms").map(|text| parsed::<f64>(text)).transpose()?;
        let stretch = Stretch { range_s: times(&query)?, parts: number(&query, "px")?, rms_s };
        Ok(session.window(recording, channel, curve, of, stretch)?.bytes())
    };
    match aside(window).await {
        Ok(bytes) => as_file("application/octet-stream", bytes),
        Err(error) => refusal(&error),
    }
}

fn plane(name: &str) -> Result<Plane> {
    Plane::of(name).ok_or_else(|| Error::Unknown(name.to_owned()))
}

async fn map(
    State(session): State<Session>,
    Path((version, plane_name, signal)): Path<(u32, String, String)>,
) -> Response {
    let signal = match &signal[..] {
        "current" => Signal::Current,
        "speed" => Signal::Speed,
        _ => return refusal(&Error::Unknown(signal)),
    };
    as_json(move || session.map(version, plane(&plane_name)?, signal)).await
}

async fn instants(
    State(session): State<Session>,
    Path((version, plane_name, recording)): Path<(u32, String, u32)>,
    query: Named,
) -> Response {
    as_json(move || {
        let cells = value(&query, "cells")?.split(',').map(parsed).collect::<Result<Vec<usize>>>()?;
        session.instants(version, plane(&plane_name)?, recording, &cells)
    })
    .await
}

async fn cells(
    State(session): State<Session>,
    Path((version, plane_name, recording)): Path<(u32, String, u32)>,
    query: Named,
) -> Response {
    as_json(move || session.cells(version, plane(&plane_name)?, recording, times(&query)?)).await
}

async fn report(State(session): State<Session>, Path(version): Path<u32>) -> Response {
    match aside(move || session.report(version)).await {
        Ok(text) => {
            let kind = (header::CONTENT_TYPE, "text/html; charset=utf-8");
            ([kind, (header::CONTENT_SECURITY_POLICY, SANDBOX)], text).into_response()
        }
        Err(error) => refusal(&error),
    }
}

async fn model_file(State(session): State<Session>, Path(version): Path<u32>) -> Response {
    match session.model_file(version) {
        Ok(text) => {
            let name = (header::CONTENT_DISPOSITION, "attachment; filename=\"model.toml\"");
            ([(header::CONTENT_TYPE, "application/toml"), name], text).into_response()
        }
        Err(error) => refusal(&error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn what_is_too_large_is_refused_while_it_arrives() {
        let sent = |size: usize| received(NamedTempFile::new().unwrap(), Body::from(vec![b'1'; size]), 100);
        let file = sent(100).await.unwrap();
        assert_eq!(file.as_file().metadata().unwrap().len(), 100);
        let path = file.path().to_owned();
        drop(file);
        assert!(!path.exists(), "what is not kept is gone");
        assert!(matches!(sent(101).await, Err(Error::TooLarge(100))));
    }
}
