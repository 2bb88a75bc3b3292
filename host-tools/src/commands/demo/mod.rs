//! `greyrig demo`: the whole story on built-in data, without hardware.

mod attempts;
mod correction;
mod paper;
mod station;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde_json::{Value, json};

use super::words;
use crate::diagnose::{Diagnosis, Options, Progress, diagnose};
use crate::error::Result;
use crate::identify::Settings;
use crate::model::{Kind, Origin};
use crate::output;
use crate::recording::Recording;
use crate::report::Report;
use crate::report::figures::error_falling;
use attempts::{Attempts, Data};
use correction::Corrected;
use station::Station;

/// What the motor hides; the seed chooses. The first is a motor whose physical model alone is off by the paper's 20 %.
const HIDDEN: [&[&str]; 8] = [
    &["saturation=0.42", "hysteresis"],
    &["saturation:langevin=0.4", "brush_drop=4"],
    &["inductance_saturation=0.6"],
    &["hysteresis=0.4", "channel_delay=150e-6"],
    &["saturation=0.3", "eddy_current=150e-6"],
    &["current_compression=0.07", "brush_drop=3"],
    &["windage_exponent=2.8", "remanence=0.15"],
    &["channel_delay=120e-6"],
];

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
pub fn run(args: &Args) -> Result<ExitCode> {
    let report = args.report.clone().unwrap_or_else(unused_name);
    output::refuse_overwrite(&report, args.force)?;
    let say = |text: &str| if args.json { Ok(()) } else { output::print_line(text) };
    let story = Story::tell(args.seed, &say)?;
    if let Some(path) = &args.figure {
        let figure = error_falling(&story.attempts.steps(), story.attempts.noise_floor());
        output::write_file(path, args.force, |out| out.write_all(figure.as_bytes()))?;
    }
    story.report().write(&report, args.force)?;
    say(&format!("\nThe motor did hide: {}.\n\nreport: {}", story.hidden.join(" "), report.display()))?;
    if args.json {
        let files: Vec<_> = story.origins.iter().map(|origin| origin.file.clone()).collect();
        output::print_json("demo", &files, story.in_json(&report))?;
    }
    Ok(ExitCode::SUCCESS)
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
    fn tell(seed: u64, say: &Say<'_>) -> Result<Self> {
        let hidden = hidden(seed);
        say("1. A motor on the virtual rig: a 1.4 kW vacuum-cleaner motor at 50 Hz that hides something.\n   \
             Training: an amplitude staircase of 24 s. Held out: a ramp of 20 s, which no fit sees.\n")?;
        let data = Data::of(hidden, seed)?;

        let mut attempts = Attempts::without_effects(&data)?;
        say("2. The physical model by the paper's method, linear least squares in continuous time:\n")?;
        say(&words::parameters(&attempts.least_squares().identification))?;
        let physical = attempts.physical();
        say("\n3. The same model refined by output error, on the free run itself:\n")?;
        say(&words::parameters(&physical.identification))?;
        for note in &physical.identification.notes {
            say(&format!("note: {note}"))?;
        }
        say("\n4. Where it fails on the held-out ramp, in free run from the voltage alone:\n")?;
        say(&words::regions(&physical.held_out))?;

        say("\n5. Which effect of the catalogue is missing:\n")?;
        let diagnosis = diagnosed(&data.training)?;
        say(&super::diagnose::candidates(&diagnosis))?;
        say(&format!("\nverdict: {}\n{}", super::diagnose::headline(&diagnosis), diagnosis.verdict.text))?;

        attempts.add_each(&diagnosis.verdict.effects, &data)?;
        say("\n6. Added, and identified again:\n")?;
        say(&words::parameters(&attempts.improved().identification))?;
        say("\n7. The error falls, on the ramp that no fit has seen:\n")?;
        say(&attempts.table())?;

        say(
            "\n8. A learned correction (ANFIS) beside the model, and how much of the current it makes, from 1 s on:\n",
        )?;
        let corrections = [
            Corrected::new("physical model", attempts.physical().model(), &data)?,
            Corrected::new("with what was missing", attempts.improved().model(), &data)?,
        ];
        say(&correction::table(&corrections))?;

        say("\n9. Ten healthy motors of the type (3 % scatter) teach the detector; then three others are judged:\n")?;
        let station = Station::run(&corrections[1].model, hidden)?;
        say(&station.table())?;
        Ok(Self { seed, hidden, origins: data.origins(), attempts, diagnosis, corrections, station })
    }

    fn report(&self) -> Report<'_> {
        let [alone, with_correction] = &self.corrections[0].comparisons;
        let (physical, improved) = (self.attempts.physical(), self.attempts.improved());
        let page = Report::new("A motor with a hidden effect")
            .lead(format!(
                "What the physical model alone explains of a motor that hides something, where it fails, what is missing, and \
                 what is left once that is in it. Verdict: {}.",
                super::diagnose::headline(&self.diagnosis)
            ))
            .waterfall(
                "Error-to-signal ratio on the held-out ramp",
                &self.attempts.steps(),
                self.attempts.noise_floor(),
            )
            .text("Why", self.diagnosis.verdict.text.clone())
            .table("Candidates", super::diagnose::candidates_in_report(&self.diagnosis))
            .table("A learned correction beside the model", correction::in_report(&self.corrections))
            .table("Motors judged", self.station.in_report());
        paper::figures(page, alone, with_correction, &self.station.of_the_type)
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
fn diagnosed(training: &[Recording]) -> Result<Diagnosis> {
    let options = Options { settings: Settings::new(Kind::Universal), exclude: Vec::new(), candidates_refined: true };
    let bar = output::progress("diagnosis", 40);
    let diagnosis = diagnose(training, &options, &|at| {
        if let Progress::Doing(what) = at {
            bar.set_message(what.to_owned());
        }
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    Ok(diagnosis)
}

/// What the motor of a seed hides.
fn hidden(seed: u64) -> &'static [&'static str] {
    HIDDEN[(seed.saturating_sub(1) % HIDDEN.len() as u64) as usize]
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
