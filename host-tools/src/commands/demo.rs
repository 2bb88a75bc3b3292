//! `greyrig demo`: the whole story on built-in data, without hardware.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde_json::{Value, json};

use super::stdout;
use super::table::{Cell, Column, Table as Shown};
use super::terminal::Terminal;
use super::words;
use crate::answers::next::CommandLine;
use crate::compare::PerSignal;
use crate::demo::{Attempts, Corrected, Data, Station, figures, hidden};
use crate::diagnose::{Diagnosis, Options, diagnose};
use crate::error::Result;
use crate::identify::Settings;
use crate::model::{Kind, Origin};
use crate::output;
use crate::recording::Recording;
use crate::report::figures::error_falling;
use crate::report::{Report, Table};

/// The whole story on built-in data: simulate a motor that hides something, identify, compare,
/// see where it fails, learn what is missing, add it, watch the error fall, and judge motors by it.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig demo --report demo.html")]
pub struct Args {
    /// Report to write [default: greyrig-demo.html, with a number if that exists]
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Picture of the errors to write, SVG
    #[arg(long, value_name = "FILE.svg")]
    figure: Option<PathBuf>,
    /// What the motor hides, and the noise of the virtual rig
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Replace an existing report
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A report that cannot be written, or an interrupt.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let report = args.report.clone().unwrap_or_else(unused_name);
    output::refuse_overwrite(&report, args.force)?;
    let say = |text: &str| if args.json { Ok(()) } else { stdout::print_line(text) };
    let story = Story::tell(args.seed, terminal, &say)?;
    if let Some(path) = &args.figure {
        let figure = error_falling(&story.attempts.steps(), story.attempts.noise_floor());
        output::write_file(path, args.force, |out| out.write_all(figure.as_bytes()))?;
    }
    story.report().write(&report, args.force)?;
    say(&format!("\nThe motor did hide: {}.\n\nreport: {}", story.hidden.join(" "), report.display()))?;
    if !args.json {
        stdout::print_next(Some(&CommandLine::new("serve")))?;
    }
    if args.json {
        let files: Vec<_> = story.origins.iter().map(|origin| origin.file.clone()).collect();
        stdout::print_json("demo", &files, story.in_json(&report))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Columns of the ways to a model.
const WAYS: [&str; 3] = ["model", "current", "speed"];
/// Columns of the corrections.
const CORRECTIONS: [&str; 4] = ["model", "current", "with correction", "black box"];
/// Columns of the motors that are judged.
const MOTORS: [&str; 3] = ["motor", "verdict", "why"];

fn in_terminal<const N: usize, T: Into<Cell>>(columns: [&str; N], rows: impl IntoIterator<Item = [T; N]>) -> String {
    let mut table = Shown::new(columns.map(|title| match title {
        "model" | "motor" | "verdict" => Column::text(title),
        "why" => Column::prose(title),
        figure => Column::figure(figure),
    }));
    table.rows(rows);
    table.to_string()
}

fn in_report<const N: usize>(caption: &str, columns: [&str; N], rows: impl Iterator<Item = [String; N]>) -> Table {
    let rows = rows.map(|row| row.to_vec()).collect();
    Table { caption: caption.to_owned(), columns: columns.map(str::to_owned).to_vec(), rows }
}

fn attempts_rows(attempts: &Attempts) -> Vec<[String; 3]> {
    let row = |label: &str, of: PerSignal| [label.to_owned(), words::percent(of.current), words::percent(of.speed)];
    let floor = row("noise floor", attempts.noise_floor());
    attempts.iter().map(|a| row(&a.label, a.held_out.esr)).chain([floor]).collect()
}

fn correction_row(corrected: &Corrected) -> [String; 4] {
    let [before, after] = corrected.errors().map(words::percent);
    [corrected.label.to_owned(), before, after, words::percent(corrected.share)]
}

fn corrections_in_report(corrections: &[Corrected]) -> Table {
    let caption = "Error-to-signal ratio of the current on the held-out ramp from 1 s on, and the part of the current that the \
                   correction makes: the more is named, the less is black box";
    in_report(caption, CORRECTIONS, corrections.iter().map(correction_row))
}

fn station_rows(station: &Station) -> impl Iterator<Item = [String; 3]> {
    station.tests.iter().map(|(label, test)| {
        let why = test.alarms.first().map_or_else(String::new, |a| {
            format!("{} at {:.2} s, {:.0} times the limit: {}", a.cause, a.t_s, a.ratio, a.suspect)
        });
        [(*label).to_owned(), test.verdict.words().to_owned(), why]
    })
}

fn station_in_report(station: &Station) -> Table {
    in_report("Other motors of the type, judged by limits from ten healthy ones", MOTORS, station_rows(station))
}

/// Who is told each chapter.
type Say<'a> = dyn Fn(&str) -> Result<()> + 'a;

/// What came out.
struct Story {
    seed: u64,
    hidden: &'static [&'static str],
    origins: Vec<Origin>,
    attempts: Attempts,
    diagnosis: Diagnosis,
    /// Of the physical model by itself, and with what was missing.
    corrections: [Corrected; 2],
    station: Station,
}

impl Story {
    fn tell(seed: u64, terminal: &Terminal, say: &Say<'_>) -> Result<Self> {
        let (hidden, ctx) = (hidden(seed), &terminal.context());
        say("1. A motor on the virtual rig: a 1.4 kW vacuum-cleaner motor at 50 Hz that hides something.\n   \
             Training: an amplitude staircase of 24 s. Held out: a ramp of 20 s, which no fit sees.\n")?;
        let data = Data::of(hidden, seed, ctx)?;

        let mut attempts = Attempts::without_effects(&data, ctx)?;
        say("2. The physical model by the paper's method, linear least squares in continuous time:\n")?;
        say(&words::parameters(&attempts.least_squares().identification))?;
        let physical = attempts.physical();
        say("\n3. The same model refined by output error, on the free run itself:\n")?;
        say(&words::parameters(&physical.identification))?;
        for note in &physical.identification.notes {
            say(&words::note(note))?;
        }
        say("\n4. Where it fails on the held-out ramp, in free run from the voltage alone:\n")?;
        say(&words::regions(&physical.held_out))?;

        say("\n5. Which effect of the catalogue is missing:\n")?;
        let diagnosis = diagnosed(&data.training, terminal)?;
        say(&super::diagnose::candidates(&diagnosis))?;
        say(&format!("\nverdict: {}\n{}", diagnosis.headline(), diagnosis.verdict.text))?;

        attempts.add_each(&diagnosis.verdict.effects, &data, ctx)?;
        say("\n6. Added, and identified again:\n")?;
        say(&words::parameters(&attempts.improved().identification))?;
        say("\n7. The error falls, on the ramp that no fit has seen:\n")?;
        say(&in_terminal(WAYS, attempts_rows(&attempts)))?;

        say(
            "\n8. A learned correction (ANFIS) beside the model, and how much of the current it makes, from 1 s on:\n",
        )?;
        let corrections = [
            Corrected::new("physical model", attempts.physical().model(), &data, ctx)?,
            Corrected::new("with what was missing", attempts.improved().model(), &data, ctx)?,
        ];
        say(&in_terminal(CORRECTIONS, corrections.iter().map(correction_row)))?;

        say("\n9. Ten healthy motors of the type (3 % scatter) teach the detector; then three others are judged:\n")?;
        let station = Station::run(&corrections[1].model, hidden, ctx)?;
        let verdicts = station.tests.iter().map(|(_, test)| words::outcome(test.verdict));
        let judged = station_rows(&station).zip(verdicts);
        say(&in_terminal(MOTORS, judged.map(|([motor, _, why], verdict)| [motor.into(), verdict, why.into()])))?;
        Ok(Self { seed, hidden, origins: data.origins(), attempts, diagnosis, corrections, station })
    }

