//! `cargo xtask exam`: runs the examination.

use std::collections::BTreeMap;
use std::io::Write;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::Parser;
use greyrig_exam::alone::Table;
use greyrig_exam::calibration::Reliability;
use greyrig_exam::cases::{Case, Excitation, Question, STANDS_OUT};
use greyrig_exam::ending::{self, Ending, Steps};
use greyrig_exam::recovery::{self, Recovery};
use greyrig_exam::rig::{self, KINDS, Kind, Said, Verdict};
use greyrig_exam::score::{Outcome, run};
use greyrig_exam::share::Share;
use greyrig_exam::{balances, export};
use greyrig_host::diagnose::VerdictKind;
use greyrig_host::model::{self, catalogue};
use greyrig_host::recording::Channel;
use rayon::prelude::*;

/// Prints a line. Where nobody reads any further (`| head`) there is nothing left to ask.
macro_rules! say {
    ($($line:tt)*) => {
        if writeln!(std::io::stdout().lock(), $($line)*).is_err() {
            std::process::exit(1);
        }
    };
}

/// The examination of the diagnosis.
#[derive(Debug, Parser)]
struct Args {
    /// Cases for each question
    #[arg(long, default_value_t = 320)]
    cases: u64,
    /// Questions to ask, such as one-ac, two-set or rig-counts (`rig-*`: all of these); all without
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// First number
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// These numbers and no others
    #[arg(long, value_delimiter = ',', conflicts_with_all = ["cases", "seed"])]
    seeds: Vec<u64>,
    /// Write the cases to this directory instead of diagnosing them
    #[arg(long, value_name = "DIR")]
    export: Option<std::path::PathBuf>,
    /// Add what was named in this many of the cases with one effect, and report what that recovers
    #[arg(long, default_value_t = 0)]
    add: usize,
    /// Add what was named in all cases, and report the error of the balances on a ramp
    #[arg(long)]
    balances: bool,
    /// Add what was named, all at once and one by one, and ask the model again until nothing is named
    #[arg(long = "loop")]
    follow: bool,
    /// Diagnose each effect, of a usual size, on each profile by itself, in this many motors of either kind, and print
    /// what each profile reveals
    #[arg(long, value_name = "MOTORS", conflicts_with_all = ["cases", "only", "seed", "seeds", "export", "add", "balances", "follow", "verbose"])]
    alone: Option<u64>,
    /// Of rig-* questions: diagnose the motor behind the damage, instead of asking what the damage is
    #[arg(long)]
    diagnose: bool,
    /// Write the reliability diagram of all that is asked to this SVG file
    #[arg(long, value_name = "FILE")]
    reliability: Option<std::path::PathBuf>,
    /// Print each case as a line of JSON
    #[arg(long)]
    verbose: bool,
}

impl Args {
    /// Numbers of the cases.
    fn numbers(&self) -> Vec<u64> {
        if self.seeds.is_empty() { (self.seed..self.seed + self.cases).collect() } else { self.seeds.clone() }
    }
}

/// Healthy motors that tell what stands out where the question is another one.
const HEALTHY: u64 = 12;

const QUESTIONS: &[(&str, Question)] = &[
    ("none", Question::None),
    ("one", Question::One),
    ("rarer", Question::Rarer),
    ("withheld", Question::Withheld),
    ("two", Question::Two),
    ("three", Question::Three),
    ("five", Question::Five),
    ("prior", Question::Prior),
];

