//! `greyrig identify`: recordings to a model file.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::ValueEnum;

use super::input::{self, Input};
use super::stdout;
use super::terminal::Terminal;
use super::words;
use crate::answers::identify::{Answer, Request};
use crate::answers::next::CommandLine;
use crate::between::Course;
use crate::error::Result;
use crate::identify::Method;
use crate::model::{Assignment, Base, Kind, catalogue};
use crate::output;
use crate::term::Formula;

/// Physical parameters with 95 % intervals from recordings of one motor type.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  greyrig identify run1.csv run2.csv --out model.toml\n  \
    greyrig identify servo.csv --kind pm-dc --base viscous --fix R=3.4 --fix L=2.85e-3 --out model.toml")]
pub struct Args {
    #[command(flatten)]
    input: Input,
    /// Model file to write
    #[arg(long, value_name = "MODEL.toml")]
    out: Option<PathBuf>,
    /// Kind of motor; by itself what the recordings tell as their `motor`, or else universal
    #[arg(long, value_enum)]
    kind: Option<Kind>,
    /// How far the estimation goes
    #[arg(long, value_enum, default_value = "output-error")]
    method: Method,
    /// Friction terms of the base model [default: full for universal, dry-viscous for pm-dc]
    #[arg(long, value_enum)]
    base: Option<Base>,
    /// Effect of the catalogue that the model shall have besides (repeatable)
    #[arg(long, value_name = "ID")]
    effect: Vec<String>,
    /// Term of your own in the voltage balance, or after `torque:` in the torque balance, such as 'k*i*abs(i)'
    /// (repeatable)
    #[arg(long, value_name = "FORMULA")]
    term: Vec<Formula>,
    /// Parameter with a known value, SI (repeatable)
    #[arg(long, value_name = "NAME=VALUE")]
    fix: Vec<Assignment>,
    /// Parameter with bounds, SI (repeatable)
    #[arg(long, value_name = "NAME=LEAST:GREATEST", value_parser = parse_bound)]
    bound: Vec<(String, f64, f64)>,
    /// What the voltage does between its samples [default: what the data tell, where they are sampled slowly; else
    /// smooth]
    #[arg(long = "input", value_enum, value_name = "COURSE")]
    course: Option<Course>,
    /// Cut-off of the Butterworth filter, Hz [default: 250; from the data where only torque and motion are recorded]
    #[arg(long, value_name = "HZ")]
    cutoff: Option<f64>,
    /// Order of the Butterworth filter
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u8).range(1..=8))]
    order: u8,
    /// Replace an existing model file
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

impl Args {
    /// The command that goes on: which effect is missing.
    fn next(&self) -> CommandLine {
        let line = self.input.files().again(CommandLine::new("diagnose"));
        if let Some(model) = &self.out {
            return line.option("--model", [model.display()]);
        }
        let base = self.base.and_then(|base| base.to_possible_value()).map(|base| base.get_name().to_owned());
        line.option("--kind", self.kind)
            .option("--base", base)
            .option("--fix", self.fix.iter().map(|fixed| format!("{}={}", fixed.name, fixed.value)))
            .option("--input", self.course.map(Course::name))
    }
}

fn parse_bound(text: &str) -> std::result::Result<(String, f64, f64), String> {
    let fail = || format!("{text:?} is not NAME=LEAST:GREATEST, such as J=1e-4:3e-4");
    let (name, range) = text.split_once('=').ok_or_else(fail)?;
    let (low, high) = range.split_once(':').ok_or_else(fail)?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(fail);
    Ok((name.trim().to_owned(), number(low)?, number(high)?))
}

/// Runs the command.
///
/// # Errors
/// Recordings from which nothing can be identified, or a file that cannot be written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    if let Some(path) = &args.out {
        output::refuse_overwrite(path, args.force)?;
    }
    let request = Request {
        kind: args.kind,
        method: args.method,
        base: args.base,
        effects: catalogue::effects(&args.effect)?,
        terms: args.term.clone(),
        fixed: args.fix.clone(),
        bounds: args.bound.clone(),
        course: args.course,
        cutoff_hz: args.cutoff,
        order: Some(args.order),
    };
    request.check()?;
    let given = request.question(args.input.load(&terminal.context())?);
    input::tell(&given.findings);
    let answer = terminal.watching("output error", |ctx| request.answer(given, ctx))?;
    let Answer { identification, comparison, .. } = &answer;
    if let Some(path) = &args.out {
        identification.model.save(path, args.force)?;
    }
    if args.json {
        stdout::print_as_it_is(&answer.as_json(args.out.as_deref())?.to_string())?;
        return Ok(ExitCode::SUCCESS);
    }
    stdout::print_line(&words::parameters(identification))?;
    if let Some(flux) = &identification.flux {
        stdout::print_line(&words::flux(flux))?;
    }
    for note in &identification.notes {
        stdout::print_line(&words::note(note))?;
    }
    if let Some(comparison) = comparison {
        stdout::print_line(&format!("\n{}", words::errors(comparison)))?;
    }
    if let Some(path) = &args.out {
        stdout::print_line(&format!("\nwritten: {}", path.display()))?;
    }
    stdout::print_next(Some(&args.next()))?;
    Ok(ExitCode::SUCCESS)
}
