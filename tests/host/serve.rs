//! The loop in a real browser, as its user goes through it.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::browser::Browser;

/// `greyrig serve` on a free port; ends with the test.
struct Server {
    process: Child,
    url: String,
}

impl Server {
    fn start(folder: &Path, recordings: &[&str]) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_greyrig"))
            .current_dir(folder)
            .args(["serve", "--port", "0", "--json"])
            .args(recordings)
            .stdout(Stdio::piped())
            .spawn()
            .expect("greyrig runs");
        let mut line = String::new();
        BufReader::new(process.stdout.take().expect("piped")).read_line(&mut line).expect("a line");
        let said: Value = serde_json::from_str(&line).expect("JSON");
        Self { process, url: said["url"].as_str().expect("an address").to_owned() }
    }

    /// Ends it as Ctrl-C does.
    fn interrupt(mut self) -> i32 {
        let id = self.process.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill").success());
        self.process.wait().expect("it ends").code().expect("by itself")
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn simulate(folder: &Path, profile: &str, seconds: &str, out: &str) {
    let run = [
        "simulate",
        "--profile",
        profile,
        "--seconds",
        seconds,
        "--seed",
        "1",
        "--effect",
        "saturation=0.35",
        "--out",
        out,
    ];
    let done =
        Command::new(env!("CARGO_BIN_EXE_greyrig")).current_dir(folder).args(run).output().expect("greyrig runs");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

/// Waits for what may take a fit or two beside other tests.
async fn wait_for(browser: &Browser, script: &str) {
    let end = Instant::now() + Duration::from_secs(120);
    while browser.run(script).await != Value::Bool(true) {
        assert!(Instant::now() < end, "{script}: {}", browser.text("#error").await);
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Waits until the page tells an error that begins so.
async fn wait_for_error(browser: &Browser, beginning: &str) {
    let script = format!("return document.querySelector('#error').textContent.startsWith({beginning:?})");
    wait_for(browser, &script).await;
}

fn versions(count: usize, present: usize) -> String {
    format!(
        "const rows = [...document.querySelectorAll('#versions tbody tr')]; return rows.length === {count} \
         && rows.findIndex(r => r.classList.contains('present')) === {present} && document.querySelector('#job').textContent === ''"
    )
}

#[tokio::test]
async fn a_user_finds_what_is_missing_adds_it_and_sees_the_error_fall() {
    let folder = tempfile::tempdir().expect("a folder");
    simulate(folder.path(), "staircase", "8", "staircase.csv");
    simulate(folder.path(), "ramp", "6", "ramp.csv");
    let server = Server::start(folder.path(), &["staircase.csv", "ramp.csv"]);
    let browser = Browser::start().await;
    browser.client.goto(&server.url).await.expect("the page opens");

    wait_for(&browser, "return document.querySelectorAll('#recordings li').length === 2").await;
    assert_eq!(browser.run("return document.querySelector('#diagnose').disabled").await, true, "there is no model");
    browser.click("#identify").await;
    wait_for(&browser, &versions(1, 0)).await;
    // It takes seconds, in which one may think better of it.
    browser.click("#diagnose").await;
    wait_for(
        &browser,
        "const stop = document.querySelector('#stop'); if (stop.hidden) return false; stop.click(); return true",
    )
    .await;
    wait_for_error(&browser, "stopped").await;
    browser.click("#diagnose").await;
    wait_for(&browser, "return !document.querySelector('#verdict').hidden").await;
    assert_eq!(browser.text("#verdict-title").await, "missing: saturation (or armature_reaction)");
    let odds = browser.text("#odds").await;
    assert!(odds.starts_with("Odds: ") && odds.ends_with(" to 1"), "{odds}");
    browser.screenshot("serve-verdict.png").await;

    browser.click("#add button").await;
    wait_for(&browser, &versions(2, 1)).await;
    let current = "const cell = document.querySelectorAll('#versions tbody tr')";
    let percent = |row| format!("{current}[{row}].children[1]; return parseFloat(cell.textContent)");
    let (before, after) = (browser.number(&percent(0)).await, browser.number(&percent(1)).await);
    // Saturation is all that is missing: what is left is near the noise, a fiftieth of what there was.
    assert!(before > 10.0 && after < before / 50.0, "{before} % to {after} %");
    let judged = browser.text("#versions tbody tr:nth-child(2) td:nth-of-type(7)").await;
    assert!(judged.starts_with("accepted"), "{judged}");
    wait_for(&browser, "return document.querySelector('#falling img').naturalWidth > 0").await;
    let report = "const frame = document.querySelector('#comparison iframe'); return !frame.classList.contains('loading') \
                  && frame.contentDocument.querySelectorAll('.signals canvas').length > 0";
    wait_for(&browser, report).await;
    browser.screenshot("serve-added.png").await;

    browser.click("#undo").await;
    wait_for(&browser, &versions(2, 0)).await;
    assert!(!browser.text("#verdict-title").await.is_empty(), "the verdict on the base model is still there");
    browser.click("#redo").await;
    wait_for(&browser, &versions(2, 1)).await;

    browser.click("#model").await;
    let (name, file) = browser.download("toml").await;
    assert!(name == "model.toml" && String::from_utf8_lossy(&file).contains("id = \"saturation\""), "{name}");
    std::fs::write(folder.path().join("model.toml"), &file).expect("written");
    let compare = ["compare", "ramp.csv", "--model", "model.toml", "--json"];
    let done = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .current_dir(folder.path())
        .args(compare)
        .output()
        .expect("greyrig runs");
    let compared: Value = serde_json::from_slice(&done.stdout).expect("JSON");
    assert!(compared["esr"]["current"].as_f64().expect("a figure") < 0.01, "the file is the model that the page shows");
    browser.assert_no_complaint().await;

    // A file that is no recording: one line, and nothing is lost.
    browser.run("post('recordings?name=notes.csv', 'no numbers here'); return true").await;
    wait_for_error(&browser, "notes.csv:1: ").await;
    assert_eq!(browser.run(&versions(2, 1)).await, true);
    // A recording without a current: the page says so, and nothing is made of it.
    let run = std::fs::read_to_string(folder.path().join("ramp.csv")).expect("the recording");
    let dead = run.lines().map(|line| match line.split(',').collect::<Vec<_>>()[..] {
        [time, voltage, current, speed] if current.parse::<f64>().is_ok() => format!("{time},{voltage},0,{speed}"),
        _ => line.to_owned(),
    });
    let dead = dead.collect::<Vec<_>>().join("\n");
    browser.run(&format!("post('recordings?name=dead.csv', {dead:?}); return true")).await;
    wait_for(&browser, "return document.querySelectorAll('#recordings .stop').length > 0").await;
    browser.screenshot("serve-stopped.png").await;
    browser.click("#diagnose").await;
    wait_for_error(&browser, "dead.csv: the recording: ").await;
    // Without it all goes on.
    browser.click("#recordings li:nth-child(3) button").await;
    wait_for(&browser, "return document.querySelectorAll('#recordings li').length === 2").await;
    assert_eq!(browser.run("return document.querySelectorAll('#recordings .stop').length").await, 0);
    browser.click("#diagnose").await;
    wait_for(&browser, "return !document.querySelector('#stop').hidden").await;
    browser.click("#stop").await;
    wait_for_error(&browser, "stopped").await;
    browser.close().await;
    assert_eq!(server.interrupt(), 0, "Ctrl-C is how it ends");
}

#[test]
fn a_port_that_is_taken_is_said_in_one_line() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("its number").port().to_string();
    let done =
        Command::new(env!("CARGO_BIN_EXE_greyrig")).args(["serve", "--port", &port]).output().expect("greyrig runs");
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!((done.status.code(), said.trim().lines().count()), (Some(2), 1), "{said}");
    assert!(said.contains(&port) && said.contains("--port"), "{said}");
}