fn main() -> ExitCode {
    let args = Args::parse();
    if let Some(motors) = args.alone {
        return alone(motors);
    }
    let of_data: Vec<&Kind> =
        KINDS.iter().filter(|k| args.only.is_empty() || args.only.iter().any(|o| k.is_asked(o))).collect();
    for kind in of_data {
        if let Some(folder) = &args.export {
            let folder = folder.join(format!("rig-{}", kind.name));
            let written = args.numbers().into_par_iter().try_for_each(|seed| rig::export(kind, seed, &folder));
            if let Err(error) = written {
                eprintln!("{error}");
                return ExitCode::FAILURE;
            }
        } else if args.diagnose {
            motors(kind, args.numbers(), args.verbose);
        } else {
            data(kind, args.numbers(), args.verbose);
        }
    }
    let mut all: Vec<Outcome> = Vec::new();
    for (noise, label) in [(1.0, ""), (5.0, "-noisy")] {
        for excitation in Excitation::ALL {
            let suffix = excitation.name();
            let mut healthy = [0.0; 2];
            for (name, question) in QUESTIONS.iter().filter(|(_, question)| excitation.has(*question)) {
                let id = format!("{name}-{suffix}{label}");
                let asked = |id: &str| args.only.is_empty() || args.only.iter().any(|o| o == id);
                let needed = *name == "none" && QUESTIONS.iter().any(|(n, _)| asked(&format!("{n}-{suffix}{label}")));
                if let Some(folder) = &args.export {
                    if asked(&id) && !export(*question, excitation, noise, &args, &folder.join(&id)) {
                        return ExitCode::FAILURE;
                    }
                    continue;
                }
                if !asked(&id) && !needed {
                    continue;
                }
                let seeds = if asked(&id) { args.numbers() } else { (1..=HEALTHY).collect() };
                let outcomes = ask(*question, excitation, noise, seeds, args.verbose);
                if *name == "none" {
                    healthy = [0, 1].map(|k| median(outcomes.iter().map(|o| o.before[k]).collect()));
                }
                if asked(&id) {
                    report(&id, *question, &outcomes, healthy);
                    if args.balances {
                        balances(*question, excitation, noise, &outcomes);
                    }
                    if args.follow {
                        endings(*question, excitation, noise, &outcomes);
                    }
                    if *name == "one" && args.add > 0 {
                        recover(*question, excitation, noise, &outcomes, healthy, args.add);
                    }
                    all.extend(outcomes);
                }
            }
        }
    }
    if let Some(file) = &args.reliability {
        let reliability = Reliability::of_outcomes(&all);
        say!("## all\n{reliability}");
        if let Err(error) = std::fs::write(file, reliability.figure()) {
            eprintln!("{}: {error}", file.display());
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// Asks `check` about recordings with one kind of damage.
fn data(kind: &Kind, seeds: Vec<u64>, verbose: bool) {
    let answers: Vec<_> = seeds.into_par_iter().map(|seed| rig::ask(kind, seed)).collect();
    let (answers, refused): (Vec<_>, Vec<_>) = answers.into_iter().partition(Result::is_ok);
    let answers: Vec<rig::Answer> = answers.into_iter().filter_map(Result::ok).collect();
    let beside = answers.iter().filter(|a| a.false_alarms(kind) > 0).count();
    say!("rig-{}: named {}, {beside} with a false alarm", kind.name, Share::of(&answers, |a| a.named));
    refused.into_iter().filter_map(Result::err).for_each(|error| eprintln!("{error}"));
    if verbose {
        for answer in answers.iter().filter(|a| !a.named || a.false_alarms(kind) > 0) {
            let codes: Vec<String> = answer
                .findings
                .iter()
                .map(|f| format!("{}({})", f.code, f.channel.map_or("", Channel::column)))
                .collect();
            say!(
                "    {} {} {}: {}",
                if answer.named { "+" } else { "-" },
                answer.title,
                answer.damage,
                codes.join(" ")
            );
        }
    }
}

/// Asks `diagnose` about motors behind one kind of damage.
fn motors(kind: &Kind, seeds: Vec<u64>, verbose: bool) {
    let (said, failed): (Vec<_>, Vec<_>) =
        seeds.into_par_iter().map(|seed| rig::diagnosed(kind, seed)).partition(Result::is_ok);
    let said: Vec<Verdict> = said.into_iter().filter_map(Result::ok).collect();
    let (healthy, ill): (Vec<&Verdict>, Vec<&Verdict>) = said.iter().partition(|v| v.healthy);
    let seen: Vec<&Verdict> = ill.into_iter().filter(|v| v.is_seen()).collect();
    let refused = said.iter().filter(|v| v.behind == Said::Refused).count();
    say!(
        "rig-{}: healthy accused {}; effect named alone {}, wrong {}; {refused} refused",
        kind.name,
        Share::of(&healthy, |v| v.is_accused()),
        Share::of(&seen, |v| v.behind == Said::Right),
        Share::of(&said, |v| v.behind == Said::Wrong),
    );
    failed.into_iter().filter_map(Result::err).for_each(|error| eprintln!("{error}"));
    if verbose {
        let told = |v: &&Verdict| if v.healthy { v.is_accused() } else { v.behind == Said::Wrong || v.is_seen() };
        for verdict in said.iter().filter(told).filter(|v| v.behind != Said::Right) {
            say!("    {verdict}");
        }
    }
}

/// Prints what each profile reveals by itself.
fn alone(motors: u64) -> ExitCode {
    for kind in [model::Kind::Universal, model::Kind::PmDc] {
        let done = AtomicUsize::new(0);
        let tick = || {
            let n = done.fetch_add(1, Ordering::Relaxed);
            if n.is_multiple_of(20) {
                eprintln!("{kind} {n}");
            }
        };
        match Table::of(kind, motors, &tick) {
            Ok(table) => say!("## {kind}\n\n{table}"),
            Err(error) => {
                eprintln!("{error}");
                return ExitCode::FAILURE;
            }
        }
    }
    ExitCode::SUCCESS
}

/// Whether all cases of a question could be written.
fn export(question: Question, excitation: Excitation, noise: f64, args: &Args, folder: &std::path::Path) -> bool {
    let written = args
        .numbers()
        .into_par_iter()
        .try_for_each(|seed| export::export(&Case::new(question, excitation, noise, seed), folder));
    if let Err(error) = &written {
        eprintln!("{error}");
    }
    written.is_ok()
}

fn ask(question: Question, excitation: Excitation, noise: f64, seeds: Vec<u64>, verbose: bool) -> Vec<Outcome> {
    let (count, done) = (seeds.len(), AtomicUsize::new(0));
    seeds
        .into_par_iter()
        .filter_map(|seed| {
            let case = Case::new(question, excitation, noise, seed);
            let outcome = run(&case);
            let n = done.fetch_add(1, Ordering::Relaxed);
            if n.is_multiple_of(20) {
                eprintln!("{question:?} {excitation:?} {n}/{count}");
            }
            match outcome {
                Ok(o) => {
                    if verbose {
                        say!("{}", serde_json::to_string(&o).unwrap_or_default());
                    }
                    Some(o)
                }
                Err(error) => {
                    eprintln!("case {}: {error}", case.seed);
                    None
                }
            }
        })
        .collect()
}

/// What each effect was named, where it stands out.
fn confusion(outcomes: &[&Outcome]) {
    let mut named: BTreeMap<&str, BTreeMap<String, usize>> = BTreeMap::new();
    for o in outcomes {
        let verdict = if o.named.is_empty() { format!("({:?})", o.kind) } else { catalogue::joined(&o.named, " + ") };
        *named.entry(o.truth.first().map_or("(nothing)", |id| id.id())).or_default().entry(verdict).or_default() += 1;
    }
    say!("\n| truth | cases | verdict |\n| --- | --- | --- |");
    for (truth, verdicts) in named {
        let cases: usize = verdicts.values().sum();
        let list: Vec<String> = verdicts.iter().map(|(verdict, n)| format!("{verdict} {n}")).collect();
        say!("| {truth} | {cases} | {} |", list.join(", "));
    }
    say!("");
}

/// Adds the named effects in cases whose error stands out in the current.
fn recover(
    question: Question,
    excitation: Excitation,
    noise: f64,
    outcomes: &[Outcome],
    healthy: [f64; 2],
    most: usize,
) {
    let chosen: Vec<&Outcome> = outcomes
        .iter()
        .filter(|o| o.exact() && o.before[0] >= STANDS_OUT * healthy[0] && !o.truth.is_empty())
        .take(most)
        .collect();
    let recovered: Vec<Recovery> = chosen
        .par_iter()
        .filter_map(|o| recovery::add(&Case::new(question, excitation, noise, o.seed), o).ok())
        .collect();
    let mut shares: Vec<f64> = recovered.iter().map(Recovery::share).collect();
    shares.sort_by(f64::total_cmp);
    let at = |share: f64| shares.get((share * shares.len() as f64) as usize).copied().unwrap_or(f64::NAN);
    say!("added in {} cases: recovered median {:.3}, 10th percentile {:.3}", shares.len(), at(0.5), at(0.1));
    for (k, name) in ["R", "J", "K φ at the largest current"].into_iter().enumerate() {
        say!("{name} in its interval: {}", Share::of(&recovered, |r| r.off[k] <= 1.0));
    }
    for r in recovered.iter().filter(|r| r.share() < 0.7 || !r.off.iter().all(|off| *off <= 1.0)) {
        let [before, after, floor] = r.esr;
        let [resistance, inertia, flux] = r.off;
        say!(
            "- {}: {before:.5} -> {after:.5}, floor {floor:.5}; off by {resistance:.1} {inertia:.1} {flux:.1} half widths",
            r.seed
        );
    }
    say!("");
}

/// How loops end that began with named effects.
fn endings(question: Question, excitation: Excitation, noise: f64, outcomes: &[Outcome]) {
    let begun: Vec<&Outcome> = outcomes.iter().filter(|o| o.kind == VerdictKind::MissingEffect).collect();
    for steps in Steps::ALL {
        let follow = |o: &&Outcome| ending::follow(&Case::new(question, excitation, noise, o.seed), o, steps);
        let (ended, failed): (Vec<_>, Vec<_>) = begun.par_iter().map(follow).partition(Result::is_ok);
        let ended: Vec<Ending> = ended.into_iter().filter_map(Result::ok).collect();
        say!("loop, {}: ends with none {}", steps.words(), Share::of(&ended, Ending::is_none));
        failed.into_iter().filter_map(Result::err).for_each(|error| eprintln!("{error}"));
        ended.iter().filter(|e| !e.is_none()).for_each(|e| say!("    {e}"));
    }
    say!("");
}

/// Errors of the balances on the held-out ramp.
fn balances(question: Question, excitation: Excitation, noise: f64, outcomes: &[Outcome]) {
    let all: Vec<_> = outcomes
        .par_iter()
        .filter_map(|o| balances::left(&Case::new(question, excitation, noise, o.seed), o).ok())
        .collect();
    for (k, name) in ["voltage", "torque"].into_iter().enumerate() {
        let [before, after] = [all.iter().map(|l| l.0[k]).collect(), all.iter().map(|l| l.1[k]).collect()].map(median);
        say!("held-out error of the {name} balance, median of {}: {before:.5} -> {after:.5}", all.len());
    }
    say!("");
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn report(id: &str, question: Question, outcomes: &[Outcome], healthy: [f64; 2]) {
    say!("## {id}");
    let times: Vec<f64> = outcomes.iter().map(|o| o.seconds).collect();
    say!("time: median {:.1} s, longest {:.1} s", median(times.clone()), times.iter().fold(0.0f64, |m, t| m.max(*t)));
    let decoys = outcomes.iter().fold([0, 0], |s, o| [s[0] + o.decoys[0], s[1] + o.decoys[1]]);
    say!("decoys accepted: {}", Share { hits: decoys[1], cases: decoys[0] });
    let out: Vec<&Outcome> = outcomes.iter().filter(|o| o.stands_out(healthy)).collect();
    match question {
        Question::None => {
            say!("verdict none: {}", Share::of(outcomes, |o| o.kind == VerdictKind::None));
            say!("named something: {}", Share::of(outcomes, |o| o.kind == VerdictKind::MissingEffect));
        }
        Question::One | Question::Rarer => {
            say!("error stands out in {} of {}", out.len(), outcomes.len());
            let right = |o: &&Outcome| o.first_right() && o.kind != VerdictKind::OutsideCatalogue;
            say!("right first: {}", Share::of(&out, right));
            say!("exact: {}", Share::of(&out, |o| o.exact()));
            let ambiguous: Vec<&&Outcome> = out.iter().filter(|o| o.kind == VerdictKind::Ambiguous).collect();
            say!("truth in the ambiguous set: {}", Share::of(ambiguous.iter().copied(), |o| o.hits() == 1));
            let sizes: usize = ambiguous.iter().map(|o| o.named.len()).sum();
            say!("mean set size: {:.2}", sizes as f64 / ambiguous.len().max(1) as f64);
            let wrong = |o: &&Outcome| o.kind == VerdictKind::MissingEffect && !o.first_right();
            say!("confident wrong name: {}", Share::of(&out, wrong));
        }
        Question::Withheld => {
            say!("error stands out in {} of {}", out.len(), outcomes.len());
            let honest = |o: &&Outcome| matches!(o.kind, VerdictKind::OutsideCatalogue | VerdictKind::Ambiguous);
            say!("outside the catalogue or ambiguous: {}", Share::of(&out, honest));
            say!("confident wrong name: {}", Share::of(&out, |o| o.kind == VerdictKind::MissingEffect));
        }
        Question::Two | Question::Three | Question::Five | Question::Prior => {
            say!("exactly these: {}", Share::of(outcomes, Outcome::exact));
            say!("first right: {}", Share::of(outcomes, Outcome::first_right));
            let hits: usize = outcomes.iter().map(Outcome::hits).sum();
            let named: usize = outcomes.iter().map(|o| o.named.len()).sum();
            let truth: usize = outcomes.iter().map(|o| o.truth.len()).sum();
            say!("precision {:.3}, recall {:.3}", hits as f64 / named.max(1) as f64, hits as f64 / truth.max(1) as f64);
            let ambiguous: Vec<&Outcome> = outcomes.iter().filter(|o| o.kind == VerdictKind::Ambiguous).collect();
            let all = |o: &&Outcome| o.hits() == o.truth.len();
            say!("all of the truth in the ambiguous set: {}", Share::of(&ambiguous, all));
            let sizes = ambiguous.iter().map(|o| o.named.len() as f64 / o.truth.len() as f64).sum::<f64>();
            // The sum of nothing is -0.
            say!("names for each true effect there: {:.2}", (sizes + 0.0) / ambiguous.len().max(1) as f64);
        }
    }
    // Of a motor whose effect is withheld or hardly there, nobody can say what the right answer would have been.
    if question != Question::Withheld {
        let judged: Vec<&Outcome> = match question {
            Question::One | Question::Rarer => out.clone(),
            _ => outcomes.iter().collect(),
        };
        say!("{}", Reliability::of_outcomes(judged));
    }
    if matches!(question, Question::One | Question::Rarer) {
        confusion(&out);
    }
    for o in outcomes.iter().filter(|o| match question {
        Question::None => o.kind != VerdictKind::None,
        Question::One | Question::Rarer => o.stands_out(healthy) && !o.exact(),
        Question::Withheld => o.stands_out(healthy) && o.kind == VerdictKind::MissingEffect,
        _ => !o.exact(),
    }) {
        say!(
            "- {} {}: {:?} {} ({:.4}/{:.5} -> {:.4}/{:.5}) {:.1} s",
            o.seed,
            o.effects.join(" "),
            o.kind,
            catalogue::joined(&o.named, " "),
            o.before[0],
            o.before[1],
            o.after[0],
            o.after[1],
            o.seconds
        );
    }
    say!("");
}
