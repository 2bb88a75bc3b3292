//! A test over the link as the user sees it: a line that changes on a terminal, a line for each event, and the verdict.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use greyrig::detector::{Alarm, Kind};
use greyrig::link::message::Judged as Period;
use greyrig::parameters::{Settings, section};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;

use super::{Args, Judged, note};
use crate::answers::monitor::Request;
use crate::commands::kept::{keep, keep_elsewhere};
use crate::commands::stdout;
use crate::commands::terminal::Terminal;
use crate::device::connection::{check_layout, faults};
use crate::device::{Connection, Port, parameters, recorded, rig};
use crate::error::{Error, Result};
use crate::model::{DetectorEntry, Model, Origin};
use crate::monitor::air;
use crate::monitor::live::{self, Early, Event, LONGEST_S, Plan};
use crate::monitor::replay::Replay;
use crate::monitor::test::{Outcome, judge};
use crate::recording;

/// An alarm that has not called for so long is over, s.
const QUIET_S: f64 = 0.5;
/// Share by which the density of the air may differ without compensation: what weather makes.
const WEATHER: f64 = 0.03;

/// Tests a motor over the link.
pub fn run(
    args: &Args,
    request: &Request,
    name: &str,
    model: &Model,
    detector: &DetectorEntry,
    terminal: &Terminal,
) -> Result<Judged> {
    let ctx = &terminal.context();
    if let Some(seconds) = args.seconds.filter(|s| !(0.1..=LONGEST_S).contains(s)) {
        return Err(Error::usage(
            format!("a test of {seconds} s cannot be"),
            format!("choose --seconds between 0.1 and {LONGEST_S}"),
        ));
    }
    let port = Port { name: name.to_owned(), clock: args.clock.clone().into() };
    let (mut connection, device) = Connection::open(&port, ctx)?;
    check_layout(&device)?;
    let settings = in_force(&mut connection, model, &args.model, name)?;
    let rig = rig::of(&mut connection, Some(&settings))?.unwrap_or_default();
    let plan = Plan { seconds: args.seconds, nominal_voltage: detector.nominal_voltage };
    let mut talk = Talk::new(args.answer.json);
    let result = live::run(&port, &device, connection, &plan, ctx, &mut |event| talk.event(event));
    talk.end();

    let named = [("motor", Some(settings.motor_type.as_str())), ("rig", Some(rig.name.as_str()))];
    let named = named.into_iter().chain([("serial", args.serial.as_deref())]);
    let mut metadata: BTreeMap<String, String> = named
        .filter_map(|(key, name)| Some((key.to_owned(), name.filter(|name| !name.is_empty())?.to_owned())))
        .collect();
    recorded::describe(&mut metadata, &device);
    let finished = match result {
        Ok(finished) => finished,
        Err(Early { error, capture }) => {
            if let Some(out) = args.out.as_ref().filter(|_| !capture.samples.is_empty()) {
                // What there is of it can be written after a Ctrl-C; the next one stops that, too.
                terminal.cancel_flag().clear();
                metadata.insert("incomplete".into(), format!("the test ended early: {error}"));
                let kept = recorded::recording(&capture, &rig.calibration, metadata)
                    .map_err(Error::from)
                    .and_then(|recording| keep(&recording, out, "incomplete", ctx));
                match kept {
                    Ok(path) => eprintln!("greyrig: what there is of the test is in {}", path.display()),
                    Err(error) => eprintln!("greyrig: what there is of the test cannot be kept: {error}"),
                }
            }
            return Err(error.into());
        }
    };
    let mut recording = recorded::recording(&finished.capture, &rig.calibration, metadata)?
        .named(args.out.clone().unwrap_or_else(|| name.into()));
    let lost: usize = finished.capture.lost().iter().map(std::ops::Range::len).sum();
    if lost > 0 {
        eprintln!(
            "greyrig: {lost} samples have not arrived: the verdict stands, but what may be broken cannot be told"
        );
    }
    for line in faults(&finished.status) {
        eprintln!("greyrig: the microcontroller: {line}");
    }
    request.circumstances(&mut recording)?;
    let replay = Replay { temperature: args.temp_c, ..finished.replay };
    let mut test = judge(model, detector, &recording, replay, lost == 0, ctx)?;
    if !finished.status.plausible && test.verdict != Outcome::Fail {
        test.verdict = Outcome::CannotJudge;
        test.reasons
            .push("the measuring chain was not plausible during the test: see the microcontroller's faults".into());
    }
    if let (Some([low, high]), Some(density)) = (detector.air_kg_m3, air::density(&recording)?)
        && !((1.0 - WEATHER) * low..=(1.0 + WEATHER) * high).contains(&density)
    {
        test.verdict = Outcome::CannotJudge;
        test.reasons.push(format!(
            "the air weighs {density:.2} kg/m³ and not {low:.2} to {high:.2}, which the microcontroller does not compensate; record \
             the test with --out and judge that"
        ));
    }
    note(args.results.as_deref(), &test, terminal)?;
    if let Some(path) = &args.out {
        recording::write(&recording, path, args.answer.force, ctx)
            .map_err(|error| keep_elsewhere(&recording, path, error, ctx))?;
    }
    let told = json!({
        "port": name, "device": device, "samples": recording.len(), "first_sample": finished.capture.first, "lost": lost, "unseen_periods": finished.unseen,
        "reconnections": finished.capture.reconnections,
    });
    let more = told.as_object().cloned().unwrap_or_default();
    Ok(Judged { tests: vec![test], files: vec![Origin::from(&recording)], more })
}

