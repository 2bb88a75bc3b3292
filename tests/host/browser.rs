//! A real browser, Chromium through chromedriver; and the report in it, which opens from a file with the network cut
//! off, draws, zooms, measures and exports.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use fantoccini::actions::{InputSource, KeyAction, KeyActions, MouseActions, PointerAction, WheelAction, WheelActions};
use fantoccini::wd::{Capabilities, WebDriverCompatibleCommand};
use fantoccini::{Client, ClientBuilder, Locator};
use greyrig_host::compare::PerSignal;
use greyrig_host::recording::Motion;
use greyrig_host::report::{Curves, Report, Step};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::synthetic_comparison::{SAMPLE_TIME_S, comparison, model, recording, servo_traces, traces};

const SECONDS: f64 = 30.0;
/// A spike of one sample in the measured current, that has to stay in sight.
const SPIKE: (usize, f64) = (123_457, 40.0);

/// chromedriver on a free port; ends with the test.
struct Driver {
    process: Child,
    port: u16,
}

impl Driver {
    fn start() -> Self {
        let mut process = Command::new("chromedriver")
            .arg("--port=0")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("chromedriver starts; install the packages chromium and chromium-driver");
        let output = BufReader::new(process.stdout.take().expect("piped"));
        let port = output
            .lines()
            .map_while(Result::ok)
            .find_map(|line| line.split_once("successfully on port ")?.1.trim_end_matches('.').parse().ok())
            .expect("chromedriver names its port");
        Self { process, port }
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        // Asked politely, it takes its browser along even when a test has failed. Nothing to do where it has gone
        // already.
        if let Ok(mut connection) = TcpStream::connect(("127.0.0.1", self.port)) {
            let _ = connection.write_all(b"GET /shutdown HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
            let _ = connection.set_read_timeout(Some(Duration::from_secs(5)));
            let _ = connection.read(&mut [0; 64]);
        }
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A command of chromedriver's own: its path below the session, and what goes with it.
#[derive(Debug)]
struct Own(&'static str, Value);

impl WebDriverCompatibleCommand for Own {
    fn endpoint(&self, base: &url::Url, session: Option<&str>) -> Result<url::Url, url::ParseError> {
        base.join(&format!("session/{}/{}", session.unwrap_or_default(), self.0))
    }
    fn method_and_body(&self, _: &url::Url) -> (http::Method, Option<String>) {
        (http::Method::POST, Some(self.1.to_string()))
    }
}

/// A browser with a page open, and the folder that its downloads go to.
pub struct Browser {
    pub client: Client,
    folder: TempDir,
    _driver: Driver,
}

impl Browser {
    /// With a file open, and no network.
    async fn open(page: &Path) -> Self {
        let browser = Self::start().await;
        browser.devtools("Network.enable", json!({})).await;
        let offline = json!({ "offline": true, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0 });
        browser.devtools("Network.emulateNetworkConditions", offline).await;
        browser.client.goto(&format!("file://{}", page.display())).await.expect("the report opens");
        browser
    }

    /// With nothing open, and this machine for a network.
    pub async fn start() -> Self {
        let driver = Driver::start();
        let folder = tempfile::tempdir().expect("a temporary folder");
        let profile = format!("--user-data-dir={}", folder.path().join("profile").display());
        let mut arguments = vec![
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--disable-dev-shm-usage",
            "--window-size=1280,1000",
            // No name resolves: whatever a page asks of a network fails.
            "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
        ];
        arguments.push(&profile);
        let capabilities: Capabilities = serde_json::from_value(json!({
            "goog:chromeOptions": {
                "args": arguments,
                "prefs": { "download.default_directory": folder.path(), "download.prompt_for_download": false },
            },
            "goog:loggingPrefs": { "browser": "ALL" },
        }))
        .expect("an object");
        let client = ClientBuilder::new(hyper_util::client::legacy::connect::HttpConnector::new())
            .capabilities(capabilities)
            .connect(&format!("http://127.0.0.1:{}", driver.port))
            .await
            .expect("Chromium starts; install the packages chromium and chromium-driver");
        Self { client, folder, _driver: driver }
    }

    pub async fn devtools(&self, command: &str, parameters: Value) -> Value {
        let own = Own("goog/cdp/execute", json!({ "cmd": command, "params": parameters }));
        self.client.issue_cmd(own).await.unwrap_or_else(|e| panic!("{command}: {e}"))
    }

    /// Runs the body of a function in the page.
    pub async fn run(&self, script: &str) -> Value {
        self.client.execute(script, vec![]).await.unwrap_or_else(|e| panic!("{script}: {e}"))
    }

    pub async fn number(&self, script: &str) -> f64 {
        let value = self.run(script).await;
        value.as_f64().unwrap_or_else(|| panic!("{script} gives {value}"))
    }

    pub async fn text(&self, selector: &str) -> String {
        self.client.find(Locator::Css(selector)).await.expect(selector).text().await.expect("text")
    }

    pub async fn click(&self, selector: &str) {
        self.client.find(Locator::Css(selector)).await.expect(selector).click().await.expect(selector);
    }

    /// Waits until a script yields true.
    async fn wait_for(&self, script: &str) {
        let end = Instant::now() + Duration::from_secs(10);
        while self.run(script).await != Value::Bool(true) {
            assert!(Instant::now() < end, "not within 10 s: {script}");
            tokio::time::sleep(Duration::from_millis(30)).await;
        }
    }

    /// The place of the element's inner point at shares of width and height, scrolled into view, in pixels of the
    /// window.
    pub async fn point(&self, selector: &str, x: f64, y: f64) -> (i64, i64) {
        let script = format!(
            "const e = document.querySelector({selector:?}); e.scrollIntoView({{block: 'center'}}); \
             const r = e.getBoundingClientRect(); return [r.left + {x} * r.width, r.top + {y} * r.height].map(Math.round)"
        );
        let at = self.run(&script).await;
        (at[0].as_i64().expect("a number"), at[1].as_i64().expect("a number"))
    }

    pub async fn mouse(&self, actions: Vec<PointerAction>) {
        let mouse = actions.into_iter().fold(MouseActions::new("mouse".into()), |m, action| m.then(action));
        self.client.perform_actions(mouse).await.expect("the mouse moves");
    }

    /// Types a key where the focus is.
    pub async fn key(&self, value: char) {
        let keys = KeyActions::new("keys".into()).then(KeyAction::Down { value }).then(KeyAction::Up { value });
        self.client.perform_actions(keys).await.expect("the key is typed");
    }

    /// The range that the plots show, once they are drawn.
    async fn range(&self) -> (f64, f64) {
        let get = |end: &str| format!("return Number(document.querySelector('.signals').dataset.{end})");
        (self.number(&get("from")).await, self.number(&get("to")).await)
    }

    pub async fn screenshot(&self, name: &str) {
        // Kept where a person can look at them, if one asks.
        let Some(folder) = std::env::var_os("GREYRIG_SCREENSHOTS").map(PathBuf::from) else { return };
        let height = self.number("return document.documentElement.scrollHeight").await;
        let clip = json!({ "x": 0, "y": 0, "width": 1280, "height": height, "scale": 1 });
        let shot = json!({ "captureBeyondViewport": true, "clip": clip });
        let answer = self.devtools("Page.captureScreenshot", shot).await;
        let data = answer["data"].as_str().expect("a picture");
        let bytes = base64::Engine::decode(&base64::engine::general_purpose::STANDARD, data).expect("base64");
        std::fs::create_dir_all(&folder).expect("the folder for screenshots");
        std::fs::write(folder.join(name), bytes).expect("the screenshot is written");
    }

    /// The one downloaded file with an ending.
    pub async fn download(&self, ending: &str) -> (String, Vec<u8>) {
        let end = Instant::now() + Duration::from_secs(10);
        loop {
            let entries = std::fs::read_dir(self.folder.path()).expect("the folder").flatten();
            // The browser keeps the name with an empty file until all is there.
            let mut written = entries.filter(|e| e.metadata().is_ok_and(|m| m.len() > 0)).map(|e| e.path());
            let found = written.find(|p| p.extension().is_some_and(|e| e == ending));
            if let Some(path) = found {
                let bytes = std::fs::read(&path).expect("the download");
                std::fs::remove_file(&path).expect("the download can be removed");
                return (path.file_name().expect("a name").to_string_lossy().into_owned(), bytes);
            }
            assert!(Instant::now() < end, "no .{ending} came within 10 s");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    /// Fails on whatever the console holds, and on anything that was loaded from elsewhere.
    async fn assert_quiet(&self) {
        self.assert_no_complaint().await;
        assert_eq!(self.run("return performance.getEntriesByType('resource').length").await, json!(0));
    }

    /// Fails on whatever the console holds.
    pub async fn assert_no_complaint(&self) {
        let log = self.client.issue_cmd(Own("se/log", json!({ "type": "browser" }))).await.expect("the log");
        assert_eq!(log, json!([]), "the console");
    }

    pub async fn close(self) {
        self.client.clone().close().await.expect("the browser closes");
    }
}

/// Script that copies the canvas `c` into `ctx`: reading pixels back would change how the original is drawn.
const COPY: &str = "const copy = new OffscreenCanvas(c.width, c.height); \
    const ctx = copy.getContext('2d', { willReadFrequently: true }); ctx.drawImage(c, 0, 0);";

/// Share of a canvas' pixels, in per cent, that were drawn on.
fn drawn(selector: &str) -> String {
    format!(
        "const c = document.querySelector({selector:?}); {COPY} const d = ctx.getImageData(0, 0, c.width, c.height).data; \
         let n = 0; for (let k = 3; k < d.length; k += 4) n += d[k] > 0; return 400 * n / d.length"
    )
}

fn write_report(folder: &Path) -> PathBuf {
    let mut with_spike = traces(SECONDS);
    with_spike.measured_current[SPIKE.0] = SPIKE.1;
    let mut c = comparison(vec![recording("data/motor 17.csv", with_spike)]);
    c.per_recording[0].warnings.push("the current is clipped at 12 A in 31 samples".into());
    let m = model(Motion::Rotary);
    let esr = |current, speed| PerSignal { current: Some(current), speed: Some(speed), torque: None };
    let steps = [
        Step { label: "base model".into(), esr: esr(0.183, 0.047) },
        Step { label: "+ saturation".into(), esr: esr(0.042, 0.021) },
        Step { label: "+ ANFIS".into(), esr: esr(0.0092, 0.0051) },
    ];
    let falling = |start: f64| (0..60).map(|k| (f64::from(k), start * (0.02 + (-f64::from(k) / 9.0).exp()))).collect();
    let curves = Curves {
        caption: "Error over training".into(),
        x: "epoch".into(),
        y: "RMSE, A".into(),
        logarithmic: true,
        curves: vec![("training".into(), falling(1.0)), ("checking".into(), falling(1.15))],
    };
    let path = folder.join("report.html");
    Report::new("Vacuum-cleaner unit 462.3.401")
        .lead("The base model leaves 18 % of the current unexplained, most of it beyond 9 A.")
        .waterfall("The error falling", &steps, c.noise_floor)
        .comparison("Base model", &c, &m)
        .curves("Training", curves)
        .fact("Command", "greyrig compare \"data/motor 17.csv\" --model motor.toml")
        .write(&path, true)
        .expect("the report is written");
    path
}

#[tokio::test]
async fn the_report_works_without_a_network() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let browser = Browser::open(&write_report(folder.path())).await;
    let current = "[data-pane=current]";
    let over = "[data-pane=current] .u-over";

    // Everything is drawn.
    browser.wait_for("return document.querySelectorAll('.signals canvas').length === 5").await;
    browser.wait_for("return Number(document.querySelector('.signals').dataset.drawn) > 0").await;
    for pane in ["voltage", "current", "current-error", "speed", "speed-error"] {
        let share = browser.number(&drawn(&format!("[data-pane={pane}] canvas"))).await;
        assert!(share > 1.0, "{share} % of the pane {pane} is drawn on");
    }
    assert_eq!(browser.range().await, (0.0, SECONDS));
    browser.screenshot("light.png").await;

    // The spike of one sample is in sight in the overview of the waveforms: it reaches the axis' upper end.
    browser.click("[data-view=wave]").await;
    browser.wait_for("return document.querySelector('.signals').dataset.exact === 'false'").await;
    assert!(browser.text(".resolution").await.contains("zoom in for each sample"));
    let spike_s = SPIKE.0 as f64 * SAMPLE_TIME_S;
    // Without the spike the current stays below 13 A; the axis goes to 43 A, so nothing else is blue in its upper
    // third.
    let blue_near = |time_s: f64| {
        format!(
            "const pane = document.querySelector('[data-pane=current]'), c = pane.querySelector('canvas'); \
             const o = pane.querySelector('.u-over'), at = c.getBoundingClientRect(), in_ = o.getBoundingClientRect(); \
             const x = in_.left - at.left + {time_s} / {SECONDS} * in_.width, top = in_.top - at.top; \
             {COPY} const d = ctx.getImageData(x - 3, top, 7, in_.height / 3).data; \
             let n = 0; for (let k = 0; k < d.length; k += 4) n += d[k + 3] > 100 && d[k + 2] - d[k] > 60; return n"
        )
    };
    assert!(browser.number(&blue_near(spike_s)).await > 20.0, "the spike is drawn");
    assert_eq!(browser.number(&blue_near(spike_s + 2.0)).await, 0.0);

    // A drag zooms all plots alike.
    let ((x1, y), (x2, _)) = (browser.point(over, 0.3, 0.5).await, browser.point(over, 0.5, 0.5).await);
    let still = Some(Duration::from_millis(10));
    let to = |x, y| PointerAction::MoveTo { duration: still, x: x as f64, y: y as f64 };
    let (press, release) = (PointerAction::Down { button: 0 }, PointerAction::Up { button: 0 });
    browser.mouse(vec![to(x1, y), press.clone(), to((x1 + x2) / 2, y), to(x2, y), release.clone()]).await;
    let (from, end) = browser.range().await;
    // A pixel of the plot is 0.03 s.
    assert!((from - 9.0).abs() < 0.1 && (end - 15.0).abs() < 0.1, "zoomed to {from} … {end}");
    browser.screenshot("zoomed.png").await;

    // The wheel zooms about the pointer, since the plots have the focus.
    let (x, y) = browser.point(over, 0.5, 0.5).await;
    let scroll = WheelAction::Scroll { duration: still, x, y, delta_x: 0, delta_y: -100 };
    browser.client.perform_actions(WheelActions::new("wheel".into()).then(scroll)).await.expect("the wheel turns");
    browser
        .wait_for(&format!(
            "const d = document.querySelector('.signals').dataset; return d.to - d.from < 0.8 * {}",
            end - from
        ))
        .await;
    let (from, end) = browser.range().await;
    assert!((end - from - 4.5).abs() < 0.1, "a turn of the wheel takes a quarter off, not {from} … {end}");

    // Keys: nearer, further along, all.
    browser.key('+').await;
    let (near, near_end) = browser.range().await;
    assert!(((near_end - near) / (end - from) - 0.5).abs() < 1e-6);
    browser.key('\u{e014}').await;
    let (along, _) = browser.range().await;
    assert!((along - near - 0.2 * (near_end - near)).abs() < 1e-6, "→ moves by a fifth");
    browser.key('0').await;
    assert_eq!(browser.range().await, (0.0, SECONDS));

    // At the largest error every sample is there; the cursors measure it.
    browser.click("[data-do='largest current error']").await;
    browser.wait_for("return document.querySelector('.signals').dataset.exact === 'true'").await;
    let (from, end) = browser.range().await;
    assert!((end - from - 0.2).abs() < 1e-9);
    let (ax, y) = browser.point(over, 0.25, 0.4).await;
    let (bx, _) = browser.point(over, 0.75, 0.4).await;
    browser.mouse(vec![to(ax, y), press.clone(), release.clone()]).await;
    let shift = KeyActions::new("keys".into()).then(KeyAction::Down { value: '\u{e008}' });
    browser.client.perform_actions(shift).await.expect("shift goes down");
    browser.mouse(vec![to(bx, y), press, release]).await;
    browser.client.release_actions().await.expect("shift goes up");
    browser.wait_for("return (document.querySelector('.between')?.innerText ?? '').includes('Hz')").await;
    let between = browser.text(".between").await;
    let apart =
        between.split("Δt ").nth(1).and_then(|s| s.split(' ').next()).expect("Δt").parse::<f64>().expect("a number");
    assert!((apart - 0.1).abs() < 0.001, "half of 0.2 s, not {apart}");
    assert!(between.contains("1/Δt"));
    // Five mains periods of the voltage: its RMS is that of the samples, computed here.
    let rms_shown: f64 = browser.text(".between [data-trace=u_v] td:last-child").await.parse().expect("a number");
    let (a, b) = ((from + 0.05) / SAMPLE_TIME_S, (from + 0.15) / SAMPLE_TIME_S);
    let volts = &traces(SECONDS).voltage[a as usize..b as usize];
    let rms = (volts.iter().map(|v| v * v).sum::<f64>() / volts.len() as f64).sqrt();
    assert!((rms_shown / rms - 1.0).abs() < 0.01, "{rms_shown} V, {rms} V expected");
    browser.screenshot("cursors.png").await;

    // The visible range as CSV: every sample, as it was measured.
    browser.click("[data-do=csv]").await;
    let (name, bytes) = browser.download("csv").await;
    assert!(name.starts_with("motor_17_"), "{name}");
    let text = String::from_utf8(bytes).expect("UTF-8");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("# recording: data/motor 17.csv"));
    assert_eq!(lines.next(), Some("# resolution: every sample"));
    let columns = "t_s,u_v,i_a,i_a_model,i_a_residual,omega_rad_s,omega_rad_s_model,omega_rad_s_residual";
    assert_eq!(lines.next(), Some(columns));
    let rows: Vec<Vec<f64>> =
        lines.map(|l| l.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect();
    assert!((2000..=2002).contains(&rows.len()), "0.2 s at 10 kHz, not {} rows", rows.len());
    let original = traces(SECONDS);
    for row in &rows {
        let k = (row[0] / SAMPLE_TIME_S).round() as usize;
        let measured = if k == SPIKE.0 { SPIKE.1 } else { original.measured_current[k] };
        // 16 bits over the signal's range, which the spike widens to 50 A: half a step is 0.4 mA; sums have two.
        assert!((row[2] - measured).abs() < 0.5e-3, "{} A at {} s, {measured} A expected", row[2], row[0]);
        assert!((row[3] - original.modelled_current[k]).abs() < 1e-3);
        assert!((row[3] - row[2] - row[4]).abs() < 1e-5);
        assert!((row[5] - original.measured_speed[k]).abs() < 0.05);
    }
    assert!(rows.iter().any(|r| (r[0] - spike_s).abs() < 1e-9), "the largest error is that of the spike");

    // The picture holds more than the plots' own pixels: title and legend are drawn in.
    browser.click("[data-do=png]").await;
    let (_, bytes) = browser.download("png").await;
    assert_eq!(&bytes[1..4], b"PNG");
    if let Some(shots) = std::env::var_os("GREYRIG_SCREENSHOTS") {
        std::fs::write(Path::new(&shots).join("export.png"), &bytes).expect("the picture is kept");
    }
    let size = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let panes = "return [...document.querySelectorAll('.signals canvas')].reduce((sum, c) => sum + c.height, 0)";
    assert!(f64::from(size(20)) > browser.number(panes).await + 100.0);

    // Double click resets; the cursors stay.
    let (x, y) = browser.point(over, 0.5, 0.5).await;
    let twice = || [PointerAction::Down { button: 0 }, PointerAction::Up { button: 0 }];
    browser.mouse([to(x, y)].into_iter().chain(twice()).chain(twice()).collect()).await;
    assert_eq!(browser.range().await, (0.0, SECONDS));

    // Hovering: linked values in another pane, and what a cell of the map holds.
    browser.mouse(vec![to(x, y), to(x + 5, y)].into_iter().collect()).await;
    browser.wait_for("return document.querySelector('[data-pane=speed] output').textContent.includes('rad/s')").await;
    assert!(browser.text(current).await.contains('A'));
    let (x, y) = browser.point(".map .cell", 0.5, 0.5).await;
    browser.mouse(vec![to(x, y), to(x + 1, y)]).await;
    let tip = browser.text("#tip").await;
    assert!(tip.contains("mean error") && tip.contains(" samples") && tip.contains("rad/s"), "{tip}");

    browser.assert_quiet().await;
    // The policy holds against a script that got in, and the console is heard.
    let intruder = "const s = document.createElement('script'); s.textContent = 'window.intruder = 1'; \
                    document.head.append(s); return window.intruder ?? null";
    assert_eq!(browser.run(intruder).await, Value::Null);
    let log = browser.client.issue_cmd(Own("se/log", json!({ "type": "browser" }))).await.expect("the log");
    assert!(log.to_string().contains("Content Security Policy"), "{log}");
    browser.close().await;
}

#[tokio::test]
async fn dark_print_and_a_drive_without_voltage() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = write_report(folder.path());
    let browser = Browser::open(&path).await;
    let background = "return getComputedStyle(document.body).backgroundColor";
    assert_eq!(browser.run(background).await, json!("rgb(255, 255, 255)"));
    let drawn_before = browser.number("return Number(document.querySelector('.signals').dataset.drawn)").await;
    let dark = json!({ "features": [{ "name": "prefers-color-scheme", "value": "dark" }] });
    browser.devtools("Emulation.setEmulatedMedia", dark).await;
    assert_eq!(browser.run(background).await, json!("rgb(13, 17, 23)"));
    browser
        .wait_for(&format!("return Number(document.querySelector('.signals').dataset.drawn) > {drawn_before}"))
        .await;
    browser.screenshot("dark.png").await;
    let printed = browser.devtools("Page.printToPDF", json!({ "printBackground": true })).await;
    let pdf = printed["data"].as_str().expect("a document");
    assert!(pdf.starts_with("JVBERi"), "a PDF in base64");
    if let Some(shots) = std::env::var_os("GREYRIG_SCREENSHOTS") {
        let bytes = base64::Engine::decode(&base64::engine::general_purpose::STANDARD, pdf).expect("base64");
        std::fs::write(Path::new(&shots).join("printed.pdf"), bytes).expect("the print is kept");
    }
    browser.assert_quiet().await;

    // A linear drive with the mechanical side alone: two panes, in newtons; and a script in a name does nothing.
    let mut c = comparison(vec![recording("<img src=x onerror=document.title='pwned'>.mat", servo_traces())]);
    c.esr = PerSignal { torque: Some(0.03), ..PerSignal::default() };
    let page = folder.path().join("servo.html");
    let m = model(Motion::Linear);
    Report::new("Servo").comparison("Linear", &c, &m).write(&page, false).expect("the report is written");
    browser.client.goto(&format!("file://{}", page.display())).await.expect("the report opens");
    browser.wait_for("return document.querySelectorAll('.signals canvas').length === 2").await;
    let label = browser.run("return document.querySelector('[data-pane=force]').getAttribute('aria-label')").await;
    assert!(label.as_str().is_some_and(|l| l.starts_with("Force of <img")), "{label}");
    assert_eq!(browser.client.title().await.expect("a title"), "Servo");
    browser.screenshot("servo.png").await;
    browser.assert_quiet().await;
    browser.close().await;
}

#[tokio::test]
async fn what_is_not_stored_at_full_rate_is_said() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // White noise does not pack: a minute of it exceeds the budget.
    let mut noisy = traces(60.0);
    let mut state = 1u32;
    for signal in
        [&mut noisy.measured_current, &mut noisy.measured_speed, &mut noisy.voltage, &mut noisy.modelled_speed]
    {
        for sample in signal {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *sample += f64::from(state >> 8) / 1e6;
        }
    }
    let c = comparison(vec![recording("noisy.csv", noisy)]);
    let page = folder.path().join("noisy.html");
    Report::new("Noise")
        .comparison("Noise", &c, &model(Motion::Rotary))
        .write(&page, false)
        .expect("the report is written");
    let size = std::fs::metadata(&page).expect("the report").len();
    assert!(size < 5_000_000, "{size} bytes");

    let browser = Browser::open(&page).await;
    let blocks = "JSON.parse(document.querySelector('.signals script').textContent).full_rate.blocks";
    // Away from the edges, where there is room for the mouse on both sides.
    let dropped = browser.number(&format!("return {blocks}.findIndex((b, k) => b === null && k > 60)")).await;
    assert!(dropped >= 0.0, "the budget leaves something out");
    browser.click("[data-view=wave]").await;
    let share = (dropped + 0.5) * 4096.0 * SAMPLE_TIME_S / 60.0;
    let (x, y) = browser.point("[data-pane=current] .u-over", share, 0.5).await;
    let still = Some(Duration::from_millis(10));
    let to = |x: i64| PointerAction::MoveTo { duration: still, x: x as f64, y: y as f64 };
    let (press, release) = (PointerAction::Down { button: 0 }, PointerAction::Up { button: 0 });
    browser.mouse(vec![to(x - 12), press.clone(), to(x), to(x + 12), release.clone()]).await;
    browser.wait_for("return document.querySelector('.resolution').textContent.includes('stored only')").await;
    assert_eq!(browser.run("return document.querySelector('.signals').dataset.exact").await, json!("false"));
    assert!(browser.number(&drawn("[data-pane=current] canvas")).await > 5.0, "the extremes are drawn");
    // No mean and no RMS from extremes, which would be wrong.
    let shift = |action: KeyAction| KeyActions::new("keys".into()).then(action);
    browser.mouse(vec![to(x - 300), press.clone(), release.clone()]).await;
    browser.client.perform_actions(shift(KeyAction::Down { value: '\u{e008}' })).await.expect("shift goes down");
    browser.mouse(vec![to(x + 300), press, release]).await;
    browser
        .wait_for("return document.querySelector('.between').innerText.includes('not every sample is stored')")
        .await;
    assert_eq!(browser.text(".between [data-trace=i_a] td:last-child").await, "–");
    browser.assert_quiet().await;
    browser.close().await;
}
