//! The workbench in a real browser, as its user goes through it; and who is not let in.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use fantoccini::actions::PointerAction;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::browser::Browser;

/// `greyrig serve`; ends with the test.
struct Server {
    process: Child,
    url: String,
}

impl Server {
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        Self::start_on(folder, "0", arguments)
    }

    fn start_on(folder: &Path, port: &str, arguments: &[&str]) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_greyrig"))
            .env("COLUMNS", crate::program::WIDE)
            .current_dir(folder)
            .env("XDG_STATE_HOME", folder.join("state"))
            .args(["serve", "--port", port, "--json"])
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .expect("greyrig runs");
        let mut line = String::new();
        BufReader::new(process.stdout.take().expect("piped")).read_line(&mut line).expect("a line");
        let said: Value = serde_json::from_str(&line).expect("JSON");
        Self { process, url: said["url"].as_str().expect("an address").to_owned() }
    }

    fn address(&self) -> &str {
        self.url.strip_prefix("http://").and_then(|rest| rest.split('/').next()).expect("an address")
    }

    fn token(&self) -> &str {
        self.url.split("token=").nth(1).expect("a token")
    }

    /// What it answers to a request line and headers, without those that are always there.
    fn ask(&self, request: &str, headers: &[&str]) -> String {
        let mut connection = TcpStream::connect(self.address()).expect("it listens");
        connection.set_read_timeout(Some(Duration::from_secs(30))).expect("a limit");
        let headers: String = headers.iter().map(|h| format!("{h}\r\n")).collect();
        write!(connection, "{request} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n").expect("it is sent");
        let mut answer = Vec::new();
        connection.read_to_end(&mut answer).expect("an answer");
        String::from_utf8_lossy(&answer).into_owned()
    }

    /// Ends it as Ctrl-C does.
    fn interrupt(mut self) -> i32 {
        let id = self.process.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill").success());
        self.process.wait().expect("it ends").code().expect("by itself")
    }

    /// Ends it as a power cut does.
    fn kill(mut self) {
        self.process.kill().expect("it is killed");
        self.process.wait().expect("it has ended");
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn simulate(folder: &Path, profile: &str, seconds: &str, out: &str) {
    let run = ["simulate", "--profile", profile, "--seconds", seconds, "--seed", "1", "--effect", "saturation=0.35"];
    let done = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", crate::program::WIDE)
        .current_dir(folder)
        .args(run)
        .args(["--out", out])
        .output()
        .expect("greyrig runs");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

/// A folder with a staircase and a ramp of one motor that hides saturation.
fn recorded() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    simulate(folder.path(), "staircase", "8", "staircase.csv");
    simulate(folder.path(), "ramp", "6", "ramp.csv");
    folder
}

/// Waits for what may take a fit or two beside other tests.
async fn wait_for(browser: &Browser, script: &str) {
    let end = Instant::now() + Duration::from_secs(120);
    while browser.run(script).await != Value::Bool(true) {
        assert!(Instant::now() < end, "{script}: {}", browser.run("return document.body.innerText").await);
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Waits until the page tells an error that begins so.
async fn wait_for_error(browser: &Browser, beginning: &str) {
    let script = format!("return document.querySelector('#error').textContent.startsWith({beginning:?})");
    wait_for(browser, &script).await;
}

/// So many versions, of which this one (from 0) is the present one, and nothing is being done.
fn versions(count: usize, present: usize) -> String {
    format!(
        "const rows = [...document.querySelectorAll('#versions li')]; return rows.length === {count} \
         && rows.findIndex(r => r.classList.contains('chosen')) === {present} && document.querySelector('#job').textContent === ''"
    )
}

/// The page's parts are drawn.
const DRAWN: &str = "return document.querySelectorAll('#panes canvas').length >= 3 \
    && [...document.querySelectorAll('.plot')].every(p => p.dataset.from !== undefined)";

/// Gives the page files, as the dialogue for files does.
async fn give(browser: &Browser, name: &str, text: &str) {
    give_to(browser, "#files", name, text).await;
}

async fn give_to(browser: &Browser, field: &str, name: &str, text: &str) {
    let script = format!(
        "const all = new DataTransfer(), input = document.querySelector({field:?}); \
         all.items.add(new File([{text:?}], {name:?})); input.files = all.files; \
         input.dispatchEvent(new Event('change', {{ bubbles: true }})); return true"
    );
    browser.run(&script).await;
}

/// Types into a field of a form, as its user does.
async fn type_into(browser: &Browser, field: &str, text: &str) {
    let script = format!(
        "const field = document.querySelector({field:?}); field.value = {text:?}; \
         for (const kind of ['input', 'change']) field.dispatchEvent(new Event(kind, {{ bubbles: true }})); return true"
    );
    browser.run(&script).await;
}

/// What a command prints.
fn printed(folder: &Path, arguments: &[&str]) -> String {
    let done = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", crate::program::WIDE)
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("greyrig runs");
    String::from_utf8(done.stdout).expect("UTF-8")
}

fn percent(version: usize, signal: &str) -> String {
    format!(
        "const row = document.querySelectorAll('#versions li')[{version}]; \
         return parseFloat(row.querySelector('[data-signal={signal}]').textContent.split(' ')[1])"
    )
}

async fn drag(browser: &Browser, selector: &str, from: f64, to: f64) {
    let ((x1, y), (x2, _)) = (browser.point(selector, from, 0.5).await, browser.point(selector, to, 0.5).await);
    let still = Some(Duration::from_millis(10));
    let to = |x: i64| PointerAction::MoveTo { duration: still, x: x as f64, y: y as f64 };
    let (press, release) = (PointerAction::Down { button: 0 }, PointerAction::Up { button: 0 });
    browser.mouse(vec![to(x1), press, to((x1 + x2) / 2), to(x2), release]).await;
}

async fn hover(browser: &Browser, selector: &str) {
    let (x, y) = browser.point(selector, 0.5, 0.5).await;
    let to = |x: i64| PointerAction::MoveTo { duration: Some(Duration::from_millis(10)), x: x as f64, y: y as f64 };
    browser.mouse(vec![to(x - 1), to(x)]).await;
}

const RANGE: &str =
    "const p = document.querySelector('[data-pane=i_a] .plot').dataset; return [Number(p.from), Number(p.to)]";

#[tokio::test]
async fn a_user_finds_what_is_missing_adds_it_and_sees_the_error_fall() {
    let folder = recorded();
    let server = Server::start(folder.path(), &["staircase.csv", "ramp.csv"]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");

    wait_for(&browser, "return document.querySelectorAll('#recordings li').length === 2").await;
    assert_eq!(browser.run("return location.search").await, "", "the token does not stay in the address");
    assert_eq!(browser.run("return document.cookie").await, "", "scripts do not see the cookie");
    assert_eq!(browser.run("return document.querySelector('#diagnose').disabled").await, true, "there is no model");
    browser.click("#identify").await;
    wait_for(&browser, &versions(1, 0)).await;
    // It takes seconds, in which one may think better of it.
    browser.click("#diagnose").await;
    let stop = "const stop = document.querySelector('#stop'); if (!stop) return false; stop.click(); return true";
    wait_for(&browser, stop).await;
    wait_for_error(&browser, "stopped").await;
    browser.click("#diagnose").await;
    wait_for(&browser, "return document.querySelector('#odds') !== null").await;
    assert_eq!(browser.text("#verdict-title").await, "missing: saturation (or armature_reaction)");
    let odds = browser.text("#odds").await;
    assert!(odds.starts_with("Odds ") && odds.ends_with(" to 1"), "{odds}");
    let class = "return [...document.querySelectorAll('.class .candidate')].map(c => c.dataset.effect)";
    assert_eq!(browser.run(class).await, json!(["saturation", "armature_reaction"]), "they are bracketed");
    let command = browser.text("#command").await;
    assert!(command.starts_with("greyrig diagnose staircase.csv ramp.csv --model "), "{command}");

    // A part of the time, in all panes.
    drag(&browser, "[data-pane=i_a] .u-over", 0.4, 0.6).await;
    let zoomed = "const p = document.querySelector('[data-pane=i_a] .plot').dataset; return p.from > 1 && p.to < 5";
    wait_for(&browser, zoomed).await;
    let range = browser.run(RANGE).await;
    let once = "return [...document.querySelectorAll('.plot')].every(p => p.querySelectorAll('.uplot').length === 1)";
    assert_eq!(
        browser.run(once).await,
        true,
        "each pane is drawn once, though there are more of them than before the model"
    );
    let (from, to) = (range[0].as_f64().expect("a number"), range[1].as_f64().expect("a number"));
    // A pixel of the plot is some 10 ms.
    assert!((from - 2.4).abs() < 0.05 && (to - 3.6).abs() < 0.05, "{from} … {to}");
    // A candidate under the pointer is a curve more.
    wait_for(&browser, "return document.querySelector('[data-effect=saturation]').dataset.ready === 'true'").await;
    hover(&browser, "[data-effect=saturation]").await;
    wait_for(
        &browser,
        "return document.querySelector('[data-pane=i_a] .plot').dataset.lines.includes('with saturation')",
    )
    .await;
    assert!(browser.text("#command").await.starts_with("greyrig add saturation --model "));
    browser.screenshot("serve-verdict.png").await;

    browser.click("#add-named").await;
    wait_for(&browser, &versions(2, 1)).await;
    let (before, after) = (browser.number(&percent(0, "current")).await, browser.number(&percent(1, "current")).await);
    // Saturation is all that is missing: what is left is near the noise, a fiftieth of what there was.
    assert!(before > 10.0 && after < before / 50.0, "{before} % to {after} %");
    assert_eq!(browser.run(RANGE).await, range, "the zoom is kept");
    wait_for(
        &browser,
        "return document.querySelector('[data-pane=i_a] .plot').dataset.lines.includes('before: base model')",
    )
    .await;
    let command = browser.text("#command").await;
    assert!(command.starts_with("greyrig add saturation --model ") && command.contains(" --out "), "{command}");
    browser.screenshot("serve-added.png").await;

    browser.click("#undo").await;
    wait_for(&browser, &versions(2, 0)).await;
    assert!(
        browser.text("#verdict-title").await.starts_with("missing"),
        "the verdict on the base model is still there"
    );
    // What is added now is a branch, and nothing is lost.
    browser.click("[data-effect=armature_reaction]").await;
    wait_for(&browser, &versions(3, 2)).await;
    let judged = browser.number(&percent(2, "current")).await;
    assert!(judged > after, "the other member of the class explains less of these data: {judged} %");
    browser.click("#versions li:nth-child(2) .name").await;
    wait_for(&browser, &versions(3, 1)).await;
    browser.click("#undo").await;
    wait_for(&browser, &versions(3, 0)).await;
    browser.click("#redo").await;
    wait_for(&browser, &versions(3, 2)).await;
    browser.click("#versions li:nth-child(3) .remove").await;
    wait_for(&browser, &versions(2, 0)).await;
    browser.click("#redo").await;
    wait_for(&browser, &versions(2, 1)).await;

    browser.click("#model").await;
    let (name, file) = browser.download("toml").await;
    assert!(name == "model.toml" && String::from_utf8_lossy(&file).contains("id = \"saturation\""), "{name}");
    std::fs::write(folder.path().join("model.toml"), &file).expect("written");
    let compare = ["compare", "ramp.csv", "--model", "model.toml", "--json"];
    let done = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", crate::program::WIDE)
        .current_dir(folder.path())
        .args(compare)
        .output()
        .expect("greyrig runs");
    let compared: Value = serde_json::from_slice(&done.stdout).expect("JSON");
    assert!(compared["esr"]["current"].as_f64().expect("a figure") < 0.01, "the file is the model that the page shows");
    // The report stands by itself.
    let report = "return fetch(document.querySelector('#report').href).then(async r => \
                  [r.headers.get('content-security-policy').startsWith('sandbox'), (await r.text()).startsWith('<!DOCTYPE html>')])";
    assert_eq!(browser.run(report).await, json!([true, true]));
    browser.assert_no_complaint().await;

    // The model can be opened again, as a version of its own.
    give(&browser, "kept.toml", &String::from_utf8_lossy(&file)).await;
    wait_for(&browser, &versions(3, 2)).await;
    assert_eq!(browser.text("#versions li:nth-child(3) .name").await, "kept.toml");
    browser.click("#versions li:nth-child(2) .name").await;
    wait_for(&browser, &versions(3, 1)).await;

    // A file that is no recording stays, with what is wrong with it, and harms nothing.
    give(&browser, "notes.csv", "no numbers here").await;
    wait_for(&browser, "return document.querySelectorAll('#recordings li').length === 3").await;
    let said = browser.text("#recordings li:nth-child(3) .note").await;
    assert!(said.starts_with("notes.csv:1: "), "{said}");
    assert_eq!(browser.run(&versions(3, 1)).await, true);
    browser.click("#recordings li:nth-child(3) .remove").await;
    wait_for(&browser, "return document.querySelectorAll('#recordings li').length === 2").await;
    // A recording without a current: the page says so, and nothing is made of it.
    let run = std::fs::read_to_string(folder.path().join("ramp.csv")).expect("the recording");
    let dead = run.lines().map(|line| match line.split(',').collect::<Vec<_>>()[..] {
        [time, voltage, current, speed] if current.parse::<f64>().is_ok() => format!("{time},{voltage},0,{speed}"),
        _ => line.to_owned(),
    });
    give(&browser, "dead.csv", &dead.collect::<Vec<_>>().join("\n")).await;
    wait_for(&browser, "return document.querySelectorAll('#recordings .note.stop').length > 0").await;
    browser.screenshot("serve-stopped.png").await;
    browser.click("#diagnose").await;
    wait_for_error(&browser, "dead.csv: the recording: ").await;
    // Left out, or removed, it hinders nothing any more.
    browser.click("#recordings li:nth-child(3) [data-role=off]").await;
    wait_for(&browser, "return document.querySelectorAll('#recordings .note.stop').length === 0").await;
    browser.click("#recordings li:nth-child(3) .remove").await;
    wait_for(&browser, "return document.querySelectorAll('#recordings li').length === 2").await;
    browser.click("#diagnose").await;
    wait_for(&browser, stop).await;
    wait_for_error(&browser, "stopped").await;
    browser.close().await;
    assert_eq!(server.interrupt(), 0, "Ctrl-C is how it ends");
}

#[tokio::test]
async fn a_cell_of_the_map_lights_up_its_instants_and_back() {
    let folder = recorded();
    let server = Server::start(folder.path(), &["ramp.csv"]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");
    wait_for(&browser, "return document.querySelector('#identify')?.disabled === false").await;
    browser.click("#identify").await;
    wait_for(&browser, &versions(1, 0)).await;
    wait_for(&browser, "return document.querySelectorAll('.map canvas').length === 2").await;
    wait_for(&browser, DRAWN).await;

    // The cell at the upper edge is the fastest twenty-fourth of the speed: when that was, the file tells.
    let text = std::fs::read_to_string(folder.path().join("ramp.csv")).expect("the recording");
    let rows = text.lines().filter_map(|l| l.split(',').map(|x| x.parse().ok()).collect::<Option<Vec<f64>>>());
    let speeds: Vec<(f64, f64)> = rows.map(|row| (row[0], row[3])).collect();
    let (low, high) = speeds.iter().fold((f64::MAX, f64::MIN), |(l, h), (_, w)| (l.min(*w), h.max(*w)));
    let mut fastest = speeds.iter().filter(|(_, w)| *w > low + 23.0 / 24.0 * (high - low)).map(|(t, _)| *t);
    let (first, last) = (fastest.next().expect("a time"), fastest.next_back().expect("a time"));

    let lit = "const c = document.querySelector('[data-pane=u_v] canvas'), d = new OffscreenCanvas(c.width, c.height).getContext('2d', { willReadFrequently: true }); \
        d.drawImage(c, 0, 0); const over = document.querySelector('[data-pane=u_v] .u-over').getBoundingClientRect(), \
        at = c.getBoundingClientRect(); const found = []; \
        for (let x = 0; x < over.width; x++) { const p = d.getImageData(over.left - at.left + x, over.top - at.top + 2, 1, 1).data; \
        if (p[3] > 60 && p[0] > 200 && p[2] < 120) found.push(6 * x / over.width); } \
        return found.length ? [found[0], found[found.length - 1]] : null";
    assert_eq!(browser.run(lit).await, Value::Null, "nothing is lit yet");
    let (x, y) = browser.point("[data-plane=i_omega] canvas", 0.5, 0.02).await;
    let to = PointerAction::MoveTo { duration: Some(Duration::from_millis(10)), x: x as f64, y: y as f64 };
    browser.mouse(vec![to, PointerAction::Down { button: 0 }, PointerAction::Up { button: 0 }]).await;
    wait_for(&browser, &format!("return (() => {{ {lit} }})() !== null")).await;
    let when = browser.run(lit).await;
    let (from, to) = (when[0].as_f64().expect("a time"), when[1].as_f64().expect("a time"));
    // The current passes through the cell twice a period of 20 ms, and the filter lags by a few milliseconds.
    assert!((from - first).abs() < 0.06 && (to - last).abs() < 0.06, "{from} … {to}, {first} … {last} s expected");
    browser.screenshot("serve-brush.png").await;
    // By the keyboard alone: the cell is given up again.
    browser.key('\u{e00c}').await;
    wait_for(&browser, &format!("return (() => {{ {lit} }})() === null")).await;

    // And back: while only the begin is shown, the motor is slow.
    drag(&browser, "[data-pane=i_a] .u-over", 0.0, 0.1).await;
    let speeds = "return fetch('state').then(r => r.json()).then(s => fetch(`cells/${s.present}/i_omega/${s.recordings[0].id}?from=0&to=0.6`)) \
        .then(r => r.json()).then(cells => Math.max(...cells.map(c => Math.floor(c / 24))))";
    let row = browser.number(speeds).await;
    assert!(row < 8.0, "in the first 0.6 s the speed is in the lower third: row {row}");
    browser.assert_no_complaint().await;
    browser.close().await;
}

#[tokio::test]
async fn two_tabs_agree() {
    let folder = recorded();
    let server = Server::start(folder.path(), &["staircase.csv", "ramp.csv"]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");
    wait_for(&browser, "return document.querySelectorAll('#recordings li').length === 2").await;
    let first = browser.client.window().await.expect("a window");
    let second = browser.client.new_window(true).await.expect("a second tab").handle;
    browser.client.switch_to_window(second.clone()).await.expect("the tab");
    browser.client.goto(&server.url).await.expect("the page opens");
    wait_for(&browser, "return document.querySelectorAll('#recordings li').length === 2").await;

    browser.client.switch_to_window(first).await.expect("the tab");
    browser.click("#recordings li:nth-child(1) [data-role=off]").await;
    let is_off = "return document.querySelector('#recordings li:nth-child(1) [data-role=off]').getAttribute('aria-pressed') === 'true'";
    wait_for(&browser, is_off).await;
    browser.client.switch_to_window(second).await.expect("the tab");
    wait_for(&browser, is_off).await;

    // A wish that rests on what is no longer so changes nothing; one that does not say what it rests on neither.
    let wish = |headers: &str| {
        format!("return fetch('remove?recording=2', {{ method: 'POST', headers: {headers} }}).then(r => r.status)")
    };
    assert_eq!(browser.run(&wish("{ 'If-Match': '\"1\"' }")).await, 412);
    assert_eq!(browser.run(&wish("{}")).await, 428);
    assert_eq!(browser.run("return document.querySelectorAll('#recordings li').length").await, 2);
    browser.close().await;
}

#[tokio::test]
async fn a_power_cut_loses_nothing_and_locks_nobody_out() {
    let folder = recorded();
    let server = Server::start(folder.path(), &["motor.greyrig", "staircase.csv", "ramp.csv"]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");
    wait_for(&browser, "return document.querySelector('#identify')?.disabled === false").await;
    browser.click("#identify").await;
    wait_for(&browser, &versions(1, 0)).await;
    browser.click("#diagnose").await;
    wait_for(&browser, "return document.querySelector('#odds') !== null").await;
    browser.click("#versions [aria-label='Note to base model']").await;
    type_into(&browser, "#versions .writing", "of the <b>first</b> bench").await;
    browser.run("document.querySelector('#versions .writing').blur(); return true").await;
    wait_for(&browser, "return document.querySelector('#versions .own')?.textContent === 'of the <b>first</b> bench'")
        .await;
    let seen = "return [...document.querySelectorAll('#recordings .name, #versions .name, #versions .own, #verdict-title, #odds')].map(e => e.textContent)";
    let before = browser.run(seen).await;
    let port = server.address().split(':').nth(1).expect("a port").to_owned();
    server.kill();
    wait_for_error(&browser, "greyrig serve does not answer").await;

    // Without the recordings on the command line: the project knows them. The open tab goes on.
    let server = Server::start_on(folder.path(), &port, &["motor.greyrig"]);
    wait_for(&browser, "return document.querySelector('#error').hidden").await;
    assert_eq!(browser.run(seen).await, before);
    let address = server.address();
    browser.client.goto(&format!("http://{address}/")).await.expect("the page opens");
    wait_for(&browser, &versions(1, 0)).await;
    assert_eq!(browser.run(seen).await, before, "the cookie is still good");
    wait_for(&browser, DRAWN).await;
    browser.close().await;
    // A second one on the same project would write over it.
    let refused = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", crate::program::WIDE)
        .current_dir(folder.path())
        .args(["serve", "motor.greyrig", "--port", "0"])
        .output()
        .expect("greyrig runs");
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(refused.status.code() == Some(2) && said.contains("has this project open"), "{said}");

    // A recording that has changed behind the project's back is not taken for the one that was fitted.
    drop(server);
    std::fs::copy(folder.path().join("staircase.csv"), folder.path().join("ramp.csv")).expect("replaced");
    let server = Server::start(folder.path(), &["motor.greyrig"]);
    let bearer = format!("Authorization: Bearer {}", server.token());
    let state = server.ask("GET /state", &[&format!("Host: {}", server.address()), &bearer]);
    assert!(state.contains("the file has changed since it was added"), "{state}");
}

#[tokio::test]
async fn a_first_visit_ends_with_the_error_on_the_floor() {
    let folder = tempfile::tempdir().expect("a folder");
    let server = Server::start(folder.path(), &[]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");
    wait_for(&browser, "return document.querySelector('#tour-begin') !== null").await;
    browser.screenshot("serve-welcome.png").await;
    // The third one hides a single effect, so that one addition is enough.
    browser
        .run(
            "const n = document.querySelector('#welcome input'); n.value = '3'; \
             n.dispatchEvent(new Event('input', { bubbles: true })); return true",
        )
        .await;
    browser.click("#tour-begin").await;
    let step = |n: u32| {
        format!(
            "return document.querySelector('#tour')?.dataset.step === '{n}' && document.querySelector('#job').textContent === ''"
        )
    };
    wait_for(&browser, &step(1)).await;
    browser.click("#tour button").await;
    wait_for(&browser, &step(2)).await;
    wait_for(&browser, "return document.querySelectorAll('.map canvas').length === 2").await;
    let (x, y) = browser.point("[data-plane=i_omega] canvas", 0.5, 0.5).await;
    let to = PointerAction::MoveTo { duration: Some(Duration::from_millis(10)), x: x as f64, y: y as f64 };
    browser.mouse(vec![to, PointerAction::Down { button: 0 }, PointerAction::Up { button: 0 }]).await;
    wait_for(&browser, &step(3)).await;
    browser.click("#tour button").await;
    wait_for(&browser, &step(4)).await;
    browser.click("#add-named, #add-all").await;
    wait_for(&browser, &step(5)).await;
    let end = browser.text("#tour").await;
    assert!(end.contains("inductance_saturation=0.6"), "{end}");
    // A model with what is missing is as good as the data, within the factor that a floor from one recording is known
    // to.
    let floor = "const t = document.querySelector('#versions .chosen .figures').innerText.match(/[\\d.]+(?= %)/g).map(Number); return t[0] / t[2]";
    assert!(browser.number(floor).await < 3.0);
    browser.screenshot("serve-tour.png").await;
    browser.assert_no_complaint().await;
    browser.close().await;
}

#[tokio::test]
async fn everything_is_in_sight_on_every_screen() {
    let folder = recorded();
    let server = Server::start(folder.path(), &["staircase.csv", "ramp.csv"]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");
    wait_for(&browser, "return document.querySelector('#identify')?.disabled === false").await;
    browser.click("#identify").await;
    wait_for(&browser, &versions(1, 0)).await;
    for (width, height) in [(1280, 720), (1920, 1080), (3840, 2160)] {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        browser.devtools("Emulation.setDeviceMetricsOverride", size).await;
        let sight = "return document.documentElement.scrollHeight <= innerHeight && document.documentElement.scrollWidth <= innerWidth \
            && ['#identify', '#panes', '.map canvas', '#ladder svg', '#verdict', '#command'].every(s => { \
            const r = document.querySelector(s)?.getBoundingClientRect(); \
            return r && r.width > 20 && r.height > 12 && r.right <= innerWidth + 1 && r.bottom <= innerHeight + 1; })";
        wait_for(&browser, sight).await;
        let canvases =
            "return [...document.querySelectorAll('.plot canvas')].every(c => c.getBoundingClientRect().height > 40)";
        wait_for(&browser, canvases).await;
    }
    browser.close().await;
}

#[tokio::test]
async fn a_foreign_file_is_mapped_on_the_page() {
    let folder = recorded();
    let server = Server::start(folder.path(), &[]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");
    wait_for(&browser, "return document.querySelector('#welcome') !== null").await;
    let run = std::fs::read_to_string(folder.path().join("ramp.csv")).expect("the recording");
    let rows = run.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
    let foreign: String = std::iter::once("a,b,c,d").chain(rows).flat_map(|line| [line, "\n"]).collect();
    give(&browser, "foreign.csv", &foreign).await;
    wait_for(&browser, "return document.querySelectorAll('#recordings .note.stop').length === 1").await;
    let said = browser.text("#recordings .note.stop").await;
    assert!(said.starts_with("foreign.csv") && said.contains("--map"), "{said}");
    let rules = "const field = document.querySelector('.mapping input'); field.value = 't_s=a u_v=b i_a=c omega_rad_s=d*1'; \
                 field.dispatchEvent(new Event('input', { bubbles: true })); return true";
    browser.run(rules).await;
    browser.click(".mapping button").await;
    wait_for(&browser, "return document.querySelectorAll('#recordings .note.stop').length === 0").await;
    wait_for(&browser, DRAWN).await;
    browser.click("#identify").await;
    wait_for(&browser, &versions(1, 0)).await;
    let command = browser.text("#command").await;
    assert!(command.contains("--map 'u_v=b'") || command.contains("--map u_v=b"), "{command}");
    browser.close().await;
}

#[tokio::test]
async fn what_a_file_is_called_stays_text() {
    let folder = recorded();
    let name = "<img src=x onerror=document.title='pwned'>.csv";
    std::fs::copy(folder.path().join("ramp.csv"), folder.path().join(name)).expect("copied");
    let server = Server::start(folder.path(), &[name]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");
    wait_for(&browser, DRAWN).await;
    assert_eq!(browser.text("#recordings .name").await, name);
    // A name that wants to be somewhere else, too.
    give(&browser, "..\\..\\evil.csv", "t_s,u_v\n").await;
    wait_for(&browser, "return document.querySelectorAll('#recordings li').length === 2").await;
    assert_eq!(browser.client.title().await.expect("a title"), "greyrig");
    assert_eq!(browser.run("return document.querySelectorAll('img').length").await, 0);
    browser.close().await;
}

#[test]
fn nobody_else_is_answered() {
    let folder = tempfile::tempdir().expect("a folder");
    let server = Server::start(folder.path(), &[]);
    let (host, token) = (format!("Host: {}", server.address()), server.token());
    let port = server.address().split(':').nth(1).expect("a port");
    let cookie = format!("Cookie: greyrig-{port}={token}");
    let status = |answer: &str| answer.split(' ').nth(1).expect("a status").to_owned();
    assert_eq!(status(&server.ask("GET /state", &[&host, &cookie])), "200");
    for (why, request, headers) in [
        ("no token", "GET /state", vec![host.as_str()]),
        ("no token", "GET /", vec![&host]),
        ("no token", "GET /signal/1/i_a?from=0&to=1&px=10", vec![&host]),
        ("a wrong token", "GET /?token=00000000000000000000000000000000", vec![&host]),
        ("another name", "GET /state", vec!["Host: rig.example", &cookie]),
        ("another origin", "GET /state", vec![&host, &cookie, "Origin: http://rig.example"]),
        ("another origin", "POST /stop", vec![&host, &cookie, "Origin: null"]),
        ("another site", "GET /state", vec![&host, &cookie, "Sec-Fetch-Site: cross-site"]),
        ("another site", "GET /serve.js", vec![&host, &cookie, "Sec-Fetch-Site: same-site"]),
    ] {
        let answer = server.ask(request, &headers);
        assert_eq!(status(&answer), "403", "{why}: {answer}");
        assert!(!answer.contains(token), "{why}");
    }
    let answer = server.ask(&format!("GET /?token={token}"), &[&host]).to_lowercase();
    for said in
        ["303 see other", "location: /\r", "httponly", "samesite=strict", &format!("set-cookie: greyrig-{port}=")]
    {
        assert!(answer.contains(said), "{said}: {answer}");
    }
    let answer = server.ask("GET /", &[&host, &cookie]).to_lowercase();
    for said in [
        "x-content-type-options: nosniff",
        "cross-origin-resource-policy: same-origin",
        "referrer-policy: no-referrer",
        "default-src 'none'",
        "frame-ancestors 'none'",
    ] {
        assert!(answer.contains(said), "{said}: {answer}");
    }
    // Files of this machine are not to be had by their names.
    for path in ["/../../etc/passwd", "/serve.js/../../Cargo.toml", "/report/..%2f..%2fetc", "/model/x"] {
        let answer = status(&server.ask(&format!("GET {path}"), &[&host, &cookie]));
        assert!(answer == "404" || answer == "400", "{path}: {answer}");
    }
}

#[test]
fn whoever_does_not_go_on_is_cut_off() {
    let folder = tempfile::tempdir().expect("a folder");
    let server = Server::start(folder.path(), &[]);
    let mut slow = TcpStream::connect(server.address()).expect("it listens");
    slow.set_read_timeout(Some(Duration::from_secs(60))).expect("a limit");
    slow.write_all(b"GET / HTTP/1.1\r\nHost: ").expect("it is sent");
    let mut answer = Vec::new();
    // Either an end or a refusal: both free the place. Were it kept, this would fail for time.
    match slow.read_to_end(&mut answer) {
        Ok(_) => {}
        Err(error) => assert_eq!(error.kind(), std::io::ErrorKind::ConnectionReset, "{error}"),
    }
    let bearer = format!("Authorization: Bearer {}", server.token());
    assert!(server.ask("GET /state", &[&format!("Host: {}", server.address()), &bearer]).contains("200 OK"));
}

#[test]
fn a_bad_file_is_said_and_does_not_hinder_the_page() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("notes.csv"), "no numbers here\n").expect("written");
    let server = Server::start(folder.path(), &["notes.csv", "gone.csv"]);
    let bearer = format!("Authorization: Bearer {}", server.token());
    let answer = server.ask("GET /state", &[&format!("Host: {}", server.address()), &bearer]);
    let body = answer.split("\r\n\r\n").nth(1).expect("a body");
    let state: Value = serde_json::from_str(body).expect("JSON");
    for (recording, name) in [(0, "notes.csv:1: "), (1, "gone.csv: ")] {
        let said = state["recordings"][recording]["unusable"].as_str().expect("a sentence");
        assert!(said.starts_with(name) && said.lines().count() == 1, "{said}");
    }
}

#[test]
fn a_port_that_is_taken_is_said_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("its number").port().to_string();
    let done = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", crate::program::WIDE)
        .env("XDG_STATE_HOME", folder.path())
        .args(["serve", "--port", &port])
        .output()
        .expect("greyrig runs");
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!((done.status.code(), said.trim().lines().count()), (Some(2), 1), "{said}");
    assert!(said.contains(&port) && said.contains("--port"), "{said}");
}

/// A folder with a station that ten healthy motors have taught, a motor whose bearing begins to rub after 3 s, and a
/// healthy one.
fn lot() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let made = |seed: u32, more: &[&str], out: &str| {
        let seed = seed.to_string();
        let run =
            ["simulate", "--profile", "steady", "--seconds", "6", "--spread", "0.02", "--seed", &seed, "--out", out];
        printed(path, &[&run[..], more].concat());
    };
    let healthy: Vec<String> = (1..=10).map(|k| format!("healthy-{k}.csv")).collect();
    for (k, out) in healthy.iter().enumerate() {
        made(k as u32 + 1, &[], out);
    }
    made(31, &["--fault", "bearing_friction=1@3"], "rubs.csv");
    made(32, &[], "sound.csv");
    printed(path, &["simulate", "--profile", "staircase", "--seconds", "8", "--seed", "1", "--out", "type.csv"]);
    printed(path, &["identify", "type.csv", "--out", "type.toml"]);
    let names: Vec<&str> = healthy.iter().map(String::as_str).collect();
    printed(path, &[&["calibrate"], &names[..], &["--model", "type.toml", "--out", "station.toml"]].concat());
    folder
}

#[tokio::test]
async fn motors_are_judged_as_the_command_judges_them() {
    let folder = lot();
    let server = Server::start(folder.path(), &["line.greyrig", "rubs.csv", "sound.csv"]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");
    wait_for(&browser, "return document.querySelectorAll('#recordings li').length === 2").await;
    browser.click("#tab-judge").await;
    assert_eq!(
        browser.run("return document.querySelector('#judge-begin').disabled").await,
        true,
        "there are no limits"
    );
    let station = std::fs::read_to_string(folder.path().join("station.toml")).expect("the station");
    give_to(&browser, "#station-file", "station.toml", &station).await;
    wait_for(&browser, "return document.querySelector('#judge-begin').disabled === false").await;
    assert!(browser.text(".station").await.starts_with("station.toml 10 healthy motors"));
    browser.click("#judge-begin").await;
    wait_for(&browser, "return document.querySelectorAll('#verdicts li').length === 2").await;
    let shown = "return [...document.querySelectorAll('#verdicts li')].map(e => e.dataset.verdict)";
    assert_eq!(browser.run(shown).await, json!(["fail", "pass"]));
    let command = browser.text("#command").await;
    assert!(command.starts_with("greyrig monitor rubs.csv sound.csv --model line.greyrig/station.toml"), "{command}");
    let words: Vec<String> = command.split(' ').skip(1).map(str::to_owned).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).chain(["--json"]).collect();
    let said: Value = serde_json::from_str(&printed(folder.path(), &words)).expect("JSON");
    assert_eq!(said["runs"][0]["verdict"], "fail", "the command that is shown does the same");
    let first = said["runs"][0]["findings"][0]["text"].as_str().expect("a fault");
    assert!(first.contains("friction") && first.contains("since 3."), "what rubs takes torque: {first}");
    assert!(browser.text("#hypotheses tbody th").await.starts_with(first));
    // The bands of healthy motors over the time of the test, and the alarm.
    let drawn = "return [...document.querySelectorAll('.bands .chart')].map(c => [c.querySelectorAll('.band').length, \
                 c.querySelectorAll('path').length, c.querySelectorAll('.alarm').length])";
    let drawn = browser.run(drawn).await;
    assert_eq!(drawn[5], json!([1, 1, 1]), "the deviation of the current: {drawn}");
    browser.screenshot("serve-judge.png").await;
    // Each plot is a file: its values, and itself as a drawing that stands by itself.
    browser.click("[data-chart=course-5] .saves button:last-child").await;
    let (_, table) = browser.download("csv").await;
    let table = String::from_utf8(table).expect("UTF-8");
    assert_eq!(table.lines().next(), Some("s,deviation of the current"));
    assert_eq!(table.lines().count() as u64, 1 + said["runs"][0]["periods"][0].as_u64().expect("a number"));
    browser.click("[data-chart=course-5] .saves button").await;
    let (_, drawing) = browser.download("svg").await;
    let drawing = String::from_utf8(drawing).expect("UTF-8");
    assert!(drawing.contains("xmlns=\"http://www.w3.org/2000/svg\"") && !drawing.contains("var("), "{drawing}");
    assert!(drawing.contains("<path") && drawing.contains("stroke=\"rgb("));

    browser.click("#verdicts li:nth-child(2) button").await;
    wait_for(&browser, "return document.querySelector('.told h3').dataset.verdict === 'pass'").await;
    assert_eq!(browser.run("return document.querySelectorAll('tr.beyond').length").await, 0, "within all bands");
    browser.assert_no_complaint().await;
    // A model without limits is refused, and says what makes some.
    let model = std::fs::read_to_string(folder.path().join("type.toml")).expect("the model");
    give_to(&browser, "#station-file", "type.toml", &model).await;
    wait_for_error(&browser, "type.toml holds no limits of the detector").await;
    assert!(browser.text(".station").await.starts_with("station.toml"), "the station is what it was");
    // It is still there after a power cut.
    let port = server.address().split(':').nth(1).expect("a port").to_owned();
    server.kill();
    let server = Server::start_on(folder.path(), &port, &["line.greyrig"]);
    browser.client.goto(&format!("http://{}/", server.address())).await.expect("the page opens");
    wait_for(&browser, "return document.querySelector('#tab-judge') !== null").await;
    browser.click("#tab-judge").await;
    wait_for(&browser, "return document.querySelectorAll('#verdicts li').length === 2").await;
    assert_eq!(browser.run(shown).await, json!(["fail", "pass"]));
    browser.close().await;
}

#[tokio::test]
async fn the_next_recording_is_drawn_before_it_is_made() {
    let folder = recorded();
    let server = Server::start(folder.path(), &["motor.greyrig", "staircase.csv", "ramp.csv"]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");
    wait_for(&browser, "return document.querySelector('#identify')?.disabled === false").await;
    browser.click("#identify").await;
    wait_for(&browser, &versions(1, 0)).await;
    browser.click("#tab-plan").await;
    type_into(&browser, "#plan .wishes input", "saturation, current_compression").await;
    type_into(&browser, "#plan .wishes label:nth-of-type(2) input", "4").await;
    type_into(&browser, "#plan .wishes label:nth-of-type(3) input", "150").await;
    let command = browser.text("#command").await;
    let told = "--rivals saturation,current_compression --seconds 4 --max-voltage 150 --max-current 10";
    assert!(
        command.starts_with("greyrig plan --model motor.greyrig/versions/") && command.ends_with(told),
        "{command}"
    );
    browser.click("#plan-begin").await;
    wait_for(&browser, "return document.querySelectorAll('#plan .take path').length > 0").await;
    // The command says the same.
    let words: Vec<&str> = command.split(' ').skip(1).chain(["--json"]).collect();
    let said: Value = serde_json::from_str(&printed(folder.path(), &words)).expect("JSON");
    let best = said["best"].as_array().expect("recordings");
    let names: Vec<&str> = best.iter().map(|t| t["profile"].as_str().expect("a name")).collect();
    assert_eq!(browser.run("return document.querySelector('.proposal').dataset.takes").await, names.join(" + "));
    browser.screenshot("serve-plan.png").await;
    browser.click("#plan .take a").await;
    let (_, file) = browser.download("csv").await;
    let file = String::from_utf8(file).expect("UTF-8");
    let rows: Vec<(f64, f64)> = file
        .lines()
        .skip(1)
        .map(|line| line.split_once(',').expect("two columns"))
        .map(|(t, u)| (t.parse().expect("a time"), u.parse().expect("a voltage")))
        .collect();
    assert_eq!(file.lines().next(), Some("t_s,u_v"));
    // 10 kHz, as the rig's.
    assert_eq!(rows.len() as f64, 1e4 * best[0]["seconds"].as_f64().expect("a length"));
    let peak = rows.iter().map(|(_, u)| u.abs()).fold(0.0, f64::max);
    // Single precision.
    assert!((peak - best[0]["peak_voltage_v"].as_f64().expect("a voltage")).abs() < 1e-4 && peak <= 150.0, "{peak} V");

    browser.click("#tab-challenge").await;
    type_into(&browser, "#challenge .wishes input", "brush_drop").await;
    browser.click("#challenge-begin").await;
    wait_for(&browser, "return document.querySelectorAll('#challenged tbody tr').length === 1").await;
    let command = browser.text("#command").await;
    let words: Vec<&str> = command.split(' ').skip(1).chain(["--json"]).collect();
    assert!(words.contains(&"challenge") && words.contains(&"brush_drop"), "{command}");
    let said: Value = serde_json::from_str(&printed(folder.path(), &words)).expect("JSON");
    let row = browser.text("#challenged [data-effect=brush_drop]").await;
    let name = said["effects"][0]["name"].as_str().expect("a name");
    assert!(row.starts_with(name), "{row}");
    let reveals = said["effects"][0]["revealed_from"].is_number();
    assert_eq!(row.contains("from "), reveals, "{row}");
    browser.screenshot("serve-challenge.png").await;

    browser.click("#tab-correction").await;
    type_into(&browser, "#correction .wishes input", "3").await;
    let command = browser.text("#command").await;
    assert!(command.starts_with("greyrig train staircase.csv ramp.csv --model motor.greyrig/versions/"), "{command}");
    browser.click("#train").await;
    wait_for(
        &browser,
        "return document.querySelector('#learnt') !== null && document.querySelector('#job').textContent === ''",
    )
    .await;
    // The command says the same of data held out.
    let words: Vec<&str> = command.split(' ').skip(1).chain(["--json"]).collect();
    let said: Value = serde_json::from_str(&printed(folder.path(), &words)).expect("JSON");
    let accepted = said["accepted"].as_bool().expect("a verdict");
    assert_eq!(browser.text("#learnt").await.starts_with("Accepted: "), accepted);
    let after = 100.0 * said["held_out_after"]["current"].as_f64().expect("an error");
    assert!(browser.text("#learnt").await.contains(&format!("to {after:.2} %")), "{after} %");
    // The version is judged as others are, with the begin.
    let (before, learnt) = (browser.number(&percent(0, "current")).await, browser.number(&percent(1, "current")).await);
    assert_eq!(learnt < before, accepted, "{before} % to {learnt} %");
    let drawn =
        "return [document.querySelectorAll('.surface rect').length, document.querySelectorAll('.bands .chart').length]";
    assert_eq!(browser.run(drawn).await, json!([3 * 40 * 40, 3]), "three pairs of inputs, three inputs");
    browser.screenshot("serve-correction.png").await;
    browser.assert_no_complaint().await;
    browser.close().await;
}

/// What the process has worked so far, in seconds of a processor.
#[cfg(target_os = "linux")]
fn worked(process: u32) -> f64 {
    /// Of a second, by which Linux counts for programs whatever it counts by itself.
    const TICK_S: f64 = 0.01;
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).expect("the process is there");
    let fields: Vec<&str> = stat.rsplit(')').next().expect("fields").split_whitespace().collect();
    // The fields behind the name begin with the third; user and system are the 14th and 15th.
    let ticks: f64 = fields[11..=12].iter().map(|ticks| ticks.parse::<f64>().expect("a number")).sum();
    TICK_S * ticks
}

/// Stop takes effect within half a second; counted in what the process still works, which other work on the machine
/// does not lengthen.
#[cfg(target_os = "linux")]
#[test]
fn what_is_stopped_ends_within_half_a_second() {
    let folder = recorded();
    let server = Server::start(folder.path(), &["staircase.csv", "ramp.csv"]);
    let (host, bearer) = (format!("Host: {}", server.address()), format!("Authorization: Bearer {}", server.token()));
    let state = || -> Value {
        let answer = server.ask("GET /state", &[&host, &bearer]);
        serde_json::from_str(answer.split("\r\n\r\n").nth(1).expect("a body")).expect("JSON")
    };
    let post = |path: &str| {
        let answer = server.ask(&format!("POST {path}"), &[&host, &bearer, "If-Match: *", "Content-Length: 0"]);
        assert!(answer.starts_with("HTTP/1.1 200"), "{path}: {answer}");
    };
    let wait = |done: &dyn Fn(&Value) -> bool| {
        let end = Instant::now() + Duration::from_secs(120);
        while !done(&state()) {
            assert!(Instant::now() < end, "{}", state());
            std::thread::sleep(Duration::from_millis(5));
        }
    };
    post("/identify");
    wait(&|state| state["present"].is_number() && state["job"].is_null());
    let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
    for path in ["/diagnose", "/challenge?effects=", "/plan?rivals=&seconds=60&volts=325&amperes=10"] {
        // At several points of the work.
        for after in [0.05, 0.6, 1.7] {
            let begin = worked(server.process.id());
            post(path);
            let has_worked = |_: &Value| worked(server.process.id()) > begin + after;
            wait(&|state| has_worked(state) || state["job"].is_null());
            if state()["job"].is_null() {
                continue;
            }
            let stopped = worked(server.process.id());
            post("/stop");
            wait(&|state| state["job"].is_null());
            let more = worked(server.process.id()) - stopped;
            assert!(
                more < 0.5 * cores,
                "{path}, stopped after {after} s of work: {more:.2} s more on {cores} processors"
            );
        }
    }
}

/// axe-core, that looks for what keeps people out: of the page's own tools, which are fetched where they are not there.
fn axe() -> String {
    let web = Path::new(env!("CARGO_MANIFEST_DIR")).join("web");
    let file = web.join("node_modules/axe-core/axe.min.js");
    if !file.exists() {
        let done = Command::new("npm").arg("ci").current_dir(&web).output().expect("npm runs; install the package npm");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
    std::fs::read_to_string(file).expect("axe-core")
}

/// Fails on what keeps people out.
async fn assert_open_to_all(browser: &Browser, place: &str) {
    let look = "return axe.run(document, { resultTypes: ['violations'] }).then(found => found.violations\
        .filter(v => ['serious', 'critical'].includes(v.impact)).map(v => [v.id, ...v.nodes.slice(0, 3).map(n => n.html)]))";
    assert_eq!(browser.run(look).await, json!([]), "{place}");
}

#[tokio::test]
async fn nothing_serious_keeps_people_out_and_each_mode_draws() {
    let folder = recorded();
    let server = Server::start(folder.path(), &["staircase.csv", "ramp.csv"]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");
    wait_for(&browser, "return document.querySelector('#identify')?.disabled === false").await;
    browser.click("#identify").await;
    wait_for(&browser, &versions(1, 0)).await;
    browser.click("#diagnose").await;
    wait_for(&browser, "return document.querySelector('#odds') !== null").await;
    wait_for(&browser, DRAWN).await;
    browser.run(&format!("{}; return typeof axe", axe())).await;
    let dark = |dark: bool| {
        let scheme = if dark { "dark" } else { "light" };
        json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] })
    };
    for is_dark in [false, true] {
        browser.devtools("Emulation.setEmulatedMedia", dark(is_dark)).await;
        for room in ["model", "plan", "challenge", "correction", "judge"] {
            browser.click(&format!("#tab-{room}")).await;
            assert_open_to_all(&browser, &format!("{room}, dark: {is_dark}")).await;
        }
        browser.click("#tab-model").await;
        for (mode, charts, shape) in
            [("spectrum", 5, "path"), ("order", 5, "path"), ("correlation", 4, "circle"), ("plane", 3, ".dots")]
        {
            browser.click(&format!("#{mode}")).await;
            let all = format!(
                "const all = [...document.querySelectorAll('.analyses .chart')]; \
                 return all.length === {charts} && all.every(c => c.querySelector('svg {shape}'))"
            );
            wait_for(&browser, &all).await;
            assert_open_to_all(&browser, &format!("{mode}, dark: {is_dark}")).await;
            let sight = "return document.documentElement.scrollHeight <= innerHeight \
                && [...document.querySelectorAll('.analyses .chart svg')].every(c => c.getBoundingClientRect().height > 30)";
            assert_eq!(browser.run(sight).await, true, "{mode} fits");
            browser.screenshot(&format!("serve-{mode}-{}.png", if is_dark { "dark" } else { "light" })).await;
        }
        browser.click("#panes .roles button").await;
    }
    // The mains stand out of the current where they are: 50 Hz, of the staircase and the ramp.
    browser.click("#spectrum").await;
    browser.click("[data-chart=i_a] .saves button:last-child").await;
    let (_, table) = browser.download("csv").await;
    let table = String::from_utf8(table).expect("UTF-8");
    let rows = table
        .lines()
        .skip(1)
        .map(|line| -> Vec<f64> { line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect() });
    let peak = rows.max_by(|a, b| a[1].total_cmp(&b[1])).expect("rows");
    // To a line of the spectrum of 6 s, of some 1.2 Hz.
    assert!((peak[0] - 50.0).abs() < 2.0, "{} Hz", peak[0]);
    // By the keyboard alone, from tab to tab.
    browser.run("document.querySelector('#tab-model').focus(); return true").await;
    browser.key('\u{e014}').await;
    assert_eq!(browser.run("return document.activeElement.id").await, "tab-plan");
    assert_eq!(browser.run("return document.querySelector('#plan') !== null").await, true);
    browser.assert_no_complaint().await;
    browser.close().await;
}
