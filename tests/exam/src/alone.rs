//! What each profile of the rig reveals by itself: each effect of a usual size, on each of them.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};

use greyrig_host::diagnose::VerdictKind;
use greyrig_host::error::Result;
use greyrig_host::model::{Kind, catalogue};
use greyrig_host::rig::{PROFILES, Profile};
use rayon::prelude::*;

use crate::cases::{Case, Excitation, STANDS_OUT, Sort, visible};
use crate::score::{Outcome, run};

/// What a verdict comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Told {
    /// The effect and nothing else.
    Named,
    /// The effect among rivals.
    AmongRivals,
    /// The effect, and another one that is not there.
    WithAnother,
    /// Structure that the catalogue does not hold.
    Outside,
    /// That the recording does not hold what it takes.
    Insufficient,
    /// Nothing, though the error stands out.
    Missed,
    /// Nothing, and the error does not stand out.
    Hidden,
    /// Another effect.
    Wrong,
}

impl Told {
    fn by(outcome: &Outcome, healthy: [f64; 2]) -> Self {
        match outcome.kind {
            VerdictKind::MissingEffect if outcome.exact() => Self::Named,
            VerdictKind::MissingEffect if outcome.hits() > 0 => Self::WithAnother,
            VerdictKind::Ambiguous if outcome.hits() > 0 => Self::AmongRivals,
            VerdictKind::MissingEffect | VerdictKind::Ambiguous => Self::Wrong,
            VerdictKind::OutsideCatalogue => Self::Outside,
            VerdictKind::InsufficientData => Self::Insufficient,
            VerdictKind::None if (0..2).any(|k| outcome.before[k] > STANDS_OUT * healthy[k]) => Self::Missed,
            VerdictKind::None => Self::Hidden,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Named => "named",
            Self::AmongRivals => "rivals",
            Self::WithAnother => "**and another**",
            Self::Outside => "outside",
            Self::Insufficient => "insufficient",
            Self::Missed => "missed",
            Self::Hidden => "–",
            Self::Wrong => "**wrong**",
        }
    }
}

/// A verdict, and what it comes to.
#[derive(Debug)]
struct Answer {
    told: Told,
    outcome: Outcome,
}

/// An effect, and the answers of the motors to each profile.
#[derive(Debug)]
struct Row {
    effect: &'static str,
    cells: Vec<Vec<Answer>>,
}

/// What each profile reveals of each effect.
#[derive(Debug)]
pub struct Table {
    profiles: Vec<&'static Profile>,
    /// Effect by effect; the last row is of healthy motors.
    rows: Vec<Row>,
}

impl Table {
    /// Asks so many motors of a kind; `tick` is called after each diagnosis.
    ///
    /// # Errors
    /// An interrupt.
    pub fn of(kind: Kind, motors: u64, tick: &(dyn Fn() + Sync)) -> Result<Self> {
        let profiles: Vec<&Profile> = PROFILES.iter().filter(|p| p.pm_dc || kind == Kind::Universal).collect();
        let ask = |effect: Option<&Sort>, profile| -> Result<Vec<Outcome>> {
            let excitation = Excitation::Alone(kind, profile);
            let outcomes = (1..=motors).into_par_iter().map(|seed| run(&Case::usual(effect, excitation, seed)));
            outcomes.inspect(|_| tick()).collect()
        };
        let healthy: Vec<Vec<Outcome>> = profiles.par_iter().map(|p| ask(None, p)).collect::<Result<_>>()?;
        let usual: Vec<[f64; 2]> = healthy.iter().map(|outcomes| largest(outcomes)).collect();
        let answers = |outcomes: Vec<Outcome>, k: usize| {
            outcomes.into_iter().map(|outcome| Answer { told: Told::by(&outcome, usual[k]), outcome }).collect()
        };
        let row = |sort: &Sort| {
            let cells = profiles.iter().enumerate().map(|(k, p)| Ok(answers(ask(Some(sort), p)?, k)));
            Ok(Row { effect: sort.id.id(), cells: cells.collect::<Result<_>>()? })
        };
        let mut rows: Vec<Row> = visible(kind).par_iter().map(row).collect::<Result<_>>()?;
        let cells = healthy.into_iter().enumerate().map(|(k, outcomes)| answers(outcomes, k)).collect();
        rows.push(Row { effect: "none", cells });
        Ok(Self { profiles, rows })
    }
}

/// The largest error of current and speed.
fn largest(outcomes: &[Outcome]) -> [f64; 2] {
    [0, 1].map(|k| outcomes.iter().map(|o| o.before[k]).fold(0.0, f64::max))
}

/// A word, or how often each.
fn in_words(answers: &[Answer]) -> String {
    let mut counts: BTreeMap<Told, usize> = BTreeMap::new();
    answers.iter().for_each(|answer| *counts.entry(answer.told).or_default() += 1);
    let alike = counts.len() == 1;
    let words =
        counts.iter().map(|(told, n)| if alike { told.word().to_owned() } else { format!("{n} {}", told.word()) });
    words.collect::<Vec<_>>().join(", ")
}

impl Display for Table {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.profiles.iter().map(|p| p.id).collect();
        writeln!(f, "| effect | {} |", names.join(" | "))?;
        writeln!(f, "| --- |{}", " --- |".repeat(names.len()))?;
        for row in &self.rows {
            let cells: Vec<String> = row.cells.iter().map(|answers| in_words(answers)).collect();
            writeln!(f, "| {} | {} |", row.effect, cells.join(" | "))?;
        }
        let cells = self.rows.iter().flat_map(|row| row.cells.iter().zip(&names));
        let all: Vec<(&Answer, &str)> =
            cells.flat_map(|(answers, name)| answers.iter().map(move |a| (a, *name))).collect();
        let of = |told: Told| all.iter().filter(|(answer, _)| answer.told == told).count();
        let counts = [Told::Named, Told::AmongRivals, Told::WithAnother, Told::Wrong].map(of);
        let [named, among, another, wrong] = counts;
        writeln!(
            f,
            "\nof {}: {named} named, {among} among rivals, {another} with another one, {wrong} wrong\n",
            all.len()
        )?;
        for (Answer { told, outcome }, profile) in &all {
            if matches!(told, Told::Wrong | Told::WithAnother | Told::Outside) {
                let truth = outcome.effects.join(" ");
                write!(f, "- {truth} on {profile}, motor {}: {}", outcome.seed, told.word())?;
                match outcome.named[..] {
                    [] => writeln!(f)?,
                    ref names => writeln!(f, " {}", catalogue::joined(names, ", "))?,
                }
            }
        }
        Ok(())
    }
}