/// The parameters that the microcontroller runs with, which have to be those of the model.
fn in_force(connection: &mut Connection, model: &Model, path: &Path, port: &str) -> Result<Settings> {
    let payload = connection.read_parameters()?;
    let flash = || format!("write it: greyrig flash --model {} --port {port}", path.display());
    let settings = section::decode(&payload)
        .map_err(|_| Error::usage("the microcontroller has no parameters that could be used", flash()))?;
    if parameters::settings(model, path)? != (Settings { rig: None, sequence: None, origin: None, ..settings.clone() })
    {
        return Err(Error::usage(
            format!("the microcontroller runs with another model than {}", path.display()),
            flash(),
        ));
    }
    Ok(settings)
}

/// Where a fault sits is told when it has looked the same for so many periods in a row: at first, before the rotor has
/// followed, much looks like a sensor.
const STEADY_PERIODS: usize = 5;

/// An alarm that calls.
struct Calling {
    last_s: f64,
    largest: f32,
    /// Where the fault seems to sit, and for how many periods in a row.
    kind: (Kind, usize),
    /// As told last.
    told: Option<Kind>,
}

impl Calling {
    /// Takes in an alarm; where the fault sits, if that is to be told now.
    fn again(&mut self, t: f64, alarm: &Alarm) -> Option<Kind> {
        self.last_s = t;
        self.largest = self.largest.max(alarm.ratio);
        let (kind, periods) = self.kind;
        self.kind = (alarm.kind, if kind == alarm.kind { periods + 1 } else { 1 });
        let steady = (self.kind.1 >= STEADY_PERIODS).then_some(alarm.kind).filter(|kind| self.told != Some(*kind))?;
        self.told = Some(steady);
        self.told
    }
}

/// What is said while the test runs: events on stdout (on stderr beside `--json`), the state of the motor on a
/// terminal.
struct Talk {
    json: bool,
    bar: ProgressBar,
    calling: Option<Calling>,
    last_s: f64,
}

impl Talk {
    fn new(json: bool) -> Self {
        // Hidden by itself where stderr is no terminal.
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {wide_msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { json, bar, calling: None, last_s: 0.0 }
    }

    fn event(&mut self, event: Event) {
        match event {
            Event::Waiting(voltage) => self.bar.set_message(format!("switch the motor on ({voltage:.0} V)")),
            Event::Begun(number) => self.say(&format!("{:8.2} s  test {number} begins", 0.0)),
            Event::Period(t, judged) => self.period(t, judged),
            Event::Broken(error) => self.bar.suspend(|| eprintln!("greyrig: {error}: trying again")),
            Event::Back(missed) => {
                self.bar.suspend(|| eprintln!("greyrig: the link is back; {missed} periods went by unseen"));
            }
        }
    }

    fn period(&mut self, t: f64, judged: &Period) {
        self.last_s = t;
        let (f, alarm) = (&judged.period.features, judged.period.alarm);
        if let Some(alarm) = alarm {
            match &mut self.calling {
                Some(calling) => {
                    if let Some(kind) = calling.again(t, &alarm) {
                        let ratio = calling.largest;
                        self.say(&format!("{t:8.2} s  it looks {}; {ratio:.1} times the limit", kind.name()));
                    }
                }
                None => {
                    let kind = (alarm.kind, 1);
                    self.calling = Some(Calling { last_s: t, largest: alarm.ratio, kind, told: None });
                    let (cause, ratio) = (alarm.cause.words(), alarm.ratio);
                    self.say(&format!("{t:8.2} s  alarm: {cause} at {ratio:.1} times the limit"));
                }
            }
        } else if let Some(calling) = self.calling.take_if(|calling| t - calling.last_s > QUIET_S) {
            self.say(&format!("{:8.2} s  quiet; at most {:.1} times the limit", calling.last_s, calling.largest));
        }
        let state = match (&self.calling, judged.period.judged) {
            (Some(_), _) => "ALARM",
            (None, true) => "no alarm",
            (None, false) => "not judged",
        };
        self.bar.set_message(format!(
            "{t:6.1} s  {:.0} V  {:.2} A  {:.0} rad/s  error {:.2} % current, {:.2} % speed  {state}",
            f.voltage_rms,
            f.current_rms,
            f.speed_mean,
            100.0 * f.current,
            100.0 * f.speed
        ));
    }

    fn say(&self, line: &str) {
        self.bar.suspend(|| {
            if self.json {
                eprintln!("{line}");
            } else {
                // A reader that has gone away is told nothing; the verdict goes to the exit code all the same.
                let _ = stdout::print_line(line);
            }
        });
    }

    fn end(&self) {
        self.bar.finish_and_clear();
    }
}