    fn report(&self) -> Report<'_> {
        let [alone, with_correction] = &self.corrections[0].comparisons;
        let (physical, improved) = (self.attempts.physical(), self.attempts.improved());
        let page = Report::new("A motor with a hidden effect")
            .lead(format!(
                "What the physical model alone explains of a motor that hides something, where it fails, what is missing, and \
                 what is left once that is in it. Verdict: {}.",
                self.diagnosis.headline()
            ))
            .waterfall(
                "Error-to-signal ratio on the held-out ramp",
                &self.attempts.steps(),
                self.attempts.noise_floor(),
            )
            .text("Why", self.diagnosis.verdict.text.clone())
            .table("Candidates", crate::answers::diagnose::candidates_in_report(&self.diagnosis))
            .table("A learned correction beside the model", corrections_in_report(&self.corrections))
            .table("Motors judged", station_in_report(&self.station));
        figures(page, alone, with_correction, &self.station.of_the_type)
            .comparison("Physical model alone", &physical.held_out, physical.model())
            .comparison("With what was missing", &improved.held_out, improved.model())
            .recordings(&self.origins)
            .fact("Command", format!("greyrig demo --seed {}", self.seed))
    }

    fn in_json(&self, report: &Path) -> Value {
        json!({
            "attempts": self.attempts.in_json(),
            "noise_floor": self.attempts.noise_floor(),
            "where": self.attempts.physical().held_out.regions,
            "hidden": self.hidden,
            "verdict": self.diagnosis.verdict,
            "corrections": self.corrections.each_ref().map(Corrected::in_json),
            "motors": self.station.in_json(),
            "report": report,
        })
    }
}

/// What the diagnosis says of recordings.
fn diagnosed(training: &[Recording], terminal: &Terminal) -> Result<Diagnosis> {
    let options = Options { settings: Settings::new(Kind::Universal), exclude: Vec::new(), candidates_refined: true };
    terminal.watching("diagnosis", |ctx| diagnose(training, &options, ctx))
}

/// A name that no file has yet.
fn unused_name() -> PathBuf {
    (1..)
        .map(
            |n| {
                if n == 1 {
                    PathBuf::from("greyrig-demo.html")
                } else {
                    PathBuf::from(format!("greyrig-demo-{n}.html"))
                }
            },
        )
        .find(|path| !path.exists())
        .unwrap_or_default()
}
